"""Sections of faults of teeth: missing, broken off at the tip, pitted, worn or cracked.

Every entry has its type and its plausible window, as in `femgear.case.sections`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import model_validator

from femgear.case.flank_sections import MOST_POINTS, Diameter
from femgear.case.quantities import ANGLE, LENGTH, Count, Quantity, Section, Values
from femgear.errors import CaseError, GeometryError
from femgear.gears.cracked_tooth import check_crack
from femgear.gears.faults import LEFT, RIGHT, BrokenTip, Crack, MissingTooth, Spall, ToothFault, Wear
from femgear.gears.gear import Gear, tooth_thickness
from femgear.gears.modifications import roll_at

if TYPE_CHECKING:
    from femgear.gears.pair import GearSet

_Depth = Annotated[float, Quantity(LENGTH, 0.0, 0.05)]
_Length = Annotated[float, Quantity(LENGTH, 1e-6, 0.5)]
_Points = Values(max_length=MOST_POINTS)
_ENTRIES = {
    "missing": (),
    "broken corner": ("length",),
    "spall": ("flank", "diameter", "length", "depth"),
    "wear": ("flank", "depth", "depths", "diameters"),
    "crack": ("flank", "angle", "depth", "diameter"),
}
"""Entries of every kind beside the tooth."""
_OPTIONAL = {"wear": ("depth", "depths", "diameters"), "crack": ("diameter", "angle")}
"""Those that may be left out; wear needs some of them."""
CRACK_ANGLE = math.radians(70.0)
"""Between a crack and the centre line of its tooth, where none is given."""
_SIDES = {"left": LEFT, "right": RIGHT, "sun side": LEFT, "ring side": RIGHT}


class FaultSection(Section):
    """A fault of one tooth; ``tooth`` counts counter-clockwise from 0 as pitch errors do.

    A spall is ``length`` long along the flank about its ``diameter`` and ``depth`` deep; of a broken corner ``length``
    is what is broken off the tip, radially. A crack is straight, from a ``diameter`` in the root of its flank, at an
    ``angle`` to the centre line of the tooth; ``depth`` is its length. All go across the whole width. Wear has one
    ``depth``, or ``depths`` over ``diameters``, and without ``tooth`` it is that of all teeth.
    """

    kind: Literal["missing", "broken corner", "spall", "wear", "crack"]
    tooth: Annotated[int, Count(0, 5000)] | None = None
    flank: Literal["left", "right"] | None = None
    diameter: Diameter | None = None
    length: _Length | None = None
    depth: _Depth | None = None
    angle: Annotated[float, Quantity(ANGLE, 0.0, math.radians(120))] | None = None
    depths: Annotated[tuple[_Depth, ...], _Points] | None = None
    diameters: Annotated[tuple[Diameter, ...], _Points] | None = None

    @model_validator(mode="after")
    def _belongs_together(self):
        entries, every = _ENTRIES[self.kind], {name for names in _ENTRIES.values() for name in names}
        if unused := self.given(*sorted(every - set(entries))):
            message = f"a fault of kind {self.kind!r} has no {' and no '.join(unused)}"
            raise CaseError(message, code="E-FAULT", remedy=f"leave out {', '.join(unused)}")
        needed = [name for name in entries if name not in _OPTIONAL.get(self.kind, ())]
        needed += [] if self.kind == "wear" else ["tooth"]
        if missing := [name for name in needed if getattr(self, name) is None]:
            message = f"a fault of kind {self.kind!r} needs {' and '.join(missing)}"
            raise CaseError(message, code="E-KEY-MISSING", remedy=f"give {', '.join(missing)}")
        if self.kind == "wear":
            _check_depths(self)
        return self


class PlanetFaultSection(FaultSection):
    """A fault of a tooth of one planet, on the flank that touches the sun or on the one that touches the ring."""

    planet: Annotated[int, Count(1, 1000)] = 1
    flank: Literal["sun side", "ring side"] | None = None  # pyright: ignore[reportIncompatibleVariableOverride]


def _check_depths(section: FaultSection) -> None:
    """Refuse wear without depth, or whose points are no curve."""
    depths, diameters = section.depths or (), section.diameters or ()
    if (section.depth is None) == (section.depths is None) or len(depths) != len(diameters):
        raise CaseError(
            "wear has one depth, or as many depths as diameters",
            code="E-FAULT",
            remedy='depth = "20 um", or diameters = ["40 mm", "42 mm"] with depths = ["5 um", "20 um"]',
        )
    if section.depths is not None and (len(depths) < 2 or any(b <= a for a, b in pairwise(diameters))):
        message = "diameters of wear are two or more, ascending"
        raise CaseError(message, code="E-RANGE", remedy="sort the points, and keep one of every place")


def no_faults(case: Any, words: str, remedy: str = "leave the faults out") -> None:
    """Refuse faults of teeth (CaseError, E-FAULT) where ``words`` say what does not know them."""
    for name in case.gear_names:
        if getattr(case, name).fault:
            key = f"{name}.fault[0]"
            raise CaseError(words, code="E-FAULT", key=key, remedy=remedy, file=case.location(key))


def keyed_faults(case: Any, gears: GearSet) -> Iterator[tuple[str, ToothFault]]:
    """Make the faults of the teeth of all gears of a case, with their entries; without depth there is none.

    GeometryError, with the entry and its place in the file: a tooth or a planet that there is not (E-RANGE), a place
    that is not on the flank, a crack that the tooth cannot have or that is not the only one of its body, wear deeper
    than the tooth is thick, a gear that misses all teeth (E-FAULT).
    """
    cracked, missing = set(), set()
    for number, gear in enumerate(gears.gears):
        for i, section in enumerate(getattr(case, gear.name).fault):
            key = f"{gear.name}.fault[{i}]"
            try:
                fault = _fault(section, gears, number)
                if isinstance(fault, Crack):
                    if (number, fault.copy) in cracked:
                        raise GeometryError(
                            "a body has one crack", code="E-FAULT", key="kind", remedy="keep one of them"
                        )
                    cracked.add((number, fault.copy))
                if isinstance(fault, MissingTooth):
                    missing.add((fault.tooth, (number, fault.copy)))
                    if sum(body == (number, fault.copy) for *_, body in missing) == gear.teeth:
                        message, remedy = f"{gear.name} misses all its teeth", "leave some"
                        raise GeometryError(message, code="E-FAULT", key="kind", remedy=remedy)
            except GeometryError as error:
                error.key = f"{key}.{error.key}"
                error.file = case.location(error.key)
                raise
            if section.depth != 0.0:
                yield key, fault


def _fault(section: FaultSection, gears: GearSet, number: int) -> ToothFault:
    gear, copy = gears.gears[number], getattr(section, "planet", 1) - 1
    if copy >= gears.n_planets:
        message = f"there is no planet {copy + 1}"
        raise GeometryError(message, code="E-RANGE", key="planet", value=copy + 1, limit=f"1 to {gears.n_planets}")
    if section.tooth is not None and section.tooth >= gear.teeth:
        message = f"{gear.name} has no tooth {section.tooth}"
        raise GeometryError(message, code="E-RANGE", key="tooth", value=section.tooth, limit=f"0 to {gear.teeth - 1}")
    flank = None if section.flank is None else _SIDES[section.flank]
    place = {"gear": number, "copy": copy, "tooth": section.tooth, "flank": flank}
    match section.kind:
        case "missing":
            return MissingTooth(**place)
        case "broken corner":
            return _broken_tip(section, gear, place)
        case "spall":
            return _spall(section, gear, place)
        case "crack":
            assert section.depth is not None
            start = None if section.diameter is None else 0.5 * section.diameter
            angle = CRACK_ANGLE if section.angle is None else section.angle
            crack = Crack(**place, start=start, angle=angle, depth=section.depth)
            if section.depth:
                check_crack(gear, crack)
            return crack
        case _:
            return _wear(section, gear, place)


def _broken_tip(section: FaultSection, gear: Gear, place: dict[str, Any]) -> BrokenTip:
    """Tip broken off by a length; the flank that is left must be more than its form radius."""
    assert section.length is not None
    radius = gear.tip_radius + (section.length if gear.internal else -section.length)
    most = abs(gear.tip_radius - gear.form_radius)
    if section.length >= most:
        raise GeometryError(
            f"{gear.name}: no flank is left of a tooth that is {_mm(section.length)} shorter",
            code="E-FAULT",
            key="length",
            value=_mm(section.length),
            limit=f"less than {_mm(most)}",
            remedy='reduce it, or write kind = "missing"',
        )
    return BrokenTip(**place, roll=_roll(gear, radius), internal=gear.internal)


def _spall(section: FaultSection, gear: Gear, place: dict[str, Any]) -> Spall:
    """Pit about a diameter: of its ends half of its length along the involute lies to each side."""
    assert section.diameter is not None and section.length is not None and section.depth is not None
    radii = sorted((gear.form_radius, gear.tip_radius))
    if not radii[0] < 0.5 * section.diameter < radii[1]:
        raise GeometryError(
            f"{gear.name}: the middle of the spall is not on the flank",
            code="E-FAULT",
            key="diameter",
            value=_mm(section.diameter),
            limit=f"{_mm(2 * radii[0])} to {_mm(2 * radii[1])}",
        )
    middle = _roll(gear, 0.5 * section.diameter)
    half = section.length * gear.base_radius
    low, high = np.sqrt(np.maximum(middle**2 + np.array([-half, half]), 0.0))
    return Spall(**place, low=float(low), high=float(high), depth=section.depth)


def _wear(section: FaultSection, gear: Gear, place: dict[str, Any]) -> Wear:
    """Wear by its depth, or depths over diameters; deeper than the tooth is thick there it leaves no tooth."""
    if section.depth is not None:
        ends = sorted((gear.form_roll, gear.tip_roll))
        _check_thickness(gear, gear.tip_radius, section.depth, "depth")  # a tooth is thinnest at its tip
        return Wear(**place, roll=tuple(ends), depth=(section.depth,) * 2)
    low, high = sorted((gear.form_radius, gear.tip_radius))
    for diameter, depth in zip(section.diameters or (), section.depths or ()):
        _check_thickness(gear, min(max(0.5 * diameter, low), high), depth, "depths")
    rolls = [roll_at(gear, diameter=diameter) for diameter in section.diameters or ()]
    return Wear(**place, roll=tuple(roll or 0.0 for roll in rolls), depth=section.depths or ())


def _check_thickness(gear: Gear, radius: float, depth: float, key: str) -> None:
    """Refuse wear (GeometryError, E-FAULT) as deep as the tooth is thick at a radius [m]."""
    thickness = float(tooth_thickness(gear, radius))
    if not depth < thickness:
        raise GeometryError(
            f"{gear.name}: at a diameter of {_mm(2 * radius)} the wear leaves no tooth",
            code="E-FAULT",
            key=key,
            value=_mm(depth),
            limit=f"less than {_mm(thickness)}, as thick as the tooth is there",
            remedy='reduce it, or write kind = "broken corner" or "missing"',
        )


def _roll(gear: Gear, radius: float) -> float:
    """Roll length [m] of a radius [m]."""
    return float(np.sqrt(max(radius**2 - gear.base_radius**2, 0.0)))


def _mm(length: float) -> str:
    return f"{1e3 * length:.5g} mm"
