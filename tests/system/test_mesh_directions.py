"""Matrices of a set from its members: what the supports hold."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import kahraman_set, lin_parker_set
from scipy.spatial.transform import Rotation

from femgear.system.assembly import point_approach
from femgear.system.mesh_directions import gear_set_system, set_assembly, station_motions, support_diagonal
from femgear.system.rigid_bodies import body_masses


def test_supports_that_hold_a_motion_are_no_stiffness():
    """A torsional spring acts on ``u = r theta``; of three motions of a body the held ones give nothing."""
    data = lin_parker_set(3)
    free = replace(data.sun, support=2e7, torsional_support=5e5)
    stiff = support_diagonal(replace(data, sun=free))[2]
    np.testing.assert_allclose(stiff, [2e7, 2e7, 5e5 / data.sun_radius**2], rtol=1e-14)
    held = replace(data, sun=replace(free, torsional_support=np.inf), ring=replace(data.ring, support=np.inf))
    assert support_diagonal(held)[2].tolist() == [2e7, 2e7, 0.0]
    assert support_diagonal(held)[1, :2].tolist() == [0.0, 0.0]
    assert len(gear_set_system(held).M) == len(gear_set_system(replace(data, sun=free)).M) - 3


@pytest.mark.parametrize("data", [lin_parker_set(3), kahraman_set()], ids=["plane", "space"])
def test_bodies_have_the_masses_of_their_data_in_the_coordinates_of_the_set(data):
    motions, assembly = station_motions(data), set_assembly(data)
    mass = motions.T @ assembly.mass @ motions
    assert mass == pytest.approx(np.diag(body_masses(data).ravel()), abs=1e-14 * mass.max())
    # what does not move in the plane is held, whatever else moves along
    assert assembly.held.sum() == motions.shape[0] - motions.shape[1]


def test_a_point_moves_with_its_body_as_far_as_its_place_says():
    """A small turn by phi moves the point c by ``phi x c``: its part along the normal is that of the turned point."""
    rng = np.random.default_rng(3)
    normal, points = rng.normal(size=3), rng.normal(size=(4, 3))
    effect, step = point_approach(normal, points), 1e-6
    np.testing.assert_array_equal(effect[:, :3], np.tile(normal, (4, 1)))
    for axis in range(3):
        turned = Rotation.from_rotvec(step * np.eye(3)[axis]).apply(points)
        np.testing.assert_allclose(effect[:, 3 + axis], (turned - points) @ normal / step, rtol=1e-5)
