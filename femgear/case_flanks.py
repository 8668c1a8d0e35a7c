"""Modifications of a case as forms of the flanks of its gears."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from femgear.errors import GeometryError
from femgear.gears.modifications import (
    FlankForm,
    MeasuredProfile,
    Modification,
    ProfileCrowning,
    ProfileSlope,
    RootRelief,
    TipRelief,
    check_form,
    roll_at,
)

if TYPE_CHECKING:
    from femgear.casefile.deviations import ModificationSection
    from femgear.casefile.sections import Case
    from femgear.gears import Gear


def flank_form(case: Case, gear: Gear, side: str = "both") -> FlankForm:
    """Form of a flank of a gear; planets have one on the side of the sun and one on that of the ring.

    Parameters
    ----------
    case : Case
    gear : Gear
    side : str
        Flank of a planet, "sun side" or "ring side"; sun and ring have "both" alike.

    Returns
    -------
    FlankForm

    Raises
    ------
    GeometryError
        E-MODIFICATION, with key, file and line: what the flank cannot have.
    """
    found = []
    for i, section in enumerate(getattr(case, gear.name).modifications):
        if getattr(section, "flank", "both") not in (side, "both"):
            continue
        try:
            found.append(_modification(section, gear))
            check_form(FlankForm((found[-1],)), gear)
            if isinstance(found[-1], MeasuredProfile):
                _check_reach(case, found[-1], gear, f"{gear.name}.modifications[{i}]")
        except GeometryError as error:
            error.key = f"{gear.name}.modifications[{i}]"
            error.file = case.location(error.key)
            raise
    return FlankForm(tuple(found))


def _modification(section: ModificationSection, gear: Gear) -> Modification:
    if section.kind == "measured profile":
        angles, diameters = section.roll_angles or (), section.diameters or ()
        rolls = [roll_at(gear, roll_angle=a) for a in angles] + [roll_at(gear, diameter=d) for d in diameters]
        points = sorted(zip(rolls, section.deviations, strict=True))
        return MeasuredProfile(tuple(r for r, _ in points), tuple(-e for _, e in points))
    start, end = (
        roll_at(
            gear,
            diameter=getattr(section, f"{name}_diameter"),
            roll_angle=getattr(section, f"{name}_roll_angle"),
            length=getattr(section, f"{name}_roll_length"),
        )
        for name in ("start", "end")
    )
    match section.kind:
        case "tip relief":
            return TipRelief(section.amount, start, end, section.exponent)
        case "root relief":
            return RootRelief(section.amount, start, end, section.exponent)
        case "profile slope":
            return ProfileSlope(section.amount, start, end)
        case _:
            return ProfileCrowning(section.amount, start, end)


def _check_reach(case: Case, profile: MeasuredProfile, gear: Gear, key: str) -> None:
    """Refuse a measured profile that lies beside the flank.

    Raises
    ------
    GeometryError
        E-MODIFICATION, with the file of the profile and both ranges.
    """
    low, high = sorted((gear.form_roll, gear.tip_roll))
    if profile.roll[-1] >= low and profile.roll[0] <= high:
        return
    source = case.profile_files.get(key)
    named = f"the measured profile {source}" if source else "the measured profile"
    raise GeometryError(
        f"{gear.name}: no part of {named} lies on the flank",
        code="E-MODIFICATION",
        key=key,
        value=_range(gear, *profile.roll[:: len(profile.roll) - 1]),
        limit=f"points within {_range(gear, low, high)}",
        remedy="check the unit of its first column and that it belongs to this gear",
    )


def _range(gear: Gear, low: float, high: float) -> str:
    angles = (math.degrees(roll / gear.base_radius) for roll in (low, high))
    diameters = (2e3 * math.hypot(roll, gear.base_radius) for roll in (low, high))
    return "roll angles {:.4g} to {:.4g} deg, diameters {:.6g} to {:.6g} mm".format(*angles, *diameters)
