"""Mesh stiffness after ISO 6336-1, method B: a check of computed stiffness, not an input to it."""

from __future__ import annotations

import math

from femgear.errors import GeometryError

# coefficients C1 .. C9 of the minimum flexibility q', ISO 6336-1:2019, eq. 82 (gears of one module depth)
_C = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
THEORETICAL_CORRECTION = 0.8
"""C_M: measured over theoretical stiffness of solid gears."""
STEEL_MODULUS = 206e9
"""Young's modulus [Pa] that the coefficients are made for."""


def theoretical_single_stiffness(
    teeth_1: int, teeth_2: float, shift_1: float, shift_2: float, *, helix_angle: float = 0.0
) -> float:
    """Theoretical single tooth-pair stiffness c'_th [N/m^2], per unit face width, of solid steel discs.

    ``1/c'_th = C1 + C2/z_n1 + C3/z_n2 + C4 x1 + C5 x1/z_n1 + C6 x2 + C7 x2/z_n2 + C8 x1^2 + C9 x2^2`` in
    mm um/N (ISO 6336-1, method B), fitted to x1 >= x2, -0.5 <= x1 + x2 <= 2 and 100 <= F_bt/b <= 1600 N/mm.

    Parameters
    ----------
    teeth_1 : int
    teeth_2 : float
        ``math.inf`` for an internal gear.
    shift_1, shift_2 : float
        Profile shifts in modules; for an internal gear 2 the standard's shift enters as printed there, which
        is minus that of `gear.Gear`.
    helix_angle : float
        [rad]; z_n is taken as ``z / cos^3(beta)``.

    Returns
    -------
    float
        [N/m^2]: force per face width per deflection; 1 N/(mm um) is 1e9 N/m^2.
    """
    cube = math.cos(helix_angle) ** 3
    one, two = cube / teeth_1, (0.0 if math.isinf(teeth_2) else cube / teeth_2)
    terms = (1.0, one, two, shift_1, shift_1 * one, shift_2, shift_2 * two, shift_1**2, shift_2**2)
    flexibility = sum(c * t for c, t in zip(_C, terms, strict=True))
    if not flexibility > 0.0:
        raise GeometryError(
            f"ISO 6336-1 method B gives the flexibility {flexibility:.4g} mm um/N",
            code="E-ISO6336",
            value=flexibility,
            limit="> 0",
            remedy="the profile shifts are outside the range of method B (-0.5 <= x1 + x2 <= 2)",
        )
    return 1e9 / flexibility


def basic_rack_factor(*, dedendum: float, pressure_angle: float) -> float:
    """C_B = ``[1 + 0.5 (1.2 - h_fP/m)] [1 - 0.02 (20 deg - alpha_n)]`` (ISO 6336-1, method B).

    ``dedendum`` in modules (the mean of both gears when they differ), ``pressure_angle`` [rad].
    """
    return (1.0 + 0.5 * (1.2 - dedendum)) * (1.0 - 0.02 * (20.0 - math.degrees(pressure_angle)))


def blank_factor(*, web_ratio: float, rim_ratio: float) -> float:
    """C_R = ``1 + ln(b_s/b) / (5 exp(s_R/(5 m)))`` of gears with a web (ISO 6336-1, method B).

    ``web_ratio`` is b_s/b, web thickness over face width, taken within 0.2 .. 1.2; ``rim_ratio`` is s_R/m,
    rim thickness over module, taken as at least 1. It is 1 for solid discs.
    """
    web = min(max(web_ratio, 0.2), 1.2)
    return 1.0 + math.log(web) / (5.0 * math.exp(max(rim_ratio, 1.0) / 5.0))


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
    youngs_modulus: float = STEEL_MODULUS,
    blank_factor: float = 1.0,
) -> tuple[float, float]:
    """Single stiffness c' and mean mesh stiffness c_gamma_alpha after ISO 6336-1, method B.

    ``c' = c'_th C_M C_R C_B cos(beta)``, C_M = 0.8, and ``c_gamma_alpha = c' (0.75 eps_alpha + 0.25)``, given
    for eps_alpha >= 1.2; under it the standard lets c' of spur gears be up to 10 % lower, not applied here.

    Parameters
    ----------
    teeth_1, teeth_2, shift_1, shift_2, helix_angle
        As for `theoretical_single_stiffness`.
    contact_ratio : float
        Transverse contact ratio eps_alpha, at least 1.
    dedendum, pressure_angle : float
        Basic rack [modules, rad]; the defaults make C_B = 1.
    youngs_modulus : float
        Of both gears [Pa]; c' is scaled with E/206 GPa.
    blank_factor : float
        C_R, 1 for solid discs.

    Returns
    -------
    c_single, c_mean : float
        [N/m^2], per unit face width (1 N/(mm um) = 1e9 N/m^2).

    Raises
    ------
    GeometryError
        Contact ratio under one, or shifts outside the range of the formula (E-ISO6336).
    """
    if not contact_ratio >= 1.0:
        raise GeometryError(
            f"mesh stiffness for a contact ratio of {contact_ratio:.4g}",
            code="E-ISO6336",
            value=contact_ratio,
            limit=">= 1",
            remedy="lengthen the tips or change the profile shifts",
        )
    rack = basic_rack_factor(dedendum=dedendum, pressure_angle=pressure_angle)
    solid = theoretical_single_stiffness(teeth_1, teeth_2, shift_1, shift_2, helix_angle=helix_angle)
    material = youngs_modulus / STEEL_MODULUS
    single = solid * THEORETICAL_CORRECTION * blank_factor * rack * math.cos(helix_angle) * material
    return single, single * (0.75 * contact_ratio + 0.25)
