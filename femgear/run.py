"""A whole run: every stage computed, written, drawn and reported in one folder."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femgear.report.html import write_report
from femgear.report.style import save_figure
from femgear.storage.files import write_dataset, write_text
from femgear.storage.results import finish, folder_lock, record
from femgear.trains.protocol import Context, Drawn, Figures, Progress, Stage, Train, one_blas_thread
from femgear.trains.reading import open_results
from femgear.trains.registry import check_case, stages_of, train_of

if TYPE_CHECKING:
    from femgear.case.sections import Case


def grid_cache() -> Path:
    """Folder of generated grids: FEMGEAR_MESHES, else meshes/ of a source tree, else the user's cache."""
    if given := os.environ.get("FEMGEAR_MESHES"):
        return Path(given)
    beside = Path(__file__).parents[1] / "meshes"
    if beside.is_dir() and (beside.parent / "pyproject.toml").is_file():
        return beside
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "femgear" / "meshes"


def solve(case: Any, only: str | None = None, *, progress: Progress | None = None) -> dict[str, Any]:
    """Compute the stages of a case in memory: transmission error, modes, vibration, whatever its train has.

    Parameters
    ----------
    case : case of any train
        From `femgear.read_case`.
    only : str, optional
        Last stage to compute; it is computed with what it needs.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    dict of str to result
        By the name of the stage, in order; ``dataset()`` of each has its numbers with units.

    Raises
    ------
    CaseError, GeometryError
        Before anything is computed: what the stages cannot represent; E-STAGE: no such stage.
    """
    check_case(case, only)
    context = Context(grid_cache(), progress)
    return {stage.name: result for stage, result, _ in _solved(case, only, context)}


def _solved(case: Any, only: str | None, context: Context) -> Iterator[tuple[Stage, Any, float]]:
    """Stages of a case with their results and seconds, one after the other."""
    stages = stages_of(case, only)
    if only is not None:
        case = stages[-1].asked(case)
    results, say = {}, context.progress or (lambda name, done, total: None)
    with one_blas_thread():
        for stage in stages:
            say(stage.name, 0, 1)
            start = time.perf_counter()
            results[stage.name] = stage.solve(case, results, context)
            yield stage, results[stage.name], time.perf_counter() - start
            say(stage.name, 1, 1)


def run_case(
    case: Case,
    folder: Path,
    *,
    only: str | None = None,
    pictures: bool = True,
    progress: Progress | None = None,
) -> None:
    """Compute a case and write its results.

    Parameters
    ----------
    case : Case
    folder : path
        From `run_folder`; its manifest says after every stage what is there.
    only : str, optional
        Last stage to compute, whatever the case says of it.
    pictures : bool
        Draw figures, fields and report.
    progress : callable, optional
        Called with (stage, done, total).
    """
    cache = grid_cache()
    check_case(case, only)
    write_text(case.source, folder / "case.toml")
    names, timings, convergence = ["case.toml"], {}, {}
    record(folder, names, timings=timings, convergence=convergence)
    results, data = {}, {}
    for stage, result, seconds in _solved(case, only, Context(cache, progress)):
        name = stage.name
        results[name], timings[name] = result, seconds
        data[name] = result.dataset()
        write_dataset(data[name], folder / f"{name}.nc")
        names.append(f"{name}.nc")
        convergence[name] = stage.verdict(result)
        record(folder, names, timings=timings, convergence=convergence)
    if pictures:
        start = time.perf_counter()
        drawn = Drawn(case, data, results, cache)
        names += write_pictures(folder, train_of(case), drawn, progress=progress)
        timings["pictures"] = time.perf_counter() - start
    finish(folder, names, timings=timings, convergence=convergence)
    if pictures:
        write_report(train_of(case), open_results(folder))
        finish(folder, [*names, "report.html"], timings=timings, convergence=convergence)


def report_again(folder: Path) -> None:
    """Write report.html anew, with its figures where the run drew none, and bring the manifest up to date.

    Parameters
    ----------
    folder : path
        Results of a complete run.
    """
    with folder_lock(folder):
        results = open_results(folder, partial=False)
        manifest, train = results.manifest, train_of(results.case)
        names = [name for name in manifest.files if name != "report.html"]
        if not any(name.endswith(".png") for name in names):
            data = {stage: results.stage(stage) for stage in results.stages}
            names += write_pictures(results.folder, train, Drawn(results.case, data))
            finish(folder, names, timings=manifest.timings, convergence=manifest.convergence)
        write_report(train, open_results(folder))
        finish(folder, [*names, "report.html"], timings=manifest.timings, convergence=manifest.convergence)


def write_figures(folder: Path, train: Train, drawn: Drawn) -> list[str]:
    """Write the figures of the stages whose data are there, and of the case; returns the file names."""
    figures = {}
    for stage in _drawn(train, drawn):
        figures |= stage.draw(drawn)
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png")
    return [f"{name}.png" for name in figures]


def _drawn(train: Train, drawn: Drawn) -> list[Figures]:
    """List the figures of the stages whose data are there, in their order, and of the case."""
    names = [*(stage.name for stage in train.stages if stage.name in drawn.data), ""]
    return [train.figures[name] for name in names if name in train.figures]


def write_pictures(
    folder: Path, train: Train, drawn: Drawn, *, progress: Progress | None = None
) -> list[str]:
    """Write everything that a run shows; returns the names of the files.

    Parameters
    ----------
    folder : path
    train : Train
        Of the case.
    drawn : Drawn
    progress : callable, optional
        Called with (stage, done, total).
    """
    written = [w for stage in _drawn(train, drawn) for w in stage.write]
    steps = [
        lambda: write_figures(folder, train, drawn), *(lambda w=w: w(drawn, folder) for w in written),
    ]  # fmt: skip
    names = []
    for done, step in enumerate(steps):
        if progress is not None:
            progress("pictures", done, len(steps))
        names += step()
    if progress is not None:
        progress("pictures", len(steps), len(steps))
    return names
