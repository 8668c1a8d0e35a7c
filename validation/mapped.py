"""Structured second-order grids of mapped rectangles, for problems with a closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femgear.fe.grid import Grid

Mapping = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def mapped_grid(mapping: Mapping, u_lines, v_lines, *, closed: bool = False) -> Grid:
    """Grid of the image of the unit square, two triangles a cell, every node on the mapping.

    Parameters
    ----------
    mapping : callable
        Turns arrays ``u, v`` in [0, 1] into ``x, y`` [m]; must keep the orientation.
    u_lines, v_lines : int or array
        Number of equal cells in each direction, or the values of ``u``, ``v`` between them, 0 and 1 included.
    closed : bool
        Whether ``v = 1`` is the same curve as ``v = 0`` (a full ring).

    Returns
    -------
    Grid
        With the boundaries ``"u=0"``, ``"u=1"`` and, unless closed, ``"v=0"``, ``"v=1"``, the body to
        the left of each edge.
    """
    u_stations, v_stations = _stations(u_lines), _stations(v_lines)
    cells_u, cells_v = len(u_stations) // 2, len(v_stations) // 2
    lines_u, lines_v = 2 * cells_u + 1, 2 * cells_v + (0 if closed else 1)
    v, u = np.meshgrid(v_stations[:lines_v], u_stations, indexing="ij")
    points = np.stack(mapping(u, v), axis=-1).reshape(-1, 2)

    def node(i, j):
        return (j % lines_v) * lines_u + i

    i, j = (2 * index.ravel() for index in np.meshgrid(np.arange(cells_u), np.arange(cells_v)))
    a, b, c, d = node(i, j), node(i + 2, j), node(i + 2, j + 2), node(i, j + 2)
    centre = node(i + 1, j + 1)
    lower = np.column_stack([a, b, c, node(i + 1, j), node(i + 2, j + 1), centre])
    upper = np.column_stack([a, c, d, centre, node(i + 1, j + 2), node(i, j + 1)])
    along_u, along_v = 2 * np.arange(cells_u), 2 * np.arange(cells_v)

    def edges(start_i, start_j, step_i, step_j):
        return np.column_stack([node(start_i + k * step_i, start_j + k * step_j) for k in (0, 2, 1)])

    boundaries = {
        "u=0": edges(0, along_v[::-1] + 2, 0, -1),
        "u=1": edges(2 * cells_u, along_v, 0, 1),
    }
    if not closed:
        boundaries["v=0"] = edges(along_u, 0, 1, 0)
        boundaries["v=1"] = edges(along_u[::-1] + 2, 2 * cells_v, -1, 0)
    triangles = np.vstack([lower, upper])
    return Grid(points, triangles, boundaries, {"body": np.arange(len(triangles))})


def _stations(lines):
    """Corner values with their middles in between: a shifted middle would cost an order of accuracy."""
    corners = np.linspace(0.0, 1.0, lines + 1) if np.ndim(lines) == 0 else np.asarray(lines, dtype=float)
    stations = np.empty(2 * len(corners) - 1)
    stations[::2] = corners
    stations[1::2] = 0.5 * (corners[1:] + corners[:-1])
    return stations


def ring_mapping(inner: float, outer: float, angle: float = 2 * np.pi) -> Mapping:
    """Mapping of a ring sector that starts on the x axis: u radial, v along the circumference."""

    def mapping(u, v):
        radius = inner + (outer - inner) * u
        return radius * np.cos(angle * v), radius * np.sin(angle * v)

    return mapping


def boundary_nodes(grid: Grid, name: str) -> np.ndarray:
    """Sorted node numbers of a boundary."""
    return np.unique(grid.boundaries[name])
