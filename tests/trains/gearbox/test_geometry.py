"""Sizes of stages: as given, and as the teeth have them."""

import math

import pytest
from small_gearbox import TEETH, pair_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.case_file import BoxPlanetarySection, PairSection
from femgear.trains.gearbox.geometry import pair_sizes, set_sizes
from femgear.trains.reading import read_case


def pair(**gears) -> PairSection:
    return PairSection.model_validate(
        {"name": "p", "shafts": ["a", "b"], "gears": {"teeth": [20, 40]} | gears, "mesh": {"stiffness": "1e8 N/m"}}
    )


def test_module_radii_and_base_radii_say_the_same():
    cosine = math.cos(math.radians(20.0))
    ways = (
        {"module": "2 mm"},
        {"radii": ["20 mm", "40 mm"]},
        {"base_radii": [f"{20 * cosine} mm", f"{40 * cosine} mm"]},
    )
    for way in ways:
        sizes = pair_sizes(pair(**way))
        assert sizes.base_radii == pytest.approx((0.02 * cosine, 0.04 * cosine), rel=1e-12)
        assert sizes.centre_distance == pytest.approx(0.06, rel=1e-12)
    assert pair_sizes(pair(module="2 mm", internal=True)).centre_distance == pytest.approx(0.02, rel=1e-12)


def test_radii_of_another_ratio_than_the_teeth_are_refused():
    with pytest.raises(CaseError, match="E-TEETH"):
        pair_sizes(pair(radii=["20 mm", "41 mm"]))


def test_teeth_give_the_sizes_of_their_gears():
    sizes = pair_sizes(read_case(pair_tables(teeth=True)).pair[0])
    assert sizes.teeth == (24, 36)
    assert sizes.centre_distance == pytest.approx(0.09, rel=1e-12)
    assert sizes.face_widths == (0.02, 0.02)
    assert TEETH["gear_1"]["teeth"] == 24


def test_base_helix_of_a_transverse_pressure_angle():
    beta, alpha = math.radians(15.0), math.radians(20.0)
    sizes = pair_sizes(pair(module="2 mm", helix_angle="15 deg"))
    assert math.tan(sizes.base_helix) == pytest.approx(math.tan(beta) * math.cos(alpha), rel=1e-12)


def planetary(**gears) -> BoxPlanetarySection:
    return BoxPlanetarySection.model_validate(
        {"name": "s", "sun": "a", "carrier": "b", "gears": {"teeth": [20, 21, 64], "module": "2 mm"} | gears}
    )


def test_a_shifted_set_has_two_working_pressure_angles():
    sizes = set_sizes(planetary(centre_distance="42.5 mm"))
    sun, planet, ring = sizes.base_radii
    assert math.cos(sizes.pressure_angles[0]) == pytest.approx((sun + planet) / 0.0425, rel=1e-12)
    assert math.cos(sizes.pressure_angles[1]) == pytest.approx((ring - planet) / 0.0425, rel=1e-12)
    with pytest.raises(CaseError, match="E-CENTRE-DISTANCE"):
        set_sizes(planetary(centre_distance="38 mm"))
