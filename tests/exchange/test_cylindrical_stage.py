"""Two gears of a REXS file as a pair: internal ones, senses of thrusts."""

import math

import pytest
from rexs_stage import DEG, NONE, ParallelUnit
from trains.test_imports import drafts_of

from femgear.trains.reading import parse_case


def test_a_unit_of_one_pair(tmp_path):
    box = ParallelUnit()
    del box.components[52]
    box.relations = [one for one in box.relations if 52 not in one[1].values()]
    found, _ = drafts_of(box, tmp_path)
    assert list(found) == [""]
    assert parse_case(found[""].text).operation.torque == 100.0


def test_an_internal_pair(tmp_path):
    box = ParallelUnit().set(44, number_of_teeth=(60, NONE))
    box.components[44]["type"] = "ring_gear"
    box = box.set(52, center_distance=(60.0, "mm"))
    box.components[31]["attributes"] |= {"outer_diameter_begin": (220.0, "mm"), "outer_diameter_end": (220.0, "mm")}
    for flank in (1044, 2044):
        box = box.set(flank, addendum_coefficient_basic_profile=(0.8, NONE))
    found, _ = drafts_of(box, tmp_path)
    case = parse_case(found["_52"].text)
    assert case.gear_2.internal and case.gear_2.outer_radius == pytest.approx(0.11)
    assert "" not in found  # no drivetrain of internal gears


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_thrust_of_helical_gears_has_its_sense(tmp_path, sense):
    """A right-handed pinion that drives counter-clockwise is pushed along its axis, its wheel against it."""
    box = ParallelUnit().set(10, rotational_speed=(sense * 1500.0, "1 / min"))
    box = box.set(5, torque_around_u_axis=(sense * 100.0, "N m"))
    box = box.set(41, helix_angle_reference_diameter=(10.0, DEG))
    box = box.set(42, helix_angle_reference_diameter=(-10.0, DEG))
    box = box.set(51, center_distance=(75.0 / math.cos(math.radians(10.0)), "mm"))
    found, _ = drafts_of(box, tmp_path)
    assert f'helix_angle = "{-sense * 10:g} deg"' in found[""].text
    assert parse_case(found["_51"].text).static.slices == 25
