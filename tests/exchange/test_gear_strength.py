"""Strength of the gears of a REXS unit: what the file says, what is estimated of it, and that this is told."""

from types import SimpleNamespace

import pytest
from rexs_units import IndustrialUnit
from trains.test_imports import drafts_of

from femgear.case.sections import StrengthSection
from femgear.exchange.gear_strength import (
    TREATMENTS,
    common_strength,
    strength_table,
    treatment_of,
    vickers_hardness,
    written_strength,
    written_treatment,
)
from femgear.exchange.rexs import Component, Model
from femgear.findings import DOUBT, NOTE
from femgear.gears.gear_steels import GEAR_STEELS, stress_limit
from femgear.trains.gearbox.results import gearbox_warnings
from femgear.trains.reading import parse_case


def model():
    return Model("unit.rexs", "2.0", {}, ())


def part(kind="material", /, **attributes: tuple[object, str]):
    return Component("7", kind, "steel", {name: (str(value), unit) for name, (value, unit) in attributes.items()})


def test_hardness_is_that_of_the_tensile_strength():
    """Pairs of ISO 18265:2013, table A.1, between its lines too."""
    assert [vickers_hardness(1e6 * strength) for strength in (640, 865, 1000, 1095, 1125)] == [200, 270, 311, 340, 350]
    assert vickers_hardness(600e6) is None and vickers_hardness(1500e6) is None


def test_every_treatment_of_the_standard_has_a_line():
    assert {*TREATMENTS.values()} <= GEAR_STEELS.keys()


def test_treatment_and_hardness_are_those_of_the_file():
    unit = model()
    hardened: tuple[object, str] = ("case_hardened_wrought_steel", "none")
    names = {"heat_treated_material_type_iso_6336_2006": hardened}
    hard = part(**names, surface_hardness_vickers=(720.0, "HV"))
    assert treatment_of(unit, hard) == {"treatment": "case hardened steel", "hardness": 720.0}
    assert treatment_of(unit, part()) == {} and not unit.findings
    assert treatment_of(unit, part(**names)) == {}
    assert treatment_of(unit, part(**names, surface_hardness_vickers=(300.0, "HV"))) == {}
    assert [finding.severity for finding in unit.findings] == [DOUBT, DOUBT]


@pytest.mark.parametrize("treatment", GEAR_STEELS)
def test_what_is_written_comes_back(treatment):
    line, told = GEAR_STEELS[treatment].contact["MQ"], list[str]()
    hardness = 0.5 * (line.low + line.high)
    material = SimpleNamespace(treatment=treatment, hardness=hardness, grade="ME")
    attributes = written_treatment(material, told.append)
    read = treatment_of(model(), part(**attributes))
    assert len(told) == 1
    if treatment in TREATMENTS.values():
        assert read == {"treatment": treatment, "hardness": hardness} and "ME comes back as MQ" in told[0]
    else:
        assert read == {} and treatment in told[0]
    assert written_treatment(SimpleNamespace(treatment=None), told.append) == {}
    written = written_strength(StrengthSection(application_factor=1.25, quality=6))
    assert strength_table(model(), [part("cylindrical_stage", **written)], [part("cylindrical_gear", **written)]) == {
        "application_factor": 1.25,
        "quality": 6,
    }
    assert written_strength(StrengthSection()) == {}


def test_factors_are_the_least_favourable_ones_and_what_is_missing_is_told():
    unit = model()
    stages = [part("cylindrical_stage", application_factor_iso_6336_2019=(1.25, "none"))]
    gears = [part("cylindrical_gear", global_tolerance_class_iso_1328_2013=(text, "none")) for text in ("6", "7")]
    assert strength_table(unit, stages, gears) == {"application_factor": 1.25, "quality": 7}
    assert "6, 7" in unit.findings[0].text
    assert strength_table(unit, [], []) == {}
    note = unit.findings[-1]
    assert note.severity == NOTE and "strength.quality" in note.remedy
    tables = [{"application_factor": 1.25}, {"application_factor": 1.5, "quality": 6}]
    assert common_strength(unit, tables) == {"application_factor": 1.5, "quality": 6}
    assert any("larger one" in finding.text for finding in unit.findings)


def test_a_unit_without_limits_is_estimated_and_says_so(tmp_path):
    unit = IndustrialUnit()
    unit.add(57, "material", tensile_strength=(1100.0, "N / mm^2"), elastic_modulus=(210000.0, "N / mm^2"))
    for shaft in (12, 13, 14):
        unit.relate("reference", origin=shaft, referenced=57)
    drafts, findings = drafts_of(unit, tmp_path)
    case = parse_case(drafts[""].text)
    texts = [finding.text for finding in findings if finding.key == "19: gear_1.material.treatment"]
    assert len(texts) == 1 and "342 HV" in texts[0] and "1100 N/mm^2" in texts[0]
    assert "# assumed: by the tensile strength" in drafts[""].text
    material = case.pair[0].teeth["material"]
    assert material["treatment"] == "through hardened alloy steel" and material["estimated"]
    assert stress_limit(material["treatment"], "MQ", material["hardness"], "contact") == pytest.approx(822e6, rel=1e-3)
    keys = [finding.key for finding in gearbox_warnings(case) if finding.code == "W-MATERIAL"]
    # pairs alike are told once
    assert keys == ["pair[0].teeth.material.treatment"]
