"""Figures of runup.nc: waterfall, order cuts, levels over the speed, Campbell diagram of excited modes.

Colours tell kinds of modes and of meshes; everything else is labelled where it stands.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    NOTICEABLE,
    ORANGE,
    PURPLE,
    SIZE,
    SMALL,
    VERMILION,
    Drawings,
    draw_at_right,
    label,
    legend_below,
    name_curves,
    new_figure,
)
from femgear.report.tables import level_change_at

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

RUNUP_CAPTIONS = {
    "run_up_levels": (
        "Over the speed: level at the sensor with its strongest resonances (mode × mesh harmonic), "
        "fluctuation of the mesh forces, and dynamic factor K_v, largest over mean mesh force. Blue: the level "
        "with lines weighted as the ear does. Dots: "
        "operating speeds, with the excitation of the run-up."
    ),
    "campbell": (
        "Natural frequencies and harmonics of the mesh frequency. Circles mark where a harmonic meets a mode "
        "that it excites, larger for a higher level of that mode at that harmonic; elsewhere the phases of "
        "the meshes cancel the force on the mode."
    ),
    "waterfall": "Level at the sensor over the speed, by frequency and by carrier order; what lies 80 dB "
    "and more below the largest is dark.",
    "order_cuts": (
        "Amplitude of the strongest line around each of the strongest mesh harmonics over the speed; the "
        "others in grey."
    ),
}
_RAYS = 10
"""Mesh harmonics of the Campbell diagram."""
_DYNAMIC = 80.0
"""Range of the waterfall [dB]."""
_PIXELS = (400, 640)
_NAME, _CIRCLE = np.array([0.1, 0.035]), np.array([0.02, 0.03])
"""Width and height of the name of a mode, and of a crossing, with what is around it, parts of the axes."""
_CUTS, _NAMED = 6, 8
KIND_COLOURS = {
    "rotational": BLUE,
    "translational": VERMILION,
    "planet": GREEN,
    "mixed": PURPLE,
    "torsional": BLUE,
    "lateral": VERMILION,
    "coupled": GREEN,
}
_MESHES = (BLUE, VERMILION)


def campbell_diagram(runup: xr.Dataset, modes: xr.Dataset, *, rays: int = _RAYS) -> Figure:
    """Draw modes and mesh harmonics over the speeds of runup.nc, the excited crossings marked.

    So many harmonics at least, and those of the resonances that `runup_levels` names.
    """
    figure, (ax,) = new_figure(height=5.8)
    speed, mesh = runup["speed"].values, runup["mesh_frequency"].values * 1e-3
    named = runup.isel(resonance=_strongest(runup))
    shown = max((rays - 2) * mesh[-1], 1.05e-3 * float(named["frequency"].max()) if len(named["mode"]) else 0)
    top = min(float(runup["excitation_limit"].max()) * 1e-3, shown)
    rays = max(rays, int(named["mesh_harmonic"].max()) if len(named["mode"]) else 0)
    ax.set_xlim(speed[0], speed[-1])
    ax.set_ylim(0.0, top)
    for frequency, kind in zip(modes["frequency"].values * 1e-3, map(str, modes["kind"].values)):
        if 0.0 < frequency <= top:
            name = kind.removeprefix("ring, ")
            style = {"color": KIND_COLOURS.get(name, GREY), "linestyle": "--" if name != kind else "-"}
            ax.axhline(frequency, linewidth=1.2, label=f"{kind} mode", **style)
    before = np.inf
    for h in range(1, rays + 1):
        ax.plot(speed, h * mesh, color="0.55", linewidth=0.9)
        inside = h * mesh[-1] <= top
        at = (speed[-1], h * mesh[-1]) if inside else (top * speed[-1] / (h * mesh[-1]), top)
        side = {"xytext": (4, 0), "va": "center"} if inside else {"xytext": (0, 3), "ha": "center"}
        if not inside and before - at[0] < 0.07 * np.ptp(speed):
            continue  # its name would lie on that of the ray before it
        before = before if inside else at[0]
        ax.annotate(f"h = {h}", at, textcoords="offset points", fontsize=SMALL, color="0.35", **side)
    rows = (runup["mesh_harmonic"].values <= rays) & (runup["frequency"].values * 1e-3 <= top)
    level = runup["resonance_alone"].values[rows]
    place = runup["resonance_speed"].values[rows], runup["frequency"].values[rows] * 1e-3
    size = 12.0 + 180.0 * level / max(level.max(initial=0.0), np.finfo(float).tiny)
    ax.scatter(*place, s=size, facecolor="none", edgecolor=BLACK, linewidth=1.3, zorder=3, clip_on=False)
    _name_modes(ax, runup.isel(resonance=rows), speed)
    _operating(ax, runup)
    label(ax, "speed of the input [rpm]", "frequency [kHz]")
    legend_below(figure, columns=3)
    return figure


def _name_modes(ax, crossings: xr.Dataset, speed: np.ndarray) -> None:
    """Write the numbers of the modes on their lines, where neither a crossing nor a name is yet."""
    low, high = ax.get_ylim()
    across = (crossings["resonance_speed"].values - speed[0]) / np.ptp(speed)
    up = (crossings["frequency"].values * 1e-3 - low) / (high - low)
    circles, names = np.stack([across, up], axis=1), np.empty((0, 2))
    for mode, first in zip(*np.unique(crossings["mode"].values, return_index=True)):
        for left in np.arange(0.02, 0.88, 0.03):
            middle = left + 0.5 * _NAME[0], up[first]
            apart = [(np.abs(names - middle) > _NAME), np.abs(circles - middle) > 0.5 * (_NAME + _CIRCLE)]
            if np.concatenate(apart).any(axis=1).all():
                names = np.append(names, [middle], axis=0)
                ax.annotate(
                    f"mode {mode}",
                    (left, up[first]),
                    xycoords="axes fraction",
                    va="center",
                    fontsize=SMALL,
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
                )
                break


def _operating(ax, runup: xr.Dataset) -> None:
    """Mark the operating speeds, if they are few, by dotted lines."""
    operating = np.atleast_1d(runup.attrs["operating_speeds"])
    for speed_named in operating[: _NAMED if len(operating) <= _NAMED else 0]:
        ax.axvline(speed_named, color=ORANGE, linewidth=1.6, linestyle=":", label="operating speed")


def waterfall(runup: xr.Dataset) -> Figure:
    """Draw the level [dB re 1e-6 m/s^2] of runup.nc over speed and frequency, and over speed and order."""
    figure, axes = new_figure(columns=2, height=4.8, sharey=True)
    order, speed = runup["order"].values, runup["speed"].values
    power = 0.5 * (runup["lines_real"].values.astype(float) ** 2 + runup["lines_imag"].values.astype(float) ** 2)
    teeth, reach = int(runup.attrs["ring_teeth"]), 1e-3 * float(runup["excitation_limit"].max())
    # a line crosses all that lies between the middles of the steps on either side of its speed
    ends = np.concatenate([speed[:1], 0.5 * (speed[1:] + speed[:-1]), speed[-1:]])
    turns = 1e-3 * np.interp(ends, speed, np.abs(runup["carrier_speed"].values)) / (2.0 * np.pi)
    step = max(int(np.gcd.reduce(order)), 1)
    views = (
        (turns, reach, min(_PIXELS[1], int(reach / (turns[-1] * step))), "frequency [kHz]"),
        (np.ones(len(ends)), (_RAYS + 0.5) * teeth, int((_RAYS + 0.5) * teeth // step), "carrier order [1]"),
    )
    images = []
    for factor, end, columns, _ in views:
        column = (factor[:, None] * order * (columns / end)).astype(int)
        image = np.zeros((len(speed), columns + 1))
        row = np.broadcast_to(np.arange(len(speed))[:, None], power.shape)
        np.add.at(image, (row, np.minimum(column[:-1], columns)), power)
        np.add.at(image, (row, np.minimum(column[1:] + 1, columns)), -power)
        images.append(np.maximum(np.cumsum(image, axis=1)[:, :-1], 0.0))
    # rows of equal height, whatever the speeds between which resonances got their own
    even = np.linspace(speed[0], speed[-1], _PIXELS[0])
    nearest = np.abs(speed - even[:, None]).argmin(axis=1)
    floor = float(runup.attrs["reference_acceleration"]) ** 2
    with np.errstate(divide="ignore"):
        levels = [10.0 * np.log10(image[nearest] / floor) for image in images]
    highest = max(float(panel_level.max()) for panel_level in levels)
    for ax, panel_level, (_, end, _, text) in zip(axes, levels, views):
        shown = ax.imshow(
            np.maximum(panel_level, highest - _DYNAMIC),
            origin="lower",
            aspect="auto",
            cmap="cividis",
            extent=(0.0, end, speed[0], speed[-1]),
            vmin=highest - _DYNAMIC,
            vmax=highest,
            interpolation="nearest",
        )
        ax.grid(False)
        label(ax, text)
    label(axes[0], y="speed of the input [rpm]")
    upper = axes[1].secondary_xaxis("top", functions=(lambda x: x / teeth, lambda h: h * teeth))
    upper.set_xticks(range(1, _RAYS + 1))
    upper.set_xlabel("harmonic of the mesh frequency [1]", fontsize=SIZE - 1)
    bar = figure.colorbar(shown, ax=axes, pad=0.02)
    bar.set_label("level of the acceleration [dB re 1 µm/s²]", fontsize=SIZE)
    _doubt(figure, runup)
    return figure


def draw_order_cuts(runup: xr.Dataset) -> Figure:
    """Draw amplitudes of the strongest orders of runup.nc over the speed, axes for each."""
    order, speed = runup["order"].values, runup["speed"].values
    amplitude = np.hypot(runup["lines_real"].values, runup["lines_imag"].values)
    teeth, peak = int(runup.attrs["ring_teeth"]), amplitude.max(axis=0)
    band, chosen = np.rint(order / teeth).astype(int), dict[int, int]()
    for k in np.argsort(-peak, kind="stable"):
        if band[k] > 0 and len(chosen) < _CUTS:
            chosen.setdefault(int(band[k]), int(k))
    rows = max(-(-len(chosen) // 3), 1)
    figure, axes = new_figure(rows=rows, columns=3, height=0.6 + 2.2 * rows, sharex=True, sharey=True)
    for ax in axes[len(chosen) :]:
        ax.set_axis_off()
    largest = max((peak[k] for k in chosen.values()), default=1.0)
    for ax, (h, k) in zip(axes, sorted(chosen.items())):
        for other in chosen.values():
            ax.plot(speed, amplitude[:, other], color="0.82", linewidth=0.9)
        ax.plot(speed, amplitude[:, k], color=BLUE, linewidth=1.8)
        beside = int(order[k]) - h * teeth
        sign = f" {'+' if beside > 0 else '−'} {abs(beside)}" if beside else ""
        ax.set_yscale("log")
        ax.set_ylim(1e-4 * largest, 2.0 * largest)
        label(ax, title=f"order {order[k]} = {h}·{teeth}{sign}")
    for ax in axes[-3:]:
        label(ax, "speed of the input [rpm]")
    for ax in axes[::3]:
        label(ax, y="amplitude [m/s²]")
    _doubt(figure, runup)
    return figure


def _doubt(figure: Figure, runup: xr.Dataset) -> None:
    """Write above a picture of lines where the excitation ends short, if it does."""
    if words := _ends_short(runup):
        speed = runup["speed"].values[_short(runup)]
        figure.suptitle(f"{speed.min():.4g} to {speed.max():.4g} rpm: {words}", fontsize=12)


def runup_levels(
    runup: xr.Dataset, limit: np.ndarray | None = None, weighted: tuple[str, np.ndarray] | None = None
) -> Figure:
    """Draw level, fluctuation of the mesh forces and dynamic factors of runup.nc over the speed.

    ``limit`` (speeds,) is the largest level allowed [m/s^2], ``weighted`` what the ear hears of the level: its words
    and values (speeds,) [dB(A)], which have an axis at the right.
    """
    figure, axes = new_figure(rows=3, height=7.4, sharex=True)
    speed, level = runup["speed"].values, runup["level"].values
    short = _short(runup)
    _curve(axes[0], speed, level, short, color=BLACK)
    axes[0].set_ylim(0.0, 1.45 * level.max(initial=0.0) or 1.0)
    words = "a × b: mode a at mesh harmonic b; dots: operating speeds"
    if limit is not None:
        axes[0].plot(speed, limit, color=VERMILION, linewidth=1.6, linestyle="--")
        axes[0].set_ylim(top=max(axes[0].get_ylim()[1], 1.1 * float(limit.max())))
        words += "; dashed: limit"
    if runup.attrs.get("method", "exact") != "exact":
        words += f"\nexcited up to {1e-3 * runup['excitation_limit'].values.max():.4g} kHz"
    if short.any():
        words += f"\ndotted: {_ends_short(runup)}"
    if weighted is not None:
        draw_at_right(axes[0], speed, *weighted)
    label(axes[0], y="level, r.m.s. [m/s²]", title=words)
    _name_resonances(axes[0], runup)
    operating = np.atleast_1d(runup.attrs["operating_speeds"])
    operating = operating[(operating >= speed[0]) & (operating <= speed[-1])]
    axes[0].plot(operating, np.interp(operating, speed, level), "o", color=ORANGE, markersize=7, zorder=3)
    names = [str(name) for name in runup["mesh_kind"].values]
    for ax, name in zip(axes[1:], ("force_rms", "dynamic_factor")):
        curves = runup[name].values.T
        for curve, text, colour in zip(curves, names, _MESHES):
            _curve(ax, speed, curve, short, color=colour, label=text)
            ax.plot(operating, np.interp(operating, speed, curve), "o", color=ORANGE, markersize=7, zorder=3)
    axes[1].set_ylim(bottom=0.0)
    axes[2].set_ylim(bottom=1.0)
    axes[0].set_xlim(speed[0], speed[-1])
    for ax in axes[1:]:
        name_curves(ax)
    label(axes[1], y="mesh force, r.m.s.\nabout its mean [N]")
    label(axes[2], "speed of the input [rpm]", "dynamic factor K_v [1]")
    return figure


def _short(runup: xr.Dataset) -> np.ndarray:
    """Whether (bool, speed) the excitation ends short: more of it would change the level noticeably."""
    return np.abs(level_change_at(runup, runup["speed"].values)) >= NOTICEABLE


def _ends_short(runup: xr.Dataset) -> str:
    """Say where the excitation ends short; empty if it does so at no speed."""
    if not (short := _short(runup)).any():
        return ""
    ends = 1e-3 * runup["excitation_limit"].values[short]
    return f"the excitation ends short, at {ends.min():.3g} to {ends.max():.3g} kHz (W-EXCITATION)"


def _curve(ax, speed: np.ndarray, values: np.ndarray, short: np.ndarray, *, label: str = "_", **style) -> None:
    """Draw a curve over the speed, dotted where the excitation ends short (bool, of every speed)."""
    starts = [0, *(np.flatnonzero(np.diff(short)) + 1)]
    for first, end in zip(starts, [*starts[1:], len(speed)]):
        part, look = slice(first, end + 1), ":" if short[first] else "-"
        name = label if end == len(speed) else "_"
        ax.plot(speed[part], values[part], linestyle=look, linewidth=1.6, label=name, **style)


def _strongest(runup: xr.Dataset) -> list[int]:
    """Numbers of the strongest resonances, those within a fortieth of the speeds of one of them left out."""
    speed, place = runup["speed"].values, runup["resonance_speed"].values
    named = list[int]()
    for i in np.argsort(-runup["resonance_alone"].values, kind="stable"):
        if len(named) < _NAMED and (np.abs(place[named] - place[i]) > 0.025 * np.ptp(speed)).all():
            named.append(int(i))
    return named


def _name_resonances(ax, runup: xr.Dataset) -> None:
    """Name the strongest resonances above the curve of the level, none over another one."""
    for i in _strongest(runup):
        text = f"{runup['mode'].values[i]} × {runup['mesh_harmonic'].values[i]}"
        at = float(runup["resonance_speed"].values[i]), float(runup["resonance_level"].values[i])
        style = {"arrowstyle": "-", "color": "0.5", "linewidth": 0.8}
        ax.annotate(
            text,
            at,
            xytext=(0, 16),
            textcoords="offset points",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=SMALL,
            arrowprops=style,
        )


def runup_figures(
    runup: xr.Dataset,
    modes: xr.Dataset,
    limit: np.ndarray | None = None,
    weighted: tuple[str, np.ndarray] | None = None,
) -> Drawings:
    """Draw the figures of a run-up by their names; ``limit`` (n_speeds,) and ``weighted`` as of `runup_levels`."""
    return Drawings(
        {
            "run_up_levels": partial(runup_levels, runup, limit, weighted),
            "campbell": partial(campbell_diagram, runup, modes),
            "waterfall": partial(waterfall, runup),
            "order_cuts": partial(draw_order_cuts, runup),
        }
    )
