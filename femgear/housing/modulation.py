"""From the carrier frame to a fixed sensor: what the housing feels while the carrier turns.

The radial displacement of the ring's outer surface is given in the frame of the carrier,

    u(phi, t) = Re sum_h sum_n U[h, n] exp(i n phi) exp(i h omega_m t),   h = 0..H, n = -n_max..n_max,

and the sensor stands still at the housing angle phi_s, so that it sees phi = phi_s - Omega_c t. With
the ring fixed omega_m = z_ring |Omega_c|: component (h, n) is heard at the carrier order
h z_ring - sign(Omega_c) n. Two forms: exact (one line a component) and the Heaviside/linear form over P
points of "Vibratory response of planetary gear sets housing by a spectral iterative approach -
Modulation effects induced by carrier rotation", Eqs. (13)-(16), written out in time in `points`.

Linear interpolation of exp(i n phi) between points first_point + 2 pi j / P is the sum over all
integers q of sinc^2(m/P) exp(i m phi) exp(-i q P first_point) with m = n + q P and
sinc(x) = sin(pi x)/(pi x): samples repeat a component with period P, the hat function weighs every
copy with its transform. So n itself is attenuated by sinc^2(n/P) and has images at m weaker by (n/m)^2.
The interpolated displacement has a kink whenever the sensor passes a point: its lines fall like
1/order^2 and those of its second derivative do not fall at all. Where z_ring is a multiple of P the
images of the static deformation (h = 0) fall on the mesh orders h z_ring - n themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.housing.checks import check_points, checked_angle, checked_field, motion_of, read_only, top_order


@dataclass(frozen=True)
class SensorLines:
    """Lines that a fixed sensor hears: ``u(t) = Re sum_k displacement[k] exp(i k base_speed t)``.

    Parameters
    ----------
    order : (n_orders,) int array
        Carrier orders 0, 1, 2, ...
    displacement : (..., n_orders) complex array
        Single-sided complex amplitudes [m].
    base_speed : (...) array
        Speed that orders count [rad/s]: that of the carrier against the ring, always positive.
    sensor_angle : float
        Position of the sensor on the housing [rad].
    z_ring : int
        Teeth of the ring, the order of the mesh frequency.
    method : str
        ``"exact"`` or ``"linear, P points"``.
    """

    order: np.ndarray
    displacement: np.ndarray
    base_speed: np.ndarray
    sensor_angle: float
    z_ring: int
    method: str

    def __post_init__(self):
        read_only(self, "order", "displacement", "base_speed")

    @property
    def frequency(self) -> np.ndarray:
        """Frequency of every line [Hz], shape (..., n_orders)."""
        return self.order * self.base_speed[..., None] / (2 * np.pi)

    @property
    def acceleration(self) -> np.ndarray:
        """Amplitudes of the acceleration of the fixed point [m/s^2], shape (..., n_orders).

        Second derivative of the heard displacement: every line times -(order base_speed)^2, its own
        order and not that of the mesh harmonic it came from.
        """
        return -((self.order * self.base_speed[..., None]) ** 2) * self.displacement


@dataclass(frozen=True)
class HousingSignal:
    """Time signal of a fixed sensor over one revolution of the carrier (end point excluded).

    Parameters
    ----------
    revolution : (n_times,) array
        Fraction of the carrier revolution, 0..1.
    seconds : (..., n_times) array
        Time [s].
    displacement : (..., n_times) array
        Radial displacement [m], positive outwards.
    acceleration : (..., n_times) array
        Radial acceleration of the fixed point [m/s^2].
    sensor_angle : float
        Position of the sensor on the housing [rad].
    method : str
        Where the lines came from, as in `SensorLines`.
    """

    revolution: np.ndarray
    seconds: np.ndarray
    displacement: np.ndarray
    acceleration: np.ndarray
    sensor_angle: float
    method: str

    def __post_init__(self):
        read_only(self, "revolution", "seconds", "displacement", "acceleration")


def fixed_sensor_lines(
    field,
    z_ring: int,
    carrier_speed,
    sensor_angle: float,
    *,
    mesh_frequency=None,
    max_order: int | None = None,
) -> SensorLines:
    """Exact lines of a fixed sensor: component (h, n) at order ``h z_ring - sign(carrier_speed) n``.

    Components that fall on the same order add with their phases; negative orders are folded to
    positive ones (the conjugate). Where the carrier stands still there is no modulation and every
    component of harmonic h is heard at order ``h z_ring``.

    Parameters
    ----------
    field : (..., H + 1, 2 n_max + 1) complex array
        Carrier-frame components U[h, n] [m], n = -n_max..n_max.
    z_ring : int
        Teeth of the ring.
    carrier_speed : float or (...) array
        Speed of the carrier [rad/s], counter-clockwise positive, one a speed; all of one direction.
    sensor_angle : float
        Angle of the sensor on the housing [rad], where the carrier frame is at time zero.
    mesh_frequency : float or (...) array, optional
        Mesh frequency [Hz]. Needed where the carrier stands still; otherwise it must be
        ``z_ring |carrier_speed| / (2 pi)``, that is, the ring is fixed.
    max_order : int, optional
        Highest carrier order; default: the larger of (H + 1) z_ring and H z_ring + n_max, so that no
        line is lost.

    Raises
    ------
    CaseError
        ``E-FIELD``, ``E-TEETH``, ``E-SPEED``, ``E-ORDERS``: data of the wrong shape or not finite, speeds
        of both directions, a ring that turns.
    """
    field, n = checked_field(field)
    motion = motion_of(field, z_ring, carrier_speed, mesh_frequency)
    top = top_order(field, z_ring, max_order)
    heard = field * np.exp(1j * n * checked_angle(sensor_angle))
    two_sided = _heard_orders(heard, z_ring, motion.direction, top)
    return SensorLines(
        np.arange(top + 1), _folded(two_sided), motion.base_speed, float(sensor_angle), int(z_ring), "exact"
    )


def heaviside_linear_lines(
    field,
    z_ring: int,
    carrier_speed,
    sensor_angle: float,
    *,
    points: int = 54,
    first_point: float = 0.0,
    mesh_frequency=None,
    max_order: int | None = None,
) -> SensorLines:
    """Lines of the Heaviside/linear form over P points of the ring (paper Eqs. (13)-(16)), in closed form.

    The acceleration has no natural end, see the head of this module: the order range is limited,
    default (H + 1) z_ring. P should be a multiple of the number of planets (or the points break the
    symmetry of the set) and more than twice the largest n that matters (`unresolved_share`).

    Parameters
    ----------
    field, z_ring, carrier_speed, sensor_angle, mesh_frequency, max_order
        As in `fixed_sensor_lines`.
    points : int
        Number P of equidistant points on the ring.
    first_point : float
        Carrier-frame angle of point 0 [rad].

    Returns
    -------
    SensorLines

    Raises
    ------
    CaseError
        As `fixed_sensor_lines`, and ``E-POINTS`` for less than 3 points.
    """
    field, n = checked_field(field)
    check_points(points)
    motion = motion_of(field, z_ring, carrier_speed, mesh_frequency)
    top = top_order(field, z_ring, max_order)
    away = checked_angle(sensor_angle) - checked_angle(first_point)
    sampled = _sampled_components(field, n, points, first_point)
    if motion.direction == 0:
        standing = _between_points(sampled, points, away)
        two_sided = _heard_orders(standing[..., None], z_ring, 0, top)
    else:
        two_sided = _interpolated_orders(sampled, z_ring, motion.direction, top, away)
    method = f"linear, {points} points"
    lines = _folded(two_sided)
    return SensorLines(np.arange(top + 1), lines, motion.base_speed, float(sensor_angle), int(z_ring), method)


def fixed_sensor_signal(lines: SensorLines, *, samples: int | None = None) -> HousingSignal:
    """Displacement and acceleration over one revolution of the carrier, by inverse FFT of the lines.

    Parameters
    ----------
    lines : SensorLines
        From `fixed_sensor_lines` or `heaviside_linear_lines`.
    samples : int, optional
        Number of samples, more than twice the highest order; default: at least four times the highest
        order and a whole number a mesh period.

    Returns
    -------
    HousingSignal

    Raises
    ------
    CaseError
        ``E-SAMPLES`` for too few samples.
    """
    top = int(lines.order[-1])
    if samples is None:
        samples = lines.z_ring * -(-4 * top // lines.z_ring)
    if samples <= 2 * top:
        raise CaseError(
            f"{samples} samples cannot carry {top} carrier orders",
            code="E-SAMPLES",
            key="samples",
            value=samples,
            limit=f"more than {2 * top} samples a carrier revolution",
            remedy="ask for more samples or lower max_order",
        )
    revolution = np.arange(samples) / samples
    seconds = 2 * np.pi * revolution / lines.base_speed[..., None]
    return HousingSignal(
        revolution,
        seconds,
        _synthesised(lines.displacement, samples),
        _synthesised(lines.acceleration, samples),
        lines.sensor_angle,
        lines.method,
    )


def _synthesised(lines: np.ndarray, samples: int) -> np.ndarray:
    """Re sum_k lines[k] exp(2 pi i k t), t in equal steps of one revolution."""
    spectrum = lines * (samples / 2)
    spectrum[..., 0] *= 2
    return np.fft.irfft(spectrum, samples, axis=-1)


def _sampled_components(field: np.ndarray, n: np.ndarray, points: int, first_point: float) -> np.ndarray:
    """Components that P points tell apart: sum over all n of one residue modulo P, phase at point 0."""
    at_first = field * np.exp(1j * n * first_point)
    sampled = np.zeros((*field.shape[:-1], points), dtype=complex)
    for residue in np.unique(n % points):
        sampled[..., residue] = at_first[..., n % points == residue].sum(axis=-1)
    return sampled


def _interpolated_orders(
    sampled: np.ndarray, z_ring: int, direction: int, top: int, away: float
) -> np.ndarray:
    """Two-sided lines -top..top of the linear interpolation: components and all their images."""
    points = sampled.shape[-1]
    order = np.arange(-top, top + 1)
    two_sided = np.zeros((*sampled.shape[:-2], order.size), dtype=complex)
    for h in range(sampled.shape[-2]):
        m = direction * (h * z_ring - order)
        two_sided += sampled[..., h, m % points] * (np.sinc(m / points) ** 2 * np.exp(1j * m * away))
    return two_sided


def _between_points(sampled: np.ndarray, points: int, away: float) -> np.ndarray:
    """Value of the linear interpolation at the angle `away` from point 0."""
    at_points = np.fft.ifft(sampled, axis=-1) * points
    place = away * points / (2 * np.pi)
    i = int(np.floor(place))
    return (1 - (place - i)) * at_points[..., i % points] + (place - i) * at_points[..., (i + 1) % points]


def _heard_orders(heard: np.ndarray, z_ring: int, direction: int, top: int) -> np.ndarray:
    """Two-sided lines -top..top: every component added at order h z_ring - direction n."""
    n_max = heard.shape[-1] // 2
    two_sided = np.zeros((*heard.shape[:-2], 2 * top + 1), dtype=complex)
    if direction == 0:
        heard = heard.sum(axis=-1, keepdims=True)
        n_max = 0
    ascending = heard[..., ::-1] if direction > 0 else heard
    for h in range(heard.shape[-2]):
        low, high = h * z_ring - n_max, h * z_ring + n_max
        first, last = max(low, -top), min(high, top)
        if first <= last:
            two_sided[..., top + first : top + last + 1] += ascending[..., h, first - low : last - low + 1]
    return two_sided


def _folded(two_sided: np.ndarray) -> np.ndarray:
    """Single-sided amplitudes of Re sum_k c_k exp(i k x): c_k + conj(c_-k), real at order 0."""
    top = two_sided.shape[-1] // 2
    lines = two_sided[..., top:] + np.conj(two_sided[..., top::-1])
    lines[..., 0] = two_sided[..., top].real
    return lines
