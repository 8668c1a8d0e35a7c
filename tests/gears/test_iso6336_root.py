"""Nominal root stresses of ISO 6336-3 against published calculations.

Sources: KISSsoft 03/2017 report of the NREL 5 MW gearbox, planetary stages 1 and 2 (ISO 6336:2006, method B):
github.com/gfsReboucas/Drivetrain, @NREL_5MW/stage_01.rtf, stage_02.rtf. FZG test gear H501 by the formulas of the
standard, evaluated apart from femgear."""

import dataclasses
import math

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.iso6336_root import (
    deep_tooth_factor,
    fillet_section,
    load_distribution_factor,
    nominal_root_stress,
    rim_beyond_range,
    rim_factor,
    root_helix_factor,
    stress_correction,
)
from femgear.gears.profile import BasicRack
from validation.planetary import nrel_set
from validation.strength import first_stage, helical_test_gear

FORCE = 285900.438


@pytest.fixture(scope="module")
def nrel():
    return nrel_set()


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
        getattr(nrel, name), contact_ratio=getattr(nrel, f"contact_ratio_{mesh}"), tangential_force=FORCE, edition=2006
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


@pytest.mark.parametrize(
    ("rounding", "form", "correction"),
    [(0.38, (1.4356, 1.4543), (1.9756, 1.9607)), (0.30, (1.4791, 1.4905), (2.0468, 2.0358))],
)
def test_root_stress_of_helical_teeth_is_that_of_the_virtual_spur_gear(rounding, form, correction):
    """Y_F, Y_S of ISO 6336-3:2006 by hand in the normal section, Y_beta 0.9323."""
    pair = helical_test_gear(rounding)
    force = 100.0 / pair.gears[0].reference_radius
    for gear, y_form, y_correction in zip(pair.gears, form, correction, strict=True):
        ours = nominal_root_stress(gear, contact_ratio=pair.contact_ratio, tangential_force=force, edition=2006)
        assert ours.form == pytest.approx(y_form, abs=6e-5)
        assert ours.correction == pytest.approx(y_correction, abs=6e-5)
        assert ours.helix == pytest.approx(1.0 - 0.54138 * 15.0 / 120.0, abs=1e-5)
        whole = force / (0.023 * 3.5e-3) * ours.form * ours.correction * ours.helix
        assert ours.stress == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize(("edition", "near"), [(2006, 1e-5), (2019, 3e-4)])
def test_internal_teeth_of_a_small_helix_are_spur_teeth(nrel, edition, near):
    """All factors go over into those of spur teeth, for the ring and its cutter too; f_eps has an overlap of 8e-4."""
    helix = 1e-4
    ring = dataclasses.replace(nrel.ring, rack=dataclasses.replace(nrel.ring.rack, stretch=1.0 / math.cos(helix)))
    spur, helical = (
        nominal_root_stress(gear, contact_ratio=1.6, tangential_force=FORCE, edition=edition).stress
        for gear in (nrel.ring, ring)
    )
    assert helical == pytest.approx(spur, rel=near) and helical != spur


def test_factors_of_the_editions():
    """Y_beta and f_eps; between both the root stress moves from +37 % to -30 %."""
    degrees = math.radians(30.0)
    assert root_helix_factor(math.radians(40.0), 1.7, 2006) == root_helix_factor(-degrees, 1.0, 2006) == 0.75
    assert root_helix_factor(math.radians(40.0), 1.7) == pytest.approx(0.75 / math.cos(degrees) ** 3)
    assert root_helix_factor(0.0, 0.0) == 1.0
    assert [load_distribution_factor(ratio) for ratio in (1.9, 2.0)] == [1.0, 0.7]
    assert load_distribution_factor(1.6, 1.0) == load_distribution_factor(1.6, 2.5) == pytest.approx(1.6**-0.5)
    assert load_distribution_factor(2.2, 0.4) ** 2 == pytest.approx(0.3 + 0.4 / 2.2)
    narrow = root_helix_factor(degrees, 0.3) * load_distribution_factor(1.4, 0.3)
    assert narrow / root_helix_factor(degrees, 0.3, 2006) == pytest.approx(1.47, abs=0.01)
    assert stress_correction(1.0, 1.0) == pytest.approx(1.33)


def test_thin_rims_and_fine_deep_teeth():
    """Y_B passes into 1 at 1.2 heights and 3.5 modules; Y_DT wants class 4."""
    assert rim_factor(1.2, 1.0, 0.5, internal=False) == 1.0
    assert rim_factor(1.1999, 1.0, 0.5, internal=False) == pytest.approx(1.0, abs=1e-3)
    assert rim_factor(0.6, 1.0, 0.5, internal=False) == pytest.approx(1.6 * math.log(2.242 / 0.6))
    assert rim_factor(3.4999, 2.2, 1.0, internal=True) == pytest.approx(1.0, abs=4e-3)
    assert rim_factor(2.0, 2.2, 1.0, internal=True) == pytest.approx(1.15 * math.log(8.324 / 2.0))
    assert [deep_tooth_factor(2.3, grade) for grade in (None, 5)] == [1.0, 1.0]
    assert deep_tooth_factor(2.3, 4) == pytest.approx(2.366 - 0.666 * 2.3)
    assert deep_tooth_factor(2.05, 4) == pytest.approx(1.0) and deep_tooth_factor(2.6, 3) == 0.7


def test_rims_beyond_the_range_of_their_factor_are_found(nrel):
    """ISO 6336-3 covers rims of more than 0.5 tooth heights, and of more than 1.75 normal modules of internal gears."""
    sun, ring = nrel.gears[0], nrel.gears[-1]
    for gear, unit, limit in ((sun, abs(sun.tip_radius - sun.root_radius), 0.5), (ring, ring.module, 1.75)):
        for share in (0.99, 1.01):
            rim = gear.root_radius + (1.0 if gear.internal else -1.0) * share * limit * unit
            beyond = rim_beyond_range(dataclasses.replace(gear, rim_radius=rim))
            assert beyond == (None if share > 1.0 else (pytest.approx(share * limit), limit))


def test_generated_fillet_of_a_rack_is_the_closed_form():
    """Chord, radius and foot where the tangent stands at 30 deg, against theta of the standard."""
    gear = Gear(16, 4.5e-3, math.radians(20), 0.1817, 0.014, 0.01, rack=BasicRack(1.0, 1.25, 0.3))
    chord, radius, _ = fillet_section(gear.tool, math.pi / 6.0)
    ours = nominal_root_stress(gear, contact_ratio=1.46, tangential_force=1.0)
    assert (chord, radius) == pytest.approx((ours.chord, ours.fillet_radius), rel=1e-6)


def test_internal_root_of_2019_is_the_generated_fillet():
    """Three points of the cut fillet make a circle; the rack of 2006 makes it 64 % too round at NREL stage 1."""
    ring = first_stage().ring
    old, new = (
        nominal_root_stress(ring, contact_ratio=1.2783, tangential_force=FORCE, edition=year) for year in (2006, 2019)
    )
    assert old.fillet_radius / new.fillet_radius == pytest.approx(1.64, abs=0.005)
    theta = np.linspace(0.0, ring.tool.end_angle, 20001)
    radius, angle = ring.tool.fillet_point(theta)
    points = radius * np.exp(1j * angle)
    slope = np.abs(np.angle(np.diff(points)))
    at = int(np.argmin(np.abs(np.minimum(slope, np.pi - slope) - np.pi / 3.0)))
    a, b, c = points[at - 40], points[at], points[at + 40]
    area = 0.5 * abs(((b - a).conjugate() * (c - a)).imag)
    assert new.fillet_radius == pytest.approx(abs(a - b) * abs(b - c) * abs(c - a) / (4.0 * area), rel=1e-3)
    assert new.chord == pytest.approx(2.0 * b.imag, rel=1e-4)
    with pytest.raises(GeometryError) as caught:
        fillet_section(ring.tool, math.radians(5.0))
    assert caught.value.code == "E-ISO6336"
