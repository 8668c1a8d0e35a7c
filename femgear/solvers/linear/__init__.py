"""Linear systems: modes, damping, receptances, modes over a parameter and the Campbell diagram."""

from femgear.solvers import lazy_names

__all__, __getattr__ = lazy_names(
    __name__,
    {
        "modal": ["complex_modes", "modal_damping", "solve_modes"],
        "receptance": ["modal_response", "reduce_problem"],
        "tracking": ["campbell_data", "track_modes"],
    },
)
