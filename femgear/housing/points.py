"""Points of the ring in the carrier frame, and the hand-over between them as the sensor passes."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.housing.checks import check_points, check_teeth, checked_angle, checked_field


def point_signals(field, z_ring: int, *, points: int, samples: int, first_point: float = 0.0) -> np.ndarray:
    """Signals u_j(t) of P equidistant points that stand still in the carrier frame, over one revolution.

    Parameters
    ----------
    field : (..., H + 1, 2 n_max + 1) complex array
        Carrier-frame components; give them times -(h omega_m)^2 for the accelerations of the points.
    z_ring : int
        Teeth of the ring: mesh periods in a revolution.
    points, first_point
        As in `heaviside_linear_lines`.
    samples : int
        Number of time samples.

    Returns
    -------
    (..., points, samples) array

    Raises
    ------
    CaseError
        ``E-FIELD``, ``E-TEETH``, ``E-POINTS``.
    """
    field, n = checked_field(field)
    check_points(points)
    check_teeth(z_ring)
    angle = first_point + 2 * np.pi * np.arange(points) / points
    turns = np.outer(np.arange(field.shape[-2]) * z_ring, np.arange(samples)) % samples / samples
    at_points = np.swapaxes(field @ np.exp(1j * np.outer(n, angle)), -1, -2)
    return (at_points @ np.exp(2j * np.pi * turns)).real


def passages(points: int, sensor_angle: float, *, direction: int = 1, first_point: float = 0.0) -> np.ndarray:
    """When a fixed sensor passes P equidistant carrier-frame points, as fractions of the revolution 0..1.

    Parameters
    ----------
    points, first_point
        As in `heaviside_linear_lines`.
    sensor_angle : float
        Angle of the sensor on the housing [rad].
    direction : int
        +1 where the carrier turns counter-clockwise, -1 clockwise.

    Returns
    -------
    (points,) array, in the order of the points.
    """
    check_points(points)
    start = direction * (checked_angle(sensor_angle) - checked_angle(first_point)) * points / (2 * np.pi)
    passed = np.mod(start - direction * np.arange(points), points) / points
    # mod rounds the smallest negative numbers up to the end of the revolution
    return np.where(passed < 1, passed, 0.0)


def heaviside_linear(signals, passed) -> np.ndarray:
    """The paper's Eqs. (13)-(16) as written out in time: the sensor hands over from point to point.

    u(t) = sum_i [H(t - t_i) - H(t - t_{i+1})] [u_i(t) + (t - t_i)/(t_{i+1} - t_i) (u_{i+1}(t) - u_i(t))],
    t_i the time at which the sensor passes the i-th point on its way. As printed the arguments of the
    Heaviside functions are reversed and 1/(t_{i+1} - t_i) is missing. H(0) = 1. Whatever the signals are
    (displacements, or accelerations of the points) is interpolated; the acceleration of the fixed
    point is the second derivative of the interpolated displacement, see `heaviside_linear_lines`.

    Parameters
    ----------
    signals : (..., points, samples) array
        Signals of the points over one revolution, as from `point_signals`.
    passed : (points,) array
        Fraction of the revolution at which each point is passed, 0 <= t_i < 1, all different, in any order.

    Returns
    -------
    (..., samples) array

    Raises
    ------
    CaseError
        ``E-POINTS`` for passages that do not fit the signals, repeat or leave 0..1.
    """
    signals, passed = np.asarray(signals, dtype=float), np.asarray(passed, dtype=float)
    bad = passed.shape != signals.shape[-2:-1] or np.unique(passed).size != passed.size
    if bad or not np.all((passed >= 0) & (passed < 1)):
        raise CaseError(
            f"{passed.size} passages do not fit {signals.shape[-2]} points, repeat, or leave the revolution",
            code="E-POINTS",
            limit="one passage a point, all different, 0 <= t < 1",
            remedy="take them from passages()",
        )
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


def unresolved_share(field, points: int) -> np.ndarray:
    """Share of the vibration (h >= 1) that P points cannot resolve: amplitude of the components |n| >= P/2.

    Parameters
    ----------
    field : (..., H + 1, 2 n_max + 1) complex array
    points : int

    Returns
    -------
    (...) array
        Root of the share of the sum of squares, 0..1; 0 where nothing vibrates.
    """
    field, n = checked_field(field)
    check_points(points)
    power = np.sum(np.abs(field[..., 1:, :]) ** 2, axis=-2)
    lost, total = power[..., 2 * np.abs(n) >= points].sum(axis=-1), power.sum(axis=-1)
    return np.sqrt(np.divide(lost, total, out=np.zeros_like(total), where=total > 0))
