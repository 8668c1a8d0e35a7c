"""Whether the turns of a recording can be right: where its lines lie, against where a set makes them.

Lines of a set, healthy or not, lie at few places of the orders of its carrier: at multiples of the symmetry of its
planets, most of them near mesh harmonics, at other whole orders, and at turns of sun and planets beside these. Where
pulses are counted as those of another shaft, or as more or fewer a turn, all places are so many times as far apart. For
every such factor a mixture of these densities of places, and of an even one for lines from elsewhere, is fitted to the
lines: A. P. Dempster, N. M. Laird and D. B. Rubin, Maximum likelihood from incomplete data via the EM algorithm, J. R.
Stat. Soc. B 39 (1977) 1-38. A density has an integral of one. So a factor with many places, which fit much by chance,
gains little by each of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.housing.orders import spacing_symmetry
from femgear.measured.heard_set import HeardSet

_COUNTS = (2, 3, 4, 5, 6, 8, 10, 12, 20, 24, 30, 60)
"""Numbers of pulses a turn that may be taken for one another."""
_HALF_AS_DENSE = 6.0
"""Carrier orders beside a mesh harmonic at which lines are half as dense as on it."""
_BESIDE = 6.0
"""Carrier orders on either side of a mesh harmonic within which lines of a healthy set count, or two symmetric ones."""
_CLEARLY, _BY_FAR = 0.3, 2.0
"""Gains of the mean logarithm of the density from which on a factor fits better, and so whatever else it does."""
_SHARE = 0.1
"""Share of the lines that a factor must bring to places of a healthy set."""
_ANY = 4.0
"""Gain of the logarithms of all lines over an even density, below which nothing is said of the set."""
_ROUNDS, _EVEN = 40, 0.02
"""Rounds of the fit, and share of an even mixture that is kept in it."""


@dataclass(frozen=True)
class MeshLines:
    """How lines of a spectrum lie at the places of a set.

    Parameters
    ----------
    share : float
        Of the roots of the heights of all lines, that of those near mesh harmonics that the spacing allows.
    factor : float
        Turns of the carrier over those that were counted, with which lines lie far better; 1 where there is none.
    share_then : float
        As ``share``, with that factor.
    fits : bool
        Whether the places of lines have to do with the set at all.
    """

    share: float
    factor: float
    share_then: float
    fits: bool


def lines_near_mesh(
    gear_set: HeardSet, order: np.ndarray, height: np.ndarray, tolerance: float, highest: float
) -> MeshLines:
    """Compare places of lines (k,) with those of a set, and look for a factor of the turns that brings them there.

    Lines weigh by the roots of their heights, so that no single one decides. A factor is told where the mean logarithm
    of the density of places grows clearly, a tenth of the lines is then near mesh harmonics, and as many as before.

    Parameters
    ----------
    gear_set : HeardSet
        The set.
    order, height : (k,) arrays
        Orders of the carrier, and amplitudes in any unit.
    tolerance : float
        Distance of orders that count as one.
    highest : float
        Order at which the spectrum ends.
    """
    order, weight = np.asarray(order, float), np.sqrt(np.asarray(height, float))
    if not weight.any():
        return MeshLines(1.0, 1.0, 1.0, True)
    weight = weight / weight.sum()
    lines = float(1.0 / (weight**2).sum())
    # with the others no mesh harmonic would be in the spectrum
    shafts = [*gear_set.carrier_per_turn.values()]
    factors = {*map(float, _COUNTS), *(1.0 / n for n in _COUNTS), *(a / b for a in shafts for b in shafts if b)} - {1.0}
    factors = {factor for factor in factors if highest / factor > gear_set.ring + _BESIDE}
    gain = {
        factor: _mean_logarithm(_densities(gear_set, order / factor, tolerance / factor, highest / factor), weight)
        for factor in factors | {1.0}
    }
    share = _healthy_share(gear_set, order, weight, tolerance)
    for factor in sorted(factors, key=gain.__getitem__, reverse=True):
        then = _healthy_share(gear_set, order / factor, weight, tolerance / factor)
        better = gain[factor] - gain[1.0]
        if then >= _SHARE and (better > _BY_FAR or (better > _CLEARLY and then >= share)):
            return MeshLines(share, factor, then, True)
    return MeshLines(share, 1.0, share, gain[1.0] * lines > _ANY)


def _healthy_share(gear_set: HeardSet, order: np.ndarray, weight: np.ndarray, tolerance: float) -> float:
    """Add up weights (k,) of lines near mesh harmonics that the symmetry of the spacing allows."""
    symmetry = spacing_symmetry(gear_set.angles)
    whole = np.rint(order / symmetry) * symmetry
    harmonic = np.rint(whole / gear_set.ring)
    near = np.abs(whole - harmonic * gear_set.ring) <= max(_BESIDE, 2 * symmetry)
    return float(weight[near & (harmonic > 0) & (np.abs(order - whole) <= tolerance)].sum())


def _densities(gear_set: HeardSet, order: np.ndarray, tolerance: float, highest: float) -> np.ndarray:
    """Compute densities of places at orders (k,) over the even one, of all kinds of places (m, k); the last is even.

    Places closer than the tolerance are left out: they are even.
    """
    symmetry = spacing_symmetry(gear_set.angles)
    kinds = [np.arange(symmetry, highest + 1.0, symmetry)]
    kinds += [np.arange(1.0, highest + 1.0)] * (symmetry > 1 and tolerance < 0.5)
    kinds += gear_set.part_places(highest, tolerance)
    densities = [np.ones(len(order))]
    for places in filter(len, kinds):
        harmonic = np.rint(places / gear_set.ring)
        beside = 1.0 / (1.0 + ((places - harmonic * gear_set.ring) / _HALF_AS_DENSE) ** 2)
        # orders of passing planets are apart: how many mesh harmonics there are tells nothing of them
        for weight in (beside * (harmonic == 0), beside * (harmonic > 0), np.ones(len(places))):
            total = np.concatenate([[0.0], np.cumsum(weight / max(weight.sum(), 1e-300))])
            ends = (np.searchsorted(places, order + tolerance, "right"), np.searchsorted(places, order - tolerance))
            densities.append((total[ends[0]] - total[ends[1]]) * highest / (2.0 * tolerance))
    return np.array(densities[1:] + densities[:1])


def _mean_logarithm(densities: np.ndarray, weight: np.ndarray) -> float:
    """Fit a mixture of densities (m, k) to lines of weights (k,) with the sum one: the mean logarithm of it."""
    mixture = np.full(len(densities), 1.0 / len(densities))
    for _ in range(_ROUNDS):
        share = mixture[:, None] * densities
        mixture = ((share / share.sum(axis=0)) @ weight + _EVEN / len(densities)) / (1.0 + _EVEN)
    return float(weight @ np.log(mixture @ densities))
