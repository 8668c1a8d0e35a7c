"""A whole run: every stage computed, written, drawn and reported in one folder."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

from femgear.case.case import planetary_set, set_deviations
from femgear.storage.files import write_dataset, write_text
from femgear.storage.results import finish, record
from femgear.trains import protocol
from femgear.trains.drivetrain.section import DrivetrainCase
from femgear.trains.registry import KINDS, check_case, kind_of, stages_of

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


def run_case(
    case: Case,
    folder: Path,
    *,
    only: str | None = None,
    pictures: bool = True,
    progress: protocol.Progress | None = None,
) -> None:
    """Compute a case and write its results.

    Parameters
    ----------
    case : Case
    folder : path
        From `storage.run_folder`; its manifest says after every stage what is there.
    only : str, optional
        Last stage to compute, one of `trains.registry.KINDS`; ``"stress"`` computes the stresses
        whatever ``static.stresses`` says.
    pictures : bool
        Draw figures, fields and report.
    progress : callable, optional
        Called with (stage, done, total).
    """
    from femgear.threads import one_blas_thread

    cache = grid_cache()
    check_case(case, only)
    if only == "stress":
        case = case.model_copy(update={"static": case.static.model_copy(update={"stresses": True})})
    write_text(case.source, folder / "case.toml")
    names, timings, convergence = ["case.toml"], {}, {}
    record(folder, names, timings=timings, convergence=convergence)
    results, data = {}, {}
    with one_blas_thread():
        for stage in _stages(case, only):
            if progress is not None:
                progress(stage, 0, 1)
            start = time.perf_counter()
            results[stage] = _compute(stage, case, results, cache, progress)
            timings[stage] = time.perf_counter() - start
            data[stage] = results[stage].dataset()
            write_dataset(data[stage], folder / f"{stage}.nc")
            names.append(f"{stage}.nc")
            convergence[stage] = _convergence(stage, results[stage], kind_of(case))
            record(folder, names, timings=timings, convergence=convergence)
            if progress is not None:
                progress(stage, 1, 1)
    if pictures:
        from femgear.report.draw import write_pictures

        start = time.perf_counter()
        names += write_pictures(folder, case, results, data=data, cache=cache, progress=progress)
        timings["pictures"] = time.perf_counter() - start
    finish(folder, names, timings=timings, convergence=convergence)
    if pictures:
        from femgear.report.html import write_report

        write_report(folder)
        finish(folder, [*names, "report.html"], timings=timings, convergence=convergence)


def _stages(case: Case, only: str | None) -> tuple[str, ...]:
    """Stages to compute, in order."""
    return stages_of(case, only)


def _compute(stage, case, results, cache, progress):
    """One stage from those before it."""
    return KINDS[kind_of(case)].stages[stage].compute(case, results, cache, progress)


def _convergence(stage, result, kind) -> dict:
    """What a stage says about its own trustworthiness, for the manifest."""
    return KINDS[kind].stages[stage].verdict(result)


def report_again(folder: Path) -> None:
    """Write report.html anew, with its figures where the run drew none, and bring the manifest up to date.

    Parameters
    ----------
    folder : path
        Results of a complete run.
    """
    from femgear.report.draw import write_figures
    from femgear.report.html import write_report
    from femgear.storage.results import folder_lock, open_results
    from femgear.trains.drivetrain.figures import write_drivetrain_pictures

    with folder_lock(folder):
        results = open_results(folder, partial=False)
        manifest = results.manifest
        names = [name for name in manifest.files if name != "report.html"]
        if not any(name.endswith(".png") for name in names):
            data = {stage: getattr(results, stage) for stage in results.stages}
            case = results.case
            if isinstance(case, DrivetrainCase):
                names += write_drivetrain_pictures(results.folder, case, data)
            else:
                names += write_figures(
                    results.folder, planetary_set(case), data, deviations=set_deviations(case)
                )
            finish(folder, names, timings=manifest.timings, convergence=manifest.convergence)
        write_report(folder)
        finish(folder, [*names, "report.html"], timings=manifest.timings, convergence=manifest.convergence)
