"""Meshes that separate: flight and impact in closed form, other integrators, balances, growth of the free motion."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b
from two_wheels import RADII, STIFFNESS, TEETH, TwoWheels, two_wheels

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.time.flank_motion import PIECE, FreeMotion, Records, march_flanks
from femgear.solvers.time.free_turn import TorqueHistory
from femgear.solvers.time.spun_system import BACK, DRIVE, ContactGroup, SpunSystem, spun_system
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, RadialBearings
from femgear.system.fourier import FourierSeries
from femgear.system.system import MechanicalSystem, NonlinearSystem

BACKLASH = 1e-4


def torques(load: float):
    """Torques that press the drive flanks with a force [N]."""
    return [(TorqueHistory(name, [0.0], [load * r]), row) for name, r, row in zip("ab", RADII, np.eye(2), strict=True)]


def mesh_mass(wheels: TwoWheels) -> float:
    return STIFFNESS / wheels.natural**2


def moving(wheels: TwoWheels, speed: float):
    """Start without approach, its rate a speed [m/s]."""
    w = np.array(RADII)
    return np.zeros(2), np.linalg.solve(wheels.spun.system.M, w) * mesh_mass(wheels) * speed


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
    wheels, speed, load = two_wheels(), 0.1, 5000.0
    mass = mesh_mass(wheels)
    _, flight, contact = bounce(np.zeros(1), speed, load, STIFFNESS, mass)
    assert flight > 0.3 * contact
    errors = []
    for steps in (200, 400, 800):
        known = {"duration": 3.2 * (flight + contact), "step": (flight + contact) / steps, "speed": 10.0}
        run = march_flanks(wheels.spun, torques(load), start=moving(wheels, -speed), contact_loss=True, **known)
        wanted = bounce(run.time, speed, load, STIFFNESS, mass)[0]
        errors.append(np.abs(run.approach[:, 0] - wanted).max() / np.ptp(wanted))
        assert run.energy_balance.error < 1e-10 and run.momentum < 1e-10
        assert run.lost[0] == pytest.approx(np.mean(wanted < 0.0), abs=2.0 / steps)
        assert run.force.min() == 0.0 and run.pulling[0] == 0.0
    assert errors[2] < 5e-5 and errors[2] < errors[0] / 10.0


def test_back_flanks_in_closed_form():
    """Without load: half sines at both flanks, the backlash crossed at constant speed."""
    wheels, speed = two_wheels(backlash=BACKLASH), 0.05
    w = wheels.natural
    half, cross = math.pi / w, BACKLASH / speed
    period = 2.0 * (half + cross)
    run = march_flanks(
        wheels.spun,
        duration=4.0 * period,
        step=period / 2000,
        speed=10.0,
        start=moving(wheels, speed),
        contact_loss=True,
    )
    t = run.time % period
    parts = [t < half, t < half + cross, t < 2.0 * half + cross]
    shapes = [
        speed / w * np.sin(w * t),
        -speed * (t - half),
        -BACKLASH - speed / w * np.sin(w * (t - half - cross)),
    ]
    wanted = np.select(parts, shapes, -BACKLASH + speed * (t - 2.0 * half - cross))
    assert np.abs(run.approach[:, 0] - wanted).max() < 2e-4 * np.ptp(wanted)
    assert run.pulling[0] == pytest.approx(half / period, abs=1e-3)
    assert run.lost[0] == pytest.approx(2.0 * cross / period, abs=2e-3)


@pytest.mark.parametrize("contact_loss", [False, True])
def test_gaps_that_vary_by_the_general_integrator(contact_loss):
    """Deflections over the mesh period, stiffness too: the same steps of average acceleration."""
    wheels = two_wheels(harmonics=3, damping=0.02, backlash=BACKLASH, gap=np.array([2e-6, 4e-6 - 3e-6j, 1e-6j]))
    load, mesh = 2000.0, 0.6 * wheels.natural
    step, count = 2.0 * math.pi / mesh / 200.0, 600
    known = {"duration": count * step, "step": step, "speed": mesh / TEETH, "start": "zero"}
    run = march_flanks(wheels.spun, torques(load), contact_loss=contact_loss, **known)
    series = FourierSeries(wheels.wave[None])
    deflection = FourierSeries(np.array([[2e-6, 4e-6 - 3e-6j, 1e-6j]]))
    meshes = GearMeshes(np.array([0]), series, deflection, backlash=np.inf, separates=contact_loss)
    system = wheels.spun.system
    loads = np.array(RADII) * load
    plain = MechanicalSystem(system.M, system.C, system.K, system.W[:, :1], loads, ("a", "b"))
    other = solve_transient(NonlinearSystem(plain, (meshes,)), mesh, run.time, step=step, tolerance=1e-12)
    wanted = other.displacement @ np.array(RADII)
    assert np.abs(run.approach[:, 0] - wanted).max() < 1e-6 * np.ptp(wanted)
    assert run.energy_balance.error < 1e-9 and (run.lost[0] > 0.0) == contact_loss


def test_static_start_closes_gaps_on_both_flanks():
    load = 5000.0
    for sign in (1.0, -1.0):
        wheels = two_wheels(backlash=BACKLASH, gap=np.array([3e-6]))
        known = {"duration": 0.01, "step": 1e-5, "speed": 10.0, "contact_loss": True}
        run = march_flanks(wheels.spun, torques(sign * load), **known)
        assert run.force == pytest.approx(sign * load, rel=1e-9)
        rest = 3e-6 + load / STIFFNESS if sign > 0.0 else -BACKLASH - load / STIFFNESS
        assert run.approach == pytest.approx(rest, rel=1e-9)
        assert run.pulling[0] == float(sign < 0.0) and run.lost[0] == 0.0
    with pytest.raises(CaseError, match="E-START"):
        march_flanks(two_wheels().spun, torques(-load), duration=0.01, step=1e-5, speed=10.0, contact_loss=True)


def wedged_pair(backlash: float):
    """Two bodies that move towards one another and turn: both flanks lean by 20 degrees."""
    s, c = math.sin(math.radians(20.0)), math.cos(math.radians(20.0))
    W = np.array([[s, s], [-s, -s], [0.05 * c, -0.05 * c], [0.1 * c, -0.1 * c]])
    K = np.diag([2e7, 1e8, 0.0, 0.0])
    M = np.diag([400.0, 160.0, 0.25, 18.0])
    system = MechanicalSystem(M, 10.0 * M * [1, 1, 0, 0], K, W, np.array([8000.0, 0.0, 0.0, 0.0]), tuple("xyab"))
    series = FourierSeries(np.array([[3e8]]))
    gaps = (0.0, backlash)
    groups = [
        ContactGroup(GearMeshes(np.array([i]), series, FourierSeries(np.array([[gap]]))), side, np.array([0]))
        for i, (side, gap) in enumerate(zip((DRIVE, BACK), gaps, strict=True))
    ]
    return spun_system(system, groups, ("mesh",), base_ratio=[1.0], shaft=np.eye(4)[2])


@pytest.mark.parametrize("torque", [0.0, 20.0, -20.0])
def test_teeth_wedge_under_a_radial_load(torque):
    """Statics of both flanks, written down: c x = load - s (f + g), f, g = k (s way +- t - gap)."""
    spun, k, s = wedged_pair(2e-5), 3e8, math.sin(math.radians(20.0))
    turning = [(TorqueHistory("a", [0.0], [n * torque]), np.eye(4)[n + 1]) for n in (1, 2)]
    run = march_flanks(spun, turning, duration=0.01, step=1e-5, speed=20.0, contact_loss=True)
    total = (2.0 * k * s * 8000.0 / 2e7 - k * 2e-5) / (1.0 + 2.0 * k * s**2 * (1.0 / 2e7 + 1.0 / 1e8))
    difference = torque / (0.05 * math.cos(math.radians(20.0)))
    assert total > abs(difference)
    assert run.force[:, 0] == pytest.approx(difference, rel=1e-6, abs=1e-6 * total)
    assert run.approach[:, 0] == pytest.approx(0.5 * (total + difference) / k, rel=1e-6)
    assert run.lost[0] == 0.0


def test_torques_drive_the_rotation_and_nothing_of_it_is_in_the_deviations():
    wheels = two_wheels(harmonics=2, damping=0.02)
    acting = [(TorqueHistory("a", [0.0, 0.5, 1.0], [0.0, 20.0, 10.0]), np.array([1.0, 0.0]))]
    run = march_flanks(wheels.spun, acting, duration=1.0, step=1e-4, speed=5.0, records=Records(100))
    assert run.momentum < 1e-9 and run.energy_balance.error < 1e-6 and run.drift < 1e-12
    # both wheels: I_a + I_b / 4; the second one turns at half the speed, backwards
    inertia = 0.2 + 0.9 / 4.0
    assert run.speed[-1] - 5.0 == pytest.approx((0.25 * 20.0 + 0.5 * 15.0) / inertia, rel=1e-9)
    assert wheels.spun.spin == pytest.approx([1.0, -0.5], rel=1e-12)


def test_growth_of_separating_meshes_is_that_of_their_tangents():
    """Two motions that start side by side come together, impacts included, as the exponent says."""
    wheels = two_wheels(damping=0.01, backlash=BACKLASH, harmonics=1)
    w = wheels.natural
    step = 2.0 * math.pi / w / 100.0
    (q, v), runs = moving(wheels, 0.02), []
    for extra in (0.0, 1e-4):
        known = {"duration": 16_000 * step, "step": step, "speed": 2.0 * w / 20, "records": Records(20)}
        runs.append(
            march_flanks(wheels.spun, torques(2000.0), start=(q, v * (1.0 + extra)), contact_loss=True, **known)
        )
    assert runs[0].lost[0] > 0.02
    moved, speeds = (np.abs(a - b)[:, 0] for a, b in zip(*((r.motion, r.velocity) for r in runs)))
    apart = moved + speeds / w
    late = slice(100, 800)
    slope = np.polyfit(runs[0].time[late], np.log(apart[late]), 1)[0]
    assert runs[0].growth == pytest.approx(slope, rel=0.02)


def run_at(wheels: TwoWheels, ratio: float, *, periods=100, steps=100, load=0.0, **options):
    """The wheels at a mesh frequency `ratio` times the natural one."""
    mesh = ratio * wheels.natural
    period = 2.0 * math.pi / mesh
    known = {"duration": periods * period, "step": period / steps, "speed": mesh / TEETH}
    return march_flanks(wheels.spun, torques(load), **known, **options)


def exponent(wheels: TwoWheels, ratio: float, damping: float) -> float:
    """Logarithm of the largest multiplier over the period [1/s], equation and integrator apart from ours."""
    w = wheels.natural
    period = 2.0 * math.pi / (ratio * w)
    wave = wheels.wave / STIFFNESS

    def rate(t, y):
        k = (wave * np.exp(2j * np.pi * np.arange(len(wave)) * t / period)).sum().real
        return np.concatenate([y[2:], -2.0 * damping * w * y[2:] - w * w * k * y[:2]])

    found = solve_ivp(rate, (0.0, period), [1.0, 0.0, 0.0, 1.0], rtol=1e-11, atol=1e-12, method="DOP853")
    return math.log(np.abs(np.linalg.eigvals(found.y[:, -1].reshape(2, 2))).max()) / period


@pytest.mark.parametrize(("ratio", "damping"), [(2.0, 0.0), (1.97, 0.01), (2.3, 0.01)])
def test_growth_is_the_floquet_exponent(ratio, damping):
    wheels = two_wheels(harmonics=3, damping=damping)
    growth = run_at(wheels, ratio, periods=150, steps=200, start="zero").growth
    assert growth == pytest.approx(exponent(wheels, ratio, damping), rel=1e-3)


def test_growth_errs_with_the_square_of_the_step():
    wheels = two_wheels(harmonics=3, damping=0.01)
    wanted = exponent(wheels, 2.05, 0.01)
    coarse, fine = (run_at(wheels, 2.05, periods=300, steps=s).growth - wanted for s in (50, 100))
    assert 3.5 < coarse / fine < 4.5 and abs(fine) < 1e-2 * wanted


def test_borders_of_the_principal_instability():
    """Mathieu's equation: a = 4 / ratio^2, q = 2 share / ratio^2 between b_1 and a_1 grow."""
    wheels = two_wheels(harmonics=1)
    share = abs(wheels.wave[1]) / STIFFNESS
    borders = [brentq(lambda r, f=f: 4.0 / r**2 - f(1, 2.0 * share / r**2), 1.5, 2.5) for f in (mathieu_a, mathieu_b)]
    peak = run_at(wheels, 2.0).growth
    # the middle of the region: share w / 4 to the first order
    assert peak == pytest.approx(0.25 * share * wheels.natural, rel=0.01)
    for border, way in zip(borders, (1.0, -1.0)):
        inside = run_at(wheels, border + 0.003 * way, periods=900, steps=50).growth
        outside = run_at(wheels, border - 0.003 * way, periods=900, steps=50).growth
        assert inside > 0.2 * peak and abs(outside) < 0.01 * peak


def test_a_motion_that_outgrows_the_numbers_is_refused_at_once():
    wheels = two_wheels(harmonics=3, backlash=1e-4)
    with pytest.raises(ConvergenceError, match="E-DIVERGED") as caught:
        run_at(wheels, 2.0, periods=5000, load=1e4)
    text, growth = str(caught.value), exponent(wheels, 2.0, 0.0)
    assert "mesh a-b" in text and "contact_loss = true" in text
    assert float(text.split("grows with ")[1].split(" ")[0]) == pytest.approx(growth, rel=0.02)
    time = float(text.split("t = ")[1].split(" s")[0])
    # ten decades over the speed, 16 digits: the balances go after some 25 to 45 / growth
    assert 15.0 / growth < time < 60.0 / growth
    # real meshes part and the motion stays bounded
    run = run_at(wheels, 2.0, periods=1000, load=1e4, contact_loss=True)
    assert run.contact_loss and run.lost[0] > 0.02 and run.energy_balance.error < 1e-9 and run.momentum < 1e-9
    assert run.extremes[1, 0] < 1e5


def test_nothing_but_the_rotation_has_no_growth():
    system = MechanicalSystem(np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 0)), np.zeros(1), ("a",))
    bare = replace(two_wheels().spun, system=system, spin=np.ones(1), basic=np.zeros((1, 0)), fixed=np.zeros((0, 0)))
    bare = replace(bare, even=np.zeros((0, 0, 0)), odd=np.zeros((0, 0, 0)), stiffness=np.zeros((1, 0)), meshes=())
    bare = replace(bare, gap=np.zeros((1, 0)), phase_ratio=np.zeros(0), side=np.zeros(0, int), mesh=np.zeros(0, int))
    run = march_flanks(bare, [(TorqueHistory("a", [0.0], [5.0]), np.ones(1))], duration=0.1, step=1e-3, speed=1.0)
    assert math.isnan(run.growth) and run.speed[-1] == pytest.approx(1.5)


@pytest.mark.slow
def test_gain_of_a_run_through_a_resonance():
    """The same sweep of the equation of the one elastic coordinate, by another method; the mean decays."""
    damping, ends, duration, step = 0.01, (1.85, 2.6), 1.0, 1e-5
    wheels = two_wheels(harmonics=3, damping=damping)
    w = wheels.natural
    first, last = np.array(ends) * w
    torque = TorqueHistory("a", [0.0], [(last - first) / TEETH / duration * wheels.spun.inertia])
    known = {"duration": duration, "step": step, "speed": first / TEETH}
    run = march_flanks(wheels.spun, [(torque, np.array([1.0, 0.0]))], **known)
    wave = (w * w * wheels.wave / STIFFNESS).tolist()

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


def test_gain_follows_the_sizes():
    free = FreeMotion.__new__(FreeMotion)
    free.sizes = [0.0, -3.0, 1.0, -5.0, -2.0, 700.0, 710.0]
    assert free.gain() == math.inf
    free.sizes = [0.0, -3.0, 1.0, -5.0, -2.0]
    assert free.gain() == pytest.approx(math.exp(4.0))
    free.sizes = [0.0, -math.inf]
    assert math.isnan(free.gain())


def test_a_mass_falls_through_the_play_of_its_bearing_and_comes_back():
    """From the middle at rest: the energy of the law and that of the weight say how far it sinks, and it returns."""
    mass, stiffness, play, weight = 2.0, 1e7, 1e-4, 60.0
    law = RadialBearings(np.array([[0, 1]]), stiffness, play)
    load = np.array([0.0, -weight])
    system = MechanicalSystem(mass * np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), np.eye(2), load, ("x", "y"))
    nothing, none = np.zeros((0, 2, 0)), np.zeros(0)
    ways, numbers = (np.eye(2), np.zeros((2, 0)), nothing, nothing, none), (none, none.astype(int), none.astype(int))
    spun = SpunSystem(system, np.zeros(2), *ways, np.zeros((1, 0)), np.zeros((1, 0)), *numbers, (), (law,))
    run = march_flanks(spun, duration=9e-3, step=6e-6, speed=1.0, start="zero")
    radii = np.linspace(0.0, 5.0 * play, 200_001)
    force = law.evaluate(np.stack([0.0 * radii, -radii], axis=1)[:, None], None)[0][:, 0, 1]
    stored = np.append(0.0, np.cumsum(-0.5 * (force[1:] + force[:-1]) * np.diff(radii)))
    lowest = radii[np.flatnonzero(stored < weight * radii)[-1]]
    assert -run.motion[:, 1].min() == pytest.approx(lowest, rel=1e-4)
    # no damping: it comes back to where it began
    late = run.time > 0.5 * run.time[-1]
    assert abs(run.motion[late, 1].max()) < 1e-3 * play and not run.motion[:, 0].any()
    rest = march_flanks(spun, duration=1e-3, step=1e-5, speed=1.0, start="static").motion[:, 1]
    held = law.evaluate(np.array([[0.0, rest[0]]]), None)[0][0, 1]
    assert held == pytest.approx(-weight, rel=1e-9) and np.ptp(rest) < 1e-9 * play
