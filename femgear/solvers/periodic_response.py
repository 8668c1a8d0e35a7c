"""A periodic solution with all that is known about it: truncation, fixed point, stability."""

from __future__ import annotations

from dataclasses import dataclass

from femgear.solvers.harmonic_balance import solve_harmonic_balance
from femgear.solvers.hill import FloquetVerdict, floquet_verdict, require_period
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.periodic import PeriodicSolution


@dataclass(frozen=True)
class PeriodicResponse:
    """A periodic solution and its Floquet verdict.

    Parameters
    ----------
    solution : PeriodicSolution
    verdict : FloquetVerdict
        Its ``stable`` is None where the solution did not converge, has several base frequencies or too long
        a period for its fastest mode.
    """

    solution: PeriodicSolution
    verdict: FloquetVerdict

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
    """Periodic solution by harmonic balance, with tail, spectral radius of the fixed point and stability.

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
    solution = solve_harmonic_balance(problem, frequency, **options)
    verdict = floquet_verdict(problem, solution, method=method, tolerance=stability_tolerance)
    return PeriodicResponse(solution, verdict)
