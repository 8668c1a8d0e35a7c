from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.solution import loss_of
from femgear.solvers.stability.floquet import (
    floquet_verdict,
    floquet_verdicts,
    tangents_of,
)
from femgear.solvers.stability.parametric import stability
from femgear.system.force_laws import GearMeshes, PolynomialSprings, tangent_jumps
from femgear.system.fourier import FourierSeries, StepSeries, constant
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem, gear_meshes
from validation.parametric import RATIO, SOFT, mathieu_monodromy, rectangular_monodromy
from validation.reference.hill import hill_verdict

ONE = np.ones((1, 1))
MEAN = RATIO + (1.0 - RATIO) * SOFT


def oscillator(damping, elements, *, load=0.0, amplitude=None, stiffness=0.0):
    system = MechanicalSystem(ONE, damping * ONE, stiffness * ONE, ONE, np.array([load]), ("x",))
    forces = () if amplitude is None else (HarmonicForce(np.array([amplitude])),)
    return NonlinearSystem(system, elements, forces)


def pair(problem, frequency, harmonics=8, **options):
    return problem, solve_harmonic_balance(problem, frequency, harmonics=harmonics, **options)


def integrated(problem, solution, pieces=(0.0, 1.0)):
    """Multipliers by DOP853 on the equations of all degrees of freedom, restarted at given fractions."""
    tangents, system = tangents_of(problem, [solution]), problem.system
    period, n = 2 * np.pi / solution.frequency[0], len(system.M)

    def rate(t, y):
        z, v = y.reshape(2, n, -1)
        k = tangents(np.array([[t / period]]), np.array([0]))[0, 0]
        force = system.K @ z + problem.damping @ v + system.W @ (k @ (system.W.T @ z))
        return np.stack([v, -np.linalg.solve(system.M, force)]).ravel()

    y = np.eye(2 * n).ravel()
    for low, high in pairwise(pieces):
        # a hair inside, so that no step looks across a jump
        span = (period * (low + 1e-14), period * (high - 1e-14))
        y = solve_ivp(rate, span, y, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    values = np.linalg.eigvals(y.reshape(2 * n, 2 * n))
    return values[np.argsort(-np.abs(values))]


@pytest.mark.parametrize("decay, ratio", [(0.02, 2.0), (0.02, 1.0), (0.02, 0.5), (0.05, 2.0), (0.05, 1.0)])
def test_rectangular_stiffness_is_exact(decay, ratio):
    mesh = GearMeshes(np.array([0]), StepSeries([[1.0, SOFT]], [0.0, RATIO]), separates=False)
    problem, solution = pair(oscillator(2 * decay, (mesh,), load=1.0), ratio * np.sqrt(MEAN), 20)
    verdict = floquet_verdict(problem, solution)
    expected = np.linalg.eigvals(rectangular_monodromy(ratio, decay))
    assert verdict.method == "exact exponentials"
    assert abs(verdict.multipliers[0]) == pytest.approx(np.abs(expected).max(), rel=1e-11)
    assert verdict.stable == (np.abs(expected).max() < 1)


def test_convergence_of_the_fixed_point_is_not_stability():
    # w_m / w_n = 2 with 3 % damping: spectral radius 0.096, multiplier 1.090
    mesh = GearMeshes(np.array([0]), StepSeries([[1.0, SOFT]], [0.0, RATIO]), separates=False)
    natural = np.sqrt(MEAN)
    problem, solution = pair(oscillator(0.06 * natural, (mesh,), load=1.0), 2.0 * natural, 20)
    verdict = floquet_verdict(problem, solution)
    assert solution.converged and verdict.stable is False and verdict.loss == "flip"
    assert abs(verdict.multipliers[0]) == pytest.approx(1.090, abs=5e-4)


@pytest.mark.parametrize("a, q, damping", [(1.0, 1.0, 0.0), (2.5, 1.0, 0.0), (1.0, 0.1000546711, 0.1)])
def test_mathieu_by_splitting_and_by_hill(a, q, damping):
    mesh = GearMeshes(np.array([0]), FourierSeries([[a, -2.0 * q]]), separates=False)
    problem, solution = pair(oscillator(damping, (mesh,), load=1.0), 2.0)
    expected = np.linalg.eigvals(mathieu_monodromy(a, q, damping))
    for verdict in (floquet_verdict(problem, solution, tolerance=1e-12), hill_verdict(problem, solution)):
        away = np.abs(verdict.multipliers[:, None] - expected)
        assert max(away.min(axis=0).max(), away.min(axis=1).max()) < 2e-9
        assert np.prod(verdict.multipliers).real == pytest.approx(np.exp(-damping * np.pi), rel=1e-10)
        period_map = np.exp(verdict.exponents * np.pi)
        np.testing.assert_allclose(period_map, verdict.multipliers, atol=1e-12)


@pytest.fixture(scope="module")
def duffing():
    cubic = PolynomialSprings(np.array([0]), np.array([[0.0, 0.0, 0.1]]))
    return oscillator(0.05, (cubic,), amplitude=0.18, stiffness=1.0)


@pytest.mark.parametrize(
    "amplitude, phase, multiplier, loss",
    [
        (2.5091975811, -1.1, 0.80986415 + 0.33732103j, ""),
        (2.2605488905, -2.2, 1.31490727, "fold"),
        (0.4175204536, -3.0, None, ""),
    ],
)
def test_three_solutions_of_duffing(duffing, amplitude, phase, multiplier, loss):
    start = np.zeros((1, 16), complex)
    start[0, 1] = amplitude * np.exp(1j * phase)
    problem, solution = pair(duffing, 1.2, 15, start=start)
    assert abs(solution.deflection[0, 1]) == pytest.approx(amplitude, abs=1e-9)
    verdict = floquet_verdict(problem, solution, tolerance=1e-11)
    assert verdict.loss == loss and verdict.stable is (loss == "")
    if multiplier is not None:
        assert verdict.multipliers[0] == pytest.approx(multiplier, abs=1e-8)
    # the determinant is the dissipation of one period
    assert np.prod(verdict.multipliers).real == pytest.approx(0.7696654125, abs=1e-10)
    hill = hill_verdict(problem, solution)
    np.testing.assert_allclose(hill.exponents.real, verdict.exponents.real, atol=1e-10)


def gear_pair(stiffness):
    mesh = GearMeshes(np.array([0]), stiffness, backlash=4.0)
    return oscillator(0.1, (mesh,), load=0.3, amplitude=0.5)


def switches(solution):
    """Fractions of the period at which the deflection of the one mesh passes zero or the back side."""
    period, found = 2 * np.pi / solution.frequency[0], []
    for level in (0.0, -4.0):
        grid = np.linspace(0.0, 1.0, 2001)
        gap = lambda f, level=level: solution.at(f * period)[0] - level  # noqa: E731
        value = solution.at(grid * period)[:, 0] - level
        found += [brentq(gap, grid[i], grid[i + 1], xtol=1e-15) for i in np.flatnonzero(value[:-1] * value[1:] < 0)]
    return np.sort(found)


@pytest.mark.parametrize("wave", [0.0, 0.2])
def test_contact_changes_are_resolved(wave):
    problem, solution = pair(gear_pair(FourierSeries([[1.0, wave]])), 0.9, 12)
    assert solution.converged
    where = switches(solution)
    assert len(where) >= 2
    jumps = tangent_jumps(tangents_of(problem, [solution]), np.array([0]))[0]
    np.testing.assert_allclose(jumps, where, atol=1e-13)
    verdict = floquet_verdict(problem, solution, tolerance=1e-11)
    assert verdict.method == ("splitting" if wave else "exact exponentials")
    expected = integrated(problem, solution, [0.0, *where, 1.0])
    np.testing.assert_allclose(np.abs(verdict.multipliers), np.abs(expected), atol=1e-9)


def test_verdicts_of_the_planet_set_equal_the_linear_solver(planet_set, planet_excitation):
    excitation = planet_excitation(np.array([0.0, 1 / 3, 2 / 3, 0.1, 0.1 + 1 / 3, 0.1 + 2 / 3]), depth=0.3)
    mean = excitation.stiffness.mean(axis=1)
    system = planet_set()
    modes = undamped_modes(system, mean, damping_ratio=0.01)
    system = replace(system, C=modal_damping(system, mean, 0.01))
    problem = NonlinearSystem(system, (gear_meshes(excitation, harmonics=3, separates=False),))
    frequency = np.array([0.9, 1.68, 2.7, 3.75])
    solutions = [solve_harmonic_balance(problem, w, harmonics=6) for w in frequency]
    verdicts = floquet_verdicts(problem, solutions, tolerance=1e-9)
    expected = stability(
        modes, excitation, frequency / (2 * np.pi), excitation_harmonics=3, frequency_ratio=1e3, steps=400
    ).modulus
    np.testing.assert_allclose([abs(v.multipliers[0]) for v in verdicts], expected, rtol=2e-7)
    assert {v.stable for v in verdicts} == {bool(value <= 1) for value in expected}
    fewer = floquet_verdict(problem, solutions[0], modes=10)
    assert len(fewer.multipliers) == 20
    assert abs(fewer.multipliers[0]) == pytest.approx(expected[0], rel=1e-2)


def test_gyroscopic_terms_equal_time_integration():
    whirl = np.array([[0.0, -1.0], [1.0, 0.0]])
    system = MechanicalSystem(
        np.diag([1.0, 2.0]),
        np.array([[0.05, 0.02], [0.02, 0.08]]),
        np.diag([0.3, 0.5]),
        np.eye(2),
        np.array([1.0, 0.0]),
        ("x", "y"),
        whirl,
    )
    mesh = GearMeshes(np.array([0, 1]), FourierSeries([[1.0, 0.5], [1.5, 0.3j]]), separates=False)
    problem, solution = pair(NonlinearSystem(system, (mesh,), speed=0.7), 1.3)
    verdict = floquet_verdict(problem, solution, tolerance=1e-11)
    expected = integrated(problem, solution)
    np.testing.assert_allclose(np.sort(np.abs(verdict.multipliers)), np.sort(np.abs(expected)), atol=1e-9)
    hill = hill_verdict(problem, solution, harmonics=16)
    np.testing.assert_allclose(np.abs(hill.multipliers), np.abs(verdict.multipliers), atol=1e-9)


def test_combination_resonance_is_a_complex_pair():
    # springs that only couple the two motions, varied at the sum of their frequencies
    system = MechanicalSystem(
        np.eye(2), 0.01 * np.eye(2), np.diag([1.0, 4.0]), np.array([[1.0, 1.0], [1.0, -1.0]]), np.zeros(2), ()
    )
    mesh = GearMeshes(np.array([0, 1]), FourierSeries([[0.5, 0.4], [0.5, -0.4]]), separates=False)
    total = np.sqrt(2.0) + np.sqrt(5.0)
    problem, solution = pair(NonlinearSystem(system, (mesh,)), total)
    verdict = floquet_verdict(problem, solution, tolerance=1e-10)
    np.testing.assert_allclose(np.abs(verdict.multipliers), np.abs(integrated(problem, solution)), atol=1e-9)
    assert verdict.stable is False and verdict.loss == "Neimark-Sacker"


def test_no_verdict_is_never_stable(duffing):
    problem, solution = pair(duffing, 1.2, 5)
    assert floquet_verdict(problem, replace(solution, converged=False)).stable is None
    both = replace(solution, frequency=np.array([1.0, 1.3]), orders=np.column_stack([solution.orders, solution.orders]))
    verdict = floquet_verdict(problem, both)
    assert verdict.stable is None and "not covered" in verdict.message and not len(verdict.multipliers)


def test_kinds_of_loss():
    assert [loss_of(v) for v in (1.2 + 0j, -1.2 + 0j, 0.9 + 0.8j)] == ["fold", "flip", "Neimark-Sacker"]
    constant_spring = oscillator(0.1, (GearMeshes(np.array([0]), constant([1.0]), separates=False),), load=1.0)
    verdict = floquet_verdict(*pair(constant_spring, 0.7, 2))
    root = -0.05 + 1j * np.sqrt(1 - 0.05**2)
    np.testing.assert_allclose(abs(verdict.multipliers[0]), abs(np.exp(root * 2 * np.pi / 0.7)), rtol=1e-12)


def test_exact_exponentials_have_no_error():
    """Of a mass on a spring: multipliers ``exp(lambda T)``; only a splitting has an error to tell."""
    linear = GearMeshes([0], constant([4.0]), separates=False)
    verdict = floquet_verdict(*pair(oscillator(0.2, (linear,), amplitude=0.1), 1.3, harmonics=2))
    assert (verdict.method, verdict.error, verdict.stable) == ("exact exponentials", 0.0, True)
    root = -0.1 + 1j * np.sqrt(4.0 - 0.01)
    wanted = np.exp(2.0 * np.pi / 1.3 * np.array([root, np.conj(root)]))
    np.testing.assert_allclose(np.sort_complex(verdict.multipliers), np.sort_complex(wanted), rtol=1e-12)
    moving = GearMeshes([0], FourierSeries([[4.0, 0.5]]), separates=False)
    verdict = floquet_verdict(*pair(oscillator(0.2, (moving,), amplitude=0.1), 1.3, harmonics=4))
    assert verdict.method == "splitting" and 0.0 < verdict.error < 1e-6


def test_a_hundred_modes_are_followed():
    """Uncoupled masses have multipliers of size ``exp(-c T / 2)``, each with its own c: the slowest count."""
    count = 103
    damping = np.linspace(0.02, 0.3, count)
    system = MechanicalSystem(
        np.eye(count),
        np.diag(damping),
        np.diag(np.linspace(1.0, 3.0, count)),
        np.eye(count, 1),
        np.zeros(count),
        tuple(f"x{i}" for i in range(count)),
    )
    mesh = GearMeshes([0], constant([0.001]), separates=False)
    problem = NonlinearSystem(system, (mesh,), (HarmonicForce(np.ones(count)),))
    solution = solve_harmonic_balance(problem, 1.3, harmonics=1, stability=False)
    verdict = floquet_verdict(problem, solution)
    wanted = np.repeat(np.exp(-0.5 * damping[:100] * 2.0 * np.pi / 1.3), 2)
    np.testing.assert_allclose(np.sort(np.abs(verdict.multipliers))[::-1], wanted, rtol=1e-9)
