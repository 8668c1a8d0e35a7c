"""Stresses of the teeth of a gearbox are those of the stage alone under the same contact."""

import numpy as np
import pytest

from femgear.run import solve
from femgear.stages.stress_reasons import reason_row
from femgear.trains.gearbox.stress import (
    box_reason_rows,
    box_stress_warnings,
    describe_box_stress,
    stage_parts,
    why_no_stress,
)
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import read_case, with_values


@pytest.fixture(scope="module")
def pair():
    """Return a pair with a kinked relief, and the gearbox that it is."""
    relief = {"kind": "tip relief", "amount": "60 um", "start_diameter": "74.6 mm", "shape": "linear"}
    changes = {"gear_1.modifications": [relief], "static.positions": 16}
    case = with_values(read_case("cases/spur_pair.toml"), changes)
    return case, read_case(gearbox_of_case(case).tables)


@pytest.fixture(scope="module")
def stresses(pair):
    """Return stress.nc of both."""
    return [solve(case, only="stress")["stress"].dataset() for case in pair]


def test_a_pair_in_a_gearbox_has_the_stresses_of_the_pair(stresses):
    alone, box = stresses
    for name in ("root_worst", "root_range_minimum", "iso_root_stress", "contact_worst_load"):
        assert box[name].values == pytest.approx(alone[name].values, rel=1e-9), name
    largest = alone["contact_pressure"].values.max(axis=-1)
    assert np.all(box["largest_pressure"].values >= largest * (1.0 - 1e-9))
    assert list(box["mesh"].values) == ["pair"]


def test_findings_name_the_stage_and_its_entry(stresses):
    (name, key, part), *others = stage_parts(stresses[1])
    assert (name, key, others) == ("pair", "pair[0].teeth", []) and list(part["mesh"].values) == ["gear 1-gear 2"]
    (told,) = box_stress_warnings(stresses[1])
    assert told.code == "W-KINK" and told.key == "pair[0].teeth" and told.text.startswith("pair: ")
    (block,) = describe_box_stress(stresses[1], [told])
    assert "†" in block.rows[0][1] and "†" not in block.rows[1][1]


def test_a_gearbox_without_teeth_or_contact_says_why_it_has_none(pair):
    assert why_no_stress(pair[1]) == ""
    assert "deflection.contact" in why_no_stress(with_values(pair[1], {"deflection.contact": False}))
    assert "no stage has teeth" in why_no_stress(read_case("cases/four_stage_reducer.toml"))
    still = with_values(pair[1], {"operation.load_case[0].torque": dict.fromkeys(pair[1].load_case.torque, "0 N m")})
    assert why_no_stress(still).endswith("has no torque")


def test_the_verdict_says_which_stresses_differ_from_nominal_ones(stresses):
    alone, box = (data.copy() for data in stresses)
    for data in (alone, box):
        data["iso_root_stress"] = 0.5 * data["root_worst"]
    ((title, text),) = box_reason_rows(box)
    assert title.startswith("FE over ISO 6336") and "root gear 1 2.00 (see Stresses)" in text
    roots = [part for part in text.split("), ") if part.startswith("root")]
    ((_, same),) = reason_row(alone)
    assert roots == [part for part in same.split("), ") if part.startswith("root")]
