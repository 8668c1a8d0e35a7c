"""Lyapunov exponents: closed forms, Floquet multipliers, a published attractor, neighbouring motions."""

from contextlib import nullcontext
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from small_trains import example_pair, lightly_loaded_pair

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.stability.lyapunov import _check_sum, _Stepped, _weighted, lyapunov_exponents, pieces
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries, constant
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.reference.adaptive_lyapunov import adaptive_exponents


def oscillator(element, damping, force=0.0):
    one = np.eye(1)
    system = MechanicalSystem(one, damping * one, 0.0 * one, one, np.zeros(1), ("x",))
    return NonlinearSystem(system, (element,), (HarmonicForce([force]),) if force else ())


@pytest.mark.slow
def test_linear_oscillator_decays_with_its_damping():
    # omega_n = 2, zeta = 0.1: both exponents are -zeta omega_n
    problem = oscillator(GearMeshes([0], constant([4.0]), separates=False), 0.4, 0.3)
    exact = adaptive_exponents(problem, 1.3, count=2, points=60, skip=5)
    np.testing.assert_allclose(exact.exponents, -0.2, atol=2e-5)
    np.testing.assert_allclose(exact.exponents.sum(), exact.divergence, atol=1e-9)
    steps = lyapunov_exponents(problem, 1.3, count=2, points=80, skip=5)
    np.testing.assert_allclose(steps.exponents, -0.2, atol=2e-4)
    assert exact.chaotic is False and steps.chaotic is False


@pytest.mark.parametrize("solve, tolerance", [(adaptive_exponents, 1e-8), (lyapunov_exponents, 3e-4)])
def test_damped_mathieu_equation(solve, tolerance):
    # x'' + c x' + (1 + c^2/4 - 2 cos 2t) x = 0: exp(-ct/2) times Mathieu's a = q = 1, multiplier -4.15605494
    problem = oscillator(GearMeshes([0], FourierSeries([[1.01, -2.0]]), separates=False), 0.2)
    found = solve(problem, 2.0, count=2, points=12, skip=12)
    floquet = np.log(4.15605494) / np.pi
    np.testing.assert_allclose(found.exponents, [floquet - 0.1, -floquet - 0.1], atol=tolerance)
    assert found.scatter.max() < 1e-9
    assert np.abs(found.exponents - [floquet - 0.1, -floquet - 0.1]).max() <= max(found.error.max(), 1e-8)
    # an unstable linear system is not chaotic
    assert found.chaotic is False and "linear" in found.verdict


@pytest.mark.slow
def test_attractor_of_ueda():
    # Y. Ueda, J. Stat. Phys. 20 (1979) 181-196: x'' + 0.05 x' + x^3 = 7.5 cos t; 0.0999 and -0.1499 over one
    # long run (sites.google.com/view/lyapunov-spectrum), 0.1022 +- 0.0008 by Runge-Kutta from 100 starts
    problem = oscillator(PolynomialSprings([0], [[0.0, 0.0, 1.0]]), 0.05, 7.5)
    found = lyapunov_exponents(problem, 1.0, count=2, points=200, skip=20, start=([2.0], [0.1]))
    assert max(abs(found.largest - value) for value in (0.0999, 0.1022)) < 3.0 * found.error[0] < 0.06
    np.testing.assert_allclose(found.exponents.sum(), -0.05, atol=1e-3)
    assert found.chaotic and found.section.repeats_after(1e-3) == 0


@pytest.mark.slow
def test_stable_impacts_have_the_exponent_of_their_multiplier():
    pair, ratio = example_pair(0.09), 0.8
    solution = solve_harmonic_balance(pair.problem(ratio), 1.0, harmonics=24)
    floquet = np.log(np.abs(solution.verdict.multipliers[0])) / (2.0 * np.pi)
    start = solution.at([0.0])[0], (1j * solution.line_frequency * solution.deflection).sum(axis=1).real
    found = adaptive_exponents(pair.problem(ratio), 1.0, points=20, skip=12, start=start, directions=2)
    assert found.lowest[0] < -1.0, "both flanks touch"
    assert found.largest == pytest.approx(floquet, abs=3e-3) and found.section.repeats_after() == 1


@pytest.mark.slow
def test_chaotic_pair_by_tangents_and_by_neighbours():
    problem = lightly_loaded_pair().problem(1.5)
    found = lyapunov_exponents(problem, 1.0, points=600, skip=40, steps=100)
    assert found.chaotic and found.section.repeats_after(1e-3) == 0
    # two motions, a nanounit apart, without any derivative
    rates, times = [], 2.0 * np.pi * np.arange(13)
    for place in (20, 80, 140, 200):
        q, v = found.section.displacement[place], found.section.velocity[place]
        runs = [
            solve_transient(problem, 1.0, times, start=(q + d, v), method="DOP853", events=True) for d in (0.0, 1e-9)
        ]
        gap = np.hypot(*(getattr(runs[1], n) - getattr(runs[0], n) for n in ("displacement", "velocity")))
        rates.append(np.log(gap[-1, 0] / gap[1, 0]) / (times[-1] - times[1]))
    scatter = np.std(rates, ddof=1) / np.sqrt(len(rates))
    assert abs(np.mean(rates) - found.largest) < 3.0 * np.hypot(scatter, found.error[0])
    assert found.largest > 10.0 * found.error[0]


@pytest.mark.parametrize(
    "options, code",
    [
        ({"count": 3}, "E-RANGE"),
        ({"points": 3}, "E-RANGE"),
        ({"skip": -1}, "E-RANGE"),
        ({"directions": 0}, "E-RANGE"),
        ({"start": ([0.0, 1.0], [0.0, 1.0])}, "E-START"),
        ({"steps": 1}, "E-RANGE"),
    ],
)
def test_wrong_questions_are_refused(options, code):
    with pytest.raises(CaseError) as caught:
        lyapunov_exponents(lightly_loaded_pair().problem(1.0), 1.0, **options)
    assert caught.value.code == code


def unsupported(stiffness, damping, force):
    one = np.eye(1)
    system = MechanicalSystem(one, damping * one, stiffness * one, one, np.zeros(1), ("x",))
    return NonlinearSystem(system, (), (HarmonicForce([force]),))


@pytest.mark.parametrize("stiffness, damping", [(4.0, 0.0), (0.0, 0.0), (-1.0, 0.1)])
@pytest.mark.parametrize("solve", [lyapunov_exponents, adaptive_exponents])
def test_linear_motions_are_not_chaotic(stiffness, damping, solve):
    problem = unsupported(stiffness, damping, 1.0)
    found = solve(problem, 1.0, points=8, skip=2, steps=60, directions=1)
    assert found.chaotic is not True and found.verdict


def test_overdamped_oscillator_by_both_methods():
    # x'' + 5 x' + x: (-5 +- sqrt 21) / 2
    problem = oscillator(GearMeshes([0], constant([1.0]), separates=False), 5.0, 1.0)
    exact = np.array([-5.0 + np.sqrt(21.0), -5.0 - np.sqrt(21.0)]) / 2.0
    for solve, steps, bound in ((adaptive_exponents, 200, 1e-6), (lyapunov_exponents, 400, 3e-3)):
        found = solve(problem, 1.0, count=2, points=8, skip=1, steps=steps, directions=1)
        np.testing.assert_allclose(found.exponents, exact, atol=bound)
        assert np.abs(found.exponents - exact).max() <= max(found.error.max(), 1e-9)


def test_exponents_that_do_not_add_up_are_refused():
    # 8 steps a period for a decay of 40 per time unit
    problem = oscillator(GearMeshes([0], constant([1.0]), separates=False), 40.0, 1.0)
    with pytest.raises(ConvergenceError) as caught:
        lyapunov_exponents(problem, 1.0, count=2, points=8, skip=0, steps=8)
    assert caught.value.code == "E-INTEGRATION"


def test_motion_beyond_all_bounds_is_refused():
    with pytest.raises(ConvergenceError) as caught:
        lyapunov_exponents(unsupported(-1.0, 0.1, 1.0), 1.0, points=60, skip=20)
    assert caught.value.code == "E-DIVERGED"


def test_unstable_rest_by_the_adaptive_method():
    found = adaptive_exponents(unsupported(-1.0, 0.1, 0.0), 1.0, points=8, skip=0, directions=1)
    assert found.chaotic is False


@pytest.mark.parametrize(
    "options, code",
    [
        ({"points": 20.5}, "E-RANGE"),
        ({"skip": 1.5}, "E-RANGE"),
        ({"seed": -1}, "E-RANGE"),
        ({"points": "many"}, "E-RANGE"),
    ],
)
def test_wrong_numbers_are_refused(options, code):
    with pytest.raises(CaseError) as caught:
        lyapunov_exponents(lightly_loaded_pair().problem(1.0), 1.0, **options)
    assert caught.value.code == code


def test_the_error_of_the_steps_is_that_beside_the_exact_exponents():
    """Mathieu's equation again: the error of coarser steps, told without the exact value, bounds its own."""
    problem = oscillator(GearMeshes([0], FourierSeries([[1.01, -2.0]]), separates=False), 0.2)
    floquet = np.log(4.15605494) / np.pi
    errors = []
    for steps in (50, 100, 200):
        found = lyapunov_exponents(problem, 2.0, count=2, points=12, skip=12, steps=steps)
        exact = np.abs(found.exponents - [floquet - 0.1, -floquet - 0.1]).max()
        assert 0.2 * exact < found.step_error.max() < 20.0 * exact
        errors.append(found.step_error.max())
        np.testing.assert_allclose(found.section.time, found.period * (12 + np.arange(12)))
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


def test_the_sum_of_all_exponents_is_the_divergence_to_two_per_cent_of_the_largest():
    run = SimpleNamespace(size=2, divergence=-2.0, period=1.0)
    cases = ((2, 0.019, False), (2, 0.021, True), (1, 0.5, False))
    for sign, (count, off, refused) in product((-1.0, 1.0), cases):
        exponents = np.array([1.0, -3.0 + sign * 3.0 * off])[:count]
        exponents[-1] *= 3.0 / np.abs(exponents[-1]) if count == 1 else 1.0
        outcome = pytest.raises(ConvergenceError, match="the exponents add up") if refused else nullcontext()
        with outcome:
            _check_sum(exponents, np.zeros(count), run)
        # a scatter of the same size excuses it
        _check_sum(exponents, np.full(count, 0.022), run)


def test_an_undamped_oscillation_turns_and_does_not_stretch():
    """In the coordinates of the small motions: a step turns by ``2 atan(h omega / 2)``."""
    problem = oscillator(GearMeshes([0], constant([9.0]), separates=False), 0.0, 0.1)
    stepped = _Stepped(problem, [1.3], 40, 1)
    (_, parts) = next(stepped.passages(([0.2], [0.1])))
    angle = 40.0 * 2.0 * np.arctan(0.5 * 3.0 * stepped.period / 40.0)
    whole = np.linalg.multi_dot(parts[::-1])
    turned = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(whole, turned, atol=1e-12)


def test_small_motions_are_made_orthogonal_before_they_fade():
    """By ``exp(-3)`` at most between two times; four times a period, and not more than a thousand times."""
    assert pieces(np.zeros((0, 0)), 2.0) == pieces(np.zeros((2, 2)), 2.0) == 4
    for rate, period in ((5.9, 2.0), (6.1, 2.0), (30.0, 2.0), (1.0, 500.0)):
        # the strongest damping counts, here along (3, 4)
        along = np.array([0.6, 0.8])
        damping = rate * np.outer(along, along)
        count = pieces(damping, period)
        assert np.exp(-rate * period / count) >= np.exp(-3.0) * (1.0 - 1e-12)
        assert count == 4 or np.exp(-rate * period / (count - 1)) < np.exp(-3.0)
    assert pieces(np.diag([1e6, 0.0]), 2.0) == 1000


def test_the_weighted_mean_of_a_ramp_is_its_middle():
    """Weights that fade towards both ends are those of a symmetric window."""
    assert _weighted(np.arange(21.0)[:, None, None]).item() == pytest.approx(10.0, rel=1e-12)
