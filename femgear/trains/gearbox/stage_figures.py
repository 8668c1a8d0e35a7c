"""Pictures of several stages of a gearbox: where its modes live, and which stage makes the mesh forces of which."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import COLOURS, DASHES, SIZE, label, legend_below, new_figure, rpm

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_KINDS = ("rotational", "translational", "planet", "mixed")
_SAME = 1e-6
"""Difference of natural frequencies, relative, of modes that are drawn once."""
_DECADES = 3.0
"""Below the largest force that are drawn."""


def draw_stage_energy(modes: xr.Dataset) -> Figure | None:
    """Draw the share of every stage in the kinetic energy of the elastic modes of modes.nc, a panel a class.

    Modes of one frequency are drawn once, with their mean share. None of a gearbox of one stage, or without planets.
    """
    frequency, kinds, names = modes["frequency"].values, modes["planet_kind"].values, modes["stage"].values
    present = [kind for kind in _KINDS if np.any(kinds == kind)]
    if len(names) < 2 or not present:
        return None
    figure, axes = new_figure(rows=len(present), width=9.0, height=1.0 + 2.2 * len(present))
    for ax, kind in zip(axes, present, strict=True):
        of_kind = np.flatnonzero(kinds == kind)
        hertz = frequency[of_kind]
        groups = np.split(of_kind, np.flatnonzero(np.diff(hertz) > _SAME * hertz[1:]) + 1)
        place, bottom = np.arange(len(groups)), np.zeros(len(groups))
        for stage, (name, row) in enumerate(zip(names, modes["stage_energy"].values, strict=True)):
            height = np.array([row[group].mean() for group in groups])
            ax.bar(place, height, 0.8, bottom=bottom, color=COLOURS[stage % len(COLOURS)], label=str(name))
            bottom += height
        ax.set_xticks(place, [f"{frequency[group[0]]:.0f}" for group in groups], rotation=90, fontsize=SIZE - 3)
        ax.set_ylim(0.0, 1.0)
        ax.set_xlim(-0.6, len(groups) - 0.4)
        ax.grid(False, axis="x")
        label(ax, y="share [1]", title=f"{kind} modes")
    label(axes[-1], "natural frequency [Hz]")
    legend_below(figure, axes[0], columns=4)
    return figure


def end_with_speeds(ax, speed: np.ndarray) -> None:
    """Let the abscissa end with the speeds (n,) of the curves; a single one has markers, and a tenth to both sides."""
    if np.ptp(speed) > 0.0:
        ax.set_xlim(speed.min(), speed.max())
        return
    for line, marker in zip(ax.lines, itertools.cycle("os^Dv"), strict=False):
        line.set(marker=marker, markersize=7.0)
    ax.set_xlim(0.9 * speed[0], 1.1 * speed[0])


def draw_stage_forces(runup: xr.Dataset) -> Figure | None:
    """Draw the dynamic force of the first mesh of every stage over the speed, by the stage that excites, of runup.nc.

    A panel a stage. None where one stage excites alone.
    """
    if "mesh_force_by_stage" not in runup:
        return None
    speed, meshes = runup["speed"].values, [str(mesh) for mesh in runup["mesh"].values]
    names = [str(name) for name in runup["stage"].values]
    of_stage = [str(name) for name in runup["stage_of_mesh"].values]
    first = [of_stage.index(name) for name in names]
    figure, axes = new_figure(rows=len(names), width=8.5, height=1.2 + 2.1 * len(names), sharex=True)
    for ax, mesh in zip(axes, first, strict=True):
        parts = runup["mesh_force_by_stage"].values[:, mesh]
        total = np.sqrt((parts**2).sum(axis=1))
        ax.plot(speed, total, color="0.75", linewidth=4.5, label="all stages")
        for number, name in enumerate(names):
            style = {"color": COLOURS[number % len(COLOURS)], "linestyle": DASHES[number // len(COLOURS) % len(DASHES)]}
            ax.plot(speed, parts[:, number], linewidth=1.6, label=name, **style)
        largest = float(total.max(initial=0.0))
        if largest > 0.0:
            ax.set_yscale("log")
            ax.set_ylim(10.0**-_DECADES * largest, 3.0 * largest)
        words = f"{meshes[mesh]}: at most {largest:.4g} N r.m.s., at {rpm(float(speed[total.argmax()]))}"
        label(ax, y="force [N r.m.s.]", title=words)
        end_with_speeds(ax, speed)
    label(axes[-1], f"speed of {runup.attrs['reference']} [rpm]")
    legend_below(figure, axes[0], columns=3)
    return figure
