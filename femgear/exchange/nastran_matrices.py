"""Reduced stiffness and mass in the files of Nastran: DMIG on punch cards, and ASCII OUTPUT4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from femgear.errors import nvh_library
from femgear.exchange.node_tables import Node, foreign_refusals, require

_PARALLEL = 1e-9
"""Cosine of two directions that are across each other, as digits of a file leave it."""
_CARD = 16
"""Length of the numbers at the beginning of an ASCII OUTPUT4, two of eight digits."""


def dmig_matrices(path: Path) -> tuple[list[np.ndarray], dict, dict]:
    """Read stiffness and mass (r, r) of a punch file, row of (node, component), positions of its nodes.

    Other cards than GRID, coordinate systems and DMIG are passed over, BEGIN SUPER among them. Displacements in
    coordinate systems of their own (CD) are turned into the basic one.
    """
    with nvh_library("matrices of Nastran"):
        from pyNastran.bdf.bdf import BDF
    kept, lines = False, list[str]()
    for line in path.read_text(encoding="latin-1").splitlines():
        kept = line[:4].upper() in ("GRID", "CORD", "DMIG") if line[:1].isalpha() else kept
        lines += [line] if kept and not line.startswith("$") else []
    deck, place = BDF(debug=False), dict[int, np.ndarray]()
    with foreign_refusals("bulk data of Nastran"):
        if lines:
            source: Any = StringIO("\n".join([*lines, ""]))
            deck.read_bdf(source, punch=True, xref=False)
        for number, grid in deck.nodes.items():
            place[number] = np.array(grid.get_position_no_xref(deck), float)
        axes = {number: _local_axes(deck, grid, place[number]) for number, grid in deck.nodes.items() if grid.cd}
    both = _pair(deck.dmigs)
    labels = np.unique(np.vstack([side for stored in both for side in (stored.GCi, stored.GCj)]), axis=0)
    row = {(int(g), int(c)): i for i, (g, c) in enumerate(labels)}
    matrices = [np.zeros((len(row),) * 2, complex) for _ in both]
    for stored, matrix in zip(both, matrices):
        i, j = (np.array([row[int(g), int(c)] for g, c in side], int) for side in (stored.GCi, stored.GCj))
        matrix[i, j] = np.array(stored.Real) + (1j * np.array(stored.Complex) if stored.is_complex else 0.0)
        if stored.matrix_form == 6:
            matrix[j, i] = matrix[i, j]
    turn = _basic_motions(row, axes)
    return [turn.T @ matrix @ turn for matrix in matrices] if axes else matrices, row, place


def _local_axes(deck: Any, grid: Any, place: np.ndarray) -> np.ndarray:
    """Axes (3, 3) in which the displacements of a grid point at a place (3,) are, as rows in the basic system.

    Of its coordinate system CD: rectangular, or the radial, tangential and axial directions of a cylindrical, the
    radial, polar and azimuthal ones of a spherical system at the point (MSC Nastran Quick Reference Guide, CORD2C,
    CORD2S).
    """
    require(
        "the coordinate system of displacements is not in the file",
        grid.cd in deck.coords,
        code="E-KEY-MISSING",
        key="nodes",
        value=f"CD {grid.cd} of node {grid.nid}",
        limit="a card CORD2R, CORD2C or CORD2S for every system",
        remedy="export the coordinate systems too, or displacements in the basic one",
    )
    system = deck.coords[grid.cd]
    system.setup_no_xref(deck)
    axes, kind = np.array(system.beta(), float), system.type[-1]
    x, y, z = axes @ (place - np.array(system.origin, float))
    if kind == "R":
        return axes
    azimuth = np.arctan2(y, x)
    out, around = axes.T @ [np.cos(azimuth), np.sin(azimuth), 0.0], axes.T @ [-np.sin(azimuth), np.cos(azimuth), 0.0]
    if kind == "C":
        return np.array([out, around, axes[2]])
    polar = np.arctan2(np.hypot(x, y), z)
    radial, down = np.sin(polar) * out + np.cos(polar) * axes[2], np.cos(polar) * out - np.sin(polar) * axes[2]
    return np.array([radial, down, around])


def _basic_motions(row: Mapping[tuple[int, int], int], axes: Mapping[int, np.ndarray]) -> np.ndarray:
    """Motions (r, r) of all coordinates by those in the basic system; others than turned ones stay as they are.

    CaseError: a node whose coordinates that are kept are not turned into one another (E-CHOICE).
    """
    turn = np.eye(len(row))
    for number, local in axes.items():
        for first in (1, 4):
            kept = [c for c in range(3) if (number, first + c) in row]
            lost = [c for c in range(3) if c not in kept]
            require(
                "displacements in a coordinate system of their own, of which some are left out",
                not kept or bool((np.abs(local[np.ix_(kept, lost)]) < _PARALLEL).all()),
                code="E-CHOICE",
                key="nodes",
                value=f"node {number}, components {', '.join(str(first + c) for c in kept)}",
                limit="all three along or about its axes, or a system (CD) that turns those alone",
                remedy="keep all components in the reduction, or export displacements in the basic system (CD 0)",
            )
            rows = [row[number, first + c] for c in kept]
            turn[np.ix_(rows, rows)] = local[np.ix_(kept, kept)]
    return turn


def _pair(matrices: Mapping[str, object]) -> list[Any]:
    """Stiffness and mass among matrices by name: the one that begins with K and the one with M."""
    names = [_stiffness_or_mass(matrices, letter) for letter in "KM"]
    require(
        "the file does not hold one stiffness and one mass matrix",
        [len(name) for name in names] == [1, 1],
        code="E-COUNT",
        key="matrices",
        value=", ".join(matrices),
        limit="one name that begins with K (KAAX, KAA), one that begins with M (MAAX, MAA)",
    )
    return [matrices[name] for (name,) in names]


def _stiffness_or_mass(matrices: Mapping[str, object], letter: str) -> list[str]:
    """Names of matrices that may be the stiffness (K) or the mass (M)."""
    # Nastran's names of reduced matrices go before others of the letter, such as the structural damping K4AAX
    for usual in (f"{letter}AAX", f"{letter}AA"):
        if usual in matrices:
            return [usual]
    return [name for name in matrices if name[:1].upper() == letter]


def op4_matrices(path: Path, table: Sequence[Node]) -> tuple[list[np.ndarray], dict, dict]:
    """Read stiffness and mass (r, r) of an ASCII OUTPUT4 file, as `dmig_matrices`, rows in the order of the table."""
    with nvh_library("matrices of Nastran"):
        from pyNastran.op4.op4 import OP4
    _check_text(path)
    with foreign_refusals("ASCII OP4: it may break off"):
        matrices = OP4(debug=False).read_op4(str(path))
    entries = [getattr(entry, "data", entry) for entry in _pair(matrices)]
    entries = [matrix[1].toarray() if hasattr(matrix[1], "toarray") else np.asarray(matrix[1]) for matrix in entries]
    pairs = ((node.number, int(dof)) for node in table if node.role != "centre" for dof in node.dofs)
    labels = list(dict.fromkeys(pairs))
    sizes = {n for matrix in entries for n in matrix.shape}
    require(
        f"matrices of {entries[0].shape} and {entries[1].shape} do not fit the {len(labels)} degrees of freedom "
        "of the table",
        len(sizes) == 1 and max(sizes) >= len(labels),
        code="E-SHAPE",
        key="nodes",
        limit=f"square, of one size, {len(labels)} rows or more",
        remedy="give all nodes of the matrices in their order, with their dofs",
    )
    return entries, {label: i for i, label in enumerate(labels)}, {}


def _check_text(path: Path) -> None:
    """Refuse a binary OUTPUT4, which is no damaged one, and an empty file (E-FILE)."""
    with open(path, "rb") as stream:
        head = stream.read(4 * _CARD)
    binary = any(byte > 126 or (byte < 32 and byte not in b"\t\r\n") for byte in head)
    require(
        "a binary OUTPUT4" if binary else "the file is empty",
        bool(head.strip()) and not binary,
        code="E-FILE",
        key="file",
        limit="ASCII OUTPUT4",
        remedy="export it as text: ASSIGN OUTPUT4 ... FORM=FORMATTED, or DMIGPCH",
    )
