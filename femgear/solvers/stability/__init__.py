"""Stability of motions: Floquet multipliers, charts of parametric stability, Lyapunov exponents."""

from typing import TYPE_CHECKING

from femgear.solvers import lazy_names

if TYPE_CHECKING:
    from femgear.solvers.stability.floquet import floquet_verdict, floquet_verdicts, monodromy
    from femgear.solvers.stability.lyapunov import LyapunovOptions, lyapunov_exponents
    from femgear.solvers.stability.parametric import stability, stability_boundary, stability_chart

__all__ = [
    "LyapunovOptions",
    "floquet_verdict",
    "floquet_verdicts",
    "lyapunov_exponents",
    "monodromy",
    "stability",
    "stability_boundary",
    "stability_chart",
]
__getattr__ = lazy_names(__name__, __all__, ("floquet", "lyapunov", "parametric"))
