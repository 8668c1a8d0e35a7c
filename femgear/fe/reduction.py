"""Modes of a cyclic body from one sector: Craig-Bampton on the sector, one small problem a nodal diameter.

The sector is condensed on its two cuts (Craig and Bampton, AIAA J. 6, 1968) with fixed-interface modes and
the static shape of the loads; the cyclic tie ``u_L = e^{i n a} Q u_R`` then gives a Hermitian eigenproblem
for each number ``n`` of nodal diameters (Thomas 1979), whose nodal diameter is known by construction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from femgear.fe.compliance import cut_rotation, solve_interior, split_sector
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
class _SectorBasis:
    """Craig-Bampton basis ``u = vectors @ (u_cut, eta)`` of one of ``count`` sectors, and its matrices."""

    count: int
    stiffness_cut: np.ndarray  # (2 nb, 2 nb) [N/m], right cut first
    stiffness_interior: np.ndarray  # (nv, nv)
    mass: np.ndarray  # (2 nb + nv, 2 nb + nv)
    vectors: np.ndarray  # (2n, 2 nb + nv)


def sector_basis(
    grid: Grid, stiffness, mass, *, count: int, loads: np.ndarray, interior_modes: int = 16
) -> _SectorBasis:
    """Reduce one sector to its cuts, `interior_modes` fixed-interface modes and the static load shapes.

    Parameters
    ----------
    grid : Grid
        Sector with boundaries ``cut_left`` and ``cut_right``.
    stiffness, mass : (2n, 2n) sparse matrices
        [N/m], [kg]; a foundation, if any, is part of `stiffness`.
    count : int
        Number of sectors.
    loads : (2n, m) array
        Load functionals; they must not act on the cuts.
    """
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
    vectors = np.hstack([full_c, full_i])
    reduced_mass = vectors.T @ (mass @ vectors)
    return _SectorBasis(
        count=count,
        stiffness_cut=solution.schur,
        stiffness_interior=interior.T @ (K_ii @ interior),
        mass=0.5 * (reduced_mass + reduced_mass.T),
        vectors=vectors,
    )


def cyclic_modes(
    basis: _SectorBasis, *, nodal_diameters, loads, outputs, max_frequency, static_correction=True
) -> CyclicModes:
    """Compute the modes up to a frequency for each nodal diameter, and the static shape of the loads.

    Parameters
    ----------
    basis : as of `sector_basis`
    nodal_diameters : iterable of int
    loads, outputs : (2n, m) arrays
        Functionals of the sector's nodal displacements.
    max_frequency : float
        [Hz]; at least one mode is kept for each nodal diameter.
    static_correction : bool
        Append the part of the static response to the loads that the kept modes miss.
    """
    on_basis = basis.vectors.T @ loads
    found = [
        _one_diameter(basis, int(n), on_basis, max_frequency, static_correction) for n in nodal_diameters
    ]
    reduced = np.hstack([vectors for _, vectors in found])
    return CyclicModes(
        count=basis.count,
        nodal_diameter=np.concatenate([np.full(len(f), n) for (f, _), n in zip(found, nodal_diameters)]),
        frequency=np.concatenate([f for f, _ in found]),
        load=reduced.T @ on_basis,
        output=reduced.T @ (basis.vectors.T @ outputs),
        reduced=reduced,
        recovery=basis.vectors,
    )


def _one_diameter(basis: _SectorBasis, n, loads, max_frequency, static_correction):
    """Frequencies (m,) [Hz] and shapes (k, m) in the basis of all modes with n nodal diameters."""
    count, nb, nv = basis.count, len(basis.stiffness_cut) // 2, len(basis.stiffness_interior)
    phase = np.exp(2j * np.pi * n / count)
    tie = np.vstack([np.eye(nb), phase * cut_rotation(count, nb)])
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
