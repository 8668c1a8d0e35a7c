import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.system.fourier import FourierSeries, StepSeries, constant, phase_of, series_of

THETA = np.random.default_rng(0).uniform(-20.0, 20.0, (7, 2))


def test_fourier_series_is_its_sum_of_cosines():
    series = FourierSeries([[2.0, 0.5, -0.3j], [1.0, 0.2j, 0.0]], (0, 1))
    tau = THETA[:, 1]
    wanted = np.stack([2.0 + 0.5 * np.cos(tau) + 0.3 * np.sin(2.0 * tau), 1.0 - 0.2 * np.sin(tau)], axis=1)
    np.testing.assert_allclose(series.at(THETA), wanted, atol=1e-14)
    np.testing.assert_array_equal(series.mean, [2.0, 1.0])


def test_orders_combine_the_phases():
    series = FourierSeries([[0.0, 1.0]], (-1, 2))
    np.testing.assert_allclose(series.at(THETA)[:, 0], np.cos(2.0 * THETA[:, 1] - THETA[:, 0]), atol=1e-14)
    assert series.at(THETA.reshape(7, 1, 2)).shape == (7, 1, 1)


def test_series_of_samples_passes_through_them():
    samples = np.random.default_rng(1).standard_normal((3, 9))
    theta = 2.0 * np.pi * np.arange(9)[:, None] / 9
    np.testing.assert_allclose(series_of(samples, 4).at(theta).T, samples, atol=1e-14)


def test_constants_do_not_change():
    np.testing.assert_array_equal(constant([1.0, 2.0]).at(THETA), np.tile([1.0, 2.0], (7, 1)))


def test_steps_hold_their_values_between_the_breaks():
    series = StepSeries([[3.0, 1.0, 2.0]], [0.0, 0.25, 0.5])
    turn = np.array([0.0, 0.2, 0.26, 0.5, 0.99, 1.1, -0.1])
    np.testing.assert_array_equal(series.at(2.0 * np.pi * turn[:, None])[:, 0], [3, 3, 1, 2, 2, 3, 2])
    assert series.mean[0] == pytest.approx(0.25 * 3.0 + 0.25 * 1.0 + 0.5 * 2.0)


def test_mean_of_steps_is_that_of_many_values():
    series = StepSeries([[3.0, 1.0]], [0.0, 0.3])
    theta = 2.0 * np.pi * (np.arange(1000)[:, None] + 0.5) / 1000
    assert series.at(theta).mean() == pytest.approx(series.mean[0])


def test_a_base_that_is_not_given_needs_order_zero():
    assert phase_of([1.5], (2, 0)) == 3.0
    with pytest.raises(CaseError) as error:
        phase_of([1.5], (0, 1))
    assert error.value.code == "E-HARMONICS"


@pytest.mark.parametrize(
    ("values", "breaks"),
    [
        ([[1.0, 2.0]], [0.0]),
        ([[1.0, 2.0]], [0.1, 0.5]),
        ([[1.0, 2.0]], [0.0, 1.0]),
        ([[1.0, 2.0]], [0.0, 0.0]),
    ],
)
def test_breaks_that_do_not_divide_a_period_are_refused(values, breaks):
    with pytest.raises(CaseError) as error:
        StepSeries(values, breaks)
    assert error.value.code == "E-SHAPE"


def test_numbers_that_are_not_finite_are_refused():
    with pytest.raises(CaseError) as error:
        FourierSeries([[1.0, np.nan]])
    assert error.value.code == "E-FINITE"
