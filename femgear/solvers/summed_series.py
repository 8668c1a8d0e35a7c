"""Coefficients that repeat with several base frequencies at once: sums of Fourier series."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.entries import checked_numbers
from femgear.solvers.series import FourierSeries


@dataclass(frozen=True)
class SummedSeries:
    """``sum_p parts[p]``, each with its own orders; elements take it where they take a `FourierSeries`.

    Parameters
    ----------
    parts : tuple of FourierSeries
        All of the same number of coefficients.
    """

    parts: tuple[FourierSeries, ...]

    def __post_init__(self):
        parts = tuple(self.parts)
        sizes = {len(part.amplitudes) for part in parts if isinstance(part, FourierSeries)}
        if len(sizes) != 1 or not all(isinstance(part, FourierSeries) for part in parts):
            raise CaseError(
                f"a sum of {len(parts)} series with {sorted(sizes)} coefficients", code="E-SHAPE",
                limit="one Fourier series or more, all of one size",
            )  # fmt: skip
        object.__setattr__(self, "parts", parts)

    @property
    def orders(self) -> tuple[int, ...]:
        """1 for every base frequency that a part names."""
        changing = [part.orders for part in self.parts if part.amplitudes.shape[1] > 1]
        count = max(map(len, changing), default=1)
        return tuple(int(any(o[b] for o in changing if len(o) > b)) for b in range(count))

    @property
    def mean(self) -> np.ndarray:
        """(n,) array."""
        return np.sum([part.mean for part in self.parts], axis=0)

    def at(self, theta) -> np.ndarray:
        """Values (..., n) at the phases ``theta`` (..., n_bases) [rad]."""
        return sum(part.at(theta) for part in self.parts)


def series_spectrum(series: FourierSeries | SummedSeries, frequency) -> tuple[np.ndarray, np.ndarray]:
    """Lines of a series at given base frequencies, ascending; lines that coincide are added.

    Parameters
    ----------
    series : FourierSeries or SummedSeries
    frequency : float or (n_bases,) array
        [rad/s]

    Returns
    -------
    line_frequency : (L,) array
        Not negative; the mean first [rad/s].
    amplitude : (n, L) complex array
        ``Re sum_l A_l exp(i omega_l t)``.
    """
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-FREQUENCY", unit="rad/s"))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)):
        raise CaseError(
            f"base frequencies of shape {frequency.shape}", code="E-FREQUENCY", key="frequency",
            limit="finite numbers, one a base",
        )  # fmt: skip
    parts = series.parts if isinstance(series, SummedSeries) else (series,)
    rates, lines = [np.zeros(1)], [np.zeros((len(parts[0].amplitudes), 1), complex)]
    for part in parts:
        base = float(np.dot(part.orders[: len(frequency)], frequency[: len(part.orders)]))
        rate = base * np.arange(part.amplitudes.shape[1])
        rates.append(np.abs(rate))
        lines.append(np.where(rate < 0.0, part.amplitudes.conj(), part.amplitudes))
    rates, lines = np.concatenate(rates), np.concatenate(lines, axis=1)
    order = np.argsort(rates, kind="stable")
    rates, lines = rates[order], lines[:, order]
    first = np.flatnonzero(np.diff(rates, prepend=-np.inf) > 1e-9 * rates.max(initial=0.0))
    total = np.add.reduceat(lines, first, axis=1)
    total[:, 0] = total[:, 0].real
    return rates[first], total
