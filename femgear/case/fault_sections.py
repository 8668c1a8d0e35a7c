"""Sections of faults of teeth: missing, broken off at the tip, pitted, worn or cracked.

Every entry has its type and its plausible window, as in `femgear.case.sections`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import model_validator

from femgear.case.flank_sections import MOST_POINTS, Diameter
from femgear.case.quantities import ANGLE, LENGTH, Count, Quantity, Section, Values
from femgear.errors import CaseError, GeometryError, several
from femgear.gears.cracked_tooth import check_crack
from femgear.gears.faults import (
    LEFT,
    RIGHT,
    BrokenTip,
    Crack,
    MissingTooth,
    Spall,
    ToothFault,
    Wear,
    flank_beside,
    removed,
)
from femgear.gears.gear import Gear, tooth_thickness
from femgear.gears.modifications import roll_at

if TYPE_CHECKING:
    from femgear.gears.pair import GearSet

MOST_DEPTH = 0.05
"""Largest depth of a fault [m]."""
_Depth = Annotated[float, Quantity(LENGTH, 0.0, MOST_DEPTH)]
_Length = Annotated[float, Quantity(LENGTH, 1e-6, 0.5)]
_Points = Values(max_length=MOST_POINTS)
_ENTRIES = {
    "missing": (),
    "broken corner": ("length",),
    "spall": ("flank", "diameter", "length", "depth", "width", "offset"),
    "wear": ("flank", "depth", "depths", "diameters"),
    "crack": ("flank", "angle", "depth", "diameter"),
}
"""Entries of every kind beside the tooth."""
_OPTIONAL = {"wear": ("depth", "depths", "diameters"), "crack": ("diameter", "angle"), "spall": ("width", "offset")}
"""Those that may be left out; wear needs some of them."""
CRACK_ANGLE = math.radians(70.0)
"""Between a crack and the centre line of its tooth, where none is given."""
_ON_END, _PLACES = 1e-6, 129
"""By how much a pit may pass the end of its flank [modules]; places at which material that is left is looked at."""
_SIDES = {"left": LEFT, "right": RIGHT, "sun side": LEFT, "ring side": RIGHT}


class FaultSection(Section):
    """A fault of one tooth; ``tooth`` counts counter-clockwise from 0 as pitch errors do.

    A spall is ``length`` long along the flank about its ``diameter`` and ``depth`` deep; it goes across the whole face
    width, or over a ``width`` whose middle is off that of the face by ``offset``. Of a broken corner ``length`` is what
    is broken off the tip, radially. A crack is straight, from a ``diameter`` in the root of its flank, at an ``angle``
    to the centre line of the tooth; ``depth`` is its length. All others go across the whole width. Wear has one
    ``depth``, or ``depths`` over ``diameters``, and without ``tooth`` it is that of all teeth.
    """

    kind: Literal["missing", "broken corner", "spall", "wear", "crack"]
    tooth: Annotated[int, Count(0, 5000)] | None = None
    flank: Literal["left", "right"] | None = None
    diameter: Diameter | None = None
    length: _Length | None = None
    depth: _Depth | None = None
    width: _Length | None = None
    offset: Annotated[float, Quantity(LENGTH, -0.5, 0.5)] | None = None
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
        if self.offset is not None and self.width is None:
            message, remedy = "an offset needs the width of the spall", 'give width, as in width = "5 mm"'
            raise CaseError(message, code="E-KEY-MISSING", remedy=remedy)
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


def keyed_faults(case: Any, gears: GearSet) -> list[tuple[str, ToothFault]]:
    """Make the faults of the teeth of all gears of a case, with their entries; without depth there is none.

    GeometryError, with the entry and its place in the file, all of them in its ``problems``: a tooth or a planet that
    there is not (E-RANGE), a place that is not on the flank, a crack that the tooth cannot have, pits and wear deeper
    than the tooth is thick, and faults of a tooth that contradict one another (E-FAULT).
    """
    keyed, problems = list[tuple[str, ToothFault]](), list[GeometryError]()
    for number, gear in enumerate(gears.gears):
        of_gear, refused = list[tuple[str, ToothFault]](), list[tuple[str, ToothFault]]()
        for i, section in enumerate(getattr(case, gear.name).fault):
            key = f"{gear.name}.fault[{i}]"
            try:
                fault = _fault(section, gears, number)
            except GeometryError as error:
                if error.key not in ("tooth", "planet"):
                    copy = getattr(section, "planet", 1) - 1
                    refused.append((key, ToothFault(number, copy, section.tooth, None)))
                error.key = f"{key}.{error.key}"
                problems.append(error)
                continue
            if section.depth != 0.0 and any(section.depths or (1.0,)):
                of_gear.append((key, fault))
        # one that is refused still needs its tooth
        problems += contradicting_faults([*of_gear, *refused], gear)
        keyed += of_gear
    for problem in problems:
        problem.file = case.location(problem.key or "")
    if problems:
        raise several(problems)
    return keyed


def _fault(section: FaultSection, gears: GearSet, number: int) -> ToothFault:
    gear, copy = gears.gears[number], getattr(section, "planet", 1) - 1
    if copy >= gears.n_planets:
        message, limit, remedy = f"there is no planet {copy + 1}", f"1 to {gears.n_planets}", "count planets from 1"
        raise GeometryError(message, code="E-RANGE", key="planet", value=copy + 1, limit=limit, remedy=remedy)
    if section.tooth is not None and section.tooth >= gear.teeth:
        message, limit = f"{gear.name} has no tooth {section.tooth}", f"0 to {gear.teeth - 1}"
        remedy = "count teeth from 0"
        raise GeometryError(message, code="E-RANGE", key="tooth", value=section.tooth, limit=limit, remedy=remedy)
    flank = None if section.flank is None else _SIDES[section.flank]
    place = {"gear": number, "copy": copy, "tooth": section.tooth, "flank": flank}
    match section.kind:
        case "missing":
            return MissingTooth(**place)
        case "broken corner":
            return _broken_tip(section, gear, place)
        case "spall":
            return _spall(section, gear, place, _across(section, gear, min(gears.mesh_widths)))
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
            limit=f"less than {_mm_down(most)}",
            remedy='reduce it, or write kind = "missing"',
        )
    return BrokenTip(**place, roll=_roll(gear, radius), internal=gear.internal)


def _across(section: FaultSection, gear: Gear, face_width: float) -> tuple[float, float] | None:
    """Find where a spall begins and ends over the face width that meshes [m], as shares of it; None: all of it."""
    if section.width is None:
        return None
    offset, half = section.offset or 0.0, 0.5 * section.width
    if abs(offset) + half > 0.5 * face_width + _ON_END * gear.module:
        most = 2.0 * max(0.5 * face_width - abs(offset), 0.0)
        raise GeometryError(
            f"{gear.name}: the spall reaches beyond the face width that meshes",
            code="E-FAULT",
            key="width",
            value=_mm(section.width),
            limit=f"up to {_mm_down(most)} at this offset; teeth mesh over {_mm(face_width)}",
            remedy="reduce width or offset, or leave both out for a spall across all",
        )
    if 2.0 * half > face_width - _ON_END * gear.module:
        return None
    return (offset - half) / face_width, (offset + half) / face_width


def _spall(
    section: FaultSection, gear: Gear, place: dict[str, Any], across: tuple[float, float] | None = None
) -> Spall:
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
            remedy="give a diameter of the flank",
        )
    middle = _roll(gear, 0.5 * section.diameter)
    _check_on_flank(gear, middle, section.length)
    half = section.length * gear.base_radius
    low, high = np.sqrt(np.maximum(middle**2 + np.array([-half, half]), 0.0))
    # of a tooth that is thinnest at its tip
    thinnest = math.hypot(gear.base_radius, min(high, gear.tip_roll) if not gear.internal else max(low, gear.tip_roll))
    _check_thickness(gear, thinnest, section.depth, "depth", "the spall")
    return Spall(**place, low=float(low), high=float(high), depth=section.depth, across=across)


def _check_on_flank(gear: Gear, middle: float, length: float) -> None:
    """Refuse a spall (GeometryError, E-FAULT) about a roll length [m] that is longer than the flank is there [m]."""
    below, above = flank_beside(gear, middle)
    if 0.5 * length <= min(below, above) + _ON_END * gear.module:
        return
    over_tip = (above < below) != gear.internal
    amid = 2.0 * math.hypot(gear.base_radius, math.sqrt(0.5 * (gear.form_roll**2 + gear.tip_roll**2)))
    remedies = [f"shorten it, or move it towards the middle of the flank at {_mm(amid)}"]
    raise GeometryError(
        f"{gear.name}: the spall reaches {'over the tip' if over_tip else 'below the flank into the root'}",
        code="E-FAULT",
        key="length",
        value=_mm(length),
        limit=f"up to {_mm_down(2.0 * min(below, above))} about this diameter; the flank is {_mm(below + above)} long",
        remedy=[*remedies, 'write kind = "broken corner"'] if over_tip else remedies,
    )


def _wear(section: FaultSection, gear: Gear, place: dict[str, Any]) -> Wear:
    """Wear by its depth, or depths over diameters; deeper than the tooth is thick there it leaves no tooth."""
    if section.depth is not None:
        ends = sorted((gear.form_roll, gear.tip_roll))
        _check_thickness(gear, gear.tip_radius, section.depth, "depth", "the wear")  # a tooth is thinnest at its tip
        return Wear(**place, roll=tuple(ends), depth=(section.depth,) * 2)
    low, high = sorted((gear.form_radius, gear.tip_radius))
    for diameter, depth in zip(section.diameters or (), section.depths or ()):
        _check_thickness(gear, min(max(0.5 * diameter, low), high), depth, "depths", "the wear")
    rolls = [roll_at(gear, diameter=diameter) for diameter in section.diameters or ()]
    return Wear(**place, roll=tuple(roll or 0.0 for roll in rolls), depth=section.depths or ())


def _check_thickness(gear: Gear, radius: float, depth: float, key: str, words: str) -> None:
    """Refuse what takes off (GeometryError, E-FAULT) as much as the tooth is thick at a radius [m]."""
    thickness = float(tooth_thickness(gear, radius))
    if not depth < thickness:
        raise GeometryError(
            f"{gear.name}: at a diameter of {_mm(2 * radius)} {words} leaves no tooth",
            code="E-FAULT",
            key=key,
            value=_mm(depth),
            limit=f"less than {_mm_down(thickness)}, as thick as the tooth is there",
            remedy='reduce it, or write kind = "broken corner" or "missing"',
        )


def contradicting_faults(keyed: Sequence[tuple[str, ToothFault]], gear: Gear) -> Iterator[GeometryError]:
    """List the refusals (E-FAULT) of faults of a gear, with their entries, that cannot be at once.

    A tooth that is missing has no other fault, a corner is broken off once, a spall lies on the flank that is left, a
    body has one crack, and all pits and wear of a tooth together leave a part of it. Pits and wear may lie over one
    another, see `femgear.gears.faults.fault_form`.
    """
    teeth = dict[tuple[int, int | None], list[tuple[str, ToothFault]]]()
    for key, fault in keyed:
        teeth.setdefault((fault.copy, fault.tooth), []).append((key, fault))
    for of_tooth in teeth.values():
        for (earlier, first), (later, second) in combinations(of_tooth, 2):
            yield from _contradiction(gear, earlier, first, later, second)
    for copy in {fault.copy for _, fault in keyed}:
        of_body = [(key, fault) for key, fault in keyed if fault.copy == copy]
        cracks = [key for key, fault in of_body if isinstance(fault, Crack)]
        for later in cracks[1:]:
            yield _against(gear, "a body has one crack", cracks[0], later)
        if len({fault.tooth for _, fault in of_body if isinstance(fault, MissingTooth)}) == gear.teeth:
            message, last = f"{gear.name} misses all its teeth", of_body[-1][0]
            yield GeometryError(message, code="E-FAULT", key=f"{last}.kind", remedy="leave some")
        yield from _worn_through(gear, of_body)


def _contradiction(
    gear: Gear, earlier: str, first: ToothFault, later: str, second: ToothFault
) -> Iterator[GeometryError]:
    """Refuse the second of two faults of one tooth where it cannot be beside the first."""
    kinds = {type(first), type(second)}
    if MissingTooth in kinds:
        both = "is missing twice" if kinds == {MissingTooth} else "is missing, and has no other fault"
        yield _against(gear, f"tooth {first.tooth} {both}", earlier, later)
    elif kinds == {BrokenTip}:
        yield _against(gear, f"the corner of tooth {first.tooth} is broken off twice", earlier, later)
    elif kinds == {BrokenTip, Spall}:
        tip, spall = (first, second) if isinstance(first, BrokenTip) else (second, first)
        assert isinstance(tip, BrokenTip) and isinstance(spall, Spall)
        outermost = spall.low if tip.internal else spall.high
        beyond = tip.roll - outermost if tip.internal else outermost - tip.roll
        if beyond > _ON_END * gear.module:
            end, least = (_mm(2.0 * math.hypot(gear.base_radius, roll)) for roll in (tip.roll, outermost))
            place = later if spall is second else earlier
            yield GeometryError(
                f"{gear.name}: the spall reaches where the corner of tooth {tip.tooth} is broken off "
                f"({earlier if spall is second else later})",
                code="E-FAULT",
                key=f"{place}.diameter",
                value=f"up to {least}",
                limit=f"{'down' if tip.internal else 'up'} to {end}, where the flank ends",
                remedy="move or shorten the spall, or break off less",
            )


def _worn_through(gear: Gear, of_body: Sequence[tuple[str, ToothFault]]) -> Iterator[GeometryError]:
    """Refuse pits and wear of a body that take off all of a tooth together, of which each alone would not."""
    material = [(key, fault) for key, fault in of_body if isinstance(fault, Spall | Wear)]
    first, last = sorted((gear.form_roll, gear.tip_roll))
    rolls = np.linspace(first, last, _PLACES)
    for tooth in {fault.tooth for _, fault in material}:
        of_tooth = [(key, fault) for key, fault in material if fault.tooth in (None, tooth)]
        left, right = ([fault for _, fault in of_tooth if fault.flank == side] for side in (LEFT, RIGHT))
        taken = removed(left, rolls) + removed(right, rolls)
        thickness = tooth_thickness(gear, np.hypot(gear.base_radius, rolls))
        if len(of_tooth) > 1 and (taken >= thickness).any():
            worst = int(np.argmax(taken - thickness))
            radius = math.hypot(gear.base_radius, float(rolls[worst]))
            words = "all its teeth" if tooth is None else f"tooth {tooth}"
            yield GeometryError(
                f"{gear.name}: at a diameter of {_mm(2 * radius)} pits and wear leave nothing of {words}",
                code="E-FAULT",
                key=f"{of_tooth[-1][0]}.kind",
                value=f"{_mm(float(taken[worst]))} together",
                limit=f"less than {_mm(float(thickness[worst]))}, as thick as the tooth is there",
                remedy='reduce them, or write kind = "broken corner" or "missing"',
            )


def _against(gear: Gear, words: str, earlier: str, later: str) -> GeometryError:
    """Refusal of an entry beside an earlier one."""
    remedy = f"keep one of {earlier} and {later}"
    return GeometryError(
        f"{gear.name}: {words}", code="E-FAULT", key=f"{later}.kind", limit="one of both", remedy=remedy
    )


def _roll(gear: Gear, radius: float) -> float:
    """Roll length [m] of a radius [m]."""
    return float(np.sqrt(max(radius**2 - gear.base_radius**2, 0.0)))


def _mm_down(length: float) -> str:
    """Write a largest length [m] so that what is printed is allowed: the hundredth of a micrometre below it."""
    return f"{math.floor(1e8 * length * (1.0 + 1e-12)) / 1e5:.9g} mm"


def _mm(length: float) -> str:
    return f"{1e3 * length:.5g} mm"
