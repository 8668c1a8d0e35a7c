"""A whole run: every stage computed, written, drawn and reported in one folder."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear import analysis
from femgear.case import planetary_set, set_deviations
from femgear.storage import finish, record, write_dataset, write_text

if TYPE_CHECKING:
    from femgear.case import Case

STAGES = ("static", "stress", "modes", "dynamics", "housing")


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
    progress: analysis.Progress | None = None,
) -> None:
    """Compute a case and write its results.

    Parameters
    ----------
    case : Case
    folder : path
        From `storage.run_folder`; its manifest says after every stage what is there.
    only : {"static", "stress", "modes", "dynamics", "housing"}, optional
        Last stage to compute; ``"stress"`` computes the stresses whatever ``static.stresses`` says.
    pictures : bool
        Draw figures, fields and report.
    progress : callable, optional
        Called with (stage, done, total).
    """
    from femgear.threads import one_blas_thread

    cache = grid_cache()
    if only not in ("static", "stress"):
        analysis.check_dynamic_case(case, planetary_set(case))
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
            convergence[stage] = _convergence(stage, results[stage])
            record(folder, names, timings=timings, convergence=convergence)
            if progress is not None:
                progress(stage, 1, 1)
    if pictures:
        from femgear.pictures import write_pictures

        start = time.perf_counter()
        names += write_pictures(
            folder,
            case,
            static=results["static"],
            modes=results.get("modes"),
            dynamics=results.get("dynamics"),
            data=data,
            cache=cache,
            progress=progress,
        )
        timings["pictures"] = time.perf_counter() - start
    finish(folder, names, timings=timings, convergence=convergence)
    if pictures:
        from femgear.report import write_report

        write_report(folder)
        finish(folder, [*names, "report.html"], timings=timings, convergence=convergence)


def _stages(case: Case, only: str | None) -> tuple[str, ...]:
    """Stages to compute, in order."""
    last = STAGES.index(only) if only else len(STAGES) - 1
    return tuple(stage for stage in STAGES[: last + 1] if stage != "stress" or case.static.stresses)


def _compute(stage, case, results, cache, progress):
    """One stage from those before it."""
    if stage == "static":
        return analysis.solve_static(case, cache=cache, progress=progress)
    if stage == "stress":
        from femgear.analysis_stress import solve_stress

        return solve_stress(case, results["static"], progress=progress)
    if stage == "modes":
        return analysis.solve_modes(case, results["static"])
    if stage == "dynamics":
        return analysis.solve_dynamics(case, results["static"], results["modes"], progress=progress)
    return analysis.solve_housing(case, results["dynamics"])


def _convergence(stage, result) -> dict:
    """What a stage says about its own trustworthiness, for the manifest."""
    if stage == "static":
        cycle = result.cycle
        return {"residual": float(cycle.residual.max()), "message": cycle.message, "contact": cycle.contact}
    if stage == "stress":
        return {"root_points": sum(len(root.arc) for root in result.roots), "iso": result.nominal.message}
    if stage == "modes":
        return {"modes": len(result.modes.frequency), "degrees_of_freedom": len(result.model.system.M)}
    if stage == "dynamics":
        return {
            "converged": bool(np.all(result.response.converged)),
            "stable": bool(np.all(result.stability.stable)),
            "residual": float(np.max(result.response.residual)),
            "message": result.response.message,
        }
    return {"points": result.points}


def report_again(folder: Path) -> None:
    """Write report.html anew, with its figures where the run drew none, and bring the manifest up to date.

    Parameters
    ----------
    folder : path
        Results of a complete run.
    """
    from femgear.pictures import write_figures
    from femgear.report import write_report
    from femgear.storage import folder_lock, open_results

    with folder_lock(folder):
        results = open_results(folder, partial=False)
        manifest = results.manifest
        names = [name for name in manifest.files if name != "report.html"]
        if not any(name.endswith(".png") for name in names):
            data = {stage: getattr(results, stage) for stage in results.stages}
            names += write_figures(
                results.folder, planetary_set(results.case), data, deviations=set_deviations(results.case)
            )
            finish(folder, names, timings=manifest.timings, convergence=manifest.convergence)
        write_report(folder)
        finish(folder, [*names, "report.html"], timings=manifest.timings, convergence=manifest.convergence)
