"""The case of a planetary set: its entries, and the gears, deviations and torques that it makes of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from femgear.case.fault_sections import keyed_faults
from femgear.case.flank_sections import CarrierErrors, GearErrors, RingErrors
from femgear.case.lubrication import LossesSection, LubricantSection
from femgear.case.quantities import Count, Title
from femgear.case.sections import (
    FORMAT,
    CarrierSection,
    DynamicsSection,
    HousingSection,
    MachineSection,
    MaterialSection,
    OperationSection,
    PlanetSection,
    RackSection,
    RingSection,
    RunupSection,
    SetSection,
    StaticSection,
    StrengthSection,
    SunSection,
)
from femgear.case.teeth import GearCase, case_overlap, flank_form, free_tips, gear_of, pitch_of, runout_of
from femgear.case.text import CaseFile
from femgear.case.tooth_measures import shift_open
from femgear.errors import GeometryError
from femgear.gears.checks import check_set
from femgear.gears.deviations import Ovality, SetDeviations, no_deviations
from femgear.gears.kinematics import torque_ratios, unheld_members
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.tips import settled_tips


class Case(GearCase):
    """A planetary gear set, its operation and how to compute it, in SI units.

    The sections carry the names of the case file; masses, inertias and stiffnesses that it leaves out are
    estimates. ``source`` is the text that gives this case, ``notices`` what was read in a way that deserves
    to be said.
    """

    train: ClassVar[str] = "elastic"
    gear_names: ClassVar[tuple[str, ...]] = ("sun", "planet", "ring")
    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    title: Title
    set: SetSection
    rack: RackSection = RackSection()
    material: MaterialSection
    sun: SunSection
    planet: PlanetSection
    ring: RingSection
    carrier: CarrierSection = Field(default_factory=CarrierSection)
    motor: MachineSection | None = None
    brake: MachineSection | None = None
    operation: OperationSection
    static: StaticSection = StaticSection()
    dynamics: DynamicsSection = DynamicsSection()
    housing: HousingSection = HousingSection()
    runup: RunupSection = RunupSection()
    strength: StrengthSection = StrengthSection()
    lubricant: LubricantSection | None = None
    losses: LossesSection | None = None

    @property
    def module(self) -> float:
        """Module of all gears, of helical teeth the normal one [m]."""
        return self.sun.module

    @property
    def pressure_angle(self) -> float:
        """Pressure angle of all gears, of helical teeth the normal one [rad]."""
        return self.sun.pressure_angle

    @property
    def rigid(self) -> bool:
        """Whether the ring moves as a rigid body."""
        return False

    @property
    def helix_angle(self) -> float | None:
        """Helix angle at the reference circle [rad], positive of a right-handed sun; None of spur gears."""
        return self.set.helix_angle or None

    @property
    def mesh_harmonics(self) -> int | None:
        """Harmonics of the excitation: as given, 6 of rigid bodies, None where a frequency limits them."""
        return self.dynamics.mesh_harmonics

    @property
    def response_harmonics(self) -> int | None:
        """Harmonics of the response: as given, or three times those of the mesh; None as there."""
        kept = self.mesh_harmonics
        return self.dynamics.response_harmonics or (None if kept is None else 3 * kept)

    def closed_gears(self) -> PlanetarySet:
        """Make sun, planet and ring, closed on their centre distance and checked.

        GeometryError: see `femgear.gears.checks.check_set`, and members that float without being held (E-MECHANISM).
        """
        closed = _closed_set(self)
        check_set(closed, overlap=case_overlap(self, closed))
        check_floating(self, closed)
        return closed

    def made_deviations(self, gears: PlanetarySet) -> SetDeviations:
        """Make the deviations of the set from the modifications and errors of its gears."""
        sun, ring = self.sun.errors or GearErrors(), self.ring.errors or RingErrors()
        planets = [_planet_errors(self, n) for n in range(1, gears.n_planets + 1)]
        pitch = [pitch_of(errors, gears.planet) for errors in planets]
        oval, misaligned = ring.ovality, np.zeros((gears.n_planets, 2))
        for askew in self.planet.misalignment:
            misaligned[askew.planet - 1] = askew.radial, askew.tangential
        return replace(
            no_deviations(gears),
            sun=flank_form(self, gears.sun),
            planet_sun_side=flank_form(self, gears.planet, "sun side"),
            planet_ring_side=flank_form(self, gears.planet, "ring side"),
            ring=flank_form(self, gears.ring),
            # a tooth that stands further on brings its left flank nearer to the mate, its right flank away
            sun_pitch=-pitch_of(sun, gears.sun),
            planet_pitch=[-displaced for displaced in pitch],
            planet_ring_side_pitch=pitch,
            ring_pitch=-pitch_of(ring, gears.ring),
            sun_runout=runout_of(sun),
            planet_runout=tuple(runout_of(errors) for errors in planets),
            ring_runout=runout_of(ring),
            carrier_runout=runout_of(self.carrier.errors or CarrierErrors()),
            pin_errors=pin_errors(self, gears),
            ovality=Ovality(**oval.model_dump()) if oval else Ovality(),
            sun_thickness=sun.thickness_reduction or 0.0,
            planet_thickness=[errors.thickness_reduction or 0.0 for errors in planets],
            ring_thickness=ring.thickness_reduction or 0.0,
            planet_misalignment=misaligned,
            faults=tuple(fault for _, fault in keyed_faults(self, gears)),
            **{
                f"{name}_misalignment": (askew.x, askew.y)
                for name in ("sun", "carrier")
                if (askew := getattr(self, name).misalignment) is not None
            },
        )

    def torque_on_first_gear(self, torque: float | None = None) -> float:
        """Find the torque on the sun [N m] under one on the input, by default the case's."""
        value = self.operation.torque if torque is None else torque
        return value / torque_ratios(self.sun.teeth, self.ring.teeth)[self.operation.input]


class RigidCase(Case):
    """A planetary gear set of rigid bodies: the ring needs no foundation."""

    @model_validator(mode="before")
    @classmethod
    def _without_foundation(cls, data: object) -> object:
        if isinstance(data, dict) and isinstance(data.get("ring"), dict):
            loose = {"foundation_radial": "0 N/m^3", "foundation_tangential": "0 N/m^3"}
            return data | {"ring": loose | data["ring"]}
        return data

    @property
    def rigid(self) -> bool:
        return True

    @property
    def mesh_harmonics(self) -> int:
        return self.dynamics.mesh_harmonics or 6

    @property
    def response_harmonics(self) -> int:
        return self.dynamics.response_harmonics or 3 * self.mesh_harmonics


FILE = CaseFile(Case)


def _closed_set(case: Case) -> PlanetarySet:
    """Gears of a case, closed on their centre distance but not yet checked as a set."""
    ring = case.ring
    closed = close_set(
        gear_of(case, case.sun, "sun", case.sun.bore_radius),
        gear_of(case, case.planet, "planet", case.planet.bore_radius),
        gear_of(case, ring, "ring", ring.outer_radius, internal=True),
        planet_angles=case.set.planet_angles or equal_planet_angles(case.set.planets),
        centre_distance=case.set.centre_distance,
        find=tuple(name for name in ("sun", "ring") if shift_open(getattr(case, name))),
    )
    return settled_tips(closed, free=free_tips(case))


def pin_errors(case: Case, gears: PlanetarySet) -> np.ndarray:
    """Collect the displacements of the pins of all planets, radial and tangential, (N, 2) [m]."""
    pins = np.zeros((gears.n_planets, 2))
    for pin in case.set.pin_errors:
        pins[pin.planet - 1] = pin.radial, pin.tangential
    return pins


def _planet_errors(case: Case, number: int) -> GearErrors:
    """Errors of one planet: those of all planets, replaced by what is given for this one."""
    common = case.planet.errors or GearErrors()
    individual = next((planet for planet in case.planet.individual if planet.planet == number), None)
    given = {} if individual is None else individual.model_dump(exclude_unset=True, exclude={"planet"})
    if "pitch" in given or "cumulative_pitch" in given:
        given = {"pitch": None, "cumulative_pitch": None} | given
    return common.model_copy(update=given)


def output_member(case: Case) -> str:
    """Find the member that is neither driven nor held."""
    others = {case.operation.input, case.operation.fixed}
    return next((name for name in ("carrier", "sun", "ring") if name not in others), "carrier")


def check_floating(case: Case, planetary: PlanetarySet, *, dynamic: bool = False) -> None:
    """Refuse a sun, carrier or ring without support [N/m] that the forces of the planets cannot hold.

    ``dynamic``: for modes and dynamics, where members move whatever static.members says. GeometryError:
    E-MECHANISM, with the support stiffness that is zero, or the foundation of a loose ring.
    """
    if case.static.members == "fixed" and not dynamic:
        return
    if case.ring.foundation_tangential == 0.0:
        _mechanism(
            case,
            "ring.foundation_tangential",
            "nothing keeps the ring from turning under the load of the planets",
            value="0 N/m^3",
            remedy='give it a tangential foundation, or write static.members = "fixed"',
        )
    names = [name for name in ("sun", "carrier") if getattr(case, name).support_stiffness == 0.0]
    # the dynamic model has no back flanks
    both_flanks = case.static.back_flanks and not dynamic
    loose = list(unheld_members(planetary, names, both_flanks=both_flanks))
    if not loose:
        return
    N = planetary.n_planets
    message = f"{N} planets cannot hold a floating sun and a floating carrier at once"
    if len(loose) == 1:
        angles = ", ".join(f"{math.degrees(angle):.6g}" for angle in planetary.planet_angles[:12])
        where = f"{N} planet{'s' * (N > 1)} at {angles} deg"
        message = f"{where} cannot hold a floating {loose[0]}: their forces leave it free to move aside"
    _mechanism(
        case,
        f"{loose[-1]}.support_stiffness",
        message,
        value="0 N/m",
        remedy=f'write support_stiffness = "5e7 N/m" or the like in [{loose[-1]}], or '
        'run with static.members = "fixed" and --only static; three equally spaced planets hold it',
    )


def _mechanism(case: Case, key: str, message: str, *, value: str, remedy: str):
    raise GeometryError(
        message,
        code="E-MECHANISM",
        key=key,
        value=value,
        limit=f"above {value}",
        remedy=remedy,
        file=case.location(key),
    )
