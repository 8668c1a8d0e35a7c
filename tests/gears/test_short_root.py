"""A root arc too short for an edge of its own belongs to the fillet."""

import math

import numpy as np
import pytest

from femgear.gears.gear import BasicRack, Gear
from femgear.gears.tooth import SHORTEST_ROOT, half_sector


@pytest.mark.parametrize("rounding", [0.4719, 0.466, 0.462])
def test_the_fillet_ends_on_the_root_circle_at_the_cut(rounding):
    """Towards the cut its points turn on, outside the root circle or on it."""
    gear = Gear(30, 1e-3, math.radians(20.0), 0.1, 1e-2, 5e-3, rack=BasicRack(1.0, 1.25, rounding))
    corner = float(gear.tool.fillet_point(0.0)[1])
    assert 0.0 <= (math.pi / gear.teeth - corner) * gear.root_radius < SHORTEST_ROOT * gear.module
    points = dict(half_sector(gear, flank_elements=8).curves)["fillet"]
    radius, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    end = np.array([gear.root_radius, math.pi / gear.teeth])
    assert sorted([(radius[0], angle[0]), (radius[-1], angle[-1])])[0] == pytest.approx(tuple(end), rel=1e-12)
    assert radius.min() > gear.root_radius * (1 - 1e-6) and angle.max() <= end[1] * (1 + 1e-12)
    assert np.all(np.diff(angle) > 0) or np.all(np.diff(angle) < 0)
