"""Files with ``model = "multistage"``, planetary stages in series, read as gearbox cases.

That was a train of its own until its cases became gearboxes. Sun, carrier and ring of stage n are rigid bodies, "stage
n sun" and so on, in the plane; a fixed member is coupled to the casing by its stiffnesses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from femgear.case.quantities import (
    LENGTH,
    PAIR,
    STIFFNESS,
    TORQUE,
    TORSION,
    TRIPLE,
    Count,
    Number,
    Quantity,
    Section,
    StiffnessOrRigid,
    Title,
    Values,
)
from femgear.case.sections import (
    FORMAT,
    Angle,
    FaceWidth,
    Inertia,
    Mass,
    MeshStiffnessSection,
    PressureAngle,
    Radius,
    Shift,
    Speed,
    Teeth,
)
from femgear.errors import CaseError, FemgearError, refused_at, several
from femgear.fe.beam import RoundSection, joint_springs
from femgear.findings import Finding
from femgear.gears.checks import check_set
from femgear.gears.gear import Gear
from femgear.gears.iso6336_stiffness import pair_mesh_stiffness
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.profile import BasicRack
from femgear.gears.tips import settled_tips

MEMBERS = ("sun", "carrier", "ring")
MOST_TEETH = 5000
"""Of a gear of the gearbox."""
_SUN_TEETH = 500
"""Of a sun whose radii alone are given, at most."""
_ENTRIES = {
    "profile_shift": "profile_shifts",
    "centre_distance": "profile_shifts",
    "root_radius": "addendum",
    "tip_diameter": "addendum",
}
"""Entries of the file for those that refusals of gears name."""
Spring = Annotated[float, StiffnessOrRigid(STIFFNESS, 0.0, 1e15)]
Twist = Annotated[float, StiffnessOrRigid(TORSION, 0.0, 1e15)]
Size = Annotated[float, Quantity(LENGTH, 1e-4, 20.0)]
Factor = Annotated[float, Number(0.1, 3.0)]


class _BodySection(Section):
    mass: Mass
    inertia: Inertia
    support_stiffness: Spring = 0.0
    torsional_stiffness: Twist = 0.0


class _PlanetSection(Section):
    mass: Mass
    inertia: Inertia
    bearing_stiffness: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)]


class _GearsSection(Section):
    teeth: Annotated[tuple[Teeth, ...], TRIPLE]
    module: Annotated[float, Quantity(LENGTH, 5e-5, 0.5)]
    face_width: FaceWidth
    pressure_angle: PressureAngle = math.radians(20.0)
    profile_shifts: Annotated[tuple[Shift, ...], TRIPLE] = (0.0, 0.0, 0.0)
    addendum: Annotated[tuple[Factor, ...], TRIPLE] = (1.0, 1.0, 1.0)
    mesh_stiffness: MeshStiffnessSection | None = None


class _RadiiSection(Section):
    sun: Radius
    planet: Radius
    pressure_angle: PressureAngle = math.radians(20.0)
    teeth: Annotated[tuple[Teeth, ...], TRIPLE] | None = None
    mesh_stiffness: MeshStiffnessSection


class _StageSection(Section):
    planets: Annotated[int, Count(1, 24)] = 3
    planet_angles: Annotated[tuple[Angle, ...], Values(min_length=1, max_length=24)] | None = None
    gears: _GearsSection | None = None
    radii: _RadiiSection | None = None
    fixed: Literal["carrier", "ring", "sun", "none"] = "ring"
    angle: Angle = 0.0
    sun: _BodySection
    planet: _PlanetSection
    ring: _BodySection
    carrier: _BodySection

    @property
    def angles(self) -> tuple[float, ...]:
        """Of the planets (N,) [rad]."""
        return self.planet_angles or equal_planet_angles(self.planets)


class _CouplingSection(Section):
    between: Annotated[tuple[str, ...], PAIR]
    diameter: Size | None = None
    length: Size | None = None
    torsional: Twist | None = None
    lateral: Spring | None = None


class _OperationSection(Section):
    speed: Speed
    torque: Annotated[float, Quantity(TORQUE, -1e9, 1e9)]
    input: str = "stage 1 sun"
    output: str | None = None


class _ResponseSection(Section):
    lowest: Speed
    highest: Speed
    points: Annotated[int, Count(2, 20_000)] = 341
    harmonics: Annotated[int, Count(1, 20)] = 3
    damping_ratio: Annotated[float, Number(0.0, 1.0, open_low=True, open_high=True)] = 0.03
    balance_points: Annotated[int, Count(0, 200)] = 0


class MultistageFile(Section):
    """Planetary stages and their couplings, as the files of the former train have them."""

    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    model: Literal["multistage"]
    title: Title
    stage: Annotated[tuple[_StageSection, ...], Field(min_length=1, max_length=20)]
    coupling: Annotated[tuple[_CouplingSection, ...], Field(max_length=60)] = ()
    operation: _OperationSection | None = None
    response: _ResponseSection | None = None


def gearbox_of_multistage(file: MultistageFile) -> tuple[dict[str, Any], tuple[Finding, ...]]:
    """Make the tables of the gearbox that a file describes, and the findings on what it has not.

    CaseError: stages without sizes, gears that do not close, fixed members that nothing holds.
    """
    tables: dict[str, Any] = {"model": "gearbox", "title": file.title, "motions": "plane"}
    tables |= {"shaft": [], "mass": [], "bearing": [], "coupling": [], "planetary": []}
    count, problems = len(file.stage), list(_unknown_springs(file))
    if not problems:
        # in their places of the file, which refusals name
        joined = [{"between": [f"stage {n} carrier", f"stage {n + 1} sun"]} for n in range(1, count)]
        tables["coupling"] += list(_shafts(file)) or joined
    for n, stage in enumerate(file.stage):
        try:
            _add_stage(tables, stage, n)
        except FemgearError as error:
            problems += [refused_at(problem, _key(problem, n)) for problem in error.problems]
    if problems:
        raise several(problems)
    given, response = file.operation, file.response
    driven = given.input if given else "stage 1 sun"
    torque, speed = (given.torque, given.speed) if given else (0.0, 0.0)
    tables["operation"] = {
        "output": [given.output if given and given.output else f"stage {count} carrier"],
        "load_case": [{"torque": {driven: f"{torque!r} N m"}, "speed": {driven: f"{speed!r} rad/s"}}],
    }
    tables["modes"] = {"up_to": "1 MHz"}
    if response is not None:
        tables["modes"] |= {"damping_ratio": response.damping_ratio}
        tables["dynamics"] = {"mesh_harmonics": response.harmonics}
        ends = {"from": f"{response.lowest!r} rad/s", "to": f"{response.highest!r} rad/s"}
        tables["runup"] = ends | {"count": response.points}
    return {key: entry for key, entry in tables.items() if entry != []}, tuple(_without_effect(file))


def _without_effect(file: MultistageFile) -> Iterator[Finding]:
    """Entries that a gearbox has no place for."""
    if file.response is not None and file.response.balance_points:
        text = "response.balance_points has no effect: a gearbox is solved stage by stage"
        remedy = "leave it out; W-CROSS tells what stages do to one another"
        yield Finding("W-UNUSED", "response.balance_points", text, remedy=remedy)


def _key(problem: FemgearError, n: int) -> str:
    """Entry of the file for that which a refusal of a stage names."""
    entry = (problem.key or "").removeprefix("set.").rpartition(".")[2]
    gears = {*_GearsSection.model_fields, *_ENTRIES}
    return f"stage[{n}].gears.{_ENTRIES.get(entry, entry)}" if entry in gears else f"stage[{n}].{problem.key or ''}"


def _unknown_springs(file: MultistageFile) -> Iterator[CaseError]:
    for n, coupling in enumerate(file.coupling):
        sizes = len(coupling.given("diameter", "length"))
        if sizes == 1 or (not sizes and coupling.torsional is None):
            yield CaseError(
                "the shaft has neither a torsional stiffness nor a whole section",
                code="E-CHOICE",
                key=f"coupling[{n}].between",
                limit="torsional, or diameter and length",
            )


def _shafts(file: MultistageFile) -> Iterator[dict[str, Any]]:
    """Couplings of the gearbox: springs as given, or those of a round shaft of steel whose ends do not tilt."""
    for coupling in file.coupling:
        torsion, lateral = coupling.torsional, coupling.lateral
        if coupling.diameter is not None and coupling.length is not None:
            # Timoshenko's beam (Przemieniecki, Theory of Matrix Structural Analysis, 5.6)
            shaft, length = RoundSection(coupling.diameter), coupling.length
            bending = 12.0 * shaft.young * shaft.second_moment / (length**3 * (1.0 + shaft.shear_ratio(length)))
            torsion = joint_springs(shaft, length).torsion if torsion is None else torsion
            lateral = bending if lateral is None else lateral
        springs = {"torsion": _text(torsion or 0.0, "N m/rad"), "radial": _text(lateral or 0.0, "N/m")}
        yield {"between": list(coupling.between)} | springs


def _text(value: float, unit: str) -> str:
    return "rigid" if math.isinf(value) else f"{value!r} {unit}"


def _add_stage(tables: dict[str, Any], stage: _StageSection, n: int) -> None:
    """Add bodies, what holds them, and the planetary set of a stage."""
    name = f"stage {n + 1}"
    for member in MEMBERS:
        body, shaft = getattr(stage, member), f"{name} {member}"
        tables["shaft"].append({"name": shaft})
        tables["mass"].append(
            {"shaft": shaft, "mass": _text(body.mass, "kg"), "inertia": _text(body.inertia, "kg m^2")}
        )
        radial, torsion = _text(body.support_stiffness, "N/m"), _text(body.torsional_stiffness, "N m/rad")
        if member == stage.fixed:
            if not body.torsional_stiffness:
                raise CaseError(
                    f"the {member} is fixed but has no torsional support",
                    code="E-MECHANISM",
                    key=f"{member}.torsional_stiffness",
                    limit='above 0, or "rigid"',
                )
            tables["coupling"].append({"between": [shaft, "casing"], "torsion": torsion, "radial": radial})
        elif body.support_stiffness or body.torsional_stiffness:
            springs = {"radial": radial} if body.support_stiffness else {}
            springs |= {"torsional": torsion} if body.torsional_stiffness else {}
            tables["bearing"].append({"shaft": shaft} | springs)
    planet, angles = stage.planet, stage.angles
    sizes, meshes = _gears(stage) if stage.gears else _radii(stage)
    tables["planetary"].append(
        {"name": name}
        | {member: f"{name} {member}" for member in MEMBERS}
        | {"angle": f"{angles[0] + stage.angle!r} rad"}
        | {"gears": {"planets": len(angles), "planet_angles": [f"{angle!r} rad" for angle in angles]} | sizes}
        | meshes
        | {
            "planet": {
                "mass": _text(planet.mass, "kg"),
                "inertia": _text(planet.inertia, "kg m^2"),
                "bearing": {"radial": _text(planet.bearing_stiffness, "N/m")},
            }
        }
    )


def _radii(stage: _StageSection) -> tuple[dict[str, Any], dict[str, Any]]:
    """Sizes and meshes of a stage of base radii; teeth that are not given are in the ratio of the radii."""
    given = stage.radii
    if given is None:
        limit = "one of the tables gears and radii"
        raise CaseError("the sizes of the gears are needed once", code="E-CHOICE", key="gears", limit=limit)
    radii = given.sun, given.planet, given.sun + 2.0 * given.planet
    teeth = given.teeth or tuple(_nearest_teeth(radii, len(stage.angles)))
    sizes = {
        "teeth": list(teeth),
        "base_radii": [f"{radius!r} m" for radius in radii],
        "pressure_angles": [f"{given.pressure_angle!r} rad"] * 2,
    }
    sun, ring = given.mesh_stiffness.sun_planet, given.mesh_stiffness.planet_ring
    return sizes, {"sun_mesh": {"stiffness": _text(sun, "N/m")}, "ring_mesh": {"stiffness": _text(ring, "N/m")}}


def _nearest_teeth(radii: tuple[float, float, float], planets: int) -> Iterator[int]:
    """Tooth numbers in the ratio of the radii, to a thousandth, with which the planets assemble."""
    unit = min(_SUN_TEETH, math.floor(MOST_TEETH / (radii[2] / radii[0]))) / radii[0]
    sun, planet, ring = (round(unit * radius) for radius in radii)
    yield from (sun, planet, ring - (sun + ring) % planets)


def _gears(stage: _StageSection) -> tuple[dict[str, Any], dict[str, Any]]:
    """Sizes and meshes of a stage of gears: stiffness of ISO 6336-1, method B, unless given, and path of contact."""
    given = stage.gears
    if given is None or stage.radii is not None:
        limit = "one of the tables gears and radii"
        raise CaseError("the sizes of the gears are needed once", code="E-CHOICE", key="gears", limit=limit)
    gears = _planetary_set(given, stage.angles)
    sizes = {
        "teeth": list(given.teeth),
        "base_radii": [f"{gear.base_radius!r} m" for gear in gears.gears],
        "pressure_angles": [
            f"{angle!r} rad"
            for angle in (gears.working_pressure_angle_sun_planet, gears.working_pressure_angle_planet_ring)
        ],
        "face_width": f"{given.face_width!r} m",
    }
    stiffness = [given.face_width * pair_mesh_stiffness(pair)[1] for pair in gears.kinds]
    if given.mesh_stiffness is not None:
        stiffness = [given.mesh_stiffness.sun_planet, given.mesh_stiffness.planet_ring]
    # of teeth as thick as their spaces, see `femgear.trains.gearbox.excitation.mesh_phases`
    beyond = (0.0, float(gears.mesh_phases[len(stage.angles)]) + 0.5 * (given.teeth[1] - 1))
    meshes = {}
    for mesh, k, path, ahead in zip(
        ("sun_mesh", "ring_mesh"), stiffness, (gears.path_sun_planet, gears.path_planet_ring), beyond, strict=True
    ):
        start, end = (place / gears.base_pitch for place in path)
        phase = ahead - 0.5 * (start + end)
        entries = {"contact_ratio": end - start, "phase": phase - round(phase)}
        meshes[mesh] = {"stiffness": _text(k, "N/m")} | entries
    return sizes, meshes


def _planetary_set(given: _GearsSection, angles: tuple[float, ...]) -> PlanetarySet:
    """Gears of a stage, with the tips of their basic racks, see `settled_tips`; their rims are made up."""
    sun, planet, ring = (0.5 * given.module * z for z in given.teeth)
    rims = (0.3 * sun, 0.5 * planet, ring + 4.0 * given.module)
    gears = [
        Gear(
            z,
            given.module,
            given.pressure_angle,
            shift,
            given.face_width,
            rim,
            internal=name == "ring",
            rack=BasicRack(addendum=addendum),
            name=name,
            tip_open=True,
        )
        for name, z, shift, rim, addendum in zip(
            ("sun", "planet", "ring"), given.teeth, given.profile_shifts, rims, given.addendum, strict=True
        )
    ]
    closed = settled_tips(close_set(*gears, planet_angles=angles))
    check_set(closed)
    return closed
