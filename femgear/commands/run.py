"""Commands that check and compute a case, and show or compare results."""

from __future__ import annotations

import contextlib
import ctypes
import shlex
import sys
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from femgear.commands.files import results_folder
from femgear.commands.program import app, examples
from femgear.commands.terminal import (
    Progress,
    print_blocks,
    print_briefly,
    print_data,
    print_warnings,
    room_of_warnings,
    say,
    says_when_long,
    warning_lines,
)
from femgear.errors import CaseError, FemgearError

if TYPE_CHECKING:
    from femgear.case.text import ReadCase

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3


@app.command
@says_when_long("check")
def check(
    case: Path,
    /,
    *,
    neighbours: Annotated[bool, Parameter(negative="")] = False,
    only: str | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Read a case, check its gears, print what they are, and refuse what a run would refuse.

    Parameters
    ----------
    case
        TOML case file.
    neighbours
        Print which neighbouring tooth numbers would fit, too.
    only
        Refuse only what femgear run --only with this stage would refuse.
    json
        Print findings and refusal as data (docs/command_line.md).
    """
    from femgear.trains.reading import read_case
    from femgear.trains.registry import check_case, train_of

    if json:
        return _check_as_data(case, only)
    data = read_case(case)
    print_blocks(block for block in train_of(data).describe_case(data) if neighbours or not block.beside)
    try:
        check_case(data, only)
    except FemgearError:
        if only is None:
            sys.stdout.flush()
            print(_refused_stages(data), file=sys.stderr)
        raise
    return 0


def _check_as_data(path: Path, only: str | None) -> int:
    """Print what is said of a case as data; the exit code is that of its refusal."""
    from femgear.stages.summary_data import check_data
    from femgear.trains.reading import read_case
    from femgear.trains.registry import check_case, train_of

    case, refusal = None, None
    try:
        case = read_case(path)
        check_case(case, only)
    except FemgearError as error:
        refusal = error
    print_data(check_data(None if case is None else train_of(case), case, refusal))
    return 0 if refusal is None else refusal.exit_code


def _refused_stages(case: ReadCase) -> str:
    """Say which stages of a run without ``--only`` cannot represent a case, and which can."""
    from femgear.trains.registry import check_case, stages_of, train_of

    works = []
    for stage in train_of(case).stages:
        with contextlib.suppress(FemgearError):
            check_case(case, stage.name)
            works.append(stage.name)
    refused = ", ".join(stage.name for stage in stages_of(case) if stage.name not in works)
    others = f"; it takes --only {' or '.join(works)}" if works else ""
    return f"femgear run without --only refuses this case ({refused}){others}:"


@app.command(
    help_epilogue=examples(
        "femgear run planetary.toml",
        "femgear run planetary.toml -o results --only modes --no-pictures",
    )
)
def run(
    case: Path | None = None,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    only: str | None = None,
    pictures: bool = True,
    force: bool = False,
    verbose: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Compute a case and write results, pictures and report.

    It prints the answers of page one of the report and the verdict; with --only STAGE also the table of that stage.

    Parameters
    ----------
    case
        TOML case file. Default: the only one in the current folder.
    output
        Folder of the results. Default: CASE_results, beside the case.
    only
        Compute this stage and what it needs, no further: "static", "stress" (whatever static.stresses says),
        "life", "losses" or "heat" of teeth, "modes", "dynamics", "housing" or "assumptions"; "branch" or "response"
        of planar cases; "deflection", "balance", "transient" or "spectrum" of gearboxes; "sweep" or "chaos" of gear
        pairs.
    pictures
        Draw figures, fields and report.
    force
        Replace the results that the folder holds, once the new ones are complete.
    verbose
        Print the tables of all stages, and all warnings in full on a terminal too.
    json
        Print answers, key figures and findings as JSON, and nothing else on standard output (docs/command_line.md).
    """
    _set_up_process()
    from femgear.run import run_case
    from femgear.storage.files import resumable
    from femgear.storage.results import completed_since_now, run_folder
    from femgear.trains.reading import read_case
    from femgear.trains.registry import check_case, train_of

    _refuse_unknown_stage(only)
    case = case or _only_case()
    data = read_case(case)
    check_case(data, only)  # refuse before the folder is touched
    train, output = train_of(data), output or results_folder(case)
    of_case = warning_lines(train.case_warnings(data), whole=verbose)
    print_warnings(of_case)
    with resumable(output, completed_since_now(output)):
        with run_folder(output, case=data.source, force=force) as folder, Progress() as progress:

            def tell_numbers(results) -> None:
                """Print what was found, before anything is drawn."""
                lines = warning_lines(train.result_warnings(results), whole=verbose)
                with progress.aside():
                    if verbose and not json:
                        print_blocks(train.describe_results(results))
                    elif not json:
                        print_briefly(train.describe_briefly(results, only), room_of_warnings((*of_case, *lines)))
                    sys.stdout.flush()
                    print_warnings(lines)
                if pictures:
                    load_xarray()

            run_case(data, folder, only=only, pictures=pictures, progress=progress, computed=tell_numbers)
        if json:
            return _print_run(output)
        _say_where_results_are(output, pictures=pictures, verbose=verbose)
    return 0


def _refuse_unknown_stage(name: str | None) -> None:
    """Refuse a stage that no train has."""
    from femgear.trains.registry import stage_names

    if name is not None and name not in (names := stage_names()):
        raise CaseError(
            "no train has this stage",
            code="E-ARGUMENTS",
            key="--only",
            value=name,
            limit=", ".join(names),
            remedy="femgear run --help",
        )


def _say_where_results_are(output: Path, *, pictures: bool, verbose: bool) -> None:
    """Say the folder of the results, the report if there is one, and how to see tables that were not printed."""
    say(f"results: {output}")
    if pictures:
        say(f"report:  {output / 'report.html'}")
    if not verbose:
        say(f"tables:  femgear report {shlex.quote(str(output))} --verbose")


def _set_up_process() -> None:
    """Make ready what saves a run time before its verdict."""
    keep_freed_memory()
    load_scipy()


def keep_freed_memory() -> None:
    """Let this process keep up to 256 MB that arrays have freed, which the next ones take.

    To give back and to clear pages between the steps of the periodic response takes longer than the steps.
    Names and numbers are those of mallopt(3) of the GNU C library; others have no such call.
    """
    set_option = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if set_option is not None:
        set_option(_M_MMAP_THRESHOLD, 32 * 2**20)
        set_option(_M_TRIM_THRESHOLD, 256 * 2**20)


def load_scipy() -> None:
    """Load SciPy without NumPy's tools for tests and Fortran, which it takes along, uses nowhere and waits for."""
    import numpy as np

    unused = [name for name in ("f2py", "testing") if f"numpy.{name}" not in sys.modules]
    for name in unused:
        setattr(np, name, None)  # else NumPy loads them as it is asked for all its names
    try:
        import scipy.linalg  # noqa: F401
    finally:
        for name in unused:
            if getattr(np, name) is None:
                delattr(np, name)  # from now on NumPy loads them where one asks


def load_xarray() -> None:
    """Load xarray, which finds no Dask and no Pint: nothing has their arrays, and to load them takes long."""
    hidden = set() if "xarray" in sys.modules else {"dask", "pint"} - sys.modules.keys()
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        import xarray as xr

        xr.Dataset({"x": ("x", [0.0])})  # now it asks what kinds of arrays there are, and never again
    finally:
        for name in hidden:
            del sys.modules[name]


def _print_run(folder: Path) -> int:
    """Print what decides about a run as data."""
    from femgear.stages.summary_data import run_data
    from femgear.trains.reading import open_results
    from femgear.trains.registry import train_of

    results = open_results(folder)
    print_data(run_data(train_of(results.case), results))
    return 0


def _only_case() -> Path:
    """Find the one case file of the current folder."""
    files = sorted(path for path in Path().glob("*.toml") if path.name != "pyproject.toml")
    if len(files) == 1:
        return files[0]
    here = ", ".join(map(str, files or sorted(Path().iterdir())))
    raise CaseError(
        f"no case is named, and the current folder holds {len(files) or 'none'}",
        code="E-ARGUMENTS",
        value=textwrap.shorten(here, 200, placeholder=" ...") or "an empty folder",
        limit="one *.toml",
        remedy="name one" if files else "femgear new planetary writes one; femgear run --help",
    )


@app.command
@says_when_long("report")
def report(
    folder: Path,
    /,
    *,
    static: Annotated[bool, Parameter(negative="")] = False,
    verbose: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write report.html from the results in a folder.

    Parameters
    ----------
    folder
        Folder that femgear run wrote.
    static
        Pictures and no scripts: for paper, and where scripts are not allowed.
    verbose
        Print the tables of all stages.
    json
        Print answers, key figures and findings as JSON, and write no page (docs/command_line.md).
    """
    from femgear.run import report_again
    from femgear.trains.reading import open_results
    from femgear.trains.registry import train_of

    if json:
        return _print_run(folder)
    report_again(folder, static=static)
    if verbose:
        results = open_results(folder)
        print_blocks(train_of(results.case).describe_results(results))
    say(f"report:  {folder / 'report.html'}")
    return 0


@app.command
@says_when_long("comparison")
def compare(
    *runs: Path,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    verbose: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Compare runs: entries of the cases and numbers that differ, modes of one shape, curves over each other, sounds.

    Parameters
    ----------
    runs
        Two or more folders that femgear run wrote, of cases of one kind; all are compared with the first.
    output
        Folder of the page compare.html.
    verbose
        Print all tables with all rows.
    """
    from femgear.report.compare import compare_page, compared, in_brief
    from femgear.storage.files import own_files, write_text
    from femgear.trains.reading import open_results
    from femgear.trains.registry import same_train

    if len(runs) < 2:
        count = f"{len(runs)} runs"
        raise CaseError("there is nothing to compare", code="E-ARGUMENTS", value=count, limit="two or more")
    opened = [open_results(folder) for folder in runs]
    train = same_train(opened)
    own_files(output, ["compare.html"])
    blocks = compared(train, *opened)
    print_blocks(blocks if verbose else in_brief(blocks))
    write_text(compare_page(train, *opened), output / "compare.html")
    say(f"page: {output / 'compare.html'}")
    return 0
