"""The other flanks: a negative torque is the mirror image of a set under a positive one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.contact.cycle import MeshCycle, walk_mesh_cycle
from femgear.contact.mirror_image import mirrored_set
from femgear.contact.supports import RIGID
from femgear.gears.mirrored_deviations import mirrored_deviations

__all__ = ["mirrored_set", "walk_either_flank"]


def walk_either_flank(
    planetary_set,
    bodies,
    *,
    sun_torque,
    positions=64,
    contact="profile",
    deviations=None,
    supports=RIGID,
    periods=1,
    planet_gaps=None,
    both_flanks=False,
    progress=None,
) -> MeshCycle:
    """`walk_mesh_cycle` for a torque of either sign; results keep the order of planets and positions.

    For a negative torque the right flanks of the sun carry. Position zero is then where the right flanks of
    "sun-planet 1" touch at the pitch point, and positions still run with the rotation of the sun.
    """
    options = {
        "positions": positions,
        "contact": contact,
        "supports": supports,
        "periods": periods,
        "both_flanks": both_flanks,
        "progress": progress,
    }
    if sun_torque >= 0:
        return walk_mesh_cycle(
            planetary_set,
            bodies,
            sun_torque=sun_torque,
            deviations=deviations,
            planet_gaps=planet_gaps,
            **options,
        )
    mirrored, order = mirrored_set(planetary_set)
    turned = None if planet_gaps is None else np.asarray(planet_gaps, float)[order]
    if deviations is not None:
        deviations = mirrored_deviations(deviations, planetary_set, mirrored, order)
    cycle = walk_mesh_cycle(
        mirrored,
        bodies,
        sun_torque=-sun_torque,
        deviations=deviations,
        planet_gaps=turned,
        **options,
    )
    return _seen_from_front(cycle, planetary_set, order)


def _seen_from_front(cycle: MeshCycle, planetary_set, order) -> MeshCycle:
    """Results of the mirror image in the order of planets and positions of the original."""
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
        member_motion=_reflected_motion(cycle, planetary_set.planet_angles[0], back)[:, position],
    )


def _reflected_motion(cycle: MeshCycle, axis: float, back) -> np.ndarray:
    """Motions of the members reflected in the line through the first planet, planets in their own order."""
    vectors = cycle.member_motion.reshape(-1, 2, cycle.member_motion.shape[1])
    c, s = np.cos(2 * axis), np.sin(2 * axis)
    vectors = np.einsum("ij,mjp->mip", np.array([[c, s], [s, -c]]), vectors)
    names = [name.split(":")[0] for name in cycle.member_names[::2]]
    planets = [i for i, name in enumerate(names) if name.startswith("planet")]
    if planets:
        vectors[planets] = vectors[planets][back]
    return vectors.reshape(cycle.member_motion.shape)
