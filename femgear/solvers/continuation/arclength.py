"""Pseudo-arc-length continuation of a curve ``F(u, parameter) = 0`` past limit points and branch points.

Tangent predictor, Newton corrector normal to the tangent, acceptance and step control by contraction, angle
and chord, ends of the range, closed loops: Allgower and Georg, Introduction to Numerical Continuation Methods
(SIAM 2003), chapter 6; Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), chapter 4.
The curve keeps the orientation of its bordered determinant, so it cannot turn back by itself, and a jump to
another curve is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.continuation.corrector import (
    CurvePoint,
    LostError,
    ScaledCurve,
    Segment,
    StepOptions,
    bracketed_root,
    branch_point,
    check_step,
    correct,
    describe_value,
    folds,
    step_effort,
)

# A loop is closed when it meets its start within this (scaled) distance.
_CLOSED = 1e-6
# Steps below this part of the largest one may turn in a corner of the curve; of a larger one than that of
# a tenth of the scales they are no shorter than gaps between curves.
_CORNER, _CORNER_LARGEST = 1e-3, 0.1
# Steps below this part of those turn in a sharp corner: no smooth curve that the step control follows does.
_SHARP = 0.02
# Largest step over its option, a unit of the scaled unknowns, where they are large.
_RELATIVE = 0.1


@dataclass(frozen=True)
class Curve:
    """A curve of solutions.

    Parameters
    ----------
    points : (p, n) array
        Unknowns, in order along the curve, in their own units as the parameter.
    parameter : (p,) array
        In its own unit.
    folds, branch_points : (f,) and (b,) int arrays
        Indices of the points that are limit points and branch points.
    closed : bool
        The last point is the first one again.
    complete : bool
        The curve reached an end of the range or closed.
    lost : bool
        No smaller step found a further point.
    message : str
        How it ended.
    tangent : (p, n + 1) array
        Unit tangents of ``(u / scale, parameter / unit)``.
    iterations : (p,) int array
        Newton iterations of every point.
    error : (p,) array
        Last Newton step relative to ``1 + |z|``.
    scale : (n,) array
        Typical sizes of the unknowns, in their units.
    unit : float
        Typical size of a change of the parameter, in its unit.
    """

    points: np.ndarray
    parameter: np.ndarray
    folds: np.ndarray
    branch_points: np.ndarray
    closed: bool
    complete: bool
    lost: bool
    message: str
    tangent: np.ndarray
    iterations: np.ndarray
    error: np.ndarray
    scale: np.ndarray
    unit: float


def continue_curve(
    evaluate: Callable,
    start,
    parameter: float,
    *,
    limits: tuple[float, float],
    scale: float | np.ndarray = 1.0,
    unit: float | None = None,
    direction: int = 1,
    options: StepOptions | None = None,
    describe: Callable[[float], str] = describe_value,
) -> Curve:
    """Follow the curve through a solution until it leaves the range of the parameter or closes.

    CaseError: scales that are not positive (E-RANGE). ConvergenceError: no solution near the start.

    Parameters
    ----------
    evaluate : callable
        ``(u (n,), parameter) -> residual (n,), jacobian (n, n), slope (n,)``, slope = dF / dparameter.
    start : (n,) array
        Solution, or a guess of it, at ``parameter``.
    parameter : float
        Where to start, within the limits.
    limits : (low, high)
        Two different numbers; the curve ends exactly there.
    scale : float or (n,) array
        Typical size of ``u``.
    unit : float, optional
        Typical change of the parameter; by default the width of the range.
    direction : int
        +1 starts towards larger parameters, -1 towards smaller ones.
    describe : callable
        The parameter as text with its name and unit, for messages.
    """
    curve = _scaled_curve(
        evaluate, start, parameter, limits=limits, scale=scale, unit=unit, options=options, describe=describe
    )
    axis = np.zeros(len(curve.scale) + 1)
    axis[-1] = 1.0
    try:
        first = correct(curve, curve.scaled(start, parameter), axis, along=np.sign(direction) * axis)
    except LostError as error:
        raise ConvergenceError(
            f"no solution found near the start at {describe(parameter)}: {error}",
            code="E-START",
            remedy="give a better start, or start away from a limit point",
        ) from error
    return _collect(curve, first)


def _scaled_curve(
    evaluate: Callable,
    start,
    parameter: float,
    *,
    limits,
    scale: float | np.ndarray = 1.0,
    unit: float | None = None,
    options: StepOptions | None = None,
    describe: Callable[[float], str] = describe_value,
) -> ScaledCurve:
    """The equations over their scales and the sizes that the rows of their derivative have at the start.

    Arguments as for :func:`continue_curve`.
    """
    low, high = limits
    unit = high - low if unit is None else unit
    scale = np.broadcast_to(np.asarray(scale, float), np.shape(start)).copy()
    if not (np.all(np.isfinite(scale)) and np.all(scale > 0.0) and 0.0 < unit < np.inf):
        raise CaseError("the scales of a curve must be positive", code="E-RANGE", limit="> 0")
    curve = ScaledCurve(evaluate, scale, float(unit), (low, high), options or StepOptions(), describe)
    try:
        size = np.abs(curve.equations(curve.scaled(start, parameter))[1]).max(axis=1)
    except LostError as error:
        raise ConvergenceError(f"the start cannot be used: {error}", code="E-START") from error
    # in a branch point all of one equation may vanish
    return replace(curve, rows=np.where(size > 0.0, size, size.max() or 1.0))


def _collect(curve: ScaledCurve, first: CurvePoint) -> Curve:
    """The whole curve from a corrected point along its tangent."""
    points, end = _walk(curve, first)
    z = np.array([p.z for p in points])
    parameter = z[:, -1] * curve.unit
    if points[-1].kind == "end":
        parameter[-1] = min(curve.limits, key=lambda limit: abs(limit - parameter[-1]))
    kinds = np.array([p.kind for p in points])
    return Curve(
        points=z[:, :-1] * curve.scale,
        parameter=parameter,
        folds=np.flatnonzero(kinds == "fold"),
        branch_points=np.flatnonzero(kinds == "branch point"),
        closed=end.closed,
        complete=end.complete,
        lost=end.lost,
        message=end.message,
        tangent=np.array([p.tangent for p in points]),
        iterations=np.array([p.iterations for p in points]),
        error=np.array([p.error for p in points]),
        scale=curve.scale,
        unit=curve.unit,
    )


@dataclass(frozen=True)
class _End:
    """How a curve ended: ``message``, ``closed``, ``complete`` and ``lost`` as in `Curve`."""

    message: str
    closed: bool = False
    complete: bool = False
    lost: bool = False


def _walk(curve: ScaledCurve, first: CurvePoint) -> tuple[list[CurvePoint], _End]:
    """Points, limit points and branch points among them, and how the curve ended."""
    points, point, options = [first], first, curve.options
    h = options.first
    while len(points) < options.max_points:
        try:
            h = max(min(h, _longest(point, options)), options.smallest)
            segment, special, h = _step(curve, point, h)
        except LostError as lost:
            return points, _End(f"lost after {_where(curve, point)}: {lost}", lost=True)
        events = [*special, (segment.length, segment.last)]
        events, closed = _closing(segment, first, events, len(points))
        for _, end in _until_end(segment, events):
            points.append(end)
            if end.kind == "end":
                return points, _End(f"end of the range at {_where(curve, end)}", complete=True)
        if closed:
            return points, _End("closed loop", closed=True, complete=True)
        point = segment.last
    stopped = f"stopped at {_where(curve, point)} after {len(points)} points"
    return points, _End(f"{stopped}: raise max_points, largest or the scale")


def _longest(point: CurvePoint, options: StepOptions) -> float:
    """Largest step from a point: relative to its unknowns where they have outgrown their scale."""
    return options.largest * max(1.0, _RELATIVE * float(np.linalg.norm(point.z[:-1])))


def _where(curve: ScaledCurve, point: CurvePoint) -> str:
    """The parameter of a point in words."""
    return curve.describe(float(point.z[-1] * curve.unit))


def _step(curve: ScaledCurve, point: CurvePoint, h: float):
    """The next accepted point: segment, special points on it, length of the next step."""
    reason, options = "", curve.options
    while h >= options.smallest:
        try:
            new = _landing(curve, point, h)
            if new is None:
                new = correct(curve, point.z + h * point.tangent, point.tangent)
            shortness = h / (_CORNER * min(options.largest, _CORNER_LARGEST))
            corner = shortness <= 1.0
            effort = step_effort(options, point, new, corner=corner, sharp=shortness <= _SHARP)
            if not corner:
                check_step(curve, point, new)
            segment = Segment(curve, point, new)
            special = folds(segment)
            if point.orientation * new.orientation < 0.0:
                special.append(branch_point(segment))
            factor = np.clip(1.0 / max(effort, 1e-3), 0.5, 2.0)
            return segment, sorted(special, key=lambda s: s[0]), h * factor
        except LostError as lost:
            reason = str(lost)
            h *= 0.5
    raise LostError(f"{reason} (step reduced to {h:.1e})")


def _landing(curve: ScaledCurve, point: CurvePoint, h: float) -> CurvePoint | None:
    """Point at the end of the range where the predictor reaches it, so that nothing is evaluated beyond."""
    rate = point.tangent[-1]
    bound = curve.bounds[1 if rate > 0.0 else 0]
    way = (bound - point.z[-1]) / rate if rate else 0.0
    if not 0.0 < way <= h:
        return None
    try:
        new = _at_parameter(curve, point.z + way * point.tangent, bound, point.tangent)
    except LostError:
        return None  # a limit point lies before the end
    return new if point.tangent @ (new.z - point.z) <= 2.0 * way else None


def _at_parameter(curve: ScaledCurve, guess: np.ndarray, bound: float, along: np.ndarray) -> CurvePoint:
    """Point of the curve at the scaled parameter ``bound``, exactly."""
    axis = np.zeros(len(guess))
    axis[-1] = 1.0
    corrected = correct(curve, np.append(guess[:-1], bound), axis, along=along)
    return replace(corrected, z=np.append(corrected.z[:-1], bound))


def _until_end(segment: Segment, events):
    """Events up to the end of the range, which replaces the first one beyond it."""
    low, bounds = (0.0, segment.first), segment.curve.bounds
    for event in events:
        value = event[1].z[-1]
        beyond = bounds[0] if value < bounds[0] else bounds[1] if value > bounds[1] else None
        if beyond is not None:
            yield _at_bound(segment, low, event, beyond)
            return
        outward = event[1].tangent[-1] * (value - bounds.mean()) > 0.0
        if value in bounds and event[1] is segment.last and outward:
            yield event[0], replace(event[1], kind="end")
            return
        yield event
        low = event


def _at_bound(segment: Segment, low, high, bound: float):
    """Point exactly at the bound, between two points with a monotonous parameter between them."""
    if low[1].z[-1] == bound:
        # the curve starts at the bound and leaves at once
        return low[0] + np.finfo(float).tiny, replace(low[1], kind="end")
    ends, distance_at = dict((low, high)), {h: point.z[-1] - bound for h, point in (low, high)}
    h = bracketed_root(lambda h: segment.at(h).z[-1] - bound, distance_at, xtol=1e-13 * segment.length)
    near = ends[h] if h in ends else segment.at(h)
    try:
        exact = _at_parameter(segment.curve, near.z, bound, near.tangent)
        if np.linalg.norm(exact.z - near.z) < 1e-6 * segment.length:
            near = exact
    except LostError:
        pass  # the bound is a limit point: the root above stands
    return h, replace(near, z=np.append(near.z[:-1], bound), kind="end")


def _closing(segment: Segment, first: CurvePoint, events, count: int):
    """Events up to the start of the curve, when the segment meets it again in the same sense."""
    offset = first.z - segment.first.z
    h = float(segment.first.tangent @ offset)
    if count < 3 or not 0.0 < h <= segment.length or segment.first.tangent @ first.tangent < 0.5:
        return events, False
    if np.linalg.norm(offset) > 2.0 * segment.length:
        return events, False
    try:
        point_there = segment.at(h)
    except LostError:
        return events, False
    if np.linalg.norm(point_there.z - first.z) > _CLOSED or point_there.tangent @ first.tangent < 0.9:
        return events, False
    return [e for e in events if e[0] < h - 1e-9] + [(h, replace(first, kind="regular"))], True
