"""One-sided contacts that the mean load pulls apart: no periodic motion, however large the deflection."""

from dataclasses import replace

import numpy as np
import pytest
from small_trains import gear_pair

from femgear.errors import ConvergenceError
from femgear.solvers.continuation.branches import frequency_response_curve
from femgear.solvers.periodic.harmonic_balance import (
    periodic_response,
    solve_harmonic_balance,
)
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem

NOTE = "nothing carries the mean load of column 1 (mesh 1)"


def pair(torque, **mesh):
    system = gear_pair((1.2e-3, 4.5e-3), (0.04, 0.07), torque=torque, mesh_damping=900.0)
    return NonlinearSystem(system, (GearMeshes([0], FourierSeries([[3e8, 6e7]]), **mesh),))


def one_mass(load, stiffness=0.0, **mesh):
    """A mass on a support with one contact; static deflections follow from balance."""
    system = MechanicalSystem(np.eye(1), 0.1 * np.eye(1), stiffness * np.eye(1), np.eye(1), np.array([load]), ("x",))
    return NonlinearSystem(system, (GearMeshes([0], FourierSeries([[1.0, 0.1]]), **mesh),))


@pytest.mark.parametrize("torque", [-120.0, -1e-3])
@pytest.mark.parametrize("frequency", [1.35e4, *(pytest.param(one, marks=pytest.mark.slow) for one in (2.7e4, 5.4e4))])
def test_a_mesh_pulled_apart_does_not_converge(torque, frequency):
    """The flanks push only: T / r = -3000 N on the line of action cannot be a mean force of the mesh."""
    found = solve_harmonic_balance(pair(torque), frequency, harmonics=8)
    assert not found.converged and found.stable is None and found.residual >= 1.0
    assert NOTE in found.message and f"it needs {torque / 0.04:.4g} N" in found.message


@pytest.mark.parametrize(
    "tolerance", [pytest.param(1e-3, marks=pytest.mark.slow), pytest.param(1e-5, marks=pytest.mark.slow), 1e-12]
)
def test_no_tolerance_lets_it_through(tolerance):
    found = solve_harmonic_balance(pair(-120.0), 2.7e4, harmonics=8, tolerance=tolerance)
    assert not found.converged and NOTE in found.message


@pytest.mark.slow
def test_other_entry_points_say_so_too():
    problem = pair(-120.0)
    found = periodic_response(problem, 2.7e4, harmonics=5)
    assert not found.solution.converged and found.stable is None and NOTE in found.solution.message
    with pytest.raises(ConvergenceError) as error:
        frequency_response_curve(problem, (1.6e4, 3.5e4), harmonics=5)
    assert NOTE in error.value.message and "16000 rad/s (2546.48 Hz)" in error.value.message


@pytest.mark.slow
def test_smoothing_does_not_pull():
    found = solve_harmonic_balance(one_mass(-1.0, smoothing=1e-3), 1.3, harmonics=4)
    assert not found.converged and NOTE in found.message


@pytest.mark.parametrize("backlash", [40e-6, 10.0])
def test_a_back_side_carries_the_load(backlash):
    """The back flanks carry 3000 N: the mean force is that of balance, to rounding."""
    found = solve_harmonic_balance(pair(-120.0, backlash=backlash), 2.7e4, harmonics=8)
    assert found.converged and found.force[0, 0].real == pytest.approx(-3000.0, rel=1e-6)
    assert found.deflection[0, 0].real < -backlash


@pytest.mark.parametrize("stiffness", [1e-9, 1e-6, 1e-3])
def test_a_weak_support_carries_the_load_however_far_away(stiffness):
    """-1 N on a spring alone: the deflection is -1 / stiffness, a thousand million times that of the mesh."""
    found = solve_harmonic_balance(one_mass(-1.0, stiffness), 1.3, harmonics=4)
    assert found.converged and found.deflection[0, 0].real == pytest.approx(-1.0 / stiffness, rel=1e-6)


def chain(load):
    """Three masses in a row, a two-sided spring and a contact between them: nothing else holds them."""
    W = np.array([[1.0, 0.0], [-1.0, 1.0], [0.0, -1.0]])
    damping = 0.05 * W @ W.T
    system = MechanicalSystem(np.eye(3), damping, np.zeros((3, 3)), W, load, ("a", "b", "c"))
    elements = (PolynomialSprings([0], [[1.0, 0.0, 0.1]]), GearMeshes([1], FourierSeries([[2.0, 0.2]])))
    return NonlinearSystem(system, elements, (HarmonicForce(np.array([0.05, -0.05, 0.0]), (1,)),))


@pytest.mark.decisive
def test_the_column_that_lacks_its_force_is_named():
    """(p, 0, -p) presses both or pulls both: only the contact, column 2, cannot pull."""
    load = np.array([0.5, 0.0, -0.5])
    pressed = solve_harmonic_balance(chain(load), 0.6, harmonics=5)
    assert pressed.converged
    np.testing.assert_allclose(pressed.force[:, 0].real, [0.5, 0.5], rtol=1e-8)
    pulled = solve_harmonic_balance(chain(-load), 0.6, harmonics=5)
    assert not pulled.converged
    assert "column 2 (mesh 1): it needs -0.5 N, the elements there give no less than 0 N" in pulled.message


@pytest.mark.parametrize("share", [0.5, -0.5])
def test_contacts_that_share_a_load_are_judged_together(share):
    """Two contacts face each other: one of them carries the load whichever way it points."""
    W = np.array([[1.0, -1.0]])
    system = MechanicalSystem(np.eye(1), 0.1 * np.eye(1), np.zeros((1, 1)), W, np.array([share]), ("x",))
    mesh = GearMeshes([0, 1], FourierSeries([[1.0, 0.1], [1.0, 0.1]]))
    found = solve_harmonic_balance(NonlinearSystem(system, (mesh,)), 1.9, harmonics=6)
    assert found.converged, found.message
    assert W[0] @ found.force[:, 0].real == pytest.approx(share, rel=1e-8)


@pytest.mark.parametrize(("load", "steady"), [(1.0, -3.0), (-3.0, 1.0)])
def test_a_steady_force_is_a_mean_load(load, steady):
    """A force of order zero adds to the load: -2 N in all part the contact, 2 N press it."""
    for sign, carried in ((1.0, False), (-1.0, True)):
        problem = one_mass(sign * load)
        problem = replace(problem, forces=(HarmonicForce(np.array([sign * steady]), (0,)),))
        found = solve_harmonic_balance(problem, 1.3, harmonics=4)
        assert found.converged == carried
        if carried:
            assert found.force[0, 0].real == pytest.approx(2.0, rel=1e-8)
        else:
            assert NOTE in found.message and "it needs -2 N" in found.message


@pytest.mark.slow
def test_of_two_contacts_the_one_that_is_pulled_is_named():
    two = MechanicalSystem(np.eye(2), 0.1 * np.eye(2), np.zeros((2, 2)), np.eye(2), np.array([0.4, -0.1]), ("x", "y"))
    mesh = FourierSeries([[1.0, 0.1]])
    found = solve_harmonic_balance(
        NonlinearSystem(two, (GearMeshes([0], mesh), GearMeshes([1], mesh))), 1.3, harmonics=4
    )
    assert not found.converged
    assert "column 2 (mesh 2): it needs -0.1 N, the elements there give no less than 0 N" in found.message


def pulled_spring(force):
    return replace(
        one_mass(-5.0),
        elements=(PolynomialSprings([0], [[1.0, 0.0, 4.0]]),),
        forces=(HarmonicForce(np.array([force]), (1,)),),
    )


def test_a_spring_in_tension_is_not_blamed():
    """-5 N on a hardening spring that pulls: a tolerance below rounding is another reason not to converge."""
    found = solve_harmonic_balance(pulled_spring(30.0), 1.3, harmonics=4, tolerance=1e-17)
    assert not found.converged and "Not converged" in found.message
    assert "nothing carries" not in found.message


@pytest.mark.slow
def test_every_iteration_after_an_embedding_costs_a_factorisation():
    loose, tight = (
        solve_harmonic_balance(pulled_spring(3.0), 1.3, harmonics=4, tolerance=one) for one in (1e-12, 1e-17)
    )
    assert "Converged in 0 steps" in loose.message and not tight.converged
    assert "embedding" in loose.message and "embedding" in tight.message
    assert tight.factorisations - loose.factorisations == tight.iterations - loose.iterations > 0
