"""Pictures of drivetrains: discs on shafts, at rest and moved."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from femgear.scene.drawing import add_coloured, add_text, write_png
from femgear.scene.library import load_pyvista


def drivetrain_picture(
    path: str | os.PathLike,
    *,
    wheels: Sequence[tuple],
    centres,
    shafts: Sequence[tuple[int, int]],
    move,
    turn,
    names: Sequence[str] = (),
    title: str = "",
    share: float = 0.12,
    size: int = 1000,
) -> float:
    """Picture of a mode shape: every disc moves as a rigid body, shafts are two straight links.

    Parameters
    ----------
    path : path-like
        PNG file.
    wheels : sequence of (centre (3,), radius, width, place)
        Discs, and the number of the place they are fixed to [m].
    centres : (n, 3) array
        Places [m].
    shafts : sequence of (place, place)
    move, turn : (n, 3) arrays
        Translation and rotation vector of every place, in the proportions of the mode.
    names : (n,) sequence of str
        Written beside the places.
    title : str
    share : float
        Largest displacement over the size of the drivetrain.
    size : int
        Width and height in pixels.

    Returns
    -------
    float
        The factor of the shape.
    """
    pv = load_pyvista()
    centres, move, turn = (np.asarray(one, float) for one in (centres, move, turn))
    discs = [_disc(pv, *wheel[:3]) for wheel in wheels]
    fields = [move[p] + np.cross(turn[p], d.points - centres[p]) for d, (*_, p) in zip(discs, wheels)]
    largest = max(np.linalg.norm(field, axis=1).max() for field in fields)
    extent = np.ptp(np.vstack([disc.points for disc in discs]), axis=0).max()
    # the joint of a shaft may move more than any disc
    joints = [_links(0.0 * centres, move, turn, *ends, 1.0, arms=centres) for ends in shafts]
    reach = max(largest, *(np.linalg.norm(one, axis=1).max() for one in joints)) if joints else largest
    scale = share * extent / reach if reach > 0.0 else 0.0
    plotter = pv.Plotter(off_screen=True, window_size=(size, size))
    plotter.enable_anti_aliasing("ssaa")
    text = "displacement over the largest"
    moved = pv.MultiBlock()
    for disc, field, (centre, radius, width, place) in zip(discs, fields, wheels):
        rest = disc.extract_feature_edges(**_EDGES)
        plotter.add_mesh(rest, color="#B0B0B0", line_width=1.0, lighting=False)
        one = disc.copy()
        one.points = _moved(disc.points, centres[place], scale * move[place], scale * turn[place])
        one[text] = np.linalg.norm(field, axis=1) / largest
        plotter.add_mesh(one.extract_feature_edges(**_EDGES), color="black", line_width=1.0, lighting=False)
        moved.append(one)
        for part, colour in ((0.0, "#B0B0B0"), (scale, "#D55E00")):
            spoke = _moved(
                _spoke(centre, radius, width), centres[place], part * move[place], part * turn[place]
            )
            plotter.add_mesh(pv.lines_from_points(spoke), color=colour, line_width=3.0, lighting=False)
    surface = moved.combine().extract_surface(algorithm=None)
    add_coloured(plotter, surface, text, size, cmap="cividis", limits=(0.0, 1.0))
    for first, second in shafts:
        for factor, colour, width in ((0.0, "#B0B0B0", 2.0), (scale, "#D55E00", 5.0)):
            line = _links(centres, move, turn, first, second, factor)
            plotter.add_mesh(pv.lines_from_points(line), color=colour, line_width=width, lighting=False)
    if len(names):
        labels = centres + np.array([0.0, 1.0, 0.0]) * _heights(wheels, len(centres))[:, None] * 1.15
        plotter.add_point_labels(
            labels, list(names), font_size=max(size // 60, 10), shape=None, show_points=False,
            text_color="black",
            always_visible=True,
        )  # fmt: skip
    if title:
        add_text(plotter, title, size)
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    plotter.view_vector((1.0, 0.55, -0.9), viewup=(0.0, 1.0, 0.0))
    plotter.camera.zoom(1.05)
    write_png(plotter, path)
    return float(scale)


_EDGES = {"boundary_edges": True, "feature_edges": True, "manifold_edges": False, "non_manifold_edges": False}


def _moved(points, centre, shift, turn) -> np.ndarray:
    """Points turned by a rotation vector about a centre, and shifted: rigid, however large the angle."""
    from scipy.spatial.transform import Rotation

    return centre + shift + Rotation.from_rotvec(turn).apply(points - centre)


def _spoke(centre, radius, width) -> np.ndarray:
    """A radius on the front face of a disc (2, 3), which shows how far it turns."""
    face = np.asarray(centre) - np.array([0.0, 0.0, 0.51 * width])
    return np.array([face, face + np.array([0.0, radius, 0.0])])


def _disc(pv, centre, radius, width):
    """A disc with its axis along z."""
    disc = pv.Cylinder(center=centre, direction=(0.0, 0.0, 1.0), radius=radius, height=width, resolution=48)
    return disc.triangulate()


def _links(centres, move, turn, first, second, scale, *, arms=None) -> np.ndarray:
    """Ends and the two sides of the joint of a shaft (4, 3); ``arms`` are the places where they differ."""
    one, two = centres[first], centres[second]
    arms = centres if arms is None else arms
    half, rest = 0.5 * (arms[second] - arms[first]), 0.5 * (two - one)
    return np.array([
        one + scale * move[first],
        one + rest + scale * (move[first] + np.cross(turn[first], half)),
        two - rest + scale * (move[second] - np.cross(turn[second], half)),
        two + scale * move[second],
    ])  # fmt: skip


def _heights(wheels, count: int) -> np.ndarray:
    """Largest radius at every place (n,)."""
    found = np.zeros(count)
    for _, radius, _, place in wheels:
        found[place] = max(found[place], radius)
    return found
