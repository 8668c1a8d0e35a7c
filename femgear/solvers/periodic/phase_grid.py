"""Alternating between frequency and time: element forces and tangents on a grid of phases, and their lines.

Cameron and Griffin, J. Appl. Mech. 56 (1989) 149; with several bases the grid is a torus of independent
phases (Kim and Choi, J. Vib. Acoust. 119 (1997) 107).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.system.force_laws import Element, coefficients_of, with_coefficients
from femgear.system.fourier import FourierSeries
from femgear.system.system import NonlinearSystem

# Samples a line and at least, where a contact opens and closes: one base, several bases.
_CONTACT_SAMPLES = ((128, 2048), (8, 64))


@dataclass(frozen=True)
class _GridSeries:
    """Coefficients on a fixed grid of phases: ``values`` (N, n), their ``mean`` (n,) and their ``orders``."""

    values: np.ndarray
    mean: np.ndarray
    orders: tuple[int, ...]

    def at(self, theta) -> np.ndarray:
        """The stored values (N, n); theta (N, n_bases) must be the grid."""
        return self.values


@dataclass(frozen=True)
class PhaseGrid:
    """Equidistant phases of every base and the places of the lines in their Fourier transform.

    Parameters
    ----------
    orders : (L, n_bases) int array
        Lines as multiples of the base frequencies; line 0 is the mean.
    samples : tuple of int
        Points along every base, more than twice its highest order.
    theta : (N, n_bases) array
        Phases [rad], the last base fastest.
    lines, differences, sums : tuple of two arrays
        Places of the lines, of ``orders_l - orders_m`` and of ``orders_l + orders_m`` in the transform of a
        real signal, and whether the conjugate stands there.
    flat : tuple of two arrays
        Lines without the last base, whose plane of the transform holds both halves, and the second places.
    """

    orders: np.ndarray
    samples: tuple[int, ...]
    theta: np.ndarray
    lines: tuple[np.ndarray, np.ndarray]
    differences: tuple[np.ndarray, np.ndarray]
    sums: tuple[np.ndarray, np.ndarray]
    flat: tuple[np.ndarray, np.ndarray]

    def values(self, lines: np.ndarray) -> np.ndarray:
        """Compute the signals (N, n) of one-sided lines (n, L), in their unit."""
        from scipy.fft import irfftn

        shape = (*self.samples[:-1], self.samples[-1] // 2 + 1)
        spectrum = np.zeros((len(lines), int(np.prod(shape))), complex)
        place, mirrored = self.lines
        half = 0.5 * len(self.theta) * np.where(mirrored, lines.conj(), lines)
        spectrum[:, place] = half
        flat, other = self.flat
        spectrum[:, other] += half[:, flat].conj()
        axes = tuple(range(1, len(shape) + 1))
        signal = np.asarray(irfftn(spectrum.reshape(-1, *shape), s=self.samples, axes=axes))
        return np.ascontiguousarray(signal.reshape(len(lines), -1).T)

    def transform(self, signals: np.ndarray) -> np.ndarray:
        """Compute the two-sided coefficients (n, M) of signals (N, n), the last base half."""
        from scipy.fft import rfftn

        grid = np.ascontiguousarray(signals.T).reshape(-1, *self.samples)
        axes = tuple(range(1, grid.ndim))
        return np.asarray(rfftn(grid, axes=axes)).reshape(len(grid), -1) / len(self.theta)

    def amplitudes(self, coefficients: np.ndarray) -> np.ndarray:
        """Take the one-sided lines (n, L) out of the coefficients (n, M) of `transform`."""
        out = 2.0 * _pick(coefficients, self.lines)
        out[:, 0] = 0.5 * out[:, 0].real
        return out

    def products(self, coefficients: np.ndarray) -> np.ndarray:
        """Make matrices (n, L, 2 L - 1) from ``Re X_0, Re X_1, Im X_1, ...`` to the lines of a product.

        Coefficients (n, M) are those of `transform`. Toeplitz and Hankel parts as in `fourier.Product`; they are the
        exact derivatives of the sampled transform, aliasing included.
        """
        toeplitz, hankel = _pick(coefficients, self.differences), _pick(coefficients, self.sums)
        out = np.empty((*toeplitz.shape[:2], 2 * toeplitz.shape[2] - 1), complex)
        out[..., 0] = toeplitz[..., 0] + hankel[..., 0]
        out[..., 1::2] = (toeplitz + hankel)[..., 1:]
        out[..., 2::2] = 1j * (toeplitz - hankel)[..., 1:]
        out[:, 0] *= 0.5
        return out


def phase_grid(orders: np.ndarray, samples: tuple[int, ...]) -> PhaseGrid:
    """Make the grid of ``samples`` points along every base for the lines ``orders`` (L, n_bases).

    CaseError: no more than twice as many points as the highest order of a base (Nyquist).
    """
    top = np.abs(orders).max(axis=0)
    for base, (count, highest) in enumerate(zip(samples, top)):
        if count < 2 * highest + 1:
            raise CaseError(
                f"{count} samples along base {base + 1} cannot show order {highest}",
                code="E-HARMONICS",
                limit=f"at least {2 * highest + 1}",
                remedy="ask for more samples or fewer harmonics",
            )
    theta = equidistant_phases(samples)
    left, right = orders[:, None, :], orders[None, :, :]
    flat = np.flatnonzero(orders[:, -1] == 0)
    return PhaseGrid(
        orders,
        samples,
        theta,
        _places(orders, samples),
        _places(left - right, samples),
        _places(left + right, samples),
        (flat, _places(-orders[flat], samples)[0]),
    )


def equidistant_phases(samples: Sequence[int]) -> np.ndarray:
    """Make all phases (N, n_bases) [rad] with so many samples along every base, the last base fastest."""
    axes = [2.0 * np.pi * np.arange(count) / count for count in samples]
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=-1)


def sample_counts(problem: NonlinearSystem, orders: np.ndarray) -> tuple[int, ...]:
    """Choose the samples along every base that keep aliasing out of the lines ``orders`` (L, n_bases).

    Products of the lines with polynomials of degree p and with Fourier series of n harmonics are exact with
    ``(p + 1) H + 2 n + 1`` samples, H the highest order along the base. Where contact opens and closes, or a
    coefficient jumps, the error falls with the square of the spacing (with the spacing for a jump): 128 H and
    at least 2048 samples for one base, 8 H and at least 64 along each of several.
    """
    from scipy.fft import next_fast_len

    top = np.abs(orders).max(axis=0)
    counts = np.ones(orders.shape[1], int)
    for element in problem.elements:
        degree = getattr(element, "degree", None)
        content = _series_content(element, orders.shape[1])
        if degree is None or content is None:
            times, least = _CONTACT_SAMPLES[min(orders.shape[1], 2) - 1]
            content = np.zeros_like(top) if content is None else content
            wanted = np.where(top + content > 0, np.maximum(times * top, least) + 2 * content, 1)
        else:
            wanted = (degree + 1) * top + 2 * content + 1
        counts = np.maximum(counts, wanted)
    counts = np.maximum(counts, 2 * top + 1)
    return tuple(int(next_fast_len(int(count), real=True)) for count in counts)  # type: ignore[arg-type]


def on_grid(element: Element, theta: np.ndarray) -> Element:
    """Evaluate the periodic coefficients of an element once, at phases ``theta`` (N, n_bases) [rad]."""
    return with_coefficients(
        element, lambda series: _GridSeries(np.ascontiguousarray(series.at(theta)), series.mean, series.orders)
    )


def coupled_pairs(elements: tuple[Element, ...]) -> np.ndarray:
    """List the pairs (n_pairs, 2) of columns that some element couples, each once."""
    pairs = [
        np.stack([np.repeat(columns, len(columns)), np.tile(columns, len(columns))], axis=1)
        for element in elements
        for columns in element.columns
    ]
    return np.unique(np.vstack(pairs), axis=0) if pairs else np.empty((0, 2), int)


def forces_on_grid(elements, pairs, x, theta) -> tuple[np.ndarray, np.ndarray]:
    """Compute forces (N, n_columns) [N] and tangents (N, n_pairs) [N/m] of coupled pairs (n_pairs, 2).

    At deflections x (N, n_columns) [m] and phases theta (N, n_bases) [rad].
    """
    force, tangent = np.zeros_like(x), np.zeros((len(x), len(pairs)))
    place = {tuple(pair): number for number, pair in enumerate(pairs.tolist())}
    for element in elements:
        columns = element.columns
        if hasattr(element, "evaluate_together"):
            shared = columns[0].tolist()
            part, slope = element.evaluate_together(x[:, shared], theta)
            force[:, shared] += part
            tangent[:, [place[a, b] for a in shared for b in shared]] += slope.reshape(len(x), -1)
            continue
        part, slope = element.evaluate(x[:, columns], theta)
        width = columns.shape[1]
        for i in range(width):
            _add(force, columns[:, i].tolist(), part[:, :, i])
            for j in range(width):
                pair = zip(columns[:, i].tolist(), columns[:, j].tolist())
                _add(tangent, [place[a, b] for a, b in pair], slope[:, :, i, j])
    return force, tangent


def _add(total: np.ndarray, places: list[int], parts: np.ndarray) -> None:
    """Add parts (N, g) to the places of total (N, n), which may be the same for several groups."""
    if len(set(places)) == len(places):
        total[:, places] += parts
    else:
        np.add.at(total.T, places, parts.T)


def _places(orders: np.ndarray, samples: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Flat places of orders (..., n_bases) in the transform of real signals, and where to conjugate."""
    count = np.array(samples)
    wrapped = (orders[..., -1] + count[-1] // 2) % count[-1] - count[-1] // 2
    mirrored = wrapped < 0
    index = np.where(mirrored[..., None], -orders, orders) % count
    shape = (*samples[:-1], samples[-1] // 2 + 1)
    return np.asarray(np.ravel_multi_index(tuple(np.moveaxis(index, -1, 0)), shape)), mirrored


def _pick(coefficients: np.ndarray, places: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    index, mirrored = places
    out = coefficients[:, index]
    np.conjugate(out, out=out, where=mirrored)
    return out


def _series_content(element: Element, bases: int) -> np.ndarray | None:
    """Highest order along every base in the element's coefficients; none where one of them jumps."""
    top = np.zeros(bases, int)
    for series in coefficients_of(element).values():
        if not isinstance(series, FourierSeries):
            return None
        orders = np.abs(np.array((*series.orders, *[0] * bases))[:bases])
        top = np.maximum(top, orders * (series.amplitudes.shape[1] - 1))
    return top
