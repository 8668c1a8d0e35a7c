"""Searches for the best design: one objective, or the front between two.

`minimise` goes from samples of the design space to a local finish, by descents with derivatives
(`femgear.study.minimax`) where the objective has them, else by SciPy's optimisers. `pareto_front` finds
designs of which none is better in both objectives. `describe` and the rows beside it put an optimum into
words.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from femgear.case.sections import Case
from femgear.errors import CaseError, ConvergenceError
from femgear.study.minimax import descend, has_derivatives
from femgear.study.objectives import Quantity
from femgear.study.problem import OUTSIDE, Enough, Evaluations, Failure, Problem, evaluations
from femgear.study.sensitivity import Tolerance, tolerances
from femgear.study.variables import start_point
from femgear.threads import one_blas_thread
from femgear.trains.protocol import Progress

Method = Literal["auto", "minimax", "global", "simplex", "powell"]
METHODS = get_args(Method)
_HOP = 0.1
"""Standard deviation of a hop, over the range of every variable."""
_SMALL = 0.01
"""Share of the sum in the scalar objective; without it points that are better in one alone would tie."""


@dataclass(frozen=True)
class Optimum:
    """The best design that a search found.

    Parameters
    ----------
    problem : Problem
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
    designs, computed, failures : int
        Designs asked for (the case and those of the tolerances among them), those of them computed now (the
        journal held the others), and those in the journal that cannot be computed.
    course : tuple of float
        Objective of every design in the order of the search [SI]; NaN outside the limits.
    seconds : float
        What a design computed now took on average.
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
        return {key: value for variable, value in pairs for key in variable.key}

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of the variables at a bound: wider bounds may give a better design."""
        low, high = self.problem.bounds.T
        near = np.minimum(self.x - low, high - self.x) <= 1e-6 * (high - low)
        return tuple(v.name for v, flag in zip(self.problem.variables, near) if flag)

    def gain(self, name: str | None = None) -> float:
        """Share by which a quantity is lower than before, by default the objective; NaN where it was zero."""
        name = self.problem.objective.name if name is None else name
        before = self.before[name]
        return 1.0 - self.after[name] / before if before else math.nan

    def summary(self) -> str:
        """Before and after, values of the variables, and what their tolerances cost."""
        return describe(self)


@one_blas_thread()
def minimise(
    problem: Problem,
    *,
    method: Method = "auto",
    journal: str | Path | None = None,
    start: Sequence[float] | None = None,
    samples: int | None = None,
    starts: int = 6,
    generations: int = 30,
    max_designs: int | None = None,
    seed: int = 0,
    sensitivity: bool = True,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> Optimum:
    """Best design within the bounds and limits of a problem.

    A search repeats itself exactly with the same arguments: with a journal one that was interrupted goes
    through the designs it holds at once and on from there.

    Parameters
    ----------
    problem : Problem
    method : {"auto", "minimax", "global", "simplex", "powell"}
        ``"minimax"``: descents with derivatives of the contact problem (see `minimax`) from the best of the
        samples; for transmission errors over deviations of the flanks, where ``"auto"`` takes it.
        ``"global"``: differential evolution, and the simplex of Nelder and Mead from its best point.
        ``"simplex"`` and ``"powell"``: these alone, from the start.
    journal : path-like, optional
        File that keeps every design.
    start : (n,) sequence, optional
        In the units of the variables; by default the values of the case, within the bounds.
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
    sensitivity : bool
        Compute what the tolerances of the variables cost.
    cache : path, optional
        Folder of generated grids.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    Optimum

    Raises
    ------
    CaseError
        E-METHOD: no such method, or not for this problem; E-START: a start outside the bounds; E-RANGE:
        counts.
    ConvergenceError
        E-INFEASIBLE: no design within the limits was found.
    StorageError
        Of the journal.
    """
    check_counts(samples=samples, starts=starts, generations=generations, max_designs=max_designs)
    method = _method(problem, method)
    x0 = start_at(problem, start)
    count = 5 * len(problem.variables) if samples is None else samples
    options = {"journal": journal, "cache": cache, "max_designs": max_designs, "progress": progress}
    with evaluations(problem, **options) as run:
        before = run.values(None, problem.reported)
        try:
            if method == "minimax":
                converged, message = _descents(run, x0, count, starts, seed)
            elif method == "global":
                converged, message = _evolution(run, x0, count, generations, seed)
            else:
                run.cost(x0)
                converged, message = polish(run, run.cost, x0, method=method)
        except Enough:
            converged, message = False, f"ended after {max_designs} designs"
        return _optimum(run, before, sensitivity, (method, message, converged))


def _method(problem: Problem, method: str) -> str:
    """The method, chosen where that is left to the problem; refused (E-METHOD) where it does not fit."""
    smooth = has_derivatives(problem)
    if method == "auto":
        return "minimax" if smooth else "global"
    wrong = method not in METHODS
    if wrong or (method == "minimax" and not smooth):
        raise CaseError(
            "no such method" if wrong else "this problem has no derivatives",
            code="E-METHOD",
            key="method",
            value=method,
            limit=", ".join(METHODS) if wrong else "a transmission error over deviations of the drive flanks",
            remedy=None if wrong else 'take "global"',
        )
    if method != "global" and any(variable.integer for variable in problem.variables):
        raise CaseError("whole numbers", code="E-METHOD", key="method", value=method, limit='"global"')
    return method


def _descents(run: Evaluations, x0, count: int, starts: int, seed: int) -> tuple[bool, str]:
    """Descents from the best samples, then from random steps away from the best end (basin hopping).

    Corners of a peak to peak are many: a relief that starts beyond one position more is another branch. The
    hops are those of D. J. Wales, J. P. K. Doye, J. Phys. Chem. A 101, 1997, 5111-5116, at temperature zero.
    """
    points = [x0, *(samples_of(run.problem, count, seed) if count else ())]
    costs = np.array([run.cost(x) for x in points])
    for i in np.argsort(costs, kind="stable")[:starts]:
        if costs[i] < OUTSIDE:
            descend(run, points[i])
    (low, high), random = run.problem.bounds.T, np.random.default_rng(seed)
    for _ in range(starts if count else 0):
        away = _HOP * (high - low) * random.standard_normal(len(low))
        descend(run, np.clip(run.best[0] + away, low, high))
    # with a small box: linear programs from another side of the same corner
    ended = descend(run, run.best[0], radius=0.05)
    return ended.converged, ended.message


def _evolution(run: Evaluations, x0, count: int, generations: int, seed: int) -> tuple[bool, str]:
    """Differential evolution, then the simplex."""
    from scipy.optimize import differential_evolution

    problem = run.problem
    integral = np.array([variable.integer for variable in problem.variables])
    found = differential_evolution(
        run.cost,
        problem.bounds,
        init=np.vstack([x0, samples_of(problem, max(count, 5) - 2, seed)]),
        maxiter=generations,
        integrality=integral,
        rng=seed,
        polish=False,
        tol=1e-3,
    )
    if integral.any():
        return bool(found.success), str(found.message)
    return polish(run, run.cost, run.best[0], size=0.05)


def _optimum(run: Evaluations, before: dict, sensitivity: bool, ended) -> Optimum:
    """The best point with all that is reported of it."""
    problem = run.problem
    x, cost = run.best
    if cost >= OUTSIDE:
        raise _infeasible(run, limit="; ".join(limit.text for limit in problem.limits) or None)
    x = _numbers(problem, problem.point(x))
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
    return Optimum(
        problem=problem, x=x, case=designs.at(problem.point(x)), before=before, after=after, tolerances=off,
        all_off=all_off, course=tuple(run.course), designs=run.asked, computed=designs.computed,
        failures=len(designs.failures), seconds=designs.seconds / max(designs.computed, 1),
        method=method, message=message, converged=converged,
    )  # fmt: skip


@dataclass(frozen=True)
class ParetoFront:
    """Designs of which none is better in both objectives, by the first objective ascending.

    Parameters
    ----------
    problem : Problem
        Its objective is the first one.
    second : Quantity
    x : (m, n) array
        In the units of the variables.
    values : (m, 2) array
        Both objectives [SI].
    before : (2,) array
        Of the case as it is [SI].
    dominated : (k, 2) array
        Objectives of the other designs within the limits.
    designs, failures : int
    complete : bool
        Whether the search was not cut short by ``max_designs``.
    """

    problem: Problem
    second: Quantity
    x: np.ndarray
    values: np.ndarray
    before: np.ndarray
    dominated: np.ndarray
    designs: int
    failures: int
    complete: bool

    @property
    def compromise(self) -> int:
        """Number of the design whose worse objective, over the span of the front, is the best."""
        low, high = self.values.min(axis=0), self.values.max(axis=0)
        return int(((self.values - low) / np.where(high > low, high - low, 1.0)).max(axis=1).argmin())


@one_blas_thread()
def pareto_front(
    problem: Problem,
    second: Quantity,
    *,
    points: int = 5,
    start: Sequence[float] | None = None,
    samples: int | None = None,
    max_designs: int | None = None,
    seed: int = 0,
    journal: str | Path | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> ParetoFront:
    """Front between the objective of a problem and a second one.

    Both are minimised alone. Between, the augmented weighted Chebyshev distance to the point of both minima,
    ``max_i w_i (f_i - f_i*)/span_i + 0.01 sum_i``, is minimised by the simplex of Nelder and Mead from the
    best design known so far: unlike weighted sums it reaches the hollow parts of a front as well (R. E.
    Steuer, E.-U. Choo, Math. Program. 26, 1983, 326-344). The front is what no other design computed on the
    way is better than in both.

    Parameters
    ----------
    problem : Problem
    second : Quantity
    points : int
        Weights, the two ends included.
    start, samples, max_designs, seed, journal, cache, progress
        As for `minimise`; an optimum of the first objective is a good start.

    Returns
    -------
    ParetoFront

    Raises
    ------
    CaseError
        E-OBJECTIVE: twice the same objective; E-RANGE: counts.
    ConvergenceError
        E-INFEASIBLE: no design within the limits was found.
    """
    if second.name == problem.objective.name:
        raise CaseError(
            "a front has two objectives",
            code="E-OBJECTIVE",
            key="second",
            value=second.name,
            limit=f"another objective than {problem.objective.name}",
        )
    check_counts(points=points, samples=samples, max_designs=max_designs)
    options = {"journal": journal, "cache": cache, "max_designs": max_designs, "progress": progress}
    with evaluations(problem, **options) as run:
        both = (problem.objective, second)
        before = np.array([run.values(None, both)[q.name] for q in both])
        complete = True
        try:
            count = 5 * len(problem.variables) if samples is None else samples
            _search(run, second, points, [start_at(problem, start), *samples_of(problem, count, seed)])
        except Enough:
            complete = False
        x, values = _known(run, both)
        if not len(x):
            raise _infeasible(run)
        best = non_dominated(values)
        order = best[np.argsort(values[best, 0], kind="stable")]
        rest = np.setdiff1d(np.arange(len(values)), best)
        return ParetoFront(
            problem=problem, second=second, x=x[order], values=values[order], before=before,
            dominated=values[rest], designs=run.asked, failures=len(run.designs.failures), complete=complete,
        )  # fmt: skip


def non_dominated(values: np.ndarray) -> np.ndarray:
    """Row numbers of (m, 2) values that no other row is below in one column and not above in the other."""
    order = np.lexsort((values[:, 1], values[:, 0]))
    lowest, kept = np.inf, []
    for i in order:
        if values[i, 1] < lowest:
            lowest = values[i, 1]
            kept.append(i)
    return np.array(kept, int)


def _search(run: Evaluations, second: Quantity, points: int, places) -> None:
    """Both ends, and the weights between."""
    both = (run.problem.objective, second)
    for x in places:
        run.cost(x)
        run.penalised(x, lambda x=x: sum(run.values(x, both).values()))
    for own in (run, run.towards(second)):
        end = _end(run, own)
        if end is not None:
            run.penalised(end, lambda x=end: sum(run.values(x, both).values()))
    _, values = _known(run, both)
    if not len(values):
        return
    low, high = values.min(axis=0), values[non_dominated(values)].max(axis=0)
    span = np.where(high > low, high - low, 1.0)

    def distance(found: np.ndarray, weight: float) -> np.ndarray:
        scaled = (found - low) / span
        return (np.array([weight, 1.0 - weight]) * scaled).max(axis=-1) + _SMALL * scaled.sum(axis=-1)

    for weight in np.linspace(0.0, 1.0, points)[1:-1]:

        def cost(x, weight=float(weight)) -> float:
            run.count(x)
            names = [quantity.name for quantity in both]

            def value() -> float:
                found = run.values(x, both)
                return float(distance(np.array([found[name] for name in names]), weight))

            return run.penalised(x, value)

        x, values = _known(run, both)
        polish(run, cost, x[distance(values, float(weight)).argmin()], size=0.1, rounds=1)


def _end(run: Evaluations, own: Evaluations) -> np.ndarray | None:
    """Minimum of the objective of ``own`` alone, from the best design known."""
    x, values = _known(run, (own.problem.objective,))
    if not len(x):
        return None
    start = x[values[:, 0].argmin()]
    if has_derivatives(own.problem):
        descend(own, start)
    else:
        polish(own, own.cost, start, size=0.1)
    return start if own.best is None else own.best[0]


def _known(run: Evaluations, quantities) -> tuple[np.ndarray, np.ndarray]:
    """Points within bounds and limits at which all quantities are known, and these, (m, n) and (m, q).

    Only points that this search has asked for: it then repeats itself, whatever else the journal holds.
    """
    problem, points, values = run.problem, [], []
    low, high = problem.bounds.T
    for point in run.asked_points:
        known = (run.designs.journal.get(json.dumps(point)) or {}).get("values", {})
        if any(q.name not in known for q in quantities):
            continue
        x = _numbers(problem, point)
        try:
            inside = bool(np.all((x >= low) & (x <= high))) and run.violation(x) == 0.0
        except Failure:
            continue
        if inside:
            points.append(x)
            values.append([known[q.name] for q in quantities])
    return np.array(points).reshape(-1, len(low)), np.array(values).reshape(-1, len(quantities))


def check_counts(**counts: int | None) -> None:
    """Refuse counts of nothing: one design is the case as it is, no search.

    Raises
    ------
    CaseError
        E-RANGE.
    """
    least = {"samples": 0, "max_designs": 2, "points": 2}
    for name, count in counts.items():
        low = least.get(name, 1)
        if count is not None and not low <= count <= 1_000_000:
            raise CaseError("not usable", code="E-RANGE", key=name, value=count, limit=f"{low} to 1000000")


def start_at(problem: Problem, start: Sequence[float] | None) -> np.ndarray:
    """A start within the bounds; by default the values of the case. CaseError (E-START) outside them."""
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
    """Middle of the bounds, and a Latin hypercube of ``count`` points."""
    from scipy.stats.qmc import LatinHypercube

    low, high = problem.bounds.T
    spread = LatinHypercube(len(low), rng=seed).random(max(count, 1))
    return low + (high - low) * np.vstack([np.full(len(low), 0.5), spread])


def polish(
    run: Evaluations, cost, x0, *, method: str = "simplex", size: float = 0.15, rounds: int = 2
) -> tuple[bool, str]:
    """Local search without derivatives within the bounds.

    The simplex may collapse before it reaches a minimum (K. I. M. McKinnon, SIAM J. Optim. 9, 1998,
    148-158): it begins again, half as large, from where it ended.

    Parameters
    ----------
    run : Evaluations
    cost : callable
    x0 : (n,) array
    method : {"simplex", "powell"}
    size : float
        Of the first simplex, over the ranges.
    rounds : int
        Simplexes one after the other.
    """
    from scipy.optimize import Bounds, minimize

    low, high = run.problem.bounds.T
    width, unit = high - low, Bounds(np.zeros(len(low)), np.ones(len(low)))
    # a point at a bound is one after scaling back and forth as well
    u, n = np.clip((x0 - low) / width, 0.0, 1.0), len(low)

    def scaled(v):
        return cost(np.clip(low + width * v, low, high))

    if method == "powell":
        found = minimize(scaled, u, method="Powell", bounds=unit, options={"xtol": 1e-4, "ftol": 1e-4})
        return bool(found.success), str(found.message)
    for _ in range(rounds):
        steps = np.where(u + size > 1.0, -size, size)
        simplex = u + np.vstack([np.zeros(n), np.diag(steps)])
        options = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-4, "adaptive": n > 4}
        found = minimize(
            scaled, u, method="Nelder-Mead", bounds=unit, options=options | {"maxfev": 15 * (n + 1)}
        )
        u, size = found.x, 0.5 * size
    return bool(found.success), str(found.message)


def _numbers(problem: Problem, point: Sequence[object]) -> np.ndarray:
    """Values as the case file holds them, in the units of the variables."""
    return np.array([v.number(text) for v, text in zip(problem.variables, point)])


def _infeasible(run: Evaluations, limit: str | None = None) -> ConvergenceError:
    """What a search ends with that found no design."""
    return ConvergenceError(
        f"none of {run.asked} designs can be computed and lies within the limits",
        code="E-INFEASIBLE",
        limit=limit,
        remedy="widen limits or bounds, or ask for more samples",
    )


def describe(found: Optimum) -> str:
    """Before and after, values of the variables, what their tolerances cost, and how it was found."""
    lines = [
        f"{name}: {before} -> {after} ({change})" for name, before, after, change in comparison_rows(found)
    ]
    lines += [f"{key} = {value}" for key, value in found.values.items()]
    lines += [f"at a bound: {name}" for name in found.at_bounds]
    for name, tolerance, less, more in tolerance_rows(found):
        lines.append(f"{name} off by {tolerance}: {less} less, {more} more")
    return "\n".join([*lines, verdict(found)])


def comparison_rows(found: Optimum) -> Iterator[tuple[str, str, str, str]]:
    """Name, before, after and change of every reported quantity."""
    for quantity in found.problem.reported:
        before, after = found.before[quantity.name], found.after[quantity.name]
        change = f"{after / before - 1.0:+.1%}" if before else ""
        yield quantity.name, quantity.show(before), quantity.show(after), change


def tolerance_rows(found: Optimum) -> Iterator[tuple[str, str, str, str]]:
    """Variable, tolerance, and the objective with the variable lower and higher."""
    objective = found.problem.objective

    def show(value: float) -> str:
        return "cannot be computed" if math.isnan(value) else objective.show(value)

    for one in found.tolerances:
        sides = (show(one.less[objective.name]), show(one.more[objective.name]))
        yield one.variable.name, f"{one.tolerance:.4g} {one.variable.unit}".strip(), *sides
    if found.all_off:
        worst = show(found.all_off[objective.name])
        yield "all at once, each to its worse side", "", worst, worst


def verdict(found: Optimum) -> str:
    """How the optimum was found, and what to think of it."""
    each = f" ({found.seconds:.2g} s each)" if found.computed else ""
    text = (
        f"method {found.method}: {found.designs} designs, {found.computed} computed now{each}, "
        f"{found.failures} cannot be computed; {found.message}"
    )
    return text if found.converged else f"{text}; NOT CONVERGED"
