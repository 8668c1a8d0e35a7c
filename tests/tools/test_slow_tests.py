"""validation/tools/slow_tests.py: which tests run no line of their own."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "validation" / "tools"))

from slow_tests import PAGE, PROMISES, without_lines_of_their_own

LINES = {"tests/a.py::quick": {1, 2}, "tests/a.py::same": {1, 2}, "tests/a.py::more": {2, 3}, "tests/b.py::late": {3}}


def test_of_tests_with_the_same_lines_the_quicker_one_stays():
    seconds = {"tests/a.py::quick": 0.1, "tests/a.py::same": 2.0, "tests/a.py::more": 3.0, "tests/b.py::late": 5.0}
    assert without_lines_of_their_own(seconds, LINES) == ["tests/a.py::same", "tests/b.py::late"]
    # the other way round
    seconds = {name: 10.0 - value for name, value in seconds.items()}
    assert without_lines_of_their_own(seconds, LINES) == ["tests/a.py::quick"]


def test_quick_ones_promises_and_those_without_lines_stay():
    seconds = dict.fromkeys(LINES, 0.2)
    assert without_lines_of_their_own(seconds, LINES) == []
    promise = f"{PROMISES[0]}test_page.py::test_example"
    seconds = {"tests/a.py::quick": 0.1, promise: 9.0, "tests/test_layers.py::structure": 9.0}
    assert without_lines_of_their_own(seconds, LINES | {promise: {1}}) == []


def test_the_list_names_tests_of_files_that_are_there():
    listed = PAGE.read_text(encoding="utf-8").splitlines()
    assert listed == sorted(set(listed)) and len(listed) > 50
    missing = {name.split("::")[0] for name in listed if not (PAGE.parents[1] / name.split("::")[0]).exists()}
    assert not missing
