"""Speeds, torques and frequencies of a case, and where its refusals stand."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_gearbox import pair_tables, split_pair_tables

from femgear.case import text as case_text
from femgear.errors import CaseError, FemgearError
from femgear.measured.heard_set import heard_set
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.power import gearbox_flow, heard_stages, turns_in_words
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import parse_case, read_case
from femgear.trains.registry import heard_in

RPM = math.pi / 30.0
CASES = Path(__file__).parents[3] / "cases"


def test_a_pair_turns_and_carries_by_its_teeth():
    flow = gearbox_flow(read_case(pair_tables()))
    assert flow.speed["output"] == pytest.approx(-1000.0 * RPM * 24 / 36, rel=1e-15)
    assert flow.port_torque == pytest.approx({"motor": 100.0, "brake": 150.0}, rel=1e-15)
    assert flow.mesh_frequency == pytest.approx({"stage": 400.0}, rel=1e-12)
    assert turns_in_words(flow.frequencies["stage"]) == "3 and 2 turns, 0.18 s"
    still = replace(flow.frequencies["stage"], hunting_time={"mesh": math.inf}, hunting_turns={"mesh": (3, 2)})
    assert turns_in_words(still) == "3 and 2 turns"


def test_the_electric_axle():
    flow = gearbox_flow(read_case("cases/e_axle.toml"))
    ratio = 72 / 25 * (1 + 73 / 23)
    assert flow.speed["output"] == pytest.approx(-9000.0 * RPM / ratio, rel=1e-12)
    assert flow.port_torque["wheels"] == pytest.approx(35.0 * ratio, rel=1e-12)
    sun, carrier = flow.speed["intermediate"], flow.speed["output"]
    assert flow.planet_speed["second stage"] == pytest.approx(carrier - (sun - carrier) * 23 / 24, rel=1e-12)
    assert flow.first_torque(read_case("cases/e_axle.toml").planetary[0]) == pytest.approx(35.0 * 72 / 25, rel=1e-12)


def test_a_speed_that_follows_from_another_holds_nothing_more():
    tables = pair_tables()
    alone = solve_deflection(read_case(tables))
    tables["operation"]["load_case"][0]["speed"]["output"] = f"{-1000.0 * 24 / 36!r} rpm"
    case = read_case(tables)
    assert gearbox_flow(case).independent == ("input",)
    assert solve_deflection(case).mesh_force == pytest.approx(alone.mesh_force, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "code", "key"),
    [
        (lambda o: o.update(output=[]), "E-LOAD-BALANCE", "operation.output"),
        (lambda o: o["load_case"][0].update(speed={}), "E-MECHANISM", "operation.load_case[0].speed"),
        (
            lambda o: o["load_case"][0]["speed"].update(output="5 rpm"),
            "E-SPEED",
            "operation.load_case[0].speed",
        ),
    ],
)
def test_refusals_name_entries_of_the_case(change, code, key):
    tables = pair_tables()
    change(tables["operation"])
    with pytest.raises(FemgearError) as error:
        gearbox_flow(read_case(tables))
    found = error.value.problems or (error.value,)
    assert [(one.code, one.key) for one in found] == [(code, key)]


def test_teeth_touch_where_a_torque_beyond_rounding_acts_on_them():
    case = read_case(pair_tables(teeth=True))
    flow = gearbox_flow(case)
    assert flow.touches(case.pair[0])
    idle = replace(flow, stage_torque={"stage": {"input": 1e-13, "output": -1e-13}, "other": {"input": 5.0}})
    assert not idle.touches(case.pair[0])
    assert not flow.touches(case.pair[0].model_copy(update={"teeth": None}))


def test_stages_side_by_side_begin_with_equal_shares():
    flow = gearbox_flow(read_case(split_pair_tables()))
    assert flow.side_by_side == (("stage", "second"),)
    assert flow.torque_shares == pytest.approx({"stage": 0.5, "second": 0.5}, rel=1e-12)
    uneven = flow.with_factors({"stage": 1.5, "second": 0.5})
    assert uneven.torque_shares == pytest.approx({"stage": 0.75, "second": 0.25}, rel=1e-12)
    assert uneven.stage_torque["stage"] == pytest.approx({"input": -75.0, "output": -112.5}, rel=1e-12)


@pytest.fixture(scope="module")
def reducer():
    return read_case(CASES / "four_stage_reducer.toml")


def test_stages_have_their_teeth_and_the_turns_of_their_carriers(reducer):
    stages = heard_stages(reducer)
    assert list(stages) == [f"stage {number}" for number in (1, 2, 3, 4)]
    first, second = stages["stage 1"], stages["stage 2"]
    assert first.teeth == (105, 21, 42)
    assert np.degrees(first.angles) == pytest.approx([0.0, 120.0, 240.0])
    # Willis: a carrier makes z_s/(z_s + z_r) turns in one of its sun
    for stage in stages.values():
        assert stage.carrier_per_turn["sun"] == pytest.approx(stage.sun / (stage.sun + stage.ring))
    both = first.carrier_per_turn["sun"] * second.carrier_per_turn["sun"]
    assert second.carrier_per_turn["stage 1 sun"] == pytest.approx(both)


def test_a_set_written_as_a_gearbox_is_the_same_set():
    case = read_case(CASES / "planetary_27_40_108.toml")
    box = parse_case(case_text.write(gearbox_of_case(case).tables), name="box.toml")
    alone, stage = heard_set(case), heard_in(box)
    assert stage.teeth == alone.teeth
    assert stage.carrier_per_turn["sun"] == pytest.approx(alone.carrier_per_turn["sun"])
    assert stage.carrier_per_turn[stage.input] == pytest.approx(alone.carrier_per_turn[alone.input])


def test_one_of_several_stages_must_be_named(reducer):
    for stage in (None, "stage 5"):
        with pytest.raises(CaseError) as caught:
            heard_in(reducer, stage)
        assert caught.value.code == "E-CHOICE"
        assert '"stage 2"' in str(caught.value)
    assert heard_in(reducer, "stage 3").ring == heard_stages(reducer)["stage 3"].ring


def test_a_set_of_its_own_has_no_stages():
    case = read_case(CASES / "planetary_27_40_108.toml")
    assert heard_in(case).teeth == (108, 27, 40)
    with pytest.raises(CaseError) as caught:
        heard_in(case, "set")
    assert caught.value.key == "--stage"
