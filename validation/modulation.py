"""From the carrier frame to a fixed sensor: lines, planet passage, interpolation, lobes."""

from __future__ import annotations

import numpy as np

from femgear.housing.orders import OrderSpectrum, analyse_band, order_spectrum
from femgear.housing.sensor import fixed_sensor_lines, hanning_model, heaviside_linear_lines
from validation.reference.sensor_in_time import heaviside_linear, passages, phased_harmonics, point_signals
from validation.rows import Row, at_most, counted, printed, within

Z_RING, POINTS = 108, 54


def modulated_carriers() -> tuple[Row, ...]:
    """J1: side bands of amplitude and phase modulation."""
    turn = 2 * np.pi * np.arange(4096) / 4096
    amplitude = order_spectrum((1 + 0.6 * np.cos(3 * turn)) * np.cos(108 * turn)).amplitude
    rest = np.delete(amplitude, [105, 108, 111]).max()
    phase = order_spectrum(np.cos(108 * turn + 0.5 * np.sin(3 * turn))).amplitude
    source, bessel = "cos a cos b", "Bessel functions J_k(0.5)"
    name = "phase modulation 0.5: line at "
    return (
        within("J1", source, "amplitude modulation 0.6: lower side band", 0.3, amplitude[105], 1e-12),
        within("J1", source, "amplitude modulation 0.6: upper side band", 0.3, amplitude[111], 1e-12),
        at_most("J1", source, "amplitude modulation 0.6: largest other line", 1e-12, rest),
        printed("J1", bessel, name + "the carrier", ".9384698072", phase[108]),
        printed("J1", bessel, name + "side band 1", ".2422684577", phase[111]),
        printed("J1", bessel, name + "side band 2", ".0306040235", phase[114]),
        printed("J1", bessel, name + "side band 3", ".0025637300", phase[117]),
    )


def planet_passage() -> tuple[Row, ...]:
    """J2: equal planets that pass the sensor leave multiples of N alone."""
    source = "McFadden and Smith 1985, window (1 + cos)/2"
    rows = []
    for z_ring, planets, order, value in (
        (81, 3, 81, 1.5),
        (80, 3, 81, 0.75),
        (79, 3, 78, 0.75),
        (100, 4, 100, 2.0),
        (99, 4, 100, 1.0),
        (125, 4, 124, 1.0),
    ):
        angles = 2 * np.pi * np.arange(planets) / planets
        harmonics = phased_harmonics([0.0, 1.0], z_ring * angles / (2 * np.pi))
        field = hanning_model(harmonics, angles, width=2 * np.pi, n_max=2)
        amplitudes = np.abs(fixed_sensor_lines(field, z_ring, 1.0, 0.0).displacement)
        name = f"ring {z_ring}, {planets} planets: "
        rows.append(within("J2", source, name + f"line at order {order}", value, amplitudes[order], 1e-12))
        rows.append(at_most("J2", source, name + "largest other line", 1e-9, np.delete(amplitudes, order).max()))
    return tuple(rows)


def _component(n, n_max=24, harmonic=1):
    field = np.zeros((harmonic + 1, 2 * n_max + 1), dtype=complex)
    for diameter in np.atleast_1d(n):
        field[harmonic, n_max + diameter] = 1.0
    return field


def moving_sensor() -> tuple[Row, ...]:
    """The exact lines against the field sampled where the sensor is."""
    rng = np.random.default_rng(7)
    n_max, harmonics, samples = 10, 3, 4 * 512
    field = rng.normal(size=(harmonics + 1, 2 * n_max + 1)) + 1j * rng.normal(size=(harmonics + 1, 2 * n_max + 1))
    n, h = np.arange(-n_max, n_max + 1), np.arange(harmonics + 1)
    t = np.arange(samples) / samples
    rows = []
    for direction, name in ((1, "counter-clockwise"), (-1, "clockwise")):
        phi = 0.4 - direction * 2 * np.pi * t
        around, in_time = np.exp(1j * np.outer(phi, n)), np.exp(2j * np.pi * Z_RING * np.outer(t, h))
        sampled = np.einsum("tn,th,hn->t", around, in_time, field).real
        reference = order_spectrum(sampled).value
        lines = fixed_sensor_lines(field, Z_RING, direction * 4.0, 0.4).displacement
        top = min(len(reference), len(lines))
        difference = np.abs(reference[:top] - lines[:top]).max() / np.abs(reference).max()
        source = "field evaluated at the sensor, discrete Fourier transform"
        rows.append(at_most("lines", source, f"carrier {name}: largest difference of a line", 1e-10, difference))
    return tuple(rows)


def linear_interpolation() -> tuple[Row, ...]:
    """Attenuation and images of the Heaviside/linear form, closed form and written out in time."""
    source = "Fourier transform of the hat function, sinc^2(n/P)"
    samples = Z_RING * POINTS * 20
    rows = []
    for n in (3, 6, 12):
        weight, order = np.sinc(n / POINTS) ** 2, Z_RING - n
        lines = np.abs(heaviside_linear_lines(_component(n), Z_RING, 1.0, 0.0, points=POINTS).displacement)
        signals = point_signals(_component(n), Z_RING, points=POINTS, samples=samples)
        literal = order_spectrum(heaviside_linear(signals, passages(POINTS, 0.0))).amplitude
        image = (n / (n - POINTS)) ** 2
        name = f"P = {POINTS}, n = {n}: "
        rows.append(within("sinc", source, name + "line, closed form", weight, lines[order], 1e-12))
        rows.append(within("sinc", source, name + "line, Eqs. 13-16 in time", weight, literal[order], 1e-6))
        rows.append(
            within(
                "sinc",
                "(n/(n - P))^2",
                name + f"image at order {order + POINTS} over the line",
                image,
                lines[order + POINTS] / lines[order],
                1e-12,
            )
        )
    return tuple(rows)


def lobes() -> tuple[Row, ...]:
    """Lobes of the envelope: a ring pattern of three waves against the Hanning model of three planets."""
    lines = fixed_sensor_lines(_component([-3, 3]), Z_RING, 1.0, 0.0)
    band = analyse_band(OrderSpectrum(lines.order, lines.displacement), Z_RING, 1)
    orders = sorted(int(line.order) for line in band.lines)
    angles = 2 * np.pi * np.arange(3) / 3
    field = hanning_model(phased_harmonics([0.0, 1.0], Z_RING * angles / (2 * np.pi)), angles)
    model = fixed_sensor_lines(field, Z_RING, 1.0, 0.0)
    hanning = analyse_band(OrderSpectrum(model.order, model.displacement), Z_RING, 1)
    source = "|cos 3 phi| has six maxima a revolution"
    return (
        counted("lobes", "order h z_ring - n", "ring pattern n = -3, 3: lower line", Z_RING - 3, orders[0]),
        counted("lobes", "order h z_ring - n", "ring pattern n = -3, 3: upper line", Z_RING + 3, orders[-1]),
        counted("lobes", source, "ring pattern n = -3, 3: lobes", 6, len(band.lobes.position)),
        counted("lobes", "one window a planet", "Hanning model, 3 planets: lobes", 3, len(hanning.lobes.position)),
    )
