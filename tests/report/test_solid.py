"""The set in space: paths of contact on lines that touch the base circles, between the tip circles."""

import math
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.report.solid import _paths
from femgear.trains.reading import read_case

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"


def test_paths_of_contact():
    s = planetary_set(read_case(CASE))
    found = 1e-3 * np.array(_paths(s)).reshape(2, s.n_planets, 2, 2)
    for n, psi in enumerate(s.planet_angles):
        pin = s.centre_distance * np.array([math.cos(psi), math.sin(psi)])
        for (first, last), base in zip(found[:, n], (s.sun.base_radius, s.ring.base_radius)):
            direction = (last - first) / math.dist(first, last)
            for centre, radius in ((0.0, base), (pin, s.planet.base_radius)):
                aside = first - centre
                distance = abs(aside[0] * direction[1] - aside[1] * direction[0])
                assert distance == pytest.approx(radius, rel=1e-4)
        # planet tip to sun tip, ring tip to planet tip
        (a, b), (c, d) = found[:, n]
        tips = (a - pin, s.planet), (b, s.sun), (c, s.ring), (d - pin, s.planet)
        for place, gear in tips:
            assert math.hypot(*place) == pytest.approx(gear.tip_radius, rel=1e-4)
