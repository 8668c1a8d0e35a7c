"""Contact states from forces, against hand-made motions and another way to count."""

import numpy as np
import pytest
from small_trains import example_pair, level_crossings

from femgear.errors import CaseError
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, constant
from femgear.trains.gear_pair.model import (
    STATE_NAMES,
    UNKNOWN,
    contact_states,
    range_states,
    solution_states,
    state_regions,
)

MESHES = GearMeshes([2, 0, 1], constant([2.0, 2.0, 2.0]), deflection=constant([1.0, 1.0, 1.0]), backlash=2.0)


def test_three_meshes_in_three_states():
    theta = 2.0 * np.pi * np.arange(4000)[:, None] / 4000
    wave = np.cos(theta[:, 0])
    # columns 2, 0, 1: always closed; parts for a third of the time; touches both sides
    x = np.stack([1.5 + wave, 2.0 * wave, 3.0 + 0.5 * wave], axis=1)
    found = contact_states(MESHES, x, theta)
    assert found.state.tolist() == [0, 1, 2]
    np.testing.assert_allclose(found.drive, [1.0, 2.0 / 3.0, 1.0 / 3.0], atol=1e-3)
    np.testing.assert_allclose(found.back, [0.0, 0.0, 1.0 / 3.0], atol=1e-3)
    np.testing.assert_allclose(found.drive + found.free + found.back, 1.0)


def test_errors_move_the_flanks():
    theta = 2.0 * np.pi * np.arange(1000)[:, None] / 1000
    moved = GearMeshes([0], constant([1.0]), deflection=FourierSeries([[1.0, 0.4]]), backlash=2.0)
    still = np.full((1000, 1), 1.3)
    assert contact_states(moved, still, theta).state.tolist() == [1]
    assert contact_states(moved, still + 0.2, theta).state.tolist() == [0]
    # back flanks always closed are no impact either
    assert contact_states(moved, still - 3.0, theta).state.tolist() == [0]


def test_solution_and_its_range_agree():
    pair = example_pair(0.09)
    for ratio, state in ((0.5, 0), (1.2, 1), (0.85, 2)):
        solution = solve_harmonic_balance(pair.problem(ratio), 1.0, harmonics=10, stability=False)
        found = solution_states(pair.problem(ratio).elements[0], solution)
        x = solution.at(2.0 * np.pi * np.arange(512) / 512)[:, 0]
        assert found.state.tolist() == [state]
        assert range_states(x.min(), x.max(), drive=1.0, back=-1.0) == state
        assert found.drive[0] == pytest.approx(np.mean(x > 1.0), abs=5e-3)


def test_regions_and_levels():
    parameter = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert state_regions(parameter, [0, 0, 1, 2, 2]) == [(0, 1.0, 2.0), (1, 3.0, 3.0), (2, 4.0, 5.0)]
    np.testing.assert_allclose(level_crossings(parameter, parameter**2, 12.0), [3.0 + 3.0 / 7.0])
    assert range_states(1.0, 2.0, drive=1.0, back=-1.0) == 0


def test_meshes_that_cannot_part_are_refused():
    linear = GearMeshes([0], constant([1.0]), separates=False)
    with pytest.raises(CaseError, match="E-CONTACT"):
        contact_states(linear, np.zeros((4, 1)), np.zeros((4, 1)))


@pytest.mark.parametrize(
    "x, theta",
    [
        (np.full((4, 3), np.nan), np.zeros((4, 1))),
        (np.zeros((0, 3)), np.zeros((0, 1))),
        (np.zeros((4, 2)), np.zeros((4, 1))),
        (np.zeros((4, 3)), np.zeros((5, 1))),
        ("text", np.zeros((4, 1))),
    ],
)
def test_motions_that_have_no_state_are_refused(x, theta):
    with pytest.raises(CaseError, match="E-CONTACT"):
        contact_states(MESHES, x, theta)


def test_infinite_backlash_has_no_back_flanks():
    open_side = GearMeshes([0], constant([2.0]), deflection=constant([1.0]))
    theta = 2.0 * np.pi * np.arange(40)[:, None] / 40
    parting = contact_states(open_side, 5.0 * np.cos(theta), theta)
    assert parting.state.tolist() == [1] and parting.back.tolist() == [0.0]
    assert contact_states(open_side, 5.0 + np.cos(theta), theta).state.tolist() == [0]


def test_extremes_that_are_no_numbers_are_not_known():
    assert range_states(np.nan, 1.0, drive=1.0, back=-1.0) == UNKNOWN
    assert range_states([0.0, 1.5], [np.inf, 2.0], drive=1.0, back=-1.0).tolist() == [UNKNOWN, 0]
    assert STATE_NAMES[UNKNOWN] == "not known"
    for lowest, highest in ((1.0, 0.0), ("a", 1.0), ([0.0, 1.0], [2.0])):
        with pytest.raises(CaseError, match="E-CONTACT"):
            range_states(lowest, highest, drive=1.0, back=-1.0)
    with pytest.raises(CaseError, match="E-CONTACT"):
        state_regions([1.0, 2.0, 3.0], [0, 1])
