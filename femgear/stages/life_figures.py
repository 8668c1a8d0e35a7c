"""Picture of lives over load cases: which load case does the damage of which root and flank."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import COLOURS, GREY, SMALL, label, legend_below, new_figure
from femgear.stages.life_results import SYMBOLS, hours_text
from femgear.stages.protocol import Drawn, Figures

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

OTHERS = "all others"
"""Name of the load cases that have no colour of their own."""
LIFE_CAPTION = (
    "Share of every load case in the damage of the roots and flanks that take any (ISO 6336-6), the shortest life on "
    "top; behind the bars the life."
)
_MOST_BARS = 24
_BAR = 0.32
"""Height of a bar with its distance [in]."""


def damage_bars(data: xr.Dataset) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Collect names, lives [h] and shares (c, n) of roots and flanks with damage, the shortest life first."""
    names, lives, shares = list[str](), list[float](), list[np.ndarray]()
    for kind in SYMBOLS:
        if f"{kind}_life" not in data:
            continue
        for number, life in enumerate(data[f"{kind}_life"].values):
            if np.isfinite(life):
                names.append(f"{kind} of {data[kind].values[number]}")
                lives.append(float(life))
                shares.append(data[f"{kind}_damage_share"].values[:, number])
    first = np.argsort(lives, kind="stable")[:_MOST_BARS]
    count = data.sizes["load_case"]
    return [names[i] for i in first], np.array(lives)[first], np.array(shares).reshape(-1, count)[first].T


def draw_damage(data: xr.Dataset) -> Figure | None:
    """Draw the shares of the load cases in the damage of roots and flanks; None of one load case, or without damage."""
    names, lives, shares = damage_bars(data)
    if not names or len(shares) < 2:
        return None
    figure, (ax,) = new_figure(height=1.7 + _BAR * len(names))
    rows = np.arange(len(names))
    coloured = np.argsort(-shares.sum(axis=1), kind="stable")[: len(COLOURS)]
    left = np.zeros(len(names))
    for place, number in enumerate(sorted(coloured.tolist())):
        case = str(data["load_case"].values[number])
        ax.barh(rows, 100.0 * shares[number], left=left, height=0.7, color=COLOURS[place], label=case)
        left = left + 100.0 * shares[number]
    if len(shares) > len(coloured):
        ax.barh(rows, 100.0 - left, left=left, height=0.7, color=GREY, label=OTHERS)
    for row, life in zip(rows, lives, strict=True):
        ax.text(101.0, row, f"{hours_text(life)} h" if life else "at once", va="center", fontsize=SMALL)
    ax.set_yticks(rows, names)
    ax.set_xlim(0.0, 118.0)
    ax.set_xticks(np.arange(0, 101, 20))
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    label(ax, "share of the damage [%]")
    legend_below(figure, ax)
    return figure


def _draw(drawn: Drawn) -> dict[str, Figure]:
    figure = draw_damage(drawn.data["life"])
    return {} if figure is None else {"damage": figure}


LIFE_FIGURES = Figures({"damage": LIFE_CAPTION}, _draw)
