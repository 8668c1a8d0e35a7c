"""Nominal stresses of ISO 6336 against a published calculation.

Source: KISSsoft 03/2017 report of the NREL 5 MW gearbox, planetary stage 2 (ISO 6336:2006, method B):
github.com/gfsReboucas/Drivetrain, @NREL_5MW/stage_02.rtf. Helical teeth: worked example 1 of ISO/TR 6336-30,
and the FZG test gear H501 by the formulas of the standard, evaluated apart from femgear."""

import dataclasses
import math

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.iso6336 import (
    basic_rack_factor,
    contact_helix_factor,
    contact_ratio_factor,
    elasticity_factor,
    helix_of,
    mesh_stiffness_method_b,
    nominal_contact_stress,
    nominal_root_stress,
    overlap_of,
    pair_mesh_stiffness,
    relative_curvature,
    root_helix_factor,
    single_pair_factor,
    stress_correction,
    theoretical_single_stiffness,
    zone_factor,
)
from femgear.gears.pair import GearPair, close_pair
from femgear.gears.profile import BasicRack, transverse_rack, transverse_tool
from validation.planetary import nrel_set

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


@pytest.mark.parametrize(
    ("name", "mesh", "printed"),
    [
        # Y_F, Y_S, h_F, s_Fn, rho_F [mm], alpha_Fen [deg], single contact diameter [mm], sigma_F0 [MPa]
        ("sun", "sun_planet", (1.47, 2.04, 24.33, 44.78, 9.52, 25.74, 408.342, 73.95)),
        ("planet", "sun_planet", (1.38, 2.18, 25.73, 47.70, 8.69, 24.68, 794.110, 74.21)),
        ("planet", "planet_ring", (1.01, 2.48, 18.48, 47.70, 8.69, 22.21, 780.889, 61.98)),
        ("ring", "planet_ring", (1.20, 2.34, 30.32, 56.76, 8.78, 18.63, 1928.177, 69.12)),
    ],
)
def test_root_stress_of_the_published_stage(nrel, name, mesh, printed):
    ours = nominal_root_stress(
        getattr(nrel, name), contact_ratio=getattr(nrel, f"contact_ratio_{mesh}"), tangential_force=FORCE
    )
    found = (
        ours.form,
        ours.correction,
        1e3 * ours.arm,
        1e3 * ours.chord,
        1e3 * ours.fillet_radius,
        math.degrees(ours.load_angle),
        2e3 * ours.load_radius,
        1e-6 * ours.stress,
    )
    half_digit = (0.005, 0.005, 0.005, 0.005, 0.005, 0.005, 0.0005, 0.005)
    for value, reference, rounding in zip(found, printed, half_digit, strict=True):
        assert value == pytest.approx(reference, rel=2e-4, abs=rounding)


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
    assert stress_correction(1.0, 1.0) == pytest.approx(1.33)


def test_root_stress_is_linear_in_the_force_and_similar(nrel):
    one = nominal_root_stress(nrel.sun, contact_ratio=1.4, tangential_force=1e5)
    two = nominal_root_stress(nrel.sun, contact_ratio=1.4, tangential_force=2e5)
    assert two.stress == pytest.approx(2 * one.stress)
    assert two.form == one.form
    small, large = (
        nominal_root_stress(Gear(20, m, math.radians(20), 0.1, 10 * m, 5 * m), contact_ratio=1.5, tangential_force=m**2)
        for m in (1e-3, 1e-2)
    )
    assert large.stress == pytest.approx(small.stress, rel=1e-12)


def test_higher_contact_ratio_moves_the_load_inwards(nrel):
    ratios = np.array([1.0, 1.3, 1.6, 1.9])
    for gear, sign in ((nrel.sun, -1), (nrel.ring, 1)):
        found = [nominal_root_stress(gear, contact_ratio=r, tangential_force=1.0) for r in ratios]
        assert (np.diff([f.stress for f in found]) < 0).all()
        assert (sign * np.diff([f.load_radius for f in found]) > 0).all()
        assert found[0].load_radius == pytest.approx(gear.tip_radius)


def test_numbers_outside_the_method_are_refused(nrel):
    for ratio in (0.9, 2.5, math.nan):
        with pytest.raises(GeometryError) as caught:
            nominal_root_stress(nrel.sun, contact_ratio=ratio, tangential_force=1.0)
        assert caught.value.code == "E-ISO6336"


def test_two_pairs_share_the_load_from_a_contact_ratio_of_two_on():
    """f_eps of ISO 6336-3:2019; 40/50 teeth, addendum 1.25: 105.5 and 105.1 MPa by finite elements."""
    rack = BasicRack(1.25, 1.5, 0.2)
    gear = Gear(40, 3e-3, math.radians(20), 0.0, 0.02, 0.025, rack=rack)
    below, above = (
        nominal_root_stress(gear, contact_ratio=ratio, tangential_force=200 / 0.06) for ratio in (1.9999, 2.0)
    )
    assert above.form / below.form == pytest.approx(0.7, abs=1e-3)
    high = nominal_root_stress(gear, contact_ratio=2.113, tangential_force=200 / 0.06).stress
    assert high == pytest.approx(105.5e6, rel=0.02)


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


def fzg_h501(rounding):
    return helical_pair(
        (20, 30),
        (0.1809, 0.0891),
        (80.672, 116.264),
        module=3.5,
        angle=15.0,
        width=23.0,
        centre=91.5,
        rack=(1.0, 1.25, rounding),
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


@pytest.mark.parametrize(
    ("rounding", "form", "correction"),
    [(0.38, (1.4356, 1.4543), (1.9756, 1.9607)), (0.30, (1.4791, 1.4905), (2.0468, 2.0358))],
)
def test_root_stress_of_helical_teeth_is_that_of_the_virtual_spur_gear(rounding, form, correction):
    """Y_F, Y_S of ISO 6336-3:2006 by hand in the normal section, Y_beta 0.9323."""
    pair = fzg_h501(rounding)
    force = 100.0 / pair.gears[0].reference_radius
    for gear, y_form, y_correction in zip(pair.gears, form, correction, strict=True):
        ours = nominal_root_stress(gear, contact_ratio=pair.contact_ratio, tangential_force=force)
        assert ours.form == pytest.approx(y_form, abs=6e-5)
        assert ours.correction == pytest.approx(y_correction, abs=6e-5)
        assert ours.helix == pytest.approx(1.0 - 0.54138 * 15.0 / 120.0, abs=1e-5)
        whole = force / (0.023 * 3.5e-3) * ours.form * ours.correction * ours.helix
        assert ours.stress == pytest.approx(whole, rel=1e-12)


def test_factors_of_the_helix():
    # a whole overlap ratio: Z_eps = 1/sqrt(eps_alpha), and no single pair in contact
    assert contact_ratio_factor(1.6, 1.0) == contact_ratio_factor(1.6, 2.3) == pytest.approx(1.6**-0.5)
    assert contact_ratio_factor(1.6, 0.5) ** 2 == pytest.approx(0.5 * (0.8 + 1.0 / 1.6))
    assert root_helix_factor(math.radians(40.0), 1.7) == root_helix_factor(math.radians(-30.0), 1.0) == 0.75
    assert root_helix_factor(0.0, 0.0) == contact_helix_factor(0.0) == 1.0
    pair = fzg_h501(0.38)
    angle = {"working_angle": pair.working_pressure_angle, "path": pair.path}
    narrow, wide = (
        single_pair_factor(*(dataclasses.replace(gear, face_width=b) for gear in pair.gears), **angle)
        for b in (1e-6, 0.05)
    )
    ours, overlap = single_pair_factor(*pair.gears, **angle), overlap_of(pair.gears[0], 0.023)
    assert wide == 1.0 < narrow
    assert ours - 1.0 == pytest.approx((1.0 - overlap) * (narrow - 1.0), rel=1e-3)


def test_internal_teeth_of_a_small_helix_are_spur_teeth(nrel):
    """All factors go over into those of spur teeth, for the ring and its cutter too."""
    helix = 1e-4
    ring = dataclasses.replace(nrel.ring, rack=dataclasses.replace(nrel.ring.rack, stretch=1.0 / math.cos(helix)))
    spur, helical = (
        nominal_root_stress(gear, contact_ratio=1.6, tangential_force=FORCE).stress for gear in (nrel.ring, ring)
    )
    assert helical == pytest.approx(spur, rel=1e-5) and helical != spur


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


# Limits of the method B stiffness; its values are in tests/validation/test_gear_geometry.py.


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
