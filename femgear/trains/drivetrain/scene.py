"""Pictures of drivetrains: discs on shafts, at rest and moved."""

from __future__ import annotations

import io
import itertools
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from femgear.report.scene import add_coloured, load_pyvista
from femgear.storage.files import replace_file

_EDGES = {"boundary_edges": True, "feature_edges": True, "manifold_edges": False, "non_manifold_edges": False}
_REST, _MOVED = "#B0B0B0", "#D55E00"
_COLOURS = "displacement over the largest"
_VIEW = np.array([1.0, 0.55, -0.9])
# Lines stand this share of the size in front of the faces that they lie on; from afar nothing is shifted.
_FRONT = 3e-3
# Height of the picture over its width.
_HEIGHT = 0.72
# Shares of the height between which the drivetrain stands.
_ROOM = (0.22, 0.88)


@dataclass(frozen=True)
class ModeView:
    """One picture of a mode shape.

    Parameters
    ----------
    path : path-like
        PNG file.
    title : str
    move, turn : (n, 3) arrays
        Translation and rotation vector of every place, in the proportions of the mode.
    shafts : sequence of (rest (k, 3), displacement (k, 3))
        Centre lines [m].
    """

    path: str | os.PathLike
    title: str
    move: np.ndarray
    turn: np.ndarray
    shafts: Sequence[tuple[np.ndarray, np.ndarray]] = ()


def drivetrain_pictures(
    views: Iterable[ModeView],
    *,
    wheels: Sequence[tuple],
    centres,
    names: Sequence[str] = (),
    share: float = 0.12,
    size: int = 1000,
) -> list[float]:
    """Pictures of mode shapes: every disc moves as a rigid body, shafts are the lines that they are given.

    Parameters
    ----------
    views : iterable of ModeView
    wheels : sequence of (centre (3,), radius, width, place)
        Discs, and the number of the place they are fixed to [m].
    centres : (n, 3) array
        Places [m].
    names : (n,) sequence of str
        Written beside the places.
    share : float
        Largest displacement over the size of the drivetrain.
    size : int
        Width in pixels.

    Returns
    -------
    list of float
        The factors of the shapes.

    Raises
    ------
    FemgearError
        See `load_pyvista`.
    StorageError
        When a file cannot be written.
    """
    pv, centres = load_pyvista(), np.asarray(centres, float)
    discs = [_disc(pv, *wheel[:3]) for wheel in wheels]
    # one window for all: opening it takes as long as drawing
    plotter = pv.Plotter(off_screen=True, window_size=(size, round(_HEIGHT * size)))
    plotter.enable_anti_aliasing("ssaa")
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    found = []
    try:
        for view in views:
            plotter.suppress_rendering = True
            plotter.clear()
            scale, points = _add_shape(pv, plotter, view, discs, wheels, centres, share, size)
            _add_texts(plotter, view.title, names, centres, wheels, size)
            _frame(plotter, points)
            plotter.suppress_rendering = False
            plotter.render()
            _write(plotter, view.path)
            found.append(scale)
    finally:
        plotter.close()
    return found


def _add_shape(pv, plotter, view: ModeView, discs, wheels, centres, share, size):
    """Discs and shafts, at rest and moved; the factor of the shape, and all points of the discs (n, 3)."""
    move, turn = np.asarray(view.move, float), np.asarray(view.turn, float)
    lines = [tuple(np.asarray(one, float) for one in pair) for pair in view.shafts]
    fields = [move[p] + np.cross(turn[p], d.points - centres[p]) for d, (*_, p) in zip(discs, wheels)]
    lengths = [np.linalg.norm(one, axis=1) for one in (*fields, *(across for _, across in lines))]
    extent = np.ptp(np.vstack([disc.points for disc in discs]), axis=0).max()
    # a shaft may move more than any disc
    reach = max(length.max() for length in lengths)
    scale = share * extent / reach if reach > 0.0 else 0.0
    moves = [(centres[p], scale * move[p], scale * turn[p]) for *_, p in wheels]
    rest, whole = pv.merge(discs, merge_points=False), pv.merge(discs, merge_points=False)
    whole.points = np.vstack([_moved(disc.points, *own) for disc, own in zip(discs, moves)])
    length = np.concatenate(lengths[: len(discs)])
    whole[_COLOURS] = length / (length.max() or 1.0)
    add_coloured(plotter, whole, _COLOURS, size, cmap="cividis", limits=(0.0, 1.0))
    spokes = [_spoke(*wheel[:3]) for wheel in wheels]
    turned = [_moved(spoke, *own) for spoke, own in zip(spokes, moves)]
    for mesh, colour, width, front in (
        (rest.extract_feature_edges(**_EDGES), _REST, 2.0, 0.0),
        (_polylines(pv, [*spokes, *(line for line, _ in lines)]), _REST, 3.0, 0.0),
        (whole.extract_feature_edges(**_EDGES), "black", 2.0, _FRONT),
        (_polylines(pv, turned), _MOVED, 6.0, _FRONT),
        (_polylines(pv, [line + scale * across for line, across in lines]), _MOVED, 9.0, 0.0),
    ):
        if mesh.n_points:
            mesh.points = mesh.points + front * extent * _VIEW
            plotter.add_mesh(mesh, color=colour, line_width=width, lighting=False)
    return float(scale), np.vstack([rest.points, whole.points])


def _add_texts(plotter, title: str, names, centres, wheels, size: int) -> None:
    """Title, names beside the places, and the colour bar where this flat picture has room for it."""
    height = round(_HEIGHT * size)
    bar = plotter.scalar_bars[" "]
    bar.SetPosition(0.2, 0.065)
    if len(names):
        labels = centres + np.array([0.0, 1.0, 0.0]) * _heights(wheels, len(centres))[:, None] * 1.15
        plotter.add_point_labels(
            labels, list(names), font_size=max(size // 60, 10), shape="rect", shape_color="white",
            shape_opacity=0.6, margin=1, show_points=False, text_color="black", always_visible=True,
        )  # fmt: skip
    if title:
        place = (0.02 * size, height - 0.045 * size)
        plotter.add_text(title, position=place, font_size=max(size / 75, 7.0), color="black", name="title")


def _frame(plotter, points) -> None:
    """Parallel view that holds all points (n, 3), with room for title and colour bar."""
    away = _VIEW / np.linalg.norm(_VIEW)
    right = np.cross([0.0, 1.0, 0.0], away)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(away, right), away])
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    half = 0.5 * (high - low)
    camera, bottom, top = plotter.camera, *_ROOM
    scale = max(half[1] / (top - bottom), 1.06 * _HEIGHT * half[0])
    middle = 0.5 * (low + high) - [0.0, (bottom + top - 1.0) * scale, 0.0]
    camera.focal_point = middle @ axes
    camera.position = camera.focal_point + 10.0 * half.max() * away
    camera.up, camera.parallel_scale = (0.0, 1.0, 0.0), scale
    plotter.reset_camera_clipping_range()


def _write(plotter, path) -> None:
    """The picture whole or not at all; the window stays open."""
    import imageio.v3 as iio

    stream, image = io.BytesIO(), plotter.screenshot(filename=None, return_img=True)
    iio.imwrite(stream, image, extension=".png", compress_level=4)
    data = stream.getvalue()
    replace_file(path, lambda temporary: temporary.write_bytes(data), size=len(data))


def _moved(points, centre, shift, turn) -> np.ndarray:
    """Points turned by a rotation vector about a centre, and shifted: rigid, however large the angle."""
    from pyvista.core.utilities.transformations import axis_angle_rotation

    angle = float(np.linalg.norm(turn))
    if angle > 0.0:
        points = centre + (points - centre) @ axis_angle_rotation(turn / angle, angle, deg=False)[:3, :3].T
    return points + shift


def _spoke(centre, radius, width) -> np.ndarray:
    """A radius on the front face of a disc (2, 3), which shows how far it turns."""
    face = np.asarray(centre) - np.array([0.0, 0.0, 0.51 * width])
    return np.array([face, face + np.array([0.0, radius, 0.0])])


def _disc(pv, centre, radius, width):
    """A disc with its axis along z."""
    disc = pv.Cylinder(center=centre, direction=(0.0, 0.0, 1.0), radius=radius, height=width, resolution=48)
    return disc.triangulate()


def _polylines(pv, lines):
    """Several lines (k, 3) as one mesh."""
    ends = np.cumsum([0, *(len(line) for line in lines)])
    cells = [np.append(b - a, np.arange(a, b)) for a, b in itertools.pairwise(ends)]
    return pv.PolyData(np.vstack(lines), lines=np.concatenate(cells)) if lines else pv.PolyData()


def _heights(wheels, count: int) -> np.ndarray:
    """Largest radius at every place (n,)."""
    found = np.zeros(count)
    for _, radius, _, place in wheels:
        found[place] = max(found[place], radius)
    return found
