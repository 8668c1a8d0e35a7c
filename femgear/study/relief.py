"""Tip relief of the sun-planet meshes: transmission error over torque, and the relief for one torque.

A relief takes off the tips what the teeth bend under one torque, and the transmission error is then nearly
constant under that torque (S. L. Harris, "Dynamic loads on the teeth of spur gears", Proc. IMechE 172, 1958).
`harris_map` computes it over torque, `relief_grid` over amount and length of the relief, `optimise_relief`
finds the least peak to peak at one torque and says whether it is a minimum. All of them start from
`design_basis`: what the variants of a design share.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Steps
from femgear.case.fault_sections import no_faults
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.case.tooth_friction import no_acting_friction
from femgear.contact.cycle import CycleOptions, loaded_image, walk_mesh_cycle
from femgear.contact.flank_pairs import mesh_pairs
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.supports import RIGID, Supports
from femgear.errors import CaseError, GeometryError
from femgear.gears.deviations import SetDeviations, common_period, no_deviations
from femgear.gears.modifications import FlankForm, TipRelief
from femgear.stages.protocol import Progress, one_blas_thread
from femgear.stages.static import known_compliances, over_width, record_positions, static_supports
from femgear.study.designs import Journal

if TYPE_CHECKING:
    from femgear.case.planetary import Case
    from femgear.contact.bodies import Bodies
    from femgear.gears.planetary import PlanetarySet

_SHORTEST = 0.05
"""Shortest relief in lengths of two-pair contact."""
AMOUNT_STEP, LENGTH_STEP = 0.1e-6, 0.05e-3
"""Steps [m] of the points around the optimum, of amount and of length along the path of contact."""
_VALLEYS = 3
"""Points of a grid lower than all around them from which a search begins, at most."""
_SMALLEST_GAIN = 1e-4
"""Gain [um] under which a neighbour counts as no better."""


@dataclass(frozen=True, eq=False)
class DesignBasis:
    """What all variants of a design share.

    Parameters
    ----------
    gears : PlanetarySet
        The set.
    bodies : Bodies
        Flank compliances; they serve all mesh cycles.
    supports : Supports
        Members whose axes move; by default all are fixed.
    deviations : SetDeviations, optional
        That the variants add to; None for ideal gears.
    positions, contact : int or (P,) array, {"profile", "line_of_action"}
        Equidistant positions of one mesh period, or those themselves, and candidates, see
        `contact.cycle.walk_mesh_cycle`.
    over : mapping
        What the contact over the face width takes of `CycleOptions`, by name; empty of the plane contact.
    both_flanks : bool
        Whether back flanks may touch.
    longest_record : int
        Mesh periods at most of a record with errors that turn.
    """

    gears: PlanetarySet
    bodies: Bodies
    supports: Supports = RIGID
    deviations: SetDeviations | None = None
    positions: int | np.ndarray = 64
    contact: str = "profile"
    over: Mapping[str, Any] = field(default_factory=dict)
    both_flanks: bool = False
    longest_record: int = sys.maxsize

    def walk(self, sun_torque: float, *, periods: int = 1, options: CycleOptions | None = None) -> MeshCycle:
        """Solve the static problem over some mesh periods under a torque on the sun [N m].

        With the extremes between positions, as ``femgear run`` finds them, where no options are given.
        """
        return walk_mesh_cycle(
            self.gears,
            self.bodies,
            sun_torque=sun_torque,
            positions=self.positions,
            contact=self.contact,
            deviations=self.deviations,
            supports=self.supports,
            periods=periods,
            options=replace(options or CycleOptions(peaks=True), both_flanks=self.both_flanks, **self.over),
        )

    def walk_record(self, sun_torque: float) -> MeshCycle:
        """Solve the static problem over all mesh periods after which the errors repeat, as ``femgear run`` does.

        ``sun_torque`` is the torque on the sun [N m].
        """
        periods = 1
        if self.deviations is not None:
            periods = common_period(self.deviations, self.gears, limit=self.longest_record)[0]
        return self.walk(sun_torque, periods=periods)

    def loaded(self, sun_torque: float, *, clearance: bool = False) -> tuple[DesignBasis, np.ndarray]:
        """Give the set as solved, mirrored under a negative sun torque [N m], and its planets (N,) by number.

        Refuses no torque (E-TORQUE) and, without ``clearance``, bearings that have one (E-SUPPORT).
        """
        if not (np.isfinite(sun_torque) and sun_torque):
            raise CaseError("without torque nothing touches", code="E-TORQUE", value=sun_torque, limit="not zero")
        if (gap := self.supports.planet_clearance) and not clearance:
            raise CaseError(
                "derivatives know no clearance of the planet bearings",
                code="E-SUPPORT",
                key="planet.bearing_clearance",
                value=f"{gap * 1e6:.6g} um",
                limit="0 um",
                remedy="set it to zero, or take differences of mesh cycles: femgear.study.sensitivity.pin_differences",
            )
        gears, order, deviations = loaded_image(self.gears, sun_torque, self.deviations)
        return replace(self, gears=gears, deviations=deviations), order


@one_blas_thread()
def design_basis(case: Case, *, cache: Path | None = None, steps: Steps | None = None) -> DesignBasis:
    """Collect gears, compliances, deviations, supports and positions of the static problem of a case.

    They are those of `femgear.stages.static.solve_static`: plane contact, or slices of the face width, of
    spur and of helical teeth. ``cache`` is the folder of generated grids; what other cases have left is taken
    from ``steps`` where it is that of this one.

    CaseError: as `femgear.stages.static.check_slices`.
    """
    no_acting_friction(case, "designs, derivatives and samples know no friction of the teeth")
    no_faults(case, "designs, derivatives and samples know no faults of single teeth")
    gears, deviations, steps = planetary_set(case), set_deviations(case), steps or Steps()
    over = over_width(case, gears, cache=cache, steps=steps)
    return DesignBasis(
        gears,
        known_compliances(case, gears, steps, cache=cache)[1],
        static_supports(case),
        None if deviations.ideal and not case.static.back_flanks else deviations,
        record_positions(case, gears),
        case.static.contact,
        over,
        case.static.back_flanks,
        case.static.longest_record,
    )


def sun_torque(case: Case, gears: PlanetarySet, torque: float | None = None) -> float:
    """Find the torque on the sun under one on the input [N m], by default the case's; E-TORQUE for none."""
    value = case.torque_on_first_gear(torque)
    if value == 0:
        message = "without torque no tooth bends"
        raise CaseError(message, code="E-TORQUE", key="operation.torque", remedy="give a torque")
    return value


def longest_relief(planetary_set: PlanetarySet) -> float:
    """Find the length of a relief over the whole path of contact, in lengths of two-pair contact [1].

    Reliefs of both gears meet in the middle of the path at half of it. GeometryError: a contact ratio of one
    (E-CONTACT-RATIO).
    """
    begin, end = mesh_pairs(planetary_set)[0].path
    if end - begin <= planetary_set.base_pitch:
        raise GeometryError(
            "sun and planet have no two-pair contact, in which reliefs are measured",
            code="E-CONTACT-RATIO",
            value=(end - begin) / planetary_set.base_pitch,
            limit="a transverse contact ratio above 1",
            remedy="give the reliefs as modifications of the case, with start diameters",
        )
    return (end - begin) / (end - begin - planetary_set.base_pitch)


def relief_starts(planetary_set: PlanetarySet, *, length: float = 1.0) -> tuple[float, float]:
    """Find the roll lengths on sun and planet where a tip relief of their mesh starts [m].

    Its length is along the path of contact, in lengths ``(epsilon - 1) p_b`` of two-pair contact at either
    end: 1 starts at the ends of single-pair contact.

    CaseError: E-RANGE: longer than the path of contact, or shorter than 0.05. GeometryError: as `longest_relief`.
    """
    pair = mesh_pairs(planetary_set)[0]
    begin, end = pair.path
    longest = longest_relief(planetary_set)
    if not _SHORTEST <= length <= longest:
        raise CaseError(
            f"a relief of {length} lengths of two-pair contact is longer than the path of contact, or hardly one",
            code="E-RANGE",
            value=length,
            limit=f"{_SHORTEST} to {longest:.3f}",
            remedy="give a length in lengths of two-pair contact, 1 for a long relief",
        )
    along = length * (end - begin - planetary_set.base_pitch)
    return float(pair.pitch_roll_1 + end - along), float(pair.pitch_roll_2 - begin - along)


def two_pair_length(planetary_set: PlanetarySet) -> float:
    """Compute the length of two-pair contact of sun and planet at either end, ``(epsilon - 1) p_b`` [m]."""
    longer, shorter = (relief_starts(planetary_set, length=length)[0] for length in (0.5, 1.0))
    return 2.0 * (longer - shorter)


def with_tip_relief(
    deviations: SetDeviations | None,
    planetary_set: PlanetarySet,
    *,
    amount: float,
    length: float = 1.0,
    power: float = 1.0,
    back: bool = False,
) -> SetDeviations:
    """Add a tip relief to deviations, on the sun and on the flanks of the planets that touch it.

    Parameters
    ----------
    deviations : SetDeviations, optional
        None for ideal gears.
    amount, length : float
        At the tips of sun and planet [m]; see `relief_starts`.
    power : float
        1 linear, 2 parabolic.
    back : bool
        The flanks of the planets that touch the sun under a negative torque.
    """
    deviations_given = no_deviations(planetary_set) if deviations is None else deviations
    if amount == 0:
        return deviations_given
    sun, planet = relief_starts(planetary_set, length=length)
    side = "planet_ring_side" if back else "planet_sun_side"
    new = {"sun": TipRelief(amount, sun, power=power), side: TipRelief(amount, planet, power=power)}
    forms = {n: FlankForm((*getattr(deviations_given, n).modifications, relief)) for n, relief in new.items()}
    return replace(deviations_given, **forms)


@dataclass(frozen=True, eq=False)
class HarrisMap:
    """Transmission error over torque.

    Parameters
    ----------
    torques : (T,) array
        Torque on the sun [N m].
    peak_to_peak : (variants, kinds, T) array
        Of the transmission error of the meshes, the largest of each kind [m].
    overall : (variants, T) array
        Of the transmission error from sun to ring [m].
    residual : float
        Largest residual of all contact problems.
    """

    torques: np.ndarray
    peak_to_peak: np.ndarray
    overall: np.ndarray
    residual: float


@one_blas_thread()
def harris_map(
    basis: DesignBasis,
    *,
    torques,
    deviations: Sequence[SetDeviations | None],
    progress: Progress | None = None,
    journal: Journal | None = None,
    names: Sequence[str] = (),
) -> HarrisMap:
    """Compute the transmission error peak to peak [m] over torque for a list of deviations.

    Parameters
    ----------
    basis : DesignBasis
        Its deviations are not looked at.
    torques : (T,) sequence of float
        On the sun [N m], not zero.
    deviations : sequence of SetDeviations or None
        One a curve; the record spans the common period of each.
    progress : callable, optional
        Called with (stage, mesh cycles done, mesh cycles).
    journal : Journal, optional
        Keeps every mesh cycle under the name of its deviations and its torque; those it holds are not solved.
    names : sequence of str
        Of the deviations, in a journal.

    Raises
    ------
    CaseError
        E-TORQUE: a torque of zero, or none.
    ContactError
    """
    torques = np.array(torques, float)
    if not len(torques) or not (np.isfinite(torques).all() and torques.all()):
        message = "every torque of the map must differ from zero"
        raise CaseError(message, code="E-TORQUE", value=torques, remedy="leave zero out")
    rows = basis.gears.kind_rows
    peaks = np.zeros((len(deviations), len(rows), len(torques)))
    overall, residual = np.zeros((len(deviations), len(torques))), 0.0
    for v, variant in enumerate(deviations):
        for t, torque in enumerate(torques):
            key = json.dumps([*names[v : v + 1], float(torque)])
            record = None if journal is None else journal.get(key)
            if record is None:
                record = _numbers(replace(basis, deviations=variant), float(torque))
                if journal is not None:
                    journal.add(key, record)
            peaks[v, :, t], overall[v, t] = record["peak_to_peak"], record["overall"]
            residual = max(residual, record["residual"])
            if progress is not None:
                progress("contact", v * len(torques) + t + 1, peaks[:, 0].size)
    return HarrisMap(torques, peaks, overall, residual)


def _numbers(basis: DesignBasis, sun_torque: float) -> dict[str, Any]:
    """Solve a mesh cycle: peaks to peaks of the kinds of mesh and from sun to ring [m], residual."""
    cycle = basis.walk_record(sun_torque)
    peaks = cycle.peak_to_peak()
    return {
        "peak_to_peak": [float(peaks[rows].max()) for rows in basis.gears.kind_rows],
        "overall": float(cycle.peak_to_peak("sun_arc")),
        "residual": float(cycle.residual.max()),
    }


def is_cycle(key: str, record: dict) -> bool:
    """Tell whether a record of a journal has the numbers of a mesh cycle of `harris_map`."""
    numbers = [*record["peak_to_peak"], record["overall"], record["residual"]]
    return bool(json.loads(key)) and len(numbers) > 2 and bool(np.isfinite(numbers).all())


def relief_name(amount: float, length: float, power: float) -> str:
    """Name a relief in a journal: amount [m], length in lengths of two-pair contact, and power."""
    return f"{float(amount)!r} {float(length)!r} {float(power)!r}"


@dataclass(frozen=True, eq=False)
class ReliefGrid:
    """Transmission error peak to peak of the sun-planet meshes over two parameters of the tip relief.

    Parameters
    ----------
    amounts : (A,) array
        [m]
    lengths : (L,) array
        In lengths of two-pair contact, see `relief_starts`.
    torques : (T,) array
        On the sun [N m].
    peak_to_peak : (T, A, L) array
        [m]
    unmodified : (T,) array
        Without the relief [m].
    """

    amounts: np.ndarray
    lengths: np.ndarray
    torques: np.ndarray
    peak_to_peak: np.ndarray
    unmodified: np.ndarray

    @property
    def ratio(self) -> np.ndarray:
        """Peak to peak over that without relief, (T, A, L)."""
        return self.peak_to_peak / self.unmodified[:, None, None]


@one_blas_thread()
def relief_grid(
    basis: DesignBasis,
    *,
    amounts,
    lengths,
    torques,
    power: float = 1.0,
    progress: Progress | None = None,
    journal: Journal | None = None,
) -> ReliefGrid:
    """Compute the transmission error [m] of the sun-planet meshes over amount and length of their relief.

    The reliefs are added to the deviations of the basis. Amounts (A,), lengths (L,) and torques (T,) of one
    sign are those of `ReliefGrid`; ``power``, ``progress`` and ``journal`` as for `with_tip_relief` and
    `harris_map`.
    """
    amounts, lengths, torques = (np.array(a, float) for a in (amounts, lengths, torques))
    back = loads_back(torques)
    places = [(float(a), float(length)) for a in amounts for length in lengths]
    variants = [basis.deviations]
    variants += [
        with_tip_relief(basis.deviations, basis.gears, amount=a, length=length, power=power, back=back)
        for a, length in places
    ]
    names = [relief_name(0.0, 1.0, power), *(relief_name(*place, power) for place in places)]
    kept = {"progress": progress, "journal": journal, "names": names}
    all_peaks = harris_map(basis, torques=torques, deviations=variants, **kept).peak_to_peak[:, 0]
    peaks = all_peaks[1:].T.reshape(len(torques), len(amounts), len(lengths))
    return ReliefGrid(amounts, lengths, torques, peaks, all_peaks[0])


def loads_back(torques: np.ndarray) -> bool:
    """Tell whether torques (T,) are negative; E-TORQUE (CaseError) where their signs differ."""
    if (torques > 0).any() and (torques < 0).any():
        message = "torques of both signs load different flanks"
        raise CaseError(message, code="E-TORQUE", value=torques, remedy="take those of each sign by themselves")
    return bool((torques < 0).any())


@dataclass(frozen=True)
class ReliefOptimum:
    """The relief with the least transmission error peak to peak at one torque.

    Parameters
    ----------
    torque, amount, length : float
        As those of `ReliefGrid`.
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
    basis: DesignBasis,
    grid: ReliefGrid,
    *,
    torque: float,
    power: float = 1.0,
    max_evaluations: int = 240,
    journal: Journal | None = None,
) -> ReliefOptimum:
    """Find the best relief at one torque, by Nelder and Mead's simplex from the deepest valleys of the grid.

    The peak to peak has kinks where another position becomes the extreme one, so no gradient is used. The
    simplex may collapse where the function still falls (K. I. M. McKinnon, SIAM J. Optim. 9, 1998, 148-158),
    as it does on kinks and bounds. The eight neighbours one step away are therefore tried, and the search
    begins again from the best of them until none lies lower.

    The search stays within the lengths of the grid and under its largest amount; amounts go down to a
    hundredth of its smallest.

    Parameters
    ----------
    basis, power
        As for `relief_grid`.
    grid : ReliefGrid
        Over the same set, with `torque` (on the sun [N m]) among its torques.
    max_evaluations : int
        Mesh cycles after which the search is not begun again.
    journal : Journal, optional
        As for `harris_map`.
    """
    t = int(np.abs(grid.torques - torque).argmin())
    peak_of: dict[tuple[float, float], float] = {}

    def peak(point) -> float:
        place = float(point[0]), float(point[1])
        if place not in peak_of:
            relief = {"amount": place[0] * 1e-6, "length": place[1], "power": power, "back": torque < 0}
            variant = with_tip_relief(basis.deviations, basis.gears, **relief)
            names = [relief_name(relief["amount"], relief["length"], power)]
            there = harris_map(basis, torques=[torque], deviations=[variant], journal=journal, names=names)
            peak_of[place] = float(there.peak_to_peak[0, 0, 0]) * 1e6
        return peak_of[place]

    unit = two_pair_length(basis.gears)
    step = np.array([AMOUNT_STEP * 1e6, LENGTH_STEP / unit])
    (first, *others), bounds, sizes = _frame(grid, t)

    def left() -> int:
        return max_evaluations - len(peak_of)

    ends = [_descend(peak, first, bounds, sizes, step, left)]
    ends += [_descend(peak, start, bounds, sizes, step, left) for start in others if left() > 0]
    point, value, around = min(ends, key=lambda end: end[1])
    slopes = _slopes(point, value, around)
    return ReliefOptimum(
        torque=float(torque),
        amount=float(point[0]) * 1e-6,
        length=float(point[1]),
        peak_to_peak=value * 1e-6,
        unmodified=float(grid.unmodified[t]),
        evaluations=len(peak_of),
        amount_slopes=slopes[0],
        length_slopes=(slopes[1][0] * 1e-6 / unit, slopes[1][1] * 1e-6 / unit),
        minimum=min(around.values()) >= value - _SMALLEST_GAIN,
    )


def _frame(grid: ReliefGrid, t: int):
    """Deepest valleys of the grid in micrometres and lengths, the bounds of the search, sizes of the simplex."""
    peaks, starts = grid.peak_to_peak[t], list[np.ndarray]()
    around = np.pad(peaks, 1, constant_values=np.inf)
    for flat in peaks.ravel().argsort():
        a, b = divmod(int(flat), peaks.shape[1])
        if peaks[a, b] <= around[a : a + 3, b : b + 3].min() and len(starts) < _VALLEYS:
            starts.append(np.array([grid.amounts[a] * 1e6, grid.lengths[b]]))
    low = np.array([grid.amounts.min() * 1e4, grid.lengths.min()])
    high = np.array([grid.amounts.max() * 1e6, grid.lengths.max()])
    cells = np.maximum([len(grid.amounts) - 1, len(grid.lengths) - 1], 1)
    return starts, (low, high), 0.4 * np.array([np.ptp(grid.amounts) * 1e6, np.ptp(grid.lengths)]) / cells


def _descend(peak: Callable, start, bounds, sizes, step, left: Callable[[], int]):
    """Simplex and neighbours in turn: the best point, its value, the values of its neighbours by place."""
    from scipy.optimize import minimize

    point, size = start, np.maximum(sizes, step)
    while True:
        # the simplex has to lie within the bounds
        size = np.minimum(size, 0.5 * (bounds[1] - bounds[0]))
        inwards = np.where(point + size > bounds[1], -size, size)
        simplex = point + np.vstack([np.zeros(2), np.diag(inwards)])
        ended = minimize(
            peak,
            point,
            method="Nelder-Mead",
            bounds=list(zip(*bounds)),
            options={"initial_simplex": simplex, "maxfev": max(left(), 3), "xatol": 0.01, "fatol": 1e-3},
        )
        around = {place: peak(place) for place in _neighbours(ended.x, bounds, step)}
        best = min(around, key=around.__getitem__)
        if around[best] >= ended.fun - _SMALLEST_GAIN or left() <= 0:
            return ended.x, float(ended.fun), around
        point, size = np.array(best), 2.0 * step


def _neighbours(point, bounds, step):
    """Up to eight places one step away, on the bound where the step would leave it."""
    sides = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    for side in sides:
        place = np.clip(point + np.array(side) * step, *bounds)
        # closer than a tenth of the step is the end of the range
        if np.all((np.abs(place - point) > 0.1 * step) | (np.array(side) == 0)):
            yield float(place[0]), float(place[1])


def _slopes(point, value: float, around) -> tuple[tuple[float, float], tuple[float, float]]:
    """Rises per unit of the first and of the second parameter, (less, more) each; NaN without a neighbour."""
    rises = [[np.nan, np.nan], [np.nan, np.nan]]
    for place, neighbour in around.items():
        away = np.array(place) - point
        (moved,) = np.nonzero(away)
        if len(moved) == 1:
            rises[moved[0]][int(away[moved[0]] > 0)] = float((neighbour - value) / abs(away[moved[0]]))
    (a, b), (c, d) = rises
    return (a, b), (c, d)
