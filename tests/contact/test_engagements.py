"""Largest loads of engagements by hand, and how many numbers of a contact problem are none."""

from types import SimpleNamespace

import numpy as np
import pytest

from femgear.contact.solve import solve_contact
from femgear.contact.tooth_loads import _engagement_peaks
from femgear.errors import ContactError


def test_a_tooth_is_in_the_next_slot_a_period_later():
    """Three periods of one position: what enters first carries 1 N, then 20 N, and so on."""
    load = np.array([[[1.0, 2.0, 3.0], [10.0, 20.0, 30.0]]])
    teeth = SimpleNamespace(load=load, turn=np.arange(3), periods=3, each=1)
    assert _engagement_peaks(teeth, closes=True).tolist() == [[20.0, 30.0, 10.0]]
    # of a record that does not close the first and the last one are not whole
    assert _engagement_peaks(teeth, closes=False).tolist() == [[20.0, 30.0]]


@pytest.mark.parametrize("bad", [1, 2])
def test_numbers_that_are_not_finite_are_counted(bad):
    H, gap = np.eye(3), np.zeros(3)
    gap[:bad] = (np.nan, np.inf)[:bad]
    with pytest.raises(ContactError, match=f"{bad} of 3 values of the gap are not finite"):
        solve_contact(H, gap, np.ones((3, 1)), np.ones(1))
