"""Linear systems: modes, damping, receptances, modes over a parameter and the Campbell diagram."""

from typing import TYPE_CHECKING

from femgear.solvers import lazy_names

if TYPE_CHECKING:
    from femgear.solvers.linear.modal import complex_modes, modal_damping, solve_modes
    from femgear.solvers.linear.receptance import direct_response, modal_response, reduce_problem
    from femgear.solvers.linear.tracking import campbell_data, track_modes

__all__ = [
    "campbell_data",
    "complex_modes",
    "direct_response",
    "modal_damping",
    "modal_response",
    "reduce_problem",
    "solve_modes",
    "track_modes",
]
__getattr__ = lazy_names(__name__, __all__, ("modal", "receptance", "tracking"))
