"""Sound of the housing: lines of a sensor as signals, run-ups and sound pressure, and what is heard of them.

The ring radiates as an infinite cylinder of radius a. Its surface moves radially with v exp(i n phi) exp(i
omega t); with k = omega/c, and H_n the Hankel function of the second kind, which goes outwards in this
convention of time,

    p(r) = -i rho c v H_n(kr)/H_n'(ka) exp(i n phi),    sigma_n = 2/(pi ka |H_n'(ka)|^2),

sigma_n the radiation efficiency (Junger and Feit, "Sound, Structures, and Their Interaction", 2nd ed., MIT
Press 1986; Fahy and Gardonio, "Sound and Structural Vibration", 2nd ed., Academic Press 2007). Every carrier
order L of a set in a circular ring carries one n = h z_ring - L. Below ka = n air flows to and fro between
neighbouring lobes: it filters side bands, so that a microphone hears others than an accelerometer. A ring of
width b, small against the wavelength, makes about b/sqrt(wavelength r) of this pressure, whatever n.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, cast

import numpy as np

from femgear.errors import CaseError, nvh_library
from femgear.housing.sensor import SensorLines, stored_lines

REFERENCE_PRESSURE, REFERENCE_POWER = 20e-6, 1e-12  # 20 uPa and 1 pW (ISO 1683)
RATE = 48e3  # samples a second of a signal
_WIDTH, _OVERSAMPLING = 14, 2
"""Of the kernel that interpolates between the samples of a turn: 1e-12 of the sum of the amplitudes."""
_BETA = 0.98 * np.pi * _WIDTH * (1 - 0.5 / _OVERSAMPLING)
_BLOCK = 2**16  # samples in memory at a time


@dataclass(frozen=True)
class Cylinder:
    """What radiates: radius and, for the power alone, length [m]; density [kg/m^3], speed [m/s] of air."""

    radius: float
    length: float
    density: float = 1.204
    sound_speed: float = 343.0


@dataclass(frozen=True)
class Microphone:
    """Where sound is heard: distance from the surface of the cylinder [m], and angle on the housing [rad]."""

    distance: float
    angle: float


def nodal_diameters(lines: SensorLines) -> np.ndarray:
    """Find the signed nodal diameter n of every line, shape (n_orders,), less than half the teeth.

    CaseError: lines in the linear form, of which several nodal diameters share one (E-SHAPE).
    """
    if lines.method != "exact":
        raise CaseError(
            f"lines in the form {lines.method!r} do not tell nodal diameters apart", code="E-SHAPE",
            limit="lines in the exact form", remedy='read them by stored_lines(housing, form="exact")',
        )  # fmt: skip
    harmonic = np.rint(lines.order / lines.z_ring).astype(int)
    return int(np.sign(lines.carrier_speed.flat[0])) * (harmonic * lines.z_ring - lines.order)


def pressure_transfer(n, frequency, cylinder: Cylinder, distance: float = 0.0) -> np.ndarray:
    """Compute the sound pressure over the velocity of the surface [Pa s/m], complex, of one angle.

    For nodal diameters and frequencies [Hz] of shapes that broadcast, at a distance from the surface [m]. At
    0 Hz there is none. Formula: see the head of this module.
    """
    n, frequency = np.broadcast_arrays(np.abs(n), np.asarray(frequency, float))
    ka, spread = (
        2 * np.pi * frequency * cylinder.radius / cylinder.sound_speed,
        1 + distance / cylinder.radius,
    )
    moving = np.where(ka > 0, ka, 1.0)
    with np.errstate(invalid="ignore", over="ignore"):
        ratio = _hankel(n, moving * spread)[0] / _hankel(n, moving)[1]
    # where Hankel functions exceed the largest number, the limit of low frequencies is exact
    near = -moving / np.maximum(n, 1) * spread ** -n.astype(float)
    ratio = np.where(np.isfinite(ratio), ratio, near)
    return np.where(ka > 0, -1j * cylinder.density * cylinder.sound_speed * ratio, 0.0)


def radiation_efficiency(n, ka) -> np.ndarray:
    """Compute the radiation efficiency sigma_n of a cylinder: its power over that of rho c v^2.

    For nodal diameters n and numbers ka > 0 of shapes that broadcast. Formula: see the head of this module.
    """
    n, ka = np.broadcast_arrays(np.abs(n), np.asarray(ka, float))
    with np.errstate(invalid="ignore", over="ignore"):
        slope = np.abs(_hankel(n, ka)[1])
        # nothing beyond the largest number
        return np.where(np.isfinite(slope), 2 / (np.pi * ka * slope**2), 0.0)


def _hankel(n: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Hankel functions H_n(x) of the second kind and their slopes: upwards in n, which is stable for them."""
    from scipy.special import j0, j1, y0, y1

    before, here = j0(x) - 1j * y0(x), j1(x) - 1j * y1(x)
    value, slope = before, -here
    for m in range(1, int(n.max(initial=0)) + 1):
        value, slope = np.where(n == m, (here, before - m / x * here), (value, slope))
        before, here = here, 2 * m / x * here - before
    return value, slope


def sound_pressure(lines: SensorLines, cylinder: Cylinder, microphone: Microphone) -> np.ndarray:
    """Compute the lines of the sound pressure at a microphone [Pa], complex, (..., n_orders), peak values.

    CaseError: as `nodal_diameters`.
    """
    n = nodal_diameters(lines)
    turned = np.exp(1j * n * (microphone.angle - lines.sensor_angle)) * _velocity(lines)
    return pressure_transfer(n, lines.frequency, cylinder, microphone.distance) * turned


def sound_power(lines: SensorLines, cylinder: Cylinder, *, equivalent: bool = False) -> np.ndarray:
    """Compute the sound power of every line [W], shape (..., n_orders): rho c S sigma_n |v|^2/2.

    With ``equivalent`` that of the radiation efficiency one: the equivalent radiated power (ERP), rho c/2
    times the integral of |v|^2 over the surface S = 2 pi a l. CaseError: as `nodal_diameters`.
    """
    n, speed = nodal_diameters(lines), cylinder.sound_speed
    surface = 2 * np.pi * cylinder.radius * cylinder.length
    power = 0.5 * cylinder.density * speed * surface * np.abs(_velocity(lines)) ** 2
    if equivalent:
        return power
    ka = 2 * np.pi * cylinder.radius / speed * lines.frequency
    return power * np.where(ka > 0, radiation_efficiency(n, np.where(ka > 0, ka, 1.0)), 0.0)


def _velocity(lines: SensorLines) -> np.ndarray:
    """Radial velocity of the surface at the sensor [m/s], complex, (..., n_orders)."""
    return 1j * lines.order * lines.base_speed[..., None] * lines.displacement


def a_weighting(frequency) -> np.ndarray:
    """Compute the factor of A-weighting by which amplitudes at frequencies [Hz] count, 1 at 1 kHz.

    Source: IEC 61672-1:2013, annex E, whose four frequencies are rounded to those of its design goal.
    """
    square = np.asarray(frequency, float) ** 2
    low, high = 20.598997**2, 12194.217**2
    middle = np.sqrt((square + 107.65265**2) * (square + 737.86223**2))
    return 10 ** (1.9997 / 20) * high * square**2 / ((square + low) * middle * (square + high))


def pressure_level(pressure, frequency) -> np.ndarray:
    """Compute the A-weighted sound pressure level [dB re 20 uPa] of lines (..., n_orders) [Pa, peak]."""
    weighted = np.abs(pressure) * a_weighting(frequency)
    return _decibels((weighted**2).sum(axis=-1) / 2, REFERENCE_PRESSURE**2)


def power_level(power, frequency) -> np.ndarray:
    """Compute the A-weighted sound power level [dB re 1 pW] of the power of lines (..., n_orders) [W]."""
    return _decibels((power * a_weighting(frequency) ** 2).sum(axis=-1), REFERENCE_POWER)


def _decibels(power: np.ndarray, reference: float) -> np.ndarray:
    """Level of a power; silence is minus infinity."""
    with np.errstate(divide="ignore"):
        return 10 * np.log10(power / reference)


def stored_sound(housing: Any) -> tuple[SensorLines, np.ndarray]:
    """Read the exact lines of the sensor from housing.nc, and compute those of the microphone [Pa]."""
    lines = stored_lines(housing, form="exact")
    return lines, microphone_lines(lines, housing.attrs)


def microphone_lines(lines: SensorLines, known: Mapping[str, Any]) -> np.ndarray:
    """Compute the lines of the sound pressure [Pa] by the attributes of housing.nc, as `sound_pressure`."""
    air = known["air_density"], known["sound_speed"]
    cylinder = Cylinder(known["outer_radius"], known["face_width"], *air)
    microphone = Microphone(known["microphone_distance"], known["microphone_angle"])
    return sound_pressure(lines, cylinder, microphone)


def whole_turns(speed: float, duration: float, *, rate: float = RATE) -> int:
    """Count the samples of as many whole turns at a speed [rad/s] as come nearest to a duration [s]."""
    turn = 2 * np.pi / speed
    return round(max(round(duration / turn), 1) * turn * rate)


def sampled_signal(order, values, speed: float, *, samples: int, rate: float = RATE) -> np.ndarray:
    """Sample a signal Re sum_k values[k] exp(i order[k] speed t) at a constant rate from t = 0, (samples,).

    Of whole carrier orders and complex amplitudes (n_orders,) in the unit of the signal; speed of the carrier
    in rad/s, positive, rate in Hz. Every line has its own frequency to rounding, whatever the rate; lines at
    half the rate and above, which no such signal has, are left out. CaseError: as `run_up_signal`.
    """
    order, values, nodes = _checked_lines(order, np.asarray(values)[None], np.atleast_1d(speed), rate)
    turns = np.arange(samples) * (nodes[0] / (2 * np.pi * rate))
    return _between(_turn(order, _heard(order, values, nodes, rate)), turns)[0]


def run_up_signal(
    order, values, speeds, *, duration: float, start=None, stop=None, rate: float = RATE
) -> np.ndarray:
    """Sample the signal of a carrier whose speed rises or falls linearly with time, (n_samples,).

    The angle of the carrier is the integral of its speed, start t + (stop - start) t^2/(2 duration), exactly,
    so that the phase of no line jumps. Complex lines, those of steady motion, are interpolated linearly
    between speeds; lines that reach half the rate before the next speed fade out before the one they have.

    Parameters
    ----------
    order : (n_orders,) array
        Carrier orders, whole and not negative.
    values : (n_speeds, n_orders) complex array
        Amplitudes in the unit of the signal.
    speeds : (n_speeds,) array
        Of the carrier [rad/s], positive, ascending.
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
            f"no run from {ends[0]} to {ends[1]} rad/s in {duration} s", code="E-RANGE",
            limit=f"two speeds or more, {nodes[0]} to {nodes[-1]} rad/s, a duration above zero",
            remedy="compute the lines at the first and the last speed of the run, too",
        )  # fmt: skip
    heard, count = _heard(order, values, nodes, rate), int(np.ceil(duration * rate * (1 - 1e-15)))
    slope, times, found = (ends[1] - ends[0]) / duration, np.arange(count) / rate, np.empty(count)
    speed, turns = ends[0] + slope * times, (ends[0] + 0.5 * slope * times) * times / (2 * np.pi)
    place = np.clip(np.searchsorted(nodes, speed, side="right") - 1, 0, len(nodes) - 2)
    # between them the speed passes none of those of the lines
    for first, last in pairwise(np.flatnonzero(np.diff(place, prepend=-1, append=-1)).tolist()):
        low, some = int(place[first]), slice(first, last)
        below, above = _between(_turn(order, heard[low : low + 2]), turns[some])
        share = (speed[some] - nodes[low]) / (nodes[low + 1] - nodes[low])
        found[some] = below + share * (above - below)
    return found


def _checked_lines(order, values, speeds, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Check orders (n_orders,), lines (n_speeds, n_orders) and speeds (n_speeds,) [rad/s] of a signal."""
    order, values, speeds = np.asarray(order), np.asarray(values, complex), np.asarray(speeds, float)
    whole = np.rint(order).astype(int)
    fits = order.ndim == speeds.ndim == 1 and values.shape == (speeds.size, order.size) and values.size > 0
    if not fits or not np.isfinite(values).all() or (whole != order).any() or (whole < 0).any():
        raise CaseError(
            f"lines of shape {values.shape} at {order.size} orders and {speeds.size} speeds make no signal",
            code="E-SHAPE", remedy="give the lines of one sensor",
            limit="finite lines of shape (speeds, orders); orders that are whole and not negative",
        )  # fmt: skip
    rising = speeds[0] > 0 and (np.diff(speeds) > 0).all() and speeds[-1] < np.inf
    if not (rising and 0 < rate < np.inf):
        raise CaseError(
            f"speeds of {speeds[:3].tolist()} rad/s .. and a rate of {rate} Hz make no signal",
            code="E-RANGE", remedy="sort the speeds, take them positive",
            limit="ascending speeds above zero, a rate above zero",
        )  # fmt: skip
    return whole, values, speeds


def _heard(order: np.ndarray, values: np.ndarray, speeds: np.ndarray, rate: float) -> np.ndarray:
    """Lines (n_speeds, n_orders) without those that reach half the rate up to the next speed."""
    return np.where(np.outer(np.append(speeds[1:], speeds[-1]), order) < np.pi * rate, values, 0.0)


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
    root = np.sqrt(_BETA**2 - (np.pi * _WIDTH * order / size) ** 2)
    spectrum = np.zeros((len(values), size // 2 + 1), complex)
    np.add.at(spectrum.T, order, (values * (size / 2 * root / np.sinh(root) / _WIDTH)).T)
    spectrum[:, 0] *= 2
    return np.fft.irfft(spectrum, size, axis=-1)


def _between(grid: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Values (n, n_places) between the samples (n, M) of `_turn` after any number of turns (n_places,)."""
    from scipy.special import i0

    periodic, found = np.pad(grid, ((0, 0), (_WIDTH, _WIDTH)), mode="wrap"), np.zeros((len(grid), len(turns)))
    for begin in range(0, len(turns), _BLOCK):
        some = slice(begin, begin + _BLOCK)
        place = (turns[some] % 1.0) * grid.shape[-1]
        first = np.ceil(place - _WIDTH / 2).astype(int)
        for m in range(_WIDTH):
            kernel = i0(_BETA * np.sqrt(np.maximum(1 - (2 / _WIDTH * (place - first - m)) ** 2, 0.0)))
            found[:, some] += kernel * periodic[:, first + (_WIDTH + m)]
    return found


@dataclass(frozen=True)
class SoundQuality:
    """What is heard of a stationary sound: loudness [sone] of ISO 532-1 in a free field, tones of ECMA-418-1.

    Total tone-to-noise ratio and prominence ratio [dB], nan without a tone; frequencies (n,) of tones [Hz].
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
    found = [one(pressure, rate, prominence=False) for one in (tnr_ecma_st, pr_ecma_st)]
    # the library gives 0 dB where it finds no tone
    noise, ratio = (float(np.max(one[0])) if np.size(one[3]) else np.nan for one in found)
    return SoundQuality(loudness, noise, ratio, np.asarray(found[0][3], float))
