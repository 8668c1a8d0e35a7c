"""What scripts show of results: the same wherever these are."""

from pathlib import Path

import pytest

import femgear
from femgear.errors import CaseError

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[2] / "cases"
PAIR = (CASES / "spur_pair.toml").read_text("utf-8").replace("positions = 64", "positions = 8")


@pytest.fixture(scope="module")
def solution():
    return femgear.solve(femgear.read_case(PAIR), "stress")


def test_texts_of_results_are_short(solution):
    for result in solution.values():
        text = repr(result)
        assert len(text) < 300 and text.startswith(f"<{type(result).__name__}: ") and "\n" not in text
    assert "mesh_stiffness" in solution["static"]._repr_html_()
    assert solution.case.title in repr(solution.case)


def test_figures_are_drawn_when_they_are_asked_for(solution):
    shown = femgear.figures(solution)
    assert {"static_transmission_error", "mesh_stiffness", "root_stress"} <= {*shown}
    figure = shown["static_transmission_error"]
    assert figure.axes[0].get_ylabel() and shown["static_transmission_error"] is not figure


def test_results_in_memory_and_of_a_handle_show_the_same(solution):
    handle = femgear.live(PAIR)
    answer = handle.change({})
    assert {"static_transmission_error", "mesh_stiffness"} <= {*femgear.figures(answer)}
    words = repr(femgear.summary(solution))
    assert words.splitlines()[0] and "Does it run smoothly?" in words
    assert "<b>" in femgear.summary(solution)._repr_html_()
    named = femgear.tables(solution)
    assert "Static" in named and not named["Static"].empty
    for table in named.values():
        assert all(isinstance(cell, str) for cell in table.to_numpy().ravel())


@pytest.mark.parametrize("source", ({}, None, "results", {"static": 1}))
def test_what_are_no_results_is_refused(source):
    for show in (femgear.figures, femgear.tables, femgear.summary):
        with pytest.raises(CaseError, match="these are no results"):
            show(source)


def test_a_figure_is_drawn_by_its_name(solution):
    assert "transmission error" in solution.plot("static_transmission_error").axes[0].get_ylabel()
    with pytest.raises(CaseError, match="no such figure") as refused:
        solution.plot("run_up_levels")
    assert "mesh_stiffness" in str(refused.value.limit) and refused.value.code == "E-CHOICE"


def test_an_answer_computes_what_its_figure_takes_and_no_more():
    handle = femgear.live(PAIR)
    answer = handle.change({"operation.torque": "120 N m"})
    assert answer.plot("mesh_stiffness").axes
    assert repr(answer).endswith("computed: static>") and "Spur pair" in repr(handle)
    with pytest.raises(CaseError, match="no such figure"):
        answer.plot("nothing")


def test_a_solution_shows_page_one_in_a_notebook(solution):
    assert solution._repr_html_() == femgear.summary(solution)._repr_html_()
