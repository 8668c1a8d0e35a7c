"""Teeth from the sections of a case: the gear of a section, its flanks and errors, and what a case of gears tells.

A train whose cases have teeth derives its case from `GearCase`; `femgear.case.gear_set` closes, checks and keeps what
the case makes of its sections.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from femgear.case.flank_sections import CarrierErrors, GearErrors
from femgear.case.quantities import FREE, Section
from femgear.case.sections import face_width
from femgear.case.text import ReadCase
from femgear.case.tooth_measures import gear_allowances, measured_gear
from femgear.errors import GeometryError
from femgear.gears.deviations import Runout, SetDeviations, tooth_displacements
from femgear.gears.gear import Gear
from femgear.gears.modifications import FlankForm, MeasuredProfile, Modification, check_form, roll_at
from femgear.gears.pair import GearSet
from femgear.gears.profile import BasicRack, PinionCutter, overlap_ratio, transverse_rack, transverse_tool

if TYPE_CHECKING:
    from femgear.case.flank_sections import ModificationSection


class GearCase(Section, ReadCase):
    """A case of gears with teeth: ``gear_names`` are those of their sections, in the order of the gears."""

    gear_names: ClassVar[tuple[str, ...]]

    @property
    def helix_angle(self) -> float | None:
        """Helix angle at the reference circle [rad], positive of a right-handed first gear; None of spur gears."""
        return None

    @abstractmethod
    def closed_gears(self) -> Any:
        """Make the gears, closed on their centre distance and checked; `planetary_set` keeps them.

        GeometryError: what cannot be made, assembled or run; `planetary_set` puts file and line to it.
        """

    @abstractmethod
    def made_deviations(self, gears: Any) -> SetDeviations:
        """Make the deviations of the gears that the case has, not yet checked; `set_deviations` keeps them."""

    @abstractmethod
    def torque_on_first_gear(self, torque: float | None = None) -> float:
        """Find the torque on the sun or gear 1 [N m] under one on the input, by default the case's."""


def gear_of(case: Any, section: Any, name: str, rim: float, *, internal: bool = False) -> Gear:
    """Make a gear of a case from its section; the rim is its bore or outer radius [m].

    Its measures give its profile shift, or what its teeth are thinner, see `femgear.case.tooth_measures`.
    Its tip is open until the gears are closed, see `femgear.gears.tips.settled_tips`.
    """
    given, module, pressure_angle = section.rack or case.rack, case.module, case.pressure_angle
    rack = BasicRack(**given.model_dump())
    if case.helix_angle is not None:
        module, pressure_angle = transverse_tool(module, pressure_angle, case.helix_angle)
        rack = transverse_rack(rack, case.helix_angle)
    cutter, tip = None, None if section.tip_diameter == FREE else section.tip_diameter
    if internal and section.cutter_teeth is not None:
        shift = section.cutter_profile_shift * _normal_modules(case)
        cutter = PinionCutter(teeth=section.cutter_teeth, profile_shift=shift)
    gear = Gear(
        teeth=section.teeth,
        module=module,
        pressure_angle=pressure_angle,
        profile_shift=(section.profile_shift or 0.0) * _normal_modules(case),
        face_width=face_width(case, name),
        rim_radius=rim,
        internal=internal,
        rack=rack,
        cutter=cutter,
        tip_diameter=tip,
        root_diameter=section.root_diameter,
        thickness_allowance=_thickness_allowance(case, name),
        name=name,
        tip_open=True,
    )
    return measured_gear(case, section, gear)


def _thickness_allowance(case: Any, name: str) -> float:
    """What the teeth of a gear are thinner [m]: the mean of its allowances, or half of the backlash."""
    if (allowances := gear_allowances(case, name)) is not None:
        return -0.5 * sum(allowances) / _normal_modules(case)
    return 0.5 * case.set.backlash


def _normal_modules(case: Any) -> float:
    """Normal modules in the module of the gears' section: cos(beta) of helical teeth, 1 of spur teeth."""
    return 1.0 if case.helix_angle is None else math.cos(case.helix_angle)


def free_tips(case: Any) -> tuple[str, ...]:
    """List the gears of a case whose tips are to run free of their mates."""
    return tuple(name for name in case.gear_names if getattr(case, name).tip_diameter == FREE)


def case_overlap(case: Any, gears: GearSet) -> float:
    """Compute the overlap ratio of helical teeth on the narrowest face in common; 0 of spur teeth."""
    if case.helix_angle is None:
        return 0.0
    module = gears.gears[0].module * math.cos(case.helix_angle)
    return abs(overlap_ratio(min(gears.mesh_widths), module, case.helix_angle))


def pitch_of(errors: GearErrors, gear: Gear) -> np.ndarray:
    """Displacement (z,) of every tooth on the base circle [m]."""
    return tooth_displacements(gear, cumulative=errors.cumulative_pitch, single=errors.pitch)


def runout_of(errors: CarrierErrors) -> Runout:
    """Make the runout of a table of errors."""
    return Runout(errors.runout_amplitude or 0.0, errors.runout_phase or 0.0)


def flank_form(case: Any, gear: Gear, side: str = "both") -> FlankForm:
    """Form of both flanks of sun or ring, or of a planet's flank on the "sun side" or the "ring side"."""
    modifications = []
    for i, section in enumerate(getattr(case, gear.name).modifications):
        if getattr(section, "flank", "both") not in (side, "both"):
            continue
        try:
            modifications.append(_modification(section, gear))
            check_form(FlankForm((modifications[-1],)), gear)
            if isinstance(modifications[-1], MeasuredProfile):
                _check_reach(modifications[-1], gear, f"{gear.name}.modifications[{i}]")
        except GeometryError as error:
            error.key = f"{gear.name}.modifications[{i}]"
            if source := case.profile_files.get(error.key):
                error.message += f" (points of {source})"
            error.file = case.location(error.key)
            raise
    return FlankForm(tuple(modifications))


def _modification(section: ModificationSection, gear: Gear) -> Modification:
    """Form over the roll length [m]; measured deviations are material, which forms count as taken off."""
    law: Any = Modification.kinds[section.kind]
    return law(**{field.name: _entry_of_law(section, gear, field.name) for field in fields(law)})


def _entry_of_law(section: ModificationSection, gear: Gear, name: str) -> Any:
    """What a field of a modification is by the entries of its section, by its name."""
    match name:
        case "start" | "end":
            return roll_at(
                gear,
                diameter=getattr(section, f"{name}_diameter"),
                roll_angle=getattr(section, f"{name}_roll_angle"),
                length=getattr(section, f"{name}_roll_length"),
            )
        case "power":
            return section.exponent
        case "roll" | "place":
            return tuple(place for place, _ in _points(section, gear))
        case "removed":
            return tuple(-deviation for _, deviation in _points(section, gear))
        case _:
            return getattr(section, name)


def _points(section: ModificationSection, gear: Gear) -> list[tuple[float, float]]:
    """Places over the width or roll lengths [m] of a measured flank with their deviations [m], ascending."""
    places = [*(section.places or ())]
    places += [roll_at(gear, roll_angle=angle) or 0.0 for angle in section.roll_angles or ()]
    places += [roll_at(gear, diameter=diameter) or 0.0 for diameter in section.diameters or ()]
    return sorted(zip(places, section.deviations or (), strict=True))


def _check_reach(profile: MeasuredProfile, gear: Gear, key: str) -> None:
    """Refuse a measured profile that lies beside the flank, with both ranges."""
    low, high = sorted((gear.form_roll, gear.tip_roll))
    if profile.roll[-1] >= low and profile.roll[0] <= high:
        return
    raise GeometryError(
        f"{gear.name}: no part of the measured profile lies on the flank",
        code="E-MODIFICATION",
        key=key,
        value=_range(gear, *profile.roll[:: len(profile.roll) - 1]),
        limit=f"points within {_range(gear, low, high)}",
        remedy="check the unit of its first column and that it belongs to this gear",
    )


def _range(gear: Gear, low: float, high: float) -> str:
    """Two roll lengths as roll angles and diameters, for messages."""
    angles = (math.degrees(roll / gear.base_radius) for roll in (low, high))
    diameters = (2e3 * math.hypot(roll, gear.base_radius) for roll in (low, high))
    return "roll angles {:.4g} to {:.4g} deg, diameters {:.6g} to {:.6g} mm".format(*angles, *diameters)
