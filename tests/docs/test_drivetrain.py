"""docs/drivetrain.md: its examples print what it says."""

import pytest
from page_examples import read_page, run_examples

PAGE, EXAMPLES, PRINTED = read_page("drivetrain.md")


@pytest.fixture(scope="module")
def outputs():
    return run_examples("drivetrain.md", EXAMPLES)


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 2


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]
