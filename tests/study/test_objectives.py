"""Objectives: numbers of the gears, forces and their peaks, cases without a ring."""

import numpy as np
import pytest
from study.test_designs import CASE, RANGE

from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.study.objectives import (
    at_speeds,
    contact_ratio,
    forces_over_time,
    tip_thickness,
)
from femgear.study.problem import tip_reliefs
from femgear.trains.live import Answer
from femgear.trains.reading import read_case, with_values


@pytest.fixture(scope="module")
def coarse(coarse_states):
    """The reference set with reliefs of no amount, coarse."""
    case, _ = tip_reliefs(read_case(CASE))
    return with_values(case, {"static.flank_elements": 4, "static.positions": 14, "static.stresses": False})


def test_quantities_of_the_gears(coarse):
    variant = Answer(coarse, Steps())
    gears = planetary_set(coarse)
    assert contact_ratio("sun-planet").compute(variant) == gears.contact_ratio_sun_planet
    # tooth thickness at the tip after ISO 21771: d_a (s/d + inv a - inv a_a)
    alpha, x, z = np.radians(20), 0.52681, 27
    tip = gears.sun.tip_radius / gears.sun.module
    at_tip = np.arccos(0.5 * z * np.cos(alpha) / tip)
    half = np.pi / (2 * z) + 2 * x * np.tan(alpha) / z + np.tan(alpha) - alpha
    expected = 2 * tip * (half - np.tan(at_tip) + at_tip)
    assert tip_thickness("sun").compute(variant) == pytest.approx(expected, rel=1e-9)


def test_dynamic_part_and_peak_of_a_force():
    force = np.zeros((1, 2, 4), complex)
    force[0, 0] = 100.0, 0.0, 8.0, 0.0
    force[0, 1] = 50.0, 0.0, 0.0, -3.0j
    np.testing.assert_allclose(forces_over_time(force, dynamic=True), [[8.0, 3.0]], rtol=2e-2)
    np.testing.assert_allclose(forces_over_time(force, dynamic=False), [[108.0, 53.0]], rtol=2e-2)


def test_a_planar_case_has_no_ring_to_shake():
    case = read_case(CASE.with_name("nrel_pgb.toml"))
    with pytest.raises(CaseError, match="elastic ring"):
        at_speeds(case, RANGE)
