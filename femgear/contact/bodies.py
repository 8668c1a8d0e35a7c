"""From gears to flank compliances: sector grids, stiffness matrices, and one factorisation a gear."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import Bodies, mesh_pairs
from femgear.contact.flanks import flank_compliance, flank_load_columns, flank_stations

if TYPE_CHECKING:
    from femgear.fe.elasticity import Material
    from femgear.fe.grid import Grid
    from femgear.gears import Gear, PlanetarySet

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
    ring, held = sectors.ring, "rim"
    stiffness = ring.stiffness
    if ring_foundation is not None:
        stiffness, held = stiffness + ring_foundation, None
    compliances.append(flank_compliance(ring.grid, ring.gear, material, stiffness, held=held, depth=depth))
    return Bodies(*compliances, material=material, face_width=sectors.sun.gear.face_width)


def ring_on_foundation(bodies: Bodies, sectors: Sectors, ring_foundation, *, depth: float | None) -> Bodies:
    """The same bodies with the ring on an elastic foundation instead of held at its outer surface.

    Parameters
    ----------
    bodies, sectors : Bodies, Sectors
    ring_foundation : sparse matrix
        Stiffness of the foundation of one sector [N/m].
    depth : float, optional
        As for `make_bodies`.
    """
    ring = sectors.ring
    stiffness = ring.stiffness + ring_foundation
    found = flank_compliance(ring.grid, ring.gear, bodies.material, stiffness, held=None, depth=depth)
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
    active = pair.pitch_roll_2 - pair.sign * np.asarray(pair.path)
    weight = np.gradient(stations.roll) * ((stations.roll >= active.min()) & (stations.roll <= active.max()))
    load = flank_load_columns(grid, stations) @ (weight / weight.sum())[:, None]
    return load if side > 0 else mirrored_columns(load, mirror_nodes(grid))
