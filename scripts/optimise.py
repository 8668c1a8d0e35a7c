#!/usr/bin/env python3
"""Best values of some entries of the case file, checked by a run of its own."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

ERRORS = ("ste overall", "ste sun-planet", "ste planet-ring")
FORCES = ("mesh force", "peak mesh force", "housing")
QUIET = {"static.stresses": False, "housing.published": None}
COLUMNS = ("quantity", "before", "optimum", "change")
FILES = ("optimum.toml", "optimum.csv", "tolerances.png")
FRONT, CHECK = ("front.csv", "front.png"), ("check.csv", "optimum.png")
JOURNALS, RUNS = ("journal.jsonl", "journal_fine.jsonl"), ("before", "after")


@Parameter(name="*")
@dataclass(frozen=True)
class Task:
    """What is searched.

    Parameters
    ----------
    vary
        Design variable, as in "sun.modifications[0].amount=0 um..15 um +- 1 um" with its tolerance; may be
        repeated. Default: a tip relief more on every loaded flank, its amount and its start.
    objective
        What to minimise: ste (largest of the next three), ste overall, ste sun-planet, ste planet-ring, mesh
        force, peak mesh force, housing, contact pressure, root stress sun (planet, ring), contact ratio
        sun-planet (planet-ring), tip thickness sun (planet, ring).
    limit
        As in "root stress sun <= 300 MPa"; of the same quantities. May be repeated.
    of
        Further quantities to report; may be repeated. Default: transmission errors, mesh forces, housing.
    second
        Second objective: the Pareto front of both is searched as well.
    torque
        Of the input, with its unit. Default: that of the case.
    speeds
        First and last speed of the input, for mesh forces and the housing.
    """

    vary: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    objective: str = "ste"
    limit: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    of: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    second: str | None = None
    torque: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None
    speeds: tuple[str, str] = ("1000 rpm", "3500 rpm")


@Parameter(name="*")
@dataclass(frozen=True)
class Extent:
    """How far the search goes.

    Parameters
    ----------
    method
        Of the search; auto takes derivatives where the problem has them.
    positions
        Positions over one mesh period in the search; the refinement takes those of the case, the check 128.
    flank_elements
        Elements along a flank in the search; the refinement takes those of the case, the check 32.
    samples
        Designs before the descents. Default: five a variable.
    max_designs
        Designs after which search and refinement end.
    seed
        Of the samples.
    check
        Run case and optimum anew into the folders before and after.
    workers
        Processes of this machine that compute samples, generations and tolerances.
    cluster
        Dask scheduler whose workers compute them: tcp://host:port or tls://host:port (docs/cluster.md).
    """

    method: Literal["auto", "minimax", "global", "simplex", "powell"] = "auto"
    positions: int = 24
    flank_elements: int = 12
    samples: int | None = None
    max_designs: int | None = None
    seed: int = 0
    check: bool = True
    workers: int = 1
    cluster: str | None = None


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/optimise"),
    task: Task = Task(),
    extent: Extent = Extent(),
) -> None:
    """Search with few positions on a coarse grid, refine with those of the case, check on a finer one.

    Every design is kept in the journals of the output folder: the same command goes on where an interrupted
    one was. The optimum is written as a case file.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out.
    output
        Folder of the results.
    """
    from femgear.case.gear_set import need_set
    from femgear.storage.files import resumable
    from femgear.study.front import check_second
    from femgear.study.objectives import named_quantity
    from femgear.study.runner import open_runner
    from femgear.trains.reading import read_case, with_value

    data = read_case(case)
    need_set(data)
    data = data if task.torque is None else with_value(data, "operation.torque", task.torque)
    _check_request(data, extent)
    data, problem = _problem(data, task, extent)
    another = None if task.second is None else named_quantity(task.second, speeds=task.speeds)
    if another is not None:
        check_second(problem, another)
    names = [*FILES, *(FRONT if another else ()), *(CHECK if extent.check else ())]
    folder = ready_folder(output, names)
    _refuse_foreign(data, problem, folder, RUNS if extent.check else ())
    with resumable(folder):
        with open_runner(extent.workers, extent.cluster) as runner:
            rough, found, options = _searched(data, problem, extent, folder, runner)
            _write(found, data, folder, rough)
            if another is not None:
                _front(problem, another, folder, options | {"start": rough.x})
        if extent.check:
            _check(found, data, folder, None if data.rigid else task.speeds, rough)
    say_files(folder, [*names, *JOURNALS, *(RUNS if extent.check else ())])


def _searched(data, problem, extent: Extent, folder: Path, runner):
    """The optimum of the search, that of the refinement, and the options of the search."""
    from femgear.run import grid_cache
    from femgear.study.search import SearchOptions, minimise
    from femgear.trains.reading import with_values

    counts = SearchOptions(seed=extent.seed, samples=extent.samples, max_designs=extent.max_designs)
    options = {"options": counts, "cache": grid_cache(), "runner": runner}
    coarsely = options | {"journal": folder / JOURNALS[0]}
    with Progress() as progress:
        quiet = coarsely | {"options": replace(counts, telling=False)}
        rough = minimise(problem, method=extent.method, sensitivity=False, progress=progress, **quiet)
        progress("refinement", 0, 1)
        found = _refined(rough, with_values(data, QUIET), folder, options, extent.method)
        progress("refinement", 1, 1)
    return rough, found, coarsely


def _problem(data, task: Task, extent: Extent):
    """The case with its variables, and the problem on a coarse grid."""
    from femgear.study.objectives import named_quantity
    from femgear.study.problem import Problem, parse_limit, parse_variable, tip_reliefs
    from femgear.trains.reading import with_values

    variables = tuple(parse_variable(text) for text in task.vary)
    if not variables:
        data, variables = tip_reliefs(data)
    fast = {"static.positions": extent.positions, "static.flank_elements": extent.flank_elements}
    reported = task.of or (*ERRORS, *(() if data.rigid else FORCES))
    first, *others = (named_quantity(words, speeds=task.speeds) for words in (task.objective, *reported))
    limits = [parse_limit(text, speeds=task.speeds) for text in task.limit]
    return data, Problem(with_values(data, fast | QUIET), variables, first, also=others, limits=limits)


def _check_request(case, extent: Extent) -> None:
    """Refuse at once what no search can do."""
    for name in ("samples", "max_designs", "positions", "flank_elements"):
        value = getattr(extent, name)
        least = 2 if name == "max_designs" else 1
        if value is not None and not least <= value <= 1_000_000:
            key = f"--{name.replace('_', '-')}"
            raise CaseError("not usable", code="E-RANGE", key=key, value=value, limit=f"{least} to 1000000")
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
                limit="cases whose mesh stiffness is femgear's own",
                remedy="leave the table out",
            )


def _refined(rough, case, folder: Path, options, method: str):
    """The optimum at the positions and on the grid of the case: between few positions errors may hide."""
    from femgear.study.search import minimise

    problem = replace(rough.problem, case=case)
    local = "auto" if rough.method == "minimax" else "simplex" if method in ("auto", "global") else method
    if any(variable.integer for variable in problem.variables):
        local = "global"
    extent = replace(options["options"], samples=0, starts=1)
    options = options | {"options": extent, "journal": folder / JOURNALS[1]}
    return minimise(problem, method=local, start=rough.x, **options)


def _write(found, data, folder: Path, rough) -> None:
    """Tables on the terminal, and the files of the search."""
    from femgear.report.style import save_figure
    from femgear.storage.files import write_text
    from femgear.study.search import comparison_rows, tolerance_rows, verdict
    from femgear.trains.reading import to_toml, with_values

    best, name, dimension = found.values, found.problem.objective.name, found.problem.objective.dimension
    write_text(to_toml(with_values(data, best)), folder / "optimum.toml")
    rows = [(name, before, after, change) for name, before, after, change in comparison_rows(found)]
    print_table("At the positions and on the grid of the case", COLUMNS, rows)
    print_table("Optimum", ("entry", "value"), [(key, str(value)) for key, value in best.items()])
    if found.tolerances:
        header = ("variable", "off by", "less", "more")
        print_table(f"{name} with tolerances", header, tolerance_rows(found))
    for variable in found.at_bounds:
        print(f"at a bound: {variable}")
    print(f"search: {verdict(rough)}\nrefinement: {verdict(found)}")
    si = [(q.name, q.dimension.si, found.before[q.name], found.after[q.name]) for q in found.problem.reported]
    write_csv(folder / "optimum.csv", ("quantity", "unit", "before", "optimum"), si)
    off = [[t.less[name], t.more[name]] for t in found.tolerances]
    less, more = (np.array(off).T / dimension.scale).reshape(2, -1)
    units = [str(t.variable.unit).replace("um", "µm") for t in found.tolerances]
    labels = [f"{t.variable.name}\n± {t.tolerance:.4g} {unit}" for t, unit in zip(found.tolerances, units)]
    value = found.after[name] / dimension.scale
    bars = tolerance_bars(labels, less, more, value, quantity=name, unit=dimension.shown.replace("um", "µm"))
    save_figure(bars, folder / "tolerances.png")


def _front(problem, second, folder: Path, options) -> None:
    from femgear.report.style import save_figure
    from femgear.study.front import pareto_front

    with Progress() as progress:
        found = pareto_front(problem, second, progress=progress, **options)
    both = (problem.objective, second)
    scale = np.array([q.dimension.scale for q in both])
    titles = [f"{q.name} [{q.dimension.shown}]".replace("um]", "µm]") for q in both]
    figure = front_figure(
        found.values / scale,
        found.dominated / scale,
        found.before / scale,
        names=titles,
        compromise=found.compromise,
    )
    save_figure(figure, folder / "front.png")
    header = [f"{v.name} [{v.unit or 1}]" for v in problem.variables]
    header += [*(f"{q.name} [{q.dimension.si}]" for q in both), "findings"]
    codes = [", ".join(dict.fromkeys(one.code for one in findings)) for findings in found.findings]
    rows = np.hstack([found.x, found.values]).tolist()
    write_csv(folder / "front.csv", header, [[*row, code] for row, code in zip(rows, codes)])
    low, high = (found.values[i] for i in (0, -1))
    print(f"front: {len(found.values)} designs of {found.designs}, from")
    for end in (low, found.values[found.compromise], high):
        print("  " + ", ".join(f"{q.name} {q.show(value)}" for q, value in zip(both, end)))


def _check(found, data, folder: Path, speeds, rough) -> None:
    """Case and optimum anew: a full run each on a finer grid, read back from its files."""
    from femgear.report.style import save_figure
    from femgear.trains.reading import with_values

    fine = {"static.positions": 128, "static.flank_elements": 32} | QUIET
    if speeds is not None:
        fine["operation.speeds"] = {"from": speeds[0], "to": speeds[1], "count": 126}
    only = "static" if speeds is None else "housing"
    runs = [
        _run(with_values(data, values | fine), folder / name, only) for name, values in zip(RUNS, ({}, found.values))
    ]
    numbers = [_numbers(results, only) for results in runs]
    rows = [(name, before, numbers[1][name][0], unit) for name, (before, unit) in numbers[0].items()]
    shown = [(n, f"{b:.5g} {unit}", f"{a:.5g} {unit}", f"{a / b - 1:+.1%}") for n, b, a, unit in rows]
    print_table("Computed anew: 128 positions, 32 elements along a flank", COLUMNS, shown)
    write_csv(folder / "check.csv", ("quantity", "before", "optimum", "unit"), rows)
    errors = [results.static["ste_overall"].values[0] for results in runs]
    dynamic = {}
    if speeds is not None:
        dynamic["speed"] = runs[0].dynamics["speed"].values
        dynamic["forces"] = [_dynamic_force(results.dynamics) for results in runs]
        for name, results in zip(("before", "optimum"), runs):
            unstable = int((~results.dynamics["stable"].values).sum())
            print(f"{name}: unstable at {unstable} of {len(dynamic['speed'])} speeds")
    position = runs[0].static["position"].values
    save_figure(
        before_and_after(position, errors, **dynamic, costs=_costs(rough)),
        folder / "optimum.png",
    )


def _refuse_foreign(data, problem, folder: Path, runs: Sequence[str]) -> None:
    """Refuse the journal of the refinement and folders of runs that are another's, before all computing."""
    from femgear.storage.results import run_folder
    from femgear.study.designs import open_designs
    from femgear.trains.reading import with_values

    keys = [variable.keys for variable in problem.variables]
    with open_designs(with_values(data, QUIET), keys, journal=folder / JOURNALS[1]):
        pass
    for name in runs:
        if (folder / name).exists():
            with run_folder(folder / name, force=True):
                pass


def _run(case, folder: Path, only: str):
    from femgear.run import run_case
    from femgear.storage.results import run_folder
    from femgear.trains.reading import open_results

    with run_folder(folder, force=True) as place, Progress() as progress:
        run_case(case, place, only=only, pictures=False, progress=progress)
    return open_results(folder, partial=False)


def _numbers(results, only: str) -> dict[str, tuple[float, str]]:
    """Largest values of a run by name, with their units."""
    from femgear.housing.sensor import stored_lines

    static = results.static
    found = {"STE peak to peak, overall": (1e6 * static["ste_overall_peak_to_peak"].values.max(), "um")}
    for kind in ("sun-planet", "planet-ring"):
        rows = ["ring" in name if kind == "planet-ring" else "sun" in name for name in static["mesh"].values]
        found[f"STE peak to peak, {kind}"] = (1e6 * static["ste_peak_to_peak"].values[rows].max(), "um")
    if only == "housing":
        dynamics = results.dynamics
        found["dynamic mesh force"] = (_dynamic_force(dynamics).max(), "N")
        found["peak mesh force"] = (_history(dynamics).max(), "N")
        lines = stored_lines(results.housing, form="exact")
        found["housing level"] = (np.abs(lines.acceleration).max(), "m/s^2")
    return found


def _history(dynamics) -> np.ndarray:
    """Mesh forces over a period, (speed, mesh, time) [N], from ``Re sum F_h exp(i h omega t)``."""
    lines = dynamics["mesh_force_real"].values + 1j * dynamics["mesh_force_imag"].values
    harmonic = np.arange(lines.shape[-1])
    turn = np.exp(2j * np.pi * np.outer(harmonic, np.arange(360) / 360))
    return np.real(lines @ turn)


def _dynamic_force(dynamics) -> np.ndarray:
    """Largest deviation of any mesh force from its mean at every speed [N]."""
    history = _history(dynamics)
    return np.abs(history - history.mean(axis=-1, keepdims=True)).max(axis=(1, 2))


def _costs(found) -> list[float]:
    """Objective over that of the case, in the order of the search."""
    return [value / (found.before[found.problem.objective.name] or 1.0) for value in found.course]


def before_and_after(position, errors, speed=None, forces=None, *, costs=()):
    """Transmission error over the mesh period, dynamic mesh force over speed, and course of the search.

    Parameters
    ----------
    position : (P,) array
        In mesh periods.
    errors : sequence of two (P,) arrays
        From sun to ring [m], before and after; their means are taken off.
    speed : (S,) array, optional
        Of the input [rpm].
    forces : sequence of two (S,) arrays, optional
        Largest dynamic part of any mesh [N].
    costs : (designs,) array
        Objective over that of the case, in the order of the search; NaN for designs outside the limits.
    """
    from femgear.report.style import BLUE, GREY, label, legend_below, new_figure, periodic

    styles = (
        {"color": GREY, "linestyle": "--", "label": "before"},
        {"color": BLUE, "linestyle": "-", "label": "optimum"},
    )
    columns = 1 + (speed is not None) + bool(len(costs))
    figure, axes = new_figure(columns=columns, width=4.2 * columns + 1.0, height=4.4)
    for values, line in zip(errors, styles):
        place, closed = periodic(position, 1e6 * (np.asarray(values) - np.mean(values)))
        axes[0].plot(place, closed, linewidth=1.6, **line)
    label(axes[0], "position [mesh periods]", "transmission error less its mean [µm]", "sun to ring, static")
    if speed is not None:
        for values, line in zip(forces, styles):
            axes[1].plot(speed, values, linewidth=1.6, **line)
        axes[1].set_ylim(bottom=0)
        label(axes[1], "speed of the input [rpm]", "largest deviation from the mean [N]", "mesh force")
    if len(costs):
        _course(axes[-1], np.asarray(costs, float))
    legend_below(figure)
    return figure


def _course(ax, costs: np.ndarray) -> None:
    """Every design, and the best so far."""
    from femgear.report.style import GREY, VERMILION, label

    number = np.arange(1, len(costs) + 1)
    best = np.minimum.accumulate(np.where(np.isfinite(costs), costs, np.inf))
    shown = np.isfinite(best)
    ax.semilogy(number, costs, ".", color=GREY, markersize=4, label="designs")
    ax.step(number[shown], best[shown], where="post", color=VERMILION, linewidth=1.6, label="best so far")
    label(ax, "design", "objective over that of the case [1]", "search at few positions")


def tolerance_bars(names: Sequence[str], less, more, value: float, *, quantity: str, unit: str):
    """What the objective becomes with each variable off by its tolerance.

    Parameters
    ----------
    names : sequence of str
        Variables with their tolerances.
    less, more : (n,) arrays
        Objective with the variable lower and higher, in `unit`; NaN leaves a bar out.
    value : float
        Of the optimum.
    quantity, unit : str
    """
    from femgear.report.style import BLACK, BLUE, VERMILION, label, legend_below, new_figure

    n = len(names)
    figure, (ax,) = new_figure(width=9.0, height=1.4 + 0.45 * n)
    place = np.arange(n)[::-1]
    for values, shift, colour, text in ((less, 0.19, BLUE, "less"), (more, -0.19, VERMILION, "more")):
        values = np.asarray(values, float)
        ax.barh(place + shift, values, height=0.36, color=colour, label=text)
    ax.axvline(value, color=BLACK, linewidth=1.2, label="optimum")
    ax.set_yticks(place, names)
    ax.grid(False, axis="y")
    label(ax, f"{quantity} [{unit}]")
    legend_below(figure)
    return figure


def front_figure(values, dominated, before, *, names: Sequence[str], compromise: int | None = None):
    """Pareto front with the other designs.

    Parameters
    ----------
    values : (m, 2) array
        Front, in the units of `names`.
    dominated : (k, 2) array
    before : (2,) array
        The case as it is.
    names : sequence of two str
        Axis labels with units.
    compromise : int, optional
        Row of the front to be marked.
    """
    from femgear.report.style import BLACK, BLUE, VERMILION, label, legend_below, new_figure

    values, dominated = np.asarray(values, float), np.asarray(dominated, float).reshape(-1, 2)
    figure, (ax,) = new_figure(width=7.0, height=4.8)
    ax.plot(*dominated.T, ".", color="0.75", markersize=4, label="other designs")
    ax.step(*values.T, where="post", color=BLUE, linewidth=1.2)
    ax.plot(*values.T, "o", color=BLUE, markersize=5, label="front")
    ax.plot(*before, "s", color=BLACK, markersize=7, label="before")
    if compromise is not None:
        ax.plot(*values[compromise], "o", color=VERMILION, markersize=10, fillstyle="none", label="compromise")
    # designs far beyond both are of no interest
    right, top = 1.1 * np.maximum(values.max(axis=0), before)
    ax.set_xlim(0, right)
    ax.set_ylim(0, top)
    label(ax, *(fill(name, 44) for name in names))
    legend_below(figure)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
