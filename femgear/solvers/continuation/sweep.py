"""Sweeps over the base frequency that carry the motion along, and so jump where a branch ends.

At every frequency the motion starts from the end of the last one and settles; the amplitude is that of the
settled motion. T. C. Kim, T. E. Rook and R. Singh, J. Sound Vib. 281 (2005) 965-993, sweep gear pairs so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, checked_count, checked_numbers, checked_tolerance
from femgear.solvers.time.stroboscopic import Strobe, strobe
from femgear.system.fourier import harmonics_of
from femgear.system.system import NonlinearSystem


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
        At phase zero of the settled motion.
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
        """Indices i where some amplitude changes by more than ``share`` of the largest from i to i + 1."""
        change = np.abs(np.diff(self.amplitude, axis=0)) / self.amplitude.max(axis=0, initial=1e-300)
        return np.flatnonzero(np.any(change > share, axis=1))


def sweep_response(
    problem: NonlinearSystem | Callable[[float], tuple[NonlinearSystem, np.ndarray]],
    frequencies,
    *,
    start=None,
    steps: int = 200,
    periods: int = 1,
    least: int = 5,
    most: int = 500,
    tolerance: float = 1e-6,
    harmonics: int = 5,
    method: str = "average acceleration",
) -> SweepResponse:
    """Sweep the base frequency in the order given.

    Parameters
    ----------
    problem : NonlinearSystem or callable
        A function gives the problem and all its base frequencies for a value of the sweep.
    frequencies : (n_frequencies,) array
        [rad/s], positive.
    start : pair of (n,) arrays, optional
        Displacement and velocity at phase zero of the first frequency; at rest when not given.
    steps : int
        Time steps in one period of the map.
    periods : int
        Periods of the first base frequency in one period of the map: 2 measures period doubling.
    least, most : int
        Periods of the map for settling.
    tolerance : float
        Change of the state from period to period, relative to its size, at which it has settled.
    harmonics : int
    method : str
        A fixed-step method of `solve_transient`.

    Raises
    ------
    CaseError
        No frequencies or some that are not positive, numbers out of range (E-TOLERANCE: a tolerance that is
        not between 0 and 1), a start that does not fit.
    ConvergenceError
        A step whose column equations do not converge.
    """
    tolerance = checked_tolerance(tolerance)
    checked_count(harmonics, "harmonics", code="E-HARMONICS", least=0)
    frequencies = np.atleast_1d(checked_numbers(frequencies, "frequencies", code="E-FREQUENCY", unit="rad/s"))
    valid = frequencies.ndim == 1 and len(frequencies) and np.all(np.isfinite(frequencies))
    if not valid or np.any(frequencies <= 0.0) or not 1 <= least <= most:
        raise CaseError(
            "a sweep needs positive frequencies and a period or more to settle", code="E-FREQUENCY",
            key="frequencies", limit="one or more > 0 rad/s, 1 <= least <= most",
            remedy="list the frequencies in the order of the sweep",
        )  # fmt: skip
    rows = []
    for value in frequencies:
        case, bases = problem(value) if callable(problem) else (problem, value)
        period = strobe(case, bases, steps=steps, periods=periods, method=method)
        block, settled, count = settle(period, start, least=least, most=most, tolerance=tolerance)
        x = period.columns(block)
        q, v = (part[0] for part in period.motion(block, np.array([-1])))
        low, high = x.min(axis=0), x.max(axis=0)
        lines = harmonics_of(x[:-1].T, harmonics)
        rows.append((0.5 * (high - low), low, high, lines, settled, count, q, v))
        start = q, v
    return SweepResponse(frequencies, *(np.array(column) for column in zip(*rows)))


def sweep_up_and_down(problem, frequencies, **options) -> tuple[SweepResponse, SweepResponse]:
    """A sweep over ascending frequencies and, from its end, back; arguments as for `sweep_response`."""
    given = checked_numbers(frequencies, "frequencies", code="E-FREQUENCY", unit="rad/s")
    frequencies = np.sort(np.atleast_1d(given))
    up = sweep_response(problem, frequencies, **options)
    options["start"] = up.displacement[-1], up.velocity[-1]
    return up, sweep_response(problem, frequencies[::-1], **options)


def settle(period: Strobe, start, *, least: int, most: int, tolerance: float):
    """Repeat the period until the state does: the last block, whether it settled, the number of periods."""
    state, g = period.enter(start)
    for count in range(1, most + 1):
        block = period.run(state, g)
        change = np.abs(block.states[-1] - state)[:2]
        # displacement and velocity have their own sizes
        size = np.abs(block.states[:, :2]).max(axis=(0, 2))
        state, g = block.states[-1], block.excess[-1]
        settled = bool(np.all(change.max(axis=1) <= tolerance * size))
        if settled and count >= least:
            break
    return block, settled, count
