"""Compute the tables of docs/validation.md: ``python tests/validation [-o FILE] [--theme NAME] ...``."""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "scripts")]


def main() -> int:
    """Run the themes that are asked for; 3 when a row fails its gate."""
    from rich.console import Console
    from rich.progress import Progress

    from femgear.errors import FemgearError
    from validation import validate

    parser = argparse.ArgumentParser(prog="python tests/validation", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="Markdown file; docs/validation.md without --theme")
    parser.add_argument("--theme", help="compute this theme alone and print each of its rows")
    parser.add_argument("--quick", action="store_true", help="leave out what takes long")
    given = parser.parse_args()
    if given.output is None and given.theme is None:
        given.output = ROOT / "docs" / "validation.md"
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("")
        try:
            return validate(
                given.output,
                theme=given.theme,
                quick=given.quick,
                progress=lambda name, done, total: bar.update(
                    task, description=name, completed=done, total=total
                ),
            )
        except FemgearError as error:
            print(error, file=sys.stderr)
            return 2


if __name__ == "__main__":
    raise SystemExit(main())
