"""The pipeline of a planar case: static (where no mesh stiffness is given) -> modes -> branch, response.

What the case asks for is refused before anything is computed where the model cannot represent it, and what
was found is checked. `PLANAR` at the end is the train: the table of its stages, with what the report says and
draws of each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.fault_sections import no_faults
from femgear.case.gear_set import planetary_set
from femgear.case.lubrication import losses_wanted
from femgear.case.quantities import RPM
from femgear.case.tooth_friction import no_acting_friction
from femgear.errors import CaseError, ConvergenceError
from femgear.report.tables import describe_modes
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.stages.duty import set_duty
from femgear.stages.gears_in_space import case_bodies
from femgear.stages.heat import HEAT
from femgear.stages.life import LIFE, no_load_cases
from femgear.stages.losses import LOSSES
from femgear.stages.lumped_set import check_one_period, gear_set_modes, member_speeds, mode_ratios, needed
from femgear.stages.protocol import (
    FiguresOf,
    Progress,
    Stage,
    Train,
    blaming_start,
    modes_verdict,
    one_blas_thread,
    silent,
)
from femgear.stages.static import LARGEST_APPROACH, LARGEST_MOTION, STATIC, STRESS, mesh_backlash
from femgear.stages.static_results import StaticResult, describe_set
from femgear.stages.strength_results import strength_verdict
from femgear.stages.tooth_figures import FRICTION_FIGURE, tooth_key_figures
from femgear.stages.train_judgements import set_judgements
from femgear.system.fourier import side_bands
from femgear.trains.planar.model import (
    carrier_sense,
    judged_branch,
    motion_lines,
    planar_dynamic_model,
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
    describe_planar_response,
    doubts,
    planar_warnings,
    published_modes,
)
from femgear.trains.planar.section import PlanarCase

if TYPE_CHECKING:
    from femgear.exchange.dynamic_model import DynamicModel
    from femgear.gears.planetary import PlanetarySet
    from femgear.solvers.continuation.branches import Branch
    from femgear.solvers.periodic.solution import PeriodicSolution
    from femgear.trains.planar.model import MotionLines, PlanarModel
    from femgear.trains.planar.section import BranchSection

# distance of a line from an undamped natural frequency, relative to it, at which the response has no bound
_ON_RESONANCE = 1e-3
# play of a rounding error, which is none [m]
_NO_PLAY = 1e-9
# what a curve holds of every point
_ALONG = ("points", "parameter", "tangent", "iterations", "error")


def check_planar_case(case: PlanarCase, gears: PlanetarySet) -> None:
    """Refuse what the planar model cannot represent, before anything is computed.

    CaseError: E-BACKLASH: back flanks without play. E-PERIODS: a static record of several mesh periods.
    """
    if case.planar.mesh_stiffness is not None:
        no_faults(case, "with a given mesh stiffness no flank is looked at, and so no fault of a tooth")
        no_acting_friction(case, "a given planar.mesh_stiffness has no tooth loads, and so no friction")
    planar, play = case.planar, _least_play(case, gears)
    if planar.back_flanks and planar.line_backlash is None and not play > _NO_PLAY:
        raise CaseError(
            f"back flanks need play, and the gears have {max(play, 0.0) * 1e6:.3g} um",
            code="E-BACKLASH",
            key="planar.back_flanks",
            value="true",
            limit="play above 0 in every mesh",
            remedy="give planar.line_backlash or set.backlash, or write planar.back_flanks = false",
            file=case.location("planar.back_flanks"),
        )
    if planar.mesh_stiffness is None:
        check_one_period(case, gears, "the planar model takes")


def _least_play(case: PlanarCase, gears: PlanetarySet) -> float:
    """Least play of a mesh along its line of action [m]."""
    given = case.planar.line_backlash
    return float(mesh_backlash(gears).min()) if given is None else given


def check_smoothing(case: PlanarCase, gears: PlanetarySet, model: PlanarModel) -> None:
    """Refuse contact that sets in over a length which is none of contact.

    The smoothed law carries ``k s^2 / 4 b`` through a gap b, and its force at a compression d is wrong by
    ``(s / 2 d)^2`` of it.

    CaseError: E-RANGE: a smoothing length above half the play or above the mean compression.
    """
    smoothing, limits = case.planar.smoothing, {}
    if (play := _least_play(case, gears)) > _NO_PLAY:
        limits["half the play"] = 0.5 * play
    if (compression := mean_compression(model)) > 0.0:
        limits["the mean compression of a mesh, force / stiffness"] = compression
    for words, limit in limits.items():
        if smoothing > limit:
            raise CaseError(
                f"contact sets in over {smoothing * 1e6:.4g} um, more than {words}: teeth would carry across "
                "their play",
                code="E-RANGE",
                key="planar.smoothing",
                value=f"{smoothing * 1e6:.6g} um",
                limit=f"{limit * 1e6:.4g} um or less",
                remedy="leave it out: 0.3 um",
                file=case.location("planar.smoothing"),
            )


def mean_compression(model: PlanarModel) -> float:
    """Compute the least compression [m] of a mesh under the mean load, force / stiffness, flanks closed."""
    system, count = model.problem.system, 2 * model.data.n_planets
    K = system.K + (system.W * model.springs) @ system.W.T
    # free turning of the whole set has no stiffness, and the load none of it
    moved = np.linalg.lstsq(K, system.load, rcond=1e-14)[0]
    return float(np.abs(system.W[:, :count].T @ moved).min())


def _check_damping(case: PlanarCase, model: PlanarModel, spans: Iterable[tuple[float, float, str]]) -> None:
    """Refuse natural frequencies without damping in spans (lowest [Hz], highest [Hz], what excites them)."""
    ratios = planar_ratios(case)
    if np.min(ratios) > 0.0:
        return
    system = model.problem.system
    plain = replace(system, C=np.zeros_like(system.C), gyroscopic=None)
    hertz = undamped_modes(plain, model.springs).frequency
    bare = hertz[(hertz > 0.0) & (mode_ratios(hertz, ratios) == 0.0)]
    key = "planar.damping_ratios" if case.planar.damping_ratios else "dynamics.damping_ratio"
    for lowest, highest, words in spans:
        inside = bare[(bare >= lowest) & (bare <= highest)]
        if len(inside):
            raise CaseError(
                f"the natural frequency {inside[0]:.6g} Hz has no damping and {words}: the response has no bound there",
                code="E-RESONANCE",
                key=key,
                value="0",
                limit="above 0 at a resonance",
                remedy="give the mode some damping, or move the range or the speed",
                file=case.location(key),
            )


def _excited_spans(frequency: np.ndarray, orders: np.ndarray) -> Iterator[tuple[float, float, str]]:
    """Make the spans of `_check_damping` around lines of weight and mesh, from frequencies (2,) [rad/s]."""
    pure = (orders[:, 0] == 0) | ((np.abs(orders[:, 0]) == 1) & (orders[:, 1] == 0))
    for line in np.abs(orders[pure] @ frequency) / (2.0 * np.pi):
        words = f"the line at {line:.6g} Hz is on it"
        yield line / (1.0 + _ON_RESONANCE), line / (1.0 - _ON_RESONANCE), words


def _bounded_branch(
    branch: Branch, lines: Iterable[MotionLines], gears: PlanetarySet
) -> tuple[Branch, tuple[MotionLines, ...]]:
    """Cut a branch at the last point that converged with small displacements, and compute its motions."""
    good: list[MotionLines] = []
    for solution, line in zip(branch.solutions, lines):
        hertz = f"{solution.frequency[0] / (2.0 * np.pi):.6g} Hz"
        words = _too_far(line, gears) if solution.converged else f"no solution: {solution.message}"
        if words:
            where = f"at {hertz} of the weight"
            if len(good) < 2 and not solution.converged:
                remedy = "begin at another frequency, or raise the damping"
                raise ConvergenceError(
                    f"{where}: {words}", code="E-CONVERGENCE", key="planar.branch.from", remedy=remedy
                )
            if len(good) < 2:
                raise _moved_too_far("planar.branch.from", where, words)
            ending = f"stopped before {hertz}, where {words}" if solution.converged else f"{words} at {hertz}"
            return _cut(branch, len(good), ending), tuple(good)
        good.append(line)
    return branch, tuple(good)


def _cut(branch: Branch, count: int, message: str) -> Branch:
    """The first points of a branch, which then did not reach an end of its range."""
    whole_curve = branch.curve
    curve = replace(
        whole_curve,
        **{name: getattr(whole_curve, name)[:count] for name in _ALONG},
        **{name: getattr(whole_curve, name)[getattr(whole_curve, name) < count] for name in ("folds", "branch_points")},
        closed=False,
        complete=False,
        message=message,
    )
    return replace(branch, solutions=branch.solutions[:count], curve=curve)


def _check_response_motions(
    speeds: Sequence[float],
    solutions: Sequence[PeriodicSolution],
    lines: Sequence[MotionLines],
    gears: PlanetarySet,
) -> None:
    """Refuse speeds without a solution, and displacements that are not small."""
    lost = [i for i, solution in enumerate(solutions) if not solution.converged]
    if lost:
        listed = ", ".join(f"{speeds[i] / RPM:.6g}" for i in lost[:8]) + (", ..." if len(lost) > 8 else "")
        raise ConvergenceError(
            f"no response at {len(lost)} of {len(speeds)} speeds: {listed} rpm; {solutions[lost[0]].message}",
            code="E-CONVERGENCE",
            key="operation.speeds",
            value=f"relative residual {solutions[lost[0]].residual:.2e}",
            remedy="leave these speeds out, change planar.response.carrier_harmonics, or raise the damping",
        )
    for speed, line in zip(speeds, lines):
        if words := _too_far(line, gears):
            raise _moved_too_far("operation.speeds", f"at {speed / RPM:.6g} rpm", words)


def _too_far(lines: MotionLines, gears: PlanetarySet) -> str:
    """Why displacements are not small; empty where they are."""
    module = gears.sun.module
    for value, modules, words in (
        (lines.motion, LARGEST_MOTION, "a member moves"),
        (lines.approach, LARGEST_APPROACH, "the flanks of a mesh approach"),
    ):
        if not value <= modules * module:
            allowed = f"{modules * module * 1e3:.4g} mm ({modules:g} modules)"
            return f"{words} by {value * 1e3:.4g} mm, more than {allowed}"
    return ""


def _moved_too_far(key: str, where: str, words: str) -> ConvergenceError:
    return ConvergenceError(
        f"{where} {words}: the model is one of small displacements",
        code="E-MOTION",
        key=key,
        remedy="raise the damping, stiffen the supports, or leave the resonance out",
    )


def _end_of_branch(branch: Branch, wanted: BranchSection) -> str:
    """Tell how a branch ended, in frequencies [Hz] and entries of the case file."""
    hertz, count = branch.parameter[-1] / (2.0 * np.pi), len(branch.parameter)
    if branch.complete:
        side = "start" if abs(hertz - wanted.start) < abs(hertz - wanted.to) else "end"
        return f"it came to the {side} of its range, {hertz:.6g} Hz"
    if count >= wanted.points:
        return (
            f"NOT COMPLETE: it ended at {hertz:.6g} Hz after {count} points, before {wanted.to:.6g} Hz: "
            "raise planar.branch.points"
        )
    return f"NOT COMPLETE: it ended at {hertz:.6g} Hz, before {wanted.to:.6g} Hz: {branch.message}"


@one_blas_thread()
def solve_planar_modes(case: PlanarCase, static: StaticResult | None = None) -> PlanarModesResult:
    """Solve for natural frequencies, modes and their kinds.

    The static solution is needed where the case gives no mesh stiffness.

    CaseError: what `check_planar_case` refuses, a load that accelerates the set.
    """
    gears = planetary_set(case)
    check_planar_case(case, gears)
    model = planar_model(case, gears, static)
    bare = replace(model.problem.system, C=np.zeros_like(model.problem.system.C))
    modes = gear_set_modes(model.data, system=bare, mesh_stiffness=model.springs)
    ratios = mode_ratios(modes.frequency, planar_ratios(case))
    return PlanarModesResult(gears, model.data, replace(modes, damping_ratio=ratios))


@one_blas_thread()
def solve_branch(case: PlanarCase, static: StaticResult | None = None, *, progress: Progress = silent) -> BranchResult:
    """Follow periodic responses to the weight past limit points, with a Floquet verdict at each.

    Mesh stiffnesses are constant: the given ones, or the mean of the static solution's. The branch ends
    before motions that the model of small displacements does not hold for.

    CaseError: what `check_planar_case` refuses, a range over an undamped natural frequency (E-RESONANCE).
    ConvergenceError: no response at the start, or one that moves too far (E-MOTION).
    """
    gears, wanted = planetary_set(case), needed(case.planar.branch, "planar.branch")
    check_planar_case(case, gears)
    model = planar_model(case, gears, static)
    check_smoothing(case, gears, model)
    _check_damping(case, model, [(wanted.start, wanted.to, "planar.branch crosses it")])
    with blaming_start(case, "planar.branch.from"):
        branch = weight_curve(
            model.problem,
            (wanted.start, wanted.to),
            reduction=model.reduction,
            harmonics=wanted.harmonics,
            radius=True,
            max_points=wanted.points,
        )
    branch, lines = _bounded_branch(branch, (motion_lines(model, solution) for solution in branch.solutions), gears)
    if wanted.stability:
        branch = judged_branch(
            model.problem, branch, lambda done, total: progress("branch", 0.3 * total + 0.7 * done, total)
        )
    ending = _end_of_branch(branch, wanted)
    return BranchResult(gears, model, branch, lines, carrier_sense(case, gears), ending)


@one_blas_thread()
def solve_planar_response(
    case: PlanarCase, static: StaticResult | None = None, *, progress: Progress = silent
) -> PlanarResponseResult:
    """Solve for responses to weight and mesh frequency together at the speeds of the operation.

    CaseError: what `check_planar_case` refuses, a line on an undamped natural frequency (E-RESONANCE).
    ConvergenceError: speeds without a solution, or with one that moves too far (E-MOTION).
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
        _check_damping(case, model, _excited_spans(frequency, orders))
        solution = None
        options = {"orders": orders, "reduction": model.reduction, "radius": len(orders) < 60}
        if solutions and solutions[-1].converged:
            solution = solve_harmonic_balance(model.problem, frequency, start=solutions[-1], **options)
        if solution is None or not solution.converged:
            solution = solve_harmonic_balance(model.problem, frequency, **options)
        solutions.append(solution)
        lines.append(motion_lines(model, solution))
        progress("response", number + 1, len(turning))
    _check_response_motions(operation.speeds, solutions, lines, gears)
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
        "complete": bool(branch.complete),
        "points": len(branch.parameter),
        "folds": len(branch.folds),
        **_truncation(branch.solutions, result.lines),
    }


def _response_verdict(result: PlanarResponseResult) -> dict:
    return _truncation(result.solutions, result.lines)


def _truncation(solutions, lines) -> dict:
    """Largest shares of the amplitude in the upper half of the lines."""
    return {
        "tail": float(max(solution.tail for solution in solutions)),
        "force_tail": float(max(line.force_tail for line in lines)),
    }


def _needs_static(case: PlanarCase) -> tuple[str, ...]:
    return ("static",) if case.planar.mesh_stiffness is None else ()


def _lacks(section: str) -> Callable[[PlanarCase], str]:
    return lambda case: "" if getattr(case.planar, section) else f"the case has no section planar.{section}"


def _dynamic_model(case: PlanarCase, results: Mapping[str, Any]) -> DynamicModel:
    return planar_dynamic_model(case, planetary_set(case), results.get("static"))


PLANAR = Train(
    name="planar",
    words="a planar case",
    stages=(
        replace(
            STATIC, wanted=lambda case: bool(_needs_static(case)) or losses_wanted(case) or not no_load_cases(case)
        ),
        replace(STRESS, wanted=lambda case: bool(_needs_static(case)) and case.static.stresses),
        LIFE,
        LOSSES,
        HEAT,
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
            describe=lambda results: describe_branch(results.branch, results.findings),
            unavailable=_lacks("branch"),
            needs=lambda case: ("modes",),
            warnings=BranchResult.warnings,
        ),
        Stage(
            name="response",
            title="Weight and mesh frequency",
            solve=solve_planar_response,
            takes=("static",),
            options=("progress",),
            verdict=_response_verdict,
            describe=lambda results: describe_planar_response(results.response, results.findings),
            unavailable=_lacks("response"),
            needs=lambda case: ("modes",),
            warnings=PlanarResponseResult.warnings,
        ),
    ),
    describe=lambda case: (*describe_set(case), describe_planar(case, planetary_set(case))),
    warnings=planar_warnings,
    bodies=case_bodies,
    judgements=set_judgements,
    duty=set_duty,
    front=(("weight_response", 0), ("tooth_contact", 0), ("response_mesh_forces", 0)),
    figures=FiguresOf("femgear.trains.planar.figures:FIGURES"),
    verdict=strength_verdict,
    dynamic_model=_dynamic_model,
    key_figures=lambda case: tuple(figure for figure in tooth_key_figures(case) if figure != FRICTION_FIGURE),
    remarks=lambda results, stem: (*comparisons(results.case, stem), *doubts(results, stem)),
)
