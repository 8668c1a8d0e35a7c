"""Pictures of deformed grids, drawn without a screen."""

from __future__ import annotations

import io
import os
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError
from femgear.files import replace_file
from femgear.scene.library import load_pyvista

if TYPE_CHECKING:
    import pyvista as pv

_SPLIT = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


def deformed_picture(
    grid: pv.UnstructuredGrid,
    path: str | os.PathLike,
    *,
    field: str = "displacement",
    scale: float | None = None,
    title: str = "",
    colour_label: str = "displacement [µm]",
    colour_factor: float = 1e6,
    size: int = 900,
) -> float:
    """Picture of a deformed grid seen from above, coloured by the size of the displacement.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid
        As `assemble_set` or `ring_modes_grid` makes it.
    path : path-like
        PNG file.
    field : str
        Point data of the displacement.
    scale : float, optional
        Magnification; when omitted, the largest displacement takes 3 % of the largest radius.
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
        The magnification.

    Raises
    ------
    CaseError
        When the grid has no such field.
    FemgearError
        See `load_pyvista`.
    StorageError
        When the file cannot be written.
    """
    pv = load_pyvista()
    if field not in grid.point_data:
        raise CaseError(
            f"the grid has no field {field!r}", code="E-SCENE", limit=", ".join(grid.point_data) or "none"
        )
    u = np.asarray(grid.point_data[field])
    length = np.linalg.norm(u, axis=1)
    radius = np.abs(grid.points).max()
    if scale is None:
        scale = 0.03 * radius / length.max() if length.max() > 0 else 1.0
    surface = linear_surface(grid)
    rest = surface.extract_feature_edges(**_OUTLINE)
    surface.points = grid.points + scale * u
    surface.point_data.clear()
    surface.point_data[colour_label] = colour_factor * length
    plotter = pv.Plotter(off_screen=True, window_size=(size, size))
    plotter.enable_anti_aliasing("ssaa")
    plotter.add_mesh(rest, color="#A0A0A0", line_width=1.0, lighting=False)
    add_coloured(plotter, surface, colour_label, size, cmap="cividis")
    plotter.add_mesh(surface.extract_feature_edges(**_OUTLINE), color="black", line_width=1.2, lighting=False)
    # a factor below one is that of a normalised shape, which has no magnification
    text = f"{title}\ndeformation × {rounded(scale)}" if scale >= 1 else title
    if text:
        add_text(plotter, text.strip(), size)
    look_down(plotter, radius * 1.1)
    write_png(plotter, path)
    return float(scale)


_OUTLINE = {
    "boundary_edges": True,
    "feature_edges": False,
    "manifold_edges": False,
    "non_manifold_edges": False,
}


def linear_surface(grid: pv.UnstructuredGrid) -> pv.PolyData:
    """Every quadratic triangle as four flat ones on the same points."""
    pv = load_pyvista()
    cells = grid.cells.reshape(-1, 7)[:, 1:]
    return pv.PolyData.from_regular_faces(np.array(grid.points), cells[:, _SPLIT].reshape(-1, 3))


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
    """A mesh coloured by its point data `text`, with a colour bar of that title under the scene."""
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
    points = _font(size)
    # Arial is about half as wide as high; text is placed by its lower left corner in pixels
    left = 0.5 * size - 0.42 * points * len(text)
    plotter.add_text(text, position=(left, 0.012 * size), font_size=points, color="black", name="bar title")


def add_text(plotter: pv.Plotter, text: str, size: int, *, name: str = "title") -> None:
    """Text in the upper left corner; a second call with the same name replaces it."""
    points = _font(size)
    top = size - 2.6 * points * (1 + text.count("\n")) - 0.01 * size
    plotter.add_text(text, position=(0.02 * size, top), font_size=points, color="black", name=name)


def rounded(value: float) -> str:
    """Two significant figures, without an exponent."""
    return f"{float(f'{value:.2g}'):,.0f}" if value >= 10 else f"{value:.2g}"


def _font(size: int) -> float:
    return max(size / 75, 7.0)


def look_down(plotter: pv.Plotter, half_height: float) -> None:
    """Parallel view on the plane of the set, with room for title and colour bar."""
    plotter.set_background("white")
    plotter.view_xy()
    plotter.enable_parallel_projection()
    camera = plotter.camera
    middle = -0.05 * half_height
    camera.focal_point, camera.position = (0.0, middle, 0.0), (0.0, middle, 10 * half_height)
    camera.parallel_scale = 1.1 * half_height
    plotter.reset_camera_clipping_range()


def write_png(plotter: pv.Plotter, path: str | os.PathLike) -> None:
    """Render, close the plotter, and write the picture whole or not at all."""
    import imageio.v3 as iio

    try:
        image = plotter.screenshot(filename=None, return_img=True)
    finally:
        plotter.close()
    stream = io.BytesIO()
    iio.imwrite(stream, image, extension=".png")
    data = stream.getvalue()
    replace_file(path, lambda temporary: temporary.write_bytes(data), size=len(data))
