"""The Hanning-window model against windows evaluated in time."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.orders import OrderSpectrum, analyse_band
from femgear.housing.sensor import fixed_sensor_lines, fixed_sensor_signal, hanning_model
from validation.reference.sensor_in_time import phased_harmonics


def windowed_sum(theta, harmonics, planet_angles, width, sensor, z_ring, direction):
    """Sum over planets of window times mesh signal, as the planets come past the sensor."""
    total = np.zeros_like(theta)
    for psi, own in zip(planet_angles, harmonics):
        away = np.mod(psi + direction * theta - sensor + np.pi, 2 * np.pi) - np.pi
        window = np.where(np.abs(away) < width / 2, (1 + np.cos(2 * np.pi * away / width)) / 2, 0.0)
        mesh = np.exp(1j * z_ring * np.outer(theta, np.arange(own.size))) @ own
        total += window * mesh.real
    return total


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("width", [2 * np.pi, 2 * np.pi / 3, 1.3])
def test_field_gives_the_windowed_sum(direction, width):
    rng = np.random.default_rng(5)
    angles = np.array([0.0, 2.0, 4.4])
    harmonics = rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3))
    field = hanning_model(harmonics, angles, width=width, n_max=150)
    signal = fixed_sensor_signal(fixed_sensor_lines(field, 108, direction * 3.0, 0.8))
    theta = 3.0 * signal.seconds
    expected = windowed_sum(theta, harmonics, angles, width, 0.8, 108, direction)
    # what is left out beyond n_max falls like 1/n^3
    assert np.allclose(signal.displacement, expected, atol=1e-13 if width == 2 * np.pi else 1e-3)


def test_default_window_of_three_planets_makes_three_lobes():
    angles = 2 * np.pi * np.arange(3) / 3
    harmonics = phased_harmonics(np.array([0.0, 1.0]), 108 * angles / (2 * np.pi))
    field = hanning_model(harmonics, angles)
    lines = fixed_sensor_lines(field, 108, 5.2, 0.0)
    band = analyse_band(OrderSpectrum(lines.order, lines.displacement), 108, 1)
    assert len(band.lobes.position) == 3
    # half of a full window: carrier 1/2, first side lines a quarter each
    assert np.abs(lines.displacement[[105, 108, 111]]) == pytest.approx([0.25, 0.5, 0.25], rel=1e-12)
    # the sensor stands where planet 1 starts: a lobe at every passage
    assert np.allclose(band.lobes.position, [0, 1 / 3, 2 / 3], atol=2 / band.envelope.size)


def test_full_windows_of_equal_planets_in_phase_cancel_the_modulation():
    angles = 2 * np.pi * np.arange(3) / 3
    field = hanning_model(phased_harmonics([0.0, 1.0], 36 * np.arange(3)), angles, width=2 * np.pi)
    lines = fixed_sensor_lines(field, 108, 5.2, 0.3)
    band = analyse_band(OrderSpectrum(lines.order, lines.displacement), 108, 1)
    assert len(band.lobes.position) == 0
    assert band.envelope == pytest.approx(np.full(band.envelope.size, 1.5), rel=1e-12)


def test_phases_shift_the_signal_of_a_planet():
    harmonics = phased_harmonics(np.array([0.5, 1.0 + 0.2j, 0.3]), [0.0, 0.25])
    tau = np.linspace(0, 1, 7)
    for phase, own in zip([0.0, 0.25], harmonics):
        signal = sum((own[h] * np.exp(2j * np.pi * h * tau)).real for h in range(3))
        base = sum((harmonics[0, h] * np.exp(2j * np.pi * h * (tau + phase))).real for h in range(3))
        assert np.allclose(signal, base, atol=1e-14)


def test_unusable_models_are_refused():
    with pytest.raises(CaseError) as caught:
        hanning_model(np.ones((2, 3)), [0.0, 1.0, 2.0])
    assert caught.value.code == "E-SHAPE"
    for width in (0.0, 7.0, np.nan):
        with pytest.raises(CaseError) as caught:
            hanning_model(np.ones((2, 3)), [0.0, 1.0], width=width)
        assert caught.value.code == "E-RANGE"
