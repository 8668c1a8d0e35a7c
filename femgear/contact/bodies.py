"""From gears to flank compliances, and from tooth loads back to the deformed gears.

Every gear has one sector grid, one stiffness matrix and one factorisation (`make_sectors`, `make_bodies`).
The displacement fields of all gears of a set under the tooth loads of one position follow from the same
sectors (`deformed_set`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import Bodies, acting_flanks, mesh_pairs
from femgear.contact.candidates import tooth_zero_angles
from femgear.contact.flanks import flank_compliance, flank_load_columns, flank_stations

if TYPE_CHECKING:
    from femgear.contact.cycle import MeshCycle
    from femgear.fe.elasticity import Material
    from femgear.fe.grid import Grid
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet

# external gears are slender along the axis only; the ring's rim is thin and free at its faces
TEETH_STATE = "plane strain"
RING_STATE = {"tooth": "plane strain", "body": "plane stress"}


@dataclass(frozen=True)
class Sector:
    """One tooth sector of a gear: grid in the tooth frame and stiffness matrix [N/m]."""

    gear: Gear
    grid: Grid
    stiffness: object


@dataclass(frozen=True)
class Sectors:
    """Sectors of the three kinds of gears."""

    sun: Sector
    planet: Sector
    ring: Sector


def make_sectors(
    planetary_set: PlanetarySet,
    material: Material,
    *,
    flank_elements: int = 24,
    refine: float = 1.0,
    cache: Path | None = None,
) -> Sectors:
    """Mesh one sector of each gear and assemble its stiffness.

    Parameters
    ----------
    planetary_set : PlanetarySet
    material : Material
    flank_elements : int
        Element edges along a flank.
    refine : float
        Divides all element sizes.
    cache : path, optional
        Folder of generated grids.
    """
    from femgear.fe.elasticity import stiffness
    from femgear.fe.grid import mirror
    from femgear.fe.meshing import mesh_outlines
    from femgear.gears.tooth import half_sector

    gears = (planetary_set.sun, planetary_set.planet, planetary_set.ring)
    halves = [half_sector(gear, flank_elements=flank_elements, refine=refine) for gear in gears]
    grids = mesh_outlines(halves, cache=cache)
    sectors = []
    for gear, grid in zip(gears, grids, strict=True):
        whole = mirror(grid)
        state = RING_STATE if gear.internal else TEETH_STATE
        matrix = stiffness(whole, material, state=state, thickness=gear.face_width)
        sectors.append(Sector(gear, whole, matrix))
    return Sectors(*sectors)


def make_bodies(
    sectors: Sectors, material: Material, *, depth: float | None = None, ring_foundation=None
) -> Bodies:
    """Flank compliances with sun and planets held at their bores and the ring at its outer surface.

    Parameters
    ----------
    sectors : Sectors
    material : Material
    depth : float, optional
        Largest depth at which body and half plane are joined [m].
    ring_foundation : sparse matrix, optional
        Stiffness of an elastic foundation of the ring, which then is not held [N/m].
    """
    # the ring's roots need a solution of their own: its sector is not of one plane state, see `root_stress`
    compliances = [
        flank_compliance(
            s.grid, s.gear, material, s.stiffness, held="rim", depth=depth, root_state=TEETH_STATE
        )
        for s in (sectors.sun, sectors.planet)
    ]
    bodies = Bodies(*compliances, None, material=material, face_width=sectors.sun.gear.face_width)
    return with_ring(bodies, sectors, depth=depth, ring_foundation=ring_foundation)


def with_ring(bodies: Bodies, sectors: Sectors, *, depth: float | None, ring_foundation=None) -> Bodies:
    """The same bodies with the ring held at its outer surface, or on an elastic foundation.

    Parameters
    ----------
    bodies, sectors : Bodies, Sectors
    depth, ring_foundation
        As for `make_bodies`.
    """
    ring, held, stiffness = sectors.ring, "rim", sectors.ring.stiffness
    if ring_foundation is not None:
        stiffness, held = stiffness + ring_foundation, None
    found = flank_compliance(ring.grid, ring.gear, bodies.material, stiffness, held=held, depth=depth)
    return replace(bodies, ring=found)


def active_flank_load(grid: Grid, planetary_set: PlanetarySet, side: float) -> np.ndarray:
    """Unit inward normal force spread evenly over the active flank of the ring tooth, shape (2n, 1).

    Parameters
    ----------
    grid : Grid
        Sector of the ring.
    planetary_set : PlanetarySet
    side : float
        +1 loads the left flank, -1 the right one.
    """
    from femgear.fe.compliance import mirror_nodes, mirrored_columns

    stations = flank_stations(grid, planetary_set.ring)
    pair = mesh_pairs(planetary_set)[1]
    active = pair.roll_on(1, pair.path)
    # every station carries the part of its own piece of the flank that is active
    middle = 0.5 * (stations.roll[1:] + stations.roll[:-1])
    ends = np.concatenate([stations.roll[:1], middle, stations.roll[-1:]])
    weight = np.diff(np.clip(ends, active.min(), active.max()))
    load = flank_load_columns(grid, stations) @ (weight / weight.sum())[:, None]
    return load if side > 0 else mirrored_columns(load, mirror_nodes(grid))


@dataclass(frozen=True)
class DeformedBody:
    """One gear in the frame of the set: where its sector 0 is turned to and how every sector moves.

    Parameters
    ----------
    name : str
    kind : str
        ``"sun"``, ``"planet"`` or ``"ring"``.
    centre : (2,) array
        [m].
    angle : float
        Angle of the centreline of sector 0 [rad].
    displacement : (count, n, 2) array
        Of every node of every sector, in the frame of that sector [m].
    """

    name: str
    kind: str
    centre: np.ndarray
    angle: float
    displacement: np.ndarray


def deformed_set(
    planetary_set: PlanetarySet, sectors: Sectors, cycle: MeshCycle, *, position: int = 0
) -> tuple[DeformedBody, ...]:
    """Elastic displacement of sun, planets and ring, each held as in the static problem.

    The load of each tooth pair acts at its point on the line of action; the half-plane indentation, a few
    tenths of a micrometre deep, is not part of the field.

    Parameters
    ----------
    planetary_set : PlanetarySet
        With the torque on the left flanks of the sun (mirror the set otherwise).
    sectors : Sectors
    cycle : MeshCycle
        Of that set.
    position : int
        Index into ``cycle.position``.
    """
    s = planetary_set
    sun_angle, planet_angles, ring_angle = tooth_zero_angles(s, float(cycle.position[position]))
    on_sun, on_planets, on_ring = acting_flanks(s.n_planets)
    bodies = [("sun", "sun", sectors.sun, np.zeros(2), sun_angle, on_sun)]
    for n, psi in enumerate(s.planet_angles):
        centre = s.centre_distance * np.array([np.cos(psi), np.sin(psi)])
        bodies.append((f"planet {n + 1}", "planet", sectors.planet, centre, planet_angles[n], on_planets[n]))
    bodies.append(("ring", "ring", sectors.ring, np.zeros(2), ring_angle, on_ring))
    return tuple(
        DeformedBody(name, kind, centre, float(angle), _displacement(s, sector, cycle, position, acting))
        for name, kind, sector, centre, angle, acting in bodies
    )


def _displacement(planetary_set, sector: Sector, cycle, position, acting):
    """Displacement of one body; `acting` lists (mesh, gear of the pair, drive flank) of its meshes."""
    from femgear.fe.compliance import cyclic_displacement, mirror_nodes, mirrored_columns

    stations = flank_stations(sector.grid, sector.gear)
    left = flank_load_columns(sector.grid, stations)
    columns = (left, mirrored_columns(left, mirror_nodes(sector.grid)))
    loads = np.zeros((sector.gear.teeth, left.shape[0]))
    pairs = mesh_pairs(planetary_set)
    N, turns = planetary_set.n_planets, int(np.floor(cycle.position[position]))
    sides = (
        (cycle.tooth, cycle.path, cycle.tooth_load, columns),
        (cycle.back_tooth, cycle.back_path, cycle.back_tooth_load, columns[::-1]),
    )
    for mesh, gear, drive in acting:
        pair = pairs[mesh >= N]
        # with every mesh period the sun's teeth move on by one, those of planets and ring back
        moved_on = -1 if mesh < N and gear == 0 else 1
        for tooth, path, tooth_load, flanks in sides:
            for t in np.flatnonzero(tooth_load[mesh, :, position] > 0.0):
                roll = pair.roll_on(gear, path[mesh, t, position])
                number = (tooth[gear, mesh, t] + moved_on * turns) % sector.gear.teeth
                force = tooth_load[mesh, t, position]
                loads[number] += force * (flanks[drive] @ _hat(roll, stations.roll))
    return cyclic_displacement(sector.grid, sector.stiffness, loads, held="rim")


def _hat(roll: float, stations: np.ndarray) -> np.ndarray:
    """Linear interpolation weights of one roll length."""
    weight = np.zeros(len(stations))
    upper = int(np.clip(np.searchsorted(stations, roll), 1, len(stations) - 1))
    t = (roll - stations[upper - 1]) / (stations[upper] - stations[upper - 1])
    weight[upper - 1], weight[upper] = 1 - t, t
    return weight
