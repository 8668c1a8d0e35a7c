"""Synchronous averages of a recording: over turns of the carrier, and of sun and planets as they pass the sensor.

Whatever is the same in every turn of the carrier stays in its average; noise and other shafts leave it as one over the
root of the turns: P. D. McFadden, A revised model for the extraction of periodic waveforms by time domain averaging,
Mech. Syst. Signal Process. 1 (1987) 83-95.

A sensor on the housing hears a planet best as it passes. Once in a turn of the carrier a piece is cut out there, and
put where the teeth belong that then mesh: P. D. McFadden, A technique for calculating the time domain averages of the
vibration of the individual planet gears and the sun gear in an epicyclic gearbox, J. Sound Vib. 144 (1991) 163-172.
From one passage to the next z_ring teeth of a planet and of the sun against the carrier go by, so that passage m has
tooth m z_ring modulo the teeth of the gear. With g the largest common divisor of both, every g-th tooth comes by; Hann
windows of two g teeth, g teeth apart, add up to one.
"""

from __future__ import annotations

import math

import numpy as np

from femgear.errors import CaseError
from femgear.measured.heard_set import HeardSet
from femgear.measured.turns import AngleSignal


def carrier_average(signal: AngleSignal) -> np.ndarray:
    """Average a signal over all turns of the carrier, (per_turn,) in its unit, without the mean."""
    average = signal.values.reshape(signal.turns, signal.per_turn).mean(axis=0)
    return average - average.mean()


def passing_angle(signal: AngleSignal, gear_set: HeardSet) -> float:
    """Find the turn of the carrier, 0 to 1, at which a planet passes the sensor, as the signal is loudest there.

    That of the first planet, up to the symmetry of the planets: the carrier average of the squares, smoothed over the
    distance of planets, added up over their places.
    """
    power = (signal.values.reshape(signal.turns, signal.per_turn) ** 2).mean(axis=0)
    spectrum = np.fft.rfft(power)
    orders = np.arange(len(spectrum))
    array = np.exp(1j * np.multiply.outer(orders, gear_set.angles)).mean(axis=1)
    lowest = orders <= 2 * len(gear_set.angles)
    folded = np.fft.irfft(np.where(lowest & (orders > 0), spectrum * np.conj(array), 0.0), signal.per_turn)
    return float(folded.argmax()) / signal.per_turn


def gear_average(
    signal: AngleSignal, gear_set: HeardSet, gear: str, *, planet: int = 1, passing: float | None = None
) -> np.ndarray:
    """Average the vibration of the sun or of one planet over its teeth as it passes the sensor.

    CaseError: unknown teeth (E-KEY-MISSING), no such planet, too few turns for all teeth (E-RANGE).

    Parameters
    ----------
    signal : AngleSignal
        Over the angle of the carrier, every mesh period of which has a whole number of samples.
    gear_set : HeardSet
        The set.
    gear : str
        ``"sun"`` or ``"planet"``.
    planet : int
        Number of the planet that passes, from 1; its tooth that meshes at the first passage is tooth 0.
    passing : float, optional
        Turn of the carrier at which planet 1 passes the sensor. Default: `passing_angle`.

    Returns
    -------
    (teeth * samples a tooth,) array
        In the unit of the signal, without the mean.
    """
    teeth = {"sun": gear_set.sun, "planet": gear_set.planet}[gear]
    if teeth is None:
        raise CaseError("the teeth are not known", code="E-KEY-MISSING", key=f"{gear}.teeth", remedy="give them")
    if not 1 <= planet <= len(gear_set.angles):
        limit = f"1 to {len(gear_set.angles)}"
        raise CaseError("there is no such planet", code="E-RANGE", key="--average", value=planet, limit=limit)
    samples, step = signal.per_turn // gear_set.ring, math.gcd(teeth, gear_set.ring)
    first = passing_angle(signal, gear_set) if passing is None else passing
    # planets behind the first one, counter-clockwise, pass later
    first = (first + (gear_set.angles[0] - gear_set.angles[planet - 1]) / (2 * np.pi)) % 1.0
    half = step * samples
    window = 0.5 + 0.5 * np.cos(np.pi * np.arange(-half, half) / half)
    average, count = np.zeros(teeth * samples), np.zeros(teeth // step)
    for passage in range(signal.turns):
        centre = round((first + passage) * signal.per_turn)
        if centre < half or centre + half > len(signal.values):
            continue
        tooth = passage * gear_set.ring % teeth
        place = (tooth * samples + np.arange(-half, half)) % len(average)
        np.add.at(average, place, window * signal.values[centre - half : centre + half])
        count[tooth // step] += 1
    if count.min() < 1:
        raise CaseError(
            f"not every tooth of the {gear} has passed the sensor",
            code="E-RANGE",
            key="--average",
            value=f"{signal.turns} turns of the carrier",
            limit=f"{len(count) + 2} or more",
            remedy="record more turns",
        )
    average = _divided(average, count, half)
    return average - average.mean()


def _divided(total: np.ndarray, count: np.ndarray, half: int) -> np.ndarray:
    """Sum of windowed pieces over how many there were of each, the counts weighed by the same windows."""
    weight = np.zeros(len(total))
    window = 0.5 + 0.5 * np.cos(np.pi * np.arange(-half, half) / half)
    for tooth, pieces in enumerate(count):
        np.add.at(weight, (tooth * half + np.arange(-half, half)) % len(total), pieces * window)
    return total / weight
