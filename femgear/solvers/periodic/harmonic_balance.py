"""Harmonic balance of systems with gear meshes, bearings and other springs between motions.

The harmonic equations are solved by Newton's method, where it fails after an embedding that leads
to a start. `periodic_response` checks the period first and has the verdict at hand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_count, checked_numbers, checked_tolerance
from femgear.solvers.continuation.arclength import continue_curve
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.linear.receptance import DirectReduction, Reduction, respond, source_columns
from femgear.solvers.periodic.equations import (
    MANY,
    HarmonicBalance,
    LineTangent,
    harmonic_balance,
    linearised,
    reduced,
    relative_residual,
)
from femgear.solvers.periodic.solution import PeriodicSolution, of_solution
from femgear.solvers.stability.floquet import judged, require_period
from femgear.system.fourier import coincidence_note
from femgear.system.system import NonlinearSystem

# Shortest step of the line search and the decrease that it asks for (Dennis and Schnabel, 1983, 6.3); full
# steps taken all the same where a corner of a contact law blocks the search.
_SHORTEST, _DECREASE, _FORCED = 1.0 / 256.0, 1e-4, 5
# Steps of the embedding: first length, shortest, longest (unit: the whole change), and how many.
_FIRST, _LEAST, _LONGEST, _STEPS = 0.1, 1e-5, 0.5, 400
# Tolerance below which rounding of the residual is not followed.
_FINEST = 1e-14


def solve_harmonic_balance(
    problem: NonlinearSystem,
    frequency,
    *,
    start=None,
    tolerance: float = 1e-10,
    max_iterations: int = 50,
    stability: bool = True,
    stability_tolerance: float = 1e-7,
    radius: bool | None = None,
    **equations,
) -> PeriodicSolution:
    """Find a periodic or quasi-periodic motion at given base frequencies by Newton's method with line search.

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    frequency : float or (n_bases,) array
        Base frequencies [rad/s], not negative.
    start : PeriodicSolution or (n_columns, L) complex array, optional
        Where to start. Which of several solutions is found depends on it. When not given, the response with
        reference springs; where Newton's method fails from there, the same with meshes that the load pulls
        apart on their back flanks, and then that response is followed while the springs turn into the
        elements, and the message says so.
    tolerance : float
        Largest residual relative to the largest deflection.
    max_iterations : int
        Newton iterations at most.
    stability : bool
        Floquet verdict and spectral radius of the fixed point. With several base frequencies or the frequency
        zero the verdict says "not covered". Loops that need neither are quicker without.
    stability_tolerance : float
        Relative error of the monodromy matrix.
    radius : bool, optional
        The radius alone, with or without the verdict; it takes all eigenvalues of one matrix of the size of
        the unknowns.
    equations
        ``harmonics`` or ``orders``, ``samples``, ``reduction`` of `harmonic_balance`.

    Returns
    -------
    PeriodicSolution
        Where ``converged`` is False the lines are those of the last iterate and the message says what to do.

    Raises
    ------
    CaseError
        Input that cannot be used, two equal base frequencies (E-RANGE). Where other lines have one
        frequency, the message names them.
    ConvergenceError
        An undamped resonance of the system with reference springs at a line.
    """
    balance = harmonic_balance(problem, frequencies=1, **equations)
    frequency = _checked_frequency(balance, frequency)
    wanted = {"tolerance": checked_tolerance(tolerance), "radius": stability if radius is None else radius}
    wanted["max_iterations"] = checked_count(max_iterations, "max_iterations", code="E-RANGE")
    solution = _newton(balance, frequency, _start(balance, frequency, start), **wanted)
    crossed = balance.crossed_start(frequency) if start is None and not solution.converged else None
    if crossed is not None:
        # the play counts in the deflections, of which the residual is a share, and not in the forces
        finer = max(balance.scale / np.abs(crossed).max(), _FINEST / wanted["tolerance"])
        finer = wanted | {"tolerance": wanted["tolerance"] * min(finer, 1.0)}
        solution = _newton(balance, frequency, crossed, **finer)
    if start is None and not solution.converged:
        solution = _embed(balance, frequency, solution, **wanted)
    if note := coincidence_note(balance.orders, frequency):
        solution = replace(solution, message=solution.message + note)
    return judged(problem, [solution], tolerance=stability_tolerance)[0] if stability else solution


def displacements(
    problem: NonlinearSystem,
    solution: PeriodicSolution,
    outputs=None,
    *,
    reduction: Reduction | DirectReduction | None = None,
) -> np.ndarray:
    """Compute the lines of the outputs ``L q`` [m per unit of L] of a solution.

    Velocities are ``i omega_l`` times, accelerations ``-omega_l^2`` times these.

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    solution : PeriodicSolution
        One of its solutions, with L lines.
    outputs : (n_outputs, n) array, optional
        ``L``; all degrees of freedom when not given.
    reduction : Reduction, optional
        The one that the solution was computed with.

    Returns
    -------
    (n_outputs, L) complex array
        Rigid motions without support have no mean position: theirs is zero.
    """
    reduction = reduced(problem, len(solution.orders)) if reduction is None else reduction
    outputs = np.eye(len(problem.system.M)) if outputs is None else np.atleast_2d(np.asarray(outputs, float))
    forcing = reduction.reference[:, None] * solution.deflection - solution.force
    table = np.concatenate([forcing, source_columns(problem, solution.orders)])
    return respond(reduction, outputs, solution.line_frequency, table)


@dataclass(frozen=True)
class PeriodicResponse:
    """A periodic ``solution``, and short names of what it says about itself."""

    solution: PeriodicSolution

    verdict = of_solution("verdict", "Open where there are several base frequencies or too long a period.")
    stable = of_solution("stable", "Whether no disturbance grows; None where the verdict is open.")
    tail = of_solution("tail", "Share of the amplitude in the upper half of the lines.")
    spectral_radius = of_solution("spectral_radius", "Of the fixed point; it says nothing on stability.")


def periodic_response(problem: NonlinearSystem, frequency, **options) -> PeriodicResponse:
    """Find a periodic motion at base frequencies (n_bases,) [rad/s] with its verdict at hand.

    As `solve_harmonic_balance`, but the single base frequency zero is refused (E-RANGE).
    """
    require_period(frequency)
    return PeriodicResponse(solve_harmonic_balance(problem, frequency, **options))


def _newton(
    balance: HarmonicBalance, frequency, y, *, tolerance: float, max_iterations: int, radius: bool
) -> PeriodicSolution:
    """Solve harmonic equations by Newton's method with backtracking, from the unknowns y (n_y,) [m] on."""
    receptance = balance.receptance_at(frequency)
    evaluate = linearised if balance.size > MANY else _with_matrix
    error, tangent = evaluate(balance, receptance, y)
    history, trouble, forced = [relative_residual(balance, error, y)], "", 0
    while not history[-1] <= tolerance and len(history) <= max_iterations:
        try:
            step = -_newton_step(balance, receptance, y, error, tangent)
        except np.linalg.LinAlgError:
            trouble = "the Jacobian is singular"
            break
        share = 1.0
        while share >= _SHORTEST:
            trial, tangent = evaluate(balance, receptance, y + share * step)
            if np.linalg.norm(trial) <= (1.0 - _DECREASE * share) * np.linalg.norm(error):
                break
            share *= 0.5
        else:
            forced, share = forced + 1, 1.0
            if forced > _FORCED:
                trouble = "no step along Newton's direction lowers the residual"
                break
            trial, tangent = evaluate(balance, receptance, y + step)
        y, error = y + share * step, trial
        history.append(relative_residual(balance, error, y))
    converged, steps = bool(history[-1] <= tolerance), len(history) - 1 + bool(trouble)
    forces = tangent if evaluate is _with_matrix and not trouble else None
    return balance.solution(
        y,
        frequency,
        radius=radius,
        forces=forces,
        converged=converged,
        residual=history[-1],
        iterations=steps,
        factorisations=steps,
        message=_message(converged, steps, history[-1], trouble, tolerance),
        history=tuple(history),
    )


def _embed(balance: HarmonicBalance, frequency, failed: PeriodicSolution, **wanted) -> PeriodicSolution:
    """Solution found by Newton's method from the end of an embedding; ``failed`` where it has no end.

    The arc of ``X + t T (F - reference X) = T_load S`` from t = 0, where it is linear, to t = 1: reference
    springs turn gradually into the elements, through limit points if there are any (Allgower and Georg,
    Introduction to Numerical Continuation Methods, 2003, chapters 2 and 6).
    """
    receptance = balance.receptance_at(frequency)
    nothing = np.zeros((len(balance.reduction.reference), len(balance.orders)), complex)
    linear = -balance.unknowns(balance.residual(nothing, nothing, receptance))

    def evaluate(y, t):
        full, (_, products) = _with_matrix(balance, receptance, y)
        change = full - (y - linear)
        jacobian = t * balance.jacobian(products, receptance)
        jacobian[np.diag_indices(len(y))] += 1.0 - t
        return y - linear + t * change, jacobian, change

    scale = max(float(np.linalg.norm(linear)), balance.scale)
    options = StepOptions(
        first=_FIRST,
        smallest=_LEAST,
        largest=_LONGEST,
        angle=0.3,
        contraction=0.25,
        max_points=_STEPS,
    )
    try:
        curve = continue_curve(evaluate, linear, 0.0, limits=(0.0, 1.0), scale=scale, options=options)
    except ConvergenceError:
        curve = None
    if curve is None or curve.parameter[-1] != 1.0:
        note = " The embedding of the reference springs was lost."
        return replace(failed, message=failed.message + note)
    solution = _newton(balance, frequency, curve.points[-1], **wanted)
    note = f" Newton's method alone failed; started from {len(curve.points) - 1} steps of embedding."
    work = failed.factorisations + int(curve.iterations.sum()) + solution.factorisations
    return replace(
        solution,
        factorisations=work,
        iterations=failed.iterations + solution.iterations,
        message=solution.message + note,
    )


def _with_matrix(balance: HarmonicBalance, receptance, y) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Residual (n_y,) [m] at the unknowns y, and its forces with the products that make its derivative."""
    lines = balance.lines(y)
    forces = balance.forces(lines)
    return balance.unknowns(balance.residual(lines, forces[0], receptance)), forces


def _newton_step(balance: HarmonicBalance, receptance, y, error, tangent) -> np.ndarray:
    """``dR/dX^-1 error``: by its products where there are many lines, else, or where they fail, directly."""
    if isinstance(tangent, LineTangent):
        step = tangent.solve(error)
        if step is not None:
            return step
        tangent = balance.forces(balance.lines(y))
    return np.linalg.solve(balance.jacobian(tangent[1], receptance), error)


def _message(converged: bool, steps: int, residual: float, trouble: str, tolerance: float) -> str:
    if converged:
        return f"Converged in {steps} steps, relative residual {residual:.2e}."
    return (
        f"Not converged after {steps} steps, relative residual {residual:.2e} (wanted {tolerance:.1e})"
        f"{': ' + trouble if trouble else ''}. Start from the solution at a neighbouring frequency or follow "
        "the branch by continuation; more samples, a smoothing length or more damping help too."
    )


def _checked_frequency(balance: HarmonicBalance, frequency) -> np.ndarray:
    """Base frequencies (n_bases,), finite and not negative."""
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    if frequency.shape != balance.orders.shape[1:]:
        raise CaseError(f"{frequency.size} base frequencies for lines of {balance.orders.shape[1]}", code="E-RANGE")
    if not np.all(np.isfinite(frequency)) or np.any(frequency < 0.0):
        raise CaseError(f"base frequencies {frequency.tolist()} rad/s", code="E-RANGE", limit="finite, not negative")
    near = np.abs(frequency[:, None] - frequency) <= 1e-9 * frequency.max(initial=0.0)
    equal = near & (frequency > 0.0)
    if np.any(same := np.triu(equal, 1)):
        line_1, other = np.eye(len(frequency), dtype=int)[np.argwhere(same)[0]].tolist()
        raise CaseError(
            f"base frequencies {frequency.tolist()} rad/s: the lines {line_1} and {other} are one",
            code="E-RANGE",
            key="frequency",
            limit="no two base frequencies equal to 1e-9",
            remedy="take one base frequency and add up the orders of elements and forces",
        )
    return frequency


def _start(balance: HarmonicBalance, frequency, start) -> np.ndarray:
    """Unknowns to start from."""
    if start is None:
        return balance.linear_start(frequency)
    shape = (len(balance.reduction.reference), len(balance.orders))
    if isinstance(start, PeriodicSolution):
        line_of = {tuple(-order): line.conj() for order, line in zip(start.orders, start.deflection.T)}
        line_of |= {tuple(order): line for order, line in zip(start.orders, start.deflection.T)}
        nothing = np.zeros(len(start.deflection), complex)
        lines = np.stack([line_of.get(tuple(order), nothing) for order in balance.orders], axis=1)
    else:
        lines = checked_numbers(start, "start", code="E-START", unit="m", kind=complex)
    if lines.shape != shape or not np.all(np.isfinite(lines)):
        raise CaseError(f"a start of shape {lines.shape}", code="E-START", limit=f"finite lines of shape {shape}")
    return balance.unknowns(lines)
