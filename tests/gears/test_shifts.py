"""Shifts that close sets of given teeth: equal sliding, stubs, teeth left over or missing."""

import math

import pytest

from femgear.case.gear_set import planetary_set
from femgear.trains.drafts import new_case
from femgear.trains.reading import read_case


@pytest.mark.parametrize(("teeth", "planets"), [((27, 40, 108), 3), ((30, 20, 70), 4), ((21, 30, 79), 4)])
def test_sets_close_with_teeth_left_over_or_missing(teeth, planets):
    gears = planetary_set(read_case(new_case("planetary", teeth=teeth)))
    assert gears.n_planets == planets
    play = 0.04 * gears.sun.module * math.cos(gears.sun.pressure_angle)
    assert gears.backlash_sun_planet == pytest.approx(play, rel=1e-6)
    assert gears.backlash_planet_ring == pytest.approx(play, rel=1e-6)
    assert min(gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring) > 1.0


def test_shifts_are_shared_by_equal_sliding():
    """Specific sliding at the ends of the path of contact of sun and planet, from velocities by hand."""
    text = new_case("planetary", teeth=(27, 40, 108))
    gears = planetary_set(read_case(text))
    assert gears.centre_distance == pytest.approx(68e-3) and "specific sliding of sun and planet" in text
    assert gears.sun.profile_shift > gears.planet.profile_shift > 0.1
    length = gears.centre_distance * math.sin(gears.working_pressure_angle_sun_planet)
    ends = []
    for one, two in ((gears.sun, gears.planet), (gears.planet, gears.sun)):
        far = two.tip_roll
        ends.append(one.teeth / two.teeth * far / (length - far) - 1.0)
    assert ends[0] == pytest.approx(ends[1], rel=0.06)  # shifts are tried in steps of 0.02


def test_stubs_rings_and_gives_tips_that_run_free():
    text = new_case("planetary", teeth=(21, 33, 87))
    assert text.count("tip_diameter") == 1 and text.index("tip_diameter") > text.index("[ring]")
    assert {one.profile_shift for one in planetary_set(read_case(text)).gears} == {0.0}
