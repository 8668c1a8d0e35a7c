"""Plane elastostatics with the matrices of `femgear.fe.elasticity`: loads, checked solutions, stresses.

The sparse solver checks neither supports before a solve nor equilibrium and energy after it: `checked_solve`
does.
"""

from __future__ import annotations

import numpy as np

from femgear.errors import FemgearError, GridError
from femgear.fe.compliance import symmetric_factor
from femgear.fe.elasticity import Material, edge_quadrature
from femgear.fe.grid import Grid, jacobian_bounds


def to_skfem(grid: Grid):
    """The grid as a scikit-fem ``MeshTri2``, elements in the same order, names kept."""
    from skfem import MeshTri2

    mesh = MeshTri2(np.ascontiguousarray(grid.points.T), np.ascontiguousarray(grid.triangles.T))
    n = grid.n_nodes
    vertex = np.full(n, -1)
    vertex[grid.triangles[:, :3].ravel()] = mesh.t.T.ravel()
    key = mesh.facets[0].astype(np.int64) * n + mesh.facets[1]
    order = np.argsort(key)
    named = {}
    for name, edges in grid.boundaries.items():
        ends = np.sort(vertex[edges[:, :2]], axis=1)
        named[name] = order[np.searchsorted(key, ends[:, 0] * n + ends[:, 1], sorter=order)].astype(np.int32)
    regions = {name: elements.astype(np.int32) for name, elements in grid.regions.items()}
    return mesh.with_boundaries(named).with_subdomains(regions)


def edge_load(grid: Grid, boundary: str, traction, *, thickness: float = 1.0) -> np.ndarray:
    """Consistent nodal forces of a traction on a boundary.

    Parameters
    ----------
    grid : Grid
    boundary : str
    traction : (2,) array or callable
        [Pa]; a callable takes positions (k, q, 2) and outward unit normals (k, q, 2) and returns
        tractions of the same shape. A pressure p is ``lambda x, n: -p * n``.
    thickness : float
        [m].

    Returns
    -------
    (2n,) array
        Forces [N].

    Raises
    ------
    GridError
        When there is no such boundary.
    """
    edges, shape, x, tangent = edge_quadrature(grid, boundary)
    length = np.hypot(tangent[..., 0], tangent[..., 1])
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1) / length[..., None]
    value = traction(x, normal) if callable(traction) else np.asarray(traction, dtype=float)
    value = np.broadcast_to(value, x.shape)
    forces = thickness * np.einsum("iq,kqc,kq->kic", shape, value, length)
    load = np.zeros(2 * grid.n_nodes)
    np.add.at(load, 2 * edges[..., None] + np.array([0, 1]), forces)
    return load


def checked_solve(grid: Grid, K, f, *, fixed, values=0.0, springs=None) -> np.ndarray:
    """Solve ``K u = f`` with prescribed displacements, checking rank before and equilibrium after.

    Parameters
    ----------
    grid : Grid
    K : sparse array, shape (2n, 2n)
        All stiffness, `springs` included.
    f : (2n,) or (2n, m) array
        Loads [N].
    fixed : (k,) int array
        Prescribed degrees of freedom.
    values : float or (k,) array
        Their displacement [m].
    springs : sparse array, optional
        The part of `K` that ties the body to ground, see `rank_check`.

    Returns
    -------
    array of the shape of `f`
        Displacements [m].

    Raises
    ------
    GridError
        When a part of the body is free to move.
    FemgearError
        When the solution fails `check_solution`.
    """
    rank_check(grid, fixed, springs=springs)
    f = np.asarray(f, dtype=float)
    if not np.isfinite(f).all():
        raise FemgearError("the load holds numbers that are not finite", code="E-SOLVE")
    free = np.ones(K.shape[0], dtype=bool)
    free[np.asarray(fixed, dtype=int)] = False
    u = np.zeros(f.shape)
    u[np.asarray(fixed, dtype=int)] = np.reshape(values, np.shape(values) + (1,) * (f.ndim - 1))
    K = K.tocsc()
    u[free] = symmetric_factor(K[free][:, free]).solve((f - K @ u)[free])
    check_solution(K, u, f, fixed=fixed)
    return u


def rank_check(grid: Grid, fixed, *, springs=None) -> None:
    """Refuse a body, or a loose part of one, that can move without straining.

    Parameters
    ----------
    grid : Grid
    fixed : (k,) int array
        Degrees of freedom held.
    springs : sparse array, shape (2n, 2n), optional
        Further stiffness to ground, such as `foundation`.

    Raises
    ------
    GridError
        Saying which part can move, and how.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = grid.n_nodes
    pairs = grid.triangles[:, [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]]].reshape(-1, 2)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, part = connected_components(links, directed=False)
    held = np.zeros((2 * n,), dtype=bool)
    held[np.asarray(fixed, dtype=int)] = True
    for k in range(count):
        mine = part == k
        centre = 0.5 * (grid.points[mine].min(axis=0) + grid.points[mine].max(axis=0))
        size = max(np.ptp(grid.points[mine], axis=0).max(), np.finfo(float).tiny)
        motions = np.zeros((n, 2, 3))
        motions[mine, 0, 0] = motions[mine, 1, 1] = 1.0
        motions[mine, 0, 2] = -(grid.points[mine, 1] - centre[1]) / size
        motions[mine, 1, 2] = (grid.points[mine, 0] - centre[0]) / size
        motions = motions.reshape(-1, 3)
        reaction = motions[held].T @ motions[held]
        if springs is not None:
            ground = motions.T @ (springs @ motions)
            reaction = reaction + ground / max(np.abs(ground).max(), np.finfo(float).tiny)
        value, vector = np.linalg.eigh(reaction)
        if value[0] <= 1e-10 * max(value[-1], 1e-300):
            raise GridError(
                f"part {k + 1} of {count} of the body, {np.count_nonzero(mine)} nodes around "
                f"({centre[0]:.6g}, {centre[1]:.6g}) m, can {_motion(vector[:, 0], centre, size)}",
                code="E-GRID-FREE",
                limit="at least three independent supports for each part",
                remedy="hold its bore or rim, or join it to a part that is held",
            )


def _motion(vector, centre, size):
    x, y, turn = vector[0], vector[1], vector[2] / size
    if abs(turn) * size < 1e-6 * np.hypot(x, y):
        return f"move along ({x:.3f}, {y:.3f})"
    pivot = size * np.round((centre + np.array([-y, x]) / turn) / size, 9) + 0.0
    return f"turn about ({pivot[0]:.6g}, {pivot[1]:.6g}) m"


def check_solution(K, u, f, *, fixed=(), tolerance: float = 1e-6) -> float:
    """Refuse a solution of ``K u = f`` that is not one; return its relative residual.

    Parameters
    ----------
    K : sparse array, shape (n, n)
    u, f : (n,) or (n, m) arrays
    fixed : (k,) int array
        Degrees of freedom that were prescribed; their equations give the reactions.
    tolerance : float
        Largest residual relative to the load and the forces of the prescribed motions.

    Returns
    -------
    float

    Raises
    ------
    FemgearError
        When numbers are not finite, equilibrium is missed, or strain energy is negative.
    """
    u, f = (np.atleast_2d(np.asarray(a, dtype=float).T).T for a in (u, f))
    if not (np.isfinite(u).all() and np.isfinite(f).all()):
        raise FemgearError("the load or the solution holds numbers that are not finite", code="E-SOLVE")
    free = np.ones(K.shape[0], dtype=bool)
    free[np.asarray(fixed, dtype=int)] = False
    driven = np.where(free[:, None], 0.0, u)
    scale = np.linalg.norm((f - K @ driven)[free], axis=0)
    forces = K @ u
    miss = np.linalg.norm((forces - f)[free], axis=0)
    relative = float(np.max(miss / np.where(scale > 0, scale, 1.0), initial=0.0))
    if not relative <= tolerance:
        raise FemgearError(
            f"the solution misses equilibrium: relative residual {relative:.2e}",
            code="E-SOLVE",
            limit=f"{tolerance:g}",
            remedy="check that every part of the body is held and that the material data are sensible",
        )
    energy = (u * forces).sum(axis=0)
    size = (np.abs(u) * np.abs(forces)).sum(axis=0)
    if np.any(energy < -1e-9 * size):
        raise FemgearError(
            f"the strain energy is negative ({0.5 * energy.min():.3e} J)",
            code="E-SOLVE",
            limit=">= 0 J",
        )
    return relative


def stress(grid: Grid, material: Material, displacement, *, state: str) -> np.ndarray:
    """In-plane stresses xx, yy, xy at the six nodes of every element, shape (m, 6, 3) [Pa].

    Values of one node differ between its elements; the difference shows the discretisation error.
    """
    lam, mu = material.lame(state)
    x, y = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]]).T
    zero = np.zeros(6)
    d = np.array(
        [
            [4 * x + 4 * y - 3, 4 * x - 1, zero, 4 - 8 * x - 4 * y, 4 * y, -4 * y],
            [4 * x + 4 * y - 3, zero, 4 * y - 1, -4 * x, 4 * x, 4 - 4 * x - 8 * y],
        ]
    )
    jacobian = np.einsum("mic,aiq->mqca", grid.points[grid.triangles], d)
    slope = np.einsum("aiq,mqac->miqc", d, np.linalg.inv(jacobian))
    u = np.asarray(displacement, dtype=float).reshape(-1, 2)[grid.triangles]
    gradient = np.einsum("mic,miqd->mqcd", u, slope)
    spread = lam * (gradient[..., 0, 0] + gradient[..., 1, 1])
    shear = mu * (gradient[..., 0, 1] + gradient[..., 1, 0])
    return np.stack([spread + 2 * mu * gradient[..., 0, 0], spread + 2 * mu * gradient[..., 1, 1], shear], axis=-1)


def quality(grid: Grid) -> np.ndarray:
    """Shape quality of every element, 1 for an equilateral straight-sided triangle, shape (m,).

    ``4 sqrt(3) A / sum l^2`` (Bank) times the ratio of the bounds of the Jacobian determinant; not
    positive where the element may be folded.
    """
    corner = grid.points[grid.triangles[:, :3]]
    side = np.roll(corner, -1, axis=1) - corner
    area = 0.5 * (side[:, 0, 0] * side[:, 1, 1] - side[:, 0, 1] * side[:, 1, 0])
    bound = jacobian_bounds(grid)
    top = np.where(bound[:, 1] > 0, bound[:, 1], np.inf)
    return 4 * np.sqrt(3) * area / (side**2).sum(axis=(1, 2)) * bound[:, 0] / top
