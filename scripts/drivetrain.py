#!/usr/bin/env python3
"""A drivetrain from its case file: transient, spectra, side bands, modes, contact loss, sensitivity."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from drivetrain_figures import backlash_figure, sensitivity_figure, with_balance
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError, FemgearError

PAPER = Path(__file__).resolve().parents[1] / "cases" / "wind_turbine_drivetrain.toml"
STAGES = ("planetary", "gear 1-2", "gear 2-3")
FILES = {"contact loss": "backlash", "sensitivity": "sensitivity"}


def main(
    case: Path = PAPER,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/drivetrain"),
    duration: str | None = None,
    rate: str | None = None,
    balanced: bool = False,
    torsional: bool = True,
    sensitivity: bool = True,
) -> None:
    """Integrate a drivetrain with and without bending; tables, pictures, a CSV file.

    Parameters
    ----------
    case
        TOML case file of a gearbox with [transient]; the published wind turbine set when left out.
    output
        Folder of the results.
    duration
        Of the transient, such as "60 s". Default: as the case says. The spectra leave out three tenths.
    rate
        Steps, such as "20 kHz". Default: as the case says.
    balanced
        The torque that is a share of the others takes all of it, so that the speed stays.
    torsional
        The same chain without bending beside it.
    sensitivity
        Whether to vary the assumed inputs of the published set.
    """
    from femgear.trains.gearbox.stages import describe_gearbox
    from femgear.trains.gearbox.transient_checks import check_spectrum, check_transient
    from femgear.trains.gearbox.transient_results import describe_spectrum, describe_transient
    from femgear.trains.reading import read_case, with_value

    data, paper = read_case(case), read_case(PAPER)
    if getattr(data, "transient", None) is None:
        raise CaseError(
            "this is no gearbox that is integrated in time",
            code="E-MODEL",
            key="model",
            limit='model = "gearbox" with [transient]',
            remedy="name a case file of such a gearbox",
            file=str(case),
        )
    if duration is not None:
        data = with_value(with_value(data, "transient.settle", None), "transient.duration", duration)
    if rate is not None:
        data = with_value(data, "transient.rate", rate)
    data = with_value(data, "transient.torsional", torsional)
    data = with_balance(data) if balanced else data
    check_transient(data)  # refuse before the folder is touched
    blocks = describe_gearbox(data)
    if gears := bool(data.pair or data.planetary):
        check_spectrum(data)
    folder = ready_folder(output, _names())
    sets, names = _computed(data, folder, gears=gears)
    _write_forces(folder, sets["transient"])
    names.append("forces.csv")
    blocks = [*(block for block in blocks if block.rows), describe_transient(sets["transient"])]
    for block in (*blocks, describe_spectrum(sets["spectrum"])) if gears else blocks:
        print_table(block.title, block.header, block.rows)
        for note in block.notes:
            print(f"  {note}")
    if _is_paper(data, paper):
        _kinematics()
    extras = {"contact loss": lambda: backlash_figure(data)} if gears else {}
    if sensitivity and _is_paper(data, paper):
        extras["sensitivity"] = _sensitivity
    names += _draw_extras(folder, extras)
    say_files(folder, names)


def _names() -> list[str]:
    """Names of the files, of pictures of a run as patterns."""
    from femgear.trains.gearbox.figures import FIGURES

    stages = ("modes", "transient", "spectrum")
    pictures = [f"{name}*.png" for stage in stages for name in FIGURES[stage].captions]
    return ["forces.csv", *(f"{name}.png" for name in FILES.values()), *pictures]


def _computed(data, folder: Path, *, gears: bool):
    """Datasets of all stages, and the names of the pictures of a run."""
    from femgear.report.page import write_pictures
    from femgear.stages.protocol import Drawn
    from femgear.trains.gearbox.spectrum import solve_box_spectrum, solve_box_transient
    from femgear.trains.gearbox.stages import GEARBOX, solve_box_modes, solve_deflections

    with Progress() as progress:
        deflection = solve_deflections(data)
        transient = solve_box_transient(data, deflection, progress=progress)
        sets = {"modes": solve_box_modes(data, deflection).dataset(), "transient": transient.dataset()}
        if gears:
            sets["spectrum"] = solve_box_spectrum(data, transient).dataset()
        return sets, write_pictures(folder, GEARBOX, Drawn(data, sets), progress=progress)


def _draw_extras(folder: Path, extras) -> list[str]:
    """Pictures beside those of a run; what stops one of them is said and stops nothing else."""
    from femgear.report.style import save_figure

    names = []
    for title, draw in extras.items():
        try:
            figure, text = draw()
        except FemgearError as error:
            figure, text = None, f"no picture: [{error.code}] {error.message}"
        if text:
            print(f"{title}: {text}")
        if figure is not None:
            names.append(f"{FILES[title]}.png")
            save_figure(figure, folder / names[-1])
    return names


def _sensitivity():
    with Progress() as progress:
        return sensitivity_figure(progress), ""


def _is_paper(data, paper) -> bool:
    """Whether the chain is the published one, whatever is done with it."""
    return all(
        getattr(data, part) == getattr(paper, part)
        for part in ("shaft", "mass", "coupling", "pair", "planetary", "bearing", "gravity")
    )


def _kinematics() -> None:
    """Mesh lines of two choices of tooth numbers beside the printed ones."""
    from published.wind_turbine_drivetrain import PRINTED, RADII_TEETH, line_teeth, ratio_of_radii

    rows = []
    for text, teeth in (("nearest to the lines", line_teeth()), ("module 5 mm", RADII_TEETH)):
        for stage, printed, line, error in zip(STAGES, PRINTED.lines, teeth.lines(), teeth.mismatch()):
            rows.append((f"{text}: {stage}", f"{printed:g}", f"{line:.2f}", f"{100 * error:+.2f} %"))
    print_table("Mesh lines [Hz]", ("teeth", "printed", "femgear", "mismatch"), rows)
    print(f"ratio of the radii {ratio_of_radii():.3f}, printed {PRINTED.ratio}")


def _write_forces(folder: Path, transient) -> None:
    """Low-passed records with bending: time, speed of the first body, mesh forces."""
    meshes = [f"{mesh} [N]" for mesh in transient["mesh"].values]
    shaft = str(transient.attrs["shaft_of_speed"])
    header = ("time [s]", f"{shaft} speed [rad/s]", *meshes)
    columns = (
        transient["time"].values,
        transient["speed"].sel(shaft=shaft).values[0],
        *transient["mesh_force"].values[0].T,
    )
    write_csv(folder / "forces.csv", header, (tuple(map(float, row)) for row in zip(*columns)))


if __name__ == "__main__":
    sys.exit(run_script(main))
