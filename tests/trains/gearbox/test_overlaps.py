"""Shafts and gears in one another: what is told, and that gearboxes which can be put together tell nothing."""

from pathlib import Path

import pytest
from small_gearbox import pair_tables, set_on_shafts

from femgear.trains.gearbox.overlaps import common_faces, overlaps
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[3] / "cases"


def told(tables) -> dict[str, str]:
    """Texts of the findings of a case by their keys."""
    return {finding.key: finding.text for finding in overlaps(read_case(tables))}


@pytest.mark.parametrize("name", ["e_axle", "five_megawatt_chain", "planet_carrier"])
def test_shipped_gearboxes_can_be_put_together(name):
    assert not [*overlaps(read_case(CASES / f"{name}.toml"))]


def test_small_gearboxes_can_be_put_together():
    assert not told(pair_tables()) and not told(pair_tables(teeth=True)) and not told(set_on_shafts())


def test_shafts_beside_each_other_that_penetrate():
    tables = pair_tables()
    # 90 mm from axis to axis, beyond the gears
    tables["shaft"][0]["part"] = [
        {"length": "60 mm", "outer_diameter": "30 mm"},
        {"length": "30 mm", "outer_diameter": "142 mm"},
    ]
    text = told(tables)["shaft[1]"]
    assert "input and output penetrate each other by 1 mm" in text
    # the thick part begins where the other shaft has ended
    tables["shaft"][1]["part"][0]["length"] = "60 mm"
    tables["bearing"][3]["position"] = tables["load"][1]["position"] = "55 mm"
    assert not told(tables)


@pytest.mark.parametrize(("end", "depth"), [("40 mm", ""), ("70 mm", "by 15 mm")])
def test_cones_are_judged_at_their_ends(end, depth):
    tables = pair_tables()
    tables["shaft"][1]["part"] = [
        {"length": "60 mm", "outer_diameter": "40 mm"},
        {"length": "30 mm", "outer_diameter": "40 mm", "end_outer_diameter": end},
    ]
    tables["shaft"].append(
        {"name": "third", "axis": ["130 mm", "0 mm"], "start": "60 mm"}
        | {"part": [{"length": "30 mm", "outer_diameter": "40 mm"}]}
    )
    tables["bearing"] += [
        {"shaft": "third", "position": "1 mm", "radial": "1e8 N/m", "axial": "1e8 N/m", "tilt": "1e6 N m/rad"}
    ]
    tables["operation"]["load_case"][0]["speed"]["third"] = "0 rpm"
    assert depth in told(tables).get("shaft[2]", "") and bool(told(tables)) is bool(depth)


@pytest.mark.parametrize(("bore", "free"), [("62 mm", True), ("20 mm", False), ("0 mm", False)])
def test_shafts_of_one_axis_fit_into_one_another(bore, free):
    tables = set_on_shafts()
    # the shaft of the sun is 24 mm wide within that of the carrier
    tables["shaft"][1]["part"][0] |= {"outer_diameter": "70 mm", "inner_diameter": bore}
    assert (told(tables) == {}) is free


def test_a_shaft_in_the_gear_of_another_one():
    tables = pair_tables()
    # the tip circle of gear 2 has a radius of 57 mm
    tables["shaft"].append(
        {"name": "third", "axis": ["160 mm", "0 mm"], "part": [{"length": "90 mm", "outer_diameter": "30 mm"}]}
    )
    tables["bearing"] += [
        {"shaft": "third", "position": "1 mm", "radial": "1e8 N/m", "axial": "1e8 N/m", "tilt": "1e6 N m/rad"}
    ]
    tables["operation"]["load_case"][0]["speed"]["third"] = "0 rpm"
    (text,) = told(tables).values()
    assert "third reaches into gear 2 of stage by 2 mm" in text


@pytest.mark.parametrize(("width", "words"), [("34 mm", "a bore of 30 mm"), ("70 mm", "a root circle of 64.5 mm")])
def test_a_shaft_wider_than_its_gear(width, words):
    tables = pair_tables(teeth=True)
    assert not told(tables)
    tables["shaft"][0]["part"][0]["outer_diameter"] = width
    assert words in told(tables)["pair[0].shafts"]


def test_the_root_circle_of_given_sizes():
    tables = pair_tables()
    tables["shaft"][0]["part"][0]["outer_diameter"] = "65 mm"
    # 24 teeth of module 3 mm: 72 mm less 2.5 modules
    assert "a root circle of 64.5 mm" in told(tables)["pair[0].shafts"]


@pytest.mark.parametrize(("planets", "teeth", "told"), [(3, (28, 38, 104), 0), (4, (20, 64, 148), 4)])
def test_planets_that_reach_into_one_another_are_told(planets, teeth, told):
    from planet_gearboxes import simple_set

    tables = simple_set(teeth=teeth, planets=planets)
    for stage in tables["pair"]:
        stage["gears"]["face_width"] = "20 mm"
    found = [finding for finding in overlaps(read_case(tables)) if "no mate" in finding.text]
    assert len(found) == told


def test_gears_that_face_each_other_in_part_are_told():
    tables = pair_tables()
    assert not [*common_faces(read_case(tables))]
    tables["pair"][0]["positions"] = ["30 mm", "42 mm"]
    (finding,) = common_faces(read_case(tables))
    assert (finding.code, finding.key, finding.severity) == ("W-WIDTHS", "pair[0].positions", "doubt")
    assert "on 8 mm of 20 mm" in finding.text
    tables = set_on_shafts()
    assert not [*common_faces(read_case(tables))]
    tables["planetary"][0]["carrier_position"] = "34 mm"
    (finding,) = common_faces(read_case(tables))
    assert (finding.key, "on 14 mm of 18 mm" in finding.text) == ("planetary[0].sun_position", True)
