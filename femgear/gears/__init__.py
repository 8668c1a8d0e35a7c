"""Gears: exact teeth, planetary sets, their kinematics, phases and deviations."""

from femgear.gears.checks import check_set
from femgear.gears.deviations import (
    Ovality,
    Runout,
    SetDeviations,
    check_deviations,
    common_period,
    no_deviations,
)
from femgear.gears.gear import Gear, GeometryWarning, half_thickness_angle, roll_length, tooth_thickness
from femgear.gears.kinematics import Orientations, Speeds, Torques, orientations, speeds, torques
from femgear.gears.modifications import (
    FlankForm,
    MeasuredProfile,
    ProfileCrowning,
    ProfileSlope,
    RootRelief,
    TipRelief,
)
from femgear.gears.phasing import (
    MeshPhasing,
    PhasingTable,
    ToothChoices,
    check_teeth,
    mesh_phasing,
    neighbouring_teeth,
    phase_factors,
    phasing_of_set,
    phasing_table,
    standard_lag,
)
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles, feasible_angles
from femgear.gears.profile import BasicRack, PinionCutter
from femgear.gears.tooth import HalfSector, half_sector

__all__ = [
    "BasicRack",
    "FlankForm",
    "Gear",
    "GeometryWarning",
    "HalfSector",
    "MeasuredProfile",
    "MeshPhasing",
    "Orientations",
    "Ovality",
    "PhasingTable",
    "PinionCutter",
    "PlanetarySet",
    "ProfileCrowning",
    "ProfileSlope",
    "RootRelief",
    "Runout",
    "SetDeviations",
    "Speeds",
    "TipRelief",
    "ToothChoices",
    "Torques",
    "check_deviations",
    "check_set",
    "check_teeth",
    "close_set",
    "common_period",
    "equal_planet_angles",
    "feasible_angles",
    "half_sector",
    "half_thickness_angle",
    "mesh_phasing",
    "neighbouring_teeth",
    "no_deviations",
    "orientations",
    "phase_factors",
    "phasing_of_set",
    "phasing_table",
    "roll_length",
    "speeds",
    "standard_lag",
    "tooth_thickness",
    "torques",
]
