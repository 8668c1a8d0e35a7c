"""GMRES for the lines of the settled motion (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.models.drivetrain_coupling import Coupling, LineProblem, coupling
from femgear.models.drivetrain_lattice import places

# Products before GMRES starts again, and how often.
_PRODUCTS, _STARTS = 250, 4
# Stiffness that is none, over the largest.
_ROUNDING = 1e-14


@dataclass(frozen=True)
class Chain:
    """The chain with mean mesh stiffness on some lines, which meet only by the turn of a carrier.

    Parameters
    ----------
    receptance : (L, m, m) complex array
        [m/N]
    mirrors : (N,) int array
        Lines near zero whose mirror images are neighbours of lines, in descending order.
    factors
        Of the equations on these mirror images and the lines; None where nothing turns.
    """

    receptance: np.ndarray
    mirrors: np.ndarray
    factors: object

    def solve(self, right) -> np.ndarray:
        """Motions (L, m) from those (L, m) without the turn."""
        if self.factors is None:
            return right
        both = np.concatenate([right[self.mirrors].conj(), right])
        return self.factors.solve(both.ravel()).reshape(both.shape)[len(self.mirrors) :]

    def pushed(self, forces) -> np.ndarray:
        """Motions (L, m) under forces on the simple motions (L, m) [N]."""
        return self.solve(np.matmul(self.receptance, forces[:, :, None])[:, :, 0])


def constant_chain(problem: LineProblem, lines) -> Chain:
    """The chain on the codes of lines (L,)."""
    near = 64 * max(one.turn for one in problem.families)
    mirrors = np.flatnonzero((lines > 0) & (lines < near))[::-1]
    receptance, turning = problem.receptance(lines), _turning_stiffness(problem)
    if not turning:
        return Chain(receptance, mirrors, None)
    both = np.concatenate([receptance[mirrors].conj(), receptance])
    codes = np.concatenate([-lines[mirrors], lines])
    return Chain(receptance, mirrors, _without_time(codes, both, turning))


@dataclass(frozen=True)
class LineEquations:
    """The equations on one set of lines, ready to be solved.

    Parameters
    ----------
    problem : LineProblem
    lines : (L,) int array
        Codes.
    table : Coupling
        From these lines to themselves.
    chain : Chain
    """

    problem: LineProblem
    lines: np.ndarray
    table: Coupling
    chain: Chain

    def left_side(self, x) -> np.ndarray:
        """``x + F (rest * x)`` (L, m)."""
        return x + np.matmul(self.chain.receptance, self.table.forces(x)[:, :, None])[:, :, 0]

    def solve(self, accuracy: float):
        """Two-sided lines (L, m) of the simple motions, and their residual over the size.

        Motions are taken in units of energy (``problem.scale``).

        Parameters
        ----------
        accuracy : float
            Of the residual, over the right side.
        """
        right = np.zeros((len(self.lines), len(self.problem.scale)), complex)
        right[0] = self.problem.static
        size = max(float(np.linalg.norm(right * self.problem.scale)), np.finfo(float).tiny)
        start, unit = np.zeros_like(right), size / self.problem.scale
        return krylov(self.left_side, self.chain.solve, right, start, unit, accuracy)


def krylov(left_side, prepared, right, start, unit, accuracy: float) -> tuple[np.ndarray, float]:
    """Solution (L, c) of linear equations and its residual, in units (c,) of the unknowns.

    Mirror images are conjugate, so that the equations are linear over real numbers only. The preconditioner
    stands on the right: GMRES sees the residual of the equations themselves.
    """
    from scipy.sparse.linalg import LinearOperator, gmres

    shape = right.shape

    def vector_of(x):
        return np.ascontiguousarray(x / unit).reshape(-1).view(float)

    def motion_of(vector):
        return prepared(vector.view(complex).reshape(shape) * unit)

    error = vector_of(right - left_side(start))
    operator = LinearOperator(
        (len(error),) * 2, matvec=lambda v: vector_of(left_side(motion_of(v))), dtype=float
    )
    found, _ = gmres(operator, error, rtol=0.0, atol=accuracy, restart=_PRODUCTS, maxiter=_STARTS)
    x = start + motion_of(found)
    return x, float(np.linalg.norm(vector_of(right - left_side(x))))


def line_equations(problem: LineProblem, lines) -> LineEquations:
    """Tables and factors for the codes of lines (L,)."""
    return LineEquations(problem, lines, coupling(problem, lines), constant_chain(problem, lines))


def _without_time(lines, receptance, turning):
    """Factors of the equations with constant mesh stiffness: lines meet only by the turn of a carrier."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    m, size = receptance.shape[1], receptance.shape[0] * receptance.shape[1]
    one = np.arange(m)
    entries = [(np.arange(size), np.arange(size), np.ones(size, complex))]
    for shift, stiffness in turning.items():
        column = places(lines, lines - shift)
        row = np.flatnonzero(column >= 0)
        block = receptance[row] @ stiffness
        at = np.broadcast_arrays(
            row[:, None, None] * m + one[:, None], column[row][:, None, None] * m + one, block
        )
        used = block != 0.0
        entries.append(tuple(part[used] for part in at))
    row, column, value = (np.concatenate(part) for part in zip(*entries))
    matrix = sparse.coo_array((value, (row, column)), shape=(size, size)).tocsc()
    return splu(matrix, permc_spec="NATURAL")


def _turning_stiffness(problem: LineProblem) -> dict[int, np.ndarray]:
    """{code of the shift: (m, m)} lines of ``S k S^T`` with the mean of k, without the mean itself."""
    total: dict[int, np.ndarray] = {}
    for one in problem.families:
        for a, u in one.directions.items():
            for b, v in one.directions.items():
                shift = (a + b) * one.turn
                if shift:
                    total[shift] = total.get(shift, 0.0) + (u * one.stiffness) @ v.T
    # of planets that are alike most of it cancels
    none = _ROUNDING * max((np.abs(one.mean).max() for one in problem.families), default=0.0)
    total = {shift: np.where(np.abs(k) > none, k, 0.0) for shift, k in total.items()}
    return {shift: k for shift, k in total.items() if k.any()}
