"""Figures of a helical case: modes from the front and from the side, stiffness of the meshes, mesh forces.

They read modes.nc and dynamics.nc; `phase_diagram` shows the phases of the meshes and what they cancel.
`FIGURES` at the end ties the pictures of the report to their captions.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.gears.phasing import MeshPhasing, PhasingTable, phase_factors, phasing_of_set, phasing_table
from femgear.report.response import (
    RESPONSE_CAPTIONS,
    harmonics_of,
    response_figures,
    transmission_error_period,
)
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
    label,
    legend_below,
    new_figure,
    periodic,
    xy,
)
from femgear.system.rigid_bodies import CENTRAL, gear_geometry
from femgear.trains.protocol import Drawn, Figures
from femgear.trains.static.figures import FIGURES as STATIC

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.gears.planetary import PlanetarySet

_CIRCLE = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 181))
_BODIES = {"carrier": GREEN, "ring": BLACK, "sun": VERMILION, "planets": BLUE}
# modes that are shown and that stand in a row, harmonics of mesh forces
_SHOWN, _COLUMNS, _HARMONICS = 12, 4, 4
# half heights of the views over the ring's radius, and the largest magnification of small motions
_FRONT, _SIDE, _MOST = 1.25, 0.4, 1e4
# widths of lines that lie on each other in the side view
_WIDTHS = {"carrier": 1.6, "ring": 4.5, "sun": 3.2, "planets": 1.6}

_MARKS = {"in phase": "o", "counter-phased": "s"}


def _draw_mode(front, side, data: SimpleNamespace, moved: np.ndarray, scale: float) -> None:
    """Draw both views of one mode, each at its own magnification.

    From the front: pitch circles, for the carrier the circle of planet centres, with a spoke that turns.
    From the side, seen along y: every body as the line of its diameter along x, which tilts about y and moves
    along z, drawn at the scale of the front view times the factor in the title. ``moved`` (N + 3, 6) are x,
    y, z, tilts and rotation of every body as arcs, in the axes of the set of `gear_geometry`.
    """
    sizes = [np.abs(moved[:, axis]).max() for axis in ([0, 1, 5], [2, 3, 4])]
    # a view without motion shows none
    views = [scale * data.ring_radius / max(size, max(sizes) / _MOST) for size in sizes]
    _draw_front(front, data, views[0] * moved)
    _draw_side(side, data, views[1] * moved)
    times = views[1] / views[0]
    times = f"{times:.0f}" if times >= 10.0 else f"{times:.2g}"
    side.set_title(f"from the side, scale × {times}", fontsize=SIZE - 3, color="0.4")


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
    ax.axhline(0.0, color="0.82", linewidth=1.0)
    for (name, colour, centre, radius, base), (_, _, z, _, tilt, _) in zip(_bodies(data), moved):
        ends = np.array([-radius, radius])
        style = {"linestyle": "--"} if name == "carrier" else {}
        # a turn by phi about y lowers points at positive x
        height = z - tilt / base * ends
        ax.plot(centre.real + ends, height, color=colour, linewidth=_WIDTHS[name], **style)
    _limits(ax, data, _SIDE)


def _limits(ax, data, high: float) -> None:
    ring = _pitch_radii(data)[0]
    ax.set_xlim(-1.25 * ring, 1.25 * ring)
    ax.set_ylim(-high * ring, high * ring)


def spatial_mode_shapes(modes: xr.Dataset, gears: PlanetarySet, *, scale: float = 0.16) -> Figure:
    """Draw the first twelve modes that are no rigid-body motions, from the front and, below, from the side.

    The largest displacement of each view is the share ``scale`` of the ring's radius. E-MODES (CaseError):
    there is no such mode.
    """
    frequency = modes["frequency"].values
    shown = np.flatnonzero(frequency > 0.0)[:_SHOWN]
    if not len(shown):
        raise CaseError("no mode to draw", code="E-MODES", limit="a mode that is no rigid-body motion")
    data = SimpleNamespace(**gear_geometry(gears))
    planets = [data.planet_radius] * gears.n_planets
    radii = np.array([data.centre_distance, data.ring_radius, data.sun_radius, *planets])
    moved = modes["shape"].values.reshape(len(radii), 6, -1).copy()
    moved[:, 3:] *= radii[:, None, None]
    columns = min(_COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = new_figure(rows=2 * rows, columns=columns, width=2.7 * columns, height=4.3 * rows + 0.6)
    axes[0].get_gridspec().set_height_ratios([_FRONT, _SIDE] * rows)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for place, mode in enumerate(shown):
        row, column = divmod(place, columns)
        front, side = (axes[(2 * row + i) * columns + column] for i in (0, 1))
        _draw_mode(front, side, data, moved[:, :, mode], scale)
        kind, phasing = str(modes["kind"].values[mode]), str(modes["phasing"].values[mode])
        front.set_title(f"mode {mode + 1}: {frequency[mode]:.6g} Hz\n{kind}\n{phasing}", fontsize=SIZE - 2)
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
    """Draw the transmission errors of dynamics.nc over one mesh period beside the static ones of modes.nc."""
    static = modes[["helical_ste"]].rename(helical_ste="ste")
    return transmission_error_period(dynamics, static, together=True)


def _mesh_force_spectra(dynamics: xr.Dataset, modes: xr.Dataset) -> Figure:
    """Amplitudes of the mesh forces of planet 1 over the frequency of every harmonic; modes are marked."""
    order = np.argsort(dynamics["mesh_frequency"].values)
    hertz = dynamics["mesh_frequency"].values[order]
    force = np.abs(harmonics_of(dynamics, "mesh_force"))[order]
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
    left = [
        f"{name} {100 * size:.0f} %"
        for name, size in (("torque", torque), ("lateral", lateral))
        if size > 1e-9
    ]
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


def _dynamics_figures(drawn: Drawn) -> dict[str, Figure]:
    dynamics, modes = drawn.data["dynamics"], drawn.data["modes"]
    return response_figures(
        dynamics,
        dynamic_transmission_error=transmission_errors(dynamics, modes),
        mesh_force_spectra=_mesh_force_spectra(dynamics, modes),
    )


FIGURES = {
    "": STATIC[""],
    # static.nc holds the spur gears of the transverse section: nobody makes them, their set is not drawn
    "static": Figures(
        dict(STATIC["static"].captions)
        | {
            "helical_mesh_stiffness": "Stiffness and static transmission error of the meshes of planet 1 "
            "along the transverse line of action, centres fixed: of the helical meshes (solid), and of the "
            "spur gears of the transverse section (dotted) that the slices come from.",
        },
        draw=STATIC["static"].draw,
    ),
    "modes": Figures(
        {
            "spatial_mode_shapes": "Mode shapes of the helical set with mean mesh stiffness, from the front "
            "and, below, from the side, where bodies tilt and move along the axis. Motions of the side view "
            "are drawn at the scale of the front view times the factor given. At rest in grey.",
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
            "phasing of the mode: a harmonic meets modes of its own phasing.",
        },
        draw=_dynamics_figures,
    ),
}
