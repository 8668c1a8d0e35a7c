"""Nominal stresses of ISO 6336 against a published calculation.

Source: KISSsoft 03/2017 report of the NREL 5 MW gearbox, planetary stage 2 (ISO 6336:2006, method B):
github.com/gfsReboucas/Drivetrain, @NREL_5MW/stage_02.rtf. Helical teeth: worked example 1 of ISO/TR 6336-30,
and the FZG test gear H501 by the formulas of the standard, evaluated apart from femgear."""

import dataclasses
import math

import pytest

from femgear.gears.gear import Gear
from femgear.gears.iso6336 import (
    BY_EXPERIENCE,
    PROVEN,
    contact_helix_factor,
    contact_ratio_factor,
    elasticity_factor,
    helix_of,
    nominal_contact_stress,
    overlap_of,
    relative_curvature,
    single_pair_factors,
    zone_factor,
)
from femgear.gears.pair import close_pair
from femgear.gears.profile import BasicRack, transverse_rack, transverse_tool
from validation.planetary import nrel_set
from validation.strength import first_stage, helical_test_gear

FORCE = 285900.438
STEEL = {"youngs_modulus": 206e9, "poisson_ratio": 0.3}


@pytest.fixture(scope="module")
def nrel():
    return nrel_set()


def pair_data(s, mesh):
    """Working pressure angle [rad] and contact ratio."""
    if mesh == "sun-planet":
        return s.working_pressure_angle_sun_planet, s.contact_ratio_sun_planet
    return s.working_pressure_angle_planet_ring, s.contact_ratio_planet_ring


def flank(s, mesh):
    gears = (s.sun, s.planet) if mesh == "sun-planet" else (s.planet, s.ring)
    working, ratio = pair_data(s, mesh)
    load = {"working_angle": working, "contact_ratio": ratio, "tangential_force": FORCE}
    return nominal_contact_stress(*gears, **load, **STEEL)


def test_contact_stress_of_the_published_stage(nrel):
    printed = {"sun-planet": (573.40, 2.25, 0.936), "planet-ring": (312.44, 2.85, 0.891)}
    alpha = nrel.sun.pressure_angle
    for mesh, (stress, zone, ratio) in printed.items():
        working, own = pair_data(nrel, mesh)
        assert flank(nrel, mesh) == pytest.approx(stress * 1e6, rel=1e-4)
        assert zone_factor(alpha, working) == pytest.approx(zone, abs=0.005)
        assert contact_ratio_factor(own) == pytest.approx(ratio, abs=0.0005)
        assert elasticity_factor(**STEEL) == pytest.approx(189.8e3, rel=2e-4)


def test_contact_stress_is_the_hertz_stress_at_the_pitch_point(nrel):
    """Without Z_eps sigma_H0 is Hertz's pressure of the whole normal force at the pitch point.

    p^2 = F_n E / (2 pi b (1 - nu^2) rho), 1/rho = 1/(r_b1 tan alpha_w) +- 1/(r_b2 tan alpha_w)
    (Johnson, "Contact Mechanics", eq. 4.45).
    """
    for mesh, one, two, angle, sign in (
        ("sun-planet", nrel.sun, nrel.planet, nrel.working_pressure_angle_sun_planet, 1),
        ("planet-ring", nrel.planet, nrel.ring, nrel.working_pressure_angle_planet_ring, -1),
    ):
        curvature = (1 / one.base_radius + sign / two.base_radius) / math.tan(angle)
        normal = FORCE / math.cos(one.pressure_angle)
        hertz = math.sqrt(normal * 206e9 * curvature / (2 * math.pi * one.face_width * (1 - 0.3**2)))
        ratio = contact_ratio_factor(pair_data(nrel, mesh)[1])
        assert flank(nrel, mesh) / ratio == pytest.approx(hertz, rel=1e-12)


def test_factors():
    # ISO 6336-2: Z_H = 2.495 for unshifted 20 deg gears; Z_E of steel 189.8 sqrt(N/mm^2)
    twenty = math.radians(20)
    assert zone_factor(twenty, twenty) == pytest.approx(2.495, abs=5e-4)
    assert elasticity_factor(206e9, 0.3) == pytest.approx(189.8e3, rel=2e-4)
    assert contact_ratio_factor(1.0) == 1.0


def helical_pair(teeth, shifts, tips, *, module, angle, width, centre, rack=(1.0, 1.25, 0.38)):
    """Two external helical gears [mm, deg]; the shift of the wheel is found from the centre distance."""
    helix = math.radians(angle)
    section = transverse_tool(1e-3 * module, math.radians(20.0), helix)
    gears = [
        Gear(
            z,
            *section,
            x * math.cos(helix),
            1e-3 * width,
            5e-3 * module,
            rack=transverse_rack(BasicRack(*rack), helix),
            tip_diameter=1e-3 * tip,
            name=name,
        )
        for z, x, tip, name in zip(teeth, shifts, tips, ("pinion", "wheel"), strict=True)
    ]
    return close_pair(*gears, centre_distance=1e-3 * centre, find=("wheel",))


def iso_tr_example():
    """Worked example 1 of ISO/TR 6336-30."""
    return helical_pair(
        (17, 103),
        (0.145, 0.0),
        (159.66, 872.35),
        module=8.0,
        angle=15.8,
        width=100.0,
        centre=500.0,
        rack=(1.0, 1.4, 0.39),
    )


def test_contact_stress_of_helical_teeth_is_that_of_the_technical_report():
    """Z_H 2.39533, Z_eps 0.803, Z_beta 1.01944, sigma_H0 1206.58 N/mm^2 under 9000 N m."""
    pair = iso_tr_example()
    small, large = pair.gears
    helix, base = helix_of(small)
    assert math.degrees(helix) == pytest.approx(15.8, abs=1e-12)
    zone = zone_factor(small.pressure_angle, pair.working_pressure_angle, base)
    assert zone == pytest.approx(2.39533, abs=6e-6)
    overlap = overlap_of(small, pair.face_width)
    assert contact_ratio_factor(pair.contact_ratio, overlap) == pytest.approx(0.803, abs=5e-4)
    assert contact_helix_factor(helix) == pytest.approx(1.01944, abs=5e-6)
    stress = nominal_contact_stress(
        small,
        large,
        working_angle=pair.working_pressure_angle,
        contact_ratio=pair.contact_ratio,
        tangential_force=9000.0 / small.reference_radius,
        **STEEL,
    )
    assert stress == pytest.approx(1206.58e6, rel=5e-6)


def test_factors_of_the_helix():
    # a whole overlap ratio: Z_eps = 1/sqrt(eps_alpha), and no single pair in contact
    assert contact_ratio_factor(1.6, 1.0) == contact_ratio_factor(1.6, 2.3) == pytest.approx(1.6**-0.5)
    assert contact_ratio_factor(1.6, 0.5) ** 2 == pytest.approx(0.5 * (0.8 + 1.0 / 1.6))
    assert contact_helix_factor(0.0) == 1.0
    pair = helical_test_gear(0.38)
    angle = {"working_angle": pair.working_pressure_angle, "path": pair.path}
    angle["edition"] = 2006
    narrow, wide = (
        single_pair_factors(*(dataclasses.replace(gear, face_width=b) for gear in pair.gears), **angle)
        for b in (1e-6, 0.05)
    )
    ours, overlap = single_pair_factors(*pair.gears, **angle), overlap_of(pair.gears[0], 0.023)
    assert wide == (1.0, 1.0) and narrow[0] > 1.0
    assert ours[0] - 1.0 == pytest.approx((1.0 - overlap) * (narrow[0] - 1.0), rel=1e-3)


def test_helical_teeth_of_2019_press_more_where_they_are_not_modified():
    """Z_B = Z_D = sqrt(f_ZCa) from an overlap of one on, between it and spur teeth by the overlap."""
    pair = helical_test_gear(0.38)
    angle = {"working_angle": pair.working_pressure_angle, "path": pair.path}
    wide = [dataclasses.replace(gear, face_width=0.05) for gear in pair.gears]
    assert single_pair_factors(*wide, **angle) == pytest.approx((math.sqrt(1.2),) * 2)
    assert single_pair_factors(*wide, **angle, modified=BY_EXPERIENCE)[1] == pytest.approx(math.sqrt(1.07))
    assert single_pair_factors(*wide, **angle, modified=PROVEN) == (1.0, 1.0)
    overlap = overlap_of(pair.gears[0], 0.023)
    (new, _), (old, _) = (single_pair_factors(*pair.gears, **angle, edition=year) for year in (2019, 2006))
    assert new - old == pytest.approx(overlap * (math.sqrt(1.2) - 1.0))


def test_single_pair_factors_are_those_of_the_published_stage():
    """KISSsoft, NREL stage 1: 1.04 of the sun, 1.05 of the planet, 1 in the mesh with the ring."""
    for pair, printed in zip(first_stage().kinds, ((1.04, 1.05), (1.0, 1.0)), strict=True):
        ours = single_pair_factors(*pair.gears, working_angle=pair.working_pressure_angle, path=pair.path)
        assert ours == pytest.approx(printed, abs=0.005)


@pytest.mark.parametrize("tooth_pair", [(20, 40, False), (20, 60, True)])
def test_relative_curvature_is_that_of_both_flanks(tooth_pair):
    """1/rho_1 +- 1/rho_2 with radii measured along the line of action from the base circles."""
    z_1, z_2, internal = tooth_pair
    alpha = math.radians(20)
    gears = [
        Gear(z_1, 2e-3, alpha, 0.0, 0.02, 0.01),
        Gear(z_2, 2e-3, alpha, 0.0, 0.02, 0.1 if internal else 0.02, internal=internal),
    ]
    rho = [0.5 * 2e-3 * z * math.sin(alpha) for z in (z_1, z_2)]
    for path in (-2e-3, 0.0, 3e-3):
        one, two = rho[0] + path, rho[1] + (path if internal else -path)
        expected = 1.0 / one + (-1.0 if internal else 1.0) / two
        assert relative_curvature(*gears, working_angle=alpha, path=path) == pytest.approx(expected)
    assert math.isinf(relative_curvature(*gears, working_angle=alpha, path=-rho[0]))
