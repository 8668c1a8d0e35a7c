"""Steps of the active set against numbers by hand: the residual, and single pivots where blocks cycle."""

import numpy as np
import pytest

from femgear.contact.active_set import ComplementarityProblem, _residual, settle, solve_step
from femgear.contact.solve import solve_contact
from femgear.errors import ContactError


def two_springs(gap=(1.0, 1.0), load=4.0):
    """Two springs side by side that yield 2 under their own and 1 under the other's unit load."""
    H = np.array([[2.0, 1.0], [1.0, 2.0]])
    return ComplementarityProblem(H, np.array(gap), np.ones((2, 1)), np.array([load]), compliance=1.0, arm=np.ones(1))


@pytest.mark.parametrize(
    ("loads", "gaps", "largest"),
    [
        # elastic displacements 8 and 4: 0.2 at the touching candidate, on either side
        ([4.0, 0.0], [0.2, 1.0], 0.2 / 8),
        ([4.0, 0.0], [-0.2, 1.0], 0.2 / 8),
        # an open candidate that lies 0.4 deep, beside a smaller miss of the touching one
        ([4.0, 0.0], [0.2, -0.4], 0.4 / 8),
        # the second pulls by 1 of at most 5
        ([5.0, -1.0], [0.2, 1.0], 1.0 / 5),
        # the loads leave 1 of the 4, which exceeds them
        ([3.0, 0.0], [0.2, -0.4], 1.0 / 4),
        ([5.0, 0.0], [0.2, -0.4], 1.0 / 5),
        # without load the whole of it is missing, and only separations measure lengths: 1e-6 of the largest
        ([0.0, 0.0], [0.2e-6, 1.0], 1.0),
        ([0.0, 0.0], [3e-6, 1.0], 3.0),
    ],
    ids=["apart", "pressed in", "penetration", "pull", "too little", "too much", "no load", "rigid"],
)
def test_residual_is_the_largest_of_four_violations(loads, gaps, largest):
    active = np.array([True, False])
    found = _residual(two_springs(), active, np.array(loads), np.array(gaps))
    assert found == pytest.approx(largest, rel=1e-14)


def test_residual_without_gap_and_load_is_that_of_units():
    """No elastic displacement, no separation, no load: lengths and forces count as they are."""
    problem, active = two_springs(gap=(0.0, 0.0), load=0.0), np.array([True, False])
    assert _residual(problem, active, np.zeros(2), np.array([0.3, -0.2])) == pytest.approx(0.3, rel=1e-14)
    assert _residual(problem, active, np.zeros(2), np.zeros(2)) == 0.0


def test_a_wrong_active_set_has_the_violations_of_its_linear_solution():
    """Gaps 0 and 9 under 4: both touching, springs give loads 6.5 and -2.5; the first alone carries 4."""
    problem = two_springs(gap=(0.0, 9.0))
    both = solve_step(problem, np.array([True, True]))
    assert both.loads == pytest.approx([6.5, -2.5]) and both.motions == pytest.approx([10.5])
    assert both.flips.tolist() == [1] and both.residual == pytest.approx(2.5 / 6.5)
    first = solve_step(problem, np.array([True, False]))
    # the second lies 9 + 4 - 8 apart
    assert first.gaps == pytest.approx([0.0, 5.0], abs=1e-12)
    assert not len(first.flips) and first.residual < 1e-15
    other = solve_step(problem, np.array([False, True]))
    # 13 + 4 is the motion on the second, the first then lies 4 - 17 deep, over 8
    assert other.flips.tolist() == [0] and other.residual == pytest.approx(13.0 / 8)


def test_single_pivots_solve_where_blocks_cycle():
    """Prescribed approach of three coupled candidates: 0.5 on the first alone leaves 0, 1 and 2 by hand."""
    H = np.array([[8.0, -8.0, 6.0], [-8.0, 9.0, -5.0], [6.0, -5.0, 6.0]])
    state = solve_contact(H, np.array([-4.0, 5.0, -1.0]), np.zeros((3, 0)), np.zeros(0))
    assert state.method == "active set, single pivots"
    np.testing.assert_allclose(state.loads, [0.5, 0.0, 0.0], rtol=1e-13)
    np.testing.assert_allclose(state.gaps, [0.0, 1.0, 2.0], rtol=1e-12)


def test_candidates_that_part_balance_no_load_by_rounding():
    """The load parts the first candidate and closes the second one by something, or by rounding."""
    load, none = np.array([1.0, 0.0]), np.zeros(2, bool)

    def forced(approach):
        G = np.array([[-1.0, 0.0], [approach, 1.0]])
        return settle(G, load, np.eye(2), np.ones(2), none)[2].tolist()

    assert forced(1e-3) == [1]
    with pytest.raises(ContactError, match="no candidate can balance the load"):
        forced(1e-12)


def test_small_loads_count_beside_the_largest_one_however_light_that_is():
    """Rigid bodies far apart: 1e7 on one spring and 5 on the other, both of them times the scale."""
    for scale in (1.0, 1e-10):
        gap = scale * np.array([1e15, 1e15 + 1e7 - 5.0])
        state = solve_contact(np.eye(2), gap, np.ones((2, 1)), scale * np.array([1e7 + 5.0]))
        assert state.active.tolist() == [True, True]
        assert state.loads == pytest.approx(scale * np.array([1e7, 5.0]), abs=scale)


def test_the_first_candidate_in_the_way_of_a_load_must_touch():
    """Separations of 3, 2 and 0.1 close at speeds of 2, 1 and -1: after 1.5, after 2, never."""
    for scale in (1.0, 1e-10):
        given = np.array([[2.0], [1.0], [-1.0]]), np.array([scale]), np.eye(1)
        shift, blocked, forced = settle(*given, np.array([3.0, 2.0, 0.1]), np.zeros(3, bool))
        assert shift.tolist() == [0.0] and forced.tolist() == [0] and blocked.tolist() == [0, 1, 2]


def test_a_motion_with_a_load_of_rounding_ends_penetration_by_the_least_shift():
    """The second motion, 1e-12 of the load on it: the first candidate is 0.5 deep, the other one 3 apart."""
    given = np.array([[1.0, 1.0], [0.0, -1.0]]), np.array([-1.0, 1e-12]), np.eye(2)[:, 1:]
    shift, *none = settle(*given, np.array([-0.5, 3.0]), np.zeros(2, bool))
    assert shift == pytest.approx([-0.5]) and [one.tolist() for one in none] == [[], []]
