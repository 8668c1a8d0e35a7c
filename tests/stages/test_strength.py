"""One rating for all trains: nominal stresses by edition, load factors, safeties."""

import math
from pathlib import Path

import numpy as np
import pytest
from steels import NO_STEELS

from femgear.case.gear_set import planetary_set
from femgear.gears.iso6336 import overlap_of
from femgear.gears.iso6336_load import dynamic_factor_of_speed
from femgear.stages.static_results import root_doubts, set_warnings
from femgear.stages.strength import (
    OF_ROOTS,
    case_stresses,
    mesh_frequencies,
    rate_case,
    rating_wanted,
    standard_factors,
    thin_rims,
)
from femgear.stages.strength_results import safety_notes
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
LIMITS = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"}
H501 = {
    "set": {
        "module": "3.5 mm",
        "pressure_angle": "20 deg",
        "helix_angle": "15 deg",
        "face_width": "23 mm",
        "centre_distance": "91.5 mm",
    },
    "rack": {"root_radius": 0.30},
    "material": {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "density": "7830 kg/m^3"},
    "gear_1": {"teeth": 20, "profile_shift": 0.1809, "tip_diameter": "80.672 mm", "bore_radius": "15 mm"},
    "gear_2": {"teeth": 30, "tip_diameter": "116.264 mm", "bore_radius": "15 mm"},
    "operation": {"torque": "100 N m", "speeds": ["1500 rpm"]},
    "static": {"slices": 25},
}
"""FZG test gear H501."""


def test_rated_gears_whose_rim_factor_does_not_hold_raise_a_doubt(planetary):
    """A rim of the planet of 0.185 tooth heights, and one of the ring of 1.08 modules; the sun has a thick one."""
    thin = with_values(planetary, {"planet.bore_radius": "27.5 mm", "ring.outer_radius": "84.5 mm"})
    planet, ring = thin_rims(with_values(thin, LIMITS))
    assert (planet.code, planet.severity, planet.key) == ("W-RIM", "doubt", "planet.bore_radius")
    assert "0.185 tooth heights" in planet.text and "0.5" in planet.limit
    assert ring.key == "ring.outer_radius" and "1.08 modules" in ring.text and "1.75" in ring.limit
    assert planet.code in OF_ROOTS and not [*thin_rims(with_values(planetary, LIMITS))]


def test_thin_rims_without_a_safety_raise_a_doubt_in_the_place_of_the_note(planetary):
    """S_F of a rated gear has the rim by Y_B; without S_F finite elements with a rigid bore give all that is known."""
    thin = with_values(planetary, {"planet.bore_radius": "26 mm"})
    (doubt,) = [finding for finding in set_warnings(thin) if finding.code == "W-RIM"]
    assert (doubt.severity, doubt.key, doubt.concerns) == ("doubt", "planet.bore_radius", "planet")
    gear = planetary_set(thin).planet
    thickness, height = gear.root_radius - gear.rim_radius, gear.tip_radius - gear.root_radius
    assert f"Y_B = {1.6 * math.log(2.242 * height / thickness):.2f}" in doubt.text
    assert root_doubts([doubt], "planet, ring side", "ring") == ["W-RIM"]
    assert not root_doubts([doubt], "sun", "planet, sun side")
    (note,) = [finding for finding in set_warnings(with_values(thin, LIMITS)) if finding.code == "W-RIM"]
    assert (note.severity, note.key) == ("note", "planet.bore_radius")
    assert not root_doubts([note], "planet, ring side", "ring")


@pytest.fixture(scope="module")
def helical():
    return read_case({"format": 1, "model": "pair", "title": "FZG H501", **H501})


@pytest.fixture(scope="module")
def planetary():
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), NO_STEELS)


def test_edition_of_the_case_decides_the_stresses(helical):
    """sigma_F0 96.7/96.9 MPa and sigma_H0 652.5 MPa by the edition of 2006; Z_B and Y_beta of 2019 are larger."""
    old = case_stresses(with_values(helical, {"strength.edition": 2006}), 100.0)
    assert old.root[0] == pytest.approx([96.7e6, 96.9e6], rel=5e-3)
    assert old.contact[0] == pytest.approx(652.5e6, rel=5e-3)
    new = case_stresses(helical, 100.0)
    assert (old.edition, new.edition) == (2006, 2019)
    overlap = overlap_of(planetary_set(helical).gears[0], 0.023)
    cosine = math.cos(math.radians(15.0)) ** 3
    shares = [root.distribution / cosine for root in new.roots[0]]
    assert new.root[0] / old.root[0] == pytest.approx(shares)
    assert new.single_pair[0] - old.single_pair[0] == pytest.approx(overlap * (math.sqrt(1.2) - 1.0))
    proven = case_stresses(with_values(helical, {"strength.modification": "proven"}), 100.0)
    assert proven.single_pair == pytest.approx(old.single_pair)
    relief = {"kind": "tip relief", "amount": "10 um", "start_diameter": "79 mm"}
    relieved = case_stresses(with_values(helical, {"gear_1.modifications": [relief]}), 100.0)
    assert old.single_pair[0, 0] < relieved.single_pair[0, 0] < new.single_pair[0, 0]


def test_safeties_are_limits_over_stresses_and_factors(helical):
    """S_F = 2 sigma_Flim/(sigma_F0 K), S_H = sigma_Hlim/(Z sigma_H0 sqrt(K)) with factors of any source."""
    strong = with_values(helical, {**LIMITS, "strength.application_factor": 1.25})
    rating = rate_case(strong, dynamic=np.array([1.2]), face=np.array([1.1]))
    product = 1.25 * 1.2 * 1.1
    pinion, wheel = rating.flanks
    assert (pinion.name, wheel.gear) == ("gear 1", "gear_2")
    assert pinion.root_safety == pytest.approx(2 * 430e6 / (rating.nominal.root[0, 0] * product))
    stress = rating.nominal.contact[0] * rating.nominal.single_pair[0, 1]
    assert wheel.contact_safety == pytest.approx(1500e6 / (stress * math.sqrt(product)))
    assert rating.factors.sources == {"dynamic": "computed", "face": "computed"}
    assert math.isnan(rate_case(helical).flanks[0].root_safety)
    assert not rating_wanted(helical) and rating_wanted(strong)
    assert rating_wanted(with_values(helical, {"strength.quality": 6}))
    idle = rate_case(with_values(strong, {"operation.torque": "0 N m"}))
    assert math.isnan(idle.flanks[0].root_safety) and math.isnan(idle.flanks[0].contact_safety)


def test_planets_bend_both_ways_and_share(planetary):
    strong = with_values(planetary, LIMITS)
    rating = rate_case(strong, sharing=np.array([1.1, 1.2]))
    sun, sun_side, ring_side, ring = rating.flanks
    assert [flank.reversed_bending for flank in rating.flanks] == [False, True, True, False]
    assert sun_side.root_safety == pytest.approx(1.4 * 430e6 / (rating.nominal.root[0, 1] * 1.1))
    assert ring.root_factor == ring_side.contact_factor == 1.2
    assert sun.contact_safety <= 1500e6 / (rating.nominal.contact[0] * math.sqrt(1.1))


def test_a_flank_tolerance_class_gives_the_factors_of_part_1(helical, planetary):
    """Method C by its formula; the computed K_v goes before that of part 1; a fixed ring is an endless mass."""
    rated = with_values(helical, {"strength.quality": 7})
    assert mesh_frequencies(rated) == pytest.approx([500.0])
    rating = rate_case(rated)
    (factors,) = rating.standard
    assert rating.factors.dynamic[0] == factors.dynamic.factor > 1.0
    assert rating.factors.transverse[0] == factors.transverse >= 1.0
    gear = planetary_set(rated).gears[0]
    line_load = 100.0 / (gear.reference_radius * 0.023)
    speed = 2 * math.pi * 25.0 * gear.reference_radius
    by_speed = dynamic_factor_of_speed(
        grade=7, teeth=20, speed=speed, ratio=1.5, line_load=line_load, overlap=overlap_of(gear, 0.023)
    )
    assert factors.by_speed == pytest.approx(by_speed)
    computed = rate_case(rated, dynamic=np.array([1.5]))
    assert computed.factors.dynamic[0] == 1.5 and computed.standard[0].dynamic.factor == factors.dynamic.factor
    load = {"torque": 100.0, "application": 1.0, "face": 1.0, "quality": 7}
    slow, fast = (standard_factors(rated, 0, mesh_frequency=f, **load) for f in (250.0, 500.0))
    assert fast.dynamic.resonance_ratio == pytest.approx(2.0 * slow.dynamic.resonance_ratio)
    hard = with_values(planetary, {"strength.quality": 7})
    turning = with_values(hard, {"operation.fixed": "carrier"})
    fixed, loose = (
        standard_factors(case, 1, mesh_frequency=500.0, **load).dynamic.resonance_ratio for case in (hard, turning)
    )
    assert loose < fixed  # less mass moves


def test_sizes_without_tolerances_are_said_and_not_rated_by_part_1(helical):
    """ISO 1328-1 begins at a face width of 4 mm."""
    narrow = with_values(helical, {**LIMITS, "strength.quality": 6, "set.face_width": "3.5 mm", "static.slices": 3})
    rating = rate_case(narrow)
    assert rating.standard == (None,) and rating.factors.dynamic[0] == 1.0
    assert "face width of 0.0035 m" in rating.factors.message and math.isfinite(rating.flanks[0].root_safety)
    assert any("face width of 0.0035 m" in note for note in safety_notes(rating))
