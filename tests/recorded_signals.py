"""Recordings made by femgear itself: lines of a coarse set, with noise, a speed that wanders, and pulses."""

from itertools import chain

from validation.recordings import CASE, COARSE, RATE, computed_lines, recording

__all__ = ["CASE", "COARSE", "HEALTHY", "RATE", "computed_lines", "recording", "write_columns"]

HEALTHY = {3: 0.31, 213: 0.29, 216: 0.03j, 219: 0.31, 318: 0.07, 321: -0.97, 324: 0.1, 327: 1.0, 330: 0.08}
"""Orders and amplitudes as those of the healthy set: multiples of three alone."""


def write_columns(path, heading, columns, *, separator=";", comma=False, digits="%.9g"):
    """Write columns of numbers as text, all by one format, which is faster than one a row."""
    numbers = tuple(chain.from_iterable(zip(*columns)))
    text = (separator.join([digits] * len(columns)) + "\n") * (len(numbers) // len(columns)) % numbers
    path.write_text(heading + (text.replace(".", ",") if comma else text), encoding="utf-8")
    return path
