"""Flank tolerances of gears by their class, ISO 1328-1:2013.

The tolerances of class A are those of class 5 times ``sqrt(2)^(A - 5)``, rounded as the standard says: above 10 um to
whole micrometres, from 5 to 10 to halves, below 5 to tenths. Total deviations follow from the unrounded parts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from femgear.errors import GeometryError
from femgear.gears.iso6336 import helix_of

if TYPE_CHECKING:
    from femgear.gears.gear import Gear

CLASSES = (1, 11)
"""Finest and coarsest flank tolerance class."""
_LIMITS = {
    "reference diameter": (5e-3, 15.0, "m"),
    "normal module": (0.5e-3, 70e-3, "m"),
    "face width": (4e-3, 1.2, "m"),
}


@dataclass(frozen=True)
class FlankTolerances:
    """Tolerances of the flanks of a gear, all in m.

    Parameters
    ----------
    pitch, cumulative_pitch : float
        Single pitch deviation f_pT and total cumulative pitch deviation F_pT.
    profile_form, profile_slope, profile : float
        f_falphaT, f_HalphaT (either way) and total profile deviation F_alphaT.
    helix_form, helix_slope, helix : float
        f_fbetaT, f_HbetaT (either way) and total helix deviation F_betaT.
    runout : float
        F_rT, of informative annex E.
    """

    pitch: float
    cumulative_pitch: float
    profile_form: float
    profile_slope: float
    profile: float
    helix_form: float
    helix_slope: float
    helix: float
    runout: float

    def base_pitch(self, pressure_angle: float) -> float:
        """Compute the base pitch deviation f_pb [m], ``f_pT cos(alpha_t)``, the pressure angle in rad."""
        return self.pitch * math.cos(pressure_angle)


def flank_tolerances(
    tolerance_class: int, *, diameter: float, normal_module: float, face_width: float
) -> FlankTolerances:
    """Compute the flank tolerances of a gear (ISO 1328-1:2013, section 5.3).

    Parameters
    ----------
    tolerance_class : int
        A, 1 to 11.
    diameter, normal_module, face_width : float
        Reference diameter, normal module and face width [m].

    Raises
    ------
    GeometryError
        A class or a size that the standard does not cover (E-ISO1328).
    """
    for name, value, low, high, unit in _checked(tolerance_class, diameter, normal_module, face_width):
        if not low <= value <= high:
            raise GeometryError(
                f"ISO 1328-1 has no tolerances for a {name} of {value:.6g} {unit}".rstrip(),
                code="E-ISO1328",
                value=value,
                limit=f"{low:g} .. {high:g} {unit}".rstrip(),
                remedy="give deviations in the sections of the gears",
            )
    d, m, b = 1e3 * diameter, 1e3 * normal_module, 1e3 * face_width
    step = math.sqrt(2.0) ** (tolerance_class - 5)
    profile_form, profile_slope = (0.55 * m + 5.0) * step, (0.4 * m + 0.001 * d + 4.0) * step
    helix_form = (0.07 * math.sqrt(d) + 0.45 * math.sqrt(b) + 4.0) * step
    helix_slope = (0.05 * math.sqrt(d) + 0.35 * math.sqrt(b) + 4.0) * step
    cumulative = (0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12.0) * step
    exact = FlankTolerances(
        pitch=(0.001 * d + 0.4 * m + 5.0) * step,
        cumulative_pitch=cumulative,
        profile_form=profile_form,
        profile_slope=profile_slope,
        profile=math.hypot(profile_form, profile_slope),
        helix_form=helix_form,
        helix_slope=helix_slope,
        helix=math.hypot(helix_form, helix_slope),
        runout=0.9 * cumulative,
    )
    return FlankTolerances(**{entry.name: 1e-6 * _rounded(getattr(exact, entry.name)) for entry in fields(exact)})


def tolerances_of_gear(gear: Gear, tolerance_class: int) -> FlankTolerances:
    """Compute the flank tolerances of a gear of the transverse section [m], see `flank_tolerances`."""
    return flank_tolerances(
        tolerance_class,
        diameter=2.0 * gear.reference_radius,
        normal_module=gear.module * math.cos(helix_of(gear)[0]),
        face_width=gear.face_width,
    )


def _checked(
    tolerance_class: int, diameter: float, normal_module: float, face_width: float
) -> Iterator[tuple[str, float, float, float, str]]:
    """Names, values and limits of what the tolerances depend on."""
    yield "flank tolerance class", tolerance_class, *CLASSES, ""
    for (name, limit), value in zip(_LIMITS.items(), (diameter, normal_module, face_width), strict=True):
        yield name, value, *limit


def _rounded(micrometres: float) -> float:
    """Tolerance [um] as the standard rounds it: to 1, 0.5 or 0.1 um."""
    step = 1.0 if micrometres > 10.0 else 0.5 if micrometres >= 5.0 else 0.1
    return step * math.floor(micrometres / step + 0.5)
