"""Pictures of the lowest elastic modes of a drivetrain: discs on shafts, at rest and moved."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.scene import load_pyvista, new_plotter, write_png
from femgear.report.style import VERMILION
from femgear.trains.drivetrain.model import DrivetrainModel
from femgear.trains.drivetrain.parts import Drivetrain

if TYPE_CHECKING:
    import xarray as xr

# Radius of bodies that carry no gear, and distance of wheels side by side, over the largest gear radius.
_PLAIN, _WHEEL_GAP = 0.9, 0.45
# Phi of a shaft that shears and hardly bends: more does not show.
_SHEAR_ALONE = 1e6

_EDGES = {"boundary_edges": True, "feature_edges": True, "manifold_edges": False, "non_manifold_edges": False}
_REST, _MOVED = "#B0B0B0", VERMILION
_COLOURS = "displacement over the largest"
_VIEW = np.array([1.0, 0.55, -0.9])
# Lines stand this share of the size in front of the faces that they lie on; from afar nothing is shifted.
_FRONT = 3e-3
# Largest height of the picture over its width, and that of the title.
_HEIGHT, _TITLE = 0.72, 0.08
# Relative difference of frequencies of modes of one kind that are drawn as one: bending in both planes.
_PAIR = 1e-3
# Largest displacement over the size of the drivetrain.
_SHARE = 0.12


@dataclass(frozen=True)
class Wheel:
    """A disc that stands for a gear.

    ``name`` of the gear, ``centre`` (3,), ``radius`` and ``width`` [m]; ``body`` is the index of the body's centre in
    `Layout.centre`.
    """

    name: str
    centre: np.ndarray
    radius: float
    width: float
    body: int


@dataclass(frozen=True)
class Layout:
    """Discs, shafts between body centres, and places of all bodies.

    ``names`` and ``centre`` (n_bodies, 3) [m] of the bodies, planets last; ``wheels`` are the discs that stand for
    their gears, ``shafts`` pairs of body numbers. The drawing is a scheme: bodies without gears get a radius, and two
    wheels of one body stand side by side.
    """

    names: tuple[str, ...]
    centre: np.ndarray
    wheels: tuple[Wheel, ...]
    shafts: tuple[tuple[int, int], ...]


def drivetrain_layout(train: Drivetrain) -> Layout:
    """Place the bodies [m]: along z by shaft lengths, across it by centre distances."""
    names = [body.name for body in train.bodies]
    gears = [radius for s in train.parallel for radius in s.pitch_radii]
    gears += [stage.axis_distance for stage in train.planetary]
    size = max(gears, default=0.3)
    places = {names[0]: np.zeros(3)}
    links = [(*s.between, np.array([0.0, 0.0, s.length])) for s in train.shafts]
    seconds = [s.between[1] for s in train.parallel]
    for s in train.parallel:
        apart, beside = sum(s.pitch_radii), _WHEEL_GAP * size if s.between[0] in seconds else 0.0
        across = apart * math.cos(s.direction), apart * math.sin(s.direction)
        links.append((*s.between, np.array([*across, s.offsets[0] - s.offsets[1] + beside])))
    links += [(s.carrier, s.sun, np.zeros(3)) for s in train.planetary]
    for _ in names:
        for first, second, arm in links:
            if first in places:
                places.setdefault(second, places[first] + arm)
            elif second in places:
                places[first] = places[second] - arm
    centre = [places[name] for name in names]
    wheels = _wheels(train, places, size)
    for stage in train.planetary:
        for p, angle in enumerate(stage.angles, start=1):
            arm = stage.axis_distance * np.array([math.cos(angle), math.sin(angle), 0.0])
            centre.append(places[stage.carrier] + arm)
            wheels.append(Wheel(f"planet {p}", centre[-1], stage.pitch_radii[1], 0.2 * size, len(centre) - 1))
        names += train.planet_names(stage)
    shafts = tuple((names.index(s.between[0]), names.index(s.between[1])) for s in train.shafts)
    return Layout(tuple(names), np.array(centre), tuple(wheels), shafts)


def _wheels(train: Drivetrain, places, size: float) -> list[Wheel]:
    order = [body.name for body in train.bodies]
    wheels = []
    for stage in train.planetary:
        plate = places[stage.carrier] - np.array([0.0, 0.0, 0.2 * size])
        wheels.append((stage.carrier, plate, stage.axis_distance, 0.06 * size))
        wheels.append((stage.sun, places[stage.sun], stage.pitch_radii[0], 0.2 * size))
    for stage in train.parallel:
        first, second = (places[name] for name in stage.between)
        # in the plane of the second gear
        centres = np.array([first[0], first[1], second[2]]), second
        wheels += [(*wheel, 0.2 * size) for wheel in zip(stage.between, centres, stage.pitch_radii)]
    geared = {name for name, *_ in wheels}
    wheels += [(n, places[n], _PLAIN * size, 0.3 * size) for n in order if n not in geared]
    return [Wheel(name, centre, radius, width, order.index(name)) for name, centre, radius, width in wheels]


def layout_motion(model: DrivetrainModel, layout: Layout, shape) -> tuple[np.ndarray, np.ndarray]:
    """Compute translation and rotation vector (n, 3) of every place under a motion (n_free,) [m], [rad].

    Planets fixed to their pins follow the carrier, at its angle zero.
    """
    train, place, full = model.train, model.place, model.free @ shape
    move, turn = np.zeros((2, len(layout.names), 3))
    for row, body in enumerate(train.bodies):
        x, y, *turns = full[place.body[body.name] : place.body[body.name] + 5]
        move[row], turn[row] = (x, y, 0.0), turns
    row = len(train.bodies)
    for stage, planets in zip(train.planetary, place.planets):
        at = [body.name for body in train.bodies].index(stage.carrier)
        for planet in planets:
            arm = layout.centre[row] - layout.centre[at]
            move[row] = move[at] + np.cross(turn[at], arm)
            turn[row] = *turn[at][:2], full[planet[2]]
            row += 1
    return move, turn


def shaft_centre_lines(
    model: DrivetrainModel, layout: Layout, shape, *, points: int = 8
) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Compute the centre lines (k, 3) [m] of the shafts under a motion (n_free,): at rest, and displacements.

    A shaft passes through its stations, between them by the shape functions of its elements, each drawn in so
    many ``points``; one that is modelled as a joint is drawn as the one element whose static stiffness the
    joint stands for. In the order of the shafts of the chain.
    """
    place, full = model.place, model.free @ shape
    lines = []
    for shaft, first, ends in zip(model.train.shafts, place.stations, layout.shafts):
        stations = full[np.array(first)[:, None] + np.arange(5)]
        share, across = _beam_line(shaft, stations, points if shaft.elements else 3 * points)
        start, end = layout.centre[list(ends)]
        rest = start + share[:, None] * (end - start)
        lines.append((rest, np.column_stack([across, np.zeros(len(share))])))
    return tuple(lines)


def _beam_line(shaft, stations, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the length (k,) and displacements (k, 2) of a beam through its stations (n + 1, 5)."""
    count = max(shaft.elements, 1)
    length = shaft.length / count
    share = np.linspace(0.0, 1.0, count * points + 1)
    element = np.minimum(np.arange(len(share)) // points, count - 1)
    ratio = shaft.section.shear_ratio(length) if shaft.elements else _joint_shear_ratio(shaft)
    N = beam_shape(share * count - element, length, ratio)
    # a tilt about y is the slope of x, one about x minus that of y
    ends = np.stack([stations[element], stations[element + 1]], axis=1)
    x = np.einsum("kn,kn->k", N, ends[:, :, [0, 3]].reshape(-1, 4))
    y = np.einsum("kn,kn->k", N, (ends[:, :, [1, 2]] * np.array([1.0, -1.0])).reshape(-1, 4))
    return share, np.column_stack([x, y])


def _joint_shear_ratio(shaft) -> float:
    """Phi of the Timoshenko shaft whose static stiffness is that of a joint's springs.

    Bending ``E I / l`` and shear ``12 E I / ((1 + Phi) l^3)``, `femgear.fe.beam.joint_springs`. Under a
    spherical joint no force crosses the shaft, which then bends to a parabola whatever Phi is.
    """
    springs = shaft.springs
    if math.isinf(springs.shear):
        return 0.0
    return float(np.clip(12.0 * springs.bending / (springs.shear * shaft.length**2) - 1.0, 0.0, _SHEAR_ALONE))


def beam_shape(xi, length: float, shear_ratio: float) -> np.ndarray:
    """Compute the deflection (k, 4) of a Timoshenko element per (w, slope) at its ends [m], [rad].

    Exact for an element of a length [m] without load, with the ``shear_ratio`` Phi of
    `femgear.fe.beam.RoundSection`; ``xi`` (k,) runs from 0 to 1, ``slope`` is the turn of the section.
    These are the functions behind the consistent mass of `femgear.fe.beam.beam_element`
    (J. S. Przemieniecki, Theory of Matrix Structural Analysis, 1968, section 11.3; Z. Friedman and
    J. B. Kosmatka, Comput. Struct. 47, 1993, 473-481).
    """
    xi, phi = np.asarray(xi, float), shear_ratio
    rest = 1.0 - xi
    return np.stack(
        [
            1.0 - 3.0 * xi**2 + 2.0 * xi**3 + phi * rest,
            length * (xi * rest**2 + 0.5 * phi * xi * rest),
            3.0 * xi**2 - 2.0 * xi**3 + phi * xi,
            -length * (xi**2 * rest + 0.5 * phi * xi * rest),
        ],
        axis=-1,
    ) / (1.0 + phi)


def draw_motion(
    path: Path, layout: Layout, move, turn, shafts: Sequence[tuple] = (), *, title: str = "", size: int = 1000
) -> float:
    """Draw a motion as PNG: every disc moves as a rigid body, shafts are the lines that they are given.

    FemgearError: see `femgear.report.scene.load_pyvista`. StorageError where the file cannot be written.

    Parameters
    ----------
    layout : Layout
        Discs, and the names of the places that are written beside them.
    move, turn : (n, 3) arrays
        Translation and rotation vector of every place, in the proportions of the motion [m], [rad].
    shafts : sequence of (rest (k, 3), displacement (k, 3))
        Centre lines [m].
    size : int
        Width in pixels.

    Returns
    -------
    float
        The factor of the motion.
    """
    pv, plotter = load_pyvista(), new_plotter(size, round(_HEIGHT * size))
    plotter.set_background("white")  # type: ignore[call-arg]
    plotter.enable_parallel_projection()  # type: ignore[call-arg]
    scale, points = _add_shape(pv, plotter, layout, move, turn, shafts)
    height = _frame(plotter, points, size)
    _add_texts(plotter, title, layout, size, height)
    write_png(plotter, path)
    return scale


def _add_shape(pv, plotter, layout: Layout, move, turn, lines):
    """Discs and shafts, at rest and moved; the factor of the motion, and all points of the discs (n, 3)."""
    centres, places = layout.centre, [wheel.body for wheel in layout.wheels]
    discs = [_disc(pv, wheel) for wheel in layout.wheels]
    fields = [move[p] + np.cross(turn[p], d.points - centres[p]) for d, p in zip(discs, places)]
    lengths = [np.linalg.norm(field, axis=1) for field in (*fields, *(across for _, across in lines))]
    extent = np.ptp(np.vstack([disc.points for disc in discs]), axis=0).max()
    # a shaft may move more than any disc
    reach = max(length.max() for length in lengths)
    scale = _SHARE * extent / reach if reach > 0.0 else 0.0
    moves = [(centres[p], scale * move[p], scale * turn[p]) for p in places]
    rest, whole = pv.merge(discs, merge_points=False), pv.merge(discs, merge_points=False)
    whole.points = np.vstack([_moved(disc.points, *motion) for disc, motion in zip(discs, moves)])
    length = np.concatenate(lengths[: len(discs)])
    whole[_COLOURS] = length / (length.max() or 1.0)
    style = {"cmap": "cividis", "clim": (0.0, 1.0), "lighting": False, "show_scalar_bar": False}
    plotter.add_mesh(whole, scalars=_COLOURS, **style)
    spokes = [_spoke(wheel) for wheel in layout.wheels]
    turned = [_moved(spoke, *motion) for spoke, motion in zip(spokes, moves)]
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


def _add_texts(plotter, title: str, layout: Layout, size: int, height: int) -> None:
    """Title, and names beside the wheels, but for planets."""
    radius = np.zeros(len(layout.centre))
    for wheel in layout.wheels:
        radius[wheel.body] = max(radius[wheel.body], wheel.radius)
    named = [i for i, name in enumerate(layout.names) if "planet" not in name]
    plotter.add_point_labels(
        layout.centre[named] + np.array([0.0, 1.0, 0.0]) * radius[named, None] * 1.15,
        [layout.names[i] for i in named],
        font_size=max(size // 45, 10),
        bold=False,
        shape="rect",
        shape_color="white",
        shape_opacity=0.7,
        margin=1,
        show_points=False,
        text_color="black",
        always_visible=True,
    )
    if title:
        place = (0.02 * size, height - 0.6 * _TITLE * size)
        plotter.add_text(title, position=place, font_size=max(size / 75, 7.0), color="black", name="title")


def _frame(plotter, points, size: int) -> int:
    """Parallel view that holds all points (n, 3) and the title; the height of the picture [pixels]."""
    away = _VIEW / np.linalg.norm(_VIEW)
    right = np.cross([0.0, 1.0, 0.0], away)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(away, right), away])
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    wide, tall, _ = 1.1 * (high - low)
    pixel = max(wide / size, tall / ((_HEIGHT - _TITLE) * size))
    height = round(tall / pixel + _TITLE * size)
    plotter.window_size = [size, height]
    middle = 0.5 * (low + high) + [0.0, 0.5 * _TITLE * size * pixel, 0.0]
    camera = plotter.camera
    camera.focal_point = middle @ axes
    camera.position = camera.focal_point + 10.0 * max(wide, tall) * away
    camera.up, camera.parallel_scale = (0.0, 1.0, 0.0), 0.5 * height * pixel
    plotter.reset_camera_clipping_range()
    return height


def _moved(points, centre, shift, turn) -> np.ndarray:
    """Points turned by a rotation vector about a centre, and shifted: rigid, however large the angle."""
    from scipy.spatial.transform import Rotation

    return centre + Rotation.from_rotvec(turn).apply(points - centre) + shift


def _spoke(wheel: Wheel) -> np.ndarray:
    """A radius on the front face of a disc (2, 3), which shows how far it turns."""
    face = np.asarray(wheel.centre) - np.array([0.0, 0.0, 0.51 * wheel.width])
    return np.array([face, face + np.array([0.0, wheel.radius, 0.0])])


def _disc(pv, wheel: Wheel):
    """A disc with its axis along z."""
    axis = (0.0, 0.0, 1.0)
    disc = pv.Cylinder(center=wheel.centre, direction=axis, radius=wheel.radius, height=wheel.width, resolution=48)
    return disc.triangulate()


def _polylines(pv, lines):
    """Several lines (k, 3) as one mesh."""
    ends = np.cumsum([0, *(len(line) for line in lines)])
    cells = [np.append(b - a, np.arange(a, b)) for a, b in itertools.pairwise(ends)]
    return pv.PolyData(np.vstack(lines), lines=np.concatenate(cells)) if lines else pv.PolyData()


def write_mode_pictures(folder: Path, model: DrivetrainModel, modes: xr.Dataset, count: int) -> list[str]:
    """Draw as many of the lowest elastic modes as PNG files; returns their names.

    Modes have the numbers of the table: the free spin, which is not drawn, is the first. Two modes of one
    kind and nearly one frequency, bending in both planes, are drawn as the first of them.
    """
    layout, names = drivetrain_layout(model.train), []
    kinds, hertz = modes["kind"].values.astype(str), modes["frequency"].values
    elastic = np.flatnonzero(kinds != "rigid")
    apart = np.diff(hertz[elastic]) > _PAIR * hertz[elastic][1:]
    apart |= kinds[elastic][1:] != kinds[elastic][:-1]
    for pair in np.split(elastic, np.flatnonzero(apart) + 1)[:count]:
        mode, shape = int(pair[0]), modes["shape"].values[:, pair[0]]
        title = f"mode{'s' * (len(pair) > 1)} {' and '.join(str(number + 1) for number in pair)}"
        title += f": {hertz[mode]:.2f} Hz, {kinds[mode]}"
        names.append(f"drivetrain_mode_{mode + 1}.png")
        move, turn = layout_motion(model, layout, shape)
        draw_motion(folder / names[-1], layout, move, turn, shaft_centre_lines(model, layout, shape), title=title)
    return names
