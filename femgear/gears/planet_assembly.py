"""Turns that gears of planetary sets can make together: angles at which planets fit, their marks, Willis' equation.

Seen from the carrier, gears in mesh move on by equal numbers of teeth. Turns v of central gears and y of the bodies
of one branch of planets leave the teeth in their gaps where in every mesh

    z_1 v_1 + z_2 y_2 = whole   (external),      z_1 y_1 - z_2 v_2 = whole   (internal)

With zero in place of whole these are the motions. Sums of the meshes in which no planet is left, with whole factors
that have no common divisor, are relations of the central gears alone (`tooth_relations`): Willis' equation. A branch
that stands x turns further on sees all central gears turned back by x: it fits where x times the sum of the weights of
every relation is whole. Known cases (H. W. Müller, Epicyclic Drive Trains, Wayne State University Press, 1982):

===========  ==========================================================  =============================================
set          planets fit at multiples of, in turns                       relation of the speeds against the carrier
===========  ==========================================================  =============================================
simple       ``1/(z_s + z_r)``                                           ``z_s w_s + z_r w_r = 0``
stepped      ``gcd(z_a, z_b)/(z_s z_b + z_a z_r)``                       ``z_s z_b w_s + z_a z_r w_r = 0``
double       ``1/(z_r - z_s)``                                           ``z_s w_s - z_r w_r = 0``
Ravigneaux   ``1/gcd(z_r - z_s1, z_r + z_s2)``                           both of a simple and of a double set
===========  ==========================================================  =============================================

a and b are the gears of a stepped planet on sun and ring, all planets alike. Where two gears of one planet are timed
to one another for its place, it fits anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from operator import mul

from femgear.errors import GeometryError
from femgear.gears.exact_linear import whole_echelon
from femgear.gears.gear import is_whole
from femgear.gears.shaft_graph import EXTERNAL, INTERNAL, StageGears, connected_sets


def simple_gears(sun: int, planet: int, ring: int) -> StageGears:
    """List the gears and meshes of a sun, equal planets and a ring by their numbers of teeth."""
    return _chain({"sun": sun, "planet": planet, "ring": ring})


def double_gears(sun: int, inner_planet: int, outer_planet: int, ring: int) -> StageGears:
    """List the gears of a set with pairs of planets, which mesh with each other, by their numbers of teeth."""
    return _chain({"sun": sun, "inner planet": inner_planet, "outer planet": outer_planet, "ring": ring})


def stepped_gears(
    sun: int, first_planet: int, second_planet: int, ring: int, *, first_ring: int | None = None
) -> StageGears:
    """List the gears of a set whose planets have two gears, by their numbers of teeth.

    The sun meshes with the first gear of the planets, the ring with the second one; a ``first_ring`` with the first
    one makes it a set of two rings (3K, Wolfrom).
    """
    teeth = {"sun": sun, "first planet": first_planet, "second planet": second_planet, "ring": ring}
    meshes = [("sun", "first planet", EXTERNAL), ("second planet", "ring", INTERNAL)]
    if first_ring is not None:
        teeth["first ring"] = first_ring
        meshes.append(("first planet", "first ring", INTERNAL))
    return _gears(teeth, meshes, (("first planet", "second planet"),))


def ravigneaux_gears(small_sun: int, large_sun: int, short_planet: int, long_planet: int, ring: int) -> StageGears:
    """List the gears of a Ravigneaux set: short planets on the small sun, long ones on all others but the small sun."""
    teeth = {"small sun": small_sun, "large sun": large_sun}
    teeth |= {"short planet": short_planet, "long planet": long_planet, "ring": ring}
    meshes = [
        ("small sun", "short planet", EXTERNAL),
        ("short planet", "long planet", EXTERNAL),
        ("large sun", "long planet", EXTERNAL),
        ("long planet", "ring", INTERNAL),
    ]
    return _gears(teeth, meshes)


def tooth_relations(gears: StageGears) -> tuple[dict[str, int], ...]:
    """Find whole weights of the central gears in every relation between their turns against the carrier.

    The weighted sum of turns is a whole number where teeth stand in gaps, and zero while the set runs.

    Parameters
    ----------
    gears : StageGears
        With the teeth of all gears; those with a shaft are central.

    Raises
    ------
    GeometryError
        Gears without whole numbers of teeth (E-TEETH).
    """
    meshes, relations = _meshes(gears), []
    for step, factors in zip(meshes.echelon, meshes.factors, strict=True):
        if any(step):
            continue  # a planet is left
        row = [sum(map(mul, factors, column)) for column in zip(*meshes.of_central, strict=True)]
        sense = -1 if next((value for value in row if value), 1) < 0 else 1
        relations.append({gear: sense * value for gear, value in zip(meshes.central, row, strict=True) if value})
    return tuple(relations)


def assembly_step(gears: StageGears) -> Fraction:
    """Find the smallest angle [turns] by which equal planets stand apart where they fit; all others are its multiples.

    GeometryError as of `tooth_relations`, and where nothing but a whole turn is sure to fit (E-TEETH): central gears
    that all turn alike.
    """
    sums = [sum(relation.values()) for relation in tooth_relations(gears)]
    if not any(sums):
        raise GeometryError(
            "the central gears can only turn with the carrier",
            code="E-TEETH",
            limit="a ring with other teeth than its sun",
            remedy="check the numbers of teeth",
        )
    return Fraction(1, math.gcd(*sums))


def nearest_places(step: Fraction, angles: Sequence[float]) -> tuple[int, ...]:
    """Find the multiples (N,) of an assembly step [turns] nearest to planet angles [rad], from the first planet on."""
    return tuple(math.floor((a - angles[0]) / (2.0 * math.pi * step) + 0.5 + 1e-9) for a in angles)


def timing_marks(gears: StageGears, turn: Fraction) -> dict[str, Fraction]:
    """Find how far the bodies of a branch are turned that stands so many turns from the first one.

    Every body has a mark, which points from the centre of the set on the first branch. Here it points so many turns
    further than from the centre; of all turns that fit these are the smallest ones not below zero.

    Parameters
    ----------
    gears : StageGears
        With the teeth of all gears.
    turn : Fraction
        Place of the branch from the first one, a multiple of the `assembly_step`.

    Returns
    -------
    dict
        Turns by the first gear of every body.
    """
    meshes, step = _meshes(gears), assembly_step(gears)
    if (turn / step).denominator != 1:
        message = f"planets do not fit {turn} turns from the first one"
        raise GeometryError(message, code="E-ASSEMBLY", limit=f"multiples of {step} turns")
    # teeth by which the central gears, turned back, are out of place
    passed = [turn * sum(row) for row in meshes.of_central]
    marks: dict[int, Fraction] = {}
    for factors, row in reversed([*zip(meshes.factors, meshes.echelon, strict=True)]):
        if any(row):
            body = next(n for n, value in enumerate(row) if value)
            rest = sum(map(mul, factors, passed), Fraction(0)) - sum(row[n] * marks[n] for n in marks)
            marks[body] = rest / row[body] % Fraction(1, abs(row[body]))
    return {name: marks[n] for n, name in enumerate(meshes.bodies)}


def _gears(teeth: Mapping[str, int], meshes, bodies=()) -> StageGears:
    planets = {gear for gear in teeth if gear.endswith("planet")}
    shafts: dict[str, str | None] = {gear: gear for gear in teeth if gear not in planets}
    return StageGears(teeth, shafts | {"carrier": "carrier"}, tuple(meshes), bodies)


def _chain(teeth: Mapping[str, int]) -> StageGears:
    """Gears in mesh one after the other from sun to ring."""
    pairs = [*pairwise(teeth)]
    return _gears(teeth, [(*pair, INTERNAL if pair == pairs[-1] else EXTERNAL) for pair in pairs])


@dataclass(frozen=True)
class _Meshes:
    """Meshes of one branch as equations of turns.

    Parameters
    ----------
    central, bodies : lists of str
        Central gears, and the first gear of every body of planets.
    weights : list of lists of int
        Teeth that pass in every mesh by a turn of every central gear, then of every body.
    echelon, factors : lists of lists of int
        Of the columns of the bodies, see `whole_echelon`.
    """

    central: list[str]
    bodies: list[str]
    weights: list[list[int]]
    echelon: list[list[int]]
    factors: list[list[int]]

    @property
    def of_central(self) -> list[list[int]]:
        """Weights of the central gears in every mesh."""
        return [row[: len(self.central)] for row in self.weights]


def _meshes(gears: StageGears) -> _Meshes:
    """Write down the meshes of a set; GeometryError as of `tooth_relations`."""
    meshing = list(dict.fromkeys(gear for first, second, _ in gears.meshes for gear in (first, second)))
    for gear in meshing:
        count = gears.teeth.get(gear, 0)
        if not is_whole(count) or count < 1:
            message = f"{gear} with {count!r} teeth"
            raise GeometryError(message, code="E-TEETH", key=gear, value=count, limit="whole numbers from 1 on")
    central = [gear for gear in meshing if gear in gears.shafts]
    planets = connected_sets([*((gear,) for gear in meshing if gear not in gears.shafts), *gears.bodies])
    bodies = [next(gear for gear in meshing if gear in body) for body in planets]
    weights = []
    for first, second, sense in gears.meshes:
        row = [0] * (len(central) + len(bodies))
        for gear, sign in ((first, 1), (second, -sense)):
            body = next((n for n, together in enumerate(planets) if gear in together), None)
            row[central.index(gear) if body is None else len(central) + body] += sign * gears.teeth[gear]
        weights.append(row)
    return _Meshes(central, bodies, weights, *whole_echelon([row[len(central) :] for row in weights]))
