"""Tests of the search of tooth numbers: what is listed, how sizes go with load, what is refused."""

import math
import random
import time
from dataclasses import replace

import numpy as np
import pytest
from planet_gearboxes import places_by_trial
from set_conditions import ravigneaux_conditions

from femgear.errors import GeometryError
from femgear.gears.planet_assembly import double_gears, ravigneaux_gears
from femgear.gears.power_flow import planetary_condition, power_flow
from femgear.gears.tooth_search import LEAST_TEETH, MOST_TEETH, ToothDemand, candidates, search_teeth, size_of


def test_all_pairs_of_the_ratio_are_listed_the_nearest_first():
    demand = ToothDemand(2.5, kind="pair", tolerance=0.01)
    listed = [teeth for teeth, _ in candidates(demand)]
    every = {
        (first, second)
        for first in range(LEAST_TEETH, 61)
        for second in range(LEAST_TEETH, MOST_TEETH + 1)
        if abs(second / first / 2.5 - 1.0) <= 0.01 + 1e-9
    }
    assert {*listed} == every and len(listed) == len(every)
    away = [abs(second / first - 2.5) for first, second in listed]
    assert away == sorted(away)


@pytest.mark.parametrize(("fixed", "ratio"), [("ring", 3.6), ("carrier", 2.6), ("sun", 1.4)])
def test_sets_of_the_ratio_assemble_with_equal_spacing(fixed, ratio):
    demand = ToothDemand(ratio, planets=(3, 4, 5), fixed=fixed)
    listed = candidates(demand)
    assert {planets for _, planets in listed} == {3, 4, 5}
    of_speed = {"ring": lambda s, r: 1 + r / s, "carrier": lambda s, r: r / s, "sun": lambda s, r: 1 + s / r}[fixed]
    for (sun, planet, ring), planets in listed:
        assert abs(of_speed(sun, ring) / ratio - 1.0) <= 0.02 + 1e-9
        assert (sun + ring) % planets == 0 and abs(ring - sun - 2 * planet) <= 1


def test_stepped_sets_of_the_ratio_assemble_with_equal_spacing():
    demand = ToothDemand(9.0, kind="stepped", tolerance=0.001)
    listed = candidates(demand)
    assert len(listed) > 50
    for (sun, first, second, ring), planets in listed:
        assert abs((1 + first * ring / (sun * second)) / 9.0 - 1.0) <= 0.001 + 1e-9
        # every planet has the next one's place as one of its own
        step = math.gcd(first, second) / (sun * second + first * ring)
        assert abs(1.0 / planets / step - round(1.0 / planets / step)) < 1e-9


def test_teeth_that_are_not_sized_are_counted():
    demand = ToothDemand(5.0, tolerance=0.005)
    listed, (sized, beyond) = candidates(demand), search_teeth(replace(demand, most=5))
    assert beyond == len(listed) - 5 > 0
    assert {(choice.teeth, choice.planets) for choice in sized} <= set(listed[:5])
    assert search_teeth(demand)[1] == 0


def test_sizes_go_with_the_third_root_of_the_torque():
    demand = ToothDemand(5.0, tolerance=0.005)
    light, heavy = search_teeth(demand)[0], search_teeth(replace(demand, torque=800.0))[0]
    assert [choice.teeth for choice in light] == [choice.teeth for choice in heavy]
    for one, other in zip(light, heavy, strict=True):
        assert other.modules[0] == pytest.approx(2.0 * one.modules[0], rel=1e-12)
        assert other.volume == pytest.approx(8.0 * one.volume, rel=1e-12)
    assert [choice.volume for choice in light] == sorted(choice.volume for choice in light)


def test_more_planets_and_better_steel_make_sets_smaller():
    demand = ToothDemand(4.0, planets=(3, 4))
    three, four = (size_of(demand, (32, 32, 96), planets) for planets in (4, 3))
    assert three.volume < four.volume
    tough = size_of(replace(demand, root_limit=1e10), (32, 32, 96), 3)
    assert tough.decides == "flanks sun-planet"
    # flanks alone: the module goes with the limit to the power -2/3
    harder = size_of(replace(demand, root_limit=1e10, contact_limit=2.0 * demand.contact_limit), (32, 32, 96), 3)
    assert harder.modules[0] == pytest.approx(tough.modules[0] * 2.0 ** (-2.0 / 3.0), rel=1e-12)


def test_a_stepped_planet_of_equal_gears_needs_the_flanks_of_a_simple_one():
    demand = ToothDemand(5.0, root_limit=1e10, kind="stepped")
    stepped = size_of(demand, (20, 30, 30, 80), 3)
    simple = size_of(replace(demand, kind="planetary"), (20, 30, 80), 3)
    assert stepped.modules == pytest.approx(simple.modules * 2, rel=1e-6)
    assert (stepped.decides, simple.decides) == ("flanks sun-first planet", "flanks sun-planet")


def test_what_the_first_harmonic_leaves_follows_from_the_phases():
    demand = ToothDemand(4.0, planets=(3, 4))
    assert size_of(demand, (32, 32, 96), 4).left == ("torque", "torque")
    assert size_of(demand, (31, 31, 93), 4).left == ("lateral force", "lateral force")
    assert size_of(demand, (30, 30, 90), 4).left == ("nothing", "nothing")
    assert not size_of(demand, (30, 30, 90), 4).hunting and size_of(demand, (31, 32, 95), 3).hunting


@pytest.mark.parametrize(
    ("demand", "shipped", "planets"),
    [
        (ToothDemand(5.0), (27, 40, 108), 3),
        (ToothDemand(1.5, kind="pair"), (24, 36), 1),
        (ToothDemand(6.789, tolerance=0.01), (19, 45, 110), 3),
        pytest.param(ToothDemand(10.5, kind="stepped"), (24, 57, 27, 108), 3, marks=pytest.mark.slow),
        (ToothDemand(2.5, kind="double"), (24, 18, 20, 84), 3),
        (ToothDemand(22 / 15, kind="ravigneaux"), (30, 36, 18, 18, 72), 3),
    ],
)
def test_the_search_finds_nothing_larger_than_known_teeth_of_the_ratio(demand, shipped, planets):
    best = search_teeth(demand)[0][0]
    assert best.volume <= size_of(demand, shipped, planets).volume


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"kind": "triple"}, "teeth of a 'triple'"),
        ({"fixed": "planet"}, "no member"),
        ({"ratio": 0.5}, "searched for"),
        ({"planets": (3, 13)}, "searched for"),
        ({"ratio": 60.0}, "no planetary teeth"),
        ({"kind": "double", "fixed": "sun"}, "slower"),
    ],
)
def test_what_nobody_can_ask_for_is_refused(values, words):
    with pytest.raises(GeometryError, match=words):
        search_teeth(replace(ToothDemand(5.0), **values))


def test_planets_without_room_have_no_size():
    with pytest.raises(GeometryError, match="no room"):
        size_of(ToothDemand(2.5, kind="double"), (24, 27, 27, 84), 6)
    with pytest.raises(GeometryError, match="no room"):
        size_of(ToothDemand(10.0), (20, 80, 180), 4)


CONDITIONS = {
    "double": lambda z: [planetary_condition("set", "sun", "carrier", "ring", z[0], z[-1], double=True)],
    "ravigneaux": lambda z: ravigneaux_conditions("set", "sun", "large sun", "carrier", "ring", z[0], z[1], z[-1]),
}
"""Willis' equations of sets whose planets are in mesh."""


@pytest.mark.parametrize(
    ("kind", "fixed", "ratio"),
    [
        ("double", "ring", 2.4),
        ("double", "carrier", 3.5),
        ("ravigneaux", "sun", 1.5),
        ("ravigneaux", "carrier", 2.4),
        ("ravigneaux", "ring", 1.3),
    ],
)
def test_planets_in_mesh_turn_by_the_ratio_and_assemble(kind, fixed, ratio):
    demand = ToothDemand(ratio, kind=kind, fixed=fixed, planets=(3, 4), tolerance=0.01)
    listed = candidates(demand)
    assert len(listed) > 50
    for number, (teeth, planets) in enumerate(random.Random(kind + fixed).sample(listed, 20)):
        central = ["sun", "ring"] if kind == "double" else ["sun", "large sun", "ring"]
        stands = "large sun" if fixed == "sun" else fixed
        output = "carrier" if fixed == "ring" else "ring"
        flow = power_flow(
            [*central, "carrier"],
            CONDITIONS[kind](teeth),
            speeds={"sun": 1.0},
            torques={"sun": 1.0},
            held=[stands],
            outputs=[output],
        )
        speed = 1.0 / abs(flow.speed[output])
        assert abs(speed / ratio - 1.0) <= 0.01 + 1e-9
        choice = size_of(demand, teeth, planets)
        assert choice.ratio == pytest.approx(speed, rel=1e-12)
        gears = (double_gears if kind == "double" else ravigneaux_gears)(*teeth)
        if number < 3:  # all teeth tried
            places = places_by_trial(gears)
            assert all(np.abs(places - n / planets).min() < 1e-9 for n in range(planets))
        # the force on the ring is that of its torque
        on_ring = abs(flow.torque["ring"]) * demand.torque / planets
        assert choice.torques[-1] * teeth[-1] / teeth[-2] == pytest.approx(on_ring, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "ratio"), [("stepped", 10.5), ("double", 2.5)])
def test_ten_thousand_candidates_take_less_than_three_minutes(kind, ratio):
    start = time.perf_counter()
    demand = ToothDemand(ratio, kind=kind, planets=(3, 4), tolerance=0.05)
    listed, (sized, beyond) = candidates(demand), search_teeth(demand)
    assert len(listed) - beyond == 10_000 and len(sized) > 5000
    assert time.perf_counter() - start < 180.0


@pytest.mark.parametrize("kind", ["planetary", "pair"])
def test_ratios_that_a_kind_does_not_have_are_told(kind):
    """No tolerance helps there: what is told has all teeth that the search finds."""
    with pytest.raises(GeometryError) as refused:
        search_teeth(ToothDemand(90.0, kind=kind, tolerance=0.2))
    assert "another --ratio" in refused.value.remedy and "larger --tolerance" not in refused.value.remedy
    least, most = (float(word) for word in refused.value.remedy.split("ratios of ")[1].split(";")[0].split(" to "))
    assert least < 3.0 < 9.0 < most
    assert not any(abs(ratio / 90.0 - 1.0) <= 0.2 for ratio in (least, most))
