"""femgear: planetary gear sets from tooth geometry to the vibration heard on the housing."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from femgear.moved import FormerNames

if TYPE_CHECKING:
    __version__: str
    from femgear.case.gear_set import planetary_set
    from femgear.case.planetary import Case
    from femgear.errors import FemgearError
    from femgear.run import live, mesh_stiffness, solve
    from femgear.stages.static import solve_static, solve_stress
    from femgear.trains.drafts import new_case
    from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
    from femgear.trains.reading import open_results, read_case, with_value, with_values
    from femgear.trains.shown import figures, summary, tables

__all__ = [
    "Case",
    "FemgearError",
    "__version__",
    "figures",
    "live",
    "mesh_stiffness",
    "new_case",
    "open_results",
    "planetary_set",
    "read_case",
    "solve",
    "solve_dynamics",
    "solve_housing",
    "solve_modes",
    "solve_static",
    "solve_stress",
    "summary",
    "tables",
    "with_value",
    "with_values",
]

sys.meta_path.insert(0, FormerNames)  # type: ignore[arg-type]

_HOME = {
    "Case": "case.planetary",
    "FemgearError": "errors",
    "figures": "trains.shown",
    "live": "run",
    "mesh_stiffness": "run",
    "new_case": "trains.drafts",
    "open_results": "trains.reading",
    "planetary_set": "case.gear_set",
    "read_case": "trains.reading",
    "solve": "run",
    "solve_dynamics": "trains.elastic.stages",
    "solve_housing": "trains.elastic.stages",
    "solve_modes": "trains.elastic.stages",
    "solve_static": "stages.static",
    "solve_stress": "stages.static",
    "summary": "trains.shown",
    "tables": "trains.shown",
    "with_value": "trains.reading",
    "with_values": "trains.reading",
}


def __getattr__(name: str) -> object:
    """Public names are imported when they are first asked for, so that ``import femgear`` stays light."""
    if name == "__version__":
        from importlib.metadata import version

        globals()[name] = version("femgear")
        return globals()[name]
    if name not in _HOME:
        raise AttributeError(f"module 'femgear' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"femgear.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
