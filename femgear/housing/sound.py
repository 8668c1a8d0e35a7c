"""Sound of the housing: lines of a sensor as signals, run-ups and sound pressure, and what is heard of them.

The housing radiates as a ring of width b and radius a in a rigid cylinder without end. Its surface moves
radially with v exp(i n phi) exp(i omega t); with k = omega/c, axial wave numbers kz, kr^2 = k^2 - kz^2 and
H_n the Hankel function of the second kind, which goes outwards in this convention of time, beside its middle

    p(r) = -i rho c k v b/(2 pi) integral sinc(kz b/2) H_n(kr r)/(kr H_n'(kr a)) dkz exp(i n phi),
    sigma = k b/(2 pi) integral sinc^2(k b sin(t)/2) sigma_n(k a cos t) dt, t from -pi/2 to pi/2,

sigma the radiation efficiency (Junger and Feit, "Sound, Structures, and Their Interaction", 2nd ed., MIT
Press 1986; Williams, "Fourier Acoustics", Academic Press 1999). Of a cylinder that moves as a whole

    p(r) = -i rho c v H_n(kr)/H_n'(ka) exp(i n phi),    sigma_n = 2/(pi ka |H_n'(ka)|^2).

Every carrier order L of a set in a circular ring carries one n = h z_ring - L. Below ka = n air flows to
and fro between neighbouring lobes: it filters side bands, so that a microphone hears others than an
accelerometer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import count, pairwise
from typing import Any, cast

import numpy as np

from femgear.curves import not_a_knot
from femgear.errors import CaseError, nvh_library
from femgear.housing.sensor import SensorLines, carrier_components, carrier_turns, stored_lines

REFERENCE_PRESSURE, REFERENCE_POWER = 20e-6, 1e-12  # 20 uPa and 1 pW (ISO 1683)
NO_AREAS = "no sound: the file of the casing has no sensor_area, the areas of surface of its sensors"
REFERENCE_ACCELERATION = 1e-6  # m/s^2 (ISO 1683)
_UNITS = {"m/s^2": (0, 1.0), "g": (0, 1 / 9.80665), "mm/s": (1, 1e3), "um": (2, 1e6), "dB": (0, None)}
"""Times that the acceleration is integrated, and units in the SI one, by unit of levels."""
LEVELS = tuple(
    f"{unit} {measure}" for unit in _UNITS for measure in ("rms", "peak") if (unit, measure) != ("dB", "peak")
)
RATE = 48e3  # samples a second of a signal
_WIDTH, _OVERSAMPLING = 14, 2
"""Of the kernel that interpolates between the samples of a turn: 1e-12 of the sum of the amplitudes."""
_BETA = 0.98 * np.pi * _WIDTH * (1 - 0.5 / _OVERSAMPLING)
_BLOCK = 2**16  # samples in memory at a time
_WAVES = 120
"""Axial wave numbers of the integral of the pressure: 1e-6 at a tenth of the width, 1e-3 at a fortieth."""
_FREQUENCIES = 240
"""Of which radiation is computed when there are more; between them it is interpolated."""


@dataclass(frozen=True)
class Cylinder:
    """Cylinder that radiates into air.

    ``radius`` and ``length`` of the surface that moves [m]; ``density`` [kg/m^3] and ``sound_speed`` [m/s] of the air.
    """

    radius: float
    length: float
    density: float = 1.204
    sound_speed: float = 343.0


@dataclass(frozen=True)
class Microphone:
    """Where sound is heard: ``distance`` from the surface of the cylinder [m], and ``angle`` on the housing [rad]."""

    distance: float
    angle: float


def nodal_diameters(lines: SensorLines) -> np.ndarray:
    """Find the signed nodal diameter n of every line, shape (n_orders,), less than half the teeth.

    CaseError: lines in the linear form, of which several nodal diameters share one (E-SHAPE).
    """
    if lines.method != "exact":
        raise CaseError(
            f"lines in the form {lines.method!r} do not tell nodal diameters apart",
            code="E-SHAPE",
            limit="lines in the exact form",
            remedy='read them by stored_lines(housing, form="exact")',
        )
    harmonic = np.rint(lines.order / lines.z_ring).astype(int)
    return int(np.sign(lines.carrier_speed.flat[0])) * (harmonic * lines.z_ring - lines.order)


def pressure_transfer(n, frequency, cylinder: Cylinder, distance: float = 0.0) -> np.ndarray:
    """Compute the sound pressure over the velocity of the surface (...) [Pa s/m], complex, of one angle.

    For nodal diameters and frequencies (...) [Hz], which broadcast, at a distance from the surface [m],
    over 0 unless the cylinder is without end. At 0 Hz there is none. Formulas: see the head of this module.
    """
    n, frequency = np.broadcast_arrays(np.abs(n), np.asarray(frequency, float))
    wave = 2 * np.pi * frequency / cylinder.sound_speed
    phase = -1j * wave * distance
    if np.isinf(cylinder.length):
        impedance, spread = -1j * cylinder.density * cylinder.sound_speed, 1 + distance / cylinder.radius
        ratios = _over_frequency(n, wave * cylinder.radius, _ratios, spread)
        return impedance * ratios * np.exp(phase)
    pressure = _over_frequency(n, wave * cylinder.radius, _ring_transfer, cylinder, distance, most=_FREQUENCIES)
    return pressure * np.exp(phase)


def _ring_transfer(ka: np.ndarray, cylinder: Cylinder, distance: float) -> Iterator[np.ndarray]:
    """Pressure over velocity times exp(i k distance) of n = 0, 1, ..., at ka = k radius, each (n_k,).

    The path of the axial wave numbers leaves the real axis for where the integrand decays as a Gaussian
    without oscillation, so that the trapezoidal rule converges exponentially.
    """
    k = ka / cylinder.radius
    width, kd = cylinder.length, k[:, None] * distance
    scale, bend = np.minimum(1, 3 / np.sqrt(kd)), np.minimum(1, 40 / (k[:, None] * width))
    last = np.arcsinh((1.5 + 30 / kd) / scale)
    step = last * (np.arange(_WAVES) + 0.5) / _WAVES
    t, slope = scale * np.sinh(step), scale * np.cosh(step) * last / _WAVES
    axial = t + 1j * bend * t / (1 + t**2)
    slope = slope * (1 + 1j * bend * (1 - t**2) / (1 + t**2) ** 2)
    radial = -1j * np.sqrt(axial**2 - 1)
    shape = np.sinc(k[:, None] * width * axial / (2 * np.pi)) * np.exp(-1j * kd * (radial - 1))
    weight = shape * slope / radial
    factor = -1j * cylinder.density * cylinder.sound_speed * width * k / np.pi
    for ratio in _ratios(k[:, None] * cylinder.radius * radial, 1 + distance / cylinder.radius):
        yield factor * (weight * ratio).sum(axis=1)


def radiation_efficiency(n, ka, slenderness: float = np.inf) -> np.ndarray:
    """Compute the radiation efficiency (...) of a ring in a cylinder: its power over that of rho c v^2.

    For nodal diameters n and numbers ka > 0 (...), which broadcast, of a ring of width over radius b/a; of
    the whole cylinder when not given. Formulas: see the head of this module.
    """
    n, ka = np.broadcast_arrays(np.abs(n), np.asarray(ka, float))
    if np.isinf(slenderness):
        return np.real(_over_frequency(n, ka, _efficiencies))
    points = 64 + int(slenderness * ka.max(initial=0.0))
    return np.real(_over_frequency(n, ka, _ring_efficiencies, slenderness, points, most=_FREQUENCIES))


def _ring_efficiencies(ka: np.ndarray, slenderness: float, points: int) -> Iterator[np.ndarray]:
    """Radiation efficiency of a ring of width over radius for n = 0, 1, ..., by so many directions."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    angle, weights = np.pi / 4 * (1 + nodes), np.pi / 2 * weights
    width = ka[:, None] * slenderness
    share = width / (2 * np.pi) * np.sinc(width * np.sin(angle) / (2 * np.pi)) ** 2 * weights
    return ((share * efficiency).sum(axis=1) for efficiency in _efficiencies(ka[:, None] * np.cos(angle)))


def _over_frequency(n: np.ndarray, x: np.ndarray, computed, *given, most: float = np.inf) -> np.ndarray:
    """Values of orders n at x = ka of ``computed(x, *given)``, which yields n = 0, 1, ...; none at x = 0.

    At more than ``most`` x splines of the logarithm go through the values at as many, which are kept.
    """
    values, moving = np.zeros(x.shape, complex), x > 0
    n, x = n[moving], x[moving]
    if not len(x):
        return values
    interpolated, orders = np.zeros(len(x), complex), int(n.max()) + 1
    if len(x) > most:
        nodes, logarithms = _logarithms(float(x.min()), float(x.max()), int(most), orders, computed, *given)
        for m in np.unique(n):
            interpolated[n == m] = np.exp(not_a_knot(np.log(nodes), logarithms[m], np.log(x[n == m])))
    else:
        nodes, places = np.unique(x, return_inverse=True)
        for m, row in zip(range(orders), computed(nodes, *given)):
            interpolated[n == m] = row[places[n == m]]
    values[moving] = interpolated
    return values


@lru_cache(maxsize=8)
def _logarithms(
    first: float, last: float, places: int, orders: int, computed, *given
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Places x = ka from first to last, and there the logarithms of the values of n = 0, 1, ..., (places,).

    Variants of a set at the same speeds have the same places.
    """
    # even in the logarithm at low frequency, where powers rule, and in x where waves interfere
    fine = np.geomspace(first, last, 20 * places)
    scale = np.log(fine) + fine / 4
    nodes = np.interp(np.linspace(scale[0], scale[-1], places), scale, fine)
    rows = [row for _, row in zip(range(orders), computed(nodes, *given))]
    sizes = [np.log(np.maximum(np.abs(row), 1e-300)) for row in rows]
    return nodes, [size + 1j * np.unwrap(np.angle(row)) for size, row in zip(sizes, rows)]


def _ratios(x: np.ndarray, spread: float) -> Iterator[np.ndarray]:
    """H_n(x spread)/H_n'(x) exp(i (spread - 1) x) of n = 0, 1, ..., x in the lower half plane or real."""
    for n, (far, near) in enumerate(zip(_hankel(x * spread), _hankel(x))):
        with np.errstate(invalid="ignore", over="ignore"):
            ratio = far[0] / near[1]
        if not (finite := np.isfinite(ratio)).all():
            # where Hankel functions exceed the largest number, the limit of low frequencies is exact
            with np.errstate(invalid="ignore", over="ignore"):
                limit = -x / max(n, 1) * spread ** -float(n) * np.exp(1j * (spread - 1) * x)
            ratio = np.where(finite, ratio, limit)
        yield ratio


def _efficiencies(ka: np.ndarray) -> Iterator[np.ndarray]:
    """Radiation efficiency of an endless cylinder for n = 0, 1, ...; nothing beyond the largest number."""
    for _, slope in _hankel(ka):
        with np.errstate(invalid="ignore", over="ignore"):
            square = np.abs(slope) ** 2
        yield np.where(np.isfinite(square), 2 / (np.pi * ka * square), 0.0)


def _hankel(x: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Hankel functions of the second kind and their slopes, times exp(ix), for n = 0, 1, ..., stably."""
    from scipy.special import hankel2e

    before, here = hankel2e(0, x), hankel2e(1, x)
    yield before, -here
    for n in count(1):
        with np.errstate(invalid="ignore", over="ignore"):
            share = n / x * here
            yield here, before - share
            before, here = here, 2 * share - before


def sound_pressure(lines: SensorLines, cylinder: Cylinder, microphone: Microphone) -> np.ndarray:
    """Compute the lines of the sound pressure at a microphone [Pa], complex, (..., n_orders), peak values.

    CaseError: as `nodal_diameters`.
    """
    n = nodal_diameters(lines)
    turned = np.exp(1j * n * (microphone.angle - lines.sensor_angle)) * _velocity(lines)
    return pressure_transfer(n, lines.frequency, cylinder, microphone.distance) * turned


def sound_power(lines: SensorLines, cylinder: Cylinder, *, equivalent: bool = False) -> np.ndarray:
    """Compute the sound power of every line [W], shape (..., n_orders): rho c S sigma |v|^2/2.

    With ``equivalent`` that of the radiation efficiency one: the equivalent radiated power (ERP), rho c/2
    times the integral of |v|^2 over the surface S = 2 pi a b. CaseError: as `nodal_diameters`.
    """
    n, speed = nodal_diameters(lines), cylinder.sound_speed
    surface = 2 * np.pi * cylinder.radius * cylinder.length
    power = 0.5 * cylinder.density * speed * surface * np.abs(_velocity(lines)) ** 2
    if equivalent:
        return power
    ka = 2 * np.pi * cylinder.radius / speed * lines.frequency
    return power * radiation_efficiency(n, ka, cylinder.length / cylinder.radius)


def surface_sound(
    waves, n, frequency, cylinder: Cylinder, microphone: Microphone
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the sound of a surface of which every line has waves of many nodal diameters.

    Of radial velocities (..., n_orders, n_waves) [m/s] of exp(i n phi), n (n_waves,), at frequencies
    (..., n_orders) [Hz]: lines of the pressure at the microphone [Pa], power, and that of the radiation
    efficiency one [W], all (..., n_orders). Waves of different n radiate independently.
    """
    waves, frequency = np.asarray(waves), np.asarray(frequency, float)[..., None]
    transfer = pressure_transfer(n, frequency, cylinder, microphone.distance) * np.exp(1j * n * microphone.angle)
    around, speed = 2 * np.pi * cylinder.radius, cylinder.sound_speed
    power = 0.5 * cylinder.density * speed * around * cylinder.length * np.abs(waves) ** 2
    efficiency = radiation_efficiency(n, around / speed * frequency, cylinder.length / cylinder.radius)
    return (transfer * waves).sum(axis=-1), (efficiency * power).sum(axis=-1), power.sum(axis=-1)


def equivalent_sound(
    velocity, area, density: float, sound_speed: float, distance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Estimate the sound of a surface from above: every part of it radiates as a large plane one.

    Of velocities (..., n_orders, n_parts) [m/s] across parts of areas (n_parts,) [m^2], in air [kg/m^3],
    [m/s]: lines of the pressure [Pa] at a distance [m] in a free field, (..., n_orders), and their power [W],
    the equivalent radiated power ``rho c/2 sum |v|^2 S`` of the radiation efficiency one. It spreads evenly,
    ``|p|^2 = rho c W/(2 pi r^2)``; the phase is that of the acceleration of the volume, as of a small body.
    Below coincidence, or of parts that move against each other within a wavelength, less is radiated
    (F. Fahy and P. Gardonio, Sound and Structural Vibration, 2nd ed., Academic Press 2007, ch. 3).
    """
    velocity, area = np.asarray(velocity), np.asarray(area, float)
    power = 0.5 * density * sound_speed * np.abs(velocity) ** 2 @ area
    phase = np.exp(1j * (np.angle(velocity @ area) + 0.5 * np.pi))
    return np.sqrt(density * sound_speed * power / (2 * np.pi)) / distance * phase, power


def component_sound(
    field, z_ring: int, carrier_speed, cylinder: Cylinder, microphone: Microphone, *, periods: int
) -> tuple[np.ndarray, ...]:
    """Compute the sound of a field that repeats after several mesh periods, at the orders of its lines.

    Arguments as of `femgear.housing.sensor.component_lines`; the three results (..., n_orders) are those of
    `surface_sound`, of lines to which several components add.
    """
    number, n, waves = carrier_components(field, z_ring, carrier_speed, periods=periods)
    # of the static field two components are one wave
    (number, n), place = np.unique(np.stack([number, n]), axis=1, return_inverse=True)
    along = np.argsort(place, kind="stable")
    waves = np.add.reduceat(waves[..., along], np.searchsorted(place[along], np.arange(len(n))), axis=-1)
    base = np.abs(np.asarray(carrier_speed, float))[..., None] / (2 * np.pi * carrier_turns(z_ring, periods))
    velocity = 2j * np.pi * number * base * waves
    parts = surface_sound(velocity[..., None], n[:, None], number * base, cylinder, microphone)
    lines = np.unique(number, return_index=True)[1]
    return tuple(np.add.reduceat(part, lines, axis=-1) for part in parts)


def _velocity(lines: SensorLines) -> np.ndarray:
    """Radial velocity of the surface at the sensor [m/s], complex, (..., n_orders)."""
    return 1j * lines.order * lines.base_speed[..., None] * lines.displacement


def levels_of(acceleration, frequency, form: str) -> np.ndarray:
    """Convert peak amplitudes of lines of the acceleration (..., n) [m/s^2] to levels of a form of `LEVELS`.

    Frequencies (..., n) in Hz, above zero. The last column is the level of all lines: the root of the sum of
    their squares, of which the peak is sqrt(2) r.m.s.
    """
    (integrated, scale), (_, detector) = _UNITS[form.split()[0]], form.split()
    rms = np.abs(acceleration) * np.sqrt(0.5) / (2 * np.pi * np.asarray(frequency)) ** integrated
    rms = np.concatenate([rms, np.linalg.norm(rms, axis=-1, keepdims=True)], axis=-1)
    if scale is None:
        return _decibels(rms**2, REFERENCE_ACCELERATION**2)
    return rms * scale * (np.sqrt(2) if detector == "peak" else 1.0)


def a_weighting(frequency) -> np.ndarray:
    """Compute the factor (...) of A-weighting by which amplitudes at frequencies (...) [Hz] count, 1 at 1 kHz.

    Source: IEC 61672-1:2013, annex E, whose four frequencies are rounded to those of its design goal.
    """
    square = np.asarray(frequency, float) ** 2
    low, high = 20.598997**2, 12194.217**2
    middle = np.sqrt((square + 107.65265**2) * (square + 737.86223**2))
    return 10 ** (1.9997 / 20) * high * square**2 / ((square + low) * middle * (square + high))


def pressure_level(pressure, frequency) -> np.ndarray:
    """Compute A-weighted sound pressure levels (...) [dB re 20 uPa] of lines (..., n_orders) [Pa, peak].

    The lines are at ``frequency`` (..., n_orders) [Hz].
    """
    weighted = np.abs(pressure) * a_weighting(frequency)
    return _decibels((weighted**2).sum(axis=-1) / 2, REFERENCE_PRESSURE**2)


def acceleration_level(acceleration, frequency) -> np.ndarray:
    """Compute A-weighted levels (...) [dB re 1 um/s^2] of lines (..., n_orders) of the acceleration [m/s^2, peak].

    The lines are at ``frequency`` (..., n_orders) [Hz].
    """
    weighted = np.abs(acceleration) * a_weighting(frequency)
    return _decibels((weighted**2).sum(axis=-1) / 2, REFERENCE_ACCELERATION**2)


def power_level(power, frequency) -> np.ndarray:
    """Compute A-weighted sound power levels (...) [dB re 1 pW] of the power of lines (..., n_orders) [W].

    The lines are at ``frequency`` (..., n_orders) [Hz].
    """
    return _decibels((power * a_weighting(frequency) ** 2).sum(axis=-1), REFERENCE_POWER)


def _decibels(power: np.ndarray, reference: float) -> np.ndarray:
    """Level of a power; silence is minus infinity."""
    with np.errstate(divide="ignore"):
        return 10 * np.log10(power / reference)


def stored_sound(housing: Any) -> tuple[SensorLines, np.ndarray]:
    """Read the exact lines of the sensor from housing.nc, and compute those of the microphone, (..., lines) [Pa].

    CaseError: a casing of a file that does not tell the areas of its surface (E-CHOICE).
    """
    if "pressure_level" not in housing:
        limit = "a ring, also on supports, or a casing of arrays with sensor_area"
        raise CaseError(NO_AREAS, code="E-CHOICE", key="housing.structure", limit=limit)
    lines = stored_lines(housing, form="exact")
    if "pressure_real" in housing:
        pressure = housing["pressure_real"].values + 1j * housing["pressure_imag"].values
        return lines, pressure[..., : len(lines.order)]
    return lines, microphone_lines(lines, housing.attrs)


def microphone_lines(lines: SensorLines, attributes: Mapping[str, Any]) -> np.ndarray:
    """Compute the lines (..., lines) of the pressure [Pa] by the attributes of housing.nc, as `sound_pressure`."""
    air = attributes["air_density"], attributes["sound_speed"]
    cylinder = Cylinder(attributes["outer_radius"], attributes["face_width"], *air)
    microphone = Microphone(attributes["microphone_distance"], attributes["microphone_angle"])
    return sound_pressure(lines, cylinder, microphone)


def whole_turns(speed: float, duration: float, *, rate: float = RATE) -> int:
    """Count the samples of as many whole turns as come nearest to a duration.

    Parameters
    ----------
    speed : float
        Of what turns [rad/s], positive.
    duration : float
        Wanted length [s]; it is one turn at least.
    rate : float
        Samples a second [Hz].
    """
    turn = 2 * np.pi / speed
    return round(max(round(duration / turn), 1) * turn * rate)


def sampled_signal(order, values, speed: float, *, samples: int, rate: float = RATE) -> np.ndarray:
    """Sample a signal ``Re sum_k values[k] exp(i order[k] speed t)`` at a constant rate from t = 0, (samples,).

    Every line has its own frequency to rounding, whatever the rate; lines at half the rate and above, which no
    such signal has, are left out.

    Parameters
    ----------
    order : (n_orders,) array
        Over the turns of what turns, the carrier or a shaft; not negative.
    values : (n_orders,) complex array
        Amplitudes in the unit of the signal.
    speed : float
        Of what turns [rad/s], positive.
    samples : int
        Number of samples.
    rate : float
        Samples a second [Hz].

    Raises
    ------
    CaseError
        As `run_up_signal`.
    """
    order, values, nodes = _checked_lines(order, np.asarray(values)[None], np.atleast_1d(speed), rate)
    turns = np.arange(samples) * (nodes[0] / (2 * np.pi * rate))
    return _values_after(order, _heard(order, values, nodes, rate), turns)[0]


def run_up_signal(order, values, speeds, *, duration: float, start=None, stop=None, rate: float = RATE) -> np.ndarray:
    """Sample the signal of a carrier or shaft whose speed rises or falls linearly with time, (n_samples,).

    Its angle is the integral of its speed, start t + (stop - start) t^2/(2 duration), exactly,
    so that the phase of no line jumps. Complex lines, those of steady motion, are interpolated linearly
    between speeds; lines that reach half the rate before the next speed fade out before the one they have.

    Parameters
    ----------
    order : (n_orders,) array
        Over the turns of what turns, not negative.
    values : (n_speeds, n_orders) complex array
        Amplitudes in the unit of the signal.
    speeds : (n_speeds,) array
        Of what turns [rad/s], positive, ascending.
    duration, rate : float
        Of the signal [s], and samples a second [Hz].
    start, stop : float, optional
        Speed at its beginning and end [rad/s], within the speeds; default: the first and the last.

    Raises
    ------
    CaseError
        ``E-SHAPE``: lines, orders and speeds do not belong together. ``E-RANGE``: speeds that the lines do
        not cover, a rate or a duration that is none.
    """
    order, values, nodes = _checked_lines(order, values, speeds, rate)
    ends = np.array([nodes[0] if start is None else start, nodes[-1] if stop is None else stop], float)
    inside = len(nodes) > 1 and nodes[0] <= ends.min() and ends.max() <= nodes[-1]
    if not (inside and 0 < duration < np.inf):
        raise CaseError(
            f"no run from {ends[0]} to {ends[1]} rad/s in {duration} s",
            code="E-RANGE",
            limit=f"two speeds or more, {nodes[0]} to {nodes[-1]} rad/s, a duration above zero",
            remedy="compute the lines at the first and the last speed of the run, too",
        )
    audible, count = _heard(order, values, nodes, rate), int(np.ceil(duration * rate * (1 - 1e-15)))
    slope, times, pressure = (ends[1] - ends[0]) / duration, np.arange(count) / rate, np.empty(count)
    speed, turns = ends[0] + slope * times, (ends[0] + 0.5 * slope * times) * times / (2 * np.pi)
    place = np.clip(np.searchsorted(nodes, speed, side="right") - 1, 0, len(nodes) - 2)
    # between them the speed passes none of those of the lines
    for first, last in pairwise(np.flatnonzero(np.diff(place, prepend=-1, append=-1)).tolist()):
        low, samples = int(place[first]), slice(first, last)
        below, above = _values_after(order, audible[low : low + 2], turns[samples])
        share = (speed[samples] - nodes[low]) / (nodes[low + 1] - nodes[low])
        pressure[samples] = below + share * (above - below)
    return pressure


def _checked_lines(order, values, speeds, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Check orders (n_orders,), lines (n_speeds, n_orders) and speeds (n_speeds,) [rad/s] of a signal."""
    order, values, speeds = np.asarray(order), np.asarray(values, complex), np.asarray(speeds, float)
    fits = order.ndim == speeds.ndim == 1 and values.shape == (speeds.size, order.size) and values.size > 0
    if not fits or not np.isfinite(values).all() or not (np.isfinite(order) & (order >= 0)).all():
        raise CaseError(
            f"lines of shape {values.shape} at {order.size} orders and {speeds.size} speeds make no signal",
            code="E-SHAPE",
            remedy="give the lines of one sensor",
            limit="finite lines of shape (speeds, orders); orders that are not negative",
        )
    rising = speeds[0] > 0 and (np.diff(speeds) > 0).all() and speeds[-1] < np.inf
    if not (rising and 0 < rate < np.inf):
        raise CaseError(
            f"speeds of {speeds[:3].tolist()} rad/s .. and a rate of {rate} Hz make no signal",
            code="E-RANGE",
            remedy="sort the speeds, take them positive",
            limit="ascending speeds above zero, a rate above zero",
        )
    return order, values, speeds


def _heard(order: np.ndarray, values: np.ndarray, speeds: np.ndarray, rate: float) -> np.ndarray:
    """Lines (n_speeds, n_orders) without those that reach half the rate up to the next speed."""
    return np.where(np.outer(np.append(speeds[1:], speeds[-1]), order) < np.pi * rate, values, 0.0)


def _values_after(order: np.ndarray, values: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Values (n, n_places) of Re sum_k values[k] exp(2 pi i order[k] x) after numbers of turns (n_places,)."""
    whole = np.rint(order).astype(int)
    if (whole == order).all():
        return _between(_turn(whole, values), turns)
    used = values.any(axis=0)
    order, values, sampled = order[used], values[:, used], np.zeros((len(values), len(turns)))
    for begin in range(0, len(turns), _BLOCK):
        samples = slice(begin, begin + _BLOCK)
        start, size = float(turns[samples].min()), 2.0 * _OVERSAMPLING * float(max(order.max(initial=0.0), _WIDTH))
        count = int((float(turns[samples].max()) - start) * size) + 2 * _WIDTH + 2
        grid = _uniform(order, values / _kernel_transform(order, size), start - _WIDTH / size, 1.0 / size, count)
        sampled[:, samples] = _interpolated(grid, (turns[samples] - start) * size + _WIDTH)
    return sampled


def _uniform(order: np.ndarray, values: np.ndarray, start: float, step: float, count: int) -> np.ndarray:
    """Values (n, count) of Re sum_k values[k] exp(2 pi i order[k] x) at equal steps of x, as product of matrices."""
    width = int(np.ceil(np.sqrt(count)))
    first = np.exp(2j * np.pi * (np.outer(start + width * step * np.arange(-(-count // width)), order) % 1.0))
    beside = np.exp(2j * np.pi * np.outer(order, step * np.arange(width)))
    parts = np.concatenate([np.real(beside), -np.imag(beside)])
    rows = (np.concatenate([np.real(first * line), np.imag(first * line)], axis=1) @ parts for line in values)
    return np.array([row.ravel()[:count] for row in rows])


def _kernel_transform(order: np.ndarray, size: float) -> np.ndarray:
    """Transform of the kernel of `_interpolated` at some orders, on a grid of so many points a turn."""
    root = np.sqrt(_BETA**2 - (np.pi * _WIDTH * order / size) ** 2)
    return np.sinh(root) / root * _WIDTH


def _turn(order: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Samples (n, M) over a turn from which `_between` computes Re sum_k values[k] exp(2 pi i order[k] x).

    A nonuniform fast Fourier transform of the second type with the Kaiser-Bessel kernel: Potts, Steidl and
    Tasche, "Fast Fourier transforms for nonequispaced data: a tutorial", in Modern Sampling Theory (2001).
    The grid is twice as fine as the highest order needs, lines are divided by the transform of the kernel.
    """
    from scipy.fft import next_fast_len

    used = values.any(axis=0)
    order, values = order[used], values[:, used]
    top = int(order.max(initial=_WIDTH))
    size = cast("int", next_fast_len(_OVERSAMPLING * (2 * top + 2), real=True))
    spectrum = np.zeros((len(values), size // 2 + 1), complex)
    np.add.at(spectrum.T, order, (values * (0.5 * size / _kernel_transform(order, size))).T)
    spectrum[:, 0] *= 2
    return np.fft.irfft(spectrum, size, axis=-1)


def _between(grid: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Values (n, n_places) between the samples (n, M) of `_turn` after any number of turns (n_places,)."""
    periodic = np.pad(grid, ((0, 0), (_WIDTH, _WIDTH)), mode="wrap")
    return _interpolated(periodic, (turns % 1.0) * grid.shape[-1] + _WIDTH)


def _interpolated(grid: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values (n, n_places) between samples (n, M) at places (n_places,) from 0 to M - 1, `_WIDTH` from both ends."""
    from scipy.special import i0

    interpolated = np.zeros((len(grid), len(places)))
    for begin in range(0, len(places), _BLOCK):
        samples = slice(begin, begin + _BLOCK)
        place = places[samples]
        first = np.ceil(place - _WIDTH / 2).astype(int)
        for m in range(_WIDTH):
            kernel = i0(_BETA * np.sqrt(np.maximum(1 - (2 / _WIDTH * (place - first - m)) ** 2, 0.0)))
            interpolated[:, samples] += kernel * grid[:, first + m]
    return interpolated


@dataclass(frozen=True)
class SoundQuality:
    """How a stationary sound is heard: loudness by ISO 532-1 in a free field, tones by ECMA-418-1.

    ``loudness`` [sone]; ``tone_to_noise`` and ``prominence``, the total tone-to-noise and prominence ratios [dB], nan
    without a tone; ``tones`` (n,) are the frequencies of the tones [Hz].
    """

    loudness: float
    tone_to_noise: float
    prominence: float
    tones: np.ndarray


def sound_quality(pressure: np.ndarray, rate: float = RATE) -> SoundQuality:
    """Compute loudness, tone-to-noise ratio and prominence of a signal (n_samples,) of the pressure [Pa].

    By mosqito, of the extra ``nvh``. FemgearError: E-LIBRARY, it is not installed; E-RANGE, less than 48 kHz.
    """
    if not rate >= RATE:
        message, limit = "loudness needs all that is heard", "48 kHz or more"
        raise CaseError(message, code="E-RANGE", key="rate", value=rate, limit=limit, remedy="raise the rate")
    with nvh_library("loudness and tones"):
        from mosqito import loudness_zwst, pr_ecma_st, tnr_ecma_st
    loudness = float(loudness_zwst(pressure, rate, field_type="free")[0])
    results = [method(pressure, rate, prominence=False) for method in (tnr_ecma_st, pr_ecma_st)]
    # the library gives 0 dB where it finds no tone
    noise, ratio = (float(np.max(result[0])) if np.size(result[3]) else np.nan for result in results)
    return SoundQuality(loudness, noise, ratio, np.asarray(results[0][3], float))
