"""The map of one period: fixed steps that are tabulated once and repeated from period to period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_count, checked_numbers
from femgear.solvers.time.adaptive import checked_start
from femgear.solvers.time.newmark import Marched, march
from femgear.solvers.time.transient import fixed_step_scheme, start_state
from femgear.system.system import Law, NonlinearSystem, tabulated_law

# Largest number of steps in a period, and so the memory of its states.
_MOST_STEPS = 100_000


@dataclass(frozen=True)
class Strobe:
    """Everything that a period of a given problem needs.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : (n_bases,) array
        [rad/s].
    period : float
        [s].
    scheme : Scheme
    law, loads
        Of the instants of one period, see `newmark.march`.
    theta : (steps + 1, n_bases) array
        Phases of those instants.
    """

    problem: NonlinearSystem
    frequency: np.ndarray
    period: float
    scheme: object
    law: Law
    loads: np.ndarray
    theta: np.ndarray

    def enter(self, start):
        """State of the scheme and column forces for displacement and velocity (n,); rest for None."""
        start = checked_start(self.problem, start)
        return start_state(self.scheme, start, self.theta[:1], self.law)

    def run(self, state, g) -> Marched:
        """One period of motion from a state at phase zero."""
        block = march(
            self.scheme, self.law, self.loads, state, g, len(self.loads), tolerance=1e-10, max_iterations=30
        )
        if block.steps < len(self.loads):
            raise ConvergenceError(
                f"the column equations did not converge in step {block.steps + 1} of a period at "
                f"{self.frequency[0]:.6g} rad/s", code="E-CONVERGENCE", remedy="take more steps a period",
            )  # fmt: skip
        return block

    def columns(self, block: Marched) -> np.ndarray:
        """Deflections (steps + 1, n_c)."""
        return self.scheme.columns(block.states, block.excess, self.theta)

    def motion(self, block: Marched, index):
        """Displacement and velocity (k, n) at instants of the period."""
        part = self.scheme.motion(block.states[index], block.excess[index], self.theta[index])
        return part[0], part[1]


def strobe(
    problem: NonlinearSystem, frequency, *, steps: int, periods: int = 1, method="average acceleration"
) -> Strobe:  # fmt: skip
    """Prepare the map of ``periods`` periods of the first base frequency in ``steps`` equal steps.

    Raises
    ------
    CaseError
        Base frequencies that do not repeat then, steps out of range or beyond the stability limit.
    """
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-FREQUENCY", unit="rad/s"))
    period = common_period(frequency, periods)
    if not 4 <= steps <= _MOST_STEPS:
        raise CaseError(f"{steps} steps in a period", code="E-STEP", key="steps", limit=f"4 to {_MOST_STEPS}")
    scheme = fixed_step_scheme(problem, frequency, method, period / steps)
    theta = (period * np.arange(steps + 1) / steps)[:, None] * frequency
    # the last instant is the first of the next period
    theta[-1] = theta[0]
    return Strobe(
        problem, frequency, period, scheme, tabulated_law(problem, theta), scheme.table(theta), theta
    )


def common_period(frequency, periods: int) -> float:
    """``periods`` periods of the first base frequency [s]; all others must repeat then."""
    periods = checked_count(periods, "periods", code="E-FREQUENCY")
    if not np.all(np.isfinite(frequency)) or not frequency[0] > 0.0:
        raise CaseError(
            f"{periods} periods of {frequency.tolist()} rad/s", code="E-FREQUENCY", key="frequency",
            limit="one period or more of a positive frequency",
        )  # fmt: skip
    turns = frequency * periods / frequency[0]
    if np.any(np.abs(turns - np.rint(turns)) > 1e-9):
        raise CaseError(
            f"base frequencies {frequency.tolist()} rad/s do not repeat after {periods} periods of the first",
            code="E-FREQUENCY", key="periods", limit="whole numbers of periods of every base frequency",
            remedy="raise the number of periods, or use harmonic balance with two base frequencies",
        )  # fmt: skip
    return float(2.0 * np.pi * periods / frequency[0])
