"""The sections of a case file; `femgear.case.planetary` makes the case of a planetary set of them.

Every entry has its type and its plausible window; values are SI numbers, angles radians. What no entry shows
alone is in `femgear.case.checks`.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictBool, model_validator

from femgear.case.fault_sections import FaultSection, PlanetFaultSection
from femgear.case.flank_sections import (
    Angle,
    CarrierErrors,
    Diameter,
    GearErrors,
    IndividualPlanet,
    Misalignment,
    ModificationSection,
    PinError,
    PlanetMisalignment,
    PlanetModificationSection,
    RingErrors,
)
from femgear.case.level_limits import LevelLimit, SoundLimit
from femgear.case.quantities import (
    ACCELERATION,
    ANGLE,
    DENSITY,
    FORCE,
    FOUNDATION,
    FREQUENCY,
    INERTIA,
    LENGTH,
    MASS,
    MODULUS,
    RPM,
    SPEED,
    STIFFNESS,
    STRESS,
    TORQUE,
    TORSION,
    Count,
    LengthOrFree,
    Number,
    Quantity,
    Section,
    Title,
    Values,
    at_most,
    printable_line,
)
from femgear.case.text import described
from femgear.case.tooth_measures import ToothMeasures
from femgear.errors import CaseError, GeometryError
from femgear.gears.gear_steels import Grade, Treatment, stress_limit

ROUNDING = 0.05e-6
"""What the sum of the pitch deviations may miss zero by for every tooth [m]: tenths of micrometres."""
FORMAT = 1
"""Newest format of the case file."""
LARGEST_TORQUE = 1e9
"""Largest plausible torque [N m]."""
_MANY_TEETH = "every tooth is one frame of the cyclic computation, with some 4000 unknowns"

LARGEST_HELIX = math.radians(45.0)
PressureAngle = Annotated[float, Quantity(ANGLE, math.radians(5), math.radians(45))]
Member = Literal["sun", "ring", "carrier"]
Radius = Annotated[float, Quantity(LENGTH, 1e-4, 10.0)]
TipDiameter = Annotated[float | Literal["free"], LengthOrFree(1e-4, 10.0)]
"""Of a gear; ``"free"`` is the tip that runs free of its mates."""
Mass = Annotated[float, Quantity(MASS, 1e-6, 1e6)]
LEFT_OUT: Any = Field(default_factory=lambda: math.nan)
"""Of entries that `femgear.case.estimates` fills in when a case is read: a default that no schema shows."""
Inertia = Annotated[float, Quantity(INERTIA, 1e-12, 1e8)]
Stiffness = Annotated[float, Quantity(STIFFNESS, 1.0, 1e15)]
Shift = Annotated[float, Number(-5.0, 5.0)]
Teeth = Annotated[int, Count(4, 5000)]
"""Of gears without a tooth form; `SunSection` and others say what their form allows."""
Module = Annotated[float, Quantity(LENGTH, 5e-5, 0.1)]
FaceWidth = Annotated[float, Quantity(LENGTH, 1e-4, 5.0)]
DampingRatio = Annotated[float, Number(0.0, 1.0, open_high=True)]
_OTHER_FLANKS = "give speeds above zero: a negative torque loads the other flanks"
Speed = Annotated[float, Quantity(SPEED, 1e-3 * RPM, 1e6 * RPM, remedy=_OTHER_FLANKS)]

Turning = Annotated[float, Quantity(TORSION, 0.0, 1e13)]
"""Stiffness against tilt or wind-up; 0 leaves it free."""
End = Literal["front", "back"]
"""Of the face width: the front is at z < 0."""
WIDTH_ENTRIES = {
    "sun": ("tilt_stiffness", "misalignment", "torque_end"),
    "carrier": ("tilt_stiffness", "misalignment", "wind_up_stiffness"),
    "planet": ("tilt_stiffness", "misalignment"),
}
"""Entries of the bodies that need slices over the width."""


class SetSection(Section):
    """What the gears share.

    ``centre_distance`` may be left out (the profile shifts give it), and so may the profile shift of the sun,
    of the ring or of both (they are found so that the meshes have no play). ``face_width`` is that of gears
    that give none of their own. ``backlash`` is the play of each
    mesh on the reference circles: half of it is taken from the tooth thickness of every gear. With a
    ``helix_angle``, positive for a right-handed sun, module, racks and shifts are of the normal section.
    """

    planets: Annotated[int, Count(1, 1000, remedy="usual: 3 to 6")]
    centre_distance: Annotated[float, Quantity(LENGTH, 1e-3, 10.0)] | None = None
    face_width: FaceWidth | None = None
    planet_angles: Annotated[tuple[Angle, ...], at_most(1000)] | None = None
    backlash: Annotated[float, Quantity(LENGTH, 0.0, 0.01)] = 0.0
    pin_errors: Annotated[tuple[PinError, ...], Field(max_length=1000)] = ()
    helix_angle: Annotated[float, Quantity(ANGLE, -LARGEST_HELIX, LARGEST_HELIX)] = 0.0


class RackSection(Section):
    """Basic rack, in modules; the default is ISO 53 profile C."""

    addendum: Annotated[float, Number(0.1, 3.0)] = 1.0
    dedendum: Annotated[float, Number(0.1, 3.0)] = 1.25
    root_radius: Annotated[float, Number(0.0, 1.0)] = 0.25


_YoungsModulus = Annotated[float, Quantity(MODULUS, 1e9, 1e12)]
_PoissonRatio = Annotated[
    float,
    Number(
        -1.0,
        0.5,
        open_low=True,
        open_high=True,
        note="0.5 is incompressible, beyond it no material is stable",
    ),
]
_Density = Annotated[float, Quantity(DENSITY, 100.0, 25000.0)]
_StressLimit = Annotated[float, Quantity(STRESS, 1e6, 5e9)]
_Hardness = Annotated[float, Number(10.0, 2000.0, note="HBW of normalised steel and irons, HV of all others")]


class MaterialSection(Section):
    """Isotropic elastic material of all gears; its strength, where it is known, gives safeties.

    ``root_stress_limit`` and ``contact_stress_limit`` are sigma_Flim and sigma_Hlim of ISO 6336-5; where they are left
    out they follow from ``treatment``, ``grade`` and ``hardness``. ``estimated`` tells that these are no more than a
    guess.
    """

    youngs_modulus: _YoungsModulus
    poisson_ratio: _PoissonRatio
    density: _Density
    root_stress_limit: _StressLimit | None = None
    contact_stress_limit: _StressLimit | None = None
    treatment: Treatment | None = None
    grade: Grade = "MQ"
    hardness: _Hardness | None = None
    estimated: StrictBool = False


class GearMaterialSection(Section):
    """Material of one gear: what it leaves out is that of the section ``material``."""

    youngs_modulus: _YoungsModulus | None = None
    poisson_ratio: _PoissonRatio | None = None
    density: _Density | None = None
    root_stress_limit: _StressLimit | None = None
    contact_stress_limit: _StressLimit | None = None
    treatment: Treatment | None = None
    grade: Grade | None = None
    hardness: _Hardness | None = None
    estimated: StrictBool | None = None


class StrengthSection(Section):
    """How teeth are rated by ISO 6336.

    ``quality`` is the flank tolerance class of ISO 1328-1, from which K_v, K_Halpha and K_Falpha of part 1 follow;
    ``modification`` how helical teeth are modified: by experience, or as a calculation has proven (f_ZCa). Of lives
    over load cases ``pitting`` says whether flanks may pit to a limited extent, and ``reversal_factor`` is Y_M of
    gears whose load cases load both flanks. ``required_root_safety`` and ``required_flank_safety`` are the S_F and
    S_H that designer and customer agreed on, which ISO 6336-1 leaves to them.
    """

    edition: Literal[2006, 2019] = 2019
    application_factor: Annotated[float, Number(0.1, 10.0)] = 1.0
    quality: Annotated[int, Count(1, 11)] | None = None
    modification: Literal["none", "experience", "proven"] | None = None
    pitting: Literal["none", "limited"] = "none"
    reversal_factor: Annotated[float, Number(0.1, 1.0)] = 0.7
    required_root_safety: Annotated[float, Number(0.1, 100.0)] = 1.0
    required_flank_safety: Annotated[float, Number(0.1, 100.0)] = 1.0


class ShaftPartSection(Section):
    """One part of a stepped shaft of the material of its member."""

    length: Annotated[float, Quantity(LENGTH, 1e-4, 10.0)]
    outer_diameter: Annotated[float, Quantity(LENGTH, 1e-4, 5.0)]
    inner_diameter: Annotated[float, Quantity(LENGTH, 0.0, 5.0)] = 0.0


_Shaft = Annotated[tuple[ShaftPartSection, ...], Field(max_length=50)]


class SunSection(ToothMeasures):
    """The sun, and with it the module and the pressure angle of the set."""

    teeth: Annotated[int, Count(5, 5000, note=_MANY_TEETH)]
    module: Module
    pressure_angle: PressureAngle
    profile_shift: Shift | None = None
    bore_radius: Radius
    face_width: FaceWidth | None = None
    material: GearMaterialSection | None = None
    mass: Mass = LEFT_OUT
    inertia: Inertia = LEFT_OUT
    support_stiffness: Annotated[float, Quantity(STIFFNESS, 0.0, 1e15)] | None = None
    support_shaft: _Shaft = ()
    tilt_stiffness: Turning | None = None
    misalignment: Misalignment | None = None
    torque_end: End | None = None
    torsion_diameter: Diameter | None = None
    tip_diameter: TipDiameter | None = None
    root_diameter: Radius | None = None
    rack: RackSection | None = None
    modifications: Annotated[tuple[ModificationSection, ...], Field(max_length=20)] = ()
    errors: GearErrors | None = None
    fault: Annotated[tuple[FaultSection, ...], Field(max_length=100)] = ()


class PlanetSection(ToothMeasures):
    """One of the equal planets; a dynamic rating of its bearing gives that a life over load cases, its pitch diameter
    losses."""

    teeth: Annotated[int, Count(5, 5000, note=_MANY_TEETH)]
    profile_shift: Shift = 0.0
    bore_radius: Radius
    face_width: FaceWidth | None = None
    material: GearMaterialSection | None = None
    mass: Mass = LEFT_OUT
    inertia: Inertia = LEFT_OUT
    bearing_stiffness: Stiffness = LEFT_OUT
    bearing_clearance: Annotated[float, Quantity(LENGTH, 0.0, 0.002)] = 0.0
    dynamic_rating: Annotated[float, Quantity(FORCE, 1.0, 1e9)] | None = None
    bearing_kind: Literal["ball", "roller", "needle"] = "roller"
    bearing_pitch_diameter: Diameter | None = None
    tilt_stiffness: Turning | None = None
    misalignment: Annotated[tuple[PlanetMisalignment, ...], Field(max_length=1000)] = ()
    tip_diameter: TipDiameter | None = None
    root_diameter: Radius | None = None
    rack: RackSection | None = None
    modifications: Annotated[tuple[PlanetModificationSection, ...], Field(max_length=20)] = ()
    errors: GearErrors | None = None
    fault: Annotated[tuple[PlanetFaultSection, ...], Field(max_length=100)] = ()
    individual: Annotated[tuple[IndividualPlanet, ...], Field(max_length=1000)] = ()


class RingSection(ToothMeasures):
    """The internal gear; a positive profile shift moves its flanks outwards, to larger radii."""

    teeth: Annotated[int, Count(10, 5000, note=_MANY_TEETH, signed=True)]
    profile_shift: Shift | None = None
    outer_radius: Radius
    face_width: FaceWidth | None = None
    material: GearMaterialSection | None = None
    cutter_teeth: Annotated[int, Count(5, 1000)] | None = None
    cutter_profile_shift: Shift = 0.0
    foundation_radial: Annotated[float, Quantity(FOUNDATION, 0.0, 1e20)] = LEFT_OUT
    foundation_tangential: Annotated[float, Quantity(FOUNDATION, 0.0, 1e20)] = LEFT_OUT
    tip_diameter: TipDiameter | None = None
    root_diameter: Radius | None = None
    rack: RackSection | None = None
    modifications: Annotated[tuple[ModificationSection, ...], Field(max_length=20)] = ()
    errors: RingErrors | None = None
    fault: Annotated[tuple[FaultSection, ...], Field(max_length=100)] = ()


class CarrierSection(Section):
    """The rigid carrier, without its planets."""

    mass: Mass = LEFT_OUT
    inertia: Inertia = LEFT_OUT
    support_stiffness: Annotated[float, Quantity(STIFFNESS, 0.0, 1e15)] | None = None
    support_shaft: _Shaft = ()
    tilt_stiffness: Turning | None = None
    misalignment: Misalignment | None = None
    wind_up_stiffness: Annotated[float, Quantity(TORSION, 1.0, 1e13)] | None = None
    torque_end: End | None = None
    errors: CarrierErrors | None = None


class MachineSection(Section):
    """A rotor behind a torsional coupling; without it the member turns freely under its torque."""

    inertia: Inertia
    coupling_stiffness: Annotated[float, Quantity(TORSION, 1e-3, 1e15)]


def speed_range(value: object) -> object:
    """List of speeds of a table ``{from, to, count}``, equally spaced."""
    if not isinstance(value, dict):
        if not isinstance(value, list) or not value:
            message = f"a list of speeds is needed, not {'an empty one' if value == [] else described(value)}"
            example = f'["{value}"]' if isinstance(value, str) and value[:1].isdigit() else '["250 rpm", "3100 rpm"]'
            raise CaseError(message, code="E-TYPE", value=value, remedy=f"write {example}")
        return value
    if value.keys() != {"from", "to", "count"}:
        raise CaseError(
            f"a range of speeds with {', '.join(map(repr, value)) or 'nothing'}",
            code="E-KEY-MISSING",
            limit="from, to and count",
            remedy='write {from = "250 rpm", to = "3100 rpm", count = 12}',
        )
    ends = _SpeedRange.model_validate(value)
    step = (ends.to - ends.start) / (ends.count - 1)
    return [f"{ends.start + i * step!r} rad/s" for i in range(ends.count)]


class _SpeedRange(Section):
    """Equally spaced speeds, both ends among them."""

    start: Speed = Field(alias="from")
    to: Speed
    count: Annotated[int, Count(2, 100_000, remedy="take fewer; a single speed stands in a list")]


Share = Annotated[float, Number(0.0, 1.0, open_low=True)]
Hours = Annotated[float, Number(0.0, 1e7, open_low=True, note="a number of hours")]
MOST_LOAD_CASES = 1000


class SpectrumLoadSection(Section):
    """One load case of a load spectrum: torque and speed as those of the operation, and its part of the life.

    A negative torque loads the other flanks. Parts are shares of the running time, or hours, in all load cases.
    """

    name: Annotated[str, BeforeValidator(partial(printable_line, name="name", least=1, most=60))] | None = None
    torque: Annotated[float, Quantity(TORQUE, -LARGEST_TORQUE, LARGEST_TORQUE)]
    speed: Speed
    share: Share = 1.0
    hours: Hours | None = None


LoadSpectrum = Annotated[tuple[SpectrumLoadSection, ...], Field(max_length=MOST_LOAD_CASES)]


class OperationSection(Section):
    """Torque and speeds of the input member; a negative torque loads the other flanks.

    Load cases are those of the life, which ``required_hours`` asks for.
    """

    input: Member
    fixed: Member
    torque: Annotated[float, Quantity(TORQUE, -LARGEST_TORQUE, LARGEST_TORQUE)]
    speeds: Annotated[tuple[Speed, ...], Values(max_length=100_000), BeforeValidator(speed_range)]
    load_case: LoadSpectrum = ()
    required_hours: Hours | None = None


class StaticSection(Section):
    """Positions over one mesh period, contact search and grid."""

    positions: Annotated[int, Count(8, 4096)] = 64
    peaks: StrictBool = True
    contact: Literal["profile", "line_of_action"] = "profile"
    flank_elements: Annotated[int, Count(4, 200)] = 24
    members: Literal["fixed", "elastic"] = "fixed"
    back_flanks: StrictBool = False
    stresses: StrictBool = True
    longest_record: Annotated[int, Count(1, 4096)] = 256
    depth: Annotated[float, Quantity(LENGTH, 1e-6, 0.1)] | None = None
    slices: Annotated[int, Count(0, 200)] = 0


class DynamicsSection(Section):
    """Modal damping, reach of the excitation and tolerance of the periodic solution.

    The excitation of a set with an elastic ring ends at the frequency ``up_to``, or after ``mesh_harmonics``;
    where neither is given it reaches so far that the level of the housing no longer changes.
    """

    damping_ratio: DampingRatio = 0.05
    up_to: Annotated[float, Quantity(FREQUENCY, 10.0, 200e3)] | None = None
    mesh_harmonics: Annotated[int, Count(1, 512)] | None = None
    response_harmonics: Annotated[int, Count(1, 1000)] | None = None
    tolerance: Annotated[float, Number(1e-12, 1e-2)] = 1e-6


class RunupSection(Section):
    """Speeds over which mesh forces and sensor are followed; `count` 0 leaves the run-up out.

    Without ends it reaches from 0.8 times the lowest operating speed, or a quarter of the highest if that is
    less, to 1.25 times the highest.
    """

    start: Speed | None = Field(default=None, alias="from")
    to: Speed | None = None
    count: Annotated[int, Count(0, 20_000)] = 400


class PublishedLines(Section):
    """Lines and lobes around a mesh harmonic that somebody published; the report compares them."""

    speed: Speed
    harmonic: Annotated[int, Count(1, 1000)]
    orders: Annotated[tuple[Annotated[int, Count(0, 10_000_000)], ...], Values(min_length=1, max_length=20)]
    lobes: Annotated[int, Count(0, 10_000)] | None = None
    source: Title


class MeasuredSection(Section):
    """Lines that a recording holds at a speed: orders of the carrier and peak accelerations; the report shows them."""

    speed: Speed
    orders: Annotated[
        tuple[Annotated[float, Number(0.0, 1e7, open_low=True)], ...], Values(min_length=1, max_length=5000)
    ]
    accelerations: Annotated[
        tuple[Annotated[float, Quantity(ACCELERATION, 0.0, 1e9)], ...], Values(min_length=1, max_length=5000)
    ]
    source: Title

    @model_validator(mode="after")
    def _as_many(self):
        if len(self.orders) != len(self.accelerations):
            message, value = "orders and accelerations belong together", (len(self.orders), len(self.accelerations))
            raise CaseError(message, code="E-COUNT", value=value, limit="as many of both")
        return self


class MicrophoneSection(Section):
    """Where sound is heard: distance from the outer surface of the ring, and angle, that of the sensor.

    ``level_limit`` is the largest sound pressure level allowed at speeds of operation [dB(A)].
    """

    distance: Annotated[float, Quantity(LENGTH, 1e-3, 1000.0)] = 1.0
    angle: Angle | None = None
    level_limit: SoundLimit = ()


class SupportSection(Section):
    """A bolt, foot or lug at the outer surface of the ring: springs to the ground, a mass that moves along.

    Stiffness and mass are spread evenly over the ``width`` along the circumference.
    """

    angle: Angle
    radial_stiffness: Annotated[float, Quantity(STIFFNESS, 0.0, 1e15)]
    tangential_stiffness: Annotated[float, Quantity(STIFFNESS, 0.0, 1e15)]
    mass: Annotated[float, Quantity(MASS, 0.0, 1e6)] = 0.0
    width: Annotated[float, Quantity(LENGTH, 0.0, 60.0)] = 0.0


def _turned(value: object) -> object:
    """Angle from outwards, counter-clockwise, of a direction in words."""
    return {"radial": "0 deg", "tangential": "90 deg"}.get(value, value) if isinstance(value, str) else value


class SensorSection(Section):
    """A sensor on the outer surface of the ring, which feels its motion in a direction.

    ``direction`` is "radial", "tangential", or an angle from outwards, counter-clockwise. Over its ``width`` around
    the ring it feels the mean, as an accelerometer on its base does.
    """

    name: Title
    angle: Angle
    direction: Annotated[Angle, BeforeValidator(_turned)] = 0.0
    width: Annotated[float, Quantity(LENGTH, 0.0, 60.0)] = 0.0


class StructureSection(Section):
    """A casing that somebody else has meshed, the ring gear being part of it, read by `read_casing`.

    ``sha256`` is that of file and table of nodes: results belong to what these hold. Reading fills it in.
    """

    file: Annotated[str, Field(max_length=1000)]
    nodes: Annotated[str, Field(max_length=1000)] | None = None
    units: Literal["SI", "mm-t-s"] = "SI"
    damping_ratio: DampingRatio | None = None
    max_frequency: Annotated[float, Quantity(FREQUENCY, 10.0, 1e6)] | None = None
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None


class HousingSection(Section):
    """The fixed sensor, how the ring's field is carried to it, and the microphone.

    With supports or a structure ring and casing stand still without symmetry: ``nodal_diameters`` of the ring
    act both ways.

    ``form = "exact"`` hears every circumferential component at its own order; ``"linear"`` is the
    interpolation between ``points`` points of the paper on carrier modulation, with its images. With ``assumptions``
    a run solves again with half and twice of what nobody knows before the gearbox is built. ``level_limit`` is the
    largest acceleration allowed at the sensor.
    """

    form: Literal["exact", "linear"] = "exact"
    points: Annotated[int, Count(3, 100_000)] = 54
    assumptions: bool = False
    sensor_angle: Angle = 0.0
    level_limit: LevelLimit = ()
    microphone: MicrophoneSection = MicrophoneSection()
    published: Annotated[tuple[PublishedLines, ...], Field(max_length=100)] = ()
    measured: Annotated[tuple[MeasuredSection, ...], Field(max_length=100)] = ()
    support: Annotated[tuple[SupportSection, ...], Field(max_length=200)] = ()
    sensor: Annotated[tuple[SensorSection, ...], Field(max_length=100)] = ()
    structure: StructureSection | None = None
    nodal_diameters: Annotated[int, Count(2, 26)] | None = None

    @model_validator(mode="after")
    def _one_structure(self):
        if self.support and self.structure:
            message, remedy = "a casing holds its ring itself", "leave support or structure out"
            raise CaseError(message, code="E-CHOICE", remedy=remedy)
        if self.sensor and self.structure:
            message, remedy = "a casing has the sensors of its table of nodes", "leave housing.sensor out"
            raise CaseError(message, code="E-CHOICE", remedy=remedy)
        if len({sensor.name for sensor in self.sensor}) < len(self.sensor):
            message, remedy = "two sensors have one name", "give each a name of its own"
            raise CaseError(message, code="E-DUPLICATE", remedy=remedy)
        return self

    @property
    def stands_still(self) -> bool:
        """Whether ring and casing are a structure fixed in space, on supports or of a file."""
        return bool(self.support) or self.structure is not None


class MeshStiffnessSection(Section):
    """Constant stiffness of every mesh, in place of the static solution's."""

    sun_planet: Annotated[float, Quantity(STIFFNESS, 1e3, 1e13)]
    planet_ring: Annotated[float, Quantity(STIFFNESS, 1e3, 1e13)]


def face_width(case: Any, gear: str) -> float:
    """Find the face width of a gear of a case [m], its own or that of the section ``set``.

    CaseError: E-KEY-MISSING: neither is given.
    """
    width = getattr(case, gear).face_width or case.set.face_width
    if width is None:
        raise CaseError(
            f"the face width of the {gear.replace('_', ' ')} is missing",
            code="E-KEY-MISSING",
            key="set.face_width",
            remedy=f"give set.face_width, or {gear}.face_width and that of all others",
        )
    return width


def gear_material(case: Any, gear: str) -> MaterialSection:
    """Find the material of a gear of a case: its own entries, and for others those of ``material``.

    Limits that are left out are those of treatment, grade and hardness, where there is a treatment. A gear with a
    treatment, grade or hardness of its own does not take the limits of ``material``.

    CaseError: a treatment without a hardness (E-KEY-MISSING), or with one that ISO 6336-5 does not have (E-RANGE).
    """
    section = getattr(case, gear).material
    given = {} if section is None else section.model_dump(exclude_none=True)
    material = case.material.model_copy(update=given)
    if material.treatment is None:
        return material
    own_treatment = any(name in given for name in ("treatment", "grade", "hardness"))
    limits: dict[str, Any] = {}
    if own_treatment:
        limits["estimated"] = bool(given.get("estimated"))
    for kind in ("root", "contact"):
        name = f"{kind}_stress_limit"
        if name in given or (not own_treatment and getattr(material, name) is not None):
            continue
        limits[name] = _limit_of_treatment(case, gear, material, kind)
    return material.model_copy(update=limits)


def _limit_of_treatment(case: Any, gear: str, material: MaterialSection, kind: Literal["contact", "root"]) -> float:
    """Limit of a treatment [Pa], refused in terms of the case."""
    section = getattr(case, gear).material
    of_gear = section is not None and (section.treatment is not None or section.hardness is not None)
    key = f"{gear}.material.hardness" if of_gear else "material.hardness"
    if material.treatment is None or material.hardness is None:
        raise CaseError(
            f"{material.treatment} has limits by its hardness, which is missing",
            code="E-KEY-MISSING",
            key=key,
            file=case.location("material.treatment"),
            remedy="give hardness = 700, in HV, or in HBW of normalised steel and irons",
        )
    try:
        return stress_limit(material.treatment, material.grade, material.hardness, kind)
    except GeometryError as error:
        raise CaseError(
            error.message,
            code="E-RANGE",
            key=key,
            file=case.location(key),
            value=material.hardness,
            limit=error.limit,
            remedy=error.remedy,
        ) from None
