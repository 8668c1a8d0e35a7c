"""The rule of a step and the equations of its columns, each by itself."""

from dataclasses import replace

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
    assert stability_limit(replace(rule, beta=least)) == np.inf
    assert np.isnan(stability_limit(replace(rule, beta=least - 1e-6)))


def test_newton_steps_are_halved_until_the_columns_fit_better():
    """``x + 100 max(x, 0) = 0.1`` from 0, tried at 1: 1/512 is the first half that leaves less than 0.1."""
    aim, nothing = np.array([0.1]), np.zeros(1)

    def law(i, x):
        return 100.0 * np.maximum(x, 0.0), 100.0 * (x > 0.0)

    x, g, slope = steps._shortened(law, 0, np.eye(1), aim, np.ones(1), nothing, 0.1**2)
    assert (x.tolist(), g.tolist(), slope.tolist()) == ([1.0 / 512.0], [100.0 / 512.0], [100.0])


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
