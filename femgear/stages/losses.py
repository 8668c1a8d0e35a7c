"""Losses of the teeth by the loads that the contact has: loss factors, friction, torques of pairs and sets with them.

The loss of a mesh is the mean over its period of the sum over all tooth pairs, and all slices of the width, of
``mu F |v_s|``: of a coefficient of friction that holds for the whole path that is mu times the loss factor of the
computed loads, which stands beside that of equal loads on all pairs, the figure of the standards (`loss_factor`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import loss_entries
from femgear.case.lubrication import (
    LossesSection,
    check_film,
    check_losses,
    check_seals,
    losses_wanted,
    operating_viscosity,
)
from femgear.case.tooth_friction import friction_coefficient, shaft_turning
from femgear.contact.face_width import slices_ahead
from femgear.errors import CaseError
from femgear.gears.friction import closed_loss_factor, loss_factor, sliding_per_path
from femgear.gears.power_flow import pair_condition, planetary_condition
from femgear.gears.power_losses import FrictionTorque, LossyFlow, lossy_flow
from femgear.gears.profile import base_helix_angle
from femgear.stages.losses_results import (
    LossesResult,
    LossPoint,
    MeshFriction,
    describe_losses,
    loss_tables,
)
from femgear.stages.planet_bearings import has_planet_friction, planet_friction
from femgear.stages.protocol import Progress, Stage, one_blas_thread, silent
from femgear.stages.static import solve_static
from femgear.system.bearing_friction import seal_torque

if TYPE_CHECKING:
    from femgear.case.dependencies import Steps
    from femgear.contact.mesh_cycle import MeshCycle
    from femgear.gears.pair import GearSet
    from femgear.gears.shaft_graph import SpeedCondition
    from femgear.stages.static_results import StaticResult

NO_LOSSES = "no section [losses] asks for them"


@dataclass(frozen=True)
class _Operation:
    """Stage of a case of a pair or a set between its shafts.

    ``shafts``, ``condition``, what is ``held``, the shaft that the torque is ``given`` of, and the ``output``.
    """

    shafts: tuple[str, ...]
    condition: SpeedCondition
    held: tuple[str, ...]
    given: str
    output: str


def computed_loss_factor(cycle: MeshCycle, gears: GearSet, *, overlap: float = 0.0, base_helix: float = 0.0):
    """Compute H_V (M,) of all meshes from the computed loads of the tooth pairs; zero of meshes without load.

    ``mean(sum F |zeta|) / mean(F)`` times sliding speed over path and speed of the base circle of gear 1, over
    cos(beta_b): forces of the cycle are those of the transverse section.

    Parameters
    ----------
    overlap : float
        Overlap ratio of helical teeth in slices, signed as slices run ahead.
    base_helix : float
        Helix angle on the base cylinder [rad].
    """
    moments = [_moment(record, gears.base_pitch, overlap) for record in _records(cycle)]
    forces = [record.force + record.back_force for record in _records(cycle)]
    place = np.concatenate([record.position for record in _records(cycle)[1:]]) if len(moments) > 1 else None
    means = []
    for first, *others in (moments, forces):
        between = np.concatenate(others, axis=-1) if others else None
        inside = None if place is None else np.abs(place) < cycle.periods - 1e-9
        if between is not None and place is not None:
            means.append(cycle.mean_with(first, between[:, inside], place[inside]))
        else:
            means.append(cycle.mean_with(first, None))
    arm = np.divide(means[0], means[1], out=np.zeros(len(means[0])), where=means[1] > 0.0)
    per_path = [sliding_per_path(pair) / pair.gear_1.base_radius for pair in gears.kinds]
    return arm * gears.of_kinds(per_path) / math.cos(base_helix)


def _records(cycle: MeshCycle) -> list[MeshCycle]:
    return [cycle, *(() if cycle.between is None else cycle.between.records)]


def _moment(cycle: MeshCycle, pitch: float, overlap: float) -> np.ndarray:
    """Sum of force times distance from the pitch point over all tooth pairs of every mesh (M, P) [N m]."""
    back = (cycle.back_tooth_load * np.abs(cycle.back_path)).sum(axis=1)
    if cycle.slice_load is None:
        return (cycle.tooth_load * np.abs(cycle.path)).sum(axis=1) + back
    count = cycle.slice_load.shape[2]
    path = cycle.path[:, :, None] + pitch * slices_ahead(overlap, count)[:, None]
    return (cycle.slice_load * np.abs(path)).sum(axis=1).mean(axis=1) + back


def mesh_friction(
    case: Any, static: StaticResult, mesh_frequency: float, *, helix_angle: float, rules: Any = None
) -> MeshFriction:
    """Find friction and loss factors of all meshes of a stage.

    Parameters
    ----------
    case : case of gears
        Whose teeth they are.
    static : StaticResult
        Loads of the teeth.
    mesh_frequency : float
        [Hz]
    helix_angle : float
        Normal one at the reference circle [rad], 0 of spur teeth.
    rules : case, optional
        With the sections ``losses`` and ``lubricant``, where these are not those of the case.
    """
    gears, rules = static.planetary_set, case if rules is None else rules
    base_helix = abs(base_helix_angle(case.pressure_angle, helix_angle))
    overlap = static.overlap_ratio
    factor = computed_loss_factor(static.cycle, gears, overlap=overlap, base_helix=base_helix)
    force = (static.cycle.force + static.cycle.back_force).mean(axis=-1)
    kinds = range(len(gears.kinds))
    friction = np.zeros(len(force))
    for kind in kinds:
        rows = gears.kind_rows[kind]
        friction[rows] = friction_coefficient(rules, gears.kinds[kind], force[rows], mesh_frequency, base_helix)
    lines = abs(overlap) or (abs(math.tan(base_helix)) * gears.mesh_widths[0] / gears.base_pitch)
    rigid = [loss_factor(pair, lines, base_helix) for pair in gears.kinds]
    closed = [closed_loss_factor(pair, base_helix) for pair in gears.kinds]
    passed = []
    for rows in gears.kind_rows:
        whole = force[rows].sum()
        share = force[rows] / whole if whole > 0.0 else np.zeros(len(force[rows]))
        passed.append(1.0 - float(share @ (friction[rows] * factor[rows])))
    return MeshFriction(friction, factor, gears.of_kinds(rigid), gears.of_kinds(closed), force, tuple(passed))


def losses_of_meshes(flow: LossyFlow, stage: str, friction: MeshFriction, gears: GearSet) -> np.ndarray:
    """Share the losses of the kinds of mesh of a stage among its meshes (M,) [W]."""
    losses = np.zeros(len(friction.force))
    for rows, loss in zip(gears.kind_rows, flow.mesh_loss[stage], strict=True):
        share = friction.force[rows] * friction.coefficient[rows] * friction.factor[rows]
        losses[rows] = loss * share / share.sum() if share.sum() > 0.0 else 0.0
    return losses


def _operation(case: Any, gears: GearSet) -> _Operation:
    """Shafts and stage of a case of a pair or a planetary set."""
    if not gears.members:
        first, second = (gear.name.replace("_", " ") for gear in gears.gears)
        teeth = (gear.teeth for gear in gears.gears)
        condition = pair_condition("mesh", first, second, *teeth, internal=gears.gears[1].internal)
        return _Operation((first, second), condition, (), first, second)
    members = ("sun", "carrier", "ring")
    held, given = case.operation.fixed, case.operation.input
    shafts = tuple(name for name in members if name != held)
    on = {name: name if name != held else None for name in members}
    condition = planetary_condition("set", on["sun"], on["carrier"], on["ring"], case.sun.teeth, abs(case.ring.teeth))
    return _Operation(shafts, condition, (), given, next(name for name in shafts if name != given))


def _point(case: Any, static: StaticResult, torque: float, speed: float) -> LossPoint:
    """Losses at a torque [N m] and a speed [rad/s] of the input."""
    gears, helix = static.planetary_set, case.helix_angle or 0.0
    turning, frequency = shaft_turning(case, gears, speed)
    friction, operation = mesh_friction(case, static, frequency, helix_angle=helix), _operation(case, gears)
    name = operation.condition.name
    seals = seal_frictions(case.losses, operation.shafts)
    bearings = _planet_bearings(case, static, operation, turning.get("carrier", 0.0), frequency)
    flow = lossy_flow(
        operation.shafts,
        (operation.condition,),
        speeds=turning,
        torques={operation.given: torque},
        outputs=(operation.output,),
        efficiencies={name: friction.passed},
        friction=[*seals, *bearings],
    )
    lost = {each.name: flow.friction_loss[each.name] for each in (*seals, *bearings)}
    return LossPoint(
        flow,
        {name: friction},
        {name: losses_of_meshes(flow, name, friction, gears)},
        {each.name: lost[each.name] for each in bearings},
        {each.name: lost[each.name] for each in seals},
    )


def seal_frictions(losses: LossesSection, shafts: Sequence[str]) -> list[FrictionTorque]:
    """List the torques of the seals of shafts that turn; ``gear_1`` of a case is the shaft "gear 1" of a pair."""
    names = {shaft.replace(" ", "_"): shaft for shaft in shafts} | {shaft: shaft for shaft in shafts}
    return [
        FrictionTorque(f"seal {number} on {seal.shaft}", (names[seal.shaft], None), seal_torque(seal.diameter))
        for number, seal in enumerate(losses.seal, start=1)
        if seal.shaft in names
    ]


def _planet_bearings(
    case: Any, static: StaticResult, operation: _Operation, carrier_speed: float, mesh_frequency: float
) -> list[FrictionTorque]:
    """Torque of the bearings of all planets between sun and carrier; none where nothing tells it."""
    if not (case.losses.bearings and has_planet_friction(case)):
        return []
    sun, carrier = (name if name in operation.shafts else None for name in ("sun", "carrier"))
    of_case = {"carrier_speed": carrier_speed, "mesh_frequency": mesh_frequency}
    torque = planet_friction(case, static.planetary_set, static.cycle, **of_case, viscosity=operating_viscosity(case))
    return [FrictionTorque("planets", (sun, carrier), torque)]


@one_blas_thread()
def solve_losses(
    case: Any, static: StaticResult, *, progress: Progress = silent, steps: Steps | None = None
) -> LossesResult:
    """Compute losses and efficiency at the torque and all speeds of operation, and over the map that the case asks for.

    The contact is solved again for every torque of the map.
    """
    operation, losses = case.operation, case.losses
    points = tuple(_point(case, static, operation.torque, speed) for speed in operation.speeds)
    efficiency = np.zeros((len(losses.torque_shares), len(losses.speed_shares)))
    for row, share in enumerate(losses.torque_shares):
        progress("losses", row, len(efficiency))
        torque = share * operation.torque
        loaded = case.model_copy(update={"operation": operation.model_copy(update={"torque": torque})})
        loads = static if share == 1.0 else solve_static(loaded, steps=steps)
        efficiency[row] = [
            _point(loaded, loads, torque, each * operation.speeds[-1]).flow.efficiency for each in losses.speed_shares
        ]
    speed = np.array(operation.speeds)
    return LossesResult(
        points,
        {points[0].stages[0]: static.planetary_set.mesh_names},
        "speed",
        speed,
        losses,
        efficiency,
        tuple(_simplified(case, static)),
    )


def _simplified(case: Any, static: StaticResult) -> Iterator[str]:
    """Say what losses of a case leave out, or take simpler than it is."""
    if (case.helix_angle or 0.0) and not static.cycle.helical:
        yield (
            "loss factors of helical teeth by the loads of their spur transverse section; static.slices gives those "
            "over the width"
        )
    if static.planetary_set.members and case.losses.bearings:
        if not has_planet_friction(case):
            yield "bearings of planets lose nothing here without planet.bearing_pitch_diameter, of rollers or needles"
        elif operating_viscosity(case) is None:
            yield "bearings of planets lose nothing by their lubricant: give the section lubricant"


def no_losses(case: Any) -> str:
    """Tell why a case of teeth has no losses; empty where it has."""
    if not losses_wanted(case):
        return NO_LOSSES
    if case.operation.torque == 0.0:
        return "without torque no flanks touch"
    return "" if case.operation.speeds else "operation.speeds gives no speed"


def check_loss_entries(case: Any) -> None:
    """Refuse sections of losses that lack something, or that a set cannot have (CaseError)."""
    check_losses(case)
    check_film(case)
    losses = case.losses
    for problem in check_seals(losses, _shaft_names(case)) if losses is not None else ():
        problem.file = case.location(str(problem.key))
        raise problem
    if losses is not None and bool(losses.torque_shares) != bool(losses.speed_shares):
        key = f"losses.{'speed' if losses.torque_shares else 'torque'}_shares"
        raise CaseError(
            "a map of losses goes over torque and speed",
            code="E-KEY-MISSING",
            key=key,
            file=case.location(key),
            remedy=f"give {key.removeprefix('losses.')} = [0.5, 1.0] too",
        )


def _shaft_names(case: Any) -> tuple[str, ...]:
    """Names of shafts that a seal may be on."""
    if hasattr(case, "shaft"):
        return tuple(shaft.name for shaft in case.shaft)
    return ("sun", "carrier", "ring") if hasattr(case, "planet") else tuple(case.gear_names)


LOSSES = Stage(
    name="losses",
    title="Losses",
    solve=solve_losses,
    takes=("static",),
    options=("progress", "steps"),
    decided_by=loss_entries,
    wanted=losses_wanted,
    unavailable=no_losses,
    check=check_loss_entries,
    verdict=lambda result: {"points": len(result.points)},
    describe=lambda results: describe_losses(results.losses),
    tables=lambda results: loss_tables(results.losses),
    warnings=LossesResult.warnings,
)
