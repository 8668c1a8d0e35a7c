"""Sets whose planets mesh with one another: places of the planets, room between tips, tooth numbers of a ratio.

Gears of one module without shift, as in a double set (sun, inner and outer planet, ring) and in a Ravigneaux set
(small and large sun, short and long planet, ring). A triangle of the axis and both planets has the sides of the centre
distances; neighbours around the axis and gears that pass by one another keep a module between their tips.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from femgear.gears.planet_assembly import assembly_step, double_gears, ravigneaux_gears

PAIRED = ("double", "ravigneaux")
"""Kinds of sets with planets in mesh."""
GAP = 1.0
"""Least way between tips that do not mesh [modules]."""


@dataclass(frozen=True)
class PlanetPlace:
    """Where a planet of a branch stands, lengths in modules.

    Parameters
    ----------
    radius, angle : float
        Of its axis, from that of the set; the angle from the first planet of the branch [rad].
    tip : float
        Radius of its tips.
    on_sun, on_ring : bool
        Whether it meshes with the sun and the ring of its plane.
    """

    radius: float
    angle: float
    tip: float
    on_sun: bool
    on_ring: bool


def angle_between(first: float, second: float, between: float) -> float | None:
    """Find the angle [rad] at which planets on two radii are so far apart; None where they cannot be."""
    cosine = (first**2 + second**2 - between**2) / (2.0 * first * second)
    return math.acos(cosine) if -1.0 < cosine < 1.0 else None


def planet_places(teeth: Sequence[int]) -> tuple[PlanetPlace, PlanetPlace] | None:
    """Place both planets of a branch; None where they do not reach each other.

    Of a double set, teeth of sun, inner and outer planet and ring; of a Ravigneaux set, those of small and large sun,
    short and long planet and ring.
    """
    first, second, ring = teeth[-3:]
    near, far = 0.5 * (teeth[0] + first), 0.5 * (ring - second)
    angle = angle_between(near, far, 0.5 * (first + second))
    if angle is None:
        return None
    inner = PlanetPlace(near, 0.0, 0.5 * first + 1.0, on_sun=True, on_ring=False)
    return inner, PlanetPlace(far, angle, 0.5 * second + 1.0, on_sun=False, on_ring=True)


def have_room(places: Sequence[PlanetPlace], sun: int, ring: int, count: int) -> bool:
    """Whether so many branches fit between a sun and a ring of these teeth."""
    sun_tip, ring_tip = 0.5 * sun + 1.0, 0.5 * ring - 1.0
    for place in places:
        if not place.on_sun and place.radius - place.tip < sun_tip + GAP:
            return False
        if not place.on_ring and place.radius + place.tip > ring_tip - GAP:
            return False
        for other in places:
            least = place.tip + other.tip + GAP
            for turn in range(1, count):
                apart = place.angle - other.angle + 2.0 * math.pi * turn / count
                square = place.radius**2 + other.radius**2 - 2.0 * place.radius * other.radius * math.cos(apart)
                if square < least**2:
                    return False
    return True


def paired_ratio(teeth: Sequence[int], fixed: str) -> float:
    """Compute the speed of the (small) sun over that of the driven member, without sign.

    That is the carrier where the ring stands, else the ring. With Willis' equation ``z_s (w_s - w_c) = z_r (w_r -
    w_c)`` of a double set, which the small sun of a Ravigneaux set has too; where its large sun stands, ``z_l (w_l -
    w_c) = -z_r (w_r - w_c)`` ties the carrier to the ring.

    Parameters
    ----------
    teeth : sequence of int
        Small sun, in a Ravigneaux set large sun, and others; the ring comes last.
    fixed : {"ring", "carrier", "sun"}
        What stands; "sun" is the large sun of a Ravigneaux set.
    """
    sun, ring = teeth[0], teeth[-1]
    if fixed == "sun":
        return (1.0 + teeth[1] / sun) / (1.0 + teeth[1] / ring)
    return ring / sun - (fixed == "ring")


def paired_teeth(
    kind: str, fixed: str, limits: tuple[float, float], planets: Sequence[int], suns: range, others: range
) -> Iterator[tuple[tuple[int, ...], int]]:
    """List teeth of double or Ravigneaux sets with a ratio between limits that assemble with so many branches.

    Parameters
    ----------
    kind : {"double", "ravigneaux"}
    fixed : {"ring", "carrier", "sun"}
        As of `paired_ratio`.
    limits : (float, float)
        Least and largest ratio.
    planets : sequence of int
        Numbers of branches, equally spaced.
    suns, others : range
        Teeth of suns, and of planets.
    """
    for suns_and_ring in _central_gears(kind, fixed, limits, suns, others):
        *central, ring = suns_and_ring
        # at how many places branches fit is a matter of the central gears alone
        alike = others.start, others.start, ring
        gears = (
            double_gears(central[0], *alike) if kind == "double" else ravigneaux_gears(central[0], central[1], *alike)
        )
        places = int(1 / assembly_step(gears))
        counts = [count for count in planets if places % count == 0]
        seconds = [(ring - central[1]) // 2] if kind == "ravigneaux" else others
        between = (ring - central[0]) // 2
        for first, second in product(range(others.start, min(others.stop, between)), seconds):
            if second >= between or first + second < between or not counts:
                continue
            teeth = (*central, first, second, ring)
            branch = planet_places(teeth)
            if branch is not None:
                yield from ((teeth, count) for count in counts if have_room(branch, central[0], ring, count))


def _central_gears(
    kind: str, fixed: str, limits: tuple[float, float], suns: range, others: range
) -> Iterator[tuple[int, ...]]:
    """Suns and ring of a ratio between limits."""
    low, high = limits
    if kind == "double":
        rings = range(suns.start + 2 * others.start, suns.stop + 4 * others.stop)
        for sun in suns:
            yield from ((sun, ring) for ring in rings if low <= paired_ratio((sun, ring), fixed) <= high)
        return
    for small, large, long in product(suns, suns, others):
        ring = large + 2 * long
        if low <= paired_ratio((small, large, ring), fixed) <= high:
            yield small, large, ring
