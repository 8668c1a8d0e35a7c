"""Lyapunov exponents: how fast motions that start side by side part or come together.

G. Benettin, L. Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15 (1980) 9-30: small motions are followed
along the motion and made orthogonal several times a period; the mean logarithm of their growth is
the exponent.
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

from femgear.errors import CaseError, ConvergenceError, checked_count, checked_numbers
from femgear.solvers.stability.floquet import Frame, frame_of
from femgear.solvers.time.adaptive import checked_start
from femgear.solvers.time.stroboscopic import PoincareSection, stroboscopic_map
from femgear.system.system import NonlinearSystem, element_forces

# parts of the run that are compared for the error
PARTS = 4
# errors by which an exponent differs from zero to have a sign, and exponent times period that is rounding
_CLEAR = 3.0
_ROUNDING = 1e-9
# small motions are made orthogonal this often in a period at least, and before they shrink by exp(-_FADED)
_PIECES = 4
_FADED = 3.0
_MOST_PIECES = 1000
# deviation of a section, relative to its size, within which it repeats, and motion beyond all bounds
_REPEATS = 1e-3
_BEYOND = 1e100
# relative change of a tangent that is rounding, and of the sum of all exponents that is refused
_SAME = 1e-9
_SUM = 0.02


@dataclass(frozen=True)
class LyapunovExponents:
    """The largest exponents of a motion, largest first.

    Parameters
    ----------
    exponents : (count,) array
        [1/s]
    scatter : (count,) array
        Standard error of the mean over finite time: four parts of the run and the first directions [1/s].
    step_error : (count,) array
        Change against the same periods with half the steps [1/s].
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
    same_tangents : bool
        The stiffness at every phase is the same in all periods: a linear system, or a motion that repeats.
    """

    exponents: np.ndarray
    scatter: np.ndarray
    step_error: np.ndarray
    growth: np.ndarray
    period: float
    section: PoincareSection
    lowest: np.ndarray
    highest: np.ndarray
    divergence: float
    same_tangents: bool

    @property
    def error(self) -> np.ndarray:
        """Scatter and error of the integration together, (count,) [1/s]."""
        return np.hypot(self.scatter, self.step_error)

    @property
    def largest(self) -> float:
        """Largest exponent [1/s]."""
        return float(self.exponents[0])

    @property
    def chaotic(self) -> bool | None:
        """Bounded, without repetition and with a positive exponent; None where this cannot be told.

        See `verdict` for the reason.
        """
        return self._judged()[0]

    @property
    def verdict(self) -> str:
        """Why `chaotic` is what it is."""
        return self._judged()[1]

    def _judged(self) -> tuple[bool | None, str]:
        value = f"largest exponent {self.largest:.3g} +- {self.error[0]:.1g} 1/s"
        zero = abs(self.largest) <= max(_CLEAR * self.error[0], _ROUNDING / self.period)
        if not zero and self.largest < 0.0:
            return False, f"{value}: neighbouring motions come together"
        if self.same_tangents:
            return False, f"{value}, but the stiffness repeats every period: linear there, not chaotic"
        if zero:
            return None, f"{value}: not told from zero, take more points or more steps"
        if self._grows():
            return None, f"{value}, but the motion grows: chaos is a property of bounded motions"
        if repeats := self.section.repeats_after(_REPEATS):
            return (
                None,
                f"{value}, but the motion repeats after {repeats} periods to {_REPEATS:g} of its size",
            )
        return True, f"{value}: neighbouring motions part"

    def _grows(self) -> bool:
        """Whether the motion is larger from part to part of the run, and no less so at its end."""
        both = (self.section.displacement, self.section.velocity)
        for states in both:
            parts = np.array([np.abs(part).max() for part in np.array_split(states, PARTS)])
            more = np.diff(parts)
            if np.all(more > 0.0) and more[-1] >= 0.5 * more[0] and parts[-1] > 1.1 * parts[0]:
                return True
        return False


@dataclass(frozen=True)
class LyapunovOptions:
    """How `lyapunov_exponents` integrates the motion and takes its means.

    Parameters
    ----------
    count : int
        Exponents wanted, up to two a coordinate; their sum is then ``divergence``.
    directions : int
        Random sets of first directions; that they agree says that the run was long enough for them to turn
        into the directions of strongest growth.
    points, skip : int
        Periods that count, and periods before them.
    steps : int
        Time steps in a period, of average acceleration, whose derivative (the trapezoidal rule) the small
        motions follow; 8 or more.
    periods : int
        Periods of the first base frequency between two points.
    seed : int
        Of the first directions.
    """

    count: int = 1
    directions: int = 3
    points: int = 300
    skip: int = 100
    steps: int = 200
    periods: int = 1
    seed: int = 0

    def __post_init__(self):
        least = {
            "points": 2 * PARTS,
            "skip": 0,
            "directions": 1,
            "count": 1,
            "seed": 0,
            "steps": 8,
            "periods": 1,
        }
        for name, lowest in least.items():
            number = checked_count(getattr(self, name), name, code="E-RANGE", least=lowest)
            object.__setattr__(self, name, number)


def lyapunov_exponents(problem: NonlinearSystem, frequency, *, start=None, **options) -> LyapunovExponents:
    """Find the largest Lyapunov exponents [1/s] of the motion from a start, and its stroboscopic section.

    Parameters
    ----------
    frequency : float or (n_bases,) array
        Base frequencies [rad/s] with a common period, see `stroboscopic_map`.
    start : pair of (n,) arrays, optional
        Displacement [m] and velocity [m/s] at phase zero; at rest when not given.
    options
        Fields of `LyapunovOptions`.

    Raises
    ------
    CaseError
        Numbers out of range (E-RANGE), frequencies without the common period.
    ConvergenceError
        A step whose column equations do not converge, a motion beyond all bounds (E-DIVERGED), exponents
        whose sum is not the divergence (E-INTEGRATION).

    Notes
    -----
    Free motions that no element and no damping feels (rotation of a free train), whose exponents are zero,
    are left out.
    """
    chosen = LyapunovOptions(**options)
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    start = checked_start(problem, start)
    finer, coarser = (
        _Stepped(problem, frequency, steps, chosen.periods) for steps in (chosen.steps, chosen.steps // 2)
    )
    return exponents_of(problem, finer, coarser, start, chosen, beside=chosen.points)


def exponents_of(
    problem: NonlinearSystem, finer, coarser, start, chosen: LyapunovOptions, *, beside: int
) -> LyapunovExponents:
    """Compute Lyapunov exponents (count,) [1/s] of a run, and their error from a coarser one beside it.

    Both integrate the problem and its tangents from passage to passage, with ``size``, ``period`` [s],
    ``divergence`` [1/s] and ``passages(start)``; the start is displacement (n,) [m] and velocity (n,) [m/s]
    at the first passage. The coarser run covers ``beside`` points.
    """
    count, points = chosen.count, chosen.points
    if count > finer.size:
        raise CaseError(f"{count} exponents", code="E-RANGE", key="count", limit=f"1 to {finer.size}, two a coordinate")
    random = np.random.default_rng(chosen.seed)
    frames = np.linalg.qr(random.standard_normal((chosen.directions, finer.size, count)))[0]
    passages = finer.passages(start)
    for _, (_, matrices) in zip(range(chosen.skip), passages):
        frames, _ = _turned(frames, matrices)
    growth, rows, same = _followed(passages, frames, points, problem)
    q, v, x, low, high = (np.array(part) for part in zip(*rows))
    # the same attractor and the same directions, so that only the steps differ
    other, _, _ = _followed(coarser.passages((q[0], v[0])), frames, beside, problem)
    exponents, scatter = _means(growth / finer.period)
    step_error = np.abs(_means((other - growth[:beside]) / finer.period)[0])
    _check_sum(exponents, scatter, finer)
    time = finer.period * (chosen.skip + np.arange(points))
    return LyapunovExponents(
        exponents,
        scatter,
        step_error,
        growth,
        finer.period,
        PoincareSection(time, q, v, x),
        low.min(axis=0),
        high.max(axis=0),
        finer.divergence,
        same,
    )


def _turned(frames, matrices):
    """Frames after the pieces of a period, and the logarithm of their growth (directions, count)."""
    growth = 0.0
    for matrix in matrices:
        frames, triangle = np.linalg.qr(matrix @ frames)
        growth = growth + np.log(np.abs(np.diagonal(triangle, axis1=-2, axis2=-1)))
    return frames, growth


def _followed(passages: Iterator, frames, points: int, problem):
    """Growth (points, directions, count), what the motion does, whether tangents repeat."""
    growth, rows, first, same = [], [], None, True
    for _, ((q, v, x, theta), matrices) in zip(range(points), passages):
        frames, grown = _turned(frames, matrices)
        growth.append(grown)
        rows.append((q, v, x[0], x.min(axis=0), x.max(axis=0)))
        if same:
            tangent = element_forces(problem, x, theta)[1]
            first = tangent if first is None else first
            same = bool(np.abs(tangent - first).max(initial=0.0) <= _SAME * np.abs(first).max(initial=0.0))
    return np.array(growth), rows, same


def _check_sum(exponents, scatter, run) -> None:
    """Refuse a complete set of exponents that does not add up to the divergence."""
    if len(exponents) < run.size:
        return
    off = abs(exponents.sum() - run.divergence)
    if off > max(_SUM * np.abs(exponents).max(), _CLEAR * scatter.max(), _ROUNDING / run.period):
        raise ConvergenceError(
            f"the exponents add up to {exponents.sum():.6g} 1/s, the damping to {run.divergence:.6g} 1/s",
            code="E-INTEGRATION",
            limit="the same to 2 % of the largest one",
            remedy="take more steps a period or a smaller tolerance",
        )


def check_bounded(q, v) -> None:
    """Refuse displacements q (n,) [m] and velocities v (n,) [m/s] beyond all bounds (E-DIVERGED)."""
    if not (np.abs(q).max(initial=0.0) < _BEYOND and np.abs(v).max(initial=0.0) < _BEYOND):
        raise ConvergenceError(
            "the motion grows beyond all bounds and has no attractor",
            code="E-DIVERGED",
            limit=f"displacements and velocities below {_BEYOND:g}",
            remedy="start elsewhere, or give supports or damping that hold the motion",
        )


def pieces(damping, period: float) -> int:
    """Count the parts of a period [s] after which small motions are made orthogonal, by damping [1/s]."""
    fading = float(np.linalg.norm(damping, 2)) if len(damping) else 0.0
    return int(min(max(_PIECES, np.ceil(fading * period / _FADED)), _MOST_PIECES))


def _means(rate):
    """Weighted mean (count,) of rates (points, directions, count), and its standard error."""
    mean = _weighted(rate)
    parts = np.array([_weighted(part).mean(axis=0) for part in np.array_split(rate, PARTS)])
    scatter = parts.std(axis=0, ddof=1) / np.sqrt(PARTS)
    return mean.mean(axis=0), np.hypot(scatter, np.ptp(mean, axis=0))


def _weighted(rate):
    s = (np.arange(len(rate)) + 0.5) / len(rate)
    weight = np.exp(-1.0 / (s * (1.0 - s)))
    return np.tensordot(weight / weight.sum(), rate, 1)


class _Stepped:
    """Periods of fixed steps and the derivatives of their maps in modal coordinates."""

    def __init__(self, problem, frequency, steps, periods):
        self._once = stroboscopic_map(problem, frequency, steps=steps, periods=periods)
        self._frame: Frame = frame_of(problem, modes=len(problem.system.M))
        self.period = self._once.period
        self.size = 2 * len(self._frame.square)
        self.divergence = -float(np.trace(self._frame.damping))
        natural = self._frame.fastest or 2.0 * np.pi / self.period
        self._scale = np.repeat([1.0, natural], len(self._frame.square))
        self._pieces = min(pieces(self._frame.damping, self.period), steps)

    def passages(self, start):
        """Motion at the start of every period, deflections and phases in it, derivatives of its parts."""
        once = self._once
        state, g = once.enter(start)
        while True:
            block = once.run(state, g)
            x = once.columns(block)
            q, v = once.motion(block, np.array([0]))
            check_bounded(q, v)
            yield (q[0], v[0], x, once.theta), self._map(x)
            state, g = block.states[-1], block.excess[-1]

    def _map(self, x) -> list[np.ndarray]:
        """Products over parts of the period of the steps ``(1 - h/2 A_{i+1})^-1 (1 + h/2 A_i)``."""
        once, scale = self._once, self._scale
        kappa = self._frame.kappa(element_forces(once.problem, x, once.theta)[1])
        half = 0.5 * self.period / (len(x) - 1) * self._frame.state_matrices(kappa) * scale / scale[:, None]
        unit = np.eye(self.size)
        factors = np.linalg.solve(unit - half[1:], unit + half[:-1])
        return [_product(part) for part in np.array_split(factors, self._pieces)]


def _product(factors):
    """Product of matrices in the order of time, the later one on the left, pair by pair."""
    while len(factors) > 1:
        rest = factors[len(factors) // 2 * 2 :]
        factors = np.concatenate([factors[1::2] @ factors[: len(factors) // 2 * 2 : 2], rest])
    return factors[0]
