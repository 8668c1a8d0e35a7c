"""validation/tools/slow_tests.py: what tests cost, and which of them run no line of their own."""

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "validation" / "tools"))

from slow_tests import PAGE, PROMISES, Cost, nothing_listed, without_lines_of_their_own

TOOLS = Path(__file__).parents[2] / "validation" / "tools"
LINES = {"tests/a.py::quick": {1, 2}, "tests/a.py::same": {1, 2}, "tests/a.py::more": {2, 3}, "tests/b.py::late": {3}}
TESTS = """
import time
import pytest

def spend(seconds):
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass

@pytest.fixture(scope="module")
def mesh():
    spend(0.3)

@pytest.fixture(scope="module")
def results(mesh):
    spend(0.15)

@pytest.fixture
def case():
    spend(0.1)

def test_first(results):
    pass

def test_second(results, case):
    spend(0.1)

def test_plain():
    pass
"""


def costs(seconds: dict[str, float]) -> dict[str, Cost]:
    return {test: Cost(value) for test, value in seconds.items()}


def test_of_tests_with_the_same_lines_the_quicker_one_stays():
    seconds = {"tests/a.py::quick": 0.1, "tests/a.py::same": 2.0, "tests/a.py::more": 3.0, "tests/b.py::late": 5.0}
    assert without_lines_of_their_own(costs(seconds), LINES) == ["tests/a.py::same", "tests/b.py::late"]
    # the other way round
    seconds = {name: 10.0 - value for name, value in seconds.items()}
    assert without_lines_of_their_own(costs(seconds), LINES) == ["tests/a.py::quick"]


def test_quick_ones_promises_and_those_without_lines_stay():
    seconds = dict.fromkeys(LINES, 0.2)
    assert without_lines_of_their_own(costs(seconds), LINES) == []
    promise = f"{PROMISES[0]}test_page.py::test_example"
    seconds = {"tests/a.py::quick": 0.1, promise: 9.0, "tests/test_layers.py::structure": 9.0}
    assert without_lines_of_their_own(costs(seconds), LINES | {promise: {1}}) == []


def test_a_shared_fixture_counts_where_it_is_made_for_no_other_test():
    whole = {"a::run": Cost(0.1, {"run": 2.0}), "a::again": Cost(0.1, {"run": 2.0}), "b::quick": Cost(0.1)}
    lines = {"a::run": {1}, "a::again": {1}, "b::quick": {1}}
    assert without_lines_of_their_own(whole, lines) == ["a::again", "a::run"]
    # one of them has a line of its own: the other one costs little beside it, whichever comes first
    for test in ("a::run", "a::again"):
        assert without_lines_of_their_own(whole, lines | {test: {1, 2}}) == []


def test_costs_are_those_of_a_warm_process_and_fixtures_stand_apart(tmp_path):
    """In a process of its own, as a session of pytest has but one."""
    (tmp_path / "test_times.py").write_text(TESTS)
    script = (
        f"import sys; sys.path.append({str(TOOLS)!r})\nimport slow_tests\nslow_tests.preload = lambda: None\n"
        "slow_tests.pkgutil.walk_packages = lambda *_: ()\n"
        f"for name, cost in slow_tests.warm_costs(['test_times.py'], '--rootdir', {str(tmp_path)!r}).items():\n"
        "    print('cost', name.split('::')[1], cost.alone, cost.beside(set()), *cost.fixtures.values())"
    )
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True)
    rows = [line.split()[1:] for line in run.stdout.splitlines() if line.startswith("cost ")]
    seconds = {name: sorted(map(float, values)) for name, *values in rows}
    assert seconds["test_first"] == pytest.approx([0.0, 0.15, 0.3, 0.45], abs=0.08)
    assert seconds["test_second"] == pytest.approx([0.15, 0.2, 0.3, 0.65], abs=0.08)
    assert seconds["test_plain"] == pytest.approx([0.0, 0.0], abs=0.08)


def test_a_list_that_could_not_be_made_anew_is_back(tmp_path, monkeypatch):
    page = tmp_path / "slow_tests.txt"
    page.write_text("tests/a.py::quick\n")
    monkeypatch.setattr("slow_tests.PAGE", page)
    with pytest.raises(KeyboardInterrupt), nothing_listed():
        assert page.read_text() == ""
        raise KeyboardInterrupt
    assert page.read_text() == "tests/a.py::quick\n"


def test_the_list_names_tests_of_files_that_are_there():
    listed = PAGE.read_text(encoding="utf-8").splitlines()
    assert listed == sorted(set(listed)) and len(listed) > 50
    missing = {name.split("::")[0] for name in listed if not (PAGE.parents[1] / name.split("::")[0]).exists()}
    assert not missing
