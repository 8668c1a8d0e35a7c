"""Messages of a case file in the words of its author: near keys, places, units, all mistakes at once."""

import re
import tomllib
from pathlib import Path

import pytest
from trains.test_reading import CASE, TEXT, _root_radius_code, refused, replaced

from femgear.case.gear_set import planetary_set
from femgear.case.messages import idle_materials_and_oil, no_such
from femgear.errors import CaseError, GeometryError
from femgear.trains.reading import read_case, with_value, with_values


def test_unknown_key_suggests_the_near_one(tmp_path):  # bad input 4
    error = refused(replaced("module =", "modul ="), tmp_path)
    assert {problem.code for problem in error.problems} == {"E-KEY-UNKNOWN", "E-KEY-MISSING"}
    unknown = next(problem for problem in error.problems if problem.code == "E-KEY-UNKNOWN")
    line = next(n for n, text in enumerate(TEXT.splitlines(), 1) if text.startswith("module"))
    assert unknown.key == "sun.modul" and "module?" in unknown.remedy and f"case.toml:{line}" in unknown.file


def test_a_key_in_the_wrong_section_is_told_where_it_belongs(tmp_path):  # bad input 4
    error = refused(replaced("[planet]\n", "[planet]\nmodule = '1.5 mm'\n"), tmp_path)
    assert error.key == "planet.module" and "[sun]" in error.remedy


def test_all_missing_keys_are_listed_at_once(tmp_path):  # bad input 5
    text = TEXT
    for line in ('module = "1.5 mm"\n', 'outer_radius = "100 mm"\n', 'torque = "100 N m"', "planets = 3\n"):
        text = replaced(line, "", text)
    error = refused(text, tmp_path)
    missing = {problem.key for problem in error.problems}
    assert missing == {"sun.module", "ring.outer_radius", "operation.torque", "set.planets"}
    assert all(problem.code == "E-KEY-MISSING" and problem.key in str(error) for problem in error.problems)


def test_missing_sections_are_listed_with_their_keys(tmp_path):  # bad input 5
    error = refused("title = 'nothing'\n", tmp_path)
    assert {"set", "material", "sun", "planet", "ring", "operation"} == {p.key for p in error.problems}
    assert "module, pressure_angle" in str(error)


def test_several_problems_come_in_one_error(tmp_path):
    text = replaced('"20 deg"', '"20 rad"', replaced('"100 N m"', "100", replaced("teeth = 40", "teeth = 4.5")))
    error = refused(text, tmp_path)
    assert [problem.key for problem in error.problems] == [
        "sun.pressure_angle",
        "planet.teeth",
        "operation.torque",
    ]
    assert "3 problems" in str(error)
    lines = text.splitlines()
    for problem in error.problems:
        number = int(problem.file.rsplit(":", 1)[1])
        assert lines[number - 1].startswith(problem.key.split(".")[1])


@pytest.mark.parametrize(
    ("key", "value", "advice"),
    [
        ("sun.module", 0.0012, '"1.2 mm" if it is in m'),
        ("sun.module", 1.5, '"1.5 mm"'),
        ("sun.bore_radius", 0.5, '"0.5 mm", or "500 mm" if it is in m'),
        ("sun.pressure_angle", 0.35, '"20.0535 deg" if it is in rad'),
        ("operation.speeds", [100.0], '"100.0 rpm", or "954.93 rpm" if it is in rad/s'),
        ("sun.mass", 2, '"2 kg"'),
        ("sun.module", 10**400, 'such as "1 mm"'),
    ],
)
def test_bare_numbers_are_told_how_to_be_written(key, value, advice):
    """The text that the remedy shows is accepted as it stands, and means the number given in SI units."""
    case = read_case(CASE)
    with pytest.raises(CaseError, match="E-UNIT") as caught:
        with_value(case, key, value)
    assert caught.value.remedy == f"write it as text with the unit, {advice}"


def test_fillets_in_the_way_name_a_root_radius_that_is_not():
    case = with_values(read_case(CASE), {"rack.root_radius": 0.38, "ring.tip_diameter": "158.85 mm"})
    with pytest.raises(GeometryError, match="E-FILLET") as caught:
        planetary_set(case)
    limit = float(re.search(r"root_radius to ([0-9.]+) or less", caught.value.remedy)[1])
    planetary_set(with_value(case, "rack.root_radius", limit))
    assert _root_radius_code(case, limit + 1e-4) == "E-FILLET"


def test_refused_root_radius_of_one_gear_names_its_own_rack():
    case = with_value(read_case(CASE), "planet.rack", {"root_radius": 0.6})
    with pytest.raises(GeometryError, match="E-ROOT-RADIUS") as caught:
        planetary_set(case)
    assert caught.value.key == "planet.rack.root_radius" and caught.value.value == 0.6


def test_refusals_show_values_in_the_unit_of_their_entry():
    case = read_case(CASE)
    for changes, key, found in (
        (
            {"sun.profile_shift": -0.5, "sun.tip_diameter": None},
            "set.centre_distance",
            "contact ratio 0.8283",
        ),
        ({"set.backlash": "6 mm"}, "set.backlash", "6 mm"),
    ):
        with pytest.raises(GeometryError) as caught:
            planetary_set(with_values(case, changes))
        assert (caught.value.key, caught.value.value) == (key, found)


def test_a_name_that_nothing_has_is_refused_with_the_nearest():
    names = ["Sun shaft", "ring"]
    near = no_such("part", "load[0].shaft", "sun shfat", names, "name a [[shaft]]", limit="a shaft")
    assert (near.code, near.key, near.value, near.remedy) == (
        "E-CHOICE",
        "load[0].shaft",
        "sun shfat",
        "did you mean Sun shaft?",
    )
    assert no_such("part", "load[0].shaft", "wheel", names, "name a [[shaft]]", limit="a shaft").remedy == (
        "name a [[shaft]]"
    )


def test_entries_of_strength_and_oil_without_effect_are_told():
    tables = tomllib.loads(Path("cases/spur_pair.toml").read_text(encoding="utf-8"))
    assert not list(idle_materials_and_oil(read_case(tables)))
    del tables["material"]["treatment"]
    tables["lubricant"] = {"viscosity": "30 mm^2/s"}
    tables["gear_2"]["material"] = {"grade": "ME"}
    assert [told.key for told in idle_materials_and_oil(read_case(tables))] == [
        "material.hardness",
        "gear_2.material.grade",
        "lubricant",
    ]
    # a gear with a treatment takes the hardness of the others
    tables["gear_1"]["material"] = {"treatment": "case hardened steel"}
    tables["losses"] = {"friction": "constant", "coefficient": 0.05}
    assert [told.key for told in idle_materials_and_oil(read_case(tables))] == ["gear_2.material.grade"]
