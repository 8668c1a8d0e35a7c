"""Products with the derivative of the harmonic equations against the matrix, and solutions by either."""

import numpy as np
import pytest

from femgear.solvers.periodic import equations
from femgear.solvers.periodic import harmonic_balance as solvers_periodic_harmonic_balance
from femgear.solvers.periodic.equations import harmonic_balance
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.system.force_laws import GearMeshes, PolynomialSprings, RadialBearings
from femgear.system.fourier import FourierSeries, side_bands
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem


def two_masses(load=1.0):
    """A mesh with k(t) that may separate, and a clearance bearing that couples two columns."""
    stiffness = FourierSeries([[1.0, 0.3]], (0, 1))
    mesh = GearMeshes([0], stiffness, backlash=0.5)
    bearing = RadialBearings([[1, 2]], 2.0, 0.1)
    W = np.array([[1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    system = MechanicalSystem(
        np.eye(3), 0.1 * np.eye(3), 0.3 * np.eye(3), W, np.array([load, -load, 0.2]), ("x", "y", "z")
    )
    return NonlinearSystem(system, (mesh, bearing), (HarmonicForce([0.4, 0.0, 0.3], (1, 0)),))


@pytest.fixture
def balance():
    return harmonic_balance(two_masses(), orders=side_bands(4, 3, 2))


def test_products_are_those_of_the_matrix(balance):
    y, receptance = balance.linear_start([0.21, 1.3]), balance.receptance([0.21, 1.3])[0]
    error, tangent = equations.linearised(balance, receptance, y)
    residual, matrix, _ = balance.evaluate(y, [0.21, 1.3])
    np.testing.assert_allclose(error, residual, atol=1e-13 * abs(residual).max())
    change = np.random.default_rng(1).standard_normal(balance.size)
    moved = matrix @ change
    np.testing.assert_allclose(change + tangent.fixed_point(change), moved, atol=1e-12 * abs(moved).max())
    step = tangent.solve(moved)
    assert np.linalg.norm(matrix @ step - moved) <= 1.01e-3 * np.linalg.norm(moved)


def test_radius_is_that_of_the_matrix(balance):
    y, receptance = balance.linear_start([0.21, 1.3]), balance.receptance([0.21, 1.3])[0]
    tangent = equations.linearised(balance, receptance, y)[1]
    matrix = balance.evaluate(y, [0.21, 1.3])[1] - np.eye(balance.size)
    assert equations.krylov_radius(tangent) == pytest.approx(abs(np.linalg.eigvals(matrix)).max(), rel=0.01)


@pytest.mark.parametrize("load", [1.0, 0.05])
def test_either_way_gives_the_same_solution(load, monkeypatch):
    """With the small load the mesh separates and meets its other side."""
    orders, problem = side_bands(4, 3, 2), two_masses(load)
    direct = solve_harmonic_balance(problem, [0.21, 1.3], orders=orders)
    monkeypatch.setattr(solvers_periodic_harmonic_balance, "MANY", 0)
    products = solve_harmonic_balance(problem, [0.21, 1.3], orders=orders)
    assert direct.converged and products.converged
    np.testing.assert_allclose(products.deflection, direct.deflection, atol=1e-9 * abs(direct.deflection).max())


def test_the_matrix_helps_where_products_do_not_suffice(balance, monkeypatch):
    y, receptance = balance.linear_start([0.21, 1.3]), balance.receptance([0.21, 1.3])[0]
    error, tangent = equations.linearised(balance, receptance, y)
    monkeypatch.setattr(equations, "_PRODUCTS", 2)
    assert tangent.solve(error) is None
    step = solvers_periodic_harmonic_balance._newton_step(balance, receptance, y, error, tangent)
    np.testing.assert_allclose(balance.evaluate(y, [0.21, 1.3])[1] @ step, error, atol=1e-12)


def test_a_matrix_is_made_of_six_hundred_unknowns_at_most(monkeypatch):
    one = np.eye(1)
    system = MechanicalSystem(one, 0.1 * one, one, one, np.zeros(1), ("x",))
    element = PolynomialSprings([0], [[0.0, 0.0, 0.2]])
    problem = NonlinearSystem(system, (element,), (HarmonicForce([0.4]),))
    made, jacobian = [], equations.HarmonicBalance.jacobian
    monkeypatch.setattr(
        equations.HarmonicBalance, "jacobian", lambda self, *rest: made.append(1) or jacobian(self, *rest)
    )
    # one mean, a real and an imaginary part of every harmonic
    for harmonics, by_matrix in ((299, True), (300, False)):
        made.clear()
        assert solve_harmonic_balance(problem, 2.0, harmonics=harmonics, stability=False).converged
        assert bool(made) is by_matrix
