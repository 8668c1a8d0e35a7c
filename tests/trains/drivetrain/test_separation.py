"""Meshes that separate: flight and impact in closed form, other integrators, balances, the statuses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from drivetrain_references import held_pair, mesh_force
from published.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain

from femgear.errors import CaseError
from femgear.solvers.time.transient import solve_transient
from femgear.trains.drivetrain import integrator
from femgear.trains.drivetrain.integrator import solve_overlaps
from femgear.trains.drivetrain.model import (
    balanced_torque,
    drivetrain_model,
    drivetrain_problem,
    torsional_model,
)
from femgear.trains.drivetrain.parts import (
    TorqueHistory,
    constant_torques,
)
from femgear.trains.drivetrain.simulation import Records, march_drivetrain

K, BACKLASH = 2e8, 1e-4


def approach_of(model):
    """Direction (n,) of the approach, and the mass of the mesh [kg]."""
    w = model.system.W[:, 0]
    return w, 1.0 / float(w @ np.linalg.solve(model.system.M, w))


def moving(model, speed):
    """Start without approach, its rate `speed`."""
    w, mass = approach_of(model)
    return np.zeros(len(w)), np.linalg.solve(model.system.M, w) * mass * speed


def bounce(times, speed, load, k, mass):
    """Free flight (a parabola) and contact (half a sine about the static deflection), again and again."""
    w, deflection = math.sqrt(k / mass), load / k
    flight = 2.0 * speed * mass / load
    angle = 2.0 * math.pi - 2.0 * math.atan(speed / (w * deflection))
    t = times % (flight + angle / w)
    s = t - flight
    contact = deflection * (1.0 - np.cos(w * s)) + speed / w * np.sin(w * s)
    return np.where(t < flight, -speed * t + 0.5 * load / mass * t**2, contact), flight, angle / w


def test_flight_and_impact_in_closed_form():
    model, speed, load = held_pair(), 0.1, 5000.0
    _, mass = approach_of(model)
    radius = 0.05 * math.cos(math.radians(20.0))
    torques = constant_torques(balanced_torque(model, "a", load * radius, "b"))
    _, flight, contact = bounce(np.zeros(1), speed, load, K, mass)
    assert flight > 0.3 * contact
    errors = []
    for steps in (200, 400, 800):
        run = march_drivetrain(
            model,
            torques,
            duration=3.2 * (flight + contact),
            step=(flight + contact) / steps,
            speed=10.0,
            start=moving(model, -speed),
            contact_loss=True,
        )
        wanted = bounce(run.time, speed, load, K, mass)[0]
        errors.append(np.abs(run.approach[:, 0] - wanted).max() / np.ptp(wanted))
        assert run.energy_balance.error < 1e-10 and run.momentum < 1e-10
        assert run.lost[0] == pytest.approx(np.mean(wanted < 0.0), abs=2.0 / steps)
        assert run.force.min() == 0.0 and run.pulling[0] == 0.0
    assert errors[2] < 5e-5 and errors[2] < errors[0] / 10.0


def test_back_flanks_in_closed_form():
    """Without load: half sines at both flanks, the backlash crossed at constant speed."""
    model, speed = held_pair(backlash=BACKLASH), 0.05
    mass = approach_of(model)[1]
    w = math.sqrt(K / mass)
    half, cross = math.pi / w, BACKLASH / speed
    period = 2.0 * (half + cross)
    errors = []
    for steps in (500, 2000):
        run = march_drivetrain(
            model,
            (),
            duration=4.0 * period,
            step=period / steps,
            speed=10.0,
            start=moving(model, speed),
            contact_loss=True,
        )
        t = run.time % period
        force = np.where(t < half, np.sin(w * t), 0.0)
        back = (t > half + cross) & (t < period - cross)
        force = K * speed / w * np.where(back, -np.sin(w * (t - half - cross)), force)
        errors.append(np.abs(run.force[:, 0] - force).max() / force.max())
        assert run.lost[0] == pytest.approx(2.0 * cross / period, abs=2.0 / steps)
        assert run.pulling[0] == pytest.approx(half / period, abs=2.0 / steps)
        assert run.energy_balance.error < 1e-10
    assert errors[1] < 1e-3 and errors[1] < errors[0] / 10.0


def test_free_motion_keeps_its_energy_to_the_square_of_the_step():
    """The balance is exact; energy is lost or won only where a step crosses a border of the contact."""
    model, speed, found = held_pair(backlash=BACKLASH), 0.05, []
    w, mass = approach_of(model)
    for steps in (50, 200, 800):
        h = 2.0 * math.pi / math.sqrt(K / mass) / steps
        run = march_drivetrain(
            model,
            (),
            duration=30 * steps * h,
            step=h,
            speed=10.0,
            start=moving(model, speed),
            outputs=model.system.dofs,
            contact_loss=True,
        )
        overlap = np.maximum(run.approach, 0.0) + np.maximum(-run.approach - BACKLASH, 0.0)
        energy = 0.5 * mass * (run.velocity @ w) ** 2 + 0.5 * K * overlap[:, 0] ** 2
        found.append(np.abs(energy / energy[0] - 1.0).max())
        assert run.energy_balance.error < 1e-9
    assert found[2] < 1e-3 and found[2] < found[1] / 8.0 and found[1] < found[0] / 8.0


def parting(build):
    """The wind turbine, torques set in suddenly: meshes without contact for up to a quarter of the time."""
    model = build(wind_turbine_drivetrain())
    torques, speed = paper_torques(balanced=True), PRINTED.speed
    return model, torques, speed, drivetrain_problem(model, torques=torques, separates=True, speed=speed)


def marched(model, torques, speed, _, *, step, every=1, duration, start="zero"):
    return march_drivetrain(
        model,
        constant_torques(torques),
        duration=duration,
        step=step,
        records=Records(every),
        speed=speed,
        start=start,
        outputs=model.system.dofs,
        contact_loss=True,
    )


def test_same_steps_by_the_general_integrator():
    model, _, speed, problem = case = parting(drivetrain_model)
    run, zero = marched(*case, step=1e-4, duration=0.05), np.zeros(len(model.rigid))
    other = solve_transient(problem, model.frequencies(speed), run.time, start=(zero, zero), step=1e-4)
    assert run.lost.max() > 0.15 and other.converged
    size = np.abs(other.displacement).max(axis=0) + 1e-3 * np.abs(other.displacement).max()
    assert (np.abs(run.motion - other.displacement) / size).max() < 1e-5


def test_adaptive_integrator_and_order():
    """Forces of every mesh over the first contact losses; errors fall with the square of the step."""
    model, _, speed, problem = case = parting(torsional_model)
    # gear 3 thrown back, the common spin left out
    thrown = -0.5 * np.eye(len(model.rigid))[model.index("gear 3: rotation")]
    thrown -= model.rigid * (model.rigid @ model.system.M @ thrown) / model.inertia
    start = np.zeros(len(thrown)), thrown
    runs = [marched(*case, step=1e-4 / n, every=n, duration=0.02, start=start) for n in (16, 64)]
    exact = solve_transient(
        problem, model.frequencies(speed), runs[0].time, start=start, method="DOP853", tolerance=1e-10
    )
    wanted = forces_of(model, speed, runs[0].time, exact.displacement)
    assert (wanted == 0.0).mean(axis=0).max() > 0.15
    coarse, fine = (np.abs(r.force - wanted).max(axis=0) / np.abs(wanted).max(axis=0) for r in runs)
    # the stiff mesh of gears 1 and 2 swings at 2.2 kHz
    assert np.all(np.delete(fine, 6) < 1e-4) and fine[6] < 3e-4
    assert np.all(fine < coarse / 10.0)


def forces_of(model, speed, times, q):
    from femgear.system.fourier import FourierSeries

    theta = times[:, None] * model.frequencies(speed)
    x = np.einsum("tmj,tm->tj", model.geometry.selection(theta[:, :2:2]), q @ model.geometry.basic)
    k = np.empty_like(x)
    for base in np.unique(model.mesh_base):
        own = model.mesh_base == base
        k[:, own] = FourierSeries(model.stiffness[own]).at(theta[:, base : base + 1])
    return mesh_force(x, k, model.backlash, separates=True)[0]


def test_no_loss_of_contact_is_the_linear_march():
    """Under a load that never parts the flanks both marches are one."""
    train = replace(wind_turbine_drivetrain(), damping_ratio=0.1)
    model, runs = drivetrain_model(train, harmonics=2), []
    torques = constant_torques(paper_torques(balanced=True))
    for contact_loss in (False, True):
        runs.append(
            march_drivetrain(model, torques, duration=0.5, step=1e-4, speed=PRINTED.speed, contact_loss=contact_loss)
        )
    assert runs[1].lost.max() == 0.0 and runs[1].force.min() > 0.0
    assert np.abs(runs[0].force - runs[1].force).max() < 1e-9 * runs[0].force.max()
    assert runs[0].growth == pytest.approx(runs[1].growth, rel=1e-9)


def brute_force(flexibility, free, k):
    """All 2^n sets of contacts; those that fit."""
    n = len(k)
    closed = np.arange(2**n)[:, None] // 2 ** np.arange(n) % 2 == 1
    slope = np.where(closed, k, 0.0)
    u = np.linalg.solve(np.eye(n) + flexibility * slope[:, None, :], np.tile(free, (2**n, 1))[..., None])[..., 0]
    return u[np.where(closed, u >= 0.0, u < 0.0).all(axis=1)]


@pytest.mark.parametrize("skew", [0.0, 1.0])
def test_contacts_against_all_there_are(skew, monkeypatch):
    """Flexibilities with and without a skew part, of full and low rank: one solution, found on both ways."""
    random = np.random.default_rng(3)
    for trial in range(60):
        n = 7
        root, turn = random.standard_normal((2, n, n))
        root[:, 2 + trial % 6 :] = 0.0
        G = root @ root.T + skew * (turn - turn.T)
        k, free = 10.0 ** random.uniform(-1, 2, n), random.standard_normal(n)
        (wanted,) = brute_force(G, free, k)
        size, first = np.abs(free).max() + np.abs(wanted).max(), random.integers(0, 2, n) == 1
        assert np.abs(solve_overlaps(G, free, first, k)[0] - wanted).max() < 1e-9 * size
        with monkeypatch.context() as patch:
            patch.setattr(integrator, "_ROUNDS", 0)
            assert np.abs(solve_overlaps(G, free, first, k)[0] - wanted).max() < 1e-9 * size


def test_static_start_with_meshes_that_part():
    """Weight opens meshes of the unloaded set: forces are in balance, and nothing moves."""
    train = replace(wind_turbine_drivetrain(), damping_ratio=0.02)
    model = drivetrain_model(train, harmonics=0, turning=False)
    torques = constant_torques(balanced_torque(model, "rotor", 300.0, "generator"))
    run = march_drivetrain(
        model,
        torques,
        duration=0.2,
        step=1e-4,
        speed=PRINTED.speed,
        outputs=model.system.dofs,
        contact_loss=True,
    )
    q, k = run.motion[0], model.mean_stiffness
    x = model.geometry.frozen.T @ q
    force = mesh_force(x, k, model.backlash, separates=True)[0]
    load = model.system.load.copy()
    for one in torques:
        load[model.index(f"{one.body}: rotation")] += one.values[0]
    rest = model.system.K @ q + model.geometry.frozen @ force - load
    assert (force == 0.0).any() and np.abs(rest).max() < 1e-6 * np.abs(load).max()
    assert np.abs(run.motion - q).max() < 1e-9 * np.abs(q).max()


def test_static_start_on_back_flanks():
    load = 5000.0
    for backlash in (BACKLASH, math.inf):
        model = held_pair(backlash=backlash)
        radius = 0.05 * math.cos(math.radians(20.0))
        torques = constant_torques(balanced_torque(model, "a", -load * radius, "b"))
        options = {"duration": 0.01, "step": 1e-5, "speed": 10.0, "contact_loss": True}
        if math.isinf(backlash):
            with pytest.raises(CaseError, match="E-START"):
                march_drivetrain(model, torques, **options)
            continue
        run = march_drivetrain(model, torques, **options)
        assert run.force == pytest.approx(-load, rel=1e-9)
        assert run.approach == pytest.approx(-BACKLASH - load / K, rel=1e-9)
        assert run.pulling[0] == 1.0 and run.lost[0] == 0.0


def test_energy_balances_through_torque_reversals():
    """Flanks change sides under torques that alternate; a chain of two stages with a shaft."""
    model = drivetrain_model(wind_turbine_drivetrain())
    balanced, times = paper_torques(balanced=True), [0.0, 0.3, 0.6, 0.9]
    waves = [TorqueHistory(body, times, np.array([1.0, -1.0, 1.0, -1.0]) * t) for body, t in balanced.items()]
    run = march_drivetrain(
        model, waves, duration=1.0, step=1e-4, speed=PRINTED.speed, contact_loss=True, records=Records(10)
    )
    assert run.energy_balance.error < 1e-9 and run.momentum < 1e-9
    assert run.pulling.min() > 0.1 and run.lost.min() > 0.05


def test_growth_of_separating_meshes_is_that_of_their_tangents():
    """Two motions that start side by side come together, impacts included, as the exponent says."""
    model = held_pair(damping=0.01, backlash=BACKLASH, harmonics=1)
    w = math.sqrt(K / approach_of(model)[1])
    radius = 0.05 * math.cos(math.radians(20.0))
    torques = constant_torques(balanced_torque(model, "a", 2000.0 * radius, "b"))
    step = 2.0 * math.pi / w / 100.0
    (q, v), runs = moving(model, 0.02), []
    for extra in (0.0, 1e-4):
        runs.append(
            march_drivetrain(
                model,
                torques,
                duration=16_000 * step,
                step=step,
                speed=2.0 * w / 20,
                records=Records(20),
                start=(q, v * (1.0 + extra)),
                contact_loss=True,
            )
        )
    assert runs[0].lost[0] > 0.02
    moved, speeds = (np.abs(a - b)[:, 0] for a, b in zip(*((r.motion, r.velocity) for r in runs)))
    apart = moved + speeds / w
    late = slice(100, 800)
    slope = np.polyfit(runs[0].time[late], np.log(apart[late]), 1)[0]
    assert runs[0].growth == pytest.approx(slope, rel=0.02)
