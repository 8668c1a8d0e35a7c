"""How many phases the product of a coefficient and a motion needs."""

import numpy as np

from femgear.solvers.periodic.phase_grid import on_grid, phase_grid, sample_counts
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries
from femgear.system.system import MechanicalSystem, NonlinearSystem


def test_a_stiffness_that_runs_backwards_has_as_many_lines():
    """``(2 + cos 3 theta) cos theta = 2 cos theta + (cos 2 theta + cos 4 theta) / 2`` on lines 0, 1."""
    one, lines = np.eye(1), np.array([[0], [1]])
    system = MechanicalSystem(one, one, one, one, np.zeros(1), ("x",))
    for orders in ((1,), (-1,)):
        mesh = GearMeshes([0], FourierSeries([[2.0, 0.0, 0.0, 1.0]], orders), separates=False)
        grid = phase_grid(lines, sample_counts(NonlinearSystem(system, (mesh,)), lines))
        x = grid.values(np.array([[0.0, 1.0]]))
        force, _ = on_grid(mesh, grid.theta).evaluate(x[:, mesh.columns], grid.theta)
        found = grid.amplitudes(grid.transform(force[:, :, 0]))
        np.testing.assert_allclose(found, [[0.0, 2.0]], atol=1e-13)
