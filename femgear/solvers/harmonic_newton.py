"""Newton's method for the harmonic equations, and an embedding that leads to a start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.solvers.harmonic_equations import MANY, HarmonicBalance
from femgear.solvers.harmonic_krylov import LineTangent, linearised
from femgear.solvers.mean_load import relative_residual
from femgear.solvers.periodic import PeriodicSolution

# Shortest step of the line search and the decrease that it asks for (Dennis and Schnabel, 1983, 6.3); full
# steps taken all the same where a corner of a contact law blocks the search.
_SHORTEST, _DECREASE, _FORCED = 1.0 / 256.0, 1e-4, 5
# Steps of the embedding: first length, shortest, longest (unit: the whole change), and how many.
_FIRST, _LEAST, _LONGEST, _STEPS = 0.1, 1e-5, 0.5, 400


def newton(balance: HarmonicBalance, frequency, y, tolerance: float, max_iterations: int) -> PeriodicSolution:
    """Newton's method from the unknowns y with backtracking on the size of the residual."""
    receptance = balance.receptance(frequency)[0]
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
    return balance.solution(
        y, frequency, converged=converged, residual=history[-1], iterations=steps, factorisations=steps,
        message=_message(converged, steps, history[-1], trouble, tolerance), history=tuple(history),
    )  # fmt: skip


def embed(
    balance: HarmonicBalance, frequency, failed: PeriodicSolution, tolerance: float, max_iterations: int
) -> PeriodicSolution:
    """Solution found by turning the reference springs gradually into the elements.

    ``X + t T (F - reference X) = T_load S`` is followed from t = 0, where it is linear, to t = 1 along its
    arc, through limit points if there are any (Allgower and Georg, Introduction to Numerical Continuation
    Methods, 2003, chapters 2 and 6); Newton's method finishes at t = 1.

    Parameters
    ----------
    failed : PeriodicSolution
        The attempt without embedding; returned, with a longer message, where the arc does not get there.
    """
    receptance = balance.receptance(frequency)[0]
    curve = _Embedding(balance, receptance)
    y, steps, count = curve.follow()
    work = failed.factorisations + count
    if y is None:
        note = f" The embedding of the reference springs was lost after {steps} steps."
        return replace(failed, factorisations=work, message=failed.message + note)
    found = newton(balance, frequency, y, tolerance, max_iterations)
    note = f" Newton's method alone failed; started from {steps} steps of embedding."
    return replace(
        found, factorisations=work + found.factorisations, iterations=failed.iterations + found.iterations,
        message=found.message + note,
    )  # fmt: skip


class _Embedding:
    """The arc of solutions over t, in unknowns scaled by the linear solution."""

    def __init__(self, balance: HarmonicBalance, receptance):
        self.balance, self.receptance = balance, receptance
        forces = balance.forces(np.zeros((len(balance.reduction.reference), len(balance.orders))))
        nothing = np.zeros_like(forces.lines)
        self.linear = -balance.unknowns(balance.residual(nothing, replace(forces, lines=nothing), receptance))
        self.scale = max(np.linalg.norm(self.linear), balance.scale)
        self.factorisations = 0

    def follow(self) -> tuple[np.ndarray | None, int, int]:
        """Unknowns near t = 1, or none; steps; factorisations."""
        point = np.append(self.linear / self.scale, 0.0)
        tangent, length = np.append(np.zeros(len(self.linear)), 1.0), _FIRST
        tangent = self._tangent(point, tangent)
        for number in range(_STEPS):
            new, rounds = self._correct(point + length * tangent, tangent)
            if new is None:
                length *= 0.5
                if length < _LEAST:
                    return None, number, self.factorisations
                continue
            if new[-1] >= 1.0:
                share = (1.0 - point[-1]) / (new[-1] - point[-1])
                end = point + share * (new - point)
                return self.scale * end[:-1], number + 1, self.factorisations
            point, tangent = new, self._tangent(new, tangent)
            length = min(_LONGEST, 1.5 * length) if rounds <= 3 else length
        return None, _STEPS, self.factorisations

    def _system(self, point):
        """Residual and its derivative (n_y, n_y + 1) by the scaled unknowns and t."""
        y, t = self.scale * point[:-1], point[-1]
        forces, full = _residual(self.balance, self.receptance, y)
        change = full - (y - self.linear)
        jacobian = t * self.balance.jacobian(forces, self.receptance)
        jacobian[np.diag_indices(len(y))] += 1.0 - t
        return y - self.linear + t * change, np.column_stack([self.scale * jacobian, change])

    def _solve(self, matrix, row, right):
        self.factorisations += 1
        return np.linalg.solve(np.vstack([matrix / self.scale, row]), right)

    def _tangent(self, point, before):
        right = np.append(np.zeros(len(point) - 1), 1.0)
        tangent = self._solve(self._system(point)[1], before, right)
        return tangent / np.linalg.norm(tangent)

    def _correct(self, guess, tangent):
        """Point of the arc in the plane through the guess, normal to the tangent, and the rounds it took."""
        point = guess
        for rounds in range(1, 9):
            error, matrix = self._system(point)
            right = np.append(-error / self.scale, tangent @ (guess - point))
            if np.abs(right).max() < 1e-8:
                return point, rounds
            try:
                point = point + self._solve(matrix, tangent, right)
            except np.linalg.LinAlgError:
                return None, rounds
        return None, rounds


def _residual(balance: HarmonicBalance, receptance, y):
    """What the elements do at the unknowns y, and the residual (n_y,)."""
    lines = balance.lines(y)
    forces = balance.forces(lines)
    return forces, balance.unknowns(balance.residual(lines, forces, receptance))


def _with_matrix(balance: HarmonicBalance, receptance, y):
    """Residual (n_y,) at the unknowns y, and what its derivative is made of."""
    forces, error = _residual(balance, receptance, y)
    return error, forces


def _newton_step(balance: HarmonicBalance, receptance, y, error, tangent) -> np.ndarray:
    """``dR/dX^-1 error``: by its products where there are many lines, else, or where they fail, directly."""
    if isinstance(tangent, LineTangent):
        step = tangent.solve(error)
        if step is not None:
            return step
        tangent = balance.forces(balance.lines(y))
    return np.linalg.solve(balance.jacobian(tangent, receptance), error)


def _message(converged: bool, steps: int, residual: float, trouble: str, tolerance: float) -> str:
    if converged:
        return f"Converged in {steps} steps, relative residual {residual:.2e}."
    return (
        f"Not converged after {steps} steps, relative residual {residual:.2e} (wanted {tolerance:.1e})"
        f"{': ' + trouble if trouble else ''}. Start from the solution at a neighbouring frequency or follow "
        "the branch by continuation; more samples, a smoothing length or more damping help too."
    )
