#!/usr/bin/env python3
"""Wind turbine set B under its weight: tooth wedging bends the resonance of the carrier to the right."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

FLANKS = ("sun-planet 1, drive", "planet 1-ring, drive", "sun-planet 1, back", "planet 1-ring, back")
PICTURES = ("gravity_wedging.png", "carrier_orbit.png", "planet_bearings.png", "tooth_contact.png")


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/gravity_wedging"),
    backlash: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (
        "482 um",
        "321 um",
        "161 um",
    ),
    harmonics: int = 9,
    lowest: float = 25.0,
    highest: float = 90.0,
    driven: bool = True,
    stability: bool = True,
    sweep: int = 0,
    steps: int = 1000,
) -> None:
    """Follow the periodic response of set B (NREL/CP-5000-55355) over the weight's frequency.

    Parameters
    ----------
    output
        Folder of the results.
    backlash
        Total play along the line of action with its unit; may be repeated.
    harmonics
        Of the weight's frequency.
    lowest, highest
        Range of frequencies [Hz].
    driven
        The torque drives the carrier, as in a turbine; otherwise it acts against its turning.
    stability
        Floquet multipliers at every point; branches are dashed where they are not stable.
    sweep
        Frequencies of a time integration upwards and downwards with the first play, compared with the branch
        in sweeps.csv; 0 leaves it out.
    steps
        Of the integration, a period.
    """
    from published.wind_turbine import gravity_problem_b
    from published.wind_turbine_figures import response_branches

    from femgear.case.quantities import LENGTH, to_si
    from femgear.report.style import save_figure

    plays = [to_si(text, LENGTH) for text in backlash]
    if not 0.0 < lowest < highest < np.inf or harmonics < 1 or sweep < 0 or min(plays, default=0.0) <= 0.0:
        raise CaseError(
            f"{harmonics} harmonics from {lowest} to {highest} Hz, play {min(plays, default=0.0)} m",
            code="E-RANGE",
            limit="one harmonic or more, 0 < lowest < highest, play above 0",
        )
    names = ["branches.csv", *PICTURES, *(["sweeps.csv"] if sweep else [])]
    folder, results = ready_folder(output, names), []
    with Progress() as progress:
        for text, play in zip(backlash, plays):
            progress(f"play {text}")
            problem = gravity_problem_b(backlash=play, driven=driven)
            results.append((text, problem, *_follow(problem, (lowest, highest), harmonics, stability)))
            progress(f"play {text}", 1)
        sweeps, compared = [], []
        if sweep:
            progress("integration")
            sweeps, compared = _sweeps(results[0], np.linspace(lowest, highest, sweep), steps)
            progress("integration", 1)
    write_csv(folder / "branches.csv", HEADER, _records(results))
    curves = [(_play(text), hertz, rms, stable) for text, _, _, hertz, rms, stable in results]
    figure = response_branches(curves, sweeps, quantity="carrier x, r.m.s.")
    save_figure(figure, folder / "gravity_wedging.png")
    _details(folder, results[0])
    if sweep:
        write_csv(folder / "sweeps.csv", SWEEP_HEADER, compared)
    _print(results)
    _print_sweeps(compared)
    say_files(folder, names)


HEADER = ("play", "point", "frequency [Hz]", "carrier x r.m.s. [m]", "stable")


def _follow(problem, limits, harmonics, stability):
    from published.wind_turbine_response import member_rms, weight_branch

    branch = weight_branch(problem, limits, harmonics=harmonics, stability=stability)
    rms = member_rms(problem, branch.solutions, "carrier")[:, 0]
    # 1 stable, 0 not, -1 not known
    verdicts_stable = [verdict.stable for verdict in branch.verdicts] if stability else [None] * len(rms)
    stable = np.array([-1 if sure is None else int(sure) for sure in verdicts_stable])
    return branch, branch.parameter / (2.0 * np.pi), rms, stable


SWEEP_HEADER = (
    "direction",
    "frequency [Hz]",
    "integration, carrier x r.m.s. [m]",
    "settled",
    "harmonic balance, carrier x r.m.s. [m]",
)


def _sweeps(result, hertz, steps):
    """Curves of the integration, and rows with the branch's solution nearest to each motion."""
    from published.wind_turbine_response import sweep_rms

    from femgear.solvers.time.stroboscopic import sweep_up_and_down

    problem = result[1]
    sweeps = sweep_up_and_down(problem, 2.0 * np.pi * hertz, steps=steps, most=100, tolerance=1e-4)
    curves, rows = [], []
    for text, sweep in zip(("upwards", "downwards"), sweeps):
        rms = sweep_rms(problem, sweep, steps=steps)
        curves.append((f"integration {text}", sweep.frequency / (2.0 * np.pi), rms))
        for omega, size, settled in zip(sweep.frequency, rms, sweep.settled):
            near = _beside(result, omega, size)
            rows.append((text, float(omega / (2.0 * np.pi)), float(size), "yes" if settled else "no", near))
    return curves, rows


def _beside(result, omega: float, size: float) -> float:
    """Carrier x r.m.s. [m] of harmonic balance from the branch point nearest to a motion; nan without one."""
    from published.wind_turbine import drive_reduction
    from published.wind_turbine_response import member_rms

    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance

    _, problem, branch, _, rms, _ = result
    away = np.abs(branch.parameter - omega) / np.ptp(branch.parameter) + np.abs(rms - size) / rms.max()
    start = branch.solutions[int(np.argmin(away))]
    solution = solve_harmonic_balance(
        problem, omega, orders=branch.orders, start=start, reduction=drive_reduction(problem), stability=False
    )
    return float(member_rms(problem, [solution], "carrier")[0, 0]) if solution.converged else float("nan")


def _print_sweeps(rows):
    shown = [
        (
            text,
            f"{hertz:.2f}",
            f"{1e6 * size:.2f}",
            settled,
            f"{1e6 * near:.2f}",
            f"{100 * (near / size - 1):+.2f}",
        )
        for text, hertz, size, settled, near in rows
    ]
    header = ("sweep", "frequency [Hz]", "integration [um]", "settled", "balance [um]", "difference [%]")
    if shown:
        print_table("Integration beside harmonic balance, carrier x r.m.s.", header, shown)


def _details(folder, result) -> None:
    """Orbits, planet bearing forces at the peak and contact along the branch, of the first play."""
    from published.wind_turbine_figures import contact_over_frequency
    from published.wind_turbine_response import bearing_history, contact_shares, member_lines

    from femgear.report.style import save_figure
    from femgear.trains.planar.figures import bearing_forces, orbits

    text, problem, branch, hertz, rms, _ = result
    top, phase = int(np.argmax(rms)), np.linspace(0.0, 2.0 * np.pi, 361)
    wave = np.exp(1j * np.arange(branch.orders[-1, 0] + 1)[:, None] * phase)
    path = (member_lines(problem, [branch.solutions[top]], "carrier")[0] @ wave).real
    title = f"{_play(text)}, {hertz[top]:.1f} Hz"
    save_figure(orbits([("carrier", path)], title=title), folder / "carrier_orbit.png")
    forces = bearing_history(problem, branch.solutions[top], phase)
    curves = [(f"planet {n + 1}", force) for n, force in enumerate(forces)]
    save_figure(bearing_forces(phase, curves, title=title), folder / "planet_bearings.png")
    shares = np.array([contact_shares(problem, solution)[[0, 3, 6, 9]] for solution in branch.solutions])
    figure = contact_over_frequency(hertz, shares, FLANKS, title=_play(text))
    save_figure(figure, folder / "tooth_contact.png")


def _play(text: str) -> str:
    """A play as figures write it."""
    return f"play {text.replace('um', 'µm')}"


def _records(results):
    for text, _, branch, hertz, rms, stable in results:
        computed = len(branch.verdicts) > 0
        for number, (f, size, sure) in enumerate(zip(hertz, rms, stable)):
            yield text, number, float(f), float(size), ("yes" if sure else "no") if computed else "not computed"


def _print(results):
    rows = []
    for text, _, branch, hertz, rms, _ in results:
        top, folds = int(np.argmax(rms)), ", ".join(f"{hertz[i]:.2f}" for i in branch.folds)
        rows.append((text, f"{hertz[top]:.2f}", f"{1e6 * rms[top]:.1f}", folds or "none", branch.message))
    header = ("play", "peak at [Hz]", "carrier x r.m.s. [um]", "folds [Hz]", "end of the branch")
    print_table("Response to the weight", header, rows)
    for text, _, branch, hertz, _, _ in results:
        for i in branch.folds if branch.verdicts else ():
            # one multiplier is 1 at a limit point of the motion itself: the rest is truncation
            miss = np.abs(branch.verdicts[i].multipliers - 1.0).min()
            print(f"play {text}: a multiplier lies {miss:.2g} from 1 at the fold at {hertz[i]:.2f} Hz")


if __name__ == "__main__":
    sys.exit(run_script(main))
