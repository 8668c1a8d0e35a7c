"""Outlines of tooth sectors with one flank divided finely around a point, the cuts those of any sector."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from femgear.fe.meshing import Outline
from femgear.gears.gear import flank_points
from femgear.gears.tooth import half_sector

if TYPE_CHECKING:
    from femgear.gears.gear import Gear

Side = Literal["left", "right"]
FINE = 1.35  # half of the finely divided stretch, in half widths of the contact
CORNER = 1 / 16  # smallest element at a tip corner that touches, in those of the fine stretch
CORNER_GROWTH = 0.3  # of the element size beside it
GROWTH = 0.2  # of the element size along the flank beyond it
MIRROR = np.array([1.0, -1.0])


def flank_curve(gear: Gear, side: Side, *, refine: float = 1.0) -> np.ndarray:
    """Points (2k + 1, 2) of an evenly divided flank, the body on the left."""
    points = np.asarray(half_sector(gear, refine=refine).curve("flank"))
    return points if side == "left" else points[::-1] * MIRROR


def graded_sector(
    gear: Gear,
    side: Side,
    roll: float,
    half_width: float,
    *,
    edges: int | None,
    refine: float = 1.0,
    flank_elements: int = 24,
    corner: float | None = None,
) -> Outline:
    """Whole sector with the boundary ``contact`` on one flank.

    Parameters
    ----------
    gear : Gear
    side : {"left", "right"}
        Flank that touches.
    roll : float
        Roll length of the middle of the contact [m].
    half_width : float
        Of the contact [m].
    edges : int, optional
        Element edges on a half width; None leaves the flank as it is.
    refine : float
        Divides all other element sizes.
    flank_elements : int
        Element edges along a flank that is divided evenly.
    corner : float, optional
        Roll length where a tip corner touches [m]: the edges shrink towards it.
    """
    half = half_sector(gear, refine=refine, flank_elements=flank_elements)
    flank = np.asarray(half.curve("flank"))
    if edges is not None:
        flank = _graded(gear, half, roll, half_width, edges, refine, corner)
    boundary = [(name, points) for name, points in half.curves if name != "symmetry"]
    fine = [("contact", flank) if name == "flank" else (name, points) for name, points in boundary]
    mirrored = [(name, np.asarray(points)[::-1] * MIRROR) for name, points in boundary[::-1]]
    if edges is not None and corner is not None and math.isclose(corner, gear.tip_roll, rel_tol=1e-6):
        size = CORNER * half_width / edges
        fine = [(n, _graded_tip(p, gear, size, refine)) if n == "tip" else (n, p) for n, p in fine]
    if side == "right":
        mirrored = [(name, np.asarray(points)[::-1] * MIRROR) for name, points in fine[::-1]]
        fine = boundary
    curves = [(_named(name, "left"), points) for name, points in fine]
    curves += [(_named(name, "right"), points) for name, points in mirrored]
    base = np.asarray(half.interfaces[0][1])
    whole = np.vstack([base[::-1] * MIRROR, base[1:]])
    return Outline(tuple(curves), (("tooth_base", whole),), half.regions)


def _named(name, side):
    return name if name in ("contact", "rim", "tip") else f"{name}_{side}"


def _graded(gear, half, roll, half_width, edges, refine, corner):
    """Flank points (2k + 1, 2) with small edges around the contact that grow to those of the even flank."""
    arc = half.flank_roll**2 / (2 * gear.base_radius)
    largest = abs(arc[0] - arc[-1]) / (len(arc) // 2)
    s = np.linspace(arc[0], arc[-1], 20001)
    beyond = np.maximum(np.abs(s - roll**2 / (2 * gear.base_radius)) - FINE * half_width, 0.0)
    size = np.minimum(half_width / edges + GROWTH / refine * beyond, largest)
    if corner is not None:
        away = np.abs(s - corner**2 / (2 * gear.base_radius))
        size = np.minimum(size, CORNER * half_width / edges + CORNER_GROWTH / refine * away)
    density = 1.0 / size
    steps = 0.5 * (density[1:] + density[:-1]) * abs(s[1] - s[0])
    integral = np.concatenate([[0.0], np.cumsum(steps)])
    corners = np.interp(np.linspace(0.0, integral[-1], math.ceil(integral[-1]) + 1), integral, s)
    stations = np.interp(np.arange(2 * len(corners) - 1) / 2, np.arange(len(corners)), corners)
    flank = flank_points(gear, np.sqrt(2 * gear.base_radius * stations))
    ends = half.curve("flank")
    flank[0], flank[-1] = ends[0], ends[-1]
    return flank


def _graded_tip(tip, gear, size, refine):
    """Points (2k + 1, 2) of half a tip arc with edges that grow from `size` at the flank [m]."""
    angle = np.arctan2(*np.asarray(tip).T[::-1])
    end = np.abs(angle).max()
    s = np.linspace(0.0, 1.0, 20001) ** 2 * gear.tip_radius * end
    largest = np.hypot(*np.diff(np.asarray(tip)[::2], axis=0).T).max()
    density = 1.0 / np.minimum(size + CORNER_GROWTH / refine * s, largest)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s))])
    corners = np.interp(np.linspace(0.0, integral[-1], math.ceil(integral[-1]) + 1), integral, s)
    stations = np.interp(np.arange(2 * len(corners) - 1) / 2, np.arange(len(corners)), corners)
    depths = end - stations / gear.tip_radius
    points = gear.tip_radius * np.column_stack([np.cos(depths), np.sin(depths)])
    if abs(angle[0]) < abs(angle[-1]):
        points = points[::-1]
    points[0], points[-1] = tip[0], tip[-1]
    return points
