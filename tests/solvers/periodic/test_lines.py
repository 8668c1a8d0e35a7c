import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.system.fourier import checked_lines, distinct_lines, harmonic_lines, line_tail, side_bands


def test_lines_of_one_base_are_its_harmonics():
    np.testing.assert_array_equal(harmonic_lines(4)[:, 0], range(5))


@pytest.mark.parametrize("top", [1, 3, 6])
def test_combinations_of_two_bases_fill_half_a_diamond(top):
    orders = harmonic_lines(top, 2)
    # a diamond of radius h holds 2 h (h + 1) + 1 points
    assert len(orders) == top * (top + 1) + 1
    both = np.vstack([orders, -orders[1:]])
    assert len(np.unique(both, axis=0)) == 2 * top * (top + 1) + 1
    assert np.abs(both).sum(axis=1).max() == top


def test_side_bands_are_those_of_the_extended_harmonic_balance():
    orders = side_bands(100, 3, 8)
    # mean, 100 carrier harmonics, 3 mesh harmonics with 16 side bands each
    assert len(orders) == 1 + 100 + 3 * 17
    lines = set(map(tuple, orders.tolist()))
    assert {(0, 0), (100, 0), (0, 3), (8, 3), (-8, 1)} <= lines
    assert not {(9, 1), (-1, 0), (8, -3), (1, 4)} & lines
    assert len(lines | {(-a, -b) for a, b in lines}) == 2 * len(orders) - 1
    checked_lines(orders)


def test_distinct_lines_drop_mirror_images_and_repetitions():
    found = distinct_lines([[1, 0], [-1, 0], [2, -1], [-2, 1], [2, -1], [0, 0]])
    assert set(map(tuple, found.tolist())) == {(0, 0), (1, 0), (-2, 1)}
    assert not found[0].any()


@pytest.mark.parametrize(
    ("orders", "word"),
    [
        ([[1], [0]], "first line"),
        ([[0, 0], [1, 0], [-1, 0]], "twice"),
        ([[0, 0], [0.5, 1]], "whole"),
        (np.zeros((0, 2)), "whole"),
    ],
)
def test_lines_that_cannot_be_used_are_refused(orders, word):
    with pytest.raises(CaseError, match=word) as error:
        checked_lines(orders)
    assert error.value.code == "E-HARMONICS"


@pytest.mark.parametrize("call", [lambda: harmonic_lines(-1), lambda: side_bands(3, 2.5, 1)])
def test_numbers_of_harmonics_are_whole(call):
    with pytest.raises(CaseError) as error:
        call()
    assert error.value.code == "E-HARMONICS"


def test_tail_is_the_share_of_the_upper_half():
    lines = np.array([[7.0, 3.0, 0.0, 0.0, 4.0j]])
    assert line_tail(lines, harmonic_lines(4)) == pytest.approx(0.8)
    # three quarters of the largest size count as the upper half, one half as the lower
    orders = np.array([[0, 0], [1, 1], [-1, 2], [0, 4], [4, 0]])
    assert line_tail(np.array([[1.0, 3.0, 4.0, 0, 0]]), orders) == pytest.approx(0.8)
    assert line_tail(np.zeros((2, 5)), harmonic_lines(4)) == 0.0
