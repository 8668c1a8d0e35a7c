"""Gearboxes that other trains solve too: the same modes; mesh normals and thrust; pins by closed forms."""

import math

import numpy as np
import pytest
from gearbox_equivalents import pair_of_rigid_gears_tables, set_tables
from published.planetary_sets import kahraman_set, lin_parker_set
from small_gearbox import pair_tables

from femgear.run import solve
from femgear.solvers.linear.modal import undamped_modes
from femgear.stages.lumped_set import gear_set_modes
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.reading import read_case, with_values


def frequencies(tables) -> np.ndarray:
    """Natural frequencies of a gearbox with all slices in touch."""
    assembly, system, _ = linear_system(solve_deflection(read_case(tables)))
    still = type(system)(system.M, system.C, system.K, system.W, 0.0 * system.load, system.dofs)
    return undamped_modes(still, assembly.slice_stiffness, damping_ratio=0.0).frequency


def agree(found, expected):
    assert len(found) == len(expected)
    assert np.abs(np.sort(found) - np.sort(expected)).max() < 1e-9 * np.max(expected)
    elastic = np.sort(expected) > 1.0
    assert np.sort(found)[elastic] == pytest.approx(np.sort(expected)[elastic], rel=1e-9)


def test_the_helical_set_of_kahraman():
    data = kahraman_set(contact_points="pitch_point")
    agree(frequencies(set_tables(data, (30, 20, 70))), gear_set_modes(data).frequency)


def test_the_set_of_lin_and_parker():
    data = lin_parker_set()
    radii = np.array([data.sun_radius, data.planet_radius, data.ring_radius])
    teeth = np.rint(1000 * radii / radii[0]).astype(int).tolist()
    agree(frequencies(set_tables(data, teeth)), gear_set_modes(data).frequency)


@pytest.mark.parametrize("torque", ["200 N m", "-200 N m"])
def test_a_pair_on_its_bearings(torque):
    values = {"static.positions": 16, "operation.torque": torque, "gear_1.bearing_stiffness": "1e8 N/m"}
    case = with_values(read_case("cases/spur_pair.toml"), values)
    modes = solve(case, only="modes")["modes"].modes
    agree(frequencies(pair_of_rigid_gears_tables(case, float(modes.mesh_stiffness[0]))), modes.frequency)


@pytest.mark.parametrize("torque", ["100 N m", "-100 N m"])
@pytest.mark.parametrize("helix", ["0 deg", "15 deg", "-15 deg"])
def test_mesh_force_and_thrust_are_those_of_textbooks(torque, helix):
    tables = pair_tables(helix=helix)
    tables["operation"]["load_case"][0]["torque"]["motor"] = torque
    found = solve_deflection(read_case(tables))
    sign, beta = math.copysign(1.0, float(torque.split()[0])), math.radians(float(helix.split()[0]))
    tangential, alpha = 100.0 / 0.036, math.radians(20.0)
    radial, axial = tangential * math.tan(alpha), tangential * math.tan(beta)
    # on the shaft of gear 1 bearings hold against the force of gear 2 on it
    on_first = found.bearing_force[:2].sum(axis=0)
    # gear 2 lies along +x and pushes gear 1 towards -x, and back against its push
    assert on_first[:2] == pytest.approx([radial, sign * tangential], rel=1e-9)
    assert on_first[2] == pytest.approx(-sign * axial, rel=1e-9, abs=1e-6)
    assert found.bearing_force[2:].sum(axis=0)[:3] == pytest.approx(-on_first[:3], rel=1e-9, abs=1e-6)


def test_the_whole_gearbox_turned_moved_and_renamed_is_itself():
    tables = pair_tables(helix="12 deg")
    base = frequencies(tables)
    turned = pair_tables(helix="12 deg")
    angle, away = math.radians(37.0), np.array([0.3, -0.2])
    x, y = away + 0.09 * np.array([math.cos(angle), math.sin(angle)])
    turned["shaft"][0] |= {"axis": [f"{away[0]} m", f"{away[1]} m"], "start": "0.7 m", "name": "one"}
    turned["shaft"][1] |= {"axis": [f"{float(x)!r} m", f"{float(y)!r} m"], "start": "0.7 m"}
    turned["shaft"].reverse()
    for entry in (*turned["bearing"], *turned["load"]):
        entry["shaft"] = "one" if entry["shaft"] == "input" else entry["shaft"]
    turned["pair"][0]["shafts"] = ["one", "output"]
    turned["operation"]["load_case"][0]["speed"] = {"one": "1000 rpm"}
    assert frequencies(turned) == pytest.approx(base, rel=1e-9, abs=1e-3)
