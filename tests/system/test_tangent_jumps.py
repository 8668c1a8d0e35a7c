"""Where a periodic tangent jumps: staircases whose steps are known, on a smooth wave."""

import numpy as np
import pytest

from femgear.system.force_laws import tangent_jumps

# intervals of the period that are looked at first
WIDTH = 1.0 / 512


def staircase(steps, wave=0.0):
    """1 + wave sin + steps {fraction: height} of one state; what is left of them falls at zero."""

    def tangents(fraction, states):
        t = np.mod(fraction, 1.0)
        value = 1.0 + wave * np.sin(2 * np.pi * t)
        for place, height in steps.items():
            value = value + height * (t >= place)
        return value[..., None, None] * np.array([[2.0, -1.0], [-1.0, 2.0]])

    return tangents


@pytest.mark.parametrize("wave", [0.0, 0.4])
@pytest.mark.parametrize(
    "steps",
    [
        {0.123: 0.5, 0.7: -0.3},
        # up, down and up again in neighbouring intervals
        {0.3: 0.5, 0.3 + WIDTH: -0.5, 0.3 + 2 * WIDTH: 0.5, 0.3 + 3 * WIDTH: -0.5},
        {0.3: 0.5, 0.3 + WIDTH: 0.5},
        {0.3: 0.5, 0.3 + WIDTH: 0.5, 0.3 + 2 * WIDTH: -0.5},
        # several in one interval, in either order of their heights
        {0.6001: 0.4, 0.6003: 0.2, 0.6005: 0.3},
        {0.6001: 0.2, 0.6005: 0.4},
        {},
    ],
)
def test_every_step_is_found(steps, wave):
    (found,) = tangent_jumps(staircase(steps, wave), np.array([0]))
    assert found == pytest.approx(sorted(steps), abs=2e-13)


@pytest.mark.parametrize(
    ("steps", "seen"),
    [
        ({0.3001: 0.5, 0.3004: -0.5}, []),
        # of five equal steps in neighbouring intervals the outer ones
        ({0.3 + k * WIDTH: 0.1 for k in range(5)}, [0.3, 0.3 + 4 * WIDTH]),
        # a tenth of the smooth change: 0.1 * 2 pi * 0.4 / 512 = 5e-4
        ({0.123: 3e-4}, []),
        ({0.123: 1e-3}, [0.123]),
        ({0.2: 1.0, 0.5: 1e-9}, [0.2]),
    ],
)
def test_steps_that_the_search_cannot_see_are_those_that_its_docstring_names(steps, seen):
    (found,) = tangent_jumps(staircase(steps, wave=0.4), np.array([0]))
    assert found == pytest.approx(seen, abs=2e-13)


@pytest.mark.parametrize("place", [0.0, 5e-14, 1.0 - 5e-14])
def test_a_step_at_the_ends_of_the_period_is_left_out(place):
    (found,) = tangent_jumps(staircase({place: 0.5, 0.4: -0.5}), np.array([0]))
    assert found == pytest.approx([0.4], abs=2e-13)


def test_each_state_has_its_own():
    one, two = staircase({0.25: 1.0, 0.5: -1.0}), staircase({0.4: 0.1, 0.9: 0.2})

    def tangents(fraction, states):
        return np.where((states == 7)[:, None, None, None], one(fraction, states), two(fraction, states))

    first, second, third = tangent_jumps(tangents, np.array([3, 7, 3]))
    assert second == pytest.approx([0.25, 0.5], abs=2e-13)
    assert first == pytest.approx([0.4, 0.9], abs=2e-13) and np.array_equal(first, third)
