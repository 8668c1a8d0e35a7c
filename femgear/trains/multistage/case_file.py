"""The case file with ``model = "multistage"``: planetary stages, shafts, operation, response."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field

from femgear.case.quantities import (
    LENGTH,
    PAIR,
    SPEED,
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
from femgear.case.text import CaseFile, ReadCase, described
from femgear.errors import CaseError, FemgearError
from femgear.fe.beam import RoundSection, joint_springs
from femgear.findings import Finding
from femgear.gears.checks import check_set
from femgear.gears.gear import Gear
from femgear.gears.iso6336_stiffness import pair_mesh_stiffness
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.profile import BasicRack
from femgear.gears.tips import settled_tips
from femgear.system.rigid_bodies import PlanarBody, PlanarSet, planar_from_set
from femgear.trains.multistage.model import (
    Member,
    MultistageSet,
    PlanetaryStage,
    StageCoupling,
    check_turns,
    in_series,
    train_torques,
)

_MEMBER = re.compile(r"stage ([1-9]\d?) (carrier|ring|sun)")

# entries of the file for those that refusals of gears and of lumped sets name
_ENTRIES = {
    "profile_shift": "gears.profile_shifts",
    "centre_distance": "gears.profile_shifts",
    "teeth": "gears.teeth",
    "root_radius": "gears.addendum",
    "tip_diameter": "gears.addendum",
}
_REMEDIES = {
    "E-COAXIAL": "choose teeth with sun + 2 planet = ring, or profile shifts that close the set",
}


def _member(value: object) -> str:
    limit = 'a stage and its carrier, ring or sun, such as "stage 1 sun"'
    if not isinstance(value, str):
        message = f"a member of a stage is needed, not {described(value)}"
        raise CaseError(message, code="E-TYPE", value=value, limit=limit)
    if not _MEMBER.fullmatch(value):
        raise CaseError("not a member of a stage", code="E-CHOICE", value=value, limit=limit)
    return value


# beyond, rounding hides the other springs [N m/rad, N/m]
_STIFFEST_TORSION, _STIFFEST_LATERAL = 1e12, 1e15
MemberName = Annotated[str, BeforeValidator(_member)]
Length = Annotated[float, Quantity(LENGTH, 1e-4, 20.0)]


class StageBodySection(Section):
    """Sun, ring or carrier, and the stiffnesses that hold it in the housing."""

    mass: Mass
    inertia: Inertia
    support_stiffness: Annotated[float, StiffnessOrRigid(STIFFNESS, 0.0, 1e15)] = 0.0
    torsional_stiffness: Annotated[float, StiffnessOrRigid(TORSION, 0.0, 1e15)] = 0.0


class StagePlanetSection(Section):
    """One of the equal planets on its bearing."""

    mass: Mass
    inertia: Inertia
    bearing_stiffness: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)]


class StageGearsSection(Section):
    """Gears of a stage: sun, planet, ring; mesh phases, contact ratios and stiffness follow from them."""

    teeth: Annotated[tuple[Teeth, ...], TRIPLE]
    module: Annotated[float, Quantity(LENGTH, 5e-5, 0.5)]
    face_width: FaceWidth
    pressure_angle: PressureAngle = math.radians(20.0)
    profile_shifts: Annotated[tuple[Shift, ...], TRIPLE] = (0.0, 0.0, 0.0)
    addendum: Annotated[tuple[Annotated[float, Number(0.1, 3.0)], ...], TRIPLE] = (1.0, 1.0, 1.0)
    mesh_stiffness: MeshStiffnessSection | None = None


class RadiiSection(Section):
    """Base radii of sun and planet in place of gears; the ring's is that of the sun and two planets."""

    sun: Radius
    planet: Radius
    pressure_angle: PressureAngle = math.radians(20.0)
    teeth: Annotated[tuple[Teeth, ...], TRIPLE] | None = None
    mesh_stiffness: MeshStiffnessSection


class StageSection(Section):
    """A planetary set."""

    planets: Annotated[int, Count(1, 24)] = 3
    planet_angles: Annotated[tuple[Angle, ...], Values(min_length=1, max_length=24)] | None = None
    gears: StageGearsSection | None = None
    radii: RadiiSection | None = None
    fixed: Literal["carrier", "ring", "sun", "none"] = "ring"
    angle: Angle = 0.0
    sun: StageBodySection
    planet: StagePlanetSection
    ring: StageBodySection
    carrier: StageBodySection

    @property
    def angles(self) -> tuple[float, ...]:
        """Of the planets (N,) [rad]: as given, or equally spaced."""
        return self.planet_angles or equal_planet_angles(self.planets)


class CouplingSection(Section):
    """A shaft between members of two stages: springs, or a solid round section of steel."""

    between: Annotated[tuple[MemberName, ...], PAIR]
    diameter: Length | None = None
    length: Length | None = None
    torsional: Annotated[float, StiffnessOrRigid(TORSION, 1e-3, _STIFFEST_TORSION)] | None = None
    lateral: Annotated[float, StiffnessOrRigid(STIFFNESS, 0.0, _STIFFEST_LATERAL)] | None = None


class StagesOperationSection(Section):
    """Speed of and torque on the input, and where input and output are."""

    speed: Speed
    torque: Annotated[float, Quantity(TORQUE, -1e9, 1e9)]
    input: MemberName = "stage 1 sun"
    output: MemberName | None = None


class StagesResponseSection(Section):
    """Speeds of the input, harmonics of every mesh frequency, and speeds of harmonic balance beside them."""

    lowest: Speed
    highest: Speed
    points: Annotated[int, Count(2, 20_000)] = 341
    harmonics: Annotated[int, Count(1, 20)] = 3
    damping_ratio: Annotated[float, Number(0.0, 1.0, open_low=True, open_high=True)] = 0.03
    balance_points: Annotated[int, Count(0, 200)] = 0


class MultistageCase(Section, ReadCase):
    """Planetary stages and their couplings, the operation and what is computed, in SI units.

    The fields carry the names of the case file; ``source`` is the text that gives this case.
    """

    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    train: ClassVar[str] = "multistage"
    model: Literal["multistage"]
    title: Title
    stage: Annotated[tuple[StageSection, ...], Field(min_length=1, max_length=20)]
    coupling: Annotated[tuple[CouplingSection, ...], Field(max_length=60)] = ()
    operation: StagesOperationSection | None = None
    response: StagesResponseSection | None = None

    @property
    def geared(self) -> bool:
        """Whether every stage has gears, and with them mesh phases and tooth pairs in contact."""
        return all(stage.gears is not None for stage in self.stage)


def check_stages_entries(case: MultistageCase) -> Iterator[CaseError]:
    """Refuse what no entry shows alone."""
    problems = list(_entry_problems(case))
    yield from problems
    if not problems:
        train, operation = multistage_of(case), case.operation
        _named(check_turns, "coupling", train)
        if operation is not None:
            _named(lambda train_given: train_torques(train_given, operation.torque), "coupling", train)


def _entry_problems(case: MultistageCase) -> Iterator[CaseError]:
    for n, stage in enumerate(case.stage):
        if (stage.gears is None) == (stage.radii is None):
            key, limit = f"stage[{n}].gears", "one of the tables gears and radii"
            yield CaseError("the sizes of the gears are needed once", code="E-CHOICE", key=key, limit=limit)
        if case.operation is not None and stage.radii is not None and stage.radii.teeth is None:
            yield CaseError(
                f"no tooth numbers in stage {n + 1}",
                code="E-TEETH",
                key=f"stage[{n}].radii.teeth",
                limit="given where there is an operation",
                remedy="give the teeth of sun, planet and ring",
            )
    named = [(f"coupling[{n}].between", member_name) for n, c in enumerate(case.coupling) for member_name in c.between]
    if case.operation is not None:
        named += [(f"operation.{key}", getattr(case.operation, key)) for key in ("input", "output")]
    for key, member in named:
        if member is not None and _member_of(member).stage > len(case.stage):
            yield CaseError(
                "there is no such stage",
                code="E-RANGE",
                key=key,
                value=member,
                limit=f"stage 1 to stage {len(case.stage)}",
            )
    for n, coupling in enumerate(case.coupling):
        sizes = len(coupling.given("diameter", "length"))
        if sizes == 1 or (not sizes and coupling.torsional is None):
            yield CaseError(
                "the shaft has neither a torsional stiffness nor a whole section",
                code="E-CHOICE",
                key=f"coupling[{n}].between",
                limit="torsional, or diameter and length",
            )
    response = case.response
    if response is not None and not response.lowest < response.highest:
        yield CaseError(
            "the speeds do not ascend",
            code="E-RANGE",
            key="response.highest",
            value=SPEED.show(response.highest),
            limit=f"above {SPEED.show(response.lowest)}",
        )


def multistage_of(case: MultistageCase) -> MultistageSet:
    """Make the train of a case; without couplings each carrier turns the next sun, joined rigidly."""
    stages = [_named(_stage, f"stage[{n}]", stage) for n, stage in enumerate(case.stage)]
    couplings = [_named(_coupling, f"coupling[{n}]", coupling) for n, coupling in enumerate(case.coupling)]
    operation = case.operation
    ends = (Member(1, "sun"), Member(len(stages), "carrier"))
    if operation is not None:
        ends = _member_of(operation.input), _member_of(operation.output or str(ends[1]))
    made = couplings or in_series(stages).couplings
    return _named(
        lambda _: MultistageSet(stages=tuple(stages), couplings=tuple(made), input=ends[0], output=ends[1]),
        "operation",
        operation,
    )


def _named(make, key: str, section):
    """What a function makes of a section; its refusals name the keys of the file."""
    try:
        return make(section)
    except FemgearError as error:
        entry = _entry(error.key or "")
        remedy, value = _REMEDIES.get(error.code, error.remedy), error.value
        raise CaseError(
            error.message,
            code=error.code,
            key=f"{key}.{entry}" if entry else key,
            value=None if error.code in _REMEDIES else value,
            limit=error.limit,
            remedy=remedy,
        ) from None


def _member_of(text: str) -> Member:
    match = _MEMBER.fullmatch(text)
    assert match is not None
    return Member(int(match[1]), match[2])


def _coupling(section: CouplingSection) -> StageCoupling:
    given = {name: getattr(section, name) for name in section.given("torsional", "lateral")}
    springs = {}
    if section.diameter is not None and section.length is not None:
        # ends that do not tilt: Timoshenko's beam (Przemieniecki, Theory of Matrix Structural Analysis, 5.6)
        shaft, length = RoundSection(section.diameter), section.length
        bending = 12.0 * shaft.young * shaft.second_moment / (length**3 * (1.0 + shaft.shear_ratio(length)))
        springs = {"torsional": joint_springs(shaft, length).torsion, "lateral": bending}
    first, second = (_member_of(text) for text in section.between)
    return StageCoupling(first, second, **springs | given)


def stage_gears(stage: StageSection) -> PlanetarySet:
    """Make the gears of a stage that has some; the rims have no effect on anything computed here.

    Tips are those of the basic rack with the stage's addenda, shortened as of other cases that leave the tips
    out, see `femgear.gears.tips.settled_tips`.
    """
    given = stage.gears
    assert given is not None
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
            ("sun", "planet", "ring"), given.teeth, given.profile_shifts, rims, given.addendum
        )
    ]
    closed = settled_tips(close_set(*gears, planet_angles=stage.angles))
    check_set(closed)
    return closed


def stage_warnings(case: MultistageCase) -> Iterator[Finding]:
    """List what deserves a look in the gears of every stage that has some."""
    for n, stage in enumerate(case.stage):
        for finding in check_set(stage_gears(stage)) if stage.gears else ():
            # the rims are made up
            if finding.code != "W-RIM":
                key = f"stage[{n}].{_entry(finding.key)}"
                yield replace(finding, key=key, text=f"stage {n + 1}: {finding.text}")


def _entry(key: str) -> str:
    """Entry of a stage, for the one of a planetary set that a check of gears names."""
    entry = key.removeprefix("set.").replace("torsional_support", "torsional_stiffness")
    return _ENTRIES.get(entry.rpartition(".")[2], entry)


def _stage(stage: StageSection) -> PlanetaryStage:
    members = (("sun", stage.sun), ("ring", stage.ring), ("carrier", stage.carrier))
    lumped: dict[str, Any] = {
        name: PlanarBody(member.mass, member.inertia, member.support_stiffness, member.torsional_stiffness)
        for name, member in members
    }
    lumped["planet"] = PlanarBody(stage.planet.mass, stage.planet.inertia)
    lumped["planet_bearing"] = stage.planet.bearing_stiffness
    fixed, size = None if stage.fixed == "none" else stage.fixed, stage.gears or stage.radii
    assert size is not None
    if size.mesh_stiffness is not None:
        lumped["stiffness_sun_planet"] = size.mesh_stiffness.sun_planet
        lumped["stiffness_planet_ring"] = size.mesh_stiffness.planet_ring
    if isinstance(size, StageGearsSection):
        gears = stage_gears(stage)
        data = planar_from_set(gears, **_iso_stiffness(gears) | lumped)
        return PlanetaryStage(data=data, teeth=size.teeth, fixed=fixed, phases=gears.mesh_phases, angle=stage.angle)
    alpha = size.pressure_angle
    data = PlanarSet(
        **lumped,
        sun_radius=size.sun,
        planet_radius=size.planet,
        ring_radius=size.sun + 2.0 * size.planet,
        centre_distance=(size.sun + size.planet) / math.cos(alpha),
        planet_angles=stage.angles,
        pressure_angle_sun_planet=alpha,
        pressure_angle_planet_ring=alpha,
    )
    return PlanetaryStage(data=data, teeth=size.teeth, fixed=fixed, angle=stage.angle)


def _iso_stiffness(gears: PlanetarySet) -> dict[str, float]:
    """Mean stiffness of both meshes after ISO 6336-1, method B, with C_B of the stage's own rack [N/m]."""
    names = "stiffness_sun_planet", "stiffness_planet_ring"
    return {
        name: gears.sun.face_width * pair_mesh_stiffness(pair)[1] for name, pair in zip(names, gears.kinds, strict=True)
    }


FILE = CaseFile(MultistageCase, check_stages_entries)
