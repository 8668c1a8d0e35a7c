"""Every periodic result carries the spectral radius of its fixed point, its tail and its verdict."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.continuation.branches import frequency_response_curve, parameter_curve
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.receptance import reduce_problem
from femgear.solvers.periodic import harmonic_balance
from femgear.solvers.periodic.equations import HarmonicBalance
from femgear.solvers.periodic.harmonic_balance import (
    periodic_response,
    solve_harmonic_balance,
)
from femgear.solvers.periodic.phase_grid import sample_counts
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.stability import floquet
from femgear.solvers.stability.floquet import floquet_verdict
from femgear.solvers.stability.parametric import stability
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings, RadialBearings
from femgear.system.fourier import (
    FourierSeries,
    StepSeries,
    coincidence_note,
    constant,
    harmonic_lines,
    harmonics_of,
    line_tail,
    side_bands,
)
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.parametric import NATURAL, one_pair, rectangular_monodromy
from validation.reference.branch_switching import branch_maximum
from validation.reference.free_vibration import solve_free_vibration

ONE = np.ones((1, 1))


def oscillator(*elements, damping=0.05, load=0.0, forces=()):
    system = MechanicalSystem(ONE, damping * ONE, 0.0 * ONE, ONE, np.array([load]), ("x",))
    return NonlinearSystem(system, elements, tuple(HarmonicForce([f], orders) for f, orders in forces))


def duffing(force=0.18, orders=(1,)):
    return oscillator(PolynomialSprings([0], [[1.0, 0.0, 0.1]]), forces=[(force, orders)])


def gear_pair(backlash=2.0):
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.3]]), backlash=backlash)
    return oscillator(mesh, damping=0.06, load=0.5)


def solutions_of_all_routes():
    branch = frequency_response_curve(duffing(), (1.6, 1.7), harmonics=5)
    other = parameter_curve(duffing, (0.1, 0.12), 1.6, harmonics=5)
    return {
        "solve_harmonic_balance": [solve_harmonic_balance(duffing(), 1.6, harmonics=5)],
        "periodic_response": [periodic_response(duffing(), 1.6, harmonics=5).solution],
        "frequency_response_curve": branch.solutions,
        "parameter_curve": other.solutions,
        "branch_maximum": [branch_maximum(branch, lambda lines: abs(lines[0, 1]))[2]],
    }


def test_every_route_says_how_far_it_can_be_trusted():
    for route, solutions in solutions_of_all_routes().items():
        for found in solutions:
            assert found.converged and 0.0 < found.tail < 1e-2, route
            assert 0.0 < found.spectral_radius < 1.0, route
            assert found.stable is found.verdict.stable is True and len(found.verdict.multipliers) == 2, route


@pytest.mark.parametrize(("ratio", "radius", "multiplier"), [(2.0, 0.096, 1.090), (1.0, 1.022, 1.005)])
def test_verdict_where_the_fixed_point_converges_to_an_unstable_motion(ratio, radius, multiplier):
    """The gear pair with rectangular k(t), through the plain calls."""
    modes, excitation = one_pair(0.03)
    series = FourierSeries(harmonics_of(excitation.stiffness, 40))
    mesh = GearMeshes([0], series, separates=False)
    problem = oscillator(mesh, damping=0.06 * NATURAL, load=1.0)
    found = solve_harmonic_balance(problem, ratio * NATURAL, harmonics=80)
    assert found.converged and found.spectral_radius == pytest.approx(radius, abs=5e-4)
    assert found.stable is False and abs(found.verdict.multipliers[0]) == pytest.approx(multiplier, abs=5e-4)
    exact = np.abs(np.linalg.eigvals(rectangular_monodromy(ratio, 0.03 * NATURAL))).max()
    assert abs(found.verdict.multipliers[0]) == pytest.approx(exact, abs=1e-4)
    # the solver of the pipeline and its verdict carry the three too
    hertz = np.array([ratio * NATURAL / (2.0 * np.pi)])
    linear = solve_spectral(modes, excitation, hertz, excitation_harmonics=40, response_harmonics=80)
    known = stability(modes, excitation, hertz, excitation_harmonics=40)
    assert linear.converged[0] and linear.spectral_radius[0] == pytest.approx(radius, abs=5e-4)
    assert not known.stable[0] and abs(known.multiplier[0]) == pytest.approx(multiplier, abs=5e-4)
    assert found.tail < 1e-3 and linear.tail[0] < 1e-3


def test_loops_do_without_and_say_so(monkeypatch):
    counted = {"radius": 0, "verdict": 0}
    radius, judged = HarmonicBalance.spectral_radius, floquet.judged

    def counted_radius(self, *arguments):
        counted["radius"] += 1
        return radius(self, *arguments)

    def counted_judged(*arguments, **options):
        counted["verdict"] += 1
        return judged(*arguments, **options)

    monkeypatch.setattr(HarmonicBalance, "spectral_radius", counted_radius)
    monkeypatch.setattr(harmonic_balance, "judged", counted_judged)
    solve_harmonic_balance(duffing(), 1.6, harmonics=8)
    assert counted == {"radius": 1, "verdict": 1}
    bare = [
        solve_harmonic_balance(duffing(), 1.6, harmonics=5, stability=False),
        *frequency_response_curve(duffing(), (1.6, 1.7), harmonics=5, stability=False).solutions,
    ]
    assert counted == {"radius": 1, "verdict": 1}
    for found in bare:
        assert found.stable is None and found.verdict.message == "not asked for"
        assert np.isnan(found.spectral_radius) and np.isfinite(found.tail)
    one = solve_harmonic_balance(duffing(), 1.6, harmonics=5, stability=False, radius=True)
    assert np.isfinite(one.spectral_radius) and one.verdict.message == "not asked for"


def test_what_has_no_verdict_says_why():
    problem = oscillator(PolynomialSprings([0], [[1.0, 0.0, 0.1]]), forces=[(0.1, (1, 0)), (0.05, (0, 1))])
    found = solve_harmonic_balance(problem, [0.7, 0.7 * np.sqrt(3.0)], harmonics=4)
    assert found.stable is None and "not covered: a solution with several" in found.verdict.message
    assert 0.0 < found.spectral_radius < 1.0 and 0.0 < found.tail < 1.0
    still = solve_harmonic_balance(duffing(), 0.0, harmonics=3)
    assert still.stable is None and "no period" in still.verdict.message
    failed = solve_shooting(duffing(), 1.2, start=([5.0], [0.0]), max_iterations=1)
    assert failed.stable is None and "did not converge" in failed.verdict.message


def test_modes_that_do_not_carry_the_motion_leave_the_verdict_open(monkeypatch):
    from femgear.solvers.stability import floquet

    def refuse(*_, **__):
        raise ConvergenceError("too few modes", code="E-RESIDUAL")

    monkeypatch.setattr(floquet, "frame_of", refuse)
    found = solve_harmonic_balance(duffing(), 1.6, harmonics=5)
    assert found.converged and found.stable is None
    assert found.verdict.message == "not determined: too few modes"


@pytest.mark.parametrize(("periods", "bases"), [(1, 1), (2, 1), (1, 2)])
def test_shooting_has_the_multipliers_of_harmonic_balance(periods, bases):
    """Over one period, two of them, and two base frequencies of which the second is twice the first."""
    problem, omega = gear_pair(), 1.6 if bases == 1 else [0.8, 1.6]
    if bases == 2:
        mesh = replace(problem.elements[0], stiffness=FourierSeries([[1.0, 0.3]], orders=(0, 1)))
        problem = replace(problem, elements=(mesh,), forces=(HarmonicForce([0.01], (1, 0)),))
    longer = periods == 2 or bases == 2
    shot = solve_shooting(problem, omega, periods=periods, harmonics=12, settle=40)
    first = 0.8 if longer else 1.6
    one = gear_pair()
    if longer:
        mesh = replace(one.elements[0], stiffness=FourierSeries([[1.0, 0.3]], orders=(2,)))
        force = (HarmonicForce([0.01], (1,)),) if bases == 2 else ()
        one = replace(one, elements=(mesh,), forces=force)
    found = solve_harmonic_balance(one, first, harmonics=12)
    assert shot.solution.converged and shot.solution.frequency[0] == pytest.approx(first)
    sizes = np.abs(shot.verdict.multipliers), np.abs(found.verdict.multipliers)
    np.testing.assert_allclose(*sizes, rtol=1e-4)
    assert shot.stable is found.stable is True


def test_shooting_needs_no_fixed_point():
    """A spring without linear part holds nothing at its reference; the verdict does not need one."""
    problem = oscillator(PolynomialSprings([0], [[0.0, 0.0, 1.0]]), forces=[(0.2, (1,))])
    shot = solve_shooting(problem, 1.0, harmonics=9)
    assert shot.solution.converged and shot.stable is not None and np.isnan(shot.solution.spectral_radius)


def test_free_rotation_and_free_phase_are_left_out_of_the_verdict():
    """A free shaft has two multipliers one, which rounding splits; a free vibration has its phase."""
    W = np.array([[1.0], [-1.0]])
    system = MechanicalSystem(np.diag([1.0, 2.0]), 0.05 * W @ W.T, np.zeros((2, 2)), W, np.zeros(2), ())
    problem = NonlinearSystem(system, (PolynomialSprings([0], [[1.0, 0.0, 0.1]]),), (HarmonicForce([0.2, -0.2]),))
    shot = solve_shooting(problem, 0.9)
    found = floquet_verdict(problem, solve_harmonic_balance(problem, 0.9, harmonics=12))
    assert len(shot.multipliers) == 4 and np.sum(np.abs(shot.multipliers - 1.0) < 1e-4) == 2
    assert len(shot.verdict.multipliers) == len(found.multipliers) == 2
    np.testing.assert_allclose(np.sort_complex(shot.verdict.multipliers), np.sort_complex(found.multipliers), atol=1e-7)
    free = solve_free_vibration(oscillator(PolynomialSprings([0], [[1.0, 0.0, 1.0]]), damping=0.0), ([1.0], [0.0]), 4.8)
    assert free.stable and not len(free.verdict.multipliers) and "phase" in free.verdict.message


def test_tail_of_what_does_not_fluctuate_is_zero():
    still = oscillator(GearMeshes([0], constant([1.0]), backlash=1.0), load=0.5)
    assert solve_harmonic_balance(still, 1.0, harmonics=5).tail == 0.0
    assert solve_shooting(still, 1.0, harmonics=5).solution.tail == 0.0
    orders = np.arange(4)[:, None]
    assert line_tail(np.array([[1.0, 1e-15, 0.0, 1e-15]]), orders) == 0.0
    assert line_tail(np.zeros((1, 4)), orders) == 0.0
    assert line_tail(np.array([[0.0, 3e-15, 0.0, 4e-15]]), orders) == pytest.approx(0.8)
    modes, excitation = one_pair(0.03)
    flat = replace(
        excitation,
        stiffness=np.full_like(excitation.stiffness, excitation.stiffness.mean()),
        deflection=np.zeros_like(excitation.deflection),
        force=np.zeros_like(excitation.force),
    )
    assert solve_spectral(modes, flat, [100.0], excitation_harmonics=3, response_harmonics=6).tail[0] == 0.0


def two_tones(cubic=0.4):
    spring = PolynomialSprings([0], [[1.0, 0.0, cubic]])
    return oscillator(spring, damping=0.2, load=0.3, forces=[(0.2, (1, 0)), (0.1, (0, 1))])


def test_equal_base_frequencies_are_refused_and_coinciding_lines_named():
    with pytest.raises(CaseError, match="E-RANGE") as caught:
        solve_harmonic_balance(two_tones(), [0.8, 0.8 * (1 + 1e-12)], harmonics=3)
    assert "[1, 0]" in caught.value.message and "[0, 1]" in caught.value.message and caught.value.remedy
    found = solve_harmonic_balance(two_tones(), [0.5, 1.5], harmonics=9)
    assert "Lines [0, 0] and [-3, 1] have one frequency" in found.message
    single = replace(two_tones(), forces=(HarmonicForce([0.2], (1,)), HarmonicForce([0.1], (3,))))
    alone = solve_harmonic_balance(single, 0.5, harmonics=24)
    times = np.linspace(0.0, 4.0 * np.pi, 100)
    np.testing.assert_allclose(found.at(times), alone.at(times), atol=1e-3)
    apart = solve_harmonic_balance(two_tones(), [0.5, 0.5 * np.sqrt(7.0)], harmonics=9)
    assert "one frequency" not in apart.message


def test_lines_coincide_to_a_billionth_of_the_highest():
    orders = side_bands(2, 4, 2)
    assert not coincidence_note(orders, [1.0, 108.0])
    one, other = (json.loads(line) for line in re.findall(r"\[.*?\]", coincidence_note(orders, [1.0, 4.0])))
    assert abs(np.dot(one, [1, 4])) == abs(np.dot(other, [1, 4])) and one != other
    assert not coincidence_note(harmonic_lines(3, 2), [1.0, 2.0 + 1e-6])
    assert coincidence_note(harmonic_lines(3, 2), [1.0, 2.0 + 1e-12])
    assert not coincidence_note(harmonic_lines(3), [0.0])


def test_a_branch_passes_equal_base_frequencies_and_flags_the_point():
    found = frequency_response_curve(two_tones(0.1), (0.7, 0.8), harmonics=3, held=(0.0, 0.8))
    assert found.complete and found.converged.all()
    flagged = ["one frequency" in solution.message for solution in found.solutions]
    assert flagged[-1] and not any(flagged[:-1])
    through = frequency_response_curve(two_tones(0.1), (0.7, 0.9), harmonics=3, held=(0.0, 0.8))
    assert through.complete and through.parameter[-1] == 0.9


@pytest.mark.parametrize(
    ("series", "mesh", "instant"),
    [
        (FourierSeries([[1.0, 0.2], [1.0, 1.1j]]), "mesh 2", 0.25),
        (StepSeries([[1.0, -0.2]], [0.0, 0.3]), "mesh 1", 0.3),
    ],
)
def test_parting_teeth_with_negative_stiffness_are_refused(series, mesh, instant):
    columns = np.arange(len(series.mean))
    with pytest.raises(CaseError, match="E-STIFFNESS") as caught:
        GearMeshes(columns, series, backlash=1.0)
    assert mesh in caught.value.message and f"at {instant:g} of its period" in caught.value.message
    assert caught.value.value < 0.0 and caught.value.remedy
    assert not GearMeshes(columns, series, separates=False).separates
    GearMeshes([0], FourierSeries([[1.0, 1.0]]))  # zero at an instant is allowed


def test_frequencies_that_drive_nothing_are_refused():
    for call in (
        lambda: solve_shooting(duffing(), [1.0, 2.0]),
        lambda: solve_transient(duffing(), [1.0, 2.0], [0.0, 1.0]),
        lambda: solve_transient(duffing(), [1.0, 2.0], [0.0, 1.0], method="DOP853"),
    ):
        with pytest.raises(CaseError, match="E-RANGE") as caught:
            call()
        assert "2 base frequencies" in caught.value.message and caught.value.remedy
    two = duffing(orders=(0, 1))
    assert solve_transient(two, [1.0, 2.0], [0.0, 1.0]).converged


def test_refusals_name_what_is_missing():
    with pytest.raises(CaseError, match="E-HARMONICS") as caught:
        solve_harmonic_balance(duffing(orders=(3,)), 1.0, harmonics=0)
    assert caught.value.key == "harmonics" and caught.value.limit == "3 or more"
    still = oscillator(PolynomialSprings([0], [[1.0, 0.0, 1.0]]), load=2.0)
    assert solve_harmonic_balance(still, 1.0, harmonics=0).deflection[0, 0].real == pytest.approx(1.0)
    bodies = MechanicalSystem(
        np.eye(4), np.eye(4), np.diag([1.0, 1.0, 0.0, 0.0]), np.eye(4), np.zeros(4), ("a", "b", "x", "y")
    )
    springs = PolynomialSprings([0, 1], [[1.0, 0.1], [1.0, 0.1]])
    loose = NonlinearSystem(bodies, (springs, RadialBearings([[2, 3]], 0.0, 1e-3)))
    with pytest.raises(ConvergenceError, match="E-RIGID-MODE") as caught:
        solve_harmonic_balance(loose, 1.0, harmonics=3)
    assert "bearing 1" in caught.value.message and "mesh" not in caught.value.message


def test_a_spring_of_no_stiffness_is_named_and_a_soft_one_has_its_mode():
    bodies = MechanicalSystem(np.eye(2), np.eye(2), np.zeros((2, 2)), np.eye(2), np.zeros(2), ("x", "y"))
    stiff, none, soft = (PolynomialSprings([i], [[k, 0.0, 1.0]]) for i, k in ((0, 1e6), (1, 0.0), (1, 1e-9)))
    with pytest.raises(ConvergenceError, match="spring 2 has no linear stiffness"):
        solve_harmonic_balance(NonlinearSystem(bodies, (stiff, none)), 1.0, harmonics=3)
    assert solve_harmonic_balance(NonlinearSystem(bodies, (stiff, soft)), 1.0, harmonics=3).converged
    modes = undamped_modes(bodies, np.array([1e6, 1e-9]))
    assert 2.0 * np.pi * modes.frequency == pytest.approx([1e-9**0.5, 1e3], rel=1e-12)


def test_cubic_spring_alone_is_solved_with_the_reference_that_the_refusal_names():
    """``x'' + x^3 = f cos``: Newton's method with a reference of one, shooting without any."""
    problem = oscillator(PolynomialSprings([0], [[0.0, 0.0, 1.0]]), forces=[(0.2, (1,))])
    with pytest.raises(ConvergenceError, match="spring 1") as caught:
        solve_harmonic_balance(problem, 1.0, harmonics=9)
    assert "reduction=reduce_problem(problem, reference=" in caught.value.remedy
    reduction = reduce_problem(problem, reference=[1.0])
    found = solve_harmonic_balance(problem, 1.0, harmonics=15, reduction=reduction)
    line = found.deflection[0]
    start = [line.sum().real], [(1j * np.arange(16) * line).sum().real]
    shot = solve_shooting(problem, 1.0, start=start, harmonics=15)
    np.testing.assert_allclose(found.deflection, shot.solution.deflection, atol=1e-7)
    assert found.stable is shot.stable is True and found.spectral_radius > 0.0
    np.testing.assert_allclose(
        np.sort_complex(found.verdict.multipliers), np.sort_complex(shot.verdict.multipliers), atol=1e-5
    )


@pytest.mark.parametrize("method", ["average acceleration", "DOP853"])
@pytest.mark.parametrize(("push", "drifts"), [(0.0, False), (0.4, True)])
def test_a_mean_that_drifts_is_said(push, drifts, method):
    W = np.array([[1.0], [-1.0]])
    system = MechanicalSystem(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), W, np.array([1.0, push - 1.0]), ("a", "b"))
    problem = NonlinearSystem(system, (PolynomialSprings([0], [[1.0]]),))
    times = np.linspace(0.0, 20.0, 11)
    found = solve_transient(problem, 1.0, times, method=method)
    assert found.converged and ("drifts" in found.message) is drifts
    # both masses move away by push t^2 / 4
    mean = found.displacement.mean(axis=1)
    np.testing.assert_allclose(mean, push * times**2 / 4.0, atol=1e-3 * (1.0 + push * 100.0))
    held = replace(system, K=np.diag([1e-6, 0.0]))
    held = solve_transient(replace(problem, system=held), 1.0, times, method=method)
    assert "drifts" not in held.message


@pytest.mark.parametrize(("harmonics", "least"), [(3, 2048), (9, 2048), (32, 4096)])
def test_contacts_are_sampled_finely(harmonics, least):
    """Fewer samples ripple branches into limit points, see `test_branches`; smooth springs need few."""
    assert sample_counts(gear_pair(), harmonic_lines(harmonics))[0] >= least
    assert sample_counts(duffing(), harmonic_lines(harmonics))[0] <= 6 * harmonics
