"""Commands about recordings: measured ones, those of public rigs, computed ones of faulty sets."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from femgear.commands.files import write_case_file
from femgear.commands.program import Tasks, app, examples
from femgear.commands.terminal import Progress, print_blocks, say, says_when_long
from femgear.errors import CaseError
from femgear.measured.requests import FurtherFiles, LineSearch, Recording
from femgear.study.fault_request import FaultRequest, FurtherRecords


@app.command(
    help_epilogue=examples(
        "femgear measured planetary.toml recording.csv --channel acc -o measured",
        'femgear measured planetary.toml recording.wav --speed "1500 rpm" --causes',
    )
)
def measured(
    case: Path,
    signal: Path,
    /,
    *,
    recording: Annotated[Recording | None, Parameter(name="*")] = None,
    search: Annotated[LineSearch | None, Parameter(name="*")] = None,
    causes: Annotated[bool, Parameter(negative="")] = False,
    further: Annotated[FurtherFiles | None, Parameter(name="*", negative="")] = None,
    stage: str | None = None,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
) -> int:
    """Say of every line of a recording whether a healthy set makes it, unequal planets, a fault, or none of these.

    Parameters
    ----------
    case
        TOML case file of a planetary set whose ring stands still, or of a gearbox with such a stage.
    signal
        Recording of a sensor on the housing: text in columns, WAV or MATLAB file (docs/measured.md).
    causes
        Rank errors that would make the abnormal lines, with the size of each: some minutes of computation.
    stage
        Name of the planetary stage, of a gearbox with several.
    output
        Folder of lines.csv, order_spectrum.csv and lines.png. Default: none is written.
    """
    from femgear.measured.verdict import measured_into
    from femgear.trains.reading import read_case
    from femgear.trains.registry import heard_in, train_of

    data = read_case(case)
    gear_set = heard_in(data, stage)
    if causes and train_of(data).recorded_stages is not None:
        message, remedy = "causes are those of a set of its own", "femgear measured of the case of its teeth"
        raise CaseError(message, code="E-ARGUMENTS", key="--causes", remedy=remedy)
    wanted = recording or Recording(), search or LineSearch()
    verdict, blocks, names = measured_into(gear_set, signal, *wanted, output, further)
    print_blocks(blocks)
    if causes:
        from femgear.causes import describe_causes, rank_causes

        sys.stdout.flush()
        with Progress() as progress:
            ranked = rank_causes(data, verdict, progress=progress)
        print_blocks([describe_causes(ranked)])
    if names:
        say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command(
    help_epilogue=examples(
        "# orders at which faults are heard",
        "femgear faults planetary.toml",
        "# twenty labelled signals",
        "femgear faults planetary.toml -o signals --count 20 --seed 7 --wav",
    )
)
def faults(
    case: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    tolerances: Path | None = None,
    request: Annotated[FaultRequest | None, Parameter(name="*", negative="")] = None,
    further: Annotated[FurtherRecords | None, Parameter(name="*", negative="")] = None,
    tasks: Tasks | None = None,
) -> int:
    """Compute labelled signals of sets with faulty teeth, or tabulate the orders of their faults.

    Goes on where it was interrupted.

    Parameters
    ----------
    case
        TOML case file of a planetary set with an elastic, fixed ring.
    output
        Folder of labels.csv and of a NetCDF file for every machine. Without it only the orders are tabulated.
    tolerances
        TOML file of the distributions of errors of the machines, as in docs/samples.md. Default: no errors.
    """
    from femgear.run import grid_cache
    from femgear.stages.fault_orders import describe_fault_orders
    from femgear.study.fault_files import fault_records_into
    from femgear.study.runner import open_runner
    from femgear.trains.reading import read_case

    data = read_case(case)
    parts = request or FaultRequest(), tolerances, further or FurtherRecords()
    if output is None and parts != (FaultRequest(), None, FurtherRecords()):
        message, remedy = "records are asked for, and no folder is named", "name one by -o"
        raise CaseError(message, code="E-ARGUMENTS", key="--output", remedy=remedy)
    print_blocks(describe_fault_orders(data))
    if output is None:
        return 0
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        options = {"cache": grid_cache(), "progress": progress, "runner": runner}
        blocks, names = fault_records_into(data, output, *parts, **options)
    print_blocks(blocks)
    say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command
@says_when_long("recording")
def rigs(
    name: str | None = None,
    signal: Path | None = None,
    /,
    *,
    recording: Annotated[Recording | None, Parameter(name="*")] = None,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Say what recordings of public rigs should hold, write their cases, and check a recording that you have.

    Parameters
    ----------
    name
        Name of a rig. Default: all are listed.
    signal
        Recording of the healthy rig, from its owner; none is shipped.
    output
        Case file of the rig to write.
    force
        Replace the file.
    """
    from femgear.rigs import RIGS, describe_rig, find_rig, judge_rig

    if name is None:
        print_blocks(map(describe_rig, RIGS.values()))
        return 0
    rig = find_rig(name)
    print_blocks([judge_rig(rig, signal, recording or Recording()) if signal is not None else describe_rig(rig)])
    if output is not None:
        write_case_file(rig.source, output, force=force)
    return 0
