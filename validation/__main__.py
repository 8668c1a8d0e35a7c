"""Compute the rows of docs/validation.csv and its page: ``python validation [-o FILE] [--theme NAME] ...``."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "scripts")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the themes that are asked for.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process when left out.

    Returns
    -------
    int
        Exit code: 0, 2 (bad input), 3 (a row fails its gate), 4 (storage), 130 (interrupted).
    """
    from rich.console import Console
    from rich.progress import Progress

    from femgear.errors import FemgearError
    from validation import validate

    parser = argparse.ArgumentParser(prog="python validation", description=__doc__)
    parser.add_argument(
        "-o", "--output", type=Path, help="page, rows beside it as .csv; docs/validation.md without --theme"
    )
    parser.add_argument("--theme", help="compute this theme alone and print each of its rows")
    parser.add_argument("--quick", action="store_true", help="leave out what takes long")
    parser.add_argument("--page", action="store_true", help="compute nothing: write the page from its rows")
    given = parser.parse_args(arguments)
    if given.output is None and given.theme is None:
        given.output = ROOT / "docs" / "validation.md"
    if given.page:
        return _write_page(given.output)
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("")
        try:
            return validate(
                given.output,
                theme=given.theme,
                quick=given.quick,
                progress=lambda name, done, total: bar.update(task, description=name, completed=done, total=total),
            )
        except FemgearError as error:
            print(error, file=sys.stderr)
            return error.exit_code
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            return 130


def _write_page(output: Path) -> int:
    from validation.page import write_page_of_rows
    from validation.themes import THEMES

    write_page_of_rows(output, {theme.title: theme.introduction for theme in THEMES})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
