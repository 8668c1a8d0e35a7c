#!/usr/bin/env python3
"""The wind turbine drivetrain of 36 dof: transient, spectra, side bands, modes, sensitivity."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from drivetrain_figures import draw_all
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/drivetrain"),
    duration: float = 60.0,
    rate: float = 20_000.0,
    balanced: bool = False,
    rotor_torque: Path | None = None,
    generator_torque: Path | None = None,
    modes: int = 4,
    sensitivity: bool = True,
) -> None:
    """Integrate the drivetrain with and without bending; tables, pictures, a CSV file.

    Parameters
    ----------
    output
        Folder of the results.
    duration
        Of the transient [s].
    rate
        Steps a second.
    balanced
        The generator takes the whole torque, so that the speed stays; otherwise 30 % of it, as in the paper.
    rotor_torque, generator_torque
        CSV files, time [s] and torque [N m] after one line of heads, instead of the constant torques.
    modes
        Pictures of that many elastic modes; 0 draws none.
    sensitivity
        Whether to vary the assumed inputs.
    """
    from femgear.models.drivetrain import drivetrain_model
    from femgear.models.drivetrain_march import march_drivetrain
    from femgear.models.drivetrain_torque import constant_torques, read_torque_csv
    from femgear.models.drivetrain_torsional import torsional_model
    from femgear.models.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain

    if not (duration >= 4.0 and rate >= 1000.0) or modes < 0:
        raise CaseError(
            f"{duration} s at {rate} steps a second, {modes} modes", code="E-RANGE",
            limit="4 s or more, 1000 steps a second or more, 0 modes or more",
        )  # fmt: skip
    torques = {t.body: t for t in constant_torques(paper_torques(balanced=balanced))}
    for body, path in (("rotor", rotor_torque), ("generator", generator_torque)):
        if path is not None:
            torques[body] = read_torque_csv(path, body)
    train = wind_turbine_drivetrain()
    models = {"torsional": torsional_model(train), "with bending": drivetrain_model(train)}
    folder = ready_folder(output)
    with Progress() as progress:
        runs = {}
        for text, model in models.items():
            progress(f"integration, {text}")
            runs[text] = march_drivetrain(
                model,
                list(torques.values()),
                duration=duration,
                step=1.0 / rate,
                speed=PRINTED.speed,
                start="zero",
            )
            progress(f"integration, {text}", 1.0)
        names = draw_all(folder, models, runs, modes=modes, vary=sensitivity, progress=progress)
    _tables(models, runs)
    run = runs["with bending"]
    every = max(1, round(rate * 1e-3))
    columns = (run.time, run.spin_speed, *run.force.T)
    write_csv(
        folder / "forces.csv",
        ("time [s]", "rotor speed [rad/s]", *(f"{mesh} [N]" for mesh in run.meshes)),
        (tuple(float(c[i]) for c in columns) for i in range(0, len(run.time), every)),
    )
    say_files(folder, [*names, "forces.csv"])


def _tables(models, runs):
    from femgear.models.wind_turbine_drivetrain import PRINTED, RADII_TEETH, line_teeth, ratio_of_radii

    rows = []
    for text, teeth in (("nearest to the lines", line_teeth()), ("module 5 mm", RADII_TEETH)):
        for stage, line, error in zip(("planetary", "gear 1-2", "gear 2-3"), teeth.lines(), teeth.mismatch()):
            printed = PRINTED.lines[("planetary", "gear 1-2", "gear 2-3").index(stage)]
            rows.append((f"{text}: {stage}", f"{printed:g}", f"{line:.2f}", f"{100 * error:+.2f} %"))
    print_table("Mesh lines [Hz]", ("teeth", "printed", "ours", "mismatch"), rows)
    print(f"ratio of the radii {ratio_of_radii():.3f}, printed {PRINTED.ratio}")
    rows = []
    for text, run in runs.items():
        rows += [
            (
                f"{text}: {mesh}",
                f"{f.mean():.0f}",
                f"{f.min():.0f}",
                f"{f.max():.0f}",
                f"{100 * np.mean(f < 0):.1f}",
            )
            for mesh, f in zip(run.meshes, run.force.T)
        ]
    print_table("Mesh forces [N]", ("mesh", "mean", "smallest", "largest", "negative [% of time]"), rows)
    rows = [
        (text, f"{r.ledger.error:.1e}", f"{r.momentum:.1e}", f"{r.drift:.1e}", f"{len(models[text].rigid)}")
        for text, r in runs.items()
    ]
    print_table("Balances", ("model", "energy [1]", "momentum [1]", "drift [rad]", "dof"), rows)


if __name__ == "__main__":
    sys.exit(run_script(main))
