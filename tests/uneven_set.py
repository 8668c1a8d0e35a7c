"""A set of three planets whose angles, pressure angles and mesh stiffnesses all differ; its radii close."""

import math

import numpy as np

_SUN_SIDE, _RING_SIDE = math.radians(24.0), math.radians(18.0)
_PLANET = 0.1 * math.cos(_SUN_SIDE) - 0.04
ANGLES = np.array([0.3, 1.9, 4.1])
UNEVEN = {
    "planet_angles": ANGLES,
    "sun_radius": 0.04,
    "planet_radius": _PLANET,
    "ring_radius": _PLANET + 0.1 * math.cos(_RING_SIDE),
    "centre_distance": 0.1,
    "pressure_angle_sun_planet": _SUN_SIDE,
    "pressure_angle_planet_ring": _RING_SIDE,
    "stiffness_sun_planet": [4e8, 5e8, 6e8],
    "stiffness_planet_ring": [7e8, 3e8, 5e8],
}
