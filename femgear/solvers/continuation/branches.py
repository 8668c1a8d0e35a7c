"""Branches of periodic solutions over a frequency or another parameter, with limit points and stability.

The harmonic equations along one parameter, a base frequency or anything that changes the system, joined with
arc-length continuation and Floquet multipliers: Krack and Gross, Harmonic Balance for Nonlinear Vibration
Problems (2019), chapters 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_numbers, checked_tolerance
from femgear.solvers.continuation.arclength import Curve, continue_curve
from femgear.solvers.continuation.corrector import StepOptions, describe_value
from femgear.solvers.linear.receptance import Reduction
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


def _of_curve(name: str, text: str) -> property:
    """Property of a branch that its curve has."""
    return property(lambda branch: getattr(branch.curve, name), doc=text)


def _of_solutions(name: str, text: str) -> property:
    """Property of a branch that every solution has, as an array (p,)."""
    return property(lambda branch: np.array([getattr(solution, name) for solution in branch.solutions]), doc=text)


@dataclass(frozen=True)
class Branch:
    """Periodic solutions along a curve.

    Every solution carries its tail, the spectral radius of its fixed point and its verdict.

    Parameters
    ----------
    solutions : tuple of PeriodicSolution
        One a point, in order along the curve.
    curve : Curve
        The unknowns, limit points and branch points.
    equations : ContinuationProblem
        The equations along the curve.
    stability : bool
        Whether verdicts were asked for.
    """

    solutions: tuple[PeriodicSolution, ...]
    curve: Curve
    equations: ContinuationProblem = field(repr=False)
    stability: bool = True

    parameter = _of_curve("parameter", "Frequency [rad/s] or whatever was varied, (p,), along the curve.")
    folds = _of_curve("folds", "Indices (n_folds,) of the limit points.")
    branch_points = _of_curve("branch_points", "Indices (n_points,) where another branch crosses.")
    closed = _of_curve("closed", "The last solution is the first one again.")
    complete = _of_curve("complete", "The branch reached an end of the range or closed.")
    converged = _of_solutions("converged", "(p,) bool.")
    residual = _of_solutions("residual", "Residual of the harmonic equations over the deflection, (p,).")
    tail = _of_solutions("tail", "Share of the amplitude in the upper half of the lines, (p,).")
    spectral_radius = _of_solutions("spectral_radius", "Of the fixed point, (p,); nan where not asked for.")

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
    def message(self) -> str:
        """How the branch ended; where it was lost, what to change."""
        advice = f"; {_advice(self.solutions[-1], self.equations)}" if self.curve.lost else ""
        return self.curve.message + advice


@dataclass(frozen=True)
class CurveOptions:
    """What curves over a frequency and over another parameter have in common.

    Parameters
    ----------
    harmonics, orders, samples, reduction
        As for `harmonic_balance`; a reduction is for a curve over a frequency.
    start : PeriodicSolution or (n_columns, L) array, optional
        Near the solution to start from; found from the linear response when not given.
    start_at : float, optional
        Parameter of the start, within the range, when it is not the first one; closed loops need that.
    stability : bool
        Floquet verdict and spectral radius of the fixed point at every point. With several base frequencies
        each verdict says "not covered".
    tolerance : float
        Relative error of the monodromy matrices.
    radius : bool, optional
        The radius alone, with or without verdicts; nan without.
    scale : float, optional
        Deflection [m] that counts as much as the whole range of the parameter; by default the larger of the
        static deflection and the start.
    options : StepOptions, optional
        How the curve is followed.
    """

    harmonics: int | None = None
    orders: np.ndarray | None = None
    samples: tuple[int, ...] | int | None = None
    reduction: Reduction | None = None
    start: PeriodicSolution | np.ndarray | None = None
    start_at: float | None = None
    stability: bool = True
    tolerance: float = 1e-7
    radius: bool | None = None
    scale: float | None = None
    options: StepOptions | None = None

    def __post_init__(self):
        object.__setattr__(self, "tolerance", checked_tolerance(self.tolerance))

    def balance(self, problem: NonlinearSystem) -> HarmonicBalance:
        """Make the harmonic equations of a problem on these lines."""
        return harmonic_balance(
            problem,
            harmonics=self.harmonics,
            orders=self.orders,
            samples=self.samples,
            reduction=self.reduction,
        )

    @property
    def with_radius(self) -> bool:
        """Whether solutions get the spectral radius of their fixed point."""
        return self.stability if self.radius is None else self.radius


def frequency_response_curve(
    problem: NonlinearSystem, frequency: tuple[float, float], *, base: int = 0, held=None, **options
) -> Branch:
    """Follow periodic solutions over a base frequency, past limit points.

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    frequency : (first, last)
        [rad/s]; the curve starts at the first one towards the last one, which may be lower. With stability
        both are above zero.
    base : int
        Which base frequency varies.
    held : (n_bases,) array, optional
        The base frequencies, when there are several; the entry ``base`` is not used.
    options
        Fields of `CurveOptions`.

    Raises
    ------
    CaseError
        A range, start or base that cannot be used; stability at the frequency zero (E-RANGE).
    ConvergenceError
        No solution at the start.
    """
    chosen, frequency = CurveOptions(**options), _ends(frequency, "frequency", "rad/s")
    balance = chosen.balance(problem)
    bases = balance.orders.shape[1]
    others = np.ones(bases) if held is None and bases == 1 else held
    if others is None or np.shape(others) != (bases,) or not 0 <= base < bases:
        raise CaseError(
            f"base {base} with the other base frequencies {others}",
            code="E-RANGE",
            key="held",
            limit=f"{bases} base frequencies and one of them to vary",
        )
    if not 0.0 <= min(frequency) < max(frequency) < np.inf:
        raise CaseError(f"a range of frequencies {frequency}", code="E-RANGE", limit="two different ones, not negative")
    if chosen.stability and bases == 1:
        require_period(min(frequency))
    equations = ContinuationProblem(
        balance,
        tuple(np.asarray(others, float).tolist()),
        (min(frequency), max(frequency)),
        base=base,
        radius=chosen.with_radius,
    )
    return _follow(equations, frequency, chosen)


def parameter_curve(
    family: Callable[[float], NonlinearSystem], parameter: tuple[float, float], frequency, **options
) -> Branch:
    """Follow periodic solutions over any parameter at fixed base frequencies: torque, backlash, clearance.

    Parameters
    ----------
    family : callable
        Parameter -> NonlinearSystem; called within the range. The derivative by the parameter is taken by
        differences.
    parameter : (first, last)
        The curve starts at the first value towards the last one.
    frequency : float or (n_bases,) array
        [rad/s].
    options
        Fields of `CurveOptions`.

    Raises
    ------
    CaseError
        A range of one value, or base frequencies that are no finite numbers (E-RANGE).
    ConvergenceError
        No solution at the start.
    """
    chosen, parameter = CurveOptions(**options), _ends(parameter, "parameter", "")
    if not np.all(np.isfinite(parameter)) or min(parameter) == max(parameter):
        raise CaseError(f"a range of parameters {parameter}", code="E-RANGE", limit="two different ones")
    if chosen.stability:
        require_period(frequency)
    balance = chosen.balance(family(parameter[0] if chosen.start_at is None else chosen.start_at))
    held = checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s")
    equations = ContinuationProblem(
        balance,
        tuple(np.atleast_1d(held).tolist()),
        (min(parameter), max(parameter)),
        family=family,
        samples=chosen.samples,
        radius=chosen.with_radius,
    )
    return _follow(equations, parameter, chosen)


@dataclass(frozen=True)
class ContinuationProblem:
    """The harmonic equations along one parameter: a base frequency, or anything that changes the system.

    ``balance`` has them at the start. Of the base frequencies ``frequency`` [rad/s] the one numbered ``base``
    is the parameter, unless there is a ``family``: parameter -> NonlinearSystem, whose harmonic equations
    take ``samples``. ``limits`` are the lowest and the highest parameter; with ``radius`` the solutions get
    the spectral radius of their fixed point.
    """

    balance: HarmonicBalance
    frequency: tuple[float, ...]
    limits: tuple[float, float]
    base: int = 0
    family: Callable[[float], NonlinearSystem] | None = None
    samples: tuple[int, ...] | int | None = None
    radius: bool = False

    @property
    def scale(self) -> float:
        """Typical deflection [m], the larger one of both ends."""
        return max(self.balance_at(parameter).scale for parameter in self.limits)

    def describe(self, parameter: float) -> str:
        """Write the parameter in words."""
        if self.family is not None:
            return describe_value(parameter)
        return f"frequency {parameter:.6g} rad/s ({parameter / (2.0 * np.pi):.6g} Hz)"

    def frequency_at(self, parameter: float) -> np.ndarray:
        """List all base frequencies (n_bases,) [rad/s] at a parameter."""
        out = np.array(self.frequency)
        if self.family is None:
            out[self.base] = parameter
        return out

    def balance_at(self, parameter: float) -> HarmonicBalance:
        """Make the equations at a parameter; modes stay where masses, stiffnesses and loads do."""
        balance = self.balance
        if self.family is None:
            return balance
        problem = self.family(parameter)
        return harmonic_balance(
            problem,
            orders=balance.orders,
            samples=self.samples,
            reduction=balance.reduction if _same_linear_part(problem, balance.problem) else None,
            like=balance,
        )

    def evaluate(self, y, parameter: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute the residual (n_y,) [m], its derivatives by unknowns (n_y, n_y) and parameter (n_y,)."""
        balance = self.balance_at(parameter)
        forces = balance.forces(balance.lines(y))
        residual, jacobian, slope = balance.evaluate(y, self.frequency_at(parameter), forces)
        if self.family is None:
            return residual, jacobian, slope[:, self.base]
        step = _DIFFERENCE * (self.limits[1] - self.limits[0])
        # three points within the range, central where there is room
        offset = np.array([-1.0, 1.0]) * step
        if parameter + offset[0] < self.limits[0]:
            offset = np.array([1.0, 2.0]) * step
        elif parameter + offset[1] > self.limits[1]:
            offset = np.array([-1.0, -2.0]) * step
        a, b = offset
        here = balance, forces[0]
        near, far = (self._residual(y, parameter + value, *here) - residual for value in offset)
        return residual, jacobian, (near * b / a - far * a / b) / (b - a)

    def _residual(self, y, parameter: float, beside: HarmonicBalance, force: np.ndarray) -> np.ndarray:
        """Residual (n_y,) [m] at a parameter; elements that those beside it share have the same force there."""
        balance = self.balance_at(parameter)
        lines = balance.lines(y)
        value = balance.receptance_at(self.frequency_at(parameter))
        same = np.array_equal(balance.reduction.reference, beside.reduction.reference)
        if not same or balance.elements is not beside.elements:
            force = balance.forces(lines)[0]
        return balance.unknowns(balance.residual(lines, force, value))

    def first(self, parameter: float, start) -> PeriodicSolution:
        """Solve for the start of the curve, near a given solution or lines (n_columns, L) [m]."""
        balance = self.balance
        return solve_harmonic_balance(
            balance.problem,
            self.frequency_at(parameter),
            orders=balance.orders,
            start=start,
            samples=balance.grid.samples,
            reduction=balance.reduction,
            stability=False,
        )

    def solution(self, y, parameter: float, error: float, iterations: int = 0) -> PeriodicSolution:
        """Make the solution of a corrected point, unknowns y (n_y,) [m], with its last Newton step."""
        frequency = self.frequency_at(parameter)
        message = f"Point of a branch; last Newton step {error:.1e} of the scaled unknowns."
        message += coincidence_note(self.balance.orders, frequency)
        return self.balance_at(parameter).solution(
            y,
            frequency,
            radius=self.radius,
            converged=True,
            iterations=iterations,
            factorisations=iterations,
            message=message,
        )

    def judged(self, parameters, solutions, tolerance: float) -> tuple[PeriodicSolution, ...]:
        """Judge the stability of solutions at parameters (p,), each of its own system."""
        if self.family is None:
            return judged(self.balance.problem, solutions, tolerance=tolerance)
        return tuple(
            judged(self.family(float(parameter)), [solution], tolerance=tolerance)[0]
            for parameter, solution in zip(parameters, solutions)
        )


def _follow(equations: ContinuationProblem, ends: tuple[float, float], chosen: CurveOptions) -> Branch:
    """The branch between two ends of the parameter."""
    limits, describe = equations.limits, equations.describe
    begin = ends[0] if chosen.start_at is None else float(chosen.start_at)
    if not limits[0] <= begin <= limits[1]:
        raise CaseError(
            f"the start at {describe(begin)} lies outside the range",
            code="E-RANGE",
            key="start_at",
            limit=f"{limits[0]:.6g} to {limits[1]:.6g}",
        )
    first = equations.first(begin, chosen.start)
    if not first.converged:
        raise ConvergenceError(
            f"no periodic solution found at the start, {describe(begin)}: {first.message}",
            code="E-START",
            remedy="give a start, or start where the response is nearly linear",
        )
    scale = chosen.scale
    if scale is None:
        scale = max(equations.scale, float(np.abs(first.deflection).max()))
    curve = continue_curve(
        equations.evaluate,
        equations.balance.unknowns(first.deflection),
        begin,
        limits=limits,
        scale=scale,
        direction=1 if ends[1] > ends[0] else -1,
        options=chosen.options,
        describe=describe,
    )
    return _branch(equations, curve, chosen.stability, chosen.tolerance)


def _branch(equations: ContinuationProblem, curve: Curve, stability: bool, tolerance: float) -> Branch:
    solutions = tuple(
        equations.solution(u, float(parameter), float(error), int(count))
        for u, parameter, error, count in zip(curve.points, curve.parameter, curve.error, curve.iterations)
    )
    if stability:
        solutions = equations.judged(curve.parameter, solutions, tolerance)
    return Branch(solutions, curve, equations, stability)


def _ends(value, key: str, unit: str) -> tuple[float, float]:
    """Two ends of a range."""
    ends = checked_numbers(value, key, code="E-RANGE", unit=unit)
    if ends.shape != (2,):
        raise CaseError(
            f"a range of shape {ends.shape}",
            code="E-RANGE",
            key=key,
            limit="(first, last)",
            remedy="give the first and the last value",
        )
    return float(ends[0]), float(ends[1])


def _advice(last: PeriodicSolution, equations: ContinuationProblem) -> str:
    """What to change where a branch was lost."""
    balance = equations.balance
    unsmoothed = any(getattr(element, "smoothing", 1.0) == 0.0 for element in balance.problem.elements)
    advice = ["start from the other end of the range"]
    if last.tail > _LONG_TAIL:
        advice.append(f"take more than {int(np.abs(last.orders).max())} harmonics")
    if unsmoothed and balance.longest:
        advice.append(f"give the elements a smoothing length, such as {1e-2 * balance.longest:.2g} m")
    elif not unsmoothed:
        advice.append(f"take more samples than {max(balance.grid.samples)}")
    return ", or ".join([*advice, "lower StepOptions(smallest)"])


def _same_linear_part(first: NonlinearSystem, other: NonlinearSystem) -> bool:
    """Whether two problems differ in their elements only."""
    if first.system is other.system and first.forces is other.forces and first.speed == other.speed:
        return True
    arrays = [
        [s.M, s.K, s.W, s.load, problem.damping, *(f.force for f in problem.forces)]
        for problem in (first, other)
        for s in (problem.system,)
    ]
    same_orders = [f.orders for f in first.forces] == [f.orders for f in other.forces]
    return same_orders and all(np.array_equal(a, b) for a, b in zip(*arrays))
