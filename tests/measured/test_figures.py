"""femgear.measured.figures: lines stand at their orders, by verdict."""

import numpy as np

from femgear.measured.figures import draw_side_bands
from femgear.measured.heard_set import HeardSet


def test_lines_of_every_verdict_are_drawn_at_their_orders():
    heard = HeardSet(108, 27, 40, np.radians([0, 120, 240]))
    lines = {"normal": [(108.0, 0.0), (219.0, -3.0)], "odd": [(109.0, -9.0)], "none": []}
    figure = draw_side_bands(heard, lines, threshold=-40.0, harmonics=2, half_width=12)
    first, second, over_first, over_second = figure.axes
    assert [len(ax.patches) for ax in (first, second)] == [25, 25]
    drawn = [[line.get_xydata().tolist() for line in ax.get_lines()] for ax in (over_first, over_second)]
    assert drawn == [[[[108.0, 0.0]], [[109.0, -9.0]]], [[[219.0, -3.0]]]]
    assert [line.get_label() for line in over_first.get_lines()] == ["measured: normal", "measured: odd"]
    assert over_first.get_ylim()[0] == -40.0 and first.get_title(loc="left") == "mesh harmonic 1 (order 108)"
