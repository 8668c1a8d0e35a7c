"""Sliders of the entries of a case: what they go from and to, and which are there at first."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from femgear.app.form import Entry

STEPS = 200
"""Of a slider."""
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_USUAL = (
    r"operation\.torque",
    r"operation\.speeds(\[\d+\])?",
    r"operation\.load_case\[0\]\.(torque|speed)\.?.*",
    r"\w+\.modifications\[\d+\]\.amount",
    r"set\.pin_errors\[\d+\]\.(radial|tangential)",
    r"\w+\.damping_ratio",
)
"""Keys of what is dragged most, in that order."""
_MOST = 6


@dataclass(frozen=True)
class Slider:
    """A slider of an entry.

    Parameters
    ----------
    key : str
        Of the entry, or of one value of a list.
    value : float
        In the unit of the file.
    unit : str
        As the file writes it; empty of a pure number.
    low, high : float
        In that unit.
    whole : bool
        Whether only whole numbers are allowed.
    """

    key: str
    value: float
    unit: str
    low: float
    high: float
    whole: bool = False

    @property
    def step(self) -> float:
        """From one place to the next."""
        return 1.0 if self.whole else (self.high - self.low) / STEPS

    def entry_value(self, place: float) -> Any:
        """Value of the entry at a place of the slider, as the file holds it."""
        if self.whole:
            return round(place)
        number = float(f"{place:.6g}")
        return f"{number:g} {self.unit}" if self.unit else number


def slider_of(key: str, value: Any, entry: Entry | None) -> Slider | None:
    """Make the slider of a value as the file holds it: from nothing to twice of it; None of what is no number.

    It stays in the window of the entry.
    """
    match = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    if match is None and (isinstance(value, bool) or not isinstance(value, (int, float))):
        return None
    number, unit = (float(match[1]), match[2]) if match else (float(value), "")
    if not math.isfinite(number):
        return None
    whole = isinstance(value, int) and (entry is None or entry.kind == "integer")
    window = entry.window if entry is not None and (unit == entry.unit or not match) else None
    size = abs(number) or (0.01 * max(map(abs, window)) if window else 1.0)
    low, high = (0.0 if number else -size), 2.0 * size
    low, high = (low, high) if number >= 0 else (-high, -low)
    if window:
        low, high = max(low, window[0]), min(high, window[1])
    return Slider(key, number, unit, low, high, whole) if low < high else None


def usual_keys(keys: Iterable[str]) -> list[str]:
    """Choose of the keys of a case file those that are dragged most."""
    known = list(keys)
    chosen = [key for pattern in _USUAL for key in known if re.fullmatch(pattern, key)]
    return chosen[:_MOST]
