"""Gears: involute relations, exact teeth, planetary sets (pure NumPy)."""

from femgear.gears.gear import (
    BasicRack,
    Gear,
    PinionCutter,
    half_thickness_angle,
    roll_length,
    tooth_thickness,
)
from femgear.gears.planetary import (
    PlanetarySet,
    Speeds,
    Torques,
    close_set,
    equal_planet_angles,
    orientations,
    speeds,
    torques,
)
from femgear.gears.tooth import HalfSector, half_sector

__all__ = [
    "BasicRack",
    "Gear",
    "HalfSector",
    "PinionCutter",
    "PlanetarySet",
    "Speeds",
    "Torques",
    "close_set",
    "equal_planet_angles",
    "half_sector",
    "half_thickness_angle",
    "orientations",
    "roll_length",
    "speeds",
    "tooth_thickness",
    "torques",
]
