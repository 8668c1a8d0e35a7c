"""Harmonic balance of systems with gear meshes, bearings and other springs between motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.entries import checked_count, checked_numbers, checked_tolerance
from femgear.solvers.harmonic_equations import HarmonicBalance, harmonic_balance, reduced
from femgear.solvers.harmonic_newton import embed, newton
from femgear.solvers.hill import judged
from femgear.solvers.lines import coincidence_note
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.periodic import PeriodicSolution
from femgear.solvers.receptance import Reduction, respond, source_columns

__all__ = [
    "HarmonicBalance",
    "adapt_harmonics",
    "displacements",
    "harmonic_balance",
    "solve_harmonic_balance",
    "with_radius",
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
    stability: bool = True,
    radius: bool | None = None,
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
    stability : bool
        Floquet verdict and spectral radius of the fixed point. With several base frequencies or the frequency
        zero the verdict says "not covered". Loops that need neither are quicker without.
    radius : bool, optional
        The radius alone, with or without the verdict; it takes all eigenvalues of one matrix of the size of
        the unknowns.

    Returns
    -------
    PeriodicSolution
        Where ``converged`` is False the lines are those of the last iterate and the message says what to do.

    Raises
    ------
    CaseError
        Input that cannot be used, two equal base frequencies (E-FREQUENCY). Where other lines have one
        frequency, the message names them.
    ConvergenceError
        An undamped resonance of the system with reference springs at a line.
    """
    balance = harmonic_balance(
        problem, harmonics=harmonics, orders=orders, samples=samples, reduction=reduction
    )
    frequency = _checked_frequency(balance, frequency)
    tolerance = checked_tolerance(tolerance)
    max_iterations = checked_count(max_iterations, "max_iterations", code="E-TOLERANCE")
    found = newton(balance, frequency, _start(balance, frequency, start), tolerance, max_iterations)
    if start is None and not found.converged:
        found = embed(balance, frequency, found, tolerance, max_iterations)
    if note := coincidence_note(balance.orders, frequency):
        found = replace(found, message=found.message + note)
    if stability if radius is None else radius:
        found = with_radius(balance, found)
    return judged(problem, [found])[0] if stability else found


def with_radius(balance: HarmonicBalance, found: PeriodicSolution) -> PeriodicSolution:
    """The solution with the spectral radius of its fixed point; lines that are not finite have none."""
    if not np.all(np.isfinite(found.deflection)):
        return found
    value = balance.spectral_radius(balance.unknowns(found.deflection), found.frequency)
    return replace(found, spectral_radius=value)


def _checked_frequency(balance: HarmonicBalance, frequency) -> np.ndarray:
    """Base frequencies (n_bases,), finite and not negative."""
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-FREQUENCY", unit="rad/s"))
    if frequency.shape != balance.orders.shape[1:]:
        raise CaseError(
            f"{frequency.size} base frequencies for lines of {balance.orders.shape[1]}", code="E-FREQUENCY"
        )
    if not np.all(np.isfinite(frequency)) or np.any(frequency < 0.0):
        raise CaseError(
            f"base frequencies {frequency.tolist()} rad/s", code="E-FREQUENCY", limit="finite, not negative"
        )
    near = np.abs(frequency[:, None] - frequency) <= 1e-9 * frequency.max(initial=0.0)
    equal = near & (frequency > 0.0)
    if np.any(same := np.triu(equal, 1)):
        one, other = np.eye(len(frequency), dtype=int)[np.argwhere(same)[0]].tolist()
        raise CaseError(
            f"base frequencies {frequency.tolist()} rad/s: the lines {one} and {other} are one",
            code="E-FREQUENCY", key="frequency", limit="no two base frequencies equal to 1e-9",
            remedy="take one base frequency and add up the orders of elements and forces",
        )  # fmt: skip
    return frequency


def adapt_harmonics(
    problem: NonlinearSystem,
    frequency,
    *,
    tail: float = 1e-6,
    harmonics: int = 4,
    max_harmonics: int = 64,
    start=None,
    stability: bool = True,
    radius: bool | None = None,
    **options,
) -> PeriodicSolution:
    """Double the harmonics, each time from the solution before, until the tail is below a given share.

    Parameters
    ----------
    problem, frequency, start, options
        As for `solve_harmonic_balance`.
    tail : float
        Wanted share of the amplitude in the upper half of the lines.
    stability, radius : bool
        Of the last solution only; see `solve_harmonic_balance`.
    harmonics, max_harmonics : int
        First and largest number, three or more: the upper half must hold odd and even harmonics.

    Returns
    -------
    PeriodicSolution
        The message says when the largest number did not suffice, and where it did not converge.
    """
    harmonics = checked_count(harmonics, "harmonics", code="E-HARMONICS")
    max_harmonics = checked_count(max_harmonics, "max_harmonics", code="E-HARMONICS")
    if not 0.0 < checked_numbers(tail, "tail", code="E-HARMONICS", unit="") < 1.0 or not (
        3 <= harmonics <= max_harmonics
    ):
        raise CaseError(
            f"tail {tail} with {harmonics} to {max_harmonics} harmonics", code="E-HARMONICS",
            limit="a tail between 0 and 1, at least three harmonics",
        )  # fmt: skip
    if options.get("reduction") is None:
        options["reduction"] = reduced(problem)
    options["stability"] = False
    while True:
        found = solve_harmonic_balance(problem, frequency, harmonics=harmonics, start=start, **options)
        if found.tail <= tail or harmonics == max_harmonics or not found.converged:
            break
        harmonics, start = min(2 * harmonics, max_harmonics), found
    note = f" {harmonics} harmonics: the upper half of the lines holds {found.tail:.2g} of the amplitude."
    if found.converged and found.tail > tail:
        note += f" Wanted {tail:.2g}: allow more harmonics."
    found = replace(found, message=found.message + note)
    if stability if radius is None else radius:
        known = {name: options.get(name) for name in ("samples", "reduction")}
        found = with_radius(harmonic_balance(problem, orders=found.orders, **known), found)
    return judged(problem, [found])[0] if stability else found


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
    reduction = reduced(problem) if reduction is None else reduction
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
        lines = checked_numbers(start, "start", code="E-START", unit="m", kind=complex)
    if lines.shape != shape or not np.all(np.isfinite(lines)):
        raise CaseError(
            f"a start of shape {lines.shape}", code="E-START", limit=f"finite lines of shape {shape}"
        )
    return balance.unknowns(lines)
