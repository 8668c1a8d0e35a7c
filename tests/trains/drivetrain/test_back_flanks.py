"""Back flanks with their own line of action: geometry, wedged teeth in closed form, another integrator."""

import math
from dataclasses import replace

import numpy as np
import pytest
from published.wind_turbine_drivetrain import paper_torques, wind_turbine_drivetrain

from femgear.solvers.time.transient import solve_transient
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
    MeshSection,
    ParallelSection,
    TorqueHistory,
    constant_torques,
)
from femgear.trains.drivetrain.simulation import Records, march_drivetrain

TRAIN = wind_turbine_drivetrain()
ALPHA, RADIUS = math.radians(20.0), 0.0345
K, SOFT, STIFF = 3e8, 2e7, 1e8


def pair(*, backlash, direction=0.0, gravity=0.0, helix=0.0, offset=0.0, damping=0.0):
    """A pinion in soft bearings and a wheel."""
    bodies = (
        BodySection.in_si(name="pinion", mass=400.0, inertia=0.25, transverse_inertia=1.0),
        BodySection.in_si(name="wheel", mass=160.0, inertia=18.0, transverse_inertia=10.0),
    )
    stage = ParallelSection.in_si(
        between=("pinion", "wheel"),
        teeth=(23, 23),
        radii=(RADIUS, 0.1065),
        mesh=MeshSection.in_si(stiffness=K, contact_ratio=1.5, low_share=0.8, phase=0.0, backlash=backlash),
        helix_angle=helix,
        direction=direction,
        offsets=(offset, 0.0),
    )
    bearings = (
        BearingSection.in_si(body="pinion", radial=SOFT, tilt=1e6),
        BearingSection.in_si(body="wheel", radial=STIFF, tilt=1e6),
    )
    train = Drivetrain(bodies, parallel=(stage,), bearings=bearings, gravity=gravity, damping_ratio=damping)
    return drivetrain_model(train, harmonics=0)


def other_drivers(train):
    return replace(
        train,
        planetary=tuple(one.changed(driver=one.sun) for one in train.planetary),
        parallel=tuple(one.changed(driver=one.between[1]) for one in train.parallel),
    )


def helical(train):
    parallel = tuple(one.changed(helix_angle=0.2, offsets=(0.03, 0.0)) for one in train.parallel)
    return replace(train, parallel=parallel, damping_ratio=0.0)


def on_elastic_pins(train):
    return replace(train, planetary=(train.planetary[0].changed(planet_bearing=1e9),))


@pytest.mark.parametrize(("train", "turning"), [(helical(TRAIN), True), (on_elastic_pins(helical(TRAIN)), False)])
def test_back_flanks_are_the_drive_flanks_of_the_other_driver(train, turning):
    one, two = (drivetrain_model(t, turning=turning) for t in (train, other_drivers(train)))
    both, drive = one.contacts.geometry, two.geometry
    angles = [0.7 * turning]
    back = (both.basic @ both.selection(angles))[:, len(one.meshes) :]
    wanted = drive.basic @ drive.selection(angles)
    assert np.isfinite(one.backlash).all() and back.shape == wanted.shape
    assert np.abs(back - wanted).max() < 1e-12 * np.abs(wanted).max()
    front = (both.basic @ both.selection(angles))[:, : len(one.meshes)]
    assert np.array_equal(front, one.geometry.basic @ one.geometry.selection(angles))
    # not the mirror image in rotation only
    assert np.abs(back + front).max() > 0.1 * np.abs(front).max()


@pytest.mark.parametrize(("train", "turning"), [(helical(TRAIN), True), (on_elastic_pins(helical(TRAIN)), False)])
def test_elements_of_the_general_solvers_have_the_same_contacts(train, turning):
    """Forces on all coordinates at a random place, from the normals of both drivers."""
    one, two = (drivetrain_model(t, turning=turning, harmonics=0) for t in (train, other_drivers(train)))
    problem = drivetrain_problem(one, separates=True)
    q, theta = 1e-3 * np.random.default_rng(2).standard_normal(len(one.rigid)), np.array([0.7, 0.0, 0.0, 0.0])
    x, found = problem.system.W.T @ q, np.zeros(problem.system.W.shape[1])
    for element in problem.elements:
        np.add.at(found, element.columns, element.evaluate(x[element.columns], theta)[0])
    wanted = np.zeros(len(q))
    for model, gap in ((one, 0.0), (two, one.backlash)):
        w = model.geometry.basic @ model.geometry.selection([0.7 * turning])
        wanted += w @ (model.mean_stiffness * np.maximum(w.T @ q - gap, 0.0))
    assert np.abs(problem.system.W @ found - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_held_axes_mirror_the_rotation_only():
    model = torsional_model(TRAIN)
    both, n = model.contacts.geometry, len(model.meshes)
    directions = both.basic @ both.selection([0.7])
    assert both.basic.shape == model.geometry.basic.shape
    assert np.abs(directions[:, :n] + directions[:, n:]).max() < 1e-14


def test_no_back_flank_without_backlash():
    stage = TRAIN.parallel[0].changed(mesh=TRAIN.parallel[0].mesh.changed(backlash=math.inf))
    model = drivetrain_model(replace(TRAIN, parallel=(stage, TRAIN.parallel[1])))
    assert model.contacts.mesh.tolist() == [*range(8), 0, 1, 2, 3, 4, 5, 7]
    assert np.all(model.contacts.gap[8:] == np.delete(model.backlash, 6))


@pytest.mark.parametrize("torque", [0.0, 20.0, -20.0])
def test_teeth_wedge_under_a_radial_load(torque):
    """The weight presses the pinion onto the wheel below it, until both flanks carry.

    With y1, y2 the ways down, f and g the forces of drive and back flank: c1 y1 = m1 a - (f + g) sin(alpha),
    c2 y2 = m2 a + (f + g) sin(alpha), f = k ((y1 - y2) sin(alpha) + t), g = k ((y1 - y2) sin(alpha) - t - b),
    (f - g) r cos(alpha) = torque.
    """
    backlash, a = 2e-5, 20.0
    model = pair(backlash=backlash, direction=-0.5 * math.pi, gravity=a)
    run = march_drivetrain(
        model,
        constant_torques(balanced_torque(model, "pinion", torque, "wheel")),
        duration=0.01,
        step=1e-5,
        speed=20.0,
        outputs=model.system.dofs,
        contact_loss=True,
    )
    s = math.sin(ALPHA)
    way = a * (400.0 / SOFT - 160.0 / STIFF)
    total = (2.0 * K * s * way - K * backlash) / (1.0 + 2.0 * K * s**2 * (1.0 / SOFT + 1.0 / STIFF))
    difference = torque / (RADIUS * math.cos(ALPHA))
    assert total > abs(difference)
    drive = 0.5 * (total + difference)
    assert run.approach[:, 0] == pytest.approx(drive / K, rel=1e-6)
    assert run.force[:, 0] == pytest.approx(difference, rel=1e-6, abs=1e-6 * total)
    down = [(400.0 * a - total * s) / SOFT, (160.0 * a + total * s) / STIFF]
    for body, wanted in zip(("pinion", "wheel"), down):
        assert run.motion[:, model.index(f"{body}: y")] == pytest.approx(-wanted, rel=1e-9)
    assert run.lost[0] == 0.0
    # without a torque the two forces are equal to rounding
    assert not torque or run.pulling[0] == float(torque < 0.0)


def test_back_flanks_push_the_gears_apart():
    """At rest on the back flanks the radial force has the sign that it has on the drive flanks."""
    model, load = pair(backlash=1e-5), 60.0
    for sign in (1.0, -1.0):
        run = march_drivetrain(
            model,
            constant_torques(balanced_torque(model, "pinion", sign * load, "wheel")),
            duration=0.01,
            step=1e-5,
            speed=20.0,
            outputs=("pinion: x", "pinion: y", "wheel: x"),
            contact_loss=True,
        )
        push = load / RADIUS
        wanted = [-push * math.tan(ALPHA) / SOFT, -sign * push / SOFT, push * math.tan(ALPHA) / STIFF]
        assert run.motion[-1] == pytest.approx(wanted, rel=1e-6)
        assert run.force[-1, 0] == pytest.approx(sign * push / math.cos(ALPHA), rel=1e-6)


def test_reversed_torque_against_an_adaptive_integrator():
    """From rest on the drive flanks through the play onto the back flanks, axes that move and tilt."""
    model = pair(backlash=1e-5, helix=0.2, offset=0.05, damping=0.02)
    there, back = (balanced_torque(model, "pinion", sign * 60.0, "wheel") for sign in (1.0, -1.0))
    held = march_drivetrain(
        model,
        constant_torques(there),
        duration=1e-5,
        step=1e-5,
        speed=20.0,
        outputs=model.system.dofs,
        contact_loss=True,
    )
    start = held.motion[0], np.zeros(len(model.rigid))
    runs = [
        march_drivetrain(
            model,
            constant_torques(back),
            duration=0.02,
            step=1e-4 / n,
            records=Records(n),
            speed=20.0,
            start=start,
            outputs=model.system.dofs,
            contact_loss=True,
        )
        for n in (32, 128)
    ]
    problem = drivetrain_problem(model, torques=back, separates=True, speed=20.0)
    exact = solve_transient(
        problem, model.frequencies(20.0), runs[0].time, start=start, method="DOP853", tolerance=1e-10
    )
    assert exact.converged and runs[1].lost[0] > 0.1 and runs[1].pulling[0] > 0.3
    size = np.abs(exact.displacement).max(axis=0)
    coarse, fine = (np.abs(r.motion - exact.displacement).max(axis=0) / size for r in runs)
    assert np.all(fine < 2e-6) and np.all(fine < coarse / 8.0)
    assert runs[1].energy_balance.error < 1e-9 and runs[1].momentum < 1e-9


def test_books_balance_with_wedged_teeth():
    """Torques that alternate, heavy gears in soft bearings: flanks of both sides touch together at times."""
    model = pair(backlash=1e-4, direction=-0.5 * math.pi, gravity=9.81, damping=0.01)
    waves = [
        TorqueHistory(body, [0.0, 0.1, 0.2, 0.3], np.array([1.0, -1.0, 1.0, -1.0]) * value)
        for body, value in balanced_torque(model, "pinion", 60.0, "wheel").items()
    ]
    run = march_drivetrain(
        model, waves, duration=0.3, step=2e-5, speed=20.0, contact_loss=True, outputs=model.system.dofs
    )
    both = run.motion @ model.contacts.geometry.frozen - model.contacts.gap
    wedged = np.all(both > 0.0, axis=1)
    assert 0.05 < wedged.mean() < 0.95
    force = K * (np.maximum(both[:, 0], 0.0) - np.maximum(both[:, 1], 0.0))
    assert run.force[:, 0] == pytest.approx(force, rel=1e-9, abs=1e-9 * np.abs(force).max())
    assert run.energy_balance.error < 1e-9 and run.momentum < 1e-9


def test_thinned_records_are_those_of_all_steps():
    model = drivetrain_model(TRAIN)
    options = {"duration": 0.2, "step": 1e-4, "speed": 0.63, "start": "zero", "contact_loss": True}
    every, tenth = (
        march_drivetrain(model, constant_torques(paper_torques()), records=Records(n), **options) for n in (1, 10)
    )
    assert np.array_equal(every.force[::10], tenth.force)
    assert np.array_equal(every.approach[::10], tenth.approach)
    assert np.array_equal(every.extremes, tenth.extremes) and every.lost.max() > 0.0
    assert every.lost == pytest.approx((every.force[1:] == 0.0).mean(axis=0), abs=1e-3)
