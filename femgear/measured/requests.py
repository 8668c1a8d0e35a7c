"""What a user says of a recording: its channels, its speed, which lines are looked at."""

from __future__ import annotations

import re
from dataclasses import dataclass

from femgear.errors import CaseError


@dataclass(frozen=True)
class Recording:
    """Which signal of a file is looked at, and what tells the angle of a shaft.

    Parameters
    ----------
    channel
        Name or number of the channel of the sensor, where the file has several.
    rate
        Samples a second [Hz], where the file does not say so.
    pulses
        Name or number of the channel of the pulses.
    pulses_of
        Member whose turns they count, sun or carrier; of a gearbox any shaft. Default: the input.
    per_turn
        Pulses in a turn.
    speed
        Constant speed of the input with its unit, where there are no pulses.
    unit
        Acceleration that a one in the file stands for, as "1 g" or "98.1 m/s^2". Default: the unit that the file names.
    within
        How far the true speed may be from ``speed``, over it: 0.003 is 0.3 %. The speed is taken at which the lines fit
        the orders of the set best.
    begin
        Time of the file from which on samples are taken [s]. Default: its first.
    end
        Time of the file up to which samples are taken [s]. Default: its last.
    """

    channel: str | None = None
    rate: float | None = None
    pulses: str | None = None
    pulses_of: str | None = None
    per_turn: int = 1
    speed: str | None = None
    within: float | None = None
    unit: str | None = None
    begin: float | None = None
    end: float | None = None


@dataclass(frozen=True)
class LineSearch:
    """Which lines are looked at.

    Parameters
    ----------
    threshold
        Level over the strongest line that the set can make, from which on lines are looked at [dB].
    tolerance
        Distance of orders that count as one. Default: half the step of the spectrum, 0.02 or more.
    """

    threshold: float = -30.0
    tolerance: float | None = None

    def __post_init__(self):
        if not -200.0 <= self.threshold < 0.0:
            limit = "-200 dB up to below 0"
            raise CaseError("no such level", code="E-RANGE", key="--threshold", value=self.threshold, limit=limit)


@dataclass(frozen=True)
class FurtherFiles:
    """What is written beside lines and spectrum.

    Parameters
    ----------
    average
        Synchronous averages over turns of the "carrier", or of "sun" or "planet 1" as a planet passes the sensor; may
        be repeated.
    density
        Power spectral density of the signal.
    force
        Channel of a force: the frequency response of the signal to it, with its coherence.
    """

    average: tuple[str, ...] = ()
    density: bool = False
    force: str | None = None

    def __post_init__(self):
        for name in self.average:
            if not re.fullmatch(r"carrier|sun|planet [1-9]\d?", name):
                limit = "carrier, sun, planet 1, planet 2, ..."
                raise CaseError("there is no such average", code="E-CHOICE", key="--average", value=name, limit=limit)
