"""Pseudo-arc-length continuation of a curve ``F(u, parameter) = 0`` past limit points and branch points.

Tangent predictor, Newton corrector normal to the tangent, step control by contraction, angle and chord:
Allgower and Georg, Introduction to Numerical Continuation Methods (SIAM 2003), chapter 6; Krack and Gross,
Harmonic Balance for Nonlinear Vibration Problems (2019), chapter 4. The curve keeps the orientation of its
bordered determinant, so it cannot turn back by itself, and a jump to another curve is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.arclength import Ending, StepOptions, curve_points
from femgear.solvers.bifurcation import crossing_tangent
from femgear.solvers.corrector import CurvePoint, LostError, ScaledCurve, correct, told_value

__all__ = [
    "Curve",
    "Ending",
    "StepOptions",
    "collect",
    "continue_curve",
    "curve_points",
    "scaled_curve",
    "start_point",
    "switch_branch",
]


@dataclass(frozen=True)
class Curve:
    """A curve of solutions.

    Parameters
    ----------
    points : (p, n) array
        Unknowns, in order along the curve.
    parameter : (p,) array
    folds, branch_points : int arrays
        Indices of the points that are limit points and branch points.
    closed : bool
        The last point is the first one again.
    complete : bool
        The curve reached an end of the range or closed.
    message : str
        How it ended.
    tangent : (p, n + 1) array
        Unit tangents of ``(u / scale, parameter / unit)``.
    iterations : (p,) int array
        Newton iterations of every point.
    error : (p,) array
        Last Newton step relative to ``1 + |z|``.
    scale : (n,) array
    unit : float
    """

    points: np.ndarray
    parameter: np.ndarray
    folds: np.ndarray
    branch_points: np.ndarray
    closed: bool
    complete: bool
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
    scale=1.0,
    unit: float | None = None,
    direction: int = 1,
    options: StepOptions | None = None,
    told: Callable[[float], str] = told_value,
) -> Curve:
    """Follow the curve through a solution until it leaves the range of the parameter or closes.

    Parameters
    ----------
    evaluate : callable
        ``(u (n,), parameter) -> residual (n,), jacobian (n, n), slope (n,)``, slope = dF / dparameter.
    start : (n,) array
        Solution, or a guess of it, at ``parameter``.
    parameter : float
        Where to start, within the limits.
    limits : (low, high)
        The curve ends exactly there.
    scale : float or (n,) array
        Typical size of ``u``.
    unit : float, optional
        Typical change of the parameter; by default the width of the range.
    direction : int
        +1 starts towards larger parameters, -1 towards smaller ones.
    options : StepOptions, optional
    told : callable
        The parameter as text with its name and unit, for messages.

    Returns
    -------
    Curve

    Raises
    ------
    CaseError
        A start or limits that cannot be used.
    ConvergenceError
        No solution near the start.
    """
    curve = scaled_curve(
        evaluate, start, parameter, limits=limits, scale=scale, unit=unit, options=options, told=told
    )
    first = start_point(curve, start, parameter, limits=limits, direction=direction)
    return collect(curve, first, limits=limits, options=options)


def scaled_curve(
    evaluate, start, parameter: float, *, limits, scale=1.0, unit=None, options=None, told=told_value
) -> ScaledCurve:
    """The equations with their scales, checked; arguments as for :func:`continue_curve`."""
    options = options or StepOptions()
    low, high = _checked_limits(limits)
    unit = high - low if unit is None else unit
    scale = np.broadcast_to(np.asarray(scale, float), np.shape(start)).copy()
    if not (np.all(np.isfinite(scale)) and np.all(scale > 0.0) and 0.0 < unit < np.inf):
        raise CaseError("the scales of a curve must be positive", code="E-SCALE", limit="> 0")
    curve = ScaledCurve(evaluate, scale, float(unit), options.tolerance, options.max_iterations, told=told)
    return _with_rows(curve, curve.scaled(start, parameter))


def _checked_limits(limits) -> tuple[float, float]:
    """Low and high end of the range of the parameter."""
    try:
        low, high = (float(value) for value in limits)
        valid = bool(np.isfinite([low, high]).all() and low < high)
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise CaseError(
            f"a range of {limits}", code="E-RANGE", key="limits", limit="low < high, both finite",
            remedy="give limits=(low, high) of the parameter",
        )  # fmt: skip
    return low, high


def _with_rows(curve: ScaledCurve, z: np.ndarray) -> ScaledCurve:
    """The same equations over the sizes that the rows of their derivative have at z."""
    try:
        size = np.abs(curve.equations(z)[1]).max(axis=1)
    except LostError as error:
        raise ConvergenceError(f"the start cannot be used: {error}", code="E-START") from error
    # in a branch point all of one equation may vanish
    return replace(curve, rows=np.where(size > 0.0, size, size.max() or 1.0))


def start_point(curve: ScaledCurve, start, parameter: float, *, limits, direction: int = 1) -> CurvePoint:
    """Corrected point at the parameter; the tangent goes with ``direction``."""
    if not limits[0] <= parameter <= limits[1]:
        raise CaseError(
            f"the start at {curve.told(parameter)} lies outside the range", code="E-RANGE",
            limit=f"{limits[0]:.6g} to {limits[1]:.6g}",
        )  # fmt: skip
    axis = np.zeros(len(curve.scale) + 1)
    axis[-1] = 1.0
    try:
        return correct(curve, curve.scaled(start, parameter), axis, along=np.sign(direction) * axis)
    except LostError as error:
        raise ConvergenceError(
            f"no solution found near the start at {curve.told(parameter)}: {error}", code="E-START",
            remedy="give a better start, or start away from a limit point",
        ) from error  # fmt: skip


def collect(curve: ScaledCurve, first: CurvePoint, *, limits, options=None) -> Curve:
    """The whole curve from a corrected point in the sense of its tangent."""
    walk, points = curve_points(curve, first, limits=limits, options=options), []
    while True:
        try:
            points.append(next(walk))
        except StopIteration as stop:
            ending = stop.value
            break
    z = np.array([p.z for p in points])
    parameter = z[:, -1] * curve.unit
    if points[-1].kind == "end":
        parameter[-1] = min(limits, key=lambda limit: abs(limit - parameter[-1]))
    kinds = np.array([p.kind for p in points])
    return Curve(
        points=z[:, :-1] * curve.scale,
        parameter=parameter,
        folds=np.flatnonzero(kinds == "fold"),
        branch_points=np.flatnonzero(kinds == "branch point"),
        closed=ending.closed,
        complete=ending.complete,
        message=ending.message,
        tangent=np.array([p.tangent for p in points]),
        iterations=np.array([p.iterations for p in points]),
        error=np.array([p.error for p in points]),
        scale=curve.scale,
        unit=curve.unit,
    )


def switch_branch(
    evaluate: Callable,
    known: Curve,
    index: int,
    *,
    limits,
    options: StepOptions | None = None,
    told: Callable[[float], str] = told_value,
) -> tuple[Curve, Curve]:
    """The curve that crosses a known one in a branch point, in both directions from there.

    Parameters
    ----------
    evaluate : callable
        As given to :func:`continue_curve`.
    known : Curve
    index : int
        Of the branch point among the points of the known curve, one of ``known.branch_points``.
    limits, options, told
        As for :func:`continue_curve`.

    Raises
    ------
    CaseError
        The point is no branch point.
    ConvergenceError
        The branch point is not simple, so that the other directions cannot be told apart.
    """
    if index not in known.branch_points:
        raise CaseError(
            f"point {index} is no branch point", code="E-BRANCH",
            limit=f"one of {known.branch_points.tolist()}",
        )  # fmt: skip
    start = known.points[index]
    curve = scaled_curve(
        evaluate, start, known.parameter[index], limits=limits, scale=known.scale, unit=known.unit,
        options=options, told=told,
    )  # fmt: skip
    z = curve.scaled(start, known.parameter[index])
    _, derivative = curve.equations(z)
    point = CurvePoint(z, known.tangent[index], derivative, 0.0, 0, 0.0, float(known.error[index]))
    try:
        tangent = crossing_tangent(curve, point)
    except LostError as error:
        raise ConvergenceError(
            f"no other curve found at {told(float(known.parameter[index]))}: {error}", code="E-BRANCH",
            remedy="disturb the symmetry of the system a little",
        ) from error  # fmt: skip
    sides = (replace(point, tangent=sign * tangent) for sign in (1.0, -1.0))
    return tuple(collect(curve, side, limits=limits, options=options) for side in sides)
