"""Bodies and meshes of sets and pairs."""

import numpy as np
import pytest

from femgear.gears.gear import Gear
from femgear.gears.kinematics import body_approach, member_approach, mesh_normals
from femgear.gears.pair import GearPair, close_pair
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles

SIZE = {"module": 2e-3, "pressure_angle": np.radians(20.0), "face_width": 0.02}


def planetary(planets: int) -> PlanetarySet:
    sun, planet = (Gear(teeth=z, profile_shift=0.0, rim_radius=0.01, **SIZE) for z in (24, 18))
    ring = Gear(teeth=60, profile_shift=0.0, rim_radius=0.08, internal=True, **SIZE)
    return close_set(sun, planet, ring, planet_angles=equal_planet_angles(planets))


def pair(*, internal: bool) -> GearPair:
    one = Gear(teeth=24, profile_shift=0.0, rim_radius=0.01, name="gear_1", **SIZE)
    rim = 0.08 if internal else 0.01
    two = Gear(teeth=60, profile_shift=0.0, rim_radius=rim, internal=internal, name="gear_2", **SIZE)
    return close_pair(one, two)


def test_a_set_lists_its_bodies_and_the_two_of_every_mesh():
    s = planetary(3)
    assert [body.name for body in s.bodies] == ["sun", "planet 1", "planet 2", "planet 3", "ring"]
    named = [tuple(s.bodies[body].name for body in mesh.bodies) for mesh in s.meshes]
    assert named[:2] == [("sun", "planet 1"), ("sun", "planet 2")] and named[5] == ("planet 3", "ring")
    assert [mesh.copy for mesh in s.meshes] == [0, 1, 2, 0, 1, 2]
    assert s.mesh_kind.tolist() == [0, 0, 0, 1, 1, 1] and s.kind_rows == (slice(0, 3), slice(3, 6))
    assert s.mesh_angles == pytest.approx(2 * list(s.planet_angles))
    assert s.moved_meshes([2, 0, 1]).tolist() == [2, 0, 1, 5, 3, 4]


@pytest.mark.parametrize("internal", [False, True])
def test_a_pair_is_two_bodies_and_a_mesh(internal):
    two = pair(internal=internal)
    assert [body.name for body in two.bodies] == ["gear_1", "gear_2"]
    assert [mesh.bodies for mesh in two.meshes] == [(0, 1)] and two.n_planets == 1
    assert two.rotation_approach.tolist() == [[1.0]]
    assert member_approach(two) == {}
    assert two.with_planet_angles((1.0,)) is two


def test_rotations_close_meshes_of_which_they_drive_a_gear_and_open_those_in_which_it_is_driven():
    N = 3
    expected = np.block([[-np.eye(N), np.ones((N, 1))], [np.eye(N), np.zeros((N, 1))]])
    assert np.array_equal(planetary(N).rotation_approach, expected)


def test_a_member_moves_its_gears_towards_their_mates_or_away():
    s = planetary(4)
    normals, motions = mesh_normals(s), member_approach(s)
    on_planet, on_ring, zero = normals[:4], normals[4:], np.zeros((4, 2))
    assert np.array_equal(motions["sun"], np.vstack([on_planet, zero]))
    assert np.array_equal(motions["carrier"], np.vstack([-on_planet, on_ring]))
    assert np.array_equal(motions["ring"], np.vstack([zero, -on_ring]))
    # the whole set may be displaced without any flank coming nearer
    assert sum(motions.values()) == pytest.approx(np.zeros((8, 2)), abs=1e-15)


def test_gears_are_exchanged_in_their_order():
    s, two = planetary(3), pair(internal=False)
    assert s.with_gears(s.gears) == s and two.with_gears(two.gears) == two
    assert [gear.name for gear in two.with_gears(two.gears[::-1]).gears] == ["gear_2", "gear_1"]


@pytest.mark.parametrize("back", [False, True])
def test_a_rotation_of_all_bodies_as_the_driver_drives_them_leaves_all_flanks_where_they_are(back):
    """And so does a displacement of the whole set; the driver alone closes its meshes by its base radius."""
    for s in (planetary(3), pair(internal=False), pair(internal=True)):
        effect, side = body_approach(s, back=back), -1.0 if back else 1.0
        turns = np.array([s.senses[body.gear] / s.gears[body.gear].base_radius for body in s.bodies])
        assert effect[..., 2] @ turns == pytest.approx(np.zeros(len(s.meshes)), abs=1e-15)
        assert effect[..., :2].sum(axis=1) == pytest.approx(np.zeros((len(s.meshes), 2)), abs=1e-15)
        driven = [side * s.gears[0].base_radius * (mesh.bodies[0] == 0) for mesh in s.meshes]
        assert effect[:, 0, 2] == pytest.approx(driven)
