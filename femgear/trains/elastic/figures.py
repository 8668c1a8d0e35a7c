"""Figures of a case with an elastic ring: modes.nc, dynamics.nc and housing.nc.

By stage:

- modes.nc: natural frequencies by kind and nodal diameter, and modes of the ring as fields and pictures;
- dynamics.nc: dynamic transmission error and mean deflection of the ring, its motion as an animation;
- housing.nc: what a sensor fixed to the housing hears during one carrier revolution, its orders and
  modulation;
- runup.nc: levels, mesh forces, lines and excited resonances over the speed.

`FIGURES` at the end ties the pictures of the report to their captions.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import material_of, planetary_set
from femgear.case.level_limits import limit_at
from femgear.contact.bodies import active_flank_load
from femgear.fe.elasticity import mass
from femgear.fe.reduction import cyclic_modes, sector_basis
from femgear.housing.orders import OrderSpectrum, analyse_band
from femgear.housing.sensor import SensorLines, fixed_sensor_signal, stored_lines
from femgear.housing.sound import REFERENCE_PRESSURE, acceleration_level, nodal_diameters, pressure_level, stored_sound
from femgear.report.explorer import EXPLORER, explorer
from femgear.report.response import (
    MODE_CAPTIONS,
    RESPONSE_CAPTIONS,
    frequency_groups,
    mesh_force_period,
    mode_shapes,
    response_figures,
    shown_speeds,
    stored_harmonics,
    transmission_error_period,
)
from femgear.report.scene import deformed_picture, ring_modes_grid, write_vtu
from femgear.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    SIZE,
    SKY,
    SMALL,
    VERMILION,
    WIDTH,
    Drawings,
    excited_to,
    label,
    legend_below,
    mark_mesh_harmonics,
    new_figure,
    rpm,
    stems,
    thinned,
)
from femgear.report.waterfall import KIND_COLOURS, RUNUP_CAPTIONS, runup_figures
from femgear.stages.assumptions import ASSUMPTION_FIGURES
from femgear.stages.protocol import Drawn, Figures
from femgear.stages.static import ring_foundation
from femgear.stages.static_figures import FIGURES as STATIC
from femgear.stages.static_figures import picture_sectors
from femgear.storage.files import write_text
from femgear.trains.elastic.checks import housing_supports
from femgear.trains.elastic.results import hanning_spectrum, measured_at, run_up_lines

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.case.sections import MeasuredSection
    from femgear.gears.planetary import PlanetarySet
    from femgear.housing.two_way.structure import Support

_BADGE = {"boxstyle": "circle", "facecolor": "white", "edgecolor": VERMILION}

_MARKS = {"rotational": "o", "translational": "s", "planet": "^"}
# modes whose numbers are written
_NUMBERED = 24
# steps of an envelope over a turn, at most
_ANGLES = 1440
_QUANTITIES = (("acceleration", "m/s²", 1.0), ("velocity", "mm/s", 1e3), ("displacement", "µm", 1e6))
# share of the height below the strongest line that the label above it takes
_ROOM = 0.36
# numbers along an axis, at most
_TICKS = 20
# between ticks, times powers of ten
_STEPS = [1, 2, 2.5, 5, 10]
# lines of a band that are labelled, at most
_LABELS = 12
_LINEAR, _EXACT = "Heaviside, linear interpolation", "exact circumferential Fourier"
_ACCELERATION = "amplitude [m/s²]"
_ACCELEROMETER, _MICROPHONE = "accelerometer", "microphone"
# lowest level of a line of a band that is shown [dB]
_BAND_FLOOR = -50.0


def natural_frequencies(modes: xr.Dataset) -> Figure:
    """Draw the natural frequencies of modes.nc over the nodal diameters of the ring, by kind of mode.

    One mark for a pair of equal frequency; rigid-body motions are left out. Numbers are those of the modes
    that stand alone. Above the end of the excitation modes only yield.
    """
    figure, (ax,) = new_figure(height=5.2)
    hertz, names = modes["frequency"].values, [str(kind) for kind in modes["kind"].values]
    groups = [group for group in frequency_groups(hertz) if hertz[group[0]] > 0.0]
    first = np.array([group[0] for group in groups], int)
    frequency, diameter = hertz[first] * 1e-3, modes["nodal_diameter"].values[first]
    for kind in dict.fromkeys(names[mode] for mode in first):
        rows = [i for i, mode in enumerate(first) if names[mode] == kind]
        member = kind.removeprefix("ring, ")
        # as in the Campbell diagram; filled where the bodies move, open where the ring does
        ax.plot(
            diameter[rows],
            frequency[rows],
            _MARKS.get(member, "D"),
            color=KIND_COLOURS.get(member, GREY),
            markersize=6,
            markerfacecolor="none" if member != kind else None,
            markeredgewidth=1.5,
            label=f"{kind} ({sum(len(groups[i]) for i in rows)})",
        )
    ax.set_yscale("log")
    ax.set_ylim(0.6 * frequency.min(initial=1.0), 1.7 * frequency.max(initial=1.0))
    ax.yaxis.set_major_formatter("{x:g}")
    _number_modes(ax, diameter, frequency, groups)
    ticks = np.unique(diameter)
    ticks = ticks if len(ticks) <= 25 else ticks[(ticks < 0) | (ticks % 5 == 0)]
    ax.set_xticks(ticks, ["–" if n < 0 else str(n) for n in ticks])
    title, reach = f"{sum(map(len, groups))} modes up to {frequency.max(initial=0.0):.4g} kHz", modes.attrs
    if "excitation_reach" in reach:
        end = 1e-3 * float(reach["excitation_reach"])
        ax.axhspan(end, ax.get_ylim()[1], color="0.5", alpha=0.12, linewidth=0, zorder=0)
        below = sum(len(group) for group, mode_frequency in zip(groups, frequency) if mode_frequency < end)
        title += f", {below} of them below the end of the excitation at {end:.4g} kHz (grey: above)"
    label(ax, "nodal diameters of the ring [1] (–: ring at rest)", "natural frequency [kHz]", title)
    legend_below(figure, columns=4)
    return figure


def _number_modes(ax, diameter, frequency, groups) -> None:
    """Write the numbers of the modes beside their marks, from the lowest, where they cover no other one."""
    placed = list[tuple[int, float]]()
    for n, value, group in zip(diameter, frequency, groups):
        if all(n != other or value > 1.4 * height for other, height in placed):
            placed.append((int(n), float(value)))
            style = {"xytext": (5, 0), "textcoords": "offset points", "va": "center", "fontsize": SMALL}
            if group[0] < _NUMBERED:
                ax.annotate(str(group[0] + 1), (n, value), **style)


def ring_mean_deflection(dynamics: xr.Dataset, planetary_set: PlanetarySet) -> Figure:
    """Draw the mean radial deflection of the ring (dynamics.nc) over the angle in the carrier frame.

    That of the outer surface at the last speed, with the angles of the planets marked.
    """
    figure, (ax,) = new_figure(width=6.4, height=6.6, polar=True)
    angle = np.linspace(0.0, 2 * np.pi, 721)
    zero = int(np.flatnonzero(dynamics["harmonic"].values == 0)[0])
    component = stored_harmonics(dynamics, "ring")[zero]
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
    speed = rpm(dynamics["speed"].values[-1])
    ax.set_title(f"mean radial deflection [µm] over the angle in the carrier frame, {speed}", fontsize=SIZE)
    legend_below(figure)
    return figure


def _free_angle(angles) -> float:
    """An angle [deg] in the middle of the widest gap between the planets."""
    sorted_angles = np.sort(np.asarray(angles, float) % (2 * np.pi))
    gaps = np.diff(np.append(sorted_angles, sorted_angles[0] + 2 * np.pi))
    widest = int(np.argmax(gaps))
    return float(np.degrees(sorted_angles[widest] + gaps[widest] / 2))


def _ring_teeth(housing: xr.Dataset) -> int:
    return int(housing.attrs["ring_teeth"])


def _spectrum(housing: xr.Dataset, form: str | None = None) -> OrderSpectrum:
    """Lines of the acceleration at the first speed."""
    lines = stored_lines(housing.isel(speed=0), form=form)
    return OrderSpectrum(lines.order, lines.acceleration, lines.turns)


def _strongest_bands(housing: xr.Dataset) -> list[int]:
    """The two mesh harmonics whose bands hold the strongest lines at the first speed, ascending."""
    spectrum = _spectrum(housing)
    harmonics = np.rint(spectrum.order / _ring_teeth(housing)).astype(int)
    peaks = {int(h): spectrum.amplitude[harmonics == h].max() for h in np.unique(harmonics) if h > 0}
    ranked = sorted((h for h in peaks if peaks[h] > 0), key=lambda h: (-peaks[h], h))
    return sorted(ranked[:2])


def housing_signal(housing: xr.Dataset) -> Figure:
    """Draw acceleration, velocity and displacement of the sensor of housing.nc at its first speed.

    Over one carrier revolution, or as many as there are until all repeats, and over four mesh periods about
    the largest acceleration.
    """
    lines = stored_lines(housing.isel(speed=0))
    signal, teeth = fixed_sensor_signal(lines), lines.z_ring * lines.turns
    figure, axes = new_figure(rows=3, columns=2, height=6.2, sharex="col")
    period = len(signal.revolution) // teeth
    turn = lines.turns * np.arange(teeth * period + 1) / (teeth * period)
    middle = int(np.abs(signal.acceleration).argmax())
    shown = (middle + np.arange(-2 * period, 2 * period + 1)) % len(signal.revolution)
    time = 1e3 * float(signal.seconds[1]) * np.arange(len(shown))
    for (left, right), (name, unit, factor) in zip(zip(axes[::2], axes[1::2]), _QUANTITIES):
        values = factor * getattr(signal, name)
        left.plot(*thinned(turn, np.append(values, values[0])), color=BLUE, linewidth=1.0, label="_")
        right.plot(time, values[shown], color=BLUE, linewidth=1.1, label="_")
        around = values - values.mean()
        size = f"{np.sqrt(np.mean(around**2)):.4g} {unit} r.m.s., {np.ptp(values):.4g} peak to peak"
        label(left, y=f"{name} [{unit}]", title=size)
        left.set_xlim(0.0, lines.turns)
        right.set_xlim(0.0, time[-1])
        right.sharey(left)
    label(axes[-2], "carrier revolutions [1]")
    label(axes[-1], "time, four mesh periods [ms]")
    figure.suptitle(f"Fixed sensor, {rpm(housing['speed'].values[0])}{excited_to(housing, 0)}", fontsize=12)
    return figure


def draw_order_spectrum(housing: xr.Dataset, measured: Sequence[MeasuredSection] = ()) -> Figure:
    """Draw the order spectrum of housing.nc at its first speed, mesh harmonics marked, measured lines over it.

    Below are the strongest bands with their lines labelled: one of harmonic ``h`` and nodal diameter ``n``
    stands at order ``h z_ring - n``.
    """
    spectrum, only, ring_teeth = _spectrum(housing), _spectrum(housing, "exact"), _ring_teeth(housing)
    order, linear, exact = spectrum.order, spectrum.amplitude, np.zeros(len(spectrum.order))
    exact[np.searchsorted(order, only.order)] = only.amplitude
    bands = _strongest_bands(housing)
    marks = np.array([pair for entry in measured for pair in zip(entry.orders, entry.accelerations)]).reshape(-1, 2)
    figure, axes = new_figure(rows=1 + len(bands), height=2.6 + 2.7 * len(bands))
    largest = max(linear.max(initial=0.0), exact.max(initial=0.0)) or 1.0
    floor = 1e-4 * largest
    # what stands for the ring between its points is said where it is not the ring itself
    form = _EXACT if housing.attrs["form"] == "exact" else _LINEAR
    hertz = 1e-3 * abs(float(housing["carrier_speed"][0])) / (2.0 * np.pi)
    stems(axes[0], hertz * order, linear, floor, text=form)
    axes[0].set_yscale("log")
    # the record may reach further than the excitation at this speed
    end = order[np.maximum(linear, exact) > floor].max(initial=ring_teeth)
    axes[0].set_xlim(0, hertz * (end + 0.5 * ring_teeth))
    axes[0].set_ylim(floor, 2.5 * largest)
    axes[0].minorticks_off()
    mark_mesh_harmonics(axes[0], hertz * ring_teeth)
    label(axes[0], "frequency [kHz]")
    for ax, harmonic in zip(axes[1:], bands):
        _draw_band(ax, order, linear, exact, ring_teeth, harmonic, form, marks)
    for ax, per_order in zip(axes, [hertz, *(1.0 for _ in bands)]):
        label(ax, y=_ACCELERATION)
        _draw_measured(ax, measured, per_order)
    speed = rpm(housing["speed"].values[0])
    level = np.sqrt(0.5 * (linear[order > 0] ** 2).sum())
    title = f"Order spectrum of the fixed sensor, {speed}: {level:.4g} m/s² r.m.s.{excited_to(housing, 0)}"
    figure.suptitle(title, fontsize=12)
    if form != _EXACT or measured:
        legend_below(figure)
    return figure


def _draw_measured(ax, measured: Sequence[MeasuredSection], per_order: float) -> None:
    """Draw measured lines as open marks where they lie in the panel, whose axis grows so much for every order."""
    (low, high), (floor, top) = ax.get_xlim(), ax.get_ylim()
    for entry, mark in zip(measured, itertools.cycle("sD^v")):
        x, height = per_order * np.array(entry.orders), np.array(entry.accelerations)
        inside = (x >= low) & (x <= high) & (height >= floor)
        top = max(top, 2.0 * height[inside].max(initial=0.0))
        style = {"markerfacecolor": "none", "color": BLACK, "markersize": 5}
        ax.plot(x[inside], height[inside], mark, label=f"measured: {entry.source}", **style)
    ax.set_ylim(floor, top)


def _draw_band(ax, order, linear, exact, ring_teeth, harmonic, form, marks):
    """Draw the lines around a mesh harmonic, the strongest with their order and the distance from it.

    These labels stand above ``marks`` (m, 2), orders and heights of measured lines, in their column.
    """
    centre = harmonic * ring_teeth
    in_band = np.rint(order / ring_teeth) == harmonic
    largest = max(linear[in_band].max(initial=0.0), exact[in_band].max(initial=0.0)) or 1.0
    floor = 1e-3 * largest
    # the images that the interpolation makes far from the centre are left to the upper diagram
    reach = int(np.abs(order[in_band & (exact > floor)] - centre).max(initial=4.0)) + 2
    inside = np.abs(order - centre) <= reach
    stems(ax, order[inside], linear[inside], floor, text=form, width=2.5)
    ax.set_yscale("log")
    if form != _EXACT:
        shown = inside & (exact > floor)
        ax.plot(order[shown], exact[shown], "o", markerfacecolor="none", color=VERMILION, label=_EXACT)
    peak = np.maximum(linear, exact)
    spacing = 0.025 * len(str(centre)) * reach
    marks = marks[np.abs(marks[:, 0] - centre) <= reach]
    for k in _labelled(order, peak, inside & (peak > floor), spacing=spacing):
        beside = order[k] - centre
        text = f"{order[k]:.6g}" + (f"\n{'+' if beside > 0 else '−'}{abs(beside):.4g}" if beside else "")
        style = {"xytext": (0, 4), "textcoords": "offset points", "ha": "center", "va": "bottom"}
        top = marks[np.abs(marks[:, 0] - order[k]) <= 0.5 * spacing, 1].max(initial=peak[k])
        ax.annotate(text, (order[k], top), fontsize=SMALL, linespacing=1.0, **style)
    # room above the strongest line for its label on the logarithmic axis
    top = marks[:, 1].max(initial=largest)
    ax.set_ylim(floor, top * (top / floor) ** _ROOM)
    ax.minorticks_off()
    ax.set_xlim(centre - reach, centre + reach)
    strongest = int(np.argmax(np.where(in_band, peak, -1.0)))
    title = f"mesh harmonic {harmonic} (order {harmonic}·{ring_teeth} = {centre})"
    title += f": largest line {order[strongest]:.6g} with {peak[strongest]:.3g} m/s²"
    label(ax, "carrier order [1]", title=title)


def _labelled(order, amplitude, candidates, *, spacing):
    """Strongest lines whose labels do not run into each other."""
    chosen = []
    for k in np.flatnonzero(candidates)[np.argsort(-amplitude[candidates], kind="stable")]:
        if all(abs(order[k] - order[other]) >= spacing for other in chosen):
            chosen.append(k)
    return chosen[:_LABELS]


def modulation_polar(
    housing: xr.Dataset,
    planet_angles=(),
    *,
    windowed: OrderSpectrum | None = None,
    supports: Sequence[Support] = (),
) -> Figure:
    """Draw envelopes of the acceleration of housing.nc over the sensor's angle to the carrier.

    At the first speed, around the two mesh harmonics with the strongest lines, as if the carrier, drawn with
    its planets (N,) [rad], stood still and the sensor went round it. Beside them those of the Hanning-window
    model, ``windowed``, to the same largest value: every planet is heard while it passes the sensor
    (M. Inalpolat and A. Kahraman, J. Sound Vib. 323, 2009, 677-696). Supports of the ring go round with the
    sensor and are drawn where they stand at the start.
    """
    from matplotlib.ticker import MaxNLocator
    from scipy.ndimage import uniform_filter1d

    harmonics, spectrum = _strongest_bands(housing) or [1], _spectrum(housing)
    figure, axes = new_figure(columns=len(harmonics), width=0.5 * WIDTH * len(harmonics), height=4.9, polar=True)
    start, turn = float(housing.attrs["sensor_angle"]), np.sign(float(housing["carrier_speed"][0]))
    for ax, harmonic in zip(axes, harmonics):
        band = analyse_band(spectrum, _ring_teeth(housing), harmonic)
        lobes, (angle, value) = band.lobes, _around_carrier(band.envelope, start, turn, spectrum.turns)
        largest = value.max(initial=0.0) or 1.0
        ax.plot(angle, value, color=BLUE, linewidth=2.0, label="envelope")
        # the scale stands where the curve is lowest, so that it hides nothing
        lowest = angle[np.argmin(uniform_filter1d(value, max(len(value) // 15, 1), mode="wrap"))]
        # a polygon would search the extremes of every one of its sides
        ax.fill_between(angle, 0.0, value, color=BLUE, alpha=0.15, linewidth=0)
        if windowed is not None and windowed.order[-1] >= (harmonic - 0.5) * _ring_teeth(housing):
            model = analyse_band(windowed, _ring_teeth(housing), harmonic).envelope
            angle, model = _around_carrier(model, start, turn, windowed.turns)
            size = model * (largest / (model.max(initial=0.0) or 1.0))
            ax.plot(angle, size, "--", color=BLACK, linewidth=1.1, label="Hanning-window model, scaled")
        for n, psi in enumerate(np.asarray(planet_angles, float)):
            ax.plot([psi, psi], [0.0, 1.12 * largest], color=VERMILION, linewidth=1.2, label="carrier arms")
            ax.text(psi, 1.12 * largest, str(n + 1), bbox=_BADGE, ha="center", va="center", fontsize=SMALL)
        for support in supports:
            half = max(0.5 * support.width, 0.02)
            arc, edge = np.linspace(support.angle - half, support.angle + half, 9), [1.36 * largest] * 9
            ax.plot(
                arc, edge, color=BLACK, linewidth=7, solid_capstyle="butt", label="supports at the start", clip_on=False
            )
        ax.plot([start], [1.28 * largest], "^", color=GREEN, markersize=9, label="sensor at the start")
        ax.set_ylim(0, 1.36 * largest)
        ax.set_yticks([tick for tick in MaxNLocator(3, steps=_STEPS).tick_values(0.0, largest) if 0 < tick <= largest])
        ax.set_rlabel_position(float(np.degrees(lowest)))
        speed = rpm(housing["speed"].values[0])
        text = f"{speed}, mesh harmonic {harmonic}: {len(lobes.position)} lobes up to {largest:.3g} m/s²"
        if (turns := spectrum.turns) > 1:
            count = f"{len(lobes.position) / turns:.4g} lobes/turn"
            text = f"{speed}, harmonic {harmonic}: {count} up to {largest:.3g} m/s²"
        ax.set_title(f"{text}\nenvelope [m/s²] over angle in the carrier frame", fontsize=SMALL, pad=12)
    legend_below(figure, columns=3 if supports else 4)
    return figure


def _around_carrier(envelope, start: float, turn: float, turns: int):
    """Angles of the sensor in the carrier frame [rad], ascending, and the envelope (n,) there, closed.

    The carrier turns in the sense ``turn`` (+-1) past the sensor, which stands at ``start`` [rad]; the
    envelope spans so many ``turns``.
    """
    count = len(envelope)
    place = np.linspace(0, count, min(count, _ANGLES * turns) + 1).astype(int)[:: -1 if turn > 0 else 1]
    return start - turn * 2.0 * np.pi * turns * place / count, envelope[place % count]


def microphone_spectrum(housing: xr.Dataset) -> Figure:
    """Draw the lines of the microphone of housing.nc over the frequency at its first speed.

    Below are the two mesh harmonics with the strongest lines: what the air filters is the difference between
    the levels of an order at accelerometer and microphone, each relative to the strongest line of the band
    at its sensor.
    """
    lines, pressure = stored_sound(housing.isel(speed=0))
    acceleration, pressure = np.abs(lines.acceleration), np.abs(pressure)
    bands = _strongest_bands(housing)
    figure, axes = new_figure(rows=1 + len(bands), height=2.8 + 2.4 * len(bands))
    level = 20 * np.log10(np.maximum(pressure, 1e-30) / (np.sqrt(2) * REFERENCE_PRESSURE))
    root = min(0.0, level.max() - 40.0)  # the threshold of hearing
    frequency = lines.frequency * 1e-3
    stems(axes[0], frequency, level, root, text="_", colour=VERMILION)
    axes[0].set_ylim(root, 1.08 * max(level.max(), root + 40.0))
    axes[0].set_xlim(0.0, 1.02 * frequency[level > root].max(initial=frequency[-1] * 1e-3))
    mark_mesh_harmonics(axes[0], 1e-3 * lines.z_ring * float(lines.base_speed) / (2.0 * np.pi))
    total, place = float(housing["pressure_level"][0]), housing.attrs["microphone_distance"]
    label(axes[0], "frequency [kHz]", "sound pressure level\n[dB re 20 µPa]")
    for ax, harmonic in zip(axes[1:], bands):
        _draw_sensors(ax, lines, {_ACCELEROMETER: acceleration, _MICROPHONE: pressure}, harmonic)
    speed, excited = rpm(housing["speed"].values[0]), excited_to(housing, 0)
    how = ", equivalent radiated power" if housing.attrs["method"] == "casing" else ""
    figure.suptitle(f"Microphone at {place:g} m{how}, {speed}: {total:.1f} dB(A){excited}", fontsize=12)
    legend_below(figure)
    return figure


def _draw_sensors(ax, lines: SensorLines, amplitudes: Mapping[str, np.ndarray], harmonic: int) -> None:
    """Levels of the lines of a band at both sensors, each relative to its strongest, with nodal diameters."""
    from matplotlib.ticker import MaxNLocator

    in_band = np.rint(lines.order / lines.z_ring) == harmonic
    order, highest = lines.order[in_band], np.full(in_band.sum(), -np.inf)
    n = np.abs(nodal_diameters(lines)[in_band]) if (exact := lines.method == "exact") else [""] * len(order)
    for (text, amplitude), colour, side in zip(amplitudes.items(), (BLUE, VERMILION), (-0.2, 0.2)):
        relative = amplitude[in_band] / (amplitude[in_band].max(initial=0.0) or 1.0)
        level = 20 * np.log10(np.maximum(relative, 1e-30))
        shown = level > _BAND_FLOOR
        ax.vlines(order[shown] + side, _BAND_FLOOR, level[shown], color=colour, linewidth=3.0, label=text)
        highest = np.maximum(highest, level)
    shown = highest > _BAND_FLOOR
    for k in np.flatnonzero(shown):
        ax.text(order[k], highest[k] + 1.0, str(n[k]), ha="center", fontsize=SMALL)
    reach = np.abs(order[shown] - harmonic * lines.z_ring).max(initial=4) + 2
    ax.set_xlim(harmonic * lines.z_ring - reach, harmonic * lines.z_ring + reach)
    ax.xaxis.set_major_locator(MaxNLocator(_TICKS, steps=_STEPS, integer=True))
    ax.set_ylim(_BAND_FLOOR, 10)
    title = f"mesh harmonic {harmonic} (order {harmonic * lines.z_ring})"
    title += "; numbers: nodal diameters" if exact else ""
    label(ax, "carrier order [1]", "level [dB re\nlargest line]", title)


def _modes_figures(drawn: Drawn) -> Drawings:
    modes = drawn.data["modes"]
    return Drawings(
        {
            "mode_shapes": lambda: mode_shapes(modes, planetary_set(drawn.case)),
            "natural_frequencies": lambda: natural_frequencies(modes),
        }
    )


def _write_ring_modes(drawn: Drawn, folder: Path) -> list[str]:
    """Modes of the toothed ring on its foundation for 0 to 6 nodal diameters, as VTU and picture."""
    static, case = drawn.results.get("static"), drawn.case
    if static is None:
        return []
    gears, material = static.planetary_set, material_of(case, "ring")
    sector = picture_sectors(drawn, gears).ring
    load = active_flank_load(sector.grid, gears, 1.0)
    basis = sector_basis(
        sector.grid,
        sector.stiffness + ring_foundation(case, sector),
        mass(sector.grid, material, gears.ring.face_width),
        count=gears.ring.teeth,
        loads=load,
    )
    modes = cyclic_modes(
        basis, nodal_diameters=range(7), loads=load, outputs=load, max_frequency=0.0, static_correction=False
    )
    grid = ring_modes_grid(sector.grid, modes, range(len(modes.frequency)))
    write_vtu(grid, folder / "ring_modes.vtu")
    shown = int(np.flatnonzero(modes.nodal_diameter == 3)[0])
    field = next(name for name in grid.point_data if name.startswith(f"mode {shown},"))
    deformed_picture(
        grid,
        folder / "ring_mode.png",
        field=field,
        title=f"ring alone on its foundation, {field.split(', ', 1)[1]}",
        colour_label="relative displacement",
        colour_factor=1.0,
    )
    return ["ring_modes.vtu", "ring_mode.png"]


def _dynamics_figures(drawn: Drawn) -> Drawings:
    dynamics, modes = drawn.data["dynamics"], drawn.data.get("modes")
    rest = None
    if modes is not None and "supported_force" in modes:
        rest = modes["supported_position"].values, modes["supported_force"].values
    return response_figures(
        dynamics,
        dynamic_transmission_error=lambda: transmission_error_period(
            dynamics, _on_supports(modes, drawn.data.get("static"))
        ),
        mesh_forces=lambda: mesh_force_period(dynamics, rest),
        ring_static_deflection=lambda: ring_mean_deflection(dynamics, planetary_set(drawn.case)),
    )


def _on_supports(modes: xr.Dataset | None, static: xr.Dataset | None) -> xr.Dataset | None:
    """Static transmission errors that the dynamics start from, else those of static.nc."""
    if modes is None or "supported_ste" not in modes:
        return static
    return modes[["supported_ste"]].rename(supported_ste="ste", supported_position="position")


def _write_explorer(drawn: Drawn, folder: Path) -> list[str]:
    """What the page walks through of the run-up."""
    content = explorer(drawn.data["runup"], drawn.data["modes"], _run_up_pressure(drawn), _level_limit(drawn))
    write_text(json.dumps(content, allow_nan=False, separators=(",", ":")), folder / EXPLORER)
    return [EXPLORER]


def _runup_figures(drawn: Drawn) -> Drawings:
    runup, pressure = drawn.data["runup"], _run_up_pressure(drawn)
    frequency = runup["order"].values * np.abs(runup["carrier_speed"].values[:, None]) / (2.0 * np.pi)
    if pressure is not None:
        weighted = "microphone\n[dB(A) re 20 µPa]", pressure_level(pressure, frequency)
    else:
        lines = runup["lines_real"].values + 1j * runup["lines_imag"].values
        weighted = "sensor, A-weighted\n[dB(A) re 1 µm/s²]", acceleration_level(lines, frequency)
    return runup_figures(runup, drawn.data["modes"], _level_limit(drawn), weighted)


def _run_up_pressure(drawn: Drawn) -> np.ndarray | None:
    """Lines of the sound pressure (speeds, orders) at the microphone [Pa]; None without one, or before its stage."""
    housing = drawn.data.get("housing")
    return None if housing is None else run_up_lines(drawn.data["runup"], housing.attrs)[1]


def _level_limit(drawn: Drawn) -> np.ndarray | None:
    """Largest level (speeds,) allowed at the sensor over the run-up [m/s^2]; None without a limit."""
    points = drawn.case.housing.level_limit
    return limit_at(points, drawn.data["runup"]["speed"].values) if points else None


def _housing_figures(drawn: Drawn) -> Drawings:
    housing, dynamics = drawn.data["housing"], drawn.data.get("dynamics")
    figures: dict[str, Callable[[], Figure]] = {}
    angles, supports = planetary_set(drawn.case).planet_angles, housing_supports(drawn.case)
    for s in shown_speeds(housing):
        measured = measured_at(drawn.case, float(housing["speed"][s]))
        at_speed, speed = housing.isel(speed=[s]), f"{round(float(housing['speed'][s]))}_rpm"
        if dynamics is not None and "level_change" in dynamics:
            at_speed = at_speed.assign(level_change=("speed", dynamics["level_change"].values[[s]]))

        def modulation(at_speed=at_speed, s=s) -> Figure:
            model = None if dynamics is None else hanning_spectrum(dynamics, housing, angles, s)
            return modulation_polar(at_speed, angles, windowed=model, supports=supports)

        figures |= {
            f"housing_signal_{speed}": partial(housing_signal, at_speed),
            f"order_spectrum_{speed}": partial(draw_order_spectrum, at_speed, measured),
            f"modulation_{speed}": modulation,
        }
        if "pressure_level" in at_speed:
            figures[f"microphone_spectrum_{speed}"] = partial(microphone_spectrum, at_speed)
    return Drawings(figures)


FIGURES = STATIC | {
    "modes": Figures(
        MODE_CAPTIONS
        | {
            "natural_frequencies": (
                "Natural frequencies over the nodal diameters of the ring, one mark for a pair of equal "
                "frequency, with the numbers of the first modes; filled where the bodies hold most of the "
                "kinetic energy, open where the ring does."
            ),
            "ring_mode": "A mode of the toothed ring on its foundation, on the finite-element grid.",
        },
        draw=_modes_figures,
        write=(_write_ring_modes,),
    ),
    "dynamics": Figures(
        RESPONSE_CAPTIONS
        | {
            "ring_static_deflection": (
                "Mean radial deflection of the ring's outer surface, which turns with the carrier."
            ),
        },
        draw=_dynamics_figures,
    ),
    "housing": Figures(
        {
            "housing_signal": (
                "Acceleration, velocity and displacement of the fixed point during one carrier revolution "
                "({}), and during four mesh periods about the largest acceleration. The displacement is "
                "mostly the static deflection that turns with the carrier, the acceleration the meshes. With "
                "errors that turn, until all repeats."
            ),
            "order_spectrum": (
                "Lines at the fixed sensor ({}): a wave of n nodal diameters at mesh harmonic h is heard at "
                "carrier order h z − n, z the teeth of the ring, when the carrier turns counter-clockwise; "
                "under the order its distance from the mesh harmonic."
            ),
            "modulation": (
                "Envelope around a mesh harmonic while the sensor goes round the carrier ({}). Where lobes "
                "stand between the planets, or are not as many as these, waves of the ring make the "
                "modulation and not the passing of the planets, which the Hanning-window model has alone."
            ),
            "microphone_spectrum": (
                "Lines of a microphone beside the ring ({}), and levels at microphone and sensor around "
                "mesh harmonics, each relative to its strongest line there: waves of many nodal diameters "
                "hardly radiate at low frequency, so that the microphone hears other side bands."
            ),
        },
        draw=_housing_figures,
    ),
    "assumptions": ASSUMPTION_FIGURES,
    "runup": Figures(
        RUNUP_CAPTIONS,
        draw=_runup_figures,
        write=(_write_explorer,),
    ),
}
