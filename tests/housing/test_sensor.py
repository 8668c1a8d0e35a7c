"""Lines and signals of a fixed sensor against the displacement field evaluated at the moving place."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.orders import OrderSpectrum, analyse_band, count_lobes, order_spectrum
from femgear.housing.sensor import (
    SensorLines,
    fixed_sensor_lines,
    fixed_sensor_signal,
    hanning_model,
    heaviside_linear_lines,
    rounded_lines,
)
from validation.reference.sensor_in_time import (
    heaviside_linear,
    mean_square,
    passages,
    phased_harmonics,
    point_signals,
    symmetry_leakage,
)

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


# The Hanning-window model against windows evaluated in time.


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


# The Heaviside/linear form: written out in time, and its lines in closed form.


def point_field(harmonics, n_max, seed=7):
    return random_field(harmonics, n_max, seed=seed)


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
    field = point_field(2, 5)
    lines = heaviside_linear_lines(field, 12, direction * 3.0, 0.9, points=9, max_order=60)
    quadrature = fourier_by_quadrature(field, 12, 9, 0.9, direction, range(61))
    assert np.allclose(lines.displacement, quadrature, rtol=0, atol=1e-12)


@pytest.mark.parametrize("direction", [1, -1])
def test_time_form_has_the_same_lines(direction):
    field, z_ring, points, samples = point_field(2, 4), 12, 9, 65536
    signals = point_signals(field, z_ring, points=points, samples=samples)
    passed = passages(points, 0.9, direction=direction)
    spectrum = np.fft.rfft(heaviside_linear(signals, passed))[:61] * 2 / samples
    spectrum[0] /= 2
    lines = heaviside_linear_lines(field, z_ring, direction * 3.0, 0.9, points=points, max_order=60)
    # lines of a signal with kinks fall like 1/order^2: so does what sampling folds back
    assert np.allclose(lines.displacement, spectrum, rtol=0, atol=1e-6)


@pytest.mark.parametrize("direction", [1, -1])
def test_time_form_takes_the_two_neighbouring_points_of_the_sensor(direction):
    field, points, samples = point_field(3, 6), 54, 540
    signals = point_signals(field, 108, points=points, samples=samples)
    heard = heaviside_linear(signals, passages(points, 0.3, direction=direction))
    for k in (0, 1, 17, 260, 539):
        phi = np.mod(0.3 - direction * 2 * np.pi * k / samples, 2 * np.pi)
        place = phi * points / (2 * np.pi)
        left = int(place)
        by_hand = (1 - place + left) * signals[left, k] + (place - left) * signals[(left + 1) % points, k]
        assert heard[k] == pytest.approx(by_hand, abs=1e-11)


def test_sensor_that_starts_on_a_point_meets_every_point_exactly():
    signals = point_signals(point_field(2, 4), 108, points=54, samples=540)
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
    fields = np.stack([point_field(2, 4, seed=s) for s in (1, 2)])
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
    field = point_field(2, 6)
    exact = fixed_sensor_lines(field, 108, 5.0, 0.4).displacement
    errors = []
    for points in (60, 120, 240, 480):
        lines = heaviside_linear_lines(field, 108, 5.0, 0.4, points=points).displacement
        errors.append(np.abs(lines - exact).max())
    assert np.allclose(np.array(errors[:-1]) / errors[1:], 4, atol=0.15)


@pytest.mark.parametrize("points", [2, 54.5, -1])
def test_unusable_points_are_refused(points):
    with pytest.raises(CaseError) as caught:
        heaviside_linear_lines(point_field(2, 3), 108, 5.0, 0.0, points=points)
    assert caught.value.code == "E-SYMMETRY"


# Which carrier orders a fixed sensor tells by itself, and fields of several speeds at once.


@pytest.mark.parametrize(("n_max", "top"), [(5, 3 * 36), (200, 2 * 36 + 200)])
def test_lines_end_where_the_field_does(n_max, top):
    """One mesh order above the highest harmonic, or the highest component of the field."""
    lines = fixed_sensor_lines(np.ones((3, 2 * n_max + 1)), 36, 3.0, 0.1)
    assert lines.order[-1] == top
    assert lines.displacement.shape == (top + 1,)


def test_windows_of_several_speeds_are_those_of_each():
    rng = np.random.default_rng(8)
    harmonics = rng.normal(size=(2, 5, 3, 4)) + 1j * rng.normal(size=(2, 5, 3, 4))
    angles = np.array([0.0, 2.0, 4.4])
    field = hanning_model(harmonics, angles, n_max=6)
    assert field.shape == (2, 5, 4, 13)
    for k in np.ndindex(2, 5):
        assert np.array_equal(field[k], hanning_model(harmonics[k], angles, n_max=6))


@pytest.mark.parametrize(("height", "count"), [(0.12, 2), (0.08, 1)])
def test_a_lobe_stands_out_by_a_tenth_of_the_largest(height, count):
    """Two bumps over a floor of 0.2, the smaller one as high above it as told."""
    turn = 2 * np.pi * np.arange(720) / 720
    bumps = (np.maximum(np.cos(turn - place), 0.0) ** 8 for place in (1.0, 4.0))
    envelope = 0.2 + 0.8 * next(bumps) + height * next(bumps)
    assert len(count_lobes(envelope).position) == count
