"""From the file of a recording to a signal over the angle of the carrier, whatever program wrote it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from femgear.case.quantities import SPEED, to_si
from femgear.errors import CaseError
from femgear.findings import Finding, percent, tell
from femgear.measured.aligned_speed import aligned_speed, widest_range
from femgear.measured.channels import Channel, choose_channel, cut_channel
from femgear.measured.csv_signals import read_csv_signals
from femgear.measured.heard_set import HeardSet
from femgear.measured.requests import Recording
from femgear.measured.sampled_files import read_matlab_signals, read_wav_signals
from femgear.measured.tones import Tone, without_tones
from femgear.measured.turns import AngleSignal, Turns, constant_turns, turns_of_pulses
from femgear.measured.universal_functions import read_universal_signals

_READERS = {".wav": read_wav_signals, ".mat": read_matlab_signals}
_READERS |= dict.fromkeys((".uff", ".unv", ".bunv", ".uf"), read_universal_signals)

_OFF = 0.05
"""Distance of the mesh order from where lines stand best, in orders, from which a constant speed is doubted."""
_FALSE, _HARMONICS_LOOKED_AT = -30.0, 3
"""Level of false lines over the one beside them that is told [dB], and mesh harmonics up to which it is."""
_TONES_SAID = 6
"""Tones of constant frequency that are named."""
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


def read_recording(path: str | os.PathLike, recording: Recording) -> tuple[Channel, ...]:
    """Read all channels of a recording between the times of a request; CaseError as `read_channels`, and E-RANGE."""
    channels = read_channels(path, rate=recording.rate)
    return tuple(cut_channel(channel, recording.begin, recording.end) for channel in channels)


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
    channels = read_recording(path, recording)
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
    signal, tones = without_tones(signal, turns, parts=shafts.ring)
    _tell_tones(tones, signal.unit)
    return signal


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
    _tell_coarse_pulses(turns, shafts)
    return turns, [channel for channel in channels if channel.name != pulses.name]


def _tell_coarse_pulses(turns: Turns, shafts: HeardSet) -> None:
    """Say from which order on pulses that are known too coarsely make false lines.

    A wave of amplitude a in the times makes lines on both sides of one at the frequency f, ``pi f a`` of it.
    """
    frequency = 10 ** (_FALSE / 20) / (np.pi * max(turns.wave, 1e-30))
    order = frequency / (0.5 * sum(turns.speeds))
    if order < _HARMONICS_LOOKED_AT * shafts.ring:
        words = (
            f"pulses tell the angle to {1e6 * turns.error:.2g} us: from order {order:.0f} on a line may have false ones"
        )
        words += f" beside it, within {-_FALSE:g} dB"
        remedy = "sample the pulses faster, take more of them a turn, or record the sensor instead of a logic level"
        tell(Finding("W-RATE", "--pulses", words, remedy=remedy))


def _tell_tones(tones: Sequence[Tone], unit: str) -> None:
    """Say which tones of constant frequency are taken off."""
    if not tones:
        return
    names = [
        f"{tone.frequency:.6g} Hz{f' ± {tone.width:.2g} Hz' if tone.width else ''} ({tone.amplitude:.3g}"
        f"{f' {unit}' if unit else ''})"
        for tone in tones
    ]
    words = f"tones of constant frequency, which no turning part makes, are taken off: {', '.join(names[:_TONES_SAID])}"
    words += f" and {len(names) - _TONES_SAID} more" if len(names) > _TONES_SAID else ""
    tell(Finding("W-TONE", "--channel", words))


def _carrier_speed(signal: Channel, recording: Recording, shafts: HeardSet) -> float:
    """Constant speed of the carrier [1/s]."""
    speed = abs(to_si(recording.speed or "", SPEED)) * shafts.carrier_per_turn[shafts.input] / (2 * np.pi)
    if speed == 0.0:
        raise CaseError(
            "at rest nothing is heard", code="E-SPEED", key="--speed", value=recording.speed, limit="not zero"
        )
    orders = shafts.symmetric_orders(harmonics=3)
    orders = orders[orders * speed < signal.rate / 3]
    if len(orders) < 2:
        return speed
    further = shafts.whole_orders(signal.rate / (3 * speed))
    if recording.within is not None:
        best = aligned_speed(signal, speed, orders, recording.within, further=further)
        _tell_drift(signal, best, orders, further, recording.within)
        return best
    best = aligned_speed(signal, speed, orders, widest_range(orders), further=further)
    if abs(best / speed - 1.0) * shafts.ring > _OFF:
        rpm = 60.0 / shafts.carrier_per_turn[shafts.input]
        words = f"lines stand best on orders of the set at {best * rpm:.6g} rpm, not at {speed * rpm:.6g} rpm"
        enough, most = f"{1.2 * abs(best / speed - 1.0):.2g}", widest_range(orders)
        remedy = "record pulses of a turn, or give the speed itself"
        if float(enough) <= most:
            remedy = f"give --within {enough}, or record pulses"
        tell(Finding("W-UNSTEADY", "--speed", words, remedy=remedy))
    return speed


def _tell_drift(signal: Channel, speed: float, orders: np.ndarray, further: np.ndarray, within: float) -> None:
    """Say where the speeds of both halves of a recording smear its lines over more than a step of orders."""
    half = len(signal.values) // 2
    halves = [replace(signal, values=part) for part in (signal.values[:half], signal.values[half:])]
    within = min(within, widest_range(orders))
    first, second = (aligned_speed(part, speed, orders, within, further=further) for part in halves)
    smeared = abs(first - second) / speed * float(orders[-1])
    if smeared > 1.0 / (signal.duration * speed):
        words = (
            f"from the first half to the second the speed changes by {percent(abs(second / first - 1), 2)}, and order "
        )
        words += f"{orders[-1]} is smeared over {smeared:.2g} orders"
        remedy = "record pulses, or take a part of steady speed by --begin and --end"
        tell(Finding("W-UNSTEADY", "--speed", words, remedy=remedy))
