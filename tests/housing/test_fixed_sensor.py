"""Lines and signals of a fixed sensor against the displacement field evaluated at the moving place."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.orders import OrderSpectrum, order_spectrum
from femgear.housing.sensor import (
    SensorLines,
    fixed_sensor_lines,
    fixed_sensor_signal,
    heaviside_linear_lines,
    rounded_lines,
)
from validation.reference.sensor_in_time import mean_square, symmetry_leakage

Z_RING, SENSOR, SPEED = 108, 0.7, 5.2


def random_field(harmonics=3, n_max=9, batch=(), seed=4):
    rng = np.random.default_rng(seed)
    shape = (*batch, harmonics + 1, 2 * n_max + 1)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def field_at(field, phi, seconds, mesh_speed):
    """Displacement at angles phi and times, straight from the double sum."""
    n_max = field.shape[-1] // 2
    total = np.zeros_like(seconds)
    for h in range(field.shape[0]):
        for n in range(-n_max, n_max + 1):
            total += (field[h, n + n_max] * np.exp(1j * (n * phi + h * mesh_speed * seconds))).real
    return total


@pytest.mark.parametrize("speed", [SPEED, -SPEED])
def test_signal_is_the_field_at_the_place_of_the_sensor(speed):
    field = random_field()
    signal = fixed_sensor_signal(fixed_sensor_lines(field, Z_RING, speed, SENSOR))
    heard = field_at(field, SENSOR - speed * signal.seconds, signal.seconds, Z_RING * abs(speed))
    assert np.allclose(signal.displacement, heard, rtol=0, atol=1e-11 * np.abs(heard).max())
    assert signal.seconds[1] * signal.seconds.size == pytest.approx(2 * np.pi / abs(speed), rel=1e-14)


@pytest.mark.parametrize("speed", [SPEED, -SPEED])
def test_signal_where_lines_fold_and_overlap(speed):
    # 7 teeth and |n| <= 9: several components share an order and many orders are negative
    field = random_field(harmonics=2, n_max=9)
    signal = fixed_sensor_signal(fixed_sensor_lines(field, 7, speed, SENSOR))
    heard = field_at(field, SENSOR - speed * signal.seconds, signal.seconds, 7 * abs(speed))
    assert np.allclose(signal.displacement, heard, rtol=0, atol=1e-11 * np.abs(heard).max())


@pytest.mark.parametrize(("speed", "orders"), [(SPEED, (105, 112)), (-SPEED, (111, 104))])
def test_component_is_heard_at_its_order(speed, orders):
    field = np.zeros((2, 11), dtype=complex)
    field[1, 5 + 3], field[1, 5 - 4] = 2.0, 0.5j
    lines = fixed_sensor_lines(field, Z_RING, speed, SENSOR)
    assert set(np.flatnonzero(np.abs(lines.displacement) > 1e-14)) == set(orders)
    assert lines.displacement[orders[0]] == pytest.approx(2 * np.exp(3j * SENSOR), rel=1e-14)
    assert lines.displacement[orders[1]] == pytest.approx(0.5j * np.exp(-4j * SENSOR), rel=1e-14)
    assert lines.frequency[108] == pytest.approx(Z_RING * SPEED / (2 * np.pi), rel=1e-14)


def test_each_line_is_weighted_with_its_own_order_squared():
    field = np.zeros((2, 7), dtype=complex)
    field[1, 0] = field[1, 6] = 1e-6
    lines = fixed_sensor_lines(field, Z_RING, SPEED, 0.0)
    assert abs(lines.acceleration[111] / lines.acceleration[105]) == pytest.approx((111 / 105) ** 2, rel=1e-13)
    signal = fixed_sensor_signal(lines)
    # d2/dt2 of cos(a t) + cos(b t), by hand
    t = signal.seconds
    a, b = 105 * SPEED, 111 * SPEED
    by_hand = -1e-6 * (a**2 * np.cos(a * t) + b**2 * np.cos(b * t))
    assert np.allclose(signal.acceleration, by_hand, rtol=0, atol=1e-12 * np.abs(by_hand).max())


def test_static_field_is_heard_as_the_sensor_passes_it():
    field = np.zeros((1, 7), dtype=complex)
    field[0, 6] = 3e-6
    lines = fixed_sensor_lines(field, Z_RING, SPEED, 0.4)
    assert np.flatnonzero(np.abs(lines.displacement)).tolist() == [3]
    signal = fixed_sensor_signal(lines)
    assert np.allclose(signal.displacement, 3e-6 * np.cos(3 * (0.4 - SPEED * signal.seconds)), atol=1e-18)


def test_spectrum_of_the_signal_gives_the_lines_and_parseval_holds():
    lines = fixed_sensor_lines(random_field(), Z_RING, SPEED, SENSOR)
    signal = fixed_sensor_signal(lines)
    spectrum = order_spectrum(signal.displacement)
    top = lines.order[-1]
    assert np.allclose(spectrum.value[: top + 1], lines.displacement, atol=1e-12)
    assert np.abs(spectrum.value[top + 1 :]).max() < 1e-12
    assert mean_square(spectrum) == pytest.approx(np.mean(signal.displacement**2), rel=1e-13)
    assert mean_square(OrderSpectrum(lines.order, lines.displacement)) == pytest.approx(mean_square(spectrum))


def test_many_speeds_at_once_are_the_speeds_one_by_one():
    speeds = np.array([1.0, 2.5, 40.0])
    field = random_field(batch=(3,))
    for lines_of in (fixed_sensor_lines, heaviside_linear_lines):
        together = lines_of(field, Z_RING, speeds, SENSOR)
        signals = fixed_sensor_signal(together)
        for i, speed in enumerate(speeds):
            alone = lines_of(field[i], Z_RING, speed, SENSOR)
            assert np.array_equal(together.displacement[i], alone.displacement)
            np.testing.assert_allclose(together.acceleration[i], alone.acceleration, rtol=1e-14)
            assert np.allclose(signals.displacement[i], fixed_sensor_signal(alone).displacement, atol=1e-13)


@pytest.mark.parametrize("lines_of", [fixed_sensor_lines, heaviside_linear_lines])
@pytest.mark.parametrize("planets", [3, 4])
def test_identical_planets_leave_only_orders_that_are_multiples_of_their_number(lines_of, planets):
    # field of one planet, repeated at every planet angle with that planet's mesh phase
    one, z_ring = random_field(), 100
    n, h = np.arange(-9, 10), np.arange(4)[:, None]
    angles = 2 * np.pi * np.arange(planets) / planets
    field = sum(one * np.exp(1j * (h * z_ring - n) * psi) for psi in angles)
    lines = (
        lines_of(field, z_ring, SPEED, SENSOR)
        if lines_of is fixed_sensor_lines
        else lines_of(field, z_ring, SPEED, SENSOR, points=20 * planets)
    )
    assert symmetry_leakage(OrderSpectrum(lines.order, lines.acceleration), planets) < 1e-12
    unequal = lines_of(one, z_ring, SPEED, SENSOR)
    assert symmetry_leakage(OrderSpectrum(unequal.order, unequal.acceleration), planets) > 0.1


def test_results_are_read_only():
    lines = fixed_sensor_lines(random_field(), Z_RING, SPEED, SENSOR)
    with pytest.raises(ValueError, match="read-only"):
        lines.displacement[0] = 1
    with pytest.raises(ValueError, match="read-only"):
        fixed_sensor_signal(lines).acceleration[0] = 1


GOOD = {"field": random_field(), "z_ring": Z_RING, "carrier_speed": SPEED, "sensor_angle": SENSOR}
BAD = {
    "even number of columns": ({"field": np.ones((3, 4))}, "E-SHAPE"),
    "one dimension": ({"field": np.ones(5)}, "E-SHAPE"),
    "not a number": ({"field": np.full((2, 3), np.nan)}, "E-SHAPE"),
    "no teeth": ({"z_ring": 0}, "E-TEETH"),
    "half a tooth": ({"z_ring": 10.5}, "E-TEETH"),
    "speeds for one field": ({"carrier_speed": np.array([1.0, 2.0])}, "E-SPEED"),
    "infinite speed": ({"carrier_speed": np.inf}, "E-SPEED"),
    "both directions": (
        {"field": random_field(batch=(2,)), "carrier_speed": np.array([1.0, -1.0])},
        "E-SPEED",
    ),
    "standing carrier": ({"carrier_speed": 0.0}, "E-SPEED"),
    "infinite angle": ({"sensor_angle": np.inf}, "E-RANGE"),
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("lines_of", [fixed_sensor_lines, heaviside_linear_lines])
def test_unusable_data_are_refused(name, lines_of):
    change, code = BAD[name]
    with pytest.raises(CaseError) as caught:
        lines_of(**(GOOD | change))
    assert caught.value.code == code
    assert caught.value.remedy and caught.value.limit


@pytest.mark.parametrize("share", [1e-6, 1e-3])
def test_rounded_lines_err_by_less_than_their_share_of_the_acceleration(share):
    """Lines over eleven decades at three speeds: every bound is that of its own speed, and it is used."""
    order = np.arange(0, 900, 3)
    size = 10.0 ** np.random.default_rng(2).uniform(-15, -4, (3, 300))
    waves = random_field(harmonics=2, n_max=149, seed=3)[:, 1:] / 10.0
    lines = SensorLines(order, size * np.pad(waves, ((0, 0), (0, 2))), np.array([1.0, 7.0, 40.0]), 0.0, 9, "exact")
    rounded = rounded_lines(lines, share)
    assert rounded.dtype == np.complex64
    error = np.abs((rounded - lines.displacement) * (order * lines.base_speed[:, None]) ** 2)
    error /= np.abs(lines.acceleration).max(axis=1, keepdims=True)
    assert np.all(error.max(axis=1) < share) and np.all(error.max(axis=1) > 0.1 * share)
    small = np.abs(lines.acceleration) < 0.1 * share * np.abs(lines.acceleration).max(axis=1, keepdims=True)
    assert small[:, 1:].sum() > 30 and not rounded[small & (order > 0)].any()
    assert np.array_equal(rounded[:, 0], lines.displacement[:, 0].astype(np.complex64))
