"""Lives of bearings at one load case and over load cases, against the formulas of ISO 281 by hand."""

import math

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.system.bearing_life import equivalent_load, life_factor, reference_load, reference_rating_life
from femgear.trains.gearbox.geometry import rolling_bearing
from femgear.trains.gearbox.life import (
    added_damage,
    bearing_lives,
    describe_load_cases,
    life_text,
    life_variables,
    shortest_life,
    spectrum_lives,
    turning_speed,
)
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.reading import read_case

BALL = {
    "kind": "ball",
    "rolling_elements": 9,
    "element_diameter": "9.5 mm",
    "pitch_diameter": "46 mm",
    "clearance": "-3 um",
    "dynamic_rating": "19.5 kN",
}
CASES = (("start", "150 N m", "500 rpm", 0.1), ("run", "60 N m", "2000 rpm", 0.6), ("back", "-40 N m", "900 rpm", 0.3))


def tables_of(*cases):
    """Tables of a pair on ball bearings with load cases of name, torque, speed and share."""
    tables = pair_tables(helix="15 deg")
    for bearing in tables["bearing"]:
        for entry in ("radial", "axial"):
            bearing.pop(entry, None)
        bearing |= BALL
    tables["bearing"][3] = {"name": "D", "shaft": "output", "position": "85 mm", "radial": "2e8 N/m"}
    tables["operation"]["load_case"] = [
        {"name": name, "torque": {"motor": torque}, "speed": {"input": speed}, "share": share}
        for name, torque, speed, share in cases
    ]
    return tables


@pytest.fixture(scope="module")
def result():
    return solve_deflections(read_case(tables_of(*CASES)))


def test_the_life_over_load_cases_is_that_under_the_equivalent_load(result):
    shares = [share for *_, share in CASES]
    over = spectrum_lives(result.states, shares)
    for number in range(3):
        bearing = rolling_bearing(result.case.bearing[number])
        force = np.array([state.bearing_force[number] for state in result.states])
        loads = [equivalent_load(bearing, math.hypot(f[0], f[1]), abs(f[2])) for f in force]
        # revolutions of every load case, the output turns 24/36 as fast as the input
        turns = np.array([500.0, 2000.0, 900.0]) / 60.0 * np.array(shares) * (1.0 if number < 2 else 24 / 36)
        mean = (turns @ np.array(loads) ** 3 / turns.sum()) ** (1.0 / 3.0)
        assert over.load[number] == pytest.approx(mean, rel=1e-9)
        life = (19500.0 / mean) ** 3 * 1e6 / turns.sum() / 3600.0
        assert over.hours[number, 0] == pytest.approx(life, rel=1e-9)


def test_damages_add():
    assert added_damage([[100.0], [1000.0]], [0.5, 0.25]) == pytest.approx([1.0 / (0.5 / 100.0 + 0.25 / 1000.0)])
    assert math.isinf(added_damage(np.array([math.inf, math.inf]), [0.5, 0.5]))
    assert np.isnan(added_damage(np.array([math.nan, 10.0]), [0.5, 0.5]))


def test_one_load_case_with_the_whole_time_is_itself():
    (state,) = solve_deflections(read_case(tables_of(("run", "60 N m", "2000 rpm", 1.0)))).states
    over, alone = spectrum_lives([state], [1.0]), bearing_lives(state)
    assert over.hours[:3, :2] == pytest.approx(alone[:3, :2], rel=1e-12)
    assert over.damage[0, :3] == pytest.approx(np.ones(3))
    # two halves of it are it too
    assert spectrum_lives([state, state], [0.5, 0.5]).hours[:3, :2] == pytest.approx(alone[:3, :2], rel=1e-12)
    assert turning_speed(state, 2) == pytest.approx(2000.0 / 60.0 * 24 / 36)


def test_shares_of_the_damage_make_the_whole(result):
    over = spectrum_lives(result.states, [share for *_, share in CASES])
    assert over.damage[:, :3].sum(axis=0) == pytest.approx(np.ones(3))
    lives = np.array([bearing_lives(state) for state in result.states])[..., 1]
    part = 0.6 / lives[1, 0] * over.hours[0, 1]
    assert over.damage[1, 0] == pytest.approx(part)
    # a bearing of given stiffness has no life
    assert np.isnan(over.hours[3]).all() and np.isnan(over.load[3])


def test_lubrication_and_fatigue_limit_modify_the_life():
    tables = tables_of(("run", "60 N m", "2000 rpm", 1.0))
    tables["bearing"][0] |= {"viscosity_ratio": 1.5, "contamination": 0.6, "fatigue_limit": "500 N"}
    (state,) = solve_deflections(read_case(tables)).states
    _, reference, modified = bearing_lives(state)[0]
    load = reference_load(state.states[0].bearing, reference_rating_life(state.states[0], 19500.0), 19500.0)
    factor = life_factor(state.states[0].bearing, 1.5, 0.6, 500.0 / load)
    assert modified == pytest.approx(factor * reference) and factor > 1.0
    assert np.isnan(bearing_lives(state)[1:, 2]).all()


def test_tables_and_verdict_tell_which_load_case_decides(result):
    data = result.dataset()
    load_cases, bearings = describe_load_cases(data)
    assert [row[0] for row in load_cases.rows] == ["start", "run", "back"]
    assert bearings.header[:2] == ("bearing", "equivalent load [N]")
    assert bearings.rows[3][1:3] == ("-", "-")
    ((name, text),) = shortest_life(data)
    lives = data["spectrum_reference_life"].values
    assert name == "shortest bearing life L10r"
    assert text.startswith(f"{np.nanmin(lives):.4g} h, {data['bearing'].values[int(np.nanargmin(lives))]}, over all")
    assert not list(describe_load_cases(data.isel(load_case=[0])))


def test_every_life_is_in_the_file(result):
    variables = life_variables(result.states, [share for *_, share in CASES])
    assert variables["damage_share"][1].shape == (3, 4)
    assert variables["spectrum_rating_life"][1].shape == (4,)
    assert [life_text(value) for value in (math.nan, math.inf, 12345.6)] == ["-", "no load", "1.235e+04"]
