"""Peaks between the positions of a mesh cycle: where transmission error, stiffness or load shares rise on.

Most peaks lie where a tooth pair begins or ceases to carry, often within a hundredth of the mesh period, and
equidistant positions cut them off. Between two positions a curve may rise on to where its straight lines from
both sides meet; where tooth pairs come or go between them, by as much as its steepest slope nearby allows.
Intervals in which that exceeds what is known of a peak by more than half of `TOLERANCE` are halved, and those
with other pairs at their ends until they are as short as `ENCLOSED`: slopes need not show a narrow peak.
Stiffnesses jump where a pair begins to carry. Where leads differ that happens in one slice of the width after
the other: what lies between two such jumps is enclosed as peaks are, by the slices that carry.
"""

from __future__ import annotations

import numpy as np

TOLERANCE = 0.01
"""Share of a peak to peak that what is not resolved may still add to it."""
ENCLOSED = 1.0 / 64.0
"""Mesh periods between positions at least where tooth pairs come or go between them."""
SHORTEST, SHORTEST_DOUBTFUL = 2.0**-10, 2.0**-13
"""Mesh periods that are not halved, and those that are not where they may add more than `TOLERANCE`."""
MOST_ROUNDS, MOST_PLACES = 12, 512
"""Rounds of halving, and positions that they may add."""
FEWEST = 16
"""Positions of a mesh period with which halving begins, at least."""


def mean_weights(position: np.ndarray, periods: int) -> np.ndarray:
    """Find the weights (P,) of the mean over the mesh periods of what is linear between positions (P,)."""
    order = np.argsort(position, kind="stable")
    length = np.diff(np.append(position[order], position[order[0]] + periods))
    weights = np.empty(len(position))
    weights[order] = 0.5 * (length + np.roll(length, 1)) / periods
    return weights


def tooth_pair_codes(path: np.ndarray, load: np.ndarray, position: np.ndarray, base_pitch: float) -> np.ndarray:
    """Find numbers (M, P) that are equal at positions where the same tooth pairs of a mesh carry.

    From positions (P,) [mesh periods], path coordinates (M, T, P) [m] and loads, (M, T, P), or (M, T, S, P) in
    slices: then the same slices carry too. A tooth pair is known by its place on the path at zero.
    """
    place = np.rint((path / base_pitch - position) * 1e6).astype(np.int64)
    if load.ndim == 4:
        place = place[:, :, None] * np.int64(1009) + np.arange(load.shape[2])[:, None]
    mixed = (place + 1_000_003) * np.int64(2_654_435_761) % np.int64(2_147_483_647)
    return np.where(load > 0.0, mixed, 0).sum(axis=tuple(range(1, load.ndim - 1)))


def open_places(
    position: np.ndarray,
    values: np.ndarray,
    codes: np.ndarray,
    least: np.ndarray,
    periods: int,
    later: np.ndarray | None = None,
    jumps: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """Find the middles of intervals (n,) that may hold higher peaks, and what is left beyond them.

    Parameters
    ----------
    position : (P,) array
        Ascending, over so many mesh ``periods``; of records that do not close from one end to the other.
    values : (K, P) array
        Curves over the positions.
    codes : (K, P) array
        Numbers of the tooth pairs that carry, which say where these change.
    least : (K,) array
        Peak to peak below which a curve counts as constant.
    later : (K,) array, optional
        Numbers of the first position after all ``periods``: those of other teeth. Default: as at first.
    jumps : (K,) or (K, P) bool array, optional
        Curves that jump where their codes change, or intervals in which they do, and go on at either side of the
        jump as before. Default: none; they bend there.

    Returns
    -------
    places : (n,) array
        [mesh periods]
    doubt : float
        Largest share of a peak to peak that intervals which are not halved any more may add.
    """
    other = codes != np.column_stack([codes[:, 1:], codes[:, 0] if later is None else later])
    jumping = np.zeros(len(values), bool) if jumps is None else jumps
    jump = other & (jumping if jumping.ndim == 2 else jumping[:, None])
    beyond, length = _beyond(position, values, other, jump, least, periods)
    wanted = (beyond > 0.5 * TOLERANCE) | (other & (length > (1.0 + 1e-9) * ENCLOSED))
    halved = wanted.any(axis=0) & (length > SHORTEST)
    halved |= (beyond > TOLERANCE).any(axis=0) & (length > SHORTEST_DOUBTFUL)
    left = np.where(halved, 0.0, beyond)
    places = (position + 0.5 * length)[halved]
    if position[-1] <= 1e-9:
        # a record that ends at zero has no position beyond it
        places = np.where(places > 0.0, places - periods, places)
    return np.sort(places), float(left.max(initial=0.0)) if len(position) > 2 else 1.0


def pitch_passages(path: np.ndarray, position: np.ndarray, base_pitch: float) -> np.ndarray:
    """Count the tooth pairs of every mesh (M, P) that have passed the pitch point.

    From path coordinates (M, T, P) [m] at positions (P,) [mesh periods].
    """
    place = np.floor(np.rint((path[:, 0] / base_pitch - position) * 1e6) * 1e-6)
    return np.floor(path[:, 0] / base_pitch - place).astype(np.int64)


def peak_doubt(
    position: np.ndarray,
    values: np.ndarray,
    least: np.ndarray,
    periods: int,
    other: np.ndarray | None = None,
) -> float:
    """Find the largest share of a peak to peak that curves may rise beyond their positions.

    Positions (P,), values (K, P) and least sizes (K,) are those of `open_places`. ``other`` (P,) tells behind which
    positions tooth pairs come or go; None where they are not looked at.
    """
    none = np.zeros(values.shape, bool)
    beyond, _ = _beyond(position, values, none if other is None else none | other, none, least, periods)
    return float(beyond.max(initial=0.0))


def _beyond(
    position: np.ndarray,
    values: np.ndarray,
    other: np.ndarray,
    jump: np.ndarray,
    least: np.ndarray,
    periods: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Shares (K, P) of peaks to peaks by which curves may rise in intervals, and their lengths (P,).

    Bool arrays (K, P): intervals in which a curve may bend (``other``), in which it jumps (``jump``).
    """
    length: np.ndarray = np.diff(np.append(position, position[0] + periods))
    after = np.roll(values, -1, axis=1)
    # a record that does not close ends at its end: nothing goes on from there to its beginning
    slope = np.divide(after - values, length, out=np.zeros(values.shape), where=length > 0.0)
    low, high = values.min(axis=1)[:, None], values.max(axis=1)[:, None]
    size = np.maximum(high - low, least[:, None])
    # what is zero throughout, as of planets that carry nothing, has no peaks
    size = np.where(size > 0.0, size, 1.0)
    steepest = steepness = np.abs(slope)
    steepest = np.maximum(steepest, np.maximum(np.roll(steepest, 1, axis=1), np.roll(steepest, -1, axis=1)))
    beyond = np.zeros(values.shape)
    for sign, extreme in ((1.0, high), (-1.0, -low)):
        begin, end = sign * values, sign * after
        # both neighbours go on as lines until they meet
        rising, falling = sign * np.roll(slope, 1, axis=1), -sign * np.roll(slope, -1, axis=1)
        bent = (rising > 0.0) & (falling > 0.0)
        at = (end + falling * length - begin) / np.where(bent, rising + falling, 1.0)
        meet = bent & (at > 0.0) & (at < length)
        most = np.where(meet, begin + rising * at, np.maximum(begin, end))
        by_slope = 0.5 * (begin + end) + 0.5 * steepest * length
        most = np.where(other, np.maximum(most, by_slope), most)
        # each side goes on as a line up to a jump, which may lie anywhere; a mean slope beyond that of both
        # neighbours hides a steeper one as a jump does
        to_jump = np.maximum(begin + np.maximum(rising, 0.0) * length, end + np.maximum(falling, 0.0) * length)
        most = np.where(jump | (other & (steepness >= steepest)), np.maximum(most, to_jump), most)
        # stiffnesses and shares that are zero go on no lower
        bounded = (sign < 0.0) & (low == 0.0)
        beyond = np.maximum(beyond, np.where(bounded, 0.0, (most - extreme) / size))
    return beyond, length
