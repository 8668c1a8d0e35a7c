"""Instants of a period at which tangents jump: contacts that open or close, steps of a stiffness."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Intervals of a period that are searched, and the share of a change that must be unlike its neighbours'.
_INTERVALS = 512
_UNLIKE = 0.1
# Jumps below this share of the largest tangent do not count.
_SMALL = 1e-9
# Halvings before and after which a change that stays is a jump, and halvings down to rounding.
_FIRST, _SECOND, _LAST = 6, 12, 50
# Times that an interval is searched for one more jump.
_ROUNDS = 4


def tangent_jumps(tangents: Callable, states: np.ndarray, *, intervals: int = _INTERVALS) -> list[np.ndarray]:
    """Fractions of the period, for every state, at which its tangents jump; ascending, zero left out.

    Tangents at equidistant instants; an interval whose change is unlike that of its neighbours is halved
    towards the larger change. A smooth change shrinks with the interval, a jump stays. Two jumps that undo
    each other within one interval are not seen.

    Parameters
    ----------
    tangents : callable
        ``(fraction (m, s), states (m,)) -> (m, s, n, n)``, periodic in the fraction.
    states : (m,) int array
    intervals : int
        Number of equal intervals of the period.
    """
    states = np.asarray(states)
    nodes = (np.arange(-1, intervals + 3) - 0.5) / intervals
    # one interval more on both sides, for the neighbours
    known = tangents(np.broadcast_to(nodes[1:-2], (len(states), intervals + 1)), states)
    size = np.abs(known).max(axis=(1, 2, 3), initial=0.0)
    change = np.diff(known, axis=1)
    around = 0.5 * (np.roll(change, 1, axis=1) + np.roll(change, -1, axis=1))
    unlike, change = (np.abs(a).max(axis=(2, 3), initial=0.0) for a in (change - around, change))
    suspect = (unlike > _UNLIKE * change) & (change > _SMALL * size[:, None])
    row, column = np.nonzero(suspect)
    found = [[] for _ in states]
    low, high = nodes[1:-2][column], nodes[2:-1][column]
    for _ in range(_ROUNDS):
        row, low, high, where = _halved(tangents, states, size, row, low, high)
        if not len(row):
            break
        for i, fraction in zip(row, where % 1.0):
            found[i].append(fraction)
        gap = 4.0 * np.finfo(float).eps
        low, high = np.concatenate([low, where + gap]), np.concatenate([where - gap, high])
        row = np.concatenate([row, row])
    return [_sorted(fractions) for fractions in found]


def _halved(tangents, states, size, row, low, high):
    """Jumps in intervals (k,) of the rows: rows, ends and places of those that hold one."""
    a, b = low.copy(), high.copy()
    before = np.full(len(row), np.inf)
    for level in range(_LAST):
        if not len(row):
            break
        middle = 0.5 * (a + b)
        values = tangents(np.stack([a, middle, b], axis=1), states[row])
        change = np.abs(np.diff(values, axis=1)).max(axis=(2, 3))
        left = change[:, 0] >= change[:, 1]
        a, b = np.where(left, a, middle), np.where(left, middle, b)
        change = change.max(axis=1)
        if level == _FIRST:
            before = change
        if level == _SECOND:
            keep = (change > 0.5 * before) & (change > _SMALL * size[row])
            row, low, high, a, b = (array[keep] for array in (row, low, high, a, b))
    return row, low, high, b


def _sorted(fractions) -> np.ndarray:
    """Ascending fractions, those at the ends of the period and double ones left out."""
    values = np.sort(np.asarray(fractions, float))
    values = values[(values > 1e-13) & (values < 1.0 - 1e-13)]
    return values[np.diff(values, prepend=-1.0) > 1e-13]
