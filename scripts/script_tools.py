"""What the scripts share: the reference case, progress, tables, CSV files, errors as messages."""

from __future__ import annotations

import csv
import io
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from femgear.errors import FemgearError

REFERENCE_CASE = Path(__file__).resolve().parents[1] / "cases" / "planetary_27_40_108.toml"


def run_script(command: Callable[..., None], *, arguments: Sequence[str] | None = None) -> int:
    """Call a function with the arguments of the command line.

    Parameters
    ----------
    command : callable
        Its signature and docstring make the options and ``--help``.
    arguments : sequence of str, optional
        Those of the process when left out.

    Returns
    -------
    int
        Exit code: 0, 2 (bad input), 3 (numerical failure), 4 (storage), 130 (interrupted).
    """
    from cyclopts import App, CycloptsError

    from femgear.cli import show_warning, wrong_arguments
    from femgear.storage.files import storage_error
    from femgear.trains.protocol import one_blas_thread

    program = Path(sys.argv[0]).name
    app = App(
        name=program,
        version_flags=(),
        help_format="plaintext",
        suppress_keyboard_interrupt=False,
    )
    app.default(command)
    try:
        with one_blas_thread(), warnings.catch_warnings():
            warnings.showwarning = show_warning
            app(
                sys.argv[1:] if arguments is None else list(arguments),
                exit_on_error=False,
                print_error=False,
                result_action="return_value",
            )
        return 0
    except CycloptsError as error:
        return _fail(wrong_arguments(error, program))
    except FemgearError as error:
        return _fail(error)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        return 0
    except OSError as error:
        return _fail(storage_error(error, error.filename))


def _fail(error: FemgearError) -> int:
    print(error, file=sys.stderr)
    return error.exit_code


def ready_folder(folder: Path) -> Path:
    """The folder, created where it does not exist."""
    from femgear.storage.files import storage_errors

    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


class Progress:
    """One bar a stage on the terminal, or one line a stage where standard error is a file.

    Entered with ``with``; called by the stages with (stage, done, total).
    """

    def __enter__(self):
        from rich.console import Console
        from rich.progress import Progress as Bars

        self._console = Console(stderr=True, markup=False, highlight=False)
        self._bars = Bars(console=self._console, disable=not self._console.is_terminal)
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


def print_table(title: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """A table on standard output, first column to the left, the others to the right."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(markup=False, highlight=False, emoji=False)
    if not console.is_terminal:
        console.width = 140
    table = Table(box=box.SIMPLE_HEAD)
    for index, name in enumerate(header):
        table.add_column(name, justify="right" if index else "left")
    for row in rows:
        table.add_row(*row)
    console.print(f"\n{title}")
    console.print(table)


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table as CSV, units in the header; the file is either the old or the new one, whole."""
    from femgear.storage.files import write_text

    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow(f"{value:.9g}" if isinstance(value, float) else value for value in row)
    write_text(stream.getvalue(), path)


def say_files(folder: Path, names: Sequence[str]) -> None:
    """Print where the files are."""
    print(f"files in {folder}: {', '.join(names)}")
