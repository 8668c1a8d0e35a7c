"""Oil and temperatures of REXS units: viscosity ratios and cleanliness of bearings, growth of shafts and casing."""

import math

import pytest
from rexs_stage import MM, NONE
from rexs_units import IndustrialUnit, ThreeStageUnit
from trains.test_imports import drafts_of

from femgear.case.lubrication import oil_at
from femgear.exchange.rexs import read_model
from femgear.exchange.unit_lubrication import temperature_rise, thermal_expansion, unit_lubrication
from femgear.system.bearing_life import oil_viscosity, reference_viscosity
from femgear.trains.reading import parse_case

BALLS = {
    "bearing_type": ("radial_grooved_ball_bearing", NONE),
    "number_of_rolling_elements": (10, NONE),
    "diameter_of_rolling_element": (12.7, MM),
    "pitch_diameter": (70.0, MM),
}


def oiled(temperature: float = 70.0, unit: str = "C") -> IndustrialUnit:
    """The industrial unit with an oil of ISO VG 100, and balls in its bearing 33."""
    box = IndustrialUnit()
    box.add(
        56,
        "lubricant",
        viscosity_at_40_degree_celsius=(100.0, "mm^2 / s"),
        viscosity_at_100_degree_celsius=(11.0, "mm^2 / s"),
    )
    for given in box.load_cases:
        given[2] = {"temperature_lubricant": (temperature, unit)}
    box.components[33]["attributes"] |= BALLS
    box.components[33]["attributes"]["contamination_factor_according_to_iso_281_2007"] = (0.5, NONE)
    return box


def bearings(box, tmp_path):
    found, findings = drafts_of(box, tmp_path)
    return {one.name: one for one in parse_case(found[""].text).bearing}, findings, found[""].text


def test_the_ratio_is_the_least_of_all_load_cases(tmp_path):
    known, _, text = bearings(oiled(), tmp_path)
    # 543, 3456, 1234 and 789 rpm: the slowest one needs the thickest oil
    needed = 45000.0 * 543.0**-0.83 / math.sqrt(70.0)
    ratio = 1e6 * oil_viscosity(100e-6, 11e-6, 70.0) / needed
    assert known["bearing 33"].viscosity_ratio == pytest.approx(ratio, rel=1e-3)
    assert known["bearing 33"].contamination == 0.5
    assert "least of all load cases" in text
    assert known["bearing 34"].viscosity_ratio is None


def test_the_oil_is_that_of_the_gearbox(tmp_path):
    case = parse_case(bearings(oiled(), tmp_path)[2])
    assert case.lubricant is not None and case.lubricant.temperature == pytest.approx(343.15)
    assert oil_at(case) == pytest.approx(870.0 * oil_viscosity(100e-6, 11e-6, 70.0))
    assert parse_case(bearings(IndustrialUnit(), tmp_path)[2]).lubricant is None


def test_temperatures_in_kelvin_are_the_same(tmp_path):
    celsius, kelvin = (bearings(box, tmp_path)[0] for box in (oiled(), oiled(343.15, "K")))
    assert kelvin["bearing 33"].viscosity_ratio == celsius["bearing 33"].viscosity_ratio


def test_rings_that_turn_together_need_no_oil(tmp_path):
    lubrication = unit_lubrication(read_model(oiled().write(tmp_path / "unit.rexs")))
    assert lubrication.least_ratio(0.07, ["12", "12"]) is None
    # a bearing between two shafts has their difference
    speeds = [abs(speed["12"] - speed["14"]) for speed in lubrication.speeds]
    ratio = oil_viscosity(100e-6, 11e-6, 70.0) / reference_viscosity(0.07, min(speeds))
    assert lubrication.least_ratio(0.07, ["12", "14"]) == pytest.approx(ratio)


def test_a_ratio_that_iso_281_does_not_have_is_told(tmp_path):
    known, findings, _ = bearings(oiled(temperature=250.0), tmp_path)
    assert known["bearing 33"].viscosity_ratio is None
    assert any("below what ISO 281 has" in one.text for one in findings)


def test_oil_that_cannot_be_read_leaves_the_bearing(tmp_path):
    box = oiled()
    box.components[33]["attributes"]["contamination_factor_according_to_iso_281_2007"] = ("clean", NONE)
    known, findings, _ = bearings(box, tmp_path)
    assert known["bearing 33"].kind == "ball" and known["bearing 33"].contamination is None
    assert any("its lubrication is not taken" in one.text for one in findings)


def test_bearings_of_files_of_1_0_have_their_contamination(tmp_path):
    box = ThreeStageUnit()
    box.components[20]["attributes"]["contamination_factor_according_to_din_26281"] = (0.5, NONE)
    known, _, _ = bearings(box, tmp_path)
    assert known["bearing 20"].contamination == 0.5 and known["bearing 20"].viscosity_ratio is None


def test_shafts_and_casing_are_as_much_warmer_as_the_file_says(tmp_path):
    box = IndustrialUnit()
    box.components[1]["attributes"]["reference_temperature"] = (20.0, "C")
    box.components[13]["attributes"]["mean_operating_temperature"] = (75.0, "C")
    box.components[14]["attributes"]["mean_operating_temperature"] = (20.0, "C")
    box.components[2]["attributes"]["mean_operating_temperature"] = (333.15, "K")
    box.add(57, "material", thermal_expansion_coefficient_plus=(11.0, "1e-6 / C"))
    box.relate("reference", origin=13, referenced=57)
    model = read_model(box.write(tmp_path / "unit.rexs"))
    shaft = model.components["13"]
    assert temperature_rise(model, shaft) == pytest.approx(55.0)
    assert temperature_rise(model, model.components["12"]) is None
    assert thermal_expansion(model, shaft) == pytest.approx(11e-6)
    case = parse_case(drafts_of(box, tmp_path)[0][""].text)
    assert [one.temperature_rise for one in case.shaft] == [0.0, 55.0, 0.0]
    assert case.thermal.casing_rise == pytest.approx(40.0)
    assert case.growth_of("shaft 13") == pytest.approx(55.0 * 11e-6 - 40.0 * 1.1e-5)
