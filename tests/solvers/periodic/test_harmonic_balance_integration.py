"""Harmonic balance against adaptive integration in time: contact loss, bearings with clearance, two tones."""

import math
from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set
from scipy.integrate import solve_ivp

from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.stages.lumped_set import Bearings, MemberBearing, gear_set_problem
from femgear.system.force_laws import GearMeshes, PolynomialSprings, RadialBearings
from femgear.system.fourier import FourierSeries, harmonic_lines, harmonics_of
from femgear.system.mesh_directions import mesh_elements
from femgear.system.rigid_bodies import PlanarTorque
from femgear.system.system import (
    HarmonicForce,
    MechanicalSystem,
    NonlinearSystem,
    element_forces,
    external_force,
)
from validation.reference.cornered_springs import BearingSprings


def state_of(problem, solution):
    """Displacements and velocities at t = 0."""
    lines = displacements(problem, solution)
    velocity = 1j * solution.line_frequency * lines
    return np.concatenate([lines.sum(axis=1).real, velocity.sum(axis=1).real])


def motion(problem, frequency):
    """Rate of the state and, in further columns, of its variations."""
    system, n = problem.system, len(problem.system.M)
    inverse = np.linalg.inv(system.M)
    damping, stiffness, push = inverse @ problem.damping, inverse @ system.K, inverse @ system.W

    def rate(t, y):
        z = y.reshape(2 * n, -1)
        theta = t * np.atleast_1d(frequency)
        force, tangent = element_forces(problem, system.W.T @ z[:n, 0], theta)
        acceleration = -damping @ z[n:] - stiffness @ z[:n]
        acceleration[:, 0] += inverse @ external_force(problem, theta) - push @ force
        acceleration[:, 1:] -= push @ (tangent @ (system.W.T @ z[:n, 1:]))
        return np.vstack([z[n:], acceleration]).ravel()

    return rate


def periodic(problem, omega, state, *, rtol=1e-9, instants=256, count=20):
    """Lines of ``W^T q`` of the periodic motion near a state: integration and Newton on ``z(T) = z(0)``."""
    n, period = len(problem.system.M), 2.0 * np.pi / omega
    size = np.repeat([np.abs(state[:n]).max(), np.abs(state[n:]).max()], n)
    times = np.append(np.arange(instants), instants) * period / instants
    for _ in range(6):
        start = np.column_stack([state, np.diag(size)])
        found = solve_ivp(
            motion(problem, omega),
            (0.0, period),
            start.ravel(),
            method="DOP853",
            rtol=rtol,
            atol=0.1 * rtol * np.repeat(size, 2 * n + 1),
            t_eval=times,
        ).y.reshape(2 * n, 2 * n + 1, -1)
        gap = found[:, 0, -1] - state
        if np.abs(gap / size).max() < 20.0 * rtol:
            return harmonics_of(problem.system.W.T @ found[:n, 0, :-1], count)
        # free rotations close wherever they are: the smallest correction
        change = found[:, 1:, -1] / size[:, None] - np.eye(2 * n)
        state = state - size * np.linalg.lstsq(change, gap / size, rcond=1e-6)[0]
    raise AssertionError(f"shooting does not close: {np.abs(gap / size).max()}")


def difference(solution, lines):
    """Largest difference of the lines relative to the largest fluctuating one."""
    count = min(lines.shape[1], solution.deflection.shape[1])
    error = np.abs(solution.deflection[:, :count] - lines[:, :count]).max()
    return error / np.abs(lines[:, 1:]).max()


@pytest.mark.parametrize(
    ("depth", "frequency", "backlash", "sides"),
    [
        pytest.param(0.3, 1.0, 1.0, 1, marks=pytest.mark.slow),
        pytest.param(0.3, 0.92, 1.0, 1, marks=pytest.mark.slow),
        (0.5, 0.9, 0.1, 2),
    ],
    ids=["one side", "deep separation", "both sides"],
)
def test_gear_pair_with_backlash(depth, frequency, backlash, sides):
    stiffness = FourierSeries([[1.0, depth, 0.3 * depth]])
    system = MechanicalSystem(np.eye(1), np.array([[0.1]]), np.zeros((1, 1)), np.eye(1), np.array([0.1]), ("x",))
    problem = NonlinearSystem(system, (GearMeshes([0], stiffness, backlash=backlash),))
    found = solve_harmonic_balance(problem, frequency, harmonics=32, samples=16384)
    x = found.at(np.linspace(0.0, 2.0 * np.pi / frequency, 1000))
    assert found.converged and x.min() < 0.0
    assert (x.min() < -backlash) == (sides == 2)
    reference = periodic(problem, frequency, state_of(problem, found), rtol=1e-11, instants=512)
    assert difference(found, reference) < 1e-7
    coarse = solve_harmonic_balance(problem, frequency, harmonics=16, start=found)
    assert difference(coarse, reference) < 1e-5


def test_gear_pair_from_rest_settles_on_the_solution():
    """Long integration from rest, without knowledge of the solution."""
    system = MechanicalSystem(np.eye(1), np.array([[0.1]]), np.zeros((1, 1)), np.eye(1), np.array([0.1]), ("x",))
    problem = NonlinearSystem(system, (GearMeshes([0], FourierSeries([[1.0, 0.3, 0.09]]), backlash=1.0),))

    def rate(t, y):
        stiffness = 1.0 + 0.3 * math.cos(t) + 0.09 * math.cos(2.0 * t)
        stretch = y[0] if y[0] > 0.0 else min(y[0] + 1.0, 0.0)
        return y[1], 0.1 - 0.1 * y[1] - stiffness * stretch

    times = 2.0 * np.pi * (45 + np.arange(512) / 512)
    run = solve_ivp(rate, (0.0, times[-1]), np.zeros(2), method="DOP853", rtol=1e-9, atol=1e-11, t_eval=times)
    found = solve_harmonic_balance(problem, 1.0, harmonics=16)
    assert found.at(times).min() < 0.0
    assert difference(found, harmonics_of(run.y[:1], 16)) < 1e-5


@pytest.mark.slow
def test_planetary_set_with_backlash():
    """18 degrees of freedom, six meshes that part, free rotation."""
    data = lin_parker_set(3)
    phases = np.array([0.0, 1 / 3, 2 / 3, 0.15, 0.15 + 1 / 3, 0.15 + 2 / 3])
    mesh = 5e8 * np.array([1.0, 0.25, 0.075, 0.0375])
    stiffness = FourierSeries(mesh * np.exp(-2j * np.pi * phases[:, None] * np.arange(4)))
    problem = gear_set_problem(
        data,
        meshes=mesh_elements(data, stiffness=stiffness, backlash=20e-6),
        torque=PlanarTorque(300.0),
        damping=0.03,
    )
    omega = 2.0 * np.pi * 7400.0
    found = solve_harmonic_balance(problem, omega, harmonics=8)
    assert found.converged
    reference = periodic(problem, omega, state_of(problem, found), rtol=1e-8)
    # the meshes with the ring part, those with the sun do not
    lowest = found.at(np.linspace(0.0, 1.0 / 7400.0, 200)).min(axis=0)
    assert (lowest[:3] > 0.0).all() and (lowest[3:] < 0.0).all()
    assert difference(found, reference) < 1e-5
    fine = solve_harmonic_balance(problem, omega, harmonics=20, samples=4096, start=found)
    assert difference(fine, reference) < 1e-6


@pytest.mark.parametrize(
    "bearing",
    [
        RadialBearings([[0, 1]], 1.0, clearance=0.3),
        pytest.param(BearingSprings([[0, 1]], 1.0, clearance=0.3, springs=8), marks=pytest.mark.slow),
    ],
)
def test_rotor_in_a_bearing_with_clearance(bearing):
    """Weight that turns in the rotating frame, against the sense of rotation, and a constant load."""
    system = MechanicalSystem(
        np.eye(2), 0.2 * np.eye(2), np.diag([0.1, 0.15]), np.eye(2), np.array([0.15, -0.08]), ("x", "y")
    )
    problem = NonlinearSystem(system, (bearing,), (HarmonicForce([0.12, 0.12j], (-1,)),))
    found = solve_harmonic_balance(problem, 0.5, harmonics=24, samples=4096)
    radius = np.linalg.norm(found.at(np.linspace(0.0, 4.0 * np.pi, 400)), axis=1)
    assert found.converged and radius.min() < 0.3 < radius.max()
    reference = periodic(problem, 0.5, state_of(problem, found))
    assert difference(found, reference) < 1e-5


def test_double_well_works_about_its_own_reference():
    """Negative stiffness at rest; motion in one well."""
    system = MechanicalSystem(np.eye(1), np.array([[0.3]]), np.zeros((1, 1)), np.eye(1), np.zeros(1), ("x",))
    springs = PolynomialSprings([0], [[-1.0, 0.0, 1.0]])
    problem = NonlinearSystem(system, (springs,), (HarmonicForce([0.15], (1,)),))
    start = np.zeros((1, 17))
    start[0, 0] = 1.0
    found = solve_harmonic_balance(problem, 1.2, harmonics=16, start=start)
    assert found.converged and found.at(np.linspace(0.0, 6.0, 100)).min() > 0.0
    reference = periodic(problem, 1.2, state_of(problem, found), rtol=1e-11)
    assert difference(found, reference) < 1e-8


def test_two_tones_against_long_integration():
    system = MechanicalSystem(np.eye(1), np.array([[0.4]]), np.zeros((1, 1)), np.eye(1), np.zeros(1), ("x",))
    springs = PolynomialSprings([0], [[1.0, 0.0, 0.3]])
    frequency = np.array([0.7, 0.7 * np.sqrt(3.0)])
    problem = NonlinearSystem(system, (springs,), (HarmonicForce([0.4], (1, 0)), HarmonicForce([0.3], (0, 1))))
    found = solve_harmonic_balance(problem, frequency, orders=harmonic_lines(13, 2))
    assert found.converged and found.tail < 1e-3
    combination = np.flatnonzero(np.all(found.orders == [2, 1], axis=1))[0]
    assert abs(found.deflection[0, combination]) > 1e-3
    times = np.linspace(150.0, 750.0, 6001)
    run = solve_ivp(
        lambda t, y: [
            y[1],
            0.4 * np.cos(0.7 * t) + 0.3 * np.cos(frequency[1] * t) - 0.4 * y[1] - y[0] - 0.3 * y[0] ** 3,
        ],
        (0.0, 750.0),
        np.zeros(2),
        method="DOP853",
        rtol=1e-9,
        atol=1e-11,
        t_eval=times,
    )
    wave = np.exp(1j * times[:, None] * found.line_frequency)
    table = np.hstack([wave.real, -wave.imag[:, 1:]])
    fit = np.linalg.lstsq(table, run.y[0], rcond=None)[0]
    count = len(found.orders)
    lines = fit[:count].astype(complex)
    lines[1:] += 1j * fit[count:]
    assert np.abs(lines - found.deflection[0]).max() < 1e-4 * np.abs(lines).max()
    signal = found.at(times)[:, 0]
    assert np.abs(signal - run.y[0]).max() < 1e-3 * np.abs(signal).max()


def test_commensurable_bases_give_the_one_base_signal():
    """A mesh frequency of three carrier frequencies: lines coincide in frequency, their sum is the signal."""
    system = MechanicalSystem(np.eye(1), np.array([[0.2]]), np.zeros((1, 1)), np.eye(1), np.array([0.3]), ("x",))
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.3]], (0, 1)), separates=False)
    cubic = PolynomialSprings([0], [[0.0, 0.0, 0.4]])
    problem = NonlinearSystem(system, (mesh, cubic), (HarmonicForce([0.2], (1, 0)),))
    two = solve_harmonic_balance(problem, [0.5, 1.5], orders=harmonic_lines(13, 2))
    one = replace(
        problem,
        elements=(replace(mesh, stiffness=FourierSeries([[1.0, 0.3]], (3,))), cubic),
        forces=(HarmonicForce([0.2], (1,)),),
    )
    single = solve_harmonic_balance(one, 0.5, harmonics=24)
    times = np.linspace(0.0, 4.0 * np.pi, 200)
    assert two.converged and single.converged
    np.testing.assert_allclose(two.at(times), single.at(times), atol=1e-5)


def test_sun_that_floats_in_its_bearing():
    """The clearance adds columns that free rotation does not move; by symmetry the sun stays centred."""
    data, torque = lin_parker_set(3), PlanarTorque(300.0)
    loose = replace(data, sun=replace(data.sun, support=0.0))
    bearings = Bearings(members=(MemberBearing(data.sun.support, 5e-6, "sun"),))
    floating = gear_set_problem(loose, bearings=bearings, torque=torque, damping=0.03)
    found = solve_harmonic_balance(floating, 1000.0, harmonics=3)
    held = solve_harmonic_balance(gear_set_problem(data, torque=torque, damping=0.03), 1000.0, harmonics=3)
    assert found.converged
    assert np.abs(found.deflection[6:]).max() < 1e-9 * np.abs(found.deflection[:6]).max()
    np.testing.assert_allclose(found.deflection[:6], held.deflection, rtol=1e-9, atol=1e-18)
