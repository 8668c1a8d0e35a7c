"""Figures of modes and periodic responses: shapes, Campbell diagram, transmission errors, sweeps over speed.

They draw datasets of results, of whatever train; helpers for figures over the mesh period stand beside them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.report.style import (
    ALIKE,
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    MARKERS,
    SIZE,
    SMALL,
    VERMILION,
    Drawings,
    digits,
    drawn_lines,
    family,
    label,
    legend_below,
    line_style,
    mark_mesh_harmonics,
    new_figure,
    periodic,
    position_words,
    rpm,
    stems,
    xy,
)
from femgear.system import fourier
from femgear.system.fourier import fluctuation

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.gears.planetary import PlanetarySet

_READ = 500
"""Speeds that are read at once where all are looked at."""
_MANY_SPEEDS = 3
"""More speeds are drawn over the speed, too."""
_DECADES, _MOST_BARS = 1e-5, 60
"""Spectra end so far below their largest line, and have thick lines up to so many."""
_POINTS = 2048
"""Steps of a mesh period, at most."""
_FINE = 2**14
"""Instants of a mesh period from which harmonics of a record are taken."""
_BEYOND = 1.1
"""Spectra reach so far beyond the end of the excitation, over it."""
_DYNAMIC, _STATIC = "dynamic", "static, harmonics of the excitation"
_CIRCLE = np.linspace(0.0, 2 * np.pi, 241)
"""Angles of the outline of the ring [rad]; those of the other bodies are every fourth."""
_MARK = 20
"""Steps of these angles from one mark in the rim to the next."""
_RING = ("ring_shape", "ring_tangential_shape")
"""Radial and tangential displacement of the outer surface of the ring in modes.nc."""
MODE_CAPTIONS = {
    "mode_shapes": (
        "Mode shapes with mean mesh stiffness, one of every pair of equal frequency: bodies with a mark of "
        "their rotation, and the outer surface of the ring; at rest in grey."
    ),
}
"""Of `mode_shapes`."""
RESPONSE_CAPTIONS = {
    "dynamic_transmission_error": (
        "Dynamic transmission error over one mesh period beside the static one of the set on its supports, "
        "both without their mean: their difference is vibration. The static curve has the harmonics of the "
        "excitation alone; ripples in both come from the cut series. With errors that turn, over all mesh "
        "periods until these repeat."
    ),
    "mesh_forces": (
        "Mesh forces over one mesh period, and the dynamic factor K_v, largest over mean force, of the "
        "worst mesh of each kind. With errors that turn, over all mesh periods until these "
        "repeat."
    ),
    "dynamic_spectrum": (
        "Harmonics of the dynamic transmission error, down to five decades below the largest; dotted: end of "
        "the excitation. Humps at one frequency at several speeds are resonances. With errors that turn, the "
        "largest of all meshes of a kind."
    ),
    "speed_sweep": (
        "Fluctuation of the transmission error over the speed, and the verdicts on the solution: the fixed "
        "point contracts below 1, the motion is stable up to 1."
    ),
}
"""Of `response_figures`."""


def mode_shapes(
    modes: xr.Dataset, planetary_set: PlanetarySet, *, shown: Sequence[int] | None = None, scale: float = 0.16
) -> Figure:
    """Draw bodies and outer ring surface in their undeformed (grey) and displaced positions.

    The modes have ``shape`` (dof, mode), ``frequency`` [Hz], ``kind``, ``nodal_diameter`` and, where there is
    an elastic ring, real and imaginary part of ``ring_shape`` and ``ring_tangential_shape`` (mode,
    circumferential). Those ``shown`` are numbers from 0, by default the first twelve frequencies that are no
    rigid-body motions, each by its first mode; ``scale`` is the largest displacement as a share of the ring's
    outer radius.
    """
    first = frequency_groups(modes["frequency"].values)
    elastic = [pair for pair in first if modes["frequency"].values[pair[0]] > 0.0]
    groups = [(int(mode),) for mode in shown] if shown is not None else elastic[:12]
    shown = [alike[0] for alike in groups]
    columns = max(min(4, len(shown)), 1)
    rows = max(-(-len(shown) // columns), 1)
    figure, axes = new_figure(rows=rows, columns=columns, width=2.0 * columns, height=2.45 * rows + 0.4)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for ax, group in zip(axes, groups):
        _draw_mode(ax, modes, planetary_set, group[0], scale)
        names = f"mode{'s' * (len(group) > 1)} {', '.join(str(mode + 1) for mode in group)}"
        diameter = int(modes["nodal_diameter"].values[group[0]])
        kind = str(modes["kind"].values[group[0]]) + (f", n = {diameter}" if diameter >= 0 else "")
        frequency = f"{digits(modes['frequency'].values[group[0]])} Hz"
        ax.set_title(f"{names}: {frequency}\n{kind}", fontsize=SMALL)
    legend_below(figure, columns=5)
    return figure


def frequency_groups(frequency) -> list[tuple[int, ...]]:
    """Group the numbers of modes of equal natural frequency (m,) [Hz], ascending, to a millionth."""
    starts = np.flatnonzero(np.diff(frequency) > 1e-6 * frequency[1:]) + 1
    return [tuple(group.tolist()) for group in np.split(np.arange(len(frequency)), starts)]


def _draw_mode(ax, modes, planetary_set, mode, scale):
    """Draw one mode: bodies with a spoke each, the carrier by its pins, the ring by its outer surface."""
    shape = dict(zip((str(name) for name in modes["dof"].values), modes["shape"].values[:, mode]))
    outer = planetary_set.ring.rim_radius
    ring = _ring_motion(modes, mode)
    bodies = _bodies(planetary_set)
    largest = np.abs(ring).max()
    for name, radius in (("ring", outer), *((name, body[1]) for name, body in bodies.items())):
        x, y, turn = _motion(shape, name)
        largest = max(largest, np.hypot(x, y), abs(turn) * radius)
    factor = scale * outer / largest if largest > 0 else 0.0
    circle = np.exp(1j * _CIRCLE)
    ax.plot(*xy(outer * circle), color="0.8", linewidth=1.0, label="at rest")
    rigid = _motion(shape, "ring")
    shift, turn = factor * (rigid[0] + 1j * rigid[1]), factor * rigid[2]
    moved = (outer + factor * ring) * circle * np.exp(1j * turn) + shift
    ax.plot(*xy(moved), color=BLACK, linewidth=1.8, label="ring, outer surface")
    # motion along the rim is seen by marks in it
    marks = np.array([[0.93], [1.0]])
    ax.plot(*xy(marks * outer * circle[:-1:_MARK]), color="0.8", linewidth=1.0)
    ax.plot(*xy(marks * (moved - shift)[:-1:_MARK] + shift), color=BLACK, linewidth=1.8)
    for name, (centre, radius, colour, text) in bodies.items():
        x, y, turn = _motion(shape, name)
        moved = centre + factor * (x + 1j * y)
        spoke = np.exp(1j * (np.angle(centre) if centre else 0.0)) * radius
        if name == "carrier":
            _draw_carrier(ax, planetary_set, moved, factor * turn, colour)
            continue
        ax.plot(*xy(centre + radius * circle[::4]), color="0.8", linewidth=1.0)
        ax.plot(*xy(np.array([centre, centre + spoke])), color="0.8", linewidth=1.0)
        ax.plot(*xy(moved + radius * circle[::4]), color=colour, linewidth=1.6, label=text)
        ax.plot(*xy(np.array([moved, moved + spoke * np.exp(1j * factor * turn)])), color=colour, linewidth=1.6)
    span = 1.24 * outer
    ax.set_xlim(-span, span)
    ax.set_ylim(-span, span)


def _draw_carrier(ax, planetary_set, moved, turn, colour):
    """Draw displaced pins, each joined to the centre of the carrier."""
    pins = planetary_set.centre_distance * np.exp(1j * np.asarray(planetary_set.planet_angles, float))
    pins = moved + pins * np.exp(1j * turn)
    for pin in pins:
        ax.plot(*xy(np.array([moved, pin])), color=colour, linewidth=1.2, linestyle="--", label="carrier")
    ax.plot(*xy(pins), "o", color=colour, markersize=3)


def _bodies(planetary_set):
    """Tell centre, radius, colour and legend of every rigid body."""
    bodies = {"carrier": (0j, planetary_set.centre_distance, GREEN, "carrier")}
    bodies["sun"] = (0j, planetary_set.sun.reference_radius, VERMILION, "sun")
    for n, angle in enumerate(planetary_set.planet_angles):
        centre = planetary_set.centre_distance * np.exp(1j * float(angle))
        bodies[f"planet {n + 1}"] = (centre, planetary_set.planet.reference_radius, BLUE, "planets")
    return bodies


def _motion(shape, name):
    """Find displacement and rotation of a body in a mode; zero where it does not move."""
    return tuple(float(shape.get(f"{name}: {axis}", 0.0)) for axis in ("x", "y", "rotation"))


def _ring_motion(modes, mode):
    """Compute the displacement of the outer surface at the angles of `_CIRCLE`: radial + i tangential."""
    if "ring_shape_real" not in modes:
        return np.zeros_like(_CIRCLE)
    wave = np.exp(1j * np.outer(_CIRCLE, modes["circumferential"].values))
    parts = (modes[f"{name}_real"].values[mode] + 1j * modes[f"{name}_imag"].values[mode] for name in _RING)
    radial, tangential = ((wave @ part).real for part in parts)
    return radial + 1j * tangential


def campbell(speed, frequency, *, orders, order_names, critical, speed_unit: str) -> Figure:
    """Draw natural frequencies over the speed with lines of excitation: a Campbell diagram.

    Frequencies (p, m) [Hz] at speeds (p,) in ``speed_unit``; ``orders`` (k,), by ``order_names``, are slopes of the
    lines [Hz per unit of speed]; ``critical`` are intersections to mark, pairs of speed and frequency [Hz].
    """
    figure, (ax,) = new_figure(height=5.4)
    for branch in np.transpose(frequency):
        ax.plot(speed, branch, linewidth=1.6, color=BLUE, label="mode")
    for i, (order, text) in enumerate(zip(orders, order_names)):
        dash = (0, (6, 2) + (1, 2) * i)
        ax.plot(speed, order * speed, color=GREY, linewidth=1.2, linestyle=dash, label=text)
    if len(critical):
        at = np.asarray(critical, float).T
        ax.plot(*at, "o", color=BLACK, markerfacecolor="none", markersize=7, label="critical speed")
    ax.set_xlim(np.min(speed), np.max(speed))
    ax.set_ylim(0, 1.05 * np.nanmax(frequency))
    label(ax, f"speed [{speed_unit}]", "natural frequency [Hz]")
    legend_below(figure, columns=4)
    return figure


def transmission_error_period(
    dynamics: xr.Dataset, static: xr.Dataset | None = None, *, together: bool = False
) -> Figure:
    """Draw the fluctuation of the dynamic transmission error over one mesh period.

    The datasets have ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m], of which at most four speeds
    are drawn, and for comparison ``ste`` (mesh, position) [m], thin with the harmonics of the excitation
    alone, so that their cut does not pass for vibration. A row a speed and a column a kind of mesh, or
    axes a speed where all meshes are drawn ``together``.
    """
    first = np.flatnonzero(dynamics["harmonic"].values > 0)
    static_curves = None if static is None else (static["position"].values, static["ste"].values)

    def words(dynamic: np.ndarray, quasi: np.ndarray) -> str:
        beside = f", static {np.ptp(quasi, axis=-1).max():.3g}" if quasi.size else ""
        return f"peak to peak {np.ptp(dynamic, axis=-1).max():.3g}{beside} µm"

    text = "transmission error\nless its mean [µm]"
    return _over_period(dynamics.isel(harmonic=first), "dte", 1e6, static_curves, text, words, together=together)


def mesh_force_period(dynamics: xr.Dataset, static: tuple[np.ndarray, np.ndarray] | None = None) -> Figure:
    """Draw the mesh forces over one mesh period, with the dynamic factor K_v of ISO 6336-1 of each kind.

    It is the largest force over the mean one, of the meshes of a kind the largest. The dataset has
    ``mesh_force_real`` and ``mesh_force_imag`` (speed, mesh, harmonic) [N]; ``static`` are positions (P,) and
    forces (mesh, P) [N] of the set at rest.
    """

    def words(dynamic: np.ndarray, quasi: np.ndarray) -> str:
        return f"K_v = {(dynamic.max(axis=-1) / dynamic[:, :-1].mean(axis=-1)).max():.3f}"

    return _over_period(dynamics, "mesh_force", 1.0, static, "mesh force [N]", words)


def _over_period(dynamics, name: str, unit: float, static, y: str, words, *, together: bool = False):
    """Draw the harmonics of a variable over its period, a row a speed; ``words`` tell the titles.

    The dynamic and static curves of the lines of a panel are given to ``words``, (n, P) each.
    """
    speeds, h = _some_speeds(dynamics.sizes["speed"]), dynamics["harmonic"].values
    periods = int(dynamics.attrs.get("periods", 1))
    count = periods * min(max(256, 16 * int(h.max())), _POINTS)
    position = periods * np.linspace(0.0, 1.0, count + 1)
    values = unit * _closed(stored_harmonics(dynamics.isel(speed=speeds), name), h, periods, count)
    cuts = [_excited_harmonics(dynamics, s) for s in speeds] if static is not None else []
    given_curves = [unit * _cut_series(static, h, cut, periods, count) for cut in cuts]
    # what is one line at one speed need not be one at another: the lines are those of all speeds; equal
    # planets that mesh one after the other have equal spectra
    names = [str(name) for name in dynamics["mesh"].values]
    lines, kinds = _told_apart(names, np.hstack([*values, *given_curves])), list(dict.fromkeys(map(family, names)))
    size = np.abs(stored_harmonics(dynamics.isel(speed=speeds), name))
    same = _told_apart(names, np.hstack([*size]))
    shifted = len(lines) > len(kinds) == len(same) and not together
    lines, kinds = same if shifted else lines, [""] if together else kinds
    alike = len(lines) == len(kinds) and not together
    figure, axes = _panels(len(speeds) * len(kinds), above=1.2 if together else 0.8)
    for ax, (s, kind) in zip(axes, product(range(len(speeds)), kinds)):
        drawn = [(i, *line) for i, line in enumerate(lines) if kind in ("", family(line[0]))]
        rows = [row for *_, row in drawn]
        for i, text, row in drawn:
            style, text = ({"color": BLUE}, _DYNAMIC) if alike else (line_style(i), text)
            ax.plot(position, values[s][row], label=text, linewidth=2.0 if periods == 1 else 1.0, **style)
            if static is not None:
                style, text = ({"color": BLACK}, _STATIC) if alike else (style, "_")
                ax.plot(position, given_curves[s][row], linewidth=0.9, label=text, **style)
        kind = f"{names[rows[0]]}, others shifted" if shifted and kind else kind
        title = [rpm(dynamics["speed"].values[speeds[s]]), *[kind] * bool(kind)]
        quasi = given_curves[s][rows] if static is not None else np.empty(0)
        label(ax, title=f"{', '.join(title)}\n{words(values[s][rows], quasi)}")
        ax.set_xlim(0.0, periods)
    for ax in axes[-2:]:
        label(ax, position_words([periods]))
    for ax in axes[::2]:
        label(ax, y=y)
    if static is not None and not alike:
        for text, width in ((f"{_DYNAMIC} (thick)", 2.0), (f"{_STATIC} (thin)", 0.9)):
            axes[0].plot([], [], color=BLACK, label=text, linewidth=width)
    if static is not None or not alike:
        legend_below(figure, columns=2)
    return figure


def _told_apart(names, values) -> list[tuple[str, int]]:
    """Choose the meshes whose curves or spectra can be told apart, with their legend texts."""
    return drawn_lines(names, values, partly=True, within=ALIKE)


def transmission_error_spectrum(dynamics: xr.Dataset) -> Figure:
    """Draw the amplitudes of the harmonics of the dynamic transmission error, for at most four speeds.

    The dataset has ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m]; a row a speed and a column a
    kind of mesh. A dotted line marks the end of the excitation. Where errors turn, which makes many lines,
    the largest of all meshes of a kind is drawn.
    """
    speeds, h = _some_speeds(dynamics.sizes["speed"]), dynamics["harmonic"].values
    amplitude = np.abs(stored_harmonics(dynamics.isel(speed=speeds), "dte"))[:, :, h > 0] * 1e6
    names, h, largest = dynamics["mesh"].values, h[h > 0], amplitude.max(initial=0.0)
    # below are rounding and what the iteration leaves: no line is drawn there
    floor = _DECADES * (largest or 1.0)
    lines = _told_apart(names, np.hstack([*np.log10(np.maximum(amplitude / floor, 1.0))]))
    kinds = list(dict.fromkeys(family(text) for text, _ in lines))
    crowded = dynamics.attrs.get("periods", 1) > 1
    figure, axes = _panels(len(speeds) * len(kinds), height=2.9, sharex="row")
    for ax, (s, kind) in zip(axes, product(range(len(speeds)), kinds)):
        step = 1e-3 * float(dynamics["mesh_frequency"].values[speeds[s]]) or 1.0
        drawn = [(i, *line) for i, line in enumerate(lines) if family(line[0]) == kind]
        for i, text, row in drawn[:1] if crowded else drawn:
            row = [line[-1] for line in drawn] if crowded else [row]
            value = amplitude[s, row].max(axis=0)
            shown = value > floor
            if len(drawn) == 1 or crowded:
                stems(ax, step * h, value, floor, text="_", width=2.0 if shown.sum() <= _MOST_BARS else 0.8)
            else:
                style = {"color": COLOURS[i % len(COLOURS)], "markersize": 4.0, "label": text}
                ax.plot(step * h[shown], value[shown], MARKERS[i % len(MARKERS)], **style)
        if largest > 0.0:
            ax.set_yscale("log")
            ax.set_ylim(floor, 2.0 * largest)
            ax.minorticks_off()
        if "excitation_limit" in dynamics:
            limit = 1e-3 * float(dynamics["excitation_limit"].values[speeds[s]])
            ax.axvline(limit, color=GREY, linewidth=1.2, linestyle=":")
            ax.set_xlim(0.0, _BEYOND * limit)
        else:
            last = h[(amplitude[s] > floor).any(axis=0)].max(initial=1)
            ax.set_xlim(0.0, step * (last + 0.4))
        mark_mesh_harmonics(ax, step, words=ax in axes[:2])
        ax.set_title(f"{rpm(dynamics['speed'].values[speeds[s]])}, {kind}", fontsize=SIZE, loc="left", pad=10)
        label(ax, "frequency [kHz]")
    for ax in axes[::2]:
        label(ax, y="amplitude [µm]")
    if len(lines) > len(kinds) and not crowded:
        legend_below(figure)
    return figure


def speed_sweep(dynamics: xr.Dataset) -> Figure:
    """Draw the RMS of the fluctuating transmission error over the speed, and what the solver says of it.

    The dataset has ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m], and ``spectral_radius``,
    ``floquet_multiplier`` and ``converged`` (speed,).
    """
    figure, (top, bottom) = new_figure(rows=2, height=7.0, sharex=True)
    order = np.argsort(dynamics["speed"].values)
    speed = dynamics["speed"].values[order]
    rms = fluctuation_rms(dynamics)[order] * 1e6
    marker = {"marker": "o", "markersize": 4} if len(speed) < 40 else {}
    lines = drawn_lines(dynamics["mesh"].values, rms.T)
    for i, (text, row) in enumerate(lines):
        top.plot(speed, rms[:, row], label=text, **marker, **line_style(i))
    failed = ~dynamics["converged"].values[order].astype(bool)
    if failed.any():
        top.plot(speed[failed], rms[failed].max(axis=1), "x", color=BLACK, markersize=8, label="not converged")
    top.set_ylim(bottom=0)
    label(top, y="RMS [µm]", title="fluctuation of the transmission error")
    for name, text, colour, dash in (
        ("spectral_radius", "spectral radius of the fixed point", BLACK, "-"),
        ("floquet_multiplier", "largest Floquet multiplier", GREY, "--"),
    ):
        bottom.plot(speed, dynamics[name].values[order], dash, color=colour, label=text, **marker)
    bottom.axhline(1.0, color=BLACK, linewidth=0.8, linestyle=":", label="limit")
    bottom.set_ylim(bottom=0)
    label(
        bottom,
        "input speed [rpm]",
        "magnitude [1]",
        "the iteration contracts and the motion is stable up to 1",
    )
    places: Any = ("outside upper center", "outside lower center")
    for ax, place in zip((top, bottom), places):
        figure.legend(*ax.get_legend_handles_labels(), loc=place, ncols=3, fontsize=SIZE - 1, frameon=False)
    return figure


def response_figures(dynamics: xr.Dataset, **others: Callable[[], Figure]) -> Drawings:
    """Draw the spectrum of the transmission error, `others`, and over many speeds its sweep."""
    figures = {"dynamic_spectrum": partial(transmission_error_spectrum, dynamics), **others}
    if dynamics.sizes["speed"] > _MANY_SPEEDS:
        figures["speed_sweep"] = partial(speed_sweep, dynamics)
    return Drawings(figures)


def some_at_a_time(dynamics: xr.Dataset) -> Iterator[xr.Dataset]:
    """Give a dataset over speeds in parts that the memory holds, in their order."""
    return (dynamics.isel(speed=slice(i, i + _READ)) for i in range(0, dynamics.sizes["speed"], _READ))


def fluctuation_rms(dynamics: xr.Dataset) -> np.ndarray:
    """Compute the RMS of the transmission errors less their means (speeds, meshes) [m]."""
    return np.concatenate([fluctuation(stored_harmonics(block, "dte")) for block in some_at_a_time(dynamics)])


def stored_harmonics(dynamics: xr.Dataset, name: str) -> np.ndarray:
    """Join real and imaginary part of a variable to a complex array (...), in its dimensions and unit."""
    return dynamics[f"{name}_real"].values + 1j * dynamics[f"{name}_imag"].values


def _excited_harmonics(dynamics: xr.Dataset, speed_index: int) -> int:
    """Find the highest harmonic of the mesh frequency that excites, by ``excitation_limit`` [Hz] if known."""
    highest = int(dynamics["harmonic"].values.max())
    if "excitation_limit" not in dynamics:
        return highest
    limit = float(dynamics["excitation_limit"].values[speed_index])
    frequency = float(dynamics["mesh_frequency"].values[speed_index])
    return min(int(limit / frequency * (1.0 + 1e-9)), highest) if frequency > 0.0 else highest


def _closed(lines, h, periods: int, count: int) -> np.ndarray:
    """Values (..., count + 1) of a period of ``periods`` mesh periods, closed, of mesh harmonics ``h``."""
    every = np.zeros((*lines.shape[:-1], round(h[-1] * periods) + 1), complex)
    every[..., np.rint(h * periods).astype(int)] = lines
    values = fourier.sample(every, count)
    return np.concatenate([values, values[..., :1]], axis=-1)


def _cut_series(records, h, highest: int, periods: int, count: int) -> np.ndarray:
    """Sum the harmonics ``h`` up to the highest of records of one period, as `_closed` does.

    The records (n, P) are linear between their own positions (P,), which stand first and may be closer where
    they are steep. Harmonics of their means over short steps are theirs times sinc(h/steps), with hardly an
    alias.
    """
    at, value = periodic(*records)
    steps = np.arange(periods * _FINE + 1) / _FINE
    every = np.union1d(at, steps)
    dense, ends = np.stack([np.interp(every, at, row) for row in value]), np.searchsorted(every, steps)
    area = 0.5 * (dense[:, 1:] + dense[:, :-1]) * np.diff(every)
    means = _FINE * np.add.reduceat(area, ends[:-1], axis=1)
    h = h[h <= highest]
    kept = np.rint(h * periods).astype(int)
    lines = fourier.harmonics_of(means, kept[-1])[:, kept] * np.exp(-1j * np.pi * h / _FINE)
    return _closed(lines / np.sinc(h / _FINE), h, periods, count)


def _panels(count: int, *, above: float = 0.8, height: float = 2.5, sharex: Any = True):
    """Make a figure with `count` axes [in] of one vertical scale, two in a row, and room above them [in]."""
    rows, columns = -(-count // 2), min(count, 2)
    figure, axes = new_figure(rows=rows, columns=columns, height=above + height * rows, sharex=sharex, sharey=True)
    for ax in axes[count:]:
        figure.delaxes(ax)
    return figure, axes[:count]


def shown_speeds(data: xr.Dataset) -> list[int]:
    """Choose the speeds that get pictures of their own: all of a few, else first, middle and last."""
    n = data.sizes["speed"]
    return list(range(n)) if n <= _MANY_SPEEDS else [0, n // 2, n - 1]


def _some_speeds(count: int) -> list[int]:
    """Choose at most four of so many speeds, spread evenly."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, 4))})
