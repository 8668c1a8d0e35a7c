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
from femgear.report.style import PNG_LEVEL, SIZE, WIDTH, label, save_figure
from femgear.storage.files import write_bytes

if sys.platform == "linux":
    import resource

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
_PIXELS, _COLOURS = 900, "YlGnBu"
"""Sides of a rendered view, and its colours: pale where little moves, as paper is."""
# address space that VTK needs before it has drawn anything [bytes]
_MEMORY = 1_100_000_000


def load_pyvista():
    """Load the module PyVista, ready to draw without a screen.

    FemgearError: the machine lacks the OpenGL library that drawing needs (E-SYSTEM-LIBRARY), or the memory of
    the process is limited too far, where VTK would end it without a word (E-MEMORY).
    """
    if "pyvista" not in sys.modules:
        _refuse_little_memory()
    if sys.platform.startswith("linux"):
        try:
            ctypes.CDLL("libEGL.so.1")
        except OSError:
            raise FemgearError(
                "pictures of grids need the system library libEGL.so.1, which is not installed",
                code="E-SYSTEM-LIBRARY",
                value="libEGL.so.1",
                remedy="apt-get install -y --no-install-recommends libegl1 libgl1 (Debian, Ubuntu)",
            ) from None
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista

    return pyvista


def _refuse_little_memory() -> None:
    """Refuse to draw within less memory than VTK needs beside what the process has (``ulimit -v``)."""
    if sys.platform != "linux":  # the others tell no use, or know no limit
        return
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    used = int(Path("/proc/self/statm").read_text("ascii").split()[0]) * resource.getpagesize()
    if 0 <= limit < used + _MEMORY:
        raise FemgearError(
            "pictures of grids need more memory than this process may use",
            code="E-MEMORY",
            value=f"{limit / 1e9:.1f} GB",
            limit=f"{(used + _MEMORY) / 1e9:.1f} GB or more",
            remedy="raise the limit (ulimit -v), or run with --no-pictures",
        )


@dataclass(frozen=True)
class DrawnBody:
    """One body of a scene, such as ``"planet 2"`` by its ``name``, in the frame of the set.

    ``points`` (n, 2) [m] and their ``displacement`` (n, 2) [m] or None. ``triangles`` (m, 6) have their corners
    counter-clockwise, then the nodes between 01, 12 and 20.
    """

    name: str
    points: np.ndarray
    triangles: np.ndarray
    displacement: np.ndarray | None = None


def placed(grid: Grid, *, name: str, centre=(0.0, 0.0), angle: float = 0.0, displacement=None) -> DrawnBody:
    """Place a grid in the set: turned about its origin by an angle [rad], then moved to a centre (2,) [m].

    The displacement (n, 2) [m] in the frame of the grid is turned along.
    """
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    moved = None if displacement is None else np.asarray(displacement) @ turn
    return DrawnBody(name, grid.points @ turn + np.asarray(centre, float), grid.triangles, moved)


def assemble_set(bodies: Sequence[DrawnBody]) -> pv.UnstructuredGrid:
    """Assemble all bodies in one grid of VTK quadratic triangles.

    It has the point data ``displacement`` [m] (3 components), the cell data ``body`` (number), and the number
    of every body as field data under its name.
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
    """Assemble the whole ring with one displacement field a mode shown, by its number.

    Of the modes of that sector; the cosine mode of every pair is shown, largest displacement 1, as point data
    ``"mode 5, n = 3, 2600 Hz"`` and so on (3 components).
    """
    whole, numbers = rotated_copies(sector, modes.count), copy_nodes(sector, modes.count)
    grid = assemble_set([DrawnBody("ring", whole.points, whole.triangles)])
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
    """Turn the displacements of all sectors of a body to their places, (n, 2) in their unit.

    The sectors (count, n_nodes, 2) are in the frame of the first; ``numbers`` (count, n_nodes) are their
    nodes in the whole body, see `femgear.fe.grid.copy_nodes`.
    """
    angle = 2 * np.pi * np.arange(len(numbers))[:, None] / len(numbers)
    c, s = np.cos(angle), np.sin(angle)
    x, y = sectors[..., 0], sectors[..., 1]
    field = np.zeros((numbers.max() + 1, 2))
    field[numbers] = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    return field


def write_vtu(grid: pv.UnstructuredGrid, path: str | os.PathLike) -> None:
    """Write a grid as compressed VTU; the file is either the old or the new one, whole."""
    if Path(path).suffix != ".vtu":
        raise CaseError("fields are written as VTU", code="E-CHOICE", value=str(path), limit=".vtu")
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    # in memory, and then to the file: VTK ends the process where a disk fails under it
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressionLevel(1)  # of zlib: meshio knows no LZ4
    writer.WriteToOutputStringOn()
    writer.Write()
    text: Any = writer.GetOutputString()  # bytes where they are no text
    write_bytes(text.encode() if isinstance(text, str) else text, path)


@dataclass(frozen=True)
class View:
    """A part of a picture of its own: ``title``, ``centre`` (2,) and ``half`` of its width [m]."""

    title: str
    centre: Sequence[float]
    half: float


def deformed_picture(
    grid: pv.UnstructuredGrid,
    path: str | os.PathLike,
    *,
    field: str = "displacement",
    title: str = "",
    colour_label: str = "displacement [µm]",
    colour_factor: float = 1e6,
    largest: float | None = None,
    details: Sequence[View] = (),
) -> float:
    """Draw a deformed grid seen from above as PNG, coloured by the size of a field of displacements.

    The grid is made by `assemble_set` or `ring_modes_grid`; ``colour_factor`` converts the field to the unit
    of ``colour_label``. Returns the magnification, with which the largest displacement takes the length
    ``largest`` [m], by default 3 % of the largest radius. ``details`` stand beside the whole. FemgearError:
    see `load_pyvista`; StorageError.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    u = np.asarray(grid.point_data[field])
    length, radius = np.linalg.norm(u, axis=1), np.abs(grid.points).max()
    scale = float((largest or _LARGEST * radius) / length.max()) if length.max() > 0 else 1.0
    surface = _linear_surface(grid)
    rest = surface.extract_feature_edges(**_OUTLINE)
    surface.points = grid.points + scale * u
    surface.point_data["colour"] = colour_factor * length
    top = colour_factor * float(length.max()) or 1.0
    plotter = new_plotter(_PIXELS, _PIXELS)
    plotter.add_mesh(rest, color="#909090", line_width=1.5, lighting=False)
    look: Any = {"cmap": _COLOURS, "clim": (0.0, top), "lighting": False, "show_scalar_bar": False}
    plotter.add_mesh(surface, scalars="colour", **look)
    plotter.add_mesh(surface.extract_feature_edges(**_OUTLINE), color="black", line_width=1.5, lighting=False)
    # a factor below one is that of a normalised shape, which has no magnification
    text = f"{title}, magnified {rounded(scale)} times" if scale >= 1 else title
    try:
        images = [_seen(plotter, view) for view in (View(text, (0.0, 0.0), 1.04 * radius), *details)]
    finally:
        plotter.close()
    figure, axes = _mosaic(len(details))
    for ax, image, view in zip(axes, images, (View(text, (), 0.0), *details)):
        ax.imshow(image, interpolation="antialiased")
        ax.set_axis_off()
        label(ax, title=view.title)
    colours = ScalarMappable(Normalize(0.0, top), _COLOURS)
    bar = figure.colorbar(colours, ax=axes, location="bottom", shrink=0.6, aspect=40, pad=0.02)
    bar.set_label(colour_label, fontsize=SIZE)
    bar.ax.tick_params(labelsize=SIZE - 1)
    save_figure(figure, path)
    return scale


def _mosaic(details: int):
    """Make a figure with axes for a large picture, and beside it a column of details."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    engine = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.1)
    figure = Figure(figsize=(WIDTH if details else 5.6, 6.4), layout=engine)
    if not details:
        return figure, [figure.add_subplot()]
    grid = figure.add_gridspec(details, 2, width_ratios=(details, 1))
    return figure, [figure.add_subplot(grid[:, 0]), *(figure.add_subplot(grid[i, 1]) for i in range(details))]


def _seen(plotter: pv.Plotter, view: View) -> np.ndarray:
    """Render a part of the plane from above, (n, n, 3)."""
    scene: Any = plotter  # its methods have decorators that hide what they take
    scene.set_background("white")
    scene.view_xy()
    scene.enable_parallel_projection()
    x, y = view.centre
    scene.camera.focal_point, scene.camera.position = (x, y, 0.0), (x, y, 1.0)
    scene.camera.parallel_scale = view.half
    scene.reset_camera_clipping_range()
    # a second picture is a new one only where it is rendered again
    scene.render()
    return np.asarray(scene.screenshot(filename=None, return_img=True))


def new_plotter(width: int, height: int) -> pv.Plotter:
    """Make a plotter of so many pixels without a screen, with smooth edges."""
    plotter = load_pyvista().Plotter(off_screen=True, window_size=[width, height])
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _linear_surface(grid: pv.UnstructuredGrid) -> pv.PolyData:
    """Split every quadratic triangle into four flat ones on the same points."""
    cells = grid.cells.reshape(-1, 7)[:, 1:]
    return load_pyvista().PolyData.from_regular_faces(np.array(grid.points), cells[:, _SPLIT].reshape(-1, 3))


def add_coloured(plotter: pv.Plotter, mesh: pv.PolyData, text: str, size: int, *, limits=None) -> None:
    """Add a mesh coloured by a field on its points, with a colour bar under the scene.

    ``text`` is the name of the field with its unit, also the title of the bar; ``size`` that of the picture
    [pixels]; the limits (2,) of the colours are those of the field where none are given.
    """
    bar: Any = {"position_x": 0.2, "position_y": 0.045, "width": 0.6, "height": 0.07, "color": "black"}
    # the title of a horizontal bar runs into its labels: it is set apart below
    bar |= {"title": " ", "vertical": False, "n_labels": 5, "fmt": "%.3g"}
    bar["label_font_size"] = max(size // 45, 11)
    plotter.add_mesh(mesh, scalars=text, cmap="cividis", clim=limits, lighting=False, scalar_bar_args=bar)
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
    """Write a number with two significant figures, without an exponent."""
    return f"{float(f'{value:.2g}'):,.0f}" if value >= 10 else f"{value:.2g}"


def look_down(plotter: pv.Plotter, half_height: float) -> None:
    """Set a parallel view on the plane of the set, half as high as given [m] and more for title and bar."""
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
    try:
        image = np.asarray(plotter.screenshot(filename=None, return_img=True))
    finally:
        plotter.close()
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "PNG", compress_level=PNG_LEVEL)
    write_bytes(stream.getvalue(), path)
