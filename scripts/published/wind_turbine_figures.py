"""Figures of the wind turbine sets: response branches, tooth contact over frequency and clearance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import BLACK, COLOURS, label, legend_below, line_style, new_figure
from femgear.trains.planar.figures import STABILITY, runs_of_one_kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def response_branches(curves: Sequence[tuple], sweeps: Sequence[tuple] = (), *, quantity: str) -> Figure:
    """Amplitude over frequency, dashed where the response is not stable, dotted where that is not known.

    Parameters
    ----------
    curves : sequence of (text, frequency (p,) [Hz], amplitude (p,) [m], stable (p,) bool or int)
        1 stable, 0 not stable, -1 not known.
    sweeps : sequence of (text, frequency (f,) [Hz], amplitude (f,) [m])
        Drawn as markers.
    quantity : str
        Of the ordinate, without its unit.
    """
    figure, (ax,) = new_figure(width=8.5, height=5.0)
    for colour, (text, hertz, size, stable) in zip(COLOURS, curves):
        for wanted, (dash, note) in STABILITY.items():
            for number, part in enumerate(runs_of_one_kind(stable, wanted)):
                ax.plot(
                    hertz[part],
                    1e6 * size[part],
                    color=colour,
                    linestyle=dash,
                    label=None if number else text + (f", {note}" if wanted != 1 else ""),
                )
    for marker, (text, hertz, size) in zip("^vso", sweeps):
        ax.plot(hertz, 1e6 * size, marker, color=BLACK, markersize=4.5, fillstyle="none", label=text)
    ax.set_ylim(bottom=0.0)
    label(ax, "frequency of the weight in the carrier frame [Hz]", f"{quantity} [µm]")
    legend_below(figure, columns=2)
    return figure


def contact_over_frequency(hertz, shares, names: Sequence[str], *, title: str = "") -> Figure:
    """Share of the cycle in which every flank touches: 1 in contact, 0 not.

    Parameters
    ----------
    hertz : (p,) array
        In the order of the branch [Hz].
    shares : (p, n) array
    names : (n,) sequence
    """
    figure, (ax,) = new_figure(width=8.5)
    for number, (name, share) in enumerate(zip(names, np.transpose(shares))):
        # wide below narrow: lines that coincide are all seen
        style = line_style(number) | {"linewidth": max(4.5 - 1.2 * number, 1.2)}
        ax.plot(hertz, share, label=f"{name}: up to {share.max():.2g}", **style)
    ax.set_ylim(-0.05, 1.05)
    label(ax, "frequency of the weight in the carrier frame [Hz]", "share of the cycle in contact [1]", title)
    legend_below(figure, columns=2)
    return figure


def contact_map(frequency, clearance, panels: Sequence[tuple], *, line: tuple | None = None) -> Figure:
    """Share of the cycle in which flanks touch, over frequency and clearance; every panel on its own scale.

    Parameters
    ----------
    frequency : (f,) array
        [Hz]
    clearance : (c,) array
        [m]
    panels : sequence of (title, share (f, c))
        nan where nothing was found: grey.
    line : (text, clearance), optional
        Marked clearance [m].
    """
    from matplotlib import colormaps

    figure, axes = new_figure(columns=len(panels), width=5.6 * len(panels), height=4.6, sharey=True)
    colours = colormaps["cividis"].with_extremes(bad="0.75")
    for ax, (title, share) in zip(axes, panels):
        share = np.asarray(share, float)
        low, high = np.nanmin(share, initial=1.0), np.nanmax(share, initial=0.0)
        if high - low < 1e-9:
            title += f": {high:.3g} everywhere"
            low, high = 0.0, 1.0
        image = ax.pcolormesh(
            frequency,
            1e6 * np.asarray(clearance),
            np.ma.masked_invalid(share.T),
            vmin=low,
            vmax=high,
            cmap=colours,
            shading="nearest",
        )
        if line is not None:
            ax.axhline(1e6 * line[1], color="white", linestyle="--", label=line[0])
            ax.annotate(
                line[0],
                (0.98, 1e6 * line[1]),
                xycoords=("axes fraction", "data"),
                xytext=(0, 3),
                textcoords="offset points",
                ha="right",
                color="white",
                fontsize=9,
                bbox={"boxstyle": "round,pad=0.15", "facecolor": "0.25", "edgecolor": "none", "alpha": 0.7},
            )
        label(ax, "frequency of the weight [Hz]", title=title)
        figure.colorbar(image, ax=ax).set_label("share of the cycle in contact [1]")
    label(axes[0], y="clearance of the carrier bearing [µm]")
    return figure
