"""The command line: ``femgear check``, ``run``, ``report``, ``validate`` and ``schema``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

from femgear import __version__
from femgear.errors import FemgearError
from femgear.files import storage_error

INTERRUPTED = 130

app = App(
    name="femgear",
    version=__version__,
    help="Planetary gear sets: from tooth geometry to the vibration heard on the housing.",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
)


class _Progress:
    """Bars on the terminal, or one line a stage where standard error is a file; called by the stages."""

    def __enter__(self):
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self._console = Console(stderr=True, markup=False, highlight=False)
        columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
        self._bars = Progress(*columns, console=self._console, disable=not self._console.is_terminal)
        self._tasks = {}
        self._bars.start()
        return self

    def __exit__(self, *_):
        self._bars.stop()

    def __call__(self, stage: str, done: float = 0.0, total: float = 1.0) -> None:
        """Say that ``done`` of ``total`` steps of a stage are done."""
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=total)
            if not self._console.is_terminal:
                self._console.print(stage)
        self._bars.update(self._tasks[stage], completed=done, total=total)


def _print(blocks) -> None:
    """Print blocks of `femgear.summary` as tables on standard output."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(markup=False, highlight=False, emoji=False)
    if not console.is_terminal:
        console.width = 120
    for block in blocks:
        console.print(f"\n{block.title}")
        if block.rows:
            table = Table(box=box.SIMPLE_HEAD if block.header else None, show_header=bool(block.header))
            for index, name in enumerate(block.header or block.rows[0]):
                table.add_column(name if block.header else "", justify="right" if index else "left")
            for row in block.rows:
                table.add_row(*row)
            console.print(table)
        for note in block.notes:
            console.print(f"  {note}")


def _fail(error: FemgearError) -> int:
    print(error, file=sys.stderr)
    return error.exit_code


@app.command
def check(case: Path, /) -> int:
    """Read a case, check its gears and print what they are.

    Parameters
    ----------
    case
        TOML case file.
    """
    from femgear.case import planetary_set, read_case
    from femgear.summary import describe_case

    data = read_case(case)
    _print(describe_case(data, planetary_set(data)))
    return 0


@app.command
def run(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    only: Literal["static", "modes", "dynamics", "housing"] | None = None,
    pictures: bool = True,
    force: bool = False,
) -> int:
    """Compute a case and write results, pictures and report.

    Parameters
    ----------
    case
        TOML case file.
    output
        Folder of the results.
    only
        Compute this stage and what it needs, no further.
    pictures
        Draw figures, fields and report.
    force
        Replace the results that the folder holds.
    """
    from femgear.case import planetary_set, read_case
    from femgear.run import run_case
    from femgear.storage import open_results, prepare_output
    from femgear.summary import describe_results

    data = read_case(case)
    planetary_set(data)  # refuse before the folder is touched
    folder = prepare_output(output, force=force)
    with _Progress() as progress:
        run_case(data, folder, only=only, pictures=pictures, progress=progress)
    results = open_results(folder)
    _print(describe_results(results))
    print(f"results: {folder}")
    if (folder / "report.html").is_file():
        print(f"report:  {folder / 'report.html'}")
    return 0


@app.command
def report(folder: Path, /) -> int:
    """Write report.html from the results in a folder.

    Parameters
    ----------
    folder
        Folder that femgear run wrote.
    """
    from femgear.run import report_again

    report_again(folder)
    print(f"report:  {folder / 'report.html'}")
    return 0


@app.command
def validate(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("docs/validation.md"),
    quick: bool = False,
) -> int:
    """Compute the validation tables and write them; exit code 3 if a row fails.

    Parameters
    ----------
    output
        Markdown file.
    quick
        Leave out what takes long.
    """
    from femgear.validation import validate as compute

    with _Progress() as progress:
        return compute(output, quick=quick, progress=progress)


@app.command
def schema() -> int:
    """Print the JSON schema of the case file, for editors."""
    import json

    from femgear.case import case_schema

    print(json.dumps(case_schema(), indent=1))
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process when left out.

    Returns
    -------
    int
        Exit code: 0, 2 (bad input), 3 (numerical failure), 4 (storage), 130 (interrupted).
    """
    tokens = sys.argv[1:] if arguments is None else list(arguments)
    try:
        result = app(tokens, exit_on_error=False, result_action="return_value")
        return result if isinstance(result, int) else 0
    except CycloptsError:
        return 2
    except FemgearError as error:
        return _fail(error)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        return 0
    except OSError as error:
        return _fail(storage_error(error, error.filename))
