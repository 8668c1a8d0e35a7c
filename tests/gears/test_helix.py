"""Sections of helical teeth: relations of ISO 21771 that the formulas were not written from."""

import math

import numpy as np
import pytest

from femgear.gears.gear import Gear, flank_points
from femgear.gears.planetary import close_set, virtual_set, virtual_teeth
from femgear.gears.profile import BasicRack, transverse_rack, transverse_tool

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
