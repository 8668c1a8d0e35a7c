"""docs/choosing_teeth.md: its examples print what it says."""

import re

import pytest
from page_examples import read_page, run_examples

PAGE, EXAMPLES, PRINTED = read_page("choosing_teeth.md")


@pytest.fixture(scope="module")
def outputs():
    return run_examples("choosing_teeth.md", EXAMPLES)


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 5


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]


def test_frequencies_in_the_prose_are_those_of_the_example(outputs):
    peaks = set(re.findall(r"(\d+) Hz", outputs[3]))
    assert peaks == set(re.findall(r"peak at (\d+) Hz", PAGE)) and len(peaks) == 2
