"""Lines of a measured order spectrum, and the verdict on each: what a set makes, healthy or not, and what it cannot."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.housing.orders import (
    FOREIGN,
    MOST_TURNS,
    NORMAL,
    UNEQUAL,
    LineVerdict,
    OrderSpectrum,
    classify_lines,
    counted_turns,
    find_lines,
)

FINEST = 0.02
"""Orders that a record of 50 turns of the carrier tells apart, halved."""
_ABOVE_NOISE = 5.0
"""Line over the median around it: of Gaussian noise one bin in 30 million reaches that (Rayleigh distribution)."""
_AROUND = 31
"""Least number of bins of which that median is taken."""
_ORDERS_AROUND = 2.0
"""Orders of which it is taken where they are more."""
_FAINTEST = -120.0
"""Level of lines that are no noise [dB]."""
_REACH = 3
"""Bins on either side of a line that a Hann window fills, and one more."""
_BESIDE = 12
"""Bins without a line of which the noise beside one is taken."""
_TOGETHER = 1 << 20
"""Heights of windows that are sorted together."""
_SCALLOPING = 1.43
"""What a line half way between two bins of a Hann window is lower in either of them [dB]."""
_BETWEEN_BINS = 1.08
"""Error of a line between two bins over that of one on a bin."""
VERDICTS = (NORMAL, UNEQUAL, "error or fault of the sun", "error or fault of a planet", "not from this gearbox")
"""Words on a line, in the order of concern; a ring makes no new places."""


@dataclass(frozen=True)
class MeasuredLine:
    """One line of a measured spectrum.

    ``order`` of the carrier, ``amplitude`` (peak) in the unit of the signal, ``level`` [dB] over the strongest line
    that the set can make, ``verdict`` one of `VERDICTS`, ``place`` what `classify_lines` says of its place.
    ``uncertainty`` is by how much the amplitude may be wrong [dB], see `level_uncertainty`.
    """

    order: float
    amplitude: float
    level: float
    verdict: str
    place: LineVerdict
    uncertainty: float


def sharpened_lines(spectrum: OrderSpectrum, threshold: float) -> tuple[np.ndarray, np.ndarray]:
    """Find orders (k,) and peak amplitudes (k,) of the lines of a spectrum through a Hann window.

    Lines reach a threshold [dB] over the largest and stand out of the noise around them. Place and height between
    the bins are those of T. Grandke, Interpolation algorithms for discrete Fourier transforms of weighted signals,
    IEEE Trans. Instrum. Meas. 32 (1983) 350-355: with a the larger neighbour over the bin, d = (2 a - 1)/(1 + a) bins
    towards it, and the bin times pi d (1 - d^2)/sin(pi d).
    """
    from scipy.ndimage import median_filter

    amplitude, step = spectrum.amplitude, 1.0 / spectrum.turns
    around = max(_AROUND, round(_ORDERS_AROUND / step)) | 1
    bins = find_lines(spectrum.order, amplitude, threshold=threshold - _SCALLOPING)
    # mirrored at the ends: a low end that is repeated would be its own median
    noise = median_filter(amplitude, min(around, len(amplitude)), mode="mirror")
    bins = bins[bins < len(amplitude) - 1]
    stands = amplitude[bins] > _ABOVE_NOISE * noise[bins]
    # where lines are dense the median is that of lines: what is left between those that stand out is the noise
    between = _noise_between(amplitude, bins[~stands], bins[stands], around)
    stands[~stands] = amplitude[bins[~stands]] > _ABOVE_NOISE * between
    bins = bins[stands]
    left, right = amplitude[bins - 1], amplitude[bins + 1]
    ratio = np.maximum(left, right) / amplitude[bins]
    away = np.clip((2.0 * ratio - 1.0) / (1.0 + ratio), 0.0, 0.5)
    height = amplitude[bins] * (1.0 - away**2) / np.sinc(away)
    loud = height >= 10.0 ** (threshold / 20.0) * height.max(initial=0.0)
    return (spectrum.order[bins] + np.where(right > left, away, -away) * step)[loud], height[loud]


def _noise_between(amplitude: np.ndarray, at: np.ndarray, lines: np.ndarray, around: int) -> np.ndarray:
    """Find the median around bins (k,) of the bins that neither lines (n,) nor they reach; infinite where few are left.

    Bins beside a line that a Hann window fills are taken out, two on either side.
    """
    empty = np.ones(len(amplitude), bool)
    for reach in range(1 - _REACH, _REACH):
        empty[np.clip(lines + reach, 0, len(empty) - 1)] = False
    half = around // 2
    # beyond the ends there is nothing to take
    heights = np.pad(np.where(empty, amplitude, np.inf), half, constant_values=np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(heights, around)
    noise, rows = np.empty(len(at)), max(_TOGETHER // around, 1)
    for first in range(0, len(at), rows):
        window = windows[at[first : first + rows]]
        window[:, half + 1 - _REACH : half + _REACH] = np.inf
        window.sort(axis=1)
        left, row = np.isfinite(window).sum(axis=1), np.arange(len(window))
        median = 0.5 * (window[row, np.maximum(left - 1, 0) // 2] + window[row, left // 2])
        noise[first : first + rows] = np.where(left >= _BESIDE, median, np.inf)
    return noise


def level_uncertainty(
    spectrum: OrderSpectrum, order: np.ndarray, height: np.ndarray, *, time_error: float = 0.0, speed: float = 0.0
) -> np.ndarray:
    """Compute by how much noise may change the heights of lines, three standard deviations (k,) [dB].

    Of noise with the r.m.s. amplitude n per bin half the power is in phase with a line, so that its height errs by
    ``n/sqrt(2)`` (the bound of D. C. Rife and R. R. Boorstyn, Single-tone parameter estimation from discrete-time
    observations, IEEE Trans. Inf. Theory 20 (1974) 591-598), and by up to 1.08 times that for lines between two bins,
    whose noise a Hann window relates by 2/3. n is that of the bins beside a line that no line reaches. What a wrong
    angle takes off a line, ``(2 pi f e)^2/2`` of it with the standard error e of the times, comes on top.

    Parameters
    ----------
    spectrum : OrderSpectrum
        Through a Hann window.
    order, height : (k,) arrays
        Of its lines, from `sharpened_lines`.
    time_error : float
        Standard error of the times of the samples [s].
    speed : float
        Of the carrier [1/s].
    """
    amplitude, turns = spectrum.amplitude, spectrum.turns
    every, _ = sharpened_lines(spectrum, _FAINTEST)
    empty = np.ones(len(amplitude), bool)
    for reach in range(-_REACH, _REACH + 1):
        empty[np.clip(np.rint(every * turns).astype(int) + reach, 0, len(empty) - 1)] = False
    bins = np.flatnonzero(empty)
    if len(bins) < _BESIDE:
        return np.full(len(order), np.inf)
    first = np.clip(np.searchsorted(bins, order * turns) - _BESIDE // 2, 0, len(bins) - _BESIDE)
    beside = amplitude[bins[first[:, None] + np.arange(_BESIDE)]]
    noise = np.sqrt((beside**2).mean(axis=1) / 2.0)
    lost = (2.0 * np.pi * order * speed * time_error) ** 2 / 2.0
    return 20.0 * np.log10(1.0 + 3.0 * _BETWEEN_BINS * noise / height + lost)


def judge_lines(
    order: np.ndarray,
    amplitude: np.ndarray,
    uncertainty: np.ndarray,
    planet_angles,
    teeth: tuple[int, int | None, int | None],
    tolerance: float,
) -> tuple[MeasuredLine, ...]:
    """Give every line of a spectrum its verdict, by `femgear.housing.orders.classify_lines`.

    Parameters
    ----------
    order, amplitude : (k,) arrays
        Orders of the carrier above zero, and peak amplitudes, of the lines.
    uncertainty : (k,) array
        Of these amplitudes [dB].
    planet_angles : (N,) array
        In the frame of the carrier [rad].
    teeth : (ring, sun, planet)
        Of the ring, which stands still; of sun and planet None where they are not known.
    tolerance : float
        Distance of orders that count as one.
    """
    lines, orders = [], np.asarray(order, float).tolist()
    places = classify_lines(orders, planet_angles, teeth, tolerance=tolerance)
    heights = np.asarray(amplitude, float).tolist()
    possible = [height for height, place in zip(heights, places, strict=True) if place.verdict != FOREIGN]
    largest = max(possible or heights, default=0.0)
    for line_order, height, place, wrong in zip(orders, heights, places, uncertainty.tolist(), strict=True):
        level = 20 * float(np.log10(height / largest))
        lines.append(MeasuredLine(line_order, height, level, _words(place), place, wrong))
    return tuple(lines)


def _words(place: LineVerdict) -> str:
    if place.verdict == FOREIGN:
        return VERDICTS[4]
    if place.part and place.verdict == UNEQUAL:
        return VERDICTS[2] if place.part == "sun" else VERDICTS[3]
    return place.verdict


def order_tolerance(turns: int, given: float | None = None) -> float:
    """Choose the distance of orders that count as one: half a step of the spectrum, 0.02 at least.

    CaseError: E-RANGE: a given one below half the step or of 0.25 and more, or a record too short for any.
    """
    step = 1.0 / turns
    tolerance = max(0.5 * step, FINEST) if given is None else given
    if not 0.499 * step <= tolerance < 0.25:
        raise CaseError(
            "the tolerance of orders does not fit the record",
            code="E-RANGE",
            key="--tolerance",
            value=f"{tolerance:g}, step {step:.3g} orders",
            limit="half the step or more, below 0.25",
            remedy="measure over more turns of the carrier: as many as one over the step",
        )
    return tolerance


def chance(
    tolerance: float, teeth: tuple[int, int | None, int | None], symmetry: int, heard_parts: Collection[str]
) -> float:
    """Tell how often an order without meaning fits turns of the parts by chance, at most; of those heard at any."""
    counts = (
        2 * (counted_turns(part, teeth, symmetry, tolerance) if part in heard_parts else MOST_TURNS)
        for part, number in zip(("sun", "planet"), teeth[1:], strict=True)
        if number is not None
    )
    return 1.0 - (1.0 - 2.0 * tolerance) ** sum(counts)
