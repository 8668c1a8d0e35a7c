#!/usr/bin/env python3
"""Write tests/slow_tests.txt: tests that run no line of femgear which quicker tests do not run too.

`make test` leaves them to `make validate`. From the map of which test runs which line and how long it takes, which
`mutation.py` keeps, tests are taken in the order of their seconds, so that of two with the same lines the quicker one
stays. All quick ones stay, those of the documentation, whose numbers are promises, those that run in processes of their
own, and those marked ``decisive``: they notice a change of a number that the others let pass. ::

    python validation/tools/slow_tests.py --work out/mutants
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from pathlib import Path

from mutants import ROOT
from mutation import LineMap, preload

PAGE = ROOT / "tests" / "slow_tests.txt"
QUICK = 0.3
"""Seconds, of a process that notes which lines it runs, up to which a test stays."""
PROMISES = ("tests/docs/", "tests/soak/")
"""Tests that stay whatever lines they run."""


def lines_by_test(lines: LineMap) -> dict[str, set[tuple[str, int]]]:
    """Lines (module, number) that each test runs in its call; those of fixtures belong to no test."""
    import coverage

    found = defaultdict[str, set[tuple[str, int]]](set)
    for name in lines.files:
        data = coverage.CoverageData(str(lines.path(name)))
        data.read()
        for path in data.measured_files():
            module = Path(path).name if ROOT not in Path(path).parents else str(Path(path).relative_to(ROOT))
            for line, contexts in data.contexts_by_lineno(path).items():
                for context in contexts:
                    if context.endswith("|call"):
                        found[context.removesuffix("|call")].add((module, line))
    return found


def without_lines_of_their_own(
    seconds: dict[str, float], ran: dict[str, set[tuple[str, int]]], quick: float = QUICK
) -> list[str]:
    """Tests that are not quick and run no line that quicker ones do not run; those that run none at all stay."""
    met, listed = set[tuple[str, int]](), list[str]()
    for test in sorted(seconds, key=lambda test: (seconds[test], test)):
        own = ran.get(test, set())
        if own and own <= met and seconds[test] > quick and not test.startswith(PROMISES):
            listed.append(test)
        else:
            met |= own
    return sorted(listed)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "mutants", help="folder of the map of lines")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time")
    given = parser.parse_args()
    preload()
    lines = LineMap(given.work / "lines", ["tests"])
    with tempfile.TemporaryDirectory(prefix="femgear-lines-") as folder:
        lines.make(given.jobs, Path(folder) / "map")
    lines.load()
    listed = without_lines_of_their_own(lines.seconds, lines_by_test(lines))
    PAGE.write_text("".join(f"{test}\n" for test in listed), encoding="utf-8")
    print(f"{len(listed)} tests of {sum(lines.seconds[test] for test in listed):.0f} s: {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
