"""Faults of teeth by themselves: what they take off, how long a gear with them takes, and where they act."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.flank_pairs import acting_flanks
from femgear.gears.deviations import common_period, mirrored_deviations, no_deviations, rotational_symmetry
from femgear.gears.faults import (
    LEFT,
    RIGHT,
    BrokenTip,
    MissingTooth,
    Spall,
    Wear,
    fault_form,
    fault_periods,
    flank_limits,
    missing_length,
    removed,
)
from femgear.gears.planetary import mirrored_set
from validation.planetary import reference_set

SPALL = Spall(0, 0, 3, LEFT, low=5e-3, high=6e-3, depth=40e-6)
ROLL = np.array([4.9e-3, 5.5e-3, 6.1e-3])


@pytest.fixture(scope="module")
def gears():
    return reference_set()


def test_faults_take_off_what_they_say():
    assert SPALL.removed(ROLL) == pytest.approx([0.0, 40e-6, 0.0])
    assert np.isinf(MissingTooth(0, 0, 3, None).removed(ROLL)).all()
    worn = Wear(0, 0, None, LEFT, roll=(5e-3, 6e-3), depth=(0.0, 8e-6))
    assert worn.removed(ROLL) == pytest.approx([0.0, 4e-6, 8e-6])


def test_a_broken_tip_ends_the_flank_of_its_tooth_alone(gears):
    tooth, sides = np.zeros((2, 3, 1, 2), int), np.zeros((2, 3), int)
    tooth[0, 1] = [[3, 4]]
    whole = np.array([[1e-3, 9e-3], [2e-3, 8e-3]])
    tip = BrokenTip(0, 0, 3, None, roll=5.2e-3, internal=False)
    limits = flank_limits([tip, SPALL], gears, 0, tooth, sides, whole)
    assert limits[0, :, 1, 0, 0].tolist() == [1e-3, 5.2e-3]
    assert limits[0, :, 1, 0, 1].tolist() == [1e-3, 9e-3] == limits[0, :, 0, 0, 0].tolist()
    assert (limits[1] == whole[1][:, None, None, None]).all()
    assert flank_limits([SPALL], gears, 0, tooth, sides, whole) is None

    # the tip of an internal tooth is at the smaller roll lengths
    tooth[1, 2] = 5
    of_ring = BrokenTip(2, 0, 5, None, roll=4e-3, internal=True)
    limits = flank_limits([of_ring], gears, 1, tooth, sides, whole)
    assert limits[1, :, 2, 0, 0].tolist() == [4e-3, 8e-3] and (limits[0] == whole[0][:, None, None, None]).all()


def test_lengths_of_missing_parts_are_arcs_of_the_involute(gears):
    sun = gears.sun
    assert missing_length([SPALL], gears, 0, 0.0) == pytest.approx((6e-3**2 - 5e-3**2) / (2 * sun.base_radius))
    assert missing_length([replace(SPALL, high=1.0)], gears, 0, 0.0) < (sun.tip_roll**2) / (2 * sun.base_radius)
    assert missing_length([MissingTooth(0, 0, 3, None)], gears, 0, 0.0) == 0.0 == missing_length([SPALL], gears, 1, 0.0)


def test_pits_with_little_flank_between_them_count_as_one(gears):
    beside = replace(SPALL, low=6.2e-3, high=7e-3)
    land, whole = ((high**2 - low**2) / (2 * gears.sun.base_radius) for low, high in ((6e-3, 6.2e-3), (5e-3, 7e-3)))
    assert missing_length([beside, SPALL], gears, 0, 1.01 * land) == pytest.approx(whole)
    apart = (7e-3**2 - 6.2e-3**2) / (2 * gears.sun.base_radius)
    alone = missing_length([SPALL], gears, 0, 0.0)
    assert missing_length([beside, SPALL], gears, 0, 0.99 * land) == max(alone, apart)
    others = replace(beside, tooth=4), replace(beside, flank=RIGHT), replace(beside, copy=1)
    assert missing_length([SPALL, *others], gears, 0, 1.0) == max(alone, apart)
    assert missing_length([replace(SPALL, high=8e-3), beside], gears, 0, 0.0) == pytest.approx(
        (8e-3**2 - 5e-3**2) / (2 * gears.sun.base_radius)
    )


def test_the_deeper_of_two_pits_counts_and_wear_adds(gears):
    """Gaps by hand: 40 um and 60 um of pits that lie over one another, 8 um of wear and 3 um more, 5 um of the mate."""
    deeper = replace(SPALL, low=5.4e-3, high=6.2e-3, depth=60e-6)
    worn = Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(8e-6, 8e-6))
    again = replace(worn, tooth=3, depth=(3e-6, 3e-6))
    roll = np.array([4.9e-3, 5.2e-3, 5.5e-3, 6.1e-3, 6.3e-3])
    alone = np.array([0.0, 40e-6, 60e-6, 60e-6, 0.0])
    assert removed([SPALL, deeper], roll) == pytest.approx(alone, rel=1e-15)
    assert removed([worn, SPALL, again, deeper], roll) == pytest.approx(alone + 11e-6, rel=1e-15)
    tooth, sides = np.zeros((2, 3, 1, 1), int), np.zeros((2, 3), int)
    tooth[0] = 3
    mate = Wear(1, 0, None, LEFT, roll=(0.0, 1.0), depth=(5e-6, 5e-6))
    form = fault_form((deeper, worn, mate, SPALL, again), gears, 0, tooth, sides)
    assert form is not None
    rolls = np.broadcast_to(roll, (3, 1, 1, 5))
    mates = [5e-6 if mesh.copy == 0 else 0.0 for mesh in gears.meshes if mesh.kind == 0]
    assert form(rolls, rolls)[:, 0, 0] == pytest.approx(alone + 11e-6 + np.array(mates)[:, None], rel=1e-14)


@pytest.mark.parametrize(("gear", "periods"), [(0, 27), (1, 40), (2, 108)])
def test_a_set_repeats_after_the_teeth_of_its_faulty_gear(gears, gear, periods):
    faulty = replace(no_deviations(gears), faults=(MissingTooth(gear, 0, 3, None),))
    assert common_period(faulty, gears)[0] == periods == fault_periods(faulty.faults, gear, gears.gears[gear].teeth)
    assert not faulty.ideal and rotational_symmetry(faulty, gears) == 1


def test_wear_of_all_teeth_repeats_with_the_mesh(gears):
    worn = replace(no_deviations(gears), faults=(Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(1e-6, 1e-6)),))
    assert common_period(worn, gears)[0] == 1


def test_a_mirror_image_has_the_fault_on_the_other_flank_and_once_again_where_it_was(gears):
    faults = (SPALL, replace(SPALL, gear=1, copy=1), replace(SPALL, gear=2, flank=RIGHT))
    given = replace(no_deviations(gears), faults=faults)
    mirrored, order = mirrored_set(gears)
    image = mirrored_deviations(given, gears, mirrored, order)
    assert [fault.flank for fault in image.faults] == [RIGHT, RIGHT, LEFT]
    assert image.faults[1].copy == list(order).index(1)
    again = mirrored_deviations(image, mirrored, gears, np.argsort(order))
    assert again.faults == faults


def test_a_fault_acts_on_its_tooth_and_flank_alone(gears):
    tooth, rolls = np.zeros((2, 3, 1, 2), int), np.full((3, 1, 2, 4), 5.5e-3)
    tooth[0, :, 0] = [[3, 4], [3 + 27, 5], [2, 1]]
    sides = np.zeros((2, 3), int)
    form = fault_form((SPALL,), gears, 0, tooth, sides)
    assert form is not None
    assert (form(rolls, rolls) > 0).any(axis=-1)[:, 0].tolist() == [[True, False], [True, False], [False, False]]
    assert fault_form((replace(SPALL, flank=RIGHT),), gears, 0, tooth, sides) is None
    assert fault_form((SPALL,), gears, 1, tooth, sides) is None


def test_the_sun_drives_with_its_left_flanks(gears):
    sides = {side for number, acting in acting_flanks(gears) if number == 0 for *_, side in acting}
    assert sides == {LEFT}
