"""The contact of many sets whose tooth pairs are springs: Newton's method on positions and sets together.

The springs are those of `femgear.contact.pair_laws.PairLaws`. The last axis of all arrays are the problems, one
for every position of every set, so that each operation runs over thousands of them, and systems of so few
unknowns are eliminated side by side. What comes out for one of them depends on no other.
"""

from __future__ import annotations

import numpy as np

from femgear.contact.batch import FAINT
from femgear.contact.pair_laws import PairLaws

_REFRESHED = 3
"""Steps of Newton's method for which the moments of tooth pairs follow their forces."""
_BOLD, _MOST_STEPS = 10, 100
"""Steps after which pairs open and close one at a time, and the most of these."""
_SETTLED = 1e-8
"""Share of the load by which forces of tooth pairs may still change in the last step."""
_BALANCED = 1e-6
"""Share of the load that the forces of a solved position may miss."""
_SOFTEST = 1e-13
"""Spring on every motion, over that of a tooth pair: it holds what no loaded pair holds."""
_SIDE_BY_SIDE = 512
"""Systems that are eliminated together, so that they stay in a cache."""
_CROWD = 0.5
"""Share of problems that go on below which those that have ended are left out."""


def solve_laws(
    springs: PairSprings, load: np.ndarray, separations: np.ndarray, tilts: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Solve the contact of all tooth pairs as springs at P positions of n sets.

    Newton's method on all of them: pairs that pull open, pairs that overlap close, all at once; where that
    does not end, steps stop at the first pair that opens, and the deepest closes when they have settled. A
    soft spring holds planets that carry nothing.

    Parameters
    ----------
    load : (m,) array
        External load on the motions [N].
    separations : (P, W, n) array
        ``e``: what every set adds to whole pairs [m].
    tilts : (P, W, 3, n) array, optional
        What it adds at the nodes of the windows [m].

    Returns
    -------
    force, motions, stiffness : (P, W, n), (P, m, n), (P, meshes, n) arrays
        [N]; [m]; tangent stiffness of every mesh at constant loads of the others [N/m].
    solved : (P, n) bool array
        Whether the iteration ended.
    """
    newton = _SpringNewton(springs, np.asarray(load, float), separations, tilts)
    newton.solve()
    newton.force = newton._carried(newton.force)
    P, W, n = separations.shape
    force = np.zeros((P, W, n))
    force[np.arange(P)[:, None], springs.window] = newton.force.reshape(-1, P, n).swapaxes(0, 1)
    motions, stiffness = (values.reshape(-1, P, n).swapaxes(0, 1) for values in (newton.motions, newton.stiffness))
    return force, motions * springs.unit, stiffness / springs.unit, newton.solved.reshape(P, n)


class PairSprings:
    """Tooth pairs as springs: of the windows that there are at every position curves, compliance and arms.

    They stand in U slots a position, those of every `PairLaws` window that has a tooth pair.

    Approaches and compliance are over ``unit``, a mean one. At positions with fewer windows some slots are
    those of windows that are not there: they never close.
    """

    def __init__(self, laws: PairLaws):
        present = np.isfinite(laws.separation)
        (P, W), place = present.shape, np.arange(len(present))[:, None]
        self.unit, self.forces, self.step = float(laws.yields[present].mean()), laws.force, laws.step
        self.count = U = int(present.sum(axis=1).max())
        self.window = window = np.argsort(~present, axis=1, kind="stable")[:, :U]
        smooth = laws.smooth[place[..., None], window[..., None], :, window[:, None]]
        # of slots v and w with their nodes b and a, (P, v, b, w, a)
        self.smooth = np.ascontiguousarray(smooth.transpose(0, 1, 3, 2, 4)) / self.unit
        self.supports = laws.supports[window[..., None], window[:, None]] / self.unit
        self.arms, self.motions = laws.approach[window], laws.motions / self.unit
        self.separation = laws.separation[place, window] / self.unit
        self.force = laws.loads.sum(axis=-1)[place, window]
        # what the bodies yield at the nodes of every window under the loads of the given state, (P, U, 3)
        loads = laws.loads[place, window].reshape(P, -1, 1)
        self.field = (self.smooth.reshape(P, 3 * U, -1) @ loads).reshape(P, U, 3)
        self.field += self.supports @ self.force[..., None]
        cubics = laws.cubics[:, place, window].transpose(3, 2, 1, 0) / self.unit
        moments = laws.moments[place, window].transpose(3, 1, 0, 2)
        rises = np.diff(moments, axis=-1) / self.step
        # tables of (slots, positions, intervals)
        self.cubics, self.moments, self.rises = (
            [np.ascontiguousarray(part).ravel() for part in parts] for parts in (cubics, moments[..., :-1], rises)
        )
        self.meshes, self.mesh = int(laws.mesh[-1]) + 1, laws.mesh
        # the slot of every window; those of windows that are not there never carry
        self.slot = np.zeros((P, W), int)
        np.put_along_axis(self.slot, window, np.arange(U)[None], axis=1)

    def intervals(self, force: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the places (U, N) in the tables of forces (U, N) [N], and how far beyond they lie (U, N).

        ``place`` (N,) are the numbers of the positions.
        """
        count = len(self.forces) - 1
        # what is no number, of a problem that will not be solved, lies in the first interval
        within = np.fmin(np.fmax(force, self.forces[0]), self.forces[-1])
        x = np.log(within * (1.0 / self.forces[0]))
        interval = np.minimum((x * (1.0 / self.step)).astype(np.intp), count - 1)
        x -= interval * self.step
        interval += (np.arange(self.count)[:, None] * len(self.window) + place) * count
        return interval, x

    def approaches(self, force: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute approach [m] and slope [m/N], (U, N) each, under forces (U, N) [N] at positions (N,)."""
        interval, x = self.intervals(force, place)
        a, b, c, d = (part.take(interval) for part in self.cubics)
        yields, inside = ((a * x + b) * x + c) * x + d, (self.forces[0] < force) & (force < self.forces[-1])
        return force * yields, yields + np.where(inside, (3.0 * a * x + 2.0 * b) * x + c, 0.0)

    def moments_under(self, force: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Compute the moments ``mu`` (U, 3, N) under forces (U, N) [N] at positions (N,)."""
        interval, x = self.intervals(force, place)
        moments = np.empty((len(force), 3, force.shape[1]))
        for node, (low, rise) in enumerate(zip(self.moments, self.rises, strict=True)):
            moments[:, node] = low.take(interval) + x * rise.take(interval)
        return moments

    def between(self, moments: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Compute what every slot yields under a force on another (U, U, N), by moments (U, 3, N) at positions (N,)."""
        U, N, P = self.count, moments.shape[-1], len(self.window)
        whole = N % P == 0 and np.array_equal(place, np.repeat(np.arange(P), N // P))
        compliance = np.empty((U, U, N))
        for w in range(U):
            smooth = self.smooth[:, w:, :, w].reshape(P, -1, 3)
            if whole:
                half = smooth @ moments[w].reshape(3, P, -1).swapaxes(0, 1)
                half = half.reshape(P, U - w, 3, -1).transpose(1, 2, 0, 3)
            else:
                half = np.einsum("nva,an->vn", smooth[place], moments[w]).reshape(U - w, 3, N)
            others = moments[w:].reshape(half.shape)
            row = np.einsum("vb...,vb...->v...", half, others).reshape(U - w, N)
            compliance[w, w:] = compliance[w:, w] = row
        if self.supports.any():
            compliance += self.supports.transpose(1, 2, 0)[..., place]
        return compliance


class _SpringNewton:
    """Newton's method of `solve_laws` on N = P n problems, position by position.

    Motions and approaches are over the unit of the springs. Results are ``force`` (U, N), ``motions`` (m, N),
    ``stiffness`` (meshes, N) and ``solved`` (N,).
    """

    def __init__(self, springs: PairSprings, load: np.ndarray, separations: np.ndarray, tilts: np.ndarray | None):
        (P, _, n), at = separations.shape, np.arange(len(separations))[:, None]
        self.springs, self.load, self.limit = springs, load, _SETTLED * np.abs(load).max()
        self.place = np.repeat(np.arange(P), n)
        apart = springs.separation[..., None] + separations[at, springs.window] / springs.unit
        self.apart = apart.swapaxes(0, 1).reshape(springs.count, -1)
        self.tilts = tilts
        if tilts is not None:
            of_slots = tilts[at, springs.window] / springs.unit
            self.tilts = of_slots.transpose(1, 2, 0, 3).reshape(springs.count, 3, -1)
        self.solved = np.zeros(P * n, bool)
        self.force, self.motions = np.zeros((springs.count, P * n)), np.zeros((len(load), P * n))
        self.closed, self.stiffness = self.force > 0.0, np.zeros((springs.meshes, P * n))

    def solve(self) -> None:
        """Iterate until all problems are solved, or for `_MOST_STEPS` steps."""
        everything = np.arange(len(self.place))
        self._restart(everything)
        late = self._iterate(everything, _BOLD, refreshed=_REFRESHED)
        self._restart(late)
        left = self._iterate(late, _MOST_STEPS, careful=True)
        # once more with the moments of the forces that were found
        resumed = np.setdiff1d(late, left)
        self.solved[resumed] = False
        self._iterate(resumed, _MOST_STEPS, careful=True)
        # what is no number has no forces, and settles
        arms = self.springs.arms.transpose(1, 2, 0)[..., self.place]
        balance = self.load[:, None] - np.einsum("wmn,wn->mn", arms, self.force)
        self.solved &= np.abs(balance).max(axis=0) < _BALANCED * np.abs(self.load).max()

    def _restart(self, todo: np.ndarray) -> None:
        """Begin some problems with the forces of the given state."""
        self.force[:, todo] = self.springs.force[self.place[todo]].T
        self.motions[:, todo] = self.springs.motions[self.place[todo]].T
        self.closed[:, todo] = self.force[:, todo] > 0.0

    def _iterate(self, todo: np.ndarray, steps: int, *, refreshed: int = 1, careful: bool = False) -> np.ndarray:
        """Take steps until some problems have ended; give those that have not.

        For so many steps the moments of the pressures are refreshed from the forces as they are.
        """
        state = _Problems(self, todo)
        for step in range(steps):
            if not state.live.any():
                break
            if step < refreshed:
                state.refresh()
            ended = state.step(careful) & state.live & (careful or step >= refreshed)
            if ended.any():
                self._keep(state, np.flatnonzero(ended))
                state.live &= ~ended
                if state.live.mean() < _CROWD:
                    state = state.compressed()
        return state.number[state.live]

    def _keep(self, state: _Problems, ended: np.ndarray) -> None:
        """Keep forces, zero where they are of the size of rounding, motions and stiffness of problems."""
        which = state.number[ended]
        self.force[:, which], self.motions[:, which] = state.force[:, ended], state.motions[:, ended]
        self.closed[:, which], self.solved[which] = state.closed[:, ended], True
        self.stiffness[:, which] = state.mesh_stiffness(self._carried(self.force[:, which]), ended)

    def _carried(self, force: np.ndarray) -> np.ndarray:
        """Forces [N], zero where they are of the size of rounding."""
        return np.where(force > FAINT * np.abs(self.load).max(), force, 0.0)


class _Problems:
    """Some problems on their way to the solution, of which the ``live`` ones go on."""

    def __init__(self, newton: _SpringNewton, number: np.ndarray):
        self.newton, self.springs, self.number = newton, newton.springs, number
        self.place, self.apart = newton.place[number], newton.apart[:, number]
        self.force, self.motions = newton.force[:, number], newton.motions[:, number]
        self.closed, self.live = newton.closed[:, number], np.ones(len(number), bool)
        self.arms = self.springs.arms.transpose(1, 2, 0)[..., self.place]
        self.between, self.bent = np.zeros((0, 0, len(number))), self.apart

    def compressed(self) -> _Problems:
        """Leave out the problems that have ended."""
        live, compressed = self.live, object.__new__(_Problems)
        compressed.newton, compressed.springs = self.newton, self.springs
        for name in (
            "number",
            "place",
            "apart",
            "force",
            "motions",
            "closed",
            "live",
            "arms",
            "between",
            "bent",
        ):
            setattr(compressed, name, getattr(self, name)[..., live])
        return compressed

    def refresh(self) -> None:
        """Take the moments of the pressures from the forces as they are."""
        moments = self.springs.moments_under(self.force, self.place)
        self.between = self.springs.between(moments, self.place)
        field = -self.springs.field.transpose(1, 2, 0)[..., self.place]
        if self.newton.tilts is not None:
            field += self.newton.tilts[..., self.number]
        self.bent = self.apart + np.einsum("wan,wan->wn", moments, field)

    def step(self, careful: bool) -> np.ndarray:
        """Take a step; whether (N,) each problem has come to its end."""
        F, U = self.force, self.springs.count
        value, slope = self.springs.approaches(F, self.place)
        gap = self.bent + value
        gap -= np.einsum("wmn,mn->wn", self.arms, self.motions)
        gap += np.einsum("vwn,vn->wn", self.between, F)
        on = self.closed if careful else (F > 0.0) | (gap < 0.0)
        balance = self.newton.load[:, None] - np.einsum("wmn,wn->mn", self.arms, F) - _SOFTEST * self.motions
        change, moved = np.zeros(F.shape), np.zeros(self.motions.shape)
        counts = np.where(self.live, on.sum(axis=0), U + 1)
        order = np.argsort(counts, kind="stable")[: np.count_nonzero(self.live)]
        for first in range(0, len(order), _SIDE_BY_SIDE):
            problems = order[first : first + _SIDE_BY_SIDE]
            self._eliminate(problems, on, slope, gap, balance, change, moved)
        length = np.ones(len(self.number))
        if careful:
            falls = on & (change < 0.0)
            reach = np.divide(-F, change, out=np.full(F.shape, np.inf), where=falls)
            length = np.minimum(reach.min(axis=0), 1.0)
            self.closed = on & (reach > length)
        # what is open carries nothing at all: an absent window would close under the last bit of a force
        carries = self.closed if careful else on
        settled = np.abs(change).max(axis=0) < self.newton.limit
        self.force = np.where(self.live, np.where(carries, np.maximum(F + length * change, 0.0), 0.0), F)
        self.motions += length * moved
        # a planet whose forces are zero may still have moved into one of its flanks
        overlap = np.where(on, 0.0, gap - np.einsum("wmn,mn->wn", self.arms, length * moved))
        fits = overlap.min(axis=0) >= -self.newton.limit
        ended = settled & (length == 1.0) & fits
        if careful:
            more = np.flatnonzero(settled & (length == 1.0) & ~fits & self.live)
            self.closed[overlap[:, more].argmin(axis=0), more] = True
        return ended

    def _eliminate(self, problems, on, slope, gap, balance, change, moved) -> None:
        """Solve the linear equations of some problems: forces of the slots that are on, and motions.

        ``[[H, G], [G^T, -soft]]`` is symmetric, and definite in either block: elimination needs no exchange.
        """
        (m, n), N = (len(balance), len(problems)), self.between.shape[-1]
        problem, slot = np.nonzero(on[:, problems].T)
        count = np.bincount(problem, minlength=n)
        size = int(count.max(initial=0))
        slots, rank = (
            np.zeros((size, n), np.intp),
            np.arange(len(problem)) - (np.cumsum(count) - count)[problem],
        )
        slots[rank, problem] = slot
        # problems of fewer slots than others have equations of nothing
        absent = np.arange(size)[:, None] >= count
        cells, rows = slots * N + problems, slots * (self.springs.count * N)
        system, between = np.empty((size + m, size + m + 1, n)), self.between.ravel()
        for k in range(size):
            between.take(rows[k] + cells[k:], out=system[k, k:size], mode="clip")
        diagonal = np.arange(size)
        system[diagonal, diagonal] += slope.ravel().take(cells)
        place = slots + self.place[problems] * self.springs.count
        for motion in range(m):
            self.springs.arms[..., motion].ravel().take(place, out=system[:size, size + motion], mode="clip")
        np.negative(gap.ravel().take(cells), out=system[:size, -1])
        for k in range(size if absent.any() else 0):
            system[k, k:size] *= ~absent[k:]
            system[k, size:] *= ~absent[k]
            system[k, k] += absent[k]
        system[size:, size:-1] = 0.0
        system[range(size, size + m), range(size, size + m)] = -_SOFTEST
        system[size:, -1] = balance[:, problems]
        solution = solved_side_by_side(system)
        change[slot, problems[problem]] = solution[rank, problem]
        moved[:, problems] = -solution[size:]

    def mesh_stiffness(self, force: np.ndarray, ended: np.ndarray) -> np.ndarray:
        """Tangent stiffness (meshes, n) of every mesh at constant loads of the others.

        Of the problems that have ended, numbers (n,), with forces (U, n).
        """
        springs, place, N = self.springs, self.place[ended], self.between.shape[-1]
        slope = springs.approaches(force, place)[1]
        # of every mesh its pairs, (pairs, meshes, n)
        slot = springs.slot.T[:, place].reshape(springs.meshes, -1, len(ended)).swapaxes(0, 1)
        here, pairs = np.arange(len(ended)), len(slot)
        loaded = (force > 0.0)[slot, here] & (springs.window.T[:, place][slot, here] == self._windows(slot))
        system = np.empty((pairs, pairs + 1, springs.meshes, len(ended)))
        both = (slot[:, None] * springs.count + slot) * N + ended
        supports = springs.supports[place, slot[:, None], slot]
        system[:, :-1] = (self.between.ravel().take(both) - supports) * (loaded[:, None] & loaded)
        diagonal = np.arange(pairs)
        system[diagonal, diagonal] = np.where(loaded, slope[slot, here], 1.0)
        system[:, -1] = loaded
        flat = system.reshape(pairs, pairs + 1, -1)
        return (loaded * solved_side_by_side(flat).reshape(loaded.shape)).sum(axis=0)

    def _windows(self, slot: np.ndarray) -> np.ndarray:
        """Window of every pair of every mesh, (pairs, meshes, 1)."""
        pairs, meshes = slot.shape[:2]
        return (np.arange(meshes) * pairs + np.arange(pairs)[:, None])[..., None]


def solved_side_by_side(system: np.ndarray) -> np.ndarray:
    """Solve symmetric systems (k, k + 1, n), right sides last, for (k, n); their upper halves are used.

    Without exchange of rows, as quasi-definite matrices allow (R. J. Vanderbei, Symmetric quasidefinite
    matrices, SIAM J. Optim. 5 (1995) 100). The systems are overwritten.
    """
    size = len(system)
    # rows of U in A = U^T D^-1 U, and the same over their pivots
    over_pivots = np.empty_like(system)
    for k in range(size):
        row = system[k, k:]
        if k:
            row -= np.einsum("jn,jwn->wn", system[:k, k], over_pivots[:k, k:])
        np.multiply(row, 1.0 / row[0], out=over_pivots[k, k:])
    solution = over_pivots[:, -1]
    for k in range(size - 2, -1, -1):
        solution[k] -= np.einsum("jn,jn->n", over_pivots[k, k + 1 : -1], solution[k + 1 :])
    return solution
