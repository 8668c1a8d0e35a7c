"""Figures of planetary stages in series: where the modes live, mesh frequencies, dynamic mesh forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import BLACK, COLOURS, GREY, SIZE, label, legend_below, line_style, new_figure
from femgear.storage.dataset import RPM
from femgear.trains.multistage.model import train_speeds
from femgear.trains.multistage.section import multistage_of
from femgear.trains.protocol import Drawn, Figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = ("rotational", "translational", "planet", "mixed")


def stage_energy(frequency, kinds: Sequence[str], share, *, title: str = "") -> Figure:
    """Share of every stage in the kinetic energy of the modes, one panel a kind.

    Parameters
    ----------
    frequency : (m,) array
        [Hz]
    kinds : (m,) sequence of str
        Rigid motions are left out; modes of one frequency are drawn once, with their mean share.
    share : (S, m) array

    Returns
    -------
    Figure
    """
    frequency, kinds, share = np.asarray(frequency), np.asarray(kinds), np.asarray(share)
    present = [kind for kind in KINDS if np.any(kinds == kind)]
    figure, axes = new_figure(rows=len(present), width=9.0, height=1.0 + 2.2 * len(present))
    for ax, kind in zip(axes, present):
        own = np.flatnonzero(kinds == kind)
        groups = np.split(own, np.flatnonzero(np.diff(frequency[own]) > 1e-6 * frequency[own][1:]) + 1)
        place, bottom = np.arange(len(groups)), np.zeros(len(groups))
        for stage, row in enumerate(share):
            height = np.array([row[group].mean() for group in groups])
            ax.bar(
                place,
                height,
                0.8,
                bottom=bottom,
                color=COLOURS[stage % len(COLOURS)],
                label=f"stage {stage + 1}",
            )
            bottom += height
        ax.set_xticks(
            place, [f"{frequency[group[0]]:.0f}" for group in groups], rotation=90, fontsize=SIZE - 3
        )
        ax.set_ylim(0.0, 1.0)
        ax.set_xlim(-0.6, len(groups) - 0.4)
        ax.grid(False, axis="x")
        label(ax, y="share [1]", title=f"{kind} modes")
    label(axes[0], title=f"{title}: {present[0]} modes" if title else "")
    label(axes[-1], "natural frequency [Hz]")
    legend_below(figure, axes[0], columns=4)
    return figure


def mesh_orders(
    speed, mesh_frequency, natural, kinds: Sequence[str], *, harmonics: int = 3, title=""
) -> Figure:
    """Mesh frequencies and their harmonics over the speed of the input, with natural frequencies.

    Parameters
    ----------
    speed : (F,) array
        [1/min]
    mesh_frequency : (F, S) array
        [Hz]
    natural : (m,) array
        [Hz]; only those below the highest line are drawn.
    kinds : (m,) sequence of str
    harmonics : int

    Returns
    -------
    Figure
    """
    speed, mesh_frequency, natural = (np.asarray(one) for one in (speed, mesh_frequency, natural))
    figure, (ax,) = new_figure(width=8.5, height=5.4)
    top, low = harmonics * mesh_frequency.max(), mesh_frequency.min()
    dashes = {"rotational": "-", "translational": "--", "planet": ":", "mixed": "-."}
    for hertz, kind in zip(natural, kinds):
        if low < hertz < top:
            ax.axhline(hertz, color=GREY, linestyle=dashes[kind], linewidth=0.9, label=f"{kind} mode")
    for stage, line in enumerate(mesh_frequency.T):
        for h in range(1, harmonics + 1):
            ax.plot(speed, h * line, color=COLOURS[stage % len(COLOURS)], linewidth=2.2 / h,
                    label=f"stage {stage + 1}, harmonics 1 to {harmonics}")  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylim(low, 1.1 * top)
    ax.set_xlim(speed.min(), speed.max())
    label(ax, "speed of the input [1/min]", "frequency [Hz]", title)
    legend_below(figure, columns=2)
    return figure


def stage_forces(
    speed, forces: Mapping[str, np.ndarray], *, marks: Mapping[str, tuple] | None = None, title: str = ""
) -> Figure:
    """Dynamic mesh forces over the speed of the input, one panel a stage.

    Parameters
    ----------
    speed : (F,) array
        [1/min]
    forces : mapping of str to (F, S) array
        One line each, in every stage, such as by the stage that excites [N r.m.s.].
    marks : mapping of str to (speed (p,), force (p, S)), optional
        Points of another solution.

    Returns
    -------
    Figure
    """
    stages = next(iter(forces.values())).shape[1]
    figure, axes = new_figure(rows=stages, width=8.5, height=1.2 + 2.1 * stages, sharex=True)
    for stage, ax in enumerate(axes):
        largest = max(np.max(force[:, stage]) for force in forces.values())
        for number, (text, force) in enumerate(forces.items()):
            ax.plot(speed, force[:, stage], label=text, **line_style(number))
        for marker, (text, (at, force)) in zip("os^", (marks or {}).items()):
            ax.plot(at, force[:, stage], marker, color=BLACK, fillstyle="none", label=text)
        ax.set_yscale("log")
        ax.set_ylim(1e-4 * largest, 2.0 * largest)
        label(ax, y="force [N r.m.s.]", title=f"sun-planet 1 of stage {stage + 1}")
    if title:
        label(axes[0], title=f"{title}: sun-planet 1 of stage 1")
    axes[0].set_xlim(np.min(speed), np.max(speed))
    label(axes[-1], "speed of the input [1/min]")
    legend_below(figure, axes[0], columns=3)
    return figure


def draw_modes(drawn: Drawn) -> dict[str, Figure]:
    """Energies of the modes, and where the mesh frequencies meet them."""
    data, given = drawn.data["modes"], drawn.case.response
    frequency, kinds = data["frequency"].values, [str(kind) for kind in data["kind"].values]
    figures = {"stage_energy": stage_energy(frequency, kinds, data["energy"].values)}
    if given is not None and drawn.case.operation is not None:
        speed = np.linspace(given.lowest, given.highest, given.points)
        mesh = speed[:, None] * train_speeds(multistage_of(drawn.case), 1.0).mesh_frequency
        elastic = np.flatnonzero(frequency)
        figures["mesh_orders"] = mesh_orders(
            speed / RPM, mesh, frequency[elastic], [kinds[n] for n in elastic], harmonics=given.harmonics
        )
    return figures


def draw_response(drawn: Drawn) -> dict[str, Figure]:
    """Dynamic forces by the stage that excites, with harmonic balance beside them."""
    data, marks = drawn.data["response"], {}
    forces = {"all stages": data["total_force"].values}
    for n, force in zip(data["excited_by"].values, data["first_force"].values):
        forces[f"meshes of stage {n}"] = force
    if "balance" in drawn.data:
        other = drawn.data["balance"]
        marks["harmonic balance, k(t) of all meshes"] = other["speed"].values, other["total_force"].values
    return {"stage_forces": stage_forces(data["speed"].values, forces, marks=marks)}


FIGURES = {
    "modes": Figures(
        {
            "stage_energy": "Share of every stage in the kinetic energy of the modes; modes of one frequency "
            "stand once, with their mean share.",
            "mesh_orders": "Mesh frequencies of the stages and their harmonics over the speed of the input; "
            "horizontal lines are natural frequencies.",
        },
        draw_modes,
    ),
    "response": Figures(
        {
            "stage_forces": "Dynamic forces of mesh sun-planet 1 of every stage over the speed of the input, "
            "by the stage whose meshes excite; circles: harmonic balance with the stiffnesses of all meshes."
        },
        draw_response,
    ),
}
