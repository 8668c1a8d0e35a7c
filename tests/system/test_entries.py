"""Text in place of numbers, and tolerances out of range, at every entry point of the solvers."""

import numpy as np
import pytest
from small_trains import gear_pair

from femgear.errors import CaseError, ConvergenceError, checked_numbers, checked_tolerance
from femgear.solvers.continuation.branches import frequency_response_curve, parameter_curve
from femgear.solvers.linear.receptance import reduce_problem
from femgear.solvers.periodic.harmonic_balance import (
    periodic_response,
    solve_harmonic_balance,
)
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.stability.floquet import floquet_verdict
from femgear.solvers.stability.lyapunov import lyapunov_exponents
from femgear.solvers.stability.parametric import stability_chart
from femgear.solvers.time.stroboscopic import (
    sweep_response,
    sweep_up_and_down,
)
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings, RadialBearings
from femgear.system.fourier import FourierSeries, StepSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.reference.cornered_springs import PiecewiseSprings
from validation.reference.free_vibration import solve_free_vibration
from validation.reference.sections import bifurcation_diagram, stroboscopic_section
from validation.reference.stability_boundary import stability_boundary

SYSTEM = gear_pair((1.2e-3, 4.5e-3), (0.04, 0.07), torque=120.0, mesh_damping=900.0)
PROBLEM = NonlinearSystem(SYSTEM, (GearMeshes([0], FourierSeries([[3e8, 6e7]])),))
OMEGA = 2.7e4
BY_FREQUENCY = {
    "harmonic balance": lambda w: solve_harmonic_balance(PROBLEM, w, harmonics=3),
    "periodic response": lambda w: periodic_response(PROBLEM, w, harmonics=3),
    "curve": lambda w: frequency_response_curve(PROBLEM, (w, OMEGA), harmonics=3),
    "curve of a parameter": lambda w: parameter_curve(lambda _: PROBLEM, (0.0, 1.0), w, harmonics=3),
    "shooting": lambda w: solve_shooting(PROBLEM, w),
    "sweep": lambda w: sweep_response(PROBLEM, w),
    "up and down": lambda w: sweep_up_and_down(PROBLEM, w),
    "transient": lambda w: solve_transient(PROBLEM, w, [0.0, 1e-4]),
    "section": lambda w: stroboscopic_section(PROBLEM, w),
    "Lyapunov": lambda w: lyapunov_exponents(PROBLEM, w),
    "chart": lambda w: stability_chart(PROBLEM, FourierSeries([[3e8, 6e7]]), w, [0.0, 1.0]),
}
BY_TOLERANCE = {
    "harmonic balance": lambda e: solve_harmonic_balance(PROBLEM, OMEGA, harmonics=3, tolerance=e),
    "verdict": lambda e: periodic_response(PROBLEM, OMEGA, harmonics=3, stability_tolerance=e),
    "floquet": lambda e: floquet_verdict(
        PROBLEM, solve_harmonic_balance(PROBLEM, OMEGA, harmonics=3, stability=False), tolerance=e
    ),
    "shooting": lambda e: solve_shooting(PROBLEM, OMEGA, tolerance=e),
    "integration": lambda e: solve_shooting(PROBLEM, OMEGA, integration=e),
    "free vibration": lambda e: solve_free_vibration(PROBLEM, None, 1.0, tolerance=e),
    "sweep": lambda e: sweep_response(PROBLEM, [OMEGA], tolerance=e),
    "curve": lambda e: frequency_response_curve(PROBLEM, (2.6e4, OMEGA), harmonics=3, tolerance=e),
    "curve of a parameter": lambda e: parameter_curve(lambda _: PROBLEM, (0.0, 1.0), OMEGA, harmonics=3, tolerance=e),
    "transient": lambda e: solve_transient(PROBLEM, OMEGA, [0.0, 1e-4], tolerance=e),
    "diagram": lambda e: bifurcation_diagram(lambda _: (PROBLEM, OMEGA), [1.0], tolerance=e),
    "chart": lambda e: stability_chart(PROBLEM, FourierSeries([[3e8]]), [OMEGA], [0.0], tolerance=e),
    "boundary": lambda e: stability_boundary(PROBLEM, FourierSeries([[3e8]]), (0.0, 1.0), frequency=OMEGA, tolerance=e),
}


@pytest.mark.parametrize("value", ["7 kHz", "7000", None, 1j])
@pytest.mark.parametrize("name", BY_FREQUENCY)
def test_a_frequency_that_is_no_number_is_refused(name, value):
    with pytest.raises(CaseError) as error:
        BY_FREQUENCY[name](value)
    assert error.value.code in ("E-RANGE", "E-RANGE") and error.value.remedy
    assert "rad/s" in error.value.limit and repr(value).strip("'") in str(error.value)


@pytest.mark.parametrize("value", [1.0, 10.0, 0.0, -1e-6, np.nan, np.inf, "1e-6"])
@pytest.mark.parametrize("name", BY_TOLERANCE)
def test_a_tolerance_is_between_0_and_1(name, value):
    with pytest.raises(CaseError) as error:
        BY_TOLERANCE[name](value)
    assert error.value.code == "E-RANGE" and error.value.remedy


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda: StepSeries([0.5], [[1.0, -2.0]]), "E-SHAPE"),
        (lambda: StepSeries("a", [0.0]), "E-SHAPE"),
        (lambda: StepSeries([[1.0, 2.0]], []), "E-SHAPE"),
        (lambda: StepSeries([[1.0, 2.0]], [0.0, np.nan]), "E-SHAPE"),
        (lambda: StepSeries([[1.0, np.nan]], [0.0, 0.5]), "E-FINITE"),
        (lambda: FourierSeries("3e8 N/m"), "E-SHAPE"),
        (lambda: FourierSeries([[1.0], [1.0, 2.0]]), "E-SHAPE"),
        (lambda: HarmonicForce("1 N"), "E-SHAPE"),
        (lambda: GearMeshes([0], 3e8), "E-SHAPE"),
        (lambda: GearMeshes([0], FourierSeries([[1.0]]), backlash="40 um"), "E-BACKLASH"),
        (lambda: GearMeshes([0], FourierSeries([[1.0]]), smoothing="1 um"), "E-RANGE"),
        (lambda: PolynomialSprings([0], "a"), "E-SHAPE"),
        (lambda: PiecewiseSprings([0], "a", "b"), "E-SHAPE"),
        (lambda: RadialBearings([[0, 1]], "1e8 N/m", 1e-5), "E-SHAPE"),
        (lambda: solve_harmonic_balance(PROBLEM, OMEGA, harmonics="8"), "E-HARMONICS"),
        (lambda: solve_harmonic_balance(PROBLEM, OMEGA, harmonics=2.5), "E-HARMONICS"),
        (lambda: solve_harmonic_balance(PROBLEM, OMEGA, harmonics=3, start="rest"), "E-START"),
        (lambda: solve_harmonic_balance(PROBLEM, OMEGA, harmonics=3, max_iterations="9"), "E-RANGE"),
        (lambda: solve_shooting(PROBLEM, OMEGA, periods="2"), "E-RANGE"),
        (lambda: solve_transient(PROBLEM, OMEGA, "1 s"), "E-RANGE"),
        (lambda: solve_transient(PROBLEM, OMEGA, [0.0, 1e-4], step="1 us"), "E-RANGE"),
        (lambda: frequency_response_curve(PROBLEM, (1.0, 2.0, 3.0), harmonics=3), "E-RANGE"),
    ],
)
def test_text_and_wrong_shapes_are_refused_by_name(call, code):
    with pytest.raises(CaseError) as error:
        call()
    assert error.value.code == code


def test_steps_given_in_the_wrong_order_are_told_apart():
    with pytest.raises(CaseError, match="values come first"):
        StepSeries([0.0, 0.5], [[1.0, -2.0]])


def test_numbers_pass_as_they_are():
    assert checked_tolerance(1e-9) == 1e-9
    np.testing.assert_array_equal(checked_numbers([1, 2.5], "x", code="E", unit=""), [1.0, 2.5])
    np.testing.assert_array_equal(checked_numbers(1j, "x", code="E", unit="", kind=complex), 1j)


def test_a_negative_stiffness_of_a_turning_system_names_the_speed():
    """k - m speed^2 below zero above the critical speed; without gyroscopic terms only signs are named."""
    G = np.array([[0.0, -2.0], [2.0, 0.0]])
    for gyroscopic, told in ((G, True), (None, False)):
        K = (1.0 - 1.5**2) * np.eye(2)
        system = MechanicalSystem(np.eye(2), np.zeros((2, 2)), K, np.eye(2)[:, :1], np.zeros(2), ("x", "y"), gyroscopic)
        problem = NonlinearSystem(system, (PolynomialSprings([0], [[0.1]]),), speed=1.5)
        with pytest.raises(ConvergenceError, match="stiffness matrix is negative") as error:
            reduce_problem(problem)
        assert error.value.code == "E-STIFFNESS" and ("centripetal" in error.value.remedy) is told
        assert "signs of supports" in error.value.remedy
