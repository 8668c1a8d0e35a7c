"""Response of stages in series: direct solution, harmonic balance, integration, a fixed frame."""

from dataclasses import replace

import numpy as np
import pytest
from published.multistage_example import four_stage_case, four_stage_train
from small_trains import two_stages

from femgear.errors import CaseError
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.time.transient import solve_transient
from femgear.stages.lumped_set import gear_set_problem, phased_series
from femgear.system.fourier import FourierSeries, distinct_lines, harmonic_lines, tooth_lines
from femgear.system.mesh_directions import mesh_elements
from femgear.system.rigid_bodies import PlanarTorque
from femgear.trains.multistage.case_file import stage_gears
from femgear.trains.multistage.model import (
    Member,
    MultistageSet,
    mean_mesh_stiffness,
    mesh_columns,
    multistage_system,
    stage_slices,
    train_speeds,
    train_torques,
    turning_couplings,
)
from femgear.trains.multistage.stages import base_frequencies, error_response, multistage_problem
from validation.reference.frequency_response import mesh_error_response

SPEED, TORQUE = 50.0 * np.pi, 350.0


def test_load_bends_the_train_as_the_torques_say():
    train = four_stage_train()
    problem = multistage_problem(train, torque=TORQUE)
    system, k = problem.system, mean_mesh_stiffness(train)
    K = system.K + (system.W * k) @ system.W.T
    forces = k * (system.W.T @ np.linalg.lstsq(K, system.load, rcond=1e-13)[0])
    torques = train_torques(train, TORQUE)
    for one, columns, sun in zip(train.stages, mesh_columns(train), torques.sun):
        N = one.data.n_planets
        assert forces[columns] == pytest.approx(sun / one.data.sun_radius / N, rel=1e-5)
    with pytest.raises(CaseError, match="E-MECHANISM"):
        multistage_system(replace(train, couplings=train.couplings[:2]), torque=TORQUE)


# --- response -----------------------------------------------------------------------------------------


def test_modal_summation_is_the_direct_solution_for_every_stage():
    train = four_stage_train()
    waves = np.array([4e-6, 1e-6j]), np.array([-2e-6, 0.5e-6])
    errors = {n: tooth_lines(*waves, one.phases) for n, one in enumerate(train.stages, 1)}
    speeds = SPEED * np.linspace(0.3, 1.1, 7)
    found = error_response(train, speeds, errors, damping_ratio=0.03)
    system, k = multistage_system(train), mean_mesh_stiffness(train)
    for number, columns in enumerate(mesh_columns(train), 1):
        table = np.zeros((train.n_meshes, 2), complex)
        table[columns] = errors[number]
        hertz = train_speeds(train, 1.0).mesh_frequency[number - 1] * speeds
        direct = mesh_error_response(system, hertz, table, mesh_stiffness=k, damping_ratio=0.03)
        size = np.abs(direct.deflection).max()
        assert np.abs(found[number].deflection - direct.deflection).max() < 1e-9 * size
        assert np.abs(found[number].force - direct.force).max() < 1e-9 * np.abs(direct.force).max()
        assert found[number].mesh_frequency == pytest.approx(hertz)
    # errors of a stage reach its neighbours through the shafts
    assert np.abs(found[1].force[..., mesh_columns(train)[1]]).max() > 1.0


def test_phases_of_the_example_are_those_of_its_gears():
    case, train = four_stage_case(), four_stage_train()
    for one, section in zip(train.stages, case.stage):
        assert one.phases == pytest.approx(stage_gears(section).mesh_phases)
    error = tooth_lines([1.0], [1.0], train.stages[2].phases)
    assert error[:, 0] == pytest.approx(np.exp(2j * np.pi * train.stages[2].phases))


def linear_meshes(one, error):
    """Meshes that may pull, with the error as unloaded deflection."""
    made = mesh_elements(one.data, separates=False)
    return replace(made, deflection=FourierSeries(np.column_stack([np.zeros(len(error)), error])))


def test_harmonic_balance_of_linear_meshes_is_the_modal_summation():
    train, speed = two_stages(), 90.0
    errors = {n: tooth_lines([3e-6, 1e-6j], [-2e-6, 4e-7], one.phases) for n, one in enumerate(train.stages, 1)}
    meshes = {n: linear_meshes(one, errors[n]) for n, one in enumerate(train.stages, 1)}
    problem = multistage_problem(train, meshes=meshes, damping=0.02)
    frequency = base_frequencies(train, speed)[:2]
    found = solve_harmonic_balance(problem, frequency, orders=harmonic_lines(2, 2), stability=False)
    assert found.converged
    modal = error_response(train, speed, errors, damping_ratio=0.02)
    lines = {tuple(order): n for n, order in enumerate(found.orders.tolist())}
    for number, answer in modal.items():
        for h in (1, 2):
            order = (h, 0) if number == 1 else (0, h)
            own = found.deflection[:, lines[order]]
            assert np.abs(own - answer.deflection[0, h - 1]).max() < 1e-9 * np.abs(own).max()
    assert np.abs(found.deflection[:, lines[1, 1]]).max() < 1e-12 * np.abs(found.deflection).max()


def parametric_meshes(train, depth):
    """Mesh stiffnesses that fluctuate, without parting."""
    made = {}
    for number, one in enumerate(train.stages, 1):
        waves = [depth, 0.3j * depth], [0.7 * depth, -0.2 * depth]
        series = phased_series(*waves, one.phases, mean=one.data.mesh_stiffness)
        made[number] = mesh_elements(one.data, stiffness=series, separates=False)
    return made


def test_two_base_frequencies_agree_with_their_common_one():
    """Mesh frequencies as 4 to 1: 30 harmonics of the lower one see the same motion."""
    train, speed = two_stages(), 60.0
    meshes = parametric_meshes(train, 0.15)
    bases = base_frequencies(train, speed)[:2]
    assert bases[0] == pytest.approx(4.0 * bases[1], rel=1e-12)
    problem = multistage_problem(train, meshes=meshes, torque=500.0, damping=0.05)
    found = solve_harmonic_balance(problem, bases, orders=harmonic_lines(8, 2), stability=False)
    elements = tuple(
        replace(made, columns=columns, stiffness=replace(made.stiffness, orders=(order,)))
        for made, columns, order in zip(meshes.values(), mesh_columns(train), (4, 1))
    )
    common = solve_harmonic_balance(replace(problem, elements=elements), bases[1], harmonics=30, stability=False)
    assert found.converged and common.converged
    times = np.linspace(0.0, 2.0 * np.pi / bases[1], 100, endpoint=False)
    one, other = found.at(times), common.at(times)
    assert np.abs(one - other).max() < 1e-5 * np.ptp(other, axis=0).max()


@pytest.mark.parametrize(("speed", "limits"), [(300.0, {2: 1e-2, 4: 1e-4}), (-300.0, {3: 1e-3})])
def test_turning_train_agrees_with_integration(speed, limits):
    """Gyroscopic terms, lateral coupling between turning frames and k(t) of both stages, in the time domain.

    The integration starts on the solution and has to stay on it; what is left falls with the orders.
    """
    train = two_stages()
    problem = multistage_problem(train, meshes=parametric_meshes(train, 0.03), torque=500.0, speed=speed, damping=0.05)
    bases = base_frequencies(train, speed)
    assert len(bases) == 3
    for H, limit in limits.items():
        square = [(a, b, c) for a in range(-H, H + 1) for b in range(-H, H + 1) for c in (-1, 0, 1)]
        orders = distinct_lines([one for one in square if abs(one[0]) + abs(one[1]) <= H])
        samples = (2 * H + 5, 2 * H + 5, 5)
        found = solve_harmonic_balance(problem, bases, orders=orders, samples=samples, stability=False)
        assert found.converged
        x, w = displacements(problem, found), found.line_frequency
        start = x.sum(axis=1).real, (1j * w * x).sum(axis=1).real
        times = np.linspace(0.0, 2.0 * np.pi / bases[1], 40)
        march = solve_transient(problem, bases, times, start=start, method="DOP853", tolerance=1e-8)
        other = march.deflection
        assert np.abs(found.at(times) - other).max() < limit * np.ptp(other, axis=0).max()
    # the coupling brings its own lines
    lines = {tuple(order): n for n, order in enumerate(found.orders.tolist())}
    side = np.abs(found.deflection[:, [lines.get((-1, 0, 1), lines.get((1, 0, 1)))]]).max()
    assert side > 1e-3 * np.abs(found.deflection[:, lines[1, 0, 0]]).max()


def test_turning_lateral_coupling_is_a_constant_spring_in_a_fixed_frame():
    """With equal spacing the second stage stands still in the frame of the first: a static problem there.

    In the first frame x, y of central members and the first cyclic harmonic of the planets of stage 2 turn
    with the relative speed: ``q_2 = R p_2``, ``R' = J R``, J commutes with all matrices of that stage.
    """
    lateral, speed = 1e8, 400.0
    train = two_stages(torsional=3e5, lateral=lateral)
    train = replace(train, stages=(train.stages[0], replace(train.stages[1], angle=0.0)))
    ((_, relative),) = turning_couplings(train, speed).items()
    meshes = {n: mesh_elements(one.data, separates=False) for n, one in enumerate(train.stages, 1)}
    problem = multistage_problem(train, meshes=meshes, speed=speed)
    system, (one, other) = problem.system, stage_slices(train)
    load = np.zeros(len(system.M))
    load[6], load[one.stop - 3] = 3e3, 500.0  # sun 1 along x, planet 3 of stage 1 outwards
    problem = replace(problem, system=replace(system, load=load, C=2e-6 * stiff(train)))
    # q_2 turns backwards by the relative angle, as seen from its own frame
    J = np.zeros((len(system.M),) * 2)
    J[other, other] = -relative * generator(train.stages[1].data)
    C = problem.damping
    K = system.K + (system.W[:, :12] * problem.reference[:12]) @ system.W[:, :12].T
    for matrix in (system.M[other, other], C[other, other], K[other, other]):
        part = J[other, other]
        assert np.abs(part @ matrix - matrix @ part).max() < 1e-9 * np.abs(part @ matrix).max()
    shift = np.zeros((len(K), 2))
    for axis in range(2):
        shift[axis, axis], shift[other.start + 6 + axis, axis] = 1.0, -1.0
    turned = K + C @ J + system.M @ J @ J + lateral * shift @ shift.T
    p = np.linalg.lstsq(turned, load, rcond=1e-13)[0]
    frequency = base_frequencies(train, speed)
    found = solve_harmonic_balance(
        problem, frequency, orders=[(0, 0, 0), (0, 0, 1)], samples=(1, 1, 8), stability=False
    )
    assert found.converged
    wave = np.zeros((len(K), 2), complex)
    wave[one, 0], part = p[one], p[other]
    slope = (J[other, other] @ part) / relative
    # R p = p cos + slope sin on what turns; what does not turn stays
    turning = -(J[other, other] @ J[other, other] @ part) / relative**2
    sense = np.sign(relative)
    wave[other, 0], wave[other, 1] = part - turning, turning - 1j * sense * slope
    expected = system.W.T @ wave
    assert np.abs(found.deflection - expected).max() < 1e-8 * np.abs(expected).max()
    # stage 2 answers strongly enough to tell
    assert np.abs(expected[6:12, 1]).max() > 0.01 * np.abs(expected).max()


def stiff(train):
    """A damping that turns with both stages: proportional to meshes, bearings and supports of each."""
    apart = replace(train, couplings=())
    system = multistage_system(apart)
    return system.K + (system.W * mean_mesh_stiffness(train)) @ system.W.T


def generator(data):
    """Rate of the coordinates of a set per unit of speed with which its translations turn."""
    N, psi = data.n_planets, data.planet_angles
    J = np.zeros((3 * (N + 3),) * 2)
    for body in range(3):
        J[3 * body, 3 * body + 1], J[3 * body + 1, 3 * body] = -1.0, 1.0
    turn = 2.0 / N * (np.outer(np.sin(psi), np.cos(psi)) - np.outer(np.cos(psi), np.sin(psi)))
    for axis in range(3):
        J[9 + axis :: 3, 9 + axis :: 3] = turn
    return J


def test_one_stage_is_the_planar_problem():
    one = two_stages().stages[0]
    train = MultistageSet(stages=(one,), couplings=(), input=Member(1, "sun"), output=Member(1, "carrier"))
    wave = phased_series([0.2, 0.1j], [0.2, 0.1], one.phases, mean=one.data.mesh_stiffness)
    meshes = mesh_elements(one.data, stiffness=wave, backlash=4e-5)
    ours = multistage_problem(train, meshes={1: meshes}, torque=300.0, damping=0.04)
    alone = gear_set_problem(one.data, meshes=meshes, torque=PlanarTorque(300.0), damping=0.04)
    for name in ("M", "K", "C", "W", "load"):
        a, b = getattr(ours.system, name), getattr(alone.system, name)
        assert np.abs(a - b).max() <= 1e-9 * np.abs(b).max(), name
    pair = [solve_harmonic_balance(p, 2000.0, harmonics=5, stability=False) for p in (ours, alone)]
    assert pair[0].converged
    assert np.abs(pair[0].deflection - pair[1].deflection).max() < 1e-9 * np.abs(pair[1].deflection).max()


def test_suns_that_turn_backwards_run_through_the_mesh_from_its_end():
    train, speed = two_stages(), 90.0
    errors = {1: tooth_lines([3e-6 + 1e-6j], [2e-6], train.stages[0].phases)}
    there = error_response(train, speed, errors, damping_ratio=0.02)[1]
    mirrored = {1: errors[1].conj()}
    back = error_response(train, -speed, mirrored, damping_ratio=0.02)[1]
    assert back.deflection == pytest.approx(there.deflection)
    meshes = {1: linear_meshes(train.stages[0], errors[1])}
    plain = two_stages(lateral=0.0)
    problems = (multistage_problem(plain, meshes=meshes, speed=one) for one in (speed, -speed))
    orders = [problem.elements[0].deflection.orders for problem in problems]
    assert orders == [(1, 0), (-1, 0)]
