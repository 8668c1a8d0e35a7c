"""Figures of dynamics.nc: dynamic transmission error and mean deflection of the ring.

Figures of modes.nc: mode shapes and natural frequencies.

Figures of housing.nc: what a sensor fixed to the housing hears during one carrier revolution.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.housing.orders import BandAnalysis, analyse_band
from femgear.housing.orders import order_spectrum as _spectrum
from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    MARKERS,
    ORANGE,
    SIZE,
    SKY,
    VERMILION,
    distinct_lines,
    excited_to,
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

    from femgear.gears.planetary import PlanetarySet

# spectra end so far below their largest line, and have bars up to so many
_DECADES, _MOST_BARS = 1e-5, 60
_BADGE = {"boxstyle": "circle", "facecolor": "white", "edgecolor": VERMILION}


def harmonics_of(dynamics: xr.Dataset, name: str) -> np.ndarray:
    """Complex harmonics of a variable stored as real and imaginary part."""
    return dynamics[f"{name}_real"].values + 1j * dynamics[f"{name}_imag"].values


def transmission_error_period(dynamics: xr.Dataset, static: xr.Dataset | None = None) -> Figure:
    """Fluctuation of the dynamic transmission error over one mesh period, axes for each speed.

    Parameters
    ----------
    dynamics : xarray.Dataset
        With ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m]; at most four speeds are drawn.
    static : xarray.Dataset, optional
        With ``ste`` (mesh, position) [m], drawn for comparison: thin with the harmonics of the excitation
        alone, so that their cut does not pass for vibration, and faint as a whole.

    Returns
    -------
    Figure
    """
    speeds = _few(dynamics.sizes["speed"])
    h = dynamics["harmonic"].values
    position = fine_positions(int(h.max()))
    wave = np.exp(2j * np.pi * np.outer(h[h > 0], position))
    names = dynamics["mesh"].values
    errors = [(harmonics_of(dynamics, "dte")[s][:, h > 0] @ wave).real * 1e6 for s in speeds]
    drawn = [distinct_lines(names, error) for error in errors]
    # meshes that differ from planet to planet get axes of their own for each kind
    split = max(map(len, drawn)) > 2
    kinds = list(dict.fromkeys(family(str(name)) for name in names)) if split else [""]
    figure, axes = _panels(len(speeds) * len(kinds))
    for number, (s, error, lines) in enumerate(zip(speeds, errors, drawn)):
        cut = excited_harmonics(dynamics, s)
        frequency = float(dynamics["mesh_frequency"].values[s])
        for i, (text, row) in enumerate(lines):
            ax = axes[number * len(kinds) + (kinds.index(family(text)) if split else 0)]
            style = line_style(i)
            ax.plot(position, error[row], label=text, linewidth=2.0, **style)
            if static is not None:
                draw_static(ax, static["position"], static["ste"].values[row], cut, position, style)
        for k, kind in enumerate(kinds):
            title = f"{rpm(dynamics['speed'].values[s])}, mesh frequency {frequency:.6g} Hz"
            label(
                axes[number * len(kinds) + k],
                "position in the mesh period [1]",
                title=f"{title}\n{kind} meshes" if kind else title,
            )
    for ax in axes:
        ax.set_xlim(0, 1)
    for ax in axes[::2]:
        label(ax, y="transmission error less its mean [µm]")
    if static is not None:
        name_kinds(axes[0], dynamics)
    legend_below(figure, columns=3)
    return figure


def fine_positions(harmonics: int) -> np.ndarray:
    """Positions of one mesh period, enough for a curve of so many harmonics."""
    return np.linspace(0.0, 1.0, max(256, 16 * harmonics) + 1)


def name_kinds(ax, dynamics: xr.Dataset) -> None:
    """Legend entries for dynamic and static curves: they differ in width, meshes in colour and dash."""
    known = "excitation" if "excitation_limit" in dynamics else "response"
    for text, look in (
        ("dynamic (thick)", {"linewidth": 2.0}),
        (f"static, harmonics of the {known} (thin)", {"linewidth": 0.9}),
        ("static, whole (pale)", {"linewidth": 2.5, "alpha": 0.3}),
    ):
        ax.plot([], [], color=BLACK, label=text, **look)


def draw_static(ax, at, values, harmonics: int, position, style) -> None:
    """Static transmission error [m] less its mean: the whole record pale, its first harmonics thin."""
    at, whole, part = _fluctuation(at, values, harmonics, position)
    ax.plot(at, 1e6 * whole, color=style["color"], linewidth=2.5, alpha=0.3, label="_")
    ax.plot(position, 1e6 * part, linewidth=0.9, **style, label="_")


def excited_harmonics(dynamics: xr.Dataset, speed_index: int) -> int:
    """Highest harmonic of the mesh frequency that excites: by ``excitation_limit`` [Hz] where it is known."""
    highest = int(dynamics["harmonic"].values.max())
    if "excitation_limit" not in dynamics:
        return highest
    limit = float(dynamics["excitation_limit"].values[speed_index])
    frequency = float(dynamics["mesh_frequency"].values[speed_index])
    return min(int(limit / frequency * (1.0 + 1e-9)), highest) if frequency > 0.0 else highest


def _fluctuation(at, values, harmonics: int, position):
    """A record of one period less its mean, closed, and the sum of its first harmonics at `position`.

    The record is linear between its positions, which may be closer where it is steep. Harmonics of such a
    curve are those of its second derivative, jumps of the slope, over ``-(2 pi h)^2``.
    """
    at, value = periodic(at, values)
    mean = np.trapezoid(value, at) / (at[-1] - at[0])
    slope = np.diff(value) / np.diff(at)
    jump, h = slope - np.roll(slope, 1), np.arange(1, harmonics + 1)
    line = -2.0 * np.exp(-2j * np.pi * np.outer(h, at[:-1])) @ jump / (2.0 * np.pi * h) ** 2
    return at, value - mean, (line @ np.exp(2j * np.pi * np.outer(h, position))).real


def transmission_error_spectrum(dynamics: xr.Dataset) -> Figure:
    """Amplitudes of the harmonics of the dynamic transmission error, for at most four speeds.

    Parameters
    ----------
    dynamics : xarray.Dataset
        With ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m].

    Returns
    -------
    Figure
    """
    from matplotlib.ticker import MaxNLocator

    speeds = _few(dynamics.sizes["speed"])
    figure, axes = _panels(len(speeds))
    h = dynamics["harmonic"].values
    amplitude, h = np.abs(harmonics_of(dynamics, "dte"))[:, :, h > 0] * 1e6, h[h > 0]
    names, largest = dynamics["mesh"].values, amplitude[speeds].max(initial=0.0)
    # below are rounding and what the iteration leaves: no line is drawn there
    floor = _DECADES * largest
    for ax, s in zip(axes, speeds):
        lines = distinct_lines(names, amplitude[s])
        few = len(lines) * len(h) <= _MOST_BARS
        for i, (text, row) in enumerate(lines):
            shown = amplitude[s, row] > floor
            if few:
                _bars(ax, h[shown], amplitude[s, row][shown], i, len(lines), text)
            else:
                _dots(ax, h[shown], amplitude[s, row][shown], floor, i, text)
        if largest > 0.0:
            ax.set_yscale("log")
            ax.set_ylim(floor, 2.0 * largest)
        # speeds may reach different harmonics: axes end with the last line
        last = h[(amplitude[s] > floor).any(axis=0)].max(initial=1)
        ax.set_xlim(0.4, last + 0.6)
        ax.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
        title = rpm(dynamics["speed"].values[s]) + excited_to(dynamics, s)
        label(ax, "harmonic of the mesh frequency [1]", title=title)
    for ax in axes[::2]:
        label(ax, y="amplitude of the transmission error [µm]")
    legend_below(figure)
    return figure


def _bars(ax, h, amplitude, index: int, count: int, text: str) -> None:
    """Bars of one mesh beside those of the others."""
    width = 0.8 / count
    ax.bar(
        h + (index - (count - 1) / 2) * width,
        amplitude,
        width,
        color=COLOURS[index % len(COLOURS)],
        hatch=("", "///", "...", "xx")[index % 4],
        edgecolor="white",
        linewidth=0.5,
        label=text,
    )


def _dots(ax, h, amplitude, floor, index: int, text: str) -> None:
    """Lines of one mesh as markers on thin stems: many bars would merge."""
    colour = COLOURS[index % len(COLOURS)]
    ax.vlines(h, floor, amplitude, color=colour, linewidth=0.5, alpha=0.5)
    ax.plot(h, amplitude, MARKERS[index % len(MARKERS)], color=colour, markersize=3.5, label=text)


def speed_sweep(dynamics: xr.Dataset) -> Figure:
    """RMS of the fluctuating transmission error over the speed, and what the solver says about each speed.

    Parameters
    ----------
    dynamics : xarray.Dataset
        With ``dte_real``, ``dte_imag``, ``spectral_radius``, ``floquet_multiplier`` and ``converged``.

    Returns
    -------
    Figure
    """
    figure, (top, bottom) = new_figure(rows=2, height=7.0, sharex=True)
    order = np.argsort(dynamics["speed"].values)
    speed = dynamics["speed"].values[order]
    h = dynamics["harmonic"].values
    rms = np.sqrt(0.5 * (np.abs(harmonics_of(dynamics, "dte")[order][:, :, h > 0]) ** 2).sum(axis=2)) * 1e6
    marker = {"marker": "o", "markersize": 4} if len(speed) < 40 else {}
    lines = distinct_lines(dynamics["mesh"].values, rms.T)
    for i, (text, row) in enumerate(lines):
        top.plot(speed, rms[:, row], label=text, **marker, **line_style(i))
    failed = ~dynamics["converged"].values[order].astype(bool)
    if failed.any():
        top.plot(
            speed[failed], rms[failed].max(axis=1), "x", color=BLACK, markersize=8, label="not converged"
        )
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
    for ax, place in ((top, "outside upper center"), (bottom, "outside lower center")):
        figure.legend(*ax.get_legend_handles_labels(), loc=place, ncols=3, fontsize=SIZE - 1, frameon=False)
    return figure


def ring_mean_deflection(
    dynamics: xr.Dataset, planetary_set: PlanetarySet, *, speed_index: int = 0
) -> Figure:
    """Mean radial deflection of the ring's outer surface in the carrier frame, polar.

    Parameters
    ----------
    dynamics : xarray.Dataset
        With ``ring_real`` and ``ring_imag`` (speed, harmonic, circumferential) [m].
    planetary_set : PlanetarySet
        Angles of the planets, which are marked.
    speed_index : int

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(width=6.4, height=6.6, polar=True)
    angle = np.linspace(0.0, 2 * np.pi, 721)
    zero = int(np.flatnonzero(dynamics["harmonic"].values == 0)[0])
    component = harmonics_of(dynamics, "ring")[speed_index, zero]
    radial = (np.exp(1j * np.outer(angle, dynamics["circumferential"].values)) @ component).real * 1e6
    size = np.abs(radial).max(initial=0.0) or 1.0
    ax.plot(angle, np.zeros_like(angle), color="0.45", linewidth=1.2, label="undeformed")
    ax.fill_between(angle, 0.0, radial, color=SKY, alpha=0.35, linewidth=0)
    ax.plot(angle, radial, color=BLUE, linewidth=2.0, label="outer surface, outwards positive")
    for n, psi in enumerate(planetary_set.planet_angles):
        ax.plot([psi, psi], [-1.2 * size, 1.25 * size], "--", color=VERMILION, linewidth=1.2, label="planets")
        ax.text(psi, -0.75 * size, str(n + 1), bbox=_BADGE, ha="center", va="center", fontsize=SIZE)
    ax.spines["inner"].set_visible(False)
    ax.set_rorigin(-2 * size)
    ax.set_ylim(-1.2 * size, 1.25 * size)
    ax.set_rlabel_position(_free_angle(planetary_set.planet_angles))
    ax.tick_params(axis="x", pad=14)
    speed = rpm(dynamics["speed"].values[speed_index])
    ax.set_title(f"mean radial deflection [µm] over the angle in the carrier frame, {speed}", fontsize=SIZE)
    legend_below(figure)
    return figure


def _free_angle(angles) -> float:
    """An angle [deg] in the middle of the widest gap between the planets."""
    sorted_angles = np.sort(np.asarray(angles, float) % (2 * np.pi))
    gaps = np.diff(np.append(sorted_angles, sorted_angles[0] + 2 * np.pi))
    widest = int(np.argmax(gaps))
    return float(np.degrees(sorted_angles[widest] + gaps[widest] / 2))


def _panels(count: int):
    """Figure with `count` axes of one vertical scale, two in a row."""
    rows, columns = -(-count // 2), min(count, 2)
    figure, axes = new_figure(
        rows=rows, columns=columns, width=max(5.0 * columns, 6.5), height=0.8 + 3.6 * rows, sharey=True
    )
    for ax in axes[count:]:
        figure.delaxes(ax)
    return figure, axes[:count]


def _few(count: int, limit: int = 4) -> list[int]:
    """Numbers of at most `limit` speeds, spread evenly."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, limit))})


_CIRCLE = np.linspace(0.0, 2 * np.pi, 241)
_MARKERS = "osD^vPX*"


def mode_shapes(
    modes: xr.Dataset, planetary_set: PlanetarySet, *, shown: Sequence[int] | None = None, scale: float = 0.16
) -> Figure:
    """Bodies and outer ring surface in their undeformed (grey) and displaced positions.

    Parameters
    ----------
    modes : xarray.Dataset
        With ``shape`` (dof, mode), ``frequency`` [Hz], ``kind``, ``nodal_diameter`` and, where there is
        an elastic ring, ``ring_shape_real`` and ``ring_shape_imag`` (mode, circumferential).
    planetary_set : PlanetarySet
        Radii, centre distance and planet angles.
    shown : sequence of int, optional
        Mode numbers from 0; the first twelve that are no rigid-body motions when omitted.
    scale : float
        Largest displacement as a share of the ring's outer radius.

    Returns
    -------
    Figure
    """
    frequency = modes["frequency"].values
    if shown is None:
        elastic = np.flatnonzero(frequency > 1e-3 * frequency.max(initial=0.0) / max(len(frequency), 1))
        shown = elastic[:12]
    shown = [int(mode) for mode in shown]
    columns = max(min(4, len(shown)), 1)
    rows = max(-(-len(shown) // columns), 1)
    figure, axes = new_figure(rows=rows, columns=columns, width=2.5 * columns, height=2.75 * rows + 0.5)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for ax, mode in zip(axes, shown):
        _draw_mode(ax, modes, planetary_set, mode, scale)
    legend_below(figure, columns=5)
    return figure


def _draw_mode(ax, modes, planetary_set, mode, scale):
    shape = dict(zip((str(name) for name in modes["dof"].values), modes["shape"].values[:, mode]))
    outer = planetary_set.ring.rim_radius
    ring = _ring_radial(modes, mode)
    bodies = _bodies(planetary_set)
    largest = np.abs(ring).max()
    for name, radius in (("ring", outer), *((name, body[1]) for name, body in bodies.items())):
        x, y, turn = _motion(shape, name)
        largest = max(largest, np.hypot(x, y), abs(turn) * radius)
    factor = scale * outer / largest if largest > 0 else 0.0
    circle = np.exp(1j * _CIRCLE)
    ax.plot(*_xy(outer * circle), color="0.8", linewidth=1.0, label="at rest")
    rigid = _motion(shape, "ring")
    shift, turn = factor * (rigid[0] + 1j * rigid[1]), factor * rigid[2]
    ax.plot(
        *_xy((outer + factor * ring) * circle + shift),
        color=BLACK,
        linewidth=1.8,
        label="ring, outer surface",
    )
    if "ring: rotation" in shape:
        # a rigid ring shows its rotation by a mark in its rim
        mark = np.array([0.9, 1.0]) * outer
        ax.plot(*_xy(1j * mark), color="0.8", linewidth=1.0)
        ax.plot(*_xy(shift + 1j * mark * np.exp(1j * turn)), color=BLACK, linewidth=1.8)
    for name, (centre, radius, colour, text) in bodies.items():
        x, y, turn = _motion(shape, name)
        moved = centre + factor * (x + 1j * y)
        spoke = np.exp(1j * (np.angle(centre) if centre else 0.0)) * radius
        if name == "carrier":
            _draw_carrier(ax, planetary_set, moved, factor * turn, colour)
            continue
        ax.plot(*_xy(centre + radius * circle), color="0.8", linewidth=1.0)
        ax.plot(*_xy(np.array([centre, centre + spoke])), color="0.8", linewidth=1.0)
        ax.plot(*_xy(moved + radius * circle), color=colour, linewidth=1.6, label=text)
        ax.plot(
            *_xy(np.array([moved, moved + spoke * np.exp(1j * factor * turn)])), color=colour, linewidth=1.6
        )
    span = 1.24 * outer
    ax.set_xlim(-span, span)
    ax.set_ylim(-span, span)
    diameter = int(modes["nodal_diameter"].values[mode])
    text = f"mode {mode + 1}: {modes['frequency'].values[mode]:.5g} Hz\n{modes['kind'].values[mode]}"
    ax.set_title(text + (f", n = {diameter}" if diameter >= 0 else ""), fontsize=SIZE - 1.5)


def _draw_carrier(ax, planetary_set, moved, turn, colour):
    pins = planetary_set.centre_distance * np.exp(1j * np.asarray(planetary_set.planet_angles, float))
    pins = moved + pins * np.exp(1j * turn)
    for pin in pins:
        ax.plot(*_xy(np.array([moved, pin])), color=colour, linewidth=1.2, linestyle="--", label="carrier")
    ax.plot(*_xy(pins), "o", color=colour, markersize=3)


def _bodies(planetary_set):
    """Centre, radius, colour and legend of every rigid body."""
    bodies = {"carrier": (0j, planetary_set.centre_distance, GREEN, "carrier")}
    bodies["sun"] = (0j, planetary_set.sun.reference_radius, VERMILION, "sun")
    for n, angle in enumerate(planetary_set.planet_angles):
        centre = planetary_set.centre_distance * np.exp(1j * float(angle))
        bodies[f"planet {n + 1}"] = (centre, planetary_set.planet.reference_radius, BLUE, "planets")
    return bodies


def _motion(shape, name):
    return tuple(float(shape.get(f"{name}: {axis}", 0.0)) for axis in ("x", "y", "rotation"))


def _ring_radial(modes, mode):
    """Radial displacement of the outer surface at the angles of `_CIRCLE`."""
    if "ring_shape_real" not in modes:
        return np.zeros_like(_CIRCLE)
    n = modes["circumferential"].values
    value = modes["ring_shape_real"].values[mode] + 1j * modes["ring_shape_imag"].values[mode]
    return (np.exp(1j * np.outer(_CIRCLE, n)) @ value).real


def _xy(points):
    return points.real, points.imag


def natural_frequencies(modes: xr.Dataset, *, mesh_frequencies: Sequence[tuple[str, float]] = ()) -> Figure:
    """Natural frequencies over the nodal diameters of the ring, by kind of mode.

    Parameters
    ----------
    modes : xarray.Dataset
        With ``frequency`` [Hz], ``kind`` and ``nodal_diameter``.
    mesh_frequencies : sequence of (str, float)
        Legend text and frequency [Hz] of excitations to draw as horizontal lines.

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(height=5.0)
    kinds = np.array([str(kind) for kind in modes["kind"].values])
    frequency, diameter = modes["frequency"].values, modes["nodal_diameter"].values
    for i, kind in enumerate(dict.fromkeys(kinds)):
        rows = kinds == kind
        ax.plot(
            diameter[rows],
            frequency[rows] * 1e-3,
            _MARKERS[i % len(_MARKERS)],
            color=COLOURS[i % len(COLOURS)],
            markersize=6,
            markerfacecolor="none",
            markeredgewidth=1.6,
            label=f"{kind} ({np.count_nonzero(rows)})",
        )
    for i, (text, value) in enumerate(mesh_frequencies):
        dash = (0, (4, 2 + 2 * i))
        ax.axhline(value * 1e-3, color=(GREY, ORANGE)[i % 2], linewidth=1.0, linestyle=dash, label=text)
    ticks = np.unique(diameter)
    if len(ticks) <= 25:
        ax.set_xticks(ticks, ["none" if n < 0 else str(n) for n in ticks])
    ax.set_ylim(bottom=0)
    label(ax, "nodal diameters of the ring [1]", "natural frequency [kHz]")
    legend_below(figure, columns=4)
    return figure


# share of the height below the strongest line that a letter above it takes
_ROOM = 0.068
# numbers along an axis, and lines of a spectrum that can be told apart, at most
_TICKS, _STEMS = 20, 4000
_LINEAR, _EXACT = "Heaviside, linear interpolation", "exact circumferential Fourier"
ACCELERATION = "acceleration [m/s²]"


def strongest_harmonic(housing: xr.Dataset, *, speed_index: int, ring_teeth: int) -> int:
    """Mesh harmonic whose band holds the strongest line at one speed."""
    order, amplitude = housing["order"].values, housing["order_amplitude"].values[speed_index]
    audible = order > ring_teeth / 2
    return max(1, round(float(order[audible][np.argmax(amplitude[audible])]) / ring_teeth))


def band(housing: xr.Dataset, *, speed_index: int, ring_teeth: int, harmonic: int) -> BandAnalysis:
    """Lines, signal, envelope and lobes around one mesh harmonic; see `housing.orders.analyse_band`."""
    spectrum = _spectrum(housing["acceleration"].values[speed_index])
    return analyse_band(spectrum, ring_teeth, harmonic)


def shown_harmonics(housing: xr.Dataset, *, speed_index: int, ring_teeth: int) -> tuple[int, ...]:
    """The first mesh harmonic, and the one with the strongest line where that is another one."""
    strongest = strongest_harmonic(housing, speed_index=speed_index, ring_teeth=ring_teeth)
    return tuple(sorted({1, strongest}))


def housing_signal(
    housing: xr.Dataset, *, speed_index: int = 0, ring_teeth: int, harmonics: Sequence[int] | None = None
) -> Figure:
    """Acceleration over one carrier revolution: whole, and around mesh harmonics with its envelope.

    Parameters
    ----------
    housing : xarray.Dataset
        With ``acceleration`` (speed, time) [m/s^2].
    speed_index : int
    ring_teeth : int
    harmonics : sequence of int, optional
        Mesh harmonics of the bands; the first and the one with the strongest line when omitted.

    Returns
    -------
    Figure
    """
    if harmonics is None:
        harmonics = shown_harmonics(housing, speed_index=speed_index, ring_teeth=ring_teeth)
    speed = rpm(housing["speed"].values[speed_index])
    figure, axes = new_figure(
        rows=1 + len(harmonics), width=9.5, height=1.0 + 2.5 * (1 + len(harmonics)), sharex=True
    )
    signal = housing["acceleration"].values[speed_index]
    text = "largest and smallest within a mesh period"
    around = _extremes(signal, ring_teeth)
    title = f"{speed}{excited_to(housing, speed_index)}: all orders"
    _draw_signal(axes[0], signal, around, title, text=text, colour=ORANGE)
    for ax, harmonic in zip(axes[1:], harmonics):
        found = band(housing, speed_index=speed_index, ring_teeth=ring_teeth, harmonic=harmonic)
        around = found.envelope, -found.envelope
        _draw_signal(ax, found.signal, around, _band_title(speed, found))
        lobes = found.lobes
        # an empty set of markers that are not clipped would upset the layout
        if len(lobes.position):
            ax.plot(lobes.position, lobes.height, "v", color=BLACK, markersize=7, label="lobe", clip_on=False)
    axes[-1].set_xlim(0, 1)
    label(axes[-1], "carrier revolutions [1]")
    legend_below(figure)
    return figure


def _draw_signal(ax, signal, around, title, *, text="envelope", colour=VERMILION):
    at = np.arange(len(signal)) / len(signal)
    ax.plot(at, signal, color=BLUE, linewidth=0.5, label="acceleration of the fixed point")
    for side in around:
        at = np.append(np.arange(len(side)) / len(side), 1.0)
        ax.plot(at, np.append(side, side[0]), color=colour, linewidth=1.3, label=text)
    label(ax, y=ACCELERATION, title=title)


def _extremes(signal, ring_teeth):
    """Largest and smallest value within one mesh period around every sample: signals may lack symmetry."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    size = max(len(signal) // ring_teeth, 1)
    return maximum_filter1d(signal, size, mode="wrap"), minimum_filter1d(signal, size, mode="wrap")


def _band_title(speed: str, found: BandAnalysis) -> str:
    count, threshold = len(found.lobes.position), found.lobes.threshold
    return (
        f"{speed}: orders {found.low} to {found.high}, mesh harmonic {found.harmonic}: {count} lobes "
        f"(prominence above {threshold:.0%} of the largest)"
    )


def order_spectrum(housing: xr.Dataset, *, speed_index: int = 0, ring_teeth: int, zooms: int = 2) -> Figure:
    """Order spectrum with the mesh harmonics marked, and the strongest bands with their lines labelled.

    A line of harmonic ``h`` and nodal diameter ``n`` stands at order ``h z_ring - n``.

    Parameters
    ----------
    housing : xarray.Dataset
        With ``order_amplitude`` and ``order_amplitude_exact`` (speed, order) [m/s^2].
    speed_index : int
    ring_teeth : int
    zooms : int
        Number of bands shown enlarged.

    Returns
    -------
    Figure
    """
    order = housing["order"].values
    linear, exact = (
        housing[name].values[speed_index] for name in ("order_amplitude", "order_amplitude_exact")
    )
    bands = _strongest_bands(order, linear, ring_teeth, zooms)
    figure, axes = new_figure(rows=1 + len(bands), width=9.5, height=3.2 + 3.8 * len(bands))
    largest = max(linear.max(initial=0.0), exact.max(initial=0.0)) or 1.0
    floor = 1e-4 * largest
    # what stands for the ring between its points is said where it is not the ring itself
    form = _EXACT if np.array_equal(linear, exact) else _LINEAR
    _stems(axes[0], order, linear, floor, text=form)
    # the record may reach further than the excitation at this speed
    end = order[np.maximum(linear, exact) > floor].max(initial=ring_teeth)
    axes[0].set_xlim(0, end + 0.5 * ring_teeth)
    last = int(end + 0.5 * ring_teeth) // ring_teeth
    # at most twenty numbers, that none covers another
    multiples = np.arange(1, last + 1) if last <= _TICKS else np.arange(0, last + 1, _whole_step(last))[1:]
    top = axes[0].secondary_xaxis("top")
    top.set_xticks(multiples * ring_teeth, [str(h) for h in multiples])
    top.tick_params(labelsize=SIZE - 2)
    top.set_xlabel("harmonic of the mesh frequency [1]", fontsize=SIZE - 1)
    label(axes[0], "carrier order [1]", ACCELERATION)
    axes[0].set_ylim(floor, 2.5 * largest)
    for ax, harmonic in zip(axes[1:], bands):
        _draw_band(ax, order, linear, exact, ring_teeth, harmonic, form)
    speed = rpm(housing["speed"].values[speed_index]) + excited_to(housing, speed_index)
    figure.suptitle(f"Order spectrum of the fixed sensor, {speed}", fontsize=12)
    legend_below(figure)
    return figure


def _strongest_bands(order, amplitude, ring_teeth, count):
    """Mesh harmonics whose bands hold the strongest lines, ascending."""
    harmonics = np.rint(order / ring_teeth).astype(int)
    peaks = {int(h): amplitude[harmonics == h].max() for h in np.unique(harmonics) if h > 0}
    ranked = sorted((h for h in peaks if peaks[h] > 0), key=lambda h: (-peaks[h], h))
    return sorted(ranked[:count])


def _stems(ax, order, amplitude, floor, *, text, colour=BLUE, width=1.0):
    shown = _highest(order, amplitude, amplitude > floor)
    ax.vlines(order[shown], floor, amplitude[shown], color=colour, linewidth=width, label=text)
    ax.set_yscale("log")


def _highest(order, amplitude, shown) -> np.ndarray:
    """Numbers of the lines to draw: of more than there are pixels, the highest one of every column."""
    numbers = np.flatnonzero(shown)
    if len(numbers) <= _STEMS:
        return numbers
    column = ((order[numbers] - order[0]) * (_STEMS / np.ptp(order))).astype(int)
    # the last of a column in ascending order is its highest
    ranked = np.lexsort((amplitude[numbers], column))
    last = np.append(np.diff(column[ranked]) > 0, True)
    return numbers[ranked[last]]


def _draw_band(ax, order, linear, exact, ring_teeth, harmonic, form):
    centre = harmonic * ring_teeth
    own = np.rint(order / ring_teeth) == harmonic
    largest = max(linear[own].max(initial=0.0), exact[own].max(initial=0.0)) or 1.0
    floor = 3e-4 * largest
    # the images that the interpolation makes far from the centre are left to the upper diagram
    reach = int(np.abs(order[own & (exact > floor)] - centre).max(initial=4.0)) + 2
    inside = np.abs(order - centre) <= reach
    _stems(ax, order[inside], linear[inside], floor, text=form, width=2.5)
    if form != _EXACT:
        shown = inside & (exact > floor)
        ax.plot(order[shown], exact[shown], "o", markerfacecolor="none", color=VERMILION, label=_EXACT)
    peak = np.maximum(linear, exact)
    limit, longest = peak[inside].max(initial=floor), 0
    for k in _labelled(order, peak, inside & (peak > floor), spacing=reach / 22):
        offset = round(order[k]) - centre
        text = (
            f"{order[k]:g}"
            if offset == 0
            else f"{order[k]:g} = {_multiple(harmonic, ring_teeth)} {offset:+d}"
        )
        longest = max(longest, len(text))
        ax.annotate(
            text.replace("-", "−"),
            (order[k], peak[k]),
            xytext=(0, 7),
            textcoords="offset points",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=SIZE - 2.5,
        )
    decades = np.arange(np.ceil(np.log10(floor)), np.floor(np.log10(2 * limit)) + 1)
    ax.set_yticks(10.0**decades)
    ax.minorticks_off()
    # room above the strongest line for its label on the logarithmic axis
    ax.set_ylim(floor, limit * (limit / floor) ** (_ROOM * longest) if limit > floor else 10 * floor)
    ax.set_xlim(centre - reach, centre + reach)
    label(ax, "carrier order [1]", ACCELERATION, f"around mesh harmonic {harmonic} (order {centre})")


def _multiple(harmonic, ring_teeth):
    return str(ring_teeth) if harmonic == 1 else f"{harmonic}·{ring_teeth}"


def _labelled(order, amplitude, candidates, *, spacing, limit=12):
    """Strongest lines whose labels do not run into each other."""
    chosen = []
    for k in np.flatnonzero(candidates)[np.argsort(-amplitude[candidates], kind="stable")]:
        if all(abs(order[k] - order[other]) >= spacing for other in chosen):
            chosen.append(k)
        if len(chosen) == limit:
            break
    return chosen


def modulation_polar(
    housing: xr.Dataset, *, speed_index: int = 0, ring_teeth: int, harmonics: Sequence[int] | None = None
) -> Figure:
    """Envelope around mesh harmonics over the angle of the carrier, one polar diagram for each.

    Parameters
    ----------
    housing : xarray.Dataset
        With ``acceleration`` (speed, time) [m/s^2].
    speed_index : int
    ring_teeth : int
    harmonics : sequence of int, optional
        Mesh harmonics; the first and the one with the strongest line when omitted.

    Returns
    -------
    Figure
    """
    if harmonics is None:
        harmonics = shown_harmonics(housing, speed_index=speed_index, ring_teeth=ring_teeth)
    speed = rpm(housing["speed"].values[speed_index])
    figure, axes = new_figure(columns=len(harmonics), width=5.2 * len(harmonics), height=6.2, polar=True)
    for i, (ax, harmonic) in enumerate(zip(axes, harmonics)):
        found = band(housing, speed_index=speed_index, ring_teeth=ring_teeth, harmonic=harmonic)
        lobes, angle = found.lobes, np.linspace(0.0, 2 * np.pi, len(found.envelope) + 1)
        value = np.append(found.envelope, found.envelope[0])
        ax.plot(angle, value, color=COLOURS[i % len(COLOURS)], linewidth=2.0)
        # a polygon would search the extremes of every one of its sides
        ax.fill_between(angle, 0.0, value, color=COLOURS[i % len(COLOURS)], alpha=0.15, linewidth=0)
        ax.plot(2 * np.pi * lobes.position, lobes.height, "v", color=BLACK, markersize=6, label="lobe")
        ax.set_yticks(np.arange(1, 5) * _round_step(value.max(initial=0.0) / 4))
        ax.set_ylim(0, 1.12 * value.max(initial=0.0) or 1.0)
        for text in ax.get_yticklabels():
            text.set_bbox({"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0})
        # the scale stands where the curve is lowest, so that it hides nothing
        ax.set_rlabel_position(float(np.degrees(angle[np.argmin(_around(found.envelope))])))
        ax.set_title(
            f"{speed}, mesh harmonic {harmonic}: {len(lobes.position)} lobes\n"
            "envelope of the acceleration [m/s²] over the carrier angle",
            fontsize=SIZE,
            pad=14,
        )
    legend_below(figure)
    return figure


def _around(values):
    """Mean over the fifteenth of a turn around every value."""
    from scipy.ndimage import uniform_filter1d

    return uniform_filter1d(values, max(len(values) // 15, 1), mode="wrap")


def _whole_step(last: int) -> int:
    """Whole step of at most `_TICKS` ticks up to `last`."""
    return max(round(_round_step(last / _TICKS)), 1)


def _round_step(step: float) -> float:
    """The next larger of 1, 2, 2.5, 5, 10 times a power of ten."""
    if step <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(step))
    return min(f * power for f in (1.0, 2.0, 2.5, 5.0, 10.0) if f * power >= step * (1 - 1e-12))
