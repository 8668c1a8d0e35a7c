"""Average acceleration for meshes on a common rotation: one step with the meshes of many, flanks that part.

A step is a linear map of the state and the loads. The contacts of the meshes, few against the coordinates, enter by
the Woodbury formula: with ``A = M + gamma h C + beta h^2 K`` factorised once and ``F = beta h^2 U^T A^-1 U`` the
approaches at the end of a step are ``S^T x - S^T F S f`` with x the motion without the forces f there, so that only
small matrices, made for many instants at once, change from step to step. The rigid-body rotation is integrated apart
(`femgear.solvers.time.free_turn`): it turns the mesh phases, and cannot drift into the deviations.

Meshes that separate add the search for the flanks that touch. Drive and back flanks are contacts of their own with the
force ``k max(u, 0)`` of their overlap u, the approach less the gap. With the contacts known that touch, the overlaps
at the end of a step obey a small linear system. The forces do not fall with the overlap and the flexibility takes no
energy back, so that there is one solution. Changing the wrong contacts and solving again mostly ends after one round;
where it does not, only the first wrong one changes, which always ends (K. G. Murty, Opsearch 11, 1974, 123-130).

Laws of the motion, as of bearings with play, are solved by Newton's method around that search: with their forces b and
tangents B at the last iterate, the approaches are those of a system of the flexibility ``(1 + F B)^-1 F``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg

from femgear.errors import ConvergenceError
from femgear.solvers.time.free_turn import StepBlock
from femgear.solvers.time.spun_system import BACK, SPRING, SpunSystem
from femgear.solvers.time.steps import AVERAGE_ACCELERATION

# Rounding of an overlap relative to the largest one without mesh forces.
_OVERLAP_ROUNDING = 1e-12
# Rounds of changing all wrong contacts, and of changing one.
_ROUNDS, _SINGLE = 12, 10_000
# Newton steps for laws, their accuracy over the largest force, and what rounding leaves of it.
_LAWS, _LAW_ACCURACY, _LAW_ROUNDING = 50, 1e-12, 1e-9
# Instants whose matrices are made side by side, so that they stay in a cache.
_SIDE_BY_SIDE = 256
# Steps that go two at a time, whose maps are made together.
_TOGETHER = 256
# Steps that are tried at once with all drive flanks and no others in touch, first and last.
_FEW, _MANY = 8, 64


@dataclass(frozen=True)
class FlankScheme:
    """One step, mesh forces g on the simple motions at its end left open.

    Rows ``z = (q, v without g, g)`` go on by ``(q, v without g, x without g) = z advance + loads``; the state
    is ``(q, v) = z[:2n] - drawn g``, and ``x = U^T q`` becomes ``x without g - flexibility g``. There are
    ``n`` coordinates, m simple motions ``basic`` (n, m), ``advance`` (2 n + m, 2 n + m), ``loads_before`` and
    ``loads_after`` (d, 2 n + m), by which d loads at the start and the end of the step act,
    ``drawn`` (m, 2 n) and ``flexibility`` (m, m) [m/N].
    """

    advance: np.ndarray
    loads_before: np.ndarray
    loads_after: np.ndarray
    drawn: np.ndarray
    flexibility: np.ndarray
    basic: np.ndarray
    n: int

    @classmethod
    def of(cls, spun: SpunSystem, h: float, directions: np.ndarray) -> FlankScheme:
        """Factorise average acceleration: steps h [s], loads along ``directions`` (n, d)."""
        rule, system, U = AVERAGE_ACCELERATION, spun.system, spun.basic
        M, D, K, n = system.M, system.C, system.K, len(system.M)
        # columns: q, v, g, loads before, loads after, mesh forces after
        ends = np.cumsum([n, n, U.shape[1], directions.shape[1], directions.shape[1], U.shape[1]])
        blank = np.zeros((n, ends[-1]))
        q, v, force, after = blank.copy(), blank.copy(), blank.copy(), blank.copy()
        q[:, :n], v[:, n : ends[1]] = np.eye(n), np.eye(n)
        force[:, ends[1] : ends[2]], force[:, ends[2] : ends[3]] = -U, directions
        after[:, ends[3] : ends[4]], after[:, ends[4] :] = directions, -U
        begin = linalg.solve(M, force - D @ v - K @ q, assume_a="pos")
        q_free = q + h * v + h * h * (0.5 - rule.beta) * begin
        v_free = v + h * (1.0 - rule.gamma) * begin
        A = M + rule.gamma * h * D + rule.beta * h * h * K
        end = linalg.solve(A, after - D @ v_free - K @ q_free)
        q_end, v_end = q_free + rule.beta * h * h * end, v_free + rule.gamma * h * end
        whole = np.vstack([q_end, v_end, U.T @ q_end])
        drawn = -whole[: 2 * n, ends[4] :]
        moved = whole[:, : 2 * n]
        advance = np.hstack([moved, whole[:, 2 * n : ends[2]] - moved @ drawn])
        return cls(
            np.ascontiguousarray(advance.T),
            whole[:, ends[2] : ends[3]].T,
            whole[:, ends[3] : ends[4]].T,
            np.ascontiguousarray(drawn.T),
            -whole[2 * n :, ends[4] :],
            U,
            n,
        )

    @cached_property
    def of_pairs(self) -> np.ndarray:
        """Map of `_march_pairs`, (2 n + 2 m, 2 n + 2 m)."""
        at = 2 * self.n
        of_state, of_forces = self.advance[:at], self.advance[at:]
        later = self.advance[:, :at] @ of_state
        whole = np.hstack([later[:, :at], self.advance[:, at:], later[:, at:]])
        return np.vstack([whole[:at], of_forces[:, :at] @ whole[:at], whole[at:]])

    def states(self, rows) -> np.ndarray:
        """Compute states ``(q, v, g)`` of rows ``z``, (..., 2 n + m) both."""
        out = np.array(rows)
        out[..., : 2 * self.n] -= rows[..., 2 * self.n :] @ self.drawn
        return out

    def row(self, state) -> np.ndarray:
        """Compute rows ``z`` of states ``(q, v, g)``, (..., 2 n + m) both."""
        out = np.array(state)
        out[..., : 2 * self.n] += state[..., 2 * self.n :] @ self.drawn
        return out


@dataclass(frozen=True)
class MeshBlock:
    """Small matrices of the ends of the t steps of a block, c contacts on m simple motions.

    ``selection`` (t, m, c), ``stiffness`` and ``gap`` (t, c) of the contacts; ``closed`` (t, m, m) from x without
    mesh forces (a row) to the forces on the simple motions when all drive flanks and springs touch, and ``given`` (t,
    m) what the gaps take from these forces; None where no gap has to close.
    """

    selection: np.ndarray
    stiffness: np.ndarray
    gap: np.ndarray
    closed: np.ndarray
    given: np.ndarray | None

    @classmethod
    def of(cls, scheme: FlankScheme, block: StepBlock, meshes: int) -> MeshBlock:
        """Make the matrices of a block whose first `meshes` contacts are drive flanks and springs."""
        selection, stiffness, gap = block.selection[1:], block.stiffness[1:], block.gap[1:]
        closed = np.empty((len(selection), *scheme.flexibility.shape))
        given = np.empty(closed.shape[:2]) if np.any(gap[:, :meshes]) else None
        for first in range(0, len(closed), _SIDE_BY_SIDE):
            these = slice(first, first + _SIDE_BY_SIDE)
            # closed = Y (1 + Y^T F^T Y)^-1 Y^T with Y = S k^(1/2)
            Y = selection[these, :, :meshes] * np.sqrt(stiffness[these, None, :meshes])
            across = np.ascontiguousarray(np.swapaxes(Y, 1, 2))
            # of every instant Y^T F, by one product
            rows = across.reshape(np.prod(across.shape[:2]), across.shape[2])
            yielded = (rows @ scheme.flexibility).reshape(across.shape)
            inner = np.matmul(yielded, Y)
            solved = _solved_side_by_side(np.swapaxes(inner, 1, 2), across)
            np.matmul(Y, solved, out=closed[these])
            if given is not None:
                pressed = np.sqrt(stiffness[these, :meshes]) * gap[these, :meshes]
                given[these] = np.einsum("tcm,tc->tm", solved, pressed)
        return cls(selection, stiffness, gap, closed, given)


def _solved_side_by_side(matrix, right) -> np.ndarray:
    """Solve ``(1 + matrix) x = right`` for many instants at once: (t, c, c), (t, c, m).

    The symmetric part of 1 + matrix is positive definite, so that no rows are exchanged (G. H. Golub and
    C. F. Van Loan, Matrix Computations, section 4.2).
    """
    t, c, m = right.shape
    system = np.empty((c, c + m, t))
    system[:, :c], system[:, c:] = matrix.transpose(1, 2, 0), right.transpose(1, 2, 0)
    system[range(c), range(c)] += 1.0
    for k in range(c):
        # row k of U over its pivot, and column k of L
        if k:
            system[k, k:] -= np.einsum("jt,jwt->wt", system[k, :k], system[:k, k:])
            system[k + 1 :, k] -= np.einsum("ijt,jt->it", system[k + 1 :, :k], system[:k, k])
        system[k, k + 1 :] *= 1.0 / system[k, k]
    solution = system[:, c:]
    for k in range(c - 2, -1, -1):
        solution[k] -= np.einsum("jt,jwt->wt", system[k, k + 1 : c], solution[k + 1 :])
    return np.ascontiguousarray(solution.transpose(2, 0, 1))


def march_closed(scheme: FlankScheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
    """Fill ``rows[i + 1]`` (2, 2 n + m), the motion and the free motion, from ``rows[i]`` for i in `steps`.

    All meshes are linear; `loads` (t, 2 n + m) act on the motion alone.
    """
    advance, closed, given, at = scheme.advance, meshes.closed, meshes.given, 2 * scheme.n
    dot = np.dot
    for i in steps:
        after = rows[i + 1]
        dot(rows[i], advance, out=after)
        after[0] += loads[i]
        drawn = after[:, at:]
        drawn[:] = dot(drawn, closed[i])
        if given is not None:
            drawn[0] -= given[i]


def march_pairs(scheme: FlankScheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
    """Fill rows as `march_closed`, two steps at a time; the free motion is left out between them."""
    even = len(steps) // 2 * 2
    for first in range(0, even, _TOGETHER):
        _march_pairs(scheme, meshes, loads, rows, steps[first : min(first + _TOGETHER, even)])
    march_closed(scheme, meshes, loads, rows, steps[even:])


def _march_pairs(scheme: FlankScheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
    """Fill rows by pairs of steps, each of which is one linear map.

    Its rows ``(q, v, g, g)`` have the mesh forces g at the ends of both steps; those of the first one enter
    ``(q, v)`` with the next map. The states between are computed at the end, all at once.
    """
    at, start, stop, pairs = 2 * scheme.n, steps.start, steps.stop, len(steps) // 2
    of_state, of_forces = scheme.advance[:at], scheme.advance[at:]
    m = len(of_forces)
    first, second = meshes.closed[start:stop:2], meshes.closed[start + 1 : stop : 2]
    forces = np.zeros((pairs, 2 * m, 2 * m))
    forces[:, :m, :m], forces[:, m:, m:] = first, second
    forces[:, :m, m:] = (first.reshape(pairs * m, m) @ of_forces[:, at:]).reshape(first.shape) @ second
    offset = np.zeros((pairs, 2 * m))
    if meshes.given is not None:
        offset[:, :m], late = -meshes.given[start:stop:2], -meshes.given[start + 1 : stop : 2]
        offset[:, m:] = np.einsum("tm,tmk->tk", offset[:, :m] @ of_forces[:, at:], second) + late
    early, late = loads[start:stop:2], loads[start + 1 : stop : 2]
    begun = early[:, :at] @ of_state
    added = np.hstack([begun[:, :at] + late[:, :at], early[:, at:], begun[:, at:] + late[:, at:]])
    state_rows = np.zeros((pairs + 1, 2, at + 2 * m))
    state_rows[0, :, :at], state_rows[0, :, at + m :] = rows[start, :, :at], rows[start, :, at:]
    dot, double, after = np.dot, scheme.of_pairs, state_rows[1:]
    for before, end, motion, drawn, load, closed, given in zip(
        state_rows, after, after[:, 0], after[:, :, at:], added, forces, offset
    ):
        dot(before, double, out=end)
        motion += load
        drawn[:] = dot(drawn, closed)
        drawn[0] += given
    for row in (0, 1):
        ends, between = rows[start + 2 : stop + 1 : 2, row], after[:, row, at : at + m]
        np.matmul(between, of_forces[:, :at], out=ends[:, :at])
        ends[:, :at] += after[:, row, :at]
        ends[:, at:] = after[:, row, at + m :]
    middle = rows[start + 1 : stop : 2, 0]
    np.matmul(rows[start:stop:2, 0], scheme.advance, out=middle)
    middle += early
    middle[:, at:] = after[:, 0, at : at + m]


def solve_overlaps(
    flexibility, free, closed, touching, parted: np.ndarray | float = 0.0, *, always: np.ndarray | bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Solve ``u + flexibility force(u) = free`` for overlaps u and the contacts that touch (n,).

    ConvergenceError: no contacts fit (E-CONTACT).

    Parameters
    ----------
    flexibility : (n, n) array
        Overlaps per force, with a symmetric part that is not negative [m/N].
    free : (n,) array
        Overlaps without the forces [m].
    closed : (n,) bool array
        First guess.
    touching, parted : (n,) arrays
        Forces over overlaps of contacts that touch, and of the others [N/m].
    always : (n,) bool array
        Springs, which never part.
    """
    rounding = _OVERLAP_ROUNDING * np.abs(free).max(initial=0.0)
    for number in range(_ROUNDS + _SINGLE):
        slopes = np.where(closed, touching, parted)
        u = np.linalg.solve(np.eye(len(free)) + flexibility * slopes, free)
        closed_now = _changed(u, closed, rounding) | always
        wrong = np.flatnonzero(closed_now != closed)
        if not len(wrong):
            return u, closed
        # all that are wrong, or the first one alone
        wrong = wrong if number < _ROUNDS else wrong[:1]
        closed = closed.copy()
        closed[wrong] = closed_now[wrong]
    raise ConvergenceError(
        "no contacts of the meshes fit the end of a step",
        code="E-CONTACT",
        remedy='take shorter steps, or the start "zero"',
    )


def _changed(u, closed, rounding: float) -> np.ndarray:
    """The contacts that touch with overlaps u; within rounding as before."""
    return np.where(closed, u >= -rounding, u > rounding)


class Separating:
    """Steps of meshes that separate, whose contacts are what ``side`` (c,) says, see `SpunSystem`."""

    def __init__(self, side: np.ndarray):
        (self.dgesv,) = linalg.get_lapack_funcs(("gesv",), dtype=float)
        self.drive, self.spring = side != BACK, side == SPRING
        # what leaves the drive flanks, and no others, in touch is not below zero
        self.sense = np.where(self.spring, 0.0, np.where(self.drive, 1.0, -1.0))
        self.tries = _FEW
        self._take(self.drive)

    def _take(self, closed) -> None:
        """Keep the contacts that touch, and the overlaps from ``least`` to ``most`` that fit them."""
        self.closed, self.drives = closed, np.array_equal(closed, self.drive)
        self.touching = np.flatnonzero(closed)
        self.least = np.where(closed & ~self.spring, 0.0, -np.inf)
        self.most = np.where(closed, np.inf, 0.0)

    def march(self, scheme: FlankScheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
        """Fill rows as `march_closed`, with the contacts that touch."""
        i, stop = steps.start, steps.stop
        while i < stop:
            if self.drives:
                tried = range(i, min(i + self.tries, stop))
                march_closed(scheme, meshes, loads, rows, tried)
                kept = self._kept(scheme, meshes, rows, tried)
                i += kept
                self.tries = min(2 * self.tries, _MANY)
                if kept == len(tried):
                    continue
                self.tries = _FEW
            self._step(scheme, i, meshes, loads, rows)
            i += 1

    def _kept(self, scheme, meshes, rows, steps) -> int:
        """Steps until the first drive flank parts or back flank touches."""
        at, n = 2 * scheme.n, scheme.n
        z = rows[steps.start + 1 : steps.stop + 1, 0]
        x = z[:, :n] @ scheme.basic - z[:, at:] @ scheme.flexibility.T
        approach = np.einsum("tmj,tm->tj", meshes.selection[steps.start : steps.stop], x)
        gap = meshes.gap[steps.start : steps.stop]
        wrong = ((approach - gap) * self.sense < 0.0).any(axis=1)
        return int(np.argmax(wrong)) if wrong.any() else len(z)

    def _step(self, scheme, i, meshes, loads, rows) -> None:
        after = rows[i + 1]
        np.dot(rows[i], scheme.advance, out=after)
        after[0] += loads[i]
        drawn = after[:, 2 * scheme.n :]
        drawn[:] = self._forces(scheme.flexibility, meshes, i, drawn)

    def _forces(self, flexibility, meshes, i, x):
        """Forces and their tangents (2, m) on the simple motions from these motions (2, m) without them."""
        forces, u = self._solved(flexibility, meshes, i, x)
        if ((u >= self.least) & (u <= self.most)).all():
            return forces
        if not np.isfinite(x).all():
            return np.full_like(x, np.nan)
        S = meshes.selection[i]
        free = np.dot(x[0], S) - meshes.gap[i]
        closed_now = _changed(u, self.closed, _OVERLAP_ROUNDING * np.abs(free).max()) | self.spring
        if np.array_equal(closed_now, self.closed):
            return forces
        between = np.dot(S.T, np.dot(flexibility, S))
        self._take(solve_overlaps(between, free, closed_now, meshes.stiffness[i], always=self.spring)[1])
        return self._solved(flexibility, meshes, i, x)[0]

    def _solved(self, flexibility, meshes, i, x):
        """Forces and tangents with the present contacts, and the overlaps (c,) that they lead to."""
        S, k = meshes.selection[i], meshes.stiffness[i][self.touching]
        if not len(k):
            return np.zeros_like(x), np.dot(x[0], S) - meshes.gap[i]
        columns_touching, flexible = S.take(self.touching, axis=1), flexibility.T
        inner = np.dot(np.dot(columns_touching.T, flexible), columns_touching) * k
        inner.ravel()[:: len(k) + 1] += 1.0
        right = np.dot(x, columns_touching)
        right[0] -= meshes.gap[i][self.touching]
        right *= k
        # rows in C order are columns in that of Fortran: nothing is copied
        forces = np.dot(self.dgesv(inner.T, right.T, overwrite_a=True, overwrite_b=True)[2].T, columns_touching.T)
        return forces, np.dot(x[0] - np.dot(forces[0], flexible), S) - meshes.gap[i]


class Yielding(Separating):
    """Steps with ``laws`` beside the contacts of a system, from motions (m,) of ``basic`` on.

    Where flanks do not part all of them are springs.
    """

    def __init__(self, spun: SpunSystem, motion: np.ndarray, *, parts: bool):
        super().__init__(spun.side if parts else np.full(len(spun.side), SPRING))
        self.spun, self.motion = spun, motion

    def march(self, scheme: FlankScheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
        """Fill rows as `march_closed`, with the contacts that touch and the forces of the laws."""
        for i in steps:
            self._step(scheme, i, meshes, loads, rows)

    def _forces(self, flexibility, meshes, i, x):
        if not np.isfinite(x).all():
            return np.full_like(x, np.nan)
        force, tangent = self.spun.law_forces(self.motion)
        identity, settled = np.eye(len(force)), np.inf
        for _ in range(_LAWS):
            # rows: the motion, and the free motion with the tangents alone
            yielded = np.linalg.inv(identity + flexibility @ tangent)
            offset = force - tangent @ self.motion
            pulled = np.dot(np.stack([x[0] - flexibility @ offset, x[1]]), yielded.T)
            softened = yielded @ flexibility
            contact = super()._forces(softened, meshes, i, pulled)
            moved = pulled - np.dot(contact, softened.T)
            total = contact + np.dot(moved, tangent)
            total[0] += offset
            new, slopes = self.spun.law_forces(moved[0])
            missed = np.abs(new - (offset + tangent @ moved[0])).max(initial=0.0)
            self.motion = moved[0]
            # the forces of the last iterate are in balance with its motion
            if missed <= _LAW_ACCURACY * max(np.abs(total[0]).max(initial=0.0), np.abs(new).max(initial=0.0)):
                return total
            if missed >= settled and missed <= _LAW_ROUNDING * np.abs(new).max(initial=0.0):
                return total
            force, tangent, settled = new, slopes, missed
        raise ConvergenceError(
            "no forces of the bearings with play fit the end of a step",
            code="E-CONTACT",
            remedy="take shorter steps",
        )
