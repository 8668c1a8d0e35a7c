"""Figures of dynamics.nc: dynamic transmission error and mean deflection of the ring."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    SIZE,
    SKY,
    VERMILION,
    distinct_lines,
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
        With ``ste`` (mesh, position) [m], drawn for comparison.

    Returns
    -------
    Figure
    """
    speeds = _few(dynamics.sizes["speed"])
    figure, axes = _panels(len(speeds))
    h = dynamics["harmonic"].values
    position = np.linspace(0.0, 1.0, 257)
    wave = np.exp(2j * np.pi * np.outer(h[h > 0], position))
    names = dynamics["mesh"].values
    for ax, s in zip(axes, speeds):
        error = (harmonics_of(dynamics, "dte")[s][:, h > 0] @ wave).real * 1e6
        for i, (text, row) in enumerate(distinct_lines(names, error)):
            ax.plot(
                position, error[row], label=f"dynamic, {text}", linewidth=2.0, color=COLOURS[i % len(COLOURS)]
            )
            if static is not None:
                ste = static["ste"].values[row] * 1e6
                at, ste = periodic(static["position"], ste - ste.mean())
                ax.plot(at, ste, ":", color=COLOURS[i % len(COLOURS)], label=f"static, {text}")
        ax.set_xlim(0, 1)
        frequency = float(dynamics["mesh_frequency"].values[s])
        label(
            ax,
            "position in the mesh period [1]",
            title=f"{rpm(dynamics['speed'].values[s])}, mesh frequency {frequency:.6g} Hz",
        )
    for ax in axes[::2]:
        label(ax, y="transmission error less its mean [µm]")
    legend_below(figure, columns=2)
    return figure


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
    speeds = _few(dynamics.sizes["speed"])
    figure, axes = _panels(len(speeds))
    h = dynamics["harmonic"].values
    amplitude = np.abs(harmonics_of(dynamics, "dte"))[:, :, h > 0] * 1e6
    names, floor = dynamics["mesh"].values, max(amplitude.max(initial=0.0), 1e-12) * 1e-7
    for ax, s in zip(axes, speeds):
        lines = distinct_lines(names, amplitude[s])
        width = 0.8 / len(lines)
        for i, (text, row) in enumerate(lines):
            offset = (i - (len(lines) - 1) / 2) * width
            ax.bar(
                h[h > 0] + offset,
                np.maximum(amplitude[s, row], floor),
                width,
                color=COLOURS[i % len(COLOURS)],
                hatch=("", "///", "...", "xx")[i % 4],
                edgecolor="white",
                linewidth=0.5,
                label=text,
            )
        ax.set_yscale("log")
        ax.set_xticks(h[h > 0][:: max(1, len(h) // 13)])
        label(ax, "harmonic of the mesh frequency [1]", title=rpm(dynamics["speed"].values[s]))
    for ax in axes[::2]:
        label(ax, y="amplitude of the transmission error [µm]")
    legend_below(figure)
    return figure


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
