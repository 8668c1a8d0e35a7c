"""Planet carriers that somebody else has meshed, as superelements: matrices at the shaft's seat and at the pins.

`read_carrier` reads reduced stiffness and mass, by the ending of the file name,

* ``.npz``: arrays ``stiffness`` and ``mass`` (r, r); of every node ``role``, ``position`` (x, y, z), and ``dofs``, such
  as ``"123456"`` (all six where left out); rows are those of the nodes in their order, other coordinates after them;
* arrays, DMIG and ASCII OP4 with a table of nodes (CSV), as `femgear.exchange.superelement` does.

Roles: ``shaft``, the seat on the shaft, of six components; ``pin 1`` to ``pin N`` in the order of the planets, where
the planets sit, of three or six components alike. All other coordinates are free. The carrier is held nowhere, and
its axis is z.

They are reduced to the fixed-interface form: static motions of the seats, and normal modes with all seats held (R. R.
Craig and M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from zipfile import ZipFile

import numpy as np
from scipy.linalg import eigh

from femgear.errors import CaseError, several
from femgear.exchange.casing_files import check_array_size
from femgear.exchange.node_tables import Node, file_in_refusals, foreign_refusals
from femgear.exchange.superelement import (
    Superelement,
    read_superelement,
    superelement_of,
    unsymmetric_matrices,
)
from femgear.fe.beam import rigid_link

CARRIER_ROLES = {"shaft": False, "pin": True}
"""What the nodes of a carrier stand for, and whether a name follows."""
_ALL = (1, 2, 3, 4, 5, 6)
_MOST_MODES = 60
_RIGID_FORCE = 1e-5  # of rigid motions over that of motions of one seat: files hold 7 to 16 digits
_MASSLESS = 1e-12  # of the largest compliance with mass: a coordinate without mass


@dataclass(frozen=True)
class CarrierBody:
    """A carrier at its shaft's seat and its N pins, of d = 3 or 6 motions each, and m inner modes; in SI units.

    Parameters
    ----------
    seat : (3,) array
        Place of the seat on the shaft [m].
    pins : (N, 3) array
        Places of the pins [m].
    compliance : (d N, d N) array
        Of the pins, along and about x, y, z, with the seat held [m/N, rad/N, rad/(N m)].
    mass : (6 + d N, 6 + d N) array
        Of the static motions of seat and pins [kg, kg m, kg m^2].
    frequency : (m,) array
        Natural angular frequencies of the inner modes, all seats held [rad/s].
    coupling : (6 + d N, m) array
        Mass between the static motions and the inner modes, which are normalised to unit modal mass [kg^1/2, kg^1/2 m].
    """

    seat: np.ndarray
    pins: np.ndarray
    compliance: np.ndarray
    mass: np.ndarray
    frequency: np.ndarray
    coupling: np.ndarray


def read_carrier(path: Path, *, nodes: Path | None = None, units: str = "SI") -> CarrierBody:
    """Read a carrier from arrays or matrices, the kind told by the ending of the file name.

    Parameters
    ----------
    path : path
        See the head of this module.
    nodes : path, optional
        The table of nodes that DMIG and OP4 need.
    units : str
        Of the file: "SI" or "mm-t-s" (N, MPa).

    Raises
    ------
    CaseError
        E-FILE, E-KEY-MISSING, E-COUNT (seats), E-SHAPE, E-SYMMETRY, E-TYPE (complex), E-SUPPORT (held somewhere, or
        springs to the ground), E-MECHANISM (nothing holds a motion), E-MASS.
    """
    with file_in_refusals(path):
        if nodes is not None:
            return _body(read_superelement(path, nodes, units=units, roles=CARRIER_ROLES))
        if not path.is_file() or path.suffix.lower() != ".npz":
            raise CaseError(
                "no such file, or matrices that do not say where shaft and pins are",
                code="E-FILE",
                value=path.name,
                limit="a file .npz that says it, or .npz, .nc, .pch, .bdf, .dat, .op4 with a table of nodes (CSV)",
                remedy='export reduced stiffness and mass, and name the table, as in nodes = "carrier.csv"',
            )
        return _body(superelement_of(*_arrays(path), units))


def _arrays(path: Path) -> tuple[list[np.ndarray], dict, dict, tuple[Node, ...]]:
    """Stiffness and mass, rows by node and component, places and nodes of a file .npz that says them all."""
    names = ("stiffness", "mass", "role", "position")
    with foreign_refusals("arrays of a carrier (.npz)"):
        with ZipFile(path) as archive:
            check_array_size(sum(entry.file_size for entry in archive.infolist()))
        with np.load(path, allow_pickle=False) as stored:
            lacking = [name for name in names if name not in stored]
            arrays = {name: stored[name] for name in (*names, "dofs") if name in stored}
    if lacking:
        raise CaseError(
            f"the file lacks {', '.join(lacking)}",
            code="E-KEY-MISSING",
            key=lacking[0],
            limit=", ".join(names),
            remedy="save them by these names (numpy.savez)",
        )
    roles, places = [str(role) for role in np.atleast_1d(arrays["role"])], arrays["position"]
    dofs = [str(dof) for dof in np.atleast_1d(arrays.get("dofs", np.full(len(roles), "123456")))]
    if np.shape(places) != (len(roles), 3) or len(dofs) != len(roles):
        raise CaseError(
            "role, position and dofs do not say the same number of nodes",
            code="E-SHAPE",
            key="position",
            value=f"{len(roles)} roles, positions {np.shape(places)}, {len(dofs)} dofs",
            limit="a role, three coordinates and the dofs of every node",
            remedy="save one row a node",
        )
    words = (role.partition(" ") for role in roles)
    table = tuple(
        Node(number, kind, name, "", dof, np.asarray(place, float))
        for number, ((kind, _, name), dof, place) in enumerate(zip(words, dofs, places, strict=True), 1)
    )
    labels = [(node.number, int(component)) for node in table for component in node.dofs if component in "123456"]
    matrices = [np.atleast_2d(arrays[name]) for name in ("stiffness", "mass")]
    sizes = {side for matrix in matrices for side in matrix.shape}
    if len(sizes) != 1 or max(sizes) < len(labels):
        raise CaseError(
            f"matrices of {matrices[0].shape} and {matrices[1].shape} do not fit {len(labels)} components of nodes",
            code="E-SHAPE",
            key="dofs",
            limit=f"square, of one size, {len(labels)} rows or more",
            remedy="give all nodes in the order of the matrices, with their dofs",
        )
    return matrices, {label: i for i, label in enumerate(labels)}, {}, table


def _body(element: Superelement) -> CarrierBody:
    """Reduce a superelement to seat, pins and inner modes."""
    if unsymmetric := [*unsymmetric_matrices(element)]:
        raise several(unsymmetric)
    seats, components = _seats(element)
    rows = [element.row[node.number, c] for node, count in zip(seats, components) for c in range(1, count + 1)]
    places = np.array([element.place[node.number] for node in seats])
    return _reduced(element.stiffness, element.mass, np.array(rows), places, components[-1])


def _seats(element: Superelement) -> tuple[list[Node], list[int]]:
    """Nodes of the shaft and of the pins in their order, and how many components each has."""
    table = element.nodes
    shaft = [node for node in table if node.role == "shaft"]
    pins = {node.name: node for node in table if node.role == "pin"}
    ordered = [pins[str(number)] for number in range(1, len(pins) + 1) if str(number) in pins]
    components = [element.components(node) for node in (*shaft, *ordered)]
    count = sum(node.role == "pin" for node in table)
    if len(shaft) != 1 or not ordered or len(ordered) != count:
        raise CaseError(
            "the seats of the carrier are not one shaft and pins from 1 on",
            code="E-COUNT",
            key="nodes",
            value=", ".join(f"{node.role} {node.name}".strip() for node in table)[:200],
            limit="the roles shaft, pin 1, pin 2 and so on, each once",
            remedy="name the seats in the order of the planets",
        )
    if components[0] != _ALL or set(components[1:]) not in ({_ALL}, {_ALL[:3]}):
        raise CaseError(
            "the seats have other components than the carrier needs",
            code="E-SHAPE",
            key="nodes",
            value=", ".join("".join(map(str, ways)) or "none" for ways in components)[:200],
            limit="123456 of the shaft, 123 or 123456 of all pins",
            remedy="tie the seats to nodes with six components (RBE3, distributing coupling) before the reduction",
        )
    return [*shaft, *ordered], [len(ways) for ways in components]


def _reduced(K: np.ndarray, M: np.ndarray, seats: np.ndarray, places: np.ndarray, components: int) -> CarrierBody:
    """Condense free coordinates on the seats, and find the normal modes with all seats held."""
    inner = np.setdiff1d(np.arange(len(K)), seats)
    inside, other = K[np.ix_(inner, inner)], K[np.ix_(inner, seats)]
    try:
        # modes by their compliance: coordinates without mass have none
        soft, shape = eigh(M[np.ix_(inner, inner)], inside) if len(inner) else (np.zeros(0), np.zeros((0, 0)))
    except np.linalg.LinAlgError as error:
        raise CaseError(
            "coordinates beside the seats are held by nothing",
            code="E-MECHANISM",
            key="stiffness",
            limit="a positive definite stiffness with all seats held",
            remedy="leave free coordinates out of the export",
        ) from error
    kept = np.flatnonzero(soft > _MASSLESS * soft.max(initial=0.0))[::-1][:_MOST_MODES]
    omega, shape = 1.0 / np.sqrt(soft[kept]), shape[:, kept] / np.sqrt(soft[kept])
    static = -np.linalg.solve(inside, other)
    moved = M[np.ix_(seats, inner)] + static.T @ M[np.ix_(inner, inner)]
    mass = M[np.ix_(seats, seats)] + moved @ static + static.T @ M[np.ix_(inner, seats)]
    stiffness = K[np.ix_(seats, seats)] + other.T @ static
    arms = places[1:] - places[0]
    rigid = np.vstack([np.eye(6), *(rigid_link(arm)[:components] for arm in arms)])
    _check_free(stiffness, rigid, arms, components)
    _check_mass(0.5 * (mass + mass.T), rigid)
    compliance = np.linalg.inv(stiffness[6:, 6:])
    return CarrierBody(
        places[0], places[1:], 0.5 * (compliance + compliance.T), 0.5 * (mass + mass.T), omega, moved @ shape
    )


def _check_free(stiffness: np.ndarray, rigid: np.ndarray, arms: np.ndarray, components: int) -> None:
    """Refuse a carrier that is held somewhere, and one whose pins nothing holds on the shaft."""
    lever = max(float(np.hypot(arms[:, 0], arms[:, 1]).max()), 1e-9)
    pins = np.tile(np.repeat([1.0, lever], 3)[:components], len(arms))
    size = np.concatenate([np.repeat([1.0, lever], 3), pins])
    scaled = stiffness / np.outer(size, size)
    force = np.abs(scaled @ (rigid * size[:, None] / size[:6])).max(axis=0) / np.abs(scaled).max()
    worst = int(force.argmax())
    if force[worst] > _RIGID_FORCE:
        ways = ("along x", "along y", "along z", "about x", "about y", "about z")
        raise CaseError(
            "a motion of the whole carrier as a rigid body needs a force: it is held somewhere, or its places are "
            "others than those of the matrices",
            code="E-SUPPORT",
            key="stiffness",
            value=f"{ways[worst]}, {force[worst]:.3g} of the largest stiffness",
            limit=f"{_RIGID_FORCE:g} of it",
            remedy="export the free carrier, without bearings and constraints, with x, y, z of its seats",
        )
    values = np.linalg.eigvalsh(scaled[6:, 6:])
    if values[0] <= 1e-12 * values[-1]:
        raise CaseError(
            "the shaft's seat does not hold the pins",
            code="E-MECHANISM",
            key="stiffness",
            value=f"an eigenvalue of {values[0] / values[-1]:.3g} of the largest one",
            limit="above 1e-12 of it",
            remedy="export one connected body; pins that turn freely have the components 123",
        )


def _check_mass(mass: np.ndarray, rigid: np.ndarray) -> None:
    """Refuse masses that are none."""
    whole = (rigid.T @ mass @ rigid)[0, 0]
    size = np.sqrt(np.abs(np.diag(mass)))
    if whole <= 0.0 or not size.all() or np.linalg.eigvalsh(mass / np.outer(size, size))[0] <= 0.0:
        raise CaseError(
            "the mass of the carrier is not positive in all motions of its seats",
            code="E-MASS",
            key="mass",
            value=f"{whole:.4g} kg in all",
            limit="a positive definite mass matrix of the seats",
            remedy="export a consistent mass matrix, or pins of the components 123",
        )
