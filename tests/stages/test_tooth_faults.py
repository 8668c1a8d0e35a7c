"""What is said of faults of teeth."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.contact.flank_pairs import mesh_pairs
from femgear.errors import CaseError, FemgearError
from femgear.gears.deviations import common_period
from femgear.gears.gear import Gear
from femgear.gears.kinematics import speeds
from femgear.gears.planetary import close_set, equal_planet_angles
from femgear.stages.static import solve_static
from femgear.stages.tooth_faults import (
    archard_wear,
    describe_faults,
    fault_effects,
    fault_findings,
    fault_frequencies,
    fault_words,
    sun_fault_step,
    undrawn_faults,
)
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import parse_case, read_case, with_values
from femgear.trains.registry import check_case, train_of
from validation.planetary import reference_set

CASES = Path(__file__).parents[2] / "cases"
TEETH = (17, 5e-3, "sun"), (37, 10e-3, "planet"), (91, 52e-3, "ring")
WEAR = {"kind": "wear", "tooth": 3, "depth": "5 um"}


@pytest.fixture(scope="module")
def healthy():
    return read_case(CASES / "planetary_27_40_108.toml")


def texts(case):
    return [str(finding) for finding in fault_findings(case)]


def test_a_whole_set_has_nothing_to_say(healthy):
    assert texts(healthy) == []


@pytest.mark.parametrize(("teeth", "nothing_left"), [(range(26), True), (range(0, 27, 2), False), ((3,), False)])
def test_teeth_that_leave_nothing_in_mesh_are_a_fault_before_anything_is_solved(healthy, teeth, nothing_left):
    case = with_values(healthy, {"sun.fault": [{"kind": "missing", "tooth": tooth} for tooth in teeth]})
    open_meshes = [finding for finding in fault_findings(case) if finding.severity == "fault"]
    assert len(open_meshes) == nothing_left
    assert all("26 missing teeth: in" in finding.text for finding in open_meshes)
    # what the model leaves out is said once, not 26 times
    assert len([finding for finding in fault_findings(case) if "compliance" in finding.text]) == 1


def test_faults_say_what_is_left_out(healthy):
    spall = {"kind": "spall", "tooth": 3, "flank": "left", "diameter": "42 mm", "length": "1 mm", "depth": "40 um"}
    said, edge = texts(with_values(healthy, {"sun.fault": [spall]}))
    assert said.startswith("[W-FAULT] sun.fault[0]: a pit that only separates flanks")
    assert edge.startswith("[W-EDGE] sun.fault[0]: the flank has a sharp edge")


def test_faults_are_named_by_gear_tooth_kind_and_size(healthy):
    assert fault_words(healthy) == []
    assert fault_words(read_case(CASES / "cracked_planet.toml")) == ["planet 1, tooth 3: crack of 1.5 mm"]
    pit = {"kind": "spall", "tooth": 3, "flank": "left", "diameter": "42 mm", "length": "1 mm", "depth": "40 um"}
    tips = {"kind": "broken corner", "tooth": 2, "length": "0.4 mm"}
    case = with_values(
        healthy,
        {
            "sun.fault": [pit, tips],
            "planet.fault": [{"kind": "missing", "tooth": 5, "planet": 2}],
            "ring.fault": [{"kind": "wear", "flank": "left", "depth": "5 um"}],
        },
    )
    assert fault_words(case) == [
        "sun, tooth 3: pit of 1 mm, 40 µm deep",
        "sun, tooth 2: tip broken off by 0.4 mm",
        "planet 2, tooth 5: missing",
        "ring, all teeth: worn by 5 µm",
    ]


def test_effects_of_a_fault_are_those_of_its_mesh_periods():
    """Four mesh periods, of which the second has the faulty tooth; a line between those of three equal planets."""
    case = read_case(CASES / "cracked_planet.toml")
    usual, faulty = np.array([0.0, 2e-6]), np.array([0.0, 3e-6])
    ste = np.stack([np.concatenate([usual, faulty, usual, usual]), np.tile(0.5 * usual, 4)])
    share = np.full((3, 8), 1.0 / 3.0)
    share[:, 2] = 0.28, 0.36, 0.36
    static = xr.Dataset(
        {"ste": (("mesh", "position"), ste), "load_share": (("planet", "position"), share)},
        {"mesh": ["sun-planet 1", "planet 1-ring"], "planet": [1, 2, 3]},
        {"mesh_periods": 4},
    )
    # accelerations of 1 and 0.1 m/s^2: the line of order 4 is 20 dB below that of order 3
    lines = {"lines_real": (("speed", "order"), [[0.0, 1.0 / 9.0, 0.1 / 16.0]])}
    speeds = {"carrier_speed": ("speed", [20.0 * np.pi])}
    zero = {"lines_imag": (("speed", "order"), np.zeros((1, 3)))}
    housing = xr.Dataset(lines | zero | speeds, {"speed": [1000.0], "order": [0.0, 3.0, 4.0]})
    run = SimpleNamespace(case=case, stages=("static", "housing"), static=static, housing=housing)
    error, shares, line = fault_effects(run)
    assert error == "transmission error 3 in place of 2 µm"
    assert shares == "planet 1 carries 28.0 % in place of 33.3 % of the torque"
    assert line == "new lines, at 40 Hz 20 dB below the largest"
    static["ste_peak_to_peak"] = ("mesh", [3.4e-6, 1e-6])
    assert next(fault_effects(run)) == "transmission error 3.4 in place of 2 µm"
    housing["lines_real"][:, 2] = 0.0
    static["ste"][0, 2:4] = usual
    static["load_share"][:] = 1.0 / 3.0
    assert list(fault_effects(run)) == [
        "no mesh period has 2 % more transmission error than the others",
        "planets share the load as without it",
        "no line at the sensor is new",
    ]


def test_a_fault_on_an_idle_flank_is_told(healthy):
    right, left = ({"sun.fault": [WEAR | {"flank": flank}]} for flank in ("right", "left"))
    assert texts(with_values(healthy, left)) == []
    (said,) = texts(with_values(healthy, right))
    assert "carries nothing" in said
    backwards = {"operation.torque": "-100 N m"}
    assert texts(with_values(healthy, right | backwards)) == []
    assert len(texts(with_values(healthy, left | backwards))) == 1


def test_a_fault_of_the_ring_makes_no_new_lines(healthy):
    (said,) = texts(with_values(healthy, {"ring.fault": [WEAR | {"flank": "left"}]}))
    assert "no new lines" in said


@pytest.mark.parametrize(("sun", "planet", "ring", "planets", "step"), [(24, 24, 72, 4, 4.0), (27, 40, 108, 3, 1.0)])
def test_lines_of_a_faulty_sun_tooth_lie_at_multiples_of_a_step(sun, planet, ring, planets, step):
    gears = reference_set()
    if (sun, planets) != (27, 3):
        from types import SimpleNamespace

        gears = SimpleNamespace(gears=[SimpleNamespace(teeth=z) for z in (sun, planet, ring)], n_planets=planets)
    assert sun_fault_step(gears) == pytest.approx(step)


def test_characteristic_frequencies_are_those_of_the_teeth():
    """Set 17/37/91 with three planets, the sun at 800 rpm and the ring held: mesh, sun and planet."""
    gears = close_set(
        *(Gear(z, 1e-3, math.radians(20), 0.0, 20e-3, r, internal=z == 91, name=name) for z, r, name in TEETH),
        planet_angles=equal_planet_angles(3),
        find=("sun", "ring"),
    )
    turning = speeds(gears, input="sun", fixed="ring", speed=800 * math.pi / 30)
    assert turning.mesh_frequency == pytest.approx(190.99, abs=0.005)
    often = fault_frequencies(gears, turning.mesh_frequency)
    assert often["sun"] == pytest.approx(33.70, abs=0.005)
    assert often["planet"] == pytest.approx(5.16, abs=0.005)
    assert turning.carrier / (2 * math.pi) == pytest.approx(2.099, abs=0.0005)
    assert often["ring"] == pytest.approx(3 * 2.099, abs=0.002)


def test_a_table_lists_the_faults(healthy):
    assert not [*describe_faults(healthy, 100.0)]
    case = with_values(healthy, {"planet.fault": [WEAR | {"flank": "ring side", "planet": 2}]})
    (block,) = describe_faults(case, 100.0)
    assert block.rows == (("wear", "planet 2", "3", "ring side", "2.5000"),)
    (block,) = describe_faults(case, None)
    assert block.rows[0][-1] == "-"


def test_wear_by_archard_is_load_over_width_times_sliding_times_passages(healthy):
    """Closed form where one tooth pair carries, zero at the pitch point, and what makes the flanks of a case."""
    coarse = with_values(healthy, {"static.flank_elements": 4, "static.positions": 32, "static.stresses": False})
    static = solve_static(coarse)
    given = {"hours": 100.0, "coefficient": 1e-17, "mesh_frequency": 360.0}
    entries = archard_wear(coarse, static, **given)
    assert {key: len(faults) for key, faults in entries.items()} == {"sun.fault": 1, "planet.fault": 6, "ring.fault": 1}
    worn = with_values(coarse, entries)
    fault, gears = set_deviations(worn).faults[0], planetary_set(coarse)
    assert common_period(set_deviations(worn), gears)[0] == 1
    pair = mesh_pairs(gears)[0]
    force = 100.0 / 3 / gears.sun.base_radius
    begin, end = pair.path
    # within the single contact
    zeta = np.array([end - gears.base_pitch, begin + gears.base_pitch]).mean()
    rolls = pair.roll_on(0, zeta), pair.roll_on(1, zeta)
    sliding = abs(1.0 - rolls[1] / pair.base_radius_2 / (rolls[0] / pair.base_radius_1))
    expected = 1e-17 * force / 25e-3 * sliding * 3600 * 100 * 3 * 360 / 27
    assert fault.removed(rolls[0]) == pytest.approx(expected, rel=0.05)
    assert fault.removed(pair.pitch_roll_1) < 0.1 * fault.removed(rolls[0]) or sliding < 0.02
    with pytest.raises(CaseError, match="without torque"):
        archard_wear(coarse, replace(static, sun_torque=0.0), **given)


def test_a_gearbox_says_what_faults_leave_out_and_refuses_them_without_contact():
    crack = {"kind": "crack", "tooth": 3, "flank": "left", "depth": "2 mm"}
    pair = with_values(read_case(CASES / "spur_pair.toml"), {"gear_1.fault": [crack]})
    tables = gearbox_of_case(pair).tables
    box = parse_case(case_text.write(tables), name="box")
    said = [str(finding) for finding in train_of(box).warnings(box)]
    assert any("pair[0].teeth.gear_1.fault[0]: faces of the crack" in text for text in said)
    with pytest.raises(CaseError, match="without contact") as refused:
        parse_case(case_text.write(tables | {"deflection": {"contact": False}}), name="box")
    assert refused.value.code == "E-FAULT"


def test_a_pair_with_a_fault_is_told_to_become_a_gearbox_for_its_vibration():
    crack = {"kind": "crack", "tooth": 3, "flank": "left", "depth": "2 mm"}
    pair = with_values(read_case(CASES / "spur_pair.toml"), {"gear_2.fault": [crack]})
    said = [str(finding) for finding in train_of(pair).warnings(pair)]
    assert any("span 36 mesh periods" in text and "femgear gearbox CASE" in text for text in said)


def test_faults_that_drawings_do_not_show_are_named(healthy):
    case = with_values(healthy, {"sun.fault": [{"kind": "missing", "tooth": 3}, WEAR | {"tooth": 9, "flank": "left"}]})
    assert list(undrawn_faults(case)) == ["sun.fault[1] (wear)"]
    (block,) = describe_faults(case, None)
    assert block.notes == ("sun.fault[1] (wear): drawings have the tooth whole",)


def test_faults_that_a_stage_of_a_gearbox_cannot_have_are_refused_where_they_stand():
    tables = gearbox_of_case(read_case(CASES / "spur_pair.toml")).tables
    spall = {"kind": "spall", "tooth": 3, "flank": "left", "diameter": "72 mm", "length": "1 mm", "depth": "40 mm"}
    tables["pair"][0]["teeth"]["gear_1"]["fault"] = [spall, {"kind": "missing", "tooth": 90}]
    with pytest.raises(CaseError) as refused:
        parse_case(case_text.write(tables), name="box")
    keys = [problem.key for problem in refused.value.problems]
    assert keys == ["pair[0].teeth.gear_1.fault[0].depth", "pair[0].teeth.gear_1.fault[1].tooth"]


# --- spalls over a part of the face width ------------------------------------------------------------

SLICED = {"static.flank_elements": 4, "static.positions": 8, "static.stresses": False, "static.slices": 5}
PIT = {"kind": "spall", "tooth": 3, "flank": "left", "diameter": "72.9 mm", "length": "1 mm", "depth": "40 um"}
"""Amid the flank of the pinion of the pair, which meshes over 20 mm."""


@pytest.fixture(scope="module")
def sliced():
    return with_values(read_case(CASES / "spur_pair.toml"), SLICED)


@pytest.fixture(scope="module")
def steps():
    return Steps()


def contact(sliced, steps, **changed):
    entries = {"gear_1.fault": [PIT | changed["spall"]]} if "spall" in changed else {}
    if "torque" in changed:
        entries["operation.torque"] = changed["torque"]
    return solve_static(with_values(sliced, entries), steps=steps).cycle


def test_a_spall_in_all_slices_is_one_across_the_width_and_a_whole_width_is_none(sliced, steps):
    across, all_slices = (contact(sliced, steps, spall=part) for part in ({}, {"width": "19.9 mm"}))
    assert all_slices.deflection == pytest.approx(across.deflection, rel=1e-10)
    assert all_slices.slice_load == pytest.approx(across.slice_load, abs=1e-9 * across.slice_load.max())
    assert all_slices.stiffness.mean() == pytest.approx(across.stiffness.mean(), rel=2e-3)
    for part in ({"width": "20 mm"}, {"width": "20 mm", "offset": "0 mm"}):
        (spall,) = set_deviations(with_values(sliced, {"gear_1.fault": [PIT | part]})).faults
        assert spall == set_deviations(with_values(sliced, {"gear_1.fault": [PIT]})).faults[0]


@pytest.mark.slow
def test_a_narrower_spall_does_less_down_to_nothing(sliced, steps):
    whole = contact(sliced, steps)
    largest = [
        float((contact(sliced, steps, spall={"width": f"{4 * covered} mm"}).deflection).max()) for covered in (5, 3, 1)
    ]
    healthy = float(whole.deflection.max())
    assert largest[0] > largest[1] > largest[2] > healthy
    assert largest[2] - healthy < 0.15 * (largest[0] - healthy)


@pytest.mark.slow
def test_slices_of_the_spall_carry_less_on_the_side_where_it_lies_under_either_torque(sliced, steps):
    spall = {"width": "8 mm", "offset": "6 mm"}
    ahead = contact(sliced, steps, spall=spall)
    torque = f"-{sliced.operation.torque} N m"
    back = contact(sliced, steps, spall=spall | {"flank": "right"}, torque=torque)
    loads = [cycle.slice_load[0].sum(axis=0)[:, int(cycle.deflection[0].argmax())] for cycle in (ahead, back)]
    for of_slices in loads:
        assert of_slices[3:].max() < 0.7 * of_slices[:3].min()
    assert np.ptp(back.deflection) == pytest.approx(np.ptp(ahead.deflection), rel=1e-6)


@pytest.mark.parametrize(
    ("changed", "slices", "key", "code"),
    [
        ({"width": "5 mm"}, 0, "gear_1.fault[0].width", "E-SLICES"),
        ({"width": "1 mm", "offset": "2 mm"}, 5, "gear_1.fault[0].width", "E-SLICES"),
        ({"width": "8 mm", "offset": "7 mm"}, 5, "gear_1.fault[0].width", "E-FAULT"),
        ({"width": "21 mm"}, 5, "gear_1.fault[0].width", "E-FAULT"),
    ],
)
def test_spalls_that_slices_do_not_show_are_refused(sliced, changed, slices, key, code):
    case = with_values(sliced, {"gear_1.fault": [PIT | changed], "static.slices": slices})
    with pytest.raises(FemgearError) as refused:
        check_case(case)
    assert (refused.value.key, refused.value.code) == (key, code)
    assert refused.value.limit and refused.value.remedy


def test_an_offset_needs_a_width_and_other_kinds_have_none(sliced):
    for fault in (PIT | {"offset": "2 mm"}, {"kind": "missing", "tooth": 3, "width": "2 mm"}):
        with pytest.raises(CaseError):
            with_values(sliced, {"gear_1.fault": [fault]})


def test_a_width_that_slices_change_is_told(sliced):
    def said(width):
        findings = fault_findings(with_values(sliced, {"gear_1.fault": [PIT | {"width": width}]}))
        return [str(finding) for finding in findings if "slices" in str(finding)]

    assert not said("12 mm")
    (text,) = said("10 mm")
    assert "10 mm of the width count as 3 of 5 slices, 12 mm" in text
