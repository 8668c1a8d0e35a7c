"""Tooth pairs as springs: the load over approach of every window by itself, in the field of the others.

`pair_laws` solves them at a state of `femgear.contact.batch.solve_batch`. Slices over the width and samples of sets
solve their contact with these curves, one unknown a tooth pair.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from femgear.contact.active_set import ROUNDING
from femgear.contact.assembly import Candidates
from femgear.contact.batch import MOST_STEPS, BatchState, local_solution
from femgear.contact.flank_friction import WindowFriction

_TOGETHER = 400
"""Windows by themselves that are solved at once."""


@dataclass(frozen=True)
class PairLaws:
    """Tooth pairs as springs: what every window yields under a force of its own, at P positions.

    In the field of the other windows at a given state, the approach ``lambda`` of window ``w`` over its force
    ``F`` is a curve. Small other separations ``d`` along the window change the approach under the same force
    by ``sum p d / F``, as all that minimises an energy does: with the moments ``mu`` of the pressure per
    force, and the loads that the given state has,

        r_w = s_w + lambda_w(F_w) + mu_w^T sum_v S_wv (mu_v F_v - z_v) + e_w - (G q)_w,   v != w,
        r_w >= 0,   F_w >= 0,   F_w r_w = 0,   G^T F = load

    is again the contact problem, with one unknown a tooth pair. At the given state it is exact.

    Parameters
    ----------
    force : (K,) array
        [N], in equal ratios.
    yields : (P, W, K) array
        Approach beyond `separation`, over the force [m/N]; constant below the first one.
    moments : (P, W, K, 3) array
        Of the pressures over the force.
    touching : (P, W, C) array
        Force under which every cell begins to touch [N], infinite where it never does.
    smooth, supports : (P, W, 3, W, 3), (W, W) arrays
        Compliance of the bodies between different windows, images of a window among them, and of sprung
        members between all [m/N].
    separation : (P, W) array
        Smallest one in the field of the others; infinite where there is no window [m].
    mesh, approach : (W,), (W, m) arrays
        As of `Candidates`, but of every window.
    loads, motions : (P, W, 3), (P, m) arrays
        Moments of the loads [N], and motions [m], at the given state.
    pressure : (P, W, K) array
        Largest of all cells over the root of the force, which Hertz's law has constant [Pa/N^(1/2)].
    friction : WindowFriction, optional
        As of `Candidates`.
    """

    force: np.ndarray
    yields: np.ndarray
    moments: np.ndarray
    touching: np.ndarray
    smooth: np.ndarray
    supports: np.ndarray
    separation: np.ndarray
    mesh: np.ndarray
    approach: np.ndarray
    loads: np.ndarray
    motions: np.ndarray
    pressure: np.ndarray
    friction: WindowFriction | None = None

    @property
    def step(self) -> float:
        """Logarithm of the ratio of the forces."""
        return float(np.log(self.force[1] / self.force[0]))

    @cached_property
    def cubics(self) -> np.ndarray:
        """Coefficients of cubic splines of `yields` over the logarithm of the force, (K - 1, P, W, 4)."""
        from scipy.interpolate import CubicSpline

        return np.moveaxis(CubicSpline(np.log(self.force), self.yields, axis=-1).c, 0, -1)

    def _between(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Interval of the curves in which forces lie, and the logarithm of the ratio to its first force."""
        step = self.step
        x = np.log(np.clip(force, *self.force[[0, -1]]) / self.force[0])
        interval = np.minimum((x / step).astype(int), len(self.force) - 2)
        return interval, x - interval * step

    def approaches(self, force: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Approach (t, W) [m] under forces (t, W) [N] at the numbers (t,) of some positions, and its slope [m/N]."""
        interval, x = self._between(force)
        a, b, c, d = np.moveaxis(self.cubics[interval, position[:, None], np.arange(force.shape[1])], -1, 0)
        yields, inside = ((a * x + b) * x + c) * x + d, (self.force[0] < force) & (force < self.force[-1])
        return force * yields, yields + np.where(inside, (3.0 * a * x + 2.0 * b) * x + c, 0.0)

    def moments_under(self, force: np.ndarray) -> np.ndarray:
        """Moments ``mu`` (n, P, W, 3) under forces (n, P, W) [N]."""
        return self._by_lines(self.moments, force)

    def pressure_under(self, force: np.ndarray) -> np.ndarray:
        """Largest pressure (..., P, W) [Pa] under forces (..., P, W) [N]."""
        return np.sqrt(force) * self._by_lines(self.pressure[..., None], force)[..., 0]

    def _by_lines(self, curves: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Values (..., P, W, n) of curves (P, W, K, n) under forces (..., P, W) [N], by straight lines."""
        interval, x = self._between(force)
        share = (x / self.step)[..., None]
        place = np.arange(force.shape[-2])[:, None], np.arange(force.shape[-1])
        low, high = (curves[*place, interval + shift] for shift in (0, 1))
        return low + share * (high - low)


def pair_laws(candidates: Candidates, state: BatchState, force: np.ndarray) -> PairLaws:
    """Compute the load over approach of every tooth pair by itself, in the field of a solved state.

    ``force`` (K,) are those of the curves [N], in equal ratios.
    """
    (P, W, C), diagonal = candidates.gap.shape, np.arange(candidates.gap.shape[1])
    smooth, supports = candidates.smooth.copy(), candidates.supports[np.ix_(candidates.mesh, candidates.mesh)]
    Pi, onto = candidates.polynomials, candidates.polynomials.swapaxes(-1, -2)
    own_window = candidates.images[0][:, diagonal, :, diagonal]
    local = candidates.local + Pi @ np.moveaxis(own_window, 0, 1) @ onto
    # what is left are the images of the window
    smooth[:, diagonal, :, diagonal] -= own_window
    loads = (onto @ state.loads[..., None])[..., 0]
    field = (smooth.reshape(P, 3 * W, 3 * W) @ loads.reshape(P, -1, 1)).reshape(P, W, 3, 1)
    field += (loads.sum(axis=-1) @ supports)[..., None, None]
    if candidates.friction is not None:
        field += (candidates.friction.supports @ loads.sum(axis=-1)[..., None])[..., None]
    gap = np.where(candidates.candidate, candidates.gap + (Pi @ field)[..., 0], np.inf)
    separation = gap.min(axis=-1)
    rows = np.nonzero(np.isfinite(separation))
    beyond = gap[rows] - separation[rows][:, None]
    approach, pressed = _single_pairs(local[rows], beyond, candidates.candidate[rows], force)
    yields, moments = np.ones((len(force), P, W)), np.zeros((len(force), P, W, 3))
    pressure, carried = np.zeros((len(force), P, W)), np.zeros((P, W, C))
    touching = np.full((P, W, C), np.inf)
    for k, force_level in enumerate(force):
        yields[k][rows] = approach[:, k] / force_level
        moments[k][rows] = (onto[rows] @ pressed[:, k, :, None])[..., 0] / force_level
        carried[rows] = pressed[:, k]
        pressure[k] = candidates.equal_cell_pressure(carried).max(axis=-1) / np.sqrt(force_level)
        touching[rows] = np.where((pressed[:, k] != 0.0) & np.isinf(touching[rows]), force_level, touching[rows])
    return PairLaws(
        force=force,
        yields=np.moveaxis(yields, 0, -1),
        moments=np.moveaxis(moments, 0, 2),
        touching=touching,
        smooth=smooth,
        supports=supports,
        separation=separation,
        mesh=candidates.mesh,
        approach=candidates.approach[candidates.mesh],
        loads=loads,
        motions=state.motions,
        pressure=np.moveaxis(pressure, 0, -1),
        friction=candidates.friction,
    )


def _single_pairs(local, beyond, cells, force) -> tuple[np.ndarray, np.ndarray]:
    """Solve windows by themselves under rising forces (K,) [N]: approach (R, K) [m], loads (R, K, C) [N].

    From their compliance (R, C, C) [m/N], what cells are apart beyond the nearest one (R, C) [m], and which
    of them may touch. Cells that touch carry a load.
    """
    parts = [slice(first, first + _TOGETHER) for first in range(0, len(beyond), _TOGETHER)]
    of_parts = [_growing_contacts(local[part], beyond[part], cells[part], force) for part in parts]
    K, C = len(force), beyond.shape[1]
    approach = np.concatenate([np.zeros((0, K)), *(of_part[0] for of_part in of_parts)])
    loads = np.concatenate([np.zeros((0, K, C)), *(of_part[1] for of_part in of_parts)])
    # contacts that let go of cells under a rising load
    again = np.flatnonzero((loads < -10 * ROUNDING * force[:, None]).any(axis=(1, 2)))
    approach[again], loads[again] = _single_active_sets(local[again], beyond[again], cells[again], force)
    return approach, loads


def _growing_contacts(local, beyond, cells, force) -> tuple[np.ndarray, np.ndarray]:
    """`_single_pairs` of windows in which one cell after the other comes into contact, and none leaves it.

    Contacts of bodies without kinks grow with the load (J. R. Barber, Int. J. Mech. Sci. 16, 1974, 813-817).
    Between two cells all is linear in the approach ``a``: separations are ``w + a u``, and a new cell c adds
    a field d of loads, without displacement of the cells before it,

        d = e_c - sum g_c d / s,    g = L d,    s = g_c,    a = min -w_c / u_c,
        p = -sum d (a u_c + w_c) / s,    F = sum u_c (a u_c + w_c) / s,
        u -= g u_c / s,    w -= g w_c / s,    u = -1 and w as beyond the nearest cell at first.
    """
    R, C = beyond.shape
    row, fields = np.arange(R), np.zeros((R, C, 2 * C))
    u, w, approach = np.full((R, C), -1.0), np.where(cells, beyond, 0.0), np.zeros(R)
    free, size, slope, apart, begins = cells.copy(), *np.zeros((3, R, C)), np.full((R, C), np.inf)
    total, offset, n = np.zeros((R, C + 1)), np.zeros((R, C + 1)), 0
    size += 1.0
    for n in range(int(cells.sum(axis=1).max(initial=0))):
        there = free & (u < 0.0)
        touch = np.where(there, w / np.where(there, -u, 1.0), np.inf)
        cell = touch.argmin(axis=1)
        live = np.isfinite(touch[row, cell])
        approach = np.where(live, np.maximum(approach, touch[row, cell]), approach)
        begins[:, n] = np.where(live, approach * total[:, n] + offset[:, n], np.inf)
        if not (begins[:, n] <= force[-1]).any():
            break
        share = fields[row, :n, cell] / size[:, :n]
        fields[:, n] = -(share[:, None] @ fields[:, :n])[:, 0]
        fields[:, n, :C] += local[row, :, cell]
        fields[row, n, C + cell] += 1.0
        free[row, cell] = False
        size[:, n] = np.where(live, fields[row, n, cell], 1.0)
        slope[:, n], apart[:, n] = np.where(live, [u[row, cell], w[row, cell]], 0.0)
        per, rest = slope[:, n] / size[:, n], apart[:, n] / size[:, n]
        total[:, n + 1] = total[:, n] + slope[:, n] * per
        offset[:, n + 1] = offset[:, n] + slope[:, n] * rest
        u, w = u - fields[:, n, :C] * per[:, None], w - fields[:, n, :C] * rest[:, None]
    touching = begins[:, None, : n + 1] <= force[:, None]
    count = touching.sum(axis=-1)
    at = row[:, None], count
    approach_of_count = (force - offset[at]) / total[at]
    carried = (approach_of_count[..., None] * slope[:, None, : n + 1] + apart[:, None, : n + 1]) / size[
        :, None, : n + 1
    ]
    return approach_of_count, np.where(touching, -carried, 0.0) @ fields[:, : n + 1, C:]


def _single_active_sets(local, beyond, cells, force) -> tuple[np.ndarray, np.ndarray]:
    """`_single_pairs` of any windows, by the cells that touch under the force before."""
    R, C = beyond.shape
    right, approaches = np.ones((R, C, 2)), np.zeros((R, len(force)))
    right[..., 1] = np.where(cells, beyond, 0.0)
    active, loads = beyond == 0.0, np.zeros((R, len(force), C))
    per, offset, pressed = (np.zeros(active.shape) for _ in range(3))
    approach = np.zeros(R)
    # solutions last until cells of their window change sides
    changed = np.ones(len(active), bool)
    for k, force_level in enumerate(force):
        pairs_left: Any = slice(None)
        for _ in range(MOST_STEPS):
            again = np.flatnonzero(changed)
            solved = local_solution(local, (again,), active[again], right[again])
            per[again], offset[again] = np.moveaxis(solved, -1, 0)
            approach[pairs_left] = (force_level + offset[pairs_left].sum(axis=1)) / per[pairs_left].sum(axis=1)
            pressed[pairs_left] = per[pairs_left] * approach[pairs_left, None] - offset[pairs_left]
            gaps = (
                beyond[pairs_left]
                + (local[pairs_left] @ pressed[pairs_left, :, None])[..., 0]
                - approach[pairs_left, None]
            )
            overlap = cells[pairs_left] & (gaps < -ROUNDING * approach[pairs_left, None])
            flips = np.where(active[pairs_left], pressed[pairs_left] < 0.0, overlap)
            changed[pairs_left] = flips.any(axis=1)
            if not changed.any():
                break
            active[pairs_left] ^= flips
            pairs_left = np.flatnonzero(changed)
        approaches[:, k], loads[:, k] = approach, pressed
    return approaches, loads
