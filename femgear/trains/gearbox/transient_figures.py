"""Figures of a gearbox in time, from transient.nc and spectrum.nc."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.quantities import RPM
from femgear.findings import percent
from femgear.report.style import COLOURS, GREY, SIZE, label, legend_below, new_figure, show_changes
from femgear.solvers.time.low_pass import PASS_BAND
from femgear.stages.protocol import Figures
from femgear.trains.gearbox.transient_results import MOST_PANELS, chosen_meshes, pass_band, separating, symbols

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Columns of pixels of a panel, and instants a column from which a band is drawn.
_PIXELS, _POINTS = 900, 4
# Of the first curve, and of those behind it.
_WIDTHS, _ALPHAS = (0.9, 2.4), (1.0, 0.5)
# Distance of the names of two lines over the width of the axes, and points above the axes that they take.
_NAME, _NAMES = 0.0165, 42.0
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


def over_time(
    time, signals: Sequence[tuple], *, unit: str, factor: float = 1.0, title: str = "", zero: bool = True
) -> Figure:
    """Draw signals of several runs over time, one panel each; the first run stands in front.

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
    title : str
        Above all panels.
    zero : bool
        Draw zero; False shows changes of what is far from it.
    """
    figure, axes = _panels([text for text, _ in signals], x="time [s]", y=unit, title=title)
    time = np.asarray(time)
    for ax, (_, curves) in zip(axes, signals):
        for index, (name, values) in enumerate(curves):
            _draw_over_time(ax, time, factor * _drawable(values), index, name)
        ax.set_xlim(time[0], time[-1])
        if zero:
            ax.axhline(0.0, color=GREY, linewidth=0.8)
        else:
            show_changes(ax, _LEAST)
    legend_below(figure)
    return figure


def spectra(
    frequency,
    signals: Sequence[tuple],
    *,
    lines: Sequence[tuple] = (),
    unit: str,
    factor: float = 1.0,
    x: str = "frequency [Hz]",
    title: str = "",
) -> Figure:
    """Draw amplitude spectra of several runs, one panel each, with named lines; the first run is in front.

    Parameters
    ----------
    frequency : (F,) array
        [Hz] or orders.
    signals : sequence of (title, curves)
        With curves a sequence of (text, amplitude (F,)).
    lines : sequence of (text, frequency)
        Marked above the first panel and drawn through all.
    unit : str
        After the factor, with the quantity.
    x : str
        Label of the abscissa.
    title : str
        Above all panels.
    """
    frequency = np.asarray(frequency)
    lines = [(text, at) for text, at in lines if frequency[0] <= at <= frequency[-1]]
    figure, axes = _panels([text for text, _ in signals], x=x, y=unit, title=title)
    for ax, (_, curves) in zip(axes, signals):
        _draw_spectrum(ax, frequency, [(name, factor * _drawable(values)) for name, values in curves])
        for _, at in lines:
            ax.axvline(at, color=GREY, linewidth=0.7, linestyle=":")
    axes[0].set_xlim(frequency[0], frequency[-1])
    _name_lines(axes[0], lines, float(np.ptp(frequency)))
    legend_below(figure)
    return figure


def _panels(titles: Sequence[str], *, x: str, y: str, title: str):
    """A figure with one pair of axes a title, one below the other, and a title above all."""
    count = len(titles)
    figure, axes = new_figure(rows=count, width=8.6, height=max(1.2 + 2.0 * count, 4.2), sharex=True)
    for ax, text in zip(axes, titles):
        label(ax, x if ax is axes[-1] else "", y, text)
    if title:
        figure.suptitle(title, fontsize=SIZE - 1, x=0.01, ha="left")
    return figure, axes


def _draw_over_time(ax, time, values, index: int, text: str) -> None:
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


def _draw_spectrum(ax, frequency, curves: Sequence[tuple]) -> None:
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


def _thickness(index: int) -> dict[str, float]:
    return {"linewidth": _WIDTHS[min(index, 1)], "alpha": _ALPHAS[min(index, 1)]}


def band(time, values, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find middle of the time (n,), least and largest of values (n,) in pieces (count,) that share ends."""
    time, values = np.asarray(time), np.asarray(values)
    first = np.linspace(0, len(time) - 1, count + 1).astype(int)
    low, high = (extreme.reduceat(values, first[:-1]) for extreme in (np.minimum, np.maximum))
    # a piece ends where the next one begins: steep curves leave no gaps
    ends, middle = values[first[1:]], 0.5 * (time[first[:-1]] + time[first[1:]])
    return middle, np.minimum(low, ends), np.maximum(high, ends)


def _drawable(values) -> np.ndarray:
    """Without what no axis can hold: matplotlib multiplies the limits."""
    values = np.array(values, float)
    values[~(np.abs(values) < _LARGEST)] = np.nan
    return values


def _name_lines(ax, lines: Sequence[tuple], width: float) -> None:
    """Names (text, place) above axes of this width, moved aside as little as keeps them apart."""
    if not lines:
        return
    ax.set_title(ax.get_title(loc="left"), fontsize=SIZE, loc="left", pad=_NAMES)
    lines = sorted(lines, key=lambda line: line[1])
    at, apart = np.array([at for _, at in lines]), _NAME * width * np.arange(len(lines))
    # pushed to the right, pushed to the left: the mean is as far apart
    right = np.maximum.accumulate(at - apart) + apart
    left = np.minimum.accumulate((at - apart)[::-1])[::-1] + apart
    places = 0.5 * (right + left)
    for (text, at), place in zip(lines, places):
        ax.annotate(
            text,
            (at, 1.0),
            (place, 1.06),
            xycoords=ax.get_xaxis_transform(),
            rotation=90,
            textcoords=ax.get_xaxis_transform(),
            fontsize=SIZE - 3,
            ha="center",
            va="bottom",
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0},
        )


def transient_figures(data: xr.Dataset) -> dict[str, Figure]:
    """Draw speeds [rpm], deviations [mrad] and mesh forces [kN] of transient.nc over time, by file name."""
    time, meshes, shafts = data["time"].values, chosen_meshes(data), [str(name) for name in data["shaft"].values]
    passed = "" if data.attrs["filter"] == "none" else f"low-passed to {pass_band(data):.4g} Hz"
    first = shafts.index(str(data.attrs["shaft_of_speed"]))
    shown = [number for number in range(len(shafts)) if number != first][-MOST_PANELS:] or [first]
    deviations = _curves(data, "deviation", shown)
    figures = {
        "transient_speeds": over_time(
            time,
            _curves(data, "speed", sorted({first, fastest_shaft(data)})),
            unit="speed [rpm]",
            factor=1.0 / RPM,
            title=passed,
            zero=False,
        ),
        "transient_deviations": over_time(
            time,
            [(f"{body}: rotation less that of the rigid gearbox", curves) for body, curves in deviations],
            unit="deviation [mrad]",
            factor=1e3,
            title=passed,
        ),
    }
    if meshes:
        contact = "linear meshes keep contact"
        if separating(data):
            contact = f"meshes part, for up to {percent(float(data['lost'].max()), 2)} of the time"
        notes = (contact, passed, passed and "least and largest force of all steps in the table")
        title = "; ".join(filter(None, notes))
        forces = _curves(data, "mesh_force", meshes)
        figures["transient_forces"] = over_time(time, forces, unit="force [kN]", factor=1e-3, title=title)
    return figures


def fastest_shaft(data: xr.Dataset) -> int:
    """Number of the shaft that turns fastest."""
    return int(np.abs(data["ratio"].values).argmax())


def _curves(data: xr.Dataset, name: str, columns, kept=slice(None)) -> list[tuple]:
    """Names of some shafts or meshes, and the curves (text, values) of a variable, one a variant."""
    (owner,) = {"shaft", "mesh"} & set(data[name].dims)
    values = data[name].transpose("variant", owner, ...).values[..., kept]
    # one variant needs no name
    variants = [str(text) if data.sizes["variant"] > 1 else "_" for text in data["variant"].values]
    return [(str(data[owner].values[i]), [(text, values[v, i]) for v, text in enumerate(variants)]) for i in columns]


def spectrum_figures(data: xr.Dataset, transient: xr.Dataset | None = None) -> dict:
    """Draw spectra [kN] over frequency, and side bands over orders, by file name; none without meshes.

    Of spectrum.nc; transient.nc has the speeds between which the spectra were taken.
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
    (title, curves), *others = _curves(data, "amplitude", meshes, low)
    title += f"      ({', '.join(f'{short[base]}: {bases[base]}' for base in lines)})"
    from_to, changes = _speeds(data, transient)
    figures = {
        "mesh_force_spectrum": spectra(
            frequency[low],
            [(title, curves), *others],
            lines=marks,
            unit="force [kN]",
            factor=1e-3,
            title=f"{from_to}: lines smear over frequency, not over orders" if changes else from_to,
        )
    }
    for base in lines:
        if (figure := _side_bands(data, base, lines, from_to)) is not None:
            figures[f"side_bands_{bases[base].replace(' ', '_')}"] = figure
    return figures


def _speeds(data: xr.Dataset, transient: xr.Dataset | None) -> tuple[str, bool]:
    """Speeds of the shaft that gives the speed in the spectra, and whether its change shifts a mesh line by a line."""
    settle, mean = float(data.attrs["settle"]), float(data.attrs["speed"])
    if transient is None or "spin" not in transient:
        return f"after {settle:g} s, mean speed {mean / RPM:.4g} rpm", False
    time, spin = transient["time"].values, transient["spin"].values[0]
    speed = np.abs(np.gradient(spin, time, edge_order=2)[time >= settle])
    body, low, high = str(data.attrs["shaft_of_speed"]), speed.min(), speed.max()
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


def _side_bands(data, base: int, lines, title: str):
    """Orders around a mesh line: turns of its own carrier, or mesh lines of the first planetary stage."""
    turns = np.flatnonzero(data["turns"].values).tolist()
    if not turns:
        return None
    orders, order = data["line_orders"].values, data["line_order"].values
    if base - 1 in turns:
        turn = np.flatnonzero((np.abs(orders).sum(axis=1) == 1) & (orders[:, base - 1] == 1))[0]
        shift, text, width = order[turn], "turn", _TURNS * order[turn]
    else:
        shift, text = order[lines[turns[0] + 1]], symbols(data)[turns[0] + 1]
        width = _BESIDE * shift
    centre, all_orders = order[lines[base]], data["order"].values
    near = np.abs(all_orders - centre) <= width
    if np.count_nonzero(near) < _LEAST_LINES:
        return None
    marks = [(f"{k:+d} {text}" if k else "mesh", centre + k * shift) for k in range(-3, 4)]
    mesh = data["mesh_base"].values.tolist().index(base)
    return spectra(
        all_orders[near],
        _curves(data, "order_amplitude", [mesh], near),
        lines=[mark for mark in marks if abs(mark[1] - centre) <= width],
        unit="force [kN]",
        factor=1e-3,
        x=f"order of {data.attrs['shaft_of_speed']} [1]",
        title=title,
    )


TRANSIENT_FIGURES = {
    "transient": Figures(
        {
            "transient_speeds": "Speed of the reference shaft and of the fastest one, low-passed to the rate of "
            "the records. Where the records are denser than the pixels, the band of their values is drawn.",
            "transient_deviations": "Rotation of the shafts less that of the rigid gearbox under the same torques; "
            "low-passed to the rate of the records. Bands: least to largest record.",
            "transient_forces": "Mesh forces along the lines of action, low-passed to the rate of the "
            "records, which cuts shorter peaks; the table has the least and the largest force of all "
            "steps. Bands: least to largest record.",
        },
        draw=lambda drawn: transient_figures(drawn.data["transient"]),
    ),
    "spectrum": Figures(
        {
            "mesh_force_spectrum": "Amplitude spectra of mesh forces after the start: segments under Hann's "
            "window that overlap by half, root of the mean square, peak values. Dotted: mesh frequencies "
            "and their second and third harmonics at the mean speed. Where the speed changes, which the "
            "title tells, lines smear over frequency; over orders they do not.",
            "side_bands": "Mesh force around a mesh line over orders of the reference shaft, in one segment "
            "({}); a change of the speed does not smear them. Dotted: distances of the carrier's turn, or "
            "of the mesh line of the planetary stage.",
        },
        draw=lambda drawn: spectrum_figures(drawn.data["spectrum"], drawn.data.get("transient")),
    ),
}
