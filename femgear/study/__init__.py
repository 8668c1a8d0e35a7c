"""Studies of a case: design maps, derivatives, optimisation, sweeps.

Transmission error over torque and relief, load sharing over pin errors and the derivatives of both start from
gears and their compliances; searches, Pareto fronts and sweeps change entries of the case file.
"""

from femgear.study.designs import Tolerance
from femgear.study.front import ParetoFront, pareto_front
from femgear.study.objectives import (
    NAMES,
    Quantity,
    contact_pressure,
    contact_ratio,
    housing_level,
    mesh_force,
    named_quantity,
    root_stress,
    tip_thickness,
    transmission_error,
)
from femgear.study.problem import Limit, Problem, Variable, parse_limit, parse_variable, tip_reliefs
from femgear.study.relief import (
    DesignBasis,
    HarrisMap,
    ReliefGrid,
    ReliefOptimum,
    design_basis,
    harris_map,
    optimise_relief,
    relief_grid,
    relief_starts,
    two_pair_length,
    with_tip_relief,
)
from femgear.study.search import METHODS, Optimum, SearchOptions, minimise
from femgear.study.sensitivity import (
    LinearContact,
    Sensitivity,
    linearise,
    pin_sensitivities,
    sensitivity,
)
from femgear.study.sharing import (
    Sharing,
    SharingModel,
    pin_samples,
    sharing_model,
    sharing_of_samples,
    walked_shares,
)
from femgear.study.sweep import Sweep, parse_over, sweep, sweep_into
from femgear.trains.reading import with_values

__all__ = [
    "METHODS",
    "NAMES",
    "DesignBasis",
    "HarrisMap",
    "Limit",
    "LinearContact",
    "Optimum",
    "ParetoFront",
    "Problem",
    "Quantity",
    "ReliefGrid",
    "ReliefOptimum",
    "SearchOptions",
    "Sensitivity",
    "Sharing",
    "SharingModel",
    "Sweep",
    "Tolerance",
    "Variable",
    "contact_pressure",
    "contact_ratio",
    "design_basis",
    "harris_map",
    "housing_level",
    "linearise",
    "mesh_force",
    "minimise",
    "named_quantity",
    "optimise_relief",
    "pareto_front",
    "parse_limit",
    "parse_over",
    "parse_variable",
    "pin_samples",
    "pin_sensitivities",
    "relief_grid",
    "relief_starts",
    "root_stress",
    "sensitivity",
    "sharing_model",
    "sharing_of_samples",
    "sweep",
    "sweep_into",
    "tip_reliefs",
    "tip_thickness",
    "transmission_error",
    "two_pair_length",
    "walked_shares",
    "with_tip_relief",
    "with_values",
]
