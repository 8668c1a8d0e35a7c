"""Descent of a peak to peak with the derivatives of the contact problem: linear programs in a trust region.

With ``y(x)`` the transmission error at all positions, ``max y - min y`` is the least ``t`` with
``high - low <= t`` and ``low <= y_p <= high``. Every step solves that problem for the linearised ``y``
within a box around the point, by SciPy's HiGHS; the box shrinks where the linearisation promised too much
(K. Madsen, J. Inst. Maths Applics 16, 1975, 321-328: minimax by successive linear programs; steps and radii
after R. Fletcher, E. Sainz de la Maza, Math. Program. 43, 1989, 235-256). Most minima are corners: a method
that waits for a vanishing gradient finds none.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import set_deviations
from femgear.errors import ContactError, FemgearError, StorageError
from femgear.study.linearised import static_supports
from femgear.study.sensitivity import linearise, sensitivity
from femgear.study.variables import FLANK_ENTRIES, Variable
from femgear.trains.reading import with_values

if TYPE_CHECKING:
    from femgear.case.sections import Case
    from femgear.study.problem import Evaluations, Problem

_STEP = 1e-4
"""Half the difference of separations, over the range of the variable: their round-off is 1e-12 of that."""
_SMALLEST, _LEAST = 1e-4, 1e-5
"""Box, over the ranges, and gain, over the objective of the case, at which a descent ends."""


@dataclass(frozen=True)
class Descent:
    """End of a search.

    Parameters
    ----------
    x : (n,) array
        In the units of the variables.
    cost : float
        See `Evaluations.cost`.
    steps : int
    converged : bool
        Whether no step within the smallest box lowers the linearised objective any more.
    message : str
    """

    x: np.ndarray
    cost: float
    steps: int
    converged: bool
    message: str


def has_derivatives(problem: Problem) -> bool:
    """Whether the objective is a transmission error and all variables are deviations of the flanks alone."""
    case = problem.case
    sided = problem.objective.signal is not None and not case.static.back_flanks
    clear = not (case.static.members == "elastic" and case.planet.bearing_clearance)
    keys = [key for variable in problem.variables for key in variable.key]
    deviations = all(re.split(r"[.\[]", key.partition(".")[2])[0] in FLANK_ENTRIES for key in keys)
    return bool(sided and clear and deviations and not any(v.integer for v in problem.variables))


def descend(
    evaluations: Evaluations, start: Sequence[float], *, radius: float = 0.15, max_steps: int = 60
) -> Descent:
    """Minimum of a transmission error from a start, by successive linear programs.

    Parameters
    ----------
    evaluations : Evaluations
        Of a problem with `has_derivatives`.
    start : (n,) sequence
        In the units of the variables.
    radius : float
        Half the first box, over the ranges of the variables.
    max_steps : int

    Returns
    -------
    Descent
    """
    problem = evaluations.problem
    low, high = problem.bounds.T
    scale = evaluations.scale(problem.objective)
    x, cost = np.array(start, float), evaluations.cost(start)
    for step in range(max_steps):
        try:
            value, slopes = signals(evaluations, x)
        except StorageError:
            raise
        except FemgearError as error:
            return Descent(x, cost, step, False, f"no derivatives: {error.message}")
        while True:
            move, promised = _linear_program(value / scale, slopes / scale, x, low, high, radius)
            # the linearisation is that of the same contact problem: its value is the cost
            gain = float(np.ptp(value, axis=1).max()) / scale - promised
            if radius < _SMALLEST or gain < _LEAST:
                ended = "no linearised descent" if gain < _LEAST else "the smallest steps gain nothing"
                return Descent(x, cost, step, True, ended)
            # a bound may be missed by rounding
            trial = np.clip(x + move, low, high)
            new = evaluations.cost(trial)
            ratio = (cost - new) / gain
            if ratio > 0.75:
                radius = min(2.0 * radius, 0.5)
            elif ratio < 0.25:
                radius *= 0.35
            if ratio > 0.01:
                x, cost = trial, new
                break
    return Descent(x, cost, max_steps, False, f"{max_steps} steps were not enough")


def _linear_program(value, slopes, x, low, high, radius: float) -> tuple[np.ndarray, float]:
    """Step within the box, and the largest peak to peak that the linearisation promises there."""
    from scipy.optimize import linprog

    n, (K, P) = len(x), value.shape
    width = high - low
    # unknowns: n moves over their ranges, K highs, K lows, t
    flat = np.moveaxis(slopes, 0, -1).reshape(K * P, n) * width
    owner = np.kron(np.eye(K), np.ones((P, 1)))
    none, zeros = np.zeros((K * P, K)), np.zeros((K * P, 1))
    A = np.block(
        [
            [flat, -owner, none, zeros],
            [-flat, none, owner, zeros],
            [np.zeros((K, n)), np.eye(K), -np.eye(K), -np.ones((K, 1))],
        ]
    )
    b = np.concatenate([-value.ravel(), value.ravel(), np.zeros(K)])
    limits = [(max(-radius, lo), min(radius, hi)) for lo, hi in zip((low - x) / width, (high - x) / width)]
    cost = np.zeros(n + 2 * K + 1)
    cost[-1] = 1.0
    found = linprog(cost, A, b, bounds=[*limits, *[(None, None)] * (2 * K), (0, None)], method="highs")
    if found.x is None:
        return np.zeros(n), float(np.ptp(value, axis=1).max())
    return found.x[:n] * width, float(found.fun)


def signals(evaluations: Evaluations, x: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Transmission error (K, P) at a point and its derivatives (n, K, P) per unit of the variables.

    Kept in the journal. FemgearError: the point cannot be computed.
    """
    problem = evaluations.problem
    key = "derivatives of " + problem.objective.name + " at " + json.dumps(problem.point(x))
    record = evaluations.designs.journal.get(key)
    if record is None:
        value, slopes = _linearised(evaluations, x)
        record = {"value": value.tolist(), "slopes": slopes.tolist()}
        evaluations.designs.journal.add(key, record)
    return np.array(record["value"]), np.array(record["slopes"])


def _linearised(evaluations: Evaluations, x) -> tuple[np.ndarray, np.ndarray]:
    """As `signals`, from the contact problem at the point."""
    problem = evaluations.problem
    variant = evaluations.designs.variant(problem.point(x))
    case, objective = variant.case, problem.objective
    static = variant.static(objective.torque)
    linear = linearise(
        static.planetary_set,
        static.bodies,
        sun_torque=static.sun_torque,
        positions=case.static.positions,
        periods=static.cycle.periods,
        contact=case.static.contact,
        deviations=set_deviations(case),
        supports=static_supports(case),
    )
    n = static.planetary_set.n_planets
    value = objective.signal(linear.sun_arc, linear.deflection, n)
    slopes = []
    for variable, number in zip(problem.variables, x, strict=True):
        low, high = variable.bounds
        step = _STEP * (high - low)
        inside = min(max(float(number), low + step), high - step)
        found = sensitivity(linear, _deviations(case, variable), inside, step=step)
        slopes.append(objective.signal(found.sun_arc, found.deflection, n))
    if not np.isfinite(slopes).all():
        raise ContactError("a planet that carries nothing has no derivative", code="E-DERIVATIVE")
    return value, np.array(slopes)


def _deviations(case: Case, variable: Variable):
    """Deviations of the case for a value of one variable; not rounded as `Variable.text` does."""

    def variant(number: float):
        text = f"{number!r} {variable.unit}" if variable.unit else number
        return set_deviations(with_values(case, dict.fromkeys(variable.key, text)))

    return variant
