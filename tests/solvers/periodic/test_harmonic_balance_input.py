"""Input that harmonic balance refuses."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.linear.receptance import reduce_problem
from femgear.solvers.periodic.equations import harmonic_balance
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem


def duffing():
    system = MechanicalSystem(np.eye(1), np.array([[0.05]]), np.zeros((1, 1)), np.eye(1), np.zeros(1), ("x",))
    springs = PolynomialSprings([0], [[1.0, 0.0, 0.1]])
    return NonlinearSystem(system, (springs,), (HarmonicForce([0.18], (1,)),))


def two_base_problem():
    system = MechanicalSystem(np.eye(2), np.eye(2), np.eye(2), np.eye(2), np.ones(2), ("x", "y"))
    mesh = GearMeshes([1], FourierSeries([[1.0, 0.3]], (0, 1)))
    return NonlinearSystem(system, (mesh,), (HarmonicForce([0.5, 0.5j], (-1,)),))


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({}, "E-HARMONICS"),
        ({"harmonics": 3, "orders": [[0], [1]]}, "E-HARMONICS"),
        ({"orders": [[1], [0]]}, "E-HARMONICS"),
        ({"orders": [[0], [2]]}, "E-HARMONICS"),
        ({"harmonics": 3, "samples": 6}, "E-HARMONICS"),
        ({"harmonics": 3, "samples": (8, 8)}, "E-HARMONICS"),
        ({"harmonics": 3, "frequency": -1.0}, "E-RANGE"),
        ({"harmonics": 3, "frequency": np.nan}, "E-RANGE"),
        ({"harmonics": 3, "frequency": [1.0, 2.0]}, "E-RANGE"),
        ({"harmonics": 3, "start": np.zeros((1, 3))}, "E-START"),
        ({"harmonics": 3, "start": np.full((1, 4), np.nan)}, "E-START"),
        ({"harmonics": 3, "tolerance": 0.0}, "E-RANGE"),
        ({"harmonics": 3, "max_iterations": 0}, "E-RANGE"),
        ({"harmonics": -1}, "E-HARMONICS"),
    ],
)
def test_input_that_cannot_be_used_is_refused(options, code):
    frequency = options.pop("frequency", 1.2)
    with pytest.raises(CaseError) as error:
        solve_harmonic_balance(duffing(), frequency, **options)
    assert error.value.code == code


def test_lines_need_an_order_for_every_base():
    with pytest.raises(CaseError) as error:
        harmonic_balance(two_base_problem(), orders=[[0], [1]])
    assert error.value.code == "E-HARMONICS"


def test_reduction_of_another_problem_is_refused():
    with pytest.raises(CaseError) as error:
        harmonic_balance(two_base_problem(), harmonics=2, reduction=reduce_problem(duffing()))
    assert error.value.code == "E-SHAPE"
