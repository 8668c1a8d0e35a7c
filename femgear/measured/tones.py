"""Tones of constant frequency in a recording, such as the hum of the mains: no turning part makes them.

Where the speed changes, a line of a turning part is sharp over the angle and smeared over time, and a tone of constant
frequency the other way round: smeared over many orders, each of which would look like a line of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from femgear.housing.orders import OrderSpectrum
from femgear.measured.channels import Channel
from femgear.measured.spectra import windowed_spectrum
from femgear.measured.turns import AngleSignal, Turns, even_angle_times, sampled_at

_FAINTEST = 1e-3
"""Height of tones that are looked for, over the largest value of the spectrum over time."""
_STANDS_OUT, _AROUND = 8.0, 101
"""Height of a tone over the median of so many bins around it."""
_SHARPER = 1.1
"""Height of a tone over time, over the highest line over the angle where it would lie."""
_GONE = 0.5
"""Power that must go from there with a tone, over that of the tone: with a side band of a line elsewhere it rises."""
_HANN_POWER = 1.5
"""Sum of the squares of the three bins that a line fills through a Hann window, wherever it lies between them."""
_BESIDE = 3
"""Bins on either side of a tone that its window fills: tones that drift have several peaks there."""
_DRIFT = 0.1
"""How far the frequency of the mains may be from its mean [Hz]."""
_ROUNDS, _MOST, _NEWTON = 4, 32, 4
"""Rounds of the search, each in what the one before left; peaks looked at in each; steps of Newton for a tone."""


@dataclass(frozen=True)
class Tone:
    """A tone of constant frequency: ``frequency`` [Hz] and ``amplitude`` (peak) in the unit of the signal.

    ``width`` [Hz] is how far its frequency may drift within the recording where it does; else zero.
    """

    frequency: float
    amplitude: float
    width: float = 0.0


def without_tones(channel: Channel, turns: Turns, *, parts: int = 1) -> tuple[AngleSignal, tuple[Tone, ...]]:
    """Sample a signal anew over the angle as `resample_turns`, without tones of constant frequency; strongest first.

    A peak of the spectrum over time is such a tone where it is higher than any line over the angle at the orders of its
    frequency over all speeds, and the power at these orders falls without it. Without a side band of another line,
    which the changing speed makes, that power would rise. At a constant speed both spectra are the same, and nothing
    is taken off.

    Parameters
    ----------
    channel : Channel
        The signal.
    turns : Turns
        Of the carrier.
    parts : int
        As of `resample_turns`.
    """
    even = even_angle_times(channel, turns, parts=parts)
    signal = sampled_at(channel, turns, *even)
    slowest, fastest = turns.speeds
    if (fastest / slowest - 1.0) * signal.highest_order * signal.turns < 1.0:
        return signal, ()
    tones: list[Tone] = []
    for _ in range(_ROUNDS):
        batch, channel = _sharp_tones(channel, turns.speeds, signal, even[0])
        tones += batch
        if not batch:
            break
        signal = sampled_at(channel, turns, *even)
    if not tones:
        return signal, ()
    kept = _merged(tones, 1.0 / channel.duration)
    steady, channel = _without_drift(kept, channel)
    return (sampled_at(channel, turns, *even) if steady != kept else signal), steady


def _sharp_tones(
    channel: Channel, speeds: tuple[float, float], signal: AngleSignal, times: np.ndarray
) -> tuple[list[Tone], Channel]:
    """Find tones of one round, and the recording without them; ``times`` (n,) [s] are those of the signal."""
    values = channel.values - channel.values.mean()
    window = 1.0 - np.cos(2.0 * np.pi * np.arange(len(values)) / len(values))
    height = _line_heights(np.abs(np.fft.rfft(values * window)) * (2.0 / len(values)))
    spectrum, step = windowed_spectrum(signal), channel.rate / len(values)
    lines, tones = _line_heights(spectrum.amplitude), []
    for at in _peaks(height):
        smeared = _smeared(spectrum, at * step / speeds[1], at * step / speeds[0])
        if not lines[smeared].size or height[at] < _SHARPER * lines[smeared].max():
            continue
        wave = _fitted(channel.time, values, at * step, window)
        over_angle = windowed_spectrum(replace(signal, values=wave.values(times))).value[smeared]
        gone = (spectrum.amplitude[smeared] ** 2).sum() - (np.abs(spectrum.value[smeared] - over_angle) ** 2).sum()
        if gone > _GONE * _HANN_POWER * wave.tone.amplitude**2:
            tones.append(wave.tone)
            values = values - wave.values(channel.time)
    return tones, replace(channel, values=values)


def _line_heights(amplitude: np.ndarray) -> np.ndarray:
    """Compute heights (n,) of lines through a Hann window from each bin and the two beside it."""
    padded = np.pad(amplitude**2, 1)
    return np.sqrt((padded[:-2] + padded[1:-1] + padded[2:]) / _HANN_POWER)


def _peaks(height: np.ndarray) -> list[int]:
    """Find bins of a spectrum over time where a tone may be, highest first."""
    from scipy.ndimage import median_filter

    high = np.flatnonzero((height[1:-1] >= height[:-2]) & (height[1:-1] > height[2:])) + 1
    high = high[(height[high] > _FAINTEST * height.max()) & (high > 2 * _BESIDE)]
    around = median_filter(height, min(_AROUND, len(height)), mode="mirror")
    high = high[height[high] > _STANDS_OUT * around[high]]
    return high[np.argsort(-height[high], kind="stable")][:_MOST].tolist()


def _smeared(spectrum: OrderSpectrum, first: float, last: float) -> slice:
    """Find the bins over which a tone is smeared that lies between two orders."""
    return slice(max(round(first * spectrum.turns) - _BESIDE, 1), round(last * spectrum.turns) + _BESIDE + 1)


@dataclass(frozen=True)
class _Wave:
    """The ``tone``, and its complex amplitude ``height`` at the time zero."""

    tone: Tone
    height: complex

    def values(self, time: np.ndarray) -> np.ndarray:
        """Values (n,) at times (n,) [s]."""
        return np.real(self.height * np.exp(2j * np.pi * self.tone.frequency * time))


def _fitted(time: np.ndarray, values: np.ndarray, frequency: float, window: np.ndarray) -> _Wave:
    """Fit a tone near a frequency [Hz] to values (n,) at times (n,) [s] through a window.

    By Newton's method for least squares: what turns beside the tone in proportion to time is its error of frequency
    (Rife and Boorstyn 1974, as in `femgear.measured.lines`).
    """
    mean = window.sum()
    centred = time - window @ time / mean
    spread = window @ centred**2
    for _ in range(_NEWTON):
        still = window * values * np.exp(-2j * np.pi * frequency * time)
        frequency += float(np.imag(still @ centred / spread / (still.sum() / mean))) / (2.0 * np.pi)
    height = 2.0 * complex((window * values) @ np.exp(-2j * np.pi * frequency * time)) / mean
    return _Wave(Tone(frequency, abs(height)), height)


def _without_drift(tones: Sequence[Tone], channel: Channel) -> tuple[tuple[Tone, ...], Channel]:
    """Take off what tones leave around their frequencies, where that is much: they drift, as the mains do."""
    values, steady = channel.values - channel.values.mean(), list[Tone]()
    height = np.abs(np.fft.rfft(values * (1.0 - np.cos(2.0 * np.pi * np.arange(len(values)) / len(values)))))
    step = channel.rate / len(values)
    reach = max(_BESIDE + 1, round(_DRIFT / step))
    for tone in tones:
        at = round(tone.frequency / step)
        near = slice(max(at - reach, 0), at + reach + 1)
        beside = np.concatenate([height[max(at - 4 * reach, 0) : near.start], height[near.stop : at + 4 * reach + 1]])
        if height[near].max() > _STANDS_OUT * np.median(beside):
            tone = replace(tone, width=reach * step)
            values = values - _slow_wave(channel.time, values, tone, channel.rate)
        steady.append(tone)
    return tuple(steady), replace(channel, values=values)


def _slow_wave(time: np.ndarray, values: np.ndarray, tone: Tone, rate: float) -> np.ndarray:
    """Fit a tone whose complex amplitude is a cubic spline of time, slower than its width, to values (n,)."""
    from scipy.interpolate import make_lsq_spline

    turning = np.exp(2j * np.pi * tone.frequency * time)
    block = max(round(rate / tone.frequency) * round(0.1 * tone.frequency / tone.width), 1)
    whole = len(values) // block * block
    height = 2.0 * (values * turning.conj())[:whole].reshape(-1, block).mean(axis=1)
    middle = time[:whole].reshape(-1, block).mean(axis=1)
    inner = np.linspace(middle[0], middle[-1], max(round(4.0 * tone.width * (middle[-1] - middle[0])), 1) + 1)[1:-1]
    knots = np.concatenate([[middle[0]] * 4, inner, [middle[-1]] * 4])
    spline = make_lsq_spline(middle, np.stack([height.real, height.imag], 1), knots)(time)
    return np.real((spline[:, 0] + 1j * spline[:, 1]) * turning)


def _merged(tones: Sequence[Tone], step: float) -> tuple[Tone, ...]:
    """Take peaks beside a stronger one, within what its window fills at a step [Hz], for a part of it."""
    kept: list[Tone] = []
    for tone in sorted(tones, key=lambda tone: -tone.amplitude):
        if all(abs(tone.frequency - other.frequency) > _BESIDE * step for other in kept):
            kept.append(tone)
    return tuple(kept)
