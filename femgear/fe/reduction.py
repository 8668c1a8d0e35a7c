"""Modes of a cyclic body from one sector: Craig-Bampton on the sector, one small problem a nodal diameter.

The symmetric and the antisymmetric fields of the sector are condensed on its cut (Craig and Bampton, AIAA J.
6, 1968) with the static shape of the loads, and with the static answer to the inertia forces of both, the
next term of a series in omega^2 (Craig and Hale, "Block-Krylov component synthesis method for structural
model reduction", J. Guid. Control Dyn. 11, 1988): closer than as many fixed-interface modes. The cut, along
which displacements are smooth, may be left a few shapes instead of all its nodes (Castanier, Tan and Pierre,
AIAA J. 39, 2001): where static ones are among them the static response is exact. The cyclic tie of `n` nodal
diameters (Thomas 1979) leaves one real vector for both kinds of fields, see `femgear.fe.compliance`, and so a
real symmetric eigenproblem for each `n`, whose nodal diameter is known by construction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from femgear.fe.compliance import CondensedHalfSector, boundary_nodes, check_loads, cut_ties, half_sectors
from femgear.fe.grid import Grid

_CUT_DEGREE = 8
"""Of the polynomials along a cut."""
_DEPENDENT = 1e-5
"""Share of a field of its own below which it is a combination of others."""
_STATIC = 1e-6
"""Share of a static shape of the cut below which nothing is added for it."""


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
        Number of nodal diameters of every mode.
    frequency : (m,) array
        [Hz]; the last one of each nodal diameter is a static shape rather than a mode.
    load : (m, n_loads) complex array
        Displacement of each load functional, ``f^T U``.
    output : (m, n_outputs) complex array
        What the output functionals observe of every mode, as ``load``.
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
        """Factor (m,) of every mode that makes its coordinates have unit modal mass."""
        return np.sqrt(np.where(self.paired, 2.0, 1.0) / self.count)

    @property
    def paired(self) -> np.ndarray:
        """Whether modes (m,) have a cosine and a sine coordinate."""
        return (self.nodal_diameter != 0) & (2 * self.nodal_diameter != self.count)


@dataclass(frozen=True)
class _SectorBasis:
    """Craig-Bampton basis of one of ``count`` sectors, its matrices in pairs: of symmetric and of antisymmetric fields.

    The coordinates are the nb shapes of the ``cut``, radial and tangential in turn, then the nv of the interior.
    ``stiffness`` [N/m] and ``mass`` [kg] are (nb + nv, nb + nv), ``vectors`` (2n, nb + nv) the nodal displacements.
    """

    count: int
    cut: int
    stiffness: tuple[np.ndarray, np.ndarray]
    mass: tuple[np.ndarray, np.ndarray]
    vectors: tuple[np.ndarray, np.ndarray]

    def tied(self, n: int) -> list[tuple[slice, np.ndarray]]:
        """For both kinds: where ``eta`` stands behind ``w``, and the factors of ``(w, eta)`` in the basis."""
        ties, places, first = cut_ties(n, self.count, self.cut), [], self.cut
        for tie, per_tie in zip(ties, self.stiffness, strict=True):
            more = len(per_tie) - self.cut
            places.append((slice(first, first + more), np.append(tie, np.ones(more))))
            first += more
        return places


def smooth_cut_shapes(grid: Grid, static: np.ndarray) -> np.ndarray:
    """Find shapes (nb / 2, k) of the cut, orthogonal to one another: polynomials, and what spans static ones.

    Parameters
    ----------
    grid : Grid
        Sector with the boundary ``cut_left``, none of it held.
    static : (nb / 2, m) array
        See `femgear.fe.compliance.static_cut_shapes`.
    """
    smooth = _polynomials(grid, _CUT_DEGREE + 1)
    length = np.linalg.norm(static, axis=0)
    unit = static[:, length > 1e-12 * length.max()] / length[length > 1e-12 * length.max()]
    # twice: what the first time leaves of the polynomials is of the size of rounding
    for _ in range(2):
        unit = unit - smooth @ (smooth.T @ unit)
    shapes, size, _ = np.linalg.svd(unit, full_matrices=False)
    return np.hstack([smooth, shapes[:, size > _STATIC]])


def _polynomials(grid: Grid, count: int) -> np.ndarray:
    """The first polynomials over the nodes of the cut by radius, orthonormal, (nb / 2, count or fewer)."""
    radius = np.sort(np.hypot(*grid.points[boundary_nodes(grid, "cut_left")].T))
    place = 2.0 * (radius - radius[0]) / (radius[-1] - radius[0]) - 1.0
    return np.linalg.qr(np.polynomial.legendre.legvander(place, min(count, len(radius)) - 1))[0]


def sector_basis(
    grid: Grid,
    stiffness,
    mass,
    *,
    count: int,
    loads: np.ndarray,
    interior_shapes: int = 6,
    cut_shapes: np.ndarray | None = None,
) -> _SectorBasis:
    """Reduce one sector to its cut, the static load shapes and what the inertia of both moves inside.

    Parameters
    ----------
    grid : Grid
        Mirror-symmetric sector with boundaries ``cut_left`` and ``cut_right``.
    stiffness, mass : (2n, 2n) sparse matrices
        [N/m], [kg]; a foundation, if any, is part of `stiffness`.
    count : int
        Number of sectors.
    loads : (2n, m) array
        Load functionals; they must not act on the cuts.
    interior_shapes : int
        Polynomials along the cut with whose inertia the interior moves, radially and tangentially.
    cut_shapes : (nb / 2, k) array, optional
        Shapes over the nodes of the cut by radius that its radial and its tangential displacement may have,
        see `smooth_cut_shapes`; any by default.
    """
    check_loads(loads, np.concatenate([boundary_nodes(grid, f"cut_{side}") for side in ("right", "left")]))
    shapes = np.eye(len(boundary_nodes(grid, "cut_left"))) if cut_shapes is None else cut_shapes
    moving = np.kron(shapes.T @ _polynomials(grid, interior_shapes), np.eye(2))
    parts = [
        _reduced(sector, mass, sector.fields.T @ loads, np.kron(shapes, np.eye(2)), moving)
        for sector in half_sectors(grid, stiffness, None)
    ]
    K, M, vectors, cut = zip(*parts, strict=True)
    return _SectorBasis(count=count, cut=cut[0], stiffness=K, mass=M, vectors=vectors)


def _reduced(sector: CondensedHalfSector, mass, loads: np.ndarray, shapes: np.ndarray, moving: np.ndarray):
    """Reduced stiffness and mass of the fields of one kind, their basis, and the number of `shapes`.

    ``moving`` (shapes, k) are the motions of the cut with whose inertia the interior moves.
    """
    inner = sector.inner
    M = (sector.fields.T @ mass @ sector.fields).tocsc()
    constraint, schur = sector.on_cut(shapes)
    static = sector.held(loads[:inner])
    slow = np.hstack([np.vstack([constraint, shapes]) @ moving, np.pad(static, ((0, len(shapes)), (0, 0)))])
    fields = np.hstack([static, sector.held((M @ slow)[:inner])])
    length = np.linalg.norm(fields, axis=0)
    # a load may have no part of this kind
    fields, left = np.linalg.qr(fields / np.where(length > 0.0, length, 1.0))
    interior = fields[:, np.abs(left.diagonal()) > _DEPENDENT]
    nb, nv = len(schur), interior.shape[1]
    basis = np.zeros((inner + len(shapes), nb + nv))
    basis[:inner] = np.hstack([constraint, interior])
    basis[inner:, :nb] = shapes
    K = np.zeros((nb + nv, nb + nv))
    K[:nb, :nb], K[nb:, nb:] = schur, interior.T @ (sector.interior @ interior)
    reduced = basis.T @ (M @ basis)
    return K, 0.5 * (reduced + reduced.T), sector.fields @ basis, nb


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
    on_basis = [vectors.T @ loads for vectors in basis.vectors]
    of_diameters = [_one_diameter(basis, int(n), on_basis, max_frequency, static_correction) for n in nodal_diameters]
    reduced, recovery = np.hstack([vectors for _, vectors in of_diameters]), np.hstack(basis.vectors)
    return CyclicModes(
        count=basis.count,
        nodal_diameter=np.concatenate([np.full(len(f), n) for (f, _), n in zip(of_diameters, nodal_diameters)]),
        frequency=np.concatenate([f for f, _ in of_diameters]),
        load=reduced.T @ np.concatenate(on_basis),
        output=reduced.T @ (recovery.T @ outputs),
        reduced=reduced,
        recovery=recovery,
    )


def _one_diameter(basis: _SectorBasis, n, loads, max_frequency, static_correction):
    """Frequencies (m,) [Hz] and shapes (k, m) in the basis of all modes with n nodal diameters."""
    nb, places = basis.cut, basis.tied(n)
    size = places[-1][0].stop
    K, M = np.zeros((2, size, size))
    # antisymmetric fields lag by a quarter of a turn; where no turn is seen both are real
    lags = (1.0, 1.0 if n == 0 or 2 * n == basis.count else 1j)
    force = np.zeros((size, loads[0].shape[1]), complex)
    for (modal, tie), stiffness, mass, load, lag in zip(places, basis.stiffness, basis.mass, loads, lags, strict=True):
        at = np.r_[:nb, modal]
        K[np.ix_(at, at)] += tie[:, None] * stiffness * tie
        M[np.ix_(at, at)] += tie[:, None] * mass * tie
        force[at] += np.conj(lag) * tie[:, None] * load
    # the largest 1 / (omega^2 + shift): the lowest omega^2 keep their digits, and a free body is no exception
    top, shift = (2 * np.pi * max_frequency) ** 2, basis.stiffness[0][nb, nb] / basis.mass[0][nb, nb]
    values, chosen = eigh(M, K + shift * M, subset_by_value=(1.0 / (top + shift), np.inf))
    if not len(values):
        values, chosen = eigh(M, K + shift * M, subset_by_index=(size - 1, size - 1))
    chosen = (chosen / np.sqrt(values))[:, ::-1]
    omega2 = np.maximum(1.0 / values[::-1] - shift, 0.0)
    if static_correction and len(values) < size:
        # static response of the modes left out, made orthogonal and of unit mass like a mode
        kept = M @ chosen
        rest = cho_solve(cho_factor(K + shift * kept @ kept.T), force)
        rest = rest - chosen @ (kept.T @ rest)
        extra_values, extra = eigh(rest.conj().T @ force, rest.conj().T @ M @ rest)
        chosen = np.hstack([chosen, rest @ extra])
        omega2 = np.concatenate([omega2, extra_values])
    # signs are the library's choice: the largest entry, the first of those equal to a millionth, is positive
    size = np.abs(chosen)
    largest = np.argmax(size >= (1.0 - 1e-6) * size.max(axis=0), axis=0)
    chosen = chosen * np.sign(chosen[largest, np.arange(chosen.shape[1])])
    shapes = np.concatenate(
        [lag * tie[:, None] * chosen[np.r_[:nb, modal]] for (modal, tie), lag in zip(places, lags, strict=True)]
    )
    return np.sqrt(omega2) / (2 * np.pi), shapes
