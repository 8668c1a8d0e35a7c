"""What a periodic solution says about itself: truncation, spectral radius of the fixed point, stability."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.continuation.branches import frequency_response_curve, parameter_curve
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.periodic.equations import harmonic_balance
from femgear.solvers.periodic.harmonic_balance import periodic_response, solve_harmonic_balance
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.stability import floquet
from femgear.solvers.stability.floquet import floquet_verdict, floquet_verdicts
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries, harmonics_of
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem, gear_meshes
from validation.parametric import NATURAL, one_pair, rectangular_monodromy

ONE = np.ones((1, 1))


def rectangular_pair():
    """The gear pair of G5 and G6 with 40 harmonics of its rectangular mesh stiffness."""
    _, excitation = one_pair(0.03)
    system = MechanicalSystem(ONE, 0.06 * NATURAL * ONE, 0.0 * ONE, ONE, np.ones(1), ("x",))
    stiffness = FourierSeries(harmonics_of(excitation.stiffness, 40))
    return NonlinearSystem(system, (GearMeshes(np.array([0]), stiffness, separates=False),))


@pytest.mark.parametrize(
    ("ratio", "radius", "multiplier", "stable"),
    [(2.0, 0.096, 1.090, False), (1.0, 1.022, 1.005, False), (0.5, 0.579, None, True)],
)
def test_fixed_point_that_converges_does_not_mean_stable(ratio, radius, multiplier, stable):
    """At twice the natural frequency the fixed point converges to a motion that is unstable."""
    found = periodic_response(rectangular_pair(), ratio * NATURAL, harmonics=80)
    assert found.solution.converged and found.tail < 1e-3
    assert found.spectral_radius == pytest.approx(radius, abs=5e-4)
    assert found.stable is stable
    largest = abs(found.verdict.multipliers[0])
    exact = np.abs(np.linalg.eigvals(rectangular_monodromy(ratio, 0.03 * NATURAL))).max()
    assert largest == pytest.approx(exact, abs=1e-4)
    if multiplier is not None:
        assert largest == pytest.approx(multiplier, abs=5e-4)
    modes, excitation = one_pair(0.03)
    linear = solve_spectral(
        modes,
        excitation,
        np.array([ratio * NATURAL / (2.0 * np.pi)]),
        excitation_harmonics=40,
        response_harmonics=80,
    )
    assert found.spectral_radius == pytest.approx(linear.spectral_radius[0], rel=1e-5)


def test_radius_of_two_coupled_meshes_equals_that_of_the_linear_solver(geared_chain, chain_excitation):
    excitation = chain_excitation(0.3)
    mean = excitation.stiffness.mean(axis=1)
    system = MechanicalSystem(
        geared_chain.M,
        modal_damping(geared_chain, mean, 0.04),
        geared_chain.K,
        geared_chain.W,
        geared_chain.load,
        geared_chain.dofs,
    )
    problem = NonlinearSystem(system, (gear_meshes(excitation, harmonics=3, separates=False),))
    modes = undamped_modes(geared_chain, mean, damping_ratio=0.04)
    frequency = np.array([0.05, 0.12, 0.2, 0.31])
    linear = solve_spectral(modes, excitation, frequency, excitation_harmonics=3, response_harmonics=10)
    found = [solve_harmonic_balance(problem, 2.0 * np.pi * f, harmonics=10).spectral_radius for f in frequency]
    np.testing.assert_allclose(found, linear.spectral_radius, rtol=1e-8)


def duffing(amplitude=0.18):
    system = MechanicalSystem(ONE, 0.05 * ONE, ONE, ONE, np.zeros(1), ("x",))
    cubic = PolynomialSprings(np.array([0]), np.array([[0.0, 0.0, 0.1]]))
    return NonlinearSystem(system, (cubic,), (HarmonicForce(np.array([amplitude])),))


@pytest.mark.parametrize(("force", "converges"), [(0.18, True), (0.6, False)])
def test_radius_is_the_rate_of_the_plain_iteration_of_a_nonlinear_system(force, converges):
    """``X <- T S - T (F - reference X)`` run as it stands, away from resonance and near it."""
    problem, omega = duffing(force), 1.6 if converges else 1.15
    balance = harmonic_balance(problem, harmonics=5)
    found = solve_harmonic_balance(problem, omega, harmonics=5)
    y = balance.unknowns(found.deflection)
    distance = []
    away = y + 1e-6 * np.random.default_rng(1).standard_normal(len(y))
    for _ in range(30):
        away = away - balance.evaluate(away, np.array([omega]))[0]
        distance.append(np.linalg.norm(away - y))
        if not 1e-13 < distance[-1] < 1e-3:
            break
    assert (distance[-1] < distance[0]) == converges == (found.spectral_radius < 1.0)
    # a pair of complex eigenvalues turns: the mean rate over several steps
    middle = len(distance) // 2
    rate = (distance[middle] / distance[0]) ** (1.0 / middle)
    assert rate == pytest.approx(found.spectral_radius, rel=0.15)


def test_radius_is_nan_only_where_it_is_not_asked_for():
    assert np.isnan(solve_harmonic_balance(duffing(), 1.6, harmonics=3, radius=False).spectral_radius)
    stopped = solve_harmonic_balance(duffing(), 1.2, harmonics=3, start=np.ones((1, 4)), max_iterations=1)
    assert not stopped.converged and np.isfinite(stopped.spectral_radius)
    options = {"harmonics": 3, "stability": False}
    assert np.isnan(frequency_response_curve(duffing(), (1.6, 1.7), **options).spectral_radius).all()
    found = frequency_response_curve(duffing(), (1.6, 1.7), radius=True, **options)
    single = solve_harmonic_balance(duffing(), 1.7, harmonics=3)
    assert found.spectral_radius[-1] == pytest.approx(single.spectral_radius, rel=1e-8)


def test_verdict_of_what_did_not_converge_is_open():
    found = periodic_response(duffing(), 1.2, harmonics=3, start=np.ones((1, 4)), max_iterations=1)
    assert found.stable is None and "did not converge" in found.verdict.message


def test_frequency_zero_has_no_verdict():
    """It is refused before anything is computed; without stability the static solution is there."""
    for call in (
        lambda: periodic_response(duffing(), 0.0, harmonics=5),
        lambda: frequency_response_curve(duffing(), (0.0, 2.0), harmonics=5),
        lambda: frequency_response_curve(duffing(), (2.0, 0.0), harmonics=5),
        lambda: parameter_curve(duffing, (0.1, 0.2), 0.0, harmonics=5),
    ):
        with pytest.raises(CaseError, match="E-RANGE") as caught:
            call()
        assert caught.value.value == 0.0 and caught.value.limit and caught.value.remedy
    found = frequency_response_curve(duffing(), (0.0, 0.3), harmonics=5, stability=False)
    assert found.complete and found.parameter[0] == 0.0 and not found.verdicts
    still = solve_harmonic_balance(duffing(), 0.0, harmonics=5)
    verdict = floquet_verdict(duffing(), still)
    assert verdict.stable is None and "no period" in verdict.message


@pytest.mark.parametrize("frequency", [1e-12, 1e-310])
def test_period_too_long_for_the_fastest_mode_is_left_open(frequency):
    found = periodic_response(duffing(), frequency, harmonics=5)
    assert found.solution.converged and found.stable is None
    assert "not determined" in found.verdict.message and not len(found.verdict.multipliers)


def test_long_period_within_the_bound_has_its_verdict():
    """The product of the multipliers is the dissipation of one period, ``exp(-c T)`` (Liouville)."""
    problem = replace(duffing(), system=replace(duffing().system, C=1e-3 * ONE))
    found = periodic_response(problem, 1e-2, harmonics=9)
    assert found.stable is True and found.verdict.method == "splitting"
    period = 2.0 * np.pi / 1e-2
    assert np.prod(found.verdict.multipliers).real == pytest.approx(np.exp(-1e-3 * period), rel=1e-6)


def test_portions_of_long_periods_change_no_verdict(monkeypatch):
    solutions = [solve_harmonic_balance(duffing(), f, harmonics=7) for f in (1.8, 0.2, 1.6, 0.3)]
    together = floquet_verdicts(duffing(), solutions)
    monkeypatch.setattr(floquet, "_MOST_ENTRIES", 40)
    apart = floquet_verdicts(duffing(), solutions)
    for one, other in zip(together, apart):
        np.testing.assert_allclose(one.multipliers, other.multipliers, atol=1e-7)
        assert one.stable is other.stable is True
