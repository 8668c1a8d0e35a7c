"""From the carrier frame to a fixed sensor: what the housing feels while the carrier turns.

The radial displacement of the ring's outer surface is given in the frame of the carrier,

    u(phi, t) = Re sum_h sum_n U[h, n] exp(i n phi) exp(i h omega_m t),   h = 0..H, n = -n_max..n_max,

and the sensor stands still at the housing angle phi_s, so that it sees phi = phi_s - Omega_c t. With the ring
fixed omega_m = z_ring |Omega_c|: component (h, n) is heard at the carrier order h z_ring - sign(Omega_c) n.
Where the field repeats after P mesh periods, by errors that turn, h counts P-ths of a mesh harmonic, and
orders are h z_ring/P - sign(Omega_c) n, multiples of 1/turns: all repeats after so many turns of the carrier.
Two forms: exact (one line a component) and the Heaviside/linear form, in which the sensor hands over between
P points of the ring as it passes them: "Vibratory response of planetary gear sets housing by a spectral
iterative approach - Modulation effects induced by carrier rotation", Eqs. (13)-(16), in closed form
(`heaviside_linear_lines`). As printed there the arguments of the Heaviside functions are reversed and
1/(t_{i+1} - t_i) is missing.

Linear interpolation of exp(i n phi) between points 2 pi j / P is the sum over all
integers q of sinc^2(m/P) exp(i m phi) with m = n + q P and
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

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from femgear.errors import CaseError, checked_count


class ReadOnlyArrays:
    """Frozen dataclass that keeps read-only copies of its arrays."""

    def __post_init__(self):
        for field in fields(self):  # type: ignore[arg-type]
            if field.type == "np.ndarray":
                array = np.array(getattr(self, field.name))
                array.setflags(write=False)
                object.__setattr__(self, field.name, array)


@dataclass(frozen=True)
class SensorLines(ReadOnlyArrays):
    """Lines that a fixed sensor hears: ``u(t) = Re sum_k displacement[k] exp(i order[k] base_speed t)``.

    Parameters
    ----------
    order : (n_orders,) array
        Carrier orders, ascending, from 0 upwards; others are silent. Whole numbers where all repeats with
        every turn of the carrier, else multiples of 1/turns.
    displacement : (..., n_orders) complex array
        Single-sided complex amplitudes [m].
    carrier_speed : (...) array
        Speed of the carrier against the ring [rad/s], counter-clockwise positive.
    sensor_angle : float
        Position of the sensor on the housing [rad].
    z_ring : int
        Teeth of the ring, the order of the mesh frequency.
    method : str
        ``"exact"``, ``"linear, P points"`` or ``"supports"``, of a structure that stands still: only the
        first have one nodal diameter a line. Errors that turn have several: ``"exact, P mesh periods"``.
    turns : int
        Turns of the carrier after which all repeats.
    """

    order: np.ndarray
    displacement: np.ndarray
    carrier_speed: np.ndarray
    sensor_angle: float
    z_ring: int
    method: str
    turns: int = 1

    @property
    def number(self) -> np.ndarray:
        """Whole periods of every line in ``turns`` turns of the carrier, (n_orders,) int."""
        return np.rint(self.order * self.turns).astype(int)

    @property
    def base_speed(self) -> np.ndarray:
        """Speed that orders count [rad/s], shape (...), always positive."""
        return np.abs(self.carrier_speed)

    @property
    def frequency(self) -> np.ndarray:
        """Frequency of every line [Hz], shape (..., n_orders)."""
        return self.order * self.base_speed[..., None] / (2 * np.pi)

    @property
    def velocity(self) -> np.ndarray:
        """Amplitudes of the velocity of the fixed point [m/s], shape (..., n_orders)."""
        return 1j * self.order * self.base_speed[..., None] * self.displacement

    @property
    def acceleration(self) -> np.ndarray:
        """Amplitudes of the acceleration of the fixed point [m/s^2], shape (..., n_orders).

        Second derivative of the heard displacement: every line times -(order base_speed)^2, its own
        order and not that of the mesh harmonic it came from.
        """
        return -((self.order * self.base_speed[..., None]) ** 2) * self.displacement


@dataclass(frozen=True)
class HousingSignal(ReadOnlyArrays):
    """Time signal of a fixed sensor until all repeats, after one revolution of the carrier or several.

    Parameters
    ----------
    revolution : (n_times,) array
        Revolutions of the carrier, from 0, end point excluded.
    seconds : (..., n_times) array
        Time [s].
    displacement : (..., n_times) array
        Radial displacement [m], positive outwards.
    velocity : (..., n_times) array
        Radial velocity of the fixed point [m/s].
    acceleration : (..., n_times) array
        Radial acceleration of the fixed point [m/s^2].
    """

    revolution: np.ndarray
    seconds: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def fixed_sensor_lines(field, z_ring: int, carrier_speed, sensor_angle: float) -> SensorLines:
    """Compute the lines of a fixed sensor: component (h, n) at order ``h z_ring - sign(carrier_speed) n``.

    Components that fall on the same order add with their phases; negative orders are folded to
    positive ones (the conjugate). The mesh frequency is that of a fixed ring.

    CaseError: E-SHAPE, E-TEETH, E-SPEED, E-RANGE: data of the wrong shape or not finite, a carrier that
    stands still, speeds of both directions.

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
    """
    reached = component_lines(field, z_ring, carrier_speed, sensor_angle)
    every = np.arange(_top_order(np.asarray(field), z_ring) + 1)
    return replace(reached, order=every, displacement=_spread(reached.displacement, reached.order, every.size))


def component_lines(
    field, z_ring: int, carrier_speed, sensor_angle: float, *, symmetry: int = 1, periods: int = 1
) -> SensorLines:
    """Compute the lines of `fixed_sensor_lines` at those orders alone that components reach.

    Only multiples of ``symmetry`` are kept: a set that is the same after a turn by ``2 pi/symmetry`` has no
    others. The field repeats after ``periods`` mesh periods, of which its row 1 is the first harmonic.
    """
    angle = _checked_angle(sensor_angle)
    number, n, waves = carrier_components(field, z_ring, carrier_speed, symmetry=symmetry, periods=periods)
    number, first = np.unique(number, return_index=True)
    turned_waves = waves * np.exp(1j * n * angle)
    lines = turned_waves if len(number) == len(n) else np.add.reduceat(turned_waves, first, axis=-1)
    lines = np.where(number == 0, np.real(lines), lines)
    turns, method = carrier_turns(z_ring, periods), "exact"
    order = number if turns == 1 else number / turns
    if periods > 1:
        method += f", {periods} mesh periods"
    speed = np.asarray(carrier_speed, float)
    return SensorLines(order, lines, speed, angle, int(z_ring), method, turns)


def carrier_turns(z_ring: int, periods: int) -> int:
    """Count the turns of the carrier after which a set repeats that does after so many mesh periods."""
    return periods // math.gcd(periods, z_ring)


def carrier_components(
    field, z_ring: int, carrier_speed, *, symmetry: int = 1, periods: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Order the components of a field by the frequency at which a fixed sensor hears them.

    Arguments are those of `component_lines`. Returned are, ascending, the frequencies (K,) in those of the
    carrier over `carrier_turns`, not negative, with signed nodal diameters n (K,) and amplitudes (..., K) of
    ``exp(i n phi)`` on the housing: what is heard at a negative order is its conjugate at the positive one.
    """
    field, n = _checked_field(field)
    direction, speed = _motion(field, z_ring, carrier_speed)
    turns = carrier_turns(z_ring, periods)
    signed = np.arange(field.shape[-2])[:, None] * (z_ring * turns // periods) - direction * n * turns
    kept = np.flatnonzero(signed % (symmetry * turns) == 0) if symmetry > 1 else np.arange(signed.size)
    signed, turned = signed.ravel()[kept], np.broadcast_to(n, signed.shape).ravel()[kept]
    along = np.argsort(np.abs(signed), kind="stable")
    signed, kept, turned = signed[along], kept[along], turned[along]
    waves = field.reshape(*speed.shape, -1)[..., kept]
    turned, waves = np.where(signed < 0, -turned, turned), np.where(signed < 0, np.conj(waves), waves)
    return np.abs(signed), turned, waves


def rounded_lines(lines: SensorLines, share: float) -> np.ndarray:
    """Round the lines (..., n_orders) [m] to single precision and fewer digits, so that files are smaller.

    Their accelerations change by at most a share of the largest one of their speed, smaller ones to zero: the
    sum with a large number has no room for more digits.
    """
    largest = np.abs(lines.acceleration).max(axis=-1, keepdims=True)
    weight = (lines.order * lines.base_speed[..., None]) ** 2
    big = np.divide(2.0**23 * share * largest, weight, out=np.zeros_like(weight), where=weight > 0.0)
    single, big = lines.displacement.astype(np.complex64), big.astype(np.float32)
    for part in (single.real, single.imag):
        part += big
        part -= big
    return single


def stored_lines(housing: Any, *, form: str | None = None) -> SensorLines:
    """Read the lines of a fixed sensor from housing.nc, to the highest that is heard.

    The dataset has one or some speeds, as ``results.housing.sel(speed=250, method="nearest")``. The form is
    "exact" or "linear", that of the case when left out.
    """
    attributes, order = housing.attrs, housing["order"].values
    exact = housing["lines_real"].values + 1j * housing["lines_imag"].values
    end = np.flatnonzero(exact.any(axis=tuple(range(exact.ndim - 1)))).max(initial=1) + 1
    place = float(attributes["sensor_angle"]), int(attributes["ring_teeth"])
    lines = SensorLines(
        order[:end],
        exact[..., :end],
        housing["carrier_speed"].values,
        *place,
        attributes.get("method", "exact"),
        int(attributes.get("turns", 1)),
    )
    return lines_in_form(lines, form or attributes["form"], int(attributes["points"]), round(order[-1] / place[1]))


def lines_in_form(exact: SensorLines, form: str, points: int, harmonics: int) -> SensorLines:
    """Give exact lines in the form "exact" or "linear", as `heaviside_linear_lines` up to a mesh harmonic.

    The static deflection (harmonic zero) is carried exactly all the same: its images, where the teeth of the
    ring are a multiple of the number of points, would fall on the mesh orders. Every line must be that of one
    component: less nodal diameters than half the teeth.
    """
    if form == "exact":
        return exact
    z, order, speed, angle = exact.z_ring, exact.order, exact.carrier_speed, exact.sensor_angle
    h, top = np.rint(order / z).astype(int), (harmonics + 1) * z
    n = int(np.sign(speed.flat[0])) * (h * z - order)
    n_max, moving = int(np.abs(n).max()), h > 0
    field = np.zeros((*speed.shape, h.max() + 1, 2 * n_max + 1), complex)
    field[..., h[moving], n_max + n[moving]] = (exact.displacement * np.exp(-1j * n * angle))[..., moving]
    lines = heaviside_linear_lines(field, z, speed, angle, points=points, max_order=top)
    still = _spread(np.where(moving, 0.0, exact.displacement), order, top + 1)
    return replace(lines, displacement=lines.displacement + still)


def heaviside_linear_lines(
    field, z_ring: int, carrier_speed, sensor_angle: float, *, points: int = 54, max_order: int | None = None
) -> SensorLines:
    """Compute the lines of the Heaviside/linear form over P points of the ring (paper Eqs. (13)-(16)).

    Point 0 is at angle 0 of the carrier frame. The acceleration has no natural end, see the head of this
    module: the order range is limited. P should be a multiple of the number of planets (or the points break
    the symmetry of the set) and more than twice the largest n that matters.

    CaseError: as `fixed_sensor_lines`, and E-SYMMETRY for less than 3 points, E-HARMONICS for no orders.

    Parameters
    ----------
    field, z_ring, carrier_speed, sensor_angle
        As in `fixed_sensor_lines`.
    points : int
        Number P of equidistant points on the ring.
    max_order : int, optional
        Highest carrier order, by default that of `fixed_sensor_lines`.
    """
    field, n = _checked_field(field)
    points = checked_count(points, "points", code="E-SYMMETRY", least=3)
    direction, speed = _motion(field, z_ring, carrier_speed)
    top = _top_order(field, z_ring, max_order)
    # components that the points tell apart: sums over one residue of n, phase at point 0
    sampled = np.zeros((*field.shape[:-1], points), dtype=complex)
    for residue in np.unique(n % points):
        sampled[..., residue] = field[..., n % points == residue].sum(axis=-1)
    two_sided = _interpolated_orders(sampled, z_ring, direction, top, _checked_angle(sensor_angle))
    method = f"linear, {points} points"
    lines = _folded(two_sided)
    return SensorLines(np.arange(top + 1), lines, speed, float(sensor_angle), int(z_ring), method)


def fixed_sensor_signal(lines: SensorLines) -> HousingSignal:
    """Synthesise motion and acceleration over the carrier revolutions of the lines by inverse FFT.

    There are at least four samples a period of the highest order, and a whole number of them a mesh period.
    """
    count = lines.turns * lines.z_ring * -(-4 * math.ceil(lines.order[-1]) // lines.z_ring)
    revolution = np.arange(count) / count * lines.turns
    motion = (lines.displacement, lines.velocity, lines.acceleration)
    return HousingSignal(
        revolution,
        2 * np.pi * revolution / lines.base_speed[..., None],
        *(_synthesised(values, lines.number, count) for values in motion),
    )


def hanning_model(harmonics, planet_angles, *, width: float | None = None, n_max: int = 24) -> np.ndarray:
    """Compute the carrier-frame field of the Hanning-window model, for `fixed_sensor_lines`.

    It has the shape (..., H + 1, 2 n_max + 1) and the unit of the harmonics.

    CaseError: E-SHAPE for harmonics that do not fit the planets; E-RANGE for a width out of range.

    Parameters
    ----------
    harmonics : (..., N, H + 1) complex array
        Harmonics of every planet's mesh signal in common time, such as the forces of the planet-ring meshes.
    planet_angles : (N,) array
        Angles psi_p in the carrier frame [rad].
    width : float, optional
        Angle over which a planet is heard [rad], 0 < width <= 2 pi; default 2 pi/N.
    n_max : int
        Circumferential orders kept; c_n falls like 1/n^3 (width = 2 pi: nothing beyond n = 1).
    """
    harmonics, psi = np.asarray(harmonics, dtype=complex), np.asarray(planet_angles, dtype=float)
    if harmonics.ndim < 2 or psi.shape != harmonics.shape[-2:-1] or not np.all(np.isfinite(harmonics)):
        raise CaseError(
            f"mesh harmonics of shape {harmonics.shape} do not fit {psi.size} planets",
            code="E-SHAPE",
            limit="finite values of shape (..., planets, H + 1)",
            remedy="give the harmonics of the planet-ring meshes alone",
        )
    width = 2 * np.pi / psi.size if width is None else width
    # a width rounded from degrees may exceed the circle by one bit
    if not 0 < width <= 2 * np.pi * (1 + 1e-12):
        raise CaseError(
            f"a window of {width} rad does not fit on the ring",
            code="E-RANGE",
            value=width,
            limit="0 < width <= 2 pi",
            remedy="leave it out for 2 pi divided by the number of planets",
        )
    n = np.arange(-n_max, n_max + 1)
    riding = _window_components(n, width)[:, None] * np.exp(-1j * np.outer(n, psi))
    return np.swapaxes(riding @ harmonics, -1, -2)


def _motion(field: np.ndarray, z_ring: int, carrier_speed) -> tuple[int, np.ndarray]:
    """Find the direction +1 or -1 of the carrier, and its checked speed (...) [rad/s]."""
    checked_count(z_ring, "ring teeth", code="E-TEETH")
    speed = np.asarray(carrier_speed, dtype=float)
    direction = np.unique(np.sign(speed))
    usable = speed.shape == field.shape[:-2] and np.all(np.isfinite(speed))
    if not usable or direction.size != 1 or direction[0] == 0:
        raise CaseError(
            f"carrier speeds of shape {speed.shape}, directions {direction.tolist()}, do not fit the field",
            code="E-SPEED",
            value=carrier_speed,
            limit=f"finite speeds of shape {field.shape[:-2]}, all of one direction, none zero",
            remedy="one speed for every field; split a sweep where the carrier changes direction",
        )
    return int(direction[0]), speed


def _top_order(field: np.ndarray, z_ring: int, max_order: int | None = None) -> int:
    """Choose the highest carrier order of the lines: as asked for, or that of the highest component."""
    if max_order is not None:
        return checked_count(max_order, "carrier orders", code="E-HARMONICS")
    harmonics, n_max = field.shape[-2] - 1, field.shape[-1] // 2
    return max((harmonics + 1) * z_ring, harmonics * z_ring + n_max)


def _checked_field(field) -> tuple[np.ndarray, np.ndarray]:
    """Check the field, and tell its circumferential orders n = -n_max..n_max."""
    field = np.asarray(field, dtype=complex)
    if field.ndim < 2 or field.size == 0 or field.shape[-1] % 2 == 0 or not np.all(np.isfinite(field)):
        raise CaseError(
            f"the carrier-frame field of shape {field.shape} is not usable",
            code="E-SHAPE",
            limit="finite values of shape (..., H + 1, 2 n_max + 1)",
            remedy="give one column for every n = -n_max..n_max",
        )
    n_max = field.shape[-1] // 2
    return field, np.arange(-n_max, n_max + 1)


def _checked_angle(angle: float) -> float:
    """Refuse an angle [rad] that is not finite."""
    if not np.isfinite(angle):
        raise CaseError(
            f"the angle {angle} is not a number of radians",
            code="E-RANGE",
            value=angle,
            limit="a finite angle",
            remedy="give an angle such as 0.5",
        )
    return float(angle)


def _spread(lines: np.ndarray, order: np.ndarray, count: int) -> np.ndarray:
    """Put lines (..., n_orders) at their places among the orders 0 to count - 1."""
    every = np.zeros((*lines.shape[:-1], count), dtype=complex)
    every[..., order] = lines
    return every


def _folded(two_sided: np.ndarray) -> np.ndarray:
    """Fold to single-sided amplitudes of Re sum_k c_k exp(i k x): c_k + conj(c_-k), real at order 0."""
    top = two_sided.shape[-1] // 2
    lines = two_sided[..., top:] + np.conj(two_sided[..., top::-1])
    lines[..., 0] = np.real(two_sided[..., top])
    return lines


def _interpolated_orders(sampled: np.ndarray, z_ring: int, direction: int, top: int, away: float) -> np.ndarray:
    """Collect two-sided lines -top..top of the linear interpolation: components and all their images.

    With m = direction (h z_ring - order), sin^2(pi m/P) depends on residues of h z_ring and order alone.
    """
    points, h = sampled.shape[-1], np.arange(sampled.shape[-2])
    order = np.arange(-top, top + 1)
    sampled = sampled * np.exp(1j * direction * away * z_ring * h)[:, None]
    two_sided = np.zeros((*sampled.shape[:-2], order.size), dtype=complex)
    for shift in np.unique(h * z_ring % points):
        chosen = h[h * z_ring % points == shift]
        for residue in range(points):
            place = slice((residue + top) % points, None, points)
            m = chosen[:, None] * z_ring - order[place]
            same = direction * (shift - residue) % points
            weight = np.sin(np.pi * same / points) ** 2 * (points / np.pi) ** 2 / np.where(m, m, 1) ** 2
            weight = np.where(m, weight, 1.0) if same == 0 else weight
            two_sided[..., place] += sampled[..., chosen, same] @ weight
    return two_sided * np.exp(-1j * direction * away * order)


def _synthesised(lines: np.ndarray, order: np.ndarray, samples: int) -> np.ndarray:
    """Sum Re sum_k lines[k] exp(2 pi i order[k] t), t in equal steps of one revolution."""
    spectrum = _spread(lines, order, samples // 2 + 1) * (samples / 2)
    spectrum[..., 0] *= 2
    return np.fft.irfft(spectrum, samples, axis=-1)


def _window_components(n: np.ndarray, width: float) -> np.ndarray:
    """Compute the Fourier components c_n of the window on the circle."""
    v = n * width / (2 * np.pi)
    # sinc(v)/(1 - v^2) = (sinc(v - 1) + sinc(v + 1))/2 + sinc(v): no division at |v| = 1
    return width / (4 * np.pi) * (np.sinc(v) + (np.sinc(v - 1) + np.sinc(v + 1)) / 2)
