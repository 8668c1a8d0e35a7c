"""The contact of many sets in slices of the face width, whose tooth pairs are springs: all sets together.

The equations are those of `femgear.contact.slices`: a curve of load over approach in every slice of every
tooth pair, joined by what the bodies yield between tooth pairs and across the width, X. With the orthonormal
cosines ``T`` over the S slices and the first M of their waves ``a = T F``,

    X = h + T^T C T + R,    C = T X T^T - h,

where ``h`` is a number for every tooth pair, a mean of what it yields to the waves beyond. ``R`` is small:
short waves of one tooth pair are hardly felt by others. Curve and ``h`` together are inverted once, so that a
slice carries ``F = phi(x)`` at its approach

    x = G q - s - e - T^T C a - R F,    T F = a,    G^T F = S load.

Newton's method then has the M waves of every tooth pair and the motions ``q`` for unknowns in place of the
slices, none of which changes sides. ``R F`` follows the forces from step to step: what it settles at solves
the whole equations. Moments of the pressures along the profiles are those under the mean force of a tooth
pair, and what they change of the compliance between tooth pairs acts by mean forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.contact.assembly import Candidates
from femgear.contact.batch import FAINT
from femgear.contact.pair_laws import PairLaws
from femgear.contact.pair_springs import PairSprings
from femgear.contact.supports import TiltingMembers
from femgear.contact.width_waves import WidthWaves, cosines, slice_compliance

WAVES = 3
"""M: waves over the width that are unknowns."""
_MOST, _REFRESHED = 60, 4
"""Newton steps, and those for which the moments of the pressures follow the forces."""
_SETTLED = 1e-4
"""Share of the load by which forces of slices may still change in the last step."""
_BALANCED = 1e-3
"""Share of the load that the forces of a solved position may miss."""
_SOFTEST = 1e-13
"""Spring that holds what no loaded pair holds where it is, over that of a tooth pair."""
_STATIONS = 256
"""Of the tables of ``phi``."""


class SliceSprings:
    """Tooth pairs in S slices as springs, at P positions of a set: see the head of the module.

    Lengths are over ``pairs.unit``; of every position there are U slots, as `PairSprings` has them.

    Parameters
    ----------
    candidates : Candidates
        All windows, of spur teeth, with the pairs that the laws are of.
    tilting : TiltingMembers, optional
        Motions that differ from slice to slice; they follow the others.
    """

    def __init__(
        self,
        candidates: Candidates,
        laws: PairLaws,
        waves: WidthWaves,
        slices: int,
        tilting: TiltingMembers | None = None,
    ):
        self.pairs = pairs = PairSprings(laws)
        self.slices, self.T = slices, cosines(slices)[:WAVES]
        P, place, mesh = len(pairs.window), np.arange(len(pairs.window))[:, None], pairs.mesh[pairs.window]
        self.mesh, pair = mesh, candidates.pair[place, pairs.window]
        # the slot of every window at the position before, of those that were there
        same = (mesh[1:, :, None] == mesh[:-1, None]) & (pair[1:, :, None] == pair[:-1, None])
        self.before, self.new = same.argmax(axis=2), ~same.any(axis=2)
        across = slice_compliance(candidates, place, (waves,), slices)[0][0]
        self.tilts, self.soft = None, np.zeros(laws.approach.shape[1])
        if tilting is not None:
            window = np.arange(slices)[:, None]
            across = across + tilting.coupling[laws.mesh, window][:, :, laws.mesh, window]
            # (P, U, S, k)
            self.tilts = tilting.approach[mesh]
            self.soft = np.append(self.soft, tilting.stiffness * pairs.unit)
        slots = pairs.window
        # (P, U, U, S, S); sprung members move as a whole
        across = across[place[..., None], :, slots[:, :, None], :, slots[:, None]] / pairs.unit
        across = across + (pairs.supports / slices)[..., None, None]
        moments = pairs.moments_under(pairs.force.T, place[:, 0])
        between = pairs.between(moments, place[:, 0]).transpose(2, 0, 1) - pairs.supports
        self._split(across, between)
        self._tabulate(P)

    def _split(self, across: np.ndarray, between: np.ndarray) -> None:
        """Split the compliance between slices into h (P, U), C (P, U, M, U, M) and R (P, U, S, U, S).

        ``between`` (P, U, U) is that between tooth pairs, the same in all slices, at the given state.
        """
        S, T, same_pair, M = self.slices, cosines(self.slices), np.arange(self.pairs.count), len(self.T)
        X = across + between[..., None, None] * np.eye(S)
        alone = np.einsum("ms,pust,mt->pum", T, X[:, same_pair, same_pair], T, optimize=True)
        # displacements fall as loads do, with the square of the wave number beside a kink
        weights = 1.0 / np.arange(M, S) ** 2
        self.h = alone[..., M:] @ weights / weights.sum() if M < S else 0.0 * alone[..., 0]
        diagonal = np.zeros(X.shape[:3])
        diagonal[:, same_pair, same_pair] = self.h
        self.C = np.einsum("ms,puvst,kt->pumvk", self.T, X, self.T, optimize=True)
        self.C -= diagonal[:, :, None, :, None] * np.eye(M)[:, None]
        kept = np.einsum("ms,pumvk,kt->puvst", self.T, self.C, self.T, optimize=True)
        rest = X - kept - diagonal[..., None, None] * np.eye(S)
        self.between = between
        self.R, self.X = (np.ascontiguousarray(part.transpose(0, 1, 3, 2, 4)) for part in (rest, X))

    def _tabulate(self, P: int) -> None:
        """Make tables of ``phi(x)/x`` over the logarithm of x: cubics of (P, U, intervals)."""
        from scipy.interpolate import CubicSpline

        pairs, place = self.pairs, np.arange(P)
        force = np.geomspace(pairs.forces[0], pairs.forces[-1], 8 * _STATIONS)
        x = np.array([pairs.approaches(np.full((pairs.count, P), force_level), place)[0].T for force_level in force])
        x = np.maximum.accumulate(x + self.h * force[:, None, None], axis=0)
        self.ends = float(x[0].min()), float(x[-1].max())
        stations = np.linspace(np.log(self.ends[0]), np.log(self.ends[1]), _STATIONS)
        conductance = np.empty((P, pairs.count, _STATIONS))
        for at in np.ndindex(P, pairs.count):
            of_slot = x[:, *at]
            conductance[at] = np.exp(np.interp(stations, np.log(of_slot), np.log(force / of_slot)))
        self.step = stations[1] - stations[0]
        self.tables = np.moveaxis(CubicSpline(stations, conductance, axis=-1).c, 1, -1).copy()

    def forces(self, x: np.ndarray, at: int, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute forces and their slopes, (u, n, S) each, at approaches x (u, n, S) of slots (u,) at a position."""
        low, high = self.ends
        within = np.minimum(np.maximum(x, low), high)
        y = np.log(within * (1.0 / low))
        interval = np.minimum((y * (1.0 / self.step)).astype(np.intp), _STATIONS - 2)
        y -= interval * self.step
        interval += (slots * (_STATIONS - 1))[:, None, None]
        a, b, c, d = (table.take(interval) for table in self.tables[:, at].reshape(4, -1))
        conductance = ((a * y + b) * y + c) * y + d
        slope = conductance + np.where(x == within, (3.0 * a * y + 2.0 * b) * y + c, 0.0)
        carries = x > 0.0
        return np.where(carries, x * conductance, 0.0), np.where(carries, slope, 0.0)


@dataclass(frozen=True)
class SliceSolutions:
    """Solutions of n sets at P positions.

    Parameters
    ----------
    force, largest : (P, W, n) arrays
        Mean over the slices, and largest force of a slice were it the same over the whole width [N].
    length, at_end : (P, W, n) arrays
        Share of the slices that carry, and whether those at an end do.
    motions : (P, m, n) array
        Those that all slices share first [m].
    stiffness : (P, meshes, n) array
        Tangent stiffness of every mesh at constant loads of the others [N/m].
    solved : (P, n) bool array
        Whether the iteration ended.
    """

    force: np.ndarray
    largest: np.ndarray
    length: np.ndarray
    at_end: np.ndarray
    motions: np.ndarray
    stiffness: np.ndarray
    solved: np.ndarray


def solve_slice_springs(
    springs: SliceSprings,
    load: np.ndarray,
    separations: np.ndarray,
    leads: np.ndarray,
    tilts: np.ndarray | None = None,
) -> SliceSolutions:
    """Solve the contact in slices of n sets at P positions, each from the position before.

    Parameters
    ----------
    load : (m,) array
        External load on the motions that all slices share [N].
    separations : (P, W, n) array
        What every set adds to whole pairs [m].
    leads : (P or 1, W, S, n) array
        What it adds in the slices [m].
    tilts : (P, W, 3, n) array, optional
        What it adds at the nodes of the windows [m].
    """
    (P, W, n), pairs, load = separations.shape, springs.pairs, np.asarray(load, float)
    force, largest, length, at_end = np.zeros((4, P, W, n))
    motions, solved = np.zeros((P, len(springs.soft), n)), np.zeros((P, n), bool)
    stiffness, start = np.zeros((P, pairs.meshes, n)), None
    for at, slots in enumerate(pairs.window):
        apart = pairs.separation[at][:, None] + separations[at, slots] / pairs.unit
        apart = apart[..., None] + leads[at % len(leads), slots].swapaxes(1, 2) / pairs.unit
        at_nodes = None if tilts is None else tilts[at, slots] / pairs.unit
        if start is not None:
            here = start[0][springs.before[at - 1]]
            here[springs.new[at - 1]] = 0.0
            start = here, start[1]
        newton = _SliceSpringNewton(springs, at, load, apart, at_nodes)
        newton.solve(start)
        start = newton.force, newton.motions
        force[at, slots], motions[at] = newton.force.mean(axis=2), newton.motions.T * pairs.unit
        largest[at, slots], carries = newton.force.max(axis=2), newton.force > 0.0
        length[at, slots], at_end[at, slots] = carries.mean(axis=2), carries[..., [0, -1]].any(axis=2)
        stiffness[at], solved[at] = newton.mesh_stiffness().T / pairs.unit, newton.solved
    return SliceSolutions(force, largest, length, at_end > 0.0, motions, stiffness, solved)


class _SliceSpringNewton:
    """Newton's method of `solve_slice_springs` at one position.

    ``apart`` (U, n, S) and ``tilts`` (U, 3, n) are over the unit of the springs; so are ``motions`` (n, m).
    Results are these, ``force`` (U, n, S) and ``solved`` (n,).
    """

    def __init__(self, springs: SliceSprings, at: int, load, apart, tilts):
        self.springs, self.at, self.apart, self.tilts = springs, at, apart, tilts
        (U, n, S), pairs = apart.shape, springs.pairs
        self.arms, self.shared = pairs.arms[at], pairs.arms.shape[2]
        self.load = np.append(load, np.zeros(len(springs.soft) - len(load)))
        self.limit = _SETTLED * np.abs(load).max()
        self.force = np.repeat(pairs.force[at][:, None, None], n, axis=1).repeat(S, axis=2)
        self.motions = np.zeros((n, len(springs.soft)))
        self.motions[:, : self.shared] = pairs.motions[at]
        self.solved, self.slope = np.zeros(n, bool), np.zeros((U, n, S))
        # products of two waves, and which of them stands in every place of a matrix (M, M)
        row, column = np.triu_indices(len(springs.T))
        self.products = (springs.T[row] * springs.T[column]).T.copy()
        self.place = np.zeros((len(springs.T),) * 2, int)
        self.place[row, column] = self.place[column, row] = np.arange(len(row))

    def solve(self, start: tuple[np.ndarray, np.ndarray] | None) -> None:
        """Iterate from the given state, or from forces (U, n, S) and motions (n, m).

        Slots that carry nowhere are left out, and looked at again at the end.
        """
        if start is not None:
            self.force, self.motions = start
        todo, slots = np.arange(len(self.motions)), np.arange(0)
        while len(todo):
            touched = self._carrying(todo)
            more = np.union1d(slots, np.flatnonzero(touched.any(axis=1)))
            if len(more) == len(slots):
                break
            slots = more
            self._iterate(todo, slots)
            todo = np.flatnonzero(self.solved)
            overlap = self._carrying(todo)
            overlap[slots] = False
            todo = todo[overlap.any(axis=0)]
            self.solved[todo] = False

    def _carrying(self, sets: np.ndarray) -> np.ndarray:
        """Tell of all slots (U, n) whether slices of some sets carry, or overlap under the forces."""
        springs, S = self.springs, self.springs.slices
        force, U = self.force[:, sets], len(self.force)
        X, mean = springs.X[self.at].reshape(U * S, U * S), force.mean(axis=2)
        yielding = (force.swapaxes(0, 1).reshape(len(sets), U * S) @ X).reshape(-1, U, S).swapaxes(0, 1)
        apart = self.apart[:, sets] + _parted(*self._bent(mean, sets, np.arange(U)), mean)
        x = self._approach(self.motions[sets], np.arange(U)) - apart
        return ((x > yielding) | (force > 0.0)).any(axis=2)

    def _bent(self, mean: np.ndarray, sets: np.ndarray, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What moments under mean forces (u, n) of some sets change beside those of the given state.

        Separations (u, n), and compliance between the slots (u, u, n).
        """
        pairs, at = self.springs.pairs, self.at
        whole = np.zeros((len(self.force), len(sets)))
        whole[slots] = mean
        moments = pairs.moments_under(whole, np.full(len(sets), at))[slots]
        half = np.einsum("vbwa,wan->vbwn", pairs.smooth[at][slots][:, :, slots], moments)
        field = np.broadcast_to(-pairs.field[at][slots][..., None], moments.shape)
        if self.tilts is not None:
            field = field + self.tilts[slots][..., sets]
        between = np.einsum("vbwn,vbn->vwn", half, moments)
        between -= self.springs.between[self.at][np.ix_(slots, slots)][..., None]
        return np.einsum("wan,wan->wn", moments, field), between

    def _approach(self, motions: np.ndarray, slots: np.ndarray) -> np.ndarray:
        """Approach (u, n, S or 1) of some slots by motions (n, m)."""
        approach = (self.arms[slots] @ motions[:, : self.shared].T)[..., None]
        if self.springs.tilts is not None:
            tilts = self.springs.tilts[self.at][slots]
            approach = approach + np.einsum("nk,usk->uns", motions[:, self.shared :], tilts)
        return approach

    def _carried(self, force: np.ndarray, slots: np.ndarray) -> np.ndarray:
        """Loads (n, m) on the motions by forces (u, n, S) of some slots."""
        load = force.mean(axis=2).T @ self.arms[slots]
        if self.springs.tilts is not None:
            tilts = self.springs.tilts[self.at][slots]
            load = np.hstack([load, np.einsum("uns,usk->nk", force, tilts) / force.shape[2]])
        return load

    def _iterate(self, sets: np.ndarray, slots: np.ndarray) -> None:
        """Take steps for some sets, with some slots alone, until they have ended; keep what they end at."""
        springs, S, T, u = self.springs, self.springs.slices, self.springs.T, len(slots)
        C = springs.C[self.at][slots][:, :, slots].reshape(u * len(T), -1)
        R = springs.R[self.at][slots][:, :, slots].reshape(u * S, -1)
        force, motions, apart = self.force[slots][:, sets], self.motions[sets], self.apart[slots][:, sets]
        self.force[:, sets] = self.slope[:, sets] = 0.0
        waves = force @ T.T

        def by_all(values, matrix):
            """Products of a matrix (u k, u k) with values (u, n, k)."""
            shape = values.shape
            product = values.swapaxes(0, 1).reshape(shape[1], -1) @ matrix
            return product.reshape(shape[1], shape[0], -1).swapaxes(0, 1)

        bent = between = beyond = np.zeros(0)
        for step in range(_MOST):
            if step < _REFRESHED:
                bent, between = self._bent(force.mean(axis=2), sets, slots)
                beyond = by_all(force, R) + _parted(bent, between, force.mean(axis=2))
            x = self._approach(motions, slots) - apart - by_all(waves, C) @ T - beyond
            before, (force, slope) = force, springs.forces(x, self.at, slots)
            ended = np.abs(force - before).max(axis=(0, 2)) < self.limit
            ended &= step >= _REFRESHED
            if ended.any():
                self._keep(sets[ended], slots, force[:, ended], slope[:, ended], motions[ended])
                on = np.flatnonzero(~ended)
                if not len(on):
                    return
                sets, motions, between, bent = sets[on], motions[on], between[..., on], bent[:, on]
                force, slope, apart, waves, beyond = (values[:, on] for values in (force, slope, apart, waves, beyond))
            lag = beyond
            beyond = by_all(force, R) + _parted(bent, between, force.mean(axis=2))
            expected = force - slope * (beyond - lag)
            change, moved = self._step(slots, C, slope, expected @ T.T - waves, expected, motions)
            waves, motions = waves + change, motions + moved

    def _keep(self, sets, slots, force, slope, motions) -> None:
        """Keep forces and slopes (u, n, S) and motions (n, m) of sets, solved where they balance the load."""
        self.force[np.ix_(slots, sets)], self.motions[sets] = force, motions
        self.slope[np.ix_(slots, sets)] = slope
        shared = self._carried(force, slots)[:, : self.shared] - self.load[: self.shared]
        self.solved[sets] = np.abs(shared).max(axis=1) < _BALANCED * np.abs(self.load).max()

    def _step(self, slots, C, slope, missed, force, motions) -> tuple[np.ndarray, np.ndarray]:
        """Solve for changes of the waves (u, n, M) and motions (n, m), ``missed`` (u, n, M) being T F - a.

        With ``B = T phi' T^T`` and ``V = T phi' G``, G as of `_approach`, of every tooth pair

            (1 + B C) da - V dq = T F - a,    (G^T phi' G dq - V^T C da) / S = load - G^T F / S
        """
        (M, S), m = self.springs.T.shape, motions.shape[1]
        (n, on), u = (motions.shape[0], np.flatnonzero(slope.any(axis=(1, 2)))), len(slots)
        off = np.setdiff1d(np.arange(u), on)
        C, change = C.reshape(u, M, u, M), missed.copy()
        B, V, corner = self._tangents(slots[on], slope[on])
        size, system = len(on) * M, self._system(C[on][:, :, on], B, V)
        system[:, size:, size:] = corner
        right = np.empty((n, size + m))
        right[:, :size] = missed[on].swapaxes(0, 1).reshape(n, size)
        right[:, size:] = self.load - self._carried(force, slots) - self.springs.soft * motions
        if len(off):
            # waves of what has no slope follow at once, and others feel it
            felt = np.einsum("unm,umvk->nvk", missed[off], C[off][:, :, on])
            right[:, :size] -= np.einsum("unij,nuj->nui", B, felt).reshape(n, size)
            right[:, size:] += (V.swapaxes(1, 2) @ felt.reshape(n, size, 1))[..., 0] / S
        solution = np.linalg.solve(system, right[..., None])[..., 0]
        change[on] = solution[:, :size].reshape(n, len(on), M).swapaxes(0, 1)
        return change, solution[:, size:]

    def _system(self, C: np.ndarray, B: np.ndarray, V: np.ndarray) -> np.ndarray:
        """Make the matrices (n, u M + k, u M + k) of `_step`, but for their last corner.

        From C (u, M, u, M), B (u, n, M, M) and V (n, u M, k).
        """
        (u, n, M), k, size = B.shape[:3], V.shape[2], C.shape[0] * C.shape[1]
        system = np.empty((n, size + k, size + k))
        by_pairs = (B.reshape(u, n * M, M) @ C.reshape(u, M, size)).reshape(u, n, M, size)
        system[:, :size, :size] = by_pairs.swapaxes(0, 1).reshape(n, size, size)
        system[:, range(size), range(size)] += 1.0
        system[:, :size, size:] = -V
        system[:, size:, :size] = -(V.swapaxes(1, 2) @ C.reshape(size, size)) / self.springs.slices
        return system

    def _tangents(self, slots: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """B (u, n, M, M), V (n, u M, m) and ``(G^T phi' G) / S`` of slopes (u, n, S) of some slots."""
        springs, S, shared = self.springs, self.springs.slices, self.shared
        B, G = (slope @ self.products)[..., self.place], self.arms[slots]
        (u, n, M), m = B.shape[:3], len(springs.soft)
        V, corner = np.empty((n, u, M, m)), np.zeros((n, m, m))
        # the first wave is even
        V[..., :shared] = np.sqrt(S) * B[..., 0].swapaxes(0, 1)[..., None] * G[:, None]
        corner[:, :shared, :shared] = np.einsum("un,ui,uj->nij", B[..., 0, 0], G, G)
        if springs.tilts is not None:
            tilts = springs.tilts[self.at][slots]
            sloped = slope[..., None] * tilts[:, None]
            V[..., shared:] = np.einsum("ms,unsk->numk", springs.T, sloped, optimize=True)
            across = np.einsum("ui,unk->nik", G, sloped.sum(axis=2)) / S
            corner[:, :shared, shared:], corner[:, shared:, :shared] = across, across.swapaxes(1, 2)
            corner[:, shared:, shared:] = np.einsum("usk,unsl->nkl", tilts, sloped, optimize=True) / S
        corner[:, range(m), range(m)] += springs.soft + _SOFTEST
        return B, V.reshape(n, u * M, m), corner

    def mesh_stiffness(self) -> np.ndarray:
        """Compute the tangent stiffness (n, meshes) of every mesh at constant loads of the others.

        Tilts and twists follow; sprung members are left out, as in `femgear.contact.slices`.
        """
        springs, pairs = self.springs, self.springs.pairs
        (_, n, S), M, stiffness = self.force.shape, len(springs.T), np.zeros((self.force.shape[1], pairs.meshes))
        faint, C = FAINT * np.abs(self.load).max(), springs.C[self.at].copy()
        C[:, 0, :, 0] -= pairs.supports[self.at]
        slopes = np.where(self.force > faint, self.slope, 0.0)
        carries = slopes.any(axis=(1, 2))
        for mesh in range(pairs.meshes):
            slots = np.flatnonzero(carries & (springs.mesh[self.at] == mesh))
            B, V, corner = self._tangents(slots, slopes[slots])
            size, system = len(slots) * M, self._system(C[slots][:, :, slots], B, V[..., self.shared :])
            system[:, size:, size:] = corner[:, self.shared :, self.shared :]
            # what a unit approach of all slices does
            right = np.zeros((n, system.shape[1], 1))
            right[:, :size, 0] = np.sqrt(S) * B[..., 0].swapaxes(0, 1).reshape(n, size)
            if springs.tilts is not None:
                right[:, size:, 0] -= np.einsum("uns,usk->nk", slopes[slots], springs.tilts[self.at][slots]) / S
            answer = np.linalg.solve(system, right)[:, :size, 0].reshape(n, len(slots), M)
            stiffness[:, mesh] = answer[..., 0].sum(axis=1) / np.sqrt(S)
        return stiffness


def _parted(bent: np.ndarray, between: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Separations (u, n, 1) as of `_SliceSpringNewton._bent` under mean forces (u, n)."""
    return (bent + np.einsum("uvn,vn->un", between, mean))[..., None]
