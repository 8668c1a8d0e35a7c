"""Solvers of the dynamic problem ``M q'' + (C + Omega G) q' + K q + W f(W^T q, t) = load``.

`docs/solvers.md` says which one answers which question. Names are imported when they are first asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femgear.solvers.continuation.branches import frequency_response_curve as frequency_response_curve
    from femgear.solvers.continuation.branches import parameter_curve as parameter_curve
    from femgear.solvers.linear.modal import complex_modes as complex_modes
    from femgear.solvers.linear.modal import undamped_modes as undamped_modes
    from femgear.solvers.linear.receptance import modal_response as modal_response
    from femgear.solvers.linear.tracking import campbell_data as campbell_data
    from femgear.solvers.periodic.harmonic_balance import displacements as displacements
    from femgear.solvers.periodic.harmonic_balance import periodic_response as periodic_response
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance as solve_harmonic_balance
    from femgear.solvers.periodic.shooting import solve_shooting as solve_shooting
    from femgear.solvers.periodic.spectral import solve_spectral as solve_spectral
    from femgear.solvers.stability.floquet import floquet_verdict as floquet_verdict
    from femgear.solvers.stability.lyapunov import lyapunov_exponents as lyapunov_exponents
    from femgear.solvers.stability.parametric import stability_chart as stability_chart
    from femgear.solvers.time.stroboscopic import sweep_response as sweep_response
    from femgear.solvers.time.stroboscopic import sweep_up_and_down as sweep_up_and_down
    from femgear.solvers.time.transient import solve_transient as solve_transient

_HOME = {
    "continuation.branches": ["frequency_response_curve", "parameter_curve"],
    "linear.modal": ["complex_modes", "solve_modes", "undamped_modes"],
    "linear.receptance": ["modal_response"],
    "linear.tracking": ["campbell_data"],
    "periodic.harmonic_balance": ["displacements", "periodic_response", "solve_harmonic_balance"],
    "periodic.shooting": ["solve_shooting"],
    "periodic.spectral": ["solve_spectral"],
    "stability.floquet": ["floquet_verdict"],
    "stability.lyapunov": ["lyapunov_exponents"],
    "stability.parametric": ["stability_chart"],
    "time.stroboscopic": ["sweep_response", "sweep_up_and_down"],
    "time.transient": ["solve_transient"],
}


def __getattr__(name: str) -> object:
    for module, names in _HOME.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
