"""Stages of a gear unit in a REXS file, and the power that flows through them.

Speeds and torques are those of `femgear.gears.power_flow`, as far as the file determines them. Shafts that a
coupling joins turn as one; those that one joins with the ``gear_casing`` stand still.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from femgear.case.quantities import SPEED, TORQUE, Dimension
from femgear.errors import GeometryError
from femgear.exchange.rexs import Component, Model
from femgear.gears.power_flow import disagree, pair_condition, planetary_condition
from femgear.gears.shaft_graph import ShaftGraph, SpeedCondition

POWER = Dimension("a power", "W", "kW", 1e3)
TORQUE_ROUNDING = 1e-6
"""Torques of a file balance where they miss by less than this, relative to the largest term."""


@dataclass(frozen=True)
class UnitStage:
    """A stage, the ``component`` of the file, with the torques on its shafts per unit of that on the first.

    ``arms`` are these torques [1] by the ids of the shafts. They are the weights of their speeds, too: the sum of
    weight times speed is zero.
    """

    component: Component
    arms: Mapping[str, Fraction]


@dataclass(frozen=True)
class UnitFlow:
    """Speeds and torques of a gear unit, as far as the file tells them; what it leaves open is missing.

    ``speed`` holds the speeds of shafts [rad/s] by their ids, ``torque`` that which the meshes of a stage put on its
    first shaft [N m], by the id of the stage. ``joined`` are the ids of stages that other stages hang on.
    """

    speed: Mapping[str, float]
    torque: Mapping[str, float]
    joined: frozenset[str] = frozenset()


def shaft_of(model: Model, part: Component) -> Component | None:
    """Find the shaft that a gear or load belongs to."""
    wholes = model.related(("assembly", "ordered_assembly"), "assembly", part=part.id)
    return next((whole for whole in wholes if whole.type == "shaft"), None)


def stage_components(model: Model) -> list[Component]:
    """List the stages of a unit, without the meshes inside planetary ones."""
    stages = [component for component in model.components.values() if component.type.endswith("_stage")]
    planetary = [stage for stage in stages if stage.type == "planetary_stage"]
    inside = {component.id for stage in planetary for component in model.related("assembly", "part", assembly=stage.id)}
    return [stage for stage in stages if stage.id not in inside]


def gears_of(model: Model, mesh: Component) -> list[Component]:
    """List both gears of a mesh, the internal one last; fewer where relations are missing."""
    roles = ("gear_1", "gear_2")
    gears = [gear for role in roles for gear in model.related("stage", role, stage=mesh.id)[:1]]
    return sorted(gears, key=lambda gear: gear.type == "ring_gear")


def unit_stages(model: Model) -> list[UnitStage]:
    """List the stages whose teeth and shafts the file gives."""
    return [unit_stage for stage in stage_components(model) if (unit_stage := _unit_stage(model, stage)) is not None]


def _unit_stage(model: Model, stage: Component) -> UnitStage | None:
    if stage.type == "planetary_stage":
        meshes = model.related("assembly", "part", assembly=stage.id)
        gears = {gear.id: gear for mesh in meshes for gear in gears_of(model, mesh)}
        ring = next((gear for gear in gears.values() if gear.type == "ring_gear"), None)
        planets = {gear.id for mesh in meshes if ring in (pair := gears_of(model, mesh)) for gear in pair}
        sun = next((gear for gear in gears.values() if gear.id not in planets), None)
        carriers = model.related("planet_carrier_shaft", "shaft", planetary_stage=stage.id)
        if ring is None or sun is None or not carriers or carriers[0].type != "shaft":
            return None
        central, shafts = [sun, ring], [shaft_of(model, sun), carriers[0], shaft_of(model, ring)]
    elif stage.type == "cylindrical_stage":
        central = gears_of(model, stage)
        shafts = [shaft_of(model, gear) for gear in central]
    else:
        return None
    ids = [shaft.id for shaft in shafts if shaft is not None]
    teeth = [abs(model.number(gear, "number_of_teeth") or 0.0) for gear in central]
    if len(central) != 2 or len(ids) < len(shafts) or not all(map(float.is_integer, teeth)):
        return None
    first, second = map(int, teeth)
    try:
        if stage.type == "planetary_stage":
            condition = planetary_condition(stage.id, ids[0], ids[1], ids[2], first, second)
        else:
            internal = any(gear.type == "ring_gear" for gear in central)
            condition = pair_condition(stage.id, ids[0], ids[1], first, second, internal)
    except GeometryError:  # teeth that no stage has
        return None
    return UnitStage(stage, {id: weight / first for id, weight in condition.weights.items()})


def with_load_case(component: Component, given: Mapping[str, Mapping]) -> Component:
    """Copy a component with the attributes that a load case gives it."""
    return replace(component, attributes={**component.attributes, **given.get(component.id, {})})


def loads_on(model: Model, shaft: Component, given: Mapping[str, Mapping]) -> Iterator[float | None]:
    """Torques of the loads on a shaft [N m] in a load case, None of one that says nothing.

    A power gives the torque at the speed of the shaft.
    """
    speed = model.number(with_load_case(shaft, given), "rotational_speed", SPEED)
    for part in model.related("assembly", "part", assembly=shaft.id):
        if part.type == "external_load":
            load = with_load_case(part, given)
            torque = model.number(load, "torque_around_u_axis", TORQUE)
            power = model.number(load, "power", POWER)
            yield power / speed if power is not None and speed and not torque else torque


def unit_flow(model: Model, given: Mapping[str, Mapping]) -> UnitFlow:
    """Compute speeds and torques of all stages in a load case, as far as the file determines them."""
    stages = unit_stages(model)
    graph = _graph(model, stages)
    inside = {graph.group[id] for stage in stages for id in stage.arms}
    shafts = [
        component
        for component in model.components.values()
        if component.type == "shaft" and graph.group[component.id] in inside
    ]
    loads: dict[int, list[float | None]] = {}
    for shaft in shafts:
        loads.setdefault(graph.group[shaft.id], []).extend(loads_on(model, shaft, given))
    of_stage: dict[str, float] = {}
    for part in graph.parts:
        of_stage |= {stages[i].component.id: torque for i, torque in _stage_torques(graph, part, loads).items()}
    joined = frozenset(stages[i].component.id for part in graph.parts if len(part) > 1 for i in part)
    return UnitFlow(_speeds(model, graph, shafts, given), of_stage, joined)


def case_flows(model: Model, load_case: int | None) -> list[UnitFlow]:
    """Compute the power flow of the load case of a number, by default the first, then those of all.

    CaseError: no such load case (E-CHOICE).
    """
    _, given = model.chosen_case(load_case)
    return [unit_flow(model, case) for case in (given, *model.load_cases)]


def plain_ids(ids: Iterable[str]) -> dict[str, str]:
    """Make ids that names of files and bodies can hold, each of its own."""
    plain_of: dict[str, str] = {}
    for id in ids:
        plain = re.sub(r"[^A-Za-z0-9_-]", "_", id)[:20]
        number = sum(taken == plain or taken.startswith(f"{plain}-") for taken in plain_of.values())
        plain_of[id] = f"{plain}-{number + 1}" if number else plain
    return plain_of


def _graph(model: Model, stages: Iterable[UnitStage]) -> ShaftGraph:
    """Shafts of a unit with its stages and couplings."""
    shafts = tuple(component.id for component in model.components.values() if component.type == "shaft")
    held: list[str] = []
    joined: list[tuple[str, ...]] = []
    for joint in [component for component in model.components.values() if component.type.endswith("coupling")]:
        sides = (model.related("side", role, assembly=joint.id) for role in ("inner_part", "outer_part"))
        ends = [component for side in sides for component in side]
        ids = tuple(end.id for end in ends if end.id in shafts)
        if len(ids) == 2:
            joined.append(ids)
        elif len(ids) == 1 and any(end.type == "gear_casing" for end in ends):
            held.append(ids[0])
    conditions = tuple(SpeedCondition(stage.component.id, stage.arms) for stage in stages)
    return ShaftGraph(shafts, conditions, tuple(held), tuple(joined))


def _speeds(model: Model, graph: ShaftGraph, shafts: Iterable[Component], given) -> dict[str, float]:
    """Speeds of shafts [rad/s] without those that nothing determines; of speeds that contradict the first counts."""
    value: dict[int, float] = {group: 0.0 for group in graph.standing}
    driven = []
    for shaft in shafts:
        speed = model.number(with_load_case(shaft, given), "rotational_speed", SPEED)
        if speed is not None and graph.group[shaft.id] not in value:
            value[graph.group[shaft.id]] = speed
            driven.append(shaft.id)
    for group, ratio in graph.speeds(driven).ratio.items():
        value[group] = sum(float(share) * value[other] for other, share in ratio.items())
    return {
        component.id: value[graph.group[component.id]] for component in shafts if graph.group[component.id] in value
    }


def _stage_torques(
    graph: ShaftGraph, part: tuple[int, ...], loads: Mapping[int, list[float | None]]
) -> dict[int, float]:
    """Torques by the meshes on the first shaft of every stage of a part [N m]; none where nothing determines them."""
    stages_on = [group for stage in part for group in graph.rows[stage]]
    groups = sorted(set(stages_on))
    loaded = {group: values for group, values in loads.items() if group in groups}
    torque_of = {group: sum(value for value in values if value is not None) for group, values in loaded.items()}
    torque_of = {group: torque for group, torque in torque_of.items() if torque}
    if not torque_of:
        return {}
    ends = [
        group
        for group in groups
        if stages_on.count(group) == 1 and group not in torque_of and group not in graph.standing
    ]
    silent = [key for key, values in loaded.items() if any(not torque for torque in values) and key not in torque_of]
    # the load takes the rest: one that says no torque, or the only end of the unit without one
    output = silent if len(silent) == 1 else ends if len(ends) == 1 else []
    unknown = [group for group in groups if group in graph.standing or group in output]
    first = {group: graph.names([group])[0] for group in groups}
    balance = graph.torques([first[group] for group in torque_of], [first[group] for group in unknown], part)
    torque = dict(enumerate(torque_of.values(), len(graph.conditions) + len(unknown)))
    sums = [[float(share) * torque[key] for key, share in relation.items()] for relation in balance.relations]
    if balance.open or any(disagree(terms, TORQUE_ROUNDING) for terms in sums):
        return {}
    return {stage: sum(float(share) * torque[key] for key, share in balance.ratio[stage].items()) for stage in part}


def stage_in_words(model: Model, stage: Component) -> str:
    """Tell type, id and name of a stage, and the teeth of two gears."""
    gears = gears_of(model, stage)
    teeth: Any = [model.number(gear, "number_of_teeth") for gear in gears]
    shown = f" {'/'.join(f'{abs(count):g}' for count in teeth)}" if len(teeth) == 2 and all(teeth) else ""
    return f"{stage}{shown}" + (f" ({stage.name[:60]})" if stage.name not in ("", "stage") else "")


def turning(value: float) -> float:
    """Sense of a speed or torque, 1 of none."""
    return math.copysign(1.0, value) if value else 1.0
