"""Cases of other trains written as gearboxes, for the comparison of their modes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.system.rigid_bodies import RigidSet
from femgear.trains.drivetrain.case_file import DrivetrainCase, drivetrain_of
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import read_case


def _n(value: float, unit: str) -> str:
    return "rigid" if math.isinf(value) else f"{float(value)!r} {unit}"


def _spring_entries(stiffness) -> dict[str, str]:
    """Entries of a bearing from radial, axial, tilt and torsional stiffness; zeros are left out."""
    units = {"radial": "N/m", "axial": "N/m", "tilt": "N m/rad", "torsional": "N m/rad"}
    return {key: _n(value, units[key]) for key, value in zip(units, stiffness, strict=True) if value > 0.0}


def set_parts(data: RigidSet, teeth, *, name: str = "set") -> dict[str, list]:
    """Tables of shafts, masses, bearings and stage of a set of rigid bodies; all members are shafts."""
    space = len(data.axes) > 3
    parts: dict[str, list] = {"shaft": [], "mass": [], "bearing": [], "planetary": []}
    for member in ("sun", "carrier", "ring"):
        body = getattr(data, member)
        shaft = f"{name} {member}"
        parts["shaft"].append({"name": shaft})
        mass = {"shaft": shaft, "mass": _n(body.mass, "kg"), "inertia": _n(body.inertia, "kg m^2")}
        if space:
            mass["transverse_inertia"] = _n(body.diametral_inertia, "kg m^2")
            k = body.support
            springs = (k.radial, k.axial, k.tilt, k.torsional)
        else:
            springs = (body.support, 0.0, 0.0, body.torsional_support)
        parts["mass"].append(mass)
        if any(springs):
            parts["bearing"].append({"shaft": shaft, **_spring_entries(springs)})
    planet = data.planet
    bearing = data.pin_stiffness[0]
    own = {"mass": _n(planet.mass, "kg"), "inertia": _n(planet.inertia, "kg m^2")}
    own["bearing"] = {"radial": _n(bearing[0], "N/m")}
    if space:
        own["transverse_inertia"] = _n(planet.diametral_inertia, "kg m^2")
        own["bearing"] |= {"axial": _n(bearing[2], "N/m"), "tilt": _n(bearing[3], "N m/rad")}
    angles = np.asarray(data.planet_angles)
    alpha = data.pressure_angle_sun_planet
    helix = math.atan(math.tan(data.contact_lines.base_helix_angle) / math.cos(alpha))
    gears = {
        "teeth": list(teeth),
        "planet_angles": [_n(psi, "rad") for psi in angles],
        "planets": len(angles),
        "base_radii": [_n(r, "m") for r in (data.sun_radius, data.planet_radius, data.ring_radius)],
        "pressure_angles": [_n(alpha, "rad"), _n(data.pressure_angle_planet_ring, "rad")],
        "helix_angle": _n(helix, "rad"),
    }
    parts["planetary"].append(
        {
            "name": name,
            "sun": f"{name} sun",
            "carrier": f"{name} carrier",
            "ring": f"{name} ring",
            "angle": _n(float(angles[0]), "rad"),
            "gears": gears,
            "planet": own,
            "sun_mesh": {"stiffness": _n(float(np.mean(data.stiffness_sun_planet)), "N/m")},
            "ring_mesh": {"stiffness": _n(float(np.mean(data.stiffness_planet_ring)), "N/m")},
        }
    )
    return parts


def set_tables(data: RigidSet, teeth) -> dict[str, Any]:
    """Tables of a gearbox that is one set of rigid bodies; the sun drives, the ring stands."""
    parts = set_parts(data, teeth)
    return {
        "model": "gearbox",
        "title": "one set",
        "motions": "space" if len(data.axes) > 3 else "plane",
        **parts,
        "operation": {
            "output": ["set carrier", "set ring"],
            "load_case": [{"torque": {"set sun": "100 N m"}, "speed": {"set sun": "1000 rpm", "set ring": "0 rpm"}}],
        },
    }


def drivetrain_tables(case: DrivetrainCase) -> dict[str, Any]:
    """Tables of a gearbox that is a drivetrain of bodies, joints and stages; nothing moves along z."""
    train = drivetrain_of(case)
    place = {train.bodies[0].name: np.zeros(3)}
    ways = [(*s.between, np.array([0.0, 0.0, s.length])) for s in train.shafts]
    for stage in train.parallel:
        distance = sum(stage.pitch_radii)
        ways.append((*stage.between, distance * np.array([math.cos(stage.direction), math.sin(stage.direction), 0.0])))
    ways += [(stage.carrier, stage.sun, np.zeros(3)) for stage in train.planetary]
    while len(place) < len(train.bodies):
        for first, second, way in ways:
            if first in place and second not in place:
                place[second] = place[first] + way
            elif second in place and first not in place:
                place[first] = place[second] - way
    tables: dict[str, Any] = {"model": "gearbox", "title": "drivetrain", "shaft": [], "mass": [], "bearing": []}
    for body in train.bodies:
        x, y, z = place[body.name]
        tables["shaft"].append({"name": body.name, "axis": [_n(x, "m"), _n(y, "m")], "start": _n(z, "m")})
        tables["mass"].append(
            {
                "shaft": body.name,
                "mass": _n(body.mass, "kg"),
                "inertia": _n(body.inertia, "kg m^2"),
                "transverse_inertia": _n(body.transverse_inertia, "kg m^2"),
            }
        )
        hold = {"shaft": body.name, "axial": "rigid"}
        tables["bearing"].append(hold if body.tilts else hold | {"tilt": "rigid"})
    for one in train.bearings:
        springs = _spring_entries((one.radial, 0.0, one.tilt, 0.0))
        tables["bearing"].append(
            {"shaft": one.body, **springs} | ({"position": _n(one.offset, "m")} if one.offset else {})
        )
    tables["coupling"] = [
        {
            "between": list(one.between),
            "torsion": _n(one.springs.torsion, "N m/rad"),
            "bending": _n(one.springs.bending, "N m/rad"),
            "radial": _n(one.springs.shear, "N/m"),
        }
        for one in train.shafts
    ]
    tables["pair"] = [
        {
            "name": one.name,
            "shafts": list(one.between),
            "gears": {
                "teeth": list(one.teeth),
                "radii": [_n(r, "m") for r in one.pitch_radii],
                "pressure_angle": _n(one.pressure_angle, "rad"),
            },
            "mesh": {"stiffness": _n(one.mesh.stiffness, "N/m")},
        }
        for one in train.parallel
    ]
    tables["planetary"] = [
        {
            "name": one.name,
            "sun": one.sun,
            "carrier": one.carrier,
            "gears": {
                "teeth": [one.sun_teeth, round(one.planet_teeth_or_half), one.ring_teeth],
                "planets": len(one.angles),
                "base_radii": [_n(r, "m") for r in one.base_radii],
                "centre_distance": _n(one.axis_distance, "m"),
            },
            "planet": {
                "mass": _n(one.planet_mass, "kg"),
                "inertia": _n(one.planet_inertia, "kg m^2"),
                "transverse_inertia": _n(one.planet_transverse_inertia, "kg m^2"),
                "bearing": {"radial": _n(one.planet_bearing, "N/m")},
            },
            "sun_mesh": {"stiffness": _n(one.sun_mesh.stiffness, "N/m")},
            "ring_mesh": {"stiffness": _n(one.ring_mesh.stiffness, "N/m")},
        }
        for one in train.planetary
    ]
    first, last = case.operation.torque[0].body, case.operation.torque[-1].body
    tables["operation"] = {
        "output": [last],
        "load_case": [
            {
                "torque": {first: _n(case.operation.torque[0].torque or 1.0, "N m")},
                "speed": {train.bodies[0].name: _n(case.operation.speed, "rad/s")},
            }
        ],
    }
    return tables


def elastic_set_tables(path: str) -> dict[str, Any]:
    """Tables of a gearbox that is a planetary set with an elastic ring, in the plane, from the file of its case."""
    tables = gearbox_of_case(read_case(path)).tables
    del tables["sensor"]
    return tables | {"deflection": {"contact": False}}


def pair_of_rigid_gears_tables(case, stiffness: float) -> dict[str, Any]:
    """Tables of a gearbox that is the pair of a case on its bearings, in the plane, with a mesh stiffness [N/m]."""
    pair = planetary_set(case)
    gears = [getattr(case, name) for name in case.gear_names]
    return {
        "model": "gearbox",
        "title": "a pair",
        "motions": "plane",
        "shaft": [{"name": "one"}, {"name": "two", "axis": [_n(pair.centre_distance, "m"), "0 mm"]}],
        "mass": [
            {"shaft": name, "mass": _n(gear.mass, "kg"), "inertia": _n(gear.inertia, "kg m^2")}
            for name, gear in zip(("one", "two"), gears, strict=True)
        ],
        "bearing": [
            {"shaft": name, "radial": "rigid" if gear.bearing_stiffness is None else _n(gear.bearing_stiffness, "N/m")}
            for name, gear in zip(("one", "two"), gears, strict=True)
        ],
        "pair": [
            {
                "name": "pair",
                "shafts": ["one", "two"],
                "gears": {
                    "teeth": [gear.teeth for gear in pair.gears],
                    "base_radii": [_n(gear.base_radius, "m") for gear in pair.gears],
                    "pressure_angle": _n(pair.working_pressure_angle, "rad"),
                },
                "mesh": {"stiffness": _n(stiffness, "N/m")},
            }
        ],
        "operation": {
            "output": ["two"],
            "load_case": [{"torque": {"one": _n(case.operation.torque, "N m")}, "speed": {"one": "100 rad/s"}}],
        },
    }
