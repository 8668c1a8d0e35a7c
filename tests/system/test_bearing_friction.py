"""Friction torques of rolling bearings."""

import math

import pytest

from femgear.errors import CaseError
from femgear.system.bearing_friction import (
    LOAD,
    friction_kind,
    friction_load,
    load_factor,
    lubricant_torque,
    seal_torque,
)


def test_torque_of_the_lubricant_grows_with_the_power_two_thirds_from_a_speed_on():
    rpm = math.pi / 30.0
    # f_0 = 2, d_m 65 mm, nu n = 20 * 3000: 1e-7 * 2 * 60000^(2/3) * 65^3 N mm
    expected = 1e-7 * 2.0 * 60000.0 ** (2.0 / 3.0) * 65.0**3
    assert lubricant_torque(2.0, 65e-3, 3000.0 * rpm, 20e-6) == pytest.approx(1e-3 * expected, rel=1e-9)
    # below nu n = 2000: 160e-7 f_0 d_m^3, within the digits of 160
    slow = lubricant_torque(2.0, 65e-3, 10.0 * rpm, 20e-6)
    assert slow == pytest.approx(1e-3 * 160e-7 * 2.0 * 65.0**3, rel=0.01)
    assert slow == lubricant_torque(2.0, 65e-3, -50.0 * rpm, 20e-6) and lubricant_torque(2.0, 65e-3, 0.0, 20e-6) == 0.0


def test_the_load_is_the_larger_of_thrust_and_radial_force():
    angle = math.radians(40.0)
    assert friction_load("ball", 0.0, 1000.0, -800.0) == pytest.approx(2300.0)
    assert friction_load("ball", angle, 1000.0, 100.0) == 1000.0
    assert friction_load("ball", -angle, 100.0, 1000.0) == pytest.approx(900.0 / math.tan(angle) - 10.0)
    assert friction_load("cylindrical", 0.0, 700.0, 300.0) == 700.0
    assert friction_load("tapered", 0.2, 700.0, 300.0) == pytest.approx(max(240.0 / math.tan(0.2), 700.0))


def test_balls_need_their_static_rating_and_rollers_do_not():
    assert load_factor("ball", 0.0, 1000.0, 0.0, 10e3) == pytest.approx(5e-4 * 0.1**0.55)
    assert load_factor("ball", 0.0, 0.0, 1000.0, 10e3) == pytest.approx(5e-4 * 0.05**0.55)
    assert load_factor("tapered", 0.2, 1.0, 1.0, None) == LOAD["tapered"]
    assert friction_kind("ball", 0.3) == "angular" and friction_kind("tapered", 0.3) == "tapered"
    with pytest.raises(CaseError) as refused:
        load_factor("ball", 0.0, 1.0, 0.0, None)
    assert refused.value.key == "static_rating"


def test_a_seal_takes_the_power_of_its_diameter_squared():
    speed = 1500.0 * math.pi / 30.0
    assert seal_torque(40e-3) * speed == pytest.approx(7.69e-6 * 40.0**2 * 1500.0, rel=1e-12)
