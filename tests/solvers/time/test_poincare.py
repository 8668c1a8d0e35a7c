"""Sections and bifurcation diagrams against published period doublings and closed forms."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.time.stroboscopic import stroboscopic_map
from femgear.system.force_laws import PolynomialSprings
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.reference.sections import bifurcation_diagram, stroboscopic_section


def oscillator(c, k, *elements, force=None):
    one = np.ones((1, 1))
    system = MechanicalSystem(one, c * one, k * one, one, np.zeros(1), ("x",))
    return NonlinearSystem(system, elements, () if force is None else (HarmonicForce(np.array([force])),))


def two_wells(force):
    """x'' + 0.3 x' - x + x^3 = F cos 1.2 t."""
    return oscillator(0.3, 0.0, PolynomialSprings([0], [[-1.0, 0.0, 1.0]]), force=force), 1.2


@pytest.mark.parametrize("force, period", [(0.20, 1), (0.28, 2), (0.29, 4), (0.37, 5), (0.65, 2)])
def test_period_doubling_of_two_wells(force, period):
    """D. W. Jordan and P. Smith, Nonlinear Ordinary Differential Equations (2007), section 13.3."""
    section = stroboscopic_section(*two_wells(force), start=([1.0], [0.0]), points=20, skip=160, steps=100)
    assert section.repeats_after(2e-3) == period


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
