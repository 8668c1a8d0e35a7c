"""Involute relations: plain functions of numbers, no gears.

Lengths share one unit (metres elsewhere in femgear), angles are radians. Internal gears have positive
tooth numbers, and their profile shift is positive when it moves the flank outwards, to larger radii
(ISO 21771 prints the opposite sign).
"""

from __future__ import annotations

import math

import numpy as np

from femgear.errors import GeometryError

# coefficients of x^19, x^17, .. x^3 in the Taylor series of tan(x) (DLMF 4.19.3)
_TANGENT_SERIES = (
    443861162 / 1856156927625,
    6404582 / 10854718875,
    929569 / 638512875,
    21844 / 6081075,
    1382 / 155925,
    62 / 2835,
    17 / 315,
    2 / 15,
    1 / 3,
)


def inv(angle):
    """Involute function ``tan(angle) - angle`` (ISO 21771, eq. 9).

    Parameters
    ----------
    angle : float or array
        Pressure angle [rad], ``|angle| < pi/2``.

    Returns
    -------
    float or array [rad]
    """
    a = np.asarray(angle, dtype=float)
    # the difference loses digits below 0.15 rad, where these terms of the series are exact to rounding
    value = np.where(np.abs(a) < 0.15, a**3 * np.polyval(_TANGENT_SERIES, a * a), np.tan(a) - a)
    return float(value) if value.ndim == 0 else value


def arcinv(value):
    """Angle whose involute is ``value``; inverse of `inv` to double precision.

    Parameters
    ----------
    value : float or array
        ``inv(angle)`` [rad], >= 0.

    Returns
    -------
    float or array [rad], in [0, pi/2)

    Raises
    ------
    GeometryError
        Negative or not finite value: no such flank point.
    """
    v = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(v)) or np.any(v < 0.0):
        raise GeometryError(
            f"no pressure angle has the involute {float(np.min(v)):.6g} rad",
            code="E-INVOLUTE",
            value=float(np.min(v)),
            limit="inv(angle) >= 0",
            remedy="increase the sum of the profile shifts or the centre distance",
        )
    # start: small-angle root below one, tan(a) = v + a with a near pi/2 above
    a = np.where(v < 1.0, np.cbrt(3.0 * v) / (1.0 + 0.26 * np.cbrt(v) ** 2), np.arctan(v + math.pi / 2))
    for _ in range(30):
        tangent = np.tan(a)
        slope = np.where(tangent == 0.0, 1.0, tangent * tangent)
        step = (np.asarray(inv(a)) - v) / slope
        a = np.clip(a - step, 0.0, np.nextafter(math.pi / 2, 0.0))
        if np.all(np.abs(step) <= 2e-16 * np.maximum(a, 1e-300)):
            break
    a = np.where(v == 0.0, 0.0, a)
    return float(a) if a.ndim == 0 else a


def pressure_angle_at(radius, base_radius):
    """Pressure angle [rad] of an involute at a radius, ``cos(alpha) = r_b / r``.

    ``radius`` (float or array) must not be smaller than ``base_radius``.
    """
    r = np.asarray(radius, dtype=float)
    roll = np.sqrt(np.maximum((r - base_radius) * (r + base_radius), 0.0))
    value = np.arctan2(roll, base_radius)
    return float(value) if value.ndim == 0 else value


def working_pressure_angle(
    teeth_1: int,
    teeth_2: int,
    shift_1: float,
    shift_2: float,
    pressure_angle: float,
    *,
    internal: bool = False,
) -> float:
    """Pressure angle at which two gears run without backlash.

    External: ``inv(aw) = inv(a) + 2 tan(a) (x1 + x2)/(z1 + z2)`` (ISO 21771, eq. 60); internal (gear 2):
    ``inv(aw) = inv(a) + 2 tan(a) (x2 - x1)/(z2 - z1)`` with the sign of the module docstring.

    Returns
    -------
    float
        Working transverse pressure angle [rad].

    Raises
    ------
    GeometryError
        ``inv(aw)`` would be negative.
    """
    total = teeth_2 - teeth_1 if internal else teeth_1 + teeth_2
    shift = shift_2 - shift_1 if internal else shift_1 + shift_2
    return arcinv(inv(pressure_angle) + 2.0 * math.tan(pressure_angle) * shift / total)


def reference_centre_distance(teeth_1: int, teeth_2: int, module: float, *, internal: bool = False) -> float:
    """Centre distance ``m (z2 +- z1)/2`` of unshifted gears, in the unit of the module."""
    return 0.5 * module * (teeth_2 - teeth_1 if internal else teeth_1 + teeth_2)


def angle_at_centre_distance(
    teeth_1: int,
    teeth_2: int,
    module: float,
    pressure_angle: float,
    centre_distance: float,
    *,
    internal: bool = False,
) -> float:
    """Working pressure angle [rad] at a centre distance, ``cos(aw) = a0 cos(alpha) / a``.

    Raises
    ------
    GeometryError
        The base circles would overlap (``cos(aw) > 1``).
    """
    base = reference_centre_distance(teeth_1, teeth_2, module, internal=internal) * math.cos(pressure_angle)
    if not centre_distance >= base:
        raise GeometryError(
            f"at a centre distance of {centre_distance * 1e3:.6g} mm the base circles of {teeth_1} and "
            f"{teeth_2} teeth leave no line of action (cos(alpha_w) > 1 below {base * 1e3:.6g} mm)",
            code="E-CENTRE-DISTANCE",
            key="set.centre_distance",
            value=centre_distance,
            limit=f">= {math.ceil(base * 1e7) / 1e4:.4f} mm",
            remedy="increase the centre distance or reduce the tooth numbers or the module",
        )
    return pressure_angle_at(centre_distance, base)


def shift_for_angle(
    teeth_1: int, teeth_2: int, pressure_angle: float, working_angle: float, *, internal: bool = False
) -> float:
    """Sum (external) or difference ``x2 - x1`` (internal) of the shifts that run without backlash.

    Inverse of `working_pressure_angle` (ISO 21771, eq. 60).
    """
    total = teeth_2 - teeth_1 if internal else teeth_1 + teeth_2
    return total * (inv(working_angle) - inv(pressure_angle)) / (2.0 * math.tan(pressure_angle))


def contact_ratio_external(
    tip_1: float, base_1: float, tip_2: float, base_2: float, centre_distance: float, base_pitch: float
) -> float:
    """Transverse contact ratio of an external pair from its radii.

    ``(sqrt(ra1^2 - rb1^2) + sqrt(ra2^2 - rb2^2) - a sin(aw)) / p_b`` with ``a cos(aw) = rb1 + rb2``
    (ISO 6336-1; ISO 21771, eq. 73).
    """
    path = roll(tip_1, base_1) + roll(tip_2, base_2) - roll(centre_distance, base_1 + base_2)
    return path / base_pitch


def contact_ratio_internal(
    tip_1: float, base_1: float, tip_2: float, base_2: float, centre_distance: float, base_pitch: float
) -> float:
    """Transverse contact ratio of an external gear 1 in an internal gear 2.

    ``(sqrt(ra1^2 - rb1^2) - sqrt(ra2^2 - rb2^2) + a sin(aw)) / p_b`` with ``a cos(aw) = rb2 - rb1``.
    """
    path = roll(tip_1, base_1) - roll(tip_2, base_2) + roll(centre_distance, base_2 - base_1)
    return path / base_pitch


def roll(radius, base_radius):
    """Roll length ``sqrt(r^2 - rb^2)``: distance from the base tangent point to the flank point.

    Float or array; ``radius >= base_radius``, in the unit of the radii.
    """
    r = np.asarray(radius, dtype=float)
    value = np.sqrt(np.maximum((r - base_radius) * (r + base_radius), 0.0))
    return float(value) if value.ndim == 0 else value


def limiting_contact_ratio(pressure_angle: float) -> float:
    """Contact ratio of two racks with addendum one module, ``4 / (pi sin(2 alpha))``."""
    return 4.0 / (math.pi * math.sin(2.0 * pressure_angle))


def undercut_teeth(pressure_angle: float, *, depth: float = 1.0, shift: float = 0.0) -> float:
    """Tooth number below which a rack undercuts, ``2 (h - x) / sin^2(alpha)``.

    ``depth`` is the depth of the straight tool flank below the tool's reference line, in modules.
    """
    return 2.0 * (depth - shift) / math.sin(pressure_angle) ** 2


def undercut_shift(teeth: int, pressure_angle: float, *, depth: float = 1.0) -> float:
    """Least profile shift without undercut, ``h - z sin^2(alpha)/2``, in modules (see `undercut_teeth`)."""
    return depth - 0.5 * teeth * math.sin(pressure_angle) ** 2


def largest_root_radius(pressure_angle: float, dedendum: float) -> float:
    """Largest tip rounding of a rack of that dedendum, both in modules (ISO 53, 5.8).

    The rounding circles of both flanks then share their centre:
    ``(pi/4 - h tan(alpha)) / (1/cos(alpha) - tan(alpha))``.
    """
    tangent = math.tan(pressure_angle)
    return (math.pi / 4 - dedendum * tangent) / (1.0 / math.cos(pressure_angle) - tangent)


def pointed_tip_angle(teeth: int, shift: float, pressure_angle: float) -> float:
    """Pressure angle [rad] where the flanks of an external tooth meet.

    ``inv(alpha_p) = pi/(2 z) + 2 x tan(alpha)/z + inv(alpha)``; the pointed radius is ``rb / cos(alpha_p)``.
    """
    return arcinv((0.5 * math.pi + 2.0 * shift * math.tan(pressure_angle)) / teeth + inv(pressure_angle))


def pointed_tip_shift(teeth: int, pressure_angle: float, *, addendum: float = 1.0) -> float:
    """Profile shift that makes the tip of radius ``m (z/2 + h + x)`` pointed.

    Solved by bisection between no shift and four modules.

    Raises
    ------
    GeometryError
        The tooth is not pointed anywhere in that range, or everywhere.
    """

    def margin(shift):
        tip = 0.5 * teeth + addendum + shift
        angle = pressure_angle_at(tip, 0.5 * teeth * math.cos(pressure_angle))
        return pointed_tip_angle(teeth, shift, pressure_angle) - angle

    low, high = 0.0, 4.0
    if margin(low) < 0.0 or margin(high) > 0.0:
        raise GeometryError(
            f"no profile shift between 0 and 4 makes the tip of {teeth} teeth just pointed",
            code="E-POINTED",
            value=teeth,
        )
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if margin(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def internal_interference(tip_2: float, base_1: float, base_2: float, centre_distance: float) -> float:
    """Room [m] between the contact of an internal gear's tip and the end of the pinion's involute.

    ``sqrt(ra2^2 - rb2^2) - a sin(aw)`` with ``a cos(aw) = rb2 - rb1``: negative means involute interference
    (the tip of the internal gear meets the pinion below its base circle).
    """
    return roll(tip_2, base_2) - roll(centre_distance, base_2 - base_1)


def trochoid_interference(
    teeth_1: int,
    teeth_2: int,
    tip_1: float,
    tip_2: float,
    base_1: float,
    base_2: float,
    centre_distance: float,
) -> float:
    """Angle [rad] at the internal gear by which the tip corners of an internal pair miss each other.

    ``z1/z2 (phi1 + inv(aa1) - inv(aw)) + inv(aw) - inv(aa2) - phi2`` with the angles phi1, phi2 of the
    crossing of both tip circles at the two centres (Colbourne, The Geometry of Involute Gears, ch. 8):
    negative means that the teeth strike each other outside the path of contact. ``inf`` when the tip
    circles do not cross.
    """
    a = centre_distance
    cos_1 = (tip_2**2 - tip_1**2 - a**2) / (2.0 * a * tip_1)
    cos_2 = (tip_2**2 - tip_1**2 + a**2) / (2.0 * a * tip_2)
    if abs(cos_1) >= 1.0 or abs(cos_2) >= 1.0:
        return math.inf
    working = inv(pressure_angle_at(a, base_2 - base_1))
    angle_1 = math.acos(cos_1) + inv(pressure_angle_at(tip_1, base_1)) - working
    angle_2 = math.acos(cos_2) + inv(pressure_angle_at(tip_2, base_2)) - working
    return angle_1 * teeth_1 / teeth_2 - angle_2


def transverse_angle(normal_pressure_angle: float, helix_angle: float) -> float:
    """Transverse pressure angle [rad], ``tan(alpha_t) = tan(alpha_n) / cos(beta)``."""
    return math.atan(math.tan(normal_pressure_angle) / math.cos(helix_angle))


def base_helix_angle(normal_pressure_angle: float, helix_angle: float) -> float:
    """Helix angle [rad] on the base cylinder, ``sin(beta_b) = sin(beta) cos(alpha_n)``."""
    return math.asin(math.sin(helix_angle) * math.cos(normal_pressure_angle))


def overlap_ratio(face_width: float, normal_module: float, helix_angle: float) -> float:
    """Overlap ratio ``b sin(beta) / (pi m_n)``."""
    return face_width * math.sin(abs(helix_angle)) / (math.pi * normal_module)
