"""A whole run: every stage computed, written, drawn and reported in one folder."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femgear.report.page import page, write_pictures, write_report
from femgear.storage.files import write_dataset, write_text
from femgear.storage.results import additions, finish, folder_lock, record
from femgear.trains.protocol import Drawn, Progress, Stage, one_blas_thread, silent
from femgear.trains.reading import open_results
from femgear.trains.registry import check_case, stages_of, train_of

if TYPE_CHECKING:
    from femgear.case.sections import Case


def grid_cache() -> Path:
    """Find the folder of generated grids: FEMGEAR_MESHES, meshes/ of a source tree, or the user's cache."""
    if given := os.environ.get("FEMGEAR_MESHES"):
        return Path(given)
    beside = Path(__file__).parents[1] / "meshes"
    if beside.is_dir() and (beside.parent / "pyproject.toml").is_file():
        return beside
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "femgear" / "meshes"


class Solution(dict[str, Any]):
    """Results of the computed stages by name, in order."""

    def __repr__(self) -> str:
        return f"<Solution: {', '.join(self) or 'no stage'}>"

    def __missing__(self, name: str):
        raise KeyError(f"{name!r} was not computed: there are {', '.join(self) or 'no stages'}")


def solve(
    case: Any,
    only: str | None = None,
    *,
    progress: Progress = silent,
    done: Callable[[Stage, Any, float], None] | None = None,
) -> Solution:
    """Compute the stages of a case in memory: transmission error, modes, vibration, whatever its train has.

    Parameters
    ----------
    case : case of any train
        From `femgear.read_case`.
    only : str, optional
        Last stage to compute; it is computed with what it needs.
    progress : callable, optional
        Called with (stage, done, total).
    done : callable, optional
        Called with every stage, its result and its seconds as soon as it is computed.

    Returns
    -------
    Solution
        Results by the name of the stage, in order; ``dataset()`` of each has its numbers with units.

    Raises
    ------
    CaseError, GeometryError
        Before anything is computed: what the stages cannot represent; E-STAGE: no such stage.
    """
    check_case(case, only)
    stages = stages_of(case, only)
    if only is not None:
        case = stages[-1].asked(case)
    results, options = Solution(), {"cache": grid_cache(), "progress": progress}
    with one_blas_thread():
        for stage in stages:
            progress(stage.name, 0, 1)
            start = time.perf_counter()
            given = {name: options[name] for name in stage.options}
            results[stage.name] = stage.solve(case, *map(results.get, stage.takes), **given)
            if done is not None:
                done(stage, results[stage.name], time.perf_counter() - start)
            progress(stage.name, 1, 1)
    return results


def run_case(
    case: Case,
    folder: Path,
    *,
    only: str | None = None,
    pictures: bool = True,
    progress: Progress = silent,
) -> None:
    """Compute a case and write its results.

    Parameters
    ----------
    folder : path
        From `femgear.storage.results.run_folder`; its manifest says after every stage what is there.
    only : str, optional
        Last stage to compute, whatever the case says of it.
    pictures : bool
        Draw figures, fields and report.
    progress : callable, optional
        Called with (stage, done, total).
    """
    check_case(case, only)
    write_text(case.source, folder / "case.toml")
    names, timings, convergence, data = ["case.toml"], {}, {}, {}
    record(folder, names, timings=timings, convergence=convergence)

    def write(stage: Stage, result: Any, seconds: float) -> None:
        data[stage.name] = result.dataset()
        write_dataset(data[stage.name], folder / f"{stage.name}.nc")
        names.append(f"{stage.name}.nc")
        timings[stage.name], convergence[stage.name] = seconds, stage.verdict(result)
        record(folder, names, timings=timings, convergence=convergence)

    results = solve(case, only, progress=progress, done=write)
    if pictures:
        start = time.perf_counter()
        drawn = Drawn(case, data, results, grid_cache())
        names += write_pictures(folder, train_of(case), drawn, progress=progress)
        timings["pictures"] = time.perf_counter() - start
    finish(folder, names, timings=timings, convergence=convergence)
    if pictures:
        write_report(train_of(case), open_results(folder))
        finish(folder, [*names, "report.html"], timings=timings, convergence=convergence)


def report_again(folder: Path) -> None:
    """Write report.html of a complete run anew, with figures where it drew none; update the manifest."""
    with folder_lock(folder):
        results = open_results(folder, partial=False)
        train = train_of(results.case)
        if not any(name.endswith(".png") for name in results.manifest.files):
            data = {stage: results[stage] for stage in results.stages}
            with additions(results.folder) as new:
                write_pictures(new, train, Drawn(results.case, data), progress=silent)
            results = open_results(folder)
        with additions(results.folder) as new:
            write_text(page(train, results), new / "report.html")
