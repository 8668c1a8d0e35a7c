"""Whole cyclic bodies put together from condensed sectors that need not be alike.

Every sector is condensed on its two cuts, alike sectors are joined to chains, and the chain is closed to a
ring with the sectors that carry loads (superelements: J. S. Przemieniecki, Theory of Matrix Structural
Analysis, 1968, chapter 9). The result is that of one solution of the whole body: nothing is transformed
over the sectors, and each may have a grid of its own as long as the cuts agree.

The rim of the body is held, or slides: no radial motion, a moment spread as uniform tangential traction,
and a mean rotation that is the work conjugate of this moment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import GridError
from femgear.fe.compliance import boundary_nodes, symmetric_factor
from validation.reference.plane_elasticity import edge_load

RIMS = ("held", "sliding")


def cut_rotation(count: int, size: int) -> np.ndarray:
    """Block rotation (size, size) by the sector angle 2 pi / count."""
    angle = 2 * np.pi / count
    c, s = np.cos(angle), np.sin(angle)
    return np.kron(np.eye(size // 2), np.array([[c, -s], [s, c]]))


@dataclass(frozen=True)
class Substructure:
    """Part of a cyclic body on its two cuts: the right one in its own frame, the left one in the next one's.

    Parameters
    ----------
    stiffness : (2 nb, 2 nb) array
        Right cut first [N/m].
    load : (2 nb, 1 + m) array
        Forces on the cuts per unit of each load; the first load is the moment on the rim (zero where it is
        held).
    compliance : (1 + m, 1 + m) array
        Of the loads with both cuts held [m/N].
    """

    stiffness: np.ndarray
    load: np.ndarray
    compliance: np.ndarray

    @property
    def size(self) -> int:
        """Degrees of freedom nb of one cut."""
        return len(self.stiffness) // 2


def condensed_sector(grid, stiffness, loads, *, count: int, thickness: float, rim: str = "held"):
    """One sector on its cuts.

    Parameters
    ----------
    grid : Grid
        Sector with the boundaries ``cut_right``, ``cut_left`` and ``rim``, centred on the origin.
    stiffness : (2n, 2n) sparse matrix
        [N/m]
    loads : (2n, m) array
        Nodal forces of the loads.
    count : int
        Number of sectors in the body.
    thickness : float
        [m]
    rim : {"held", "sliding"}

    Returns
    -------
    Substructure

    Raises
    ------
    GridError
        Cuts that do not match, an unknown kind of rim (E-GRID-RIM).
    """
    shapes, right, left = _free_shapes(grid, rim)
    turn = _next_frame(grid, count, len(right), rim)
    moment = np.zeros((2 * grid.n_nodes, 1)) if rim == "held" else _rim_moment(grid, count, thickness)
    F = np.asarray(shapes.T @ np.hstack([moment, loads]))
    K = (shapes.T @ stiffness @ shapes).tocsc()
    cut = np.concatenate([right, left])
    inner = np.setdiff1d(np.arange(K.shape[0]), cut)
    rows = K[inner]
    coupling = rows[:, cut].toarray()
    solved = symmetric_factor(rows[:, inner]).solve(np.hstack([coupling, F[inner]]))
    on_cut, on_load = solved[:, : len(cut)], solved[:, len(cut) :]
    S = K[cut][:, cut].toarray() - coupling.T @ on_cut
    frames = np.zeros((len(cut), len(cut)))
    frames[: len(right), : len(right)] = np.eye(len(right))
    frames[len(right) :, len(right) :] = turn
    return Substructure(
        stiffness=frames.T @ (0.5 * (S + S.T)) @ frames,
        load=frames.T @ (F[cut] - coupling.T @ on_load),
        compliance=F[inner].T @ on_load,
    )


def _free_shapes(grid, rim):
    """Displacements (2n, r) per free coordinate; right and left cut among the coordinates, by radius."""
    from scipy.sparse import csc_array

    if rim not in RIMS:
        raise GridError(f"a rim that is {rim!r}", code="E-GRID-RIM", limit=" or ".join(RIMS))
    held = boundary_nodes(grid, "rim")
    body = np.setdiff1d(np.arange(grid.n_nodes), held)
    dofs = (2 * body[:, None] + [0, 1]).ravel()
    entries = [(dofs, np.arange(len(dofs)), np.ones(len(dofs)))]
    column = np.full((grid.n_nodes, 2), -1)
    column[body] = np.arange(len(dofs)).reshape(-1, 2)
    if rim == "sliding":
        x, y = (grid.points[held] / np.hypot(*grid.points[held].T)[:, None]).T
        new = len(dofs) + np.arange(len(held))
        column[held, 0] = new
        entries += [(2 * held, new, -y), (2 * held + 1, new, x)]
    row, place, value = (np.concatenate(part) for part in zip(*entries, strict=True))
    shapes = csc_array((value, (row, place)), shape=(2 * grid.n_nodes, place.max() + 1))
    cuts = []
    for name in ("cut_right", "cut_left"):
        nodes = boundary_nodes(grid, name)
        cut_dofs = column[nodes[np.argsort(np.hypot(*grid.points[nodes].T))]].ravel()
        cuts.append(cut_dofs[cut_dofs >= 0])
    if len(cuts[0]) != len(cuts[1]):
        raise GridError("the two cuts of a sector do not match", code="E-GRID")
    return shapes, *cuts


def _next_frame(grid, count, size, rim):
    """Turn (nb, nb) from the next sector's frame; both have one tangential coordinate on a sliding rim."""
    if rim == "held":
        return cut_rotation(count, size)
    turn = np.eye(size)
    nodes = boundary_nodes(grid, "cut_right")
    on_rim = np.isin(nodes, boundary_nodes(grid, "rim"))
    order = np.argsort(np.hypot(*grid.points[nodes].T))
    start = 1 if on_rim[order[0]] else 0
    turn[start : start + size - 1, start : start + size - 1] = cut_rotation(count, size - 1)
    return turn


def _rim_moment(grid, count, thickness):
    """Nodal forces (2n, 1) of this sector's share of a unit moment, spread as tangential traction."""
    radius = float(np.hypot(*grid.points[boundary_nodes(grid, "rim")].T).mean())

    def tangential(x, normal):
        return np.stack([-x[..., 1], x[..., 0]], axis=-1) / radius

    load = edge_load(grid, "rim", tangential, thickness=thickness)
    moment = grid.points[:, 0] @ load[1::2] - grid.points[:, 1] @ load[0::2]
    return (load / (count * moment))[:, None]


def joined(first: Substructure, second: Substructure) -> Substructure:
    """Two neighbours as one, without the loads but the moment on the rim; `second` lies counter-clockwise."""
    n = first.size
    A, B = first.stiffness, second.stiffness
    middle = A[n:, n:] + B[:n, :n]
    coupling = np.hstack([A[n:, :n], B[:n, n:]])
    shared = first.load[n:, :1] + second.load[:n, :1]
    solved = np.linalg.solve(middle, np.hstack([coupling, shared]))
    outer = np.zeros((2 * n, 2 * n))
    outer[:n, :n], outer[n:, n:] = A[:n, :n], B[n:, n:]
    outer -= coupling.T @ solved[:, : 2 * n]
    load = np.vstack([first.load[:n, :1], second.load[n:, :1]]) - coupling.T @ solved[:, 2 * n :]
    rest = first.compliance[:1, :1] + second.compliance[:1, :1] + shared.T @ solved[:, 2 * n :]
    return Substructure(0.5 * (outer + outer.T), load, rest)


def chain(sector: Substructure, count: int) -> Substructure:
    """As many alike neighbours as one, joined by doubling."""
    result, power = None, sector
    while True:
        if count & 1:
            result = power if result is None else joined(result, power)
        count >>= 1
        if not count:
            return result
        power = joined(power, power)


def closed_compliance(parts, *, rim: str = "held") -> np.ndarray:
    """Compliance (m, m) between all loads of the parts of a closed ring, in their order [m/N].

    With a sliding rim the displacements are those relative to its mean rotation; the moment on the rim is
    the one that balances the loads.

    Parameters
    ----------
    parts : sequence of Substructure
        Counter-clockwise; the last is the neighbour of the first.
    rim : {"held", "sliding"}
    """
    n, count = parts[0].size, len(parts)
    many = sum(part.load.shape[1] - 1 for part in parts)
    S, G, C = np.zeros((count * n,) * 2), np.zeros((count * n, 1 + many)), np.zeros((1 + many,) * 2)
    first = 1
    for k, part in enumerate(parts):
        place = (np.concatenate([k * n + np.arange(n), (k + 1) % count * n + np.arange(n)]),)
        columns = np.append(0, first + np.arange(part.load.shape[1] - 1))
        # with a single part both cuts are the same coordinates: the sums must accumulate
        np.add.at(S, np.ix_(place[0], place[0]), part.stiffness)
        np.add.at(G, np.ix_(place[0], columns), part.load)
        C[np.ix_(columns, columns)] += part.compliance
        first += part.load.shape[1] - 1
    if rim == "held":
        H = C + G.T @ np.linalg.solve(S, G)
        return 0.5 * (H + H.T)[1:, 1:]
    size = len(S)
    # the moment is the multiplier of a mean rotation of zero; it is scaled to the size of the forces
    unit = np.abs(S).max() / np.abs(G[:, 0]).max()
    matrix = np.zeros((size + 1, size + 1))
    matrix[:size, :size] = S
    matrix[:size, size], matrix[size, :size] = -unit * G[:, 0], unit * G[:, 0]
    matrix[size, size] = unit**2 * C[0, 0]
    solved = np.linalg.solve(matrix, np.vstack([G[:, 1:], -unit * C[:1, 1:]]))
    H = C[1:, 1:] + unit * np.outer(C[1:, 0], solved[size]) + G[:, 1:].T @ solved[:size]
    return 0.5 * (H + H.T)
