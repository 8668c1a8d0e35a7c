"""A new case from what was typed: its text, or all that is wrong, each beside its field."""

import re

import pytest

from femgear.app.new_case import LABELS, asked_fields, drafted_case
from femgear.case.gear_set import planetary_set
from femgear.trains.drafts import KINDS
from femgear.trains.reading import parse_case
from femgear.trains.registry import check_case

STEEL = {"treatment": "nitrided steel", "hardness": "700"}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_made_with_a_material_for_its_safeties(kind):
    teeth = {"teeth": " ".join(map(str, KINDS[kind])), "module": "2 mm"}
    text, problems = drafted_case(kind, teeth | STEEL)
    assert problems == {}
    check_case(parse_case(text))
    assert "For safeties" not in text, "a case with a material does not ask for one"
    assert text.count('treatment = "nitrided steel"') == text.count("hardness = 700\n") == text.count("youngs_modulus")


def test_numbers_are_those_that_were_typed():
    typed = {"teeth": "20, 31", "module": "3 mm", "face_width": "31 mm", "torque": "0.2 kN m", "speed": "900 rpm"}
    text, problems = drafted_case("pair", typed | {"kind": "pair", "name": "own", "helix": "15 deg"})
    case = parse_case(text)
    assert problems == {} and [gear.teeth for gear in planetary_set(case).gears] == [20, 31]
    assert case.helix_angle == pytest.approx(0.2618, rel=1e-3) and case.operation.torque == 200.0
    assert case.operation.speeds[0] == pytest.approx(94.248, rel=1e-4) and case.material.hardness is None


def test_all_mistakes_are_told_at_once_in_words_of_the_window():
    wrong = {"teeth": "27 40 108", "planets": "4", "module": "2", "face_width": "0 mm", "torque": "5 mm"}
    wrong |= {"speed": "fast", "helix": "70 deg", "treatment": "case hardened steel", "hardness": "100"}
    text, problems = drafted_case("planetary", wrong)
    assert text == "" and {*problems} == {*wrong} - {"teeth", "treatment"}
    assert not any("--" in words for words in problems.values())
    assert "“Teeth” 27 41 109" in problems["planets"] and "660" in problems["hardness"]


@pytest.mark.parametrize(
    ("kind", "typed", "field"),
    (
        ("pair", {"teeth": "17 x"}, "teeth"),
        ("pair", {"teeth": "17 40 3"}, "teeth"),
        ("planetary", {"teeth": "17 30 91"}, "teeth"),
        ("planetary", {"planets": "2.5"}, "planets"),
        ("stepped", {"treatment": "nitrided steel", "hardness": "1"}, "hardness"),
        ("pair", {"treatment": "nitrided steel", "hardness": ""}, "hardness"),
        ("pair", {"hardness": "hard"}, "hardness"),
        ("pair", {"treatment": "nitrided steel", "hardness": "inf"}, "hardness"),
        ("pair", {"treatment": "nitrided steel", "hardness": "nan"}, "hardness"),
        ("wolfrom", {"teeth": "18 27 72 27 72"}, "teeth"),
        ("gearbox", {"speed": "-1 m"}, "speed"),
    ),
)
def test_a_mistake_stands_beside_its_field(kind, typed, field):
    text, problems = drafted_case(kind, typed)
    assert text == "" and list(problems) == [field] and not re.search(r"--\w", problems[field])


@pytest.mark.parametrize(
    ("field", "typed", "words"),
    [
        ("teeth", "17 30.5 91", "a whole number is needed, not '30.5'"),
        ("planets", "2.5", "a whole number is needed, not '2.5'"),
        ("hardness", "hard", "a number is needed, not 'hard'"),
    ],
)
def test_what_is_no_number_is_named(field, typed, words):
    assert drafted_case("planetary", {field: typed})[1][field].startswith(words)


def test_teeth_without_one_centre_distance_are_told_what_closes():
    words = drafted_case("planetary", {"teeth": "17 30 91"})[1]["teeth"]
    assert "“Teeth” 17 37 91" in words
    assert drafted_case("planetary", {"teeth": "17 37 91"})[1] == {}


def test_teeth_that_do_not_go_with_planets_are_no_second_mistake():
    assert list(drafted_case("planetary", {"teeth": "x", "planets": "4"})[1]) == ["teeth"]
    assert drafted_case("planetary", {"teeth": "24 48 120", "planets": "4"})[1] == {}


def test_kinds_are_asked_for_what_they_have():
    assert {*LABELS} - {*asked_fields("pair")} == {"planets"}
    assert {*LABELS} - {*asked_fields("planar")} == {"helix"} == {*LABELS} - {*asked_fields("wolfrom")}


@pytest.mark.parametrize("field", [name for name in LABELS if name not in ("kind", "name", "treatment")])
@pytest.mark.parametrize("typed", ["7" * 100_000, "7" * 4000, "x" * 100_000, f"{'7' * 100_000} mm"])
def test_what_is_typed_at_great_length_is_told_in_short(field, typed):
    others = {"teeth": "17 37 91", "module": "2 mm", "treatment": "nitrided steel", "hardness": "700"}
    text, problems = drafted_case("planetary", others | {field: typed})
    assert text == "" and problems and all(len(words) < 400 for words in problems.values())
