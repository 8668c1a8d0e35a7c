"""Pictures of the response of a gearbox: levels and mesh forces over the speed, spectra at the sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.level_limits import limit_at
from femgear.report.style import (
    BLACK,
    COLOURS,
    DASHES,
    GREY,
    SMALL,
    draw_at_right,
    label,
    legend_below,
    new_figure,
    rpm,
    stems,
)
from femgear.stages.protocol import Drawn, Figures
from femgear.trains.gearbox.stage_figures import draw_stage_forces, end_with_speeds

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SENSORS_DRAWN = 6
"""Sensors with a chart of their own, at most: the loudest ones."""
LINES_NAMED = 5
"""Lines of a spectrum that are named by their origin."""
_DECADES = 4.0  # below the largest value that are drawn
_WIDE = 60  # lines of a stage that are drawn wide, at most
_ROOM = 0.34  # share of the height of a spectrum for the names
_WEIGHTED_COLOUR = "#595959"
"""Of levels in dB(A): a grey whose words can be read on white."""
_STAGE_COLOURS = tuple(colour for colour in COLOURS if colour != BLACK)


def _loudest(data: xr.Dataset, speed: float | None = None) -> tuple[list[int], str]:
    """Numbers of the sensors that are drawn, the loudest at a speed [rpm] first, and words where some are left out."""
    levels = data["level"].values
    near = speed is not None and np.ptp(data["speed"].values) > 0.0
    level = levels[np.abs(data["speed"].values - speed).argmin()] if near else levels.max(axis=0)
    chosen = np.argsort(-level, kind="stable")[:SENSORS_DRAWN].tolist()
    return chosen, "" if len(chosen) == len(level) else f"the loudest {len(chosen)} of {len(level)} sensors"


def _stage_style(number: int) -> dict[str, str]:
    """Colour and dash of a stage."""
    count = len(_STAGE_COLOURS)
    return {"color": _STAGE_COLOURS[number % count], "linestyle": DASHES[number // count % len(DASHES)]}


def _log_axis(ax, level: np.ndarray, parts: np.ndarray) -> None:
    """Let the ordinate be logarithmic, over what is drawn, but no more than `_DECADES` decades.

    Below one decade, which may have one tick alone, it begins at zero.
    """
    largest, drawn = float(level.max(initial=0.0)), np.concatenate([level, parts.ravel()])
    if largest > 0.0 and drawn.min() > 0.1 * largest:
        ax.set_ylim(0.0, 1.1 * largest)
    elif largest > 0.0:
        ax.set_yscale("log")
        ax.set_ylim(max(0.7 * drawn[drawn > 0.0].min(), 10.0**-_DECADES * largest), 1.5 * largest)


def _plain_ticks(ax) -> None:
    """Write the numbers of a logarithmic ordinate without powers, also 2 and 5 where it has less than two decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if ax.get_yscale() != "log":
        return
    low, high = ax.get_ylim()
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    ax.yaxis.set_major_formatter(plain)
    few = high < 100.0 * low
    if few:
        ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    ax.yaxis.set_minor_formatter(plain if few else NullFormatter())


def _mark_operation(ax, data: xr.Dataset, operation: float | None) -> None:
    """Mark the speed of the load case, where the run-up passes it."""
    speed = data["speed"].values
    end_with_speeds(ax, speed)
    if operation is not None and speed[0] <= operation <= speed[-1]:
        ax.axvline(operation, color=BLACK, linewidth=1.2, linestyle=":", label="speed of the load case")


def draw_run_up_levels(
    runup: xr.Dataset, operation: float | None = None, limits: Mapping[str, np.ndarray] | None = None
) -> Figure:
    """Draw the level at every sensor over the speed, and the part of every stage in it, of runup.nc.

    Parameters
    ----------
    runup : Dataset
        With the levels of sensors.
    operation : float, optional
        Speed of the load case [rpm].
    limits : mapping of str to (speeds,) array, optional
        Largest levels allowed at sensors [m/s^2].
    """
    chosen, words = _loudest(runup, operation)
    speed, level, parts = (runup[name].values for name in ("speed", "level", "level_of_stage"))
    figure, axes = new_figure(rows=len(chosen), height=0.9 + 2.7 * len(chosen), sharex=True)
    several = runup.sizes["stage"] > 1
    for ax, sensor in zip(axes, chosen, strict=True):
        ax.plot(speed, level[:, sensor], color=BLACK, linewidth=2.2, label="all stages" if several else "level")
        for number, stage in enumerate(runup["stage"].values if several else ()):
            ax.plot(speed, parts[:, sensor, number], linewidth=1.4, label=str(stage), **_stage_style(number))
        _log_axis(ax, level[:, sensor], parts[:, sensor])
        limit = (limits or {}).get(str(runup["sensor"].values[sensor]))
        if limit is not None:
            ax.plot(speed, limit, color=BLACK, linewidth=1.6, linestyle="--", label="limit")
            low, high = ax.get_ylim()
            ax.set_ylim(min(low, 0.7 * limit.min()), max(high, 1.5 * limit.max()))
        _plain_ticks(ax)
        _mark_operation(ax, runup, operation)
        if "weighted_level" in runup:
            weighted, words_at_right = runup["weighted_level"].values[:, sensor], "A-weighted\n[dB(A) re 1 µm/s²]"
            draw_at_right(ax, speed, words_at_right, weighted, colour=_WEIGHTED_COLOUR, dash="--")
        label(ax, y="level, r.m.s. [m/s²]", title=f"sensor {runup['sensor'].values[sensor]}")
    label(axes[-1], f"speed of {runup.attrs['reference']} [rpm]")
    if words:
        figure.suptitle(words, fontsize=SMALL)
    legend_below(figure)
    return figure


def draw_run_up_forces(runup: xr.Dataset, operation: float | None = None) -> Figure:
    """Draw the largest mesh force over its mean of every stage over the speed, of runup.nc.

    Arguments as of `draw_run_up_levels`.
    """
    figure, (ax,) = new_figure(height=4.6)
    for number, stage in enumerate(runup["stage"].values):
        curves = runup["dynamic_factor"].values[:, number].T
        shown = [kind for kind, curve in enumerate(curves) if np.isfinite(curve).all()]
        for kind in shown:
            name = f"{stage}, {runup['kind'].values[kind]}" if len(shown) > 1 else str(stage)
            style = {"color": _STAGE_COLOURS[number % len(_STAGE_COLOURS)], "linestyle": DASHES[kind]}
            ax.plot(runup["speed"].values, curves[kind], linewidth=1.7, label=name, **style)
    ax.set_ylim(1.0, ax.get_ylim()[1] + 0.05 * max(ax.get_ylim()[1] - 1.0, 0.0))
    _mark_operation(ax, runup, operation)
    label(ax, f"speed of {runup.attrs['reference']} [rpm]", "largest mesh force over its mean [1]")
    legend_below(figure, ax)
    return figure


def draw_sensor_spectra(dynamics: xr.Dataset) -> Figure:
    """Draw the lines at every sensor over the frequency, coloured by stage, of dynamics.nc at its loudest speed."""
    data = dynamics.isel(speed=int(dynamics["level"].values.max(axis=1).argmax()))
    chosen, words = _loudest(dynamics)
    frequency = 1e-3 / 60.0 * data["order"].values * float(data["speed"])
    amplitude = np.hypot(data["lines_real"].values, data["lines_imag"].values)
    figure, axes = new_figure(rows=len(chosen), height=0.9 + 3.3 * len(chosen), sharex=True)
    for ax, sensor in zip(axes, chosen, strict=True):
        size, largest = amplitude[sensor], float(amplitude[sensor].max(initial=0.0)) or 1.0
        floor = 10.0**-_DECADES * largest
        top = floor * 10.0 ** (_DECADES / (1.0 - _ROOM))
        ax.set_yscale("log")
        ax.set_ylim(floor, top)
        ax.minorticks_off()
        for number, stage in enumerate(data["stage"].values):
            lines = data["origin"].values == stage
            count = int(np.count_nonzero(size[lines] > floor))
            look = {"colour": _STAGE_COLOURS[number % len(_STAGE_COLOURS)], "width": 1.8 if count <= _WIDE else 0.8}
            stems(ax, frequency[lines], size[lines], floor, text=str(stage), **look)
            # in front of stages of more lines
            ax.lines[-1].set_zorder(2.0 + 1.0 / (1.0 + count))
        ax.set_xlim(0.0, 1.02 * float(frequency.max(initial=1.0)))
        _name_lines(ax, data, frequency, size, (floor, top))
        label(ax, y="amplitude [m/s²]", title=f"sensor {data['sensor'].values[sensor]}, {rpm(float(data['speed']))}")
    label(axes[-1], "frequency [kHz]")
    if words:
        figure.suptitle(words, fontsize=SMALL)
    legend_below(figure, axes[0])
    return figure


def short_origin(data: xr.Dataset, line: int) -> str:
    """Write where a line comes from, in short: stage, mesh harmonic, turns of the carrier beside it."""
    band = int(data["side_band"].values[line])
    beside = f" {band:+d}".replace("-", "−") if band else ""
    return f"{data['origin'].values[line]}, {data['harmonic'].values[line]:.4g}{beside}"


def _name_lines(ax, data: xr.Dataset, frequency: np.ndarray, size: np.ndarray, ends: tuple[float, float]) -> None:
    """Name the largest lines in rows above them: the farther to the right, the lower, so that none crosses another."""
    floor, top = ends
    largest = [i for i in np.argsort(-size, kind="stable")[:LINES_NAMED].tolist() if size[i] > floor]
    row = {line: number for number, line in enumerate(sorted(largest, key=lambda i: frequency[i]))}
    # the largest first: a chart without room for all names keeps the first ones
    for line in largest:
        height = floor * (top / floor) ** (1.0 - _ROOM * (row[line] + 0.5) / LINES_NAMED)
        x = frequency[line]
        # pale dots, which nobody takes for a part of the line
        ax.plot([x, x], [size[line], height], ":", color="0.65", linewidth=0.7, label="_")
        place = {"xytext": (3, 0), "textcoords": "offset points", "ha": "left", "va": "center"}
        ax.annotate(short_origin(data, line), (x, height), fontsize=SMALL, annotation_clip=False, **place)


def _operation(drawn: Drawn) -> float | None:
    """Speed of the load case [rpm], where its response was computed."""
    return float(drawn.data["dynamics"]["speed"].values[0]) if "dynamics" in drawn.data else None


def _draw_runup(drawn: Drawn) -> dict[str, Figure]:
    runup, operation = drawn.data["runup"], _operation(drawn)
    speeds = runup["speed"].values
    limits = {sensor.name: limit_at(sensor.level_limit, speeds) for sensor in drawn.case.sensor if sensor.level_limit}
    levels = {"run_up_levels": draw_run_up_levels(runup, operation, limits)} if "level" in runup else {}
    by_stage = draw_stage_forces(runup)
    forces = {"run_up_forces": draw_run_up_forces(runup, operation)}
    return levels | forces | ({} if by_stage is None else {"stage_forces": by_stage})


def draw_flank_forces(balance: xr.Dataset) -> Figure:
    """Draw the forces of drive flanks, and of back flanks below zero, over the period of the excitation, of balance.nc.

    The first mesh of every stage is drawn in full colour, the others of its kind pale.
    """
    stages, names = balance["stage"].values.tolist(), balance["mesh"].values.tolist()
    owner, instant = balance["stage_of_mesh"].values.tolist(), balance["instant"].values
    figure, axes = new_figure(rows=len(stages), height=0.9 + 2.7 * len(stages), sharex=True)
    for ax, stage in zip(axes, stages, strict=True):
        of_stage = [i for i, name in enumerate(owner) if name == stage]
        leaders = of_stage[:: max(len(of_stage) // 2, 1)]
        for mesh in of_stage:
            number = sum(mesh >= leader for leader in leaders) - 1
            style = _stage_style(number) | {"linewidth": 2.0 if mesh in leaders else 0.9}
            style |= {"alpha": 1.0 if mesh in leaders else 0.35}
            name = names[mesh] if mesh in leaders else None
            ax.plot(instant, balance["drive_force"].values[mesh], label=name, **style)
            if balance["largest_back_force"].values[mesh] > 0.0:
                ax.plot(instant, -balance["back_force"].values[mesh], **style)
        ax.axhline(0.0, color=GREY, linewidth=0.8)
        label(ax, y="force of the flanks [N]", title=stage)
        ax.legend(fontsize=SMALL, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
    label(axes[-1], "share of the period of the excitation")
    return figure


RESPONSE_FIGURES = {
    "dynamics": Figures(
        {
            "sensor_spectra": "Acceleration at the sensors, line by line, coloured by the stage that makes it. The "
            "largest lines have the mesh harmonic and, with their sign, the turns of the carrier beside it: 2 +1 is "
            "the second harmonic and one turn more.",
        },
        lambda drawn: (
            {"sensor_spectra": draw_sensor_spectra(drawn.data["dynamics"])} if "level" in drawn.data["dynamics"] else {}
        ),
    ),
    "runup": Figures(
        {
            "run_up_levels": (
                "Level at the sensors over the speed, and the part that each stage makes of it. Grey, at the right: "
                "the level with lines weighted as the ear does."
            ),
            "run_up_forces": "Largest mesh force over its mean over the speed, by stage; of planetary stages with "
            "the sun and with the ring.",
            "stage_forces": "Dynamic force of the first mesh of every stage over the speed, by the stage that excites.",
        },
        _draw_runup,
    ),
    "balance": Figures(
        {
            "flank_forces": "Forces of the drive flanks over the period of the excitation, those of the back flanks "
            "below zero; the first mesh of every kind strong, those of the other planets pale.",
        },
        lambda drawn: {"flank_forces": draw_flank_forces(drawn.data["balance"])},
    ),
}
