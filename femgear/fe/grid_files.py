"""Grids in files: written whole and with a checksum, read with suspicion."""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
from pathlib import Path

import numpy as np

from femgear.errors import StorageError
from femgear.fe.grid import Grid


def write_grid(path, grid: Grid, *, point_data: dict[str, np.ndarray] | None = None) -> None:
    """Write a grid through meshio, under a temporary name first.

    Parameters
    ----------
    path : path
        ``.msh`` (Gmsh 2.2 binary; boundaries and regions as named physical groups, with a checksum: what
        `read_grid` takes) or ``.vtu`` (ParaView; triangles with the number of their region).
    grid : Grid
    point_data : dict of str to (n,) or (n, 2) array, optional
        Fields at the nodes; two components are padded to three for VTU.

    Raises
    ------
    StorageError
        When the file cannot be written or its ending is neither.
    """
    import meshio

    path = Path(path)
    names = list(grid.regions)
    tag = np.zeros(len(grid.triangles), dtype=np.int32)
    for number, name in enumerate(names, start=1):
        tag[grid.regions[name]] = number
    points = np.column_stack([grid.points, np.zeros(grid.n_nodes)])
    cells, tags = [("triangle6", grid.triangles)], [tag]
    fields = {name: _three_components(value) for name, value in (point_data or {}).items()}
    if path.suffix == ".msh":
        groups = {name: np.array([number, 2]) for number, name in enumerate(names, start=1)}
        for number, (name, edges) in enumerate(grid.boundaries.items(), start=len(names) + 1):
            groups[name] = np.array([number, 1])
            cells.append(("line3", edges))
            tags.append(np.full(len(edges), number, dtype=np.int32))
        data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        mesh, kind = meshio.Mesh(points, cells, fields, data, groups), "gmsh22"
    elif path.suffix == ".vtu":
        mesh, kind = meshio.Mesh(points, cells, fields, {"region": tags}), "vtu"
    else:
        raise StorageError(
            f"a grid cannot be written as {path.name!r}", code="E-GRID-FORMAT", limit=".msh or .vtu"
        )
    temporary = path.with_name(f".{path.stem}.{os.getpid()}-{threading.get_ident()}{path.suffix}")
    try:
        mesh.write(temporary, file_format=kind)
        if kind == "gmsh22":
            _seal(temporary)
        os.replace(temporary, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise StorageError(f"cannot write the grid {path}: {error}", code="E-GRID-WRITE") from error


def _three_components(value):
    value = np.asarray(value, dtype=float)
    return np.column_stack([value, np.zeros(len(value))]) if value.shape[1:] == (2,) else value


def _seal(path):
    """Append the SHA-256 of everything before it, in a section of comments that other readers skip."""
    data = path.read_bytes()
    path.write_bytes(data + _seal_of(data))


def _seal_of(data):
    return f"$Comments\nsha256 {hashlib.sha256(data).hexdigest()}\n$EndComments\n".encode()


def _check_seal(path):
    data = Path(path).read_bytes()
    start = data.rfind(b"$Comments\n")
    if start < 0 or data[start:] != _seal_of(data[:start]):
        raise ValueError("its checksum is missing or is not that of its contents")


def read_grid(path) -> Grid:
    """Read a grid that `write_grid` has written as ``.msh``.

    Raises
    ------
    StorageError
        When the file is missing, truncated, not such a grid, or was changed since it was written.
    """
    import meshio

    try:
        _check_seal(path)
        mesh = meshio.read(path, file_format="gmsh")
        tags = mesh.cell_data["gmsh:physical"]
        blocks = [
            (block.type, np.asarray(block.data), np.asarray(tag)) for block, tag in zip(mesh.cells, tags)
        ]
        triangles = np.vstack([data for kind, data, _ in blocks if kind == "triangle6"])
        region = np.concatenate([tag for kind, _, tag in blocks if kind == "triangle6"])
        edges = np.vstack([np.empty((0, 3), dtype=int)] + [d for kind, d, _ in blocks if kind == "line3"])
        edge_tag = np.concatenate([np.empty(0, dtype=int)] + [t for kind, _, t in blocks if kind == "line3"])
        groups = {str(name): (int(value[0]), int(value[1])) for name, value in mesh.field_data.items()}
        boundaries = {name: edges[edge_tag == number] for name, (number, dim) in groups.items() if dim == 1}
        regions = {
            name: np.flatnonzero(region == number) for name, (number, dim) in groups.items() if dim == 2
        }
        grid = Grid(mesh.points[:, :2], triangles, boundaries, regions)
        if grid.triangles.min() < 0 or grid.triangles.max() >= grid.n_nodes:
            raise ValueError("a triangle refers to a node that is not there")
    except (SystemExit, Exception) as error:  # meshio calls sys.exit on some unreadable files
        raise StorageError(
            f"{path} is not a readable grid: {type(error).__name__}: {error}",
            code="E-GRID-READ",
            remedy="delete the file; it is made again when needed",
        ) from error
    return grid
