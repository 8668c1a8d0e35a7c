"""Steps of linear meshes: two at a time as one by one, forces that solve their own equation; contacts that touch."""

import numpy as np
import pytest
from two_wheels import two_wheels

from femgear.solvers.time import flank_steps
from femgear.solvers.time.flank_steps import FlankScheme, MeshBlock, march_closed, march_pairs, solve_overlaps
from femgear.solvers.time.free_turn import FreeTurn, TorqueHistory

COUNT = 601


@pytest.fixture(scope="module", params=[0.0, np.array([2e-6, 3e-6j])])
def steps(request):
    """Scheme, the instants of some hundred steps, and their matrices; without gaps and with some that vary."""
    spun = two_wheels(harmonics=3, damping=0.01, gap=request.param).spun
    turn = FreeTurn(spun, [(TorqueHistory("a", [0.0, 0.01], [10.0, 90.0]), np.array([1.0, 0.0]))], 5e-5, 30.0)
    scheme = FlankScheme.of(spun, 5e-5, turn.directions)
    block = turn.block(0, COUNT)
    return scheme, block, MeshBlock.of(scheme, block, spun.closed)


def test_mesh_forces_solve_their_equation(steps):
    """g = S k (S^T (x - F g) - gap) for any motion x without the forces."""
    scheme, block, meshes = steps
    for i in (0, 255, 256, COUNT - 1):
        x = 1e-5 * np.random.default_rng(i).normal(size=len(scheme.flexibility))
        forces = x @ meshes.closed[i] - (0.0 if meshes.given is None else meshes.given[i])
        S, k, gap = block.selection[i + 1], block.stiffness[i + 1], block.gap[i + 1]
        expected = S @ (k * (S.T @ (x - scheme.flexibility @ forces) - gap))
        np.testing.assert_allclose(forces, expected, rtol=0.0, atol=1e-10 * np.abs(forces).max())


@pytest.mark.parametrize("count", [1, 2, 63, 258, COUNT])
def test_two_steps_at_a_time_are_the_same_steps(steps, count):
    scheme, block, meshes = steps
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


def brute_force(flexibility, free, k):
    """All 2^n sets of contacts; those that fit."""
    n = len(k)
    closed = np.arange(2**n)[:, None] // 2 ** np.arange(n) % 2 == 1
    slope = np.where(closed, k, 0.0)
    u = np.linalg.solve(np.eye(n) + flexibility * slope[:, None, :], np.tile(free, (2**n, 1))[..., None])[..., 0]
    return u[np.where(closed, u >= 0.0, u < 0.0).all(axis=1)]


@pytest.mark.parametrize("skew", [0.0, 1.0])
def test_contacts_against_all_there_are(skew, monkeypatch):
    """Flexibilities with and without a skew part, of full and low rank: one solution, found on both ways."""
    random = np.random.default_rng(3)
    for trial in range(60):
        n = 7
        root, turn = random.standard_normal((2, n, n))
        root[:, 2 + trial % 6 :] = 0.0
        G = root @ root.T + skew * (turn - turn.T)
        k, free = 10.0 ** random.uniform(-1, 2, n), random.standard_normal(n)
        (wanted,) = brute_force(G, free, k)
        size, first = np.abs(free).max() + np.abs(wanted).max(), random.integers(0, 2, n) == 1
        assert np.abs(solve_overlaps(G, free, first, k)[0] - wanted).max() < 1e-9 * size
        with monkeypatch.context() as patch:
            patch.setattr(flank_steps, "_ROUNDS", 0)
            assert np.abs(solve_overlaps(G, free, first, k)[0] - wanted).max() < 1e-9 * size
