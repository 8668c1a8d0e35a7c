"""From the carrier frame to a fixed sensor: what the housing feels while the carrier turns.

What cannot be computed is refused first; `motion_of` tells how the sensor moves past the field. The radial
displacement of the ring's outer surface is given in the frame of the carrier,

    u(phi, t) = Re sum_h sum_n U[h, n] exp(i n phi) exp(i h omega_m t),   h = 0..H, n = -n_max..n_max,

and the sensor stands still at the housing angle phi_s, so that it sees phi = phi_s - Omega_c t. With the ring
fixed omega_m = z_ring |Omega_c|: component (h, n) is heard at the carrier order h z_ring - sign(Omega_c) n.
Two forms: exact (one line a component) and the Heaviside/linear form, in which the sensor hands over between
P points of the ring as it passes them: "Vibratory response of planetary gear sets housing by a spectral
iterative approach - Modulation effects induced by carrier rotation", Eqs. (13)-(16), in closed form
(`heaviside_linear_lines`) and written out in time (`heaviside_linear`).

Linear interpolation of exp(i n phi) between points first_point + 2 pi j / P is the sum over all
integers q of sinc^2(m/P) exp(i m phi) exp(-i q P first_point) with m = n + q P and
sinc(x) = sin(pi x)/(pi x): samples repeat a component with period P, the hat function weighs every
copy with its transform. So n itself is attenuated by sinc^2(n/P) and has images at m weaker by (n/m)^2.
The interpolated displacement has a kink whenever the sensor passes a point: its lines fall like
1/order^2 and those of its second derivative do not fall at all. Where z_ring is a multiple of P the
images of the static deformation (h = 0) fall on the mesh orders h z_ring - n themselves.

In the classical model of a planet's passage every planet carries a Hanning window past the sensor, which
hears sum_p w(phi - psi_p) s_p(t), phi its angle in the carrier frame, psi_p that of planet p, s_p the signal
of the planet's mesh with the ring, and w(x) = (1 + cos(2 pi x / width))/2 for |x| < width/2, 0 elsewhere. A
window that rides on the planet is a field of the carrier frame (`hanning_model`): U[h, n] = sum_p c_n exp(-i
n psi_p) s_p[h], where

    c_n = width/(4 pi) sinc(v)/(1 - v^2),  v = n width/(2 pi),  c_n = width/(8 pi) where |v| = 1.

width = 2 pi: McFadden and Smith (1985), every planet always heard; width = 2 pi/N: Inalpolat and
Kahraman (2009), only the nearest planet of N is heard.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError


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


def hanning_model(harmonics, planet_angles, *, width: float | None = None, n_max: int = 24) -> np.ndarray:
    """Carrier-frame field of the Hanning-window model, for `fixed_sensor_lines`.

    Parameters
    ----------
    harmonics : (..., N, H + 1) complex array
        Harmonics of every planet's mesh signal in common time, for example the mesh forces of the
        planet-ring meshes, or from `phased_harmonics`.
    planet_angles : (N,) array
        Angles psi_p in the carrier frame [rad].
    width : float, optional
        Angle over which a planet is heard [rad], 0 < width <= 2 pi; default 2 pi/N.
    n_max : int
        Circumferential orders kept; c_n falls like 1/n^3 (width = 2 pi: nothing beyond n = 1).

    Returns
    -------
    (..., H + 1, 2 n_max + 1) complex array
        In the unit of the harmonics.

    Raises
    ------
    CaseError
        ``E-FIELD`` for harmonics that do not fit the planets; ``E-WINDOW`` for a width out of range.
    """
    harmonics, psi = np.asarray(harmonics, dtype=complex), np.asarray(planet_angles, dtype=float)
    if harmonics.ndim < 2 or psi.shape != harmonics.shape[-2:-1] or not np.all(np.isfinite(harmonics)):
        raise CaseError(
            f"mesh harmonics of shape {harmonics.shape} do not fit {psi.size} planets",
            code="E-FIELD",
            limit="finite values of shape (..., planets, H + 1)",
            remedy="give the harmonics of the planet-ring meshes alone",
        )
    width = 2 * np.pi / psi.size if width is None else width
    # a width rounded from degrees may exceed the circle by one bit
    if not 0 < width <= 2 * np.pi * (1 + 1e-12):
        raise CaseError(
            f"a window of {width} rad does not fit on the ring",
            code="E-WINDOW",
            value=width,
            limit="0 < width <= 2 pi",
            remedy="leave it out for 2 pi divided by the number of planets",
        )
    n = np.arange(-n_max, n_max + 1)
    riding = _window_components(n, width)[:, None] * np.exp(-1j * np.outer(n, psi))
    return np.swapaxes(riding @ harmonics, -1, -2)


@dataclass(frozen=True)
class Motion:
    """How the sensor moves past the carrier-frame field: direction +1, 0, -1 and the speed orders count."""

    direction: int
    base_speed: np.ndarray


def motion_of(field: np.ndarray, z_ring: int, carrier_speed, mesh_frequency) -> Motion:
    """Direction and base speed, refusing what the order analysis cannot express."""
    check_teeth(z_ring)
    speed = np.asarray(carrier_speed, dtype=float)
    direction = np.unique(np.sign(speed))
    if speed.shape != field.shape[:-2] or not np.all(np.isfinite(speed)) or direction.size != 1:
        raise CaseError(
            f"carrier speeds of shape {speed.shape}, directions {direction.tolist()}, do not fit the field",
            code="E-SPEED",
            value=carrier_speed,
            limit=f"finite speeds of shape {field.shape[:-2]}, all of one direction",
            remedy="one speed for every field; split a sweep where the carrier changes direction",
        )
    expected = z_ring * np.abs(speed)
    given = expected if mesh_frequency is None else 2 * np.pi * np.asarray(mesh_frequency, dtype=float)
    standing = direction[0] == 0
    if given.shape != speed.shape or not np.all(given > 0) or not np.all(np.isfinite(given)):
        raise CaseError(
            "the mesh frequency is missing or not positive"
            if standing
            else "the mesh frequency is not usable",
            code="E-SPEED",
            value=mesh_frequency,
            limit=f"positive mesh frequencies [Hz] of shape {speed.shape}",
            remedy="give mesh_frequency: a carrier that stands still does not tell it",
        )
    if not standing and not np.allclose(given, expected, rtol=1e-6, atol=0):
        raise CaseError(
            "the mesh frequency is not that of a fixed ring, and a housing sensor does not ride on another",
            code="E-SPEED",
            value=mesh_frequency,
            limit="z_ring |carrier_speed| / (2 pi)",
            remedy="use a set whose ring or carrier is fixed",
        )
    return Motion(int(direction[0]), given / z_ring)


def top_order(field: np.ndarray, z_ring: int, max_order: int | None) -> int:
    harmonics, n_max = field.shape[-2] - 1, field.shape[-1] // 2
    top = max((harmonics + 1) * z_ring, harmonics * z_ring + n_max) if max_order is None else max_order
    if top != int(top) or top < 1:
        raise CaseError(
            f"{max_order} is not a highest carrier order",
            code="E-ORDERS",
            key="max_order",
            value=max_order,
            limit="a positive integer",
            remedy="leave it out for (H + 1) z_ring",
        )
    return int(top)


def checked_field(field) -> tuple[np.ndarray, np.ndarray]:
    """The field as a complex array and its circumferential orders n = -n_max..n_max."""
    field = np.asarray(field, dtype=complex)
    if field.ndim < 2 or field.size == 0 or field.shape[-1] % 2 == 0 or not np.all(np.isfinite(field)):
        raise CaseError(
            f"the carrier-frame field of shape {field.shape} is not usable",
            code="E-FIELD",
            limit="finite values of shape (..., H + 1, 2 n_max + 1)",
            remedy="give one column for every n = -n_max..n_max",
        )
    n_max = field.shape[-1] // 2
    return field, np.arange(-n_max, n_max + 1)


def checked_angle(angle: float) -> float:
    if not np.isfinite(angle):
        raise CaseError(
            f"the angle {angle} is not a number of radians",
            code="E-ANGLE",
            key="housing.sensor_angle",
            value=angle,
            limit="a finite angle",
            remedy="give an angle such as 0.5",
        )
    return float(angle)


def check_points(points: int) -> None:
    if points != int(points) or points < 3:
        raise CaseError(
            f"{points} points do not describe a ring",
            code="E-POINTS",
            key="housing.points",
            value=points,
            limit="an integer of at least 3, more than twice the largest nodal diameter that matters",
            remedy="use 54 or more, a multiple of the number of planets",
        )


def check_teeth(z_ring: int) -> None:
    if z_ring != int(z_ring) or z_ring < 1:
        raise CaseError(
            f"{z_ring} ring teeth do not give a mesh order",
            code="E-TEETH",
            key="ring.teeth",
            value=z_ring,
            limit="a positive integer",
            remedy="give the number of teeth of the ring",
        )


def read_only(obj, *names: str) -> None:
    """Replace the named fields of a frozen dataclass by read-only arrays of their own."""
    for name in names:
        array = np.array(getattr(obj, name))
        array.setflags(write=False)
        object.__setattr__(obj, name, array)


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


def _synthesised(lines: np.ndarray, samples: int) -> np.ndarray:
    """Re sum_k lines[k] exp(2 pi i k t), t in equal steps of one revolution."""
    spectrum = lines * (samples / 2)
    spectrum[..., 0] *= 2
    return np.fft.irfft(spectrum, samples, axis=-1)


def _window_components(n: np.ndarray, width: float) -> np.ndarray:
    """Fourier components c_n of the window on the circle."""
    v = n * width / (2 * np.pi)
    # sinc(v)/(1 - v^2) = (sinc(v - 1) + sinc(v + 1))/2 + sinc(v): no division at |v| = 1
    return width / (4 * np.pi) * (np.sinc(v) + (np.sinc(v - 1) + np.sinc(v + 1)) / 2)
