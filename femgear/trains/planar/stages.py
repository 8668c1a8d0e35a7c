"""The pipeline of a planar case: static (where no mesh stiffness is given) -> modes -> branch, response.

`PLANAR` at the end is the train: the table of its stages, with what the report says and draws of each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import planetary_set
from femgear.errors import Finding
from femgear.report.tables import describe_modes
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.system.fourier import side_bands
from femgear.trains.gear_set import gear_set_modes, mode_ratios
from femgear.trains.planar.checks import (
    bounded_branch,
    check_damping,
    check_planar_case,
    check_response_motions,
    check_smoothing,
    end_of_branch,
    excited_spans,
)
from femgear.trains.planar.model import (
    carrier_sense,
    judged_branch,
    motion_lines,
    planar_model,
    planar_ratios,
    weight_curve,
)
from femgear.trains.planar.results import (
    BranchResult,
    PlanarModesResult,
    PlanarResponseResult,
    comparisons,
    describe_branch,
    describe_planar,
    describe_response,
    doubts,
    planar_verdicts,
    published_modes,
)
from femgear.trains.planar.section import PlanarCase, check_planar, planar_notices
from femgear.trains.protocol import Figures, Progress, Stage, Train, one_blas_thread
from femgear.trains.rigid import (
    member_speeds,
    modes_verdict,
    needed,
)
from femgear.trains.static.description import describe_case, set_warnings
from femgear.trains.static.results import StaticResult
from femgear.trains.static.stages import STATIC, STRESS

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet
    from femgear.storage.results import Results


@one_blas_thread()
def solve_planar_modes(case: PlanarCase, static: StaticResult | None = None) -> PlanarModesResult:
    """Solve for natural frequencies, modes and their kinds.

    Parameters
    ----------
    case : Case
        With a section planar.
    static : StaticResult, optional
        Needed where the case gives no mesh stiffness.

    Raises
    ------
    CaseError
        What `check_planar_case` refuses, a load that accelerates the set.
    """
    gears = planetary_set(case)
    check_planar_case(case, gears)
    model = planar_model(case, gears, static)
    bare = replace(model.problem.system, C=np.zeros_like(model.problem.system.C))
    modes = gear_set_modes(model.data, system=bare, mesh_stiffness=model.springs)
    ratios = mode_ratios(modes.frequency, planar_ratios(case))
    return PlanarModesResult(gears, model.data, replace(modes, damping_ratio=ratios))


@one_blas_thread()
def solve_branch(
    case: PlanarCase, static: StaticResult | None = None, *, progress: Progress | None = None
) -> BranchResult:
    """Follow periodic responses to the weight past limit points, with a Floquet verdict at each.

    Mesh stiffnesses are constant: the given ones, or the mean of the static solution's. The branch ends
    before motions that the model of small displacements does not hold for.

    Raises
    ------
    CaseError
        What `check_planar_case` refuses, a range over an undamped natural frequency (E-RESONANCE).
    ConvergenceError
        No response at the start, or one that moves too far (E-MOTION).
    """
    gears, wanted = planetary_set(case), needed(case.planar.branch, "planar.branch")
    check_planar_case(case, gears)
    model = planar_model(case, gears, static)
    check_smoothing(case, gears, model)
    check_damping(case, model, [(wanted.start, wanted.to, "planar.branch crosses it")])
    branch = weight_curve(
        model.problem,
        (wanted.start, wanted.to),
        reduction=model.reduction,
        harmonics=wanted.harmonics,
        radius=True,
        max_points=wanted.points,
    )
    branch, lines = bounded_branch(branch, (motion_lines(model, one) for one in branch.solutions), gears)
    if wanted.stability:
        tell = progress or (lambda stage, done, total: None)
        branch = judged_branch(
            model.problem, branch, lambda done, total: tell("branch", 0.3 * total + 0.7 * done, total)
        )
    ending = end_of_branch(branch, wanted)
    return BranchResult(gears, model, branch, lines, carrier_sense(case, gears), ending)


@one_blas_thread()
def solve_planar_response(
    case: PlanarCase, static: StaticResult | None = None, *, progress: Progress | None = None
) -> PlanarResponseResult:
    """Solve for responses to weight and mesh frequency together at the speeds of the operation.

    Raises
    ------
    CaseError
        What `check_planar_case` refuses, a line on an undamped natural frequency (E-RESONANCE).
    ConvergenceError
        Speeds without a solution, or with one that moves too far (E-MOTION).
    """
    gears = planetary_set(case)
    check_planar_case(case, gears)
    operation, orders = case.operation, _response_lines(case, gears, static)
    turning = tuple(member_speeds(case, gears, speed) for speed in operation.speeds)
    solutions, lines, model = [], [], None
    for number, speed in enumerate(turning):
        if model is None or case.planar.gyroscopic:
            carrier = speed.carrier if case.planar.gyroscopic else 0.0
            model = planar_model(case, gears, static, mesh_frequency=True, carrier_speed=carrier)
            check_smoothing(case, gears, model)
        frequency = np.array([abs(speed.carrier), 2.0 * np.pi * speed.mesh_frequency])
        check_damping(case, model, excited_spans(frequency, orders))
        found = None
        options = {"orders": orders, "reduction": model.reduction, "radius": len(orders) < 60}
        if solutions and solutions[-1].converged:
            found = solve_harmonic_balance(model.problem, frequency, start=solutions[-1], **options)
        if found is None or not found.converged:
            found = solve_harmonic_balance(model.problem, frequency, **options)
        solutions.append(found)
        lines.append(motion_lines(model, found))
        if progress is not None:
            progress("response", number + 1, len(turning))
    check_response_motions(operation.speeds, solutions, lines, gears)
    return PlanarResponseResult(gears, np.array(operation.speeds), turning, tuple(solutions), tuple(lines))


def _response_lines(case: PlanarCase, gears: PlanetarySet, static: StaticResult | None) -> np.ndarray:
    """Lines of weight and mesh frequency; none of the weight where it does not turn, none of the mesh
    frequency where the mesh stiffness is constant."""
    wanted = needed(case.planar.response, "planar.response")
    turns = case.planar.gravity is not None and carrier_sense(case, gears) != 0
    carrier, bands = (wanted.carrier_harmonics, wanted.side_bands) if turns else (0, 0)
    mesh = case.response_harmonics if case.planar.mesh_stiffness is None else 0
    return side_bands(carrier, mesh, bands)


def _branch_verdict(result: BranchResult) -> dict:
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


def _response_verdict(result: PlanarResponseResult) -> dict:
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


def _needs_static(case: PlanarCase) -> tuple[str, ...]:
    return ("static",) if case.planar.mesh_stiffness is None else ()


def _lacks(section: str) -> Callable[[PlanarCase], str]:
    return lambda case: "" if getattr(case.planar, section) else f"the case has no section planar.{section}"


def _figures() -> Mapping[str, Figures]:
    from femgear.trains.planar.figures import FIGURES

    return FIGURES


def _result_warnings(results: Results) -> Iterator[Finding]:
    branch, response = (
        results.stage(name) if name in results.stages else None for name in ("branch", "response")
    )
    return planar_verdicts(branch, response)


PLANAR = Train(
    name="planar",
    words="a planar case",
    model=PlanarCase,
    section="planar",
    stages=(
        replace(STATIC, wanted=lambda case: bool(_needs_static(case))),
        replace(STRESS, wanted=lambda case: bool(_needs_static(case)) and case.static.stresses),
        Stage(
            name="modes",
            title="Modes",
            solve=solve_planar_modes,
            takes=("static",),
            verdict=modes_verdict,
            describe=lambda results: describe_modes(results.modes),
            needs=_needs_static,
            check=lambda case: check_planar_case(case, planetary_set(case)),
            tables=lambda results: published_modes(results.case, results.modes),
        ),
        Stage(
            name="branch",
            title="Response to the weight",
            solve=solve_branch,
            takes=("static",),
            options=("progress",),
            verdict=_branch_verdict,
            describe=lambda results: describe_branch(results.branch),
            unavailable=_lacks("branch"),
            needs=lambda case: ("modes",),
        ),
        Stage(
            name="response",
            title="Weight and mesh frequency",
            solve=solve_planar_response,
            takes=("static",),
            options=("progress",),
            verdict=_response_verdict,
            describe=lambda results: describe_response(results.response),
            unavailable=_lacks("response"),
            needs=lambda case: ("modes",),
        ),
    ),
    describe=lambda case: describe_case(
        case, model=(describe_planar(case, planetary_set(case)),), warnings=set_warnings(case)
    ),
    warnings=set_warnings,
    result_warnings=_result_warnings,
    figures=_figures,
    remarks=lambda results, stem: (*comparisons(results.case, stem), *doubts(results, stem)),
    cross_check=check_planar,
    notices=lambda tables, case: planar_notices(tables),
)  # fmt: skip
