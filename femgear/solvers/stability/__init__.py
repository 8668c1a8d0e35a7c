"""Stability of motions: Floquet multipliers, charts of parametric stability, Lyapunov exponents."""

from femgear.solvers import lazy_names

__all__, __getattr__ = lazy_names(
    __name__,
    {
        "floquet": ["floquet_verdict", "floquet_verdicts", "monodromy"],
        "lyapunov": ["LyapunovOptions", "lyapunov_exponents"],
        "parametric": ["stability", "stability_chart"],
    },
)
