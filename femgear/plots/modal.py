"""Figures of modes.nc: mode shapes and natural frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    SIZE,
    VERMILION,
    label,
    legend_below,
    new_figure,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.gears.planetary import PlanetarySet

_CIRCLE = np.linspace(0.0, 2 * np.pi, 241)
_MARKERS = "osD^vPX*"


def mode_shapes(
    modes: xr.Dataset, planetary_set: PlanetarySet, *, shown: Sequence[int] | None = None, scale: float = 0.16
) -> Figure:
    """Bodies and outer ring surface in their undeformed (grey) and displaced positions.

    Parameters
    ----------
    modes : xarray.Dataset
        With ``shape`` (dof, mode), ``frequency`` [Hz], ``kind``, ``nodal_diameter`` and, where there is
        an elastic ring, ``ring_shape_real`` and ``ring_shape_imag`` (mode, circumferential).
    planetary_set : PlanetarySet
        Radii, centre distance and planet angles.
    shown : sequence of int, optional
        Mode numbers from 0; the first twelve that are no rigid-body motions when omitted.
    scale : float
        Largest displacement as a share of the ring's outer radius.

    Returns
    -------
    Figure
    """
    frequency = modes["frequency"].values
    if shown is None:
        elastic = np.flatnonzero(frequency > 1e-3 * frequency.max(initial=0.0) / max(len(frequency), 1))
        shown = elastic[:12]
    shown = [int(mode) for mode in shown]
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
    ax.plot(*_xy(outer * circle), color="0.8", linewidth=1.0, label="at rest")
    rigid = _motion(shape, "ring")
    shift, turn = factor * (rigid[0] + 1j * rigid[1]), factor * rigid[2]
    ax.plot(
        *_xy((outer + factor * ring) * circle + shift),
        color=BLACK,
        linewidth=1.8,
        label="ring, outer surface",
    )
    if "ring: rotation" in shape:
        # a rigid ring shows its rotation by a mark in its rim
        mark = np.array([0.9, 1.0]) * outer
        ax.plot(*_xy(1j * mark), color="0.8", linewidth=1.0)
        ax.plot(*_xy(shift + 1j * mark * np.exp(1j * turn)), color=BLACK, linewidth=1.8)
    for name, (centre, radius, colour, text) in bodies.items():
        x, y, turn = _motion(shape, name)
        moved = centre + factor * (x + 1j * y)
        spoke = np.exp(1j * (np.angle(centre) if centre else 0.0)) * radius
        if name == "carrier":
            _draw_carrier(ax, planetary_set, moved, factor * turn, colour)
            continue
        ax.plot(*_xy(centre + radius * circle), color="0.8", linewidth=1.0)
        ax.plot(*_xy(np.array([centre, centre + spoke])), color="0.8", linewidth=1.0)
        ax.plot(*_xy(moved + radius * circle), color=colour, linewidth=1.6, label=text)
        ax.plot(
            *_xy(np.array([moved, moved + spoke * np.exp(1j * factor * turn)])), color=colour, linewidth=1.6
        )
    span = 1.24 * outer
    ax.set_xlim(-span, span)
    ax.set_ylim(-span, span)
    diameter = int(modes["nodal_diameter"].values[mode])
    text = f"mode {mode + 1}: {modes['frequency'].values[mode]:.5g} Hz\n{modes['kind'].values[mode]}"
    ax.set_title(text + (f", n = {diameter}" if diameter >= 0 else ""), fontsize=SIZE - 1.5)


def _draw_carrier(ax, planetary_set, moved, turn, colour):
    pins = planetary_set.centre_distance * np.exp(1j * np.asarray(planetary_set.planet_angles, float))
    pins = moved + pins * np.exp(1j * turn)
    for pin in pins:
        ax.plot(*_xy(np.array([moved, pin])), color=colour, linewidth=1.2, linestyle="--", label="carrier")
    ax.plot(*_xy(pins), "o", color=colour, markersize=3)


def _bodies(planetary_set):
    """Centre, radius, colour and legend of every rigid body."""
    bodies = {"carrier": (0j, planetary_set.centre_distance, GREEN, "carrier")}
    bodies["sun"] = (0j, planetary_set.sun.reference_radius, VERMILION, "sun")
    for n, angle in enumerate(planetary_set.planet_angles):
        centre = planetary_set.centre_distance * np.exp(1j * float(angle))
        bodies[f"planet {n + 1}"] = (centre, planetary_set.planet.reference_radius, BLUE, "planets")
    return bodies


def _motion(shape, name):
    return tuple(float(shape.get(f"{name}: {axis}", 0.0)) for axis in ("x", "y", "rotation"))


def _ring_radial(modes, mode):
    """Radial displacement of the outer surface at the angles of `_CIRCLE`."""
    if "ring_shape_real" not in modes:
        return np.zeros_like(_CIRCLE)
    n = modes["circumferential"].values
    value = modes["ring_shape_real"].values[mode] + 1j * modes["ring_shape_imag"].values[mode]
    return (np.exp(1j * np.outer(_CIRCLE, n)) @ value).real


def _xy(points):
    return points.real, points.imag


def natural_frequencies(modes: xr.Dataset, *, mesh_frequencies: Sequence[tuple[str, float]] = ()) -> Figure:
    """Natural frequencies over the nodal diameters of the ring, by kind of mode.

    Parameters
    ----------
    modes : xarray.Dataset
        With ``frequency`` [Hz], ``kind`` and ``nodal_diameter``.
    mesh_frequencies : sequence of (str, float)
        Legend text and frequency [Hz] of excitations to draw as horizontal lines.

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(height=5.0)
    kinds = np.array([str(kind) for kind in modes["kind"].values])
    frequency, diameter = modes["frequency"].values, modes["nodal_diameter"].values
    for i, kind in enumerate(dict.fromkeys(kinds)):
        rows = kinds == kind
        ax.plot(
            diameter[rows],
            frequency[rows] * 1e-3,
            _MARKERS[i % len(_MARKERS)],
            color=COLOURS[i % len(COLOURS)],
            markersize=6,
            markerfacecolor="none",
            markeredgewidth=1.6,
            label=f"{kind} ({np.count_nonzero(rows)})",
        )
    for i, (text, value) in enumerate(mesh_frequencies):
        dash = (0, (4, 2 + 2 * i))
        ax.axhline(value * 1e-3, color=(GREY, ORANGE)[i % 2], linewidth=1.0, linestyle=dash, label=text)
    ticks = np.unique(diameter)
    if len(ticks) <= 25:
        ax.set_xticks(ticks, ["none" if n < 0 else str(n) for n in ticks])
    ax.set_ylim(bottom=0)
    label(ax, "nodal diameters of the ring [1]", "natural frequency [kHz]")
    legend_below(figure, columns=4)
    return figure
