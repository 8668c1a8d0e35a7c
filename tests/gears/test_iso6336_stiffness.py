"""Limits of method B of ISO 6336-1; its values are in tests/validation/test_gear_geometry.py."""

import math

import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.iso6336_stiffness import (
    basic_rack_factor,
    gear_blank_factor,
    line_load_factor,
    mesh_stiffness_method_b,
    pair_mesh_stiffness,
    theoretical_single_stiffness,
)
from femgear.gears.pair import GearPair
from femgear.gears.profile import BasicRack, transverse_rack, transverse_tool


def test_internal_gear_is_the_limit_of_many_teeth():
    internal = theoretical_single_stiffness(20, math.inf, 0.0, 0.0)
    assert theoretical_single_stiffness(20, 1e12, 0.0, 0.0) == pytest.approx(internal, rel=1e-10)


def test_mean_stiffness_grows_with_the_contact_ratio():
    single, mean = mesh_stiffness_method_b(20, 40, 0.0, 0.0, 1.0)
    assert mean == single
    assert mesh_stiffness_method_b(20, 40, 0.0, 0.0, 2.0)[1] == pytest.approx(1.75 * single)


def test_factors_of_the_stiffness():
    assert basic_rack_factor(dedendum=1.2, pressure_angle=math.radians(20)) == pytest.approx(1.0)
    assert basic_rack_factor(dedendum=1.25, pressure_angle=math.radians(20)) == pytest.approx(0.975)
    assert basic_rack_factor(dedendum=1.2, pressure_angle=math.radians(25)) == pytest.approx(1.1)


def test_numbers_outside_the_stiffness_method_are_refused():
    with pytest.raises(GeometryError, match="E-ISO6336"):
        theoretical_single_stiffness(20, 5, 0.0, 10.0)


def pair_of_normal_section(teeth, shifts, *, module, degrees, distance, rack, tips=(None, None)):
    """Pair of helical gears by their normal section; lengths in mm."""
    beta = math.radians(degrees)
    transverse, angle = transverse_tool(module * 1e-3, math.radians(20.0), beta)
    gears = (
        Gear(
            z,
            transverse,
            angle,
            x * math.cos(beta),
            0.1,
            0.3 * z * transverse,
            rack=transverse_rack(rack, beta),
            tip_diameter=tip and tip * 1e-3,
        )
        for z, x, tip in zip(teeth, shifts, tips, strict=True)
    )
    return GearPair(*gears, distance * 1e-3)


ISO_EXAMPLE = pair_of_normal_section(
    (17, 103), (0.145, 0.0), module=8, degrees=15.8, distance=500, rack=BasicRack(1.0, 1.4, 0.39)
)
WIND = pair_of_normal_section(
    (24, 95),
    (0.48, 0.6691),
    module=14,
    degrees=10,
    distance=861,
    rack=BasicRack(1.0, 1.25, 0.38),
    tips=(380.747, 1395.376),
)


def test_virtual_teeth_are_those_of_the_base_helix():
    """ISO/TR 6336-30:2017, example 1: c'_th 17.85584, c' 12.37047, c_gamma_alpha 17.46485 N/(mm um)."""
    beta = math.radians(15.8)
    solid = theoretical_single_stiffness(17, 103, 0.145, 0.0, helix_angle=beta)
    assert solid == pytest.approx(17.85584e9, rel=1e-6)
    single, mean = pair_mesh_stiffness(ISO_EXAMPLE, beta)
    assert single == pytest.approx(12.37047e9, rel=1e-6)
    # its contact ratio is that of diameters rounded to a hundredth of a millimetre
    assert mean == pytest.approx(17.46485e9, rel=2e-4)


@pytest.mark.parametrize("turned", [False, True])
def test_gear_1_of_the_standard_is_the_pinion(turned):
    """The pinion has the smaller shift: KISSsoft prints 13.832 and 18.632 N/(mm um) with C_R = 0.898."""
    pair = GearPair(*WIND.gears[::-1], WIND.centre_distance) if turned else WIND
    single, mean = pair_mesh_stiffness(pair, math.radians(10))
    assert 0.898 * single == pytest.approx(13.832e9, abs=5e5)
    assert 0.898 * mean == pytest.approx(18.632e9, abs=5e5)


def test_of_as_many_teeth_the_larger_shift_comes_first():
    gears = [Gear(30, 2e-3, math.radians(20), x, 0.02, 0.01) for x in (0.1, 0.3)]
    distance = 61e-3
    single = pair_mesh_stiffness(GearPair(*gears, distance))[0]
    assert single == pair_mesh_stiffness(GearPair(*gears[::-1], distance))[0]
    first = theoretical_single_stiffness(30, 30, 0.3, 0.1)
    assert single == pytest.approx(0.8 * 0.975 * first, rel=1e-12)


def test_webs_thin_rims_and_light_loads_soften():
    """C_R of the NREL stages: 0.898 of a web of a quarter and a rim of 5 modules; solid discs have 1."""
    assert gear_blank_factor(0.25, 5.0) == pytest.approx(0.898, abs=5e-4)
    assert gear_blank_factor(1.0, 3.0) == 1.0
    assert gear_blank_factor(0.05, 0.2) == gear_blank_factor(0.2, 1.0)
    assert line_load_factor(250e3) == 1.0 and line_load_factor(6.25e3) == pytest.approx(0.5)
