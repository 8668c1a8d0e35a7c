"""What the scripts share: the reference case, progress, tables, CSV files, the command line."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from femgear.commands.process import call
from femgear.commands.terminal import Progress as Progress
from femgear.errors import CaseError, printable
from femgear.storage.files import own_files
from femgear.storage.files import write_csv as write_csv

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
    from cyclopts import App

    from femgear.stages.protocol import one_blas_thread

    program = Path(sys.argv[0]).name
    app = App(
        name=program,
        version_flags=(),
        help_format="plaintext",
        suppress_keyboard_interrupt=False,
    )
    # within the call, which says what ends it
    app.default(one_blas_thread()(command))
    return call(app, arguments, program=program)


def ready_folder(folder: Path, names: Sequence[str]) -> Path:
    """The folder, created where it does not exist; files of these names that are not its own are refused."""
    own_files(folder, names)
    return folder


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


def say_files(folder: Path, names: Sequence[str]) -> None:
    """Print where the files are."""
    print(printable(f"files in {folder}: {', '.join(names)}"))


def meshed(text: str):
    """Grid of a geometry of Gmsh, tetrahedra of four nodes, or of ten where the geometry asks for second order.

    Gmsh runs in a process of its own.
    """
    from skfem import Mesh

    with TemporaryDirectory() as folder:
        source, grid = Path(folder) / "solid.geo", Path(folder) / "solid.msh"
        source.write_text(text, encoding="utf-8")
        run = "import sys, gmsh; gmsh.initialize(sys.argv, run=True)"
        words = [sys.executable, "-c", run, "-3", "-v", "1", "-format", "msh22", source, "-o", grid]
        done = subprocess.run(words, capture_output=True, text=True, timeout=600)
        if done.returncode or not grid.is_file():
            raise CaseError(f"Gmsh made no grid: {done.stderr[-200:]}", code="E-GRID-GMSH")
        return Mesh.load(grid)
