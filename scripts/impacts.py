#!/usr/bin/env python3
"""The figures of docs/impacts.md: errors and damping over frequency, impacts, chaos, a floating sun."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import (
    REFERENCE_CASE,
    Progress,
    print_table,
    ready_folder,
    run_script,
    say_files,
    write_csv,
)

from femgear.errors import CaseError

DAMPING, ERRORS, ECCENTRICITIES = (0.15, 0.09), (0.36, 0.54, 0.72), (0.0, 5e-6, 15e-6)
FILES = {
    "damping": ("damping.csv", "damping.png"),
    "errors": ("tooth_error.csv", "tooth_error.png"),
    "states": ("contact_states.csv", "contact_states.png"),
    "chaos": ("chaos.csv", "chaos.png", "sections.png"),
    "eccentricity": ("eccentricity.csv", "eccentricity.png", "sun_path.png", "spectrum.png"),
}
STUDIES = tuple(FILES)


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/impacts"),
    study: Annotated[tuple[str, ...], Parameter(negative="")] = STUDIES,
    harmonics: int = 12,
    ratios: int = 61,
    points: int = 100,
    frequencies: int = 16,
) -> None:
    """Draw the studies of docs/impacts.md and write their numbers.

    Parameters
    ----------
    output
        Folder of the results.
    study
        Of damping, errors, states, chaos, eccentricity; may be repeated.
    harmonics
        Of the tooth frequency, in the branches.
    ratios
        Frequency ratios of the sweeps and of the bifurcation diagram.
    points
        Periods that count for every exponent.
    frequencies
        Mesh frequencies of the planetary set.
    """
    unknown = set(study) - set(STUDIES)
    if unknown or harmonics < 1 or ratios < 3 or points < 8 or frequencies < 2:
        raise CaseError(
            f"studies {', '.join(study)}; {harmonics} harmonics, {ratios} ratios, {points} points, "
            f"{frequencies} frequencies",
            code="E-RANGE",
            limit=f"{', '.join(STUDIES)}; 1 harmonic, 3 ratios, 8 points, 2 frequencies or more",
        )
    names = [file for name in dict.fromkeys(study) for file in FILES[name]]
    folder = ready_folder(output, names)
    with Progress() as progress:
        for name in dict.fromkeys(study):
            progress(name)
            if name == "damping":
                damping_study(folder, harmonics)
            elif name == "errors":
                error_study(folder, harmonics)
            elif name == "states":
                state_study(folder, harmonics, ratios)
            elif name == "chaos":
                chaos_study(folder, ratios, points)
            else:
                eccentricity_study(folder, frequencies)
            progress(name, 1)
    say_files(folder, names)


def read(name: str, values: dict):
    """One of the cases of gear pairs with entries changed."""
    from femgear.trains.reading import read_case, with_values

    return with_values(read_case(REFERENCE_CASE.with_name(f"{name}.toml")), values)


def damping_study(folder: Path, harmonics: int) -> None:
    """Amplitude and mean for two damping ratios."""
    from femgear.trains.impacts.stages import solve_impact_response

    curves, rows = [], []
    for zeta in DAMPING:
        values = {"mesh.damping_ratio": zeta, "response.harmonics": harmonics}
        data = solve_impact_response(read("gear_pair", values)).dataset()
        curves.append(curve_of(f"ζ = {zeta}", data))
        folds = ", ".join(f"{r:.4f}" for r in np.sort(data["ratio"].values[data["fold"].values]))
        borders = [", ".join(f"{r:.3f}" for r in data[f"{side}_border"].values) for side in ("drive", "back")]
        largest = f"{float(data['amplitude'].max()):.3f}"
        rows.append((f"{zeta}", largest, folds or "none", *(b or "none" for b in borders)))
    header = ("damping ratio", "largest amplitude", "limit points", "x = 1 at", "x = -1 at")
    print_table("Load 0.9, tooth error 0.72, k(t) 10 %", header, rows)
    draw_curves(folder, "damping", curves, "load 0.9, tooth error 0.72, k(t) 10 %")


def error_study(folder: Path, harmonics: int) -> None:
    """Amplitude and mean for several tooth-frequency errors."""
    from femgear.trains.impacts.stages import solve_impact_response

    curves = []
    for error in ERRORS:
        values = {"mesh.error": [f"{30 * error:.4g} um"], "response.harmonics": harmonics}
        curves.append(curve_of(f"error {error}", solve_impact_response(read("gear_pair", values)).dataset()))
    draw_curves(folder, "tooth_error", curves, "load 0.9, ζ = 0.09, k(t) 10 %")


def curve_of(text: str, data) -> tuple:
    """A branch as a curve of `amplitude_and_mean`."""
    return text, *(data[name].values for name in ("ratio", "amplitude", "mean", "stable"))


def draw_curves(folder: Path, name: str, curves, title: str) -> None:
    """Picture and table of curves over the frequency ratio."""
    from femgear.report.style import save_figure
    from femgear.trains.impacts.figures import amplitude_and_mean

    records = [
        (text, float(r), float(a), float(m), int(s)) for text, *columns in curves for r, a, m, s in zip(*columns)
    ]
    header = ("curve", "frequency ratio [1]", "amplitude [b]", "mean [b]", "stable")
    write_csv(folder / f"{name}.csv", header, records)
    save_figure(amplitude_and_mean(curves, title=title), folder / f"{name}.png")


def state_study(folder: Path, harmonics: int, ratios: int) -> None:
    """Contact states by harmonic balance and by sweeps up and down."""
    from femgear.report.style import save_figure
    from femgear.trains.impacts.figures import contact_rows, state_bands
    from femgear.trains.impacts.model import STATE_NAMES, state_regions
    from femgear.trains.impacts.stages import solve_impact_response, solve_sweep

    count = max(3, ratios // 2)
    ranges = [{"from": 0.6, "to": 1.0, "count": count}, {"from": 1.05, "to": 3.5, "count": count}]
    case = read("gear_pair", {"response.harmonics": harmonics, "sweep.ranges": ranges})
    rows = contact_rows(solve_impact_response(case).dataset(), solve_sweep(case).dataset())
    table = [
        (text, STATE_NAMES[number], f"{min(ends):.3f}", f"{max(ends):.3f}")
        for text, ratio, states in rows
        for number, *ends in state_regions(ratio, states)
    ]
    print_table("Contact states, ζ = 0.09", ("", "state", "from ratio", "to ratio"), table)
    write_csv(folder / "contact_states.csv", ("route", "state", "from ratio [1]", "to ratio [1]"), table)
    save_figure(state_bands(rows), folder / "contact_states.png")


def chaos_study(folder: Path, ratios: int, points: int) -> None:
    """Bifurcation diagram, exponents and sections of the lightly loaded pair."""
    from femgear.report.style import save_figure
    from femgear.trains.impacts.figures import bifurcation_and_exponent, phase_sections
    from femgear.trains.impacts.stages import solve_chaos

    data = solve_chaos(read("gear_pair_light", {"chaos.count": ratios, "chaos.points": points})).dataset()
    names = ("ratio", "exponent", "error", "lowest", "highest", "repeats", "chaotic")
    columns = [data[name].values.tolist() for name in names]
    header = (
        "frequency ratio [1]",
        "largest exponent [omega_n]",
        "error [omega_n]",
        "smallest x [b]",
        "largest x [b]",
        "repeats after periods",
        "chaotic",
    )
    write_csv(folder / "chaos.csv", header, zip(*columns))
    save_figure(bifurcation_and_exponent(data), folder / "chaos.png")
    save_figure(phase_sections(data), folder / "sections.png")
    words = columns[-1]
    chaotic = [ratio for ratio, word in zip(columns[0], words) if word == "yes"]
    ends = [f"{chaotic[0]:.2f}", f"{chaotic[-1]:.2f}"] if chaotic else ["none", "none"]
    print_table(
        "Lightly loaded pair",
        ("ratios", "chaotic: exponent clearly positive, no repetition", "from", "to", "not told", "smallest x"),
        [(str(ratios), str(len(chaotic)), *ends, str(words.count("not told")), f"{min(columns[3]):.3f}")],
    )


def eccentric_set(eccentricity: float, floating: bool):
    """Lin and Parker's set of three planets with an eccentric sun and a tooth error: errors and problem."""
    from dataclasses import replace

    from published.planetary_sets import lin_parker_set
    from published.transmission_errors import (
        Eccentricity,
        TransmissionErrors,
        equivalent_damping,
        planar_mesh_dampers,
        with_errors,
    )

    from femgear.stages.lumped_set import gear_set_problem, phased_series
    from femgear.system.fourier import tooth_lines
    from femgear.system.mesh_directions import mesh_elements
    from femgear.system.rigid_bodies import PlanarTorque

    data = lin_parker_set(3)
    data = replace(data, sun=replace(data.sun, support=1e6 if floating else 1e9))
    phases = np.array([0, 1 / 3, 2 / 3, 0.15, 0.15 + 1 / 3, 0.15 + 2 / 3])
    errors = TransmissionErrors(
        data=data,
        teeth={"sun": 28, "planet": 36, "ring": 101},
        sun=Eccentricity(eccentricity),
        tooth=tooth_lines([0.2e-6], [0.2e-6], phases),
    )
    C = equivalent_damping(data, mesh_ratio=0.05, support_ratio=0.03)
    stiffness = phased_series([0.1], [0.1], phases, mean=data.mesh_stiffness)
    meshes = mesh_elements(data, stiffness=stiffness, backlash=60e-6)
    plain = gear_set_problem(data, meshes=meshes, torque=PlanarTorque(15.0), damping=C)
    dampers = planar_mesh_dampers(data, 0.05)
    return errors, lambda omega: with_errors(plain, errors, dampers=dampers, mesh_frequency=omega)


def eccentricity_study(folder: Path, frequencies: int) -> None:
    """Sun eccentricity of a planetary set: mesh force over frequency, path of the sun, spectrum."""
    from femgear.report.style import save_figure
    from femgear.trains.planar.figures import orbits

    hertz = np.linspace(400.0, 3600.0, frequencies)
    curves, records, paths, spectra = [], [], [], []
    for floating in (False, True):
        for eccentricity in ECCENTRICITIES:
            if floating and eccentricity == 0.0:
                continue
            text = f"{'floating' if floating else 'held'} sun, E = {1e6 * eccentricity:.0f} µm"
            rows, path, spectrum = eccentric_response(eccentricity, floating, hertz)
            curves.append((text, *np.where(rows[2] > 0.0, rows[:2], np.nan)))
            records += [(text, *map(float, row)) for row in zip(hertz, *rows)]
            if eccentricity == max(ECCENTRICITIES):
                paths.append((text, path))
                spectra.append((text, *spectrum))
    header = ("case", "mesh frequency [Hz]", "amplitude [N]", "mean [N]", "converged")
    write_csv(folder / "eccentricity.csv", header, records)
    save_figure(force_amplitudes(1e-3 * hertz, curves), folder / "eccentricity.png")
    save_figure(orbits(paths, title=f"centre of the sun, {1e-3 * hertz[0]:.1f} kHz"), folder / "sun_path.png")
    save_figure(line_spectrum(spectra, y="force of sun-planet mesh 1 [N]"), folder / "spectrum.png")


def force_amplitudes(kilohertz, curves):
    """Figure of half the peak to peak of a mesh force: curves (text, amplitude (F,), mean (F,)) [N].

    Where it exceeds the mean force, teeth part.
    """
    from femgear.report.style import BLACK, label, legend_below, line_style, new_figure

    figure, (ax,) = new_figure(width=8.5, height=5.0)
    for number, (text, amplitude, _) in enumerate(curves):
        words = f"{text}: up to {np.nanmax(amplitude):.3g} N"
        ax.plot(kilohertz, amplitude, marker="o", markersize=4, label=words, **line_style(number))
    mean = np.nanmean([force for *_, force in curves])
    ax.axhline(mean, color=BLACK, linewidth=1.0, label=f"mean force {mean:.4g} N: above it teeth part")
    ax.set_ylim(bottom=0.0)
    label(ax, "mesh frequency [kHz]", "amplitude of the force [N]", "sun-planet mesh 1, sun eccentric by E")
    legend_below(figure, columns=2)
    return figure


def eccentric_response(eccentricity: float, floating: bool, hertz):
    """Force of mesh 1 and convergence (3, F); path of the sun, lines of the force at the first frequency."""
    from femgear.solvers.linear.receptance import reduce_problem
    from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
    from femgear.system.system import element_forces

    errors, build = eccentric_set(eccentricity, floating)
    orders, start, rows = errors.lines(mesh=3, member=3, bands=2), None, []
    theta = 2.0 * np.pi * np.stack(np.meshgrid(*[np.arange(48) / 48] * 2), axis=-1).reshape(-1, 2)
    wave = np.exp(1j * theta @ orders.T)
    for value in hertz:
        omega = 2.0 * np.pi * value
        problem = build(omega)
        solution = solve_harmonic_balance(
            problem,
            errors.frequency(omega),
            orders=orders,
            start=start,
            stability=False,
            reduction=reduce_problem(problem),
        )
        force = element_forces(problem, (wave @ solution.deflection.T).real, theta)[0][:, 0]
        rows.append((0.5 * np.ptp(force), force.mean(), float(solution.converged)))
        if start is None:
            turn = np.linspace(0.0, 1.0, 841)[:-1] * 2.0 * np.pi * errors.teeth["sun"]
            lines = displacements(problem, solution)[6:8]
            phases = np.exp(1j * turn[:, None] * (orders @ errors.frequency(1.0)))
            path = (phases @ lines.T).real.T
            spectrum = np.abs(orders @ errors.frequency(1.0)), np.abs(solution.force[0])
        start = solution if solution.converged else None
    return np.array(rows).T, path, spectrum


def line_spectrum(curves, *, y: str, x: str = "frequency / mesh frequency [1]", floor: float = 1e-4):
    """Figure of lines (text, frequency (L,), amplitude (L,)) as stems, down to a share of the largest."""
    from femgear.report.style import COLOURS, label, legend_below, new_figure

    figure, (ax,) = new_figure(width=8.5, height=4.4)
    top = max(np.max(amplitude) for _, _, amplitude in curves)
    for number, (text, frequency, amplitude) in enumerate(curves):
        shown = np.asarray(amplitude) > floor * top
        colour, at = COLOURS[number % len(COLOURS)], np.asarray(frequency)[shown]
        ax.vlines(at, floor * top, np.asarray(amplitude)[shown], color=colour, linewidth=1.4)
        ax.plot(at, np.asarray(amplitude)[shown], "osD^"[number % 4], color=colour, markersize=5, label=text)
    ax.set_yscale("log")
    ax.set_ylim(floor * top, 2.0 * top)
    label(ax, x, y)
    legend_below(figure)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
