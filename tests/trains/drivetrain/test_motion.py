"""Motion of the drivetrain: balances, other integrators, harmonic balance, spectra, torques."""

import math
from dataclasses import replace

import numpy as np
import pytest
from drivetrain_references import mesh_force, planetary_stage
from published.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain

from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.time.transient import solve_transient
from femgear.system.fourier import FourierSeries, distinct_lines
from femgear.trains.drivetrain.model import (
    balanced_torque,
    drivetrain_model,
    drivetrain_problem,
    torsional_model,
)
from femgear.trains.drivetrain.parts import TorqueHistory, constant_torques
from femgear.trains.drivetrain.simulation import Records, march_drivetrain
from femgear.trains.drivetrain.stages import angle_spectrum, averaged_spectrum

TRAIN = wind_turbine_drivetrain()


def test_momentum_energy_and_drift():
    model = drivetrain_model(TRAIN)
    torques = (
        TorqueHistory("rotor", [0.0, 0.5, 1.0], [0.0, 2e4, 1e4]),
        *constant_torques({"generator": -100.0}),
    )
    run = march_drivetrain(model, torques, duration=1.0, step=1e-4, speed=0.6, start="zero")
    assert run.momentum < 1e-9 and run.energy_balance.error < 1e-6
    assert run.energy_balance.damping > 0.0
    assert run.drift < 1e-12
    # the spin by hand: J w' = T_r + i T_g
    impulse = 0.25 * 2e4 + 0.5 * 1.5e4 - 100.0 * model.ratio["generator"]
    assert run.spin_speed[-1] - 0.6 == pytest.approx(impulse / model.inertia, rel=1e-9)


def test_march_against_the_general_integrator():
    """The same steps by `solve_transient` on the same meshes, and far finer adaptive ones."""
    model = drivetrain_model(TRAIN)
    torques, speed, step = paper_torques(balanced=True), PRINTED.speed, 1e-4
    run = march_drivetrain(model, constant_torques(torques), duration=0.05, step=step, speed=speed, start="zero")
    problem = drivetrain_problem(model, torques=torques, speed=speed)
    zero = np.zeros(len(model.rigid))
    other = solve_transient(problem, model.frequencies(speed), run.time, start=(zero, zero), step=step)
    chosen = [model.index(name) for name in run.outputs]
    assert np.abs(run.motion - other.displacement[:, chosen]).max() < 1e-6 * np.abs(run.motion).max()
    fine = march_drivetrain(
        model,
        constant_torques(torques),
        duration=0.05,
        step=step / 16,
        records=Records(16),
        speed=speed,
        start="zero",
    )
    exact = solve_transient(
        problem, model.frequencies(speed), run.time, start=(zero, zero), method="DOP853", tolerance=1e-8
    )
    size = np.abs(exact.displacement[:, chosen]).max()
    assert np.abs(fine.motion - exact.displacement[:, chosen]).max() < 2e-3 * size


def settled_forces(model, torques, speed, times):
    """Mesh forces (n_times, n_meshes) of harmonic balance over the turn and the mesh; its start (q, v)."""
    problem = drivetrain_problem(model, torques=torques, speed=speed)
    orders = distinct_lines([[turn, mesh] for mesh in range(15) for turn in range(-3, 4)])
    frequency = model.frequencies(speed)
    found = solve_harmonic_balance(problem, frequency, orders=orders, samples=(16, 48), stability=False)
    assert found.converged
    theta = times[:, None] * frequency
    approach = np.einsum("tmj,tm->tj", model.geometry.selection(theta[:, :1]), found.at(times))
    lines = displacements(problem, found)
    start = lines.sum(axis=1).real, (1j * found.line_frequency * lines).sum(axis=1).real
    return approach * FourierSeries(model.stiffness).at(theta[:, 1:]), start


def test_integration_against_harmonic_balance():
    """The general solver samples both bases; the run begins on its motion and stays there."""
    model = drivetrain_model(replace(planetary_stage(), damping_ratio=0.05, gravity=9.81), harmonics=2)
    torques, speed, step = balanced_torque(model, "carrier", 15000.0, "sun"), 1.0, 2e-5
    times = 5 * step * np.arange(4001)
    force, start = settled_forces(model, torques, speed, times)
    run = march_drivetrain(
        model,
        constant_torques(torques),
        duration=times[-1],
        step=step,
        records=Records(5),
        speed=speed,
        start=start,
    )
    assert np.abs(run.force - force).max() < 1e-3 * np.ptp(force)


def test_bending_alone_gives_side_bands_of_the_turn():
    """Weight displaces carrier and sun in the fixed frame, where the planets pass: only then f_p +- turn."""
    train = replace(planetary_stage(), damping_ratio=0.05, gravity=9.81)
    # the mesh has 184 periods in a turn
    teeth, seen, times = train.planetary[0].ring_teeth, {}, 2.0 * np.pi * np.arange(32 * 184) / (32 * 184)
    for text, model in (
        ("bending", drivetrain_model(train, harmonics=3)),
        ("torsion", torsional_model(train, harmonics=3)),
    ):
        force = settled_forces(model, balanced_torque(model, "carrier", 15000.0, "sun"), 1.0, times)[0]
        lines = 2.0 * np.abs(np.fft.rfft(force[:, 0])) / len(times)
        seen[text] = lines[[teeth, teeth + 1, teeth - 1]]
    assert seen["bending"][1:].min() > 1e-3 * seen["bending"][0]
    assert seen["torsion"][1:].max() < 1e-9 * seen["torsion"][0]


def test_backlash_takes_the_pulling_forces_away():
    model = drivetrain_model(TRAIN)
    zero, times = np.zeros(len(model.rigid)), np.arange(0.0, 0.02, 2e-4)
    lowest = []
    for separates in (False, True):
        problem = drivetrain_problem(model, torques=paper_torques(), separates=separates)
        run = solve_transient(problem, model.frequencies(0.6), times, start=(zero, zero), step=2e-4)
        assert run.converged
        stage = problem.elements[1]
        x = (run.deflection[:, stage.columns] * stage.fixed).sum(axis=-1)
        k = stage.stiffness.at(times[:, None] * model.frequencies(0.6))
        lowest.append(mesh_force(x, k, math.inf, separates=separates)[0].min())
    assert lowest[0] < -1000.0
    assert lowest[1] >= 0.0


def near(spectrum, frequency, width):
    """Largest amplitude within ``frequency +- width``."""
    return spectrum.amplitude[np.abs(spectrum.frequency - frequency) <= width].max()


def test_spectrum_shows_amplitudes():
    step, times = 1e-3, np.arange(0, 20, 1e-3)
    signal = 3.0 + 2.0 * np.sin(2 * np.pi * 50 * times) + 0.1 * np.sin(2 * np.pi * 120 * times)
    found = averaged_spectrum(signal, step, resolution=0.5)
    assert near(found, 50.0, 0.3) == pytest.approx(2.0, rel=1e-6)
    assert near(found, 120.0, 0.3) == pytest.approx(0.1, rel=1e-6)
    assert found.bandwidth == pytest.approx(0.5 * 1.5, rel=2e-3)
    assert found.segments == 19 and found.resolution == pytest.approx(0.5)


def test_order_tracking_through_a_run_up():
    times = np.arange(0.0, 10.0, 1e-3)
    angle = 2 * np.pi * (1.0 * times + 0.2 * times**2)
    signal = np.cos(7.0 * angle)
    tracked = angle_spectrum(signal, angle, resolution=0.25, per_turn=64)
    assert near(tracked, 7.0, 0.01) == pytest.approx(1.0, rel=1e-4)
    assert averaged_spectrum(signal, 1e-3, resolution=0.25).amplitude.max() < 0.5
