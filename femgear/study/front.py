"""Fronts between two objectives: designs of which none is better in both."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from femgear.errors import CaseError, FemgearError
from femgear.findings import Finding, tell
from femgear.stages.protocol import Progress, one_blas_thread
from femgear.study.designs import Enough, Evaluations, Failure, evaluations
from femgear.study.objectives import StudyQuantity
from femgear.study.problem import Problem, Vector
from femgear.study.runner import Runner
from femgear.study.search import (
    SearchOptions,
    check_count,
    descend,
    has_derivatives,
    infeasible,
    numbers,
    polish,
    samples_of,
    start_at,
)

_SMALL = 0.01
"""Share of the sum in the scalar objective; without it points that are better in one alone would tie."""


@dataclass(frozen=True)
class ParetoFront:
    """Designs of which none is better in both objectives, by the first objective ascending.

    Parameters
    ----------
    problem : Problem
        Its objective is the first one.
    second : StudyQuantity
        The second objective, minimised as the first.
    x : (m, n) array
        In the units of the variables.
    values : (m, 2) array
        Both objectives [SI].
    before : (2,) array
        Of the case as it is [SI].
    dominated : (k, 2) array
        Objectives of the other designs within the limits.
    findings : tuple of tuple of Finding
        Doubts and faults of every design, see `Designs.findings`.
    designs, failures : int
        Designs asked for, and those of them that cannot be computed.
    complete : bool
        Whether the search was not cut short by ``max_designs``.
    """

    problem: Problem
    second: StudyQuantity
    x: np.ndarray
    values: np.ndarray
    before: np.ndarray
    dominated: np.ndarray
    findings: tuple[tuple[Finding, ...], ...]
    designs: int
    failures: int
    complete: bool

    @property
    def compromise(self) -> int:
        """Number of the design whose worse objective, over the span of the front, is the best."""
        low, high = self.values.min(axis=0), self.values.max(axis=0)
        return int(((self.values - low) / np.where(high > low, high - low, 1.0)).max(axis=1).argmin())


def check_second(problem: Problem, second: StudyQuantity) -> None:
    """Refuse (E-OBJECTIVE) the objective of a problem as the second one of its front."""
    if second.name == problem.objective.name:
        raise CaseError(
            "a front has two objectives",
            code="E-OBJECTIVE",
            key="second",
            value=second.name,
            limit=f"another objective than {problem.objective.name}",
            remedy="name another second objective, or search without one",
        )


@one_blas_thread()
def pareto_front(
    problem: Problem,
    second: StudyQuantity,
    *,
    points: int = 5,
    start: Vector | None = None,
    options: SearchOptions | None = None,
    journal: str | Path | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
    runner: Runner | None = None,
) -> ParetoFront:
    """Find the front between the objective of a problem and a second one.

    Both are minimised alone. Between, the augmented weighted Chebyshev distance to the point of both minima,
    ``max_i w_i (f_i - f_i*)/span_i + 0.01 sum_i``, is minimised by the simplex of Nelder and Mead from the
    best design known so far: unlike weighted sums it reaches the hollow parts of a front as well (R. E.
    Steuer, E.-U. Choo, Math. Program. 26, 1983, 326-344). The front is what no other design computed on the
    way is better than in both.

    Parameters
    ----------
    problem : Problem
        Variables, first objective and limits.
    second : StudyQuantity
        Second objective, minimised as well.
    points : int
        Weights, the two ends included.
    start, options, journal, cache, progress, runner
        As for `minimise`; an optimum of the first objective is a good start. Of the options samples, seed and
        designs at most are taken.

    Raises
    ------
    CaseError
        E-OBJECTIVE: twice the same objective; E-RANGE: points.
    ConvergenceError
        E-INFEASIBLE: no design within the limits was found.
    """
    check_second(problem, second)
    check_count("points", points, 2)
    options = options or SearchOptions()
    most = options.max_designs
    how = {"journal": journal, "cache": cache, "progress": progress, "runner": runner}
    with evaluations(problem, max_designs=most, **how) as run:
        both = (problem.objective, second)
        before = np.array([run.values(None, both)[q.name] for q in both])
        complete = True
        try:
            spread = samples_of(problem, options.sample_count(problem), options.seed)
            _search(run, second, points, [start_at(problem, start), *spread])
        except Enough:
            complete = False
        x, values = _known(run, both)
        if not len(x):
            raise infeasible(run)
        best = non_dominated(values)
        order = best[np.argsort(values[best, 0], kind="stable")]
        rest, designs = np.setdiff1d(np.arange(len(values)), best), run.designs
        points_to_tell = map(problem.point, x[order] if options.telling else ())
        doubts = dict(designs.runner.map(partial(designs.findings, both), points_to_tell))
        for outcome in doubts.values():
            if isinstance(outcome, FemgearError):
                raise outcome
        front = ParetoFront(
            problem=problem,
            second=second,
            x=x[order],
            values=values[order],
            before=before,
            dominated=values[rest],
            findings=tuple(doubts.get(i, ()) for i in range(len(order))),
            designs=run.requested,
            failures=len(designs.failures),
            complete=complete,
        )
    _tell_of(front)
    return front


def _tell_of(front: ParetoFront) -> None:
    """Tell each code of the findings of a front once, with how many of its designs have it."""
    codes = [{told_finding.code: told_finding for told_finding in findings} for findings in front.findings]
    for code, finding in {code: value for design in codes for code, value in design.items()}.items():
        count = sum(code in design for design in codes)
        tell(replace(finding, text=f"{count} of {len(codes)} designs of the front, such as: {finding.text}"))


def non_dominated(values: np.ndarray) -> np.ndarray:
    """Find the rows (k,) of values (m, 2) that no other row is below in one column and not above in the other."""
    order = np.lexsort((values[:, 1], values[:, 0]))
    lowest, kept = np.inf, []
    for i in order:
        if values[i, 1] < lowest:
            lowest = values[i, 1]
            kept.append(i)
    return np.array(kept, int)


def _search(run: Evaluations, second: StudyQuantity, points: int, places) -> None:
    """Both ends, and the weights between."""
    both = (run.problem.objective, second)
    run.ahead(places, both)
    for x in places:
        run.cost(x)
        run.penalised(x, lambda x=x: sum(run.values(x, both).values()))
    for of_objective in (run, run.towards(second)):
        end = _end(run, of_objective)
        if end is not None:
            run.penalised(end, lambda x=end: sum(run.values(x, both).values()))
    _, values = _known(run, both)
    if not len(values):
        return
    low, high = values.min(axis=0), values[non_dominated(values)].max(axis=0)
    span = np.where(high > low, high - low, 1.0)

    def distance(place: np.ndarray, weight: float) -> np.ndarray:
        scaled = (place - low) / span
        return (np.array([weight, 1.0 - weight]) * scaled).max(axis=-1) + _SMALL * scaled.sum(axis=-1)

    for weight in np.linspace(0.0, 1.0, points)[1:-1]:

        def cost(x, weight=float(weight)) -> float:
            run.count(x)
            return run.penalised(x, lambda: float(distance(np.array([*run.values(x, both).values()]), weight)))

        x, values = _known(run, both)
        polish(run, cost, x[distance(values, float(weight)).argmin()], size=0.1, rounds=1)


def _end(run: Evaluations, of_objective: Evaluations) -> np.ndarray | None:
    """Minimum of the objective of ``of_objective`` alone, from the best design known."""
    x, values = _known(run, (of_objective.problem.objective,))
    if not len(x):
        return None
    start = x[values[:, 0].argmin()]
    if has_derivatives(of_objective.problem):
        descend(of_objective, start)
    else:
        polish(of_objective, of_objective.cost, start, size=0.1)
    return of_objective.best[0] if np.isfinite(of_objective.best[1]) else start


def _known(run: Evaluations, quantities) -> tuple[np.ndarray, np.ndarray]:
    """Points within bounds and limits at which all quantities are known, and these, (m, n) and (m, q).

    Only points that this search has asked for: it then repeats itself, whatever else the journal holds.
    """
    problem, points, values = run.problem, [], []
    low, high = problem.bounds.T
    for point in run.requested_points:
        values_known = (run.designs.journal.get(json.dumps(point)) or {}).get("values", {})
        if any(q.name not in values_known for q in quantities):
            continue
        x = numbers(problem, point)
        try:
            inside = bool(np.all((x >= low) & (x <= high))) and run.violation(x) == 0.0
        except Failure:
            continue
        if inside:
            points.append(x)
            values.append([values_known[q.name] for q in quantities])
    return np.array(points).reshape(-1, len(low)), np.array(values).reshape(-1, len(quantities))
