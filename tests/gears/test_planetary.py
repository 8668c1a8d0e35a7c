"""Phases and orientations against placed tooth outlines, closure against its own conditions.

The outlines of all bodies are put where `orientations` says. For every planet and several positions the
loaded flanks must touch (some pair at a distance below a nanometre) and nothing may overlap.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.kinematics import orientations
from femgear.gears.pair import zero_backlash_distance
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.profile import BasicRack

ALPHA = math.radians(20.0)
RACK = BasicRack(root_radius=0.15)  # with 0.25 the ring's tips touch some of these planets' fillets


def gears(teeth, *, module=1.5e-3, shifts=(0.0, 0.0, 0.0), allowance=0.0, alpha=ALPHA):
    outer = module * (teeth[2] / 2 + 5)
    bores = module * (teeth[0] / 2 - 4), module * (teeth[1] / 2 - 4)
    make = [
        Gear(z, module, alpha, x, 25e-3, r, internal=internal, thickness_allowance=allowance, rack=RACK)
        for z, x, r, internal in zip(teeth, shifts, (*bores, outer), (False, False, True), strict=True)
    ]
    return tuple(make)


def steps(teeth, *counts):
    """Planet angles at whole assembly steps of 2 pi / (z_s + z_r)."""
    return tuple(2 * math.pi * k / (teeth[0] + teeth[2]) for k in counts)


SETS = {
    "reference": close_set(
        *gears((27, 40, 108)), planet_angles=equal_planet_angles(3), centre_distance=51e-3, find=("sun",)
    ),
    "sequential": close_set(*gears((20, 40, 100)), planet_angles=equal_planet_angles(3)),
    "odd planets": close_set(*gears((25, 41, 107)), planet_angles=equal_planet_angles(3)),
    "unequal": close_set(*gears((25, 41, 107)), planet_angles=steps((25, 41, 107), 3, 45, 94)),
    "unequal closed": close_set(
        *gears((27, 40, 108)),
        planet_angles=steps((27, 40, 108), 0, 44, 91),
        centre_distance=51e-3,
        find=("sun",),
    ),
    "all shifted": close_set(
        *gears((24, 30, 86), shifts=(0.3, 0.2, 0.0)),
        planet_angles=steps((24, 30, 86), 1, 29, 56, 84),
        find=("ring",),
    ),
    "clockwise start": close_set(*gears((20, 40, 100)), planet_angles=(-1.0, -1.0 + 2 * math.pi / 3)),
    "with backlash": close_set(*gears((24, 36, 96), allowance=30e-6), planet_angles=equal_planet_angles(4)),
}
every_set = pytest.mark.parametrize("name", SETS)


@every_set
def test_loaded_flanks_touch_and_nothing_overlaps(name, mesh_gaps):
    s = SETS[name]
    for position in (0.0, 0.31, 0.77, 5.5):
        gaps = mesh_gaps(s, position)
        assert np.max(np.abs(gaps[:, 0])) < 1e-9, "loaded flanks"
        assert np.min(gaps[:, 1]) > -1e-9, "back flanks"


@every_set
def test_backlash_is_what_the_back_flanks_leave(name, mesh_gaps):
    """Between the back flanks the normal play is the smallest arc, seen square to the flank."""
    s = SETS[name]
    meshes = s.backlash_sun_planet, s.backlash_planet_ring
    if name == "with backlash":
        cosine = math.cos(ALPHA)
        # both teeth thinner by 30 um at the reference circles, which are the working ones here
        assert meshes == pytest.approx((60e-6 * cosine, 60e-6 * cosine), rel=1e-9)
        assert np.min(mesh_gaps(s, 0.0)[:, 1]) > 50e-6
    else:
        assert np.max(np.abs(meshes)) < 1e-12
        assert np.max(mesh_gaps(s, 0.2)[:, 1]) < 1e-9


def test_phases_of_known_arrangements():
    """z_s/N whole: in phase; else the phases step by z_s/N (Parker and Lin, 2004, with this sign)."""
    assert np.array_equal(SETS["reference"].mesh_phases[:3], np.zeros(3))
    assert np.ptp(SETS["reference"].mesh_phases[3:]) < 1e-12
    phases = SETS["sequential"].mesh_phases
    assert np.allclose(phases[:3], np.mod(-np.arange(3) * 20 / 3, 1.0), atol=1e-12)
    # planet-ring against ring teeth: step z_r psi / 2 pi
    assert np.allclose(np.mod(phases[3:] - phases[3], 1.0), np.mod(np.arange(3) * 100 / 3, 1.0), atol=1e-9)


def test_lag_between_the_meshes_of_a_standard_planet():
    """Unshifted teeth are half a pitch thick: z_p/2 - 1/2 periods, so even planets lag half a period."""
    assert SETS["sequential"].mesh_phases[3] == pytest.approx(0.5, abs=1e-12)
    assert SETS["odd planets"].mesh_phases[3] == pytest.approx(0.0, abs=1e-12)


def test_a_pair_touches_at_the_pitch_point_when_position_plus_phase_is_whole(arcs_to_tooth):
    for name in ("all shifted", "unequal", "unequal closed"):
        s = SETS[name]
        for j, phase in enumerate(s.mesh_phases):
            state = orientations(s, -phase)
            n = j % s.n_planets
            mesh_gear, turn = (s.sun, state.sun) if j < s.n_planets else (s.ring, state.ring)
            aw = s.working_pressure_angle_sun_planet if j < s.n_planets else s.working_pressure_angle_planet_ring
            radius = mesh_gear.base_radius / math.cos(aw)
            point = np.array([radius * np.exp(1j * s.planet_angles[n])])
            left = arcs_to_tooth(mesh_gear, turn, point * np.exp(1e-12j), 1.0)
            assert abs(left[0]) < 2e-9


def test_path_of_contact_lies_between_the_tips():
    s = SETS["reference"]
    for (start, end), (one, two), aw in (
        (s.path_sun_planet, (s.sun, s.planet), s.working_pressure_angle_sun_planet),
        (s.path_planet_ring, (s.planet, s.ring), s.working_pressure_angle_planet_ring),
    ):
        pitch = [g.base_radius / math.cos(aw) for g in (one, two)]
        # distance of the end points from the centres: law of cosines at the pitch point
        leave = math.sqrt(pitch[0] ** 2 + end**2 + 2 * pitch[0] * end * math.sin(aw))
        sign = 1.0 if two.internal else -1.0
        enter = math.sqrt(pitch[1] ** 2 + start**2 + sign * 2 * pitch[1] * start * math.sin(aw))
        assert leave == pytest.approx(one.tip_radius, rel=1e-12)
        assert enter == pytest.approx(two.tip_radius, rel=1e-12)


def test_closing_finds_shifts_that_leave_no_backlash():
    sun, planet, ring = gears((27, 40, 108), shifts=(0.1, 0.1, 0.1))
    angles = equal_planet_angles(3)
    s = close_set(sun, planet, ring, planet_angles=angles, centre_distance=50.9e-3, find=("sun", "ring"))
    assert abs(s.backlash_sun_planet) < 1e-14 and abs(s.backlash_planet_ring) < 1e-14
    assert s.planet.profile_shift == 0.1
    s = close_set(sun, planet, ring, planet_angles=angles, find=("ring",))
    assert abs(s.backlash_sun_planet) < 1e-14 and abs(s.backlash_planet_ring) < 1e-14
    assert s.centre_distance == pytest.approx(zero_backlash_distance(sun, planet), rel=1e-14)


def test_sets_whose_meshes_want_different_centre_distances_are_refused():
    with pytest.raises(GeometryError) as caught:
        close_set(*gears((27, 40, 108)), planet_angles=equal_planet_angles(3))
    assert caught.value.code == "E-COAXIAL"
    assert "50.25" in str(caught.value) and "51.0" in str(caught.value)


def test_shifts_without_any_centre_distance_are_refused():
    with pytest.raises(GeometryError) as caught:
        close_set(*gears((27, 40, 108), shifts=(0.0, -1.5, 0.0)), planet_angles=(0.0,))
    assert (caught.value.code, caught.value.key) == ("E-GEOMETRY", "planet.profile_shift")


@pytest.mark.parametrize(
    ("angles", "code"),
    [
        ((), "E-RANGE"),
        ((0.0, 0.0, 2.0), "E-RANGE"),
        ((0.0, 4.0, 2.0), "E-RANGE"),
        ((0.0, 120.0, 240.0), "E-RANGE"),
        ((0.0, math.nan), "E-RANGE"),
        ((0.0, 2 * math.pi), "E-RANGE"),
    ],
)
def test_planet_angles_that_are_none_are_refused(angles, code):
    with pytest.raises(GeometryError) as caught:
        replace(SETS["reference"], planet_angles=angles)
    assert caught.value.code == code


@pytest.mark.parametrize("count", [0, -1, 2.5, True, 100_000])
def test_numbers_of_planets_that_are_none_are_refused(count):
    with pytest.raises(GeometryError) as caught:
        equal_planet_angles(count)
    assert (caught.value.code, caught.value.key) == ("E-RANGE", "set.planets")


def test_a_distance_at_which_base_circles_overlap_is_refused():
    sun, planet, ring = gears((27, 40, 108))
    with pytest.raises(GeometryError) as caught:
        PlanetarySet(sun, planet, ring, 47e-3, (0.0,))
    assert (caught.value.code, caught.value.key) == ("E-CENTRE-DISTANCE", "set.centre_distance")


def test_mesh_names_follow_the_order_of_the_phases():
    assert SETS["reference"].mesh_names == (
        "sun-planet 1",
        "sun-planet 2",
        "sun-planet 3",
        "planet 1-ring",
        "planet 2-ring",
        "planet 3-ring",
    )
    assert len(SETS["reference"].mesh_phases) == 6


@every_set
def test_single_contact_is_a_base_pitch_from_the_ends_of_the_path(name):
    """Closed form: on the tangent of length a sin(aw), p_b = pi m cos(alpha) from what the tips reach."""
    s = SETS[name]
    pitch = math.pi * 1.5e-3 * math.cos(ALPHA)
    sun, planet, ring = (math.sqrt(gear.tip_radius**2 - gear.base_radius**2) for gear in s.gears)
    for pair, (tip_1, tip_2), sense in zip(s.kinds, ((sun, planet), (planet, ring)), (-1, 1), strict=True):
        length = s.centre_distance * math.sin(pair.working_pressure_angle)
        # roll lengths of gear 1 and, from root to tip, of gear 2: their sum or difference is the tangent
        first = tip_1 - pitch, sense * (tip_2 - length) + pitch
        second = length + sense * first[1], length + sense * first[0]
        for gear, rolls, found in zip(pair.gears, (first, second), pair.single_contact, strict=True):
            assert found == pytest.approx([2 * math.hypot(gear.base_radius, roll) for roll in rolls], rel=1e-12)
            assert abs(found[1] - 2 * gear.tip_radius) < abs(found[0] - 2 * gear.tip_radius)


def test_there_is_no_single_contact_from_a_contact_ratio_of_two_on():
    pair = SETS["reference"].kinds[1]
    assert pair.contact_ratio < 2.0 and pair.single_contact
    tips = replace(pair.gear_1, rack=replace(RACK, addendum=1.2))
    longer = replace(pair, gear_1=tips)
    assert longer.contact_ratio > 2.0 and not longer.single_contact
    apart = replace(pair, gear_1=replace(pair.gear_1, tip_diameter=2.0 * pair.gear_1.base_radius + 2e-3))
    assert apart.contact_ratio < 1.0 and not apart.single_contact
