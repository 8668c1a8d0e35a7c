"""Shooting against elliptic integrals, published multipliers, harmonic balance and adaptive integration."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from femgear.errors import CaseError
from femgear.solvers.linear.modal import modal_damping
from femgear.solvers.periodic import shooting
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.stability.floquet import monodromy
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings, RadialBearings
from femgear.system.fourier import FourierSeries, StepSeries, constant
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem, gear_meshes
from validation.reference.cornered_springs import PiecewiseSprings
from validation.reference.free_vibration import solve_free_vibration

# Omega = 1.2 of NLvib example 01 (Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems, 2019)
DUFFING = {
    2.5091975811: (0.80986415 + 0.33732103j, 0.80986415 - 0.33732103j),
    2.2605488905: (1.31490727, 0.58533817),
    0.4175204536: None,
}


def oscillator(c, *elements, force=None, load=0.0):
    one = np.ones((1, 1))
    system = MechanicalSystem(one, c * one, 0.0 * one, one, np.array([load]), ("x",))
    return NonlinearSystem(system, elements, () if force is None else (HarmonicForce(np.array([force])),))


@pytest.fixture
def duffing():
    return oscillator(0.05, PolynomialSprings([0], [[1.0, 0.0, 0.1]]), force=0.18)


@pytest.fixture
def gear_pair():
    """One mesh with k(t), backlash and separation, loaded; lines of its deflection decay slowly."""
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.25, 0.08j]]), backlash=4.0)
    return oscillator(0.06, mesh, load=0.4)


@pytest.mark.parametrize("amplitude", DUFFING)
def test_three_motions_of_the_duffing_oscillator(duffing, amplitude):
    stiffness = 1.0 + 0.075 * amplitude**2 - 1.2**2
    line = amplitude * np.exp(1j * np.angle(0.18 / (stiffness + 0.06j)))
    found = solve_shooting(
        duffing,
        1.2,
        start=([line.real], [-1.2 * line.imag]),
        harmonics=15,
        integration=1e-12,
        tolerance=1e-11,
    )
    assert found.solution.converged
    assert abs(found.solution.deflection[0, 1]) == pytest.approx(amplitude, abs=1e-9)
    expected = DUFFING[amplitude]
    if expected is not None:
        np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(expected), atol=1e-8)
    assert found.stable == (amplitude != 2.2605488905)
    # Liouville: the determinant is exp(- c T)
    assert np.linalg.det(found.monodromy) == pytest.approx(np.exp(-0.05 * 2 * np.pi / 1.2), abs=1e-10)


@pytest.mark.parametrize("amplitude", [0.1, 0.5, 1.0, 2.0, 5.0])
def test_free_duffing_against_elliptic_integrals(amplitude):
    """x'' + x + x^3 = 0: omega = pi sqrt(1 + A^2) / (2 K(m)), m = A^2 / (2 (1 + A^2))."""
    omega = 0.5 * np.pi * np.sqrt(1 + amplitude**2) / ellipk(0.5 * amplitude**2 / (1 + amplitude**2))
    problem = oscillator(0.0, PolynomialSprings([0], [[1.0, 0.0, 1.0]]))
    found = solve_free_vibration(problem, ([amplitude], [0.0]), 0.9 * 2 * np.pi / omega)
    assert found.solution.converged
    assert found.solution.frequency[0] == pytest.approx(omega, abs=1e-11)


@pytest.mark.parametrize("amplitude, period", [(2.0, 10.283185307), (1.5, 14.283185307), (5.0, 7.283185307)])
def test_free_vibration_over_a_dead_zone(amplitude, period):
    problem = oscillator(0.0, PiecewiseSprings([0], [-1.0, 1.0], [1.0, 0.0, 1.0]))
    found = solve_free_vibration(problem, ([amplitude], [0.0]), 0.9 * period)
    assert found.period == pytest.approx(2 * np.pi + 4 / (amplitude - 1), abs=1e-9)
    assert found.period == pytest.approx(period, abs=1e-9)
    np.testing.assert_allclose(np.linalg.det(found.monodromy), 1.0, atol=1e-9)


def test_gear_pair_with_backlash_against_integration_and_harmonic_balance(gear_pair):
    omega = 0.9
    found = solve_shooting(gear_pair, omega, harmonics=60, settle=40, samples=8192)
    force = found.solution.force
    assert found.solution.converged and found.stable
    # the teeth do part in this motion
    x = found.solution.at(np.linspace(0.0, found.period, 400))
    assert x.min() < 0.0 < x.max()
    times = found.period * np.arange(5)
    start = found.displacement, found.velocity
    again = solve_transient(gear_pair, omega, times, start=start, method="DOP853", events=True, tolerance=1e-12)
    np.testing.assert_allclose(again.displacement[:, 0], found.displacement[0], atol=1e-8 * np.abs(x).max())
    balance = solve_harmonic_balance(gear_pair, omega, harmonics=60, start=found.solution.deflection, samples=2048)
    largest = np.abs(found.solution.deflection[:, 1:]).max()
    assert balance.converged
    np.testing.assert_allclose(balance.deflection[:, :20], found.solution.deflection[:, :20], atol=1e-5 * largest)
    # mean force balances the load
    assert force[0, 0].real == pytest.approx(0.4, abs=1e-5)


def test_multipliers_of_rectangular_stiffness_are_matrix_exponentials():
    """Lin and Parker's rectangular k(t), contact ratio 1.635: 2 omega_n excitation is unstable."""
    mesh = GearMeshes([0], StepSeries([[1.0, 0.65]], [0.0, 0.635]), force=constant([0.3]), separates=False)
    mean = 0.635 + 0.365 * 0.65
    problem, omega = oscillator(0.05 * 2 * np.sqrt(mean), mesh), 2 * np.sqrt(mean)
    found = solve_shooting(problem, omega, settle=0)
    c, period = problem.system.C[0, 0], 2 * np.pi / omega
    parts = np.array([[[0.0, 1.0], [-k, -c]] for k in (1.0, 0.65)])
    exact = np.linalg.eigvals(monodromy(parts, period * np.array([0.635, 0.365])))
    np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(exact), atol=1e-9)


@pytest.mark.slow
def test_planet_set_with_backlash_against_harmonic_balance(planet_set, planet_excitation):
    """Six meshes, some of which part in every period."""
    excitation = planet_excitation([0, 1 / 3, 2 / 3, 0.2, 0.2 + 1 / 3, 0.2 + 2 / 3], depth=0.5)
    excitation = replace(excitation, backlash=np.full(6, 0.5))
    system = planet_set(3)
    system = replace(system, C=modal_damping(system, excitation.stiffness.mean(axis=1), 0.03), load=0.3 * system.load)
    problem = NonlinearSystem(system, (gear_meshes(excitation, harmonics=3),))
    found = solve_shooting(problem, 1.9, harmonics=24, settle=60, integration=1e-9, tolerance=1e-8)
    balance = solve_harmonic_balance(problem, 1.9, harmonics=24, start=found.solution.deflection)
    assert found.solution.at(np.linspace(0.0, found.period, 200)).min() < 0.0
    assert found.solution.converged and balance.converged
    largest = np.abs(balance.deflection[:, 1:]).max()
    np.testing.assert_allclose(found.solution.deflection[:, :9], balance.deflection[:, :9], atol=1e-5 * largest)


@pytest.mark.slow
def test_a_limit_cycle_finds_its_own_amplitude_and_period():
    """A whirling rotor, x'' + c x' + k x + kc y + S(r) x = 0: omega = kc / c and S(r) = omega^2 - k."""
    c, circulatory, ring = 0.1, 0.12, RadialBearings([[0, 1]], 1.0, 0.5)
    K = np.array([[1.0, circulatory], [-circulatory, 1.0]])
    system = MechanicalSystem(np.eye(2), c * np.eye(2), K, np.eye(2), np.zeros(2), ("x", "y"))
    problem = NonlinearSystem(system, (ring,))

    def excess(r):
        return ring.evaluate(np.array([[r, 0.0]]), np.zeros(1))[0][0, 0] / r - (circulatory / c) ** 2 + 1.0

    r = brentq(excess, 0.6, 5.0)
    found = solve_free_vibration(problem, ([1.1 * r, 0.0], [0.1, 1.2 * r]), 5.0, conservative=False)
    assert found.solution.converged and found.stable
    assert found.solution.frequency[0] == pytest.approx(1.2, abs=1e-9)
    assert np.hypot(*found.displacement) == pytest.approx(r, abs=1e-8)
    # the multiplier of the phase
    assert np.abs(found.multipliers - 1.0).min() < 1e-8


def test_without_success_the_message_says_so(duffing):
    found = solve_shooting(duffing, 1.2, start=([5.0], [0.0]), max_iterations=1)
    assert not found.solution.converged and "better start" in found.solution.message


def test_bad_input_is_refused(duffing):
    for arguments, options in (
        ((duffing, 0.0), {}),
        ((duffing, [1.0, np.sqrt(2.0)]), {}),
        ((duffing, 1.0), {"harmonics": 20, "samples": 30}),
    ):
        with pytest.raises(CaseError, match=r"E-RANGE|E-RANGE"):
            solve_shooting(*arguments, **options)
    with pytest.raises(CaseError, match="E-RANGE"):
        solve_free_vibration(duffing, ([1.0], [0.0]), 5.0)


def test_a_linear_motion_takes_one_step():
    """Newton's method is exact for it: two residuals, one matrix; c = 0.05 at the frequency 1."""
    found = solve_shooting(oscillator(0.05, PolynomialSprings([0], [[1.0]]), force=0.18), 1.0, harmonics=3)
    assert found.solution.converged and len(found.solution.history) == 2
    assert found.solution.iterations == found.solution.factorisations == 1
    assert abs(found.solution.deflection[0, 1]) == pytest.approx(0.18 / 0.05, rel=1e-6)


def test_multipliers_come_largest_first(duffing):
    line = 2.2605488905 * np.exp(1j * np.angle(0.18 / (1.0 + 0.075 * 2.2605488905**2 - 1.2**2 + 0.06j)))
    found = solve_shooting(duffing, 1.2, start=([line.real], [-1.2 * line.imag]), integration=1e-12)
    assert found.multipliers.real == pytest.approx(DUFFING[2.2605488905], rel=1e-3)


def test_no_start_returns_at_an_undamped_resonance():
    """From rest ``x = 0.09 t sin t`` grows for ever: one matrix shows that no start does better."""
    problem = oscillator(0.0, PolynomialSprings([0], [[1.0]]), force=0.18)
    found = solve_shooting(problem, 1.0, start=([0.0], [0.0])).solution
    assert not found.converged and found.stable is None
    assert "no start returns" in found.message
    assert found.iterations == 0 and found.factorisations == 1


def test_a_step_that_never_helps_is_taken_whole(duffing, monkeypatch):
    """After eight halvings: the way out may lead over a larger defect."""
    tried = []

    def shoot(moving, y, period, options):
        tried.append(float(y[0]))
        return y + 1.0, None

    monkeypatch.setattr(shooting, "shoot", shoot)
    moving = shooting.flow(duffing, np.array([1.2]), variational=True)
    found = shooting._improved(moving, np.zeros(2), np.array([0.5, 0.25]), 0.9, 5.0, {})
    assert found.tolist() == [0.5, 0.25]
    assert tried == [0.5**k for k in range(1, 9)]


def test_a_start_beyond_the_motion_in_all_it_has_takes_one_step(monkeypatch):
    """A linear motion that decays: after a period displacement and velocity are smaller than they were."""
    shot, shoot = [], shooting.shoot
    monkeypatch.setattr(shooting, "shoot", lambda *given: shot.append(given) or shoot(*given))
    problem = oscillator(0.2, PolynomialSprings([0], [[1.0]]), force=1e-3)
    found = solve_shooting(problem, 1.0, start=([5.0], [5.0]))
    assert found.solution.iterations == 1 and len(shot) == 3
