#!/usr/bin/env python3
"""Wind turbine set A: ring resonance and tooth wedging over the clearance of the carrier bearing."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

FILES = ("ring_resonance.csv", "tooth_contact.csv", "ring_resonance.png", "tooth_contact.png")


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/bearing_clearance"),
    clearance: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (
        "0 um",
        "100 um",
        "400 um",
    ),
    harmonics: int = 5,
    backlash: str = "150 um",
    frequencies: int = 8,
    points: int = 25,
) -> None:
    """Resonance curves of the ring of set A (NREL/CP-5000-55355) and maps of the tooth contact.

    Parameters
    ----------
    output
        Folder of the results.
    clearance
        Radial clearance of the bearing between carrier and ring with its unit; may be repeated.
    harmonics
        Of the weight's frequency.
    backlash
        Total play along the line of action, for the maps; the paper does not print that of set A.
    frequencies, points
        Number of frequencies and clearances of the maps.
    """
    from published.wind_turbine_figures import response_branches
    from published.wind_turbine_response import wedging_map

    from femgear.case.quantities import LENGTH, to_si
    from femgear.report.style import save_figure

    plays, play = [to_si(text, LENGTH) for text in clearance], to_si(backlash, LENGTH)
    if min(plays, default=0.0) < 0.0 or play <= 0.0 or harmonics < 1 or min(frequencies, points) < 2:
        raise CaseError(
            f"clearances {plays} m, play {play} m, {harmonics} harmonics",
            code="E-RANGE",
            limit="clearances of 0 or more, play above 0, two frequencies and points or more",
        )
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        curves = []
        for text, play_given in (*zip(clearance, plays), ("no bearing", None)):
            progress(f"resonance, {text}")
            curves.append(_resonance(text, play_given, harmonics))
            progress(f"resonance, {text}", 1)
        progress("contact maps")
        wedging = wedging_map(np.linspace(0.5, 15.0, frequencies), np.linspace(0.6, 1.8, points) * play, backlash=play)
        progress("contact maps", 1)
    save_figure(_map_figure(wedging, play), folder / "tooth_contact.png")
    # stability is not asked for here
    drawn = [(text.replace(" um", " µm"), hertz, rms, np.ones(len(rms), int)) for text, hertz, rms, _ in curves]
    save_figure(response_branches(drawn, quantity="ring x, r.m.s."), folder / "ring_resonance.png")
    rows = [(text, float(f), float(r)) for text, hertz, rms, _ in curves for f, r in zip(hertz, rms)]
    write_csv(folder / "ring_resonance.csv", ("clearance", "frequency [Hz]", "ring x r.m.s. [m]"), rows)
    write_csv(folder / "tooth_contact.csv", MAP_HEADER, _map_records(wedging))
    _print(curves, wedging, play)
    say_files(folder, FILES)


MAP_HEADER = ("frequency [Hz]", "clearance [m]", "drive flanks in contact [1]", "back flanks in contact [1]")


def _resonance(text, clearance, harmonics):
    from published.wind_turbine import bearing_problem_a
    from published.wind_turbine_response import member_rms, resonance, weight_branch

    problem = bearing_problem_a(clearance)
    branch = weight_branch(problem, (10.0, 180.0), harmonics=harmonics, largest=0.03)
    rms = member_rms(problem, branch.solutions, "ring")[:, 0]
    return (
        f"clearance {text}" if clearance is not None else text,
        branch.parameter / (2.0 * np.pi),
        rms,
        (
            *resonance(branch, rms),
            branch.message,
        ),
    )


def _map_records(contact):
    for i, f in enumerate(contact.frequency):
        for j, c in enumerate(contact.clearance):
            yield float(f), float(c), float(contact.drive[i, j].mean()), float(contact.back[i, j].mean())


def _map_figure(contact, play):
    from published.wind_turbine import wind_turbine_a
    from published.wind_turbine_figures import contact_map

    rigid = 0.5 * play / np.sin(wind_turbine_a().pressure_angle_sun_planet)
    panels = [("drive flanks", contact.drive.mean(axis=2)), ("back flanks", contact.back.mean(axis=2))]
    return contact_map(contact.frequency, contact.clearance, panels, line=("play / (2 sin alpha)", rigid))


def _print(curves, contact, play):
    from published.wind_turbine_response import wedging_onset

    rows = [(text, f"{hertz:.2f}", f"{1e6 * size:.1f}", end) for text, _, _, (hertz, size, end) in curves]
    header = ("bearing", "ring resonance [Hz]", "ring x r.m.s. [um]", "end of the branch")
    print_table("Resonance of the ring", header, rows)
    missing = np.isnan(contact.back[..., 0])
    if missing.any():
        print(f"{np.count_nonzero(missing)} of {missing.size} cells of the maps not converged: grey, left out")
    onset = wedging_onset(contact)
    # an onset is one where the clearance below it is known not to touch
    sure = [
        i
        for i, value in enumerate(onset)
        if np.isfinite(value) and not missing[i, : np.searchsorted(contact.clearance, value)].any()
    ]
    for i in np.setdiff1d(np.flatnonzero(np.isfinite(onset)), sure):
        print(f"at {contact.frequency[i]:.3g} Hz where back flanks begin to touch is not known")
    ratio, step = np.unique(np.round(onset[sure] / play, 6)), np.diff(contact.clearance)[0] / play
    if len(ratio):
        text = ", ".join(f"{value:.3g}" for value in ratio)
        note = f"(steps of {step:.3g}, {len(sure)} frequencies)"
        print(f"back flanks touch from clearance / play = {text} {note}")


if __name__ == "__main__":
    sys.exit(run_script(main))
