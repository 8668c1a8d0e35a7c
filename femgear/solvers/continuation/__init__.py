"""Branches of solutions over a parameter, past limit points and branch points."""

from typing import TYPE_CHECKING

from femgear.solvers import lazy_names

if TYPE_CHECKING:
    from femgear.solvers.continuation.arclength import StepOptions, continue_curve
    from femgear.solvers.continuation.branches import (
        Branch,
        CurveOptions,
        branch_maximum,
        crossing_branches,
        frequency_response_curve,
        parameter_curve,
    )

__all__ = [
    "Branch",
    "CurveOptions",
    "StepOptions",
    "branch_maximum",
    "continue_curve",
    "crossing_branches",
    "frequency_response_curve",
    "parameter_curve",
]
__getattr__ = lazy_names(__name__, __all__, ("arclength", "branches"))
