#!/usr/bin/env python3
"""The figures of docs/impacts.md: errors and damping over frequency, impacts, chaos, a floating sun."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

DAMPING, ERRORS, ECCENTRICITIES = (0.15, 0.09), (0.36, 0.54, 0.72), (0.0, 5e-6, 15e-6)
STUDIES = ("damping", "errors", "states", "chaos", "eccentricity")


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
            f"{frequencies} frequencies", code="E-RANGE",
            limit=f"{', '.join(STUDIES)}; 1 harmonic, 3 ratios, 8 points, 2 frequencies or more",
        )  # fmt: skip
    folder, names = ready_folder(output), []
    with Progress() as progress:
        for name in dict.fromkeys(study):
            progress(name)
            if name == "damping":
                names += damping_study(folder, harmonics)
            elif name == "errors":
                names += error_study(folder, harmonics)
            elif name == "states":
                names += state_study(folder, harmonics, ratios)
            elif name == "chaos":
                names += chaos_study(folder, ratios, points)
            else:
                names += eccentricity_study(folder, frequencies)
            progress(name, 1)
    say_files(folder, names)


def follow(pair, harmonics: int):
    """Branch of a pair from ratio 3.5 to 0.1, with amplitude, mean, smallest and largest deflection."""
    from femgear.solvers.continuation.arclength import StepOptions
    from femgear.solvers.continuation.branches import parameter_curve

    branch = parameter_curve(
        pair.problem, (3.5, 0.1), 1.0, harmonics=harmonics, samples=1024, radius=False,
        options=StepOptions(largest=0.02),
    )  # fmt: skip
    phase = 2.0 * np.pi * np.arange(512) / 512
    x = np.array([solution.at(phase)[:, 0] for solution in branch.solutions])
    low, high = x.min(axis=1), x.max(axis=1)
    return branch, 0.5 * (high - low), branch.lines[:, 0, 0].real, low, high


def damping_study(folder: Path, harmonics: int) -> list[str]:
    """Amplitude and mean for two damping ratios."""
    from femgear.trains.gear_pair.model import BACK, DRIVE, example_pair, impact_borders

    curves, rows = [], []
    for zeta in DAMPING:
        branch, size, mean, *_ = follow(example_pair(zeta), harmonics)
        curves.append((f"ζ = {zeta}", branch.parameter, size, mean, branch.stable))
        folds = ", ".join(f"{r:.4f}" for r in np.sort(branch.parameter[branch.folds]))
        borders = [
            ", ".join(f"{r:.3f}" for r in np.sort(impact_borders(example_pair(zeta), branch, level)))
            for level in (DRIVE, BACK)
        ]
        rows.append((f"{zeta}", f"{size.max():.3f}", folds or "none", *(b or "none" for b in borders)))
    header = ("damping ratio", "largest amplitude", "limit points", "x = 1 at", "x = -1 at")
    print_table("Load 0.9, tooth error 0.72, k(t) 10 %", header, rows)
    return _drawn(folder, "damping", curves, "load 0.9, tooth error 0.72, k(t) 10 %")


def error_study(folder: Path, harmonics: int) -> list[str]:
    """Amplitude and mean for several tooth-frequency errors."""
    from dataclasses import replace

    from femgear.trains.gear_pair.model import example_pair

    curves = []
    for error in ERRORS:
        pair = replace(example_pair(0.09), tooth_error=(error,))
        branch, size, mean, _, _ = follow(pair, harmonics)
        curves.append((f"error {error}", branch.parameter, size, mean, branch.stable))
    return _drawn(folder, "tooth_error", curves, "load 0.9, ζ = 0.09, k(t) 10 %")


def _drawn(folder: Path, name: str, curves, title: str) -> list[str]:
    """Picture and table of curves over the frequency ratio."""
    from femgear.report.style import save_figure
    from femgear.trains.gear_pair.figures import amplitude_and_mean

    records = [
        (text, float(r), float(a), float(m), int(s))
        for text, *columns in curves
        for r, a, m, s in zip(*columns)
    ]
    header = ("curve", "frequency ratio [1]", "amplitude [b]", "mean [b]", "stable")
    write_csv(folder / f"{name}.csv", header, records)
    save_figure(amplitude_and_mean(curves, title=title), folder / f"{name}.png")
    return [f"{name}.csv", f"{name}.png"]


def state_study(folder: Path, harmonics: int, ratios: int) -> list[str]:
    """Contact states by harmonic balance and by sweeps up and down."""
    from femgear.report.style import save_figure
    from femgear.solvers.time.stroboscopic import sweep_up_and_down
    from femgear.trains.gear_pair.figures import state_bands
    from femgear.trains.gear_pair.model import (
        BACK,
        DRIVE,
        STATE_NAMES,
        example_pair,
        range_states,
        state_regions,
    )

    pair, flanks = example_pair(0.09), {"drive": DRIVE, "back": BACK}
    branch, _, _, low, high = follow(pair, harmonics)
    state, cuts = range_states(low, high, **flanks), [0, *branch.folds, len(low) - 1]
    pieces = [slice(a, b + 1) for a, b in pairwise(cuts)]
    names = ["upper branch", "between the limit points, unstable", "lower branch"]
    if len(pieces) != len(names):
        names = [f"piece {number + 1}" for number in range(len(pieces))]
    rows = [(f"balance: {name}", branch.parameter[part], state[part]) for name, part in zip(names, pieces)]
    grid = np.concatenate(
        [np.linspace(0.6, 1.0, max(3, ratios // 2)), np.linspace(1.05, 3.5, max(3, ratios // 2))]
    )
    sweeps = sweep_up_and_down(lambda r: (pair.problem(r), 1.0), grid, steps=100, most=300)
    for name, sweep in zip(("up", "down"), sweeps):
        found = range_states(sweep.lowest[:, 0], sweep.highest[:, 0], **flanks)
        rows.append((f"integration: sweep {name}", sweep.frequency, found))
    table = [
        (text, STATE_NAMES[number], f"{min(ends):.3f}", f"{max(ends):.3f}")
        for text, ratio, states in rows
        for number, *ends in state_regions(ratio, states)
    ]
    print_table("Contact states, ζ = 0.09", ("", "state", "from ratio", "to ratio"), table)
    write_csv(folder / "contact_states.csv", ("route", "state", "from ratio [1]", "to ratio [1]"), table)
    save_figure(state_bands(rows, STATE_NAMES), folder / "contact_states.png")
    return ["contact_states.csv", "contact_states.png"]


def chaos_study(folder: Path, ratios: int, points: int) -> list[str]:
    """Bifurcation diagram, exponents and sections of the lightly loaded pair."""
    from femgear.report.style import save_figure
    from femgear.solvers.stability.lyapunov import lyapunov_exponents
    from femgear.trains.gear_pair.figures import bifurcation_and_exponent, phase_sections
    from femgear.trains.gear_pair.model import lightly_loaded_pair

    pair, start, found = lightly_loaded_pair(), None, []
    grid = np.linspace(1.0, 2.2, ratios)
    for ratio in grid:
        options = {"points": points, "skip": 60, "steps": 100, "start": start}
        found.append(lyapunov_exponents(pair.problem(ratio), 1.0, **options))
        start = found[-1].section.displacement[-1], found[-1].section.velocity[-1]
    # exponents per theta; times the ratio per 1 / omega_n
    exponent, error = (grid * [getattr(one, name)[0] for one in found] for name in ("exponents", "error"))
    low, high = (np.array([getattr(one, name)[0] for one in found]) for name in ("lowest", "highest"))
    repeats = [one.section.repeats_after(1e-3) for one in found]
    words = [{True: "yes", False: "no", None: "not told"}[one.chaotic] for one in found]
    header = ("frequency ratio [1]", "largest exponent [omega_n]", "error [omega_n]", "smallest x [b]",
              "largest x [b]", "repeats after periods", "chaotic")  # fmt: skip
    records = zip(*(column.tolist() for column in (grid, exponent, error, low, high)), repeats, words)
    write_csv(folder / "chaos.csv", header, records)
    shown = np.array([one.section.deflection[-min(points, 80) :, 0] for one in found])
    figure = bifurcation_and_exponent(grid, shown, exponent, error, lowest=low, highest=high)
    save_figure(figure, folder / "chaos.png")
    panels = []
    for wanted in (1.0, 1.5, 2.2):
        ratio, start = float(grid[np.argmin(np.abs(grid - wanted))]), found[np.argmin(np.abs(grid - wanted))]
        once = lyapunov_exponents(
            pair.problem(ratio), 1.0, points=8 * points, skip=100, steps=100,
            start=(start.section.displacement[-1], start.section.velocity[-1]),
        )  # fmt: skip
        title = f"Ω = {ratio:.2f}, λ = {ratio * once.largest:.3f} ± {ratio * once.error[0]:.3f}"
        panels.append((title, once.section.deflection[:, 0], ratio * once.section.velocity[:, 0]))
    save_figure(phase_sections(panels, y="velocity [b $\\omega_n$]"), folder / "sections.png")
    chaotic = grid[[one.chaotic is True for one in found]]
    ends = [f"{r:.2f}" for r in chaotic[[0, -1]]] if len(chaotic) else ["none", "none"]
    print_table(
        "Lightly loaded pair", ("ratios", "chaotic: exponent clearly positive, no repetition", "from", "to",
                                "not told", "smallest x"),
        [(str(len(grid)), str(len(chaotic)), *ends, str(words.count("not told")), f"{low.min():.3f}")],
    )  # fmt: skip
    return ["chaos.csv", "chaos.png", "sections.png"]


def eccentric_set(eccentricity: float, floating: bool):
    """Lin and Parker's set of three planets with an eccentric sun and a tooth error: errors and problem."""
    from dataclasses import replace

    from published.planetary_sets import lin_parker_set

    from femgear.system.assembler import mesh_elements
    from femgear.system.rigid_bodies import PlanarTorque
    from femgear.system.transmission_errors import (
        Eccentricity,
        TransmissionErrors,
        equivalent_damping,
        planar_mesh_dampers,
        tooth_lines,
        with_errors,
    )
    from femgear.trains.planar.model import phased_series, planar_problem

    data = lin_parker_set(3)
    data = replace(data, sun=replace(data.sun, support=1e6 if floating else 1e9))
    phases = np.array([0, 1 / 3, 2 / 3, 0.15, 0.15 + 1 / 3, 0.15 + 2 / 3])
    errors = TransmissionErrors(
        data=data, teeth={"sun": 28, "planet": 36, "ring": 101}, sun=Eccentricity(eccentricity),
        tooth=tooth_lines([0.2e-6], [0.2e-6], phases),
    )  # fmt: skip
    C = equivalent_damping(data, mesh_ratio=0.05, support_ratio=0.03)
    stiffness = phased_series([0.1], [0.1], phases, mean=data.mesh_stiffness)
    meshes = mesh_elements(data, stiffness=stiffness, backlash=60e-6)
    plain = planar_problem(data, meshes=meshes, torque=PlanarTorque(15.0), damping=C)
    dampers = planar_mesh_dampers(data, 0.05)
    return errors, lambda omega: with_errors(plain, errors, dampers=dampers, mesh_frequency=omega)


def eccentricity_study(folder: Path, frequencies: int) -> list[str]:
    """Sun eccentricity of a planetary set: mesh force over frequency, path of the sun, spectrum."""
    from femgear.report.style import save_figure
    from femgear.trains.gear_pair.figures import amplitude_and_mean, line_spectrum
    from femgear.trains.planar.figures import orbits

    hertz = np.linspace(400.0, 3600.0, frequencies)
    curves, records, paths, spectra = [], [], [], []
    for floating in (False, True):
        for eccentricity in ECCENTRICITIES:
            if floating and eccentricity == 0.0:
                continue
            text = f"{'floating' if floating else 'held'} sun, E = {1e6 * eccentricity:.0f} µm"
            rows, path, spectrum = eccentric_response(eccentricity, floating, hertz)
            curves.append(
                (text, 1e-3 * hertz, *np.where(rows[2] > 0.0, rows[:2], np.nan), np.ones(len(hertz)))
            )
            records += [(text, *map(float, row)) for row in zip(hertz, *rows)]
            if eccentricity == max(ECCENTRICITIES):
                paths.append((text, path))
                spectra.append((text, *spectrum))
    header = ("case", "mesh frequency [Hz]", "amplitude [N]", "mean [N]", "converged")
    write_csv(folder / "eccentricity.csv", header, records)
    figure = amplitude_and_mean(
        curves, x="mesh frequency [kHz]", unit="N", title="force of sun-planet mesh 1"
    )
    save_figure(figure, folder / "eccentricity.png")
    save_figure(orbits(paths, title=f"centre of the sun, {1e-3 * hertz[0]:.1f} kHz"), folder / "sun_path.png")
    save_figure(line_spectrum(spectra, y="force of sun-planet mesh 1 [N]"), folder / "spectrum.png")
    return ["eccentricity.csv", "eccentricity.png", "sun_path.png", "spectrum.png"]


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
        found = solve_harmonic_balance(
            problem, errors.frequency(omega), orders=orders, start=start, stability=False,
            reduction=reduce_problem(problem),
        )  # fmt: skip
        force = element_forces(problem, (wave @ found.deflection.T).real, theta)[0][:, 0]
        rows.append((0.5 * np.ptp(force), force.mean(), float(found.converged)))
        if start is None:
            turn = np.linspace(0.0, 1.0, 841)[:-1] * 2.0 * np.pi * errors.teeth["sun"]
            lines = displacements(problem, found)[6:8]
            phases = np.exp(1j * turn[:, None] * (orders @ errors.frequency(1.0)))
            path = (phases @ lines.T).real.T
            spectrum = np.abs(orders @ errors.frequency(1.0)), np.abs(found.force[0])
        start = found if found.converged else None
    return np.array(rows).T, path, spectrum


if __name__ == "__main__":
    sys.exit(run_script(main))
