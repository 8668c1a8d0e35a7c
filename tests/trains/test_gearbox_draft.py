"""A new gearbox: it runs, its sizes are what their remarks say, and numbers that are given stay."""

import math

import pytest

from femgear.case.text import parse
from femgear.trains.drafts import ToothForm, new_case
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.stages import solve_box_modes, solve_deflections
from femgear.trains.gearbox_draft import SHAFT_STRESS
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import check_case, train_of


def test_a_new_gearbox_is_computed():
    case = read_case(new_case("gearbox"))
    check_case(case)
    assert not [finding for finding in train_of(case).case_warnings(case) if finding.code]
    # meshes as springs: that contact settles is shown below
    case = with_values(case, {"deflection.contact": False})
    deflection = solve_deflections(case)
    assert deflection.converged
    assert len(deflection.estimates) == 2
    modes = solve_box_modes(case, deflection).modes
    assert modes.kind[0] == "rigid"
    assert (modes.frequency[1:] > 0.0).all()


@pytest.mark.slow
def test_teeth_bend_their_shafts_and_settle():
    case = read_case(new_case("gearbox", form=ToothForm(helix="15 deg")))
    found = solve_deflection(case)
    assert found.settled
    # gears stand nearer to the left bearings
    assert abs(found.mesh_slope[0]) * 0.024 > 1e-7
    # bearings A and B, C and D hold the same force
    radial = found.bearing_force[:, :2].reshape(2, 2, 2).sum(axis=1)
    assert radial[0] == pytest.approx(-radial[1], rel=1e-6)
    thrust = found.bearing_force[[0, 2], 2]
    assert thrust[0] == pytest.approx(-thrust[1], rel=1e-6)
    assert abs(thrust[0]) > 0.2 * abs(radial).max()


@pytest.mark.parametrize("numbers", [{}, {"teeth": (20, 61), "torque": "90 N m", "module": "3 mm"}])
def test_shafts_have_their_stress_unless_the_rim_ends_before(numbers):
    tables = parse(new_case("gearbox", **numbers), "")
    case = read_case(new_case("gearbox", **numbers))
    torque = case.operation.load_case[0].torque["motor"]
    for shaft, gear, factor in zip(case.shaft, ("gear_1", "gear_2"), (1.0, case_ratio(tables)), strict=True):
        (part,) = shaft.part
        stress = 16.0 * factor * torque / (math.pi * part.outer_diameter**3)
        assert stress == pytest.approx(SHAFT_STRESS, rel=0.02)
        bore = tables["pair"][0]["teeth"][gear]["bore_radius"]
        assert 2.0 * float(bore.removesuffix(" mm")) == pytest.approx(1e3 * part.outer_diameter)


def case_ratio(tables) -> float:
    teeth = tables["pair"][0]["teeth"]
    return teeth["gear_2"]["teeth"] / teeth["gear_1"]["teeth"]


def test_a_pinion_with_few_teeth_keeps_its_rim():
    text = new_case("gearbox", teeth=(9, 74), torque="400 N m")
    assert "estimated: the bore of a usual rim" in text
    check_case(read_case(text))


def test_numbers_that_are_given_stay():
    text = new_case("gearbox", teeth=(21, 50), module="3 mm", torque="77 N m", speed="1450 rpm", face_width="30 mm")
    case = read_case(text)
    assert "Assumed" not in text
    load_case = case.operation.load_case[0]
    assert load_case.torque == {"motor": 77.0}
    assert load_case.speed["input"] == pytest.approx(1450.0 * math.pi / 30.0)
    assert [shaft.length for shaft in case.shaft] == pytest.approx([0.12, 0.12])
