"""Speeds of the free spin and the records they ask for, against quadrature and the motion itself."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femgear.case import read_case
from femgear.models.drivetrain_case import case_model
from femgear.models.drivetrain_march import march_drivetrain
from femgear.models.drivetrain_rates import default_record_rate, highest_mesh, speed_range
from femgear.models.drivetrain_torque import TorqueHistory, constant_torques

CASES = Path(__file__).parents[2] / "cases"


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
    found = speed_range(model, torques, duration=2.0, speed=50.0)
    # extremes lie up to half a sample beside the samples
    assert (found.first, found.last) == pytest.approx((50.0, wanted[-1]), rel=1e-7)
    assert (found.lowest, found.highest) == pytest.approx((wanted.min(), wanted.max()), rel=1e-6)
    assert found.highest > max(found.first, found.last) + 1.0 and found.lowest < found.first - 1.0
    run = march_drivetrain(model, torques, duration=2.0, step=1e-3, speed=50.0)
    assert (found.last, found.lowest) == pytest.approx((run.spin_speed[-1], run.spin_speed.min()), rel=1e-4)


def test_constant_torque_gives_a_ramp(model):
    found = speed_range(model, constant_torques({"motor": -30.0}), duration=10.0, speed=20.0)
    assert found.last == pytest.approx(20.0 - 300.0 / model.inertia) and found.highest == 20.0
    assert found.fastest == pytest.approx(abs(found.last)) and found.last < -100.0
    # instants beyond the end have no part in it
    late = TorqueHistory("motor", [0.0, 5.0, 50.0], [1.0, 1.0, -1e6])
    early = TorqueHistory("motor", [0.0], [1.0])
    ranges = [speed_range(model, (one,), duration=4.0, speed=20.0) for one in (late, early)]
    assert ranges[0].last == pytest.approx(ranges[1].last) and ranges[0].lowest == 20.0


def test_highest_mesh(model):
    name, hertz = highest_mesh(model, -155.0)
    assert name == "pinion-wheel mesh" and hertz == pytest.approx(23 * 155.0 / (2.0 * np.pi))


@pytest.mark.parametrize("rate", [900.0, 5e3, 20e3, 50e3, 1e6])
@pytest.mark.parametrize("highest", [0.0, 1.0, 130.0, 567.3333, 4000.0])
def test_records_keep_the_third_harmonic(rate, highest):
    record = default_record_rate(rate, highest)
    every = rate / record
    assert every == pytest.approx(round(every)) and record <= rate
    # the next whole number would be too slow
    slower = rate / (round(every) + 1)
    for one, enough in ((record, True), (slower, False)):
        keeps = one >= 1000.0 * (1.0 - 1e-9) and 0.4 * one >= 3.0 * highest
        assert keeps == enough or (enough and every == 1.0)
