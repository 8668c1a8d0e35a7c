"""Results of planar sets: verdicts, captions, warnings."""

from dataclasses import replace

import numpy as np
import pytest
from trains.planar.test_stages import ROOT, changed

from femgear.solvers.periodic.solution import open_verdict
from femgear.trains.planar.figures import (
    weight_response,
)
from femgear.trains.planar.results import branch_warnings, comparisons, describe_branch
from femgear.trains.planar.stages import solve_branch
from femgear.trains.reading import read_case


@pytest.fixture(scope="module")
def pgb():
    case = read_case(ROOT / "cases" / "nrel_pgb.toml")
    return changed(case, planar__branch={"from": "36 Hz", "to": "37.2 Hz", "harmonics": 3})


def test_open_verdicts_are_not_verdicts(pgb):
    found = solve_branch(pgb)
    why = "not determined: too many steps"
    solutions = list(found.branch.solutions)
    for i in (1, 2):
        solutions[i] = replace(solutions[i], verdict=open_verdict(why))
    data = replace(found, branch=replace(found.branch, solutions=tuple(solutions))).dataset()
    stable = data["stable"].values
    assert set(stable) == {1, 0, -1} and np.flatnonzero(stable == -1).tolist() == [1, 2]
    assert data["stable"].attrs["flag_meanings"] == "stable not_stable not_known"
    notes = describe_branch(data).notes
    hertz = data["weight_frequency"].values
    assert f"not determined: {hertz[1]:.3f} to {hertz[2]:.3f} Hz along the branch ({why})" in notes
    assert not any(note.startswith(f"not stable: {hertz[1]:.3f}") for note in notes)
    lines = weight_response(data).axes[0].get_lines()
    dotted = [line.get_xdata() for line in lines if line.get_linestyle() == ":"]
    assert len(dotted) == 1 and dotted[0].tolist() == hertz[:4].tolist()


def test_captions_say_what_this_case_shows(pgb):
    stable = " ".join(comparisons(pgb, "weight_response"))
    assert "dotted: not known" in stable
    plain = changed(pgb, planar__branch__stability=False)
    assert "Stability was not computed" in " ".join(comparisons(plain, "tooth_contact"))
    assert "at no mesh frequency" in " ".join(comparisons(pgb, "response_spectrum_30_rpm"))
    data = solve_branch(plain).dataset()
    assert data["stable"].values.tolist() == [-1] * data.sizes["point"]
    assert data["shown_as"].values[-1] == "largest response"
    assert {line.get_linestyle() for line in weight_response(data).axes[0].get_lines()} <= {"-", "None"}
    assert "stability was not computed" in describe_branch(data).notes


def test_a_branch_that_ran_out_of_points_says_which_entry_to_raise(pgb):
    found = solve_branch(
        changed(
            pgb,
            planar__branch={"from": "25 Hz", "to": "45 Hz", "harmonics": 1, "stability": False, "points": 10},
        )
    )
    assert found.ending.startswith("NOT COMPLETE") and "raise planar.branch.points" in found.ending
    assert "before 45 Hz" in describe_branch(found.dataset()).notes[0]
    assert any("planar.branch.points" in finding.text for finding in branch_warnings(found.dataset()))
