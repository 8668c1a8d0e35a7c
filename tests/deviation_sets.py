"""Sets whose deviations the tests look at."""

import math

from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles

ALPHA = math.radians(20.0)
UM = 1e-6


def make_set(teeth=(27, 40, 108), planets=3, *, backlash=0.0) -> PlanetarySet:
    """Set of module 1.5 mm and pressure angle 20 deg; 27/40/108 at a centre distance of 51 mm."""
    sizes = {"sun": 9e-3, "planet": 15e-3, "ring": 0.1}
    gears = [
        Gear(
            z,
            1.5e-3,
            ALPHA,
            0.0,
            0.025,
            size,
            internal=name == "ring",
            thickness_allowance=backlash / 2,
            name=name,
        )
        for z, (name, size) in zip(teeth, sizes.items())
    ]
    distance = 51e-3 if teeth == (27, 40, 108) else None
    return close_set(
        *gears,
        planet_angles=equal_planet_angles(planets),
        centre_distance=distance,
        find=("sun", "ring") if distance else ("ring",),
    )


SET = make_set()
PLAY = make_set(backlash=60 * UM)
