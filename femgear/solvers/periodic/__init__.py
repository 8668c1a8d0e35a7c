"""Periodic and quasi-periodic motions: spectral iteration, harmonic balance, shooting."""

from femgear.solvers import lazy_names

__all__, __getattr__ = lazy_names(
    __name__,
    {
        "harmonic_balance": ["displacements", "periodic_response", "solve_harmonic_balance"],
        "shooting": ["ShootingOptions", "solve_shooting"],
        "solution": ["FloquetVerdict", "PeriodicSolution"],
        "spectral": ["solve_spectral"],
    },
)
