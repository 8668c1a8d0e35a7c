"""The command line: ``femgear`` new, import, check, run, report, export, rexs, schema and the studies of a case."""

from __future__ import annotations

import _thread
import atexit
import contextlib
import gc
import os
import re
import shlex
import signal
import sys
import textwrap
import threading
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femgear.case.text import ReadCase

_INTERRUPTED = 130
_RARELY = 50_000
"""New objects after which garbage is looked for: more than by default, since what a run makes is kept."""
_MEMORY = 600_000_000
"""Memory that a process needs to load the libraries of a run [bytes]; with less they end or stop it."""
_LOADING = "install femgear with its libraries; where memory is limited (ulimit -v, -d), raise the limit"

with contextlib.suppress(ImportError):  # Windows has no such limits
    import resource

    for _limit, _option in ((resource.RLIMIT_AS, "-v"), (resource.RLIMIT_DATA, "-d")):
        if 0 <= resource.getrlimit(_limit)[0] < _MEMORY:  # none is negative
            sys.stderr.write(
                "[E-MEMORY] this process may use too little memory\n"
                f"  found:   {resource.getrlimit(_limit)[0] / 1e6:.0f} MB\n"
                f"  allowed: {_MEMORY / 1e6:.0f} MB or more\n"
                f"  remedy:  raise the limit (ulimit {_option})\n"
            )
            raise SystemExit(3)

try:
    from pathlib import Path
    from typing import Annotated, Any, Literal

    import numpy as np
    from cyclopts import App, CycloptsError, MissingArgumentError, Parameter

    import femgear
    from femgear.errors import CaseError, FemgearError, StorageError, nvh_library, printable
    from femgear.exchange.formats import Sampling
    from femgear.findings import FindingWarning
    from femgear.measured.requests import FurtherFiles, LineSearch, Recording
    from femgear.storage.files import noted_interrupts, storage_error
    from femgear.study.fault_request import FaultRequest, FurtherRecords
    from femgear.study.teeth_request import TeethStrength, WantedTeeth
except KeyboardInterrupt:  # loading takes long enough to be interrupted, before main can say so
    sys.stderr.write("interrupted\n")
    raise SystemExit(_INTERRUPTED) from None
except (ImportError, MemoryError) as error:
    sys.stderr.write(f"[E-LIBRARY] {type(error).__name__}: {' '.join(str(error).split())}\n  remedy:  {_LOADING}\n")
    raise SystemExit(5) from None  # femgear.errors, where the number stands, may be what cannot be loaded

app = App(
    name="femgear",
    version=lambda: femgear.__version__,
    help="Planetary gear sets: from tooth geometry to the vibration heard on the housing.",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
)


Quantity = Annotated[str, Parameter(allow_leading_hyphen=True)]


def whole_number(text: str, key: str) -> int:
    """Read a whole number; 27.5 is none, and is not rounded (CaseError, E-TYPE)."""
    if re.fullmatch(r"\s*[+-]?\d+(\.0*)?\s*", text):
        return int(text.partition(".")[0])
    raise CaseError(f"{text!r} is no whole number", code="E-TYPE", key=key, value=text, limit="whole numbers")


def _convert_whole(_: Any, tokens: Sequence[Any]) -> int:
    """Whole number of an option; what cyclopts would round is refused."""
    return whole_number(tokens[0].value, tokens[0].keyword or "")


Whole = Annotated[int, Parameter(converter=_convert_whole)]
"""A number with its unit, which may be negative."""


_SILENCE = 10.0
"""Longest time without a line where standard error is a file or a pipe [s]."""
_BRIEF, _LEAST_ROWS = 40, 1
"""Lines that a run prints of its tables, and rows that are left of the longest one."""


class Progress:
    """Bars on the terminal, or lines where standard error is a file or a pipe; called by the stages."""

    def __enter__(self):
        from rich.console import Console

        self._console = Console(stderr=True, markup=False, highlight=False)
        self._done, self._now, self._start = dict[str, tuple[float, float]](), "", time.monotonic()
        self._ended, self._bars, self._tasks = threading.Event(), None, {}
        if self._console.is_terminal:
            self._draw_bars()
        else:
            threading.Thread(target=self._tell_time, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        if self._bars is not None:
            self._bars.stop()

    def __call__(self, stage: str, done: float = 0.0, total: float = 1.0) -> None:
        """Say that ``done`` of ``total`` steps of a stage are done."""
        if stage not in self._done and self._bars is None:
            self._console.print(stage)
        self._done[stage], self._now = (done, total), stage
        if self._bars is not None:
            if stage not in self._tasks:
                self._tasks[stage] = self._bars.add_task(stage, total=total)
            self._bars.update(self._tasks[stage], completed=done, total=total)

    @contextlib.contextmanager
    def aside(self) -> Iterator[None]:
        """Leave the terminal to others in this context; the bars of what comes stand below."""
        if self._bars is not None:
            self._bars.stop()
        yield
        if self._bars is not None:
            self._draw_bars()

    def _draw_bars(self) -> None:
        """Begin with new bars."""
        from rich import progress

        self._tasks = {}
        self._bars = progress.Progress(
            progress.TextColumn("{task.description}", markup=False),
            progress.BarColumn(),
            progress.TaskProgressColumn(),
            progress.MofNCompleteColumn(),
            progress.TimeElapsedColumn(),
            progress.TimeRemainingColumn(),
            console=self._console,
        )
        self._bars.start()

    def _tell_time(self) -> None:
        """Print how far the stage has come as often as a reader would begin to wonder."""
        while not self._ended.wait(_SILENCE):
            done, total = self._done.get(self._now, (0.0, 1.0))
            share = f", {done:.5g} of {total:.5g}" if total > 1.0 else ""
            self._console.print(f"{self._now}{share}, {time.monotonic() - self._start:.0f} s")


def _load_xarray() -> None:
    """Load xarray, which finds no Dask and no Pint: nothing has their arrays, and to load them takes long."""
    hidden = set() if "xarray" in sys.modules else {"dask", "pint"} - sys.modules.keys()
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        import xarray as xr

        xr.Dataset({"x": ("x", [0.0])})  # now it asks what kinds of arrays there are, and never again
    finally:
        for name in hidden:
            del sys.modules[name]


def _print(blocks) -> None:
    """Print blocks of `femgear.report.page` as tables on standard output."""
    sys.stdout.write(_as_text(blocks))


def _print_briefly(blocks) -> None:
    """Print blocks in `_BRIEF` lines, if that leaves `_LEAST_ROWS` of the longest table, whose last rows go."""
    from dataclasses import replace

    from femgear.report.tables import merged

    blocks = [replace(block, rows=tuple(merged(block.rows))) for block in blocks]
    longest = max(range(len(blocks)), key=lambda number: len(blocks[number].rows))
    whole = blocks[longest]
    while (text := _as_text(blocks)).count("\n") > _BRIEF and len(blocks[longest].rows) > _LEAST_ROWS:
        rows = blocks[longest].rows[:-1]
        more = f"{len(whole.rows) - len(rows)} more by --verbose"
        blocks[longest] = replace(whole, rows=rows, notes=(more, *whole.notes))
    sys.stdout.write(text)


def _as_text(blocks) -> str:
    """Write blocks of `femgear.report.page` as tables, as wide as the terminal, or in 120 columns."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from femgear.report.tables import merged

    console = Console(markup=False, highlight=False, emoji=False)
    if not console.is_terminal:
        console.width = 120
    with console.capture() as captured:
        for block in blocks:
            console.print(f"\n{printable(block.title)}")
            rows = [[printable(cell) for cell in row] for row in merged(block.rows)]
            for columns in _fitting(block.header, rows, console.width) if rows else ():
                table = Table(box=box.SIMPLE_HEAD if block.header else None, show_header=bool(block.header))
                for index, name, least in columns:
                    side = "right" if index and block.header else "left"
                    # numbers stay whole, texts break between words
                    whole = not any(" " in row[index] for row in rows)
                    table.add_column(name, justify=side, overflow="fold", no_wrap=whole, min_width=least)
                for row in rows:
                    table.add_row(*(row[index] for index, *_ in columns))
                console.print(table)
            for note in block.notes:
                console.print(f"  {printable(note)}")
    return captured.get()


def _fitting(header: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[list[tuple[int, str, int]]]:
    """Split columns so that no number breaks in a width, the first one repeated; places, names, least widths.

    Names break between words where that makes the table narrower.
    """
    names = list(header) or [""] * len(rows[0])
    cells = [max(len(row[i]) for row in rows) for i in range(len(names))]
    natural = sum(max(len(name), cell) + 3 for name, cell in zip(names, cells))
    if natural > width:
        names = [_broken(name, cell) for name, cell in zip(names, cells)]
    least = [
        max(map(len, [*name.split("\n"), *(word for row in rows for word in row[i].split())]), default=0)
        for i, name in enumerate(names)
    ]
    parts, used = [[0]], least[0]
    for i in range(1, len(names)):
        if used + least[i] + 3 * (len(parts[-1]) + 1) >= width and len(parts[-1]) > 1:
            parts.append([0])
            used = least[0]
        parts[-1].append(i)
        used += least[i]
    return [[(i, names[i], least[i]) for i in part] for part in parts]


def _broken(name: str, width: int) -> str:
    """Break a name between words to lines of a width, or of its longest word."""
    return "\n".join(textwrap.wrap(name, max([width, *map(len, name.split())]), break_on_hyphens=False))


def _say(text: str) -> None:
    print(printable(text))


def _fail(error: FemgearError) -> int:
    if error.key in ("only", "speeds"):
        error.key = f"--{error.key}"
    print(error, file=sys.stderr)
    return error.exit_code


def _wrong_arguments(error: CycloptsError, program: str) -> CaseError:
    """Tell what is wrong with a command line, in one sentence."""
    absent = isinstance(error, MissingArgumentError) and not (error.argument and error.argument.tokens)
    message = " ".join(str(error).split())
    if absent and error.argument is not None and "--" + error.argument.name.lstrip("-") not in _given(error):
        message = f"{error.argument.name} is required"
    command = " ".join((program, *(error.command_chain or ())))
    remedy = f"{command} --help" + "; other entries are written into the file" * command.endswith(" new")
    return CaseError(message, code="E-ARGUMENTS", remedy=remedy)


def _given(error: CycloptsError) -> list[str]:
    """Arguments as typed; ``-o`` counts as ``--output``."""
    return ["--output" if token == "-o" else token for token in error.root_input_tokens or ()]


def _warn(findings) -> None:
    """Print findings on standard error, a line each."""
    for finding in findings:
        print(f"warning: {printable(str(finding))}", file=sys.stderr)


def _show_warning(message, category, filename, lineno, file=None, line=None) -> None:
    """Print a warning on standard error as a finding; takes the place of `warnings.showwarning`.

    Those of other libraries say where they come from.
    """
    ours = issubclass(category, FindingWarning) or category is UserWarning
    _warn([message if ours else f"{message} ({category.__name__}, {filename}:{lineno})"])


@app.command
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
    _print(block for block in train_of(data).describe_case(data) if neighbours or not block.beside)
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
    _print_data(check_data(None if case is None else train_of(case), case, refusal))
    return 0 if refusal is None else refusal.exit_code


def _print_data(data: object) -> None:
    """Print data as JSON on standard output."""
    import json

    print(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False))


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


@app.command
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

    It prints what page one of the report answers and the verdict; of --only STAGE the table of that stage.

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
        Print the tables of all stages.
    json
        Print what decides as data, and nothing else on standard output (docs/command_line.md).
    """
    from femgear.run import run_case
    from femgear.storage.files import resumable
    from femgear.storage.results import completed_since_now, run_folder
    from femgear.trains.reading import read_case
    from femgear.trains.registry import check_case, stage_names, train_of

    if only is not None and only not in (names := stage_names()):
        raise CaseError(
            "no train has this stage",
            code="E-ARGUMENTS",
            key="--only",
            value=only,
            limit=", ".join(names),
            remedy="femgear run --help",
        )
    case = case or _only_case()
    data = read_case(case)
    check_case(data, only)  # refuse before the folder is touched
    output = output or _results_folder(case)
    train = train_of(data)
    _warn(train.case_warnings(data))
    place = run_folder(output, case=data.source, force=force)
    with resumable(output, completed_since_now(output)):
        with place as folder, Progress() as progress:

            def tell_numbers(results) -> None:
                """Print what was found, before anything is drawn."""
                with progress.aside():
                    if not json:
                        if verbose:
                            _print(train.describe_results(results))
                        else:
                            _print_briefly(train.describe_briefly(results, only))
                    _warn(train.result_warnings(results))
                    sys.stdout.flush()
                if pictures:
                    _load_xarray()

            run_case(data, folder, only=only, pictures=pictures, progress=progress, computed=tell_numbers)
        if json:
            return _print_run(output)
        _say(f"results: {output}")
        if pictures:
            _say(f"report:  {output / 'report.html'}")
        if not verbose:
            _say(f"tables:  femgear report {shlex.quote(str(output))} --verbose")
    return 0


def _print_run(folder: Path) -> int:
    """Print what decides about a run as data."""
    from femgear.stages.summary_data import run_data
    from femgear.trains.reading import open_results
    from femgear.trains.registry import train_of

    results = open_results(folder)
    _print_data(run_data(train_of(results.case), results))
    return 0


@app.command
def mcp(folder: Path = Path(), /) -> int:
    """Serve assistants by the Model Context Protocol on standard input and output, inside of one folder.

    Parameters
    ----------
    folder
        Folder of the case files and results that the assistant may read and write.
    """
    from femgear.assistant import make_server

    if not folder.is_dir():
        raise CaseError("there is no such folder", code="E-FILE", key="folder", value=str(folder), limit="a folder")
    make_server(folder.resolve()).run()
    return 0


@app.command(name="app")
def open_app(folder: Path = Path(), /, *, port: int = 0, browser: bool = True) -> int:
    """Open the app: a window in the browser with form, sliders, answers while one drags, runs and their reports.

    It serves this machine alone, and reads and writes case files and results of one folder.

    Parameters
    ----------
    folder
        Folder of case files and results.
    port
        Of this machine. Default: a free one.
    browser
        Open it in the browser; else the address is printed alone.
    """
    from femgear.run import grid_cache

    if not folder.is_dir():
        raise CaseError("there is no such folder", code="E-FILE", key="folder", value=str(folder), limit="a folder")
    with nvh_library("the app", "app"):
        from femgear.app.server import serve
    serve(folder.resolve(), grid_cache(), port=port, browser=browser)
    return 0


@app.command
def skill() -> int:
    """Print what teaches an assistant how to write case files and how to read results."""
    from femgear.assistant import SKILL

    print(SKILL.read_text(encoding="utf-8"), end="")
    return 0


@app.command
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
        File to write; the end of its name, .step or .dxf, tells the format. Default: CASE.step.
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
    _need_new([output], force=force)
    write_cad(gears, output, _say)
    for text in undrawn_faults(data) if hasattr(data, "gear_names") else ():
        _say(f"not drawn: {text}")
    _say(f"written: {output}")
    return 0


@app.command
def explain(code: str, /) -> int:
    """Say what the code of a refusal or a warning means, as in "femgear explain W-PULL".

    Parameters
    ----------
    code
        The code, as messages have it in square brackets.
    """
    from difflib import get_close_matches

    from femgear.errors import CODES
    from femgear.findings import CATALOGUE, DOUBT, FAULT, NOTE

    severities = {
        NOTE: "worth knowing",
        DOUBT: "a number may be wrong, and is marked where it stands",
        FAULT: "nothing real carries that",
    }
    name = code.strip().strip("[]").upper()
    if name in CATALOGUE:
        severity, meaning = CATALOGUE[name]
        _say(f"{name}: {meaning}")
        _say(f"A warning, which ends nothing. Severity: {severity}, {severities[severity]}.")
    elif name in CODES:
        _say(f"{name}: {CODES[name]}")
        _say("A refusal: nothing was computed. Its message has entry, value, limit and remedy.")
    else:
        near = get_close_matches(name, [*CODES, *CATALOGUE], n=3)
        raise CaseError(
            "there is no such code",
            code="E-ARGUMENTS",
            key="code",
            value=code,
            limit="the codes of docs/errors.md",
            remedy=f"meant is perhaps {' or '.join(near)}" if near else "take it from the message, as W-PULL",
        )
    return 0


def _results_folder(case: Path) -> Path:
    """Name the folder of the results of a case file, beside it."""
    return case.with_name(f"{case.stem}_results")


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
        Print what decides as data, and write no page (docs/command_line.md).
    """
    from femgear.run import report_again
    from femgear.trains.reading import open_results
    from femgear.trains.registry import train_of

    if json:
        return _print_run(folder)
    report_again(folder, static=static)
    if verbose:
        results = open_results(folder)
        _print(train_of(results.case).describe_results(results))
    _say(f"report:  {folder / 'report.html'}")
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


@app.command
def compare(*runs: Path, output: Annotated[Path, Parameter(name=("--output", "-o"))]) -> int:
    """Compare runs: entries of the cases and numbers that differ, modes of one shape, curves over each other, sounds.

    Parameters
    ----------
    runs
        Two or more folders that femgear run wrote, of cases of one kind; changes are those against the first.
    output
        Folder of the page compare.html.
    """
    from femgear.report.compare import compare_page, compared
    from femgear.storage.files import own_files, write_text
    from femgear.trains.reading import open_results
    from femgear.trains.registry import same_train

    if len(runs) < 2:
        count = f"{len(runs)} runs"
        raise CaseError("there is nothing to compare", code="E-ARGUMENTS", value=count, limit="two or more")
    own_files(output, ["compare.html"])
    opened = [open_results(folder) for folder in runs]
    train = same_train(opened)
    _print(compared(train, *opened))
    write_text(compare_page(train, *opened), output / "compare.html")
    _say(f"page: {output / 'compare.html'}")
    return 0


@app.command
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
        Of a gearbox: name of the planetary stage, where it has several.
    output
        Folder of lines.csv, order_spectrum.csv and lines.png. Default: none is written.
    """
    from femgear.measured.verdict import measured_into
    from femgear.trains.reading import read_case
    from femgear.trains.registry import heard_in, train_of

    data = read_case(case)
    gear_set = heard_in(data, stage)
    if causes and train_of(data).heard is not None:
        message, remedy = "causes are those of a set of its own", "femgear measured of the case of its teeth"
        raise CaseError(message, code="E-ARGUMENTS", key="--causes", remedy=remedy)
    wanted = recording or Recording(), search or LineSearch()
    verdict, blocks, names = measured_into(gear_set, signal, *wanted, output, further)
    _print(blocks)
    if causes:
        from femgear.causes import describe_causes, rank_causes

        sys.stdout.flush()
        with Progress() as progress:
            ranked = rank_causes(data, verdict, progress=progress)
        _print([describe_causes(ranked)])
    if names:
        _say(f"files in {output}: {', '.join(names)}")
    return 0


@Parameter(name="*")
@dataclass(frozen=True)
class Tasks:
    """What computes the tasks of a command.

    Parameters
    ----------
    workers
        Processes of this machine that compute.
    cluster
        Dask scheduler whose workers compute: tcp://host:port or tls://host:port (docs/cluster.md).
    """

    workers: Whole = 1
    cluster: str | None = None


@app.command
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
        TOML case file of a planetary set with an elastic ring that stands still.
    output
        Folder of labels.csv and of a NetCDF file for every machine. Default: orders are tabulated alone.
    tolerances
        TOML file of the distributions of errors of the machines, as in docs/samples.md. Default: no errors.
    """
    from femgear.run import grid_cache
    from femgear.stages.fault_orders import describe_fault_orders
    from femgear.study.fault_files import fault_records_into
    from femgear.study.runner import open_runner
    from femgear.trains.reading import read_case

    data = read_case(case)
    _print(describe_fault_orders(data))
    if output is None:
        return 0
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        options = {"cache": grid_cache(), "progress": progress, "runner": runner}
        parts = request or FaultRequest(), tolerances, further
        blocks, names = fault_records_into(data, output, *parts, **options)
    _print(blocks)
    _say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command
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
        Of a rig. Default: all are listed.
    signal
        Recording of the healthy rig, from its owner; none is shipped.
    output
        Case file of the rig to write.
    force
        Replace the file.
    """
    from femgear.rigs import RIGS, describe_rig, find_rig, judge_rig

    if name is None:
        _print(map(describe_rig, RIGS.values()))
        return 0
    rig = find_rig(name)
    _print([judge_rig(rig, signal, recording or Recording()) if signal is not None else describe_rig(rig)])
    if output is not None:
        _write_case(rig.source, output, force=force)
    return 0


@Parameter(name="*")
@dataclass(frozen=True)
class ModelFiles:
    """Files of a model for other programs, of a run or a case.

    Parameters
    ----------
    state_space
        File .npz or .mat: matrices A, B, C, D of the vibration, and what the meshes do over the angle.
    fmu
        File .fmu: the vibration in time as functional mock-up unit, co-simulation by FMI 2.0.
    stiffness_table
        File .csv, .mat or .npz: mesh stiffness and transmission error over the angle of the first gear.
    harmonics
        Mesh harmonics that tables of the state space and of the unit keep. Default: 100.
    force
        Replace files that are there.
    """

    state_space: Path | None = None
    fmu: Path | None = None
    stiffness_table: Path | None = None
    harmonics: Whole | None = None
    force: Annotated[bool, Parameter(negative="")] = False

    @property
    def paths(self) -> dict[str, Path]:
        """All files that are asked for, by their options."""
        named = {"--state-space": self.state_space, "--fmu": self.fmu, "--stiffness-table": self.stiffness_table}
        return {option: path for option, path in named.items() if path is not None}


def _write_models(source: Path, wanted: ModelFiles) -> None:
    """Write the models of a case file, or of the case of a run."""
    from femgear.exchange.dynamic_model import HARMONICS, check_ending, write_state_space, write_stiffness_table
    from femgear.exchange.fmu import write_fmu
    from femgear.run import dynamic_model, stiffness_table
    from femgear.trains.reading import open_results, read_case

    for option, path in wanted.paths.items():
        check_ending(path, option)
    _need_new([*wanted.paths.values()], force=wanted.force)
    of_run = open_results(source) if source.is_dir() else None
    case = read_case(source) if of_run is None else of_run.case
    harmonics = HARMONICS if wanted.harmonics is None else wanted.harmonics
    with Progress() as progress:
        if wanted.state_space is not None or wanted.fmu is not None:
            model = dynamic_model(case, progress=progress)
            if wanted.state_space is not None:
                write_state_space(model, wanted.state_space, harmonics=harmonics)
            if wanted.fmu is not None:
                write_fmu(model, wanted.fmu, harmonics=harmonics)
        if wanted.stiffness_table is not None:
            table = stiffness_table(case if of_run is None else of_run, progress=progress)
            write_stiffness_table(table, wanted.stiffness_table)
    for path in wanted.paths.values():
        _say(f"written: {path}")


@app.command
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

    Parameters
    ----------
    folder
        Folder that femgear run wrote; for models alone a case file, too.
    output
        Folder of the numbers. Default: exported, inside the other.
    """
    from femgear.run import export_results
    from femgear.storage.files import list_own, own_files
    from femgear.storage.results import EXPORTED, additions, folder_lock
    from femgear.trains.reading import open_results

    named = [name for name, wanted in vars(formats or Formats()).items() if wanted]
    if models is not None and models.paths:
        _write_models(folder, models)
        if not named:
            return 0
    if not named:
        options = ", ".join(f"--{name}" for name in (*vars(Formats()), "state-space", "fmu", "stiffness-table"))
        raise CaseError("no format is named", code="E-ARGUMENTS", limit=options, remedy="femgear export --help")
    wanted = named, sampling or Sampling()
    if output is None:
        with folder_lock(folder), additions(folder) as new, Progress() as progress:
            list_own(new / EXPORTED)
            names = export_results(open_results(folder), new / EXPORTED, *wanted, progress=progress)
    else:
        results = open_results(folder)  # refused before the other folder is touched
        own_files(output, ())
        with Progress() as progress:
            names = export_results(results, output, *wanted, progress=progress)
    _say(f"files in {output or folder / EXPORTED}: {', '.join(names)}")
    return 0


def _write_case(text: str, path: Path, *, force: bool) -> None:
    """Write a file that no other one is lost for, under a name whose results femgear run can write."""
    from femgear.storage.files import write_text

    _need_new([path], force=force)
    write_text(text, path)
    _say(f"written: {path}")


def _need_new(paths: Sequence[Path], *, force: bool) -> None:
    """Refuse files that are there already, and names under which femgear run could write no results."""
    from femgear.storage.files import checked_name

    for path in paths:
        for name in (path.name, _results_folder(path).name):
            try:
                checked_name(name)
            except StorageError as error:
                # a name that was typed is no matter of the disk
                raise CaseError(
                    error.message,
                    code="E-CHOICE",
                    key="--output",
                    value=name,
                    limit=error.limit,
                    remedy=error.remedy,
                ) from None
        if path.exists() and not force:
            raise CaseError(
                "the file is there already",
                code="E-OUTPUT",
                file=str(path),
                limit="a new file",
                remedy="name another one with -o, or add --force",
            )


@Parameter(name="*")
@dataclass(frozen=True)
class _ToothForm:
    """What is known of the teeth.

    Parameters
    ----------
    teeth
        Of sun, planet and ring, or of both gears; of planets of other kinds in the order of docs/planets.md.
    shifts
        Profile shifts of sun and planet, perhaps of the ring (positive outwards), or of both gears. Default:
        none where the teeth close without, else shared by equal sliding.
    centre_distance
        Default: that at which the shifts close the gears.
    helix
        Helix angle of planetary sets, pairs, gearboxes and helical cases. Default: none, of helical ones 20 deg.
    addendum
        Of the basic rack, in modules. Default: 1, or what leaves less to warn of.
    """

    teeth: Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative="")] = ()
    shifts: Annotated[tuple[float, ...], Parameter(consume_multiple=True, negative="")] = ()
    centre_distance: Quantity | None = None
    helix: Quantity | None = None
    addendum: float | None = None


@app.command
def new(
    kind: str,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    module: Quantity | None = None,
    torque: Quantity | None = None,
    speed: Quantity | None = None,
    planets: Whole | None = None,
    face_width: Quantity | None = None,
    form: _ToothForm | None = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write a commented case from a few numbers; masses, inertias and stiffnesses are estimated.

    Parameters
    ----------
    kind
        planetary, pair, planar, helical, drivetrain, gearbox; of other planets stepped, double, ravigneaux, wolfrom.
    output
        Case file to write. Default: KIND.toml.
    module
        Of helical teeth the normal one. Default: 2 mm.
    torque, speed
        Of sun or pinion. Default: the torque of a K factor of 1 N/mm^2, 1000 rpm.
    planets
        Default: as many as equal spacing allows, three if it can be.
    face_width
        Default: twelve modules.
    force
        Replace the file.
    """
    from femgear.trains.drafts import ToothForm, new_case

    form = form or _ToothForm()
    count = tuple(whole_number(text_of_count, "--teeth") for text_of_count in form.teeth)
    numbers: dict[str, Any] = {"teeth": count, "module": module, "torque": torque, "speed": speed}
    teeth_as = ToothForm(form.shifts, form.centre_distance, form.helix, form.addendum)
    text = new_case(kind, **numbers, planets=planets, face_width=face_width, form=teeth_as)
    output = output or Path(f"{kind}.toml")
    _write_case(text, output, force=force)
    for line in takewhile(lambda line_there: line_there.startswith("#"), text.splitlines()):
        _say(f" {line[1:]}")
    _say(f"next:    femgear run {shlex.quote(str(output))}")
    return 0


@app.command(name="import")
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
    """Write the gearbox of a REXS file; say what it has not, what is assumed and not used.

    Where shafts and stages make no gearbox each stage becomes a case with its id in the name, NAME_28.toml, the
    planetary one NAME.toml.

    Parameters
    ----------
    file
        REXS 1.0 to 2.0: .rexs, .rexsj or .rexsz.
    output
        Case file to write.
    stage
        Id of the only stage to take.
    load_case
        Number of the load case, from 1. Default: the first; of single stages with the speeds of others with its torque.
    unused
        List all attributes of the file that no case uses.
    force
        Replace the files.
    """
    from femgear.exchange.rexs import read_model
    from femgear.trains.imports import case_drafts

    model = read_model(file)
    drafts = case_drafts(model, output.name, stage=stage, load_case=load_case)
    _warn(model.findings)
    paths = [output.with_name(f"{output.stem}{case_draft.suffix}{output.suffix}") for case_draft in drafts]
    _need_new(paths, force=force)
    for draft, path in zip(drafts, paths, strict=True):
        _write_case(draft.text, path, force=force)
        if len(drafts) > 1:
            _say(f"         {draft.words}")
    _say(f"entries that are assumed: {sum(case_draft.text.count('# assumed') for case_draft in drafts)}")
    left = list(model.unused())
    count = sum(line.count(",") + 1 for line in left)
    _say(f"attributes that are not used: {count} of {len(left)} types{'' if unused else ', listed by --unused'}")
    for line in left if unused else ():
        _say(textwrap.shorten(f"  {line}", 110, placeholder=" ..."))
    return 0


@app.command
def gearbox(
    case: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write a planetary set or a pair as a gearbox of one stage; say what a gearbox has no place for.

    Its members are bodies on springs. Shafts, rolling bearings, a casing and more stages can be added to the file. A
    file of a former model (multistage, drivetrain) is written with the entries of today.

    Parameters
    ----------
    case
        TOML case file of a set, with or without the sections planar and helical, of a pair, or of a former model.
    output
        Case file to write. Default: NAME_gearbox.toml.
    force
        Replace the file.
    """
    from femgear.case import text as case_text
    from femgear.trains.gearbox_of_case import gearbox_of_case
    from femgear.trains.reading import parse_case, read_case

    written = gearbox_of_case(read_case(case))
    text = case_text.write(written.tables)
    parse_case(text)  # what is no gearbox is refused before a file is written
    _warn(written.findings)
    output = output or Path(f"{case.stem}_gearbox.toml")
    _write_case(text, output, force=force)
    _say(f"next:    femgear run {shlex.quote(str(output))}")
    return 0


@app.command
def casing(
    case: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Give a gearbox a rigid casing on feet, three sensors and a run-up, all estimated, so that a run has its sound.

    Parameters
    ----------
    case
        TOML case file of a gearbox without a casing.
    output
        Case file to write, in the folder of the case if that names other files. Default: NAME_in_casing.toml.
    force
        Replace the file.
    """
    from femgear.case import text as case_text
    from femgear.trains.reading import parse_case, read_case
    from femgear.trains.registry import train_of

    read = read_case(case)
    train = train_of(read)
    if train.draft_casing is None:
        limit, remedy = 'model = "gearbox"', f"femgear gearbox {shlex.quote(str(case))} makes one of a set or a pair"
        raise CaseError(f"{train.words} has no casing of its own", code="E-MODEL", limit=limit, remedy=remedy)
    tables, findings = train.draft_casing(read)
    output = output or case.with_name(f"{case.stem}_in_casing.toml")
    text = f"{case_text.read_text(case).rstrip()}\n\n{tables}"
    parse_case(text, name=str(output))  # what is no case is refused before a file is written
    _warn(findings)
    _write_case(text, output, force=force)
    _say(f"next:    femgear run {shlex.quote(str(output))}")
    return 0


@app.command
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
    _warn(model.findings)
    _write_case(text, output, force=force)
    return 0


@app.command(name="sweep")
def compute_sweep(
    case: Path,
    /,
    *,
    over: Annotated[tuple[str, ...], Parameter(negative="")],
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    of: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    speeds: tuple[str, str] | None = None,
    tasks: Tasks | None = None,
) -> int:
    """Compute quantities over values of entries of a case; goes on where it was interrupted.

    Parameters
    ----------
    case
        TOML case file.
    over
        As "operation.torque=50 N m,100 N m" or "sun.modifications[0].amount=0 um..12 um/7"; entries that go
        together as "sun.teeth,planet.teeth,ring.teeth=27/40/108,30/40/111". May be repeated.
    output
        Folder of sweep.csv, sweep.png and the journal sweep.jsonl.
    of
        Quantities as in docs/optimise.md: ste, ste overall, mesh force, housing, ...; of gearboxes K_Hbeta, STE,
        bearing life, level, ... of the whole or of one part; of pairs STE, root life, losses, .... May be repeated.
        Default: transmission errors; of gearboxes and pairs all that stand for the whole.
    speeds
        First and last speed of the input, for mesh forces and the housing; of gearboxes those of the run-up.
    """
    from femgear.run import grid_cache
    from femgear.study.objectives import default_quantities, need_quantities
    from femgear.study.runner import open_runner
    from femgear.study.sweep import describe_sweep, sweep_into
    from femgear.trains.reading import read_case

    data = read_case(case)
    need_quantities(data)
    of = of or default_quantities(data)
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        options = {"speeds": speeds, "cache": grid_cache(), "progress": progress, "runner": runner}
        swept, names = sweep_into(data, output, over=over, of=of, **options)
    failed = sum(bool(error) for error in swept.errors)
    _print([describe_sweep(swept)])
    cases = f"{len(swept.points)} case{'s' * (len(swept.points) != 1)}"
    print(f"{cases}, {swept.computed} computed now, {failed} cannot be computed")
    _say(f"files in {output}: {', '.join(names)}")
    return 0


@Parameter(name="*")
@dataclass(frozen=True)
class DrawnSamples:
    """Samples that a command draws.

    Parameters
    ----------
    number
        Number of samples. Default: 1000; 100 of gearboxes and pairs, each of which is solved as a run solves it.
    seed
        Sample i of a seed is the same whatever the number of samples.
    index
        Write this sample as a case file, sample_INDEX.toml, and compute none.
    of
        Of gearboxes: quantities as of femgear sweep; may be repeated. Default: all that stand for the whole.
    speeds
        Of gearboxes: first and last speed of the run-up.
    """

    number: Annotated[int | None, Parameter(name=("--number", "-n"))] = None
    seed: Whole = 1
    index: int | None = None
    of: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    speeds: tuple[str, str] | None = None


@app.command
def samples(
    case: Path,
    /,
    *,
    tolerances: Path,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    positions: Whole | None = None,
    method: Literal["spring", "exact"] | None = None,
    force: bool = False,
    drawn: DrawnSamples | None = None,
    tasks: Tasks | None = None,
) -> int:
    """Compute as-built sets over tolerances of teeth and pins, or as-built gearboxes over those of their entries.

    Parameters
    ----------
    case
        TOML case file.
    tolerances
        TOML file of the distributions of errors, as in docs/samples.md.
    output
        Folder of samples.nc, samples.png and worst.toml; of gearboxes samples.csv and percentiles.csv in place of
        the first.
    positions
        Of sets: equidistant ones of one mesh period; those of the peaks of the set and its end come beside them.
        Default: 16.
    method
        Tooth pairs as springs, whose error is stated, or the whole contact problem. Default: springs, but for
        helical teeth, back flanks and bearings with clearance, which have none.
    force
        Of sets: replace the results that the folder holds, once the new ones are computed.
    """
    from femgear.run import grid_cache
    from femgear.storage.files import own_files, write_text
    from femgear.study.objectives import has_figures
    from femgear.study.runner import open_runner
    from femgear.study.sample_results import samples_into
    from femgear.study.samples import checked, prepared, sample_case
    from femgear.trains.reading import read_case, to_toml

    drawn = drawn or DrawnSamples()
    checked(1 if drawn.number is None else drawn.number, "--number", 1)
    checked(drawn.seed, "--seed", 0, 2**32)
    checked(drawn.index or 0, "--index", 0)
    data = read_case(case)
    if has_figures(data):
        others = {"positions": positions, "method": method, "force": force or None}
        return _samples_of_entries(data, output, tolerances, drawn, tasks, others)
    _refuse_options({"of": drawn.of or None, "speeds": drawn.speeds}, "gearboxes", "leave it out")
    number, seed, index = drawn.number or 1000, drawn.seed, drawn.index
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        progress("curves of tooth pairs")
        basis = prepared(data, tolerances, positions=positions or 16, cache=grid_cache())
        progress("curves of tooth pairs", 1.0)
        if index is None:
            options = {"count": number, "seed": seed, "exact": None if method is None else method == "exact"}
            blocks, names = samples_into(data, output, basis, force=force, **options, progress=progress, runner=runner)
        else:
            blocks, names = [], [f"sample_{index}.toml"]
            own_files(output, names)
            write_text(to_toml(sample_case(data, basis[0], seed, index)), output / names[0])
    if blocks:
        _print(blocks)
    _say(f"files in {output}: {', '.join(names)}")
    return 0


def _refuse_options(options: Mapping[str, Any], of: str, remedy: str) -> None:
    """Refuse (E-ARGUMENTS) options that are given, and that other cases alone have."""
    for name, value in options.items():
        if value is not None:
            message = f"an option of samples of {of}"
            raise CaseError(message, code="E-ARGUMENTS", key=f"--{name}", value=value, remedy=remedy)


def _samples_of_entries(
    data: Any,
    output: Path,
    tolerances: Path,
    drawn: DrawnSamples,
    tasks: Tasks | None,
    others: Mapping[str, Any],
) -> int:
    """Compute samples of a gearbox, tabulate them and name the files; ``others`` are options that it has not."""
    from femgear.run import grid_cache
    from femgear.study.entry_samples import ENTRY_SAMPLES, EntryRequest, entry_samples_into
    from femgear.study.runner import open_runner

    _refuse_options(others, "planetary sets", "leave it out: samples of others are solved as femgear run does")
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        count = ENTRY_SAMPLES if drawn.number is None else drawn.number
        request = EntryRequest(drawn.of, drawn.speeds, count, drawn.seed, drawn.index)
        options = {"cache": grid_cache(), "progress": progress, "runner": runner}
        blocks, names = entry_samples_into(data, output, tolerances, request, **options)
    if blocks:
        _print(blocks)
    _say(f"files in {output}: {', '.join(names)}")
    return 0


@Parameter(name="*")
@dataclass(frozen=True)
class Search:
    """How far a search goes.

    Parameters
    ----------
    method
        Of the search; auto takes derivatives where the problem has them.
    positions
        Positions over one mesh period in the search; the refinement takes those of the case, the check 128.
    flank_elements
        Elements along a flank in the search; the refinement takes those of the case, the check 32.
    samples
        Designs before the descents. Default: five a variable.
    max_designs
        Designs after which search and refinement end.
    seed
        Of the samples.
    check
        Run case and optimum anew into the folders before and after.
    """

    method: Literal["auto", "minimax", "global", "simplex", "powell"] = "auto"
    positions: Whole = 24
    flank_elements: Whole = 12
    samples: Whole | None = None
    max_designs: Whole | None = None
    seed: Whole = 0
    check: bool = True


@Parameter(name="*")
@dataclass(frozen=True)
class Sought:
    """What is searched.

    Parameters
    ----------
    vary
        As "sun.modifications[0].amount=0 um..15 um +- 1 um" with its tolerance, or "KEY1,KEY2=0 um..15 um" of
        entries with one value; may be repeated. Default: a tip relief more on every loaded flank, its amount
        and its start; gearboxes have none.
    shape
        Of these reliefs; a linear one begins with a kink, under which the contact pressure rises (W-KINK).
    goal
        What to minimise: ste (largest of the next three), ste overall, ste sun-planet, ste planet-ring, mesh
        force, peak mesh force, housing, contact pressure, root stress sun (planet, ring), contact ratio
        sun-planet (planet-ring), tip thickness sun (planet, ring); of gearboxes K_Hbeta, STE, level, ... of the
        whole or of one part, as in "level top".
    limit
        As in "root stress sun <= 300 MPa"; of the same quantities. May be repeated.
    of
        Further quantities to report; may be repeated. Default: transmission errors, mesh forces, housing.
    second
        Second goal: the Pareto front of both is searched as well.
    torque
        Of the input. Default: that of the case.
    speeds
        First and last speed of the input, for mesh forces and the housing, by default 1000 and 3500 rpm; of
        gearboxes those of the run-up, by default as in the case.
    """

    vary: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    shape: Literal["linear", "parabolic"] = "parabolic"
    goal: str = "ste"
    limit: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    of: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    second: str | None = None
    torque: Quantity | None = None
    speeds: tuple[str, str] | None = None


@app.command
def optimise(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    sought: Sought | None = None,
    search: Search | None = None,
    tasks: Tasks | None = None,
) -> int:
    """Find the best values of some entries, checked by runs; goes on where it was interrupted.

    Search with few positions on a coarse grid, refinement with those of the case, check on a finer one. The
    optimum is written as a case file.

    Parameters
    ----------
    case
        TOML case file.
    output
        Folder of optimum.toml, tables, figures and journals.
    """
    from femgear.run import grid_cache
    from femgear.study.optimise import SearchEffort, SearchRequest, optimise_into
    from femgear.study.runner import open_runner
    from femgear.trains.reading import read_case

    request, effort = SearchRequest(**vars(sought or Sought())), SearchEffort(**vars(search or Search()))
    data = read_case(case)
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:

        def tell(blocks) -> None:
            with progress.aside():
                _print(blocks)
                sys.stdout.flush()

        names = optimise_into(
            data,
            output,
            request,
            effort,
            lambda changed, folder, stage: _run_into(changed, folder, stage, progress),
            cache=grid_cache(),
            progress=progress,
            runner=runner,
            tell=tell,
        )
    _say(f"files in {output}: {', '.join(names)}")
    return 0


def _run_into(case: Any, folder: Path, only: str, progress: Progress) -> Any:
    """Run a case into a folder up to a stage, over its former results, and open the new ones."""
    from femgear.run import run_case
    from femgear.storage.results import run_folder
    from femgear.trains.reading import open_results

    with run_folder(folder, force=True) as place:
        run_case(case, place, only=only, pictures=False, progress=progress)
    return open_results(folder, partial=False)


@app.command
def relief(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    torque: Quantity | None = None,
    also: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    largest: str | None = None,
    shape: Literal["linear", "parabolic"] = "parabolic",
    points: Whole = 7,
    positions: Whole | None = None,
) -> int:
    """Find the tip relief of sun and planets, or of a pair, with the least transmission error at one torque.

    Amount and length are searched over a map, which is drawn, and from its best point on. The relief is
    written as a case file, with the numbers that a run of it finds. Goes on where it was interrupted.

    Parameters
    ----------
    case
        TOML case file of a planetary set or a pair; the relief adds to its modifications.
    output
        Folder of relief.toml, tip_relief.csv, tip_relief.png and the journal.
    torque
        Of the input, to design for. Default: that of the case.
    also
        Further torques of maps; may be repeated. Default: half and one and a half times the first.
    largest
        Largest amount searched. Default: twice the mean deflection of the sun-planet meshes.
    shape
        Of the relief; a linear one begins with a kink, under which the contact pressure rises (W-KINK).
    points
        Points of the map along each parameter.
    positions
        Positions over one mesh period. Default: those of the case.
    """
    from femgear.run import grid_cache
    from femgear.study.tip_relief import ReliefRequest, relief_into
    from femgear.trains.reading import read_case

    request = ReliefRequest(torque, also, largest, shape, points, positions)
    data = read_case(case)
    with Progress() as progress:
        blocks, names = relief_into(data, output, request, cache=grid_cache(), progress=progress)
    _print(blocks)
    _say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command
def harris(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    relief: Annotated[tuple[str, ...], Parameter(negative="")] = ("0 um", "2 um", "4 um", "6 um", "8 um"),
    length: float = 1.0,
    shape: Literal["linear", "parabolic"] = "parabolic",
    torque: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    positions: Whole | None = None,
) -> int:
    """Compute the transmission error over torque for several tip reliefs (Harris map).

    Goes on where it was interrupted.

    Parameters
    ----------
    case
        TOML case file of a planetary set or a pair; the reliefs add to its modifications.
    output
        Folder of harris_map.csv, harris_map.png and the journal.
    relief
        Tip relief of sun and planets (sun side), such as "4 um"; may be repeated.
    length
        Of the reliefs, in lengths of two-pair contact: 1 starts at the ends of single-pair contact.
    shape
        Of the reliefs; a linear one begins with a kink, under which the contact pressure rises (W-KINK).
    torque
        Of the input; may be repeated. Default: 11 from a tenth to twice the case's.
    positions
        Positions over one mesh period. Default: those of the case.
    """
    from femgear.run import grid_cache
    from femgear.study.harris import HarrisRequest, harris_into
    from femgear.trains.reading import read_case

    request = HarrisRequest(relief, length, shape, torque, positions)
    data = read_case(case)
    with Progress() as progress:
        blocks, names = harris_into(data, output, request, cache=grid_cache(), progress=progress)
    _print(blocks)
    _say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command
def teeth(
    *,
    ratio: float,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    wanted: Annotated[WantedTeeth | None, Parameter(name="*", negative="")] = None,
    strength: Annotated[TeethStrength | None, Parameter(name="*")] = None,
) -> int:
    """Find tooth numbers for a ratio: all that assemble, by size, with phasing, hunting teeth and transmission error.

    Parameters
    ----------
    ratio
        Speed of the driving over that of the driven member: of gear 1 over gear 2, of the sun over the carrier.
    output
        Folder of teeth.csv, teeth.png and the case files of the best.
    """
    from femgear.run import grid_cache
    from femgear.study.teeth import teeth_into

    request = wanted or WantedTeeth(), strength or TeethStrength()
    with Progress() as progress:
        blocks, names = teeth_into(output, ratio, *request, cache=grid_cache(), progress=progress)
    _print(blocks)
    _say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command
def schema(*, model: str | None = None) -> int:
    """Print the JSON schema of the case file, for editors.

    Parameters
    ----------
    model
        Of the case files that name this model.
    """
    import json

    from femgear.trains.reading import case_schema

    print(json.dumps(case_schema(model), indent=1))
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line: exit code 0, 2 (bad input), 3 (numerics), 4 (storage) or 130 (interrupted)."""
    return call(app, arguments, program="femgear")


def call(program_app: App, arguments: Sequence[str] | None, *, program: str) -> int:
    """Call a program as `main` does, its warnings and errors as lines on standard error; remedies name it."""
    if arguments is None:  # a process of its own
        gc.set_threshold(_RARELY)
    for descriptor in range(3):  # a file that takes the number of a closed one would hold what is printed
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    if len(os.environ.get("COLUMNS", "80").lstrip("0")) < 2:  # rich fails or never ends in a few columns
        del os.environ["COLUMNS"]
    output, errors = _Stream(sys.stdout), _Stream(sys.stderr)
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        code = _called(program_app, sys.argv[1:] if arguments is None else list(arguments), program)
        with _handlers({signal.SIGINT: signal.SIG_IGN}):  # all is done but to show it
            output.flush()
            # a reader that has seen enough is no failure
            if code == 0 and output.error and not isinstance(output.error, BrokenPipeError):
                failure = storage_error(output.error, "standard output")
                failure.remedy = "free some space where it goes, or send it elsewhere"
                code = _fail(failure)
            errors.flush()
    if arguments is None:  # when the process ends, nothing is left to interrupt but the interpreter
        for number in (signal.SIGINT, signal.SIGTERM):
            atexit.register(signal.signal, number, signal.SIG_IGN)
    return code


class _Stream:
    """Standard stream that escapes what its encoding lacks, and keeps the failure to write in ``error``."""

    def __init__(self, stream):
        self._stream, self.error = stream or open(os.devnull, "w", encoding="utf-8"), None

    def __getattr__(self, name: str):
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        encoding = self._stream.encoding or "utf-8"
        self._try(self._stream.write, text.encode(encoding, "backslashreplace").decode(encoding))
        return len(text)

    def flush(self) -> None:
        self._try(self._stream.flush)

    def _try(self, function, *arguments) -> None:
        try:
            function(*arguments)
        except OSError as error:
            self.error = self.error or error
            # what the buffer holds would fail again when the interpreter ends
            with contextlib.suppress(OSError), open(os.devnull, "wb") as nothing:
                os.dup2(nothing.fileno(), self._stream.fileno())


def _called(program_app: App, tokens: list[str], program: str) -> int:
    """Exit code of a program, its errors told."""
    try:
        with warnings.catch_warnings(), _termination_interrupts():
            warnings.showwarning = _show_warning
            result = program_app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        return result if isinstance(result, int) else 0
    except CycloptsError as error:
        return _fail(_wrong_arguments(error, program))
    except FemgearError as error:
        return _fail(error)
    except KeyboardInterrupt as interrupt:
        print(printable("; ".join(["interrupted", *getattr(interrupt, "__notes__", [])])), file=sys.stderr)
        return _INTERRUPTED
    except (MemoryError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and "new thread" not in str(error):
            raise
        return _fail(
            FemgearError(
                f"the memory of this machine does not suffice: {error}".removesuffix(": "),
                code="E-MEMORY",
                remedy="ask for fewer speeds, positions, harmonics or elements",
            )
        )
    except np.linalg.LinAlgError as error:
        remedy = "look for masses, stiffnesses or dimensions of very different size"
        return _fail(FemgearError(f"equations cannot be solved: {error}", code="E-SOLVE", remedy=remedy))
    except ImportError as error:
        message = f"a library cannot be loaded: {' '.join(str(error).split())}"
        return _fail(FemgearError(message, code="E-LIBRARY", remedy=_LOADING))
    except OSError as error:
        return _fail(storage_error(error, error.filename))


@contextlib.contextmanager
def _termination_interrupts() -> Iterator[None]:
    """End the block by SIGTERM as by Ctrl-C, so that files stay whole and locks are released."""
    hook = sys.unraisablehook

    def again(lost: Any) -> None:
        # Python drops what is raised while it clears an object up: the interrupt comes once more
        if issubclass(lost.exc_type, KeyboardInterrupt):
            threading.Timer(0.02, _thread.interrupt_main).start()
        else:
            hook(lost)

    with noted_interrupts() as interrupt:
        caught = [signal.SIGTERM]
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored on purpose
            caught.append(signal.SIGINT)
        with _handlers(dict.fromkeys(caught, interrupt)):
            sys.unraisablehook = again
            try:
                yield
            finally:
                sys.unraisablehook = hook


@contextlib.contextmanager
def _handlers(handlers: Mapping[signal.Signals, Any]) -> Iterator[None]:
    """Handle signals so in the block; in the main thread alone, where they arrive."""
    main = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()} if main else {}
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)


if __name__ == "__main__":
    sys.exit(main())
