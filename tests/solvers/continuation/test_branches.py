import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femgear.errors import CaseError
from femgear.solvers.continuation.branches import (
    frequency_response_curve,
    parameter_curve,
)
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.linear.modal import modal_damping
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem, gear_meshes
from validation.reference.branch_switching import branch_maximum, crossing_branches
from validation.reference.cornered_springs import PiecewiseSprings
from validation.reference.stability_boundary import stability_boundary

ONE = np.ones((1, 1))


def duffing(amplitude=0.18):
    system = MechanicalSystem(ONE, 0.05 * ONE, ONE, ONE, np.zeros(1), ("x",))
    cubic = PolynomialSprings(np.array([0]), np.array([[0.0, 0.0, 0.1]]))
    return NonlinearSystem(system, (cubic,), (HarmonicForce(np.array([amplitude])),))


def first(lines):
    return abs(lines[0, 1])


@pytest.fixture(scope="module")
def eleven():
    return frequency_response_curve(duffing(), (0.8, 1.5), harmonics=11, options=StepOptions(largest=0.2))


def test_limit_points_of_the_published_example(eleven):
    # NLvib example 01 with 11 harmonics
    upper, lower = eleven.folds
    assert eleven.complete and eleven.parameter[-1] == 1.5 and not len(eleven.branch_points)
    assert eleven.parameter[upper] == pytest.approx(1.2696019555, abs=1e-9)
    assert first(eleven.lines[upper]) == pytest.approx(2.8250167129, abs=1e-8)
    assert eleven.parameter[lower] == pytest.approx(1.1157002518, abs=1e-9)
    assert first(eleven.lines[lower]) == pytest.approx(1.0818703234, abs=1e-8)
    assert eleven.residual.max() < 1e-10 and eleven.converged.all() and eleven.tail.max() < 1e-4


def test_stability_changes_at_the_limit_points_only(eleven):
    upper, lower = eleven.folds
    assert eleven.stable[:upper].all() and eleven.stable[lower + 1 :].all()
    assert not eleven.stable[upper + 1 : lower].any()
    assert set(eleven.loss[upper + 1 : lower]) == {"fold"}
    np.testing.assert_allclose(eleven.largest_multiplier[[upper, lower]], 1.0, atol=2e-6)


def test_largest_amplitude_between_the_points(eleven):
    frequency, amplitude, solution = branch_maximum(eleven, first)
    assert amplitude == pytest.approx(2.830197, abs=2e-6)
    assert frequency == pytest.approx(1.26869, abs=5e-5)
    assert solution.residual < 1e-9 and first(solution.deflection) == amplitude


def test_one_harmonic_equals_the_closed_form():
    found = frequency_response_curve(
        duffing(), (1.6, 0.8), harmonics=1, stability=False, options=StepOptions(largest=0.2)
    )
    assert found.verdicts == ()
    lower, upper = found.folds
    assert found.parameter[[upper, lower]] == pytest.approx([1.2675369595, 1.1155859272], abs=1e-9)
    a = np.array([first(lines) for lines in found.lines])
    assert a[[upper, lower]] == pytest.approx([2.8362225966, 1.0840801128], abs=1e-8)
    w = found.parameter
    implicit = (a * (1.0 - w**2) + 0.075 * a**3) ** 2 + (0.05 * w * a) ** 2
    np.testing.assert_allclose(implicit, 0.18**2, rtol=1e-8)


@pytest.mark.slow
def test_force_amplitude_as_parameter_reaches_the_same_solutions(eleven):
    found = parameter_curve(
        duffing, (0.02, 0.6), 1.2, harmonics=11, stability=False, scale=1.0, options=StepOptions(largest=0.2)
    )
    assert len(found.folds) == 2 and found.parameter[-1] == 0.6
    # the amplitudes at 0.18 on both curves
    across = np.flatnonzero(np.diff(np.sign(found.parameter - 0.18)) != 0)
    amplitudes = []
    for i in across:
        solution = solve_harmonic_balance(duffing(), 1.2, harmonics=11, start=found.solutions[i])
        amplitudes.append(first(solution.deflection))
    assert sorted(amplitudes) == pytest.approx([0.4175204536, 2.2605488905, 2.5091975811], abs=1e-7)


def gear_pair(backlash=2.0, depth=0.3):
    """One mesh with play, loaded by 0.5: it parts at resonance."""
    system = MechanicalSystem(ONE, 0.06 * ONE, 0.0 * ONE, ONE, np.array([0.5]), ("x",))
    return NonlinearSystem(system, (GearMeshes(np.array([0]), FourierSeries([[1.0, depth]]), backlash=backlash),))


def test_gear_pair_with_backlash_bends_over_twice():
    # contacts that cross the instants of 1152 samples, 128 a harmonic, ripple it into 12 limit points
    lines = {"harmonics": 9}
    found = frequency_response_curve(gear_pair(), (1.3, 0.6), options=StepOptions(largest=0.2), **lines)
    assert found.complete and len(found.folds) == 4 and not len(found.branch_points)
    # loss of contact softens: the curve from above turns back, then contact of the back sides stiffens
    legs = np.split(np.arange(len(found.parameter)), found.folds)
    direction = [np.sign(np.diff(found.parameter[leg])) for leg in legs]
    assert [set(signs) for signs in direction] == [{-1.0}, {1.0}, {-1.0}, {1.0}, {-1.0}]
    stable = [set(found.stable[leg[2:-2]].tolist()) for leg in legs]
    assert stable == [{True}, {False}, {True}, {False}, {True}]
    # every point is a solution for a solver that knows nothing of the curve
    for i in (5, int(found.folds[:2].mean()), len(found.parameter) - 3):
        again = solve_harmonic_balance(gear_pair(), found.parameter[i], start=found.solutions[i], **lines)
        np.testing.assert_allclose(again.deflection, found.lines[i], atol=1e-8)


@pytest.mark.slow
def test_backlash_as_parameter_and_a_limit_that_nothing_may_pass():
    start = solve_harmonic_balance(gear_pair(0.5), 0.9, harmonics=7)
    found = parameter_curve(gear_pair, (0.5, 0.0), 0.9, harmonics=7, start=start, stability=False)
    assert found.complete and found.parameter[-1] == 0.0
    linear = NonlinearSystem(
        gear_pair().system, (GearMeshes(np.array([0]), FourierSeries([[1.0, 0.3]]), separates=False),)
    )
    expected = solve_harmonic_balance(linear, 0.9, harmonics=7)
    np.testing.assert_allclose(found.lines[-1], expected.deflection, atol=1e-9)


def test_parametric_resonance_is_a_branch_point_and_can_be_entered():
    # x'' + c x' + (1 + 0.4 cos 2 theta) x + 0.1 x^3 = 0: rest loses its stability in the Mathieu tongue
    system = MechanicalSystem(ONE, 0.05 * ONE, 0.0 * ONE, ONE, np.zeros(1), ("x",))
    wave = FourierSeries([[1.0, 0.4]], orders=(2,))
    mesh = GearMeshes(np.array([0]), wave, separates=False)
    cubic = PolynomialSprings(np.array([0]), np.array([[0.0, 0.0, 0.1]]))
    problem = NonlinearSystem(system, (mesh, cubic))
    rest = frequency_response_curve(problem, (0.7, 1.4), harmonics=9, start=np.zeros((1, 10)), scale=1.0)
    assert not np.any(rest.lines) and len(rest.branch_points) == 2
    linear = NonlinearSystem(system, ())
    tongue = [
        stability_boundary(linear, FourierSeries([[1.0, 0.4]]), ends, depth=1.0, tolerance=1e-10) / 2.0
        for ends in ((1.4, 2.0), (2.0, 2.6))
    ]
    found = rest.parameter[rest.branch_points]
    np.testing.assert_allclose(found, tongue, atol=1e-6)
    inside = (rest.parameter > tongue[0] + 1e-6) & (rest.parameter < tongue[1] - 1e-6)
    away = inside | (rest.parameter < tongue[0] - 1e-6) | (rest.parameter > tongue[1] + 1e-6)
    assert not rest.stable[inside].any() and rest.stable[away & ~inside].all()
    sides = crossing_branches(rest, rest.branch_points[0], options=StepOptions(largest=0.2))
    ends = [side.lines[-1][0, 1] for side in sides]
    assert sides[0].complete and sides[1].complete and abs(ends[0]) > 1.0
    # the two sides are one motion, half a period apart
    assert ends[0] == pytest.approx(-ends[1], rel=1e-8)
    assert sides[0].stable[5] and abs(sides[0].lines[5][0, 0]) < 1e-12


def subharmonic(force=4.0, damping=0.05, cubic=0.2):
    """Duffing's oscillator forced at three times the base frequency."""
    system = MechanicalSystem(ONE, damping * ONE, ONE, ONE, np.zeros(1), ("x",))
    spring = PolynomialSprings(np.array([0]), np.array([[0.0, 0.0, cubic]]))
    return NonlinearSystem(system, (spring,), (HarmonicForce(np.array([force]), (3,)),))


def on_the_loop(frequency, amplitude):
    """Subharmonic motion whose first harmonic has about this amplitude, whatever its phase."""
    for phase in np.arange(16) * np.pi / 8:
        start = np.zeros((1, 10), complex)
        start[0, [1, 3]] = amplitude * np.exp(1j * phase), 4.0 / (1.0 - 9.0 * frequency**2)
        found = solve_harmonic_balance(subharmonic(), frequency, harmonics=9, start=start, radius=False)
        if found.converged and abs(first(found.deflection) - amplitude) < 0.01:
            return found
    raise AssertionError("no subharmonic motion found")


@pytest.mark.slow
def test_subharmonic_motions_of_order_three_form_an_isola():
    """Nayfeh and Mook, Nonlinear Oscillations (1979), section 4.2.2: none grows out of the forced motion."""
    options = {"harmonics": 9, "scale": 1.0, "options": StepOptions(largest=0.2)}
    loops = [
        frequency_response_curve(subharmonic(), ends, start_at=w, start=on_the_loop(w, a), stability=k == 0, **options)
        for k, (ends, w, a) in enumerate(
            [((0.9, 2.3), 1.6, 3.2369), ((2.3, 0.9), 1.2, 1.5102), ((0.9, 2.3), 1.8, 3.7703)]
        )
    ]
    known = loops[0].lines[np.argmin(loops[0].parameter), 0, 1]
    for loop in loops:
        assert loop.closed and loop.complete and len(loop.folds) == 2 and not len(loop.branch_points)
        np.testing.assert_allclose(loop.lines[-1], loop.lines[0], atol=1e-6)
        left, right = sorted(loop.folds, key=lambda i: loop.parameter[i])
        # the same loop from everywhere, up to a shift in time by periods of the force
        np.testing.assert_allclose(loop.parameter[[left, right]], [1.0722824082, 1.8666984372], atol=1e-9)
        turns = 3.0 * np.angle(loop.lines[left, 0, 1] / known) / (2.0 * np.pi)
        assert turns == pytest.approx(round(turns), abs=1e-5)
        assert loop.parameter.min() == loop.parameter[left] and loop.parameter.max() == loop.parameter[right]
    # started on the upper side, which is stable; the lower one lies between the limit points
    loop, (one, other) = loops[0], loops[0].folds
    assert loop.stable[:one].all() and loop.stable[other + 1 :].all()
    assert not loop.stable[one + 1 : other].any() and set(loop.loss[one + 1 : other]) == {"fold"}


def test_motion_on_the_isola_is_what_integration_in_time_settles_on():
    found = on_the_loop(1.6, 3.2369)
    period = 2.0 * np.pi / 1.6
    start = [found.at(0.0)[0], (1j * found.line_frequency * found.deflection[0]).sum().real]
    times = period * (40 + np.arange(64) / 64)
    run = solve_ivp(
        lambda t, y: [y[1], 4.0 * np.cos(4.8 * t) - 0.05 * y[1] - y[0] - 0.2 * y[0] ** 3],
        (0.0, times[-1]),
        start,
        method="DOP853",
        rtol=1e-9,
        atol=1e-10,
        t_eval=times,
    )
    settled = 2.0 * abs(np.fft.rfft(run.y[0])[1]) / 64
    assert settled == pytest.approx(first(found.deflection), rel=2e-3)


def test_held_base_and_a_second_tone():
    problem = replace(
        duffing(), forces=(HarmonicForce(np.array([0.05]), (1, 0)), HarmonicForce(np.array([0.02]), (0, 1)))
    )
    found = frequency_response_curve(problem, (0.6, 0.8), harmonics=3, base=0, held=(1.0, 0.37))
    np.testing.assert_allclose(found.frequency[:, 1], 0.37)
    assert found.frequency[-1, 0] == 0.8 and found.complete
    again = solve_harmonic_balance(problem, (0.8, 0.37), harmonics=3)
    np.testing.assert_allclose(found.lines[-1], again.deflection, atol=1e-9)
    assert not found.stable.any() and all("not covered" in v.message for v in found.verdicts)


def test_planet_set_keeps_its_equations_and_verdicts(planet_set, planet_excitation):
    excitation = planet_excitation(np.array([0.0, 1 / 3, 2 / 3, 0.1, 0.1 + 1 / 3, 0.1 + 2 / 3]), depth=0.25)
    excitation = replace(excitation, backlash=np.full(6, 0.5))
    system = planet_set()
    system = replace(system, C=modal_damping(system, excitation.stiffness.mean(axis=1), 0.03))
    problem = NonlinearSystem(system, (gear_meshes(excitation, harmonics=3),))
    found = frequency_response_curve(problem, (2.5, 2.7), harmonics=8, options=StepOptions(largest=0.2))
    assert found.complete and found.residual.max() < 1e-10 and len(found.verdicts) == len(found.parameter)
    assert all(v.error < 1e-7 and len(v.multipliers) == 30 for v in found.verdicts)
    again = solve_harmonic_balance(problem, 2.7, harmonics=8)
    np.testing.assert_allclose(found.lines[-1], again.deflection, atol=1e-9)


def two_masses(smoothing, *, between=False, forced=0):
    """Ground-spring-mass-spring-mass with 1 kg and 1e6 N/m each, 30 N, and a gap of 0.1 mm on both sides.

    The gap is that of the second mass to the ground, or the one between both masses.
    """
    contact, gap = 5e6, 1e-4
    column = np.array([[-1.0], [1.0]]) if between else np.array([[0.0], [1.0]])
    stiffness = 1e6 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    system = MechanicalSystem(np.eye(2), 0 * stiffness, stiffness, column, np.zeros(2), ("x1", "x2"))
    system = replace(system, C=modal_damping(system, np.zeros(1), 0.008))
    stops = PiecewiseSprings([0], [-gap, gap], [contact, 0.0, contact], smoothing)
    return NonlinearSystem(system, (stops,), (HarmonicForce(30.0 * np.eye(2)[forced]),))


TWO_HZ = (2 * np.pi * 40.0, 2 * np.pi * 250.0)


@pytest.fixture(scope="module")
def stops():
    return frequency_response_curve(two_masses(1e-6), TWO_HZ, harmonics=9, options=StepOptions(largest=0.2))


@pytest.mark.slow
def test_two_masses_with_stops_are_followed_over_both_symmetry_losses(stops):
    """Where the motion loses its symmetry the equations are singular: the branch goes on behind it."""
    assert stops.complete and stops.parameter[-1] == TWO_HZ[1]
    assert stops.residual.max() < 1e-10 and stops.converged.all()
    assert len(stops.folds) == 2 and len(stops.branch_points) == 2
    # symmetric motions have odd harmonics only; they are stable up to the first branch point or fold
    assert np.abs(stops.lines[:, 0, ::2]).max() < 1e-12
    one, other = stops.branch_points
    top, bottom = stops.folds
    legs = np.split(stops.stable, [one, other, top, bottom])
    stable = [set(leg[2:-2].tolist()) for leg in legs]
    assert stable == [{True}, {False}, {True}, {False}, {True}]
    # without contact the response is linear: 40 Hz is below the first resonance at 98.4 Hz
    system, omega = stops.equations.balance.problem.system, TWO_HZ[0]
    dynamic = system.K - omega**2 * system.M + 1j * omega * system.C
    linear = np.linalg.solve(dynamic, [30.0, 0.0])[1]
    assert stops.lines[0, 0, 1] == pytest.approx(linear, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("hertz", "leg"), [(105.0, "one"), (200.0, "top")])
def test_two_masses_with_stops_against_integration_in_time(stops, hertz, leg):
    """SciPy's integrator settles on the motions of the branch from starts that are 1 % off."""
    problem, (one, other), (top, _) = stops.equations.balance.problem, stops.branch_points, stops.folds
    part = {"one": np.arange(one), "top": np.arange(other, top)}[leg]
    i = part[np.argmin(np.abs(stops.parameter[part] - 2 * np.pi * hertz))]
    solution, omega = stops.solutions[i], stops.parameter[i]
    lines = displacements(problem, solution)
    start = 1.01 * np.concatenate([lines.sum(axis=1).real, (1j * solution.line_frequency * lines).sum(1).real])
    system, gap, soft = problem.system, 1e-4, 1e-6
    (k1, k2, k3), (c1, c2, c3) = ((m[0, 0], m[0, 1], m[1, 1]) for m in (system.K, system.C))

    def rate(t, y):
        x, z, u, v = y
        over, under = z - gap, -z - gap
        over, under = (0.5 * (d + math.sqrt(d * d + soft * soft)) for d in (over, under))
        one = 30.0 * math.cos(omega * t) - k1 * x - k2 * z - c1 * u - c2 * v
        return [u, v, one, -k2 * x - k3 * z - c2 * u - c3 * v - 5e6 * (over - under)]

    period = 2 * np.pi / omega
    times = period * (200 + np.arange(128) / 128)
    run = solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", rtol=1e-8, atol=1e-12, t_eval=times)
    settled = np.fft.rfft(run.y[1])[1] / 64
    assert abs(settled - solution.deflection[0, 1]) < 2e-4 * abs(settled)
    assert np.abs(run.y[1]).max() == pytest.approx(np.abs(solution.at(times)).max(), rel=2e-3)


@pytest.mark.slow
def test_motions_that_lost_their_symmetry_form_a_closed_loop(stops):
    side, mirrored = crossing_branches(
        stops, stops.branch_points[0], stability=False, options=StepOptions(largest=0.2, max_points=200)
    )
    for loop in (side, mirrored):
        assert loop.closed and loop.message == "closed loop"
        ends = stops.parameter[stops.branch_points]
        np.testing.assert_allclose([loop.parameter.min(), loop.parameter.max()], ends, rtol=1e-5)
        assert np.abs(loop.lines[:, 0, 0]).max() > 2e-5


@pytest.mark.slow
def test_sharp_corners_of_sampled_contact_are_passed():
    """Without smoothing the first samples in contact turn the tangent by 0.4 rad at once, at 85.8 Hz."""
    problem = two_masses(0.0, between=True, forced=1)
    found = frequency_response_curve(problem, TWO_HZ, harmonics=9, stability=False, options=StepOptions(max_points=150))
    assert found.message.startswith("stopped") and found.parameter[-1] > 2 * np.pi * 86.0
    corrected = np.delete(found.residual, found.branch_points)
    assert corrected.max() < 1e-10 and found.residual.max() < 1e-7


def test_lost_branch_says_what_to_change():
    options = StepOptions(first=1e-2, smallest=9e-3, max_points=200)
    found = frequency_response_curve(two_masses(0.0), TWO_HZ, harmonics=3, stability=False, options=options)
    assert not found.complete and found.message.startswith("lost after frequency")
    assert "smoothing length, such as 1e-06 m" in found.message
    assert "StepOptions(smallest)" in found.message


def test_refusals():
    with pytest.raises(CaseError, match="E-RANGE"):
        frequency_response_curve(duffing(), (1.0, 1.0), harmonics=3)
    with pytest.raises(CaseError, match="E-RANGE"):
        frequency_response_curve(duffing(), (1.0, 1.2), harmonics=3, base=1)
    with pytest.raises(CaseError, match="start_at"):
        frequency_response_curve(duffing(), (1.0, 1.2), harmonics=3, start_at=1.3)
    with pytest.raises(CaseError, match="E-RANGE"):
        parameter_curve(duffing, (0.1, 0.1), 1.2, harmonics=3)


def test_messages_name_the_frequency_and_its_unit(eleven):
    """1.5 rad/s are 0.238732 Hz; a parameter without a unit keeps its bare value."""
    assert eleven.message == "end of the range at frequency 1.5 rad/s (0.238732 Hz)"
    few = frequency_response_curve(duffing(), (0.8, 1.5), harmonics=3, options=StepOptions(max_points=5))
    last = few.parameter[-1]
    where = f"stopped at frequency {last:.6g} rad/s ({last / (2 * np.pi):.6g} Hz) after 5 points"
    assert few.message == where + ": raise max_points, largest or the scale"
    bare = parameter_curve(duffing, (0.1, 0.2), 0.9, harmonics=3, stability=False)
    assert bare.message == "end of the range at parameter = 0.2"
    with pytest.raises(CaseError, match="frequency 2 rad/s"):
        frequency_response_curve(duffing(), (0.8, 1.5), harmonics=3, start_at=2.0)
