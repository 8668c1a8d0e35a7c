"""Contact states of a gear pair from the range of its deflection, against the forces of its flanks."""

import numpy as np
import pytest
from small_trains import example_pair, level_crossings

from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.trains.impacts.model import STATE_NAMES, UNKNOWN, contact_shares, range_states, state_regions


@pytest.mark.parametrize(("ratio", "state"), [(0.5, 0), (1.2, 1), (0.85, 2)])
def test_the_range_of_a_solution_tells_what_its_forces_do(ratio, state):
    pair = example_pair(0.09)
    solution = solve_harmonic_balance(pair.problem(ratio), 1.0, harmonics=10, stability=False)
    theta = 2.0 * np.pi * np.arange(1024)[:, None] / 1024
    x = solution.at(theta[:, 0])
    force = pair.mesh().evaluate(x[:, :1, None], theta)[0][:, 0, 0]
    drive, back = force > 0.0, force < 0.0
    assert range_states(x.min(), x.max()) == state
    assert (drive.any() and back.any()) == (state == 2)
    assert (drive.all() or back.all()) == (state == 0)
    shares = contact_shares(x[:, 0])
    assert sum(shares.values()) == pytest.approx(1.0)
    for name, closed in (("drive", drive), ("free", ~drive & ~back), ("back", back)):
        assert shares[name] == pytest.approx(closed.mean(), abs=1e-12)


def test_regions_and_levels():
    parameter = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert state_regions(parameter, [0, 0, 1, 2, 2]) == [(0, 1.0, 2.0), (1, 3.0, 3.0), (2, 4.0, 5.0)]
    np.testing.assert_allclose(level_crossings(parameter, parameter**2, 12.0), [3.0 + 3.0 / 7.0])
    assert range_states(1.0, 2.0) == 0


def test_extremes_that_are_no_numbers_are_not_known():
    assert range_states(np.nan, 1.0) == UNKNOWN
    assert range_states([0.0, 1.5], [np.inf, 2.0]).tolist() == [UNKNOWN, 0]
    assert STATE_NAMES[UNKNOWN] == "not known"
