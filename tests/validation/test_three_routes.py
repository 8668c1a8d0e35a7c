"""One motion by harmonic balance, shooting and integration, and by an integration that is written here."""

import time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.system.fourier import harmonics_of
from validation import nonlinear, routes
from validation.routes import GATE, difference

PAIR = {False: (0.92, 0.3, 1.0), True: (0.9, 0.5, 0.1)}


def unit_mass(omega, force, *, load=0.0, drive=0.0, damping, start=(0.0, 0.0), periods=60):
    """Lines of the last period of ``x'' + damping x' + force(x, t) = load + drive cos(omega t)``."""
    times = 2.0 * np.pi / omega * (periods - 1 + np.arange(512) / 512)
    run = solve_ivp(
        lambda t, y: (y[1], load + drive * np.cos(omega * t) - damping * y[1] - force(y[0], t)),
        (0.0, times[-1]),
        start,
        method="DOP853",
        rtol=1e-8,
        atol=1e-10,
        t_eval=times,
    )
    return harmonics_of(run.y[:1], 15)


def mesh_force(omega, depth, backlash):
    def force(x, t):
        stretch = x if x > 0.0 else min(x + backlash, 0.0)
        return (1.0 + depth * np.cos(omega * t) + 0.3 * depth * np.cos(2.0 * omega * t)) * stretch

    return force


@pytest.mark.slow
def test_duffing_against_an_integration_without_femgear():
    found, run = routes.duffing_motion()
    line = nonlinear.one_harmonic(2.5091975811, 1.2)
    lines = unit_mass(
        1.2,
        lambda x, t: x + 0.1 * x**3,
        drive=0.18,
        damping=0.05,
        periods=110,
        start=(line.real, -1.2 * line.imag),
    )
    for other in (found.balance.deflection, found.shooting.solution.deflection, run.lines):
        assert difference(lines, other) < GATE


@pytest.mark.slow
@pytest.mark.parametrize("back", [False, True])
def test_gear_pair_against_an_integration_without_femgear(back):
    omega, depth, backlash = PAIR[back]
    found, run = routes.pair_motion(back)
    lines = unit_mass(omega, mesh_force(omega, depth, backlash), load=0.1, damping=0.1)
    for other in (found.balance.deflection, found.shooting.solution.deflection, run.lines):
        assert difference(lines, other) < GATE
    apart, struck = routes.open_share(found)
    assert apart > 0.3 and (struck > 0.3) == back


def test_planetary_train_against_an_integration_without_femgear():
    """Equations of motion assembled here from M, C, K, W and k(t); one period from the shooting's start."""
    found = routes.train_motion()
    system, omega = found.problem.system, found.frequency
    n, meshes = len(system.M), found.problem.elements[0]
    assert n == 18 and len(meshes.columns) == 6
    inverse = np.linalg.inv(system.M)
    spring, damper, push = inverse @ system.K, inverse @ system.C, inverse @ system.W
    waves, offset = meshes.stiffness.amplitudes, meshes.deflection.mean
    late = np.array([0.0, 1 / 3, 2 / 3, 0.15, 0.15 + 1 / 3, 0.15 + 2 / 3])
    shares = np.array([1.0, 0.25, 0.075, 0.0375])
    np.testing.assert_allclose(waves, 5e8 * shares * np.exp(-2j * np.pi * late[:, None] * np.arange(4)), atol=1e-3)

    def rate(t, y):
        x = system.W.T @ y[:n] - offset
        k = (waves @ np.exp(1j * omega * t * np.arange(4))).real
        force = k * np.where(x > 0.0, x, np.minimum(x + 20e-6, 0.0))
        return np.concatenate([y[n:], inverse @ system.load - spring @ y[:n] - damper @ y[n:] - push @ force])

    start = np.concatenate([found.shooting.displacement, found.shooting.velocity])
    scale = np.repeat([np.abs(start[:n]).max(), np.abs(start[n:]).max()], n)
    times = 2.0 * np.pi / omega * np.arange(1025) / 1024
    run = solve_ivp(rate, times[[0, -1]], start, method="DOP853", rtol=1e-9, atol=1e-10 * scale, t_eval=times)
    x = system.W.T @ run.y[:n]
    # the motion closes, and a stable one that closes is where integration settles
    assert np.abs(x[:, -1] - x[:, 0]).max() < 1e-6 * np.ptp(x, axis=1).max()
    lines = harmonics_of(x[:, :-1], 16)
    for other in (found.balance.deflection, found.shooting.solution.deflection):
        assert difference(lines, other) < GATE
    assert found.verdict.stable is True and routes.open_share(found)[0] > 0.5


@pytest.mark.slow
def test_multipliers_of_shooting_are_those_of_the_verdict():
    for found in (routes.duffing_motion()[0], routes.pair_motion(False)[0], routes.train_motion()):
        sizes = np.sort(np.abs(found.verdict.multipliers))[::-1]
        shot = np.sort(np.abs(found.shooting.multipliers))[::-1]
        # the free rotation of the train has two unit multipliers, which the verdict leaves out
        shot = shot[len(shot) - len(sizes) :]
        # the verdict sees the contact changes of the lines kept: 3e-6 from shooting on the train
        np.testing.assert_allclose(sizes[:2], shot[:2], rtol=1e-5)


def test_a_motion_without_contact_loss_is_told_apart():
    """The comparison sees what the contact loss does: some percent of the largest line."""
    found = routes.train_motion()
    meshes = found.problem.elements[0]
    closed = type(meshes)(meshes.columns, meshes.stiffness, meshes.deflection, separates=False)
    problem = type(found.problem)(found.problem.system, (closed,), found.problem.forces, found.problem.speed)
    linear = solve_harmonic_balance(problem, found.frequency, harmonics=16)
    assert difference(found.shooting.solution.deflection, linear.deflection) > 1e3 * GATE


@pytest.mark.slow
def test_planetary_train_that_strikes_its_back_flanks():
    found = routes.train_motion(backlash=1e-6)
    assert found.balance.converged and found.shooting.solution.converged
    assert routes.open_share(found)[1] > 0.05
    assert difference(found.shooting.solution.deflection, found.balance.deflection) < GATE


@pytest.mark.slow
def test_planetary_train_settles_from_rest_and_balance_is_thirty_times_faster():
    found, run = routes.train_motion(), routes.train_settled(True)
    assert run.change < 1e-6
    assert difference(run.lines, found.balance.deflection) < GATE
    begin = time.perf_counter()
    few = solve_harmonic_balance(found.problem, found.frequency, harmonics=8, samples=2048)
    balance_time = time.perf_counter() - begin
    begin = time.perf_counter()
    loose = routes.settled(found.problem, found.frequency, periods=450, tolerance=1e-7, harmonics=8)
    integration_time = time.perf_counter() - begin
    reference = found.shooting.solution.deflection
    # integration stops while it is still farther off than eight harmonics: the comparison favours it
    assert difference(reference, few.deflection) < 5e-6
    assert difference(reference, loose.lines) > difference(reference, few.deflection)
    assert integration_time > 30.0 * balance_time
