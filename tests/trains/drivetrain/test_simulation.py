"""Meshes that separate: flight and impact in closed form, other integrators, balances, the statuses."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from drivetrain_references import held_pair, mesh_force
from published.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.stability.parametric import stability
from femgear.solvers.time.transient import solve_transient
from femgear.system.system import MeshExcitation
from femgear.trains.drivetrain import integrator
from femgear.trains.drivetrain.integrator import solve_overlaps
from femgear.trains.drivetrain.model import (
    balanced_torque,
    drivetrain_model,
    drivetrain_problem,
    torsional_model,
)
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    TorqueHistory,
    constant_torques,
)
from femgear.trains.drivetrain.simulation import PIECE, Decimator, FreeMotion, Records, march_drivetrain

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


@pytest.mark.slow
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


# Growth of the free motion: Floquet and Mathieu exponents, decay, refusal of what outgrows the numbers.


TEETH, HARMONICS = 20, 3


def pair(*, harmonics=HARMONICS, **options):
    return held_pair(harmonics=harmonics, teeth=TEETH, **options)


def natural(model) -> float:
    return 2.0 * math.pi * float(undamped_modes(model.still, model.mean_stiffness).frequency[-1])


def run_at(model, ratio, *, periods=100, steps=100, torques=(), **options):
    """The pair at a mesh frequency `ratio` times the natural one."""
    mesh = ratio * natural(model)
    period = 2.0 * math.pi / mesh
    return march_drivetrain(
        model, torques, duration=periods * period, step=period / steps, speed=mesh / TEETH, **options
    )


def exponent(model, ratio, damping) -> float:
    """Logarithm of the largest multiplier over the period [1/s], equation and integrator apart from ours."""
    w = natural(model)
    period = 2.0 * math.pi / (ratio * w)
    wave = model.stiffness[0] / model.mean_stiffness[0]

    def rate(t, y):
        k = (wave * np.exp(2j * np.pi * np.arange(HARMONICS + 1) * t / period)).sum().real
        return np.concatenate([y[2:], -2.0 * damping * w * y[2:] - w * w * k * y[:2]])

    found = solve_ivp(rate, (0.0, period), [1.0, 0.0, 0.0, 1.0], rtol=1e-11, atol=1e-12, method="DOP853")
    return math.log(np.abs(np.linalg.eigvals(found.y[:, -1].reshape(2, 2))).max()) / period


@pytest.mark.parametrize(("ratio", "damping"), [(2.0, 0.0), (1.97, 0.01), (2.3, 0.01)])
def test_growth_is_the_floquet_exponent(ratio, damping):
    model = pair(damping=damping)
    growth = run_at(model, ratio, periods=150, steps=200, start="zero").growth
    assert growth == pytest.approx(exponent(model, ratio, damping), rel=1e-3)
    modes = undamped_modes(model.still, model.mean_stiffness)
    modes = replace(modes, damping_ratio=np.array([0.0, damping]))
    k = (model.stiffness @ np.exp(2j * np.pi * np.outer(np.arange(HARMONICS + 1), np.arange(64)) / 64)).real
    excitation = MeshExcitation(k, 0.0 * k, 0.0 * k, np.array([np.inf]))
    mesh = ratio * natural(model) / (2.0 * np.pi)
    (multiplier,) = stability(modes, excitation, mesh, excitation_harmonics=HARMONICS).modulus
    assert growth == pytest.approx(math.log(multiplier) * mesh, rel=1e-3)


def test_growth_errs_with_the_square_of_the_step():
    model = pair(damping=0.01)
    wanted = exponent(model, 2.05, 0.01)
    coarse, fine = (run_at(model, 2.05, periods=300, steps=s).growth - wanted for s in (50, 100))
    assert 3.5 < coarse / fine < 4.5 and abs(fine) < 1e-2 * wanted


def test_borders_of_the_principal_instability():
    """Mathieu's equation: a = 4 / ratio^2, q = 2 share / ratio^2 between b_1 and a_1 grow."""
    model = pair(harmonics=1)
    share = abs(model.stiffness[0, 1]) / model.mean_stiffness[0]
    borders = [brentq(lambda r, f=f: 4.0 / r**2 - f(1, 2.0 * share / r**2), 1.5, 2.5) for f in (mathieu_a, mathieu_b)]
    assert borders[1] - borders[0] == pytest.approx(share, rel=0.02)
    w = natural(model)
    peak = run_at(model, 2.0).growth
    # the middle of the region: share w / 4 to the first order
    assert peak == pytest.approx(0.25 * share * w, rel=0.01)
    for border, way in zip(borders, (1.0, -1.0)):
        inside = run_at(model, border + 0.003 * way, periods=900, steps=50).growth
        outside = run_at(model, border - 0.003 * way, periods=900, steps=50).growth
        assert inside > 0.2 * peak and abs(outside) < 0.01 * peak


def test_constant_stiffness_decays_with_the_slowest_mode():
    train = replace(wind_turbine_drivetrain(), damping_ratio=0.05)
    model = torsional_model(train, harmonics=0)
    modes = undamped_modes(model.still, model.mean_stiffness)
    slowest = 0.05 * 2.0 * math.pi * modes.frequency[1]
    run = march_drivetrain(model, (), duration=60.0, step=2e-3, speed=0.6, outputs=())
    assert run.growth == pytest.approx(-slowest, rel=1e-3)
    assert np.all(run.lost == 0.0) and not run.contact_loss


def test_a_motion_that_outgrows_the_numbers_is_refused_at_once():
    model = pair(backlash=1e-4)
    torques = constant_torques(balanced_torque(model, "a", 500.0, "b"))
    with pytest.raises(ConvergenceError, match="E-DIVERGED") as caught:
        run_at(model, 2.0, periods=5000, torques=torques)
    text, growth = str(caught.value), exponent(model, 2.0, 0.0)
    assert "mesh a-b" in text and "contact_loss = true" in text and f"{growth:.2g}"[:2] in text
    time = float(text.split("t = ")[1].split(" s")[0])
    # ten decades over the speed, 16 digits: the balances go after some 25 to 45 / growth
    assert 15.0 / growth < time < 60.0 / growth
    # real meshes part and the motion stays bounded
    run = run_at(model, 2.0, periods=1000, torques=torques, contact_loss=True)
    assert run.contact_loss and run.lost[0] > 0.02 and run.energy_balance.error < 1e-9 and run.momentum < 1e-9
    assert run.extremes[1, 0] < 10.0 * 500.0 / (0.05 * math.cos(math.radians(20.0)))


def test_a_growing_motion_that_is_still_accurate_passes():
    model = pair()
    torques = constant_torques(balanced_torque(model, "a", 500.0, "b"))
    run = run_at(model, 2.0, periods=100, torques=torques)
    assert run.growth > 50.0 and run.energy_balance.error < 1e-9
    assert run.extremes[1, 0] > 1e5


def test_the_free_motion_does_not_see_the_loads():
    model = drivetrain_model(wind_turbine_drivetrain())
    found = [
        march_drivetrain(model, torques, duration=0.3, step=1e-4, speed=PRINTED.speed, start="zero").growth
        for torques in ((), constant_torques({"rotor": 1e4, "generator": -1e4 / model.ratio["generator"]}))
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def test_nothing_but_the_spin_has_no_growth():
    train = Drivetrain(
        (BodySection.in_si(name="a", mass=10.0, inertia=0.2, tilts=False),),
        bearings=(BearingSection.in_si(body="a", radial=math.inf),),
    )
    run = march_drivetrain(drivetrain_model(train), constant_torques({"a": 1.0}), duration=0.1, step=1e-3, speed=1.0)
    assert math.isnan(run.growth) and run.spin_speed[-1] == pytest.approx(1.5)


@pytest.mark.slow
def test_gain_of_a_run_through_a_resonance():
    """The same sweep of the equation of the one elastic coordinate, by another method; the mean decays."""
    damping, ends, duration, step = 0.01, (1.85, 2.6), 1.0, 1e-5
    model, w = pair(damping=damping), natural(pair())
    first, last = np.array(ends) * w
    torque = constant_torques({"a": (last - first) / TEETH / duration * model.inertia})
    run = march_drivetrain(model, torque, duration=duration, step=step, speed=first / TEETH, outputs=())
    wave = (w * w * model.stiffness[0] / model.mean_stiffness[0]).tolist()

    def stiffness(t):
        turn = cmath.exp(1j * (first * t + 0.5 * (last - first) * t * t / duration))
        return sum((value * turn**order).real for order, value in enumerate(wave))

    def rate(t, y):
        return [y[1], -2.0 * damping * w * y[1] - stiffness(t) * y[0]]

    times = np.arange(0.0, duration, PIECE * step)
    x, v = solve_ivp(rate, (0.0, duration), [0.0, 1.0], t_eval=times, rtol=1e-9, atol=1e-13, method="DOP853").y
    sizes = 0.5 * np.log(v * v + np.array([stiffness(t) for t in times.tolist()]) * x * x)
    wanted = (sizes - np.minimum.accumulate(sizes)).max()
    assert math.log(run.gain) == pytest.approx(wanted, rel=5e-3) and wanted > math.log(1e3)
    assert run.growth < -10.0


def test_gain_without_resonance_is_small():
    model = pair(damping=0.02)
    assert 1.0 <= run_at(model, 1.5).gain < 2.0
    assert run_at(pair(), 2.0, periods=150).gain > 1e3


def test_gain_follows_the_sizes():
    free = FreeMotion.__new__(FreeMotion)
    free.sizes = [0.0, -3.0, 1.0, -5.0, -2.0, 700.0, 710.0]
    assert free.gain() == math.inf
    free.sizes = [0.0, -3.0, 1.0, -5.0, -2.0]
    assert free.gain() == pytest.approx(math.exp(4.0))
    free.sizes = [0.0, -math.inf]
    assert math.isnan(free.gain())


# Low-passed records at the ends of a run: what is kept, what does not fold back.


EVERY, COUNT = 20, 6000


def records(columns, *, every=EVERY, block=700):
    table = np.stack(columns, axis=1)
    decimator = Decimator(every, len(table) - 1)
    return np.vstack([decimator.push(table[i : i + block]) for i in range(0, len(table), block)])


def tones(share):
    """Tones of eight phases at a share of half the record rate, (steps, 8)."""
    angle = np.pi * share / EVERY * np.arange(COUNT + 1)
    return [np.cos(angle + phase) for phase in np.linspace(0.0, np.pi, 9)[:-1]]


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize(("share", "kept"), [(2.0, 0.37), (6.0, 0.12), (12.0, 0.07)])
def test_ends_do_not_fold_back(share, kept):
    """The raw step has 0.71 of a tone of amplitude one."""
    wave = tones(share)
    found, raw = records(wave), np.stack(wave, axis=1)[::EVERY]
    ends = [0, -1]
    assert rms(raw[ends]) == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert rms(found[ends]) < kept and rms(found[[1, 2, 3, -2, -3, -4]]) < 0.05 and rms(found[30:-30]) < 1e-4


@pytest.mark.parametrize(("share", "missed"), [(0.1, 3e-3), (0.3, 0.06), (0.5, 0.21)])
def test_ends_keep_slow_motion(share, missed):
    wave = tones(share)
    error = records(wave) - np.stack(wave, axis=1)[::EVERY]
    assert rms(error[[0, -1]]) < missed and rms(error[[1, -2]]) < 0.25 * missed and rms(error[30:-30]) < 1e-4


@pytest.mark.parametrize("count", [1, 2, 3, 19, 20, 21, 40, 250, 1201])
def test_constants_and_ramps_pass_in_short_runs(count):
    steps = np.arange(count + 1.0)
    columns = [np.full(count + 1, 7.0), 3.0 - 0.5 * steps]
    found = records(columns, block=17)
    assert found.shape == (count // EVERY + 1, 2)
    assert np.abs(found - np.stack(columns, axis=1)[::EVERY]).max() < 1e-11 * count
