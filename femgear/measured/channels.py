"""Channels of a recording, and refusals of what is none: the same for every format."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError

LEAST_SAMPLES = 64
"""Samples below which a channel is no signal."""
MOST_BYTES = 4_000_000_000
"""Size of a file that is read [bytes]."""
_WHOLE_SAMPLE = 1e-6
"""Part of a sample by which a time may miss it."""
_UNEVEN = 0.5
"""Distance of a time from its place on an even scale, in steps, from which a scale is uneven."""
_TIME_NAMES = ("time", "t", "zeit", "temps", "tiempo", "tempo", "x_value", "seconds", "sec")
_RATE_NAMES = ("fs", "rate", "sample_rate", "samplerate", "sampling_rate", "samplingrate", "sampling_frequency")
_SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
_SHOWN = 12
"""Channels that a refusal lists."""


@dataclass(frozen=True)
class Channel:
    """One signal of a recording.

    Parameters
    ----------
    file : str
        Name of its file, for messages.
    name, unit : str
        As the file calls them; the unit is empty where the file has none.
    rate : float
        Samples a second [Hz].
    values : (n,) array
        Samples in the unit.
    start : float
        Time of the first sample [s].
    """

    file: str
    name: str
    unit: str
    rate: float
    values: np.ndarray
    start: float = 0.0

    @property
    def duration(self) -> float:
        """Time that the samples span [s]."""
        return len(self.values) / self.rate

    @property
    def time(self) -> np.ndarray:
        """Times of the samples [s], shape (n,)."""
        return self.start + np.arange(len(self.values)) / self.rate

    @property
    def words(self) -> str:
        """The channel in a sentence: ``"channel acc"``; one without a name of its own has the word in it."""
        return self.name if self.name.startswith("channel ") else f"channel {self.name}"

    def problem(self, message: str, **words) -> CaseError:
        """Make a refusal (E-FILE) that names the file and the channel."""
        return file_problem(f"{self.file}, {self.words}", message, **words)


def file_problem(file: str, message: str, *, remedy: str, value=None, limit: str | None = None) -> CaseError:
    """Make the refusal of a file that is no recording (E-FILE)."""
    return CaseError(message, code="E-FILE", file=file, value=value, limit=limit, remedy=remedy)


def is_time(name: str) -> bool:
    """Whether a name is that of a time axis."""
    return name.strip().lower().replace(" ", "_") in _TIME_NAMES


def is_rate(name: str) -> bool:
    """Whether a name is that of a number of samples a second."""
    return name.strip().lower().replace(" ", "_") in _RATE_NAMES


def split_unit(title: str) -> tuple[str, str]:
    """Split "acc 1 [m/s^2]" or "acc 1 (m/s^2)" into name and unit, which is empty where there is none."""
    match = re.fullmatch(r"\s*(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*", title[:200])
    return (match[1], match[2].strip()) if match else (title.strip()[:200], "")


def rate_of_times(time: np.ndarray, unit: str, file: str, given: float | None = None) -> tuple[float, float]:
    """Find the samples a second [Hz] and the first time [s] of a time axis (n,), which must be even.

    With a given rate [Hz] the mean step alone counts: times may be printed with few digits. CaseError: a unit that is
    no time, times that stand still, run backwards or leave samples out (E-FILE).
    """
    if unit.lower() not in _SECONDS:
        remedy = "head the column time [s] or time [ms]"
        raise file_problem(file, "a unit of time that is none", value=unit, limit="s, ms, us", remedy=remedy)
    seconds = np.asarray(time, float) * _SECONDS[unit.lower()]
    step = (seconds[-1] - seconds[0]) / (len(seconds) - 1)
    if not step > 0:
        message, remedy = "times do not ascend", "sort the samples by time, or give --rate and no time column"
        raise file_problem(file, message, value=f"{seconds[0]:g} to {seconds[-1]:g} s", remedy=remedy)
    off = np.abs(seconds - seconds[0] - step * np.arange(len(seconds))) / step
    steps = np.diff(seconds)
    if given is None and (off.max() >= _UNEVEN or steps.max() >= (1.0 + _UNEVEN) * np.median(steps)):
        worst = int(np.abs(steps - np.median(steps)).argmax())
        raise file_problem(
            file,
            f"times are not even: from sample {worst + 1} at {seconds[worst]:.6g} s to the next {steps[worst]:.4g} s",
            limit=f"steps of {np.median(steps):.4g} s, times within half of one",
            remedy="export times with all digits and no samples left out; with few digits give --rate as well",
        )
    return 1.0 / step, float(seconds[0])


def agreed_rate(in_file: float | None, given: float | None, file: str) -> float:
    """Choose between the rate [Hz] of a file and a given one, which must agree within a thousandth (E-FILE)."""
    rate = in_file or given
    if rate is None or not (0.0 < rate < np.inf):
        message, remedy = "the file does not say how many samples a second it has", "give --rate, as 25600"
        raise file_problem(file, message, value=rate, remedy=remedy)
    if in_file and given and abs(given / in_file - 1.0) > 1e-3:
        raise file_problem(
            file,
            "the rate of the file is another one than --rate",
            value=f"--rate {given:g} Hz",
            limit=f"{in_file:.6g} Hz, as the file says",
            remedy="leave out --rate, or correct the times of the file",
        )
    return float(rate)


def checked_channel(channel: Channel) -> Channel:
    """Refuse a channel that is too short, empty, or not finite everywhere (E-FILE)."""
    values = np.asarray(channel.values, float)
    if len(values) < LEAST_SAMPLES:
        remedy = "record some turns of the carrier at least"
        raise channel.problem(f"{len(values)} samples", limit=f"{LEAST_SAMPLES} or more", remedy=remedy)
    lost = np.flatnonzero(~np.isfinite(values))
    if len(lost):
        message = f"sample {lost[0] + 1} is no finite number, and {len(lost) - 1} others"
        remedy = "leave that part out by --begin or --end; nothing is put in the place of missing samples"
        raise channel.problem(message, value=values[lost[0]], remedy=remedy)
    if np.ptp(values) == 0.0:
        message, remedy = "the channel is empty: all samples are equal", "name the channel of the sensor by --channel"
        raise channel.problem(message, value=values[0], remedy=remedy)
    return replace(channel, values=values)


def cut_channel(channel: Channel, begin: float | None, end: float | None) -> Channel:
    """Take the samples of a channel from one time up to another [s]; None is where it begins or ends.

    CaseError: no samples between them (E-RANGE).
    """
    if begin is None and end is None:
        return channel
    first = 0 if begin is None else max(math.ceil((begin - channel.start) * channel.rate - _WHOLE_SAMPLE), 0)
    after = len(channel.values) if end is None else math.ceil((end - channel.start) * channel.rate - _WHOLE_SAMPLE)
    values = channel.values[first : max(after, 0)]
    if not len(values):
        last = channel.start + channel.duration
        raise CaseError(
            f"no samples of {channel.words} between two times",
            code="E-RANGE",
            key="--end" if begin is None else "--begin",
            file=channel.file,
            value=f"{channel.start if begin is None else begin:g} to {last if end is None else end:g} s",
            limit=f"ascending, within {channel.start:g} to {last:g} s",
        )
    return replace(channel, values=values, start=channel.start + first / channel.rate)


def choose_channel(channels: Iterable[Channel], name: str | None, option: str = "--channel") -> Channel:
    """Choose a channel by its name or its number from 1, or the only one there is, and check it.

    CaseError: none or several of that name, several without a name (E-FILE).
    """
    channels = list(channels)
    if name is not None and name.isdigit() and 1 <= int(name) <= len(channels):
        chosen = [channels[int(name) - 1]]
    else:
        chosen = [channel for channel in channels if name in (None, channel.name)]
    if len(chosen) != 1:
        listed = "; ".join(f"{number} {channel.name}" for number, channel in enumerate(channels[:_SHOWN], 1))
        listed += f"; {len(channels) - _SHOWN} more" if len(channels) > _SHOWN else ""
        raise file_problem(
            channels[0].file if channels else "",
            f"{len(chosen) or 'no'} channels" + (f" called {name}" if name is not None else ""),
            value=listed or None,
            limit="one",
            remedy=f"choose one by {option} and its name or number",
        )
    return checked_channel(chosen[0])
