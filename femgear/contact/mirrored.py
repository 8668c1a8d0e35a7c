"""The other flanks: a negative torque is the mirror image of a set under a positive one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.contact.assembly import cycle_positions
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
    pressures=False,
    coupling=False,
    progress=None,
) -> MeshCycle:
    """`walk_mesh_cycle` for a torque of either sign; results keep the order of planets and positions.

    For a negative torque the right flanks of the sun carry. Position zero is then where the right flanks of
    "sun-planet 1" touch at the pitch point, and positions still run with the rotation of the sun. The
    mirror image turns the other way: its record ends at position zero, so that records which do not close
    hold the same configurations too.
    """
    options = {
        "contact": contact,
        "supports": supports,
        "periods": periods,
        "both_flanks": both_flanks,
        "pressures": pressures,
        "coupling": coupling,
        "progress": progress,
    }
    if sun_torque >= 0:
        return walk_mesh_cycle(
            planetary_set,
            bodies,
            sun_torque=sun_torque,
            positions=positions,
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
        positions=-cycle_positions(positions, periods=periods)[::-1],
        **options,
    )
    return _seen_from_front(cycle, planetary_set, order)


def _seen_from_front(cycle: MeshCycle, planetary_set, order) -> MeshCycle:
    """Results of the mirror image in the order of planets and positions of the original."""
    planet = np.argsort(order)
    mesh, axis = np.concatenate([planet, planet + len(order)]), planetary_set.planet_angles[0]
    by_mesh = ("deflection", "force", "back_force", "stiffness", "max_pressure", "edge_contact")
    found = {name: getattr(cycle, name)[mesh][:, ::-1] for name in by_mesh}
    found |= {name: getattr(cycle, name)[::-1] for name in ("sun_arc", "residual", "iterations")}
    # the pair that comes first along the path leaves first when the rotation is seen from behind
    for side in ("", "back_"):
        found[f"{side}tooth_load"] = getattr(cycle, f"{side}tooth_load")[mesh][:, ::-1, ::-1]
        found[f"{side}path"] = -getattr(cycle, f"{side}path")[mesh][:, ::-1, ::-1]
        found[f"{side}tooth"] = -getattr(cycle, f"{side}tooth")[:, mesh][:, :, ::-1]
    if cycle.pressure is not None:
        found["pressure"] = cycle.pressure[mesh][:, ::-1, ::-1, ::-1]
        found["pressure_offset"] = -cycle.pressure_offset[mesh][:, ::-1]
        found["pressure_centre"] = -cycle.pressure_centre[mesh][:, ::-1, ::-1]
    if cycle.compliance is not None:
        found["compliance"] = cycle.compliance[mesh][:, mesh][:, :, ::-1]
    return replace(
        cycle,
        position=0.0 - cycle.position[::-1],
        open_planets=cycle.open_planets[planet][:, ::-1],
        bearing_force=_reflected(cycle.bearing_force, axis)[planet][:, :, ::-1],
        member_motion=_reflected_motion(cycle, axis, planet)[:, ::-1],
        **found,
    )


def _reflected(vectors: np.ndarray, axis: float) -> np.ndarray:
    """Vectors (m, 2, P) reflected in the line at the angle `axis`."""
    c, s = np.cos(2 * axis), np.sin(2 * axis)
    return np.einsum("ij,mjp->mip", np.array([[c, s], [s, -c]]), vectors)


def _reflected_motion(cycle: MeshCycle, axis: float, back) -> np.ndarray:
    """Motions of the members reflected in the line through the first planet, planets in their own order."""
    vectors = _reflected(cycle.member_motion.reshape(-1, 2, cycle.member_motion.shape[1]), axis)
    names = [name.split(":")[0] for name in cycle.member_names[::2]]
    planets = [i for i, name in enumerate(names) if name.startswith("planet")]
    if planets:
        vectors[planets] = vectors[planets][back]
    return vectors.reshape(cycle.member_motion.shape)
