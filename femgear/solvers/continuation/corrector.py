"""Points of a curve ``F(u, parameter) = 0``: Newton's method, checks of a step, limit and branch points.

Bordered systems, tangents and their orientation: Allgower and Georg, Introduction to Numerical Continuation
Methods (SIAM 2003), chapters 2, 3 and 6. A step is judged by its angle, the contraction of Newton's method,
the way back and the middle (chapter 6; Deuflhard, Newton Methods for Nonlinear Problems (Springer 2004),
sections 2.1 and 5.1, for the contraction). Limit points and branch points between two points: Allgower and
Georg, chapters 8 and 9; R. Seydel, Practical Bifurcation and Stability Analysis (2010), chapters 5 and 6.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import linalg

from femgear.errors import CaseError, FemgearError

# Residuals over the sizes of the rows, relative to 1 + |z|, that are rounding.
_ROUNDING = 1e-13
# Deviation of a chord from the mean of its tangents [rad], beyond a share of the angle between them.
_CHORD, _CHORD_SHARE, _CORNER_SHARE = 0.003, 0.15, 0.6
# Sharpest corner [rad] and distance of the chord from the plane of its sides, over its length.
_SHARPEST, _ASIDE = 1.2, 0.05
# Distance from the old point, over that of the prediction from it, after one Newton step on the way back.
_RETURN = 0.1
# Middle of a step: distance from the cubic between the ends over the length, and error of Simpson's rule.
_OFFSET, _TURN = 0.03, 0.1
# A located point this near to the start of a segment, in parts of the segment, is that start.
_START = 1e-9
# Half width, in parts of the segment, of the window in which a branch point must lie on one smooth curve.
_WINDOW = 1e-3
# The same for the two points whose mean is the branch point.
_BESIDE = 1e-5


class LostError(Exception):
    """A correction that did not succeed; the reason is its text."""


class _RoundingError(LostError):
    """A correction that came near a solution, but whose last steps are rounding: it is nearly singular."""


def describe_value(parameter: float) -> str:
    """Write a parameter without a name or a unit of its own in words."""
    return f"parameter = {parameter:.9g}"


@dataclass(frozen=True)
class StepOptions:
    """How a curve is followed; lengths are in the scaled unknowns ``(u / scale, parameter / unit)``.

    Parameters
    ----------
    first, smallest, largest : float
        Step lengths; where the scaled unknowns exceed ten, the largest is that many tenths longer.
    angle : float
        Angle between successive tangents that is aimed at [rad], up to 0.5; twice as much is refused.
    contraction : float
        Ratio of the second to the first Newton step, both with the first derivative, aimed at
        (Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 5.1), up to 0.25; it sets the next
        step.
    tolerance : float
        Last Newton step relative to ``1 + |z|``.
    max_iterations : int
        Newton iterations of one correction.
    max_points : int
        The curve ends, incomplete, after so many points.
    """

    first: float = 0.01
    smallest: float = 1e-8
    largest: float = 0.1
    angle: float = 0.15
    contraction: float = 0.0625
    tolerance: float = 1e-10
    max_iterations: int = 10
    max_points: int = 5000

    def __post_init__(self):
        if not 0.0 < self.smallest <= self.first or not self.smallest <= self.largest < np.inf:
            raise CaseError(
                f"steps from {self.smallest} over {self.first} to {self.largest}",
                code="E-RANGE",
                limit="0 < smallest <= first, smallest <= largest",
            )
        if min(self.angle, self.contraction, self.tolerance, self.max_iterations - 1, self.max_points) <= 0:
            raise CaseError("a step option is not positive", code="E-RANGE", limit="> 0; two iterations or more")
        # the chord is compared with the mean of two tangents, and Newton's method must contract
        for name, bound in (("angle", 0.5), ("contraction", 0.25)):
            value = getattr(self, name)
            if not value <= bound:
                raise CaseError(
                    f"the step option {name} is {value}",
                    code="E-RANGE",
                    key=name,
                    value=value,
                    limit=f"up to {bound}: beyond, a jump to another curve may look like a step",
                    remedy="lengthen the steps by largest instead",
                )


@dataclass(frozen=True)
class ScaledCurve:
    """``F(u, parameter)`` in the unknowns ``z = (u / scale, parameter / unit)``.

    ``evaluate(u (n,), parameter)`` gives residual (n,), jacobian (n, n) and slope (n,); ``scale`` (n,) and
    ``unit`` are typical sizes of u and of a change of the parameter, ``rows`` those of the rows of the scaled
    derivative, constant so that no singularity is divided away. ``limits`` are the ends of the range of the
    parameter, ``options`` says how the curve is followed, ``describe(parameter)`` is text for messages.
    """

    evaluate: Callable
    scale: np.ndarray
    unit: float
    limits: tuple[float, float]
    options: StepOptions
    describe: Callable[[float], str] = describe_value
    rows: np.ndarray | float = 1.0

    @property
    def bounds(self) -> np.ndarray:
        """Ends of the range of the scaled parameter (2,)."""
        return np.asarray(self.limits, float) / self.unit

    def scaled(self, u, parameter: float) -> np.ndarray:
        """Scale ``u`` (n,) and the parameter to ``z`` (n + 1,)."""
        return np.append(np.asarray(u, float) / self.scale, parameter / self.unit)

    def physical(self, z: np.ndarray) -> tuple[np.ndarray, float]:
        """Return ``u`` (n,) and the parameter of ``z`` (n + 1,)."""
        return z[:-1] * self.scale, float(z[-1] * self.unit)

    def equations(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute residual (n,) and derivative (n, n + 1) by z (n + 1,), both over ``rows``."""
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
        Newton iterations that the correction took.
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


def correct(curve: ScaledCurve, guess: np.ndarray, normal: np.ndarray, along=None) -> CurvePoint:
    """Find the point of the curve in the plane ``normal . (z - guess) = 0`` by Newton's method.

    LostError: no convergence, or a bordered matrix that is singular.

    Parameters
    ----------
    guess, normal : (n + 1,) arrays
        In the scaled unknowns.
    along : (n + 1,) array, optional
        Sense of the tangent, that of ``normal`` when there is none.
    """
    z, lengths, contraction, factors = guess.copy(), [], 0.0, None
    residuals = []
    unit = np.zeros(len(z))
    unit[-1] = 1.0
    for _ in range(curve.options.max_iterations):
        residual, derivative = curve.equations(z)
        right = np.append(residual, normal @ (z - guess))
        residuals.append(float(np.abs(residual).max() / (1.0 + np.linalg.norm(z))))
        if len(lengths) == 1:
            # what the next step would be with the first derivative
            again = linalg.lu_solve(factors, right, check_finite=False)
            contraction = np.linalg.norm(again) / (1.0 + np.linalg.norm(z)) / lengths[0]
        factors, sign = _factored(np.vstack([derivative, normal]))
        step = linalg.lu_solve(factors, right, check_finite=False)
        z = z - step
        lengths.append(float(np.linalg.norm(step) / (1.0 + np.linalg.norm(z))))
        if not np.isfinite(lengths[-1]):
            raise LostError("Newton's method left the finite numbers")
        if lengths[-1] <= curve.options.tolerance:
            break
        if len(lengths) > 3 and lengths[-1] > 2.0 * max(lengths[-2], lengths[-3]):
            raise _failed(residuals)(f"Newton's method diverges (steps {lengths[-2]:.1e}, {lengths[-1]:.1e})")
    else:
        count, last = curve.options.max_iterations, lengths[-1]
        raise _failed(residuals)(f"no convergence in {count} iterations (last step {last:.1e})")
    tangent = linalg.lu_solve(factors, unit, check_finite=False)
    tangent /= np.linalg.norm(tangent)
    if along is not None and tangent @ along < 0.0:
        # normal . tangent is positive as solved, so only a turned tangent changes the sign of the determinant
        tangent, sign = -tangent, -sign
    if lengths[0] <= 1e2 * curve.options.tolerance:
        contraction = 0.0  # rounding
    return CurvePoint(z, tangent, derivative, sign, len(lengths), float(contraction), lengths[-1])


def _factored(matrix: np.ndarray):
    """LU factors of a bordered matrix and the sign of its determinant."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", linalg.LinAlgWarning)
        factors = linalg.lu_factor(matrix, check_finite=False)
    diagonal = np.diag(factors[0])
    if not np.all(diagonal):
        raise LostError("the bordered matrix is singular")
    swaps = np.count_nonzero(factors[1] != np.arange(len(diagonal)))
    return factors, float(np.prod(np.sign(diagonal)) * (-1) ** swaps)


def step_effort(options: StepOptions, point: CurvePoint, new: CurvePoint, *, corner: bool, sharp: bool) -> float:
    """Compare a step between two points with the angle [rad] and contraction aimed at: 1 on target.

    On one smooth curve a chord makes the same angle with the tangents at both ends (exactly so on a circle);
    a jump from curve to curve turns the chord but not the tangents. A ``corner`` says that the step is so
    short that the curve may turn in one, ``sharp`` that any turn is one of a sharp corner, between whose
    sides the chord lies. Above one the next step has to be shorter.

    LostError: the angle is twice what is aimed at, or the chord leaves the tangents.
    """
    angle, contraction = options.angle, options.contraction
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


def check_step(curve: ScaledCurve, point: CurvePoint, new: CurvePoint) -> None:
    """Check a step from its other end and at its middle, one evaluation each.

    LostError: the step left the curve, or passed over a piece of it.
    """
    if np.linalg.norm(new.z - point.z) <= 1e2 * curve.options.tolerance * (1.0 + np.linalg.norm(new.z)):
        return
    _check_return(curve, point, new)
    _check_middle(curve, point, new)


def _failed(residuals: list[float]) -> type[LostError]:
    """Kind of a failure: the last steps began where the equations hold to rounding, or not."""
    return _RoundingError if max(residuals[-2:]) <= _ROUNDING else LostError


def _check_sides(point: CurvePoint, new: CurvePoint) -> None:
    """A step over a corner between two straight sides goes forward along each of them."""
    chord = new.z - point.z
    sides = np.column_stack([point.tangent, new.tangent])
    ways = np.linalg.lstsq(sides, chord, rcond=None)[0]
    length = float(np.linalg.norm(chord))
    aside = np.linalg.norm(chord - sides @ ways) / length
    if not (aside <= _ASIDE and ways.min() >= -_ASIDE * length):
        raise LostError(f"a corner that the step does not go around ({aside:.2g} aside): another curve")


def _check_return(curve: ScaledCurve, point: CurvePoint, new: CurvePoint) -> None:
    """One Newton step from a prediction of the old point leads back to it, but from a neighbouring curve."""
    way = float(new.tangent @ (point.z - new.z))
    guess = new.z + way * new.tangent
    miss = np.linalg.norm(guess - point.z)
    if miss <= 1e2 * curve.options.tolerance * (1.0 + np.linalg.norm(point.z)):
        return
    step, _, _ = _newton_step(curve, guess, new.tangent)
    left = np.linalg.norm(guess - step - point.z) / miss
    if not left <= _RETURN:
        raise LostError(f"the way back misses the point before by {left:.2g} of the prediction")


def _check_middle(curve: ScaledCurve, point: CurvePoint, new: CurvePoint) -> None:
    """The curve passes near the middle of the cubic between both ends, with the tangent by Simpson's rule.

    A detour such as a resonance narrower than the step is not near; two branch points in one step show by the
    orientation between them.
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
    residual, derivative = curve.equations(z)
    factors, sign = _factored(np.vstack([derivative, normal]))
    right = np.zeros((len(z), 2))
    right[:-1, 0], right[-1, 1] = residual, 1.0
    step, tangent = linalg.lu_solve(factors, right, check_finite=False).T
    return step, tangent, sign


@dataclass(frozen=True)
class Segment:
    """The piece of a ``curve`` from its ``first`` to its ``last`` point, two neighbours.

    Its inner points lie in planes normal to the first tangent.
    """

    curve: ScaledCurve
    first: CurvePoint
    last: CurvePoint

    @property
    def length(self) -> float:
        """Distance of the two planes."""
        return float(self.first.tangent @ (self.last.z - self.first.z))

    def at(self, h: float) -> CurvePoint:
        """Find the point of the curve in the plane at the scaled distance h."""
        if h == 0.0:
            return self.first
        guess = self.first.z + h * self._hermite(h)
        return correct(self.curve, guess, self.first.tangent)

    def _hermite(self, h: float) -> np.ndarray:
        """Direction from the first point to the cubic between both points, at plane distance h."""
        length = self.length
        s, chord = h / length, (self.last.z - self.first.z) / length
        end = self.last.tangent / (self.last.tangent @ self.first.tangent)
        start = self.first.tangent
        return start + s * (3.0 * chord - 2.0 * start - end) + s * s * (start + end - 2.0 * chord)


def folds(segment: Segment) -> list[tuple[float, CurvePoint]]:
    """Locate the limit points of a segment: scaled plane distances and points, ascending.

    Roots of the last component of the tangent; two in one segment are found where the cubic between both ends
    shows an extreme slope between them.
    """
    ends = [(0.0, segment.first.tangent[-1]), (segment.length, segment.last.tangent[-1])]
    inner = _steepest(segment)
    if inner is not None:
        ends.insert(1, (inner, segment.at(inner).tangent[-1]))
    points = []
    for low, high in pairwise(ends):
        if low[1] * high[1] < 0.0 and abs(low[1]) > _START:
            h = bracketed_root(lambda h: segment.at(h).tangent[-1], dict((low, high)), xtol=1e-13 * high[0])
            points.append((h, replace(segment.at(h), kind="fold")))
    return [(h, point) for h, point in points if h > _START * segment.length]


def _steepest(segment: Segment) -> float | None:
    """Distance where the slope of the parameter's cubic is extreme, if its sign differs there."""
    length, first, last = segment.length, segment.first, segment.last
    rise = last.z[-1] - first.z[-1]
    d0 = first.tangent[-1] * length
    d1 = last.tangent[-1] / (last.tangent @ first.tangent) * length
    if d0 * d1 <= 0.0:
        return None
    square, linear = 3.0 * (d0 + d1 - 2.0 * rise), 2.0 * (3.0 * rise - 2.0 * d0 - d1)
    if square == 0.0 or not 0.0 < -linear / (2.0 * square) < 1.0:
        return None
    s = -linear / (2.0 * square)
    return s * length if (square * s * s + linear * s + d0) * d0 < 0.0 else None


def branch_point(segment: Segment) -> tuple[float, CurvePoint]:
    """Locate the branch point of a segment: its scaled plane distance and the point, see `CurvePoint`.

    For ends of different orientation. Root of ``tau = 1 / (c^T B^-1 b)`` with the singular vectors b, c of
    the bordered matrix B (Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, 2000, 3.3).

    LostError: the ends do not lie on one smooth curve.
    """
    length = segment.length
    left, _, right = np.linalg.svd(segment.first.bordered)
    b, c = left[:, -1], right[-1]

    def tau(h: float) -> float:
        try:
            value = c @ np.linalg.solve(_turned(segment, h).bordered, b)
        except np.linalg.LinAlgError:
            return 0.0
        return 1.0 / value

    low, high = tau(0.0), tau(length)
    if low * high >= 0.0:
        raise LostError("the orientation changes without a branch point: another curve was reached")
    h = _singular_place(tau, length, low, high)
    _check_smooth(segment, h)
    return h, _on_both(segment, h)


def _singular_place(tau, length: float, at_low: float, at_high: float) -> float:
    """Zero of tau between 0 and length; where rounding forbids corrections beside it, that of a line.

    Rounding grows with one over tau, so that points very near the zero cannot be corrected to tolerance.
    """
    value_at = {0.0: at_low, length: at_high}
    try:
        return bracketed_root(tau, value_at, xtol=1e-13 * length)
    except _RoundingError:
        low = max(h for h in value_at if value_at[h] * at_low > 0.0)
        high = min(h for h in value_at if value_at[h] * at_high > 0.0)
        if high < low:
            raise
        return low + (high - low) * value_at[low] / (value_at[low] - value_at[high])


def _turned(segment: Segment, h: float) -> CurvePoint:
    return segment.last if h == segment.length else segment.at(h)


def _check_smooth(segment: Segment, h: float) -> None:
    """A crossing has the same curve on both sides; a jump from curve to curve has a gap."""
    low, high, before, after = _beside(segment, h, _WINDOW)
    gap = np.linalg.norm(after.z - before.z) / (high - low)
    if before.orientation == after.orientation or gap > 3.0 or before.tangent @ after.tangent < 0.9:
        raise LostError("the points before and after a change of orientation lie on different curves")


def _beside(segment: Segment, h: float, part: float):
    """Places and points before and after the place h, a part of the segment away or as rounding allows."""
    while True:
        width = part * segment.length
        low, high = max(h - width, 0.0), min(h + width, segment.length)
        try:
            return low, high, segment.at(low), _turned(segment, high)
        except _RoundingError:
            part *= 4.0
            if part > 1.0:
                raise


def _on_both(segment: Segment, h: float) -> CurvePoint:
    """The branch point as the mean of two points beside it, where the equations are not singular."""
    low, high, before, after = _beside(segment, h, _BESIDE)
    share = (h - low) / (high - low)
    z = before.z + share * (after.z - before.z)
    tangent = before.tangent + share * (after.tangent - before.tangent)
    _, derivative = segment.curve.equations(z)
    error = max(before.error, after.error)
    return CurvePoint(z, tangent / np.linalg.norm(tangent), derivative, 0.0, 0, 0.0, error, "branch point")


def bracketed_root(function: Callable[[float], float], value_at: dict[float, float], *, xtol: float) -> float:
    """Find the zero of a function to ``xtol`` between two places of different sign (Brent).

    ``value_at`` has the values at both places and collects all others.
    """
    from scipy.optimize import root_scalar

    def value(h: float) -> float:
        if h not in value_at:
            value_at[h] = function(h)
        return value_at[h]

    return root_scalar(value, bracket=tuple(value_at), method="brentq", xtol=xtol, rtol=1e-14).root
