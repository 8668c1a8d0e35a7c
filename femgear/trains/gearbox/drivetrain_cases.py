"""Files with ``model = "drivetrain"``, chains of bodies, shafts and gear stages, read as gearbox cases.

That was a train of its own until its cases became gearboxes. Every body is a rigid shaft of its name, every shaft a
coupling of springs, or a shaft of beams that is rigidly joined to its bodies; nothing moves along the axes. Speeds are
those of the teeth: the former train took them from the radii.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool

from femgear.case import text as case_text
from femgear.case.csv_columns import embedded
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import (
    ACCELERATION,
    ANGLE,
    DENSITY,
    INERTIA,
    LENGTH,
    MASS,
    MODULUS,
    PAIR,
    STIFFNESS,
    TORSION,
    Count,
    Number,
    Quantity,
    Section,
    StiffnessOrRigid,
    Title,
    Values,
)
from femgear.case.sections import FORMAT, Angle, DampingRatio, PressureAngle, Speed, Teeth
from femgear.errors import CaseError, FemgearError, several
from femgear.fe import beam
from femgear.findings import Finding
from femgear.gears.planetary import equal_planet_angles
from femgear.trains.gearbox.case_file import GearboxCase, Name, StageTables, stage_case_of, stage_tables
from femgear.trains.gearbox.power import BoxFlow, gearbox_flow
from femgear.trains.gearbox.transient_case import (
    TorqueOverTimeSection,
    TransientSection,
    embed_torques,
    torque_histories,
    torque_problems,
)

_MOST_PARTS = 200
_REMARK = 1e-4
"""Ratios of radii and teeth that differ by more are worth a remark."""
_Mass = Annotated[float, Quantity(MASS, 1e-6, 1e8)]
_Inertia = Annotated[float, Quantity(INERTIA, 1e-12, 1e11)]
_Transverse = Annotated[float, Quantity(INERTIA, 0.0, 1e11)]
_Radius = Annotated[float, Quantity(LENGTH, 1e-4, 100.0)]
_Offset = Annotated[float, Quantity(LENGTH, -100.0, 100.0)]
_Module = Annotated[float, Quantity(LENGTH, 5e-5, 0.5)]
_Joint = Annotated[float, StiffnessOrRigid(TORSION, 1e-3, 1e15)]
_WAYS = {
    "parallel": ((("radii",), ("base_radii",), ("module",)), "radii, base_radii or module"),
    "planetary": (
        (("sun_radius", "planet_radius"), ("sun_base_radius", "planet_base_radius"), ("module",)),
        "sun_radius and planet_radius, sun_base_radius and planet_base_radius, or module",
    ),
}
"""Entries that give the sizes of the gears of a stage, each way whole, and the same in words."""


class _BodySection(Section):
    name: Name
    inertia: _Inertia
    mass: _Mass
    transverse_inertia: _Transverse = 0.0
    tilts: StrictBool = True


class _ShaftSection(Section):
    between: Annotated[tuple[Name, ...], PAIR]
    length: Annotated[float, Quantity(LENGTH, 1e-4, 1e3)]
    bending: _Joint | None = None
    torsion: _Joint | None = None
    shear: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)] | None = None
    shear_ratio: Annotated[float, Number(0.0, 100.0)] = 0.0
    outer_diameter: Annotated[float, Quantity(LENGTH, 1e-4, 20.0)] | None = None
    inner_diameter: Annotated[float, Quantity(LENGTH, 0.0, 20.0)] = 0.0
    youngs_modulus: Annotated[float, Quantity(MODULUS, 1e6, 1e12)] = 2.06e11
    poisson_ratio: Annotated[float, Number(0.0, 0.5, open_high=True)] = 0.3
    density: Annotated[float, Quantity(DENSITY, 0.0, 25000.0)] = 7850.0
    elements: Annotated[int, Count(0, 100)] = 0

    @property
    def name(self) -> str:
        """Of the shaft of beams."""
        return f"shaft {'-'.join(self.between)}"[:40].rstrip()

    @property
    def springs(self) -> beam.JointSprings:
        """Springs of the joint [N m/rad], [N/m]."""
        if self.bending is None or self.torsion is None:
            section = beam.RoundSection(
                self.outer_diameter or 0.0, self.inner_diameter, self.youngs_modulus, self.poisson_ratio, self.density
            )
            return beam.joint_springs(section, self.length)
        shear = self.shear
        if shear is None:
            shear = 12.0 * self.bending / ((1.0 + self.shear_ratio) * self.length**2)
        return beam.JointSprings(self.bending, self.torsion, shear)


class _MeshSection(Section):
    stiffness: Annotated[float, Quantity(STIFFNESS, 1e3, 1e13)]
    contact_ratio: Annotated[float, Number(1.0, 20.0)]
    low_share: Annotated[float, Number(0.0, 1.0, open_low=True)] | None = None
    phase: Annotated[float, Number(-1000.0, 1000.0)] = 0.0
    backlash: Annotated[float, Quantity(LENGTH, 0.0, 0.05)] | None = None


class _ParallelSection(Section):
    between: Annotated[tuple[Name, ...], PAIR]
    teeth: Annotated[tuple[Teeth, ...], PAIR]
    radii: Annotated[tuple[_Radius, ...], PAIR] | None = None
    base_radii: Annotated[tuple[_Radius, ...], PAIR] | None = None
    module: _Module | None = None
    mesh: _MeshSection | None = None
    stiffness: StageTables | None = None
    pressure_angle: PressureAngle = math.radians(20.0)
    helix_angle: Annotated[float, Quantity(ANGLE, -math.radians(60), math.radians(60))] = 0.0
    direction: Angle = 0.0
    offsets: Annotated[tuple[_Offset, ...], PAIR] = (0.0, 0.0)
    driver: Title | None = None

    @property
    def name(self) -> str:
        """Both bodies, as in "pinion-wheel"."""
        return "-".join(self.between)[:40].rstrip()

    @property
    def pitch_radii(self) -> tuple[float, ...]:
        """Pitch radii of both gears [m]."""
        if self.module is not None:
            return tuple(0.5 * self.module * teeth for teeth in self.teeth)
        return self.radii or tuple(radius / math.cos(self.pressure_angle) for radius in self.base_radii or ())

    @property
    def axis_distance(self) -> float:
        """Distance of the axes [m]: of the pair that gives the stiffness, or the sum of the pitch radii."""
        if self.stiffness is not None:
            with suppress(FemgearError):  # refused where the gearbox is checked
                gears: Any = planetary_set(stage_case_of(case_text.write(self.stiffness)))
                return gears.centre_distance
        return sum(self.pitch_radii)


class _PlanetarySection(Section):
    carrier: Name
    sun: Name
    ring_teeth: Teeth
    sun_teeth: Teeth
    planet_teeth: Teeth | None = None
    sun_radius: _Radius | None = None
    planet_radius: _Radius | None = None
    sun_base_radius: _Radius | None = None
    planet_base_radius: _Radius | None = None
    module: _Module | None = None
    centre_distance: _Radius | None = None
    planets: Annotated[int, Count(1, 24)] = 3
    planet_angles: Annotated[tuple[Angle, ...], Values(min_length=1, max_length=24)] | None = None
    planet_mass: _Mass
    planet_inertia: _Inertia
    planet_transverse_inertia: _Transverse = 0.0
    planet_bearing: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)] = math.inf
    sun_mesh: _MeshSection
    ring_mesh: _MeshSection
    pressure_angle: PressureAngle = math.radians(20.0)
    driver: Title | None = None

    @property
    def name(self) -> str:
        """Carrier and sun, as in "carrier-sun"."""
        return f"{self.carrier}-{self.sun}"[:40].rstrip()

    @property
    def angles(self) -> tuple[float, ...]:
        """Of the planets (N,) [rad]."""
        return self.planet_angles or equal_planet_angles(self.planets)

    @property
    def whole_planet_teeth(self) -> int:
        """Teeth of a planet: as given, or half of the difference of ring and sun."""
        return self.planet_teeth or round(0.5 * (self.ring_teeth - self.sun_teeth))

    @property
    def base_radii(self) -> tuple[float, float, float]:
        """Base radii of sun, planet and ring [m]: ``m z cos(alpha)/2`` of a module (ISO 21771).

        With all tooth numbers given they have these ratios; radii then give the sum of sun and planet.
        """
        cosine = math.cos(self.pressure_angle)
        if self.module is not None:
            half = 0.5 * self.module * cosine
            planet = self.planet_teeth or 0.5 * (self.ring_teeth - self.sun_teeth)
            return self.sun_teeth * half, planet * half, self.ring_teeth * half
        sun, planet = self.sun_base_radius or 0.0, self.planet_base_radius or 0.0
        if self.sun_radius is not None and self.planet_radius is not None:
            sun, planet = self.sun_radius * cosine, self.planet_radius * cosine
        if self.planet_teeth is None:
            # the radii alone say how large the ring is
            return sun, planet, sun + 2.0 * planet
        tooth = (sun + planet) / (self.sun_teeth + self.planet_teeth)
        return self.sun_teeth * tooth, self.planet_teeth * tooth, self.ring_teeth * tooth

    @property
    def axis_distance(self) -> float:
        """Distance of the planets' axes from that of the sun [m].

        As given, the sum of pitch radii that are given, or ``(r_bs + r_br)/(2 cos(alpha))``: exact without profile
        shift, else half-way between the distances at which either mesh has the pressure angle.
        """
        if self.centre_distance is not None:
            return self.centre_distance
        if self.sun_radius is not None and self.planet_radius is not None:
            return self.sun_radius + self.planet_radius
        sun, _, ring = self.base_radii
        return 0.5 * (sun + ring) / math.cos(self.pressure_angle)


class _BearingSection(Section):
    body: Name | None = None
    shaft: Annotated[tuple[Name, ...], PAIR] | None = None
    station: Annotated[int, Count(1, 99)] | None = None
    radial: Annotated[float, StiffnessOrRigid(STIFFNESS, 0.0, 1e15)] = 0.0
    tilt: Annotated[float, StiffnessOrRigid(TORSION, 0.0, 1e15)] = 0.0
    offset: _Offset = 0.0


class _TorqueSection(TorqueOverTimeSection):
    body: Name


class _GravitySection(Section):
    acceleration: Annotated[float, Quantity(ACCELERATION, 0.0, 1e3)] = 9.80665


class _OperationSection(Section):
    speed: Speed
    torque: Annotated[tuple[_TorqueSection, ...], Field(max_length=_MOST_PARTS)] = ()


class _SimulationSection(TransientSection):
    damping_ratio: DampingRatio = 0.0
    modes: Annotated[int, Count(0, 24)] = 4


class DrivetrainFile(Section):
    """A chain of bodies, its operation and how to integrate it, as the files of the former train have them."""

    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    model: Literal["drivetrain"]
    title: Title
    body: Annotated[tuple[_BodySection, ...], Field(min_length=1, max_length=_MOST_PARTS)]
    shaft: Annotated[tuple[_ShaftSection, ...], Field(max_length=_MOST_PARTS)] = ()
    parallel: Annotated[tuple[_ParallelSection, ...], Field(max_length=_MOST_PARTS)] = ()
    planetary: Annotated[tuple[_PlanetarySection, ...], Field(max_length=20)] = ()
    bearing: Annotated[tuple[_BearingSection, ...], Field(max_length=_MOST_PARTS)] = ()
    gravity: _GravitySection | None = None
    operation: _OperationSection
    simulation: _SimulationSection


def embed_drivetrain(data: dict, name: str) -> dict[str, str]:
    """Put torques, and the tables of pairs that give stages their stiffness, in the place of their files."""
    files, stages = embed_torques(data, name, "operation.torque"), data.get("parallel")
    for i, table in enumerate(stages if isinstance(stages, list) else ()):
        if isinstance(table, dict) and isinstance(table.get("stiffness"), str):
            key, file = f"parallel[{i}].stiffness", table.pop("stiffness")
            table["stiffness"] = embedded(file, name, key, stage_tables)
            files[key] = case_text.printable(file)
    return files


def gearbox_of_drivetrain(file: DrivetrainFile) -> tuple[dict[str, Any], tuple[Finding, ...]]:
    """Make the tables of the gearbox that a file describes, and the findings on what it has not.

    CaseError: bodies that nothing joins, sizes of gears given in no way or in several, torques likewise.
    """
    problems = [*_unknown_bodies(file), *_wrong_sizes(file), *_wrong_springs(file)]
    problems += torque_problems(file.operation.torque, "operation.torque")
    places = {} if problems else _places(file)
    apart = [(i, body.name) for i, body in enumerate(file.body) if not problems and body.name not in places]
    if apart:
        i, name = apart[0]
        problems.append(
            CaseError(
                f"nothing joins {', '.join(name for _, name in apart)} to {file.body[0].name}",
                code="E-DRIVETRAIN",
                key=f"body[{i}].name",
                value=name,
                remedy="add a [[shaft]], a [[parallel]] or a [[planetary]]",
            )
        )
    if problems:
        raise several(problems)
    tables: dict[str, Any] = {"model": "gearbox", "title": file.title}
    tables |= {"shaft": [], "mass": [], "bearing": [], "coupling": []}
    _add_bodies(tables, file, places)
    _add_shafts(tables, file, places)
    tables |= {
        "pair": [_pair(stage) for stage in file.parallel],
        "planetary": [_set(planetary) for planetary in file.planetary],
    }
    _number([*tables["planetary"], *tables["pair"]])
    if file.gravity is not None:
        tables["gravity"] = {"acceleration": _text(file.gravity.acceleration, "m/s^2")}
    s = file.simulation
    tables["modes"] = {"up_to": "1 MHz", "damping_ratio": s.damping_ratio}
    tables["dynamics"] = {"mesh_harmonics": s.harmonics}
    tables["operation"] = _operation(file, {body.name: 0.0 for body in file.body})
    flow = _flow(tables)
    if flow is not None:
        tables["operation"] = _operation(file, flow.speed)
        flow = _flow(tables) or flow
        _add_senses(tables, file, flow)
    tables["transient"] = _transient(file, tables["operation"]["output"][0])
    return {key: entry for key, entry in tables.items() if entry != []}, tuple(_without_effect(file))


def _number(stages: Sequence[dict[str, Any]]) -> None:
    """Number stages whose names come again: ``a-b``, ``a-b 2``."""
    names = set[str]()
    for stage in stages:
        name, count = stage["name"], 1
        while stage["name"] in names:
            count += 1
            stage["name"] = f"{name} {count}"
        names.add(stage["name"])


def _text(value: float, unit: str) -> str:
    return "rigid" if math.isinf(value) else f"{value!r} {unit}"


def _unknown_bodies(file: DrivetrainFile) -> Iterator[CaseError]:
    names = [body.name for body in file.body]
    for i, name in enumerate(names):
        if name in names[:i]:
            remedy = "give every body a name of its own"
            yield CaseError(
                "two bodies have one name", code="E-DUPLICATE", key=f"body[{i}].name", value=name, remedy=remedy
            )
    used = [(f"shaft[{i}].between", name) for i, shaft in enumerate(file.shaft) for name in shaft.between]
    used += [(f"parallel[{i}].between", name) for i, stage in enumerate(file.parallel) for name in stage.between]
    for i, stage in enumerate(file.planetary):
        used += [(f"planetary[{i}].carrier", stage.carrier), (f"planetary[{i}].sun", stage.sun)]
    used += [(f"bearing[{i}].body", bearing.body) for i, bearing in enumerate(file.bearing) if bearing.body is not None]
    used += [(f"operation.torque[{i}].body", torque.body) for i, torque in enumerate(file.operation.torque)]
    for key, name in used:
        if name not in names:
            limit = ", ".join(names[:20])
            yield CaseError("there is no such body", code="E-CHOICE", key=key, value=name, limit=limit)
    shafts = {shaft.between: shaft.elements for shaft in file.shaft}
    for i, bearing in enumerate(file.bearing):
        inside = (bearing.shaft is not None, bearing.station is not None)
        if inside != (bearing.body is None,) * 2:
            yield CaseError(
                "a bearing sits on one body, or on one station inside a shaft",
                code="E-CHOICE",
                key=f"bearing[{i}].{'body' if bearing.body else 'shaft'}",
                limit="body, or shaft with station",
            )
        elif bearing.shaft and bearing.station and not bearing.station < shafts.get(bearing.shaft, 0):
            yield CaseError(
                "there is no such station",
                code="E-CHOICE",
                key=f"bearing[{i}].station",
                value=bearing.station,
                limit="1 to one less than the elements of a [[shaft]] with this between",
            )


def _wrong_springs(file: DrivetrainFile) -> Iterator[CaseError]:
    for i, shaft in enumerate(file.shaft):
        springs = shaft.given("bending", "torsion", "shear")
        whole = {"bending", "torsion"} <= {*springs} and not shaft.elements
        if not whole if shaft.outer_diameter is None else bool(springs):
            yield CaseError(
                "the shaft has neither a section nor both springs, or both",
                code="E-CHOICE",
                key=f"shaft[{i}].{springs[0] if springs else 'outer_diameter'}",
                limit="bending and torsion, or outer_diameter with what else the section needs",
            )


def _wrong_sizes(file: DrivetrainFile) -> Iterator[CaseError]:
    """Sizes of gears in one way; meshes or teeth of parallel stages; planets with whole numbers of teeth."""
    for kind in _WAYS:
        ways, words = _WAYS[kind]
        for i, stage in enumerate(getattr(file, kind)):
            given = tuple(name for way in ways for name in stage.given(*way))
            if given not in ways:
                key = f"{kind}[{i}].{given[0] if given else ways[0][0]}"
                yield CaseError("the sizes of the gears are needed once", code="E-CHOICE", key=key, limit=words)
    for i, stage in enumerate(file.parallel):
        if (stage.mesh is None) == (stage.stiffness is None):
            key = f"parallel[{i}].{'mesh' if stage.mesh is None else 'stiffness'}"
            limit = "mesh, or stiffness with the case file of a pair"
            yield CaseError("the stiffness of the mesh is needed once", code="E-CHOICE", key=key, limit=limit)
    for i, stage in enumerate(file.planetary):
        between = 0.5 * (stage.ring_teeth - stage.sun_teeth)
        if stage.planet_teeth is None and stage.module is not None and between % 1.0:
            yield CaseError(
                f"no planet has {between:g} teeth",
                code="E-KEY-MISSING",
                key=f"planetary[{i}].planet_teeth",
                limit=f"a whole number near {between:g}",
                remedy=f"give planet_teeth (say {math.floor(between)}), and centre_distance of the shifted gears",
            )


def _places(file: DrivetrainFile) -> dict[str, tuple[float, float, float]]:
    """Places of all bodies that are joined to the first one [m]."""
    ways = [(*shaft.between, (0.0, 0.0, shaft.length)) for shaft in file.shaft]
    for stage in file.parallel:
        distance, (first, second) = stage.axis_distance, stage.offsets
        way = distance * math.cos(stage.direction), distance * math.sin(stage.direction), first - second
        ways.append((*stage.between, way))
    ways += [(stage.carrier, stage.sun, (0.0, 0.0, 0.0)) for stage in file.planetary]
    places = {file.body[0].name: (0.0, 0.0, 0.0)}
    for _ in file.body:
        for first, second, way in ways:
            if first in places:
                x, y, z = places[first]
                places.setdefault(second, (x + way[0], y + way[1], z + way[2]))
            elif second in places:
                x, y, z = places[second]
                places[first] = x - way[0], y - way[1], z - way[2]
    return places


def _add_bodies(tables: dict[str, Any], file: DrivetrainFile, places: Mapping[str, tuple[float, ...]]) -> None:
    """Add rigid shafts with their masses and bearings; nothing moves along z."""
    for body in file.body:
        x, y, z = places[body.name]
        axis = [_text(x, "m"), _text(y, "m")]
        tables["shaft"].append({"name": body.name, "axis": axis, "start": _text(z, "m")})
        inertias = {"inertia": body.inertia, "transverse_inertia": body.transverse_inertia}
        texts = {name: _text(value, "kg m^2") for name, value in inertias.items()}
        tables["mass"].append({"shaft": body.name, "mass": _text(body.mass, "kg"), **texts})
        tables["bearing"].append({"shaft": body.name, "axial": "rigid"} | ({} if body.tilts else {"tilt": "rigid"}))
    for bearing in file.bearing:
        seat: dict[str, Any] = {"shaft": bearing.body}
        if bearing.offset:
            seat["position"] = _text(bearing.offset, "m")
        if bearing.body is None:
            shaft = next(shaft for shaft in file.shaft if shaft.between == bearing.shaft)
            position = shaft.length * (bearing.station or 0) / shaft.elements + bearing.offset
            seat = {"shaft": shaft.name, "position": _text(position, "m")}
        springs = {"radial": _text(bearing.radial, "N/m"), "tilt": _text(bearing.tilt, "N m/rad")}
        tables["bearing"].append(seat | {name: springs[name] for name in springs if getattr(bearing, name)})


def _add_shafts(tables: dict[str, Any], file: DrivetrainFile, places: Mapping[str, tuple[float, ...]]) -> None:
    """Add shafts: couplings by springs, or beams rigidly joined to both bodies."""
    for shaft in file.shaft:
        if not shaft.elements:
            springs = shaft.springs
            stiffness = {"torsion": springs.torsion, "bending": springs.bending}
            texts = {name: _text(value, "N m/rad") for name, value in stiffness.items()}
            tables["coupling"].append({"between": list(shaft.between), **texts, "radial": _text(springs.shear, "N/m")})
            continue
        x, y, z = places[shaft.between[0]]
        element = {name: _text(getattr(shaft, name), "m") for name in ("outer_diameter", "inner_diameter")}
        element["length"] = _text(shaft.length / shaft.elements, "m")
        material = {"youngs_modulus": shaft.youngs_modulus, "density": shaft.density}
        texts = {name: _text(value, unit) for (name, value), unit in zip(material.items(), ("Pa", "kg/m^3"))}
        tables["shaft"].append(
            {
                "name": shaft.name,
                "axis": [_text(x, "m"), _text(y, "m")],
                "start": _text(z, "m"),
                "part": [element] * shaft.elements,
                "longest_element": _text(shaft.length / shaft.elements, "m"),
                "material": texts | {"poisson_ratio": shaft.poisson_ratio},
            }
        )
        stiff = dict.fromkeys(("torsion", "bending", "radial", "axial"), "rigid")
        for body, position in zip(shaft.between, (0.0, shaft.length), strict=True):
            positions = ["0 m", _text(position, "m")]
            tables["coupling"].append({"between": [body, shaft.name], "positions": positions, **stiff})
        for number in range(1, shaft.elements):
            position = _text(shaft.length * number / shaft.elements, "m")
            tables["bearing"].append({"shaft": shaft.name, "position": position, "axial": "rigid"})


def _mesh(mesh: _MeshSection, helix: float = 0.0) -> dict[str, Any]:
    """Entries of a mesh with its base helix angle [rad], but for its phase."""
    entries: dict[str, Any] = {"stiffness": _text(mesh.stiffness, "N/m"), "contact_ratio": mesh.contact_ratio}
    if mesh.low_share is not None:
        entries["low_share"] = mesh.low_share
    # it was along the normal
    return entries | ({} if mesh.backlash is None else {"backlash": _text(mesh.backlash / math.cos(helix), "m")})


def _pair(stage: _ParallelSection) -> dict[str, Any]:
    entries: dict[str, Any] = {"name": stage.name, "shafts": list(stage.between)}
    if any(stage.offsets):
        entries["positions"] = [_text(offset, "m") for offset in stage.offsets]
    if stage.mesh is None:
        return entries | {"teeth": stage.stiffness}
    gears = {
        "teeth": list(stage.teeth),
        "radii": [_text(radius, "m") for radius in stage.pitch_radii],
        "pressure_angle": _text(stage.pressure_angle, "rad"),
    }
    helix = math.atan(math.tan(stage.helix_angle) * math.cos(stage.pressure_angle))
    return entries | {"gears": gears, "mesh": _mesh(stage.mesh, helix)}


def _set(stage: _PlanetarySection) -> dict[str, Any]:
    planet = {"mass": (stage.planet_mass, "kg"), "inertia": (stage.planet_inertia, "kg m^2")}
    planet |= {"transverse_inertia": (stage.planet_transverse_inertia, "kg m^2")}
    angles = [_text(angle, "rad") for angle in stage.angles]
    return {
        "name": stage.name,
        "sun": stage.sun,
        "carrier": stage.carrier,
        "angle": angles[0],
        "gears": {
            "teeth": [stage.sun_teeth, stage.whole_planet_teeth, stage.ring_teeth],
            "planets": len(angles),
            "planet_angles": angles,
            "base_radii": [_text(radius, "m") for radius in stage.base_radii],
            "centre_distance": _text(stage.axis_distance, "m"),
        },
        "planet": {name: _text(*value) for name, value in planet.items()}
        | {"bearing": {"radial": _text(stage.planet_bearing, "N/m")}},
        "sun_mesh": _mesh(stage.sun_mesh),
        "ring_mesh": _mesh(stage.ring_mesh),
    }


def _operation(file: DrivetrainFile, speed: Mapping[str, float]) -> dict[str, Any]:
    """Load case of the mean torques; one of them, or the heaviest other body, balances the rest."""
    given, first = [(torque.body, torque) for torque in file.operation.torque], file.body[0].name
    ratio = {name: value / file.operation.speed or 1.0 for name, value in speed.items()}
    shares = [name for name, given_torque in given if given_torque.share is not None]
    others = [body for body in file.body if body.name not in [name for name, _ in given]]
    heaviest = max(others, key=lambda body: body.inertia * ratio[body.name] ** 2, default=None)
    output = shares[0] if shares else given[-1][0] if len(given) > 1 or heaviest is None else heaviest.name
    means = {
        history.body: history.mean(file.simulation.duration)
        for history in torque_histories([pair for pair in given if pair[1].share is None], ratio)
    }
    torques = {name: _text(mean, "N m") for name, mean in means.items() if name != output}
    load_case = {"torque": torques, "speed": {first: _text(file.operation.speed, "rad/s")}}
    return {"output": [output], "load_case": [load_case]}


def _flow(tables: Mapping[str, Any]) -> BoxFlow | None:
    """Power flow of the tables; None where they are refused later."""
    try:
        return gearbox_flow(GearboxCase.model_validate({key: entry for key, entry in tables.items() if entry != []}))
    except (FemgearError, ValueError):
        return None


def _add_senses(tables: dict[str, Any], file: DrivetrainFile, flow: BoxFlow) -> None:
    """Add helix angles and phases of the meshes: the former ones are shares of the period by which waves are ahead."""
    case = GearboxCase.model_validate({key: entry for key, entry in tables.items() if entry != []})
    for i, stage in enumerate(file.parallel):
        if stage.mesh is not None:
            sense = math.copysign(1.0, flow.speed[stage.between[0]])
            # a positive one pushed the second gear along z, however the first one turned
            tables["pair"][i]["gears"]["helix_angle"] = _text(-sense * stage.helix_angle, "rad")
            tables["pair"][i]["mesh"]["phase"] = _phase(stage.mesh, sense, _flank(flow, case.pair[i]), 0.0)
    for i, stage in enumerate(file.planetary):
        sense, flank = math.copysign(1.0, flow.speed[stage.carrier]), _flank(flow, case.planetary[i])
        half = 0.5 * (stage.whole_planet_teeth - 1)
        for name, beyond in (("sun_mesh", 0.0), ("ring_mesh", half)):
            tables["planetary"][i][name]["phase"] = _phase(getattr(stage, name), sense, flank, beyond)


def _flank(flow: BoxFlow, stage: Any) -> int:
    return -1 if flow.first_torque(stage) > 0.0 else 1


def _phase(mesh: _MeshSection, sense: float, flank: int, beyond: float) -> float:
    # most pairs touch at phase zero; the middle of a path is half a period off where the whole number is odd
    phase = flank * (sense * (mesh.phase + 0.5 * math.floor(mesh.contact_ratio)) + beyond)
    return phase - round(phase)


def _transient(file: DrivetrainFile, output: str) -> dict[str, Any]:
    s = file.simulation
    entries: dict[str, Any] = {"duration": _text(s.duration, "s"), "rate": _text(s.rate, "Hz"), "start": s.start}
    entries |= {name: getattr(s, name) for name in ("harmonics", "contact_loss", "turning", "torsional")}
    for name, unit in (("record", "Hz"), ("settle", "s"), ("resolution", "Hz")):
        if getattr(s, name) is not None:
            entries[name] = _text(getattr(s, name), unit)
    entries["torque"] = [{"load": torque.body, **_torque(torque)} for torque in file.operation.torque]
    if output not in [torque.body for torque in file.operation.torque]:
        entries["torque"].append({"load": output, "torque": "0.0 N m"})
    return entries


def _torque(given: _TorqueSection) -> dict[str, Any]:
    if given.share is not None:
        return {"share": given.share}
    if given.torque is not None:
        return {"torque": _text(given.torque, "N m")}
    columns = (("times", given.times, "s"), ("torques", given.torques, "N m"))
    return {name: [_text(value, unit) for value in values or ()] for name, values, unit in columns}


def _without_effect(file: DrivetrainFile) -> Iterator[Finding]:
    """Entries that a gearbox has no place for, and speeds that are others than before."""
    stages = [(f"{kind}[{i}]", stage) for kind in _WAYS for i, stage in enumerate(getattr(file, kind))]
    for key, stage in stages:
        if stage.driver is not None:
            text = f"{key}.driver has no effect: the torques of the load case say which flanks are loaded"
            yield Finding("W-UNUSED", f"{key}.driver", text, remedy="turn the torques round for the other flanks")
    for i, stage in enumerate(file.parallel):
        if stage.stiffness is not None:
            text = "the teeth of the pair excite with their whole contact, and their masses add to those of the bodies"
            yield Finding("W-FORMER", f"parallel[{i}].stiffness", text, remedy="take the gears out of the bodies")
    ratios = [
        (f"parallel[{i}].teeth", stage.pitch_radii[1] / stage.pitch_radii[0], stage.teeth[1] / stage.teeth[0])
        for i, stage in enumerate(file.parallel)
    ]
    ratios += [
        (
            f"planetary[{i}].ring_teeth",
            planetary.base_radii[2] / planetary.base_radii[0],
            planetary.ring_teeth / planetary.sun_teeth,
        )
        for i, planetary in enumerate(file.planetary)
    ]
    for key, radii, teeth in ratios:
        if abs(teeth / radii - 1.0) > _REMARK:
            text = f"the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}: speeds are those of the teeth"
            yield Finding("W-TEETH", key, text, remedy="give module in place of the radii")
