"""The map of one period, and what its repetition shows: sections and slow sweeps.

Fixed steps of one period are tabulated once and repeated from period to period (`stroboscopic_map`). The
motion once a period is a stroboscopic section (A. H. Nayfeh and B. Balachandran, Applied Nonlinear Dynamics,
1995, sections 1.2 and 2.4). A sweep starts every frequency from the end of the last one, so that it jumps
where a branch ends; T. C. Kim, T. E. Rook and R. Singh, J. Sound Vib. 281 (2005) 965-993, sweep gear pairs
so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_count, checked_numbers, checked_tolerance
from femgear.solvers.time.adaptive import checked_start
from femgear.solvers.time.steps import Marched, Scheme, march
from femgear.solvers.time.transient import step_scheme
from femgear.system.fourier import harmonics_of
from femgear.system.system import Law, NonlinearSystem, tabulated_law

# Largest number of steps in a period, and so the memory of its states.
_MOST_STEPS = 100_000


@dataclass(frozen=True)
class StroboscopicMap:
    """The map of one period of a problem, all tables of its steps made once.

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    frequency : (n_bases,) array
        Base frequencies [rad/s].
    period : float
        Length of the period [s].
    scheme : Scheme
        Rule of one step, its matrices factorised.
    law, loads
        Forces of the columns and external loads at the instants of one period, see `march`.
    theta : (steps + 1, n_bases) array
        Phases of the base frequencies at these instants [rad].
    """

    problem: NonlinearSystem
    frequency: np.ndarray
    period: float
    scheme: Scheme
    law: Law
    loads: np.ndarray
    theta: np.ndarray

    def enter(self, start):
        """Make state and column forces of displacement (n,) [m] and velocity (n,) [m/s]; rest for None."""
        q, v = checked_start(self.problem, start)
        return self.scheme.start(q, v, self.theta[:1], self.law)

    def run(self, state, g) -> Marched:
        """Integrate one period of motion from a state at phase zero and its column forces g (n_c,) [N]."""
        block = march(self.scheme, self.law, self.loads, state, g, len(self.loads), tolerance=1e-10, max_iterations=30)
        if block.steps < len(self.loads):
            raise ConvergenceError(
                f"the column equations did not converge in step {block.steps + 1} of a period at "
                f"{self.frequency[0]:.6g} rad/s",
                code="E-CONVERGENCE",
                remedy="take more steps a period",
            )
        return block

    def columns(self, block: Marched) -> np.ndarray:
        """Compute the deflections (steps + 1, n_c) [m] of a period."""
        return self.scheme.columns(block.states, block.excess, self.theta)

    def motion(self, block: Marched, index):
        """Compute displacement [m] and velocity [m/s], (k, n) each, at instants (k,) of the period."""
        part = self.scheme.motion(block.states[index], block.excess[index], self.theta[index])
        return part[0], part[1]


def stroboscopic_map(
    problem: NonlinearSystem,
    frequency,
    *,
    steps: int = 200,
    periods: int = 1,
    method: str = "average acceleration",
) -> StroboscopicMap:
    """Make the map of one period [s] of the motion.

    CaseError: base frequencies that do not repeat then, steps out of range or beyond the stability limit.

    Parameters
    ----------
    frequency : float or (n_bases,) array
        Base frequencies [rad/s]; all must repeat after ``periods`` periods of the first one.
    steps : int
        Equal time steps in a period of the map.
    periods : int
        Periods of the first base frequency in one of the map: 2 measures period doubling.
    method : str
        A fixed-step method of `solve_transient`.
    """
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    period = strobe_period(frequency, periods)
    if not 4 <= steps <= _MOST_STEPS:
        raise CaseError(f"{steps} steps in a period", code="E-RANGE", key="steps", limit=f"4 to {_MOST_STEPS}")
    scheme, _ = step_scheme(problem, frequency, method, period / steps, period / steps)
    theta = (period * np.arange(steps + 1) / steps)[:, None] * frequency
    # the last instant is the first of the next period
    theta[-1] = theta[0]
    return StroboscopicMap(
        problem, frequency, period, scheme, tabulated_law(problem, theta), scheme.table(theta), theta
    )


def strobe_period(frequency, periods: int) -> float:
    """Compute the length [s] of ``periods`` periods of the first base frequency; others must repeat then."""
    periods = checked_count(periods, "periods", code="E-RANGE")
    if not np.all(np.isfinite(frequency)) or not frequency[0] > 0.0:
        raise CaseError(
            f"{periods} periods of {frequency.tolist()} rad/s",
            code="E-RANGE",
            key="frequency",
            limit="one period or more of a positive frequency",
        )
    turns = frequency * periods / frequency[0]
    if np.any(np.abs(turns - np.rint(turns)) > 1e-9):
        raise CaseError(
            f"base frequencies {frequency.tolist()} rad/s do not repeat after {periods} periods of the first",
            code="E-RANGE",
            key="periods",
            limit="whole numbers of periods of every base frequency",
            remedy="raise the number of periods, or use harmonic balance with two base frequencies",
        )
    return float(2.0 * np.pi * periods / frequency[0])


@dataclass(frozen=True)
class PoincareSection:
    """Points of a section, taken once a period.

    Parameters
    ----------
    time : (n_points,) array
        [s].
    displacement, velocity : (n_points, n) arrays
        [m], [m/s].
    deflection : (n_points, n_columns) array
        ``W^T q`` [m].
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    deflection: np.ndarray

    def repeats_after(self, tolerance: float = 1e-4) -> int:
        """Find the number p of points after which all displacements repeat; 0 when none up to a half does.

        The tolerance is relative to the largest displacement. A motion of period p times that of the section.
        """
        q, size = self.displacement, np.abs(self.displacement).max(initial=0.0)
        for p in range(1, len(q) // 2 + 1):
            if np.abs(q[p:] - q[:-p]).max() <= tolerance * size:
                return p
        return 0


@dataclass(frozen=True)
class SweepResponse:
    """Settled motion at every frequency of a sweep, in the order of the sweep.

    Parameters
    ----------
    frequency : (n_frequencies,) array
        First base frequency [rad/s].
    amplitude : (n_frequencies, n_columns) array
        Half the difference of largest and smallest deflection [m].
    lowest, highest : (n_frequencies, n_columns) arrays
        Smallest and largest deflection [m].
    lines : (n_frequencies, n_columns, H + 1) complex array
        Harmonics of the deflections over one period of the map [m].
    settled : (n_frequencies,) bool array
        The motion repeats after one period of the map within the tolerance.
    periods : (n_frequencies,) int array
        Periods of the map until then.
    displacement, velocity : (n_frequencies, n) arrays
        At phase zero of the settled motion [m, m/s].
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    lines: np.ndarray
    settled: np.ndarray
    periods: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray

    def jumps(self, share: float = 0.2) -> np.ndarray:
        """Find the indices i, (j,), from which to i + 1 some amplitude changes by over ``share`` of the largest."""
        change = np.abs(np.diff(self.amplitude, axis=0)) / self.amplitude.max(axis=0, initial=1e-300)
        return np.flatnonzero(np.any(change > share, axis=1))


def sweep_response(
    problem: NonlinearSystem | Callable[[float], tuple[NonlinearSystem, np.ndarray]],
    frequencies,
    *,
    start=None,
    least: int = 5,
    most: int = 500,
    tolerance: float = 1e-6,
    harmonics: int = 5,
    **steps,
) -> SweepResponse:
    """Compute the settled motion at base frequencies [rad/s] in their order, the motion carried along.

    Parameters
    ----------
    problem : NonlinearSystem or callable
        A function gives the problem and all its base frequencies for a value of the sweep.
    frequencies : (n_frequencies,) array
        [rad/s], positive.
    start : pair of (n,) arrays, optional
        Displacement [m] and velocity [m/s] at phase zero of the first frequency; at rest when not given.
    least, most : int
        Periods of the map for settling.
    tolerance : float
        Change of the state from period to period, relative to its size, at which it has settled.
    steps
        ``steps``, ``periods``, ``method`` of `stroboscopic_map`.

    Raises
    ------
    CaseError
        No frequencies or some that are not positive, numbers out of range (E-RANGE: a tolerance that is
        not between 0 and 1), a start that does not fit.
    ConvergenceError
        A step whose column equations do not converge.
    """
    tolerance = checked_tolerance(tolerance)
    checked_count(harmonics, "harmonics", code="E-HARMONICS", least=0)
    frequencies = np.atleast_1d(checked_numbers(frequencies, "frequencies", code="E-RANGE", unit="rad/s"))
    valid = frequencies.ndim == 1 and len(frequencies) and np.all(np.isfinite(frequencies))
    if not valid or np.any(frequencies <= 0.0) or not 1 <= least <= most:
        raise CaseError(
            "a sweep needs positive frequencies and a period or more to settle",
            code="E-RANGE",
            key="frequencies",
            limit="one or more > 0 rad/s, 1 <= least <= most",
            remedy="list the frequencies in the order of the sweep",
        )
    rows = []
    for value in frequencies:
        case, bases = problem(value) if callable(problem) else (problem, value)
        once = stroboscopic_map(case, bases, **steps)
        block, settled, count = _settle(once, start, least, most, tolerance)
        x = once.columns(block)
        q, v = (part[0] for part in once.motion(block, np.array([-1])))
        low, high = x.min(axis=0), x.max(axis=0)
        lines = harmonics_of(x[:-1].T, harmonics)
        rows.append((0.5 * (high - low), low, high, lines, settled, count, q, v))
        start = q, v
    return SweepResponse(frequencies, *(np.array(column) for column in zip(*rows)))


def sweep_up_and_down(problem, frequencies, **options) -> tuple[SweepResponse, SweepResponse]:
    """Sweep over ascending base frequencies and, from the end, back.

    Parameters
    ----------
    problem, frequencies
        As for `sweep_response`; (n_frequencies,) [rad/s], ascending.
    options
        Further arguments of `sweep_response`, which refuses and raises the same.
    """
    given = checked_numbers(frequencies, "frequencies", code="E-RANGE", unit="rad/s")
    frequencies = np.sort(np.atleast_1d(given))
    up = sweep_response(problem, frequencies, **options)
    options["start"] = up.displacement[-1], up.velocity[-1]
    return up, sweep_response(problem, frequencies[::-1], **options)


def _settle(once: StroboscopicMap, start, least: int, most: int, tolerance: float):
    """Repeat the period until the state does: the last block, whether it settled, the number of periods."""
    state, g = once.enter(start)
    count = 0
    while True:
        block = once.run(state, g)
        change = np.abs(block.states[-1] - state)[:2]
        # displacement and velocity have their own sizes
        size = np.abs(block.states[:, :2]).max(axis=(0, 2))
        state, g, count = block.states[-1], block.excess[-1], count + 1
        settled = bool(np.all(change.max(axis=1) <= tolerance * size))
        if (settled and count >= least) or count == most:
            return block, settled, count
