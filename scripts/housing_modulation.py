#!/usr/bin/env python3
"""What a sensor fixed on the housing hears around one mesh harmonic while the carrier turns."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError
from femgear.findings import percent

CSV_HEADER = ("carrier order", "harmonic", "offset", "exact [m/s^2]", "Hanning [relative]")
LINEAR = "linear [m/s^2]"
EXPORTED = 18  # harmonics of the ring in the grid file, and the one that is looked at
FILES = (
    "order_spectrum.png",
    "envelope.png",
    "modulation.png",
    "lines.csv",
    "ring_deflection.vtu",
    "modulation.vtp",
)


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/housing_modulation"),
    speed: str = "250 rpm",
    harmonic: int = 1,
) -> None:
    """Compute orders, envelope and lobes around a mesh harmonic: a table, pictures, CSV, VTU and VTP.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out.
    output
        Folder of the results.
    speed
        Speed of the input with its unit.
    harmonic
        Harmonic of the mesh frequency, 1 upwards.
    """
    from femgear.case.gear_set import need_set, planetary_set
    from femgear.trains.reading import read_case, with_value

    data = read_case(case)
    need_set(data)
    data = with_value(data, "operation.speeds", [speed])
    # refuse before the folder is touched, and what only the response tells after it
    _check_harmonic(harmonic, data.response_harmonics)
    planetary_set(data)
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        static, dynamics, housing = _solve(data, progress)
        _check_harmonic(harmonic, dynamics.response.force.shape[-1] - 1)
        band_models = _bands(data, static, dynamics, housing, harmonic)
        progress("pictures", 0, 1)
        _draw(folder, speed, band_models, static.planetary_set.ring.teeth)
        _export(folder, static.planetary_set, dynamics, band_models)
        progress("pictures", 1, 1)
    header = CSV_HEADER if band_models.linear is None else (*CSV_HEADER, LINEAR)
    write_csv(folder / "lines.csv", header, _records(band_models, static.planetary_set.ring.teeth))
    _print_lines(band_models, dynamics, speed)
    say_files(folder, FILES)


def _check_harmonic(harmonic: int, highest: int | None) -> None:
    """Refuse a harmonic that the response does not have, where that is known."""
    if harmonic < 1 or (highest is not None and harmonic > highest):
        raise CaseError(
            f"there is no harmonic {harmonic} in the response",
            code="E-HARMONIC",
            key="--harmonic",
            limit="1 or more" if highest is None else f"1 to {highest}",
            remedy="raise dynamics.up_to or dynamics.mesh_harmonics for higher ones",
        )


@dataclass(frozen=True)
class Heard:
    """One band by two or three models; amplitudes over the orders of the band, and what `analyse_band` says.

    The Hanning model has no unit of its own: it is scaled to the largest line of the exact form. ``linear``
    is there where the case has ``housing.form = "linear"``.
    """

    harmonic: int
    order: np.ndarray
    linear: np.ndarray | None
    exact: np.ndarray
    hanning: np.ndarray
    bands: dict


def _solve(case, progress):
    """Static, dynamic and housing results of the case."""
    from femgear.case.gear_set import planetary_set
    from femgear.run import grid_cache
    from femgear.stages.lumped_set import check_one_period
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes

    check_one_period(case, planetary_set(case), "this script takes")
    static = solve_static(case, cache=grid_cache(), progress=progress)
    progress("modes", 0, 1)
    modes = solve_modes(case, static)
    progress("modes", 1, 1)
    dynamics = solve_dynamics(case, static, modes, progress=progress)
    return static, dynamics, solve_housing(case, dynamics)


def _bands(case, static, dynamics, housing, harmonic) -> Heard:
    """The band around the harmonic, heard through the ring's field and through Hanning windows."""
    from femgear.housing.orders import OrderSpectrum, analyse_band
    from femgear.housing.sensor import fixed_sensor_lines, hanning_model

    gears = static.planetary_set
    carrier = np.array([s.carrier for s in dynamics.speeds])
    forces = dynamics.response.force[:, gears.n_planets :]
    field = hanning_model(forces, gears.planet_angles)
    windowed = fixed_sensor_lines(field, gears.ring.teeth, carrier, case.housing.sensor_angle)
    spectra = {}
    models = {"exact": housing.exact, "Hanning": windowed}
    if housing.form == "linear":
        models["linear"] = housing.lines
    for name, lines in models.items():
        spectrum = OrderSpectrum(lines.order, lines.acceleration[0])
        spectra[name] = (spectrum, analyse_band(spectrum, gears.ring.teeth, harmonic))
    order = np.arange(spectra["exact"][1].low, spectra["exact"][1].high + 1)
    values = {name: np.zeros(len(order)) for name in spectra}
    for name, (spectrum, _) in spectra.items():
        inside = (spectrum.order >= order[0]) & (spectrum.order <= order[-1])
        values[name][spectrum.order[inside] - order[0]] = spectrum.amplitude[inside]
    scale = values["exact"].max() / (values["Hanning"].max() or 1.0)
    return Heard(
        harmonic,
        order,
        values.get("linear"),
        values["exact"],
        values["Hanning"] * scale,
        {name: band for name, (_, band) in spectra.items()},
    )


def _records(band_models: Heard, teeth: int):
    for k, order in enumerate(band_models.order):
        offset = int(order) - band_models.harmonic * teeth
        models = (band_models.exact, band_models.hanning) + (
            () if band_models.linear is None else (band_models.linear,)
        )
        values = (float(v[k]) for v in models)
        yield int(order), band_models.harmonic, offset, *values


def _print_lines(band_models: Heard, dynamics, speed: str):
    strongest = np.argsort(-band_models.exact, kind="stable")[:8]
    centre = (band_models.order[0] + band_models.order[-1]) // 2
    rows = [
        (
            f"{band_models.order[k]} = {centre} {band_models.order[k] - centre:+d}",
            f"{band_models.exact[k]:.4g}",
            f"{band_models.hanning[k]:.4g}",
            *(() if band_models.linear is None else (f"{band_models.linear[k]:.4g}",)),
        )
        for k in sorted(strongest)
        if band_models.exact[k] > 1e-6 * band_models.exact.max()
    ]
    title = f"{speed}, mesh harmonic {band_models.harmonic} (mesh frequency {dynamics.response.mesh_frequency[0]:g} Hz)"
    header = ("carrier order", "exact [m/s^2]", "Hanning, scaled [m/s^2]")
    header += () if band_models.linear is None else (LINEAR,)
    print_table(f"Strongest lines at {title}", header, rows)
    for name, band in band_models.bands.items():
        strong = ", ".join(f"{line.order:g}" for line in band.lines[:2])
        lobes = len(band.lobes.position)
        print(f"{name}: {lobes} lobes of the envelope a revolution, strongest lines {strong}")
    threshold = band_models.bands["exact"].lobes.threshold
    print(f"a lobe stands out by at least {percent(threshold)} of the largest envelope value")


def _draw(folder: Path, speed: str, band_models: Heard, teeth: int) -> None:
    from femgear.report.style import save_figure

    save_figure(_spectrum_figure(speed, band_models, teeth), folder / "order_spectrum.png")
    save_figure(_envelope_figure(speed, band_models), folder / "envelope.png")


def _spectrum_figure(speed: str, band_models: Heard, teeth: int):
    """Lines of the band: the ring's field above, the Hanning model below."""
    from femgear.report.style import BLUE, ORANGE, VERMILION, label, legend_below, new_figure

    figure, axes = new_figure(rows=2, width=9.5, height=7.0, sharex=True)
    drawn, form = band_models.exact, "ring field, exact circumferential Fourier"
    if band_models.linear is not None:
        drawn, form = band_models.linear, "ring field, Heaviside and linear interpolation"
    top = max(band_models.exact.max(), drawn.max()) or 1.0
    floor = 3e-4 * top
    centre = band_models.harmonic * teeth
    for ax, values, colour, text in (
        (axes[0], drawn, BLUE, form),
        (axes[1], band_models.hanning, ORANGE, "Hanning windows, scaled to the largest line"),
    ):
        shown = values > floor
        ax.vlines(band_models.order[shown], floor, values[shown], color=colour, linewidth=2.5, label=text)
        ax.set_yscale("log")
        ax.set_ylim(floor, 12 * top)
        for k in np.argsort(-values, kind="stable")[:5]:
            if values[k] > floor:
                text = f"{band_models.order[k]}"
                ax.annotate(
                    text,
                    (band_models.order[k], values[k]),
                    xytext=(0, 8),
                    textcoords="offset points",
                    ha="center",
                    va="bottom",
                    rotation=90,
                    fontsize=9.5,
                )
    label(axes[0], y="acceleration [m/s²]")
    label(axes[1], y="acceleration, scaled [m/s²]")
    shown = band_models.exact > floor
    if band_models.linear is not None:
        axes[0].plot(
            band_models.order[shown],
            band_models.exact[shown],
            "o",
            markerfacecolor="none",
            color=VERMILION,
            label="ring field, exact circumferential Fourier",
        )
    reach = int(np.abs(band_models.order[shown] - centre).max(initial=6)) + 3
    axes[0].set_xlim(centre - reach, centre + reach)
    label(axes[0], title=f"{speed}, around mesh harmonic {band_models.harmonic} (order {centre})")
    label(axes[1], "carrier order [1]")
    legend_below(figure, columns=2)
    return figure


def _envelope_figure(speed: str, band_models: Heard):
    """Signal and envelope of the band over one carrier revolution, by the ring's field and by windows."""
    from femgear.report.style import BLACK, BLUE, VERMILION, label, legend_below, new_figure

    figure, axes = new_figure(rows=2, width=9.5, height=6.4, sharex=True)
    for ax, name, text in ((axes[0], "exact", "ring field"), (axes[1], "Hanning", "Hanning windows")):
        band = band_models.bands[name]
        scale = 1.0 / (band.envelope.max() or 1.0)
        at = np.arange(len(band.signal)) / len(band.signal)
        ax.plot(at, scale * band.signal, color=BLUE, linewidth=0.5, label="acceleration of the fixed point")
        for sign in (1, -1):
            ax.plot(at, sign * scale * band.envelope, color=VERMILION, linewidth=1.5, label="envelope")
        lobes = band.lobes
        ax.plot(lobes.position, scale * lobes.height, "v", color=BLACK, markersize=7, label="lobe", clip_on=False)
        title = f"{text}: {len(lobes.position)} lobes (largest value {band.envelope.max():.3g}"
        label(ax, y="relative to the largest [1]", title=title + (" m/s²)" if name == "exact" else ", no unit)"))
    axes[0].set_xlim(0, 1)
    figure.suptitle(f"{speed}, orders {band_models.order[0]} to {band_models.order[-1]}", fontsize=12)
    label(axes[1], "carrier revolutions [1]")
    legend_below(figure)
    return figure


def ring_surface(planetary_set, radial, tangential, *, columns: int = 360):
    """Outer surface of the ring as a VTK grid, with its deflection in the frame of the carrier.

    Parameters
    ----------
    planetary_set : PlanetarySet
    radial, tangential : (H + 1, 2 n_max + 1) complex arrays
        Components ``u(phi, t) = Re sum U[h, n] e^{i n phi} e^{i h omega t}`` [m].
    columns : int
        Points around.

    Returns
    -------
    pyvista.UnstructuredGrid
        Point data [m]: ``static`` and, for every harmonic, ``harmonic h, cosine`` and ``harmonic h, sine``
        (displacement at ``h omega t = 0`` and ``-pi/2``), each with three components.
    """
    from femgear.report.scene import load_pyvista

    pv = load_pyvista()
    phi = 2 * np.pi * np.arange(columns + 1) / columns
    wave = np.exp(1j * np.outer(np.arange(-(radial.shape[1] // 2), radial.shape[1] // 2 + 1), phi))
    width, radius = planetary_set.ring.face_width, planetary_set.ring.rim_radius
    angle, z = np.meshgrid(phi, np.array([0.0, width]), indexing="ij")
    grid = pv.StructuredGrid(radius * np.cos(angle)[..., None], radius * np.sin(angle)[..., None], z[..., None])
    grid = grid.cast_to_unstructured_grid()
    at = np.arctan2(grid.points[:, 1], grid.points[:, 0])
    column = np.rint(np.mod(at, 2 * np.pi) / (2 * np.pi) * columns).astype(int) % columns
    u, v = (components @ wave for components in (radial, tangential))
    for h in range(len(radial)):
        for name, part in (("cosine", np.real), ("sine", np.imag)):
            ur, ut = part(u[h])[column], part(v[h])[column]
            c, s = np.cos(at), np.sin(at)
            field = np.column_stack([ur * c - ut * s, ur * s + ut * c, np.zeros(len(at))])
            if h == 0 and name == "cosine":
                grid.point_data["static"] = field
            elif h > 0:
                grid.point_data[f"harmonic {h}, {name}"] = field
    return grid


def _export(folder: Path, planetary_set, dynamics, band_models: Heard) -> None:
    """The ring's deflection as VTU; the polar modulation as VTP and PNG."""
    from femgear.report.scene import write_vtu
    from femgear.storage.files import replaced_file

    shown = slice(0, max(EXPORTED, band_models.harmonic) + 1)
    field = dynamics.ring_radial[0, shown], dynamics.ring_tangential[-1, shown]
    surface = ring_surface(planetary_set, *field)
    write_vtu(surface, folder / "ring_deflection.vtu")
    radius = planetary_set.ring.rim_radius
    envelope = band_models.bands["exact"].envelope
    # scaled by the largest value: no part of the curve reaches into the ring
    curve = polar_curve(envelope, radius=1.02 * radius, height=0.4 * radius)
    with replaced_file(folder / "modulation.vtp") as temporary:
        curve.save(temporary, binary=True)
    _polar_picture(folder / "modulation.png", planetary_set, band_models, curve)


def polar_curve(values, *, radius: float, height: float):
    """A periodic function [m/s^2], equally spaced over a turn from angle 0, as a closed line round a circle.

    The value zero lies at `radius`, the largest magnitude `height` outside it [m].
    """
    from femgear.report.scene import load_pyvista

    angle = 2 * np.pi * np.arange(len(values)) / len(values)
    r = radius + height * values / (np.abs(values).max(initial=0.0) or 1.0)
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.zeros(len(values))])
    curve = load_pyvista().PolyData(points, lines=[len(values) + 1, *range(len(values)), 0])
    curve.point_data["envelope [m/s^2]"] = values
    return curve


def _polar_picture(path: Path, planetary_set, band_models: Heard, curve) -> None:
    """The envelope around the ring over the angle of the carrier, beside that of the Hanning model."""
    from femgear.report.scene import add_text, load_pyvista, look_down, write_png

    pv = load_pyvista()
    size, ring = 900, planetary_set.ring
    plotter = pv.Plotter(off_screen=True, window_size=(size, size))
    plotter.enable_anti_aliasing("ssaa")
    body = pv.Disc(inner=ring.root_radius, outer=ring.rim_radius, c_res=240)
    plotter.add_mesh(body, color="#D8D8D8", lighting=False)
    for psi in planetary_set.planet_angles:
        centre = planetary_set.centre_distance * np.array([np.cos(psi), np.sin(psi), 0.0])
        disc = pv.Disc(
            center=centre, inner=planetary_set.planet.rim_radius, c_res=90, outer=planetary_set.planet.reference_radius
        )
        plotter.add_mesh(disc, color="#F0E0B0", lighting=False)
    windows = band_models.bands["Hanning"].envelope
    other = polar_curve(windows, radius=1.02 * ring.rim_radius, height=0.4 * ring.rim_radius)
    plotter.add_mesh(other, color="#E69F00", line_width=4.0, lighting=False)
    plotter.add_mesh(curve, color="#0072B2", line_width=6.0, lighting=False)
    lobes = {name: len(band.lobes.position) for name, band in band_models.bands.items()}
    text = (
        f"envelope around mesh harmonic {band_models.harmonic} over the carrier angle\n"
        f"blue: field of the ring, {lobes['exact']} lobes; orange: Hanning windows, {lobes['Hanning']} lobes"
    )
    add_text(plotter, text, size)
    look_down(plotter, 1.65 * ring.rim_radius)
    write_png(plotter, path)


if __name__ == "__main__":
    sys.exit(run_script(main))
