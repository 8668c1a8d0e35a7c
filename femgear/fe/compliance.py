"""Compliance and static displacement of a cyclic body from one tooth sector, factored once.

The body is ``count`` copies of one mirror-symmetric sector, whose cut displacements are tied by
``u_L(k) = u_R(k + 1)`` in polar components. A discrete Fourier transform over the sectors (Thomas, "Dynamics
of rotationally periodic structures", Int. J. Numer. Meth. Eng. 14, 1979) decouples the body into one small
problem for each harmonic ``n``. Every field of a sector is the sum of one that is symmetric about its centre
line and of one that is antisymmetric; with ``S`` and ``A`` those of unit displacements of the left cut, the
tie makes ``a_r = i tan(n a / 2) s_r`` and ``s_t = i tan(n a / 2) a_t``. For static loads both follow from one
vector ``w``, with ``s = D_s w``, ``a = i D_a w``, ``D_s = diag(cos, -sin)``, ``D_a = diag(sin, cos)`` of
``n a / 2``, and from real matrices,

    (D_s S_S D_s + D_a S_A D_a) w = D_s P_S f_S - i D_a P_A f_A

with ``S`` the Schur complements of the half sector on its cut and ``P`` what loads exert on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import block_array, csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import SuperLU, splu

from femgear.errors import GridError
from femgear.fe.grid import Grid, boundary_edges, shape_functions

_EDGE_POINTS = np.polynomial.legendre.leggauss(6)
"""Places and weights of the integration along the edge of an element."""
_BLOCK = 2e7
"""Size of the matrices of cyclic harmonics that are in memory at a time [bytes]."""


@dataclass(frozen=True)
class SectorSchur:
    """A sector condensed on its cut, with loads and observations; symmetric fields first, then the others.

    Parameters
    ----------
    count : int
        Number of sectors in the body.
    stiffness : (2, nb, nb) array
        Schur complements for displacements of the left cut, node by node radial, tangential and, of three
        components, axial [N/m].
    compliance : (2, n_observations, n_loads) array
        With the cut held [m/N].
    load_cut : (2, nb, n_loads) array
        Forces on the held cut per unit load.
    observation_cut : (2, nb, n_observations) array
        Observations per unit displacement of the cut.
    components : int
        Of the displacement of a node.
    """

    count: int
    stiffness: np.ndarray
    compliance: np.ndarray
    load_cut: np.ndarray
    observation_cut: np.ndarray
    components: int = 2

    def observed(self, observations: slice) -> SectorSchur:
        """Give the same sector with some of the observations."""
        return replace(
            self,
            compliance=self.compliance[:, observations],
            observation_cut=self.observation_cut[..., observations],
        )

    def packed(self) -> SectorSchur:
        """Give the same sector with arrays in the order of their axes, as a copy from another process has them.

        Products round by the order in memory: so that they are the same wherever the sector was condensed.
        """
        return replace(
            self,
            compliance=np.ascontiguousarray(self.compliance),
            load_cut=np.ascontiguousarray(self.load_cut),
            observation_cut=np.ascontiguousarray(self.observation_cut),
        )

    def at_distribution(self, weights: np.ndarray, side: float = 1.0) -> SectorSchur:
        """Give one load of the weights (n_loads,), seen where it acts; loads must be their own observations.

        ``side`` -1 is the image of that load.
        """
        signs = np.array([1.0, side])[:, None, None]
        compliance = weights @ self.compliance @ weights
        cut = signs * (self.load_cut @ weights)[..., None]
        return replace(self, compliance=compliance[:, None, None], load_cut=cut, observation_cut=cut)


@dataclass(frozen=True)
class FreeSector:
    """A sector condensed on its cut and on its rim, which is free; symmetric fields first, then the others.

    Parameters
    ----------
    count : int
        Number of sectors in the body.
    fields : two sparse (2n, m) matrices
        Displacement per unknown of the rim and, behind them, of the cut.
    on_rim : two (m,) bool arrays
        Which of these move the rim, its corner on the cut included.
    schur : two arrays
        Schur complements on these unknowns, the loads and the observations.
    cut : int
        Number of those of the cut.
    sizes : (int, int)
        Number of loads and of observations.
    components : int
        Of the displacement of a node.
    """

    count: int
    fields: tuple[csc_array, ...]
    on_rim: tuple[np.ndarray, ...]
    schur: tuple[np.ndarray, ...]
    cut: int
    sizes: tuple[int, int]
    components: int = 2

    def supported(self, foundation=None) -> SectorSchur:
        """Hold the rim, or put the sector on a foundation, a sparse matrix (2n, 2n) on the rim [N/m]."""
        f, d = np.split(np.arange(sum(self.sizes)), self.sizes[:1])
        parts = []
        for fields, on_rim, schur in zip(self.fields, self.on_rim, self.schur, strict=True):
            size, r = len(on_rim), len(on_rim) - self.cut
            if foundation is None:
                keep = np.concatenate([np.flatnonzero(~on_rim), np.arange(size, len(schur))])
                schur = schur[np.ix_(keep, keep)]
            else:
                schur = schur.copy()
                schur[:size, :size] += (fields.T @ foundation @ fields).toarray()
                schur = schur[r:, r:] - schur[r:, :r] @ np.linalg.solve(schur[:r, :r], schur[:r, r:])
            nb = len(schur) - len(f) - len(d)
            K, P, C = schur[:nb, :nb], schur[:nb, nb:], -schur[nb:, nb:]
            parts.append((0.5 * (K + K.T), C[np.ix_(d, f)], P[:, f], P[:, d]))
        parts = (np.stack(part) for part in zip(*parts, strict=True))
        return SectorSchur(self.count, *parts, components=self.components)


def symmetric_factor(matrix, *, ordering: str = "MMD_AT_PLUS_A") -> SuperLU:
    """Factor a sparse symmetric stiffness matrix [N/m] (SuperLU in symmetric mode).

    GridError where the matrix is singular: the body can move without straining.
    """
    options = {"SymmetricMode": True}
    try:
        return splu(matrix.tocsc(), permc_spec=ordering, diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:
        raise GridError(
            f"the stiffness matrix of a sector is singular ({error})",
            code="E-SOLVE",
            remedy="hold the bore, the rim or a foundation so that the body cannot move freely",
        ) from error


def node_dofs(nodes, components: int = 2) -> np.ndarray:
    """Degrees of freedom (x, y and, of three components, z, node by node) of an array of nodes."""
    return (components * np.asarray(nodes)[:, None] + np.arange(components)).ravel()


def boundary_nodes(grid: Grid, name: str) -> np.ndarray:
    """Sorted unique node numbers (k,) of a named boundary."""
    return np.unique(grid.boundaries[name])


def mirror_nodes(grid: Grid) -> np.ndarray:
    """Permutation that maps every node of a symmetric grid to its mirror image in the x axis, shape (n,)."""
    points, mirrored = np.asarray(grid.points), grid.points * np.array([1.0, -1.0])
    image = np.empty(len(points), int)
    image[np.lexsort(mirrored.T)] = np.lexsort(points.T)
    if np.array_equal(points[image], mirrored):
        return image
    from scipy.spatial import KDTree  # takes long to import, and grids of `mirror` are symmetric to the bit

    return np.asarray(KDTree(points).query(mirrored)[1])


def mirrored_columns(columns: np.ndarray, image: np.ndarray) -> np.ndarray:
    """Reflect displacement or load columns (2n, m) in the x axis, to (2n, m); ``image`` (n,) is of `mirror_nodes`."""
    result = np.empty_like(columns)
    result[2 * image] = columns[0::2]
    result[2 * image + 1] = -columns[1::2]
    return result


def interpolation(grid: Grid, points: np.ndarray):
    """Quadratic interpolation from the grid nodes to points (m, 2) inside [m], a sparse (m, n) array.

    GridError where a point lies outside the grid.
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
        raise GridError(
            "an observation point falls between curved elements",
            code="E-GRID",
            remedy="try another static.flank_elements or static.depth",
        )
    return b1, b2


def directional(weights, directions: np.ndarray) -> np.ndarray:
    """Displacement columns (2n, m) from sparse interpolation rows (m, n) and unit directions (m, 2)."""
    dense = weights.toarray()
    columns = np.empty((2 * dense.shape[1], dense.shape[0]))
    columns[0::2] = dense.T * directions[:, 0]
    columns[1::2] = dense.T * directions[:, 1]
    return columns


def condense_sector(
    grid: Grid, stiffness, *, count: int, rim: str | None, loads: np.ndarray, observations: np.ndarray
) -> FreeSector:
    """Condense a mirror-symmetric sector on its cut and its rim, which is held or supported afterwards.

    Loads and observations are unknowns behind those of the cut: one factor holds the Schur complement of all.
    The signs on its diagonal make it quasidefinite, which needs no pivoting (Vanderbei, SIAM J. Optim. 5,
    1995).

    GridError: a load on a cut (E-GRID), or a solution that is not finite or misses equilibrium (E-RESIDUAL).

    Parameters
    ----------
    grid : Grid
        Sector with boundaries ``cut_left``, ``cut_right`` and `rim`.
    stiffness : (2n, 2n) or (3n, 3n) sparse matrix
        [N/m]; of three components as `femgear.fe.elasticity.wave_stiffness` gives it.
    count : int
        Number of sectors.
    rim : str or None
        Boundary that will be held or supported; None when a foundation is part of `stiffness`.
    loads : (2n, m) array
        Nodal forces, none on the cuts; the images of these loads are understood.
    observations : (2n, mo) array
        Displacement functionals; the images of these are understood.
    """
    options = {"count": count, "rim": rim, "loads": loads, "observations": observations}
    return condense_sums(grid, (stiffness,), np.ones((1, 1)), **options)[0]


def condense_sums(
    grid: Grid, parts, factors, *, count: int, rim: str | None, loads: np.ndarray, observations: np.ndarray
) -> list[FreeSector]:
    """Condense a sector, as `condense_sector` does, for stiffnesses that are sums of the same parts.

    ``parts`` are k sparse matrices (2n, 2n), ``factors`` (m, k) those of each of the m sums; loads (2n, ml) and
    observations (2n, mo) are common to all.
    """
    cut = np.concatenate([boundary_nodes(grid, f"cut_{side}") for side in ("right", "left")])
    components = parts[0].shape[0] // grid.n_nodes
    check_loads(loads, node_dofs(cut, components))
    columns = csc_array(np.hstack([loads, observations]))
    nodes = node_dofs(boundary_nodes(grid, rim), components) if rim else []
    edges, on_rim, schurs = [], [], []
    for fields, inner in _half_sector_fields(grid, None, rim, components):
        back = csr_array(fields.T)
        schurs.append(_schur_complements([back @ part @ fields for part in parts], factors, back @ columns, inner))
        edges.append(fields[:, inner:])
        on_rim.append(abs(csr_array(edges[-1])[nodes]).sum(axis=0) > 0)
    nb, sizes = components * len(boundary_nodes(grid, "cut_left")), (loads.shape[1], observations.shape[1])
    return [
        FreeSector(count, tuple(edges), tuple(on_rim), schur, nb, sizes, components)
        for schur in zip(*schurs, strict=True)
    ]


def check_loads(loads: np.ndarray, cut: np.ndarray) -> None:
    """Refuse loads (2n, m) [N] that act on degrees of freedom (k,) of the cuts (`GridError`, E-GRID)."""
    if np.any(loads[cut]):
        raise GridError("a load acts on a cut of the sector", code="E-GRID", remedy="load nodes of the flanks alone")


def check_sector_residual(residual: float) -> None:
    """Refuse a solution of a sector whose largest relative residual is not small (`GridError`, E-RESIDUAL)."""
    if not residual <= 1e-8:
        raise GridError(
            f"the sector solution has a relative residual of {residual:.1e}",
            code="E-RESIDUAL",
            limit="1e-8",
            remedy="the body is not held, or its grid is distorted",
        )


def _half_sector_fields(
    grid: Grid, held: str | None, last: str | None = None, components: int = 2
) -> list[tuple[csc_array, int]]:
    """Symmetric and antisymmetric displacements of a sector from those of its left half.

    Matrices (2n, m) from the unknowns of the half sector, in an order that keeps their factor sparse and the
    radial and tangential displacements of the cut last, and the number of those before the cut; before the
    boundary ``last``, where there is one, whose unknowns are the next to the last.
    """
    image, points = mirror_nodes(grid), np.asarray(grid.points)
    fixed = boundary_nodes(grid, held) if held else np.zeros(0, int)
    cut = np.setdiff1d(boundary_nodes(grid, "cut_left"), fixed)
    cut = cut[np.argsort(np.hypot(*points[cut].T))]
    on_axis = image == np.arange(len(points))
    left = on_axis | (points[:, 1] > 0)
    left[np.concatenate([fixed, cut])] = False
    rim = np.zeros(0, int) if last is None else boundary_nodes(grid, last)
    rim = rim[left[rim]]
    left[rim] = False
    inner = np.flatnonzero(left)
    inner = np.concatenate([inner[_sparse_order(grid.triangles, inner, len(points))], rim])
    cos, sin = points[cut].T / np.hypot(*points[cut].T)
    # unknowns of the inner nodes, then radial, tangential and axial ones of the cut
    turn = np.zeros((len(cut), components, components)) + np.eye(components)
    turn[:, :2, :2] = np.stack([cos, -sin, sin, cos], axis=-1).reshape(-1, 2, 2)
    at, on_cut = np.split(np.arange(components * (len(inner) + len(cut))), [components * len(inner)])
    rows = np.concatenate([node_dofs(inner, components), np.repeat(node_dofs(cut, components), components)])
    columns = np.tile(on_cut.reshape(-1, 1, components), (1, components, 1))
    entries = np.append(np.ones(len(at)), turn), (rows, np.append(at, columns))
    half = csr_array(entries, shape=(components * len(points), len(at) + len(on_cut)))
    # of a node on the centre line both are one displacement, and the other one is zero
    once = diags_array(1.0 / np.repeat(1.0 + on_axis, components))
    mirrored = np.array([1.0, -1.0, 1.0])[:components]
    of_halves = []
    for sign in (1.0, -1.0):
        reflected = diags_array(np.tile(sign * mirrored, len(points))) @ half[node_dofs(image, components)]
        fields = csc_array(once @ (half + reflected))
        moved = np.flatnonzero(abs(fields).sum(axis=0))
        of_halves.append((fields[:, moved], int((moved < len(at) - components * len(rim)).sum())))
    return of_halves


def _sparse_order(triangles, nodes, count: int) -> np.ndarray:
    """Order of some of `count` nodes in which their stiffness has a sparse factor (minimum degree)."""
    at = np.repeat(np.arange(len(triangles)), triangles.shape[1])
    incidence = csr_array((np.ones(triangles.size), (at, triangles.ravel())), shape=(len(triangles), count))
    incidence = incidence[:, nodes]
    graph = incidence.T @ incidence + triangles.size * eye_array(len(nodes))
    return np.argsort(symmetric_factor(graph).perm_c)


def _schur_complements(parts, factors, columns, inner: int) -> list[np.ndarray]:
    """Schur complements of ``[[matrix, columns], [columns^T, 0]]`` on all but the first `inner` unknowns.

    The matrices are sums of the ``parts`` with each row of ``factors`` (m, parts). What is added to the
    diagonal of the others and the length of the columns are in proportion to them: a part of its own.
    """
    size, count = columns.shape
    length = np.sqrt((columns * columns).sum(axis=0))
    length = np.where(length > 0, length, 1.0)
    columns = csc_array(columns @ diags_array(1.0 / length))
    signs = np.where(np.arange(size + count) < size, 1.0, -1.0)
    signs[:inner] = 0.0
    border = block_array([[diags_array(signs[:size]), columns], [columns.T, diags_array(signs[size:])]])
    of_diagonal = [part.diagonal()[:inner].mean() for part in parts]
    whole, values = _one_pattern([*parts, border], size + count)
    last, complements = slice(inner, None), []
    right = np.zeros(size + count)
    right[last] = np.random.default_rng(0).standard_normal(size + count - inner)
    for row in np.asarray(factors, float):
        diagonal = float(row @ of_diagonal)
        whole.data = np.append(row, diagonal) @ values
        factor = symmetric_factor(whole, ordering="NATURAL")
        schur = _last_columns(factor.L, inner) @ _last_columns(factor.U, inner)
        # by the factor and by its last part alone
        solution = factor.solve(right)
        missed = whole @ solution - right, schur @ solution[last] - right[last]
        check_sector_residual(max(np.abs(residual).max() for residual in missed))
        schur -= np.diag(diagonal * signs[last])
        unscale = np.append(np.ones(size - inner), length / diagonal)
        complements.append(unscale[:, None] * schur * unscale)
    return complements


def _one_pattern(parts, size: int) -> tuple[csc_array, np.ndarray]:
    """Matrix (size, size) with all entries that some part has, and their values in each, (k, entries)."""
    entries = [csc_array(part) for part in parts]
    for part in entries:
        part.sum_duplicates()
    ones = [_enlarged(entry, size) for entry in entries]
    whole = csc_array(sum(ones[1:], start=ones[0]))
    # entries by their numbers, of which every part picks its own
    whole.data = np.arange(1.0, whole.nnz + 1.0)
    values = np.zeros((len(parts), whole.nnz))
    for row, pattern, part in zip(values, ones, entries, strict=True):
        row[pattern.multiply(whole).tocsc().data.astype(int) - 1] = part.data
    return whole, values


def _enlarged(matrix: csc_array, size: int) -> csc_array:
    """Ones where a sparse matrix has entries, with rows and columns without any behind them."""
    columns = matrix.indptr.size - 1
    starts = np.append(matrix.indptr, np.full(size - columns, matrix.indptr[-1]))
    return csc_array((np.ones(matrix.nnz), matrix.indices, starts), shape=(size, size))


def _last_columns(matrix: csc_array, inner: int) -> np.ndarray:
    """Entries of a sparse matrix beyond its first `inner` rows and columns, dense."""
    start, count = matrix.indptr[inner], matrix.indptr.size - 1 - inner
    rows, corner = matrix.indices[start:], np.zeros((count, count))
    columns = np.repeat(np.arange(count), np.diff(matrix.indptr[inner:]))
    beyond = rows >= inner
    corner[rows[beyond] - inner, columns[beyond]] = matrix.data[start:][beyond]
    return corner


@dataclass(frozen=True)
class CondensedHalfSector:
    """Symmetric or antisymmetric fields ``fields @ (interior, cut)`` of a sector, factored with the cut held.

    Parameters
    ----------
    fields : (2n, m) sparse matrix
        Displacement of the sector per unknown of its left half; those of the cut come last, radial and
        tangential node by node.
    stiffness : (m, m) sparse matrix
        [N/m].
    inner : int
        Number of unknowns before those of the cut.
    """

    fields: csc_array
    stiffness: csc_array
    inner: int

    @cached_property
    def interior(self) -> csc_array:
        """Stiffness of the interior, (inner, inner) [N/m]."""
        return self.stiffness[: self.inner, : self.inner]

    @cached_property
    def factor(self) -> SuperLU:
        """Factor of the interior."""
        return symmetric_factor(self.interior, ordering="NATURAL")

    def held(self, forces: np.ndarray) -> np.ndarray:
        """Displacement (inner, k) [m] of the interior under forces (inner, k) [N] on it, the cut held.

        GridError: E-RESIDUAL: the solution is not finite or misses equilibrium.
        """
        solution = self.factor.solve(forces)
        # column by column: stiffnesses are many powers of ten larger than unit loads
        missed = self.interior @ solution - forces
        largest = np.abs(forces).max(axis=0)
        check_sector_residual((np.abs(missed).max(axis=0) / np.where(largest == 0.0, 1.0, largest)).max())
        return solution

    def on_cut(self, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (inner, k) of the interior per unit of shapes (nb, k) of the cut; their stiffness."""
        coupling = self.stiffness[: self.inner, self.inner :] @ shapes
        interior = -self.held(coupling)
        schur = shapes.T @ (self.stiffness[self.inner :, self.inner :] @ shapes) + coupling.T @ interior
        return interior, 0.5 * (schur + schur.T)


def half_sectors(grid: Grid, stiffness, held: str | None) -> list[CondensedHalfSector]:
    """Split a mirror-symmetric sector into its symmetric and its antisymmetric fields.

    ``held`` is the boundary that cannot move, if any.
    """
    return [
        CondensedHalfSector(fields, csc_array(fields.T @ stiffness @ fields), inner)
        for fields, inner in _half_sector_fields(grid, held)
    ]


def cut_ties(nodal_diameter: float, count: int, size: int, components: int = 2) -> np.ndarray:
    """Displacements (2, size) of a cut per unit of ``w``: symmetric ones, antisymmetric ones over ``i``."""
    turn = np.pi * nodal_diameter / count
    cos, sin = np.cos(turn), np.sin(turn)
    # what moves along the axis is tied as what moves radially: the mirror turns neither round
    ties = np.array([[cos, -sin, cos], [sin, cos, sin]])[:, :components]
    return np.tile(ties, size // components)


def _tied(schur: SectorSchur, n) -> tuple[np.ndarray, np.ndarray]:
    """Ties (2, nb, 1) of a harmonic, and the stiffness (nb, nb) of its ``w`` [N/m]."""
    ties = cut_ties(n, schur.count, schur.stiffness.shape[1], schur.components)[..., None]
    return ties, (ties * schur.stiffness * ties.transpose(0, 2, 1)).sum(axis=0)


def static_cut_shapes(schur: SectorSchur, harmonics) -> np.ndarray:
    """Compute how the nodes of the cut move under the loads: radial and tangential parts, (nb / 2, k) [m/N].

    Of the symmetric and the antisymmetric part of every load in each cyclic harmonic.
    """
    shapes = []
    for n in harmonics:
        ties, A = _tied(schur, n)
        shapes.append(np.linalg.solve(A, np.concatenate(ties * schur.load_cut, axis=1)))
    return np.hstack([np.hstack([shape[0::2], shape[1::2]]) for shape in shapes])


def sector_harmonics(schur: SectorSchur, harmonics) -> np.ndarray:
    """Compute the compliance [m/N] of each cyclic harmonic.

    It is a complex array (n_harmonics, 2 n_observations, 2 n_loads): with the images of all observations behind
    them, and those of all loads.

    GridError: E-GRID-FREE: the body can move freely.
    """
    observed, loaded = schur.compliance.shape[1:]
    result = np.empty((len(harmonics), 2, observed, 2, loaded), complex)
    # the image of an observation or a load takes antisymmetric fields the other way
    seen, acting = np.array([1.0, -1.0])[:, None, None, None], np.array([1.0, -1.0])[:, None]
    harmonics = np.asarray(harmonics)
    ties = np.array([cut_ties(n, schur.count, schur.stiffness.shape[1], schur.components) for n in harmonics])
    # a block at a time: all the matrices of a deep body would take gigabytes
    size = 8.0 * ties.shape[-1] * (ties.shape[-1] + 4 * (loaded + observed))
    for rows in np.array_split(np.arange(len(harmonics)), -(-len(harmonics) * size // _BLOCK) or 1):
        tie = ties[rows][..., None]
        A, part = (tie[:, i] * schur.stiffness[i] for i in (0, 1))
        A *= tie[:, 0].swapaxes(1, 2)
        part *= tie[:, 1].swapaxes(1, 2)
        A += part
        # rotation is the harmonic 0, translation the first
        rigid = np.isin(harmonics[rows] % schur.count, (0, 1, schur.count - 1))
        values = np.linalg.eigvalsh(A[rigid])
        if (values[:, 0] < 1e-13 * values[:, -1]).any():
            raise GridError(
                "the body can move without straining: nothing holds it",
                code="E-GRID-FREE",
                remedy="hold its bore or its rim, or put it on a foundation",
            )
        loads, observations = (
            (tie * cut).swapaxes(1, 2).reshape(*A.shape[:2], -1) for cut in (schur.load_cut, schur.observation_cut)
        )
        tied = observations.swapaxes(1, 2) @ np.linalg.solve(A, loads)
        tied = tied.reshape(-1, 2, observed, 1, 2, loaded)
        symmetric, antisymmetric = (schur.compliance[i, :, None] + tied[:, i, :, :, i] for i in (0, 1))
        result[rows] = symmetric[:, None] + seen * acting * antisymmetric[:, None]
        result[rows] += 1j * (seen * tied[:, None, 1, :, :, 0] - acting * tied[:, None, 0, :, :, 1])
    return result.reshape(len(harmonics), 2 * observed, 2 * loaded)


def tooth_compliance(schur: SectorSchur) -> np.ndarray:
    """Compliance between any two teeth, shape (count, n_observations, n_loads) [m/N].

    Entry ``[k]`` is the displacement on tooth ``i`` per unit load on tooth ``i - k``.
    """
    harmonics = sector_harmonics(schur, np.arange(schur.count // 2 + 1))
    return np.fft.irfft(harmonics, n=schur.count, axis=0)


def cyclic_displacement(grid: Grid, stiffness, loads: np.ndarray, *, held: str | None) -> np.ndarray:
    """Static displacement (count, n, 2) of every sector in its own frame [m].

    The loads are transformed over the sectors, each harmonic is solved on the sector with its cuts tied, and
    the solutions are transformed back.

    Parameters
    ----------
    grid, stiffness, held
        As for `condense_sector`.
    loads : (count, 2n) array
        Nodal forces of each sector in its own frame [N], none on the cuts.
    """
    count = len(loads)
    forces = np.fft.rfft(loads, axis=0).T
    sectors, n_h = half_sectors(grid, stiffness, held), forces.shape[1]
    solved, pulls, schurs = [], [], []
    for sector in sectors:
        on_sector = sector.fields.T @ forces
        parts = on_sector[: sector.inner]
        solution = sector.held(np.hstack([parts.real, parts.imag]))
        interior, schur = sector.on_cut(np.eye(len(on_sector) - sector.inner))
        solved.append((interior, solution[:, :n_h] + 1j * solution[:, n_h:]))
        pulls.append(on_sector[sector.inner :] + interior.T @ parts)
        schurs.append(schur)
    on_cut = np.empty((2, len(schurs[0]), n_h), complex)
    for n in range(n_h):
        ties = cut_ties(n, count, len(schurs[0]))
        tied = sum(tie[:, None] * schur * tie for tie, schur in zip(ties, schurs, strict=True))
        w = np.linalg.solve(tied, ties[0] * pulls[0][:, n] - 1j * ties[1] * pulls[1][:, n])
        on_cut[:, :, n] = ties[0] * w, 1j * ties[1] * w
    field = sum(
        sector.fields @ np.vstack([interior_solution + interior @ cut, cut])
        for sector, (interior, interior_solution), cut in zip(sectors, solved, on_cut, strict=True)
    )
    return np.fft.irfft(field, n=count, axis=1).T.reshape(count, -1, 2)


def rim_compliance(grid: Grid, stiffness, *, count: int, orders) -> np.ndarray:
    """Compute the static compliance of the rim for waves of radial and tangential traction around it.

    Each moves neighbouring sectors with one phase: a small problem of its own.

    Parameters
    ----------
    grid : Grid
        Sector about the x axis with boundaries ``cut_left``, ``cut_right`` and ``rim``.
    stiffness : (2n, 2n) sparse matrix
        [N/m]; a foundation, if any, is part of it.
    count : int
        Number of sectors.
    orders : (m,) int array
        Circumferential orders nu.

    Returns
    -------
    (m, 2, 2) complex array
        ``C`` of the mean ``u_i = sum_nu C_ij exp(i nu (phi - phi_0))`` at the angle phi under a unit force
        at phi_0, i and j radial, then tangential [m/N].
    """
    cuts = [_by_radius(grid, boundary_nodes(grid, f"cut_{side}")) for side in ("right", "left")]
    inside = np.setdiff1d(boundary_nodes(grid, "rim"), np.concatenate(cuts))
    kept = np.concatenate([node_dofs(cuts[0]), node_dofs(cuts[1]), node_dofs(inside)])
    turn, size = np.pi / count, 2 * len(cuts[0])
    right = np.kron(np.eye(len(cuts[0])), [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    polar = block_array([[right, None, None], [None, right.T, None], [None, None, eye_array(2 * len(inside))]])
    polar = polar.toarray()
    schur, compliance = polar.T @ _condensed(stiffness, kept) @ polar, np.empty((len(orders), 2, 2), complex)
    rest = np.r_[:size, 2 * size : len(kept)]
    for i, order in enumerate(orders):
        lag = np.exp(2j * turn * order)
        # the left cut moves as the right one of the next sector
        load, both = polar.T @ _wave(grid, order)[kept], schur[:, rest].astype(complex)
        both[:, :size] += lag * schur[:, size : 2 * size]
        load[:size] += lag.conjugate() * load[size : 2 * size]
        both[:size] += lag.conjugate() * both[size : 2 * size]
        compliance[i] = load[rest].conj().T @ np.linalg.solve(both[rest], load[rest])
    return compliance * count / (4.0 * np.pi**2)


def _by_radius(grid: Grid, nodes: np.ndarray) -> np.ndarray:
    return nodes[np.argsort(np.hypot(*grid.points[nodes].T))]


def _condensed(stiffness, kept: np.ndarray) -> np.ndarray:
    """Schur complement of a sparse stiffness on some degrees of freedom."""
    matrix: Any = csc_array(stiffness)
    inner = np.setdiff1d(np.arange(matrix.shape[0]), kept)
    across = matrix[inner][:, kept].toarray()
    return matrix[kept][:, kept].toarray() - across.T @ symmetric_factor(matrix[inner][:, inner]).solve(across)


def _wave(grid: Grid, order: int) -> np.ndarray:
    """Nodal forces (2n, 2) of radial and tangential waves of one newton a radian on the rim of a sector."""
    edges, (place, weight) = boundary_edges(grid, "rim"), _EDGE_POINTS
    shape = np.stack([0.5 * place * (place - 1.0), 0.5 * place * (place + 1.0), 1.0 - place**2])
    slope = np.stack([place - 0.5, place + 0.5, -2.0 * place])
    points = grid.points[edges]
    x, y = np.moveaxis(np.einsum("aq,eac->eqc", shape, points), -1, 0)
    dx, dy = np.moveaxis(np.einsum("aq,eac->eqc", slope, points), -1, 0)
    angle, turned = np.arctan2(y, x), np.abs(x * dy - y * dx) / (x**2 + y**2)
    wave = np.exp(1j * order * angle) * turned * weight
    out = np.stack([np.cos(angle), np.sin(angle)]), np.stack([-np.sin(angle), np.cos(angle)])
    edge_load = np.zeros((2 * grid.n_nodes, 2), complex)
    for column, direction in enumerate(out):
        for axis in range(2):
            forces = np.einsum("aq,eq->ea", shape, wave * direction[axis])
            np.add.at(edge_load[:, column], 2 * edges + axis, forces)
    return edge_load
