"""The figures of design commands: Harris map, map of a relief, course and tolerances of a search, Pareto front."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np

from femgear.findings import percent
from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    MARKERS,
    VERMILION,
    label,
    legend_below,
    line_style,
    new_figure,
    periodic,
)

KINDS = ("sun-planet", "planet-ring")
"""Of mesh."""


def harris_curves(torques, peak_to_peak, names, *, design: float | None = None, kinds=KINDS):
    """Transmission error peak to peak over torque, one curve a relief.

    Parameters
    ----------
    torques : (T,) array
        Of the input [N m].
    peak_to_peak : (variants, kinds, T) array
        Of the kinds of mesh [m].
    names : sequence of str
        Legend text of each variant.
    design : float, optional
        Torque to be marked [N m].
    """
    figure, axes = new_figure(columns=len(kinds), width=5.0 * len(kinds), height=4.6, sharex=True)
    # one torque is no line
    marker = {"marker": "o"} if len(torques) == 1 else {}
    for kind, ax in enumerate(axes):
        curves = 1e6 * peak_to_peak[:, kind]
        # a relief of the sun side hardly changes the other meshes
        if len(curves) > 1 and np.ptp(curves, axis=0).max() < 0.01 * curves.max():
            ax.plot(torques, curves[0], label="all reliefs (within 1 %)", color=BLACK, **marker)
        else:
            for v, name in enumerate(names):
                ax.plot(torques, curves[v], label=name, **line_style(v), **marker)
        if design is not None:
            ax.axvline(design, color="0.5", linewidth=1.0, label=f"{design:g} N m")
        ax.set_ylim(bottom=0)
        label(ax, "torque of the input [N m]", title=f"{kinds[kind]} meshes")
    label(axes[0], y="transmission error peak to peak [µm]")
    legend_below(figure)
    return figure


def relief_contours(amounts, lengths, ratios, torques, *, optimum=None, design=None):
    """Transmission error peak to peak over that without relief, over amount and length of the relief.

    Parameters
    ----------
    amounts : (A,) array
        [m]
    lengths : (L,) array
        In lengths of two-pair contact.
    ratios : (T, A, L) array
    torques : (T,) array
        Of the input [N m].
    optimum : (float, float), optional
        Amount [m] and length to be marked.
    design : float, optional
        Torque [N m] the optimum was found at; under the others it is marked as chosen.
    """
    figure, axes = new_figure(
        columns=len(torques), width=max(3.9 * len(torques), 6.0), height=4.4, sharex=True, sharey=True
    )
    # ratio at which a contour is drawn
    quarter, levels = 0.25, np.linspace(0.0, 1.5, 13)
    for ax, ratio, torque in zip(axes, ratios, torques):
        filled = ax.contourf(lengths, 1e6 * amounts, ratio, levels=levels, cmap="viridis", extend="max")
        if ratio.min() < quarter < ratio.max():
            ax.contour(lengths, 1e6 * amounts, ratio, levels=[quarter], colors=[COLOURS[4]], linewidths=2.0)
            # a contour has no legend entry of its own
            ax.plot([], [], color=COLOURS[4], linewidth=2.0, label=f"{percent(quarter)} of unmodified")
        if optimum is not None:
            _mark(ax, optimum, at_this_torque=design is None or np.isclose(torque, design), design=design)
        label(ax, "length [two-pair contact]", title=f"{torque:g} N m")
    label(axes[0], y="amount at the tips [µm]")
    bar = figure.colorbar(filled, ax=axes)
    bar.set_label("STE peak to peak over unmodified [1]")
    legend_below(figure)
    return figure


def _mark(ax, optimum, *, at_this_torque: bool, design) -> None:
    """A full circle under the torque of the optimum, an open one under others."""
    amount, length = optimum
    name = "optimum" if at_this_torque else f"chosen for {design:g} N m"
    name = f"optimum at {design:g} N m" if at_this_torque and design is not None else name
    face = VERMILION if at_this_torque else "white"
    style = {"color": VERMILION, "markerfacecolor": face, "markersize": 9, "markeredgewidth": 2.0}
    ax.plot(length, 1e6 * amount, "o", label=name, clip_on=False, **style)


def before_and_after(position, errors, speed=None, forces=(), *, costs=()):
    """Transmission error over the mesh period, dynamic mesh force over speed, and course of the search.

    Parameters
    ----------
    position : (P,) array
        In mesh periods.
    errors : sequence of two (P,) arrays
        From sun to ring [m], before and after; their means are taken off.
    speed : (S,) array, optional
        Of the input [rpm].
    forces : sequence of two (S,) arrays, optional
        Largest dynamic part of any mesh [N].
    costs : (designs,) array
        Objective over that of the case, in the order of the search; NaN for designs outside the limits.
    """
    styles = (
        {"color": GREY, "linestyle": "--", "label": "before"},
        {"color": BLUE, "linestyle": "-", "label": "optimum"},
    )
    columns = 1 + (speed is not None) + bool(len(costs))
    figure, axes = new_figure(columns=columns, width=4.2 * columns + 1.0, height=4.4)
    for values, line in zip(errors, styles):
        place, closed = periodic(position, 1e6 * (np.asarray(values) - np.mean(values)))
        axes[0].plot(place, closed, linewidth=1.6, **line)
    label(axes[0], "position [mesh periods]", "transmission error less its mean [µm]", "sun to ring, static")
    if speed is not None:
        for values, line in zip(forces, styles):
            axes[1].plot(speed, values, linewidth=1.6, **line)
        axes[1].set_ylim(bottom=0)
        label(axes[1], "speed of the input [rpm]", "largest deviation from the mean [N]", "mesh force")
    if len(costs):
        _course(axes[-1], np.asarray(costs, float))
    legend_below(figure)
    return figure


def _course(ax, costs: np.ndarray) -> None:
    """Every design, and the best so far."""
    number = np.arange(1, len(costs) + 1)
    best = np.minimum.accumulate(np.where(np.isfinite(costs), costs, np.inf))
    shown = np.isfinite(best)
    ax.semilogy(number, costs, ".", color=GREY, markersize=4, label="designs")
    ax.step(number[shown], best[shown], where="post", color=VERMILION, linewidth=1.6, label="best so far")
    label(ax, "design", "objective over that of the case [1]", "search at few positions")


def tolerance_bars(names: Sequence[str], less, more, value: float, *, quantity: str, unit: str):
    """What the objective becomes with each variable off by its tolerance.

    Parameters
    ----------
    names : sequence of str
        Variables with their tolerances.
    less, more : (n,) arrays
        Objective with the variable lower and higher, in `unit`; NaN leaves a bar out.
    value : float
        Of the optimum.
    quantity, unit : str
    """
    n = len(names)
    figure, (ax,) = new_figure(width=9.0, height=1.4 + 0.45 * n)
    place = np.arange(n)[::-1]
    for values, shift, colour, text in ((less, 0.19, BLUE, "less"), (more, -0.19, VERMILION, "more")):
        values = np.asarray(values, float)
        ax.barh(place + shift, values, height=0.36, color=colour, label=text)
    ax.axvline(value, color=BLACK, linewidth=1.2, label="optimum")
    ax.set_yticks(place, names)
    ax.grid(False, axis="y")
    label(ax, f"{quantity} [{unit}]")
    legend_below(figure)
    return figure


def front_figure(values, dominated, before, *, names: Sequence[str], compromise: int | None = None):
    """Pareto front with the other designs.

    Parameters
    ----------
    values : (m, 2) array
        Front, in the units of `names`.
    dominated : (k, 2) array
    before : (2,) array
        The case as it is.
    names : sequence of two str
        Axis labels with units.
    compromise : int, optional
        Row of the front to be marked.
    """
    values, dominated = np.asarray(values, float), np.asarray(dominated, float).reshape(-1, 2)
    figure, (ax,) = new_figure(width=7.0, height=4.8)
    ax.plot(*dominated.T, ".", color="0.75", markersize=4, label="other designs")
    ax.step(*values.T, where="post", color=BLUE, linewidth=1.2)
    ax.plot(*values.T, "o", color=BLUE, markersize=5, label="front")
    ax.plot(*before, "s", color=BLACK, markersize=7, label="before")
    if compromise is not None:
        ax.plot(*values[compromise], "o", color=VERMILION, markersize=10, fillstyle="none", label="compromise")
    # designs far beyond both are of no interest
    right, top = 1.1 * np.maximum(values.max(axis=0), before)
    ax.set_xlim(0, right)
    ax.set_ylim(0, top)
    label(ax, *(fill(name, 44) for name in names))
    legend_below(figure)
    return figure


LABEL_WIDTH, LABEL_HEIGHT, LABEL_LINE = 0.3, 0.06, 13.0
"""Size of a name in `size_and_error` over the ranges of both axes, and the step from line to line [points]."""


def size_and_error(
    volumes: Sequence[float],
    errors: Sequence[float],
    names: Sequence[str],
    *,
    left: Sequence[str],
    front: Sequence[int],
):
    """Transmission error of teeth over their size, with the front of both.

    Parameters
    ----------
    volumes, errors : sequences of float
        [cm^3] and peak to peak [µm].
    names : sequence of str
        Teeth and planets, written beside those of the front.
    left : sequence of str
        What the first mesh harmonic leaves, "" of a pair.
    front : sequence of int
        Places of the front, by size.
    """
    figure, (ax,) = new_figure(width=8.0, height=5.2)
    kinds = {"torque": VERMILION, "lateral force": BLUE, "nothing": GREEN, "": BLUE}
    ax.step([volumes[n] for n in front], [errors[n] for n in front], where="post", color=GREY, linewidth=1.2)
    for number, kind in enumerate(kind for kind in kinds if kind in left):
        places = [n for n, of_teeth in enumerate(left) if of_teeth == kind]
        ax.plot(
            [volumes[n] for n in places],
            [errors[n] for n in places],
            MARKERS[number],
            color=kinds[kind],
            label=f"leaves {kind}" if kind else "pairs",
        )
    top = 1.15 * max(errors)
    ax.set_ylim(-0.05 * top, top)
    span = max(volumes) - min(volumes) or max(volumes)
    ax.set_xlim(min(volumes) - 0.25 * span, max(volumes) + 0.08 * span)
    # below the front, on the side of less volume, there are no other teeth
    lines = 0
    for number, place in enumerate(front):
        # a name beside another one has a line of its own
        before = front[max(number - 1, 0)]
        near = volumes[place] - volumes[before] < LABEL_WIDTH * span
        near &= errors[before] - errors[place] < LABEL_HEIGHT * top
        lines = lines + 1 if number and near else 0
        at = {"xytext": (-6.0, -4.0 - LABEL_LINE * lines), "textcoords": "offset points"}
        ax.annotate(names[place], (volumes[place], errors[place]), **at, ha="right", va="top")
    title = "what planets leave of the first mesh harmonic" if any(left) else ""
    label(ax, "volume [cm³]", "transmission error peak to peak [µm]", title)
    legend_below(figure)
    return figure
