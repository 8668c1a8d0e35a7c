"""Panels at places given in inches: looking for places takes matplotlib longer than drawing the figure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from femgear.plots.style import COLOURS, GREY, SIZE, label, legend_below

# Inches: beside the panels, below the last, above the first, between two with and without numbers in between.
_LEFT, _RIGHT, _BOTTOM, _TOP, _GAP, _SHARED = 0.95, 0.2, 0.95, 0.35, 0.75, 0.5
# Room for a title of the figure, and for the names of lines.
_TITLE, _NAMES = 0.3, 0.5
# Columns of pixels of a panel, and instants a column from which a band is drawn.
_PIXELS, _POINTS = 900, 4
# Of the first curve, and of those behind it.
_WIDTHS, _ALPHAS = (0.9, 2.4), (1.0, 0.5)
# Distance of the names of two lines over the width of the axes.
_NAME = 0.0165
_LARGEST = 1e100
# Least span of an ordinate that does not reach zero, over its largest value.
_LEAST = 0.02


def panels(
    titles: Sequence[str],
    *,
    columns: int = 1,
    width: float = 8.0,
    height: float = 1.6,
    x: str,
    y: Sequence[str],
    title: str = "",
    named: bool = False,
):
    """A figure with one pair of axes a title.

    Parameters
    ----------
    titles : sequence of str
        Of the panels, row by row.
    columns : int
        One column shares its abscissa.
    width, height : float
        Of a panel [in].
    x : str
        Label below the panels.
    y : sequence of str
        Label of every panel.
    title : str
        Above all panels.
    named : bool
        Leave room for names of lines above the first panel.

    Returns
    -------
    Figure
    list of Axes
    """
    rows, gap = -(-len(titles) // columns), _SHARED if columns == 1 else _GAP
    top, step = _TOP + bool(title) * _TITLE + named * _NAMES, _LEFT + width + _RIGHT
    size = (columns * step, top + rows * height + (rows - 1) * gap + _BOTTOM)
    figure, axes = Figure(figsize=size, layout="none"), []
    for number in range(len(titles)):
        row, column = divmod(number, columns)
        left, bottom = column * step + _LEFT, size[1] - top - row * (height + gap) - height
        place = (left / size[0], bottom / size[1], width / size[0], height / size[1])
        axes.append(figure.add_axes(place, sharex=axes[0] if axes and columns == 1 else None))
    for number, (ax, text) in enumerate(zip(axes, titles)):
        last = number >= len(titles) - columns
        ax.tick_params(labelsize=SIZE - 1, labelbottom=last or columns > 1)
        ax.grid(True, color="0.88", linewidth=0.8)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        label(ax, x if last else "", y[number])
        ax.xaxis.set_label_coords(0.5, -0.34 / height)
        ax.yaxis.set_label_coords(-0.68 / width, 0.5)
        above = 6.0 + 72.0 * _NAMES * (named and not number)
        ax.set_title(text, fontsize=SIZE, loc="left", y=1.0, pad=above)
    if title:
        figure.text(0.1 / size[0], 1.0 - 0.1 / size[1], title, fontsize=SIZE - 1, va="top")
    return figure, axes


def draw_over_time(ax, time, values, index: int, text: str) -> None:
    """A line, or where there are many instants a column of pixels the band of its values.

    Curves behind the first, ``index`` 0, are wider and lighter, so that all can be read.
    """
    style = {"color": COLOURS[index % len(COLOURS)], "zorder": 3.0 - 0.1 * index, "label": text}
    if len(time) <= _POINTS * _PIXELS:
        ax.plot(time, values, **_thickness(index), **style)
        return
    colour = style.pop("color")
    where, low, high = band(time, values, _PIXELS)
    ax.fill_between(where, low, high, facecolor=(colour, 0.3), edgecolor=colour, linewidth=0.7, **style)


def draw_spectrum(ax, frequency, curves: Sequence[tuple]) -> None:
    """Amplitudes (text, values (F,)) over a logarithmic axis of five decades."""
    from matplotlib.ticker import NullLocator

    top = 0.0
    for index, (text, values) in enumerate(curves):
        colour, top = COLOURS[index % len(COLOURS)], max(top, np.nanmax(values, initial=0.0))
        ax.plot(frequency, values, color=colour, zorder=3.0 - 0.1 * index, label=text, **_thickness(index))
    if top > 0.0:
        ax.set_yscale("log")
        ax.yaxis.set_minor_locator(NullLocator())
        ax.set_ylim(1e-5 * top, 2.0 * top)


def show_changes(ax) -> None:
    """Ordinate that does not reach zero, with whole numbers at its ticks, and does not blow up rounding."""
    low, high = ax.get_ylim()
    least = 0.5 * _LEAST * max(abs(low), abs(high))
    middle, half = 0.5 * low + 0.5 * high, max(0.5 * high - 0.5 * low, least)
    ax.set_ylim(middle - half, middle + half)
    ax.ticklabel_format(axis="y", useOffset=False)


def _thickness(index: int) -> dict[str, float]:
    return {"linewidth": _WIDTHS[min(index, 1)], "alpha": _ALPHAS[min(index, 1)]}


def band(time, values, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Least and largest of values (n,) in `count` pieces of the time, which share their ends.

    Returns
    -------
    middle, low, high : (count,) arrays
    """
    time, values = np.asarray(time), np.asarray(values)
    first = np.linspace(0, len(time) - 1, count + 1).astype(int)
    low, high = (one.reduceat(values, first[:-1]) for one in (np.minimum, np.maximum))
    # a piece ends where the next one begins: steep curves leave no gaps
    ends, middle = values[first[1:]], 0.5 * (time[first[:-1]] + time[first[1:]])
    return middle, np.minimum(low, ends), np.maximum(high, ends)


def drawable(values) -> np.ndarray:
    """Without what no axis can hold: matplotlib multiplies the limits."""
    values = np.array(values, float)
    values[~(np.abs(values) < _LARGEST)] = np.nan
    return values


def name_lines(ax, lines: Sequence[tuple], width: float) -> None:
    """Names (text, place) above the axes, moved aside as little as keeps them apart.

    `width` is that of the axes in the units of the places.
    """
    if not lines:
        return
    lines = sorted(lines, key=lambda line: line[1])
    at, apart = np.array([at for _, at in lines]), _NAME * width * np.arange(len(lines))
    # pushed to the right, pushed to the left: the mean is as far apart
    right = np.maximum.accumulate(at - apart) + apart
    left = np.minimum.accumulate((at - apart)[::-1])[::-1] + apart
    places = 0.5 * (right + left)
    for (text, at), place in zip(lines, places):
        ax.annotate(
            text, (at, 1.0), (place, 1.06), xycoords=ax.get_xaxis_transform(), rotation=90,
            textcoords=ax.get_xaxis_transform(), fontsize=SIZE - 3, ha="center", va="bottom",
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip


def finished(figure):
    """The figure with its legend."""
    legend_below(figure)
    return figure
