"""Contact of two plane finite-element bodies without a half plane: a mortar contact of their surfaces.

The surfaces meet as they are, curved edges of six-node triangles. The pressure is piecewise linear between
the corners of one surface, and the separations weighted with its hat functions vanish or stay open (M. A.
Puso, T. A. Laursen, Comput. Methods Appl. Mech. Eng. 193, 2004; linear multipliers for quadratic elements:
A. Popp, B. I. Wohlmuth, M. W. Gee, W. A. Wall, SIAM J. Sci. Comput. 34, 2012). An active set of its own
finds where they touch, so that nothing here is shared with the contact solution that it checks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import ContactError
from femgear.fe.compliance import node_dofs, symmetric_factor
from femgear.fe.elasticity import stiffness
from femgear.fe.grid import ordered_nodes
from validation.reference.plane_elasticity import check_solution

GAUSS = 5  # points between neighbouring corners of either surface


@dataclass(frozen=True)
class Surface:
    """One body of unit thickness with its contact surface, in its place.

    Parameters
    ----------
    points : (2 k + 1, 2) array
        Nodes of the surface in order: corner, mid, corner, ... [m], the body on the left.
    nodes : (2 k + 1,) int array
        Their numbers in the grid.
    turn : (2, 2) array
        Rotation from the frame of the grid.
    free : (n_free,) int array
        Degrees of freedom that are not held.
    stiffness : sparse array, shape (n_free, n_free)
        [N/m], in the frame of the grid.
    unknowns : int
        Degrees of freedom of the grid.
    """

    points: np.ndarray
    nodes: np.ndarray
    turn: np.ndarray
    free: np.ndarray
    stiffness: object
    unknowns: int

    def __post_init__(self):
        for array in (self.points, self.nodes, self.turn, self.free):
            array.setflags(write=False)


def make_surface(grid, material, boundary: str, *, held, angle: float = 0.0, centre=(0.0, 0.0)) -> Surface:
    """Body in plane strain, turned by an angle about its origin, which then moves to a centre.

    Parameters
    ----------
    grid : Grid
    material : Material
    boundary : str
        Name of the contact surface.
    held : (m,) int array
        Degrees of freedom that are held.
    angle : float
        [rad]
    centre : (float, float)
        [m]
    """
    free = np.setdiff1d(np.arange(2 * grid.n_nodes), held)
    K = stiffness(grid, material, thickness=1.0)[free][:, free]
    nodes = ordered_nodes(grid, boundary)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return Surface(grid.points[nodes] @ turn.T + centre, nodes, turn, free, K, 2 * grid.n_nodes)


def boundary_dofs(grid, name: str) -> np.ndarray:
    """Degrees of freedom on a named boundary."""
    return node_dofs(np.unique(grid.boundaries[name]))


def _on_edges(surface, edge, t):
    """Points and tangents (q, 2) and shape values (3, q) at places t in 0 .. 1 on edges (q,)."""
    node = surface.points[2 * edge[:, None] + [0, 1, 2]]
    shape = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
    slope = np.stack([4 * t - 3, 4 - 8 * t, 4 * t - 1])
    return np.einsum("iq,qic->qc", shape, node), np.einsum("iq,qic->qc", slope, node), shape


def _nodal_loads(surface, edge, shape, direction, weight):
    """Loads on the free degrees of freedom of tractions along `direction` (q, 2), by `weight` (q, m)."""
    from scipy.sparse import csr_array

    dof = 2 * surface.nodes[2 * edge[:, None] + [0, 1, 2]][..., None] + [0, 1]
    value = np.einsum("iq,qc->qic", shape, direction @ surface.turn)
    point = np.broadcast_to(np.arange(len(edge))[:, None, None], dof.shape)
    nodal = csr_array((value.ravel(), (dof.ravel(), point.ravel())), shape=(surface.unknowns, len(edge)))
    return (nodal @ weight)[surface.free]


def _compliance(surface, load, factor=None):
    """Compliance (m, m) between loads (n_free, m) on a body, by the factor of its stiffness if known."""
    u = (factor or symmetric_factor(surface.stiffness)).solve(load)
    check_solution(surface.stiffness, u, load)
    return load.T @ u


def _quadrature(slave, master, first, last):
    """Points of the slave's edges first..last between the corners of both surfaces: edge, place, weight (q,).

    With the corners of the master as breaks the integrals are exact for straight edges, so that a uniform
    pressure is transmitted as such.
    """
    place = np.arange(first, last + 2.0)
    edge = np.minimum(np.arange(first, last + 2), last)
    x, tangent, _ = _on_edges(slave, edge, place - edge)
    corner = master.points[0::2]
    ahead = ((corner[:, None] - x) * tangent).sum(axis=2) > 0
    opposite = ahead[:, 0] & ~ahead[:, -1]
    corner, edge = corner[opposite], first + ahead[opposite].sum(axis=1) - 1
    t = np.full(len(corner), 0.5)
    for _ in range(30):
        x, tangent, _ = _on_edges(slave, edge, t)
        t = t + ((corner - x) * tangent).sum(axis=1) / (tangent**2).sum(axis=1)
    breaks = np.unique(np.concatenate([place, edge + np.clip(t, 0.0, 1.0)]))
    start, length = breaks[:-1], np.diff(breaks)
    node, weight = np.polynomial.legendre.leggauss(GAUSS)
    points = start[:, None] + 0.5 * length[:, None] * (1 + node)
    edge = np.repeat(np.floor(start + 0.5 * length).astype(int), GAUSS)
    return edge, points.ravel() - edge, (0.5 * length[:, None] * weight).ravel()


def covered(slave, master) -> np.ndarray:
    """Whether the master has a point opposite to every corner of the slave, bool (k + 1,)."""
    place = np.arange(len(slave.nodes) // 2 + 1)
    edge = np.minimum(place, place[-1] - 1)
    x, tangent, _ = _on_edges(slave, edge, place - edge)
    away = ((master.points[None, 0::2] - x[:, None]) * tangent[:, None]).sum(axis=2)
    return (away.min(axis=1) <= 0) & (away.max(axis=1) >= 0)


def _project(master, x, along):
    """Where lines through `x` (q, 2) across the unit tangents `along` meet the master: edge and place."""
    corner = np.einsum("qkc,qc->qk", master.points[None, 0::2] - x[:, None], along)
    crosses = corner[:, :-1] * corner[:, 1:] <= 0
    if not crosses.any(axis=1).all():
        raise ContactError("a point of the contact surface has no counterpart", code="E-SHAPE")
    edge, row = crosses.argmax(axis=1), np.arange(len(x))
    t = corner[row, edge] / (corner[row, edge] - corner[row, edge + 1])
    for _ in range(8):
        y, slope, _ = _on_edges(master, edge, t)
        t = t - ((y - x) * along).sum(axis=1) / (slope * along).sum(axis=1)
    return edge, t


def mortar_contact(slave, master, near, load: float, *, centre: float, base_radius: float):
    """Solve the contact of two surfaces; the master turns about (centre, 0) towards the slave.

    Parameters
    ----------
    slave, master : Surface
    near : (int, int)
        First and last slave edge that may touch.
    load : float
        Torque on the master over its base radius and the face width [N/m].
    centre, base_radius : float
        Of the master [m].

    Returns
    -------
    approach : float
        Turn of the master times its base radius [m].
    position, pressure : (m,) arrays
        Positions along the slave [m] and pressures [Pa] of its corners.

    Raises
    ------
    ContactError
        When a point of the slave has no counterpart, the contact runs out of the `near` edges on the
        surface (it may end where the surface ends), or the active set does not settle.
    """
    first, last = near
    places = [(slave, master, near)]
    ((approach, (pressure,)),) = mortar_contacts(places, [load], centre=centre, base_radius=base_radius)
    corner = slave.points[2 * first : 2 * last + 3 : 2]
    return approach, np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corner, axis=0).T))]), pressure


def mortar_contacts(places, loads, *, centre: float, base_radius: float, factors=(None, None)):
    """Solve the contact of several pairs of surfaces (slave, master, near) of the same two bodies.

    As `mortar_contact`, with the factors of both stiffnesses where they are known: the approach and the
    pressures of every pair under each of the loads.
    """
    nodal, gaps, arms, ends = ([], []), [], [], []
    for slave, master, (first, last) in places:
        edge, t, weight = _quadrature(slave, master, first, last)
        x, tangent, shape = _on_edges(slave, edge, t)
        length = np.hypot(*tangent.T)
        along = tangent / length[:, None]
        normal = np.column_stack([along[:, 1], -along[:, 0]])
        hats = np.maximum(1.0 - np.abs((edge - first + t)[:, None] - np.arange(last - first + 2)), 0.0)
        hats *= (length * weight)[:, None]
        on_edge, on_t = _project(master, x, along)
        y, _, on_shape = _on_edges(master, on_edge, on_t)
        arm = (y[:, 1] * normal[:, 0] - (y[:, 0] - centre) * normal[:, 1]) / base_radius
        gaps.append(hats.T @ ((y - x) * normal).sum(axis=1))
        arms.append(hats.T @ arm)
        nodal[0].append(_nodal_loads(slave, edge, shape, -normal, hats))
        nodal[1].append(_nodal_loads(master, on_edge, on_shape, normal, hats))
        opposite = np.concatenate([[False], covered(slave, master), [False]])
        ends += [not opposite[first], not opposite[last + 3]]
    H = sum(
        _compliance(body, np.hstack(columns), factor)
        for body, columns, factor in zip(places[0][:2], nodal, factors, strict=True)
    )
    separations, splits = [], np.cumsum([len(gap) for gap in gaps])[:-1]
    for load in loads:
        approach, pressure = _active_set(H, np.concatenate(gaps), np.concatenate(arms), load)
        each = np.split(pressure, splits)
        outer = (p[k] for p in each for k in (0, -1))
        if any(force > 0 and not at for at, force in zip(ends, outer, strict=True)):
            raise ContactError("the contact runs out of the edges that may touch", code="E-CONTACT")
        separations.append((approach, each))
    return separations


def _active_set(H, gap, arm, load):
    """``gap + H p - arm q >= 0, p >= 0``, complementary, ``arm^T p = load``, from all corners touching."""
    active = np.ones(len(gap), bool)
    for _ in range(100):
        n = np.count_nonzero(active)
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = H[np.ix_(active, active)]
        matrix[:n, n] = matrix[n, :n] = -arm[active]
        scale = 1.0 / np.sqrt(np.append(np.diag(matrix)[:n], arm.max() ** 2 / H.max()))
        right = scale * np.append(-gap[active], -load)
        solved = scale * np.linalg.solve(scale[:, None] * matrix * scale, right)
        pressure = np.zeros(len(gap))
        pressure[active] = solved[:n]
        rest = gap + H @ pressure - arm * solved[n]
        following = np.where(active, pressure > 0, rest < 0)
        if np.array_equal(following, active):
            return float(solved[n]), pressure
        active = following
    raise ContactError("the active set of the two bodies does not settle", code="E-CONTACT")
