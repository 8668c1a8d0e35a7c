"""Where tracked branches of modes cross or veer, and how far two modes veer instead of crossing."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from femgear.solvers.linear.tracking import TrackedModes


@dataclass(frozen=True)
class Approach:
    """Two branches at their smallest distance.

    Parameters
    ----------
    first, second : int
        Branches.
    value : float
        Parameter of the smallest distance.
    frequency, gap : float
        Mean frequency and smallest distance there [Hz].
    exchange : float
        MAC of the first branch before with the second after: one where they change shapes, zero where each
        keeps its own.
    kind : str
        ``"crossing"`` where the branches pass through each other; ``"veering"`` where they turn away and
        exchange their shapes; ``"approach"`` where they turn away and mostly keep them.
    """

    first: int
    second: int
    value: float
    frequency: float
    gap: float
    exchange: float
    kind: str


def mac(first, second, mass) -> np.ndarray:
    """Modal assurance criterion (m1, m2) with the mass as weight.

    ``|a^H M b|^2 / (a^H M a) (b^H M b)`` (R. J. Allemang, Sound and Vibration 37(8), 2003, 14-23).

    Parameters
    ----------
    first, second : (n, m1), (n, m2) arrays
    mass : (n, n) array
    """
    root = np.linalg.cholesky(np.asarray(mass, float)).T
    lower, other = (root @ shape / np.linalg.norm(root @ shape, axis=0) for shape in (first, second))
    return np.abs(lower.conj().T @ other) ** 2


def approaches(tracked: TrackedModes, mass, *, within: float = 0.1) -> tuple[Approach, ...]:
    """Crossings and veerings of tracked modes, in the order of the parameter.

    Near a veering of two modes the squared distance of their eigenvalues is a parabola in the parameter
    (N. C. Perkins and C. D. Mote, J. Sound Vib. 106, 1986, 451-463), whose vertex is taken.

    Parameters
    ----------
    tracked : TrackedModes
    mass : (n, n) array
    within : float
        Largest distance relative to the frequency.
    """
    f = tracked.eigenvalue.imag / (2.0 * np.pi)
    approaches = []
    for first in range(f.shape[1]):
        for second in range(first + 1, f.shape[1]):
            approaches += _between(tracked, f, mass, first, second, within)
    return tuple(sorted(approaches, key=lambda approach: approach.value))


def coupling_factor(first, second, mass, stiffness_change, mass_change=None, *, squared) -> float:
    """How far two modes veer instead of crossing, from derivatives at one parameter value.

    With ``s_ij = phi_i^T (dK - lambda dM) phi_j`` the two eigenvalues change as those of the 2 x 2 matrix of
    ``s``, so that their smallest distance is this factor times the present one:
    ``2 |s_12| / sqrt((s_11 - s_22)^2 + 4 s_12^2)``. Zero: they cross. One: they are at their smallest
    distance. ``s_12`` is the coupling of Perkins and Mote (1986); J. Lin and R. G. Parker (Mech. Struct.
    Mach. 29, 2001, 411-429) evaluate it for planetary gears.

    Parameters
    ----------
    first, second : (n,) arrays
        Real shapes.
    mass, stiffness_change : (n, n) arrays
        M and dK/dp, the meshes included.
    mass_change : (n, n) array, optional
        dM/dp.
    squared : (float, float)
        ``omega^2`` of both [1/s^2].
    """
    mass = np.asarray(mass)
    pair = np.column_stack([first, second])
    pair = pair / np.sqrt(np.einsum("im,im->m", pair, mass @ pair))
    s = pair.T @ stiffness_change @ pair
    if mass_change is not None:
        s = s - 0.5 * (squared[0] + squared[1]) * (pair.T @ mass_change @ pair)
    size = np.hypot(s[0, 0] - s[1, 1], 2.0 * s[0, 1])
    return float(2.0 * abs(s[0, 1]) / size) if size > 0.0 else 0.0


def _between(tracked: TrackedModes, f, mass, first: int, second: int, within: float) -> list[Approach]:
    """Approaches of two branches."""
    value, difference = tracked.value, f[:, first] - f[:, second]
    mean = 0.5 * (f[:, first] + f[:, second])
    gap, scale = np.abs(difference), np.abs(mean)
    apart = gap > 1e-6 * scale
    minima = []
    places = np.flatnonzero(apart)
    # signs are compared over the points that are apart, so that a hit on the crossing does not hide it
    for left, right in itertools.pairwise(places):
        if difference[left] * difference[right] < 0.0:
            share = difference[left] / (difference[left] - difference[right])
            at = value[left] + share * (value[right] - value[left])
            minima.append((at, np.interp(share, [0, 1], mean[[left, right]]), 0.0, left, right))
    inner = np.flatnonzero((gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:]) & apart[1:-1]) + 1
    for i in inner:
        if gap[i] > within * scale[i] or not np.all(difference[i - 1 : i + 2] * difference[i] > 0.0):
            continue
        at, smallest = _vertex(value[i - 1 : i + 2], gap[i - 1 : i + 2])
        minima.append((at, mean[i], smallest, i, i))
    return [_named(tracked, mass, gap, first, second, *minimum) for minimum in minima]


def _vertex(value: np.ndarray, gap: np.ndarray) -> tuple[float, float]:
    """Where the parabola through the squares of three distances is smallest, and the distance there."""
    x = value - value[1]
    c = np.linalg.solve(np.vander(x, 3, increasing=True), gap**2)
    shift = float(np.clip(-0.5 * c[1] / c[2], *sorted((x[0], x[2]))))
    square = c[0] + shift * (c[1] + shift * c[2])
    return float(value[1] + shift), float(np.sqrt(max(square, 0.0)))


def _named(tracked, mass, gap, first, second, at, mean, smallest, left, right) -> Approach:
    if smallest > 0.0:
        # shapes are compared where the branches are five times as far apart: 1 / 25 of them is then mixed
        wide = np.flatnonzero(gap >= 5.0 * smallest)
        left, right = (max(wide[wide < left], default=0), min(wide[wide > right], default=len(gap) - 1))
    exchange = mac(tracked.shape[left][:, [first]], tracked.shape[right][:, [second]], mass)[0, 0]
    kind = "crossing" if smallest == 0.0 else "veering" if exchange > 0.5 else "approach"
    return Approach(first, second, float(at), float(mean), float(smallest), float(exchange), kind)
