"""Free vibration by shooting: the period is unknown beside the start.

M. Peeters et al., Mech. Syst. Signal Process. 23 (2009) 195-216.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.errors import CaseError, checked_numbers
from femgear.solvers.periodic.shooting import (
    SINGULAR,
    ShootingOptions,
    ShootingSolution,
    _judged,
    _result,
    shoot,
)
from femgear.solvers.time.adaptive import Contacts, Flow, checked_start, flow
from femgear.system.system import NonlinearSystem


def solve_free_vibration(
    problem: NonlinearSystem, start, period: float, *, fixed: int = 0, conservative: bool = True, **options
) -> ShootingSolution:
    """Find a periodic motion of a system that nothing drives: its period is unknown too.

    Parameters
    ----------
    problem : NonlinearSystem
        Without harmonic forces and without coefficients that change in time.
    start : pair of (n,) arrays
        First guess; the degree of freedom ``fixed`` keeps zero velocity there, which sets the phase.
    period : float
        First guess [s].
    fixed : int
    conservative : bool
        The displacement of ``fixed`` is kept as the amplitude. A limit cycle, which has its own amplitude,
        needs ``False``.
    options
        Fields of `ShootingOptions`; the tolerances are 1e-12 (integration) and 1e-10 when not given.

    Raises
    ------
    CaseError
        Forces, a period or a ``fixed`` out of range (E-RANGE), a start that does not fit (E-START).
    """
    chosen = ShootingOptions(**{"integration": 1e-12, "tolerance": 1e-10, **options})
    period = checked_numbers(period, "period", code="E-RANGE", unit="s").item()
    if problem.forces or not (np.isfinite(period) and period > 0.0):
        raise CaseError(
            f"free vibration with {len(problem.forces)} harmonic forces and a period of {period} s",
            code="E-RANGE",
            limit="no forces and a period above 0 s",
        )
    n = len(problem.system.M)
    if not 0 <= fixed < n:
        phase_condition = f"degree of freedom {fixed} fixed"
        raise CaseError(phase_condition, code="E-RANGE", key="fixed", limit=f"0 to {n - 1}")
    if start is None:
        raise CaseError(
            "a free vibration without a start",
            code="E-START",
            key="start",
            limit=f"displacements and velocities of shape ({n},)",
            remedy="give a first guess of the motion",
        )
    start = checked_start(problem, start)
    moving = flow(problem, 0.0, variational=True)
    y = flow(problem, 0.0).state(*start)
    y[n + fixed] = 0.0
    free = np.setdiff1d(np.arange(2 * n), [n + fixed, fixed] if conservative else [n + fixed])
    integrator, history = chosen.integrator(moving, start), []
    while True:
        end, monodromy = shoot(moving, y, period, integrator)
        defect = end - y
        history.append(float(np.abs(defect).max() / np.abs(y).max()))
        if history[-1] <= chosen.tolerance or len(history) > chosen.max_iterations:
            break
        slope = _derivative(moving, end, period)
        matrix = np.column_stack([(monodromy - np.eye(2 * n))[:, free], slope / moving.rate])
        update = np.linalg.lstsq(matrix, -defect, rcond=SINGULAR)[0]
        y, period = _closer(moving, y, period, free, update, np.abs(defect).max(), integrator)
    result = _result(moving, y, monodromy, period, chosen, integrator, history)
    # the phase is free, and so is the amplitude of a conservative system
    trivial = 2 if conservative else 1
    result = _judged(moving, result, chosen, trivial=trivial)
    if not result.solution.converged:
        return result
    note = f", without {trivial} of phase{' and amplitude' if conservative else ''} that are one"
    verdict = replace(result.verdict, message=result.verdict.message + note)
    return replace(result, solution=replace(result.solution, verdict=verdict))


def _closer(moving: Flow, y, period, free, update, before, options):
    """The Newton step in state and period, halved until the defect gets smaller."""
    plain = replace(moving, variational=False)
    # a change of the period by half would shoot at another motion
    share = min(1.0, 0.3 * period * moving.rate / max(abs(update[-1]), 1e-300))
    for _ in range(8):
        tried, longer = y.copy(), period + share * update[-1] / moving.rate
        tried[free] += share * update[:-1]
        if np.abs(shoot(plain, tried, longer, options)[0] - tried).max() < before:
            break
        share *= 0.5
    return tried, longer


def _derivative(moving: Flow, y, time):
    """``dy/dt`` of the state without derivatives."""
    law = Contacts(moving.problem.elements, moving.problem.system.W.shape[1])
    return replace(moving, variational=False).derivative(law)(time, y)
