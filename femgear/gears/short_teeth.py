"""Faulty teeth as drawings show them: to which radius missing and broken ones reach, and what is said of all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from femgear.gears.faults import BrokenTip, MissingTooth, ToothFault

if TYPE_CHECKING:
    from femgear.gears.pair import GearSet

ShortTeeth = tuple[tuple[int, float], ...]
"""Numbers of teeth, counter-clockwise from 0, and the radii that they reach [m]."""
MarkedTeeth = tuple[tuple[int, str], ...]
"""Numbers of faulty teeth, counter-clockwise from 0, and what is said of them."""
_Said = TypeVar("_Said", float, str)


def short_teeth(faults: Iterable[ToothFault], gears: GearSet) -> dict[tuple[int, int], ShortTeeth]:
    """Find the teeth that are missing or short, by the number of the gear and which of its copies has them.

    A missing tooth reaches its root, a broken one the radius at which its flank ends.
    """
    reached: dict[tuple[int, int], dict[int, float]] = {}
    for fault in faults:
        if not isinstance(fault, MissingTooth | BrokenTip) or fault.tooth is None:
            continue
        gear = gears.gears[fault.gear]
        missing = isinstance(fault, MissingTooth)
        radius = gear.root_radius if missing else float(np.hypot(gear.base_radius, fault.roll))
        teeth = reached.setdefault((fault.gear, fault.copy), {})
        before = teeth.get(fault.tooth, radius)
        teeth[fault.tooth] = max(before, radius) if gear.internal else min(before, radius)
    return {body: tuple(sorted(teeth.items())) for body, teeth in reached.items()}


def marked_teeth(faults: Iterable[ToothFault], words: Iterable[str]) -> dict[tuple[int, int], MarkedTeeth]:
    """List faulty teeth with the words of their faults, by the number of the gear and which of its copies has them.

    Faults of all teeth of a gear mark none.
    """
    marked: dict[tuple[int, int], dict[int, str]] = {}
    for fault, text in zip(faults, words, strict=True):
        if fault.tooth is not None:
            teeth = marked.setdefault((fault.gear, fault.copy), {})
            teeth[fault.tooth] = f"{teeth[fault.tooth]}; {text}" if fault.tooth in teeth else text
    return {body: tuple(sorted(teeth.items())) for body, teeth in marked.items()}


def renumbered(teeth: Iterable[tuple[int, _Said]], first: int, count: int) -> tuple[tuple[int, _Said], ...]:
    """Count teeth from the one that is number ``first`` of all ``count``."""
    return tuple(sorted(((number - first) % count, what) for number, what in teeth))


def without_tips(points: np.ndarray, short: Sequence[tuple[int, float]], count: int, *, internal: bool) -> np.ndarray:
    """Pull points (n, 2) of a whole gear, tooth 0 on the x axis, to the radii that its short teeth reach [m].

    Returns the points (n, 2). Sectors have the angle of a pitch; ``count`` is the number of teeth.
    """
    moved = np.array(points, float)
    sector = np.rint(np.arctan2(moved[:, 1], moved[:, 0]) * count / (2.0 * np.pi)).astype(int) % count
    radius = np.hypot(*moved.T)
    for number, reach in short:
        beyond = (sector == number) & ((radius < reach) if internal else (radius > reach))
        moved[beyond] *= (reach / radius[beyond])[:, None]
    return moved
