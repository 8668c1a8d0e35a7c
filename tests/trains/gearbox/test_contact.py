"""Contact of the teeth of a stage: slopes become axes askew, shares over the width, forces along the normal."""

import math

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.case.gear_set import planetary_set
from femgear.gears.deviations import misaligned_approach, no_deviations
from femgear.trains.gearbox.case_file import teeth_of
from femgear.trains.gearbox.contact import StageContact, askew, loaded_tables, stage_contact
from femgear.trains.reading import read_case


@pytest.mark.parametrize("back", [False, True])
def test_any_slopes_of_a_set_are_those_of_askew_planets(back):
    gears = planetary_set(teeth_of(read_case("cases/e_axle.toml").planetary[0]))
    slopes = np.array([3.0, -1.0, 2.0, 0.5, 4.0, -2.0]) * 1e-5
    found = askew(no_deviations(gears), gears, slopes, back=back)
    assert misaligned_approach(found, gears, back=back) == pytest.approx(slopes, abs=1e-15)


def test_the_loads_of_the_gearbox_stand_in_the_tables():
    stage = read_case(pair_tables(teeth=True)).pair[0]
    tables = loaded_tables(stage, -37.5, 9)
    assert tables["operation"]["torque"] == "-37.5 N m"
    assert tables["static"]["slices"] == 9
    assert stage.teeth["operation"]["torque"] == "100 N m"


def test_forces_follow_from_the_torque():
    stage = read_case(pair_tables(teeth=True)).pair[0]
    found = stage_contact(stage, 100.0, np.zeros(1), slices=5)
    assert found.normal_force == pytest.approx([100.0 / (0.036 * math.cos(math.radians(20.0)))], rel=1e-9)
    assert found.shares.sum(axis=1) == pytest.approx([1.0])
    # aligned gears of one width carry alike on both ends
    assert found.shares[0] == pytest.approx(found.shares[0, ::-1], rel=1e-6)


def test_shares_keep_their_sum_in_other_slices():
    shares = np.array([[0.4, 0.3, 0.2, 0.1]])
    contact = StageContact(None, np.ones(1), np.ones(1), shares)  # type: ignore[arg-type]
    assert contact.shares_at(0, 4) == pytest.approx(shares[0])
    assert contact.shares_at(0, 2) == pytest.approx([0.7, 0.3])
    assert contact.shares_at(0, 8).sum() == pytest.approx(1.0)
