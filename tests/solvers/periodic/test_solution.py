"""What is said of given multipliers: stable, lost in which way, on the border or undecided."""

import numpy as np
import pytest

from femgear.solvers.periodic.solution import CIRCLE, verdict_of


def judged(*multipliers, error=1e-9, tolerance=1e-6, **free):
    return verdict_of(np.array(multipliers), 2.0, "a method", error, tolerance, **free)


@pytest.mark.parametrize(
    ("multipliers", "loss", "outside"),
    [
        ((0.2, 1.5), "fold", 1),
        ((-1.2, 0.3), "flip", 1),
        ((1.1 + 0.4j, 1.1 - 0.4j, 0.1), "Neimark-Sacker", 2),
        ((-1.1 + 0.4j, -1.1 - 0.4j, 1.05), "Neimark-Sacker", 3),
        ((1.01, -1.3), "flip", 2),
        ((1.5, 1.0 - 0.5 * CIRCLE), "fold", 1),
    ],
)
def test_the_largest_tells_how_stability_was_lost(multipliers, loss, outside):
    found = judged(*multipliers)
    assert found.stable is False and found.loss == loss
    assert f"({loss}); {outside} outside the unit circle" in found.message


def test_the_largest_comes_first_of_a_pair_the_one_above():
    found = judged(0.3, 0.8 - 0.1j, -0.2, 0.8 + 0.1j)
    assert found.multipliers == pytest.approx([0.8 + 0.1j, 0.8 - 0.1j, 0.3, -0.2])
    assert found.exponents == pytest.approx(np.log(found.multipliers) / 2.0)
    assert found.stable is True and found.loss == ""
    assert found.message == f"largest multiplier {abs(0.8 + 0.1j):.6g}"


@pytest.mark.parametrize("largest", [1.004, 0.996, -1.004])
def test_a_monodromy_matrix_of_that_error_decides_nothing_near_the_circle(largest):
    found = judged(0.2, largest, error=1e-3)
    assert found.stable is None and "undecided: error of the monodromy matrix 1.0e-03" in found.message
    assert judged(0.2, largest, error=1e-3, tolerance=1e-2).stable is (abs(largest) < 1)
    assert judged(0.2, largest, error=1e-4).stable is (abs(largest) < 1)


@pytest.mark.parametrize("one", [1.0, -1.0, 1.0 + 0.5 * CIRCLE, 1.0 - 0.5 * CIRCLE])
def test_a_multiplier_one_is_the_border(one):
    found = judged(0.5, one)
    assert found.stable is None and f"on the border: the multiplier {one:+.6g}" in found.message
    assert judged(0.5, one * (1.0 - 3.0 * CIRCLE)).stable is True
    assert judged(0.5, one * (1.0 + 3.0 * CIRCLE)).stable is False


def test_free_positions_are_left_out_and_slow_velocities_no_border():
    assert judged(1.0, 0.5, positions=1).stable is True
    assert judged(1.0, 1.0, 0.5, positions=1).stable is None
    slow = 1.0 - 0.5 * CIRCLE
    assert judged(slow, 0.5, velocities=1).stable is True
    assert judged(slow, slow, 0.5, velocities=1).stable is None
    # nor does one that does not decay at all
    assert judged(1.0, 0.5, velocities=1).stable is None
    # the velocity of a free motion does not alternate
    assert judged(-slow, 0.5, velocities=1).stable is None


def test_drifting_velocities_decay_or_grow():
    found = judged(0.5, drift=np.array([0.3]))
    assert found.multipliers == pytest.approx([np.exp(-0.6), 0.5]) and found.stable is True
    found = judged(0.5, drift=np.array([0.3, -0.1]))
    assert found.multipliers == pytest.approx([np.exp(0.2), np.exp(-0.6), 0.5])
    assert found.exponents[0] == pytest.approx(0.1) and (found.stable, found.loss) == (False, "fold")


def test_nothing_that_moves_is_stable():
    found = verdict_of(np.zeros(0), 1.0, "", 0.0, 1.0)
    assert found.stable is True and "largest multiplier 0" in found.message
