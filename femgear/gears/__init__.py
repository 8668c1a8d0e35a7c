"""Gears: involute relations, exact teeth, planetary sets (pure NumPy)."""

from femgear.gears.checks import check_set
from femgear.gears.gear import Gear, GeometryWarning, half_thickness_angle, roll_length, tooth_thickness
from femgear.gears.kinematics import Orientations, Speeds, Torques, orientations, speeds, torques
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.profile import BasicRack, PinionCutter
from femgear.gears.tooth import HalfSector, half_sector

__all__ = [
    "BasicRack",
    "Gear",
    "GeometryWarning",
    "HalfSector",
    "Orientations",
    "PinionCutter",
    "PlanetarySet",
    "Speeds",
    "Torques",
    "check_set",
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
