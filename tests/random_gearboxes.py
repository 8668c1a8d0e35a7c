"""Random valid gearboxes of one to four stages as tables, and their images: turned, shifted, mirrored, renamed.

Pairs are external or internal, spur or helical; of planetary sets the ring stands in the casing, or any member on
a shaft that is held. Shafts are stepped or conical, bearings of given stiffness or with rolling elements.
"""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from typing import Any

import numpy as np

from femgear.solvers.linear.modal import undamped_modes
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.model import bearing_motions
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.play import slack_bearings
from femgear.trains.reading import read_case

MEMBERS = ("sun", "carrier", "ring")
# all have a number of rolling elements divisible by it: a turn by 120 degrees leaves them as they are
SYMMETRY = 3
_APART = 0.16  # of the stages along z [m]
_BEYOND = 0.06  # of the shafts beyond their stages [m]
MODES = 30
"""Natural frequencies that are compared."""
IMAGES = ("turned", "shifted", "mirrored across", "mirrored along", "renamed", "in other units")
_OTHER_UNITS = {
    "m": ("um", 1e6),
    "mm": ("m", 1e-3),
    "um": ("mm", 1e-3),
    "N": ("kN", 1e-3),
    "N m": ("kN m", 1e-3),
    "N/m": ("N/mm", 1e-3),
    "N m/rad": ("kN m/rad", 1e-3),
    "rpm": ("rad/s", math.pi / 30.0),
    "deg": ("rad", math.pi / 180.0),
    "rad": ("deg", 180.0 / math.pi),
    "kg": ("g", 1e3),
    "kg m^2": ("g m^2", 1e3),
    "GPa": ("MPa", 1e3),
}


def metres(value: float) -> str:
    """Write a length with all digits."""
    return f"{float(value)!r} m"


def _value(text: str) -> float:
    return float(text.split()[0])


class _Draw:
    """Draws one gearbox, stage after stage along z."""

    def __init__(self, seed: int, stages: int):
        self.rng = np.random.default_rng([seed, 42])
        self.kinds = [bool(self.rng.random() < 0.45) for _ in range(int(self.rng.integers(1, stages + 1)))]
        self.sets = any(self.kinds)
        # bearings of one axial sense need thrust on every shaft
        self.thrust = bool(self.rng.random() < 0.5) and not self.sets
        # rolling bearings need loads that leave their clearances behind
        self.rolling = bool(self.rng.random() < 0.5)
        self.tables: dict[str, Any] = {"model": "gearbox", "title": f"random gearbox {seed}"}
        self.tables |= {name: [] for name in ("shaft", "bearing", "pair", "planetary", "load", "mass")}
        self.fixed: list[str] = []
        self.uneven = False
        self.low: dict[str, float] = {}

    def of(self, *choices):
        return choices[int(self.rng.integers(len(choices)))]

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def draw(self) -> dict[str, Any]:
        count = len(self.kinds)
        axis, shaft = np.array([self.between(-0.2, 0.2), self.between(-0.2, 0.2)]), "shaft 1"
        self.shaft(shaft, axis, -_BEYOND, _BEYOND)
        for number in range(count):
            z = _APART * number
            low, high = z - _BEYOND, z + _BEYOND + (_APART if number + 1 < count else 0.0)
            follower = f"shaft {number + 2}"
            if self.kinds[number]:
                self.set(f"stage {number + 1}", shaft, follower, axis, z, (low, high))
            else:
                axis = self.pair(f"stage {number + 1}", shaft, follower, axis, z, (low, high))
            shaft = follower
        self.ends("shaft 1", shaft)
        return self.tables

    def shaft(self, name: str, axis, low: float, high: float) -> None:
        """Add a shaft with its two bearings."""
        self.low[name] = low
        length, rest, parts = high - low, 1.0, []
        for number in range(steps := int(self.rng.integers(1, 4))):
            share = rest if number + 1 == steps else rest * self.between(0.3, 0.6)
            rest -= share
            part = {"length": metres(length * share), "outer_diameter": metres(self.between(0.04, 0.07))}
            if self.rng.random() < 0.4:
                part["end_outer_diameter"] = metres(self.between(0.04, 0.07))
            if self.rng.random() < 0.4:
                part["inner_diameter"] = metres(self.between(0.005, 0.02))
            parts.append(part)
        table: dict[str, Any] = {
            "name": name,
            "axis": [metres(axis[0]), metres(axis[1])],
            "start": metres(low),
            "part": parts,
        }
        self.tables["shaft"].append(table)
        places = self.between(0.008, 0.015), length - self.between(0.008, 0.015)
        for bearing, place in zip(self.bearings(), places, strict=True):
            seat = {"name": f"bearing {len(self.tables['bearing']) + 1}", "shaft": name, "position": metres(place)}
            self.tables["bearing"].append(seat | bearing)

    def bearings(self) -> tuple[dict, dict]:
        kind = self.of("ball", "tapered", "cylindrical") if self.rolling and self.rng.random() < 0.7 else "springs"
        if kind == "springs":
            first, second = ({"radial": f"{10.0 ** self.between(7.7, 9.0)!r} N/m"} for _ in range(2))
            if self.rng.random() < 0.3:
                second["tilt"] = f"{10.0 ** self.between(4.0, 5.0)!r} N m/rad"
            if self.thrust and self.rng.random() < 0.5:
                sense = {"axial": f"{10.0 ** self.between(7.7, 8.7)!r} N/m"}
                return first | sense | {"axial_sense": "positive"}, second | sense | {"axial_sense": "negative"}
            first["axial"] = self.of("rigid", f"{10.0 ** self.between(7.7, 8.7)!r} N/m")
            return first, second
        count = SYMMETRY * int(self.rng.integers(3, 5))
        sizes = {"rolling_elements": count, "pitch_diameter": "0.075 m"}
        ball: dict[str, Any] = {"kind": "ball", "element_diameter": "0.012 m", "clearance": metres(self.play())} | sizes
        roller: dict[str, Any] = {
            "clearance": metres(-3e-6),
            "element_diameter": "0.01 m",
            "effective_length": "0.012 m",
        } | sizes
        if kind == "ball":
            return ball, ball
        if kind == "cylindrical":
            return ball, roller | {"kind": "cylindrical"}
        preload = {"preload": metres(self.between(5e-6, 2e-5))}
        tapered = roller | {"kind": "tapered", "clearance": "0 m"} | preload
        return tapered | {"contact_angle": "15 deg"}, tapered | {"contact_angle": "-15 deg"}

    def play(self) -> float:
        """Clearance of a ball bearing [m]: none where planets may leave a shaft without a load across."""
        return -3e-6 if self.sets else self.of(-3e-6, 0.0, 5e-6)

    def mesh(self) -> dict[str, str]:
        return {"stiffness": f"{10.0 ** self.between(8.3, 9.0)!r} N/m"}

    def gears(self) -> dict[str, Any]:
        helix = self.of(-1.0, 1.0) * self.between(5.0, 25.0)
        helix = helix if self.thrust or self.rng.random() < 0.6 else 0.0
        gears = {"module": metres(self.of(0.002, 0.003)), "helix_angle": f"{helix!r} deg"}
        return gears | ({} if self.rng.random() < 0.2 else {"face_width": metres(self.between(0.015, 0.03))})

    def pair(self, name: str, first: str, second: str, axis, z: float, ends) -> np.ndarray:
        """Add a pair with its second shaft; the axis of that."""
        gears, internal = self.gears(), bool(self.rng.random() < 0.3)
        teeth = [int(self.rng.integers(17, 30)), int(self.rng.integers(45, 80))]
        pressure = math.radians(20.0)
        distance = 0.5 * _value(gears["module"]) * (teeth[1] + (-1 if internal else 1) * teeth[0])
        way = self.between(-math.pi, math.pi)
        if not internal and self.rng.random() < 0.4:
            teeth.reverse()
        axis = np.asarray(axis) + distance * np.array([math.cos(way), math.sin(way)])
        gears |= {"teeth": teeth, "internal": internal, "pressure_angle": f"{pressure!r} rad"}
        self.shaft(second, axis, *ends)
        positions = [metres(z - self.low[shaft]) for shaft in (first, second)]
        stage = {"name": name, "shafts": [first, second], "positions": positions, "gears": gears, "mesh": self.mesh()}
        self.tables["pair"].append(stage)
        return axis

    def set(self, name: str, first: str, second: str, axis, z: float, ends) -> None:
        """Add a planetary set with its second shaft and the shaft of the member that is held."""
        held = self.of(*MEMBERS)
        turning = [member for member in MEMBERS if member != held]
        self.rng.shuffle(turning)
        stage: dict[str, Any] = {"name": name, turning[0]: first, turning[1]: second}
        self.shaft(second, axis, *ends)
        if held == "ring" and self.rng.random() < 0.6:
            stage["ring"] = "casing"
        else:
            stage[held] = f"held {name}"
            self.shaft(stage[held], axis, z - _BEYOND, z + _BEYOND)
            self.fixed.append(stage[held])
        for member in MEMBERS:
            if stage[member] != "casing":
                stage[f"{member}_position"] = metres(z - self.low[stage[member]])
        planets = int(self.rng.integers(3, 6))
        sun, planet = planets * int(self.rng.integers(6, 9)), int(self.rng.integers(18, 22))
        planet += (sun + planet) % 2
        # z_s + z_r = 2 (z_s + z_p) by N, and planets that clear one another
        while (2 * (sun + planet)) % planets or (sun + planet) * math.sin(math.pi / planets) < planet + 3:
            planet, sun = (planet + 1, sun) if (2 * (sun + planet)) % planets else (planet, sun + planets)
        psi = [360.0 * n / planets for n in range(planets)]
        if self.rng.random() < 0.3:
            # one planet a tooth place of the set further on; weight across would put a torque on the carrier
            self.uneven = True
            psi[1] += 360.0 / (2 * (sun + planet))
        stage |= {
            "angle": f"{self.between(-1.0, 1.0)!r} rad",
            "gears": self.gears()
            | {"teeth": [sun, planet, sun + 2 * planet], "planets": planets}
            | {"planet_angles": [f"{value!r} deg" for value in psi]},
            "sun_mesh": self.mesh(),
            "ring_mesh": self.mesh(),
            "planet": {"mass": "0.4 kg", "inertia": "1e-4 kg m^2"},
        }
        if self.rng.random() < 0.6:
            stage["planet"]["bearing"] = {"radial": f"{10.0 ** self.between(8.0, 9.0)!r} N/m"}
        if self.rng.random() < 0.5:
            stage["pins"] = {"diameter": "0.018 m", "length": "0.02 m", "cheeks": self.of(1, 2)}
        self.tables["planetary"].append(stage)

    def ends(self, first: str, last: str) -> None:
        """Add loads, masses, weight and the load case."""
        torque = self.of(-1.0, 1.0) * 10.0 ** self.between(1.7, 2.5)
        slices = self.of(1, 1, 5, 15)
        case: dict[str, Any] = {
            "torque": {"motor": f"{torque!r} N m"},
            "speed": {first: f"{self.between(-3000, 3000)!r} rpm"},
        }
        end = _value(self.tables["shaft"][0]["start"])
        loads: list[dict[str, Any]] = [
            {"name": "motor", "shaft": first, "position": "0 m"},
            {"name": "brake", "shaft": last, "position": metres(0.5 * _BEYOND)},
        ]
        if self.rng.random() < 0.5:
            loads[1]["force"] = [f"{self.between(-500, 500)!r} N" for _ in range(3)]
            loads[0]["tilting_moment"] = [f"{self.between(-10, 10)!r} N m" for _ in range(2)]
        if self.rng.random() < 0.4:
            case["force"] = {"motor": [f"{self.between(-300, 300)!r} N" for _ in range(3)]}
        if self.rng.random() < 0.5:
            self.tables["mass"].append(
                {"name": "wheel", "shaft": first, "position": metres(-end), "mass": "5 kg", "inertia": "0.02 kg m^2"}
            )
        if self.rng.random() < 0.5:
            across = [0.0, 0.0, -1.0] if self.uneven else [0.6, 0.0, 0.8]
            way = self.of(across, across if self.uneven else [0.0, -1.0, 0.0], [0.0, 0.0, -1.0])
            self.tables["gravity"] = {"direction": way}
        self.tables["load"] = loads
        self.tables["deflection"] = {"slices": slices}
        self.tables["modes"] = {"speeds": 2}
        self.tables["operation"] = {"output": ["brake"], "fixed": self.fixed, "load_case": [case]}


def random_gearbox(seed: int, stages: int = 4) -> dict[str, Any]:
    """Draw the tables of a gearbox of at most so many stages; a third in a casing, a third with play."""
    tables = _Draw(seed, stages).draw()
    # of its own numbers: all else is the same with and without a casing
    rng = np.random.default_rng([seed, 43])
    if rng.random() < 1.0 / 3.0:
        tables["casing"] = random_casing(tables, rng)
    elif rng.random() < 0.5:
        return loosened(tables, np.random.default_rng([seed, 44]))
    return tables


def loosened(tables: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Give balls clearance, and springs along z one sense each, whatever presses shafts into their bearings."""
    new = copy.deepcopy(tables)
    if rng.random() < 0.5:
        # planets, and spur gears along z, leave shafts without load
        new.pop("gravity", None)
        for load in new["load"]:
            load.pop("force", None)
            load.pop("tilting_moment", None)
        new["operation"]["load_case"][0].pop("force", None)
    for shaft in new["shaft"]:
        first, second = (one for one in new["bearing"] if one["shaft"] == shaft["name"])
        if first.get("kind") == second.get("kind") == "ball":
            first["clearance"] = second["clearance"] = metres(float(rng.choice([0.0, 5e-6, 2e-5])))
        elif "kind" not in first and first.get("axial", "rigid") != "rigid" and rng.random() < 0.7:
            stiffness = {"axial": first["axial"]}
            first |= {"axial_sense": "positive"}
            second |= stiffness | {"axial_sense": "negative"}
    return new


def random_casing(tables: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Draw a casing on feet that are as stiff along x as along y, some of them rigid."""
    axes = np.array([[_value(text) for text in shaft["axis"]] for shaft in tables["shaft"]])
    ends = np.array([_value(shaft["start"]) for shaft in tables["shaft"]])
    low, high = np.append(axes.min(axis=0) - 0.1, ends.min()), np.append(axes.max(axis=0) + 0.1, ends.max() + 0.2)
    mass = rng.uniform(20.0, 80.0)
    # of eight points: an inertia that a body can have
    points = rng.uniform(-0.2, 0.2, (8, 3))
    points -= points.mean(axis=0)
    tensor = mass * (np.eye(3) * (points**2).sum() - points.T @ points) / 8.0
    casing = {"mass": f"{mass!r} kg", "centre": [metres(value) for value in rng.uniform(low, high)]}
    casing |= _inertia_texts(tensor)
    feet = []
    for number in range(int(rng.integers(3, 7))):
        across, along = (f"{10.0 ** rng.uniform(7.5, 9.0)!r} N/m" for _ in range(2))
        if rng.random() < 0.1:
            across = along = "rigid"
        place = rng.uniform(low, high)
        place[2] = (low[2], high[2])[number % 2]
        foot = {"position": [metres(value) for value in place], "stiffness": [across, across, along]}
        feet.append({"name": f"foot {number + 1}"} | foot)
    casing["foot"] = feet
    standing = [b["name"] for b in tables["bearing"] if "outer_shaft" not in b and rng.random() < 0.05]
    return casing | ({"stands_still": standing} if standing else {})


def _inertia_texts(tensor: np.ndarray) -> dict[str, list[str]]:
    products = -tensor[[0, 0, 1], [1, 2, 2]]
    return {
        name: [f"{float(value)!r} kg m^2" for value in values]
        for name, values in (("inertia", np.diag(tensor)), ("products", products))
    }


def _moved_casing(tables: dict[str, Any], matrix: np.ndarray, shift=(0.0, 0.0, 0.0)) -> None:
    """Map the casing by an orthogonal matrix (3, 3) that keeps z in its place or turns it round, then shift it [m]."""
    casing = tables.get("casing")
    if casing is None:
        return
    for holder, name in [(casing, "centre"), *((foot, "position") for foot in casing["foot"])]:
        holder[name] = [metres(x) for x in matrix @ [_value(text) for text in holder[name]] + np.asarray(shift)]
    tensor, products = np.diag([_value(text) for text in casing["inertia"]]), np.zeros((3, 3))
    products[[0, 0, 1], [1, 2, 2]] = [_value(text) for text in casing["products"]]
    casing |= _inertia_texts(matrix @ (tensor - products - products.T) @ matrix.T)


def _numbers(texts, factors) -> list[str]:
    return [
        f"{float(text.split()[0]) * factor!r} {text.split(maxsplit=1)[1]}"
        for text, factor in zip(texts, factors, strict=True)
    ]


def _vectors(tables: dict[str, Any], force, moment) -> None:
    """Map all forces, moments and the weight by functions of three texts or numbers."""
    for holder in (*tables["load"], *tables["operation"]["load_case"]):
        for name, change in (("force", force), ("tilting_moment", moment)):
            if isinstance(holder.get(name), dict):
                holder[name] = {port: change(value) for port, value in holder[name].items()}
            elif name in holder:
                holder[name] = change(holder[name])
    if "gravity" in tables:
        texts = force([f"{value!r} -" for value in tables["gravity"]["direction"]])
        tables["gravity"]["direction"] = [float(text.split()[0]) for text in texts]


def turned(tables: dict[str, Any], angle: float) -> dict[str, Any]:
    """Turn the whole gearbox about z by an angle [rad]."""
    new = copy.deepcopy(tables)
    cos, sin = math.cos(angle), math.sin(angle)

    def turn(texts):
        x, y = (float(text.split()[0]) for text in texts[:2])
        unit = texts[0].split(maxsplit=1)[1]
        return [f"{cos * x - sin * y!r} {unit}", f"{sin * x + cos * y!r} {unit}", *texts[2:]]

    for shaft in new["shaft"]:
        shaft["axis"] = turn(shaft["axis"])
    for stage in new["planetary"]:
        stage["angle"] = f"{_value(stage['angle']) + angle!r} rad"
    _vectors(new, turn, turn)
    _moved_casing(new, np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]))
    return new


def shifted(tables: dict[str, Any], way: tuple[float, float, float]) -> dict[str, Any]:
    """Shift the whole gearbox [m]."""
    new = copy.deepcopy(tables)
    for shaft in new["shaft"]:
        shaft["axis"] = [metres(_value(text) + step) for text, step in zip(shaft["axis"], way[:2], strict=True)]
        shaft["start"] = metres(_value(shaft["start"]) + way[2])
    _moved_casing(new, np.eye(3), way)
    return new


def mirrored_across(tables: dict[str, Any]) -> dict[str, Any]:
    """Mirror y: hands, torques and speeds change their signs, thrusts do not."""
    new = copy.deepcopy(tables)
    for shaft in new["shaft"]:
        shaft["axis"] = _numbers(shaft["axis"], (1.0, -1.0))
    for stage in (*new["pair"], *new["planetary"]):
        stage["gears"]["helix_angle"] = _numbers([stage["gears"]["helix_angle"]], [-1.0])[0]
    for stage in new["planetary"]:
        stage["angle"] = _numbers([stage["angle"]], [-1.0])[0]
        first, *others = (_value(text) for text in stage["gears"]["planet_angles"])
        stage["gears"]["planet_angles"] = [f"{value!r} deg" for value in (first, *(360.0 - v for v in others[::-1]))]
    for case in new["operation"]["load_case"]:
        for name in ("torque", "speed"):
            case[name] = {port: _numbers([text], [-1.0])[0] for port, text in case[name].items()}
    _vectors(new, lambda v: _numbers(v, (1.0, -1.0, 1.0)), lambda v: _numbers(v, (-1.0, 1.0)))
    _moved_casing(new, np.diag([1.0, -1.0, 1.0]))
    return new


def mirrored_along(tables: dict[str, Any]) -> dict[str, Any]:
    """Mirror z: hands, thrusts and contact angles change their signs, torques and speeds do not."""
    new = copy.deepcopy(tables)
    lengths = {s["name"]: sum(_value(part["length"]) for part in s["part"]) for s in new["shaft"]}
    for shaft in new["shaft"]:
        shaft["start"] = metres(-_value(shaft["start"]) - lengths[shaft["name"]])
        for part in shaft["part"]:
            if "end_outer_diameter" in part:
                part["outer_diameter"], part["end_outer_diameter"] = part["end_outer_diameter"], part["outer_diameter"]
        shaft["part"].reverse()

    def place(shaft: str, text: str) -> str:
        return metres(max(lengths[shaft] - _value(text), 0.0))

    for one in (*new["bearing"], *new["load"], *new["mass"]):
        one["position"] = place(one["shaft"], one["position"])
    for bearing in new["bearing"]:
        if "contact_angle" in bearing:
            bearing["contact_angle"] = _numbers([bearing["contact_angle"]], [-1.0])[0]
        if "axial_sense" in bearing:
            bearing["axial_sense"] = {"positive": "negative", "negative": "positive"}[bearing["axial_sense"]]
    for stage in (*new["pair"], *new["planetary"]):
        stage["gears"]["helix_angle"] = _numbers([stage["gears"]["helix_angle"]], [-1.0])[0]
    for stage in new["pair"]:
        stage["positions"] = [place(*both) for both in zip(stage["shafts"], stage["positions"], strict=True)]
    for stage in new["planetary"]:
        if "pins" in stage:
            # the other cheek sits on the shaft, which is the longer one or, of a carrier amid its shaft, the back one
            carrier, z = stage["carrier"], _value(stage.get("carrier_position", "0 m"))
            back = carrier == "casing" or lengths[carrier] - z >= z - 1e-9
            stage["carrier_body"] = {"torque_end": "front" if back else "back"}
        for member in MEMBERS:
            if f"{member}_position" in stage:
                stage[f"{member}_position"] = place(stage[member], stage[f"{member}_position"])
    _vectors(new, lambda v: _numbers(v, (1.0, 1.0, -1.0)), lambda v: _numbers(v, (-1.0, -1.0)))
    _moved_casing(new, np.diag([1.0, 1.0, -1.0]))
    return new


def renamed(tables: dict[str, Any], seed: int) -> dict[str, Any]:
    """Give all shafts other names, and list all parts in another order; bearings keep their names."""
    new, rng = copy.deepcopy(tables), np.random.default_rng(seed)
    names = {shaft["name"]: f"{chr(90 - n)}.{n}" for n, shaft in enumerate(new["shaft"])}
    for shaft in new["shaft"]:
        shaft["name"] = names[shaft["name"]]
    for one in (*new["bearing"], *new["load"], *new["mass"]):
        one["shaft"] = names[one["shaft"]]
    for stage in new["pair"]:
        stage["shafts"] = [names[name] for name in stage["shafts"]]
    for stage in new["planetary"]:
        stage |= {member: names.get(stage[member], "casing") for member in MEMBERS}
    operation = new["operation"]
    operation["fixed"] = [names[name] for name in operation["fixed"]]
    for case in operation["load_case"]:
        case["speed"] = {names[name]: value for name, value in case["speed"].items()}
    for kind in ("shaft", "bearing", "pair", "planetary", "load", "mass"):
        rng.shuffle(new[kind])
    return new


def in_other_units(tables: Any) -> Any:
    """The same gearbox with millimetres as metres, newtons as kilonewtons, degrees as radians, kilograms as grams."""
    if isinstance(tables, dict):
        return {key: in_other_units(value) for key, value in tables.items()}
    if isinstance(tables, list | tuple):
        return [in_other_units(value) for value in tables]
    if not isinstance(tables, str):
        return tables
    number, _, unit = tables.partition(" ")
    if unit not in _OTHER_UNITS:
        return tables
    other, factor = _OTHER_UNITS[unit]
    return f"{float(number) * factor!r} {other}"


def largest_load(found: Deflection) -> float:
    """Largest force of loads and meshes [N]: bearings of a set without other loads carry nothing."""
    return max(np.abs(found.model.load).max(), found.mesh_force.max())


def answer(found: Deflection) -> dict[str, np.ndarray]:
    """Magnitudes that hang on no direction, of bearings in the order of their names."""
    order = np.argsort(found.model.bearing_names)
    force, motion = found.bearing_force[order], bearing_motions(found.model, found.motion)[order]
    # where a shaft lies in play that nothing presses it into is open
    motion = np.where(slack_bearings(found)[order, :3].any(axis=1, keepdims=True), 0.0, motion)
    _, system, stiffness = linear_system(found)
    still = replace(system, gyroscopic=None, load=np.zeros(len(system.dofs)))
    frequency = undamped_modes(still, stiffness, damping_ratio=0.03, count=min(MODES, len(system.dofs))).frequency

    def sizes(vectors):
        return np.column_stack([np.hypot(vectors[:, 0], vectors[:, 1]), np.abs(vectors[:, 2])])

    tilts = np.hypot(force[:, 3], force[:, 4])
    feet = found.foot_force
    if found.model.casing is not None:
        # rigid feet that are more than needed share forces
        feet = feet[np.isfinite(found.model.casing.foot_stiffness[:, 0])]
    return {
        "foot force": sizes(feet),
        "force": sizes(force),
        "moment": tilts,
        "deflection": sizes(motion),
        "mesh force": np.sort(found.mesh_force),
        "frequency": np.sort(frequency),
    }


def image(tables, name: str, seed: int):
    """Put the gearbox down in another way."""
    rng = np.random.default_rng(seed)
    if name == "turned":
        rolling = any("kind" in bearing for bearing in tables["bearing"])
        return turned(tables, 2.0 * math.pi / SYMMETRY if rolling else float(rng.uniform(-2.0, 2.0)))
    if name == "shifted":
        return shifted(tables, tuple(rng.uniform(-1.0, 1.0, 3)))
    if name == "renamed":
        return renamed(tables, seed)
    if name == "in other units":
        return in_other_units(tables)
    return mirrored_across(tables) if name == "mirrored across" else mirrored_along(tables)


def unlike(tables, found: Deflection, name: str, seed: int) -> dict[str, float]:
    """How far the answers of a gearbox and of its image are apart, over their size."""
    wanted, met = answer(found), answer(solve_deflection(read_case(image(tables, name, seed))))
    force = largest_load(found)
    least = {"foot force": 1e-3 * force, "force": 1e-3 * force, "moment": 1e-4 * force, "deflection": 1e-12 * force}
    apart = {}
    for what, values in wanted.items():
        # a shaft that is held is held at its left end: its mirror image is another shaft
        if name == "mirrored along" and what == "frequency" and tables["operation"]["fixed"]:
            continue
        size = max(np.abs(values).max(initial=0.0), least.get(what, 0.0))
        apart[what] = float(np.abs(met[what] - values).max(initial=0.0) / size) if size else 0.0
    return apart
