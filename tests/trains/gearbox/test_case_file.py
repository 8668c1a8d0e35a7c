"""The entries of a gearbox case: what is read, teeth from a file, refusals with keys."""

import math

import pytest
from small_gearbox import TEETH, pair_tables

from femgear.case import text as case_text
from femgear.errors import CaseError
from femgear.trains.gearbox.case_file import named_load_case, teeth_of
from femgear.trains.reading import read_case, to_toml


def test_a_case_read_from_its_text_is_itself():
    case = read_case(pair_tables(teeth=True))
    assert read_case(to_toml(case)) == case
    assert case.shaft_named("output").axis == (0.09, 0.0)
    assert case.load_case.torque == {"motor": 100.0}
    assert case.load_case.speed["input"] == pytest.approx(1000.0 * math.pi / 30.0)


def test_teeth_stand_in_the_file_or_in_one_that_it_names(tmp_path):
    tables = pair_tables(teeth=True)
    (tmp_path / "stage.toml").write_text(case_text.write(TEETH))
    inside = read_case(tables)
    tables["pair"][0]["teeth"] = "stage.toml"
    (tmp_path / "box.toml").write_text(case_text.write(tables))
    named = read_case(tmp_path / "box.toml")
    assert named.pair[0].teeth == inside.pair[0].teeth
    assert teeth_of(named.pair[0]).gear_1.teeth == 24


def test_a_shaft_knows_its_length_and_steps():
    tables = pair_tables()
    tables["shaft"][0]["part"] = [
        {"length": "30 mm", "outer_diameter": "30 mm"},
        {"length": "60 mm", "outer_diameter": "40 mm", "end_outer_diameter": "20 mm"},
    ]
    shaft = read_case(tables).shaft_named("input")
    assert shaft.length == pytest.approx(0.09)
    assert shaft.places == pytest.approx((0.0, 0.03, 0.09))


@pytest.mark.parametrize(
    ("change", "key"),
    [
        (lambda t: t["shaft"][0].update(name="a/b"), "shaft[0].name"),
        (lambda t: t["shaft"][0]["part"][0].update(length="0 mm"), "shaft[0].part[0].length"),
        (lambda t: t["bearing"][0].update(radial="-1 N/m"), "bearing[0].radial"),
        (lambda t: t["pair"][0].update(teeth=3), "pair[0].teeth"),
        (lambda t: t.update(motions="line"), "motions"),
    ],
)
def test_refusals_name_the_entry(change, key):
    tables = pair_tables()
    change(tables)
    with pytest.raises(CaseError) as error:
        read_case(tables)
    assert key in str(error.value)


def test_a_direction_that_is_none_is_told_those_that_are():
    tables = pair_tables() | {"sensor": [{"name": "top", "direction": "up"}]}
    with pytest.raises(CaseError) as error:
        read_case(tables)
    assert (error.value.key, error.value.value) == ("sensor[0].direction", "up")
    assert "x, -x, y, -y, z, -z" in error.value.limit


def test_the_words_load_case_stand_once_in_a_sentence():
    assert named_load_case("Load case 1") == "Load case 1"
    assert named_load_case("nominal") == "load case nominal"
