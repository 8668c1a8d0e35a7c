"""Figures of impacts: amplitude and mean over frequency, contact states, sections and exponents, spectra."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    VERMILION,
    label,
    legend_below,
    new_figure,
)

# colours of no impact, one-sided and two-sided impact, and of states that are not known
STATE_COLOURS = (GREEN, ORANGE, VERMILION, GREY)
# parameters of a row up to which each is marked
_SPARSE = 80


def amplitude_and_mean(
    curves: Sequence[tuple], sweeps: Sequence[tuple] = (), *, x: str = "frequency ratio [1]",
    unit: str = "half backlash", title: str = "",
):  # fmt: skip
    """Amplitude and mean of a deflection over frequency, dashed where it is not known to be stable.

    Parameters
    ----------
    curves : sequence of (text, ratio (p,), amplitude (p,), mean (p,), stable (p,) bool)
    sweeps : sequence of (text, ratio (f,), amplitude (f,), mean (f,))
        Drawn as markers.
    x, unit, title : str

    Returns
    -------
    Figure
    """
    figure, (top, bottom) = new_figure(rows=2, width=8.5, height=7.0, sharex=True)
    for number, (text, ratio, amplitude, mean, stable) in enumerate(curves):
        colour, sound = COLOURS[number % len(COLOURS)], np.asarray(stable, bool)
        segment = sound[:-1] & sound[1:]
        for ax, value in ((top, amplitude), (bottom, mean)):
            for wanted, dash in ((True, "-"), (False, "--")):
                for part in _runs(segment == wanted):
                    ax.plot(ratio[part], value[part], dash, color=colour, linewidth=1.6)
        top.plot([], [], "-", color=colour, label=text)
    for marker, (text, ratio, amplitude, mean) in zip("^vso", sweeps):
        style = {"color": BLACK, "markersize": 4.5, "fillstyle": "none", "linestyle": ""}
        top.plot(ratio, amplitude, marker, label=text, **style)
        bottom.plot(ratio, mean, marker, **style)
    if not all(np.all(stable) for *_, stable in curves):
        top.plot([], [], "--", color=GREY, label="not stable")
    top.set_ylim(bottom=0.0)
    # a mean that hardly changes is shown as such, not as its rounding
    low, high = bottom.get_ylim()
    middle, half = 0.5 * (low + high), 0.05 * max(abs(low), abs(high))
    if high - low < 2.0 * half:
        bottom.set_ylim(middle - half, middle + half)
    bottom.ticklabel_format(axis="y", useOffset=False)
    label(top, y=f"amplitude [{unit}]", title=title)
    label(bottom, x, f"mean [{unit}]")
    legend_below(figure, columns=3)
    return figure


def state_bands(rows: Sequence[tuple], names: Sequence[str], *, x: str = "frequency ratio [1]"):
    """Contact state over frequency, one band a row.

    Parameters
    ----------
    rows : sequence of (text, parameter (p,), state (p,) int)
        Sweeps, or pieces of a curve between limit points.
    names : sequence of str
        Of states 0, 1 and 2, and of 3 where one is not known. A border is drawn halfway between two
        parameters; sparse rows show these as dots.

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(width=8.5, height=1.6 + 0.5 * len(rows))
    marked = False
    for place, (_, parameter, state) in enumerate(rows):
        order = np.argsort(parameter)
        at, value = np.asarray(parameter, float)[order], np.asarray(state)[order]
        edges = np.concatenate([at[:1], 0.5 * (at[1:] + at[:-1]), at[-1:]])
        for number, (low, high) in enumerate(pairwise(edges)):
            ax.barh(place, high - low, left=low, height=0.7, color=STATE_COLOURS[value[number]], linewidth=0)
        if len(at) <= _SPARSE:
            mark = {"marker": "|", "color": BLACK, "markersize": 5.0, "linestyle": "none"}
            ax.plot(at, np.full(len(at), place), **mark, label=None if marked else "computed ratios")
            marked = True
    present = {int(one) for _, _, state in rows for one in np.unique(state)}
    for number, (colour, name) in enumerate(zip(STATE_COLOURS, names)):
        if number < 3 or number in present:
            ax.barh([0], [0.0], color=colour, label=name)
    ax.set_yticks(range(len(rows)), [text for text, _, _ in rows])
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    label(ax, x)
    legend_below(figure, columns=3)
    return figure


def bifurcation_and_exponent(
    parameter, points, exponent, error, *, lowest=None, highest=None, x: str = "frequency ratio [1]",
    quantity: str = "x once a period [half backlash]",
):  # fmt: skip
    """Stroboscopic points over a parameter, and the largest Lyapunov exponent with its error below.

    Parameters
    ----------
    parameter : (p,) array
    points : (p, n) array
    exponent, error : (p,) arrays
        Per unit of time 1 / omega_n.
    lowest, highest : (p,) arrays, optional
        Extremes of the motion, drawn as thin lines.
    x, quantity : str

    Returns
    -------
    Figure
    """
    parameter, points = np.asarray(parameter, float), np.asarray(points, float)
    figure, (top, bottom) = new_figure(rows=2, width=8.5, height=7.0, sharex=True)
    top.plot(np.repeat(parameter, points.shape[1]), points.ravel(), ".", color=BLUE, markersize=1.6)
    for value, text in ((lowest, "smallest and largest x"), (highest, None)):
        if value is not None:
            top.plot(parameter, value, color=GREY, linewidth=0.9, label=text)
    for level, text in ((1.0, "flanks close"), (-1.0, None)):
        top.axhline(level, color=ORANGE, linestyle="--", linewidth=1.1, label=text)
    exponent = np.asarray(exponent, float)
    bottom.axhline(0.0, color=BLACK, linewidth=0.9)
    bottom.errorbar(
        parameter, exponent, yerr=error, color=VERMILION, linewidth=1.1, elinewidth=0.8, marker="o",
        markersize=3.0,
    )  # fmt: skip
    label(top, y=quantity)
    label(bottom, x, "largest exponent [$\\omega_n$]")
    legend_below(figure)
    return figure


def phase_sections(panels: Sequence[tuple], *, x: str = "x [half backlash]", y: str = "velocity"):
    """Stroboscopic sections side by side.

    Parameters
    ----------
    panels : sequence of (title, displacement (n,), velocity (n,))
    x, y : str

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(columns=len(panels), width=4.0 * len(panels), height=4.2)
    for ax, (title, displacement, velocity) in zip(axes, panels):
        # points that repeat lie on one another: draw each place large enough to be seen
        spread = max(np.ptp(displacement), np.ptp(velocity))
        size = 2.0 if spread > 1e-2 and len(np.unique(np.round(displacement, 3))) > 8 else 8.0
        ax.plot(displacement, velocity, "o", color=BLUE, markersize=size, markeredgewidth=0)
        if spread <= 1e-2:
            ax.set_xlim(np.mean(displacement) + np.array([-1.0, 1.0]))
            ax.set_ylim(np.mean(velocity) + np.array([-1.0, 1.0]))
        label(ax, x, title=title)
    label(axes[0], y=y)
    return figure


def line_spectrum(curves: Sequence[tuple], *, x: str = "frequency / mesh frequency [1]", y: str, floor=1e-4):
    """Lines of spectra as stems on a logarithmic scale.

    Parameters
    ----------
    curves : sequence of (text, frequency (L,), amplitude (L,))
    x, y : str
    floor : float
        Lowest value shown, relative to the largest.

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(width=8.5, height=4.4)
    top = max(np.max(amplitude) for _, _, amplitude in curves)
    for number, (text, frequency, amplitude) in enumerate(curves):
        shown = np.asarray(amplitude) > floor * top
        colour, at = COLOURS[number % len(COLOURS)], np.asarray(frequency)[shown]
        ax.vlines(at, floor * top, np.asarray(amplitude)[shown], color=colour, linewidth=1.4)
        ax.plot(at, np.asarray(amplitude)[shown], "osD^"[number % 4], color=colour, markersize=5, label=text)
    ax.set_yscale("log")
    ax.set_ylim(floor * top, 2.0 * top)
    label(ax, x, y)
    legend_below(figure)
    return figure


def _runs(chosen: np.ndarray) -> list[slice]:
    """Runs of chosen segments as slices of their points."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    return [slice(first, last + 1) for first, last in zip(edges[::2], edges[1::2])]
