"""Periodic and quasi-periodic motions: spectral iteration, harmonic balance, shooting."""

from typing import TYPE_CHECKING

from femgear.solvers import lazy_names

if TYPE_CHECKING:
    from femgear.solvers.periodic.harmonic_balance import (
        adapt_harmonics,
        displacements,
        periodic_response,
        solve_harmonic_balance,
    )
    from femgear.solvers.periodic.shooting import ShootingOptions, solve_shooting
    from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
    from femgear.solvers.periodic.spectral import solve_spectral

__all__ = [
    "FloquetVerdict",
    "PeriodicSolution",
    "ShootingOptions",
    "adapt_harmonics",
    "displacements",
    "periodic_response",
    "solve_harmonic_balance",
    "solve_shooting",
    "solve_spectral",
]
__getattr__ = lazy_names(__name__, __all__, ("harmonic_balance", "shooting", "solution", "spectral"))
