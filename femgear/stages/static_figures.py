"""Figures of static.nc and stress.nc: errors, stiffnesses, loads, the deformed set, stresses of one tooth.

What the gears do over one mesh period, and one tooth on its way through the mesh, with the stresses along its
roots, contact pressures and load spectra; deviations as measuring machines draw them, profiles over the roll
angle and pitches over the teeth. `FIGURES` at the end ties the pictures of the report to their captions.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import materials_of, planetary_set, set_deviations
from femgear.case.planetary import Case
from femgear.contact.bodies import Sector, Sectors, make_sectors
from femgear.contact.cycle import CycleOptions, loaded_image, walk_mesh_cycle
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.tooth_loads import DeformedBody, deformed_set
from femgear.fe.compliance import mirror_nodes
from femgear.fe.grid import copy_nodes, rotated_copies
from femgear.gears.deviations import SetDeviations, loaded_flanks
from femgear.gears.faults import ToothFault
from femgear.gears.gear import Gear
from femgear.gears.modifications import form_deviation
from femgear.gears.pair import GearSet
from femgear.gears.short_teeth import marked_teeth, renumbered, short_teeth, without_tips
from femgear.report.scene import View, assemble_set, deformed_picture, placed, whole_field, write_vtu
from femgear.report.solid import SOLID, solid
from femgear.report.style import (
    ALIKE,
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    SIZE,
    VERMILION,
    Drawings,
    drawn_lines,
    family,
    label,
    legend_below,
    line_style,
    name_curves,
    new_figure,
    periodic,
    position_words,
)
from femgear.stages.gears_in_space import write_gears_in_space
from femgear.stages.heat_figures import HEAT_FIGURES, LOSSES_FIGURES
from femgear.stages.life_figures import LIFE_FIGURES
from femgear.stages.protocol import Drawn, Figures
from femgear.stages.static import over_width, static_supports
from femgear.stages.static_results import SIDES, UNEQUAL, StaticResult, peak_to_peak, shares
from femgear.stages.stress_reasons import largest_pressure
from femgear.stages.tooth_faults import fault_words
from femgear.storage.files import write_text

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


_TENSION, _COMPRESSION = "root of the loaded flank, largest stress", "root of the back flank, lowest stress"
# tangent of the critical section after ISO 6336-3, external and internal gears
_CRITICAL_SLOPE = {False: 30.0, True: 60.0}
# largest displacement of the deformed set [modules]: teeth bend and do not cross
_SHOWN = 0.25


def static_transmission_error(static: xr.Dataset) -> Figure:
    """Draw the static transmission error of every mesh, and of sun to ring over every planet (static.nc).

    Those of meshes stand about their means: the softer mesh of a set winds up several times its ripple further.
    """
    figure, (left, right) = new_figure(columns=2, height=3.6, sharex=True)
    drawn = drawn_lines(static["mesh"].values, static["ste"], partly=True, within=ALIKE)
    position, each = _with_between(static, "ste")
    if len(drawn) == len(_kinds(static)) == 1:
        return _one_error(position, each[0], drawn[0][0])
    for i, (text, row) in enumerate(drawn):
        left.plot(position, each[row] - static["ste"].values[row].mean() * 1e6, label=text, **line_style(i))
    overall = _with_between(static, "ste_overall")[1]
    planets = _of_planets(static, overall)
    for i, (text, row) in enumerate(planets, len(drawn)):
        right.plot(position, overall[row], label=f"sun to ring over {text}", **line_style(i))
    right.set_xlim(0, position[-1])
    sizes = peak_to_peak(static, "ste") * 1e6
    size = " and ".join(f"{sizes[row]:.3g}" for _, row in drawn[:: max(len(drawn) - 1, 1)])
    size = size if len(drawn) == 2 else f"up to {sizes.max():.3g}"
    text = "transmission error\nless its mean [µm]"
    label(left, position_words(position), text, f"each mesh\npeak to peak {size} µm")
    size = f"{'up to ' * (len(planets) > 1)}{peak_to_peak(static, 'ste_overall').max() * 1e6:.3g}"
    label(right, position_words(position), "sum of both meshes [µm]", f"sun to ring\npeak to peak {size} µm")
    if len(drawn) == 2 and len(planets) == 1:
        name_curves(left)
    else:
        legend_below(figure, columns=2)
    return figure


def _with_between(static: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Positions of static.nc and those between from end to end, and a transmission error there [um]."""
    position, values = static["position"].values, static[name].values
    if f"{name}_between" in static:
        position = np.concatenate([position, static["between"].values])
        values = np.concatenate([values, static[f"{name}_between"].values], axis=-1)
    order = np.argsort(position, kind="stable")
    position, values = position[order], values[:, order] * 1e6
    # a record that does not close has its end
    ends = position[-1] - position[0] >= static.attrs.get("mesh_periods", 1) - 1e-9
    return (position, values) if ends else periodic(position, values)


def _one_error(position: np.ndarray, error: np.ndarray, title: str) -> Figure:
    """Draw the transmission error of a pair [um]."""
    figure, (ax,) = new_figure(height=3.6)
    ax.plot(position, error, **line_style(0))
    ax.set_xlim(0, position[-1])
    title += f": peak to peak {np.ptp(error):.3g} µm"
    label(ax, position_words(position), "transmission error [µm]", title)
    return figure


def draw_mesh_stiffness(static: xr.Dataset, *, face_width: float | None = None) -> Figure:
    """Draw the tangent and secant stiffness of every mesh (static.nc).

    The face width [m] adds an axis with the stiffness per face width in N/(mm µm), as standards print it.
    """
    lines = drawn_lines(static["mesh"].values, static["mesh_stiffness"], partly=True, within=ALIKE)
    # two families of curves that differ from planet to planet would cover one another
    kinds = list(dict.fromkeys(family(text) for text, _ in lines)) if len(lines) > 2 else [""]
    figure, axes = new_figure(rows=len(kinds), height=1.6 + 3.2 * len(kinds), sharex=True)
    for i, (text, row) in enumerate(lines):
        ax = axes[kinds.index(family(text)) if len(kinds) > 1 else 0]
        for name, width, kind in (("mesh_stiffness", 2.2, ""), ("mesh_stiffness_secant", 0.9, "secant")):
            position, value = periodic(static["position"], static[name][row] * 1e-6)
            # the legend tells meshes by colour and dash, the two kinds of stiffness by width
            ax.plot(position, value, linewidth=width, label="_" * bool(kind) + text, **line_style(i))
    for kind, width in (("tangent (thick)", 2.2), ("secant (thin)", 0.9)):
        axes[-1].plot([], [], color=BLACK, linewidth=width, label=kind)
    axes[-1].set_xlim(0, position[-1])
    label(axes[-1], position_words(position))
    # N/m over m of width is 1e-9 N/(mm µm)
    factor = 1e-3 / face_width if face_width else 0.0
    for ax, kind in zip(axes, kinds):
        label(ax, y="mesh stiffness [N/µm]", title=f"{kind} meshes" if kind else "")
        if factor:
            second = ax.secondary_yaxis("right", functions=(lambda k: k * factor, lambda c: c / factor))
            second.set_ylabel("per face width [N/(mm µm)]", fontsize=SIZE)
            second.tick_params(labelsize=SIZE - 1)
    legend_below(figure, columns=2 if len(lines) < 4 else 4)
    return figure


def load_sharing(static: xr.Dataset) -> Figure:
    """Draw the share of every planet in the sun's torque over the mesh period (static.nc).

    The title tells the planet load factor K_gamma of ISO 6336-1, the largest mean share over the equal one.
    """
    position, share = periodic(static["position"], static["load_share"].values * 100)
    equal, names = 100.0 / len(share), _of_planets(static, share)
    largest, factor, held = shares(static)
    figure, (ax,) = new_figure(height=2.4 if len(names) == 1 else 3.6)
    for i, (text, row) in enumerate(names):
        ax.plot(position, share[row], label=text, linewidth=2.0, **line_style(i))
    ax.set_xlim(0, position[-1])
    if len(names) == 1:
        ax.set_ylim(0.0, 1.5 * equal)
        size = f"{'up to ' * ('alike' in names[0][0])}{share.max():.4g} %"
        title = f"all {len(share)} planets carry {size} at every position; as means K_γ = {factor:.3f}"
    else:
        ax.axhline(equal, color=GREY, linewidth=1.2, linestyle=":", label=f"equal share {equal:.4g} %")
        highest = share.max(axis=1)
        most = f"planet {static['planet'].values[highest.argmax()]}"
        most = "every planet" if np.ptp(highest) < ALIKE * highest.max() else most
        title = f"{most} carries up to {share.max():.4g} % at one position; over all positions K_γ = {factor:.3f}"
        title += f", {held}" if largest > UNEQUAL else ""
    label(ax, position_words(position), "share of the torque [%]", title)
    if len(names) > 1:
        legend_below(figure, columns=4)
    else:
        name_curves(ax)
    return figure


def tooth_loads(static: xr.Dataset) -> Figure:
    """Draw the load of a tooth pair from first to last contact in both meshes of a planet (static.nc).

    The simultaneous pairs of the dataset are one base pitch apart on the path of contact, and a pair goes on
    to the next place with every mesh period: from period to period and place to place the loads are the
    history of one pair. The meshes are those of the first planet.
    """
    kinds = _kinds(static)
    figure, axes = new_figure(columns=len(kinds), sharey=True)
    names = [str(name) for name in static["mesh"].values]
    position, largest = static["position"].values, 0.0
    periods = int(static.attrs.get("mesh_periods", 1))
    for ax, kind in zip(axes, kinds):
        row = next(i for i, name in enumerate(names) if family(name) == kind)
        load, force = static["tooth_load"].values[row], static["mesh_force"].values[row]
        place = np.arange(len(load))[:, None]
        each = np.arange(len(position)).reshape(periods, -1)[place.ravel() % periods]
        path, load = (place + position[each] % 1.0).ravel(), load[place, each].ravel()
        carried = load > 1e-9 * force.max(initial=0.0)
        shown = _while_loaded(carried)
        ax.plot(path[shown] - path[carried.argmax()], load[shown], label="one tooth pair", color=COLOURS[0])
        largest = max(largest, load.max(initial=0.0), force.mean())
        ax.axhline(force.mean(), color="0.45", linewidth=1.0, linestyle=(0, (1, 2)), label="whole mesh, mean")
        label(ax, "path since the first contact [base pitches]", title=names[row])
    # the axes share one scale, which holds what both of them show
    axes[0].set_ylim(0, 1.05 * largest or 1.0)
    label(axes[0], y="load along the line of action [N]")
    legend_below(figure, columns=3)
    return figure


def face_load(static: xr.Dataset) -> Figure:
    """Draw the load per width of a tooth pair over path and face width in both meshes of a planet.

    From static.nc of slices; pairs go on as in `tooth_loads`.
    """
    scale = 1e-3 / static.attrs["face_width"]
    return _over_flank(
        static,
        "slice_load",
        scale,
        "load per width [N/mm]",
        lambda row: f"K_Hβ = {float(row['face_load_factor']):.3f}",
    )


def contact_pattern(static: xr.Dataset) -> Figure:
    """Draw the contact pressure of a tooth pair over path and face width in both meshes of a planet.

    As `face_load`; grey where the end of a flank carries, under which the pressure has no limit.
    """
    return _over_flank(
        static,
        "slice_pressure",
        1e-6,
        "contact pressure [MPa]",
        lambda row: f"up to {float(row['max_pressure'].max()) * 1e-6:.4g} MPa",
    )


def _over_flank(static: xr.Dataset, name: str, scale: float, words: str, title: Callable[[xr.Dataset], str]) -> Figure:
    """Draw values of a tooth pair over path and face width in both meshes of the first planet."""
    from matplotlib.colors import ListedColormap

    figure, axes = new_figure(columns=len(_kinds(static)), sharey=True)
    names, place = [str(name) for name in static["mesh"].values], 1e3 * static["slice"].values
    position = static["position"].values
    rows = [next(i for i, other in enumerate(names) if family(other) == kind) for kind in _kinds(static)]
    periods = int(static.attrs.get("mesh_periods", 1))
    largest, most = (static[variable].values[rows].max() for variable in (name, "slice_load"))
    for ax, row in zip(axes, rows):
        values, load = (static[variable].values[row].swapaxes(0, 1) for variable in (name, "slice_load"))
        slot = np.arange(load.shape[1])[:, None]
        each = np.arange(len(position)).reshape(periods, -1)[slot.ravel() % periods]
        path = (slot + position[each] % 1.0).ravel()
        values, load = (array[:, slot, each].reshape(len(place), -1) for array in (values, load))
        carries = load > 1e-9 * most
        shown = _while_loaded(carries.any(axis=0))
        along = path[shown] - path[shown][0]
        if (edge := carries & (values <= 0.0))[:, shown].any():
            shade = np.ma.masked_equal(edge[:, shown], False)
            ax.pcolormesh(along, place, shade, cmap=ListedColormap([GREY]), shading="nearest", alpha=0.5)
        image = ax.pcolormesh(
            along,
            place,
            np.ma.masked_less_equal(scale * values[:, shown], 0.0),
            cmap="cividis",
            vmin=0.0,
            vmax=scale * largest or 1.0,
            shading="nearest",
        )
        label(
            ax,
            "path since the first contact [base pitches]",
            title=f"{names[row]}: {title(static.isel(mesh=row))}",
        )
    label(axes[0], y="place over the face width [mm]")
    figure.colorbar(image, ax=axes, label=words, pad=0.02)
    return figure


def _of_planets(static: xr.Dataset, rows) -> list[tuple[str, int]]:
    """Choose the lines to draw of the rows of all planets, with their texts: one of those that are alike."""
    names = [f"planet {planet}" for planet in static["planet"].values]
    return drawn_lines(names, rows, partly=True, within=ALIKE, whole="every planet")


def _kinds(data: xr.Dataset) -> tuple[str, ...]:
    """Kinds of mesh of a file, in order."""
    return tuple(dict.fromkeys(family(str(name)) for name in data["mesh"].values))


def _while_loaded(loaded: np.ndarray) -> slice:
    """Range of samples (n,) from one before the first loaded one to one behind the last."""
    loaded_places = np.flatnonzero(loaded)
    first, last = (loaded_places[0], loaded_places[-1]) if len(loaded_places) else (0, len(loaded) - 1)
    return slice(max(first - 1, 0), last + 2)


def root_stress_history(stress: xr.Dataset) -> Figure:
    """Draw root stresses of one tooth of each gear (stress.nc), on the planet with the largest.

    The nominal ones, ``iso_root_stress``, too, where the file has them.
    """
    gears = _flanks_of(stress)

    def draw(number: int, ax) -> str:
        title, row = gears[number]
        path, tension, compression = (row[f"root_{name}"].values for name in ("path", "tension", "compression"))
        ax.plot(path, tension * 1e-6, color=VERMILION, label=_TENSION)
        ax.plot(path, compression * 1e-6, color=BLUE, linestyle="--", label=_COMPRESSION)
        ax.axhline(0.0, color="0.4", linewidth=0.8)
        _nominal(ax, row, "iso_root_stress", "σ_F0 of ISO 6336-3")
        if number >= len(gears) - 2:
            label(ax, "path from the pitch point [base pitches]")
        largest = float(row.get("root_worst", tension.max()))
        return f"{title}: {largest * 1e-6:.3g} and {compression.min() * 1e-6:.3g} MPa".replace("-", "−")

    return _panels(draw, "stress [MPa]", len(gears), columns=2, sharex=True)


def root_stress_profile(stress: xr.Dataset) -> Figure:
    """Draw the stress along both roots of the tooth with the largest tension (stress.nc)."""
    gears = _flanks_of(stress)

    def draw(number: int, ax) -> str:
        title, row = gears[number]
        arc, slope = row["root_arc"].values * 1e3, np.degrees(row["root_slope"].values)
        for side, colour, dash in (("loaded", VERMILION, "-"), ("back", BLUE, "--")):
            values, text = row["root_profile"].sel(root=side).values * 1e-6, f"root of the {side} flank"
            ax.plot(arc, values, dash, color=colour, marker="o", markersize=3, label=text)
        ax.axhline(0.0, color="0.4", linewidth=0.8)
        given = np.isfinite(arc)
        place = _crossing(slope[given], arc[given], _CRITICAL_SLOPE[title == "ring"])
        if place is not None:
            text = "critical section of ISO 6336-3 (tangent 30°, internal gears 60°)"
            ax.axvline(place, color=GREY, linewidth=1.2, linestyle=":", label=text)
        label(ax, "arc from the end of the flank [mm]")
        return title

    return _panels(draw, "stress [MPa]", len(gears), columns=2)


def root_stress_over_width(stress: xr.Dataset) -> Figure:
    """Draw the stress in the root of the loaded flank over path and face width (stress.nc of slices).

    Of one tooth of each gear on its way through the mesh, on the planet with the largest.
    """
    gears, place = _flanks_of(stress), 1e3 * stress["slice"].values
    largest = max(float(row["root_over_width"].max()) for _, row in gears) * 1e-6 or 1.0

    def draw(number: int, ax) -> str:
        title, row = gears[number]
        shown = _while_loaded(row["root_load"].values > 0.0)
        values = row["root_over_width"].values[shown].T * 1e-6
        scale = {"cmap": "cividis", "vmin": 0.0, "vmax": largest, "shading": "nearest"}
        ax.pcolormesh(row["root_path"].values[shown], place, np.maximum(values, 0.0), **scale)
        if number >= len(gears) - 2:
            label(ax, "path from the pitch point [base pitches]")
        most = 1e-6 * float(row["root_worst"])
        return f"{title}\nup to {most:.3g} MPa, K_Fβ = {float(row['root_face_factor']):.3f}"

    figure = _panels(draw, "place over the face width [mm]", len(gears), columns=2)
    image = figure.axes[0].collections[0]
    figure.colorbar(image, ax=list(figure.axes), label="stress in the loaded root [MPa]", pad=0.02)
    return figure


def draw_contact_pressure(stress: xr.Dataset) -> Figure:
    """Draw the contact pressure of a tooth pair over its path (stress.nc), on the planet with the largest."""
    kinds = _kinds(stress)
    figure, axes = new_figure(rows=2, columns=len(kinds), height=6.0)
    top = float(stress["contact_pressure"].max()) * 1e-6 or 1.0
    # at the end of a flank the pressure grows as cells shrink: it only decides where there is no other
    edge = stress["pressure_distribution"].max(("pair", "cell", "position")).values
    planet = _worst_planet(stress, stress["contact_pressure"].max("position").values, edge)
    for upper, lower, kind in zip(axes[: len(kinds)], axes[len(kinds) :], kinds):
        row = _mesh_of(stress, kind, planet)
        path, place, pressure = _along_path(row)
        upper.plot(path, pressure.max(axis=0), color=VERMILION, label="largest pressure")
        _nominal(upper, row, "iso_contact_stress", "σ_H0 of ISO 6336-2")
        upper.set_ylim(0.0, 1.6 * top)
        largest = float(largest_pressure(row)) * 1e-6
        label(upper, title=f"{row['mesh'].item()}\n{largest:.4g} MPa away from flank ends")
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
    label(axes[len(kinds)], y="along the common tangent [µm]")
    figure.colorbar(image, ax=axes[len(kinds) :], label="pressure [MPa]", extend="max")
    legend_below(figure, columns=2)
    highest = float(stress["pressure_distribution"].max()) * 1e-6
    if highest > top:
        text = f"up to {highest:.0f} MPa where a tip edge carries, cut here: no limit as cells shrink"
        figure.legends[0].set_title(text)
        figure.legends[0].get_title().set_fontsize(SIZE - 1)
    return figure


def _along_path(row):
    """Find path (k,) [mm], place (C, k) [um] and pressure (C, k) [MPa] of a tooth pair from entry to exit."""
    path = row["pressure_path"].values.ravel()
    pressure = row["pressure_distribution"].values.swapaxes(0, 1).reshape(-1, len(path))
    place = row["pressure_offset"].values[:, None] + row["pressure_centre"].values.ravel()
    order = np.argsort(path, kind="stable")
    order = order[_while_loaded(pressure[:, order].any(axis=0))]
    return path[order] * 1e3, place[:, order] * 1e6, pressure[:, order] * 1e-6


def draw_load_spectrum(stress: xr.Dataset) -> Figure:
    """Draw the load spectrum of the teeth in both meshes of the planet with the largest load (stress.nc)."""
    kinds = _kinds(stress)
    figure, axes = new_figure(columns=len(kinds), sharex=True, sharey=True)
    edges = np.append(stress["load_bin_low"].values, stress["load_bin_high"].values[-1:])
    time = stress["load_time_share"].values
    planet = _worst_planet(stress, (edges[1:] * (time > 0.0)).max(axis=1), time @ edges[1:])
    for ax, kind in zip(axes, kinds):
        row = _mesh_of(stress, kind, planet)
        time, cycles = (100 * row[f"load_{name}_share"].values for name in ("time", "cycle"))
        ax.stairs(time, edges, fill=True, color=BLUE, alpha=0.75, label="share of the time under load")
        ax.stairs(cycles, edges, color=VERMILION, linewidth=1.8, label="share of the load cycles, by their peak")
        counts = zip(kind.split("-"), row["load_cycles"].values)
        text = ", ".join(f"{name} {float(count):.3g}" for name, count in counts)
        label(ax, "load of the tooth [N]", title=f"{row['mesh'].item()}; cycles a turn: {text}")
    axes[0].set_ylim(0.0, 105.0)
    label(axes[0], y="share [%]")
    legend_below(figure, columns=2)
    return figure


def planet_bending(stress: xr.Dataset) -> Figure:
    """Draw root stresses of a tooth while the worst planet turns once against the carrier (stress.nc)."""
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
    """Pick the mesh of a kind on a planet (from 0)."""
    names = [str(name) for name in stress["mesh"].values]
    return stress.isel(mesh=[i for i, name in enumerate(names) if family(name) == kind][planet])


def _worst_planet(stress: xr.Dataset, *measures: np.ndarray) -> int:
    """Find the planet (from 0) with the largest of a measure (mesh,); the next measure decides ties."""
    kinds = [family(str(name)) for name in stress["mesh"].values]
    of_planets = [
        np.max([measure[[kind == wanted for kind in kinds]] for wanted in dict.fromkeys(kinds)], axis=0)
        for measure in measures
    ]
    left = np.arange(len(of_planets[0]))
    for values in of_planets:
        sizes = np.nan_to_num(values[left])
        # equal planets differ by rounding
        left = left[sizes >= sizes.max() - 1e-6 * np.abs(sizes).max()]
    return int(left[0])


def _nominal(ax, row: xr.Dataset, name: str, text: str) -> None:
    """Draw a line at a nominal stress, where it is known."""
    if name in row and np.isfinite(row[name].item()) and row[name].item() > 0.0:
        ax.axhline(row[name].item() * 1e-6, color=BLACK, linewidth=1.2, linestyle="-.", label=text)


def _flanks_of(stress: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Name sun, planet on both sides, and ring of the planet with the largest tension, with their rows."""
    tension = stress["root_tension"].max([dim for dim in stress["root_tension"].dims if dim != "mesh"])
    n = _worst_planet(stress, tension.values)
    return [
        (title.replace("planet", f"planet {n + 1}"), _mesh_of(stress, kind, n).isel(gear=gear))
        for kind in _kinds(stress)
        for gear, title in enumerate(SIDES.get(kind, tuple(kind.split("-"))))
    ]


def _crossing(slope, arc, angle) -> float | None:
    """Find the first place at which the slope passes an angle; None when it does not."""
    above = np.flatnonzero((slope[:-1] < angle) & (slope[1:] >= angle))
    if not len(above):
        return None
    i = above[0]
    return float(arc[i] + (arc[i + 1] - arc[i]) * (angle - slope[i]) / (slope[i + 1] - slope[i]))


def _panels(draw: Callable[[int, object], str], y: str, count: int, *, columns: int, sharex: bool = False) -> Figure:
    """Draw all flanks in panels of one scale, two in a row; ``draw(panel, axes)`` gives titles."""
    rows = count // 2
    figure, axes = new_figure(rows=rows, columns=2, height=3.0 * rows, sharex=sharex, sharey=True)
    for number, ax in enumerate(axes):
        label(ax, title=draw(number, ax))
    for ax in axes[::2]:
        label(ax, y=y)
    legend_below(figure, columns=columns)
    return figure


def has_profiles(deviations: SetDeviations, planetary_set: GearSet) -> bool:
    """Tell whether any loaded flank differs from its involute, so that `profile_chart` shows something."""
    flanks = loaded_flanks(deviations, planetary_set)
    return any(form_deviation(form, gear, _stations(form, gear)).any() for _, form, gear in flanks)


def has_pitches(deviations: SetDeviations) -> bool:
    """Tell whether any tooth stands off its place, so that `pitch_chart` shows something."""
    d = deviations
    return any(p.any() for p in (d.sun_pitch, d.planet_pitch, d.planet_ring_side_pitch, d.ring_pitch))


def profile_chart(deviations: SetDeviations, planetary_set: GearSet) -> Figure:
    """Draw the profiles of the loaded flanks over the roll angle, positive with more material.

    The involute is the zero line; the part that meets the mate is marked.
    """
    active, flanks = active_rolls(planetary_set), loaded_flanks(deviations, planetary_set)

    def draw(number: int, ax) -> str:
        name, form, gear = flanks[number]
        roll = _stations(form, gear)
        ax.plot(_degrees(gear, roll), -1e6 * form_deviation(form, gear, roll), color=BLUE, label="profile")
        ax.axhline(0.0, color=BLACK, linewidth=0.8, label="involute")
        ax.axvspan(*_degrees(gear, np.array(active[number])), color="0.93", label="meets the mate")
        for place, end, dash in (("form circle", gear.form_roll, ":"), ("tip circle", gear.tip_roll, "--")):
            ax.axvline(float(_degrees(gear, end)), color=GREY, linestyle=dash, label=place)
        label(ax, "roll angle [deg]")
        return name

    return _deviation_panels(draw, len(flanks))


def pitch_chart(deviations: SetDeviations, planetary_set: GearSet) -> Figure:
    """Draw the cumulative pitch deviations of the loaded flanks over the teeth, positive with more material.

    Along the line of action; a line for each planet and flank that has any.
    """
    d, N = deviations, planetary_set.n_planets
    rows = (
        ("sun", [("sun", d.sun_pitch)]),
        ("planets, sun side", [(f"planet {n + 1}", d.planet_pitch[n]) for n in range(N)]),
        ("planets, ring side", [(f"planet {n + 1}", d.planet_ring_side_pitch[n]) for n in range(N)]),
        ("ring", [("ring", d.ring_pitch)]),
    )
    if not planetary_set.members:
        names = [gear.name.replace("_", " ") for gear in planetary_set.gears]
        rows = tuple((name, [(name, pitch)]) for name, pitch in zip(names, (d.sun_pitch, d.planet_pitch[0])))

    def draw(number: int, ax) -> str:
        title, lines = rows[number]
        for i, (name, values) in enumerate(lines):
            # sun, ring and planets differ in the common legend
            style = line_style(i if len(lines) > 1 else N + (title == "ring"))
            ax.step(np.arange(len(values)), -1e6 * values, where="mid", label=name, **style)
        label(ax, "tooth number [1]")
        return title

    return _deviation_panels(draw, len(rows))


def _deviation_panels(draw: Callable[[int, object], str], count: int) -> Figure:
    """Draw deviations of all kinds of flanks on a scale of at least one micrometre up and down."""
    figure = _panels(draw, "deviation [µm], material positive", count, columns=5)
    low, high = figure.axes[0].get_ylim()
    figure.axes[0].set_ylim(min(low, -1.0), max(high, 1.0))
    return figure


def active_rolls(planetary_set: GearSet) -> tuple[tuple[float, float], ...]:
    """Find the roll lengths [m] of the parts of the flanks that rigid gears use: sun, planet twice, ring.

    From the path of contact: ``r_b tan(alpha_w)`` and the path coordinate, which runs down the flank of a
    driven external gear.
    """
    rolls = []
    for pair in planetary_set.kinds:
        (gear_1, gear_2), tangent, (a, b) = pair.gears, math.tan(pair.working_pressure_angle), pair.path
        first, second = gear_1.base_radius * tangent, gear_2.base_radius * tangent
        rolls += [(first + a, first + b)]
        rolls += [(second + a, second + b) if gear_2.internal else (second - b, second - a)]
    return tuple(rolls)


def _stations(form, gear: Gear) -> np.ndarray:
    """Choose roll lengths [m] for curves, the corners of all laws and the measured points among them."""
    low, high = sorted((gear.form_roll, gear.tip_roll))
    corners = [getattr(m, "roll", None) or (m.start, m.end) for m in form.profile]
    extra = [roll for pair in corners for roll in pair if roll is not None and low < roll < high]
    return np.unique(np.concatenate([np.linspace(low, high, 301), extra]))


def _degrees(gear: Gear, roll):
    """Convert roll lengths [m] to roll angles [deg]."""
    return np.degrees(np.asarray(roll) / gear.base_radius)


def _static_figures(drawn: Drawn) -> Drawings:
    """Draw the figures of static.nc."""
    static = drawn.data["static"]
    over_width = {}
    if "slice_load" in static:
        over_width = {"face_load": partial(face_load, static), "contact_pattern": partial(contact_pattern, static)}
    sharing = {"load_sharing": partial(load_sharing, static)} if len(_kinds(static)) > 1 else {}
    width = _one_width(planetary_set(drawn.case))
    return Drawings(
        over_width
        | {
            "static_transmission_error": partial(static_transmission_error, static),
            "mesh_stiffness": partial(draw_mesh_stiffness, static, face_width=width),
            **sharing,
            "tooth_loads": partial(tooth_loads, static),
        }
    )


def _one_width(gears: GearSet) -> float | None:
    """Face width that all meshes have in common [m]; None where that of others differs."""
    least = min(gears.mesh_widths)
    return least if least == max(gears.mesh_widths) else None


def _stress_figures(drawn: Drawn) -> Drawings:
    """Draw the figures of stress.nc; distributions and turns are not in records of several mesh periods."""
    stress = drawn.data["stress"]
    figures = {
        "root_stress": partial(root_stress_history, stress),
        "root_profile": partial(root_stress_profile, stress),
        "load_spectrum": partial(draw_load_spectrum, stress),
    }
    if "root_over_width" in stress:
        figures["root_over_width"] = partial(root_stress_over_width, stress)
    if "pressure_distribution" in stress:
        figures["contact_pressure"] = partial(draw_contact_pressure, stress)
    if "planet_root_stress" in stress:
        figures["planet_bending"] = partial(planet_bending, stress)
    return Drawings(figures)


def _deviation_figures(drawn: Drawn) -> dict[str, Figure]:
    """Draw charts of profiles and pitches; none of a kind that the set does not have."""
    gears, deviations = planetary_set(drawn.case), set_deviations(drawn.case)
    figures = {}
    if has_profiles(deviations, gears):
        figures["profile_deviations"] = profile_chart(deviations, gears)
    if has_pitches(deviations):
        figures["pitch_deviations"] = pitch_chart(deviations, gears)
    return figures


def picture_sectors(drawn: Drawn, gears: GearSet) -> Sectors:
    """Make sectors of some thousand nodes: pictures need no converged stresses, and files stay small."""
    return make_sectors(gears, materials_of(drawn.case), flank_elements=6, refine=0.35, cache=drawn.cache)


def _write_deformed_set(drawn: Drawn, folder: Path) -> list[str]:
    """Write the whole set deformed by the static loads of position zero, as VTU and picture."""
    static, case = drawn.results.get("static"), drawn.case
    if static is None or not static.cycle.force.any():
        return []

    gears, backwards = static.planetary_set, static.sun_torque < 0
    loaded, order, cycle = _left_flanks_loaded(static, case, drawn.cache)
    sectors = picture_sectors(drawn, loaded)
    of_kind = {sector.gear.name: sector for sector in sectors.gears}
    bodies, deformed = [], deformed_set(loaded, sectors, cycle)
    if backwards:
        deformed = [_reflected(body, of_kind[body.kind], order) for body in deformed]
    names, faults = [body.name for body in deformed], _drawn_faults(static, case)
    short = _by_sectors(static, loaded, names, short_teeth(faults, loaded))
    marked = _by_sectors(static, loaded, names, marked_teeth(faults, fault_words(case)))
    for body in deformed:
        sector = of_kind[body.kind]
        count = sector.gear.teeth
        numbers, whole = copy_nodes(sector.grid, count), rotated_copies(sector.grid, count)
        whole = replace(
            whole, points=without_tips(whole.points, short.get(body.name, ()), count, internal=sector.gear.internal)
        )
        moved = whole_field(np.asarray(body.displacement), numbers)
        bodies.append(placed(whole, name=body.name, centre=body.centre, angle=body.angle, displacement=moved))
    grid = assemble_set(bodies)
    write_vtu(grid, folder / "deformed_set.vtu")
    torque, name = f"{static.sun_torque:.4g} N m".replace("-", "−"), gears.gears[0].name.replace("_", " ")
    title = f"deflection under {torque} on the {name}" if gears.members else f"{torque} on {name}"
    deformed_picture(
        grid,
        folder / "deformed_set.png",
        title=title,
        largest=_SHOWN * gears.gears[0].module,
        details=_mesh_views(static.planetary_set),
    )
    if not gears.members:
        return ["deformed_set.vtu", "deformed_set.png"]
    grids = {kind: sector.grid for kind, sector in of_kind.items()}
    look: Any = {"helix_angle": case.helix_angle or 0.0, "backwards": backwards, "short": short, "marked": marked}
    materials = dict(zip(grids, materials_of(case), strict=True))
    model = solid(gears, grids, deformed, materials, drawn.data.get("modes"), **look)
    if "stress" in drawn.data:
        # at which the colours end [MPa]
        model["root_stress"] = 1e-6 * float(np.nanmax(drawn.data["stress"]["root_worst"].values))
    write_text(json.dumps(model, allow_nan=False, separators=(",", ":")), folder / SOLID)
    return ["deformed_set.vtu", "deformed_set.png", SOLID]


def _mesh_views(gears: GearSet) -> list[View]:
    """Look at the pitch points of all kinds of mesh of the first planet, three pitches to either side."""
    half, along, views = 3.0 * math.pi * gears.gears[0].module, np.exp(1j * gears.planet_angles[0]), []
    for kind, (pair, rows) in enumerate(zip(gears.kinds, gears.kind_rows, strict=True)):
        radius = pair.gear_1.base_radius / math.cos(pair.working_pressure_angle)
        at = gears.centres[gears.mates[kind][0]][0] + radius * along
        views.append(View(f"mesh {gears.mesh_names[rows.start]}", (at.real, at.imag), half))
    return views


def _drawn_faults(static: StaticResult, case: Case) -> tuple[ToothFault, ...]:
    """List the faults of the set that is drawn: of a negative torque those of the mirror image, in the same order."""
    deviations = loaded_image(static.planetary_set, static.sun_torque, set_deviations(case))[2]
    return () if deviations is None else deviations.faults


def _by_sectors(
    static: StaticResult, loaded: GearSet, names: list[str], teeth: Mapping[tuple[int, int], Any]
) -> dict[str, Any]:
    """Order teeth of gears and their copies by the names of the drawn bodies, as their sectors are counted.

    Those of a mirror image that is seen from behind are counted the other way round.
    """
    sense = 1 if static.sun_torque >= 0 else -1
    return {
        name: renumbered(
            [(sense * number, what) for number, what in teeth.get((body.gear, body.copy), ())],
            0,
            loaded.gears[body.gear].teeth,
        )
        for name, body in zip(names, loaded.bodies, strict=True)
    }


def _left_flanks_loaded(
    static: StaticResult, case: Case, cache: Path | None = None
) -> tuple[Any, np.ndarray, MeshCycle]:
    """The set, its planets in the order of the original, and its static state at position zero.

    Of a negative torque those of the mirror image.
    """
    if static.sun_torque >= 0:
        return static.planetary_set, np.arange(static.planetary_set.n_planets), static.cycle
    gears, order, deviations = loaded_image(static.planetary_set, static.sun_torque, set_deviations(case))
    width = over_width(case, static.planetary_set, waves=static.waves, cache=cache)
    cycle = walk_mesh_cycle(
        gears,
        static.bodies,
        sun_torque=-static.sun_torque,
        positions=1,
        contact=case.static.contact,
        deviations=deviations,
        supports=static_supports(case),
        options=CycleOptions(both_flanks=case.static.back_flanks, **width).mirrored(order),
    )
    return gears, order, cycle


def _reflected(body: DeformedBody, sector: Sector, order: np.ndarray) -> DeformedBody:
    """Turn a body of the mirror image to be seen from behind, as that of the set itself.

    Teeth are numbered the other way round; planet n of the image is planet ``order[n]`` of the set.
    """
    kind, _, number = body.name.partition(" ")
    moved, image = np.asarray(body.displacement), mirror_nodes(sector.grid)
    teeth = -np.arange(len(moved)) % len(moved)
    return DeformedBody(
        f"{kind} {order[int(number) - 1] + 1}" if number.isdecimal() and len(order) > 1 else body.name,
        body.kind,
        body.centre * np.array([1.0, -1.0]),
        -body.angle,
        moved[teeth][:, image] * np.array([1.0, -1.0]),
    )


_STATIC = Figures(
    {
        "static_transmission_error": (
            "Static transmission error over one mesh period: every mesh along its line of action, several ones less "
            "their means, and from sun to ring. Sun and planets held at their bores, ring at its outer surface."
        ),
        "mesh_stiffness": (
            "Mesh stiffness over one mesh period: tangent dF/dδ of the loaded mesh (thick) and secant F/δ (thin)."
        ),
        "load_sharing": (
            "Share of every planet in the torque of the sun, and the planet load factor K_γ: the largest "
            "mean share over the equal one. Members are held, or on their supports, as static.members says."
        ),
        "tooth_loads": "Load of one tooth pair from its first to its last contact.",
        "face_load": (
            "Load per width of one tooth pair from its first to its last contact over the face width, and "
            "the face load factor K_Hβ: the largest load per width over the mean of that pair."
        ),
        "contact_pattern": (
            "Contact pressure of one tooth pair over path and face width, by Hertz's law from the load of "
            "every slice; grey where the end of a flank carries, under which the pressure has no limit."
        ),
        "profile_deviations": (
            "Deviations of the loaded flanks from the involute over the roll angle, positive with more material."
        ),
        "pitch_deviations": "Cumulative pitch deviations of the loaded flanks over the tooth number.",
        "deformed_set": (
            "Deformed set under the static load at position 0, whole and both meshes of the first planet; at "
            "rest in grey. The teeth that carry bend; what is pale hardly moves. Of helical teeth the "
            "transverse section."
        ),
    },
    draw=_static_figures,
    write=(_write_deformed_set,),
)


_STRESSES = Figures(
    {
        "contact_pressure": (
            "Contact pressure of one tooth pair on its way through the mesh: largest value beside the "
            "nominal stress of ISO 6336-2, and distribution along the common tangent. At the ends tip "
            "corners touch."
        ),
        "load_spectrum": (
            "Load spectrum of a tooth: share of the time under load in every load class, and the largest "
            "loads of its load cycles."
        ),
        "root_stress": (
            "Stress in the roots of one tooth on its way through the mesh, beside the nominal stress of ISO 6336-3."
        ),
        "root_over_width": (
            "Largest stress in the root of the loaded flank over path and face width, and the face load "
            "factor K_Fβ: the largest root stress over its mean across the width."
        ),
        "root_profile": (
            "Stress along the roots of the tooth when its tension is largest; dotted the section of ISO "
            "6336-3, where the tangent stands at 30° (internal gears 60°) to the centreline of the tooth."
        ),
        "planet_bending": (
            "Stress in the roots of a planet's tooth while the planet turns once against the carrier: the sun bends it "
            "one way, the ring the other."
        ),
    },
    draw=_stress_figures,
)


FIGURES = {
    "static": _STATIC,
    "stress": _STRESSES,
    "life": LIFE_FIGURES,
    "heat": HEAT_FIGURES,
    "losses": LOSSES_FIGURES,
    "": Figures({}, draw=_deviation_figures, write=(write_gears_in_space,)),
}
