"""Published and closed-form results on modulation: amplitude and phase, planet passage, interpolation."""

import numpy as np
import pytest
from scipy.special import jv

from femgear.housing.orders import OrderSpectrum, analyse_band, order_spectrum
from femgear.housing.sensor import fixed_sensor_lines, hanning_model, heaviside_linear_lines
from validation.reference.sensor_in_time import phased_harmonics

THETA = 2 * np.pi * np.arange(4096) / 4096


def test_amplitude_modulation_has_two_side_bands():
    # (1 + m cos(3 theta)) cos(100 theta): side lines m/2
    spectrum = order_spectrum((1 + 0.6 * np.cos(3 * THETA)) * np.cos(100 * THETA))
    assert spectrum.amplitude[[97, 100, 103]] == pytest.approx([0.3, 1.0, 0.3], rel=1e-13)
    assert np.delete(spectrum.amplitude, [97, 100, 103]).max() < 1e-14


def test_phase_modulation_has_bessel_side_bands():
    # cos(100 theta + beta sin(3 theta)) = sum_n J_n(beta) cos((100 + 3 n) theta)
    spectrum = order_spectrum(np.cos(100 * THETA + 0.5 * np.sin(3 * THETA)))
    printed = [0.9384698072, 0.2422684577, 0.0306040235, 0.0025637300]
    for n, value in enumerate(printed):
        assert spectrum.amplitude[100 + 3 * n] == pytest.approx(value, abs=5.1e-11)
        assert spectrum.amplitude[100 - 3 * n] == pytest.approx(value, abs=5.1e-11)
        assert jv(n, 0.5) == pytest.approx(value, abs=5.1e-11)


PASSAGE = [
    (81, 3, {81: 1.5}),
    (80, 3, {81: 0.75}),
    (79, 3, {78: 0.75}),
    (100, 4, {100: 2.0}),
    (99, 4, {100: 1.0}),
    (125, 4, {124: 1.0}),
]


@pytest.mark.parametrize(("z_ring", "planets", "expected"), PASSAGE)
@pytest.mark.parametrize("direction", [1, -1])
def test_planet_passage_rule(z_ring, planets, expected, direction):
    """McFadden and Smith (1985): equal planets leave only orders that are multiples of their number."""
    angles = 2 * np.pi * np.arange(planets) / planets
    phases = direction * z_ring * angles / (2 * np.pi)
    field = hanning_model(phased_harmonics([0.0, 1.0], phases), angles, width=2 * np.pi)
    lines = fixed_sensor_lines(field, z_ring, direction * 4.0, 0.0)
    amplitude = np.abs(lines.displacement)
    # and the same from the windows themselves, in time
    theta = THETA
    signal = sum(
        (1 + np.cos(direction * theta + psi)) / 2 * np.cos(z_ring * (theta + direction * psi)) for psi in angles
    )
    in_time = order_spectrum(signal).amplitude
    for heard in (amplitude, in_time):
        for order, value in expected.items():
            assert heard[order] == pytest.approx(value, rel=1e-12)
        assert np.delete(heard, list(expected)).max() < 1e-9


@pytest.mark.parametrize("n", [1, 3, 6, -6, 12, 20])
def test_linear_interpolation_attenuates_and_makes_images(n):
    """A line of nodal diameter n over P points: sinc^2(n/P), images at n + q P weaker by (n/(n + q P))^2."""
    points, z_ring, n_max = 54, 108, 24
    field = np.zeros((2, 2 * n_max + 1), dtype=complex)
    field[1, n + n_max] = 1.0
    amplitude = np.abs(heaviside_linear_lines(field, z_ring, 5.0, 0.0, points=points, max_order=400).displacement)
    attenuated = (np.sin(np.pi * n / points) / (np.pi * n / points)) ** 2
    assert amplitude[z_ring - n] == pytest.approx(attenuated, rel=1e-13)
    images = [n + q * points for q in (-5, -4, -3, -2, -1, 1)]
    for m in images:
        assert amplitude[z_ring - m] == pytest.approx(attenuated * (n / m) ** 2, rel=1e-12)


def test_loss_of_54_points_at_six_and_twelve_nodal_diameters():
    for n, loss in ((6, 0.04), (12, 0.15)):
        field = np.zeros((2, 61), dtype=complex)
        field[1, 30 + n] = 1.0
        lines = heaviside_linear_lines(field, 108, 5.0, 0.0, points=54)
        assert 1 - abs(lines.displacement[108 - n]) == pytest.approx(loss, abs=0.006)


def test_images_of_the_static_deformation_fall_on_the_mesh_orders_when_points_divide_the_teeth():
    """With 54 points and 108 teeth the static three-lobed ring shape is heard at 108 -+ 3 (artefact)."""
    field = np.zeros((2, 7), dtype=complex)
    field[0, 0] = field[0, 6] = 1.0
    exact = fixed_sensor_lines(field, 108, 5.0, 0.0)
    assert np.flatnonzero(np.abs(exact.displacement) > 1e-14).tolist() == [3]
    linear = np.abs(heaviside_linear_lines(field, 108, 5.0, 0.0, points=54).displacement)
    # both components together give cos(3 x), amplitude 2
    attenuated = 2 * (np.sin(np.pi / 18) / (np.pi / 18)) ** 2
    assert linear[105] == pytest.approx(attenuated * (3 / 105) ** 2, rel=1e-11)
    assert linear[111] == pytest.approx(attenuated * (3 / 111) ** 2, rel=1e-11)
    away = np.abs(heaviside_linear_lines(field, 108, 5.0, 0.0, points=60).displacement)
    assert max(away[105], away[111]) < 1e-12


def test_standing_pattern_of_three_nodal_diameters_gives_six_lobes_and_the_window_model_three():
    """The modulation paper at 250 rpm around the mesh frequency: lines at 108 -+ 3, six lobes."""
    field = np.zeros((2, 49), dtype=complex)
    field[1, 24 - 3] = field[1, 24 + 3] = 1e-6
    field[1, 24] = 2e-7
    for lines in (fixed_sensor_lines(field, 108, 5.24, 0.0), heaviside_linear_lines(field, 108, 5.24, 0.0)):
        band = analyse_band(OrderSpectrum(lines.order, lines.acceleration), 108, 1, half_width=20)
        assert {line.order for line in band.lines[:2]} == {105, 111}
        assert len(band.lobes.position) == 6
    angles = 2 * np.pi * np.arange(3) / 3
    window = hanning_model(phased_harmonics([0.0, 1e-6], [0.0, 36.0, 72.0]), angles)
    lines = fixed_sensor_lines(window, 108, 5.24, 0.0)
    assert len(analyse_band(OrderSpectrum(lines.order, lines.acceleration), 108, 1).lobes.position) == 3
