"""Loaded states: closed forms, equilibrium, rolling bearings, the passes of contact and system."""

import copy
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gearbox_equivalents import elastic_set_tables
from scipy.optimize import brentq
from small_gearbox import loose_pair_tables, pair_tables, set_on_shafts, split_pair_tables

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError, FemgearError
from femgear.fe.beam import RoundSection
from femgear.gears.deviations import misaligned_approach, no_deviations
from femgear.stages.static import solve_static
from femgear.system.rolling_bearings import bearing_state
from femgear.trains.drafts import new_case
from femgear.trains.gearbox import deflection
from femgear.trains.gearbox.case_file import teeth_of
from femgear.trains.gearbox.deflection import mesh_separation, mesh_slopes, rolling_bearing, solve_deflection
from femgear.trains.gearbox.model import gearbox_model
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

BALL = {
    "kind": "ball",
    "rolling_elements": 9,
    "element_diameter": "9.5 mm",
    "pitch_diameter": "46 mm",
    "dynamic_rating": "19.5 kN",
}


def test_bearing_forces_are_those_of_the_lever_rule():
    tables = pair_tables()
    # the load stays in the middle of the width
    tables["deflection"] = {"slices": 1}
    found = solve_deflection(read_case(tables))
    force = 100.0 / (0.036 * math.cos(math.radians(20.0)))
    assert found.mesh_force == pytest.approx([force], rel=1e-9)
    size = np.hypot(*found.bearing_force[:, :2].T)
    # bearings at 5 and 85 mm, gears at 30 mm
    assert size == pytest.approx(force * np.array([55.0, 25.0, 55.0, 25.0]) / 80.0, rel=1e-9)
    assert found.residual < 1e-10


def test_the_slope_of_a_gear_off_mid_is_that_of_its_shaft():
    tables = pair_tables()
    for bearing in tables["bearing"]:
        bearing["radial"] = "rigid"
    tables["shaft"][1]["part"][0]["outer_diameter"] = "400 mm"  # hardly bends
    tables["shaft"][0]["material"] = {"poisson_ratio": 0.0, "density": "0 kg/m^3"}
    # one slice: a mesh without stiffness against tilt
    tables["deflection"] = {"slices": 1}
    found = solve_deflection(read_case(tables))
    E, I, a, b, length = 2.06e11, RoundSection(0.03).second_moment, 0.025, 0.055, 0.08
    force = found.mesh_force[0]
    station = found.model.seat("input", 0.03).station
    tilt = found.motion[6 * station + 3 : 6 * station + 5]
    # F a b (b - a) / (3 E I L), shear adds no slope of the section at the load of both sides' mean
    bent = force * a * b * (b - a) / (3.0 * E * I * length)
    assert np.hypot(*tilt) == pytest.approx(bent, rel=0.05)


def test_rigid_bearings_carry_what_stiff_ones_do():
    def forces(radial, axial):
        tables = pair_tables(helix="15 deg")
        for bearing in tables["bearing"]:
            bearing["radial"] = radial
            bearing |= {"axial": axial} if "axial" in bearing else {}
        return solve_deflection(read_case(tables)).bearing_force

    stiff, rigid = forces("1e14 N/m", "1e14 N/m"), forces("rigid", "rigid")
    assert rigid[:, :3] == pytest.approx(stiff[:, :3], rel=1e-4, abs=0.05)


def test_rolling_bearings_balance_at_their_own_motion():
    tables = pair_tables(helix="15 deg")
    for bearing in tables["bearing"]:
        for entry in ("radial", "axial"):
            bearing.pop(entry, None)
        bearing |= BALL | {"clearance": "10 um"}
    case = read_case(tables)
    found = solve_deflection(case)
    assert found.residual < 1e-8
    total = found.bearing_force[:2].sum(axis=0)
    assert np.hypot(*total[:2]) == pytest.approx(100.0 / 0.036 / math.cos(math.radians(20.0)), rel=1e-6)
    for section, state, force in zip(case.bearing, found.states, found.bearing_force, strict=True):
        again = bearing_state(rolling_bearing(section), state.motion)
        assert -again.force[:3] == pytest.approx(force[:3], rel=1e-9, abs=1e-9)
    # both balls of a shaft share the thrust
    assert abs(total[2]) == pytest.approx(100.0 / 0.036 * math.tan(math.radians(15.0)), rel=1e-6)


def test_a_shaft_lies_in_the_play_of_springs():
    """A rigid body under its weight alone: ``F = (2 k / pi) [r (p + sin p cos p) - 2 c sin p]``, ``cos p = c / r``."""
    tables = loose_pair_tables("20 um")
    tables["operation"]["load_case"][0]["torque"]["motor"] = "1e-9 N m"
    found = solve_deflection(read_case(tables))
    force, clearance = 50.0 * 9.80665, 10e-6
    assert found.bearing_force[1] == pytest.approx([0.0, force, 0.0, 0.0, 0.0, 0.0], abs=1e-6)

    def missing(r):
        p = math.acos(clearance / r)
        return 4e8 / math.pi * (r * (p + math.sin(p) * math.cos(p)) - 2.0 * clearance * math.sin(p)) - force

    sunk = brentq(missing, clearance, 10 * clearance, xtol=1e-18)
    assert found.motion[7] == pytest.approx(-sunk, rel=1e-9)
    # the tangent across the load is that of the force over the way
    across = found.bearing_stiffness[1, 0, 0]
    assert across == pytest.approx(force / sunk, rel=1e-6) and found.bearing_stiffness[1, 1, 1] > across
    # in no play it is the spring
    tight = solve_deflection(read_case(loose_pair_tables("0 um")))
    free = tight.bearing_force[1, :2] + 2e8 * tight.motion[6:8]
    assert free == pytest.approx([0.0, 0.0], abs=1e-6)


def test_weight_hangs_in_the_bearings():
    tables = pair_tables()
    tables["gravity"] = {}
    tables["operation"]["load_case"][0]["torque"]["motor"] = "1e-9 N m"
    found = solve_deflection(read_case(tables))
    mass = [7850.0 * math.pi / 4.0 * d**2 * 0.09 for d in (0.03, 0.04)]
    up = found.bearing_force[:, 1].reshape(2, 2).sum(axis=1)
    assert up == pytest.approx(9.80665 * np.array(mass), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("torque", ["100 N m", pytest.param("-100 N m", marks=pytest.mark.slow)])
def test_contact_and_system_settle_whatever_they_start_from(torque):
    tables = pair_tables(teeth=True)
    tables["operation"]["load_case"][0]["torque"]["motor"] = torque
    case = read_case(tables)
    found = solve_deflection(case)
    assert found.settled
    assert len(found.slopes) - 1 <= 5
    far = solve_deflection(case, slopes=[3e-4])
    assert far.settled
    width = 0.02
    assert far.mesh_slope == pytest.approx(found.mesh_slope, abs=2e-4 * np.abs(found.mesh_slope).max())
    contact = found.contacts["stage"]
    # the contact sees the slope that the system has
    rise = contact.result.cycle.mesh_misalignment.mean()
    assert rise == pytest.approx(found.mesh_slope[0] * width, rel=1e-3)
    # more load where the flanks are closer
    tilt = np.polyfit(np.arange(len(contact.shares[0])), contact.shares[0], 1)[0]
    assert np.sign(tilt) == np.sign(found.mesh_slope[0])
    assert contact.face_load_factor[0] > 1.0


def test_the_slope_of_a_mesh_is_the_line_through_its_slices():
    found = solve_deflection(read_case(pair_tables()))
    assembly = found.model.assembly
    approach = assembly.columns.T @ found.motion
    line = np.polyfit(assembly.contacts[0].heights, approach, 1)[0]
    assert mesh_slopes(assembly, found.motion) == pytest.approx([line], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("torque", [100.0, -100.0])
def test_unequal_planets_carry_what_the_set_alone_on_its_bearings_says(torque):
    """Errors of pins in the plane, against the contact with sun and planets on springs, a solver of its own."""
    tables = elastic_set_tables("cases/planetary_27_40_108.toml")
    teeth = tables["planetary"][0]["teeth"]
    teeth["operation"]["torque"] = f"{torque} N m"
    teeth["set"]["pin_errors"] = [
        {"planet": 2, "tangential": "-12 um", "radial": "8 um"},
        {"planet": 3, "radial": "-10 um"},
    ]
    teeth["static"] = {"positions": 12, "members": "elastic"}
    # the ring stands still, as in a casing
    teeth["ring"] |= dict.fromkeys(("foundation_radial", "foundation_tangential"), "1e14 N/m^3")
    alone = np.abs(solve_static(read_case(copy.deepcopy(teeth))).cycle.force).mean(axis=1)
    tables["planetary"][0]["elastic_ring"] = False
    tables["operation"]["load_case"][0]["torque"] = {"motor": f"{torque} N m"}
    found = solve_deflection(read_case(tables | {"deflection": {}}))
    assert np.ptp(alone) > 0.15 * alone.mean()
    assert found.mesh_force == pytest.approx(alone, abs=2e-3 * np.ptp(alone))


@pytest.mark.slow
def test_contact_and_system_agree_on_unequal_forces_of_planets():
    tables = set_on_shafts()
    push = {"name": "push", "shaft": "input", "position": "20 mm", "force": ["500 N", "800 N", "0 N"]}
    tables["load"].append(push)
    tables["planetary"][0]["teeth"]["set"]["pin_errors"] = [{"planet": 2, "tangential": "-20 um"}]
    found = solve_deflection(read_case(tables))
    force = found.contacts["set"].normal_force
    assert found.settled
    assert found.mesh_force == pytest.approx(force, abs=1e-4 * force.max())
    assert np.ptp(force) > 0.3 * force.mean()
    # what the contact was solved with is what the system has
    apart = mesh_separation(found.model.assembly, found.motion)
    assert np.ptp(apart[:3] + apart[3:]) > 1e-6


@pytest.mark.slow
def test_planets_without_load_settle():
    tables = elastic_set_tables("cases/planetary_27_40_108.toml") | {"deflection": {}}
    tables["planetary"][0] |= {"elastic_ring": False}
    teeth = tables["planetary"][0]["teeth"]
    teeth["set"]["pin_errors"] = [{"planet": 2, "tangential": "-60 um"}]
    teeth["static"] = {"positions": 12}
    tables["operation"]["load_case"][0]["torque"] = {"motor": "10 N m"}
    found = solve_deflection(read_case(tables))
    assert found.settled
    assert found.mesh_force[[0, 2]] == pytest.approx([0.0, 0.0], abs=1e-6)
    radius = found.model.stages[0].sizes.base_radii[0]
    assert found.mesh_force[1] == pytest.approx(10.0 / radius, rel=1e-9)


@pytest.mark.parametrize("torque", ["100 N m", "-100 N m"])
def test_tilts_of_sun_and_planets_give_meshes_the_slopes_that_the_contact_gives_them(torque):
    tables = set_on_shafts()
    tables["operation"]["load_case"][0]["torque"]["motor"] = torque
    case = read_case(tables)
    model, (stage,) = gearbox_model(case), case.planetary
    gears, (staged,) = planetary_set(teeth_of(stage)), model.stages
    cosine, back = math.cos(staged.sizes.base_helix), torque.startswith("-")
    ideal = no_deviations(gears)
    for lean in ((1e-4, 0.0), (0.0, 1e-4), (3e-5, -7e-5)):
        # the end z > 0 moves by the slope along x and y: tilts about y and -x
        motion = np.zeros(model.assembly.count).reshape(-1, 6)
        motion[staged.members[0], 3:5] = -lean[1], lean[0]
        wanted = misaligned_approach(replace(ideal, sun_misalignment=np.array(lean)), gears, back=back)
        assert mesh_slopes(model.assembly, motion.ravel()) == pytest.approx(cosine * wanted, abs=1e-10)
        motion[:] = 0.0
        motion[list(staged.planets), 3:5] = -lean[1], lean[0]
        wanted = misaligned_approach(replace(ideal, carrier_misalignment=np.array(lean)), gears, back=back)
        assert mesh_slopes(model.assembly, motion.ravel()) == pytest.approx(cosine * wanted, abs=1e-10)


def refused(tables) -> str:
    with pytest.raises(FemgearError) as error:
        solve_deflection(read_case(tables))
    return str(error.value)


def test_a_shaft_that_floats_along_its_axis_is_named():
    tables = pair_tables()
    del tables["bearing"][0]["axial"]
    text = refused(tables)
    assert "E-MECHANISM" in text
    assert "shaft input floats along the axis" in text


def test_thrust_that_cylindrical_bearings_do_not_take_is_refused():
    tables = pair_tables(helix="15 deg")
    roller = BALL | {"kind": "cylindrical", "effective_length": "9 mm"}
    for bearing in tables["bearing"][:2]:
        bearing.pop("radial")
        bearing.pop("axial", None)
        bearing |= roller
    assert "shaft input" in refused(tables)


def test_a_bearing_on_one_seat_alone_leaves_the_shaft_to_tilt():
    tables = pair_tables()
    del tables["bearing"][3]
    text = refused(tables)
    assert "E-MECHANISM" in text


def test_a_negative_number_of_rolling_elements_is_refused_where_it_stands():
    tables = pair_tables()
    tables["bearing"][1] = {"shaft": "input", "position": "85 mm"} | BALL | {"rolling_elements": 2}
    with pytest.raises(CaseError, match=r"bearing\[1\]\.rolling_elements"):
        read_case(tables)


def test_the_shaft_whose_thrust_no_bearing_takes_in_its_sense_is_named():
    tables = pair_tables(helix="15 deg")
    tables["bearing"][0]["axial_sense"] = "positive"
    there = solve_deflection(read_case(pair_tables(helix="15 deg"))).bearing_force[0, 2]
    if there < 0.0:
        tables["bearing"][0]["axial_sense"] = "negative"
    text = refused(tables)
    assert "nothing takes the thrust on shaft input" in text


E, AREA, LENGTH = 2.06e11, 0.25 * math.pi * 0.03**2, 0.08  # of the input shaft, and between its bearings


def hot(axial="rigid", **entries):
    """Tables of a pair whose input shaft is held along its axis in both bearings, 80 mm apart."""
    tables = pair_tables()
    tables["shaft"][0] |= {"temperature_rise": "40 K"} | entries
    for bearing in tables["bearing"][:2]:
        bearing["axial"] = axial
    return tables


def thrusts(tables) -> np.ndarray:
    return solve_deflection(read_case(tables)).bearing_force[:, 2]


def test_a_shaft_between_two_fixed_bearings_presses_on_them():
    force = E * AREA * 1.15e-5 * 40.0
    # bearings push the shaft together: the left one towards +z
    assert thrusts(hot()) == pytest.approx([force, -force, 0.0, 0.0], rel=1e-9, abs=1e-6 * force)


def test_springs_along_the_axis_give_way():
    stiffness = 1e8
    force = 1.15e-5 * 40.0 * LENGTH / (LENGTH / (E * AREA) + 2.0 / stiffness)
    assert thrusts(hot("1e8 N/m"))[:2] == pytest.approx([force, -force], rel=1e-9)


def test_steps_of_the_shaft_count_each():
    halves = [{"length": "45 mm", "outer_diameter": "30 mm"}, {"length": "45 mm", "outer_diameter": "24 mm"}]
    # held from 5 to 85 mm: 40 mm of either part
    compliance = 0.04 / (E * AREA) + 0.04 / (E * AREA * 0.64)
    force = 1.15e-5 * 40.0 * LENGTH / compliance
    assert thrusts(hot(part=halves))[:2] == pytest.approx([force, -force], rel=1e-9)


def test_the_growth_of_the_casing_counts_against_it():
    tables = hot() | {"thermal": {"casing_rise": "20 K", "casing_expansion": "2.3e-5 1/K"}}
    case = read_case(tables)
    # aluminium of half the rise grows as steel of the whole one
    assert case.growth_of("input") == pytest.approx(40.0 * 1.15e-5 - 20.0 * 2.3e-5, abs=1e-18)
    assert thrusts(tables) == pytest.approx(np.zeros(4), abs=1e-3)
    # the other shaft is colder than the casing: it is pulled, but for one bearing that lets it slide
    assert case.growth_of("output") == pytest.approx(-4.6e-4)


def test_a_shaft_that_may_slide_grows_without_force():
    tables = pair_tables()
    tables["shaft"][0]["temperature_rise"] = "40 K"
    found = solve_deflection(read_case(tables))
    assert found.bearing_force[:, 2] == pytest.approx(np.zeros(4), abs=1e-6)
    end = found.model.seat("input", 0.09).station, found.model.seat("input", 0.005).station
    along = found.motion.reshape(-1, 6)[list(end), 2]
    # from bearing A, at 5 mm, to the end of the shaft
    assert along[0] - along[1] == pytest.approx(1.15e-5 * 40.0 * 0.085, rel=1e-9)


@pytest.mark.slow
def test_teeth_without_a_torque_touch_nowhere_and_hold_nothing_up():
    """A shaft that turns along, and a load case at rest beside a loaded one."""
    tables = pair_tables(teeth=True)
    tables["operation"]["load_case"].append(
        {"name": "idle", "torque": {"motor": "0 N m"}, "speed": {"input": "0 rpm"}, "share": 0.5}
    )
    tables["operation"]["load_case"][0]["share"] = 0.5
    case = read_case(tables)
    loaded, idle = (solve_deflection(case, one) for one in case.operation.load_case)
    assert list(loaded.contacts) == ["stage"]
    assert not idle.contacts
    assert idle.mesh_force == pytest.approx([0.0])
    assert np.isfinite(idle.motion).all()
    assert not np.abs(idle.motion).any()


@pytest.mark.parametrize(("stiffness", "share"), [("4e8 N/m", 0.5), ("2e8 N/m", 1.0 / 3.0), ("1e8 N/m", 0.2)])
def test_stages_side_by_side_at_one_place_share_by_their_stiffness(stiffness, share):
    """Two springs between the same two gears."""
    found = solve_deflection(read_case(split_pair_tables(stiffness, position="30 mm") | {"deflection": {"slices": 1}}))
    force = found.mesh_force
    assert force[1] / force.sum() == pytest.approx(share, rel=1e-9)
    flow = found.model.flow
    assert flow.torque_shares == pytest.approx({"stage": 1.0 - share, "second": share}, rel=1e-9)
    assert sum(torques["input"] for torques in flow.stage_torque.values()) == pytest.approx(-100.0, rel=1e-9)


def test_shafts_give_more_to_the_stage_that_stands_nearer_to_both_ends():
    """Torque enters at 0 mm and leaves at 90 mm: what twists between two equal stages goes with them as two springs."""
    tables = split_pair_tables() | {"motions": "rotation"}
    found = solve_deflection(read_case(tables))
    first, second = found.mesh_force * 0.036 * math.cos(math.radians(20.0))
    # springs at the radius of gear 1: along the shaft of the input, or by the other mesh and that of the output
    modulus = 206e9 / 2.6
    input_shaft, output_shaft = (modulus * math.pi / 32.0 * d**4 / 0.03 for d in (0.03, 0.04))
    mesh = 4e8 * (0.036 * math.cos(math.radians(20.0))) ** 2
    # T_1 / mesh + (T_1 i) i / output = T_2 / mesh + T_2 / input of the loop through both, with i = 36 / 24
    ratio = 36.0 / 24.0
    expected = (1.0 / mesh + 1.0 / input_shaft) / (2.0 / mesh + 1.0 / input_shaft + ratio**2 / output_shaft)
    assert first / (first + second) == pytest.approx(expected, rel=1e-6)
    assert first + second == pytest.approx(100.0, rel=1e-9)


@pytest.mark.slow
def test_teeth_side_by_side_settle_at_the_torque_that_each_has():
    tables = split_pair_tables(teeth=True)
    found = solve_deflection(read_case(tables))
    assert found.settled
    for stage in found.model.stages:
        torque = -found.model.flow.first_torque(stage.section)
        assert found.contacts[stage.name].result.sun_torque == pytest.approx(torque, rel=1e-3)
    assert 0.52 < found.model.flow.torque_shares["stage"] < 0.58


@pytest.mark.parametrize("angles", [(15, -15), (15, -10)])
def test_herringbone_teeth_hold_a_shaft_that_floats(angles):
    """Thrusts of both hands balance, whatever share of the torque that takes."""
    tables = split_pair_tables()
    for pair, helix in zip(tables["pair"], angles, strict=True):
        pair["gears"]["helix_angle"] = f"{helix} deg"
    del tables["bearing"][2]["axial"]
    found = solve_deflection(read_case(tables))
    assert np.abs(found.bearing_force[:, 2]).max() < 1e-6 * found.mesh_force.max()
    first, second = (torques["input"] for torques in found.model.flow.stage_torque.values())
    tangents = [math.tan(math.radians(helix)) for helix in angles]
    assert first * tangents[0] == pytest.approx(-second * tangents[1], rel=1e-6)
    # each alone would push it away
    tables["pair"] = tables["pair"][:1]
    with pytest.raises(CaseError) as refused:
        read_case(tables)
    assert refused.value.code == "E-MECHANISM"


def test_stages_side_by_side_without_torque_stay_idle():
    tables = split_pair_tables()
    tables["operation"]["load_case"][0]["torque"] = {"motor": "0 N m"}
    found = solve_deflection(read_case(tables))
    assert not found.model.flow.torque_shares and not found.mesh_force.any()


def stepped_tables(motions, **deflection) -> dict[str, Any]:
    """Stepped planets with coarse teeth."""
    tables: dict[str, Any] = case_text.parse(new_case("stepped", planets=3), "")
    for stage in tables["pair"]:
        stage["teeth"]["static"] = {"positions": 8, "flank_elements": 8}
    return tables | {"motions": motions, "deflection": deflection}


def both_ways(tables, monkeypatch):
    """Loaded state with one contact for all that is equal, and with one for every pair."""
    case = read_case(tables)
    copied = solve_deflection(case)
    monkeypatch.setattr(deflection, "_COPIED", -1.0)
    alone = solve_deflection(case)
    assert len({id(contact) for contact in alone.contacts.values()}) == 6
    return copied, alone


@pytest.mark.parametrize(
    "tables",
    [
        stepped_tables("plane", passes=1),
        pytest.param(stepped_tables("space", slices=3), marks=pytest.mark.slow),
    ],
    ids=["plane", "space"],
)
def test_equal_branches_have_one_contact_and_what_each_alone_has(tables, monkeypatch):
    copied, alone = both_ways(tables, monkeypatch)
    assert len({id(contact) for contact in copied.contacts.values()}) == 2
    np.testing.assert_allclose(copied.motion, alone.motion, rtol=1e-10, atol=1e-10 * np.abs(alone.motion).max())
    np.testing.assert_allclose(copied.mesh_force, alone.mesh_force, rtol=1e-10)
    for name, contact in alone.contacts.items():
        np.testing.assert_allclose(copied.contacts[name].stiffness, contact.stiffness, rtol=1e-10)
        own, other = (found.result.cycle.deflection for found in (copied.contacts[name], contact))
        np.testing.assert_allclose(own, other, rtol=1e-10)


@pytest.mark.parametrize("broken", ["pin_error", "gravity", "teeth"])
def test_branches_that_something_makes_unequal_are_solved_each(broken):
    tables = stepped_tables("plane", passes=1)
    if broken == "pin_error":
        next(one for one in tables["shaft"] if one["name"] == "planet 2")["pin_error"] = {"tangential": "1 um"}
    elif broken == "gravity":
        tables["gravity"] = {"direction": [0, -1, 0]}
    else:
        tables["pair"][0]["teeth"]["static"]["positions"] = 12
    found = solve_deflection(read_case(tables))
    # an error leaves the two planets beside it equal, other teeth of a pair all others
    expected = {"gravity": 6, "pin_error": 4, "teeth": 3}[broken]
    assert len({id(contact) for contact in found.contacts.values()}) == expected
