"""Frequencies of stages against counting teeth and turns."""

import math

import pytest
from set_conditions import ravigneaux_conditions, stepped_condition

from femgear.errors import CaseError
from femgear.gears.kinematics import planet_motion
from femgear.gears.power_flow import (
    SpeedCondition,
    pair_condition,
    planetary_condition,
    power_flow,
)
from femgear.gears.stage_frequencies import stage_frequencies


def test_a_pair_meshes_at_its_teeth_times_its_turns():
    stage = pair_condition("pair", "a", "b", 24, 36)
    found = stage_frequencies(stage, {"a": 2.0 * math.pi * 10.0, "b": -2.0 * math.pi * 20.0 / 3.0})
    assert found.mesh_frequency == pytest.approx({"gear 1-gear 2": 240.0})
    # 24 and 36 share 12: after three turns and two turns the same teeth meet
    assert found.hunting_turns == {"gear 1-gear 2": (3, 2)}
    assert found.hunting_time["gear 1-gear 2"] == pytest.approx(0.3)
    assert found.planet_speed == found.passing_frequency == {}


def test_planets_turn_as_kinematics_has_it():
    stage = planetary_condition("set", "s", "c", "r", 27, 108)
    speed = {"s": 50.0, "c": 10.0, "r": 0.0}
    found = stage_frequencies(stage, speed, planet_teeth={"planet": 40}, planets=3)
    planet, mesh = planet_motion(50.0, 10.0, 27, 40)
    assert found.planet_speed["planet"] == pytest.approx(planet)
    assert found.planet_spin["planet"] == pytest.approx(planet - 10.0)
    assert found.mesh_frequency == pytest.approx({"sun-planet": mesh, "planet-ring": mesh})
    passing = {"sun": 3 * 40.0, "ring": 3 * 10.0, "casing": 3 * 10.0}
    assert found.passing_frequency == pytest.approx({name: one / (2.0 * math.pi) for name, one in passing.items()})


def rolls_without_slip(found, meshes, relative):
    """Speeds of pitch points on both gears of every mesh, in teeth."""
    speed = {**relative, **found.planet_spin}
    for (first, z1), (second, z2), sense in meshes:
        assert z1 * speed[first] == pytest.approx(sense * z2 * speed[second], rel=1e-13)
        assert found.mesh_frequency[f"{first}-{second}"] == pytest.approx(abs(z1 * speed[first]) / (2.0 * math.pi))


def test_double_planets_roll_on_each_other():
    stage = planetary_condition("set", "s", "c", "r", 30, 72, double=True)
    flow = power_flow("scr", (stage,), speeds={"s": 9.0, "c": 2.0}, torques={}, outputs="r")
    found = stage_frequencies(stage, flow.speed, planet_teeth={"inner planet": 15, "outer planet": 18})
    meshes = (
        (("sun", 30), ("inner planet", 15), -1),
        (("inner planet", 15), ("outer planet", 18), -1),
        (("outer planet", 18), ("ring", 72), 1),
    )
    rolls_without_slip(found, meshes, {"sun": 7.0, "ring": flow.speed["r"] - 2.0})


def test_stepped_planets_have_two_mesh_frequencies():
    stage = stepped_condition("set", "s", "c", "r", 23, 41, 17, 81)
    flow = power_flow("scr", (stage,), speeds={"s": 9.0, "c": 2.0}, torques={}, outputs="r")
    found = stage_frequencies(stage, flow.speed)
    meshes = ((("sun", 23), ("first planet", 41), -1), (("second planet", 17), ("ring", 81), 1))
    rolls_without_slip(found, meshes, {"sun": 7.0, "ring": flow.speed["r"] - 2.0})
    assert found.planet_spin["first planet"] == pytest.approx(found.planet_spin["second planet"])


def test_the_long_planets_of_a_ravigneaux_set_turn_at_one_speed():
    small, large = ravigneaux_conditions("set", "a", "b", "c", "r", 30, 36, 72)
    flow = power_flow("abcr", (small, large), speeds={"a": 9.0, "c": 2.0}, torques={}, outputs="r")
    short = stage_frequencies(small, flow.speed, planet_teeth={"inner planet": 16, "outer planet": 18})
    long = stage_frequencies(large, flow.speed, planet_teeth={"planet": 18})
    assert short.planet_speed["outer planet"] == pytest.approx(long.planet_speed["planet"])
    assert short.mesh_frequency["outer planet-ring"] == pytest.approx(long.mesh_frequency["planet-ring"])


def test_at_rest_the_same_teeth_never_meet_again():
    stage = pair_condition("pair", "a", None, 24, 36)
    found = stage_frequencies(stage, {"a": 0.0})
    assert found.mesh_frequency == {"gear 1-gear 2": 0.0}
    assert found.hunting_time == {"gear 1-gear 2": math.inf}


def test_planets_that_a_stage_does_not_have_are_refused():
    stage = planetary_condition("set", "s", "c", "r", 27, 108)
    for condition, teeth in ((stage, {"sun": 3}), (stage, {"inner planet": 3}), (SpeedCondition("x", {}), {})):
        with pytest.raises(CaseError) as caught:
            stage_frequencies(condition, {"s": 0.0, "c": 0.0, "r": 0.0}, planet_teeth=teeth)
        assert caught.value.code == "E-CHOICE"
