"""Cases of other trains written as gearboxes, for the comparison of their modes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.system.rigid_bodies import RigidSet
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
