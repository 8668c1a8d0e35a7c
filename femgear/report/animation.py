"""The ring's operating deflection while the carrier turns past a fixed sensor, animated by PyVista."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from femgear.gears.gear import Gear
from femgear.gears.kinematics import orientations
from femgear.gears.planetary import PlanetarySet
from femgear.gears.tooth import half_sector
from femgear.report.scene import add_coloured, add_text, load_pyvista, look_down, new_plotter, rounded
from femgear.storage.files import replace_file

_SECONDS = 6.0
"""Length of an animation."""
_LARGEST = 0.09
"""Largest displacement as a share of the outer radius."""
# elements of a flank before the factor that divides all spacing: outlines of some twenty points a tooth
_FLANK, _COARSE = 10, 0.4
_SUN, _PLANET, _MARK, _SENSOR = "#D55E00", "#E69F00", "#000000", "#009E73"


def animate_operating_deflection(
    path: str | os.PathLike,
    planetary_set: PlanetarySet,
    *,
    radial: np.ndarray,
    tangential: np.ndarray,
    sensor_angle: float = 0.0,
    clockwise: bool = False,
    title: str = "",
    frames: int = 48,
    size: int = 480,
) -> int:
    """Animate one revolution of the carrier, six seconds; every frame is a true instant of the motion.

    The mean deflection, which turns with the carrier, is left out; the largest displacement takes 9 % of the
    outer radius. The number of frames is adjusted so that the meshes, seen frame by frame, pass slowly
    through a few cycles, as under a stroboscope (see `strobe_frames`).

    Parameters
    ----------
    path : path-like
        GIF file.
    planetary_set : PlanetarySet
    radial, tangential : (H + 1, 2 n_max + 1) complex arrays
        Components of the outer surface's displacement [m]:
        ``u(phi, t) = Re sum U[h, n] e^{i n phi} e^{i h omega t}``, phi in the frame of the carrier.
    sensor_angle : float
        Place of the fixed sensor on the housing [rad].
    clockwise : bool
        Whether the carrier turns clockwise.
    title : str
    frames : int
        Number of frames wished for.
    size : int
        Width and height in pixels.

    Returns
    -------
    int
        Number of frames written.

    Raises
    ------
    FemgearError
        Without the OpenGL library.
    StorageError
        When the file cannot be written.
    """
    field = _Field(radial, tangential, -1.0 if clockwise else 1.0, planetary_set.ring.teeth)
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
    """Deflection of the ring about its mean in the frame of the carrier, sampled by angle and instant."""

    radial: np.ndarray
    tangential: np.ndarray
    turn: float
    teeth: int

    def at(self, angle: np.ndarray, carrier_angle: float) -> tuple[np.ndarray, np.ndarray]:
        """Compute radial and tangential displacement [m] at housing angles for an angle of the carrier."""
        h, n_max = np.arange(self.radial.shape[0]), self.radial.shape[1] // 2
        # the mesh frequency is the ring's number of teeth times the carrier's, whichever way it turns
        time = np.exp(1j * h * self.teeth * carrier_angle * self.turn) * (h > 0)
        wave = np.exp(1j * np.outer(angle - carrier_angle, np.arange(-n_max, n_max + 1)))
        return (wave @ (time @ self.radial)).real, (wave @ (time @ self.tangential)).real


def _draw(planetary_set, field, carrier, sensor_angle, title, size):
    """Draw the frames, arrays (size, size, 3), one for every angle of the carrier [rad]."""
    pv, plotter = load_pyvista(), new_plotter(size)
    outer, text = planetary_set.ring.rim_radius, "radial displacement [µm]"
    corners = _ring_corners(planetary_set)
    ring_angle = np.angle(corners)
    around = np.linspace(0.0, 2 * np.pi, 181)
    on_surface = [field.at(around, c) for c in carrier]
    largest = max(np.hypot(*one).max() for one in on_surface)
    colour = max(np.abs(one[0]).max() for one in on_surface) * 1e6 or 1.0
    scale = _LARGEST * outer / largest if largest > 0 else 1.0
    ring = pv.PolyData.from_regular_faces(_plane(corners.ravel()), _strip_faces(*corners.shape))
    ring.point_data[text] = np.zeros(corners.size)
    circle = _closed_line(pv, outer * np.exp(1j * around[:-1]))
    plotter.add_mesh(circle, color="#808080", line_width=1.0, lighting=False)
    add_coloured(plotter, ring, text, size, cmap="RdBu_r", limits=(-colour, colour), colours=21)
    edges = [_closed_line(pv, corners[:, column]) for column in (0, -1)]
    for edge in edges:
        plotter.add_mesh(edge, color="#404040", line_width=1.0, lighting=False)
    discs = _discs(pv, plotter, planetary_set)
    _add_sensor(pv, plotter, sensor_angle, outer * 1.1, outer)
    add_text(plotter, f"{title}\nring deflection × {rounded(scale)}, triangle: fixed sensor".strip(), size)
    look_down(plotter, outer * 1.26)
    images = []
    try:
        for angle in carrier:
            radial, tangential = (u.reshape(corners.shape) for u in field.at(ring_angle.ravel(), angle))
            moved = corners + scale * (radial + 1j * tangential) * np.exp(1j * ring_angle)
            ring.points = _plane(moved.ravel())
            ring.point_data[text] = 1e6 * radial.ravel()
            for edge, column in zip(edges, (0, -1)):
                edge.points = _plane(moved[:, column])
            for (centre, turn), pairs in zip(_places(planetary_set, angle), discs):
                for mesh, outline in pairs:
                    mesh.points = _plane(centre + outline * np.exp(1j * turn))
            plotter.render()
            images.append(np.asarray(plotter.screenshot(filename=None, return_img=True))[..., :3])
    finally:
        plotter.close()
    return images


def gear_outline(gear: Gear) -> np.ndarray:
    """Draw the exact outline of all teeth, the first centred on angle 0.

    Parameters
    ----------
    gear : Gear

    Returns
    -------
    (n,) complex array
        [m], counter-clockwise: involutes with their generated fillets, tip and root circles.
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


def _discs(pv, plotter, planetary_set):
    """Add sun and planets, a mark on each: of every body its meshes and their points in its own frame."""
    discs = []
    sun, planet = planetary_set.sun, planetary_set.planet
    for gear, colour in ((sun, _SUN), *((planet, _PLANET) for _ in planetary_set.planet_angles)):
        edge = gear_outline(gear)
        mark = gear.root_radius * 0.8 + 0.07 * gear.root_radius * np.exp(2j * np.pi * np.arange(12) / 12)
        discs.append([])
        for outline, tint in ((edge, colour), (mark, _MARK)):
            points = np.append(outline, outline.mean())
            n = len(outline)
            fan = np.column_stack([np.arange(n), (np.arange(n) + 1) % n, np.full(n, n)])
            mesh = pv.PolyData.from_regular_faces(_plane(points), fan)
            plotter.add_mesh(mesh, color=tint, lighting=False)
            discs[-1].append((mesh, points))
    return discs


def _add_sensor(pv, plotter, angle, radius, size):
    """Add a triangle that points at the ring from outside."""
    direction = np.exp(1j * angle)
    tip = radius * direction
    points = tip + size * direction * np.array([0.0, 0.12 + 0.035j, 0.12 - 0.035j])
    mesh = pv.PolyData.from_regular_faces(_plane(points), [[0, 1, 2]])
    plotter.add_mesh(mesh, color=_SENSOR, lighting=False)


def _closed_line(pv, points):
    """Make a closed line through complex points."""
    return pv.PolyData(_plane(points), lines=[len(points) + 1, *range(len(points)), 0])


def _strip_faces(around: int, across: int) -> np.ndarray:
    """Number the triangles of a closed strip of points numbered around first, across second."""
    i, j = np.meshgrid(np.arange(around), np.arange(across - 1), indexing="ij")
    a, b = i * across + j, ((i + 1) % around) * across + j
    return np.concatenate([np.stack([a, b, a + 1], -1), np.stack([a + 1, b, b + 1], -1)]).reshape(-1, 3)


def _plane(points) -> np.ndarray:
    """Turn complex points into points in space, (n, 3)."""
    return np.column_stack([points.real, points.imag, np.zeros(len(points))])


def _write_gif(path, images) -> None:
    """Write the frames, whole or not at all."""
    import imageio.v3 as iio

    duration, size = 1000.0 * _SECONDS / len(images), sum(image.nbytes for image in images) // 20
    replace_file(path, lambda new: iio.imwrite(new, images, duration=duration, loop=0), size=size)
