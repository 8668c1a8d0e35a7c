"""Casings on feet: nothing moves on rigid ones, closed forms, an assembly of its own, images."""

import copy
import math

import numpy as np
import pytest
from casings import CENTRE, FEET, MASS, STIFFNESS, TENSOR, casing_tables, rigid_matrices, rigid_tables
from random_gearboxes import mirrored_across, turned
from scipy.linalg import eigh
from small_gearbox import pair_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.casing import casing_mass, casing_seats
from femgear.trains.gearbox.casing_results import seat_motions
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.reading import read_case

LARGEST = 1e-9


def in_casing(stiffness=STIFFNESS, **entries):
    return pair_tables(helix="15 deg") | {"casing": casing_tables(stiffness), "gravity": {}} | entries


def solved(tables) -> Deflection:
    return solve_deflection(read_case(tables))


def apart(found, expected) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def out_of_balance(found: Deflection) -> np.ndarray:
    """Forces and moments (6,) about the origin of loads, weight and feet, over the largest force."""
    load, places = found.model.load.reshape(-1, 6), np.asarray(found.model.assembly.places)
    force, feet = found.foot_force, np.array(list(FEET.values())) / 1e3
    total = load[:, :3].sum(axis=0) + force.sum(axis=0)
    moment = (load[:, 3:] + np.cross(places, load[:, :3])).sum(axis=0) + np.cross(feet, force).sum(axis=0)
    return np.append(total, moment) / np.abs(found.bearing_force).max()


def test_on_rigid_feet_all_is_as_without_a_casing():
    still = in_casing()
    del still["casing"]
    alone, held = solved(still), solved(in_casing("rigid"))
    assert apart(held.bearing_force, alone.bearing_force) <= LARGEST
    count = len(alone.motion)
    assert apart(held.motion[:count], alone.motion) <= LARGEST
    assert not held.motion[count:].any()
    frequency = [solve_gearbox_modes(one).modes.frequency[1:] for one in (held, alone)]
    assert apart(*frequency) <= LARGEST


def test_stiff_feet_come_near_rigid_ones_as_their_stiffness():
    held = solved(in_casing("rigid")).motion
    off = [apart(solved(in_casing([k] * 3)).motion, held) for k in (1e12, 1e13, 1e15)]
    assert off[0] == pytest.approx(10.0 * off[1], rel=1e-2)
    assert off[2] < 1e-6


@pytest.mark.parametrize("stiffness", [STIFFNESS, "rigid", (1e15, 2e8, 1e12)])
def test_feet_balance_weight_and_torques_from_outside(stiffness):
    assert np.abs(out_of_balance(solved(in_casing(stiffness)))).max() <= LARGEST


def test_two_feet_carry_the_torques_over_their_distance():
    tables = pair_tables() | {"motions": "plane", "casing": casing_tables()}
    tables["casing"]["foot"] = [
        {"position": [x, "-100 mm", "40 mm"], "stiffness": ["1e8 N/m", "1e8 N/m", "0 N/m"]}
        for x in ("-80 mm", "180 mm")
    ]
    # teeth of 24 and 36 turn both torques the same way round: 100 and 150 N m
    force = solved(tables).foot_force
    assert force[:, 1] == pytest.approx(np.array([250.0, -250.0]) / 0.26, rel=LARGEST)
    assert np.abs(force[:, [0, 2]]).max() <= LARGEST * force[0, 1]


def test_a_shaft_in_the_casing_is_all_that_matrices_written_out_say():
    mass, stiffness, load = rigid_matrices()
    found = solved(rigid_tables())
    free = np.setdiff1d(np.arange(18), [5])
    motion = np.zeros(18)
    motion[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load[free])
    # nothing holds the rotation that is given
    assert np.abs(stiffness @ motion - load).max() <= LARGEST * 150.0
    assert apart(found.motion, motion) <= LARGEST
    square, shape = eigh(stiffness, mass)
    modes = solve_gearbox_modes(found)
    assert modes.modes.frequency[0] == 0.0
    assert apart(modes.modes.frequency[1:], np.sqrt(square[1:]) / (2.0 * np.pi)) <= LARGEST
    kinetic = np.einsum("im,ij,jm->m", shape[12:], mass[12:, 12:], shape[12:])
    assert modes.members == ("input", "output", "casing")
    assert np.abs(modes.kinetic[2] - kinetic).max() <= 1e-8
    assert [modes.modes.kind[i] == "casing" for i in range(18)] == list(kinetic >= 0.8)


def test_a_casing_alone_swings_on_its_feet():
    tables = rigid_tables()
    for bearing in tables["bearing"]:
        bearing |= {"radial": "1 N/m", "axial": "1 N/m", "tilt": "1e-3 N m/rad"}
    # feet around the centre of mass, axes of inertia along x, y and z: six motions of their own
    tables["casing"] |= {"products": ["0 kg m^2"] * 3}
    for foot, (x, y, z) in zip(tables["casing"]["foot"], ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))):
        place = CENTRE + 0.1 * np.array([x, y, z])
        foot["position"] = [f"{value!r} m" for value in place.tolist()]
    tables["operation"]["load_case"][0]["torque"]["input"] = "1e-6 N m"
    modes = solve_gearbox_modes(solved(tables)).modes
    k, inertia = 4.0 * np.array(STIFFNESS), np.diag(TENSOR)
    lever = 0.1**2 * (k.sum() - k)
    expected = np.sort(np.sqrt(np.append(k / MASS, lever / inertia))) / (2.0 * math.pi)
    found = [hertz for hertz, kind in zip(modes.frequency, modes.kind, strict=True) if kind == "casing"]
    assert found == pytest.approx(expected, rel=1e-7)


def image(tables, matrix):
    """Turn or mirror the casing's feet, which are not as stiff along x as along y."""
    for foot in tables["casing"]["foot"]:
        values = [float(text.split()[0]) for text in foot["stiffness"]]
        foot["stiffness"] = [f"{value!r} N/m" for value in (np.abs(matrix) @ values).tolist()]
    return tables


@pytest.mark.parametrize("how", ["turned", "mirrored"])
def test_the_whole_box_turned_or_mirrored_is_the_same(how):
    tables = in_casing() | {"planetary": [], "mass": []}
    tables["shaft"][0]["axis"] = ["0 mm", "0 mm"]
    tables["gravity"] = {"direction": [0.6, -0.8, 0.0]}
    found = solved(tables)
    if how == "turned":
        matrix = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        other = solved(image(turned(tables, 0.5 * math.pi), matrix))
    else:
        matrix = np.diag([1.0, -1.0, 1.0])
        other = solved(image(mirrored_across(tables), matrix))
    scale = np.abs(found.bearing_force).max()
    assert np.abs(other.foot_force - found.foot_force @ matrix.T).max() <= LARGEST * scale
    assert np.abs(other.bearing_force[:, :3] - found.bearing_force[:, :3] @ matrix.T).max() <= LARGEST * scale
    frequency = [solve_gearbox_modes(one).modes.frequency[1:] for one in (found, other)]
    assert apart(*frequency) <= LARGEST


def test_a_bearing_that_stands_still_is_held_by_no_foot():
    tables = in_casing()
    tables["casing"]["stands_still"] = ["A", "B"]
    del tables["gravity"]
    found = solved(tables)
    # shaft 1 pushes on the ground, shaft 2 on the feet
    assert apart(found.foot_force.sum(axis=0), found.bearing_force[2:, :3].sum(axis=0)) <= LARGEST
    motions = seat_motions(found.model.case, found.model.casing, found.motion)
    assert not motions[:2].any()
    assert motions[2:].all()


def test_a_shaft_that_stands_still_is_held_in_the_casing():
    tables = rigid_tables()
    planetary = {
        "name": "set",
        "sun": "input",
        "carrier": "output",
        "ring": "held",
        "gears": {"teeth": [36, 24, 84], "module": "1.5 mm"},
        "sun_mesh": {"stiffness": "3e8 N/m"},
        "ring_mesh": {"stiffness": "3e8 N/m"},
        "planet": {"mass": "0.4 kg", "inertia": "1e-4 kg m^2"},
    }
    tables["shaft"][1]["axis"] = ["0 mm", "0 mm"]
    tables["shaft"].append({"name": "held"})
    tables["mass"].append({"shaft": "held", "mass": "2 kg", "inertia": "1e-2 kg m^2"})
    rigid = {"shaft": "held", "radial": "rigid", "axial": "rigid", "tilt": "rigid"}
    tables |= {"planetary": [planetary], "pair": []}
    tables["bearing"].append({"name": "E"} | rigid)
    tables["operation"]["fixed"] = ["held"]
    on_shaft = solved(tables)
    del tables["operation"]["fixed"], tables["shaft"][2], tables["mass"][2], tables["bearing"][4]
    planetary["ring"] = "casing"
    in_box = solved(tables)
    assert casing_seats(in_box.model.case).keys() == {"A", "B", "C", "D", "ring of set"}
    assert apart(on_shaft.foot_force, in_box.foot_force) <= LARGEST
    # the torque of the ring: what leaves the box less what enters it
    torque = np.cross(np.array(list(FEET.values())) / 1e3, in_box.foot_force)[:, 2].sum()
    assert torque == pytest.approx(-in_box.model.load.reshape(-1, 6)[:2, 5].sum(), rel=LARGEST)


def test_a_coupling_with_the_casing_turns_it():
    tables = rigid_tables()
    tables["pair"], tables["operation"]["output"] = [], []
    tables["coupling"] = [{"between": ["input", "casing"], "torsion": "1e5 N m/rad", "transmits": False}]
    tables["coupling"].append({"between": ["output", "casing"], "torsion": "1e5 N m/rad", "name": "other"})
    tables["operation"]["load_case"] = [{"torque": {}, "speed": {"input": "0 rpm"}}]
    tables["gravity"] = {}
    found = solved(tables)
    assert {"coupling 1", "coupling other"} <= casing_seats(found.model.case).keys()
    turn = found.motion.reshape(-1, 6)[:, 5]
    # nothing turns the shafts against the casing; the rotation of the input is given
    assert turn[1] == pytest.approx(turn[2], rel=1e-6)
    assert found.foot_force[:, 1].sum() == pytest.approx(9.80665 * (MASS + 9.0), rel=LARGEST)


def test_a_casing_that_its_feet_leave_free_is_named():
    tables = in_casing()
    tables["casing"]["foot"] = tables["casing"]["foot"][:2]
    with pytest.raises(CaseError, match=r"casing\.foot: nothing holds 1 motion: casing \("):
        solved(tables)


def test_products_of_inertia_are_integrals():
    section = read_case(in_casing()).casing
    assert casing_mass(section)[3:, 3:] == pytest.approx(TENSOR)
    # a point mass at (1, 2, 0) m beside one at its mirror image through the centre: I_xy of the tensor is -4 m
    other = copy.deepcopy(in_casing())
    other["casing"] |= {"inertia": ["8 kg m^2", "2 kg m^2", "10 kg m^2"], "products": ["3.9 kg m^2"] + ["0 kg m^2"] * 2}
    assert casing_mass(read_case(other).casing)[3, 4] == -3.9
