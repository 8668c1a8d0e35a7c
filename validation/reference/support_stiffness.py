"""Support stiffness K = F/X of a plane body: a boundary rigidly coupled to a centre node, another one held.

Whole bodies take any displacement of the centre node; a cyclic body of which only one sector is meshed
takes a translation, which is its first harmonic (see `femgear.fe.compliance`).
"""

from __future__ import annotations

import numpy as np

from femgear.errors import GeometryError, GridError
from femgear.fe.compliance import boundary_nodes, node_dofs, symmetric_factor
from validation.reference.plane_elasticity import rank_check
from validation.reference.substructure import cut_rotation


def annulus_support_stiffness(inner: float, outer: float, material, *, state: str, thickness: float) -> float:
    """Radial stiffness of an annulus with a rigid core, its outer surface held [N/m].

    ``K = 2 pi mu (1 + kappa) b / [kappa ln(ro/ri) - (ro^2 - ri^2) / (kappa (ro^2 + ri^2))]``, kappa =
    3 - 4 nu in plane strain and (3 - nu)/(1 + nu) in plane stress. From the potentials
    ``phi = A ln z + B z^2``, ``psi = -kappa A ln z + C + D z^-2`` of N. I. Muskhelishvili (Some Basic
    Problems of the Mathematical Theory of Elasticity, section 59) with both circles rigid; kappa = 1 is the
    long rubber bush of J. E. Adkins and A. N. Gent, Br. J. Appl. Phys. 5 (1954) 354-358.

    Parameters
    ----------
    inner, outer : float
        Radii [m].
    material : Material
    state : str
        ``"plane stress"`` or ``"plane strain"``.
    thickness : float
        [m]

    Raises
    ------
    GeometryError
        Radii that are not in order.
    """
    if not 0 < inner < outer < np.inf:
        raise GeometryError(
            f"an annulus cannot have radii {inner} and {outer} m", code="E-ANNULUS", limit="0 < inner < outer"
        )
    lam, mu = material.lame(state)
    kappa = (lam + 3 * mu) / (lam + mu)
    squares = (outer**2 - inner**2) / (outer**2 + inner**2)
    return float(2 * np.pi * mu * (1 + kappa) * thickness / (kappa * np.log(outer / inner) - squares / kappa))


def centre_node_stiffness(grid, stiffness, moved, held=()) -> np.ndarray:
    """Stiffness of a centre node at the origin to which boundaries of a whole body are rigidly coupled.

    Parameters
    ----------
    grid : Grid
    stiffness : (2n, 2n) sparse matrix
        Foundations included [N/m].
    moved, held : sequence of str
        Boundaries that move with the centre node, and that cannot move.

    Returns
    -------
    (3, 3) array
        Forces x, y [N] and moment [N m] per unit x, y [m] and rotation [rad].

    Raises
    ------
    GridError
        A boundary that is moved and held, or a body that nothing holds.
    """
    on, fixed = _boundaries(grid, moved, held)
    rank_check(grid, node_dofs(np.concatenate([on, fixed])))
    prescribed = np.zeros((2 * grid.n_nodes, 3))
    prescribed[2 * on, 0] = prescribed[2 * on + 1, 1] = 1.0
    prescribed[2 * on, 2], prescribed[2 * on + 1, 2] = -grid.points[on, 1], grid.points[on, 0]
    free = np.ones(2 * grid.n_nodes, bool)
    free[node_dofs(np.concatenate([on, fixed]))] = False
    K = stiffness.tocsc()
    u = prescribed.copy()
    u[free] = -symmetric_factor(K[free][:, free]).solve((K @ prescribed)[free])
    result = prescribed.T @ (K @ u)
    _check_stiff(np.diag(result)[:2].min(), K)
    return 0.5 * (result + result.T)


def cyclic_support_stiffness(grid, stiffness, count: int, moved, held=()) -> float:
    """Radial stiffness of a cyclic body from one sector [N/m], equal in all directions.

    A translation along x is ``Re (1, i) e^(i k a)`` in the frame of sector k, so that one complex
    solution of the sector with ``u_left = e^(i a) Q u_right`` gives ``K = (count/2) U^H K U``.

    Parameters
    ----------
    grid : Grid
        Sector with the boundaries ``cut_right`` and ``cut_left``.
    stiffness : (2n, 2n) sparse matrix
        Of the sector, foundations included [N/m].
    count : int
        Number of sectors, 3 or more.
    moved, held : sequence of str
        Boundaries that move with the centre node, and that cannot move.

    Raises
    ------
    GridError
        Fewer than three sectors, a boundary that is moved and held, cuts that do not match.
    """
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    if count < 3:
        raise GridError(f"{count} sectors", code="E-GRID", limit="3 or more")
    on, fixed = _boundaries(grid, moved, held)
    taken = np.concatenate([on, fixed])
    cuts = []
    for name in ("cut_right", "cut_left"):
        nodes = np.setdiff1d(boundary_nodes(grid, name), taken)
        cuts.append(node_dofs(nodes[np.argsort(np.hypot(*grid.points[nodes].T))]))
    right, left = cuts
    if len(right) != len(left):
        raise GridError("the two cuts of a sector do not match", code="E-GRID")
    inner = np.setdiff1d(np.arange(2 * grid.n_nodes), np.concatenate([node_dofs(taken), left]))
    place = np.full(2 * grid.n_nodes, -1)
    place[inner] = np.arange(len(inner))
    tie = np.exp(2j * np.pi / count) * cut_rotation(count, len(right))
    row, column = np.nonzero(tie)
    rows, columns = np.concatenate([inner, left[row]]), np.concatenate([place[inner], place[right][column]])
    values = np.concatenate([np.ones(len(inner)), tie[row, column]])
    basis = csc_array((values, (rows, columns)), shape=(2 * grid.n_nodes, len(inner)))
    prescribed = np.zeros(2 * grid.n_nodes, complex)
    prescribed[2 * on], prescribed[2 * on + 1] = 1.0, 1.0j
    K = stiffness.tocsc()
    back = basis.conj().T
    solved = splu((back @ K @ basis).tocsc()).solve(back @ (K @ prescribed))
    u = prescribed - basis @ solved
    result = 0.5 * count * float((u.conj() @ (K @ u)).real)
    _check_stiff(result, K)
    return result


def _check_stiff(value, K):
    """A body that nothing holds follows the centre node: its stiffness is then rounding."""
    if not value > 1e-10 * float(abs(K).max()):
        raise GridError(
            "nothing holds the body", code="E-GRID-FREE", remedy="hold a boundary or put it on a foundation"
        )


def _boundaries(grid, moved, held):
    """Nodes of the boundaries; the same node cannot be moved and held."""
    on = np.unique(np.concatenate([boundary_nodes(grid, name) for name in moved]))
    fixed = [boundary_nodes(grid, name) for name in held]
    fixed = np.unique(np.concatenate(fixed)) if fixed else np.zeros(0, int)
    if len(np.intersect1d(on, fixed)):
        raise GridError(
            "a boundary cannot be coupled to the centre node and held",
            code="E-GRID",
            limit="boundaries without common nodes",
        )
    return on, fixed
