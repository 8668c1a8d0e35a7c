"""Power flow of a gearbox case: speeds of all shafts, torques of all stages, frequencies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from femgear.gears.power_flow import PowerFlow, SpeedCondition, pair_condition, planetary_condition, power_flow
from femgear.trains.gearbox.case_file import CASING, GearboxCase, LoadCaseSection
from femgear.trains.gearbox.geometry import pair_sizes, set_sizes


@dataclass(frozen=True)
class BoxFlow:
    """Speeds and torques of a gearbox in a load case.

    Parameters
    ----------
    graph : PowerFlow
        Of shafts and stages.
    speed : mapping of str to float
        Speeds of all shafts [rad/s]; that of the casing is zero.
    stage_torque : mapping of str to mapping
        Torques that the meshes of every stage put on its shafts [N m].
    port_torque : mapping of str to float
        Torques from outside at every load and on every rigid body that has one [N m], reactions of outputs too.
    independent : tuple of str
        Shafts whose speeds are given, one for every way in which the gearbox turns.
    planet_speed : mapping of str to float
        Speed of the planets of every planetary stage [rad/s], against the casing.
    mesh_frequency : mapping of str to float
        Of every stage [Hz].
    """

    graph: PowerFlow
    speed: Mapping[str, float]
    stage_torque: Mapping[str, Mapping[str, float]]
    port_torque: Mapping[str, float]
    independent: tuple[str, ...]
    planet_speed: Mapping[str, float]
    mesh_frequency: Mapping[str, float]


def stage_conditions(case: GearboxCase) -> list[SpeedCondition]:
    """List the kinematic conditions of all stages, pairs first."""
    found = []
    for stage in case.pair:
        sizes = pair_sizes(stage)
        found.append(pair_condition(stage.name, *stage.shafts, *sizes.teeth, internal=sizes.internal))
    for stage in case.planetary:
        sun, _, ring = set_sizes(stage).teeth
        members = [None if name == CASING else name for name in (stage.sun, stage.carrier, stage.ring)]
        found.append(planetary_condition(stage.name, *members, sun, ring))
    return found


def gearbox_flow(case: GearboxCase, load_case: LoadCaseSection | None = None) -> BoxFlow:
    """Compute speeds and torques of all shafts of a gearbox in a load case.

    CaseError: shafts that are free, loops that lock, speeds that contradict one another, torques that do not
    balance; the entries that it names are those of the case file.
    """
    load_case = load_case or case.load_case
    shaft_of = {one.name: one.shaft for one in case.load}
    shaft_of |= {one.name: one.name for one in case.shaft if not one.part}
    joined = [tuple(one.between) for one in case.coupling if one.transmits and one.torsion > 0.0]
    held = {*case.operation.fixed, *(name for pair in joined if CASING in pair for name in pair if name != CASING)}
    torques: dict[str, float] = {}
    for port, torque in load_case.torque.items():
        torques[shaft_of[port]] = torques.get(shaft_of[port], 0.0) + torque
    outputs = [shaft_of[port] for port in case.operation.output]
    graph = power_flow(
        [shaft.name for shaft in case.shaft],
        stage_conditions(case),
        speeds=load_case.speed,
        torques=torques,
        held=sorted(held),
        outputs=outputs,
        joined=[pair for pair in joined if CASING not in pair],
    )
    ports = dict(load_case.torque)
    for port in case.operation.output:
        ports[port] = graph.torque[shaft_of[port]] - torques.get(shaft_of[port], 0.0)
    return BoxFlow(
        graph,
        {**graph.speed, CASING: 0.0},
        graph.stage_torque,
        ports,
        tuple(load_case.speed),
        {stage.name: _planet_speed(stage, graph.speed) for stage in case.planetary},
        mesh_frequencies(case, graph.speed),
    )


def _planet_speed(stage, speed: Mapping[str, float]) -> float:
    """Speed of a planet on its carrier plus that of the carrier [rad/s] (Willis)."""
    sun, planet, _ = set_sizes(stage).teeth
    carrier = speed.get(stage.carrier, 0.0)
    return carrier - (speed.get(stage.sun, 0.0) - carrier) * sun / planet


def mesh_frequencies(case: GearboxCase, speed: Mapping[str, float]) -> dict[str, float]:
    """Compute the mesh frequency of every stage [Hz]: teeth times the turns of a gear against its carrier."""
    found = {}
    for stage in case.pair:
        found[stage.name] = pair_sizes(stage).teeth[0] * abs(speed.get(stage.shafts[0], 0.0)) / (2.0 * math.pi)
    for stage in case.planetary:
        turning = abs(speed.get(stage.sun, 0.0) - speed.get(stage.carrier, 0.0))
        found[stage.name] = set_sizes(stage).teeth[0] * turning / (2.0 * math.pi)
    return found
