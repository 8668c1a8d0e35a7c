"""Outlines of plane bodies: the data, the checks before meshing, and the faces that interfaces make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import GridError

CLOSE = 1e-9  # points nearer than this share of the size of the outline count as the same
MAX_SEGMENTS = 5_000


@dataclass(frozen=True)
class Outline:
    """Closed counter-clockwise boundary of a plane body, as named curves of exact points.

    Parameters
    ----------
    curves : tuple of (name, (2k + 1, 2) array)
        Points [m]: even rows are element corners, odd rows mid-side nodes. Each curve starts where the
        one before ends.
    interfaces : tuple of (name, (2k + 1, 2) array)
        Inner curves that split the body; their ends are corners of other curves.
    regions : tuple of (name, (x, y))
        A point [m] inside each part that the interfaces make; may be empty for an undivided body,
        which is then called ``"body"``.
    """

    curves: tuple[tuple[str, np.ndarray], ...]
    interfaces: tuple[tuple[str, np.ndarray], ...] = ()
    regions: tuple[tuple[str, tuple[float, float]], ...] = ()


@dataclass(frozen=True)
class Plan:
    """A checked outline, ready for a mesh generator.

    ``points`` (n, 2) corners; ``segments`` (s, 2) corner numbers, the boundary first and
    counter-clockwise; ``mids`` (s, 2) their mid-side points; ``names`` (s,) curve of each segment;
    ``loops``: each face as its segments counter-clockwise, numbered from 1, negative when reversed;
    ``faces``: the name of each face.
    """

    points: np.ndarray
    segments: np.ndarray
    mids: np.ndarray
    names: tuple[str, ...]
    n_boundary: int
    loops: tuple[np.ndarray, ...]
    faces: tuple[str, ...]

    @property
    def size(self) -> float:
        """Larger side of the bounding box [m]."""
        return float(np.ptp(self.points, axis=0).max())


def check_outline(outline) -> Plan:
    """Check an outline and find the faces into which its interfaces split it.

    Parameters
    ----------
    outline : Outline
        Or any object with the same fields.

    Raises
    ------
    GridError
        ``E-GRID``, ``-SHAPE``, ``-OPEN``, ``-CLOSE-POINTS``, ``-CROSSING``, ``-AREA``, ``-CLOCKWISE``,
        ``-INTERFACE``, ``-REGION`` or ``-COUNT``, with the coordinates of what is wrong.
    """
    curves = [(name, _curve(name, points)) for name, points in outline.curves]
    inner = [(name, _curve(name, points)) for name, points in outline.interfaces]
    if not curves:
        raise GridError("the outline has no curves", code="E-GRID")
    every = np.vstack([points for _, points in curves])
    size = np.ptp(every, axis=0).max()
    if not size > 0:
        raise GridError("all points of the outline coincide", code="E-GRID")
    _check_closed(curves, size)
    points, segments, mids, names = _join(curves, inner, size)
    n_boundary = sum(len(p) // 2 for _, p in curves)
    if len(segments) > MAX_SEGMENTS:
        raise GridError(
            f"the outline has {len(segments)} segments", code="E-GRID", limit=f"at most {MAX_SEGMENTS}"
        )
    _check_distinct(points, size)
    _check_crossing(points, segments, names, size)
    area = _check_area(points[segments[:n_boundary, 0]], size)
    loops = _faces(points, segments, n_boundary, area, names)
    faces = _name_faces(points, segments, loops, tuple(outline.regions))
    return Plan(points, segments, mids, names, n_boundary, loops, faces)


def _curve(name, points):
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3 or len(points) % 2 == 0:
        raise GridError(
            f"the curve {name!r} is an array of shape {points.shape}",
            code="E-GRID",
            key=name,
            limit="(2k + 1, 2) with k >= 1: corners at even rows, mid-side points at odd rows",
        )
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise GridError(
            f"point {bad[0]} of the curve {name!r} is ({points[bad[0], 0]}, {points[bad[0], 1]})",
            code="E-GRID",
            key=name,
            limit="finite coordinates",
        )
    return points


def _check_closed(curves, size):
    for (name, points), (following, after) in zip(curves, curves[1:] + curves[:1]):
        gap = np.abs(points[-1] - after[0]).max()
        if gap > CLOSE * size:
            raise GridError(
                f"the curve {name!r} ends {gap:.3e} m from the start of {following!r}",
                code="E-GRID",
                limit="each curve starts where the one before ends, the first where the last ends",
            )


def _join(curves, inner, size):
    corners = [points[0:-1:2] for _, points in curves]
    points = np.vstack(corners)
    number = np.arange(len(points))
    segments = [np.stack([number, np.roll(number, -1)], axis=1)]
    mids = [p[1::2] for _, p in curves + inner]
    names = [name for name, p in curves + inner for _ in range(len(p) // 2)]
    for name, curve in inner:
        chain = []
        for i, corner in enumerate(curve[0::2]):
            distance = np.abs(points - corner).max(axis=1)
            nearest = int(distance.argmin())
            if distance[nearest] > CLOSE * size:
                if i in (0, len(curve) // 2):
                    raise GridError(
                        f"the interface {name!r} ends at ({corner[0]:.9g}, {corner[1]:.9g}) m, "
                        f"{distance[nearest]:.3e} m from the nearest corner",
                        code="E-GRID",
                        key=name,
                    )
                nearest = len(points)
                points = np.vstack([points, corner])
            chain.append(nearest)
        segments.append(np.stack([chain[:-1], chain[1:]], axis=1))
    return points, np.vstack(segments), np.vstack(mids), tuple(names)


def _check_distinct(points, size):
    from scipy.spatial import KDTree

    pairs = KDTree(points).query_pairs(CLOSE * size, output_type="ndarray")
    if len(pairs):
        a, b = points[pairs[0]]
        raise GridError(
            f"{len(pairs)} pairs of corners coincide, the first at ({a[0]:.9g}, {a[1]:.9g}) m, "
            f"{np.hypot(*(a - b)):.3e} m apart",
            code="E-GRID",
            limit=f"at least {CLOSE * size:.3e} m between any two corners",
        )


def _check_crossing(points, segments, names, size):
    """Every pair of segments, by the signs of the triangles their ends make; touching counts too."""
    a, b = points[segments[:, 0]], points[segments[:, 1]]
    low, high = np.minimum(a, b) - CLOSE * size, np.maximum(a, b) + CLOSE * size
    for first in range(0, len(segments), 256):
        rows = np.arange(first, min(first + 256, len(segments)))
        near = (low[rows, None] <= high[None]).all(axis=2) & (low[None] <= high[rows, None]).all(axis=2)
        i, j = np.nonzero(near)
        i = rows[i]
        i, j = i[i < j], j[i < j]
        shared = (segments[i][:, :, None] == segments[j][:, None, :]).any(axis=(1, 2))
        sides = [_side(a[i], b[i], a[j], size), _side(a[i], b[i], b[j], size)]
        sides += [_side(a[j], b[j], a[i], size), _side(a[j], b[j], b[i], size)]
        crossing = (sides[0] * sides[1] <= 0) & (sides[2] * sides[3] <= 0)
        # neighbours always touch at their common corner: they overlap only when all is in line
        along = ((b[i] - a[i]) * (b[j] - a[j])).sum(axis=1)
        same_end = (segments[i, 0] == segments[j, 0]) | (segments[i, 1] == segments[j, 1])
        flat = (np.abs(sides).sum(axis=0) == 0) & (np.where(same_end, along, -along) > 0)
        hit = np.flatnonzero(np.where(shared, flat, crossing))
        if len(hit):
            p, q = i[hit[0]], j[hit[0]]
            x, y = 0.25 * (a[p] + b[p] + a[q] + b[q])
            raise GridError(
                f"the outline crosses or touches itself: {names[p]!r} and {names[q]!r} near "
                f"({x:.9g}, {y:.9g}) m",
                code="E-GRID",
            )


def _side(a, b, c, size):
    """+1, 0, -1: the point c lies left of, on (within tolerance) or right of the line through a and b."""
    d = b - a
    cross = d[:, 0] * (c[:, 1] - a[:, 1]) - d[:, 1] * (c[:, 0] - a[:, 0])
    return np.where(np.abs(cross) <= CLOSE * size * np.hypot(d[:, 0], d[:, 1]), 0, np.sign(cross))


def _check_area(polygon, size):
    area = _area(polygon)
    if abs(area) < 1e-6 * size**2:
        raise GridError(
            f"the outline encloses an area of {area:.3e} m^2 in a box {size:.3e} m wide: a slit",
            code="E-GRID",
        )
    if area < 0:
        raise GridError(
            "the outline runs clockwise",
            code="E-GRID",
            limit="counter-clockwise, the body on the left",
            remedy="reverse the order of the curves and of the points of each",
        )
    return area


def _area(polygon):
    x, y = (polygon - polygon.mean(axis=0)).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _faces(points, segments, n_boundary, area, names):
    """Bounded faces of the planar graph; half-edge 2s runs along segment s, 2s + 1 against it."""
    start = segments.ravel()
    end = segments[:, ::-1].ravel()
    direction = points[end] - points[start]
    angle = np.arctan2(direction[:, 1], direction[:, 0])
    order = np.lexsort((angle, start))
    # cyclic predecessor, by angle, among the half-edges that leave the same corner
    group_first = np.searchsorted(start[order], start[order], side="left")
    group_last = np.searchsorted(start[order], start[order], side="right") - 1
    position = np.arange(len(order))
    before = np.where(position == group_first, group_last, position - 1)
    clockwise = np.empty(len(order), dtype=int)
    clockwise[order] = order[before]
    following = clockwise[np.arange(len(start)) ^ 1]
    owner = np.full(len(start), -1)
    loops = []
    for first in range(len(start)):
        if owner[first] >= 0:
            continue
        loop, edge = [], first
        while owner[edge] < 0:
            owner[edge] = len(loops)
            loop.append(edge)
            edge = following[edge]
        loops.append(np.array(loop))
    dangling = np.flatnonzero(owner[0::2] == owner[1::2])
    if len(dangling):
        raise GridError(
            f"the interface {names[dangling[0]]!r} does not separate two parts of the body",
            code="E-GRID",
            key=names[dangling[0]],
        )
    inside = [loop for loop in loops if _area(points[start[loop]]) > 0]
    total = sum(_area(points[start[loop]]) for loop in inside)
    if abs(total - area) > 1e-9 * area:
        raise GridError(
            f"the interfaces do not divide the body: the parts add up to {total / area:.6f} of its area",
            code="E-GRID",
            limit="interfaces inside the body that start and end on its boundary",
        )
    return tuple(np.where(loop % 2 == 0, loop // 2 + 1, -(loop // 2 + 1)) for loop in inside)


def _name_faces(points, segments, loops, regions):
    if not regions and len(loops) == 1:
        return ("body",)
    faces = [""] * len(loops)
    for region, inside in regions:
        at = np.array(inside, dtype=float).reshape(1, 2)
        holders = [k for k, loop in enumerate(loops) if _contains(points, segments[np.abs(loop) - 1], at)[0]]
        if len(holders) != 1 or faces[holders[0]]:
            where = "outside the body" if not holders else f"in the region {faces[holders[0]]!r}"
            raise GridError(
                f"the point ({at[0, 0]:.9g}, {at[0, 1]:.9g}) m of the region {region!r} lies {where}",
                code="E-GRID",
                key=region,
            )
        faces[holders[0]] = region
    if "" in faces or len(set(faces)) != len(faces):
        raise GridError(
            f"the interfaces make {len(loops)} parts, the regions {[r for r, _ in regions]} name "
            f"{len(set(faces) - {''})} of them",
            code="E-GRID",
            remedy="give Outline.regions one entry for each part",
        )
    return tuple(faces)


def _contains(points, segments, samples):
    """Which of the samples (m, 2) lie inside the closed polygon of segments: even-odd rule."""
    a, b = points[segments[:, 0]], points[segments[:, 1]]
    x, y = samples[:, 0, None], samples[:, 1, None]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    beyond = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise > x
    return np.count_nonzero(spans & beyond, axis=1) % 2 == 1


def estimate_elements(plan: Plan) -> float:
    """Rough number of triangles of a checked outline, before it is meshed.

    The area divided by that of an equilateral triangle of the local size, which is the mean length of
    the segments weighted with their length over their squared distance.
    """
    a, b = plan.points[plan.segments[:, 0]], plan.points[plan.segments[:, 1]]
    middle, length = 0.5 * (a + b), np.hypot(*(b - a).T)
    low, high = plan.points.min(axis=0), plan.points.max(axis=0)
    step = (high - low) / 48
    axes = [lo + h * (np.arange(48) + 0.5) for lo, h in zip(low, step)]
    samples = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    count = 0.0
    for block in np.array_split(samples, 1 + len(samples) * len(length) // 2_000_000):
        block = block[_contains(plan.points, plan.segments[: plan.n_boundary], block)]
        weight = length / (((block[:, None] - middle) ** 2).sum(axis=2) + 0.25 * length**2)
        size = (weight * length).sum(axis=1) / weight.sum(axis=1)
        count += float(np.sum(np.prod(step) / (0.25 * np.sqrt(3) * size**2)))
    return count + len(length)
