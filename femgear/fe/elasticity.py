"""Plane linear elasticity on six-node triangles: material, stiffness, mass, loads, checked solutions.

Degrees of freedom are numbered ``2 * node + component`` (x 0, y 1) in the node numbers of the grid. The
sparse solver checks neither supports before a solve nor equilibrium and energy after it: `checked_solve`
does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, FemgearError, GridError
from femgear.fe.grid import Grid, boundary_edges

STATES = ("plane strain", "plane stress")


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material.

    Parameters
    ----------
    youngs_modulus : float
        [Pa], positive.
    poisson_ratio : float
        Between -1 and 0.5, both excluded.
    density : float
        [kg/m^3], positive.

    Raises
    ------
    CaseError
        When a value is out of these bounds or not finite.
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self):
        for name, unit in (("youngs_modulus", "Pa"), ("density", "kg/m^3")):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise CaseError(
                    f"{name} is {value}", code="E-MATERIAL", key=name, limit=f"finite, > 0 {unit}"
                )
        if not -1.0 < self.poisson_ratio < 0.5:
            raise CaseError(
                f"poisson_ratio is {self.poisson_ratio}",
                code="E-MATERIAL",
                key="poisson_ratio",
                limit="-1 < nu < 0.5 (an incompressible body needs other elements)",
            )

    @property
    def shear_modulus(self) -> float:
        """Shear modulus ``E / (2 (1 + nu))`` [Pa]."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))

    def lame(self, state: str) -> tuple[float, float]:
        """Lame constants [Pa] that make ``sigma = lambda tr(eps) I + 2 mu eps`` hold in the plane.

        Plane strain ``E nu / ((1 + nu)(1 - 2 nu))``, plane stress ``E nu / (1 - nu^2)``
        (Timoshenko and Goodier, "Theory of Elasticity", 3rd ed., sections 10 and 16).
        """
        E, nu = self.youngs_modulus, self.poisson_ratio
        if state == "plane strain":
            return E * nu / ((1 + nu) * (1 - 2 * nu)), self.shear_modulus
        if state == "plane stress":
            return E * nu / (1 - nu**2), self.shear_modulus
        raise GridError(f"unknown plane state {state!r}", code="E-STATE", limit=" or ".join(STATES))


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


def basis(grid: Grid, *, order: int = 4):
    """Scalar P2 basis of scikit-fem; integrates polynomials of this order exactly on straight elements."""
    from skfem import Basis, ElementTriP2, MeshTri2

    mesh = MeshTri2(np.ascontiguousarray(grid.points.T), np.ascontiguousarray(grid.triangles.T))
    return Basis(mesh, ElementTriP2(), intorder=order)


def node_of_dof(grid: Grid, scalar) -> np.ndarray:
    """Grid node of every degree of freedom of a scalar P2 basis on the grid, shape (n,).

    Raises
    ------
    GridError
        When the two do not correspond one to one.
    """
    nodes = np.full(scalar.N, -1)
    nodes[scalar.element_dofs] = grid.triangles.T
    if scalar.N != grid.n_nodes or np.any(nodes[scalar.element_dofs] != grid.triangles.T):
        raise GridError("the nodes of the grid are not those of a conforming P2 grid", code="E-GRID-NODES")
    return nodes


def stiffness(grid: Grid, material: Material, *, state="plane strain", thickness=1.0):
    """Stiffness matrix.

    Parameters
    ----------
    grid : Grid
    material : Material
    state : str or mapping of region to str
        ``"plane strain"`` or ``"plane stress"``.
    thickness : float or mapping of region to float
        [m].

    Returns
    -------
    scipy.sparse.csc_array, shape (2n, 2n)
        [N/m], symmetric.

    Raises
    ------
    GridError
        When a state is unknown or a mapping leaves elements out.
    """
    from scipy.sparse import csc_array
    from skfem import BilinearForm

    scalar = basis(grid)
    nodes = node_of_dof(grid, scalar)
    pairs = {name: material.lame(value) for name, value in _by_region(state).items()}
    depth = per_element(grid, thickness)
    lam, mu = (
        np.broadcast_to(
            (depth * per_element(grid, {name: pair[i] for name, pair in pairs.items()}))[:, None],
            scalar.dx.shape,
        )
        for i in range(2)
    )
    # three scalar forms instead of one with vectors: a quarter of the calls
    xx, yy, xy = (BilinearForm(form).assemble(scalar, lam=lam, mu=mu).tocoo() for form in (_xx, _yy, _xy))
    rows = [2 * nodes[xx.row], 2 * nodes[yy.row] + 1, 2 * nodes[xy.row], 2 * nodes[xy.col] + 1]
    columns = [2 * nodes[xx.col], 2 * nodes[yy.col] + 1, 2 * nodes[xy.col] + 1, 2 * nodes[xy.row]]
    values = np.concatenate([xx.data, yy.data, xy.data, xy.data])
    size = 2 * grid.n_nodes
    K = csc_array((values, (np.concatenate(rows), np.concatenate(columns))), shape=(size, size))
    return 0.5 * (K + K.T).tocsc()


def mass(grid: Grid, material: Material, thickness=1.0):
    """Consistent mass matrix, shape (2n, 2n) [kg]; arguments as in `stiffness`."""
    from scipy.sparse import csc_array
    from skfem import BilinearForm

    scalar = basis(grid)
    nodes = node_of_dof(grid, scalar)
    weight = (material.density * per_element(grid, thickness))[:, None]
    form = BilinearForm(lambda u, v, w: w.weight * u * v)
    one = form.assemble(scalar, weight=np.broadcast_to(weight, scalar.dx.shape)).tocoo()
    rows, columns = 2 * nodes[one.row], 2 * nodes[one.col]
    size = 2 * grid.n_nodes
    return csc_array(
        (
            np.concatenate([one.data, one.data]),
            (np.concatenate([rows, rows + 1]), np.concatenate([columns, columns + 1])),
        ),
        shape=(size, size),
    )


def per_element(grid: Grid, value) -> np.ndarray:
    """One number for each element, from a number or a mapping of region to number, shape (m,).

    Raises
    ------
    GridError
        When the mapping names a region that is not there or leaves elements out.
    """
    result = np.full(len(grid.triangles), np.nan)
    for name, number in _by_region(value).items():
        if name is None:
            result[:] = number
        elif name in grid.regions:
            result[grid.regions[name]] = number
        else:
            raise GridError(
                f"the grid has no region {name!r}",
                code="E-GRID-REGION",
                key=name,
                limit="one of " + ", ".join(sorted(grid.regions)),
            )
    if np.isnan(result).any():
        raise GridError(
            f"{np.count_nonzero(np.isnan(result))} elements belong to none of the regions given",
            code="E-GRID-REGION",
            limit="all of " + ", ".join(sorted(grid.regions)),
        )
    return result


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
    edges, shape, x, tangent = _edge_quadrature(grid, boundary)
    length = np.hypot(tangent[..., 0], tangent[..., 1])
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1) / length[..., None]
    value = traction(x, normal) if callable(traction) else np.asarray(traction, dtype=float)
    value = np.broadcast_to(value, x.shape)
    forces = thickness * np.einsum("iq,kqc,kq->kic", shape, value, length)
    load = np.zeros(2 * grid.n_nodes)
    np.add.at(load, 2 * edges[..., None] + np.array([0, 1]), forces)
    return load


def foundation(grid: Grid, boundary: str, radial: float, tangential: float, *, thickness: float):
    """Stiffness of an elastic (Winkler) foundation along a boundary around the origin.

    Parameters
    ----------
    grid : Grid
    boundary : str
    radial, tangential : float
        Moduli [N/m^3]: traction per displacement towards and around the origin, not negative.
    thickness : float
        [m].

    Returns
    -------
    scipy.sparse.csc_array, shape (2n, 2n)
        [N/m].

    Raises
    ------
    GridError
        When a modulus is negative or not finite, or there is no such boundary.
    """
    from scipy.sparse import csc_array

    for name, value in (("radial", radial), ("tangential", tangential)):
        if not (np.isfinite(value) and value >= 0):
            raise GridError(
                f"the {name} modulus is {value}", code="E-FOUNDATION", key=name, limit=">= 0 N/m^3"
            )
    edges, shape, x, tangent = _edge_quadrature(grid, boundary)
    length = np.hypot(tangent[..., 0], tangent[..., 1])
    out = x / np.hypot(x[..., 0], x[..., 1])[..., None]
    across = np.stack([-out[..., 1], out[..., 0]], axis=-1)
    modulus = radial * out[..., :, None] * out[..., None, :]
    modulus += tangential * across[..., :, None] * across[..., None, :]
    local = thickness * np.einsum("iq,jq,kq,kqcd->kicjd", shape, shape, length, modulus).reshape(-1, 6, 6)
    dofs = (2 * edges[..., None] + np.array([0, 1])).reshape(-1, 6)
    rows, columns = np.repeat(dofs, 6, axis=1).ravel(), np.tile(dofs, (1, 6)).ravel()
    size = 2 * grid.n_nodes
    return csc_array((local.ravel(), (rows, columns)), shape=(size, size))


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
    return np.stack(
        [spread + 2 * mu * gradient[..., 0, 0], spread + 2 * mu * gradient[..., 1, 1], shear], axis=-1
    )


def _xx(u, v, w):
    return (w.lam + 2 * w.mu) * u.grad[0] * v.grad[0] + w.mu * u.grad[1] * v.grad[1]


def _yy(u, v, w):
    return (w.lam + 2 * w.mu) * u.grad[1] * v.grad[1] + w.mu * u.grad[0] * v.grad[0]


def _xy(u, v, w):
    return w.lam * u.grad[1] * v.grad[0] + w.mu * u.grad[0] * v.grad[1]


def _by_region(value):
    return dict(value) if isinstance(value, Mapping) else {None: value}


def _edge_quadrature(grid, name):
    """Nodes (k, 3), shape values (3, q), positions (k, q, 2) and tangents times weight (k, q, 2)."""
    edges = boundary_edges(grid, name)
    s, weight = np.polynomial.legendre.leggauss(4)
    shape = np.array([0.5 * s * (s - 1), 0.5 * s * (s + 1), 1 - s**2])
    slope = np.array([s - 0.5, s + 0.5, -2 * s])
    x = np.einsum("iq,kic->kqc", shape, grid.points[edges])
    tangent = np.einsum("iq,kic->kqc", slope, grid.points[edges]) * weight[:, None]
    return edges, shape, x, tangent


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
        raise FemgearError("the load holds numbers that are not finite", code="E-SOLVE-NAN")
    free = np.ones(K.shape[0], dtype=bool)
    free[np.asarray(fixed, dtype=int)] = False
    u = np.zeros(f.shape)
    u[np.asarray(fixed, dtype=int)] = np.reshape(values, np.shape(values) + (1,) * (f.ndim - 1))
    K = K.tocsc()
    try:
        factor = symmetric_lu(K[free][:, free])
    except RuntimeError as error:
        raise FemgearError(f"the stiffness matrix is singular: {error}", code="E-SOLVE-SINGULAR") from error
    u[free] = factor.solve((f - K @ u)[free])
    check_solution(K, u, f, fixed=fixed)
    return u


def symmetric_lu(matrix):
    """Sparse LU of a symmetric matrix in SuperLU's symmetric mode; RuntimeError where it is singular."""
    from scipy.sparse.linalg import splu

    options = {"SymmetricMode": True}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


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
        raise FemgearError("the load or the solution holds numbers that are not finite", code="E-SOLVE-NAN")
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
            code="E-SOLVE-RESIDUAL",
            limit=f"{tolerance:g}",
            remedy="check that every part of the body is held and that the material data are sensible",
        )
    energy = (u * forces).sum(axis=0)
    size = (np.abs(u) * np.abs(forces)).sum(axis=0)
    if np.any(energy < -1e-9 * size):
        raise FemgearError(
            f"the strain energy is negative ({0.5 * energy.min():.3e} J)",
            code="E-SOLVE-ENERGY",
            limit=">= 0 J",
        )
    return relative


def _motion(vector, centre, size):
    x, y, turn = vector[0], vector[1], vector[2] / size
    if abs(turn) * size < 1e-6 * np.hypot(x, y):
        return f"move along ({x:.3f}, {y:.3f})"
    pivot = size * np.round((centre + np.array([-y, x]) / turn) / size, 9) + 0.0
    return f"turn about ({pivot[0]:.6g}, {pivot[1]:.6g}) m"
