"""The sections of a case file with ``model = "drivetrain"``: bodies, and what joins and drives them.

`build_drivetrain` reads such a case from the tables of a file; a torque series in a CSV file that the case
names is read once and kept inside the case. `cross_check` refuses entries that contradict one another: names,
chain, teeth and radii, places of the planets, torques, times. `notices` says what is allowed but deserves a
look. `drivetrain_of` and `torque_histories` are the data of the chain that the entries stand for.
"""

from __future__ import annotations

import difflib
import math
import os
import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, StrictBool, ValidationError, ValidationInfo, field_validator

from femgear.case.fields import (
    Count,
    Number,
    Quantity,
    Section,
    StiffnessOrRigid,
    Title,
    described,
    refuse,
)
from femgear.case.problems import combine, translate
from femgear.case.tables import Columns, embed_points, read_columns
from femgear.case.text import ReadCase, text_with_points
from femgear.case.units import (
    ACCELERATION,
    ANGLE,
    DENSITY,
    FREQUENCY,
    INERTIA,
    LENGTH,
    MASS,
    MODULUS,
    SPEED,
    STIFFNESS,
    TIME,
    TORQUE,
    TORSION,
)
from femgear.errors import CaseError, Finding
from femgear.system import shaft as shafts
from femgear.trains.drivetrain.data import (
    ChainBearing,
    ChainBody,
    ChainShaft,
    Drivetrain,
    MeshWave,
    ParallelStage,
    PlanetaryStage,
    TorqueHistory,
)

MODEL = "drivetrain"
FORMAT = 1
MOST_PARTS = 200
MOST_POINTS = 20_000
LARGEST_TORQUE, LATEST, FASTEST_RATE = 1e9, 1e6, 1e7
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_ -]{0,39}")

# Ratios of radii and teeth that differ by more belong to no gears; profile shifts explain the rest.
RATIO_TOLERANCE = 0.01
# Teeth of a planet that profile shifts may add or take.
_SHIFTED = 2

# Ratios of radii and teeth that differ by more are worth a remark.
_REMARK = 1e-4

MOST_STEPS = 1e8
MOST_VALUES = 2.5e8
MOST_COORDINATES = 1500

_DIMENSIONS = {"time": TIME, "torque": TORQUE}
_LIMITS = {"time": (0.0, LATEST), "torque": (-LARGEST_TORQUE, LARGEST_TORQUE)}
_COLUMNS = "the first line names two columns: time [s] and torque [N m] (or other units)"
# Times and torques are written into the case with so many digits.
_DIGITS = ".13g"


def _name(value: object) -> str:
    if not isinstance(value, str):
        raise refuse(f"a name is needed, not {described(value)}", code="E-TYPE", value=value)
    if not _NAME.fullmatch(value) or value != value.strip() or re.match(r"(planet|shaft)\b", value):
        raise refuse(
            "not a name for a body",
            code="E-CHOICE",
            value=value,
            limit="40 letters, digits, blanks, - or _; planet and shaft are taken as first words",
        )
    return value


def _reference(value: object) -> str:
    if not isinstance(value, str):
        raise refuse(f"the name of a body is needed, not {described(value)}", code="E-TYPE", value=value)
    return value


Name = Annotated[str, BeforeValidator(_name)]
Reference = Annotated[str, BeforeValidator(_reference)]
Mass = Annotated[float, Quantity(MASS, 1e-6, 1e8)]
Inertia = Annotated[float, Quantity(INERTIA, 1e-12, 1e11)]
Radius = Annotated[float, Quantity(LENGTH, 1e-4, 100.0)]
Length = Annotated[float, Quantity(LENGTH, 1e-4, 1e3)]
Offset = Annotated[float, Quantity(LENGTH, -100.0, 100.0)]
Angle = Annotated[float, Quantity(ANGLE, -2 * math.pi, 2 * math.pi)]
PressureAngle = Annotated[float, Quantity(ANGLE, math.radians(5), math.radians(45))]
Teeth = Annotated[int, Count(4, 5000)]
Joint = Annotated[float, StiffnessOrRigid(TORSION, 1e-3, 1e15)]
Torque = Annotated[float, Quantity(TORQUE, -LARGEST_TORQUE, LARGEST_TORQUE)]
Time = Annotated[float, Quantity(TIME, 0.0, LATEST)]
Frequency = Annotated[float, Quantity(FREQUENCY, 1e-3, 1e7)]


def _two(value: object) -> object:
    if not isinstance(value, list) or len(value) != 2:
        what = f"{len(value)} entries" if isinstance(value, list) else described(value)
        raise refuse(
            f"two entries are needed, not {what}",
            code="E-COUNT",
            limit="a list of two: for the first and for the second body",
        )
    return value


BOTH = BeforeValidator(_two)
"""Of entries of the first and the second body, in `Annotated`."""


def _driver(value: str | None, ends) -> str | None:
    """The driver of a stage; where the ends themselves are wrong, they alone are refused."""
    if value is not None and len(ends) == 2 and value not in ends:
        raise refuse(
            "the driver is none of the two bodies of its stage", code="E-CHOICE", value=value,
            limit=" or ".join(ends),
        )  # fmt: skip
    return value


class BodySection(Section):
    """A rigid body on its axis; the first body gives the speed."""

    name: Name
    inertia: Inertia
    mass: Mass
    transverse_inertia: Annotated[float, Quantity(INERTIA, 0.0, 1e11)] = 0.0
    tilts: StrictBool = True


class ShaftSection(Section):
    """A shaft between two bodies: springs of its joint, or a round section."""

    between: Annotated[tuple[Reference, ...], BOTH]
    length: Length
    bending: Joint | None = None
    torsion: Joint | None = None
    shear: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)] | None = None
    shear_ratio: Annotated[float, Number(0.0, 100.0)] = 0.0
    outer_diameter: Radius | None = None
    inner_diameter: Annotated[float, Quantity(LENGTH, 0.0, 100.0)] = 0.0
    youngs_modulus: Annotated[float, Quantity(MODULUS, 1e6, 1e12)] = 2.06e11
    poisson_ratio: Annotated[float, Number(0.0, 0.5, open_high=True)] = 0.3
    density: Annotated[float, Quantity(DENSITY, 0.0, 25000.0)] = 7850.0
    elements: Annotated[int, Count(0, 100)] = 0


class MeshSection(Section):
    """Rectangular mesh stiffness by the number of tooth pairs in contact."""

    stiffness: Annotated[float, Quantity(STIFFNESS, 1e3, 1e13)]
    contact_ratio: Annotated[float, Number(1.0, 20.0)]
    low_share: Annotated[float, Number(0.0, 1.0, open_low=True)] | None = None
    phase: Annotated[float, Number(-1000.0, 1000.0)] = 0.0
    backlash: Annotated[float, Quantity(LENGTH, 0.0, 0.05)] | None = None


class ParallelSection(Section):
    """Two external gears; sizes by pitch radii, base radii, or the transverse module."""

    between: Annotated[tuple[Reference, ...], BOTH]
    teeth: Annotated[tuple[Teeth, ...], BOTH]
    radii: Annotated[tuple[Radius, ...], BOTH] | None = None
    base_radii: Annotated[tuple[Radius, ...], BOTH] | None = None
    module: Annotated[float, Quantity(LENGTH, 5e-5, 0.5)] | None = None
    mesh: MeshSection
    pressure_angle: PressureAngle = math.radians(20.0)
    helix_angle: Annotated[float, Quantity(ANGLE, -math.radians(60), math.radians(60))] = 0.0
    direction: Angle = 0.0
    offsets: Annotated[tuple[Offset, ...], BOTH] = (0.0, 0.0)
    driver: Reference | None = None

    @field_validator("driver")
    @classmethod
    def _one_of_two(cls, value, info: ValidationInfo):
        return _driver(value, info.data.get("between", ()))


class PlanetarySection(Section):
    """Carrier, sun and planets in a ring that the housing holds."""

    carrier: Reference
    sun: Reference
    ring_teeth: Teeth
    sun_teeth: Teeth
    planet_teeth: Teeth | None = None
    sun_radius: Radius | None = None
    planet_radius: Radius | None = None
    sun_base_radius: Radius | None = None
    planet_base_radius: Radius | None = None
    module: Annotated[float, Quantity(LENGTH, 5e-5, 0.5)] | None = None
    planets: Annotated[int, Count(1, 24)] = 3
    planet_angles: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=24)] | None = None
    planet_mass: Mass
    planet_inertia: Inertia
    planet_transverse_inertia: Annotated[float, Quantity(INERTIA, 0.0, 1e11)] = 0.0
    planet_bearing: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)] = math.inf
    sun_mesh: MeshSection
    ring_mesh: MeshSection
    pressure_angle: PressureAngle = math.radians(20.0)
    driver: Reference | None = None

    @field_validator("driver")
    @classmethod
    def _one_of_two(cls, value, info: ValidationInfo):
        return _driver(value, [info.data[key] for key in ("carrier", "sun") if key in info.data])


class BearingSection(Section):
    """Bearing in the housing, of a body or of a station inside a shaft of several elements."""

    body: Reference | None = None
    shaft: Annotated[tuple[Reference, ...], BOTH] | None = None
    station: Annotated[int, Count(1, 99)] | None = None
    radial: Annotated[float, StiffnessOrRigid(STIFFNESS, 0.0, 1e15)] = 0.0
    tilt: Annotated[float, StiffnessOrRigid(TORSION, 0.0, 1e15)] = 0.0
    offset: Offset = 0.0


class GravitySection(Section):
    """Weight of all bodies along -y."""

    acceleration: Annotated[float, Quantity(ACCELERATION, 0.0, 1e3)] = 9.80665


class TorqueSection(Section):
    """Torque on a body: constant, a series, or a share of what balances the others."""

    body: Reference
    torque: Torque | None = None
    file: Title | None = None
    times: Annotated[tuple[Time, ...], Field(min_length=1, max_length=MOST_POINTS)] | None = None
    torques: Annotated[tuple[Torque, ...], Field(min_length=1, max_length=MOST_POINTS)] | None = None
    share: Annotated[float, Number(0.0, 10.0)] | None = None


class OperationSection(Section):
    """Speed of the first body at the start, and the torques."""

    speed: Annotated[float, Quantity(SPEED, 1e-3 * SPEED.scale, 1e6 * SPEED.scale)]
    torque: Annotated[tuple[TorqueSection, ...], Field(max_length=MOST_PARTS)] = ()


class SimulationSection(Section):
    """Integration in time, what is kept of it, and its spectra."""

    duration: Annotated[float, Quantity(TIME, 1e-3, 1e5)]
    rate: Annotated[float, Quantity(FREQUENCY, 10.0, FASTEST_RATE)] = 20_000.0
    record: Annotated[float, Quantity(FREQUENCY, 1.0, FASTEST_RATE)] | None = None
    start: Literal["static", "zero"] = "static"
    harmonics: Annotated[int, Count(1, 200)] = 15
    damping_ratio: Annotated[float, Number(0.0, 1.0, open_high=True)] = 0.0
    turning: StrictBool = True
    torsional: StrictBool = False
    contact_loss: StrictBool = False
    modes: Annotated[int, Count(0, 24)] = 4
    settle: Time | None = None
    resolution: Frequency | None = None


class DrivetrainCase(Section, ReadCase):
    """A chain of bodies, its operation and how to integrate it, in SI units.

    The fields carry the names of the case file; ``source`` is the text that gives this case, ``notices`` what
    deserves to be said.
    """

    format: Annotated[int, Count(1, 2**31)] = FORMAT
    model: Literal["drivetrain"]
    title: Title
    body: Annotated[tuple[BodySection, ...], Field(min_length=1, max_length=MOST_PARTS)]
    shaft: Annotated[tuple[ShaftSection, ...], Field(max_length=MOST_PARTS)] = ()
    parallel: Annotated[tuple[ParallelSection, ...], Field(max_length=MOST_PARTS)] = ()
    planetary: Annotated[tuple[PlanetarySection, ...], Field(max_length=20)] = ()
    bearing: Annotated[tuple[BearingSection, ...], Field(max_length=MOST_PARTS)] = ()
    gravity: GravitySection | None = None
    operation: OperationSection
    simulation: SimulationSection


def build_drivetrain(data: dict, text: str, name: str, *, numbered: bool = True) -> DrivetrainCase:
    """Case of the tables of a TOML text that names a model.

    Parameters
    ----------
    data : dict
        Modified: torque series of files take the place of the files.
    text, name : str
        Of the file.
    numbered : bool
        Whether messages may name lines.

    Raises
    ------
    CaseError
        Everything that is wrong, at once.
    """
    lines = text if numbered else ""
    if "model" not in data:
        remedy = f'write model = "{MODEL}" before the first table'
        missing = CaseError(
            "a file with bodies needs its model", code="E-KEY-MISSING", key="model", remedy=remedy
        )
        raise combine([missing], lines, name)
    files = embed_torques(data, name)
    if files:
        text = text_with_points(data, name, points="torque series", remedy="give them at fewer points")
    try:
        case = DrivetrainCase.model_validate(data)
    except ValidationError as error:
        raise combine(translate(error, DrivetrainCase), lines, name) from None
    if problems := cross_check(case):
        raise combine(problems, lines, name)
    case.read_from(text, lines, name, notices=notices(case), profile_files=files)
    return case


def is_drivetrain(data: dict) -> bool:
    """Whether tables name this model, or have bodies, of which planetary sets have none."""
    return data.get("model", MODEL) == MODEL and ("model" in data or isinstance(data.get("body"), list))


def need_drivetrain(case: object) -> DrivetrainCase:
    """The case, refused where it is no drivetrain (E-MODEL)."""
    if not isinstance(case, DrivetrainCase):
        raise CaseError(
            "this is no drivetrain",
            code="E-MODEL",
            key="model",
            limit=f'model = "{MODEL}"',
            remedy="name a case file of a drivetrain",
            file=getattr(case, "name", None) or None,
        )
    return case


def drivetrain_of(case: DrivetrainCase) -> Drivetrain:
    """The chain of a case.

    Parameters
    ----------
    case : DrivetrainCase

    Returns
    -------
    Drivetrain
    """
    return Drivetrain(
        bodies=tuple(ChainBody(**body.model_dump()) for body in case.body),
        shafts=tuple(_shaft(one) for one in case.shaft),
        parallel=tuple(_parallel(one) for one in case.parallel),
        planetary=tuple(_planetary(one) for one in case.planetary),
        bearings=tuple(_bearing(one) for one in case.bearing),
        gravity=0.0 if case.gravity is None else case.gravity.acceleration,
        damping_ratio=case.simulation.damping_ratio,
    )


def _shaft(one: ShaftSection) -> ChainShaft:
    first, second = one.between
    section = None
    if one.outer_diameter is not None:
        section = shafts.ShaftSection(
            one.outer_diameter, one.inner_diameter, one.youngs_modulus, one.poisson_ratio, one.density
        )
    springs = one.bending, one.torsion, one.shear
    return ChainShaft(first, second, one.length, *springs, one.shear_ratio, section, one.elements)


def _wave(one: MeshSection) -> MeshWave:
    backlash = math.inf if one.backlash is None else one.backlash
    return MeshWave(one.stiffness, one.contact_ratio, one.low_share, one.phase, backlash)


def _bearing(one: BearingSection) -> ChainBearing:
    body, other = one.shaft or (one.body or "", None)
    return ChainBearing(body, one.radial, one.tilt, one.offset, other=other, station=one.station or 0)


def _parallel(one: ParallelSection) -> ParallelStage:
    if one.module is not None:
        radii = [0.5 * one.module * teeth for teeth in one.teeth]
    else:
        radii = one.radii or [radius / math.cos(one.pressure_angle) for radius in one.base_radii or ()]
    return ParallelStage(
        first=one.between[0],
        second=one.between[1],
        first_radius=radii[0],
        second_radius=radii[1],
        first_teeth=one.teeth[0],
        mesh=_wave(one.mesh),
        pressure_angle=one.pressure_angle,
        helix_angle=one.helix_angle,
        direction=one.direction,
        first_offset=one.offsets[0],
        second_offset=one.offsets[1],
        driver=one.driver,
    )


def _planetary(one: PlanetarySection) -> PlanetaryStage:
    if one.module is not None:
        # half teeth of the planet are a matter of its profile shift
        teeth = one.sun_teeth, 0.5 * (one.ring_teeth - one.sun_teeth)
        sun, planet = (0.5 * one.module * number for number in teeth)
    elif one.sun_base_radius is not None and one.planet_base_radius is not None:
        cosine = math.cos(one.pressure_angle)
        sun, planet = one.sun_base_radius / cosine, one.planet_base_radius / cosine
    else:
        assert one.sun_radius is not None and one.planet_radius is not None  # one of three ways
        sun, planet = one.sun_radius, one.planet_radius
    same = ("carrier", "sun", "ring_teeth", "sun_teeth", "pressure_angle", "planet_bearing", "driver")
    same += ("planet_mass", "planet_inertia", "planet_transverse_inertia")
    return PlanetaryStage(
        sun_radius=sun,
        planet_radius=planet,
        sun_mesh=_wave(one.sun_mesh),
        ring_mesh=_wave(one.ring_mesh),
        planet_angles=one.planet_angles or tuple(2.0 * math.pi * p / one.planets for p in range(one.planets)),
        **{name: getattr(one, name) for name in same},
    )


def torque_histories(case: DrivetrainCase, ratio: Mapping[str, float]) -> tuple[TorqueHistory, ...]:
    """Torques of a case; a share balances the others over the speed ratios.

    Parameters
    ----------
    case : DrivetrainCase
    ratio : mapping of str to float
        Speeds of the bodies over that of the first one.

    Returns
    -------
    tuple of TorqueHistory
    """
    entries = case.operation.torque
    found = [
        TorqueHistory(one.body, np.array(one.times or [0.0]), np.array(one.torques or [one.torque]))
        for one in entries
        if one.share is None
    ]
    for one in entries:
        if one.share is not None:
            times = np.unique(np.concatenate([history.times for history in found]))
            power = np.sum([ratio[history.body] * history.at(times) for history in found], axis=0)
            found.append(TorqueHistory(one.body, times, -one.share * power / ratio[one.body]))
    return tuple(found)


def cross_check(case: DrivetrainCase) -> list[CaseError]:
    """What no entry shows alone."""
    names = list(_names(case))
    found = [*names, *(problem for check in _CHECKS for problem in check(case))]
    return found if names else [*found, *_chain(case)]


def joints(case: DrivetrainCase) -> list[tuple[str, ...]]:
    """Key, and the two bodies, of every shaft and gear stage."""
    found = [(f"shaft[{i}].between", *one.between) for i, one in enumerate(case.shaft)]
    found += [(f"parallel[{i}].between", *one.between) for i, one in enumerate(case.parallel)]
    return found + [(f"planetary[{i}].sun", one.carrier, one.sun) for i, one in enumerate(case.planetary)]


def _names(case: DrivetrainCase) -> Iterator[CaseError]:
    names = [body.name for body in case.body]
    for i, name in enumerate(names):
        if name in names[:i]:
            yield CaseError("two bodies have one name", code="E-DUPLICATE", key=f"body[{i}].name", value=name)
    used = [(key, name) for key, *ends in joints(case) if ".between" in key for name in ends]
    for i, stage in enumerate(case.planetary):
        used += [(f"planetary[{i}].carrier", stage.carrier), (f"planetary[{i}].sun", stage.sun)]
    used += [(f"bearing[{i}].body", one.body) for i, one in enumerate(case.bearing) if one.body is not None]
    used += [(f"operation.torque[{i}].body", one.body) for i, one in enumerate(case.operation.torque)]
    for key, name in used:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
            yield CaseError(
                "there is no such body",
                code="E-CHOICE",
                key=key,
                value=name,
                limit=", ".join(names[:20]),
                remedy=f"did you mean {near[0]}?" if near else "name a body of a [[body]] table",
            )
    for key, first, second in joints(case):
        if first == second:
            yield CaseError("a body is joined to itself", code="E-CHOICE", key=key, value=first)


def _chain(case: DrivetrainCase) -> Iterator[CaseError]:
    """Everything hangs together, and shafts alone close no loop."""
    group = {body.name: body.name for body in case.body}

    def root(name: str) -> str:
        while group[name] != name:
            name = group[name]
        return name

    for key, first, second in joints(case):
        one, two = root(first), root(second)
        if one == two and key.startswith("shaft"):
            yield CaseError(
                f"the shaft closes a loop: {first} and {second} are joined already",
                code="E-DRIVETRAIN",
                key=key,
                limit="one way by shafts from body to body",
                remedy="leave one of the shafts out",
            )
        group[two] = one
    start = root(case.body[0].name)
    apart = [(i, body.name) for i, body in enumerate(case.body) if root(body.name) != start]
    if apart:
        i, name = apart[0]
        yield CaseError(
            f"nothing joins {', '.join(name for _, name in apart)} to {case.body[0].name}",
            code="E-DRIVETRAIN",
            key=f"body[{i}].name",
            value=name,
            remedy="add a [[shaft]], a [[parallel]] or a [[planetary]]",
        )


def _bodies(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, body in enumerate(case.body):
        if body.tilts and body.transverse_inertia == 0.0:
            yield CaseError(
                "a body that tilts needs an inertia about a diameter", code="E-KEY-MISSING",
                key=f"body[{i}].transverse_inertia",
                remedy="give it (a flat disc has half its inertia about the axis), or tilts = false",
            )  # fmt: skip
    elements = {shaft.between: shaft.elements for shaft in case.shaft}
    for i, one in enumerate(case.bearing):
        inside = (one.shaft is not None, one.station is not None)
        if inside != (one.body is None,) * 2:
            yield CaseError(
                "a bearing sits on one body, or on one station inside a shaft",
                code="E-CHOICE",
                key=f"bearing[{i}].{'body' if one.body else 'shaft'}",
                limit="body, or shaft with station",
            )
        elif one.shaft and one.station and not one.station < elements.get(one.shaft, 0):
            stations = elements.get(one.shaft, 0) - 1
            yield CaseError(
                "there is no such station",
                code="E-CHOICE",
                key=f"bearing[{i}].station",
                value=one.station,
                limit=f"1 to {stations}"
                if stations > 0
                else "a [[shaft]] with this between and 2 elements or more",
            )
        if one.radial == one.tilt == 0.0:
            yield CaseError(
                "a bearing without stiffness", code="E-RANGE", key=f"bearing[{i}].radial", value="0 N/m",
                limit="one of radial and tilt above 0", remedy="give it, or leave the [[bearing]] out",
            )  # fmt: skip
        if math.isinf(one.radial) and one.offset:
            yield CaseError(
                "a rigid bearing beside the centre of its body", code="E-CHOICE", key=f"bearing[{i}].offset",
                value=LENGTH.show(one.offset), limit="0 mm where radial is rigid",
                remedy="give a finite stiffness",
            )  # fmt: skip


def _shafts(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, shaft in enumerate(case.shaft):
        springs = [name for name in ("bending", "torsion", "shear") if getattr(shaft, name) is not None]
        if message := _shaft_problem(shaft, springs):
            yield CaseError(
                message,
                code="E-CHOICE",
                key=f"shaft[{i}].{springs[0] if springs else 'outer_diameter'}",
                limit="bending and torsion, or outer_diameter with what else the section needs",
            )
        if shaft.outer_diameter is not None and not shaft.inner_diameter < shaft.outer_diameter:
            yield CaseError(
                "the bore is as large as the shaft",
                code="E-RANGE",
                key=f"shaft[{i}].inner_diameter",
                value=LENGTH.show(shaft.inner_diameter),
                limit=f"below {LENGTH.show(shaft.outer_diameter)}",
            )
        if shaft.torsion is not None and math.isinf(shaft.torsion):
            yield CaseError(
                "a shaft that is rigid in torsion makes one body of two", code="E-CHOICE",
                key=f"shaft[{i}].torsion", value="rigid", limit="a finite spring",
                remedy="give a spring, or one body with the inertia of both",
            )  # fmt: skip
        if shaft.elements > 1 and shaft.density == 0.0:
            yield CaseError(
                "stations inside a shaft without mass", code="E-RANGE", key=f"shaft[{i}].density",
                value="0 kg/m^3", limit="above 0 kg/m^3 with 2 elements or more",
                remedy="give its density, or elements = 0",
            )  # fmt: skip


def _shaft_problem(shaft: ShaftSection, springs: list[str]) -> str:
    if shaft.outer_diameter is None:
        if not {"bending", "torsion"} <= set(springs):
            return "the shaft has neither a section nor both springs"
        return "elements need a section" if shaft.elements else ""
    return f"the shaft has a section and {' and '.join(springs)}" if springs else ""


def _torques(case: DrivetrainCase) -> Iterator[CaseError]:
    shares, bodies = [], []
    for i, one in enumerate(case.operation.torque):
        key = f"operation.torque[{i}]"
        series = len(given_of(one, ("times", "torques")))
        given = given_of(one, ("torque", "file", "share")) + ["times"] * bool(series)
        if len(given) != 1 or series == 1:
            yield CaseError(
                "the torque on a body is given in one way",
                code="E-CHOICE",
                key=f"{key}.{given[0] if given else 'torque'}",
                limit="torque, file, times with torques, or share",
            )
        elif one.times is not None and one.torques is not None:
            if len(one.times) != len(one.torques) or any(b <= a for a, b in pairwise(one.times)):
                yield CaseError(
                    "the series needs ascending times, and as many torques",
                    code="E-TORQUE",
                    key=f"{key}.times",
                    value=f"{len(one.times)} times, {len(one.torques)} torques",
                )
        if one.body in bodies:
            yield CaseError("a second torque on one body", code="E-DUPLICATE", key=f"{key}.body")
        bodies.append(one.body)
        shares += [key] if one.share is not None else []
    if len(shares) > 1 or (shares and len(bodies) == 1):
        yield CaseError(
            "a share needs other torques that it balances, none of them a share",
            code="E-TORQUE",
            key=f"{shares[-1]}.share",
            limit="one share, beside torques that are given",
        )


def _simulation(case: DrivetrainCase) -> Iterator[CaseError]:
    s = case.simulation
    steps = s.duration * s.rate
    if steps > MOST_STEPS:
        yield CaseError(
            f"{steps:.3g} steps are too many", code="E-RANGE", key="simulation.duration",
            value=TIME.show(s.duration), limit=f"{MOST_STEPS:g} steps: {TIME.show(MOST_STEPS / s.rate)}",
            remedy="take a shorter duration or a lower simulation.rate",
        )  # fmt: skip
    if s.settle is not None and not s.settle < s.duration:
        yield CaseError(
            "the spectra would leave out the whole run", code="E-RANGE", key="simulation.settle",
            value=TIME.show(s.settle), limit=f"below {TIME.show(s.duration)} (simulation.duration)",
        )  # fmt: skip
    elif s.record is not None:
        yield from record_problems(case, s.record)


def record_problems(case: DrivetrainCase, record: float) -> Iterator[CaseError]:
    """What the records of a run cannot hold.

    Parameters
    ----------
    case : DrivetrainCase
    record : float
        Records a second [Hz]: as given, or what `femgear.trains.drivetrain.time` takes for it.
    """
    s, ratio = case.simulation, case.simulation.rate / record
    if ratio < 1.0 - 1e-9 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        yield CaseError(
            "a record is kept after a whole number of steps", code="E-RANGE", key="simulation.record",
            value=FREQUENCY.show(record),
            limit=f"{FREQUENCY.show(s.rate)} (simulation.rate) over a whole number",
            remedy=f"take {FREQUENCY.show(s.rate / max(1, round(ratio)))}",
        )  # fmt: skip
    # motion, velocity and torque of a body, a force and an approach of a mesh
    meshes = len(case.parallel) + sum(2 * _planets(stage) for stage in case.planetary)
    size = s.duration * record * (2 * len(case.body) + 2 * meshes + 2)
    if size > MOST_VALUES:
        yield CaseError(
            f"{size:.3g} kept numbers are too many", code="E-RANGE", key="simulation.record",
            value=FREQUENCY.show(record), limit=f"{MOST_VALUES:g} numbers",
            remedy=f"take {FREQUENCY.show(record * MOST_VALUES / size)} or less, or a shorter duration",
        )  # fmt: skip


def _planets(stage: PlanetarySection) -> int:
    return stage.planets if stage.planet_angles is None else len(stage.planet_angles)


def _size(case: DrivetrainCase) -> Iterator[CaseError]:
    """The matrices are dense."""
    stations = [max(shaft.elements - 1, 0) for shaft in case.shaft]
    planets = sum(_planets(stage) for stage in case.planetary)
    count = 5 * len(case.body) + 5 * sum(stations) + 3 * planets
    if count > MOST_COORDINATES:
        longest = stations.index(max(stations)) if any(stations) else None
        yield CaseError(
            f"{count} coordinates are too many", code="E-RANGE",
            key="body" if longest is None else f"shaft[{longest}].elements",
            limit=f"{MOST_COORDINATES}: 5 a body and a station inside a shaft, 3 a planet",
            remedy="take fewer elements",
        )  # fmt: skip


def settle_time(case: DrivetrainCase) -> float:
    """Start that the spectra leave out [s]: as given, or three tenths."""
    s = case.simulation
    return 0.3 * s.duration if s.settle is None else s.settle


def check_sizes(case: DrivetrainCase) -> Iterator[CaseError]:
    """Radii against teeth, and whether planets assemble beside one another."""
    for i, stage in enumerate(case.parallel):
        key, given = f"parallel[{i}]", given_of(stage, ("radii", "base_radii", "module"))
        if len(given) != 1:
            yield _one_of(f"{key}.{given[0] if given else 'radii'}", "radii, base_radii or module")
            continue
        radii = stage.radii or stage.base_radii
        if radii and (problem := _mismatch(radii[1] / radii[0], stage.teeth[1] / stage.teeth[0])):
            yield _unfit(f"{key}.teeth", problem)
    for i, stage in enumerate(case.planetary):
        yield from _planetary_sizes(stage, f"planetary[{i}]")


def _planetary_sizes(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    pitch = given_of(stage, ("sun_radius", "planet_radius"))
    base = given_of(stage, ("sun_base_radius", "planet_base_radius"))
    ways = [pitch, base, given_of(stage, ("module",))]
    if [len(way) for way in ways] not in ([2, 0, 0], [0, 2, 0], [0, 0, 1]):
        words = "sun_radius and planet_radius, sun_base_radius and planet_base_radius, or module"
        yield _one_of(f"{key}.{next((way[0] for way in ways if way), 'sun_radius')}", words)
    elif pitch or base:
        sun, planet = (getattr(stage, name) for name in (pitch or base))
        pairs = [("ring_teeth", 1.0 + 2.0 * planet / sun, stage.ring_teeth / stage.sun_teeth)]
        if stage.planet_teeth is not None:
            pairs.append(("planet_teeth", planet / sun, stage.planet_teeth / stage.sun_teeth))
        for name, radii, teeth in pairs:
            if problem := _mismatch(radii, teeth):
                yield _unfit(f"{key}.{name}", problem)
    elif stage.planet_teeth is not None:
        between = 0.5 * (stage.ring_teeth - stage.sun_teeth)
        if abs(stage.planet_teeth - between) > _SHIFTED:
            yield CaseError(
                "the planet has other teeth than fit between sun and ring", code="E-TEETH",
                key=f"{key}.planet_teeth", value=stage.planet_teeth,
                limit=f"{between:g}, or up to {_SHIFTED} more or less with profile shift",
            )  # fmt: skip
    if not stage.sun_teeth < stage.ring_teeth:
        yield CaseError(
            "the ring has no more teeth than the sun",
            code="E-TEETH",
            key=f"{key}.ring_teeth",
            value=stage.ring_teeth,
            limit=f"more than {stage.sun_teeth}",
        )
    yield from _assembly(stage, key)


def _assembly(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    both, angles = stage.ring_teeth + stage.sun_teeth, stage.planet_angles
    if angles is None:
        if both % stage.planets:
            yield CaseError(
                f"{stage.planets} equally spaced planets do not assemble",
                code="E-ASSEMBLY",
                key=f"{key}.planets",
                value=stage.planets,
                limit=f"a divisor of ring_teeth + sun_teeth = {both}",
            )
        yield from _neighbours(stage, key, 2.0 * math.pi / stage.planets)
        return
    if any(b <= a for a, b in pairwise(angles)) or angles[-1] - angles[0] >= 2.0 * math.pi - 1e-9:
        yield CaseError(
            "the planet angles do not ascend within one turn", code="E-RANGE", key=f"{key}.planet_angles"
        )
    yield from _neighbours(stage, key, min(b - a for a, b in pairwise((*angles, angles[0] + 2.0 * math.pi))))
    steps = [(angle - angles[0]) * both / (2.0 * math.pi) for angle in angles]
    if any(abs(step - round(step)) > 1e-3 for step in steps):
        yield CaseError(
            "the planets do not assemble at these angles",
            code="E-ASSEMBLY",
            key=f"{key}.planet_angles",
            limit=f"whole multiples of 360 deg / {both} from one another",
        )


def _neighbours(stage: PlanetarySection, key: str, apart: float) -> Iterator[CaseError]:
    """Pitch circles of neighbouring planets must not overlap; sizes by the teeth."""
    share = (stage.ring_teeth - stage.sun_teeth) / (stage.ring_teeth + stage.sun_teeth)
    if share > 0.0 and math.sin(0.5 * min(apart, math.pi)) <= share:
        most = math.degrees(2.0 * math.asin(share))
        yield CaseError(
            "neighbouring planets overlap",
            code="E-NEIGHBOURS",
            key=f"{key}.{'planets' if stage.planet_angles is None else 'planet_angles'}",
            value=f"{math.degrees(apart):.4g} deg from one to the next",
            limit=f"more than {most:.4g} deg",
            remedy="take fewer planets, or smaller ones",
        )


def given_of(section, names) -> list[str]:
    """Those of the names that a section gives."""
    return [name for name in names if getattr(section, name) is not None]


def _one_of(key: str, words: str) -> CaseError:
    return CaseError("the sizes of the gears are needed once", code="E-CHOICE", key=key, limit=words)


def _mismatch(radii: float, teeth: float) -> str:
    if abs(teeth / radii - 1.0) <= RATIO_TOLERANCE:
        return ""
    return f"the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}"


def _unfit(key: str, message: str) -> CaseError:
    return CaseError(
        message,
        code="E-TEETH",
        key=key,
        limit=f"ratios within {RATIO_TOLERANCE:.0%} of one another",
        remedy="correct the teeth or the radii, or give module in place of the radii",
    )


_CHECKS = (_bodies, _shafts, check_sizes, _torques, _simulation, _size)


def notices(case: DrivetrainCase) -> tuple[Finding, ...]:
    """Remarks on a case that was checked."""
    found = []
    for i, stage in enumerate(case.parallel):
        radii = stage.radii or stage.base_radii
        if radii:
            found.append((f"parallel[{i}]", radii[1] / radii[0], stage.teeth[1] / stage.teeth[0]))
    for i, stage in enumerate(case.planetary):
        for sun, planet in (
            (stage.sun_radius, stage.planet_radius),
            (stage.sun_base_radius, stage.planet_base_radius),
        ):
            if sun is not None and planet is not None:
                found.append(
                    (f"planetary[{i}]", 1.0 + 2.0 * planet / sun, stage.ring_teeth / stage.sun_teeth)
                )
    said = [
        Finding(
            "W-TEETH",
            f"{key}.teeth",
            f"the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}; speeds follow "
            "the radii, mesh frequencies the teeth of the first gear or of the ring",
        )
        for key, radii, teeth in found
        if abs(teeth / radii - 1.0) > _REMARK
    ]
    if not case.bearing:
        said.append(Finding("W-BEARING", "", "there is no [[bearing]]"))
    return (*said, *_open_backs(case))


def _open_backs(case: DrivetrainCase) -> Iterator[Finding]:
    """Meshes whose teeth part but find no back flank."""
    if not case.simulation.contact_loss:
        return
    meshes = [(f"parallel[{i}].mesh", one.mesh) for i, one in enumerate(case.parallel)]
    for i, one in enumerate(case.planetary):
        meshes += [(f"planetary[{i}].sun_mesh", one.sun_mesh), (f"planetary[{i}].ring_mesh", one.ring_mesh)]
    if bare := [key for key, mesh in meshes if mesh.backlash is None]:
        yield Finding(
            "W-BACKLASH",
            ", ".join(bare),
            "without backlash given there is no back side: with "
            "simulation.contact_loss these teeth part and meet no back flank",
        )
    if not meshes:
        yield Finding("W-BACKLASH", "simulation.contact_loss", "there are no meshes that could part")


def embed_torques(data: dict, name: str) -> dict[str, str]:
    """Put the points of every ``file`` of a torque in its place; see `femgear.case.tables.embed_points`."""

    def plain(table: dict) -> bool:
        return not table.keys() & {"torque", "times", "torques", "share"}

    units = {"times": "s", "torques": "N m"}
    return embed_points(data, "operation.torque", name, read=read_torques, units=units, plain=plain)


def read_torques(path: str | os.PathLike) -> dict[str, list[float]]:
    """``"times"`` [s] and ``"torques"`` [N m] of a CSV file.

    Parameters
    ----------
    path : path-like
        Text in two columns, divided by comma, semicolon or tab (with semicolon or tab the numbers may have
        decimal commas); the first line names them with their units, such as ``time [s]`` and
        ``torque [kN m]``, in either order. Empty lines and those that begin with ``#`` are skipped.

    Raises
    ------
    CaseError
        ``E-FILE``, ``E-FILE-ENC`` (see `femgear.case.text.read_text`), with the number of the line: unknown
        columns or units, numbers that are none, not finite or beyond the limits of a case file,
        decimal commas beside decimal points, times that do not ascend.
    """
    found = read_columns(path, _DIMENSIONS, least=1, most=MOST_POINTS, remedy=_COLUMNS)
    times, torques = (_column(found, key) for key in ("time", "torque"))
    for (before, after), line in zip(pairwise(times), found.lines[1:], strict=True):
        if not after > before:
            raise found.problem(
                "the times do not ascend", line, value=f"{after:g} s", limit=f"above {before:g} s",
                remedy="sort the lines by time, and keep one line of every instant",
            )  # fmt: skip
    return {"times": times, "torques": torques}


def _column(found: Columns, key: str) -> list[float]:
    """One column as the case will hold it, within the limits of a case file."""
    (low, high), dimension = _LIMITS[key], _DIMENSIONS[key]
    values = [float(f"{value:{_DIGITS}}") for value in found.values[key]]
    for value, line in zip(values, found.lines, strict=True):
        if not low <= value <= high:
            raise found.problem(
                f"{dimension.name} of {dimension.show(value)} is not plausible", line,
                value=dimension.show(value), limit=f"{dimension.show(low)} to {dimension.show(high)}",
                remedy=f"check the number, and the unit of the column {key} in the heading",
            )  # fmt: skip
    return values
