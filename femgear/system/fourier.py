"""Fourier series over one or several base frequencies: harmonics, repeating coefficients, spectral lines.

Harmonics of real periodic signals are one-sided, ``x(t) = Re sum_{h=0..H} X_h exp(i h omega t)``, and a
product of signals is a matrix on them. Coefficients of elements repeat with the phases of the base
frequencies, as a Fourier series, in steps, or as a sum of Fourier series with several base frequencies at
once. Lines of a spectrum are the combinations ``orders . omega`` kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from femgear.errors import CaseError, checked_numbers

# Fluctuation, relative to the mean, below which there is none.
_ROUNDING = 1e-12
# Difference of two line frequencies, relative to the highest one, below which they are one.
_COINCIDE = 1e-9


def harmonics_of(samples, count: int) -> np.ndarray:
    """Compute harmonics 0 to ``count`` of equidistant samples of one period (end point excluded).

    CaseError with fewer than ``2 count + 1`` samples, which cannot tell the harmonics apart (Nyquist).

    Parameters
    ----------
    samples : (..., n_positions) array
        In any unit.
    count : int
        Highest harmonic kept.

    Returns
    -------
    (..., count + 1) complex array
        One-sided amplitudes in that unit: the mean, then twice the discrete Fourier coefficients.
    """
    samples = np.asarray(samples, dtype=float)
    positions = samples.shape[-1]
    if positions < 2 * count + 1:
        raise CaseError(
            f"{positions} positions in a period cannot hold {count} harmonics",
            code="E-HARMONICS",
            value=positions,
            limit=f"at least {2 * count + 1} positions",
            remedy="compute more positions of the mesh cycle or keep fewer harmonics",
        )
    amplitudes = np.fft.rfft(samples, axis=-1)[..., : count + 1] * (2.0 / positions)
    amplitudes[..., 0] *= 0.5
    return amplitudes


def sample(amplitudes, positions: int) -> np.ndarray:
    """Compute values (..., positions) at equidistant instants of a period from harmonics (..., H + 1)."""
    amplitudes = np.asarray(amplitudes)
    spectrum = np.zeros((*amplitudes.shape[:-1], positions // 2 + 1), dtype=complex)
    if amplitudes.shape[-1] > (positions + 1) // 2:
        raise CaseError(
            f"{positions} instants cannot show {amplitudes.shape[-1] - 1} harmonics",
            code="E-HARMONICS",
            value=positions,
            limit=f"at least {2 * amplitudes.shape[-1] - 1}",
            remedy="ask for more instants",
        )
    spectrum[..., : amplitudes.shape[-1]] = amplitudes * (0.5 * positions)
    spectrum[..., 0] *= 2.0
    return np.fft.irfft(spectrum, n=positions, axis=-1)


def fluctuation(lines: np.ndarray) -> np.ndarray:
    """Compute the root mean square (...) about the mean of lines (..., L), mean first."""
    return np.sqrt(0.5 * (np.abs(lines[..., 1:]) ** 2).sum(axis=-1))


def pad(amplitudes: np.ndarray, count: int) -> np.ndarray:
    """Fill the harmonics ``amplitudes`` (..., h + 1) up with zeros, or cut them, to (..., count + 1)."""
    out = np.zeros((*amplitudes.shape[:-1], count + 1), dtype=complex)
    kept = min(count + 1, amplitudes.shape[-1])
    out[..., :kept] = amplitudes[..., :kept]
    return out


@dataclass(frozen=True)
class Product:
    """Multiplication of the harmonics of signals by periodic factors, in time, without aliasing.

    ``factor`` (n, H + 1), or (n, n_speeds, H + 1) one a speed, complex are one-sided harmonics.
    """

    factor: np.ndarray

    def __call__(self, amplitudes: np.ndarray) -> np.ndarray:
        """Harmonics (n, n_speeds, H + 1) of the products with one-sided harmonics of the same shape."""
        signals = _instants(amplitudes, self._samples.shape[-1])
        out = _fft().rfft(np.multiply(signals, self._samples, out=signals), norm="forward", overwrite_x=True)
        out = out[..., : amplitudes.shape[-1]]
        out[..., 0] *= 0.5
        return out

    def take(self, speeds: Any = slice(None), kind: Any = complex) -> Product:
        """Take the factors at some of the speeds, indices or a mask, complex or np.complex64."""
        every = self.factor.ndim == 2
        product = Product((self.factor if every else self.factor[:, speeds]).astype(kind, copy=False))
        samples = self._samples if every else self._samples[:, speeds]
        vars(product)["_samples"] = samples.astype(np.float32 if kind is np.complex64 else float, copy=False)
        return product

    @cached_property
    def _samples(self) -> np.ndarray:
        """Factors at so many instants that no harmonic of a product is another one's alias."""
        points = _fft().next_fast_len(3 * self.factor.shape[-1] - 2, real=True)
        samples = 0.5 * _instants(self.factor, points)
        return samples[:, None] if samples.ndim == 2 else samples


def _fft() -> Any:
    """SciPy's transforms, which take single precision too."""
    from scipy import fft

    return fft


def _instants(amplitudes: np.ndarray, points: int) -> np.ndarray:
    """Twice the values (..., points) at equidistant instants of a period of harmonics (..., H + 1)."""
    spectrum = np.array(amplitudes)
    spectrum[..., 0] *= 2.0
    return _fft().irfft(spectrum, points, norm="forward", overwrite_x=True)


@dataclass(frozen=True)
class FourierSeries:
    """``Re sum_h X_h exp(i h (orders . theta))`` with ``theta`` the phases of the base frequencies.

    Parameters
    ----------
    amplitudes : (n, H + 1) complex array
        One-sided harmonics of every coefficient, in its unit.
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
                f"amplitudes of shape {amplitudes.shape}",
                code="E-SHAPE",
                key="amplitudes",
                limit="one row of harmonics a coefficient",
            )
        if not np.all(np.isfinite(amplitudes)):
            raise CaseError("a Fourier series holds numbers that are not finite", code="E-FINITE")
        amplitudes.setflags(write=False)
        object.__setattr__(self, "amplitudes", amplitudes)

    @property
    def mean(self) -> np.ndarray:
        """Mean coefficients (n,)."""
        return np.real(self.amplitudes[:, 0])

    def at(self, theta) -> np.ndarray:
        """Compute the coefficients (..., n) at the phases ``theta`` (..., n_bases) [rad]."""
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
        In the unit of the coefficients, one column an interval.
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
            checked_numbers(getattr(self, name), name, code="E-SHAPE", unit="").copy() for name in ("values", "breaks")
        )
        values = np.atleast_2d(values)
        fits = values.ndim == 2 and breaks.ndim == 1 and len(breaks) == values.shape[1] > 0
        if not fits or breaks[0] != 0.0 or not np.all(np.diff(breaks) > 0.0) or not breaks[-1] < 1.0:
            raise CaseError(
                f"values of shape {values.shape} with breaks {breaks.tolist()}",
                code="E-SHAPE",
                key="breaks",
                limit="one value a break; breaks ascend from 0 to below 1",
                remedy="values come first, one row a coefficient, then the fractions of the period at which "
                "they start, such as StepSeries([[1.0, 2.0]], [0.0, 0.5])",
            )
        if not np.all(np.isfinite(values)):
            raise CaseError("a step series holds numbers that are not finite", code="E-FINITE", key="values")
        for name, array in (("values", values), ("breaks", breaks)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def mean(self) -> np.ndarray:
        """Mean coefficients (n,)."""
        return self.values @ np.diff(self.breaks, append=1.0)

    def at(self, theta) -> np.ndarray:
        """Compute the coefficients (..., n) at the phases ``theta`` (..., n_bases) [rad]."""
        turn = (phase_of(theta, self.orders) / (2.0 * np.pi)) % 1.0
        return np.moveaxis(self.values[:, np.searchsorted(self.breaks, turn, side="right") - 1], 0, -1)


def phase_of(theta, orders) -> np.ndarray:
    """Compute the phase ``orders . theta`` (...) [rad] of phases theta (..., n_bases) [rad] and orders (n,).

    A base that theta lacks must have order zero.
    """
    theta = np.asarray(theta, float)
    given = theta.shape[-1]
    if any(orders[given:]):
        raise CaseError(
            f"orders {tuple(orders)} name more base frequencies than the {given} that are given",
            code="E-HARMONICS",
            limit="one order a base frequency",
        )
    used = np.asarray(orders[:given], float)
    return theta[..., : len(used)] @ used


def orders_of(base: int, bases: int, order: int = 1) -> tuple[int, ...]:
    """Make the orders (n_bases,) that name one base frequency, counted from 0, alone."""
    return tuple(order if place == base else 0 for place in range(bases))


def constant(values) -> FourierSeries:
    """Make a series of coefficients (n,) that do not change."""
    return FourierSeries(np.atleast_1d(np.asarray(values, float))[:, None])


def series_of(samples, count: int, *, orders: tuple[int, ...] = (1,)) -> FourierSeries:
    """Make the Fourier series with ``count`` harmonics of samples (n, P) of one period."""
    return FourierSeries(harmonics_of(np.atleast_2d(samples), count), orders)


def tooth_lines(sun_planet, planet_ring, phases) -> np.ndarray:
    """Make the tooth errors (2N, H) [m] of one wave of each kind, shifted by the mesh phases (2N,) [periods].

    The waves ``sun_planet`` and ``planet_ring`` (H,) are harmonics 1 to H at phase zero [m]; phases as of
    `femgear.stages.lumped_set.phased_series`.

    Raises
    ------
    CaseError
        An odd number of phases, values that are not finite numbers (E-SHAPE).
    """
    waves = [
        np.atleast_1d(checked_numbers(wave, name, code="E-SHAPE", unit="m", kind=complex))
        for name, wave in (("sun_planet", sun_planet), ("planet_ring", planet_ring))
    ]
    phases, count = checked_numbers(phases, "phases", code="E-SHAPE", unit=""), max(map(len, waves))
    finite = all(np.all(np.isfinite(values)) for values in (*waves, phases))
    if phases.ndim != 1 or not len(phases) or len(phases) % 2 or max(w.ndim for w in waves) > 1 or not finite:
        raise CaseError(
            f"mesh phases of shape {phases.shape}",
            code="E-SHAPE",
            key="phases",
            limit="two a planet, finite: sun-planet meshes, then planet-ring meshes",
        )
    table = np.repeat([np.pad(wave, (0, count - len(wave))) for wave in waves], len(phases) // 2, axis=0)
    return table * np.exp(2j * np.pi * phases[:, None] * np.arange(1, count + 1))


@dataclass(frozen=True)
class SummedSeries:
    """``sum_p parts[p]``, each with its own orders and all of the same number of coefficients.

    Elements take it where they take a `FourierSeries`.
    """

    parts: tuple[FourierSeries, ...]

    def __post_init__(self):
        parts = tuple(self.parts)
        sizes = {len(part.amplitudes) for part in parts if isinstance(part, FourierSeries)}
        if len(sizes) != 1 or not all(isinstance(part, FourierSeries) for part in parts):
            raise CaseError(
                f"a sum of {len(parts)} series with {sorted(sizes)} coefficients",
                code="E-SHAPE",
                limit="one Fourier series or more, all of one size",
            )
        object.__setattr__(self, "parts", parts)

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders (n_bases,): 1 for every base frequency that a part names."""
        changing = [part.orders for part in self.parts if part.amplitudes.shape[1] > 1]
        count = max(map(len, changing), default=1)
        return tuple(int(any(o[b] for o in changing if len(o) > b)) for b in range(count))

    @property
    def mean(self) -> np.ndarray:
        """Mean coefficients (n,)."""
        return np.sum([part.mean for part in self.parts], axis=0)

    def at(self, theta) -> np.ndarray:
        """Compute the coefficients (..., n) at the phases ``theta`` (..., n_bases) [rad]."""
        first, *others = (part.at(theta) for part in self.parts)
        return sum(others, first)


Series = FourierSeries | StepSeries | SummedSeries
"""Coefficients that repeat with the phases of the base frequencies."""


def harmonic_lines(harmonics: int, bases: int = 1) -> np.ndarray:
    """List the mean and all lines (L, bases) with ``sum_b |orders_b| <= harmonics``, none of them twice.

    Line 0 is the mean; of a line and its mirror image only the one whose last order that is not zero is
    positive.
    """
    if int(harmonics) != harmonics or harmonics < 0 or bases < 1:
        raise CaseError(
            f"{harmonics} harmonics of {bases} base frequencies",
            code="E-HARMONICS",
            limit="whole numbers, at least one base frequency",
        )
    axes = np.meshgrid(*[np.arange(-harmonics, harmonics + 1)] * bases, indexing="ij")
    orders = np.stack([axis.ravel() for axis in axes], axis=1)
    return distinct_lines(orders[np.abs(orders).sum(axis=1) <= harmonics])


def side_bands(carrier: int, mesh: int, bands: int) -> np.ndarray:
    """List the lines (L, 2) of the extended harmonic balance: carrier and mesh harmonics with side bands.

    ``m omega_1`` (m <= carrier), ``n omega_2`` (n <= mesh) and ``n omega_2 +- q omega_1`` (q <= bands), with
    the carrier frequency first and the mesh frequency second (Guo, Keller and Parker, NREL/CP-5000-55355,
    Eqs. 2-13; Eur. J. Mech. A/Solids 47, 2014, 45-57). Line 0 is the mean. Lines whose frequencies coincide
    because the mesh frequency is a multiple of the carrier frequency stay distinct: the phases are treated as
    independent.

    Parameters
    ----------
    carrier, mesh : int
        Highest harmonics of the carrier and of the mesh frequency.
    bands : int
        Side bands on either side of every mesh harmonic.

    Raises
    ------
    CaseError
        What is no whole number from 0 (E-HARMONICS).
    """
    for name, value in (("carrier harmonics", carrier), ("mesh harmonics", mesh), ("side bands", bands)):
        if int(value) != value or value < 0:
            raise CaseError(f"{value} {name}", code="E-HARMONICS", limit="whole numbers, 0 or more")
    low = [(m, 0) for m in range(carrier + 1)]
    high = [(q, n) for n in range(1, mesh + 1) for q in range(-bands, bands + 1)]
    return distinct_lines(np.array(low + high))


def distinct_lines(orders) -> np.ndarray:
    """Sort lines (n, n_bases) int by their size, the mean first, without mirror images and repetitions."""
    orders = np.atleast_2d(np.array(orders, int))
    orders = np.vstack([np.zeros_like(orders[:1]), orders])
    orders = np.unique(orders * _mirror_sign(orders)[:, None], axis=0)
    size = np.abs(orders).sum(axis=1)
    return orders[np.lexsort((*orders.T, size))]


def _mirror_sign(orders: np.ndarray) -> np.ndarray:
    """Sign (L,) of the last order of every line that is not zero; 1 for the mean."""
    last: np.ndarray = np.zeros(len(orders), int)
    for column in orders.T:
        last = np.where(column != 0, np.sign(column), last)
    return np.where(last == 0, 1, last)


def checked_lines(orders) -> np.ndarray:
    """Check lines, and return their orders (L, n_bases) as whole numbers.

    CaseError: orders that are not whole numbers, a first line that is not the mean, a line that is there
    twice.
    """
    array = np.array(orders)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or not array.size or np.any(array != np.round(array)):
        raise CaseError("lines must be an (L, n_bases) table of whole numbers", code="E-HARMONICS")
    array = array.astype(int)
    if np.any(array[0]):
        raise CaseError(
            f"the first line has the orders {array[0].tolist()}",
            code="E-HARMONICS",
            limit="zeros: the mean",
            remedy="build the lines with harmonic_lines, side_bands or distinct_lines",
        )
    unique, count = np.unique(array * _mirror_sign(array)[:, None], axis=0, return_counts=True)
    if np.any(count > 1):
        raise CaseError(
            f"the line {unique[count > 1][0].tolist()} or its mirror image is there twice",
            code="E-HARMONICS",
            remedy="pass the lines through distinct_lines",
        )
    return array


def line_tail(amplitudes: np.ndarray, orders: np.ndarray, *, rounding: float = _ROUNDING) -> float:
    """Compute the share of the fluctuating amplitude in the upper half of the lines, 0 to 1.

    The root of the energy ratio, of ``amplitudes`` (n, L) complex at ``orders`` (L, n_bases).
    A line is in the upper half when ``sum_b |orders_b| / max |orders_b|`` is above half its largest value.
    With a single line the share is one: nothing is known about the truncation. A fluctuation below
    ``rounding`` of the mean is none, and its share is zero.
    """
    top = np.maximum(np.abs(orders).max(axis=0), 1)
    size = (np.abs(orders) / top).sum(axis=1)
    energy = np.sum(np.abs(amplitudes) ** 2, axis=0)
    still, energy[0] = rounding**2 * energy[0], 0.0
    total = energy.sum()
    return float(np.sqrt(energy[size > 0.5 * size.max()].sum() / total)) if total > still else 0.0


def coincidence_note(orders: np.ndarray, frequency) -> str:
    """Write what to know of a solution in which two lines have one frequency; empty where none have.

    Of lines (L, n_bases) at base frequencies (n_bases,) [rad/s]; with a single one no two lines coincide.
    """
    if orders.shape[1] < 2:
        return ""
    size = np.abs(orders @ np.asarray(frequency, float))
    along = np.argsort(size, kind="stable")
    near = np.flatnonzero(np.diff(size[along]) <= _COINCIDE * size.max())
    if not len(near):
        return ""
    line_1, line_2 = orders[np.sort(along[near[0] : near[0] + 2])].tolist()
    return (
        f" Lines {line_1} and {line_2} have one frequency: only their sum is an amplitude, and its split, as of "
        "phases that are independent, converges slowly; take one base frequency and multiply the orders."
    )
