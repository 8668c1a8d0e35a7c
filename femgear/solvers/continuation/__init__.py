"""Branches of solutions over a parameter, past limit points and branch points."""

from femgear.solvers import lazy_names

__all__, __getattr__ = lazy_names(
    __name__,
    {
        "arclength": ["continue_curve"],
        "corrector": ["StepOptions"],
        "branches": ["Branch", "CurveOptions", "frequency_response_curve", "parameter_curve"],
    },
)
