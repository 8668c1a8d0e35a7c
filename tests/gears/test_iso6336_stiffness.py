"""Limits of the method B stiffness; its values are in tests/validation/test_gear_geometry.py."""

import math

import pytest

from femgear.errors import GeometryError
from femgear.gears.iso6336 import (
    basic_rack_factor,
    mesh_stiffness_method_b,
    theoretical_single_stiffness,
)


def test_internal_gear_is_the_limit_of_many_teeth():
    internal = theoretical_single_stiffness(20, math.inf, 0.0, 0.0)
    assert theoretical_single_stiffness(20, 1e12, 0.0, 0.0) == pytest.approx(internal, rel=1e-10)


def test_mean_stiffness_grows_with_the_contact_ratio():
    single, mean = mesh_stiffness_method_b(20, 40, 0.0, 0.0, 1.0)
    assert mean == single
    assert mesh_stiffness_method_b(20, 40, 0.0, 0.0, 2.0)[1] == pytest.approx(1.75 * single)


def test_factors():
    assert basic_rack_factor(dedendum=1.2, pressure_angle=math.radians(20)) == pytest.approx(1.0)
    assert basic_rack_factor(dedendum=1.25, pressure_angle=math.radians(20)) == pytest.approx(0.975)
    assert basic_rack_factor(dedendum=1.2, pressure_angle=math.radians(25)) == pytest.approx(1.1)


def test_numbers_outside_the_method_are_refused():
    with pytest.raises(GeometryError, match="E-ISO6336"):
        theoretical_single_stiffness(20, 5, 0.0, 10.0)
