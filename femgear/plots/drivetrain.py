"""Figures of drivetrains: mesh stiffness, deviations, contact forces, spectra, side bands, sensitivity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femgear.plots.drivetrain_panels import (
    draw_over_time,
    draw_spectrum,
    drawable,
    finished,
    name_lines,
    panels,
    show_changes,
)
from femgear.plots.style import BLACK, COLOURS, GREY, SIZE, label, legend_below, new_figure


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
    figure, axes = panels(
        [text for text, _ in curves], columns=len(curves), width=3.1, height=2.4, x="mesh period [1]",
        y=[f"stiffness [{_unit(values)[1]}]" for _, values in curves], title=title,
    )  # fmt: skip
    for number, (ax, (_, values), (_, wave)) in enumerate(zip(axes, curves, steps)):
        scale, colour = _unit(values)[0], COLOURS[number % len(COLOURS)]
        ax.plot(phase, scale * np.asarray(wave), color=GREY, linewidth=1.4, label="rectangular")
        ax.plot(phase, scale * np.asarray(values), color=colour, label="series")
        ax.set_xlim(phase[0], phase[-1])
    return finished(figure)


def _unit(values) -> tuple[float, str]:
    return (1e-9, "GN/m") if np.max(values) > 5e8 else (1e-6, "MN/m")


def over_time(
    time,
    signals: Sequence[tuple],
    *,
    unit: str,
    factor: float = 1.0,
    columns: int = 1,
    title: str = "",
    zero: bool = True,
):
    """Signals of several runs over time, one panel each; the first run stands in front.

    Where there are many more instants than pixels, the band between the least and the largest value of every
    column of pixels is drawn.

    Parameters
    ----------
    time : (n,) array
        [s]
    signals : sequence of (title, curves)
        With curves a sequence of (text, values (n,)).
    unit : str
        After the factor, with the quantity.
    columns : int
    title : str
        Above all panels.
    zero : bool
        Draw zero; False shows changes of what is far from it.

    Returns
    -------
    Figure
    """
    figure, axes = panels(
        [text for text, _ in signals], columns=columns, width=7.0 if columns == 1 else 5.2, x="time [s]",
        y=[unit] * len(signals), title=title,
    )  # fmt: skip
    time = np.asarray(time)
    for ax, (_, curves) in zip(axes, signals):
        for index, (name, values) in enumerate(curves):
            draw_over_time(ax, time, factor * drawable(values), index, name)
        ax.set_xlim(time[0], time[-1])
        if zero:
            ax.axhline(0.0, color=GREY, linewidth=0.8)
        else:
            show_changes(ax)
    return finished(figure)


def spectra(
    frequency,
    signals: Sequence[tuple],
    *,
    lines: Sequence[tuple] = (),
    unit: str,
    factor: float = 1.0,
    x: str = "",
    title: str = "",
):
    """Amplitude spectra of several runs, one panel each, with named lines; the first run stands in front.

    Parameters
    ----------
    frequency : (F,) array
        [Hz] or orders.
    signals : sequence of (title, curves)
        With curves a sequence of (text, amplitude (F,)).
    lines : sequence of (text, frequency)
        Marked above the first panel and drawn through all.
    unit : str
    factor : float
    x : str
        Label of the abscissa, the frequency when not given.
    title : str
        Above all panels.

    Returns
    -------
    Figure
    """
    frequency = np.asarray(frequency)
    lines = [(text, at) for text, at in lines if frequency[0] <= at <= frequency[-1]]
    figure, axes = panels(
        [text for text, _ in signals], width=8.3, x=x or "frequency [Hz]", y=[unit] * len(signals),
        title=title, named=bool(lines),
    )  # fmt: skip
    for ax, (_, curves) in zip(axes, signals):
        draw_spectrum(ax, frequency, [(name, factor * drawable(values)) for name, values in curves])
        for _, at in lines:
            ax.axvline(at, color=GREY, linewidth=0.7, linestyle=":")
    axes[0].set_xlim(frequency[0], frequency[-1])
    name_lines(axes[0], lines, float(np.ptp(frequency)))
    return finished(figure)


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
    """Mesh force over a short time with and without contact loss; the first run stands in front.

    Parameters
    ----------
    time : (n,) array
        [s]
    curves : sequence of (text, force (n,) [N])

    Returns
    -------
    Figure
    """
    return over_time(time, [(title, curves)], unit="mesh force [kN]", factor=1e-3)
