"""docs/side_bands.md: its example prints what it says."""

from page_examples import read_page, run_examples

_, EXAMPLES, PRINTED = read_page("side_bands.md")


def test_example_prints_what_the_page_says():
    assert len(EXAMPLES) == 1 and run_examples("side_bands.md", EXAMPLES) == PRINTED
