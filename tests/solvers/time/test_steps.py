"""The rule of a step and the equations of its columns, each by itself."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.time import steps, transient
from femgear.solvers.time.steps import generalised_alpha, stability_limit
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem, tabulated_law


@pytest.mark.parametrize("radius", [0.0, 0.4, 0.8, 1.0])
def test_a_generalised_alpha_rule_is_stable_down_to_its_smallest_beta(radius):
    """Chung and Hulbert (1993), Eq. 15: a_m <= a_f <= 1/2 and beta >= 1/4 + (a_f - a_m)/2."""
    rule = generalised_alpha(radius)
    assert stability_limit(rule) == np.inf
    least = 0.25 + 0.5 * (rule.force - rule.mass)
    assert rule.mass <= rule.force <= 0.5 and rule.beta >= least - 1e-12


def test_newton_steps_are_halved_until_the_columns_fit_better():
    """``x + 100 max(x, 0) = 0.1`` from 0, tried at 1: 1/512 is the first half that leaves less than 0.1."""
    aim, nothing = np.array([0.1]), np.zeros(1)

    def law(i, x):
        return 100.0 * np.maximum(x, 0.0), 100.0 * (x > 0.0)

    x, g, slope = steps._shortened(law, 0, np.eye(1), aim, np.ones(1), nothing, 0.1**2)
    assert (x.tolist(), g.tolist(), slope.tolist()) == ([1.0 / 512.0], [100.0 / 512.0], [100.0])


def test_columns_whose_newton_steps_are_halved_end_in_balance():
    """``x + 5 tanh(20 x) = 1``: the first step, from where the law is flat, goes far beyond."""
    aim, flexibility = np.ones(1), np.array([[5.0]])

    def law(i, x):
        return np.tanh(20.0 * x), 20.0 / np.cosh(20.0 * x) ** 2

    g, missed, _, count = steps._solve_columns(law, 0, flexibility, np.eye(1), aim, np.zeros(1), 1.0, (1e-24, 40))
    assert missed <= 1e-24 and count < 40
    assert np.tanh(20.0 * (aim - flexibility @ g)) == pytest.approx(g, rel=1e-9)


@pytest.mark.parametrize("accelerations", [True, False])
def test_motion_between_steps_is_a_cubic(accelerations):
    """Exact for q = t^3 - 2 t; without accelerations the velocity runs straight from step to step."""
    step, t = 0.5, 0.5 * np.arange(5.0)[:, None]
    q, v, a = t**3 - 2.0 * t, 3.0 * t**2 - 2.0, 6.0 * t
    at = np.array([0.0, 0.3, 1.0, 2.7, 3.999, 4.0])
    found, rate = transient._between(at, (q, v, a if accelerations else None), step)
    assert found[:, 0] == pytest.approx((at * step) ** 3 - 2.0 * at * step, abs=1e-13)
    wanted = 3.0 * (at * step) ** 2 - 2.0 if accelerations else np.interp(at * step, t[:, 0], v[:, 0])
    assert rate[:, 0] == pytest.approx(wanted, abs=1e-13)


def test_instants_count_from_the_first_one():
    """Of x'' + x = cos 0.7 t, at rest at t = 2 and not at zero."""
    one = np.eye(1)
    system = MechanicalSystem(one, 0.0 * one, one, one, np.zeros(1), ("x",))
    problem = NonlinearSystem(system, (), (HarmonicForce([1.0]),))
    times = np.array([2.0, 2.5, 3.75, 6.0])
    found = solve_transient(problem, 0.7, times, start=([0.0], [0.0]), step=0.005)
    a, b = np.cos(1.4), -0.7 * np.sin(1.4)
    exact = (np.cos(0.7 * times) - a * np.cos(times - 2.0) - b * np.sin(times - 2.0)) / 0.51
    assert found.displacement[:, 0] == pytest.approx(exact, abs=3e-5)
    assert found.steps == 800


def test_size_of_a_marched_motion_is_its_distance_from_the_mean():
    """About 4 and -1, with masses 4 and 9; what is not finite does not count."""
    system = MechanicalSystem(np.diag([4.0, 9.0]), np.eye(2), np.eye(2), np.eye(2), np.zeros(2), ("x", "y"))
    q = np.array([[3.0, -1.0], [5.0, -1.0], [4.0, -2.0], [4.0, 0.0], [np.nan, 7.0]])
    assert transient._amplitude(NonlinearSystem(system, ()), q) == pytest.approx(3.0)
    assert transient._amplitude(NonlinearSystem(system, ()), q[4:]) == 0.0


@pytest.mark.parametrize("name", ["gamma", "beta", "mass", "force"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_every_number_of_a_rule_is_finite(name, value):
    numbers = {"gamma": 0.5, "beta": 0.25, "mass": 0.0, "force": 0.0}
    with pytest.raises(CaseError, match="finite numbers"):
        steps.StepRule(**numbers | {name: value})


def test_a_step_takes_some_of_what_is_at_its_end():
    """Weights of the start below one, of the inertia as of the other forces."""
    for name in ("mass", "force"):
        assert getattr(steps.StepRule(1.5, 0.25, **{name: 0.999}), name) == 0.999
        for weight in (1.0, 1.5):
            with pytest.raises(CaseError, match="weights below 1"):
                steps.StepRule(2.5, 0.25, **{name: weight})


def test_residual_of_a_march_is_that_of_its_worst_step():
    """Of ``q'' + q + q^3 = load`` with columns solved to a tenth: x follows from its force ``g = x^3``."""
    one = np.eye(1)
    system = MechanicalSystem(one, 0.0 * one, one, one, np.zeros(1), ("x",))
    element = PolynomialSprings([0], [[0.0, 0.0, 1.0]])
    problem = NonlinearSystem(system, (element,), (HarmonicForce([2.0]),))
    scheme, count = transient.step_scheme(problem, [1.0], "average acceleration", 6.0, 0.5)
    theta = 0.5 * np.arange(count + 1.0)[:, None]
    law = tabulated_law(problem, theta)
    state, g = scheme.start(np.array([2.0]), np.zeros(1), theta[:1], law)
    table = scheme.table(theta)
    block = steps.march(scheme, law, table, state, g, count, tolerance=0.1, max_iterations=20)
    size, shares = 0.0, []
    for i in range(count):
        free = scheme.free(block.states[i], block.excess[i], table[i])
        aim = scheme.deflection(free, table[i])
        x = np.cbrt(block.excess[i + 1])
        size = max(size, float(aim @ aim), float(x @ x))
        shares.append(np.linalg.norm(aim - x - scheme.flexibility @ block.excess[i + 1]) / np.sqrt(size))
    assert block.steps == count == 12 and block.residual == pytest.approx(max(shares), rel=1e-9)
    assert 10.0 * min(shares) < max(shares) < 0.1


def test_stiffest_phase_of_a_column_is_looked_for_all_around():
    """Meshes ``2 + cos(theta - phase)`` are 3 at most, two on one column 6, at any phase of the grid."""
    phases = 2.0 * np.pi * np.array([1, 63, 120, 127, 201]) / transient._PHASES
    series = FourierSeries(np.column_stack([np.full(5, 2.0), np.exp(-1j * phases)]))
    system = MechanicalSystem(np.eye(5), np.zeros((5, 5)), np.eye(5), np.eye(5), np.zeros(5), tuple("abcde"))
    meshes = GearMeshes(np.arange(5), series)
    problem = NonlinearSystem(system, (meshes, meshes))
    assert transient._column_stiffness(problem, [7.0]) == pytest.approx(6.0, rel=1e-12)


def test_named_rules_lose_nothing_up_to_their_limits_and_grow_beyond():
    """Eigenvalues of one step of ``q'' + q = 0``; Hughes (2000), table 9.1.1: 2 sqrt 3, sqrt 6 and 2 rad."""
    one = np.eye(1)
    problem = NonlinearSystem(MechanicalSystem(one, 0.0 * one, one, one, np.zeros(1), ("x",)), ())

    def radius(rule, step):
        scheme = steps.RuleScheme(problem, rule, step)
        starts = (np.array([[1.0], [0.0], [-1.0]]), np.array([[0.0], [1.0], [0.0]]))
        ends = [scheme.free(start, np.zeros(1), 0.0)[:2, 0] for start in starts]
        return np.abs(np.linalg.eigvals(np.column_stack(ends))).max()

    limits = {"linear acceleration": 12.0**0.5, "Fox-Goodwin": 6.0**0.5, "central difference": 2.0}
    for name, limit in limits.items():
        rule = steps.RULES[name]
        assert 2.0 * np.pi * stability_limit(rule) == pytest.approx(limit, rel=1e-12)
        for share in (0.1, 0.5, 0.99):
            assert radius(rule, share * limit) == pytest.approx(1.0, rel=1e-12)
        assert radius(rule, 1.01 * limit) > 1.1
    assert stability_limit(steps.RULES["average acceleration"]) == np.inf
    for step in (0.1, 3.0, 100.0):
        assert radius(steps.AVERAGE_ACCELERATION, step) == pytest.approx(1.0, rel=1e-12)


def test_a_steady_vibration_goes_on_with_the_phase_of_its_force():
    """Of ``q'' + 0.3 q' + 4 q = Re (1 - 2i) exp 1.3 i t``, begun on its steady state."""
    one = np.eye(1)
    system = MechanicalSystem(one, 0.3 * one, 4.0 * one, one, np.zeros(1), ("x",))
    problem = NonlinearSystem(system, (), (HarmonicForce([1.0 - 2.0j]),))
    line = (1.0 - 2.0j) / (4.0 - 1.3**2 + 0.39j)
    times = np.linspace(0.0, 5.0, 11)
    wave = line * np.exp(1.3j * times)
    start = ([line.real], [(1.3j * line).real])
    for method in ("average acceleration", "generalised alpha"):
        found = solve_transient(problem, 1.3, times, start=start, step=0.02, method=method)
        assert found.displacement[:, 0] == pytest.approx(wave.real, abs=5e-4)
        assert found.velocity[:, 0] == pytest.approx((1.3j * wave).real, abs=5e-4)


def test_error_of_a_step_is_bounded_where_the_acceleration_bends():
    """Of ``q = t^4 / 12``, by the rule from exact accelerations: at most half too large."""
    step, t = 0.1, 0.1 * np.arange(9.0)
    q, v, a = t**4 / 12.0, t**3 / 3.0, t**2
    system = MechanicalSystem(4.0 * np.eye(1), np.eye(1), np.eye(1), np.eye(1), np.zeros(1), ("x",))
    for name in ("average acceleration", "central difference"):
        rule = steps.RULES[name]
        scheme = steps.RuleScheme(NonlinearSystem(system, ()), rule, step)
        states = np.stack([q, v, a], axis=1)[:, :, None]
        stepped = q[:-1] + step * v[:-1] + step**2 * ((0.5 - rule.beta) * a[:-1] + rule.beta * a[1:])
        # the size of an error is the root of e M e
        exact = 2.0 * np.abs(stepped - q[1:])
        found = scheme.local_error(states, np.zeros((9, 1)))
        assert np.all(found[1:] > exact[1:]) and np.all(found[1:] < 1.6 * exact[1:])
