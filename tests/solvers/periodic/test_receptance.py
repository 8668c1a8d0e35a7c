"""Receptances from modes against the inverse of the dynamic stiffness."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError, ConvergenceError, FemgearError
from femgear.solvers.linear.receptance import (
    DirectReduction,
    Reduction,
    reduce_directly,
    reduce_problem,
    respond,
    source_columns,
)
from femgear.solvers.periodic.equations import reduced
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.system.force_laws import PolynomialSprings
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem

OMEGA = np.array([0.3, 0.9, 1.7, 4.0])


def chain(n=6, *, damping="proportional", gyroscopic=False, ground=(0.5,), seed=1):
    """Masses in a row with two springs outside K that act on differences of displacements."""
    rng = np.random.default_rng(seed)
    M = np.diag(rng.uniform(0.5, 2.0, n))
    K = np.zeros((n, n))
    for i in range(n - 1):
        K[np.ix_([i, i + 1], [i, i + 1])] += rng.uniform(0.5, 2.0) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[range(len(ground)), range(len(ground))] += ground
    W = np.zeros((n, 2))
    W[[0, 2], 0], W[[1, 4], 1] = (1.0, -1.0), (1.0, -1.0)
    springs = PolynomialSprings([0, 1], [[0.7, 0.0, 0.1], [0.3, 0.0, 0.2]])
    total = K + (W * [0.7, 0.3]) @ W.T
    if damping == "proportional":
        C = 0.03 * M + 0.02 * total
    else:
        C = np.zeros((n, n))
        C[2, 2], C[3, 3] = 0.2, 0.4
    skew = rng.standard_normal((n, n))
    load = rng.standard_normal(n) if ground else np.zeros(n)
    system = MechanicalSystem(M, C, K, W, load, tuple("abcdefghij"[:n]), skew - skew.T if gyroscopic else None)
    force = rng.standard_normal(n) + 1j * rng.standard_normal(n)
    return NonlinearSystem(system, (springs,), (HarmonicForce(force, (2,)),), speed=0.3)


def inverse(problem, omega, reference=(0.7, 0.3)):
    system = problem.system
    stiffness = system.K + (system.W * reference) @ system.W.T
    return np.linalg.inv(stiffness + 1j * omega * problem.damping - omega**2 * system.M)


def columns(problem):
    force = problem.forces[0].force
    return np.column_stack([problem.system.W, problem.system.load, force.real, force.imag])


CASES = {
    "proportional": {},
    "single dampers": {"damping": "local"},
    "gyroscopic": {"gyroscopic": True},
    "gyroscopic with dampers": {"gyroscopic": True, "damping": "local"},
    "free": {"ground": ()},
    "free with dampers": {"ground": (), "damping": "local"},
    "free and gyroscopic": {"ground": (), "gyroscopic": True},
}


@pytest.mark.parametrize("options", CASES.values(), ids=CASES.keys())
def test_sum_over_modes_is_the_inverse(options):
    problem = chain(**options)
    reduction = reduce_problem(problem)
    value, _ = reduction.at(OMEGA)
    everything = respond(reduction, np.eye(6), OMEGA, np.ones((5, 4)))
    for number, omega in enumerate(OMEGA):
        exact = inverse(problem, omega) @ columns(problem)
        wanted = problem.system.W.T @ exact
        assert np.abs(value[number] - wanted).max() < 1e-10 * np.abs(wanted).max()
        assert np.abs(everything[:, number] - exact.sum(axis=1)).max() < 1e-10 * np.abs(exact).max()


@pytest.mark.parametrize("options", [{}, {"damping": "local", "gyroscopic": True}], ids=["real", "complex"])
def test_derivative_by_the_frequency(options):
    problem = chain(**options)
    slope = reduce_problem(problem).at(OMEGA)[1]
    for number, omega in enumerate(OMEGA):
        inner = inverse(problem, omega)
        change = 1j * problem.damping - 2.0 * omega * problem.system.M
        wanted = -problem.system.W.T @ inner @ change @ inner @ columns(problem)
        assert np.abs(slope[number] - wanted).max() < 1e-10 * np.abs(wanted).max()


HELD_AND_COUPLED = ["single dampers", "gyroscopic", "gyroscopic with dampers"]


@pytest.mark.parametrize("name", CASES)
def test_few_frequencies_are_solved_directly_where_modes_are_coupled_and_nothing_is_free(name):
    problem = chain(**CASES[name])
    reduction = reduce_directly(problem)
    assert (reduction is not None) == (name in HELD_AND_COUPLED)
    if reduction is None:
        return
    omega, modes = np.array([0.0, *OMEGA]), reduce_problem(problem)
    for found, wanted in zip(reduction.at(omega), modes.at(omega)):
        assert np.abs(found[1:] - wanted[1:]).max() < 1e-12 * np.abs(wanted).max()
    np.testing.assert_allclose(reduction.static, modes.static, atol=1e-12)
    np.testing.assert_allclose(reduction.value(0.0), modes.static, atol=1e-12)
    inputs = np.ones((5, len(omega)), complex)
    lines, wanted = (respond(one, np.eye(6), omega, inputs) for one in (reduction, modes))
    assert np.abs(lines - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_harmonic_balance_of_a_gyroscopic_system_takes_no_modes_and_has_the_lines_of_theirs():
    problem, options = chain(gyroscopic=True), {"harmonics": 4, "stability": False}
    found = solve_harmonic_balance(problem, 0.9, **options)
    modes = reduce_problem(problem)
    wanted = solve_harmonic_balance(problem, 0.9, reduction=modes, **options)
    lines, of_modes = displacements(problem, found), displacements(problem, wanted, reduction=modes)
    assert np.abs(lines - of_modes).max() < 1e-11 * np.abs(of_modes).max()
    assert reduced(problem, 5) is reduced(problem, 5)
    assert isinstance(reduced(problem, 5), DirectReduction)
    assert isinstance(reduced(problem, 500), Reduction)


def test_a_resonance_without_damping_is_refused_where_frequencies_are_solved_directly():
    problem = chain(gyroscopic=True)
    problem = replace(problem, system=replace(problem.system, C=np.zeros((6, 6))))
    reduction = reduce_directly(problem)
    assert reduction is not None
    pole = reduce_problem(problem).constant
    with pytest.raises(ConvergenceError, match="undamped resonance"):
        reduction.value(np.abs(pole[np.abs(pole.imag).argmin()].imag))


@pytest.mark.parametrize("options", CASES.values(), ids=CASES.keys())
def test_static_receptance_leaves_rigid_motions_out(options):
    problem = chain(**options)
    reduction = reduce_problem(problem)
    system = problem.system
    stiffness = system.K + (system.W * [0.7, 0.3]) @ system.W.T
    columns_only = np.linalg.pinv(stiffness, rcond=1e-10) @ system.W
    np.testing.assert_allclose(reduction.at(0.0)[0][:, :2], system.W.T @ columns_only, atol=1e-12)
    unit = np.zeros((5, 1))
    unit[0] = 1.0
    q = respond(reduction, np.eye(6), np.zeros(1), unit)[:, 0]
    np.testing.assert_allclose(stiffness @ q, system.W[:, 0], atol=1e-12)


def test_static_response_of_a_motion_that_hardly_relaxes():
    """A soft spring beside a strong damper has a pole near zero, which is not a free motion."""
    K, C = np.array([[2.0, -1.0], [-1.0, 1.0 + 1e-4]]), np.diag([0.1, 1e7])
    system = MechanicalSystem(np.eye(2), C, K, np.eye(2), np.zeros(2), ("a", "b"))
    problem = NonlinearSystem(system, (PolynomialSprings([0, 1], np.zeros((2, 1))),))
    reduction = reduce_problem(problem)
    unit = np.eye(3)[:, :1]
    wanted = np.linalg.inv(K)
    np.testing.assert_allclose(reduction.at(0.0)[0][:, :2], wanted, rtol=1e-10)
    np.testing.assert_allclose(respond(reduction, np.eye(2), np.zeros(1), unit), wanted[:, :1], rtol=1e-10)


def test_reference_stiffness_is_free_where_the_own_one_is_not_positive():
    """A double well has a negative stiffness at rest: the reduction works with its size."""
    problem = chain()
    springs = PolynomialSprings([0, 1], [[-0.7, 0.0, 1.0], [0.3, 0.0, 0.2]])
    reduction = reduce_problem(replace(problem, elements=(springs,)))
    np.testing.assert_array_equal(reduction.reference, [0.7, 0.3])
    other = reduce_problem(problem, reference=[2.0, 5.0])
    wanted = problem.system.W.T @ inverse(problem, 0.9, (2.0, 5.0)) @ problem.system.W
    np.testing.assert_allclose(other.at(0.9)[0][:, :2], wanted, rtol=1e-10)


def test_column_without_stiffness_on_a_free_motion_is_refused():
    problem = chain(ground=())
    springs = PolynomialSprings([0, 1], [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    W = np.zeros((6, 2))
    W[0, 0], W[5, 1] = 1.0, 1.0
    system = replace(problem.system, W=W)
    with pytest.raises(ConvergenceError, match="strains column") as error:
        reduce_problem(replace(problem, system=system, elements=(springs,)))
    assert error.value.code == "E-RIGID-MODE"


@pytest.mark.parametrize("where", ["constant load", "force of order zero"])
def test_constant_load_on_a_free_motion_is_refused(where):
    problem = chain(ground=())
    push = np.eye(6)[3]
    if where == "constant load":
        problem = replace(problem, system=replace(problem.system, load=push))
    else:
        problem = replace(problem, forces=(HarmonicForce(push, (0,)),))
    with pytest.raises(CaseError, match="rigid-body") as error:
        reduce_problem(problem)
    assert error.value.code == "E-LOAD-BALANCE"


def test_undamped_resonance_is_refused():
    problem = chain()
    problem = replace(problem, system=replace(problem.system, C=np.zeros((6, 6))))
    reduction = reduce_problem(problem)
    with pytest.raises(ConvergenceError, match="mode 3 ") as error:
        reduction.at(2.0 * np.pi * reduction.modes.frequency[2])
    assert error.value.code == "E-RESONANCE"


def test_defective_state_is_refused():
    """Two critically damped equal oscillators, coupled by their damping: one pole with too few vectors."""
    C = np.array([[2.0, 1e-3], [0.0, 2.0]])
    system = MechanicalSystem(np.eye(2), C, np.eye(2), np.eye(2), np.zeros(2), ("a", "b"))
    springs = PolynomialSprings([0, 1], np.zeros((2, 1)))
    with pytest.raises(FemgearError) as error:
        reduce_problem(NonlinearSystem(system, (springs,)))
    assert error.value.code == "E-SOLVE"


def test_amplitudes_of_the_loads_on_the_lines():
    problem = chain()
    forces = (
        HarmonicForce(np.ones(6), (1,)),
        HarmonicForce(1j * np.ones(6), (-2,)),
        HarmonicForce(np.ones(6), (0,)),
    )
    table = source_columns(replace(problem, forces=forces), np.array([[0], [1], [2]]))
    wanted = np.zeros((7, 3), complex)
    wanted[0, 0] = 1.0
    wanted[1:3, 1] = 1.0, 1j
    wanted[3:5, 2] = 1.0, -1j
    np.testing.assert_array_equal(table, wanted)
    with pytest.raises(CaseError) as error:
        source_columns(problem, np.array([[0], [1]]))
    assert error.value.code == "E-HARMONICS"


@pytest.mark.parametrize("share, real", [(0.0, True), (1e-13, True), (1e-6, False), (-1e-6, False)])
def test_real_modes_are_kept_where_they_make_the_damping_diagonal(share, real):
    """Two equal masses between springs, with dampers like the springs and one that is not."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    C = 0.1 * K + share * np.diag([1.0, 0.0])
    system = MechanicalSystem(np.eye(2), C, K, np.eye(2, 1), np.zeros(2), ("a", "b"))
    reduction = reduce_problem(NonlinearSystem(system, ()))
    if real:
        assert reduction.square == 1.0 and reduction.shape.shape == (2, 2)
        np.testing.assert_allclose(reduction.linear, [0.1, 0.3], atol=1e-11)
        np.testing.assert_allclose(reduction.constant, [1.0, 3.0], rtol=1e-12)
    else:
        assert reduction.square == 0.0 and reduction.shape.shape == (2, 4)
