"""VTK grids of whole bodies: the set with its displacements, the ring's modes, curves around a circle."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError
from femgear.files import replace_file
from femgear.scene.library import load_pyvista

if TYPE_CHECKING:
    import pyvista as pv

    from femgear.fe.grid import Grid
    from femgear.fe.reduction import CyclicModes

_QUADRATIC_TRIANGLE = 22  # VTK_QUADRATIC_TRIANGLE: corners, then the middles of 01, 12, 20


@dataclass(frozen=True)
class Body:
    """One body of a scene.

    Parameters
    ----------
    name : str
    points : (n, 2) array
        [m], in the frame of the set.
    triangles : (m, 6) int array
        Corners counter-clockwise, then the nodes between 01, 12 and 20.
    displacement : (n, 2) array, optional
        [m]; zero when omitted.
    """

    name: str
    points: np.ndarray
    triangles: np.ndarray
    displacement: np.ndarray | None = None


def placed(grid: Grid, *, name: str, centre=(0.0, 0.0), angle: float = 0.0, displacement=None) -> Body:
    """A body from a grid that is turned about its origin, then moved to its place in the set.

    Parameters
    ----------
    grid : Grid
        Centred on the origin.
    name : str
    centre : (2,) array
        [m]
    angle : float
        [rad]
    displacement : (n, 2) array, optional
        In the frame of the grid [m]; turned along.

    Returns
    -------
    Body
    """
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    moved = None if displacement is None else np.asarray(displacement) @ turn
    return Body(name, grid.points @ turn + np.asarray(centre, float), grid.triangles, moved)


def assemble_set(bodies: Sequence[Body]) -> pv.UnstructuredGrid:
    """All bodies in one grid of VTK quadratic triangles.

    Parameters
    ----------
    bodies : sequence of Body
        Plain tuples of the same order are taken as well.

    Returns
    -------
    pyvista.UnstructuredGrid
        Point data ``displacement`` [m] (3 components), cell data ``body`` (number), and the
        number of every body as field data under its name.

    Raises
    ------
    CaseError
        When there is no body, or arrays do not fit together.
    """
    pv = load_pyvista()
    bodies = [body if isinstance(body, Body) else Body(*body) for body in bodies]
    if not bodies:
        raise CaseError("a scene needs at least one body", code="E-SCENE")
    for body in bodies:
        _check_body(body)
    start = np.cumsum([0] + [len(body.points) for body in bodies])
    points, displacement = np.zeros((start[-1], 3)), np.zeros((start[-1], 3), np.float32)
    for body, first in zip(bodies, start):
        points[first : first + len(body.points), :2] = body.points
        if body.displacement is not None:
            displacement[first : first + len(body.points), :2] = body.displacement
    cells = np.vstack([body.triangles + first for body, first in zip(bodies, start)])
    grid = pv.UnstructuredGrid({_QUADRATIC_TRIANGLE: cells}, points)
    grid.point_data["displacement"] = displacement
    grid.cell_data["body"] = np.repeat(np.arange(len(bodies)), [len(body.triangles) for body in bodies])
    # numbers, not a list of names: meshio cannot read text in a VTU file
    for number, body in enumerate(bodies):
        grid.field_data[body.name] = [number]
    return grid


def _check_body(body: Body) -> None:
    points, triangles = np.asarray(body.points), np.asarray(body.triangles)
    fits = points.ndim == 2 and points.shape[1] == 2 and triangles.ndim == 2 and triangles.shape[1] == 6
    fits = fits and len(points) > 0 and len(triangles) > 0
    fits = fits and 0 <= triangles.min() and triangles.max() < len(points)
    fits = fits and (body.displacement is None or np.shape(body.displacement) == points.shape)
    if not fits:
        raise CaseError(
            f"body {body.name!r}: points {points.shape}, triangles {triangles.shape} and displacement "
            f"{np.shape(body.displacement)} do not fit together",
            code="E-SCENE",
            limit="(n, 2), (m, 6) with node numbers below n, (n, 2)",
        )


def ring_modes_grid(sector: Grid, modes: CyclicModes, shown: Sequence[int]) -> pv.UnstructuredGrid:
    """The whole ring with one displacement field a mode.

    Parameters
    ----------
    sector : Grid
    modes : CyclicModes
        Of that sector; the cosine mode of every pair is shown, largest displacement 1.
    shown : sequence of int
        Mode numbers.

    Returns
    -------
    pyvista.UnstructuredGrid
        Point data ``"mode 5, n = 3, 2600 Hz"`` and so on (3 components).
    """
    from femgear.fe.grid import copy_nodes, rotated_copies

    whole, numbers = rotated_copies(sector, modes.count), copy_nodes(sector, modes.count)
    grid = assemble_set([Body("ring", whole.points, whole.triangles)])
    del grid.point_data["displacement"]
    for mode in shown:
        field = np.zeros((whole.n_nodes, 3), np.float32)
        field[:, :2] = cyclic_field(modes.shape[:, mode], int(modes.nodal_diameter[mode]), numbers)
        name = f"mode {mode}, n = {modes.nodal_diameter[mode]}, {modes.frequency[mode]:.0f} Hz"
        grid.point_data[name] = field / (np.abs(field).max() or 1.0)
    return grid


def cyclic_field(shape, nodal_diameter: int, numbers: np.ndarray, *, phase: float = 0.0) -> np.ndarray:
    """Displacement of a whole cyclic body from that of one sector, ``Re(U e^{i(n k 2 pi/count + phase)})``.

    Parameters
    ----------
    shape : (2 n_nodes,) complex array
        Of the first sector, in its own frame: x and y of every node in turn.
    nodal_diameter : int
    numbers : (count, n_nodes) int array
        Nodes of the whole body; see `fe.grid.copy_nodes`.
    phase : float
        [rad]

    Returns
    -------
    (n, 2) array
    """
    count = len(numbers)
    local = np.asarray(shape).reshape(-1, 2)
    field = np.zeros((numbers.max() + 1, 2))
    for k in range(count - 1, -1, -1):
        angle = 2 * np.pi * k / count
        x, y = (local * np.exp(1j * (nodal_diameter * angle + phase))).real.T
        c, s = np.cos(angle), np.sin(angle)
        field[numbers[k]] = np.column_stack([c * x - s * y, s * x + c * y])
    return field


def write_vtu(grid: pv.UnstructuredGrid, path: str | os.PathLike) -> None:
    """Write a grid as compressed VTU; the file is either the old or the new one, whole.

    Raises
    ------
    StorageError
        When the file cannot be written.
    """
    if Path(path).suffix != ".vtu":
        raise CaseError("fields are written as VTU", code="E-SUFFIX", value=str(path), limit=".vtu")
    replace_file(
        path, lambda temporary: grid.save(temporary, binary=True), size=grid.actual_memory_size * 1024
    )


def polar_curve(values, *, radius: float, height: float) -> pv.PolyData:
    """A periodic function around a circle as a closed curve, for display beside the grids.

    Parameters
    ----------
    values : (n,) array
        Equally spaced over one turn, first value at angle 0; stored as point data ``value``.
    radius : float
        Radius of the value zero [m].
    height : float
        Radial distance that the largest absolute value takes [m].

    Returns
    -------
    pyvista.PolyData
    """
    pv = load_pyvista()
    values = np.asarray(values, float)
    angle = 2 * np.pi * np.arange(len(values)) / len(values)
    r = radius + height * values / (np.abs(values).max(initial=0.0) or 1.0)
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.zeros(len(values))])
    curve = pv.PolyData(points, lines=np.concatenate([[len(values) + 1], np.arange(len(values)), [0]]))
    curve.point_data["value"] = values
    return curve
