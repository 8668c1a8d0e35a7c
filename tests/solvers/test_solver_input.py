"""Problems without a solution are called so, and input that cannot be used is refused with its code."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.receptance import modal_response
from femgear.solvers.linear.tracking import campbell_data
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.time.stroboscopic import (
    sweep_response,
)
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import PolynomialSprings
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.reference.free_vibration import solve_free_vibration
from validation.reference.sections import bifurcation_diagram, stroboscopic_section

STARTS = (([np.nan], [0.0]), ([0.0, 0.0], [0.0]), ([0.0],), (0.0, 0.0), "ab")


def oscillator(c, *coefficients, force=(0.3,)):
    one = np.ones((1, 1))
    system = MechanicalSystem(one, c * one, 0.0 * one, one, np.zeros(1), ("x",))
    forces = (HarmonicForce(np.array(force)),) if force else ()
    return NonlinearSystem(system, (PolynomialSprings([0], [list(coefficients)]),), forces)


@pytest.fixture
def duffing():
    return oscillator(0.1, 1.0, 0.0, 0.3)


@pytest.mark.parametrize("options", [{}, {"start": ([0.0], [0.0])}])
def test_an_undamped_resonance_has_no_periodic_motion(options):
    found = solve_shooting(oscillator(0.0, 1.0), 1.0, **options)
    assert not found.solution.converged and found.stable is None
    assert "damping" in found.solution.message and np.abs(found.motion).max() < 100.0


def test_beside_the_resonance_shooting_finds_the_closed_form():
    """f / (k - m w^2) of the undamped oscillator."""
    found = solve_shooting(oscillator(0.0, 1.0), 1.0 + 1e-6)
    assert found.solution.converged and found.stable
    assert np.abs(found.motion).max() == pytest.approx(0.3 / abs(1.0 - (1.0 + 1e-6) ** 2), rel=1e-4)


@pytest.mark.parametrize("push", [0.0, 1.0])
def test_a_free_system_needs_balanced_loads_and_has_no_verdict_without(push):
    """The amplitude of the relative motion is 0.3 * 2 / (2 - w^2) with half of it at either mass."""
    zero, W = np.zeros((2, 2)), np.array([[1.0], [-1.0]])
    system = MechanicalSystem(np.eye(2), zero, zero, W, np.array([push, 0.0]), ("a", "b"))
    spring, force = PolynomialSprings([0], [[1.0]]), HarmonicForce(np.array([0.3, -0.3]))
    found = solve_shooting(NonlinearSystem(system, (spring,), (force,)), 1.0)
    assert found.solution.converged is (push == 0.0)
    assert (found.stable is None) is (push != 0.0)
    if not push:
        assert abs(found.solution.deflection[0, 1]) == pytest.approx(0.6, rel=1e-6)


def test_the_top_between_two_wells_is_a_start():
    """Stiffness and inertia at rest cancel there; harmonic balance from the motion found agrees."""
    problem = oscillator(0.1, -1.0, 0.0, 1.0)
    found = solve_shooting(problem, 1.0, start=([1.0], [0.0]), harmonics=30)
    assert found.solution.converged
    other = solve_harmonic_balance(problem, 1.0, harmonics=30, start=found.solution.deflection)
    assert other.converged
    np.testing.assert_allclose(found.solution.deflection, other.deflection, atol=1e-6)
    moved = solve_transient(problem, 1.0, found.time[:200], start=(found.motion[0], found.velocity), method="DOP853")
    np.testing.assert_allclose(moved.displacement, found.motion[:200], atol=1e-6)


@pytest.mark.parametrize("start", STARTS)
def test_a_start_that_does_not_fit_is_refused(duffing, start):
    free = oscillator(0.0, 1.0, 0.0, 0.3, force=())
    for call in (
        lambda: solve_shooting(duffing, 1.0, start=start),
        lambda: solve_free_vibration(free, start, 6.0),
        lambda: solve_transient(duffing, 1.0, [0.0, 1.0], start=start),
        lambda: sweep_response(duffing, [1.0], start=start),
        lambda: stroboscopic_section(duffing, 1.0, start=start),
    ):
        with pytest.raises(CaseError, match="E-START") as error:
            call()
        assert "(1,)" in error.value.limit and error.value.remedy


def test_a_step_that_errs_by_more_than_the_motion_is_no_solution(duffing):
    fine, coarse, wrong = (solve_transient(duffing, 1.0, [0.0, 100.0], step=s) for s in (0.01, 0.5, 4.0))
    assert fine.converged and fine.error < 1e-3
    assert coarse.converged and coarse.error < 1.0 and "coarse" in coarse.message
    assert not wrong.converged and wrong.error > 1.0 and "shorten" in wrong.message


def test_empty_lists_and_ranges_are_refused(duffing):
    system, unit, k = duffing.system, np.ones(1), np.ones(1)
    modes = undamped_modes(system, k)
    for call, code in (
        (lambda: modal_response(system, modes, [], unit, unit), "E-RANGE"),
        (lambda: sweep_response(duffing, []), "E-RANGE"),
        (lambda: bifurcation_diagram(lambda value: (duffing, value), []), "E-RANGE"),
        (lambda: campbell_data(lambda speed: system, [], k), "E-RANGE"),
    ):
        with pytest.raises(CaseError) as error:
            call()
        assert error.value.code == code and error.value.limit and error.value.remedy
