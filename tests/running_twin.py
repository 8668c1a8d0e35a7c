"""Sun, carrier, ring and casing on uneven springs with planets between them, in axes at rest and as a stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.housing.two_way.carrier_orders import MeshPaths
from femgear.housing.two_way.running_planets import RunningStage
from femgear.system.system import MeshExcitation

TURN = 20.0 * 2.0 * np.pi
"""Speed of the carrier [rad/s]."""
POSITIONS = 64


@dataclass(frozen=True)
class Twin:
    """Sun, carrier, ring and casing on uneven springs, and equal planets between them.

    Coordinates are x, y and rotation of sun, carrier and ring, x and y of the casing.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    planet: np.ndarray
    points: np.ndarray
    springs: np.ndarray
    viscous: np.ndarray
    angles: np.ndarray
    teeth: int
    sense: int
    excitation: MeshExcitation

    def rows(self, phi: float) -> np.ndarray:
        """Approach (4, 11) of both meshes and the pin of a planet at an angle by the structure."""
        radial, around = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        found = np.zeros((4, len(self.mass)))
        found[0, :2], found[0, 2] = np.sin(0.4) * radial + np.cos(0.4) * around, 1.0
        found[1, 6:8], found[1, 8] = np.sin(0.4) * radial - np.cos(0.4) * around, -1.0
        found[2, 3:5], found[3, 3:5], found[3, 5] = -radial, -around, -1.0
        return found

    def whole_rows(self, turn: float) -> np.ndarray:
        """Approach (4 N, 11 + 3 N) of all meshes and pins by structure and planets, at an angle of the carrier.

        Points of all planets one after the other kind by kind; planets in axes at rest.
        """
        count, size = len(self.angles), len(self.mass)
        rows = np.zeros((4, count, size + 3 * count))
        for planet, psi in enumerate(self.angles):
            phi = psi + self.sense * turn
            turned = np.array([[np.cos(phi), -np.sin(phi), 0.0], [np.sin(phi), np.cos(phi), 0.0], [0.0, 0.0, 1.0]])
            rows[:, planet, :size] = self.rows(phi)
            rows[:, planet, size + 3 * planet : size + 3 * planet + 3] = (turned @ self.points).T
        return rows.reshape(4 * count, -1)

    @property
    def whole_mass(self) -> np.ndarray:
        """Masses and inertias (11 + 3 N,) of structure and planets [kg, kg m^2]."""
        return np.concatenate([np.diag(self.mass), np.tile(np.diag(self.planet), len(self.angles))])

    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Natural frequencies [rad/s], zero of free motions, and mass-normalised shapes."""
        root = np.sqrt(np.diag(self.mass))
        values, vectors = np.linalg.eigh(self.stiffness / np.outer(root, root))
        values = np.where(values < 1e-9 * values[-1], 0.0, values)
        return np.sqrt(values), vectors / root[:, None]


def twin(count: int, teeth: int, sense: int = 1, *, free: bool = False, uneven=None, angles=None) -> Twin:
    """Make a twin; ``free``: sun and carrier turn freely; ``uneven``: torques of the planets, relative."""
    mass = np.diag([1.0, 1.0, 0.6, 2.0, 2.0, 1.5, 3.0, 3.0, 2.0, 5.0, 5.0])
    stiffness = np.zeros((11, 11))

    def spring(value: float, **parts: float) -> None:
        row = np.zeros(11)
        for name, part in parts.items():
            row[int(name[1:])] = part
        stiffness[:] += value * np.outer(row, row)

    for first, value in ((0, 2e6), (3, 5e6), (6, 3e7)):
        spring(value, **{f"q{first}": 1.0, "q9": -1.0})
        spring(1.7 * value, **{f"q{first + 1}": 1.0, "q10": -1.0})
    spring(3e5, q0=1.0, q1=0.5, q9=-0.3)
    for rotation, value in ((2, 4e6), (5, 3e6), (8, 5e7)):
        spring(0.0 if free and rotation < 8 else value, **{f"q{rotation}": 1.0})
    spring(2e7, q9=1.0)
    spring(4e7, q10=1.0)
    angles = 2.0 * np.pi * np.arange(count) / count if angles is None else np.asarray(angles)
    theta = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    share = np.ones(count) if uneven is None else np.asarray(uneven)
    signals = np.zeros((3, 2 * count, POSITIONS))
    for planet, psi in enumerate(angles):
        at = theta + sense * teeth * psi
        waves = 1.0 + 0.08 * np.cos(at) + 0.03 * np.sin(2.0 * at), 1.0 + 0.06 * np.cos(at + 1.0)
        for mesh, mean, wave in ((planet, 3e7, waves[0]), (count + planet, 4e7, waves[1])):
            force = 1000.0 * share[planet] * (1.0 + 0.05 * np.cos(at + 0.3))
            signals[:, mesh] = mean * wave, force / (mean * wave) + 1e-6 * np.cos(2.0 * at), force
    points = np.zeros((3, 4))
    points[:, 0], points[:, 1] = [-np.sin(0.4), -np.cos(0.4), 0.9], [-np.sin(0.4), np.cos(0.4), 0.9]
    points[0, 2] = points[1, 3] = 1.0
    return Twin(
        mass,
        20.0 * mass + 3e-5 * stiffness,
        stiffness,
        np.diag([0.5, 0.5, 0.2]),
        points,
        np.array([3e7, 4e7, 2e7, 3e7]),
        np.array([0.0, 0.0, 300.0, 200.0]),
        angles,
        teeth,
        sense,
        MeshExcitation(*signals, np.zeros(2 * count)),
    )


def running(system: Twin, *, symmetry: int | None = None) -> RunningStage:
    """Take the twin as `solve_running` does."""
    frequency, shape = system.modes()
    samples = np.array([system.rows(phi) @ shape for phi in 2.0 * np.pi * np.arange(3) / 3])
    waves = np.fft.fft(samples, axis=0) / 3
    still = np.where(frequency > 0.0, frequency, 1.0)
    turning = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    count = len(system.angles) if symmetry is None else symmetry
    return RunningStage(
        frequency,
        np.where(frequency > 0.0, (20.0 + 3e-5 * frequency**2) / (2.0 * still), 0.0),
        np.stack([waves[2], waves[0], waves[1]], axis=1),
        system.planet,
        np.zeros((3, 3)),
        turning,
        system.points,
        system.springs,
        np.zeros(4),
        system.excitation,
        MeshPaths(system.teeth, tuple(system.angles), 0.0, count),
        system.sense,
        viscous=system.viscous,
    )
