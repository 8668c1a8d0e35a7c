"""The toothed ring as the dynamic model sees it: cyclic modes on a foundation, loaded at its flanks.

In the carrier frame the teeth pass under a load that stands still. The ring is therefore represented by
its cyclic components with a load spread over the active flank of one tooth; what the passing teeth add
is part of the mesh stiffness, not of the ring.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from femgear.fe.grid import Grid
    from femgear.fe.reduction import CyclicModes
    from femgear.gears import PlanetarySet

RADIAL, TANGENTIAL = 0, 1
# nodal diameters of the ring model: their amplitudes fall fast, and 54 points of the housing resolve them
MAX_DIAMETER = 26


@dataclass(frozen=True)
class RingModel:
    """Modes of the ring and its static compliance at the meshes.

    Parameters
    ----------
    modes : CyclicModes
        One load (displacement into the ring at the loaded flank), outputs radial and tangential
        displacement of the outer surface above a tooth.
    load_angle : float
        Angle from a planet to the centre of the ring tooth that it loads [rad].
    compliance : (n_max + 1,) array
        Static compliance of each nodal diameter at the load, on the foundation [m/N].
    """

    modes: CyclicModes
    load_angle: float
    compliance: np.ndarray


def outer_surface_outputs(grid: Grid) -> np.ndarray:
    """Radial and tangential displacement of the outer surface at the tooth centreline, shape (2n, 2)."""
    rim = np.unique(grid.boundaries["rim"])
    node = rim[np.argmin(np.abs(grid.points[rim, 1]))]
    outputs = np.zeros((2 * len(grid.points), 2))
    outputs[2 * node, RADIAL] = outputs[2 * node + 1, TANGENTIAL] = 1.0
    return outputs


def ring_model(
    planetary_set: PlanetarySet,
    grid: Grid,
    stiffness,
    mass,
    foundation,
    load,
    *,
    max_diameter: int,
    max_frequency: float,
    side: float = 1.0,
) -> RingModel:
    """Ring modes for nodal diameters 0..max_diameter.

    Parameters
    ----------
    planetary_set : PlanetarySet
    grid : Grid
        Sector of the ring.
    stiffness, mass, foundation : (2n, 2n) sparse matrices
        Of the sector.
    load : (2n, 1) array
        Unit force into the ring at the flank that carries.
    max_diameter : int
    max_frequency : float
        Modes beyond are represented by their static part [Hz].
    side : float
        Sign of the sun's torque: which flanks carry.
    """
    from femgear.fe.compliance import condense_sector, cyclic_harmonics
    from femgear.fe.reduction import cyclic_modes, sector_basis
    from femgear.gears.gear import half_thickness_angle

    ring = planetary_set.ring
    diameters = np.arange(max_diameter + 1)
    basis = sector_basis(grid, stiffness + foundation, mass, count=ring.teeth, loads=load)
    modes = cyclic_modes(
        basis,
        count=ring.teeth,
        nodal_diameters=diameters,
        loads=load,
        outputs=outer_surface_outputs(grid),
        max_frequency=max_frequency,
    )
    condensed = condense_sector(
        grid, stiffness + foundation, count=ring.teeth, held=None, loads=load, observations=load
    )
    pitch_radius = ring.base_radius / np.cos(planetary_set.working_pressure_angle_planet_ring)
    return RingModel(
        modes=modes,
        load_angle=-side * float(half_thickness_angle(ring, pitch_radius)),
        compliance=cyclic_harmonics(condensed, diameters)[:, 0, 0].real,
    )
