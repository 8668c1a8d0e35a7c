"""A gearbox in space for the page: its bodies from the case, its motions from the files of the run.

Gears without teeth of their own are discs of their pitch circle. Teeth of mates are turned into one another's gaps.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.errors import FemgearError
from femgear.gears.gear import Gear
from femgear.gears.short_teeth import marked_teeth, renumbered, short_teeth
from femgear.report.space import SPACE, Motion, SpaceBody, space, tooth_section
from femgear.stages.gears_in_space import MODES_SHOWN, teeth_zero, tooth_angles
from femgear.stages.protocol import Drawn
from femgear.stages.tooth_faults import fault_words
from femgear.storage.files import write_text
from femgear.trains.gearbox.case_file import (
    CASING,
    BoxPlanetarySection,
    BoxShaftSection,
    GearboxCase,
    PairSection,
    teeth_of,
)
from femgear.trains.gearbox.casing import bearing_name, called
from femgear.trains.gearbox.geometry import StageSizes, carriers, pair_sizes, planet_radius, set_sizes
from femgear.trains.gearbox.power import gearbox_flow

_DISC, _RIM, _BORE = 0.3, 1.15, 0.45
"""Width of a disc, radius of a rim and of a bore that are not given, over the pitch radius."""
_MARK = 0.04
"""Size of sensors and feet over that of the gearbox."""


def write_space(drawn: Drawn, folder: Path) -> list[str]:
    """Write the bodies of a gearbox and their motions for the page; returns the names of the files."""
    if "deflection" not in drawn.data:
        return []
    deflection = drawn.data["deflection"]
    members = [str(member) for member in deflection["member"].values]
    stations = [str(name) for name in deflection["station"].values]
    place = deflection["place"].values
    # planets and seats move by themselves, shafts with all of their stations
    shafts = {shaft.name for shaft in drawn.case.shaft}
    carriers = [member if member in shafts else name for member, name in zip(members, stations, strict=True)]
    motions = [
        Motion(f"deflection, {name}" if deflection.sizes["load_case"] > 1 else "deflection", moved, swings=False)
        for name, moved in zip(deflection["load_case"].values, deflection["displacement"].values, strict=True)
    ]
    motions += _modes(drawn, stations)
    bodies = [*gearbox_bodies(drawn.case, dict(zip(stations, place, strict=True))), *_marks(deflection)]
    if not bodies:
        return []
    on_casing = [carrier for carrier, member in zip(carriers, members, strict=True) if member == CASING]
    box = None if drawn.case.casing is None else _casing_box(bodies)
    model = space(bodies, carriers, place, motions, box, on_casing)
    write_text(json.dumps(model, allow_nan=False, separators=(",", ":")), folder / SPACE)
    return [SPACE]


def _modes(drawn: Drawn, stations: list[str]) -> Iterator[Motion]:
    """Yield the elastic modes of the stations, of modes.nc."""
    modes = drawn.data.get("modes")
    if modes is None or [str(name) for name in modes["station"].values] != stations:
        return
    hertz = modes["frequency"].values
    for number in np.flatnonzero(hertz > 0.0)[:MODES_SHOWN]:
        title = f"mode {number + 1}: {hertz[number]:.5g} Hz, {modes['kind'].values[number]}"
        yield Motion(title, modes["motion"].values[:, :, number])


def gearbox_bodies(case: GearboxCase, places: dict[str, np.ndarray]) -> Iterator[SpaceBody]:
    """List the bodies of a gearbox: gears, parts of shafts, and bearings.

    Parameters
    ----------
    case : GearboxCase
    places : mapping of str to (3,) array
        Of the stations by name, as those of planets [m].
    """
    turns, planets = _turns(case)
    drawn = dict[tuple[str, float, int], float]()
    around = {name: (*case.shaft_named(of).axis, turns.get(of, 0.0)) for name, of in carriers(case).items()}
    for number, stage in enumerate((*case.pair, *case.planetary)):
        bodies = _of_pair(case, stage, drawn) if isinstance(stage, PairSection) else _of_set(case, stage, places)
        spin, orbit = planets.get(stage.name, (0.0, None))
        for body in bodies:
            runs_around = body.name.startswith(f"{stage.name} planet")
            motion = {"turns": turns.get(body.member, 0.0), "orbit": around.get(body.member)}
            yield replace(body, stage=number, **({"turns": spin, "orbit": orbit} if runs_around else motion))
    for shaft in case.shaft:
        motion = {"turns": turns.get(shaft.name, 0.0), "orbit": around.get(shaft.name)}
        yield from (replace(part, **motion) for part in _of_shaft(shaft))
    yield from (replace(bearing, orbit=around.get(bearing.member)) for bearing in _of_bearings(case))


def _turns(case: GearboxCase) -> tuple[dict[str, float], dict[str, tuple[float, tuple[float, float, float]]]]:
    """Speeds of the shafts over the largest, and of the planets of every set with the axis that they run around.

    They are those of the first load case; nothing where no speed follows from it. Planets roll on the sun, as
    seen from the carrier: H. W. Müller, Epicyclic Drive Trains (1982), equation of Willis.
    """
    with suppress(FemgearError):
        speed = {CASING: 0.0, **gearbox_flow(case).speed}
        largest = max(map(abs, speed.values())) or 1.0
        turns, planets = {name: value / largest for name, value in speed.items()}, {}
        for stage in case.planetary:
            sizes = set_sizes(stage)
            holder = next(name for name in (stage.sun, stage.carrier, stage.ring) if name != CASING)
            sun, carrier = turns[stage.sun], turns[stage.carrier]
            spin = carrier - (sun - carrier) * sizes.base_radii[0] / sizes.base_radii[1]
            x, y = case.shaft_named(holder).axis
            planets[stage.name] = (spin, (x, y, carrier))
        return turns, planets
    return {}, {}


def _marks(data: Any) -> Iterator[SpaceBody]:
    """Sensors and feet of deflection.nc, as short cylinders on the casing."""
    size = _MARK * float(np.ptp(data["place"].values, axis=0).max())
    for kind in ("sensor", "foot"):
        if f"{kind}_place" in data:
            for name, (x, y, z) in zip(data[kind].values, data[f"{kind}_place"].values, strict=True):
                radii, ends = (0.0, 0.5 * size), (z - 0.5 * size, z + 0.5 * size)
                yield SpaceBody(f"{kind} {name}", kind, CASING, (x, y), ends, (radii, radii))


def _casing_box(bodies: Sequence[SpaceBody]) -> tuple[np.ndarray, np.ndarray]:
    """Box that stands for a casing, whose shape no case has: around its gears, bearings, feet and sensors [m]."""
    corners = list[tuple[float, float, float]]()
    for body in bodies:
        if body.kind != "shaft":
            reach = max(map(max, body.radii)) if body.kind in ("gear", "bearing") else 0.0
            x, y = body.axis
            middle = 0.5 * sum(body.ends)
            ends = body.ends if body.kind in ("gear", "bearing") else (middle, middle)
            corners += [(x - reach, y - reach, min(ends)), (x + reach, y + reach, max(ends))]
    return np.min(corners, axis=0), np.max(corners, axis=0)


def _of_shaft(shaft: BoxShaftSection) -> Iterator[SpaceBody]:
    """Parts of a shaft, cones between the diameters of their ends."""
    places = shaft.start + np.asarray(shaft.places)
    for part, low, high in zip(shaft.part, places[:-1], places[1:], strict=True):
        last = part.end_outer_diameter or part.outer_diameter
        first, second = (0.5 * part.inner_diameter, 0.5 * part.outer_diameter), (0.5 * part.bore_at_end, 0.5 * last)
        axis = shaft.axis[0], shaft.axis[1]
        yield SpaceBody(f"shaft {shaft.name}", "shaft", shaft.name, axis, (float(low), float(high)), (first, second))


def _of_bearings(case: GearboxCase) -> Iterator[SpaceBody]:
    """Rolling bearings with their sizes, others as narrow rings around their shafts."""
    for number, section in enumerate(case.bearing):
        shaft = case.shaft_named(section.shaft)
        z = shaft.start + (section.position or 0.0)
        outer = max((part.outer_diameter for part in shaft.part), default=0.0)
        if section.pitch_diameter is not None and section.element_diameter is not None:
            half = 0.75 * section.element_diameter
            radii = 0.5 * section.pitch_diameter - half, 0.5 * section.pitch_diameter + half
            width = section.effective_length or 1.6 * section.element_diameter
        elif outer > 0.0:
            radii, width = (0.5 * outer, 0.7 * outer), 0.3 * outer
        else:
            continue
        axis, ends = (shaft.axis[0], shaft.axis[1]), (z - 0.5 * width, z + 0.5 * width)
        yield SpaceBody(
            called("bearing", bearing_name(section, number)), "bearing", shaft.name, axis, ends, (radii, radii)
        )


@dataclass(frozen=True)
class _Seat:
    """Where a gear sits.

    Parameters
    ----------
    name, member : str
        Of the gear, and of what moves it.
    axis : (float, float)
        x and y [m].
    middle : float
        z of the middle of its face width [m].
    """

    name: str
    member: str
    axis: tuple[float, float]
    middle: float


@dataclass(frozen=True)
class _Teeth:
    """What the teeth of a gear look like.

    Parameters
    ----------
    gear : Gear or None
        In its transverse section; None of a gear without teeth of its own.
    count : int
        Number of the gear in its stage.
    pitch : float
        Radius of its pitch circle [m].
    hand : float
        1 of a right-handed helix where that of gear 1 or the sun is right-handed, else -1.
    angle : float
        Of a tooth at mid-width [rad].
    internal : bool
        Whether the teeth stand inside.
    """

    gear: Gear | None
    count: int
    pitch: float
    hand: float
    angle: float
    internal: bool = False


def _gear(seat: _Seat, sizes: StageSizes, teeth: _Teeth) -> SpaceBody:
    """Make a gear from its teeth, or a disc of its pitch circle where it has none."""
    width, pitch, gear = sizes.face_widths[teeth.count] or _DISC * teeth.pitch, teeth.pitch, teeth.gear
    place = seat.name, "gear", seat.member, seat.axis, (seat.middle - 0.5 * width, seat.middle + 0.5 * width)
    if gear is None:
        radii = (pitch, _RIM * pitch) if teeth.internal else (_BORE * pitch, pitch)
        return SpaceBody(*place, (radii, radii))
    twist = teeth.hand * width * math.tan(sizes.base_helix) / sizes.base_radii[teeth.count]
    inner = gear.rim_radius if teeth.internal else min(_BORE * pitch, gear.rim_radius)
    radii = inner, gear.tip_radius
    turned = teeth.angle - 0.5 * twist
    section = tooth_section(gear)
    return SpaceBody(*place, (radii, radii), section, gear.teeth, twist, teeth.internal, turned, gear=gear)


def _turned(stage: PairSection | BoxPlanetarySection, turn: float) -> tuple[tuple[Gear | None, ...], Any]:
    """Gears of a stage, and angles of a tooth of every copy of each, turned as a whole; no gears without teeth."""
    section = teeth_of(stage)
    if section is None:
        return (None, None, None), None
    gears: Any = planetary_set(section)
    return tuple(gears.gears), [[turn + angle for angle in of_gear] for of_gear in tooth_angles(gears)]


def _of_pair(case: GearboxCase, pair: PairSection, drawn: dict[tuple[str, float, int], float]) -> Iterator[SpaceBody]:
    """Both gears, on their shafts, but those that other pairs have ``drawn`` already at an angle of their teeth."""
    sizes = pair_sizes(pair)
    axes = [case.shaft_named(name).axis for name in pair.shafts]
    across = math.atan2(axes[1][1] - axes[0][1], axes[1][0] - axes[0][0])
    # gear 2 of a pair lies on x, an internal one on the other side
    gears, angles = _turned(pair, across + math.pi if sizes.internal else across)
    hands = 1.0, 1.0 if sizes.internal else -1.0
    shafts = [case.shaft_named(name) for name in pair.shafts]
    middles = [s.start + place for s, place in zip(shafts, pair.positions or (0.0, 0.0), strict=True)]
    keys = [(s.name, round(z, 6), count) for s, z, count in zip(shafts, middles, sizes.teeth, strict=True)]
    first, second = (angle[0] for angle in angles[:2]) if angles else (0.0, 0.0)
    ratio = hands[1] * sizes.teeth[0] / sizes.teeth[1]
    # a gear that is there already turns its mate into its gaps, as one of equal teeth on the shaft of a planet
    there = [drawn.get(key, _as_long(key, drawn) if pair.carrier is not None else None) for key in keys]
    if there[0] is not None:
        first, second = there[0], second + ratio * (there[0] - first)
    elif there[1] is not None:
        first, second = first + (there[1] - second) / ratio, there[1]
    for number, (name, shaft, middle) in enumerate(zip(pair.shafts, shafts, middles, strict=True)):
        if keys[number] in drawn:
            continue
        drawn[keys[number]] = angle = (first, second)[number]
        words = f"gear {number + 1} of {pair.name}"
        pitch = sizes.base_radii[number] / math.cos(sizes.pressure_angles[0])
        internal = sizes.internal and number == 1
        teeth = _Teeth(gears[number], number, pitch, hands[number], angle, internal)
        body = _gear(_Seat(words, name, (shaft.axis[0], shaft.axis[1]), middle), sizes, teeth)
        yield _with_faults(pair, body, (number, 0))


def _with_faults(stage: PairSection | BoxPlanetarySection, body: SpaceBody, at: tuple[int, int]) -> SpaceBody:
    """Mark the faulty teeth of a gear, ``at`` its number in the stage and that of its copy; short ones are drawn so."""
    section = teeth_of(stage)
    if section is None or not (faults := set_deviations(section).faults):
        return body
    gears: Any = planetary_set(section)
    words = [f"{stage.name} {text}" for text in fault_words(section)]
    short, marked = short_teeth(faults, gears).get(at, ()), marked_teeth(faults, words).get(at, ())
    first, count = -teeth_zero(gears)[at[0]][at[1]], body.teeth
    return replace(body, short=renumbered(short, first, count), marked=renumbered(marked, first, count))


def _as_long(key: tuple[str, float, int], drawn: dict[tuple[str, float, int], float]) -> float | None:
    """Angle of a gear of as many teeth on the same shaft."""
    return next((angle for (shaft, _, teeth), angle in drawn.items() if (shaft, teeth) == (key[0], key[2])), None)


def _of_set(case: GearboxCase, stage: BoxPlanetarySection, places: dict[str, np.ndarray]) -> Iterator[SpaceBody]:
    """Sun, planets and ring, each on its member."""
    sizes = set_sizes(stage)
    gears, turned = _turned(stage, stage.angle)
    holder = next(name for name in ("sun", "carrier", "ring") if getattr(stage, name) != CASING)
    shaft = case.shaft_named(getattr(stage, holder))
    middle = shaft.start + (getattr(stage, f"{holder}_position") or 0.0)
    axis = shaft.axis[0], shaft.axis[1]
    planet = planet_radius(sizes)
    angles = [stage.angle + angle for angle in sizes.planet_angles]
    of_sun, of_planets, of_ring = turned or ((0.0,), (0.0,) * len(angles), (0.0,))
    seat = f"seat ring of {stage.name}"
    in_casing = seat if seat in places else CASING
    sun = _Teeth(gears[0], 0, sizes.centre_distance - planet, 1.0, of_sun[0])
    yield _with_faults(stage, _gear(_Seat(f"sun of {stage.name}", stage.sun, axis, middle), sizes, sun), (0, 0))
    for number, (psi, angle) in enumerate(zip(angles, of_planets, strict=True), start=1):
        name, distance = f"{stage.name} planet {number}", sizes.centre_distance
        x, y = axis[0] + distance * math.cos(psi), axis[1] + distance * math.sin(psi)
        z = float(places[name][2]) if name in places else middle
        teeth = _Teeth(gears[1], 1, planet, -1.0, angle)
        yield _with_faults(stage, _gear(_Seat(name, name, (x, y), z), sizes, teeth), (1, number - 1))
    ring = _Teeth(gears[2], 2, sizes.centre_distance + planet, -1.0, of_ring[0], internal=True)
    member = in_casing if stage.ring == CASING else stage.ring
    yield _with_faults(stage, _gear(_Seat(f"ring of {stage.name}", member, axis, middle), sizes, ring), (2, 0))
