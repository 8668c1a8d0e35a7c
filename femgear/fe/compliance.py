"""Compliance and static displacement of a cyclic body from one tooth sector, factored once.

The body is ``count`` copies of one mirror-symmetric sector. In the frame of each sector the cut
displacements are tied by ``u_L(k) = Q u_R(k + 1)``, ``Q`` being the rotation by the sector angle
``a``. A discrete Fourier transform over the sectors (Thomas, "Dynamics of rotationally periodic
structures", Int. J. Numer. Meth. Eng. 14, 1979) decouples the body into one small problem for each
harmonic ``n``; for static loads on the interior of the sector these are

    A_n = S_RR + Q^T S_LL Q + e^{i n a} S_RL Q + e^{-i n a} Q^T S_LR
    H_n = C + Pd_n^H A_n^{-1} Pf_n,      H(k - l) = (1/count) sum_n e^{i n a (k - l)} H_n

with ``S`` the Schur complement of the sector on its two cuts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from femgear.errors import GridError
from femgear.fe.grid import Grid, shape_functions


@dataclass(frozen=True)
class SectorSchur:
    """A sector condensed on its two cuts, with loads and observations on its interior.

    Parameters
    ----------
    count : int
        Number of sectors in the body.
    S : (2, 2, nb, nb) array
        Schur complement [N/m]; the leading indices are the cut (0 right, 1 left).
    C : (n_observations, n_loads) array
        Interior compliance with both cuts held [m/N].
    load_cut, observation_cut : (2, nb, n) arrays
        Forces on the held cuts per unit load and per unit adjoint load.
    rotation : (nb, nb) array
        Block rotation by the sector angle.
    """

    count: int
    S: np.ndarray
    C: np.ndarray
    load_cut: np.ndarray
    observation_cut: np.ndarray
    rotation: np.ndarray


def symmetric_factor(matrix) -> SuperLU:
    """Factor a sparse symmetric stiffness matrix (SuperLU in symmetric mode).

    Raises
    ------
    GridError
        When the matrix is singular: the body can move without straining.
    """
    options = {"SymmetricMode": True}
    try:
        return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:
        raise GridError(
            f"the stiffness matrix of a sector is singular ({error})",
            code="E-SOLVE",
            remedy="hold the bore, the rim or a foundation so that the body cannot move freely",
        ) from error


def dof_pairs(nodes) -> np.ndarray:
    """Degrees of freedom (x then y, node by node) of an array of nodes."""
    nodes = np.asarray(nodes)
    return (2 * nodes[:, None] + np.array([0, 1])).ravel()


def boundary_nodes(grid: Grid, name: str) -> np.ndarray:
    """Sorted unique node numbers of a named boundary."""
    return np.unique(grid.boundaries[name])


def mirror_nodes(grid: Grid) -> np.ndarray:
    """Permutation that maps every node of a symmetric grid to its mirror image in the x axis, shape (n,)."""
    from scipy.spatial import KDTree

    return np.asarray(KDTree(grid.points).query(grid.points * np.array([1.0, -1.0]))[1])


def mirrored_columns(columns: np.ndarray, image: np.ndarray) -> np.ndarray:
    """Reflect displacement or load columns (2n, m) in the x axis; nodes' images (n,) as of `mirror_nodes`."""
    result = np.empty_like(columns)
    result[2 * image] = columns[0::2]
    result[2 * image + 1] = -columns[1::2]
    return result


def interpolation(grid: Grid, points: np.ndarray):
    """Quadratic interpolation from the grid nodes to interior points.

    Parameters
    ----------
    grid : Grid
    points : (m, 2) array
        Points inside the grid [m].

    Returns
    -------
    scipy.sparse.csr_array, shape (m, n)

    Raises
    ------
    GridError
        When a point lies outside the grid.
    """
    nodes, triangles = grid.points, grid.triangles
    corner = nodes[triangles[:, :3]]
    d1, d2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    rel = points[:, None, :] - corner[None, :, 0]
    b1 = (rel[..., 0] * d2[:, 1] - rel[..., 1] * d2[:, 0]) / area
    b2 = (rel[..., 1] * d1[:, 0] - rel[..., 0] * d1[:, 1]) / area
    inside = np.minimum(np.minimum(b1, b2), 1.0 - b1 - b2)
    element = inside.argmax(axis=1)
    row = np.arange(len(points))
    if inside[row, element].min() < -1e-9:
        worst = points[inside[row, element].argmin()]
        raise GridError(
            f"the point ({worst[0]:.6g}, {worst[1]:.6g}) m lies outside the grid",
            code="E-GRID",
            remedy="reduce static.depth: it must stay inside the tooth",
        )
    b1, b2 = _curved_coordinates(nodes[triangles[element]], points, b1[row, element], b2[row, element])
    columns = triangles[element].T
    shape = shape_functions(b1, b2)[0]
    return csr_array((shape.ravel(), (np.tile(row, 6), columns.ravel())), shape=(len(points), len(nodes)))


def _curved_coordinates(element_nodes, points, b1, b2):
    """Reference coordinates of points in curved six-node triangles by Newton's method."""
    for _ in range(20):
        value, first, second = shape_functions(b1, b2)
        error = points - np.einsum("im,mic->mc", value, element_nodes)
        t1 = np.einsum("im,mic->mc", first, element_nodes)
        t2 = np.einsum("im,mic->mc", second, element_nodes)
        det = t1[:, 0] * t2[:, 1] - t1[:, 1] * t2[:, 0]
        step1 = (error[:, 0] * t2[:, 1] - error[:, 1] * t2[:, 0]) / det
        step2 = (t1[:, 0] * error[:, 1] - t1[:, 1] * error[:, 0]) / det
        b1, b2 = b1 + step1, b2 + step2
        if max(np.abs(step1).max(), np.abs(step2).max()) < 1e-13:
            break
    if np.minimum(np.minimum(b1, b2), 1.0 - b1 - b2).min() < -0.05:
        raise GridError("an observation point falls between curved elements", code="E-GRID")
    return b1, b2


def directional(weights, directions: np.ndarray) -> np.ndarray:
    """Displacement columns (2n, m) from sparse interpolation rows (m, n) and unit directions (m, 2)."""
    dense = weights.toarray()
    columns = np.empty((2 * dense.shape[1], dense.shape[0]))
    columns[0::2] = dense.T * directions[:, 0]
    columns[1::2] = dense.T * directions[:, 1]
    return columns


def split_sector(grid: Grid, held: str | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Free interior, right-cut and left-cut degrees of freedom of a sector, cuts ordered by radius.

    ``held`` is the boundary that cannot move, if any.
    """
    fixed = boundary_nodes(grid, held) if held else np.zeros(0, int)
    cuts = []
    for name in ("cut_right", "cut_left"):
        nodes = np.setdiff1d(boundary_nodes(grid, name), fixed)
        cuts.append(nodes[np.argsort(np.hypot(*grid.points[nodes].T))])
    interior = np.setdiff1d(np.arange(len(grid.points)), np.concatenate([fixed, *cuts]))
    return dof_pairs(interior), dof_pairs(cuts[0]), dof_pairs(cuts[1])


def cut_rotation(count: int, size: int) -> np.ndarray:
    """Block rotation (size, size) by the sector angle 2 pi / count."""
    angle = 2 * np.pi / count
    c, s = np.cos(angle), np.sin(angle)
    return np.kron(np.eye(size // 2), np.array([[c, -s], [s, c]]))


def condense_sector(
    grid: Grid, stiffness, *, count: int, held: str | None, loads: np.ndarray, observations: np.ndarray
) -> SectorSchur:
    """Condense a mirror-symmetric sector on its cuts.

    Loads and observations are given for the left half (y > 0) only; their mirror images are appended, so
    that the result has twice the number of columns.

    Parameters
    ----------
    grid : Grid
        Sector with boundaries ``cut_left``, ``cut_right`` and `held`.
    stiffness : (2n, 2n) sparse matrix
        [N/m].
    count : int
        Number of sectors.
    held : str or None
        Boundary that cannot move; None when a foundation is part of `stiffness`.
    loads : (2n, m) array
        Nodal forces of the left loads.
    observations : (2n, mo) array
        Displacement functionals of the left observations.
    """
    interior, _, left = parts = split_sector(grid, held)
    image = mirror_nodes(grid)
    adjoint = np.hstack([observations, mirrored_columns(observations, image)])[interior]
    solution = solve_interior(grid, stiffness, parts, loads)
    full = np.zeros((stiffness.shape[0], loads.shape[1]))
    full[interior] = solution.loads
    X_f = np.hstack([solution.loads, mirrored_columns(full, image)[interior]])
    nl = len(left)
    return SectorSchur(
        count=count,
        S=solution.schur.reshape(2, nl, 2, nl).transpose(0, 2, 1, 3),
        C=adjoint.T @ X_f,
        load_cut=-(solution.coupling.T @ X_f).reshape(2, nl, -1),
        observation_cut=-(solution.cut.T @ adjoint).reshape(2, nl, -1),
        rotation=cut_rotation(count, nl),
    )


@dataclass(frozen=True)
class _InteriorSolution:
    """Interior of a sector with its cuts held: ``K_ii^-1`` applied to unit cut displacements and loads."""

    factor: SuperLU  # of K_ii
    coupling: csc_array  # K_ib (ni, 2 nb), right cut first [N/m]
    cut: np.ndarray  # (ni, 2 nb)
    loads: np.ndarray  # (ni, m)
    schur: np.ndarray  # K_bb - K_ib^T K_ii^-1 K_ib (2 nb, 2 nb) [N/m]


def solve_interior(grid: Grid, stiffness, parts, loads: np.ndarray) -> _InteriorSolution:
    """Factor the interior of a mirror-symmetric sector; the right cut is the mirror image of the left.

    Parameters
    ----------
    grid : Grid
    stiffness : (2n, 2n) sparse matrix
        [N/m].
    parts : tuple of three arrays
        Interior, right and left degrees of freedom, see `split_sector`.
    loads : (2n, m) array
        Nodal forces [N], none on the cuts.

    Raises
    ------
    GridError
        A load on a cut (E-GRID), or a solution that is not finite or misses equilibrium (E-RESIDUAL).
    """
    interior, right, left = parts
    cut = np.concatenate([right, left])
    if np.any(loads[cut]):
        raise GridError("a load acts on a cut of the sector", code="E-GRID")
    stiffness = stiffness.tocsc()
    rows = stiffness[interior]
    K_ii, K_ib = rows[:, interior], rows[:, cut]
    nl = len(left)
    rhs = np.hstack([K_ib[:, nl:].toarray(), loads[interior]])
    factor = symmetric_factor(K_ii)
    solution = factor.solve(rhs)
    residual = np.abs(K_ii @ solution - rhs).max() / np.abs(rhs).max()
    if not np.isfinite(residual) or residual > 1e-8:
        raise GridError(
            f"the sector solution has a relative residual of {residual:.1e}",
            code="E-RESIDUAL",
            limit="1e-8",
            remedy="the body is not held, or its grid is distorted",
        )
    full = np.zeros((stiffness.shape[0], nl))
    full[interior] = solution[:, :nl]
    # the mirror image of a unit y displacement of the left cut is a negative one of the right cut
    reflected = mirrored_columns(full, mirror_nodes(grid))[interior] * np.tile([1.0, -1.0], nl // 2)
    X_b = np.hstack([reflected, solution[:, :nl]])
    S = stiffness[cut][:, cut].toarray() - K_ib.T @ X_b
    return _InteriorSolution(factor, K_ib, X_b, solution[:, nl:], 0.5 * (S + S.T))


def cyclic_harmonics(schur: SectorSchur, harmonics) -> np.ndarray:
    """Compliance ``H_n`` of each cyclic harmonic, shape (len(harmonics), n_observations, n_loads)."""
    Q, S = schur.rotation, schur.S
    RL, own = S[0, 1] @ Q, S[0, 0] + Q.T @ S[1, 1] @ Q
    tied_load, tied_observation = (Q.T @ part[1] for part in (schur.load_cut, schur.observation_cut))
    result = np.empty((len(harmonics), *schur.C.shape), complex)
    for row, n in enumerate(harmonics):  # one at a time: all the matrices of a deep body would take gigabytes
        phase = np.exp(2j * np.pi * n / schur.count)
        A = own + phase * RL + np.conj(phase) * RL.T
        if n % schur.count in (0, 1, schur.count - 1):  # rotation is the harmonic 0, translation the first
            values = np.linalg.eigvalsh(A)
            if values[0] < 1e-13 * values[-1]:
                raise GridError(
                    "the body can move without straining: nothing holds it",
                    code="E-GRID-FREE",
                    remedy="hold its bore or its rim, or put it on a foundation",
                )
        P_f = schur.load_cut[0] + np.conj(phase) * tied_load
        P_d = schur.observation_cut[0] + np.conj(phase) * tied_observation
        result[row] = schur.C + P_d.conj().T @ np.linalg.solve(A, P_f)
    return result


def tooth_compliance(schur: SectorSchur) -> np.ndarray:
    """Compliance between any two teeth, shape (count, n_observations, n_loads) [m/N].

    Entry ``[k]`` is the displacement on tooth ``i`` per unit load on tooth ``i - k``.
    """
    harmonics = cyclic_harmonics(schur, np.arange(schur.count // 2 + 1))
    return np.fft.irfft(harmonics, n=schur.count, axis=0)


def cyclic_displacement(grid: Grid, stiffness, loads: np.ndarray, *, held: str | None) -> np.ndarray:
    """Static displacement of every sector in its own frame.

    The loads are transformed over the sectors, each harmonic is solved on the sector with its cuts tied, and
    the solutions are transformed back.

    Parameters
    ----------
    grid, stiffness, held
        As for `condense_sector`.
    loads : (count, 2n) array
        Nodal forces of each sector in its own frame [N], none on the cuts.

    Returns
    -------
    (count, n, 2) array
        [m].
    """
    count, size = loads.shape
    inner, right, left = parts = split_sector(grid, held)
    forces = np.fft.rfft(loads, axis=0).T
    n_h, nb = forces.shape[1], len(right)
    solution = solve_interior(grid, stiffness, parts, np.hstack([forces.real, forces.imag]))
    X_f = solution.loads[:, :n_h] + 1j * solution.loads[:, n_h:]
    on_cut = -(solution.coupling.T @ X_f).T
    tie = np.empty((n_h, 2 * nb, nb), complex)
    tie[:, :nb] = np.eye(nb)
    phase = np.exp(2j * np.pi * np.arange(n_h) / count)
    tie[:, nb:] = phase[:, None, None] * cut_rotation(count, nb)
    adjoint = tie.conj().transpose(0, 2, 1)
    u_right = np.linalg.solve(adjoint @ solution.schur @ tie, adjoint @ on_cut[:, :, None])
    u_cut = (tie @ u_right)[:, :, 0]
    field = np.zeros((n_h, size), complex)
    field[:, inner] = (X_f - solution.cut @ u_cut.T).T
    field[:, np.concatenate([right, left])] = u_cut
    return np.fft.irfft(field, n=count, axis=0).reshape(count, -1, 2)
