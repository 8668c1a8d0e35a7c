"""Minimisation with SciPy's optimisers, from samples of the design space to a local finish."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from femgear.case import Case
from femgear.errors import CaseError, ConvergenceError
from femgear.optimisation.designs import Failure, Progress
from femgear.optimisation.minimax import descend, has_derivatives
from femgear.optimisation.problem import OUTSIDE, Enough, Evaluations, Problem, evaluations
from femgear.optimisation.sensitivity import Tolerance, tolerances
from femgear.optimisation.variables import start_point
from femgear.threads import one_blas_thread

Method = Literal["auto", "minimax", "global", "simplex", "powell"]
METHODS = ("auto", "minimax", "global", "simplex", "powell")

_HOP = 0.1
"""Standard deviation of a hop, over the range of every variable."""


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
        from femgear.optimisation.words import describe

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


def _optimum(run: Evaluations, before: dict, sensitivity: bool, ended) -> Optimum:
    """The best point with all that is reported of it."""
    problem = run.problem
    x, cost = run.best
    if cost >= OUTSIDE:
        raise ConvergenceError(
            f"none of {run.asked} designs can be computed and lies within the limits",
            code="E-INFEASIBLE",
            limit="; ".join(limit.text for limit in problem.limits) or None,
            remedy="widen limits or bounds, or ask for more samples",
        )
    x = np.array([v.number(text) for v, text in zip(problem.variables, problem.point(x))])
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


def _method(problem: Problem, method: str) -> str:
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
