"""Figures of drivetrains: mesh stiffness, deviations, contact forces, spectra, side bands, sensitivity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femgear.plots.style import BLACK, COLOURS, GREY, SIZE, label, legend_below, line_style, new_figure


def stiffness_series(phase, curves: Sequence[tuple], steps: Sequence[tuple], *, title: str = ""):
    """Mesh stiffness over the mesh period: the series and the rectangular wave that it stands for.

    Parameters
    ----------
    phase : (n,) array
        Fractions of the period.
    curves, steps : sequences of (text, stiffness (n,) [N/m])
        Series, and rectangular waves in the same order.

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(rows=1, columns=len(curves), width=4.2 * len(curves), height=3.8)
    for number, (ax, (text, values), (_, wave)) in enumerate(zip(axes, curves, steps)):
        scale, unit = (1e-9, "GN/m") if np.max(values) > 5e8 else (1e-6, "MN/m")
        ax.plot(phase, scale * np.asarray(wave), color=GREY, linewidth=1.4, label="rectangular")
        ax.plot(phase, scale * np.asarray(values), color=COLOURS[number], label="series")
        ax.set_xlim(phase[0], phase[-1])
        label(ax, "mesh period [1]", f"stiffness [{unit}]", text)
    if title:
        figure.suptitle(title, fontsize=SIZE)
    legend_below(figure)
    return figure


def over_time(time, panels: Sequence[tuple], *, unit: str, factor: float = 1.0, columns: int = 1):
    """Signals of several runs over time, one panel each.

    Parameters
    ----------
    time : (n,) array
        [s]
    panels : sequence of (title, curves)
        With curves a sequence of (text, values (n,)).
    unit : str
        After the factor, with the quantity.
    columns : int

    Returns
    -------
    Figure
    """
    rows = -(-len(panels) // columns)
    figure, axes = new_figure(rows=rows, columns=columns, width=5.2 * columns + 3.0, height=2.2 * rows + 0.8)
    for number, (ax, (title, curves)) in enumerate(zip(axes, panels)):
        for index, (text, values) in enumerate(curves):
            ax.plot(time, factor * np.asarray(values), color=COLOURS[index], linewidth=0.8, label=text)
        ax.axhline(0.0, color=GREY, linewidth=0.8)
        ax.set_xlim(time[0], time[-1])
        label(ax, "time [s]" if number >= len(panels) - columns else "", unit, title)
    for ax in axes[len(panels) :]:
        ax.set_visible(False)
    legend_below(figure)
    return figure


def spectra(
    frequency,
    panels: Sequence[tuple],
    *,
    lines: Sequence[tuple] = (),
    unit: str,
    factor: float = 1.0,
    x: str = "",
):
    """Amplitude spectra of several runs, one panel each, with named lines.

    Parameters
    ----------
    frequency : (F,) array
        [Hz] or orders.
    panels : sequence of (title, curves)
        With curves a sequence of (text, amplitude (F,)).
    lines : sequence of (text, frequency)
        Marked above the first panel and drawn through all.
    unit : str
    factor : float
    x : str
        Label of the abscissa, the frequency when not given.

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(rows=len(panels), width=9.5, height=2.3 * len(panels) + 1.2, sharex=True)
    for ax, (title, curves) in zip(axes, panels):
        for index, (text, values) in enumerate(curves):
            ax.semilogy(
                frequency, factor * np.asarray(values), linewidth=0.9, color=COLOURS[index], label=text
            )
        top = max(factor * np.max(values) for _, values in curves)
        ax.set_ylim(1e-5 * top, 2.0 * top)
        ax.set_xlim(frequency[0], frequency[-1])
        for _, at in lines:
            ax.axvline(at, color=GREY, linewidth=0.7, linestyle=":")
        label(ax, y=unit, title=title)
    for text, at in lines:
        if frequency[0] <= at <= frequency[-1]:
            axes[0].text(
                at, 1.02, text, transform=axes[0].get_xaxis_transform(), rotation=90, fontsize=SIZE - 3,
                ha="center", va="bottom",
            )  # fmt: skip
    if lines:
        axes[0].set_title(panels[0][0], fontsize=SIZE, loc="left", pad=34)
    label(axes[-1], x or "frequency [Hz]")
    legend_below(figure)
    return figure


def sensitivity(names: Sequence[str], quantities: Sequence[tuple], *, title: str = ""):
    """What assumed inputs do: quantity at half and at twice the input over that at the input itself.

    Parameters
    ----------
    names : (k,) sequence
    quantities : sequence of (text, ratio (k, 2))

    Returns
    -------
    Figure
    """
    count = len(names)
    figure, axes = new_figure(
        columns=len(quantities), width=3.6 * len(quantities) + 2.4, height=0.3 * count + 1.8, sharey=True
    )
    at = np.arange(count)[::-1]
    for ax, (text, ratio) in zip(axes, quantities):
        ratio = np.asarray(ratio, float)
        for side, (colour, note) in enumerate(((COLOURS[0], "lower input"), (COLOURS[1], "higher input"))):
            ax.barh(
                at + 0.18 - 0.36 * side, ratio[:, side] - 1.0, height=0.34, left=1.0, color=colour, label=note
            )
        ax.axvline(1.0, color=BLACK, linewidth=0.8)
        ax.set_yticks(at, names)
        label(ax, "ratio [1]", title=text)
    if title:
        figure.suptitle(title, fontsize=SIZE)
    legend_below(figure)
    return figure


def backlash_forces(time, curves: Sequence[tuple], *, title: str = ""):
    """Mesh force over a short time with and without contact loss.

    Parameters
    ----------
    time : (n,) array
        [s]
    curves : sequence of (text, force (n,) [N])

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(width=9.0, height=3.8)
    for number, (text, force) in enumerate(curves):
        ax.plot(time, 1e-3 * np.asarray(force), linewidth=1.2, label=text, **line_style(number))
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.set_xlim(time[0], time[-1])
    label(ax, "time [s]", "mesh force [kN]", title)
    legend_below(figure)
    return figure
