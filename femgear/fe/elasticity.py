"""Plane linear elasticity on six-node triangles: material, stiffness, mass, foundation, stress at free edges.

Degrees of freedom are numbered ``2 * node + component`` (x 0, y 1) in the node numbers of the grid.

The stress is a linear functional of nodal displacements: on a free boundary the normal and the shear stress
vanish, so that the tangential stress is ``E' eps_t`` with ``E' = E`` in plane stress and ``E / (1 - nu^2)``
in plane strain (Timoshenko and Goodier, "Theory of Elasticity", 3rd ed., section 16). The tangential strain
``eps_t = t . du/ds`` is that of the boundary edges. Along a six-node edge the derivative of the displacement
is one order more accurate at the two Gauss points than elsewhere (Barlow, "Optimal stress locations in finite
element models", Int. J. Numer. Meth. Eng. 10, 1976); values at the vertices are interpolated from those by a
cubic over the arc length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from femgear.fe.grid import Grid, boundary_edges, shape_functions

# abscissae of the two-point Gauss rule on -1 .. 1
GAUSS = 1.0 / np.sqrt(3.0)


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
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float

    @property
    def shear_modulus(self) -> float:
        """Shear modulus ``E / (2 (1 + nu))`` [Pa]."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))

    def contact_modulus(self, mate: Material) -> float:
        """Contact modulus E* with a mate [Pa], ``1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2``.

        K. L. Johnson, Contact Mechanics, 1985, eq. 4.20.
        """
        return 1.0 / sum((1.0 - body.poisson_ratio**2) / body.youngs_modulus for body in (self, mate))

    def lame(self, state: str) -> tuple[float, float]:
        """Lame constants [Pa] that make ``sigma = lambda tr(eps) I + 2 mu eps`` hold in the plane.

        Plane strain ``E nu / ((1 + nu)(1 - 2 nu))``, plane stress ``E nu / (1 - nu^2)``
        (Timoshenko and Goodier, "Theory of Elasticity", 3rd ed., sections 10 and 16).
        """
        E, nu = self.youngs_modulus, self.poisson_ratio
        lam = {"plane strain": E * nu / ((1 + nu) * (1 - 2 * nu)), "plane stress": E * nu / (1 - nu**2)}
        return lam[state], self.shear_modulus


def material_of_each(material: Material | Sequence[Material], count: int) -> tuple[Material, ...]:
    """Give the material of each of so many bodies, from one of them all or one for each."""
    return (material,) * count if isinstance(material, Material) else tuple(material)


def basis(grid: Grid, *, order: int = 4):
    """Scalar P2 basis of scikit-fem; integrates polynomials of this order exactly on straight elements."""
    from skfem import Basis, ElementTriP2, MeshTri2

    mesh = MeshTri2(np.ascontiguousarray(grid.points.T), np.ascontiguousarray(grid.triangles.T))
    return Basis(mesh, ElementTriP2(), intorder=order)


def node_of_dof(grid: Grid, scalar) -> np.ndarray:
    """Grid node of every degree of freedom of a scalar P2 `basis` on the grid, shape (n,)."""
    nodes = np.full(scalar.N, -1)
    nodes[scalar.element_dofs] = grid.triangles.T
    return nodes


def _quadrature(grid: Grid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Evaluate the shape functions at points that integrate polynomials of fourth order.

    Values (6, q), slopes (m, 6, 2, q) [1/m], and weights (m, q) [m^2] of every element. Six points (G. R.
    Cowper, Int. J. Numer. Meth. Eng. 7 (1973) 405-408).
    """
    root, weights = np.sqrt(38.0 - 44.0 * np.sqrt(0.4)), np.sqrt(213125.0 - 53320.0 * np.sqrt(10.0))
    inner, outer = ((8.0 - np.sqrt(10.0) + sign * root) / 18.0 for sign in (1.0, -1.0))
    first = np.array([inner, inner, 1.0 - 2.0 * inner, outer, outer, 1.0 - 2.0 * outer])
    second = np.array([inner, 1.0 - 2.0 * inner, inner, outer, 1.0 - 2.0 * outer, outer])
    weight = np.repeat([620.0 + weights, 620.0 - weights], 3) / 7440.0
    values, along, across = shape_functions(first, second)
    nodes = grid.points[grid.triangles].transpose(0, 2, 1)
    nodes = nodes - nodes[:, :, :1]  # far from the origin differences of coordinates would lose digits
    tangent_1, other = nodes @ along, nodes @ across
    area = tangent_1[:, 0] * other[:, 1] - tangent_1[:, 1] * other[:, 0]
    slopes = np.empty((len(nodes), 6, 2, len(first)))
    slopes[:, :, 0] = along * other[:, None, 1] - across * tangent_1[:, None, 1]
    slopes[:, :, 1] = across * tangent_1[:, None, 0] - along * other[:, None, 0]
    slopes /= area[:, None, None]
    return values, slopes, area * weight


def _assembled(grid: Grid, local: np.ndarray, components: int):
    """Add up element matrices (m, 6 c, 6 c) over degrees of freedom ``c node + component``, sparse."""
    m, size = len(local), components * grid.n_nodes
    dofs = components * grid.triangles[..., None].astype(np.int32) + np.arange(components, dtype=np.int32)
    dofs = dofs.reshape(m, -1)
    rows, columns = np.repeat(dofs, dofs.shape[1], axis=1).ravel(), np.tile(dofs, (1, dofs.shape[1])).ravel()
    return scipy.sparse.csc_array((local.ravel(), (rows, columns)), shape=(size, size))


def stiffness(grid: Grid, material: Material, *, state="plane strain", thickness=1.0):
    """Assemble the stiffness matrix of a plane body, sparse and symmetric (2n, 2n) [N/m].

    The state is ``"plane strain"`` or ``"plane stress"``, the thickness in m; mappings have them by region.
    """
    (_, slopes, dx), m = _quadrature(grid), len(grid.triangles)
    pairs = {name: material.lame(value) for name, value in _by_region(state).items()}
    depth = _per_element(grid, thickness)
    lam, mu = (
        (depth * _per_element(grid, {name: pair[i] for name, pair in pairs.items()})).reshape(m, 1, 1, 1, 1)
        for i in range(2)
    )
    # all elements at once instead of 36 calls of a form: [e, i, a, j, b] is the integral of dN_i/da dN_j/db
    slopes = (slopes * np.sqrt(dx)[:, None, None]).reshape(m, 12, -1)
    products = (slopes @ slopes.transpose(0, 2, 1)).reshape(m, 6, 2, 6, 2)
    local = lam * products + mu * products.transpose(0, 1, 4, 3, 2)
    both = mu[..., 0, 0] * (products[:, :, 0, :, 0] + products[:, :, 1, :, 1])
    for c in (0, 1):
        local[:, :, c, :, c] += both
    K = _assembled(grid, local.reshape(m, 12, 12), 2)
    K.data = 0.5 * (K.data + K.T.tocsc().data)  # the pattern is symmetric already
    return K


def wave_stiffness(grid: Grid, material: Material, *, state="plane strain") -> tuple:
    """Assemble the stiffness of plane waves across the width, of a body of unit thickness.

    Displacements ``(U cos kz, V cos kz, W sin kz)`` of all wave numbers k [1/m] are independent of one
    another; the stiffness of one is ``K0 + k K1 + k^2 K2`` (O. C. Zienkiewicz and R. L. Taylor, "The Finite
    Element Method", semi-analytical elements). These are three sparse (3n, 3n) matrices [N/m^2], [N/m], [N],
    for degrees of freedom ``3 * node + component``.
    """
    (values, slopes, dx), m = _quadrature(grid), len(grid.triangles)
    lam, mu = material.lame(state)
    slopes = np.concatenate([slopes, np.broadcast_to(values[:, None], (m, 6, 1, len(values)))], axis=2)
    slopes = (slopes * np.sqrt(dx)[:, None, None]).reshape(m, 18, -1)
    # [e, i, a, j, b]: integral of a of N_i times b of N_j, of d/dx, d/dy, 1
    products = (slopes @ slopes.transpose(0, 2, 1)).reshape(m, 6, 3, 6, 3)
    local = np.zeros((3, m, 6, 3, 6, 3))
    for a in range(3):
        for b in range(3):
            power = (a == 2) + (b == 2)
            local[power, :, :, a, :, b] += lam * products[:, :, a, :, b]
            # the axial slope of what goes with the cosine is minus its sine
            turned = -mu if power == 1 else mu
            local[power, :, :, a, :, b] += turned * products[:, :, b, :, a]
            local[2 * (b == 2), :, :, a, :, a] += mu * products[:, :, b, :, b]
    assembled = (_assembled(grid, element_matrices.reshape(m, 18, 18), 3) for element_matrices in local)
    return tuple(0.5 * (K + K.T).tocsc() for K in assembled)


def mass(grid: Grid, material: Material, thickness=1.0):
    """Assemble the consistent mass matrix, shape (2n, 2n) [kg]; arguments as in `stiffness`."""
    values, _, dx = _quadrature(grid)
    values = values * np.sqrt(dx * (material.density * _per_element(grid, thickness))[:, None])[:, None]
    both = _assembled(grid, values @ values.transpose(0, 2, 1), 1)
    return scipy.sparse.kron(both, np.eye(2), format="csc")


def _per_element(grid: Grid, value) -> np.ndarray:
    """One number for each element, from a number or a mapping of all regions to numbers, shape (m,)."""
    result = np.full(len(grid.triangles), np.nan)
    for name, number in _by_region(value).items():
        result[slice(None) if name is None else grid.regions[name]] = number
    return result


def foundation(grid: Grid, boundary: str, radial: float, tangential: float, *, thickness: float):
    """Assemble the stiffness of an elastic (Winkler) foundation along a boundary around the origin.

    It is a sparse (2n, 2n) matrix [N/m]. ``radial`` and ``tangential`` are moduli [N/m^3]: traction per
    displacement towards and around the origin, not negative; ``thickness`` is in m.
    """
    edges, shape, x, tangent = edge_quadrature(grid, boundary)
    length = np.hypot(tangent[..., 0], tangent[..., 1])
    out = x / np.hypot(x[..., 0], x[..., 1])[..., None]
    across = np.stack([-out[..., 1], out[..., 0]], axis=-1)
    modulus = radial * out[..., :, None] * out[..., None, :]
    modulus += tangential * across[..., :, None] * across[..., None, :]
    local = thickness * np.einsum("iq,jq,kq,kqcd->kicjd", shape, shape, length, modulus).reshape(-1, 6, 6)
    dofs = (2 * edges[..., None] + np.array([0, 1])).reshape(-1, 6)
    rows, columns = np.repeat(dofs, 6, axis=1).ravel(), np.tile(dofs, (1, 6)).ravel()
    size = 2 * grid.n_nodes
    return scipy.sparse.csc_array((local.ravel(), (rows, columns)), shape=(size, size))


def _by_region(value):
    """A mapping of regions, or one number or state for all elements under the name None."""
    return dict(value) if isinstance(value, Mapping) else {None: value}


def edge_quadrature(grid, name):
    """Nodes (k, 3), shape values (3, q), positions (k, q, 2) [m] and tangents times weight (k, q, 2) [m]."""
    edges = boundary_edges(grid, name)
    s, weight = np.polynomial.legendre.leggauss(4)
    shape = np.array([0.5 * s * (s - 1), 0.5 * s * (s + 1), 1 - s**2])
    x = np.einsum("iq,kic->kqc", shape, grid.points[edges])
    tangent = np.einsum("iq,kic->kqc", _edge_slopes(s), grid.points[edges]) * weight[:, None]
    return edges, shape, x, tangent


def _edge_slopes(s: np.ndarray) -> np.ndarray:
    """Derivatives (3, q) of the shape functions of start, end and middle of an edge at s in -1 .. 1."""
    return np.array([s - 0.5, s + 0.5, -2.0 * s])


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
    points, tangents : (m, 2) arrays
        Their positions [m] and unit tangents in the direction of the boundary.
    arc : (m,) array
        Arc length from the first vertex [m].
    """

    columns: np.ndarray
    nodes: np.ndarray
    points: np.ndarray
    tangents: np.ndarray
    arc: np.ndarray


def tangential_stress(grid: Grid, material: Material, boundary, *, state: str) -> BoundaryStress:
    """Find the functionals of the tangential stress along one free boundary or several consecutive ones.

    Parameters
    ----------
    boundary : str or tuple of str
        Names of boundaries, each beginning where the one before ends; two edges or more in all.
    state : str
        ``"plane strain"`` or ``"plane stress"``.
    """
    names = (boundary,) if isinstance(boundary, str) else boundary
    edges = np.vstack([boundary_edges(grid, name) for name in names])
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


def _edge_strain(grid: Grid, edges):
    """Tangential strain at the Gauss points: columns (2n, 2k), arc lengths (2k,), of the vertices (k+1,)."""
    s = np.array([-GAUSS, GAUSS])
    slope = _edge_slopes(s)
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
    """Lengths (k,) [m] of edges with nodes (k, 3, 2) [m] by the rule of abscissae `t` and weights `w`."""
    derivative = np.einsum("iq,kic->kqc", _edge_slopes(t), nodes)
    return np.hypot(derivative[..., 0], derivative[..., 1]) @ w


def _cubic(given, wanted) -> np.ndarray:
    """Weights (wanted, known) of the cubic through the four known abscissae nearest to each wanted one."""
    first = np.clip(np.searchsorted(given, wanted) - 2, 0, len(given) - 4)
    index = first[:, None] + np.arange(4)
    x = given[index]
    weight = np.ones_like(x)
    for i in range(4):
        for j in range(4):
            if i != j:
                weight[:, i] *= (wanted - x[:, j]) / (x[:, i] - x[:, j])
    result = np.zeros((len(wanted), len(given)))
    np.put_along_axis(result, index, weight, axis=1)
    return result
