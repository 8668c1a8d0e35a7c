"""Results of a pair: warnings of a run-up that is cut and of flanks without a back."""

import re
from dataclasses import replace

import numpy as np
import pytest
from trains.pair.test_stages import pair_case

from femgear.solvers.stability.parametric import stability
from femgear.stages.static import solve_static
from femgear.trains.pair import stages
from femgear.trains.pair.results import pair_dynamics_warnings, pair_runup_warnings
from femgear.trains.pair.stages import solve_pair_dynamics, solve_pair_modes, solve_pair_runup

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.mark.parametrize(
    ("points", "words"),
    [pytest.param(400, "nothing bounds motions", marks=pytest.mark.slow), (40, "after 4. points: raise max_points")],
)
def test_a_branch_that_is_cut_says_so_and_why(points, words, monkeypatch):
    """At little damping it grows without bound towards speeds at which the linear motion is not stable."""
    monkeypatch.setattr(stages, "_STEPS", replace(stages._STEPS, max_points=points))
    case = pair_case(**{"dynamics.damping_ratio": 0.02})
    result = solve_pair_runup(case, solve_pair_modes(case, solve_static(case)))
    data = result.dataset()
    (said,) = (one for one in pair_runup_warnings(data) if one.code == "W-BRANCH")
    assert not result.complete and re.search(words, said.text)
    if points == 400:
        end = float(data.branch_speed[-1]) * 24.0 / 60.0
        modes = solve_pair_modes(case, solve_static(case))
        hertz = end * np.array([0.995, 1.01])
        below, above = stability(modes.modes, modes.excitation, hertz, excitation_harmonics=16).multiplier
        assert abs(below) < 1.0 < abs(above)
        travel = np.abs(result.branch[1].deflection[-1]).sum()
        assert 0.45 * 3e-3 < travel <= 0.5 * 3e-3
        assert f"{1e3 * float(data.branch_dte_rms[-1]):.3g} mm" in said.text


@pytest.mark.parametrize(("play", "said"), [("0.1 mm", False), ("0 mm", True)])
def test_flanks_that_part_without_backlash_are_told_to_have_no_back(play, said):
    case = pair_case(**{"set.backlash": play, "operation.speeds": ["7700 rpm"]})
    data = solve_pair_dynamics(case, solve_pair_modes(case, solve_static(case))).dataset()
    (found,) = [one for one in pair_dynamics_warnings(data) if one.code == "W-SEPARATION"]
    assert ("no back flanks" in found.text) == said
