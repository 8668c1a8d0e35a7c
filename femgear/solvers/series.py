"""Coefficients that repeat with the phases of one or several base frequencies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.entries import checked_numbers
from femgear.solvers.harmonics import harmonics_of


@dataclass(frozen=True)
class FourierSeries:
    """``Re sum_h X_h exp(i h (orders . theta))`` with ``theta`` the phases of the base frequencies.

    Parameters
    ----------
    amplitudes : (n, H + 1) complex array
        One-sided harmonics of every coefficient.
    orders : tuple of int
        Multiples of the base frequencies that make the first harmonic: ``(0, 1)`` repeats with the second.
    """

    amplitudes: np.ndarray
    orders: tuple[int, ...] = (1,)

    def __post_init__(self):
        given = checked_numbers(self.amplitudes, "amplitudes", code="E-SHAPE", unit="", kind=complex)
        amplitudes = np.atleast_2d(given.copy())
        if amplitudes.ndim != 2 or not amplitudes.size:
            raise CaseError(
                f"amplitudes of shape {amplitudes.shape}", code="E-SHAPE", key="amplitudes",
                limit="one row of harmonics a coefficient",
            )  # fmt: skip
        if not np.all(np.isfinite(amplitudes)):
            raise CaseError("a Fourier series holds numbers that are not finite", code="E-FINITE")
        amplitudes.setflags(write=False)
        object.__setattr__(self, "amplitudes", amplitudes)

    @property
    def mean(self) -> np.ndarray:
        """(n,) array."""
        return self.amplitudes[:, 0].real

    def at(self, theta) -> np.ndarray:
        """Values (..., n) at the phases ``theta`` (..., n_bases) [rad]."""
        count = self.amplitudes.shape[1]
        if count == 1:
            return np.broadcast_to(self.mean, (*np.shape(theta)[:-1], len(self.mean)))
        phase = phase_of(theta, self.orders)
        return (np.exp(1j * phase[..., None] * np.arange(count)) @ self.amplitudes.T).real


@dataclass(frozen=True)
class StepSeries:
    """Piecewise constant coefficients: ``values[:, i]`` from ``breaks[i]`` to the next break.

    Parameters
    ----------
    values : (n, m) array
    breaks : (m,) array
        Ascending fractions of the period, the first zero.
    orders : tuple of int
        As for `FourierSeries`.
    """

    values: np.ndarray
    breaks: np.ndarray
    orders: tuple[int, ...] = (1,)

    def __post_init__(self):
        values, breaks = (
            checked_numbers(getattr(self, name), name, code="E-SHAPE", unit="").copy()
            for name in ("values", "breaks")
        )
        values = np.atleast_2d(values)
        fits = values.ndim == 2 and breaks.ndim == 1 and len(breaks) == values.shape[1] > 0
        if not fits or breaks[0] != 0.0 or not np.all(np.diff(breaks) > 0.0) or not breaks[-1] < 1.0:
            raise CaseError(
                f"values of shape {values.shape} with breaks {breaks.tolist()}", code="E-SHAPE", key="breaks",
                limit="one value a break; breaks ascend from 0 to below 1",
                remedy="values come first, one row a coefficient, then the fractions of the period at which "
                "they start, such as StepSeries([[1.0, 2.0]], [0.0, 0.5])",
            )  # fmt: skip
        if not np.all(np.isfinite(values)):
            raise CaseError("a step series holds numbers that are not finite", code="E-FINITE", key="values")
        for name, array in (("values", values), ("breaks", breaks)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def mean(self) -> np.ndarray:
        """(n,) array."""
        return self.values @ np.diff(self.breaks, append=1.0)

    def at(self, theta) -> np.ndarray:
        """Values (..., n) at the phases ``theta`` (..., n_bases) [rad]."""
        turn = (phase_of(theta, self.orders) / (2.0 * np.pi)) % 1.0
        return np.moveaxis(self.values[:, np.searchsorted(self.breaks, turn, side="right") - 1], 0, -1)


def phase_of(theta, orders) -> np.ndarray:
    """``orders . theta`` (...) [rad]; a base that theta lacks must have order zero."""
    theta = np.asarray(theta, float)
    known = theta.shape[-1]
    if any(orders[known:]):
        raise CaseError(
            f"orders {tuple(orders)} name more base frequencies than the {known} that are given",
            code="E-ORDERS", limit="one order a base frequency",
        )  # fmt: skip
    used = np.asarray(orders[:known], float)
    return theta[..., : len(used)] @ used


def constant(values) -> FourierSeries:
    """Coefficients (n,) that do not change."""
    return FourierSeries(np.atleast_1d(np.asarray(values, float))[:, None])


def series_of(samples, count: int, *, orders: tuple[int, ...] = (1,)) -> FourierSeries:
    """Fourier series with ``count`` harmonics of the samples (n, P) of one period."""
    return FourierSeries(harmonics_of(np.atleast_2d(samples), count), orders)
