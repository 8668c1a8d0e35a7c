"""Kinds of faults of teeth for data sets: their sizes, and the entries of a case that make them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.quantities import LENGTH, to_si
from femgear.contact.flank_pairs import acting_flanks, mesh_pairs
from femgear.errors import CaseError
from femgear.gears.faults import RIGHT, flank_beside

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

HEALTHY = "healthy"
SIZED = {"crack": "depth", "spall": "length", "broken corner": "length", "wear": "depth"}
"""Entry of the case file that is the size of a kind."""
KINDS = (HEALTHY, "crack", "spall", "missing", "broken corner", "wear")
GEARS = ("sun", "planet", "ring")
_RANGES = {"crack": (0.2, 1.2), "spall": (0.2, 0.6), "broken corner": (0.1, 0.4), "wear": (0.001, 0.01)}
"""Smallest and largest size by default [modules]."""
_SPALL_DEPTH = 0.05
"""Of a spall [modules]."""
_LEFT_OVER = 0.9
"""Share of the height of a flank that may be broken off, and of the room about a pit."""


@dataclass(frozen=True)
class FaultPlace:
    """A fault of a data set.

    Parameters
    ----------
    kind, gear : str
        One of `KINDS`, and "sun", "planet" or "ring"; "" of the healthy.
    planet : int
        Number of the planet from 1; 0 of other gears.
    tooth : int
        From 0; -1 of wear, which is that of all teeth.
    flank : str
        As the case file names it; "" of kinds of whole teeth.
    size : float
        [m]; 0 of kinds without one.
    """

    kind: str
    gear: str = ""
    planet: int = 0
    tooth: int = -1
    flank: str = ""
    size: float = 0.0


def separated_words(values: Sequence[str]) -> tuple[str, ...]:
    """Split words that commas separate, as in ``("crack,spall", "wear")``."""
    return tuple(word.strip() for text in values for word in text.split(",") if word.strip())


def chosen_words(values: Sequence[str], allowed: Sequence[str], key: str) -> tuple[str, ...]:
    """Give the words that are chosen_words, all that are allowed by default; CaseError (E-CHOICE): another one."""
    named = separated_words(values) or tuple(allowed)
    if wrong := [word for word in named if word not in allowed]:
        limit = ", ".join(allowed)
        raise CaseError(f"there is no {wrong[0]}", code="E-CHOICE", key=key, value=wrong[0], limit=limit)
    return tuple(dict.fromkeys(named))


def size_ranges(values: Sequence[str], module: float) -> dict[str, tuple[float, float]]:
    """Read ranges of sizes [m] by kind, as ``"crack=0.5 mm..2 mm"``; others are some parts of a module [m].

    CaseError: E-CHOICE (no such kind), E-UNIT, E-RANGE.
    """
    ranges = {kind: (low * module, high * module) for kind, (low, high) in _RANGES.items()}
    for text in separated_words(values):
        kind, equal, rest = text.partition("=")
        kind, ends = kind.strip(), rest.split("..")
        if kind not in SIZED or not equal:
            message, limit = "no size of such a kind", ", ".join(f"{name}=..." for name in SIZED)
            raise CaseError(message, code="E-CHOICE", key="--sizes", value=text, limit=limit)
        try:
            low, high = (to_si(end.strip(), LENGTH, low=1e-7, high=0.05) for end in (ends[0], ends[-1]))
        except CaseError as error:
            error.key = "--sizes"
            raise
        if len(ends) > 2 or low > high:
            example = 'as in "crack=0.5 mm..2 mm"'
            raise CaseError("no range of sizes", code="E-RANGE", key="--sizes", value=text, limit=example)
        ranges[kind] = (low, high)
    return ranges


def carrying_flanks(gears: PlanetarySet, gear: str, *, back: bool) -> tuple[str, ...]:
    """Name the flanks of a gear that carry; ``back`` under a negative torque."""
    number = GEARS.index(gear)
    sides = sorted({side for body, acting in acting_flanks(gears) if body == number for *_, side in acting})
    names = ("sun side", "ring side") if gear == "planet" else ("left", "right")
    return tuple(names[RIGHT - side if back else side] for side in sides)


def drawn_fault(
    kind: str,
    gears: PlanetarySet,
    among: Sequence[str],
    sizes: Mapping[str, tuple[float, float]],
    shares: np.ndarray,
    *,
    back: bool,
) -> FaultPlace:
    """Choose gear, planet, tooth, flank and size of a fault of a kind by shares (5,) between 0 and 1."""
    if kind == HEALTHY:
        return FaultPlace(HEALTHY)
    gear = among[int(shares[0] * len(among))]
    teeth, flanks = getattr(gears, gear).teeth, carrying_flanks(gears, gear, back=back)
    size = 0.0
    if kind in SIZED:
        low, high = sizes[kind]
        size = low + (high - low) * float(shares[4])
    fault = FaultPlace(
        kind,
        gear,
        1 + int(shares[1] * gears.n_planets) if gear == "planet" else 0,
        -1 if kind == "wear" else int(shares[2] * teeth),
        flanks[int(shares[3] * len(flanks))] if kind in ("crack", "spall", "wear") else "",
    )
    return replace(fault, size=float(f"{min(size, _largest(fault, gears)):.6g}"))


def _largest(fault: FaultPlace, gears: PlanetarySet) -> float:
    """Largest size of a fault [m]: a flank has room for it."""
    if fault.kind == "broken corner":
        faulty = getattr(gears, fault.gear)
        return _LEFT_OVER * abs(faulty.tip_radius - faulty.form_radius)
    if fault.kind == "spall":
        gear, radius = getattr(gears, fault.gear), _pitch_radius(gears, fault)
        return _LEFT_OVER * 2.0 * min(flank_beside(gear, math.sqrt(radius**2 - gear.base_radius**2)))
    return math.inf


def fault_entries(fault: FaultPlace, gears: PlanetarySet) -> dict[str, list[dict[str, object]]]:
    """Write a fault as entries of a case, by key; none of the healthy."""
    if fault.kind == HEALTHY:
        return {}
    entry: dict[str, object] = {"kind": fault.kind}
    entry |= {"planet": fault.planet} if fault.planet else {}
    entry |= {"tooth": fault.tooth} if fault.tooth >= 0 else {}
    entry |= {"flank": fault.flank} if fault.flank else {}
    if fault.kind in SIZED:
        entry[SIZED[fault.kind]] = f"{1e3 * fault.size:.9g} mm"
    if fault.kind == "spall":
        entry |= {"diameter": f"{2e3 * _pitch_radius(gears, fault):.9g} mm"}
        entry |= {"depth": f"{1e3 * _SPALL_DEPTH * gears.sun.module:.9g} mm"}
    return {f"{fault.gear}.fault": [entry]}


def _pitch_radius(gears: PlanetarySet, fault: FaultPlace) -> float:
    """Radius at which a flank of a gear rolls without sliding [m]: pits begin there."""
    number = GEARS.index(fault.gear)
    pairs = mesh_pairs(gears)
    kind = 1 if fault.gear == "ring" or fault.flank == "ring side" else 0
    place = gears.mates[kind].index(number)
    return float(np.hypot(gears.gears[number].base_radius, pairs[kind].roll_on(place, 0.0)))
