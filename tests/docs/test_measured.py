"""docs/measured.md: the example of a torque that ripples prints what the page says."""

import pytest
from page_examples import read_page, run_examples

PAGE, EXAMPLES, PRINTED = read_page("measured.md")


@pytest.mark.slow
def test_examples_print_what_the_page_says():
    assert run_examples("measured.md", EXAMPLES) == PRINTED and len(PRINTED) == 1
