"""Periodic response of a structure with all its meshes at once, all harmonics in one linear system.

Springs and structure have a loss factor in the frequency domain, 0 at rest. Unknowns are the approaches of all
meshes at the two-sided lines of a common period; products with the stiffness are convolutions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh


@dataclass(frozen=True)
class MeshedStructure:
    """Structure with springs in its meshes.

    Parameters
    ----------
    mass, stiffness : (n, n) arrays
        Without the meshes [kg, N/m].
    columns : (n, J) array
        Approach of the flanks of all meshes per unit of the coordinates.
    loss : float
        Loss factor of structure and meshes.
    """

    mass: np.ndarray
    stiffness: np.ndarray
    columns: np.ndarray
    loss: float

    def receptance(self, mean: np.ndarray, omega: np.ndarray, outputs: np.ndarray) -> np.ndarray:
        """Motions (L, k, J) of outputs (k, n) by forces in the meshes of mean stiffness (J,), at omega (L,)."""
        whole = self.stiffness + (self.columns * mean) @ self.columns.T
        square, shape = eigh(whole, self.mass)
        square = np.where(square < 1e-10 * square[-1], 0.0, square)
        below = square * (1.0 + 1j * self.loss * np.sign(omega))[:, None] - omega[:, None] ** 2
        # what nothing holds moves no flanks against one another
        free = (square == 0.0) & (omega[:, None] == 0.0)
        gain = np.where(free, 0.0, 1.0 / np.where(free, 1.0, below))
        return np.einsum("km,lm,mj->lkj", outputs @ shape, gain, shape.T @ self.columns)


@dataclass(frozen=True)
class MeshSignals:
    """Two-sided lines (J, 2 Q + 1), -Q .. Q, of stiffness, deflection and force of all meshes over a common period."""

    stiffness: np.ndarray
    deflection: np.ndarray
    force: np.ndarray

    def without(self, meshes: list[int]) -> MeshSignals:
        """Signals with meshes that have their mean stiffness and excite nothing."""
        middle = self.stiffness.shape[1] // 2
        lines = []
        for signal in (self.stiffness, self.deflection, self.force):
            still = signal.copy()
            still[meshes] = 0.0
            still[meshes, middle] = signal[meshes, middle]
            lines.append(still)
        return MeshSignals(*lines)


def common_lines(signal: np.ndarray, harmonics: int, multiple: int, highest: int) -> np.ndarray:
    """Two-sided lines (J, 2 highest + 1) of signals (J, P) over a mesh period that is 1/multiple of the common one."""
    spectrum = np.fft.fft(signal, axis=1) / signal.shape[1]
    lines = np.zeros((len(signal), 2 * highest + 1), complex)
    for h in range(-harmonics, harmonics + 1):
        if abs(h * multiple) <= highest:
            lines[:, highest + h * multiple] = spectrum[:, h]
    return lines


def convolution(signal: np.ndarray) -> np.ndarray:
    """Matrix (L, L) of the product with a signal by its two-sided lines (L,), cut at the highest of them."""
    size, middle = len(signal), len(signal) // 2
    apart = np.subtract.outer(np.arange(size), np.arange(size))
    return np.where(np.abs(apart) <= middle, signal[np.clip(apart + middle, 0, size - 1)], 0.0)


def approaches_at_once(structure: MeshedStructure, signals: MeshSignals, base: float) -> tuple[np.ndarray, np.ndarray]:
    """Approaches beyond their means and excitation e beyond the mean stiffness (J, L), two-sided; base [rad/s].

    ``e = (F - mean F) - k (s - mean s) + (k - mean k) Delta`` is what the meshes press with on the linear system.
    """
    count, lines = signals.stiffness.shape
    middle = lines // 2
    mean = signals.stiffness[:, middle].real
    gain = structure.receptance(mean, base * np.arange(-middle, middle + 1), structure.columns.T)
    force, still = signals.force.copy(), signals.deflection.copy()
    force[:, middle] = still[:, middle] = 0.0
    fluctuation = signals.stiffness.copy()
    fluctuation[:, middle] = 0.0
    given = force - np.array([convolution(k) @ s for k, s in zip(signals.stiffness, still, strict=True)])
    varying = np.zeros((count, lines, count, lines), complex)
    for mesh, kappa in enumerate(fluctuation):
        varying[mesh, :, mesh] = convolution(kappa)
    spread = np.zeros((count, lines, count, lines), complex)
    for line in range(lines):
        spread[:, line, :, line] = gain[line]
    spread, varying = spread.reshape(count * lines, -1), varying.reshape(count * lines, -1)
    approach = np.linalg.solve(np.eye(count * lines) + spread @ varying, -spread @ given.ravel())
    return approach.reshape(count, lines), (given.ravel() + varying @ approach).reshape(count, lines)
