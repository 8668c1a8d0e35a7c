"""Modes of the lumped planetary set and their kinds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.planar import PlanarSet, free_motions, planar_system
from femgear.models.planar_data import body_masses
from femgear.solvers.modal import solve_modes
from femgear.system import Modes

PURE = 0.99


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
    share = class_shares(data, shape)
    names = ("rotational", "translational", "planet")
    kinds = []
    for m, value in enumerate(np.asarray(frequency)):
        best = int(share[:, m].argmax())
        kinds.append("rigid" if value == 0.0 else names[best] if share[best, m] >= PURE else "mixed")
    return tuple(kinds)


def class_shares(data: PlanarSet, shape) -> np.ndarray:
    """Shares (3, m) of rotational, translational and planet motion in the kinetic energy.

    Lin and Parker (J. Vib. Acoust. 121, 1999, section 4) for equal spacing: in a rotational mode the central
    members only turn and all planets move alike; in a translational one they only translate, and the motion
    of planet n is ``p cos psi_n + p' sin psi_n``; in a planet mode they rest, and the planets' motion is free
    of both patterns. The same patterns are looked for at unequal spacing, where they are not independent: the
    shares then need not add up to one, and a motion that no class explains reaches 99 % in none.
    """
    full, mass = _motion(data, shape)
    energy = mass[:, :, None] * np.abs(full) ** 2
    psi = data.planet_angles
    alike = np.ones((len(psi), 1)) / np.sqrt(len(psi))
    waves = _orthonormal(np.column_stack([np.cos(psi), np.sin(psi)]))
    both = _orthonormal(np.column_stack([alike, waves]))

    def inside(pattern):
        amplitude = np.einsum("nk,nam->kam", pattern, full[3:])
        return (mass[3, :, None] * np.abs(amplitude) ** 2).sum(axis=(0, 1))

    rotational = energy[:3, 2].sum(axis=0) + inside(alike)
    translational = energy[:3, :2].sum(axis=(0, 1)) + inside(waves)
    planet = energy[3:].sum(axis=(0, 1)) - inside(both)
    return np.array([rotational, translational, planet]) / energy.sum(axis=(0, 1))


def _orthonormal(patterns: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the patterns over the planets; two opposite planets know one wave only."""
    left, size, _ = np.linalg.svd(patterns, full_matrices=False)
    return left[:, size > 1e-9 * size[0]]


def _motion(data: PlanarSet, shape) -> tuple[np.ndarray, np.ndarray]:
    """Motions (N + 3, 3, m) and masses (N + 3, 3) of all bodies, held ones included."""
    T, shape = free_motions(data), np.asarray(shape)
    if shape.ndim != 2 or len(shape) != T.shape[1]:
        raise CaseError(
            f"mode shapes of shape {shape.shape}", code="E-SHAPE", limit=f"({T.shape[1]}, modes)"
        )  # fmt: skip
    return (T @ shape).reshape(data.n_planets + 3, 3, -1), body_masses(data)
