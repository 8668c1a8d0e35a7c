"""A planetary stage of a REXS file as the tables of a case, and the other way round.

Stages are found by their relations, not by names: the planetary stage holds cylindrical stages, each of which
joins two gears; the ring gear is a component of its own type, planets mesh with it, the sun with the planets.
The ring's profile shift has the sign of ISO 21771, the opposite of femgear's; its teeth and diameters are
positive, negative ones are understood. Attributes are those of the REXS specifications 1.0 to 2.0
(www.rexs.info), units are read from the file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from femgear.case.estimates import usual_rim, usual_torque
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import (
    ANGLE,
    DENSITY,
    LENGTH,
    MODULUS,
    SPEED,
    STIFFNESS,
    STRESS,
    TORQUE,
    Dimension,
    to_si,
)
from femgear.case.sections import Case
from femgear.errors import CaseError
from femgear.exchange.rexs import Component, Model, Relation
from femgear.gears.kinematics import MEMBERS, torque_ratios

_POWER = Dimension("a power", "W", "kW", 1e3)
_STEEL = {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}
_GEARS = ("sun", "planet", "ring")
_TOOLS = ("rack_shaped_tool", "cutter_wheel_tool")
_RIGID = 1e15
"""Stiffness of bearings and couplings from which on they are no springs [N/m], the largest of a case."""


@dataclass(frozen=True)
class _Stage:
    """Components of a planetary stage; ``gears`` are sun, one planet and ring, ``shafts`` those of the members."""

    model: Model
    stage: Component
    meshes: tuple[Component, ...]
    sun_meshes: tuple[Component, ...]
    planets: tuple[Component, ...]
    gears: dict[str, Component]
    flanks: dict[str, tuple[Component, ...]]
    shafts: dict[str, list[Component]]


def case_tables(model: Model, wanted: str | None = None) -> tuple[dict[str, Any], dict[str, str]]:
    """Read a planetary stage as tables of a case, with remarks by key on what is assumed.

    Parameters
    ----------
    wanted : str, optional
        Id of the stage, needed where there are several.

    Raises
    ------
    CaseError
        E-CHOICE: several stages, or not that one. E-REXS: no planetary stage, or one of another form. E-UNIT.
    """
    found = _stage(model, _chosen(model, wanted))
    remarks: dict[str, str] = {}
    title = f"{found.stage.name or found.stage} of {model.name.rpartition('/')[2]}"
    tables = {"format": 1, "title": "".join(c for c in title if c.isprintable())[:200]}
    tables |= {"set": _set(found, remarks), "material": _material(found, remarks)}
    tables |= {name: _gear(found, name, remarks) for name in _GEARS}
    _racks(found, tables, remarks)
    for name in _GEARS:
        _rim(found, name, tables, remarks)
    _supports(found, tables, remarks)
    tables["operation"] = _operation(found, tables, remarks)
    if "helix_angle" in tables["set"]:
        tables["static"] = {"slices": 25}
        remarks["static.slices"] = "assumed"
    open_shifts = [name for name in ("sun", "ring") if "profile_shift" not in tables[name]]
    if open_shifts and "centre_distance" in tables["set"]:
        of = " and ".join(open_shifts)
        remarks["set.centre_distance"] = (
            f"assumed: meshes without play, which gives the profile shift of {of}"
        )
    return tables, remarks


def _chosen(model: Model, wanted: str | None) -> Component:
    """Planetary stage of an id, or the only one."""
    stages = [one for one in model.components.values() if one.type == "planetary_stage"]
    if not stages:
        kinds = sorted({one.type for one in model.components.values() if one.type.endswith("_stage")})
        model.refuse(
            "the file has no planetary stage", "planetary_stage", limit=f"found: {', '.join(kinds) or 'no stage'}",
            remedy="femgear imports planetary stages alone; femgear new pair writes a case of two gears",
        )  # fmt: skip
    listed = ", ".join(f"{one.id} ({one.name})" if one.name else one.id for one in stages[:20])
    chosen = [one for one in stages if one.id == wanted] if wanted is not None or len(stages) > 1 else stages
    if not chosen:
        message = (
            "no planetary stage has this id" if wanted else f"the file has {len(stages)} planetary stages"
        )
        raise CaseError(
            message, code="E-CHOICE", key="--stage", value=wanted, limit=listed, file=model.name,
            remedy=f"choose one by its id: --stage {stages[0].id}",
        )  # fmt: skip
    return chosen[0]


def _stage(model: Model, stage: Component) -> _Stage:
    """Gears, flanks and shafts of a stage, by its relations."""
    meshes: list[tuple[Component, Component, Component]] = []
    for mesh in model.related("assembly", "part", assembly=stage.id):
        gears = [one for role in ("gear_1", "gear_2") for one in model.related("stage", role, stage=mesh.id)]
        if mesh.type == "cylindrical_stage" and len(gears) == 2:
            meshes.append((mesh, gears[0], gears[1]))
    mates: dict[str, list[Component]] = {}
    for _, one, two in meshes:
        mates.setdefault(one.id, []).append(two)
        mates.setdefault(two.id, []).append(one)
    rings = [model.components[id] for id in mates if model.components[id].type == "ring_gear"]
    planets = mates[rings[0].id] if len(rings) == 1 else []
    ids = {one.id for one in planets}
    suns = {one.id: one for planet in planets for one in mates[planet.id] if one.id != rings[0].id}
    # every planet meshes with the one sun and the one ring, and with nothing else
    if len(rings) != 1 or len(suns) != 1 or ids & suns.keys() or len(meshes) != 2 * len(ids):
        model.refuse(
            f"{len(meshes)} meshes join {len(rings)} ring gears, {len(ids)} planets and {len(suns)} suns",
            str(stage), limit="one sun, one ring gear, and planets that mesh with both and with nothing else",
            remedy="femgear computes simple planetary sets: no pairs of planets, no stepped ones, no second sun",
        )  # fmt: skip
    (sun,) = suns.values()
    gears = {"sun": sun, "planet": planets[0], "ring": rings[0]}
    flanks = {
        name: tuple(one for role in ("left", "right") for one in model.related("flank", role, gear=gear.id))
        for name, gear in gears.items()
    }
    flanks["planet"] += tuple(
        one
        for p in planets[1:]
        for role in ("left", "right")
        for one in model.related("flank", role, gear=p.id)
    )
    shafts = {name: model.related("assembly", "assembly", part=gears[name].id) for name in ("sun", "ring")}
    shafts["carrier"] = model.related("planet_carrier_shaft", "shaft", planetary_stage=stage.id)
    with_sun = tuple(mesh for mesh, one, two in meshes if sun.id in (one.id, two.id))
    all_meshes = tuple(mesh for mesh, *_ in meshes)
    return _Stage(model, stage, all_meshes, with_sun, tuple(planets), gears, flanks, shafts)


def _common(
    model: Model,
    members: Iterable[Component],
    attribute: str,
    dimension: Dimension | None = None,
    *,
    size=False,
) -> float | None:
    """Value that all components have which give it; of ``size`` without signs."""
    found: dict[float, Component] = {}
    for one in members:
        if (value := model.number(one, attribute, dimension)) is not None:
            found.setdefault(abs(value) if size else value, one)
    values = list(found)
    if values and max(values) - min(values) > 1e-9 * max(map(abs, values)):
        one, two = found[min(values)], found[max(values)]
        model.refuse(
            f"{min(values):.9g} here and {max(values):.9g} of {two} in SI units", f"{one}, {attribute}",
            limit="one value for all", remedy="femgear needs equal planets, and gears that match",
        )  # fmt: skip
    return values[0] if values else None


def _needed(value: float | None, model: Model, component: Component, attribute: str) -> float:
    if value is None:
        model.refuse("the attribute is missing", f"{component}, {attribute}", "give it, and export again")
    return value


def _shown(value: float, dimension: Dimension) -> str:
    return f"{float(f'{value / dimension.scale:.12g}')!r} {dimension.shown}".replace(".0 ", " ")


def _set(s: _Stage, remarks: dict[str, str]) -> dict[str, Any]:
    """Section of what the gears share; planet angles where planets are not equally spaced."""
    model, gears = s.model, s.gears.values()
    found: dict[str, Any] = {"planets": len(s.planets)}
    distance = _common(model, s.meshes, "center_distance", LENGTH, size=True)
    if distance is not None:
        found["centre_distance"] = _shown(distance, LENGTH)
    widths = [model.number(one, "face_width", LENGTH) for one in (*gears, *s.planets)]
    width = _common(model, s.meshes, "common_face_width", LENGTH)
    given = [one for one in widths if one is not None]
    if width is None and given:
        width = min(given)
    found["face_width"] = _shown(_needed(width, model, s.gears["sun"], "face_width"), LENGTH)
    if given and max(given) > min(given):
        remarks["set.face_width"] = f"assumed: for all gears; the widest has {_shown(max(given), LENGTH)}"
    turned = [model.number(mesh, "rotating_angle_around_neg_u_axis", ANGLE) for mesh in s.sun_meshes]
    angles = sorted(one % math.tau for one in turned if one is not None)
    if len(angles) < len(turned):
        remarks["set.planets"] = "assumed: equally spaced"
    elif (
        max(abs(b - a - math.tau / len(angles)) for a, b in pairwise((*angles, angles[0] + math.tau))) > 1e-6
    ):
        found["planet_angles"] = [_shown(one - angles[0], ANGLE) for one in angles]
    members = ((s.gears["sun"],), s.planets, (s.gears["ring"],))
    helix = [_common(model, one, "helix_angle_reference_diameter", ANGLE) for one in members]
    if any(helix):
        sun, planet, ring = (one or 0.0 for one in helix)
        if abs(sun + planet) > 1e-9 or abs(sun + ring) > 1e-9:
            key = f"{s.gears['sun']}, helix_angle_reference_diameter"
            model.refuse("helix angles do not match", key, limit="equal ones, the sun's of the other sign")
        found["helix_angle"] = _shown(sun, ANGLE)
        remarks["set.helix_angle"] = "assumed: positive is right-handed"
    return found


def _material(s: _Stage, remarks: dict[str, str]) -> dict[str, Any]:
    """Material of the sun for all gears, the lowest strengths of all."""
    model, found = s.model, {}
    of = {name: model.related("reference", "referenced", origin=gear.id) for name, gear in s.gears.items()}
    made = {name: next((one for one in ones if one.type == "material"), None) for name, ones in of.items()}
    for key, attribute, dimension in (
        ("youngs_modulus", "elastic_modulus", MODULUS),
        ("poisson_ratio", "poisson_ratio", None),
        ("density", "density", DENSITY),
    ):
        values = [None if one is None else model.number(one, attribute, dimension) for one in made.values()]
        first = next((one for one in values if one is not None), None)
        found[key] = (
            _STEEL[key] if first is None else first if dimension is None else _shown(first, dimension)
        )
        if first is None:
            remarks[f"material.{key}"] = "assumed: steel"
        elif any(one is None or abs(one - first) > 1e-9 * abs(first) for one in values):
            remarks[f"material.{key}"] = "assumed: for all gears, those of the file differ"
    for key, attribute in (
        ("root_stress_limit", "endurance_limit_root"),
        ("contact_stress_limit", "endurance_limit_flank"),
    ):
        values = []
        for name, gear in s.gears.items():
            owners = (gear, *(one for one in (made[name],) if one is not None))
            given = [model.number(one, attribute, STRESS) for one in owners]
            values.append(next((one for one in given if one is not None), None))
        known = [one for one in values if one is not None]
        if len(known) == len(values):
            found[key] = _shown(min(known), STRESS)
            if max(known) > min(known):
                remarks[f"material.{key}"] = "assumed: for all gears, the lowest of the file"
    return found


def _gear(s: _Stage, name: str, remarks: dict[str, str]) -> dict[str, Any]:
    """Section of a gear without rack and rim."""
    model, gear, flanks = s.model, s.gears[name], s.flanks[name]
    members = s.planets if name == "planet" else (gear,)
    teeth = _needed(_common(model, members, "number_of_teeth", size=True), model, gear, "number_of_teeth")
    if teeth != round(teeth):
        model.refuse(f"{teeth:g} is no number of teeth", f"{gear}, number_of_teeth")
    found: dict[str, Any] = {"teeth": round(teeth)}
    module = _common(model, (*s.gears.values(), *s.planets), "normal_module", LENGTH)
    if name == "sun":
        found["module"] = _shown(_needed(module, model, gear, "normal_module"), LENGTH)
        every = [one for ones in s.flanks.values() for one in ones]
        angle = _common(model, every, "normal_pressure_angle", ANGLE)
        found["pressure_angle"] = "20 deg" if angle is None else _shown(angle, ANGLE)
        if angle is None:
            remarks["sun.pressure_angle"] = "assumed"
    shift = _common(model, flanks, "addendum_modification_coefficient")
    if shift is not None:
        found["profile_shift"] = -shift + 0.0 if name == "ring" else shift
    elif name == "planet":
        found["profile_shift"] = 0.0
        remarks["planet.profile_shift"] = "assumed"
    for key in ("tip_diameter", "root_diameter"):
        if (diameter := _common(model, members, key, LENGTH, size=True)) is not None:
            found[key] = _shown(diameter, LENGTH)
    return found


def _racks(s: _Stage, tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Basic racks from flanks and tools: that of the sun for all, of others where they differ."""
    module = to_si(tables["sun"]["module"], LENGTH)
    for name in _GEARS:
        rack, said = {"addendum": 1.0, "dedendum": 1.25, "root_radius": 0.25}, {}
        tools = list(_tools(s, name))
        if "tip_diameter" not in tables[name]:
            said["addendum"] = _common(s.model, s.flanks[name], "addendum_coefficient_basic_profile")
        for tool in tools[:1]:
            said["dedendum"] = s.model.number(tool, "addendum_coefficient_reference_profile")
            radius = s.model.number(tool, "tip_radius", LENGTH)
            factor = s.model.number(tool, "tip_radius_factor")
            said["root_radius"] = radius / module if factor is None and radius is not None else factor
            if tool.type == "cutter_wheel_tool" and name == "ring":
                teeth = s.model.number(tool, "number_of_teeth")
                shift = s.model.number(tool, "addendum_modification_coefficient")
                tables[name] |= {} if teeth is None else {"cutter_teeth": round(teeth)}
                tables[name] |= {} if not shift else {"cutter_profile_shift": shift}
        rack |= {key: value for key, value in said.items() if value is not None}
        place = tables if name == "sun" else tables[name]
        if name == "sun" or rack != tables["rack"]:
            place["rack"] = rack
            where = "rack" if name == "sun" else f"{name}.rack"
            missing = [key for key in rack if said.get(key) is None]
            if "tip_diameter" in tables[name]:
                missing = [key for key in missing if key != "addendum"]
            remarks |= {f"{where}.{key}": "assumed: ISO 53 profile C" for key in missing}


def _tools(s: _Stage, name: str) -> Iterable[Component]:
    """Tools that relations join with a gear or its flanks; the manufacturing steps of flanks since 1.4."""
    for one in (s.gears[name], *s.flanks[name]):
        for kinds, role, to in (
            (("reference", "ordered_reference"), "origin", "referenced"),
            (("manufacturing_step",), "workpiece", "tool"),
        ):
            yield from (t for t in s.model.related(kinds, to, **{role: one.id}) if t.type in _TOOLS)


def _rim(s: _Stage, name: str, tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Bore or outer radius: of the gear, of the shaft where it stands, or assumed."""
    model, gear, section = s.model, s.gears[name], tables[name]
    key, module = "outer_radius" if name == "ring" else "bore_radius", to_si(tables["sun"]["module"], LENGTH)
    dedendum = section.get("rack", tables["rack"])["dedendum"]
    helix, shift = to_si(tables["set"].get("helix_angle", "0 deg"), ANGLE), section.get("profile_shift", 0.0)
    usual, root = usual_rim(section["teeth"], module, dedendum, shift, internal=name == "ring", helix=helix)
    given = None if name == "ring" else model.number(gear, "inner_diameter", LENGTH)
    if given is None:
        place = model.number(gear, "u_coordinate_on_shaft", LENGTH) or 0.0
        shafts = model.related("assembly", "assembly", part=gear.id)
        given = next((d for one in shafts for d in [_diameter(model, one, place)] if d is not None), None)
    fits = given is not None and (0.5 * given > root if name == "ring" else 0.0 < 0.5 * given < root)
    section[key] = _shown(0.5 * given if fits and given else usual, LENGTH)
    if not fits:
        why = "" if given is None else f"; the shaft of {_shown(given, LENGTH)} does not fit its root circle"
        remarks[f"{name}.{key}"] = f"assumed: a rim of a few modules{why}"


def _diameter(model: Model, shaft: Component, place: float) -> float | None:
    """Outer diameter [m] of a shaft at a place along it [m]."""
    for part in model.related(("assembly", "ordered_assembly"), "part", assembly=shaft.id):
        if part.type != "shaft_section":
            continue
        start = model.number(part, "u_coordinate_on_shaft", LENGTH) or 0.0
        length = model.number(part, "length", LENGTH) or 0.0
        ends = [model.number(part, f"outer_diameter_{end}", LENGTH) for end in ("begin", "end")]
        if length > 0.0 and start - 1e-9 <= place <= start + length + 1e-9 and None not in ends:
            return float(ends[0] + (ends[1] - ends[0]) * (place - start) / length)
    return None


def _supports(s: _Stage, tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Radial stiffness of the bearings of planet, sun and carrier, where they are springs."""
    model = s.model
    shaft = next(iter(model.related("assembly", "assembly", part=s.gears["planet"].id)), None)
    bearings = {"planet": [] if shaft is None else model.related("side", "assembly", outer_part=shaft.id)}
    for name in ("sun", "carrier"):
        tables.setdefault(name, {})
        ones = [b for one in s.shafts[name] for b in model.related("side", "assembly", inner_part=one.id)]
        bearings[name] = [b for b in ones if _in_casing(model, b)]
    for name, found in bearings.items():
        values = [model.number(b, "radial_stiffness", STIFFNESS) for b in found if b.type.endswith("bearing")]
        total = sum(one for one in values if one is not None)
        key = "bearing_stiffness" if name == "planet" else "support_stiffness"
        if 1.0 <= total <= _RIGID:
            tables[name][key] = _shown(total, STIFFNESS)
        elif total:
            remarks[f"{name}.{key}"] = f"the {total:.3g} N/m of the file stand for a rigid bearing"


def _in_casing(model: Model, bearing: Component) -> bool:
    """Whether a bearing or coupling stands in the casing."""
    return any(one.type == "gear_casing" for one in model.related("side", "outer_part", assembly=bearing.id))


def _operation(s: _Stage, tables: dict[str, Any], remarks: dict[str, str]) -> dict[str, Any]:
    """Input, fixed member, torque and speeds of the input."""
    model = s.model
    held = [name for name in MEMBERS if any(_coupled(model, one) for one in s.shafts[name])]
    fixed = held[0] if len(held) == 1 else "ring"
    if len(held) != 1:
        remarks["operation.fixed"] = "assumed"
    states = [_state(s, given) for given in (model.load_cases or ({},))]
    turning, loaded = ([name for name in MEMBERS if name != fixed and name in one] for one in states[0])
    member = next(iter([*(one for one in turning if one in loaded), *turning, *loaded]), None)
    if member is None:
        member = "sun" if fixed != "sun" else "carrier"
        remarks["operation.input"] = "assumed"
    ratios = torque_ratios(tables["sun"]["teeth"], tables["ring"]["teeth"])
    torques, speeds = [], []
    for turns, loads in states:
        speed = turns.get(member, 0.0)
        # torques of all members follow from one; femgear's speeds are positive
        for by in [one for one in (member, *loads) if one != fixed and one in loads][:1]:
            torques.append(loads[by] * ratios[member] / ratios[by] * math.copysign(1.0, speed))
        speeds += [abs(speed)] if speed and abs(speed) not in speeds else []
    torque = torques[0] if torques else None
    if any(abs(one - torque) > 1e-6 * abs(torque) for one in torques):
        remarks["operation.torque"] = "assumed: that of the first load case; those of the file differ"
    if torque is None:
        width, module = (to_si(tables[a][b], LENGTH) for a, b in (("set", "face_width"), ("sun", "module")))
        teeth = tables["sun"]["teeth"], tables["planet"]["teeth"]
        on_sun = usual_torque(teeth, module, width, len(s.planets))
        torque = float(f"{on_sun * abs(ratios[member]):.3g}")
        remarks["operation.torque"] = "assumed: K factor of 1 N/mm^2"
    if not speeds:
        speeds = [1000.0 * SPEED.scale]
        remarks["operation.speeds"] = "assumed"
    return {
        "input": member, "fixed": fixed, "torque": _shown(torque, TORQUE),
        "speeds": [_shown(one, SPEED) for one in speeds],
    }  # fmt: skip


def _coupled(model: Model, shaft: Component) -> bool:
    """Whether a coupling holds a shaft in the casing."""
    ones = model.related("side", "assembly", inner_part=shaft.id)
    return any(one.type.endswith("coupling") and _in_casing(model, one) for one in ones)


def _state(s: _Stage, given: Any) -> tuple[dict[str, float], dict[str, float]]:
    """Speeds [rad/s] and torques [N m] of the members in a load case; a power gives the torque at its speed."""
    model, turns, loads = s.model, {}, {}
    for name in MEMBERS:
        for shaft in s.shafts[name]:
            one = replace(shaft, attributes={**shaft.attributes, **given.get(shaft.id, {})})
            speed = model.number(one, "rotational_speed", SPEED)
            if speed:
                turns[name] = speed
            for part in model.related("assembly", "part", assembly=shaft.id):
                if part.type != "external_load":
                    continue
                load = replace(part, attributes={**part.attributes, **given.get(part.id, {})})
                torque = model.number(load, "torque_around_u_axis", TORQUE)
                power = model.number(load, "power", _POWER)
                if not torque and power and speed:
                    torque = power / speed
                loads |= {name: torque} if torque else {}
    return turns, loads


class _Writer:
    """Components and relations of a new model."""

    def __init__(self, name: str):
        self.name, self.components, self.relations, self.cases = name, {}, [], ()

    def add(self, type: str, name: str = "", **attributes: tuple[object, str] | None) -> str:
        """Add a component with those attributes that are given, and return its id."""
        id = str(len(self.components) + 1)
        given = {key: (str(one[0]), one[1]) for key, one in attributes.items() if one is not None}
        self.components[id] = Component(id, type, name, given)
        return id

    def relate(self, type: str, **roles: str) -> None:
        self.relations.append(Relation(type, tuple(roles.items())))


def _attribute(value: float | None, unit: str = "none") -> tuple[object, str] | None:
    """SI value in a unit of REXS; None stays None."""
    if value is None:
        return None
    scale = {
        "mm": 1e-3, "deg": math.pi / 180, "1 / min": SPEED.scale, "N / mm^2": 1e6, "kg / dm^3": 1e3
    }.get(unit, 1.0)  # fmt: skip
    return float(f"{value / scale:.15g}"), unit


def stage_model(case: Case, name: str) -> Model:
    """Write gears, material, bearings and operation of a planetary set as a REXS model of version 1.4.

    Masses, planet errors, modifications, dynamics and housing have no place in it.
    """
    gears, w = planetary_set(case), _Writer(name)
    unit, casing = w.add("gear_unit", case.title), w.add("gear_casing", "casing")
    stage, carrier = w.add("planetary_stage", case.title), w.add("planet_carrier", "carrier")
    for part in (casing, stage):
        w.relate("assembly", assembly=unit, part=part)
    w.relate("assembly", assembly=stage, part=carrier)
    made, shafts = {}, {}
    made["sun", 0], shafts["sun"] = _add_gear(w, case, "sun", gears.sun)
    made["ring", 0], shafts["ring"] = _add_gear(w, case, "ring", gears.ring)
    shafts["carrier"] = w.add("shaft", "carrier shaft")
    w.relate("planet_carrier_shaft", planetary_stage=stage, shaft=shafts["carrier"])
    for member in ("sun", "ring"):
        w.relate("central_shaft", planetary_stage=stage, shaft=shafts[member])
    for number, angle in enumerate(gears.planet_angles, start=1):
        planet, shaft = _add_gear(w, case, f"planet {number}", gears.planet)
        w.relate("planet_shaft", planetary_stage=stage, shaft=shaft)
        pin = w.add("shaft", f"pin {number}")
        w.relate("planet_pin", planetary_stage=stage, shaft=pin)
        stiffness = _attribute(case.planet.bearing_stiffness, "N / m")
        bearing = w.add("concept_bearing", f"bearing of planet {number}", radial_stiffness=stiffness)
        w.relate("side", assembly=bearing, outer_part=shaft, inner_part=pin)
        for mate, turned in (("sun", angle), ("ring", angle + math.pi)):
            mesh = w.add(
                "cylindrical_stage", f"{mate} and planet {number}",
                center_distance=_attribute(gears.centre_distance, "mm"),
                rotating_angle_around_neg_u_axis=_attribute(turned % math.tau, "deg"),
            )  # fmt: skip
            w.relate("assembly", assembly=stage, part=mesh)
            pair = (made["sun", 0], planet) if mate == "sun" else (planet, made["ring", 0])
            w.relate("stage", stage=mesh, gear_1=pair[0], gear_2=pair[1])
    _add_operation(w, case, shafts, casing)
    return Model(name, "1.4", w.components, tuple(w.relations), tuple(w.cases))


def _add_gear(w: _Writer, case: Case, name: str, gear: Any) -> tuple[str, str]:
    """Add a gear with shaft, flanks, tool and material; ids of gear and shaft."""
    section, normal = getattr(case, gear.name), math.cos(case.helix_angle or 0.0)
    rack, sense = section.rack or case.rack, 1.0 if gear.name == "sun" else -1.0
    shaft = w.add("shaft", f"{name} shaft")
    id = w.add(
        "ring_gear" if gear.internal else "cylindrical_gear", name, number_of_teeth=(gear.teeth, "none"),
        normal_module=_attribute(case.module, "mm"), face_width=_attribute(case.set.face_width, "mm"),
        helix_angle_reference_diameter=_attribute(sense * (case.helix_angle or 0.0), "deg"),
        tip_diameter=_attribute(section.tip_diameter, "mm"),
        root_diameter=_attribute(section.root_diameter, "mm"), u_coordinate_on_shaft=(0.0, "mm"),
        inner_diameter=None if gear.internal else _attribute(2.0 * gear.rim_radius, "mm"),
    )  # fmt: skip
    w.relate("assembly", assembly=shaft, part=id)
    if gear.internal:
        outer = _attribute(2.0 * gear.rim_radius, "mm")
        part = w.add(
            "shaft_section", u_coordinate_on_shaft=(0.0, "mm"), length=_attribute(case.set.face_width, "mm"),
            outer_diameter_begin=outer, outer_diameter_end=outer,
        )  # fmt: skip
        w.relate("assembly", assembly=shaft, part=part)
    material = w.add(
        "material", "gears", elastic_modulus=_attribute(case.material.youngs_modulus, "N / mm^2"),
        poisson_ratio=_attribute(case.material.poisson_ratio),
        density=_attribute(case.material.density, "kg / dm^3"),
        endurance_limit_root=_attribute(case.material.root_stress_limit, "N / mm^2"),
        endurance_limit_flank=_attribute(case.material.contact_stress_limit, "N / mm^2"),
    )  # fmt: skip
    w.relate("reference", origin=id, referenced=material)
    cutter = getattr(section, "cutter_teeth", None)
    more = {} if cutter is None else {
        "number_of_teeth": (cutter, "none"),
        "addendum_modification_coefficient": _attribute(section.cutter_profile_shift),
    }  # fmt: skip
    tool = w.add(
        "rack_shaped_tool" if cutter is None else "cutter_wheel_tool", f"tool of {name}",
        addendum_coefficient_reference_profile=_attribute(rack.dedendum),
        tip_radius_factor=_attribute(rack.root_radius), **more,
    )  # fmt: skip
    settings = w.add("cylindrical_gear_manufacturing_settings")
    shift = gear.profile_shift / normal * (-1.0 if gear.internal else 1.0)
    flanks = [
        w.add(
            "cylindrical_gear_flank", f"{side} flank of {name}",
            addendum_modification_coefficient=_attribute(shift),
            normal_pressure_angle=_attribute(case.pressure_angle, "deg"),
            addendum_coefficient_basic_profile=_attribute(rack.addendum),
        )
        for side in ("left", "right")
    ]  # fmt: skip
    w.relate("flank", gear=id, left=flanks[0], right=flanks[1])
    for flank in flanks:
        w.relate("manufacturing_step", workpiece=flank, tool=tool, manufacturing_settings=settings)
    return id, shaft


def _add_operation(w: _Writer, case: Case, shafts: dict[str, str], casing: str) -> None:
    """Add load, speeds, the coupling of the fixed member and the bearings of sun and carrier."""
    operation = case.operation
    held = w.add("coupling", f"{operation.fixed} held")
    w.relate("side", assembly=held, outer_part=casing, inner_part=shafts[operation.fixed])
    for member in ("sun", "carrier"):
        stiffness = getattr(case, member).support_stiffness
        if stiffness:
            bearing = w.add(
                "concept_bearing", f"support of the {member}", radial_stiffness=_attribute(stiffness, "N / m")
            )
            w.relate("side", assembly=bearing, outer_part=casing, inner_part=shafts[member])
    load = w.add(
        "external_load", f"torque on the {operation.input}", defines_torque=("true", "none"),
        torque_around_u_axis=_attribute(operation.torque, "N m"),
    )  # fmt: skip
    shaft = shafts[operation.input]
    w.relate("assembly", assembly=shaft, part=load)
    speeds = [{"rotational_speed": _attribute(one, "1 / min")} for one in operation.speeds]
    old = w.components[shaft]
    first = {
        "rotational_speed": (str(speeds[0]["rotational_speed"][0]), "1 / min"),
        "defines_speed": ("true", "none"),
    }
    w.components[shaft] = replace(old, attributes=first)
    if len(speeds) > 1:
        w.cases = [{shaft: {key: (str(v[0]), v[1]) for key, v in one.items()}} for one in speeds]
