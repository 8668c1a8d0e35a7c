"""Figures of stress.nc: one tooth on its way through the mesh, along its roots, pressures, load spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.style import BLACK, BLUE, GREY, SIZE, VERMILION, family, label, legend_below, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

TENSION, COMPRESSION = "root of the loaded flank, largest stress", "root of the back flank, lowest stress"
# tangent of the critical section after ISO 6336-3, external and internal gears
CRITICAL_SLOPE = {False: 30.0, True: 60.0}
KINDS = ("sun-planet", "planet-ring")


def root_stress_history(stress: xr.Dataset) -> Figure:
    """Root stresses of one tooth of every gear from mesh to mesh, on the planet with the largest tension.

    Parameters
    ----------
    stress : xarray.Dataset
        With ``root_tension`` and ``root_compression`` [Pa] and ``root_path`` [1] (mesh, gear, step); where
        it has ``iso_root_stress`` [Pa] (mesh, gear), the nominal stress is drawn too.

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
        _nominal(ax, row, "iso_root_stress", "σ_F0 of ISO 6336-3")
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
    """Stress along both roots of a tooth when its tension is largest, on the planet where that is largest.

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


def contact_pressure(stress: xr.Dataset) -> Figure:
    """Contact pressure of one tooth pair over its path, for both meshes of the planet with the largest.

    Parameters
    ----------
    stress : xarray.Dataset
        With ``pressure_distribution`` [Pa] (mesh, pair, cell, position), ``pressure_offset`` (mesh, cell),
        ``pressure_centre`` and ``pressure_path`` (mesh, pair, position) [m], ``contact_pressure`` [Pa] (mesh,
        position) and ``iso_contact_stress`` [Pa] (mesh).

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(rows=2, columns=2, width=9.5, height=6.6)
    top = float(stress["contact_pressure"].max()) * 1e-6 or 1.0
    # at the end of a flank the pressure grows as cells shrink: it only decides where there is no other
    edge = stress["pressure_distribution"].max(("pair", "cell", "position")).values
    planet = _worst_planet(stress, stress["contact_pressure"].max("position").values, edge)
    for upper, lower, kind in zip(axes[:2], axes[2:], KINDS):
        row = _mesh_of(stress, kind, planet)
        path, place, pressure = _along_path(row)
        upper.plot(path, pressure.max(axis=0), color=VERMILION, label="largest pressure")
        _nominal(upper, row, "iso_contact_stress", "σ_H0 of ISO 6336-2")
        upper.set_ylim(0.0, 1.6 * top)
        largest = float(row["contact_pressure"].max()) * 1e-6
        label(upper, title=f"{row['mesh'].item()}: {largest:.4g} MPa away from flank ends")
        image = lower.pcolormesh(
            np.broadcast_to(path, place.shape),
            place,
            np.ma.masked_less_equal(pressure, 0.0),
            shading="nearest",
            cmap="viridis",
            vmin=0.0,
            vmax=1.2 * top,
        )
        lower.set_xlim(upper.get_xlim())
        reach = 1.1 * np.abs(place[pressure > 0.0]).max(initial=0.0)
        lower.set_ylim(-reach or -1.0, reach or 1.0)
        label(lower, "path from the pitch point [mm]")
    label(axes[0], y="pressure [MPa]")
    label(axes[2], y="along the common tangent [µm]")
    figure.colorbar(image, ax=axes[2:], label="pressure [MPa]", extend="max")
    legend_below(figure, columns=2)
    highest = float(stress["pressure_distribution"].max()) * 1e-6
    if highest > top:
        text = f"up to {highest:.0f} MPa where a tip edge carries, cut here: no limit as cells shrink"
        figure.legends[0].set_title(text, prop={"size": SIZE - 1})
    return figure


def _along_path(row):
    """Path (k,) [mm], place (C, k) [um] and pressure (C, k) [MPa] of a tooth pair from entry to exit."""
    path = row["pressure_path"].values.ravel()
    pressure = row["pressure_distribution"].values.swapaxes(0, 1).reshape(-1, len(path))
    place = row["pressure_offset"].values[:, None] + row["pressure_centre"].values.ravel()
    order = np.argsort(path, kind="stable")
    loaded = np.flatnonzero(pressure[:, order].any(axis=0))
    first, last = (loaded[0], loaded[-1]) if len(loaded) else (0, len(order) - 1)
    order = order[max(first - 1, 0) : last + 2]
    return path[order] * 1e3, place[:, order] * 1e6, pressure[:, order] * 1e-6


def load_spectrum(stress: xr.Dataset) -> Figure:
    """Load spectrum of the teeth in both meshes of the planet with the largest load.

    Parameters
    ----------
    stress : xarray.Dataset
        With ``load_time_share`` and ``load_cycle_share`` (mesh, load_bin) [1], ``load_bin_low`` and
        ``load_bin_high`` (load_bin) [N], ``load_cycles`` (mesh, gear) [1].

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(columns=2, width=9.5, sharex=True, sharey=True)
    edges = np.append(stress["load_bin_low"].values, stress["load_bin_high"].values[-1:])
    time = stress["load_time_share"].values
    planet = _worst_planet(stress, (edges[1:] * (time > 0.0)).max(axis=1), time @ edges[1:])
    for ax, kind in zip(axes, KINDS):
        row = _mesh_of(stress, kind, planet)
        time, cycles = (100 * row[f"load_{name}_share"].values for name in ("time", "cycle"))
        ax.stairs(time, edges, fill=True, color=BLUE, alpha=0.75, label="share of the time under load")
        ax.stairs(
            cycles, edges, color=VERMILION, linewidth=1.8, label="share of the load cycles, by their peak"
        )
        counts = zip(kind.split("-"), row["load_cycles"].values)
        text = ", ".join(f"{name} {float(count):.3g}" for name, count in counts)
        label(ax, "load of the tooth [N]", title=f"{row['mesh'].item()}; cycles a turn: {text}")
    axes[0].set_ylim(0.0, 105.0)
    label(axes[0], y="share [%]")
    legend_below(figure, columns=2)
    return figure


def planet_bending(stress: xr.Dataset) -> Figure:
    """Stress in both roots of a tooth of the worst planet while it turns once against the carrier.

    Parameters
    ----------
    stress : xarray.Dataset
        With ``planet_root_stress`` [Pa] (mesh, turn).

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure()
    values = stress["planet_root_stress"].values * 1e-6
    planets = len(values) // 2
    worst = int(np.ptp(values, axis=1).argmax()) % planets
    lines = ((worst, VERMILION, "-", "sun side"), (worst + planets, BLUE, "--", "ring side"))
    for row, colour, dash, side in lines:
        text = f"root of the {side} flank: {values[row].min():.4g} to {values[row].max():.4g} MPa"
        ax.plot(stress["turn"].values, values[row], dash, color=colour, label=text)
    ax.axhline(0.0, color="0.4", linewidth=0.8)
    label(ax, "turns since the pitch point with the sun [1]", "stress [MPa]", f"planet {worst + 1}")
    legend_below(figure, columns=1)
    return figure


def _mesh_of(stress: xr.Dataset, kind: str, planet: int) -> xr.Dataset:
    """The mesh of a kind on a planet (from 0)."""
    names = [str(name) for name in stress["mesh"].values]
    return stress.isel(mesh=[i for i, name in enumerate(names) if family(name) == kind][planet])


def _worst_planet(stress: xr.Dataset, *measures: np.ndarray) -> int:
    """Planet (from 0) whose meshes have the largest of a measure (mesh,); the next measure decides ties."""
    kinds = [family(str(name)) for name in stress["mesh"].values]
    of_planets = [
        np.max([measure[[kind == wanted for kind in kinds]] for wanted in KINDS], axis=0)
        for measure in measures
    ]
    left = np.arange(len(of_planets[0]))
    for values in of_planets:
        known = np.nan_to_num(values[left])
        # equal planets differ by rounding
        left = left[known >= known.max() - 1e-6 * np.abs(known).max()]
    return int(left[0])


def _nominal(ax, row: xr.Dataset, name: str, text: str) -> None:
    """Line at a nominal stress, where it is known."""
    if name in row and np.isfinite(row[name].item()) and row[name].item() > 0.0:
        ax.axhline(row[name].item() * 1e-6, color=BLACK, linewidth=1.2, linestyle="-.", label=text)


def _four_gears(stress: xr.Dataset):
    """Title, rows and whether it is internal, of sun, planet on both sides, and ring."""
    tension = stress["root_tension"].max([dim for dim in stress["root_tension"].dims if dim != "mesh"])
    n = _worst_planet(stress, tension.values)
    sides = (
        ("sun", f"planet {n + 1}, sun side"),
        (f"planet {n + 1}, ring side", "ring"),
    )
    for kind, titles in zip(KINDS, sides):
        for gear, title in enumerate(titles):
            yield title, _mesh_of(stress, kind, n).isel(gear=gear), title == "ring"


def _crossing(slope, arc, angle) -> float | None:
    """First place at which the slope passes an angle; None when it does not."""
    above = np.flatnonzero((slope[:-1] < angle) & (slope[1:] >= angle))
    if not len(above):
        return None
    i = above[0]
    return float(arc[i] + (arc[i + 1] - arc[i]) * (angle - slope[i]) / (slope[i + 1] - slope[i]))
