"""Figures of planetary stages in series: where the modes live, mesh frequencies, dynamic mesh forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import BLACK, COLOURS, GREY, SIZE, label, legend_below, line_style, new_figure
from femgear.trains.protocol import Drawn, Figures

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_DASHES = {"rotational": "-", "translational": "--", "planet": ":", "mixed": "-."}
"""Kinds of modes, and of their lines."""


def stage_energy(modes: xr.Dataset) -> Figure:
    """Draw the share of every stage in the kinetic energy of the elastic modes of modes.nc, a panel a kind.

    Modes of one frequency are drawn once, with their mean share.
    """
    frequency, kinds = modes["frequency"].values, modes["kind"].values
    present = [kind for kind in _DASHES if np.any(kinds == kind)]
    figure, axes = new_figure(rows=len(present), width=9.0, height=1.0 + 2.2 * len(present))
    for ax, kind in zip(axes, present):
        own = np.flatnonzero(kinds == kind)
        groups = np.split(own, np.flatnonzero(np.diff(frequency[own]) > 1e-6 * frequency[own][1:]) + 1)
        place, bottom = np.arange(len(groups)), np.zeros(len(groups))
        for stage, row in enumerate(modes["energy"].values):
            height = np.array([row[group].mean() for group in groups])
            style = {"color": COLOURS[stage % len(COLOURS)], "label": f"stage {stage + 1}"}
            ax.bar(place, height, 0.8, bottom=bottom, **style)
            bottom += height
        names = [f"{frequency[group[0]]:.0f}" for group in groups]
        ax.set_xticks(place, names, rotation=90, fontsize=SIZE - 3)
        ax.set_ylim(0.0, 1.0)
        ax.set_xlim(-0.6, len(groups) - 0.4)
        ax.grid(False, axis="x")
        label(ax, y="share [1]", title=f"{kind} modes")
    label(axes[-1], "natural frequency [Hz]")
    legend_below(figure, axes[0], columns=4)
    return figure


def mesh_orders(modes: xr.Dataset, response: xr.Dataset) -> Figure:
    """Draw mesh frequencies of response.nc and their harmonics over the speed, with the modes of modes.nc.

    Natural frequencies above the highest line are left out.
    """
    speed, mesh = response["speed"].values, response["mesh_frequency"].values
    harmonics = response.sizes["harmonic"]
    figure, (ax,) = new_figure(width=8.5, height=5.4)
    top, low = harmonics * mesh.max(), mesh.min()
    for hertz, kind in zip(modes["frequency"].values, modes["kind"].values):
        if low < hertz < top:
            ax.axhline(hertz, color=GREY, linestyle=_DASHES[kind], linewidth=0.9, label=f"{kind} mode")
    for stage, line in enumerate(mesh):
        style = {
            "color": COLOURS[stage % len(COLOURS)],
            "label": f"stage {stage + 1}, harmonics 1 to {harmonics}",
        }
        for h in range(1, harmonics + 1):
            ax.plot(speed, h * line, linewidth=2.2 / h, **style)
    ax.set_yscale("log")
    ax.set_ylim(low, 1.1 * top)
    ax.set_xlim(speed.min(), speed.max())
    label(ax, "speed of the input [1/min]", "frequency [Hz]")
    legend_below(figure, columns=2)
    return figure


def stage_forces(response: xr.Dataset, balance: xr.Dataset | None = None) -> Figure:
    """Draw dynamic mesh forces of response.nc over the speed by the stage that excites, a panel a stage.

    Those of balance.nc stand beside them as circles.
    """
    speed, forces = response["speed"].values, {"all stages": response["total_force"].values}
    for n, force in zip(response["excited_by"].values, response["first_force"].values):
        forces[f"meshes of stage {n}"] = force
    stages = response.sizes["stage"]
    figure, axes = new_figure(rows=stages, width=8.5, height=1.2 + 2.1 * stages, sharex=True)
    for stage, ax in enumerate(axes):
        largest = max(np.max(force[:, stage]) for force in forces.values())
        for number, (text, force) in enumerate(forces.items()):
            ax.plot(speed, force[:, stage], label=text, **line_style(number))
        if balance is not None:
            style = {"color": BLACK, "fillstyle": "none", "label": "harmonic balance, k(t) of all meshes"}
            ax.plot(balance["speed"].values, balance["total_force"].values[:, stage], "o", **style)
        ax.set_yscale("log")
        ax.set_ylim(1e-4 * largest, 2.0 * largest)
        label(ax, y="force [N r.m.s.]", title=f"sun-planet 1 of stage {stage + 1}")
    axes[0].set_xlim(np.min(speed), np.max(speed))
    label(axes[-1], "speed of the input [1/min]")
    legend_below(figure, axes[0], columns=3)
    return figure


def _draw_response(drawn: Drawn) -> dict[str, Figure]:
    """Mesh frequencies with the modes that they meet, and the dynamic forces."""
    data = drawn.data
    return {
        "mesh_orders": mesh_orders(data["modes"], data["response"]),
        "stage_forces": stage_forces(data["response"], data.get("balance")),
    }


FIGURES = {
    "modes": Figures(
        {
            "stage_energy": "Share of every stage in the kinetic energy of the modes; modes of one frequency "
            "stand once, with their mean share."
        },
        lambda drawn: {"stage_energy": stage_energy(drawn.data["modes"])},
    ),
    "response": Figures(
        {
            "mesh_orders": "Mesh frequencies of the stages and their harmonics over the speed of the input; "
            "horizontal lines are natural frequencies.",
            "stage_forces": "Dynamic forces of mesh sun-planet 1 of every stage over the speed of the input, "
            "by the stage whose meshes excite; circles: harmonic balance with the stiffnesses of all meshes.",
        },
        _draw_response,
    ),
}
