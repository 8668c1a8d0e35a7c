"""The tip relief with the least transmission error at one torque, and whether it is a minimum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.supports import RIGID, Supports
from femgear.design.parameters import two_pair_length
from femgear.design.relief import ReliefGrid, harris_map, with_tip_relief
from femgear.gears.deviations import SetDeviations
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    from femgear.contact.assembly import Bodies
    from femgear.gears import PlanetarySet

AMOUNT_STEP, LENGTH_STEP = 0.1e-6, 0.05e-3
"""Steps [m] of the points around the optimum, of amount and of length along the path of contact."""

SMALLEST_GAIN = 1e-4
"""Gain [um] under which a neighbour counts as no better."""


@dataclass(frozen=True)
class ReliefOptimum:
    """The relief with the least transmission error peak to peak at one torque.

    Parameters
    ----------
    torque : float
        On the sun [N m].
    amount : float
        [m]
    length : float
        In lengths of two-pair contact.
    peak_to_peak, unmodified : float
        With the relief and without it [m].
    evaluations : int
        Mesh cycles.
    amount_slopes, length_slopes : (float, float)
        Rise of the peak to peak [m/m] towards less and towards more, of amount and of length along the path
        of contact, over `AMOUNT_STEP` and `LENGTH_STEP`; NaN where the range searched ends there.
    minimum : bool
        None of the points one step away, alone or in both parameters at once, lies lower; False where
        the search ran out of mesh cycles.
    """

    torque: float
    amount: float
    length: float
    peak_to_peak: float
    unmodified: float
    evaluations: int
    amount_slopes: tuple[float, float]
    length_slopes: tuple[float, float]
    minimum: bool

    @property
    def ratio(self) -> float:
        """Peak to peak over that without relief."""
        return self.peak_to_peak / self.unmodified

    @property
    def at_end(self) -> tuple[str, ...]:
        """Names of the parameters that lie at an end of the range searched."""
        pairs = ("amount", self.amount_slopes), ("length", self.length_slopes)
        return tuple(name for name, slopes in pairs if np.isnan(slopes).any())


@one_blas_thread()
def optimise_relief(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    grid: ReliefGrid,
    *,
    torque: float,
    deviations: SetDeviations | None = None,
    power: float = 1.0,
    positions: int = 32,
    contact: str = "profile",
    supports: Supports = RIGID,
    max_evaluations: int = 240,
) -> ReliefOptimum:
    """Best relief at one torque, by Nelder and Mead's simplex from the best point of the grid.

    The peak to peak has kinks where another position becomes the extreme one, so no gradient is used. The
    simplex may collapse where the function still falls (K. I. M. McKinnon, SIAM J. Optim. 9, 1998, 148-158),
    as it does on kinks and bounds. The eight neighbours one step away are therefore tried, and the search
    begins again from the best of them until none lies lower.

    The search stays within the lengths of the grid and under its largest amount; amounts go down to a
    hundredth of its smallest.

    Parameters
    ----------
    grid : ReliefGrid
        Over the same set, with `torque` among its torques.
    torque : float
        On the sun [N m].
    max_evaluations : int
        Mesh cycles after which the search is not begun again.
    planetary_set, bodies, deviations, power, positions, contact, supports
        As for `relief_grid`.

    Returns
    -------
    ReliefOptimum
    """
    t = int(np.abs(grid.torques - torque).argmin())
    options = {"torques": [torque], "positions": positions, "contact": contact, "supports": supports}
    known: dict[tuple[float, float], float] = {}

    def peak(point) -> float:
        place = float(point[0]), float(point[1])
        if place not in known:
            relief = {"amount": place[0] * 1e-6, "length": place[1], "power": power, "back": torque < 0}
            variant = with_tip_relief(deviations, planetary_set, **relief)
            found = harris_map(planetary_set, bodies, deviations=[variant], **options)
            known[place] = float(found.peak_to_peak[0, 0, 0]) * 1e6
        return known[place]

    unit = two_pair_length(planetary_set)
    step = np.array([AMOUNT_STEP * 1e6, LENGTH_STEP / unit])
    point, value, around = _descend(peak, *_frame(grid, t), step, lambda: max_evaluations - len(known))
    slopes = _slopes(point, value, around)
    return ReliefOptimum(
        torque=float(torque),
        amount=float(point[0]) * 1e-6,
        length=float(point[1]),
        peak_to_peak=value * 1e-6,
        unmodified=float(grid.unmodified[t]),
        evaluations=len(known),
        amount_slopes=slopes[0],
        length_slopes=(slopes[1][0] * 1e-6 / unit, slopes[1][1] * 1e-6 / unit),
        minimum=min(around.values()) >= value - SMALLEST_GAIN,
    )


def _frame(grid: ReliefGrid, t: int):
    """Best point of the grid in micrometres and lengths, the bounds of the search, sizes of the simplex."""
    a, b = np.unravel_index(grid.peak_to_peak[t].argmin(), grid.peak_to_peak[t].shape)
    start = np.array([grid.amounts[a] * 1e6, grid.lengths[b]])
    low = np.array([grid.amounts.min() * 1e4, grid.lengths.min()])
    high = np.array([grid.amounts.max() * 1e6, grid.lengths.max()])
    cells = np.maximum([len(grid.amounts) - 1, len(grid.lengths) - 1], 1)
    return start, (low, high), 0.4 * np.array([np.ptp(grid.amounts) * 1e6, np.ptp(grid.lengths)]) / cells


def _descend(peak: Callable, start, bounds, sizes, step, left: Callable[[], int]):
    """Simplex and neighbours in turn: the best point, its value, the values of its neighbours by place."""
    from scipy.optimize import minimize

    point, size = start, np.maximum(sizes, step)
    while True:
        # the simplex has to lie within the bounds
        size = np.minimum(size, 0.5 * (bounds[1] - bounds[0]))
        inwards = np.where(point + size > bounds[1], -size, size)
        simplex = point + np.vstack([np.zeros(2), np.diag(inwards)])
        found = minimize(
            peak,
            point,
            method="Nelder-Mead",
            bounds=list(zip(*bounds)),
            options={"initial_simplex": simplex, "maxfev": max(left(), 3), "xatol": 0.01, "fatol": 1e-3},
        )
        around = {place: peak(place) for place in _neighbours(found.x, bounds, step)}
        best = min(around, key=around.get)
        if around[best] >= found.fun - SMALLEST_GAIN or left() <= 0:
            return found.x, float(found.fun), around
        point, size = np.array(best), 2.0 * step


def _neighbours(point, bounds, step):
    """Up to eight places one step away, on the bound where the step would leave it."""
    sides = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    for side in sides:
        place = np.clip(point + np.array(side) * step, *bounds)
        # closer than a tenth of the step is the end of the range
        if np.all((np.abs(place - point) > 0.1 * step) | (np.array(side) == 0)):
            yield float(place[0]), float(place[1])


def _slopes(point, value: float, around):
    """Rises per unit of the first and of the second parameter, (less, more) each; NaN without a neighbour."""
    rises = [[np.nan, np.nan], [np.nan, np.nan]]
    for place, found in around.items():
        away = np.array(place) - point
        (moved,) = np.nonzero(away)
        if len(moved) == 1:
            rises[moved[0]][int(away[moved[0]] > 0)] = float((found - value) / abs(away[moved[0]]))
    return [tuple(pair) for pair in rises]
