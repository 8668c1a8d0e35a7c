"""Harmonics and instants at the fewest samples that tell them apart, and lines of two base frequencies."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.system.fourier import coincidence_note, harmonics_of, sample, side_bands


@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_fewest_samples_hold_their_harmonics(count):
    rng = np.random.default_rng(count)
    amplitudes = rng.normal(size=(2, count + 1)) + 1j * rng.normal(size=(2, count + 1))
    amplitudes[:, 0] = amplitudes[:, 0].real
    positions = 2 * count + 1
    turn = 2j * np.pi * np.arange(positions)[:, None] * np.arange(count + 1) / positions
    values = sample(amplitudes, positions)
    assert np.allclose(values, (amplitudes[:, None] * np.exp(turn)).sum(axis=-1).real, rtol=0, atol=1e-13)
    assert np.allclose(harmonics_of(values, count), amplitudes, rtol=0, atol=1e-13)
    with pytest.raises(CaseError, match=f"{positions - 1} positions in a period cannot hold {count}"):
        harmonics_of(values[:, :-1], count)
    with pytest.raises(CaseError, match=f"{positions - 1} instants cannot show {count} harmonics"):
        sample(amplitudes, positions - 1)


def test_side_bands_of_one_carrier_and_two_mesh_harmonics():
    """m w1 (m <= 2), n w2 +- q w1 (n <= 2, q <= 1), each once, the mean first."""
    wanted = {(0, 0), (1, 0), (2, 0), (-1, 1), (0, 1), (1, 1), (-1, 2), (0, 2), (1, 2)}
    orders = side_bands(2, 2, 1)
    assert {tuple(one) for one in orders.tolist()} == wanted and len(orders) == len(wanted)
    assert orders[0].tolist() == [0, 0]


def test_coinciding_lines_are_named():
    """At a mesh frequency of three times that of the carrier its side band is the carrier's second line."""
    orders = np.array([[0, 0], [1, 0], [2, 0], [-1, 1], [0, 1]])
    assert "Lines [2, 0] and [-1, 1] have one frequency" in coincidence_note(orders, [1.0, 3.0])
    assert coincidence_note(orders, [1.0, 3.1]) == ""
