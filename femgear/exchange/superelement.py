"""Superelements that other programs export: reduced stiffness and mass of a structure that nothing holds.

`read_superelement` reads, by the ending of the file name, the arrays ``stiffness`` and ``mass`` (``.npz``, ``.nc``),
DMIG (``.pch``, ``.bdf``, ``.dat``) or ASCII OUTPUT4 (``.op4``), as `femgear.exchange.casing_files` does, with the
table of nodes that says which node is what. Roles are ``seat NAME``, ``foot NAME`` and ``sensor NAME``. Rows of arrays
and OUTPUT4 are those of the nodes in the order of the table (``dofs``), then other coordinates.

The motions of the structure are those of a rigid body, and elastic ones on the motions of its interface, seats and
feet: static shapes of the interface, and modes with the interface held (R. R. Craig and M. C. C. Bampton, AIAA J. 6,
1968, 1313-1319). Elastic motions have no share in the momentum of the rigid ones: these are the mean motion of the
mass.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import xarray as xr
from scipy import linalg

from femgear.errors import CaseError
from femgear.exchange.casing_files import UNITS, check_array_size
from femgear.exchange.nastran_matrices import dmig_matrices, op4_matrices
from femgear.exchange.node_tables import Node, file_in_refusals, foreign_refusals, read_nodes, refuse_output2
from femgear.fe.beam import rigid_link

SUPERELEMENT_ROLES = {"seat": True, "foot": True, "sensor": True}
"""What the nodes of a superelement stand for, and that a name follows."""
RIGID_STIFFNESS = 1e15
"""Stiffness of an elastic motion of the interface from which it is rigid [N/m]."""
_ARRAYS, _PUNCH = (".npz", ".nc"), (".pch", ".bdf", ".dat")
_KINDS = (*_ARRAYS, *_PUNCH, ".op4")
_DIRECTIONS = "x", "y", "z"
# Smallest eigenvalue of a matrix, of unit diagonal, from which it is positive; part of it that digits of a file leave.
_POSITIVE, _ROUNDING = 1e-12, 1e-6
# Entry of the mass matrix over its largest one of a coordinate without mass.
_MASSLESS = 1e-14
# Part of the square of the first elastic natural frequency with which a rigid motion may swing: 1 % of the frequency.
_FREE = 1e-4


@dataclass(frozen=True)
class Superelement:
    """Reduced stiffness and mass of a structure.

    Parameters
    ----------
    stiffness, mass : (n, n) arrays
        Symmetric; along [N/m, kg] and about the axes [N m/rad, kg m^2].
    row : mapping of (int, int) to int
        Number of a coordinate by node and component, 1 to 6; others are coordinates of no node.
    place : mapping of int to (3,) array
        Places of the nodes [m].
    nodes : tuple of Node
        Table of nodes.
    asymmetry : (float, float)
        Largest difference between both halves of stiffness and mass in the file, over the largest entry.
    """

    stiffness: np.ndarray
    mass: np.ndarray
    row: Mapping[tuple[int, int], int]
    place: Mapping[int, np.ndarray]
    nodes: tuple[Node, ...]
    asymmetry: tuple[float, float] = (0.0, 0.0)

    def of_role(self, role: str) -> dict[str, Node]:
        """Find the nodes of a role by their names."""
        return {node.name: node for node in self.nodes if node.role == role}

    def components(self, node: Node) -> tuple[int, ...]:
        """List the components of a node that the matrices have, 1 to 6."""
        return tuple(c for c in range(1, 7) if (node.number, c) in self.row)

    @property
    def size(self) -> float:
        """Largest distance between two nodes of the table along an axis [m]."""
        places = np.array([self.place[node.number] for node in self.nodes])
        return float(np.ptp(places, axis=0).max())

    def rigid_motions(self, centre: np.ndarray) -> np.ndarray:
        """Compute the motions (n, 6) of all coordinates with a rigid body that moves and turns about a point (3,).

        Coordinates of no node follow the nodes as the stiffness has it.
        """
        motions = np.zeros((len(self.stiffness), 6))
        for (number, component), row in self.row.items():
            motions[row] = rigid_link(self.place[number] - centre)[component - 1]
        inner = np.setdiff1d(np.arange(len(motions)), list(self.row.values()))
        if len(inner):
            outer = np.array([*self.row.values()])
            held = self.stiffness[np.ix_(inner, outer)] @ motions[outer]
            motions[inner] = -np.linalg.lstsq(self.stiffness[np.ix_(inner, inner)], held, rcond=None)[0]
        return motions


@dataclass(frozen=True)
class ModalBody:
    """A structure as a rigid body with elastic motions.

    Parameters
    ----------
    centre : (3,) array
        Centre of mass [m].
    rigid_mass : (6, 6) array
        About the centre of mass [kg, kg m^2].
    stiffness : (m,) array
        Of the elastic motions; infinite where nothing gives way.
    mass : (m, m) array
        Of the elastic motions.
    shape : mapping of int to (6, m) array
        Elastic displacements and rotations of the nodes of the interface, and of others that were asked for, by their
        numbers; those that a node has not are zero.
    """

    centre: np.ndarray
    rigid_mass: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    shape: Mapping[int, np.ndarray]


def read_superelement(
    path: Path, nodes: Path, *, units: str = "SI", roles: Mapping[str, bool] = SUPERELEMENT_ROLES
) -> Superelement:
    """Read stiffness and mass with a table of nodes.

    Parameters
    ----------
    path : path
        See the head of this module.
    nodes : path
        Table of nodes (CSV).
    units : str
        Of the file: "SI" or "mm-t-s" (N, MPa).
    roles : mapping of str to bool
        What the nodes stand for, and whether a name follows.

    Raises
    ------
    CaseError
        As the table of nodes and matrices of `femgear.exchange.casing_files.read_casing`.
    """
    kind = path.suffix.lower()
    with file_in_refusals(path):
        refuse_output2(path)
        if not path.is_file() or kind not in _KINDS:
            raise CaseError(
                "no such file, or no kind of file that holds stiffness and mass",
                code="E-FILE",
                key="file",
                limit=f"a file {', '.join(_KINDS)}",
                remedy="export reduced stiffness and mass",
            )
        table = read_nodes(nodes, roles)
        if kind in _ARRAYS:
            matrices, row, place = _stored_matrices(path, table)
        else:
            matrices, row, place = dmig_matrices(path) if kind in _PUNCH else op4_matrices(path, table)
        return superelement_of(matrices, row, place, table, units)


def superelement_of(
    matrices: Sequence[np.ndarray],
    row: Mapping[tuple[int, int], int],
    place: Mapping[int, np.ndarray],
    table: tuple[Node, ...],
    units: str,
) -> Superelement:
    """Make the superelement of the stiffness and the mass (n, n) of a file, in its units.

    Their rows are known by node and component, places (3,) by node; ``table`` has the nodes.
    """
    _check_real(matrices)
    apart = [float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max()) for matrix in matrices]
    length, mass = UNITS[units]
    # scalar points, such as those of inner modes, have the component 0 and no place
    row = {label: at for label, at in row.items() if label[1] > 0}
    # with time in seconds a stiffness scales as a mass; rotations have no length
    scale = np.ones(len(matrices[0]))
    scale[[at for (_, component), at in row.items() if component > 3]] = length
    K, M = (0.5 * mass * np.outer(scale, scale) * np.real(matrix + matrix.T) for matrix in matrices)
    K, M, row = _without_massless(K, M, row, {node.number for node in table})
    places = dict(place) | {node.number: node.position for node in table if node.position is not None}
    _check_nodes(table, row, places)
    in_metres = {number: length * x for number, x in places.items()}
    return Superelement(K, M, row, in_metres, table, (apart[0], apart[1]))


def _without_massless(
    stiffness: np.ndarray, mass: np.ndarray, row: Mapping[tuple[int, int], int], kept: set[int]
) -> tuple[np.ndarray, np.ndarray, dict[tuple[int, int], int]]:
    """Condense coordinates that no mass moves with, but those of the nodes of the table; nothing loads them.

    Exactly, by their stiffness (R. J. Guyan, AIAA J. 3, 1965, 380): such as those of nodes at the middle of edges, or
    rotations of nodes of solids. CaseError: coordinates that neither mass nor stiffness holds (E-MECHANISM).
    """
    size = np.abs(mass).max(axis=1)
    of_table = [at for (number, _), at in row.items() if number in kept]
    light = np.setdiff1d(np.flatnonzero(size <= _MASSLESS * size.max()), of_table)
    if not len(light):
        return stiffness, mass, dict(row)
    heavy = np.setdiff1d(np.arange(len(mass)), light)
    inner = stiffness[np.ix_(light, light)]
    scale = np.sqrt(np.abs(np.diag(inner)))
    if not (scale > 0.0).all() or np.linalg.cond(inner / np.outer(scale, scale)) > 1.0 / _POSITIVE:
        raise CaseError(
            "coordinates without mass are held by nothing",
            code="E-MECHANISM",
            key="file",
            limit="stiffness or mass on every coordinate",
            remedy="leave these coordinates out of the export, or give them mass",
        )
    across = stiffness[np.ix_(light, heavy)]
    condensed = stiffness[np.ix_(heavy, heavy)] - across.T @ linalg.solve(inner, across, assume_a="sym")
    number = dict(zip(heavy.tolist(), range(len(heavy)), strict=True))
    rows = {label: number[at] for label, at in row.items() if at in number}
    return 0.5 * (condensed + condensed.T), mass[np.ix_(heavy, heavy)], rows


def _check_real(matrices: Sequence[np.ndarray]) -> None:
    """Refuse matrices that are empty, complex or not finite."""
    for matrix, name in zip(matrices, ("stiffness", "mass"), strict=True):
        if not matrix.any() or not np.isfinite(matrix).all() or np.imag(matrix).any():
            raise CaseError(
                f"the {name} matrix holds other entries than real numbers",
                code="E-TYPE",
                key="file",
                value="nothing but zeros" if not matrix.any() else "entries that are complex or not finite",
                limit="finite real numbers",
                remedy="export it again, without structural damping",
            )


def _stored_matrices(path: Path, table: Sequence[Node]) -> tuple[list[np.ndarray], dict, dict]:
    """Arrays of a file .npz or NetCDF, as `op4_matrices`."""
    with foreign_refusals("stiffness and mass (.npz, NetCDF)"):
        if path.suffix.lower() == ".npz":
            with ZipFile(path) as archive:
                check_array_size(sum(entry.file_size for entry in archive.infolist()))
            with np.load(path, allow_pickle=False) as stored:
                matrices = [np.asarray(stored[name]) for name in ("stiffness", "mass") if name in stored]
        else:
            with xr.open_dataset(path) as data:
                matrices = [data[name].values for name in ("stiffness", "mass") if name in data]
    labels = list(dict.fromkeys((node.number, int(dof)) for node in table for dof in node.dofs))
    square = len(matrices) == 2 and matrices[0].shape == matrices[1].shape == (len(matrices[0]),) * 2
    if not square or len(matrices[0]) < len(labels):
        shapes = " and ".join(str(matrix.shape) for matrix in matrices) or "none"
        raise CaseError(
            "the file does not hold stiffness and mass of the coordinates of the table",
            code="E-SHAPE",
            key="nodes",
            value=shapes,
            limit=f"arrays stiffness and mass, square, {len(labels)} rows or more",
            remedy="give all nodes of the matrices in their order, with their dofs",
        )
    return matrices, {label: i for i, label in enumerate(labels)}, {}


def _check_nodes(table: Sequence[Node], row: Mapping[tuple[int, int], int], place: Mapping[int, np.ndarray]) -> None:
    """Refuse nodes without a place, of the table or with coordinates in the matrices."""
    lost = sorted({node.number for node in table} | {number for number, _ in row})
    lost = [number for number in lost if number not in place]
    if lost:
        raise CaseError(
            "nodes without coordinates",
            code="E-KEY-MISSING",
            key="nodes",
            value=lost[:9],
            limit="x, y, z in the file or in the table",
            remedy="give x, y and z of every node of the matrices in the table",
        )


def free_body_problems(body: Superelement) -> Iterator[CaseError]:
    """List what makes a superelement no elastic body that nothing holds."""
    for role in ("seat", "foot"):
        names = [node.name for node in body.nodes if node.role == role]
        for name in dict.fromkeys(name for name in names if names.count(name) > 1):
            yield CaseError(
                f"a {role} has two nodes",
                code="E-DUPLICATE",
                key="nodes",
                value=f"{role} {name}",
                limit="one node",
                remedy="tie its surface to one node by an interpolation element, and keep that in the reduction",
            )
    for node in body.nodes:
        if node.role in ("seat", "foot") and body.components(node) not in ((1, 2, 3), (1, 2, 3, 4, 5, 6)):
            yield CaseError(
                f"the {node.role} {node.name} does not move in all directions",
                code="E-SHAPE",
                key="nodes",
                value=f"node {node.number}, components {', '.join(map(str, body.components(node))) or 'none'}",
                limit="components 1, 2 and 3, or 1 to 6, in the matrices",
                remedy="keep them in the reduction; dofs of the table are those of arrays and OUTPUT4",
            )
    yield from unsymmetric_matrices(body)
    lowest = _lowest(body.mass)
    if not lowest > _POSITIVE:
        yield CaseError(
            "the mass matrix is not positive definite",
            code="E-MASS",
            key="file",
            value=f"smallest eigenvalue {lowest:.3g} of a diagonal of 1",
            limit="mass on every coordinate",
            remedy="export a consistent mass matrix, or leave coordinates without mass out of the reduction",
        )
    lowest = _lowest(body.stiffness)
    if lowest < -_ROUNDING:
        yield CaseError(
            "the stiffness matrix has negative eigenvalues",
            code="E-MECHANISM",
            key="file",
            value=f"smallest eigenvalue {lowest:.3g} of a diagonal of 1",
            limit="zero, of rigid motions, and above",
            remedy="export it again: an entry is lost, or the matrices are of two models",
        )
    elif _lowest(body.mass) > _POSITIVE:
        yield from _held(body)


def unsymmetric_matrices(body: Superelement) -> Iterator[CaseError]:
    """List the matrices of a superelement whose halves differ by more than the digits of a file."""
    for name, apart in zip(("stiffness", "mass"), body.asymmetry, strict=True):
        if apart > _ROUNDING:
            yield CaseError(
                f"the {name} matrix is not symmetric",
                code="E-SYMMETRY",
                key="file",
                value=f"halves that are {apart:.3g} of the largest entry apart",
                limit=f"{_ROUNDING:g} of it",
                remedy="export it again, both halves of the matrix or one and its kind",
            )


def _lowest(matrix: np.ndarray) -> float:
    """Smallest eigenvalue of a matrix whose diagonal is scaled to 1; of rows of zeros zero."""
    size = np.sqrt(np.abs(np.diag(matrix)))
    size[size == 0.0] = 1.0
    return float(linalg.eigvalsh(matrix / np.outer(size, size), subset_by_index=[0, 0])[0])


def _held(body: Superelement) -> Iterator[CaseError]:
    """Refuse rigid motions that carry stiffness, and other motions that carry none."""
    rigid = body.rigid_motions(_centre(body))
    square = linalg.eigvalsh(body.stiffness, body.mass)
    first = float(square[6]) if len(square) > 6 else np.inf
    carried = np.einsum("ni,nm,mi->i", rigid, body.stiffness, rigid)
    largest = max(float(square[-1]), 1e-300)
    if len(square) > 6 and first <= _POSITIVE * largest:
        yield CaseError(
            f"{int(np.count_nonzero(square <= _POSITIVE * largest))} motions carry no stiffness",
            code="E-MECHANISM",
            key="file",
            limit="the six of a rigid body",
            remedy="join the parts of the structure, and export it as one",
        )
        return
    # digits of a file, or a small part of what the structure itself carries
    rounding = np.einsum("ni,nm,mi->i", np.abs(rigid), np.abs(body.stiffness), np.abs(rigid))
    limit = np.minimum(_ROUNDING * rounding, _FREE * first * np.einsum("ni,nm,mi->i", rigid, body.mass, rigid))
    if (carried > limit).any():
        worst = int((carried / np.maximum(limit, 1e-300)).argmax())
        unit = "N/m" if worst < 3 else "N m/rad"
        yield CaseError(
            f"a rigid motion {'along' if worst < 3 else 'about'} {_DIRECTIONS[worst % 3]} carries stiffness: something "
            "holds the structure, or coordinates of nodes are off",
            code="E-SUPPORT",
            key="file",
            value=f"{carried[worst]:.4g} {unit}",
            limit=f"below {limit[worst]:.3g} {unit}, what digits of the file may leave",
            remedy="export it without supports, and keep a node a foot (role foot NAME)",
        )


def _centre(body: Superelement) -> np.ndarray:
    """Centre of mass (3,) [m]."""
    rigid = body.rigid_motions(np.zeros(3))
    about = rigid.T @ body.mass @ rigid
    # a turn about y moves the mass along z by -x, one about x along z by y, one about y along x by z
    return np.array([-about[2, 4], about[2, 3], about[0, 4]]) / (np.trace(about[:3, :3]) / 3.0)


def modal_body(
    body: Superelement, numbers: Sequence[int], *, others: Sequence[int] = (), max_frequency: float = np.inf
) -> ModalBody:
    """Split a superelement into a rigid body and its elastic motions.

    Parameters
    ----------
    body : Superelement
        Without `free_body_problems`.
    numbers : sequence of int
        Nodes of the interface, which are loaded.
    others : sequence of int
        Further nodes whose shapes are wanted: these follow.
    max_frequency : float
        Modes with the interface held beyond it are left out [Hz]; static shapes of the interface are whole.
    """
    centre = _centre(body)
    rigid = body.rigid_motions(centre)
    count = len(body.stiffness)
    interface = np.array([body.row[number, c] for number in numbers for c in range(1, 7) if (number, c) in body.row])
    turns = np.array([c > 3 for number in numbers for c in range(1, 7) if (number, c) in body.row])
    inner = np.setdiff1d(np.arange(count), interface)
    K, M = body.stiffness, body.mass
    follow = -linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, interface)], assume_a="sym") if len(inner) else None
    statics = np.zeros((count, len(interface)))
    statics[interface, np.arange(len(interface))] = 1.0
    square, held = np.zeros(0), np.zeros((count, 0))
    if follow is not None:
        statics[inner] = follow
        square, shape = linalg.eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])
        kept = square <= (2.0 * np.pi * max_frequency) ** 2
        square, held = square[kept], np.zeros((count, int(kept.sum())))
        held[inner] = shape[:, kept]
    lever = max(body.size, 1e-3)
    scale = np.where(turns, 1.0 / lever, 1.0)
    elastic, soft = _elastic_shapes(statics.T @ K @ statics, rigid[interface], scale)
    motions = np.hstack([statics @ elastic, held])
    rigid_mass = rigid.T @ M @ rigid
    motions = motions - rigid @ np.linalg.solve(rigid_mass, rigid.T @ M @ motions)
    mass = motions.T @ M @ motions
    shapes = {}
    for number in (*numbers, *others):
        shapes[number] = np.zeros((6, motions.shape[1]))
        for c in body.components(Node(number, "", "", "", "", None)):
            shapes[number][c - 1] = motions[body.row[number, c]]
    return ModalBody(centre, 0.5 * (rigid_mass + rigid_mass.T), np.append(soft, square), 0.5 * (mass + mass.T), shapes)


def _elastic_shapes(stiffness: np.ndarray, rigid: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (b, b - 6) of the interface that are no rigid motion, each with a stiffness of its own (b - 6,) [N/m].

    ``scale`` (b,) turns rotations into lengths. Where nothing gives way the stiffness is infinite.
    """
    across = linalg.qr(rigid / scale[:, None])[0][:, 6:]  # type: ignore[index]
    scaled = across.T @ (stiffness * np.outer(scale, scale)) @ across
    values, vectors = linalg.eigh(0.5 * (scaled + scaled.T))
    return scale[:, None] * (across @ vectors), np.where(values >= RIGID_STIFFNESS, np.inf, values)
