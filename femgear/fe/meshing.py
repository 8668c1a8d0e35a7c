"""From the outline of a plane body, checked, to its second-order grid by Gmsh.

Gmsh runs in a process that can be killed; results are cached by content.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from pathlib import Path

import numpy as np

from femgear.errors import GridError, StorageError
from femgear.fe.grid import Grid, check_grid, read_grid, write_grid
from femgear.findings import remark, tell

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

    Parameters
    ----------
    points : (n, 2) array
        Corners [m].
    segments : (s, 2) int array
        Their corner numbers, those of the boundary first and counter-clockwise.
    mids : (s, 2) array
        Their mid-side points [m].
    names : (s,) tuple of str
        Curve of each segment.
    n_boundary : int
        Segments of the boundary.
    loops : tuple of int arrays
        Segments of each part counter-clockwise, numbered from 1, negative when reversed.
    faces : tuple of str
        Names of the parts.
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
    """Check an `Outline`, or any object with its fields; find the parts into which its interfaces split it.

    GridError: E-GRID: points that are not finite or coincide, curves that cross, no area, a clockwise
    boundary, interfaces that do not divide the body, or too many segments.
    """
    curves = [(name, _curve(name, points)) for name, points in outline.curves]
    inner = [(name, _curve(name, points)) for name, points in outline.interfaces]
    every = np.vstack([points for _, points in curves])
    size = np.ptp(every, axis=0).max()
    if not size > 0:
        raise GridError("all points of the outline coincide", code="E-GRID", remedy="give points that enclose an area")
    points, segments, mids, names = _join(curves, inner, size)
    n_boundary = sum(len(p) // 2 for _, p in curves)
    if len(segments) > MAX_SEGMENTS:
        raise GridError(
            f"the outline has {len(segments)} segments",
            code="E-GRID",
            limit=f"at most {MAX_SEGMENTS}",
            remedy="use fewer points along the outline",
        )
    _check_distinct(points, size)
    _check_crossing(points, segments, names, size)
    _check_area(points[segments[:n_boundary, 0]], size)
    loops = _faces(segments, n_boundary, inner)
    faces = _name_faces(points, segments, loops, tuple(outline.regions))
    return Plan(points, segments, mids, names, n_boundary, loops, faces)


def _curve(name, points):
    """Points of a curve as an array, refused where one is not finite."""
    points = np.asarray(points, dtype=float)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        x, y = points[bad[0]]
        message = f"point {bad[0]} of the curve {name!r} is ({x}, {y})"
        remedy = "give every point two plain numbers"
        raise GridError(message, code="E-GRID", key=name, limit="finite coordinates", remedy=remedy)
    return points


def _join(curves, inner, size):
    """Corners, segments, mid-side points and names of all curves; corners of interfaces join those there."""
    points = np.vstack([points[0:-1:2] for _, points in curves])
    number = np.arange(len(points))
    segments = [np.stack([number, np.roll(number, -1)], axis=1)]
    mids = [p[1::2] for _, p in curves + inner]
    names = [name for name, p in curves + inner for _ in range(len(p) // 2)]
    for _, curve in inner:
        chain = []
        for corner in curve[0::2]:
            distance = np.abs(points - corner).max(axis=1)
            nearest = int(distance.argmin())
            if distance[nearest] > CLOSE * size:
                nearest = len(points)
                points = np.vstack([points, corner])
            chain.append(nearest)
        segments.append(np.stack([chain[:-1], chain[1:]], axis=1))
    return points, np.vstack(segments), np.vstack(mids), tuple(names)


def _check_distinct(points, size):
    """Refuse corners that coincide."""
    order, pairs = np.argsort(points[:, 0], kind="stable"), np.zeros((0, 2), int)
    for after in range(1, len(points)):
        left, other = order[:-after], order[after:]
        near = points[other, 0] - points[left, 0] <= CLOSE * size
        if not near.any():  # nor are any further apart in this order
            break
        same = near & (np.hypot(*(points[left] - points[other]).T) <= CLOSE * size)
        pairs = np.concatenate([pairs, np.stack([left[same], other[same]], axis=1)])
    if len(pairs):
        a, b = points[np.sort(pairs[0])]
        raise GridError(
            f"{len(pairs)} pairs of corners coincide, the first at ({a[0]:.9g}, {a[1]:.9g}) m, "
            f"{np.hypot(*(a - b)):.3e} m apart",
            code="E-GRID",
            remedy="give every corner once",
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
                f"the outline crosses or touches itself: {names[p]!r} and {names[q]!r} near ({x:.9g}, {y:.9g}) m",
                code="E-GRID",
                remedy="give the points in their order along the outline; curves meet at their ends alone",
            )


def _side(a, b, c, size):
    """+1, 0, -1: the point c lies left of, on (within tolerance) or right of the line through a and b."""
    d = b - a
    cross = d[:, 0] * (c[:, 1] - a[:, 1]) - d[:, 1] * (c[:, 0] - a[:, 0])
    return np.where(np.abs(cross) <= CLOSE * size * np.hypot(d[:, 0], d[:, 1]), 0, np.sign(cross))


def _check_area(polygon, size):
    """Refuse a boundary without area, or one that runs clockwise."""
    x, y = (polygon - polygon.mean(axis=0)).T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    if abs(area) < 1e-6 * size**2:
        message = f"the outline encloses an area of {area:.3e} m^2 in a box {size:.3e} m wide: a slit"
        raise GridError(message, code="E-GRID", remedy="give an outline with a body inside")
    if area < 0:
        raise GridError(
            "the outline runs clockwise",
            code="E-GRID",
            limit="counter-clockwise, the body on the left",
            remedy="reverse the order of curves and points",
        )


def _faces(segments, n_boundary, inner):
    """Parts of the body as segments counter-clockwise, numbered from 1 and negative when reversed."""
    loops, used = [np.arange(1, n_boundary + 1)], n_boundary
    for name, curve in inner:
        chain = used + 1 + np.arange(len(curve) // 2)
        used = chain[-1]
        ends = segments[chain[0] - 1, 0], segments[chain[-1] - 1, 1]
        for number, loop in enumerate(loops):
            starts = np.where(loop > 0, segments[np.abs(loop) - 1, 0], segments[np.abs(loop) - 1, 1])
            if not np.isin(ends, starts).all():
                continue
            first, last = (int(np.flatnonzero(starts == end)[0]) for end in ends)
            if first > last:
                first, last, chain = last, first, -chain[::-1]
            loops[number] = np.concatenate([loop[:first], chain, loop[last:]])
            loops.append(np.concatenate([loop[first:last], -chain[::-1]]))
            break
        else:
            message = f"the interface {name!r} does not end at two corners of one part of the body"
            remedy = "end it at two corners of the boundary, or of an interface before it"
            raise GridError(message, code="E-GRID", key=name, remedy=remedy)
    return tuple(loops)


def _name_faces(points, segments, loops, regions):
    """Names of the parts, each by the one region whose point lies in it."""
    if not regions and len(loops) == 1:
        return ("body",)
    faces = []
    for loop in loops:
        loop_segments = segments[np.abs(loop) - 1]
        names = [name for name, point in regions if _contains(points, loop_segments, np.array([point]))[0]]
        if len(names) != 1:
            message = f"a part of the outline holds the points of the regions {names}"
            remedy = "give each part a region with a point inside it"
            raise GridError(message, code="E-GRID", limit="one region for each part", remedy=remedy)
        faces += names
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
        away = (block[:, None, 0] - middle[:, 0]) ** 2 + (block[:, None, 1] - middle[:, 1]) ** 2
        weight = length / (away + 0.25 * length**2)
        size = (weight * length).sum(axis=1) / weight.sum(axis=1)
        count += float(np.sum(np.prod(step) / (0.25 * np.sqrt(3) * size**2)))
    return count + len(length)


FORMAT = "1"  # raise when the way grids are made changes, so that cached ones are not reused
WORKER = Path(__file__).with_name("_gmsh_worker.py")
TIME_LIMIT = 60.0  # seconds after which the mesh generator is killed
MAX_ELEMENTS = 200_000  # outlines whose estimated number of elements is larger are refused
PACKAGES = {
    "libGLU": "libglu1-mesa",
    "libGL": "libgl1",
    "libXcursor": "libxcursor1",
    "libXft": "libxft2",
    "libXinerama": "libxinerama1",
    "libXrender": "libxrender1",
    "libgomp": "libgomp1",
}


def mesh_outline(outline, *, cache: Path | None = None) -> Grid:
    """Mesh an outline with six-node triangles whose edge nodes are exactly the points of the outline.

    Gmsh triangulates the polygon of corners (one element edge for each pair of neighbouring corners,
    sizes inside interpolated from the boundary); the mid-side nodes of boundary and interfaces are then
    put on the given points. The same outline gives the same grid.

    Parameters
    ----------
    outline : Outline
        Or any object with the same fields [m].
    cache : path, optional
        Folder in which grids are kept under the hash of their content; None to keep nothing. Where it cannot
        be written there is a warning; so for a file that is damaged or no grid of the outline, which is then
        made again.

    Returns
    -------
    Grid
        Boundaries and interfaces under the names of their curves, regions as `Outline` says.

    Raises
    ------
    GridError
        The outline is not usable, too large (E-GRID), not meshed in time, Gmsh or one of its system
        libraries is missing (E-GRID-GMSH), or an element is inverted (E-GRID).
    """
    plan = check_outline(outline)
    return _mesh_plan(plan) if cache is None else _mesh_cached(plan, Path(cache))


def _mesh_cached(plan: Plan, folder: Path) -> Grid:
    """The grid of a plan from the folder, or made and kept there."""
    path = folder / f"{_content_hash(plan)}.msh"
    if os.path.lexists(path):
        try:
            return _grid_of_plan(plan, read_grid(path), path)
        except StorageError as error:
            tell(remark(f"the grid is made again: {error.message}"))
    grid = _mesh_plan(plan)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_grid(path, grid)
    except (OSError, StorageError) as error:
        cause = error if isinstance(error, OSError) else error.__cause__
        reason = getattr(cause, "strerror", None) or cause or error
        reason = "no folder" if folder.exists() and not folder.is_dir() else reason
        tell(remark(f"grids are made but not kept: cannot write into {folder} ({reason})"))
    return grid


def _grid_of_plan(plan: Plan, triangulated: Grid, path: Path) -> Grid:
    """The grid of a plan from what a file holds, refused (E-GRID-FILE) where it is none of this plan."""
    try:
        corners, n = triangulated.triangles[:, :3], len(plan.points)
        used, face = np.unique(corners), np.full(len(corners), -1)
        for k, name in enumerate(plan.faces):
            face[triangulated.regions[name]] = k
        points = np.vstack([plan.points, triangulated.points[n : len(used)]])
        if used[0] != 0 or used[-1] != len(used) - 1 or len(used) < n or not np.isfinite(points).all():
            raise ValueError("it has other nodes")
        grid = _second_order(plan, points, corners, face)
        check_grid(grid)
        same = [
            np.array_equal(grid.points, triangulated.points),
            np.array_equal(grid.triangles, triangulated.triangles),
        ]
        for mine, other in ((grid.boundaries, triangulated.boundaries), (grid.regions, triangulated.regions)):
            same += [mine.keys() == other.keys(), *(np.array_equal(mine[key], other[key]) for key in mine)]
        if not all(same):
            raise ValueError("it has other points or boundaries")
        return grid
    except (GridError, KeyError, IndexError, ValueError) as error:
        raise StorageError(
            f"{path} is not a grid of this outline: {error!r}",
            code="E-GRID-FILE",
            remedy="delete the file; it is made again when needed",
        ) from error


def mesh_outlines(outlines, *, cache: Path | None = None) -> tuple[Grid, ...]:
    """Mesh several outlines at once, see `mesh_outline`, in as many processes as there are cores.

    GridError: the first error of any outline, after all processes have ended.
    """
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        return tuple(pool.map(lambda outline: mesh_outline(outline, cache=cache), outlines))


_version = lru_cache(metadata.version)


def _content_hash(plan: Plan) -> str:
    """Name of the grid in a cache: hash of the plan and of what makes the grid."""
    try:
        gmsh = _version("gmsh")
    except metadata.PackageNotFoundError as error:
        raise gmsh_missing("the package gmsh is not installed") from error
    digest = hashlib.sha256(f"femgear grid {FORMAT} gmsh {gmsh}".encode())
    for array in (plan.points, plan.segments, plan.mids, *plan.loops):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update("\0".join((*plan.names, "", *plan.faces)).encode())
    return digest.hexdigest()[:32]


def _mesh_plan(plan: Plan) -> Grid:
    """A new grid of a plan, checked; refused where it would have too many elements."""
    expected = estimate_elements(plan)
    if expected > MAX_ELEMENTS:
        raise GridError(
            f"the grid would have about {expected:.3g} elements",
            code="E-GRID",
            limit=f"at most {MAX_ELEMENTS}",
            remedy="use fewer points along the outline",
        )
    result = _run_gmsh(plan)
    points = np.vstack([plan.points, result["points"][len(plan.points) :]])
    grid = _second_order(plan, points, result["triangles"], result["face"])
    check_grid(grid)
    return grid


def _run_gmsh(plan: Plan) -> dict[str, np.ndarray]:
    """Points [m], triangles and their faces as the process of Gmsh returns them."""
    # Gmsh works with absolute tolerances: hand it an outline of unit size at the origin, with rounding
    # errors removed so that they do not decide between equally good triangulations
    centre, size = plan.points.mean(axis=0), plan.size
    unit = np.round((plan.points - centre) / size, 10)
    job = {
        "points": unit,
        "segments": plan.segments,
        "loops": np.concatenate(plan.loops),
        "loop_ends": np.cumsum([len(loop) for loop in plan.loops]),
        "time_limit": TIME_LIMIT,
    }
    # through pipes: no file is left behind, however this process ends
    source = io.BytesIO()
    np.savez(source, **job)
    command = [sys.executable, "-P", str(WORKER)]
    try:
        done = subprocess.run(command, input=source.getvalue(), timeout=TIME_LIMIT, capture_output=True)
    except subprocess.TimeoutExpired as error:
        raise GridError(
            f"Gmsh was stopped: no grid after {TIME_LIMIT:g} s",
            code="E-GRID-GMSH",
            remedy="use fewer points along the outline or a longer time limit",
        ) from error
    if done.returncode != 0 or not done.stdout:
        raise _worker_error(done)
    with np.load(io.BytesIO(done.stdout)) as file:
        result = dict(file)
    result["points"] = result["points"] * size + centre
    return result


def _worker_error(done):
    """Refusal with the last words of the process of Gmsh."""
    text = " ".join(done.stderr.decode(errors="replace").split())[-400:]
    if done.returncode == 3:
        return gmsh_missing(text)
    return GridError(
        f"Gmsh failed (exit code {done.returncode}): {text}",
        code="E-GRID-GMSH",
        remedy="try another static.flank_elements; if no grid can be made, install Gmsh anew",
    )


def gmsh_missing(text):
    """Refusal of a Gmsh that cannot be loaded, with the package to install."""
    library = re.search(r"(lib[A-Za-z]+)[-.\d]*\.so", text)
    remedy = "install it with: pip install gmsh"
    if library:
        package = PACKAGES.get(library.group(1), "libglu1-mesa libgl1")
        remedy = f"install the system library, on Debian: apt-get install {package}"
    return GridError(f"Gmsh cannot be loaded: {text}", code="E-GRID-GMSH", remedy=remedy)


def _second_order(plan: Plan, points, corners, face) -> Grid:
    """Add mid-side nodes: the given ones on boundary and interfaces, half-way ones inside."""
    n = len(points)
    pairs = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    edges, where = np.unique(pairs[:, 0] * n + pairs[:, 1], return_inverse=True)
    mids = 0.5 * (points[edges // n] + points[edges % n])
    ends = np.sort(plan.segments, axis=1)
    key = ends[:, 0] * n + ends[:, 1]
    at = np.minimum(np.searchsorted(edges, key), len(edges) - 1)
    if np.any(edges[at] != key):
        remedy = "try another static.flank_elements"
        raise GridError("Gmsh divided a segment of the outline", code="E-GRID-GMSH", remedy=remedy)
    mids[at] = plan.mids
    triangles = np.hstack([corners, n + where.reshape(-1, 3)])
    edge_nodes = np.column_stack([plan.segments, n + at])
    names = np.array(plan.names)
    boundaries = {name: edge_nodes[names == name] for name in dict.fromkeys(plan.names)}
    regions = {name: np.flatnonzero(face == k) for k, name in enumerate(plan.faces)}
    return Grid(np.vstack([points, mids]), triangles, boundaries, regions)
