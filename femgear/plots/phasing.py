"""Figures of mesh phasing: phases round the carrier, what they cancel and excite, mesh-force spectra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.gears.phasing import MeshPhasing, phase_factors
from femgear.gears.phasing_tables import MODES, PhasingTable, phasing_table
from femgear.plots.style import (
    BLACK,
    BLUE,
    COLOURS,
    DASHES,
    GREY,
    ORANGE,
    SIZE,
    VERMILION,
    label,
    legend_below,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CIRCLE = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 121))
_MARKS = {"rotational": ("o", BLUE), "translational": ("^", VERMILION), "planet": ("s", BLACK)}


def phase_diagram(phasing: MeshPhasing, *, harmonics: Sequence[int] = (1, 2, 3, 4)) -> Figure:
    """Phases of sun and ring meshes as hands of a dial at every planet, one picture a harmonic.

    Parameters
    ----------
    phasing : MeshPhasing
    harmonics : sequence of int
        A hand upwards has phase zero; phase grows counter-clockwise.

    Returns
    -------
    Figure
    """
    table, factors = phasing_table(phasing, list(harmonics)), phase_factors(phasing, list(harmonics))
    columns = min(4, len(harmonics))
    rows = -(-len(harmonics) // columns)
    figure, axes = new_figure(rows=rows, columns=columns, width=2.9 * columns, height=3.4 * rows + 0.5)
    centres = np.exp(1j * phasing.planet_angles)
    nearest = np.abs(np.diff([*centres, centres[0]])).min() if phasing.n_planets > 1 else 1.0
    dial = min(0.44 * nearest, 0.42)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for h, (ax, row) in enumerate(zip(axes, factors)):
        ax.plot(_CIRCLE.real, _CIRCLE.imag, color="0.85", linewidth=1.0)
        for n, centre in enumerate(centres):
            ax.plot(*_xy(centre + dial * _CIRCLE), color=GREY, linewidth=1.0)
            number = centre * (1.0 + 1.35 * dial)
            ax.text(*_xy(number), str(n + 1), ha="center", va="center", fontsize=SIZE - 2)
            ends = centre + 0.9j * dial * row[[n, phasing.n_planets + n]]
            ax.plot(*_xy(np.array([centre, ends[0]])), color=BLUE, linewidth=3.6, label="sun mesh")
            ax.plot(*_xy(np.array([centre, ends[1]])), color=ORANGE, linewidth=1.6, label="ring mesh")
        ax.text(0.0, 0.0, _verdict(table, h), ha="center", va="center", fontsize=SIZE - 2)
        ax.set_title(f"harmonic {table.harmonics[h]}: {table.kind[h]}", fontsize=SIZE - 1)
        ax.set_xlim(-1.05 - 1.6 * dial, 1.05 + 1.6 * dial)
        ax.set_ylim(-1.05 - 1.6 * dial, 1.05 + 1.6 * dial)
    legend_below(figure, columns=2)
    return figure


def _verdict(table: PhasingTable, row: int) -> str:
    """What is left of the mesh forces on sun and ring."""
    torque, lateral = table.members[row, :2, :2].max(axis=0)
    left = [
        f"{name} {100 * size:.0f} %"
        for name, size in (("torque", torque), ("lateral", lateral))
        if size > 1e-9
    ]
    return "\n".join(left) or "nothing on\nsun and ring"


def resultant_chart(tables: Mapping[str, PhasingTable]) -> Figure:
    """Resultants that are left and kinds of modes excited, harmonic by harmonic, one picture a set.

    The counterpart of Fig. 4 of A. Kahraman (J. Mech. Des. 116, 1994, 713-720); the area of a mark is the
    share of the mesh forces.

    Parameters
    ----------
    tables : mapping of str to PhasingTable
        Titles and sets.

    Returns
    -------
    Figure
    """
    count = len(tables)
    columns = min(4, count)
    rows = -(-count // columns)
    tall = max(len(table.harmonics) for table in tables.values())
    figure, axes = new_figure(
        rows=rows, columns=columns, width=3.0 * columns, height=(0.42 * tall + 1.9) * rows + 0.4
    )
    names = ("torque, thrust", "lateral force, tilting", *(f"{name} modes" for name in MODES))
    for ax in axes[count:]:
        ax.set_visible(False)
    for ax, (title, table) in zip(axes, tables.items()):
        shares = np.column_stack(
            [table.members[..., 0].max(axis=1), table.members[..., 1].max(axis=1), table.modes]
        )
        for column, values in enumerate(shares.T):
            marker, colour = ("D", GREY) if column < 2 else _MARKS[MODES[column - 2]]
            there = np.flatnonzero(values > 1e-9)
            place = np.full(len(there), column)
            ax.scatter(
                place, table.harmonics[there], s=130 * values[there], color=colour, marker=marker, zorder=3
            )
            text = "resultant" if column < 2 else names[column]
            ax.plot([], [], marker, color=colour, label=text)
        ax.axvline(1.5, color="0.6", linewidth=1.0)
        ax.set_xticks(range(5), names, rotation=40, ha="right", fontsize=SIZE - 2)
        ax.set_yticks(table.harmonics)
        ax.set_xlim(-0.6, 4.6)
        ax.set_ylim(table.harmonics[-1] + 0.6, table.harmonics[0] - 0.6)
        label(ax, y="harmonic of the mesh frequency [1]", title=title)
    legend_below(figure, columns=4)
    return figure


def mesh_force_spectra(
    frequency,
    forces: Mapping[str, np.ndarray],
    *,
    modes: Mapping[str, np.ndarray] | None = None,
    meshes: Sequence[str] = ("sun-planet 1",),
) -> Figure:
    """Mesh forces over the frequency of each harmonic, one picture a set.

    The counterpart of Fig. 6 of A. Kahraman (J. Mech. Des. 116, 1994, 713-720).

    Parameters
    ----------
    frequency : (F,) array
        Of the harmonic itself, h times the mesh frequency [Hz].
    forces : mapping of str to (H, F, n) array
        Titles, and amplitudes [N] of harmonics 1 to H at the meshes drawn.
    modes : mapping of str to (m,) array, optional
        Natural frequencies [Hz] by kind, for marks along the axis.
    meshes : sequence of str
        Names of the n meshes; the second and further ones are drawn where they differ from the first.

    Returns
    -------
    Figure
    """
    columns = 2 if len(forces) > 1 else 1
    rows = -(-len(forces) // columns)
    figure, axes = new_figure(
        rows=rows, columns=columns, width=5.4 * columns, height=3.3 * rows + 0.8, sharex=True, sharey=True
    )
    hertz, top = np.asarray(frequency) * 1e-3, max(np.abs(f).max() for f in forces.values())
    for ax in axes[len(forces) :]:
        ax.set_visible(False)
    for ax, (title, force) in zip(axes, forces.items()):
        size = np.abs(force)
        for h in range(len(size)):
            for j, name in enumerate(meshes):
                if j and np.abs(size[h, :, j] - size[h, :, 0]).max() < 1e-6 * top:
                    continue
                # wide below narrow: lines that coincide are all seen
                text = f"harmonic {h + 1}, {name}"
                ax.plot(hertz, size[h, :, j], DASHES[j % 4], color=COLOURS[h % 7], label=text,
                        linewidth=4.5 - 1.2 * min(h, 3), zorder=2 + h)  # fmt: skip
        for kind, values in (modes or {}).items():
            marker, colour = _MARKS.get(kind, ("x", GREY))
            ax.plot(np.asarray(values) * 1e-3, np.full(len(values), -0.05 * top), marker, color=colour,
                    markersize=5, label=f"{kind} modes", clip_on=False)  # fmt: skip
        ax.set_ylim(-0.09 * top, 1.05 * top)
        label(ax, title=title)
    for ax in axes[-columns:]:
        label(ax, x="frequency of the harmonic [kHz]")
    for ax in axes[::columns]:
        label(ax, y="mesh force [N]")
    legend_below(figure, columns=4)
    return figure


def _xy(points):
    return np.real(points), np.imag(points)
