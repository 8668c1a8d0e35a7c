"""GMRES for the lines of the settled motion (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.models.drivetrain_coupling import Coupling, LineProblem, coupling
from femgear.models.drivetrain_lattice import places

# Products before GMRES starts again, and how often.
_PRODUCTS, _STARTS = 250, 4
# Smallest size, relative to the right side.
_ROUNDING = 1e-6


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
    receptance : (L, m, m) complex array
        [m/N]
    factors
        Of the equations with constant mesh stiffness.
    """

    problem: LineProblem
    lines: np.ndarray
    table: Coupling
    receptance: np.ndarray
    factors: object

    def left_side(self, x) -> np.ndarray:
        """``x + F (rest * x)`` (L, m)."""
        return x + np.matmul(self.receptance, self.table.forces(x)[:, :, None])[:, :, 0]

    def solve(self, right, start, accuracy: float, *, size: float | None = None):
        """Two-sided lines (L, m) of the simple motions, and their residual over the size.

        Mirror images are conjugate, so that the equations are linear over real numbers only. Motions are
        taken in units of energy (``problem.scale``), and the preconditioner stands on the right: GMRES sees
        the residual of the equations themselves.

        Parameters
        ----------
        right, start : (L, m) complex arrays
        accuracy : float
            Of the residual.
        size : float, optional
            In units of energy [N^0.5 m^0.5]; that of the right side when not given.
        """
        from scipy.sparse.linalg import LinearOperator, gmres

        scale, shape = self.problem.scale, right.shape

        def vector_of(x):
            return np.ascontiguousarray(x * scale).reshape(-1).view(float)

        def prepared(vector):
            return self.factors.solve((vector.view(complex).reshape(shape) / scale).ravel()).reshape(shape)

        whole = max(float(np.linalg.norm(vector_of(right))), np.finfo(float).tiny)
        size = whole if size is None else max(size, _ROUNDING * whole)
        error = vector_of(right - self.left_side(start))
        operator = LinearOperator(
            (len(error),) * 2, matvec=lambda v: vector_of(self.left_side(prepared(v))), dtype=float
        )
        found, _ = gmres(operator, error, rtol=0.0, atol=accuracy * size, restart=_PRODUCTS, maxiter=_STARTS)
        x = start + prepared(found)
        return x, float(np.linalg.norm(vector_of(right - self.left_side(x)))) / size


def line_equations(problem: LineProblem, lines) -> LineEquations:
    """Tables and factors for the codes of lines (L,)."""
    receptance = problem.receptance(lines)
    factors = _without_time(problem, lines, receptance)
    return LineEquations(problem, lines, coupling(problem, lines, lines), receptance, factors)


def _without_time(problem: LineProblem, lines, receptance):
    """Factors of the equations with constant mesh stiffness: lines meet only by the turn of a carrier."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    m, size = receptance.shape[1], receptance.shape[0] * receptance.shape[1]
    one = np.arange(m)
    entries = [(np.arange(size), np.arange(size), np.ones(size, complex))]
    for shift, stiffness in _turning_stiffness(problem).items():
        column = places(lines, lines - shift)
        row = np.flatnonzero(column >= 0)
        block = receptance[row] @ stiffness
        at = np.broadcast_arrays(
            row[:, None, None] * m + one[:, None], column[row][:, None, None] * m + one, block
        )
        used = block != 0.0
        entries.append(tuple(part[used] for part in at))
    row, column, value = (np.concatenate(part) for part in zip(*entries))
    return splu(sparse.coo_array((value, (row, column)), shape=(size, size)).tocsc())


def _turning_stiffness(problem: LineProblem) -> dict[int, np.ndarray]:
    """{code of the shift: (m, m)} lines of ``S k S^T`` with the mean of k, without the mean itself."""
    total: dict[int, np.ndarray] = {}
    for one in problem.families:
        for a, u in one.directions.items():
            for b, v in one.directions.items():
                shift = (a + b) * one.turn
                if shift:
                    total[shift] = total.get(shift, 0.0) + (u * one.stiffness) @ v.T
    return total
