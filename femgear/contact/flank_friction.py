"""Friction of the teeth in the equilibrium of the contact: its levers on the motions, and what a walk keeps of it.

At every tooth pair a normal force F comes with a friction force ``mu F`` along the tangent, against the sliding of the
flanks, which turns round at the pitch point. Gear i feels it with the lever of its roll length ``rho_i``, the distance
of the tangent from its axis, beside F with the base radius:

    (G + mu sigma R)^T p = load,    sigma = sign of the path coordinate,

with ``rho_i / r_bi`` in R for arcs on base circles and the tangential direction for members that move (M. Vaishya, R.
Singh, J. Sound Vib. 248, 2001, 671-694; S. He, R. Gunda, R. Singh, J. Sound Vib. 301, 2007, 927-949). The gaps keep G:
what ``mu F`` bends is left out (G. Liu, R. G. Parker, J. Sound Vib. 320, 2009, 1039-1063, have it). The compliance is
symmetric no more, the power of the torques is: what goes in less what comes out is the sum of ``mu F |v_s|``, for any
pressures in equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.contact.supports import MovingMembers
from femgear.gears.pair import GearSet

AT_PITCH = 1e-9
"""Part of the base pitch before the pitch point from which on a tooth pair has passed it."""


@dataclass(frozen=True)
class WindowFriction:
    """Friction of the windows of `femgear.contact.assembly.Candidates`, at P positions.

    Parameters
    ----------
    factor : (P, W) array
        Friction force over the load of the window, along the tangent as `MeshCycle.friction_force` [1].
    arms : (P, W, m) array
        What it adds to the approach per unit motion in the equilibrium [1].
    supports : (P, W, W) array
        Approach at a window per load on another one by friction on sprung members [m/N].
    """

    factor: np.ndarray
    arms: np.ndarray
    supports: np.ndarray

    def at(self, rows: np.ndarray) -> WindowFriction:
        """Take some of the positions, by their numbers (P',)."""
        return WindowFriction(self.factor[rows], self.arms[rows], self.supports[rows])


def path_sense(path: np.ndarray, base_pitch: float) -> np.ndarray:
    """Give the sign (...) of the sliding of gear 1 on gear 2 while gear 1 drives, by path coordinates (...) [m].

    At the pitch point, where flanks roll, that after it.
    """
    return np.where(path > -AT_PITCH * base_pitch, 1.0, -1.0)


def rolls_over_radii(gears: GearSet, path: np.ndarray, mesh: np.ndarray) -> np.ndarray:
    """Compute ``rho_i / r_bi`` (2, ...) of gear 1 and gear 2 at path coordinates (...) [m] of meshes (...)."""
    kinds = gears.kinds
    tangent = gears.of_kinds([np.tan(pair.working_pressure_angle) for pair in kinds])[mesh]
    radius = gears.of_kinds([[gear.base_radius for gear in pair.gears] for pair in kinds])[mesh]
    sense = gears.of_kinds([1.0 if pair.gear_2.internal else -1.0 for pair in kinds])[mesh]
    return np.stack([tangent + path / radius[..., 0], tangent + sense * path / radius[..., 1]])


def window_friction(
    gears: GearSet,
    path: np.ndarray,
    mesh: np.ndarray,
    coefficient: tuple[float, ...],
    members: MovingMembers,
    *,
    images: np.ndarray | None,
) -> WindowFriction:
    """Compute levers of friction at windows with path coordinates (P, W) [m] in meshes (W,).

    Parameters
    ----------
    gears : GearSet
        With the planets that have windows.
    coefficient : tuple of float
        Of every kind of mesh, over the force in the transverse section; negative where gear 2 drives.
    members : MovingMembers
        Of the whole set.
    images : (M,) int array or None
        Sectors of the meshes of the whole set, whose free members stay; None where all meshes have windows.
    """
    kind = gears.mesh_kind[mesh]
    factor = np.asarray(coefficient)[kind] * path_sense(path, gears.base_pitch)
    turns = gears.rotation_approach[mesh]
    of_gears = rolls_over_radii(gears, path, np.broadcast_to(mesh, path.shape))
    arms = turns * np.where(turns > 0.0, of_gears[0][..., None], of_gears[1][..., None])
    sprung = ~members.free
    between = (members.approach[:, sprung] / members.stiffness[sprung]) @ members.sliding[:, sprung].T
    if images is None:
        free = members.sliding[mesh][:, members.free]
        arms = np.concatenate([arms, np.broadcast_to(free, (*path.shape, free.shape[1]))], axis=-1)
    else:
        between = np.sum([between[images == 0][:, images == i] for i in range(images.max() + 1)], axis=0)
    return WindowFriction(factor, factor[..., None] * arms, factor[:, None] * between[np.ix_(mesh, mesh)])


def friction_of_record(
    gears: GearSet, coefficient: tuple[float, ...], record: Any, ahead: np.ndarray | None
) -> dict[str, np.ndarray]:
    """Compute friction forces [N] and their moments about the pitch points [N m] of all meshes (M, P).

    By the names of `femgear.contact.cycle.MeshCycle`, of which the record is one; ``ahead`` (slices,) is that of
    helical slices [mesh periods].
    """
    path, load = record.path, record.tooth_load
    if record.slice_load is not None:
        load = record.slice_load / record.slice_load.shape[2]
        path = path[:, :, None] + gears.base_pitch * (0.0 if ahead is None else np.reshape(ahead, (-1, 1)))
        shape = len(load), -1, load.shape[-1]
        path, load = np.broadcast_to(path, load.shape).reshape(shape), load.reshape(shape)
    force = gears.of_kinds(coefficient)[:, None, None] * path_sense(path, gears.base_pitch) * load
    return {"friction_force": force.sum(axis=1), "friction_moment": (force * path).sum(axis=1)}
