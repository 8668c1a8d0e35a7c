"""Fractions of a mesh period: what rounding leaves just below a whole number is none."""

import numpy as np

from femgear.gears.planetary import _fraction


def test_rounding_makes_no_phase():
    value = np.array([0.25, 1.0 - 1e-12, 7.0 - 1e-12, 1e-12, -1e-12, 3.0 + 1e-12, -0.25, 1.0 - 1e-6])
    assert np.allclose(_fraction(value), [0.25, 0, 0, 0, 0, 0, 0.75, 1.0 - 1e-6], rtol=0, atol=1e-15)
