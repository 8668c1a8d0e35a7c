"""Sections of helical teeth: relations of ISO 21771 that the formulas were not written from."""

import math

import pytest

from femgear.gears.gear import Gear
from femgear.gears.planetary import close_set, virtual_set, virtual_teeth
from femgear.gears.profile import BasicRack, transverse_rack, transverse_tool

NORMAL = BasicRack(addendum=1.0, dedendum=1.25, root_radius=0.2)


def helical(beta, *, shift=0.0):
    module, angle = transverse_tool(2e-3, math.radians(20.0), beta)
    rack = transverse_rack(NORMAL, beta)

    def gear(teeth, name, rim, x=0.0):
        return Gear(
            teeth=teeth, module=module, pressure_angle=angle, profile_shift=x * math.cos(beta),
            face_width=0.02, rim_radius=rim, internal=name == "ring", rack=rack, name=name,
        )  # fmt: skip

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
        assert other.module == pytest.approx(2e-3) and other.pressure_angle == pytest.approx(
            math.radians(20.0)
        )


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
