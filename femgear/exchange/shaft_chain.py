"""Parallel shafts and stages of a REXS gear unit as the tables of a drivetrain.

Bodies are the gears, and small seats where a bearing or a load sits on a shaft; between them shafts are beams
of their own mass, each of one diameter with the torsional stiffness of the sections there. The stiffness of
the meshes is that of the pair cases of the stages.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from femgear.case.estimates import SUPPORT_SHARE, USUAL_STIFFNESS, cylinder
from femgear.case.quantities import (
    ANGLE,
    DENSITY,
    INERTIA,
    LENGTH,
    MASS,
    MODULUS,
    SPEED,
    STIFFNESS,
    TORQUE,
    to_si,
)
from femgear.exchange.gear_unit import gears_of, plain_ids, shaft_of, stage_components, turning, unit_flow
from femgear.exchange.planetary_stage import bearings_between, is_bearing, with_unit
from femgear.exchange.rexs import Component, Model

_SEAT = 1e-3, 1e-7
"""Mass [kg] and inertias [kg m^2] of a seat: little beside the shaft."""
_SOFT = 1e15
_THICKEST = 100.0
"""Diameter of a shaft [m] that a drivetrain can have."""


class NoChain(Exception):
    """Why a unit makes no chain, in words."""


def chain_tables(
    model: Model, pairs: Mapping[str, dict[str, Any]], files: Mapping[str, str], load_case: int | None
) -> tuple[dict[str, Any], dict[str, str]]:
    """Make the tables of a drivetrain, with remarks by key on what is assumed.

    Parameters
    ----------
    pairs : mapping of str to dict
        Tables of the pair case of every stage by its id.
    files : mapping of str to str
        Names of the files of these cases, by id.

    Raises
    ------
    NoChain
        The unit has other stages, shafts that couplings join, or no speed or torque.
    """
    stages = stage_components(model)
    if len(pairs) != len(stages) or any(one.type != "cylindrical_stage" for one in stages):
        raise NoChain("a drivetrain is written of units whose stages are all pairs that became cases")
    _, given = model.chosen_case(load_case)
    flow = unit_flow(model, given)
    gears = {gear.id: (gear, stage) for stage in stages for gear in gears_of(model, stage)}
    shafts = {one.id: one for gear, _ in gears.values() if (one := shaft_of(model, gear)) is not None}
    if len(gears) != 2 * len(stages) or not set(shafts) <= flow.speed.keys():
        raise NoChain("gears without a shaft of their own, or shafts whose speed nothing determines")
    if any(one.id not in flow.torque for one in stages) or not all(flow.speed[one] for one in shafts):
        raise NoChain("the file does not determine the torques of all stages, or shafts stand still")
    if any(one.type == "ring_gear" for one, _ in gears.values()):
        raise NoChain("the gears of parallel stages of a drivetrain are external")
    tables: dict[str, Any] = {"format": 1, "model": "drivetrain", "title": "Gear unit"}
    units = [one.name for one in model.components.values() if one.type == "gear_unit" and one.name]
    if units:
        tables["title"] = "".join(c for c in units[0] if c.isprintable())[:200] or "Gear unit"
    bodies = _body_names(model)
    tables |= {"body": [], "shaft": [], "parallel": [], "bearing": []}
    remarks: dict[str, str] = {}
    on = {id: one.id for id, (gear, _) in gears.items() if (one := shaft_of(model, gear)) is not None}
    first, last = _ends(flow.speed, flow.torque, on, stages, model)
    ordered = sorted(shafts.values(), key=lambda one: one.id != first)
    names = {}
    for shaft in ordered:
        names[shaft.id] = _shaft(model, shaft, gears, pairs, bodies, tables, remarks)
    for stage in stages:
        _stage(model, stage, pairs[stage.id], files[stage.id], bodies, tables, flow.speed)
    # power in over the speed there, with the torque of any mesh
    stage = stages[0]
    power = abs(flow.torque[stage.id] * flow.speed[on[gears_of(model, stage)[0].id]])
    torque = power / abs(flow.speed[first])
    driver, output = _load_seat(names[first]), _load_seat(names[last])
    tables["operation"] = {
        "speed": with_unit(abs(flow.speed[first]), SPEED),
        "torque": [{"body": driver, "torque": with_unit(torque, TORQUE)}, {"body": output, "share": 1.0}],
    }
    # the first body gives the speed
    tables["body"].sort(key=lambda one: one["name"] != driver)
    remarks = _sorted_remarks(tables, remarks, driver)
    tables["simulation"] = {"duration": "1 s", "damping_ratio": 0.03}
    remarks["simulation.damping_ratio"] = "assumed"
    model.remark(
        "body",
        "REXS has no inertia of motor and load: the ends of the drivetrain are bare shafts",
        remedy="add the inertias of motor and load to the bodies at the ends",
    )
    return tables, remarks


def _body_names(model: Model) -> dict[str, str]:
    """Names of the bodies of gears, bearings and loads, by the ids of these."""
    words = {"external_load": "load", "cylindrical_gear": "gear"}
    return {
        id: f"{words.get(model.components[id].type, 'bearing')} {plain}"
        for id, plain in plain_ids(model.components).items()
    }


def _sorted_remarks(tables: dict[str, Any], remarks: dict[str, str], driver: str) -> dict[str, str]:
    """Remarks of bodies by their places after sorting; they were kept by name."""
    places = {one["name"]: i for i, one in enumerate(tables["body"])}
    found = {}
    for key, text in remarks.items():
        name, _, last = key.removeprefix("body:").rpartition(".")
        found[f"body[{places[name]}].{last}" if key.startswith("body:") else key] = text
    return found


def _ends(
    speed: Mapping[str, float], torque: Mapping[str, float], on: Mapping[str, str], stages, model: Model
) -> tuple[str, str]:
    """Ids of the shafts at which power enters and leaves, from the ids of shafts ``on`` which gears sit."""
    count = Counter(on.values())
    ends = [one for one, gears in count.items() if gears == 1]
    if len(ends) != 2:
        raise NoChain("power enters or leaves at more than two shafts")
    # the first gears of stages have the torque of their mesh
    first = [on[gears_of(model, stage)[0].id] for stage in stages]
    for stage, shaft in zip(stages, first, strict=True):
        if shaft in ends:
            other = ends[1] if shaft == ends[0] else ends[0]
            return (shaft, other) if torque[stage.id] * speed[shaft] < 0.0 else (other, shaft)
    raise NoChain("no first gear of a stage sits on a shaft at an end")


def _load_seat(names: list[tuple[str, str]]) -> str:
    """Body of a shaft on which a load acts: its seat, else the last of the shaft."""
    return next((name for name, kind in names if kind == "external_load"), names[-1][0])


def _shaft(model: Model, shaft: Component, gears, pairs, names, tables, remarks) -> list[tuple[str, str]]:
    """Add bodies, beams and bearings of a shaft; names and types of its bodies."""
    at: list[tuple[float, Component]] = []
    for part in model.related(("assembly", "ordered_assembly"), "part", assembly=shaft.id):
        if part.id in gears or part.type == "external_load":
            at.append((model.number(part, "u_coordinate_on_shaft", LENGTH) or 0.0, part))
    for part in bearings_between(model, [shaft], "inner_part", "gear_casing"):
        if is_bearing(part):
            key = "u_coordinate_on_shaft_inner_side"
            at.append((model.number(part, key, LENGTH) or 0.0, part))
    # a gear comes first of what lies at one place
    at.sort(key=lambda one: (one[0], one[1].id not in gears))
    bodies: list[tuple[float, str, str]] = []
    for place, part in at:
        new = not bodies or place - bodies[-1][0] > 1e-4
        if new:
            bodies.append((place, _body(model, part, gears, pairs, names, tables, remarks), part.type))
        if is_bearing(part):
            _bearing(model, part, bodies[-1][1], gears, pairs, tables, remarks)
    if sum(is_bearing(part) for _, part in at) < 2:
        raise NoChain(f"{shaft} has fewer than two bearings in the casing")
    for (start, one, _), (end, two, _) in pairwise(bodies):
        diameter, bore = _section(model, shaft, start, end)
        if diameter is None:
            raise NoChain(f"{shaft} has no sections")
        table = {"between": [one, two], "length": with_unit(end - start, LENGTH), "elements": 1}
        table |= {"outer_diameter": with_unit(diameter, LENGTH)} | (
            {"inner_diameter": with_unit(bore, LENGTH)} if bore else {}
        )
        for made in model.related("reference", "referenced", origin=shaft.id)[:1]:
            for key, attribute, dimension in (
                ("youngs_modulus", "elastic_modulus", MODULUS),
                ("density", "density", DENSITY),
            ):
                value = model.number(made, attribute, dimension)
                table |= {} if value is None else {key: with_unit(value, dimension)}
        tables["shaft"].append(table)
    return [(name, kind) for _, name, kind in bodies]


def _body(model: Model, part: Component, gears, pairs, names, tables, remarks) -> str:
    """Add the body of a gear, a solid cylinder without its shaft, or a seat; its name."""
    name = names[part.id]
    if part.id not in gears:
        mass, inertia, transverse = _SEAT[0], _SEAT[1], _SEAT[1]
        how = "assumed: a seat, little beside the shaft"
    else:
        pair = pairs[gears[part.id][1].id]
        key = _key(model, part, gears[part.id][1])
        module, width = (to_si(pair["set"][k], LENGTH) for k in ("module", "face_width"))
        helix = to_si(pair["set"].get("helix_angle", "0 deg"), ANGLE)
        radius = 0.5 * module * pair[key]["teeth"] / math.cos(helix)
        bore = to_si(pair[key]["bore_radius"], LENGTH)
        density = to_si(pair["material"]["density"], DENSITY)
        mass, inertia, transverse = cylinder(bore, radius, width, density)
        how = "assumed: cylinder from the bore to the reference circle"
    table = {"name": name}
    for key, value in (("mass", mass), ("inertia", inertia), ("transverse_inertia", transverse)):
        remarks[f"body:{name}.{key}"] = how
        table[key] = f"{value:.4g} {(MASS if key == 'mass' else INERTIA).shown}"
    tables["body"].append(table)
    return name


def _key(model: Model, gear: Component, stage: Component) -> str:
    """Section of a gear in the case of its stage."""
    return "gear_1" if gears_of(model, stage)[0].id == gear.id else "gear_2"


def _bearing(model: Model, part: Component, body: str, gears, pairs, tables, remarks) -> None:
    radial = model.number(part, "radial_stiffness", STIFFNESS)
    table = {"body": body}
    if radial is None or radial <= 0.0:
        pair = next(iter(pairs.values()))
        estimate = SUPPORT_SHARE * USUAL_STIFFNESS * to_si(pair["set"]["face_width"], LENGTH)
        table["radial"] = f"{estimate:.4g} N/m"
        remarks[f"bearing[{len(tables['bearing'])}].radial"] = "assumed: the file has none"
    else:
        table["radial"] = "rigid" if radial > _SOFT else with_unit(radial, STIFFNESS)
    tables["bearing"].append(table)


def _section(model: Model, shaft: Component, start: float, end: float) -> tuple[float | None, float]:
    """Outer and inner diameter [m] of a round beam as stiff in torsion as the sections between two places."""
    compliance, covered, bores = 0.0, 0.0, []
    for part in model.related(("assembly", "ordered_assembly"), "part", assembly=shaft.id):
        if part.type != "shaft_section":
            continue
        keys = (
            "u_coordinate_on_shaft",
            "length",
            "outer_diameter_begin",
            "outer_diameter_end",
            "inner_diameter_begin",
            "inner_diameter_end",
        )
        at, length, begin, finish, inner, inside = (model.number(part, key, LENGTH) or 0.0 for key in keys)
        share = min(end, at + length) - max(start, at)
        outer, bore = 0.5 * (begin + finish), 0.5 * (inner + inside)
        if share > 0.0 and _THICKEST > outer > bore >= 0.0:
            compliance += share / (outer**4 - bore**4)
            covered += share
            bores.append(bore)
    if not covered or covered < 0.5 * (end - start):
        return None, 0.0
    bore = min(bores)
    return (covered / compliance + bore**4) ** 0.25, bore


def _stage(model: Model, stage: Component, pair, file: str, names, tables, speed: Mapping[str, float]) -> None:
    """Add a parallel stage; its helix is positive where it pushes the second gear along z (see the docs)."""
    gears = gears_of(model, stage)
    helix = to_si(pair["set"].get("helix_angle", "0 deg"), ANGLE)
    normal = to_si(pair["set"]["pressure_angle"], ANGLE)
    angle = math.atan(math.tan(normal) / math.cos(helix))
    module = to_si(pair["set"]["module"], LENGTH) / math.cos(helix)
    table: dict[str, Any] = {"between": [names[one.id] for one in gears]}
    table["teeth"] = [pair["gear_1"]["teeth"], pair["gear_2"]["teeth"]]
    distance = pair["set"].get("centre_distance")
    base = [0.5 * module * z * math.cos(angle) for z in table["teeth"]]
    if helix or distance is None or sum(base) >= to_si(distance, LENGTH):
        table |= {"module": with_unit(module, LENGTH), "pressure_angle": with_unit(angle, ANGLE)}
    else:
        working = math.acos(sum(base) / to_si(distance, LENGTH))
        table |= {"base_radii": [with_unit(one, LENGTH) for one in base], "pressure_angle": with_unit(working, ANGLE)}
    if helix:
        shaft = shaft_of(model, gears[0])
        # the thrust on a right-handed gear that drives has the sense of its rotation, on its mate the other
        sense = turning(speed[shaft.id] if shaft else 1.0)
        table["helix_angle"] = with_unit(-sense * helix, ANGLE)
    turned = model.number(stage, "rotating_angle_around_neg_u_axis", ANGLE)
    if turned:
        table["direction"] = with_unit(-math.remainder(turned, math.tau), ANGLE)
    tables["parallel"].append(table | {"stiffness": file})
