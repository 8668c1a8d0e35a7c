"""Spectra of tooth loads, of records that repeat and of those that do not."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femgear.contact.tooth_loads import LoadedTeeth, load_spectrum
from femgear.gears.planetary import PlanetarySet

GEARS: Any = SimpleNamespace(
    mates=PlanetarySet.mates, repeated=PlanetarySet.repeated, kind_rows=(slice(0, 1), slice(1, 2))
)


def invented(periods, slots=3, each=4):
    """Teeth of two meshes; tooth number e, which enters in period e, has the peak e + 1."""
    load = np.zeros((2, slots, periods * each))
    for entered in range(-slots, periods):
        for slot in range(slots):
            period = entered + slot
            if 0 <= period < periods:
                load[:, slot, period * each : (period + 1) * each] = (entered % periods + 1) * (slot == 1)
    zero = np.zeros((2, 1, periods * each))
    turn = np.arange(periods * each) // each
    tooth = np.zeros((2, 2, slots), int)
    return LoadedTeeth(load, load, tooth, zero, zero, tooth[:, :, :1], turn, periods, False)


def test_peaks_are_counted_once_an_engagement():
    whole = load_spectrum(GEARS, invented(10), closes=True)
    assert whole.edges[-1] == 10 and len(whole.edges) == 21
    # classes of half a unit, which begin with their lower limit; the last one holds its upper limit too
    expected = np.zeros(20)
    expected[[*range(2, 20, 2), 19]] = 0.1
    assert whole.engagements[0] == pytest.approx(expected)
    # a record that does not repeat shows eight teeth from entry to exit: those with peaks 1 .. 8
    part = load_spectrum(GEARS, invented(10), closes=False)
    expected = np.zeros(20)
    expected[2:18:2] = 1 / 8
    assert part.engagements[0] == pytest.approx(expected)
