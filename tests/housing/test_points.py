"""The Heaviside/linear form: written out in time, and its lines in closed form."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.sensor import fixed_sensor_lines, heaviside_linear_lines
from validation.reference.sensor_in_time import heaviside_linear, passages, point_signals


def random_field(harmonics, n_max, seed=7):
    rng = np.random.default_rng(seed)
    shape = (harmonics + 1, 2 * n_max + 1)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def fourier_by_quadrature(field, z_ring, points, sensor, direction, orders):
    """Fourier coefficients of the interpolated displacement, Gauss quadrature segment by segment.

    Speaks of places, not of passing times: where the sensor is, which two points lie beside it.
    """
    n = np.arange(field.shape[1]) - field.shape[1] // 2
    h = np.arange(field.shape[0])
    nodes, weights = np.polynomial.legendre.leggauss(40)
    lines = np.zeros(len(orders), dtype=complex)
    for j in range(points):
        edge = 2 * np.pi * j / points
        x = (nodes + 1) / 2
        phi = edge + 2 * np.pi / points * x
        turned = direction * (sensor - phi)  # angle of the carrier, phi = sensor - direction * turned
        time = np.exp(1j * z_ring * np.outer(h, turned))
        left = np.einsum("hn,n,ht->t", field, np.exp(1j * n * edge), time).real
        right = np.einsum("hn,n,ht->t", field, np.exp(1j * n * (edge + 2 * np.pi / points)), time).real
        value = (1 - x) * left + x * right
        lines += np.exp(-1j * np.outer(orders, turned)) @ (value * weights) / points
    return np.where(np.array(orders) == 0, lines / 2, lines)


@pytest.mark.parametrize("direction", [1, -1])
def test_lines_are_the_fourier_series_of_the_interpolation(direction):
    field = random_field(2, 5)
    lines = heaviside_linear_lines(field, 12, direction * 3.0, 0.9, points=9, max_order=60)
    quadrature = fourier_by_quadrature(field, 12, 9, 0.9, direction, range(61))
    assert np.allclose(lines.displacement, quadrature, rtol=0, atol=1e-12)


@pytest.mark.parametrize("direction", [1, -1])
def test_time_form_has_the_same_lines(direction):
    field, z_ring, points, samples = random_field(2, 4), 12, 9, 65536
    signals = point_signals(field, z_ring, points=points, samples=samples)
    passed = passages(points, 0.9, direction=direction)
    spectrum = np.fft.rfft(heaviside_linear(signals, passed))[:61] * 2 / samples
    spectrum[0] /= 2
    lines = heaviside_linear_lines(field, z_ring, direction * 3.0, 0.9, points=points, max_order=60)
    # lines of a signal with kinks fall like 1/order^2: so does what sampling folds back
    assert np.allclose(lines.displacement, spectrum, rtol=0, atol=1e-6)


@pytest.mark.parametrize("direction", [1, -1])
def test_time_form_takes_the_two_neighbouring_points_of_the_sensor(direction):
    field, points, samples = random_field(3, 6), 54, 540
    signals = point_signals(field, 108, points=points, samples=samples)
    heard = heaviside_linear(signals, passages(points, 0.3, direction=direction))
    for k in (0, 1, 17, 260, 539):
        phi = np.mod(0.3 - direction * 2 * np.pi * k / samples, 2 * np.pi)
        place = phi * points / (2 * np.pi)
        left = int(place)
        by_hand = (1 - place + left) * signals[left, k] + (place - left) * signals[(left + 1) % points, k]
        assert heard[k] == pytest.approx(by_hand, abs=1e-11)


def test_sensor_that_starts_on_a_point_meets_every_point_exactly():
    signals = point_signals(random_field(2, 4), 108, points=54, samples=540)
    heard = heaviside_linear(signals, passages(54, 0.0))
    steps = np.arange(54)
    assert np.allclose(heard[10 * steps], signals[(-steps) % 54, 10 * steps], atol=1e-11)


def test_points_of_unequal_spacing_keep_a_constant_and_join_without_a_gap():
    passed = np.array([0.5, 0.05, 0.9, 0.61])
    assert np.allclose(heaviside_linear(np.full((4, 100), 2.5), passed), 2.5, atol=1e-14)
    ramp = np.broadcast_to(passed[:, None], (4, 1000))
    t = np.arange(1000) / 1000
    inside = (t >= 0.05) & (t <= 0.9)
    assert np.allclose(heaviside_linear(ramp, passed)[inside], t[inside], atol=1e-14)


def test_many_speeds_of_point_signals_at_once():
    fields = np.stack([random_field(2, 4, seed=s) for s in (1, 2)])
    signals = point_signals(fields, 12, points=9, samples=240)
    passed = passages(9, 0.4)
    for i in range(2):
        alone = point_signals(fields[i], 12, points=9, samples=240)
        assert np.allclose(signals[i], alone, atol=1e-13)
        assert np.allclose(heaviside_linear(signals, passed)[i], heaviside_linear(alone, passed), atol=1e-13)


@pytest.mark.parametrize("angle", [0.0, -1e-18, 2 * np.pi, 0.1, -3.0])
@pytest.mark.parametrize("direction", [1, -1])
def test_passages_lie_in_the_revolution_and_follow_each_other(angle, direction):
    passed = passages(54, angle, direction=direction)
    assert passed.min() >= 0 and passed.max() < 1
    assert np.allclose(np.diff(np.sort(passed)), 1 / 54, atol=1e-14)
    turned = 2 * np.pi * passed
    away = angle - direction * turned - 2 * np.pi * np.arange(54) / 54
    assert np.allclose(np.exp(1j * away), 1, atol=1e-13)


def test_linear_form_tends_to_the_exact_one_with_the_square_of_the_spacing():
    field = random_field(2, 6)
    exact = fixed_sensor_lines(field, 108, 5.0, 0.4).displacement
    errors = []
    for points in (60, 120, 240, 480):
        lines = heaviside_linear_lines(field, 108, 5.0, 0.4, points=points).displacement
        errors.append(np.abs(lines - exact).max())
    assert np.allclose(np.array(errors[:-1]) / errors[1:], 4, atol=0.15)


@pytest.mark.parametrize("points", [2, 54.5, -1])
def test_unusable_points_are_refused(points):
    with pytest.raises(CaseError) as caught:
        heaviside_linear_lines(random_field(2, 3), 108, 5.0, 0.0, points=points)
    assert caught.value.code == "E-SYMMETRY"
