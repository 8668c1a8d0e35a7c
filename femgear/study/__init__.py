"""Studies of a case: design maps, derivatives, optimisation, sweeps.

Transmission error over torque and relief, as-built samples and the derivatives of both start from
gears and their compliances; searches, Pareto fronts and sweeps change entries of the case file.
"""

from femgear.study.front import pareto_front
from femgear.study.objectives import (
    contact_pressure,
    contact_ratio,
    housing_level,
    mesh_force,
    natural_frequency,
    root_stress,
    tip_thickness,
    transmission_error,
)
from femgear.study.problem import Limit, Problem, Variable, tip_reliefs
from femgear.study.search import Optimum, SearchOptions, minimise

__all__ = [
    "Limit",
    "Optimum",
    "Problem",
    "SearchOptions",
    "Variable",
    "contact_pressure",
    "contact_ratio",
    "housing_level",
    "mesh_force",
    "minimise",
    "natural_frequency",
    "pareto_front",
    "root_stress",
    "tip_reliefs",
    "tip_thickness",
    "transmission_error",
]
