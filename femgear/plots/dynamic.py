"""Figures of dynamics.nc: dynamic transmission error and mean deflection of the ring."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    MARKERS,
    SIZE,
    SKY,
    VERMILION,
    distinct_lines,
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
        ax.set_xlim(0.4, h.max(initial=1) + 0.6)
        ax.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
        title = rpm(dynamics["speed"].values[s])
        if "excitation_limit" in dynamics:
            title += f", excited up to {float(dynamics['excitation_limit'].values[s]):.4g} Hz"
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
