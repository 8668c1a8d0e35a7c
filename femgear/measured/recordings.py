"""From the file of a recording to a signal over the angle of the carrier, whatever program wrote it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from femgear.case.quantities import SPEED, to_si
from femgear.errors import CaseError
from femgear.measured.channels import Channel, choose_channel
from femgear.measured.csv_signals import read_csv_signals
from femgear.measured.heard_set import HeardSet
from femgear.measured.requests import Recording
from femgear.measured.sampled_files import read_matlab_signals, read_wav_signals
from femgear.measured.turns import AngleSignal, Turns, aligned_speed, constant_turns, resample_turns, turns_of_pulses
from femgear.measured.universal_functions import read_universal_signals

_READERS = {".wav": read_wav_signals, ".mat": read_matlab_signals}
_READERS |= dict.fromkeys((".uff", ".unv", ".bunv", ".uf"), read_universal_signals)

_ACCELERATIONS = {"m/s^2": 1.0, "m/s2": 1.0, "mm/s^2": 1e-3, "g": 9.80665, "mg": 9.80665e-3}
"""Accelerations [m/s^2] by their units, in which g is that of free fall (ISO 80000-3)."""


def read_channels(path: str | os.PathLike, *, rate: float | None = None) -> tuple[Channel, ...]:
    """Read all channels of a recording: WAV, MATLAB, universal file, or text in columns, by the end of its name.

    CaseError: what the reader of the format refuses (E-FILE), with the file and what to do.

    Parameters
    ----------
    path : path
        Of the file.
    rate : float, optional
        Samples a second [Hz], where the file does not say so.
    """
    reader = _READERS.get(Path(path).suffix.lower(), read_csv_signals)
    return reader(path, rate=rate)


def read_by_turns(path: str | os.PathLike, recording: Recording, shafts: HeardSet) -> AngleSignal:
    """Read a signal and sample it anew over the angle of the carrier.

    Parameters
    ----------
    path : path
        Of the recording.
    recording : Recording
        Channels, and what tells the angle.
    shafts : HeardSet
        Of the set, whose carrier turns so many times with each member.

    Raises
    ------
    CaseError
        What `read_channels`, `turns_of_pulses` and `resample_turns` refuse (E-FILE); neither pulses nor a speed,
        or both, a member that stands still (E-SPEED).
    """
    channels = read_channels(path, rate=recording.rate)
    turns, others = None, list(channels)
    if recording.pulses is not None:
        turns, others = _pulses(channels, recording, shafts)
    signal = choose_channel(others if recording.channel is None else channels, recording.channel)
    if (turns is None) == (recording.speed is None):
        raise CaseError(
            "the speed of a recording",
            code="E-SPEED",
            key="--speed",
            value="neither" if turns is None else "both",
            limit="pulses of a shaft, or a constant speed",
            remedy="name the channel of the pulses by --pulses, or give --speed of the input",
        )
    signal = channel_in_si(signal, recording.unit)
    if turns is None:
        turns = constant_turns(signal, _carrier_speed(signal, recording, shafts))
    return resample_turns(signal, turns, parts=shafts.ring)


def channel_in_si(signal: Channel, unit: str | None) -> Channel:
    """Convert a channel to m/s^2 where its unit is an acceleration, or one is given; others stay as they are.

    CaseError: a unit that is no acceleration (E-UNIT).
    """
    factor = _ACCELERATIONS.get(signal.unit.replace("²", "^2").lower())
    if unit is not None:
        number, _, name = unit.strip().partition(" ")
        factor = _ACCELERATIONS.get(name.strip().replace("²", "^2").lower())
        try:
            factor = None if factor is None else factor * float(number)
        except ValueError:
            factor = None
        if factor is None or not 0.0 < factor < np.inf:
            limit = f"a number above zero and {', '.join(_ACCELERATIONS)}"
            raise CaseError("no acceleration", code="E-UNIT", key="--unit", value=unit, limit=limit)
    return signal if factor is None else replace(signal, values=factor * signal.values, unit="m/s^2")


def _pulses(channels: Sequence[Channel], recording: Recording, shafts: HeardSet) -> tuple[Turns, list[Channel]]:
    """Turns of the carrier by pulses of a member, and the other channels."""
    pulses = choose_channel(channels, recording.pulses, "--pulses")
    member = recording.pulses_of or shafts.input
    ratio = shafts.carrier_per_turn.get(member, 0.0)
    if not ratio or recording.per_turn < 1:
        raise CaseError(
            "pulses that tell no angle",
            code="E-SPEED",
            key="--pulses-of",
            value=f"{recording.per_turn} a turn of the {member}",
            limit=f"1 or more a turn of {' or '.join(shafts.carrier_per_turn)}",
        )
    turns = turns_of_pulses(pulses, recording.per_turn).of_shaft(ratio)
    return turns, [channel for channel in channels if channel.name != pulses.name]


def _carrier_speed(signal: Channel, recording: Recording, shafts: HeardSet) -> float:
    """Constant speed of the carrier [1/s]."""
    speed = abs(to_si(recording.speed or "", SPEED)) * shafts.carrier_per_turn[shafts.input] / (2 * np.pi)
    if speed == 0.0:
        raise CaseError(
            "at rest nothing is heard", code="E-SPEED", key="--speed", value=recording.speed, limit="not zero"
        )
    if recording.within is None:
        return speed
    orders = shafts.symmetric_orders(harmonics=3)
    return aligned_speed(signal, speed, orders[orders * speed < signal.rate / 3], recording.within)
