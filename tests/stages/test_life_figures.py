"""Bars of the damage by load case."""

import math

import numpy as np
import pytest
import xarray as xr

from femgear.report.style import COLOURS
from femgear.stages.life_figures import LIFE_FIGURES, OTHERS, damage_bars, draw_damage
from femgear.stages.protocol import Drawn


def lives(count: int = 3) -> xr.Dataset:
    """Two roots and a flank over load cases, of which one root takes no damage."""
    share = np.arange(1.0, count + 1.0) / (count * (count + 1) / 2)
    return xr.Dataset(
        {
            "root_life": ("root", [5000.0, math.inf]),
            "root_damage_share": (("load_case", "root"), np.stack([share, 0.0 * share], axis=1)),
            "flank_life": ("flank", [400.0]),
            "flank_damage_share": (("load_case", "flank"), share[::-1, None]),
        },
        coords={
            "load_case": [f"case {number}" for number in range(count)],
            "root": ["gear 1", "gear 2"],
            "flank": ["gear 1"],
        },
    )


def test_bars_are_the_shares_with_the_shortest_life_first():
    names, hours, shares = damage_bars(lives())
    assert names == ["flank of gear 1", "root of gear 1"] and hours.tolist() == [400.0, 5000.0]
    figure = draw_damage(lives())
    (ax,) = figure.axes
    widths = np.array([[bar.get_width() for bar in bars] for bars in ax.containers])
    assert widths == pytest.approx(100.0 * shares)
    assert [text.get_text() for text in ax.texts] == ["400 h", "5000 h"]


def test_many_load_cases_have_the_largest_in_colour_and_the_rest_as_one():
    (ax,) = draw_damage(lives(12)).axes
    assert len(ax.containers) == len(COLOURS) + 1 and ax.containers[-1].get_label() == OTHERS
    ends = [bar.get_x() + bar.get_width() for bar in ax.containers[-1]]
    assert ends == pytest.approx([100.0, 100.0])


def test_one_load_case_or_no_damage_has_no_picture():
    assert draw_damage(lives(1)) is None
    none = lives().assign(root_life=("root", [math.inf] * 2), flank_life=("flank", [math.inf]))
    assert draw_damage(none) is None
    assert LIFE_FIGURES.draw(Drawn(None, {"life": none})) == {}
    assert [*LIFE_FIGURES.draw(Drawn(None, {"life": lives()}))] == ["damage"]
