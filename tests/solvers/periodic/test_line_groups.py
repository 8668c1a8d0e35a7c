"""Groups of lines that turning directions couple: exact where stiffnesses are constant, a start for GMRES else."""

import numpy as np
import pytest

from femgear.solvers.periodic.equations import harmonic_balance, linearised
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.line_groups import line_groups
from femgear.system.force_laws import turning_wave
from femgear.system.fourier import FourierSeries, constant, side_bands
from femgear.system.system import MechanicalSystem, NonlinearSystem
from femgear.system.turning_meshes import TurningMeshes

FREQUENCY = np.array([30.0, 410.0])


def problem(share: float) -> NonlinearSystem:
    """Three masses on springs with two flanks that turn with the first base; stiffness goes by the second."""
    fixed, even, odd = np.random.default_rng(3).normal(size=(3, 2, 3))
    k = FourierSeries(1e5 * np.array([[3.0, share], [2.0, 1j * share]]), (0, 1))
    columns, gap = np.tile([0, 1, 2], (2, 1)), constant([1e-4, 2e-4])
    flanks = TurningMeshes(columns, fixed, even, odd, turning_wave((1, 0)), k, gap)
    C, K = 40.0 * np.eye(3) + 9.0 * np.ones((3, 3)), 1e5 * np.diag([1.0, 2.0, 4.0])
    load, names = np.array([3.0, 5.0, -2.0]), ("x", "y", "z")
    return NonlinearSystem(MechanicalSystem(np.eye(3), C, K, np.eye(3), load, names), (flanks,))


@pytest.mark.parametrize("bands", [(2, 2, 2), (3, 1, 3)])
def test_groups_solve_the_equations_of_a_constant_stiffness(bands):
    balance = harmonic_balance(problem(0.0), orders=side_bands(*bands))
    receptance, y = balance.receptance_at(FREQUENCY), np.random.default_rng(1).normal(size=balance.size)
    tangent = linearised(balance, receptance, y)[1]
    assert balance.turning_bases == [0]
    groups = line_groups(balance.grid, [0], balance.pairs, receptance[:, :, :3], tangent.stiffness)
    # one of the means, and one of every mesh harmonic
    assert len(groups.members) == 1 + bands[1] and np.iscomplexobj(groups.factors[-1][0])
    solved = balance.unknowns(groups.solve(balance.lines(y)))
    np.testing.assert_allclose(solved + tangent.fixed_point(solved), y, rtol=0.0, atol=1e-11 * np.abs(y).max())


def test_many_lines_need_few_products_and_have_the_motion_of_few_unknowns(monkeypatch):
    orders, moving = side_bands(5, 6, 5), problem(0.8)
    direct = solve_harmonic_balance(moving, FREQUENCY, orders=orders, stability=False, radius=False)
    monkeypatch.setattr("femgear.solvers.periodic.harmonic_balance.MANY", 1)
    monkeypatch.setattr("femgear.solvers.periodic.equations._PRODUCTS", 25)
    monkeypatch.setattr("femgear.solvers.periodic.equations.HarmonicBalance.jacobian", None)
    found = solve_harmonic_balance(moving, FREQUENCY, orders=orders, stability=False, radius=False)
    assert found.converged and direct.converged
    np.testing.assert_allclose(
        found.deflection, direct.deflection, rtol=0.0, atol=1e-9 * np.abs(direct.deflection).max()
    )
