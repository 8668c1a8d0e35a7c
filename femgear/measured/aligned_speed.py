"""The constant speed at which lines of a recording stand best at orders of a set, where no pulses tell the angle.

A line that is loud must not decide, as it may be from elsewhere: mains hum, another stage. So the logarithms of heights
over the noise beside them are added up over all orders at which lines are expected. A line 40 dB louder then counts
twice or three times. The speed of the largest sum is right to a few steps of the spectrum. Every line that stands near
its order there then gives a speed of its own, and of these the median counts, weighted: a line from elsewhere that
stands at an order by chance is one of many.
"""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.measured.channels import Channel

_NOISE_ORDERS, _NOISE_BINS = 2.0, 64
"""Orders over which the noise beside a line is taken, and bins at least."""
_IN_NOISE = 3.0
"""Height over the median around it below which a bin counts as noise."""
_STANDS_OUT = 8.0
"""Height over the median around it from which on a line tells a speed."""
_REACH = 4
"""Bins on either side of an order in which its line is looked for: the main lobe of a Hann window, twice as fine."""


def widest_range(orders: np.ndarray) -> float:
    """Find the share of a speed within which no other lines come to the places of some orders (k,), two or more."""
    return 0.4 * float(np.diff(np.unique(orders)).min()) / float(orders.max())


def aligned_speed(
    channel: Channel, speed: float, orders: np.ndarray, within: float, *, further: np.ndarray | None = None
) -> float:
    """Find the constant speed near a nominal one [1/s] at which lines of a signal stand best at some orders.

    At another speed loud lines of a fault may stand at orders of a healthy set, but never most lines at whole orders.
    It is a guess as good as the speed was constant; pulses are better.

    CaseError: E-RANGE: a range within which the next lines would fit as well.

    Parameters
    ----------
    channel : Channel
        Of the sensor.
    speed : float
        Nominal one [1/s].
    orders : (k,) array
        Orders of the shaft at which lines are expected, two of them apart by g at least.
    within : float
        Largest share of the nominal speed that the speed may differ by.
    further : (m,) array, optional
        Orders at which lines may stand too; those that come twice count twice.
    """
    most = widest_range(orders)
    if not 0.0 < within <= 1.0001 * most:
        message, remedy = "lines next to one another would fit as well", "measure the speed, or record its pulses"
        raise CaseError(message, code="E-RANGE", key="--within", value=within, limit=f"{most:.3g}", remedy=remedy)
    height, step = _height_over_noise(channel, speed)
    counted = orders if further is None else np.concatenate([orders, further])
    level = np.log1p((height / _IN_NOISE) ** 2)
    count = int(np.ceil(within * speed * float(counted.max()) / (0.5 * step)))
    speeds, score = speed * (1.0 + within * np.arange(-count, count + 1) / count), np.zeros(2 * count + 1)
    for order in counted.tolist():
        place = np.rint(speeds * order / step).astype(int)
        score += np.where(place < len(level), level[np.minimum(place, len(level) - 1)], 0.0)
    best = float(speeds[score.argmax()])
    refined = _median_of_lines(height, step, counted, best)
    return min(max(refined, float(speeds[0])), float(speeds[-1]))


def _height_over_noise(channel: Channel, speed: float) -> tuple[np.ndarray, float]:
    """Compute the spectrum (f,) through a Hann window over the medians around, and its step [Hz].

    It is twice as fine as the record is long, so that no line lies between two bins.
    """
    values = (channel.values - channel.values.mean()) * np.hanning(len(channel.values))
    height, step = np.abs(np.fft.rfft(values, 2 * len(values))), channel.rate / (2 * len(values))
    block = min(max(_NOISE_BINS, int(_NOISE_ORDERS * speed / step)), len(height))
    blocks = -(-len(height) // block)
    padded = np.pad(height, (0, blocks * block - len(height)), mode="reflect")
    noise = np.repeat(np.median(padded.reshape(blocks, block), axis=1), block)[: len(height)]
    return height / np.maximum(noise, np.finfo(float).tiny), step


def _median_of_lines(height: np.ndarray, step: float, orders: np.ndarray, speed: float) -> float:
    """Find the median of the speeds [1/s] that lines near orders (k,) tell, which are known to some steps [Hz].

    A line lies at the top of the parabola through the logarithms of three heights (f,). It weighs by its order, as a
    step is so much less of its frequency, and by its level.
    """
    place = np.rint(orders * speed / step).astype(int)
    inside = (place > _REACH) & (place < len(height) - _REACH)
    place, orders = place[inside], orders[inside]
    around = np.log(np.maximum(height[place[:, None] + np.arange(-_REACH, _REACH + 1)], 1e-12))
    line, top = np.arange(len(place)), around[:, 1:-1].argmax(axis=1) + 1
    left, middle, right = (around[line, top + beside] for beside in (-1, 0, 1))
    counts = (middle > np.maximum(left, right)) & (middle > np.log(_STANDS_OUT))
    if not counts.any():
        return speed
    bend = np.where(counts, left - 2.0 * middle + right, -1.0)
    speed_of_line = ((place + top - _REACH + 0.5 * (left - right) / bend) * step / orders)[counts]
    ascending = speed_of_line.argsort()
    weight = np.cumsum((orders * middle)[counts][ascending])
    return float(speed_of_line[ascending][np.searchsorted(weight, 0.5 * weight[-1])])
