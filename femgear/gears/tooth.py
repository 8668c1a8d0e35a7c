"""Exact outline of one half of one tooth sector, with labelled parts and graded points."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, cutter_of, flank_points, half_thickness_angle

# point spacing in modules, before `refine`: about 1200 triangles in the half sector of the reference sun
FILLET_SIZE = 0.05
FINEST_SIZE = 0.02
INNER_SIZE = 0.1
LARGEST_SIZE = 0.5
RIM_SHARE = 0.35  # of the width of the half sector
NEAR = 12.0  # modules from the root circle; elements beyond grow with the distance
FAR_SHARE = 1.0  # of the same width, far from the teeth
MOST_CUT_NODES = 400  # the dense matrices of a sector have twice as many rows
SHORTEST_ROOT = 0.025
SHARP_RADIUS = 0.2  # fillets that turn more sharply have smaller elements
SHARP_SIZE = 0.15  # of their radius of curvature: within 1.5 % of the stress on finer grids
SHARPEST_SIZE = 0.002  # however sharp they are
ROOT_RADIUS_LIMIT = SHARPEST_SIZE / SHARP_SIZE
"""Radius of curvature of a root [modules] below which elements do not follow it."""
_MODULE, _DIGITS = 1e-3, 11
"""Module [m] of the gears whose outlines are made, and digits of what their tools depend on, in modules."""
GROWTH = 0.11  # increase of the spacing per unit length along a curve


@dataclass(frozen=True)
class HalfSector:
    """Half (y >= 0) of one tooth sector, 0 <= angle <= pi/z, tooth centreline on the x axis.

    Parameters
    ----------
    curves : tuple of (str, (2 k + 1, 2) array)
        Closed boundary, counter-clockwise: vertices in even rows, mid-side points in odd rows, all on the
        true curves [m]; consecutive curves share end points exactly. Names: "symmetry" (x axis), "tip" (arc),
        "flank" (involute), "fillet" (generated), "root" (arc; absent when the fillets meet), "cut" (radial
        line at pi/z) and "rim" (arc at the rim radius).
    interfaces : tuple of (str, (2 k + 1, 2) array)
        "tooth_base": arc from the symmetry line to the fillet that splits tooth and body. It ends where
        the fillet stands at 45 deg to the arc; an arc on the root circle itself would touch the fillet at
        zero angle.
    regions : tuple of (str, (float, float))
        A point [m] inside each of "tooth" and "body".
    flank_roll : (2 n + 1,) array
        Roll lengths [m] of the rows of "flank", uniform (tip to fillet of an external, fillet to tip of an
        internal gear).
    """

    curves: tuple[tuple[str, np.ndarray], ...]
    interfaces: tuple[tuple[str, np.ndarray], ...]
    regions: tuple[tuple[str, tuple[float, float]], ...]
    flank_roll: np.ndarray

    def curve(self, name: str) -> np.ndarray:
        """Find the points (2 k + 1, 2) [m] of one boundary curve by name (KeyError when it is absent)."""
        return dict(self.curves)[name]


def half_sector(gear: Gear, *, flank_elements: int = 24, refine: float = 1.0) -> HalfSector:
    """Make the boundary of the half sector of a gear, graded from flank and fillet to the rim.

    Parameters
    ----------
    flank_elements : int
        Element edges along the flank, 2 or more, uniform in roll angle, before `refine`.
    refine : float
        Divides every spacing, that of the flank included; positive.

    Raises
    ------
    GeometryError
        A body so deep that more than 400 nodes, times `refine`, would lie on a cut (E-GRID).
    """
    scale, size = gear.module / _MODULE, (flank_elements, refine)
    try:
        curves, interfaces, regions = _outline(_of_one_module(gear), *size)
    except GeometryError:
        _outline(gear, *size)  # refuses its own lengths
        raise
    curves, interfaces = (
        tuple((name, _read_only(scale * points)) for name, points in named_points)
        for named_points in (curves, interfaces)
    )
    rolls = _flank_rolls(gear, *size)[:: -1 if gear.internal else 1]
    inside = tuple((name, (scale * x, scale * y)) for name, (x, y) in regions)
    return HalfSector(curves, interfaces, inside, _read_only(rolls))


def _of_one_module(gear: Gear) -> Gear:
    """Make the similar gear of the module `_MODULE`, with a tool of few digits.

    The spacing of points follows the curvature of a finely sampled fillet, which makes more of rounding;
    triangles that are equally good are then others in a gear of another size. Fillets of gears that differ by
    rounding alone are here the same.
    """
    given: dict[str, Any] = {"profile_shift": round(gear.profile_shift, _DIGITS)}
    for name in ("root_diameter", "thickness_allowance", "rim_radius", "tip_diameter", "tip_shortening"):
        if (value := getattr(gear, name)) is not None:
            modules = value / gear.module
            of_tool = name in ("root_diameter", "thickness_allowance")
            given[name] = _MODULE * (round(modules, _DIGITS) if of_tool else modules)
    cutter = cutter_of(gear) if gear.internal else gear.cutter
    # its tip has been checked
    return replace(gear, module=_MODULE, cutter=cutter, tip_open=True, **given)


def _outline(gear: Gear, flank_elements: int, refine: float) -> tuple[tuple, tuple, tuple]:
    """Make curves, interfaces and regions of the half sector of this very gear, see `HalfSector`."""
    sizes = _Sizes(unit=gear.module / refine, growth=GROWTH / refine)
    rolls = _flank_rolls(gear, flank_elements, refine)
    flank = flank_points(gear, rolls)
    fillet, split = _fillet(gear, flank, rolls[-1], sizes)
    root = _root(gear, fillet, sizes)
    tip = _arc_to(flank[0], gear.tip_radius, _last_edge(flank[::-1]), sizes)
    base = _arc_to(fillet[split], math.hypot(*fillet[split]), FILLET_SIZE * sizes.unit, sizes)
    last = _last_edge(root if root is not None else fillet)
    cut = _cut(gear, sizes, start=last)
    rim = _rim(gear, sizes)
    symmetry = _symmetry(gear, base[0, 0], sizes, tip=_last_edge(tip[::-1]), base=_last_edge(base[::-1]))
    parts = [("symmetry", symmetry), ("tip", tip), ("flank", flank), ("fillet", fillet)]
    parts += ([] if root is None else [("root", root)]) + [("cut", cut), ("rim", rim)]
    if gear.internal:  # built as if the tooth pointed outwards; that of an internal gear runs the other way
        parts = [(name, points[::-1]) for name, points in reversed(parts)]
    joined = []
    for i, (name, points) in enumerate(parts):
        # consecutive curves have the very same end points
        points = np.vstack([parts[i - 1][1][-1:], points[1:]])
        joined.append((name, points))
    inside = _inside(gear, fillet[split])
    return tuple(joined), (("tooth_base", base),), inside


def _flank_rolls(gear: Gear, flank_elements: int, refine: float) -> np.ndarray:
    """Roll lengths (2 n + 1,) of the flank's points from the tip to the fillet [m]."""
    count = max(2, round(flank_elements * refine))
    # steps uniform in roll angle shrink to nothing at the base circle (edge length roll^2 / (2 rb)) and mid
    # points drift to the quarter point there: the last micrometres of the involute belong to the fillet
    end = max(gear.form_roll, gear.tip_roll / (count + 1))
    return np.linspace(gear.tip_roll, end, 2 * count + 1)


@dataclass(frozen=True)
class _Sizes:
    """Sizes of a grid: ``unit`` of them all, the refined module [m], and ``growth`` of the spacing per length [1]."""

    unit: float
    growth: float

    def spacing(
        self, length: float, start: float, end: float, *, largest: float | Callable[[np.ndarray], np.ndarray]
    ) -> np.ndarray:
        """Positions (2 k + 1,) in 0 .. 1 of vertices and mid points; edges grow from both ends (sizes in m).

        `largest` is a size or a function that gives it at distances from the start. The number of edges is
        the integral of 1/size; the vertices divide that integral equally.
        """
        s = np.linspace(0.0, length, 2001)
        grown = np.minimum(start + self.growth * s, end + self.growth * (length - s))
        density = 1.0 / np.minimum(grown, largest(s) if callable(largest) else largest)
        integral = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s))])
        count = max(1, math.ceil(integral[-1] - 0.2))
        vertices = np.interp(np.linspace(0.0, integral[-1], count + 1), integral, s) / length
        vertices[0], vertices[-1] = 0.0, 1.0
        out = np.empty(2 * count + 1)
        out[0::2] = vertices
        out[1::2] = 0.5 * (vertices[1:] + vertices[:-1])
        return out


def _arc(radius: float, start: float, end: float, fractions: np.ndarray) -> np.ndarray:
    """Points (n, 2) [m] of an arc about the origin at fractions (n,) of the way between two angles [rad]."""
    angle = start + (end - start) * fractions
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def _last_edge(points: np.ndarray) -> float:
    """Length [m] of the last element edge of a curve."""
    return math.dist(points[-3], points[-1])


def _fillet(gear: Gear, flank: np.ndarray, end_roll: float, sizes: _Sizes) -> tuple[np.ndarray, int]:
    """Fillet from the flank's end to the root circle, spaced by arc length; row where the tooth base ends.

    Bits of involute or root arc that are too short for an edge of their own belong to it, and the root arc
    belongs to a fillet that is.
    """
    corner = float(gear.tool.fillet_point(0.0)[1])
    land = math.pi / gear.teeth - corner

    def point(p):
        # p in -1 .. 0: rest of the involute, 0 .. 1: generated fillet, 1 .. 2: short root arc
        radius, angle = gear.tool.fillet_point(gear.fillet_end * (1.0 - np.clip(p, 0.0, 1.0)))
        angle = np.where(p > 1.0, corner + land * (p - 1.0), angle)
        generated = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
        involute = flank_points(gear, gear.form_roll + (end_roll - gear.form_roll) * np.maximum(-p, 0.0))
        return np.where(p[:, None] < 0.0, involute, generated)

    p = np.linspace(0.0, 1.0, 2001)
    short = np.linalg.norm(np.diff(point(p[[0, -1]]), axis=0)) < SHORTEST_ROOT * gear.module
    if short:
        p = np.array([0.0, 0.5, 1.0])
    if end_roll > gear.form_roll:
        p = np.concatenate([np.linspace(-1.0, 0.0, 200, endpoint=False), p])
    if short or land * gear.root_radius < SHORTEST_ROOT * gear.module:
        p = np.concatenate([p, np.linspace(1.0, 2.0, 500 if short else 20)[1:]])
    dense = point(p)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1))])
    corner_rows = (p >= 0.0) & (p <= 1.0) & short
    # a corner needs a vertex, that of the flank's end where no involute belongs to the fillet
    split = length[int(corner_rows.argmax()) if short else _base_row(dense)]
    size = FILLET_SIZE * sizes.unit
    sharp = _sharp_sizes(dense, length, gear, sizes, corner_rows)
    start = min(max(_last_edge(flank), FINEST_SIZE * sizes.unit), size)
    upper = np.zeros(1)
    if split > 0.0:
        upper = split * sizes.spacing(split, start, size, largest=lambda s: np.interp(s, length, sharp))
    lower = split + (length[-1] - split) * sizes.spacing(
        length[-1] - split, size, size, largest=lambda s: np.interp(split + s, length, sharp)
    )
    points = point(np.interp(np.concatenate([upper, lower[1:]]), length, p))
    points[0] = flank[-1]
    return points, len(upper) - 1


def _sharp_sizes(points: np.ndarray, length: np.ndarray, gear: Gear, sizes: _Sizes, corner: np.ndarray) -> np.ndarray:
    """Largest element sizes (n,) [m] along a finely sampled fillet, small where it turns sharply.

    ``corner`` (n,) are the rows of a fillet so short that it is a corner.
    """
    radius = notch_radius(gear, points) / gear.module
    finest = np.where(radius < SHARP_RADIUS * (1.0 - 1e-6), SHARP_SIZE * radius, FILLET_SIZE)
    finest[corner] = SHARPEST_SIZE
    size = np.clip(finest, SHARPEST_SIZE, FILLET_SIZE) * sizes.unit
    for order in (slice(None), slice(None, None, -1)):
        way = np.abs(length[order] - length[order][0])
        # the smallest of size(s') + growth |s - s'| over the points behind
        size[order] = way * sizes.growth + np.minimum.accumulate(size[order] - way * sizes.growth)
    return size


def notch_radius(gear: Gear, points: np.ndarray) -> np.ndarray:
    """Compute the radius of curvature (n,) [m] of a finely sampled fillet (n, 2) [m] from flank to root.

    Infinite where the outline is convex, as flanks are beside the base circle: stresses are small there.
    """
    step = np.diff(points @ np.array([1.0, 1j]))
    turn = np.angle(step[1:] / step[:-1]) * (1.0 if gear.internal else -1.0)
    radius = np.full(len(points), np.inf)
    length = 0.5 * (np.abs(step[1:]) + np.abs(step[:-1]))
    radius[1:-1] = np.divide(length, turn, out=radius[1:-1], where=turn > 1e-12)
    radius[0], radius[-1] = radius[1], radius[-2]
    return radius


def root_notches(gear: Gear) -> tuple[np.ndarray, float]:
    """Find where the root of a left flank turns more sharply than elements can follow, and how sharply.

    Returns
    -------
    notches : (k, 2) array
        Points in the tooth frame [m], beside which stresses have no limit or depend on the grid.
    radius : float
        Smallest radius of curvature of flank end, fillet and root arc [m]; corners are rounded over a fifth
        of `ROOT_RADIUS_LIMIT`.
    """
    limit = ROOT_RADIUS_LIMIT * gear.module
    step = 0.2 * limit
    inner, outer = gear.form_roll, gear.tip_roll
    beside = inner + math.copysign(min(0.1 * gear.module, 0.5 * abs(outer - inner)), outer - inner)
    corner = float(gear.tool.fillet_point(0.0)[1])
    radius, angle = gear.tool.fillet_point(gear.fillet_end * np.linspace(1.0, 0.0, 4001))
    parts = (
        flank_points(gear, np.linspace(beside, inner, 200)),
        np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]),
        _arc(gear.root_radius, corner, max(corner, math.pi / gear.teeth), np.linspace(0.0, 1.0, 200)),
    )
    points = np.vstack(parts)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    # equal steps: what is shorter than one counts as a corner
    even = np.linspace(0.0, length[-1], max(8, math.ceil(length[-1] / step)))
    points = np.column_stack([np.interp(even, length, column) for column in points.T])
    radius_there = notch_radius(gear, points)
    return points[radius_there < limit], float(radius_there.min())


def _base_row(points: np.ndarray) -> int:
    """Row of a finely sampled fillet, first from the root, at 45 deg to the circles; else its middle."""
    tangent = points[2:] - points[:-2]
    radial = points[1:-1] / np.linalg.norm(points[1:-1], axis=1)[:, None]
    slope = np.abs(np.sum(tangent * radial, axis=1)) / np.linalg.norm(tangent, axis=1)
    steep = np.flatnonzero(slope >= math.sqrt(0.5))
    return 1 + int(steep[-1]) if len(steep) else len(points) // 2


def _root(gear: Gear, fillet: np.ndarray, sizes: _Sizes) -> np.ndarray | None:
    """Root arc from the fillet to the cut, absent when the fillet reaches it."""
    start, end = math.atan2(fillet[-1, 1], fillet[-1, 0]), math.pi / gear.teeth
    length = gear.root_radius * (end - start)
    if length < 0.5 * SHORTEST_ROOT * gear.module:
        return None
    edge, largest = _last_edge(fillet), INNER_SIZE * sizes.unit
    far = max(2.0 * edge, FILLET_SIZE * sizes.unit)
    points = _arc(gear.root_radius, start, end, sizes.spacing(length, edge, far, largest=largest))
    points[0] = fillet[-1]
    return points


def _arc_to(end: np.ndarray, radius: float, size: float, sizes: _Sizes) -> np.ndarray:
    """Arc about the gear centre from the symmetry line to a point, with the size [m] of its last edge."""
    angle, largest = math.atan2(end[1], end[0]), INNER_SIZE * sizes.unit
    spacing = sizes.spacing(radius * angle, largest, size, largest=largest)
    points = _arc(radius, 0.0, angle, spacing)
    points[0, 1] = 0.0
    points[-1] = end
    return points


def _far_size(gear: Gear, sizes: _Sizes, distance) -> np.ndarray:
    """Largest element size [m] at distances [m] from the root circle towards the rim.

    Strains that differ from tooth to tooth die out within a pitch, so that far away elements may grow, up to
    a share of the width of the half sector: their number then grows with the logarithm of the radius only.
    """
    beyond = np.maximum(np.asarray(distance) / gear.module - NEAR, 0.0)
    share = np.minimum(RIM_SHARE * (1.0 + GROWTH * beyond), FAR_SHARE)
    radius = gear.root_radius + np.asarray(distance) * math.copysign(1.0, gear.rim_radius - gear.root_radius)
    width = share * math.pi / gear.teeth * radius / gear.module
    return np.minimum(LARGEST_SIZE + GROWTH * beyond, width) * sizes.unit


def _rim_size(gear: Gear, sizes: _Sizes) -> float:
    """Element size at the rim [m]."""
    return float(_far_size(gear, sizes, abs(gear.rim_radius - gear.root_radius)))


def _cut(gear: Gear, sizes: _Sizes, *, start: float) -> np.ndarray:
    """Radial line at pi/z from the root circle to the rim."""
    length, size = abs(gear.root_radius - gear.rim_radius), _rim_size(gear, sizes)

    def largest(s):
        return np.maximum(_far_size(gear, sizes, s), LARGEST_SIZE * sizes.unit)

    fractions = sizes.spacing(length, min(start, size), size, largest=largest)
    _check_cost(gear, len(fractions), sizes)
    radius = gear.root_radius + (gear.rim_radius - gear.root_radius) * fractions
    radius[-1] = gear.rim_radius
    angle = math.pi / gear.teeth
    return np.column_stack([radius * math.cos(angle), radius * math.sin(angle)])


def _check_cost(gear: Gear, cut_nodes: int, sizes: _Sizes) -> None:
    """Refuse a body so deep that its sector could not be condensed in reasonable time and memory."""
    limit = round(MOST_CUT_NODES * max(1.0, gear.module / sizes.unit))
    if cut_nodes <= limit:
        return
    word, size = ("outer", "smaller") if gear.internal else ("bore", "larger")
    raise GeometryError(
        f"the body of the {gear.name} reaches from {1e3 * gear.root_radius:.6g} mm to "
        f"{1e3 * gear.rim_radius:.6g} mm: its sector would have {cut_nodes} nodes on each cut",
        code="E-GRID",
        key=f"{gear.name}.{word}_radius",
        limit=f"at most {limit} nodes",
        remedy=f"give a {size} {word} radius: material this far from the teeth hardly moves",
    )


def _rim(gear: Gear, sizes: _Sizes) -> np.ndarray:
    """Rim arc from the cut to the symmetry line."""
    angle = math.pi / gear.teeth
    count = max(1, math.ceil(angle * gear.rim_radius / _rim_size(gear, sizes) - 1e-9))
    points = _arc(gear.rim_radius, angle, 0.0, np.linspace(0.0, 1.0, 2 * count + 1))
    points[-1, 1] = 0.0
    return points


def _symmetry(gear: Gear, base_radius: float, sizes: _Sizes, *, tip: float, base: float) -> np.ndarray:
    """Line on the x axis from the rim to the tip with a vertex where the tooth base begins."""
    rim, top = gear.rim_radius, gear.tip_radius
    depth = abs(gear.root_radius - rim)

    def largest(s):
        return np.maximum(_far_size(gear, sizes, np.maximum(depth - s, 0.0)), LARGEST_SIZE * sizes.unit)

    inner = sizes.spacing(abs(base_radius - rim), _rim_size(gear, sizes), base, largest=largest)
    outer = sizes.spacing(abs(top - base_radius), base, tip, largest=INNER_SIZE * sizes.unit)
    x = np.concatenate([rim + (base_radius - rim) * inner, (base_radius + (top - base_radius) * outer)[1:]])
    x[0], x[len(inner) - 1], x[-1] = rim, base_radius, top
    return np.column_stack([x, np.zeros_like(x)])


def _inside(gear: Gear, split: np.ndarray) -> tuple[tuple[str, tuple[float, float]], ...]:
    """A point of the tooth and one of the body, both near the symmetry line."""
    base = math.hypot(*split)
    middle, below = 0.5 * (gear.tip_radius + base), 0.5 * (gear.rim_radius + base)
    angle = 0.5 * math.pi / gear.teeth
    lateral = 0.25 * min(middle * angle, float(gear.tip_radius * half_thickness_angle(gear, gear.tip_radius)))
    return (("tooth", (middle, lateral)), ("body", (below * math.cos(angle), below * math.sin(angle))))


def _read_only(array: np.ndarray) -> np.ndarray:
    """The array in one piece that cannot be changed."""
    out = np.ascontiguousarray(array)
    out.setflags(write=False)
    return out
