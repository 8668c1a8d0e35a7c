"""Motion in time: fixed and adaptive steps, the map of one period, sections and sweeps."""

from femgear.solvers import lazy_names

__all__, __getattr__ = lazy_names(
    __name__,
    {
        "stroboscopic": ["stroboscopic_map", "sweep_response", "sweep_up_and_down"],
        "transient": ["solve_transient"],
    },
)
