"""Figures of modes.nc and dynamics.nc of helical cases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError
from femgear.plots.dynamic import draw_static, excited_harmonics, fine_positions, name_kinds
from femgear.plots.helical import draw_mode
from femgear.plots.style import (
    BLACK,
    COLOURS,
    DASHES,
    SIZE,
    family,
    label,
    legend_below,
    line_style,
    new_figure,
    periodic,
    rpm,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.gears import PlanetarySet

_MARKS = {"in phase": "o", "counter-phased": "s"}
_SHOWN, _COLUMNS, _HARMONICS, _SPEEDS = 12, 4, 4, 4


@dataclass(frozen=True)
class _Radii:
    """What the drawing of a mode needs of a set."""

    ring_radius: float
    sun_radius: float
    planet_radius: float
    centre_distance: float
    planet_angles: np.ndarray


def helical_modes_figures(
    modes: xr.Dataset, gears: PlanetarySet, static: xr.Dataset | None
) -> dict[str, Figure]:
    """Figures of modes.nc, by file name.

    Parameters
    ----------
    modes : xarray.Dataset
        Contents of modes.nc of a helical case.
    gears : PlanetarySet
        Of its transverse section.
    static : xarray.Dataset, optional
        Contents of static.nc, the spur gears of that section.
    """
    from femgear.gears.phasing import phasing_of_set
    from femgear.plots.phasing import phase_diagram

    figures = {
        "spatial_mode_shapes": spatial_mode_shapes(modes, gears),
        "mesh_phasing": phase_diagram(phasing_of_set(gears)),
    }
    if "helical_stiffness" in modes and static is not None:
        figures["helical_mesh_stiffness"] = helical_mesh_stiffness(modes, static)
    return figures


def spatial_mode_shapes(modes: xr.Dataset, gears: PlanetarySet, *, scale: float = 0.16) -> Figure:
    """The first twelve modes that are no rigid-body motions, each from the front and below it from the side.

    Parameters
    ----------
    modes : xarray.Dataset
    gears : PlanetarySet
    scale : float
        Largest displacement of each view as a share of the ring's radius.

    Raises
    ------
    CaseError
        No mode to show (E-MODES).
    """
    frequency = modes["frequency"].values
    shown = np.flatnonzero(frequency > 0.0)[:_SHOWN]
    if not len(shown):
        raise CaseError("no mode to draw", code="E-MODES", limit="a mode that is no rigid-body motion")
    data = _Radii(
        gears.ring.base_radius,
        gears.sun.base_radius,
        gears.planet.base_radius,
        gears.centre_distance,
        np.asarray(gears.planet_angles),
    )
    planets = [data.planet_radius] * gears.n_planets
    radii = np.array([data.centre_distance, data.ring_radius, data.sun_radius, *planets])
    moved = modes["shape"].values.reshape(len(radii), 6, -1).copy()
    moved[:, 3:] *= radii[:, None, None]
    columns = min(_COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = new_figure(rows=2 * rows, columns=columns, width=2.7 * columns, height=4.3 * rows + 0.6)
    axes[0].get_gridspec().set_height_ratios([1.25, 0.4] * rows)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for place, mode in enumerate(shown):
        row, column = divmod(place, columns)
        front, side = (axes[(2 * row + i) * columns + column] for i in (0, 1))
        draw_mode(front, side, data, moved[:, :, mode], scale)
        kind, phasing = str(modes["kind"].values[mode]), str(modes["phasing"].values[mode])
        front.set_title(f"mode {mode + 1}: {frequency[mode]:.6g} Hz\n{kind}\n{phasing}", fontsize=SIZE - 2)
    legend_below(figure, columns=5)
    return figure


def helical_mesh_stiffness(modes: xr.Dataset, static: xr.Dataset) -> Figure:
    """Stiffness and transmission error of the meshes of planet 1 beside those of the spur gears."""
    figure, axes = new_figure(rows=2, height=7.0, sharex=True)
    names, first = [str(name) for name in modes["mesh"].values], (0, modes.sizes["mesh"] // 2)
    for ax, ours, spur, scale, text in (
        (axes[0], "helical_stiffness", "mesh_stiffness", 1e-6, "mesh stiffness [N/µm]"),
        (axes[1], "helical_ste", "ste", 1e6, "transmission error [µm]"),
    ):
        for colour, row in zip(COLOURS, first):
            at, line = periodic(modes["position"], modes[ours].values[row] * scale)
            ax.plot(at, line, color=colour, label=f"helical, {names[row]}")
            at, line = periodic(static["position"], static[spur].values[row] * scale)
            ax.plot(at, line, ":", color=colour, label=f"spur, {names[row]}")
        label(ax, y=text)
    axes[0].set_ylim(bottom=0.0)
    axes[1].set_xlim(0.0, 1.0)
    label(axes[1], "position in the mesh period [1]")
    legend_below(figure, axes[0], columns=2)
    return figure


def transmission_errors(dynamics: xr.Dataset, modes: xr.Dataset) -> Figure:
    """Fluctuation of the dynamic transmission error over one mesh period beside the static one.

    Parameters
    ----------
    dynamics, modes : xarray.Dataset
        Contents of dynamics.nc, of which at most four speeds are drawn, and of modes.nc.
    """
    count = dynamics.sizes["speed"]
    speeds = sorted({round(i) for i in np.linspace(0, count - 1, min(count, _SPEEDS))})
    rows, columns = -(-len(speeds) // 2), min(len(speeds), 2)
    figure, axes = new_figure(
        rows=rows, columns=columns, width=max(5.0 * columns, 6.5), height=1.2 + 3.6 * rows, sharey=True
    )
    for ax in axes[len(speeds) :]:
        figure.delaxes(ax)
    h = dynamics["harmonic"].values
    position = fine_positions(int(h.max()))
    wave = np.exp(2j * np.pi * np.outer(h[h > 0], position))
    dte = 1e6 * (dynamics["dte_real"].values + 1j * dynamics["dte_imag"].values)[..., h > 0]
    ste = modes["helical_ste"].values
    # what is one line at one speed need not be one at another: the lines are those of all speeds
    lines = alike_lines(dynamics["mesh"].values, np.hstack([*(dte[speeds] @ wave).real, 1e6 * ste]))
    for ax, s in zip(axes, speeds):
        for i, (text, row) in enumerate(lines):
            style = line_style(i)
            ax.plot(position, (dte[s, row] @ wave).real, linewidth=2.0, label=text, **style)
            draw_static(ax, modes["position"], ste[row], excited_harmonics(dynamics, s), position, style)
        ax.set_xlim(0.0, 1.0)
        frequency = float(dynamics["mesh_frequency"].values[s])
        title = f"{rpm(dynamics['speed'].values[s])}, mesh frequency {frequency:.6g} Hz"
        label(ax, "position in the mesh period [1]", title=title)
    for ax in axes[: len(speeds) : 2]:
        label(ax, y="transmission error less its mean [µm]")
    name_kinds(axes[0], dynamics)
    legend_below(figure, columns=3)
    return figure


def alike_lines(names, values, *, tolerance: float = 1e-6) -> list[tuple[str, int]]:
    """Legend texts and row numbers of the curves to draw: one for all meshes of a kind whose curves agree.

    Parameters
    ----------
    names : sequence of str
        Mesh labels.
    values : (n, ...) array
        A row a mesh.
    tolerance : float
        Largest difference of curves counted as equal, relative to the largest value.
    """
    names, values = [str(name) for name in names], np.asarray(values)
    kinds, size, groups = [family(name) for name in names], np.abs(values).max(initial=0.0), []
    for row, kind in enumerate(kinds):
        for group in groups:
            near = np.abs(values[row] - values[group[0]]).max() <= tolerance * size
            if kinds[group[0]] == kind and near:
                group.append(row)
                break
        else:
            groups.append([row])
    lines = []
    for group in groups:
        text = ", ".join(names[row] for row in group)
        if 1 < len(group) == kinds.count(kinds[group[0]]):
            text = f"all {kinds[group[0]]} meshes"
        lines.append((text + " (identical)" if len(group) > 1 else text, group[0]))
    return lines


def mesh_force_spectra(dynamics: xr.Dataset, modes: xr.Dataset) -> Figure:
    """Amplitudes of the mesh forces of planet 1 over the frequency of every harmonic.

    Parameters
    ----------
    dynamics, modes : xarray.Dataset
        Contents of dynamics.nc and modes.nc; marks along the axis are natural frequencies by phasing.
    """
    order = np.argsort(dynamics["mesh_frequency"].values)
    hertz = dynamics["mesh_frequency"].values[order]
    force = np.hypot(dynamics["mesh_force_real"].values, dynamics["mesh_force_imag"].values)[order]
    count = min(_HARMONICS, force.shape[-1] - 1)
    names, n = [str(name) for name in dynamics["mesh"].values], dynamics.sizes["mesh"] // 2
    figure, axes = new_figure(rows=2, height=7.4, sharex=True)
    top = count * hertz.max()
    for ax, mesh in zip(axes, (0, n)):
        for h in range(1, count + 1):
            ax.plot(
                1e-3 * h * hertz, force[:, mesh, h], DASHES[(h - 1) % 4], color=COLOURS[h - 1],
                label=f"harmonic {h}",
            )  # fmt: skip
        _mark(ax, modes, top)
        ax.set_yscale("log")
        label(ax, y="mesh force [N]", title=names[mesh])
    axes[0].set_xlim(0.0, 1e-3 * top)
    label(axes[1], "frequency of the harmonic [kHz]")
    legend_below(figure, axes[0], columns=4)
    return figure


def _mark(ax, modes: xr.Dataset, top: float) -> None:
    """Natural frequencies as marks inside the lower edge, by the phasing of the mode."""
    found = modes["frequency"].values
    phasing = np.array([str(name) for name in modes["phasing"].values])
    for name in dict.fromkeys(phasing):
        here = found[(phasing == name) & (found > 0.0) & (found <= top)]
        if len(here):
            ax.plot(
                1e-3 * here, np.full(len(here), 0.03), _MARKS.get(name, "^"), color=BLACK, markersize=5,
                markerfacecolor="none", label=f"modes {name}", linestyle="none",
                transform=ax.get_xaxis_transform(),
            )  # fmt: skip
