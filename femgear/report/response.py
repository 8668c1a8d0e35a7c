"""Figures of modes and periodic responses: shapes, Campbell diagram, transmission errors, sweeps over speed.

They draw datasets of results, of whatever train; helpers for figures over the mesh period stand beside them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    MARKERS,
    SIZE,
    VERMILION,
    distinct_lines,
    excited_to,
    family,
    label,
    legend_below,
    line_style,
    new_figure,
    periodic,
    rpm,
    xy,
)
from femgear.system.fourier import fluctuation

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.gears.planetary import PlanetarySet

_READ = 500
"""Speeds that are read at once where all are looked at."""
_MANY_SPEEDS = 3
"""More speeds are drawn over the speed, too."""
_DECADES, _MOST_BARS = 1e-5, 60
"""Spectra end so far below their largest line, and have bars up to so many."""
_CIRCLE = np.linspace(0.0, 2 * np.pi, 241)
"""Angles of the outlines of bodies [rad]."""
MODE_CAPTIONS = {
    "mode_shapes": (
        "Mode shapes with mean mesh stiffness: bodies with a mark of their rotation, and the outer "
        "surface of the ring; at rest in grey."
    ),
}
"""Of `mode_shapes`."""
RESPONSE_CAPTIONS = {
    "dynamic_transmission_error": (
        "Dynamic transmission error over one mesh period (thick) beside the static one of the set on its "
        "supports, both without their mean. The thin static curve has the harmonics of the excitation "
        "alone: what rings in both curves is the cut series, not vibration. Pale: the whole static curve."
    ),
    "dynamic_spectrum": (
        "Harmonics of the dynamic transmission error, down to five decades below the largest."
    ),
    "speed_sweep": (
        "Fluctuation of the transmission error over the speed, and the verdicts on the solution: the fixed "
        "point contracts below 1, the motion is stable up to 1."
    ),
}
"""Of `response_figures`."""


def mode_shapes(
    modes: xr.Dataset, planetary_set: PlanetarySet, *, shown: Sequence[int] | None = None, scale: float = 0.16
) -> Figure:
    """Draw bodies and outer ring surface in their undeformed (grey) and displaced positions.

    The modes have ``shape`` (dof, mode), ``frequency`` [Hz], ``kind``, ``nodal_diameter`` and, where there is
    an elastic ring, ``ring_shape_real`` and ``ring_shape_imag`` (mode, circumferential). Those ``shown`` are
    numbers from 0, by default the first twelve that are no rigid-body motions; ``scale`` is the largest
    displacement as a share of the ring's outer radius.
    """
    frequency = modes["frequency"].values
    elastic = np.flatnonzero(frequency > 1e-3 * frequency.max(initial=0.0) / max(len(frequency), 1))
    shown = [int(mode) for mode in (elastic[:12] if shown is None else shown)]
    columns = max(min(4, len(shown)), 1)
    rows = max(-(-len(shown) // columns), 1)
    figure, axes = new_figure(rows=rows, columns=columns, width=2.5 * columns, height=2.75 * rows + 0.5)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for ax, mode in zip(axes, shown):
        _draw_mode(ax, modes, planetary_set, mode, scale)
    legend_below(figure, columns=5)
    return figure


def _draw_mode(ax, modes, planetary_set, mode, scale):
    """Draw one mode: bodies with a spoke each, the carrier by its pins, the ring by its outer surface."""
    shape = dict(zip((str(name) for name in modes["dof"].values), modes["shape"].values[:, mode]))
    outer = planetary_set.ring.rim_radius
    ring = _ring_radial(modes, mode)
    bodies = _bodies(planetary_set)
    largest = np.abs(ring).max()
    for name, radius in (("ring", outer), *((name, body[1]) for name, body in bodies.items())):
        x, y, turn = _motion(shape, name)
        largest = max(largest, np.hypot(x, y), abs(turn) * radius)
    factor = scale * outer / largest if largest > 0 else 0.0
    circle = np.exp(1j * _CIRCLE)
    ax.plot(*xy(outer * circle), color="0.8", linewidth=1.0, label="at rest")
    rigid = _motion(shape, "ring")
    shift, turn = factor * (rigid[0] + 1j * rigid[1]), factor * rigid[2]
    ax.plot(
        *xy((outer + factor * ring) * circle + shift),
        color=BLACK,
        linewidth=1.8,
        label="ring, outer surface",
    )
    if "ring: rotation" in shape:
        # a rigid ring shows its rotation by a mark in its rim
        mark = np.array([0.9, 1.0]) * outer
        ax.plot(*xy(1j * mark), color="0.8", linewidth=1.0)
        ax.plot(*xy(shift + 1j * mark * np.exp(1j * turn)), color=BLACK, linewidth=1.8)
    for name, (centre, radius, colour, text) in bodies.items():
        x, y, turn = _motion(shape, name)
        moved = centre + factor * (x + 1j * y)
        spoke = np.exp(1j * (np.angle(centre) if centre else 0.0)) * radius
        if name == "carrier":
            _draw_carrier(ax, planetary_set, moved, factor * turn, colour)
            continue
        ax.plot(*xy(centre + radius * circle), color="0.8", linewidth=1.0)
        ax.plot(*xy(np.array([centre, centre + spoke])), color="0.8", linewidth=1.0)
        ax.plot(*xy(moved + radius * circle), color=colour, linewidth=1.6, label=text)
        ax.plot(
            *xy(np.array([moved, moved + spoke * np.exp(1j * factor * turn)])), color=colour, linewidth=1.6
        )
    span = 1.24 * outer
    ax.set_xlim(-span, span)
    ax.set_ylim(-span, span)
    diameter = int(modes["nodal_diameter"].values[mode])
    text = f"mode {mode + 1}: {modes['frequency'].values[mode]:.5g} Hz\n{modes['kind'].values[mode]}"
    ax.set_title(text + (f", n = {diameter}" if diameter >= 0 else ""), fontsize=SIZE - 1.5)


def _draw_carrier(ax, planetary_set, moved, turn, colour):
    """Draw displaced pins, each joined to the centre of the carrier."""
    pins = planetary_set.centre_distance * np.exp(1j * np.asarray(planetary_set.planet_angles, float))
    pins = moved + pins * np.exp(1j * turn)
    for pin in pins:
        ax.plot(*xy(np.array([moved, pin])), color=colour, linewidth=1.2, linestyle="--", label="carrier")
    ax.plot(*xy(pins), "o", color=colour, markersize=3)


def _bodies(planetary_set):
    """Tell centre, radius, colour and legend of every rigid body."""
    bodies = {"carrier": (0j, planetary_set.centre_distance, GREEN, "carrier")}
    bodies["sun"] = (0j, planetary_set.sun.reference_radius, VERMILION, "sun")
    for n, angle in enumerate(planetary_set.planet_angles):
        centre = planetary_set.centre_distance * np.exp(1j * float(angle))
        bodies[f"planet {n + 1}"] = (centre, planetary_set.planet.reference_radius, BLUE, "planets")
    return bodies


def _motion(shape, name):
    """Find displacement and rotation of a body in a mode; zero where it does not move."""
    return tuple(float(shape.get(f"{name}: {axis}", 0.0)) for axis in ("x", "y", "rotation"))


def _ring_radial(modes, mode):
    """Compute the radial displacement of the outer surface at the angles of `_CIRCLE`."""
    if "ring_shape_real" not in modes:
        return np.zeros_like(_CIRCLE)
    n = modes["circumferential"].values
    value = modes["ring_shape_real"].values[mode] + 1j * modes["ring_shape_imag"].values[mode]
    return (np.exp(1j * np.outer(_CIRCLE, n)) @ value).real


def campbell(speed, frequency, *, orders, order_names, critical, speed_unit: str) -> Figure:
    """Draw natural frequencies over the speed with lines of excitation: a Campbell diagram.

    Frequencies (p, m) [Hz] at speeds (p,) in ``speed_unit``; orders (k,) are slopes of the lines [Hz per unit
    of speed]; ``critical`` are intersections to mark, pairs of speed and frequency [Hz].
    """
    figure, (ax,) = new_figure(height=5.4)
    for one in np.transpose(frequency):
        ax.plot(speed, one, linewidth=1.6, color=BLUE, label="mode")
    for i, (order, text) in enumerate(zip(orders, order_names)):
        dash = (0, (6, 2) + (1, 2) * i)
        ax.plot(speed, order * speed, color=GREY, linewidth=1.2, linestyle=dash, label=text)
    if len(critical):
        at = np.asarray(critical, float).T
        ax.plot(*at, "o", color=BLACK, markerfacecolor="none", markersize=7, label="critical speed")
    ax.set_xlim(np.min(speed), np.max(speed))
    ax.set_ylim(0, 1.05 * np.nanmax(frequency))
    label(ax, f"speed [{speed_unit}]", "natural frequency [Hz]")
    legend_below(figure, columns=4)
    return figure


def transmission_error_period(
    dynamics: xr.Dataset, static: xr.Dataset | None = None, *, together: bool = False
) -> Figure:
    """Draw the fluctuation of the dynamic transmission error over one mesh period, axes for each speed.

    The datasets have ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m], of which at most four speeds
    are drawn, and for comparison ``ste`` (mesh, position) [m]: thin with the harmonics of the excitation
    alone, so that their cut does not pass for vibration, and faint as a whole. Meshes that differ from planet
    to planet share axes where ``together`` says so; otherwise each kind has its own.
    """
    speeds, h = _some_speeds(dynamics.sizes["speed"]), dynamics["harmonic"].values
    position = np.linspace(0.0, 1.0, max(256, 16 * int(h.max())) + 1)
    wave = np.exp(2j * np.pi * np.outer(h[h > 0], position))
    errors = 1e6 * np.real(harmonics_of(dynamics.isel(speed=speeds), "dte")[..., h > 0] @ wave)
    curves = [*errors] if static is None else [*errors, 1e6 * static["ste"].values]
    # what is one line at one speed need not be one at another: the lines are those of all speeds
    lines = distinct_lines(dynamics["mesh"].values, np.hstack(curves), partly=together)
    kinds = [""] if together or len(lines) < 3 else list(dict.fromkeys(family(text) for text, _ in lines))
    figure, axes = _panels(len(speeds) * len(kinds), above=1.2 if together else 0.8)
    for ax, ((s, error), kind) in zip(axes, product(zip(speeds, errors), kinds)):
        for i, (text, row) in enumerate(lines):
            if kind not in ("", family(text)):
                continue
            style = line_style(i)
            ax.plot(position, error[row], label=text, linewidth=2.0, **style)
            if static is not None:
                cut = _excited_harmonics(dynamics, s)
                _draw_static(ax, static["position"], static["ste"].values[row], cut, position, style)
        frequency = float(dynamics["mesh_frequency"].values[s])
        title = f"{rpm(dynamics['speed'].values[s])}, mesh frequency {frequency:.6g} Hz"
        label(ax, "position in the mesh period [1]", title=f"{title}\n{kind} meshes" if kind else title)
        ax.set_xlim(0.0, 1.0)
    for ax in axes[::2]:
        label(ax, y="transmission error less its mean [µm]")
    if static is not None:
        _name_kinds(axes[0], dynamics)
    legend_below(figure, columns=3)
    return figure


def transmission_error_spectrum(dynamics: xr.Dataset) -> Figure:
    """Draw the amplitudes of the harmonics of the dynamic transmission error, for at most four speeds.

    The dataset has ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m].
    """
    from matplotlib.ticker import MaxNLocator

    dynamics = dynamics.isel(speed=_some_speeds(dynamics.sizes["speed"]))
    figure, axes = _panels(dynamics.sizes["speed"])
    h = dynamics["harmonic"].values
    amplitude, h = np.abs(harmonics_of(dynamics, "dte"))[:, :, h > 0] * 1e6, h[h > 0]
    names, largest = dynamics["mesh"].values, amplitude.max(initial=0.0)
    # below are rounding and what the iteration leaves: no line is drawn there
    floor = _DECADES * largest
    for s, ax in enumerate(axes):
        lines = distinct_lines(names, amplitude[s])
        few = len(lines) * len(h) <= _MOST_BARS
        for i, (text, row) in enumerate(lines):
            shown = amplitude[s, row] > floor
            if few:
                _bars(ax, h[shown], amplitude[s, row][shown], i, len(lines), text)
            else:
                _dots(ax, h[shown], amplitude[s, row][shown], floor, i, text)
        if largest > 0.0:
            ax.set_yscale("log")
            ax.set_ylim(floor, 2.0 * largest)
            ax.minorticks_off()
        # speeds may reach different harmonics: axes end with the last line
        last = h[(amplitude[s] > floor).any(axis=0)].max(initial=1)
        ax.set_xlim(0.4, last + 0.6)
        ax.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
        title = rpm(dynamics["speed"].values[s]) + excited_to(dynamics, s)
        label(ax, "harmonic of the mesh frequency [1]", title=title)
    for ax in axes[::2]:
        label(ax, y="amplitude of the transmission error [µm]")
    legend_below(figure)
    return figure


def _bars(ax, h, amplitude, index: int, count: int, text: str) -> None:
    """Draw bars of one mesh beside those of the others."""
    width = 0.8 / count
    ax.bar(
        h + (index - (count - 1) / 2) * width,
        amplitude,
        width,
        color=COLOURS[index % len(COLOURS)],
        hatch=("", "///", "...", "xx")[index % 4],
        edgecolor="white",
        linewidth=0.5,
        label=text,
    )


def _dots(ax, h, amplitude, floor, index: int, text: str) -> None:
    """Draw lines of one mesh as markers on thin stems: many bars would merge."""
    colour = COLOURS[index % len(COLOURS)]
    ax.vlines(h, floor, amplitude, color=colour, linewidth=0.5, alpha=0.5)
    ax.plot(h, amplitude, MARKERS[index % len(MARKERS)], color=colour, markersize=3.5, label=text)


def speed_sweep(dynamics: xr.Dataset) -> Figure:
    """Draw the RMS of the fluctuating transmission error over the speed, and what the solver says of it.

    The dataset has ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m], and ``spectral_radius``,
    ``floquet_multiplier`` and ``converged`` (speed,).
    """
    figure, (top, bottom) = new_figure(rows=2, height=7.0, sharex=True)
    order = np.argsort(dynamics["speed"].values)
    speed = dynamics["speed"].values[order]
    rms = fluctuation_rms(dynamics)[order] * 1e6
    marker = {"marker": "o", "markersize": 4} if len(speed) < 40 else {}
    lines = distinct_lines(dynamics["mesh"].values, rms.T)
    for i, (text, row) in enumerate(lines):
        top.plot(speed, rms[:, row], label=text, **marker, **line_style(i))
    failed = ~dynamics["converged"].values[order].astype(bool)
    if failed.any():
        top.plot(
            speed[failed], rms[failed].max(axis=1), "x", color=BLACK, markersize=8, label="not converged"
        )
    top.set_ylim(bottom=0)
    label(top, y="RMS [µm]", title="fluctuation of the transmission error")
    for name, text, colour, dash in (
        ("spectral_radius", "spectral radius of the fixed point", BLACK, "-"),
        ("floquet_multiplier", "largest Floquet multiplier", GREY, "--"),
    ):
        bottom.plot(speed, dynamics[name].values[order], dash, color=colour, label=text, **marker)
    bottom.axhline(1.0, color=BLACK, linewidth=0.8, linestyle=":", label="limit")
    bottom.set_ylim(bottom=0)
    label(
        bottom,
        "input speed [rpm]",
        "magnitude [1]",
        "the iteration contracts and the motion is stable up to 1",
    )
    places: Any = ("outside upper center", "outside lower center")
    for ax, place in zip((top, bottom), places):
        figure.legend(*ax.get_legend_handles_labels(), loc=place, ncols=3, fontsize=SIZE - 1, frameon=False)
    return figure


def response_figures(dynamics: xr.Dataset, **others: Figure) -> dict[str, Figure]:
    """Draw the spectrum of the transmission error, `others`, and over many speeds its sweep."""
    figures = {"dynamic_spectrum": transmission_error_spectrum(dynamics), **others}
    if dynamics.sizes["speed"] > _MANY_SPEEDS:
        figures["speed_sweep"] = speed_sweep(dynamics)
    return figures


def some_at_a_time(dynamics: xr.Dataset) -> Iterator[xr.Dataset]:
    """Give a dataset over speeds in parts that the memory holds, in their order."""
    return (dynamics.isel(speed=slice(i, i + _READ)) for i in range(0, dynamics.sizes["speed"], _READ))


def fluctuation_rms(dynamics: xr.Dataset) -> np.ndarray:
    """Compute the RMS of the transmission errors less their means (speeds, meshes) [m]."""
    return np.concatenate([fluctuation(harmonics_of(one, "dte")) for one in some_at_a_time(dynamics)])


def harmonics_of(dynamics: xr.Dataset, name: str) -> np.ndarray:
    """Join real and imaginary part of a variable to a complex array, in its dimensions and unit."""
    return dynamics[f"{name}_real"].values + 1j * dynamics[f"{name}_imag"].values


def _excited_harmonics(dynamics: xr.Dataset, speed_index: int) -> int:
    """Find the highest harmonic of the mesh frequency that excites, by ``excitation_limit`` [Hz] if known."""
    highest = int(dynamics["harmonic"].values.max())
    if "excitation_limit" not in dynamics:
        return highest
    limit = float(dynamics["excitation_limit"].values[speed_index])
    frequency = float(dynamics["mesh_frequency"].values[speed_index])
    return min(int(limit / frequency * (1.0 + 1e-9)), highest) if frequency > 0.0 else highest


def _name_kinds(ax, dynamics: xr.Dataset) -> None:
    """Add legend entries for dynamic and static curves: they differ in width, meshes in colour and dash."""
    known = "excitation" if "excitation_limit" in dynamics else "response"
    for text, look in (
        ("dynamic (thick)", {"linewidth": 2.0}),
        (f"static, harmonics of the {known} (thin)", {"linewidth": 0.9}),
        ("static, whole (pale)", {"linewidth": 2.5, "alpha": 0.3}),
    ):
        ax.plot([], [], color=BLACK, label=text, **look)


def _draw_static(ax, at, values, harmonics: int, position, style) -> None:
    """Draw the static transmission error [m] less its mean: whole record pale, first harmonics thin.

    Of its record ``values`` (P,) at positions ``at`` (P,) of one mesh period; harmonics at ``position`` (Q,).
    """
    at, whole, part = _fluctuation(at, values, harmonics, position)
    ax.plot(at, 1e6 * whole, color=style["color"], linewidth=2.5, alpha=0.3, label="_")
    ax.plot(position, 1e6 * part, linewidth=0.9, **style, label="_")


def _fluctuation(at, values, harmonics: int, position):
    """Reduce a record of one period by its mean, and sum its first harmonics at `position`.

    The record is linear between its positions, which may be closer where it is steep. Harmonics of such a
    curve are those of its second derivative, jumps of the slope, over ``-(2 pi h)^2``.
    """
    at, value = periodic(at, values)
    mean = np.trapezoid(value, at) / (at[-1] - at[0])
    slope = np.diff(value) / np.diff(at)
    jump, h = slope - np.roll(slope, 1), np.arange(1, harmonics + 1)
    line = -2.0 * np.exp(-2j * np.pi * np.outer(h, at[:-1])) @ jump / (2.0 * np.pi * h) ** 2
    return at, value - mean, (line @ np.exp(2j * np.pi * np.outer(h, position))).real


def _panels(count: int, *, above: float = 0.8):
    """Make a figure with `count` axes of one vertical scale, two in a row, and room above them [in]."""
    rows, columns = -(-count // 2), min(count, 2)
    figure, axes = new_figure(
        rows=rows, columns=columns, width=max(5.0 * columns, 6.5), height=above + 3.6 * rows, sharey=True
    )
    for ax in axes[count:]:
        figure.delaxes(ax)
    return figure, axes[:count]


def shown_speeds(data: xr.Dataset) -> list[int]:
    """Choose the speeds that get pictures of their own: all of a few, else first, middle and last."""
    n = data.sizes["speed"]
    return list(range(n)) if n <= _MANY_SPEEDS else [0, n // 2, n - 1]


def _some_speeds(count: int) -> list[int]:
    """Choose at most four of so many speeds, spread evenly."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, 4))})
