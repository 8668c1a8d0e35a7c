"""Fractions of a mesh period, assembly positions and the room between planets, by hand."""

import math

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears import phasing
from femgear.gears.planetary import _fraction, assembly_positions, check_angles, feasible_angles


def test_rounding_makes_no_phase():
    value = np.array([0.25, 1.0 - 1e-12, 7.0 - 1e-12, 1e-12, -1e-12, 3.0 + 1e-12, -0.25, 1.0 - 1e-6])
    assert np.allclose(_fraction(value), [0.25, 0, 0, 0, 0, 0, 0.75, 1.0 - 1e-6], rtol=0, atol=1e-15)


@pytest.mark.parametrize("first", [0.0, 0.3, -1.7])
def test_planets_assemble_at_multiples_from_the_first_one(first):
    turn = 2 * np.pi / (27 + 108)
    assert assembly_positions(27, 108, tuple(first + turn * np.array([0, 45, 91]))) == (0, 45, 91)
    wanted = tuple(first + turn * np.array([0.0, 45.3, 90.6]))
    assert feasible_angles(135, wanted) == pytest.approx(first + turn * np.array([0, 45, 91]))


def test_planets_stand_as_far_apart_as_the_smaller_centre_distance_has_them():
    """Three of 20 teeth: a sun of 30 puts them on 25 modules, rings of 72 and of 68 on 26 and 24."""
    teeth = np.array([[30, 20, 72], [30, 20, 68]])
    total = teeth[:, 0] + teeth[:, 2]
    room = phasing._room(teeth, total[:, None] * np.arange(3) // 3, total)
    gap = np.array([34, 32]) * 2 * np.pi / total
    assert room == pytest.approx(2 * np.array([25, 24]) * np.sin(gap / 2) - 22)


def test_neighbouring_teeth_come_nearest_ratio_first_then_fewest_changes():
    wanted = (30, 20, 70)
    found = phasing.neighbouring_teeth(*wanted, 4, distance=3, ratio_tolerance=0.2, fitting=False)
    change = np.round(np.abs((1 + found.teeth[:, 2] / found.teeth[:, 0]) / (1 + 70 / 30) - 1), 12)
    keys = [*zip(change, np.abs(found.teeth - wanted).sum(axis=1).tolist())]
    assert keys == sorted(keys) and found.teeth[0].tolist() == list(wanted)
    assert len({key[0] for key in keys}) < len(keys)


@pytest.mark.parametrize(
    ("angles", "problem"),
    [
        ((0.0, 2.0, math.nan), "not finite"),
        ((0.0, 2.0, 1.0), "ascending"),
        ((0.0, 2.0, 2.0), "equal"),
        ((0.0, 2.0, 2.0 * math.pi), "more than one turn"),
        ((0.0, 120.0, 240.0), "degrees taken for radians"),
    ],
)
def test_planet_angles_that_no_set_has_are_refused(angles, problem):
    with pytest.raises(GeometryError, match=problem):
        check_angles(angles)
    check_angles((-1.0, 2.0, 5.2))
