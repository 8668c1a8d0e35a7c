"""The harmonic equations of the mesh deflections, ``E + T G E = S``, for many speeds at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import ConvergenceError
from femgear.solvers.harmonics import multiply
from femgear.system import Modes

# Two signals or receptances closer than this (relative) are equal: identical planets.
_EQUAL = 1e-9


@dataclass(frozen=True)
class HarmonicProblem:
    """``E_h + T_h (g E)_h = S_h`` for every harmonic h, mesh and speed.

    Parameters
    ----------
    receptance : (n, n, n_speeds, H + 1) complex array
        ``T_h`` [m/N].
    product : (n, 2 (H + 1), 2 (H + 1)) array
        Multiplication by the stiffness fluctuation of each mesh, see ``harmonics.product_matrix`` [N/m].
    source : (n, n_speeds, H + 1) complex array
        ``S_h`` [m].
    """

    receptance: np.ndarray
    product: np.ndarray
    source: np.ndarray

    def take(self, speeds) -> HarmonicProblem:
        """The same problem at some of the speeds."""
        return HarmonicProblem(self.receptance[:, :, speeds], self.product, self.source[:, speeds])


@dataclass(frozen=True)
class Twins:
    """Meshes that repeat others later in time: ``x_j(t) = x_leader(j)(t - phase_j T)``.

    Parameters
    ----------
    leaders : (n_groups,) int array
        First mesh of every group.
    group : (n_meshes,) int array
    shift : (n_meshes, H + 1) complex array
        Factors ``exp(-2 pi i h phase_j)``.
    """

    leaders: np.ndarray
    group: np.ndarray
    shift: np.ndarray


def compliance(modes: Modes, omega: np.ndarray) -> np.ndarray:
    """Modal receptances ``1 / (w_k^2 - omega^2 + 2 i zeta w_k omega)`` (..., n_modes) [s^2].

    Zero for rigid modes, which no self-equilibrated force moves.

    Raises
    ------
    ConvergenceError
        At an undamped resonance of a mode that a mesh moves.
    """
    natural = 2.0 * np.pi * modes.frequency
    elastic = natural > 0.0
    w = np.where(elastic, natural, 1.0)
    ratio = np.asarray(omega)[..., None] / w
    denominator = 1.0 - ratio * ratio + 2j * modes.damping_ratio * ratio
    moved = elastic & np.any(modes.mesh_deflection != 0.0, axis=0)
    infinite = (np.abs(denominator) < 1e-10) & moved
    if np.any(infinite):
        mode = int(np.argwhere(infinite)[0][-1])
        raise ConvergenceError(
            f"undamped resonance of mode {mode + 1} at {modes.frequency[mode]:.6g} Hz: infinite response",
            code="E-RESONANCE", key="damping_ratio", value=float(modes.damping_ratio[mode]), limit="> 0",
            remedy="give the mode some damping or move the speed",
        )  # fmt: skip
    safe = np.where(np.abs(denominator) < 1e-10, 1.0, denominator)
    return np.where(elastic, 1.0 / (safe * w * w), 0.0)


def receptance(modes: Modes, modal: np.ndarray) -> np.ndarray:
    """``T = sum r r^T H_k + residual`` (n, n, ...) from the modal receptances (..., n_modes) [m/N]."""
    rows = modes.mesh_deflection
    n, lower = len(rows), np.tril_indices(len(rows))
    pairs = (rows[lower[0]] * rows[lower[1]]).T
    flat = np.stack([modal.real @ pairs, modal.imag @ pairs], axis=-1).view(complex)[..., 0]
    flat += modes.residual[lower]
    out = np.empty((n, n, *modal.shape[:-1]), dtype=complex)
    for index, (i, j) in enumerate(zip(*lower)):
        out[i, j] = out[j, i] = flat[..., index]
    return out


def transfer(receptances: np.ndarray, force: np.ndarray) -> np.ndarray:
    """``T_h f_h``: (n, n, n_speeds, H + 1) times (n, n_speeds, H + 1)."""
    out = np.empty((receptances.shape[0], *force.shape[1:]), dtype=complex)
    for i, row in enumerate(receptances):
        np.einsum("jsh,jsh->sh", row, force, out=out[i])
    return out


def apply(problem: HarmonicProblem, deflection: np.ndarray) -> np.ndarray:
    """``T G E`` of (n, n_speeds, H + 1) harmonics."""
    return transfer(problem.receptance, multiply(problem.product, deflection))


def residual(problem: HarmonicProblem, deflection: np.ndarray) -> np.ndarray:
    """Size of ``E + T G E - S`` relative to that of E, per speed."""
    error = deflection + apply(problem, deflection) - problem.source
    return norm(error) / np.maximum(norm(deflection), np.finfo(float).tiny)


def norm(deflection: np.ndarray) -> np.ndarray:
    """Euclidean norm over meshes and harmonics, per speed."""
    return np.sqrt(np.einsum("jsh,jsh->s", deflection, deflection.conj()).real)


def matrices(problem: HarmonicProblem) -> np.ndarray:
    """``T G`` as matrices (n_speeds, n L, n L) on interleaved real and imaginary parts, L = 2 (H + 1)."""
    n, _, speeds, size = problem.receptance.shape
    product = problem.product.reshape(n, size, 2, 2 * size)
    columns = product[:, :, 0] + 1j * product[:, :, 1]
    out = np.empty((speeds, n, size, 2, n, 2 * size))
    for i in range(n):
        for j in range(n):
            block = problem.receptance[i, j][:, :, None] * columns[j]
            out[:, i, :, 0, j], out[:, i, :, 1, j] = block.real, block.imag
    return out.reshape(speeds, 2 * n * size, 2 * n * size)


def solve_direct(problem: HarmonicProblem) -> np.ndarray:
    """``E`` (n, n_speeds, H + 1) by Gaussian elimination of ``(I + T G) E = S`` at every speed.

    Raises
    ------
    ConvergenceError
        When the equations are singular: an undamped parametric resonance.
    """
    n, speeds, size = problem.source.shape
    operator = matrices(problem)
    diagonal = np.arange(operator.shape[-1])
    operator[:, diagonal, diagonal] += 1.0
    right = np.ascontiguousarray(problem.source.transpose(1, 0, 2)).view(float).reshape(speeds, -1, 1)
    try:
        solution = np.linalg.solve(operator, right)
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            "the harmonic equations are singular: there is no periodic response at a parametric resonance",
            code="E-RESONANCE", remedy="give the modes some damping or move the speed",
        ) from error  # fmt: skip
    return (
        np.ascontiguousarray(solution[..., 0])
        .view(complex)
        .reshape(speeds, n, size)
        .transpose(1, 0, 2)
        .copy()
    )


def find_twins(signals: tuple[np.ndarray, ...]) -> Twins:
    """Group meshes whose signals are the same but for one time shift.

    Parameters
    ----------
    signals : tuple of (n_meshes, H + 1) complex arrays
        Harmonics of stiffness, deflection, force, load deflection: all must share the shift.
    """
    scales = [max(np.abs(signal).max(), np.finfo(float).tiny) for signal in signals]
    stacked = np.stack([signal / scale for signal, scale in zip(signals, scales)])
    n, size = stacked.shape[1:]
    h = np.arange(size)
    leaders, group, shift = [], np.zeros(n, dtype=int), np.ones((n, size), dtype=complex)
    for j in range(n):
        for index, leader in enumerate(leaders):
            factor = np.exp(-2j * np.pi * h * _phase(stacked[:, leader], stacked[:, j]))
            if np.abs(stacked[:, j] - factor * stacked[:, leader]).max() < _EQUAL:
                group[j], shift[j] = index, factor
                break
        else:
            group[j] = len(leaders)
            leaders.append(j)
    return Twins(np.array(leaders), group, shift)


def _phase(leader: np.ndarray, follower: np.ndarray) -> float:
    """Time shift, as a fraction of the period, from the first harmonic that is there."""
    present = np.abs(leader[:, 1:]) > 1e3 * _EQUAL
    if not np.any(present):
        return 0.0
    h = int(np.argmax(np.any(present, axis=0))) + 1
    signal = int(np.argmax(np.abs(leader[:, h])))
    return float(-np.angle(follower[signal, h] / leader[signal, h]) / (2.0 * np.pi * h))


def reduce_twins(problem: HarmonicProblem, twins: Twins) -> HarmonicProblem | None:
    """The problem of the group leaders alone; ``None`` when the receptances do not share the symmetry."""
    shifted = problem.receptance * twins.shift[None, :, None, :]
    folded = np.stack([shifted[:, twins.group == g].sum(axis=1) for g in range(len(twins.leaders))], axis=1)
    reduced = folded[twins.leaders]
    scale = np.abs(problem.receptance).max(axis=(0, 1))
    for j, g in enumerate(twins.group):
        if np.any(np.abs(folded[j] - twins.shift[j] * reduced[g]) > _EQUAL * scale):
            return None
    return HarmonicProblem(reduced, problem.product[twins.leaders], problem.source[twins.leaders])


def expand_twins(deflection: np.ndarray, twins: Twins) -> np.ndarray:
    """Harmonics of all meshes from those of the group leaders."""
    return deflection[twins.group] * twins.shift[:, None, :]


def spectral_radius(problem: HarmonicProblem, *, exact_limit: float = 2e7, steps: int = 20) -> np.ndarray:
    """Spectral radius of ``T G`` per speed.

    Eigenvalues of the full matrices while their number of entries cubed, times the speeds, stays below
    `exact_limit`; otherwise the largest Ritz value of `steps` Arnoldi steps from one random vector (Saad,
    Numerical Methods for Large Eigenvalue Problems, algorithm 6.1), all speeds together.
    """
    n, speeds, size = problem.source.shape
    if speeds * (2 * n * size) ** 3 <= exact_limit:
        return np.abs(np.linalg.eigvals(matrices(problem))).max(axis=-1)
    steps = min(steps, n * (2 * size - 1))
    start = np.random.default_rng(0).standard_normal((n, speeds, size, 2)).view(complex)[..., 0]
    start.imag[..., 0] = 0.0
    basis = np.empty((speeds, steps + 1, 2 * n * size))
    hessenberg = np.zeros((speeds, steps + 1, steps))
    basis[:, 0] = _rows(start / norm(start)[None, :, None])
    for k in range(steps):
        vector = basis[:, k].reshape(speeds, n, 2 * size).transpose(1, 0, 2)
        image = _rows(apply(problem, np.ascontiguousarray(vector).view(complex)))[..., None]
        known = basis[:, : k + 1]
        for _ in range(2):
            share = np.matmul(known, image)
            image -= np.matmul(known.transpose(0, 2, 1), share)
            hessenberg[:, : k + 1, k] += share[..., 0]
        length = np.sqrt(np.einsum("sd,sd->s", image[..., 0], image[..., 0]))
        hessenberg[:, k + 1, k] = length
        basis[:, k + 1] = image[..., 0] / np.maximum(length, np.finfo(float).tiny)[:, None]
    return np.abs(np.linalg.eigvals(hessenberg[:, :-1])).max(axis=-1)


def _rows(harmonics: np.ndarray) -> np.ndarray:
    """(n, n_speeds, H + 1) harmonics as one interleaved real row a speed."""
    flat = np.ascontiguousarray(harmonics.transpose(1, 0, 2))
    return flat.view(float).reshape(len(flat), -1)
