"""Curves that cross a known one in a branch point, and the largest value along a branch.

Directions of the crossing curve: algebraic bifurcation equation (R. Seydel, Practical Bifurcation and
Stability Analysis, 3rd ed. 2010, section 5.5.3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize_scalar

from femgear.errors import CaseError, ConvergenceError, checked_tolerance
from femgear.solvers.continuation.arclength import Curve, _collect, _scaled_curve
from femgear.solvers.continuation.branches import Branch, _branch
from femgear.solvers.continuation.corrector import (
    CurvePoint,
    LostError,
    ScaledCurve,
    Segment,
    StepOptions,
    correct,
    describe_value,
)
from femgear.solvers.periodic.solution import PeriodicSolution

# Share of the largest second derivative below which the crossing curve has no curvature term.
_FLAT = 1e-6
# Distance over the step within which a curve has come back to the branch point that it starts in.
_BACK = 1e-2


def crossing_branches(
    branch: Branch, index: int, *, stability: bool = True, tolerance: float = 1e-7, options=None
) -> tuple[Branch, Branch]:
    """Follow the branch that crosses a known one in a branch point, in both directions from there.

    Parameters
    ----------
    branch : Branch
    index : int
        One of ``branch.branch_points``.
    stability, tolerance, options
        Fields of `CurveOptions`.

    Raises
    ------
    CaseError
        The point is no branch point.
    ConvergenceError
        The branch point is not simple.
    """
    tolerance, equations = checked_tolerance(tolerance), branch.equations
    along, back = switch_branch(
        equations.evaluate,
        branch.curve,
        index,
        limits=equations.limits,
        options=options,
        describe=equations.describe,
    )
    return _branch(equations, along, stability, tolerance), _branch(equations, back, stability, tolerance)


def branch_maximum(
    branch: Branch, measure: Callable[[np.ndarray], float], *, tolerance: float = 1e-7
) -> tuple[float, float, PeriodicSolution]:
    """Find the largest value along a branch, between its points too: parameter, value, solution.

    Parameters
    ----------
    branch : Branch
    measure : callable
        Lines (n_columns, L) -> float.
    tolerance : float
        Of the verdict, which the solution has where the branch has them.
    """
    equations, earlier = branch.equations, branch.curve
    values = np.array([measure(lines) for lines in branch.lines])
    top = int(np.argmax(values))
    parameter, value, solution = float(branch.parameter[top]), float(values[top]), branch.solutions[top]
    z = np.column_stack([earlier.points / earlier.scale, branch.parameter / earlier.unit])
    curve = _scaled_curve(
        equations.evaluate,
        earlier.points[top],
        earlier.parameter[top],
        limits=equations.limits,
        scale=earlier.scale,
        unit=earlier.unit,
    )
    for i in {max(top - 1, 0), min(top, len(z) - 2)}:
        first, last = (correct(curve, z[k], earlier.tangent[k]) for k in (i, i + 1))
        segment = Segment(curve, first, last)

        def lowered(h: float, segment=segment) -> float:
            u, _ = curve.physical(segment.at(h).z)
            return -measure(equations.balance.lines(u))

        minimum: OptimizeResult = minimize_scalar(
            lowered, bounds=(0.0, segment.length), method="bounded", options={"xatol": 1e-10}
        )  # type: ignore[assignment]
        if -minimum.fun > value:
            u, parameter = curve.physical(segment.at(minimum.x).z)
            value, solution = float(-minimum.fun), equations.solution(u, parameter, 0.0)
    if branch.stability:
        solution = equations.judged([parameter], [solution], tolerance)[0]
    return parameter, value, solution


def switch_branch(
    evaluate: Callable,
    earlier: Curve,
    index: int,
    *,
    limits,
    options: StepOptions | None = None,
    describe: Callable[[float], str] = describe_value,
) -> tuple[Curve, Curve]:
    """Follow the curve that crosses a known one in a branch point, in both directions from there.

    Parameters
    ----------
    evaluate : callable
        As given to `continue_curve`.
    earlier : Curve
    index : int
        Of the branch point among the points of the known curve, one of ``earlier.branch_points``.
    limits, options, describe
        As for `continue_curve`.

    Raises
    ------
    CaseError
        The point is no branch point.
    ConvergenceError
        The branch point is not simple, so that the other directions cannot be told apart.
    """
    if index not in earlier.branch_points:
        raise CaseError(
            f"point {index} is no branch point",
            code="E-CONVERGENCE",
            limit=f"one of {earlier.branch_points.tolist()}",
        )
    start = earlier.points[index]
    curve = _scaled_curve(
        evaluate,
        start,
        earlier.parameter[index],
        limits=limits,
        scale=earlier.scale,
        unit=earlier.unit,
        options=options,
        describe=describe,
    )
    z = curve.scaled(start, earlier.parameter[index])
    _, derivative = curve.equations(z)
    point = CurvePoint(z, earlier.tangent[index], derivative, 0.0, 0, 0.0, float(earlier.error[index]))
    try:
        tangent = _crossing_tangent(curve, point)
    except LostError as error:
        raise ConvergenceError(
            f"no other curve found at {describe(float(earlier.parameter[index]))}: {error}",
            code="E-CONVERGENCE",
            remedy="disturb the symmetry of the system a little",
        ) from error
    along, back = (_collect(curve, replace(point, tangent=sign * tangent)) for sign in (1.0, -1.0))
    return _up_to_start(along), _up_to_start(back)


def _up_to_start(curve: Curve) -> Curve:
    """The curve up to the branch point that it starts in, where it comes back to it in the same sense.

    Within a hundredth of a step: beside a branch point Newton's method does not find the start itself.
    """
    z = np.column_stack([curve.points / curve.scale, curve.parameter / curve.unit])
    for i in curve.branch_points[(curve.branch_points >= 3) & (curve.branch_points < len(z) - 1)]:
        near = np.linalg.norm(z[i] - z[0]) <= _BACK * np.linalg.norm(z[i + 1] - z[i - 1])
        if near and curve.tangent[i] @ curve.tangent[0] > 0.9:
            names = ("points", "parameter", "tangent", "iterations", "error")
            kept = {name: getattr(curve, name)[: i + 1] for name in names}
            kept |= {name: getattr(curve, name)[getattr(curve, name) < i] for name in ("folds", "branch_points")}
            return replace(curve, **kept, closed=True, complete=True, message="closed loop")
    return curve


def _crossing_tangent(curve: ScaledCurve, point: CurvePoint) -> np.ndarray:
    """Unit tangent (n + 1,) of the other curve through a simple branch point.

    With t the known tangent, p the other direction of the null space and ``a_xy = psi^T F''[x, y]``, the
    crossing curve goes along ``2 a_tp p - a_pp t`` (algebraic bifurcation equation, Seydel section 5.5.3).

    Raises
    ------
    LostError
        The point is no simple branch point.
    """
    left, singular, right = np.linalg.svd(point.derivative)
    if len(singular) > 1 and singular[-2] < 1e3 * singular[-1]:
        raise LostError(f"no simple branch point: smallest singular values {singular[-2]:.1e}, {singular[-1]:.1e}")
    psi, plane = left[:, -1], right[-2:]
    rates = plane @ point.tangent
    other = np.array([-rates[1], rates[0]]) @ plane
    other /= np.linalg.norm(other)
    step = 1e-3

    def second(direction: np.ndarray) -> float:
        # the derivative along the null space itself changes: psi^T F'[z + h d] d
        ahead = curve.equations(point.z + step * direction)[1] @ direction
        back = curve.equations(point.z - step * direction)[1] @ direction
        return float(psi @ (ahead - back)) / (2.0 * step)

    app, att = second(other), second(point.tangent)
    atp = 0.5 * (second((other + point.tangent) / np.sqrt(2.0)) * 2.0 - app - att)
    direction = 2.0 * atp * other - app * point.tangent
    size = np.linalg.norm(direction)
    if size <= _FLAT * max(abs(app), abs(att), abs(atp), np.finfo(float).tiny):
        raise LostError("the curves through the branch point have no distinct directions")
    return direction / size
