"""Speeds of the free spin and the records they ask for, against quadrature and the motion itself."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drivetrain_references import PAIR_INERTIAS, PAIR_RADII, held_pair
from scipy.integrate import solve_ivp

from femgear.trains.drivetrain.case_file import drivetrain_of
from femgear.trains.drivetrain.checks import (
    default_record_every,
    frequency_shift,
    highest_mesh,
    loose_motions,
    mesh_mode,
    reached_speeds,
    shift_rate,
)
from femgear.trains.drivetrain.model import case_model
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    ShaftSection,
    TorqueHistory,
    constant_torques,
)
from femgear.trains.drivetrain.simulation import march_drivetrain
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[3] / "cases"


@pytest.fixture(scope="module")
def model():
    return case_model(read_case(CASES / "own_chain.toml"))


SERIES = {
    "motor": ([0.2, 0.5, 0.9, 1.4, 3.0], [90.0, -400.0, 350.0, -20.0, -900.0]),
    "fan": ([0.0, 1.0, 1.1], [150.0, 150.0, -240.0]),
}


def histories():
    return tuple(TorqueHistory(name, *points) for name, points in SERIES.items())


def test_speeds_are_those_of_quadrature(model):
    """Newton's law integrated by an adaptive method, and by the march."""
    torques = histories()

    def rate(t, _):
        return [sum(model.ratio[one.body] * float(one.at(t)) for one in torques) / model.inertia]

    times = np.linspace(0.0, 2.0, 20_001)
    wanted = solve_ivp(rate, (0.0, 2.0), [50.0], t_eval=times, rtol=1e-9, atol=1e-9, max_step=5e-4).y[0]
    found = reached_speeds(model, torques, duration=2.0, speed=50.0)
    # extremes lie up to half a sample beside the samples
    assert (found.first, found.last) == pytest.approx((50.0, wanted[-1]), rel=1e-7)
    assert (found.lowest, found.highest) == pytest.approx((wanted.min(), wanted.max()), rel=1e-6)
    assert found.highest > max(found.first, found.last) + 1.0 and found.lowest < found.first - 1.0
    run = march_drivetrain(model, torques, duration=2.0, step=1e-3, speed=50.0)
    assert (found.last, found.lowest) == pytest.approx((run.spin_speed[-1], run.spin_speed.min()), rel=1e-4)


def test_speeds_of_the_late_part(model):
    """From 0.7 s on, between two instants of the torques; the mean is the angle over the time."""
    torques = histories()
    run = march_drivetrain(model, torques, duration=2.0, step=1e-4, speed=50.0)
    late = run.time >= 0.7 - 1e-9
    found = reached_speeds(model, torques, duration=2.0, speed=50.0, start=0.7)
    speed, angle = run.spin_speed[late], run.spin[late]
    wanted = (speed[0], speed[-1], speed.min(), speed.max(), (angle[-1] - angle[0]) / 1.3)
    assert (found.first, found.last, found.lowest, found.highest, found.mean) == pytest.approx(wanted, rel=1e-5)
    whole = reached_speeds(model, torques, duration=2.0, speed=50.0)
    assert abs(whole.mean - found.mean) > 0.5 and whole.lowest < found.lowest


def test_constant_torque_gives_a_ramp(model):
    found = reached_speeds(model, constant_torques({"motor": -30.0}), duration=10.0, speed=20.0)
    assert found.last == pytest.approx(20.0 - 300.0 / model.inertia) and found.highest == 20.0
    assert found.fastest == pytest.approx(abs(found.last)) and found.last < -100.0
    # instants beyond the end have no part in it
    late = TorqueHistory("motor", [0.0, 5.0, 50.0], [1.0, 1.0, -1e6])
    early = TorqueHistory("motor", [0.0], [1.0])
    ranges = [reached_speeds(model, (one,), duration=4.0, speed=20.0) for one in (late, early)]
    assert ranges[0].last == pytest.approx(ranges[1].last) and ranges[0].lowest == 20.0


def test_highest_mesh(model):
    name, hertz = highest_mesh(model, -155.0)
    assert name == "pinion-wheel mesh" and hertz == pytest.approx(23 * 155.0 / (2.0 * np.pi))


@pytest.mark.parametrize("rate", [900.0, 5e3, 20e3, 50e3, 1e6])
@pytest.mark.parametrize("highest", [0.0, 1.0, 130.0, 567.3333, 4000.0])
def test_records_keep_the_third_harmonic(rate, highest):
    record = rate / default_record_every(rate, highest)
    every = rate / record
    assert every == pytest.approx(round(every)) and record <= rate
    # the next whole number would be too slow
    slower = rate / (round(every) + 1)
    for one, enough in ((record, True), (slower, False)):
        keeps = one >= 1000.0 * (1.0 - 1e-9) and 0.4 * one >= 3.0 * highest
        assert keeps == enough or (enough and every == 1.0)


def test_mode_that_the_mesh_drives(model):
    """The elastic coordinate of two wheels on held axes, and nothing of the shafts of a chain."""
    pair, base = held_pair(stiffness=2e8), np.array(PAIR_RADII) * np.cos(np.radians(20.0))
    hertz = np.sqrt(2e8 * np.sum(base**2 / PAIR_INERTIAS)) / (2.0 * np.pi)
    assert mesh_mode(pair, 1.01 * hertz) == pytest.approx(hertz, rel=1e-9)
    assert mesh_mode(pair, 0.99 * hertz) == 0.0
    # the elastic coupling between motor and pinion has modes without any share of the mesh
    top = mesh_mode(model, 1e6)
    assert 1000.0 < top < 2000.0


@pytest.mark.parametrize("steps", [200.0, 20.0, 4.0])
def test_shift_is_that_of_the_trapezoidal_rule(steps):
    """Eigenvalues of one step of x'' = -omega^2 x, in matrices written down here."""
    omega, h = 2.0 * np.pi, 1.0 / steps
    rate = np.array([[0.0, 1.0], [-(omega**2), 0.0]])
    step = np.linalg.solve(np.eye(2) - 0.5 * h * rate, np.eye(2) + 0.5 * h * rate)
    turned = np.abs(np.angle(np.linalg.eigvals(step))).max() / h
    assert frequency_shift(1.0, steps) == pytest.approx(1.0 - turned / omega, rel=1e-9)
    # the leading term, for short steps
    assert frequency_shift(1.0, steps) == pytest.approx((omega * h) ** 2 / 12.0, rel=0.15 * (omega * h) ** 2)


@pytest.mark.parametrize("share", [1e-2, 1e-3])
def test_rate_of_a_shift(share):
    assert 0.98 * share < frequency_shift(1500.0, shift_rate(1500.0, share)) <= share


# Motions that nothing holds: counted by hand, whatever the sizes of springs and inertias.


@pytest.fixture(scope="module")
def own():
    return drivetrain_of(read_case(CASES / "own_chain.toml"))


@pytest.mark.parametrize("name", ["wind_turbine_drivetrain", "grc_like_drivetrain", "own_chain"])
def test_shipped_chains_are_held(name):
    assert loose_motions(drivetrain_of(read_case(CASES / f"{name}.toml"))) == (0, ())


def test_sizes_do_not_matter(own):
    """Inertias of 1e-12 kg m^2, shafts of 70 m to 1 km, springs from 1e-3 to 1e15."""
    tiny = replace(own, bodies=tuple(one.changed(inertia=1e-12) for one in own.bodies))
    assert loose_motions(tiny)[0] == 0
    for length in (70.0, 1000.0):
        shafts = (own.shafts[0], own.shafts[1].changed(length=length))
        assert loose_motions(replace(own, shafts=shafts))[0] == 0
    for torsion, bending in ((1e-3, 1e15), (1e15, 1e-3), (1e-3, math.inf)):
        shafts = (own.shafts[0].changed(torsion=torsion, bending=bending), own.shafts[1])
        assert loose_motions(replace(own, shafts=shafts))[0] == 0


def test_true_mechanisms_are_counted(own):
    kept = own.bearings[:2]
    # the second shaft: two translations and two tilts; the mesh holds one of them, the spin stays
    count, names = loose_motions(replace(own, bearings=kept))
    shaft = {name.split(":")[0] for name in names}
    assert count == 4 and shaft <= {"wheel", "fan"}
    # the first shaft as well: the mesh joins both
    assert loose_motions(replace(own, bearings=()))[0] == 8
    # held by one bearing without tilt: it pivots in two planes
    hinge = Drivetrain(
        (
            BodySection.in_si(name="a", mass=1.0, inertia=1.0, transverse_inertia=1.0),
            BodySection.in_si(name="b", mass=1.0, inertia=1.0, transverse_inertia=1.0),
        ),
        (ShaftSection.in_si(between=("a", "b"), length=1.0, outer_diameter=0.05, elements=30),),
        bearings=(BearingSection.in_si(body="a", radial=1e8),),
    )
    assert loose_motions(hinge)[0] == 2
    assert loose_motions(replace(hinge, bearings=(BearingSection.in_si(body="a", radial=1e8, tilt=1e-3),)))[0] == 0
    assert (
        loose_motions(
            replace(
                hinge,
                bearings=(
                    BearingSection.in_si(body="a", radial=1e8),
                    BearingSection.in_si(body="b", radial=1e-3),
                ),
            )
        )[0]
        == 0
    )
    assert (
        loose_motions(replace(hinge, bearings=(BearingSection.in_si(body="a", radial=math.inf, tilt=math.inf),)))[0]
        == 0
    )


def test_one_body():
    free = Drivetrain((BodySection.in_si(name="a", mass=1.0, inertia=1.0, tilts=False),))
    assert loose_motions(free)[0] == 2
    assert loose_motions(replace(free, bearings=(BearingSection.in_si(body="a", radial=5.0),)))[0] == 0
