"""The stages of every kind of case: what computes them, and what they say about their trustworthiness."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import planetary_set
from femgear.errors import CaseError
from femgear.trains.drivetrain.section import DrivetrainCase
from femgear.trains.elastic import checks as elastic_checks
from femgear.trains.elastic import stages as elastic_stages
from femgear.trains.protocol import Kind, Stage
from femgear.trains.static import stages as static_stages

if TYPE_CHECKING:
    from femgear.case.sections import Case


def kind_of(case: Case) -> str:
    """Kind of a case: a key of `KINDS`."""
    if isinstance(case, DrivetrainCase):
        return "drivetrain"
    if case.helical is not None:
        return "helical"
    return "elastic" if case.planar is None else "planar"


def stages_of(case: Case, only: str | None = None) -> tuple[str, ...]:
    """Stages to compute, in order.

    Parameters
    ----------
    case : Case
    only : str, optional
        Last stage; it is computed with what it needs, whatever the case says of it.

    Raises
    ------
    CaseError
        E-STAGE: the case has no such stage.
    """
    table = KINDS[kind_of(case)].stages
    names = list(table)
    if only is None:
        return tuple(name for name in names if table[name].wanted(case) and not table[name].possible(case))
    why = table[only].possible(case) if only in table else f"it is no stage of {KINDS[kind_of(case)].words}"
    if why:
        allowed = [name for name in names if not table[name].possible(case)]
        raise CaseError(
            f"no stage {only}: {why}", code="E-STAGE", key="--only", value=only, limit=", ".join(allowed)
        )
    before = names[: names.index(only)]
    return (*(name for name in before if _goes_before(table, name, only, case)), only)


def _goes_before(table: Mapping[str, Stage], name: str, only: str, case: Case) -> bool:
    needs = table[only].needs(case)
    return name in needs or any(_goes_before(table, name, other, case) for other in needs)


def check_case(case: Case, only: str | None = None) -> None:
    """Refuse what the stages of a run cannot represent, before anything is computed.

    Raises
    ------
    CaseError, GeometryError
    """
    stages = stages_of(case, only)
    gears = None if isinstance(case, DrivetrainCase) else planetary_set(case)
    if set(stages) - {"static", "stress"}:
        KINDS[kind_of(case)].check(case, gears)
    if isinstance(case, DrivetrainCase) and "spectrum" in stages:
        from femgear.trains.drivetrain.setup import case_model, check_spectrum

        check_spectrum(case, case_model(case))


def _stress(case, results, cache, progress):
    from femgear.trains.static.stages import solve_stress

    return solve_stress(case, results["static"], progress=progress)


def _planar(name: str, **options):
    """Stage of `femgear.trains.planar.stages`, by the name of its function."""

    def compute(case, results, cache, progress):
        from femgear.trains.planar import stages as planar_stages

        shown = {"progress": progress} if options.get("shows") else {}
        return getattr(planar_stages, name)(case, results.get("static"), **shown)

    return compute


def _helical(name: str, *, after: str = "", cached: bool = False, shows: bool = False):
    """Helical stage, by the names of its function and of the stage it starts from."""

    def compute(case, results, cache, progress):
        from femgear.trains.helical import stages as helical_stages

        before = (results.get(after),) if after else ()
        more = ({"cache": cache} if cached else {}) | ({"progress": progress} if shows else {})
        return getattr(helical_stages, name)(case, *before, **more)

    return compute


def _static_verdict(result) -> dict:
    cycle = result.cycle
    return {"residual": float(cycle.residual.max()), "message": cycle.message, "contact": cycle.contact}


def _dynamics_verdict(result) -> dict:
    return {
        "converged": bool(np.all(result.response.converged)),
        "stable": bool(np.all(result.stability.stable)),
        "residual": float(np.max(result.response.residual)),
        "message": result.response.message,
    }


def _branch_verdict(result) -> dict:
    branch = result.branch
    return {
        "converged": bool(np.all(branch.converged)),
        "complete": bool(branch.complete),
        "points": len(branch.parameter),
        "folds": len(branch.folds),
        "residual": float(np.max(branch.residual)),
        "message": result.ending,
        **_truncation(branch.solutions, result.lines),
    }


def _response_verdict(result) -> dict:
    return {
        "converged": all(one.converged for one in result.solutions),
        "residual": max(one.residual for one in result.solutions),
        **_truncation(result.solutions, result.lines),
    }


def _truncation(solutions, lines) -> dict:
    """Largest shares of the amplitude in the upper half of the lines."""
    return {
        "tail": float(max(one.tail for one in solutions)),
        "force_tail": float(max(one.force_tail for one in lines)),
    }


def _needs_static(case: Case) -> tuple[str, ...]:
    return ("static",) if case.planar.mesh_stiffness is None else ()


def _needs_helical_static(case: Case) -> tuple[str, ...]:
    return ("static",) if case.helical.mesh_stiffness is None else ()


def _nothing_excites(case: Case) -> str:
    given = case.helical.mesh_stiffness is not None
    return "a given helical.mesh_stiffness does not vary: nothing excites the set" if given else ""


def _takes_the_place(case: Case) -> str:
    given = case.helical.mesh_stiffness is not None
    return "a given helical.mesh_stiffness takes the place of the static solution" if given else ""


def _lacks(section: str) -> Callable[[Case], str]:
    return lambda case: "" if getattr(case.planar, section) else f"the case has no section planar.{section}"


def _check_elastic(case, gears):
    elastic_checks.check_dynamic_case(case, gears)


def _check_helical(case, gears):
    from femgear.trains.helical.checks import check_helical_case

    check_helical_case(case, gears)


def _check_planar(case, gears):
    from femgear.trains.planar.checks import check_planar_case

    check_planar_case(case, gears)


STATIC = Stage(
    compute=lambda case, _, cache, progress: static_stages.solve_static(case, cache=cache, progress=progress),
    verdict=_static_verdict,
)
STRESS = Stage(
    compute=_stress,
    verdict=lambda result: {
        "root_points": sum(len(root.arc) for root in result.roots), "iso": result.nominal.message,
    },
    wanted=lambda case: case.static.stresses,
    needs=lambda case: ("static",),
)  # fmt: skip
ELASTIC = {
    "static": STATIC,
    "stress": STRESS,
    "modes": Stage(
        compute=lambda case, results, _, progress: elastic_stages.solve_modes(
            case, results["static"], progress=progress
        ),
        verdict=lambda result: {
            "modes": len(result.modes.frequency), "degrees_of_freedom": len(result.model.system.M),
        },
        needs=lambda case: ("static", "stress") if case.static.stresses else ("static",),
    ),
    "dynamics": Stage(
        compute=lambda case, results, _, progress: elastic_stages.solve_dynamics(
            case, results["static"], results["modes"], progress=progress
        ),
        verdict=_dynamics_verdict,
        needs=lambda case: ("modes",),
    ),
    "housing": Stage(
        compute=lambda case, results, *_: elastic_stages.solve_housing(case, results["dynamics"]),
        verdict=lambda result: {"form": result.form},
        needs=lambda case: ("dynamics",),
    ),
}  # fmt: skip
PLANAR = {
    "static": Stage(
        compute=STATIC.compute, verdict=STATIC.verdict, wanted=lambda case: bool(_needs_static(case))
    ),
    "stress": Stage(
        compute=STRESS.compute,
        verdict=STRESS.verdict,
        wanted=lambda case: bool(_needs_static(case)) and case.static.stresses,
        needs=STRESS.needs,
    ),
    "modes": Stage(
        compute=_planar("solve_planar_modes"),
        verdict=lambda result: {
            "modes": len(result.modes.frequency), "degrees_of_freedom": len(result.modes.shape),
        },
        needs=_needs_static,
    ),
    "branch": Stage(
        compute=_planar("solve_branch", shows=True),
        verdict=_branch_verdict,
        possible=_lacks("branch"),
        needs=lambda case: ("modes",),
    ),
    "response": Stage(
        compute=_planar("solve_planar_response", shows=True),
        verdict=_response_verdict,
        possible=_lacks("response"),
        needs=lambda case: ("modes",),
    ),
}  # fmt: skip


HELICAL = {
    "static": Stage(
        compute=_helical("solve_helical_static", cached=True, shows=True),
        verdict=_static_verdict,
        possible=_takes_the_place,
    ),
    "modes": Stage(
        compute=_helical("solve_helical_modes", after="static", cached=True),
        verdict=PLANAR["modes"].verdict,
        needs=_needs_helical_static,
    ),
    "dynamics": Stage(
        compute=_helical("solve_helical_dynamics", after="modes", shows=True),
        verdict=_dynamics_verdict,
        possible=_nothing_excites,
        needs=lambda case: ("modes",),
    ),
}  # fmt: skip


def _check_drivetrain(case, _):
    from femgear.trains.drivetrain.setup import check_drivetrain

    check_drivetrain(case)


def _drivetrain(name: str, *, after: str = "", shows: bool = False):
    """Stage of `femgear.trains.drivetrain.stages`, by the names of its function and of the stage before."""

    def compute(case, results, cache, progress):
        from femgear.trains.drivetrain import stages as drivetrain_stages

        before = (results[after],) if after else ()
        return getattr(drivetrain_stages, name)(case, *before, **({"progress": progress} if shows else {}))

    return compute


def _transient_verdict(result) -> dict:
    runs = result.runs.values()
    return {
        "steps": next(iter(runs)).steps,
        "energy": max(run.ledger.error for run in runs),
        "momentum": max(run.momentum for run in runs),
        "pulling": {variant: float(np.max(run.pulling, initial=0.0)) for variant, run in result.runs.items()},
    }


DRIVETRAIN = {
    "modes": Stage(
        compute=_drivetrain("solve_drivetrain_modes"),
        verdict=lambda result: {
            "modes": len(result.modes.frequency), "degrees_of_freedom": len(result.modes.shape),
        },
    ),
    "transient": Stage(
        compute=_drivetrain("solve_transient_run", shows=True), verdict=_transient_verdict
    ),
    "spectrum": Stage(
        compute=_drivetrain("solve_spectrum", after="transient"),
        verdict=lambda result: {
            "lines": len(result.lines), "segments": min(one.segments for one in result.spectra.values()),
        },
        possible=lambda case: "" if case.parallel or case.planetary else "the chain has no gears",
        needs=lambda case: ("transient",),
    ),
}  # fmt: skip
KINDS = {
    "drivetrain": Kind(DRIVETRAIN, _check_drivetrain, "a drivetrain"),
    "elastic": Kind(ELASTIC, _check_elastic, "a case with an elastic ring"),
    "planar": Kind(PLANAR, _check_planar, "a planar case"),
    "helical": Kind(HELICAL, _check_helical, "a helical case"),
}
