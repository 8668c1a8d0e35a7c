"""Grids that are split along a crack, and a whole sector condensed on both its cuts.

A sector with a crack has no mirror symmetry: all its unknowns are solved for, and the cuts are kept as they are, the
right one before the left one, node by node radial and tangential.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_diag, csc_array, csr_array

from femgear.fe.compliance import SectorSchur, boundary_nodes, check_sector_residual, node_dofs, symmetric_factor
from femgear.fe.grid import Grid, ordered_nodes


@dataclass(frozen=True)
class SplitGrid:
    """A grid whose elements part along a crack.

    Parameters
    ----------
    grid : Grid
        With the nodes of one face added behind the others; its boundary ``crack`` are the edges of the other face.
    faces : (2, k) int array
        Nodes of both faces that lie on one another, from the mouth to the one before the tip; the face of the tooth
        first.
    normals : (k, 2) array
        Unit normals of the crack, from the body into the tooth.
    tip : int
        Node at its tip.
    """

    grid: Grid
    faces: np.ndarray
    normals: np.ndarray
    tip: int


def split_grid(grid: Grid, curve: str, points: int, region: str) -> SplitGrid:
    """Part the elements of a grid along the first nodes of an inner curve.

    Parameters
    ----------
    curve : str
        Boundary of the grid that begins with the crack, mouth first.
    points : int
        Number of nodes of the crack, with the tip; one where nothing parts.
    region : str
        Elements on one side of the curve, which get nodes of their own.
    """
    line = ordered_nodes(grid, curve)
    nodes = line[:points]
    parted, tip = nodes[:-1], int(nodes[-1])
    number = np.arange(grid.n_nodes)
    number[parted] = grid.n_nodes + np.arange(len(parted))
    triangles = np.array(grid.triangles)
    triangles[grid.regions[region]] = number[triangles[grid.regions[region]]]
    edges = {name: np.array(rows) for name, rows in grid.boundaries.items()}
    edges["crack"] = grid.boundaries[curve][: points // 2]
    # what the outline has above the mouth begins at the node of that side
    of_region = set(np.unique(triangles[grid.regions[region]]).tolist())
    for name, rows in edges.items():
        if name not in (curve, "crack"):
            touched = np.isin(rows, parted)
            beyond = np.array([all(number[node] in of_region for node in row) for row in rows])
            edges[name] = np.where(touched & beyond[:, None], number[rows], rows)
    split = Grid(np.vstack([grid.points, grid.points[parted]]), triangles, edges, dict(grid.regions))
    along = grid.points[line[max(points - 1, 2)]] - grid.points[line[0]]
    normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    middle = grid.points[np.unique(grid.triangles[grid.regions[region]])].mean(axis=0)
    normal = normal if (middle - grid.points[tip]) @ normal > 0 else -normal
    return SplitGrid(split, np.stack([number[parted], parted]), np.tile(normal, (len(parted), 1)), tip)


@dataclass(frozen=True)
class WholeSchur:
    """A whole sector condensed on both cuts, with m unknowns of these, and L loads that are seen where they act.

    Parameters
    ----------
    stiffness : (m, m) array
        [N/m]
    load_cut : (m, L) array
        Forces on the held cuts per unit load [1].
    compliance : (L, L) array
        With the cuts held [m/N].
    """

    stiffness: np.ndarray
    load_cut: np.ndarray
    compliance: np.ndarray


def condense_whole(grid: Grid, stiffness, loads: np.ndarray, *, held: str | None) -> WholeSchur:
    """Condense a sector on its cuts without any symmetry.

    GridError: a factor that is singular (E-SOLVE), or a solution that misses equilibrium (E-RESIDUAL).

    Parameters
    ----------
    grid : Grid
        With the boundaries ``cut_left`` and ``cut_right``, and that which is ``held``.
    stiffness : (2n, 2n) sparse matrix
        A foundation is part of it [N/m].
    loads : (2n, L) array
        Nodal forces, none on the cuts.
    """
    fixed = boundary_nodes(grid, held) if held else np.zeros(0, int)
    cuts = [np.setdiff1d(boundary_nodes(grid, f"cut_{side}"), fixed) for side in ("right", "left")]
    cuts = [cut[np.argsort(np.hypot(*grid.points[cut].T))] for cut in cuts]
    on_cut = np.concatenate(cuts)
    x, y = grid.points[on_cut].T / np.hypot(*grid.points[on_cut].T)
    polar = block_diag([np.array([[c, -s], [s, c]]) for c, s in zip(x, y)]).tocsr()
    edge = node_dofs(on_cut)
    inner = np.setdiff1d(np.arange(2 * grid.n_nodes), np.concatenate([edge, node_dofs(fixed)]))
    matrix = csr_array(stiffness)
    across, within = matrix[inner][:, edge] @ polar, csc_array(matrix[inner][:, inner])
    right = np.hstack([-across.toarray(), loads[inner]])
    solution = symmetric_factor(within).solve(right)
    missed = np.abs(within @ solution - right).max(axis=0) / np.abs(right).max(axis=0)
    check_sector_residual(float(missed.max()))
    fields, moved = np.split(solution, [len(edge)], axis=1)
    schur = (polar.T @ matrix[edge][:, edge] @ polar).toarray() + across.T @ fields
    return WholeSchur(0.5 * (schur + schur.T), fields.T @ loads[inner], _symmetric(loads[inner].T @ moved))


def both_cuts(schur: SectorSchur) -> WholeSchur:
    """Give a mirror-symmetric sector with loads on its left flank as a whole one, with loads on both flanks.

    Displacements ``s + a`` of the left cut and ``J (s - a)`` of the right one, J turning the tangential ones round, are
    those of symmetric and antisymmetric fields. Loads of the left flank come first; those of the right one are their
    images. The loads must be their own observations.
    """
    (S, A), nb = schur.stiffness, schur.stiffness.shape[1]
    J = np.tile([1.0, -1.0], nb // 2)
    same, other = 0.25 * (S + A), 0.25 * (S - A)
    stiffness = np.block([[J[:, None] * same * J, J[:, None] * other], [other * J, same]])
    (fs, fa), (cs, ca) = schur.load_cut, schur.compliance
    near, far = 0.5 * (fs + fa), 0.5 * (fs - fa)
    cut = np.block([[J[:, None] * far, J[:, None] * near], [near, far]])
    compliance = np.block([[cs + ca, cs - ca], [cs - ca, cs + ca]])
    return WholeSchur(stiffness, cut, _symmetric(compliance))


def sector_cuts_compliance(whole: WholeSchur, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Compute how the cuts of one sector of a ring of equal sectors yield.

    Neighbouring sectors share a cut, whose displacements are the unknowns: a block-circulant matrix, which a discrete
    Fourier transform over the sectors divides (`femgear.fe.compliance` has the same by half sectors).

    Returns
    -------
    cuts : (m, m) array
        Displacement of both cuts of sector 0, the right one first, under forces on them [m/N].
    loads : (count, L, m) array
        Displacement of both cuts per unit load on each of the sectors [m/N].
    """
    nb = len(whole.stiffness) // 2
    rr, rl, ll = whole.stiffness[:nb, :nb], whole.stiffness[:nb, nb:], whole.stiffness[nb:, nb:]
    turn = np.exp(2j * np.pi * np.arange(count // 2 + 1) / count)[:, None, None]
    # the left cut of sector k is the right one of sector k + 1
    harmonics = ll + rr + rl * turn + rl.T / turn
    between = np.fft.irfft(np.linalg.inv(harmonics), n=count, axis=0)
    # between[k]: displacement of a cut under forces on the one k before
    cuts = np.block([[between[0], between[-1]], [between[1], between[0]]])
    right, left = whole.load_cut[:nb], whole.load_cut[nb:]
    sector = np.arange(count)
    on_left = between[-sector % count] @ left + between[(1 - sector) % count] @ right
    on_right = between[(-1 - sector) % count] @ left + between[-sector % count] @ right
    return _symmetric(cuts), np.concatenate([on_right, on_left], axis=1).swapaxes(1, 2)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return 0.5 * (matrix + matrix.T)


@dataclass(frozen=True)
class CrackedRing:
    """What a crack in one sector changes in the compliance of a ring of equal sectors.

    In the coordinates of every sector, ``B_k`` (L, R): the change of the compliance between loads on two sectors is
    ``B_i core B_j^T``. The faces of the crack part by ``crossing B_k^T`` per unit load, and by ``faces`` under unit
    forces that press them apart.

    Parameters
    ----------
    basis : (count, L, R) array
        Of the sectors, the cracked one first.
    core : (R, R) array
        [m/N]
    crossing : (k, R) array
        Opening of the pairs of nodes on the faces.
    faces : (k, k) array
        [m/N]
    """

    basis: np.ndarray
    core: np.ndarray
    crossing: np.ndarray
    faces: np.ndarray


def cracked_ring(healthy: WholeSchur, whole: WholeSchur, cracked: WholeSchur, count: int) -> CrackedRing:
    """Compute what a crack in one sector changes.

    With H the compliance of the whole ring on the cuts of that sector and dS what the crack changes there,
    ``H' = H - H (I + dS H)^-1 dS H``, and likewise for loads on other sectors; the cracked sector has its own interior.

    Parameters
    ----------
    healthy : WholeSchur
        Sector of the ring, with L loads.
    whole, cracked : WholeSchur
        The same sector in a grid that can be split, and split; its loads are these L and, behind them, k that open the
        crack, of which the first have none of `whole`. Only their difference counts.
    count : int
        Number of sectors.
    """
    L, m = healthy.load_cut.shape[1], len(healthy.stiffness)
    H, of_loads = sector_cuts_compliance(healthy, count)
    change = cracked.stiffness - whole.stiffness
    eased = np.linalg.solve(np.eye(m) + H @ change, np.eye(m))
    less = _symmetric(change @ eased)
    # all by differences, which are zero to the last bit where nothing is split
    moved = cracked.load_cut[:, :L] - whole.load_cut
    cut = healthy.load_cut + moved
    opening, yielding, across_cut = cracked.load_cut[:, L:], eased @ H, H @ cut
    flank = cracked.compliance[:L, :L] - whole.compliance - across_cut.T @ less @ across_cut
    flank = flank + moved.T @ across_cut + healthy.load_cut.T @ H @ moved
    across = moved.T - across_cut.T @ less
    basis = np.zeros((count, L, m + L))
    basis[1:, :, :m], basis[0, :, m:] = of_loads[1:], np.eye(L)
    core = np.block([[-less, across.T], [across, _symmetric(flank)]])
    crossing = np.hstack([opening.T @ eased, cracked.compliance[L:, :L] + opening.T @ yielding @ cut])
    faces = _symmetric(cracked.compliance[L:, L:] + opening.T @ yielding @ opening)
    return CrackedRing(basis, core, crossing, faces)
