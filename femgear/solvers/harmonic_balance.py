"""Harmonic balance of systems with gear meshes, bearings and other springs between motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.harmonic_equations import HarmonicBalance, harmonic_balance
from femgear.solvers.harmonic_newton import embed, newton
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.periodic import PeriodicSolution
from femgear.solvers.receptance import Reduction, reduce_problem, respond, source_columns

__all__ = [
    "HarmonicBalance",
    "adapt_harmonics",
    "displacements",
    "harmonic_balance",
    "solve_harmonic_balance",
]


def solve_harmonic_balance(
    problem: NonlinearSystem,
    frequency,
    *,
    harmonics: int | None = None,
    orders=None,
    start=None,
    samples=None,
    reduction: Reduction | None = None,
    tolerance: float = 1e-10,
    max_iterations: int = 50,
    radius: bool = True,
) -> PeriodicSolution:
    """Periodic or quasi-periodic solution at given base frequencies, by Newton's method with line search.

    Parameters
    ----------
    problem, harmonics, orders, samples, reduction
        See `harmonic_balance`.
    frequency : float or (n_bases,) array
        Base frequencies [rad/s], not negative.
    start : PeriodicSolution or (n_columns, L) complex array, optional
        Where to start. Which of several solutions is found depends on it. When not given, the response with
        reference springs; where Newton's method fails from there, that response is followed while the
        springs turn into the elements, see `embed`, and the message says so.
    tolerance : float
        Largest residual relative to the largest deflection.
    max_iterations : int
    radius : bool
        Whether the solution tells the spectral radius of the fixed point; it takes all eigenvalues of one
        matrix of the size of the unknowns.

    Returns
    -------
    PeriodicSolution
        Where ``converged`` is False the lines are those of the last iterate and the message says what to do.

    Raises
    ------
    CaseError
        Input that cannot be used.
    ConvergenceError
        An undamped resonance of the system with reference springs at a line.
    """
    balance = harmonic_balance(
        problem, harmonics=harmonics, orders=orders, samples=samples, reduction=reduction
    )
    frequency = np.atleast_1d(np.asarray(frequency, float))
    if frequency.shape != balance.orders.shape[1:]:
        raise CaseError(
            f"{frequency.size} base frequencies for lines of {balance.orders.shape[1]}", code="E-FREQUENCY"
        )
    if not np.all(np.isfinite(frequency)) or np.any(frequency < 0.0):
        raise CaseError(
            f"base frequencies {frequency.tolist()} rad/s", code="E-FREQUENCY", limit="finite, not negative"
        )
    if not 0.0 < tolerance < 1.0 or max_iterations < 1:
        raise CaseError(
            f"tolerance {tolerance} and {max_iterations} iterations", code="E-TOLERANCE",
            limit="between 0 and 1, at least one iteration",
        )  # fmt: skip
    found = newton(balance, frequency, _start(balance, frequency, start), tolerance, max_iterations)
    if start is None and not found.converged:
        found = embed(balance, frequency, found, tolerance, max_iterations)
    if radius and np.all(np.isfinite(found.deflection)):
        value = balance.spectral_radius(balance.unknowns(found.deflection), frequency)
        found = replace(found, spectral_radius=value)
    return found


def adapt_harmonics(
    problem: NonlinearSystem,
    frequency,
    *,
    tail: float = 1e-6,
    harmonics: int = 4,
    max_harmonics: int = 64,
    start=None,
    **options,
) -> PeriodicSolution:
    """Double the harmonics, each time from the solution before, until the tail is below a given share.

    Parameters
    ----------
    problem, frequency, start, options
        As for `solve_harmonic_balance`.
    tail : float
        Wanted share of the amplitude in the upper half of the lines.
    harmonics, max_harmonics : int
        First and largest number, three or more: the upper half must hold odd and even harmonics.

    Returns
    -------
    PeriodicSolution
        The message says when the largest number did not suffice, and where it did not converge.
    """
    if not 0.0 < tail < 1.0 or not 3 <= harmonics <= max_harmonics:
        raise CaseError(
            f"tail {tail} with {harmonics} to {max_harmonics} harmonics", code="E-HARMONICS",
            limit="a tail between 0 and 1, at least three harmonics",
        )  # fmt: skip
    if options.get("reduction") is None:
        options["reduction"] = reduce_problem(problem)
    while True:
        found = solve_harmonic_balance(problem, frequency, harmonics=harmonics, start=start, **options)
        if found.tail <= tail or harmonics == max_harmonics or not found.converged:
            break
        harmonics, start = min(2 * harmonics, max_harmonics), found
    note = f" {harmonics} harmonics: the upper half of the lines holds {found.tail:.2g} of the amplitude."
    if found.converged and found.tail > tail:
        note += f" Wanted {tail:.2g}: allow more harmonics."
    return replace(found, message=found.message + note)


def displacements(
    problem: NonlinearSystem,
    solution: PeriodicSolution,
    outputs=None,
    *,
    reduction: Reduction | None = None,
) -> np.ndarray:
    """Lines of the outputs ``L q``; velocities are ``i omega_l`` times, accelerations ``-omega_l^2`` times.

    Parameters
    ----------
    problem, solution
    outputs : (n_outputs, n) array, optional
        ``L``; all degrees of freedom when not given.
    reduction : Reduction, optional
        The one that the solution was computed with.

    Returns
    -------
    (n_outputs, L) complex array
        Rigid motions without support have no mean position: theirs is zero.
    """
    reduction = reduce_problem(problem) if reduction is None else reduction
    outputs = np.eye(len(problem.system.M)) if outputs is None else np.atleast_2d(np.asarray(outputs, float))
    forcing = reduction.reference[:, None] * solution.deflection - solution.force
    table = np.concatenate([forcing, source_columns(problem, solution.orders)])
    return respond(reduction, outputs, solution.line_frequency, table)


def _start(balance: HarmonicBalance, frequency, start) -> np.ndarray:
    """Unknowns to start from."""
    if start is None:
        return balance.linear_start(frequency)
    shape = (len(balance.reduction.reference), len(balance.orders))
    if isinstance(start, PeriodicSolution):
        lines = np.zeros(shape, complex)
        known = {tuple(order): number for number, order in enumerate(start.orders.tolist())}
        for number, order in enumerate(balance.orders.tolist()):
            mirror = tuple(-o for o in order)
            if tuple(order) in known:
                lines[:, number] = start.deflection[:, known[tuple(order)]]
            elif mirror in known:
                lines[:, number] = start.deflection[:, known[mirror]].conj()
    else:
        lines = np.asarray(start, complex)
    if lines.shape != shape or not np.all(np.isfinite(lines)):
        raise CaseError(
            f"a start of shape {lines.shape}", code="E-START", limit=f"finite lines of shape {shape}"
        )
    return balance.unknowns(lines)
