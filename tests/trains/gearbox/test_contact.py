"""Contact of the teeth of a stage: slopes become axes askew, shares over the width, forces along the normal."""

import math

import numpy as np
import pytest
from small_gearbox import pair_tables, set_on_shafts

from femgear.case.gear_set import planetary_set
from femgear.errors import FemgearError
from femgear.gears.deviations import body_separation, misaligned_approach, no_deviations
from femgear.trains.gearbox.case_file import teeth_of
from femgear.trains.gearbox.contact import (
    StageContact,
    askew,
    displaced,
    given_separation,
    loaded_tables,
    locate_contact_error,
    stage_contact,
    unequal_separation,
)
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.mark.parametrize("back", [False, True])
def test_any_slopes_of_a_set_are_those_of_askew_planets(back):
    gears = planetary_set(teeth_of(read_case("cases/e_axle.toml").planetary[0]))
    slopes = np.array([3.0, -1.0, 2.0, 0.5, 4.0, -2.0]) * 1e-5
    found = askew(no_deviations(gears), gears, slopes, back=back)
    assert misaligned_approach(found, gears, back=back) == pytest.approx(slopes, abs=1e-15)


@pytest.mark.parametrize("back", [False, True])
def test_any_separations_of_a_set_are_those_of_displaced_planets(back):
    gears = planetary_set(teeth_of(read_case("cases/e_axle.toml").planetary[0]))
    apart = np.array([3.0, -1.0, 2.0, 0.5, 4.0, -2.0]) * 1e-6
    level = body_separation(no_deviations(gears), gears, 0.3, back=back)[:, 0]
    found = displaced(no_deviations(gears), gears, apart, back=back)
    assert body_separation(found, gears, 0.3, back=back)[:, 0] - level == pytest.approx(apart, abs=1e-15)


def test_rotations_take_up_all_but_what_loads_planets_unequally():
    def left(separation):
        return unequal_separation(np.asarray(separation, float))

    # of the sun alone, of the ring alone, of planet 2 alone
    for turned in ([1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1], [0, 1, 0, 0, -1, 0]):
        assert left(turned) == pytest.approx(np.zeros(6), abs=1e-15)
    # rounding leaves equal planets equal
    assert not left([1e-6, 1e-6 + 1e-16, 1e-6, 0, 0, 1e-17]).any()
    assert left([2, 0, 0, 1, 0, 0]) == pytest.approx([1.0, -0.5, -0.5] * 2)
    assert left([5.0]) == pytest.approx([0.0])


@pytest.mark.slow
def test_a_set_is_loaded_by_its_separations_as_by_its_pins():
    stage = read_case(set_on_shafts()).planetary[0]
    pins = [{"planet": 2, "tangential": "-10 um", "radial": "4 um"}]
    off = stage.model_copy(update={"teeth": stage.teeth | {"set": stage.teeth["set"] | {"pin_errors": pins}}})
    still = np.zeros(6)
    for torque in (100.0, -100.0):
        by_errors = stage_contact(off, torque, still, slices=9, positions=8)
        by_system = stage_contact(stage, torque, still, separation=given_separation(off, torque), slices=9, positions=8)
        assert by_system.normal_force == pytest.approx(by_errors.normal_force, rel=1e-6)
        assert np.ptp(by_errors.normal_force) > 100.0


def test_what_holds_the_gears_is_not_held_twice():
    tables = set_on_shafts()
    teeth = tables["planetary"][0]["teeth"]
    teeth["static"]["members"] = "elastic"
    teeth["sun"]["tilt_stiffness"] = "1e4 N m/rad"
    found = loaded_tables(read_case(tables).planetary[0], 10.0, 9)
    assert "members" not in found["static"] and "tilt_stiffness" not in found["sun"]


def test_the_loads_of_the_gearbox_stand_in_the_tables():
    stage = read_case(pair_tables(teeth=True)).pair[0]
    tables = loaded_tables(stage, -37.5, 9)
    assert tables["operation"]["torque"] == "-37.5 N m"
    assert tables["static"]["slices"] == 9
    assert stage.teeth["operation"]["torque"] == "100 N m"


@pytest.mark.decisive
def test_forces_follow_from_the_torque():
    stage = read_case(pair_tables(teeth=True)).pair[0]
    found = stage_contact(stage, 100.0, np.zeros(1), slices=5)
    assert found.normal_force == pytest.approx([100.0 / (0.036 * math.cos(math.radians(20.0)))], rel=1e-9)
    assert found.shares.sum(axis=1) == pytest.approx([1.0])
    # aligned gears of one width carry alike on both ends
    assert found.shares[0] == pytest.approx(found.shares[0, ::-1], rel=1e-6)


def test_shares_keep_their_sum_in_other_slices():
    shares = np.array([[0.4, 0.3, 0.2, 0.1]])
    contact = StageContact(None, np.ones(1), np.ones(1), shares, np.zeros(1), None, None)  # type: ignore[arg-type]
    assert contact.shares_at(0, 4) == pytest.approx(shares[0])
    assert contact.shares_at(0, 2) == pytest.approx([0.7, 0.3])
    assert contact.shares_at(0, 8).sum() == pytest.approx(1.0)


def test_refusals_name_the_stage_its_load_and_entries_of_the_gearbox():
    tables = pair_tables(teeth=True)
    for torque, code, key in (("1e4 N m", "E-SLICES", "deflection.slices"), ("1e8 N m", "E-CONTACT", "pair[0].teeth")):
        tables["operation"]["load_case"][0]["torque"]["motor"] = torque
        with pytest.raises(FemgearError) as error:
            solve_deflection(read_case(tables))
        assert (error.value.code, error.value.key) == (code, key)
        assert error.value.message.startswith("stage stage with ") and "N m per mm" in error.value.message
        assert "less torque in the load case" in error.value.remedy


def test_slices_of_the_teeth_themselves_are_named_where_they_stand():
    tables = pair_tables(teeth=True)
    tables["pair"][0]["teeth"]["static"]["slices"] = 40
    case, error = read_case(tables), FemgearError("too many", code="E-SLICES", key="static.slices", remedy="fewer")
    locate_contact_error(error, case, case.pair[0], 10.0, 0.02)
    assert error.key == "pair[0].teeth.static.slices" and "0.5 N m per mm" in error.message
