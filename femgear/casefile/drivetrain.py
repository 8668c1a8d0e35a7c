"""The sections of a case file with ``model = "drivetrain"``: bodies, and what joins and drives them."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StrictBool,
    ValidationInfo,
    field_validator,
)

from femgear.casefile.fields import Count, Number, Quantity, Title, described, refuse
from femgear.casefile.origin import ReadCase
from femgear.casefile.units import (
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
    Dimension,
)

MODEL = "drivetrain"
FORMAT = 1
MOST_PARTS = 200
MOST_POINTS = 20_000
LARGEST_TORQUE, LATEST, FASTEST_RATE = 1e9, 1e6, 1e7
RIGID = "rigid"
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_ -]{0,39}")


def _name(value: object) -> str:
    if not isinstance(value, str):
        raise refuse(f"a name is needed, not {described(value)}", code="E-TYPE", value=value)
    if not _NAME.fullmatch(value) or value != value.strip() or re.match(r"(planet|shaft)\b", value):
        raise refuse(
            "not a name for a body",
            code="E-NAME",
            value=value,
            limit="40 letters, digits, blanks, - or _; planet and shaft are taken as first words",
        )
    return value


def _reference(value: object) -> str:
    if not isinstance(value, str):
        raise refuse(f"the name of a body is needed, not {described(value)}", code="E-TYPE", value=value)
    return value


def Stiffness(dimension: Dimension, low: float, high: float) -> Any:
    """Type of a stiffness that may be the text ``"rigid"``, infinite in the model."""
    convert = Quantity(dimension, low, high).__metadata__[0].func

    def rigid_too(value: object) -> float:
        return math.inf if value == RIGID else convert(value)

    schema = Field(json_schema_extra={"type": "string", "description": f'{dimension.name}, or "{RIGID}"'})
    return Annotated[float, BeforeValidator(rigid_too), schema]


Name = Annotated[str, BeforeValidator(_name)]
Reference = Annotated[str, BeforeValidator(_reference)]
Mass = Quantity(MASS, 1e-6, 1e8)
Inertia = Quantity(INERTIA, 1e-12, 1e11)
Radius = Quantity(LENGTH, 1e-4, 100.0)
Length = Quantity(LENGTH, 1e-4, 1e3)
Offset = Quantity(LENGTH, -100.0, 100.0)
Angle = Quantity(ANGLE, -2 * math.pi, 2 * math.pi)
PressureAngle = Quantity(ANGLE, math.radians(5), math.radians(45))
Teeth = Count(4, 5000)
Joint = Stiffness(TORSION, 1e-3, 1e15)
Torque = Quantity(TORQUE, -LARGEST_TORQUE, LARGEST_TORQUE)
Time = Quantity(TIME, 0.0, LATEST)
Frequency = Quantity(FREQUENCY, 1e-3, 1e7)


def _two(value: object) -> object:
    if not isinstance(value, list) or len(value) != 2:
        what = f"{len(value)} entries" if isinstance(value, list) else described(value)
        raise refuse(
            f"two entries are needed, not {what}",
            code="E-COUNT",
            limit="a list of two: for the first and for the second body",
        )
    return value


def Pair(kind: Any) -> Any:
    """Type of two entries, of the first and the second body."""
    return Annotated[tuple[kind, ...], BeforeValidator(_two)]


def _driver(value: str | None, ends) -> str | None:
    """The driver of a stage; where the ends themselves are wrong, they alone are refused."""
    if value is not None and len(ends) == 2 and value not in ends:
        raise refuse(
            "the driver is none of the two bodies of its stage", code="E-BODY", value=value,
            limit=" or ".join(ends),
        )  # fmt: skip
    return value


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class BodySection(_Section):
    """A rigid body on its axis; the first body gives the speed."""

    name: Name
    inertia: Inertia
    mass: Mass
    transverse_inertia: Quantity(INERTIA, 0.0, 1e11) = 0.0
    tilts: StrictBool = True


class ShaftSection(_Section):
    """A shaft between two bodies: springs of its joint, or a round section."""

    between: Pair(Reference)
    length: Length
    bending: Joint | None = None
    torsion: Joint | None = None
    shear: Stiffness(STIFFNESS, 1.0, 1e15) | None = None
    shear_ratio: Number(0.0, 100.0) = 0.0
    outer_diameter: Radius | None = None
    inner_diameter: Quantity(LENGTH, 0.0, 100.0) = 0.0
    youngs_modulus: Quantity(MODULUS, 1e6, 1e12) = 2.06e11
    poisson_ratio: Number(0.0, 0.5, open_high=True) = 0.3
    density: Quantity(DENSITY, 0.0, 25000.0) = 7850.0
    elements: Count(0, 100) = 0


class MeshSection(_Section):
    """Rectangular mesh stiffness by the number of tooth pairs in contact."""

    stiffness: Quantity(STIFFNESS, 1e3, 1e13)
    contact_ratio: Number(1.0, 20.0)
    low_share: Number(0.0, 1.0, open_low=True) | None = None
    phase: Number(-1000.0, 1000.0) = 0.0
    backlash: Quantity(LENGTH, 0.0, 0.05) | None = None


class ParallelSection(_Section):
    """Two external gears; sizes by pitch radii, base radii, or the transverse module."""

    between: Pair(Reference)
    teeth: Pair(Teeth)
    radii: Pair(Radius) | None = None
    base_radii: Pair(Radius) | None = None
    module: Quantity(LENGTH, 5e-5, 0.5) | None = None
    mesh: MeshSection
    pressure_angle: PressureAngle = math.radians(20.0)
    helix_angle: Quantity(ANGLE, -math.radians(60), math.radians(60)) = 0.0
    direction: Angle = 0.0
    offsets: Pair(Offset) = (0.0, 0.0)
    driver: Reference | None = None

    @field_validator("driver")
    @classmethod
    def _one_of_two(cls, value, info: ValidationInfo):
        return _driver(value, info.data.get("between", ()))


class PlanetarySection(_Section):
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
    module: Quantity(LENGTH, 5e-5, 0.5) | None = None
    planets: Count(1, 24) = 3
    planet_angles: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=24)] | None = None
    planet_mass: Mass
    planet_inertia: Inertia
    planet_transverse_inertia: Quantity(INERTIA, 0.0, 1e11) = 0.0
    planet_bearing: Stiffness(STIFFNESS, 1.0, 1e15) = math.inf
    sun_mesh: MeshSection
    ring_mesh: MeshSection
    pressure_angle: PressureAngle = math.radians(20.0)
    driver: Reference | None = None

    @field_validator("driver")
    @classmethod
    def _one_of_two(cls, value, info: ValidationInfo):
        return _driver(value, [info.data[key] for key in ("carrier", "sun") if key in info.data])


class BearingSection(_Section):
    """Bearing in the housing, of a body or of a station inside a shaft of several elements."""

    body: Reference | None = None
    shaft: Pair(Reference) | None = None
    station: Count(1, 99) | None = None
    radial: Stiffness(STIFFNESS, 0.0, 1e15) = 0.0
    tilt: Stiffness(TORSION, 0.0, 1e15) = 0.0
    offset: Offset = 0.0


class GravitySection(_Section):
    """Weight of all bodies along -y."""

    acceleration: Quantity(ACCELERATION, 0.0, 1e3) = 9.80665


class TorqueSection(_Section):
    """Torque on a body: constant, a series, or a share of what balances the others."""

    body: Reference
    torque: Torque | None = None
    file: Title | None = None
    times: Annotated[tuple[Time, ...], Field(min_length=1, max_length=MOST_POINTS)] | None = None
    torques: Annotated[tuple[Torque, ...], Field(min_length=1, max_length=MOST_POINTS)] | None = None
    share: Number(0.0, 10.0) | None = None


class OperationSection(_Section):
    """Speed of the first body at the start, and the torques."""

    speed: Quantity(SPEED, 1e-3 * SPEED.scale, 1e6 * SPEED.scale)
    torque: Annotated[tuple[TorqueSection, ...], Field(max_length=MOST_PARTS)] = ()


class SimulationSection(_Section):
    """Integration in time, what is kept of it, and its spectra."""

    duration: Quantity(TIME, 1e-3, 1e5)
    rate: Quantity(FREQUENCY, 10.0, FASTEST_RATE) = 20_000.0
    record: Quantity(FREQUENCY, 1.0, FASTEST_RATE) | None = None
    start: Literal["static", "zero"] = "static"
    harmonics: Count(1, 200) = 15
    damping_ratio: Number(0.0, 1.0, open_high=True) = 0.0
    turning: StrictBool = True
    torsional: StrictBool = False
    contact_loss: StrictBool = False
    modes: Count(0, 24) = 4
    settle: Time | None = None
    resolution: Frequency | None = None


class DrivetrainCase(_Section, ReadCase):
    """A chain of bodies, its operation and how to integrate it, in SI units.

    The fields carry the names of the case file; ``source`` is the text that gives this case, ``notices`` what
    deserves to be said.
    """

    # sections of planetary sets, which code for all kinds of cases asks for
    planar: ClassVar[None] = None
    helical: ClassVar[None] = None

    format: Count(1, 2**31) = FORMAT
    model: Literal[MODEL]
    title: Title
    body: Annotated[tuple[BodySection, ...], Field(min_length=1, max_length=MOST_PARTS)]
    shaft: Annotated[tuple[ShaftSection, ...], Field(max_length=MOST_PARTS)] = ()
    parallel: Annotated[tuple[ParallelSection, ...], Field(max_length=MOST_PARTS)] = ()
    planetary: Annotated[tuple[PlanetarySection, ...], Field(max_length=20)] = ()
    bearing: Annotated[tuple[BearingSection, ...], Field(max_length=MOST_PARTS)] = ()
    gravity: GravitySection | None = None
    operation: OperationSection
    simulation: SimulationSection
