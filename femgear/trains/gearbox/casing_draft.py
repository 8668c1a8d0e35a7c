"""A rigid casing on four feet, with sensors, for a gearbox whose own casing nobody has given: all of it estimated.

The casing is a box around shafts and gears, closed by walls of one thickness. That of cast gear units follows from
the centre distance a of the largest stage, ``0.025 a + 3 mm``, at least 8 mm (P. F. Dunaev and O. P. Lelikov,
Konstruirovanie uzlov i detalej mashin, 2003, section 17). Feet stand at the corners of the lower wall, each as stiff
as a strip of this wall four thicknesses wide and ten long in tension, and half as stiff across.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from femgear.case import text as case_text
from femgear.case.quantities import INERTIA, LENGTH, MASS, STIFFNESS
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.trains.gearbox.case_file import GearboxCase
from femgear.trains.gearbox.geometry import pair_sizes, set_sizes
from femgear.trains.gearbox.overlaps import gear_outlines

DENSITY, MODULUS = 7200.0, 110e9
"""Of grey cast iron [kg/m^3, Pa]."""
_LEAST_WALL, _WALL, _WALL_SHARE = 8e-3, 3e-3, 0.025
_GAP = 2.0
"""From the parts inside to the walls, in thicknesses of these."""
_FOOT_SHARE = 0.4
"""Stiffness of a foot over modulus times thickness: a strip four of these wide and ten long."""
_RING = 1.15
"""Radius of a ring over the way of its planets."""
_SPEEDS = 200


def draft_casing(case: GearboxCase) -> tuple[str, tuple[Finding, ...]]:
    """Write the tables of an estimated casing with feet, sensors and a run-up, and what is told of them.

    CaseError: a casing or sensors that are there already (E-CHOICE), shafts and gears of no size (E-KEY-MISSING).
    """
    if case.casing is not None or case.sensor:
        key = "casing" if case.casing is not None else "sensor"
        limit = "a gearbox without [casing] and [[sensor]]"
        raise CaseError(
            "the case has it already",
            code="E-CHOICE",
            key=key,
            limit=limit,
            remedy="run it as it is: levels are those at its sensors",
            file=case.location(key),
        )
    low, high = _bounds(case)
    wall = wall_thickness(case)
    low, high = low - _GAP * wall, high + _GAP * wall
    mass, inertia = walls_inertia(high - low, wall)
    middle = 0.5 * (low + high)
    down, sense = _down(case)
    side = 1 - down
    bottom, top = (low, high) if sense < 0.0 else (high, low)
    feet, remarks = list[dict[str, Any]](), dict[str, str]()
    stiffness = [0.5 * _FOOT_SHARE * MODULUS * wall] * 3
    stiffness[down] *= 2.0
    for name, first, last in (
        ("left front", low, low),
        ("right front", high, low),
        ("left rear", low, high),
        ("right rear", high, high),
    ):
        place = np.array([0.0, 0.0, last[2]])
        place[down], place[side] = bottom[down], first[side]
        feet.append({"name": name, "position": _lengths(place), "stiffness": [*map(_stiffness, stiffness)]})
    for number in range(len(feet)):
        remarks[f"casing.foot[{number}].stiffness"] = "estimated: a strip of the lower wall"
    remarks["casing.mass"] = f"estimated: walls of {LENGTH.show(wall)} cast iron around all shafts and gears"
    remarks["casing.inertia"] = "estimated: of these walls"
    casing = {
        "mass": MASS.show(float(f"{mass:.4g}")),
        "centre": _lengths(middle),
        "inertia": [INERTIA.show(float(f"{value:.4g}")) for value in inertia],
        "foot": feet,
    }
    tables: dict[str, Any] = {"casing": casing, "sensor": list(_sensors(case, (middle, top, high), down, -sense))}
    if not case.runup.count:
        tables["runup"] = {"count": _SPEEDS}
    text = (
        f"a rigid casing of {casing['mass']} on four feet of {_stiffness(stiffness[down])}, and sensors, are estimated "
        "from the sizes of shafts and gears"
    )
    finding = Finding("W-ESTIMATED", "casing", text, remedy="give mass, feet and sensors of your own, or a casing file")
    return case_text.write(tables, remarks), (finding,)


def wall_thickness(case: GearboxCase) -> float:
    """Estimate the thickness of the walls of a cast casing from the largest centre distance [m]."""
    sizes = [pair_sizes(stage) for stage in case.pair] + [set_sizes(stage) for stage in case.planetary]
    largest = max((shaft_size.centre_distance for shaft_size in sizes), default=0.0)
    return max(_WALL_SHARE * largest + _WALL, _LEAST_WALL)


def walls_inertia(sides: np.ndarray, wall: float) -> tuple[float, np.ndarray]:
    """Compute mass [kg] and moments of inertia (3,) [kg m^2] of a closed box with outer sides (3,) [m]."""
    inner = np.maximum(sides - 2.0 * wall, 0.0)
    masses = DENSITY * sides.prod(), DENSITY * inner.prod()
    solid = [m * (size @ size - size**2) / 12.0 for m, size in zip(masses, (sides, inner), strict=True)]
    return float(masses[0] - masses[1]), solid[0] - solid[1]


def _bounds(case: GearboxCase) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest x, y, z of shafts and gears [m]."""
    boxes = []
    for shaft in case.shaft:
        if shaft.part:
            radius = 0.5 * max(max(part.outer_diameter, part.end_outer_diameter or 0.0) for part in shaft.part)
            boxes.append((shaft.axis, radius, shaft.start, shaft.start + shaft.length))
    # around the way of planets there is a ring
    boxes += [
        (gear.axis, gear.tip * (1.0 if math.isfinite(gear.root) else _RING), *gear.ends) for gear in gear_outlines(case)
    ]
    if not boxes:
        limit = "shafts with parts, or stages"
        raise CaseError("nothing has a size that a casing follows from", code="E-KEY-MISSING", key="shaft", limit=limit)
    corners = np.array([[[x + s * r, y + s * r, end] for s, end in ((-1.0, a), (1.0, b))] for (x, y), r, a, b in boxes])
    return corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)


def _down(case: GearboxCase) -> tuple[int, float]:
    """Axis and sense in which the feet lie: that of the weight across the shafts, else -y."""
    if case.gravity is None:
        return 1, -1.0
    x, y, _ = case.gravity.direction
    if math.hypot(x, y) == 0.0:
        return 1, -1.0
    return (0, math.copysign(1.0, x)) if abs(x) > abs(y) else (1, math.copysign(1.0, y))


def _sensors(case: GearboxCase, corners: tuple[np.ndarray, np.ndarray, np.ndarray], down: int, up: float):
    """Sensors in the middle of the upper wall, of one beside and, where anything moves along the axes, of an end."""
    side, (middle, top, high) = 1 - down, corners
    walls = [("top", down, top[down], up), ("side", side, high[side], 1.0)]
    if case.motions == "space":
        walls.append(("end", 2, high[2], 1.0))
    for name, axis, place, sign in walls:
        position = middle.copy()
        position[axis] = place
        yield {"name": name, "position": _lengths(position), "direction": f"{'-' * (sign < 0)}{'xyz'[axis]}"}


def _lengths(place: np.ndarray) -> list[str]:
    return [LENGTH.show(round(float(value), 5) + 0.0) for value in place]


def _stiffness(value: float) -> str:
    return STIFFNESS.show(float(f"{value:.3g}"))
