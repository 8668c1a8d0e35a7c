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
VERDICTS = (NORMAL, UNEQUAL, "error or fault of the sun", "error or fault of a planet", "not from this gearbox")
"""Words on a line, in the order of concern; a ring makes no new places."""


@dataclass(frozen=True)
class MeasuredLine:
    """One line of a measured spectrum.

    ``order`` of the carrier, ``amplitude`` (peak) in the unit of the signal, ``level`` [dB] over the strongest line,
    ``verdict`` one of `VERDICTS`, ``place`` what `classify_lines` says of its place.
    """

    order: float
    amplitude: float
    level: float
    verdict: str
    place: LineVerdict


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
    bins = find_lines(spectrum.order, amplitude, threshold=threshold)
    noise = median_filter(amplitude, min(around, len(amplitude)), mode="nearest")
    bins = bins[(bins < len(amplitude) - 1) & (amplitude[bins] > _ABOVE_NOISE * noise[bins])]
    left, right = amplitude[bins - 1], amplitude[bins + 1]
    ratio = np.maximum(left, right) / amplitude[bins]
    away = np.clip((2.0 * ratio - 1.0) / (1.0 + ratio), 0.0, 0.5)
    height = amplitude[bins] * (1.0 - away**2) / np.sinc(away)
    return spectrum.order[bins] + np.where(right > left, away, -away) * step, height


def judge_lines(
    order: np.ndarray, amplitude: np.ndarray, planet_angles, teeth: tuple[int, int | None, int | None], tolerance: float
) -> tuple[MeasuredLine, ...]:
    """Give every line of a spectrum its verdict, by `femgear.housing.orders.classify_lines`.

    Parameters
    ----------
    order, amplitude : (k,) arrays
        Orders of the carrier above zero, and peak amplitudes, of the lines.
    planet_angles : (N,) array
        In the frame of the carrier [rad].
    teeth : (ring, sun, planet)
        Of the ring, which stands still; of sun and planet None where they are not known.
    tolerance : float
        Distance of orders that count as one.
    """
    largest = amplitude.max(initial=0.0)
    lines, orders = [], np.asarray(order, float).tolist()
    places = classify_lines(orders, planet_angles, teeth, tolerance=tolerance)
    for line_order, height, place in zip(orders, np.asarray(amplitude, float).tolist(), places, strict=True):
        lines.append(MeasuredLine(line_order, height, 20 * float(np.log10(height / largest)), _words(place), place))
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
