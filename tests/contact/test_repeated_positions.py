"""Positions of a record that repeat others: which they are, and that their states are those of a walk through all."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact import cycle as cycle_module
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.repeated_positions import different_positions
from femgear.fe.elasticity import Material
from femgear.gears.deviations import Runout, no_deviations
from femgear.gears.faults import LEFT, BrokenTip, MissingTooth, Spall, Wear
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
WINDOWS = {"share": 2000.0, "nearest": 5e-6, "contact": "profile"}
FAULTS = {
    "worn tooth of the sun": (Wear(0, 0, 3, LEFT, roll=(0.0, 1.0), depth=(7e-6, 7e-6)), 27),
    "pit on a planet": (Spall(1, 1, 5, LEFT, low=9.5e-3, high=10.5e-3, depth=20e-6), 40),
    "missing tooth of a planet": (MissingTooth(1, 2, 0, None), 40),
    "short tooth of the sun": (BrokenTip(0, 0, 3, None, roll=9.5e-3, internal=False), 27),
}


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)


def faulty(gears, *faults, **more):
    return replace(no_deviations(gears), faults=faults, **more)


@pytest.mark.parametrize(
    ("name", "torque"),
    [
        ("worn tooth of the sun", 100.0),
        ("pit on a planet", -100.0),
        *(pytest.param(name, 100.0, marks=pytest.mark.slow) for name in [*FAULTS][2:]),
    ],
)
def test_states_are_those_of_a_walk_through_all_positions(gears, bodies, name, torque, monkeypatch):
    fault, teeth = FAULTS[name]
    options = {"sun_torque": torque, "positions": 2, "deviations": faulty(gears, fault), "periods": teeth}
    counts = []

    def counted(*arguments, **options):
        first, again = different_positions(*arguments, **options)
        counts.append(len(first) / len(again))
        return first, again

    monkeypatch.setattr(cycle_module, "different_positions", counted)
    cycle = walk_mesh_cycle(gears, bodies, **options)
    assert max(counts) < 0.6
    monkeypatch.setattr(
        cycle_module, "different_positions", lambda *arguments, **_: (np.arange(len(arguments[3])),) * 2
    )
    whole = walk_mesh_cycle(gears, bodies, **options)
    for field in ("sun_arc", "deflection", "force", "stiffness", "tooth_load", "path", "bearing_force"):
        ours, theirs = getattr(cycle, field), getattr(whole, field)
        assert np.abs(ours - theirs).max() < 1e-9 * np.abs(theirs).max()


def test_nothing_repeats_beside_errors_that_turn(gears, bodies):
    deviations = faulty(gears, FAULTS["worn tooth of the sun"][0], sun_runout=Runout(5e-6))
    first, again = different_positions(gears, bodies, deviations, np.arange(54) / 2.0, **WINDOWS)
    assert np.array_equal(first, np.arange(54))
    assert np.array_equal(again, np.arange(54))


def test_whole_sets_and_wear_of_all_teeth_are_left_alone(gears, bodies):
    worn = faulty(gears, Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(7e-6, 7e-6)))
    for deviations in (None, no_deviations(gears), worn):
        first, _ = different_positions(gears, bodies, deviations, np.arange(10) / 2.0, **WINDOWS)
        assert len(first) == 10


def test_the_tooth_is_met_by_three_planets(gears, bodies):
    deviations = faulty(gears, FAULTS["worn tooth of the sun"][0])
    first, again = different_positions(gears, bodies, deviations, np.arange(27.0), **WINDOWS)
    # the state without the faulty tooth is the most frequent one
    without = np.bincount(again).max()
    assert 27 - 3 * 4 <= without <= 27 - 3
    assert np.array_equal(again[first], np.arange(len(first)))
