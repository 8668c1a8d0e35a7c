"""Modes of a cyclic body from one sector: Craig-Bampton on the sector, one small problem a nodal diameter.

The sector is condensed on its two cuts (Craig and Bampton, AIAA J. 6, 1968) with fixed-interface modes and
the static shape of the loads; the cyclic tie ``u_L = e^{i n a} Q u_R`` then gives a Hermitian eigenproblem
for each number ``n`` of nodal diameters (Thomas 1979), whose nodal diameter is known by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.fe.compliance import cut_rotation, solve_interior, split_sector

if TYPE_CHECKING:
    from femgear.fe.grid import Grid


@dataclass(frozen=True)
class CyclicModes:
    """Mass-normalised modes of a cyclic body, ordered by nodal diameter, then frequency.

    The displacement of sector ``k`` in its own frame, for a mode with ``n`` nodal diameters and coordinates
    ``(c, s)``, is ``norm * [c Re(U e^{i n a k}) + s Im(U e^{i n a k})]`` with ``norm = sqrt(2 / count)``;
    for ``n = 0`` (and ``count / 2``) there is only ``c`` and ``norm = sqrt(1 / count)``.

    Parameters
    ----------
    count : int
        Number of sectors.
    nodal_diameter : (m,) int array
    frequency : (m,) array
        [Hz]; the last one of each nodal diameter is a static shape rather than a mode.
    load : (m, n_loads) complex array
        Displacement of each load functional, ``f^T U``.
    output : (m, n_outputs) complex array
    reduced : (k, m) complex array
        ``U`` in the basis of the sector.
    recovery : (2 n_nodes, k) array
        Basis of the sector.
    """

    count: int
    nodal_diameter: np.ndarray
    frequency: np.ndarray
    load: np.ndarray
    output: np.ndarray
    reduced: np.ndarray
    recovery: np.ndarray

    @property
    def shape(self) -> np.ndarray:
        """``U`` at all nodes of the sector, shape (2 n_nodes, m), complex."""
        return self.recovery @ self.reduced

    @property
    def norm(self) -> np.ndarray:
        """Factor of every mode that makes its coordinates have unit modal mass."""
        return np.sqrt(np.where(self.paired, 2.0, 1.0) / self.count)

    @property
    def paired(self) -> np.ndarray:
        """Whether a mode has a cosine and a sine coordinate."""
        return (self.nodal_diameter != 0) & (2 * self.nodal_diameter != self.count)


@dataclass(frozen=True)
class SectorBasis:
    """Craig-Bampton basis of one sector: ``u = constraint @ u_cut + interior @ eta``."""

    stiffness_cut: np.ndarray
    stiffness_interior: np.ndarray
    mass: np.ndarray
    constraint: np.ndarray
    interior: np.ndarray
    rotation: np.ndarray


def sector_basis(
    grid: Grid, stiffness, mass, *, count: int, loads: np.ndarray, interior_modes: int = 16
) -> SectorBasis:
    """Reduce one sector to its cuts, `interior_modes` fixed-interface modes and the static load shapes.

    Parameters
    ----------
    grid : Grid
        Sector with boundaries ``cut_left`` and ``cut_right``.
    stiffness, mass : (2n, 2n) sparse matrices
        A foundation, if any, is part of `stiffness`.
    count : int
    loads : (2n, m) array
        Load functionals; they must not act on the cuts.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh

    inner, right, left = parts = split_sector(grid, None)
    cut = np.concatenate([right, left])
    stiffness, mass = stiffness.tocsc(), mass.tocsc()
    K_ii, M_ii = stiffness[inner][:, inner], mass[inner][:, inner]
    solution = solve_interior(grid, stiffness, parts, loads)
    constraint, static = -solution.cut, solution.loads
    # the types that scipy's constructor shows are those of a subclass
    inverse = LinearOperator(K_ii.shape, matvec=solution.factor.solve, dtype=float)  # type: ignore[call-arg]
    start = np.cos(np.arange(len(inner)) + 1.0)
    _, modes = eigsh(K_ii, k=interior_modes, M=M_ii, sigma=0.0, OPinv=inverse, v0=start)
    static = static - modes @ (modes.T @ (M_ii @ static))
    static /= np.sqrt(np.einsum("ij,ij->j", static, M_ii @ static))
    interior = np.hstack([modes, static])
    full_c = np.zeros((stiffness.shape[0], len(cut)))
    full_c[inner], full_c[cut] = constraint, np.eye(len(cut))
    full_i = np.zeros((stiffness.shape[0], interior.shape[1]))
    full_i[inner] = interior
    basis = np.hstack([full_c, full_i])
    reduced_mass = basis.T @ (mass @ basis)
    return SectorBasis(
        stiffness_cut=solution.schur,
        stiffness_interior=interior.T @ (K_ii @ interior),
        mass=0.5 * (reduced_mass + reduced_mass.T),
        constraint=full_c,
        interior=full_i,
        rotation=cut_rotation(count, len(right)),
    )


def cyclic_modes(
    basis: SectorBasis, *, count, nodal_diameters, loads, outputs, max_frequency, static_correction=True
) -> CyclicModes:
    """Modes up to `max_frequency` [Hz] for each nodal diameter, with the static shape of the loads appended.

    Parameters
    ----------
    basis : SectorBasis
    count : int
    nodal_diameters : iterable of int
    loads, outputs : (2n, m) arrays
        Functionals of the sector's nodal displacements.
    max_frequency : float
        [Hz]; at least one mode is kept for each nodal diameter.
    static_correction : bool
        Append the part of the static response to the loads that the kept modes miss.
    """
    recovery = np.hstack([basis.constraint, basis.interior])
    on_basis = recovery.T @ loads
    found = [
        _one_diameter(basis, count, int(n), on_basis, max_frequency, static_correction)
        for n in nodal_diameters
    ]
    reduced = np.hstack([vectors for _, vectors in found])
    return CyclicModes(
        count=count,
        nodal_diameter=np.concatenate([np.full(len(f), n) for (f, _), n in zip(found, nodal_diameters)]),
        frequency=np.concatenate([f for f, _ in found]),
        load=reduced.T @ on_basis,
        output=reduced.T @ (recovery.T @ outputs),
        reduced=reduced,
        recovery=recovery,
    )


def _one_diameter(basis: SectorBasis, count, n, loads, max_frequency, static_correction):
    from scipy.linalg import eigh

    nb, nv = len(basis.rotation), basis.interior.shape[1]
    phase = np.exp(2j * np.pi * n / count)
    tie = np.vstack([np.eye(nb), phase * basis.rotation])
    K = np.zeros((nb + nv, nb + nv), complex)
    K[:nb, :nb] = tie.conj().T @ basis.stiffness_cut @ tie
    K[nb:, nb:] = basis.stiffness_interior
    T = np.zeros((2 * nb + nv, nb + nv), complex)
    T[: 2 * nb, :nb], T[2 * nb :, nb:] = tie, np.eye(nv)
    M = T.conj().T @ basis.mass @ T
    if n == 0 or 2 * n == count:
        K, M, T = np.real(K), np.real(M), np.real(T)
    values, vectors = eigh(K, M)
    kept = max(int(np.searchsorted(values, (2 * np.pi * max_frequency) ** 2)), 1)
    chosen = vectors[:, :kept]
    omega2 = np.maximum(values[:kept], 0.0)
    if static_correction and kept < len(values):
        # static response of the modes left out, made orthogonal and of unit mass like a mode
        force = T.conj().T @ loads
        rest = vectors[:, kept:] @ ((vectors[:, kept:].conj().T @ force) / values[kept:, None])
        small_M = rest.conj().T @ M @ rest
        small_K = rest.conj().T @ K @ rest
        extra_values, extra = eigh(small_K, small_M)
        chosen = np.hstack([chosen, rest @ extra])
        omega2 = np.concatenate([omega2, extra_values])
    return np.sqrt(omega2) / (2 * np.pi), T @ chosen
