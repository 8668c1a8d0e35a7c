"""A support that is none leaves the level of the ring on its foundation, whatever set runs around in it.

A support changes the level in proportion to its stiffness, near a mode up to 160 times as much (set 21), and
single lines more: one that is of a short, stiff wave alone moves the long, soft ones through the support (set
12: 1e-7 changes a line of 6e-5 of the largest by 0.4 %). The limit of no stiffness is therefore taken, from a
support and one of twice its stiffness.
"""

import numpy as np
import pytest
from random_sets import random_set

from femgear.case.sections import face_width
from femgear.housing.two_way.response import structure_lines
from femgear.stages.static import solve_static
from femgear.trains.elastic import stages
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.reading import with_values

FEW = {
    "static.positions": 16,
    "static.flank_elements": 6,
    "static.stresses": False,
    "runup.count": 0,
    "dynamics.mesh_harmonics": 6,
    "dynamics.response_harmonics": 12,
    "dynamics.damping_ratio": 0.04,
    "dynamics.up_to": None,
    "housing.support": None,
}
# five planets out of phase, whose lines of 15 and more nodal diameters carry the level
SHOWN = 10
NONE = 1e-7
"""Stiffness of the support over that of the whole foundation."""


@pytest.mark.parametrize(
    "seed", [seed if seed == SHOWN else pytest.param(seed, marks=pytest.mark.slow) for seed in range(29)]
)
def test_a_support_that_is_none_changes_nothing(seed, monkeypatch):
    monkeypatch.setattr(stages, "excitation_end", lambda case, modes, heard, f, *_: (modes.reach, 1.0, 0 * f))
    case = random_set(seed).case
    case = with_values(case, FEW | {"operation.speeds": [f"{case.operation.speeds[-1]} rad/s"]})
    ring = case.ring
    foundation = ring.foundation_radial * 2 * np.pi * ring.outer_radius * face_width(case, "ring")
    ways = "radial_stiffness", "tangential_stiffness"
    static = solve_static(case)
    modes = solve_modes(case, static)
    alone = solve_housing(case, solve_dynamics(case, static, modes)).dataset()
    level, lines = list[np.ndarray](), list[np.ndarray]()
    for part in (NONE, 2.0 * NONE):
        support = {"angle": "40 deg", **dict.fromkeys(ways, f"{part * foundation} N/m")}
        held = with_values(case, {"housing.support": [support]})
        dynamics = solve_dynamics(held, static, modes)
        found = solve_housing(held, dynamics).dataset()
        level.append(found["level"].values)
        lines.append(changes_of_lines(dynamics.fixed))
    np.testing.assert_allclose(2.0 * level[0] - level[1], found["one_way_level"], rtol=1e-6)
    assert np.abs(2.0 * lines[0] - lines[1]).max() < 1e-6
    # the dynamics in the frame of the carrier leave out the inertia of waves that run around
    np.testing.assert_allclose(found["level"], alone["level"], rtol=0.03)


def changes_of_lines(fixed) -> np.ndarray:
    """Changes of the acceleration of a sensor by the support, over its largest line; lines by both routes."""
    structure = fixed.structure.combined(np.eye(fixed.structure.sensor_shape.shape[1])[:, :1])
    (order, moved), (orders_alone, alone) = (
        structure_lines(structure, response) for response in (fixed.two_way, fixed.one_way)
    )
    before = np.zeros(len(order), complex)
    before[np.searchsorted(order, orders_alone)] = alone[0, 0]
    return (moved[0, 0] - before) * order**2 / (np.abs(before) * order**2).max()
