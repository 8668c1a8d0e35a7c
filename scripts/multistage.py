#!/usr/bin/env python3
"""Four planetary stages in series: speeds, torques, modes by stage, response to the meshes of every stage."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/multistage"),
    lowest: float = 300.0,
    highest: float = 2000.0,
    points: int = 341,
    harmonics: int = 3,
    damping: float = 0.03,
    lateral: bool = True,
    balance: int = 0,
    published: bool = False,
) -> None:
    """Solve cases/four_stage_reducer.toml; its numbers are femgear's own.

    With --published: natural frequencies of a published four-stage table, for every reading that it allows.

    Parameters
    ----------
    output
        Folder of the results.
    lowest, highest
        Speeds of the first sun [1/min].
    points
        Number of speeds.
    harmonics
        Of every mesh frequency.
    damping
        Ratio of all modes.
    lateral
        The shafts between the stages carry the suns.
    balance
        Speeds at which harmonic balance of the meshes with k(t) stands beside the modal summation, up to 200.
    published
        Only the natural frequencies of the table of "Optimized design of dynamic characteristics of planetary
        gear train", whose units and missing entries allow several readings.
    """
    from published.multistage_example import four_stage_case

    from femgear.report.style import save_figure
    from femgear.trains.multistage import figures, stages
    from femgear.trains.reading import with_values

    given = {
        "lowest": f"{lowest} rpm",
        "highest": f"{highest} rpm",
        "points": points,
        "harmonics": harmonics,
        "damping_ratio": damping,
        "balance_points": balance,
    }
    values = {f"response.{key}": value for key, value in given.items()}
    case = with_values(four_stage_case(lateral=lateral), values)
    names = ["modes.csv", "forces.csv", "stage_energy.png", "mesh_orders.png", "stage_forces.png"]
    names = ["published.csv", "published.png"] if published else names
    folder = ready_folder(output, names)
    if published:
        published_readings(folder)
        say_files(folder, names)
        return
    with Progress() as progress:
        progress("modes")
        modes = stages.solve_multistage_modes(case)
        progress("modes", 1)
        response = stages.solve_stages_response(case, modes)
        balanced = stages.solve_balance(case, progress=progress).dataset() if balance else None
    save_figure(figures.stage_energy(modes.dataset()), folder / "stage_energy.png")
    save_figure(figures.mesh_orders(modes.dataset(), response.dataset()), folder / "mesh_orders.png")
    save_figure(figures.stage_forces(response.dataset(), balanced), folder / "stage_forces.png")
    write_tables(folder, modes, np.linspace(lowest, highest, points), response.forces)
    print_train(modes.data, case.operation)
    say_files(folder, names)


def published_readings(folder: Path) -> None:
    """Natural frequencies of the published table by stiffness unit, number of planets and support."""
    from published.multistage_example import PUBLISHED_FREQUENCIES, published_case

    from femgear.report.style import BLUE, GREY, label, new_figure, save_figure
    from femgear.trains.multistage.stages import solve_multistage_modes

    low, high = PUBLISHED_FREQUENCIES
    rows, records, ladders = [], [], []
    for unit, factor in (("N/mm", 1e3), ("N/m", 1.0)):
        for planets in (3, 4):
            for held in (False, True):
                case = published_case(planets=planets, stiffness_unit=factor, held=held)
                found = solve_multistage_modes(case).modes.frequency
                elastic, reading = found[found > 0.0], f"{unit}, {planets} planets"
                end = "last carrier held" if held else "last carrier free"
                inside = int(np.sum((elastic > low) & (elastic < high)))
                rows.append(
                    (
                        reading,
                        end,
                        str(len(found) - len(elastic)),
                        f"{elastic[0]:.1f}",
                        f"{elastic[-1]:.1f}",
                        f"{inside} of {len(elastic)}",
                    )
                )
                records += [(unit, planets, end, number + 1, float(f)) for number, f in enumerate(found)]
                ladders.append((f"{reading}\n{end}", elastic))
    write_csv(folder / "published.csv", ("unit", "planets", "end", "mode", "frequency [Hz]"), records)
    figure, (ax,) = new_figure(width=8.5, height=4.8)
    for place, (_, elastic) in enumerate(ladders):
        ax.hlines(elastic, place - 0.35, place + 0.35, color=BLUE, linewidth=1.2)
    ax.axhspan(low, high, color=GREY, alpha=0.3, linewidth=0.0)
    ax.text(-0.35, 1.1 * low, "printed range", va="bottom")
    ax.set_yscale("log")
    ax.set_xticks(range(len(ladders)), [name.replace(", ", "\n") for name, _ in ladders], fontsize=8)
    label(ax, y="natural frequency [Hz]", title="published four-stage table, torsion, rigid shafts")
    save_figure(figure, folder / "published.png")
    header = ("reading", "end", "modes at 0 Hz", "lowest [Hz]", "highest [Hz]", f"within {low} to {high} Hz")
    print_table("Published four-stage table: torsion, rings at rest, rigid shafts", header, rows)


def write_tables(folder: Path, modes, rpm: np.ndarray, forces: dict[str, np.ndarray]) -> None:
    """Modes with their stages, and forces over the speed, as CSV."""
    count = range(1, len(modes.share) + 1)
    header = ["mode", "frequency [Hz]", "kind", "stage", *(f"share of stage {n}" for n in count)]
    rows = [
        (n, float(f), kind, int(stage), *map(float, share))
        for n, (f, kind, stage, share) in enumerate(
            zip(modes.modes.frequency, modes.modes.kind, modes.stage, modes.share.T), 1
        )
    ]
    write_csv(folder / "modes.csv", header, rows)
    header = ["speed [1/min]", *(f"stage {n}, {text} [N r.m.s.]" for text in forces for n in count)]
    table = np.column_stack([rpm, *forces.values()])
    write_csv(folder / "forces.csv", header, (tuple(map(float, row)) for row in table))


def print_train(train, operation) -> None:
    """Speeds and torques of all stages as a table."""
    from femgear.case.quantities import RPM
    from femgear.trains.multistage.model import speed_ratio, train_speeds, train_torques

    speeds, torques = train_speeds(train, operation.speed), train_torques(train, operation.torque)
    header = ("stage", "teeth", "sun [1/min]", "carrier [1/min]", "mesh [Hz]", "sun [N m]", "carrier [N m]")
    rows = [
        (
            str(n + 1),
            "/".join(map(str, stage.teeth)),
            *(f"{one[n] / RPM:.3f}" for one in (speeds.sun, speeds.carrier)),
            f"{speeds.mesh_frequency[n]:.3f}",
            *(f"{one[n]:.1f}" for one in (torques.sun, torques.carrier)),
        )
        for n, stage in enumerate(train.stages)
    ]
    print_table(f"Four stages, ratio {speed_ratio(train):.4f}", header, rows)


if __name__ == "__main__":
    sys.exit(run_script(main))
