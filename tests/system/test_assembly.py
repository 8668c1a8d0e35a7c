"""Stations, springs, conditions and meshes: against closed forms and matrices written by hand."""

import math

import numpy as np
import pytest

from femgear.fe.beam import body_matrices, rigid_link
from femgear.system.assembly import (
    GROUND,
    IN_PLANE,
    Assembly,
    Contact,
    Follower,
    Inertia,
    gear_contact,
    held_motions,
    joint,
    mesh_normal,
    planetary_contacts,
    solved_conditions,
)


def two_bodies(**parts) -> Assembly:
    inertias = tuple(Inertia((i,), *body_matrices(2.0, 0.03, 0.02)) for i in range(2))
    places = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    return Assembly(("first", "second"), places, np.zeros(12, bool), inertias, **parts)


def test_a_joint_carries_what_two_springs_at_its_place_would():
    k = np.array([1e8, 2e8, 3e8, 1e4, 2e4, 3e4])
    offsets = np.array([0.0, 0.0, 0.05]), np.array([0.0, 0.02, -0.03])
    springs = joint("bearing", (0, 1), offsets, k)
    assembly = two_bodies(springs=(springs,))
    moved = np.arange(12.0) * 1e-6
    apart = rigid_link(offsets[1]) @ moved[6:] - rigid_link(offsets[0]) @ moved[:6]
    force = k * apart
    expected = np.concatenate([-rigid_link(offsets[0]).T @ force, rigid_link(offsets[1]).T @ force])
    assert assembly.stiffness @ moved == pytest.approx(expected, rel=1e-12, abs=1e-9)


def test_rigid_springs_are_the_limit_of_stiff_ones():
    def frequencies(stiff):
        k = np.array([stiff, stiff, stiff, stiff, stiff, 0.0])
        tie = joint("tie", (0, 1), (np.array([0.05, 0.0, 0.0]), np.array([-0.05, 0.0, 0.0])), k)
        hold = joint("hold", (GROUND, 0), (np.zeros(3), np.zeros(3)), np.array([1e6, 2e6, 3e6, 4e3, 5e3, 6e3]))
        turn = joint("turn", (GROUND, 1), (np.zeros(3), np.zeros(3)), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1e3]))
        system = two_bodies(springs=(tie, hold, turn)).system()
        values = np.linalg.eigvals(np.linalg.solve(system.M, system.K)).real
        return np.sort(values)[:7]

    assert frequencies(1e13) == pytest.approx(frequencies(np.inf), rel=1e-5)


def test_conditions_are_met_by_all_free_motions():
    rng = np.random.default_rng(3)
    rows, held = rng.normal(size=(4, 10)), np.zeros(10, bool)
    held[7] = True
    T, free = solved_conditions(rows, held)
    assert np.array_equal(T[free], np.eye(5))
    assert T.shape == (10, 5)
    assert np.abs(rows @ T).max() < 1e-12
    assert not T[7].any()
    assert np.linalg.matrix_rank(T) == 5


def test_a_mesh_approaches_by_the_difference_of_both_points_along_its_normal():
    normal = np.array([0.6, 0.7, 0.3])
    normal /= np.linalg.norm(normal)
    points = np.array([[[0.04, 0.0, 0.01]], [[-0.06, 0.0, 0.01]]])
    mesh = Contact("mesh", (0, 1), np.tile(normal, (2, 1)), points, np.zeros(1), np.array([4e8]))
    moved = np.arange(1.0, 13.0) * 1e-6
    first = moved[:3] + np.cross(moved[3:6], points[0, 0])
    second = moved[6:9] + np.cross(moved[9:], points[1, 0])
    assembly = two_bodies(contacts=(mesh,))
    assert assembly.columns.T @ moved == pytest.approx([normal @ (first - second)], rel=1e-12)
    standing = Contact("mesh", (GROUND, 1), np.tile(normal, (2, 1)), points, np.zeros(1), np.array([4e8]))
    assert two_bodies(contacts=(standing,)).columns.T @ moved == pytest.approx([-normal @ second], rel=1e-12)


def test_free_motions_are_named_after_their_stations():
    tie = joint("tie", (0, 1), (np.zeros(3), np.zeros(3)), np.full(6, np.inf))
    assert two_bodies(springs=(tie,)).free_names == tuple(
        f"first: {way}" for way in ("x", "y", "z", "tilt x", "tilt y", "rotation")
    )


def test_a_follower_moves_as_its_leaders_have_it():
    """A spring on a point that follows two stations is that spring with the rows of both."""
    rng = np.random.default_rng(7)
    first, second = rng.normal(size=(2, 6, 6))
    here = np.zeros(3), np.zeros(3)
    ground = [joint(name, (GROUND, i), here, 1e6 * (1 + rng.random(6))) for i, name in enumerate("ab")]
    at_point = joint("point", (GROUND, 2), here, 1e6 * (1 + rng.random(6)))
    held = np.zeros(18, bool)
    held[[2, 14]] = True  # along z of the first, and of the point
    inertias = tuple(Inertia((i,), np.eye(6), np.zeros((6, 6))) for i in range(2))
    led = Assembly(
        ("a", "b", "point"),
        np.zeros((3, 3)),
        held,
        inertias,
        springs=(*ground, at_point),
        followers=(Follower("point", 2, (0, 1), np.hstack([first, second])),),
    )
    system = led.system(np.arange(18.0))
    assert system.dofs == led.motion_names[:2] + led.motion_names[3:12]
    rows = np.hstack([first, second])
    rows[2] = 0.0
    plain = Assembly(("a", "b"), np.zeros((2, 3)), held[:12], inertias, springs=tuple(ground)).system(np.arange(12.0))
    rows = rows[:, [i for i in range(12) if i != 2]]
    assert system.K == pytest.approx(plain.K + rows.T @ np.diag(at_point.stiffness) @ rows, rel=1e-12)
    assert system.load == pytest.approx(plain.load + rows.T @ np.arange(12.0, 18.0))


def test_a_right_handed_driver_is_pushed_the_way_its_thumb_points():
    # fingers along the rotation of the driver, here about +z: thrust on it along +z, on its mate along -z
    normal = mesh_normal(np.array([1.0, 0.0]), math.radians(20.0), math.radians(15.0), 1)
    assert normal[2] < 0.0  # into gear 2
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15)
    assert mesh_normal(np.array([1.0, 0.0]), math.radians(20.0), math.radians(15.0), -1)[2] > 0.0


@pytest.mark.parametrize("on_base_circles", [False, True])
@pytest.mark.parametrize("internal", [False, True])
@pytest.mark.parametrize("flank", [1, -1])
def test_the_rotation_of_each_gear_moves_its_flank_by_the_base_radius(flank, internal, on_base_circles):
    """Radii, centre distance and pressure angle need not close; gears of a helix move along the slanted normal."""
    towards, helix = np.array([math.cos(0.7), math.sin(0.7)]), math.radians(15.0)
    known = {"flank": flank, "internal": internal, "base_helix": helix, "on_base_circles": on_base_circles}
    contact = gear_contact(
        "mesh", (0, 1), towards, (0.03, 0.08), math.radians(22.0), heights=(-0.01, 0.01), stiffness=4e8, **known
    )
    effect = contact.approach
    second = -1.0 if internal else 1.0
    assert effect[0, :, 5] == pytest.approx(flank * 0.03 * math.cos(helix), rel=1e-14)
    assert effect[1, :, 5] == pytest.approx(flank * second * 0.08 * math.cos(helix), rel=1e-14)
    assert effect[0, :, :3] == pytest.approx(-effect[1, :, :3], rel=1e-14)
    assert contact.stiffness.tolist() == [2e8, 2e8]


def test_meshes_of_planets_are_those_of_their_gears_one_by_one():
    """The flanks of sun and planet, and of planet and ring, that a driving sun presses; planets have the other hand."""
    towards = np.array([[math.cos(0.7), math.sin(0.7)], [math.cos(2.9), math.sin(2.9)]])
    known = {"flank": 1, "base_helix": 0.2, "heights": (-0.01, 0.01)}
    both = np.stack([towards, towards], axis=1)
    contacts = planetary_contacts(
        (0, (1, 2), GROUND), both, (0.03, 0.02, 0.07), (0.38, 0.34), stiffness=([1e8, 2e8], [3e8, 4e8]), **known
    )
    assert [(one.name, one.stations) for one in contacts] == [
        ("sun-planet 1", (0, 1)),
        ("sun-planet 2", (0, 2)),
        ("planet 1-ring", (1, GROUND)),
        ("planet 2-ring", (2, GROUND)),
    ]
    assert [one.stiffness.sum() for one in contacts] == pytest.approx([1e8, 2e8, 3e8, 4e8])
    # the rotation of a planet opens the mesh with the sun as it closes that with the ring
    turned = [contacts[1].approach[1, :, 5], contacts[3].approach[0, :, 5]]
    assert turned[0] == pytest.approx(0.02 * math.cos(0.2), rel=1e-14)
    assert turned[1] == pytest.approx(-0.02 * math.cos(0.2), rel=1e-14)
    # thrusts of the sun and of the ring on a planet cancel
    assert contacts[0].normals[1, 2] == pytest.approx(contacts[2].normals[0, 2], rel=1e-14)
    assert held_motions(2, IN_PLANE).tolist() == 2 * [False, False, True, True, True, False]
