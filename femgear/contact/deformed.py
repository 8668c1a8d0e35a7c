"""Displacement fields of all gears of a set under the tooth loads of one position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import mesh_pairs
from femgear.contact.flanks import flank_load_columns, flank_stations
from femgear.contact.teeth import tooth_zero_angles

if TYPE_CHECKING:
    from femgear.contact.bodies import Sector, Sectors
    from femgear.contact.cycle import MeshCycle
    from femgear.gears import PlanetarySet


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
    s, N = planetary_set, planetary_set.n_planets
    sun_angle, planet_angles, ring_angle = tooth_zero_angles(s, float(cycle.position[position]))
    meshes = range(N)
    bodies = [("sun", "sun", sectors.sun, np.zeros(2), sun_angle, [(j, 0, 0) for j in meshes])]
    for n, psi in enumerate(s.planet_angles):
        centre = s.centre_distance * np.array([np.cos(psi), np.sin(psi)])
        on_planet = [(n, 1, 0), (N + n, 0, 1)]
        bodies.append((f"planet {n + 1}", "planet", sectors.planet, centre, planet_angles[n], on_planet))
    bodies.append(("ring", "ring", sectors.ring, np.zeros(2), ring_angle, [(N + j, 1, 0) for j in meshes]))
    return tuple(
        DeformedBody(name, kind, centre, float(angle), _displacement(s, sector, cycle, position, acting))
        for name, kind, sector, centre, angle, acting in bodies
    )


def _displacement(planetary_set, sector: Sector, cycle, position, acting):
    """Displacement of one body; `acting` lists (mesh, gear of the pair, drive flank) of its meshes."""
    from femgear.fe.compliance import mirror_nodes, mirrored_columns
    from femgear.fe.field import cyclic_displacement

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
                zeta = np.clip(path[mesh, t, position], *pair.path)
                roll = pair.pitch_roll_1 + zeta if gear == 0 else pair.pitch_roll_2 - pair.sign * zeta
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
