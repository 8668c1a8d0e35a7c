"""Exact steps for piecewise linear forces: closed forms, matrix exponentials, and the three routes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femgear.errors import CaseError
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.time.steps import step_matrices
from femgear.system.system import MechanicalSystem
from validation.reference.force_history import modal_history, solve_force_history, state_history

NATURAL = np.array([0.0, 0.4, 3.0, 3.0, 3.0, 40.0])
RATIO = np.array([0.0, 0.05, 0.2, 1.0, 1.7, 0.01])


def nigam_jennings(w, z, h):
    """Coefficients of the displacement in Chopra, Dynamics of Structures, Table 5.2.1 (unit mass)."""
    wd, k, r = w * np.sqrt(1 - z * z), w * w, z / np.sqrt(1 - z * z)
    e, s, c = np.exp(-z * w * h), np.sin(wd * h), np.cos(wd * h)
    a, b = e * (r * s + c), e * s / wd
    middle = ((1 - 2 * z * z) / (wd * h) - r) * s
    start = (2 * z / (w * h) + e * (middle - (1 + 2 * z / (w * h)) * c)) / k
    end = (1 - 2 * z / (w * h) + e * ((2 * z * z - 1) / (wd * h) * s + 2 * z / (w * h) * c)) / k
    return a, b, start, end


def chain(damping=None):
    n = 8
    M = np.diag(np.linspace(1.0, 2.0, n))
    K = 40.0 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[-1, -1] = 40.0
    C = np.zeros((n, n)) if damping is None else damping
    return MechanicalSystem(M, C, K, np.eye(n)[:, :1], np.linspace(0.0, 0.3, n), ())


@pytest.fixture
def history():
    rng = np.random.default_rng(5)
    return 0.05 * np.arange(301), rng.normal(size=(301, 8))


def test_coefficients_of_nigam_and_jennings():
    h = 0.3
    transition, start, end = step_matrices(NATURAL[[1, 2, 5]], RATIO[[1, 2, 5]], h)
    a, b, first, last = nigam_jennings(NATURAL[[1, 2, 5]], RATIO[[1, 2, 5]], h)
    np.testing.assert_allclose(transition[:, 0], np.stack([a, b], axis=1), atol=1e-13)
    np.testing.assert_allclose(start[:, 0], first, atol=1e-14, rtol=1e-11)
    np.testing.assert_allclose(end[:, 0], last, atol=1e-14, rtol=1e-11)


def test_rigid_and_critical_modes_have_their_closed_forms():
    """Rigid: a cubic in time under a ramp. Critical: (1 + w t) exp(-w t)."""
    t, step = 0.25 * np.arange(41), 0.25
    force = np.zeros((41, 2))
    force[:, 0] = 2.0 + 3.0 * t
    y, v = modal_history([0.0, 3.0], [0.0, 1.0], step, force, start=(np.array([1.0, 1.0]), np.array([0.5, 0.0])))
    np.testing.assert_allclose(y[:, 0], 1.0 + 0.5 * t + t**2 + 0.5 * t**3, rtol=1e-13)
    np.testing.assert_allclose(v[:, 0], 0.5 + 2.0 * t + 1.5 * t**2, rtol=1e-13)
    np.testing.assert_allclose(y[:, 1], (1.0 + 3.0 * t) * np.exp(-3.0 * t), atol=1e-14)


def test_modes_of_all_kinds_against_matrix_exponentials_of_the_whole():
    """Random forces: every mode against the state matrix of all modes together, 400 steps."""
    rng = np.random.default_rng(1)
    force, start = rng.normal(size=(401, 6)), rng.normal(size=(2, 6))
    y, v = modal_history(NATURAL, RATIO, 0.1, force, start=start)
    one = np.eye(6)
    q, u = state_history(one, np.diag(2 * RATIO * NATURAL), np.diag(NATURAL**2), 0.1, force, start=start)
    np.testing.assert_allclose(y, q, atol=1e-12 * np.abs(q).max())
    np.testing.assert_allclose(v, u, atol=1e-12 * np.abs(u).max())


def test_piecewise_linear_forces_against_an_integrator():
    """Between instants the force is linear: DOP853 from instant to instant finds the same motion."""
    rng = np.random.default_rng(2)
    force, y = rng.normal(size=12), np.array([0.3, -0.2])
    found, _ = modal_history([2.0], [0.1], 0.4, force[:, None], start=(y[:1], y[1:]))
    for i in range(11):

        def motion(t, y, i=i):
            p = force[i] + (force[i + 1] - force[i]) * t / 0.4
            return [y[1], p - 0.4 * y[1] - 4.0 * y[0]]

        y = solve_ivp(motion, (0.0, 0.4), y, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        assert found[i + 1, 0] == pytest.approx(y[0], abs=1e-12)


def test_full_and_modal_routes_agree_to_rounding(history):
    system = chain()
    full, modal = (
        solve_force_history(system, *history, route=route, damping_ratio=0.04, mesh_stiffness=[7.0])
        for route in ("full", "modal")
    )
    size = np.abs(full.displacement).max()
    np.testing.assert_allclose(modal.displacement, full.displacement, atol=1e-12 * size)
    np.testing.assert_allclose(modal.velocity, full.velocity, atol=1e-11 * np.abs(full.velocity).max())
    np.testing.assert_allclose(modal.deflection[:, 0], full.displacement[:, 0], atol=1e-12 * size)


def test_routes_approach_the_full_one_with_their_unknowns(history):
    """A smooth load: errors fall with modes and with masters, and all masters or modes are exact."""
    t, _ = history
    force = np.outer(np.sin(1.3 * t) * t / (1.0 + t), np.linspace(0.2, 1.0, 8))
    system = chain(modal_damping(chain(), [0.0], 0.02))
    full = solve_force_history(system, t, force, route="full")
    for route in ("modal", "guyan"):
        errors = []
        for count in (2, 4, 6, 8):
            found = solve_force_history(system, t, force, route=route, count=count)
            assert found.unknowns == count
            errors.append(np.abs(found.displacement - full.displacement).max())
        errors = np.array(errors) / np.abs(full.displacement).max()
        assert np.all(np.diff(errors) < 0.0) and errors[1] < 0.03 and errors[-1] < 1e-11


def test_static_answer_of_the_modes_left_out():
    """After long damping a constant load gives the static deflection with a single mode too."""
    system = chain(modal_damping(chain(), [0.0], 0.5))
    t = np.linspace(0.0, 300.0, 301)
    found = solve_force_history(system, t, np.zeros((301, 8)), route="modal", count=1)
    np.testing.assert_allclose(found.displacement[-1], np.linalg.solve(system.K, system.load), rtol=1e-10)


def test_a_rigid_body_may_be_driven():
    """Two equal masses with a spring, pushed together: the centre of mass accelerates by F / 2."""
    K = np.array([[5.0, -5.0], [-5.0, 5.0]])
    system = MechanicalSystem(np.eye(2), np.zeros((2, 2)), K, np.eye(2)[:, :1], np.zeros(2), ())
    t = np.linspace(0.0, 4.0, 41)
    force = np.tile([1.0, 0.0], (41, 1))
    for route in ("modal", "full"):
        found = solve_force_history(system, t, force, route=route)
        np.testing.assert_allclose(found.displacement.mean(axis=1), 0.25 * t**2, atol=1e-12)
        gap = found.displacement[:, 0] - found.displacement[:, 1]
        np.testing.assert_allclose(gap, (1.0 - np.cos(np.sqrt(10.0) * t)) / 10.0, atol=1e-12)


def test_damping_that_couples_the_modes_needs_the_full_route(history):
    C = np.zeros((8, 8))
    C[2, 2] = 3.0
    system = chain(C)
    with pytest.raises(CaseError, match="E-DAMPING"):
        solve_force_history(system, *history, route="modal")
    found = solve_force_history(system, *history, route="full")
    assert np.isfinite(found.displacement).all()
    assert undamped_modes(chain(), [0.0]).frequency.shape == (8,)


def test_bad_input_is_refused(history):
    t, force = history
    for arguments, options, code in (
        ((t**1.01, force), {}, "E-RANGE"),
        ((t, force[:-1]), {}, "E-SHAPE"),
        ((t, force), {"route": "fast"}, "E-CHOICE"),
        ((t, force), {"route": "guyan", "masters": [0, 9]}, "E-MASTERS"),
    ):
        with pytest.raises(CaseError) as error:
            solve_force_history(chain(), *arguments, **options)
        assert error.value.code == code
