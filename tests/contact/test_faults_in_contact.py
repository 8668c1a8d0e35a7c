"""Faults of teeth in the contact problem: closed forms, reversal, and what they leave as it was."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.flank_pairs import mesh_pairs, separation
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.faults import LEFT, RIGHT, BrokenTip, MissingTooth, Spall, Wear
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE, PER_PERIOD = 100.0, 4


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)


def walk(gears, bodies, *faults, torque=TORQUE, periods=27):
    deviations = replace(no_deviations(gears), faults=faults) if faults else None
    options = {"sun_torque": torque, "positions": PER_PERIOD, "deviations": deviations, "periods": periods}
    return walk_mesh_cycle(gears, bodies, **options)


@pytest.fixture(scope="module")
def healthy(gears, bodies):
    return walk(gears, bodies, periods=1)


def test_even_wear_of_all_teeth_moves_the_sun_by_its_depth(gears, bodies, healthy):
    worn = Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(7e-6, 7e-6))
    cycle = walk(gears, bodies, worn, periods=1)
    assert cycle.sun_arc == pytest.approx(healthy.sun_arc + 7e-6, rel=1e-9)
    assert cycle.stiffness == pytest.approx(healthy.stiffness, rel=1e-6)


def test_a_flank_that_carries_nothing_may_be_worn(gears, bodies, healthy):
    worn = Wear(0, 0, None, RIGHT, roll=(0.0, 1.0), depth=(7e-6, 7e-6))
    assert walk(gears, bodies, worn, periods=1).deflection == pytest.approx(healthy.deflection, rel=1e-9)


def test_a_missing_tooth_carries_nothing_and_is_gone_once_a_turn(gears, bodies, healthy):
    cycle = walk(gears, bodies, MissingTooth(0, 0, 3, None))
    first = cycle.tooth[0, 0, :, None] - np.arange(27)
    carried = cycle.tooth_load[0].reshape(-1, 27, PER_PERIOD).sum(axis=-1)
    assert carried[(first - 3) % 27 == 0].max() == 0.0
    change = np.abs(cycle.sun_arc.reshape(27, -1) - healthy.sun_arc).max(axis=1)

    # three planets meet the tooth, each over two mesh periods or three
    assert 6 <= (change > 1e-7).sum() <= 12
    assert np.sort(change)[:15] == pytest.approx(0.0, abs=5e-8)
    assert cycle.residual.max() < 1e-12


@pytest.mark.slow
def test_the_other_torque_meets_the_fault_on_the_other_flank(gears, bodies):
    left = Spall(0, 0, 3, LEFT, low=8.4e-3, high=9.4e-3, depth=40e-6)
    forwards = walk(gears, bodies, left)
    backwards = walk(gears, bodies, replace(left, flank=RIGHT), torque=-TORQUE)
    assert np.sort(backwards.sun_arc) == pytest.approx(np.sort(forwards.sun_arc), rel=1e-9)
    assert np.ptp(forwards.sun_arc) > 2 * np.ptp(walk(gears, bodies, periods=1).sun_arc)


def test_a_pit_that_is_less_deep_than_the_flanks_approach_is_touched_at_its_ground(gears, bodies):
    shallow = Spall(0, 0, 3, LEFT, low=8.4e-3, high=9.4e-3, depth=0.2e-6)
    deep, flat = walk(gears, bodies, replace(shallow, depth=1e-3)), walk(gears, bodies, shallow)
    whole = np.tile(walk(gears, bodies, periods=1).sun_arc, 27)
    assert 0.0 < (flat.sun_arc - whole).max() < 0.25e-6 < (deep.sun_arc - whole).max()


def test_corners_carry_where_gears_that_have_turned_bring_them(gears, bodies):
    """The separation of the flanks of gears that have turned is that of their places, not of small motions."""
    alone = gears.with_planet_angles((0.0,))
    cycle = walk(alone, bodies, MissingTooth(0, 0, 3, None), MissingTooth(0, 0, 2, None), torque=1e-3)
    pair, worst = mesh_pairs(gears)[0], int(np.argmax(cycle.sun_arc))
    arc = cycle.sun_arc[worst]
    mesh, slot = np.argwhere(cycle.tooth_load[:1, :, worst] > 0.0)[0]
    zeta = cycle.path[mesh, slot, worst]
    ends = np.sqrt(pair.limits_1[1] ** 2 - np.linspace(0.0, 1e-6, 2001))
    roll = np.concatenate([ends, np.linspace(*pair.limits_1, 4001)])
    turned, straight = (separation(pair, zeta + moved, roll) for moved in (arc, 0.0))
    on_both = (turned[1] >= pair.limits_2[0]) & (turned[1] <= pair.limits_2[1])
    assert arc > 100e-6
    assert turned[0][on_both].min() == pytest.approx(cycle.deflection[mesh, worst], rel=2e-3)
    on_both = (straight[1] >= pair.limits_2[0]) & (straight[1] <= pair.limits_2[1])
    assert straight[0][on_both].min() != pytest.approx(cycle.deflection[mesh, worst], rel=0.02)


@pytest.mark.slow
def test_a_tooth_without_its_tip_carries_as_long_as_its_flank_is_there(gears, bodies, healthy):
    sun = gears.sun
    short = BrokenTip(
        0, 0, 3, None, roll=float(np.sqrt((sun.tip_radius - 0.6e-3) ** 2 - sun.base_radius**2)), internal=False
    )
    cycle = walk(gears, bodies, short)
    first = cycle.tooth[0, 0, :, None] - np.arange(27)
    load = cycle.tooth_load[0].reshape(-1, 27, PER_PERIOD)
    mine, whole = load[(first - 3) % 27 == 0], load[(first - 12) % 27 == 0]
    assert 0 < (mine > 0).sum() < (whole > 0).sum()


@pytest.mark.parametrize("number", [0, 2])
def test_tips_broken_off_all_teeth_make_a_gear_with_another_tip(gears, bodies, number):
    whole, cut = gears.gears[number], 0.3e-3
    radius = whole.tip_radius + (cut if whole.internal else -cut)
    roll = float(np.sqrt(radius**2 - whole.base_radius**2))
    broken = walk(gears, bodies, BrokenTip(number, 0, None, None, roll=roll, internal=whole.internal), periods=1)
    member, shorter_gear = ("sun", "planet", "ring")[number], replace(whole, tip_diameter=2.0 * radius)
    # a tip that is whole, so that flanks are those of where the gears have turned to here too
    whole_tip = BrokenTip(1, 0, None, None, roll=1.0, internal=False)
    shorter = walk(replace(gears, **{member: shorter_gear}), bodies, whole_tip, periods=1)
    assert broken.sun_arc == pytest.approx(shorter.sun_arc, rel=1e-5)  # where gears are held to rest
    assert broken.stiffness == pytest.approx(shorter.stiffness, rel=1e-4)
    assert (broken.sun_arc > walk(gears, bodies, periods=1).sun_arc).any()


def test_pits_and_wear_over_one_another_are_the_gaps_that_they_make_together(gears, bodies):
    """The deeper of two pits counts, wear adds: entries of the same gaps written by hand carry the same loads."""
    first = Spall(0, 0, 3, LEFT, low=8.2e-3, high=8.8e-3, depth=2e-6)
    second = Spall(0, 0, 3, LEFT, low=8.5e-3, high=9.2e-3, depth=5e-6)
    worn = Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(4e-6, 4e-6))
    again = Wear(0, 0, 3, LEFT, roll=(8e-3, 9e-3), depth=(0.0, 3e-6))
    together = walk(gears, bodies, first, second, worn, again)
    by_hand = (
        Spall(0, 0, 3, LEFT, low=8.2e-3, high=float(np.nextafter(8.5e-3, 0.0)), depth=2e-6),
        Spall(0, 0, 3, LEFT, low=8.5e-3, high=9.2e-3, depth=5e-6),
        *(Wear(0, 0, tooth, LEFT, roll=(0.0, 1.0), depth=(4e-6, 4e-6)) for tooth in range(27) if tooth != 3),
        Wear(0, 0, 3, LEFT, roll=(8e-3, 9e-3), depth=(4e-6, 7e-6)),
    )
    written = walk(gears, bodies, *by_hand)
    assert together.sun_arc == pytest.approx(written.sun_arc, rel=1e-12)
    assert together.tooth_load == pytest.approx(written.tooth_load, abs=1e-9 * written.tooth_load.max())
    assert np.ptp(together.sun_arc) > 1.5 * np.ptp(walk(gears, bodies, worn, periods=1).sun_arc)
