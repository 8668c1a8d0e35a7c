"""Limit points and branch points between two points of a curve, and the curves that cross in a branch point.

Allgower and Georg, Introduction to Numerical Continuation Methods (SIAM 2003), chapters 8 and 9; Seydel,
Practical Bifurcation and Stability Analysis (3rd ed. 2010), chapters 5 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from femgear.solvers.continuation.corrector import CurvePoint, LostError, RoundingError, ScaledCurve, correct

# A located point this near to the start of a segment, in parts of the segment, is that start.
_START = 1e-9
# Half width, in parts of the segment, of the window in which a branch point must lie on one smooth curve.
_WINDOW = 1e-3
# The same for the two points whose mean is the branch point.
_BESIDE = 1e-5
# Share of the largest second derivative below which the crossing curve has no curvature term.
_FLAT = 1e-6


@dataclass(frozen=True)
class Segment:
    """The piece of a curve between a point and the next, as points in planes normal to the first tangent."""

    curve: ScaledCurve
    first: CurvePoint
    last: CurvePoint

    @property
    def length(self) -> float:
        """Distance of the two planes."""
        return float(self.first.tangent @ (self.last.z - self.first.z))

    def at(self, h: float) -> CurvePoint:
        """Point of the curve in the plane at distance h."""
        if h == 0.0:
            return self.first
        guess = self.first.z + h * self._hermite(h)
        return correct(self.curve, guess, self.first.tangent)

    def _hermite(self, h: float) -> np.ndarray:
        """Direction from the first point to the cubic between both points, at plane distance h."""
        length = self.length
        s, chord = h / length, (self.last.z - self.first.z) / length
        end = self.last.tangent / (self.last.tangent @ self.first.tangent)
        start = self.first.tangent
        return start + s * (3.0 * chord - 2.0 * start - end) + s * s * (start + end - 2.0 * chord)


def folds(segment: Segment) -> list[tuple[float, CurvePoint]]:
    """Limit points of the segment: plane distances and points, ascending.

    Roots of the last component of the tangent; two in one segment are found where the cubic between both ends
    shows an extreme slope between them.
    """
    ends = [(0.0, segment.first.tangent[-1]), (segment.length, segment.last.tangent[-1])]
    inner = _steepest(segment)
    if inner is not None:
        ends.insert(1, (inner, segment.at(inner).tangent[-1]))
    found = []
    for (low, before), (high, after) in pairwise(ends):
        if before * after < 0.0 and abs(before) > _START:
            h = _root(lambda h: segment.at(h).tangent[-1], low, high, before, after)
            found.append((h, replace(segment.at(h), kind="fold")))
    return [(h, point) for h, point in found if h > _START * segment.length]


def _steepest(segment: Segment) -> float | None:
    """Distance where the slope of the parameter's cubic is extreme, if its sign differs there."""
    length, first, last = segment.length, segment.first, segment.last
    rise = last.z[-1] - first.z[-1]
    d0 = first.tangent[-1] * length
    d1 = last.tangent[-1] / (last.tangent @ first.tangent) * length
    if d0 * d1 <= 0.0:
        return None
    square, linear = 3.0 * (d0 + d1 - 2.0 * rise), 2.0 * (3.0 * rise - 2.0 * d0 - d1)
    if square == 0.0 or not 0.0 < -linear / (2.0 * square) < 1.0:
        return None
    s = -linear / (2.0 * square)
    return s * length if (square * s * s + linear * s + d0) * d0 < 0.0 else None


def branch_point(segment: Segment) -> tuple[float, CurvePoint] | None:
    """Branch point of a segment at whose ends the orientations differ: plane distance and point.

    Root of ``tau = 1 / (c^T B^-1 b)`` with the singular vectors b, c of the bordered matrix B (Govaerts,
    Numerical Methods for Bifurcations of Dynamical Equilibria, 2000, section 3.3).

    Raises
    ------
    LostError
        The ends do not lie on one smooth curve.
    """
    length = segment.length
    left, _, right = np.linalg.svd(segment.first.bordered)
    b, c = left[:, -1], right[-1]

    def tau(h: float) -> float:
        try:
            value = c @ np.linalg.solve(_turned(segment, h).bordered, b)
        except np.linalg.LinAlgError:
            return 0.0
        return 1.0 / value

    low, high = tau(0.0), tau(length)
    if low * high >= 0.0:
        raise LostError("the orientation changes without a branch point: another curve was reached")
    h = _singular_place(tau, length, low, high)
    _check_smooth(segment, h)
    return h, _on_both(segment, h)


def _singular_place(tau, length: float, at_low: float, at_high: float) -> float:
    """Zero of tau between 0 and length; where rounding forbids corrections beside it, that of a line.

    Rounding grows with one over tau, so that points very near the zero cannot be corrected to tolerance.
    """
    from scipy.optimize import brentq

    known = {0.0: at_low, length: at_high}

    def value(h: float) -> float:
        if h not in known:
            known[h] = tau(h)
        return known[h]

    try:
        return brentq(value, 0.0, length, xtol=1e-13 * length, rtol=1e-14)
    except RoundingError:
        low = max(h for h in known if known[h] * at_low > 0.0)
        high = min(h for h in known if known[h] * at_high > 0.0)
        if high < low:
            raise
        return low + (high - low) * known[low] / (known[low] - known[high])


def _turned(segment: Segment, h: float) -> CurvePoint:
    return segment.last if h == segment.length else segment.at(h)


def _check_smooth(segment: Segment, h: float) -> None:
    """A crossing has the same curve on both sides; a jump from curve to curve has a gap."""
    low, high, before, after = _beside(segment, h, _WINDOW)
    gap = np.linalg.norm(after.z - before.z) / (high - low)
    if before.orientation == after.orientation or gap > 3.0 or before.tangent @ after.tangent < 0.9:
        raise LostError("the points before and after a change of orientation lie on different curves")


def _beside(segment: Segment, h: float, part: float):
    """Places and points before and after the place h, as near as asked or as rounding allows.

    The distance starts with a part of the segment.
    """
    while True:
        width = part * segment.length
        low, high = max(h - width, 0.0), min(h + width, segment.length)
        try:
            return low, high, segment.at(low), _turned(segment, high)
        except RoundingError:
            part *= 4.0
            if part > 1.0:
                raise


def _on_both(segment: Segment, h: float) -> CurvePoint:
    """The branch point as the mean of two points beside it, where the equations are not singular."""
    low, high, before, after = _beside(segment, h, _BESIDE)
    share = (h - low) / (high - low)
    z = before.z + share * (after.z - before.z)
    tangent = before.tangent + share * (after.tangent - before.tangent)
    _, derivative = segment.curve.equations(z)
    error = max(before.error, after.error)
    return CurvePoint(z, tangent / np.linalg.norm(tangent), derivative, 0.0, 0, 0.0, error, "branch point")


def _root(function, low: float, high: float, at_low: float, at_high: float) -> float:
    from scipy.optimize import brentq

    if at_low == 0.0 or at_high == 0.0:
        return low if at_low == 0.0 else high
    known = {low: at_low, high: at_high}
    return brentq(lambda h: known.get(h) or function(h), low, high, xtol=1e-13 * high, rtol=1e-14)


def crossing_tangent(curve: ScaledCurve, point: CurvePoint) -> np.ndarray:
    """Unit tangent (n + 1,) of the other curve through a simple branch point.

    With t the known tangent, p the other direction of the null space and ``a_xy = psi^T F''[x, y]``, the
    crossing curve goes along ``2 a_tp p - a_pp t`` (algebraic bifurcation equation, Seydel section 5.5.3).

    Raises
    ------
    LostError
        The point is no simple branch point.
    """
    left, singular, right = np.linalg.svd(point.derivative)
    if len(singular) > 1 and singular[-2] < 1e3 * singular[-1]:
        raise LostError(
            f"no simple branch point: smallest singular values {singular[-2]:.1e}, {singular[-1]:.1e}"
        )
    psi, plane = left[:, -1], right[-2:]
    known = plane @ point.tangent
    other = np.array([-known[1], known[0]]) @ plane
    other /= np.linalg.norm(other)
    step = 1e-3

    def second(direction: np.ndarray) -> float:
        # the derivative along the null space itself changes: psi^T F'[z + h d] d
        ahead = curve.equations(point.z + step * direction)[1] @ direction
        back = curve.equations(point.z - step * direction)[1] @ direction
        return float(psi @ (ahead - back)) / (2.0 * step)

    app, att = second(other), second(point.tangent)
    atp = 0.5 * (second((other + point.tangent) / np.sqrt(2.0)) * 2.0 - app - att)
    direction = 2.0 * atp * other - app * point.tangent
    size = np.linalg.norm(direction)
    if size <= _FLAT * max(abs(app), abs(att), abs(atp), np.finfo(float).tiny):
        raise LostError("the curves through the branch point have no distinct directions")
    return direction / size
