"""Free motions in the verdict: the position is left out, the velocity counts; multipliers on the circle."""

import numpy as np
import pytest
from small_trains import gear_pair

from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.reference.hill import hill_verdict

OMEGA, PERIOD = 0.7, 2 * np.pi / 0.7
RELATIVE = np.array([[1.0, -1.0], [-1.0, 1.0]])


def two_masses(damping):
    """Two masses on each other, free together; the damping acts on the relative motion and as given."""
    system = MechanicalSystem(
        np.eye(2), 0.1 * RELATIVE + damping, RELATIVE, np.array([[1.0], [-1.0]]), np.zeros(2), ("a", "b")
    )
    return NonlinearSystem(system, (PolynomialSprings([0], [[0.0, 0.0, 0.1]]),), (HarmonicForce([0.1, 0.0]),))


def verdicts(problem):
    found = solve_harmonic_balance(problem, OMEGA, harmonics=9)
    return found.verdict, hill_verdict(problem, found), solve_shooting(problem, OMEGA).verdict


@pytest.mark.parametrize("rate", [-0.1, -1e-4, 5e-8, 0.003, 0.1])
def test_the_velocity_of_a_free_motion_counts(rate):
    """Both masses together obey s'' + rate s' = f: multipliers 1, left out, and exp(-rate T)."""
    expected = np.exp(-rate * PERIOD)
    for verdict in verdicts(two_masses(0.5 * rate * np.ones((2, 2)))):
        assert len(verdict.multipliers) == 3 and verdict.stable is (rate > 0.0)
        assert np.abs(verdict.multipliers - expected).min() < 1e-7
        if rate < 0.0:
            assert verdict.loss == "fold" and abs(verdict.multipliers[0]) == pytest.approx(expected, rel=1e-6)


def test_what_the_verdict_calls_unstable_runs_away():
    problem = two_masses(-0.05 * np.ones((2, 2)))
    motion = solve_transient(problem, OMEGA, np.array([0.0, 10 * PERIOD, 11 * PERIOD]), step=0.02)
    growth = motion.velocity[2].sum() / motion.velocity[1].sum()
    found = solve_harmonic_balance(problem, OMEGA, harmonics=9)
    assert found.stable is False
    assert growth == pytest.approx(abs(found.verdict.multipliers[0]), rel=1e-3)


def test_a_free_motion_without_damping_is_left_out():
    for verdict in verdicts(two_masses(0.0)):
        assert verdict.stable is True and len(verdict.multipliers) == 2


def test_damping_that_couples_a_free_motion_leaves_one_position_out():
    """Dashpots to the ground of different size: product of all multipliers is exp(-trace C T) (Liouville)."""
    ground = np.diag([0.2, 0.05])
    for verdict in verdicts(two_masses(ground)):
        assert len(verdict.multipliers) == 3 and verdict.stable is True
        product = np.prod(verdict.multipliers).real
        assert product == pytest.approx(np.exp(-np.trace(0.1 * RELATIVE + ground) * PERIOD), rel=1e-5)


def test_teeth_without_a_load_stand_anywhere_in_their_play():
    """Zero torque: every position within the backlash is one of rest; a multiplier is one."""
    system = gear_pair((1.2e-3, 4.5e-3), (0.04, 0.07), torque=0.0, mesh_damping=900.0)
    problem = NonlinearSystem(system, (GearMeshes([0], FourierSeries([[3e8, 6e7]]), backlash=40e-6),))
    found = solve_harmonic_balance(problem, 2.7e4, harmonics=8)
    for verdict in (found.verdict, solve_shooting(problem, 2.7e4).verdict):
        assert verdict.stable is None and verdict.loss == "" and "on the border" in verdict.message
        assert abs(verdict.multipliers[0] - 1.0) < 1e-6


def test_undamped_pairs_on_the_circle_do_not_grow():
    system = MechanicalSystem(np.eye(1), np.zeros((1, 1)), np.eye(1), np.eye(1), np.zeros(1), ("x",))
    spring, force = PolynomialSprings([0], [[0.0, 0.0, 0.1]]), HarmonicForce([0.05])
    found = solve_harmonic_balance(NonlinearSystem(system, (spring,), (force,)), 1.7, harmonics=9)
    assert found.stable is True and np.abs(found.verdict.multipliers) == pytest.approx(1.0, abs=1e-6)
