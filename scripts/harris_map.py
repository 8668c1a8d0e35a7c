#!/usr/bin/env python3
"""Harris map: transmission error peak to peak over torque for several tip reliefs of sun and planets."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

FILES = ("harris_map.csv", "harris_map.png")
KINDS = ("sun-planet", "planet-ring")


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/harris_map"),
    relief: Annotated[tuple[str, ...], Parameter(negative="")] = ("0 um", "2 um", "4 um", "6 um", "8 um"),
    length: float = 1.0,
    torque: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    positions: int | None = None,
) -> None:
    """Compute the transmission error over torque for each tip relief: a table, a picture and a CSV file.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out. The reliefs add to its modifications.
    output
        Folder of the results.
    relief
        Linear tip relief of sun and planets (sun side) with its unit, such as "4 um"; may be repeated.
    length
        Of the reliefs, in lengths of two-pair contact: 1 starts at the ends of single-pair contact.
    torque
        Torque of the input with its unit; may be repeated. Default: 11 from a tenth to twice the case's.
    positions
        Positions over one mesh period. Default: those of the case, as ``femgear run`` has them.
    """
    from femgear.case.gear_set import planetary_set
    from femgear.case.quantities import LENGTH, TORQUE, to_si
    from femgear.report.style import family, save_figure
    from femgear.run import grid_cache
    from femgear.study.relief import (
        design_basis,
        harris_map,
        loads_back,
        relief_starts,
        sun_torque,
        with_tip_relief,
    )
    from femgear.trains.reading import read_case

    data = read_case(case)
    gears = planetary_set(data)
    positions = data.static.positions if positions is None else positions
    if not 4 <= positions <= 2048:
        raise CaseError("too few or too many positions", code="E-RANGE", key="--positions", value=positions)
    amounts = [_checked(to_si(text, LENGTH), text, data.module) for text in relief]
    relief_starts(gears, length=length)
    # a torque given twice is one point of the curves
    given = list(dict.fromkeys(to_si(text, TORQUE) for text in torque))
    inputs = np.array(given or data.operation.torque * np.append(0.1, np.linspace(0.2, 2.0, 10)))
    on_sun = [sun_torque(data, gears, float(value)) for value in inputs]
    back = loads_back(np.array(on_sun))
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        progress("compliance", 0, 1)
        basis = replace(design_basis(data, cache=grid_cache()), positions=positions)
        progress("compliance", 1, 1)
        options = {"length": length, "back": back}
        variants = [with_tip_relief(basis.deviations, gears, amount=a, **options) for a in amounts]
        found = harris_map(basis, torques=on_sun, deviations=variants, progress=progress)
    kinds = tuple(dict.fromkeys(map(family, gears.mesh_names)))
    columns = [f"{kind} STE peak to peak [m]" for kind in (*kinds, "sun-ring")[: 2 * len(kinds) - 1]]
    header = ("relief [m]", "torque [N m]", *columns)
    write_csv(folder / "harris_map.csv", header, _records(amounts, inputs, found))
    names = [f"relief {a * 1e6:g} µm" for a in amounts]
    figure = harris_curves(inputs, found.peak_to_peak, names, design=data.operation.torque, kinds=kinds)
    save_figure(figure, folder / "harris_map.png")
    _print_summary(amounts, inputs, found, kinds[0])
    print(f"largest residual of all contact problems: {found.residual:.1e}")
    say_files(folder, FILES)


def _checked(amount: float, text: str, module: float) -> float:
    if not 0 <= amount <= 0.2 * module:
        limit = f"0 to 0.2 modules, {0.2e6 * module:.6g} um"
        raise CaseError("not a plausible relief", code="E-RANGE", key="--relief", value=text, limit=limit)
    return amount


def _records(amounts, inputs, found):
    for v, amount in enumerate(amounts):
        for t, torque in enumerate(inputs):
            yield (
                float(amount),
                float(torque),
                *(float(x) for x in found.peak_to_peak[v, :, t]),
                *[float(found.overall[v, t])][: found.peak_to_peak.shape[1] - 1],
            )


def _print_summary(amounts, inputs, found, kind):
    title = f"Transmission error of the {kind} meshes, peak to peak"
    curves = found.peak_to_peak[:, 0] * 1e6
    names = [f"{amount * 1e6:g}" for amount in amounts]
    if len(inputs) == 1:
        # no torque is the best of one
        rows = [(name, f"{curve[0]:.3f}") for name, curve in zip(names, curves)]
        print_table(title, ("relief [um]", f"STE p-p at {inputs[0]:g} N m [um]"), rows)
        return
    rows = []
    for name, curve in zip(names, curves):
        lowest = int(curve.argmin())
        ends = (f"{curve[0]:.3f}", f"{curve[-1]:.3f}")
        rows.append((name, f"{inputs[lowest]:g}", f"{curve[lowest]:.3f}", *ends))
    ends = (f"at {inputs[0]:g} N m", f"at {inputs[-1]:g} N m")
    print_table(title, ("relief [um]", "least at [N m]", "STE p-p there [um]", *ends), rows)


def harris_curves(torques, peak_to_peak, names, *, design: float | None = None, kinds=KINDS):
    """Transmission error peak to peak over torque, one curve a relief.

    Parameters
    ----------
    torques : (T,) array
        Of the input [N m].
    peak_to_peak : (variants, kinds, T) array
        Of the kinds of mesh [m].
    names : sequence of str
        Legend text of each variant.
    design : float, optional
        Torque to be marked [N m].
    """
    from femgear.report.style import BLACK, label, legend_below, line_style, new_figure

    figure, axes = new_figure(columns=len(kinds), width=5.0 * len(kinds), height=4.6, sharex=True)
    # one torque is no line
    marker = {"marker": "o"} if len(torques) == 1 else {}
    for kind, ax in enumerate(axes):
        curves = 1e6 * peak_to_peak[:, kind]
        # a relief of the sun side hardly changes the other meshes
        if len(curves) > 1 and np.ptp(curves, axis=0).max() < 0.01 * curves.max():
            ax.plot(torques, curves[0], label="all reliefs (within 1 %)", color=BLACK, **marker)
        else:
            for v, name in enumerate(names):
                ax.plot(torques, curves[v], label=name, **line_style(v), **marker)
        if design is not None:
            ax.axvline(design, color="0.5", linewidth=1.0, label=f"{design:g} N m")
        ax.set_ylim(bottom=0)
        label(ax, "torque of the input [N m]", title=f"{kinds[kind]} meshes")
    label(axes[0], y="transmission error peak to peak [µm]")
    legend_below(figure)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
