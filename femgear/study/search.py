"""Search for the best design within the bounds and limits of a problem.

`minimise` goes from samples of the design space to a local finish, by descents with derivatives (`descend`)
where the objective has them, else by SciPy's optimisers. `comparison_rows`, `tolerance_rows` and `search_verdict`
put an optimum into words.

A descent of a peak to peak goes by linear programs in a trust region: with ``y(x)`` the transmission error at
all positions, ``max y - min y`` is the least ``t`` with ``high - low <= t`` and ``low <= y_p <= high``. Every
step solves that problem for the linearised ``y`` within a box around the point, by SciPy's HiGHS; the box
shrinks where the linearisation promised too much (K. Madsen, J. Inst. Maths Applics 16, 1975, 321-328:
minimax by successive linear programs; steps and radii after R. Fletcher, E. Sainz de la Maza, Math. Program.
43, 1989, 235-256). Most minima are corners: a method that waits for a vanishing gradient finds none.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from femgear.case.dependencies import FLANK_ENTRIES
from femgear.case.gear_set import set_deviations
from femgear.case.planetary import Case
from femgear.case.tooth_friction import no_acting_friction
from femgear.errors import CaseError, ContactError, ConvergenceError, FemgearError, StorageError
from femgear.findings import Finding, percent, tell
from femgear.stages.key_figures import DECIBEL
from femgear.stages.protocol import Progress, one_blas_thread
from femgear.stages.static import record_positions, static_supports
from femgear.study.designs import OUTSIDE, Enough, Evaluations, Failure, Tolerance, evaluations, tolerances
from femgear.study.objectives import under_torque
from femgear.study.problem import Point, Problem, Variable, Vector, start_point
from femgear.study.relief import DesignBasis
from femgear.study.runner import Runner
from femgear.study.sensitivity import linearise, sensitivity
from femgear.trains.reading import with_values

Method = Literal["auto", "minimax", "global", "simplex", "powell"]
METHODS = get_args(Method)
_HOP, _STEP = 0.1, 1e-4
"""Standard deviation of a hop, and half the difference of separations (round-off: 1e-12), over the ranges."""
_SMALLEST, _LEAST, _MOST_STEPS = 1e-4, 1e-5, 60
"""Box, over the ranges, gain, over the objective of the case, and steps at which a descent ends."""


@dataclass(frozen=True)
class SearchOptions:
    """How far a search goes: samples, starts, generations, designs.

    Parameters
    ----------
    samples : int, optional
        Of a Latin hypercube beside the start and the middle of the bounds, five a variable by default; the
        population of a generation. With 0 descents begin at the start alone.
    starts : int
        Descents from the best samples, and as many from hops away from the best end.
    generations : int
        Of the differential evolution, at most.
    max_designs : int, optional
        Different designs after which the search ends with the best so far.
    seed : int
        Of the samples.
    telling : bool
        Look for the findings of what is returned and tell them, see `femgear.findings.tell`.

    Raises
    ------
    CaseError
        E-RANGE: counts of nothing; one design is the case as it is, no search.
    """

    samples: int | None = None
    starts: int = 6
    generations: int = 30
    max_designs: int | None = None
    seed: int = 0
    telling: bool = True

    def __post_init__(self):
        for name, least in (("samples", 0), ("starts", 1), ("generations", 1), ("max_designs", 2)):
            check_count(name, getattr(self, name), least)

    def sample_count(self, problem: Problem) -> int:
        """Count the samples asked for, or those of the default."""
        return 5 * len(problem.variables) if self.samples is None else self.samples


def check_count(name: str, count: int | None, least: int) -> None:
    """Refuse (CaseError, E-RANGE) a count under the least one or over a million; None is no count."""
    if count is not None and not least <= count <= 1_000_000:
        raise CaseError("not usable", code="E-RANGE", key=name, value=count, limit=f"{least} to 1000000")


@dataclass(frozen=True)
class Optimum:
    """The best design that a search found.

    Parameters
    ----------
    problem : Problem
        What was searched.
    x : (n,) array
        In the units of the variables.
    case : Case
        With these values; otherwise that of the problem.
    before, after : dict
        Quantities of the problem by name [SI], of its case as it is and of the optimum.
    tolerances : tuple of Tolerance
        What each variable costs that is off by its tolerance; empty where that was not asked for.
    all_off : dict
        Quantities with all variables off at once, each to its worse side.
    findings : tuple of Finding
        Doubts and faults of the optimum, see `Designs.findings`.
    designs, computed, failures : int
        Designs asked for (the case and those of the tolerances among them), those of them computed now (the
        journal held the others), and those in the journal that cannot be computed.
    course : tuple of float
        Objective of every design in the order of the search [SI]; NaN outside the limits.
    seconds : float
        What a design computed now took on average [s].
    method, message : str
        How it was found, and how the search ended.
    converged : bool
        Whether the last local search met its criterion.
    """

    problem: Problem
    x: np.ndarray
    case: Case
    before: dict[str, float]
    after: dict[str, float]
    tolerances: tuple[Tolerance, ...]
    all_off: dict[str, float]
    findings: tuple[Finding, ...]
    designs: int
    computed: int
    failures: int
    course: tuple[float, ...]
    seconds: float
    method: str
    message: str
    converged: bool

    @property
    def values(self) -> dict[str, str | float | int]:
        """Value of every key as the case file holds it."""
        pairs = zip(self.problem.variables, self.problem.point(self.x), strict=True)
        return {key: value for variable, value in pairs for key in variable.keys}

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of the variables at a bound: wider bounds may give a better design."""
        low, high = self.problem.bounds.T
        near = np.minimum(self.x - low, high - self.x) <= 1e-6 * (high - low)
        return tuple(v.name for v, flag in zip(self.problem.variables, near) if flag)

    def gain(self, name: str | None = None) -> float:
        """Compute the share by which a quantity, by default the objective, is lower now; NaN from zero."""
        name = self.problem.objective.name if name is None else name
        before = self.before[name]
        return 1.0 - self.after[name] / before if before else math.nan

    def summary(self) -> str:
        """Write before and after, variables, what their tolerances cost, and how the optimum was found."""
        lines = [f"{name}: {before} -> {after} ({change})" for name, before, after, change in comparison_rows(self)]
        lines += [f"{key} = {value}" for key, value in self.values.items()]
        lines += [f"at a bound: {name}" for name in self.at_bounds]
        for name, tolerance, less, more in tolerance_rows(self):
            lines.append(f"{name} off by {tolerance}: {less} less, {more} more")
        return "\n".join([*lines, search_verdict(self)])


@one_blas_thread()
def minimise(
    problem: Problem,
    *,
    method: Method = "auto",
    journal: str | Path | None = None,
    start: Vector | None = None,
    options: SearchOptions | None = None,
    sensitivity: bool = True,
    cache: Path | None = None,
    progress: Progress | None = None,
    runner: Runner | None = None,
) -> Optimum:
    """Find the best design within the bounds and limits of a problem.

    A search repeats itself exactly with the same arguments: with a journal one that was interrupted goes
    through the designs it holds at once and on from there.

    Parameters
    ----------
    problem : Problem
        Variables, objective and limits.
    method : {"auto", "minimax", "global", "simplex", "powell"}
        ``"minimax"``: descents with derivatives of the contact problem (see `descend`) from the best of the
        samples; for transmission errors over deviations of the flanks, where ``"auto"`` takes it.
        ``"global"``: differential evolution, and the simplex of Nelder and Mead from its best point.
        ``"simplex"`` and ``"powell"``: these alone, from the start.
    journal : path-like, optional
        File that keeps every design.
    start : (n,) sequence, optional
        In the units of the variables; by default the values of the case, within the bounds.
    options : SearchOptions, optional
        Samples, descents and designs at most.
    sensitivity : bool
        Compute what the tolerances of the variables cost.
    cache : path, optional
        Folder of generated grids.
    progress : callable, optional
        Called with (stage, done, total).
    runner : Runner, optional
        Who computes samples, generations and tolerances, see `runner.open_runner`; the result is the same.

    Raises
    ------
    CaseError
        E-CHOICE: no such method, or not for this problem; E-START: a start outside the bounds.
    ConvergenceError
        E-INFEASIBLE: no design within the limits was found.
    StorageError
        Of the journal.
    """
    options = options or SearchOptions()
    method, x0, most = _method(problem, method), start_at(problem, start), options.max_designs
    how = {"journal": journal, "cache": cache, "progress": progress, "runner": runner}
    with evaluations(problem, max_designs=most, **how) as run:
        before = run.values(None, problem.reported)
        try:
            if method == "minimax":
                converged, message = _descents(run, x0, options)
            elif method == "global":
                converged, message = _evolution(run, x0, options)
            else:
                run.cost(x0)
                converged, message = polish(run, run.cost, x0, method=method)
        except Enough:
            converged, message = False, f"ended after {most} designs"
        best = _optimum(run, before, sensitivity, options.telling, (method, message, converged))
    for finding in best.findings:
        tell(finding)
    return best


def _method(problem: Problem, method: Method) -> Method:
    """The method, chosen where that is left to the problem; refused (E-CHOICE) where it does not fit."""
    smooth = has_derivatives(problem)
    if method == "auto":
        return "minimax" if smooth else "global"
    wrong = method not in METHODS
    if wrong or (method == "minimax" and not smooth):
        raise CaseError(
            "no such method" if wrong else "this problem has no derivatives",
            code="E-CHOICE",
            key="method",
            value=method,
            limit=", ".join(METHODS) if wrong else "a transmission error over deviations of drive flanks, no slices",
            remedy=None if wrong else 'take "global"',
        )
    if method != "global" and any(variable.integer for variable in problem.variables):
        raise CaseError("whole numbers", code="E-CHOICE", key="method", value=method, limit='"global"')
    return method


def _descents(run: Evaluations, x0: np.ndarray, options: SearchOptions) -> tuple[bool, str]:
    """Descents from the best samples, then from random steps away from the best end (basin hopping).

    Corners of a peak to peak are many: a relief that starts beyond one position more is another branch. The
    hops are those of D. J. Wales, J. P. K. Doye, J. Phys. Chem. A 101, 1997, 5111-5116, at temperature zero.
    """
    count, starts = options.sample_count(run.problem), options.starts
    points = [x0, *(samples_of(run.problem, count, options.seed) if count else ())]
    run.ahead(points)
    costs = np.array([run.cost(x) for x in points])
    for i in np.argsort(costs, kind="stable")[:starts]:
        if costs[i] < OUTSIDE:
            descend(run, points[i])
    (low, high), random = run.problem.bounds.T, np.random.default_rng(options.seed)
    for _ in range(starts if count else 0):
        away = _HOP * (high - low) * random.standard_normal(len(low))
        descend(run, np.clip(run.best[0] + away, low, high))
    # with a small box: linear programs from another side of the same corner
    return descend(run, run.best[0], radius=0.05)


def _evolution(run: Evaluations, x0: np.ndarray, options: SearchOptions) -> tuple[bool, str]:
    """Differential evolution, then the simplex."""
    from scipy.optimize import differential_evolution

    problem, count = run.problem, options.sample_count(run.problem)
    integral = np.array([variable.integer for variable in problem.variables])
    population = np.vstack([x0, samples_of(problem, max(count, 5) - 2, options.seed)])

    def generation(cost, places) -> list[float]:
        run.ahead(places := [*places])
        return [cost(x) for x in places]

    ended = differential_evolution(
        run.cost,
        problem.bounds,
        init=population,  # type: ignore[arg-type]  # SciPy takes arrays as well
        maxiter=options.generations,
        integrality=integral,
        rng=options.seed,
        polish=False,
        tol=1e-3,
        updating="deferred",
        workers=generation,  # type: ignore[arg-type]  # and a map
    )
    if integral.any():
        return bool(ended.success), str(ended.message)
    return polish(run, run.cost, run.best[0], size=0.05)


def _optimum(run: Evaluations, before: dict, sensitivity: bool, telling: bool, ended) -> Optimum:
    """The best point with all that is reported of it."""
    problem = run.problem
    x, cost = run.best
    if cost >= OUTSIDE:
        raise infeasible(run, limit="; ".join(limit.text for limit in problem.limits) or None)
    x = numbers(problem, problem.point(x))
    try:
        after = run.values(x, problem.reported)
    except Failure as failure:
        raise ConvergenceError(
            f"the optimum has the objective but not all other quantities: {failure}",
            code=failure.error["code"],
            key=failure.error["key"],
            value=problem.point(x),
        ) from None
    quantities = (problem.objective, *problem.also)
    off, all_off = tolerances(run, x, quantities) if sensitivity else ((), {})
    designs, (method, message, converged) = run.designs, ended
    findings = designs.findings(problem.reported, problem.point(x)) if telling else ()
    return Optimum(
        problem=problem,
        x=x,
        case=designs.at(problem.point(x)),
        before=before,
        after=after,
        tolerances=off,
        all_off=all_off,
        findings=findings,
        course=tuple(run.course),
        designs=run.requested,
        computed=designs.computed,
        failures=len(designs.failures),
        seconds=designs.seconds / max(designs.computed, 1),
        method=method,
        message=message,
        converged=converged,
    )


def start_at(problem: Problem, start: Vector | None) -> np.ndarray:
    """Check a start (n,), by default the values of the case, and give it as x (n,).

    E-START (CaseError) outside the bounds.
    """
    if start is None:
        return start_point(problem.case, problem.variables)
    x, (low, high) = np.asarray(start, float), problem.bounds.T
    if x.shape != low.shape or not np.all((x >= low) & (x <= high)):
        raise CaseError(
            "the start lies outside the bounds",
            code="E-START",
            key="start",
            value=start,
            limit=", ".join(f"{v.name} {v.low} to {v.high}" for v in problem.variables),
        )
    return x


def samples_of(problem: Problem, count: int, seed: int) -> np.ndarray:
    """Draw a Latin hypercube of ``count`` points, the middle of the bounds before them, (1 + count, n).

    All in the units of the variables; the same ``seed`` gives the same points.
    """
    from scipy.stats.qmc import LatinHypercube

    low, high = problem.bounds.T
    spread = LatinHypercube(len(low), rng=seed).random(max(count, 1))
    return low + (high - low) * np.vstack([np.full(len(low), 0.5), spread])


def polish(
    run: Evaluations, cost, x0, *, method: str = "simplex", size: float = 0.15, rounds: int = 2
) -> tuple[bool, str]:
    """Minimise a cost without derivatives within the bounds, by simplexes or Powell's method.

    The simplex may collapse before it reaches a minimum (K. I. M. McKinnon, SIAM J. Optim. 9, 1998,
    148-158): it begins again, half as large, from where it ended.

    Parameters
    ----------
    cost : callable
        ``(x) -> float``.
    x0 : (n,) array
        Start, in the units of the variables.
    method : {"simplex", "powell"}
    size : float
        Of the first simplex, over the ranges of the variables.
    rounds : int
        Simplexes one after the other.

    Returns
    -------
    (bool, str)
        Whether the last search met its criterion, and how it ended.
    """
    from scipy.optimize import minimize

    low, high = run.problem.bounds.T
    width, n, unit = high - low, len(low), [(0.0, 1.0)] * len(low)
    # a point at a bound is one after scaling back and forth as well
    u = np.clip((x0 - low) / width, 0.0, 1.0)

    def scaled(v):
        return cost(np.clip(low + width * v, low, high))

    if method == "powell":
        ended = minimize(scaled, u, method="Powell", bounds=unit, options={"xtol": 1e-4, "ftol": 1e-4})
        return bool(ended.success), str(ended.message)
    for _ in range(rounds):
        steps = np.where(u + size > 1.0, -size, size)
        simplex = u + np.vstack([np.zeros(n), np.diag(steps)])
        options = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-4, "adaptive": n > 4}
        options["maxfev"] = 15 * (n + 1)
        ended = minimize(scaled, u, method="Nelder-Mead", bounds=unit, options=options)
        u, size = ended.x, 0.5 * size
    return bool(ended.success), str(ended.message)


def numbers(problem: Problem, point: Point) -> np.ndarray:
    """Convert values of the case file to numbers (n,) in the units of the variables."""
    return np.array([v.number(text) for v, text in zip(problem.variables, point)])


def infeasible(run: Evaluations, limit: str | None = None) -> ConvergenceError:
    """Make the error that a search ends with that found no design."""
    return ConvergenceError(
        f"none of {run.requested} designs can be computed and lies within the limits",
        code="E-INFEASIBLE",
        limit=limit,
        remedy="widen limits or bounds, or ask for more samples",
    )


def has_derivatives(problem: Problem) -> bool:
    """Tell whether a transmission error is minimised and all variables are deviations of flanks alone.

    Derivatives are those of the drive flanks in plane contact.
    """
    case = problem.case
    if problem.objective.signal is None:
        return False
    plane = case.static.slices < 2 and not case.static.back_flanks
    clear = not (case.static.members == "elastic" and case.planet.bearing_clearance)
    keys = [key for variable in problem.variables for key in variable.keys]
    deviations = all(re.split(r"[.\[]", key.partition(".")[2])[0] in FLANK_ENTRIES for key in keys)
    return bool(plane and clear and deviations and not any(v.integer for v in problem.variables))


def descend(evaluations: Evaluations, start: Vector, *, radius: float = 0.15) -> tuple[bool, str]:
    """Minimise a transmission error from a start by successive linear programs.

    The evaluations, of a problem that `has_derivatives`, hold the points of the descent, the best among them.
    The start (n,) is in the units of the variables, the radius of the first box over their ranges. Returns
    whether no step within the smallest box lowers the linearised objective, and how the descent ended.
    """
    problem = evaluations.problem
    low, high = problem.bounds.T
    scale = evaluations.scale(problem.objective)
    x, cost = np.array(start, float), evaluations.cost(start)
    for _ in range(_MOST_STEPS):
        try:
            value, slopes = signals(evaluations, x)
        except StorageError:
            raise
        except FemgearError as error:
            return False, f"no derivatives: {error.message}"
        while True:
            move, promised = _linear_program(value / scale, slopes / scale, x, low, high, radius)
            # the linearisation is that of the same contact problem: its value is the cost
            gain = float(np.ptp(value, axis=1).max()) / scale - promised
            if radius < _SMALLEST or gain < _LEAST:
                return True, "no linearised descent" if gain < _LEAST else "the smallest steps gain nothing"
            # a bound may be missed by rounding
            trial = np.clip(x + move, low, high)
            new = evaluations.cost(trial)
            ratio = (cost - new) / gain
            if ratio > 0.75:
                radius = min(2.0 * radius, 0.5)
            elif ratio < 0.25:
                radius *= 0.35
            if ratio > 0.01:
                x, cost = trial, new
                break
    return False, f"{_MOST_STEPS} steps were not enough"


def _linear_program(value, slopes, x, low, high, radius: float) -> tuple[np.ndarray, float]:
    """Step within the box, and the largest peak to peak that the linearisation promises there."""
    from scipy.optimize import linprog

    n, (K, P) = len(x), value.shape
    width = high - low
    # unknowns: n moves over their ranges, K highs, K lows, t
    flat = np.moveaxis(slopes, 0, -1).reshape(K * P, n) * width
    owner = np.kron(np.eye(K), np.ones((P, 1)))
    none, zeros = np.zeros((K * P, K)), np.zeros((K * P, 1))
    last = [np.zeros((K, n)), np.eye(K), -np.eye(K), -np.ones((K, 1))]
    A = np.block([[flat, -owner, none, zeros], [-flat, none, owner, zeros], last])
    b = np.concatenate([-value.ravel(), value.ravel(), np.zeros(K)])
    limits = [(max(-radius, lo), min(radius, hi)) for lo, hi in zip((low - x) / width, (high - x) / width)]
    cost = np.zeros(n + 2 * K + 1)
    cost[-1] = 1.0
    ended = linprog(cost, A, b, bounds=[*limits, *[(None, None)] * (2 * K), (0, None)], method="highs")
    if ended.x is None:
        return np.zeros(n), float(np.ptp(value, axis=1).max())
    return ended.x[:n] * width, float(ended.fun)


def signals(evaluations: Evaluations, x: Vector) -> tuple[np.ndarray, np.ndarray]:
    """Compute the transmission error (K, P) [m] at a point and its derivatives by the variables (n, K, P).

    Kept in the journal. FemgearError: the point cannot be computed.
    """
    problem = evaluations.problem
    key = "derivatives of " + problem.objective.name + " at " + json.dumps(problem.point(x))
    record = evaluations.designs.journal.get(key)
    if record is None:
        value, slopes = _linearised(evaluations, x)
        record = {"value": value.tolist(), "slopes": slopes.tolist()}
        evaluations.designs.journal.add(key, record)
    return np.array(record["value"]), np.array(record["slopes"])


def _linearised(evaluations: Evaluations, x) -> tuple[np.ndarray, np.ndarray]:
    """As `signals`, from the contact problem at the point."""
    problem = evaluations.problem
    objective = problem.objective
    answer = under_torque(evaluations.designs.answer(problem.point(x)), objective.torque)
    case, static = answer.case, answer.static
    no_acting_friction(case, "derivatives know no friction of the teeth")
    basis = DesignBasis(
        static.planetary_set,
        static.bodies,
        static_supports(case),
        set_deviations(case),
        record_positions(case, static.planetary_set),
        case.static.contact,
    )
    peaks = () if static.cycle.between is None else static.cycle.between.position
    linear = linearise(basis, sun_torque=static.sun_torque, periods=static.cycle.periods, between=peaks)
    n, signal = static.planetary_set.n_planets, objective.signal
    assert signal is not None, "see has_derivatives"
    value = signal(linear.sun_arc, linear.deflection, n)
    slopes = []
    for variable, number in zip(problem.variables, x, strict=True):
        low, high = variable.bounds
        step = _STEP * (high - low)
        inside = min(max(float(number), low + step), high - step)
        sensitivities = sensitivity(linear, _deviations(case, variable), inside, step=step)
        slopes.append(signal(sensitivities.sun_arc, sensitivities.deflection, n))
    if not np.isfinite(slopes).all():
        remedy = "raise operation.torque, or narrow the bounds of the variables"
        raise ContactError("a planet that carries nothing has no derivative", code="E-NO-LOAD", remedy=remedy)
    return value, np.array(slopes)


def _deviations(case: Case, variable: Variable):
    """Deviations of the case for a value of one variable; not rounded as `Variable.text` does."""

    def variant(number: float):
        text = f"{number!r} {variable.unit}" if variable.unit else number
        return set_deviations(with_values(case, dict.fromkeys(variable.keys, text)))

    return variant


def comparison_rows(optimum: Optimum) -> Iterator[tuple[str, str, str, str]]:
    """Write name, before, after and change of every reported quantity."""
    for quantity in optimum.problem.reported:
        before, after = optimum.before[quantity.name], optimum.after[quantity.name]
        change = percent(after / before - 1.0, 1, signed=True) if before else ""
        change = f"{after - before:+.2f} dB" if quantity.dimension.si == DECIBEL.si else change
        yield quantity.name, quantity.show(before), quantity.show(after), change


def tolerance_rows(optimum: Optimum) -> Iterator[tuple[str, str, str, str]]:
    """Write variable, tolerance, and the objective with the variable lower and higher."""
    objective = optimum.problem.objective

    def show(value: float) -> str:
        return "cannot be computed" if math.isnan(value) else objective.show(value)

    for tolerance in optimum.tolerances:
        sides = (show(tolerance.less[objective.name]), show(tolerance.more[objective.name]))
        yield tolerance.variable.name, f"{tolerance.tolerance:.4g} {tolerance.variable.unit}".strip(), *sides
    if optimum.all_off:
        worst = show(optimum.all_off[objective.name])
        yield "all at once, each to its worse side", "", worst, worst


def search_verdict(optimum: Optimum) -> str:
    """Tell how the optimum was found, and what to think of it."""
    each = f" ({optimum.seconds:.2g} s each)" if optimum.computed else ""
    text = (
        f"method {optimum.method}: {optimum.designs} designs, {optimum.computed} computed now{each}, "
        f"{optimum.failures} cannot be computed; {optimum.message}"
    )
    return text if optimum.converged else f"{text}; NOT CONVERGED"
