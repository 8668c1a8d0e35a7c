"""A gearbox in space for the page: gears with their teeth, shafts, bearings, sensors, and how they move.

Every body is a section that is drawn out along z, or a body of revolution, on a member whose stations move; the
browser makes surfaces of that, and turns them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.gears.gear import Gear
from femgear.gears.short_teeth import MarkedTeeth, ShortTeeth
from femgear.gears.tooth import half_sector
from femgear.report.solid import packed_values

SPACE = "space.json"
"""File of what the page turns in space of a gearbox or a pair."""
_FLANK, _FILLET = 4, 4
"""Edges of a flank and points of a fillet that are drawn."""
_DIGITS = 4
"""Decimal places of lengths [mm]."""


@dataclass(frozen=True)
class SpaceBody:
    """A body in space.

    Parameters
    ----------
    name : str
        What it is, as the pointer tells.
    kind : {"gear", "shaft", "bearing", "sensor", "foot"}
    member : str
        Whose stations move it.
    axis : (float, float)
        x and y of its own axis [m].
    ends : (float, float)
        z of both ends [m].
    section : (n, 2) array, optional
        One tooth sector of its outline, counter-clockwise, tooth on the x axis [m]; None of a body of revolution.
    teeth : int
        Number of sectors.
    radii : ((float, float), (float, float))
        Inner and outer radius at both ends [m]; of a gear the one of the bore or rim, twice.
    twist : float
        By which the section turns from the first to the second end [rad].
    internal : bool
        Whether the teeth stand inside of the rim.
    angle : float
        By which the first tooth is turned from the x axis [rad].
    stage : int
        Number of the stage of a gear, which gives its colour.
    gear : Gear, optional
        That has the teeth, in its transverse section.
    turns : float
        By how much it turns about its own axis, over what turns fastest or the first body; 0 of what stands.
    orbit : (float, float, float), optional
        x and y [m] of the axis that its own one runs around, and turns of that.
    short : tuple of (int, float)
        Teeth that are missing or short, counter-clockwise from the first one, and the radii that they reach [m].
    marked : tuple of (int, str)
        Teeth with a colour of their own, and what stands beside them.
    """

    name: str
    kind: str
    member: str
    axis: tuple[float, float]
    ends: tuple[float, float]
    radii: tuple[tuple[float, float], tuple[float, float]]
    section: np.ndarray | None = None
    teeth: int = 0
    twist: float = 0.0
    internal: bool = False
    angle: float = 0.0
    stage: int = 0
    gear: Gear | None = None
    turns: float = 0.0
    orbit: tuple[float, float, float] | None = None
    short: ShortTeeth = ()
    marked: MarkedTeeth = ()


@dataclass(frozen=True)
class Motion:
    """How the stations move in one view.

    Parameters
    ----------
    title : str
    values : (n_stations, 6) array
        Displacements [m] and rotations [rad] along x, y, z.
    swings : bool
        Whether it is a mode, which swings through its rest.
    """

    title: str
    values: np.ndarray
    swings: bool = True


def tooth_section(gear: Gear) -> np.ndarray:
    """Draw one tooth of a gear with half a gap on either side, (n, 2) [m], counter-clockwise, tooth on the x axis."""
    curves = dict(half_sector(gear, flank_elements=_FLANK).curves)
    kept = {"tip": 2, "flank": _FLANK + 1, "fillet": _FILLET, "root": 2}
    points = np.vstack(
        [
            curve[np.unique(np.linspace(0, len(curve) - 1, count).round().astype(int))]
            for name, count in kept.items()
            if (curve := curves.get(name)) is not None
        ]
    )
    upper = points[np.argsort(np.arctan2(points[:, 1], points[:, 0]), kind="stable")]
    upper = upper[np.append(True, np.hypot(*np.diff(upper, axis=0).T) > 1e-9)]
    return np.vstack([upper[:0:-1] * [1.0, -1.0], upper])


def space(
    bodies: Sequence[SpaceBody],
    members: Sequence[str],
    place: np.ndarray,
    motions: Sequence[Motion],
    casing: tuple[np.ndarray, np.ndarray] | None = None,
    on_casing: Sequence[str] = (),
) -> dict[str, Any]:
    """Collect what the browser draws of a gearbox in space.

    Parameters
    ----------
    bodies : sequence of SpaceBody
    members : sequence of str
        Of every station the member that it is of.
    place : (n_stations, 3) array
        [m]
    motions : sequence of Motion
        Views to choose from.
    casing : ((3,) array, (3,) array), optional
        Opposite corners of the box that stands for a casing [m].
    on_casing : sequence of str
        Members whose stations are on the casing: the box moves as they do.

    Returns
    -------
    dict
        What JSON can hold: lengths in mm, displacements in mm and rotations in rad as they are in the files.
    """
    at = dict[str, list[int]]()
    for number, member in enumerate(members):
        at.setdefault(member, []).append(number)
    numbers = {member: sorted(rows, key=lambda row: float(place[row, 2])) for member, rows in at.items()}
    return {
        "bodies": [_body(body) for body in bodies],
        "members": {member: {"rows": rows, "place": _lengths(place[rows])} for member, rows in numbers.items()},
        "motions": [
            {
                "title": motion.title,
                "swings": motion.swings,
                "moved": packed_values(1e3 * motion.values[:, :3]),
                "turned": packed_values(motion.values[:, 3:]),
            }
            for motion in motions
        ],
        **({} if casing is None else _moving_box(casing, on_casing)),
    }


def _moving_box(corners: tuple[np.ndarray, np.ndarray], on_casing: Sequence[str]) -> dict[str, Any]:
    return {"casing": [_lengths(corner) for corner in corners], "casing_members": [*dict.fromkeys(on_casing)]}


def _lengths(values: Any) -> list[float]:
    return [round(1e3 * float(value), _DIGITS) for value in np.ravel(values)]


def _body(body: SpaceBody) -> dict[str, Any]:
    """Write a body for JSON, in mm and rad."""
    data: dict[str, Any] = {
        "name": body.name,
        "kind": body.kind,
        "member": body.member,
        "axis": _lengths(body.axis),
        "ends": _lengths(body.ends),
        "radii": _lengths(body.radii),
        "stage": body.stage,
    }
    if body.turns:
        data["turns"] = round(body.turns, 9)
    if body.orbit is not None:
        data["orbit"] = [*_lengths(body.orbit[:2]), round(body.orbit[2], 9)]
    if body.section is not None:
        data |= {"section": _lengths(body.section), "teeth": body.teeth, "internal": body.internal}
        if body.short:
            data["short"] = [[number, round(1e3 * radius, _DIGITS)] for number, radius in body.short]
        if body.marked:
            data["marked"] = [list(tooth) for tooth in body.marked]
        data |= {"twist": round(body.twist, 6), "angle": round(math.remainder(body.angle, 2.0 * math.pi), 6)}
    return data
