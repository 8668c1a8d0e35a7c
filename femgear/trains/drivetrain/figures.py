"""Figures of a drivetrain case: modes.nc, transient.nc, spectrum.nc, and the lowest elastic modes in space.

The first figures take plain curves: mesh stiffness, signals over time, spectra with named lines. Their panels
stand at places given in inches: looking for places takes matplotlib longer than drawing the figure. Those
after them read the files. `drivetrain_layout` places the bodies in space, where `drivetrain_pictures` draws
modes as discs on shafts, at rest and moved. `FIGURES` at the end ties the pictures of the report to their
captions.
"""

from __future__ import annotations

import io
import itertools
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from femgear.report.frequency import campbell
from femgear.report.scene import add_coloured, load_pyvista
from femgear.report.style import COLOURS, GREY, SIZE, label, legend_below
from femgear.storage.dataset import RPM
from femgear.storage.files import replace_file
from femgear.system.fourier import FourierSeries
from femgear.trains.drivetrain.checks import case_model
from femgear.trains.drivetrain.data import Drivetrain, numbered
from femgear.trains.drivetrain.model import DrivetrainModel, coordinates_of, free_coordinates
from femgear.trains.drivetrain.records import PASS_BAND
from femgear.trains.drivetrain.results import MOST_PANELS, chosen_meshes, pass_band, separating, symbols
from femgear.trains.protocol import Drawn, Figures

if TYPE_CHECKING:
    import xarray as xr

# Inches: beside the panels, below the last, above the first, between two with and without numbers in between.
_LEFT, _RIGHT, _BOTTOM, _TOP, _GAP, _SHARED = 0.95, 0.2, 0.95, 0.35, 0.75, 0.5
# Room for a title of the figure, and for the names of lines.
_TITLE, _NAMES = 0.3, 0.5
# Columns of pixels of a panel, and instants a column from which a band is drawn.
_PIXELS, _POINTS = 900, 4
# Of the first curve, and of those behind it.
_WIDTHS, _ALPHAS = (0.9, 2.4), (1.0, 0.5)
# Distance of the names of two lines over the width of the axes.
_NAME = 0.0165
# Largest value that is drawn.
_LARGEST = 1e100
# Least span of an ordinate that does not reach zero, over its largest value.
_LEAST = 0.02
# Harmonics of the mesh lines that are marked, and how far beyond the last of the highest line spectra reach.
_HARMONICS = 3
_REACH = 1.04 * _HARMONICS
# Reach of side bands in turns or planetary mesh lines.
_TURNS, _BESIDE = 8.0, 1.3
# Fewer lines are no picture of side bands.
_LEAST_LINES = 24

# Radius of bodies that carry no gear, and distance of wheels side by side, over the largest gear radius.
_PLAIN, _WHEEL_GAP = 0.9, 0.45
# Phi of a shaft that shears and hardly bends: more does not show.
_SHEAR_ALONE = 1e6

_EDGES = {"boundary_edges": True, "feature_edges": True, "manifold_edges": False, "non_manifold_edges": False}
_REST, _MOVED = "#B0B0B0", "#D55E00"
_COLOURS = "displacement over the largest"
_VIEW = np.array([1.0, 0.55, -0.9])
# Lines stand this share of the size in front of the faces that they lie on; from afar nothing is shifted.
_FRONT = 3e-3
# Height of the picture over its width.
_HEIGHT = 0.72
# Shares of the height between which the drivetrain stands.
_ROOM = (0.22, 0.88)
# Largest displacement over the size of the drivetrain.
_SHARE = 0.12


def panels(
    titles: Sequence[str],
    *,
    columns: int = 1,
    width: float = 8.0,
    height: float = 1.6,
    x: str,
    y: Sequence[str],
    title: str = "",
    named: bool = False,
):
    """A figure with one pair of axes a title.

    Parameters
    ----------
    titles : sequence of str
        Of the panels, row by row.
    columns : int
        One column shares its abscissa.
    width, height : float
        Of a panel [in].
    x : str
        Label below the panels.
    y : sequence of str
        Label of every panel.
    title : str
        Above all panels.
    named : bool
        Leave room for names of lines above the first panel.

    Returns
    -------
    Figure
    list of Axes
    """
    rows, gap = -(-len(titles) // columns), _SHARED if columns == 1 else _GAP
    top, step = _TOP + bool(title) * _TITLE + named * _NAMES, _LEFT + width + _RIGHT
    size = (columns * step, top + rows * height + (rows - 1) * gap + _BOTTOM)
    figure, axes = Figure(figsize=size), []
    for number in range(len(titles)):
        row, column = divmod(number, columns)
        left, bottom = column * step + _LEFT, size[1] - top - row * (height + gap) - height
        place = (left / size[0], bottom / size[1], width / size[0], height / size[1])
        axes.append(figure.add_axes(place, sharex=axes[0] if axes and columns == 1 else None))
    for number, (ax, text) in enumerate(zip(axes, titles)):
        last = number >= len(titles) - columns
        ax.tick_params(labelsize=SIZE - 1, labelbottom=last or columns > 1)
        ax.grid(True, color="0.88", linewidth=0.8)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        label(ax, x if last else "", y[number])
        ax.xaxis.set_label_coords(0.5, -0.34 / height)
        ax.yaxis.set_label_coords(-0.68 / width, 0.5)
        above = 6.0 + 72.0 * _NAMES * (named and not number)
        ax.set_title(text, fontsize=SIZE, loc="left", y=1.0, pad=above)
    if title:
        figure.text(0.1 / size[0], 1.0 - 0.1 / size[1], title, fontsize=SIZE - 1, va="top")
    return figure, axes


def draw_over_time(ax, time, values, index: int, text: str) -> None:
    """A line, or where there are many instants a column of pixels the band of its values.

    Curves behind the first, ``index`` 0, are wider and lighter, so that all can be read.
    """
    style = {"color": COLOURS[index % len(COLOURS)], "zorder": 3.0 - 0.1 * index, "label": text}
    if len(time) <= _POINTS * _PIXELS:
        ax.plot(time, values, **_thickness(index), **style)
        return
    colour = style.pop("color")
    where, low, high = band(time, values, _PIXELS)
    ax.fill_between(where, low, high, facecolor=(colour, 0.3), edgecolor=colour, linewidth=0.7, **style)


def draw_spectrum(ax, frequency, curves: Sequence[tuple]) -> None:
    """Amplitudes (text, values (F,)) over a logarithmic axis of five decades."""
    from matplotlib.ticker import NullLocator

    top = 0.0
    for index, (text, values) in enumerate(curves):
        colour, top = COLOURS[index % len(COLOURS)], max(top, np.nanmax(values, initial=0.0))
        ax.plot(frequency, values, color=colour, zorder=3.0 - 0.1 * index, label=text, **_thickness(index))
    if top > 0.0:
        ax.set_yscale("log")
        ax.yaxis.set_minor_locator(NullLocator())
        ax.set_ylim(1e-5 * top, 2.0 * top)


def show_changes(ax) -> None:
    """Ordinate that does not reach zero, with whole numbers at its ticks, and does not blow up rounding."""
    low, high = ax.get_ylim()
    least = 0.5 * _LEAST * max(abs(low), abs(high))
    middle, half = 0.5 * low + 0.5 * high, max(0.5 * high - 0.5 * low, least)
    ax.set_ylim(middle - half, middle + half)
    ax.ticklabel_format(axis="y", useOffset=False)


def _thickness(index: int) -> dict[str, float]:
    return {"linewidth": _WIDTHS[min(index, 1)], "alpha": _ALPHAS[min(index, 1)]}


def band(time, values, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Least and largest of values (n,) in `count` pieces of the time, which share their ends.

    Returns
    -------
    middle, low, high : (count,) arrays
    """
    time, values = np.asarray(time), np.asarray(values)
    first = np.linspace(0, len(time) - 1, count + 1).astype(int)
    low, high = (one.reduceat(values, first[:-1]) for one in (np.minimum, np.maximum))
    # a piece ends where the next one begins: steep curves leave no gaps
    ends, middle = values[first[1:]], 0.5 * (time[first[:-1]] + time[first[1:]])
    return middle, np.minimum(low, ends), np.maximum(high, ends)


def drawable(values) -> np.ndarray:
    """Without what no axis can hold: matplotlib multiplies the limits."""
    values = np.array(values, float)
    values[~(np.abs(values) < _LARGEST)] = np.nan
    return values


def name_lines(ax, lines: Sequence[tuple], width: float) -> None:
    """Names (text, place) above the axes, moved aside as little as keeps them apart.

    `width` is that of the axes in the units of the places.
    """
    if not lines:
        return
    lines = sorted(lines, key=lambda line: line[1])
    at, apart = np.array([at for _, at in lines]), _NAME * width * np.arange(len(lines))
    # pushed to the right, pushed to the left: the mean is as far apart
    right = np.maximum.accumulate(at - apart) + apart
    left = np.minimum.accumulate((at - apart)[::-1])[::-1] + apart
    places = 0.5 * (right + left)
    for (text, at), place in zip(lines, places):
        ax.annotate(
            text, (at, 1.0), (place, 1.06), xycoords=ax.get_xaxis_transform(), rotation=90,
            textcoords=ax.get_xaxis_transform(), fontsize=SIZE - 3, ha="center", va="bottom",
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip


def over_time(
    time,
    signals: Sequence[tuple],
    *,
    unit: str,
    factor: float = 1.0,
    columns: int = 1,
    title: str = "",
    zero: bool = True,
) -> Figure:
    """Signals of several runs over time, one panel each; the first run stands in front.

    Where there are many more instants than pixels, the band between the least and the largest value of every
    column of pixels is drawn.

    Parameters
    ----------
    time : (n,) array
        [s]
    signals : sequence of (title, curves)
        With curves a sequence of (text, values (n,)).
    unit : str
        After the factor, with the quantity.
    columns : int
    title : str
        Above all panels.
    zero : bool
        Draw zero; False shows changes of what is far from it.
    """
    figure, axes = panels(
        [text for text, _ in signals], columns=columns, width=7.0 if columns == 1 else 5.2, x="time [s]",
        y=[unit] * len(signals), title=title,
    )  # fmt: skip
    time = np.asarray(time)
    for ax, (_, curves) in zip(axes, signals):
        for index, (name, values) in enumerate(curves):
            draw_over_time(ax, time, factor * drawable(values), index, name)
        ax.set_xlim(time[0], time[-1])
        if zero:
            ax.axhline(0.0, color=GREY, linewidth=0.8)
        else:
            show_changes(ax)
    legend_below(figure)
    return figure


def spectra(
    frequency,
    signals: Sequence[tuple],
    *,
    lines: Sequence[tuple] = (),
    unit: str,
    factor: float = 1.0,
    x: str = "",
    title: str = "",
) -> Figure:
    """Amplitude spectra of several runs, one panel each, with named lines; the first run stands in front.

    Parameters
    ----------
    frequency : (F,) array
        [Hz] or orders.
    signals : sequence of (title, curves)
        With curves a sequence of (text, amplitude (F,)).
    lines : sequence of (text, frequency)
        Marked above the first panel and drawn through all.
    unit : str
    factor : float
    x : str
        Label of the abscissa, the frequency when not given.
    title : str
        Above all panels.
    """
    frequency = np.asarray(frequency)
    lines = [(text, at) for text, at in lines if frequency[0] <= at <= frequency[-1]]
    figure, axes = panels(
        [text for text, _ in signals], width=8.3, x=x or "frequency [Hz]", y=[unit] * len(signals),
        title=title, named=bool(lines),
    )  # fmt: skip
    for ax, (_, curves) in zip(axes, signals):
        draw_spectrum(ax, frequency, [(name, factor * drawable(values)) for name, values in curves])
        for _, at in lines:
            ax.axvline(at, color=GREY, linewidth=0.7, linestyle=":")
    axes[0].set_xlim(frequency[0], frequency[-1])
    name_lines(axes[0], lines, float(np.ptp(frequency)))
    legend_below(figure)
    return figure


def stiffness_figure(model: DrivetrainModel) -> Figure:
    """Series of the mesh stiffness of every stage over two mesh periods, and the rectangular wave."""
    phase, names = np.linspace(0.0, 2.0, 1601), numbered(model.meshes)
    first = [(row, mesh.section) for row, mesh in enumerate(model.train.meshes) if not mesh.planet]
    first = first[:MOST_PANELS]
    scales = [(1e-9, "GN/m") if wave.levels[1] > 5e8 else (1e-6, "MN/m") for _, wave in first]
    figure, axes = panels(
        [names[row] for row, _ in first],
        columns=len(first),
        width=3.1,
        height=2.4,
        x="mesh period [1]",
        y=[f"stiffness [{unit}]" for _, unit in scales],
        title=f"series of {model.stiffness.shape[1] - 1} terms",
    )
    for number, (ax, (row, wave), (scale, _)) in enumerate(zip(axes, first, scales)):
        low, high, share = wave.levels
        inside = (phase + wave.phase + 0.5 * share) % 1.0 < share
        series = FourierSeries(model.stiffness[row]).at(2.0 * np.pi * phase[:, None])[:, 0]
        ax.plot(phase, scale * np.where(inside, high, low), color=GREY, linewidth=1.4, label="rectangular")
        ax.plot(phase, scale * series, color=COLOURS[number % len(COLOURS)], label="series")
        ax.set_xlim(phase[0], phase[-1])
    legend_below(figure)
    return figure


def campbell_figure(modes: xr.Dataset) -> Figure:
    """Campbell diagram with the mesh lines of modes.nc."""
    frequency = modes["campbell_frequency"].values
    top = frequency.max()
    critical = zip(modes["critical_speed"].values, modes["critical_frequency"].values)
    return campbell(
        modes["campbell_speed"].values, frequency, orders=modes["base_order"].values / 60.0,
        order_names=[str(name) for name in modes["base"].values],
        critical=[pair for pair in critical if pair[1] < top], speed_unit="rpm of the first body",
    )  # fmt: skip


def transient_figures(data: xr.Dataset) -> dict:
    """Speeds, deviations and mesh forces over time, by name."""
    bodies, names = ([str(name) for name in data[key].values] for key in ("body", "mesh"))
    ends, meshes = sorted({0, len(bodies) - 1}), chosen_meshes(data)
    shown = [i for i in range(len(bodies)) if i][-MOST_PANELS:] or [0]
    passed = _pass_band(data)
    turned = [f"{bodies[i]}: rotation less the free spin" for i in shown]
    figures = {
        "transient_speeds": _signals(
            data,
            "speed",
            ends,
            [bodies[i] for i in ends],
            unit="speed [rpm]",
            factor=1.0 / RPM,
            title=passed,
            zero=False,
        ),
        "transient_deviations": _signals(
            data, "deviation", shown, turned, unit="deviation [mrad]", factor=1e3, title=passed
        ),
    }
    if meshes:
        contact = "linear meshes keep contact"
        if separating(data):
            contact = f"meshes part, for up to {float(data['lost'].max()):.2%} of the time"
        notes = (contact, passed, passed and "least and largest force of all steps in the table")
        figures["transient_forces"] = _signals(
            data, "mesh_force", meshes, [names[i] for i in meshes], unit="force [kN]", factor=1e-3,
            title="; ".join(filter(None, notes)),
        )  # fmt: skip
    return figures


def _signals(data: xr.Dataset, name: str, columns, titles, **options):
    """Columns of a variable over time, those of all variants in one panel."""
    values, variants = data[name].values, [str(text) for text in data["variant"].values]
    panels = [
        (title, [(text, values[v, :, i]) for v, text in enumerate(variants)])
        for i, title in zip(columns, titles)
    ]
    return over_time(data["time"].values, panels, **options)


def _pass_band(data: xr.Dataset) -> str:
    """What the low pass of the records of transient.nc leaves."""
    return "" if data.attrs["filter"] == "none" else f"low-passed to {pass_band(data):.4g} Hz"


def spectrum_figures(data: xr.Dataset, transient: xr.Dataset | None = None) -> dict:
    """Spectra over frequency, and side bands over orders, by name; none without meshes.

    Parameters
    ----------
    data : Dataset
        spectrum.nc
    transient : Dataset, optional
        transient.nc, for the speeds between which the spectra were taken.
    """
    meshes = chosen_meshes(data)
    if not meshes:
        return {}
    lines = _mesh_lines(data)
    frequency, hertz = data["frequency"].values, data["line_frequency"].values
    top = min(PASS_BAND * frequency[-1], _REACH * max(hertz[line] for line in lines.values()))
    low = frequency <= top
    bases, short = [str(name).removesuffix(" mesh") for name in data["base"].values], symbols(data)
    marks = [
        (short[base] if h == 1 else f"{h} {short[base]}", h * hertz[line])
        for base, line in lines.items()
        for h in range(1, _HARMONICS + 1)
    ]
    (title, curves), *others = _panels(data, "amplitude", meshes, low)
    title += f"      ({', '.join(f'{short[base]}: {bases[base]}' for base in lines)})"
    from_to, changes = _speeds(data, transient)
    figures = {
        "mesh_force_spectrum": spectra(
            frequency[low], [(title, curves), *others], lines=marks, unit="force [kN]", factor=1e-3,
            title=f"{from_to}: lines smear over frequency, not over orders" if changes else from_to,
        )
    }  # fmt: skip
    for base in lines:
        if (figure := _side_bands(data, base, lines, from_to)) is not None:
            figures[f"side_bands_{bases[base].replace(' ', '_')}"] = figure
    return figures


def _speeds(data: xr.Dataset, transient: xr.Dataset | None) -> tuple[str, bool]:
    """Speeds of the first body in the spectra, and whether its change shifts a mesh line by a line."""
    settle, mean = float(data.attrs["settle"]), float(data.attrs["speed"])
    if transient is None or "spin" not in transient:
        return f"after {settle:g} s, mean speed {mean / RPM:.4g} rpm", False
    time, spin = transient["time"].values, transient["spin"].values[0]
    speed = np.gradient(spin, time, edge_order=2)[time >= settle]
    body, low, high = str(transient["body"].values[0]), speed.min(), speed.max()
    hertz = data["line_frequency"].values[list(_mesh_lines(data).values())].max(initial=0.0)
    if hertz * (high - low) / mean < float(data.attrs["resolution"]):
        return f"after {settle:g} s, {body} at {mean / RPM:.4g} rpm", False
    return f"after {settle:g} s, {body} from {low / RPM:.4g} to {high / RPM:.4g} rpm", True


def _mesh_lines(data) -> dict[int, int]:
    """Line of the mesh frequency, by the number of its base."""
    orders = data["line_orders"].values
    simple = np.flatnonzero(np.abs(orders).sum(axis=1) == 1)
    meshes = set(data["mesh_base"].values.tolist())
    pairs = [(int(np.flatnonzero(orders[line])[0]), line) for line in simple.tolist()]
    return {base: line for base, line in pairs if base in meshes and orders[line, base] == 1}


def _panels(data, name: str, meshes, kept):
    values = data[name].values
    variants = [str(text) for text in data["variant"].values]
    return [
        (str(data["mesh"].values[i]), [(text, values[v, i, kept]) for v, text in enumerate(variants)])
        for i in meshes
    ]


def _side_bands(data, base: int, lines, title: str):
    """Orders around a mesh line: turns of its own carrier, or mesh lines of the first planetary stage."""
    planetary = int(data.attrs["planetary_stages"])
    if not planetary:
        return None
    orders, order = data["line_orders"].values, data["line_order"].values
    own = base < 2 * planetary
    if own:
        turn = np.flatnonzero((np.abs(orders).sum(axis=1) == 1) & (orders[:, base - 1] == 1))[0]
        shift, text, width = order[turn], "turn", _TURNS * order[turn]
    else:
        shift, text = order[lines[1]], "f1"
        width = _BESIDE * shift
    centre, all_orders = order[lines[base]], data["order"].values
    near = np.abs(all_orders - centre) <= width
    if np.count_nonzero(near) < _LEAST_LINES:
        return None
    marks = [(f"{k:+d} {text}" if k else "mesh", centre + k * shift) for k in range(-3, 4)]
    mesh = data["mesh_base"].values.tolist().index(base)
    return spectra(
        all_orders[near], _panels(data, "order_amplitude", [mesh], near),
        lines=[mark for mark in marks if abs(mark[1] - centre) <= width], unit="force [kN]", factor=1e-3,
        x="order of the first body [1]", title=title,
    )  # fmt: skip


@dataclass(frozen=True)
class Wheel:
    """A disc: name, centre (3,), radius and width [m]; index of the body's centre in `Layout.centre`."""

    name: str
    centre: np.ndarray
    radius: float
    width: float
    body: int


@dataclass(frozen=True)
class Layout:
    """Discs, shafts between body centres, and places of all bodies.

    ``centre`` (n_bodies, 3) [m], planets after the bodies; ``shafts`` pairs of body numbers. The drawing is a
    scheme: bodies without gears get a radius, and two wheels of one body stand side by side.
    """

    names: tuple[str, ...]
    centre: np.ndarray
    wheels: tuple[Wheel, ...]
    shafts: tuple[tuple[int, int], ...]


def drivetrain_layout(train: Drivetrain) -> Layout:
    """Places along z by shaft lengths, across it by centre distances."""
    names = [body.name for body in train.bodies]
    gears = [radius for s in train.parallel for radius in s.pitch_radii]
    gears += [stage.centre_distance for stage in train.planetary]
    size = max(gears, default=0.3)
    places = {names[0]: np.zeros(3)}
    links = [(*s.between, np.array([0.0, 0.0, s.length])) for s in train.shafts]
    seconds = [s.between[1] for s in train.parallel]
    for s in train.parallel:
        apart, beside = sum(s.pitch_radii), _WHEEL_GAP * size if s.between[0] in seconds else 0.0
        across = apart * math.cos(s.direction), apart * math.sin(s.direction)
        links.append((*s.between, np.array([*across, s.offsets[0] - s.offsets[1] + beside])))
    links += [(s.carrier, s.sun, np.zeros(3)) for s in train.planetary]
    for _ in names:
        for first, second, arm in links:
            if first in places:
                places.setdefault(second, places[first] + arm)
            elif second in places:
                places[first] = places[second] - arm
    centre = [places[name] for name in names]
    wheels = _wheels(train, places, size)
    for stage in train.planetary:
        prefix = "planet" if len(train.planetary) == 1 else f"planet of {stage.carrier}"
        for p, angle in enumerate(stage.angles, start=1):
            arm = stage.centre_distance * np.array([math.cos(angle), math.sin(angle), 0.0])
            centre.append(places[stage.carrier] + arm)
            wheels.append(Wheel(f"planet {p}", centre[-1], stage.pitch_radii[1], 0.2 * size, len(names)))
            names.append(f"{prefix} {p}")
    shafts = tuple((names.index(s.between[0]), names.index(s.between[1])) for s in train.shafts)
    return Layout(tuple(names), np.array(centre), tuple(wheels), shafts)


def _wheels(train: Drivetrain, places, size: float) -> list[Wheel]:
    order = [body.name for body in train.bodies]
    found = []
    for stage in train.planetary:
        plate = places[stage.carrier] - np.array([0.0, 0.0, 0.2 * size])
        found.append((stage.carrier, plate, stage.centre_distance, 0.06 * size))
        found.append((stage.sun, places[stage.sun], stage.pitch_radii[0], 0.2 * size))
    for stage in train.parallel:
        first, second = (places[name] for name in stage.between)
        # in the plane of the second gear
        centres = np.array([first[0], first[1], second[2]]), second
        found += [(*one, 0.2 * size) for one in zip(stage.between, centres, stage.pitch_radii)]
    geared = {name for name, *_ in found}
    found += [(n, places[n], _PLAIN * size, 0.3 * size) for n in order if n not in geared]
    return [Wheel(name, centre, radius, width, order.index(name)) for name, centre, radius, width in found]


def layout_motion(model: DrivetrainModel, layout: Layout, shape) -> tuple[np.ndarray, np.ndarray]:
    """Translation and rotation vector (n, 3) of every place of the layout under a motion (n_free,).

    Planets fixed to their pins follow the carrier, at its angle zero.
    """
    train = model.train
    place, full = _all_coordinates(model, shape)
    move, turn = np.zeros((2, len(layout.names), 3))
    for row, body in enumerate(train.bodies):
        x, y, *turns = full[place.body[body.name] : place.body[body.name] + 5]
        move[row], turn[row] = (x, y, 0.0), turns
    row = len(train.bodies)
    for stage, planets in zip(train.planetary, place.planets):
        at = [body.name for body in train.bodies].index(stage.carrier)
        for planet in planets:
            arm = layout.centre[row] - layout.centre[at]
            move[row] = move[at] + np.cross(turn[at], arm)
            turn[row] = *turn[at][:2], full[planet[2]]
            row += 1
    return move, turn


def shaft_lines(
    model: DrivetrainModel, layout: Layout, shape, *, points: int = 8
) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Centre lines of the shafts under a motion: places at rest and displacements, (k, 3) each.

    A shaft passes through its stations, between them by the shape functions of its elements; one that is
    modelled as a joint is drawn as the one element whose static stiffness the joint stands for.

    Parameters
    ----------
    model : DrivetrainModel
    layout : Layout
        Of ``model.train``.
    shape : (n_free,) array
        Motion of the free coordinates.
    points : int
        Pieces of an element of a beam.

    Returns
    -------
    tuple of (rest, displacement)
        In the order of the shafts of the chain [m].
    """
    place, full = _all_coordinates(model, shape)
    found = []
    for shaft, inner, ends in zip(model.train.shafts, place.inner, layout.shafts):
        one, two = (place.body[name] for name in shaft.between)
        first = np.array([one, *inner, two])
        stations = full[first[:, None] + np.arange(5)]
        share, across = _beam_line(shaft, stations, points if shaft.elements else 3 * points)
        one, two = layout.centre[list(ends)]
        rest = one + share[:, None] * (two - one)
        found.append((rest, np.column_stack([across, np.zeros(len(share))])))
    return tuple(found)


def _all_coordinates(model: DrivetrainModel, shape):
    """Places of all coordinates, and their values (n,) under a motion of the free ones."""
    place = coordinates_of(model.train)
    T, _ = free_coordinates(model.train, place)
    return place, T @ np.asarray(shape, float)


def _beam_line(shaft, stations, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the length (k,) and displacements (k, 2) of a beam through its stations (n + 1, 5)."""
    count = max(shaft.elements, 1)
    length = shaft.length / count
    share = np.linspace(0.0, 1.0, count * points + 1)
    element = np.minimum(np.arange(len(share)) // points, count - 1)
    ratio = shaft.section.shear_ratio(length) if shaft.elements else _joint_shear_ratio(shaft)
    N = beam_shape(share * count - element, length, ratio)
    # a tilt about y is the slope of x, one about x minus that of y
    ends = np.stack([stations[element], stations[element + 1]], axis=1)
    x = np.einsum("kn,kn->k", N, ends[:, :, [0, 3]].reshape(-1, 4))
    y = np.einsum("kn,kn->k", N, (ends[:, :, [1, 2]] * np.array([1.0, -1.0])).reshape(-1, 4))
    return share, np.column_stack([x, y])


def _joint_shear_ratio(shaft) -> float:
    """Phi of the Timoshenko shaft whose static stiffness is that of a joint's springs.

    Bending ``E I / l`` and shear ``12 E I / ((1 + Phi) l^3)``, `femgear.system.shaft.joint_springs`. Under a
    spherical joint no force crosses the shaft, which then bends to a parabola whatever Phi is.
    """
    springs = shaft.springs
    if math.isinf(springs.shear):
        return 0.0
    return float(np.clip(12.0 * springs.bending / (springs.shear * shaft.length**2) - 1.0, 0.0, _SHEAR_ALONE))


def beam_shape(xi, length: float, shear_ratio: float) -> np.ndarray:
    """Deflection (k, 4) of a Timoshenko element per unit of (w, slope) at its first and second end.

    Exact for an element without load; ``xi`` (k,) runs from 0 to 1, ``slope`` is the turn of the section.
    These are the functions behind the consistent mass of `femgear.system.shaft.beam_element`
    (J. S. Przemieniecki, Theory of Matrix Structural Analysis, 1968, section 11.3; Z. Friedman and
    J. B. Kosmatka, Comput. Struct. 47, 1993, 473-481).
    """
    xi, phi = np.asarray(xi, float), shear_ratio
    rest = 1.0 - xi
    return np.stack([
        1.0 - 3.0 * xi**2 + 2.0 * xi**3 + phi * rest,
        length * (xi * rest**2 + 0.5 * phi * xi * rest),
        3.0 * xi**2 - 2.0 * xi**3 + phi * xi,
        -length * (xi**2 * rest + 0.5 * phi * xi * rest),
    ], axis=-1) / (1.0 + phi)  # fmt: skip


@dataclass(frozen=True)
class ModeView:
    """One picture of a mode shape.

    Parameters
    ----------
    path : path-like
        PNG file.
    title : str
    move, turn : (n, 3) arrays
        Translation and rotation vector of every place, in the proportions of the mode.
    shafts : sequence of (rest (k, 3), displacement (k, 3))
        Centre lines [m].
    """

    path: str | os.PathLike
    title: str
    move: np.ndarray
    turn: np.ndarray
    shafts: Sequence[tuple[np.ndarray, np.ndarray]] = ()


def drivetrain_pictures(views: Iterable[ModeView], layout: Layout, *, size: int = 1000) -> list[float]:
    """Pictures of mode shapes: every disc moves as a rigid body, shafts are the lines that they are given.

    Parameters
    ----------
    views : iterable of ModeView
    layout : Layout
        Discs, and the names of the places that are written beside them.
    size : int
        Width in pixels.

    Returns
    -------
    list of float
        The factors of the shapes.

    Raises
    ------
    FemgearError
        See `load_pyvista`.
    StorageError
        When a file cannot be written.
    """
    pv = load_pyvista()
    discs = [_disc(pv, wheel) for wheel in layout.wheels]
    # one window for all: opening it takes as long as drawing
    plotter = pv.Plotter(off_screen=True, window_size=[size, round(_HEIGHT * size)])
    plotter.enable_anti_aliasing("ssaa")
    plotter.set_background("white")  # type: ignore[call-arg]
    plotter.enable_parallel_projection()  # type: ignore[call-arg]
    found = []
    try:
        for view in views:
            plotter.suppress_rendering = True
            plotter.clear()
            scale, points = _add_shape(pv, plotter, view, discs, layout, size)
            _add_texts(plotter, view.title, layout, size)
            _frame(plotter, points)
            plotter.suppress_rendering = False
            plotter.render()
            _write(plotter, view.path)
            found.append(scale)
    finally:
        plotter.close()
    return found


def _add_shape(pv, plotter, view: ModeView, discs, layout: Layout, size: int):
    """Discs and shafts, at rest and moved; the factor of the shape, and all points of the discs (n, 3)."""
    move, turn = np.asarray(view.move, float), np.asarray(view.turn, float)
    centres, places = layout.centre, [wheel.body for wheel in layout.wheels]
    lines = [tuple(np.asarray(one, float) for one in pair) for pair in view.shafts]
    fields = [move[p] + np.cross(turn[p], d.points - centres[p]) for d, p in zip(discs, places)]
    lengths = [np.linalg.norm(one, axis=1) for one in (*fields, *(across for _, across in lines))]
    extent = np.ptp(np.vstack([disc.points for disc in discs]), axis=0).max()
    # a shaft may move more than any disc
    reach = max(length.max() for length in lengths)
    scale = _SHARE * extent / reach if reach > 0.0 else 0.0
    moves = [(centres[p], scale * move[p], scale * turn[p]) for p in places]
    rest, whole = pv.merge(discs, merge_points=False), pv.merge(discs, merge_points=False)
    whole.points = np.vstack([_moved(disc.points, *own) for disc, own in zip(discs, moves)])
    length = np.concatenate(lengths[: len(discs)])
    whole[_COLOURS] = length / (length.max() or 1.0)
    add_coloured(plotter, whole, _COLOURS, size, cmap="cividis", limits=(0.0, 1.0))
    spokes = [_spoke(wheel) for wheel in layout.wheels]
    turned = [_moved(spoke, *own) for spoke, own in zip(spokes, moves)]
    for mesh, colour, width, front in (
        (rest.extract_feature_edges(**_EDGES), _REST, 2.0, 0.0),
        (_polylines(pv, [*spokes, *(line for line, _ in lines)]), _REST, 3.0, 0.0),
        (whole.extract_feature_edges(**_EDGES), "black", 2.0, _FRONT),
        (_polylines(pv, turned), _MOVED, 6.0, _FRONT),
        (_polylines(pv, [line + scale * across for line, across in lines]), _MOVED, 9.0, 0.0),
    ):
        if mesh.n_points:
            mesh.points = mesh.points + front * extent * _VIEW
            plotter.add_mesh(mesh, color=colour, line_width=width, lighting=False)
    return float(scale), np.vstack([rest.points, whole.points])


def _add_texts(plotter, title: str, layout: Layout, size: int) -> None:
    """Title, names beside the places, and the colour bar where this flat picture has room for it."""
    height = round(_HEIGHT * size)
    plotter.scalar_bars[" "].SetPosition(0.2, 0.065)
    radius = np.zeros(len(layout.centre))
    for wheel in layout.wheels:
        radius[wheel.body] = max(radius[wheel.body], wheel.radius)
    plotter.add_point_labels(
        layout.centre + np.array([0.0, 1.0, 0.0]) * radius[:, None] * 1.15, list(layout.names),
        font_size=max(size // 60, 10), shape="rect", shape_color="white", shape_opacity=0.6, margin=1,
        show_points=False, text_color="black", always_visible=True,
    )  # fmt: skip
    if title:
        place = (0.02 * size, height - 0.045 * size)
        plotter.add_text(title, position=place, font_size=max(size / 75, 7.0), color="black", name="title")


def _frame(plotter, points) -> None:
    """Parallel view that holds all points (n, 3), with room for title and colour bar."""
    away = _VIEW / np.linalg.norm(_VIEW)
    right = np.cross([0.0, 1.0, 0.0], away)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(away, right), away])
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    half = 0.5 * (high - low)
    camera, bottom, top = plotter.camera, *_ROOM
    scale = max(half[1] / (top - bottom), 1.06 * _HEIGHT * half[0])
    middle = 0.5 * (low + high) - [0.0, (bottom + top - 1.0) * scale, 0.0]
    camera.focal_point = middle @ axes
    camera.position = camera.focal_point + 10.0 * half.max() * away
    camera.up, camera.parallel_scale = (0.0, 1.0, 0.0), scale
    plotter.reset_camera_clipping_range()


def _write(plotter, path) -> None:
    """The picture whole or not at all; the window stays open."""
    import imageio.v3 as iio

    stream, image = io.BytesIO(), plotter.screenshot(filename=None, return_img=True)
    iio.imwrite(stream, image, extension=".png", compress_level=4)
    data = stream.getvalue()
    replace_file(path, lambda temporary: temporary.write_bytes(data), size=len(data))


def _moved(points, centre, shift, turn) -> np.ndarray:
    """Points turned by a rotation vector about a centre, and shifted: rigid, however large the angle."""
    from pyvista.core.utilities.transformations import axis_angle_rotation

    angle = float(np.linalg.norm(turn))
    if angle > 0.0:
        points = centre + (points - centre) @ axis_angle_rotation(turn / angle, angle, deg=False)[:3, :3].T
    return points + shift


def _spoke(wheel: Wheel) -> np.ndarray:
    """A radius on the front face of a disc (2, 3), which shows how far it turns."""
    face = np.asarray(wheel.centre) - np.array([0.0, 0.0, 0.51 * wheel.width])
    return np.array([face, face + np.array([0.0, wheel.radius, 0.0])])


def _disc(pv, wheel: Wheel):
    """A disc with its axis along z."""
    axis = (0.0, 0.0, 1.0)
    disc = pv.Cylinder(
        center=wheel.centre, direction=axis, radius=wheel.radius, height=wheel.width, resolution=48
    )
    return disc.triangulate()


def _polylines(pv, lines):
    """Several lines (k, 3) as one mesh."""
    ends = np.cumsum([0, *(len(line) for line in lines)])
    cells = [np.append(b - a, np.arange(a, b)) for a, b in itertools.pairwise(ends)]
    return pv.PolyData(np.vstack(lines), lines=np.concatenate(cells)) if lines else pv.PolyData()


def mode_pictures(folder: Path, model: DrivetrainModel, modes: xr.Dataset, count: int) -> list[str]:
    """The lowest elastic modes as PNG files; returns their names.

    Modes have the numbers of the table: the free spin, which is not drawn, is the first.
    """
    layout = drivetrain_layout(model.train)
    kinds, hertz = modes["kind"].values.astype(str), modes["frequency"].values
    names, views = [], []
    for mode in np.flatnonzero(kinds != "rigid")[:count].tolist():
        shape = modes["shape"].values[:, mode]
        title = f"mode {mode + 1}: {hertz[mode]:.2f} Hz, {kinds[mode]}"
        names.append(f"drivetrain_mode_{mode + 1}.png")
        moved = layout_motion(model, layout, shape)
        views.append(ModeView(folder / names[-1], title, *moved, shaft_lines(model, layout, shape)))
    if views:
        drivetrain_pictures(views, layout)
    return names


def _modes_figures(drawn: Drawn) -> dict[str, Figure]:
    model = case_model(drawn.case)
    figures = {"stiffness_series": stiffness_figure(model)} if len(model.meshes) else {}
    return figures | {"campbell": campbell_figure(drawn.data["modes"])}


def _write_modes(drawn: Drawn, folder: Path) -> list[str]:
    count = drawn.case.simulation.modes
    return mode_pictures(folder, case_model(drawn.case), drawn.data["modes"], count)


FIGURES = {
    "modes": Figures(
        {
            "stiffness_series": (
                "Mesh stiffness over the mesh period as the model takes it: a Fourier series, and the "
                "rectangular wave of the number of tooth pairs in contact that it stands for."
            ),
            "campbell": (
                "Natural frequencies over the speed of the first body, with gyroscopic terms and mean mesh "
                "stiffness, and the mesh frequencies."
            ),
            "drivetrain_mode": (
                "Mode shape of the drivetrain ({}), by the number in the table, where the free spin is the "
                "first; magnified, at rest in grey. The rays show how far each wheel turns. Shafts are "
                "drawn as bent beams between the places that the model knows. The drawing is a scheme: "
                "bodies without gears have a radius that is not theirs."
            ),
        },
        draw=_modes_figures,
        write=(_write_modes,),
    ),
    "transient": Figures(
        {
            "transient_speeds": (
                "Speed of the first and of the last body, low-passed to the rate of the records. Where the "
                "records are denser than the pixels, the band of their values is drawn."
            ),
            "transient_deviations": (
                "Rotation of the bodies less that of the free spin, which is the motion of the rigid chain "
                "under the same torques; low-passed to the rate of the records. Bands: least to largest "
                "record."
            ),
            "transient_forces": (
                "Mesh forces along the lines of action, low-passed to the rate of the records: peaks that "
                "are shorter are higher than here, the least and the largest force of all steps stand in "
                "the table. Bands: least to largest record."
            ),
        },
        draw=lambda drawn: transient_figures(drawn.data["transient"]),
    ),
    "spectrum": Figures(
        {
            "mesh_force_spectrum": (
                "Amplitude spectra of mesh forces after the start: segments under Hann's window that "
                "overlap by half, root of the mean square, peak values. Dotted: mesh frequencies and their "
                "second and third harmonics at the mean speed. Where the speed changes, which the title "
                "tells, lines smear over frequency; over orders they do not."
            ),
            "side_bands": (
                "Mesh force around a mesh line over orders of the first body, in one segment ({}); a change "
                "of the speed does not smear them. Dotted: distances of the carrier's turn, or of the mesh "
                "line of the planetary stage."
            ),
        },
        draw=lambda drawn: spectrum_figures(drawn.data["spectrum"], drawn.data.get("transient")),
    ),
}
