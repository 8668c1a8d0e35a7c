"""The case file with ``model = "gearbox"``: shafts, bearings, stages, loads, and what it refuses.

All axes are parallel to z. Positions on a shaft count from its left end, the one with the smaller z. Teeth of a
stage are the tables of a pair or of a planetary set, in this file or in one that it names; their loads and speeds
are those of the gearbox. What no entry shows alone is in `femgear.trains.gearbox.checks`.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np
from pydantic import BeforeValidator, Field, StrictBool, WithJsonSchema, model_validator

from femgear.case import text as case_text
from femgear.case.csv_columns import add_checksum, embed_profiles, embedded
from femgear.case.flank_sections import Deviation
from femgear.case.level_limits import LevelLimit
from femgear.case.lubrication import LossesSection, LubricantSection
from femgear.case.quantities import (
    ACCELERATION,
    ANGLE,
    DENSITY,
    FORCE,
    FREQUENCY,
    INERTIA,
    LENGTH,
    MASS,
    MODULUS,
    PAIR,
    SPEED,
    STIFFNESS,
    TORQUE,
    TORSION,
    TRIPLE,
    Count,
    Dimension,
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
    DampingRatio,
    End,
    Hours,
    PressureAngle,
    Radius,
    RunupSection,
    Share,
    StrengthSection,
    Teeth,
)
from femgear.case.text import ReadCase, described
from femgear.errors import CaseError
from femgear.remembered import remembered
from femgear.trains.gearbox.materials import with_materials
from femgear.trains.gearbox.transient_case import TransientSection, embed_torques
from femgear.trains.reading import parse_case

RISE = Dimension("a temperature difference", "K", "K", 1.0)
EXPANSION = Dimension("a thermal expansion", "1/K", "1/K", 1.0)
CASING = "casing"
"""In place of a shaft: the casing, which stands still unless the case describes it."""
MOST_PARTS = 200
DIRECTION_VECTORS = {
    f"{'-' * (sign < 0)}{axis}": tuple(sign * (axis == other) for other in "xyz")
    for axis in "xyz"
    for sign in (1.0, -1.0)
}
"""Unit vectors of the words for directions along the axes."""
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_ .-]{0,39}")
_LARGEST_TORQUE, _LARGEST_FORCE = 1e9, 1e9


def _name(value: object) -> str:
    if not isinstance(value, str):
        message = f"a name is needed, not {described(value)}"
        raise CaseError(message, code="E-TYPE", value=value, remedy="write it in quotation marks")
    if not _NAME.fullmatch(value) or value != value.strip():
        limit = "40 letters a to z or A to Z, digits, blanks, dots, - or _"
        raise CaseError("not a name for a part", code="E-CHOICE", value=value, limit=limit)
    return value


def _tables(value: object) -> object:
    if not isinstance(value, dict):
        what = f"the tables of a case are needed, not {described(value)}"
        raise CaseError(what, code="E-TYPE", value=value, remedy='name its file, as in "stage.toml"')
    return value


def _axis_vector(value: object) -> object:
    """Vector of an axis in a word, x, y or z, which a minus sign may turn round."""
    if isinstance(value, str) and value not in DIRECTION_VECTORS:
        raise CaseError(
            "there is no such direction",
            code="E-CHOICE",
            value=value,
            limit=f"{', '.join(DIRECTION_VECTORS)}, or a vector of three numbers",
            remedy='write direction = "y", or direction = [0.0, 1.0, 0.0]',
        )
    return DIRECTION_VECTORS[value] if isinstance(value, str) else value


Name = Annotated[str, BeforeValidator(_name)]
Along = Annotated[float, Quantity(LENGTH, -100.0, 100.0)]
"""A coordinate."""
Length = Annotated[float, Quantity(LENGTH, 1e-6, 100.0)]
Outer = Annotated[float, Quantity(LENGTH, 1e-4, 20.0)]
Inner = Annotated[float, Quantity(LENGTH, 0.0, 20.0)]
PartMass = Annotated[float, Quantity(MASS, 1e-9, 1e8)]
PartInertia = Annotated[float, Quantity(INERTIA, 1e-15, 1e11)]
Transverse = Annotated[float, Quantity(INERTIA, 0.0, 1e11)]
Lateral = Annotated[float, StiffnessOrRigid(STIFFNESS, 0.0, 1e15)]
Turning = Annotated[float, StiffnessOrRigid(TORSION, 0.0, 1e15)]
Product = Annotated[float, Quantity(INERTIA, -1e11, 1e11)]
MeshStiffness = Annotated[float, Quantity(STIFFNESS, 1e3, 1e13)]
Torque = Annotated[float, Quantity(TORQUE, -_LARGEST_TORQUE, _LARGEST_TORQUE)]
Turned = Annotated[float, Quantity(ANGLE, -0.1, 0.1)]
Rise = Annotated[float, Quantity(RISE, -300.0, 1000.0)]
"""Of the temperature in operation over that at which the gearbox was put together."""
Expansion = Annotated[float, Quantity(EXPANSION, -1e-4, 1e-3)]
Force = Annotated[float, Quantity(FORCE, -_LARGEST_FORCE, _LARGEST_FORCE)]
ShaftSpeed = Annotated[float, Quantity(SPEED, -1e6 * SPEED.scale, 1e6 * SPEED.scale)]
Entry = Annotated[float, Number(-1e30, 1e30)]
Entries = Annotated[tuple[Entry, ...], Values(max_length=100_000)]
SensorDirection = Annotated[
    tuple[Annotated[float, Number(-1.0, 1.0)], ...], TRIPLE, WithJsonSchema({"type": ["string", "array"]})
]
"""A vector; x, y, z or one of these after a minus sign are read as one."""
StageTables = Annotated[dict[str, Any], BeforeValidator(_tables), WithJsonSchema({"type": ["string", "object"]})]
"""Tables of a pair or of a planetary set, or of the name of a file, in whose place they stand when it was read."""


class ShaftMaterialSection(Section):
    """Material of shafts, by default steel."""

    youngs_modulus: Annotated[float, Quantity(MODULUS, 1e6, 1e12)] = 2.06e11
    poisson_ratio: Annotated[float, Number(0.0, 0.5, open_high=True)] = 0.3
    density: Annotated[float, Quantity(DENSITY, 0.0, 25000.0)] = 7850.0
    thermal_expansion: Expansion = 1.15e-5


class BoxShaftPartSection(Section):
    """A cylindrical or conical part of a shaft, from left to right.

    The end diameters are those at its right end, where they are others than at its left one.
    """

    length: Length
    outer_diameter: Outer
    inner_diameter: Inner = 0.0
    end_outer_diameter: Outer | None = None
    end_inner_diameter: Inner | None = None

    @property
    def bore_at_end(self) -> float:
        """Inner diameter at the right end [m]."""
        return self.inner_diameter if self.end_inner_diameter is None else self.end_inner_diameter


class PlanetPinErrorSection(Section):
    """How far the pin of a planet stands off its place: radial outwards, tangential counter-clockwise positive."""

    radial: Deviation = 0.0
    tangential: Deviation = 0.0


class BoxShaftSection(Section):
    """A shaft: an axis, and parts from its left end on; without parts it is one rigid body.

    ``axis`` are x and y of its axis, ``start`` is z of its left end, of a body that of its centre. A planet may have a
    ``pin_error``.
    """

    name: Name
    axis: Annotated[tuple[Along, ...], PAIR] = (0.0, 0.0)
    start: Along = 0.0
    part: Annotated[tuple[BoxShaftPartSection, ...], Field(max_length=MOST_PARTS)] = ()
    material: ShaftMaterialSection | None = None
    temperature_rise: Rise = 0.0
    longest_element: Length | None = None
    """Of finite elements; by default a sixteenth of the shaft."""
    pin_error: PlanetPinErrorSection | None = None
    gears_timed: StrictBool = False
    """Of a planet: its gears are put on their shaft for its place, in place of planets that are all alike."""

    @property
    def length(self) -> float:
        """Length of all parts [m]; zero of a rigid body."""
        return sum(part.length for part in self.part)

    @property
    def places(self) -> tuple[float, ...]:
        """Ends of the parts from the left end [m]."""
        ends_of_parts = [0.0]
        for part in self.part:
            ends_of_parts.append(ends_of_parts[-1] + part.length)
        return tuple(ends_of_parts)


class SeatSection(Section):
    """A place on a shaft: ``position`` from its left end; from the centre of one rigid body, there by default."""

    shaft: Name
    position: Along | None = None


class MassSection(SeatSection):
    """A rigid mass on a shaft, such as a coupling half, a motor or a gear of given inertia.

    ``transverse_inertia`` is that about a diameter; without it half of ``inertia``, that of a flat disc.
    """

    name: Name | None = None
    mass: PartMass
    inertia: PartInertia
    transverse_inertia: Transverse | None = None

    @property
    def about_diameter(self) -> float:
        """Inertia about a diameter [kg m^2]: as given, or that of a flat disc."""
        return 0.5 * self.inertia if self.transverse_inertia is None else self.transverse_inertia


class BoxBearingSection(SeatSection):
    """A bearing of a shaft in the casing, or in another shaft: by its stiffnesses, or by its geometry.

    Stiffnesses may be ``"rigid"``; those left out are zero. A bearing of a ``kind`` has rolling elements, whose
    stiffness follows the load; ``contact_angle`` above zero takes thrust on the shaft towards +z, below zero
    towards -z. With an ``axial_sense`` it takes thrust on the shaft that way alone, with "none" of it nothing: a ring
    slides in its seat. ``clearance`` is the radial play, the whole way between the rings; beyond it a bearing without
    ``kind`` is a ring of one-sided springs, together of its radial stiffness. ``preload`` is the axial approach of the
    rings. The ratings are those of the catalogue. ``load_friction`` and ``lubricant_friction`` are f_1 and f_0 of
    Palmgren's friction torque.
    """

    name: Name | None = None
    outer_shaft: Name | None = None
    outer_position: Along | None = None
    radial: Lateral | None = None
    axial: Lateral | None = None
    axial_sense: Literal["positive", "negative", "none"] | None = None
    tilt: Turning | None = None
    torsional: Turning | None = None
    kind: Literal["ball", "cylindrical", "needle", "tapered", "spherical"] | None = None
    rolling_elements: Annotated[int, Count(3, 500)] | None = None
    element_diameter: Outer | None = None
    pitch_diameter: Outer | None = None
    effective_length: Length | None = None
    contact_angle: Annotated[float, Quantity(ANGLE, -math.radians(89), math.radians(89))] = 0.0
    clearance: Annotated[float, Quantity(LENGTH, -1e-3, 1e-2)] = 0.0
    preload: Annotated[float, Quantity(LENGTH, -1e-2, 1e-2)] = 0.0
    inner_osculation: Annotated[float, Number(0.5, 1.0, open_low=True)] = 0.52
    outer_osculation: Annotated[float, Number(0.5, 1.0, open_low=True)] = 0.53
    rows: Annotated[int, Count(1, 2)] = 1
    row_distance: Annotated[float, Quantity(LENGTH, -10.0, 10.0)] = 0.0
    dynamic_rating: Annotated[float, Quantity(FORCE, 1.0, _LARGEST_FORCE)] | None = None
    static_rating: Annotated[float, Quantity(FORCE, 1.0, _LARGEST_FORCE)] | None = None
    fatigue_limit: Annotated[float, Quantity(FORCE, 1e-3, _LARGEST_FORCE)] | None = None
    viscosity_ratio: Annotated[float, Number(0.1, 100.0)] | None = None
    contamination: Annotated[float, Number(0.0, 1.0)] | None = None
    load_friction: Annotated[float, Number(0.0, 0.1)] | None = None
    lubricant_friction: Annotated[float, Number(0.0, 100.0)] | None = None
    estimated: StrictBool = False

    @property
    def nonlinear(self) -> bool:
        """Whether its force is no linear function of its motion: of a kind, of one axial sense, or with play."""
        return self.kind is not None or self.axial_sense is not None or self.gapped

    @property
    def gapped(self) -> bool:
        """Whether it is given by its stiffness and has play."""
        return self.kind is None and self.clearance > 0.0

    @property
    def stiffness(self) -> tuple[float, ...]:
        """Given stiffnesses along x, y, z [N/m], against both tilts and rotation [N m/rad].

        Zero where left out, along z where the axial one has one sense alone, and across the axis with play.
        """
        across, along = None if self.gapped else self.radial, None if self.axial_sense else self.axial
        given = across, along, self.tilt, self.torsional
        radial, axial, tilt, turn = (value or 0.0 for value in given)
        return radial, radial, axial, tilt, tilt, turn


class BoxCouplingSection(Section):
    """What joins two shafts: springs between two places, by default stiff in nothing but torsion.

    Between places apart along z a rigid link on either side leads to the ``joint``, the share of the way from the
    first to the second place at which the springs sit.
    """

    between: Annotated[tuple[Name, ...], PAIR]
    positions: Annotated[tuple[Along, ...], PAIR] | None = None
    name: Name | None = None
    torsion: Turning = math.inf
    bending: Turning = 0.0
    radial: Lateral = 0.0
    axial: Lateral = 0.0
    joint: Annotated[float, Number(0.0, 1.0)] = 0.5
    transmits: StrictBool = True
    """Whether both shafts turn at one speed; without it the coupling is a spring of its own, as of a brake."""


class BoxMeshSection(Section):
    """Stiffness of a mesh along its normal where no teeth are given, and its tooth pairs in contact.

    With a transverse ``contact_ratio`` the stiffness is in proportion to the number of tooth pairs, unless a
    ``low_share`` gives that with the smaller number of pairs over that with the larger. ``phase`` is the share of the
    mesh period by which a pair of teeth passes the middle of its path before the pitch point. ``backlash`` is along the
    line of action in the transverse section.
    """

    stiffness: MeshStiffness
    contact_ratio: Annotated[float, Number(1.0, 20.0)] | None = None
    low_share: Annotated[float, Number(0.0, 1.0, open_low=True)] | None = None
    phase: Annotated[float, Number(-1.0, 1.0)] = 0.0
    backlash: Annotated[float, Quantity(LENGTH, 0.0, 0.05)] | None = None


class PairGearsSection(Section):
    """Sizes of two gears whose teeth are not computed: by the transverse module, pitch radii or base radii.

    ``pressure_angle`` is the working one in the transverse section; ``helix_angle`` is positive for a right-handed
    gear 1.
    """

    teeth: Annotated[tuple[Teeth, ...], PAIR]
    module: Annotated[float, Quantity(LENGTH, 5e-5, 0.5)] | None = None
    radii: Annotated[tuple[Radius, ...], PAIR] | None = None
    base_radii: Annotated[tuple[Radius, ...], PAIR] | None = None
    internal: StrictBool = False
    pressure_angle: PressureAngle = math.radians(20.0)
    helix_angle: Annotated[float, Quantity(ANGLE, -math.radians(60), math.radians(60))] = 0.0
    face_width: Annotated[float, Quantity(LENGTH, 1e-4, 5.0)] | None = None


class PairSection(Section):
    """Two gears on two shafts: ``positions`` are those of the middles of their face widths.

    The teeth are the tables of a pair (``teeth``), or sizes and a stiffness (``gears`` with ``mesh``). A planet is a
    shaft of its own, whose bearings have the ``carrier`` as ``outer_shaft``; all pairs of its gears name this carrier.
    """

    name: Name
    shafts: Annotated[tuple[Name, ...], PAIR]
    carrier: Name | None = None
    """The shaft that takes the axes of planets around: both gears turn against it."""
    timing_error: Turned = 0.0
    """How far the gear of the planet is turned ahead on its shaft, counter-clockwise; of two planets that of gear 1."""
    positions: Annotated[tuple[Along, ...], PAIR] | None = None
    teeth: StageTables | None = None
    gears: PairGearsSection | None = None
    mesh: BoxMeshSection | None = None

    @property
    def counts_pairs(self) -> bool:
        """Whether the mesh excites by the number of its tooth pairs: without teeth, with a contact ratio."""
        return self.mesh is not None and self.mesh.contact_ratio is not None


class SetGearsSection(Section):
    """Sizes of a planetary set whose teeth are not computed: by the transverse module, or base radii.

    ``teeth`` are those of sun, planet and ring; ``pressure_angles`` the working ones of sun-planet and planet-ring.
    """

    teeth: Annotated[tuple[Teeth, ...], TRIPLE]
    planets: Annotated[int, Count(1, 24)] = 3
    planet_angles: Annotated[tuple[Angle, ...], Values(min_length=1, max_length=24)] | None = None
    module: Annotated[float, Quantity(LENGTH, 5e-5, 0.5)] | None = None
    base_radii: Annotated[tuple[Radius, ...], TRIPLE] | None = None
    centre_distance: Radius | None = None
    pressure_angles: Annotated[tuple[PressureAngle, ...], PAIR] | None = None
    helix_angle: Annotated[float, Quantity(ANGLE, -math.radians(60), math.radians(60))] = 0.0
    face_width: Annotated[float, Quantity(LENGTH, 1e-4, 5.0)] | None = None


class PlanetBearingSection(Section):
    """Stiffnesses of the bearing between a planet and its pin; those left out are rigid."""

    radial: Lateral = math.inf
    axial: Lateral = math.inf
    tilt: Turning = math.inf


class BoxPlanetSection(Section):
    """One of the equal planets: mass, inertias and bearing; what is left out follows from the teeth."""

    mass: PartMass | None = None
    inertia: PartInertia | None = None
    transverse_inertia: Transverse | None = None
    bearing: PlanetBearingSection | None = None


class PinSection(Section):
    """Pins of the planets, by closed forms.

    Each pin is a round bar of a ``length`` from the cheek of the carrier to the middle of the planet; held in
    ``cheeks`` 2 it is held at both ends of twice that length, in 1 at one end, on the side of the shaft.
    """

    diameter: Outer
    length: Length
    bore: Inner = 0.0
    cheeks: Literal[1, 2] = 2


class SuperelementSection(Section):
    """A carrier that was read from a file, as `femgear.exchange.carrier_files.CarrierBody` describes it, in SI units.

    Places and matrices as lists of numbers, row by row; of the symmetric ones the lower triangle.
    """

    seat: Annotated[tuple[Entry, ...], TRIPLE]
    pins: Annotated[tuple[Entry, ...], Values(min_length=3, max_length=100)]
    compliance: Entries
    mass: Entries
    frequency: Entries = ()
    coupling: Entries = ()


class CarrierBodySection(Section):
    """What the carrier between its pins and its shaft gives way by: rigid where nothing is given.

    By closed forms both cheeks, twice ``pins.length`` apart, wind up against one another: with a
    ``wind_up_stiffness``, or that of the webs between them, of an outer and an inner diameter, which fill the
    ``web_share`` of the circle; 1 is a closed tube. ``torque_end`` is the cheek on the shaft, the front at z < 0;
    without it the one towards the longer end of the shaft, the back where both are equally long and of one rigid body.

    Else a ``file`` has stiffness and mass of the whole carrier, with its pins or without them, see
    `femgear.exchange.carrier_files`; ``nodes`` is its table of nodes. Reading puts both in its place, as the
    ``superelement``.
    """

    wind_up_stiffness: Annotated[float, Quantity(TORSION, 1.0, 1e15)] | None = None
    web_outer_diameter: Outer | None = None
    web_inner_diameter: Inner | None = None
    web_share: Annotated[float, Number(0.0, 1.0, open_low=True)] = 1.0
    torque_end: End | None = None
    file: Annotated[str, Field(max_length=1000)] | None = None
    nodes: Annotated[str, Field(max_length=1000)] | None = None
    units: Literal["SI", "mm-t-s"] = "SI"
    superelement: SuperelementSection | None = None


class BoxPlanetarySection(Section):
    """Sun and carrier on shafts, the ring on a shaft or in the casing.

    The positions are those of the middles of the face widths on the shafts.
    """

    name: Name
    sun: Name
    carrier: Name
    ring: Name = CASING
    sun_position: Along | None = None
    carrier_position: Along | None = None
    ring_position: Along | None = None
    angle: Angle = 0.0
    """Of planet 1 from x; the carrier stands still at it in statics and modes."""
    teeth: StageTables | None = None
    gears: SetGearsSection | None = None
    sun_mesh: BoxMeshSection | None = None
    ring_mesh: BoxMeshSection | None = None
    planet: BoxPlanetSection = BoxPlanetSection()
    pins: PinSection | None = None
    carrier_body: CarrierBodySection | None = None
    elastic_ring: StrictBool = False
    """In modes and response the ring in the casing is elastic, on the foundation that its teeth give."""

    @property
    def counts_pairs(self) -> bool:
        """Whether both meshes excite by the number of their tooth pairs: without teeth, with contact ratios."""
        return all(mesh is not None and mesh.contact_ratio is not None for mesh in (self.sun_mesh, self.ring_mesh))

    @property
    def superelement(self) -> SuperelementSection | None:
        """The carrier that was read from a file; None of others."""
        return None if self.carrier_body is None else self.carrier_body.superelement

    @property
    def seat_position(self) -> float | None:
        """Position of the seat of the carrier on its shaft: where the planets are, or as far off as in its file [m]."""
        if self.superelement is None or self.carrier == CASING:
            return self.carrier_position
        return (self.carrier_position or 0.0) + self.superelement.seat[2] - self.superelement.pins[2]

    def member_position(self, member: str) -> float | None:
        """Position of sun or ring on its shaft, at the middle of its face width, or of the carrier's seat [m]."""
        return self.seat_position if member == "carrier" else getattr(self, f"{member}_position")


class LoadSection(SeatSection):
    """A place where torque enters or leaves a shaft, with forces that act there whatever the load case."""

    name: Name
    force: Annotated[tuple[Force, ...], TRIPLE] = (0.0, 0.0, 0.0)
    tilting_moment: Annotated[tuple[Torque, ...], PAIR] = (0.0, 0.0)


class ThermalSection(Section):
    """Growth of the casing by heat; that of shafts is by their ``temperature_rise``."""

    casing_rise: Rise = 0.0
    casing_expansion: Expansion = 1.1e-5


class BoxGravitySection(Section):
    """Weight of all parts, in a direction across the axes or along them."""

    acceleration: Annotated[float, Quantity(ACCELERATION, 0.0, 1e3)] = 9.80665
    direction: Annotated[tuple[Annotated[float, Number(-1.0, 1.0)], ...], TRIPLE] = (0.0, -1.0, 0.0)


class CasingFootSection(Section):
    """A foot of the casing: springs to the ground along x, y and z, each a stiffness or ``"rigid"``.

    Of a casing from a file ``name`` is that of a node of the role foot, and the position is that of the node.
    """

    name: Name | None = None
    position: Annotated[tuple[Along, ...], TRIPLE] | None = None
    stiffness: Annotated[tuple[Lateral, ...], TRIPLE]


class BoxCasingSection(Section):
    """The casing on its feet, with all that is fixed in it; without this section it stands still.

    It is a rigid body: ``centre`` is its centre of mass, ``inertia`` are those about x, y and z through it,
    ``products`` the integrals of x y, x z and y z over the mass. Or it is elastic, the superelement of a ``file`` with
    a table of ``nodes``, of which ``sha256`` is that of both; feet that the table has and that are not listed are
    rigid. Seats of ``stands_still`` are not in it, but in what stands still: bearings by their names, ``"ring of
    STAGE"``, ``"coupling NAME"``, ``"SHAFT held"``.
    """

    mass: PartMass | None = None
    inertia: Annotated[tuple[PartInertia, ...], TRIPLE] | None = None
    products: Annotated[tuple[Product, ...], TRIPLE] = (0.0, 0.0, 0.0)
    centre: Annotated[tuple[Along, ...], TRIPLE] | None = None
    foot: Annotated[tuple[CasingFootSection, ...], Field(max_length=MOST_PARTS)] = ()
    stands_still: Annotated[tuple[Name, ...], Field(max_length=MOST_PARTS)] = ()
    file: Annotated[str, Field(max_length=1000)] | None = None
    nodes: Annotated[str, Field(max_length=1000)] | None = None
    units: Literal["SI", "mm-t-s"] = "SI"
    max_frequency: Annotated[float, Quantity(FREQUENCY, 10.0, 1e6)] | None = None
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Names of the feet: as given, or by their numbers."""
        return tuple(foot.name or str(number + 1) for number, foot in enumerate(self.foot))


class BoxSensorSection(Section):
    """A sensor, which feels the motion of its place in a ``direction``: along an axis, or a vector of three numbers.

    On a rigid casing it is at a ``position`` in the coordinates of the case. On one from a file ``name`` is that of a
    node of the role sensor, whose row of the table of nodes has place and direction; a direction here goes before it.
    On the elastic ``ring`` of a stage it is at an ``angle`` from x on the outer surface, and feels along the radius
    where no direction is given. ``level_limit`` is the largest acceleration allowed there.
    """

    name: Name
    ring: Name | None = None
    angle: Angle | None = None
    position: Annotated[tuple[Along, ...], TRIPLE] | None = None
    direction: Annotated[SensorDirection, BeforeValidator(_axis_vector)] | None = None
    level_limit: LevelLimit = ()


class LoadCaseSection(Section):
    """Torques at loads and speeds of shafts of one load case, and its share of the running time, or its hours.

    ``force`` (along x, y, z) and ``tilting_moment`` (about x and y) act at loads beside what these have always.
    """

    name: Name = "nominal"
    torque: dict[Name, Torque]
    speed: dict[Name, ShaftSpeed]
    force: dict[Name, Annotated[tuple[Force, ...], TRIPLE]] = Field(default_factory=dict)
    tilting_moment: dict[Name, Annotated[tuple[Torque, ...], PAIR]] = Field(default_factory=dict)
    share: Share = 1.0
    hours: Hours | None = None


class BoxOperationSection(Section):
    """Load cases, and the life that they ask for, by default all their hours.

    ``output`` are the loads whose torques balance the others, ``fixed`` shafts that the casing holds."""

    load_case: Annotated[tuple[LoadCaseSection, ...], Field(min_length=1, max_length=1000)]
    output: tuple[Name, ...] = ()
    fixed: tuple[Name, ...] = ()
    first: Annotated[int, Count(1, 1000)] = 1
    """Number of the load case that contact, modes and pictures are of."""
    required_hours: Hours | None = None


class DeflectionSection(Section):
    """How system deflection is solved: slices over the width, passes, and where they have settled."""

    slices: Annotated[int, Count(1, 101)] = 15
    passes: Annotated[int, Count(1, 50)] = 12
    tolerance: Annotated[float, Number(1e-10, 1e-1)] = 1e-4
    contact: StrictBool = True
    """Compute load distributions of teeth that are given; without it meshes are linear springs."""


class BoxModesSection(Section):
    """Modes: their highest frequency, damping, speeds of the Campbell diagram.

    The lowest 20 modes are kept at least, whatever ``up_to`` is.
    """

    up_to: Annotated[float, Quantity(FREQUENCY, 1.0, 1e6)] | None = None
    damping_ratio: DampingRatio = 0.03
    speeds: Annotated[int, Count(2, 201)] = 21
    highest_speed: Annotated[float, Number(0.1, 100.0)] = 1.5
    """Of the Campbell diagram, over the speed of the load case."""


class BoxDynamicsSection(Section):
    """Response: reach of the excitation and tolerance of the periodic solution.

    Stages excite the gearbox up to the frequency ``up_to``, each with ``mesh_harmonics`` at most where they are given.
    Planets make ``side_bands`` at either side of each mesh harmonic.
    """

    up_to: Annotated[float, Quantity(FREQUENCY, 10.0, 200e3)] = 20e3
    mesh_harmonics: Annotated[int, Count(1, 2000)] | None = None
    side_bands: Annotated[int, Count(1, 60)] = 4
    tolerance: Annotated[float, Number(1e-12, 1e-2)] = 1e-8


class BoxBalanceSection(Section):
    """Teeth that part, by harmonic balance: harmonics of excitation and motion; none leaves it out.

    Planets on a carrier that turns make ``side_bands`` at either side of each mesh harmonic. Teeth that part touch
    their ``back_flanks`` beyond their backlash. With ``together`` flanks of all stages part and all carriers turn,
    while one stage after the other excites; without it the meshes of the others are springs.
    """

    harmonics: Annotated[int, Count(0, 64)] = 0
    side_bands: Annotated[int, Count(0, 24)] = 3
    back_flanks: StrictBool = True
    together: StrictBool = False


class GearboxCase(Section, ReadCase):
    """A gearbox, its load cases and how to compute it, in SI units.

    The fields carry the names of the case file; ``source`` is the text that gives this case. ``motions`` restricts
    all bodies: ``"space"`` has six, ``"plane"`` x, y and rotation, ``"rotation"`` the rotation alone, with which
    planets go round on their pins.
    """

    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    train: ClassVar[str] = "gearbox"
    model: Literal["gearbox"]
    title: Title
    motions: Literal["space", "plane", "rotation"] = "space"
    material: ShaftMaterialSection = ShaftMaterialSection()
    shaft: Annotated[tuple[BoxShaftSection, ...], Field(min_length=1, max_length=MOST_PARTS)]
    mass: Annotated[tuple[MassSection, ...], Field(max_length=MOST_PARTS)] = ()
    bearing: Annotated[tuple[BoxBearingSection, ...], Field(max_length=MOST_PARTS)] = ()
    coupling: Annotated[tuple[BoxCouplingSection, ...], Field(max_length=MOST_PARTS)] = ()
    pair: Annotated[tuple[PairSection, ...], Field(max_length=20)] = ()
    planetary: Annotated[tuple[BoxPlanetarySection, ...], Field(max_length=20)] = ()
    load: Annotated[tuple[LoadSection, ...], Field(max_length=MOST_PARTS)] = ()
    gravity: BoxGravitySection | None = None
    thermal: ThermalSection = ThermalSection()
    casing: BoxCasingSection | None = None
    sensor: Annotated[tuple[BoxSensorSection, ...], Field(max_length=MOST_PARTS)] = ()
    operation: BoxOperationSection
    deflection: DeflectionSection = DeflectionSection()
    modes: BoxModesSection = BoxModesSection()
    dynamics: BoxDynamicsSection = BoxDynamicsSection()
    runup: RunupSection = RunupSection(count=0)
    balance: BoxBalanceSection = BoxBalanceSection()
    transient: TransientSection | None = None
    strength: StrengthSection = StrengthSection()
    lubricant: LubricantSection | None = None
    losses: LossesSection | None = None

    @model_validator(mode="before")
    @classmethod
    def _materials_of_teeth(cls, data: Any) -> Any:
        return with_materials(data)

    @property
    def load_case(self) -> LoadCaseSection:
        """The load case that contact, modes and pictures are of."""
        return self.operation.load_case[self.operation.first - 1]

    def shaft_named(self, name: str) -> BoxShaftSection:
        """Find the shaft of that name."""
        return next(shaft for shaft in self.shaft if shaft.name == name)

    def growth_of(self, shaft: str) -> float:
        """Compute by how much a shaft grows along its axis beyond the casing, over its length [1]."""
        section, casing = self.shaft_named(shaft), self.thermal
        growth = self.material_of(section).thermal_expansion * section.temperature_rise
        return growth - casing.casing_expansion * casing.casing_rise

    def material_of(self, shaft: BoxShaftSection) -> ShaftMaterialSection:
        """Find the material of a shaft."""
        return shaft.material or self.material


def named_load_case(name: str) -> str:
    """Write a load case in a sentence: its name after the words "load case", once where it begins with them."""
    return name if name.lower().startswith("load case") else f"load case {name}"


def of_stage(part: str, stage: str) -> str:
    """Name a gear, a root or a flank of a stage: ``"gear 1 of first stage"``, ``"planet of second, sun side"``."""
    gear, comma, side = part.partition(",")
    return f"{gear} of {stage}{comma}{side}"


@lru_cache(maxsize=64)
def stage_case_of(text: str) -> Any:
    """Read the case of the teeth of a stage from the text of its tables.

    CaseError: as `femgear.trains.reading.parse_case`.
    """
    return parse_case(text, numbered=False)


@remembered(latest=64)
def teeth_of(stage: PairSection | BoxPlanetarySection) -> Any:
    """Read the case of the teeth of a stage; None of one that gives sizes and stiffnesses."""
    return None if stage.teeth is None else stage_case_of(case_text.write(stage.teeth))


def embed_stages(data: dict, name: str) -> dict[str, str]:
    """Put tables of stages and torques in the place of their files, and the SHA-256 of the files of a casing."""
    file_names = add_checksum(data, "casing", name, "casing") | embed_torques(data, name)
    for kind in ("pair", "planetary"):
        stages = data.get(kind)
        for i, table in enumerate(stages if isinstance(stages, list) else ()):
            if isinstance(table, dict) and isinstance(table.get("teeth"), str):
                key, file = f"{kind}[{i}].teeth", table.pop("teeth")
                table["teeth"] = embedded(file, name, key, stage_tables)
                file_names[key] = case_text.printable(file)
            body = table.get("carrier_body") if isinstance(table, dict) else None
            if isinstance(body, dict) and isinstance(body.get("file"), str):
                key, file = f"{kind}[{i}].carrier_body.file", body["file"]
                del table["carrier_body"]  # a file that cannot be read is refused for that alone
                table["carrier_body"] = _superelement_tables(body, name, key)
                file_names[key] = case_text.printable(file)
    return file_names


def _there(path: str) -> Path:
    """Path of a file that can be read. CaseError: E-FILE."""
    case_text.read_text(path)
    return Path(path)


def _superelement_tables(body: dict, name: str, key: str) -> dict:
    """Tables of a carrier whose file is read and put in its place."""
    from femgear.exchange.carrier_files import read_carrier

    others = {entry: value for entry, value in body.items() if entry not in ("file", "nodes", "units")}
    nodes, units = body.get("nodes"), body.get("units", "SI")
    if units not in get_args(CarrierBodySection.model_fields["units"].annotation) or not isinstance(nodes, str | None):
        return body  # refused with the other entries
    path = None if nodes is None else embedded(nodes, name, key.replace(".file", ".nodes"), _there)
    read = embedded(body["file"], name, key, lambda file: read_carrier(Path(file), nodes=path, units=units))
    symmetric = {entry: getattr(read, entry) for entry in ("compliance", "mass")}
    triangles = {entry: matrix[np.tril_indices(len(matrix))].tolist() for entry, matrix in symmetric.items()}
    lists = {entry: getattr(read, entry).ravel().tolist() for entry in ("seat", "pins", "frequency", "coupling")}
    return others | {"superelement": lists | triangles}


def stage_tables(path: str) -> dict:
    """Read the tables of the case file of a stage, with the points of its measured profiles."""
    data = case_text.parse(case_text.read_text(path), path)
    embed_profiles(data, path)
    return data
