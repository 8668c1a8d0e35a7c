"""Shafts that float in their bearings: which bearings are named, and what modes that makes."""

import math

import numpy as np
import pytest
from planet_gearboxes import STEPPED, held, stepped_set
from small_gearbox import pair_tables

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.play import beyond_play, play_findings, slack_bearings, unheld_motions
from femgear.trains.gearbox.results import DeflectionResult, deflection_warnings
from femgear.trains.gearbox.stages import solve_box_modes, solve_deflections
from femgear.trains.reading import read_case

BALL = {"kind": "ball", "rolling_elements": 9, "element_diameter": "9.5 mm", "pitch_diameter": "46 mm"}


def on_balls(torque: str, clearance: str = "10 um"):
    """Tables of a helical pair on ball bearings."""
    tables = pair_tables(helix="15 deg")
    for bearing in tables["bearing"]:
        for entry in ("radial", "axial"):
            bearing.pop(entry, None)
        bearing |= BALL | {"clearance": clearance}
    tables["operation"]["load_case"][0]["torque"]["motor"] = torque
    return tables


def in_one_sense(helix: str):
    """Tables of a pair on springs of which one takes thrust one way, the other the other way."""
    tables = pair_tables(helix=helix)
    for number, bearing in enumerate(tables["bearing"]):
        bearing |= {"axial": "1e8 N/m", "axial_sense": ("positive", "negative")[number % 2]}
    return tables


def answers(tables):
    """State, texts of what floats, rigid modes beyond the rotation of the gearbox."""
    case = read_case(tables)
    result = solve_deflections(case)
    texts = [one.text for one in deflection_warnings(result.contents()) if one.code == "W-PLAY"]
    kinds = solve_box_modes(case, result).modes.kind
    return result, texts, sum(kind == "rigid" for kind in kinds) - 1


def test_without_load_shafts_float_in_the_clearance_of_their_balls():
    result, (text,), rigid = answers(on_balls("0 N m"))
    assert text.startswith("bearings A, B, C, D: ")
    assert "across and along z and against tilting in load case nominal" in text
    # twelve motions of two shafts, but the given rotation, and two that the mesh ties: along its normal, and its slope
    assert rigid == unheld_motions(result.state).shape[1] == 9
    assert slack_bearings(result.state)[:, :5].all() and not slack_bearings(result.state)[:, 5].any()


@pytest.mark.parametrize("what", ["torque", "weight", pytest.param("preload", marks=pytest.mark.slow)])
def test_load_weight_or_preload_hold_them(what):
    tables = on_balls("100 N m" if what == "torque" else "0 N m", "-3 um" if what == "preload" else "10 um")
    if what == "weight":
        tables["gravity"] = {}
    result, texts, rigid = answers(tables)
    assert (texts, rigid) == ([], 0)
    assert not result.contents()["slack"].values.any()
    assert unheld_motions(result.state).shape[1] == 0


def test_bearings_of_one_sense_hold_nothing_along_their_axis_without_thrust():
    _, (text,), rigid = answers(in_one_sense("0 deg"))
    assert text.startswith("bearings A, B, C, D: ") and "free along z in load case nominal" in text
    assert rigid == 2
    assert answers(in_one_sense("15 deg"))[1:] == ([], 0)


def test_every_load_case_is_told_for_itself():
    tables = on_balls("0 N m")
    first = tables["operation"]["load_case"][0]
    loaded = first | {"name": "loaded", "torque": {"motor": "80 N m"}, "share": 0.5}
    tables["operation"]["load_case"] = [loaded, first | {"name": "idle", "share": 0.5}]
    data = solve_deflections(read_case(tables)).contents()
    (found,) = play_findings(data)
    assert (found.code, found.key) == ("W-PLAY", "bearing") and "load case idle" in found.text
    assert np.array_equal(data["slack"].values.any(axis=(1, 2)), [False, True])


@pytest.mark.parametrize(("play", "wedged"), [("20 um", True), ("80 um", False)])
def test_errors_beyond_the_play_of_a_branch_are_told(play, wedged):
    """Between members that turn alone a branch is ahead of two others by its error less their approach."""
    tables, error, lever = held(stepped_set()), 2e-3, STEPPED[1] / STEPPED[2]
    tables["pair"][4]["timing_error"] = f"{error!r} rad"
    for pair in tables["pair"]:
        pair["mesh"]["backlash"] = play
    case = read_case(tables)
    base = 1e-3 * math.cos(math.radians(20.0)) * np.array(STEPPED)
    approach = 100.0 / (2.0 * base[0]) * (1.0 / 4e8 + lever**2 / 3e8)
    left = error * base[2] * lever - approach - float(play.split()[0]) * 1e-6 * (1.0 + lever)
    state = solve_deflection(case)
    expected = np.full(6, np.nan)
    expected[[1, 4]] = left / max(1.0, lever)
    assert beyond_play(state) == pytest.approx(expected, rel=1e-9, nan_ok=True)
    found = DeflectionResult(case, (state,), 0).dataset()
    assert [finding.code for finding in deflection_warnings(found) if finding.code == "W-WEDGING"] == [
        "W-WEDGING"
    ] * wedged


def test_branches_whose_play_is_not_known_say_nothing_of_it():
    tables = held(stepped_set())
    tables["pair"][4]["timing_error"] = "2e-3 rad"
    assert np.isnan(beyond_play(solve_deflection(read_case(tables)))).all()
