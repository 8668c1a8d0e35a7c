"""The rigid-body rotation under torques: by hand, by adaptive integration of Newton's law, on its way."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from two_wheels import two_wheels

from femgear.solvers.time.free_turn import FreeTurn, TorqueHistory, reached_speeds


def test_the_mean_of_a_torque_counts_what_lies_between_its_instants():
    history = TorqueHistory("a", [0.2, 0.4, 0.6], [1.0, 3.0, -1.0])
    assert history.mean(0.5) == pytest.approx((0.2 * 1.0 + 0.2 * 2.0 + 0.1 * 2.0) / 0.5, rel=1e-12)
    assert history.at([0.0, 0.3, 9.0]) == pytest.approx([1.0, 2.0, -1.0])


def test_angle_and_speed_are_those_of_newtons_law():
    spun = two_wheels().spun
    history = TorqueHistory("a", [0.0, 0.05, 0.1], [0.0, 40.0, -20.0])
    turn = FreeTurn(spun, [(history, np.array([1.0, 0.0]))], 1e-3, 3.0)
    block = turn.block(0, 100)
    known = {"rtol": 1e-12, "atol": 1e-12, "max_step": 1e-3, "t_eval": np.linspace(0.0, 0.1, 101)}
    wanted = solve_ivp(lambda t, y: [y[1], history.at(t) / spun.inertia], (0.0, 0.1), [0.0, 3.0], **known).y
    assert block.angle == pytest.approx(wanted[0], abs=1e-9) and block.speed == pytest.approx(wanted[1], rel=1e-9)
    # what is left of the load does not drive the rotation
    assert np.abs(spun.spin @ turn.directions).max() < 1e-12


def test_reached_speeds_find_the_turning_point_between_instants():
    history = TorqueHistory("a", [0.0, 1.0, 2.0], [4.0, -4.0, -4.0])
    speeds = reached_speeds([history], [0.5], 2.0, duration=2.0, speed=1.0)
    times = np.linspace(0.0, 2.0, 200_001)
    rate = 0.25 * history.at(times)
    speed = 1.0 + np.concatenate([[0.0], np.cumsum(0.5 * np.diff(times) * (rate[1:] + rate[:-1]))])
    assert (speeds.first, speeds.last) == pytest.approx((1.0, speed[-1]), rel=1e-9)
    assert (speeds.lowest, speeds.highest) == pytest.approx((speed.min(), speed.max()), abs=1e-9)
    assert speeds.mean == pytest.approx(np.trapezoid(speed, times) / 2.0, abs=1e-8)
    assert reached_speeds([history], [0.5], np.inf, duration=2.0, speed=1.0).highest == 1.0
