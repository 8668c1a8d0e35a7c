"""Motion in time: fixed and adaptive steps, the map of one period, sections and sweeps."""

from typing import TYPE_CHECKING

from femgear.solvers import lazy_names

if TYPE_CHECKING:
    from femgear.solvers.time.stroboscopic import (
        bifurcation_diagram,
        stroboscopic_map,
        stroboscopic_section,
        sweep_response,
        sweep_up_and_down,
    )
    from femgear.solvers.time.transient import solve_transient

__all__ = [
    "bifurcation_diagram",
    "solve_transient",
    "stroboscopic_map",
    "stroboscopic_section",
    "sweep_response",
    "sweep_up_and_down",
]
__getattr__ = lazy_names(__name__, __all__, ("stroboscopic", "transient"))
