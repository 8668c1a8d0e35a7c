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

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import material_of, planetary_set
from femgear.case.quantities import RPM
from femgear.contact.bodies import active_flank_load
from femgear.fe.elasticity import mass
from femgear.fe.reduction import cyclic_modes, sector_basis
from femgear.housing.orders import BandAnalysis, OrderSpectrum, analyse_band
from femgear.housing.sensor import SensorLines, fixed_sensor_signal, stored_lines
from femgear.housing.sound import REFERENCE_PRESSURE, nodal_diameters, stored_sound
from femgear.report.explorer import EXPLORER, explorer
from femgear.report.response import (
    MODE_CAPTIONS,
    RESPONSE_CAPTIONS,
    harmonics_of,
    mode_shapes,
    response_figures,
    shown_speeds,
    transmission_error_period,
)
from femgear.report.scene import animate_operating_deflection, deformed_picture, ring_modes_grid, write_vtu
from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    MARKERS,
    ORANGE,
    SIZE,
    SKY,
    VERMILION,
    excited_to,
    label,
    legend_below,
    new_figure,
    rpm,
)
from femgear.report.waterfall import RUNUP_CAPTIONS, runup_figures
from femgear.storage.files import write_text
from femgear.trains.elastic.results import run_up_lines
from femgear.trains.protocol import Drawn, Figures
from femgear.trains.static.figures import FIGURES as STATIC
from femgear.trains.static.figures import picture_sectors
from femgear.trains.static.stages import ring_foundation

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.gears.planetary import PlanetarySet

_BADGE = {"boxstyle": "circle", "facecolor": "white", "edgecolor": VERMILION}

# share of the height below the strongest line that a letter above it takes
_ROOM = 0.068
# numbers along an axis, and lines of a spectrum that can be told apart, at most
_TICKS, _STEMS = 20, 4000
# between ticks, times powers of ten
_STEPS = [1, 2, 2.5, 5, 10]
# lines of a band that are labelled, at most
_LABELS = 12
_LINEAR, _EXACT = "Heaviside, linear interpolation", "exact circumferential Fourier"
_ACCELERATION = "acceleration [m/s²]"
_ACCELEROMETER, _MICROPHONE = "accelerometer", "microphone"
# lowest level of a line of a band that is shown [dB]
_BAND_FLOOR = -50.0


def natural_frequencies(modes: xr.Dataset) -> Figure:
    """Draw the natural frequencies of modes.nc over the nodal diameters of the ring, by kind of mode."""
    figure, (ax,) = new_figure(height=5.0)
    kinds = np.array([str(kind) for kind in modes["kind"].values])
    frequency, diameter = modes["frequency"].values, modes["nodal_diameter"].values
    for i, kind in enumerate(dict.fromkeys(kinds)):
        rows = kinds == kind
        ax.plot(
            diameter[rows],
            frequency[rows] * 1e-3,
            MARKERS[i % len(MARKERS)],
            color=COLOURS[i % len(COLOURS)],
            markersize=6,
            markerfacecolor="none",
            markeredgewidth=1.6,
            label=f"{kind} ({np.count_nonzero(rows)})",
        )
    ticks = np.unique(diameter)
    if len(ticks) <= 25:
        ax.set_xticks(ticks, ["none" if n < 0 else str(n) for n in ticks])
    ax.set_ylim(bottom=0)
    label(ax, "nodal diameters of the ring [1]", "natural frequency [kHz]")
    legend_below(figure, columns=4)
    return figure


def ring_mean_deflection(dynamics: xr.Dataset, planetary_set: PlanetarySet) -> Figure:
    """Draw the mean radial deflection of the ring (dynamics.nc) over the angle in the carrier frame.

    That of the outer surface at the last speed, with the angles of the planets marked.
    """
    figure, (ax,) = new_figure(width=6.4, height=6.6, polar=True)
    angle = np.linspace(0.0, 2 * np.pi, 721)
    zero = int(np.flatnonzero(dynamics["harmonic"].values == 0)[0])
    component = harmonics_of(dynamics, "ring")[zero]
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


def _shown_harmonics(housing: xr.Dataset) -> tuple[int, ...]:
    """The first mesh harmonic, and the one with the strongest line where that is another one."""
    spectrum = _spectrum(housing)
    return tuple(sorted({1, *_strongest_bands(spectrum.order, spectrum.amplitude, _ring_teeth(housing), 1)}))


def _ring_teeth(housing: xr.Dataset) -> int:
    return int(housing.attrs["ring_teeth"])


def _spectrum(housing: xr.Dataset, form: str | None = None) -> OrderSpectrum:
    """Lines of the acceleration at the first speed."""
    lines = stored_lines(housing.isel(speed=0), form=form)
    return OrderSpectrum(lines.order, lines.acceleration)


def _band(housing: xr.Dataset, harmonic: int) -> BandAnalysis:
    """Lines, signal, envelope and lobes around one mesh harmonic; see `analyse_band`."""
    return analyse_band(_spectrum(housing), _ring_teeth(housing), harmonic)


def housing_signal(housing: xr.Dataset, *, harmonics: Sequence[int] | None = None) -> Figure:
    """Draw the acceleration of housing.nc over one carrier revolution at its first speed.

    Whole, and around mesh harmonics with its envelope: those given, or the first and that of the strongest
    line.
    """
    harmonics = _shown_harmonics(housing) if harmonics is None else harmonics
    speed, count = rpm(housing["speed"].values[0]), 1 + len(harmonics)
    figure, axes = new_figure(rows=count, width=9.5, height=1.0 + 2.5 * count, sharex=True)
    signal = fixed_sensor_signal(stored_lines(housing.isel(speed=0))).acceleration
    text = "largest and smallest within a mesh period"
    around = _extremes(signal, _ring_teeth(housing))
    title = f"{speed}{excited_to(housing, 0)}: all orders"
    _draw_signal(axes[0], signal, around, title, text=text, colour=ORANGE)
    for ax, harmonic in zip(axes[1:], harmonics):
        found = _band(housing, harmonic)
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
    label(ax, y=_ACCELERATION, title=title)


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


def order_spectrum(housing: xr.Dataset) -> Figure:
    """Draw the order spectrum of housing.nc at its first speed, mesh harmonics marked.

    Below are the strongest bands with their lines labelled: one of harmonic ``h`` and nodal diameter ``n``
    stands at order ``h z_ring - n``.
    """
    from matplotlib.ticker import MaxNLocator

    spectrum, only, ring_teeth = _spectrum(housing), _spectrum(housing, "exact"), _ring_teeth(housing)
    order, linear, exact = spectrum.order, spectrum.amplitude, np.zeros(len(spectrum.order))
    exact[np.searchsorted(order, only.order)] = only.amplitude
    bands = _strongest_bands(order, linear, ring_teeth, 2)
    figure, axes = new_figure(rows=1 + len(bands), width=9.5, height=3.2 + 3.8 * len(bands))
    largest = max(linear.max(initial=0.0), exact.max(initial=0.0)) or 1.0
    floor = 1e-4 * largest
    # what stands for the ring between its points is said where it is not the ring itself
    form = _EXACT if housing.attrs["form"] == "exact" else _LINEAR
    _stems(axes[0], order, linear, floor, text=form)
    # the record may reach further than the excitation at this speed
    end = order[np.maximum(linear, exact) > floor].max(initial=ring_teeth)
    axes[0].set_xlim(0, end + 0.5 * ring_teeth)
    top = axes[0].secondary_xaxis("top", functions=(lambda x: x / ring_teeth, lambda h: h * ring_teeth))
    # at most twenty numbers, that none covers another
    top.xaxis.set_major_locator(MaxNLocator(_TICKS, steps=_STEPS, integer=True, prune="lower"))
    top.tick_params(labelsize=SIZE - 2)
    top.set_xlabel("harmonic of the mesh frequency [1]", fontsize=SIZE - 1)
    label(axes[0], "carrier order [1]", _ACCELERATION)
    axes[0].set_ylim(floor, 2.5 * largest)
    axes[0].minorticks_off()
    for ax, harmonic in zip(axes[1:], bands):
        _draw_band(ax, order, linear, exact, ring_teeth, harmonic, form)
    speed = rpm(housing["speed"].values[0]) + excited_to(housing, 0)
    figure.suptitle(f"Order spectrum of the fixed sensor, {speed}", fontsize=12)
    legend_below(figure)
    return figure


def _strongest_bands(order, amplitude, ring_teeth, count: int) -> list[int]:
    """So many mesh harmonics whose bands hold the strongest lines, ascending."""
    harmonics = np.rint(order / ring_teeth).astype(int)
    peaks = {int(h): amplitude[harmonics == h].max() for h in np.unique(harmonics) if h > 0}
    ranked = sorted((h for h in peaks if peaks[h] > 0), key=lambda h: (-peaks[h], h))
    return sorted(ranked[:count])


def _stems(ax, order, amplitude, floor, *, text, width=1.0):
    shown = _highest(order, amplitude, amplitude > floor)
    # one line with gaps takes a tenth of the time of `vlines`
    height = np.stack(np.broadcast_arrays(floor, amplitude[shown], np.nan), axis=1)
    line = {"color": BLUE, "linewidth": width, "solid_capstyle": "butt"}
    ax.plot(np.repeat(order[shown], 3), height.ravel(), label=text, **line)
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
    multiple = str(ring_teeth) if harmonic == 1 else f"{harmonic}·{ring_teeth}"
    for k in _labelled(order, peak, inside & (peak > floor), spacing=reach / 22):
        offset = round(order[k]) - centre
        text = f"{order[k]:g}" if offset == 0 else f"{order[k]:g} = {multiple} {offset:+d}"
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
    label(ax, "carrier order [1]", _ACCELERATION, f"around mesh harmonic {harmonic} (order {centre})")


def _labelled(order, amplitude, candidates, *, spacing):
    """Strongest lines whose labels do not run into each other."""
    chosen = []
    for k in np.flatnonzero(candidates)[np.argsort(-amplitude[candidates], kind="stable")]:
        if all(abs(order[k] - order[other]) >= spacing for other in chosen):
            chosen.append(k)
    return chosen[:_LABELS]


def modulation_polar(housing: xr.Dataset) -> Figure:
    """Draw the envelope of the acceleration of housing.nc over the angle of the carrier at its first speed.

    One polar diagram for each of the mesh harmonics that `housing_signal` shows.
    """
    from matplotlib.ticker import MaxNLocator

    harmonics = _shown_harmonics(housing)
    speed = rpm(housing["speed"].values[0])
    figure, axes = new_figure(columns=len(harmonics), width=5.2 * len(harmonics), height=6.2, polar=True)
    for i, (ax, harmonic) in enumerate(zip(axes, harmonics)):
        found = _band(housing, harmonic)
        lobes, angle = found.lobes, np.linspace(0.0, 2 * np.pi, len(found.envelope) + 1)
        value = np.append(found.envelope, found.envelope[0])
        ax.plot(angle, value, color=COLOURS[i % len(COLOURS)], linewidth=2.0)
        # a polygon would search the extremes of every one of its sides
        ax.fill_between(angle, 0.0, value, color=COLOURS[i % len(COLOURS)], alpha=0.15, linewidth=0)
        ax.plot(2 * np.pi * lobes.position, lobes.height, "v", color=BLACK, markersize=6, label="lobe")
        ax.yaxis.set_major_locator(MaxNLocator(4, steps=_STEPS, prune="lower"))
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


def microphone_spectrum(housing: xr.Dataset) -> Figure:
    """Draw the lines of accelerometer and microphone of housing.nc over the frequency at its first speed.

    Below are the first mesh harmonic and that of the strongest line: what the air filters is the difference
    between the two levels of an order, each relative to the strongest line of the band at its sensor.
    """
    lines, pressure = stored_sound(housing.isel(speed=0))
    acceleration, pressure = np.abs(lines.acceleration), np.abs(pressure)
    bands = _shown_harmonics(housing)
    figure, axes = new_figure(rows=2 + len(bands), width=9.5, height=4.6 + 3.0 * len(bands))
    frequency, floor = lines.frequency * 1e-3, 1e-4 * (acceleration.max() or 1.0)
    _stems(axes[0], frequency, acceleration, floor, text=_ACCELEROMETER)
    level = 20 * np.log10(np.maximum(pressure, 1e-30) / (np.sqrt(2) * REFERENCE_PRESSURE))
    root = min(0.0, level.max() - 40.0)  # the threshold of hearing
    shown = _highest(lines.order, level, level > root)
    axes[1].vlines(frequency[shown], root, level[shown], color=VERMILION, linewidth=1.0, label=_MICROPHONE)
    axes[1].set_ylim(bottom=root)
    label(axes[0], "frequency [kHz]", _ACCELERATION)
    total, place = float(housing["pressure_level"][0]), housing.attrs["microphone_distance"]
    label(axes[1], "frequency [kHz]", "sound pressure level [dB]", f"{total:.1f} dB(A) at {place:g} m")
    axes[1].sharex(axes[0])
    for ax, harmonic in zip(axes[2:], bands):
        _draw_sensors(ax, lines, {_ACCELEROMETER: acceleration, _MICROPHONE: pressure}, harmonic)
    speed = rpm(housing["speed"].values[0]) + excited_to(housing, 0)
    figure.suptitle(f"Accelerometer and microphone, {speed}", fontsize=12)
    legend_below(figure)
    return figure


def _draw_sensors(ax, lines: SensorLines, amplitudes: Mapping[str, np.ndarray], harmonic: int) -> None:
    """Levels of the lines of a band at both sensors, each relative to its strongest, with nodal diameters."""
    from matplotlib.ticker import MaxNLocator

    own = np.rint(lines.order / lines.z_ring) == harmonic
    order, n, highest = lines.order[own], np.abs(nodal_diameters(lines)[own]), np.full(own.sum(), -np.inf)
    for (text, amplitude), colour, side in zip(amplitudes.items(), (BLUE, VERMILION), (-0.2, 0.2)):
        relative = amplitude[own] / (amplitude[own].max(initial=0.0) or 1.0)
        level = 20 * np.log10(np.maximum(relative, 1e-30))
        shown = level > _BAND_FLOOR
        ax.vlines(order[shown] + side, _BAND_FLOOR, level[shown], color=colour, linewidth=3.0, label=text)
        highest = np.maximum(highest, level)
    shown = highest > _BAND_FLOOR
    for k in np.flatnonzero(shown):
        ax.text(order[k], highest[k] + 1.0, str(n[k]), ha="center", fontsize=SIZE - 2)
    reach = np.abs(order[shown] - harmonic * lines.z_ring).max(initial=4) + 2
    ax.set_xlim(harmonic * lines.z_ring - reach, harmonic * lines.z_ring + reach)
    ax.xaxis.set_major_locator(MaxNLocator(_TICKS, steps=_STEPS, integer=True))
    ax.set_ylim(_BAND_FLOOR, 8)
    title = f"around mesh harmonic {harmonic} (order {harmonic * lines.z_ring}); numbers: nodal diameters"
    label(ax, "carrier order [1]", "level [dB]", title)


def _modes_figures(drawn: Drawn) -> dict[str, Figure]:
    modes = drawn.data["modes"]
    return {
        "mode_shapes": mode_shapes(modes, planetary_set(drawn.case)),
        "natural_frequencies": natural_frequencies(modes),
    }


def _write_ring_modes(drawn: Drawn, folder: Path) -> list[str]:
    """Modes of the toothed ring on its foundation for 0 to 6 nodal diameters, as VTU and picture."""
    static, case = drawn.results.get("static"), drawn.case
    if static is None:
        return []
    gears, material = static.planetary_set, material_of(case)
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
        title=f"toothed ring, {field}",
        colour_label="relative displacement",
        colour_factor=1.0,
    )
    return ["ring_modes.vtu", "ring_mode.png"]


def _dynamics_figures(drawn: Drawn) -> dict[str, Figure]:
    dynamics, data = drawn.data["dynamics"], drawn.data
    return response_figures(
        dynamics,
        dynamic_transmission_error=transmission_error_period(
            dynamics, _on_supports(data.get("modes"), data.get("static"))
        ),
        ring_static_deflection=ring_mean_deflection(dynamics, planetary_set(drawn.case)),
    )


def _on_supports(modes: xr.Dataset | None, static: xr.Dataset | None) -> xr.Dataset | None:
    """Static transmission errors that the dynamics start from, else those of static.nc."""
    if modes is None or "supported_ste" not in modes:
        return static
    return modes[["supported_ste"]].rename(supported_ste="ste", supported_position="position")


def _write_animation(drawn: Drawn, folder: Path) -> list[str]:
    """The ring's operating deflection while the carrier turns, at the last speed."""
    case, last = drawn.case, drawn.data["dynamics"].isel(speed=-1)
    animate_operating_deflection(
        folder / "operating_deflection.gif",
        planetary_set(case),
        radial=harmonics_of(last, "ring"),
        tangential=harmonics_of(last, "ring_tangential"),
        sensor_angle=case.housing.sensor_angle,
        clockwise=float(last["carrier_speed"]) < 0,
        title=f"{case.operation.input} at {case.operation.speeds[-1] / RPM:.0f} rpm",
    )
    return ["operating_deflection.gif"]


def _write_explorer(drawn: Drawn, folder: Path) -> list[str]:
    """What the page walks through of the run-up."""
    runup, housing = drawn.data["runup"], drawn.data.get("housing")
    pressure = None if housing is None else run_up_lines(runup, housing.attrs)[1]
    found = explorer(runup, drawn.data["modes"], pressure)
    write_text(json.dumps(found, allow_nan=False, separators=(",", ":")), folder / EXPLORER)
    return [EXPLORER]


def _housing_figures(drawn: Drawn) -> dict[str, Figure]:
    figures, housing = {}, drawn.data["housing"]
    drawings = (
        ("housing_signal", housing_signal),
        ("order_spectrum", order_spectrum),
        ("modulation", modulation_polar),
        ("microphone_spectrum", microphone_spectrum),
    )
    for s in shown_speeds(housing):
        one = housing.isel(speed=[s])
        for name, draw in drawings:
            figures[f"{name}_{round(float(one['speed'][0]))}_rpm"] = draw(one)
    return figures


FIGURES = STATIC | {
    "modes": Figures(
        MODE_CAPTIONS
        | {
            "natural_frequencies": "Natural frequencies over the nodal diameters of the ring.",
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
            "operating_deflection": (
                "Operating deflection of the ring, without its mean, during one revolution of the carrier. "
                "Every frame is a true instant; the meshes appear slowed down as under a stroboscope."
            ),
        },
        draw=_dynamics_figures,
        write=(_write_animation,),
    ),
    "housing": Figures(
        {
            "housing_signal": (
                "Acceleration at the fixed sensor during one carrier revolution: all orders with the "
                "largest and the smallest value within a mesh period, and the band around a mesh harmonic "
                "with its envelope and lobes ({})."
            ),
            "order_spectrum": (
                "Carrier orders at the fixed sensor ({}): a wave of n nodal diameters at mesh harmonic h is "
                "heard at order h z − n, z the teeth of the ring, when the carrier turns counter-clockwise."
            ),
            "modulation": "Envelope around a mesh harmonic over the angle of the carrier ({}).",
            "microphone_spectrum": (
                "Lines of the accelerometer and of a microphone beside it ({}), and their levels around mesh "
                "harmonics, each relative to its strongest line there: waves of many nodal diameters hardly "
                "radiate at low frequency, so that the microphone hears other side bands."
            ),
        },
        draw=_housing_figures,
    ),
    "runup": Figures(
        RUNUP_CAPTIONS,
        draw=lambda drawn: runup_figures(drawn.data["runup"], drawn.data["modes"]),
        write=(_write_explorer,),
    ),
}
