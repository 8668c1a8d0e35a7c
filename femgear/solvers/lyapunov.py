"""Lyapunov exponents: how fast motions that start side by side part or come together.

G. Benettin, L. Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15 (1980) 9-30: small motions are followed
along the motion and made orthogonal after every period; the mean logarithm of their growth is the exponent.
Element forces are continuous, so that small motions do not jump at contact changes: the saltation matrix is
the unit matrix (R. I. Leine and H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems,
section 7.2). Means over the periods are weighted by exp(-1 / (s (1 - s))), which for regular motions
converges faster than any power of their number (S. Das, Y. Saiki, E. Sander and J. A. Yorke, Nonlinearity 30
(2017) 4111-4140).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.adaptive import flow, trajectory
from femgear.solvers.initial_state import checked_start, motion_scale
from femgear.solvers.nonlinear import NonlinearSystem, element_forces
from femgear.solvers.poincare import PoincareSection
from femgear.solvers.strobe import common_period, strobe
from femgear.solvers.variational import Frame, frame_of

# parts of the run that are compared for the error
_PARTS = 4
# errors by which an exponent must differ from zero to have a sign
_CLEAR = 3.0


@dataclass(frozen=True)
class LyapunovExponents:
    """The largest exponents of a motion, largest first.

    Parameters
    ----------
    exponents : (count,) array
        [1/s]
    error : (count,) array
        Of the mean over finite time, in one standard deviation: scatter of four parts of the run and of the
        first directions. The error of the integration is not in it: repeat with more ``steps``.
    growth : (periods, directions, count) array
        Logarithm of the growth in every period.
    period : float
        [s]
    section : PoincareSection
        The motion at phase zero of every period that counts.
    lowest, highest : (n_columns,) arrays
        Smallest and largest deflection over these periods, at the steps of the integration [m].
    divergence : float
        ``-trace(M^-1 C)`` of the coordinates followed: the sum of all their exponents [1/s].
    """

    exponents: np.ndarray
    error: np.ndarray
    growth: np.ndarray
    period: float
    section: PoincareSection
    lowest: np.ndarray
    highest: np.ndarray
    divergence: float

    @property
    def largest(self) -> float:
        """[1/s]"""
        return float(self.exponents[0])

    @property
    def chaotic(self) -> bool | None:
        """The largest exponent is positive; None where it is zero to within three errors."""
        if abs(self.exponents[0]) <= _CLEAR * self.error[0]:
            return None
        return bool(self.exponents[0] > 0.0)


def lyapunov_exponents(
    problem: NonlinearSystem,
    frequency,
    *,
    count: int = 1,
    directions: int = 3,
    points: int = 300,
    skip: int = 100,
    start=None,
    steps: int = 200,
    periods: int = 1,
    method: str = "average acceleration",
    tolerance: float = 1e-10,
    seed: int = 0,
) -> LyapunovExponents:
    """The largest exponents of the motion from a start, and its stroboscopic section.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : float or (n_bases,) array
        Base frequencies [rad/s] with a common period, see `strobe`.
    count : int
        Exponents wanted, up to two a coordinate; their sum is then ``divergence``.
    directions : int
        Random sets of first directions; that they agree says that the run was long enough for them to turn
        into the directions of strongest growth.
    points : int
        Periods that count.
    skip : int
        Periods before them.
    start : pair of (n,) arrays, optional
        Displacement and velocity at phase zero; at rest when not given.
    steps : int
        Time steps in a period, of average acceleration.
    periods : int
        Periods of the first base frequency between two points.
    method : str
        "average acceleration": fixed steps; the small motions follow the derivative of these steps, the
        trapezoidal rule. "DOP853": motion and small motions to ``tolerance``, with a stop at every contact
        change; slower.
    tolerance : float
        Of DOP853.
    seed : int
        Of the first directions.

    Raises
    ------
    CaseError
        Numbers out of range (E-LYAPUNOV), frequencies without the common period, an unknown method.
    ConvergenceError
        A step whose column equations do not converge.

    Notes
    -----
    Fixed steps leave out free motions that no element and no damping feels (rotation of a free train), whose
    exponents are zero; DOP853 has them among the exponents.
    """
    if points < 2 * _PARTS or skip < 0 or directions < 1:
        raise CaseError(
            f"exponents of {points} periods after {skip}, {directions} directions", code="E-LYAPUNOV",
            limit=f"{2 * _PARTS} periods or more, no negative skip, one direction or more",
        )  # fmt: skip
    frequency = np.atleast_1d(np.asarray(frequency, float))
    start = checked_start(problem, start)
    if method == "average acceleration":
        runs = _Stepped(problem, frequency, steps, periods)
    elif method == "DOP853":
        runs = _Adaptive(problem, frequency, steps, periods, tolerance)
    else:
        raise CaseError(
            f"exponents by {method!r}", code="E-METHOD", key="method", limit="average acceleration or DOP853"
        )
    if not 1 <= count <= runs.size:
        raise CaseError(
            f"{count} exponents", code="E-LYAPUNOV", key="count", limit=f"1 to {runs.size}, two a coordinate"
        )
    first = np.random.default_rng(seed).standard_normal((directions, runs.size, count))
    growth, rows = _followed(runs.passages(start), np.linalg.qr(first)[0], skip, points)
    q, v, x, low, high = (np.array(part) for part in zip(*rows))
    time = runs.period * (skip + np.arange(points))
    exponents, error = _means(growth / runs.period)
    return LyapunovExponents(
        exponents, error, growth, runs.period, PoincareSection(time, q, v, x), low.min(axis=0),
        high.max(axis=0), runs.divergence,
    )  # fmt: skip


def _followed(passages: Iterator, frames, skip: int, points: int):
    """Growth (points, directions, count) of the frames and what the motion does in every period."""
    growth, rows = [], []
    for number in range(skip + points):
        motion, matrix = next(passages)
        frames, triangle = np.linalg.qr(matrix @ frames)
        if number >= skip:
            growth.append(np.log(np.abs(np.diagonal(triangle, axis1=-2, axis2=-1))))
            rows.append(motion)
    return np.array(growth), rows


def _means(rate):
    """Weighted mean (count,) of rates (points, directions, count), and its standard error."""
    mean = _weighted(rate)
    parts = np.array([_weighted(part).mean(axis=0) for part in np.array_split(rate, _PARTS)])
    scatter = parts.std(axis=0, ddof=1) / np.sqrt(_PARTS)
    return mean.mean(axis=0), np.hypot(scatter, np.ptp(mean, axis=0))


def _weighted(rate):
    s = (np.arange(len(rate)) + 0.5) / len(rate)
    weight = np.exp(-1.0 / (s * (1.0 - s)))
    return np.tensordot(weight / weight.sum(), rate, 1)


class _Stepped:
    """Periods of fixed steps and the derivatives of their maps in modal coordinates."""

    def __init__(self, problem, frequency, steps, periods):
        self._strobe = strobe(problem, frequency, steps=steps, periods=periods)
        self._frame: Frame = frame_of(problem, modes=len(problem.system.M))
        self.period = self._strobe.period
        self.size = 2 * len(self._frame.square)
        self.divergence = -float(np.trace(self._frame.damping))
        natural = self._frame.fastest or 2.0 * np.pi / self.period
        self._scale = np.repeat([1.0, natural], len(self._frame.square))

    def passages(self, start):
        """Motion at the start of every period, its extremes, and the derivative of its map."""
        once = self._strobe
        state, g = once.enter(start)
        while True:
            block = once.run(state, g)
            x = once.columns(block)
            q, v = once.motion(block, np.array([0]))
            yield (q[0], v[0], x[0], x.min(axis=0), x.max(axis=0)), self._map(x)
            state, g = block.states[-1], block.excess[-1]

    def _map(self, x):
        """Product of the steps ``(1 - h/2 A_{i+1})^-1 (1 + h/2 A_i)``."""
        once, scale = self._strobe, self._scale
        kappa = self._frame.kappa(element_forces(once.problem, x, once.theta)[1])
        half = 0.5 * self.period / (len(x) - 1) * self._frame.state_matrices(kappa) * scale / scale[:, None]
        unit = np.eye(self.size)
        factors = np.linalg.solve(unit - half[1:], unit + half[:-1])
        while len(factors) > 1:
            # pairs, the later one on the left
            rest = factors[len(factors) // 2 * 2 :]
            factors = np.concatenate([factors[1::2] @ factors[: len(factors) // 2 * 2 : 2], rest])
        return factors[0]


class _Adaptive:
    """Periods of the adaptive integrator with the derivatives of the state."""

    def __init__(self, problem, frequency, samples, periods, tolerance):
        self.period = common_period(frequency, periods)
        self._flow = flow(problem, frequency, variational=True)
        self._samples, self._tolerance = samples, tolerance
        self.size = 2 * self._flow.size
        self.divergence = -float(np.trace(np.linalg.solve(problem.system.M, problem.damping)))

    def passages(self, start):
        """As for fixed steps, in displacements and scaled velocities."""
        moving = self._flow
        q, v = start
        while True:
            options = {"tolerance": self._tolerance, "events": True, "scale": motion_scale(moving, (q, v))}
            x0, y = moving.rows @ q, moving.state(q, v)
            low, high = x0, x0
            for t0, t1, dense in trajectory(moving, y, 0.0, self.period, **options):
                inside = max(2, int(np.ceil((t1 - t0) / self.period * self._samples)) + 1)
                x = moving.split(dense(np.linspace(t0, t1, inside)))[2]
                low, high, end = np.minimum(low, x.min(axis=1)), np.maximum(high, x.max(axis=1)), dense(t1)
            yield (q, v, x0, low, high), moving.tangents(end)
            q, v, _ = moving.split(end)
