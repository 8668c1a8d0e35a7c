"""Tables and attributes of what a drawing carries."""

import math

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.errors import GeometryError
from femgear.gears.drawing import normal_thickness, over_balls, span
from femgear.gears.tolerances import tolerances_of_gear
from femgear.stages.drawing_tables import describe_drawing, drawing_attributes, drawn_gears, mesh_plays
from femgear.trains.reading import read_case, with_values

ALLOWANCES = {"sun": "cd 25", "planet": ["-70 um", "-110 um"], "ring": "bc 26"}


@pytest.fixture(scope="module")
def case():
    """Reference set with allowances of all gears."""
    read = read_case("cases/planetary_27_40_108.toml")
    return with_values(read, {f"{gear}.tooth_thickness_allowance": value for gear, value in ALLOWANCES.items()})


def test_computed_teeth_lie_in_the_middle_between_the_thinnest_and_the_thickest(case):
    for drawn, allowances in zip(drawn_gears(case), ((-54, -84), (-70, -110), (-140, -220)), strict=True):
        assert drawn.allowances == pytest.approx(1e-6 * np.array(allowances), rel=1e-12)
        computed, thinnest, thickest = drawn.thickness
        assert computed == pytest.approx(0.5 * (thinnest + thickest), rel=1e-12)
        assert thickest - thinnest == pytest.approx(1e-6 * (allowances[0] - allowances[1]), rel=1e-9)


def test_least_and_largest_play_are_those_of_the_allowances(case):
    for (mean, least, largest), sums in zip(mesh_plays(case), ((124, 194), (210, 330)), strict=True):
        cosine = math.cos(case.pressure_angle)
        assert (least.normal, largest.normal) == pytest.approx([1e-6 * cosine * value for value in sums], abs=1e-8)
        assert mean.normal == pytest.approx(0.5 * (least.normal + largest.normal), rel=1e-9)


def test_table_and_attributes_hold_the_figures_of_the_gears(case):
    attributes, (table, play) = drawing_attributes(case), describe_drawing(case)
    cells = {name: texts for name, *texts in table.rows}
    sun = planetary_set(case).sun
    teeth, ball = int(attributes["span_teeth"][0]), float(attributes["ball_diameter"][0])
    assert attributes["span"][0] == pytest.approx(span(sun, teeth), rel=1e-12)
    assert attributes["over_balls"][0] == pytest.approx(over_balls(sun, ball), rel=1e-12)
    assert attributes["tooth_thickness"][0] == pytest.approx(normal_thickness(sun), rel=1e-12)
    assert attributes["span_teeth"][2] == 0 and math.isnan(attributes["span"][2])
    assert cells["span W_k [mm]"][0].startswith(f"{1e3 * span(sun, teeth):.4f} (")
    assert cells["span W_k [mm]"][2] == "-"
    assert cells["allowances A_sne, A_sni [um]"] == ["-54, -84", "-70, -110", "-140, -220"]
    assert [row[0].split()[1] for row in play.rows] == ["j_bn", "j_wt,", "j_r"]


def test_teeth_and_balls_of_the_case_are_those_of_the_table():
    case = read_case("cases/helical_30_20_70.toml")
    drawn = drawn_gears(with_values(case, {"sun.span_teeth": 4, "planet.ball_diameter": "3 mm"}))
    assert (drawn[0].span_teeth, drawn[1].ball) == (4, pytest.approx(3e-3))
    with pytest.raises(GeometryError, match="E-RANGE") as refusal:
        drawn_gears(with_values(case, {"planet.ball_diameter": "1 mm"}))
    assert (refusal.value.key, refusal.value.value) == ("planet.ball_diameter", "1 mm")


def test_a_class_of_the_section_strength_adds_its_flank_tolerances(case):
    *_, table = describe_drawing(with_values(case, {"strength.quality": 6}))
    cells = {name: texts for name, *texts in table.rows}
    assert table.title == "Flank tolerances, ISO 1328-1, class 6"
    assert cells["f_pT [um]"][0] == f"{1e6 * tolerances_of_gear(planetary_set(case).sun, 6).pitch:.6g}"
    narrow = with_values(case, {"strength.quality": 6, "set.face_width": "3 mm"})
    *_, table = describe_drawing(narrow)
    assert {texts for _, *row in table.rows for texts in row} == {"-"} and len(table.notes) == 3
