"""Lyapunov exponents by adaptive integration, with a stop at every contact change."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from femgear.errors import checked_numbers, checked_tolerance
from femgear.solvers.stability.lyapunov import (
    PARTS,
    LyapunovExponents,
    LyapunovOptions,
    check_bounded,
    exponents_of,
    pieces,
)
from femgear.solvers.time.adaptive import checked_start, flow, motion_scale, trajectory
from femgear.solvers.time.stroboscopic import strobe_period
from femgear.system.system import NonlinearSystem

# factor of the tolerance in the run that stands beside for the error of the integration
_COARSER = 1e3


def adaptive_exponents(
    problem: NonlinearSystem, frequency, *, start=None, tolerance: float = 1e-10, **options
) -> LyapunovExponents:
    """Find Lyapunov exponents [1/s] with motion and small motions by DOP853 to ``tolerance``.

    Free motions are among them. The error is told by a quarter of the points with a thousand times the
    tolerance; other arguments as for `lyapunov_exponents`, ``steps`` being instants looked at in a period.
    """
    chosen, tolerance = LyapunovOptions(**options), checked_tolerance(tolerance)
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    finer, coarser = (
        _Adaptive(problem, frequency, chosen.steps, chosen.periods, tolerated)
        for tolerated in (tolerance, min(tolerance * _COARSER, 1e-2))
    )
    beside = max(2 * PARTS, chosen.points // 4)
    return exponents_of(problem, finer, coarser, checked_start(problem, start), chosen, beside=beside)


class _Adaptive:
    """Periods of the adaptive integrator with the derivatives of the state."""

    def __init__(self, problem, frequency, samples, periods, tolerance):
        self.period = strobe_period(frequency, periods)
        self._flow = flow(problem, frequency, variational=True)
        self._tolerance = tolerance
        self.size = 2 * self._flow.size
        damping = np.linalg.solve(problem.system.M, problem.damping)
        self.divergence = -float(np.trace(damping))
        self._times = self.period * np.linspace(0.0, 1.0, samples + 1)
        self._ends = self.period * np.linspace(0.0, 1.0, pieces(damping, self.period) + 1)

    def passages(self, start):
        """As for fixed steps, in displacements and scaled velocities."""
        moving, (q, v) = self._flow, start
        theta = self._times[:, None] * moving.frequency
        while True:
            check_bounded(q, v)
            options = {
                "tolerance": self._tolerance,
                "events": True,
                "scale": motion_scale(moving, (q, v)) or 1.0,
            }
            first, x, matrices = (q, v), np.tile(moving.rows @ q, (len(theta), 1)), []
            for begin, end in pairwise(self._ends):
                y = moving.state(q, v)
                for t0, t1, dense in trajectory(moving, y, begin, end, **options):
                    inside = np.flatnonzero((self._times > t0) & (self._times <= t1))
                    if len(inside):
                        x[inside] = moving.split(dense(self._times[inside]))[2].T
                    y = dense(t1)
                matrices.append(moving.tangents(y))
                q, v, _ = moving.split(y)
            yield (*first, x, theta), matrices
