"""What rotations and mirrors make of records that are written down."""

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femgear.contact.mapped_cycle import AXES, in_slots, mapped_members, rotation_matrix, same_pairs, seen_from_front
from femgear.contact.mesh_cycle import Between, MeshCycle

LENGTHS = {"g": 2, "m": 4, "s": 2, "n": 2, "t": 3, "c": 5, "w": 1}
NAMES = ("sun: x", "sun: y", "planet 1: x", "planet 1: y", "planet 2: x", "planet 2: y", "sun: turn")
# meshes: sun with planets 1 and 2, ring with planets 1 and 2; the first planet stands at 30 degrees
GEARS: Any = SimpleNamespace(planet_angles=(np.pi / 6, 5.0), moved_meshes=lambda planet: np.r_[planet, planet + 2])


def numbers(*shape: int) -> np.ndarray:
    """Numbers that are all different."""
    return 1.0 + np.arange(np.prod(shape, dtype=int), dtype=float).reshape(shape)


def record() -> MeshCycle:
    """Two planets, two pairs a mesh, at three positions."""
    arrays = {name: numbers(*(LENGTHS[axis] for axis in axes)) for axes, names in AXES.items() for name in names}
    arrays |= {
        "position": np.array([0.0, 0.25, 0.5]),
        "bearing_force": numbers(2, 2, 3),
        "member_motion": numbers(7, 3),
    }
    given: dict[str, Any] = {field.name: None for field in fields(MeshCycle)}
    given |= arrays | {"member_names": NAMES, "periods": 1, "alike": 1}
    return MeshCycle(**given)


def between() -> Between:
    """One position more, of mesh 2 in particular."""
    of_meshes = ("deflection", "stiffness", "max_pressure", "pressed_path", "pressed_load")
    given: dict[str, Any] = {name: numbers(4, 2) for name in of_meshes} | {"load_share": numbers(2, 2)}
    given |= {"position": np.array([0.1, 0.3]), "sun_arc": numbers(2), "looked": np.array([True, False])}
    return Between(**given, records=(), doubt=0.0)


def test_the_mirror_image_has_the_other_planet_the_other_pair_and_the_other_way():
    """Its planets stand the other way round, its time runs back, and paths are counted from the other end."""
    cycle = replace(record(), between=between())
    image = seen_from_front(cycle, GEARS, np.array([1, 0]))
    assert image.position.tolist() == [-0.5, -0.25, 0.0]
    # planet 1 is what planet 2 was, at the ring too
    assert np.array_equal(image.force, cycle.force[[1, 0, 3, 2]][:, ::-1])
    assert np.array_equal(image.path, -cycle.path[[1, 0, 3, 2]][:, ::-1, ::-1])
    assert np.array_equal(image.tooth, -cycle.tooth[:, [1, 0, 3, 2], ::-1])
    assert np.array_equal(image.tooth_load, cycle.tooth_load[[1, 0, 3, 2]][:, ::-1, ::-1])
    assert image.between is not None
    assert image.between.position.tolist() == [-0.3, -0.1] and image.between.looked.tolist() == [False, True]
    assert np.array_equal(image.between.pressed_path, -between().pressed_path[[1, 0, 3, 2]][:, ::-1])
    assert np.array_equal(image.between.pressed_load, between().pressed_load[[1, 0, 3, 2]][:, ::-1])
    assert np.array_equal(image.between.load_share, between().load_share[[1, 0]][:, ::-1])


def test_vectors_are_mirrored_in_the_line_of_the_first_planet():
    """Across it they turn round, along it they stay; rotations turn round."""
    cycle = record()
    image = seen_from_front(cycle, GEARS, np.array([0, 1]))
    along, across = np.array([np.cos(np.pi / 6), 0.5]), np.array([-0.5, np.cos(np.pi / 6)])
    pairs = [(cycle.bearing_force, image.bearing_force)]
    pairs += [(motion[:6].reshape(3, 2, 3) for motion in (cycle.member_motion, image.member_motion))]
    for before, after in pairs:
        np.testing.assert_allclose(along @ after[:, :, ::-1], along @ before, rtol=1e-13)
        np.testing.assert_allclose(across @ after[:, :, ::-1], -(across @ before), rtol=1e-13, atol=1e-12)
    assert np.array_equal(image.member_motion[6], -cycle.member_motion[6, ::-1])


def test_members_turn_and_planets_change_places():
    vectors, rest = mapped_members(NAMES, numbers(7, 1), np.array([1, 0]), rotation_matrix(np.pi / 2))
    # a quarter of a turn makes (x, y) to (-y, x); planet 1 is where planet 2 was
    assert vectors[:, 0] == pytest.approx([-2.0, 1.0, -6.0, 5.0, -4.0, 3.0]) and rest.tolist() == [[7.0]]


def test_pairs_are_followed_through_the_slots():
    """In one base pitch every pair goes on to the next slot: what leaves the last one is in none."""
    path = np.array([[[0.0, 0.01], [0.01, 0.02]]])
    slot = same_pairs(path, np.array([0]), 1, 0.01)
    assert slot.tolist() == [[1, 2]]
    assert in_slots(np.array([[5.0, 6.0]]), slot).tolist() == [[6.0, 0.0]]
