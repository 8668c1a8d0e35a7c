"""Growth of the free motion: Floquet and Mathieu exponents, decay, refusal of what outgrows the numbers."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from drivetrain_references import held_pair
from published.wind_turbine_drivetrain import PRINTED, wind_turbine_drivetrain
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

from femgear.errors import ConvergenceError
from femgear.solvers.linear.modal import solve_modes
from femgear.solvers.stability.parametric import stability
from femgear.system.system import MeshExcitation
from femgear.trains.drivetrain.model import balanced_torque, drivetrain_model, torsional_model
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    constant_torques,
)
from femgear.trains.drivetrain.simulation import PIECE, FreeMotion, march_drivetrain

TEETH, HARMONICS = 20, 3


def pair(*, harmonics=HARMONICS, **options):
    return held_pair(harmonics=harmonics, teeth=TEETH, **options)


def natural(model) -> float:
    return 2.0 * math.pi * float(solve_modes(model.still, model.mean_stiffness).frequency[-1])


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
    modes = solve_modes(model.still, model.mean_stiffness)
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
    modes = solve_modes(model.still, model.mean_stiffness)
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
