"""Sweeps that carry the motion: jumps at the published folds, settled amplitudes of the other routes."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.time.stroboscopic import stroboscopic_map, sweep_response, sweep_up_and_down
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.reference.sections import bifurcation_diagram, stroboscopic_section


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


@pytest.mark.slow
def test_jump_down_of_the_sweep_up(duffing):
    up = sweep_response(duffing, np.arange(1.255, 1.285, 0.005), start=start_on(2.75, 1.255), **OPTIONS)
    (jump,) = up.jumps()
    assert up.settled.all()
    assert up.frequency[jump] < 1.2696019555 < up.frequency[jump + 1]
    assert up.amplitude[jump, 0] > 2.7 and up.amplitude[jump + 1, 0] < 0.4


@pytest.mark.slow
def test_jump_up_of_the_sweep_down(duffing):
    down = sweep_response(duffing, np.arange(1.135, 1.105, -0.005), start=start_on(0.8, 1.135), **OPTIONS)
    (jump,) = down.jumps()
    assert down.frequency[jump + 1] < 1.1157002518 < down.frequency[jump]
    assert down.amplitude[jump, 0] < 1.2 < 1.9 < down.amplitude[jump + 1, 0]


@pytest.mark.slow
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


# Sections and bifurcation diagrams against published period doublings and closed forms.


def two_wells(force):
    """x'' + 0.3 x' - x + x^3 = F cos 1.2 t."""
    return oscillator(0.3, 0.0, PolynomialSprings([0], [[-1.0, 0.0, 1.0]]), force=force), 1.2


@pytest.mark.slow
@pytest.mark.parametrize(
    "force, period",
    [
        pytest.param(0.20, 1, marks=pytest.mark.slow),
        pytest.param(0.28, 2, marks=pytest.mark.slow),
        (0.29, 4),
        pytest.param(0.37, 5, marks=pytest.mark.slow),
        pytest.param(0.65, 2, marks=pytest.mark.slow),
    ],
)
def test_period_doubling_of_two_wells(force, period):
    """D. W. Jordan and P. Smith, Nonlinear Ordinary Differential Equations (2007), section 13.3."""
    section = stroboscopic_section(*two_wells(force), start=([1.0], [0.0]), points=20, skip=160, steps=100)
    assert section.repeats_after(2e-3) == period


@pytest.mark.slow
def test_bifurcation_diagram_carries_the_motion():
    diagram = bifurcation_diagram(
        two_wells, [0.20, 0.28], points=16, skip=100, steps=100, start=([1.0], [0.0]), tolerance=2e-3
    )
    assert diagram.repeats.tolist() == [1, 2]
    assert diagram.displacement.shape == (2, 16, 1)
    again = stroboscopic_section(
        *two_wells(0.28),
        points=16,
        skip=100,
        steps=100,
        start=(diagram.displacement[0, -1], diagram.velocity[0, -1]),
    )
    np.testing.assert_allclose(diagram.displacement[1], again.displacement, atol=1e-12)


def test_linear_motion_is_one_point_at_every_phase():
    """Steady state of a damped oscillator in closed form, at two phases of the period."""
    problem, omega = oscillator(0.4, 2.0, force=1.0), 1.1
    line = 1.0 / (2.0 - omega**2 + 0.4j * omega)
    for phase in (0.0, 0.3):
        section = stroboscopic_section(problem, omega, points=4, skip=40, steps=100, phase=phase, method="modal")
        wave = line * np.exp(2j * np.pi * phase)
        np.testing.assert_allclose(section.displacement[:, 0], wave.real, atol=1e-3)
        np.testing.assert_allclose(section.velocity[:, 0], (1j * omega * wave).real, atol=1e-3)
        assert section.repeats_after() == 1
    assert section.time[0] == pytest.approx((40.3) * 2 * np.pi / omega)


def test_bad_input_is_refused():
    problem = oscillator(0.4, 2.0, force=1.0)
    for options in ({"points": 0}, {"phase": 1.5}):
        with pytest.raises(CaseError, match="E-RANGE"):
            stroboscopic_section(problem, 1.0, **options)
    with pytest.raises(CaseError, match="E-RANGE"):
        stroboscopic_section(problem, 1.0, steps=2)


def test_a_map_takes_one_period_in_equal_steps_and_ends_where_it_begins():
    for options, frequency, period in (({}, [2.0], np.pi), ({"periods": 2}, [2.0, 3.0], 2.0 * np.pi)):
        once = stroboscopic_map(oscillator(0.4, 2.0, force=1.0), frequency, steps=8, **options)
        assert once.period == pytest.approx(period, rel=1e-15)
        turns = np.arange(9.0)[:, None] / 8.0 * period * np.array(frequency)
        assert np.exp(1j * once.theta) == pytest.approx(np.exp(1j * turns), abs=1e-14)
        # to the last bit, so that a second period has the forces of the first
        assert once.theta[-1].tolist() == once.theta[0].tolist()
