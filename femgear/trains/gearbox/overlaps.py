"""Shafts and gears of a gearbox that take up the same space: real ones of these sizes cannot be put together.

Shafts are bodies of revolution, linear in z between the ends of their parts. Two of one axis overlap where neither
fits into the bore of the other; two of parallel axes where their outer radii reach further than the axes are apart,
unless one lies in the bore of the other. Gears are cylinders of their tip circle over their face width, the planets of
a set the circle around which their tips go. Where teeth are not given the addendum is one module, the dedendum 1.25
of them (ISO 53). Rigid bodies have no sizes and are not judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.quantities import LENGTH
from femgear.findings import DOUBT, Finding
from femgear.trains.gearbox.case_file import (
    CASING,
    BoxPlanetarySection,
    BoxShaftSection,
    GearboxCase,
    PairSection,
    teeth_of,
)
from femgear.trains.gearbox.geometry import (
    DISTANCE_TOLERANCE,
    carriers,
    facing_gears,
    pair_sizes,
    planet_radius,
    set_sizes,
)

_WIDER = 0.05
"""Share by which a shaft may be wider than the bore of the teeth that sit on it."""
_ADDENDUM, _DEDENDUM = 1.0, 1.25
"""Of gears whose teeth are not given, in modules: ISO 53, profile A."""


@dataclass(frozen=True)
class GearOutline:
    """The cylinder that a gear takes up beside shafts.

    Parameters
    ----------
    key : str
        Entry of its place.
    name : str
        In messages.
    shafts : tuple of str
        That it sits on, and that of its mate: they are judged by centre distance and root circle.
    axis : tuple of float
        x and y of its axis [m].
    ends : tuple of float
        z of both ends of its face width [m].
    tip, root, bore : float
        Radii [m]; a root of infinity is that of teeth inside, a bore of zero is not given.
    """

    key: str
    name: str
    shafts: tuple[str, ...]
    axis: tuple[float, ...]
    ends: tuple[float, float]
    tip: float
    root: float = math.inf
    bore: float = 0.0


def overlaps(case: GearboxCase) -> Iterator[Finding]:
    """Tell shafts that penetrate each other or gears, and shafts wider than their gears (W-OVERLAP)."""
    shafts = [shaft for shaft in case.shaft if shaft.part]
    numbers = {shaft.name: number for number, shaft in enumerate(case.shaft)}
    for first, second in combinations(shafts, 2):
        if (depth := _depth(first, second)) > DISTANCE_TOLERANCE:
            text = f"shafts {first.name} and {second.name} penetrate each other by {LENGTH.show(depth)}"
            remedy = "correct axis, start or diameters of one of them"
            yield Finding("W-OVERLAP", f"shaft[{numbers[second.name]}]", text, remedy=remedy)
    yield from _beside_planets(case)
    for gear in gear_outlines(case):
        for shaft in shafts:
            if shaft.name == gear.shafts[0]:
                yield from _on_its_shaft(gear, shaft)
            elif shaft.name not in gear.shafts:
                reach = _radius(shaft, *gear.ends) + gear.tip - math.dist(shaft.axis, gear.axis)
                apart = math.dist(shaft.axis, gear.axis) > DISTANCE_TOLERANCE
                if apart and _radius(shaft, *gear.ends) and reach > DISTANCE_TOLERANCE:
                    text = f"shaft {shaft.name} reaches into {gear.name} by {LENGTH.show(reach)}"
                    remedy = "correct its axis or diameters, or the place of the gear"
                    yield Finding("W-OVERLAP", gear.key, text, remedy=remedy)


def common_faces(case: GearboxCase) -> Iterator[Finding]:
    """Tell gears in mesh that face each other on a part of the narrower one (W-WIDTHS)."""
    for kind in ("pair", "planetary"):
        for number, stage in enumerate(getattr(case, kind)):
            for entry, (first, second), widths in facing_gears(case, stage):
                common = 0.5 * sum(widths) - abs(first - second)
                if all(widths) and common < min(widths) - DISTANCE_TOLERANCE:
                    text = (
                        f"gears of {stage.name} face each other on {LENGTH.show(common)} of {LENGTH.show(min(widths))}:"
                        " stiffness and stresses of their teeth are those of the whole width"
                    )
                    shift = LENGTH.show(round(abs(first - second) - 0.5 * abs(widths[0] - widths[1]), 9))
                    key, remedy = f"{kind}[{number}].{entry}", f"move one of them by {shift} towards the other"
                    yield Finding("W-WIDTHS", key, text, remedy=remedy, severity=DOUBT)


def _beside_planets(case: GearboxCase) -> Iterator[Finding]:
    """Gears of planets that are shafts of their own, and those beside them that are no mates."""
    planets, mates = carriers(case), {frozenset(pair.shafts) for pair in case.pair}
    gears = [gear for number, pair in enumerate(case.pair) for gear in _of_pair(case, pair, f"pair[{number}]")]
    pairs_told = set[frozenset[str]]()
    for first, second in combinations(gears, 2):
        shafts = frozenset((first.shafts[0], second.shafts[0]))
        if len(shafts) < 2 or shafts in pairs_told or shafts in mates or not shafts & planets.keys():
            continue
        beside = min(first.ends[1], second.ends[1]) - max(first.ends[0], second.ends[0])
        reach = first.tip + second.tip - math.dist(first.axis, second.axis)
        if beside > DISTANCE_TOLERANCE and reach > DISTANCE_TOLERANCE:
            pairs_told.add(shafts)
            text = f"{first.name} reaches into {second.name}, which is no mate of it, by {LENGTH.show(reach)}"
            yield Finding("W-OVERLAP", second.key, text, remedy="fewer planets, or other teeth")


def _on_its_shaft(gear: GearOutline, shaft: BoxShaftSection) -> Iterator[Finding]:
    """A shaft wider than the root circle of its gear, or than the bore that the teeth have."""
    radius, limit = _radius(shaft, *gear.ends), ""
    if radius > gear.root + DISTANCE_TOLERANCE:
        limit = f"a root circle of {LENGTH.show(2.0 * gear.root)}"
    elif gear.bore and radius > (1.0 + _WIDER) * gear.bore:
        limit = f"a bore of {LENGTH.show(2.0 * gear.bore)}"
    if limit:
        text = (
            f"shaft {shaft.name} has an outer diameter of {LENGTH.show(2.0 * radius)} in {gear.name}, which has {limit}"
        )
        yield Finding("W-OVERLAP", gear.key, text, remedy="correct the diameter of the shaft, or the gear")


def _bounds(shaft: BoxShaftSection, where: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bore and outer radii (n, 2) of a shaft at the left and right ends of n intervals within its parts [m]."""
    places = shaft.start + np.asarray(shaft.places)
    part = np.clip(np.searchsorted(places, 0.5 * (where[:-1] + where[1:])) - 1, 0, len(shaft.part) - 1)
    share = (np.stack([where[:-1], where[1:]], axis=1) - places[part, None]) / np.diff(places)[part, None]
    bores = np.array([(part.inner_diameter, part.bore_at_end) for part in shaft.part])[part]
    outer = np.array([(part.outer_diameter, part.end_outer_diameter or part.outer_diameter) for part in shaft.part])[
        part
    ]
    return tuple(0.5 * (ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])) for ends in (bores, outer))  # type: ignore


def _common_intervals(low: float, high: float, *shafts: BoxShaftSection) -> np.ndarray:
    """Ends of the parts of shafts from one z to another [m], these two among them; none where they do not meet."""
    low = max([low, *(shaft.start for shaft in shafts)])
    high = min([high, *(shaft.start + shaft.length for shaft in shafts)])
    if high - low <= DISTANCE_TOLERANCE:
        return np.zeros(0)
    inside = np.concatenate([shaft.start + np.asarray(shaft.places) for shaft in shafts])
    ends = np.concatenate([[low], np.unique(inside[(inside > low) & (inside < high)]), [high]])
    return ends[np.append(True, np.diff(ends) > DISTANCE_TOLERANCE)]


def _depth(first: BoxShaftSection, second: BoxShaftSection) -> float:
    """Largest length by which two shafts would have to move apart [m]; zero or less where they do not meet."""
    where = _common_intervals(-math.inf, math.inf, first, second)
    if len(where) < 2:
        return 0.0
    apart = math.dist(first.axis, second.axis)
    (bore, outer), (other_bore, other) = (_bounds(shaft, where) for shaft in (first, second))
    beside, within, around = outer + other - apart, apart + outer - other_bore, apart + other - bore
    # of every interval the way of lying free that comes the nearest to it
    return float(_free_depths(beside, within, around).max())


def _free_depths(*depths: np.ndarray) -> np.ndarray:
    """Depths (n,) of n intervals, each in the one way of lying that is free over the whole of it, or nearly."""
    return np.min([depth.max(axis=1) for depth in depths], axis=0)


def _radius(shaft: BoxShaftSection, low: float, high: float) -> float:
    """Largest outer radius of a shaft from one z to another [m]; zero where it has none there."""
    where = _common_intervals(low, high, shaft)
    return float(_bounds(shaft, where)[1].max()) if len(where) > 1 else 0.0


def gear_outlines(case: GearboxCase) -> Iterator[GearOutline]:
    """List the gears of pairs and of sets whose place and size are known, and the ways of planets."""
    for number, pair in enumerate(case.pair):
        yield from _of_pair(case, pair, f"pair[{number}]")
    for number, stage in enumerate(case.planetary):
        yield from _of_set(case, stage, f"planetary[{number}]")


def _of_pair(case: GearboxCase, pair: PairSection, key: str) -> Iterator[GearOutline]:
    sizes = pair_sizes(pair)
    heights = [_circles(pair, i, sizes.base_radii[i] / math.cos(sizes.pressure_angles[0])) for i in (0, 1)]
    for i, (tip, root, bore) in enumerate(heights):
        shaft = case.shaft_named(pair.shafts[i])
        middle = shaft.start + (pair.positions[i] if pair.positions else 0.0)
        ends = middle - 0.5 * sizes.face_widths[i], middle + 0.5 * sizes.face_widths[i]
        if not (i and sizes.internal):
            names = pair.shafts[i], pair.shafts[1 - i]
            yield GearOutline(f"{key}.shafts", f"gear {i + 1} of {pair.name}", names, shaft.axis, ends, tip, root, bore)


def _of_set(case: GearboxCase, stage: BoxPlanetarySection, key: str) -> Iterator[GearOutline]:
    sizes = set_sizes(stage)
    holder = next(name for name in ("sun", "carrier", "ring") if getattr(stage, name) != CASING)
    shaft = case.shaft_named(getattr(stage, holder))
    middle = shaft.start + (getattr(stage, f"{holder}_position") or 0.0)
    ends = middle - 0.5 * sizes.face_widths[0], middle + 0.5 * sizes.face_widths[0]
    others = tuple(name for name in (stage.carrier, stage.ring) if name != CASING)
    sun_radius = sizes.centre_distance - planet_radius(sizes)
    (tip, root, bore), (planet_tip, *_) = _circles(stage, 0, sun_radius), _circles(stage, 1, planet_radius(sizes))
    if stage.sun != CASING:
        yield GearOutline(
            f"{key}.sun", f"the sun of {stage.name}", (stage.sun, *others), shaft.axis, ends, tip, root, bore
        )
    way = sizes.centre_distance + planet_tip
    members = ("", stage.sun, *others)
    yield GearOutline(f"{key}.carrier", f"the way of the planets of {stage.name}", members, shaft.axis, ends, way)


def _circles(stage: PairSection | BoxPlanetarySection, number: int, pitch: float) -> tuple[float, float, float]:
    """Radii of tips, roots and bore of an external gear [m]: of its teeth, or around its pitch radius."""
    if (teeth := teeth_of(stage)) is not None:
        gears: Any = planetary_set(teeth).gears
        section = getattr(teeth, teeth.gear_names[number])
        return gears[number].tip_radius, gears[number].root_radius, getattr(section, "bore_radius", None) or 0.0
    assert stage.gears is not None
    module = 2.0 * pitch / stage.gears.teeth[number] * math.cos(stage.gears.helix_angle)
    return pitch + _ADDENDUM * module, pitch - _DEDENDUM * module, 0.0
