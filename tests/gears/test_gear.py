"""A gear's circles, thickness and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, flank_points, half_thickness_angle, tooth_thickness
from femgear.gears.profile import BasicRack, PinionCutter, inv, roll

ALPHA = math.radians(20.0)
SUN = Gear(27, 1.5e-3, ALPHA, 0.52681, 25e-3, 9e-3, name="sun")
RING = Gear(108, 1.5e-3, ALPHA, 0.0, 25e-3, 100e-3, internal=True, name="ring")


def test_circles_of_external_and_internal_gears():
    assert pytest.approx(1.5e-3 * (13.5 + 1 + 0.52681)) == SUN.tip_radius
    assert pytest.approx(1.5e-3 * (13.5 - 1.25 + 0.52681)) == SUN.root_radius
    assert pytest.approx(79.5e-3) == RING.tip_radius
    assert pytest.approx(82.875e-3) == RING.root_radius
    assert pytest.approx(81e-3 * math.cos(ALPHA)) == RING.base_radius
    assert pytest.approx(math.pi * 1.5e-3 * math.cos(ALPHA)) == RING.base_pitch
    assert replace(SUN, tip_diameter=44e-3).tip_radius == 22e-3
    assert replace(SUN, root_diameter=38e-3).root_radius == 19e-3


def test_thickness_at_the_reference_circle():
    m, x = SUN.module, SUN.profile_shift
    expected = m * (math.pi / 2 + 2 * x * math.tan(ALPHA))
    assert tooth_thickness(SUN, SUN.reference_radius) == pytest.approx(expected, rel=1e-14)
    wide = replace(RING, profile_shift=0.2)
    expected = m * (math.pi / 2 - 0.4 * math.tan(ALPHA))
    assert tooth_thickness(wide, wide.reference_radius) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("gear", [SUN, RING])
def test_allowance_thins_the_tooth_at_the_reference_circle(gear):
    thin = replace(gear, thickness_allowance=20e-6)
    r = gear.reference_radius
    assert tooth_thickness(gear, r) - tooth_thickness(thin, r) == pytest.approx(20e-6, rel=1e-9)
    assert thin.root_radius == gear.root_radius


@pytest.mark.parametrize("gear", [SUN, RING])
def test_flank_points_lie_on_the_involute(gear):
    """The normal of an involute is tangent to the base circle, one roll length away."""
    rolls = np.linspace(gear.form_roll, gear.tip_roll, 9)
    step = 1e-6 * gear.module
    tangent = flank_points(gear, rolls + step) - flank_points(gear, rolls - step)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    points = flank_points(gear, rolls)
    foot = np.abs(np.sum(points * tangent, axis=1)), np.abs(np.sum(points * normal, axis=1))
    np.testing.assert_allclose(foot[0], gear.base_radius, rtol=1e-8)
    assert np.allclose(foot[1], rolls, rtol=0, atol=1e-8 * gear.base_radius)
    radius = np.hypot(*points.T)
    assert np.allclose(np.arctan2(points[:, 1], points[:, 0]), half_thickness_angle(gear, radius), atol=1e-14)
    np.testing.assert_allclose(roll(radius, gear.base_radius), rolls, rtol=1e-12)


def test_undercut_is_what_the_tool_does():
    """Rack with a tool tip rounding: the straight flank ends h - rho (1 - sin a) below the datum."""
    depth = 1.25 - 0.25 * (1 - math.sin(ALPHA))
    limit = 2 * depth / math.sin(ALPHA) ** 2
    for teeth in (17, 18, 19, 20):
        gear = Gear(teeth, 1e-3, ALPHA, 0.0, 1e-2, 3e-3)
        assert gear.undercut is (teeth < limit)
        assert gear.undercut_shift == pytest.approx(depth - teeth * math.sin(ALPHA) ** 2 / 2, rel=1e-12)
    assert not replace(SUN, teeth=10, rim_radius=3e-3, profile_shift=0.5006 + 1e-3).undercut


def test_undercut_flank_starts_outside_the_base_circle_on_the_involute():
    gear = Gear(10, 1e-3, ALPHA, 0.0, 1e-2, 2e-3)
    radius = gear.form_radius
    assert radius > gear.base_radius
    expected = math.pi / 20 + inv(ALPHA) - inv(math.acos(gear.base_radius / radius))
    assert half_thickness_angle(gear, radius) == pytest.approx(expected, rel=1e-13)


REFUSED = [
    ({"teeth": True}, "E-TEETH", "sun.teeth"),
    ({"teeth": 27.0}, "E-TEETH", "sun.teeth"),
    ({"teeth": "27"}, "E-TEETH", "sun.teeth"),
    ({"teeth": 4}, "E-TEETH", "sun.teeth"),
    ({"teeth": -27}, "E-TEETH", "sun.teeth"),
    ({"teeth": 1_000_000}, "E-TEETH", "sun.teeth"),
    ({"module": 0.0}, "E-GEOMETRY", "sun.module"),
    ({"module": -1.5e-3}, "E-GEOMETRY", "sun.module"),
    ({"module": 1.5}, "E-GEOMETRY", "sun.module"),
    ({"module": math.nan}, "E-GEOMETRY", "sun.module"),
    ({"pressure_angle": 0.0}, "E-GEOMETRY", "sun.pressure_angle"),
    ({"pressure_angle": 20.0}, "E-GEOMETRY", "sun.pressure_angle"),
    ({"pressure_angle": math.pi / 2}, "E-GEOMETRY", "sun.pressure_angle"),
    ({"profile_shift": math.inf}, "E-SHIFT", "sun.profile_shift"),
    ({"face_width": 0.0}, "E-GEOMETRY", "sun.face_width"),
    ({"rim_radius": 19.5e-3}, "E-RIM", "sun.bore_radius"),
    ({"rim_radius": -1.0}, "E-RIM", "sun.bore_radius"),
    ({"thickness_allowance": -1e-6}, "E-ALLOWANCE", "sun.thickness_allowance"),
    ({"rack": BasicRack(root_radius=0.48)}, "E-ROOT-RADIUS", "rack.root_radius"),
    ({"rack": BasicRack(dedendum=math.nan)}, "E-CUTTER", "rack.dedendum"),
    ({"rack": BasicRack(addendum=-1.0)}, "E-CUTTER", "rack.addendum"),
    ({"profile_shift": 2.5}, "E-POINTED", "sun.profile_shift"),
    ({"tip_diameter": 38e-3}, "E-TIP", "sun.tip_diameter"),
    ({"tip_diameter": 39e-3}, "E-TIP", "sun.tip_diameter"),
    ({"tip_diameter": math.nan}, "E-TIP", "sun.tip_diameter"),
]


@pytest.mark.parametrize(("change", "code", "key"), REFUSED)
def test_impossible_sun_is_refused_with_code_and_key(change, code, key):
    with pytest.raises(GeometryError) as caught:
        replace(SUN, **change)
    error = caught.value
    assert (error.code, error.key) == (code, key)
    assert error.limit and error.remedy and error.exit_code == 2


@pytest.mark.parametrize(
    ("change", "code", "key"),
    [
        ({"rim_radius": 82e-3}, "E-RIM", "ring.outer_radius"),
        ({"tip_diameter": 150e-3}, "E-TIP", "ring.tip_diameter"),
        ({"cutter": PinionCutter(teeth=105)}, "E-CUTTER", "ring.cutter_teeth"),
        ({"cutter": PinionCutter(teeth=2.5)}, "E-CUTTER", "ring.cutter_teeth"),
        ({"cutter": PinionCutter(teeth=6)}, "E-CUTTER", "ring.cutter_teeth"),
        ({"cutter": PinionCutter(30, profile_shift=4.0)}, "E-CUTTER", "ring.profile_shift"),
        ({"cutter": PinionCutter(teeth=30, tip_radius=0.6)}, "E-ROOT-RADIUS", "rack.root_radius"),
    ],
)
def test_impossible_ring_is_refused_with_code_and_key(change, code, key):
    with pytest.raises(GeometryError) as caught:
        replace(RING, **change)
    assert (caught.value.code, caught.value.key) == (code, key)


def test_largest_root_radius_is_named_and_accepted():
    with pytest.raises(GeometryError) as caught:
        replace(SUN, rack=BasicRack(root_radius=0.48))
    assert "0.4719" in caught.value.limit
    assert replace(SUN, rack=BasicRack(root_radius=0.4719)).tool.centre_offset > 0.0


def test_numpy_tooth_numbers_become_python_ones():
    assert type(replace(SUN, teeth=np.int64(27)).teeth) is int
