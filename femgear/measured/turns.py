"""The angle of a shaft during a recording, and signals sampled anew over that angle.

A pulse channel tells when a shaft has turned by a part of a turn. Between pulses the time is a cubic spline of the
angle, and the signal is interpolated at equal steps of the angle: computed order tracking, K. R. Fyfe and E. D. S.
Munck, Analysis of computed order tracking, Mech. Syst. Signal Process. 11 (1997) 187-205; P. D. McFadden,
Interpolation techniques for time domain averaging of gear vibration, the same, 3 (1989) 87-97.

Signals are interpolated by quintic splines. Their response is that of M. Unser, A. Aldroubi and M. Eden, B-spline
signal processing, IEEE Trans. Signal Process. 41 (1993) 821-833: sinc(f/fs)^6 over the samples of the spline, -0.15 dB
at a third of the rate fs. Orders above that are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.errors import CaseError
from femgear.findings import percent
from femgear.measured.channels import Channel

_HYSTERESIS = 0.1
"""Share of the height of pulses on either side of the middle that noise may cross."""
_FEWEST_SMOOTHED = 12
_STEP_ERROR = 12.0**-0.5
"""Standard error of an edge that lies anywhere within a sample, in samples."""
_NEIGHBOURS = 9
_LONG, _SHORT = 1.5, 0.6
"""Interval of pulses over the median of its neighbours, or the one before, that is a lost pulse, or one too many."""
_AWAY, _OUTLYING = 0.05, 20.0
"""Distance of a pulse from the curve of its neighbours, over the median interval and that distance of most pulses."""
_FINEST = 4.0
"""Samples between pulses, at least."""
_HIGHEST = 1.0 / 3.0
"""Highest frequency of lines over the samples a second: the interpolation leaves 98 % of it."""
_MOST_SAMPLES = 100_000_000
LEAST_TURNS = 4
"""Turns of a record below which whole orders are not told apart through a Hann window."""


@dataclass(frozen=True)
class Turns:
    """The angle of a shaft: at the ``time`` (k,) [s], ascending, it has made so many ``turns`` (k,), ascending too.

    ``error`` is the standard error of these times [s], ``wave`` the amplitude of the largest wave in it [s], as far as
    pulses tell them.
    """

    time: np.ndarray
    turns: np.ndarray
    error: float = 0.0
    wave: float = 0.0

    def times(self, turns: np.ndarray) -> np.ndarray:
        """Find the times (n,) [s] at which the shaft has made so many turns (n,), by a cubic spline."""
        from scipy.interpolate import CubicSpline

        if len(self.time) == 2:
            return np.interp(turns, self.turns, self.time)
        return CubicSpline(self.turns, self.time)(turns)

    def of_shaft(self, ratio: float) -> Turns:
        """Turns of a shaft that turns ``ratio`` times as fast."""
        return replace(self, turns=self.turns * abs(ratio))

    @property
    def speeds(self) -> tuple[float, float]:
        """Least and largest speed between pulses [1/s]."""
        speed = np.diff(self.turns) / np.diff(self.time)
        return float(speed.min()), float(speed.max())


@dataclass(frozen=True)
class AngleSignal:
    """A signal at equal steps of the angle of a shaft.

    Parameters
    ----------
    name, unit : str
        Of the channel.
    values : (turns * per_turn,) array
        Samples in the unit.
    turns, per_turn : int
        Whole turns, and samples in each of them.
    highest_order : float
        Highest order of the shaft that the recording holds at its largest speed.
    speed : float
        Mean speed of the shaft [1/s].
    time_error : float
        Standard error of the times of the samples [s], see `Turns`.
    """

    name: str
    unit: str
    values: np.ndarray
    turns: int
    per_turn: int
    highest_order: float
    speed: float
    time_error: float = 0.0


def turns_of_pulses(channel: Channel, per_turn: int = 1) -> Turns:
    """Find the turns of a shaft from its pulses: their rising edges, at the level above the middle.

    CaseError: E-FILE: fewer than three pulses, a lost one, one too many, a late or an early one, too few samples
    between them.

    Parameters
    ----------
    channel : Channel
        Of the pulses, such as the voltage of a tachometer.
    per_turn : int
        Pulses in a turn of the shaft.
    """
    values, levels = channel.values, (channel.values.min(), channel.values.max())
    middle, margin = 0.5 * (levels[0] + levels[1]), _HYSTERESIS * (levels[1] - levels[0])
    side = np.where(values > middle + margin, 1, np.where(values < middle - margin, -1, 0))
    decided = np.flatnonzero(side)
    rising = np.flatnonzero((side[decided][:-1] < 0) & (side[decided][1:] > 0)) + 1
    edge = decided[rising]
    before, after = values[edge - 1], values[edge]
    time = channel.start + (edge - (after - middle - margin) / (after - before)) / channel.rate
    if len(time) < 3:
        remedy = "name the channel of the tachometer by --pulses, or record more turns"
        raise channel.problem(f"{len(time)} pulses", limit="3 or more", remedy=remedy)
    interval = np.diff(time)
    if np.median(interval) * channel.rate < _FINEST:
        limit, remedy = f"{_FINEST:g} or more", "take pulses of a slower shaft, or sample them faster"
        value = f"{np.median(interval) * channel.rate:.3g}"
        raise channel.problem("too few samples between pulses", value=value, limit=limit, remedy=remedy)
    _refuse_wrong_pulses(channel, time)
    steps = (before < levels[0] + margin) & (after > levels[1] - margin)
    time, error, wave = _unquantised(time, channel.rate, steps=bool(np.median(steps)))
    return Turns(time, np.arange(len(time)) / per_turn, error, wave)


def _refuse_wrong_pulses(channel: Channel, time: np.ndarray) -> None:
    """Refuse (CaseError, E-FILE) times [s] of pulses some of which are lost, too many, or off those beside them.

    An interval is compared with the median of its neighbours and, as every other pulse may be lost from some time on,
    with the one before. A pulse is compared with the cubic through two on either side.
    """
    from scipy.ndimage import median_filter

    interval = np.diff(time)
    # at the ends by the neighbours alone: repeated there, a wrong interval would be its own median
    ratio = interval / median_filter(interval, min(_NEIGHBOURS, len(interval)), mode="mirror")
    wrong = np.flatnonzero((ratio > _LONG) | (ratio < _SHORT))
    if not len(wrong):
        ratio = np.append(1.0, interval[1:] / interval[:-1])
        wrong = np.flatnonzero((ratio > _LONG) | (ratio < _SHORT))
    if len(wrong):
        lost = ratio[wrong[0]] > _LONG
        raise channel.problem(
            f"{'a pulse is missing' if lost else 'there is a pulse too many'} at {time[wrong[0]]:.6g} s, "
            f"and {len(wrong) - 1} other intervals are wrong",
            value=f"{ratio[wrong[0]]:.3g} times the interval of the neighbours",
            limit=f"{_SHORT:g} to {_LONG:g} times",
            remedy="leave that part out by --begin or --end, or mend the channel; the angle is not guessed",
        )
    if len(time) < _FEWEST_SMOOTHED:
        return
    away = time[2:-2] - (4.0 * (time[1:-3] + time[3:-1]) - time[:-4] - time[4:]) / 6.0
    most = int(np.abs(away).argmax())
    share = away[most] / float(np.median(interval))
    if abs(share) > _AWAY and abs(away[most]) > _OUTLYING * np.median(np.abs(away)):
        raise channel.problem(
            f"a pulse is {'late' if share > 0 else 'early'} at {time[most + 2]:.6g} s",
            value=f"{abs(share):.2g} of an interval off the curve of the pulses beside it",
            limit=f"{_AWAY:g}, or {_OUTLYING:g} times what most pulses are",
            remedy="leave that part out by --begin or --end, or mend the channel; the angle is not guessed",
        )


def _unquantised(time: np.ndarray, rate: float, *, steps: bool) -> tuple[np.ndarray, float, float]:
    """Smooth times [s] of edges, which lie between two samples and may be known to a step alone.

    By the cubic spline whose penalty on curvature is chosen by generalised cross-validation: P. Craven and G. Wahba,
    Smoothing noisy data with spline functions, Numer. Math. 31 (1979) 377-403. It may move no time by more than a step.

    Edges with even and with odd numbers make curves of their own. Where both err alike and independently, the curve of
    all errs by half of what the two differ by. ``steps`` are edges from one level to the other within a sample: they
    lie anywhere in it, with a variance of 1/12 of a step, and what the smoothing has not taken away of that is error
    too. It may be one wave, where the speed hardly changes. Returns the times, their standard error, and the amplitude
    of the largest wave in that [s].
    """
    from scipy.interpolate import make_smoothing_spline

    if len(time) < _FEWEST_SMOOTHED:
        return (time, _STEP_ERROR / rate, math.sqrt(2.0) * _STEP_ERROR / rate) if steps else (time, 0.0, 0.0)
    number = np.arange(len(time), dtype=float)
    even = time[0] + number * (time[-1] - time[0]) / (len(time) - 1)
    late = (time - even) * rate
    smooth = even + make_smoothing_spline(number, late, lam=curvature_penalty(late))(number) / rate
    smooth = np.clip(smooth, time - 1.0 / rate, time + 1.0 / rate)
    every_other = ((number[i::2], late[i::2]) for i in (0, 1))
    halves = [
        make_smoothing_spline(at, values, lam=curvature_penalty(values, spacing=2.0))(number)
        for at, values in every_other
    ]
    # the last pulse of either half is extrapolated by the other
    half_apart = 0.5 * (halves[0] - halves[1])[1:-1] / rate
    half_apart -= half_apart.mean()
    waves = np.abs(np.fft.rfft(half_apart * np.hanning(len(half_apart)))) * (4.0 / len(half_apart))
    error, wave = float(half_apart.std()), float(waves.max())
    left = (_STEP_ERROR / rate) ** 2 - float(np.var(time - smooth)) if steps else 0.0
    if left > error**2:
        error, wave = math.sqrt(left), max(wave, math.sqrt(2.0 * (left - error**2)))
    return smooth, error, wave


def curvature_penalty(values: np.ndarray, spacing: float = 1.0) -> float:
    """Choose the penalty on the curvature of a smoothing spline through values (n,) by generalised cross-validation.

    It is the ``lam`` of `scipy.interpolate.make_smoothing_spline`, between zero and n, where the values are ``spacing``
    apart. SciPy solves banded equations for every penalty that it tries, row by row. At even distances sine waves solve
    them: the curvatures g of the spline are those of ``(R + a Q'Q) g = Q' y`` (P. J. Green and B. W. Silverman,
    Nonparametric Regression and Generalized Linear Models, Chapman and Hall, 1994, section 2.3), with the second
    differences ``Q'``. For sine waves with the second differences t of their own, R is ``1 + t/6`` and Q'Q is ``t^2``,
    but for the first and the last curvature, whose squares come on top. These two are one equation each for waves that
    are even and odd about the middle.
    """
    from scipy.fft import dst
    from scipy.optimize import minimize_scalar

    n = len(values)
    number = np.arange(1, n - 1)
    difference = -4.0 * np.sin(0.5 * np.pi * number / (n - 1)) ** 2
    gram, squared = 1.0 + difference / 6.0, difference**2
    end = 2.0 / math.sqrt(n - 1) * np.sin(np.pi * number / (n - 1))
    bent = np.asarray(dst(np.diff(values, 2), type=1, norm="ortho"))

    def validation(penalty: float) -> float:
        a = penalty / spacing**3
        diagonal = gram + a * squared
        left, missed = float(n - 2), 0.0
        for waves in (slice(0, None, 2), slice(1, None, 2)):
            inverse, ends = 1.0 / diagonal[waves], end[waves]
            stiffening = a / (1.0 + a * (ends**2 * inverse).sum())
            curvature = (bent[waves] - stiffening * ends * (ends * bent[waves] * inverse).sum()) * inverse
            left -= (gram[waves] * inverse * (1.0 - stiffening * ends**2 * inverse)).sum()
            missed += (squared[waves] * curvature**2).sum() + (ends * curvature).sum() ** 2
        return a**2 * missed * n / left**2

    best: Any = minimize_scalar(validation, bounds=(0.0, n), method="bounded")
    return float(best.x)


def constant_turns(channel: Channel, speed: float) -> Turns:
    """Take the speed of a shaft as constant [1/s] over a recording."""
    time = np.array([channel.start, channel.start + (len(channel.values) - 1) / channel.rate])
    return Turns(time, (time - time[0]) * speed)


def even_angle_times(channel: Channel, turns: Turns, *, parts: int = 1) -> tuple[np.ndarray, int, float]:
    """Find times (n,) [s] at equal steps of the angle of a shaft, over all whole turns of both records.

    The steps are so fine that no sample of the recording is skipped at the slowest speed, and each of so many ``parts``
    of a turn has a whole number of them. Returns the times, the number of whole turns, and the largest speed [1/s].

    CaseError: E-FILE: fewer than four whole turns, a record of pulses that ends long before the signal; E-MEMORY: too
    many samples.
    """
    end = channel.start + (len(channel.values) - 1) / channel.rate
    inside = (turns.time >= channel.start) & (turns.time <= end)
    covered = (turns.time[inside][-1] - turns.time[inside][0]) / (end - channel.start) if inside.sum() > 1 else 0.0
    kept = replace(turns, time=turns.time[inside], turns=turns.turns[inside])
    whole = int(np.floor(kept.turns[-1] - kept.turns[0] + 1e-9)) if covered else 0
    if whole < LEAST_TURNS:
        message, remedy = (
            f"{whole} whole turns of the carrier",
            "record more turns: as many as one over the step of orders",
        )
        raise channel.problem(message, limit=f"{LEAST_TURNS} or more", remedy=remedy)
    if covered < 0.5:
        message, value = "pulses cover a part of the signal alone", f"{percent(covered)} of {channel.duration:.4g} s"
        remedy = "check the rate of either channel, or take the time of the pulses alone by --begin and --end"
        raise channel.problem(message, value=value, limit="50 % or more", remedy=remedy)
    slowest, fastest = kept.speeds
    per_turn = parts * int(np.ceil(channel.rate / (slowest * parts)))
    if whole * per_turn > _MOST_SAMPLES:
        raise CaseError(
            "the speed changes too much for one spectrum",
            code="E-MEMORY",
            file=channel.file,
            value=f"{slowest * 60:.4g} to {fastest * 60:.4g} rpm: {whole * per_turn:.3g} samples",
            limit=f"{_MOST_SAMPLES:.3g} samples",
            remedy="take a part of its speeds by --begin and --end",
        )
    times = kept.times(kept.turns[0] + np.arange(whole * per_turn) / per_turn)
    if not np.all(np.diff(times) > 0):
        message, remedy = (
            "the angle between pulses does not grow",
            "use more pulses a turn, or a part of the record by --begin and --end",
        )
        raise channel.problem(message, value=f"{slowest * 60:.4g} to {fastest * 60:.4g} rpm", remedy=remedy)
    return times, whole, fastest


def resample_turns(channel: Channel, turns: Turns, *, parts: int = 1) -> AngleSignal:
    """Sample a signal anew at the times of `even_angle_times`, which says what is refused."""
    return sampled_at(channel, turns, *even_angle_times(channel, turns, parts=parts))


def sampled_at(channel: Channel, turns: Turns, times: np.ndarray, whole: int, fastest: float) -> AngleSignal:
    """Sample a signal anew at times (n,) [s] over whole turns, with the largest speed [1/s] in them."""
    from scipy.ndimage import map_coordinates

    values = map_coordinates(channel.values, [(times - channel.start) * channel.rate], order=5, mode="mirror")
    highest, mean = _HIGHEST * channel.rate / fastest, whole / (times[-1] - times[0])
    figures = float(highest), float(mean), turns.error
    return AngleSignal(channel.name, channel.unit, values, whole, len(values) // whole, *figures)
