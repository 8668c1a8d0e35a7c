"""Gears as elastic bodies: one sector of finite elements each, and the compliance of all their flanks.

Every gear has one sector grid, one stiffness matrix and one factorisation (`make_sectors`, `make_bodies`).

A concentrated load on a finite-element surface has no converged displacement. What converges is the
displacement at a depth ``d`` under the flank. The half-plane displacement at that depth, which has the
same singularity, is subtracted, and so is what the wedge at the tip corner yields more than the half plane
(`femgear.contact.local_compliance`). What remains is the regular part of the flank's compliance. It is smooth
along the flank, so it may be interpolated, and it is extrapolated from the depths d and 2d to the surface.
The contact solution adds half plane and corner at the surface under its pressure cells.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from femgear import second_process
from femgear.contact.flank_pairs import LEFT, RIGHT, mesh_pairs
from femgear.contact.local_compliance import TipCorner, depth_displacement, tip_corner
from femgear.errors import CaseError, GridError
from femgear.fe.compliance import (
    FreeSector,
    SectorSchur,
    condense_sector,
    directional,
    interpolation,
    mirror_nodes,
    mirrored_columns,
    tooth_compliance,
)
from femgear.fe.elasticity import (
    BoundaryStress,
    Material,
    material_of_each,
    stiffness,
    tangential_stress,
)
from femgear.fe.grid import Grid, mirror
from femgear.fe.meshing import mesh_outlines
from femgear.gears.gear import Gear, tooth_thickness
from femgear.gears.pair import GearSet
from femgear.gears.planetary import PlanetarySet
from femgear.gears.tooth import half_sector

# external gears are slender along the axis only; the ring's rim is thin and free at its faces
TEETH_STATE = "plane strain"
RING_STATE = {"tooth": "plane strain", "body": "plane stress"}
_THIN = 0.5
"""Thickness of a rim in modules below which a grid that fails is put down to it."""


@dataclass(frozen=True)
class Sector:
    """One tooth sector of a ``gear``: ``grid`` in the tooth frame, sparse matrix ``stiffness`` (2n, 2n) [N/m]."""

    gear: Gear
    grid: Grid
    stiffness: Any


@dataclass(frozen=True)
class Sectors:
    """Sectors of one tooth of all ``gears`` of a set in its order: ``sun``, ``planet``, ``ring`` of a planetary one."""

    gears: tuple[Sector, ...]

    sun = property(lambda self: self.gears[0])
    planet = property(lambda self: self.gears[1])
    ring = property(lambda self: self.gears[2])


@dataclass(frozen=True)
class _FlankStations:
    """Nodes of the left flank by ascending roll length, where unit loads act on it.

    Of the n stations ``nodes`` (n,) are their numbers in the grid, ``roll`` (n,) their roll lengths [m], ``points``
    (n, 2) their coordinates in the tooth frame [m] and ``normals`` (n, 2) the unit normals into the body.
    """

    nodes: np.ndarray
    roll: np.ndarray
    points: np.ndarray
    normals: np.ndarray


@dataclass(frozen=True)
class ObservedRoot:
    """Root of a tooth seen by the same factorisation as its flanks; the sectors are not tied yet.

    ``along`` are the functionals of the tangential stress along the root of the left flank, ``stations`` the places
    on the flank where unit loads act, ``schur`` the sector condensed with these loads and observations.
    """

    along: BoundaryStress
    stations: _FlankStations
    schur: SectorSchur


@dataclass(frozen=True)
class FlankCompliance:
    """Regular compliance between the flank stations of all teeth of one gear.

    Parameters
    ----------
    roll : (n,) array
        Roll lengths of the stations [m], equidistant and ascending.
    base_radius : float
        [m].
    regular : (teeth, 2n, 2n) array
        ``regular[k, a, b]``: displacement into the body [m] at station ``a`` of tooth ``i`` per unit inward
        normal force [N] at station ``b`` of tooth ``i - k``, less half plane and tip corner where both lie
        on the same flank. Stations of the left flank first, then those of the right flank.
    depth : (n,) array
        Depth under each station at which body and half plane are joined [m].
    corner : TipCorner
        What was taken out for the corner at the tip.
    local : (2, n, n) array
        What was taken out in all within the left and the right flank [m/N].
    unknowns : int
        Degrees of freedom of the whole body that the sector stands for.
    root : ObservedRoot, optional
        For the stresses in the roots, where they were observed too.
    surface : SectorSchur, optional
        Sector with unit loads at the stations, observed where they act; of the ring.
    free : FreeSector, optional
        The same, whatever holds the rim.
    cracks : tuple of CrackedFlanks
        What cracks of a tooth change, see `femgear.contact.cracked_flanks`.
    """

    roll: np.ndarray
    base_radius: float
    regular: np.ndarray
    depth: np.ndarray
    corner: TipCorner
    local: np.ndarray
    unknowns: int
    root: ObservedRoot | None = None
    surface: SectorSchur | None = None
    free: FreeSector | None = None
    cracks: tuple[Any, ...] = ()

    @cached_property
    def least(self) -> float:
        """Most negative compliance between flanks that a pair which is left out may share [m/N], or zero."""
        regular, n = self.regular, len(self.roll)
        # a pair that is left out shares no flank with one that carries
        least_of_halves = regular[0, :n, n:].min(), regular[0, n:, :n].min()
        return float(min(0.0, regular[1:].min(), *least_of_halves))


@dataclass(frozen=True)
class Bodies:
    """Flank compliances of the gears of a set, and what the meshes between them have in common.

    Parameters
    ----------
    gears : tuple of FlankCompliance
        In the order of the set; ``sun``, ``planet`` and ``ring`` of a planetary one.
    widths : tuple of float
        Face width that both gears have in common [m], one a kind of mesh.
    helical : tuple of float
        Contact stiffness of helical teeth over that of spur teeth with the same transverse section [1], one a kind
        of mesh, see `helical_stiffness`.
    base_helix_angle : float
        Helix angle on the base cylinder [rad]; zero for spur teeth.
    """

    gears: tuple[Any, ...]
    widths: tuple[float, ...]
    helical: tuple[float, ...] = (1.0, 1.0)
    base_helix_angle: float = 0.0

    sun = property(lambda self: self.gears[0])
    planet = property(lambda self: self.gears[1])
    ring = property(lambda self: self.gears[2])

    def with_gear(self, number: int, flanks: FlankCompliance) -> Bodies:
        """Exchange the flanks of one gear."""
        number %= len(self.gears)
        return replace(self, gears=(*self.gears[:number], flanks, *self.gears[number + 1 :]))

    def of_kinds(self, kind) -> np.ndarray:
        """Look up `helical` (...) of kinds of mesh (...)."""
        return np.asarray(self.helical)[kind]

    def normal_pressure(self, kind) -> np.ndarray:
        """Compute Hertz's pressure of kinds of mesh (...) over that of the softer transverse section.

        The load per length of the oblique contact line is that per face width; flanks are curved less in the
        normal section, by ``cos beta_b`` (ISO 6336-2, Z_H).
        """
        return np.sqrt(math.cos(self.base_helix_angle) / self.of_kinds(kind))

    @property
    def mates(self) -> tuple[tuple[FlankCompliance, FlankCompliance], ...]:
        """Both gears of every kind of mesh."""
        return tuple(pairwise(self.gears))

    @property
    def contact_moduli(self) -> np.ndarray:
        """Contact modulus E* of every kind of mesh (kinds,) [Pa], ``1/E*`` the sum of ``(1 - nu) / (2 mu)``."""
        yielding = [
            sum((1.0 - body.corner.poisson_ratio) / (2.0 * body.corner.shear_modulus) for body in pair)
            for pair in self.mates
        ]
        return 1.0 / np.array(yielding)


def helical_stiffness(base_helix_angle: float, *, internal: bool) -> float:
    """Compute the stiffness of helical teeth over that of straight teeth of the same transverse section.

    Both loaded along the same oblique lines: ``cos^n beta_b`` of the base helix angle [rad], n = 2.2 for two
    external gears, 2.3 with an internal one. Teeth turn with the axis, and the force is inclined; endless
    gears of twisted solid elements have it within 1 % up to a helix angle of 30 degrees (rows *helix* of
    docs/validation.md). Ends that stand obliquely are left out.
    """
    return math.cos(base_helix_angle) ** (2.3 if internal else 2.2)


def make_sectors(
    planetary_set: GearSet,
    material: Material | Sequence[Material],
    *,
    flank_elements: int = 24,
    refine: float = 1.0,
    cache: Path | None = None,
    sectors_kept: Sequence[Sector | None] = (),
) -> Sectors:
    """Mesh one sector of each gear and assemble its stiffness matrix.

    ``material`` is that of all gears or one for each, ``flank_elements`` are the element edges along a flank,
    ``refine`` divides all element sizes, ``cache`` is the folder of generated grids. Teeth are as wide as the
    face that they have in common with their mates (ISO 6336-1 has the stiffness of a pair for that width), of
    two mates the wider one; bodies below them have their own width. Those in ``sectors_kept`` are
    taken as they are, None stands for a sector to make.
    """
    gears, sectors_kept = planetary_set.gears, sectors_kept or [None] * len(planetary_set.gears)
    new = [gear for gear, sector in zip(gears, sectors_kept, strict=True) if sector is None]
    halves = [half_sector(gear, flank_elements=flank_elements, refine=refine) for gear in new]
    try:
        grids = mesh_outlines(halves, cache=cache)
    except GridError as error:
        thin = min(new, key=lambda gear: abs(gear.root_radius - gear.rim_radius))
        rim = abs(thin.root_radius - thin.rim_radius) / thin.module
        if rim < _THIN:
            error.key = f"{thin.name}.{'outer' if thin.internal else 'bore'}_radius"
            error.remedy = f"the rim is {rim:.2g} modules thick; give it {_THIN:g} or more"
        raise
    sectors, materials, grids = [], material_of_each(material, len(gears)), iter(grids)
    widths = flank_widths([gear.face_width for gear in gears])
    for gear, sector_given, material_of_gear, teeth in zip(gears, sectors_kept, materials, widths, strict=True):
        if sector_given is not None:
            sectors.append(sector_given)
            continue
        whole = mirror(next(grids))
        state: Any = RING_STATE if gear.internal else TEETH_STATE
        thickness: Any = gear.face_width
        if max(teeth) < thickness:
            thickness = {"tooth": max(teeth), "body": thickness}
        matrix = stiffness(whole, material_of_gear, state=state, thickness=thickness)
        sectors.append(Sector(gear, whole, matrix))
    return Sectors(tuple(sectors))


def flank_widths(widths: Sequence[float]) -> list[tuple[float, float]]:
    """Find the face width [m] that the left and the right flank of each gear have in common with their mates.

    Of face widths of gears in the order of a set, each of which meshes with the next: of a planet the left
    flank carries against the sun, the right one against the ring (`flank_pairs.acting_flanks`).
    """
    common = [min(pair) for pair in pairwise(widths)]
    return [*zip([common[0], *common], [*common, common[-1]], strict=True)]


def make_bodies(
    sectors: Sectors,
    material: Material | Sequence[Material],
    *,
    depth: float | None = None,
    ring_foundation=None,
    compliances_kept: Sequence[FlankCompliance | None] = (),
) -> Bodies:
    """Compute the flank compliances, sun and planets held at their bores and the ring at its outer surface.

    Parameters
    ----------
    material : Material or one for each gear
        Those of the sectors.
    depth : float, optional
        Largest depth at which body and half plane are joined [m].
    ring_foundation : (2n, 2n) sparse matrix, optional
        Stiffness of an elastic foundation of the ring, which then is not held [N/m].
    compliances_kept : sequence, optional
        Flank compliances of the gears that are there already; None stands for one to compute.
    """
    compliances_kept = compliances_kept or [None] * len(sectors.gears)
    # roots of sectors of two plane states or widths need a solution of their own, see `root_stress`
    face_widths = [s.gear.face_width for s in sectors.gears]
    widths = flank_widths(face_widths)
    compliances, materials = list(compliances_kept), material_of_each(material, len(sectors.gears))
    missing = [number for number, before in enumerate(compliances_kept) if before is None]
    tasks = [
        partial(
            _of_sector,
            sectors.gears[number],
            materials[number],
            widths[number],
            depth=depth,
            foundation=ring_foundation,
        )
        for number in missing
    ]
    for number, compliance in zip(missing, second_process.shared(tasks), strict=True):
        compliances[number] = compliance
    return Bodies(tuple(compliances), tuple(min(pair) for pair in pairwise(face_widths)))


def _of_sector(sector: Sector, material: Material, teeth: tuple[float, float], *, depth, foundation) -> FlankCompliance:
    """Flank compliance of a gear whose flanks touch over some widths [m]; the foundation is that of a ring."""
    gear = sector.gear
    return flank_compliance(
        sector.grid,
        gear,
        material,
        sector.stiffness,
        depth=depth,
        root_state=None if gear.internal or max(teeth) < gear.face_width else TEETH_STATE,
        foundation=foundation if gear.internal else None,
        widths=teeth,
    )


def with_ring(bodies: Bodies, ring_foundation=None) -> Bodies:
    """Exchange the ring: held at its outer surface, or on a foundation (2n, 2n) [N/m]; without cracks."""
    ring = bodies.gears[-1]
    assert ring.free is not None
    compliance, surface = _seen(ring.free.supported(ring_foundation), len(ring.roll))
    return bodies.with_gear(
        -1, replace(ring, regular=regular_compliance(compliance, ring.local), surface=surface, cracks=())
    )


def flank_compliance(
    grid: Grid,
    gear: Gear,
    material: Material,
    stiffness,
    *,
    depth: float | None = None,
    root_state: str | None = None,
    foundation=None,
    widths: tuple[float, float] | None = None,
) -> FlankCompliance:
    """Compute the regular flank compliance of a whole gear from the grid of one sector.

    CaseError where the depth reaches out of the tooth or the sector can move freely.

    Parameters
    ----------
    grid : Grid
        Mirror-symmetric sector with boundaries ``flank_left``, ``cut_left``, ``cut_right`` and ``rim``.
    stiffness : (2n, 2n) sparse matrix
        Stiffness of the sector [N/m].
    depth : float, optional
        Largest joining depth [m]; see `joining_depth`.
    root_state : str, optional
        Plane state of the whole of `stiffness`: the stresses in the roots are observed with the flanks,
        otherwise the displacements of the stations themselves.
    foundation : (2n, 2n) sparse matrix, optional
        Stiffness that supports the rim [N/m], the bore or the outer surface of a ring; held without it.
    widths : (float, float), optional
        Over which the left and the right flank touch their mates [m]; the face width without it.
    """
    stations, depths, loads, observations = observed_flanks(grid, gear, depth)
    along = None if root_state is None else root_functionals(grid, gear, material, state=root_state)
    observations = np.hstack([observations, loads if along is None else along.columns])
    free = condense_sector(grid, stiffness, count=gear.teeth, rim="rim", loads=loads, observations=observations)
    compliance, further = _seen(free.supported(foundation), len(stations.roll))
    flank = _without_half_plane(
        gear, material, stations, depths, compliance, len(grid.points), widths or (gear.face_width,) * 2
    )
    if along is None:
        return replace(flank, surface=further, free=free)
    return replace(flank, root=ObservedRoot(along, stations, further))


def _seen(schur: SectorSchur, stations: int) -> tuple[np.ndarray, SectorSchur]:
    """Compliance between the flanks of all teeth [m/N], and the sector with what else it observes."""
    return tooth_compliance(schur.observed(slice(stations))), schur.observed(slice(stations, None)).packed()


def flank_stations(grid: Grid, gear: Gear) -> _FlankStations:
    """Find the vertices of the left flank with their inward unit normals."""
    nodes = np.unique(np.asarray(grid.boundaries["flank_left"])[:, :2])
    points = np.asarray(grid.points)[nodes]
    order = np.argsort(np.hypot(*points.T))
    nodes, points = nodes[order], points[order]
    radius = np.hypot(*points.T)
    pressure_angle = np.arccos(np.minimum(gear.base_radius / radius, 1.0))
    sign = -1.0 if gear.internal else 1.0
    outward = np.arctan2(points[:, 1], points[:, 0]) + np.pi / 2 - sign * pressure_angle
    normals = -np.column_stack([np.cos(outward), np.sin(outward)])
    roll = gear.base_radius * np.tan(pressure_angle)
    return _FlankStations(nodes, roll, points, normals)


def joining_depth(gear: Gear, radius, depth: float | None) -> np.ndarray:
    """Joining depth (n,) [m] under flank points at radii (n,) [m].

    A quarter of the module or the `depth` [m] given, at most 0.3 of the tooth thickness at each radius,
    so that twice the depth stays in the tooth.
    """
    limit = 0.25 * gear.module if depth is None else depth
    return np.minimum(limit, 0.3 * tooth_thickness(gear, radius))


def flank_load_columns(grid: Grid, stations: _FlankStations) -> np.ndarray:
    """Unit inward normal nodal forces at the stations, shape (2 n_nodes, n)."""
    loads = np.zeros((2 * len(grid.points), len(stations.nodes)))
    column = np.arange(len(stations.nodes))
    loads[2 * stations.nodes, column] = stations.normals[:, 0]
    loads[2 * stations.nodes + 1, column] = stations.normals[:, 1]
    return loads


def active_flank_weights(stations: _FlankStations, planetary_set: PlanetarySet) -> np.ndarray:
    """Spread a unit force evenly over the active flank of the ring tooth: share (n,) of each station."""
    pair = mesh_pairs(planetary_set)[1]
    active = pair.roll_on(1, pair.path)
    # every station carries the part of its own piece of the flank that is active
    middle = 0.5 * (stations.roll[1:] + stations.roll[:-1])
    ends = np.concatenate([stations.roll[:1], middle, stations.roll[-1:]])
    weight = np.diff(np.clip(ends, active.min(), active.max()))
    return weight / weight.sum()


def active_flank_load(grid: Grid, planetary_set: PlanetarySet, side: float) -> np.ndarray:
    """Spread a unit inward normal force evenly over the active flank of the ring tooth, (2n, 1) nodal forces.

    ``grid`` is the sector of the ring; ``side`` +1 loads the left flank, -1 the right one.
    """
    stations = flank_stations(grid, planetary_set.ring)
    load = flank_load_columns(grid, stations) @ active_flank_weights(stations, planetary_set)[:, None]
    return load if side > 0 else mirrored_columns(load, mirror_nodes(grid))


def active_flank_friction(grid: Grid, planetary_set: PlanetarySet, side: float) -> np.ndarray:
    """Spread a unit friction force along the active flank of the ring tooth, and a unit turning of it, (2n, 2) forces.

    The force acts along the tangent as flank 1 moves while the planet drives, the couple of normal forces as the
    planet turns then. ``grid`` and ``side`` as in `active_flank_load`.
    """
    stations = flank_stations(grid, planetary_set.ring)
    weights, normal = active_flank_weights(stations, planetary_set), stations.normals
    # planets turn clockwise while the left flank of the ring carries
    tangent = np.column_stack([normal[:, 1], -normal[:, 0]])
    arm = stations.points - weights @ stations.points
    along = weights * (arm * tangent).sum(axis=1)
    turned = along * (arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0])
    couple = -along / turned.sum()
    loads = np.zeros((2 * len(grid.points), 2))
    for axis in (0, 1):
        loads[2 * stations.nodes + axis, 0] = weights * tangent[:, axis]
        loads[2 * stations.nodes + axis, 1] = couple * normal[:, axis]
    return loads if side > 0 else mirrored_columns(loads, mirror_nodes(grid))


def root_functionals(grid: Grid, gear: Gear, material: Material, *, state: str) -> BoundaryStress:
    """Tangential stress along fillet and root arc of the left flank, in the direction of the boundary."""
    names = tuple(name for name in ("fillet_left", "root_left") if name in grid.boundaries)
    return tangential_stress(grid, material, names[::-1] if gear.internal else names, state=state)


def station_weights(roll, stations):
    """Compute indices and cubic Lagrange weights (..., 4) on equidistant stations (n,) [m].

    At roll lengths (...) [m]; values outside the stations are extrapolated by at most half a spacing.
    """
    step = (stations[-1] - stations[0]) / (len(stations) - 1)
    position = np.clip((np.asarray(roll) - stations[0]) / step, -0.5, len(stations) - 0.5)
    first = np.clip(np.floor(position).astype(int) - 1, 0, len(stations) - 4)
    t = position - first
    weight = np.stack(
        [
            -(t - 1) * (t - 2) * (t - 3) / 6,
            t * (t - 2) * (t - 3) / 2,
            -t * (t - 1) * (t - 3) / 2,
            t * (t - 1) * (t - 2) / 6,
        ],
        axis=-1,
    )
    return first[..., None] + np.arange(4), weight


def observed_flanks(grid, gear, depth=None):
    """Find stations, depths (n, 1) [m], unit loads (2n, n), and what both depths tell of the surface."""
    stations = flank_stations(grid, gear)
    depths = joining_depth(gear, np.hypot(*stations.points.T), depth)[:, None]
    _check_depth(depth, stations)
    once, twice = (interpolation(grid, stations.points + factor * depths * stations.normals) for factor in (1.0, 2.0))
    seen = directional(2.0 * once - twice, stations.normals)
    return stations, depths, flank_load_columns(grid, stations), seen


def _without_half_plane(gear, material, stations, depths, compliance, nodes, widths) -> FlankCompliance:
    """Take the local parts at both depths out of a compliance (teeth, 2n, 2n) that went on to the surface."""
    arc = stations.roll**2 / (2 * gear.base_radius)
    offset = arc[:, None] - arc[None, :]
    corner = tip_corner(gear, material)
    away = np.abs(arc - corner.arc)
    # a load on the corner itself stands a thousandth of the module beside it, far less than any depth
    loaded = np.maximum(away, 1e-3 * gear.module)
    once, twice = (
        depth_displacement(offset, factor * depths, material.shear_modulus, material.poisson_ratio)
        + corner.depth(away[:, None], factor * depths, loaded[None, :])
        for factor in (1.0, 2.0)
    )
    local = np.array([(2.0 * once - twice) / width for width in widths])
    return FlankCompliance(
        roll=stations.roll,
        base_radius=gear.base_radius,
        regular=regular_compliance(compliance, local),
        depth=depths[:, 0],
        corner=corner,
        local=local,
        unknowns=2 * len(compliance) * nodes,
    )


def regular_compliance(compliance: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Take the local part (2, n, n) [m/N] on each flank out of a compliance (teeth, 2n, 2n) [m/N].

    The rest (teeth, 2n, 2n) is made reciprocal.
    """
    regular, n = compliance.copy(), local.shape[-1]
    for side in (LEFT, RIGHT):
        block = slice(side * n, (side + 1) * n)
        regular[0, block, block] -= local[side]
    # reciprocity holds for the exact field; the two depths break it by the size of the discretisation error
    return 0.5 * (regular + np.roll(regular[::-1], 1, axis=0).transpose(0, 2, 1))


def _check_depth(depth: float | None, stations: _FlankStations) -> None:
    """Under half an element below a nodal load the finite-element field is still that of the single node."""
    spacing = float(np.linalg.norm(np.diff(stations.points, axis=0), axis=1).max())
    if depth is not None and not depth >= 0.5 * spacing:
        raise CaseError(
            f"a joining depth of {1e3 * depth:.4g} mm is within the elements at the flank",
            code="E-RANGE",
            key="static.depth",
            value=f"{1e3 * depth:.4g} mm",
            limit=f"at least half an element of the flank, {500 * spacing:.4g} mm",
            remedy="leave static.depth out, give a larger one, or raise static.flank_elements",
        )
