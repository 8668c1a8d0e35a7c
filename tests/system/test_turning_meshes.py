"""Meshes that turn with a carrier: their law by its definition, and waves of planets by rotation of a body."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.system.force_laws import turning_wave
from femgear.system.fourier import FourierSeries, constant
from femgear.system.turning_meshes import (
    TurningDirections,
    TurningMeshes,
    independent_directions,
    planet_wave_generator,
    planet_waves,
    turned_row,
)

THETA = np.random.default_rng(0).uniform(-4.0, 4.0, (7, 2))


def meshes(*, separates: bool) -> TurningMeshes:
    """Two flanks on three columns, of the first base frequency the stiffness, of the second the carrier."""
    fixed, even, odd = np.random.default_rng(1).normal(size=(3, 2, 3))
    k = FourierSeries(np.array([[3.0, 1.0 + 0.4j], [2.0, -0.5j]]), (1, 0))
    state = FourierSeries(np.array([[0.1, 0.2], [0.3, 0.1j]]), (1, 0)), constant([0.4, -0.2])
    columns = np.tile([0, 1, 2], (2, 1))
    return TurningMeshes(columns, fixed, even, odd, turning_wave((0, -1)), k, *state, separates=separates)


@pytest.mark.parametrize("separates", [False, True])
def test_forces_and_tangents_are_those_of_springs_along_the_turned_directions(separates):
    element, x = meshes(separates=separates), np.random.default_rng(2).normal(size=(7, 2, 3))
    force, tangent = element.evaluate(x, THETA)
    for row, theta in enumerate(THETA):
        S = TurningDirections(element.fixed, element.even, element.odd).at(-theta[1])
        k = np.array([3.0 + np.real((1 + 0.4j) * np.exp(1j * theta[0])), 2.0 + 0.5 * np.sin(theta[0])])
        gap = np.array([0.1 + 0.2 * np.cos(theta[0]), 0.3 - 0.1 * np.sin(theta[0])])
        line = np.array([0.4, -0.2]) + k * ((S * x[row]).sum(axis=1) - gap)
        touches = line > 0.0 if separates else np.ones(2, bool)
        np.testing.assert_allclose(force[row], (line * touches)[:, None] * S, rtol=1e-13, atol=1e-14)
        wanted = (k * touches)[:, None, None] * S[:, :, None] * S[:, None]
        np.testing.assert_allclose(tangent[row], wanted, rtol=1e-13, atol=1e-14)
        closed = element.switches(x[row], theta) > 0.0
        np.testing.assert_allclose(element.frozen(x[row], theta, closed)[0], force[row], rtol=1e-13, atol=1e-14)
    assert (force == 0.0).any() == separates
    together = element.evaluate_together(x[:, 0], THETA)
    for whole, parts in zip(together, element.evaluate(np.repeat(x[:, :1], 2, axis=1), THETA), strict=True):
        np.testing.assert_allclose(whole, parts.sum(axis=1), rtol=1e-13, atol=1e-13)
    # no column is stiffer than it is said to be
    assert np.all(element.steepest(THETA) >= np.diagonal(tangent, axis1=2, axis2=3).max(axis=0) - 1e-12)


def test_the_mean_stiffness_of_a_column_is_that_of_a_whole_turn():
    element, angle = meshes(separates=False), 2.0 * np.pi * np.arange(16)[:, None, None] / 16
    direction = element.fixed + element.even * np.cos(angle) + element.odd * np.sin(angle)
    wanted = np.array([[3.0], [2.0]]) * (direction**2).mean(axis=0)
    np.testing.assert_allclose(element.reference, wanted, rtol=1e-13)


@pytest.mark.parametrize("count", [3, 4, 5, 7])
def test_waves_of_planets_carry_the_motion_of_a_body_at_rest_unchanged(count):
    psi = 0.3 + 2.0 * np.pi * np.arange(count) / count
    waves = planet_waves(psi)
    for theta in (0.0, 0.7, -2.0):
        D = waves.at(theta)
        # a shift of a body along x and its rotation, as planets have them radially
        for shape in (np.cos, np.ones_like):
            np.testing.assert_allclose(D @ shape(psi), shape(psi + theta), atol=1e-14)
        np.testing.assert_allclose(D @ D.T, np.eye(count), atol=1e-14)
        slope = (waves.at(theta + 1e-6) - waves.at(theta - 1e-6)) / 2e-6
        np.testing.assert_allclose(D.T @ slope, planet_wave_generator(psi), atol=1e-9)


def test_unequal_planets_and_two_have_no_such_waves():
    for angles in ([0.0, np.pi], [0.0, 2.0, 4.0]):
        with pytest.raises(CaseError) as error:
            planet_waves(angles)
        assert error.value.code == "E-TURNING"


def test_as_few_directions_as_span_all_of_them():
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(9, 2)) @ rng.normal(size=(2, 6))
    mass = np.diag([1.0, 1.0, 1.0, 1e-8, 1.0, 1.0])
    basic = independent_directions(rows, mass)
    assert basic.shape == (6, 2)
    on = TurningDirections(rows[:3], rows[3:6], rows[6:]).on(basic)
    np.testing.assert_allclose(on.stacked @ basic.T, rows, atol=1e-12)


def test_a_quarter_of_a_turn_takes_x_to_y():
    np.testing.assert_array_equal(turned_row(np.array([1.0, 0.0, 3.0, 0.0, 2.0, 4.0])), [0, 1, 0, -2, 0, 0])
