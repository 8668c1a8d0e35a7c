"""Where the modes of several stages live, and what the planets do in them."""

from collections import Counter

import numpy as np
import pytest
from published.multistage_example import four_stage_case
from small_gearbox import pair_tables, planetary_tables

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import GearboxModes, solve_gearbox_modes
from femgear.trains.reading import read_case, with_values


def modes_of(tables) -> GearboxModes:
    return solve_gearbox_modes(solve_deflection(read_case(tables)))


@pytest.fixture(scope="module")
def four_stages() -> GearboxModes:
    return solve_gearbox_modes(solve_deflection(four_stage_case()))


def test_every_mode_of_equal_planets_is_of_one_class(four_stages):
    # 24 rotations of 12 members and 4 planets a class; 3 (N - 3) planet modes a stage
    expected = {"rigid": 1, "rotational": 23, "translational": 48, "planet": 6}
    assert Counter(four_stages.stages.kinds) == expected


def test_planet_modes_stay_in_one_stage_and_shares_add_up(four_stages):
    stages = four_stages.stages
    planet = np.array(stages.kinds) == "planet"
    assert stages.energy[:, planet].max(axis=0) == pytest.approx(np.ones(6))
    assert {*stages.energy[:, planet].argmax(axis=0).tolist()} == {2, 3}
    # every body is of some stage
    assert stages.energy.sum(axis=0) == pytest.approx(np.ones(78))


def test_unequal_planets_mix_the_classes():
    gears = {"planet_angles": ["0 deg", "90 deg", "210 deg"], "planets": 3}
    case = with_values(four_stage_case(), {f"planetary[0].gears.{key}": value for key, value in gears.items()})
    kinds = Counter(solve_gearbox_modes(solve_deflection(case)).stages.kinds)
    assert kinds["mixed"] > 10 and kinds["planet"] == 6


def test_a_shaft_of_two_stages_is_half_of_each():
    tables = pair_tables()
    stage = tables["pair"][0]
    tables["shaft"].append(tables["shaft"][1] | {"name": "last", "axis": ["180 mm", "0 mm"]})
    tables["bearing"] += [
        bearing | {"name": f"{bearing['name']} 2", "shaft": "last"} for bearing in tables["bearing"][2:]
    ]
    second = {"name": "second", "shafts": ["output", "last"], "positions": ["60 mm", "60 mm"]}
    tables["pair"].append(stage | second | {"gears": stage["gears"] | {"teeth": [30, 30]}})
    tables["load"][1] |= {"shaft": "last"}
    found = modes_of(tables)
    shares = dict(zip(found.members, found.kinetic, strict=True))
    assert found.stages.energy[0] == pytest.approx(shares["input"] + 0.5 * shares["output"])
    assert found.stages.energy[1] == pytest.approx(shares["last"] + 0.5 * shares["output"])
    assert {*found.stages.kinds} == {""}


def test_in_space_shafts_along_their_axes_belong_to_rotations_and_tilts_to_translations():
    found = modes_of(planetary_tables() | {"modes": {"up_to": "1 MHz"}})
    kinds = Counter(found.stages.kinds)
    # three planets: x and y with tilts in pairs, rotations and axial motions one by one
    assert kinds["mixed"] == kinds["planet"] == 0 and kinds["translational"] == 2 * (len(found.modes.frequency) // 3)
