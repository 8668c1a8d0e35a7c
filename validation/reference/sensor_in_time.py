"""What a fixed sensor hears, written out in time, and the rule of identical planets: counter-proofs."""

from __future__ import annotations

import numpy as np

from femgear.housing.orders import OrderSpectrum


def point_signals(field, z_ring: int, *, points: int, samples: int) -> np.ndarray:
    """Signals u_j(t) of P equidistant points that stand still in the carrier frame, over one revolution.

    Parameters
    ----------
    field : (..., H + 1, 2 n_max + 1) complex array
        Carrier-frame components; give them times -(h omega_m)^2 for the accelerations of the points.
    z_ring : int
        Teeth of the ring: mesh periods in a revolution.
    points : int
        As in `femgear.housing.sensor.heaviside_linear_lines`.
    samples : int
        Number of time samples.

    Returns
    -------
    (..., points, samples) array
    """
    n = np.arange(field.shape[-1]) - field.shape[-1] // 2
    angle = 2 * np.pi * np.arange(points) / points
    turns = np.outer(np.arange(field.shape[-2]) * z_ring, np.arange(samples)) % samples / samples
    at_points = np.swapaxes(field @ np.exp(1j * np.outer(n, angle)), -1, -2)
    return (at_points @ np.exp(2j * np.pi * turns)).real


def passages(points: int, sensor_angle: float, *, direction: int = 1) -> np.ndarray:
    """When a fixed sensor passes P equidistant carrier-frame points, as fractions of the revolution 0..1.

    Parameters
    ----------
    points : int
        As in `femgear.housing.sensor.heaviside_linear_lines`.
    sensor_angle : float
        Angle of the sensor on the housing [rad].
    direction : int
        +1 where the carrier turns counter-clockwise, -1 clockwise.

    Returns
    -------
    (points,) array, in the order of the points.
    """
    start = direction * sensor_angle * points / (2 * np.pi)
    passed = np.mod(start - direction * np.arange(points), points) / points
    # mod rounds the smallest negative numbers up to the end of the revolution
    return np.where(passed < 1, passed, 0.0)


def heaviside_linear(signals, passed) -> np.ndarray:
    """The paper's Eqs. (13)-(16) as written out in time: the sensor hands over from point to point.

    u(t) = sum_i [H(t - t_i) - H(t - t_{i+1})] [u_i(t) + (t - t_i)/(t_{i+1} - t_i) (u_{i+1}(t) - u_i(t))],
    t_i the time at which the sensor passes the i-th point on its way. As printed the arguments of the
    Heaviside functions are reversed and 1/(t_{i+1} - t_i) is missing. H(0) = 1. Whatever the signals are
    (displacements, or accelerations of the points) is interpolated; the acceleration of the fixed
    point is the second derivative of the interpolated displacement, see `femgear.housing.sensor`.

    Parameters
    ----------
    signals : (..., points, samples) array
        Signals of the points over one revolution, as from `point_signals`.
    passed : (points,) array
        Fraction of the revolution at which each point is passed, 0 <= t_i < 1, all different, in any order.

    Returns
    -------
    (..., samples) array
    """
    sequence = np.argsort(passed)
    here, onwards = signals[..., sequence, :], signals[..., np.roll(sequence, -1), :]
    t = np.arange(signals.shape[-1]) / signals.shape[-1]
    start = passed[sequence]
    length = np.diff(start, append=start[0] + 1)
    reached = np.heaviside(t - start[:, None], 1.0)
    window = reached - np.roll(reached, -1, axis=0)
    window[-1] += 1  # the last segment runs through the seam of the revolution
    share = np.mod(t - start[:, None], 1.0) / length[:, None]
    return np.einsum("pt,...pt->...t", window * (1 - share), here) + np.einsum(
        "pt,...pt->...t", window * share, onwards
    )


def phased_harmonics(harmonics, mesh_phases) -> np.ndarray:
    """Harmonics of planets that all do the same, each at its own mesh phase.

    Parameters
    ----------
    harmonics : (..., H + 1) complex array
        Mesh signal of a planet of phase zero: Re sum_h harmonics[h] exp(i h omega_m t).
    mesh_phases : (N,) array
        Phase of every planet's mesh with the ring, as a fraction of the mesh period.

    Returns
    -------
    (..., N, H + 1) complex array
    """
    harmonics = np.asarray(harmonics, dtype=complex)
    turns = np.outer(mesh_phases, np.arange(harmonics.shape[-1]))
    return harmonics[..., None, :] * np.exp(2j * np.pi * turns)


def symmetry_leakage(spectrum: OrderSpectrum, planets: int) -> np.ndarray:
    """Largest amplitude at orders that are no multiple of the number of planets, over the largest of all.

    Identical, equally spaced planets on a symmetric ring leave nothing there (McFadden and Smith,
    1985): the sensor cannot tell the planets apart, so the signal repeats N times a revolution.

    Returns
    -------
    (...) array
        0 where there is no signal.
    """
    amplitude = spectrum.amplitude
    others = np.abs(spectrum.order / planets - np.rint(spectrum.order / planets)) > 1e-9
    largest = amplitude.max(axis=-1)
    leak = amplitude[..., others].max(axis=-1, initial=0.0)
    return np.divide(leak, largest, out=np.zeros_like(largest), where=largest > 0)


def mean_square(spectrum: OrderSpectrum) -> np.ndarray:
    """Mean square of the signal of a spectrum (Parseval), shape (...)."""
    power = np.abs(spectrum.value) ** 2
    return power[..., 0] + power[..., 1:].sum(axis=-1) / 2
