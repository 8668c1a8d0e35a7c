"""Best values of entries of a case file: search, refinement on the grid of the case, check by runs, files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import need_set
from femgear.case.planetary import Case
from femgear.errors import CaseError
from femgear.findings import percent
from femgear.housing.sensor import stored_lines
from femgear.report.response import stored_harmonics
from femgear.report.style import save_figure
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.storage.files import own_files, resumable, write_csv, write_text
from femgear.storage.results import run_folder
from femgear.study.designs import open_designs
from femgear.study.faults import all_faults
from femgear.study.figures import before_and_after, front_figure, tolerance_bars
from femgear.study.front import ParetoFront, check_second, pareto_front
from femgear.study.objectives import (
    STAGES,
    StudyQuantity,
    forces_over_time,
    has_figures,
    named_quantity,
    with_run_up,
)
from femgear.study.problem import Limit, Problem, Shape, Variable, parse_limit, parse_variable, tip_reliefs
from femgear.study.runner import Runner
from femgear.study.search import (
    Method,
    Optimum,
    SearchOptions,
    comparison_rows,
    minimise,
    search_verdict,
    tolerance_rows,
)
from femgear.trains.reading import to_toml, with_value, with_values
from femgear.trains.registry import train_of

if TYPE_CHECKING:
    import xarray as xr

_ERRORS = ("ste overall", "ste sun-planet", "ste planet-ring")
_FORCES = ("mesh force", "peak mesh force", "housing")
_QUIET = {"static.stresses": False, "housing.published": None}
_COLUMNS = ("quantity", "before", "optimum", "change")
_FILES = ("optimum.toml", "optimum.csv", "tolerances.png")
_FRONT, _CHECK = ("front.csv", "front.png"), ("check.csv", "optimum.png")
_JOURNALS, _RUNS = ("journal.jsonl", "journal_fine.jsonl"), ("before", "after")
_SPEEDS = "1000 rpm", "3500 rpm"
"""Of the input, by default."""
_FINE = {"static.positions": 128, "static.flank_elements": 32}
"""Of the runs that check the optimum."""
Run = Callable[[Case, Path, str], Any]
"""Runs a case into a folder up to a stage, and opens its results."""


@dataclass(frozen=True)
class SearchRequest:
    """What is searched.

    Parameters
    ----------
    vary : sequence of str
        Design variables, see `femgear.study.problem.parse_variable`; by default a tip relief more on every
        loaded flank, its amount and its start.
    shape : {"linear", "parabolic"}
        Of these reliefs.
    goal : str
        What to minimise, one of `femgear.study.objectives.NAMES`.
    limit : sequence of str
        See `femgear.study.problem.parse_limit`.
    of : sequence of str
        Further quantities to report; by default transmission errors, mesh forces, housing.
    second : str, optional
        Second goal: the Pareto front of both is searched as well.
    torque : str, optional
        Of the input, with its unit; by default that of the case.
    speeds : (str, str)
        First and last speed of the input, for mesh forces and the housing, by default 1000 and 3500 rpm; of
        gearboxes those of the run-up, by default as in the case.
    """

    vary: Sequence[str] = ()
    shape: Shape = "parabolic"
    goal: str = "ste"
    limit: Sequence[str] = ()
    of: Sequence[str] = ()
    second: str | None = None
    torque: str | None = None
    speeds: tuple[str, str] | None = None


@dataclass(frozen=True)
class SearchEffort:
    """How far a search goes.

    Parameters
    ----------
    method : {"auto", "minimax", "global", "simplex", "powell"}
        Of the search, see `femgear.study.search.minimise`.
    positions, flank_elements : int
        In one mesh period and along a flank in the search; the refinement takes those of the case.
    samples, max_designs, seed : int
        As in `femgear.study.search.SearchOptions`.
    check : bool
        Run case and optimum anew, on a finer grid.
    """

    method: Method = "auto"
    positions: int = 24
    flank_elements: int = 12
    samples: int | None = None
    max_designs: int | None = None
    seed: int = 0
    check: bool = True


@one_blas_thread()
def optimise_into(
    case: Case,
    folder: Path,
    request: SearchRequest,
    effort: SearchEffort,
    run: Run,
    *,
    cache: Path | None = None,
    progress: Progress = silent,
    runner: Runner | None = None,
    tell: Callable[[list[Block]], None] = lambda blocks: None,
) -> list[str]:
    """Search with few positions on a coarse grid, refine with those of the case, check by runs on a finer one.

    Every design is kept in the journals of the folder: the same call goes on where an interrupted one was.

    Parameters
    ----------
    case, folder : Case, path
        The folder is created where it does not exist.
    request, effort : SearchRequest, SearchEffort
        What is searched, and how far.
    run : callable
        ``(case, folder, stage)`` runs a case up to a stage and gives its results.
    cache, progress, runner
        As for `femgear.study.search.minimise`.
    tell : callable
        Called with tables as soon as they are there.

    Returns
    -------
    list of str
        Names of the files.

    Raises
    ------
    CaseError
        Everything that is wrong with request and effort; nothing is written then.
    StorageError
        Files of others (E-OUTPUT, E-JOURNAL).
    """
    if has_figures(case):
        how = {"cache": cache, "progress": progress, "runner": runner}
        return _optimise_figures(case, folder, request, effort, run, how, tell)
    if request.speeds is None:
        request = replace(request, speeds=_SPEEDS)
    data, problem, second = _problem(case, request, effort)
    runs = _RUNS if effort.check else ()
    names = [*_FILES, *(_FRONT if second else ()), *(_CHECK if effort.check else ())]
    own_files(folder, names)
    _refuse_foreign(data, problem, folder, runs)
    counts = SearchOptions(seed=effort.seed, samples=effort.samples, max_designs=effort.max_designs)
    options = {"options": counts, "cache": cache, "runner": runner}
    with resumable(folder):
        rough, best = _searched(data, problem, effort.method, folder, options, progress)
        tell(_write(best, data, folder, rough))
        if second is not None:
            coarsely = options | {"journal": folder / _JOURNALS[0], "start": rough.x, "progress": progress}
            front = pareto_front(problem, second, **coarsely)
            tell([_write_front(front, problem, second, folder)])
        if effort.check:
            speeds = None if data.rigid else request.speeds
            tell([_check(best, data, folder, speeds, rough, run)])
    return [*names, *_JOURNALS, *runs]


def _problem(case: Case, request: SearchRequest, effort: SearchEffort) -> tuple[Case, Problem, StudyQuantity | None]:
    """The case with its variables, the problem on a coarse grid, and the second goal; all faults at once."""
    need_set(case)
    with all_faults() as part:
        reported = request.of or (*_ERRORS, *(() if case.rigid else _FORCES))
        quantities, limits, variables, second = _read_request(case, request, reported, request.speeds, part)
        if request.torque is not None:
            with part("--torque"):
                case = with_value(case, "operation.torque", request.torque)
        for name in ("samples", "max_designs"):
            with part():
                _check_count(name, getattr(effort, name))
        fast, coarse = dict[str, object](_QUIET), case
        for name in ("positions", "flank_elements"):
            with part(f"--{name.replace('_', '-')}"):
                coarse = _with_option(coarse, name, getattr(effort, name))
                fast[f"static.{name}"] = getattr(effort, name)
        with part():
            _check_case(case)
        with part():
            for variable in variables:
                for bound in variable.bounds:
                    with_values(case, dict.fromkeys(variable.keys, variable.text(bound)))
    data = case
    if not variables:
        data, relieved = tip_reliefs(case, shape=request.shape)
        variables = [*relieved]
    first, *others = quantities
    problem = Problem(with_values(data, fast), variables, first, also=others, limits=limits)
    if second is not None:
        check_second(problem, second)
    return data, problem, second


def _read_request(
    case: Any, request: SearchRequest, reported: Sequence[str], speeds: tuple[str, str] | None, part: Any
) -> tuple[list[StudyQuantity], list[Limit], list[Variable], StudyQuantity | None]:
    """Quantities, goal first, limits, variables and second goal in words of a command line; faults go to ``part``."""
    quantities, limits, variables, second = list[StudyQuantity](), list[Limit](), list[Variable](), None
    for option, words in (("--goal", request.goal), *(("--of", words) for words in reported)):
        with part(option):
            quantities.append(named_quantity(words, speeds=speeds, case=case))
    for text in request.limit:
        with part("--limit"):
            limits.append(parse_limit(text, speeds=speeds, case=case))
    for text in request.vary:
        with part("--vary"):
            variables.append(parse_variable(text))
    if request.second is not None:
        with part("--second"):
            second = named_quantity(request.second, speeds=speeds, case=case)
    return quantities, limits, variables, second


def _optimise_figures(
    case: Any,
    folder: Path,
    request: SearchRequest,
    effort: SearchEffort,
    run: Run,
    how: dict[str, Any],
    tell: Callable[[list[Block]], None],
) -> list[str]:
    """Search among the key figures of a train, whose cases have no coarser grid, and check by two runs."""
    problem, second = _figure_problem(case, request)
    names = [*_FILES, *(_FRONT if second else ()), *(_CHECK[:1] if effort.check else ())]
    own_files(folder, names)
    for name in _RUNS if effort.check and folder.exists() else ():
        if (folder / name).exists():
            with run_folder(folder / name, force=True):
                pass
    counts = SearchOptions(seed=effort.seed, samples=effort.samples, max_designs=effort.max_designs)
    # a design is a deflection of the whole: no population can be afforded by default
    whole = any(variable.integer for variable in problem.variables)
    method: Method = effort.method if effort.method != "auto" or whole else "simplex"
    options = {"options": counts, "journal": folder / _JOURNALS[0], **how}
    with resumable(folder):
        best = minimise(problem, method=method, **options)
        tell(_write(best, problem.case, folder))
        if second is not None:
            front = pareto_front(problem, second, start=best.x, **options)
            tell([_write_front(front, problem, second, folder)])
        if effort.check:
            tell([_check_figures(best, folder, run)])
    return [*names, _JOURNALS[0], *(_RUNS if effort.check else ())]


def _figure_problem(case: Any, request: SearchRequest) -> tuple[Problem, StudyQuantity | None]:
    """The problem among the key figures of a case, and the second goal; all faults at once."""
    with all_faults() as part:
        with part("--speeds"):
            case = with_run_up(case, request.speeds)
        quantities, limits, variables, second = _read_request(case, request, request.of, request.speeds, part)
        with part():
            if not variables:
                raise CaseError(
                    "nothing to vary",
                    code="E-VARIABLE",
                    key="--vary",
                    limit="entries of the case with their bounds",
                    remedy='--vary "gear_1.profile_shift=0.0..0.4"'
                    if hasattr(case, "gear_names")
                    else '--vary "bearing[0].position=5 mm..12 mm"',
                )
        with part("--torque"):
            if request.torque is not None and hasattr(case.operation, "torque"):
                case = with_value(case, "operation.torque", request.torque)
            elif request.torque is not None:
                message, remedy = "a gearbox has the torques of its load cases", "vary operation.load_case[0].torque"
                raise CaseError(message, code="E-CHOICE", key="--torque", value=request.torque, remedy=remedy)
    first, *others = quantities
    problem = Problem(case, variables, first, also=others, limits=limits)
    if second is not None:
        check_second(problem, second)
    return problem, second


def _check_figures(best: Optimum, folder: Path, run: Run) -> Block:
    """Run case and optimum anew, and read their key figures from the files."""
    case, stages = best.problem.case, {quantity.stage for quantity in best.problem.reported}
    only = max(stages, key=STAGES.index)
    cases = (with_values(case, values) if values else case for values in ({}, best.values))
    runs = [run(changed, folder / name, only) for name, changed in zip(_RUNS, cases, strict=True)]
    reported = {quantity.name for quantity in best.problem.reported}
    rows, shown = [], []
    for figure in train_of(case).key_figures(case):
        if figure.stage not in runs[0].stages or not (figure.whole or figure.name in reported):
            continue
        before, after = (figure.read(results[figure.stage]) for results in runs)
        rows.append((figure.name, before, after, figure.dimension.si))
        texts = (f"{figure.show(value)} {figure.dimension.shown}".removesuffix(" 1") for value in (before, after))
        shown.append((figure.name, *texts, figure.change(before, after)))
    write_csv(folder / _CHECK[0], ("quantity", "before", "optimum", "unit"), rows)
    return Block("Computed anew, from the files of both runs", _COLUMNS, tuple(shown))


def _with_option(case: Case, name: str, value: int) -> Case:
    """Set an entry of the static stage; a refusal names the option beside it."""
    try:
        return with_value(case, f"static.{name}", value)
    except CaseError as error:
        error.message, error.key, error.file = f"static.{name}: {error.message}", f"--{name.replace('_', '-')}", None
        error.remedy = "leave it out for the default"
        raise


def _check_count(name: str, value: int | None) -> None:
    """Refuse (E-RANGE) a count of the search that makes none."""
    least = 2 if name == "max_designs" else 1
    if value is not None and not least <= value <= 1_000_000:
        raise CaseError(
            "not usable",
            code="E-RANGE",
            key=f"--{name.replace('_', '-')}",
            value=value,
            limit=f"{least} to 1000000",
            remedy="leave it out for the default",
        )


def _check_case(case: Case) -> None:
    """Refuse a case whose flanks change nothing: without torque, or with a mesh stiffness of its own."""
    if case.operation.torque == 0.0:
        raise CaseError(
            "without torque no tooth carries load",
            code="E-NO-LOAD",
            key="operation.torque",
            limit="not zero",
            remedy='give a torque, --torque "100 N m"',
        )
    for name in ("planar", "helical"):
        section = getattr(case, name, None)
        if getattr(section, "mesh_stiffness", None) is not None:
            raise CaseError(
                f"the case gives its mesh stiffness, so that deviations of the flanks change nothing in its "
                f"{name} model",
                code="E-STAGE",
                key=f"{name}.mesh_stiffness",
                file=case.location(f"{name}.mesh_stiffness"),
                limit="cases whose mesh stiffness is femgear's own",
                remedy="leave the table out",
            )


def _refuse_foreign(data: Case, problem: Problem, folder: Path, runs: Sequence[str]) -> None:
    """Refuse the journal of the refinement and folders of runs that are another's, before all computing."""
    keys = [variable.keys for variable in problem.variables]
    with open_designs(with_values(data, _QUIET), keys, journal=folder / _JOURNALS[1]):
        pass
    for name in runs:
        if (folder / name).exists():
            with run_folder(folder / name, force=True):
                pass


def _searched(
    data: Case, problem: Problem, method: Method, folder: Path, options: dict[str, Any], progress: Progress
) -> tuple[Optimum, Optimum]:
    """The optimum of the search, and that of the refinement."""
    quiet = options | {"options": replace(options["options"], telling=False), "journal": folder / _JOURNALS[0]}
    rough = minimise(problem, method=method, sensitivity=False, progress=progress, **quiet)
    progress("refinement", 0, 1)
    best = _refined(rough, with_values(data, _QUIET), folder, options, method)
    progress("refinement", 1, 1)
    return rough, best


def _refined(rough: Optimum, case: Case, folder: Path, options: dict[str, Any], method: Method) -> Optimum:
    """The optimum at the positions and on the grid of the case: between few positions errors may hide."""
    problem = replace(rough.problem, case=case)
    local: Method = "auto" if rough.method == "minimax" else "simplex" if method in ("auto", "global") else method
    if any(variable.integer for variable in problem.variables):
        local = "global"
    extent = replace(options["options"], samples=0, starts=1)
    options = options | {"options": extent, "journal": folder / _JOURNALS[1]}
    return minimise(problem, method=local, start=rough.x, **options)


def _write(best_found: Optimum, data: Case, folder: Path, rough: Optimum | None = None) -> list[Block]:
    """Write the files of the search, and tabulate it; ``rough`` is what was refined."""
    best, name, dimension = best_found.values, best_found.problem.objective.name, best_found.problem.objective.dimension
    write_text(to_toml(with_values(data, best)), folder / _FILES[0])
    si = [
        (q.name, q.dimension.si, best_found.before[q.name], best_found.after[q.name])
        for q in best_found.problem.reported
    ]
    write_csv(folder / _FILES[1], ("quantity", "unit", "before", "optimum"), si)
    off = [[t.less[name], t.more[name]] for t in best_found.tolerances]
    less, more = (np.array(off).T / dimension.scale).reshape(2, -1)
    units = [str(t.variable.unit).replace("um", "µm") for t in best_found.tolerances]
    labels = [
        f"{t.variable.name}\n± {t.tolerance:.4g} {unit}" for t, unit in zip(best_found.tolerances, units, strict=True)
    ]
    value, shown = best_found.after[name] / dimension.scale, dimension.shown.replace("um", "µm")
    bars = tolerance_bars(labels, less, more, value, quantity=name, unit=shown)
    save_figure(bars, folder / _FILES[2])
    title = "Before and after" if rough is None else "At the positions and on the grid of the case"
    blocks = [
        Block(title, _COLUMNS, tuple(comparison_rows(best_found))),
        Block("Optimum", ("entry", "value"), tuple((key, str(value)) for key, value in best.items())),
    ]
    if best_found.tolerances:
        header = ("variable", "off by", "less", "more")
        blocks.append(Block(f"{name} with tolerances", header, tuple(tolerance_rows(best_found))))
    notes = [f"at a bound: {variable}" for variable in best_found.at_bounds]
    ended = [f"search: {search_verdict(rough or best_found)}"]
    ended += [] if rough is None else [f"refinement: {search_verdict(best_found)}"]
    return [*blocks, Block("How it was found", notes=(*notes, *ended))]


def _write_front(front: ParetoFront, problem: Problem, second: StudyQuantity, folder: Path) -> Block:
    """Write the files of a Pareto front, and tell its ends and its compromise."""
    both = (problem.objective, second)
    scale = np.array([q.dimension.scale for q in both])
    titles = [f"{q.name} [{q.dimension.shown}]".replace("um]", "µm]") for q in both]
    figure = front_figure(
        front.values / scale,
        front.dominated / scale,
        front.before / scale,
        names=titles,
        compromise=front.compromise,
    )
    save_figure(figure, folder / _FRONT[1])
    header = [f"{v.name} [{v.unit or 1}]" for v in problem.variables]
    header += [*(f"{q.name} [{q.dimension.si}]" for q in both), "findings"]
    codes = [", ".join(dict.fromkeys(finding.code for finding in findings)) for findings in front.findings]
    rows = np.hstack([front.x, front.values]).tolist()
    write_csv(folder / _FRONT[0], header, [[*row, code] for row, code in zip(rows, codes, strict=True)])
    ends = front.values[0], front.values[front.compromise], front.values[-1]
    rows = [tuple(q.show(value) for q, value in zip(both, end, strict=True)) for end in ends]
    title = f"Pareto front, {len(front.values)} designs of {front.designs}: ends and compromise"
    return Block(title, tuple(q.name for q in both), tuple(rows))


def _check(best_found: Optimum, data: Case, folder: Path, speeds: Any, rough: Optimum, run: Run) -> Block:
    """Run case and optimum anew on a finer grid, and read both back from their files."""
    fine: dict[str, Any] = _FINE | _QUIET
    if speeds is not None:
        fine["operation.speeds"] = {"from": speeds[0], "to": speeds[1], "count": 126}
    only = "static" if speeds is None else "housing"
    cases = (with_values(data, values | fine) for values in ({}, best_found.values))
    runs = [run(case, folder / name, only) for name, case in zip(_RUNS, cases, strict=True)]
    numbers = [_numbers(results, only) for results in runs]
    rows = [(name, before, numbers[1][name][0], unit) for name, (before, unit) in numbers[0].items()]
    write_csv(folder / _CHECK[0], ("quantity", "before", "optimum", "unit"), rows)
    dynamic, notes = dict[str, Any](), []
    if speeds is not None:
        dynamic["speed"] = runs[0].dynamics["speed"].values
        dynamic["forces"] = [_forces(results.dynamics) for results in runs]
        for name, results in zip(("before", "optimum"), runs, strict=True):
            unstable = int((~results.dynamics["stable"].values).sum())
            notes.append(f"{name}: unstable at {unstable} of {len(dynamic['speed'])} speeds")
    position = runs[0].static["position"].values
    errors = [results.static["ste_overall"].values[0] for results in runs]
    course = [value / (rough.before[rough.problem.objective.name] or 1.0) for value in rough.course]
    save_figure(before_and_after(position, errors, **dynamic, costs=course), folder / _CHECK[1])
    shown = tuple(
        (n, f"{b:.5g} {unit}", f"{a:.5g} {unit}", percent(a / b - 1, 1, signed=True)) for n, b, a, unit in rows
    )
    return Block("Computed anew: 128 positions, 32 elements along a flank", _COLUMNS, shown, tuple(notes))


def _numbers(results: Any, only: str) -> dict[str, tuple[float, str]]:
    """Largest values of a run by name, with their units."""
    static = results.static
    numbers = {"STE peak to peak, overall": (1e6 * static["ste_overall_peak_to_peak"].values.max(), "um")}
    for kind in ("sun-planet", "planet-ring"):
        rows = ["ring" in name if kind == "planet-ring" else "sun" in name for name in static["mesh"].values]
        numbers[f"STE peak to peak, {kind}"] = (1e6 * static["ste_peak_to_peak"].values[rows].max(), "um")
    if only == "housing":
        dynamics = results.dynamics
        numbers["dynamic mesh force"] = (_forces(dynamics).max(), "N")
        numbers["peak mesh force"] = (_forces(dynamics, dynamic=False).max(), "N")
        lines = stored_lines(results.housing, form="exact")
        numbers["housing level"] = (np.abs(lines.acceleration).max(), "m/s^2")
    return numbers


def _forces(dynamics: xr.Dataset, *, dynamic: bool = True) -> np.ndarray:
    """Largest deviation of any mesh force from its mean, or largest force, at every speed [N]."""
    return forces_over_time(stored_harmonics(dynamics, "mesh_force"), dynamic=dynamic).max(axis=1)
