"""The other flanks: a negative torque is the mirror image of a set under a positive one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.contact.cycle import MeshCycle, walk_mesh_cycle
from femgear.contact.mirror_image import mirrored_set

__all__ = ["mirrored_set", "walk_either_flank"]


def walk_either_flank(
    planetary_set, bodies, *, sun_torque, positions=64, contact="profile", planet_gaps=None, progress=None
) -> MeshCycle:
    """`walk_mesh_cycle` for a torque of either sign; results keep the order of planets and positions.

    For a negative torque the right flanks of the sun carry. Position zero is then where the right flanks of
    "sun-planet 1" touch at the pitch point, and positions still run with the rotation of the sun.
    """
    options = {"positions": positions, "contact": contact, "progress": progress}
    if sun_torque >= 0:
        return walk_mesh_cycle(
            planetary_set, bodies, sun_torque=sun_torque, planet_gaps=planet_gaps, **options
        )
    mirrored, order = mirrored_set(planetary_set)
    turned = None if planet_gaps is None else np.asarray(planet_gaps, float)[order]
    cycle = walk_mesh_cycle(mirrored, bodies, sun_torque=-sun_torque, planet_gaps=turned, **options)
    N, P = len(order), len(cycle.position)
    back = np.empty(N, int)
    back[order] = np.arange(N)
    mesh, position = np.concatenate([back, back + N]), -np.arange(P) % P
    return replace(
        cycle,
        deflection=cycle.deflection[mesh][:, position],
        sun_arc=cycle.sun_arc[position],
        force=cycle.force[mesh][:, position],
        back_force=cycle.back_force[mesh][:, position],
        stiffness=cycle.stiffness[mesh][:, position],
        # the pair that comes first along the path leaves first when the rotation is seen from behind
        tooth_load=cycle.tooth_load[mesh][:, ::-1][:, :, position],
        path=-cycle.path[mesh][:, ::-1][:, :, position],
        tooth=-cycle.tooth[:, mesh][:, :, ::-1],
        max_pressure=cycle.max_pressure[mesh][:, position],
        edge_contact=cycle.edge_contact[mesh][:, position],
        open_planets=cycle.open_planets[back][:, position],
        residual=cycle.residual[position],
        iterations=cycle.iterations[position],
    )
