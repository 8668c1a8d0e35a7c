"""Parts of a drivetrain: bodies on parallel axes, what joins and drives them, and torques over time.

All axes are parallel to z; rotations are positive about z. The tables of a case file are the data
themselves. A file gives numbers as texts with units, within the windows that stand beside the entries; in
Python `Part.in_si` takes SI numbers, radians and names, and `Part.changed` other ones. What follows from the
entries, such as pitch radii and springs, are properties. Contradictions between entries are refused where a
file is read (`femgear.trains.drivetrain.case_file`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, StrictBool, ValidationInfo, WithJsonSchema

from femgear.case.quantities import (
    ANGLE,
    DENSITY,
    INERTIA,
    LENGTH,
    MASS,
    MODULUS,
    STIFFNESS,
    TORSION,
    Count,
    Number,
    Quantity,
    Section,
    StiffnessOrRigid,
    Values,
)
from femgear.case.sections import Angle, PressureAngle, Teeth
from femgear.case.text import described
from femgear.errors import CaseError
from femgear.fe import beam
from femgear.gears.planetary import equal_planet_angles

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_ -]{0,39}")


def _name(value: object) -> str:
    if not isinstance(value, str):
        message = f"a name is needed, not {described(value)}"
        raise CaseError(message, code="E-TYPE", value=value, remedy="write it in quotation marks")
    if not _NAME.fullmatch(value) or value != value.strip() or re.match(r"(planet|shaft)\b", value):
        raise CaseError(
            "not a name for a body",
            code="E-CHOICE",
            value=value,
            limit="40 letters, digits, blanks, - or _; planet and shaft are taken as first words",
        )
    return value


def _two(value: object) -> object:
    if not isinstance(value, list) or len(value) != 2:
        what = f"{len(value)} entries" if isinstance(value, list) else described(value)
        raise CaseError(
            f"two entries are needed, not {what}",
            code="E-COUNT",
            limit="a list of two: for the first and for the second body",
        )
    return value


def _tables(value: object) -> object:
    if not isinstance(value, dict):
        what = f"the case file of a pair is needed, not {described(value)}"
        raise CaseError(what, code="E-TYPE", value=value, remedy='name it, as in "pair.toml"')
    return value


def _driver(value: str | None, info: ValidationInfo) -> str | None:
    """The driver of a stage; where the ends themselves are wrong, they alone are refused."""
    ends = info.data.get("between", ()) or [info.data[key] for key in ("carrier", "sun") if key in info.data]
    if value is not None and len(ends) == 2 and value not in ends:
        raise CaseError(
            "the driver is none of the two bodies of its stage",
            code="E-CHOICE",
            value=value,
            limit=" or ".join(ends),
        )
    return value


Name = Annotated[str, BeforeValidator(_name)]
Driver = Annotated[str | None, AfterValidator(_driver)]
Mass = Annotated[float, Quantity(MASS, 1e-6, 1e8)]
Inertia = Annotated[float, Quantity(INERTIA, 1e-12, 1e11)]
TransverseInertia = Annotated[float, Quantity(INERTIA, 0.0, 1e11)]
Radius = Annotated[float, Quantity(LENGTH, 1e-4, 100.0)]
Length = Annotated[float, Quantity(LENGTH, 1e-4, 1e3)]
Offset = Annotated[float, Quantity(LENGTH, -100.0, 100.0)]
Module = Annotated[float, Quantity(LENGTH, 5e-5, 0.5)]
Joint = Annotated[float, StiffnessOrRigid(TORSION, 1e-3, 1e15)]
BOTH = BeforeValidator(_two)
"""Of entries of the first and the second body, in `Annotated`."""


PairTables = Annotated[dict[str, Any], BeforeValidator(_tables), WithJsonSchema({"type": ["string", "object"]})]
"""Of the name of a case file, in whose place its tables stand when it was read."""


class Part(Section):
    """A table of the case file, which is the data of a part of the chain."""

    @classmethod
    def in_si(cls, **values: Any) -> Self:
        """Make the part from SI numbers, radians and names, whose sizes are not checked."""
        needed = {name for name, field in cls.model_fields.items() if field.is_required()}
        if wrong := (needed - values.keys()) | (values.keys() - cls.model_fields.keys()):
            raise TypeError(f"{cls.__name__}: missing or unknown {', '.join(sorted(wrong))}")
        return cls.model_construct(**values)

    def changed(self, **values: object) -> Self:
        """Copy the part with other values, as of `Part.in_si`."""
        return self.model_copy(update=values)


class BodySection(Part):
    """A rigid body on its axis; the first body gives the speed."""

    name: Name
    inertia: Inertia
    mass: Mass
    transverse_inertia: TransverseInertia = 0.0
    """About a diameter; for the carrier without the planets."""
    tilts: StrictBool = True
    """x, y, two tilts and the rotation, else x, y and the rotation."""


class ShaftSection(Part):
    """A shaft between two bodies: springs of its joint, or a round section."""

    between: Annotated[tuple[str, ...], BOTH]
    length: Length
    bending: Joint | None = None
    torsion: Joint | None = None
    shear: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)] | None = None
    """Where not given that of a Timoshenko shaft of the bending stiffness and the shear ratio."""
    shear_ratio: Annotated[float, Number(0.0, 100.0)] = 0.0
    outer_diameter: Radius | None = None
    inner_diameter: Annotated[float, Quantity(LENGTH, 0.0, 100.0)] = 0.0
    youngs_modulus: Annotated[float, Quantity(MODULUS, 1e6, 1e12)] = 2.06e11
    poisson_ratio: Annotated[float, Number(0.0, 0.5, open_high=True)] = 0.3
    density: Annotated[float, Quantity(DENSITY, 0.0, 25000.0)] = 7850.0
    elements: Annotated[int, Count(0, 100)] = 0
    """Timoshenko elements of the section; 0 takes two rigid links and a joint of springs, without mass."""

    @property
    def section(self) -> beam.RoundSection:
        """Round section of a shaft that has one."""
        assert self.outer_diameter is not None
        return beam.RoundSection(
            self.outer_diameter, self.inner_diameter, self.youngs_modulus, self.poisson_ratio, self.density
        )

    @property
    def springs(self) -> beam.JointSprings:
        """Springs of the joint [N m/rad], [N/m]."""
        if self.bending is None or self.torsion is None:
            return beam.joint_springs(self.section, self.length)
        shear = self.shear
        if shear is None:
            shear = 12.0 * self.bending / ((1.0 + self.shear_ratio) * self.length**2)
        return beam.JointSprings(self.bending, self.torsion, shear)


class MeshSection(Part):
    """Rectangular mesh stiffness by the number of tooth pairs in contact."""

    stiffness: Annotated[float, Quantity(STIFFNESS, 1e3, 1e13)]
    """Mean over the mesh period."""
    contact_ratio: Annotated[float, Number(1.0, 20.0)]
    low_share: Annotated[float, Number(0.0, 1.0, open_low=True)] | None = None
    """Stiffness with the smaller number of pairs over that with the larger; else all pairs are alike."""
    phase: Annotated[float, Number(-1000.0, 1000.0)] = 0.0
    """Fraction of the mesh period by which the wave is ahead."""
    backlash: Annotated[float, Quantity(LENGTH, 0.0, 0.05)] | None = None
    """Along the line of action; where not given there is no back flank."""

    @property
    def levels(self) -> tuple[float, float, float]:
        """Lower and upper stiffness [N/m], and the share of the period with the upper one."""
        pairs = math.floor(self.contact_ratio)
        share = self.contact_ratio - pairs
        ratio = pairs / (pairs + 1.0) if self.low_share is None else self.low_share
        high = self.stiffness / (ratio + (1.0 - ratio) * share)
        return ratio * high, high, share


class ComputedMesh(MeshSection):
    """Mesh stiffness of a pair of gears, computed from their teeth."""

    samples: tuple[float, ...]
    """At equal steps of the mesh period while the first gear drives [N/m]."""

    def series(self, harmonics: int) -> np.ndarray:
        """Compute the complex harmonics 0 to H (H + 1,) of the samples [N/m]."""
        lines = 2.0 / len(self.samples) * np.fft.rfft(self.samples)[: harmonics + 1]
        return np.append(0.5 * lines[0], lines[1:])


class ParallelSection(Part):
    """Two external gears; sizes by pitch radii, base radii, or the transverse module."""

    between: Annotated[tuple[str, ...], BOTH]
    teeth: Annotated[tuple[Teeth, ...], BOTH]
    radii: Annotated[tuple[Radius, ...], BOTH] | None = None
    base_radii: Annotated[tuple[Radius, ...], BOTH] | None = None
    module: Module | None = None
    mesh: MeshSection | None = None
    stiffness: PairTables | None = None
    """In place of the mesh: case file of a pair, whose tables take the place of its name."""
    pressure_angle: PressureAngle = math.radians(20.0)
    """In the transverse section."""
    helix_angle: Annotated[float, Quantity(ANGLE, -math.radians(60), math.radians(60))] = 0.0
    """A positive one pushes the second gear along z where the first drives, else against z."""
    direction: Angle = 0.0
    """Of the line from the first to the second axis, from x."""
    offsets: Annotated[tuple[Offset, ...], BOTH] = (0.0, 0.0)
    """Place of the mesh along z from the centre of either body, which tilts it."""
    driver: Driver = None
    """The body whose teeth push, which makes its leading flanks the loaded ones; else the first."""

    @property
    def ends(self) -> tuple[str, ...]:
        """Both bodies; the first drives where nothing else is said."""
        return self.between

    @property
    def name(self) -> str:
        """Both bodies, as in "pinion-wheel"."""
        return "-".join(self.between)

    @property
    def flank(self) -> int:
        """1 where the first body drives, else -1."""
        return -1 if self.driver == self.between[1] else 1

    @property
    def pitch_radii(self) -> tuple[float, ...]:
        """Pitch radii of both gears [m]."""
        if self.module is not None:
            return tuple(0.5 * self.module * teeth for teeth in self.teeth)
        return self.radii or tuple(radius / math.cos(self.pressure_angle) for radius in self.base_radii or ())


class PlanetarySection(Part):
    """Carrier, sun and planets in a ring that the housing holds."""

    carrier: str
    sun: str
    ring_teeth: Teeth
    sun_teeth: Teeth
    planet_teeth: Teeth | None = None
    """Where not given ``(z_r - z_s)/2``, as without profile shift, or what radii say."""
    sun_radius: Radius | None = None
    planet_radius: Radius | None = None
    sun_base_radius: Radius | None = None
    planet_base_radius: Radius | None = None
    module: Module | None = None
    centre_distance: Radius | None = None
    """Of profile-shifted gears, beside the module or the base radii."""
    planets: Annotated[int, Count(1, 24)] = 3
    planet_angles: Annotated[tuple[Angle, ...], Values(min_length=1, max_length=24)] | None = None
    """Ascending, from x when the carrier's phase is zero."""
    planet_mass: Mass
    planet_inertia: Inertia
    planet_transverse_inertia: TransverseInertia = 0.0
    planet_bearing: Annotated[float, StiffnessOrRigid(STIFFNESS, 1.0, 1e15)] = math.inf
    """An infinite one fixes the planets' axes to their pins, so that each has its rotation only."""
    sun_mesh: MeshSection
    """Of one planet, as the ring's; the phases are those of the first planet."""
    ring_mesh: MeshSection
    pressure_angle: PressureAngle = math.radians(20.0)
    driver: Driver = None
    """Carrier or sun, the one that drives the other; else the carrier."""

    @property
    def ends(self) -> tuple[str, ...]:
        """Carrier and sun; the carrier drives where nothing else is said."""
        return self.carrier, self.sun

    @property
    def name(self) -> str:
        """Carrier and sun, as in "carrier-sun"."""
        return f"{self.carrier}-{self.sun}"

    @property
    def flank(self) -> int:
        """1 where the carrier drives, -1 where the sun does."""
        return -1 if self.driver == self.sun else 1

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles (N,) of the planets [rad]."""
        return self.planet_angles or equal_planet_angles(self.planets)

    @property
    def planet_teeth_or_half(self) -> float:
        """Teeth of a planet: as given, or ``(z_r - z_s)/2``."""
        return self.planet_teeth or 0.5 * (self.ring_teeth - self.sun_teeth)

    @property
    def base_radii(self) -> tuple[float, float, float]:
        """Base radii of sun, planet and ring [m]: ``m z cos(alpha)/2`` of a module (ISO 21771).

        With all tooth numbers given they have these ratios; radii then give the sum of sun and planet.
        """
        cosine = math.cos(self.pressure_angle)
        if self.module is not None:
            half = 0.5 * self.module * cosine
            return self.sun_teeth * half, self.planet_teeth_or_half * half, self.ring_teeth * half
        if self.sun_base_radius is not None and self.planet_base_radius is not None:
            sun, planet = self.sun_base_radius, self.planet_base_radius
        else:
            assert self.sun_radius is not None and self.planet_radius is not None  # one of three ways
            sun, planet = self.sun_radius * cosine, self.planet_radius * cosine
        if self.planet_teeth is None:
            # the radii alone say how large the ring is
            return sun, planet, sun + 2.0 * planet
        tooth = (sun + planet) / (self.sun_teeth + self.planet_teeth)
        return self.sun_teeth * tooth, self.planet_teeth * tooth, self.ring_teeth * tooth

    @property
    def axis_distance(self) -> float:
        """Distance of the planets' axes from that of the sun [m].

        As given, the sum of pitch radii that are given, or ``(r_bs + r_br)/(2 cos(alpha))``: exact without
        profile shift, else half-way between the distances at which either mesh has the pressure angle.
        """
        if self.centre_distance is not None:
            return self.centre_distance
        if self.sun_radius is not None and self.planet_radius is not None:
            return self.sun_radius + self.planet_radius
        sun, _, ring = self.base_radii
        return 0.5 * (sun + ring) / math.cos(self.pressure_angle)

    @property
    def base_shares(self) -> tuple[float, float]:
        """Cosines of the working pressure angles, ``(r_bs + r_bp)/a`` and ``(r_br - r_bp)/a`` (ISO 21771)."""
        (sun, planet, ring), distance = self.base_radii, self.axis_distance
        return (sun + planet) / distance, (ring - planet) / distance

    @property
    def working_angles(self) -> tuple[float, float]:
        """Working pressure angles of the meshes of sun and ring [rad]."""
        sun, ring = self.base_shares
        return math.acos(min(sun, 1.0)), math.acos(min(ring, 1.0))

    @property
    def pitch_radii(self) -> tuple[float, float]:
        """Pitch radii of sun and planet in their mesh at the distance of their axes [m]."""
        (sun, planet, _), distance = self.base_radii, self.axis_distance
        return distance * sun / (sun + planet), distance * planet / (sun + planet)

    @property
    def ring_radius(self) -> float:
        """Pitch radius of the ring in its mesh with the planets [m]."""
        _, planet, ring = self.base_radii
        return self.axis_distance * ring / (ring - planet)


class BearingSection(Part):
    """Bearing in the housing, of a body or of a station inside a shaft of several elements."""

    body: str | None = None
    shaft: Annotated[tuple[str, ...], BOTH] | None = None
    station: Annotated[int, Count(1, 99)] | None = None
    """Number of the station inside the shaft, from 1 beside the first body."""
    radial: Annotated[float, StiffnessOrRigid(STIFFNESS, 0.0, 1e15)] = 0.0
    tilt: Annotated[float, StiffnessOrRigid(TORSION, 0.0, 1e15)] = 0.0
    offset: Offset = 0.0
    """Place along z from the centre of the body."""


@dataclass(frozen=True)
class StageMesh:
    """A mesh of a stage: its ``name`` and the number of the ``stage`` and of the ``planet`` on it, both from 0.

    ``key`` is its entry in the case file, ``section`` what stands there.
    """

    name: str
    stage: int
    key: str
    section: MeshSection
    planet: int = 0


@dataclass(frozen=True)
class Drivetrain:
    """A chain from the driving body to the driven one.

    Parameters
    ----------
    bodies : tuple of BodySection
        Rigid bodies; the first one gives the speed.
    shafts : tuple of ShaftSection
        Between two bodies: springs of a joint, or a round section.
    parallel, planetary : tuples of ParallelSection and PlanetarySection
        Gear pairs and planetary sets.
    bearings : tuple of BearingSection
        Several of a body add.
    gravity : float
        Along -y [m/s^2].
    damping_ratio : float
        Of all elastic modes with mean mesh stiffnesses [1].
    """

    bodies: tuple[BodySection, ...]
    shafts: tuple[ShaftSection, ...] = ()
    parallel: tuple[ParallelSection, ...] = ()
    planetary: tuple[PlanetarySection, ...] = ()
    bearings: tuple[BearingSection, ...] = ()
    gravity: float = 9.80665
    damping_ratio: float = 0.0

    @property
    def stages(self) -> tuple[PlanetarySection | ParallelSection, ...]:
        """Planetary stages, then parallel ones."""
        return (*self.planetary, *self.parallel)

    @property
    def meshes(self) -> tuple[StageMesh, ...]:
        """Meshes of the stages in their order; of a planetary one those of the sun before the ring's."""
        meshes = []
        for i, stage in enumerate(self.planetary):
            suns = [f"{stage.sun}-planet {p + 1}" for p in range(len(stage.angles))]
            rings = [f"planet {p + 1}-ring of {stage.carrier}" for p in range(len(stage.angles))]
            for names, entry, mesh in ((suns, "sun_mesh", stage.sun_mesh), (rings, "ring_mesh", stage.ring_mesh)):
                meshes += [StageMesh(name, i, f"planetary[{i}].{entry}", mesh, p) for p, name in enumerate(names)]
        for i, stage in enumerate(self.parallel):
            assert stage.mesh is not None  # given, or computed by `femgear.trains.drivetrain.model`
            entry = "mesh" if stage.stiffness is None else "stiffness"
            meshes.append(StageMesh(stage.name, len(self.planetary) + i, f"parallel[{i}].{entry}", stage.mesh))
        return tuple(meshes)

    def planet_names(self, stage: PlanetarySection) -> list[str]:
        """Name the planets of a stage: ``planet 1``, or ``planet of carrier 1`` beside other stages."""
        prefix = "planet" if len(self.planetary) == 1 else f"planet of {stage.carrier}"
        return [f"{prefix} {number}" for number in range(1, len(stage.angles) + 1)]

    def body(self, name: str) -> BodySection:
        """Find the body of that name."""
        return next(body for body in self.bodies if body.name == name)


@dataclass(frozen=True)
class TorqueHistory:
    """Torque on one ``body``, linear between the instants and constant outside them.

    ``times`` (m,) ascend [s]; ``values`` (m,) [N m] are positive about z.
    """

    body: str
    times: np.ndarray
    values: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "times", np.array(self.times, float))
        object.__setattr__(self, "values", np.array(self.values, float))

    def at(self, times) -> np.ndarray:
        """Compute the torque (n,) [N m] at any instants (n,) [s]."""
        return np.interp(times, self.times, self.values)

    def mean(self, duration: float) -> float:
        """Compute the mean torque from 0 to `duration` [s], exact [N m]."""
        inside = self.times[(self.times > 0.0) & (self.times < duration)]
        times = np.concatenate([[0.0], inside, [duration]])
        return float(np.trapezoid(self.at(times), times) / duration)


def constant_torques(torques: dict[str, float]) -> tuple[TorqueHistory, ...]:
    """Make histories of constant torques on bodies [N m]."""
    return tuple(TorqueHistory(body, np.zeros(1), np.array([value])) for body, value in torques.items())


def numbered(names: Sequence[str]) -> list[str]:
    """Number names that come again with the next free number: ``a-b``, ``a-b 2``."""
    numbered_names: list[str] = []
    for name in names:
        number, text = 1, name
        while text in numbered_names:
            number += 1
            text = f"{name} {number}"
        numbered_names.append(text)
    return numbered_names
