"""Poincare sections: once a period, or where the motion crosses a surface; bifurcation diagrams from them.

A. H. Nayfeh and B. Balachandran, Applied Nonlinear Dynamics (1995), sections 1.2 and 2.4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, checked_numbers, checked_tolerance
from femgear.solvers.time.adaptive import checked_start, flow, motion_scale, trajectory
from femgear.solvers.time.stroboscopic import strobe
from femgear.system.system import NonlinearSystem, checked_bases

# Instants inside a step of the integrator at which crossings are looked for.
_SAMPLES = 8


@dataclass(frozen=True)
class PoincareSection:
    """Points of a section.

    Parameters
    ----------
    time : (n_points,) array
        [s].
    displacement, velocity : (n_points, n) arrays
    deflection : (n_points, n_columns) array
        ``W^T q`` [m].
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    deflection: np.ndarray

    def repeats_after(self, tolerance: float = 1e-4) -> int:
        """Smallest number p of points after which all displacements repeat; 0 when none up to a half does.

        The tolerance is relative to the largest displacement. A motion of period p times that of the section.
        """
        q, size = self.displacement, np.abs(self.displacement).max(initial=0.0)
        for p in range(1, len(q) // 2 + 1):
            if np.abs(q[p:] - q[:-p]).max() <= tolerance * size:
                return p
        return 0


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
    steps: int = 200,
    periods: int = 1,
    phase: float = 0.0,
    method: str = "average acceleration",
) -> PoincareSection:
    """The motion once in every period.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : float or (n_bases,) array
        [rad/s]; see `strobe`.
    points : int
        Periods that give a point.
    skip : int
        Periods before them.
    start : pair of (n,) arrays, optional
        Displacement and velocity at phase zero; at rest when not given.
    steps : int
        Time steps in a period.
    periods : int
        Periods of the first base frequency between two points.
    phase : float
        Share of the period at which the points are taken, rounded to a step, 0 to 1.
    method : str
        A fixed-step method of `solve_transient`.
    """
    if points < 1 or skip < 0 or not 0.0 <= phase <= 1.0:
        raise CaseError(
            f"{points} points after {skip} periods at phase {phase}", code="E-SECTION",
            limit="one point or more, no negative skip, a phase between 0 and 1",
        )  # fmt: skip
    period = strobe(problem, frequency, steps=steps, periods=periods, method=method)
    state, g = period.enter(start)
    place = np.array([round(phase * steps)])
    rows = []
    for count in range(skip + points):
        block = period.run(state, g)
        if count >= skip:
            rows.append((*period.motion(block, place), period.columns(block)[place]))
        state, g = block.states[-1], block.excess[-1]
    q, v, x = (np.concatenate(part) for part in zip(*rows))
    time = period.period * (skip + np.arange(points) + place[0] / steps)
    return PoincareSection(time, q, v, x)


def surface_section(
    problem: NonlinearSystem,
    frequency,
    row,
    *,
    end: float,
    begin: float = 0.0,
    value: float = 0.0,
    direction: int = 1,
    start=None,
    events: bool = True,
    tolerance: float = 1e-10,
) -> PoincareSection:
    """Points where ``row . (q, v)`` passes through ``value``, to the accuracy of the integrator.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : float or (n_bases,) array
        [rad/s].
    row : (2n,) array
        Of displacements and velocities.
    end, begin : float
        The motion starts at time zero; crossings from ``begin`` to ``end`` count [s].
    value : float
    direction : int
        1 upwards, -1 downwards, 0 both.
    start : pair of (n,) arrays, optional
        At rest when not given.
    events, tolerance
        As for `solve_transient`.
    """
    n = len(problem.system.M)
    row = checked_numbers(row, "row", code="E-SECTION", unit="")
    tolerance, frequency = checked_tolerance(tolerance), checked_bases(problem, frequency)
    if row.shape != (2 * n,) or direction not in (-1, 0, 1) or not 0.0 <= begin < end:
        raise CaseError(
            f"a section by {row.shape} numbers in direction {direction}", code="E-SECTION",
            limit=f"({2 * n},), direction -1, 0 or 1, 0 <= begin < end",
        )  # fmt: skip
    moving = flow(problem, frequency)
    row = np.concatenate([row[:n], row[n:] * moving.rate])
    start = checked_start(problem, start)
    options = {"tolerance": tolerance, "events": events, "scale": motion_scale(moving, start)}
    times, states = [], []
    for t0, t1, dense in trajectory(moving, moving.state(*start), 0.0, end, **options):
        if t1 >= begin:
            found = _crossings(dense, row, value, direction, t0, t1)
            times += found
            states += [dense(t) for t in found]
    kept = np.array(times) >= begin
    q, v, x = moving.split(np.array(states).reshape(-1, 2 * n).T)
    return PoincareSection(np.array(times)[kept], q.T[kept], v.T[kept], x.T[kept])


def bifurcation_diagram(
    build: Callable[[float], tuple[NonlinearSystem, np.ndarray]],
    parameters,
    *,
    points: int = 60,
    skip: int = 100,
    start=None,
    steps: int = 200,
    periods: int = 1,
    tolerance: float = 1e-4,
    method: str = "average acceleration",
) -> BifurcationDiagram:
    """Stroboscopic points over a parameter; every value starts where the last one ended.

    Parameters
    ----------
    build : callable
        Problem and base frequencies [rad/s] for a value of the parameter.
    parameters : (n_values,) array
        In the order in which they are swept.
    tolerance : float
        For ``repeats``, see `PoincareSection.repeats_after`.
    points, skip, start, steps, periods, method
        As for `stroboscopic_section`.

    Raises
    ------
    CaseError
        No values or some that are not finite (E-VALUES), a start that does not fit (E-START).
    """
    tolerance = checked_tolerance(tolerance)
    parameters = np.atleast_1d(checked_numbers(parameters, "parameters", code="E-VALUES", unit=""))
    if parameters.ndim != 1 or not len(parameters) or not np.all(np.isfinite(parameters)):
        raise CaseError(
            f"a bifurcation diagram over parameters of shape {parameters.shape}", code="E-VALUES",
            key="parameters", limit="one or more finite numbers", remedy="list the values to sweep over",
        )  # fmt: skip
    rows = []
    for value in parameters:
        problem, frequency = build(value)
        section = stroboscopic_section(
            problem,
            frequency,
            points=points,
            skip=skip,
            start=start,
            steps=steps,
            periods=periods,
            method=method,
        )
        rows.append(
            (section.displacement, section.velocity, section.deflection, section.repeats_after(tolerance))
        )
        start = section.displacement[-1], section.velocity[-1]
    return BifurcationDiagram(parameters, *(np.array(column) for column in zip(*rows)))


def _crossings(dense, row, value, direction, t0, t1) -> list[float]:
    """Instants in a step where ``row . y`` passes through the value."""
    from scipy.optimize import brentq

    times = np.linspace(t0, t1, _SAMPLES + 1)
    level = row @ dense(times) - value
    up, down = (level[:-1] < 0.0) & (level[1:] >= 0.0), (level[:-1] > 0.0) & (level[1:] <= 0.0)
    wanted = (up if direction >= 0 else False) | (down if direction <= 0 else False)
    return [
        brentq(lambda t: row @ dense(t) - value, times[k], times[k + 1], xtol=1e-14 * max(abs(t1), 1e-300))
        for k in np.flatnonzero(wanted)
    ]
