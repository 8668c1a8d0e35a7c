"""Sliding, loss factors and coefficients of friction of teeth."""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.gears.friction import (
    FRICTION_LAWS,
    closed_loss_factor,
    loss_factor,
    partial_contact_ratios,
    path_speeds,
    table_friction,
)
from validation.losses import fzg_gears, sets, spur_test_gear, unshifted_set

GEAR_C = spur_test_gear((0.1817, 0.1715), (82.636, 118.544))
GEAR_A = spur_test_gear((0.8532, -0.5), (88.77, 112.5))
RING = unshifted_set()[1]


def test_rows_of_test_gears_pass():
    assert {row.verdict for row in fzg_gears()} == {"passes"}


@pytest.mark.slow
def test_rows_of_sets_pass():
    assert {row.verdict for row in sets()} == {"passes"}


@pytest.mark.parametrize("pair", [GEAR_C, RING], ids=["external", "internal"])
def test_sliding_is_that_of_the_velocities_of_both_flanks(pair):
    """From the positions of the flank points in the plane, whatever is known of involutes."""
    zeta = np.linspace(*pair.path, 7)
    speeds = path_speeds(pair, zeta, 25.0)
    angle, sense = pair.working_pressure_angle, 1.0 if pair.gear_2.internal else -1.0
    line = np.array([math.sin(angle), math.cos(angle)])  # the line of action, gear 1 turning counter-clockwise
    radius = pair.gear_1.base_radius / math.cos(angle)
    points = np.array([radius, 0.0]) + zeta[:, None] * line
    turns = [2.0 * math.pi * 25.0 / gear.teeth for gear in pair.gears]
    centre = np.array([-sense * pair.centre_distance, 0.0])
    velocity = []
    for turn, origin in ((turns[0], np.zeros(2)), (sense * turns[1], centre)):
        arm = points - origin
        velocity.append(turn * np.stack([-arm[:, 1], arm[:, 0]], axis=1))
    along = np.array([-line[1], line[0]])
    assert velocity[0] @ line == pytest.approx(velocity[1] @ line)
    assert np.abs(speeds.sliding) == pytest.approx(np.abs((velocity[0] - velocity[1]) @ along), abs=1e-12)
    assert np.abs(speeds.rolling_1) == pytest.approx(np.abs(velocity[0] @ along))
    assert float(path_speeds(pair, 0.0).sliding) == pytest.approx(0.0, abs=1e-15)


def test_the_closed_form_holds_up_to_partial_contact_ratios_of_one():
    assert loss_factor(GEAR_C) == pytest.approx(closed_loss_factor(GEAR_C), rel=1e-12)
    assert max(partial_contact_ratios(GEAR_A)) > 1.0 and math.isnan(closed_loss_factor(GEAR_A))


def test_a_small_overlap_changes_little_and_a_whole_one_spreads_the_lines():
    spur, nearly = loss_factor(GEAR_C), loss_factor(GEAR_C, 1e-6)
    assert nearly == pytest.approx(spur, rel=1e-5)
    # with an overlap of one all lines together have one length: the mean of |zeta| over the path decides
    start, end = (place / GEAR_C.base_pitch for place in GEAR_C.path)
    mean = 0.5 * (start**2 + end**2) / (end - start)
    expected = 2.0 * math.pi / 16 * (1.0 + 16 / 24) * mean
    assert loss_factor(GEAR_C, 1.0) == pytest.approx(expected, rel=1e-9)
    assert loss_factor(GEAR_C, 1.0, 0.3) == pytest.approx(expected / math.cos(0.3), rel=1e-9)


@pytest.mark.parametrize("law", FRICTION_LAWS.values(), ids=FRICTION_LAWS)
def test_friction_grows_with_load_and_falls_with_speed_and_viscosity(law):
    given = {"viscosity": 0.02, "roughness": 0.5e-6}
    mu = law(4e5, 5.0, 0.01, **given)
    assert law(8e5, 5.0, 0.01, **given) / mu == pytest.approx(2.0**0.2)
    assert law(4e5, 10.0, 0.01, **given) / mu == pytest.approx(2.0**-0.2)
    assert law(4e5, 5.0, 0.01, **given | {"viscosity": 0.04}) / mu == pytest.approx(2.0**-0.05)
    assert law(4e5, 60.0, 0.01, **given) == law(4e5, 50.0, 0.01, **given)
    assert 0.03 < mu < 0.12


def test_a_table_is_linear_between_its_numbers_and_flat_beyond_them():
    table = {"loads": (1e5, 2e5), "speeds": (1.0, 3.0, 5.0), "coefficients": [[0.1, 0.08, 0.07], [0.12, 0.1, 0.08]]}
    assert table_friction(1.5e5, 2.0, **table) == pytest.approx(0.1)
    assert table_friction(np.array([1e4, 1e7]), 9.0, **table).tolist() == [0.07, 0.08]
    single = table_friction(3.0, 4.0, loads=(1.0,), speeds=(1.0,), coefficients=[[0.06]])
    assert float(single) == 0.06


def test_shorter_teeth_slide_less():
    shorter = replace(GEAR_C, gear_1=replace(GEAR_C.gear_1, tip_diameter=81.5e-3))
    assert loss_factor(shorter) < loss_factor(GEAR_C)
