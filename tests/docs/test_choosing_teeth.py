"""docs/choosing_teeth.md: its examples print what it says."""

import re

import pytest
from page_examples import read_page, run_examples

PAGE, EXAMPLES, PRINTED = read_page("choosing_teeth.md")


@pytest.fixture(scope="module")
def outputs():
    return run_examples("choosing_teeth.md", EXAMPLES)


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 7


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]


def test_frequencies_in_the_prose_are_those_of_the_example(outputs):
    peaks = set(re.findall(r"(\d+) Hz", outputs[3]))
    assert peaks == set(re.findall(r"peak\s+at\s+(\d+)\s+Hz", PAGE)) and len(peaks) == 2


def test_table_of_the_eight_cases_is_computed():
    """Tooth numbers, class, closure, kinds of the four harmonics and peaks of the printed table."""
    import numpy as np
    from published.planetary_sets import TABLE_2, cases, kahraman_set

    from femgear.gears.phasing import phase_factors, phasing_table
    from femgear.solvers.linear.receptance import modal_error_response
    from femgear.stages.lumped_set import gear_set_modes

    data, hertz = kahraman_set(), np.arange(5000.0, 15000.0, 5.0)
    modes = gear_set_modes(data, damping_ratio=0.005)
    for letter, case in cases().items():
        sun, ring, planet, printed_class = TABLE_2[letter]
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| {letter} |"))
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        assert cells[1:3] == [f"{sun}-{ring}-{planet}", printed_class]
        assert int(cells[3].replace("−", "-")) == ring - sun - 2 * planet
        kinds = phasing_table(case, range(1, 5)).kind
        assert cells[4] == (f"{kinds[0]}, all four" if len(set(kinds)) == 1 else ", ".join(kinds))
        error = 1e-6 * phase_factors(case, [1]).T
        force = np.abs(modal_error_response(modes, hertz, error).force[0, :, 0, 0])
        assert float(cells[5]) == hertz[force.argmax()]
