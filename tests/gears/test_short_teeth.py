"""Teeth that are missing or short: to which radius they reach, and a whole gear without their tips."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.gears.faults import LEFT, BrokenTip, MissingTooth, Wear
from femgear.gears.short_teeth import marked_teeth, renumbered, short_teeth, without_tips
from validation.planetary import reference_set


@pytest.fixture(scope="module")
def gears():
    return reference_set()


def test_teeth_reach_root_or_end_of_flank(gears):
    sun, ring = gears.sun, gears.ring
    roll = float(np.sqrt(0.021**2 - sun.base_radius**2))
    faults = [
        BrokenTip(0, 0, 4, None, roll=roll, internal=False),
        MissingTooth(1, 2, 7, None),
        MissingTooth(2, 0, 1, None),
        Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(1e-6, 1e-6)),
    ]
    short = short_teeth(faults, gears)
    assert short[0, 0] == ((4, pytest.approx(0.021)),)
    assert short[1, 2] == ((7, gears.planet.root_radius),)
    assert short[2, 0] == ((1, ring.root_radius),)
    assert set(short) == {(0, 0), (1, 2), (2, 0)}


def test_the_worse_of_two_faults_of_a_tooth_is_drawn(gears):
    broken = BrokenTip(0, 0, 4, None, roll=float(np.sqrt(0.021**2 - gears.sun.base_radius**2)), internal=False)
    for faults in ([broken, MissingTooth(0, 0, 4, None)], [MissingTooth(0, 0, 4, None), broken]):
        assert short_teeth(faults, gears)[0, 0] == ((4, gears.sun.root_radius),)
    assert short_teeth([replace(broken, tooth=None)], gears) == {}


def test_teeth_are_counted_from_another_one():
    assert renumbered(((0, 1.0), (3, 2.0)), 2, 5) == ((1, 2.0), (3, 1.0))


def test_faulty_teeth_are_marked_with_all_that_is_said_of_them():
    wear = Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(1e-6, 1e-6))
    faults = [MissingTooth(1, 2, 7, None), MissingTooth(1, 2, 3, None), MissingTooth(1, 2, 7, None), wear]
    marked = marked_teeth(faults, ["a", "b", "c", "all teeth"])
    assert marked == {(1, 2): ((3, "b"), (7, "a; c"))}
    assert renumbered(marked[1, 2], 5, 40) == ((2, "a; c"), (38, "b"))


def test_tips_of_short_teeth_alone_are_pulled_in():
    angle = 2 * np.pi * np.arange(10) / 10
    points = 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    outer = np.hypot(*without_tips(points, ((3, 1.5),), 10, internal=False).T)
    assert outer == pytest.approx(np.where(np.arange(10) == 3, 1.5, 2.0))
    inner = np.hypot(*without_tips(points, ((3, 2.5),), 10, internal=True).T)
    assert inner == pytest.approx(np.where(np.arange(10) == 3, 2.5, 2.0))
