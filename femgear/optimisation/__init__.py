"""Optimisation over entries of the case file: objectives, limits, searches, Pareto fronts, sweeps."""

from femgear.case import with_values
from femgear.optimisation.names import NAMES, named_quantity, parse_limit, parse_variable
from femgear.optimisation.objectives import (
    Quantity,
    contact_pressure,
    contact_ratio,
    housing_level,
    mesh_force,
    root_stress,
    tip_thickness,
    transmission_error,
)
from femgear.optimisation.pareto import ParetoFront, pareto_front
from femgear.optimisation.problem import Limit, Problem
from femgear.optimisation.search import METHODS, Optimum, minimise
from femgear.optimisation.sensitivity import Tolerance
from femgear.optimisation.sweep import Sweep, parse_over, sweep
from femgear.optimisation.sweep_files import sweep_into
from femgear.optimisation.variables import Variable

__all__ = [
    "METHODS",
    "NAMES",
    "Limit",
    "Optimum",
    "ParetoFront",
    "Problem",
    "Quantity",
    "Sweep",
    "Tolerance",
    "Variable",
    "contact_pressure",
    "contact_ratio",
    "housing_level",
    "mesh_force",
    "minimise",
    "named_quantity",
    "pareto_front",
    "parse_limit",
    "parse_over",
    "parse_variable",
    "root_stress",
    "sweep",
    "sweep_into",
    "tip_thickness",
    "transmission_error",
    "with_values",
]
