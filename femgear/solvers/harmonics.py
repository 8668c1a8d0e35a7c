"""Harmonics of real periodic signals, ``x(t) = Re sum_{h=0..H} X_h exp(i h omega t)``, and their products."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.system import MeshExcitation


def harmonics_of(samples, count: int) -> np.ndarray:
    """Harmonics 0 to ``count`` of equidistant samples of one period (end point excluded).

    Parameters
    ----------
    samples : (..., n_positions) array
    count : int
        Highest harmonic kept.

    Returns
    -------
    (..., count + 1) complex array
        One-sided amplitudes: the mean, then twice the discrete Fourier coefficients.

    Raises
    ------
    CaseError
        With fewer than ``2 count + 1`` samples, which cannot tell the harmonics apart (Nyquist).
    """
    samples = np.asarray(samples, dtype=float)
    positions = samples.shape[-1]
    if positions < 2 * count + 1:
        raise CaseError(
            f"{positions} positions in a period cannot hold {count} harmonics",
            code="E-HARMONICS", value=positions, limit=f"at least {2 * count + 1} positions",
            remedy="compute more positions of the mesh cycle or keep fewer harmonics",
        )  # fmt: skip
    amplitudes = np.fft.rfft(samples, axis=-1)[..., : count + 1] * (2.0 / positions)
    amplitudes[..., 0] *= 0.5
    return amplitudes


def sample(amplitudes, positions: int) -> np.ndarray:
    """Values at ``positions`` equidistant instants of one period of (..., H + 1) one-sided harmonics."""
    amplitudes = np.asarray(amplitudes)
    spectrum = np.zeros((*amplitudes.shape[:-1], positions // 2 + 1), dtype=complex)
    if amplitudes.shape[-1] > (positions + 1) // 2:
        raise CaseError(
            f"{positions} instants cannot show {amplitudes.shape[-1] - 1} harmonics",
            code="E-HARMONICS", value=positions, limit=f"at least {2 * amplitudes.shape[-1] - 1}",
            remedy="ask for more instants",
        )  # fmt: skip
    spectrum[..., : amplitudes.shape[-1]] = amplitudes * (0.5 * positions)
    spectrum[..., 0] *= 2.0
    return np.fft.irfft(spectrum, n=positions, axis=-1)


def pad(amplitudes: np.ndarray, count: int) -> np.ndarray:
    """The (..., h + 1) harmonics filled up with zeros, or cut, to (..., count + 1)."""
    out = np.zeros((*amplitudes.shape[:-1], count + 1), dtype=complex)
    kept = min(count + 1, amplitudes.shape[-1])
    out[..., :kept] = amplitudes[..., :kept]
    return out


def product_matrix(factor: np.ndarray, count: int) -> np.ndarray:
    """Real matrix that multiplies harmonics by a periodic factor, without aliasing.

    With two-sided coefficients ``a_n`` of the factor, ``(a x)_h = sum_m a_{h-m} X_m + a_{h+m} conj(X_m)``
    for h > 0 and half of it for h = 0: a Toeplitz and a Hankel part.

    Parameters
    ----------
    factor : (..., n + 1) complex array
        One-sided harmonics of the factor.
    count : int
        Highest harmonic of the other factor and of the product.

    Returns
    -------
    (..., 2 (count + 1), 2 (count + 1)) array
        Acts on, and gives, the interleaved column ``Re X_0, Im X_0 (zero), Re X_1, Im X_1, ...``.
    """
    size = count + 1
    half = pad(factor, 2 * count) * 0.5
    half[..., 0] *= 2.0
    two_sided = np.concatenate([np.conj(half[..., :0:-1]), half], axis=-1)
    h = np.arange(size)
    toeplitz = two_sided[..., 2 * count + h[:, None] - h[None, :]]
    hankel = two_sided[..., 2 * count + h[:, None] + h[None, :]]
    columns = np.stack([toeplitz + hankel, 1j * (toeplitz - hankel)], axis=-1)
    columns[..., 0, :, :] *= 0.5
    rows = np.stack([columns.real, columns.imag], axis=-3)
    return rows.reshape(*factor.shape[:-1], 2 * size, 2 * size)


def multiply(matrix: np.ndarray, amplitudes: np.ndarray) -> np.ndarray:
    """Harmonics of the product: ``matrix`` (n, L, L) of :func:`product_matrix`, amplitudes (n, ..., L/2)."""
    amplitudes = np.ascontiguousarray(amplitudes, dtype=complex)
    flat = amplitudes.view(float).reshape(amplitudes.shape[0], -1, matrix.shape[-1])
    return np.matmul(flat, matrix.transpose(0, 2, 1)).view(complex).reshape(amplitudes.shape)


def mesh_harmonics(excitation: MeshExcitation, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness, deflection and force of the meshes, each cut to ``count`` mesh harmonics.

    Parameters
    ----------
    excitation : MeshExcitation
    count : int
        Mesh harmonics kept; a record of several periods keeps all its lines up to that frequency.

    Returns
    -------
    stiffness, deflection, force : (n_meshes, count periods + 1) complex arrays
        [N/m], [m], [N].

    Raises
    ------
    CaseError
        Numbers that are not finite, arrays that do not fit each other, too few positions.
    """
    if count < 1 or int(count) != count:
        raise CaseError("at least one excitation harmonic is needed", code="E-HARMONICS", value=count)
    arrays = (excitation.stiffness, excitation.deflection, excitation.force)
    for name, array in zip(("stiffness", "deflection", "force"), arrays):
        if array.ndim != 2 or array.shape != excitation.stiffness.shape:
            raise CaseError(
                f"mesh {name} has shape {array.shape}, mesh stiffness {excitation.stiffness.shape}",
                code="E-SHAPE", limit="(n_meshes, n_positions), the same for all",
            )  # fmt: skip
        if not np.all(np.isfinite(array)):
            raise CaseError(f"mesh {name} holds numbers that are not finite", code="E-FINITE")
    if excitation.periods < 1:
        raise CaseError("the record spans no period", code="E-HARMONICS", value=excitation.periods)
    lines = int(count) * excitation.periods
    return tuple(harmonics_of(array, lines) for array in arrays)
