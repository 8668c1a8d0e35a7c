"""Passes of the damping: whatever waits and however it is swept, forces are the same at the end."""

import numpy as np
import pytest

from femgear.housing.two_way import damping_passes
from femgear.housing.two_way.damping_passes import _largest, _shares
from femgear.housing.two_way.response import MeshPaths, solve_two_way
from femgear.housing.two_way.structure import supported_ring
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from validation.fixed_housing import EQUAL, FEET, excitation, gears, joined, thin_ring

pytestmark = pytest.mark.usefixtures("coarse_states")


def solved(symmetry):
    """A set on four feet at two speeds, with the damping of gears and ring together."""
    ring, paths = thin_ring(4, foundation=2e10), MeshPaths(97, EQUAL, 0.1, symmetry)
    structure = supported_ring(ring, FEET, max_diameter=4, max_frequency=1e6, damping_ratio=0.04)
    drive = excitation(paths)
    mean = drive.stiffness.mean(axis=1)
    damping = modal_damping(joined(paths, ring, 4), mean, 0.04)
    modes = undamped_modes(gears(EQUAL), mean, damping_ratio=0.04)
    known = {"harmonics": (2, 4), "damping": damping}
    return solve_two_way(modes, drive, structure, paths, np.array([8.0, 30.0]), **known)


WAYS = {
    "extrapolated as one": {"_SLOW": -1.0},
    "no sweeps": {"_SWEEPS": 0},
    "settled": {"_SWEEPS": 30, "_UNSETTLED": 1e-6},
    "most blocks wait": {"_WAITING": 0.9},
    "nothing is expected": {"_EXPECTED": 1e-9},
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("symmetry", [1, 3])
def test_forces_do_not_depend_on_how_they_are_found(monkeypatch, way, symmetry):
    usual = solved(symmetry)
    for name, value in WAYS[way].items():
        monkeypatch.setattr(damping_passes, name, value)
    found = solved(symmetry)
    assert found.residual.max() < 1e-10
    # what is accurate to 1e-10 are mesh forces, hundred times those of the damping
    for one, other, accuracy in ((found.force, usual.force, 1e-9), (found.drag, usual.drag, 1e-8)):
        np.testing.assert_allclose(one, other, rtol=0, atol=accuracy * np.abs(other).max())


def test_shares_make_the_change_of_every_block_least():
    rng = np.random.default_rng(5)
    changes = rng.normal(size=(3, 2, 4, 5)) + 1j * rng.normal(size=(3, 2, 4, 5))
    share = _shares(changes, np.array([1, 2, 3, 9]), False)
    np.testing.assert_allclose(share.sum(axis=0), 1.0)
    assert share[:, 0].tolist() == [1.0, 0.0, 0.0] and share[2, 1] == 0.0
    left = np.einsum("nb,njbr->jbr", share, changes)
    for block, steps in ((1, [1]), (2, [1, 2]), (3, [1, 2])):
        for step in steps:
            apart = (changes[0] - changes[step])[:, block]
            assert abs(np.vdot(apart, left[:, block]).real) < 1e-12
    one = _shares(changes, np.full(4, 3), True)
    left = np.einsum("nb,njbr->jbr", np.broadcast_to(one, (3, 4)), changes)
    assert np.ptp(one, axis=1).max() == 0.0
    assert max(abs(np.vdot(changes[0] - changes[i], left).real) for i in (1, 2)) < 1e-12


def test_what_may_wait_is_below_the_limit_together():
    values = np.array([3.0, 0.1, 4.0, 0.1])
    assert _largest(values, 0.2).tolist() == [0, 2]
    assert _largest(values, 0.14).tolist() == [0, 2, 3] or _largest(values, 0.14).tolist() == [0, 1, 2]
    assert not len(_largest(values, 6.0))
