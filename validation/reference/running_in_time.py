"""Planets that run around in a structure, in time: the periodic motion over one turn of the carrier.

The equations are linear with coefficients that repeat after a turn. They are integrated over one turn from every
unit state, and the state that comes back to itself is solved for (G. Floquet, Ann. sci. Ec. norm. sup. 12, 1883):
nothing has to settle. Coordinates are those in axes at rest, in which meshes and pins turn; there are no modes, no
side bands and no harmonics of the answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from running_twin import Twin
from scipy.integrate import solve_ivp

_TOLERANCE = 1e-10
"""Error of a step over the size of the state."""


@dataclass(frozen=True)
class TurningSystem:
    """A twin whose carrier turns at a speed, with so many mesh harmonics of its excitation.

    Parameters
    ----------
    twin : Twin
        Structure and planets.
    speed : float
        Of the carrier, positive [rad/s].
    harmonics : int
        Of mesh stiffness, deflection and force.
    """

    twin: Twin
    speed: float
    harmonics: int

    @cached_property
    def waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Approaches (4 N, n): mean, and factors of cosine and sine of the angle of the carrier."""
        a, b, c = (self.twin.whole_rows(angle) for angle in (0.0, 0.5 * np.pi, np.pi))
        mean = 0.5 * (a + c)
        return mean, 0.5 * (a - c), b - mean

    def signals(self, theta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stiffness, deflection and force (2 N,) of the meshes at an angle of the carrier, the latter without mean."""
        phase = np.exp(1j * np.arange(1, self.harmonics + 1) * self.twin.teeth * theta)
        stiffness, deflection, force = (2.0 * np.real(lines[:, 1:] @ phase) for lines in self._lines)
        return self._lines[0][:, 0].real + stiffness, deflection, force

    @cached_property
    def _lines(self) -> list[np.ndarray]:
        drive = self.twin.excitation
        arrays = (drive.stiffness, drive.deflection, drive.force)
        return [np.fft.rfft(array, axis=1)[:, : self.harmonics + 1] / array.shape[1] for array in arrays]

    def equations(self, theta: float) -> tuple[np.ndarray, np.ndarray]:
        """State matrix (2n, 2n) and its drive (2n,) over the angle of the carrier; velocities are over the speed."""
        twin, omega = self.twin, self.speed
        mean, cosine, sine = self.waves
        rows = mean + np.cos(theta) * cosine + np.sin(theta) * sine
        slope = np.cos(theta) * sine - np.sin(theta) * cosine
        count, size, n = len(twin.angles), len(twin.mass), rows.shape[1]
        stiffness, deflection, force = self.signals(theta)
        springs = np.concatenate([stiffness, np.repeat(twin.springs[2:], count)])
        dampers = np.concatenate([np.zeros(2 * count), np.repeat(twin.viscous[2:], count)])
        K = rows.T @ (springs[:, None] * rows + omega * dampers[:, None] * slope)
        C = rows.T @ (dampers[:, None] * rows)
        K[:size, :size] += twin.stiffness
        C[:size, :size] += twin.damping
        mass = twin.whole_mass[:, None]
        matrix = np.zeros((2 * n, 2 * n))
        matrix[:n, n:] = np.eye(n)
        matrix[n:, :n], matrix[n:, n:] = -K / (mass * omega**2), -C / (mass * omega)
        drive = np.zeros(2 * n)
        drive[n:] = -rows[: 2 * count].T @ (force - stiffness * deflection) / (mass[:, 0] * omega**2)
        return matrix, drive


def motion_over_a_turn(system: TurningSystem, samples: int) -> np.ndarray:
    """Periodic motion (n, samples) of all coordinates at equal angles of the carrier [m, rad]."""
    n = system.waves[0].shape[1]

    def rate(theta: float, flat: np.ndarray) -> np.ndarray:
        matrix, drive = system.equations(theta)
        state = flat.reshape(2 * n, -1)
        change = matrix @ state
        change[:, -1] += drive
        return change.ravel()

    # drives move by micrometres, and must not drown in the tolerance of unit states
    unit = np.hstack([np.eye(2 * n), np.zeros((2 * n, 1))])
    ends = _integrated(rate, unit.ravel(), np.array([2.0 * np.pi])).reshape(2 * n, -1)
    start = np.linalg.solve(np.eye(2 * n) - ends[:, :-1], ends[:, -1])
    angles = 2.0 * np.pi * np.arange(samples) / samples
    return _integrated(rate, start, angles).reshape(2 * n, -1)[:n]


def _integrated(rate: Callable, start: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """States (.., angles) from a start at angle 0, by DOP853."""
    size = np.abs(start).max()
    solution = solve_ivp(
        rate, (0.0, angles[-1]), start, method="DOP853", t_eval=angles, rtol=_TOLERANCE, atol=_TOLERANCE * size
    )
    return solution.y
