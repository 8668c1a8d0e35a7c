"""Figures of the lumped planetary set: response branches, orbits, bearing forces, tooth contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femgear.plots.style import BLACK, COLOURS, GREY, label, legend_below, line_style, new_figure

# how parts of a curve are drawn and called, by what is known of them
STABILITY = {1: ("-", "stable"), 0: ("--", "not stable"), -1: (":", "stability not known")}


def response_branches(curves: Sequence[tuple], sweeps: Sequence[tuple] = (), *, quantity: str, x: str = ""):
    """Amplitude over frequency, dashed where the response is not stable, dotted where that is not known.

    Parameters
    ----------
    curves : sequence of (text, frequency (p,) [Hz], amplitude (p,) [m], stable (p,) bool or int)
        1 stable, 0 not stable, -1 not known.
    sweeps : sequence of (text, frequency (f,) [Hz], amplitude (f,) [m])
        Drawn as markers.
    quantity : str
        Of the ordinate, without its unit.
    x : str
        Label of the abscissa; the weight's frequency when not given.

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(width=8.5, height=5.0)
    for colour, (text, hertz, size, stable) in zip(COLOURS, curves):
        for wanted, (dash, note) in STABILITY.items():
            for number, part in enumerate(pieces(stable, wanted)):
                ax.plot(
                    hertz[part], 1e6 * size[part], color=colour, linestyle=dash,
                    label=None if number else text + (f", {note}" if wanted != 1 else ""),
                )  # fmt: skip
    for marker, (text, hertz, size) in zip("^vso", sweeps):
        ax.plot(hertz, 1e6 * size, marker, color=BLACK, markersize=4.5, fillstyle="none", label=text)
    ax.set_ylim(bottom=0.0)
    label(ax, x or "frequency of the weight in the carrier frame [Hz]", f"{quantity} [µm]")
    legend_below(figure, columns=2)
    return figure


def pieces(stable, wanted: int) -> list[slice]:
    """Runs of segments of a curve of one kind: 1 stable, 0 not stable, -1 not known.

    A segment is drawn once: unknown where one of its ends is, otherwise unstable where one is.
    """
    stable = np.asarray(stable, int)
    segment = np.minimum(stable[:-1], stable[1:]) == wanted
    edges = np.flatnonzero(np.diff(np.concatenate([[False], segment, [False]]).astype(int)))
    return [slice(first, last + 1) for first, last in zip(edges[::2], edges[1::2])]


def orbits(curves: Sequence[tuple], *, title: str = ""):
    """Paths of a member's centre in the carrier frame.

    Parameters
    ----------
    curves : sequence of (text, path (2, n) [m])

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(width=6.2, height=6.2)
    for number, (text, path) in enumerate(curves):
        closed = 1e6 * np.concatenate([path, path[:, :1]], axis=1)
        ax.plot(*closed, label=text, **line_style(number))
    ax.plot(0.0, 0.0, "+", color=GREY)
    ax.set_aspect("equal", adjustable="datalim")
    label(ax, "x [µm]", "y [µm]", title)
    legend_below(figure, columns=1)
    return figure


def bearing_forces(angle, curves: Sequence[tuple], *, title: str = ""):
    """Sizes of bearing forces over one turn of the weight against the carrier.

    Parameters
    ----------
    angle : (n,) array
        [rad]
    curves : sequence of (text, force (2, n) [N])

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure()
    for number, (text, force) in enumerate(curves):
        ax.plot(np.degrees(angle), 1e-3 * np.hypot(*force), label=text, **line_style(number))
    ax.set_xlim(0.0, 360.0)
    ax.set_xticks(np.arange(0.0, 361.0, 60.0))
    label(ax, "phase of the weight [°]", "force [kN]", title)
    legend_below(figure)
    return figure


def contact_over_frequency(hertz, shares, names: Sequence[str], *, title: str = ""):
    """Share of the cycle in which every flank touches: 1 in contact, 0 not.

    Parameters
    ----------
    hertz : (p,) array
        In the order of the branch [Hz].
    shares : (p, n) array
    names : (n,) sequence

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(rows=len(names), width=8.0, height=1.2 + 1.1 * len(names), sharex=True)
    for number, (ax, name) in enumerate(zip(axes, names)):
        ax.plot(hertz, np.asarray(shares)[:, number], color=COLOURS[number % len(COLOURS)])
        ax.set_ylim(-0.05, 1.05)
        label(ax, title=name)
    label(axes[0], title=f"{title}: {names[0]}" if title else names[0])
    label(axes[-1], "frequency of the weight in the carrier frame [Hz]")
    return figure


def contact_map(frequency, clearance, panels: Sequence[tuple], *, line: tuple | None = None):
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

    Returns
    -------
    Figure
    """
    from matplotlib import colormaps

    figure, axes = new_figure(columns=len(panels), width=5.6 * len(panels), height=4.6, sharey=True)
    colours = colormaps["viridis"].with_extremes(bad="0.75")
    for ax, (title, share) in zip(axes, panels):
        share = np.asarray(share, float)
        low, high = np.nanmin(share, initial=1.0), np.nanmax(share, initial=0.0)
        if high - low < 1e-9:
            title += f": {high:.3g} everywhere"
            low, high = 0.0, 1.0
        image = ax.pcolormesh(
            frequency, 1e6 * np.asarray(clearance), np.ma.masked_invalid(share.T), vmin=low, vmax=high,
            cmap=colours, shading="nearest",
        )  # fmt: skip
        if line is not None:
            ax.axhline(1e6 * line[1], color="white", linestyle="--", label=line[0])
            ax.annotate(
                line[0], (0.98, 1e6 * line[1]), xycoords=("axes fraction", "data"), xytext=(0, 3),
                textcoords="offset points", ha="right", color="white", fontsize=9,
                bbox={"boxstyle": "round,pad=0.15", "facecolor": "0.25", "edgecolor": "none", "alpha": 0.7},
            )  # fmt: skip
        label(ax, "frequency of the weight [Hz]", title=title)
        figure.colorbar(image, ax=ax).set_label("share of the cycle in contact [1]")
    label(axes[0], y="clearance of the carrier bearing [µm]")
    return figure
