"""Two gears of a REXS file as a pair: internal ones, senses of thrusts."""

import pytest
from rexs_stage import NONE, ParallelUnit
from trains.test_imports import drafts_of

from femgear.case import text as case_text
from femgear.trains.reading import parse_case


def test_a_unit_of_one_pair(tmp_path):
    box = ParallelUnit()
    del box.components[52]
    box.relations = [one for one in box.relations if 52 not in one[1].values()]
    found, _ = drafts_of(box, tmp_path, stage="51")
    assert list(found) == [""]
    assert parse_case(found[""].text).operation.torque == 100.0
    whole = parse_case(drafts_of(box, tmp_path)[0][""].text)
    assert whole.train == "gearbox" and [one.name for one in whole.shaft] == ["shaft 10", "shaft 20"]


def test_an_internal_pair(tmp_path):
    box = ParallelUnit().set(44, number_of_teeth=(60, NONE))
    box.components[44]["type"] = "ring_gear"
    box = box.set(52, center_distance=(60.0, "mm"))
    box.components[31]["attributes"] |= {"outer_diameter_begin": (220.0, "mm"), "outer_diameter_end": (220.0, "mm")}
    for flank in (1044, 2044):
        box = box.set(flank, addendum_coefficient_basic_profile=(0.8, NONE))
    found, _ = drafts_of(box, tmp_path)
    unit = parse_case(found[""].text)
    case = parse_case(case_text.write(unit.pair[1].teeth))
    assert case.gear_2.internal and case.gear_2.outer_radius == pytest.approx(0.11)
