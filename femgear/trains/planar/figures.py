"""Figures of a planar case: modes.nc, branch.nc, response.nc.

`orbits` and `bearing_forces` take plain curves of any planar set. The figures after them read the files, and
a note tells where too few harmonics make forces and contact doubtful. `FIGURES` at the end ties the pictures
of the report to their captions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.report.response import MODE_CAPTIONS, mode_shapes, shown_speeds, stored_harmonics
from femgear.report.style import BLACK, COLOURS, GREY, SIZE, label, legend_below, line_style, new_figure, runs
from femgear.stages.protocol import Drawn, Figures
from femgear.stages.static_figures import FIGURES as STATIC
from femgear.trains.planar.model import TAIL_LIMIT, merged_folds

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# how parts of a curve are drawn and called, by what is known of them
STABILITY = {1: ("-", "stable"), 0: ("--", "not stable"), -1: (":", "stability not known")}

_DOUBTFUL = "too few harmonics, not to be trusted (W-TAIL)"
_PALE = "#F6D48F"
_AXIS = "frequency of the weight in the carrier frame [Hz]"
# limit points that are labelled, at most
_LABELS = 4
# fewer lines are no spectrum; lines end so far below the largest one
_LEAST_LINES, _FLOOR = 3, 1e-5
# difference of two curves, relative to the range they are drawn over, that cannot be seen
_EQUAL = 5e-3
# instants of a carrier turn in figures of two frequencies, at most
_INSTANTS = 20_000


def runs_of_one_kind(stable, wanted: int) -> list[slice]:
    """Find runs of segments of a curve of one kind: 1 stable, 0 not stable, -1 not known.

    A segment between two of the points (p,) is drawn once: unknown where one of its ends is, otherwise
    unstable where one is.
    """
    stable = np.asarray(stable, int)
    return runs(np.minimum(stable[:-1], stable[1:]) == wanted)


def orbits(curves: Sequence[tuple], *, title: str = "") -> Figure:
    """Draw paths of a member's centre in the carrier frame: curves (text, path (2, n) [m])."""
    figure, (ax,) = new_figure(width=6.2, height=6.2)
    # one path is named by the title
    title = f"{curves[0][0]}, {title}" if title and len(curves) == 1 else title
    for number, (text, path) in enumerate(curves):
        closed = 1e6 * np.concatenate([path, path[:, :1]], axis=1)
        ax.plot(*closed, label=text if len(curves) > 1 else None, **line_style(number))
    ax.plot(0.0, 0.0, "+", color=GREY)
    ax.set_aspect("equal", adjustable="datalim")
    label(ax, "x [µm]", "y [µm]", title)
    legend_below(figure, columns=1)
    return figure


def bearing_forces(angle, curves: Sequence[tuple], *, title: str = "", over: str = "phase of the weight [°]") -> Figure:
    """Draw sizes of bearing forces over one turn, of the weight against the carrier or of the carrier.

    Over the angle (n,) [rad], whose name is ``over``: curves (text, force (2, n) [N]).
    """
    figure, (ax,) = new_figure()
    for number, (text, force) in enumerate(curves):
        ax.plot(np.degrees(angle), 1e-3 * np.hypot(*force), label=text, **line_style(number))
    _turn_axis(ax, over)
    label(ax, y="force [kN]", title=title)
    legend_below(figure)
    return figure


def _turn_axis(ax, over: str = "phase of the weight [°]") -> None:
    ax.set_xlim(0.0, 360.0)
    ax.set_xticks(np.arange(0.0, 361.0, 60.0))
    label(ax, over)


def branch_figures(branch: xr.Dataset) -> dict[str, Figure]:
    """Draw all figures of branch.nc, by file name."""
    figures = {
        "weight_response": weight_response(branch),
        "carrier_orbit": _weight_orbits(branch),
        "planet_bearing_forces": _weight_bearing_forces(branch),
        "tooth_contact": contact_over_branch(branch),
    }
    if np.any(branch["back_force_real"].values):
        figures["wedged_teeth"] = _flank_forces(branch)
    return figures


def weight_response(branch: xr.Dataset) -> Figure:
    """Draw amplitudes of carrier, ring and sun by what is known of their stability, folds marked."""
    figure, axes = new_figure(rows=3, width=8.5, height=8.0, sharex=True)
    hertz = branch["weight_frequency"].values
    folds = merged_folds(hertz, branch["fold"].values)
    for ax, colour, member in zip(axes, COLOURS, branch["member"].values):
        size = 1e6 * branch["rms"].sel(member=member).values[:, 0]
        _mark_tails(ax, hertz, size, branch["tail"].values)
        for dash, text, part in _parts(branch):
            ax.plot(hertz[part], size[part], color=colour, linestyle=dash, label=text)
        ax.plot(hertz[folds], size[folds], "o", color=BLACK, markersize=6, markerfacecolor="none", label="fold")
        ax.set_ylim(bottom=0.0)
        label(ax, y=f"{member} x, r.m.s. [µm]")
    # many labels would hide one another; the table of the report has them all
    for point in folds if len(folds) <= _LABELS else ():
        # outside of the turn, where the curve is not
        right = hertz[point] >= hertz[max(point - 1, 0)]
        axes[0].annotate(
            f"{hertz[point]:.2f} Hz",
            (hertz[point], 1e6 * branch["rms"].values[point, 0, 0]),
            xytext=(10, -3) if right else (-8, -14),
            ha="left" if right else "right",
            textcoords="offset points",
            fontsize=SIZE - 1,
        )
    label(axes[-1], _AXIS)
    legend_below(figure, axes[0], columns=4)
    return figure


def _mark_tails(ax, x, values, tail) -> None:
    """Broad band under what too few lines make doubtful, W-TAIL."""
    doubtful = tail > TAIL_LIMIT
    if np.any(doubtful):
        # a point alone has no length to be drawn along
        ax.plot(
            x,
            np.where(doubtful, values, np.nan),
            "o-",
            color=_PALE,
            linewidth=9.0,
            markersize=8.0,
            zorder=1.5,
            label=_DOUBTFUL,
        )


def _tails(data: xr.Dataset) -> np.ndarray:
    """Share of forces or deflections in the upper half of the lines, the larger, of every point or speed."""
    return np.maximum(data["tail"].values, data["force_tail"].values)


def _doubt(tail) -> str:
    """What a title adds to forces and contact that too few lines make."""
    return f"\n{_DOUBTFUL}" if tail > TAIL_LIMIT else ""


def _parts(branch: xr.Dataset) -> list[tuple]:
    """(dash, words, slice) of the parts of a branch by their stability; one part where nothing was asked."""
    if branch.attrs["stability"] == "not computed":
        return [("-", "stability not computed", slice(None))]
    stable = branch["stable"].values
    return [(*STABILITY[wanted], part) for wanted in STABILITY for part in runs_of_one_kind(stable, wanted)]


def _weight_orbits(branch: xr.Dataset) -> Figure:
    """Paths of the carrier's centre in the carrier frame during one turn of the weight against it."""
    lines = stored_harmonics(branch, "displacement")
    curves = []
    for point, words in zip(branch["shown_point"].values, branch["shown_as"].values):
        path = _wave(branch) @ np.swapaxes(lines[point, 0], 0, 1)
        note = "flanks wedge" if branch["back_contact"].values[point].max() > 0.0 else "drive flanks only"
        note += _doubt(branch["tail"].values[point])
        curves.append((f"{branch['weight_frequency'].values[point]:.1f} Hz, {words!s}: {note}", path.real.T))
    return orbits(curves)


def _weight_bearing_forces(branch: xr.Dataset) -> Figure:
    """Sizes of the planet-bearing forces over one turn of the weight against the carrier."""
    lines = stored_harmonics(branch, "planet_bearing_force")[branch["shown_point"].values[-1]]
    wave = _wave(branch)
    curves = [(f"planet {n + 1}", (line @ wave.T).real) for n, line in enumerate(lines)]
    return bearing_forces(branch["phase"].values, curves, title="".join(_top(branch)))


def _top(branch: xr.Dataset) -> tuple[str, str]:
    """The last shown point in words, for figures of forces, and on a line of its own what is doubted."""
    point = int(branch["shown_point"].values[-1])
    words = f"{branch['weight_frequency'].values[point]:.1f} Hz, {branch['shown_as'].values[-1]!s}"
    return words, _doubt(_tails(branch)[point])


def _flank_forces(branch: xr.Dataset) -> Figure:
    """Forces of drive and back flanks over one turn of the weight against the carrier."""
    figure, axes = new_figure(rows=2, width=8.0, height=6.0, sharex=True)
    names, degrees = [str(name) for name in branch["mesh"].values], np.degrees(branch["phase"].values)
    for ax, kind, words in zip(axes, ("drive_force", "flank_force"), ("drive flanks", "back flanks")):
        for number, mesh in enumerate((0, len(names) // 2)):
            force = branch[kind].values[-1, mesh]
            ax.plot(degrees, 1e-3 * force, label=names[mesh], **line_style(number))
        label(ax, y="force [kN]", title=words)
    _turn_axis(axes[-1])
    words, doubt = _top(branch)
    label(axes[0], title=f"{words}: drive flanks{doubt}")
    legend_below(figure, axes[0])
    return figure


def contact_over_branch(branch: xr.Dataset) -> Figure:
    """Draw the share of the cycle in which flanks touch over the frequency, by stability."""
    return _contact(branch, branch["weight_frequency"].values, _AXIS, _parts(branch))


def _response_orbit(response: xr.Dataset, speed: int) -> Figure:
    """Paths of carrier, ring and sun in the carrier frame during one carrier turn."""
    lines = stored_harmonics(response, "displacement")[speed]
    _, wave = _carrier_turn(response, speed)
    figure, axes = new_figure(columns=3, width=11.0, height=4.2)
    for ax, colour, name, line in zip(axes, COLOURS, response["member"].values, lines):
        x, y = 1e6 * (line @ wave.T).real
        ax.plot(x, y, color=colour, linewidth=0.7)
        ax.plot([x.mean()], [y.mean()], "+", color=GREY)
        ax.set_aspect("equal", adjustable="datalim")
        label(ax, "x [µm]", "y [µm]", f"{name}, {float(response['speed'][speed]):.6g} rpm")
    if response["tail"].values[speed] > TAIL_LIMIT:
        figure.suptitle(_DOUBTFUL, fontsize=SIZE)
    return figure


def _response_bearing_forces(response: xr.Dataset, speed: int) -> Figure:
    """Sizes of the planet-bearing forces over one carrier turn."""
    lines = stored_harmonics(response, "planet_bearing_force")[speed]
    turn, wave = _carrier_turn(response, speed)
    curves = [(f"planet {n + 1}", (line @ wave.T).real) for n, line in enumerate(lines)]
    title = f"{float(response['speed'][speed]):.6g} rpm" + _doubt(_tails(response)[speed])
    return bearing_forces(2.0 * np.pi * turn, curves, title=title, over="carrier angle [°]")


def response_mesh_forces(response: xr.Dataset, speed: int) -> Figure:
    """Draw mesh forces of planet 1 over one carrier turn, and over the first mesh periods if they vary."""
    lines = stored_harmonics(response, "mesh_force")[speed]
    names = [str(name) for name in response["mesh"].values]
    turn, wave = _carrier_turn(response, speed)
    mesh, carrier = float(response["mesh_frequency"][speed]), _carrier_frequency(response, speed)
    near = turn * mesh / carrier <= 6.0 if carrier else np.ones(len(turn), bool)
    panels: list[tuple] = [(slice(None), "one turn of the carrier")]
    if response.attrs["mesh_lines"]:
        panels.append((near, "six mesh periods"))
    pair = (0, len(names) // 2)
    forces = [1e-3 * (lines[row] @ wave.T).real for row in pair]
    curves = [(names[row], force) for row, force in zip(pair, forces)]
    # one curve would hide the other
    equal = ""
    if np.abs(forces[1] - forces[0]).max() <= _EQUAL * np.ptp(forces):
        equal, curves = f", {names[0]} and {names[pair[1]]}: equal", [("_", forces[0])]
    figure, axes = new_figure(rows=len(panels), width=8.5, height=1.0 + 2.8 * len(panels))
    for number, (text, force) in enumerate(curves):
        for ax, (part, _) in zip(axes, panels):
            ax.plot(360.0 * turn[part], force[part], linewidth=0.8, label=text, **line_style(number))
    title, doubt = f"{float(response['speed'][speed]):.6g} rpm: ", _doubt(_tails(response)[speed])
    for ax, (_, words) in zip(axes, panels):
        label(ax, "carrier angle [°]", "mesh force [kN]", title + words + equal + doubt)
        title = doubt = ""
    legend_below(figure, axes[0])
    return figure


def _response_spectrum(response: xr.Dataset, speed: int) -> Figure:
    """Lines of the first mesh's force and of the sun's displacement, by the mesh harmonic they stand at."""
    force = stored_harmonics(response, "mesh_force")[speed, 0]
    moved = stored_harmonics(response, "displacement")[speed, 0, 0]
    hertz, mesh = np.abs(response["frequency"].values[speed]), response["mesh_order"].values
    figure, axes = new_figure(rows=2, width=8.5, height=6.0, sharex=True)
    quantities = (
        (np.abs(force), f"force of {response['mesh'].values[0]!s} [N]"),
        (1e6 * np.abs(moved), "carrier x [µm]"),
    )
    for ax, (size, text) in zip(axes, quantities):
        # five decades below the largest line there is nothing to see
        floor = _FLOOR * size[hertz > 0.0].max(initial=0.0)
        shown = (size > floor) & (hertz > 0.0)
        for number, (words, here) in enumerate((("weight", mesh == 0), ("mesh and side bands", mesh != 0))):
            if np.any(here & shown):
                words = words if np.any(mesh != 0) else "_"
                ax.vlines(hertz[here & shown], floor, size[here & shown], color=COLOURS[number], label=words)
        if np.any(shown):
            ax.set_yscale("log")
            ax.set_ylim(bottom=floor)
        label(ax, y=text)
    label(axes[-1], "frequency in the carrier frame [Hz]")
    label(axes[0], title=f"{float(response['speed'][speed]):.6g} rpm" + _doubt(_tails(response)[speed]))
    legend_below(figure)
    return figure


def _contact(data: xr.Dataset, x: np.ndarray, words: str, parts) -> Figure:
    """Both flanks of the meshes of the first planet, one line for those that touch alike."""
    count, alike = data.sizes["mesh"] // 2, {}
    for side in ("drive", "back"):
        for mesh in (0, count):
            share = data[f"{side}_contact"].values[:, mesh]
            alike.setdefault(share.tobytes(), (share, []))[1].append(f"{data['mesh'].values[mesh]!s}, {side}")
    figure, (ax,) = new_figure(width=8.5, height=4.8)
    for number, (share, flanks) in enumerate(alike.values()):
        colour, text = COLOURS[number], " and ".join(flanks)
        _mark_tails(ax, x, share, _tails(data))
        if parts is None:
            ax.plot(x, share, "o-", color=colour, markersize=3, label=text)
        else:
            for dash, _, part in parts:
                ax.plot(x[part], share[part], color=colour, linestyle=dash)
            ax.plot([], [], color=colour, label=text)
    ax.set_ylim(-0.06, 1.06)
    label(ax, words, "share of the time in contact [1]")
    legend_below(figure, columns=2)
    return figure


def _wave(branch: xr.Dataset) -> np.ndarray:
    """``exp(i h phase)`` (n, H) over one turn."""
    return np.exp(1j * branch["phase"].values[:, None] * branch["harmonic"].values)


def _carrier_frequency(response: xr.Dataset, speed: int) -> float:
    return abs(float(response["carrier_speed"][speed])) / (2.0 * np.pi)


def _carrier_turn(response: xr.Dataset, speed: int) -> tuple[np.ndarray, np.ndarray]:
    """Fractions of a carrier turn (ten mesh periods where it stands), and ``exp(i omega t)`` of the lines."""
    carrier, mesh = _carrier_frequency(response, speed), float(response["mesh_frequency"][speed])
    duration = 1.0 / carrier if carrier else 10.0 / mesh
    highest = np.abs(response["frequency"].values[speed]).max()
    count = int(np.clip(8.0 * highest * duration, 720, _INSTANTS))
    turn = np.linspace(0.0, 1.0, count + 1)
    wave = np.exp(2j * np.pi * duration * turn[:, None] * response["frequency"].values[speed])
    return turn, wave


def _response_figures(drawn: Drawn) -> dict[str, Figure]:
    """Figures of the speeds that are shown, and over all speeds where there are several."""
    response, figures = drawn.data["response"], {}
    speed = response["speed"].values
    force, moving = np.abs(stored_harmonics(response, "mesh_force")[:, 0]), response["frequency"].values != 0.0
    for s in shown_speeds(response):
        lines = force[s, moving[s]]
        # a few lines need no spectrum
        few = np.count_nonzero(lines > _FLOOR * lines.max(initial=0.0)) < _LEAST_LINES
        for name, draw in _OF_A_SPEED.items():
            if draw is not _response_spectrum or not few:
                figures[f"{name}_{round(speed[s])}_rpm"] = draw(response, s)
    if len(speed) > 1:
        order, words = np.argsort(speed), "speed of the input [rpm]"
        figures["contact_over_speed"] = _contact(response.isel(speed=order), speed[order], words, None)
    return figures


_OF_A_SPEED = {
    "response_orbit": _response_orbit,
    "response_bearing_forces": _response_bearing_forces,
    "response_mesh_forces": response_mesh_forces,
    "response_spectrum": _response_spectrum,
}

FIGURES = STATIC | {
    "modes": Figures(
        MODE_CAPTIONS,
        draw=lambda drawn: {"mode_shapes": mode_shapes(drawn.data["modes"], planetary_set(drawn.case))},
    ),
    "branch": Figures(
        {
            "weight_response": "Displacement of carrier, ring and sun over the frequency of the weight in "
            "the carrier frame, r.m.s. about the mean. Circles: limit points, those that corners of the "
            "tooth contact split drawn as one.",
            "carrier_orbit": "Path of the carrier's centre in the carrier frame during one turn of the "
            "weight against it, at the responses that the legend names.",
            "planet_bearing_forces": "Force between every planet and its pin during one turn of the weight "
            "against the carrier, at the response that the title names.",
            "wedged_teeth": "Forces of both flanks of the meshes of planet 1 during one turn of the weight, "
            "at the response that the title names. Where both flanks of a mesh carry at once its teeth are "
            "wedged.",
            "tooth_contact": "State of both flanks of the meshes of planet 1 over the frequency of the "
            "weight: 1 in contact all the time, 0 never.",
        },
        draw=lambda drawn: branch_figures(drawn.data["branch"]),
    ),
    "response": Figures(
        {
            "response_orbit": "Paths of the centres of carrier, ring and sun in the carrier frame during "
            "one turn of the carrier ({}).",
            "response_bearing_forces": "Force between every planet and its pin during one turn of the carrier ({}).",
            "response_mesh_forces": "Mesh forces of planet 1 during one turn of the carrier ({}), and "
            "during six mesh periods where the mesh stiffness varies. They are drawn from their lines.",
            "response_spectrum": "Lines of a mesh force and of the carrier's displacement ({}): multiples "
            "of the weight's frequency, and of the mesh frequency with their side bands where the mesh "
            "stiffness varies.",
            "contact_over_speed": "State of both flanks of the meshes of planet 1 over the speed: 1 in "
            "contact all the time, 0 never.",
        },
        draw=_response_figures,
    ),
}
