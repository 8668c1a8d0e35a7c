"""Solvers of the dynamic problem ``M q'' + (C + Omega G) q' + K q + W f(W^T q, t) = load``.

`docs/solvers.md` says which one answers which question. Names are imported when they are first asked for.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femgear.solvers.continuation.branches import frequency_response_curve, parameter_curve
    from femgear.solvers.linear.modal import complex_modes, solve_modes
    from femgear.solvers.linear.receptance import modal_response
    from femgear.solvers.linear.tracking import campbell_data
    from femgear.solvers.periodic.harmonic_balance import (
        displacements,
        periodic_response,
        solve_harmonic_balance,
    )
    from femgear.solvers.periodic.shooting import solve_shooting
    from femgear.solvers.periodic.spectral import solve_spectral
    from femgear.solvers.stability.floquet import floquet_verdict
    from femgear.solvers.stability.lyapunov import lyapunov_exponents
    from femgear.solvers.stability.parametric import stability_chart
    from femgear.solvers.time.stroboscopic import sweep_response, sweep_up_and_down
    from femgear.solvers.time.transient import solve_transient


def lazy_names(
    package: str, modules: Mapping[str, Sequence[str]]
) -> tuple[list[str], Callable[[str], object]]:
    """Make ``__all__`` and ``__getattr__`` of a package whose public names stand in its modules."""
    place = {name: module for module, names in modules.items() for name in names}

    def find(name: str) -> object:
        if name in place:
            return getattr(import_module(f"{package}.{place[name]}"), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return sorted(place), find


__all__ = [
    "campbell_data",
    "complex_modes",
    "displacements",
    "floquet_verdict",
    "frequency_response_curve",
    "lyapunov_exponents",
    "modal_response",
    "parameter_curve",
    "periodic_response",
    "solve_harmonic_balance",
    "solve_modes",
    "solve_shooting",
    "solve_spectral",
    "solve_transient",
    "stability_chart",
    "sweep_response",
    "sweep_up_and_down",
]


def __getattr__(name: str) -> object:
    """Find a public name in the package that has it."""
    for package in ("continuation", "linear", "periodic", "stability", "time") if name in __all__ else ():
        found = import_module(f"{__name__}.{package}")
        if name in found.__all__:
            return getattr(found, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
