"""Shafts of a gear unit as a chain of bodies: senses, couplings, what stands beside a planetary stage."""

import pytest
from exchange.test_gear_unit import flow_of
from rexs_stage import ParallelUnit, both_units


def test_internal_gears_keep_the_sense(tmp_path):
    box = ParallelUnit()
    box.components[44]["type"] = "ring_gear"
    speed, torque = flow_of(box, tmp_path)
    assert speed[30] == pytest.approx(-250.0) and torque[52] == pytest.approx(200.0)


def test_couplings_join_shafts_and_hold_them(tmp_path):
    box = ParallelUnit()
    box.add(60, "shaft")
    box.add(61, "coupling")
    box.relate("side", assembly=61, inner_part=60, outer_part=10)
    box.relations.remove(("assembly", {"assembly": 10, "part": 5}))
    box.relate("assembly", assembly=60, part=5)
    assert flow_of(box, tmp_path)[1] == pytest.approx({51: -100.0, 52: 200.0})


def test_a_planetary_stage_and_what_stands_beside_it(tmp_path):
    speed, torque = flow_of(both_units(), tmp_path)
    # Willis: a ring that is held, 17/61 teeth
    assert speed[4] == pytest.approx(1500.0 * 17 / 78) and speed[62] == 0.0
    assert torque == pytest.approx({9: -1591.5494309, 50051: -100.0, 50052: 200.0})
