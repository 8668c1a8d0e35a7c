"""A periodic solution with its period checked first, and its verdict at hand."""

from __future__ import annotations

from dataclasses import dataclass

from femgear.solvers.harmonic_balance import solve_harmonic_balance
from femgear.solvers.hill import judged, require_period
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.periodic import PeriodicSolution
from femgear.solvers.verdict import FloquetVerdict


@dataclass(frozen=True)
class PeriodicResponse:
    """A periodic solution and short names of what it says about itself.

    Parameters
    ----------
    solution : PeriodicSolution
    """

    solution: PeriodicSolution

    @property
    def verdict(self) -> FloquetVerdict:
        """Its ``stable`` is None where the solution did not converge, has several base frequencies or too
        long a period for its fastest mode."""
        return self.solution.verdict

    @property
    def tail(self) -> float:
        """Share of the amplitude in the upper half of the lines: a measure of truncation."""
        return self.solution.tail

    @property
    def spectral_radius(self) -> float:
        """Spectral radius of the fixed point; it says nothing on stability."""
        return self.solution.spectral_radius

    @property
    def stable(self) -> bool | None:
        """Whether all Floquet multipliers lie within the unit circle; None where the verdict is open."""
        return self.verdict.stable


def periodic_response(
    problem: NonlinearSystem,
    frequency,
    *,
    method: str = "monodromy",
    stability_tolerance: float = 1e-7,
    **options,
) -> PeriodicResponse:
    """`solve_harmonic_balance` with a choice of the method of the verdict; refuses the frequency zero.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : float or (n_bases,) array
        Base frequencies [rad/s]; a single one must be positive.
    method, stability_tolerance
        Method and tolerance of `floquet_verdicts`.
    options
        Those of `solve_harmonic_balance`; harmonics or orders must be given.

    Raises
    ------
    CaseError
        Input that cannot be used, a single base frequency of zero (E-FREQUENCY).
    ConvergenceError
        An undamped resonance of the system with reference springs at a line.
    """
    require_period(frequency)
    options = {"radius": True, **options}
    solution = solve_harmonic_balance(problem, frequency, stability=False, **options)
    return PeriodicResponse(judged(problem, [solution], method=method, tolerance=stability_tolerance)[0])
