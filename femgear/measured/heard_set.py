"""What the lines on a housing depend on: teeth and places of the planets of a set, and how fast its shafts turn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from femgear.case.gear_set import need_set, planetary_set
from femgear.errors import CaseError
from femgear.gears.kinematics import speeds
from femgear.housing.orders import part_orders, spacing_symmetry

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

    def part_places(self, highest: float, tolerance: float) -> list[np.ndarray]:
        """Find orders (m,) up to a highest at which a fault of the sun has lines, and those of one planet, ascending.

        Those closer than four times the tolerance of orders are left out, as most lines would be among them.
        """
        parts = part_orders(self.teeth, spacing_symmetry(self.angles), tolerance)
        return [
            (np.arange(0, int(highest) + 1, step)[:, None] + beside).ravel()
            for step, beside in parts
            if 4.0 * tolerance * len(beside) < step
        ]

    def symmetric_orders(self, harmonics: int) -> np.ndarray:
        """Find orders (n,) near the first mesh harmonics that the symmetry of the spacing allows, ascending."""
        symmetry, beside = spacing_symmetry(self.angles), np.arange(-_BESIDE, _BESIDE + 1)
        orders = (np.arange(1, harmonics + 1)[:, None] * self.ring + beside).ravel()
        return np.unique(orders[(orders % symmetry == 0) & (orders > 0)])


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
