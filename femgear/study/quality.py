"""What a flank tolerance class of ISO 1328-1 makes of the errors of a gear: laws of samples, and a table.

A class says what a gear is allowed, not how its errors are spread. Here every one is normal, and three standard
deviations of what a measuring machine reads fill the tolerance, beyond which parts are sorted out:

* the eccentricity is half the runout, ``sigma = F_rT/6``;
* it takes ``F_rT/cos(alpha_t)`` of the total cumulative pitch F_pT. Pitches of their own are steps of a bridge over z
  teeth, whose range is ``KUIPER sigma sqrt(z)`` at three standard deviations (N. H. Kuiper, Proc. KNAW A 63, 1960);
  they fill what is left of F_pT, squares added, and no more than f_pT;
* slopes of profile and helix have ``sigma = f_HalphaT/3`` and ``f_HbetaT/3``.

Form deviations f_falpha and f_fbeta are not drawn: they have no shape.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from femgear.case.quantities import ANGLE, LENGTH, to_si
from femgear.errors import CaseError, GeometryError
from femgear.gears.tolerances import FlankTolerances, flank_tolerances, tolerances_of_gear
from femgear.study.problem import current_value

if TYPE_CHECKING:
    from femgear.gears.gear import Gear

KUIPER = 2.18
"""Range of a Brownian bridge that 99.73 % of all keep to, in standard deviations of its whole length."""
LEAST_SHARE = 0.1
"""Share of F_pT that is left for pitches of their own, at least."""
_SIGMAS = 3.0
_ENTRY = re.compile(
    r"(?P<root>(?:.*\.)?)(?P<gear>sun|planet|ring|gear_1|gear_2)\."
    r"(?P<entry>errors\.runout_amplitude|(?P<modification>modifications\[\d+\])\.amount)"
)
"""Entries of a case file that a class has a tolerance for."""


def pitch_sigma(gear: Gear, tolerances: FlankTolerances) -> float:
    """Compute the standard deviation of single pitches [m] that fill what the runout leaves of F_pT, within f_pT."""
    runout = tolerances.runout / (tolerances.cumulative_pitch * math.cos(gear.pressure_angle))
    left = max(math.sqrt(max(1.0 - runout**2, 0.0)), LEAST_SHARE)
    bridge = left * tolerances.cumulative_pitch / (KUIPER * math.sqrt(gear.teeth))
    return min(tolerances.pitch / _SIGMAS, bridge)


def laws_of_class(gear: Gear, tolerance_class: int, *, over_width: bool) -> dict[str, dict[str, Any]]:
    """Make the laws of the errors of a gear, as files of tolerances hold them, by their keys.

    Parameters
    ----------
    gear : Gear
        Of the transverse section.
    tolerance_class : int
        1 to 11.
    over_width : bool
        Whether contact is solved in slices, without which helix slopes have no effect.

    Raises
    ------
    GeometryError
        A class or a size that ISO 1328-1 does not cover (E-ISO1328).
    """
    try:
        tolerances = tolerances_of_gear(gear, tolerance_class)
    except GeometryError as error:
        error.key = f"{gear.name}.quality"
        error.remedy = "give the laws of this gear one by one"
        raise
    sigmas = {
        "pitch": (pitch_sigma(gear, tolerances), tolerances.pitch),
        "runout_amplitude": (0.5 * tolerances.runout / _SIGMAS, 0.5 * tolerances.runout),
        "profile_slope": (tolerances.profile_slope / _SIGMAS, tolerances.profile_slope),
    }
    if over_width:
        sigmas["lead_slope"] = (tolerances.helix_slope / _SIGMAS, tolerances.helix_slope)
    return {
        key: {"distribution": "normal", "sigma": f"{1e6 * sigma!r} um", "limit": f"{1e6 * limit!r} um"}
        for key, (sigma, limit) in sigmas.items()
    }


def limit_of_entry(case: Any, key: str, tolerance_class: int) -> float:
    """Find the tolerance [m] of an entry of a case file, a third of which is its standard deviation.

    Half of F_rT of ``errors.runout_amplitude``; f_HalphaT and f_HbetaT of the ``amount`` of a modification that is a
    profile slope or a lead slope.

    Raises
    ------
    CaseError
        Entries that a class has no tolerance for (E-CHOICE), or gears that the standard does not cover (E-ISO1328).
    """
    match = _ENTRY.fullmatch(key)
    name = None
    if match is not None and match["modification"] is None:
        name = "runout"
    elif match is not None:
        kind = current_value(case, f"{match['root']}{match['gear']}.{match['modification']}.kind")
        name = {"profile slope": "profile_slope", "lead slope": "helix_slope"}.get(str(kind))
    if match is None or name is None:
        raise CaseError(
            "a flank tolerance class says nothing of this entry",
            code="E-CHOICE",
            value=key,
            limit="errors.runout_amplitude, or the amount of a profile slope or lead slope, of a gear",
            remedy="give sigma or limit in place of quality",
        )
    tolerances = _tolerances_in_file(case, match["root"], match["gear"], tolerance_class)
    value = float(getattr(tolerances, name))
    return 0.5 * value if name == "runout" else value


def _tolerances_in_file(case: Any, root: str, gear: str, tolerance_class: int) -> FlankTolerances:
    """Flank tolerances of a gear by the tables of a case file, of which ``root`` is the key of its teeth."""

    def given(*keys: str) -> Any:
        values = (current_value(case, root + key) for key in keys)
        return next((value for value in values if value is not None), None)

    module = to_si(given("set.module", "sun.module"), LENGTH)
    helix = given("set.helix_angle", "helical.helix_angle")
    cosine = 1.0 if helix is None else math.cos(to_si(helix, ANGLE))
    width = to_si(given(f"{gear}.face_width", "set.face_width"), LENGTH)
    diameter = module * abs(int(given(f"{gear}.teeth"))) / cosine
    try:
        return flank_tolerances(tolerance_class, diameter=diameter, normal_module=module, face_width=width)
    except GeometryError as error:
        raise CaseError(
            error.message, code=error.code, value=error.value, limit=error.limit, remedy=error.remedy
        ) from None
