"""Commands that read and write files of other programs."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

import femgear
from femgear.commands.files import need_new_files, write_case_file
from femgear.commands.program import Whole, app, examples
from femgear.commands.terminal import Progress, print_warnings, say, says_when_long, warning_lines
from femgear.errors import CaseError, FemgearError, printable
from femgear.exchange.sampling import Sampling


@app.command(name="import")
@says_when_long("import")
def import_rexs(
    file: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("case.toml"),
    stage: str | None = None,
    load_case: Whole | None = None,
    unused: Annotated[bool, Parameter(negative="")] = False,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write the gearbox of a REXS file; say what is missing, what is assumed and what is not used.

    Where shafts and stages make no gearbox, each stage becomes a case with its id in the name, NAME_28.toml; a
    planetary stage becomes NAME.toml.

    Parameters
    ----------
    file
        REXS 1.0 to 2.0: .rexs, .rexsj or .rexsz.
    output
        Case file to write.
    stage
        Id of the only stage to take.
    load_case
        Number of the load case, from 1. Default: the first; single stages also take the speeds of further load cases.
    unused
        List all attributes of the file that no case uses.
    force
        Replace the files.
    """
    from femgear.exchange.rexs import read_model
    from femgear.trains.imports import case_drafts

    model = read_model(file)
    drafts = case_drafts(model, output.name, stage=stage, load_case=load_case)
    print_warnings(warning_lines(model.findings, whole=True))
    paths = [output.with_name(f"{output.stem}{case_draft.suffix}{output.suffix}") for case_draft in drafts]
    need_new_files(paths, force=force)
    for draft, path in zip(drafts, paths, strict=True):
        write_case_file(draft.text, path, force=force)
        if len(drafts) > 1:
            say(f"         {draft.words}")
    say(f"entries that are assumed: {sum(case_draft.text.count('# assumed') for case_draft in drafts)}")
    left = list(model.unused())
    count = sum(line.count(",") + 1 for line in left)
    say(f"attributes that are not used: {count} of {len(left)} types{'' if unused else ', listed by --unused'}")
    for line in left if unused else ():
        say(textwrap.shorten(f"  {line}", 110, placeholder=" ..."))
    return 0


@app.command
@says_when_long("REXS")
def rexs(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write a planetary set, or a gearbox with shafts, bearings, stages and load cases, as a REXS 1.4 file.

    Parameters
    ----------
    case
        TOML case file.
    output
        REXS file to write, NAME.rexs.
    force
        Replace the file.
    """
    from femgear.exchange.rexs import model_text
    from femgear.trains.imports import rexs_model
    from femgear.trains.reading import read_case

    if output.suffix.lower() != ".rexs":
        message, limit = "femgear writes REXS as XML, unzipped", "a name that ends with .rexs"
        raise CaseError(message, code="E-OUTPUT", file=str(output), limit=limit)
    model = rexs_model(read_case(case), output.name)
    text = model_text(model, "femgear", femgear.__version__)
    print_warnings(warning_lines(model.findings, whole=True))
    write_case_file(text, output, force=force)
    return 0


@app.command
@says_when_long("solids")
def cad(
    case: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write all gears of a case with their exact teeth, in their places: solids as STEP, or outlines as DXF.

    Parameters
    ----------
    case
        TOML case file of a set, a pair or a gearbox.
    output
        File to write, by the end of its name as .step or .dxf. Default: CASE.step.
    force
        Replace the file.
    """
    from femgear.exchange.cad import placed_gears, write_cad
    from femgear.stages.tooth_faults import undrawn_faults
    from femgear.trains.reading import read_case
    from femgear.trains.registry import train_of

    data = read_case(case)
    bodies = train_of(data).bodies
    gears = placed_gears(bodies(data) if bodies is not None else ())
    output = output or Path(f"{case.stem}.step")
    need_new_files([output], force=force)
    write_cad(gears, output, say)
    for text in undrawn_faults(data) if hasattr(data, "gear_names") else ():
        say(f"not drawn: {text}")
    say(f"written: {output}")
    return 0


@Parameter(name="*")
@dataclass(frozen=True)
class Formats:
    """What is written.

    Parameters
    ----------
    csv
        Tables with units in their headers: one file for each stage and each set of dimensions.
    xlsx
        The same tables as sheets of results.xlsx.
    mat
        All numbers as results.mat for MATLAB.
    wav
        Accelerometer and microphone at every speed, in m/s^2 and Pa over the full scale; of pairs
        transmission error and bearing forces, in m/s^2 and N; of gearboxes accelerations at their sensors.
    uff
        Universal files: the same signals and their lines (dataset 58), modes of the ring, or of a gearbox
        (15, 55).
    quality
        Loudness, tone-to-noise ratio and prominence of the sound, as table.
    """

    csv: Annotated[bool, Parameter(negative="")] = False
    xlsx: Annotated[bool, Parameter(negative="")] = False
    mat: Annotated[bool, Parameter(negative="")] = False
    wav: Annotated[bool, Parameter(negative="")] = False
    uff: Annotated[bool, Parameter(negative="")] = False
    quality: Annotated[bool, Parameter(negative="")] = False


@Parameter(name="*")
@dataclass(frozen=True)
class ModelFiles:
    """Files of a model for other programs, of a run or a case.

    Parameters
    ----------
    state_space
        File .npz or .mat: matrices A, B, C, D of the vibration, and what the meshes do over the angle.
    fmu
        File .fmu: the vibration in time as functional mock-up unit, for co-simulation.
    fmi
        Version of FMI that the unit follows, 2.0 or 3.0.
    stiffness_table
        File .csv, .mat or .npz: mesh stiffness and transmission error over the angle of the first gear.
    harmonics
        Mesh harmonics that tables of the state space and of the unit keep. Default: 100.
    force
        Replace files that are there.
    """

    state_space: Path | None = None
    fmu: Path | None = None
    fmi: Literal[2, 3] = 2
    stiffness_table: Path | None = None
    harmonics: Whole | None = None
    force: Annotated[bool, Parameter(negative="")] = False

    @property
    def paths(self) -> dict[str, Path]:
        """All files that are asked for, by their options."""
        named = {"--state-space": self.state_space, "--fmu": self.fmu, "--stiffness-table": self.stiffness_table}
        return {option: path for option, path in named.items() if path is not None}


@app.command(
    help_epilogue=examples(
        "# of the results of femgear run planetary.toml",
        "femgear export planetary_results --csv --xlsx",
        "femgear export planetary_results --wav -o sounds",
        "# of a case file, without a run",
        "femgear export planetary.toml --state-space model.npz",
    )
)
def export(
    folder: Path,
    /,
    *,
    formats: Formats | None = None,
    sampling: Annotated[Sampling | None, Parameter(name="*")] = None,
    models: ModelFiles | None = None,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
) -> int:
    """Write the numbers of a run, or a model of its vibration, as files that other programs read.

    Files that cannot be are left out; the exit code is then that of the first reason.

    Parameters
    ----------
    folder
        Folder that femgear run wrote; a case file will do for the state space, the FMU and the stiffness table.
    output
        Folder for the exported numbers. Default: exported, inside the folder of the run.
    """
    from femgear.run import export_results, refused_formats
    from femgear.storage.files import list_own, own_files
    from femgear.storage.results import EXPORTED, additions, folder_lock
    from femgear.trains.reading import open_results

    named = [name for name, wanted in vars(formats or Formats()).items() if wanted]
    refused = dict[str, FemgearError]()
    if models is not None and models.paths:
        refused |= _write_models(folder, models)
        if not named:
            return _tell_refused(refused)
    if not named:
        options = ", ".join(f"--{name}" for name in (*vars(Formats()), "state-space", "fmu", "stiffness-table"))
        raise CaseError("no format is named", code="E-ARGUMENTS", limit=options, remedy="femgear export --help")
    results = open_results(folder)  # refused before another folder is touched
    of_formats = refused_formats(results, named)
    refused |= {f"--{form}": error for form, error in of_formats.items()}
    wanted = [form for form in named if form not in of_formats], sampling or Sampling()
    if not wanted[0]:
        return _tell_refused(refused)
    if output is None:
        with folder_lock(folder), additions(folder) as new, Progress() as progress:
            list_own(new / EXPORTED)
            names = export_results(open_results(folder), new / EXPORTED, *wanted, progress=progress)
    else:
        own_files(output, ())
        with Progress() as progress:
            names = export_results(results, output, *wanted, progress=progress)
    say(f"files in {output or folder / EXPORTED}: {', '.join(names)}")
    return _tell_refused(refused)


def _tell_refused(refused: Mapping[str, FemgearError]) -> int:
    """Say which files are not written, and raise the reason of the first; 0 of none."""
    if not refused:
        return 0
    say(f"not written: {', '.join(refused)}")
    first, *others = refused.values()
    for error in {str(error): error for error in others if str(error) != str(first)}.values():
        print(printable(str(error)), file=sys.stderr)
    raise first


def _write_models(source: Path, wanted: ModelFiles) -> dict[str, FemgearError]:
    """Write the models of a case file, or of the case of a run; returns the refusals of those that cannot be."""
    from femgear.exchange.dynamic_model import (
        HARMONICS,
        check_ending,
        table_harmonics,
        write_state_space,
        write_stiffness_table,
    )
    from femgear.exchange.fmu import write_fmu
    from femgear.run import dynamic_model, run_harmonics, stiffness_table
    from femgear.trains.reading import open_results, read_case

    for option, path in wanted.paths.items():
        check_ending(path, option)
    need_new_files([*wanted.paths.values()], force=wanted.force)
    of_run = open_results(source) if source.is_dir() else None
    case = read_case(source) if of_run is None else of_run.case
    harmonics = HARMONICS if wanted.harmonics is None else wanted.harmonics
    paths, refused, kept = dict(wanted.paths), dict[str, FemgearError](), None
    table_path = paths.pop("--stiffness-table", None)
    with Progress() as progress:
        if paths:
            try:
                model = dynamic_model(case, progress=progress)
            except FemgearError as error:
                refused |= dict.fromkeys(paths, error)
            else:
                kept = table_harmonics(model, harmonics)
                if wanted.state_space is not None:
                    write_state_space(model, wanted.state_space, harmonics=harmonics)
                if wanted.fmu is not None:
                    write_fmu(model, wanted.fmu, harmonics=harmonics, version=wanted.fmi)
        if table_path is not None:
            try:
                table = stiffness_table(case if of_run is None else of_run, progress=progress)
                write_stiffness_table(table, table_path)
            except FemgearError as error:
                refused["--stiffness-table"] = error
    for option, path in wanted.paths.items():
        if option not in refused:
            say(f"written: {path}")
    if kept is not None:
        of_speeds = {} if of_run is None else run_harmonics(of_run)
        words = ", ".join(f"{count} at {speed:,.4g} rpm" for speed, count in of_speeds.items())
        say(f"mesh harmonics in its tables: {kept}, of the run: {words or 'as many as its excitation reaches'}")
    return refused
