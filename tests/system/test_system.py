from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.system.force_laws import GearMeshes, PolynomialSprings, RadialBearings
from femgear.system.fourier import FourierSeries
from femgear.system.system import (
    HarmonicForce,
    MechanicalSystem,
    NonlinearSystem,
    drift_note,
    element_forces,
    external_force,
)


def problem_of(system, **changes):
    meshes = GearMeshes([0, 1], FourierSeries([[1.0, 0.2], [1.4, 0.1]], (0, 1)), backlash=0.5)
    cubic = PolynomialSprings([1, 1], [[0.5, 0.0, 0.3], [0.2, 0.1, 0.0]])
    return NonlinearSystem(system, (meshes, cubic), **changes)


def test_elements_on_shared_columns_add(geared_chain):
    problem = problem_of(geared_chain)
    x, theta = np.array([[0.3, -0.2], [-0.9, 0.4]]), np.array([[0.1, 0.7], [2.0, 3.0]])
    force, tangent = element_forces(problem, x, theta)
    k = np.array([1.0 + 0.2 * np.cos([0.7, 3.0]), 1.4 + 0.1 * np.cos([0.7, 3.0])]).T
    mesh = np.where(x > 0.0, k * x, np.where(x < -0.5, k * (x + 0.5), 0.0))
    extra = 0.7 * x[:, 1] + 0.1 * x[:, 1] ** 2 + 0.3 * x[:, 1] ** 3
    np.testing.assert_allclose(force, mesh + np.stack([0.0 * extra, extra], axis=1), atol=1e-14)
    slope = k * ((x > 0.0) | (x < -0.5))
    slope[:, 1] += 0.7 + 0.2 * x[:, 1] + 0.9 * x[:, 1] ** 2
    np.testing.assert_allclose(tangent, slope[:, :, None] * np.eye(2), atol=1e-14)
    np.testing.assert_allclose(problem.reference, [1.0, 1.4 + 0.7])


def test_coupled_columns_fill_their_block(geared_chain):
    bearing = RadialBearings([[1, 0]], 2.0, clearance=0.1)
    x = np.array([0.3, -0.4])
    force, tangent = element_forces(NonlinearSystem(geared_chain, (bearing,)), x, np.zeros(1))
    own, block = bearing.evaluate(x[None, ::-1], np.zeros(1))
    np.testing.assert_allclose(force, own[0, ::-1])
    np.testing.assert_allclose(tangent, block[0, ::-1, ::-1])
    assert abs(tangent[0, 1]) > 0.1


def test_bases_and_damping(geared_chain):
    assert problem_of(geared_chain).bases == 2
    assert NonlinearSystem(geared_chain, ()).bases == 1
    force = HarmonicForce(np.ones(4), (0, 0, 3))
    assert problem_of(geared_chain, forces=(force,)).bases == 3
    skew = np.triu(np.ones((4, 4)), 1)
    skew = skew - skew.T
    turning = replace(geared_chain, C=0.1 * np.eye(4), gyroscopic=skew)
    np.testing.assert_allclose(problem_of(turning, speed=3.0).damping, 0.1 * np.eye(4) + 3.0 * skew)
    np.testing.assert_array_equal(problem_of(turning).damping, turning.C)


def test_external_force_is_load_plus_waves(geared_chain):
    forces = (HarmonicForce([1.0, 1j, 0, 0], (2, 0)), HarmonicForce([0, 0, 0.5, 0], (-1, 1)))
    theta = np.array([[0.3, 1.1], [2.0, 5.0]])
    wanted = np.tile(geared_chain.load, (2, 1))
    wanted[:, 0] += np.cos(2.0 * theta[:, 0])
    wanted[:, 1] -= np.sin(2.0 * theta[:, 0])
    wanted[:, 2] += 0.5 * np.cos(theta[:, 1] - theta[:, 0])
    np.testing.assert_allclose(external_force(problem_of(geared_chain, forces=forces), theta), wanted)


def test_modal_damping_gives_every_mode_its_ratio(geared_chain):
    ratios = np.array([0.01, 0.02, 0.03, 0.04])
    C = modal_damping(geared_chain, [1.0, 1.4], ratios)
    np.testing.assert_allclose(C, C.T, atol=1e-14)
    modes = undamped_modes(replace(geared_chain, C=C), [1.0, 1.4])
    np.testing.assert_allclose(modes.damping_ratio, ratios, rtol=1e-10)
    # roots of the damped equations, without any modes
    K = geared_chain.K + (geared_chain.W * [1.0, 1.4]) @ geared_chain.W.T
    inverse = np.linalg.inv(geared_chain.M)
    state = np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ K, -inverse @ C]])
    roots = np.linalg.eigvals(state)
    roots = roots[roots.imag > 0.0][np.argsort(np.abs(roots[roots.imag > 0.0]))]
    np.testing.assert_allclose(-roots.real / np.abs(roots), ratios, rtol=1e-9)


@pytest.mark.parametrize(
    "make",
    [
        lambda system: NonlinearSystem(system, (PolynomialSprings([2], [[1.0]]),)),
        lambda system: NonlinearSystem(system, (), (HarmonicForce(np.ones(3)),)),
        lambda system: NonlinearSystem(system, (), (HarmonicForce([np.nan, 0, 0, 0]),)),
    ],
)
def test_problems_that_do_not_fit_are_refused(geared_chain, make):
    with pytest.raises(CaseError) as error:
        make(geared_chain)
    assert error.value.code == "E-SHAPE"


def test_periodic_solution_in_time():
    solution = PeriodicSolution(
        [2.0, 3.0], [[0, 0], [1, 0], [-1, 2]], [[1.0, 0.5, 0.2j]], np.zeros((1, 3)), True, 0.0, 1, 1, 0.0, ""
    )
    np.testing.assert_array_equal(solution.line_frequency, [0.0, 2.0, 4.0])
    t = np.linspace(0.0, 5.0, 11)
    wanted = 1.0 + 0.5 * np.cos(2.0 * t) - 0.2 * np.sin(4.0 * t)
    np.testing.assert_allclose(solution.at(t)[:, 0], wanted, atol=1e-14)
    with pytest.raises(ValueError, match="read-only"):
        solution.deflection[0, 0] = 1.0


@pytest.mark.parametrize(
    ("name", "value", "code"),
    [
        ("K", [[1.0, np.nan], [np.nan, 1.0]], "E-FINITE"),
        ("M", [[1.0, 0.5], [0.0, 1.0]], "E-SYMMETRY"),
        ("M", [[1.0]], "E-SHAPE"),
        ("C", [[0.1]], "E-SHAPE"),
        ("load", [0.0, np.inf], "E-FINITE"),
        ("load", [0.0], "E-SHAPE"),
        ("W", np.zeros((2, 0)), "E-SHAPE"),
        ("W", [[1.0], [np.nan]], "E-FINITE"),
        ("gyroscopic", np.eye(2), "E-SYMMETRY"),
    ],
)
def test_systems_that_cannot_be_are_refused(name, value, code):
    parts = {"M": np.eye(2), "C": np.zeros((2, 2)), "K": np.eye(2), "W": np.ones((2, 1)), "load": np.zeros(2)}
    with pytest.raises(CaseError, match=code):
        NonlinearSystem(MechanicalSystem(**parts | {name: np.array(value)}, dofs=("a", "b")), ())


@pytest.mark.parametrize("size", [1e-3, 1e9])
@pytest.mark.parametrize("count", [2, 100])
def test_a_support_of_a_ten_millionth_of_the_others_takes_the_load_up(count, size):
    """In a model of many coordinates as of two; one of 1e-15 is none."""
    load = np.zeros(count)
    load[1] = 3.0
    for share, drifts in ((1e-7, False), (1e-15, True)):
        stiffness = np.full(count, size)
        stiffness[1] *= share
        system = MechanicalSystem(
            np.eye(count), np.zeros((count, count)), np.diag(stiffness), np.zeros((count, 1)), load, ()
        )
        note = drift_note(NonlinearSystem(system, ()))
        assert ("it drives degree of freedom 1 away" in note) is drifts
        assert bool(note) is drifts
