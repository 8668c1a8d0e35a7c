"""Pairs and sets in space for the page: gears with their teeth in one another's gaps, and their modes."""

from __future__ import annotations

import cmath
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.gears.faults import ToothFault
from femgear.gears.kinematics import orientations
from femgear.gears.pair import GearSet
from femgear.gears.profile import base_helix_angle
from femgear.gears.short_teeth import marked_teeth, renumbered, short_teeth
from femgear.report.solid import SOLID
from femgear.report.space import SPACE, Motion, SpaceBody, space, tooth_section
from femgear.stages.protocol import Drawn
from femgear.stages.tooth_faults import fault_words
from femgear.storage.files import write_text

WAYS = ("x", "y", "z", "tilt x", "tilt y", "rotation")
"""Coordinates of a body in modes.nc, in the order of motions in space."""
MODES_SHOWN = 40
"""Modes that can be chosen."""


def tooth_angles(gears: GearSet) -> tuple[tuple[float, ...], ...]:
    """Turn the teeth of mates into one another's gaps: angle of a tooth of every gear and copy [rad].

    A tooth of the first gear stands on the x axis. A tooth that is ahead of the line of centres by an arc meets a gap
    as far behind it on the external mate, as far ahead on the internal one.
    """
    angles: list[list[float]] = [[0.0] * len(copies) for copies in gears.centres]
    for first, second in gears.mates:
        z_first, z_second = gears.gears[first].teeth, gears.gears[second].teeth
        for copy in range(max(len(angles[first]), len(angles[second]))):
            i, j = (copy if gears.repeated[number] else 0 for number in (first, second))
            line = gears.centres[second][j] - gears.centres[first][i]
            half_pitch = math.pi / z_second
            if gears.gears[second].internal:
                touch = cmath.phase(-line)
                ahead = (angles[first][i] - touch) * z_first / z_second
                angles[second][j] = touch + ahead + half_pitch
            else:
                touch = cmath.phase(line)
                ahead = (angles[first][i] - touch) * z_first / z_second
                angles[second][j] = touch + math.pi - ahead + half_pitch
    return tuple(tuple(of_gear) for of_gear in angles)


def gear_hands(gears: GearSet) -> tuple[float, ...]:
    """Hand of the teeth of every gear over that of the first: opposite of external mates, equal of internal ones."""
    hands = [1.0] * len(gears.gears)
    for first, second in gears.mates:
        hands[second] = hands[first] if gears.gears[second].internal else -hands[first]
    return tuple(hands)


def gear_turns(gears: GearSet) -> tuple[float, ...]:
    """Turns of every gear over those of the first, all axes at rest: mates roll on one another."""
    turns = [1.0] * len(gears.gears)
    for first, second in gears.mates:
        same = 1.0 if gears.gears[second].internal else -1.0
        turns[second] = same * turns[first] * gears.gears[first].teeth / gears.gears[second].teeth
    return tuple(turns)


def teeth_zero(gears: GearSet) -> tuple[tuple[int, ...], ...]:
    """Number the tooth that counts as zero from the drawn one that `tooth_angles` tells, of every gear and copy.

    At the position at which tooth zero of the first gear stands on the x axis.
    """
    first, start = gears.gears[0], orientations(gears).gears[0][0]
    turned = orientations(gears, -start / (gears.senses[0] * first.pitch_angle))
    parts = zip(gears.gears, turned.gears, tooth_angles(gears), strict=True)
    return tuple(
        tuple(
            round((angle - drawn) / gear.pitch_angle) % gear.teeth
            for angle, drawn in zip(of_gear, of_drawing, strict=True)
        )
        for gear, of_gear, of_drawing in parts
    )


def gear_bodies(
    gears: GearSet, base_helix: float, faults: Sequence[ToothFault] = (), words: Sequence[str] = ()
) -> Iterator[SpaceBody]:
    """List the gears of a pair or a set, their axes along z.

    Parameters
    ----------
    gears : GearSet
        In their transverse section.
    base_helix : float
        Base helix angle of the first gear [rad], positive of a right-handed one.
    faults : sequence of ToothFault
        Of which teeth that are missing or short are drawn so.
    words : sequence of str
        Of these faults, with which their teeth are marked; none marks none.
    """
    short, marked = short_teeth(faults, gears), marked_teeth(faults, words) if words else {}
    zero = teeth_zero(gears) if short or marked else ()
    hands, angles, turns = gear_hands(gears), tooth_angles(gears), gear_turns(gears)
    for number, gear in enumerate(gears.gears):
        section, half = tooth_section(gear), 0.5 * gear.face_width
        twist = hands[number] * 2.0 * half * math.tan(base_helix) / gear.base_radius
        words = gear.name.replace("_", " ")
        for copy, (centre, angle) in enumerate(zip(gears.centres[number], angles[number], strict=True), start=1):
            name = f"{words} {copy}" if gears.repeated[number] else words
            radii, body = (gear.rim_radius, gear.tip_radius), (number, copy - 1)
            yield SpaceBody(
                name,
                "gear",
                name,
                (centre.real, centre.imag),
                (-half, half),
                (radii, radii),
                section,
                gear.teeth,
                twist,
                gear.internal,
                angle - 0.5 * twist,
                stage=number,
                gear=gear,
                turns=turns[number],
                short=renumbered(short[body], -zero[number][copy - 1], gear.teeth) if body in short else (),
                marked=renumbered(marked[body], -zero[number][copy - 1], gear.teeth) if body in marked else (),
            )


def case_bodies(case: Any) -> Iterator[SpaceBody]:
    """List the gears of the case of a pair or a set."""
    base = base_helix_angle(case.pressure_angle, case.helix_angle or 0.0)
    return gear_bodies(planetary_set(case), base, set_deviations(case).faults, fault_words(case))


def write_gears_in_space(drawn: Drawn, folder: Path) -> list[str]:
    """Write gears and modes for the page where their static state is not drawn in space already; returns file names."""
    if (folder / SOLID).exists():
        return []
    bodies = list(case_bodies(drawn.case))
    names = [body.member for body in bodies]
    place = np.array([[*body.axis, 0.0] for body in bodies])
    model = space(bodies, names, place, list(_modes(drawn.data.get("modes"), names)))
    write_text(json.dumps(model, allow_nan=False, separators=(",", ":")), folder / SPACE)
    return [SPACE]


def _modes(modes: Any, names: list[str]) -> Iterator[Motion]:
    """Yield the modes of modes.nc that have stiffness, as motions of the bodies."""
    if modes is None:
        return
    rows = {str(dof): row for row, dof in enumerate(modes["dof"].values)}
    hertz, shape = modes["frequency"].values, modes["shape"].values
    for mode in np.flatnonzero(hertz > 1e-3 * hertz.max(initial=0.0) / max(len(hertz), 1))[:MODES_SHOWN]:
        places = [[rows.get(f"{name}: {way}") for way in WAYS] for name in names]
        values = np.array([[0.0 if row is None else float(shape[row, mode]) for row in of_body] for of_body in places])
        yield Motion(f"mode {mode + 1}: {hertz[mode]:.5g} Hz, {modes['kind'].values[mode]}", values)
