"""Outline of a whole tooth sector with a straight crack from its root, for a grid that is split along it.

The crack is the first part of an inner curve from the fillet of the left flank through the body; the rest of that
curve, the ligament, goes on to another corner of the outline and only divides the grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.faults import Crack
from femgear.gears.gear import Gear
from femgear.gears.tooth import HalfSector, half_sector

SECTION = "section"
"""Name of the inner curve that the crack is a part of."""
BESIDE = ("above", "below")
"""Regions on both sides of it: that of the tooth first."""
_TIP_SHARE, _FINEST, _GROWTH = 0.01, 1e-3, 0.25
"""Element edge at the tip of the crack, over its depth and at least over the module; growth of edges away from it."""
_LEAST = 0.05
"""Depth of a crack over the module, at least: fifty of the finest edges, and some 0.1 % of the tooth's compliance."""
_ROUNDED = 1e-9
"""Part of a depth that is rounding."""
_MOST = 0.85
"""Depth of a crack over the length of the section that it lies in."""
_TANGENT = {False: math.radians(30.0), True: math.radians(60.0)}
"""Angle of the critical section's tangent to the centre line of external and internal teeth (ISO 6336-3)."""


@dataclass(frozen=True)
class CrackedSector:
    """Whole sector of one tooth with a crack at the root of its left flank.

    Parameters
    ----------
    curves, interfaces, regions : tuples
        As of `femgear.fe.meshing.Outline` [m].
    crack : (2k + 1, 2) array
        Points of the crack from its mouth to its tip, corners and middles of edges in turn [m].
    section : float
        Length of the straight section that the crack lies in [m].
    """

    curves: tuple[tuple[str, np.ndarray], ...]
    interfaces: tuple[tuple[str, np.ndarray], ...]
    regions: tuple[tuple[str, tuple[float, float]], ...]
    crack: np.ndarray
    section: float


def cracked_sector(
    gear: Gear, *, angle: float, depth: float, start: float | None = None, flank_elements: int = 24
) -> CrackedSector:
    """Make the boundary of a sector whose tooth is cracked from the root of its left flank.

    GeometryError (E-FAULT): a crack that starts off the root, leaves the body at once or goes through it.

    Parameters
    ----------
    angle : float
        Between the crack and the centre line of the tooth, towards the body [rad].
    depth : float
        Length of the crack [m].
    start : float, optional
        Radius of its mouth [m]; by default where the tangent of the fillet stands at 30 degrees to the centre line, of
        internal teeth at 60 degrees. The nearest corner of the outline is taken.
    flank_elements : int
        As of `femgear.gears.tooth.half_sector`.
    """
    return cracked_outline(
        half_sector(gear, flank_elements=flank_elements), gear, angle=angle, depth=depth, start=start
    )


def cracked_outline(
    half: HalfSector, gear: Gear, *, angle: float, depth: float, start: float | None = None
) -> CrackedSector:
    """Make the boundary of a cracked sector from the half one of a gear, as `cracked_sector`."""
    curves = _whole(half)
    mouth, beside = _mouth(half, gear, start)
    inwards = 1.0 if gear.internal else -1.0
    direction = np.array([inwards * math.cos(angle), -math.sin(angle)])
    end, section = _opposite(curves, mouth, direction)
    if not depth >= _LEAST * gear.module * (1.0 - _ROUNDED):
        raise GeometryError(
            f"{gear.name}: a crack of {1e3 * depth:.4g} mm is shorter than the grid of its tooth can show",
            code="E-FAULT",
            key="depth",
            value=f"{1e3 * depth:.4g} mm",
            limit=f"{1e3 * _LEAST * gear.module:.4g} mm or more, {_LEAST:g} of the module",
            remedy="give a deeper one, or 0 mm for none",
        )
    if not depth <= _MOST * section:
        raise GeometryError(
            f"{gear.name}: a crack of {1e3 * depth:.4g} mm goes through the tooth",
            code="E-FAULT",
            key="depth",
            value=f"{1e3 * depth:.4g} mm",
            # what is printed may be typed
            limit=f"up to {math.floor(1e6 * _MOST * section) / 1e3:.6g} mm at this angle",
            remedy='reduce it, or write kind = "missing"',
        )
    tip = mouth + depth * direction
    finest = max(_TIP_SHARE * depth, _FINEST * gear.module)
    crack = _graded(mouth, tip, beside, finest)
    # the ligament goes on to a corner of the outline that lies about ahead
    ligament = _graded(tip, end, finest, beside)
    normal = np.array([-direction[1], direction[0]])
    if normal[0] * inwards > 0:
        normal = -normal
    middle, off = mouth + 0.5 * depth * direction, 1e-3 * depth * normal
    places = (middle + off, middle - off)
    regions = tuple((name, (float(place[0]), float(place[1]))) for name, place in zip(BESIDE, places))
    return CrackedSector(curves, ((SECTION, np.vstack([crack, ligament[1:]])),), regions, crack, section)


def check_crack(gear: Gear, crack: Crack) -> None:
    """Refuse a crack that the tooth cannot have (GeometryError, E-FAULT), as `cracked_sector`."""
    cracked_sector(gear, angle=crack.angle, depth=crack.depth, start=crack.start, flank_elements=4)


def _whole(half: HalfSector) -> tuple[tuple[str, np.ndarray], ...]:
    """Curves of both halves, counter-clockwise, with "_left" and "_right" behind their names."""
    names = [name for name, _ in half.curves]
    first = names.index("symmetry") + 1
    left = [*half.curves[first:], *half.curves[: first - 1]]
    ends = [points.copy() for _, points in left]
    ends[0][0, 1] = ends[-1][-1, 1] = 0.0
    right = [points[::-1] * np.array([1.0, -1.0]) for points in reversed(ends)]
    named = [(f"{name}_left", points) for (name, _), points in zip(left, ends, strict=True)]
    named += [(f"{name}_right", points) for (name, _), points in zip(reversed(left), right, strict=True)]
    return tuple(named)


def _mouth(half: HalfSector, gear: Gear, start: float | None) -> tuple[np.ndarray, float]:
    """Corner of fillet or root of the left flank nearest to where the crack starts, and the length of edges there."""
    parts = [points for name, points in half.curves if name in ("fillet", "root")]
    corners = np.vstack([points[0::2] for points in parts])
    order = np.argsort(np.hypot(*corners.T))
    corners = corners[order if not gear.internal else order[::-1]]
    corners = corners[np.append(True, np.linalg.norm(np.diff(corners, axis=0), axis=1) > 1e-9 * gear.module)]
    radius = np.hypot(*corners.T)
    if start is None:
        tangent = np.gradient(corners, axis=0)
        steep = np.arctan2(np.abs(tangent[:, 1]), np.abs(tangent[:, 0]))
        at = int(np.argmin(np.abs(steep[1:-1] - _TANGENT[gear.internal]))) + 1
    else:
        low, high = radius.min(), radius.max()
        if not low <= start <= high:
            raise GeometryError(
                f"{gear.name}: a crack at a diameter of {2e3 * start:.5g} mm does not start in the root",
                code="E-FAULT",
                key="diameter",
                value=f"{2e3 * start:.5g} mm",
                limit=f"{2e3 * low:.5g} to {2e3 * high:.5g} mm",
                remedy="leave it out: the critical section of ISO 6336-3",
            )
        at = min(max(int(np.argmin(np.abs(radius - start))), 1), len(corners) - 2)
    return corners[at], float(np.linalg.norm(corners[at + 1] - corners[at]))


def _opposite(curves, mouth: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, float]:
    """Corner of the outline nearest to where a ray from the mouth leaves the body, and the length of the ray [m]."""
    corners = np.vstack([points[0:-1:2] for _, points in curves])
    a, b = corners - mouth, np.roll(corners, -1, axis=0) - mouth
    normal = np.array([-direction[1], direction[0]])
    across = np.stack([a @ normal, b @ normal])
    share = across[0] / np.where(across[0] == across[1], 1.0, across[0] - across[1])
    along = (a + share[:, None] * (b - a)) @ direction
    leaves = (across[0] * across[1] <= 0.0) & (across[0] != across[1]) & (along > 1e-6 * np.abs(a).max())
    if not leaves.any():
        raise GeometryError(
            "the crack does not lead into the body", code="E-FAULT", key="angle", remedy="give another angle"
        )
    length = float(along[leaves].min())
    nearest = int(np.argmin(np.linalg.norm(a - length * direction, axis=1)))
    return corners[nearest], length


def _graded(start: np.ndarray, end: np.ndarray, first: float, last: float) -> np.ndarray:
    """Points (2k + 1, 2) of a straight line whose edges grow from the lengths at both ends [m]."""
    length = float(np.linalg.norm(end - start))
    s = np.linspace(0.0, length, 4001)
    density = 1.0 / np.minimum(first + _GROWTH * s, last + _GROWTH * (length - s))
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s))])
    count = max(2, math.ceil(integral[-1]))
    share = np.interp(np.linspace(0.0, integral[-1], count + 1), integral, s) / length
    share[0], share[-1] = 0.0, 1.0
    both = np.empty(2 * count + 1)
    both[0::2], both[1::2] = share, 0.5 * (share[1:] + share[:-1])
    return start + both[:, None] * (end - start)
