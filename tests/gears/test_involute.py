"""Involute relations against closed forms and high-precision numbers."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears import profile as iv
from femgear.gears.gear import Gear
from femgear.gears.pair import working_pressure_angle, zero_backlash_distance, zero_backlash_shift
from validation.reference import gear_limits as limits

ALPHA = math.radians(20.0)


def test_inv_is_accurate_for_small_angles_too():
    """tan by its continued fraction in exact rational arithmetic."""
    for angle in (1e-4, 0.01, 0.0299, 0.1, 0.1499):
        x, fraction = Fraction(angle), Fraction(0)
        for k in range(25, 0, -2):
            fraction = x * x / (k - fraction)
        assert iv.inv(angle) == pytest.approx(float(fraction / x - x), rel=1e-15)


def test_inv_is_continuous_where_the_series_ends():
    below, above = np.nextafter(0.15, 0.0), 0.15
    assert iv.inv(below) == pytest.approx(iv.inv(above), rel=1e-13)


def test_arcinv_is_the_inverse_to_rounding_on_the_whole_range():
    angles = np.concatenate([np.geomspace(1e-4, 0.1, 40), np.linspace(0.1, 1.55, 60)])
    assert np.max(np.abs(iv.arcinv(iv.inv(angles)) / angles - 1.0)) < 2e-14
    assert iv.arcinv(0.0) == 0.0


@pytest.mark.parametrize("value", [-1e-9, math.nan, math.inf, [0.01, math.nan, 0.02], [0.01, -1e-9]])
def test_arcinv_refuses_what_has_no_angle(value):
    with pytest.raises(GeometryError) as caught:
        iv.arcinv(value)
    assert caught.value.code == "E-GEOMETRY"


def pair(teeth, shifts=(0.0, 0.0), *, internal=False):
    """Gears of module 1.5 mm; the second may be internal."""
    one, two = (Gear(z, 1.5e-3, ALPHA, x, 0.02, 5e-3) for z, x in zip(teeth, shifts))
    return one, replace(two, internal=True, rim_radius=0.1) if internal else two


def test_centre_distance_and_shift_are_inverse_for_both_kinds_of_mesh():
    for internal, teeth, shifts in ((False, (17, 34), (0.3, 0.1)), (True, (20, 80), (-0.1, 0.25))):
        gears = pair(teeth, shifts, internal=internal)
        wanted = shifts[1] - shifts[0] if internal else sum(shifts)
        found = zero_backlash_shift(*gears, zero_backlash_distance(*gears))
        assert found == pytest.approx(wanted, rel=1e-12)


def test_positive_shift_of_an_internal_gear_moves_its_flank_outwards():
    # a wider ring lets the planet run at a larger centre distance, hence a larger working angle
    gears = pair((20, 80), (0.0, 0.2), internal=True)
    assert working_pressure_angle(*gears, zero_backlash_distance(*gears)) > ALPHA


def test_centre_distance_below_the_base_circles_is_refused_with_the_limit():
    with pytest.raises(GeometryError) as caught:
        working_pressure_angle(*pair((27, 40)), 47e-3)
    assert caught.value.code == "E-CENTRE-DISTANCE"
    assert "47.2196" in caught.value.limit  # 50.25 cos 20 deg
    with pytest.raises(GeometryError):
        working_pressure_angle(*pair((27, 40)), 0.0)


def test_largest_root_radius_of_the_iso_rack():
    assert limits.largest_root_radius(ALPHA, 1.25) == pytest.approx(0.472, abs=5e-4)  # ISO 53, profiles C and D


def test_undercut_limits_agree_with_each_other():
    assert iv.undercut_shift(limits.undercut_teeth(ALPHA), ALPHA) == pytest.approx(0.0, abs=1e-15)
    assert limits.undercut_teeth(ALPHA, shift=iv.undercut_shift(10, ALPHA)) == pytest.approx(10.0, rel=1e-14)


def test_pointed_tip_shift_makes_the_thickness_vanish():
    shift = limits.pointed_tip_shift(12, ALPHA)
    tip, base = 6.0 + 1.0 + shift, 6.0 * math.cos(ALPHA)
    half = math.pi / 24 + 2 * shift * math.tan(ALPHA) / 12 + iv.inv(ALPHA) - iv.inv(math.acos(base / tip))
    assert half == pytest.approx(0.0, abs=1e-14)
    with pytest.raises(GeometryError):
        limits.pointed_tip_shift(200, ALPHA)
