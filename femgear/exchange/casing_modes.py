"""Modes of a casing from its reduced matrices, or from a universal file, in SI units.

A foot feels ``f = -(K_fi u + M_fi u'')``. In the modes of the held structure that is, without damping,
``-sum_m (K_fi - omega_m^2 M_fi) phi_m q_m`` and ``-M_fi M_ii^-1 F`` of the load F itself, which does not
depend on the frequency and stands with the static residual: the equation of motion of the held rows with the
accelerations of the free ones (R. R. Craig and A. J. Kurdila, Fundamentals of Structural Dynamics, ch. 17).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np
from scipy.linalg import eigh

from femgear.errors import CaseError, nvh_library
from femgear.exchange.node_tables import Node, feet_of, foreign_refusals, require

_ASYMMETRY = 1e-6  # of a matrix over its largest entry: files hold 7 to 16 digits
_FREE = 1e-10  # square of a natural frequency over the largest one: what may be rounding of the file
_MASSLESS = 1e-14  # of the largest entry of the mass matrix: a coordinate without mass
_DISPLACEMENT, _REAL = 8, (2, 4)  # codes of dataset 2414: type of result, types of real data
_BINARY = re.compile(rb"^ {4}-1[ ]*\r?\n +\d+b +\d+ +\d+ +(\d+) +(\d+)[^\n]*\n", re.MULTILINE)
"""Head of a binary dataset: byte order, format of numbers, lines of text and bytes that follow."""


@dataclass(frozen=True)
class CasingModes:
    """Mass-normalised modes of a casing in SI units.

    Parameters
    ----------
    frequency : (m,) array
        Natural angular frequencies [rad/s].
    shape : (m, r) array
        Mode shapes over the coordinates [kg^-1/2].
    row : mapping of (int, int) to int
        Number of a coordinate by node and component.
    position : mapping of int to (3,) array
        Places of nodes [m], by their numbers.
    damping : (m,) array or None
        Damping ratios [1]; None where the file has none.
    foot_force : (m, o) array
        Forces on the feet per unit of each mode.
    foot_direct : (o, r) array
        Forces on the feet by unit loads themselves [1].
    compliance : (r, r) array, optional
        Static compliance of coordinates without mass [m/N], which no mode has; None where there are none.
    """

    frequency: np.ndarray
    shape: np.ndarray
    row: Mapping[tuple[int, int], int]
    position: Mapping[int, np.ndarray]
    damping: np.ndarray | None
    foot_force: np.ndarray
    foot_direct: np.ndarray
    compliance: np.ndarray | None = None


def modes_of_matrices(matrices, row, place, table: Sequence[Node], length: float, mass: float) -> CasingModes:
    """Solve for the modes of a reduced stiffness and mass (r, r) in the units of the file, the feet held."""
    _check_matrices(matrices)
    # with time in seconds a stiffness scales as a mass; generalised coordinates take their units with them
    K, M = (0.5 * mass * np.real(matrix + matrix.T) for matrix in matrices)
    standing = [node for node in table if node.role == "foot"]
    feet = [[row.get((node.number, c), -1) for c in (1, 2, 3)] for node in standing]
    held = {node.number for node in standing}
    free = np.setdiff1d(np.arange(len(K)), [i for (number, _), i in row.items() if number in held])
    require(
        "a foot without coordinates in the matrices, or nothing but feet",
        not feet or (np.min(feet) >= 0 and len(free) > 0),
        code="E-SUPPORT",
        key="nodes",
        limit="the components 1, 2 and 3 of every foot",
        remedy="keep the feet in the reduction, or leave out feet that are held already",
    )
    heavy, light = _with_and_without_mass(M, free)
    follow, compliance = _massless(K, heavy, light)
    try:
        condensed = K[np.ix_(heavy, heavy)] + K[np.ix_(heavy, light)] @ follow
        square, shape = eigh(0.5 * (condensed + condensed.T), M[np.ix_(heavy, heavy)])
    except np.linalg.LinAlgError as error:
        raise CaseError(
            "the mass matrix is not positive definite",
            code="E-MASS",
            key="mass",
            limit="mass on every coordinate, or none at all",
            remedy="condense coordinates of negative mass before the export",
        ) from error
    below = int((square <= _FREE * square[-1]).sum())
    require(
        f"{below} eigenvalues are zero or negative",
        below == 0,
        code="E-MECHANISM",
        key="stiffness",
        value=f"omega^2 = {square[0]:.4g} 1/s^2",
        limit=f"above {_FREE * square[-1]:.3g} 1/s^2",
        remedy="hold the casing (role foot); a negative one means a lost entry or matrices of two models",
    )
    phi = np.zeros((len(square), len(K)))
    phi[:, heavy], phi[:, light] = shape.T, shape.T @ follow.T
    names = feet_of(table)
    total = np.zeros((len(names), 3, len(K)))
    for rows, foot in zip(feet, standing):
        total[names.index(foot.name), range(3), rows] += 1.0
    stiff, inert = (total.reshape(-1, len(K)) @ matrix for matrix in (K, M))
    force = square[:, None] * (phi @ inert.T) - phi @ stiff.T
    direct = -(inert @ phi.T) @ phi
    if len(light):
        direct -= stiff @ compliance
    places = place | {node.number: node.position for node in table if node.position is not None}
    places = {number: length * x for number, x in places.items()}
    return CasingModes(np.sqrt(square), phi, row, places, None, force, direct, compliance if len(light) else None)


def _check_matrices(matrices: Sequence[np.ndarray]) -> None:
    """Refuse stiffness and mass that are complex, not symmetric or not finite."""
    for matrix, name in zip(matrices, ("stiffness", "mass")):
        require(
            "a complex matrix",
            not np.imag(matrix).any(),
            code="E-TYPE",
            key=name,
            limit="real numbers",
            remedy="leave structural damping out; give a damping ratio",
        )
        with np.errstate(invalid="ignore"):
            apart, largest = np.abs(matrix - matrix.T).max(), np.abs(matrix).max()
        require(
            f"the {name} matrix is not symmetric, or not finite",
            apart <= _ASYMMETRY * largest,
            code="E-SYMMETRY",
            key=name,
            value=f"{apart:.3g} of {largest:.3g}",
            limit=f"{_ASYMMETRY:g} of it",
        )


def _with_and_without_mass(M: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split free coordinates into those with mass and those that no mass moves with."""
    moved = np.abs(M[np.ix_(free, free)]).max(axis=1, initial=0.0)
    light = moved <= _MASSLESS * moved.max(initial=0.0)
    return free[~light], free[light]


def _massless(K: np.ndarray, heavy: np.ndarray, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Condense coordinates without mass: their motion by that of the others, and their own compliance.

    ``K_ll u_l + K_lh u_h = F_l``: exact static condensation (R. J. Guyan, AIAA J. 3, 1965, 380). Returns
    ``-K_ll^-1 K_lh`` and ``K_ll^-1`` among all coordinates (r, r). CaseError: E-MECHANISM.
    """
    compliance = np.zeros_like(K)
    of_light = K[np.ix_(light, light)]
    require(
        "coordinates without mass are held by nothing",
        not len(light) or float(np.linalg.cond(of_light)) < 1 / _FREE,
        code="E-MECHANISM",
        key="mass",
        limit="stiffness or mass on every coordinate",
        remedy="leave these coordinates out of the export, or give them mass",
    )
    inverse = np.linalg.inv(of_light) if len(light) else of_light
    compliance[np.ix_(light, light)] = inverse
    return -inverse @ K[np.ix_(light, heavy)], compliance


def modes_of_universal_file(path: Path, table: Sequence[Node], length: float, mass: float) -> CasingModes:
    """Read the modes of a universal file, datasets 55 or 2414, at the nodes of datasets 15 or 2411."""
    sets = _datasets(path)
    modes = [dataset for dataset in sets if dataset["type"] == 55] + _analysis_data(sets)
    weights = _checked_weights(sets, modes, table, length)
    numbers = sorted({int(number) for mode in modes for number in mode["node_nums"]})
    row = {(number, c + 1): 3 * i + c for i, number in enumerate(numbers) for c in range(3)}
    shape = np.zeros((len(modes), 3 * len(numbers)))
    for mode, target in zip(modes, shape):
        first = np.array([row[int(number), 1] for number in mode["node_nums"]])
        for c in range(3):
            target[first + c] = mode[f"r{c + 1}"]
    places = dict[int, np.ndarray]()
    for mode in sets:
        if mode["type"] in (15, 2411):
            places |= zip(map(int, mode["node_nums"]), np.transpose([mode[axis] for axis in "xyz"]))
    places |= {node.number: node.position for node in table if node.position is not None}
    damping = np.array([mode["modal_damp_vis"] + 0.5 * mode["modal_damp_his"] for mode in modes], float)
    return CasingModes(
        2 * np.pi * np.array([mode["freq"] for mode in modes], float),
        shape / np.sqrt(mass * weights)[:, None],
        row,
        {number: length * x for number, x in places.items()},
        damping if damping.any() else None,
        np.zeros((len(modes), 0)),
        np.zeros((0, len(shape.T))),
    )


def _without_binary(content: bytes) -> bytes:
    """Leave out the binary datasets (58b) of a universal file, whose bytes may look like anything."""
    while head := _BINARY.search(content):
        end = head.end()
        for _ in range(int(head[1])):
            end = content.find(b"\n", end) + 1 or len(content)
        end = content.find(b"    -1", end + int(head[2])) + len(b"    -1")
        if end < len(b"    -1"):
            raise ValueError("it breaks off within a binary dataset")
        content = content[: head.start()] + content[end:].lstrip(b" ").removeprefix(b"\r").removeprefix(b"\n")
    return content


def _analysis_data(sets: Sequence[Mapping[str, object]]) -> list[dict[str, Any]]:
    """Normal modes of datasets 2414 at nodes, in the entries of datasets 55.

    Real specific data are time, frequency, eigenvalue, modal mass, viscous and hysteretic damping ratio
    (universal file dataset 2414, records 12 and 13).
    """
    modes = list[dict[str, Any]]()
    for dataset in sets:
        if dataset["type"] != 2414 or dataset["dataset_location"] != 1 or dataset["result_type"] != _DISPLACEMENT:
            continue
        if dataset["analysis_type"] != 2:
            continue
        motion = np.array(dataset["data_at_node"], float)
        require(
            "modes whose nodes have no displacement vectors",
            motion.ndim == 2 and motion.shape[1] in (3, 6) and dataset["data_type"] in _REAL,
            code="E-TYPE",
            key="modes",
            limit="three or six real components",
        )
        vectors = {f"r{c + 1}": motion[:, c] for c in range(3)}
        modes.append(
            vectors
            | {
                "node_nums": dataset["node_nums"],
                "analysis_type": 2,
                "freq": dataset["record12_field2"],
                "modal_m": dataset["record12_field4"],
                "modal_damp_vis": dataset["record12_field5"],
                "modal_damp_his": dataset["record12_field6"],
            }
        )
    return modes


def _datasets(path: Path) -> list[dict]:
    """Read the datasets of a universal file in ASCII."""
    with nvh_library("universal files"):
        import pyuff
    with foreign_refusals("universal file"):
        content = _without_binary(path.read_bytes())
        # the library reads a file that breaks off up to its last whole dataset
        if sum(line.strip() == b"-1" for line in content.splitlines()) % 2:
            raise ValueError("it breaks off within a dataset")
        with NamedTemporaryFile(suffix=".uff") as file:
            file.write(content)
            file.flush()
            sets = pyuff.UFF(file.name).read_sets()
    return sets if isinstance(sets, list) else [sets]


def _checked_weights(sets: Sequence[dict], modes: Sequence[dict], table: Sequence[Node], length: float) -> np.ndarray:
    """Modal masses (m,); other units, no modes, complex ones, without mass or of feet are refused."""
    system = [dataset["length"] for dataset in sets if dataset["type"] == 164]
    require(
        "the file is in other units than told",
        not system or np.isclose(system[0] * length, 1.0, rtol=1e-3),
        code="E-UNITS",
        key="units",
        value=f"units of length a metre: {system[:1]}",
        limit=f"{1 / length:g}",
        remedy="give the units of the file",
    )
    real = all(mode["analysis_type"] == 2 and not np.iscomplexobj(mode["r1"]) for mode in modes)
    require("complex modes", real, code="E-TYPE", key="modes", limit="real normal modes (analysis type 2)")
    kinds = sorted({int(dataset["type"]) for dataset in sets})
    require(
        "the file holds no modes",
        len(modes) > 0,
        code="E-COUNT",
        key="modes",
        value=f"datasets {', '.join(map(str, kinds))}",
        limit="datasets 55, or 2414 of normal modes at nodes",
        remedy="export normal modes, displacements at nodes, in ASCII",
    )
    weights = np.array([mode["modal_m"] for mode in modes], float)
    require(
        "modes without modal mass",
        bool((weights > 0).all()),
        code="E-MASS",
        key="modal mass",
        value=weights.tolist(),
        limit="above 0 in every dataset 55 or 2414",
        remedy="export modes with the modal mass that they are normalised to",
    )
    require(
        "modes do not tell the forces on the feet",
        not feet_of(table),
        code="E-SUPPORT",
        key="nodes",
        value=feet_of(table),
        limit="feet with matrices",
        remedy="leave the feet out of the table, or export reduced matrices",
    )
    return weights
