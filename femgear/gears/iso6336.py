"""Nominal contact stress of gears after ISO 6336-2, what part 3 shares with it, and safeties.

sigma_H0 of spur and helical gears with tooth contact factors only: no application, dynamic or face load factors. The
helix factor is that of the corrigendum of 2008, and of the edition of 2019. The single pair factors Z_B and Z_D belong
to an `Edition`. Teeth and diameters of internal gears are negative in the standard and profile shifts have the opposite
sign of `gear.Gear` there. Helical gears are given by their transverse section, whose rack tells the helix angle
(`profile.BasicRack`). Root stresses are in `iso6336_root`, stiffness in `iso6336_stiffness`, load factors in
`iso6336_load`.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.profile import base_helix_angle, overlap_ratio

Edition = Literal[2006, 2019]
"""Edition of ISO 6336: parts 1 to 3 of 2006 with their corrigenda, or of 2019."""
LATEST_EDITION: Edition = 2019
UNMODIFIED, BY_EXPERIENCE, PROVEN = 1.2, 1.07, 1.0
"""f_ZCa of helical teeth without flank modifications, with those of the maker's experience, and with those that a
calculation of the load distribution has proven (ISO 6336-2:2019)."""


def helix_of(gear: Gear) -> tuple[float, float]:
    """Find the helix angles of a gear on the reference and the base cylinder [rad], 0 of a spur gear."""
    angle = math.acos(1.0 / gear.rack.stretch)
    return angle, base_helix_angle(normal_pressure_angle(gear), angle)


def overlap_of(gear: Gear, width: float) -> float:
    """Compute the overlap ratio eps_beta of a gear over a face width [m]."""
    return overlap_ratio(width, gear.module / gear.rack.stretch, helix_of(gear)[0])


def zone_factor(pressure_angle: float, working_angle: float, base_helix: float = 0.0) -> float:
    """Compute the zone factor Z_H (ISO 6336-2, section 6).

    ``sqrt(2 cos(beta_b) cos(alpha_wt) / (cos^2(alpha_t) sin(alpha_wt)))``: pressure angle and working
    pressure angle of the transverse section, and helix angle on the base cylinder, in rad.
    """
    return math.sqrt(2.0 * math.cos(base_helix) / math.tan(working_angle)) / math.cos(pressure_angle)


def elasticity_factor(youngs_modulus: float, poisson_ratio: float, mate: tuple[float, float] | None = None) -> float:
    """Compute Z_E = ``1/sqrt(pi ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2))`` [Pa^0.5] (ISO 6336-2, section 7).

    Young's modulus [Pa] and Poisson's ratio of one gear, and of its mate where that has others.
    """
    pair = (youngs_modulus, poisson_ratio), mate or (youngs_modulus, poisson_ratio)
    return 1.0 / math.sqrt(math.pi * sum((1.0 - nu**2) / modulus for modulus, nu in pair))


def contact_ratio_factor(contact_ratio: float, overlap: float = 0.0) -> float:
    """Compute the contact ratio factor Z_eps of the transverse contact ratio and the overlap ratio.

    ``sqrt((4 - eps_alpha)/3 (1 - eps_beta) + eps_beta/eps_alpha)``, eps_beta at most 1 (ISO 6336-2,
    section 8).
    """
    check_contact_ratio(contact_ratio)
    overlap = min(overlap, 1.0)
    return math.sqrt((4.0 - contact_ratio) / 3.0 * (1.0 - overlap) + overlap / contact_ratio)


def contact_helix_factor(helix_angle: float) -> float:
    """Compute the helix factor of the contact Z_beta = ``1/sqrt(cos(beta))`` (ISO 6336-2:2006/Cor 1:2008)."""
    return 1.0 / math.sqrt(math.cos(helix_angle))


def nominal_contact_stress(
    gear_1: Gear,
    gear_2: Gear,
    *,
    working_angle: float,
    contact_ratio: float,
    tangential_force: float,
    youngs_modulus: float,
    poisson_ratio: float,
    mate: tuple[float, float] | None = None,
) -> float:
    """Compute the nominal contact stress sigma_H0 [Pa] of a gear pair (ISO 6336-2, section 5).

    ``Z_H Z_E Z_eps Z_beta sqrt(F_t/(d_1 b) (u + 1)/u)``

    Parameters
    ----------
    gear_1 : Gear
        The external gear; of two, that with fewer teeth.
    gear_2 : Gear
        For an internal gear u is negative.
    working_angle : float
        Transverse working pressure angle of the pair [rad].
    contact_ratio : float
        Transverse contact ratio, 1 to 2.5.
    tangential_force : float
        F_t at the reference circle [N]: torque over reference radius, not negative.
    youngs_modulus, poisson_ratio : float
        Of both gears [Pa, 1].
    mate : (float, float), optional
        Those of one of them, where they differ.

    Raises
    ------
    GeometryError
        Contact ratio outside the range of the method (E-ISO6336).
    """
    width, (helix, base_helix) = min(gear_1.face_width, gear_2.face_width), helix_of(gear_1)
    zone = zone_factor(gear_1.pressure_angle, working_angle, base_helix)
    elasticity = elasticity_factor(youngs_modulus, poisson_ratio, mate)
    ratio = contact_ratio_factor(contact_ratio, overlap_of(gear_1, width))
    u = (-gear_2.teeth if gear_2.internal else gear_2.teeth) / gear_1.teeth
    line = tangential_force / (2.0 * gear_1.reference_radius * width) * (u + 1.0) / u
    return zone * elasticity * ratio * contact_helix_factor(helix) * math.sqrt(line)


def root_safety(limit: float, nominal: float, load_factor: float, *, reversed_bending: bool) -> float:
    """Compute the safety S_F against breakage of a tooth (ISO 6336-3, section 5), for long life.

    ``sigma_Flim Y_ST Y_M / (sigma_F0 K)`` with Y_ST = 2 and Y_M = 0.7 for teeth that bend both ways (annex B:
    planets); all other factors Y are 1.

    Parameters
    ----------
    limit, nominal : float
        sigma_Flim of the material (ISO 6336-5) and sigma_F0 [Pa].
    load_factor : float
        Product of the factors K of the load.
    """
    return 2.0 * limit * (0.7 if reversed_bending else 1.0) / (nominal * load_factor)


def contact_safety(limit: float, nominal: float, load_factor: float) -> float:
    """Compute the safety S_H against pitting (ISO 6336-2, section 5), for long life.

    ``sigma_Hlim / (sigma_H0 sqrt(K))`` with sigma_Hlim of the material (ISO 6336-5), sigma_H0 [Pa] times
    the larger of `single_pair_factors`, and the product K of the factors of the load; all other factors Z are 1.
    """
    return limit / (nominal * math.sqrt(load_factor))


def single_pair_factors(
    gear_1: Gear,
    gear_2: Gear,
    *,
    working_angle: float,
    path: tuple[float, float],
    edition: Edition = LATEST_EDITION,
    modified: float = UNMODIFIED,
) -> tuple[float, float]:
    """Compute Z_B of gear 1 and Z_D of gear 2, from the pitch point to a single pair in contact (ISO 6336-2, 6).

    Of spur teeth the root of the relative curvature at the inner point of single contact of either gear over that at
    the pitch point, at least 1; 1 of internal gears and where two pairs always touch. Of helical teeth with an
    overlap ratio of 1 and more it is 1 in the edition of 2006 and ``sqrt(f_ZCa)`` in that of 2019; between both the
    overlap ratio interpolates.

    Parameters
    ----------
    gear_1, gear_2 : Gear
        As of `nominal_contact_stress`.
    working_angle : float
        [rad].
    path : (float, float)
        Ends of the path of contact [m], from the pitch point outwards on gear 1.
    edition : int
        2006 or 2019.
    modified : float
        f_ZCa: `UNMODIFIED`, `BY_EXPERIENCE` or `PROVEN`.
    """
    low, high, pitch = *path, gear_1.base_pitch
    inner, outer, middle = (
        relative_curvature(gear_1, gear_2, working_angle=working_angle, path=place)
        for place in (high - pitch, low + pitch, 0.0)
    )
    spur = [1.0, 1.0] if high - low >= 2.0 * pitch else [math.sqrt(max(r / middle, 1.0)) for r in (inner, outer)]
    if gear_2.internal:
        spur[1] = 1.0
    overlap = min(overlap_of(gear_1, min(gear_1.face_width, gear_2.face_width)), 1.0)
    helical = math.sqrt(modified) if edition >= 2019 else 1.0
    first, second = (factor + overlap * (helical - factor) for factor in spur)
    return first, second


def relative_curvature(gear_1: Gear, gear_2: Gear, *, working_angle: float, path):
    """Compute the sum of the curvatures of two flanks in contact [1/m], that of an internal gear negative.

    At path coordinates (...) [m], 0 at the pitch point and positive outwards on gear 1; the
    working pressure angle in rad. Infinite where a flank begins at its base circle.
    """
    roll_1 = np.maximum(gear_1.base_radius * math.tan(working_angle) + path, 0.0)
    roll_2 = gear_2.base_radius * math.tan(working_angle) + (path if gear_2.internal else -path)
    with np.errstate(divide="ignore"):
        curvature = 1.0 / np.asarray(roll_1) + (-1.0 if gear_2.internal else 1.0) / np.maximum(roll_2, 0.0)
    return curvature if curvature.ndim else float(curvature)


def bending_face_factor(contact_factor, face_width: float, tooth_height: float):
    """Compute the face load factor of the root stress K_F-beta from K_H-beta of the contact (ISO 6336-1).

    ``K_Hbeta^N_F``, ``N_F = 1 / (1 + h/b + (h/b)^2)`` with h/b at most 1/3; face width b and tooth height h
    from root to tip of the gear with the smaller b/h [m].
    """
    ratio = min(tooth_height / face_width, 1 / 3)
    return contact_factor ** (1 / (1 + ratio + ratio**2))


def normal_pressure_angle(gear: Gear) -> float:
    """Compute the pressure angle of the normal section of a gear [rad]."""
    return math.atan(math.tan(gear.pressure_angle) / gear.rack.stretch)


def check_contact_ratio(contact_ratio: float) -> None:
    """Refuse a transverse contact ratio outside the range of the method (E-ISO6336)."""
    if not 1.0 <= contact_ratio < 2.5:
        raise GeometryError(
            f"nominal stresses for a contact ratio of {contact_ratio:.4g}",
            code="E-ISO6336",
            limit="1 .. 2.5",
            remedy="change tip diameters or profile shifts",
        )
