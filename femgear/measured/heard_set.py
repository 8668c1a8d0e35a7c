"""What the lines on a housing depend on: teeth and places of the planets of a set, and how fast its shafts turn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from femgear.case.gear_set import need_set, planetary_set
from femgear.errors import CaseError
from femgear.gears.kinematics import speeds
from femgear.housing.orders import spacing_symmetry

_COUNTS, _MOST_HARMONICS = (2, 3, 4, 5, 6, 8, 10, 12, 20, 24, 30, 60), 100
"""Numbers of pulses a turn that may be taken for one another, and mesh harmonics that are looked at."""
_MOST_OF_IT, _LOUD = 0.5, 1e-3
"""Share of the power of lines at these orders from which on a factor explains them; of loud lines over the largest."""
_BESIDE = 6
"""Carrier orders on either side of a mesh harmonic at which most lines of a healthy set lie."""


@dataclass(frozen=True)
class HeardSet:
    """A planetary set whose ring stands still, as its lines tell it.

    Parameters
    ----------
    ring, sun, planet : int
        Teeth; None of sun and planet where they are not known.
    angles : (N,) array
        Of the planets, in the frame of the carrier [rad].
    input : str
        Member whose speed is given.
    carrier_per_turn : mapping of str to float
        Turns of the carrier in one of each member that turns.
    """

    ring: int
    sun: int | None
    planet: int | None
    angles: np.ndarray
    input: str = "carrier"
    carrier_per_turn: Mapping[str, float] = field(default_factory=lambda: {"carrier": 1.0})

    @property
    def teeth(self) -> tuple[int, int | None, int | None]:
        """As `femgear.housing.orders.classify_line` takes them."""
        return self.ring, self.sun, self.planet

    def whole_orders(self, highest: float) -> np.ndarray:
        """Find whole orders (n,) from those near the first mesh harmonic to a highest, at which faults have lines too.

        Those of a healthy set, which the symmetry of the spacing allows, come twice.
        """
        orders = np.arange(max(self.ring - _BESIDE, 1), int(highest) + 1)
        return np.concatenate([orders, orders[orders % spacing_symmetry(self.angles) == 0]])

    def symmetric_orders(self, harmonics: int) -> np.ndarray:
        """Find orders (n,) near the first mesh harmonics that the symmetry of the spacing allows, ascending."""
        symmetry, beside = spacing_symmetry(self.angles), np.arange(-_BESIDE, _BESIDE + 1)
        orders = (np.arange(1, harmonics + 1)[:, None] * self.ring + beside).ravel()
        return np.unique(orders[(orders % symmetry == 0) & (orders > 0)])


@dataclass(frozen=True)
class MeshLines:
    """How much of the lines of a spectrum lies where the mesh of a set makes them.

    Parameters
    ----------
    share : float
        Of the power of all lines, that at `HeardSet.symmetric_orders`.
    factor : float
        Turns of the carrier over those that were counted, with which most of it would lie there; 1 where none is known.
    """

    share: float
    factor: float


def lines_near_mesh(gear_set: HeardSet, order: np.ndarray, height: np.ndarray, tolerance: float) -> MeshLines:
    """Look for lines (k,) at orders near mesh harmonics, and for a factor that would bring them to all of these.

    Such factors come from pulses that are counted as those of another shaft, or as more or fewer a turn.
    """
    power, shafts = np.asarray(height, float) ** 2, [*gear_set.carrier_per_turn.values()]
    factors = {1.0, *(float(n) for n in _COUNTS), *(1.0 / n for n in _COUNTS)}
    factors |= {a / b for a in shafts for b in shafts if b}
    harmonics = int(np.max(order, initial=0.0) * max(factors) / gear_set.ring) + 1
    near = gear_set.symmetric_orders(min(harmonics, _MOST_HARMONICS)).astype(float)

    def share(factor: float) -> float:
        at = np.asarray(order, float) / factor
        place = np.clip(np.searchsorted(near, at), 1, len(near) - 1)
        away = np.minimum(np.abs(at - near[place - 1]), np.abs(at - near[place]))
        return float(power[away <= tolerance].sum() / max(power.sum(), np.finfo(float).tiny))

    if not power.any():
        return MeshLines(1.0, 1.0)
    whole = share(1.0)
    if whole > _MOST_OF_IT:
        return MeshLines(whole, _skipped_harmonics(gear_set, order, power))
    best = max(sorted(factors, key=lambda factor: abs(np.log(factor))), key=share)
    return MeshLines(whole, best if share(best) > _MOST_OF_IT else 1.0)


def _skipped_harmonics(gear_set: HeardSet, order: np.ndarray, power: np.ndarray) -> float:
    """Find the number n of which all mesh harmonics with loud lines are multiples, where there are two or more."""
    loud = np.asarray(order)[power > _LOUD * power.max()]
    harmonics = np.unique(np.rint(loud / gear_set.ring).astype(int))
    step = int(np.gcd.reduce(harmonics)) if len(harmonics) > 1 else 1
    return float(step) if step in _COUNTS else 1.0


def heard_set(case: Any) -> HeardSet:
    """Take from a case what lines on its housing depend on.

    CaseError: no planetary set (E-MODEL), or one whose ring turns (E-FIXED-MEMBER).
    """
    need_set(case)
    if case.operation.fixed != "ring":
        message, remedy = "orders are those of a set whose ring stands still", "fix the ring"
        raise CaseError(message, code="E-FIXED-MEMBER", key="operation.fixed", limit='"ring"', remedy=remedy)
    gears = planetary_set(case)
    turning = speeds(gears, input="carrier", fixed="ring", speed=1.0)
    return HeardSet(
        gears.ring.teeth,
        gears.sun.teeth,
        gears.planet.teeth,
        np.asarray(gears.planet_angles),
        case.operation.input,
        {"sun": abs(1.0 / turning.sun), "carrier": 1.0},
    )
