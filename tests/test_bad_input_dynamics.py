"""Wrong or hopeless dynamic questions: each is refused, or answered with what makes it doubtful."""

from types import SimpleNamespace

import numpy as np
import pytest

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.continuation.branches import frequency_response_curve
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.harmonic_balance import periodic_response, solve_harmonic_balance
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, MeshExcitation, NonlinearSystem
from femgear.trains.elastic.checks import check_rim_speed
from femgear.trains.reading import read_case, with_value


def oscillator(*elements, damping=0.0, load=0.0, forces=()):
    """Unit mass on its elements."""
    system = MechanicalSystem(np.eye(1), np.array([[damping]]), np.zeros((1, 1)), np.eye(1), np.array([load]), ("x",))
    return NonlinearSystem(system, elements, tuple(HarmonicForce([f], o) for f, o in forces))


def test_undamped_resonance_is_refused_with_its_frequency():
    """Natural frequency sqrt(4)/2 pi = 0.31831 Hz."""
    problem = oscillator(PolynomialSprings([0], [[4.0]]), forces=[(1.0, (1,))])
    with pytest.raises(ConvergenceError, match=r"E-RESONANCE.*0\.31831 Hz"):
        solve_harmonic_balance(problem, 2.0, harmonics=1)


def rectangular(harmonics=40, ratio=0.03):
    """Rectangular k(t) of 1 and 0.65 with 63.5 % of the period stiff, mean 1: natural frequency 1 rad/s."""
    n = np.arange(1, harmonics + 1)
    low = 1.0 - 0.35 * 0.365
    wave = 0.35 / low * 2.0 * np.sin(np.pi * n * 0.635) / (np.pi * n)
    return oscillator(GearMeshes([0], FourierSeries([[1.0, *wave]]), separates=False), damping=2.0 * ratio, load=1.0)


def test_a_converged_fixed_point_does_not_hide_parametric_instability():
    """At twice the natural frequency the main instability band, where the plain iteration converges."""
    found = periodic_response(rectangular(), 2.0, harmonics=20)
    assert found.solution.converged and found.spectral_radius < 1.0
    assert found.stable is False and "flip" in found.verdict.loss


def test_where_the_fixed_point_diverges_the_direct_solution_steps_in_and_says_so():
    found = rectangular()
    record = found.elements[0].stiffness.at(2.0 * np.pi * np.arange(256)[:, None] / 256).T
    modes = undamped_modes(found.system, record.mean(axis=1))
    deflection = 1.0 / record
    excitation = MeshExcitation(record, deflection, np.ones_like(record), np.array([np.inf]))
    response = solve_spectral(
        modes, excitation, np.array([1.0]) / (2.0 * np.pi), excitation_harmonics=40, response_harmonics=80
    )
    assert response.spectral_radius[0] > 1.0 and response.converged[0]
    assert f"{response.spectral_radius[0]:.3g}" in response.message and "direct" in response.message


def test_too_few_harmonics_show_in_the_tail():
    few = periodic_response(rectangular(), 1.0, harmonics=4)
    many = periodic_response(rectangular(), 1.0, harmonics=32)
    assert few.solution.converged and many.tail**2 < 1e-6 < few.tail**2


def test_a_step_beyond_the_stability_limit_is_refused_with_the_limit():
    """Central differences: h < T/pi (T. J. R. Hughes, The Finite Element Method, 2000, 9.1)."""
    problem = oscillator(PolynomialSprings([0], [[(2.0 * np.pi) ** 2]]))
    with pytest.raises(CaseError, match="E-RANGE") as error:
        solve_transient(problem, 0.0, [0.0, 100.0], method="central difference", step=0.4)
    assert "0.3183" in error.value.limit


def test_a_lost_branch_names_its_last_good_point():
    problem = oscillator(PolynomialSprings([0], [[1.0, 0.0, 0.1]]), damping=0.05, forces=[(0.18, (1,))])
    options = StepOptions(first=1e-3, smallest=1e-3, largest=1e-3, max_points=6)
    branch = frequency_response_curve(problem, (0.8, 1.6), harmonics=5, options=options)
    assert not branch.complete and branch.converged.all()
    assert f"{branch.parameter[-1]:.6g}"[:6] in branch.message


def test_speeds_through_zero_are_refused():
    case = read_case("cases/planetary_27_40_108.toml")
    for speeds in (["0 rpm"], ["-100 rpm", "100 rpm"], {"from": "-10 rpm", "to": "10 rpm", "count": 3}):
        with pytest.raises(CaseError, match=r"operation\.speeds"):
            with_value(case, "operation.speeds", speeds)
    with pytest.raises(CaseError, match="E-RANGE"):
        frequency_response_curve(rectangular(), (0.0, 1.0), harmonics=3)


def test_planets_faster_than_the_waves_of_the_ring_are_refused():
    """f_n / n of a free ring rises with n; on a foundation it has a minimum: here 900/3 Hz = 18000 rpm."""
    modes = SimpleNamespace(nodal_diameter=np.array([0, 1, 2, 3]), frequency=np.array([10.0, 400.0, 700.0, 900.0]))
    check_rim_speed(modes, [2.0 * np.pi * 299.9])
    with pytest.raises(CaseError, match="E-SPEED") as error:
        check_rim_speed(modes, [10.0, 2.0 * np.pi * 300.1])
    assert "18000 rpm" in error.value.limit and "3 nodal diameters" in str(error.value)
