"""Loaded flanks follow the load: order of the bodies, sun-driven sets, reversed torques, mirror images."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drivetrain_references import torsional_matrices
from published.wind_turbine_drivetrain import paper_torques, wind_turbine_drivetrain

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.trains.drivetrain.case_file import drivetrain_of
from femgear.trains.drivetrain.kinematics import speed_ratios
from femgear.trains.drivetrain.model import (
    BENDING,
    TORSIONAL,
    balanced_torque,
    case_model,
    drivetrain_model,
    torsional_model,
    with_drivers,
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
from femgear.trains.drivetrain.simulation import march_drivetrain
from femgear.trains.reading import read_case, with_value

TRAIN = wind_turbine_drivetrain()
ALPHA = math.radians(20.0)
MOTOR, FAN = (
    BodySection.in_si(name="motor", mass=210.0, inertia=0.25, transverse_inertia=0.2),
    BodySection.in_si(name="fan", mass=160.0, inertia=18.0, transverse_inertia=10.0),
)
BEARINGS = (
    BearingSection.in_si(body="motor", radial=2e8, tilt=1e6),
    BearingSection.in_si(body="fan", radial=1e8, tilt=1e6),
)
MESH = MeshSection.in_si(stiffness=3e8, contact_ratio=1.68)


def motor_and_fan(**options):
    stage = ParallelSection.in_si(
        between=("motor", "fan"), teeth=(23, 23), radii=(0.0345, 0.1065), mesh=MESH, **options
    )
    return Drivetrain((MOTOR, FAN), parallel=(stage,), bearings=BEARINGS, gravity=0.0)


def fan_and_motor(**options):
    """The same machine, written the other way round."""
    stage = ParallelSection.in_si(
        between=("fan", "motor"),
        teeth=(71, 71),
        radii=(0.1065, 0.0345),
        mesh=MESH,
        direction=math.pi,
        **options,
    )
    return Drivetrain((FAN, MOTOR), parallel=(stage,), bearings=BEARINGS, gravity=0.0)


def driven(train, torque, body, output):
    """Model of the loaded flanks, deviations and mesh forces under a torque in balance, at rest."""
    found = drivetrain_model(with_drivers(train, balanced(train, torque, body, output), duration=1.0))
    model = drivetrain_model(found.train, harmonics=0, turning=False)
    return model, *static(model, balanced_torque(model, body, torque, output))


def balanced(train, torque, body, output):
    ratio = speed_ratios(train)
    return constant_torques({body: torque, output: -torque * ratio[body] / ratio[output]})


def static(model, torques):
    load = model.system.load.copy()
    for name, torque in torques.items():
        load[model.index(f"{name}: rotation")] += torque
    k, W, carried = model.mean_stiffness, model.system.W, model.system.M @ model.rigid
    total = np.block([[model.system.K + (W * k) @ W.T, carried[:, None]], [carried[None], np.zeros((1, 1))]])
    q = np.linalg.solve(total, np.append(load, 0.0))[:-1]
    return q, k * (W.T @ q)


def at(model, q, body):
    return np.array([q[model.index(f"{body}: {axis}")] for axis in ("x", "y")])


@pytest.mark.parametrize("torque", [60.0, -60.0])
def test_order_of_the_bodies_does_not_matter(torque):
    """Motor at the origin, fan along x; the radial force T / r tan(alpha) pushes the two apart."""
    (one, q, force), (two, p, other) = (
        driven(make(), sign * torque, "motor", "fan") for make, sign in ((motor_and_fan, 1.0), (fan_and_motor, -1.0))
    )
    # the first body turns forwards in either file, so that the second is its mirror image about x
    wanted = 60.0 / (0.0345 * math.cos(ALPHA))
    assert force == pytest.approx(wanted, rel=1e-12) and other == pytest.approx(wanted, rel=1e-12)
    for model, motion in ((one, q), (two, p)):
        apart = 60.0 / 0.0345 * math.tan(ALPHA)
        assert 2e8 * at(model, motion, "motor")[0] == pytest.approx(-apart, rel=1e-9)
        assert 1e8 * at(model, motion, "fan")[0] == pytest.approx(apart, rel=1e-9)
    assert at(one, q, "motor")[1] == pytest.approx(-at(two, p, "motor")[1], rel=1e-9)
    modes = [undamped_modes(m.still, m.mean_stiffness).frequency for m in (one, two)]
    assert modes[0][1:] == pytest.approx(modes[1][1:], rel=1e-9)


def test_loaded_flanks_of_a_helical_pair():
    """Tangential and axial part of the normal are reversed, the radial one stays; the spin strains none."""
    normals = []
    for driver in ("motor", "fan"):
        model = drivetrain_model(motor_and_fan(helix_angle=0.3, offsets=(0.1, 0.0), driver=driver))
        w = model.system.W[:, 0]
        x, y, tilt = (w[model.index(f"motor: {name}")] for name in ("x", "y", "tilt y"))
        # moment about y: z n_x - x n_z
        normals.append([x, y, (0.1 * x - tilt) / 0.0345])
        assert abs(w @ model.rigid) < 1e-15
    lean = math.hypot(1.0, math.tan(0.3) * math.cos(ALPHA))
    wanted = np.array([math.sin(ALPHA), math.cos(ALPHA), math.tan(0.3) * math.cos(ALPHA)]) / lean
    assert normals[0] == pytest.approx(wanted, rel=1e-12)
    assert normals[1] == pytest.approx(wanted * [1.0, -1.0, -1.0], rel=1e-12)


@pytest.mark.parametrize("torque", [15000.0, -15000.0])
def test_planetary_set_is_pressed_by_either_driver(torque):
    """Mesh forces from the equilibrium of sun and ring, all of them in compression."""
    bodies = tuple(b.changed(tilts=False) for b in TRAIN.bodies if b.name in ("carrier", "sun"))
    train = Drivetrain(
        bodies,
        planetary=TRAIN.planetary,
        bearings=(
            BearingSection.in_si(body="carrier", radial=2e8),
            BearingSection.in_si(body="sun", radial=3e7),
        ),
        gravity=0.0,
    )
    model, _, force = driven(train, torque, "carrier", "sun")
    stage = model.train.planetary[0]
    assert (stage.driver == "sun") == (torque < 0.0)
    sun = abs(torque) / model.ratio["sun"] / (3.0 * stage.sun_radius * math.cos(stage.pressure_angle))
    assert force == pytest.approx(sun, rel=1e-9)


def test_generator_as_motor_is_the_mirror_image():
    """Reversed torques: everything mirrored about the common line of centres, planets 2 and 3 exchanged."""
    train = replace(TRAIN, parallel=tuple(one.changed(direction=0.0) for one in TRAIN.parallel), gravity=0.0)
    (one, q, force), (two, p, other) = (driven(train, torque, "rotor", "generator") for torque in (15000.0, -15000.0))
    assert two.train.planetary[0].driver == "sun" and one.train == train
    assert [stage.driver for stage in two.train.parallel] == ["gear 2", "gear 3"]
    swap = {"planet 2": "planet 3", "planet 3": "planet 2"}
    assert force.min() > 0.0
    assert other[[0, 2, 1, 3, 5, 4, 6, 7]] == pytest.approx(force, rel=1e-6)
    mirror = {"x": 1.0, "y": -1.0, "tilt x": -1.0, "tilt y": 1.0, "rotation": -1.0}
    for name, value in zip(one.system.dofs, q):
        body, axis = name.split(": ")
        image = mirror[axis] * p[two.index(f"{swap.get(body, body)}: {axis}")]
        assert image == pytest.approx(value, rel=1e-6, abs=1e-6 * np.abs(q).max())


def test_mirror_image_in_motion():
    """Reversed torque and spin-driven phases: the same forces from step to step."""
    runs = []
    for torque in (60.0, -60.0):
        train = with_drivers(motor_and_fan(), balanced(motor_and_fan(), torque, "motor", "fan"), duration=0.1)
        model = drivetrain_model(replace(train, damping_ratio=0.02))
        history = constant_torques(balanced_torque(model, "motor", torque, "fan"))
        runs.append(march_drivetrain(model, history, duration=0.1, step=2e-5, speed=150.0))
    assert np.ptp(runs[0].force) > 1.0
    assert np.abs(runs[0].force - runs[1].force).max() < 1e-6 * runs[0].force.max()


def test_torsional_matrices_know_the_driver():
    stages = tuple(one.changed(driver=one.between[1]) for one in TRAIN.parallel)
    train = replace(TRAIN, parallel=stages, planetary=(TRAIN.planetary[0].changed(driver="sun"),))
    W = torsional_matrices(train)[2]
    assert np.array_equal(W, -torsional_matrices(TRAIN)[2])
    assert np.abs(torsional_model(train).system.W - W).max() < 1e-12 * np.abs(W).max()


def test_defaults_stay_where_they_drive_or_nothing_does():
    for torques in (paper_torques(), paper_torques(balanced=True)):
        assert with_drivers(TRAIN, constant_torques(torques), duration=60.0) == TRAIN
    assert with_drivers(TRAIN, (), duration=1.0) == TRAIN
    swing = TorqueHistory("generator", [0.0, 1.0, 3.0, 4.0], [100.0, 100.0, -100.0, -100.0])
    assert with_drivers(TRAIN, [swing], duration=4.0) == TRAIN
    # up to two seconds it pushes, which is to say the sun drives the carrier
    assert with_drivers(TRAIN, [swing], duration=2.0).planetary[0].driver == "sun"
    given = replace(TRAIN, planetary=(TRAIN.planetary[0].changed(driver="carrier"),))
    assert with_drivers(given, [swing], duration=2.0).planetary == given.planetary


def test_inertia_decides_where_torques_do_not_balance():
    """A torque on the first body alone accelerates all that follows; on the second what comes before it."""
    for body, wanted in (("motor", None), ("fan", "fan")):
        sense = {"motor": 1.0, "fan": -1.0}[body]
        found = with_drivers(motor_and_fan(), constant_torques({body: 50.0 * sense}), duration=1.0)
        assert found.parallel[0].driver == wanted
    # braked by the motor: the fan's inertia drives
    braked = with_drivers(motor_and_fan(), constant_torques({"motor": -50.0}), duration=1.0)
    assert braked.parallel[0].driver == "fan"
    with pytest.raises(CaseError, match="E-DRIVETRAIN"):
        with_drivers(motor_and_fan(), constant_torques({"nobody": 1.0}), duration=1.0)


def test_two_paths_share_by_their_stiffness():
    """A herringbone pair: both meshes of one shaft get the driver of their own load."""
    first, second = (motor_and_fan().parallel[0].changed(offsets=(z, z)) for z in (-0.1, 0.1))
    train = replace(
        motor_and_fan(),
        parallel=(first, second.changed(mesh=MeshSection.in_si(stiffness=1e8, contact_ratio=1.5))),
    )
    found = with_drivers(train, balanced(train, -60.0, "motor", "fan"), duration=1.0)
    assert [one.driver for one in found.parallel] == ["fan", "fan"]


def test_mean_torque_is_exact():
    series = TorqueHistory("motor", [1.0, 2.0, 4.0], [0.0, 6.0, 2.0])
    # nothing for a second, a triangle of 3, then 6 to 4 within a second
    assert series.mean(3.0) == pytest.approx((3.0 + 5.0) / 3.0, rel=1e-14)
    assert series.mean(0.5) == 0.0
    assert series.mean(6.0) == pytest.approx((3.0 + 8.0 + 4.0) / 6.0, rel=1e-14)


OWN = Path(__file__).parents[3] / "cases" / "own_chain.toml"


def test_case_file_follows_its_torques_or_says_who_drives():
    case, key = read_case(OWN), "parallel[0].driver"
    first, second = case.parallel[0].between
    assert case_model(case).train == drivetrain_of(case)
    torques = [f"{-t} N m" for t in case.operation.torque[0].torques]
    turned = with_value(case, "operation.torque[0].torques", torques)
    assert case_model(turned).train.parallel[0].driver == second
    assert case_model(with_value(turned, key, first)).train.parallel[0].driver == first
    for variant in (BENDING, TORSIONAL):
        given = case_model(with_value(case, key, second), variant)
        assert given.train.parallel[0].driver == second
    with pytest.raises(CaseError, match="E-CHOICE") as caught:
        with_value(case, key, "nobody")
    assert key in str(caught.value) and first in str(caught.value)


def test_case_file_of_a_planetary_stage():
    case = read_case(OWN.with_name("wind_turbine_drivetrain.toml"))
    assert case_model(with_value(case, "planetary[0].driver", "sun")).train.planetary[0].flank == -1
    with pytest.raises(CaseError, match="E-CHOICE"):
        with_value(case, "planetary[0].driver", "rotor")
