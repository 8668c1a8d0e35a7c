"""Largest loads of engagements and their classes by hand, and numbers of a contact problem that are none."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femgear.contact.solve import solve_contact
from femgear.contact.tooth_loads import _engagement_peaks, load_spectrum
from femgear.errors import ContactError
from femgear.gears.planetary import PlanetarySet

GEARS: Any = SimpleNamespace(
    mates=PlanetarySet.mates, repeated=PlanetarySet.repeated, kind_rows=(slice(0, 1), slice(1, 2))
)


def test_a_tooth_is_in_the_next_slot_a_period_later():
    """Three periods of one position: what enters first carries 1 N, then 20 N, and so on."""
    load = np.array([[[1.0, 2.0, 3.0], [10.0, 20.0, 30.0]]])
    teeth: Any = SimpleNamespace(load=load, turn=np.arange(3), periods=3, each=1)
    assert _engagement_peaks(teeth, closes=True).tolist() == [[20.0, 30.0, 10.0]]
    # of a record that does not close the first and the last one are not whole
    assert _engagement_peaks(teeth, closes=False).tolist() == [[20.0, 30.0]]


def test_loads_are_counted_in_twenty_classes_up_to_the_largest_one():
    """Three engagements, of which one or two carry: small and large loads are the same spectrum."""
    for largest in (0.16, 1600.0):
        load = largest * np.array([[[0.0, 0.0, 0.5]], [[0.92, 0.0, 1.0]]])
        teeth: Any = SimpleNamespace(load=load, turn=np.arange(3), periods=3, each=1)
        found = load_spectrum(GEARS, teeth)
        assert found.edges == pytest.approx(largest * np.arange(21) / 20, rel=1e-14)
        for shares in (found.time, found.engagements):
            assert [np.flatnonzero(row).tolist() for row in shares] == [[10], [18, 19]]
            assert shares.max(axis=1).tolist() == [1.0, 0.5]
        assert found.cycles == pytest.approx(np.array([[1.0, 1.0], [2.0, 2.0]]) / 3)
        assert found.duration == pytest.approx([1 / 3, 2 / 3])
    teeth.load = 0.0 * teeth.load
    unloaded = load_spectrum(GEARS, teeth)
    for shares in (unloaded.time, unloaded.engagements):
        assert shares.shape == (2, 20) and not shares.any()


@pytest.mark.parametrize("bad", [1, 2])
def test_numbers_that_are_not_finite_are_counted(bad):
    H, gap = np.eye(3), np.zeros(3)
    gap[:bad] = (np.nan, np.inf)[:bad]
    with pytest.raises(ContactError, match=f"{bad} of 3 values of the gap are not finite"):
        solve_contact(H, gap, np.ones((3, 1)), np.ones(1))
