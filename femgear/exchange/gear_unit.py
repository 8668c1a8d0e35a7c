"""Stages of a gear unit in a REXS file, and the power that flows through them.

Speeds follow from the ratios of all stages (Willis' equation for planetary ones), torques from the balance of
every shaft without losses: ``sum T = 0``, and ``T_1/z_1 = T_2/z_2`` of two external gears. Shafts that a
coupling joins turn as one; those that one joins with the ``gear_casing`` stand still.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.case.quantities import SPEED, TORQUE, Dimension
from femgear.exchange.rexs import Component, Model
from femgear.gears.kinematics import torque_ratios

POWER = Dimension("a power", "W", "kW", 1e3)
_NOTHING = 1e-9
"""Share of a motion or torque that counts as none."""


@dataclass(frozen=True)
class UnitStage:
    """A stage, the ``component`` of the file, with the torques on its shafts per unit of that on the first.

    ``arms`` are these torques [1] by the ids of the shafts. They are the weights of their speeds, too: the sum of
    weight times speed is zero.
    """

    component: Component
    arms: Mapping[str, float]


@dataclass(frozen=True)
class PowerFlow:
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
    return next((one for one in wholes if one.type == "shaft"), None)


def stage_components(model: Model) -> list[Component]:
    """List the stages of a unit, without the meshes inside planetary ones."""
    stages = [one for one in model.components.values() if one.type.endswith("_stage")]
    planetary = [one for one in stages if one.type == "planetary_stage"]
    inside = {one.id for stage in planetary for one in model.related("assembly", "part", assembly=stage.id)}
    return [one for one in stages if one.id not in inside]


def gears_of(model: Model, mesh: Component) -> list[Component]:
    """List both gears of a mesh, the internal one last; fewer where relations are missing."""
    roles = ("gear_1", "gear_2")
    gears = [one for role in roles for one in model.related("stage", role, stage=mesh.id)[:1]]
    return sorted(gears, key=lambda one: one.type == "ring_gear")


def unit_stages(model: Model) -> list[UnitStage]:
    """List the stages whose teeth and shafts the file gives."""
    return [one for stage in stage_components(model) if (one := _unit_stage(model, stage)) is not None]


def _unit_stage(model: Model, stage: Component) -> UnitStage | None:
    if stage.type == "planetary_stage":
        meshes = model.related("assembly", "part", assembly=stage.id)
        gears = {one.id: one for mesh in meshes for one in gears_of(model, mesh)}
        ring = next((one for one in gears.values() if one.type == "ring_gear"), None)
        planets = {one.id for mesh in meshes if ring in (pair := gears_of(model, mesh)) for one in pair}
        sun = next((one for one in gears.values() if one.id not in planets), None)
        carriers = model.related("planet_carrier_shaft", "shaft", planetary_stage=stage.id)
        if ring is None or sun is None or not carriers:
            return None
        teeth = [abs(model.number(one, "number_of_teeth") or 0.0) for one in (sun, ring)]
        shafts = [shaft_of(model, sun), shaft_of(model, ring), carriers[0]]
        weights = list(torque_ratios(*teeth).values()) if all(teeth) else []  # type: ignore[arg-type]
    elif stage.type == "cylindrical_stage":
        gears = gears_of(model, stage)
        teeth = [abs(model.number(one, "number_of_teeth") or 0.0) for one in gears]
        shafts = [shaft_of(model, one) for one in gears]
        sense = -1.0 if any(one.type == "ring_gear" for one in gears) else 1.0
        weights = [1.0, sense * teeth[1] / teeth[0]] if len(gears) == 2 and all(teeth) else []
    else:
        return None
    known = [one.id for one in shafts if one is not None]
    if not weights or len(known) < len(weights):
        return None
    arms: dict[str, float] = {}
    for id, weight in zip(known, weights, strict=True):
        arms[id] = arms.get(id, 0.0) + weight
    return UnitStage(stage, arms)


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


def power_flow(model: Model, given: Mapping[str, Mapping]) -> PowerFlow:
    """Compute speeds and torques of all stages in a load case, as far as the file determines them."""
    stages = unit_stages(model)
    group, held = _groups(model)
    names = sorted({group[id] for stage in stages for id in stage.arms})
    place = {name: i for i, name in enumerate(names)}
    table = np.zeros((len(stages), len(names)))
    for row, stage in zip(table, stages, strict=True):
        for id, weight in stage.arms.items():
            row[place[group[id]]] += weight
    shafts = [one for one in model.components.values() if one.type == "shaft" and group[one.id] in place]
    speeds = _speeds(
        model,
        shafts,
        table,
        {id: place[group[id]] for id in group if group[id] in place},
        [place[one] for one in held if one in place],
        given,
    )
    loads: dict[int, list[float | None]] = {}
    for shaft in shafts:
        loads.setdefault(place[group[shaft.id]], []).extend(loads_on(model, shaft, given))
    standing, of_stage = [place[one] for one in held if one in place], {}
    joined = {stages[i].component.id for rows in _connected(table) if len(rows) > 1 for i in rows}
    for rows in _connected(table):
        torques = _torques(table[rows], loads, standing)
        of_stage |= {stages[i].component.id: t for i, t in zip(rows, torques, strict=True) if t is not None}
    by_shaft = {one.id: speeds[place[group[one.id]]] for one in shafts}
    return PowerFlow({id: one for id, one in by_shaft.items() if one is not None}, of_stage, frozenset(joined))


def case_flows(model: Model, load_case: int | None) -> list[PowerFlow]:
    """Compute the power flow of the load case of a number, by default the first, then those of all.

    CaseError: no such load case (E-CHOICE).
    """
    _, given = model.chosen_case(load_case)
    return [power_flow(model, one) for one in (given, *model.load_cases)]


def plain_ids(ids: Iterable[str]) -> dict[str, str]:
    """Make ids that names of files and bodies can hold, each of its own."""
    found: dict[str, str] = {}
    for id in ids:
        plain = re.sub(r"[^A-Za-z0-9_-]", "_", id)[:20]
        number = sum(one == plain or one.startswith(f"{plain}-") for one in found.values())
        found[id] = f"{plain}-{number + 1}" if number else plain
    return found


def _groups(model: Model) -> tuple[dict[str, str], set[str]]:
    """Id of the first of the shafts that couplings join, by the id of each, and those that stand still."""
    group = {one.id: one.id for one in model.components.values() if one.type == "shaft"}
    held: set[str] = set()
    for joint in [one for one in model.components.values() if one.type.endswith("coupling")]:
        sides = (model.related("side", role, assembly=joint.id) for role in ("inner_part", "outer_part"))
        ends = [one for side in sides for one in side]
        shafts = [group[one.id] for one in ends if one.id in group]
        if len(shafts) == 2:
            group = {id: shafts[0] if one == shafts[1] else one for id, one in group.items()}
            held = {shafts[0] if one == shafts[1] else one for one in held}
        elif len(shafts) == 1 and any(one.type == "gear_casing" for one in ends):
            held.add(shafts[0])
    return group, held


def _speeds(model: Model, shafts, table, place: Mapping[str, int], held: list[int], given) -> list[float | None]:
    """Speeds of groups of shafts [rad/s], None of those that nothing determines."""
    rows, values = [*table], [0.0] * len(table)
    for at in held:
        rows.append(np.eye(table.shape[1])[at])
        values.append(0.0)
    for shaft in shafts:
        speed = model.number(with_load_case(shaft, given), "rotational_speed", SPEED)
        if speed is not None and place[shaft.id] not in held:
            rows.append(np.eye(table.shape[1])[place[shaft.id]])
            values.append(speed)
    if not rows:
        return [None] * table.shape[1]
    system = np.array(rows)
    found, _, rank, _ = np.linalg.lstsq(system, np.array(values), rcond=_NOTHING)
    free = np.linalg.svd(system)[2][rank:]
    loose = np.abs(free).max(axis=0, initial=0.0) > _NOTHING
    # what members turn with each other is determined, what they turn at is not, unless a speed is given
    rounding = _NOTHING * np.abs(found).max(initial=0.0)
    return [None if loose[i] else float(one) * (abs(one) > rounding) for i, one in enumerate(found)]


def _connected(table) -> list[list[int]]:
    """Rows of stages that hang together by their shafts."""
    found: list[list[int]] = []
    for row in range(len(table)):
        joined = [rows for rows in found if np.any((table[row] != 0.0) & np.any(table[rows] != 0.0, axis=0))]
        found = [rows for rows in found if rows not in joined] + [sorted(sum(joined, [row]))]
    return sorted(found)


def _torques(table, loads: Mapping[int, list[float | None]], held: list[int]) -> list[float | None]:
    """Torques by the meshes on the first shaft of every stage [N m], None where nothing determines them."""
    count, groups = table.shape
    known, inside = np.zeros(groups), np.any(table != 0.0, axis=0)
    loads, held = {at: one for at, one in loads.items() if inside[at]}, [at for at in held if inside[at]]
    for at, values in loads.items():
        known[at] += sum(one for one in values if one is not None)
    if not known.any():
        return [None] * count
    ends = [i for i in range(groups) if np.count_nonzero(table[:, i]) == 1 and not known[i] and i not in held]
    said = [i for i, values in loads.items() if any(not one for one in values) and not known[i]]
    # the load takes the rest: one that says no torque, or the only end of the unit without one
    output = said if len(said) == 1 else ends if len(ends) == 1 else []
    free = np.eye(groups)[[*held, *output]].reshape(-1, groups)
    system = np.vstack([table, free]).T
    found, _, rank, _ = np.linalg.lstsq(system, -known, rcond=_NOTHING)
    rest = np.abs(system @ found + known).max(initial=0.0)
    if rank < system.shape[1] or rest > 1e-6 * np.abs(known).max():
        return [None] * count
    return [float(one) for one in found[:count]]


def stage_in_words(model: Model, stage: Component) -> str:
    """Tell type, id and name of a stage, and the teeth of two gears."""
    gears = gears_of(model, stage)
    teeth: Any = [model.number(one, "number_of_teeth") for one in gears]
    shown = f" {'/'.join(f'{abs(one):g}' for one in teeth)}" if len(teeth) == 2 and all(teeth) else ""
    return f"{stage}{shown}" + (f" ({stage.name[:60]})" if stage.name not in ("", "stage") else "")


def turning(value: float) -> float:
    """Sense of a speed or torque, 1 of none."""
    return math.copysign(1.0, value) if value else 1.0
