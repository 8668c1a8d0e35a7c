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
from scipy.linalg import block_diag

from femgear.system.system import MeshExcitation

_TOLERANCE = 1e-10
"""Error of a step over the size of the state."""


@dataclass(frozen=True)
class TurningSystem:
    """Bodies at rest and planets between them, whose springs turn with the carrier.

    Parameters
    ----------
    rows : callable
        Gives the approaches (R, n) of all meshes, then of all other springs, at an angle of the carrier.
    mass, damping, stiffness : (n, n) arrays
        Of all coordinates without these springs; gyroscopic terms are in the damping.
    springs, viscous : (R - J,) arrays
        Stiffness and damping of the springs behind the meshes.
    excitation : MeshExcitation
        Of the J meshes.
    teeth : int
        Mesh periods in a turn of the carrier.
    speed : float
        Of the carrier, positive [rad/s].
    harmonics : int
        Of mesh stiffness, deflection and force.
    """

    rows: Callable[[float], np.ndarray]
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    springs: np.ndarray
    viscous: np.ndarray
    excitation: MeshExcitation
    teeth: int
    speed: float
    harmonics: int

    @cached_property
    def waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Approaches (R, n): mean, and factors of cosine and sine of the angle of the carrier."""
        a, b, c = (self.rows(angle) for angle in (0.0, 0.5 * np.pi, np.pi))
        mean = 0.5 * (a + c)
        return mean, 0.5 * (a - c), b - mean

    def signals(self, theta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stiffness, deflection and force (J,) of the meshes at an angle of the carrier, the latter without mean."""
        phase = np.exp(1j * np.arange(1, self.harmonics + 1) * self.teeth * theta)
        stiffness, deflection, force = (2.0 * np.real(lines[:, 1:] @ phase) for lines in self._lines)
        return self._lines[0][:, 0].real + stiffness, deflection, force

    @cached_property
    def _lines(self) -> list[np.ndarray]:
        arrays = (self.excitation.stiffness, self.excitation.deflection, self.excitation.force)
        return [np.fft.rfft(array, axis=1)[:, : self.harmonics + 1] / array.shape[1] for array in arrays]

    @cached_property
    def _inverse(self) -> np.ndarray:
        return np.linalg.inv(self.mass)

    def equations(self, theta: float) -> tuple[np.ndarray, np.ndarray]:
        """State matrix (2n, 2n) and its drive (2n,) over the angle of the carrier; velocities are over the speed."""
        omega, n = self.speed, len(self.mass)
        mean, cosine, sine = self.waves
        rows = mean + np.cos(theta) * cosine + np.sin(theta) * sine
        slope = np.cos(theta) * sine - np.sin(theta) * cosine
        stiffness, deflection, force = self.signals(theta)
        meshes = len(stiffness)
        springs, dampers = np.append(stiffness, self.springs), np.append(np.zeros(meshes), self.viscous)
        K = self.stiffness + rows.T @ (springs[:, None] * rows + omega * dampers[:, None] * slope)
        C = self.damping + rows.T @ (dampers[:, None] * rows)
        matrix = np.zeros((2 * n, 2 * n))
        matrix[:n, n:] = np.eye(n)
        matrix[n:, :n], matrix[n:, n:] = -self._inverse @ K / omega**2, -self._inverse @ C / omega
        drive = np.zeros(2 * n)
        drive[n:] = -self._inverse @ rows[:meshes].T @ (force - stiffness * deflection) / omega**2
        return matrix, drive


def turning_twin(twin: Twin, speed: float, harmonics: int) -> TurningSystem:
    """Make the turning system of a twin."""
    count, none = len(twin.angles), np.zeros((3 * len(twin.angles),) * 2)
    return TurningSystem(
        twin.whole_rows,
        np.diag(twin.whole_mass),
        np.asarray(block_diag(twin.damping, none)),
        np.asarray(block_diag(twin.stiffness, none)),
        np.repeat(twin.springs[2:], count),
        np.repeat(twin.viscous[2:], count),
        twin.excitation,
        twin.teeth,
        speed,
        harmonics,
    )


def motion_over_a_turn(system: TurningSystem, samples: int) -> np.ndarray:
    """Periodic motion (n, samples) of all coordinates at equal angles of the carrier [m, rad]."""
    n = system.waves[0].shape[1]

    def rate(theta: float, flat: np.ndarray) -> np.ndarray:
        matrix, drive = system.equations(theta)
        state = flat.reshape(2 * n, -1)
        change = matrix @ state
        change[:, -1] += drive
        return change.ravel()

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
