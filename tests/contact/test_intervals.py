"""Which intervals between positions of a loaded period need another one: parabolas and jumps by hand."""

from typing import Any

import numpy as np
import pytest

from femgear.contact.loaded_period import MISSED, SHORTEST, SMOOTHEST, _unresolved


def record(position, stiffness, loaded: Any = 0):
    """One mesh with a constant deflection."""
    teeth = np.empty(len(position), object)
    teeth[:] = [frozenset([int(one)]) for one in np.broadcast_to(loaded, len(position))]
    k = np.asarray(stiffness, float)[None]
    return {"position": position, "stiffness": 3e8 * k, "deflection": np.full(k.shape, 1e-6), "loaded": teeth}


def parabola(share, gap=0.125):
    """Nine positions of a parabola, whose middle a straight line misses by `share` of `MISSED`."""
    x = gap * np.arange(-4.0, 5.0)
    return record(x, 1.0 - share * MISSED * 4.0 * (x / gap) ** 2)


def halved(found) -> list[int]:
    """Numbers of the intervals to halve, where none holds a jump."""
    smooth, jumps = _unresolved(found)
    assert not len(jumps)
    return smooth.tolist()


def test_a_curve_is_halved_where_straight_lines_miss_it():
    assert halved(parabola(0.95)) == []
    assert halved(parabola(1.05)) == list(range(8))
    assert halved(parabola(1.05, SMOOTHEST)) == []
    assert halved(parabola(1.05, 1.01 * SMOOTHEST)) == list(range(8))


def test_uneven_intervals_have_their_own_curvature():
    """k = 1 - c x^2 at 0, 1, 2, 4, 8: an interval h misses c h^2 / 4."""
    x = np.array([0.0, 1.0, 2.0, 4.0, 8.0])
    for share, found in ((0.95, [3]), (1.05, [2, 3]), (0.95 / 4, []), (1.05 / 4, [3])):
        assert halved(record(x, 1.0 - share * MISSED * x**2)) == found


@pytest.mark.parametrize("gap", [SHORTEST, 1.01 * SHORTEST])
def test_jumps_are_quartered_down_to_the_shortest_interval(gap):
    x, found = gap * np.arange(6.0), [2] if gap > SHORTEST else []
    for made in (
        record(x, np.ones(6), loaded=[1, 1, 1, 2, 2, 2]),
        record(x, [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]),
    ):
        assert [some.tolist() for some in _unresolved(made)] == [[], found]


def test_a_jump_is_enclosed_in_2_13th_and_a_curve_followed_to_2_10th_of_a_period():
    """Halvings of a sixteenth of the period."""

    def halvings(made):
        gaps = 2.0 ** -np.arange(4, 40)
        return next(n for n, gap in enumerate(gaps) if not any(map(len, _unresolved(made(gap)))))

    assert halvings(lambda gap: record(gap * np.arange(4.0), np.ones(4), loaded=[1, 1, 2, 2])) == 9
    assert halvings(lambda gap: parabola(1.05, gap)) == 6


def test_lines_may_miss_3e_4_of_a_stiffness_and_of_what_a_deflection_moves():
    """A deflection that moves by 1.5e-3 of its mean counts as moving."""
    for share in (0.95, 1.05, 1.2):
        found = [] if share < 1.0 else list(range(8))
        assert halved(parabola(share * 3e-4 / MISSED)) == found
        x = np.arange(-4.0, 5.0)
        moves = 1.5e-3 * (x / 8.0 - share * MISSED * 4.0 * x**2)
        straight = record(0.125 * x, np.ones(9)) | {"deflection": 1e-5 * (1.0 + moves)[None]}
        assert halved(straight) == found
