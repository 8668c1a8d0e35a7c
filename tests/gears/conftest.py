"""Tooth outlines of all bodies of a set, put where `orientations` says, and their distances.

The distance is measured in polar coordinates of the sun (or ring): arc between a point of the planet and the
side of the nearest tooth. Nothing of the theory of gearing goes into it but the shape of one tooth.
"""

from functools import lru_cache

import numpy as np
import pytest

from femgear.gears.kinematics import orientations
from femgear.gears.tooth import half_sector


@lru_cache(maxsize=64)
def profile(gear):
    """Radius and polar angle of the half tooth from the tip along flank and fillet, dense."""
    curves = dict(half_sector(gear, flank_elements=1000).curves)
    curves["fillet"] = half_sector(gear, refine=20.0).curve("fillet")
    order = ("fillet", "flank", "tip") if gear.internal else ("tip", "flank", "fillet")
    points = np.vstack([curves[name] for name in order])
    return np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])


def facing(gear, orientation, points, side):
    """Arcs [m] from one side (1 left, -1 right) of the gear's nearest teeth to points about its centre."""
    radius, half = profile(gear)
    order = np.argsort(radius)
    r, pitch = np.abs(points), gear.pitch_angle
    local = side * ((np.angle(points) - orientation + 0.5 * pitch) % pitch - 0.5 * pitch)
    low, high = sorted((gear.tip_radius, gear.root_radius))
    inside = (r >= low) & (r <= high) & (local > 0)
    width = np.interp(r[inside], radius[order], half[order])
    return r[inside] * (local[inside] - width)


def planet_sides(s, n, state, direction):
    """Left and right sides of the nine planet teeth nearest to a direction, about the common centre."""
    radius, half = profile(s.planet)
    first = round((direction - state.planets[n]) / s.planet.pitch_angle) - 4
    turned = s.planet.pitch_angle * (first + np.arange(9))[:, None] + state.planets[n]
    centre = s.centre_distance * np.exp(1j * s.planet_angles[n])
    return [(centre + radius * np.exp(1j * (turned + side * half))).ravel() for side in (1.0, -1.0)]


@pytest.fixture
def arcs_to_tooth():
    """Function ``facing(gear, orientation, points, side)``."""
    return facing


@pytest.fixture
def mesh_gaps():
    """Function: smallest signed arcs (loaded sides, back sides) for sun and ring of each planet."""

    def gaps(s, position):
        state, rows = orientations(s, position), []
        for n in range(s.n_planets):
            psi = s.planet_angles[n]
            # loaded: left of the sun on left of the planet, right of the planet on left of the ring
            left, right = planet_sides(s, n, state, psi + np.pi)
            back_ring, on_ring = planet_sides(s, n, state, psi)
            meshes = ((s.sun, state.sun, left, right), (s.ring, state.ring, on_ring, back_ring))
            for gear, turn, loaded, back in meshes:
                rows.append([np.min(facing(gear, turn, loaded, 1.0)), np.min(facing(gear, turn, back, -1.0))])
        return np.array(rows)

    return gaps
