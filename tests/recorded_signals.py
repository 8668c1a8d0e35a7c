"""Recordings made by femgear itself: lines of a coarse set, with noise, a speed that wanders, and pulses."""

from functools import cache
from pathlib import Path

import numpy as np

from femgear import read_case, solve
from femgear.trains.reading import with_values

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"
RATE = 8192.0
COARSE = {
    "static.flank_elements": 6,
    "static.positions": 8,
    "dynamics.mesh_harmonics": 3,
    "operation.speeds": ["900 rpm"],
}
UNEQUAL = {"set.pin_errors": [{"planet": 1, "tangential": "20 um"}]}


HEALTHY = {3: 0.31, 213: 0.29, 216: 0.03j, 219: 0.31, 318: 0.07, 321: -0.97, 324: 0.1, 327: 1.0, 330: 0.08}
"""Orders and amplitudes as those of the healthy set: multiples of three alone."""


@cache
def computed_lines(unequal=False):
    """Orders (k,) of the carrier and complex accelerations (k,) [m/s^2] of the sensor at 900 rpm of the sun."""
    case = with_values(read_case(CASE), {**COARSE, **(UNEQUAL if unequal else {})})
    lines = solve(case, "housing")["housing"].exact
    value = lines.acceleration[0]
    kept = (lines.order > 0) & (np.abs(value) > 1e-4 * np.abs(value).max())
    return lines.order[kept], value[kept]


def write_columns(path, heading, columns, *, separator=";", comma=False, digits="%.9g"):
    """Write columns of numbers as text."""
    rows = [separator.join(digits % x for x in row) for row in zip(*columns)]
    text = "\n".join(rows)
    path.write_text(heading + (text.replace(".", ",") if comma else text) + "\n", encoding="utf-8")
    return path


def recording(order, value, *, carrier=180 / 60, seconds=20.0, rate=RATE, wander=0.01, noise=1e-3, seed=1):
    """Signal (n,), pulses of the sun (n,) and turns of the carrier (n,) at a speed [1/s] that wanders by a share.

    The noise is a share of the largest line.
    """
    time = np.arange(round(seconds * rate)) / rate
    # the speed is carrier (1 + wander sin(2 pi f t)), f = 0.23 Hz
    turns = carrier * (time + wander * (1 - np.cos(2 * np.pi * 0.23 * time)) / (2 * np.pi * 0.23))
    signal = np.zeros_like(time)
    for one, amplitude in zip(order, value):
        signal += np.real(amplitude * np.exp(2j * np.pi * one * turns))
    signal += noise * np.abs(list(value)).max() * np.random.default_rng(seed).normal(size=len(time))
    sun = 5.0 * turns  # 1 + 108/27 turns in one of the carrier
    pulses = 5.0 * (np.mod(sun, 1.0) < 0.1)
    return signal, pulses, turns
