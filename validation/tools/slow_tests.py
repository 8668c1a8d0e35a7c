#!/usr/bin/env python3
"""Write tests/slow_tests.txt: tests that run no line of femgear which quicker tests do not run too.

`make test` leaves them to `make validate`. A map tells which test runs which line, as that of `mutation.py`. What a
test costs is measured apart from it, in one process that has loaded all modules before: else the first test of a
file would pay for them. Tests are taken in the order of their costs, so that of two with the same lines the quicker
one stays. All quick ones stay, those of the documentation, whose numbers are promises, those that run in processes
of their own, and those marked ``decisive``: they notice a change of a number that the others let pass. It takes
about an hour. ::

    python validation/tools/slow_tests.py --work out/slow_tests
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import pkgutil
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from mutants import ROOT
from mutation import LineMap, cpu_seconds, preload

PAGE = ROOT / "tests" / "slow_tests.txt"
QUICK = 0.3
"""Seconds of a processor up to which a test stays."""
PROMISES = ("tests/docs/", "tests/soak/")
"""Tests that stay whatever lines they run."""


@dataclass(frozen=True)
class Cost:
    """Seconds of a processor that a test takes: ``alone``, and for ``fixtures`` that it shares, by their names."""

    alone: float
    fixtures: Mapping[str, float] = field(default_factory=dict)

    def beside(self, made: set[str]) -> float:
        """Seconds where some fixtures are made for other tests anyway."""
        return self.alone + sum(seconds for name, seconds in self.fixtures.items() if name not in made)


class Stopwatch:
    """A plugin of pytest that notes the costs of tests and of the fixtures that they share."""

    def __init__(self):
        self.alone: dict[str, float] = {}
        self.fixture_names: dict[str, list[str]] = {}
        self.made: dict[str, float] = defaultdict(float)
        self._in_shared = 0.0

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef, request):
        """Note what a shared fixture takes by itself, without those that it asks for."""
        begin, before = cpu_seconds(), self._in_shared
        try:
            return (yield)
        finally:
            if fixturedef.scope != "function":
                whole, nested = cpu_seconds() - begin, self._in_shared - before
                file = request.node.nodeid.split("::")[0]
                self.made[fixturedef.argname if fixturedef.scope == "session" else f"{file}::{fixturedef.argname}"] += (
                    whole - nested
                )
                self._in_shared = before + whole

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self, item):
        """Note the fixtures of a test, and what those take that it does not share."""
        self.fixture_names[item.nodeid] = item.fixturenames
        begin, before = cpu_seconds(), self._in_shared
        try:
            return (yield)
        finally:
            self.alone[item.nodeid] = cpu_seconds() - begin - (self._in_shared - before)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        """Add the test itself."""
        begin = cpu_seconds()
        try:
            return (yield)
        finally:
            self.alone[item.nodeid] += cpu_seconds() - begin

    def costs(self) -> dict[str, Cost]:
        """Costs of all tests that were run."""
        costs = {}
        for test, seconds in self.alone.items():
            file = test.split("::")[0]
            names = (key for name in self.fixture_names[test] for key in (name, f"{file}::{name}"))
            costs[test] = Cost(seconds, {name: self.made[name] for name in names if name in self.made})
        return costs


def warm_costs(files: list[str], *options: str) -> dict[str, Cost]:
    """Run tests in this process, after all that they load, and give their costs."""
    import femgear

    preload()
    for module in pkgutil.walk_packages(femgear.__path__, "femgear."):
        # a worker is a process of its own; a library may be missing
        if not module.name.endswith("_worker"):
            with contextlib.suppress(ImportError):
                importlib.import_module(module.name)
    watch = Stopwatch()
    pytest.main(["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--benchmark-disable", *options, *files], [watch])
    return watch.costs()


def lines_by_test(lines: LineMap) -> dict[str, set[tuple[str, int]]]:
    """Lines (module, number) that each test runs in its call; those of fixtures belong to no test."""
    import coverage

    ran = defaultdict[str, set[tuple[str, int]]](set)
    for name in lines.files:
        data = coverage.CoverageData(str(lines.path(name)))
        data.read()
        for path in data.measured_files():
            module = Path(path).name if ROOT not in Path(path).parents else str(Path(path).relative_to(ROOT))
            for line, contexts in data.contexts_by_lineno(path).items():
                for context in contexts:
                    if context.endswith("|call"):
                        ran[context.removesuffix("|call")].add((module, line))
    return ran


def without_lines_of_their_own(
    costs: Mapping[str, Cost], ran: Mapping[str, set[tuple[str, int]]], quick: float = QUICK
) -> list[str]:
    """Tests that are not quick and run no line that quicker ones do not run; those that run none at all stay.

    A test is quick by itself or with its fixtures; where these are made for tests that stay, they cost it nothing.
    """
    covered, made, listed = set[tuple[str, int]](), set[str](), list[str]()
    for test in sorted(costs, key=lambda test: (costs[test].beside(set()), test)):
        lines = ran.get(test, set())
        if lines and lines <= covered and costs[test].beside(made) > quick and not test.startswith(PROMISES):
            listed.append(test)
        else:
            covered |= lines
            made |= costs[test].fixtures.keys()
    return sorted(test for test in listed if costs[test].beside(made) > quick)


@contextlib.contextmanager
def nothing_listed() -> Iterator[None]:
    """Empty the list, so that all tests are run; it is back where that fails."""
    before = PAGE.read_text(encoding="utf-8")
    PAGE.write_text("", encoding="utf-8")
    try:
        yield
    except BaseException:
        PAGE.write_text(before, encoding="utf-8")
        raise


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "slow_tests", help="folder of the map of lines")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time, of the map")
    given = parser.parse_args()
    preload()
    with nothing_listed():
        lines = LineMap(given.work / "lines", ["tests"])
        with tempfile.TemporaryDirectory(prefix="femgear-lines-") as folder:
            lines.make(given.jobs, Path(folder) / "map")
        costs = warm_costs([str(ROOT / "tests")])
        listed = without_lines_of_their_own(costs, lines_by_test(lines))
        PAGE.write_text("".join(f"{test}\n" for test in listed), encoding="utf-8")
    print(f"{len(listed)} tests of {sum(costs[test].alone for test in listed):.0f} s: {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
