"""The blocks of one speed do not depend on those of another."""

import numpy as np

from femgear.housing.two_way.response import MeshPaths
from validation.fixed_housing import EQUAL, feet, solved


def test_speeds_do_not_depend_on_one_another():
    paths, speeds = MeshPaths(97, EQUAL, 0.1, 3), np.array([10.0, 25.0, 40.0])
    together = solved(paths, feet(4), speeds, tolerance=1e-13)
    assert together.residual.max() < 1e-12
    for i, speed in enumerate(speeds):
        alone = solved(paths, feet(4), speeds[i : i + 1], tolerance=1e-13).force[0]
        np.testing.assert_allclose(together.force[i], alone, atol=1e-11 * abs(alone).max(), err_msg=str(speed))
