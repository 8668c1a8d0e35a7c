"""Sets of any planets: tables of gearboxes of rigid bodies, their springs by hand, places by trial of all teeth."""

import itertools
import math
import random
from fractions import Fraction

import numpy as np
from casings import casing_tables

from femgear.gears.planet_assembly import double_gears, ravigneaux_gears, simple_gears, stepped_gears
from femgear.gears.power_flow import pair_condition
from femgear.gears.shaft_graph import INTERNAL, SpeedCondition, StageGears
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.response import solve_gearbox_response
from femgear.trains.reading import read_case

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


STEPPED = (24, 57, 27, 108)


def stepped_set(motions="plane", stiffness=(4e8, 4e8, 4e8, 3e8, 3e8, 3e8), teeth=STEPPED, turns=(0.0, 1 / 3, 2 / 3)):
    """Stepped planets on three pins, every mesh with its own stiffness."""
    sun, first, second, ring = teeth
    tables = members(sun=(1.0, 5e-4), carrier=(4.0, 2e-2), ring=(3.0, 4e-2)) | {"pair": []}
    for n, turn in enumerate(turns):
        planet(tables, f"p{n}", 1e-3 * (sun + first), 2.0 * math.pi * turn)
    for n in range(3):
        mesh = {"stiffness": f"{stiffness[n]!r} N/m"}
        tables["pair"].append(pair(f"sun-{n}", ("sun", f"p{n}"), (sun, first), 2e-3, mesh=mesh))
    for n in range(3):
        mesh = {"stiffness": f"{stiffness[3 + n]!r} N/m"}
        tables["pair"].append(pair(f"{n}-ring", (f"p{n}", "ring"), (second, ring), 2e-3, internal=True, mesh=mesh))
    return loaded(tables, 100.0, 1000.0, "carrier", ("ring",), motions)


def held(tables, **radial):
    """Bearings rigid across their axes, but for those of these shafts."""
    for bearing in tables["bearing"]:
        bearing["radial"] = radial.get(bearing["shaft"], "rigid")
    return tables


def planet_shaft(tables, number):
    """Tables of the shaft of a planet."""
    return next(shaft for shaft in tables["shaft"] if shaft["name"] == f"p{number}")


def stepped_forces(opened, torque=100.0, sun_mesh=4e8, ring_mesh=3e8):
    """Forces (3,) of the sun meshes of stepped planets between members that turn alone.

    ``opened`` (3,) are the errors on the line of action of the sun: those of the sun mesh, and by the lever of the
    planet those of the ring mesh. A branch has the compliance 1/k_s + lever^2/k_r.
    """
    lever, base = STEPPED[1] / STEPPED[2], 1e-3 * STEPPED[0] * math.cos(math.radians(20.0))
    stiffness = 1.0 / (1.0 / sun_mesh + lever**2 / ring_mesh)
    opened = np.asarray(opened)
    return abs(torque) / (3.0 * base) + stiffness * (opened.mean() - opened)


def uneven_planets():
    """Simple planets, the first of which has a bearing of its own: they stand where they are."""
    tables = simple_set()
    tables["bearing"].append({"name": "more", "shaft": "p0", "outer_shaft": "carrier", "radial": "1e5 N/m"})
    return tables


def springs_by_hand(stiffness):
    """Mass and stiffness of the same set from its lines of action: sun, carrier, ring, planets, each x, y and turn.

    And the approaches (6, 18) of its meshes.
    """
    alpha, a = math.radians(20.0), 81e-3
    base = [1e-3 * z * math.cos(alpha) for z in STEPPED]
    rows, k = [], np.zeros((18, 18))
    for n in range(3):
        psi = 2.0 * math.pi * n / 3.0
        out, along = np.array([math.cos(psi), math.sin(psi)]), np.array([-math.sin(psi), math.cos(psi)])
        p = 9 + 3 * n
        row = np.zeros(18)
        push = math.cos(alpha) * along + math.sin(alpha) * out
        row[0:2], row[2], row[p : p + 2], row[p + 2] = push, base[0], -push, base[1]
        rows.append(row)
        for way in np.eye(2):  # the pin moves with the carrier
            pin = np.zeros(18)
            pin[p : p + 2], pin[3:5], pin[5] = way, -way, -a * along @ way
            k += 3e8 * np.outer(pin, pin)
    for n in range(3):
        psi = 2.0 * math.pi * n / 3.0
        out, along = np.array([math.cos(psi), math.sin(psi)]), np.array([-math.sin(psi), math.cos(psi)])
        p = 9 + 3 * n
        row = np.zeros(18)
        push = -math.cos(alpha) * along + math.sin(alpha) * out
        row[p : p + 2], row[p + 2], row[6:8], row[8] = push, -base[2], -push, base[3]
        rows.append(row)
    for row, value in zip(rows, stiffness, strict=True):
        k += value * np.outer(row, row)
    k[[0, 1, 3, 4, 6, 7], [0, 1, 3, 4, 6, 7]] += 3e8
    mass = [1.0, 1.0, 5e-4, 4.0, 4.0, 2e-2, 3.0, 3.0, 4e-2] + [0.5, 0.5, 4e-4] * 3
    return np.diag(mass), k, np.array(rows)


def random_set(draw: random.Random, kind: str) -> StageGears:
    """Gears of a kind of set with teeth that need not run: fits and ratios are matters of numbers alone."""
    small, large = draw.randint(5, 19), draw.randint(20, 41)
    first, second, other = draw.randint(5, 19), draw.randint(5, 19), draw.randint(42, 59)
    return {
        "simple": lambda: simple_gears(small, first, large),
        "stepped": lambda: stepped_gears(small, first, second, large),
        "double": lambda: double_gears(small, first, second, large),
        "Ravigneaux": lambda: ravigneaux_gears(small, first, second, 7, large),
        "two rings": lambda: stepped_gears(small, first, second, large, first_ring=other),
    }[kind]()


SET_KINDS = ("simple", "stepped", "double", "Ravigneaux", "two rings")


def pair_conditions(gears: StageGears) -> tuple[list[str], list[SpeedCondition]]:
    """Shafts of a set, its planets by their bodies among them, and one pair on the carrier for every mesh."""
    body = {second: first for first, second in gears.bodies}
    shafts = list(dict.fromkeys([*gears.shafts, *(body.get(gear, gear) for mesh in gears.meshes for gear in mesh[:2])]))
    conditions = []
    for a, b, sense in gears.meshes:
        between = body.get(a, a), body.get(b, b)
        sizes = gears.teeth[a], gears.teeth[b]
        inside = sense == INTERNAL
        conditions.append(pair_condition(f"{a}-{b}", *between, *sizes, internal=inside, carrier="carrier"))
    return shafts, conditions


def free_speeds(gears: StageGears, given: dict[str, Fraction]) -> dict[str, Fraction]:
    """Speeds of all gears and the carrier from those given, every gear by the teeth that pass in its meshes."""
    speed = dict(given)
    twins = dict(gears.bodies) | {b: a for a, b in gears.bodies}
    while len(speed) < len(gears.teeth) + 1:
        before = len(speed)
        for first, second, sense in gears.meshes:
            for known, new in ((first, second), (second, first)):
                if known in speed and new not in speed:
                    passed = (speed[known] - speed["carrier"]) * gears.teeth[known]
                    speed[new] = speed["carrier"] + sense * passed / gears.teeth[new]
        speed |= {twins[gear]: value for gear, value in list(speed.items()) if gear in twins}
        assert len(speed) > before
    return speed


def places_by_trial(gears: StageGears) -> np.ndarray:
    """All places of a branch in one turn [turns], found by rolling it around the sun after every insertion of teeth.

    A branch whose bodies are put in at every tooth one after the other is rolled around the first central gear until
    the last mesh is in order, and kept if all others are.
    """
    teeth, meshes = gears.teeth, gears.meshes
    together = dict(gears.bodies) | {b: a for a, b in gears.bodies}
    free = sorted({g for mesh in meshes for g in mesh[:2]} - {*gears.shafts})
    bodies = [g for g in free if g not in together or g < together[g]]
    found = []
    for inserted in itertools.product(*(range(teeth[body]) for body in bodies)):
        # turn of every gear as offset + slope * place, seen from the branch: central gears turn back
        turn = {g: (0.0, -1.0) for g in gears.shafts}
        waiting, checks = list(meshes), []
        while waiting:
            mesh = next(m for m in waiting if m[0] in turn or m[1] in turn)
            waiting.remove(mesh)
            first, second, sense = mesh
            if first in turn and second in turn:
                checks.append(mesh)
                continue
            known, new = (first, second) if first in turn else (second, first)
            offset, slope = (sense * teeth[known] / teeth[new] * value for value in turn[known])
            teeth_in = inserted[bodies.index(new if new in bodies else together[new])]
            turn[new] = offset + teeth_in / teeth[new], slope
            if new in together:
                turn[together[new]] = turn[new]
        rows = [
            [teeth[a] * x - sense * teeth[b] * y for x, y in zip(turn[a], turn[b], strict=True)]
            for a, b, sense in checks
        ]
        offset, slope = rows[-1]
        low, high = sorted((offset, offset + slope))
        at = (np.arange(math.ceil(low - 1e-9), high + 1e-9) - offset) / slope
        for offset, slope in rows[:-1]:
            at = at[np.abs(offset + slope * at - np.rint(offset + slope * at)) < 1e-7]
        found.append(at)
    places = np.sort(np.concatenate(found))
    places = places[(places > -1e-9) & (places < 1.0 - 1e-7)]
    return places[np.diff(places, prepend=-1.0) > 1e-7]


COUNTED = {"stiffness": "4e8 N/m", "contact_ratio": 1.63, "low_share": 0.7}
SENSORS = [
    {"name": "top", "position": ["0 mm", "0.2 m", "0 mm"], "direction": "y"},
    {"name": "side", "position": ["-0.1 m", "0 mm", "50 mm"], "direction": "x"},
]


def in_casing(tables, harmonics=4, bands=4):
    """A gearbox in a casing on uneven feet, which makes side bands of planets that run around."""
    solver = {"mesh_harmonics": harmonics, "side_bands": bands, "tolerance": 1e-12}
    return tables | {"casing": casing_tables(), "sensor": SENSORS, "dynamics": solver}


def responded(tables):
    """Response at 70 rad/s of the shaft whose speed counts."""
    return solve_gearbox_response(solve_deflection(read_case(tables)), [70.0])


def lines_of(response, rows):
    """Orders and amplitudes of all lines of some outputs, those of one order together."""
    order = np.concatenate([stage.order for stage in response.stages])
    values = np.concatenate([stage.motion[0, rows] for stage in response.stages], axis=1)
    known = np.round(order, 7)
    every = np.unique(known)
    return every, np.stack([values[:, known == number].sum(axis=1) for number in every], axis=1)


def lines_apart(own, known):
    """Largest difference of lines, where either has some, over the largest one of each output.

    Of forces, all but two outputs, smaller ones than a millionth of the largest count as that.
    """
    sizes = [dict(zip(order.tolist(), amplitude.T, strict=True)) for order, amplitude in (own, known)]
    nothing, largest = np.zeros(len(known[1])), np.abs(known[1]).max(axis=1)
    largest = np.maximum(largest, 1e-6 * np.abs(known[1][2:]).max() * (np.arange(len(largest)) > 1))
    numbers = {*sizes[0], *sizes[1]}
    return max(np.abs((sizes[0].get(n, nothing) - sizes[1].get(n, nothing)) / largest).max() for n in numbers)


def outer_lines(make, *, fixed, torque, motions="plane", planets=3):
    """Lines of sensors on the casing, of central bearings and of feet, of `simple_set` or `known_set`."""
    teeth = (28, 40, 108) if planets == 4 else (28, 38, 104)
    tables = make(teeth=teeth, fixed="ring", planets=planets, mesh=COUNTED, torque=torque, motions=motions)
    tables["operation"] |= {"fixed": [fixed], "output": ["carrier" if fixed != "carrier" else "ring"]}
    if fixed == "sun":
        tables["operation"]["load_case"][0] |= {"torque": {"ring": f"{torque} N m"}, "speed": {"ring": "1000 rpm"}}
    response = responded(in_casing(tables))
    names = response.deflection.model.bearing_names
    central = [number for number, name in enumerate(names) if not name.startswith("pin")]
    first, feet = 2 + 3 * len(names), 3 * len(response.deflection.model.casing.feet)
    rows = [0, 1, *(2 + 3 * number + way for number in central for way in range(3)), *range(first, first + feet)]
    return lines_of(response, rows)


BENDING = (11, 16, 8, 35)
"""Sun, both gears of a planet, ring: 70 meshes of the sun and 35 of the ring in a turn of the carrier."""
MODULE, LENGTH = 2e-3, 40e-3
"""Transverse module, and length of a planet between its gears [m]."""
CENTRAL = {
    "sun": ("2 kg", "2e-3 kg m^2", "1e8 N/m"),
    "carrier": ("8 kg", "3e-2 kg m^2", "5e8 N/m"),
    "ring": ("4 kg", "2e-2 kg m^2", "6e8 N/m"),
}
"""Mass, inertia and radial stiffness."""


def bending_set(angle: float, *, back: bool):
    """Tables of stepped planets, each a shaft of two stations with a helical gear and a bearing on the carrier at both.

    In a casing on uneven feet; the first planet stands at an angle [rad].
    """
    tables = {"shaft": [], "mass": [], "bearing": [], "pair": []}
    for name, (mass, inertia, radial) in CENTRAL.items():
        held = {"radial": radial, "axial": "2e8 N/m", "tilt": "1e6 N m/rad", "torsional": "2e5 N m/rad"}
        tables["shaft"].append({"name": name})
        tables["mass"].append({"shaft": name, "mass": mass, "inertia": inertia, "transverse_inertia": inertia})
        tables["bearing"].append({"shaft": name, **held})
    distance, ends = 0.5e3 * MODULE * (BENDING[0] + BENDING[1]), (0.0, 1e3 * LENGTH)
    for number in range(3):
        name, psi = f"p{number}", angle + 2.0 * math.pi * number / 3.0
        shaft = {"name": name, "start": f"{-0.5 * ends[1]!r} mm", "longest_element": "1 m"}
        shaft["axis"] = [f"{distance * math.cos(psi)!r} mm", f"{distance * math.sin(psi)!r} mm"]
        shaft["part"] = [{"length": f"{ends[1]!r} mm", "outer_diameter": "10 mm"}]
        tables["shaft"].append(shaft)
        for end, radial in zip(ends, ("2e8 N/m", "1.5e8 N/m"), strict=True):
            inertia = {"inertia": "5e-5 kg m^2", "transverse_inertia": "6e-5 kg m^2"}
            tables["mass"].append({"shaft": name, "position": f"{end!r} mm", "mass": "0.3 kg", **inertia})
            seat = {
                "position": f"{end!r} mm",
                "outer_shaft": "carrier",
                "outer_position": f"{end - 0.5 * ends[1]!r} mm",
            }
            held = {"radial": radial, "axial": "5e7 N/m", "tilt": "3e4 N m/rad"}
            tables["bearing"].append({"name": f"pin {number} at {end:g}", "shaft": name, **seat, **held})
    places = {"sun": -0.5 * ends[1], "ring": 0.5 * ends[1]}
    for mate, teeth, end in (("sun", BENDING[:2], ends[0]), ("ring", BENDING[2:], ends[1])):
        for number in range(3):
            shafts = ("sun", f"p{number}") if mate == "sun" else (f"p{number}", "ring")
            positions = [f"{places[name] if name in places else end!r} mm" for name in shafts]
            mesh = {"stiffness": "3e8 N/m", "contact_ratio": 1.6, "low_share": 0.7}
            sizes = pair(f"{mate} {number}", shafts, teeth, MODULE, internal=mate == "ring", mesh=mesh)
            sizes["gears"] |= {"face_width": "20 mm", "helix_angle": "15 deg"}
            tables["pair"].append(sizes | {"positions": positions})
    speed = -12000.0 if back else 12000.0
    return loaded(tables, 100.0, speed, "carrier", ("ring",)) | {
        "deflection": {"slices": 1},
        "casing": casing_tables(),
    }


def parting_set(make, *, fixed="ring", torque=4.0, motions="plane"):
    """Loaded state of `simple_set` or `known_set` in a casing, near a resonance at which its teeth part."""
    mesh = COUNTED | {"backlash": "20 um", "low_share": 0.5}
    tables = make(teeth=(28, 38, 104), mesh=mesh, motions=motions, torque=torque)
    tables["operation"] |= {"fixed": [fixed], "output": ["carrier" if fixed != "carrier" else "ring"]}
    tables["operation"]["load_case"][0]["speed"] = {"sun": "6000 rpm"}
    tables |= {"balance": {"harmonics": 4, "side_bands": 1}, "modes": {"damping_ratio": 0.006}}
    return solve_deflection(read_case(in_casing(tables)))
