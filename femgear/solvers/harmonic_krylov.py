"""The derivative of the harmonic equations as an operator: many lines without a matrix of their size.

One product costs a transform forth and back and the receptance of every line. GMRES (Saad and Schultz,
SIAM J. Sci. Stat. Comput. 7 (1986) 856) needs few of them, because the operator is the unit matrix plus the
fixed point of the iteration with reference springs, whose eigenvalues are small or few.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.solvers.aft import forces_on_grid
from femgear.solvers.harmonic_equations import HarmonicBalance, LineForces

# Relative accuracy of a Newton step, and products after which the matrix is taken instead.
_ACCURACY, _PRODUCTS = 1e-3, 60
# No derivatives are kept with the forces.
_NONE = np.empty((0, 0, 0))


@dataclass(frozen=True)
class LineTangent:
    """``dR/dX`` of the harmonic equations at one deflection.

    Parameters
    ----------
    balance : HarmonicBalance
    receptance : (L, n_columns, n_columns + n_loads) complex array
    stiffness : (N, n_pairs) array
        Tangents of the coupled pairs less the reference springs, on the grid [N/m].
    """

    balance: HarmonicBalance
    receptance: np.ndarray
    stiffness: np.ndarray

    def fixed_point(self, y) -> np.ndarray:
        """``T d(F - reference X)`` for a change y (n_y,) of the unknowns."""
        balance = self.balance
        lines = balance.lines(y)
        n, pairs = len(lines), balance.pairs
        x = balance.grid.values(lines)
        force = np.zeros_like(x)
        for number, (row, column) in enumerate(pairs):
            force[:, row] += self.stiffness[:, number] * x[:, column]
        moved = balance.grid.amplitudes(balance.grid.transform(force))
        return balance.unknowns((self.receptance[:, :, :n] @ moved.T[..., None])[..., 0].T)

    def solve(self, error) -> np.ndarray | None:
        """``dR/dX^-1 error`` to three digits; None where GMRES does not get there."""
        from scipy.sparse.linalg import LinearOperator, gmres

        operator = LinearOperator((len(error),) * 2, matvec=lambda y: y + self.fixed_point(y), dtype=float)
        step, state = gmres(operator, error, rtol=_ACCURACY, restart=_PRODUCTS, maxiter=1)
        return None if state else step


def linearised(balance: HarmonicBalance, receptance, y) -> tuple[np.ndarray, LineTangent]:
    """Residual (n_y,) [m] of the harmonic equations at the unknowns y, and its derivative."""
    lines, reference = balance.lines(y), balance.reduction.reference
    x = balance.grid.values(lines)
    force, stiffness = forces_on_grid(balance.elements, balance.pairs, x, balance.grid.theta)
    own = balance.pairs[:, 0] == balance.pairs[:, 1]
    stiffness[:, own] -= reference[balance.pairs[own, 0]]
    forces = balance.grid.amplitudes(balance.grid.transform(force - reference * x))
    error = balance.unknowns(balance.residual(lines, LineForces(forces, _NONE), receptance))
    return error, LineTangent(balance, receptance, stiffness)


def krylov_radius(tangent: LineTangent) -> float | None:
    """Largest modulus of the eigenvalues of the fixed point, to 1 %; None where Arnoldi's method fails.

    Hundreds of lines far from any resonance have eigenvalues of nearly the same modulus: more digits would
    take ten times as many products.
    """
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

    size = tangent.balance.size
    operator = LinearOperator((size, size), matvec=tangent.fixed_point, dtype=float)
    # a fixed start: the same value every time
    start = np.random.default_rng(0).standard_normal(size)
    try:
        values = eigs(
            operator, k=1, ncv=30, v0=start, which="LM", tol=1e-2, maxiter=60, return_eigenvectors=False
        )
    except ArpackError:
        return None
    return float(np.abs(values).max())
