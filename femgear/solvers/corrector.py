"""Newton's method on a curve ``F(u, parameter) = 0``: bordered systems, tangents, their orientation.

Allgower and Georg, Introduction to Numerical Continuation Methods (SIAM 2003), chapters 2, 3 and 6.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import FemgearError


class LostError(Exception):
    """A correction that did not succeed; the reason is its text."""


class RoundingError(LostError):
    """A correction that came near a solution, but whose last steps are rounding: it is nearly singular."""


# Residuals over the sizes of the rows, relative to 1 + |z|, that are rounding.
_ROUNDING = 1e-13


def told_value(parameter: float) -> str:
    """A parameter without a name or a unit of its own, in words."""
    return f"parameter = {parameter:.9g}"


@dataclass(frozen=True)
class ScaledCurve:
    """``F(u, parameter)`` in the unknowns ``z = (u / scale, parameter / unit)``.

    Parameters
    ----------
    evaluate : callable
        ``(u (n,), parameter) -> residual (n,), jacobian (n, n), slope (n,)``.
    scale : (n,) array
        Typical sizes of ``u``.
    unit : float
        Typical size of a change of the parameter.
    tolerance : float
        Length of the last Newton step, relative to ``1 + |z|``.
    max_iterations : int
    rows : (n,) array or float
        Typical sizes of the rows of the scaled derivative, constant so that no singularity is divided away.
    told : callable
        Parameter -> text, for messages.
    """

    evaluate: Callable
    scale: np.ndarray
    unit: float
    tolerance: float
    max_iterations: int
    rows: np.ndarray | float = 1.0
    told: Callable[[float], str] = told_value

    def scaled(self, u, parameter: float) -> np.ndarray:
        """``z`` (n + 1,)."""
        return np.append(np.asarray(u, float) / self.scale, parameter / self.unit)

    def physical(self, z: np.ndarray) -> tuple[np.ndarray, float]:
        """``u`` and the parameter."""
        return z[:-1] * self.scale, float(z[-1] * self.unit)

    def equations(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual (n,) and derivative (n, n + 1) with respect to z, both over ``rows``."""
        try:
            residual, jacobian, slope = self.evaluate(*self.physical(z))
        except (FemgearError, np.linalg.LinAlgError) as error:
            raise LostError(f"the equations cannot be evaluated ({str(error).splitlines()[0]})") from error
        matrix = np.column_stack([jacobian * self.scale, np.asarray(slope) * self.unit])
        if not (np.all(np.isfinite(residual)) and np.all(np.isfinite(matrix))):
            raise LostError("the equations give numbers that are not finite")
        return residual / self.rows, (matrix.T / self.rows).T


@dataclass(frozen=True)
class CurvePoint:
    """A corrected point of a curve.

    Parameters
    ----------
    z, tangent : (n + 1,) arrays
        Scaled point and unit tangent.
    derivative : (n, n + 1) array
        Scaled derivative of the equations.
    orientation : float
        Sign of the determinant of the derivative bordered by the tangent.
    iterations : int
    contraction : float
        Second Newton step, with the derivative of the first one, over the first; zero when one was enough.
    error : float
        Length of the last Newton step, relative to ``1 + |z|``.
    kind : str
        ``"regular"``, ``"fold"``, ``"branch point"`` or ``"end"``.
    """

    z: np.ndarray
    tangent: np.ndarray
    derivative: np.ndarray
    orientation: float
    iterations: int
    contraction: float
    error: float
    kind: str = "regular"

    @property
    def bordered(self) -> np.ndarray:
        """Derivative with the tangent as last row, (n + 1, n + 1)."""
        return np.vstack([self.derivative, self.tangent])


def factored(matrix: np.ndarray):
    """LU factors of a bordered matrix and the sign of its determinant."""
    from scipy import linalg

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", linalg.LinAlgWarning)
        factors = linalg.lu_factor(matrix, check_finite=False)
    diagonal = np.diag(factors[0])
    if not np.all(diagonal):
        raise LostError("the bordered matrix is singular")
    swaps = np.count_nonzero(factors[1] != np.arange(len(diagonal)))
    return factors, float(np.prod(np.sign(diagonal)) * (-1) ** swaps)


def correct(curve: ScaledCurve, guess: np.ndarray, normal: np.ndarray, along=None) -> CurvePoint:
    """Point of the curve in the plane ``normal . (z - guess) = 0``, by Newton's method.

    Parameters
    ----------
    curve : ScaledCurve
    guess, normal : (n + 1,) arrays
    along : (n + 1,) array, optional
        The tangent is given the sense of this vector; of ``normal`` when not given.

    Raises
    ------
    LostError
        No convergence, or a bordered matrix that is singular.
    """
    from scipy import linalg

    z, lengths, contraction, factors = guess.copy(), [], 0.0, None
    residuals = []
    unit = np.zeros(len(z))
    unit[-1] = 1.0
    for _ in range(curve.max_iterations):
        residual, derivative = curve.equations(z)
        right = np.append(residual, normal @ (z - guess))
        residuals.append(float(np.abs(residual).max() / (1.0 + np.linalg.norm(z))))
        if len(lengths) == 1:
            # what the next step would be with the first derivative
            again = linalg.lu_solve(factors, right, check_finite=False)
            contraction = np.linalg.norm(again) / (1.0 + np.linalg.norm(z)) / lengths[0]
        factors, sign = factored(np.vstack([derivative, normal]))
        step = linalg.lu_solve(factors, right, check_finite=False)
        z = z - step
        lengths.append(float(np.linalg.norm(step) / (1.0 + np.linalg.norm(z))))
        if not np.isfinite(lengths[-1]):
            raise LostError("Newton's method left the finite numbers")
        if lengths[-1] <= curve.tolerance:
            break
        if len(lengths) > 3 and lengths[-1] > 2.0 * max(lengths[-2], lengths[-3]):
            raise _failed(residuals)(f"Newton's method diverges (steps {lengths[-2]:.1e}, {lengths[-1]:.1e})")
    else:
        count, last = curve.max_iterations, lengths[-1]
        raise _failed(residuals)(f"no convergence in {count} iterations (last step {last:.1e})")
    tangent = linalg.lu_solve(factors, unit, check_finite=False)
    tangent /= np.linalg.norm(tangent)
    if along is not None and tangent @ along < 0.0:
        # normal . tangent is positive as solved, so only a turned tangent changes the sign of the determinant
        tangent, sign = -tangent, -sign
    if lengths[0] <= 1e2 * curve.tolerance:
        contraction = 0.0  # rounding
    return CurvePoint(z, tangent, derivative, sign, len(lengths), float(contraction), lengths[-1])


def _failed(residuals: list[float]) -> type[LostError]:
    """Kind of a failure: the last steps began where the equations hold to rounding, or not."""
    return RoundingError if max(residuals[-2:]) <= _ROUNDING else LostError
