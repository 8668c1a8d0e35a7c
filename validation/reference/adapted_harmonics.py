"""Harmonic balance with as many harmonics as a wanted share of their upper half asks for."""

from __future__ import annotations

from femgear.solvers.periodic.equations import reduced
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.system.system import NonlinearSystem


def adapt_harmonics(
    problem: NonlinearSystem, frequency, *, tail: float = 1e-6, harmonics: int = 4, max_harmonics: int = 64
) -> PeriodicSolution:
    """Double the harmonics, each time from the solution before, until the tail is below a given share.

    Parameters
    ----------
    problem, frequency
        As for `solve_harmonic_balance`.
    tail : float
        Wanted share of the amplitude in the upper half of the lines.
    harmonics, max_harmonics : int
        First and largest number, three or more: the upper half must hold odd and even harmonics.
    """
    reduction, start = reduced(problem), None
    while True:
        solution = solve_harmonic_balance(
            problem, frequency, harmonics=harmonics, start=start, reduction=reduction, stability=False
        )
        if solution.tail <= tail or harmonics == max_harmonics or not solution.converged:
            return solution
        harmonics, start = min(2 * harmonics, max_harmonics), solution
