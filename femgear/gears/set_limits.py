"""Refusals of the data of a planetary set, and the usual planet angles."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import GeometryError

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet


def equal_planet_angles(planets: int) -> tuple[float, ...]:
    """Angles ``2 pi n / N`` [rad] of N equally spaced planets.

    Raises
    ------
    GeometryError
        Not a whole number of at least one planet (E-PLANETS).
    """
    whole = isinstance(planets, int | np.integer) and not isinstance(planets, bool)
    if not whole or not 1 <= planets <= 1000:
        raise GeometryError(
            f"a planetary set with {planets!r} planets",
            code="E-PLANETS",
            key="set.planets",
            value=planets,
            limit="a whole number, 1 to 1000",
            remedy="three planets share the load of a set best",
        )
    return tuple(2.0 * math.pi * n / int(planets) for n in range(int(planets)))


def check_roles(planetary: PlanetarySet) -> None:
    """Refuse gears that cannot be sun, planet and ring of one set (E-ROLE, E-MODULE)."""
    sun, planet, ring = planetary.sun, planetary.planet, planetary.ring
    for gear, internal in ((sun, False), (planet, False), (ring, True)):
        if gear.internal is not internal:
            raise GeometryError(
                f"the {gear.name} is {'an external' if internal else 'an internal'} gear",
                code="E-ROLE",
                key=f"{gear.name}.internal",
                value=gear.internal,
                limit="sun and planet external, ring internal",
            )
        for entry in ("module", "pressure_angle"):
            mine, suns = getattr(gear, entry), getattr(sun, entry)
            if abs(mine - suns) > 1e-12 * suns:
                raise GeometryError(
                    f"{entry.replace('_', ' ')} of the {gear.name} is {mine:.6g}, of the sun {suns:.6g}",
                    code="E-MODULE",
                    key=f"{gear.name}.{entry}",
                    value=mine,
                    limit=f"{suns:.6g}",
                    remedy="gears that mesh share module and pressure angle",
                )


def check_angles(angles: tuple[float, ...]) -> None:
    """Refuse planet angles [rad] that are none, unordered or in the wrong unit (E-PLANETS, E-ANGLES)."""
    if not 1 <= len(angles) <= 1000:
        equal_planet_angles(len(angles))
    problem = None
    if not all(math.isfinite(a) for a in angles):
        problem = "contain a value that is not finite"
    elif any(b - a < 1e-9 for a, b in pairwise(angles)):
        problem = "are not in ascending order, or two of them are equal"
    elif angles[-1] - angles[0] > 2.0 * math.pi - 1e-9:
        problem = f"span {angles[-1] - angles[0]:.6g} rad, more than one turn (degrees taken for radians?)"
    if problem:
        listing = ", ".join(f"{a:.6g}" for a in angles[:12])
        raise GeometryError(
            f"the planet angles [{listing}] rad {problem}",
            code="E-ANGLES",
            key="set.planet_angles",
            value=listing,
            limit="ascending, different, within one turn",
            remedy="sort the angles; the case file takes them with a unit, such as '120 deg'",
        )
