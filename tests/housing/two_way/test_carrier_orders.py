"""Patterns of the planets and the mean of periods and planets in carrier orders."""

import numpy as np
import pytest
from housing.two_way.test_response import FEW, SPEEDS, STRUCTURE, lines, paths

from femgear.housing.two_way.carrier_orders import mean_excitation
from femgear.housing.two_way.response import solve_two_way
from validation.fixed_housing import rigid_modes, shaken


@pytest.mark.parametrize(("periods", "planet"), [(3, None), (4, 1)])
def test_patterns_of_planets_are_all_planets_at_once(periods, planet):
    """One planet at a time in three patterns, against the equations of three planets."""
    drive = shaken(paths(1), periods, planet=planet, sense=-1)
    (one, order, expected), (all_planets, same, found) = (lines(drive, symmetry) for symmetry in (3, 1))
    assert np.array_equal(order, same)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    assert np.abs(one.force - all_planets.force).max() < 1e-9 * np.abs(one.force).max()
    assert max(one.residual.max(), all_planets.residual.max()) < 1e-7


def test_the_mean_of_periods_and_planets_repeats_from_planet_to_planet():
    drive = shaken(paths(1), 4, planet=1, sense=-1)
    mean = mean_excitation(drive, paths(3), -1)
    assert mean.periods == 1 and mean.stiffness.shape == (6, 64)
    for name in ("stiffness", "deflection", "force"):
        ours, whole = getattr(mean, name), getattr(drive, name)
        for mesh in (slice(0, 3), slice(3, 6)):
            assert ours[mesh].mean() == pytest.approx(whole[mesh].mean(), rel=1e-12)
    assert solve_two_way(rigid_modes(paths(3), drive), mean, STRUCTURE, paths(3), SPEEDS, **FEW).turns == 1
