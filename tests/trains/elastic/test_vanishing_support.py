"""A support that is none leaves the level of the ring on its foundation, whatever set runs around in it."""

import numpy as np
import pytest
from random_sets import random_set

from femgear.case.sections import face_width
from femgear.trains.elastic import stages
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.reading import with_values
from femgear.trains.static.stages import solve_static

FEW = {
    "static.positions": 16, "static.flank_elements": 6, "static.stresses": False, "runup.count": 0,
    "dynamics.mesh_harmonics": 6, "dynamics.response_harmonics": 12, "dynamics.damping_ratio": 0.04,
    "dynamics.up_to": None, "housing.support": None,
}  # fmt: skip
# five planets out of phase, whose lines of 15 and more nodal diameters carry the level
SHOWN = 10


@pytest.mark.parametrize(
    "seed", [seed if seed == SHOWN else pytest.param(seed, marks=pytest.mark.slow) for seed in range(29)]
)
def test_a_support_that_is_none_changes_nothing(seed, monkeypatch):
    monkeypatch.setattr(stages, "excitation_end", lambda case, modes, heard, f, c: (modes.reach, 1.0, 0 * f))
    case = random_set(seed).case
    case = with_values(case, FEW | {"operation.speeds": [f"{case.operation.speeds[-1]} rad/s"]})
    ring = case.ring
    stiffness = 1e-7 * ring.foundation_radial * 2 * np.pi * ring.outer_radius * face_width(case, "ring")
    ways = "radial_stiffness", "tangential_stiffness"
    nothing = {"angle": "40 deg", **dict.fromkeys(ways, f"{stiffness} N/m")}
    static = solve_static(case)
    modes = solve_modes(case, static)
    held = with_values(case, {"housing.support": [nothing]})
    alone, found = (solve_housing(one, solve_dynamics(one, static, modes)).dataset() for one in (case, held))
    np.testing.assert_allclose(found["level"], found["one_way_level"], rtol=1e-6)
    # the dynamics in the frame of the carrier leave out the inertia of waves that run around
    np.testing.assert_allclose(found["level"], alone["level"], rtol=0.03)
