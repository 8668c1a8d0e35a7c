"""Gearboxes whose planets are shafts of their own: tables of any set around a carrier, of rigid bodies on springs."""

import math

MESH = {"stiffness": "4e8 N/m"}
BEARING = {"radial": "3e8 N/m", "axial": "1e8 N/m", "tilt": "2e5 N m/rad"}


def rigid(name, axis=(0.0, 0.0), start=0.0):
    """A shaft that is one rigid body, its axis in m."""
    return {"name": name, "axis": [f"{1e3 * value:.12g} mm" for value in axis], "start": f"{1e3 * start:.12g} mm"}


def body(shaft, mass, inertia):
    return {"shaft": shaft, "mass": f"{mass!r} kg", "inertia": f"{inertia!r} kg m^2"}


def pair(name, shafts, teeth, module, carrier="carrier", internal=False, mesh=MESH, **more):
    """A pair of given sizes on the carrier."""
    sizes = {"teeth": list(teeth), "module": f"{1e3 * module!r} mm", "internal": internal} | more
    return {"name": name, "shafts": list(shafts), "carrier": carrier, "gears": sizes, "mesh": dict(mesh)}


def members(**masses):
    """Central shafts, their masses and bearings in the casing."""
    shafts = [rigid(name) for name in masses]
    bodies = [body(name, mass, inertia) for name, (mass, inertia) in masses.items()]
    bearings = [{"shaft": name, **BEARING} for name in masses]
    return {"shaft": shafts, "mass": bodies, "bearing": bearings}


def planet(tables, name, distance, angle, mass=0.5, inertia=4e-4, carrier="carrier"):
    """Add a planet on the carrier, at an angle [rad]."""
    tables["shaft"].append(rigid(name, (distance * math.cos(angle), distance * math.sin(angle))))
    tables["mass"].append(body(name, mass, inertia))
    tables["bearing"].append({"shaft": name, "outer_shaft": carrier, "name": f"pin of {name}", **BEARING})


def loaded(tables, torque, speed, output, fixed=(), motions="space"):
    """Give a gearbox its load: torque [N m] and speed [rpm] of the first shaft."""
    driven = tables["shaft"][0]["name"]
    case = {"name": "nominal", "torque": {driven: f"{torque!r} N m"}, "speed": {driven: f"{speed!r} rpm"}}
    operation = {"output": [output], "fixed": list(fixed), "load_case": [case]}
    return {"format": 1, "model": "gearbox", "title": "planets", "motions": motions, **tables, "operation": operation}


def simple_set(teeth=(27, 39, 105), module=2e-3, planets=3, torque=100.0, fixed="ring", motions="space", mesh=MESH):
    """Sun, planets and ring of simple planets, of pairs."""
    sun, middle, ring = teeth
    tables = members(sun=(1.0, 5e-4), carrier=(4.0, 2e-2), ring=(3.0, 4e-2)) | {"pair": []}
    distance = 0.5 * module * (sun + middle)
    for number in range(planets):
        angle = 2.0 * math.pi * number / planets
        planet(tables, f"p{number}", distance, angle)
        tables["pair"].append(pair(f"sun-{number}", ("sun", f"p{number}"), (sun, middle), module, mesh=mesh))
    for number in range(planets):
        shafts = (f"p{number}", "ring")
        tables["pair"].append(pair(f"{number}-ring", shafts, (middle, ring), module, internal=True, mesh=mesh))
    output = "carrier" if fixed == "ring" else "ring"
    return loaded(tables, torque, 1000.0, output, (fixed,), motions)


def known_set(teeth=(27, 39, 105), module=2e-3, planets=3, torque=100.0, fixed="ring", motions="space", mesh=MESH):
    """The same as a planetary stage."""
    tables = simple_set(teeth, module, planets, torque, fixed, motions, mesh)
    own = {"pair", "shaft", "mass", "bearing"}
    kept = {key: value for key, value in tables.items() if key not in own}
    central = ("sun", "carrier", "ring")
    kept |= {
        "shaft": [shaft for shaft in tables["shaft"] if shaft["name"] in central],
        "mass": [one for one in tables["mass"] if one["shaft"] in central],
        "bearing": [one for one in tables["bearing"] if one["shaft"] in central],
    }
    stage = {"name": "set", "sun": "sun", "carrier": "carrier", "ring": "ring", "sun_mesh": mesh, "ring_mesh": mesh}
    stage["gears"] = {"teeth": list(teeth), "planets": planets, "module": f"{1e3 * module!r} mm"}
    stage["planet"] = {"mass": "0.5 kg", "inertia": "4e-4 kg m^2", "bearing": BEARING}
    return kept | {"planetary": [stage]}
