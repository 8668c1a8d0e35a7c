"""What scripts show of results: the same wherever these are."""

from pathlib import Path

import numpy as np
import pytest

import femgear
from femgear.errors import CaseError

CASES = Path(__file__).parents[1] / "cases"
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


def test_mesh_stiffness_over_angle_and_torque(solution):
    case = solution.case
    k = femgear.mesh_stiffness(case, [50.0, case.operation.torque])
    assert k.dims == ("torque", "mesh", "position")
    assert k.attrs["units"] == "N/m" and k["torque"].attrs["units"] == "N m"
    assert np.array_equal(k.values[1], solution["static"].dataset()["mesh_stiffness"].values)
    assert k.values[0].mean() != k.values[1].mean()
    assert np.array_equal(femgear.mesh_stiffness(case).values[0], k.values[1])


@pytest.mark.parametrize("source", ({}, None, "results", {"static": 1}))
def test_what_are_no_results_is_refused(source):
    for show in (femgear.figures, femgear.tables, femgear.summary):
        with pytest.raises(CaseError, match="these are no results"):
            show(source)


@pytest.mark.parametrize("name", ("gear_pair", "four_stage_reducer"))
def test_a_kind_of_case_without_the_curve_is_refused(name):
    with pytest.raises(CaseError, match="no mesh stiffness over the position"):
        femgear.mesh_stiffness(CASES / f"{name}.toml")
