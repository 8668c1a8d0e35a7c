"""Studies of a case: design maps, derivatives, optimisation, sweeps.

Transmission error over torque and relief, as-built samples and the derivatives of both start from
gears and their compliances; searches, Pareto fronts and sweeps change entries of the case file.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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

_HOME = {
    **dict.fromkeys(("Limit", "Problem", "Variable", "tip_reliefs"), "problem"),
    **dict.fromkeys(("Optimum", "SearchOptions", "minimise"), "search"),
    "pareto_front": "front",
}


def __getattr__(name: str) -> object:
    """Names are imported when they are first asked for: the workers of a study begin at once."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME.get(name, 'objectives')}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
