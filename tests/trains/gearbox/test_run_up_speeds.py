"""Speeds of a run-up stand on the peaks that the response has."""

import numpy as np
import pytest
from casings import RPM, pair_in_a_casing

from femgear.trains.gearbox.response import accelerations, level, solve_gearbox_response
from femgear.trains.gearbox.run_up_speeds import (
    GearboxResonances,
    gearbox_resonances,
    run_up_speeds,
    strongest_of_each,
)

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.fixture(scope="module")
def resonances():
    return gearbox_resonances(pair_in_a_casing(), 500.0 * RPM, 3000.0 * RPM)


def meetings(speed, heard, damping):
    """Resonances of the first mesh harmonic of a stage at some speeds."""
    count = len(speed)
    return GearboxResonances(speed, heard, damping, ("stage",) * count, np.ones(count, int), 10.0 * speed)


def test_resonances_lie_between_the_speeds_where_a_harmonic_meets_a_mode(resonances):
    assert len(resonances.speed) > 5
    assert resonances.speed.min() >= 500.0 * RPM
    assert resonances.speed.max() <= 3000.0 * RPM
    assert resonances.damping == pytest.approx(np.full(len(resonances.speed), 0.03))


def test_the_loudest_resonance_is_a_peak_of_the_response_about_as_high_as_expected(resonances):
    loudest = int(resonances.expected.argmax())
    speeds = resonances.speed[loudest] * (1.0 + 0.03 * np.arange(-3, 4))
    response = solve_gearbox_response(pair_in_a_casing(), speeds)
    heard = np.sqrt((level(response, accelerations(response, 3)) ** 2).sum(axis=1))
    assert 2 <= heard.argmax() <= 4
    assert heard.max() == pytest.approx(0.5 * resonances.expected[loudest], rel=0.3)


def test_narrow_peaks_get_speeds_of_their_own():
    speed = np.array([100.0, 150.5, 180.0])
    found = meetings(speed, np.array([1.0, 0.5, 1e-3]), np.full(3, 0.02))
    speeds, missed = run_up_speeds(np.linspace(50.0, 250.0, 11), found)
    assert missed == 0
    assert {100.0, 98.0, 102.0, 150.5} <= {*np.round(speeds, 9)}
    # that of a thousandth of the loudest has none
    assert 180.0 - 3.6 not in np.round(speeds, 9)
    assert (np.diff(speeds) > 0.0).all()


def test_wide_peaks_need_no_speeds():
    steps = np.linspace(50.0, 250.0, 101)
    found = meetings(np.array([120.7]), np.ones(1), np.array([0.05]))
    speeds, missed = run_up_speeds(steps, found)
    assert speeds == pytest.approx(steps)
    assert missed == 0


def test_of_very_many_narrow_peaks_those_that_are_missed_are_counted():
    places = np.linspace(60.0, 240.0, 90)
    found = meetings(places, np.ones(90), np.full(90, 1e-3))
    assert run_up_speeds(np.linspace(50.0, 250.0, 11), found)[1] > 30


@pytest.mark.parametrize("count", [0, 1])
def test_a_speed_alone_stays_alone(count):
    steps = np.linspace(50.0, 250.0, count)
    found = meetings(*np.ones((3, 1)))
    assert run_up_speeds(steps, found)[0] == pytest.approx(steps)


def test_without_resonances_the_steps_remain():
    steps = np.linspace(50.0, 250.0, 5)
    assert run_up_speeds(steps, meetings(*np.zeros((3, 0))))[0] == pytest.approx(steps)


def test_of_equal_branches_the_strongest_stands_for_all():
    place = np.array([[1.0, 1.0, 1.0, 2.0], [4.0, 4.0, 4.0, 4.0]])
    assert strongest_of_each(["sun", "sun", "ring", "sun"], place, np.array([0.2, 0.3, 0.1, 0.1])) == [1, 2, 3]
