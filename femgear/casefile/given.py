"""Refusals of the gears, in terms of what the case file gives."""

from __future__ import annotations

import math
import re

from femgear.casefile.helical import helical_notices
from femgear.casefile.planar import planar_notices
from femgear.casefile.sections import Case, RackSection
from femgear.casefile.units import ANGLE, LENGTH
from femgear.errors import GeometryError

# dimensions of the entries whose values the refusals of gears give as SI numbers
_DIMENSIONS = {
    "centre_distance": LENGTH,
    "bore_radius": LENGTH,
    "outer_radius": LENGTH,
    "tip_diameter": LENGTH,
    "root_diameter": LENGTH,
    "module": LENGTH,
    "pressure_angle": ANGLE,
}


def in_terms_of_the_case(error: GeometryError, case: Case) -> None:
    """Let a refusal name the entries that the user gave, their values, and keys that exist.

    Parameters
    ----------
    error : GeometryError
        Its fields are changed, ``file`` (with the line) among them.
    case : Case
    """
    if error.code == "E-BACKLASH":
        gear = (error.key or "").partition(".")[0]
        error.remedy = (
            f"leave {gear}.profile_shift out so that it is found, give set.backlash, or another "
            "set.centre_distance"
        )
    if error.code == "E-ASSEMBLY":
        _assembly(error, case)
    if error.code == "E-ALLOWANCE":
        error.key, error.value = "set.backlash", LENGTH.show(case.set.backlash)
        error.limit = f"0 mm to {LENGTH.show(2.0 * case.sun.module)}: each gear takes half of it"
        error.remedy = "reduce the backlash"
    if error.key == "rack.root_radius":
        cut = re.match(r"(\w+):|the \w+'s tip runs into the (\w+)'s root fillet", error.message)
        gear = (cut[1] or cut[2]) if cut else ""
        if getattr(getattr(case, gear, None), "rack", None) is not None:
            error.key = f"{gear}.rack.root_radius"
        error.value = rack_at(case, error.key).root_radius
    _shift_left_out(error, case)
    _in_transverse_section(error, case)
    dimension = _DIMENSIONS.get((error.key or "").rpartition(".")[2])
    if dimension is not None and isinstance(error.value, float):
        error.value = dimension.show(error.value)
    error.file = case.location(error.key or "")


def rack_at(case: Case, key: str) -> RackSection:
    """The rack section of a key, that of all gears or of one."""
    gear = key.partition(".")[0]
    return case.rack if gear == "rack" else getattr(case, gear).rack


def _in_transverse_section(error: GeometryError, case: Case) -> None:
    """Gears of a helical case are refused in their transverse section, the file gives the normal one."""
    if case.helical is None:
        return
    error.message += " (in the transverse section of the helical gears"
    factor = math.cos(case.helical.helix_angle)
    if factor < 0.999 and ((error.key or "").endswith("profile_shift") or "rack." in (error.key or "")):
        error.message += f", whose coefficients are {factor:.6g} times those of the file"
    error.message += ")"


def _assembly(error: GeometryError, case: Case) -> None:
    angles = case.set.planet_angles
    if angles is None:
        error.key, error.value = "set.planets", case.set.planets
        return
    error.value = ", ".join(f"{math.degrees(angle):.6g}" for angle in angles[:24]) + " deg"


def _shift_left_out(error: GeometryError, case: Case) -> None:
    """A shift that was found is no entry to change: name the one that it follows from."""
    sections = {"sun": case.sun, "ring": case.ring}
    gear, _, entry = (error.key or "").partition(".")
    if gear not in sections or entry != "profile_shift" or sections[gear].profile_shift is not None:
        return
    if case.set.centre_distance is not None:
        error.key, given = "set.centre_distance", f"{1e3 * case.set.centre_distance:.6g} mm"
        remedy = "change the centre distance or the tooth numbers"
    else:
        other = "ring" if gear == "sun" else "sun"
        error.key, given = f"{other}.profile_shift", sections[other].profile_shift
        remedy = f"change the {other}'s profile shift or the tooth numbers"
    found = f"{error.value:.5g}" if isinstance(error.value, float) else error.value
    error.message += f" (the {gear}'s profile shift of {found} is what closes the set)"
    if error.code == "E-SHIFT":
        error.limit = f"such that the {gear}'s shift is {error.limit}"
    error.value, error.remedy = given, remedy


def added_material(case: Case) -> tuple[str, ...]:
    """Warnings of reliefs and crownings with a negative amount: most are slips of the sign.

    Parameters
    ----------
    case : Case
    """
    found = []
    for gear in ("sun", "planet", "ring"):
        for i, one in enumerate(getattr(case, gear).modifications):
            if one.kind in ("tip relief", "root relief", "profile crowning") and one.amount < 0.0:
                found.append(
                    f"[W-RELIEF-SIGN] {gear}.modifications[{i}].amount: a {one.kind} of "
                    f"{one.amount * 1e6:.6g} um adds material; a positive amount takes it off (usual: 0 um "
                    "or above)"
                )
    return tuple(found)


def notices(data: dict) -> tuple[str, ...]:
    """Remarks on what was read in a way that deserves to be said.

    Parameters
    ----------
    data : dict
        Tables of a case file that was checked.
    """
    found = []
    if (teeth := data["ring"]["teeth"]) < 0:
        found.append(
            f"ring.teeth = {teeth} is read as an internal gear with {-teeth} teeth; ring.profile_shift keeps "
            "femgear's sign (positive moves the flank outwards, the opposite of ISO 21771)"
        )
    if "planar" in data:
        return (*found, *planar_notices(data))
    if "helical" in data:
        return (*found, *helical_notices(data))
    if "bearing_clearance" in data["planet"] and data.get("static", {}).get("members", "fixed") == "fixed":
        found.append(
            'planet.bearing_clearance has no effect while static.members is "fixed": write '
            'static.members = "elastic"'
        )
    return tuple(found)
