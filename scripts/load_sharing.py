#!/usr/bin/env python3
"""Load share of every planet and tooth loads over the mesh cycle, with a gap at one planet."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError
from femgear.findings import percent

FILES = ("load_sharing.csv", "tooth_loads.csv", "load_sharing.png", "tooth_loads.png")


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/load_sharing"),
    gap: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (
        "0 um",
        "1 um",
        "3 um",
    ),
    planet: int = 1,
) -> None:
    """Compute the load share of every planet and the tooth loads: a table, pictures and CSV files.

    Deviations, supports and bearings are those of the case.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out.
    output
        Folder of the results.
    gap
        Separation of the sun-side flanks of one planet with its unit, such as "3 um"; may be repeated.
    planet
        Number of the planet that has the gap, 1 upwards.
    """
    from femgear.case.gear_set import need_set, planetary_set
    from femgear.case.quantities import LENGTH, to_si
    from femgear.report.style import save_figure
    from femgear.study.relief import sun_torque
    from femgear.trains.reading import read_case

    data = read_case(case)
    need_set(data)
    gears = planetary_set(data)
    gaps = [_checked(to_si(text, LENGTH), text) for text in gap]
    if not 1 <= planet <= gears.n_planets:
        raise CaseError(
            f"there is no planet {planet}", code="E-PLANET", key="--planet", limit=f"1 to {gears.n_planets}"
        )
    sun_torque(data, gears)
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        cycles, plain = _solve(data, gaps, planet, progress)
    names = [str(name) for name in gears.mesh_names]
    write_csv(folder / "load_sharing.csv", SHARE_HEADER, _share_records(gaps, cycles))
    write_csv(folder / "tooth_loads.csv", TOOTH_HEADER, _tooth_records(gaps, cycles, names))
    save_figure(_share_figure(gaps, cycles, planet), folder / "load_sharing.png")
    save_figure(_tooth_figure(gaps, cycles, names, planet), folder / "tooth_loads.png")
    _print_shares(gaps, cycles, planet, plain)
    say_files(folder, FILES)


SHARE_HEADER = ("gap [m]", "planet", "position [periods]", "share [1]", "sun-planet force [N]")
TOOTH_HEADER = ("gap [m]", "mesh", "position [periods]", "path from the pitch point [m]", "tooth load [N]")


def _checked(gap: float, text: str) -> float:
    if gap < 0:
        raise CaseError("a gap cannot be negative", code="E-RANGE", key="--gap", value=text, limit="0 m or more")
    return gap


def _solve(case, gaps, planet, progress):
    """What all gaps share, and one mesh cycle for each of them."""
    from femgear.contact.cycle import CycleOptions
    from femgear.gears.deviations import common_period
    from femgear.run import grid_cache
    from femgear.study.relief import design_basis, sun_torque

    progress("compliance", 0, 1)
    basis = design_basis(case, cache=grid_cache())
    progress("compliance", 1, 1)
    gears, deviations = basis.gears, basis.deviations
    limit = case.static.longest_record
    periods = 1 if deviations is None else common_period(deviations, gears, limit=limit)[0]
    cycles = []
    for gap in gaps:
        separation = np.zeros(gears.n_planets)
        separation[planet - 1] = gap
        cycle = basis.walk(
            sun_torque(case, gears),
            periods=periods,
            options=CycleOptions(
                planet_gaps=separation,
                progress=lambda done, total, gap=gap: progress(f"gap {gap * 1e6:g} um", done, total),
            ),
        )
        cycles.append(cycle)
    return cycles, deviations is None and case.static.members == "fixed"


def _share_records(gaps, cycles):
    for gap, cycle in zip(gaps, cycles):
        for n, shares in enumerate(cycle.load_share):
            for p, share in enumerate(shares):
                yield float(gap), n + 1, float(cycle.position[p]), float(share), float(cycle.force[n, p])


def _tooth_records(gaps, cycles, names):
    for gap, cycle in zip(gaps, cycles):
        for (j, t, p), load in np.ndenumerate(cycle.tooth_load):
            yield float(gap), names[j], float(cycle.position[p]), float(cycle.path[j, t, p]), float(load)


def parallel_springs(stiffness, force, gap, planet) -> np.ndarray:
    """Mean shares of planets that act as springs in parallel, one of them behind a gap.

    With the stiffness ``k_n = 1/(1/k_sun-planet + 1/k_planet-ring)`` of every planet and the sun moved by
    ``x`` along the lines of action: ``F_n = k_n (x - g_n)`` and ``sum F_n = F``; open while ``x < g_n``.

    Parameters
    ----------
    stiffness : (2N, P) array
        Tangent mesh stiffness without gap [N/m].
    force : float
        Sum of the sun-planet mesh forces [N].
    gap : float
        [m]
    planet : int
        Number of the planet behind the gap, 1 upwards.

    Returns
    -------
    (N,) array
    """
    n = len(stiffness) // 2
    k = 1 / (1 / stiffness[:n] + 1 / stiffness[n:])
    g = np.where(np.arange(n) == planet - 1, gap, 0.0)[:, None]
    others = np.where(g == 0, k, 0.0)
    x = (force + (k * g).sum(axis=0)) / k.sum(axis=0)
    if n > 1:
        x = np.where(x < gap, force / np.maximum(others.sum(axis=0), 1e-300), x)
    return (k * np.maximum(x - g, 0.0) / force).mean(axis=1)


def _print_shares(gaps, cycles, planet, plain):
    rows, notes = [], []
    # the springs know neither deviations nor supports
    reference = next((c for gap, c in zip(gaps, cycles) if gap == 0 and plain), None)
    for gap, cycle in zip(gaps, cycles):
        share = 100 * cycle.load_share
        linear = None
        if reference is not None and reference.stiffness.all():
            total = float(cycle.force[: len(share)].sum(axis=0).mean())
            linear = 100 * parallel_springs(reference.stiffness, total, gap, planet)
        for n, values in enumerate(share):
            numbers = (values.mean(), values.min(), values.max())
            springs = "" if linear is None else f"{linear[n]:.2f}"
            largest = cycle.tooth_load[[n, n + len(share)]].max()
            text = [f"{v:.2f}" for v in numbers]
            rows.append((f"{gap * 1e6:g}", str(n + 1), *text, springs, f"{largest:.1f}"))
        for n in np.flatnonzero(cycle.open_planets.any(axis=1)):
            part = cycle.open_planets[n].mean()
            notes.append(f"gap {gap * 1e6:g} um: planet {n + 1} carries nothing over {percent(part)} of the cycle")
    header = (
        "gap [um]",
        "planet",
        "mean [%]",
        "min [%]",
        "max [%]",
        "parallel springs [%]",
        "largest tooth load [N]",
    )
    print_table(f"Share of the sun's torque, gap at planet {planet}", header, rows)
    for note in notes or ["no planet loses all load"]:
        print(note)


def _share_figure(gaps, cycles, planet):
    from femgear.report.style import label, legend_below, line_style, new_figure, periodic

    figure, axes = new_figure(columns=len(gaps), width=max(3.4 * len(gaps), 6.0), height=4.2, sharey=True)
    for ax, gap, cycle in zip(axes, gaps, cycles):
        position, share = cycle.position, 100 * cycle.load_share
        if cycle.periods == 1:
            position, share = periodic(position, share)
        for n, values in enumerate(share):
            ax.plot(position, values, label=f"planet {n + 1}", linewidth=max(4.6 - 1.5 * n, 1.2), **line_style(n))
        ax.set_xlim(0, cycle.periods)
        factor = 0.01 * len(share) * share.max()
        title = f"gap {gap * 1e6:g} µm at planet {planet}: $K_\\gamma$ {factor:.3f}"
        label(ax, "position in the mesh period [1]", title=title)
    highest = max(100 * cycle.load_share.max() for cycle in cycles)
    axes[0].set_ylim(0, 1.1 * highest)
    label(axes[0], y="share of the torque [%]")
    legend_below(figure, columns=6)
    return figure


def _tooth_figure(gaps, cycles, names, planet):
    """Load of the tooth pairs of the planet with the gap and of its neighbour along the path of contact."""
    from femgear.report.style import label, legend_below, line_style, new_figure

    n = len(cycles[0].load_share)
    neighbour = planet % n + 1
    figure, axes = new_figure(rows=2, columns=2, width=9.5, height=7.0, sharey=True)
    chosen = (planet - 1, neighbour - 1, n + planet - 1, n + neighbour - 1)
    for ax, j in zip(axes, chosen):
        for i, (gap, cycle) in enumerate(zip(gaps, cycles)):
            order = np.argsort(cycle.path[j], axis=None)
            path, load = cycle.path[j].ravel()[order] * 1e3, cycle.tooth_load[j].ravel()[order]
            carried = np.flatnonzero(load > 0)
            shown = slice(max(carried[0] - 1, 0), carried[-1] + 2) if len(carried) else slice(0)
            text = f"gap {gap * 1e6:g} µm at planet {planet}"
            ax.plot(path[shown], load[shown], label=text, **line_style(i))
        label(ax, title=names[j])
    for ax in axes[2:]:
        label(ax, "path from the pitch point [mm]")
    for ax in axes[::2]:
        label(ax, y="load of one tooth pair [N]")
    axes[0].set_ylim(bottom=0)
    legend_below(figure)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
