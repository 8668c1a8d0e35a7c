"""Tests of the angles at which planets fit, of their marks, and of Willis' equation of any planetary set."""

import math
import random
from fractions import Fraction

import numpy as np
import pytest
from planet_gearboxes import SET_KINDS as KINDS
from planet_gearboxes import free_speeds, places_by_trial, random_set

from femgear.errors import GeometryError
from femgear.gears.planet_assembly import (
    assembly_places,
    assembly_step,
    double_gears,
    nearest_places,
    ravigneaux_gears,
    simple_gears,
    stepped_gears,
    timing_marks,
    tooth_relations,
    willis_conditions,
)
from femgear.gears.power_flow import (
    planetary_condition,
    power_flow,
    ravigneaux_conditions,
    stepped_condition,
)


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


def test_planets_off_their_places_are_refused_with_the_nearest_angles():
    gears, third = stepped_gears(23, 41, 17, 81), 2.0 * math.pi / 3.0
    with pytest.raises(GeometryError, match="do not assemble") as refusal:
        assembly_places(gears, (0.0, third, 2.0 * third))
    near = [float(angle) for angle in refusal.value.remedies[0].split(": ")[1].removesuffix(" deg").split(", ")]
    assert near == pytest.approx([0.0, 120.0, 240.0], abs=0.5 * 360.0 / 3712 + 1e-6)
    step = 2.0 * math.pi * assembly_step(gears)
    angles = [0.3 + place * step for place in nearest_places(assembly_step(gears), (0.0, third, 2.0 * third))]
    assert assembly_places(gears, angles) == (0, 1237, 2475)


@pytest.mark.parametrize("kind", KINDS)
def test_willis_equation_holds_for_the_speeds_that_teeth_pass_on(kind):
    draw = random.Random(f"speeds {kind}")
    for _ in range(40):
        gears = random_set(draw, kind)
        names = [gear for gear in gears.shafts if gear != "carrier"]
        start = {"carrier": Fraction(draw.randint(-9, 9)), names[0]: Fraction(draw.randint(-9, 9))}
        speed = free_speeds(gears, start)
        conditions = willis_conditions("set", gears)
        assert len(conditions) == len(names) - 1
        for condition in conditions:
            assert sum(weight * speed[shaft] for shaft, weight in condition.weights.items()) == 0
        flow = power_flow(
            [*gears.shafts], conditions, speeds={k: float(v) for k, v in start.items()}, torques={}, outputs=names[1:]
        )
        shares = flow.speed_ratio[names[-1]]
        assert sum(share * start[shaft] for shaft, share in shares.items()) == speed[names[-1]]


def test_the_relations_are_those_of_the_known_sets():
    of_simple = planetary_condition("set", "sun", "carrier", "ring", 27, 108)
    assert willis_conditions("set", simple_gears(27, 40, 108))[0].weights == of_simple.weights
    of_double = planetary_condition("set", "sun", "carrier", "ring", 20, 70, double=True)
    assert willis_conditions("set", double_gears(20, 15, 18, 70))[0].weights == of_double.weights
    of_stepped = stepped_condition("set", "sun", "carrier", "ring", 23, 41, 17, 81)
    assert willis_conditions("set", stepped_gears(23, 41, 17, 81))[0].weights == of_stepped.weights


def gear_of(conditions, held: str, driven: str, out: str) -> Fraction:
    """Speed of the driven over that of the output shaft."""
    shafts = ["small sun", "large sun", "carrier", "ring"]
    flow = power_flow(shafts, conditions, speeds={out: 1.0}, torques={driven: 1.0}, held=[held], outputs=[out])
    return flow.speed_ratio[driven][out]


def test_a_ravigneaux_set_has_its_published_gears():
    # 30/36/72 teeth: four forward gears of 2.40, 1.47, 1.00, 0.67 and reverse 2.00, as of the Ford AOD transmission
    any_set = willis_conditions("set", ravigneaux_gears(30, 36, 18, 20, 72))
    known = ravigneaux_conditions("set", "small sun", "large sun", "carrier", "ring", 30, 36, 72)
    for conditions in (any_set, known):
        assert gear_of(conditions, "carrier", "small sun", "ring") == Fraction(72, 30)
        assert gear_of(conditions, "large sun", "small sun", "ring") == Fraction(22, 15)
        assert gear_of(conditions, "large sun", "carrier", "ring") == Fraction(2, 3)
        assert gear_of(conditions, "carrier", "large sun", "ring") == -2


def test_gears_without_teeth_or_without_a_ring_of_their_own_are_refused():
    with pytest.raises(GeometryError, match="0 teeth"):
        tooth_relations(simple_gears(27, 0, 108))
    with pytest.raises(GeometryError, match="turn with the carrier"):
        assembly_step(double_gears(30, 12, 12, 30))
