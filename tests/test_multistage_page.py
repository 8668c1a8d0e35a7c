"""docs/multistage.md: its examples print what it says, the names in it exist."""

import importlib
import re

import pytest
from page_examples import read_page, run_examples

PAGE, EXAMPLES, PRINTED = read_page("multistage.md")


@pytest.fixture(scope="module")
def outputs():
    return run_examples("multistage.md", EXAMPLES)


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 4


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]


def test_named_modules_exist():
    named = re.findall(r"`(femgear(?:\.\w+)+)`", PAGE)
    assert named
    for name in named:
        importlib.import_module(name)


def test_range_of_mesh_stiffness_is_that_of_the_example():
    from femgear.models.multistage_example import four_stage_train

    stiffness = [k for stage in four_stage_train().stages for k in stage.data.mesh_stiffness]
    low, high = (float(one) * 1e3 for one in re.findall(r"example have (\S+) to (\S+) N/mm", PAGE)[0])
    assert min(stiffness) == pytest.approx(low, rel=0.1) and max(stiffness) == pytest.approx(high, rel=0.1)
