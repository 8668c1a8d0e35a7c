"""Train "pair": two gears on a centre distance from their teeth: static contact, stresses, vibration.

Static stages, files and pictures are those of a planetary set, with one mesh; beside the mesh stiffness of
the finite elements stands that of ISO 6336-1, method B. The linear response about the loaded contact is that
of the spectral solver. Where it pulls, flanks part: the motion is then that of harmonic balance with play,
begun at the linear one, and the run-up follows the branch of these motions past its limit points. The
excitation ends at a frequency, the same at all speeds.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.checks import runup_range
from femgear.case.dependencies import check_entries, modal_entries, static_entries
from femgear.case.gear_set import materials_of, planetary_set, set_deviations
from femgear.case.quantities import RPM
from femgear.case.teeth import case_overlap
from femgear.case.tooth_friction import acting_friction
from femgear.errors import ConvergenceError, GeometryError
from femgear.findings import Finding
from femgear.gears.checks import check_meshes
from femgear.gears.deviations import common_period
from femgear.gears.iso6336_stiffness import material_factor, pair_mesh_stiffness
from femgear.gears.pair import GearPair
from femgear.report.tables import Block, chosen, describe_modes, tabulate
from femgear.solvers.continuation.branches import frequency_response_curve
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.linear.modal import output_load, output_response, residual_output, source_output, undamped_modes
from femgear.solvers.linear.resonances import (
    crossings,
    merged_speeds,
    modal_forces,
    refined_speeds,
    unresolved,
)
from femgear.solvers.periodic.equations import reduced
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.stability.parametric import decisive_harmonics, stability
from femgear.stages.drawing_tables import describe_drawing
from femgear.stages.duty import pair_duty
from femgear.stages.friction_source import balanced_source
from femgear.stages.gears_in_space import case_bodies
from femgear.stages.heat import HEAT
from femgear.stages.life import LIFE
from femgear.stages.losses import LOSSES
from femgear.stages.lumped_set import parts_of_speeds
from femgear.stages.protocol import (
    Figures,
    Progress,
    Recorded,
    Stage,
    Train,
    modes_verdict,
    one_blas_thread,
    silent,
)
from femgear.stages.static import LARGEST_APPROACH, STATIC, STRESS, solve_static
from femgear.stages.static_figures import FIGURES
from femgear.stages.static_results import (
    StaticResult,
    describe_gears,
    describe_materials,
    describe_meshes,
    describe_static,
    load_warnings,
    mean_over_period,
)
from femgear.stages.strength import with_rim_doubts
from femgear.stages.strength_results import strength_verdict
from femgear.stages.tooth_faults import describe_faults
from femgear.stages.tooth_figures import pair_key_figures
from femgear.stages.train_judgements import set_judgements
from femgear.stages.wear import MeshingTeeth, speed_of_wear
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import fluctuation, sample
from femgear.system.system import Modes, NonlinearSystem, Response, source_harmonics
from femgear.trains.pair.case_file import PairCase
from femgear.trains.pair.figures import DYNAMICS, RUNUP
from femgear.trains.pair.model import (
    PairModel,
    pair_dynamic_model,
    pair_excitation,
    pair_kinds,
    pair_model,
    separating_pair,
)
from femgear.trains.pair.results import (
    PairDynamicsResult,
    PairModesResult,
    PairMotion,
    PairRunupResult,
    describe_dynamics,
    describe_pair_runup,
    pair_signal_extent,
    pair_signals,
)

if TYPE_CHECKING:
    from pathlib import Path

    import xarray as xr

    from femgear.case.dependencies import Steps
    from femgear.exchange.dynamic_model import DynamicModel
    from femgear.storage.results import Results

_CAPTIONS = {
    "static_transmission_error": (
        "Static transmission error over one mesh period along the line of action: gear 1 against gear 2, which is held."
    ),
    "deformed_set": (
        "Deformed pair under the static load at position 0, whole and at the pitch point; at rest in grey. "
        "The teeth that carry bend; what is pale hardly moves. Of helical teeth the transverse section."
    ),
}
_LOWEST, _ABOVE_MODES = 20e3, 2.0
"""The excitation reaches the end of hearing [Hz], and so many times the highest natural frequency."""
_LEAST, _HARMONICS, _ON_BRANCH = 16, 512, (16, 28)
"""Fewest and most harmonics of the excitation; most of excitation and response on the branch."""
_TOGETHER, _INSTANTS = 500, 1024
"""Speeds that are in memory at a time, and instants of a period at which contact is looked for."""
_BELOW, _ABOVE = 0.6, 1.05
"""Ends of the branch over the lowest and the highest speed at which the linear response pulls."""
_STEPS = StepOptions(largest=0.05, max_points=1500)
_TOLD = ("converged", "residual", "iterations", "tail", "spectral_radius")
"""What a response tells of every speed."""


_FULL_LOAD = 100e3
"""Least load [N/m] for which the stiffness of ISO 6336-1 is given."""


def iso_stiffness(case: PairCase) -> tuple[float, float]:
    """Compute c' and c_gamma_alpha of ISO 6336-1, method B, of a case [N/m^2].

    Both are NaN where the profile shifts are outside the range of the method. They hold for solid discs, see
    `femgear.gears.iso6336_stiffness.mesh_stiffness_method_b`; the standard takes them in proportion to Young's modulus
    over that of steel, and to the fourth root of loads below 100 N/mm at the reference circle.
    """
    gears: GearPair = planetary_set(case)
    load = abs(case.operation.torque) / (gears.gear_1.reference_radius * gears.face_width)
    moduli = (material.youngs_modulus for material in materials_of(case))
    factor = material_factor(*moduli) * min(1.0, load / _FULL_LOAD) ** 0.25
    try:
        single, mean = pair_mesh_stiffness(gears, case.helix_angle or 0.0)
    except GeometryError:
        return math.nan, math.nan
    return factor * single, factor * mean


def _describe_case(case: PairCase) -> tuple[Block, ...]:
    """Tabulate geometry and operation of a pair."""
    gears, operation = planetary_set(case), case.operation
    ratio = gears.senses[1] * case.gear_1.teeth / case.gear_2.teeth
    columns = {
        "gear 1 [rpm]": lambda speed: f"{speed / RPM:.4f}",
        "gear 2 [rpm]": lambda speed: f"{ratio * speed / RPM:.4f}",
        "mesh frequency [Hz]": lambda speed: f"{speed * case.gear_1.teeth / (2.0 * math.pi):.4f}",
    }
    shown = [operation.speeds[i] for i in chosen(len(operation.speeds))]
    notes = [f"torque on gear 1 {operation.torque:.6g} N m, on gear 2 {-operation.torque / ratio:.6g} N m"]
    helix = case.helix_angle
    speeds = tabulate("Operation", shown, columns, notes)
    meshes = describe_meshes(gears, helix)
    first = shown[0] * case.gear_1.teeth / (2.0 * math.pi) if shown else None
    blocks = describe_gears(gears, helix), *describe_drawing(case), *describe_materials(case), meshes, speeds
    return *blocks, *describe_faults(case, first)


def _describe_static(results: Results) -> Block:
    """Tabulate static.nc, with the stiffness per face width beside that of the standard."""
    case, data = results.case, results.static
    block = describe_static(data, results.findings)
    single, mean = (1e-9 * value for value in iso_stiffness(case))
    per_width = 1e-9 * float(mean_over_period(data, "mesh_stiffness").mean()) / data.attrs["face_width"]
    words = f"mean k over face width {per_width:.3f} N/(mm um); ISO 6336-1, method B: "
    standard = f"c' = {single:.3f}, c_gamma_alpha = {mean:.3f} N/(mm um)"
    return replace(block, notes=(*block.notes, words + (standard if mean > 0 else "out of range")))


def _warnings(case: PairCase) -> Iterator[Finding]:
    """List what is allowed but deserves a look."""
    gears = planetary_set(case)
    yield from with_rim_doubts(check_meshes(gears, overlap=case_overlap(case, gears)), case)
    yield from case.notices
    yield from load_warnings(case)
    if case.operation.speeds and (why := _no_modes(case)):
        text = f"no effect, static results are all: {why}"
        remedy = (
            "" if case.operation.torque == 0.0 else "write it as a gearbox, whose stages take any: femgear gearbox CASE"
        )
        yield Finding("W-UNUSED", "operation.speeds", text, remedy=remedy)


def _no_modes(case: PairCase) -> str:
    """Tell why there are no modes of a case, empty where there are."""
    if case.operation.torque == 0.0:
        return "without torque no flanks touch"
    periods, _ = common_period(set_deviations(case), planetary_set(case), limit=sys.maxsize)
    return f"its errors span {periods} mesh periods; modes and dynamics take one" if periods > 1 else ""


def _damping(mode: xr.Dataset) -> str:
    return f"{float(mode.damping_ratio):.4g}"


def _no_speeds(case: PairCase) -> str:
    return _no_modes(case) or ("" if case.operation.speeds else "operation.speeds gives no speed")


@one_blas_thread()
def solve_pair_modes(case: PairCase, static: StaticResult) -> PairModesResult:
    """Solve for the modes with mean mesh stiffness, torsional and lateral.

    CaseError: a static solution of another case (E-OTHER-CASE), or none (E-TYPE).
    """
    check_entries(static, StaticResult, static_entries(case), "static solution")
    gears: GearPair = static.planetary_set
    model, friction = pair_model(case, gears), acting_friction(case, gears)
    excitation = pair_excitation(case, static, friction)
    mean, ratio = excitation.stiffness.mean(axis=1), case.dynamics.damping_ratio
    modes = undamped_modes(model.system, mean, damping_ratio=ratio)
    modes = replace(modes, kind=pair_kinds(modes, model.system.M))
    frictionless = None if friction is None else pair_excitation(case, static, None)
    made = gears, model, balanced_source(excitation, modes), modes, modal_entries(case)
    return PairModesResult(*made, frictionless)


def _harmonics(case: PairCase, modes: Modes, mesh_frequency: np.ndarray) -> np.ndarray:
    """Count the harmonics of excitation and response (2, s) at mesh frequencies (s,) [Hz]."""
    given, up_to = case.dynamics, max(_LOWEST, _ABOVE_MODES * float(modes.frequency.max()))
    least, up_to = (1, given.up_to) if given.up_to else (_LEAST, up_to)
    count = np.clip(np.floor(up_to / mesh_frequency * (1.0 + 1e-12)), least, _HARMONICS)
    excitation = np.full(len(count), given.mesh_harmonics) if given.mesh_harmonics else count.astype(int)
    # products with the low harmonics of the stiffness reach beyond the excitation
    response = given.response_harmonics or excitation + 2 * np.minimum(excitation, 6)
    return np.stack([excitation, np.maximum(response, excitation)])


def _linear(
    case: PairCase, modes: PairModesResult, frequency: np.ndarray, harmonics: np.ndarray, *, friction: bool = True
) -> tuple[Response, PairMotion]:
    """Solve for the response with flanks held together at mesh frequencies (s,) [Hz], friction left out or not."""
    basis, model = modes.modes, modes.model
    response = solve_spectral(
        basis,
        modes.excitation if friction or modes.frictionless is None else modes.frictionless,
        frequency,
        excitation_harmonics=harmonics[0],
        response_harmonics=harmonics[1],
        tolerance=case.dynamics.tolerance,
    )
    motion = output_response(
        basis,
        response,
        model.rows @ basis.shape,
        load=output_load(model.system, basis, model.rows),
        residual=residual_output(model.system, basis, model.rows),
        source=source_output(model.system, basis, model.rows),
    )
    force = sample(response.force[:, 0], 4 * response.force.shape[-1])
    measured = model.measured(motion, response.force[:, 0], response.source)
    extremes, closed = (force.max(axis=1), force.min(axis=1)), np.ones(len(force))
    lines = np.array(response.deflection), np.array(response.force)
    return response, PairMotion(*lines, *measured, *extremes, closed, np.zeros(len(force)))


def _parted(
    model: PairModel,
    problem: NonlinearSystem,
    solutions: Sequence[PeriodicSolution],
    size: int,
    source: np.ndarray | None,
) -> PairMotion:
    """Collect the motion of solutions with play, their lines filled with zeros up to a harmonic, as sources (3, .)."""
    lines, reduction, mesh = np.zeros((len(solutions), 7, size + 1), complex), reduced(problem), problem.elements[0]
    assert isinstance(mesh, GearMeshes)
    for row, solution in zip(lines, solutions, strict=True):
        parts = solution.deflection, solution.force, displacements(problem, solution, model.rows, reduction=reduction)
        row[:, : len(solution.orders)] = np.concatenate(parts)
    phase = 2.0 * np.pi * np.arange(_INSTANTS)[:, None] / _INSTANTS
    x = sample(lines[:, 0], _INSTANTS)[..., None, None]
    _, drive, back, has_back = mesh.flank_forces(x, phase)
    force, closed = mesh.evaluate(x, phase)[0][..., 0, 0], (drive > 0.0, has_back & (back < 0.0))
    measures = force.max(axis=1), force.min(axis=1), *(closed_there.mean(axis=(1, 2)) for closed_there in closed)
    measured = model.measured(lines[:, 2:], lines[:, 1], source)
    return PairMotion(lines[:, :1], lines[:, 1:2], *measured, *measures)


def _with_play(problem: NonlinearSystem, frequency: float, start: np.ndarray, case: PairCase) -> PeriodicSolution:
    """Solve the balance with play at a mesh frequency [Hz] from lines (1, H + 1) of the approach on."""
    options = {"harmonics": start.shape[-1] - 1, "radius": False}
    solution = solve_harmonic_balance(problem, 2.0 * np.pi * frequency, start=start, **options)
    if not solution.converged:
        solution = solve_harmonic_balance(problem, 2.0 * np.pi * frequency, **options)
    if not solution.converged:
        damped = case.dynamics.damping_ratio > 0.0
        key = "operation.speeds" if damped else "dynamics.damping_ratio"
        raise ConvergenceError(
            f"no motion with contact loss at a mesh frequency of {frequency:.6g} Hz; {solution.message}",
            code="E-CONVERGENCE",
            key=key,
            value=f"relative residual {solution.residual:.2e}",
            file=case.location(key),
            remedy="raise dynamics.damping_ratio, or leave the speed out",
        )
    return solution


@one_blas_thread()
def solve_pair_dynamics(case: PairCase, modes: PairModesResult, *, progress: Progress = silent) -> PairDynamicsResult:
    """Solve for the periodic response at all speeds, with play where the linear one pulls, and its stability.

    ConvergenceError: an undamped resonance, or a motion with contact loss that is not found.
    """
    return next(pair_dynamics_parts(case, modes, progress=progress, most=len(case.operation.speeds)))[1]


def pair_dynamics_parts(
    case: PairCase, modes: PairModesResult, *, progress: Progress = silent, most: int = _TOGETHER
) -> Iterator[tuple[PairCase, PairDynamicsResult]]:
    """Solve as `solve_pair_dynamics` for ``most`` speeds after the others, each with the case of these."""
    check_entries(modes, PairModesResult, modal_entries(case), "modal basis")
    basis, excitation, count = modes.modes, modes.excitation, len(case.operation.speeds)
    for numbers, part in parts_of_speeds(case, np.ones(count), most):
        speeds = np.array(part.operation.speeds)
        frequency = speeds * case.gear_1.teeth / (2.0 * np.pi)
        harmonics = _harmonics(case, basis, frequency)
        response, motion = _linear(case, modes, frequency, harmonics)
        change = None
        if modes.frictionless is not None:
            without = _linear(case, modes, frequency, harmonics, friction=False)[1]
            change = 20.0 * np.log10(motion.bearing_rms / without.bearing_rms)
        decisive = decisive_harmonics(basis, excitation, int(harmonics[0].max()))
        judged = stability(basis, excitation, frequency, excitation_harmonics=decisive)
        multiplier, method = judged.multiplier.copy(), list(response.method)
        verdicts = {name: np.array(getattr(response, name)) for name in _TOLD}
        for s in np.flatnonzero(motion.lowest < 0.0):
            problem = separating_pair(modes.model, basis, excitation, int(harmonics[0, s]))
            start = response.deflection[s, :, : harmonics[1, s] + 1]
            solution = _with_play(problem, frequency[s], start, case)
            rubbing = None if response.source is None else response.source[s]
            part_motion = _parted(modes.model, problem, [solution], motion.dte.shape[-1] - 1, rubbing)
            for name, values in vars(part_motion).items():
                getattr(motion, name)[s] = values[0]
            for name in _TOLD:
                verdicts[name][s] = getattr(solution, name)
            multiplier[s], method[s] = [*solution.verdict.multipliers, np.nan][0], "harmonic balance"
        lines = {"deflection": motion.deflection, "force": motion.force, "lowest_force": motion.lowest}
        response = replace(response, **lines, **verdicts, method=tuple(method))
        judged, reach = replace(judged, multiplier=multiplier), harmonics[0] * frequency
        play = modes.excitation.backlash
        yield part, PairDynamicsResult(modes.gears, speeds, motion, response, judged, reach, play, change)
        progress("dynamics", float(numbers[-1] + 1), float(count))


@one_blas_thread()
def solve_pair_runup(case: PairCase, modes: PairModesResult) -> PairRunupResult:
    """Follow transmission error, mesh and bearing forces over the speed, and the branch where flanks part.

    ConvergenceError: as `solve_pair_dynamics`.
    """
    check_entries(modes, PairModesResult, modal_entries(case), "modal basis")
    basis, per_speed = modes.modes, case.gear_1.teeth / (2.0 * np.pi)
    operating, (first, last) = np.array(case.operation.speeds), runup_range(case)
    row, most = modes.model.rotation @ basis.shape, _harmonics(case, basis, np.array([first * per_speed]))
    forces = modal_forces(basis, modes.excitation, int(most[0, 0]), output=row[:, None])
    crossed = crossings(forces, first * per_speed, last * per_speed, math.inf)
    resonance, mode = crossed.mesh_frequency / per_speed, forces.mode[crossed.row]
    expected_level, damping = forces.output_level[crossed.row, crossed.harmonic - 1], forces.damping_ratio[crossed.row]
    speeds = refined_speeds(np.linspace(first, last, case.runup.count), resonance, expected_level, damping)
    speeds = merged_speeds(operating[(operating >= first) & (operating <= last)], speeds)
    harmonics = _harmonics(case, basis, speeds * per_speed)
    response, motion = _linear(case, modes, speeds * per_speed, harmonics)
    nearest, beside = (np.abs(speeds_there[:, None] - resonance).argmin(axis=0) for speeds_there in (speeds, operating))
    alone = np.abs(row[mode] * response.modal[nearest, mode, crossed.harmonic]) / math.sqrt(2.0)
    table = {
        "mode": mode + 1,
        "kind": [basis.kind[i] for i in mode],
        "mesh_harmonic": crossed.harmonic,
        "frequency": forces.frequency[crossed.row],
        "resonance_speed": resonance / RPM,
        "share": forces.share[crossed.row, crossed.harmonic - 1],
        "resonance_alone": alone,
        "operating_speed": operating[beside] / RPM,
        "distance": 100.0 * (resonance / operating[beside] - 1.0),
    }
    return PairRunupResult(
        modes.gears,
        speeds,
        speeds * per_speed,
        motion,
        harmonics[0] * speeds * per_speed,
        table,
        operating,
        unresolved(speeds, resonance, expected_level, damping),
        *_branch(case, modes, speeds, motion.lowest),
    )


def _branch(case: PairCase, modes: PairModesResult, speeds: np.ndarray, lowest: np.ndarray):
    """Follow the motions with play from above the speeds at which the linear one pulls to below them."""
    apart, teeth = np.flatnonzero(lowest < 0.0), case.gear_1.teeth
    if not len(apart):
        return None, True, "flanks stay in contact at all speeds"
    high, low = min(_ABOVE * speeds[apart[-1]], speeds[-1]), max(_BELOW * speeds[apart[0]], speeds[0])
    harmonics = _harmonics(case, modes.modes, np.array([low * teeth / (2.0 * np.pi)]))[:, 0]
    count, size = (min(int(harmonic), most) for harmonic, most in zip(harmonics, _ON_BRANCH, strict=True))
    problem = separating_pair(modes.model, modes.modes, modes.excitation, count)
    # teeth that strike travel as far as the flanks approach at rest and the play together
    scale = float(modes.excitation.deflection.max() + modes.excitation.backlash[0])
    options = {"harmonics": size, "radius": False, "scale": scale, "options": _STEPS}
    curve = frequency_response_curve(problem, (float(high * teeth), float(low * teeth)), **options)
    far = np.abs(curve.lines[:, 0]).sum(axis=1) > LARGEST_APPROACH * case.module
    kept = max(int(far.argmax()), 1) if far.any() else len(far)
    rubbing = source_harmonics(modes.excitation, count)
    rubbing = None if rubbing is None else np.pad(rubbing, ((0, 0), (0, size - count)))
    motion = _parted(modes.model, problem, curve.solutions[:kept], size, rubbing)
    along = curve.parameter[:kept] / teeth
    parts, folds = along[motion.drive < 1.0] / RPM, np.sort(along[curve.folds[curve.folds < kept]]) / RPM
    span = f"from {parts.min():.6g} to {parts.max():.6g} rpm" if len(parts) else "nowhere"
    listed, ending = ", ".join(f"{fold:.6g}" for fold in folds) or "none", "it came to the end of its range"
    if not curve.complete:
        ending = curve.message
    if far.any():
        grown = float(fluctuation(motion.dte[-1:])[0, 0])
        ending = f"it ends at {along[-1] / RPM:.6g} rpm, {_unbounded(modes, along[-1] * teeth, count, grown)}"
    words = f"along the branch flanks part {span}, limit points at {listed} rpm; {ending}"
    return (along, motion, curve.stable[:kept]), bool(curve.complete and not far.any()), words


def _unbounded(modes: PairModesResult, omega: float, count: int, grown: float) -> str:
    """Tell how far flanks travel at the end of a branch, and how near the linear motion is to growing.

    To motions that large the play is nothing, and the linear equations decide whether they decay.
    """
    hertz = np.array([omega / (2.0 * np.pi)])
    judged = stability(modes.modes, modes.excitation, hertz, excitation_harmonics=count)
    return (
        f"where the transmission error has {1e3 * grown:.3g} mm r.m.s.: beyond, flanks travel more than "
        f"{LARGEST_APPROACH:g} modules; with flanks held together the largest Floquet multiplier is "
        f"{float(np.abs(judged.multiplier[0])):.4f} there, and from 1 on nothing bounds motions"
    )


def _dynamic_model(case: PairCase, results: Mapping[str, Any]) -> DynamicModel:
    modes: PairModesResult = results["modes"]
    return pair_dynamic_model(case, modes.gears, modes.model, modes.modes, modes.excitation)


def loaded_pair(
    case: Any, speed: float | None = None, *, cache: Path | None = None, steps: Steps | None = None
) -> tuple[MeshingTeeth, ...]:
    """Solve the contact of the teeth of a pair, and find its mesh frequency at a speed of gear 1 [rad/s].

    CaseError: no speed (E-KEY-MISSING).
    """
    frequency = speed_of_wear(case, speed) * case.gear_1.teeth / (2.0 * math.pi)
    return (MeshingTeeth("", solve_static(case, cache=cache, steps=steps), abs(frequency)),)


PAIR = Train(
    name="pair",
    words="a pair",
    meshing_teeth=loaded_pair,
    stages=(
        replace(STATIC, describe=_describe_static),
        STRESS,
        LOSSES,
        HEAT,
        LIFE,
        Stage(
            name="modes",
            title="Modes",
            solve=solve_pair_modes,
            takes=("static",),
            verdict=modes_verdict,
            describe=lambda results: describe_modes(results.modes, {"damping ratio": _damping}),
            unavailable=_no_modes,
        ),
        Stage(
            name="dynamics",
            title="Dynamics",
            solve=solve_pair_dynamics,
            parts=pair_dynamics_parts,
            takes=("modes",),
            options=("progress",),
            verdict=lambda result: result.verdict,
            describe=lambda results: describe_dynamics(results.dynamics),
            unavailable=_no_speeds,
            warnings=PairDynamicsResult.warnings,
            concerned_by={"": ("W-FRICTION",)},
        ),
        Stage(
            name="runup",
            title="Run-up",
            solve=solve_pair_runup,
            takes=("modes",),
            verdict=lambda result: result.verdict,
            describe=lambda results: describe_pair_runup(results.runup),
            wanted=lambda case: case.runup.count > 1,
            unavailable=lambda case: _no_speeds(case) or ("" if case.runup.count > 1 else "runup.count leaves it out"),
            warnings=PairRunupResult.warnings,
            concerned_by={"": ("W-FRICTION",)},
        ),
    ),
    describe=_describe_case,
    warnings=_warnings,
    bodies=case_bodies,
    judgements=set_judgements,
    duty=pair_duty,
    front=(("run_up_levels", 1), ("static_transmission_error", 0)),
    figures={
        name: Figures({**figures.captions, **_CAPTIONS}, figures.draw, figures.write) if name == "static" else figures
        for name, figures in FIGURES.items()
    }
    | {"dynamics": DYNAMICS, "runup": RUNUP},
    recorded=Recorded(pair_signals, pair_signal_extent, {"wav": ("dynamics",)}, lambda results: 3),
    verdict=strength_verdict,
    key_figures=pair_key_figures,
    dynamic_model=_dynamic_model,
)
