"""Figures over frequency and speed: responses, Campbell diagram, waterfall, branches, sections, stability."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError
from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    ORANGE,
    SIZE,
    VERMILION,
    label,
    legend_below,
    line_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = "osD^vPX*"


def frequency_response(
    frequency, response, *, names: Sequence[str], quantity: str = "receptance", unit: str = "m/N", peaks=()
) -> Figure:
    """Amplitude (logarithmic) and phase over the frequency.

    Parameters
    ----------
    frequency : (F,) array
        [Hz]
    response : (F, k) complex array
    names : sequence of str
        One a curve.
    quantity, unit : str
        Of the response, for the axis.
    peaks : sequence of (frequency, amplitude)
        Resonances to mark.

    Returns
    -------
    Figure
    """
    frequency, response = np.asarray(frequency, float), _columns(response, len(names), frequency)
    figure, (top, bottom) = new_figure(rows=2, height=6.4, sharex=True)
    for i, name in enumerate(names):
        top.semilogy(frequency, np.abs(response[:, i]), linewidth=1.6, label=name, **line_style(i))
        bottom.plot(frequency, _phase(response[:, i]), linewidth=1.6, **line_style(i))
    if len(peaks):
        at, height = np.asarray(peaks, float).T
        top.plot(at, height, "o", color=BLACK, markerfacecolor="none", markersize=7, label="resonance")
    label(top, y=f"{quantity} [{unit}]")
    label(bottom, "frequency [Hz]", "phase [°]")
    bottom.set_ylim(-190, 190)
    bottom.set_yticks(np.arange(-180, 181, 90))
    top.set_xlim(frequency[0], frequency[-1])
    legend_below(figure)
    return figure


def campbell(
    speed, frequency, *, orders=(), order_names=None, whirl=None, critical=(), speed_unit: str = "rad/s"
) -> Figure:
    """Natural frequencies over the speed with lines of excitation.

    Parameters
    ----------
    speed : (p,) array
        In `speed_unit`.
    frequency : (p, m) array
        [Hz]
    orders : (k,) array
        Slopes of the lines [Hz per unit of speed].
    order_names : sequence of str, optional
    whirl : (p, m) array, optional
        Sense of the orbits: forward above 0.1, backward below -0.1, by the value at the last speed.
    critical : sequence of (speed, frequency)
        Intersections to mark.
    speed_unit : str

    Returns
    -------
    Figure
    """
    speed = np.asarray(speed, float)
    frequency = _columns(frequency, np.shape(frequency)[-1], speed)
    figure, (ax,) = new_figure(height=5.4)
    for i, one in enumerate(frequency.T):
        ax.plot(speed, one, linewidth=1.6, **_sense(None if whirl is None else np.asarray(whirl)[-1, i]))
    top = 1.05 * np.nanmax(frequency)
    for i, order in enumerate(orders):
        text = f"order {order:.5g}" if order_names is None else order_names[i]
        dash = (0, (6, 2) + (1, 2) * i)
        ax.plot(speed, order * speed, color=GREY, linewidth=1.2, linestyle=dash, label=text)
    if len(critical):
        at = np.asarray(critical, float).T
        ax.plot(*at, "o", color=BLACK, markerfacecolor="none", markersize=7, label="critical speed")
    ax.set_xlim(speed.min(), speed.max())
    ax.set_ylim(0, top)
    label(ax, f"speed [{speed_unit}]", "natural frequency [Hz]")
    legend_below(figure, columns=4)
    return figure


def _sense(value: float | None) -> dict:
    """Colour, dash and legend of a sense of whirl."""
    if value is None:
        return {"color": BLUE, "linestyle": "-", "label": "mode"}
    if value > 0.1:
        return {"color": BLUE, "linestyle": "-", "label": "forward whirl"}
    if value < -0.1:
        return {"color": VERMILION, "linestyle": "--", "label": "backward whirl"}
    return {"color": BLACK, "linestyle": ":", "label": "no whirl"}


def waterfall(
    speed,
    frequency,
    amplitude,
    *,
    speed_unit: str = "rpm",
    quantity: str = "amplitude",
    unit: str = "m",
    share: float = 0.25,
) -> Figure:
    """Spectra one behind the other, shifted upwards by their speed.

    Parameters
    ----------
    speed : (p,) array
        In `speed_unit`.
    frequency : (F,) or (p, F) array
        [Hz]
    amplitude : (p, F) array
        Not negative.
    speed_unit, quantity, unit : str
    share : float
        Height of the largest amplitude as a share of the range of speeds.

    Returns
    -------
    Figure
    """
    speed, amplitude = np.asarray(speed, float), np.asarray(amplitude, float)
    frequency = np.broadcast_to(np.asarray(frequency, float), amplitude.shape)
    if amplitude.ndim != 2 or len(speed) != len(amplitude) or len(speed) < 2:
        raise _shape_error(
            f"{len(speed)} speeds for amplitudes of shape {amplitude.shape}", "(speeds, frequencies)"
        )
    figure, (ax,) = new_figure(height=6.0)
    largest = amplitude.max(initial=0.0) or 1.0
    scale = share * np.ptp(speed) / largest
    for i in np.argsort(speed)[::-1]:
        line = speed[i] + scale * amplitude[i]
        # slower spectra stand in front and hide what is behind them
        ax.fill_between(frequency[i], speed[i], line, color="white", zorder=-speed[i] + speed.max() + 2)
        ax.plot(frequency[i], line, color=BLUE, linewidth=1.1, zorder=-speed[i] + speed.max() + 2)
    right = frequency.max() + 0.02 * np.ptp(frequency)
    ax.plot(
        [right] * 2, speed.max() - np.array([0.0, scale * largest]), color=BLACK, linewidth=2.5, clip_on=False
    )
    ax.annotate(
        f"{largest:.3g} {unit}", (right, speed.max() - 0.5 * scale * largest), xytext=(6, 0),
        textcoords="offset points", va="center", fontsize=SIZE - 1, annotation_clip=False,
    )  # fmt: skip
    ax.set_xlim(frequency.min(), right)
    ax.grid(False)
    label(ax, "frequency [Hz]", f"speed [{speed_unit}]", f"{quantity} [{unit}], bar: largest")
    return figure


def branch(
    frequency,
    amplitude,
    stable,
    *,
    folds=(),
    others=(),
    parameter: str = "frequency",
    parameter_unit: str = "Hz",
    quantity: str = "amplitude",
    unit: str = "m",
) -> Figure:
    """A branch of periodic solutions: stable parts drawn through, unstable ones dashed, folds marked.

    Parameters
    ----------
    frequency, amplitude : (p,) arrays
        Along the branch.
    stable : (p,) bool array
        A segment is unstable where one of its ends is.
    folds : sequence of (frequency, amplitude)
    others : sequence of (name, frequencies, amplitudes)
        Points of other bifurcations or of another method.
    parameter, parameter_unit, quantity, unit : str

    Returns
    -------
    Figure
    """
    x, y, stable = np.asarray(frequency, float), np.asarray(amplitude, float), np.asarray(stable, bool)
    if not x.shape == y.shape == stable.shape or x.ndim != 1:
        raise _shape_error(
            f"{x.shape} frequencies, {y.shape} amplitudes, {stable.shape} verdicts", "as many of each"
        )
    figure, (ax,) = new_figure(height=5.0)
    sound = stable[:-1] & stable[1:]
    for wanted, style in (
        (True, {"color": BLUE, "linestyle": "-", "linewidth": 2.0, "label": "stable"}),
        (False, {"color": VERMILION, "linestyle": "--", "linewidth": 1.6, "label": "unstable"}),
    ):
        places = np.flatnonzero(sound == wanted)
        for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if len(places) else []:
            ax.plot(x[run[0] : run[-1] + 2], y[run[0] : run[-1] + 2], **style)
    if len(folds):
        ax.plot(*np.asarray(folds, float).T, "o", color=BLACK, markersize=7, label="fold")
    for i, (name, at, height) in enumerate(others):
        marker, colour = _MARKERS[(i + 1) % len(_MARKERS)], COLOURS[(i + 2) % len(COLOURS)]
        ax.plot(at, height, marker, color=colour, markerfacecolor="none", label=name)
    label(ax, f"{parameter} [{parameter_unit}]", f"{quantity} [{unit}]")
    legend_below(figure, columns=4)
    return figure


def poincare_section(
    displacement, velocity, *, names=None, displacement_unit: str = "m", velocity_unit: str = "m/s"
) -> Figure:
    """Points of motions seen once a period.

    Parameters
    ----------
    displacement, velocity : (points,) or (k, points) arrays
    names : sequence of str, optional
        One a motion.
    displacement_unit, velocity_unit : str

    Returns
    -------
    Figure
    """
    x, v = np.atleast_2d(np.asarray(displacement, float)), np.atleast_2d(np.asarray(velocity, float))
    if x.shape != v.shape:
        raise _shape_error(f"{x.shape} displacements and {v.shape} velocities", "as many of both")
    figure, (ax,) = new_figure(width=6.6, height=5.6)
    for i in range(len(x)):
        size, colour = float(np.clip(60.0 / np.sqrt(x.shape[1]), 1.5, 7.0)), COLOURS[i % len(COLOURS)]
        ax.plot(
            x[i], v[i], _MARKERS[i % len(_MARKERS)], color=colour, markersize=size,
            markeredgewidth=0.0 if size < 4 else 1.4, markerfacecolor=colour if size < 4 else "none",
            label=None if names is None else names[i],
        )  # fmt: skip
    label(ax, f"displacement [{displacement_unit}]", f"velocity [{velocity_unit}]")
    legend_below(figure)
    return figure


def stability_chart(x, y, multiplier, *, x_label: str = "a [1]", y_label: str = "q [1]", curves=()) -> Figure:
    """Largest Floquet multiplier over two parameters, with the limit of stability.

    Parameters
    ----------
    x : (nx,) array
    y : (ny,) array
    multiplier : (ny, nx) array
        Magnitude of the largest multiplier: unstable above one.
    x_label, y_label : str
        With units.
    curves : sequence of (name, x, y)
        Limits from elsewhere, for comparison.

    Returns
    -------
    Figure
    """
    from matplotlib.colors import LogNorm

    x, y, size = np.asarray(x, float), np.asarray(y, float), np.asarray(multiplier, float)
    if size.shape != (len(y), len(x)):
        raise _shape_error(f"multipliers of shape {size.shape}", f"({len(y)}, {len(x)}): rows over y")
    figure, (ax,) = new_figure(height=5.4)
    limit = 1.0 + 1e-6
    unstable = np.ma.masked_less_equal(size, limit)
    if unstable.count():
        top = max(float(unstable.max()), 1.1)
        picture = ax.pcolormesh(
            x, y, unstable, cmap="cividis_r", norm=LogNorm(1.0, top), shading="nearest", rasterized=True
        )
        bar = figure.colorbar(picture, ax=ax)
        bar.set_label("largest Floquet multiplier where unstable [1]", fontsize=SIZE)
        if size.min() <= limit:
            ax.contour(x, y, size, levels=[limit], colors=BLACK, linewidths=1.2)
            ax.plot([], [], color=BLACK, linewidth=1.2, label="limit of stability")
    for i, (name, at, height) in enumerate(curves):
        ax.plot(at, height, color=(ORANGE, VERMILION)[i % 2], linestyle="--", linewidth=1.6, label=name)
    ax.set_xlim(x.min(), x.max())
    ax.set_ylim(y.min(), y.max())
    label(ax, x_label, y_label, "white: stable")
    legend_below(figure)
    return figure


def _phase(response: np.ndarray) -> np.ndarray:
    """Phase [deg] within +-180, broken where it jumps."""
    phase = np.degrees(np.angle(response))
    return np.where(np.abs(np.diff(phase, prepend=phase[0])) > 180.0, np.nan, phase)


def _columns(values, count: int, along: np.ndarray) -> np.ndarray:
    """Curves as columns, refused where their number or length is another."""
    values = np.asarray(values)
    values = values[:, None] if values.ndim == 1 else values
    if values.shape != (len(along), count):
        raise _shape_error(f"curves of shape {values.shape}", f"({len(along)}, {count})")
    return values


def _shape_error(message: str, limit: str) -> CaseError:
    return CaseError(message, code="E-SHAPE", limit=limit)
