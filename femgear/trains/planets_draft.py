"""Drafts of gearboxes with planets of any kind around a carrier: stepped, double, Ravigneaux and Wolfrom sets.

Every planet is a shaft with bearings on the carrier, every mesh a pair with teeth of its own. Gears have no profile
shift; all sizes beyond them follow from the face width.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from femgear.case.estimates import Estimate, cylinder, estimated_mesh_stiffness, usual_rim, usual_torque
from femgear.case.quantities import FREE, INERTIA, LENGTH, MASS, STIFFNESS, TORSION, to_si
from femgear.errors import CaseError, GeometryError
from femgear.gears.paired_planets import angle_between
from femgear.gears.planet_assembly import assembly_step, double_gears, ravigneaux_gears, stepped_gears
from femgear.gears.power_flow import pair_condition, power_flow
from femgear.gears.shaft_graph import StageGears

PLANET_KINDS = {
    "stepped": (24, 57, 27, 108),
    "double": (24, 18, 20, 84),
    "ravigneaux": (30, 36, 18, 18, 72),
    "wolfrom": (18, 27, 72, 26, 71),
}
"""Kinds of sets with the teeth of their gears.

Sun, both gears of the planets and ring; sun, inner and outer planets and ring; small and large sun, short and long
planets and ring; sun, first gear of the planets and its ring, second gear and its ring.
"""
_DENSITY, _MODULUS, _BACKLASH = 7850.0, 206e9, 0.04
_STEEL = {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}
_HARDENED = {"treatment": "case hardened steel", "hardness": 700, "estimated": True}
"""Usual material of gears, for safeties and lives."""
_BEARING, _FLANGE = 0.2, 2.0
"""Stiffness of a bearing, and of the flange of a ring, over that of a mesh."""
_LEVER = 3.0
"""Lever of the tilt stiffness of a flange over the face width."""
_MOST_PAIRS = 20
"""Pairs of a gearbox."""
_ROOM = 1.0 - 1e-9
"""Least gap between tips that do not mesh [modules]."""
_SHAFT, _CLEARANCE = 0.6, 0.25
"""Outer diameter of shafts over the root circle of their smallest gear; gap to tips that they pass [modules]."""


@dataclass(frozen=True)
class _Gear:
    """A gear of a draft.

    Parameters
    ----------
    body : str
        Central member, or planet of a branch.
    teeth : int
        Their number.
    plane : int
        Which of the planes along z it lies in.
    """

    body: str
    teeth: int
    plane: int


@dataclass(frozen=True)
class _Layout:
    """What a kind of set consists of; lengths in modules of its first plane.

    Parameters
    ----------
    gears : StageGears
        For the angles at which planets fit.
    central : tuple of str
        Names of suns and rings.
    planets : mapping of str to (float, float)
        Distance from the axis, and angle from the branch [rad], of every planet of a branch.
    meshes : tuple of (_Gear, _Gear, float)
        Both gears of every mesh of a branch, the second one internal where it is that of a ring, and the module.
    driven, output : str
        Members that have the torque of the motor, and that of the load.
    fixed : tuple of str
        Members that stand.
    """

    gears: StageGears
    central: tuple[str, ...]
    planets: Mapping[str, tuple[float, float]]
    meshes: tuple[tuple[_Gear, _Gear, float], ...]
    driven: str
    output: str
    fixed: tuple[str, ...]


def planets_case(
    kind: str,
    teeth: Sequence[int],
    *,
    module: float,
    width: float,
    planets: int | None,
    torque: str | None,
    speed: str,
    notes: dict[str, str],
) -> tuple[dict[str, Any], int, list[str]]:
    """Make the tables of a gearbox with planets, remarks on what is estimated in ``notes``.

    Parameters
    ----------
    kind : str
        Of `PLANET_KINDS`.
    teeth : sequence of int
        As there.
    module, width : float
        Of the first plane, and of all gears [m].
    planets : int, optional
        Branches, equally spaced; by default the first of 3, 4, 5 and 2 that fit with a module of room.
    torque, speed : str
        On the driven member; without a torque that of a usual load.

    Returns
    -------
    tables : dict
    planets : int
    faults : list of str
        What gears lack of a module of room beside one another.

    Raises
    ------
    CaseError, GeometryError
        Numbers of planets that no gearbox takes (E-RANGE), planets that do not fit (E-ASSEMBLY), tooth
        numbers that make no set (E-CENTRE-DISTANCE, E-TEETH).
    """
    layout = _LAYOUTS[kind](*teeth)
    planets = _usual_planets(layout) if planets is None else planets
    _check_fit(kind, teeth, layout, planets)
    stiffness = float(f"{_BEARING * estimated_mesh_stiffness(_MODULUS, _MODULUS, width):.3g}")
    build = _Tables(layout, module, width, stiffness, notes)
    for name in layout.central:
        build.central(name)
    build.carrier()
    for number in range(planets):
        build.branch(number, 2.0 * math.pi * number / planets)
    load = torque or f"{_usual_load(layout, module, width, planets):.3g} N m"
    loads = [{"name": "motor", "shaft": layout.driven, **build.end(layout.driven)}]
    loads += [{"name": "load", "shaft": layout.output, **build.end(layout.output)}]
    tables = {
        "format": 1,
        "model": "gearbox",
        "title": f"{kind.capitalize()} {'/'.join(map(str, teeth))}",
        "shaft": build.shafts,
        "mass": build.masses,
        "bearing": build.bearings,
        "pair": build.pairs,
        "load": loads,
        "operation": {
            "output": ["load"],
            "fixed": list(layout.fixed),
            "load_case": [{"name": "nominal", "torque": {"motor": load}, "speed": {layout.driven: speed}}],
        },
    }
    return tables, planets, _lacks_of_room(layout, planets, module)


class _Tables:
    """Collects the tables of a gearbox: central members, carrier, branches of planets."""

    def __init__(self, layout: _Layout, module: float, width: float, stiffness: float, notes: dict[str, str]):
        self.layout, self.module, self.width, self.stiffness, self.notes = layout, module, width, stiffness, notes
        self.behind = "small sun"  # sticks through the large one from the other side
        self.planes = sorted({gear.plane for mesh in layout.meshes for gear in mesh[:2]})
        self.shafts: list[dict[str, Any]] = []
        self.masses: list[dict[str, Any]] = []
        self.bearings: list[dict[str, Any]] = []
        self.pairs: list[dict[str, Any]] = []

    def height(self, plane: int) -> float:
        """Middle of a plane along z [m]."""
        return (0.75 + 1.5 * self.planes.index(plane)) * self.width

    @property
    def length(self) -> float:
        """From the front to the back of all planes [m]."""
        return 1.5 * len(self.planes) * self.width

    def gears_of(self, body: str) -> list[tuple[_Gear, float]]:
        """Gears of a body, each once, with their modules."""
        listed = {gear: scale for *mesh, scale in self.layout.meshes for gear in mesh if gear.body == body}
        return list(listed.items())

    def end(self, name: str) -> dict[str, str]:
        """Place of a load on a central member: the free end of a sun, the centre of a rigid body."""
        part = next(table for table in self.shafts if table["name"] == name).get("part")
        if not part:
            return {}
        return {"position": part[0]["length"] if name == self.behind else "0 mm"}

    def central(self, name: str) -> None:
        """Add a sun on its shaft, or a ring that is a rigid body, with their bearings in the casing."""
        (gear, scale), *_ = self.gears_of(name)
        middle = self.height(gear.plane)
        if "ring" in name:
            self.shafts.append({"name": name, "start": LENGTH.show(round(middle, 9))})
            self.notes[f"bearing[{len(self.bearings)}].tilt"] = f"estimated: the flange of {name}"
            self.bearing(name, None, f"flange of {name}", stiffness=_FLANGE / _BEARING * self.stiffness, tilt=True)
            inner = 0.5 * scale * self.module * gear.teeth
            if name not in self.layout.fixed:
                self.body(name, inner + 3.0 * self.module, inner + 6.0 * self.module, "a flange of three modules")
            return
        beyond, outer = 3.5 * self.width, _SHAFT * scale * self.module * (gear.teeth - 2.5)
        ends = (middle - 0.5 * self.width, self.length + beyond)
        start, end = ends if name == self.behind else (-beyond, middle + 0.5 * self.width)
        self.shaft(name, (0.0, 0.0), start, end - start, outer)
        for number in (0, 1):
            place = (0.5 + 2.0 * number) * self.width
            place = end - start - place if name == self.behind else place
            self.bearing(name, place, f"{name} {'AB'[number]}", axial=not number)

    def carrier(self) -> None:
        """Add the carrier, a rigid body on two bearings."""
        around = max(distance for distance, _ in self.layout.planets.values()) * self.module
        self.shafts.append({"name": "carrier", "start": LENGTH.show(round(0.5 * self.length, 9))})
        self.body("carrier", 0.5 * around, 1.3 * around, "two cheeks of a face width")
        for side, name in ((-1.0, "carrier A"), (1.0, "carrier B")):
            place = side * (0.5 * self.length + 1.0 * self.width)
            self.bearing("carrier", place, name, axial=side < 0.0)

    def branch(self, number: int, angle: float) -> None:
        """Add the planets of a branch at an angle [rad], and their pairs."""
        for name, (distance, beside) in self.layout.planets.items():
            radius, at = distance * self.module, angle + beside
            axis = radius * math.cos(at), radius * math.sin(at)
            root = min(scale * self.module * (gear.teeth - 2.5) for gear, scale in self.gears_of(name))
            shaft = f"{name} {number + 1}"
            outer, room = _SHAFT * root, 2.0 * self.module * (_beside_shaft(self.layout, name) - _CLEARANCE)
            narrow = f"{_CLEARANCE:g} modules beside the tips that it passes" if 0.0 < room < outer else ""
            self.shaft(shaft, axis, -0.5 * self.width, self.length + self.width, room if narrow else outer, narrow)
            for side, place in (("A", 0.25 * self.width), ("B", self.length + 0.75 * self.width)):
                where = LENGTH.show(round(place - 0.5 * self.width - 0.5 * self.length, 9))
                self.bearing(shaft, place, f"{shaft} {side}", axial=side == "A", outer_position=where)
        for first, second, scale in self.layout.meshes:
            shafts = [g.body if g.body in self.layout.central else f"{g.body} {number + 1}" for g in (first, second)]
            self.pair(shafts, (first, second), scale)

    def pair(self, shafts: list[str], gears: tuple[_Gear, _Gear], scale: float) -> None:
        """Add a mesh with the teeth of both gears."""
        module, internal = scale * self.module, "ring" in gears[1].body
        positions = [self.height(gear.plane) - self.start_of(shaft) for gear, shaft in zip(gears, shafts, strict=True)]
        teeth: dict[str, Any] = {
            "model": "pair",
            "title": "-".join(shafts),
            "set": {
                "module": LENGTH.show(module),
                "pressure_angle": "20 deg",
                "face_width": LENGTH.show(self.width),
                "backlash": LENGTH.show(round(_BACKLASH * module, 7)),
            },
        }
        for number, gear in enumerate(gears):
            inside = internal and number == 1
            rim, _ = usual_rim(gear.teeth, module, 1.25, 0.0, internal=inside)
            shaft = next(table for table in self.shafts if table["name"] == shafts[number])
            bore = LENGTH.show(rim) if inside else self.bore_of(shaft)
            key = "outer_radius" if inside else "bore_radius"
            teeth[f"gear_{number + 1}"] = {"teeth": gear.teeth, "profile_shift": 0.0, key: bore, "tip_diameter": FREE}
            self.notes[f"pair[{len(self.pairs)}].teeth.gear_{number + 1}.{key}"] = (
                "estimated: a usual rim" if inside else "estimated: solid down to its shaft"
            )
        teeth["material"] = _STEEL | _HARDENED
        teeth["operation"] = {"torque": "1 N m"}
        places = [LENGTH.show(round(place, 9)) for place in positions]
        table = {"name": teeth["title"], "shafts": shafts, "carrier": "carrier", "positions": places, "teeth": teeth}
        self.pairs.append(table)

    def start_of(self, shaft: str) -> float:
        """Coordinate from which positions on a shaft count [m]."""
        table = next(table for table in self.shafts if table["name"] == shaft)
        return to_si(table["start"], LENGTH)

    def bore_of(self, shaft: Mapping[str, Any]) -> str:
        """Radius of a shaft, the bore of its gears."""
        return LENGTH.show(round(0.5 * to_si(shaft["part"][0]["outer_diameter"], LENGTH), 9))

    def shaft(
        self, name: str, axis: tuple[float, float], start: float, length: float, diameter: float, how: str = ""
    ) -> None:
        """Add a cylindrical shaft."""
        how = how or f"{_SHAFT:g} of the root circle"
        self.notes[f"shaft[{len(self.shafts)}].part[0].outer_diameter"] = f"estimated: {how}"
        part = {"length": LENGTH.show(round(length, 9)), "outer_diameter": LENGTH.show(round(diameter, 4))}
        # axes stand at the centre distances of their teeth, to the picometre
        place = [f"{round(1e3 * value, 9):.13g} mm" for value in axis]
        self.shafts.append({"name": name, "axis": place, "start": LENGTH.show(round(start, 9)), "part": [part]})

    def body(self, shaft: str, inner: float, outer: float, how: str) -> None:
        """Add the mass of a rigid body."""
        values = cylinder(inner, outer, 2.0 * self.width, _DENSITY)
        table: dict[str, Any] = {"shaft": shaft}
        for name, value, dimension in zip(("mass", "inertia"), values, (MASS, INERTIA), strict=False):
            table[name] = str(Estimate(value, dimension, ""))
            self.notes[f"mass[{len(self.masses)}].{name}"] = f"estimated: {how}"
        self.masses.append(table)

    def bearing(
        self,
        shaft: str,
        place: float | None,
        name: str,
        *,
        stiffness: float | None = None,
        axial: bool = True,
        tilt: bool = False,
        outer_position: str | None = None,
    ) -> None:
        """Add a bearing by its estimated stiffness, of a planet with its position on the carrier."""
        radial = stiffness or self.stiffness
        table: dict[str, Any] = {"name": name, "shaft": shaft}
        if outer_position is not None:
            table |= {"outer_shaft": "carrier", "outer_position": outer_position}
        if place is not None:
            table["position"] = LENGTH.show(round(place, 9))
        table["radial"] = STIFFNESS.show(radial)
        if axial:
            table["axial"] = STIFFNESS.show(radial)
        if tilt:
            table["tilt"] = TORSION.show(float(f"{radial * (_LEVER * self.width) ** 2:.3g}"))
        share = radial / self.stiffness * _BEARING
        self.notes[f"bearing[{len(self.bearings)}].radial"] = f"estimated: {share:g} of a mesh of this width"
        self.bearings.append(table | {"estimated": True})


def _assemble(layout: _Layout, planets: int) -> bool:
    """Whether so many equally spaced branches assemble."""
    return (1 / assembly_step(layout.gears) / planets).denominator == 1


def _fitting(layout: _Layout) -> list[int]:
    """Numbers of branches that assemble, have a module of room and are no more than a gearbox takes."""
    numbers = range(1, _MOST_PAIRS // len(layout.meshes) + 1)
    return [n for n in numbers if _assemble(layout, n) and _room(layout, n)[0] >= _ROOM]


def _usual_planets(layout: _Layout) -> int:
    """Number of branches where none is given: the first usual one that fits, else that assembles."""
    usual, fitting = (3, 4, 5, 2), _fitting(layout)
    return next((n for n in usual if n in fitting), next((n for n in usual if _assemble(layout, n)), usual[0]))


def _check_fit(kind: str, teeth: Sequence[int], layout: _Layout, planets: int) -> None:
    """Refuse numbers of planets that a gearbox does not take, or that do not assemble with equal spacing."""
    most, fitting = _MOST_PAIRS // len(layout.meshes), _fitting(layout)
    listed = ", ".join(map(str, fitting))
    if not 1 <= planets <= most:
        text = f"a {kind} case has 1 to {most} planets around its carrier: a gearbox has {_MOST_PAIRS} pairs at most"
        limit = listed or f"1 to {most}"
        raise CaseError(text, code="E-RANGE", key="--planets", value=planets, limit=limit)
    if _assemble(layout, planets):
        return
    near = [" ".join(map(str, teeth)) for teeth in _near_teeth(kind, teeth, planets)]
    remedies = [f"with these teeth --planets {' or '.join(map(str, fitting))}"] if fitting else []
    remedies += [f"with {planets} planets --teeth {' or '.join(near)}"] if near else []
    places = 1 / assembly_step(layout.gears)
    raise CaseError(
        f"{planets} planets cannot be equally spaced: there are {places} places around the axis",
        code="E-ASSEMBLY",
        key="--planets",
        value=planets,
        limit=listed or "none with these teeth",
        remedy="; ".join(remedies) or f"other teeth: femgear teeth --kind {kind} finds sets",
    )


def _near_teeth(kind: str, teeth: Sequence[int], planets: int) -> list[tuple[int, ...]]:
    """Up to two sets of teeth that differ least from others, by two each at most, and fit with so many planets."""
    near = list[tuple[int, ...]]()
    steps = sorted(product(range(-2, 3), repeat=len(teeth)), key=lambda step: (sum(map(abs, step)), step))
    for step in steps:
        changed = tuple(z + more for z, more in zip(teeth, step, strict=True))
        try:
            layout = _LAYOUTS[kind](*changed)
            fits = _assemble(layout, planets) and _room(layout, planets)[0] >= _ROOM
        except (CaseError, GeometryError):
            continue
        if fits and min(changed) >= min(17, *teeth):
            near.append(changed)
        if len(near) == 2:
            break
    return near


def _room(layout: _Layout, planets: int) -> tuple[float, str, str]:
    """Smallest gap between tips that do not mesh [modules], and both gears; the first branch speaks for all."""
    mates = {frozenset((first.body, second.body)) for first, second, _ in layout.meshes}
    scales = {gear: scale for *mesh, scale in layout.meshes for gear in mesh}
    smallest = math.inf, "", ""
    for (gear, scale), (other, other_scale) in product(scales.items(), repeat=2):
        if gear.plane != other.plane or gear.body in layout.central:
            continue
        radius, angle = layout.planets[gear.body]
        tip, other_tip = scale * (0.5 * gear.teeth + 1.0), other_scale * (0.5 * other.teeth + 1.0)
        mesh = frozenset((gear.body, other.body)) in mates
        if other.body not in layout.central:
            far, beside = layout.planets[other.body]
            turns = range(1 if mesh or gear == other else 0, planets)
            gaps = [
                math.dist(_place(radius, angle), _place(far, beside + math.tau * n / planets)) - tip - other_tip
                for n in turns
            ]
        elif mesh:
            continue
        elif "ring" in other.body:
            gaps = [other_tip - 2.0 * other_scale - radius - tip]
        else:
            gaps = [radius - tip - other_tip]
        smallest = min(smallest, (min(gaps, default=math.inf), gear.body, other.body))
    return smallest


def _beside_shaft(layout: _Layout, name: str) -> float:
    """Smallest distance from the axis of a planet to tips of gears that it does not mesh with [modules].

    Gears of suns and of the other planets of its branch: its shaft passes them in their planes.
    """
    mates = {frozenset((first.body, second.body)) for first, second, _ in layout.meshes}
    radius, angle = layout.planets[name]
    distances = [math.inf]
    for *mesh, scale in layout.meshes:
        for gear in mesh:
            if gear.body == name or frozenset((gear.body, name)) in mates or "ring" in gear.body:
                continue
            far, beside = layout.planets.get(gear.body, (0.0, 0.0))
            axes = math.dist(_place(radius, angle), _place(far, beside))
            distances.append(axes - scale * (0.5 * gear.teeth + 1.0))
    return min(distances)


def _place(radius: float, angle: float) -> tuple[float, float]:
    return radius * math.cos(angle), radius * math.sin(angle)


def _lacks_of_room(layout: _Layout, planets: int, module: float) -> list[str]:
    """Tell gears that penetrate each other, or have less than a module of room."""
    gap, *names = _room(layout, planets)
    if gap >= _ROOM:
        return []
    first, second = (name if name in layout.central else f"{name}s" for name in names)
    size = LENGTH.show(round(abs(gap) * module, 7))
    both = f"{first} and {second}" if first != second else f"neighbouring {first}"
    text = f"overlap by {size}" if gap < 0.0 else f"have {size} of room, less than a module"
    fitting = " or ".join(map(str, _fitting(layout)))
    remedy = f"--planets {fitting}, or other teeth" if fitting else "other teeth"
    return [f"The tips of {both} {text}: {remedy}."]


def _usual_load(layout: _Layout, module: float, width: float, planets: int) -> float:
    """Torque of the driven member [N m] that loads the most loaded mesh as usual, without losses."""
    meshes = {f"{first.body}-{second.body}": (first, second, scale) for first, second, scale in layout.meshes}
    conditions = [
        pair_condition(name, a.body, b.body, a.teeth, b.teeth, internal="ring" in b.body, carrier="carrier")
        for name, (a, b, _) in meshes.items()
    ]
    flow = power_flow(
        [*layout.central, *layout.planets, "carrier"],
        conditions,
        speeds={layout.driven: 1.0},
        torques={layout.driven: 1.0},
        held=layout.fixed,
        outputs=(layout.output,),
    )
    usual = {
        name: usual_torque(a.teeth, b.teeth * (-1 if "ring" in b.body else 1), scale * module, width, planets)
        / abs(flow.stage_torque[name][a.body])
        for name, (a, b, scale) in meshes.items()
    }
    return min(usual.values())


def _beside(first: float, second: float, between: float, key: str) -> float:
    """Angle [rad] at which two planets on these radii are so far apart."""
    angle = angle_between(first, second, between)
    if angle is None:
        raise CaseError(
            "both planets of a branch do not reach each other",
            code="E-CENTRE-DISTANCE",
            key="--teeth",
            value=key,
            limit=f"axes {abs(first - second):g} to {first + second:g} modules apart, these teeth {between:g}",
            remedy="other teeth of the planets",
        )
    return angle


def _stepped(sun: int, first: int, second: int, ring: int) -> _Layout:
    a = 0.5 * (sun + first)
    scale = _scale(2.0 * a, ring - second)
    meshes = (
        (_Gear("sun", sun, 0), _Gear("planet", first, 0), 1.0),
        (_Gear("planet", second, 1), _Gear("ring", ring, 1), scale),
    )
    gears = stepped_gears(sun, first, second, ring)
    return _Layout(gears, ("sun", "ring"), {"planet": (a, 0.0)}, meshes, "sun", "carrier", ("ring",))


def _wolfrom(sun: int, first: int, first_ring: int, second: int, second_ring: int) -> _Layout:
    if first_ring * second == second_ring * first:
        raise CaseError(
            "both rings turn alike: the second one stands with the first, its ratio is infinite",
            code="E-TEETH",
            key="--teeth",
            value=f"{first_ring}/{first} and {second_ring}/{second}",
            limit="different ratios of both rings to their planet gears",
            remedy="other teeth",
        )
    a = 0.5 * (sun + first)
    meshes = (
        (_Gear("sun", sun, 0), _Gear("planet", first, 0), 1.0),
        (_Gear("planet", first, 0), _Gear("first ring", first_ring, 0), _scale(2.0 * a, first_ring - first, only=1.0)),
        (_Gear("planet", second, 1), _Gear("second ring", second_ring, 1), _scale(2.0 * a, second_ring - second)),
    )
    gears = stepped_gears(sun, first, second, second_ring, first_ring=first_ring)
    central = ("sun", "first ring", "second ring")
    return _Layout(gears, central, {"planet": (a, 0.0)}, meshes, "sun", "second ring", ("first ring",))


def _double(sun: int, inner: int, outer: int, ring: int) -> _Layout:
    near, far = 0.5 * (sun + inner), 0.5 * (ring - outer)
    beside = _beside(near, far, 0.5 * (inner + outer), f"{sun}/{inner}/{outer}/{ring}")
    meshes = (
        (_Gear("sun", sun, 0), _Gear("inner planet", inner, 0), 1.0),
        (_Gear("inner planet", inner, 0), _Gear("outer planet", outer, 0), 1.0),
        (_Gear("outer planet", outer, 0), _Gear("ring", ring, 0), 1.0),
    )
    places = {"inner planet": (near, 0.0), "outer planet": (far, beside)}
    gears = double_gears(sun, inner, outer, ring)
    return _Layout(gears, ("sun", "ring"), places, meshes, "sun", "carrier", ("ring",))


def _ravigneaux(small: int, large: int, short: int, long: int, ring: int) -> _Layout:
    far, near = 0.5 * (large + long), 0.5 * (small + short)
    _scale(2.0 * far, ring - long, only=1.0)
    beside = _beside(near, far, 0.5 * (short + long), f"{small}/{large}/{short}/{long}/{ring}")
    meshes = (
        (_Gear("small sun", small, 1), _Gear("short planet", short, 1), 1.0),
        (_Gear("short planet", short, 1), _Gear("long planet", long, 1), 1.0),
        (_Gear("large sun", large, 0), _Gear("long planet", long, 0), 1.0),
        (_Gear("long planet", long, 1), _Gear("ring", ring, 1), 1.0),
    )
    places = {"short planet": (near, 0.0), "long planet": (far, beside)}
    gears = ravigneaux_gears(small, large, short, long, ring)
    central = ("small sun", "large sun", "ring")
    return _Layout(gears, central, places, meshes, "small sun", "ring", ("large sun",))


def _scale(total: float, difference: int, *, only: float | None = None) -> float:
    """Module of a ring and its planets over that of the sun on one centre distance."""
    scale = total / difference if difference > 0 else math.inf
    if not 0.4 <= scale <= 2.5 or (only is not None and abs(scale - only) > 1e-12):
        wanted = f"{total:g}" if only is not None else f"{total / 2.5:g} to {total / 0.4:g}"
        raise CaseError(
            "ring and sun do not mesh with planets at one centre distance",
            code="E-CENTRE-DISTANCE",
            key="--teeth",
            value=f"z_ring - z_planet = {difference}",
            limit=wanted,
            remedy="teeth of sun and planet add up to those of the ring less those of its planet",
        )
    return scale


_LAYOUTS = {"stepped": _stepped, "double": _double, "ravigneaux": _ravigneaux, "wolfrom": _wolfrom}
