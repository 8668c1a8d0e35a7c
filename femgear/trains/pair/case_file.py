"""The case file with ``model = "pair"``: two gears on a centre distance, computed from their teeth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from femgear.case.checks import (
    check_face_widths,
    check_gear_deviations,
    check_load_cases,
    check_materials,
    check_speeds,
    check_torque,
)
from femgear.case.csv_columns import embed_profiles
from femgear.case.fault_sections import FaultSection, keyed_faults
from femgear.case.flank_sections import GearErrors, ModificationSection
from femgear.case.load_spectrum import spectrum_notices
from femgear.case.lubrication import LossesSection, LubricantSection
from femgear.case.messages import added_material, estimated_materials, idle_materials_and_oil
from femgear.case.quantities import ANGLE, LENGTH, TORQUE, Count, Quantity, Section, Title, Values
from femgear.case.sections import (
    FORMAT,
    LARGEST_HELIX,
    LARGEST_TORQUE,
    LEFT_OUT,
    DynamicsSection,
    FaceWidth,
    GearMaterialSection,
    Hours,
    Inertia,
    LoadSpectrum,
    MachineSection,
    Mass,
    MaterialSection,
    Module,
    PressureAngle,
    RackSection,
    Radius,
    RunupSection,
    Shift,
    Speed,
    StaticSection,
    Stiffness,
    StrengthSection,
    TipDiameter,
    speed_range,
)
from femgear.case.teeth import GearCase, case_overlap, flank_form, free_tips, gear_of, pitch_of, runout_of
from femgear.case.text import CaseFile
from femgear.case.tooth_measures import ToothMeasures, check_allowances, shift_open
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.gears.checks import check_meshes
from femgear.gears.deviations import SetDeviations, no_deviations
from femgear.gears.pair import GearPair, close_pair
from femgear.gears.tips import settled_tips


class PairSetSection(Section):
    """What both gears share.

    ``centre_distance`` may be left out (the profile shifts give it), and so may, where it is given, one of
    the profile shifts (it is found so that the mesh has no play). ``face_width`` is that of
    a gear that gives none of its own. ``backlash`` is the play on the reference circles: half of it is taken
    from the tooth thickness of either gear. With a ``helix_angle``, positive for a right-handed gear 1,
    module, pressure angle, racks and shifts are of the normal section.
    """

    module: Module
    pressure_angle: PressureAngle
    face_width: FaceWidth | None = None
    centre_distance: Annotated[float, Quantity(LENGTH, 1e-4, 20.0)] | None = None
    backlash: Annotated[float, Quantity(LENGTH, 0.0, 0.01)] = 0.0
    helix_angle: Annotated[float, Quantity(ANGLE, -LARGEST_HELIX, LARGEST_HELIX)] = 0.0


class GearSection(ToothMeasures):
    """Gear 1, the driving one.

    Mass and inertia left out are estimated; without a bearing stiffness the axis is held.
    """

    teeth: Annotated[int, Count(5, 5000)]
    profile_shift: Shift | None = None
    bore_radius: Radius
    face_width: FaceWidth | None = None
    material: GearMaterialSection | None = None
    mass: Mass = LEFT_OUT
    inertia: Inertia = LEFT_OUT
    bearing_stiffness: Stiffness | None = None
    tip_diameter: TipDiameter | None = None
    root_diameter: Radius | None = None
    rack: RackSection | None = None
    modifications: Annotated[tuple[ModificationSection, ...], Field(max_length=20)] = ()
    errors: GearErrors | None = None
    fault: Annotated[tuple[FaultSection, ...], Field(max_length=100)] = ()


class WheelSection(GearSection):
    """Gear 2: external with a bore radius, internal with an outer radius and perhaps its pinion cutter."""

    bore_radius: Radius | None = None
    outer_radius: Radius | None = None
    cutter_teeth: Annotated[int, Count(5, 1000)] | None = None
    cutter_profile_shift: Shift = 0.0

    @property
    def internal(self) -> bool:
        """Whether it is an internal gear."""
        return self.outer_radius is not None


class PairOperationSection(Section):
    """Torque on gear 1, of either sign, and speeds of gear 1; gear 2 is held while the contact is solved.

    Behind couplings the torques act on motor and brake. Load cases are those of the life, which ``required_hours``
    asks for.
    """

    torque: Annotated[float, Quantity(TORQUE, -LARGEST_TORQUE, LARGEST_TORQUE)]
    speeds: Annotated[tuple[Speed, ...], Values(max_length=100_000), BeforeValidator(speed_range)] = ()
    load_case: LoadSpectrum = ()
    required_hours: Hours | None = None


class PairCase(GearCase):
    """Two gears, their load and how to compute them, in SI units.

    The fields carry the names of the case file; ``source`` is the text that gives this case.
    """

    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    train: ClassVar[str] = "pair"
    gear_names: ClassVar[tuple[str, ...]] = ("gear_1", "gear_2")
    model: Literal["pair"]
    title: Title
    set: PairSetSection
    rack: RackSection = RackSection()
    material: MaterialSection
    gear_1: GearSection
    gear_2: WheelSection
    operation: PairOperationSection
    motor: MachineSection | None = None
    brake: MachineSection | None = None
    static: StaticSection = StaticSection()
    dynamics: DynamicsSection = DynamicsSection()
    runup: RunupSection = RunupSection()
    strength: StrengthSection = StrengthSection()
    lubricant: LubricantSection | None = None
    losses: LossesSection | None = None

    @property
    def module(self) -> float:
        """Module of both gears, of helical teeth the normal one [m]."""
        return self.set.module

    @property
    def pressure_angle(self) -> float:
        """Pressure angle of both gears, of helical teeth the normal one [rad]."""
        return self.set.pressure_angle

    @property
    def helix_angle(self) -> float | None:
        """Helix angle at the reference circle [rad], positive of a right-handed gear 1; None of spur ones."""
        return self.set.helix_angle or None

    def closed_gears(self) -> GearPair:
        """Make both gears, closed on their centre distance and checked."""
        two = self.gear_2
        pair = close_pair(
            gear_of(self, self.gear_1, "gear_1", self.gear_1.bore_radius),
            gear_of(self, two, "gear_2", two.outer_radius or two.bore_radius or 0.0, internal=two.internal),
            centre_distance=self.set.centre_distance,
            find=tuple(name for name in self.gear_names if shift_open(getattr(self, name))),
        )
        settled = settled_tips(pair, free=free_tips(self))
        check_meshes(settled, overlap=case_overlap(self, settled))
        return settled

    def made_deviations(self, gears: GearPair) -> SetDeviations:
        """Make the deviations of both gears from their modifications and errors."""
        errors_1, errors_2 = (getattr(self, name).errors or GearErrors() for name in self.gear_names)
        form = flank_form(self, gears.gear_2)
        # a tooth that stands further on brings the flank on that side nearer to the mate
        pitch = gears.senses[1] * pitch_of(errors_2, gears.gear_2)
        return replace(
            no_deviations(gears),
            sun=flank_form(self, gears.gear_1),
            planet_sun_side=form,
            planet_ring_side=form,
            sun_pitch=-pitch_of(errors_1, gears.gear_1),
            planet_pitch=[pitch],
            planet_ring_side_pitch=[-pitch],
            sun_runout=runout_of(errors_1),
            planet_runout=(runout_of(errors_2),),
            sun_thickness=errors_1.thickness_reduction or 0.0,
            planet_thickness=np.array([errors_2.thickness_reduction or 0.0]),
            faults=tuple(fault for _, fault in keyed_faults(self, gears)),
        )

    def torque_on_first_gear(self, torque: float | None = None) -> float:
        """Find the torque on gear 1 [N m], by default the case's."""
        return self.operation.torque if torque is None else torque


def check_pair_entries(case: PairCase) -> Iterator[CaseError]:
    """Refuse what no entry shows alone."""
    two, shifts_open = case.gear_2, [shift_open(getattr(case, name)) for name in case.gear_names]
    if (two.bore_radius is None) == (two.outer_radius is None):
        yield CaseError(
            "gear 2 needs one radius of its rim",
            code="E-CHOICE",
            key="gear_2.bore_radius",
            limit="bore_radius of an external, outer_radius of an internal gear",
        )
    elif not two.internal and two.cutter_teeth is not None:
        yield CaseError(
            "the teeth of an external gear are made by its rack",
            code="E-CHOICE",
            key="gear_2.cutter_teeth",
            remedy="leave it out, or give outer_radius in place of bore_radius",
        )
    if shifts_open.count(True) > (case.set.centre_distance is not None):
        yield CaseError(
            "the profile shifts leave the pair open",
            code="E-KEY-MISSING",
            key=f"gear_{1 + shifts_open.index(True)}.profile_shift",
            remedy="give both profile shifts, or measures of the teeth, or one of them and set.centre_distance",
        )
    if case.static.members != "fixed":
        yield CaseError(
            "both gears stand on fixed axes",
            code="E-CHOICE",
            key="static.members",
            value=case.static.members,
            limit="'fixed'",
            remedy="leave static.members out",
        )
    yield from check_face_widths(case)
    yield from check_materials(case)
    yield from check_allowances(case)
    yield from check_torque(case.operation.torque)
    yield from check_load_cases(case)
    yield from check_speeds(case) if case.operation.speeds else ()
    yield from check_gear_deviations(case)


def pair_notices(_data: dict, case: PairCase) -> Iterator[Finding]:
    """List what a pair gives in a way that deserves to be said, by the tables of its checked file."""
    yield from added_material(case)
    yield from spectrum_notices(case)
    yield from idle_materials_and_oil(case)
    yield from estimated_materials(case)


FILE = CaseFile(PairCase, check_pair_entries, notices=pair_notices, embed=embed_profiles)
