"""The periodic motion of running planets in time satisfies its equations, and returns to itself."""

import numpy as np
import pytest
from running_twin import TURN, twin
from scipy.integrate import solve_ivp

from validation.reference.running_in_time import motion_over_a_turn, turning_twin

SAMPLES = 1024


@pytest.fixture(scope="module")
def motion():
    system = turning_twin(twin(3, 4), TURN, 2)
    return system, motion_over_a_turn(system, SAMPLES)


@pytest.mark.slow
def test_the_motion_satisfies_its_equations(motion):
    system, values = motion
    n = len(values)
    wave = 1j * np.fft.fftfreq(SAMPLES, 1.0 / SAMPLES)
    spectrum = np.fft.fft(values, axis=1)
    rate, acceleration = (np.fft.ifft(spectrum * wave**power, axis=1).real for power in (1, 2))
    for at in (0, 100, 777):
        matrix, drive = system.equations(2.0 * np.pi * at / SAMPLES)
        wanted = (matrix @ np.concatenate([values[:, at], rate[:, at]]) + drive)[n:]
        assert acceleration[:, at] == pytest.approx(wanted, abs=1e-6 * np.abs(acceleration).max())


@pytest.mark.slow
def test_another_turn_changes_nothing(motion):
    system, values = motion
    n = len(values)
    wave = 1j * np.fft.fftfreq(SAMPLES, 1.0 / SAMPLES)
    rate = np.fft.ifft(np.fft.fft(values, axis=1) * wave, axis=1).real

    def change(theta, state):
        matrix, drive = system.equations(theta)
        return matrix @ state + drive

    start = np.concatenate([values[:, 0], rate[:, 0]])
    known = {"rtol": 1e-9, "atol": 1e-9 * np.abs(start).max()}
    end = solve_ivp(change, (0.0, 2.0 * np.pi), start, method="DOP853", **known).y[:, -1]
    assert end[:n] == pytest.approx(start[:n], abs=1e-6 * np.abs(values).max())


def test_rows_turn_once_with_the_carrier():
    bodies = twin(3, 4, -1)
    mean, cosine, sine = turning_twin(bodies, TURN, 2).waves
    for theta in (0.3, 2.0, 5.1):
        rows = mean + np.cos(theta) * cosine + np.sin(theta) * sine
        assert rows == pytest.approx(bodies.whole_rows(theta), abs=1e-12)


def test_signals_are_those_of_the_excitation_but_for_means():
    drive = twin(3, 4).excitation
    system = turning_twin(twin(3, 4), TURN, 30)
    positions = drive.stiffness.shape[1]
    stiffness, deflection, force = system.signals(2.0 * np.pi * 5 / positions / 4)
    assert stiffness == pytest.approx(drive.stiffness[:, 5])
    assert deflection == pytest.approx(drive.deflection[:, 5] - drive.deflection.mean(axis=1), abs=1e-12)
    assert force == pytest.approx(drive.force[:, 5] - drive.force.mean(axis=1), abs=1e-9)
