"""Angles of planets that no set can have."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set

from femgear.errors import CaseError


@pytest.mark.parametrize(
    "angles", [[0.0, 2.0, 2.0], [0.0, 3.0, 1.0], [0.0, 2.0, 2 * np.pi], [1.0, 2.0, 1.0 + 2 * np.pi]]
)
def test_planets_in_the_same_place_or_out_of_order_are_refused(angles):
    with pytest.raises(CaseError, match="within one turn"):
        replace(lin_parker_set(3), planet_angles=np.array(angles))


def test_planets_over_almost_a_turn_are_taken():
    angles = np.array([-3.0, 0.0, 3.2])
    assert np.array_equal(replace(lin_parker_set(3), planet_angles=angles).planet_angles, angles)
