"""Whether a step along a curve stayed on it: angle of the tangents, contraction of Newton's method, way back.

Allgower and Georg, Introduction to Numerical Continuation Methods (SIAM 2003), chapter 6; Deuflhard, Newton
Methods for Nonlinear Problems (Springer 2004), sections 2.1 and 5.1, for the contraction.
"""

from __future__ import annotations

import numpy as np

from femgear.solvers.corrector import CurvePoint, LostError, ScaledCurve, factored

# Deviation of a chord from the mean of its tangents [rad], beyond a share of the angle between them.
_CHORD, _CHORD_SHARE, _CORNER_SHARE = 0.003, 0.15, 0.6
# Distance from the old point, over that of the prediction from it, after one Newton step on the way back.
_RETURN = 0.1


def strain(point: CurvePoint, new: CurvePoint, *, angle: float, contraction: float, corner: bool) -> float:
    """How far a step was from what is aimed at: 1 on target.

    On one smooth curve a chord makes the same angle with the tangents at both ends (exactly so on a circle);
    a jump from curve to curve turns the chord but not the tangents.

    Parameters
    ----------
    point, new : CurvePoint
    angle, contraction : float
        Aimed at; see `StepOptions`.
    corner : bool
        The step is so short that the curve may turn in a corner.

    Raises
    ------
    LostError
        The angle is twice, the contraction four times what is aimed at, or the chord leaves the tangents.
    """
    turn = np.arccos(float(np.clip(point.tangent @ new.tangent, -1.0, 1.0)))
    if turn > 2.0 * angle:
        raise LostError(f"the tangent turns by {turn:.2g} rad")
    if not corner and new.contraction > 4.0 * contraction:
        raise LostError(f"Newton's method contracts only by {new.contraction:.2g}")
    chord = new.z - point.z
    mean = point.tangent + new.tangent
    mean /= np.linalg.norm(mean)
    along = chord @ mean
    aside = np.arctan2(np.linalg.norm(chord - along * mean), along)
    if aside > _CHORD + (_CORNER_SHARE if corner else _CHORD_SHARE) * turn:
        raise LostError(f"the chord leaves the tangents by {aside:.2g} rad: another curve was reached")
    return max(turn / angle, np.sqrt(new.contraction / contraction))


def check_return(curve: ScaledCurve, point: CurvePoint, new: CurvePoint) -> None:
    """Predict the old point from the new one: Newton's method must lead back to it.

    Where a step jumped to a neighbouring curve, so would the way back, to the next one but one. The old point
    is known, so that one Newton step tells how the method contracts towards it.

    Raises
    ------
    LostError
        Newton's method leads elsewhere.
    """
    from scipy import linalg

    way = float(new.tangent @ (point.z - new.z))
    guess = new.z + way * new.tangent
    miss = np.linalg.norm(guess - point.z)
    if miss <= 1e2 * curve.tolerance * (1.0 + np.linalg.norm(point.z)):
        return
    residual, derivative = curve.equations(guess)
    factors, _ = factored(np.vstack([derivative, new.tangent]))
    step = linalg.lu_solve(factors, np.append(residual, 0.0), check_finite=False)
    left = np.linalg.norm(guess - step - point.z) / miss
    STAT.append(left)
    if not left <= _RETURN:
        raise LostError(f"the way back misses the point before by {left:.2g} of the prediction")
STAT=[]
