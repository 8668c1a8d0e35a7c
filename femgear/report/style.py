"""What all figures share: colours, sizes, legends outside the axes, files, and the lines of meshes."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from femgear.storage.files import write_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

# Okabe and Ito, "Color Universal Design" (2008): told apart with every kind of colour vision
BLUE, VERMILION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, BLACK, GREY = "#E69F00", "#56B4E9", "#000000", "#808080"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
DASHES = ("-", "--", "-.", ":")
MARKERS = "osD^vPX*<>"
SIZE = 11
WIDTH, SMALL = 8.0, SIZE - 1.5
"""Width of a figure [in] and its smallest text [pt], which is 8 pt on 170 mm of paper."""
STEMS = 4000
"""Lines of a spectrum that can be told apart, at most."""
POINTS = 4000
"""Points of a curve, at most; of more, every step of the abscissa keeps its largest and its smallest."""
_IDENTICAL, ALIKE = 1e-6, 2e-3
"""Shares of the largest value by which curves differ that are identical, or cannot be told apart."""
_APART = 0.1
"""Distance of names beside curves, as a share of the height of a panel."""
_DPI = 120
PNG_LEVEL = 3  # of zlib: a third faster than 6, files a fifteenth larger
_LEGEND_ROW = 0.21
"""Height of a row of the legend [in]."""


class Drawings(Mapping[str, "Figure"]):
    """Figures by name, each of which is drawn when it is asked for: an app shows few of many.

    Parameters
    ----------
    drawn : mapping of str to callable
        ``() -> Figure`` by the name of the figure, in their order.
    """

    def __init__(self, drawn: Mapping[str, Callable[[], Figure]]) -> None:
        self._drawn = dict(drawn)

    def __getitem__(self, name: str) -> Figure:
        return self._drawn[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._drawn)

    def __len__(self) -> int:
        return len(self._drawn)


def new_figure(
    *,
    rows: int = 1,
    columns: int = 1,
    width: float = WIDTH,
    height: float = 4.4,
    sharex: bool | Literal["row", "col"] = False,
    sharey: bool = False,
    polar: bool = False,
):
    """Make a figure outside pyplot, width and height in inches, and its axes as a flat list."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(
        rows,
        columns,
        squeeze=False,
        sharex=sharex,
        sharey=sharey,
        subplot_kw={"projection": "polar"} if polar else None,
    )
    cast("ConstrainedLayoutEngine", figure.get_layout_engine()).set(w_pad=0.08, h_pad=0.1)
    flat = list(axes.ravel())
    for ax in flat:
        ax.tick_params(labelsize=SIZE - 1)
        ax.grid(True, color="0.88", linewidth=0.8)
        ax.set_axisbelow(True)
        if not polar:
            ax.spines[["top", "right"]].set_visible(False)
    return figure, flat


def label(ax, x: str = "", y: str = "", title: str = "") -> None:
    """Set axis labels with units, and a title."""
    if x:
        ax.set_xlabel(x, fontsize=SIZE)
    if y:
        ax.set_ylabel(y, fontsize=SIZE)
    if title:
        ax.set_title(title, fontsize=SIZE, loc="left")


def draw_at_right(ax, x: np.ndarray, words: str, values: np.ndarray, *, colour: str = BLUE, dash: str = "-") -> None:
    """Draw values (n,) over places (n,) behind the curves of axes, with an ordinate of these words at the right."""
    right, finite = ax.twinx(), values[np.isfinite(values)]
    right.plot(x, np.where(np.isfinite(values), values, np.nan), dash, color=colour, linewidth=1.4)
    if len(finite):
        low, high = finite.min(), finite.max()
        # room above for names, and a step of ten at least
        right.set_ylim(low - 2.0, low + 1.45 * max(high - low, 10.0))
    right.grid(False)
    right.spines["top"].set_visible(False)
    right.tick_params(labelsize=SIZE - 1, colors=colour)
    right.set_ylabel(words, fontsize=SIZE, color=colour)
    ax.set_zorder(right.get_zorder() + 1)
    ax.patch.set_visible(False)


def legend_below(figure: Figure, ax=None, *, columns: int = 3) -> None:
    """Add one legend under the figure, where it hides nothing; entries of equal text appear once.

    The figure grows by the rows beyond the third, so that many entries leave the axes their size.
    """
    entries = {}
    for drawn_axes in figure.axes if ax is None else [ax]:
        for handle, text in zip(*drawn_axes.get_legend_handles_labels()):
            entries.setdefault(text, handle)
    if entries:
        rows = -(-len(entries) // columns)
        figure.set_figheight(figure.get_figheight() + _LEGEND_ROW * max(rows - 3, 0))
        figure.legend(
            entries.values(),
            entries.keys(),
            loc="outside lower center",
            ncols=min(columns, len(entries)),
            fontsize=SIZE - 1,
            frameon=False,
        )


def show_changes(ax, least: float) -> None:
    """Let the ordinate leave out zero, and span this share of its largest value at least."""
    low, high = ax.get_ylim()
    middle, half = 0.5 * low + 0.5 * high, max(0.5 * high - 0.5 * low, 0.5 * least * max(abs(low), abs(high)))
    ax.set_ylim(middle - half, middle + half)
    ax.ticklabel_format(axis="y", useOffset=False)


def name_curves(ax, *, at: float = 0.985) -> None:
    """Write the names of the curves above their ends, up to a share of the abscissa, in their colours.

    What names have in brackets is left out.
    """
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    end, step, free = left + at * (right - left), _APART * (high - low), -np.inf
    named = [line for line in ax.get_lines() if not str(line.get_label()).startswith("_")]
    texts = [str(line.get_label()).split(" (")[0] for line in named]
    inches, spans = ax.figure.get_figwidth() * ax.get_position().width, list[tuple[float, float]]()
    for line in named:
        # letters are little more than half as wide as high
        reach = end - 0.55 * SMALL / 72.0 * max(map(len, texts)) / inches * (right - left)
        beside = np.interp(np.linspace(reach, right, 50), line.get_xdata(), line.get_ydata())
        spans.append((float(beside.min()), float(beside.max())))
    for i in sorted(range(len(spans)), key=lambda i: spans[i][1]):
        free = max(spans[i][1], free + step)
        while crossed := [top for bottom, top in spans if bottom - step < free < top]:
            free = max(crossed)
        look = {"ha": "right", "va": "bottom", "fontsize": SMALL, "color": named[i].get_color()}
        ax.annotate(texts[i], (end, free), xytext=(0, 5), textcoords="offset points", **look)
    ax.set_ylim(low, max(high, free + step))


def stems(ax, x, amplitude, floor: float, *, text: str, colour: str = BLUE, width: float = 1.0) -> None:
    """Draw the lines of a spectrum that are higher than `floor`, from there.

    They have the places ``x`` (n,) and the heights ``amplitude`` (n,). Of more lines than there are pixels, the highest
    one of every column is drawn.
    """
    x, amplitude = np.asarray(x), np.asarray(amplitude)
    shown = _highest(x, amplitude, amplitude > floor)
    # one line with gaps takes a tenth of the time of `vlines`
    height = np.stack(np.broadcast_arrays(floor, amplitude[shown], np.nan), axis=1)
    line = {"color": colour, "linewidth": width, "solid_capstyle": "butt"}
    ax.plot(np.repeat(x[shown], 3), height.ravel(), label=text, **line)


def _highest(x, amplitude, shown) -> np.ndarray:
    """Find the numbers of the lines to draw, ascending; see `stems`."""
    numbers = np.flatnonzero(shown)
    if len(numbers) <= STEMS:
        return numbers
    column = np.minimum(((x[numbers] - x[0]) * (STEMS / np.ptp(x))).astype(int), STEMS - 1)
    # the last of a column in ascending order is its highest
    ranked = np.lexsort((amplitude[numbers], column))
    last = np.append(np.diff(column[ranked]) > 0, True)
    return numbers[ranked[last]]


def thinned(x, y) -> tuple[np.ndarray, np.ndarray]:
    """Leave out points of a long curve x, y (n,) that lie between the largest and the smallest of every step.

    Steps are of equal numbers of points, far narrower than a pixel of the widest picture. Parts between gaps
    (nan) stay parts; of more than can be told apart, the highest one of every column is kept. Curves that run
    backwards stay as they are.
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    finite = np.isfinite(x) & np.isfinite(y)
    if len(x) <= POINTS or np.any(np.diff(x[finite]) < 0.0):
        return x, y
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int)))
    parts = list(zip(edges[::2].tolist(), edges[1::2].tolist()))
    if len(parts) > STEMS:
        first = np.array([x[start] for start, _ in parts])
        highest = np.array([y[start:end].max() for start, end in parts])
        parts = [parts[i] for i in _highest(first, highest, np.ones(len(parts), bool))]
    share = POINTS / max(sum(end - start for start, end in parts), 1)
    kept = [_extremes(y, start, end, max(int(share * (end - start)), 4)) for start, end in parts]
    gap = np.full(1, np.nan)
    pieces = [np.append(values[numbers], gap) for values in (x, y) for numbers in kept]
    if not pieces:
        return x[:0], y[:0]
    # no gap after the last part
    return np.concatenate(pieces[: len(kept)])[:-1], np.concatenate(pieces[len(kept) :])[:-1]


def _extremes(y: np.ndarray, start: int, end: int, count: int) -> np.ndarray:
    """Find the numbers of the points of a part of a curve that are kept, about so many, ends included."""
    if end - start <= count:
        return np.arange(start, end)
    steps = np.linspace(start, end, max(count // 2, 1) + 1).astype(int)
    kept = [
        low + place
        for low, high in zip(steps[:-1].tolist(), steps[1:].tolist())
        for place in (int(y[low:high].argmin()), int(y[low:high].argmax()))
    ]
    return np.unique([start, *kept, end - 1])


def mark_mesh_harmonics(ax, step: float, *, words: bool = True) -> None:
    """Mark the harmonics of the mesh frequency above axes whose abscissa has them every `step`."""
    from matplotlib.ticker import MaxNLocator

    top = ax.secondary_xaxis("top", functions=(lambda x: x / step, lambda h: h * step))
    # so many that no number covers another
    nbins = max(int(20 * ax.get_position().width), 4)
    top.xaxis.set_major_locator(MaxNLocator(nbins, steps=[1, 2, 2.5, 5, 10], integer=True, prune="lower"))
    top.tick_params(labelsize=SMALL)
    top.set_zorder(3)
    if words:
        top.set_xlabel("harmonic of the mesh frequency [1]", fontsize=SIZE - 1)


def line_style(index: int) -> dict[str, str]:
    """Choose colour and dash of the line number `index`: neighbours differ in both, 28 lines in one."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": DASHES[index % len(DASHES)]}


def save_figure(figure: Figure, path: str | os.PathLike) -> None:
    """Write a figure as PNG; the file is either the old or the new one, whole."""
    write_bytes(png_bytes(figure), path)


def png_bytes(figure: Figure) -> bytes:
    """Draw the figure as PNG; the same figure gives the same bytes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    stream, engine, dpi = io.BytesIO(), figure.get_layout_engine(), figure.dpi
    canvas = FigureCanvasAgg(figure)
    figure.dpi = _DPI
    if engine is not None:
        # `savefig` would draw everything once to find the layout
        axes = [ax for ax in figure.axes if ax.get_subplotspec() and ax.get_aspect() == "auto"]
        for ax in axes:
            _measured_once(ax)
        engine.execute(figure)
        figure.set_layout_engine("none")
        for ax in axes:
            del ax.get_tightbbox
    try:
        canvas.print_png(stream, metadata={"Software": None}, pil_kwargs={"compress_level": PNG_LEVEL})
    finally:
        figure.dpi = dpi
        figure.set_layout_engine(engine)
    return stream.getvalue()


def _measured_once(ax) -> None:
    """Let axes measure their texts once in a layout that asks twice: then as much is around them."""
    from matplotlib.transforms import Bbox

    measure = ax.get_tightbbox
    around = cache(lambda: measure(for_layout_only=True).extents - ax.bbox.extents)
    ax.get_tightbbox = lambda *_, **__: Bbox.from_extents(ax.bbox.extents + around())


def family(name: str) -> str:
    """Tell the kind of a mesh from its label: ``"planet-ring"`` where the ring takes part; that of a pair."""
    return "planet-ring" if "ring" in name else name if name.startswith("gear 1") else "sun-planet"


def drawn_lines(
    names, values, *, partly: bool = False, within: float = _IDENTICAL, whole: str = ""
) -> list[tuple[str, int]]:
    """Choose the rows of `values` to draw, with their legend texts: one for a family of meshes, else each.

    The family is drawn as one where its rows (n, ...) differ by less than a millionth of the largest value,
    or another share ``within`` of it; ``partly`` does so for some meshes of a family, too; ``whole`` is what all
    of one are called, by default by their kind.
    """
    values, names = np.asarray(values), [str(name) for name in names]
    largest = np.abs(values).max(initial=0.0)
    lines = []
    for kind in dict.fromkeys(family(name) for name in names):
        rows = [i for i, name in enumerate(names) if family(name) == kind]
        groups: list[list[int]] = []
        for row in rows:
            alike = (
                members for members in groups if np.abs(values[row] - values[members[0]]).max() <= within * largest
            )
            if (group := next(alike, None)) is None:
                groups.append([row])
            else:
                group.append(row)
        if len(groups) > 1 and not partly:
            groups = [[row] for row in rows]
        for group in groups:
            same = np.abs(values[group] - values[group[0]]).max() <= _IDENTICAL * largest
            word = "identical" if same else "alike"
            everyone = whole or f"all {kind} meshes"
            called = everyone if len(group) == len(rows) else ", ".join(names[i] for i in group)
            lines.append((f"{called} ({word})" if len(group) > 1 else names[group[0]], group[0]))
    return lines


def periodic(position, values):
    """Append the first sample to positions (P,) and values (..., P) of whole periods: the curve closes."""
    position, values = np.asarray(position), np.asarray(values)
    length = np.floor(position[-1] - position[0]) + 1.0
    return np.append(position, length + position[0]), np.concatenate([values, values[..., :1]], axis=-1)


def position_words(position) -> str:
    """Name the axis of positions (n,) in mesh periods, which end with one period or with several."""
    return "position in the mesh period [1]" if position[-1] <= 1.0 else "position [mesh periods]"


def runs(chosen) -> list[slice]:
    """Find runs of chosen segments (n - 1,) of a curve, bool, as slices of its n points."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    return [slice(first, last + 1) for first, last in zip(edges[::2], edges[1::2])]


NOTICEABLE = 1.0
"""Change of the level by a longer excitation that is worth a warning [dB]."""


def excited_to(data, speed_index: int) -> str:
    """Write the highest frequency of the excitation [kHz] at a speed, for a title; empty if not known.

    And that it ends short, where ``level_change`` is known and `NOTICEABLE`.
    """
    if "excitation_limit" not in data:
        return ""
    words = f"excited up to {1e-3 * float(data['excitation_limit'].values[speed_index]):.4g} kHz"
    short = "level_change" in data and abs(data["level_change"].values[speed_index]) >= NOTICEABLE
    # a line of its own: titles are as wide as their pictures already
    return f"\n{words} alone (W-EXCITATION)" if short else f", {words}"


def digits(value: float) -> str:
    """Write a number to four digits, without exponent."""
    return f"{float(f'{value:.4g}'):.12g}"


def rpm(speed: float) -> str:
    """Write an input speed [rpm], as datasets have it, in a title."""
    return f"{float(speed):,.6g} rpm"


def xy(points):
    """Split complex points (n,) into both coordinates, (n,) each."""
    return points.real, points.imag
