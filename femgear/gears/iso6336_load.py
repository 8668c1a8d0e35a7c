"""Load factors of ISO 6336-1: K_v by methods B and C, K_Halpha and K_Falpha by method B, K_Hbeta by method C.

They are the standard's estimates, beside what femgear computes: the dynamic factor from the response, the face load
factor from contact over the width. Formulas are those of the edition of 2019, which keeps them of 2006. Deviations
[m] are the tolerances of the flanks (`femgear.gears.tolerances`), less what running-in takes off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.iso6336 import contact_ratio_factor
from femgear.gears.iso6336_stiffness import FULL_LINE_LOAD

Running = Literal["through hardened", "cast iron", "surface hardened"]
"""How flanks run in: St, V, GGG (perlitic, bainitic); GG, GGG (ferritic); Eh, IF, NT, NV."""
SPUR_K1 = {3: 2.1, 4: 3.9, 5: 7.5, 6: 14.9, 7: 26.8, 8: 39.1, 9: 52.8, 10: 76.6, 11: 102.6, 12: 146.3}
HELICAL_K1 = {3: 1.9, 4: 3.5, 5: 6.7, 6: 13.3, 7: 23.9, 8: 34.8, 9: 47.0, 10: 68.2, 11: 91.4, 12: 130.3}
"""K_1 of method C by flank tolerance class."""
SPUR_K2, HELICAL_K2 = 0.0193, 0.0087


@dataclass(frozen=True)
class DynamicFactor:
    """Dynamic factor K_v of a pair after ISO 6336-1 and what it rests on.

    Parameters
    ----------
    factor : float
        K_v.
    resonance_ratio : float
        N: speed of the pinion over that of its main resonance.
    range : str
        ``"subcritical"``, ``"main resonance"``, ``"intermediate"`` or ``"supercritical"``.
    """

    factor: float
    resonance_ratio: float
    range: str


def running_in(deviation: float, kind: Running, *, contact_limit: float, speed: float) -> float:
    """Compute by how much running-in reduces a deviation, y_alpha, y_p or y_f [m] (ISO 6336-1, section 8).

    Parameters
    ----------
    deviation : float
        f_pb, or f_falpha for y_f [m].
    kind : str
        See `Running`.
    contact_limit : float
        sigma_Hlim [Pa], for through hardened steel.
    speed : float
        Pitch line velocity [m/s].
    """
    if kind == "surface hardened":
        return min(0.075 * deviation, 3e-6)
    if kind == "cast iron":
        most = math.inf if speed <= 5.0 else 22e-6 if speed <= 10.0 else 11e-6
        return min(0.275 * deviation, most)
    limit = 1e-6 * contact_limit
    most = math.inf if speed <= 5.0 else (12.8e-3 if speed <= 10.0 else 6.4e-3) / limit
    return min(160.0 / limit * deviation, most)


def face_running_in(misalignment: float, kind: Running, *, contact_limit: float, speed: float) -> float:
    """Compute by how much running-in reduces the mesh misalignment F_betax, y_beta [m] (ISO 6336-1, section 7).

    Parameters as for `running_in`.
    """
    if kind == "surface hardened":
        return min(0.15 * misalignment, 6e-6)
    if kind == "cast iron":
        most = math.inf if speed <= 5.0 else 45e-6 if speed <= 10.0 else 22e-6
        return min(0.55 * misalignment, most)
    limit = 1e-6 * contact_limit
    most = math.inf if speed <= 5.0 else (25.6e-3 if speed <= 10.0 else 12.8e-3) / limit
    return min(320.0 / limit * misalignment, misalignment, most)


def disc_inertia(gear: Gear, density: float) -> float:
    """Compute the mass of a gear at its base circle per face width [kg/m], of a disc up to its mean diameter.

    ``J*/r_b^2`` with ``J* = pi/32 rho (d_m^4 - d_i^4)`` of an external gear, of a ring with its outer diameter in the
    place of the mean one; density in kg/m^3 (ISO 6336-1, eq. 30).
    """
    mean = gear.tip_radius + gear.root_radius
    outer, inner = (2.0 * gear.rim_radius, mean) if gear.internal else (mean, 2.0 * gear.rim_radius)
    return math.pi / 32.0 * density * (outer**4 - inner**4) / gear.base_radius**2


def reduced_mass(mass_1: float, mass_2: float = math.inf) -> float:
    """Compute the mass of a pair at the line of action [kg/m], ``m_1 m_2/(m_1 + m_2)``; infinite of a fixed gear."""
    return mass_1 if math.isinf(mass_2) else mass_1 * mass_2 / (mass_1 + mass_2)


def resonance_speed(teeth: int, mesh_stiffness: float, mass: float) -> float:
    """Compute the speed of the pinion at the main resonance of the mesh [rad/s], ``sqrt(c_gammaalpha/m_red)/z_1``.

    Teeth of the pinion, mesh stiffness [N/m^2] and reduced mass [kg/m], both per face width (ISO 6336-1, eq. 6).
    """
    return math.sqrt(mesh_stiffness / mass) / teeth


def dynamic_factor(
    *,
    resonance_ratio: float,
    line_load: float,
    stiffness: float,
    contact_ratio: float,
    pitch_deviation: float,
    profile_deviation: float,
    tip_relief: float | None = None,
) -> DynamicFactor:
    """Compute the dynamic factor K_v of a pair (ISO 6336-1, section 6, method B).

    Parameters
    ----------
    resonance_ratio : float
        N, see `resonance_speed`.
    line_load : float
        F_t K_A/b, of sets times K_gamma [N/m].
    stiffness : float
        c' [N/m^2], with C_R.
    contact_ratio : float
        Total contact ratio eps_gamma, above 1.
    pitch_deviation, profile_deviation : float
        Effective f_pb and f_falpha, less `running_in` [m].
    tip_relief : float, optional
        C_a [m]; None takes ``B_k = 1``, as of gears of flank tolerance class 6 and coarser.
    """
    share = stiffness / line_load
    pitch, profile = share * pitch_deviation, share * profile_deviation
    relief = 1.0 if tip_relief is None else abs(1.0 - share * tip_relief)
    first, second, third, fourth, fifth, sixth, seventh = _dynamic_coefficients(contact_ratio)

    def resonant() -> float:
        return 1.0 + first * pitch + second * profile + fourth * relief

    def above() -> float:
        return fifth * pitch + sixth * profile + seventh

    limit = 0.85 if line_load >= FULL_LINE_LOAD else 0.5 + 0.35 * math.sqrt(line_load / FULL_LINE_LOAD)
    if resonance_ratio <= limit:
        slope = first * pitch + second * profile + third * relief
        return DynamicFactor(1.0 + resonance_ratio * slope, resonance_ratio, "subcritical")
    if resonance_ratio <= 1.15:
        return DynamicFactor(resonant(), resonance_ratio, "main resonance")
    if resonance_ratio < 1.5:
        between = above() + (resonant() - above()) / 0.35 * (1.5 - resonance_ratio)
        return DynamicFactor(between, resonance_ratio, "intermediate")
    return DynamicFactor(above(), resonance_ratio, "supercritical")


def _dynamic_coefficients(contact_ratio: float) -> tuple[float, ...]:
    """C_v1 .. C_v7 of the total contact ratio."""
    total = contact_ratio
    if not total > 1.0:
        raise GeometryError(
            f"K_v for a total contact ratio of {total:.4g}",
            code="E-ISO6336",
            limit="> 1",
            remedy="change tip diameters or profile shifts",
        )
    if total <= 2.0:
        low = (0.32, 0.34, 0.23, 0.90, 0.47, 0.47)
    else:
        low = (
            0.32,
            0.57 / (total - 0.3),
            0.096 / (total - 1.56),
            (0.57 - 0.05 * total) / (total - 1.44),
            0.47,
            0.12 / (total - 1.74),
        )
    if total <= 1.5:
        return (*low, 0.75)
    return (*low, 0.125 * math.sin(math.pi * (total - 2.0)) + 0.875 if total <= 2.5 else 1.0)


def dynamic_factor_of_speed(
    *, grade: int, teeth: int, speed: float, ratio: float, line_load: float, overlap: float = 0.0
) -> float:
    """Compute the dynamic factor K_v of a pair by its speed and class alone (ISO 6336-1, section 6, method C).

    Parameters
    ----------
    grade : int
        Flank tolerance class of ISO 1328-1, 3 to 12.
    teeth : int
        Of the pinion.
    speed : float
        Pitch line velocity [m/s].
    ratio : float
        Gear ratio u, at least 1 in size.
    line_load : float
        F_t K_A/b, counted from 100 N/mm [N/m].
    overlap : float
        Overlap ratio, which up to 1 leads from spur to helical teeth.
    """
    if grade not in SPUR_K1:
        raise GeometryError(
            f"K_v by method C for flank tolerance class {grade}",
            code="E-ISO6336",
            limit="3 .. 12",
            remedy="give a quality of 3 to 12",
        )
    turned = 1e-2 * speed * teeth * math.sqrt(ratio**2 / (1.0 + ratio**2))
    third = 2.0 if turned <= 0.2 else 2.071 - 0.357 * turned
    load = 1e-3 * max(line_load, FULL_LINE_LOAD)
    spur, helical = (
        1.0 + (first[grade] / load + second) * turned * third
        for first, second in ((SPUR_K1, SPUR_K2), (HELICAL_K1, HELICAL_K2))
    )
    return spur - min(overlap, 1.0) * (spur - helical)


def transverse_load_factors(
    *, line_load: float, mesh_stiffness: float, contact_ratio: float, overlap: float, pitch_deviation: float
) -> tuple[float, float]:
    """Compute K_Halpha and K_Falpha of a pair (ISO 6336-1, section 8, method B).

    Parameters
    ----------
    line_load : float
        F_tH/b with ``F_tH = F_t K_A K_gamma K_v K_Hbeta`` [N/m].
    mesh_stiffness : float
        c_gammaalpha [N/m^2].
    contact_ratio, overlap : float
        eps_alpha and eps_beta.
    pitch_deviation : float
        f_pb less y_alpha [m].
    """
    total = contact_ratio + overlap
    unequal = 0.4 * mesh_stiffness * pitch_deviation / line_load
    factor = 0.5 * total * (0.9 + unequal) if total <= 2.0 else 0.9 + math.sqrt(2.0 * (total - 1.0) / total) * unequal
    flank = total / (contact_ratio * contact_ratio_factor(contact_ratio, overlap) ** 2)
    root = total / (0.25 * contact_ratio + 0.75)
    return max(min(factor, flank), 1.0), max(min(factor, root), 1.0)


def mesh_misalignment_of_tolerances(
    line_load: float, slopes: tuple[float, float], *, width: float, pinion_diameter: float | None = None
) -> float:
    """Compute F_betax of a mesh [m] without its shafts and bearings (ISO 6336-1, section 7, method C).

    ``1.33 f_sh + f_ma``, at least ``0.005 F_m/b`` and half of f_Hbeta. The misalignment of manufacture f_ma has the
    tolerances of both gears, ``sqrt(f_Hbeta1^2 + f_Hbeta2^2)``. The deflection of the pinion is that of a solid shaft
    of its own diameter in the middle between its bearings, ``f_sh = 0.023 F_m/b (b/d_1)^2``; lengths in um and mm,
    loads in N/mm.

    Parameters
    ----------
    line_load : float
        F_m/b [N/m].
    slopes : (float, float)
        f_Hbeta of both gears [m].
    width : float
        Common face width [m].
    pinion_diameter : float, optional
        d_1 [m]; without it no deflection is taken, as of gears of a set, whose forces balance.
    """
    load = 1e-3 * line_load
    bent = 0.0 if pinion_diameter is None else 0.023e-6 * load * (width / pinion_diameter) ** 2
    return max(1.33 * bent + math.hypot(*slopes), 0.005e-6 * load, 0.5 * max(slopes))


def face_load_factor(misalignment: float, line_load: float, stiffness: float) -> float:
    """Compute K_Hbeta of linear teeth under a misalignment (ISO 6336-1, section 7, method C).

    ``1 + F_betay c_gammabeta/(2 F_m/b)`` up to 2, beyond, where part of the width is bare, ``sqrt(2 F_betay
    c_gammabeta/(F_m/b))``.

    Parameters
    ----------
    misalignment : float
        F_betay over the face width, after running-in [m].
    line_load : float
        F_m/b with ``F_m = F_t K_A K_gamma K_v`` [N/m].
    stiffness : float
        c_gammabeta [N/m^2], see `femgear.gears.iso6336_stiffness.BENDING_SHARE`.
    """
    share = 0.5 * misalignment * stiffness / line_load
    return 1.0 + share if share <= 1.0 else 2.0 * math.sqrt(share)
