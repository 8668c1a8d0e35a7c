"""Grids of whole bodies with their displacements, as VTU and as pictures drawn by PyVista without a screen.

`assemble_set` and `ring_modes_grid` make grids with displacement fields, `write_vtu` writes them,
`deformed_picture` draws one. PyVista is loaded late, by `load_pyvista`, and only where it can draw.
"""

from __future__ import annotations

import ctypes
import io
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.errors import CaseError, FemgearError
from femgear.fe.grid import Grid, copy_nodes, rotated_copies
from femgear.storage.files import replace_file

if TYPE_CHECKING:
    import pyvista as pv

    from femgear.fe.reduction import CyclicModes

_QUADRATIC_TRIANGLE = 22  # VTK_QUADRATIC_TRIANGLE: corners, then the middles of 01, 12, 20
_SPLIT = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Corners of the four flat triangles of a quadratic one."""
_OUTLINE = {
    "boundary_edges": True,
    "feature_edges": False,
    "manifold_edges": False,
    "non_manifold_edges": False,
}
_LARGEST = 0.03
"""Largest displacement of a picture as a share of the largest radius."""


def load_pyvista():
    """Load PyVista, ready to draw without a screen.

    Returns
    -------
    module

    Raises
    ------
    FemgearError
        ``E-SYSTEM-LIBRARY`` where the machine lacks the OpenGL library that drawing needs: VTK would
        end the process without a word.
    """
    if sys.platform.startswith("linux"):
        if not _loads("libEGL.so.1"):
            raise FemgearError(
                "pictures of grids need the system library libEGL.so.1, which is not installed",
                code="E-SYSTEM-LIBRARY",
                value="libEGL.so.1",
                remedy="apt-get install -y --no-install-recommends libegl1 libgl1 (Debian, Ubuntu)",
            )
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista

    return pyvista


def _loads(library: str) -> bool:
    """Tell whether the machine has a system library."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


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
    """Place a grid in the set: turned about its origin, then moved.

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
    """
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    moved = None if displacement is None else np.asarray(displacement) @ turn
    return Body(name, grid.points @ turn + np.asarray(centre, float), grid.triangles, moved)


def assemble_set(bodies: Sequence[Body]) -> pv.UnstructuredGrid:
    """Assemble all bodies in one grid of VTK quadratic triangles.

    Returns
    -------
    pyvista.UnstructuredGrid
        Point data ``displacement`` [m] (3 components), cell data ``body`` (number), and the
        number of every body as field data under its name.
    """
    pv = load_pyvista()
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


def ring_modes_grid(sector: Grid, modes: CyclicModes, shown: Sequence[int]) -> pv.UnstructuredGrid:
    """Assemble the whole ring with one displacement field a mode.

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
    whole, numbers = rotated_copies(sector, modes.count), copy_nodes(sector, modes.count)
    grid = assemble_set([Body("ring", whole.points, whole.triangles)])
    del grid.point_data["displacement"]
    for mode in shown:
        field = np.zeros((whole.n_nodes, 3), np.float32)
        turns = 2j * np.pi * modes.nodal_diameter[mode] * np.arange(modes.count) / modes.count
        wave = np.exp(turns)[:, None, None] * modes.shape[:, mode].reshape(-1, 2)
        field[:, :2] = whole_field(wave.real, numbers)
        name = f"mode {mode}, n = {modes.nodal_diameter[mode]}, {modes.frequency[mode]:.0f} Hz"
        grid.point_data[name] = field / (np.abs(field).max() or 1.0)
    return grid


def whole_field(sectors: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Turn the displacements of all sectors of a body to their places.

    Parameters
    ----------
    sectors : (count, n_nodes, 2) array
        Of every sector in the frame of the first.
    numbers : (count, n_nodes) int array
        Nodes of the whole body; see `femgear.fe.grid.copy_nodes`.

    Returns
    -------
    (n, 2) array
        In the unit of `sectors`.
    """
    angle = 2 * np.pi * np.arange(len(numbers))[:, None] / len(numbers)
    c, s = np.cos(angle), np.sin(angle)
    x, y = sectors[..., 0], sectors[..., 1]
    field = np.zeros((numbers.max() + 1, 2))
    field[numbers] = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    return field


def write_vtu(grid: pv.UnstructuredGrid, path: str | os.PathLike) -> None:
    """Write a grid as compressed VTU; the file is either the old or the new one, whole.

    Raises
    ------
    StorageError
        When the file cannot be written.
    """
    if Path(path).suffix != ".vtu":
        raise CaseError("fields are written as VTU", code="E-CHOICE", value=str(path), limit=".vtu")
    replace_file(
        path, lambda temporary: grid.save(temporary, binary=True), size=grid.actual_memory_size * 1024
    )


def deformed_picture(
    grid: pv.UnstructuredGrid,
    path: str | os.PathLike,
    *,
    field: str = "displacement",
    title: str = "",
    colour_label: str = "displacement [µm]",
    colour_factor: float = 1e6,
    size: int = 900,
) -> float:
    """Draw a deformed grid seen from above, coloured by the size of the displacement.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid
        As `assemble_set` or `ring_modes_grid` makes it.
    path : path-like
        PNG file.
    field : str
        Point data of the displacement.
    title : str
    colour_label : str
        What the colours mean, with the unit.
    colour_factor : float
        From the field to that unit.
    size : int
        Width and height in pixels.

    Returns
    -------
    float
        The magnification, with which the largest displacement takes 3 % of the largest radius.

    Raises
    ------
    FemgearError
        See `load_pyvista`.
    StorageError
        When the file cannot be written.
    """
    u = np.asarray(grid.point_data[field])
    length, radius = np.linalg.norm(u, axis=1), np.abs(grid.points).max()
    scale = float(_LARGEST * radius / length.max()) if length.max() > 0 else 1.0
    surface = _linear_surface(grid)
    rest = surface.extract_feature_edges(**_OUTLINE)
    surface.points = grid.points + scale * u
    surface.point_data[colour_label] = colour_factor * length
    plotter = new_plotter(size)
    plotter.add_mesh(rest, color="#A0A0A0", line_width=1.0, lighting=False)
    add_coloured(plotter, surface, colour_label, size, cmap="cividis")
    plotter.add_mesh(surface.extract_feature_edges(**_OUTLINE), color="black", line_width=1.2, lighting=False)
    # a factor below one is that of a normalised shape, which has no magnification
    text = f"{title}\ndeformation × {rounded(scale)}" if scale >= 1 else title
    if text:
        add_text(plotter, text.strip(), size)
    look_down(plotter, radius * 1.1)
    write_png(plotter, path)
    return scale


def new_plotter(size: int) -> pv.Plotter:
    """Make a plotter of `size` by `size` pixels without a screen, with smooth edges."""
    plotter = load_pyvista().Plotter(off_screen=True, window_size=[size, size])
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _linear_surface(grid: pv.UnstructuredGrid) -> pv.PolyData:
    """Split every quadratic triangle into four flat ones on the same points."""
    cells = grid.cells.reshape(-1, 7)[:, 1:]
    return load_pyvista().PolyData.from_regular_faces(np.array(grid.points), cells[:, _SPLIT].reshape(-1, 3))


def add_coloured(
    plotter: pv.Plotter,
    mesh: pv.PolyData,
    text: str,
    size: int,
    *,
    cmap: str,
    limits=None,
    colours: int = 256,
) -> None:
    """Add a mesh coloured by its point data `text`, with a colour bar of that title under the scene."""
    plotter.add_mesh(
        mesh,
        scalars=text,
        cmap=cmap,
        clim=limits,
        n_colors=colours,
        lighting=False,
        scalar_bar_args={
            # the title of a horizontal bar runs into its labels: it is set apart below
            "title": " ",
            "vertical": False,
            "position_x": 0.2,
            "position_y": 0.045,
            "width": 0.6,
            "height": 0.07,
            "label_font_size": max(size // 45, 11),
            "n_labels": 5,
            "fmt": "%.3g",
            "color": "black",
        },
    )
    # Arial is about half as wide as high; text is placed by its lower left corner in pixels
    left = 0.5 * size - 0.42 * _font(size) * len(text)
    _add_text_at(plotter, text, (left, 0.012 * size), size, "bar title")


def add_text(plotter: pv.Plotter, text: str, size: int) -> None:
    """Add text in the upper left corner of a picture of so many pixels."""
    top = size - 2.6 * _font(size) * (1 + text.count("\n")) - 0.01 * size
    _add_text_at(plotter, text, (0.02 * size, top), size, "title")


def _add_text_at(plotter: pv.Plotter, text: str, place: tuple[float, float], size: int, name: str) -> None:
    """Add text with its lower left corner at a place in pixels."""
    write: Any = plotter.add_text  # its size need not be whole
    write(text, position=place, font_size=_font(size), color="black", name=name)


def _font(size: int) -> float:
    """Choose the size of the letters of a picture of so many pixels."""
    return max(size / 75, 7.0)


def rounded(value: float) -> str:
    """Round to two significant figures, without an exponent."""
    return f"{float(f'{value:.2g}'):,.0f}" if value >= 10 else f"{value:.2g}"


def look_down(plotter: pv.Plotter, half_height: float) -> None:
    """Set a parallel view on the plane of the set [m], with room for title and colour bar."""
    view: Any = plotter  # its methods have decorators that hide what they take
    view.set_background("white")
    view.view_xy()
    view.enable_parallel_projection()
    camera = plotter.camera
    middle = -0.05 * half_height
    camera.focal_point, camera.position = (0.0, middle, 0.0), (0.0, middle, 10 * half_height)
    camera.parallel_scale = 1.1 * half_height
    plotter.reset_camera_clipping_range()


def write_png(plotter: pv.Plotter, path: str | os.PathLike) -> None:
    """Render, close the plotter, and write the picture whole or not at all."""
    import imageio.v3 as iio

    try:
        image = np.asarray(plotter.screenshot(filename=None, return_img=True))
    finally:
        plotter.close()
    stream = io.BytesIO()
    iio.imwrite(stream, image, extension=".png")
    data = stream.getvalue()
    replace_file(path, lambda temporary: temporary.write_bytes(data), size=len(data))
