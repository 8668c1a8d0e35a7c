"""Limits of ISO 6336-5 and life factors, against published calculations."""

import math

import pytest

from femgear.errors import GeometryError
from femgear.gears.gear_steels import GEAR_STEELS, LIMITED_PITTING, stress_limit


def test_case_hardened_and_quenched_steel_of_the_published_stage():
    """KISSsoft, NREL stage 1: 18CrNiMo7-6 MQ 1500; ring of 240 HBW, some 252 HV, 700 and 290 N/mm^2 off the chart."""
    assert stress_limit("case hardened steel", "MQ", 720, "contact") == 1500e6
    assert stress_limit("case hardened steel", "MQ", 720, "root") == pytest.approx(430e6, rel=0.015)
    assert stress_limit("through hardened alloy steel", "MQ", 252, "contact") == pytest.approx(700e6, rel=0.01)
    assert stress_limit("through hardened alloy steel", "MQ", 252, "root") == pytest.approx(290e6, rel=0.02)


@pytest.mark.parametrize("treatment", GEAR_STEELS)
def test_better_grades_carry_more(treatment):
    """Where all three grades have a limit; lines grow with the hardness."""
    steel = GEAR_STEELS[treatment]
    for kind in ("contact", "root"):
        lines = [getattr(steel, kind)[grade] for grade in ("ML", "MQ", "ME")]
        low, high = max(line.low for line in lines), min(line.high for line in lines)
        for hardness in (low, high):
            limits = [stress_limit(treatment, grade, hardness, kind) for grade in ("ML", "MQ", "ME")]
            assert limits == sorted(limits)
        assert stress_limit(treatment, "MQ", high, kind) >= stress_limit(treatment, "MQ", low, kind)


def test_constant_parts_beyond_a_line():
    assert stress_limit("flame hardened steel", "MQ", 600, "root") == 369e6
    line_end = stress_limit("flame hardened steel", "MQ", 570, "root")
    assert line_end == pytest.approx(369e6, rel=2e-3)
    beyond = stress_limit("nitrocarburised steel", "ME", 600, "contact")
    assert beyond == stress_limit("nitrocarburised steel", "ME", 450, "contact") == pytest.approx(950e6, rel=1e-3)


def test_hardness_outside_the_standard_is_refused():
    with pytest.raises(GeometryError) as caught:
        stress_limit("case hardened steel", "MQ", 62, "contact")
    assert caught.value.code == "E-ISO6336" and "660 .. 800 HV" in caught.value.limit


def test_life_factors_of_published_calculations():
    """KISSsoft, NREL stage 1, and ISO/TR 6336-30: Z_NT and Y_NT at their load cycles."""
    steel = GEAR_STEELS["case hardened steel"]
    for cycles, factor in ((1124.7e6, 0.909), (419.0e6, 0.937), (1.080e9, 0.910), (1.783e8, 0.962)):
        assert steel.contact_life.at(cycles) == pytest.approx(factor, abs=6e-4)
    for cycles, factor in ((1124.7e6, 0.888), (419.0e6, 0.906)):
        assert steel.root_life.at(cycles) == pytest.approx(factor, abs=6e-4)
    assert steel.contact_life.at(10.0) == 1.6 and steel.contact_life.at(1e12) == 0.85
    assert LIMITED_PITTING.at(1e8) == pytest.approx(math.sqrt(1.3))


def test_slopes_of_damage():
    """p = 13.22 of flanks, 6.61 in terms of the torque; 6.22 and 8.74 of roots."""
    hard, soft = GEAR_STEELS["case hardened steel"], GEAR_STEELS["through hardened alloy steel"]
    assert hard.contact_life.slope == pytest.approx(13.22, abs=0.005)
    assert soft.root_life.slope == pytest.approx(6.225, abs=0.005)
    assert hard.root_life.slope == pytest.approx(8.738, abs=0.005)
