#!/usr/bin/env python3
"""Four planetary stages in series: speeds, torques, modes by stage, response to the meshes of every stage."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

# some seconds each; beyond these a figure shows nothing more
MOST_BALANCE, MOST_POINTS, MOST_HARMONICS = 200, 20_000, 20


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
    """Solve the example train of published.multistage_example; its numbers are femgear's own.

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
    from published.multistage_example import SPEED, TORQUE, four_stage_train

    from femgear.report.style import save_figure
    from femgear.trains.multistage.figures import mesh_orders, stage_energy, stage_forces
    from femgear.trains.multistage.model import train_speeds
    from femgear.trains.multistage.stages import multistage_modes

    if (
        not 0.0 < lowest < highest < math.inf
        or points < 2
        or not 1 <= harmonics <= MOST_HARMONICS
        or not 0 <= balance <= MOST_BALANCE
        or points > MOST_POINTS
        or not 0 < damping < 1
    ):
        raise CaseError(
            f"{points} speeds from {lowest} to {highest} 1/min, {balance} of harmonic balance, {harmonics} "
            f"harmonics, damping {damping}",
            code="E-RANGE",
            limit=f"0 < lowest < highest, 2 to {MOST_POINTS} speeds, 1 to {MOST_HARMONICS} harmonics, up to "
            f"{MOST_BALANCE} speeds of harmonic balance, 0 < damping < 1",
        )  # fmt: skip
    folder = ready_folder(output)
    if published:
        return _published(folder)
    train = four_stage_train(lateral=lateral)
    rpm = np.linspace(lowest, highest, points)
    speed = rpm * math.pi / 30.0
    with Progress() as progress:
        progress("modes")
        modes = multistage_modes(train, damping_ratio=damping)
        progress("modes", 1)
        forces = _forces(train, speed, TORQUE, harmonics, modes.modes)
        marks = _balance(
            train, np.linspace(lowest, highest, balance + 2)[1:-1], TORQUE, harmonics, damping, progress
        )
    natural, kinds = modes.modes.frequency, modes.modes.kind
    save_figure(stage_energy(natural, kinds, modes.share), folder / "stage_energy.png")
    mesh = speed[:, None] * train_speeds(train, 1.0).mesh_frequency
    shown = mesh_orders(rpm, mesh, natural[1:], kinds[1:], harmonics=harmonics)
    save_figure(shown, folder / "mesh_orders.png")
    save_figure(stage_forces(rpm, forces, marks=marks), folder / "stage_forces.png")
    _write(folder, train, modes, rpm, forces)
    _print(train, SPEED, TORQUE)
    names = ["modes.csv", "forces.csv", "stage_energy.png", "mesh_orders.png", "stage_forces.png"]
    say_files(folder, names)


def _published(folder: Path) -> None:
    """Natural frequencies of the published table by stiffness unit, number of planets and support."""
    from published.multistage_example import PUBLISHED_FREQUENCIES, published_train

    from femgear.report.style import BLUE, GREY, label, new_figure, save_figure
    from femgear.trains.multistage.stages import multistage_modes

    low, high = PUBLISHED_FREQUENCIES
    rows, records, ladders = [], [], []
    for unit, factor in (("N/mm", 1e3), ("N/m", 1.0)):
        for planets in (3, 4):
            for held in (False, True):
                train = published_train(planets=planets, stiffness_unit=factor, held=held)
                found = multistage_modes(train).modes.frequency
                elastic, reading = found[found > 0.0], f"{unit}, {planets} planets"
                end = "last carrier held" if held else "last carrier free"
                inside = int(np.sum((elastic > low) & (elastic < high)))
                rows.append(
                    (reading, end, str(len(found) - len(elastic)), f"{elastic[0]:.1f}", f"{elastic[-1]:.1f}",
                     f"{inside} of {len(elastic)}")
                )  # fmt: skip
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
    say_files(folder, ["published.csv", "published.png"])


def _forces(train, speed, torque, harmonics, modes) -> dict[str, np.ndarray]:
    """Root mean squares (F, S) of the force in sun-planet 1 of every stage, by the stage that excites."""
    from published.multistage_example import example_errors

    from femgear.trains.multistage.model import mesh_columns
    from femgear.trains.multistage.stages import error_response

    first = [columns[0] for columns in mesh_columns(train)]
    answers = error_response(train, speed, example_errors(train, torque, harmonics), modes=modes)
    squares = {n: 0.5 * (np.abs(one.force[..., first]) ** 2).sum(axis=1) for n, one in answers.items()}
    forces = {"all stages": np.sqrt(sum(squares.values()))}
    return forces | {f"meshes of stage {n}": np.sqrt(square) for n, square in squares.items()}


def _balance(train, rpm, torque, harmonics, damping, progress) -> dict[str, tuple]:
    """The same by harmonic balance with the stiffness waves, first orders of two stages together."""
    from published.multistage_example import example_meshes

    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
    from femgear.system.fourier import distinct_lines
    from femgear.trains.multistage.model import mesh_columns
    from femgear.trains.multistage.stages import base_frequencies, multistage_problem

    if not len(rpm):
        return {}
    stages, unit = len(train.stages), np.eye(len(train.stages), dtype=int)
    orders = [h * unit[n] for n in range(stages) for h in range(1, harmonics + 1)]
    orders += [unit[n] + sign * unit[m] for n in range(stages) for m in range(n) for sign in (-1, 1)]
    problem = multistage_problem(
        train, meshes=example_meshes(train, harmonics), torque=torque, damping=damping
    )
    first, found = [columns[0] for columns in mesh_columns(train)], []
    for number, value in enumerate(rpm):
        progress("harmonic balance", number, len(rpm))
        frequency = base_frequencies(train, value * math.pi / 30.0)[:stages]
        one = solve_harmonic_balance(problem, frequency, orders=distinct_lines(orders), stability=False)
        lines = one.force[first, 1:] if one.converged else np.full((stages, 1), np.nan)
        found.append(np.sqrt(0.5 * (np.abs(lines) ** 2).sum(axis=1)))
    progress("harmonic balance", len(rpm), len(rpm))
    return {"harmonic balance, k(t) of all meshes": (rpm, np.array(found))}


def _write(folder, train, modes, rpm, forces) -> None:
    count = range(1, len(train.stages) + 1)
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


def _print(train, speed, torque) -> None:
    from femgear.trains.multistage.model import speed_ratio, train_speeds, train_torques

    speeds, torques = train_speeds(train, speed), train_torques(train, torque)
    header = ("stage", "teeth", "sun [1/min]", "carrier [1/min]", "mesh [Hz]", "sun [N m]", "carrier [N m]")
    rows = [
        (
            str(n + 1),
            "/".join(map(str, stage.teeth)),
            *(f"{30.0 / math.pi * one[n]:.3f}" for one in (speeds.sun, speeds.carrier)),
            f"{speeds.mesh_frequency[n]:.3f}",
            *(f"{one[n]:.1f}" for one in (torques.sun, torques.carrier)),
        )
        for n, stage in enumerate(train.stages)
    ]
    print_table(f"Four stages, ratio {speed_ratio(train):.4f}", header, rows)


if __name__ == "__main__":
    sys.exit(run_script(main))
