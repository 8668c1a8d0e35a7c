"""The contact problem at many positions at once, by the parts of the compliance.

For a set of touching cells A the conditions of `femgear.contact.solve` are linear. With ``H = L + Pi S Pi^T``
(`femgear.contact.assembly.Candidates`), ``y = L_AA^-1 gap`` and ``Y = L_AA^-1 Pi`` window by window, and for
the moments ``z = Pi^T p`` of the loads of every window (Sherman, Morrison and Woodbury; the polynomials add
up to one, so that a motion q approaches the cells of all windows by ``Pi e G q``)

    (I + Q S) z - Q e G q = -Pi^T y,    (e G)^T z = load,    Q = Pi^T Y,    p = -y - Y (S z - e G q)

has three unknowns a window instead of its cells. With friction (`femgear.contact.flank_friction`) the equilibrium alone
has other levers, ``(e (G + mu sigma R))^T z = load``. All cells that pull or penetrate change sides at once, until
there are none. Positions where that does not end, and loads that may be rounding, are left to
`femgear.contact.solve.solve_contact`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from femgear.contact.active_set import NULL, RIGID, ROUNDING, factor, settle
from femgear.contact.assembly import Candidates
from femgear.contact.solve import ContactState, solve_contact
from femgear.contact.supports import BearingSprings
from femgear.contact.windows import ROUGH_STIFFNESS
from femgear.errors import ContactError

LARGEST_RESIDUAL = 1e-9
"""Of contact conditions and equilibrium; rounding leaves 1e-14."""
MOST_STEPS = 30
"""Linear solutions before a position is left to the single solver."""
FAINT = 1e-9
"""Share of the largest load below which a touching cell may be no contact at all."""
_ROUNDED = 1e-14
"""Violation that is rounding alone."""
_RESIDUAL = 1e-12
"""Violation above which a position is solved again by itself."""
_CRACKS_AT_ONCE, _MOST_CRACKED = 8, 200
"""Rounds in which all nodes on faces of cracks change sides that must, and rounds in all: later ones change one."""
_SAME_PLACE = 1e-9
"""Distance of positions that count as one [mesh periods]."""
_ROUNDS, _SETTLED = 60, 1e-14
"""Solutions of a position by itself that friction may ask for, each with that of the one before; change of the last."""


@dataclass(frozen=True)
class BatchState:
    """Solution at P positions in W windows of C cells, as `femgear.contact.solve.ContactState` has it.

    Parameters
    ----------
    loads, gaps : (P, W, C) arrays
        [N], [m].
    active : (P, W, C) bool array
        Cells that carry load.
    motions : (P, m) array
        [m].
    iterations, residual : (P,) arrays
        Linear solutions, and `ContactState.residual` [1].
    """

    loads: np.ndarray
    gaps: np.ndarray
    active: np.ndarray
    motions: np.ndarray
    iterations: np.ndarray
    residual: np.ndarray

    def with_rows(self, rows: np.ndarray, other: BatchState) -> BatchState:
        """Put the solution at some positions (n,) in place of that here."""
        values = {field.name: getattr(self, field.name).copy() for field in fields(self)}
        for name, of_positions in values.items():
            of_positions[rows] = getattr(other, name)
        return BatchState(**values)


def solve_batch(
    candidates: Candidates,
    load,
    springs: BearingSprings | None = None,
    *,
    start: np.ndarray | None = None,
    refined: bool = True,
) -> BatchState:
    """Solve the contact of all meshes and bearings at all positions.

    ContactError: as `femgear.contact.solve.solve_contact`.

    Parameters
    ----------
    load : (m,) array
        External load on the motions, the same at all positions [N].
    springs : BearingSprings, optional
        Of planet bearings with clearance.
    start : (P, W, C) bool array, optional
        Cells thought to touch; guessed for equal mesh forces when left out.
    refined : bool
        Solve once more for what rounding left out; without it only where that is more than `_ROUNDED`.
    """
    batch = _ActiveSets(candidates, np.asarray(load, float), springs, start)
    batch.solve(refined)
    state = batch.loads, batch.gaps, batch.active, batch.motions, batch.iterations, batch.residual
    return BatchState(*state)


def solve_with_cracks(
    candidates: Candidates, load, springs: BearingSprings | None = None
) -> tuple[Candidates, BatchState]:
    """Solve the contact of the flanks and of the faces of cracks at all positions.

    Give the candidates with the faces that touch, whose compliance is that of cracks closed there. The arguments are
    those of `solve_batch`. ContactError (E-CONTACT): faces that do not come to rest.
    """
    if not candidates.cracks:
        return candidates, solve_batch(candidates, load, springs)
    start, guess = _healthy_start(candidates, load, springs)
    candidates = candidates.with_closed(guess)
    state = solve_batch(candidates, load, springs, start=start)
    part, of_part, rows = candidates, state, np.arange(len(candidates.position))
    closed = [faces.copy() for faces in guess]
    for number in range(_MOST_CRACKED):
        moments = (part.polynomials * of_part.loads[..., None]).sum(axis=2)
        wanted = [crack.closing(moments) for crack in part.cracks]
        wrong = [faces != crack.closed for crack, faces in zip(part.cracks, wanted, strict=True)]
        unsettled = np.flatnonzero(np.any([flips.any(axis=1) for flips in wrong], axis=0))
        if not len(unsettled):
            return candidates.with_closed(closed), state
        if number >= _CRACKS_AT_ONCE:
            wrong = [_last_flip(flips) for flips in wrong]
        # positions do not know of one another: those that are settled stay
        part, rows = part.at(unsettled), rows[unsettled]
        part = part.with_closed(
            [crack.closed ^ flips[unsettled] for crack, flips in zip(part.cracks, wrong, strict=True)]
        )
        of_part = solve_batch(part, load, springs, start=of_part.active[unsettled])
        state = state.with_rows(rows, of_part)
        for faces, crack in zip(closed, part.cracks, strict=True):
            faces[rows] = crack.closed
    raise ContactError("the faces of a crack do not come to rest", code="E-CONTACT", limit=f"{_MOST_CRACKED} rounds")


def _healthy_start(
    candidates: Candidates, load, springs: BearingSprings | None
) -> tuple[np.ndarray | None, list[np.ndarray]]:
    """Guess the touching cells (P, W, C) and the closed pairs of nodes (P, k) of every crack.

    Those of the gears without cracks, whose state is the same in all mesh periods; where few positions repeat one
    another, no cells and no pairs.
    """
    zeta, pitch = candidates.setup.zeta[0, candidates.position, 0], candidates.setup.gears.base_pitch
    _, first, again = np.unique(np.rint(zeta / (_SAME_PLACE * pitch)), return_index=True, return_inverse=True)
    if 2 * len(first) > len(again):
        return None, [crack.closed for crack in candidates.cracks]
    whole = candidates.at(first).without_cracks()
    state = solve_batch(whole, load, springs, refined=False)
    moments = (whole.polynomials * state.loads[..., None]).sum(axis=2)[again]
    return state.active[again], [crack.closing(moments) for crack in candidates.cracks]


def _last_flip(flips: np.ndarray) -> np.ndarray:
    """The last true entry of every row (P, k) alone."""
    last = flips.shape[1] - 1 - flips[:, ::-1].argmax(axis=1)
    return flips & (np.arange(flips.shape[1]) == last[:, None])


def check_residual(candidates: Candidates, state: BatchState) -> None:
    """Refuse (E-CONTACT) a solution that violates its conditions by more than `LARGEST_RESIDUAL`."""
    if not (state.residual <= LARGEST_RESIDUAL).all():
        worst = int(np.argmax(~(state.residual <= LARGEST_RESIDUAL)))
        raise ContactError(
            f"the contact solution at position {candidates.position[worst]} violates its conditions by "
            f"{state.residual[worst]:.2g}",
            code="E-CONTACT",
            limit=f"{LARGEST_RESIDUAL:g} of the largest load and displacement",
            remedy="look for stiffnesses, clearances or separations of very different size",
        )


def check_definite(candidates: Candidates) -> None:
    """Refuse bodies whose compliance between all candidates at the first position is not positive definite.

    That of ``L + Pi S Pi^T`` is where ``L`` and ``I + Q^(1/2) S Q^(1/2)`` are, ``Q = Pi^T L^-1 Pi``.

    ContactError: E-CONTACT-COMPLIANCE.
    """
    filled = np.flatnonzero(candidates.candidate[0].any(axis=-1))
    local, candidate_cells = candidates.local[0, filled], candidates.candidate[0, filled]
    for matrix, cells in zip(local, candidate_cells, strict=True):
        factor(matrix[np.ix_(cells, cells)])
    values = candidates.polynomials[0, filled] * candidate_cells[..., None]
    size, axes = np.linalg.eigh(
        values.swapaxes(1, 2) @ local_solution(local, (np.arange(len(local)),), candidate_cells, values)
    )
    root = axes * np.sqrt(np.maximum(size, 0.0))[:, None] @ axes.swapaxes(1, 2)
    W, size = len(filled), 3 * len(filled)
    for smooth in cyclic_harmonics(candidates.images[:, 0, filled][:, :, :, filled]):
        half = (root @ smooth.reshape(W, 3, size)).reshape(W * 3, W, 3).swapaxes(0, 1)
        coupled = (half @ root).swapaxes(0, 1).reshape(size, size)
        whole = np.block([[coupled.real, -coupled.imag], [coupled.imag, coupled.real]])
        factor(np.eye(2 * size) + whole)


def cyclic_harmonics(images: np.ndarray) -> np.ndarray:
    """Harmonics over the images of a sector, (I // 2 + 1, ...); the images (I, ...) of a single one."""
    return np.fft.rfft(images, axis=0) if len(images) > 1 else images


class ContactTangents:
    """What the touching cells answer to small motions, at P positions in W windows.

    With the columns ``1`` and those of the ends of contacts, ``H_AA^-1 = L_AA^-1 - Y M Y^T`` and
    ``M = S (I + Q S)^-1``.
    """

    def __init__(self, candidates: Candidates, state: BatchState):
        active, cells = state.active, state.active.shape[-1]
        loaded = np.asarray(active.any(axis=-1))
        # of every window the first and the last touching cell, and the open candidates beside them, (P, W, 2)
        ends = np.stack([active.argmax(axis=-1), cells - 1 - active[..., ::-1].argmax(axis=-1)], axis=-1)
        beside = np.clip(ends + np.array([-1, 1]), 0, cells - 1)

        def at(values, cell):
            return np.take_along_axis(values, cell, axis=2)

        rows, self.mesh = np.nonzero(loaded), candidates.mesh
        self.open = at(candidates.candidate, beside) & loaded[..., None]
        self.open &= beside != ends
        self.alone = np.repeat(ends[..., :1] == ends[..., 1:], 2, axis=-1)
        self.load, self.gap = at(state.loads, ends), at(state.gaps, beside)
        right, columns = np.zeros((2, *active.shape, 7))
        right[..., :3] = candidates.polynomials
        np.put_along_axis(right[..., 3:5], ends[:, :, None], 1.0, axis=2)
        right[..., 5:] = np.take_along_axis(candidates.local, beside[:, :, None], axis=3)
        right *= active[..., None]
        columns[rows] = local_solution(candidates.local, rows, active[rows], right[rows])
        moments = candidates.polynomials.swapaxes(-1, -2) @ columns
        self.Q, self.unit, self.reach = np.split(moments, [3, 5], axis=-1)
        # products of unit loads on the last cells, and of the columns of L beside them, within the window
        self.unit_2, self.reach_2 = np.split((right * columns).sum(axis=2)[..., 3:], 2, axis=-1)
        self.beside = at(candidates.polynomials, beside[..., None]).swapaxes(-1, -2)
        self.local_2 = at(np.diagonal(candidates.local, axis1=2, axis2=3), beside)

    def of_meshes(self, smooth: np.ndarray) -> np.ndarray:
        """Tangent stiffness of every mesh (P, meshes) at constant loads of the other meshes [N/m].

        ``K_A = 1^T (H_jj,AA)^-1 1`` over the loaded candidates A of mesh j, which all approach by the same
        small amount. The load over approach of cells is piecewise linear: ``K_A`` jumps by about a per cent
        whenever a cell is added at an end of a contact. Between the load at which the last cell ``a`` of an
        end began to carry and that at which the next one, ``b``, will, the slope goes from the mean of
        ``K_A-a`` and ``K_A`` to the mean of ``K_A`` and ``K_A+b``, in proportion to how far the load has
        come. The first cell of a tooth pair comes all at once.

        ``smooth`` (P, W, 3, W, 3) [m/N] is that of the candidates or of other bodies with the same flanks, of
        the planets alone where they have images.
        """
        P, meshes = len(self.Q), int(self.mesh[-1] + 1)
        pairs, every = len(self.mesh) // meshes, np.arange(meshes)
        n, window = 3 * pairs, np.arange(pairs)
        S = smooth.reshape(P, meshes, n, meshes, n)[:, every, :, every].swapaxes(0, 1)

        def of_mesh(values):
            """Columns (P, meshes, n, k) of the windows' three rows (P, W, 3, k / pairs)."""
            spread = np.zeros((P, meshes, pairs, 3, pairs, values.shape[-1]))
            each = values.reshape(P, meshes, pairs, 3, -1)
            spread[:, :, window, :, window] = each.transpose(2, 0, 1, 3, 4)
            return spread.reshape(P, meshes, n, -1)

        def product(first_factor, other):
            return (first_factor * other).sum(axis=-2)

        Q, unit, reach, beside = (of_mesh(a) for a in (self.Q, self.unit, self.reach, self.beside))
        ends = (a.reshape(P, meshes, -1) for a in (self.unit_2, self.reach_2, self.local_2, self.load, self.gap))
        unit_2, reach_2, square_2, load, gap = ends
        M = S @ np.linalg.inv(np.eye(n) + Q @ S)
        total, through = Q.sum(axis=-1, keepdims=True), S @ beside
        along, moments = 1.0 - M @ total, reach + Q @ through
        rate, closing = product(unit, along), 1.0 - product(moments, along)
        # what the slope loses without the last cell, and gains with the next one
        unit_2 = unit_2 - product(unit, M @ unit)
        reach_2 = reach_2 + product(through, reach + moments) - product(moments, M @ moments)
        come, left = load * closing, gap * rate
        usable = self.open.reshape(rate.shape) & (closing > 0) & (rate > 0) & (come + left > 0)
        alone = self.alone.reshape(rate.shape)

        def over(above, below, where):
            return np.divide(above, below, out=np.zeros(rate.shape), where=where)

        lost = over(rate**2, unit_2, usable & ~alone)
        gained = over(closing**2, square_2 + product(beside, through) - reach_2, usable)
        share = over(come, come + left, usable)
        change = 0.5 * (share * gained - (1.0 - share) * lost)
        return product(total, along)[..., 0] + change.sum(axis=-1)

    def between_meshes(self, images: np.ndarray, meshes: int) -> np.ndarray:
        """Tangent stiffness of the first meshes together, (I // 2 + 1, P, meshes, meshes) [N/m].

        The increments of the mesh forces per unit approach of each mesh while the others hold theirs, in
        every harmonic over the ``images`` (I, P, W, 3, W, 3) of the candidates or of other bodies [m/N].
        """
        W = int((self.mesh < meshes).sum())
        Q, S = self.Q[:, :W], cyclic_harmonics(images[:, :, :W, :, :W]).reshape(-1, len(self.Q), W, 3, 3 * W)
        of_mesh = (self.mesh[:W, None] == np.arange(meshes)).astype(float)
        right = Q.sum(axis=-1)[..., None] * of_mesh[:, None]
        matrix = (Q @ S).reshape(*S.shape[:2], 3 * W, 3 * W) + np.eye(3 * W)
        return np.repeat(of_mesh, 3, axis=0).T @ np.linalg.solve(matrix, right.reshape(-1, 3 * W, meshes))


class _ActiveSets:
    """Active sets of all positions on their way to the solution; motions over their largest arms."""

    def __init__(
        self,
        candidates: Candidates,
        load: np.ndarray,
        springs: BearingSprings | None,
        start: np.ndarray | None = None,
    ):
        P, W, C = candidates.gap.shape
        self.candidates, self.bearings, self.total_load = candidates, springs, load
        # problems at one position, which differ in their separations alone
        self.alike = P > 1 and candidates.local.strides[0] == 0 and candidates.friction is None
        G, arms = candidates.approach[candidates.mesh], np.zeros((0, len(load)))
        if springs is not None:
            arms = np.pad(springs.arms, ((0, 0), (len(load) - springs.arms.shape[1], 0)))
        self.arm = np.abs(np.vstack([G, arms])).max(axis=0)
        self.G, self.arms, self.load = G / self.arm, arms / self.arm, load / self.arm
        self.clearance, self.softness = (springs.clearance, springs.compliance) if springs else (0.0, 1.0)
        smooth = candidates.smooth[:1] if self.alike else candidates.smooth
        self.S = smooth + candidates.supports[np.ix_(candidates.mesh, candidates.mesh)][:, None, :, None]
        self.levers: np.ndarray | None = None
        if candidates.friction is not None:
            self.S = self.S + candidates.friction.supports[:, :, None, :, None]
            self.levers = self.G + candidates.friction.arms / self.arm
        # L^-1 of the separations and of the polynomials
        self.offset, self.columns = np.zeros((P, W, C)), np.zeros((P, W, C, 3))
        self.loads, self.gaps = np.zeros((2, P, W, C))
        self.motions, self.imbalance = np.zeros((2, P, len(load)))
        self.iterations, self.residual = np.zeros(P, int), np.zeros(P)
        self.active, self.springs = self._first(start)

    def _first(self, start: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Cells (P, W, C) and springs (P, n) that equal mesh forces, shared by the near pairs, would press.

        Of cells the candidates among those that are given, if any.

        Within Hertz's half width ``b`` the separation grows by less than ``b^2 / 2 R = 2 F / (pi E*)``.
        """
        candidates, meshes = self.candidates, self.candidates.setup.meshes
        pushed = -self.arms @ (candidates.approach[:meshes] / self.arm).sum(axis=0)
        springs = np.tile(pushed > 0.8 * pushed.max(initial=0.0), (len(candidates.gap), 1))
        if start is not None:
            return start & candidates.candidate, springs
        kind = candidates.setup.kind(np.arange(len(candidates.approach)))[:, None]
        width, modulus = np.array(candidates.bodies.widths)[kind], candidates.bodies.contact_moduli[kind]
        share = self.total_load.sum() / candidates.setup.n_planets
        gap = np.where(candidates.candidate, candidates.gap, np.inf)
        smallest = gap.min(axis=-1).reshape(len(gap), len(candidates.approach), -1)
        reached = smallest < smallest.min(axis=-1, keepdims=True) + share / (ROUGH_STIFFNESS * width)
        # back flanks carry nothing unless the solution says so
        reached[:, meshes:] = False
        force = share / np.maximum(reached.sum(axis=-1, keepdims=True), 1)
        edge = np.where(reached, smallest + 2 * force / (np.pi * modulus * width), -np.inf if share else 0.0)
        return gap <= edge.reshape(*gap.shape[:2], 1), springs

    def solve(self, refined: bool) -> None:
        """Solve all positions: together, and those that are left one by one."""
        first, solved = (self.active.copy(), self.springs.copy()), np.zeros(len(self.active), bool)
        self._pivot(np.arange(len(solved)), MOST_STEPS, solved)
        # what is left may have lost all contact on its way
        self.active[~solved], self.springs[~solved] = (start[~solved] for start in first)
        ready = np.zeros(0, int) if refined else self._ready(np.flatnonzero(solved))
        done = np.setdiff1d(np.flatnonzero(solved), ready)
        if len(done):
            solved[done] = self._refined(done)
            # cells of planets that carry nothing may touch all the same: they are released
            idle = done[~solved[done]]
            largest = self.loads[idle].max(axis=(1, 2), keepdims=True)
            self.active[idle] &= self.loads[idle] > FAINT * largest
            self._pivot(idle, 1, solved)
            idle = idle[solved[idle]]
            if len(idle):
                solved[idle] = self._refined(idle)
        for at in np.flatnonzero(~solved):
            self._alone(at)

    def _ready(self, done: np.ndarray) -> np.ndarray:
        """Solved positions whose rounding is small and whose cells all carry for certain."""
        loads, active = self.loads[done], self.active[done]
        faint = active & (loads <= FAINT * loads.max(axis=(1, 2), keepdims=True))
        ready = done[(self.residual[done] < _ROUNDED) & ~faint.any(axis=(1, 2))]
        self.motions[ready] = self.motions[ready] / self.arm
        self.gaps[ready] = np.where(self.active[ready], 0.0, np.maximum(self.gaps[ready], 0.0))
        self.loads[ready] = np.where(self.active[ready], self.loads[ready], 0.0)
        return ready

    def _pivot(self, todo, steps: int, solved) -> None:
        """Change the sides of all violating cells and springs of some positions; mark the `solved` ones."""
        candidates, changed = self.candidates, np.ones((len(todo), self.active.shape[1]), bool)
        for _ in range(steps if len(todo) else 0):
            rows, window = np.nonzero(changed)
            place = todo[rows], window
            self.offset[place], self.columns[place] = 0.0, 0.0
            touching = self.active[place].any(axis=-1)
            place = place[0][touching], place[1][touching]
            right = np.dstack([candidates.gap[place], candidates.polynomials[place]])
            columns = local_solution(candidates.local, place, self.active[place], right)
            self.offset[place], self.columns[place] = columns[..., 0], columns[..., 1:]
            step = self._linear(todo, self.offset[todo], self.load, self.clearance)
            flips, spring_flips = self._conditions(todo, *step)
            wrong = flips.any(axis=(1, 2)) | spring_flips.any(axis=1)
            solved[todo[~wrong]] = True
            todo, flips = todo[wrong], flips[wrong]
            if not len(todo):
                break
            self.active[todo] ^= flips
            self.springs[todo] ^= spring_flips[wrong]
            changed = flips.any(axis=-1)

    def _linear(self, todo, offset, load, clearance):
        """Loads, motions and unrestrained motions when exactly the active cells touch.

        From ``L^-1 gap`` (t, W, C), the load (t, m) or (m,) and the clearance of the bearings. Motions that
        nothing restrains are zero; they are the columns (m, k) of the arrays, by position.
        """
        S, columns = self._rows(self.S, todo), self.columns[todo]
        T, n = len(todo), 3 * S.shape[1]
        onto = self._rows(self.candidates.polynomials, todo).swapaxes(-1, -2)
        G = np.repeat(self.G, 3, axis=0)
        Q, moments = onto @ columns, onto @ offset[..., None]
        right = np.concatenate([Q.sum(axis=-1)[..., None] * self.G[:, None], moments], axis=-1)
        # windows in which nothing touches have no moments
        solved, touching = np.zeros((T, n // 3, *right.shape[2:])), np.asarray(self.active[todo].any(axis=-1))
        count = touching.sum(axis=1)
        for most in np.unique(count[count > 0]):
            alike = np.flatnonzero(count == most)
            windows = np.reshape(np.nonzero(touching[alike])[1], (-1, most))
            alike = alike[:, None]
            row = (alike % len(S))[..., None]
            between = S[row, windows[..., None], :, windows[:, None]]
            matrix = Q[alike, windows, None] @ between
            matrix = matrix.swapaxes(2, 3).reshape(len(alike), 3 * most, -1) + np.eye(3 * most)
            moments = right[alike, windows].reshape(len(alike), 3 * most, -1)
            solved[alike, windows] = np.linalg.solve(matrix, moments).reshape(len(alike), most, 3, -1)
        solved = solved.reshape(T, n, -1)
        springs = self.springs[todo] / self.softness
        by_springs = np.swapaxes(self.arms * springs[..., None], -1, -2) @ self.arms
        stiffness = G.T @ solved[..., :-1] + by_springs
        balance = load + solved[..., -1] @ G + clearance * (springs @ self.arms)
        held, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.swapaxes(-1, -2)))
        free = held <= NULL * held[:, -1:]
        if self.levers is None:
            along = vectors.swapaxes(-1, -2) @ balance[..., None]
            motions = vectors @ np.where(free[..., None], 0.0, along / np.where(free, 1.0, held)[..., None])
        else:
            levers = np.repeat(self.levers[todo], 3, axis=1).swapaxes(-1, -2)
            balance = load + (levers @ solved[..., -1:])[..., 0] + clearance * (springs @ self.arms)
            motions = _held_motions(levers @ solved[..., :-1] + by_springs, balance, vectors, free)
        moved = S.reshape(-1, n, n) @ (solved[..., :-1] @ motions - solved[..., -1:]) - G @ motions
        loads = -offset - (columns @ moved.reshape(T, -1, 3, 1))[..., 0]
        null = {at: vectors[at][:, free[at]] for at in np.flatnonzero(free.any(axis=1))}
        return loads, motions[..., 0], null

    def _carried(self, todo: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Loads on the motions (t, m) that forces of the windows (t, W) of some problems balance [N]."""
        if self.levers is None:
            return force @ self.G
        return (force[:, None] @ self.levers[todo])[:, 0]

    def _rows(self, values: np.ndarray, todo: np.ndarray) -> np.ndarray:
        """Values of some problems, (1, ...) where they are alike."""
        return values[:1] if self.alike else values[todo]

    def _yielding(self, todo: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """What the bodies yield in all cells under loads (t, W, C) of some problems [m]."""
        candidates, values = self.candidates, self._rows(self.candidates.polynomials, todo)
        T, n = len(todo), 3 * loads.shape[1]
        if self.alike:
            by_window, values = loads.swapaxes(0, 1), values[0]
            moments = (by_window @ values).swapaxes(0, 1).reshape(T, n)
            bodies = (moments @ self.S.reshape(n, n)).reshape(T, -1, 3).swapaxes(0, 1)
            elastic = bodies @ values.swapaxes(1, 2) + by_window @ candidates.local[0]
            return np.ascontiguousarray(elastic.swapaxes(0, 1))
        moments = (values.swapaxes(-1, -2) @ loads[..., None]).reshape(T, n, 1)
        bodies = (self.S[todo].reshape(T, n, n) @ moments).reshape(T, -1, 3, 1)
        elastic = (values @ bodies)[..., 0]
        rows = np.nonzero(loads.any(axis=-1))
        elastic[rows] += (candidates.local[todo[rows[0]], rows[1]] @ loads[rows][..., None])[..., 0]
        return elastic

    def _conditions(self, todo, loads, motions, null):
        """Keep a linear solution; find the cells and springs that violate the other conditions."""
        candidates, active, springs = self.candidates, self.active[todo], self.springs[todo]
        candidate, gap = candidates.candidate[todo], candidates.gap[todo]
        elastic = np.where(candidate, self._yielding(todo, loads), 0.0)
        separation = np.where(candidate, gap + elastic, np.inf)
        motions, turned, blocked, forced = self._settled(todo, separation, motions, null)
        approach = (motions @ self.G.T)[..., None]
        gaps = separation - approach
        closed = motions @ self.arms.T - self.clearance
        carried = np.where(springs, closed / self.softness, 0.0)
        moved, largest = np.abs(elastic).max(axis=(1, 2)), np.abs(loads).max(axis=(1, 2))
        largest = np.maximum(largest, np.abs(carried).max(axis=1, initial=0.0))[:, None, None]
        rounding = ROUNDING * (np.abs(gap) + (moved + 10 * turned)[:, None, None] + np.abs(approach))
        flips = np.where(active, loads < -10 * ROUNDING * largest, gaps < -rounding)
        imbalance = self.load - self._carried(todo, loads.sum(axis=-1)) - carried @ self.arms
        length = np.maximum(moved, RIGID * np.abs(gap).max(axis=(1, 2)))
        apart = np.where(active, np.abs(gaps), -gaps).max(axis=(1, 2)) / np.where(length > 0, length, 1.0)
        pull = np.maximum(-loads.min(axis=(1, 2)), np.abs(imbalance).max(axis=1))
        force = np.maximum(largest[:, 0, 0], np.abs(self.load).max())
        self.residual[todo] = np.maximum(apart, pull / np.where(force > 0, force, 1.0))
        self.loads[todo], self.motions[todo], self.imbalance[todo] = loads, motions, imbalance
        self.gaps[todo] = np.where(candidate, gaps, 0.0)
        self.iterations[todo] += 1
        rounding = ROUNDING * (self.clearance + 10 * turned[:, None] + np.abs(closed))
        # a closed spring without force would hold a planet that nothing presses at the end of its clearance
        spring_flips = np.where(springs, carried <= FAINT * largest[..., 0], closed > rounding)
        return flips & ~blocked[0] | forced[0], spring_flips & ~blocked[1] | forced[1]

    def _settled(self, todo, separation, motions, null):
        """Move planets that nothing restrains as little as they must.

        Gives the motions, the largest approach (t,) by it, and which cells (t, W, C) and springs (t, n) have
        gaps that mean nothing and which must touch, see `femgear.contact.active_set.settle`.
        """
        motions, turned = motions.copy(), np.zeros(len(todo))
        blocked, forced = (
            (np.zeros(separation.shape, bool), np.zeros((len(todo), len(self.arms)), bool)) for _ in range(2)
        )
        for at, free in null.items():
            candidate = self.candidates.candidate[todo[at]]
            arms, gaps = self.G[np.nonzero(candidate)[0]], separation[at][candidate]
            active = self.active[todo[at]][candidate]
            if len(self.arms):
                arms = np.vstack([arms, self.arms])
                gaps = np.append(gaps, np.full(len(self.arms), self.clearance))
                active = np.append(active, self.springs[todo[at]])
            motions[at] -= free @ (free.T @ motions[at])
            shift, *numbers = settle(arms, self.load, free, gaps - arms @ motions[at], active)
            motions[at] += free @ shift
            turned[at] = np.abs(arms @ (free @ shift)).max(initial=0.0)
            for (cells, springs), chosen in zip((blocked, forced), numbers, strict=True):
                if len(chosen):
                    chosen_gaps = np.zeros(len(gaps), bool)
                    chosen_gaps[chosen] = True
                    cells[at][candidate], springs[at] = np.split(chosen_gaps, [candidate.sum()])
        return motions, turned, blocked, forced

    def _refined(self, done) -> np.ndarray:
        """Take what rounding left out of solved positions; tell which of them need no second look."""
        active = self.active[done]
        rows = np.nonzero(active.any(axis=-1))
        at, offset = (done[rows[0]], rows[1]), np.zeros(active.shape)
        gaps = self.gaps[at][..., None]
        offset[rows] = local_solution(self.candidates.local, at, active[rows], gaps)[..., 0]
        loads, motions, null = self._linear(done, offset, self.imbalance[done], 0.0)
        conditions = self._conditions(done, self.loads[done] + loads, self.motions[done] + motions, null)
        loads = self.loads[done]
        largest = loads.max(axis=(1, 2), keepdims=True)
        doubtful = (active & (loads <= FAINT * largest)) | conditions[0]
        carries = active & (loads > 10 * ROUNDING * largest)
        self.active[done], self.motions[done] = carries, self.motions[done] / self.arm
        self.loads[done] = np.where(carries, loads, 0.0)
        self.gaps[done] = np.where(carries, 0.0, np.maximum(self.gaps[done], 0.0))
        sure = ~(doubtful.any(axis=(1, 2)) | conditions[1].any(axis=1))
        return sure & (self.residual[done] < _RESIDUAL)

    def _alone(self, at) -> None:
        """Solve one position by itself, from what touches at the position before."""
        problem, candidate = self.candidates.problem(at), self.candidates.candidate[at]
        before = max(at - 1, 0)
        arrays = problem.compliance, problem.gap, problem.G
        if self.bearings is not None:
            arrays = self.bearings.joined(*arrays)
        start = np.concatenate([self.active[before][candidate], self.springs[before]])
        state = solve_contact(*arrays, self.total_load, start=start)
        if self.candidates.friction is not None:
            state = self._alone_with_friction(at, arrays, state)
        self.springs[at] = state.active[len(problem.gap) :]
        for name in ("loads", "gaps", "active"):
            values = getattr(self, name)
            values[at] = 0
            values[at][candidate] = getattr(state, name)[: len(problem.gap)]
        self.motions[at], self.residual[at] = state.motions, state.residual
        self.iterations[at] += state.iterations

    def _alone_with_friction(self, at: int, arrays, state: ContactState) -> ContactState:
        """Solve one position with the friction of the solution before, until it is its own.

        The map contracts by about the coefficient of friction times roll length over base radius.
        """
        H, gap, G = arrays
        window, friction = np.nonzero(self.candidates.candidate[at])[0], self.candidates.friction
        assert friction is not None
        for _ in range(_ROUNDS):
            before = np.bincount(window, state.loads[: len(window)], minlength=len(self.candidates.mesh))
            parted = np.append((friction.supports[at] @ before)[window], np.zeros(len(gap) - len(window)))
            state = solve_contact(H, gap + parted, G, self.total_load - before @ friction.arms[at], start=state.active)
            after = np.bincount(window, state.loads[: len(window)], minlength=len(before))
            if np.abs(after - before).max() <= _SETTLED * np.abs(after).max():
                return state
        raise ContactError(
            f"the contact with friction does not settle at position {self.candidates.position[at]}",
            code="E-CONTACT",
            key="losses.excites",
            limit=f"{_ROUNDS} solutions",
            remedy="give a smaller coefficient of friction, or leave losses.excites out",
        )


def _held_motions(stiffness: np.ndarray, balance: np.ndarray, vectors: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Solve unsymmetric stiffnesses (t, m, m) for the motions (t, m, 1) without those that nothing restrains.

    ``vectors`` (t, m, m) are columns, of which ``free`` (t, m) are such motions.
    """
    onto = vectors.swapaxes(-1, -2)
    held = np.where(free[:, :, None] | free[:, None], np.eye(free.shape[1]), onto @ stiffness @ vectors)
    along = np.where(free[..., None], 0.0, onto @ balance[..., None])
    return vectors @ np.linalg.solve(held, along)


def local_solution(local, place, active, right) -> np.ndarray:
    """Solve ``L_AA Y = right_A`` at w places of windows (..., C, C): (w, C), (w, C, k); zero outside A."""
    columns, count = np.zeros(right.shape), active.sum(axis=-1)
    # windows of about the same number of cells together, their active cells first
    order, size = np.argsort(~active, axis=-1, kind="stable"), -(-count // 4) * 4
    for most in np.unique(size[size > 0]):
        rows = np.flatnonzero(size == most)[:, None]
        cells = order[rows[:, 0], :most]
        real = np.arange(cells.shape[1]) < count[rows]
        where = (index[rows][..., None] for index in place)
        matrix = local[*where, cells[:, :, None], cells[:, None, :]]
        matrix = np.where(real[:, :, None] & real[:, None, :], matrix, np.eye(cells.shape[1]))
        columns[rows, cells] = np.linalg.solve(matrix, np.where(real[..., None], right[rows, cells], 0.0))
    return columns
