"""Power flow of a gearbox case: speeds of all shafts, torques of all stages, frequencies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.case.quantities import TORQUE
from femgear.errors import CaseError, FemgearError
from femgear.gears.kinematics import willis_weights
from femgear.gears.power_flow import pair_condition, planetary_condition, power_flow
from femgear.gears.shaft_graph import ShaftGraph, SpeedCondition
from femgear.gears.stage_frequencies import StageFrequencies, stage_frequencies
from femgear.measured.heard_set import HeardSet
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection, GearboxCase, LoadCaseSection, PairSection
from femgear.trains.gearbox.geometry import carriers, pair_sizes, set_sizes

# Torque of a stage over the largest one of any that counts as none.
_IDLE = 1e-9
# Speed over the largest one of the gearbox, or passing teeth over its turns, that is none.
_STILL = 1e-9
# Where the refusals of the graph stand in the case file.
_KEYS = {
    "E-SPEED": "operation.load_case[{}].speed",
    "E-MECHANISM": "operation.load_case[{}].speed",
    "E-LOAD-BALANCE": "operation.output",
    "E-TORQUE": "operation.output",
}


@dataclass(frozen=True)
class BoxFlow:
    """Speeds and torques of a gearbox in a load case.

    Parameters
    ----------
    stage_torque : mapping of str to mapping
        Torques that the meshes of every stage put on its shafts [N m].
    speed : mapping of str to float
        Speeds of all shafts [rad/s]; that of the casing is zero.
    port_torque : mapping of str to float
        Torques from outside at every load and on every rigid body that has one [N m], reactions of outputs too.
    independent : tuple of str
        Shafts whose speeds are given, one for every way in which the gearbox turns.
    frequencies : mapping of str to StageFrequencies
        Of every stage.
    side_by_side : tuple of tuples of str
        Stages that share a torque by their stiffness, set by set; in a loaded state the shares are those of the elastic
        gearbox, without one they are equal.
    """

    stage_torque: Mapping[str, Mapping[str, float]]
    speed: Mapping[str, float]
    port_torque: Mapping[str, float]
    independent: tuple[str, ...]
    frequencies: Mapping[str, StageFrequencies]
    side_by_side: tuple[tuple[str, ...], ...] = ()

    def with_factors(self, factors: Mapping[str, float]) -> BoxFlow:
        """Give stages by name so many times their torques."""
        changed = {
            name: {shaft: torque * factor for shaft, torque in self.stage_torque[name].items()}
            for name, factor in factors.items()
        }
        return replace(self, stage_torque={**self.stage_torque, **changed})

    @property
    def torque_shares(self) -> dict[str, float]:
        """Share of every stage side by side with others in what all of them pass on, by its name [1]."""
        shares = {}
        for names in self.side_by_side:
            passed = [self._passed(name) for name in names]
            shares |= {
                name: torque / math.fsum(passed) for name, torque in zip(names, passed, strict=True) if any(passed)
            }
        return shares

    def _passed(self, name: str) -> float:
        """Largest power of a stage on a shaft [W], its largest torque where nothing turns [N m]."""
        torques = self.stage_torque[name]
        powers = [abs(torque * self.speed[shaft]) for shaft, torque in torques.items()]
        turning = any(self.speed[shaft] for shaft in torques)
        return max(powers) if turning else max(map(abs, torques.values()))

    def first_torque(self, stage: PairSection | BoxPlanetarySection) -> float:
        """Torque that the meshes of a stage put on its gear 1, or on its sun, which may stand in the casing [N m]."""
        torques = self.stage_torque[stage.name]
        if isinstance(stage, PairSection):
            return torques[stage.shafts[0]]
        teeth_sun, _, teeth_ring = set_sizes(stage).teeth
        if stage.sun != CASING:
            return torques[stage.sun]
        sun, _, carrier = willis_weights(teeth_sun, teeth_ring)
        return torques[stage.carrier] * sun / carrier

    def touches(self, stage: PairSection | BoxPlanetarySection) -> bool:
        """Whether a stage has teeth that carry: those of a shaft that turns along without a load touch nowhere."""
        return stage.teeth is not None and self.carries(stage)

    def carries(self, stage: PairSection | BoxPlanetarySection) -> bool:
        """Whether a torque goes through a stage."""
        largest = max(abs(torque) for torques in self.stage_torque.values() for torque in torques.values())
        return abs(self.first_torque(stage)) > _IDLE * largest

    def passes(self, stage: PairSection | BoxPlanetarySection) -> bool:
        """Whether the teeth of a stage pass one another: those of one that turns as a block do not."""
        turns = max(map(abs, self.speed.values())) / (2.0 * math.pi)
        return abs(self.mesh_frequency[stage.name]) > _STILL * turns

    @property
    def mesh_frequency(self) -> dict[str, float]:
        """Mesh frequency of every stage [Hz]."""
        return {name: next(iter(frequencies.mesh_frequency.values())) for name, frequencies in self.frequencies.items()}

    @property
    def planet_speed(self) -> dict[str, float]:
        """Speed of the planets of every planetary stage [rad/s], against the casing."""
        return {
            name: next(iter(frequencies.planet_speed.values()))
            for name, frequencies in self.frequencies.items()
            if frequencies.planet_speed
        }


def stage_conditions(case: GearboxCase) -> list[SpeedCondition]:
    """List the kinematic conditions of all stages, pairs first."""
    conditions = []
    for stage in case.pair:
        sizes, (first, second), (teeth_1, teeth_2) = pair_sizes(stage), stage.shafts, pair_sizes(stage).teeth
        conditions.append(
            pair_condition(stage.name, first, second, teeth_1, teeth_2, internal=sizes.internal, carrier=stage.carrier)
        )
    for stage in case.planetary:
        sun, _, ring = set_sizes(stage).teeth
        members = [None if name == CASING else name for name in (stage.sun, stage.carrier, stage.ring)]
        conditions.append(planetary_condition(stage.name, members[0], members[1], members[2], sun, ring))
    return conditions


def gearbox_flow(case: GearboxCase, load_case: LoadCaseSection | None = None) -> BoxFlow:
    """Compute speeds and torques of all shafts of a gearbox in a load case, without losses.

    CaseError: shafts that are free, loops that lock, speeds that contradict one another, torques that do not
    balance; the entries that it names are those of the case file.
    """
    load_case = load_case or case.load_case
    shaft_of, conditions, given = port_shafts(case), stage_conditions(case), flow_entries(case, load_case)
    try:
        names = [shaft.name for shaft in case.shaft]
        graph = power_flow(
            names, conditions, speeds=load_case.speed, share=True, planets=carriers(case).keys(), **given
        )
    except FemgearError as error:
        _locate(error, case, load_case)
        raise
    ports = dict(load_case.torque)
    for port in case.operation.output:
        others = sum(value for name, value in load_case.torque.items() if shaft_of[name] == shaft_of[port])
        ports[port] = graph.torque[shaft_of[port]] - others
    planets = {stage.name: set_sizes(stage) for stage in case.planetary}
    frequencies = {
        condition.name: stage_frequencies(
            condition,
            graph.speed,
            planet_teeth={"planet": planets[condition.name].teeth[1]} if condition.name in planets else None,
            planets=len(planets[condition.name].planet_angles) if condition.name in planets else 0,
        )
        for condition in conditions
    }
    independent = _independent(case, conditions, given["held"], given["joined"], load_case)
    speeds = {**graph.speed, CASING: 0.0}
    beside = tuple(group for names in graph.side_by_side for group in _branches(case, names))
    return BoxFlow(dict(graph.stage_torque), speeds, ports, independent, frequencies, beside)


def _branches(case: GearboxCase, names: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Part stages that share torque: those of planets, one after the other from sun to ring, share one kind by one."""
    pairs, planets = {stage.name: stage for stage in case.pair}, carriers(case)
    groups = dict[object, list[str]]()
    for name in names:
        kind: object = None
        if name in pairs and pairs[name].carrier is not None:
            central = tuple("" if shaft in planets else shaft for shaft in pairs[name].shafts)
            kind = pairs[name].carrier, central, pair_sizes(pairs[name]).teeth
        groups.setdefault(kind, []).append(name)
    return [tuple(group) for group in groups.values() if len(group) > 1]


def flow_entries(case: GearboxCase, load_case: LoadCaseSection) -> dict[str, Any]:
    """Collect what a power flow takes beside shafts, stages and speeds: torques, outputs, held and joined shafts."""
    shaft_of = port_shafts(case)
    joined = [coupling.between for coupling in case.coupling if coupling.transmits and coupling.torsion > 0.0]
    held = {*case.operation.fixed, *(name for pair in joined if CASING in pair for name in pair if name != CASING)}
    torques: dict[str, float] = {}
    for port, torque in load_case.torque.items():
        torques[shaft_of[port]] = torques.get(shaft_of[port], 0.0) + torque
    outputs = [shaft_of[port] for port in case.operation.output]
    return {
        "torques": {shaft: torque for shaft, torque in torques.items() if shaft not in outputs},
        "held": sorted(held),
        "outputs": outputs,
        "joined": [pair for pair in joined if CASING not in pair],
    }


def _independent(case: GearboxCase, conditions, held, joined, load_case: LoadCaseSection) -> tuple[str, ...]:
    """Choose of the given speeds those from which the others follow."""
    links = tuple(map(tuple, joined))
    graph = ShaftGraph(tuple(shaft.name for shaft in case.shaft), tuple(conditions), tuple(held), links)
    independent: list[str] = []
    for name in load_case.speed:
        turning = graph.speeds([*independent, name])
        is_known = graph.group[name] in {graph.group[other] for other in independent} | graph.standing
        if not turning.relations and not is_known:
            independent.append(name)
    return tuple(independent)


def port_shafts(case: GearboxCase) -> dict[str, str]:
    """List the shafts of loads, and of shafts that are one rigid body, by the names of these."""
    shafts = {shaft.name: shaft.name for shaft in case.shaft if not shaft.part}
    return shafts | {load.name: load.shaft for load in case.load}


def _locate(error: FemgearError, case: GearboxCase, load_case: LoadCaseSection) -> None:
    """Let refusals of the graph name the entries of the case file."""
    number = case.operation.load_case.index(load_case)
    for problem in (error, *getattr(error, "problems", ())):
        if isinstance(problem, CaseError) and not problem.key:
            problem.key = _KEYS.get(problem.code, "operation.load_case[{}].speed").format(number)
        if problem.code == "E-LOAD-BALANCE" and isinstance(problem.value, float):
            problem.value = TORQUE.show(problem.value)


def turns_in_words(frequencies: StageFrequencies) -> str:
    """Say after how many turns the same teeth of the first mesh of a stage meet again, and in what time."""
    mesh = next(iter(frequencies.hunting_turns), None)
    if mesh is None:
        return "-"
    first, second = frequencies.hunting_turns[mesh]
    turns, time = f"{first} and {second} turns", frequencies.hunting_time[mesh]
    return f"{turns}, {time:.4g} s" if math.isfinite(time) else turns


def heard_stages(case: GearboxCase) -> dict[str, HeardSet]:
    """List the planetary stages whose ring stands still while their carrier turns, by name.

    Speeds are those of the first load case; the input is the first shaft whose speed is given. FemgearError: shafts
    whose speeds contradict one another, as of `gearbox_flow`.
    """
    flow, stages = gearbox_flow(case), dict[str, HeardSet]()
    fastest = max(map(abs, flow.speed.values()), default=0.0)
    turning = {name: abs(speed) for name, speed in flow.speed.items() if abs(speed) > _STILL * fastest}
    given = next((name for name in case.load_case.speed if name in turning), "carrier")
    for stage in case.planetary:
        if stage.ring in turning or stage.carrier not in turning:
            continue
        (sun, planet, ring), angles = set_sizes(stage).teeth, set_sizes(stage).planet_angles
        carrier = turning[stage.carrier]
        per_turn = {name: carrier / speed for name, speed in turning.items()}
        members = {"carrier": 1.0} | ({"sun": carrier / turning[stage.sun]} if stage.sun in turning else {})
        stages[stage.name] = HeardSet(ring, sun, planet, np.asarray(angles), given, {**per_turn, **members})
    return stages
