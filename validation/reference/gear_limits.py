"""Closed forms of gear geometry that nothing in femgear computes with: contact ratios, limits, neighbours.

Lengths share one unit, angles are radians; internal gears have positive tooth numbers.
"""

from __future__ import annotations

import math

from femgear.errors import GeometryError
from femgear.gears.profile import arcinv, inv, pressure_angle_at, roll


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


def limiting_contact_ratio(pressure_angle: float) -> float:
    """Contact ratio of two racks with addendum one module, ``4 / (pi sin(2 alpha))``."""
    return 4.0 / (math.pi * math.sin(2.0 * pressure_angle))


def undercut_teeth(pressure_angle: float, *, depth: float = 1.0, shift: float = 0.0) -> float:
    """Tooth number below which a rack undercuts, ``2 (h - x) / sin^2(alpha)``.

    ``depth`` is the depth of the straight tool flank below the tool's reference line, in modules.
    """
    return 2.0 * (depth - shift) / math.sin(pressure_angle) ** 2


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


def neighbour_limit(sun_teeth: int, planet_teeth: int) -> float:
    """Number of equal planets, unshifted, whose tip circles would just touch.

    ``pi / asin((z_p + 2)/(z_s + z_p))``; infinite where the ratio exceeds one it is 1: not even two fit.
    """
    ratio = (planet_teeth + 2) / (sun_teeth + planet_teeth)
    return math.pi / math.asin(ratio) if ratio < 1.0 else 1.0
