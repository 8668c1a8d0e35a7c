"""Load cases of a REXS unit: groups of shafts, who takes the power, shares, powers."""

import math

import pytest
from rexs_stage import NONE, ParallelUnit
from rexs_units import IndustrialUnit
from trains.test_imports import drafts_of

from femgear.exchange.unit_operation import shaft_groups
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.reading import parse_case


def test_groups_of_shafts_and_how_they_turn():
    pair, differential, held = shaft_groups(
        ["a", "b", "s", "c", "r", "x", "y"], [["a", "b"], ["s", "c", "r"], ["x", None, "y"]], [], ["y"]
    )
    assert (pair.shafts, pair.freedom, pair.ends) == (("a", "b"), 1, ("a", "b"))
    assert (differential.freedom, differential.ends) == (2, ("s", "c", "r"))
    assert (held.freedom, held.ends) == (0, ("x",))


def test_couplings_take_a_freedom_once():
    (group,) = shaft_groups(["a", "b", "c"], [["b", "c"]], [["a", "b"], ["a", "b"]])
    assert group.freedom == 1 and group.ends == ("a", "b", "c")


def test_powers_give_torques(tmp_path):
    box = ParallelUnit().set(5, torque_around_u_axis=None, power=(20.0, "kW"))
    case = parse_case(drafts_of(box, tmp_path)[0][""].text)
    assert case.load_case.torque["load 5"] == pytest.approx(20e3 / (1500.0 * math.pi / 30.0))


def test_a_torque_at_either_end_counts_once(tmp_path):
    box = ParallelUnit()
    box.add(6, "external_load", torque_around_u_axis=(-600.0, "N m"), u_coordinate_on_shaft=(200.0, "mm"))
    box.relate("assembly", assembly=30, part=6)
    case = parse_case(drafts_of(box, tmp_path)[0][""].text)
    assert case.operation.output == ("load 6",)
    assert gearbox_flow(case).port_torque["load 6"] == pytest.approx(-600.0)


def test_speeds_that_the_file_lacks_are_assumed_and_told(tmp_path):
    found, findings = drafts_of(ParallelUnit().set(10, rotational_speed=None), tmp_path)
    assert [*parse_case(found[""].text).load_case.speed.values()] == pytest.approx([1000.0 * math.pi / 30.0])
    assert any("does not tell the speed" in one.text for one in findings)


def test_load_cases_without_torque_are_left_out_and_shares_are_the_whole_time(tmp_path):
    box = IndustrialUnit()
    box.load_cases[1][40]["torque_around_u_axis"] = (0.0, "N m")
    for number, share in enumerate((40, 40, 60, 60)):
        box.load_cases[number][1]["load_duration_fraction"] = (share, "%")
    found, findings = drafts_of(box, tmp_path, load_case=3)
    case = parse_case(found[""].text)
    assert [one.name for one in case.operation.load_case] == ["load case 1", "load case 3", "load case 4"]
    assert case.operation.first == 2
    assert [one.share for one in case.operation.load_case] == pytest.approx([0.25, 0.375, 0.375])
    assert any("load case 2 has no torque" in one.text for one in findings)


def test_loads_that_transmit_nothing_take_no_power(tmp_path):
    box = ParallelUnit()
    box.add(6, "external_load", transmits_torque=("false", NONE), force_v_direction=(50.0, "N"))
    box.relate("assembly", assembly=30, part=6)
    case = parse_case(drafts_of(box, tmp_path)[0][""].text)
    assert case.operation.output == ("output",) and case.load_case.force["load 6"] == (50.0, 0.0, 0.0)


def test_durations_of_a_unit_are_shares_of_its_load_cases(tmp_path):
    box = IndustrialUnit()
    for given, hours in zip(box.load_cases, (100, 200, 300, 400), strict=True):
        given[1] = {"load_duration": (hours, "h")}
    case = parse_case(drafts_of(box, tmp_path)[0][""].text)
    assert [one.share for one in case.operation.load_case] == pytest.approx([0.1, 0.2, 0.3, 0.4])
