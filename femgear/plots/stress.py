"""Figures of root stresses: one tooth on its way through the mesh, and along its roots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.style import BLUE, GREY, VERMILION, family, label, legend_below, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

TENSION, COMPRESSION = "root of the loaded flank, largest stress", "root of the back flank, lowest stress"
# tangent of the critical section after ISO 6336-3, external and internal gears
CRITICAL_SLOPE = {False: 30.0, True: 60.0}


def root_stress_history(stress: xr.Dataset) -> Figure:
    """Root stresses of one tooth of every gear from mesh to mesh, for the meshes of the first planet.

    Parameters
    ----------
    stress : xarray.Dataset
        With ``root_tension`` and ``root_compression`` [Pa] and ``root_path`` [1] (mesh, gear, step).

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(rows=2, columns=2, width=9.5, height=6.6, sharex=True, sharey=True)
    for ax, (title, row, _) in zip(axes, _four_gears(stress)):
        path = row["root_path"].values
        ax.plot(path, row["root_tension"].values * 1e-6, color=VERMILION, label=TENSION)
        ax.plot(path, row["root_compression"].values * 1e-6, color=BLUE, linestyle="--", label=COMPRESSION)
        ax.axhline(0.0, color="0.4", linewidth=0.8)
        largest = float(row["root_tension"].max()) * 1e-6
        lowest = float(row["root_compression"].min()) * 1e-6
        label(ax, title=f"{title}: {largest:.3g} and {lowest:.3g} MPa")
    for ax in axes[2:]:
        label(ax, "path from the pitch point [base pitches]")
    for ax in axes[::2]:
        label(ax, y="stress [MPa]")
    legend_below(figure, columns=2)
    return figure


def root_stress_profile(stress: xr.Dataset) -> Figure:
    """Stress along both roots of a tooth when its tension is largest, for the meshes of the first planet.

    Parameters
    ----------
    stress : xarray.Dataset
        With ``root_profile`` (mesh, gear, root, point) [Pa], ``root_arc`` [m] and ``root_slope`` [rad]
        (mesh, gear, point).

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(rows=2, columns=2, width=9.5, height=6.6, sharey=True)
    for ax, (title, row, internal) in zip(axes, _four_gears(stress)):
        arc, slope = row["root_arc"].values * 1e3, np.degrees(row["root_slope"].values)
        for side, colour, dash in (("loaded", VERMILION, "-"), ("back", BLUE, "--")):
            values = row["root_profile"].sel(root=side).values * 1e-6
            ax.plot(
                arc, values, dash, color=colour, marker="o", markersize=3, label=f"root of the {side} flank"
            )
        ax.axhline(0.0, color="0.4", linewidth=0.8)
        angle = CRITICAL_SLOPE[internal]
        known = np.isfinite(arc)
        place = _crossing(slope[known], arc[known], angle)
        if place is not None:
            text = "critical section of ISO 6336-3 (tangent 30°, internal gears 60°)"
            ax.axvline(place, color=GREY, linewidth=1.2, linestyle=":", label=text)
        label(ax, "arc from the end of the flank [mm]", title=title)
    for ax in axes[::2]:
        label(ax, y="stress [MPa]")
    legend_below(figure, columns=3)
    return figure


def _four_gears(stress: xr.Dataset):
    """Title, rows and whether it is internal, of sun, planet on both sides, and ring."""
    names = [str(name) for name in stress["mesh"].values]
    gears = {"sun-planet": ("sun", "planet, sun side"), "planet-ring": ("planet, ring side", "ring")}
    for kind, titles in gears.items():
        mesh = next(i for i, name in enumerate(names) if family(name) == kind)
        for gear, title in enumerate(titles):
            yield title, stress.isel(mesh=mesh, gear=gear), title == "ring"


def _crossing(slope, arc, angle) -> float | None:
    """First place at which the slope passes an angle; None when it does not."""
    above = np.flatnonzero((slope[:-1] < angle) & (slope[1:] >= angle))
    if not len(above):
        return None
    i = above[0]
    return float(arc[i] + (arc[i + 1] - arc[i]) * (angle - slope[i]) / (slope[i + 1] - slope[i]))
