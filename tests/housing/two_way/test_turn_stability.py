"""Whether a ring that turns under its supports is stable: both frames, steps of the scheme."""

from typing import Any

import numpy as np
import pytest

from femgear.errors import ConvergenceError
from femgear.housing.two_way.response import MeshPaths
from femgear.housing.two_way.structure import supported_ring
from femgear.housing.two_way.turn_stability import _extrapolated, turn_stability
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.stability.parametric import stability
from validation.fixed_housing import EQUAL, excitation, gears, joined, thin_ring


@pytest.mark.parametrize(
    ("speed", "depth", "ratio"),
    [
        pytest.param(100.0, 0.15, 2e-4, marks=pytest.mark.slow),
        pytest.param(100.0, 0.15, 1e-2, marks=pytest.mark.slow),
        (170.0, 0.4, 2e-4),
    ],
)
def test_a_ring_that_turns_alone_is_the_same_in_both_frames(speed, depth, ratio):
    paths, ring = MeshPaths(37, EQUAL, 0.1, 3), thin_ring(0, foundation=2e10)
    structure = supported_ring(ring, (), max_diameter=0, max_frequency=1e6, damping_ratio=ratio)
    drive = excitation(paths, depth=depth)
    mean, whole = drive.stiffness.mean(axis=1), joined(paths, ring, 0)
    modes, rigid = (undamped_modes(one, mean, damping_ratio=ratio) for one in (whole, gears(EQUAL)))
    kept = {"excitation_harmonics": 2, "frequency_ratio": 1e3, "steps": 400}
    present = stability(modes, drive, 37 * speed / (2 * np.pi), **kept).modulus[0]
    known = {"harmonics": 2, "damping": modal_damping(whole, mean, ratio), "frequency_ratio": 1e3}
    found = turn_stability(rigid, drive, structure, paths, [speed], **known, tolerance=1e-6)
    assert found.modulus[0] == pytest.approx(present**37, rel=1e-5)
    assert found.stable[0] == (depth < 0.2)
    with pytest.raises(ConvergenceError, match="multipliers of a turn"):
        turn_stability(rigid, drive, structure, paths, [speed], **known, tolerance=-1.0)


@pytest.mark.parametrize("grown", [np.inf, 1e30])
def test_steps_in_which_the_scheme_itself_grows_are_left_out(grown):
    """Of second order in the step from 5000 steps on, nothing of the kind before."""

    class Turn:
        def monodromy(self, steps):
            return np.array([[0.5 + 1e6 / steps**2 if steps > 5000 else grown]])

    turn: Any = Turn()
    matrix, steps = _extrapolated(turn, 3000, 1e-3)
    assert steps == 24000 and matrix[0, 0] == pytest.approx(0.5, abs=1e-12)
