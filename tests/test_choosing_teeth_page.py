"""docs/choosing_teeth.md: its examples print what it says."""

import contextlib
import io
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "choosing_teeth.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
PRINTED = re.findall(r"^```text\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def outputs():
    """What the examples print, run one after the other as on the page."""
    names, found = {"__name__": "__main__"}, []
    for number, example in enumerate(EXAMPLES):
        output = io.StringIO()
        with contextlib.redirect_stdout(output):
            exec(compile(example, f"docs/choosing_teeth.md, example {number + 1}", "exec"), names)
        found.append(output.getvalue())
    return found


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 5


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]


def test_frequencies_in_the_prose_are_those_of_the_example(outputs):
    peaks = set(re.findall(r"(\d+) Hz", outputs[3]))
    assert peaks == set(re.findall(r"peak at (\d+) Hz", PAGE)) and len(peaks) == 2
