"""Tests of the angles at which planets fit, of their marks, and of Willis' equation of any planetary set."""

import math
import random
from fractions import Fraction

import numpy as np
import pytest
from planet_gearboxes import SET_KINDS as KINDS
from planet_gearboxes import free_speeds, pair_conditions, places_by_trial, random_set
from set_conditions import ravigneaux_conditions

from femgear.errors import GeometryError
from femgear.gears.planet_assembly import (
    assembly_step,
    double_gears,
    nearest_places,
    ravigneaux_gears,
    simple_gears,
    stepped_gears,
    timing_marks,
    tooth_relations,
)
from femgear.gears.power_flow import power_flow


@pytest.mark.parametrize("kind", KINDS)
def test_planets_fit_where_rolling_them_around_with_all_teeth_finds_places(kind):
    draw = random.Random(kind)
    for _ in range(100):
        gears = random_set(draw, kind)
        step = assembly_step(gears)
        expected = np.arange(step.denominator) / step.denominator
        np.testing.assert_allclose(places_by_trial(gears), expected, atol=1e-9, err_msg=str(gears.teeth))


@pytest.mark.parametrize(
    ("gears", "step"),
    [
        (simple_gears(27, 40, 108), Fraction(1, 27 + 108)),
        (stepped_gears(24, 40, 16, 80), Fraction(8, 24 * 16 + 40 * 80)),
        (double_gears(20, 15, 18, 70), Fraction(1, 70 - 20)),
        (ravigneaux_gears(30, 36, 18, 20, 72), Fraction(1, math.gcd(72 - 30, 72 + 36))),
    ],
)
def test_the_steps_are_those_of_the_closed_forms(gears, step):
    assert assembly_step(gears) == step


def test_equal_gears_of_a_stepped_planet_make_a_simple_set():
    assert assembly_step(stepped_gears(27, 40, 40, 108)) == assembly_step(simple_gears(27, 40, 108))


@pytest.mark.parametrize("kind", KINDS)
def test_teeth_stand_in_gaps_where_the_marks_of_the_planets_say(kind):
    draw = random.Random(f"marks {kind}")
    for _ in range(40):
        gears = random_set(draw, kind)
        turn = assembly_step(gears) * draw.randint(0, 200)
        turns = {gear: -turn for gear in gears.shafts} | timing_marks(gears, turn)
        turns |= {second: turns[first] for first, second in gears.bodies}
        for first, second, sense in gears.meshes:
            passed = gears.teeth[first] * turns[first] - sense * gears.teeth[second] * turns[second]
            assert passed.denominator == 1, (gears.teeth, first, second)


def test_marks_are_the_smallest_turns_and_say_where_no_planet_fits():
    # both gears of this planet stand again as they did after an eighth of a turn
    gears = stepped_gears(24, 40, 16, 80)
    assert all(0 <= timing_marks(gears, n * assembly_step(gears))["first planet"] < Fraction(1, 8) for n in range(90))
    with pytest.raises(GeometryError, match="do not fit"):
        timing_marks(gears, assembly_step(gears) / 2)


def test_the_nearest_places_are_multiples_of_the_step():
    gears, third = stepped_gears(23, 41, 17, 81), 2.0 * math.pi / 3.0
    assert nearest_places(assembly_step(gears), (0.3, 0.3 + third, 0.3 + 2.0 * third)) == (0, 1237, 2475)


@pytest.mark.parametrize("kind", KINDS)
def test_willis_equation_holds_for_the_speeds_that_teeth_pass_on(kind):
    draw = random.Random(f"speeds {kind}")
    for _ in range(40):
        gears = random_set(draw, kind)
        names = [gear for gear in gears.shafts if gear != "carrier"]
        start = {"carrier": Fraction(draw.randint(-9, 9)), names[0]: Fraction(draw.randint(-9, 9))}
        speed = free_speeds(gears, start)
        relations = tooth_relations(gears)
        assert len(relations) == len(names) - 1
        for relation in relations:
            assert sum(weight * (speed[gear] - speed["carrier"]) for gear, weight in relation.items()) == 0
        shafts, conditions = pair_conditions(gears)
        flow = power_flow(
            shafts, conditions, speeds={k: float(v) for k, v in start.items()}, torques={}, outputs=names[1:]
        )
        shares = flow.speed_ratio[names[-1]]
        assert sum(share * start[shaft] for shaft, share in shares.items()) == speed[names[-1]]


def test_the_relations_are_those_of_the_known_sets():
    assert tooth_relations(simple_gears(27, 40, 108)) == ({"sun": 27, "ring": 108},)
    assert tooth_relations(double_gears(20, 15, 18, 70)) == ({"sun": 20, "ring": -70},)
    assert tooth_relations(stepped_gears(23, 41, 17, 81)) == ({"sun": 23 * 17, "ring": 41 * 81},)


def gear_of(shafts, conditions, held: str, driven: str, out: str) -> Fraction:
    """Speed of the driven over that of the output shaft."""
    flow = power_flow(shafts, conditions, speeds={out: 1.0}, torques={driven: 1.0}, held=[held], outputs=[out])
    return flow.speed_ratio[driven][out]


def test_a_ravigneaux_set_has_its_published_gears():
    # 30/36/72 teeth: four forward gears of 2.40, 1.47, 1.00, 0.67 and reverse 2.00, as of the Ford AOD transmission
    any_set = pair_conditions(ravigneaux_gears(30, 36, 18, 20, 72))
    members = ["small sun", "large sun", "carrier", "ring"]
    known = members, ravigneaux_conditions("set", *members, 30, 36, 72)
    for shafts, conditions in (any_set, known):
        assert gear_of(shafts, conditions, "carrier", "small sun", "ring") == Fraction(72, 30)
        assert gear_of(shafts, conditions, "large sun", "small sun", "ring") == Fraction(22, 15)
        assert gear_of(shafts, conditions, "large sun", "carrier", "ring") == Fraction(2, 3)
        assert gear_of(shafts, conditions, "carrier", "large sun", "ring") == -2


def test_gears_without_teeth_or_without_a_ring_of_their_own_are_refused():
    with pytest.raises(GeometryError, match="0 teeth"):
        tooth_relations(simple_gears(27, 0, 108))
    with pytest.raises(GeometryError, match="turn with the carrier"):
        assembly_step(double_gears(30, 12, 12, 30))
