"""A set or a pair written as a gearbox: its members are bodies on springs, to which shafts and a casing can be added.

Sun, carrier, ring, or both gears, become shafts without parts, each one rigid body on a bearing of the stiffnesses that
the case gives it. Teeth, machines, weight, sensors, response and run-up go along.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set, support_stiffness
from femgear.case.planetary import output_member
from femgear.case.quantities import RPM
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.gears.profile import base_helix_angle
from femgear.trains.reading import parse_case
from femgear.trains.registry import train_of

_CASING = "casing"
PAIR, SET = "pair", "set"
"""Names of the only stage."""
_MEMBERS = ("sun", "carrier", "ring")
_MACHINES = "motor", "brake"
_STAYS = ("title", "set", "rack", "material", "sun", "planet", "ring", "carrier", "gear_1", "gear_2", "static")
_TEETH = (*_STAYS, "strength", "helical", "planar", "model", "format")
"""Sections of a case that the teeth of a stage have."""
_OF_GEARBOX = "runup", "lubricant", "losses"
"""Sections that the gearbox has as the case does."""
_OF_PLANAR = (*("branch", "published", "damping_ratios", "smoothing", "gyroscopic", "reaction"),)
"""Entries of planar sets that a gearbox has not."""
_MOST_TURNS = 24
"""Turns of the carrier beside a mesh harmonic that a gearbox takes."""
_NO_NAME = re.compile(r"[^A-Za-z0-9_.-]+")
"""What names of parts do not have."""
_MACHINE_MASS = "1 kg"
"""Mass of a motor or brake, whose axis is held."""
_SPRING_UNITS = {"radial": "N/m", "axial": "N/m", "tilt": "N m/rad", "torsional": "N m/rad"}


@dataclass(frozen=True)
class WrittenAsGearbox:
    """Tables of the gearbox that a case is, and what these leave out.

    Parameters
    ----------
    tables : dict
        Of a case file of a gearbox.
    findings : tuple of Finding
        Entries of the case that the gearbox has no place for (W-UNUSED).
    """

    tables: dict[str, Any]
    findings: tuple[Finding, ...]


def gearbox_of_case(case: Any) -> WrittenAsGearbox:
    """Write a planetary set or a pair as a gearbox of one stage, a file of a former model as the gearbox it is read as.

    Parameters
    ----------
    case : Case
        Of an elastic, planar or helical set, of a pair, or of a former model, from `femgear.read_case`.

    Raises
    ------
    CaseError
        A case of another train (E-CHOICE).
    """
    if case.train == "gearbox" and any(finding.code == "W-FORMER" for finding in case.notices):
        return WrittenAsGearbox(case_text.parse(case.source, ""), ())
    if case.train not in ("elastic", "planar", "helical", "pair"):
        raise CaseError(
            "only a planetary set or a pair of gears is one stage of a gearbox",
            code="E-CHOICE",
            key="model",
            value=case.train,
            limit="a set, with or without the sections planar and helical, or a pair",
        )
    given = case_text.parse(case.source, "")
    tables = {"model": "gearbox", "title": case.title, "motions": _motions(case), "shaft": [], "mass": []}
    tables |= {"bearing": [], "coupling": []}
    tables |= _pair(case, given, tables) if case.train == "pair" else _planetary(case, given, tables)
    driven, taking = _ends(case)
    for name, member in zip(_MACHINES, (driven, taking), strict=True):
        if (machine := getattr(case, name)) is not None:
            _add_machine(tables, name, member, machine)
    driver, output = (name if getattr(case, name) else at for name, at in zip(_MACHINES, (driven, taking), strict=True))
    tables["operation"] = {"output": [output]} | _load_cases(case.operation, driver, driven)
    tables["modes"] = {"damping_ratio": case.dynamics.damping_ratio}
    up_to = case.dynamics.up_to
    dynamics = {"mesh_harmonics": _mesh_harmonics(case), "up_to": None if up_to is None else quantity(up_to, "Hz")}
    tables["dynamics"] = {key: value for key, value in dynamics.items() if value is not None}
    tables["balance"] = _balance(case)
    tables |= {name: given[name] for name in _OF_GEARBOX if name in given}
    if seals := given.get("losses", {}).get("seal"):
        seals = [seal | {"shaft": seal["shaft"].replace("_", " ")} for seal in seals]
        tables["losses"] = given["losses"] | {"seal": seals}
    kept = {key: value for key, value in tables.items() if value not in ([], {})}
    return WrittenAsGearbox(kept, tuple(_left_out(case, given)))


def case_in_casing(case: Any, text: str, name: str) -> tuple[str, tuple[Finding, ...]]:
    """Write a case as a gearbox in a rigid casing on feet with sensors and a run-up, all estimated.

    Parameters
    ----------
    case : Case
        Of a gearbox without a casing, or as `gearbox_of_case` takes it.
    text : str
        Of its file.
    name : str
        Of the file, for messages.

    Returns
    -------
    text : str
        Of the case file.
    findings : tuple of Finding
        What the gearbox leaves out, and what is estimated.

    Raises
    ------
    CaseError
        As of `gearbox_of_case`; a gearbox that has a casing, or sensors.
    """
    findings = tuple[Finding, ...]()
    former = any(finding.code == "W-FORMER" for finding in case.notices)
    if train_of(case).draft_casing is None or former:
        written = gearbox_of_case(case)
        text, findings = case_text.write(written.tables), written.findings
        case = parse_case(text, name=name)
    draft = train_of(case).draft_casing
    assert draft is not None
    tables, estimates = draft(case)
    text = f"{text.rstrip()}\n\n{tables}"
    parse_case(text, name=name)  # what is no case is refused before a file is written
    return text, (*findings, *estimates)


def quantity(value: float, unit: str) -> str:
    """Write a number with its unit, or ``"rigid"`` where it is infinite."""
    return "rigid" if math.isinf(value) else f"{float(value)!r} {unit}"


def spring_entries(stiffness: Mapping[str, float | None]) -> dict[str, str]:
    """Write the entries of a bearing from its stiffnesses [N/m, N m/rad]; those of zero or None are left out."""
    return {key: quantity(value, _SPRING_UNITS[key]) for key, value in stiffness.items() if value}


def _motions(case: Any) -> str:
    """Motions of the bodies: helical teeth push along the axes."""
    return "space" if getattr(case, "helix_angle", None) or case.train == "helical" else "plane"


def _ends(case: Any) -> tuple[str, str]:
    """Shafts at which torque enters and leaves."""
    if case.train == "pair":
        return "gear 1", "gear 2"
    return case.operation.input, output_member(case)


def _load_cases(operation: Any, driver: str, driven: str) -> dict[str, Any]:
    """Torques at the driver and speeds of the driven shaft: those of the operation, or of its load spectrum."""

    def loaded(torque: float, speed: float) -> dict[str, Any]:
        return {"torque": {driver: quantity(torque, "N m")}, "speed": {driven: quantity(speed, "rad/s")}}

    if not operation.load_case:
        return {"load_case": [loaded(operation.torque, (operation.speeds or (0.0,))[0])]}
    load_cases = [
        {"name": _load_case_name(number, load_case)}
        | loaded(load_case.torque, load_case.speed)
        | ({"share": load_case.share} if load_case.hours is None else {"hours": load_case.hours})
        for number, load_case in enumerate(operation.load_case)
    ]
    hours = {} if operation.required_hours is None else {"required_hours": operation.required_hours}
    return {"load_case": load_cases, "first": 1 + _nearest_load_case(operation)} | hours


def _load_case_name(number: int, load_case: Any) -> str:
    """Write a name that a gearbox takes: letters, digits and blanks, its number in front where that changes it."""
    given = load_case.name or ""
    name = _NO_NAME.sub(" ", given).strip()
    return name if name and name == given and len(name) <= 40 else f"{number + 1} {name}".strip()[:40]


def _nearest_load_case(operation: Any) -> int:
    """Number of the load case whose torque is nearest to that of the operation, of equal ones that with its speed."""
    speed = (operation.speeds or (0.0,))[0]

    def away(load_case: Any) -> tuple[float, float]:
        return abs(load_case.torque - operation.torque), abs(load_case.speed - speed)

    return min(range(len(operation.load_case)), key=lambda number: away(operation.load_case[number]))


def _mesh_harmonics(case: Any) -> int | None:
    """Harmonics of the excitation, no more than the positions of the static contact carry."""
    kept, most = case.dynamics.mesh_harmonics, (case.static.positions - 1) // 2
    return None if kept is None else min(kept, most)


def _balance(case: Any) -> dict[str, Any]:
    """Teeth that part as a planar set asks for them by its responses, with the lines that a gearbox takes at most."""
    if case.train != "planar" or case.planar.response is None:
        return {}
    response, given = case.planar.response, case.planar.mesh_stiffness is not None
    turns = response.carrier_harmonics if given else response.side_bands
    harmonics = 1 if given else _mesh_harmonics(case) or 1
    return {"harmonics": harmonics, "side_bands": min(turns, _MOST_TURNS), "back_flanks": case.planar.back_flanks}


def _teeth_tables(given: Mapping[str, Any], torque: str) -> dict[str, Any]:
    """Tables of a case that the teeth of a stage keep."""
    operation = {key: value for key, value in given["operation"].items() if key in ("input", "fixed")}
    speeds = {"speeds": given["operation"]["speeds"]} if "input" in operation else {}
    tables = {key: given[key] for key in _TEETH if key in given}
    if "planar" in tables:  # the rest of the section is of the set alone
        tables["planar"] = {"ring": tables["planar"].get("ring", {})}
    return tables | {"operation": operation | {"torque": torque} | speeds}


def _pair(case: Any, given: Mapping[str, Any], tables: dict[str, Any]) -> dict[str, Any]:
    """Add both gears of a pair with their bearings; the tables of the stage."""
    pair = planetary_set(case)
    places = ["0 mm", "0 mm"], [quantity(pair.centre_distance, "m"), "0 mm"]
    for name, axis in zip(case.gear_names, places, strict=True):
        section, shaft = getattr(case, name), name.replace("_", " ")
        radial = math.inf if section.bearing_stiffness is None else section.bearing_stiffness
        tables["shaft"].append({"name": shaft, "axis": axis})
        held = {"axial": math.inf, "tilt": math.inf} if _motions(case) == "space" else {}
        tables["bearing"].append({"shaft": shaft} | spring_entries({"radial": radial} | held))
    teeth = _teeth_tables(given, quantity(case.operation.torque, "N m"))
    return {"pair": [{"name": PAIR, "shafts": ["gear 1", "gear 2"], "teeth": teeth}]}


def _planetary(case: Any, given: Mapping[str, Any], tables: dict[str, Any]) -> dict[str, Any]:
    """Add sun, carrier and ring of a set with what holds them; the tables of the stage, its weight and sensors."""
    fixed = case.operation.fixed
    elastic = case.train == "elastic"
    members = dict.fromkeys(_MEMBERS)
    for member in _MEMBERS:
        if elastic and member == "ring" and fixed == "ring":
            members[member] = _CASING
            continue
        members[member] = member
        tables["shaft"].append({"name": member})
        springs = _support(case, member)
        if member == fixed:
            held = springs.pop("torsional", None) or math.inf
            entries = {"torsion": held, "radial": springs.get("radial") or 0.0}
            others = {"axial": springs.get("axial") or 0.0, "bending": springs.get("tilt") or 0.0}
            units = {"torsion": "N m/rad", "bending": "N m/rad", "radial": "N/m", "axial": "N/m"}
            texts = {key: quantity(value, units[key]) for key, value in (entries | others).items() if value}
            tables["coupling"].append({"between": [member, _CASING]} | texts)
        elif entries := spring_entries(springs):
            tables["bearing"].append({"shaft": member} | entries)
    bearing = case.planar.carrier_bearing if case.train == "planar" else None
    if bearing is not None:
        entries = {"name": "carrier bearing", "shaft": "carrier", "radial": quantity(bearing.stiffness, "N/m")}
        entries |= {"clearance": quantity(2.0 * bearing.clearance, "m")} if bearing.clearance else {}
        tables["bearing"].append(entries | ({"outer_shaft": "ring"} if bearing.on == "ring" else {}))
    stage = {"name": SET, **members, "angle": quantity(planetary_set(case).planet_angles[0], "rad")}
    stage |= _gears(case, given, tables) | {"planet": _planet(case)}
    if elastic and members["ring"] == _CASING:
        stage["elastic_ring"] = True
        tables["sensor"] = [*_sensors(case)]
    gravity = case.planar.gravity if case.train == "planar" else None
    if gravity is not None:
        way = [math.cos(gravity.direction), math.sin(gravity.direction), 0.0]
        tables["gravity"] = {"acceleration": quantity(gravity.acceleration, "m/s^2"), "direction": way}
    return {"planetary": [stage]}


def _gears(case: Any, given: Mapping[str, Any], tables: dict[str, Any]) -> dict[str, Any]:
    """Teeth of a set, or its sizes where the case gives the stiffness of its meshes, and then the masses of members."""
    section = getattr(case, case.train, None)
    stiffness = getattr(section, "mesh_stiffness", None)
    if section is None or stiffness is None:
        torque = quantity(case.torque_on_first_gear(), "N m")
        return {"teeth": _teeth_tables(given, torque)}
    gears = planetary_set(case)
    alphas = gears.working_pressure_angle_sun_planet, gears.working_pressure_angle_planet_ring
    base = base_helix_angle(case.sun.pressure_angle, section.signed_helix_angle) if case.train == "helical" else 0.0
    sizes = {
        "teeth": [gear.teeth for gear in gears.gears],
        "planets": gears.n_planets,
        "planet_angles": [quantity(angle, "rad") for angle in gears.planet_angles],
        "base_radii": [quantity(gear.base_radius, "m") for gear in gears.gears],
        "pressure_angles": [quantity(alpha, "rad") for alpha in alphas],
        "helix_angle": quantity(math.atan(math.tan(base) / math.cos(alphas[0])), "rad"),
    }
    for member in _MEMBERS:
        body = section.ring if member == "ring" else getattr(case, member)
        entries = {"mass": quantity(body.mass, "kg"), "inertia": quantity(body.inertia, "kg m^2")}
        if case.train == "helical":
            entries["transverse_inertia"] = quantity(getattr(section, member).diametral_inertia, "kg m^2")
        tables["mass"].append({"shaft": member} | entries)
    meshes = {
        "sun_mesh": (stiffness.sun_planet, gears.backlash_sun_planet),
        "ring_mesh": (stiffness.planet_ring, gears.backlash_planet_ring),
    }
    given_play = getattr(section, "line_backlash", None)
    plays = {name: max(play, 0.0) if given_play is None else given_play for name, (_, play) in meshes.items()}
    entries = {
        name: {"stiffness": quantity(spring, "N/m")} | ({"backlash": quantity(plays[name], "m")} if plays[name] else {})
        for name, (spring, _) in meshes.items()
    }
    return {"gears": sizes, **entries}


def _support(case: Any, member: str) -> dict[str, float | None]:
    """Stiffnesses that hold a member [N/m, N m/rad], a loose elastic ring as a rigid one on its foundation."""
    if case.train == "elastic":
        if member != "ring":
            # helical teeth push members that stay upright where the case lets none of them tilt
            tilt = getattr(case, member).tilt_stiffness
            held = {"axial": math.inf, "tilt": math.inf if tilt is None else tilt} if case.helix_angle else {}
            return {"radial": support_stiffness(case, member)} | held
        ring = planetary_set(case).ring
        face = math.pi * ring.rim_radius * ring.face_width
        turning = 2.0 * face * ring.rim_radius**2 * case.ring.foundation_tangential
        radial = face * (case.ring.foundation_radial + case.ring.foundation_tangential)
        return {"radial": radial, "torsional": turning}
    section = getattr(case, case.train)
    if case.train == "planar":
        body = section.ring if member == "ring" else getattr(case, member)
        radial = support_stiffness(case, member, body)
        return {"radial": radial, "torsional": getattr(section.torsion, member)}
    space = getattr(section, member)
    radial = support_stiffness(case, member, space if member == "ring" else None)
    springs = {"axial": space.axial_stiffness, "tilt": space.tilt_stiffness, "torsional": space.torsional_stiffness}
    return {"radial": radial} | springs


def _planet(case: Any) -> dict[str, Any]:
    """Mass, inertias and bearing of a planet."""
    planet = case.planet
    entries: dict[str, Any] = {"mass": quantity(planet.mass, "kg"), "inertia": quantity(planet.inertia, "kg m^2")}
    bearing = {"radial": quantity(planet.bearing_stiffness, "N/m")}
    if case.train == "helical":
        space = case.helical.planet
        entries["transverse_inertia"] = quantity(space.diametral_inertia, "kg m^2")
        bearing |= {"axial": quantity(space.axial_stiffness, "N/m"), "tilt": quantity(space.tilt_stiffness, "N m/rad")}
    return entries | {"bearing": bearing}


def _sensors(case: Any) -> Iterator[dict[str, Any]]:
    """Sensors on the elastic ring: the one of the housing, and those that have names."""
    housing = case.housing
    yield {"name": "sensor", "ring": SET, "angle": quantity(housing.sensor_angle, "rad")}
    for sensor in housing.sensor:
        way = sensor.angle + sensor.direction
        direction = [math.cos(way), math.sin(way), 0.0]
        place = {"ring": SET, "angle": quantity(sensor.angle, "rad")}
        yield {"name": _NO_NAME.sub(" ", sensor.name).strip()[:40], "direction": direction} | place


def _add_machine(tables: dict[str, Any], name: str, member: str, machine: Any) -> None:
    """Add a rotor on an axis that is held, behind its torsional coupling."""
    axis = next((shaft["axis"] for shaft in tables["shaft"] if shaft["name"] == member and "axis" in shaft), None)
    tables["shaft"].append({"name": name} | ({} if axis is None else {"axis": axis}))
    tables["mass"].append({"shaft": name, "mass": _MACHINE_MASS, "inertia": quantity(machine.inertia, "kg m^2")})
    in_space = {"axial": "rigid", "tilt": "rigid"} if tables["motions"] == "space" else {}
    tables["bearing"].append({"shaft": name, "radial": "rigid"} | in_space)
    tables["coupling"].append({"between": [name, member], "torsion": quantity(machine.coupling_stiffness, "N m/rad")})


def _left_out(case: Any, given: Mapping[str, Any]) -> Iterator[Finding]:
    """Entries without a place in the gearbox."""
    housing, planar = given.get("housing", {}), given.get("planar", {})
    entries = {
        "operation.speeds": len(case.operation.speeds) > 1,
        "dynamics.response_harmonics": "response_harmonics" in given.get("dynamics", {}),
        "dynamics.tolerance": "tolerance" in given.get("dynamics", {}),
        **{
            f"housing.{key}": key in housing
            for key in ("form", "points", "microphone", "published", "measured", "support", "structure")
        },
        **{f"planar.{key}": key in planar for key in _OF_PLANAR},
        "planar.back_flanks": "back_flanks" in planar and "response" not in planar,
        # meshes of a given stiffness take the play along, teeth have their own
        "planar.line_backlash": "line_backlash" in planar and "mesh_stiffness" not in planar,
        "planet.bearing_clearance": bool(given.get("planet", {}).get("bearing_clearance")),
    }
    if case.operation.load_case:
        first = case.operation.load_case[_nearest_load_case(case.operation)]
        if (first.torque, first.speed) != (case.operation.torque, (case.operation.speeds or (0.0,))[0]):
            text = (
                "torque and speed of the operation are no load case: contact, modes and pictures are those of "
                f"{first.torque:g} N m at {first.speed / RPM:.5g} rpm"
            )
            yield Finding("W-UNUSED", "operation.torque", text, remedy="choose another one by operation.first")
    for key, there in entries.items():
        if there:
            text = f"{key} has no place in a gearbox of one stage"
            if key == "operation.speeds":
                yield _one_speed_of(case.operation, "runup" in given)
                continue
            yield Finding("W-UNUSED", key, text)


def _one_speed_of(operation: Any, has_run_up: bool) -> Finding:
    """Say which of several speeds the gearbox has, and what gives levels at the others."""
    if operation.load_case:
        text = "operation.speeds have no place in a gearbox, whose speeds are those of load cases"
        return Finding("W-UNUSED", "operation.speeds", text)
    low, high = (
        f"{abs(speed) / RPM:.6g} rpm" for speed in sorted(operation.speeds, key=abs)[:: len(operation.speeds) - 1]
    )
    first = f"{operation.speeds[0] / RPM:.6g} rpm"
    text = f"a load case has one speed: the first one, {first}, of {len(operation.speeds)} from {low} to {high}"
    remedy = (
        "its [runup] has the others"
        if has_run_up
        else f'for the others give [runup] with from = "{low}", to = "{high}"'
    )
    return Finding("W-UNUSED", "operation.speeds", text, remedy=f"{remedy}; or change operation.load_case[0].speed")
