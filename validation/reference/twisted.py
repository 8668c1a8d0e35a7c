"""Helical teeth in three dimensions: sections that turn with z, by products of plane and axial matrices.

Section coordinates X turn with the teeth, ``x = R(tau z) X``, and so do displacements, ``u = R v``. With
``D = d/dz + tau (eta d/dxi - xi d/deta)`` the strains are

    e = (v1_xi, v2_eta, D v3),   g = (v3_eta + D v2 + tau v1, v3_xi + D v1 - tau v2, v1_eta + v2_xi).

Their coefficients do not depend on z. A field ``N(X) phi(z)`` therefore has the stiffness

    K = K00 x Z00 + K01 x Z01 + (K01 x Z01)^T + K11 x Z11,   Z_ab = int phi^(a) phi^(b) dz,

and a wave ``v e^(ikz)`` of an endless gear has ``K00 + i k (K01 - K01^T) + k^2 K11``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import legendre

from femgear.fe.compliance import _sparse_order, boundary_nodes, node_dofs, symmetric_factor
from femgear.fe.elasticity import Material, basis, node_of_dof

if TYPE_CHECKING:
    from femgear.fe.grid import Grid


def section_matrices(grid: Grid, material: Material, twist: float) -> tuple[sp.csc_array, ...]:
    """Assemble K00, K01 and K11 (3n, 3n) of a section that turns by `twist` [rad/m]."""
    scalar = basis(grid)
    m, (x, y) = len(grid.triangles), np.asarray(scalar.global_coordinates())
    lam, mu = material.lame("plane strain")
    C = np.diag([2 * mu] * 3 + [mu] * 3)
    C[:3, :3] += lam
    first, second = np.zeros((2, m, scalar.dx.shape[1], 6, 6, 3))  # element, point, strain, node, component
    for i, (field,) in enumerate(scalar.basis):
        value = np.broadcast_to(np.asarray(field), scalar.dx.shape)
        along, across = np.asarray(field.grad)
        turned = twist * (y * along - x * across)
        B = first[:, :, :, i]
        B[..., 0, 0], B[..., 5, 0], B[..., 4, 0], B[..., 3, 0] = along, across, turned, twist * value
        B[..., 1, 1], B[..., 5, 1], B[..., 3, 1], B[..., 4, 1] = across, along, turned, -twist * value
        B[..., 2, 2], B[..., 3, 2], B[..., 4, 2] = turned, across, along
        second[:, :, 4, i, 0] = second[:, :, 3, i, 1] = second[:, :, 2, i, 2] = value
    dofs = (3 * node_of_dof(grid, scalar)[scalar.element_dofs].T[..., None] + np.arange(3)).reshape(m, 18)
    rows, columns = np.repeat(dofs, 18, axis=1).ravel(), np.tile(dofs, (1, 18)).ravel()
    first, second = first.reshape(*first.shape[:3], 18), second.reshape(*second.shape[:3], 18)
    matrices = []
    for shape, other in ((first, first), (first, second), (second, second)):
        local = np.einsum("eqsa,st,eqtb,eq->eab", shape, C, other, scalar.dx, optimize=True)
        matrices.append(sp.csc_array((local.ravel(), (rows, columns)), shape=(3 * grid.n_nodes,) * 2))
    return tuple(matrices)


def _lobatto(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Lobatto points in -1 .. 1, and Legendre coefficients of the polynomials between them."""
    nodes = np.concatenate([[-1.0], legendre.Legendre.basis(order).deriv().roots(), [1.0]])
    return nodes, np.linalg.inv(legendre.legvander(nodes, order))


def axial_matrices(width: float, elements: int, order: int = 2) -> tuple[np.ndarray, ...]:
    """Heights (p,) [m] about mid-face of the nodes of equal elements, and Z00, Z01 and Z11 (p, p).

    Polynomials between Gauss-Lobatto points; order 2 is that of quadratic elements.
    """
    nodes, coefficients = _lobatto(order)
    s, w = legendre.leggauss(order + 1)
    value = legendre.legvander(s, order) @ coefficients
    slope = legendre.legval(s, legendre.legder(np.eye(order + 1))).T @ coefficients
    half, integrals = 0.5 * width / elements, np.zeros((3, elements * order + 1, elements * order + 1))
    first, second = w[:, None] * value, w[:, None] * slope
    parts = np.array([half * value.T @ first, value.T @ second, slope.T @ second / half])
    for start in range(0, elements * order, order):
        at = slice(start, start + order + 1)
        integrals[:, at, at] += parts
    middles = half * (2 * np.arange(elements) + 1 - elements)
    heights = (middles[:, None] + half * nodes[:-1]).ravel()
    return np.append(heights, 0.5 * width), *integrals


def axial_shapes(width: float, elements: int, order: int, z: np.ndarray) -> np.ndarray:
    """Values (n, p) of the functions of `axial_matrices` at heights (n,) [m]."""
    place = elements * (z / width + 0.5)
    element = np.clip(place.astype(int), 0, elements - 1)
    values = legendre.legvander(2 * (place - element) - 1, order) @ _lobatto(order)[1]
    shapes = np.zeros((len(z), elements * order + 1))
    np.put_along_axis(shapes, element[:, None] * order + np.arange(order + 1), values, axis=1)
    return shapes


def solid_stiffness(section, axial) -> sp.csc_array:
    """Assemble the stiffness [N/m] of a body with free ends; unknowns ``(3 node + component) p + height``."""
    (first, mixed, second), (_, mass, slope, stretch) = section, axial
    cross = sp.kron(mixed, slope)
    return sp.csc_array(sp.kron(first, mass) + cross + cross.T + sp.kron(second, stretch))


@dataclass(frozen=True)
class Cuts:
    """Unknowns of a sector held at its rim: ``fields`` (3n, inner + 2 cut), both cuts last and polar."""

    fields: sp.csc_array
    inner: int
    cut: int

    def tie(self, angle: float) -> sp.csc_array:
        """Unknowns per unknown of the interior and the right cut, the left one ahead by a phase [rad]."""
        identity = sp.eye_array(self.cut)
        return sp.csc_array(
            sp.block_diag([sp.eye_array(self.inner), sp.vstack([identity, np.exp(1j * angle) * identity])])
        )


def sector_cuts(grid: Grid, held: str = "rim") -> Cuts:
    """Find the unknowns of a sector, in an order that keeps the factor of the interior sparse."""
    points, fixed = np.asarray(grid.points), boundary_nodes(grid, held)
    sides = [np.setdiff1d(boundary_nodes(grid, f"cut_{side}"), fixed) for side in ("right", "left")]
    sides = [nodes[np.argsort(np.hypot(*points[nodes].T))] for nodes in sides]
    inner = np.setdiff1d(np.arange(len(points)), np.concatenate([fixed, *sides]))
    inner = inner[_sparse_order(grid.triangles, inner, len(points))]
    blocks = [sp.eye_array(3 * len(points), format="csc")[:, node_dofs(inner, 3)]]
    for nodes in sides:
        cos, sin = points[nodes].T / np.hypot(*points[nodes].T)
        turn = np.zeros((len(nodes), 3, 3)) + np.eye(3)
        turn[:, :2, :2] = np.stack([cos, -sin, sin, cos], axis=-1).reshape(-1, 2, 2)
        rows = np.repeat(node_dofs(nodes, 3), 3)
        columns = np.tile(np.arange(3 * len(nodes)).reshape(-1, 1, 3), (1, 3, 1)).ravel()
        blocks.append(sp.csc_array((turn.ravel(), (rows, columns)), shape=(3 * len(points), 3 * len(nodes))))
    return Cuts(sp.csc_array(sp.hstack(blocks)), 3 * len(inner), 3 * len(sides[0]))


def flank_columns(columns: np.ndarray, normals: np.ndarray, slope: float) -> np.ndarray:
    """Add to loads or observations (2n, m) along inward normals (m, 2) of sections their axial part, (3n, m).

    It is the tangent of the base helix angle, which keeps the normal of an inward load normal to the flank.
    """
    x, y = columns.reshape(-1, 2, len(normals)).transpose(1, 0, 2)
    along = slope * (normals[:, 0] * x + normals[:, 1] * y)
    return np.stack([x, y, along], axis=1).reshape(-1, len(normals))


def wave_compliances(grid: Grid, material: Material, twist: float, loads, observations, waves):
    """Compliance [m^2/N] to waves ``e^(ikz)`` of loads (3n, m), observed (3n, o): (k, phase of a pitch)."""
    cuts = sector_cuts(grid)
    first, mixed, second = section_matrices(grid, material, twist)
    parts = [cuts.fields.T @ wave_part @ cuts.fields for wave_part in (first, mixed - mixed.T, second)]
    f, d = (sp.csc_array(cuts.fields.T @ columns) for columns in (loads, observations))
    for k, angle in waves:
        tie = cuts.tie(angle)
        held = tie.conj().T
        matrix = held @ (parts[0] + 1j * k * parts[1] + k**2 * parts[2]) @ tie
        yield (d.T @ tie) @ symmetric_factor(matrix, ordering="NATURAL").solve((held @ f).toarray())


def solid_compliance(grid: Grid, section, axial, teeth: int, loads, observations, *, mirrors: bool = False):
    """Compliance (teeth, o p, m p) of a whole gear to forces at the heights p of loads (3n, m) [m/N].

    Entry ``[j]`` is seen on tooth i under loads of tooth ``i - j``. The ends are free, or mirror planes.
    """
    cuts, p = sector_cuts(grid), len(axial[0])
    kept = np.ones((cuts.fields.shape[1], p), bool)
    if mirrors:
        kept[2::3, [0, -1]] = False
    fields = sp.csc_array(sp.kron(cuts.fields, sp.eye_array(p)))[:, kept.ravel()]
    inner, m = kept[: cuts.inner].sum(), kept[cuts.inner : cuts.inner + cuts.cut].sum()
    columns = sp.kron(sp.csc_array(np.hstack([loads, observations])), sp.eye_array(p))
    matrix = sp.csc_array(fields.T @ solid_stiffness(section, axial) @ fields)
    schur = _condensed(matrix, sp.csc_array(fields.T @ columns), inner)
    f, d = np.split(np.arange(2 * m, len(schur)), [loads.shape[1] * p])
    cut, held, harmonics = slice(0, 2 * m), -schur[np.ix_(d, f)], []
    for n in range(teeth // 2 + 1):
        tie = np.vstack([np.eye(m), np.exp(2j * np.pi * n / teeth) * np.eye(m)])
        stiffness, pulls = tie.conj().T @ schur[cut, cut] @ tie, tie.conj().T @ schur[cut, f]
        harmonics.append(held + schur[d, cut] @ tie @ np.linalg.solve(stiffness, pulls))
    return np.fft.irfft(np.stack(harmonics), n=teeth, axis=0)


def _condensed(matrix, columns, inner: int, together: int = 256) -> np.ndarray:
    """Schur complement of ``[[matrix, columns], [columns^T, 0]]`` on all but the first `inner` unknowns."""
    coupling = sp.csc_array(sp.hstack([matrix[:inner, inner:], columns[:inner]]))
    rest = columns[inner:]
    schur = sp.block_array([[matrix[inner:, inner:], rest], [rest.T, None]]).toarray()
    factor = symmetric_factor(matrix[:inner, :inner], ordering="NATURAL")
    for first in range(0, coupling.shape[1], together):
        rows = slice(first, first + together)
        schur[:, rows] -= coupling.T @ factor.solve(coupling[:, rows].toarray())
    return schur
