"""Grids of whole bodies with their displacements, as VTU and as pictures drawn by PyVista without a screen.

`assemble_set` and `ring_modes_grid` make grids with displacement fields, `write_vtu` writes them,
`deformed_picture` draws one, `animate_operating_deflection` (by Matplotlib) the ring while the carrier turns
past a fixed sensor. PyVista is loaded late, by `load_pyvista`, and only where it can draw.
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
from femgear.gears.gear import Gear
from femgear.gears.kinematics import orientations
from femgear.gears.planetary import PlanetarySet
from femgear.gears.tooth import half_sector
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
_SECONDS = 6.0
"""Length of an animation."""
_LARGEST_ANIMATED = 0.09
"""Largest displacement of an animation as a share of the outer radius."""
# elements of a flank before the factor that divides all spacing: outlines of some twenty points a tooth
_FLANK, _COARSE = 10, 0.4
_TINTS = 31
_SUN, _PLANET, _MARK, _SENSOR = "#F2BE9C", "#F7DDA3", "#000000", "#009E73"


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
class Body:
    """One body of a scene, such as ``"planet 2"`` by its ``name``, in the frame of the set.

    ``points`` (n, 2) [m] and their ``displacement`` (n, 2) [m] or None. ``triangles`` (m, 6) have their corners
    counter-clockwise, then the nodes between 01, 12 and 20.
    """

    name: str
    points: np.ndarray
    triangles: np.ndarray
    displacement: np.ndarray | None = None


def placed(grid: Grid, *, name: str, centre=(0.0, 0.0), angle: float = 0.0, displacement=None) -> Body:
    """Place a grid in the set: turned about its origin by an angle [rad], then moved to a centre (2,) [m].

    The displacement (n, 2) [m] in the frame of the grid is turned along.
    """
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    moved = None if displacement is None else np.asarray(displacement) @ turn
    return Body(name, grid.points @ turn + np.asarray(centre, float), grid.triangles, moved)


def assemble_set(bodies: Sequence[Body]) -> pv.UnstructuredGrid:
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


def animate_operating_deflection(
    path: str | os.PathLike,
    planetary_set: PlanetarySet,
    *,
    radial: np.ndarray,
    tangential: np.ndarray,
    sensor_angle: float = 0.0,
    order: float | None = None,
    title: str = "",
    frames: int = 48,
    size: int = 480,
) -> int:
    """Animate one revolution of the carrier as GIF, six seconds; every frame is a true instant of the motion.

    The mean deflection, which turns with the carrier, is left out; the largest displacement takes 9 % of the
    outer radius. The number of frames, which is returned, is near the wished one and such that the meshes
    pass slowly through a few cycles, as under a stroboscope (see `strobe_frames`). ``radial`` and
    ``tangential`` (H + 1, 2 n_max + 1), complex, are components of the outer surface's displacement [m]:
    ``u(phi, t) = Re sum U[h, n] e^{i n phi} e^{i h omega t}``, phi in the frame of the carrier. ``order`` is
    that of omega, the teeth of the ring by default, negative where the carrier turns clockwise; the sensor
    stands at an angle [rad] on the housing, size is in pixels. StorageError.
    """
    order = planetary_set.ring.teeth if order is None else order
    field = _Field(radial, tangential, np.sign(order), abs(order))
    count = strobe_frames(planetary_set.ring.teeth, frames)
    carrier = field.turn * 2 * np.pi * np.arange(count) / count
    images = _draw(planetary_set, field, carrier, sensor_angle, title, size)
    _write_gif(path, images)
    return count


def strobe_frames(ring_teeth: int, wished: int) -> int:
    """Choose the number of frames a revolution, near that wished for, that shows the meshes in slow motion.

    With ``F`` frames the mesh passes ``ring_teeth / F`` cycles from one frame to the next, of which the
    eye sees the fraction: ``ring_teeth mod F`` apparent cycles a revolution, of about twelve frames each.
    """
    around = range(max(3 * wished // 4, 2), max(5 * wished // 4, 3) + 1)
    moving = [count for count in around if ring_teeth % count]
    if not moving:
        return wished
    return min(moving, key=lambda count: (abs(count / (ring_teeth % count) - 12.0), abs(count - wished)))


@dataclass(frozen=True)
class _Field:
    """Deflection of the ring about its mean in the frame of the carrier, sampled by angle and instant.

    ``radial`` and ``tangential`` (H + 1, 2 n_max + 1) are complex components [m], ``turn`` is the sense of the carrier,
    1 or -1, and ``teeth`` the order of the first harmonic, the teeth of the ring where errors do not turn.
    """

    radial: np.ndarray
    tangential: np.ndarray
    turn: float
    teeth: float

    def at(self, angle: np.ndarray, carrier: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute radial and tangential displacement (c, a) [m] at housing angles (a,) and carrier angles."""
        h, n_max = np.arange(self.radial.shape[0]), self.radial.shape[1] // 2
        n = np.arange(-n_max, n_max + 1)
        # the mesh frequency is the ring's number of teeth times the carrier's, whichever way it turns;
        # with errors that turn the first harmonic is a part of that
        time = np.exp(1j * np.outer(carrier, h * self.teeth * self.turn)) * (h > 0)
        back, wave = np.exp(-1j * np.outer(carrier, n)), np.exp(1j * np.outer(n, angle))
        radial, tangential = (((time @ of) * back @ wave).real for of in (self.radial, self.tangential))
        return radial, tangential


def _draw(planetary_set, field, carrier, sensor_angle, title, size):
    """Draw the frames, arrays (size, size, 3), one for every angle of the carrier [rad]."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection, PolyCollection

    outer, corners = planetary_set.ring.rim_radius, _ring_corners(planetary_set)
    angle = np.angle(corners[:, 0])
    displacement = field.at(angle, carrier)
    largest = float(np.hypot(*displacement).max())
    colour = 1e6 * float(np.abs(displacement[0]).max()) or 1.0
    scale = _LARGEST_ANIMATED * outer / largest if largest > 0 else 1.0
    words = f"{title}: deflection of the ring less its mean,\nmagnified {rounded(scale)} times".lstrip(": ")
    figure, ax, colours = _stage(size, 1.24 * outer, colour, words)
    ring = PolyCollection([], antialiased=False)
    edges, gears = LineCollection([], colors="#404040", linewidths=0.8), PolyCollection([], linewidths=0.0)
    arms = LineCollection([], colors="#808080", linewidths=1.5)
    sensor = 1.1 * outer * np.exp(1j * sensor_angle) * np.array([1.0, 1.11 + 0.032j, 1.11 - 0.032j])
    ax.fill(*_xy(sensor).T, color=_SENSOR)
    place = 1.155 * outer * np.exp(1j * (sensor_angle + 0.07))
    ax.text(place.real, place.imag, "sensor", color=_SENSOR, fontsize=size / 52, ha="center", va="bottom")
    ax.plot(*_xy(outer * np.exp(1j * np.linspace(0.0, 2 * np.pi, 361))).T, color="#808080", linewidth=0.8)
    for collection in (ring, edges, gears, arms):
        ax.add_collection(collection, autolim=False)
    outlines = _outlines(planetary_set)
    gears.set_facecolor([tint for body in outlines for _, tint in body])
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    background, renderer = canvas.copy_from_bbox(figure.bbox), canvas.get_renderer()
    images = []
    for at, radial, tangential in zip(carrier, *displacement, strict=True):
        moved = corners + (scale * (radial + 1j * tangential) * np.exp(1j * angle))[:, None]
        bands = _bands(np.asarray(colours.norm(0.5e6 * (radial + np.roll(radial, -1)))))
        ring.set_verts([_xy(np.append(moved[rows, 0], moved[rows[::-1], -1])) for rows, _ in bands])
        tints = colours.cmap([tint for _, tint in bands])
        ring.set(facecolor=tints, edgecolor=tints)
        edges.set_segments([_xy(np.append(moved[:, k], moved[0, k])) for k in (0, -1)])
        places = _places(planetary_set, at)
        gears.set_verts(
            [
                _xy(centre + points * np.exp(1j * turn))
                for (centre, turn), body in zip(places, outlines, strict=True)
                for points, _ in body
            ]
        )
        arms.set_segments([_xy(np.array([0j, centre])) for centre, _ in places[1:]])
        canvas.restore_region(background)
        for collection in (ring, edges, gears, arms):
            collection.draw(renderer)
        images.append(np.array(canvas.buffer_rgba())[..., :3])
    return images


def _bands(value: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """Rows of corners round bands of one colour, and its number, by values (n,) of 0 .. 1 between them."""
    tint = np.clip(value * _TINTS, 0, _TINTS - 1).astype(int)
    first = np.flatnonzero(tint != np.roll(tint, 1))
    first = first if len(first) else np.array([0])
    last = np.append(first[1:], first[0] + len(tint))
    return [(np.arange(a, b + 1) % len(tint), tint[a]) for a, b in zip(first, last, strict=True)]


def _stage(size: int, reach: float, colour: float, words: str):
    """Figure of `size` pixels, its square of half width `reach` [m], and colours up to +-`colour` [um]."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(size / 100, size / 100), dpi=100)
    ax = figure.add_axes((0.0, 0.12, 1.0, 0.81))
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.set_axis_off()
    colours = ScalarMappable(Normalize(-colour, colour), colormaps["RdBu_r"].resampled(_TINTS))
    text = size / 52.0
    bar = figure.colorbar(colours, cax=figure.add_axes((0.2, 0.085, 0.6, 0.03)), orientation="horizontal")
    bar.locator = MaxNLocator(4, steps=[1, 2, 5, 10], symmetric=True)
    bar.set_label("radial displacement [µm]", fontsize=text)
    bar.ax.tick_params(labelsize=text)
    figure.text(0.02, 0.985, words, fontsize=text, verticalalignment="top")
    return figure, ax, colours


def gear_outline(gear: Gear) -> np.ndarray:
    """Draw the exact outline (n,) of all teeth, complex [m], the first centred on angle 0.

    Counter-clockwise: involutes with their generated fillets, tip and root circles.
    """
    half = half_sector(gear, flank_elements=_FLANK, refine=_COARSE)
    parts = [half.curve(name) for name, _ in half.curves if name in ("tip", "flank", "fillet", "root")]
    # curves of a sector run round it: those of an internal gear come towards its tooth
    points = np.concatenate(parts)[:: -1 if gear.internal else 1]
    points = points[:, 0] + 1j * points[:, 1]
    points = points[np.append(True, np.abs(np.diff(points)) > 1e-9 * gear.module)]
    # without the middles of tooth and gap, which belong to both halves
    tooth = np.concatenate([points[:0:-1].conj(), points[:-1]])
    return np.concatenate([tooth * np.exp(2j * np.pi * k / gear.teeth) for k in range(gear.teeth)])


def _ring_corners(planetary_set):
    """Place the points of the ring (around, across) from the teeth to the outer circle, complex."""
    ring = planetary_set.ring
    inner = gear_outline(ring) * np.exp(1j * orientations(planetary_set).ring)
    # flanks are not radial, so each inner point has its outer one at its own angle
    outer = ring.rim_radius * np.exp(1j * np.angle(inner))
    across = np.linspace(0.0, 1.0, 3)
    return inner[:, None] * (1 - across) + outer[:, None] * across


def _places(planetary_set, carrier_angle):
    """Find centre and rotation of the sun and of every planet when the carrier has turned, ring held."""
    s = planetary_set
    # against the carrier the ring turns back by a tooth in every mesh period
    at = orientations(s, s.ring.teeth * carrier_angle / (2.0 * np.pi))
    centres = s.centre_distance * np.exp(1j * (np.asarray(s.planet_angles, float) + carrier_angle))
    turns = (carrier_angle + angle for angle in at.planets)
    return [(0j, at.sun + carrier_angle), *zip(centres, turns)]


def _outlines(planetary_set):
    """Outlines with their colours, of sun and planets with a mark on each, in the frame of the body."""
    sun, planet = planetary_set.sun, planetary_set.planet
    found = []
    for gear, colour in ((sun, _SUN), *((planet, _PLANET) for _ in planetary_set.planet_angles)):
        mark = gear.root_radius * (0.8 + 0.07 * np.exp(2j * np.pi * np.arange(12) / 12))
        found.append(((gear_outline(gear), colour), (mark, _MARK)))
    return found


def _xy(points) -> np.ndarray:
    """Coordinates (..., 2) of complex points."""
    return np.stack([points.real, points.imag], axis=-1)


def _write_gif(path, images) -> None:
    """Write the frames with the colours of the first one, whole or not at all."""
    from PIL import Image

    frames = [Image.fromarray(image) for image in images]
    palette = frames[0].quantize(128, method=Image.Quantize.MEDIANCUT)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    stream, each = io.BytesIO(), 1000.0 * _SECONDS / len(frames)
    first.save(stream, "GIF", save_all=True, append_images=others, duration=each, loop=0, optimize=False)
    write_bytes(stream.getvalue(), path)
