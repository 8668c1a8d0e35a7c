"""Which intervals between positions of a loaded period need another one: parabolas and jumps by hand."""

import numpy as np
import pytest

from femgear.contact.loaded_period import MISSED, SHORTEST, SMOOTHEST, _unresolved


def record(position, stiffness, loaded=0):
    """One mesh with a constant deflection."""
    teeth = np.empty(len(position), object)
    teeth[:] = [frozenset([int(one)]) for one in np.broadcast_to(loaded, len(position))]
    k = np.asarray(stiffness, float)[None]
    return {"position": position, "stiffness": 3e8 * k, "deflection": np.full(k.shape, 1e-6), "loaded": teeth}


def parabola(share, gap=0.125):
    """Nine positions of a parabola, whose middle a straight line misses by `share` of `MISSED`."""
    x = gap * np.arange(-4.0, 5.0)
    return record(x, 1.0 - share * MISSED * 4.0 * (x / gap) ** 2)


def test_a_curve_is_halved_where_straight_lines_miss_it():
    assert _unresolved(parabola(0.95)).tolist() == []
    assert _unresolved(parabola(1.05)).tolist() == list(range(8))
    assert _unresolved(parabola(1.05, SMOOTHEST)).tolist() == []
    assert _unresolved(parabola(1.05, 1.01 * SMOOTHEST)).tolist() == list(range(8))


def test_uneven_intervals_have_their_own_curvature():
    """k = 1 - c x^2 at 0, 1, 2, 4, 8: an interval h misses c h^2 / 4."""
    x = np.array([0.0, 1.0, 2.0, 4.0, 8.0])
    for share, found in ((0.95, [3]), (1.05, [2, 3]), (0.95 / 4, []), (1.05 / 4, [3])):
        assert _unresolved(record(x, 1.0 - share * MISSED * x**2)).tolist() == found


@pytest.mark.parametrize("gap", [SHORTEST, 1.01 * SHORTEST])
def test_jumps_are_halved_down_to_the_shortest_interval(gap):
    x, found = gap * np.arange(6.0), [2] if gap > SHORTEST else []
    assert _unresolved(record(x, np.ones(6), loaded=[1, 1, 1, 2, 2, 2])).tolist() == found
    assert _unresolved(record(x, [1.0, 1.0, 1.0, 0.5, 0.5, 0.5])).tolist() == found
