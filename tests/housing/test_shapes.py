"""Which carrier orders a fixed sensor tells by itself, and fields of several speeds at once."""

import numpy as np
import pytest

from femgear.housing.orders import count_lobes
from femgear.housing.sensor import fixed_sensor_lines, hanning_model


@pytest.mark.parametrize(("n_max", "top"), [(5, 3 * 36), (200, 2 * 36 + 200)])
def test_lines_end_where_the_field_does(n_max, top):
    """One mesh order above the highest harmonic, or the highest component of the field."""
    lines = fixed_sensor_lines(np.ones((3, 2 * n_max + 1)), 36, 3.0, 0.1)
    assert lines.order[-1] == top
    assert lines.displacement.shape == (top + 1,)


def test_windows_of_several_speeds_are_those_of_each():
    rng = np.random.default_rng(8)
    harmonics = rng.normal(size=(2, 5, 3, 4)) + 1j * rng.normal(size=(2, 5, 3, 4))
    angles = np.array([0.0, 2.0, 4.4])
    field = hanning_model(harmonics, angles, n_max=6)
    assert field.shape == (2, 5, 4, 13)
    for k in np.ndindex(2, 5):
        assert np.array_equal(field[k], hanning_model(harmonics[k], angles, n_max=6))


@pytest.mark.parametrize(("height", "count"), [(0.12, 2), (0.08, 1)])
def test_a_lobe_stands_out_by_a_tenth_of_the_largest(height, count):
    """Two bumps over a floor of 0.2, the smaller one as high above it as told."""
    turn = 2 * np.pi * np.arange(720) / 720
    bumps = (np.maximum(np.cos(turn - place), 0.0) ** 8 for place in (1.0, 4.0))
    envelope = 0.2 + 0.8 * next(bumps) + height * next(bumps)
    assert len(count_lobes(envelope).position) == count
