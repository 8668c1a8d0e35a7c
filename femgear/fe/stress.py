"""Static displacement of whole cyclic bodies, and tangential stress along boundaries that carry no load.

The displacement of all sectors follows from one of them (`cyclic_displacement`). The stress is a linear
functional of nodal displacements: on a free boundary the normal and the shear stress vanish, so that the
tangential stress is ``E' eps_t`` with ``E' = E`` in plane stress and ``E / (1 - nu^2)`` in plane strain
(Timoshenko and Goodier, "Theory of Elasticity", 3rd ed., section 16). The tangential strain ``eps_t = t .
du/ds`` is that of the boundary edges. Along a six-node edge the derivative of the displacement is one order
more accurate at the two Gauss points than elsewhere (Barlow, "Optimal stress locations in finite element
models", Int. J. Numer. Meth. Eng. 10, 1976); values at the vertices are interpolated from those by a cubic
over the arc length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import GridError
from femgear.fe.compliance import cut_rotation, split_sector, symmetric_factor
from femgear.fe.grid import boundary_edges

if TYPE_CHECKING:
    from femgear.fe.elasticity import Material
    from femgear.fe.grid import Grid

# abscissae of the two-point Gauss rule on -1 .. 1
GAUSS = 1.0 / np.sqrt(3.0)


@dataclass(frozen=True)
class BoundaryStress:
    """Functionals of the tangential stress at the vertices of a boundary.

    Parameters
    ----------
    columns : (2 n, m) array
        ``columns.T @ u`` are the stresses [Pa], positive in tension, of nodal displacements ``u`` [m] with
        degrees of freedom ``2 node + component``.
    nodes : (m,) int array
        Vertices in the order of the boundary.
    points : (m, 2) array
        Their positions [m].
    tangents : (m, 2) array
        Unit tangents in the direction of the boundary.
    arc : (m,) array
        Arc length from the first vertex [m].
    """

    columns: np.ndarray
    nodes: np.ndarray
    points: np.ndarray
    tangents: np.ndarray
    arc: np.ndarray


def tangential_stress(grid: Grid, material: Material, boundary, *, state: str) -> BoundaryStress:
    """Functionals of the tangential stress along one free boundary or several consecutive ones.

    Parameters
    ----------
    grid : Grid
    material : Material
    boundary : str or tuple of str
        Names of boundaries, each beginning where the one before ends.
    state : str
        ``"plane strain"`` or ``"plane stress"``.

    Returns
    -------
    BoundaryStress

    Raises
    ------
    GridError
        When there is no such boundary, the boundaries are not one open chain, or they have less than two
        edges; when the state is unknown.
    """
    edges = _chain(grid, (boundary,) if isinstance(boundary, str) else tuple(boundary))
    weights, gauss, arc = _edge_strain(grid, edges)
    nodes = np.append(edges[:, 0], edges[-1, 1])
    columns = plane_modulus(material, state) * (weights @ _cubic(gauss, arc).T)
    # end tangents of a quadratic edge with nodes a, m, b: -3a + 4m - b and a - 4m + 3b
    a, b, m = np.moveaxis(grid.points[edges], 1, 0)
    start, end = 4.0 * m - 3.0 * a - b, a - 4.0 * m + 3.0 * b
    tangents = np.vstack([start[:1], 0.5 * (end[:-1] + start[1:]), end[-1:]])
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    return BoundaryStress(columns, nodes, grid.points[nodes], tangents, arc)


def plane_modulus(material: Material, state: str) -> float:
    """Stress over strain along a free edge [Pa]: ``E`` in plane stress, ``E/(1 - nu^2)`` in plane strain."""
    lam, mu = material.lame(state)
    return 4.0 * mu * (lam + mu) / (lam + 2.0 * mu)


def cyclic_displacement(grid, stiffness, loads, *, held) -> np.ndarray:
    """Static displacement of every sector in its own frame.

    The loads are transformed over the sectors, each harmonic is solved on the sector with its cuts tied
    (see `femgear.fe.compliance`), and the solutions are transformed back.

    Parameters
    ----------
    grid : Grid
        Sector with boundaries ``cut_left``, ``cut_right`` and `held`.
    stiffness : (2n, 2n) sparse matrix
        [N/m].
    loads : (count, 2n) array
        Nodal forces of each sector in its own frame [N].
    held : str or None
        Boundary that cannot move.

    Returns
    -------
    (count, n, 2) array
        [m].
    """
    count, size = loads.shape
    inner, right, left = split_sector(grid, held)
    cut = np.concatenate([right, left])
    stiffness = stiffness.tocsc()
    K_ib = stiffness[inner][:, cut].toarray()
    harmonics = np.fft.rfft(loads, axis=0)
    n_h, nb = len(harmonics), len(right)
    forces = harmonics[:, inner].T
    solved = symmetric_factor(stiffness[inner][:, inner]).solve(np.hstack([K_ib, forces.real, forces.imag]))
    X_b, X_f = solved[:, : 2 * nb], solved[:, 2 * nb : 2 * nb + n_h] + 1j * solved[:, 2 * nb + n_h :]
    S = stiffness[cut][:, cut].toarray() - K_ib.T @ X_b
    on_cut = harmonics[:, cut] - (K_ib.T @ X_f).T
    tie = np.empty((n_h, 2 * nb, nb), complex)
    tie[:, :nb] = np.eye(nb)
    phase = np.exp(2j * np.pi * np.arange(n_h) / count)
    tie[:, nb:] = phase[:, None, None] * cut_rotation(count, nb)
    adjoint = tie.conj().transpose(0, 2, 1)
    u_right = np.linalg.solve(adjoint @ S @ tie, (adjoint @ on_cut[:, :, None]))
    u_cut = (tie @ u_right)[:, :, 0]
    field = np.zeros((n_h, size), complex)
    field[:, inner] = (X_f - X_b @ u_cut.T).T
    field[:, cut] = u_cut
    return np.fft.irfft(field, n=count, axis=0).reshape(count, -1, 2)


def _chain(grid: Grid, names) -> np.ndarray:
    """Edges of consecutive boundaries (k, 3): start, end, mid."""
    edges = np.vstack([boundary_edges(grid, name) for name in names])
    if len(edges) < 2 or np.any(edges[1:, 0] != edges[:-1, 1]):
        raise GridError(
            f"the boundaries {', '.join(names)} are not one chain of at least two edges",
            code="E-GRID-BOUNDARY",
            key=names[0],
            remedy="name them in the order in which the body lies to their left",
        )
    return edges


def _edge_strain(grid: Grid, edges):
    """Tangential strain at the Gauss points: columns (2n, 2k), arc lengths (2k,), of the vertices (k+1,)."""
    s = np.array([-GAUSS, GAUSS])
    slope = np.array([s - 0.5, s + 0.5, -2.0 * s])  # of the shape functions of start, end, mid
    derivative = np.einsum("iq,kic->kqc", slope, grid.points[edges])
    speed2 = (derivative**2).sum(axis=2)
    # eps = x' . u' / |x'|^2
    factor = np.einsum("iq,kqc->kqic", slope, derivative / speed2[..., None])
    k = len(edges)
    columns = np.zeros((2 * grid.n_nodes, 2 * k))
    dofs = np.broadcast_to((2 * edges[..., None] + np.array([0, 1]))[:, None], (k, 2, 3, 2))
    np.add.at(columns, (dofs.ravel(), np.repeat(np.arange(2 * k), 6)), factor.ravel())
    t, w = np.polynomial.legendre.leggauss(6)
    vertex = np.concatenate([[0.0], np.cumsum(_length(grid.points[edges], t, w))])
    half = 0.5 * (s[:, None] + 1.0)
    part = [_length(grid.points[edges], -1.0 + h * (t + 1.0), h * w) for h in half]
    return columns, (vertex[:-1, None] + np.stack(part, axis=1)).ravel(), vertex


def _length(nodes, t, w):
    slope = np.array([t - 0.5, t + 0.5, -2.0 * t])
    derivative = np.einsum("iq,kic->kqc", slope, nodes)
    return np.hypot(derivative[..., 0], derivative[..., 1]) @ w


def _cubic(known, wanted) -> np.ndarray:
    """Weights (wanted, known) of the cubic through the four known abscissae nearest to each wanted one."""
    first = np.clip(np.searchsorted(known, wanted) - 2, 0, len(known) - 4)
    index = first[:, None] + np.arange(4)
    x = known[index]
    weight = np.ones_like(x)
    for i in range(4):
        for j in range(4):
            if i != j:
                weight[:, i] *= (wanted - x[:, j]) / (x[:, i] - x[:, j])
    result = np.zeros((len(wanted), len(known)))
    np.put_along_axis(result, index, weight, axis=1)
    return result
