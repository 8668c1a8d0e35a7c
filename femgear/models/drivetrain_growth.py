"""Growth of the free motion of a drivetrain: the largest Lyapunov exponent, followed beside a run.

A second motion without loads takes the same steps, with the tangents of the meshes, and is brought back to
size one every few steps; the slope of the logarithm of its size is the exponent (G. Benettin, L. Galgani,
A. Giorgilli and J.-M. Strelcyn, Meccanica 15, 1980, 9-30). The weights exp(-1 / (s (1 - s))) over the run
take the oscillation of the size out of the mean (S. Das, Y. Saiki, E. Sander and J. A. Yorke, Nonlinearity
30, 2017, 4111-4140). With linear meshes at a constant speed it is the
largest Floquet exponent, at any load.
"""

from __future__ import annotations

import numpy as np

# Steps after which the free motion is brought back to size one.
PIECE = 64
# Sizes that a run gives at least, where it has that many steps.
_SIZES = 30
# Share of the run in which the strongest motion wins.
_START = 1.0 / 3.0


def piece_length(count: int) -> int:
    """Steps between two sizes of the free motion in a run of `count` steps."""
    return max(1, min(PIECE, count // _SIZES))


class FreeMotion:
    """Size of the free motion: the root of twice its energy, meshes included and the spin left out."""

    def __init__(self, model, scheme, *, seed: int = 0):
        self.system, self.rigid, self.scheme = model.system, model.rigid, scheme
        self.carried = model.system.M @ model.rigid
        self.inertia = model.inertia
        self.times, self.sizes = [0.0], [0.0]
        self.seed = seed

    def start(self) -> np.ndarray:
        """Row ``z`` (2 n + m,) of random velocities of like energy."""
        n = self.scheme.n
        state = np.zeros(len(self.scheme.advance))
        state[n : 2 * n] = np.random.default_rng(self.seed).standard_normal(n) / np.sqrt(
            np.diag(self.system.M)
        )
        return self._scaled(state)[0]

    def renewed(self, row, time: float) -> np.ndarray:
        """The row at size one; its size at this time [s] is kept."""
        row, size = self._scaled(self.scheme.states(row))
        self.times.append(time)
        with np.errstate(divide="ignore"):
            self.sizes.append(self.sizes[-1] + np.log(size))
        return row

    def _scaled(self, state):
        n, system = self.scheme.n, self.system
        q, v, g = state[:n], state[n : 2 * n], state[2 * n :]
        q -= (self.carried @ q) / self.inertia * self.rigid
        v -= (self.carried @ v) / self.inertia * self.rigid
        twice = v @ system.M @ v + q @ system.K @ q + (q @ self.scheme.basic) @ g
        size = np.sqrt(max(twice, 0.0))
        return self.scheme.row(state / size if size > 0.0 else 0.0 * state), size

    def gain(self) -> float:
        """Largest growth between any two instants of the run, as a factor; NaN without a free motion.

        ``exp(max over t of (log size(t) - its least value before))``: a resonance that the speed passes
        shows here, though the mean over the run decays. Infinite beyond all numbers.
        """
        sizes = np.array(self.sizes)
        if len(sizes) < 2 or not np.all(np.isfinite(sizes)):
            return float("nan")
        with np.errstate(over="ignore"):
            return float(np.exp((sizes - np.minimum.accumulate(sizes)).max()))

    def growth(self) -> float:
        """Mean rate of the logarithm of the size [1/s] after the first third; NaN without a free motion."""
        times, sizes = np.array(self.times), np.array(self.sizes)
        late = times >= _START * times[-1]
        if np.count_nonzero(late) < 2:
            late[:] = True
        times, sizes = times[late], sizes[late]
        if len(times) < 2 or not np.all(np.isfinite(sizes)):
            return float("nan")
        place = (0.5 * (times[1:] + times[:-1]) - times[0]) / (times[-1] - times[0])
        weight = np.exp(-1.0 / (place * (1.0 - place)))
        return float(weight @ (np.diff(sizes) / np.diff(times)) / weight.sum())
