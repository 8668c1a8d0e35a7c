#!/usr/bin/env python3
"""Tip relief of sun and planets with the least transmission error peak to peak at one torque."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

FILES = ("tip_relief.csv", "tip_relief.png", "relief.toml")
HEADER = (
    "torque [N m]",
    "relief [m]",
    "length [two-pair contact]",
    "STE peak to peak [m]",
    "over unmodified [1]",
)


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/tip_relief_design"),
    torque: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    also: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    largest: str | None = None,
    shape: Literal["linear", "parabolic"] = "parabolic",
    points: int = 7,
    positions: int | None = None,
) -> None:
    """Search amount and length of the relief: contour maps, a CSV file and the tables for the case file.

    Printed beside the optimum: by how much the transmission error rises per micrometre of amount and per
    millimetre of length on either side of it.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out. The relief adds to its modifications.
    output
        Folder of the results.
    torque
        Torque of the input to design for, with its unit. Default: that of the case.
    also
        Further torques of maps; may be repeated. Default: half and one and a half times the first.
    largest
        Largest amount searched. Default: twice the mean deflection of the sun-planet meshes.
    shape
        Of the relief; a linear one begins with a kink, under which the contact pressure rises (W-KINK).
    points
        Points of the grid along each parameter.
    positions
        Positions over one mesh period. Default: those of the case, as ``femgear run`` has them.
    """
    from femgear.case.gear_set import need_set, planetary_set
    from femgear.case.quantities import LENGTH, TORQUE, to_si
    from femgear.run import grid_cache
    from femgear.study.relief import design_basis, loads_back, sun_torque
    from femgear.trains.reading import read_case

    data = read_case(case)
    need_set(data)
    positions = data.static.positions if positions is None else positions
    _check_counts(points, positions)
    design = data.operation.torque if torque is None else to_si(torque, TORQUE)
    others = [to_si(text, TORQUE) for text in also] or [0.5 * design, 1.5 * design]
    gears = planetary_set(data)
    inputs = np.unique([design, *others])
    on_sun = np.array([sun_torque(data, gears, float(value)) for value in inputs])
    loads_back(on_sun)
    top = None if largest is None else _checked(to_si(largest, LENGTH), largest, data.sun.module)
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        progress("compliance", 0, 1)
        basis = replace(design_basis(data, cache=grid_cache()), positions=positions)
        progress("compliance", 1, 1)
        power = 2.0 if shape == "parabolic" else 1.0
        target = sun_torque(data, gears, design)
        top = 2 * _mean_deflection(basis, target) if top is None else top
        amounts = top * np.arange(1, points + 1) / points
        grid, best, fine = _search(basis, amounts, on_sun, target, power, progress)
    snippet = relief_tables(gears, amount=best.amount, length=best.length, power=power, back=target < 0)
    _write(folder, inputs, grid, best, design, snippet)
    _print_summary(inputs, grid, design, best)
    print(
        f"STE peak to peak there: {1e6 * fine[0]:.4f} um, {fine[0] / fine[1]:.1%} of {1e6 * fine[1]:.4f} um "
        f"with the flanks of the case, at {2 * positions} positions"
    )
    if any(gear.modifications for gear in (data.sun, data.planet)):
        print("ADDED TO THE CASE: sun or planets have modifications of their own, to which this relief comes")
    _print_verdict(best, grid)
    print(f"for the case file (relief.toml):\n\n{snippet}")
    say_files(folder, FILES)


def _write(folder: Path, inputs, grid, best, design: float, snippet: str) -> None:
    """Table and picture of the grid, and the tables for the case file."""
    from femgear.report.style import save_figure
    from femgear.storage.files import write_text

    write_csv(folder / "tip_relief.csv", HEADER, _records(inputs, grid))
    optimum = best.amount, best.length
    figure = relief_contours(grid.amounts, grid.lengths, grid.ratio, inputs, optimum=optimum, design=design)
    save_figure(figure, folder / "tip_relief.png")
    write_text(snippet, folder / "relief.toml")


def relief_tables(gears, *, amount: float, length: float, power: float, back: bool) -> str:
    """Tables of a case file for the relief of `femgear.study.with_tip_relief`, to be pasted at its end."""
    from femgear.study.relief import relief_starts

    side = "ring side" if back else "sun side"
    lines = []
    for gear, start, flank in zip((gears.sun, gears.planet), relief_starts(gears, length=length), ("", side)):
        lines += [f"[[{gear.name}.modifications]]", 'kind = "tip relief"']
        lines += [f'flank = "{flank}"'] if flank else []
        diameter = 2e3 * math.hypot(start, gear.base_radius)
        lines += [f'amount = "{amount * 1e6:.3f} um"', f'start_diameter = "{diameter:.5f} mm"']
        lines += [f"power = {power:g}", ""]
    return "\n".join(lines)


def _check_counts(points: int, positions: int) -> None:
    for key, value, low, high in (("--points", points, 3, 100), ("--positions", positions, 4, 2048)):
        if not low <= value <= high:
            raise CaseError("out of range", code="E-RANGE", key=key, value=value, limit=f"{low} to {high}")


def _checked(amount: float, text: str, module: float) -> float:
    if not 0 < amount <= 0.2 * module:
        limit = f"over 0 to 0.2 modules, {0.2e6 * module:.6g} um"
        raise CaseError("not a plausible relief", code="E-RANGE", key="--largest", value=text, limit=limit)
    return amount


def _mean_deflection(basis, torque: float) -> float:
    """Mean deflection of the sun-planet meshes of ideal gears on fixed axes [m]."""
    from femgear.contact.supports import RIGID

    cycle = replace(basis, supports=RIGID, deviations=None, positions=8).walk(torque)
    return float(cycle.deflection[: basis.gears.n_planets].mean())


def _search(basis, amounts, on_sun, target, power, progress):
    """The grid, the optimum at the target torque, and peaks to peaks [m] at twice the positions."""
    from femgear.study.relief import optimise_relief, relief_grid

    grid = relief_grid(
        basis,
        amounts=amounts,
        lengths=np.linspace(0.4, 1.2, len(amounts)),
        torques=on_sun,
        power=power,
        progress=progress,
    )
    progress("optimum", 0, 1)
    best = optimise_relief(basis, grid, torque=target, power=power)
    fine = _at_more_positions(basis, best, target, power)
    progress("optimum", 1, 1)
    return grid, best, fine


def _at_more_positions(basis, best, torque: float, power: float) -> np.ndarray:
    """Peak to peak [m] of the optimum, and that of the flanks of the case, at twice the positions."""
    from femgear.study.relief import harris_map, with_tip_relief

    ideal, gears = basis.deviations, basis.gears
    relief = {"amount": best.amount, "length": best.length, "power": power, "back": torque < 0}
    return harris_map(
        replace(basis, positions=2 * basis.positions),
        torques=[torque],
        deviations=[with_tip_relief(ideal, gears, **relief), ideal],
    ).peak_to_peak[:, 0, 0]


def _print_verdict(best, grid) -> None:
    """Slopes on either side of the optimum, and whether it is a minimum."""
    from femgear.study.relief import AMOUNT_STEP, LENGTH_STEP

    for name, slopes, step, words, number, unit in (
        ("amount", best.amount_slopes, AMOUNT_STEP, ("less", "more"), 1.0, "um per um"),
        ("length", best.length_slopes, LENGTH_STEP, ("shorter", "longer"), 1e3, "um per mm"),
    ):
        parts = [
            f"end of the range searched to {word}" if np.isnan(slope) else f"{number * slope:+.3f} {unit} {word}"
            for slope, word in zip(slopes, words)
        ]
        print(f"slopes of the STE peak to peak over the {name}, within {step * 1e6:g} um: {', '.join(parts)}")
    if not best.minimum:
        print("NOT A MINIMUM: the search ended where a neighbour still lies lower; use more --points")
    elif best.at_end:
        ends = f"up to {grid.amounts[-1] * 1e6:.3f} um, lengths {grid.lengths[0]:g} to {grid.lengths[-1]:g}"
        print(f"NOT A MINIMUM: {' and '.join(best.at_end)} at an end of the range searched ({ends})")


def _records(inputs, grid):
    for (t, a, b), peak in np.ndenumerate(grid.peak_to_peak):
        place = float(inputs[t]), float(grid.amounts[a]), float(grid.lengths[b])
        yield (*place, float(peak), float(grid.ratio[t, a, b]))


def _print_summary(inputs, grid, design, best):
    rows = []
    for t, torque in enumerate(inputs):
        a, b = np.unravel_index(grid.peak_to_peak[t].argmin(), grid.peak_to_peak[t].shape)
        place = (f"{grid.amounts[a] * 1e6:.2f}", f"{grid.lengths[b]:.3f}")
        numbers = (grid.unmodified[t] * 1e6, grid.peak_to_peak[t, a, b] * 1e6)
        rows.append((f"{torque:g}", *place, *(f"{x:.4f}" for x in numbers), f"{grid.ratio[t, a, b]:.1%}"))
    header = (
        "torque [N m]",
        "relief [um]",
        "length [1]",
        "unmodified p-p [um]",
        "STE p-p [um]",
        "over unmodified",
    )
    print_table("Best points of the grid, sun-planet meshes", header, rows)
    print(
        f"optimum at {design:g} N m: {best.amount * 1e6:.3f} um over {best.length:.3f} lengths of two-pair "
        f"contact ({best.evaluations} mesh cycles; meshes of the planets with the ring are not looked at)"
    )


def relief_contours(amounts, lengths, ratios, torques, *, optimum=None, design=None):
    """Transmission error peak to peak over that without relief, over amount and length of the relief.

    Parameters
    ----------
    amounts : (A,) array
        [m]
    lengths : (L,) array
        In lengths of two-pair contact.
    ratios : (T, A, L) array
    torques : (T,) array
        Of the input [N m].
    optimum : (float, float), optional
        Amount [m] and length to be marked.
    design : float, optional
        Torque [N m] the optimum was found at; under the others it is marked as chosen.
    """
    from femgear.report.style import COLOURS, label, legend_below, new_figure

    figure, axes = new_figure(
        columns=len(torques), width=max(3.9 * len(torques), 6.0), height=4.4, sharex=True, sharey=True
    )
    # ratio at which a contour is drawn
    quarter, levels = 0.25, np.linspace(0.0, 1.5, 13)
    for ax, ratio, torque in zip(axes, ratios, torques):
        filled = ax.contourf(lengths, 1e6 * amounts, ratio, levels=levels, cmap="viridis", extend="max")
        if ratio.min() < quarter < ratio.max():
            ax.contour(lengths, 1e6 * amounts, ratio, levels=[quarter], colors=[COLOURS[4]], linewidths=2.0)
            # a contour has no legend entry of its own
            ax.plot([], [], color=COLOURS[4], linewidth=2.0, label=f"{quarter:.0%} of unmodified")
        if optimum is not None:
            _mark(ax, optimum, own=design is None or np.isclose(torque, design), design=design)
        label(ax, "length [two-pair contact]", title=f"{torque:g} N m")
    label(axes[0], y="amount at the tips [µm]")
    bar = figure.colorbar(filled, ax=axes)
    bar.set_label("STE peak to peak over unmodified [1]")
    legend_below(figure)
    return figure


def _mark(ax, optimum, *, own: bool, design) -> None:
    """A full circle under the torque of the optimum, an open one under others."""
    from femgear.report.style import VERMILION

    amount, length = optimum
    name = "optimum" if own else f"chosen for {design:g} N m"
    name = f"optimum at {design:g} N m" if own and design is not None else name
    face = VERMILION if own else "white"
    style = {"color": VERMILION, "markerfacecolor": face, "markersize": 9, "markeredgewidth": 2.0}
    ax.plot(length, 1e6 * amount, "o", label=name, clip_on=False, **style)


if __name__ == "__main__":
    sys.exit(run_script(main))
