"""Modes of the lumped planetary set and their kinds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.kinds import SetMotions, class_energies, named_kinds
from femgear.models.planar import (
    CENTRAL,
    PlanarSet,
    free_motions,
    mesh_directions,
    pin_directions,
    planar_system,
)
from femgear.models.planar_data import RigidSet, body_masses, member_radius
from femgear.solvers.modal import solve_modes
from femgear.system import Modes


def planar_modes(data: PlanarSet, *, mesh_stiffness=None, damping_ratio: float = 0.0) -> Modes:
    """Modes of the set at standstill, with their kinds.

    Parameters
    ----------
    data : PlanarSet
    mesh_stiffness : (2N,) array, optional
        [N/m]; that of the set when not given.
    damping_ratio : float
        Of all modes.

    Returns
    -------
    Modes
        ``kind`` from `planar_kinds`.
    """
    stiffness = data.mesh_stiffness if mesh_stiffness is None else mesh_stiffness
    modes = solve_modes(planar_system(data), stiffness, damping_ratio=damping_ratio)
    return replace(modes, kind=planar_kinds(data, modes.shape, frequency=modes.frequency))


def planar_kinds(data: PlanarSet, shape, *, frequency) -> tuple[str, ...]:
    """Kind of every mode from its shape.

    Parameters
    ----------
    data : PlanarSet
    shape : (n, m) array
        In the coordinates of `planar_system`.
    frequency : (m,) array
        Zero for rigid-body modes.

    Returns
    -------
    tuple of str
        ``rigid``; ``rotational``, ``translational`` or ``planet`` where at least 99 % of the kinetic energy
        belongs to that class; else ``mixed``, as for most modes of unequally spaced planets.

    Raises
    ------
    CaseError
        Shapes of another system (E-SHAPE).
    """
    return named_kinds(class_shares(data, shape), frequency)


def class_shares(data: PlanarSet, shape) -> np.ndarray:
    """Shares (3, m) of rotational, translational and planet motion in the kinetic energy.

    See `femgear.models.kinds.class_energies`, also for unequal spacing.
    """
    return energy_shares(planar_motions(data, shape))


def energy_shares(motions: SetMotions) -> np.ndarray:
    """`class_energies` (3, m) over the whole kinetic energy."""
    central = np.einsum("ba,bam->m", motions.central_mass, np.abs(motions.central) ** 2)
    return class_energies(motions) / (central + (np.abs(motions.weighted) ** 2).sum(axis=(0, 1)))


def planar_motions(data: PlanarSet, shape) -> SetMotions:
    """Motions of all bodies, held ones and planets fixed to their pins included.

    Parameters
    ----------
    data : PlanarSet
    shape : (n, m) array
        In the coordinates of `planar_system`.

    Raises
    ------
    CaseError
        Shapes of another system (E-SHAPE).
    """
    full, mass = body_motions(data, free_motions(data), shape), body_masses(data)
    return SetMotions(full[:3], mass[:3], full[3:], mass[3:], data.planet_angles)


def body_motions(data: RigidSet, T: np.ndarray, shape) -> np.ndarray:
    """Mode shapes (n, m) in all coordinates (N + 3, axes, m); `T` are the free motions (E-SHAPE)."""
    shape = np.asarray(shape)
    if shape.ndim != 2 or len(shape) != T.shape[1]:
        raise CaseError(
            f"mode shapes of shape {shape.shape}", code="E-SHAPE", limit=f"({T.shape[1]}, modes)"
        )  # fmt: skip
    bodies = data.n_planets + 3
    return (T @ shape).reshape(bodies, len(T) // bodies, -1)


def planar_springs(data: PlanarSet, *, mesh_stiffness=None) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Springs of the set by name, for `femgear.solvers.mode_energy.strain_shares`.

    Parameters
    ----------
    data : PlanarSet
    mesh_stiffness : (2N,) array, optional
        [N/m]; that of the set when not given.

    Returns
    -------
    dict of str to (columns (n, g), stiffness (g,))
        Meshes one by one, planet bearings one by one, supports and torsional supports of the central members;
        what is held or free has no spring.
    """
    T, N = free_motions(data), data.n_planets
    k = np.asarray(data.mesh_stiffness if mesh_stiffness is None else mesh_stiffness, float)
    meshes, pins = T.T @ mesh_directions(data), pin_directions(data)
    names = [f"sun-planet {n + 1}" for n in range(N)] + [f"planet {n + 1}-ring" for n in range(N)]
    springs = {name: (meshes[:, [j]], k[[j]]) for j, name in enumerate(names)}
    for n, bearing in enumerate(data.planet_bearing):
        if np.isfinite(bearing):
            springs[f"bearing of planet {n + 1}"] = (T.T @ pins[:, n], np.full(2, bearing))
    for row, name in enumerate(CENTRAL):
        body = getattr(data, name)
        torsion = body.torsional_support / member_radius(data, name) ** 2
        for text, first, stiffness in (
            (f"support of the {name}", 3 * row, np.full(2, body.support)),
            (f"torsional support of the {name}", 3 * row + 2, np.array([torsion])),
        ):
            if np.all(np.isfinite(stiffness)) and np.any(stiffness):
                springs[text] = (T[first : first + len(stiffness)].T, stiffness)
    return springs
