#!/usr/bin/env python3
"""Lead crowning and end relief of the sun for a range of misalignments: least of the largest K_Hbeta."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

FILES = ("lead_design.csv", "lead_design.png", "lead.toml")
HEADER = ("design", "torque [N m]", "misalignment [m]", "K_Hbeta [1]", "STE peak to peak [m]")
RULE, BEST = "ISO 6336-1", "crowning and end relief"


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/lead_design"),
    misalignment: Annotated[tuple[float, float], Parameter(allow_leading_hyphen=True)] = (-10.0, 10.0),
    points: int = 5,
    positions: int = 8,
    slices: int = 25,
) -> None:
    """Search crowning alone and with an end relief, and map K_Hbeta and STE over misalignment and torque.

    The misalignment is a lead slope of the sun beside what the case has; the largest K_Hbeta of the
    sun-planet meshes over its range, at the torque of the case, becomes least. End reliefs take an eighth
    of the width at either end.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out. The design adds to its modifications.
    output
        Folder of the results.
    misalignment
        Ends of the range, over the face width [um].
    points
        Misalignments in the range, and torques from a quarter to one and a half times that of the case.
    positions
        Positions over one mesh period.
    slices
        Over the face width, where the case has none.
    """
    from femgear.case.gear_set import need_set
    from femgear.trains.reading import read_case, with_values

    data = read_case(case)
    need_set(data)
    low, high = misalignment
    for key, value, good, limit in (
        ("--misalignment", f"{low:g} {high:g}", -200.0 <= low < high <= 200.0, "ascending, -200 to 200 um"),
        ("--points", points, 3 <= points <= 51, "3 to 51"),
        ("--positions", positions, 3 <= positions <= 512, "3 to 512"),
    ):
        if not good:
            raise CaseError("out of range", code="E-RANGE", key=key, value=value, limit=limit)
    data = data if data.static.slices > 1 else with_values(data, {"static.slices": slices})
    folder, torque, slopes = (
        ready_folder(output, FILES),
        data.operation.torque,
        np.linspace(low, high, points),
    )
    with Progress() as progress:
        progress("compliance")
        state = in_slices(data, positions)
        progress("compliance", 1, 1)
        most = max(abs(low), abs(high))
        # largest at an end of the range, or in its middle
        ends = slopes[[0, points // 2, -1]]
        alone, both = design(lambda *lead: max(state(torque, s, *lead)[0] for s in ends), most, progress)
        designs = {"unmodified": (0.0, 0.0), RULE: (0.5 * most, 0.0), "crowning": alone, BEST: both}
        torques, maps = np.linspace(0.25, 1.5, points) * torque, {}
        for name, lead in designs.items():
            maps[name] = np.array([[state(t, s, *lead) for s in slopes] for t in torques])
            progress("map", len(maps), len(designs))
        largest = [max(state(torque, s, *lead)[0] for s in slopes) for lead in designs.values()]
    write(folder, maps, torques, slopes, both, data.set.face_width / 8)
    rows = [
        (
            name,
            *(f"{value:.2f}" for value in lead),
            f"{factor:.3f}",
            f"{1e6 * maps[name][..., 1].min():.3f} to {1e6 * maps[name][..., 1].max():.3f}",
        )
        for (name, lead), factor in zip(designs.items(), largest)
    ]
    header = "design", "crowning [um]", "end relief [um]", "largest K_Hbeta", "STE p-p over the map [um]"
    print_table(f"Largest K_Hbeta over the misalignments at {torque:g} N m", header, rows)
    print(f"ISO 6336-1, annex B: C_beta = 0.5 F_beta = {0.5 * most:.2f} um; found {alone[0]:.2f} um")
    say_files(folder, FILES)


def in_slices(case, positions: int):
    """Make the function of torque of the input [N m], slope, crowning and end relief of the sun [um].

    It gives the largest K_Hbeta of the sun-planet meshes, and the transmission error peak to peak [m].
    """
    from femgear.case.gear_set import planetary_set, set_deviations
    from femgear.contact.cycle import CycleOptions
    from femgear.gears.modifications import EndRelief, FlankForm, LeadCrowning, LeadSlope
    from femgear.run import grid_cache
    from femgear.stages.static import flank_compliances, over_width, static_supports
    from femgear.study.relief import DesignBasis, sun_torque

    gears, deviations, cache = planetary_set(case), set_deviations(case), grid_cache()
    bodies = flank_compliances(case, gears, cache=cache)[1]
    options = CycleOptions(peaks=True, **over_width(case, gears, cache=cache))
    basis = DesignBasis(gears, bodies, static_supports(case), deviations, positions, case.static.contact)
    per_input = sun_torque(case, gears, case.operation.torque) / case.operation.torque

    def state(torque, slope, crowning=0.0, relief=0.0) -> tuple[float, float]:
        a, b, c = (1e-6 * float(amount) for amount in (slope, crowning, relief))
        more = LeadSlope(a), LeadCrowning(b), EndRelief(c, case.set.face_width / 8)
        form = FlankForm((*deviations.sun.modifications, *more))
        changed = replace(basis, deviations=replace(deviations, sun=form))
        cycle = changed.walk(per_input * torque, options=options)
        assert cycle.face_load_factor is not None
        return float(cycle.face_load_factor[: gears.n_planets].max()), float(cycle.peak_to_peak("sun_arc"))

    return state


def design(largest, most: float, progress):
    """Crowning alone, and crowning with end relief [um], of the least of the largest K_Hbeta.

    The largest of several factors has kinks: Brent's and Nelder and Mead's methods need no gradient.
    """
    from scipy.optimize import minimize, minimize_scalar

    computed = {}

    def value(crowning, relief=0.0):
        if (place := (float(crowning), float(relief))) not in computed:
            computed[place] = largest(*place)
            progress("design", len(computed), 35)
        return computed[place]

    options = {"maxiter": 20, "xatol": 0.01 * most}
    best: Any = minimize_scalar(value, bounds=(0.0, 2.0 * most), method="bounded", options=options)
    simplex = [[best.x, 0.0], [0.8 * best.x, 0.0], [0.8 * best.x, 0.3 * most]]
    options = {"initial_simplex": simplex, "maxfev": 15, "xatol": 0.01 * most, "fatol": 1e-3}
    bounds = [(0.0, 2.0 * most)] * 2
    both = minimize(lambda x: value(*x), simplex[0], method="Nelder-Mead", bounds=bounds, options=options)
    return (float(best.x), 0.0), tuple(map(float, both.x))


def write(folder: Path, maps, torques, slopes, both, length: float) -> None:
    """Table and picture of the maps, and the tables for the case file."""
    from matplotlib.ticker import MaxNLocator

    from femgear.report.style import label, new_figure, save_figure
    from femgear.storage.files import write_text

    rows = (
        (name, torques[t], 1e-6 * slopes[s], *values_of_map[t, s])
        for name, values_of_map in maps.items()
        for t, s in np.ndindex(values_of_map.shape[:2])
    )
    write_csv(folder / FILES[0], HEADER, ((name, *map(float, row)) for name, *row in rows))
    shown = {name: values_of_map for name, values_of_map in maps.items() if name != "crowning"}
    figure, axes = new_figure(rows=2, columns=len(shown), width=10.5, height=6.4, sharex=True, sharey=True)
    for row, (scale, words) in enumerate(((1.0, "K_Hβ [1]"), (1e6, "STE peak to peak [µm]"))):
        values = scale * np.array([values_of_map[..., row] for values_of_map in shown.values()])
        axes_of_row, levels = axes[3 * row : 3 * row + 3], MaxNLocator(12).tick_values(values.min(), values.max())
        for ax, name, of_map in zip(axes_of_row, shown, values):
            filled = ax.contourf(slopes, torques, of_map, levels=levels, cmap="cividis")
            label(ax, "misalignment [µm]" if row else "", title="" if row else name)
        label(axes_of_row[0], y="torque [N m]")
        figure.colorbar(filled, ax=axes_of_row, label=words)
    save_figure(figure, folder / FILES[1])
    text = f'[[sun.modifications]]\nkind = "lead crowning"\namount = "{both[0]:.3f} um"\n'
    if both[1] > 0.0:
        text += f'\n[[sun.modifications]]\nkind = "end relief"\namount = "{both[1]:.3f} um"\n'
        text += f'length = "{length * 1e3:.4f} mm"\n'
    write_text(text, folder / FILES[2])


if __name__ == "__main__":
    sys.exit(run_script(main))
