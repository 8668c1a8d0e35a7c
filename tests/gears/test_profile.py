"""Involute relations against closed forms and high-precision numbers."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears import profile as iv
from femgear.gears.gear import Gear, PinionCutter, flank_points, half_thickness_angle
from femgear.gears.pair import working_pressure_angle, zero_backlash_distance, zero_backlash_shift
from femgear.gears.planetary import close_set, virtual_set, virtual_teeth
from femgear.gears.profile import BasicRack, CutterTip, inv, pressure_angle_at, transverse_rack, transverse_tool
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


# Sections of helical teeth: relations of ISO 21771 that the formulas were not written from.


NORMAL = BasicRack(addendum=1.0, dedendum=1.25, root_radius=0.2)


def helical(beta, *, shift=0.0):
    module, angle = transverse_tool(2e-3, math.radians(20.0), beta)
    rack = transverse_rack(NORMAL, beta)

    def gear(teeth, name, rim, x=0.0):
        return Gear(
            teeth=teeth,
            module=module,
            pressure_angle=angle,
            profile_shift=x * math.cos(beta),
            face_width=0.02,
            rim_radius=rim,
            internal=name == "ring",
            rack=rack,
            name=name,
        )

    gears = gear(30, "sun", 0.02, shift), gear(20, "planet", 0.01), gear(70, "ring", 0.11)
    return close_set(*gears, planet_angles=(0.0,), find=("ring",))


@pytest.mark.parametrize("degrees", [5.0, 20.0, 40.0])
def test_base_pitches_of_both_sections_differ_by_the_base_helix(degrees):
    beta = math.radians(degrees)
    sun = helical(beta).sun
    normal_pitch = math.pi * 2e-3 * math.cos(math.radians(20.0))
    beta_b = math.asin(math.sin(beta) * math.cos(math.radians(20.0)))
    assert sun.base_pitch * math.cos(beta_b) == pytest.approx(normal_pitch, rel=1e-14)


@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_heights_are_the_same_lengths_in_both_sections(shift):
    gears = helical(math.radians(25.0), shift=shift)
    virtual = virtual_set(gears, math.radians(25.0))
    for one, other in ((gears.sun, virtual.sun), (gears.planet, virtual.planet)):
        for name in ("tip_radius", "root_radius", "rim_radius"):
            height = getattr(one, name) - one.reference_radius
            assert getattr(other, name) - other.reference_radius == pytest.approx(height, rel=1e-12)
    assert gears.sun.tip_radius - gears.sun.reference_radius == pytest.approx(2e-3 * (1.0 + shift))


def test_a_given_tip_stands_as_far_out_of_the_virtual_gear():
    gears = helical(math.radians(25.0))
    lower = gears.sun.tip_radius - 0.3e-3
    virtual = virtual_set(replace(gears, sun=replace(gears.sun, tip_diameter=2.0 * lower)), math.radians(25.0))
    height = virtual.sun.tip_radius - virtual.sun.reference_radius
    assert height == pytest.approx(lower - gears.sun.reference_radius, rel=1e-12)


def test_virtual_gears_have_the_curvature_of_the_normal_section():
    beta = math.radians(20.0)
    gears = helical(beta)
    virtual = virtual_set(gears, beta)
    assert (virtual.sun.teeth, virtual.planet.teeth, virtual.ring.teeth) == virtual_teeth(gears, beta)
    assert virtual_teeth(gears, beta) == (36, 24, 84)
    for one, other in ((gears.sun, virtual.sun), (gears.planet, virtual.planet), (gears.ring, virtual.ring)):
        # to half a tooth
        away = other.reference_radius - one.reference_radius / math.cos(beta) ** 2
        assert abs(away) <= 0.5 * 2e-3 * 0.5 + 1e-12
        assert other.module == pytest.approx(2e-3) and other.pressure_angle == pytest.approx(math.radians(20.0))


def test_contact_ratio_of_the_virtual_gears_is_that_over_cos_squared_of_the_base_helix():
    # exact but for whole tooth numbers: eps_n = eps_alpha / cos^2(beta_b)
    beta = math.radians(20.0)
    gears = helical(beta)
    virtual = virtual_set(gears, beta)
    beta_b = math.asin(math.sin(beta) * math.cos(math.radians(20.0)))
    assert virtual.contact_ratio_sun_planet * math.cos(beta_b) ** 2 == pytest.approx(
        gears.contact_ratio_sun_planet, rel=5e-3
    )


def test_without_a_helix_both_sections_are_the_gears():
    gears = helical(0.0)
    virtual = virtual_set(gears, 0.0)
    for name in ("sun", "planet", "ring"):
        one, other = getattr(gears, name), getattr(virtual, name)
        assert other.rim_radius == pytest.approx(one.rim_radius, rel=1e-14)
        assert other.base_radius == pytest.approx(one.base_radius, rel=1e-14)


def test_form_circles_take_the_height_of_the_rounding_in_the_normal_section():
    """ISO 21771 for rack-shaped tools: 328.991 and 1341.487 mm, with alpha_t 328.958 and 1341.440."""
    beta, normal = math.radians(10.0), math.radians(20.0)
    module, angle = transverse_tool(14e-3, normal, beta)
    rack = transverse_rack(BasicRack(1.0, 1.25, 0.38), beta)
    for teeth, shift, expected in ((24, 0.48, 328.991), (95, 0.6691, 1341.487)):
        gear = Gear(teeth, module, angle, shift * math.cos(beta), 0.36, 0.3 * teeth * module, rack=rack)
        depth = 14e-3 * (1.25 - shift - 0.38 * (1.0 - math.sin(normal)))
        reference = teeth * module
        form = math.hypot(reference * math.sin(angle) - 2.0 * depth / math.sin(angle), reference * math.cos(angle))
        assert 2.0 * gear.form_radius == pytest.approx(form, rel=1e-12)
        assert 2e3 * gear.form_radius == pytest.approx(expected, abs=5e-4)


@pytest.mark.parametrize("teeth, internal", [(20, False), (30, False), (70, True)])
def test_the_stretched_tip_touches_the_fillet_and_cuts_no_deeper(teeth, internal):
    """The tool's ellipse in many positions: nearest to every point of the fillet it is on it."""
    beta = math.radians(30.0)
    module, angle = transverse_tool(2e-3, math.radians(20.0), beta)
    rack = transverse_rack(NORMAL, beta)
    rim = module * teeth if internal else 0.2 * module * teeth
    gear = Gear(teeth, module, angle, 0.1, 0.02, rim, internal=internal, rack=rack)
    tool = gear.tool
    assert tool.stretch == pytest.approx(1.0 / math.cos(beta))
    radius, place = tool.fillet_point(np.linspace(0.0, gear.fillet_end, 15))
    points = radius * np.exp(1j * (place - tool.gap_angle))
    turned = np.linspace(-0.6, 0.6, 60001)[:, None]
    if internal:
        seen = points * np.exp(-1j * turned) - tool.centre_distance
        seen = seen * np.exp(1j * turned * gear.base_radius / tool.cutter_base_radius)
        # the rounding's centre lies beside the centreline of the cutter's tooth; its mirror image is the same
        seen = seen * np.exp(1j * tool.centre_angle) - tool.centre_radius
        height, side = seen.real, seen.imag
    else:
        seen = points * np.exp(1j * turned)
        height = tool.pitch_radius - tool.centre_depth - seen.real
        side = seen.imag - tool.pitch_radius * turned + tool.centre_offset
    distance = np.hypot(side / tool.stretch, height) - tool.rounding
    assert np.abs(distance.min(axis=0)).max() < 1e-6 * module
    # and it ends where the flank does, in the flank's direction
    end = flank_points(gear, np.array([gear.form_roll]))[0]
    radius, place = tool.fillet_point(gear.fillet_end - np.array([0.0, 1e-7]))
    fillet = radius * np.exp(1j * place)
    assert abs(fillet[0] - complex(*end)) < 1e-9 * module
    sense = 1e-7 if internal else -1e-7
    flank = flank_points(gear, gear.form_roll + module * np.array([0.0, sense]))
    flank = complex(*(flank[1] - flank[0]))
    assert abs(np.angle((fillet[1] - fillet[0]) / flank)) < 1e-4


# Tools that cut teeth: what no tool of a catalogue shows.


TIP = CutterTip(
    pitch_radius=0.05,
    cutter_pitch_radius=0.02,
    cutter_base_radius=0.0188,
    centre_distance=0.03,
    centre_radius=0.0221,
    centre_angle=0.01,
    rounding=3e-4,
    gap_angle=0.02,
    end_angle=0.4,
)


def test_a_cutter_whose_rounding_lies_within_its_base_circle_has_no_room():
    assert TIP.room == pytest.approx(0.01)
    assert replace(TIP, centre_radius=0.0187).room < 0.0
    assert replace(TIP, centre_radius=0.0188).room < 0.0


@pytest.mark.parametrize(
    ("change", "code", "value"),
    [
        ({"tip_diameter": 38e-3}, "E-TIP", 38e-3),
        ({"profile_shift": 2.5}, "E-POINTED", 2.5),
        ({"cutter": PinionCutter(teeth=105)}, "E-CUTTER", 105),
    ],
)
def test_a_refusal_shows_the_value_that_it_refuses(change, code, value):
    gear = Gear(27, 1.5e-3, math.radians(20.0), 0.0, 0.02, 9e-3)
    if "cutter" in change:
        gear = Gear(108, 1.5e-3, math.radians(20.0), 0.0, 0.02, 0.1, internal=True)
    with pytest.raises(GeometryError) as caught:
        replace(gear, **change)
    assert caught.value.code == code and caught.value.value == pytest.approx(value)


def test_a_cutter_runs_without_play_in_the_gap_that_it_cuts():
    """On the pitch circles its tooth, from the offset of its rounding, is as wide as the gap of the gear."""
    for allowance in (0.0, 30e-6):
        alpha = math.radians(20.0)
        gear = Gear(60, 1e-3, alpha, 0.2, 1e-2, 0.04, internal=True, thickness_allowance=allowance)
        tool = gear.tool
        assert isinstance(tool, CutterTip)
        base, working = tool.cutter_base_radius, 0.5 * math.pi - tool.end_angle
        offset = tool.rounding / base + inv(pressure_angle_at(tool.centre_radius, base))
        tooth = tool.centre_angle + offset - inv(working)
        gap = math.pi / gear.teeth - half_thickness_angle(gear, tool.pitch_radius)
        assert tool.cutter_pitch_radius * tooth == pytest.approx(tool.pitch_radius * gap, rel=1e-12)
