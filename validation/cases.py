"""The reference set of the modulation paper through the whole pipeline, computed once for all tables."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femgear.case.planetary import Case
    from femgear.fe.elasticity import Material
    from femgear.stages.static_results import StaticResult
    from femgear.trains.elastic.results import DynamicsResult, HousingResult, ModesResult

PAPER = "modulation paper"

# the entries of cases/modulation_paper.toml, which an installed package does not carry
CASE = """
format = 1
title = "Planetary set 27/40/108"
set = { planets = 3, centre_distance = "51 mm", face_width = "25 mm" }
rack = { addendum = 1.0, dedendum = 1.25, root_radius = 0.25 }
material.youngs_modulus = "206 GPa"
material.poisson_ratio = 0.3
material.density = "7850 kg/m^3"
material.treatment = "case hardened steel"
material.hardness = 700
carrier = { mass = "3 kg", inertia = "6e-3 kg m^2", support_stiffness = "2e8 N/m" }
motor = { inertia = "0.02 kg m^2", coupling_stiffness = "400 N m/rad" }
brake = { inertia = "0.2 kg m^2", coupling_stiffness = "5000 N m/rad" }
static = { positions = 64, contact = "profile" }
dynamics = { damping_ratio = 0.05, mesh_harmonics = 6, response_harmonics = 18, tolerance = 1e-6 }
housing = { form = "linear", points = 54, sensor_angle = "0 deg" }

[sun]
teeth = 27
module = "1.5 mm"
pressure_angle = "20 deg"
profile_shift = 0.52681
tip_diameter = "45.08043 mm"
bore_radius = "9 mm"
mass = "0.22 kg"
inertia = "1e-4 kg m^2"
support_stiffness = "5e7 N/m"

[planet]
teeth = 40
profile_shift = 0.0
tip_diameter = "63 mm"
bore_radius = "18 mm"
mass = "0.355 kg"
inertia = "2.17e-4 kg m^2"
bearing_stiffness = "3e8 N/m"

[ring]
teeth = 108
profile_shift = 0.0
outer_radius = "100 mm"
cutter_teeth = 30
foundation_radial = "1e10 N/m^3"
foundation_tangential = "1e10 N/m^3"
material = { treatment = "through hardened alloy steel", hardness = 300 }

[operation]
input = "sun"
fixed = "ring"
torque = "100 N m"
speeds = ["250 rpm", "3100 rpm"]
"""


@cache
def reference_case() -> Case:
    """The case of the reference set."""
    from femgear.trains.reading import parse_case

    return parse_case(CASE, name="reference set")


def reference_material() -> Material:
    """Material of the gears of the reference set."""
    from femgear.case.gear_set import material_of

    return material_of(reference_case(), "ring")


@cache
def reference_static() -> StaticResult:
    """Static solution, 64 positions."""
    from femgear.stages.static import solve_static

    return solve_static(reference_case())


@cache
def reference_modes() -> ModesResult:
    """Modal basis."""
    from femgear.trains.elastic.stages import solve_modes

    return solve_modes(reference_case(), reference_static())


@cache
def reference_dynamics() -> DynamicsResult:
    """Response at 250 and 3100 rpm."""
    from femgear.trains.elastic.stages import solve_dynamics

    return solve_dynamics(reference_case(), reference_static(), reference_modes())


@cache
def reference_housing() -> HousingResult:
    """What the fixed sensor hears at 250 and 3100 rpm."""
    from femgear.trains.elastic.stages import solve_housing

    return solve_housing(reference_case(), reference_dynamics())
