"""Figures of planetary stages in series: where the modes live, mesh frequencies, dynamic mesh forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.report.response import stored_harmonics
from femgear.report.style import BLACK, COLOURS, SIZE, label, legend_below, line_style, new_figure, rpm
from femgear.stages.protocol import Drawn, Figures

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_DASHES = {"rotational": "-", "translational": "--", "planet": ":", "mixed": "-."}
"""Kinds of modes, and of their lines."""
_PROMINENCE = 0.15
"""Least height of a peak over its sides, decades."""


def stage_energy(modes: xr.Dataset) -> Figure:
    """Draw the share of every stage in the kinetic energy of the elastic modes of modes.nc, a panel a kind.

    Modes of one frequency are drawn once, with their mean share.
    """
    frequency, kinds = modes["frequency"].values, modes["kind"].values
    present = [kind for kind in _DASHES if np.any(kinds == kind)]
    figure, axes = new_figure(rows=len(present), width=9.0, height=1.0 + 2.2 * len(present))
    for ax, kind in zip(axes, present):
        of_kind = np.flatnonzero(kinds == kind)
        groups = np.split(of_kind, np.flatnonzero(np.diff(frequency[of_kind]) > 1e-6 * frequency[of_kind][1:]) + 1)
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
    """Draw a Campbell diagram: mesh harmonics of response.nc over the speed, and the modes of modes.nc.

    Circles stand where the forces of a harmonic have a peak, beside them the natural frequency within 5 % on
    which they do most work. Natural frequencies above the highest harmonic are left out.
    """
    speed, mesh = response["speed"].values, response["mesh_frequency"].values
    harmonics, hertz = response["harmonic"].values, modes["frequency"].values
    figure, (ax,) = new_figure(width=8.5, height=6.0)
    top, lowest = float(harmonics.max() * mesh.max()), hertz[hertz > 0.0].min(initial=np.inf)
    for frequency, kind in zip(hertz, modes["kind"].values):
        if 0.0 < frequency < top:
            style = {"linestyle": _DASHES[kind], "linewidth": 0.8, "label": f"{kind} mode"}
            ax.axhline(frequency, color="0.65", **style)
    below = []
    for stage, line in enumerate(mesh):
        if harmonics.max() * line.max() < lowest:
            below.append(f"stage {stage + 1}")
            continue
        style = {"color": COLOURS[stage % len(COLOURS)], "label": f"stage {stage + 1}, mesh harmonics"}
        for place, h in enumerate(harmonics):
            ax.plot(speed, h * line, linewidth=2.0, **style)
            ax.text(speed[-1], h * line[-1], f" {h} f{stage + 1}", va="center", fontsize=SIZE - 1)
            for at, mode in _peaks(modes, response, stage, place):
                ax.plot(
                    speed[at],
                    h * line[at],
                    "o",
                    color=BLACK,
                    markerfacecolor="white",
                    label="peak of the force",
                )
                ax.annotate(
                    f"{hertz[mode]:.0f}",
                    (speed[at], h * line[at]),
                    xytext=(-5, 4),
                    ha="right",
                    textcoords="offset points",
                    fontsize=SIZE - 2,
                )
    ax.set_xlim(speed.min(), speed.max())
    ax.set_ylim(0.0, 1.02 * top)
    words = f"{' and '.join(below)}: all harmonics below the first mode, {lowest:.4g} Hz" if below else ""
    label(ax, "input speed [rpm]", "frequency [Hz]", words)
    legend_below(figure, columns=3)
    return figure


def _peaks(modes: xr.Dataset, response: xr.Dataset, stage: int, harmonic: int) -> list[tuple[int, int]]:
    """Find peaks of the forces that a mesh harmonic of a stage excites: numbers of speed and mode."""
    from scipy.signal import find_peaks

    force = stored_harmonics(response.isel(excited_by=stage, harmonic=harmonic), "mesh_force")
    hertz = response["harmonic"].values[harmonic] * response["mesh_frequency"].values[stage]
    size, peaks = np.log10(np.maximum(np.abs(force).max(axis=1), 1e-300)), []
    for at in find_peaks(size, prominence=_PROMINENCE)[0].tolist():
        near = np.flatnonzero(np.abs(modes["frequency"].values / hertz[at] - 1.0) < 0.05)
        work = np.abs(modes["mesh_deflection"].values[:, near].T @ force[at])
        peaks += [(at, int(near[work.argmax()]))] if len(near) else []
    return peaks


def stage_forces(response: xr.Dataset, balance: xr.Dataset | None = None) -> Figure:
    """Draw dynamic mesh forces of response.nc over the speed by the stage that excites, a panel a stage.

    Those of balance.nc stand beside them as circles.
    """
    speed, total = response["speed"].values, response["total_force"].values
    stages = response.sizes["stage"]
    figure, axes = new_figure(rows=stages, width=8.5, height=1.2 + 2.1 * stages, sharex=True)
    for stage, ax in enumerate(axes):
        ax.plot(speed, total[:, stage], color="0.75", linewidth=4.5, label="all stages")
        for n, force in zip(response["excited_by"].values, response["first_force"].values):
            ax.plot(speed, force[:, stage], label=f"meshes of stage {n}", **line_style(int(n) - 1))
        if balance is not None:
            style = {"color": BLACK, "fillstyle": "none", "label": "harmonic balance, k(t) of all meshes"}
            ax.plot(balance["speed"].values, balance["total_force"].values[:, stage], "o", **style)
        largest, at = total[:, stage].max(), speed[total[:, stage].argmax()]
        ax.set_yscale("log")
        ax.set_ylim(1e-3 * largest, 3.0 * largest)
        words = f"sun-planet 1 of stage {stage + 1}: at most {largest:.4g} N r.m.s., at {rpm(at)}"
        label(ax, y="force [N r.m.s.]", title=words)
    axes[0].set_xlim(np.min(speed), np.max(speed))
    label(axes[-1], "input speed [rpm]")
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
            "mesh_orders": "Campbell diagram: harmonics of the mesh frequency f1, f2, .. of every stage over "
            "the speed of the input; horizontal lines are natural frequencies. Circles: peaks of the mesh "
            "forces, with the natural frequency [Hz] on which they do most work.",
            "stage_forces": "Dynamic forces of mesh sun-planet 1 of every stage over the speed of the input, "
            "by the stage whose meshes excite; circles: harmonic balance with the stiffnesses of all meshes.",
        },
        _draw_response,
    ),
}
