"""An estimated casing: walls around all parts, feet below, and a gearbox that makes a sound with it."""

import tomllib

import numpy as np
import pytest
from small_gearbox import pair_tables, planetary_tables

from femgear.case import text as case_text
from femgear.errors import CaseError
from femgear.trains.gearbox.casing_draft import DENSITY, draft_casing, wall_thickness, walls_inertia
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.reading import parse_case, read_case


def in_casing(tables):
    text, findings = draft_casing(read_case(tables))
    (finding,) = findings
    assert finding.code == "W-ESTIMATED" and finding.key == "casing"
    return parse_case(case_text.write(tables) + "\n" + text)


def test_walls_weigh_as_their_six_plates():
    sides, wall = np.array([0.3, 0.4, 0.5]), 1e-4
    mass, inertia = walls_inertia(sides, wall)
    x, y, z = sides
    plates = [(y * z, 0), (y * z, 0), (x * z, 1), (x * z, 1), (x * y, 2), (x * y, 2)]
    assert mass == pytest.approx(DENSITY * wall * sum(area for area, _ in plates), rel=2e-3)
    about_x = 0.0
    for area, normal in plates:
        weight = DENSITY * wall * area
        about_x += weight * sum(
            (0.25 if axis == normal else 1.0 / 12.0) * sides[axis] ** 2 for axis in range(3) if axis != 0
        )
    assert inertia[0] == pytest.approx(about_x, rel=2e-3)


@pytest.mark.parametrize(("direction", "axis"), [(None, 1), ([0, -1, 0], 1), ([1, 0, 0], 0), ([0, 0, 1], 1)])
def test_feet_stand_below_all_parts_and_the_weight_rests_on_them(direction, axis):
    tables = pair_tables() | ({} if direction is None else {"gravity": {"direction": direction}})
    case = in_casing(tables)
    places = np.array([foot.position for foot in case.casing.foot])
    assert np.ptp(places[:, axis]) == 0.0
    top = next(sensor for sensor in case.sensor if sensor.name == "top")
    # gears of 72 and 108 mm on axes 90 mm apart
    assert abs(top.position[axis] - places[0, axis]) > 0.108
    found = solve_deflection(case)
    assert found.settled
    if direction is not None and direction[2] == 0:
        down = np.argmax(np.abs(direction))
        weight = sum(foot[down] for foot in found.foot_force)
        assert abs(weight) > 9.0 * case.casing.mass


def test_walls_grow_with_the_centre_distance():
    case = read_case(pair_tables())
    assert wall_thickness(case) == 8e-3
    tables = planetary_tables()
    tables["planetary"][0]["gears"] |= {"module": "60 mm", "centre_distance": "1.2 m"}
    assert wall_thickness(read_case(tables)) == pytest.approx(0.025 * 1.2 + 3e-3, rel=1e-6)


def test_what_has_a_casing_keeps_it():
    case = in_casing(pair_tables())
    with pytest.raises(CaseError) as refused:
        draft_casing(case)
    assert refused.value.code == "E-CHOICE" and refused.value.key == "casing"


def test_nothing_with_a_size_has_no_casing():
    tables = pair_tables() | {"motions": "plane"}
    tables["shaft"] = [{"name": "input"}, {"name": "output"}]
    tables["mass"] = [{"shaft": name, "mass": "1 kg", "inertia": "1e-3 kg m^2"} for name in ("input", "output")]
    tables["coupling"] = [{"between": ["input", "output"], "torsion": "1e4 N m/rad", "transmits": True}]
    tables["bearing"] = [{"shaft": name, "radial": "1e8 N/m"} for name in ("input", "output")]
    tables["load"] = [{"name": "motor", "shaft": "input"}, {"name": "brake", "shaft": "output"}]
    del tables["pair"]
    with pytest.raises(CaseError) as refused:
        draft_casing(read_case(tables))
    assert refused.value.code == "E-KEY-MISSING"


def test_a_plane_gearbox_has_no_sensor_along_its_axes():
    case = read_case(pair_tables() | {"motions": "plane"})
    made = tomllib.loads(draft_casing(case)[0])
    assert [sensor["name"] for sensor in made["sensor"]] == ["top", "side"]
