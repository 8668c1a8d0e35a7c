"""One assembler of stations with six motions: inertias, beams, springs, rigid joints and gear meshes -> M, C, G, K, W.

A station has the motions `MOTIONS` along and about its axes: x, y, z unless all parts that act on it have others, as
planets may have theirs. Tilts and rotation are right-handed and small. Springs of infinite stiffness are conditions,
which are eliminated: all motions follow from the free ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import linalg

from femgear.fe.beam import rigid_link
from femgear.system.system import MechanicalSystem, freeze

MOTIONS = ("x", "y", "z", "tilt x", "tilt y", "rotation")
ROTATION = 5
IN_PLANE = (0, 1, ROTATION)
"""Motions of what moves in the plane across its axis."""
GROUND = -1
"""In place of a station: what stands still."""
# Row of a condition, relative to the largest, that counts as none.
_RANK = 1e-12


@dataclass(frozen=True)
class Inertia:
    """Mass and gyroscopic matrix of a body, or of a beam, on its stations.

    Parameters
    ----------
    stations : tuple of int
        Numbers of the k stations.
    mass, gyroscopic : (6k, 6k) arrays
        [kg, kg m, kg m^2]; the latter multiplies the speed that the gyroscopic matrix of the system multiplies.
    """

    stations: tuple[int, ...]
    mass: np.ndarray
    gyroscopic: np.ndarray


@dataclass(frozen=True)
class Beam:
    """Stiffness matrix ``stiffness`` (6k, 6k) [N/m, N m/rad] between k ``stations``."""

    stations: tuple[int, ...]
    stiffness: np.ndarray


@dataclass(frozen=True)
class StationSprings:
    """Springs between stations, such as a bearing, a coupling or a rigid joint.

    Parameters
    ----------
    name : str
        For messages and results.
    stations : tuple of int
        Numbers of the k stations, `GROUND` among them.
    rows : (r, 6k) array
        Deflection of every spring per unit of the motions [1, m].
    stiffness : (r,) array
        [N/m], of springs against rotation [N m/rad]; infinite for a condition.
    """

    name: str
    stations: tuple[int, ...]
    rows: np.ndarray
    stiffness: np.ndarray


@dataclass(frozen=True)
class Follower:
    """A station that moves as others have it, such as a seat in an elastic casing.

    Parameters
    ----------
    name : str
        For messages and results.
    station : int
        Number of the station that follows.
    leaders : tuple of int
        Numbers of the k stations that it follows, none of them a follower.
    rows : (6, 6k) array
        Its motions per unit of theirs.
    """

    name: str
    station: int
    leaders: tuple[int, ...]
    rows: np.ndarray


@dataclass(frozen=True)
class Contact:
    """A gear mesh on its common normal, of S slices over the width.

    Parameters
    ----------
    name : str
        Of the mesh.
    stations : (2,) tuple of int
        Of gear 1 and gear 2, `GROUND` for a gear that stands still.
    normals : (2, 3) array
        Unit normal of the flanks, into gear 2, along the axes of either station.
    points : (2, S, 3) array
        Contact point of every slice, from either station and along its axes [m].
    heights : (S,) array
        Of the slices above the middle of the common width [m].
    stiffness : (S,) array
        Mean stiffness of every slice along the normal [N/m].
    """

    name: str
    stations: tuple[int, int]
    normals: np.ndarray
    points: np.ndarray
    heights: np.ndarray
    stiffness: np.ndarray

    @property
    def approach(self) -> np.ndarray:
        """Approach of the flanks (2, S, 6) per unit of the motions of either station [1, m/rad]."""
        first, second = (
            point_approach(normal, points) for normal, points in zip(self.normals, self.points, strict=True)
        )
        return np.stack([first, -second])

    @property
    def sliding(self) -> np.ndarray:
        """Sliding of flank 1 on flank 2 along the tangent and its turning against it, (2, 2, S, 6).

        Per unit of the motions of either station, second axis [1, m] and [1]: along the tangent of the transverse
        section, at the pitch point, positive as gear 1 moves while it drives; see
        `femgear.contact.mesh_cycle.MeshCycle.friction_force`.
        """
        effect, drives = np.zeros((2, 2, len(self.heights), 6)), np.sign(self.approach[0, 0, 5])
        for station, (normal, points) in enumerate(zip(self.normals, self.points, strict=True)):
            tangent = drives * np.array([-normal[1], normal[0], 0.0]) / math.hypot(normal[0], normal[1])
            effect[0, station] = point_approach(tangent, points)
            effect[1, station, :, 5] = drives
        effect[:, 1] *= -1.0
        return effect


@dataclass(frozen=True)
class Assembly:
    """Stations and what acts between them.

    Parameters
    ----------
    names : tuple of str
        Of the n stations.
    places : (n, 3) array
        [m]
    held : (6n,) bool array
        Motions that do not take place.
    inertias, beams, springs, contacts, followers : tuples
        Of `Inertia`, `Beam`, `StationSprings`, `Contact` and `Follower`.
    """

    names: tuple[str, ...]
    places: np.ndarray
    held: np.ndarray
    inertias: tuple[Inertia, ...] = ()
    beams: tuple[Beam, ...] = ()
    springs: tuple[StationSprings, ...] = ()
    contacts: tuple[Contact, ...] = field(default=())
    followers: tuple[Follower, ...] = ()

    def __post_init__(self):
        freeze(self)

    @property
    def count(self) -> int:
        """Number 6n of all motions."""
        return 6 * len(self.names)

    @cached_property
    def motion_names(self) -> tuple[str, ...]:
        """Names (6n,) of all motions."""
        return tuple(f"{name}: {motion}" for name in self.names for motion in MOTIONS)

    @cached_property
    def mass(self) -> np.ndarray:
        """Mass matrix (6n, 6n) of all motions [kg, kg m^2]."""
        return self._sum((inertia.stations, inertia.mass) for inertia in self.inertias)

    @cached_property
    def gyroscopic(self) -> np.ndarray:
        """Gyroscopic matrix (6n, 6n) of all motions [kg m^2]."""
        return self._sum((inertia.stations, inertia.gyroscopic) for inertia in self.inertias)

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Stiffness (6n, 6n) of beams and springs, without meshes and without what is rigid [N/m, N m/rad]."""
        matrices = [(beam.stations, beam.stiffness) for beam in self.beams]
        matrices += [(spring.stations, stiffness_matrix(spring.rows.T, spring.stiffness)) for spring in self.springs]
        return self._sum(matrices)

    @cached_property
    def columns(self) -> np.ndarray:
        """Approach (6n, g) of the flanks of all slices of all meshes, in their order, per unit of all motions."""
        blocks = [np.zeros((self.count, 0))]
        for contact in self.contacts:
            columns = np.zeros((self.count, len(contact.heights)))
            for station, approach in zip(contact.stations, contact.approach):
                if station != GROUND:
                    columns[6 * station : 6 * station + 6] += approach.T
            blocks.append(columns)
        return np.hstack(blocks)

    @cached_property
    def sliding_columns(self) -> np.ndarray:
        """Sliding (6n, g) of all slices of all meshes, and their turning (6n, g), as `Contact.sliding`, (6n, 2g)."""
        columns = np.zeros((2, self.count, self.columns.shape[1]))
        for contact, place in zip(self.contacts, self.slices, strict=True):
            for kind, of_stations in zip(columns, contact.sliding, strict=True):
                for station, sliding in zip(contact.stations, of_stations, strict=True):
                    if station != GROUND:
                        kind[6 * station : 6 * station + 6, place] += sliding.T
        return np.hstack([*columns])

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Columns of every mesh."""
        ends = np.cumsum([0, *(len(contact.heights) for contact in self.contacts)]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    @cached_property
    def slice_stiffness(self) -> np.ndarray:
        """Stiffness (g,) of all slices [N/m]."""
        return np.concatenate([np.zeros(0), *(contact.stiffness for contact in self.contacts)])

    @cached_property
    def led(self) -> np.ndarray:
        """All motions (6n, 6n) per unit of those of stations that follow none; motions of followers have no effect."""
        led = np.eye(self.count)
        for follower in self.followers:
            place = slice(6 * follower.station, 6 * follower.station + 6)
            led[place, place] = 0.0
            for at, leader in enumerate(follower.leaders):
                # motions that do not take place are no one's
                part = np.where(self.held[place, None], 0.0, follower.rows[:, 6 * at : 6 * at + 6])
                led[place, 6 * leader : 6 * leader + 6] += part
        return led

    @cached_property
    def _solved(self) -> tuple[np.ndarray, np.ndarray]:
        """All motions per unit of the free ones, and the places of these."""
        rows = [np.zeros((0, self.count))]
        for group in self.springs:
            rigid = group.rows[np.isinf(group.stiffness)]
            rows.append(np.zeros((len(rigid), self.count)))
            for at, station in enumerate(group.stations):
                if station != GROUND:
                    rows[-1][:, 6 * station : 6 * station + 6] += rigid[:, 6 * at : 6 * at + 6]
        if not self.followers:
            return solved_conditions(np.vstack(rows), self.held)
        held = self.held.copy()
        for follower in self.followers:
            held[6 * follower.station : 6 * follower.station + 6] = True
        of_free, free = solved_conditions(np.vstack(rows) @ self.led, held)
        return self.led @ of_free, free

    @property
    def motions(self) -> np.ndarray:
        """All motions (6n, m) per unit of the free ones."""
        return self._solved[0]

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names (m,) of the free motions."""
        return tuple(self.motion_names[i] for i in self._solved[1])

    def system(self, load: np.ndarray | None = None) -> MechanicalSystem:
        """Make the matrices of the free motions; ``C`` is zero, meshes are columns of ``W`` and not in ``K``.

        ``load`` (6n,) acts on all motions [N, N m]. ``gyroscopic`` is None where no body tilts that turns.
        """
        made = assemble(
            self.mass,
            self.stiffness,
            self.columns,
            np.zeros(self.count) if load is None else load,
            motions=self.motions,
            dofs=self.free_names,
            gyroscopic=self.gyroscopic,
        )
        return made if np.any(made.gyroscopic) else replace(made, gyroscopic=None)

    def _sum(self, matrices) -> np.ndarray:
        """Add matrices of stations into one of all motions; rows of the ground are left out."""
        total = np.zeros((self.count, self.count))
        for stations, matrix in matrices:
            at = np.concatenate([6 * s + np.arange(6) for s in stations])
            kept = np.repeat(np.array(stations) != GROUND, 6)
            at, inner = at[kept], matrix[np.ix_(kept, kept)]
            np.add.at(total, np.ix_(at, at), inner)
        return total


def assemble(
    mass: np.ndarray,
    stiffness: np.ndarray,
    columns: np.ndarray,
    load: np.ndarray,
    *,
    motions: np.ndarray,
    dofs: Sequence[str],
    gyroscopic: np.ndarray | None = None,
) -> MechanicalSystem:
    """Reduce the matrices of bodies, springs and meshes to the motions that are free; ``C`` is zero.

    Parameters
    ----------
    mass : (n,) or (n, n) array
        In all coordinates [kg, kg m^2].
    stiffness : (n, n) array
        Of springs that are not columns of ``W``, see `stiffness_matrix` [N/m, N m/rad].
    columns : (n, g) array
        Deflections of meshes, and of bearings that are elements, per unit of the coordinates.
    load : (n,) array
        [N, N m]
    motions : (n, m) array
        All coordinates per unit of the free ones: unit columns, and what follows them.
    dofs : (m,) sequence of str
        Names of the free coordinates.
    gyroscopic : (n, n) array, optional
        [kg]
    """
    T = motions
    return MechanicalSystem(
        M=(T.T * mass) @ T if mass.ndim == 1 else T.T @ mass @ T,
        C=np.zeros((T.shape[1], T.shape[1])),
        K=T.T @ stiffness @ T,
        W=T.T @ columns,
        load=T.T @ load,
        dofs=tuple(str(name) for name in dofs),
        gyroscopic=None if gyroscopic is None else T.T @ gyroscopic @ T,
    )


def with_modal_body(
    system: MechanicalSystem, stiffness: np.ndarray, columns: np.ndarray, names: Sequence[str]
) -> MechanicalSystem:
    """Join the coordinates of a body by its modes to a system.

    Parameters
    ----------
    system : MechanicalSystem
        Of all else; without damping.
    stiffness : (m,) array
        Squares of the natural circular frequencies of mass-normalised modes [1/s^2].
    columns : (m, g) array
        Deflection of every column of ``W`` per unit of a mode [kg^-1/2].
    names : (m,) sequence of str
        Of the modal coordinates.
    """
    count, none = len(stiffness), np.zeros((len(stiffness), len(stiffness)))
    gyroscopic = system.gyroscopic
    return MechanicalSystem(
        M=np.asarray(linalg.block_diag(system.M, np.eye(count))),
        C=np.zeros((len(system.M) + count,) * 2),
        K=np.asarray(linalg.block_diag(system.K, np.diag(stiffness))),
        W=np.vstack([system.W, columns]),
        load=np.concatenate([system.load, np.zeros(count)]),
        dofs=(*system.dofs, *names),
        gyroscopic=None if gyroscopic is None else np.asarray(linalg.block_diag(gyroscopic, none)),
        flexibility=system.flexibility,
    )


def stiffness_matrix(columns: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Sum ``k w w^T`` (n, n) [N/m, ...] over springs with columns w (n, g) and stiffnesses k (g,) [N/m].

    Infinite ones hold motions and are not in it.
    """
    k = np.where(np.isfinite(stiffness), stiffness, 0.0)
    return np.einsum("ig,g,jg->ij", columns, k, columns)


def point_approach(normal: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Compute ``n . (v + phi x c)`` per unit of v and phi of a rigid body (..., 6), ``n`` and ``c x n``.

    That is the motion along a normal (3,) of points (..., 3) [m] of the body, from its centre: per displacement
    along x, y and z [1], and per rotation about them [m/rad].
    """
    effect = np.empty((*points.shape[:-1], 6))
    effect[..., :3] = normal
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    n_x, n_y, n_z = normal
    effect[..., 3], effect[..., 4], effect[..., 5] = y * n_z - z * n_y, z * n_x - x * n_z, x * n_y - y * n_x
    return effect


def mesh_normal(towards, pressure_angle: float, base_helix: float, flank: int) -> np.ndarray:
    """Compute the unit normal (3,) of a mesh, into gear 2, from its pressure angle in the transverse section.

    ``towards`` (2,) is the radial direction at the pitch point, away from the axis of gear 1. Gear 1 pushes
    counter-clockwise for ``flank`` 1: ``n = (sin(alpha) e_r + flank cos(alpha) e_t) cos(beta_b) - flank
    sin(beta_b) e_z``, with the helix positive of a right-handed gear 1 (ISO 21771). In an internal mesh the flank
    of the pinion faces outwards all the same.
    """
    radial, around = np.append(towards, 0.0), np.array([-towards[1], towards[0], 0.0])
    plane = math.sin(pressure_angle) * radial + flank * math.cos(pressure_angle) * around
    return math.cos(base_helix) * plane - flank * math.sin(base_helix) * np.array([0.0, 0.0, 1.0])


def gear_contact(  # noqa: PLR0913
    name: str,
    stations: tuple[int, int],
    towards,
    base_radii: tuple[float, float],
    pressure_angle: float,
    *,
    flank: int,
    internal: bool = False,
    base_helix: float = 0.0,
    heights: Sequence[float] = (0.0,),
    stiffness: float = 0.0,
    on_base_circles: bool = False,
) -> Contact:
    """Make the mesh of two gears whose stations are their centres, with slices at heights (S,) [m].

    Each gear is touched on its own pitch circle ``r_b / cos(alpha)``, so that its rotation moves the flank by its
    base radius also where radii, centre distance and pressure angle do not close.

    Parameters
    ----------
    name : str
        Of the mesh.
    stations : (2,) tuple of int
        Of gear 1 and gear 2, `GROUND` for a gear that stands still.
    pressure_angle, base_helix, flank
        See `mesh_normal`.
    towards : (2,) or (2, 2) array
        See `mesh_normal`; of each station along its own axes where these differ.
    base_radii : (2,) floats
        Of gear 1 and gear 2 [m].
    internal : bool
        Gear 2 is a ring.
    heights : (S,) floats
        Of the slices above the middle of the common width [m].
    stiffness : float
        Of the whole mesh, in equal parts on the slices [N/m].
    on_base_circles : bool
        Forces act where the line of action touches the base circle of each gear.
    """
    levels, count = np.asarray(heights, float), len(heights)
    points, normals = np.zeros((2, count, 3)), np.zeros((2, 3))
    arms = base_radii[0], base_radii[1] if internal else -base_radii[1]
    for gear, (radial, arm) in enumerate(zip(np.broadcast_to(towards, (2, 2)), arms, strict=True)):
        foot = radial / math.cos(pressure_angle)
        if on_base_circles:
            around = np.array([-radial[1], radial[0]])
            foot = math.cos(pressure_angle) * radial - flank * math.sin(pressure_angle) * around
        points[gear, :, :2], points[gear, :, 2] = arm * foot, levels
        normals[gear] = mesh_normal(radial, pressure_angle, base_helix, flank)
    return Contact(name, stations, normals, points, levels, np.full(count, stiffness / count))


def planetary_contacts(
    stations: tuple[int, Sequence[int], int],
    towards: np.ndarray,
    base_radii: tuple[float, float, float],
    pressure_angles: tuple[float, float],
    *,
    flank: int,
    base_helix: float = 0.0,
    heights: Sequence[float] = (0.0,),
    stiffness: tuple[Sequence[float], Sequence[float]] | None = None,
    on_base_circles: bool = False,
) -> list[Contact]:
    """Make the meshes of N planets with the sun, then with the ring, see `gear_contact`.

    Parameters
    ----------
    stations : int, (N,) sequence of int, int
        Of sun, planets and ring; `GROUND` for a gear that stands still.
    towards : (N, 2, 2) array
        Radial direction of every planet, along the axes of sun and ring, and along its own.
    base_radii : (3,) floats
        Of sun, planets and ring [m].
    pressure_angles : (2,) floats
        Working ones of sun-planet and planet-ring [rad].
    flank : int
        1 for the flanks of a sun that pushes counter-clockwise, else -1.
    base_helix : float
        Positive of a right-handed sun [rad].
    heights, on_base_circles
        See `gear_contact`.
    stiffness : two (N,) sequences of float, optional
        Of the meshes with the sun and with the ring [N/m]; zero where not given.
    """
    sun, planets, ring = stations
    options = {"heights": heights, "on_base_circles": on_base_circles}
    contacts = list[Contact]()
    for internal, alpha in enumerate(pressure_angles):
        # planets turn against the sun, and have the other hand
        sense, radii = (-1, base_radii[1:]) if internal else (1, base_radii[:2])
        for n, planet in enumerate(planets):
            contacts.append(
                gear_contact(
                    f"planet {n + 1}-ring" if internal else f"sun-planet {n + 1}",
                    (planet, ring) if internal else (sun, planet),
                    towards[n, ::-1] if internal else towards[n],
                    radii,
                    alpha,
                    flank=sense * flank,
                    internal=bool(internal),
                    base_helix=sense * base_helix,
                    stiffness=0.0 if stiffness is None else stiffness[internal][n],
                    **options,
                )
            )
    return contacts


def held_motions(count: int, free: Sequence[int]) -> np.ndarray:
    """Tell the motions (6 count,) that do not take place, where those of the numbers ``free`` among `MOTIONS` do."""
    return np.tile(~np.isin(np.arange(6), free), count)


def solved_conditions(rows: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solve the conditions ``rows q = 0`` (c, n) for all motions (n, m) per unit of free ones.

    The places (m,) of these come with them. ``held`` (n,) do not take place. Of the motions of a condition the last
    ones follow the first ones.
    """
    count = len(held)
    free = np.flatnonzero(~held)
    backwards = free[::-1]
    size = np.abs(rows).max(initial=0.0)
    table = rows[:, backwards]
    table = table[np.abs(table).max(axis=1, initial=0.0) > _RANK * size]
    if not len(table):
        return np.eye(count)[:, free], free
    _, triangle, order = linalg.qr(table, mode="economic", pivoting=True)  # type: ignore[misc]
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.count_nonzero(diagonal > _RANK * diagonal[0]))
    bound, rest = backwards[order[:rank]], np.sort(backwards[order[rank:]])
    column = {int(c): i for i, c in enumerate(backwards[order])}
    tied = -linalg.solve_triangular(triangle[:rank, :rank], triangle[:rank, [column[int(c)] for c in rest]])
    motions = np.zeros((count, len(rest)))
    motions[rest, np.arange(len(rest))] = 1.0
    motions[bound] = tied
    return motions, rest


def joint(
    name: str,
    stations: tuple[int, int],
    offsets: tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray],
    stiffness: Sequence[float] | np.ndarray,
    *,
    axes: np.ndarray | None = None,
) -> StationSprings:
    """Make the springs of a joint between two stations: deflections are second less first, where they meet.

    Parameters
    ----------
    name : str
        For messages and results.
    stations : (2,) tuple of int
        `GROUND` for what stands still.
    offsets : two (3,) arrays
        From either station to the joint [m].
    stiffness : (6,) array
        Along three axes [N/m] and about them [N m/rad]; those of zero are left out, infinite ones are conditions.
    axes : (3, 3) or (2, 3, 3) array, optional
        Rows are the axes of the joint along those of both stations, or of either one; these where not given.
    """
    rows = np.hstack([-rigid_link(offsets[0]), rigid_link(offsets[1])])
    if axes is not None:
        turned = np.broadcast_to(np.asarray(axes, float), (2, 3, 3))
        rows = np.hstack(
            [np.kron(np.eye(2), rotation) @ half for rotation, half in zip(turned, np.hsplit(rows, 2), strict=True)]
        )
    stiffness = np.asarray(stiffness, float)
    used = stiffness > 0.0
    return StationSprings(name, stations, rows[used], stiffness[used])
