"""Sweeps that carry the motion: jumps at the published folds, settled amplitudes of the other routes."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.time.stroboscopic import sweep_response, sweep_up_and_down
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem


def oscillator(c, k, *elements, force=None, load=0.0):
    one = np.ones((1, 1))
    system = MechanicalSystem(one, c * one, k * one, one, np.array([load]), ("x",))
    return NonlinearSystem(system, elements, () if force is None else (HarmonicForce(np.array([force])),))


@pytest.fixture
def duffing():
    """NLvib example 01 (Krack and Gross 2019): folds at 1.2696019555 and 1.1157002518."""
    return oscillator(0.05, 0.0, PolynomialSprings([0], [[1.0, 0.0, 0.1]]), force=0.18)


def start_on(amplitude, omega):
    """State of the one-line approximation."""
    line = amplitude * np.exp(1j * np.angle(0.18 / (1.0 + 0.075 * amplitude**2 - omega**2 + 0.05j * omega)))
    return [line.real], [-omega * line.imag]


OPTIONS = {"steps": 64, "method": "modal", "tolerance": 1e-4, "least": 3, "most": 300}


def test_jump_down_of_the_sweep_up(duffing):
    up = sweep_response(duffing, np.arange(1.255, 1.285, 0.005), start=start_on(2.75, 1.255), **OPTIONS)
    (jump,) = up.jumps()
    assert up.settled.all()
    assert up.frequency[jump] < 1.2696019555 < up.frequency[jump + 1]
    assert up.amplitude[jump, 0] > 2.7 and up.amplitude[jump + 1, 0] < 0.4


def test_jump_up_of_the_sweep_down(duffing):
    down = sweep_response(duffing, np.arange(1.135, 1.105, -0.005), start=start_on(0.8, 1.135), **OPTIONS)
    (jump,) = down.jumps()
    assert down.frequency[jump + 1] < 1.1157002518 < down.frequency[jump]
    assert down.amplitude[jump, 0] < 1.2 < 1.9 < down.amplitude[jump + 1, 0]


def test_settled_amplitudes_are_those_of_shooting():
    """A gear pair whose teeth part, on both branches near its resonance."""
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.25]]))
    problem = oscillator(0.08, 0.0, mesh, load=0.4)
    up, down = sweep_up_and_down(problem, [0.75, 0.8, 1.1], steps=300, tolerance=1e-6)
    for sweep in (up, down):
        assert sweep.settled.all() and sweep.lowest.min() < 0.0
        for i in (0, 2):
            found = solve_shooting(
                problem,
                sweep.frequency[i],
                start=(sweep.displacement[i], sweep.velocity[i]),
                integration=1e-9,
            )
            half = 0.5 * np.ptp(found.motion)
            assert sweep.amplitude[i, 0] == pytest.approx(half, rel=1e-3)
            assert abs(sweep.lines[i, 0, 1]) == pytest.approx(abs(found.solution.deflection[0, 1]), rel=1e-3)


def test_a_problem_that_changes_with_the_speed():
    """Unbalance: the force grows with the square of the speed; linear response in closed form."""

    def build(omega):
        return oscillator(0.3, 1.0, force=0.2 * omega**2), omega

    speeds = np.array([0.5, 1.0, 2.0])
    found = sweep_response(build, speeds, steps=100, tolerance=1e-7, method="modal")
    exact = 0.2 * speeds**2 / np.abs(1.0 - speeds**2 + 0.3j * speeds)
    np.testing.assert_allclose(np.abs(found.lines[:, 0, 1]), exact, rtol=5e-4)
    np.testing.assert_allclose(found.amplitude[:, 0], exact, rtol=5e-3)


def test_what_does_not_settle_says_so(duffing):
    found = sweep_response(duffing, [1.2], start=([3.0], [0.0]), steps=64, most=5, tolerance=1e-9)
    assert not found.settled[0] and found.periods[0] == 5
    with pytest.raises(CaseError, match="E-RANGE"):
        sweep_response(duffing, [0.0, 1.0])
