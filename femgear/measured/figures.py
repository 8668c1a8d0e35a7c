"""Figure of measured lines over what the spacing of the planets allows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.housing.orders import array_factor, spacing_symmetry
from femgear.report.style import BLACK, BLUE, GREEN, GREY, SKY, VERMILION, label, legend_below, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from femgear.measured.heard_set import HeardSet


def draw_side_bands(
    heard: HeardSet,
    lines: Mapping[str, Sequence[tuple[float, float]]],
    *,
    threshold: float,
    harmonics: int,
    half_width: int,
) -> Figure:
    """Draw the array factor as bars, forbidden orders crossed, and levels of measured lines over it.

    Parameters
    ----------
    heard : HeardSet
        The set.
    lines : mapping of str to sequence of (float, float)
        Orders and levels [dB over the strongest line] by their verdict.
    threshold : float
        Least level [dB].
    harmonics, half_width : int
        Mesh harmonics drawn, and carrier orders on either side of each.
    """
    figure, axes = new_figure(rows=harmonics, width=9.5, height=1.6 + 2.5 * harmonics)
    symmetry = spacing_symmetry(heard.angles)
    marks = (("o", BLUE), ("s", VERMILION), ("D", VERMILION), ("v", GREEN), ("^", BLACK))
    styles = dict(zip(lines, marks[: len(lines) - 1] + marks[-1:], strict=True)) if lines else {}
    for h, ax in enumerate(axes, 1):
        centre = h * heard.ring
        whole = np.arange(max(centre - half_width, 1), centre + half_width + 1)
        ax.bar(whole, array_factor(heard.angles, whole), width=0.8, color=SKY, alpha=0.5, label="array factor")
        no = whole[whole % symmetry != 0]
        ax.plot(no, np.full(len(no), 0.03), "x", color=GREY, label="forbidden by the symmetry", clip_on=False)
        ax.set_ylim(0, 1.12)
        ax.set_xlim(centre - half_width - 0.8, centre + half_width + 0.8)
        title = f"mesh harmonic {h} (order {centre})"
        label(ax, "carrier order [1]" if h == harmonics else "", "array factor [1]", title)
        if not any(lines.values()):
            continue
        over, bottom = ax.twinx(), min(10 * math.floor(threshold / 10), -20)
        over.set_ylim(bottom, -0.12 * bottom)
        over.grid(False)
        over.spines["top"].set_visible(False)
        label(over, y="level [dB re\nstrongest line]")
        for verdict, (mark, colour) in styles.items():
            drawn = [pair for pair in lines[verdict] if abs(pair[0] - centre) <= half_width + 0.5]
            if drawn:
                order, level = np.array(drawn).T
                over.vlines(order, bottom, level, color=colour, linewidth=1.5)
                over.plot(order, level, mark, color=colour, markersize=6, label=f"measured: {verdict}")
    legend_below(figure, columns=3)
    return figure
