"""femgear: planetary gear sets from tooth geometry to the vibration heard on the housing."""

from __future__ import annotations

from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from femgear.analysis import solve_dynamics, solve_housing, solve_modes, solve_static
    from femgear.analysis_stress import solve_stress
    from femgear.case import Case, planetary_set, read_case, with_value, with_values
    from femgear.errors import FemgearError
    from femgear.storage import open_results

__all__ = [
    "Case",
    "FemgearError",
    "__version__",
    "open_results",
    "planetary_set",
    "read_case",
    "solve_dynamics",
    "solve_housing",
    "solve_modes",
    "solve_static",
    "solve_stress",
    "with_value",
    "with_values",
]

_HOME = {
    "Case": "case",
    "FemgearError": "errors",
    "open_results": "storage",
    "planetary_set": "case",
    "read_case": "case",
    "solve_dynamics": "analysis",
    "solve_housing": "analysis",
    "solve_modes": "analysis",
    "solve_static": "analysis",
    "solve_stress": "analysis_stress",
    "with_value": "case",
    "with_values": "case",
}


def __getattr__(name: str) -> object:
    """Public names are imported when they are first asked for, so that ``import femgear`` stays light."""
    if name not in _HOME:
        raise AttributeError(f"module 'femgear' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"femgear.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
