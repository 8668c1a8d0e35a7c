"""A planetary set in space for the page: exact teeth as wide as they are, its static state and its modes.

Every gear is one sector of its grid and the number of copies; the browser makes the rest.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.fe.grid import Grid, shape_functions

if TYPE_CHECKING:
    import xarray as xr

    from femgear.contact.tooth_loads import DeformedBody
    from femgear.fe.elasticity import Material
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet
    from femgear.gears.short_teeth import MarkedTeeth, ShortTeeth

SOLID = "solid.json"
"""File of what the page turns in space."""
_MODES = 24
"""Modes that can be chosen."""
_WAVES = 1e-3
"""Waves around the ring below this share of the largest of a mode are left out."""
_PIN = 0.6
"""Radius of a pin over that of the bore of its planet."""
_AXES = {"x": 1e3, "y": 1e3, "rotation": 1.0}
"""Coordinates of a body, and what turns them into mm and rad."""
_HANDS = {"sun": 1, "planet": -1, "ring": -1}
"""Hand of the teeth over that of the sun: external mates have opposite hands, a ring its planets'."""


def solid(
    planetary_set: PlanetarySet,
    grids: dict[str, Grid],
    bodies: Iterable[DeformedBody],
    materials: Mapping[str, Material],
    modes: xr.Dataset | None = None,
    *,
    helix_angle: float = 0.0,
    backwards: bool = False,
    short: Mapping[str, ShortTeeth] | None = None,
    marked: Mapping[str, MarkedTeeth] | None = None,
) -> dict[str, Any]:
    """Collect what the browser draws of a set in space.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Of helical gears their transverse section.
    grids : dict of str to Grid
        One sector of ``"sun"``, ``"planet"``, ``"ring"``, centred on the origin.
    bodies : iterable of deformed bodies
        With displacements (teeth, n, 2) [m] in the frame of every sector.
    materials : mapping of str to Material
        Of the same gears.
    modes : xarray.Dataset, optional
        Of modes.nc.
    helix_angle : float
        On the reference cylinders [rad], positive where the sun is right-handed.
    backwards : bool
        The right flanks of the sun carry: contact runs along the other lines of action.
    short : mapping, optional
        Teeth that are missing or short by the names of the bodies, as their sectors are counted.
    marked : mapping, optional
        Faulty teeth by the names of the bodies, as their sectors are counted, and what is said of them.

    Returns
    -------
    dict
        What JSON can hold: lengths in mm, displacements in um, stresses in MPa; of modes, displacements in mm
        and rotations in rad at one amplitude. Sections of a sector turn by its ``twist`` [rad] over the face
        width, counter-clockwise towards the viewer.
    """
    sectors = {kind: _Sector(grid) for kind, grid in grids.items()}
    moved_bodies = []
    for body in bodies:
        sector, moved = sectors[body.kind], np.asarray(body.displacement)
        stress = np.stack([von_mises(grids[body.kind], displacement, materials[body.kind]) for displacement in moved])
        moved_bodies.append(
            {
                "name": body.name,
                "kind": body.kind,
                "centre": [1e3 * float(x) for x in body.centre],
                "angle": float(body.angle),
                "displacement": packed_values(1e6 * moved[:, sector.nodes]),
                "stress": packed_values(1e-6 * stress[:, sector.nodes]),
                "short": [[number, 1e3 * radius] for number, radius in (short or {}).get(body.name, ())],
                "marked": [list(tooth) for tooth in (marked or {}).get(body.name, ())],
            }
        )
    gears = {gear.name: gear for gear in planetary_set.gears}
    return {
        "width": 1e3 * max(gear.face_width for gear in gears.values()),
        "radius": 1e3 * planetary_set.ring.rim_radius,
        "pins": {
            "radius": 1e3 * _PIN * float(np.hypot(*sectors["planet"].points.T).min()),
            "centres": [body["centre"] for body in moved_bodies if body["kind"] == "planet"],
        },
        "sectors": {kind: sectors[kind].packed(gear, helix_angle) for kind, gear in gears.items()},
        "bodies": moved_bodies,
        "modes": [] if modes is None else _modes(modes),
        "paths": _paths(planetary_set, backwards=backwards),
    }


def _paths(s: PlanetarySet, *, backwards: bool = False) -> list[list[float]]:
    """Ends (x, y, x, y) [mm] of the paths of contact of all meshes, from the first contact to the last one.

    The line of action stands at the working pressure angle to the common tangent of the pitch circles.
    """
    paths, side = [], -1.0 if backwards else 1.0
    for gear, angle, path, sense in (
        (s.sun, s.working_pressure_angle_sun_planet, s.path_sun_planet, side),
        (s.ring, s.working_pressure_angle_planet_ring, s.path_planet_ring, -side),
    ):
        pitch, cosine = gear.base_radius / math.cos(angle), sense * math.cos(angle)
        ends = np.array([[pitch, 0.0]]) + np.array(path)[:, None] * np.array([math.sin(angle), cosine])
        for psi in s.planet_angles:
            turn = np.array([[math.cos(psi), math.sin(psi)], [-math.sin(psi), math.cos(psi)]])
            paths.append([round(1e3 * float(x), 4) for x in (ends @ turn).ravel()])
    return paths


class _Sector:
    """Corners, triangles and free edges of one sector."""

    def __init__(self, grid: Grid):
        corners = grid.triangles[:, :3]
        self.nodes, numbers = np.unique(corners, return_inverse=True)
        self.points, self.triangles = grid.points[self.nodes], numbers.reshape(-1, 3)
        edges = np.concatenate([self.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
        _, first, count = np.unique(np.sort(edges), axis=0, return_index=True, return_counts=True)
        cuts = np.concatenate([grid.boundaries[name][:, :2] for name in ("cut_left", "cut_right")])
        kept = {tuple(sorted(edge)) for edge in np.searchsorted(self.nodes, cuts).tolist()}
        outer = edges[first[count == 1]].tolist()
        self.edges = np.array([edge for edge in outer if tuple(sorted(edge)) not in kept])

    def packed(self, gear: Gear, helix_angle: float) -> dict[str, Any]:
        """Points and width [mm], triangles and edges of the free surface, turn over the width, for JSON."""
        slope = _HANDS[gear.name] * math.tan(helix_angle) / gear.reference_radius
        return {
            "count": gear.teeth,
            "width": 1e3 * gear.face_width,
            "twist": gear.face_width * slope,
            "internal": gear.internal,
            "points": [round(1e3 * float(x), 4) for x in self.points.ravel()],
            "triangles": self.triangles.ravel().tolist(),
            "edges": self.edges.ravel().tolist(),
        }


def von_mises(grid: Grid, displacement: np.ndarray, material: Material) -> np.ndarray:
    """Compute von Mises' stress at the nodes [Pa] in plane stress, mean of the elements around each.

    The displacement is (n, 2) [m]. Stresses of elements are taken at their corners and at the
    middles of their sides; the faces of a gear are free (Timoshenko and Goodier, "Theory of Elasticity",
    3rd ed., section 10).
    """
    places = np.array([[0.0, 1.0, 0.0, 0.5, 0.5, 0.0], [0.0, 0.0, 1.0, 0.0, 0.5, 0.5]])
    slopes = np.stack(shape_functions(*places)[1:])
    jacobian = np.einsum("aiq,mib->mqab", slopes, grid.points[grid.triangles])
    moved = np.einsum("aiq,mib->mqab", slopes, displacement[grid.triangles])
    gradient = np.linalg.solve(jacobian, moved)
    xx, yy = gradient[..., 0, 0], gradient[..., 1, 1]
    xy = gradient[..., 0, 1] + gradient[..., 1, 0]
    first, shear = material.lame("plane stress")
    mean = first * (xx + yy)
    sx, sy, t = mean + 2 * shear * xx, mean + 2 * shear * yy, shear * xy
    element_stress = np.sqrt(sx**2 - sx * sy + sy**2 + 3 * t**2).ravel()
    nodes = grid.triangles.ravel()
    return np.bincount(nodes, element_stress, grid.n_nodes) / np.maximum(np.bincount(nodes, minlength=grid.n_nodes), 1)


def _modes(modes: xr.Dataset) -> list[dict[str, Any]]:
    """Motions of the bodies and waves around the ring of the first modes that are no rigid motion.

    In mm and rad: translations of modes.nc are in metres where its rotations are in radians.
    """
    frequency, names = modes["frequency"].values, [str(name) for name in modes["dof"].values]
    elastic = np.flatnonzero(frequency > 1e-3 * frequency.max(initial=0.0) / max(len(frequency), 1))[:_MODES]
    shapes = []
    for mode in elastic:
        shape = dict(zip(names, modes["shape"].values[:, mode]))
        bodies = dict.fromkeys(name.split(":")[0] for name in names if ": " in name)
        moved = {
            body: [factor * float(shape.get(f"{body}: {axis}", 0.0)) for axis, factor in _AXES.items()]
            for body in bodies
        }
        title = f"{mode + 1}: {frequency[mode]:,.5g} Hz, {modes['kind'].values[mode]}"
        shapes.append({"title": title, "bodies": moved, "ring": _waves(modes, mode)})
    return shapes


def _waves(modes: xr.Dataset, mode: int) -> list[list[float]]:
    """Waves around the outer surface of the ring: number, radial, tangential part [mm] (real, imaginary)."""
    if "ring_shape_real" not in modes:
        return []
    numbers = modes["circumferential"].values
    parts = 1e3 * np.stack(
        [
            modes[f"{name}_{part}"].values[mode]
            for name in ("ring_shape", "ring_tangential_shape")
            for part in ("real", "imag")
        ]
    )
    size = np.abs(parts).max(axis=0)
    kept = np.flatnonzero(size > _WAVES * size.max(initial=0.0))
    return [[int(numbers[i]), *(float(f"{v:.5g}") for v in parts[:, i])] for i in kept]


def packed_values(values: np.ndarray) -> dict[str, Any]:
    """Write values (...) as whole numbers of sixteen bits, and what one of them is worth."""
    largest = float(np.abs(values).max(initial=0.0)) or 1.0
    whole = np.round(values * (32767 / largest)).astype("<i2")
    return {"unit": largest / 32767, "values": base64.b64encode(whole.tobytes()).decode("ascii")}
