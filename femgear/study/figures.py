"""Figures of the studies: transmission error over torque and relief, load sharing, searches, fronts, sweeps.

Functions take arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    VERMILION,
    label,
    legend_below,
    line_style,
    new_figure,
    periodic,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = ("sun-planet", "planet-ring")
QUARTER, LINE = 0.25, COLOURS[4]
"""Ratio at which a contour is drawn, and its colour."""
BEFORE = {"color": GREY, "linestyle": "--", "label": "before"}
AFTER = {"color": BLUE, "linestyle": "-", "label": "optimum"}


def harris_curves(torques, peak_to_peak, names, *, design: float | None = None) -> Figure:
    """Transmission error peak to peak over torque, one curve a relief.

    Parameters
    ----------
    torques : (T,) array
        Of the input [N m].
    peak_to_peak : (variants, 2, T) array
        Of sun-planet and planet-ring meshes [m].
    names : sequence of str
        Legend text of each variant.
    design : float, optional
        Torque to be marked [N m].
    """
    figure, axes = new_figure(columns=2, width=10.0, height=4.6, sharex=True)
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
        label(ax, "torque of the input [N m]", title=f"{KINDS[kind]} meshes")
    label(axes[0], y="transmission error peak to peak [µm]")
    legend_below(figure)
    return figure


def relief_contours(amounts, lengths, ratios, torques, *, optimum=None, design=None) -> Figure:
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
    levels = np.linspace(0.0, 1.5, 13)
    for ax, ratio, torque in zip(axes, ratios, torques):
        filled = ax.contourf(lengths, 1e6 * amounts, ratio, levels=levels, cmap="viridis", extend="max")
        if ratio.min() < QUARTER < ratio.max():
            ax.contour(lengths, 1e6 * amounts, ratio, levels=[QUARTER], colors=[LINE], linewidths=2.0)
            # a contour has no legend entry of its own
            ax.plot([], [], color=LINE, linewidth=2.0, label=f"{QUARTER:.0%} of unmodified")
        if optimum is not None:
            _mark(ax, optimum, own=design is None or np.isclose(torque, design), design=design)
        label(ax, "length [two-pair contact]", title=f"{torque:g} N m")
    label(axes[0], y="amount at the tips [µm]")
    bar = figure.colorbar(filled, ax=axes)
    bar.set_label("STE peak to peak over unmodified [1]")
    legend_below(figure)
    return figure


def _mark(ax, optimum, *, own: bool, design) -> None:
    """A full circle under the torque of the optimum, an open one under others."""
    amount, length = optimum
    name = "optimum" if own else f"chosen for {design:g} N m"
    name = f"optimum at {design:g} N m" if own and design is not None else name
    face = VERMILION if own else "white"
    style = {"color": VERMILION, "markerfacecolor": face, "markersize": 9, "markeredgewidth": 2.0}
    ax.plot(length, 1e6 * amount, "o", label=name, clip_on=False, **style)


def sharing_histogram(factors, names, n_planets: int) -> Figure:
    """Distribution of the load sharing factor, one step curve a support.

    Parameters
    ----------
    factors : sequence of (S,) arrays
        K_gamma of every sample.
    names : sequence of str
    n_planets : int
        The largest factor there can be.
    """
    figure, (left, right) = new_figure(columns=2, width=10.0, height=4.4)
    top = min(max(float(np.max(f)) for f in factors) * 1.02 + 0.02, float(n_planets) + 0.02)
    edges = np.linspace(0.99, max(top, 1.05), 80)
    for i, (factor, name) in enumerate(zip(factors, names)):
        share = 100.0 / len(factor)
        left.hist(
            factor, edges, weights=np.full(len(factor), share), histtype="step", label=name, **line_style(i)
        )
        ordered = np.sort(factor)
        beyond = 100.0 * (1.0 - np.arange(1, len(ordered) + 1) / len(ordered))
        right.step(ordered, beyond, where="post", label=name, **line_style(i))
    label(left, "load sharing factor K_gamma [1]", "samples [%]", "distribution")
    label(right, "load sharing factor K_gamma [1]", "samples beyond [%]", "probability to exceed")
    for ax in (left, right):
        ax.set_xlim(edges[0], edges[-1])
    # narrow and wide distributions side by side
    left.set_yscale("log")
    right.set_ylim(bottom=0)
    legend_below(figure)
    return figure


def before_and_after(position, errors, speed=None, forces=None, *, costs=()) -> Figure:
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
    columns = 1 + (speed is not None) + bool(len(costs))
    figure, axes = new_figure(columns=columns, width=4.2 * columns + 1.0, height=4.4)
    for values, style in zip(errors, (BEFORE, AFTER)):
        place, closed = periodic(position, 1e6 * (np.asarray(values) - np.mean(values)))
        axes[0].plot(place, closed, linewidth=1.6, **style)
    label(axes[0], "position [mesh periods]", "transmission error less its mean [µm]", "sun to ring, static")
    if speed is not None:
        for values, style in zip(forces, (BEFORE, AFTER)):
            axes[1].plot(speed, values, linewidth=1.6, **style)
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


def tolerance_bars(names: Sequence[str], less, more, value: float, *, quantity: str, unit: str) -> Figure:
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


def front(values, dominated, before, *, names: Sequence[str], compromise: int | None = None) -> Figure:
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
        ax.plot(
            *values[compromise], "o", color=VERMILION, markersize=10, fillstyle="none", label="compromise"
        )
    # designs far beyond both are of no interest
    right, top = 1.1 * np.maximum(values.max(axis=0), before)
    ax.set_xlim(0, right)
    ax.set_ylim(0, top)
    label(ax, *(fill(name, 44) for name in names))
    legend_below(figure)
    return figure


def sweep_curves(x, curves, *, names: Sequence[str], axis: str, quantities: Sequence[str]) -> Figure:
    """Quantities over the values of one entry, one panel each, one curve for each of the other entries.

    Parameters
    ----------
    x : (m,) array, or sequence of str
    curves : (k, m, q) array
        NaN where a case cannot be computed.
    names : sequence of k str
        Legend; one empty text for a single curve.
    axis : str
        Label of the x axis.
    quantities : sequence of q str
        With units.
    """
    curves, count = np.asarray(curves, float), len(quantities)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure, axes = new_figure(rows=rows, columns=columns, width=4.4 * columns + 0.6, height=3.6 * rows + 0.6)
    for q, name in enumerate(quantities):
        for k, one in enumerate(curves):
            legend = {"label": names[k]} if names[k] else {}
            axes[q].plot(x, one[:, q], marker="o", markersize=4, **line_style(k), **legend)
        label(axes[q], axis, fill(name, 36))
    for ax in axes[count:]:
        ax.set_visible(False)
    legend_below(figure)
    return figure
