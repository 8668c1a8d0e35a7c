"""Steps in time and adaptive integration: errors, limits and orders of the literature, closed forms."""

import numpy as np
import pytest

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import modal_damping
from femgear.solvers.stability.floquet import monodromy
from femgear.solvers.time.steps import (
    AVERAGE_ACCELERATION,
    CENTRAL_DIFFERENCE,
    FOX_GOODWIN,
    LINEAR_ACCELERATION,
    StepRule,
    generalised_alpha,
    highest_frequency,
    stability_limit,
)
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries, StepSeries, constant
from femgear.system.system import (
    HarmonicForce,
    MechanicalSystem,
    NonlinearSystem,
    element_forces,
    gear_meshes,
    tabulated_law,
)
from validation.reference.cornered_springs import BearingSprings, PiecewiseSprings
from validation.reference.step_rules import numerical_damping, period_error

RATIOS = np.array([0.01, 0.05, 0.1, 0.2])
FIXED = (
    "average acceleration",
    "linear acceleration",
    "Fox-Goodwin",
    "central difference",
    "generalised alpha",
)
# T. J. R. Hughes, The Finite Element Method (2000), chapter 9, evaluated in extended precision
PERIOD_ERRORS = {
    AVERAGE_ACCELERATION: (0.000328900, 0.008171243, 0.032074911, 0.120033),
    LINEAR_ACCELERATION: (0.000164447, 0.004083787, 0.016001854, 0.059145),
    CENTRAL_DIFFERENCE: (-0.000164539, -0.00414145, -0.0169342, -0.0751724),
}
# m = 1, c = 0.1, k = 4, p = cos 3 t, start (1, 0): closed form at t = 10
FORCED_END = 0.2650852834949518


def oscillator(m=1.0, c=0.0, k=0.0, *, force=None, elements=(), load=0.0):
    one = np.ones((1, 1))
    system = MechanicalSystem(m * one, c * one, k * one, one, np.array([load]), ("x",))
    forces = () if force is None else (HarmonicForce(np.array([force])),)
    return NonlinearSystem(system, tuple(elements), forces)


@pytest.fixture
def geared_set(planet_set, planet_excitation):
    """Planets with k(t) and backlash: 15 degrees of freedom, 6 meshes that part."""
    from dataclasses import replace

    excitation = planet_excitation([0, 1 / 3, 2 / 3, 0.2, 0.2 + 1 / 3, 0.2 + 2 / 3], depth=0.3)
    excitation = replace(excitation, backlash=np.full(6, 0.5))
    system = planet_set(3)
    system = replace(system, C=modal_damping(system, excitation.stiffness.mean(axis=1), 0.03), load=0.3 * system.load)
    return NonlinearSystem(system, (gear_meshes(excitation, harmonics=3),))


@pytest.mark.parametrize("rule", PERIOD_ERRORS)
def test_period_errors(rule):
    np.testing.assert_allclose(period_error(rule, RATIOS), PERIOD_ERRORS[rule], atol=1e-6)
    w = 2.0 * np.pi * RATIOS
    if rule is AVERAGE_ACCELERATION:
        np.testing.assert_allclose(period_error(rule, RATIOS), 0.5 * w / np.arctan(0.5 * w) - 1.0, rtol=1e-9)


def test_dissipative_rule():
    rule = StepRule(0.6, 0.3025)
    assert period_error(rule, 0.1) == pytest.approx(0.0329459, abs=1e-7)
    assert numerical_damping(rule, 0.1) == pytest.approx(0.0295125, abs=1e-7)


def test_marched_period_is_the_predicted_one():
    """The steps themselves, not only the formula: zero crossings of a free oscillator over 50 periods."""
    for rule, name in ((AVERAGE_ACCELERATION, FIXED[0]), (CENTRAL_DIFFERENCE, FIXED[3])):
        h = 0.1
        times = h * np.arange(550)
        # a start off the crest so that no step falls on a crossing
        found = solve_transient(oscillator(k=(2.0 * np.pi) ** 2), 0.0, times, start=([1.0], [0.3]), method=name, step=h)
        x = found.displacement[:, 0]
        angle = np.angle(np.exp(2j * np.pi * h / (1.0 + period_error(rule, h))))
        # a free step obeys x_2 - 2 cos(angle) x_1 + x_0 = 0
        np.testing.assert_allclose(x[2:] + x[:-2], 2.0 * np.cos(angle) * x[1:-1], atol=1e-12)


def test_stability_limits():
    assert stability_limit(LINEAR_ACCELERATION) == pytest.approx(0.5513288954, abs=1e-10)
    assert stability_limit(CENTRAL_DIFFERENCE) == pytest.approx(0.3183098862, abs=1e-10)
    assert stability_limit(FOX_GOODWIN) == pytest.approx(0.3898484006, abs=1e-10)
    assert stability_limit(AVERAGE_ACCELERATION) == np.inf
    assert stability_limit(generalised_alpha(0.3)) == np.inf


@pytest.mark.parametrize(
    "method, rule",
    [(FIXED[1], LINEAR_ACCELERATION), (FIXED[2], FOX_GOODWIN), (FIXED[3], CENTRAL_DIFFERENCE)],
)
def test_steps_beyond_the_limit_are_refused_and_those_below_stay_bounded(method, rule):
    problem, limit = oscillator(k=(2.0 * np.pi) ** 2), stability_limit(rule)
    h = 0.999 * limit
    found = solve_transient(problem, 0.0, h * np.arange(2001), start=([1.0], [0.0]), method=method, step=h)
    assert np.abs(found.displacement).max() < 100.0
    with pytest.raises(CaseError, match="E-RANGE") as error:
        solve_transient(problem, 0.0, [0.0, 100.1 * limit], method=method, step=1.001 * limit)
    assert f"{limit:.4g}" in error.value.limit


def test_a_mesh_counts_in_the_limit_with_its_largest_stiffness():
    meshes = GearMeshes([0], FourierSeries([[1.0, 0.5]]))
    shortest = 2.0 * np.pi / np.sqrt(1.5)
    problem, limit = oscillator(elements=[meshes]), stability_limit(CENTRAL_DIFFERENCE) * shortest
    solve_transient(problem, 1.0, [0.0, 0.99 * limit], method=FIXED[3], step=0.99 * limit)
    with pytest.raises(CaseError, match="E-RANGE"):
        solve_transient(problem, 1.0, [0.0, 1.01 * limit], method=FIXED[3], step=1.01 * limit)


def forced_errors(method, counts=(100, 200, 400, 800), **options):
    problem = oscillator(1.0, 0.1, 4.0, force=1.0)
    ends = [
        solve_transient(
            problem, 3.0, [0.0, 10.0], start=([1.0], [0.0]), method=method, step=10.0 / n, **options
        ).displacement[-1, 0]
        for n in counts
    ]
    return np.array(ends) - FORCED_END


def test_average_acceleration_errors_to_the_digits():
    expected = 0.04471915, 0.01136473, 0.00285250, 0.000713829
    np.testing.assert_allclose(forced_errors(FIXED[0]), expected, atol=1.5e-8)


@pytest.mark.parametrize("method", [*FIXED, "modal"])
def test_second_order_in_the_step(method):
    errors = np.abs(forced_errors(method))
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(2.0, abs=0.015)


def test_fox_goodwin_is_of_second_order_and_gamma_above_a_half_of_first():
    errors = np.abs(forced_errors("Fox-Goodwin"))
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(1.99, abs=0.01)
    errors = np.abs(forced_errors("newmark", gamma=0.6, beta=0.3025))
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(0.84, abs=0.1)


@pytest.mark.parametrize("method", ["DOP853", "Radau", "LSODA"])
def test_adaptive_methods_reach_the_closed_form(method):
    found = solve_transient(
        oscillator(1.0, 0.1, 4.0, force=1.0),
        3.0,
        [0.0, 4.0, 10.0],
        start=([1.0], [0.0]),
        method=method,
        tolerance=1e-9,
    )
    assert found.displacement[-1, 0] == pytest.approx(FORCED_END, abs=1e-7)


def test_average_acceleration_keeps_the_energy():
    steps = 100_000
    found = solve_transient(
        oscillator(k=1.0), 0.0, 0.1 * np.array([0.0, 0.5 * steps, steps]), start=([1.0], [0.0]), step=0.1
    )
    energy = 0.5 * (found.velocity**2 + found.displacement**2)[:, 0]
    assert np.abs(energy / 0.5 - 1.0).max() < 5e-13


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("turn", [1.0, 3.0, 100.0])
def test_generalised_alpha_has_its_radius_at_high_frequency(radius, turn):
    """Marched steps obey the eigenvalues of the method (Cayley and Hamilton); these reach the radius."""
    rule, problem = generalised_alpha(radius), oscillator(k=turn**2)
    roots = amplification(rule, turn)
    found = solve_transient(
        problem,
        0.0,
        np.arange(13.0),
        start=([1.0], [0.0]),
        step=1.0,
        method="generalised alpha",
        radius=radius,
    )
    x, polynomial = found.displacement[:, 0], np.poly(roots).real
    recurrence = np.correlate(x, polynomial[::-1], mode="valid")
    np.testing.assert_allclose(recurrence, 0.0, atol=1e-10 * np.abs(x).max())
    assert np.abs(roots).max() <= 1.0 + 1e-12
    # a triple eigenvalue: the third root of 1 / turn^2 still separates its parts
    assert np.abs(amplification(rule, 2e5)).max() == pytest.approx(radius, abs=1e-3)


def amplification(rule, turn):
    """Eigenvalues of the equations of Chung and Hulbert (1993), solved for (q, h v, h^2 a)_1 directly."""
    end = np.array(
        [
            [1.0, 0.0, -rule.beta],
            [0.0, 1.0, -rule.gamma],
            [(1.0 - rule.force) * turn**2, 0.0, 1.0 - rule.mass],
        ]
    )
    begin = np.array(
        [[1.0, 1.0, 0.5 - rule.beta], [0.0, 1.0, 1.0 - rule.gamma], [-rule.force * turn**2, 0.0, -rule.mass]]
    )
    return np.linalg.eigvals(np.linalg.solve(end, begin))


def test_modal_steps_are_exact_without_excess_forces(geared_chain):
    """Free motion of a linear system with meshes, one long step against the matrix exponential."""
    stiffness = np.array([1.0, 1.4])
    C = modal_damping(geared_chain, stiffness, 0.07)
    system = MechanicalSystem(geared_chain.M, C, geared_chain.K, geared_chain.W, np.zeros(4), geared_chain.dofs)
    problem = NonlinearSystem(system, (GearMeshes([0, 1], constant(stiffness), separates=False),))
    q, v = np.array([1.0, -0.5, 0.3, 0.2]), np.array([0.1, 0.4, -0.2, 0.0])
    found = solve_transient(problem, 1.0, [0.0, 3.0, 6.0], start=(q, v), method="modal", step=3.0)
    K = system.K + (system.W * stiffness) @ system.W.T
    matrix = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(system.M, np.hstack([K, C]))]])
    exact = monodromy(matrix[None], [6.0]) @ np.concatenate([q, v])
    np.testing.assert_allclose(found.displacement[-1], exact[:4], atol=1e-12)
    np.testing.assert_allclose(found.velocity[-1], exact[4:], atol=1e-12)


def test_modes_left_out_count_as_static_flexibility(geared_chain):
    """Slow loads: three modes and the static rest against all four."""
    C = modal_damping(geared_chain, [1.0, 1.4], 0.1)
    system = MechanicalSystem(geared_chain.M, C, geared_chain.K, geared_chain.W, geared_chain.load, ())
    meshes = GearMeshes([0, 1], FourierSeries([[1.0, 0.05], [1.4, 0.04j]]), separates=False)
    problem = NonlinearSystem(system, (meshes,), (HarmonicForce(np.array([0.3, 0, 0, 0.1j])),))
    times = np.linspace(0.0, 400.0, 5)
    full, part = (solve_transient(problem, 0.05, times, method="modal", step=0.1, count=c) for c in (4, 3))
    size = np.abs(full.deflection).max()
    np.testing.assert_allclose(part.deflection[2:], full.deflection[2:], atol=2e-3 * size)
    np.testing.assert_allclose(part.displacement[2:], full.displacement[2:], atol=2e-3 * size)


@pytest.mark.slow
@pytest.mark.parametrize("method", [FIXED[0], FIXED[4], "modal"])
def test_planet_set_with_backlash_approaches_contact_events_by_the_square_of_the_step(geared_set, method):
    times = np.linspace(0.0, 4.0 * np.pi, 81)
    # the sun turns backwards at first, so that the drive flanks part
    start = np.zeros(15), np.where(np.arange(15) == 2, -0.6, 0.0)
    exact = solve_transient(geared_set, 1.0, times, start=start, method="DOP853", events=True, tolerance=1e-11)
    assert (exact.force[1:] == 0.0).sum() > 20 and (exact.force > 0.0).any()
    errors = []
    for count in (400, 1600):
        step = 2.0 * np.pi / count
        found = solve_transient(geared_set, 1.0, times, start=start, method=method, step=step)
        assert found.converged and found.residual < 1e-9
        force, _ = element_forces(geared_set, found.deflection, times[:, None])
        np.testing.assert_allclose(found.force, force, atol=1e-14)
        errors.append(np.abs(found.displacement - exact.displacement).max() / np.abs(exact.displacement).max())
    assert np.log2(errors[0] / errors[1]) / 2.0 == pytest.approx(2.0, abs=0.25)
    assert errors[1] < 1e-4


@pytest.mark.parametrize("amplitude", [2.0, 1.5, 5.0])
def test_free_vibration_over_a_dead_zone_with_contact_events(amplitude):
    """T = 2 pi + 4 b / (A - b): half turns in contact, straight flight between."""
    spring = PiecewiseSprings([0], [-1.0, 1.0], [1.0, 0.0, 1.0])
    period = 2.0 * np.pi + 4.0 / (amplitude - 1.0)
    times = period * np.arange(6)
    found = solve_transient(
        oscillator(elements=[spring]),
        0.0,
        times,
        start=([amplitude], [0.0]),
        method="DOP853",
        events=True,
        tolerance=1e-13,
    )
    np.testing.assert_allclose(found.displacement[:, 0], amplitude, atol=1e-10)
    np.testing.assert_allclose(found.velocity, 0.0, atol=1e-9)


def test_breaks_of_step_series_are_met():
    """Rectangular stiffness: one period against the product of matrix exponentials."""
    meshes = GearMeshes([0], StepSeries([[1.0, 0.65]], [0.0, 0.635]), separates=False)
    problem, omega = oscillator(c=0.04, elements=[meshes]), 1.3
    period = 2.0 * np.pi / omega
    parts = np.array([[[0.0, 1.0], [-k, -0.04]] for k in (1.0, 0.65)])
    exact = monodromy(parts, period * np.array([0.635, 0.365])) @ [1.0, 0.2]
    found = solve_transient(
        problem, omega, [0.0, period], start=([1.0], [0.2]), method="DOP853", events=True, tolerance=1e-12
    )
    assert [found.displacement[-1, 0], found.velocity[-1, 0]] == pytest.approx(exact, abs=1e-10)


def test_tabulated_laws_are_the_elements():
    rng = np.random.default_rng(3)
    k = FourierSeries(np.array([[2.0, 0.3 + 0.1j], [1.5, -0.2j]]))
    offset = FourierSeries(np.array([[0.2, 0.1], [0.1, 0.3j]]))
    options = {"deflection": offset, "force": constant([0.1, 0.2])}
    cases = [
        (GearMeshes([0, 1], k, **options), GearMeshes([1, 2], k, backlash=0.3, **options)),
        (GearMeshes([0, 1], k, backlash=[0.4, 0.6], smoothing=0.05, **options),),
        (
            GearMeshes([2, 1], k, separates=False, **options),
            PolynomialSprings([0, 0], [[1, 2, 3], [0, 1, 0]]),
        ),
        (PiecewiseSprings([1], [-0.2, 0.5], [1.0, 0.0, 2.0]), BearingSprings([[0, 2]], 3.0, 0.4, springs=7)),
    ]
    theta = rng.uniform(0.0, 9.0, (6, 1))
    system = MechanicalSystem(np.eye(3), np.zeros((3, 3)), np.zeros((3, 3)), np.eye(3), np.zeros(3), ())
    for elements in cases:
        problem = NonlinearSystem(system, elements)
        law = tabulated_law(problem, theta)
        for i, phase in enumerate(theta):
            x = rng.normal(0.0, 0.6, 3)
            force, tangent = element_forces(problem, x, phase)
            excess, slope = law(i, x)
            slope = np.diag(slope) if slope.ndim == 1 else slope
            np.testing.assert_allclose(excess, force - problem.reference * x, atol=1e-13)
            np.testing.assert_allclose(slope, tangent - np.diag(problem.reference), atol=1e-13)


@pytest.mark.slow
def test_a_bearing_with_clearance_against_adaptive_integration():
    """A rotating force in a ring of springs: coupled columns, contact events in the reference."""
    system = MechanicalSystem(
        np.eye(2), 0.2 * np.eye(2), np.zeros((2, 2)), np.eye(2), np.array([0.0, -0.3]), ("x", "y")
    )
    ring = BearingSprings([[0, 1]], 4.0, 0.1, springs=9)
    problem = NonlinearSystem(system, (ring,), (HarmonicForce(np.array([0.4, -0.4j])),))
    times = np.linspace(0.0, 20.0, 4)
    exact = solve_transient(problem, 0.9, times, method="DOP853", events=True, tolerance=1e-11)
    found = solve_transient(problem, 0.9, times, step=0.005)
    np.testing.assert_allclose(found.displacement, exact.displacement, atol=2e-5)


def test_coarse_steps_say_so_and_instants_between_steps_are_interpolated():
    problem = oscillator(k=1.0)
    times = np.linspace(0.0, 20.0, 77)
    found = solve_transient(problem, 0.0, times, start=([1.0], [0.0]), step=0.05)
    assert "every step" in found.message
    assert np.abs(found.displacement[:, 0] - np.cos(times)).max() < 20.0 * 0.05**2 / 12.0 * 1.05
    assert np.abs(found.velocity[:, 0] + np.sin(times)).max() < 20.0 * 0.05**2 / 12.0 * 1.05
    coarse = solve_transient(problem, 0.0, times, start=([1.0], [0.0]), step=0.7)
    assert "coarse" in coarse.message and coarse.error > 100.0 * found.error


def test_bad_input_is_refused():
    problem = oscillator(k=1.0)
    for options, code in (
        ({"method": "euler"}, "E-CHOICE"),
        ({"events": True}, "E-CHOICE"),
        ({"start": ([1.0, 2.0], [0.0])}, "E-START"),
        ({"step": -1.0}, "E-RANGE"),
        ({"method": "newmark", "gamma": 0.4}, "E-RANGE"),
        ({"method": "generalised alpha", "radius": 1.2}, "E-RANGE"),
    ):
        with pytest.raises(CaseError) as error:
            solve_transient(problem, 1.0, [0.0, 1.0], **options)
        assert error.value.code == code
    with pytest.raises(CaseError, match="E-RANGE"):
        solve_transient(problem, 1.0, [0.0, 0.0])
    for method in ("average acceleration", "DOP853"):
        with pytest.raises(ConvergenceError, match="E-MASS"):
            solve_transient(oscillator(-1.0, 0.0, 1.0), 1.0, [0.0, 1.0], step=0.1, method=method)


def test_highest_frequency_is_that_of_masses_between_springs():
    """Two masses m on springs k with k_m between them against each other: (k + 2 k_m) / m."""
    system = MechanicalSystem(
        0.7 * np.eye(2), np.zeros((2, 2)), 3.0 * np.eye(2), np.array([[1.0], [-1.0]]), np.zeros(2), ("a", "b")
    )
    problem = NonlinearSystem(system, ())
    assert highest_frequency(problem, np.array([5.0])) == pytest.approx(np.sqrt(13.0 / 0.7), rel=1e-13)
    assert highest_frequency(problem, np.array([0.0])) == pytest.approx(np.sqrt(3.0 / 0.7), rel=1e-13)
    # softer than free: nothing vibrates
    assert highest_frequency(oscillator(k=-1.0), np.zeros(1)) == 0.0


@pytest.mark.filterwarnings("ignore:Diagonal number 1 is exactly zero")
def test_a_singular_matrix_of_the_step_is_refused():
    """A negative spring as large as the inertia of a step: 1 - 400 (0.1)^2 / 4 = 0."""
    with pytest.raises(ConvergenceError, match="matrix of the time step is singular") as refused:
        solve_transient(oscillator(k=-400.0), 1.0, [0.0, 1.0], step=0.1, method="average acceleration")
    assert refused.value.code == "E-MASS"


def test_a_step_that_does_not_converge_ends_the_motion_with_a_message():
    """A spring that pulls ever harder outwards leaves no solution at the end of a long step."""
    spring = PolynomialSprings([0], [[0.0, -1.0]])
    found = solve_transient(oscillator(elements=[spring]), 0.0, [0.0, 1.0, 50.0], start=([1.0], [0.0]), step=0.5)
    assert not found.converged and "shorten" in found.message
    assert np.isnan(found.displacement[-1]).all() and np.isfinite(found.displacement[1]).all()


def test_newton_iterations_of_all_blocks_are_counted():
    """A hardening spring: about one for each of the steps of many blocks."""
    system = MechanicalSystem(np.eye(1), 0.1 * np.eye(1), np.eye(1), np.eye(1), np.zeros(1), ("x",))
    problem = NonlinearSystem(system, (PolynomialSprings([0], [[0.0, 0.0, 1.0]]),), (HarmonicForce([0.5]),))
    found = solve_transient(problem, 1.0, [0.0, 20.0], step=0.01)
    assert found.converged and 0.5 * found.steps < found.iterations < 10 * found.steps
