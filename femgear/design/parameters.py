"""Parameters of the deviations: functions of one number that return deviations, for `derivatives`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from femgear.design.relief import with_tip_relief
from femgear.errors import CaseError
from femgear.gears.deviations import no_deviations

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet
    from femgear.gears.deviations import SetDeviations

Parameter = Callable[[float], "SetDeviations"]


def pin_error(
    deviations: SetDeviations, *, planet: int, direction: Literal["radial", "tangential"]
) -> Parameter:
    """Displacement [m] of one planet's axis, on top of the deviations.

    Parameters
    ----------
    deviations : SetDeviations
    planet : int
        1 to N.
    direction : {"radial", "tangential"}
        Outwards and counter-clockwise positive.

    Raises
    ------
    CaseError
        E-RANGE: no such planet or direction.
    """
    N = len(deviations.pin_errors)
    ways = ("radial", "tangential")
    if not 1 <= planet <= N or direction not in ways:
        raise CaseError(
            "no such pin error", code="E-RANGE", value=(planet, direction), limit=f"1 to {N}, {ways}"
        )
    unit = np.zeros((N, 2))
    unit[planet - 1, ways.index(direction)] = 1.0
    return lambda value: replace(deviations, pin_errors=deviations.pin_errors + value * unit)


def tooth_pitch_error(
    deviations: SetDeviations,
    planetary_set: PlanetarySet,
    *,
    gear: Literal["sun", "planet", "ring"],
    tooth: int,
    planet: int = 1,
) -> Parameter:
    """Displacement [m] of one tooth along the reference circle, counter-clockwise, on top of the deviations.

    As one entry of ``cumulative_pitch`` of the case file: the tooth moves as a whole, its left flank towards
    its mate and its right flank away from it; along the line of action by r_b/r of that.

    Parameters
    ----------
    deviations : SetDeviations
    planetary_set : PlanetarySet
    gear : {"sun", "planet", "ring"}
    tooth : int
        Counter-clockwise from 0, see `gears.deviations`.
    planet : int
        Which of them, 1 to N.

    Raises
    ------
    CaseError
        E-RANGE: no such gear, tooth or planet.
    """
    s, names = planetary_set, ("sun", "planet", "ring")
    found = getattr(s, gear) if gear in names else None
    if found is None or not 0 <= tooth < found.teeth or not 1 <= planet <= s.n_planets:
        limit = "a tooth 0 to z - 1 of sun, planet 1 to N or ring"
        raise CaseError("no such tooth", code="E-RANGE", value=(gear, planet, tooth), limit=limit)
    along = found.base_radius / found.reference_radius
    place = (planet - 1, tooth) if gear == "planet" else tooth
    signs = (
        {"planet_pitch": -1.0, "planet_ring_side_pitch": 1.0} if gear == "planet" else {f"{gear}_pitch": -1.0}
    )

    def variant(value: float) -> SetDeviations:
        arrays = {name: np.array(getattr(deviations, name)) for name in signs}
        for name, sign in signs.items():
            arrays[name][place] += sign * along * value
        return replace(deviations, **arrays)

    return variant


def relief_amount(deviations, planetary_set: PlanetarySet, *, length: float, **options) -> Parameter:
    """Amount [m] of the tip relief of `relief.with_tip_relief`; options are its ``power`` and ``back``."""
    base = no_deviations(planetary_set) if deviations is None else deviations
    return lambda value: with_tip_relief(base, planetary_set, amount=value, length=length, **options)


def relief_length(deviations, planetary_set: PlanetarySet, *, amount: float, **options) -> Parameter:
    """Length of the same relief along the path of contact, in lengths of two-pair contact."""
    base = no_deviations(planetary_set) if deviations is None else deviations
    return lambda value: with_tip_relief(base, planetary_set, amount=amount, length=value, **options)


def two_pair_length(planetary_set: PlanetarySet) -> float:
    """Length of two-pair contact of sun and planet at either end, ``(epsilon - 1) p_b`` [m]."""
    from femgear.design.relief import relief_starts

    longer, shorter = (relief_starts(planetary_set, length=length)[0] for length in (0.5, 1.0))
    return 2.0 * (longer - shorter)
