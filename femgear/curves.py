"""Cubic curves through points, as `scipy.interpolate` has them.

To import that takes longer than all curves of a run: SciPy's optimisation and spatial search come with it.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded

_FLAT = 1e-9
"""Change of slopes, relative to the largest, below which a slope is the mean of those beside it."""


def not_a_knot(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Compute the cubic spline through points (n,), (n, ...) at places (m,), with all outside: (m, ...).

    The first two and the last two pieces are one cubic (C. de Boor, A Practical Guide to Splines, revised
    edition, 2001, chapter IV); three points have a parabola, two a straight line.
    """
    return _hermite(x, y, _spline_slopes(x, y), at)


def makima(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Compute Akima's modified curve through points (n,), (n, ...) at places (m,) between them: (m, ...).

    Slopes are means of those of neighbours, weighted by the changes of slope on the other side (H. Akima, J.
    ACM 17 (1970) 589-602), with half the mean slopes added to these, which keeps flat pieces flat.
    """
    step = _steps(x, y)
    if len(x) == 2:
        return _hermite(x, y, np.repeat(np.diff(y, axis=0) / step, 2, axis=0), at)
    m = np.empty((len(x) + 3, *y.shape[1:]), np.result_type(y, float))
    m[2:-2] = np.diff(y, axis=0) / step
    m[1] = 2.0 * m[2] - m[3]
    m[0] = 2.0 * m[1] - m[2]
    m[-2] = 2.0 * m[-3] - m[-4]
    m[-1] = 2.0 * m[-2] - m[-3]
    change, sum_of = np.abs(np.diff(m, axis=0)), np.abs(m[1:] + m[:-1])
    after, before = (change[some] + 0.5 * sum_of[some] for some in (slice(2, None), slice(None, -2)))
    both, slopes = after + before, 0.5 * (m[3:] + m[:-3])
    sharp = both > _FLAT * both.max()
    weighted = m[1:-2] + before / np.where(sharp, both, 1.0) * (m[2:-1] - m[1:-2])
    return _hermite(x, y, np.where(sharp, weighted, slopes), at)


def _steps(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distances (n - 1, 1, ...) of the points."""
    return np.diff(x).reshape(-1, *[1] * (y.ndim - 1))


def _spline_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Slopes (n, ...) of the cubic spline at its points."""
    dx, step = np.diff(x), _steps(x, y)
    slope = np.diff(y, axis=0) / step
    if len(x) == 2:
        return np.repeat(slope, 2, axis=0)
    if len(x) == 3:
        middle = (step[1] * slope[0] + step[0] * slope[1]) / (step[0] + step[1])
        return np.stack([2.0 * slope[0] - middle, middle, 2.0 * slope[1] - middle])
    bands, right = np.zeros((3, len(x))), np.empty(y.shape, np.result_type(y, float))
    bands[1, 1:-1] = 2.0 * (dx[:-1] + dx[1:])
    bands[0, 2:], bands[2, :-2] = dx[:-1], dx[1:]
    right[1:-1] = 3.0 * (step[1:] * slope[:-1] + step[:-1] * slope[1:])
    first, last = x[2] - x[0], x[-1] - x[-3]
    bands[1, 0], bands[0, 1] = dx[1], first
    right[0] = ((dx[0] + 2.0 * first) * dx[1] * slope[0] + dx[0] ** 2 * slope[1]) / first
    bands[1, -1], bands[2, -2] = dx[-2], last
    right[-1] = (dx[-1] ** 2 * slope[-2] + (2.0 * last + dx[-1]) * dx[-2] * slope[-1]) / last
    return solve_banded((1, 1), bands, right.reshape(len(x), -1)).reshape(right.shape)


def _hermite(x: np.ndarray, y: np.ndarray, slopes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cubics with values and slopes (n, ...) at points (n,), at places (m,)."""
    piece = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    step = _steps(x, y)
    slope = np.diff(y, axis=0) / step
    bend = (slopes[:-1] + slopes[1:] - 2.0 * slope) / step
    s = (at - x[piece]).reshape(-1, *[1] * (y.ndim - 1))
    square = ((slope - slopes[:-1]) / step - bend)[piece]
    return y[piece] + s * (slopes[piece] + s * (square + s * (bend / step)[piece]))
