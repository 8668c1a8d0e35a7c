"""What modes that are not followed leave behind: flexibility, drift, the edge of the unit circle."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.solution import CIRCLE
from femgear.solvers.stability.floquet import Frame, frame_of
from femgear.solvers.stability.parametric import Stability, StabilityChart, stability, stability_chart
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, constant
from femgear.system.system import MechanicalSystem, NonlinearSystem


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_modes_left_out_leave_their_static_flexibility(geared_chain, modes):
    """``W^T K^-1 W`` of the whole chain is that of the modes kept and the residual."""
    mesh = GearMeshes([0, 1], constant([1.0, 1.4]), separates=False)
    frame = frame_of(NonlinearSystem(geared_chain, (mesh,)), modes=modes)
    W = geared_chain.W
    whole = W.T @ np.linalg.solve(geared_chain.K + (W * [1.0, 1.4]) @ W.T, W)
    kept = (frame.rows / frame.square) @ frame.rows.T
    assert len(frame.square) == modes
    np.testing.assert_allclose(frame.residual, whole - kept, atol=1e-12 * np.abs(whole).max())
    assert np.abs(frame.residual).max() > 1e-3 * np.abs(whole).max()


def test_free_motions_drift_by_their_own_damping_or_take_part_by_a_coupling():
    """A mass in a mesh and a free one: its damper couples it to nothing, or to the other one."""
    W = np.array([[1.0], [0.0]])
    for coupling, drift, kept in ((0.0, [0.2], 1), (0.1, [], 2)):
        C = np.array([[0.3, -coupling], [-coupling, 0.4]])
        system = MechanicalSystem(np.diag([1.0, 2.0]), C, np.zeros((2, 2)), W, np.zeros(2), ("a", "b"))
        frame = frame_of(NonlinearSystem(system, (GearMeshes([0], constant([4.0]), separates=False),)))
        assert frame.drift == pytest.approx(drift) and len(frame.square) == kept
        assert frame.positions == kept - 1


def test_modes_beyond_the_excitation_count_as_flexibility(geared_chain, chain_excitation):
    """Two of four modes are followed; the verdict is that of all to 1e-3, 4 % off without the others."""
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.01)
    every = stability(modes, chain_excitation(0.6), 0.2, excitation_harmonics=1, frequency_ratio=50.0)
    few = stability(modes, chain_excitation(0.6), 0.2, excitation_harmonics=1, frequency_ratio=1.0)
    assert (every.modes_kept[0], few.modes_kept[0]) == (4, 2)
    assert few.modulus[0] == pytest.approx(every.modulus[0], rel=1e-3)


def test_the_fewest_steps_follow_the_highest_line(geared_chain, chain_excitation):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    options = {"excitation_harmonics": 6, "frequency_ratio": 1.0}
    assert stability(modes, chain_excitation(0.2), 0.01, steps=7, **options).steps[0] == 7
    with pytest.raises(CaseError, match="12 instants cannot show 6 harmonics"):
        stability(modes, chain_excitation(0.2), 0.01, steps=6, **options)


def test_the_unit_circle_has_a_width():
    near = np.array([[1.0 - 0.5 * CIRCLE, 1.0, -1.0 - 0.5 * CIRCLE, 1.0 + 2.0 * CIRCLE]])
    chart = StabilityChart(np.ones(1), np.ones(4), near, np.full((1, 4), ""), np.zeros((1, 4)))
    assert chart.stable.tolist() == [[True, True, True, False]]
    verdict = Stability(np.ones(4), near[0], np.ones(4, int), np.ones(4, int))
    assert verdict.stable.tolist() == [True, True, True, False]


def test_a_chart_names_no_loss_on_the_circle():
    """Undamped outside the tongues all multipliers have the modulus one."""
    one = np.ones((1, 1))
    system = NonlinearSystem(MechanicalSystem(one, 0.0 * one, 0.0 * one, one, np.zeros(1), ("x",)), ())
    chart = stability_chart(system, FourierSeries([[1.0, -0.6]]), [0.7, 5.0], [0.0, 0.2])
    assert np.abs(chart.multiplier) == pytest.approx(1.0, abs=1e-8)
    assert np.all(chart.stable) and np.all(chart.loss == "")


@pytest.mark.parametrize("size", [1e-9, 1.0, -1.0, 1e9])
def test_damping_couples_modes_from_a_rounding_of_its_largest_entry_on(size):
    for share, diagonal in ((0.0, True), (5e-13, True), (2e-12, False), (-2e-12, False)):
        damping = size * np.array([[1.0, share], [share, 0.5]])
        frame = Frame(np.ones(2), damping, np.ones((1, 2)), np.ones(1), np.zeros((1, 1)))
        assert frame.diagonal is diagonal
    assert Frame(np.ones(2), np.zeros((2, 2)), np.ones((1, 2)), np.ones(1), np.zeros((1, 1))).diagonal
