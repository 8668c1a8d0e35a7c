#!/usr/bin/env python3
"""Stiffness of rolling bearings: typical sizes under load, and what clearance and preload change."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError
from femgear.findings import percent
from femgear.system.rolling_bearings import BallBearing, Bearing, RollerBearing, bearing_state, solve_motion

FILES = ("bearing_stiffness.csv", "bearing_stiffness.png")
HEADER = ("bearing", "radial load [N]", "motion [m]", "radial [N/m]", "axial [N/m]", "tilt [N m/rad]", "loaded [1]")
DEEP = BallBearing(9, 12.5e-3, 65e-3)
ANGULAR = BallBearing(
    12, 12e-3, 65e-3, contact_angle=math.radians(40.0), axial_preload=5e-6, rows=2, row_distance=19e-3
)
TAPERED = RollerBearing(
    "tapered", 20, 13e-3, 64e-3, 8e-3, contact_angle=math.radians(15.0), axial_preload=5e-6, rows=2, row_distance=21e-3
)
SPHERICAL = RollerBearing(
    "spherical", 17, 9e-3, 66e-3, 10e-3, contact_angle=math.radians(9.0), clearance=30e-6, rows=2, row_distance=-10e-3
)
# bearings on a shaft of 45 mm, a thin needle bearing beside them; none is that of a catalogue
BEARINGS: dict[str, Bearing] = {
    "deep groove ball": replace(DEEP, clearance=10e-6),
    "the same, tight": DEEP,
    "the same, loose": replace(DEEP, clearance=30e-6),
    "two angular contact rows, O": ANGULAR,
    "the same, X": replace(ANGULAR, row_distance=-19e-3),
    "cylindrical roller": RollerBearing("cylindrical", 15, 11e-3, 65.5e-3, 11e-3, clearance=20e-6),
    "needle": RollerBearing("needle", 28, 17e-3, 50e-3, 3.5e-3, clearance=20e-6),
    "two tapered rows, O": TAPERED,
    "spherical roller": SPHERICAL,
}


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/bearing_stiffness"),
    load: float = 5000.0,
    points: int = 60,
) -> None:
    """Compute radial, axial and tilting stiffness of typical bearings, and draw them over load and preload.

    Parameters
    ----------
    output
        Folder of the results.
    load
        Radial load of the table [N]; the curves end there, the preloaded rows carry a fifth of it.
    points
        Of every curve.
    """
    from femgear.report.style import save_figure

    if not 0.0 < load < math.inf or points < 5:
        raise CaseError(f"{load} N, {points} points", code="E-RANGE", limit="a load above 0 N, 5 points or more")
    folder = ready_folder(output, FILES)
    rows = [(name, *stiffness_row(bearing, load)) for name, bearing in BEARINGS.items()]
    write_csv(folder / "bearing_stiffness.csv", HEADER, rows)
    save_figure(_figure(load, points), folder / "bearing_stiffness.png")
    header = ("bearing", "motion [µm]", "radial [N/µm]", "axial [N/µm]", "tilt [kN m/rad]", "loaded")
    print_table(f"Under a radial load of {load:g} N", header, [(row[0], *shown(row[1:])) for row in rows])
    say_files(folder, FILES)


def stiffness_row(bearing: Bearing, load: float) -> tuple[float, ...]:
    """Load, motion, radial, axial and tilting stiffness, and share of the elements that carry."""
    state = solve_motion(bearing, (load, 0.0, 0.0, 0.0, 0.0, 0.0))
    slopes = np.diag(state.stiffness)
    # the tilt about y lies in the plane of the load
    return load, state.motion[0], slopes[0], slopes[2], slopes[4], float((state.load > 0.0).mean())


def shown(row: tuple[float, ...]) -> list[str]:
    """Texts of a row as the page has them: motion, three stiffnesses and the elements that carry."""
    _, motion, radial, axial, tilt, share = row
    return [
        f"{1e6 * motion:.1f}",
        *(f"{1e-6 * value:.0f}" for value in (radial, axial)),
        f"{1e-3 * tilt:.1f}",
        percent(share),
    ]


def _figure(load: float, points: int):
    from femgear.report.style import COLOURS, DASHES, label, legend_below, new_figure

    figure, (left, right) = new_figure(columns=2, height=4.0)
    loads, small = np.linspace(0.002, 1.0, points) * load, 0.2 * load
    for clearance, colour, dash in zip((-6e-6, 0.0, 10e-6, 30e-6), COLOURS, DASHES):
        bearing = replace(DEEP, clearance=clearance)
        ways = [stiffness_row(bearing, force)[1] for force in loads]
        text = f"clearance {1e6 * clearance:.0f} µm".replace("-", "\N{MINUS SIGN}")
        left.plot(1e-3 * loads, 1e6 * np.array(ways), dash, color=colour, label=text)
    label(left, "radial load [kN]", "radial motion [µm]", "Deep groove ball bearing")
    left.set_ylim(bottom=0.0)
    preloads = np.linspace(-10e-6, 20e-6, points)
    slopes = np.array([stiffness_row(replace(ANGULAR, axial_preload=way), small)[2:4] for way in preloads])
    for number, text in enumerate(("radial", "axial")):
        style = {"color": COLOURS[4 + number], "linestyle": DASHES[number]}
        right.plot(1e6 * preloads, 1e-6 * slopes[:, number], label=text, **style)
    unloaded = [preload_force(replace(ANGULAR, axial_preload=way)) for way in preloads]
    other = right.twinx()
    other.plot(1e6 * preloads, 1e-3 * np.array(unloaded), ":", color="0.4", label="preload [kN]")
    other.set_ylim(bottom=0.0)
    label(other, y="preload [kN]")
    label(right, "preload of each row [µm]", "stiffness [N/µm]", f"Two angular contact rows, {1e-3 * small:g} kN")
    right.set_ylim(bottom=0.0)
    legend_below(figure, columns=4)
    return figure


def preload_force(bearing: BallBearing) -> float:
    """Force along the axis [N] that two rows press against each other with, without load."""
    state = bearing_state(bearing, np.zeros(6))
    return float((state.load[0] * np.sin(state.angle[0])).sum())


if __name__ == "__main__":
    sys.exit(run_script(main))
