"""Tests of sets whose planets mesh with one another: triangles of axes, room, ratios."""

import cmath
import itertools
import math
import random

import pytest

from femgear.gears.paired_planets import angle_between, have_room, paired_ratio, planet_places
from femgear.gears.tooth_search import ToothDemand, candidates


def test_branches_reach_keep_their_distance_and_close_the_triangle_of_their_axes():
    for teeth, planets in random.Random(3).sample(candidates(ToothDemand(2.4, kind="double", planets=(3, 4))), 40):
        sun, inner, outer, ring = teeth
        first, second = planet_places(teeth)
        points = [
            (place.radius * cmath.exp(1j * (place.angle + 2.0 * math.pi * n / planets)), place)
            for n in range(planets)
            for place in (first, second)
        ]
        apart = abs(points[0][0] - points[1][0])
        assert apart == pytest.approx(0.5 * (inner + outer))
        assert abs(points[0][0]) == pytest.approx(0.5 * (sun + inner))
        assert abs(points[1][0]) == pytest.approx(0.5 * (ring - outer))
        for (one, here), (other, there) in itertools.combinations(points, 2):
            if abs(abs(one - other) - apart) > 1e-9 or here is there:
                assert abs(one - other) >= here.tip + there.tip + 1.0 - 1e-9


def test_planets_that_do_not_reach_each_other_have_no_place():
    assert planet_places((24, 18, 80, 84)) is None
    assert angle_between(1.0, 1.0, math.sqrt(2.0)) == pytest.approx(0.5 * math.pi)
    assert angle_between(1.0, 1.0, 2.1) is None


@pytest.mark.parametrize(
    ("teeth", "planets", "fits"),
    [
        ((24, 18, 20, 84), 3, True),
        ((24, 18, 20, 84), 6, False),  # branches touch one another
        ((24, 30, 18, 84), 3, False),  # inner planet in the ring
        ((24, 18, 30, 84), 3, False),  # outer planet in the sun
    ],
)
def test_tips_that_do_not_mesh_keep_a_module(teeth, planets, fits):
    assert have_room(planet_places(teeth), teeth[0], teeth[-1], planets) is fits


def test_ratios_of_a_ravigneaux_set_are_those_of_its_service_bulletin():
    """Ford AOD, 30/36/72: first gear 2.40, second gear 1.47."""
    teeth = (30, 36, 18, 18, 72)
    assert paired_ratio(teeth, "carrier") == 72 / 30
    assert round(paired_ratio(teeth, "sun"), 2) == 1.47
