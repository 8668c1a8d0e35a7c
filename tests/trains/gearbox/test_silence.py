"""Gearboxes without a response, and the entries that have no effect then."""

import pytest
from small_gearbox import pair_tables, planetary_tables

from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.silence import idle_entries, silence_words, why_silent
from femgear.trains.reading import read_case
from femgear.trains.registry import train_of

FEET = [
    {"position": [f"{x} mm", "-60 mm", f"{z} mm"], "stiffness": ["1e8 N/m"] * 3} for x in (-50, 140) for z in (0, 90)
]
ASKED = {
    "casing": {
        "mass": "20 kg",
        "centre": ["45 mm", "0 mm", "45 mm"],
        "inertia": ["0.1 kg m^2"] * 3,
        "foot": FEET,
    },
    "sensor": [{"name": "top", "position": ["45 mm", "60 mm", "45 mm"], "direction": "y"}],
    "runup": {"count": 5},
}


def _standing(tables) -> None:
    tables["operation"]["load_case"][0]["speed"]["input"] = "0 rpm"


@pytest.mark.parametrize(
    ("teeth", "change", "words"),
    [
        (False, lambda tables: None, "no stage has teeth or contact ratios"),
        (True, lambda tables: tables.update(deflection={"contact": False}), "deflection.contact = false"),
        (True, _standing, "nothing turns"),
    ],
)
def test_entries_of_a_response_that_there_is_not_are_told(teeth, change, words):
    tables = pair_tables(teeth=teeth) | ASKED
    change(tables)
    case = read_case(tables)
    assert words in why_silent(case)
    assert silence_words(case).startswith(f"{why_silent(case)}: ")
    findings = [*idle_entries(case)]
    assert [(one.code, one.key) for one in findings] == [("W-UNUSED", "sensor"), ("W-UNUSED", "runup")]
    assert all(words in one.text and one.remedy for one in findings)
    assert {*findings} <= {*train_of(case).case_warnings(case)}
    # what nobody asked for is not missed
    assert not [*idle_entries(read_case({key: tables[key] for key in tables.keys() - {"sensor", "runup"}}))]


def test_a_gearbox_that_is_heard_says_nothing():
    case = read_case(pair_tables(teeth=True) | ASKED)
    assert why_silent(case) == "" and not [*idle_entries(case)]


MESH = {"stiffness": "3e8 N/m", "contact_ratio": 1.5}


@pytest.mark.parametrize(("ring", "words"), [("1000 rpm", "turn as a block"), ("900 rpm", "")])
def test_teeth_of_a_set_that_turns_as_a_block_do_not_pass(ring, words):
    tables = planetary_tables(ring="ring", sun_mesh=MESH, ring_mesh=MESH)
    tables["shaft"].append({"name": "ring"})
    tables["mass"].append({"shaft": "ring", "mass": "4 kg", "inertia": "2e-2 kg m^2"})
    tables["bearing"].append(tables["bearing"][1] | {"shaft": "ring"})
    tables["operation"] = {
        "output": ["carrier", "ring"],
        "load_case": [{"torque": {"sun": "100 N m"}, "speed": {"sun": "1000 rpm", "ring": ring}}],
    }
    case = read_case(tables)
    flow = gearbox_flow(case)
    assert words in why_silent(case) and bool(words) == bool(why_silent(case))
    assert flow.passes(case.planetary[0]) == (not words) and flow.carries(case.planetary[0])
