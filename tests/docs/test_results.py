"""docs/results.md lists what the results files hold, in the words that they hold themselves."""

import importlib.util
from pathlib import Path

import pytest

from femgear.stages import assumptions

pytestmark = pytest.mark.usefixtures("coarse_states")

PATH = Path(__file__).parents[2] / "validation" / "tools" / "results_page.py"


@pytest.fixture(scope="module")
def results_page():
    spec = importlib.util.spec_from_file_location("results_page", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def one_assumption(monkeypatch):
    """What a level rests on is changed entry by entry: their number is a length of the tables, not a variable."""
    every = assumptions.assumed
    monkeypatch.setattr(assumptions, "assumed", lambda *given: every(*given)[:1])


def test_tables_are_those_of_the_files(results_page, one_assumption):
    page = results_page.PAGE.read_text(encoding="utf-8")
    remedy = "run python validation/tools/results_page.py -o docs/results.md"
    assert page == results_page.page(page, results_page.variables()), remedy


def test_a_table_keeps_its_remarks_and_joins_real_and_imaginary_parts(results_page):
    found = {
        "x_real": ("speed", "m", "motion, real part"),
        "x_imag": ("speed", "m", "motion, imaginary part"),
    }
    found["kind"] = ("mode", "", "kind of mode")
    text = results_page.table(found, {"kind": "rigid or not"})
    rows = "| `x_real`, `x_imag` | speed | m | motion | |\n| `kind` | mode | | kind of mode | rigid or not |\n"
    assert text == results_page.HEAD + rows
    page = f"<!-- table one modes -->\n{text}<!-- end -->\n"
    assert results_page.page(page, {("one", "modes"): found}) == page
    with pytest.raises(SystemExit, match="missing"):
        results_page.page(page, {("other", "modes"): found})
