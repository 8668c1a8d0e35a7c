"""Steps of linear meshes: two at a time as one by one, and forces that solve their own equation."""

import numpy as np
import pytest
from published.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain

from femgear.trains.drivetrain.integrator import ChainScheme, MeshBlock, Spin, march_closed, march_pairs
from femgear.trains.drivetrain.model import drivetrain_model
from femgear.trains.drivetrain.parts import constant_torques

COUNT = 601


@pytest.fixture(scope="module")
def steps():
    """Model, scheme, the instants of some hundred steps, and their matrices."""
    model = drivetrain_model(wind_turbine_drivetrain())
    spin = Spin(model, constant_torques(paper_torques(balanced=True)), 5e-5, PRINTED.speed)
    scheme = ChainScheme.of(model, 5e-5, PRINTED.speed, spin.directions)
    block = spin.block(0, COUNT)
    return model, scheme, block, MeshBlock.of(scheme, block, len(model.meshes))


def test_mesh_forces_solve_their_equation(steps):
    """g = S k S^T (x - F g) for any motion x without the forces."""
    _, scheme, block, meshes = steps
    for i in (0, 255, 256, COUNT - 1):
        x = np.random.default_rng(i).normal(size=len(scheme.flexibility))
        forces = x @ meshes.closed[i]
        S, k = block.selection[i + 1], block.stiffness[i + 1]
        expected = S @ (k * (S.T @ (x - scheme.flexibility @ forces)))
        np.testing.assert_allclose(forces, expected, rtol=0.0, atol=1e-10 * np.abs(forces).max())


@pytest.mark.parametrize("count", [1, 2, 63, 258, COUNT])
def test_two_steps_at_a_time_are_the_same_steps(steps, count):
    _, scheme, block, meshes = steps
    loads = block.loads[:-1] @ scheme.loads_before + block.loads[1:] @ scheme.loads_after
    one_by_one, paired = np.zeros((2, COUNT + 1, 2, len(scheme.advance)))
    one_by_one[0, 1] = paired[0, 1] = np.random.default_rng(1).normal(size=len(scheme.advance))
    march_closed(scheme, meshes, loads, one_by_one, range(count))
    march_pairs(scheme, meshes, loads, paired, range(count))
    scale = np.abs(one_by_one).max(axis=0)
    assert (np.abs(paired[:, 0] - one_by_one[:, 0]) <= 1e-11 * scale[0]).all()
    # the free motion at the end of every pair, and at the last step
    ends = [*range(0, count + 1, 2), count]
    assert (np.abs(paired[ends, 1] - one_by_one[ends, 1]) <= 1e-11 * scale[1]).all()
