"""Stiffness of teeth and meshes after method B of ISO 6336-1, its formulas the same in the editions of 2006 and 2019.

Subscript 1 is the pinion, the gear with fewer teeth. Internal gears count as endless; their profile shift has the
sign of the standard, which is minus that of `gear.Gear`.
"""

from __future__ import annotations

import math

from femgear.errors import GeometryError
from femgear.gears.pair import GearPair
from femgear.gears.profile import base_helix_angle

# coefficients C1 .. C9 of the minimum flexibility q', ISO 6336-1:2019, eq. 82 (gears of one module depth)
_C = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
STEEL = 206e9
"""Young's modulus of the steel for which part 1 gives the stiffness of teeth [Pa]."""
THEORETICAL_CORRECTION = 0.8
"""C_M: measured over theoretical stiffness of solid gears."""
FULL_LINE_LOAD = 100e3
"""Line load F_t K_A/b below which teeth are softer [N/m]."""
BENDING_SHARE = 0.85
"""c_gamma_beta over c_gamma_alpha: stiffness of the mesh against misalignment over that against mean load."""


def material_factor(modulus_1: float, modulus_2: float) -> float:
    """Compute E/E_St of two gears, with which the stiffness of their teeth grows (ISO 6336-1, method B).

    ``E = 2 E_1 E_2/(E_1 + E_2)``, Young's moduli in Pa.
    """
    return 2.0 * modulus_1 / (modulus_1 + modulus_2) * modulus_2 / STEEL


def gear_blank_factor(web: float, rim: float) -> float:
    """Compute the gear blank factor C_R of gears with webs and thin rims (ISO 6336-1, method B).

    ``1 + ln(b_s/b)/(5 exp(s_R/(5 m_n)))``; 1 of solid discs.

    Parameters
    ----------
    web : float
        Thickness of the web over the face width, b_s/b; counts from 0.2 to 1.2.
    rim : float
        Thickness of the rim under the tooth in normal modules, s_R/m_n; counts from 1.
    """
    return 1.0 + math.log(min(max(web, 0.2), 1.2)) / (5.0 * math.exp(max(rim, 1.0) / 5.0))


def line_load_factor(line_load: float) -> float:
    """Compute by how much lightly loaded teeth are softer, ``((F_t K_A/b)/(100 N/mm))^0.25``, at most 1.

    The line load F_t K_A/b in N/m (ISO 6336-1, method B).
    """
    return min(line_load / FULL_LINE_LOAD, 1.0) ** 0.25


def theoretical_single_stiffness(
    teeth_1: int,
    teeth_2: float,
    shift_1: float,
    shift_2: float,
    *,
    helix_angle: float = 0.0,
    pressure_angle: float = math.radians(20.0),
) -> float:
    """Compute the theoretical stiffness c'_th [N/m^2] of a tooth pair of solid steel discs, per face width.

    ``1/c'_th = C1 + C2/z_n1 + C3/z_n2 + C4 x1 + C5 x1/z_n1 + C6 x2 + C7 x2/z_n2 + C8 x1^2 + C9 x2^2`` in
    mm um/N (ISO 6336-1, method B), fitted to x1 >= x2, -0.5 <= x1 + x2 <= 2 and 100 <= F_bt/b <= 1600 N/mm.

    Parameters
    ----------
    teeth_1 : int
        Of the pinion, the gear with fewer teeth: the formula is not symmetric.
    teeth_2 : float
        Of the wheel; ``math.inf`` for an internal gear.
    shift_1, shift_2 : float
        Profile shifts in modules; for an internal gear 2 the standard's shift enters as printed there, which
        is minus that of `gear.Gear`.
    helix_angle, pressure_angle : float
        [rad], in the normal section; ``z_n = z / (cos^2(beta_b) cos(beta))``.

    Raises
    ------
    GeometryError
        Shifts outside the range of the formula (E-ISO6336).
    """
    virtual = math.cos(base_helix_angle(pressure_angle, helix_angle)) ** 2 * math.cos(helix_angle)
    pinion, wheel = virtual / teeth_1, (0.0 if math.isinf(teeth_2) else virtual / teeth_2)
    terms = (
        1.0,
        pinion,
        wheel,
        shift_1,
        shift_1 * pinion,
        shift_2,
        shift_2 * wheel,
        shift_1**2,
        shift_2**2,
    )
    flexibility = sum(c * t for c, t in zip(_C, terms, strict=True))
    if not flexibility > 0.0:
        raise GeometryError(
            f"ISO 6336-1 method B gives the flexibility {flexibility:.4g} mm um/N",
            code="E-ISO6336",
            limit="> 0",
            remedy="the profile shifts are outside the range of method B (-0.5 <= x1 + x2 <= 2)",
        )
    return 1e9 / flexibility


def basic_rack_factor(*, dedendum: float, pressure_angle: float) -> float:
    """Compute the basic rack factor C_B (ISO 6336-1, method B).

    ``[1 + 0.5 (1.2 - h_fP/m)] [1 - 0.02 (20 deg - alpha_n)]``; ``dedendum`` in modules (the mean of both
    gears when they differ), ``pressure_angle`` [rad].
    """
    return (1.0 + 0.5 * (1.2 - dedendum)) * (1.0 - 0.02 * (20.0 - math.degrees(pressure_angle)))


def mesh_stiffness_method_b(
    teeth_1: int,
    teeth_2: float,
    shift_1: float,
    shift_2: float,
    contact_ratio: float,
    *,
    dedendum: float = 1.2,
    pressure_angle: float = math.radians(20.0),
    helix_angle: float = 0.0,
) -> tuple[float, float]:
    """Compute single stiffness c' and mean mesh stiffness c_gamma_alpha [N/m^2] after ISO 6336-1, method B.

    ``c' = c'_th C_M C_R C_B cos(beta)`` with C_M = 0.8, and ``c_gamma_alpha = c' (0.75 eps_alpha + 0.25)``,
    given for eps_alpha >= 1.2; under it the standard lets c' of spur gears be up to 10 % lower, not applied
    here. Both are for steel (E = 206 GPa) and solid discs, C_R = 1.

    Parameters
    ----------
    teeth_1, teeth_2, shift_1, shift_2, helix_angle
        As for `theoretical_single_stiffness`.
    contact_ratio : float
        Transverse contact ratio eps_alpha, at least 1.
    dedendum, pressure_angle : float
        Basic rack [modules, rad]; the defaults make C_B = 1.

    Returns
    -------
    c_single, c_mean : float
        [N/m^2], per unit face width (1 N/(mm um) = 1e9 N/m^2).

    Raises
    ------
    GeometryError
        Shifts outside the range of the formula (E-ISO6336).
    """
    rack = basic_rack_factor(dedendum=dedendum, pressure_angle=pressure_angle)
    solid = theoretical_single_stiffness(
        teeth_1, teeth_2, shift_1, shift_2, helix_angle=helix_angle, pressure_angle=pressure_angle
    )
    single = solid * THEORETICAL_CORRECTION * rack * math.cos(helix_angle)
    return single, single * (0.75 * contact_ratio + 0.25)


def pair_mesh_stiffness(pair: GearPair, helix_angle: float = 0.0) -> tuple[float, float]:
    """Compute c' and c_gamma_alpha [N/m^2] of a pair with both gears' racks, see `mesh_stiffness_method_b`.

    Gear 1 of the standard is the pinion, whatever comes first in the pair; of gears with as many teeth the
    one with the larger profile shift, for which the formula is fitted. An internal gear counts as endless,
    its shift with the sign of the standard. Gears with a helix angle [rad] are given by their transverse
    section; rack and shifts enter as those of the normal section.
    """
    normal = math.cos(helix_angle)
    pinion, wheel = sorted(pair.gears, key=lambda gear: (gear.internal, gear.teeth, -gear.profile_shift))
    teeth, shift = (math.inf, -wheel.profile_shift) if wheel.internal else (wheel.teeth, wheel.profile_shift)
    return mesh_stiffness_method_b(
        pinion.teeth,
        teeth,
        pinion.profile_shift / normal,
        shift / normal,
        pair.contact_ratio,
        dedendum=0.5 * (pinion.rack.dedendum + wheel.rack.dedendum) / normal,
        pressure_angle=math.atan(math.tan(pinion.pressure_angle) * normal),
        helix_angle=helix_angle,
    )
