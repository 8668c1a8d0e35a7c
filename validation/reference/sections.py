"""Stroboscopic sections of a motion, and bifurcation diagrams of sections over a parameter.

A. H. Nayfeh and B. Balachandran, Applied Nonlinear Dynamics (1995), sections 1.2 and 2.4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, checked_numbers, checked_tolerance
from femgear.solvers.time.stroboscopic import PoincareSection, stroboscopic_map
from femgear.system.system import NonlinearSystem


@dataclass(frozen=True)
class BifurcationDiagram:
    """Stroboscopic points over a parameter.

    Parameters
    ----------
    parameter : (n_values,) array
    displacement, velocity : (n_values, n_points, n) arrays
    deflection : (n_values, n_points, n_columns) array
        [m].
    repeats : (n_values,) int array
        Periods after which the motion repeats, 0 where it does not within half the points.
    """

    parameter: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    deflection: np.ndarray
    repeats: np.ndarray


def stroboscopic_section(
    problem: NonlinearSystem,
    frequency,
    *,
    points: int = 100,
    skip: int = 100,
    start=None,
    phase: float = 0.0,
    **steps,
) -> PoincareSection:
    """Take the motion once in every period.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : float or (n_bases,) array
        [rad/s]
    points : int
        Periods that give a point.
    skip : int
        Periods before them.
    start : pair of (n,) arrays, optional
        Displacement and velocity at phase zero; at rest when not given.
    phase : float
        Share of the period at which the points are taken, rounded to a step, 0 to 1.
    steps
        ``steps``, ``periods``, ``method`` of `stroboscopic_map`.
    """
    if points < 1 or skip < 0 or not 0.0 <= phase <= 1.0:
        raise CaseError(
            f"{points} points after {skip} periods at phase {phase}",
            code="E-RANGE",
            limit="one point or more, no negative skip, a phase between 0 and 1",
        )
    once = stroboscopic_map(problem, frequency, **steps)
    state, g = once.enter(start)
    count = len(once.loads)
    place = np.array([round(phase * count)])
    rows = []
    for done in range(skip + points):
        block = once.run(state, g)
        if done >= skip:
            rows.append((*once.motion(block, place), once.columns(block)[place]))
        state, g = block.states[-1], block.excess[-1]
    q, v, x = (np.concatenate(part) for part in zip(*rows))
    time = once.period * (skip + np.arange(points) + place[0] / count)
    return PoincareSection(time, q, v, x)


def bifurcation_diagram(
    build: Callable[[float], tuple[NonlinearSystem, np.ndarray]],
    parameters,
    *,
    points: int = 60,
    start=None,
    tolerance: float = 1e-4,
    **section,
) -> BifurcationDiagram:
    """Take stroboscopic points over a parameter; every value starts where the last one ended.

    Parameters
    ----------
    build : callable
        Problem and base frequencies [rad/s] for a value of the parameter.
    parameters : (n_values,) array
        In the order in which they are swept.
    tolerance : float
        For ``repeats``, see `PoincareSection.repeats_after`.
    points, start, section
        Options of `stroboscopic_section`.

    Raises
    ------
    CaseError
        No values or some that are not finite (E-RANGE), a start that does not fit (E-START).
    """
    tolerance = checked_tolerance(tolerance)
    parameters = np.atleast_1d(checked_numbers(parameters, "parameters", code="E-RANGE", unit=""))
    if parameters.ndim != 1 or not len(parameters) or not np.all(np.isfinite(parameters)):
        raise CaseError(
            f"a bifurcation diagram over parameters of shape {parameters.shape}",
            code="E-RANGE",
            key="parameters",
            limit="one or more finite numbers",
            remedy="list the values to sweep over",
        )
    rows = []
    for value in parameters:
        taken = stroboscopic_section(*build(value), points=points, start=start, **section)
        rows.append((taken.displacement, taken.velocity, taken.deflection, taken.repeats_after(tolerance)))
        start = taken.displacement[-1], taken.velocity[-1]
    return BifurcationDiagram(parameters, *(np.array(column) for column in zip(*rows)))
