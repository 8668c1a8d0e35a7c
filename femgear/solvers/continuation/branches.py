"""Branches of periodic solutions over a frequency or another parameter, with limit points and stability.

The harmonic equations along one parameter, a base frequency or anything that changes the system (`Route`),
joined with arc-length continuation and Floquet multipliers: Krack and Gross, Harmonic Balance for Nonlinear
Vibration Problems (2019), chapters 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_numbers, checked_tolerance
from femgear.solvers.continuation.arclength import (
    Curve,
    StepOptions,
    continue_curve,
    scaled_curve,
    switch_branch,
)
from femgear.solvers.continuation.bifurcation import Segment
from femgear.solvers.continuation.corrector import correct, told_value
from femgear.solvers.periodic.equations import HarmonicBalance, harmonic_balance
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
from femgear.solvers.stability.floquet import judged, require_period
from femgear.system.fourier import coincidence_note
from femgear.system.system import NonlinearSystem

# Step of the differences by a parameter, in parts of its range.
_DIFFERENCE = 1e-5
# Share of the upper half of the lines that asks for more of them.
_LONG_TAIL = 1e-2


@dataclass(frozen=True)
class Branch:
    """Periodic solutions along a curve.

    Every solution carries its tail, the spectral radius of its fixed point and its verdict.

    Parameters
    ----------
    parameter : (p,) array
        Frequency [rad/s] or whatever was varied, in order along the curve.
    solutions : tuple of PeriodicSolution
    curve : Curve
        The unknowns, limit points and branch points.
    limits : (low, high)
    route : Route
        The equations along the curve.
    stability : bool
        Whether verdicts were asked for.
    """

    parameter: np.ndarray
    solutions: tuple[PeriodicSolution, ...]
    curve: Curve
    limits: tuple[float, float]
    route: Route = field(repr=False)
    stability: bool = True

    @property
    def verdicts(self) -> tuple[FloquetVerdict, ...]:
        """Verdicts of the solutions; empty when stability was not asked for."""
        return tuple(solution.verdict for solution in self.solutions) if self.stability else ()

    @property
    def frequency(self) -> np.ndarray:
        """Base frequencies, (p, n_bases) [rad/s]."""
        return np.stack([solution.frequency for solution in self.solutions])

    @property
    def lines(self) -> np.ndarray:
        """Deflections of the columns, (p, n_columns, L) complex [m]."""
        return np.stack([solution.deflection for solution in self.solutions])

    @property
    def orders(self) -> np.ndarray:
        """Lines, (L, n_bases)."""
        return self.solutions[0].orders

    @property
    def folds(self) -> np.ndarray:
        """Indices of the limit points."""
        return self.curve.folds

    @property
    def branch_points(self) -> np.ndarray:
        """Indices of the points where another branch crosses."""
        return self.curve.branch_points

    @property
    def stable(self) -> np.ndarray:
        """(p,) bool: known to be stable; False where the verdict is open."""
        return np.array([verdict.stable is True for verdict in self.verdicts])

    @property
    def loss(self) -> tuple[str, ...]:
        """How every solution lost its stability; ``""`` where it did not or the verdict is open."""
        return tuple(verdict.loss for verdict in self.verdicts)

    @property
    def largest_multiplier(self) -> np.ndarray:
        """Largest modulus of the Floquet multipliers, (p,); nan where there is no verdict."""
        return np.array([abs(v.multipliers[0]) if len(v.multipliers) else np.nan for v in self.verdicts])

    @property
    def converged(self) -> np.ndarray:
        """(p,) bool."""
        return np.array([solution.converged for solution in self.solutions])

    @property
    def residual(self) -> np.ndarray:
        """Largest violation of the harmonic equations relative to the largest deflection, (p,)."""
        return np.array([solution.residual for solution in self.solutions])

    @property
    def tail(self) -> np.ndarray:
        """Share of the amplitude in the upper half of the lines, (p,)."""
        return np.array([solution.tail for solution in self.solutions])

    @property
    def spectral_radius(self) -> np.ndarray:
        """Spectral radius of the fixed point, (p,); nan where it was not asked for."""
        return np.array([solution.spectral_radius for solution in self.solutions])

    @property
    def closed(self) -> bool:
        """The last solution is the first one again."""
        return self.curve.closed

    @property
    def complete(self) -> bool:
        """The branch reached an end of the range or closed."""
        return self.curve.complete

    @property
    def message(self) -> str:
        """How the branch ended; where it was lost, what to change."""
        lost = self.curve.message.startswith("lost")
        return self.curve.message + (f"; {_advice(self.solutions[-1], self.route)}" if lost else "")


def frequency_response_curve(
    problem: NonlinearSystem,
    frequency: tuple[float, float],
    *,
    harmonics: int | None = None,
    orders=None,
    base: int = 0,
    held=None,
    start=None,
    start_at: float | None = None,
    stability: bool = True,
    tolerance: float = 1e-7,
    radius: bool | None = None,
    samples=None,
    reduction=None,
    scale: float | None = None,
    options: StepOptions | None = None,
) -> Branch:
    """Periodic solutions over a base frequency, past limit points.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : (first, last)
        [rad/s]; the curve starts at the first one towards the last one, which may be lower. With stability
        both are above zero.
    harmonics, orders, samples, reduction
        As for ``harmonic_balance``.
    base : int
        Which base frequency varies.
    held : (n_bases,) array, optional
        The base frequencies, when there are several; the entry ``base`` is not used.
    start : PeriodicSolution or (n_columns, L) array, optional
        Near the solution to start from; found from the linear response when not given.
    start_at : float, optional
        Frequency of the start, within the range, when it is not the first one; closed loops need that.
    stability : bool
        Floquet verdict and spectral radius of the fixed point at every point. With several base frequencies
        each verdict says "not covered".
    tolerance : float
        Relative error of the monodromy matrices.
    radius : bool, optional
        The radius alone, with or without verdicts; nan without.
    scale : float, optional
        Deflection [m] that counts as much as the whole range of frequencies; by default the larger of the
        static deflection and the start.
    options : StepOptions, optional

    Raises
    ------
    CaseError
        A range, start or base that cannot be used; stability at the frequency zero (E-FREQUENCY).
    ConvergenceError
        No solution at the start.
    """
    tolerance, frequency = checked_tolerance(tolerance), _ends(frequency, "frequency", "rad/s")
    balance = harmonic_balance(
        problem, harmonics=harmonics, orders=orders, samples=samples, reduction=reduction
    )
    bases = balance.orders.shape[1]
    others = np.ones(bases) if held is None and bases == 1 else held
    if others is None or np.shape(others) != (bases,) or not 0 <= base < bases:
        raise CaseError(
            f"base {base} with the other base frequencies {others}", code="E-FREQUENCY", key="held",
            limit=f"{bases} base frequencies and one of them to vary",
        )  # fmt: skip
    if not 0.0 <= min(frequency) < max(frequency) < np.inf:
        raise CaseError(
            f"a range of frequencies {tuple(frequency)}",
            code="E-RANGE",
            limit="two different ones, not negative",
        )
    if stability and bases == 1:
        require_period(min(frequency))
    radius = stability if radius is None else radius
    route = FrequencyRoute(balance, tuple(np.asarray(others, float).tolist()), base, radius)
    return _follow(route, frequency, start, start_at, stability, tolerance, scale, options)


def parameter_curve(
    family: Callable[[float], NonlinearSystem],
    parameter: tuple[float, float],
    frequency,
    *,
    harmonics: int | None = None,
    orders=None,
    start=None,
    start_at: float | None = None,
    stability: bool = True,
    tolerance: float = 1e-7,
    radius: bool | None = None,
    samples=None,
    scale: float | None = None,
    options: StepOptions | None = None,
) -> Branch:
    """Periodic solutions over any parameter at fixed base frequencies: amplitude, backlash, clearance, ...

    Parameters
    ----------
    family : callable
        Parameter -> NonlinearSystem; called within the range.
    parameter : (first, last)
        The curve starts at the first value towards the last one.
    frequency : float or (n_bases,) array
        [rad/s].
    harmonics, orders, start, start_at, stability, tolerance, radius, samples, scale, options
        As for :func:`frequency_response_curve`. The derivative by the parameter is taken by differences.
    """
    tolerance, parameter = checked_tolerance(tolerance), _ends(parameter, "parameter", "")
    if not np.all(np.isfinite(parameter)) or min(parameter) == max(parameter):
        raise CaseError(
            f"a range of parameters {tuple(parameter)}", code="E-RANGE", limit="two different ones"
        )
    if stability:
        require_period(frequency)
    begin = parameter[0] if start_at is None else start_at
    balance = harmonic_balance(family(begin), harmonics=harmonics, orders=orders, samples=samples)
    held = checked_numbers(frequency, "frequency", code="E-FREQUENCY", unit="rad/s")
    omega = tuple(np.atleast_1d(held).tolist())
    radius = stability if radius is None else radius
    route = FamilyRoute(family, balance, omega, (min(parameter), max(parameter)), samples, radius)
    return _follow(route, parameter, start, start_at, stability, tolerance, scale, options)


def crossing_branches(
    branch: Branch, index: int, *, stability: bool = True, tolerance: float = 1e-7, options=None
) -> tuple[Branch, Branch]:
    """The branch that crosses a known one in a branch point, in both directions from there.

    Parameters
    ----------
    branch : Branch
    index : int
        One of ``branch.branch_points``.

    Raises
    ------
    CaseError
        The point is no branch point.
    ConvergenceError
        The branch point is not simple.
    """
    tolerance = checked_tolerance(tolerance)
    curves = switch_branch(
        branch.route.evaluate, branch.curve, index, limits=branch.limits, options=options,
        told=branch.route.told,
    )  # fmt: skip
    return tuple(_branch(branch.route, curve, branch.limits, stability, tolerance) for curve in curves)


def branch_maximum(
    branch: Branch, measure: Callable[[np.ndarray], float], *, tolerance: float = 1e-7
) -> tuple[float, float, PeriodicSolution]:
    """Largest value along a branch, found between its points: parameter, value, solution.

    Parameters
    ----------
    branch : Branch
    measure : callable
        Lines (n_columns, L) -> float.
    tolerance : float
        Of the verdict, which the solution has where the branch has them.
    """
    from scipy.optimize import minimize_scalar

    values = np.array([measure(lines) for lines in branch.lines])
    top = int(np.argmax(values))
    best = (float(branch.parameter[top]), float(values[top]), branch.solutions[top])
    known, z = (
        branch.curve,
        np.column_stack([branch.curve.points / branch.curve.scale, branch.parameter / branch.curve.unit]),
    )
    curve = scaled_curve(
        branch.route.evaluate, known.points[top], known.parameter[top], limits=branch.limits,
        scale=known.scale, unit=known.unit,
    )  # fmt: skip
    for i in {max(top - 1, 0), min(top, len(z) - 2)}:
        ends = [correct(curve, z[k], known.tangent[k]) for k in (i, i + 1)]
        segment = Segment(curve, *ends)

        def lowered(h: float, segment=segment) -> float:
            u, _ = curve.physical(segment.at(h).z)
            return -measure(branch.route.balance.lines(u))

        found = minimize_scalar(
            lowered, bounds=(0.0, segment.length), method="bounded", options={"xatol": 1e-10}
        )
        if -found.fun > best[1]:
            u, parameter = curve.physical(segment.at(found.x).z)
            best = (parameter, float(-found.fun), branch.route.solution(u, parameter, 0.0))
    if branch.stability:
        best = (*best[:2], branch.route.judged(best[:1], best[2:], tolerance)[0])
    return best


class Route(Protocol):
    """What a branch asks of the equations along its parameter; ``balance`` has them at its start."""

    balance: HarmonicBalance

    @property
    def scale(self) -> float: ...

    def told(self, parameter: float) -> str: ...

    def evaluate(self, y, parameter: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...

    def first(self, parameter: float, start) -> PeriodicSolution: ...

    def solution(self, y, parameter: float, error: float, iterations: int = 0) -> PeriodicSolution: ...

    def judged(self, parameters, solutions, tolerance: float) -> tuple[PeriodicSolution, ...]: ...


@dataclass(frozen=True)
class FrequencyRoute:
    """One base frequency varies, the others are held."""

    balance: HarmonicBalance
    held: tuple[float, ...]
    base: int
    radius: bool = False

    @property
    def scale(self) -> float:
        """Typical deflection [m]."""
        return self.balance.scale

    def told(self, parameter: float) -> str:
        """The varied frequency in words."""
        return f"frequency {parameter:.6g} rad/s ({parameter / (2.0 * np.pi):.6g} Hz)"

    def frequency(self, parameter: float) -> np.ndarray:
        """All base frequencies (n_bases,) [rad/s]."""
        out = np.array(self.held)
        out[self.base] = parameter
        return out

    def evaluate(self, y, parameter: float):
        """Residual (n_y,), derivatives by the unknowns (n_y, n_y) and by the frequency (n_y,)."""
        residual, jacobian, slope = self.balance.evaluate(y, self.frequency(parameter))
        return residual, jacobian, slope[:, self.base]

    def first(self, parameter: float, start) -> PeriodicSolution:
        """Solution near the start."""
        balance = self.balance
        return solve_harmonic_balance(
            balance.problem, self.frequency(parameter), orders=balance.orders, start=start,
            samples=balance.grid.samples, reduction=balance.reduction, stability=False,
        )  # fmt: skip

    def solution(self, y, parameter: float, error: float, iterations: int = 0) -> PeriodicSolution:
        """Solution at a corrected point."""
        return _told(self.balance, y, self.frequency(parameter), error, iterations, self.radius)

    def judged(self, parameters, solutions, tolerance: float) -> tuple[PeriodicSolution, ...]:
        """The solutions with their Floquet verdicts."""
        return judged(self.balance.problem, solutions, tolerance=tolerance)


@dataclass(frozen=True)
class FamilyRoute:
    """The system varies with the parameter, the base frequencies are held."""

    family: Callable[[float], NonlinearSystem]
    balance: HarmonicBalance
    omega: tuple[float, ...]
    limits: tuple[float, float]
    samples: tuple[int, ...] | int | None
    radius: bool = False

    @property
    def scale(self) -> float:
        """Typical deflection [m], the larger one of both ends."""
        return max(self.balance_at(parameter).scale for parameter in self.limits)

    def told(self, parameter: float) -> str:
        """The parameter in words."""
        return told_value(parameter)

    def balance_at(self, parameter: float) -> HarmonicBalance:
        """The equations; modes are computed again only where masses, stiffnesses or loads change."""
        problem = self.family(parameter)
        known = self.balance
        return harmonic_balance(
            problem, orders=known.orders, samples=self.samples,
            reduction=known.reduction if _same_linear_part(problem, known.problem) else None,
        )  # fmt: skip

    def evaluate(self, y, parameter: float):
        """Residual (n_y,), derivatives by the unknowns (n_y, n_y) and by the parameter (n_y,)."""
        step = _DIFFERENCE * (self.limits[1] - self.limits[0])
        residual, jacobian, _ = self.balance_at(parameter).evaluate(y, np.array(self.omega))
        # three points within the range, central where there is room
        offset = np.array([-1.0, 1.0]) * step
        if parameter + offset[0] < self.limits[0]:
            offset = np.array([1.0, 2.0]) * step
        elif parameter + offset[1] > self.limits[1]:
            offset = np.array([-1.0, -2.0]) * step
        a, b = offset
        near, far = (self._residual(y, parameter + value) - residual for value in offset)
        return residual, jacobian, (near * b / a - far * a / b) / (b - a)

    def _residual(self, y, parameter: float) -> np.ndarray:
        balance = self.balance_at(parameter)
        lines = balance.lines(y)
        value = balance.receptance(np.array(self.omega))[0]
        return balance.unknowns(balance.residual(lines, balance.forces(lines), value))

    def first(self, parameter: float, start) -> PeriodicSolution:
        """Solution near the start."""
        return solve_harmonic_balance(
            self.family(parameter), self.omega, orders=self.balance.orders, start=start,
            samples=self.samples, stability=False,
        )  # fmt: skip

    def solution(self, y, parameter: float, error: float, iterations: int = 0) -> PeriodicSolution:
        """Solution at a corrected point."""
        return _told(self.balance_at(parameter), y, np.array(self.omega), error, iterations, self.radius)

    def judged(self, parameters, solutions, tolerance: float) -> tuple[PeriodicSolution, ...]:
        """The solutions with their Floquet verdicts, each of its own system."""
        return tuple(
            judged(self.family(float(parameter)), [solution], tolerance=tolerance)[0]
            for parameter, solution in zip(parameters, solutions)
        )


def _follow(route, ends, start, start_at, stability, tolerance, scale, options) -> Branch:
    """The branch of a route between two ends of its parameter."""
    limits = (float(min(ends)), float(max(ends)))
    begin = float(ends[0]) if start_at is None else float(start_at)
    if not limits[0] <= begin <= limits[1]:
        raise CaseError(
            f"the start at {route.told(begin)} lies outside the range", code="E-RANGE", key="start_at",
            limit=f"{limits[0]:.6g} to {limits[1]:.6g}",
        )  # fmt: skip
    first = route.first(begin, start)
    if not first.converged:
        raise ConvergenceError(
            f"no periodic solution found at the start, {route.told(begin)}: {first.message}", code="E-START",
            remedy="give a start, or start where the response is nearly linear",
        )  # fmt: skip
    size = max(route.scale, float(np.abs(first.deflection).max())) if scale is None else scale
    curve = continue_curve(
        route.evaluate, route.balance.unknowns(first.deflection), begin, limits=limits, scale=size,
        direction=1 if ends[1] > ends[0] else -1, options=options, told=route.told,
    )  # fmt: skip
    return _branch(route, curve, limits, stability, tolerance)


def _branch(route: Route, curve: Curve, limits, stability: bool, tolerance: float) -> Branch:
    solutions = tuple(
        route.solution(u, float(parameter), float(error), int(count))
        for u, parameter, error, count in zip(curve.points, curve.parameter, curve.error, curve.iterations)
    )
    if stability:
        solutions = route.judged(curve.parameter, solutions, tolerance)
    return Branch(curve.parameter, solutions, curve, limits, route, stability)


def _ends(value, key: str, unit: str) -> tuple[float, float]:
    """Two ends of a range."""
    ends = checked_numbers(value, key, code="E-RANGE", unit=unit)
    if ends.shape != (2,):
        raise CaseError(
            f"a range of shape {ends.shape}", code="E-RANGE", key=key, limit="(first, last)",
            remedy="give the first and the last value",
        )  # fmt: skip
    return float(ends[0]), float(ends[1])


def _advice(last: PeriodicSolution, route: Route) -> str:
    """What to change where a branch was lost."""
    balance = route.balance
    unsmoothed = any(getattr(element, "smoothing", 1.0) == 0.0 for element in balance.problem.elements)
    found = ["start from the other end of the range"]
    if last.tail > _LONG_TAIL:
        found.append(f"take more than {int(np.abs(last.orders).max())} harmonics")
    if unsmoothed and balance.longest:
        found.append(f"give the elements a smoothing length, such as {1e-2 * balance.longest:.2g} m")
    elif not unsmoothed:
        found.append(f"take more samples than {max(balance.grid.samples)}")
    return ", or ".join([*found, "lower StepOptions(smallest)"])


def _told(
    balance: HarmonicBalance, y, frequency, error: float, iterations: int, radius: bool
) -> PeriodicSolution:
    message = f"Point of a branch; last Newton step {error:.1e} of the scaled unknowns."
    message += coincidence_note(balance.orders, frequency)
    return balance.solution(
        y, frequency, radius=radius, converged=True, iterations=iterations, factorisations=iterations,
        message=message,
    )  # fmt: skip


def _same_linear_part(one: NonlinearSystem, other: NonlinearSystem) -> bool:
    """Whether two problems differ in their elements only."""
    if one.system is other.system and one.forces is other.forces and one.speed == other.speed:
        return True
    arrays = [
        [s.M, s.K, s.W, s.load, problem.damping, *(f.force for f in problem.forces)]
        for problem in (one, other)
        for s in (problem.system,)
    ]
    same_orders = [f.orders for f in one.forces] == [f.orders for f in other.forces]
    return same_orders and all(np.array_equal(a, b) for a, b in zip(*arrays))
