"""Second-order triangle grids: the data, mirror images, rotated copies, checks, and files with a checksum."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import stat
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from femgear.errors import GridError, StorageError

# boundaries of a half sector that `mirror` also gives as one
JOINED = ("tip", "rim", "root")
_LARGEST_FILE = 200_000_000
"""Bytes of a grid."""


@dataclass(frozen=True)
class Grid:
    """A plane grid of six-node triangles (isoparametric, P2).

    Parameters
    ----------
    points : (n, 2) array
        Node coordinates [m].
    triangles : (m, 6) int array
        Corners counter-clockwise, then the nodes between corners 0-1, 1-2 and 2-0.
    boundaries : dict of str to (k, 3) int array
        Element edges (start, end, mid), in order, the body to the left of each edge.
    regions : dict of str to (m_r,) int array
        Element numbers of each region.
    """

    points: np.ndarray
    triangles: np.ndarray
    boundaries: dict[str, np.ndarray] = field(default_factory=dict)
    regions: dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self):
        object.__setattr__(self, "points", _read_only(self.points, float))
        object.__setattr__(self, "triangles", _read_only(self.triangles, np.int64))
        for name in ("boundaries", "regions"):
            frozen = {key: _read_only(value, np.int64) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, frozen)

    @property
    def n_nodes(self) -> int:
        """Number of nodes, corners and mid-side nodes together."""
        return len(self.points)


def ordered_nodes(grid: Grid, name: str) -> np.ndarray:
    """Nodes (2 k + 1,) along a connected boundary: start, mid, end, mid, ... in the order of its edges.

    The last node repeats the first one where the boundary is a closed loop.
    """
    edges = boundary_edges(grid, name)
    return np.append(edges[:, [0, 2]].ravel(), edges[-1, 1])


def boundary_edges(grid: Grid, name: str) -> np.ndarray:
    """Edges (k, 3) of a named boundary; GridError (E-GRID) when there is none of that name."""
    if name not in grid.boundaries:
        limit = "one of " + ", ".join(sorted(grid.boundaries))
        raise GridError(
            f"the grid has no boundary {name!r}",
            code="E-GRID",
            key=name,
            limit=limit,
            remedy="name one of these, or give the outline a curve of this name",
        )
    return grid.boundaries[name]


def mirror(grid: Grid) -> Grid:
    """Reflect the upper half of a sector in the x axis; the nodes given keep their numbers.

    Parameters
    ----------
    grid : Grid
        The half with y >= 0. Along its boundary ``symmetry``, on the x axis, the halves are joined.

    Returns
    -------
    Grid
        All other boundaries with the suffixes ``_left`` (y > 0) and ``_right`` (y < 0); tip, rim and root
        also as one, without suffix.
    """
    line = np.unique(grid.boundaries["symmetry"])
    n = grid.n_nodes
    image = np.full(n, -1)
    image[line] = line
    new = image < 0
    image[new] = n + np.arange(np.count_nonzero(new))
    upper = grid.points.copy()
    upper[line, 1] = 0.0
    points = np.vstack([upper, upper[new] * [1.0, -1.0]])
    triangles = np.vstack([grid.triangles, image[grid.triangles][:, [0, 2, 1, 5, 4, 3]]])
    boundaries = {}
    for name, left in grid.boundaries.items():
        if name == "symmetry":
            continue
        right = image[left][::-1, [1, 0, 2]]
        boundaries[f"{name}_left"], boundaries[f"{name}_right"] = left, right
        if name in JOINED:
            boundaries[name] = np.vstack([right, left] if right[-1, 1] == left[0, 0] else [left, right])
    m = len(grid.triangles)
    regions = {name: np.concatenate([e, e + m]) for name, e in grid.regions.items()}
    return Grid(points, triangles, boundaries, regions)


def copy_nodes(grid: Grid, count: int) -> np.ndarray:
    """Node numbers (count, n) of every sector in the whole body that `rotated_copies` makes.

    Entry (k, i) is the node of the body that node i of sector k becomes.
    """
    left, right = ordered_nodes(grid, "cut_left"), ordered_nodes(grid, "cut_right")[::-1]
    free = np.ones(grid.n_nodes, dtype=bool)
    free[right] = False
    number_of = np.full(grid.n_nodes, -1)
    number_of[free] = np.arange(np.count_nonzero(free))
    numbers = number_of + np.count_nonzero(free) * np.arange(count)[:, None]
    # the right cut of sector k is the left cut of sector k - 1
    numbers[:, right] = np.roll(numbers[:, left], 1, axis=0)
    return numbers


def rotated_copies(grid: Grid, count: int) -> Grid:
    """Make the grid of a whole body from one sector; the nodes on the cuts are merged.

    Parameters
    ----------
    grid : Grid
        One sector with the boundaries ``cut_right`` and ``cut_left``, centred on the origin.
    count : int
        Number of sectors in the circle.

    Returns
    -------
    Grid
        Boundaries (without the cuts) and regions list sector 0 first, then counter-clockwise.
    """
    numbers = copy_nodes(grid, count)
    points = np.empty((numbers.max() + 1, 2))
    for k in range(count - 1, -1, -1):
        points[numbers[k]] = _turn(grid.points, 2 * np.pi * k / count)
    triangles = numbers[:, grid.triangles].reshape(-1, 6)
    boundaries = {
        name: numbers[:, edges].reshape(-1, 3)
        for name, edges in grid.boundaries.items()
        if name not in ("cut_left", "cut_right")
    }
    shift = len(grid.triangles) * np.arange(count)[:, None]
    regions = {name: (elements + shift).ravel() for name, elements in grid.regions.items()}
    return Grid(points, triangles, boundaries, regions)


def shape_functions(b1, b2):
    """Quadratic shape functions (6, m) at reference coordinates (m,), and their derivatives along both."""
    b0 = 1.0 - b1 - b2
    ones, zero = np.ones_like(b0), np.zeros_like(b0)
    value = np.stack([b0 * (2 * b0 - 1), b1 * (2 * b1 - 1), b2 * (2 * b2 - 1), 4 * b0 * b1, 4 * b1 * b2, 4 * b2 * b0])
    first = np.stack([ones - 4 * b0, 4 * b1 - 1, zero, 4 * (b0 - b1), 4 * b2, -4 * b2])
    second = np.stack([ones - 4 * b0, zero, 4 * b2 - 1, -4 * b1, 4 * b1, 4 * (b0 - b2)])
    return value, first, second


def jacobian_bounds(grid: Grid) -> np.ndarray:
    """Lower and upper bound of the Jacobian determinant of every element, shape (m, 2) [m^2].

    The determinant of a P2 triangle is a quadratic polynomial; its Bernstein coefficients bound it
    (Johnen, Remacle, Geuzaine, "Geometrical validity of curvilinear finite elements", J. Comput.
    Phys. 233, 2013).
    """
    # gradients of the six shape functions at the six nodes of the reference triangle
    x, y = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]]).T
    _, dx, dy = shape_functions(x, y)
    nodes = grid.points[grid.triangles]
    a, b = np.einsum("mic,ij->cmj", nodes, dx), np.einsum("mic,ij->cmj", nodes, dy)
    value = a[0] * b[1] - a[1] * b[0]
    corner, mid = value[:, :3], value[:, 3:]
    control = np.hstack([corner, 2 * mid - 0.5 * (corner + corner[:, [1, 2, 0]])])
    return np.stack([control.min(axis=1), control.max(axis=1)], axis=1)


def check_grid(grid: Grid) -> None:
    """Refuse inverted or folded elements: their number and the place of the worst [m] (GridError, E-GRID)."""
    lowest = jacobian_bounds(grid)[:, 0]
    bad = np.count_nonzero(lowest <= 0)
    if bad:
        worst = int(lowest.argmin())
        x, y = grid.points[grid.triangles[worst, :3]].mean(axis=0)
        raise GridError(
            f"{bad} of {len(lowest)} elements are inverted or folded, the worst at ({x:.6g}, {y:.6g}) m",
            code="E-GRID",
            value=f"Jacobian determinant {lowest[worst]:.3e} m^2",
            limit="positive everywhere in every element",
            remedy="use more elements along the curved part of the outline near this point",
        )


def write_grid(path: Path, grid: Grid) -> None:
    """Write a grid [m] as Gmsh 2.2 binary with a checksum, boundaries and regions as named physical groups.

    What dead processes left half written under this name is removed.

    StorageError: the file cannot be written (E-GRID-FILE); none stands there then, not even a part of it.
    """
    import meshio

    names = list(grid.regions)
    tag = np.zeros(len(grid.triangles), dtype=np.int32)
    for number, name in enumerate(names, start=1):
        tag[grid.regions[name]] = number
    points = np.column_stack([grid.points, np.zeros(grid.n_nodes)])
    cells: list[tuple[str, ArrayLike] | meshio.CellBlock] = [("triangle6", grid.triangles)]
    tags: list[ArrayLike] = [tag]
    groups = {name: np.array([number, 2]) for number, name in enumerate(names, start=1)}
    for number, (name, edges) in enumerate(grid.boundaries.items(), start=len(names) + 1):
        groups[name] = np.array([number, 1])
        cells.append(("line3", edges))
        tags.append(np.full(len(edges), number, dtype=np.int32))
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(8)}.tmp{path.suffix}")
    try:
        open(temporary, "xb").close()
        meshio.Mesh(points, cells, {}, data, groups).write(temporary, file_format="gmsh22")
        written = temporary.read_bytes()
        temporary.write_bytes(written + _seal_of(written))
        os.replace(temporary, path)
        # that of a living process is the same grid, which stands there now
        for other in path.parent.glob(f".{path.stem}.*{path.suffix}"):
            with contextlib.suppress(OSError):
                other.unlink()
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, FileNotFoundError) and path.is_file():
            return
        raise StorageError(
            f"cannot write the grid {path}: {error}",
            code="E-GRID-FILE",
            remedy="free some space, or name another folder of grids: FEMGEAR_MESHES",
        ) from error


def read_grid(path: Path) -> Grid:
    """Read a grid [m] that `write_grid` has written as ``.msh``.

    StorageError: the file is missing, a link or no regular one, truncated, no such grid, or was changed since
    it was written (E-GRID-FILE).
    """
    try:
        # O_NONBLOCK: opening a FIFO must not wait for a writer
        flags = os.O_RDONLY | sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
        with open(os.open(path, flags), "rb") as stream:
            status = os.fstat(stream.fileno())
            if not stat.S_ISREG(status.st_mode) or status.st_size > _LARGEST_FILE:
                raise ValueError("no regular file of reasonable size")
            data = stream.read()
        start = data.rfind(b"$Comments\n")
        if start < 0 or data[start:] != _seal_of(data[:start]):
            raise ValueError("its checksum is missing or is not that of its contents")
        return _grid_in(data[:start])
    except Exception as error:
        raise StorageError(
            f"{path} is not a readable grid: {type(error).__name__}: {error}",
            code="E-GRID-FILE",
            remedy="delete the file; it is made again when needed",
        ) from error


def _read_only(value, dtype):
    """Copy of an array that cannot be changed."""
    array = np.array(value, dtype=dtype)
    array.setflags(write=False)
    return array


def _turn(points, angle):
    """Points (n, 2) turned about the origin by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


_NODES_OF = {8: ("line3", 3), 9: ("triangle6", 6)}
"""Name and nodes of the kinds of element of Gmsh that a grid has."""


def _grid_in(data: bytes) -> Grid:
    """Read the grid of `write_grid`: sections of Gmsh 2.2, binary, as Gmsh's reference manual has them.

    Meshio reads them too, for longer than the rest of reading takes. ValueError: it is no such grid.
    """
    place = 0

    def expect(text: bytes) -> None:
        nonlocal place
        if not data.startswith(text, place):
            raise ValueError(f"no {text.split()[0].decode()} where it should be")
        place += len(text)

    def line() -> str:
        nonlocal place
        first, place = place, data.index(b"\n", place) + 1
        return data[first : place - 1].decode()

    def numbers(kind: np.dtype, count: int) -> np.ndarray:
        nonlocal place
        numbers_read = np.frombuffer(data, kind, count, place)
        place += numbers_read.nbytes
        return numbers_read

    expect(b"$MeshFormat\n2.2 1 8\n" + np.int32(1).tobytes() + b"\n$EndMeshFormat\n$PhysicalNames\n")
    groups = [line().split(" ", 2) for _ in range(int(line()))]
    expect(b"$EndPhysicalNames\n$Nodes\n")
    nodes = numbers(np.dtype([("number", "i4"), ("x", "f8", 3)]), int(line()))
    expect(b"\n$EndNodes\n$Elements\n")
    left, kinds = int(line()), {name: [np.zeros((0, count + 1), int)] for name, count in _NODES_OF.values()}
    while left > 0:
        kind, count, tags = numbers(np.dtype("i4"), 3).tolist()
        name, corners = _NODES_OF[kind]
        rows = numbers(np.dtype("i4"), count * (1 + tags + corners)).reshape(count, -1)
        kinds[name].append(np.column_stack([rows[:, 1], rows[:, 1 + tags :] - 1]))
        left -= count
    expect(b"\n$EndElements\n")
    (edge_tag, edges), (region, triangles) = (
        np.split(np.concatenate(kinds[name]), [1], axis=1) for name in ("line3", "triangle6")
    )
    named = [(name.strip('"'), int(number), int(dim)) for dim, number, name in groups]
    wrong = [array for array in (edges, triangles) if array.size and not 0 <= array.min() <= array.max() < len(nodes)]
    if wrong or left or place != len(data) or np.any(nodes["number"] != np.arange(1, len(nodes) + 1)):
        raise ValueError("nodes or elements are numbered otherwise")
    boundaries = {name: edges[edge_tag[:, 0] == number] for name, number, dim in named if dim == 1}
    regions = {name: np.flatnonzero(region[:, 0] == number) for name, number, dim in named if dim == 2}
    return Grid(nodes["x"][:, :2], triangles, boundaries, regions)


def _seal_of(data: bytes) -> bytes:
    """SHA-256 of everything before it, in a section of comments that other readers skip."""
    return f"$Comments\nsha256 {hashlib.sha256(data).hexdigest()}\n$EndComments\n".encode()
