"""Gear geometry against published and independently computed numbers.

Sources are named test by test: involute tables, textbook limits, and the KISSsoft report of the NREL 5 MW
planetary stage 2 (github.com/gfsReboucas/Drivetrain, @NREL_5MW/stage_02.rtf).
"""

import math

import pytest

from femgear.errors import GeometryError
from femgear.gears import profile as iv
from femgear.gears.checks import check_set
from femgear.gears.gear import Gear, tooth_thickness
from femgear.gears.iso6336_stiffness import mesh_stiffness_method_b, theoretical_single_stiffness
from femgear.gears.kinematics import torques
from femgear.gears.pair import working_pressure_angle, zero_backlash_distance
from femgear.gears.planetary import PlanetarySet, equal_planet_angles, feasible_angles
from femgear.gears.profile import BasicRack
from validation.reference import gear_limits as limits
from validation.reference.gear_limits import neighbour_limit

A20, A25 = math.radians(20.0), math.radians(25.0)


def contact_ratio(teeth, alpha, *, internal=False):
    """Unshifted gears of module 1, addendum 1."""
    base = [0.5 * z * math.cos(alpha) for z in teeth]
    tips = 0.5 * teeth[0] + 1.0, 0.5 * teeth[1] + (-1.0 if internal else 1.0)
    distance = 0.5 * (teeth[1] - teeth[0] if internal else sum(teeth))
    ratio = limits.contact_ratio_internal if internal else limits.contact_ratio_external
    return ratio(tips[0], base[0], tips[1], base[1], distance, math.pi * math.cos(alpha))


@pytest.mark.parametrize(
    ("degrees", "value"),
    [(20.0, 0.014904383867336446), (25.0, 0.0299753451564162), (22.5, 0.021514480674370895)],
)
def test_involute_function(degrees, value):
    assert iv.inv(math.radians(degrees)) == pytest.approx(value, rel=1e-14)


def test_inverse_involute():
    assert math.degrees(iv.arcinv(0.02)) == pytest.approx(21.981101788115, abs=1e-12)


@pytest.mark.parametrize(
    ("teeth", "alpha", "value"),
    [
        ((20, 40), A20, 1.6351859635714576),
        ((17, 17), A20, 1.5148004453923),
        ((20, 20), A25, 1.4102352118360),
    ],
)
def test_contact_ratio_of_external_pairs(teeth, alpha, value):
    assert contact_ratio(teeth, alpha) == pytest.approx(value, rel=2e-13)


def test_limiting_contact_ratio_of_racks():
    assert limits.limiting_contact_ratio(A20) == pytest.approx(1.98080909704540, rel=1e-14)
    assert contact_ratio((10**9, 10**9), A20) == pytest.approx(1.98080909704540, rel=1e-6)


def test_shifted_external_pair():
    """m = 3, 20/40, x = .3/.2."""
    pair = Gear(20, 3e-3, A20, 0.3, 0.02, 1e-3), Gear(40, 3e-3, A20, 0.2, 0.02, 1e-3)
    distance = 1e3 * zero_backlash_distance(*pair)
    angle = working_pressure_angle(*pair, 1e-3 * distance)
    assert math.degrees(angle) == pytest.approx(22.3167069, abs=5e-8)
    assert distance == pytest.approx(91.4197646, abs=5e-8)
    base, pitch = (30 * math.cos(A20), 60 * math.cos(A20)), 3 * math.pi * math.cos(A20)
    tips = 33 + 0.9, 63 + 0.6
    full = limits.contact_ratio_external(tips[0], base[0], tips[1], base[1], distance, pitch)
    assert full == pytest.approx(1.5291423, abs=5e-8)
    cut = 90 + 1.5 - distance  # tips shortened to keep the clearance
    short = limits.contact_ratio_external(tips[0] - cut, base[0], tips[1] - cut, base[1], distance, pitch)
    assert short == pytest.approx(1.4931623, abs=5e-8)


def test_contact_ratio_of_internal_pairs():
    assert contact_ratio((20, 80), A20, internal=True) == pytest.approx(1.88968133, abs=5e-9)
    assert contact_ratio((40, 100), A25, internal=True) == pytest.approx(1.62987813, abs=5e-9)
    base = 17 * math.cos(A20), 81 * math.cos(A20)  # 17/81, m = 2, both shifted by 0.2: standard distance
    value = limits.contact_ratio_internal(17 + 2.4, base[0], 81 - 1.6, base[1], 64.0, 2 * math.pi * math.cos(A20))
    assert value == pytest.approx(1.74362843, abs=5e-9)


def test_undercut_limits():
    assert limits.undercut_teeth(A20) == pytest.approx(17.0972643, abs=5e-8)
    assert iv.undercut_shift(10, A20) == pytest.approx(0.4151111, abs=5e-8)
    assert iv.undercut_shift(12, A20) == pytest.approx(0.2981333, abs=5e-8)


def test_pointed_tips():
    assert limits.pointed_tip_shift(12, A20) == pytest.approx(0.8202039, abs=5e-8)
    assert limits.pointed_tip_shift(20, A20) == pytest.approx(1.2223485, abs=5e-8)
    base = 10 * math.cos(A20)
    assert base / math.cos(limits.pointed_tip_angle(20, 0.0, A20)) == pytest.approx(11.5383374, abs=5e-8)
    gear = Gear(20, 1e-3, A20, 0.0, 1e-2, 5e-3)
    assert tooth_thickness(gear, gear.tip_radius) == pytest.approx(0.6948800e-3, abs=5e-11)


def test_rings_free_of_involute_interference():
    """Standard 20 deg pairs: least ring for a planet of 20, 24, 30, 18 teeth."""
    for planet, least in ((20, 64), (24, 40), (30, 38), (18, 161)):
        free = [
            ring
            for ring in range(planet + 8, 400)
            if 0.5 * ring - 1 > 0.5 * ring * math.cos(A20)
            and limits.internal_interference(
                0.5 * ring - 1,
                0.5 * planet * math.cos(A20),
                0.5 * ring * math.cos(A20),
                0.5 * (ring - planet),
            )
            >= 0.0
        ]
        assert free[0] == least
    base = 27 * math.cos(A20), 108 * math.cos(A20)
    assert limits.internal_interference(105.0, *base, 81.0) == pytest.approx(-0.77, abs=5e-3)


def test_helical_conversions():
    """mn = 3, beta = 15 deg, 20/40, b = 40."""
    beta = math.radians(15.0)
    alpha_t = iv.transverse_angle(A20, beta)
    assert math.degrees(alpha_t) == pytest.approx(20.6468965, abs=5e-8)
    assert math.degrees(iv.base_helix_angle(A20, beta)) == pytest.approx(14.0760954, abs=5e-8)
    module = 3.0 / math.cos(beta)
    base = 10 * module * math.cos(alpha_t), 20 * module * math.cos(alpha_t)
    tips = 10 * module + 3.0, 20 * module + 3.0
    pitch = math.pi * module * math.cos(alpha_t)
    value = limits.contact_ratio_external(tips[0], base[0], tips[1], base[1], 30 * module, pitch)
    assert value == pytest.approx(1.5609328, abs=5e-8)
    assert iv.overlap_ratio(40.0, 3.0, beta) == pytest.approx(1.0984621, abs=5e-8)


def nrel_stage_2():
    """Lengths of the report in mm; its ring shift +0.1171 is ISO's sign, minus here."""
    m = 21e-3
    sun = Gear(
        18,
        m,
        A20,
        0.3890,
        0.55,
        0.09716,
        tip_diameter=0.432838,
        root_diameter=0.341838,
        rack=BasicRack(1, 1.25, 0.38),
    )
    planet = Gear(
        36,
        m,
        A20,
        0.5039,
        0.55,
        0.28,
        tip_diameter=0.815663,
        root_diameter=0.724663,
        rack=BasicRack(1, 1.25, 0.38),
    )
    ring = Gear(
        93,
        m,
        A20,
        -0.1171,
        0.55,
        1.2,
        internal=True,
        tip_diameter=1.906081,
        root_diameter=2.000581,
        rack=BasicRack(1, 1.25, 0.30),
    )
    return PlanetarySet(sun, planet, ring, 0.584, equal_planet_angles(3))


def test_nrel_stage_2_geometry_and_forces():
    s = nrel_stage_2()
    assert math.degrees(s.working_pressure_angle_sun_planet) == pytest.approx(24.169, abs=1e-3)
    assert math.degrees(s.working_pressure_angle_planet_ring) == pytest.approx(15.630, abs=1e-3)
    assert s.contact_ratio_sun_planet == pytest.approx(1.370, abs=5e-4)
    assert s.contact_ratio_planet_ring == pytest.approx(1.618, abs=5e-4)
    assert (s.path_sun_planet[1] - s.path_sun_planet[0]) * 1e3 == pytest.approx(84.952, abs=1e-3)
    assert (s.path_planet_ring[1] - s.path_planet_ring[0]) * 1e3 == pytest.approx(100.284, abs=1e-3)
    load = torques(s, member="sun", torque=162105.5)
    assert load.ring == pytest.approx(837545.3, rel=1e-6)
    assert -load.carrier == pytest.approx(999650.9, rel=1e-6)
    assert load.sun / 3 / s.sun.base_radius == pytest.approx(304248.9, rel=1e-6)
    assert load.sun / 3 / s.sun.reference_radius == pytest.approx(285900.4, rel=1e-6)


def test_nrel_stage_2_circles_follow_from_rack_and_shifts():
    """The printed root diameters; the tips are shortened in the report."""
    for gear in (nrel_stage_2().sun, nrel_stage_2().planet, nrel_stage_2().ring):
        free = Gear(
            gear.teeth,
            gear.module,
            A20,
            gear.profile_shift,
            0.55,
            gear.rim_radius,
            internal=gear.internal,
            tip_diameter=gear.tip_diameter,
            rack=gear.rack,
        )
        assert 2 * free.root_radius == pytest.approx(gear.root_diameter, abs=1e-6)


def test_nrel_stage_2_is_accepted():
    """A set that was designed to run: no refusal; its shifts, rounded to four decimals, close it."""
    s = nrel_stage_2()
    assert {w.code for w in check_set(s)} <= {"W-RIM", "W-NEIGHBOURS"}
    assert abs(s.backlash_sun_planet) < 1e-4 * s.sun.module
    assert abs(s.backlash_planet_ring) < 1e-4 * s.sun.module


def test_nrel_stage_2_stiffness_of_iso_6336():
    """C_R = 0.862 as the report prints it for b_s/b = 0.25; its ring shift in ISO's sign."""
    for teeth, shifts, ratio, single, mean in (
        ((18, 36), (0.3890, 0.5039), 1.370, 12.240, 15.640),
        ((36, math.inf), (0.5039, 0.1171), 1.618, 14.053, 20.563),
    ):
        found = [0.862 * one for one in mesh_stiffness_method_b(*teeth, *shifts, ratio, dedendum=1.25)]
        assert found[0] == pytest.approx(single * 1e9, rel=1e-3)
        assert found[1] == pytest.approx(mean * 1e9, rel=1e-3)


def test_iso_6336_stiffness_of_standard_pairs():
    assert theoretical_single_stiffness(20, 40, 0, 0) == pytest.approx(16.2725324e9, rel=1e-8)
    single, mean = mesh_stiffness_method_b(20, 40, 0, 0, 1.6351859635714576)
    assert single == pytest.approx(13.0180259e9, rel=1e-8)
    assert mean == pytest.approx(19.2196764e9, rel=1e-8)
    assert mesh_stiffness_method_b(17, 17, 0, 0, 1.5)[0] == pytest.approx(11.1811762e9, rel=1e-8)
    assert mesh_stiffness_method_b(50, 50, 0, 0, 1.5)[0] == pytest.approx(14.4148300e9, rel=1e-8)


def test_assembly_and_neighbours():
    degrees = [math.degrees(a) for a in feasible_angles(126, equal_planet_angles(4))]
    assert degrees == pytest.approx([0.0, 91.428571, 180.0, 271.428571], abs=1e-6)
    for sun, planet, limit in ((20, 30, 4.52), (27, 35, 4.91), (12, 42, 3.30), (30, 20, 6.90)):
        assert neighbour_limit(sun, planet) == pytest.approx(limit, abs=5e-3)


def test_reference_set_of_the_modulation_paper():
    """27/40/108, m 1.5, a 51: published working angles, contact ratios, all planets in phase."""
    gears = [
        Gear(27, 1.5e-3, A20, 0.52681, 25e-3, 9e-3),
        Gear(40, 1.5e-3, A20, 0.0, 25e-3, 18e-3),
        Gear(108, 1.5e-3, A20, 0.0, 25e-3, 0.1, internal=True),
    ]
    s = PlanetarySet(*gears, 51e-3, equal_planet_angles(3))
    assert math.degrees(s.working_pressure_angle_sun_planet) == pytest.approx(22.1995, abs=5e-5)
    assert math.degrees(s.working_pressure_angle_planet_ring) == pytest.approx(20.0, abs=1e-12)
    assert s.contact_ratio_sun_planet == pytest.approx(1.5507, abs=5e-5)
    assert s.contact_ratio_planet_ring == pytest.approx(1.9301, abs=5e-5)
    assert s.mesh_phases[:3] == pytest.approx([0.0] * 3, abs=1e-12)
    assert s.mesh_phases[3:] == pytest.approx([s.mesh_phases[3]] * 3, abs=1e-12)
    assert check_set(s) == ()


@pytest.mark.parametrize(("rounding", "overlap"), [(0.38, 7.377), (0.39, 8.616)])
def test_profile_with_0_38_runs_into_the_planet_fillet(rounding, overlap):
    """Up to 0.005 modules, 7.5 um, the ring's tip is told as a doubt, beyond it is refused."""
    rack = BasicRack(root_radius=rounding)
    s = PlanetarySet(
        Gear(27, 1.5e-3, A20, 0.52681, 25e-3, 9e-3, rack=rack),
        Gear(40, 1.5e-3, A20, 0.0, 25e-3, 18e-3, rack=rack),
        Gear(108, 1.5e-3, A20, 0.0, 25e-3, 0.1, internal=True, rack=rack),
        51e-3,
        equal_planet_angles(3),
    )
    if overlap > 7.5:
        with pytest.raises(GeometryError, match="ring's tip runs into the planet's root fillet") as error:
            check_set(s)
        assert f"overlap {overlap} um" in str(error.value)
    else:
        (found,) = check_set(s)
        assert (found.code, found.key, found.severity) == ("W-FILLET", "ring.tip_diameter", "doubt")
        assert "ring's tip runs into the planet's root fillet" in found.text
        assert f"overlap {overlap} um" in found.text
