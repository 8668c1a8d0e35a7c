"""Power that flows through the stages of a REXS gear unit, against ratios in closed form."""

import math

import pytest
from rexs_stage import NONE, Gearbox, ParallelUnit, both_units

from femgear.exchange.gear_unit import stage_components, stage_in_words, unit_flow, unit_stages
from femgear.exchange.rexs import read_model

RPM = math.pi / 30.0


def flow_of(box, tmp_path, given=None):
    model = read_model(box.write(tmp_path / "unit.rexs"))
    flow = unit_flow(model, given or {})
    return {int(id): one / RPM for id, one in flow.speed.items()}, {int(id): one for id, one in flow.torque.items()}


def test_two_parallel_stages(tmp_path):
    speed, torque = flow_of(ParallelUnit(), tmp_path)
    assert speed == pytest.approx({10: 1500.0, 20: -750.0, 30: 250.0})
    # gear 1 is braked by its mesh; the mesh of gear 3 brakes shaft 2, which turns the other way
    assert torque == pytest.approx({51: -100.0, 52: 200.0})


def test_it_does_not_matter_where_speed_and_torque_are_given(tmp_path):
    box = ParallelUnit()
    del box.components[10]["attributes"]["rotational_speed"]
    box.components[30]["attributes"]["rotational_speed"] = (250.0, "1 / min")
    box.relations.remove(("assembly", {"assembly": 10, "part": 5}))
    box.relate("assembly", assembly=30, part=5)
    speed, torque = flow_of(box.set(5, torque_around_u_axis=(-600.0, "N m")), tmp_path)
    assert speed == pytest.approx({10: 1500.0, 20: -750.0, 30: 250.0})
    assert torque == pytest.approx({51: -100.0, 52: 200.0})


def test_both_ends_of_a_chain_may_be_given(tmp_path):
    box = ParallelUnit()
    box.add(6, "external_load", torque_around_u_axis=(-600.0, "N m"))
    box.relate("assembly", assembly=30, part=6)
    assert flow_of(box, tmp_path)[1] == pytest.approx({51: -100.0, 52: 200.0})
    # those that do not balance determine nothing
    assert flow_of(box.set(6, torque_around_u_axis=(-500.0, "N m")), tmp_path)[1] == {}


def test_what_nothing_determines_is_missing(tmp_path):
    box = ParallelUnit()
    del box.components[10]["attributes"]["rotational_speed"]
    assert flow_of(box.set(5, torque_around_u_axis=None), tmp_path) == ({}, {})


def test_stages_are_listed_without_the_meshes_of_planets(tmp_path):
    model = read_model(both_units().write(tmp_path / "unit.rexs"))
    words = [stage_in_words(model, one) for one in stage_components(model)]
    assert words[0].startswith("planetary_stage 9") and len(words) == 3 and "25/50" in words[1]
    assert next(set(one.arms) for one in unit_stages(model)) == {"34", "62", "4"}
    box = Gearbox().set(58, number_of_teeth=("0", NONE))
    assert unit_stages(read_model(box.write(tmp_path / "none.rexs"))) == []


def test_a_carrier_on_no_shaft_leaves_its_stage_out(tmp_path):
    box = both_units()
    box.components[4]["type"] = "gear_casing"
    model = read_model(box.write(tmp_path / "unit.rexs"))
    assert [one.component.id for one in unit_stages(model)] == ["50051", "50052"]
    assert "9" not in unit_flow(model, {}).torque
