"""Figures of a helical case: modes from the front and from the side, stiffness of the meshes, mesh forces.

They read modes.nc and dynamics.nc; `phase_diagram` shows the phases of the meshes and what they cancel.
`FIGURES` at the end ties the pictures of the report to their captions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.gears.phasing import MeshPhasing, PhasingTable, phase_factors, phasing_of_set, phasing_table
from femgear.report.response import (
    RESPONSE_CAPTIONS,
    response_figures,
    stored_harmonics,
    transmission_error_period,
)
from femgear.report.scene import rounded
from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    DASHES,
    GREEN,
    GREY,
    ORANGE,
    SIZE,
    VERMILION,
    Drawings,
    label,
    legend_below,
    line_style,
    new_figure,
    periodic,
    rpm,
    xy,
)
from femgear.stages.protocol import Drawn, Figures
from femgear.stages.static_figures import FIGURES as STATIC
from femgear.system.fourier import fluctuation
from femgear.system.rigid_bodies import CENTRAL, gear_geometry

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.gears.planetary import PlanetarySet

_CIRCLE = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 181))
_BODIES = {"carrier": GREEN, "ring": BLACK, "sun": VERMILION, "planets": BLUE}
# shapes that are shown and that stand in a row, harmonics of mesh forces, decades below the largest of them
_SHOWN, _COLUMNS, _HARMONICS, _DECADES = 8, 4, 4, 1e-4
# half heights of the views over the ring's radius, and where bodies stand in the one from the side
_FRONT, _SIDE = 1.25, 0.9
_ROWS = {"carrier": 0.66, "ring": 0.22, "sun": -0.22, "planets": -0.66}
# largest ratio of the magnifications of both views
_MOST = 1e4
# relative difference of frequencies that are those of one pair of modes
_PAIR = 1e-6

_MARKS = {"in phase": "o", "counter-phased": "s"}


def _pitch_radii(data) -> tuple[float, float, float]:
    """Working pitch radii of ring, sun and planet [m]: their circles touch.

    The centre distance is divided as the base radii are. Where the meshes of a planet have two pitch circles,
    the smaller one stands for it.
    """
    a, ring, sun, planet = data.centre_distance, data.ring_radius, data.sun_radius, data.planet_radius
    outer, inner = a / (ring - planet), a / (sun + planet)
    return outer * ring, inner * sun, min(outer, inner) * planet


def _bodies(data):
    """Legend text, colour, centre, drawn radius and radius that turns arcs into angles, of every body.

    In the order of the coordinates; rotations and tilts are arcs on base circles.
    """
    ring, sun, planet = _pitch_radii(data)
    drawn = (data.centre_distance, ring, sun)
    bases = (data.centre_distance, data.ring_radius, data.sun_radius)
    for name, radius, base in zip(CENTRAL, drawn, bases):
        yield name, _BODIES[name], 0j, radius, base
    for centre in data.centre_distance * np.exp(1j * np.asarray(data.planet_angles)):
        yield "planets", _BODIES["planets"], centre, planet, data.planet_radius


def _draw_front(ax, data, moved: np.ndarray) -> None:
    for (name, colour, centre, radius, base), (x, y, _, _, _, u) in zip(_bodies(data), moved):
        spoke = radius * np.exp(1j * (np.angle(centre) if centre else 0.0))
        style = {"linestyle": "--"} if name == "carrier" else {}
        for at, turn, look in (
            (centre, 0.0, {"color": "0.82", "linewidth": 1.0, "label": "at rest"}),
            (centre + x + 1j * y, u / base, {"color": colour, "linewidth": 1.5, "label": name} | style),
        ):
            ax.plot(*xy(at + radius * _CIRCLE), **look)
            ax.plot(*xy(np.array([at, at + spoke * np.exp(1j * turn)])), **look)
    _limits(ax, data, _FRONT)


def _draw_side(ax, data, moved: np.ndarray) -> None:
    """Draw every body as the line of its diameter along x, which tilts about y and moves along z.

    One row for the carrier, the ring, the sun and the planets each.
    """
    ring = _pitch_radii(data)[0]
    for (name, colour, centre, radius, base), (_, _, z, _, tilt, _) in zip(_bodies(data), moved):
        ends, row = np.array([-radius, radius]), _ROWS[name] * ring
        # a turn by phi about y lowers points at positive x
        height = z - tilt / base * ends
        ax.plot(centre.real + ends, [row, row], color="0.82", linewidth=1.0)
        ax.plot(centre.real + ends, row + height, color=colour, linewidth=2.2)
    _limits(ax, data, _SIDE)


def _limits(ax, data, high: float) -> None:
    ring = _pitch_radii(data)[0]
    ax.set_xlim(-1.25 * ring, 1.25 * ring)
    ax.set_ylim(-high * ring, high * ring)


def spatial_mode_shapes(modes: xr.Dataset, gears: PlanetarySet, *, scale: float = 0.16) -> Figure:
    """Draw the first eight shapes that are no rigid-body motions, from the front and, below, from the side.

    From the front: pitch circles, for the carrier the circle of planet centres, with a spoke that turns. Each
    view is magnified so that its largest displacement is the share ``scale`` of the ring's radius; the title
    of the lower one tells how they compare. Modes of one frequency are drawn once. E-MODES (CaseError): there
    is no such mode.
    """
    frequency = modes["frequency"].values
    elastic = np.flatnonzero(frequency > 0.0)
    if not len(elastic):
        raise CaseError("no mode to draw", code="E-MODES", limit="a mode that is no rigid-body motion")
    apart = np.flatnonzero(np.diff(frequency[elastic]) > _PAIR * frequency[elastic][1:]) + 1
    shown = np.split(elastic, apart)[:_SHOWN]
    data = SimpleNamespace(**gear_geometry(gears))
    planets = [data.planet_radius] * gears.n_planets
    radii = np.array([data.centre_distance, data.ring_radius, data.sun_radius, *planets])
    moved = modes["shape"].values.reshape(len(radii), 6, -1).copy()
    moved[:, 3:] *= radii[:, None, None]
    columns = min(_COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = new_figure(rows=2 * rows, columns=columns, width=2.7 * columns, height=5.4 * rows + 0.4)
    axes[0].get_gridspec().set_height_ratios([_FRONT, _SIDE] * rows)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for place, pair in enumerate(shown):
        row, column = divmod(place, columns)
        front, side = (axes[(2 * row + i) * columns + column] for i in (0, 1))
        # motions of every body x, y, z, tilts and rotation as arcs, in the axes of the set of `gear_geometry`
        motion, first = moved[:, :, pair[0]], pair[0]
        sizes = [np.abs(motion[:, axis]).max() for axis in ([0, 1, 5], [2, 3, 4])]
        # a view without motion shows none
        inside, across = np.maximum(sizes, max(sizes) / _MOST)
        _draw_front(front, data, scale * data.ring_radius / inside * motion)
        _draw_side(side, data, scale * data.ring_radius / across * motion)
        kind, phasing = str(modes["kind"].values[first]), str(modes["phasing"].values[first])
        names = " and ".join(str(mode + 1) for mode in pair)
        words = f"mode{'s' * (len(pair) > 1)} {names}: {float(f'{frequency[first]:.4g}'):g} Hz"
        front.set_title(f"{words}\n{kind}\n{phasing}", fontsize=SIZE - 1)
        side.set_title(f"axial motion, tilt: {rounded(100.0 * across / inside)} % of the above", fontsize=SIZE - 2)
    legend_below(figure, columns=5)
    return figure


def _mesh_stiffness(modes: xr.Dataset, static: xr.Dataset) -> Figure:
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
    """Draw the transmission errors of planet 1 over one mesh period beside the static ones of modes.nc.

    Those of dynamics.nc; its other planets have the same ones at other positions.
    """
    static, first = modes[["helical_ste"]].rename(helical_ste="ste"), [0, dynamics.sizes["mesh"] // 2]
    return transmission_error_period(dynamics.isel(mesh=first), static.isel(mesh=first), together=True)


def _mesh_force_spectra(dynamics: xr.Dataset, modes: xr.Dataset) -> Figure:
    """Amplitudes of the mesh forces of planet 1 over the frequency of every harmonic; modes are marked."""
    order = np.argsort(dynamics["mesh_frequency"].values)
    hertz = dynamics["mesh_frequency"].values[order]
    lines = stored_harmonics(dynamics, "mesh_force")[order]
    count = min(_HARMONICS, lines.shape[-1] - 1)
    names, n = [str(name) for name in dynamics["mesh"].values], dynamics.sizes["mesh"] // 2
    figure, axes = new_figure(rows=2, height=7.4, sharex=True)
    top = count * hertz.max()
    for ax, mesh in zip(axes, (0, n)):
        force = np.abs(lines[:, mesh, 1 : count + 1])
        for h, amplitude in enumerate(force.T, start=1):
            style = {"color": COLOURS[h - 1], "label": f"harmonic {h}"}
            ax.plot(1e-3 * h * hertz, amplitude, DASHES[(h - 1) % 4], **style)
        _mark(ax, modes, top)
        peak, h = np.unravel_index(force.argmax(), force.shape)
        at = (h + 1) * hertz[peak]
        where = f"harmonic {h + 1}: {force.max():.3g} N at {1e-3 * at:.4g} kHz"
        words = f"{names[mesh]}; largest in {where}{_excited(modes, at, lines[peak, :, h + 1])}"
        ax.plot(1e-3 * at, force.max(), "o", color=BLACK, markerfacecolor="none", markersize=9)
        ax.set_yscale("log")
        ax.set_ylim(_DECADES * force.max(), 3.0 * force.max())
        label(ax, y="mesh force [N]", title=words)
    axes[0].set_xlim(0.0, 1e-3 * top)
    label(axes[1], "frequency of the harmonic [kHz]")
    legend_below(figure, axes[0], columns=4)
    return figure


def _excited(modes: xr.Dataset, hertz: float, force: np.ndarray) -> str:
    """Name the mode within 5 % of a frequency [Hz] on which forces (meshes,) [N] do most work, if any."""
    near = np.flatnonzero(np.abs(modes["frequency"].values - hertz) < 0.05 * hertz)
    if not len(near):
        return ""
    mode = near[np.abs(modes["mesh_deflection"].values[:, near].T @ force).argmax()]
    return f", mode {mode + 1}: {modes['kind'].values[mode]!s}"


def _pin_forces(dynamics: xr.Dataset) -> Figure:
    """Fluctuation of forces and moments between pins and planets over the speed."""
    order = np.argsort(dynamics["speed"].values)
    speed = dynamics["speed"].values[order]
    figure, axes = new_figure(rows=2, height=7.0, sharex=True)
    for ax, name, unit in zip(axes, ("force", "moment"), ("N", "N m")):
        lines = stored_harmonics(dynamics, f"pin_{name}")[order]
        rms, mean = fluctuation(lines).max(axis=1), np.abs(lines[0, :, :, 0]).max(axis=0)
        # about its own axis the pin does not hold the planet
        held = np.flatnonzero(rms.max(axis=0) > _PAIR * rms.max())
        for i in held.tolist():
            steady = f"{mean[i]:.4g}" if mean[i] > _PAIR * mean.max() else "0"
            words = f"{name}, {dynamics['direction'].values[i]!s}: mean {steady} {unit}"
            ax.plot(speed, rms[:, i], label=words, **line_style(i))
        peak, i = np.unravel_index(rms.argmax(), rms.shape)
        largest = f"{dynamics['direction'].values[i]!s}, {rms.max():.3g} {unit} at {speed[peak]:.6g} rpm"
        ax.set_ylim(bottom=0.0)
        label(ax, y=f"{name} [{unit} r.m.s.]", title=f"largest fluctuation: {largest}")
    label(axes[1], "input speed [rpm]")
    legend_below(figure, columns=2)
    return figure


def _slice_forces(dynamics: xr.Dataset) -> Figure:
    """Load over face width and mesh period of the meshes of planet 1, at the speed where it changes most."""
    lines, height = stored_harmonics(dynamics, "slice_force"), 1e3 * dynamics["slice"].values
    width = 1e3 * float(dynamics.attrs["face_width"]) / len(height)
    speed = int(fluctuation(lines).max(axis=(1, 2)).argmax())
    position = np.linspace(0.0, 1.0, 129)
    wave = np.exp(2j * np.pi * np.outer(dynamics["harmonic"].values, 0.5 * (position[1:] + position[:-1])))
    first = [0, dynamics.sizes["mesh"] // 2]
    loads = np.real(lines[speed, first] @ wave) / width
    edges = np.append(height - 0.5 * width, height[-1] + 0.5 * width)
    figure, axes = new_figure(columns=2, width=10.0, sharey=True)
    for ax, mesh, load in zip(axes, first, loads):
        style = {"vmin": loads.min(), "vmax": loads.max(), "cmap": "cividis"}
        field = ax.pcolormesh(position, edges, load, **style)
        words = f"{dynamics['mesh'].values[mesh]!s}, {rpm(dynamics['speed'].values[speed])}: "
        words += f"{load.min():.3g} to {load.max():.3g} N/mm"
        label(ax, "position in the mesh period [1]", title=words)
    label(axes[0], y="height above mid-face [mm]")
    figure.colorbar(field, ax=axes, label="load along the tooth normal [N/mm]")
    return figure


def _mark(ax, modes: xr.Dataset, top: float) -> None:
    """Natural frequencies as marks inside the lower edge, by the phasing of the mode."""
    hertz = modes["frequency"].values
    phasing = np.array([str(name) for name in modes["phasing"].values])
    for name in dict.fromkeys(phasing):
        here = hertz[(phasing == name) & (hertz > 0.0) & (hertz <= top)]
        if len(here):
            ax.plot(
                1e-3 * here,
                np.full(len(here), 0.03),
                _MARKS.get(name, "^"),
                color=BLACK,
                markersize=5,
                markerfacecolor="none",
                label=f"modes {name}",
                linestyle="none",
                transform=ax.get_xaxis_transform(),
            )


def phase_diagram(phasing: MeshPhasing, *, harmonics: Sequence[int] = (1, 2, 3, 4)) -> Figure:
    """Draw the phases of sun and ring meshes as hands of a dial at every planet, one picture a harmonic.

    A hand upwards has phase zero; phase grows counter-clockwise.
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
        ax.plot(*xy(_CIRCLE), color="0.85", linewidth=1.0)
        for n, centre in enumerate(centres):
            ax.plot(*xy(centre + dial * _CIRCLE), color=GREY, linewidth=1.0)
            number = centre * (1.0 + 1.35 * dial)
            ax.text(*xy(number), str(n + 1), ha="center", va="center", fontsize=SIZE - 2)
            ends = centre + 0.9j * dial * row[[n, phasing.n_planets + n]]
            ax.plot(*xy(np.array([centre, ends[0]])), color=BLUE, linewidth=3.6, label="sun mesh")
            ax.plot(*xy(np.array([centre, ends[1]])), color=ORANGE, linewidth=1.6, label="ring mesh")
        ax.text(0.0, 0.0, _what_is_left(table, h), ha="center", va="center", fontsize=SIZE - 2)
        ax.set_title(f"harmonic {table.harmonics[h]}: {table.kind[h]}", fontsize=SIZE - 1)
        ax.set_xlim(-1.05 - 1.6 * dial, 1.05 + 1.6 * dial)
        ax.set_ylim(-1.05 - 1.6 * dial, 1.05 + 1.6 * dial)
    legend_below(figure, columns=2)
    return figure


def _what_is_left(table: PhasingTable, row: int) -> str:
    """Tell what is left of the mesh forces on sun and ring."""
    torque, lateral = table.members[row, :2, :2].max(axis=0)
    left = [f"{name} {100 * size:.0f} %" for name, size in (("torque", torque), ("lateral", lateral)) if size > 1e-9]
    return "\n".join(left) or "nothing on\nsun and ring"


def _modes_figures(drawn: Drawn) -> dict[str, Figure]:
    modes, static, gears = drawn.data["modes"], drawn.data.get("static"), planetary_set(drawn.case)
    figures = {
        "spatial_mode_shapes": spatial_mode_shapes(modes, gears),
        "mesh_phasing": phase_diagram(phasing_of_set(gears)),
    }
    if "helical_stiffness" in modes and static is not None:
        figures["helical_mesh_stiffness"] = _mesh_stiffness(modes, static)
    return figures


def _dynamics_figures(drawn: Drawn) -> Drawings:
    dynamics, modes = drawn.data["dynamics"], drawn.data["modes"]
    slices = {"slice_forces": partial(_slice_forces, dynamics)} if dynamics.sizes["slice"] > 1 else {}
    return response_figures(
        dynamics,
        **slices,
        dynamic_transmission_error=partial(transmission_errors, dynamics, modes),
        mesh_force_spectra=partial(_mesh_force_spectra, dynamics, modes),
        pin_forces=partial(_pin_forces, dynamics),
    )


FIGURES = {
    "": STATIC[""],
    # static.nc holds the spur gears of the transverse section: nobody makes them, modes.nc the helical ones
    "static": Figures(
        dict(STATIC["static"].captions)
        | {
            "helical_mesh_stiffness": "Stiffness and static transmission error of the meshes of planet 1 "
            "along the transverse line of action, centres fixed: of the helical meshes (solid), and of the "
            "spur gears of the transverse section (dotted) that the slices come from.",
        },
        draw=lambda drawn: {} if "modes" in drawn.data else STATIC["static"].draw(drawn),
    ),
    "stress": STATIC["stress"],
    "heat": STATIC["heat"],
    "losses": STATIC["losses"],
    "life": STATIC["life"],
    "modes": Figures(
        {
            "spatial_mode_shapes": "Mode shapes of the helical set with mean mesh stiffness, from the front "
            "and, below, from the side, where bodies tilt and move along the axis, one row a body. Each "
            "view is magnified for itself; how large the motion of the lower one is stands above it. Two "
            "modes of one frequency are drawn as one. At rest in grey.",
            "mesh_phasing": "Phases of sun and ring meshes at every planet for the first harmonics of the "
            "mesh frequency, and what is left of equal mesh forces on sun and ring: what cancels excites no "
            "mode of that kind.",
        },
        draw=_modes_figures,
    ),
    "dynamics": Figures(
        RESPONSE_CAPTIONS
        | {
            "mesh_force_spectra": "Mesh forces of planet 1 along the tooth normals over the frequency of "
            "each harmonic, h times the mesh frequency. Marks along the axis are natural frequencies by the "
            "phasing of the mode: a harmonic meets modes of its own phasing. The largest force is named with "
            "the mode within 5 % on which the mesh forces do most work.",
            "pin_forces": "Fluctuation of force and moment between pin and planet over the speed, the "
            "largest of all planets, and their mean values.",
            "slice_forces": "Load of the slices over face width and mesh period in the meshes of planet 1, "
            "per width, at the speed where it changes most.",
        },
        draw=_dynamics_figures,
    ),
}
