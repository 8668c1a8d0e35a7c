"""Friction that acts on the gears of a case: its coefficient, its sign, and what goes without it."""

import math
from pathlib import Path

import pytest

from femgear.case.dependencies import modal_entries, static_entries
from femgear.case.gear_set import planetary_set
from femgear.case.tooth_friction import acting_friction, friction_coefficient, friction_findings, no_acting_friction
from femgear.errors import CaseError
from femgear.findings import percent
from femgear.gears.friction import path_speeds, schlenk_friction
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
ACTS = {"friction": "constant", "coefficient": 0.05, "excites": True}


@pytest.fixture(scope="module")
def planetary():
    return read_case(CASES / "planetary_27_40_108.toml")


def test_nothing_acts_unless_it_is_asked_for(planetary):
    assert acting_friction(planetary, planetary_set(planetary)) is None
    computed = with_values(planetary, {"losses": ACTS | {"excites": False}})
    assert acting_friction(computed, planetary_set(computed)) is None
    assert static_entries(computed) == static_entries(planetary)


def test_the_sign_is_that_of_the_power_through_the_teeth(planetary):
    for torque, sign in (("100 N m", 1.0), ("-100 N m", -1.0)):
        case = with_values(planetary, {"losses": ACTS, "operation.torque": torque})
        assert acting_friction(case, planetary_set(case)) == (0.05 * sign, 0.05 * sign)
        driven = with_values(case, {"operation.input": "carrier"})
        assert acting_friction(driven, planetary_set(driven)) == (-0.05 * sign, -0.05 * sign)


def test_a_formula_takes_the_first_speed_and_equal_loads():
    case = read_case(CASES / "spur_pair.toml")
    oil = {"viscosity": "20 mm^2/s", "density": "850 kg/m^3"}
    case = with_values(
        case,
        {
            "lubricant": oil,
            "losses": {"friction": "schlenk", "roughness": "0.5 um", "excites": True},
            "operation.speeds": ["1000 rpm", "3000 rpm"],
        },
    )
    gears = planetary_set(case)
    (pair,) = gears.kinds
    at_pitch = path_speeds(pair, 0.0, 1000.0 / 60.0 * 24)
    line_load = case.operation.torque / pair.gear_1.base_radius / pair.face_width
    expected = schlenk_friction(
        line_load, at_pitch.sum_speed, at_pitch.radius, viscosity=20e-6 * 850.0, roughness=0.5e-6
    )
    assert acting_friction(case, gears) == pytest.approx((float(expected),))
    slower = with_values(case, {"operation.speeds": ["500 rpm", "3000 rpm"]})
    assert acting_friction(slower, gears)[0] > expected
    assert static_entries(slower) != static_entries(case)
    assert modal_entries(slower) != modal_entries(case)


def test_helical_teeth_press_harder_than_their_transverse_section():
    case = read_case(CASES / "spur_pair.toml")
    shape = {"set.helix_angle": "20 deg", "set.centre_distance": None, "gear_2.profile_shift": 0.0}
    tips = {"gear_1.tip_diameter": None, "gear_2.tip_diameter": None}
    case = with_values(case, {"losses": ACTS, "static.slices": 25, **shape, **tips})
    base = math.asin(math.sin(math.radians(20.0)) * math.cos(math.radians(20.0)))
    assert acting_friction(case, planetary_set(case)) == pytest.approx((0.05 / math.cos(base),))


def test_a_constant_is_the_coefficient_of_every_mesh(planetary):
    case = with_values(planetary, {"losses": ACTS})
    (pair, _) = planetary_set(case).kinds
    assert friction_coefficient(case, pair, [1.0, 2.0], 100.0, 0.0).tolist() == [0.05, 0.05]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("static.back_flanks", True),
        ("sun.tilt_stiffness", "1e5 N m/rad"),
        ("sun.torque_end", "front"),
    ],
)
def test_contact_that_knows_no_friction_is_refused(planetary, key, value):
    case = with_values(planetary, {"losses": ACTS, key: value})
    with pytest.raises(CaseError) as refused:
        acting_friction(case, planetary_set(case))
    assert (refused.value.code, refused.value.key) == ("E-FRICTION", key)


def test_dynamics_that_know_no_friction_refuse_it(planetary):
    no_acting_friction(planetary, "here is no place for it")
    with pytest.raises(CaseError, match="no place for it") as refused:
        no_acting_friction(with_values(planetary, {"losses": ACTS}), "here is no place for it")
    assert (refused.value.code, refused.value.key) == ("E-FRICTION", "losses.excites")


def test_a_coefficient_that_other_speeds_would_not_have_is_told():
    """Schlenk's mu goes with the sum of speeds to the power of -0.2: (250/3100)^0.2 - 1 = -40 %."""
    case = with_values(
        read_case(CASES / "spur_pair.toml"),
        {
            "lubricant": {"viscosity": "20 mm^2/s", "density": "850 kg/m^3"},
            "losses": {"friction": "schlenk", "roughness": "0.4 um", "excites": True},
            "operation.speeds": ["250 rpm", "1000 rpm", "3100 rpm"],
        },
    )
    (finding,) = friction_findings(case, planetary_set(case))
    assert finding.code == "W-FRICTION" and finding.severity == "doubt"
    assert f"{percent((250 / 3100) ** 0.2 - 1, signed=True)}" in finding.text and "3100 rpm" in finding.text
    for change in ({"operation.speeds": ["250 rpm", "260 rpm"]}, {"losses": ACTS}, {"operation.torque": "0 N m"}):
        other = with_values(case, change)
        assert not list(friction_findings(other, planetary_set(other)))
