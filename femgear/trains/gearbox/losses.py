"""Stage "losses" of a gearbox: teeth and bearings of all load cases, torques with losses, efficiency.

The teeth lose by the loads of their contact, with the misalignment that the gearbox gives them, bearings by Palmgren's
formula. What meshes of given stiffness lose is unknown, and with it the efficiency of a gearbox whose power passes
them. Bearings of given stiffness lose nothing here. Findings say so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.dependencies import Steps, loss_entries
from femgear.case.lubrication import heat_missing, losses_wanted, oil_at
from femgear.case.messages import oil_notices
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.gears.power_losses import FrictionTorque, lossy_flow
from femgear.report.tables import merged_names
from femgear.stages.heat import heat_result, mesh_heat
from femgear.stages.heat_results import HeatResult, MeshHeat, describe_heat, heat_tables
from femgear.stages.losses import NO_LOSSES, check_loss_entries, losses_of_meshes, mesh_friction, seal_frictions
from femgear.stages.losses_results import LossesResult, LossPoint, MeshFriction, describe_losses, loss_tables
from femgear.stages.planet_bearings import has_planet_friction, planet_friction
from femgear.stages.protocol import Progress, Stage, one_blas_thread, silent
from femgear.system.bearing_friction import (
    OIL_BATH,
    FrictionFactors,
    friction_kind,
    friction_load,
    load_factor,
)
from femgear.trains.gearbox.case_file import (
    CASING,
    BoxPlanetarySection,
    GearboxCase,
    LoadCaseSection,
    teeth_of,
)
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.key_figures import stage_meshes
from femgear.trains.gearbox.life import turning_speed
from femgear.trains.gearbox.power import flow_entries, stage_conditions

if TYPE_CHECKING:
    from femgear.trains.gearbox.results import DeflectionResult


def bearing_torque(state: Deflection, number: int, speed_share: float = 1.0) -> float:
    """Compute the friction torque of a bearing [N m] at a share of the speeds; NaN where nothing tells its friction."""
    case = state.model.case
    section = case.bearing[number]
    if section.kind is None or section.pitch_diameter is None:
        return math.nan
    force = state.bearing_force[number]
    radial, axial = math.hypot(force[0], force[1]), float(force[2])
    try:
        factor = section.load_friction
        if factor is None:
            factor = load_factor(section.kind, section.contact_angle, radial, axial, section.static_rating)
    except CaseError:
        return math.nan
    bath = section.lubricant_friction
    bath = OIL_BATH[friction_kind(section.kind, section.contact_angle)] if bath is None else bath
    load = friction_load(section.kind, section.contact_angle, radial, axial)
    turns = 2.0 * math.pi * turning_speed(state, number) * speed_share
    return FrictionFactors(factor, bath).torque(load, section.pitch_diameter, turns, _kinematic(case))


def _kinematic(case: GearboxCase) -> float | None:
    """Kinematic viscosity of the oil in operation [m^2/s]; None where the case has none."""
    if case.lubricant is None:
        return None
    return oil_at(case) / case.lubricant.density


def loss_point(state: Deflection, load_case: LoadCaseSection, speed_share: float = 1.0) -> LossPoint:
    """Compute the losses of a loaded state at a share of the speeds of its load case."""
    model, case = state.model, state.model.case
    speed = {shaft: speed_share * value for shaft, value in model.flow.speed.items()}
    friction: dict[str, MeshFriction] = {}
    for name, contact in state.contacts.items():
        frequency = abs(model.flow.mesh_frequency[name]) * speed_share
        helix = contact.case.helix_angle or 0.0
        friction[name] = mesh_friction(contact.case, contact.result, frequency, helix_angle=helix, rules=case)
    torques = {}
    if case.losses is not None and case.losses.bearings:
        torques = {name: bearing_torque(state, number, speed_share) for number, name in enumerate(model.bearing_names)}
    rings: dict[str, tuple[str | None, str | None]] = {
        name: (section.shaft, section.outer_shaft if section.outer_shaft != CASING else None)
        for name, section in zip(model.bearing_names, case.bearing, strict=True)
    }
    seals = [] if case.losses is None else seal_frictions(case.losses, [shaft.name for shaft in case.shaft])
    for stage, torque in _planet_torques(state, speed_share).values():
        torques[f"{stage.name} planets"] = torque
        sun, carrier = (None if shaft == CASING else shaft for shaft in (stage.sun, stage.carrier))
        rings[f"{stage.name} planets"] = sun, carrier
    flow = lossy_flow(
        [shaft.name for shaft in case.shaft],
        stage_conditions(case),
        speeds=speed,
        efficiencies={name: of_stage.passed for name, of_stage in friction.items()},
        friction=[
            *seals,
            *(FrictionTorque(name, rings[name], torque) for name, torque in torques.items() if math.isfinite(torque)),
        ],
        lossless=model.flow.stage_torque,
        **flow_entries(case, load_case),
    )
    sets = {name: contact.result.planetary_set for name, contact in state.contacts.items()}
    return LossPoint(
        flow,
        friction,
        {name: losses_of_meshes(flow, name, friction[name], sets[name]) for name in friction},
        {name: flow.friction_loss.get(name, math.nan) for name in torques},
        {seal.name: flow.friction_loss[seal.name] for seal in seals},
        tuple(name for name, drives in flow.first_drives.items() if drives is not None and name not in friction),
    )


def _planet_torques(state: Deflection, speed_share: float) -> dict[str, tuple[BoxPlanetarySection, float]]:
    """Friction of the planets' bearings of sets whose teeth tell it, as torques between sun and carrier [N m]."""
    case, torques = state.model.case, {}
    for stage in case.planetary if case.losses is not None and case.losses.bearings else ():
        teeth = teeth_of(stage)
        if teeth is None or not has_planet_friction(teeth):
            continue
        contact = state.contacts.get(stage.name)
        torques[stage.name] = (
            stage,
            0.0
            if contact is None
            else planet_friction(
                contact.case,
                contact.result.planetary_set,
                contact.result.cycle,
                carrier_speed=speed_share * state.model.flow.speed.get(stage.carrier, 0.0),
                mesh_frequency=speed_share * state.model.flow.mesh_frequency[stage.name],
                viscosity=_kinematic(case),
            ),
        )
    return torques


@one_blas_thread()
def solve_box_losses(
    case: GearboxCase, deflection: DeflectionResult, *, progress: Progress = silent, steps: Steps | None = None
) -> LossesResult:
    """Compute losses and efficiency of all load cases, and the map over torque and speed of the chosen one.

    The gearbox is solved again for every torque of the map.
    """
    loaded, cases, losses = deflection.of(case), case.operation.load_case, case.losses
    assert losses is not None
    points = _with_idle_stages(
        [loss_point(state, load_case) for state, load_case in zip(loaded.states, cases, strict=True)],
        [stage.name for stage in (*case.pair, *case.planetary)],
    )
    chosen = cases[loaded.chosen]
    efficiency = np.zeros((len(losses.torque_shares), len(losses.speed_shares)))
    for row, share in enumerate(losses.torque_shares):
        progress("losses", row, len(efficiency))
        torque = {port: share * value for port, value in chosen.torque.items()}
        with_torque = chosen.model_copy(update={"torque": torque})
        state = loaded.state if share == 1.0 else solve_deflection(case, with_torque, steps=steps)
        efficiency[row] = [loss_point(state, with_torque, each).efficiency for each in losses.speed_shares]
    named = {stage.name: stage_meshes(stage) for stage in (*case.pair, *case.planetary)}
    meshes = {name: named[name] for name in points[0].stages}
    missing = tuple(_left_out(case, points[0]))
    return LossesResult(points, meshes, "load_case", [each.name for each in cases], losses, efficiency, missing)


def _with_idle_stages(points: Sequence[LossPoint], names: Sequence[str]) -> tuple[LossPoint, ...]:
    """Give points in which a stage carries nothing the zeros of its meshes, where another point has the stage."""
    carrying = {name: point.friction[name] for point in points for name in point.friction}
    idle = {
        name: replace(
            friction,
            coefficient=0.0 * friction.coefficient,
            factor=0.0 * friction.factor,
            force=0.0 * friction.force,
            passed=(1.0,) * len(friction.passed),
        )
        for name, friction in carrying.items()
    }
    stages = [name for name in names if name in carrying]
    return tuple(
        replace(
            point,
            friction={name: point.friction.get(name, idle[name]) for name in stages},
            mesh_loss={name: point.mesh_loss.get(name, idle[name].force) for name in stages},
        )
        for point in points
    )


@one_blas_thread()
def solve_box_heat(case: GearboxCase, deflection: DeflectionResult, losses: LossesResult) -> HeatResult:
    """Compute temperatures and oil film of all stages with teeth, in all load cases."""
    loaded = deflection.of(case)
    points: list[dict[str, MeshHeat]] = []
    for state, point in zip(loaded.states, losses.points, strict=True):
        of_point: dict[str, MeshHeat] = {}
        for name, contact in state.contacts.items():
            gears, frequency = contact.result.planetary_set, abs(state.model.flow.mesh_frequency[name])
            for kind, pair in enumerate(gears.kinds):
                loss = float(point.mesh_loss[name][gears.kind_rows[kind]].max())
                mesh = f" {pair.gear_1.name}-{pair.gear_2.name}" if len(gears.kinds) > 1 else ""
                of_point[f"{name}{mesh}"] = mesh_heat(
                    contact.case, contact.result, kind, mesh_frequency=frequency, loss=loss, rules=case
                )
        points.append(of_point)
    names = [load_case.name for load_case in case.operation.load_case]
    kinds = {name: mesh for point in points for name, mesh in point.items()}
    every = (tuple(point.get(name) or mesh.idle for name, mesh in kinds.items()) for point in points)
    return heat_result(case, tuple(every), tuple(kinds), "load_case", names)


def _no_box_heat(case: GearboxCase) -> str:
    """Tell why a gearbox has no temperatures; empty where it has."""
    teeth = any(stage.teeth for stage in (*case.pair, *case.planetary)) and case.deflection.contact
    return heat_missing(case) or ("" if teeth else "no stage has teeth whose contact is computed")


def _left_out(case: GearboxCase, point: LossPoint) -> Iterator[str]:
    """Say which losses are left out, and what would give them."""
    if case.losses is None or not case.losses.bearings:
        return
    silent_bearings = [name for name, loss in point.bearing_loss.items() if not math.isfinite(loss)]
    if silent_bearings:
        yield (
            f"bearings lose nothing here without kind, pitch_diameter and, of balls, static_rating: "
            f"{', '.join(silent_bearings)}"
        )
    teeth = {stage.name: teeth_of(stage) for stage in case.planetary}
    if silent_sets := [name for name, tables in teeth.items() if tables is None or not has_planet_friction(tables)]:
        yield (
            "bearings of planets lose nothing here without planet.bearing_pitch_diameter in the teeth, of rollers or "
            f"needles: {', '.join(silent_sets)}"
        )
    if point.bearing_loss and case.lubricant is None:
        yield "bearings lose nothing by their lubricant: give the section lubricant"


def idle_loss_entries(case: GearboxCase) -> Iterator[Finding]:
    """Tell oil without losses, and tables of both in the teeth of stages, which have no effect there (W-UNUSED)."""
    yield from oil_notices(case)
    for kind in ("pair", "planetary"):
        for number, stage in enumerate(getattr(case, kind)):
            for name in ("losses", "lubricant"):
                if name in (stage.teeth or {}):
                    key = f"{kind}[{number}].teeth.{name}"
                    remedy = f"give [{name}] of the gearbox"
                    yield Finding("W-UNUSED", key, "losses are those of the gearbox", remedy=remedy)


def unknown_mesh_losses(case: GearboxCase) -> Iterator[Finding]:
    """Tell the stages whose meshes have a given stiffness: without their losses no efficiency is known (W-LOSSES)."""
    if case.losses is None:
        return
    stages = [
        (kind, number, stage) for kind in ("pair", "planetary") for number, stage in enumerate(getattr(case, kind))
    ]
    unknown = [(kind, number, stage) for kind, number, stage in stages if not (stage.teeth and case.deflection.contact)]
    if not unknown:
        return
    kind, number, first = unknown[0]
    names = merged_names([stage.name for _, _, stage in unknown])
    text = f"nothing tells what the meshes of {names} lose, whose stiffness is given: the efficiency is not known"
    if first.teeth:
        yield Finding("W-LOSSES", "deflection.contact", text, remedy="leave it out, or give true")
    else:
        yield Finding("W-LOSSES", f"{kind}[{number}].teeth", text, remedy="give the teeth of the stage")


def no_box_losses(case: GearboxCase) -> str:
    """Tell why a gearbox has no losses; empty where it has."""
    return "" if losses_wanted(case) else NO_LOSSES


BOX_HEAT = Stage(
    name="heat",
    decided_by=loss_entries,
    title="Temperatures",
    solve=solve_box_heat,
    takes=("deflection", "losses"),
    wanted=lambda case: losses_wanted(case) and not _no_box_heat(case),
    unavailable=_no_box_heat,
    verdict=lambda result: {"points": len(result.points)},
    describe=lambda results: describe_heat(results.heat),
    tables=lambda results: heat_tables(results.heat),
    warnings=HeatResult.warnings,
)
BOX_LOSSES = Stage(
    name="losses",
    decided_by=loss_entries,
    title="Losses",
    solve=solve_box_losses,
    takes=("deflection",),
    options=("progress", "steps"),
    wanted=losses_wanted,
    unavailable=no_box_losses,
    check=check_loss_entries,
    verdict=lambda result: {"points": len(result.points)},
    describe=lambda results: describe_losses(results.losses),
    tables=lambda results: loss_tables(results.losses),
    warnings=LossesResult.warnings,
)
