"""Cubic curves through points, as `scipy.interpolate` has them.

To import that takes longer than all curves of a run: SciPy's optimisation and spatial search come with it.
"""

from __future__ import annotations

import numpy as np


def not_a_knot(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Compute the cubic spline through points (n,), (n, ...) at places (m,), with all outside: (m, ...).

    The first two and the last two pieces are one cubic (C. de Boor, A Practical Guide to Splines, revised
    edition, 2001, chapter IV); three points have a parabola, two a straight line.
    """
    return _hermite(x, y, _spline_slopes(x, y), at)


def parabolas(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Compute cubics through points (n,), (n, ...) at places (m,), with all outside: (m, ...).

    Their slopes are those of parabolas through three neighbours: F. Bessel's (C. de Boor, A Practical Guide
    to Splines, revised edition, 2001, chapter IV). Far points have no part in a curve, as in a spline.
    """
    return _hermite(x, y, _parabola_slopes(x, y), at)


def _steps(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distances (n - 1, 1, ...) of the points."""
    return np.diff(x).reshape(-1, *[1] * (y.ndim - 1))


def _spline_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Slopes (n, ...) of the cubic spline at its points."""
    from scipy.linalg import solve_banded  # noqa: PLC0415  femgear --help knows sounds, but no curves

    dx, step = np.diff(x), _steps(x, y)
    slope = np.diff(y, axis=0) / step
    if len(x) <= 3:
        return _parabola_slopes(x, y)
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


def _parabola_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Slopes (n, ...) at points of parabolas through them and their neighbours; two have a straight line."""
    step = _steps(x, y)
    slope = np.diff(y, axis=0) / step
    if len(x) == 2:
        return np.repeat(slope, 2, axis=0)
    middle = (step[1:] * slope[:-1] + step[:-1] * slope[1:]) / (step[:-1] + step[1:])
    return np.concatenate([2.0 * slope[:1] - middle[:1], middle, 2.0 * slope[-1:] - middle[-1:]])


def _hermite(x: np.ndarray, y: np.ndarray, slopes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cubics with values and slopes (n, ...) at points (n,), at places (m,)."""
    piece = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    step = _steps(x, y)
    slope = np.diff(y, axis=0) / step
    bend = (slopes[:-1] + slopes[1:] - 2.0 * slope) / step
    s = (at - x[piece]).reshape(-1, *[1] * (y.ndim - 1))
    square = ((slope - slopes[:-1]) / step - bend)[piece]
    return y[piece] + s * (slopes[piece] + s * (square + s * (bend / step)[piece]))
