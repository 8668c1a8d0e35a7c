"""Static condensation: exact statics, upper bounds of the frequencies, a textbook example."""

import numpy as np
import pytest

from femgear.errors import CaseError, ConvergenceError
from femgear.system.system import MechanicalSystem
from validation.reference.guyan import choose_masters, condensation_error, condense


@pytest.fixture
def chain():
    n = 12
    K = 3.0 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    M = np.diag(np.where(np.arange(n) % 3 == 0, 4.0, 0.2))
    W = np.zeros((n, 2))
    W[[0, 4], 0], W[[4, 9], 1] = (1.0, -1.0), (1.0, 1.0)
    return MechanicalSystem(M, 0.1 * K, K, W, np.arange(n) / 10.0, tuple(f"mass {i}" for i in range(n)))


def test_statics_of_loads_on_masters_are_exact(chain):
    k = np.array([2.0, 5.0])
    reduction = condense(chain, [0, 3, 6, 9], mesh_stiffness=k)
    load = np.zeros(12)
    load[[0, 3, 6, 9]] = 1.0, -2.0, 0.5, 0.7
    full = np.linalg.solve(chain.K + (chain.W * k) @ chain.W.T, load)
    small = reduction.system
    masters = np.linalg.solve(small.K + (small.W * k) @ small.W.T, load[reduction.masters])
    np.testing.assert_allclose(reduction.transformation @ masters, full, rtol=1e-12, atol=1e-14)
    assert small.dofs == ("mass 0", "mass 3", "mass 6", "mass 9")


def test_two_masses_in_closed_form():
    """Fixed - k - m1 - k - m2: with m2 as master, q1 = q2 / 2, M = m2 + m1 / 4, K = k / 2."""
    system = MechanicalSystem(
        np.diag([2.0, 3.0]),
        np.zeros((2, 2)),
        np.array([[8.0, -4.0], [-4.0, 4.0]]),
        np.zeros((2, 0)),
        np.array([1.0, 5.0]),
        (),
    )
    reduction = condense(system, [1])
    assert reduction.system.M[0, 0] == pytest.approx(3.5)
    assert reduction.system.K[0, 0] == pytest.approx(2.0)
    assert reduction.system.load[0] == pytest.approx(5.5)
    error = condensation_error(system, reduction)
    exact = np.sqrt(np.roots([6.0, -32.0, 16.0]).min())
    assert error.frequency[0] * 2 * np.pi == pytest.approx(exact, rel=1e-12)
    assert error.condensed[0] * 2 * np.pi == pytest.approx(np.sqrt(2.0 / 3.5), rel=1e-12)
    assert error.error[0] == pytest.approx(np.sqrt(2.0 / 3.5) / exact - 1.0, rel=1e-9)


def test_frequencies_are_upper_bounds_that_fall_with_the_masters(chain):
    k = np.array([2.0, 5.0])
    first = []
    for count in (2, 4, 6, 9, 12):
        masters = choose_masters(chain, count, mesh_stiffness=k)
        error = condensation_error(chain, condense(chain, masters, mesh_stiffness=k)).error
        assert np.all(error > -1e-12)
        first.append(error[0])
    assert np.all(np.diff(first) < 0.0) and first[0] < 0.1 and first[-1] < 1e-12


def test_chosen_masters_carry_the_inertia(chain):
    assert choose_masters(chain, 4).tolist() == [0, 3, 6, 9]


def test_choice_condenses_step_by_step_as_at_once(chain):
    """What the choice leaves is the Guyan reduction to the same masters: chosen again, nothing changes."""
    masters = choose_masters(chain, 7)
    reduced = condense(chain, masters).system
    assert masters[choose_masters(reduced, 5)].tolist() == choose_masters(chain, 5).tolist()


def test_loose_parts_are_refused():
    K = np.zeros((3, 3))
    K[:2, :2] = [[1.0, -1.0], [-1.0, 1.0]]
    system = MechanicalSystem(np.eye(3), np.zeros((3, 3)), K, np.zeros((3, 0)), np.zeros(3), ("a", "b", "c"))
    with pytest.raises(ConvergenceError, match="freedom c"):
        condense(system, [0])
    with pytest.raises(ConvergenceError, match="together"):
        condense(system, [2])
    for masters in ([0, 0], [], [3], [0.5]):
        with pytest.raises(CaseError, match="E-MASTERS"):
            condense(system, masters)
