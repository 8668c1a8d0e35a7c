"""Whether a step along a curve stayed on it: angle, contraction of Newton's method, way back, middle.

Allgower and Georg, Introduction to Numerical Continuation Methods (SIAM 2003), chapter 6; Deuflhard, Newton
Methods for Nonlinear Problems (Springer 2004), sections 2.1 and 5.1, for the contraction.
"""

from __future__ import annotations

import numpy as np

from femgear.solvers.corrector import CurvePoint, LostError, ScaledCurve, factored

# Deviation of a chord from the mean of its tangents [rad], beyond a share of the angle between them.
_CHORD, _CHORD_SHARE, _CORNER_SHARE = 0.003, 0.15, 0.6
# Sharpest corner [rad] and distance of the chord from the plane of its sides, over its length.
_SHARPEST, _ASIDE = 1.2, 0.05
# Distance from the old point, over that of the prediction from it, after one Newton step on the way back.
_RETURN = 0.1
# Middle of a step: distance from the cubic between the ends over the length, and error of Simpson's rule.
_OFFSET, _TURN = 0.03, 0.1


def strain(
    point: CurvePoint,
    new: CurvePoint,
    *,
    angle: float,
    contraction: float,
    corner: bool = False,
    sharp: bool = False,
) -> float:
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
    sharp : bool
        It is so short that any turn is one of a corner, between whose sides the chord lies.

    Raises
    ------
    LostError
        The angle is twice what is aimed at, or the chord leaves the tangents.
    """
    turn = np.arccos(float(np.clip(point.tangent @ new.tangent, -1.0, 1.0)))
    if sharp and 2.0 * angle < turn <= _SHARPEST:
        _check_sides(point, new)
        return float(np.sqrt(new.contraction / contraction))
    if turn > 2.0 * angle:
        raise LostError(f"the tangent turns by {turn:.2g} rad")
    chord = new.z - point.z
    mean = point.tangent + new.tangent
    mean /= np.linalg.norm(mean)
    along = chord @ mean
    aside = np.arctan2(np.linalg.norm(chord - along * mean), along)
    if aside > _CHORD + (_CORNER_SHARE if corner else _CHORD_SHARE) * turn:
        raise LostError(f"the chord leaves the tangents by {aside:.2g} rad: another curve was reached")
    return max(turn / angle, np.sqrt(new.contraction / contraction))


def _check_sides(point: CurvePoint, new: CurvePoint) -> None:
    """A step over a corner between two straight sides goes forward along each of them."""
    chord = new.z - point.z
    sides = np.column_stack([point.tangent, new.tangent])
    ways = np.linalg.lstsq(sides, chord, rcond=None)[0]
    length = float(np.linalg.norm(chord))
    aside = np.linalg.norm(chord - sides @ ways) / length
    if not (aside <= _ASIDE and ways.min() >= -_ASIDE * length):
        raise LostError(f"a corner that the step does not go around ({aside:.2g} aside): another curve")


def check_step(curve: ScaledCurve, point: CurvePoint, new: CurvePoint) -> None:
    """Look at a step from its other end and at its middle, one evaluation each.

    Raises
    ------
    LostError
        The step left the curve, or passed over a piece of it.
    """
    if np.linalg.norm(new.z - point.z) <= 1e2 * curve.tolerance * (1.0 + np.linalg.norm(new.z)):
        return
    _check_return(curve, point, new)
    _check_middle(curve, point, new)


def _check_return(curve: ScaledCurve, point: CurvePoint, new: CurvePoint) -> None:
    """Predict the old point from the new one: Newton's method must lead back to it.

    Where a step jumped to a neighbouring curve, the way back misses the curve that it came from. The old
    point is known, so one Newton step tells how the method contracts towards it.
    """
    way = float(new.tangent @ (point.z - new.z))
    guess = new.z + way * new.tangent
    miss = np.linalg.norm(guess - point.z)
    if miss <= 1e2 * curve.tolerance * (1.0 + np.linalg.norm(point.z)):
        return
    step, _, _ = _newton_step(curve, guess, new.tangent)
    left = np.linalg.norm(guess - step - point.z) / miss
    if not left <= _RETURN:
        raise LostError(f"the way back misses the point before by {left:.2g} of the prediction")


def _check_middle(curve: ScaledCurve, point: CurvePoint, new: CurvePoint) -> None:
    """The curve passes near the middle of the cubic between both ends, with the tangent that it has there.

    Simpson's rule gives the chord from the tangents at both ends and in the middle. A curve that makes a
    detour between two points, such as a resonance narrower than the step, is not near; two branch points in
    one step show by the orientation between them.
    """
    chord = new.z - point.z
    length = float(np.linalg.norm(chord))
    along = chord / length
    start, end = (p.tangent / (p.tangent @ along) for p in (point, new))
    guess = 0.5 * (point.z + new.z) + 0.125 * length * (start - end)
    step, tangent, sign = _newton_step(curve, guess, along)
    offset = np.linalg.norm(step) / length
    turn = np.linalg.norm(along - (start + 4.0 * tangent + end) / 6.0)
    if not (offset <= _OFFSET and turn <= _TURN):
        raise LostError(f"midway the curve is {offset:.2g} of the step away and turned by {turn:.2g}")
    if sign * point.orientation < 0.0 and sign * new.orientation < 0.0:
        raise LostError("the orientation changes twice")


def _newton_step(curve: ScaledCurve, z: np.ndarray, normal: np.ndarray):
    """Newton step to subtract in the plane normal to a vector, tangent over that vector, sign."""
    from scipy import linalg

    residual, derivative = curve.equations(z)
    factors, sign = factored(np.vstack([derivative, normal]))
    right = np.zeros((len(z), 2))
    right[:-1, 0], right[-1, 1] = residual, 1.0
    step, tangent = linalg.lu_solve(factors, right, check_finite=False).T
    return step, tangent, sign
