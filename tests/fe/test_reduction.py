"""Which modes of a cyclic body come in pairs, and what a basis without the static shape holds."""

import numpy as np
import pytest

from femgear.fe.compliance import boundary_nodes
from femgear.fe.grid import mirror
from femgear.fe.meshing import mesh_outline
from femgear.fe.reduction import CyclicModes, smooth_cut_shapes
from femgear.gears.gear import Gear
from femgear.gears.tooth import half_sector


@pytest.mark.parametrize(("count", "paired"), [(6, [0, 1, 1, 0]), (7, [0, 1, 1, 1]), (2, [0, 0])])
def test_all_but_the_first_and_the_middle_diameter_come_in_pairs(count, paired):
    """cos(n phi) and sin(n phi): the sine is nothing for n = 0, and at all sectors for n = N / 2."""
    n, none = np.arange(len(paired)), np.zeros((1, len(paired)))
    modes = CyclicModes(count, n, n.astype(float), none, none, none, none)
    assert modes.paired.tolist() == [bool(one) for one in paired]
    assert modes.norm == pytest.approx(np.sqrt(np.where(paired, 2, 1) / count))


def test_few_shapes_of_a_cut_are_all_polynomials_up_to_a_degree():
    """On the many nodes of a deep rim: of a polynomial of degree 8 the shapes leave nothing, of degree 9 something."""
    gear = Gear(18, 3e-3, np.deg2rad(20.0), 0.2, 0.02, 4e-3)
    grid = mirror(mesh_outline(half_sector(gear, flank_elements=6)))
    radius = np.sort(np.hypot(*grid.points[boundary_nodes(grid, "cut_left")].T))
    assert len(radius) > 12
    shapes = smooth_cut_shapes(grid, np.ones((len(radius), 1)))
    assert shapes.shape == (len(radius), 9)
    place = (radius - radius.mean()) / np.ptp(radius)
    left = [values - shapes @ (shapes.T @ values) for values in (place**8, place**9)]
    assert np.abs(left[0]).max() < 1e-12 < 1e-6 < np.abs(left[1]).max()
