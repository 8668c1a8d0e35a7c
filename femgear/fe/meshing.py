"""From an outline to a second-order grid: Gmsh in a killable process, results cached by content."""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tempfile
import warnings
from concurrent.futures import ThreadPoolExecutor
from importlib import metadata
from pathlib import Path

import numpy as np

from femgear.errors import GridError, StorageError
from femgear.fe.grid import Grid, check_grid, read_grid, write_grid
from femgear.fe.outline import Plan, check_outline, estimate_elements

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
        be written there is a warning.

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
    expected = estimate_elements(plan)
    if expected > MAX_ELEMENTS:
        raise GridError(
            f"the grid would have about {expected:.3g} elements",
            code="E-GRID",
            limit=f"at most {MAX_ELEMENTS}",
            remedy="use fewer points along the outline",
        )
    return _mesh_plan(plan) if cache is None else _mesh_cached(plan, Path(cache))


def _mesh_cached(plan: Plan, folder: Path) -> Grid:
    """The grid of a plan from the folder, or made and kept there."""
    path = folder / f"{_content_hash(plan)}.msh"
    if os.path.exists(path):
        try:
            return _check_cached(read_grid(path), plan)
        except (StorageError, GridError):
            pass  # a damaged file in the cache is made again and replaced
    grid = _mesh_plan(plan)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_grid(path, grid)
    except (OSError, StorageError) as error:
        cause = error if isinstance(error, OSError) else error.__cause__
        reason = "no folder" if folder.exists() and not folder.is_dir() else getattr(cause, "strerror", error)
        warnings.warn(f"grids are made but not kept: cannot write into {folder} ({reason})", stacklevel=2)
    return grid


def _check_cached(grid: Grid, plan: Plan) -> Grid:
    """The grid from a file, refused where it is not that of the plan."""
    check_grid(grid)
    same = set(grid.regions) == set(plan.faces) and np.array_equal(
        grid.points[: len(plan.points)], plan.points
    )
    for name in dict.fromkeys(plan.names):
        own = np.array(plan.names) == name
        edges = grid.boundaries.get(name, np.empty((0, 3), dtype=int))
        same = same and np.array_equal(edges[:, :2], plan.segments[own])
        same = same and np.array_equal(grid.points[edges[:, 2]], plan.mids[own])
    if not same:
        raise GridError("the cached grid is not that of the outline", code="E-GRID-FILE")
    return grid


def mesh_outlines(outlines, *, cache: Path | None = None) -> tuple[Grid, ...]:
    """Mesh several outlines at once, see `mesh_outline`, in as many processes as there are cores.

    Raises
    ------
    GridError
        The first error of any outline, after all processes have ended.
    """
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        return tuple(pool.map(lambda outline: mesh_outline(outline, cache=cache), outlines))


def _content_hash(plan: Plan) -> str:
    """Name of the grid in a cache: hash of the plan and of what makes the grid."""
    try:
        gmsh = metadata.version("gmsh")
    except metadata.PackageNotFoundError as error:
        raise _library_error("the package gmsh is not installed") from error
    digest = hashlib.sha256(f"femgear grid {FORMAT} gmsh {gmsh}".encode())
    for array in (plan.points, plan.segments, plan.mids, *plan.loops):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update("\0".join((*plan.names, "", *plan.faces)).encode())
    return digest.hexdigest()[:32]


def _mesh_plan(plan: Plan) -> Grid:
    """A new grid of a plan, checked."""
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
    with tempfile.TemporaryDirectory(prefix="femgear-") as folder:
        source, target = Path(folder) / "outline.npz", Path(folder) / "grid.npz"
        np.savez(source, **job)
        command = [sys.executable, "-P", str(WORKER), str(source), str(target)]
        try:
            done = subprocess.run(
                command, timeout=TIME_LIMIT, capture_output=True, text=True, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired as error:
            raise GridError(
                f"Gmsh was stopped: no grid after {TIME_LIMIT:g} s",
                code="E-GRID-GMSH",
                remedy="use fewer points along the outline or a longer time limit",
            ) from error
        if done.returncode != 0 or not target.exists():
            raise _worker_error(done)
        with np.load(target) as file:
            result = dict(file)
    result["points"] = result["points"] * size + centre
    return result


def _worker_error(done):
    """Refusal with the last words of the process of Gmsh."""
    text = " ".join(done.stderr.split())[-400:]
    if done.returncode == 3:
        return _library_error(text)
    return GridError(f"Gmsh failed (exit code {done.returncode}): {text}", code="E-GRID-GMSH")


def _library_error(text):
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
        raise GridError("Gmsh divided a segment of the outline", code="E-GRID-GMSH")
    mids[at] = plan.mids
    triangles = np.hstack([corners, n + where.reshape(-1, 3)])
    edge_nodes = np.column_stack([plan.segments, n + at])
    names = np.array(plan.names)
    boundaries = {name: edge_nodes[names == name] for name in dict.fromkeys(plan.names)}
    regions = {name: np.flatnonzero(face == k) for k, name in enumerate(plan.faces)}
    return Grid(np.vstack([points, mids]), triangles, boundaries, regions)
