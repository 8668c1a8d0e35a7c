"""The pipeline of a helical case: static (where no mesh stiffness is given) -> modes -> dynamics.

`HELICAL` at the end is the train: the table of its stages, with what the report says and draws of each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Steps, check_entries, static_entries
from femgear.case.gear_set import planetary_set
from femgear.case.tooth_friction import friction_acts
from femgear.errors import CaseError
from femgear.gears import profile
from femgear.report.tables import describe_modes, describe_response
from femgear.solvers.linear.modal import output_load, output_response, residual_output, source_output
from femgear.solvers.periodic.spectral import joint_message, solve_spectral
from femgear.solvers.stability.parametric import stability as floquet_verdict
from femgear.stages.duty import set_duty
from femgear.stages.friction_source import balanced_source
from femgear.stages.gears_in_space import case_bodies
from femgear.stages.heat import HEAT
from femgear.stages.life import LIFE, LifeResult, solve_life
from femgear.stages.losses import LOSSES
from femgear.stages.lumped_model import lumped_dynamic_model
from femgear.stages.lumped_set import (
    driving_torque,
    gear_set_modes,
    member_speeds,
    needed,
    parts_of_speeds,
    rotation_sense,
)
from femgear.stages.protocol import (
    FiguresOf,
    Progress,
    Stage,
    Train,
    modes_verdict,
    one_blas_thread,
    response_verdict,
    silent,
)
from femgear.stages.static import (
    STATIC,
    STRESS,
    frictionless_cycle,
    loaded_set,
    mesh_backlash,
    solve_static,
    solve_stress,
)
from femgear.stages.static_results import StaticResult, StressResult, describe_set
from femgear.stages.strength_results import strength_verdict
from femgear.stages.tooth_figures import tooth_key_figures
from femgear.stages.train_judgements import set_judgements
from femgear.system.mesh_directions import (
    free_motions,
    friction_directions,
    gear_set_system,
    mesh_directions,
    pin_directions,
)
from femgear.system.mode_kinds import gear_set_motions, phasing
from femgear.system.rigid_bodies import flank_sign
from femgear.system.system import MeshExcitation, Response
from femgear.trains.helical.model import (
    SectionStiffness,
    check_helical_case,
    contact_ratios,
    helical_data,
    helical_excitation,
    helical_friction,
    helical_warnings,
    normal_record,
    section_stiffness,
    shared_load,
)
from femgear.trains.helical.results import (
    HelicalDynamicsResult,
    HelicalModesResult,
    describe_helical,
    describe_helical_static,
)
from femgear.trains.helical.section import HelicalCase

if TYPE_CHECKING:
    from femgear.contact.mesh_cycle import MeshCycle
    from femgear.exchange.dynamic_model import DynamicModel
    from femgear.storage.results import Results

_NOTHING_EXCITES = "a given helical.mesh_stiffness does not vary: nothing excites the set"
_NO_TEETH = "a given helical.mesh_stiffness takes the place of the static solution"
_TOGETHER = 500
"""Speeds that are in memory at a time."""
_SPUR_TEETH = ("static_transmission_error", "mesh_stiffness", "load_sharing", "tooth_loads")


def solve_helical_static(
    case: HelicalCase,
    *,
    cache: Path | None = None,
    progress: Progress = silent,
    steps: Steps | None = None,
) -> StaticResult:
    """Solve the spur gears of the transverse section, the whole face width loaded at once."""
    return solve_static(_drive_flanks(case), cache=cache, progress=progress, steps=steps)


def solve_helical_stress(case: HelicalCase, static: StaticResult, *, progress: Progress = silent) -> StressResult:
    """Find the stresses of the teeth whose contact was solved in slices over the width."""
    return solve_stress(_drive_flanks(case), static, progress=progress)


def solve_helical_life(
    case: HelicalCase,
    static: StaticResult,
    *,
    cache: Path | None = None,
    progress: Progress = silent,
    steps: Steps | None = None,
) -> LifeResult:
    """Solve for the lives of all roots and flanks over the load cases, on drive flanks alone."""
    return solve_life(_drive_flanks(case), static, cache=cache, progress=progress, steps=steps)


def _drive_flanks(case: HelicalCase) -> HelicalCase:
    """The case whose static solution has drive flanks alone."""
    plain = case.static.model_copy(update={"stresses": False, "back_flanks": False})
    return case.model_copy(update={"static": plain})


@one_blas_thread()
def solve_helical_modes(
    case: HelicalCase,
    static: StaticResult | None = None,
    *,
    section: SectionStiffness | None = None,
    cache: Path | None = None,
) -> HelicalModesResult:
    """Solve for natural frequencies, modes, their kinds and phasing.

    CaseError: what `check_helical_case` refuses.

    Parameters
    ----------
    case : Case
        With a section helical.
    static : StaticResult, optional
        Of `solve_helical_static`; needed where the case gives no mesh stiffness.
    section : SectionStiffness, optional
        Of `section_stiffness`, where it is known already.
    cache : path, optional
        Folder of generated grids.
    """
    gears = planetary_set(case)
    check_helical_case(case, gears)
    excitation, whole, frictionless = None, None, None
    if case.helical.mesh_stiffness is None:
        static = needed(static, "static")
        check_entries(static, StaticResult, static_entries(_drive_flanks(case)), "static solution")
        factor, in_contact = np.ones(2), case.static.slices > 1
        if case.helical.section == "normal" and not in_contact:
            section = section or section_stiffness(case, gears, cache=cache)
            factor = section.factor
        sense, beta = rotation_sense(case, gears), case.helical.helix_angle
        # contact in slices has the helix in it
        overlap = np.repeat(contact_ratios(gears, helix_angle=beta)[:, 1], gears.n_planets) * (not in_contact)
        base = profile.base_helix_angle(case.sun.pressure_angle, beta)
        hand = sense * (1 if case.helical.hand == "right" else -1)
        sliced = {"slices": case.helical.slices, "hand": hand}

        def along_normals(cycle: MeshCycle) -> tuple[MeshExcitation, MeshExcitation]:
            spur = MeshExcitation(cycle.stiffness, cycle.deflection, cycle.force, mesh_backlash(gears))
            record = normal_record(spur, factor, base, reversed_time=sense < 0)
            source = helical_friction(cycle, overlap, **sliced, reversed_time=sense < 0)
            return record, replace(helical_excitation(record, overlap, **sliced), source=source)

        record, excitation = along_normals(static.cycle)
        whole = record if in_contact else shared_load(helical_excitation(record, overlap))
        if friction_acts(case):
            frictionless = along_normals(frictionless_cycle(_drive_flanks(case), static))[1]
    data = helical_data(case, gears, None if whole is None else whole.stiffness.mean(axis=1))
    torque = driving_torque(case)
    system, flank = gear_set_system(data, torque=torque, friction=friction_acts(case)), flank_sign(data, torque)
    stiffness = data.column_stiffness if excitation is None else excitation.stiffness.mean(axis=1)
    modes = gear_set_modes(data, system=system, mesh_stiffness=stiffness, damping_ratio=case.dynamics.damping_ratio)
    phases = phasing(gear_set_motions(data, modes.shape))
    if excitation is not None:
        excitation = balanced_source(excitation, modes)
    return HelicalModesResult(gears, data, system, modes, phases, flank, section, excitation, whole, frictionless)


@one_blas_thread()
def solve_helical_dynamics(
    case: HelicalCase, modes: HelicalModesResult, *, progress: Progress = silent
) -> HelicalDynamicsResult:
    """Solve for the periodic response at all speeds by the spectral method, with a Floquet verdict at each.

    ConvergenceError: as `femgear.solvers.periodic.spectral.solve_spectral`.
    """
    return next(helical_dynamics_parts(case, modes, progress=progress, most=len(case.operation.speeds)))[1]


def helical_dynamics_parts(
    case: HelicalCase, modes: HelicalModesResult, *, progress: Progress = silent, most: int = _TOGETHER
) -> Iterator[tuple[HelicalCase, HelicalDynamicsResult]]:
    """Solve as `solve_helical_dynamics`, but for rounding, for ``most`` speeds after the others.

    Each result comes with the case that has these speeds alone.
    """
    if modes.excitation is None:
        remedy = "leave it out: the static solution then gives a stiffness that varies"
        raise CaseError(_NOTHING_EXCITES, code="E-STAGE", key="helical.mesh_stiffness", remedy=remedy)
    count, responses = len(case.operation.speeds), list[Response]()
    for numbers, part in parts_of_speeds(case, np.ones(count), most):
        speeds = part.operation.speeds
        turning = tuple(member_speeds(case, modes.planetary_set, speed) for speed in speeds)
        frequency = np.array([speeds_there.mesh_frequency for speeds_there in turning])
        response = solve_spectral(
            modes.modes,
            modes.excitation,
            frequency,
            excitation_harmonics=case.mesh_harmonics,
            response_harmonics=case.response_harmonics,
            tolerance=case.dynamics.tolerance,
        )
        verdict = floquet_verdict(modes.modes, modes.excitation, frequency, excitation_harmonics=case.mesh_harmonics)
        responses.append(response.without_lines())
        loads, change = _loads(modes, response), None
        response = replace(response, message=joint_message(responses))
        if modes.frictionless is not None:
            without = solve_spectral(
                modes.modes,
                modes.frictionless,
                frequency,
                excitation_harmonics=case.mesh_harmonics,
                response_harmonics=case.response_harmonics,
                tolerance=case.dynamics.tolerance,
                radius=False,
            )
            change = 20.0 * np.log10(_fluctuating(loads) / _fluctuating(_loads(modes, without)))
        yield part, HelicalDynamicsResult(modes, np.array(speeds), turning, response, verdict, loads, change)
        progress("dynamics", float(numbers[-1] + 1), float(count))


def _fluctuating(loads: dict[str, np.ndarray]) -> np.ndarray:
    """Root mean square (speeds,) of the forces of all supports about their means [N]."""
    return np.sqrt(0.5 * (np.abs(loads["support"][:, :, :3, 1:]) ** 2).sum(axis=(1, 2, 3)))


def _loads(result: HelicalModesResult, response: Response) -> dict[str, np.ndarray]:
    """Loads of pins on planets and of supports on central members, harmonics (speeds, ..., 6, H + 1)."""
    data, system, basis = result.data, result.system, result.modes
    T, pins, N = free_motions(data), pin_directions(data), data.n_planets
    scale = np.hstack([np.ones((3, 3)), np.repeat(data.radii[:3, None], 3, axis=1)])
    springs = data.support_stiffness
    stiffness = np.where(np.isinf(springs), 0.0, springs)
    rows = np.concatenate(
        [
            -(data.pin_stiffness[..., None] * pins.transpose(1, 2, 0)).reshape(6 * N, -1) @ T,
            -(stiffness / scale).reshape(18, 1) * T[:18],
        ]
    )
    forces = output_response(
        basis,
        response,
        rows @ basis.shape,
        residual=residual_output(system, basis, rows),
        load=output_load(system, basis, rows),
        source=source_output(system, basis, rows),
    )
    pin, support = forces[:, : 6 * N], forces[:, 6 * N :].copy()
    # what holds a motion takes up what meshes and pins exert on it
    W, rubbed = mesh_directions(data, result.flank)[:18], friction_directions(data, result.flank)[:18]
    for row in np.flatnonzero(np.isinf(springs).ravel()):
        meshes = np.einsum("j,sjh->sh", W[row], response.force)
        if response.source is not None:
            meshes = meshes - np.einsum("j,sjh->sh", rubbed[row], response.source[:, :-1])
        on_pins = np.einsum("p,sph->sh", pins[row].reshape(-1), pin)
        support[:, row] = (meshes - on_pins) * scale.ravel()[row]
    shape = (len(forces), -1, 6, forces.shape[-1])
    return {"pin": pin.reshape(shape), "support": support.reshape(shape)}


def _remarks(results: Results, stem: str) -> Iterator[str]:
    if stem in _SPUR_TEETH:
        yield "Transverse spur section: these are spur gears of that section, not yet the helical ones."


def _given(case: HelicalCase) -> bool:
    return case.helical.mesh_stiffness is not None


def _dynamic_model(case: HelicalCase, results: Mapping[str, Any]) -> DynamicModel:
    modes: HelicalModesResult = results["modes"]
    excitation = modes.excitation
    if excitation is None:
        k = np.repeat(modes.data.column_stiffness[:, None], 3, axis=1)
        excitation = MeshExcitation(k, 0.0 * k, 0.0 * k, np.zeros(len(k)))
    torque = driving_torque(case)
    return lumped_dynamic_model(case, modes.planetary_set, modes.data, modes.system, modes.modes, excitation, torque)


HELICAL = Train(
    name="helical",
    words="a helical case",
    meshing_teeth=partial(loaded_set, solve=solve_helical_static),
    stages=(
        replace(
            STATIC,
            solve=solve_helical_static,
            describe=lambda results: describe_helical_static(
                results.static,
                results.modes if "modes" in results.stages else None,
            ),
            unavailable=lambda case: _NO_TEETH if _given(case) else "",
        ),
        replace(
            STRESS,
            solve=solve_helical_stress,
            wanted=lambda case: not _given(case) and case.static.slices > 1 and case.static.stresses,
            unavailable=lambda case: _NO_TEETH if _given(case) else STRESS.unavailable(case),
        ),
        replace(LOSSES, unavailable=lambda case: _NO_TEETH if _given(case) else LOSSES.unavailable(case)),
        replace(HEAT, unavailable=lambda case: _NO_TEETH if _given(case) else HEAT.unavailable(case)),
        replace(
            LIFE,
            solve=solve_helical_life,
            unavailable=lambda case: _NO_TEETH if _given(case) else LIFE.unavailable(case),
        ),
        Stage(
            name="modes",
            title="Modes",
            solve=solve_helical_modes,
            takes=("static",),
            options=("cache",),
            verdict=modes_verdict,
            describe=lambda results: describe_modes(results.modes),
            needs=lambda case: () if _given(case) else ("static",),
            check=lambda case: check_helical_case(case, planetary_set(case)),
        ),
        Stage(
            name="dynamics",
            title="Dynamics",
            solve=solve_helical_dynamics,
            parts=helical_dynamics_parts,
            takes=("modes",),
            options=("progress",),
            verdict=response_verdict,
            describe=lambda results: describe_response(results.dynamics, results.findings),
            unavailable=lambda case: _NOTHING_EXCITES if _given(case) else "",
            warnings=HelicalDynamicsResult.warnings,
            concerned_by={"": ("W-FRICTION",)},
        ),
    ),
    describe=lambda case: (*describe_set(case), *describe_helical(case, planetary_set(case))),
    warnings=helical_warnings,
    bodies=case_bodies,
    judgements=set_judgements,
    duty=set_duty,
    front=(("speed_sweep", 0), ("helical_mesh_stiffness", 1), ("dynamic_transmission_error", 0)),
    figures=FiguresOf("femgear.trains.helical.figures:FIGURES"),
    remarks=_remarks,
    verdict=strength_verdict,
    key_figures=tooth_key_figures,
    dynamic_model=_dynamic_model,
    stiffness_curves=("modes", "helical_stiffness", "helical_ste"),
)
