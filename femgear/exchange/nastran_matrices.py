"""Reduced stiffness and mass in the files of Nastran: DMIG on punch cards, and ASCII OUTPUT4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from femgear.errors import nvh_library
from femgear.exchange.node_tables import Node, foreign_refusals, require


def dmig_matrices(path: Path) -> tuple[list[np.ndarray], dict, dict]:
    """Read stiffness and mass (r, r) of a punch file, row of (node, component), positions of its nodes.

    Other cards than GRID, coordinate systems and DMIG are passed over, BEGIN SUPER among them.
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
    turned = [number for number, grid in deck.nodes.items() if grid.cd]
    require(
        "displacements in coordinate systems of their own",
        not turned,
        code="E-CHOICE",
        key="nodes",
        value=turned[:9],
        limit="the basic system (CD 0)",
        remedy="export displacements in the basic system",
    )
    both = _pair(deck.dmigs)
    labels = np.unique(np.vstack([side for stored in both for side in (stored.GCi, stored.GCj)]), axis=0)
    row = {(int(g), int(c)): i for i, (g, c) in enumerate(labels)}
    matrices = [np.zeros((len(row),) * 2, complex) for _ in both]
    for stored, matrix in zip(both, matrices):
        i, j = (np.array([row[int(g), int(c)] for g, c in side], int) for side in (stored.GCi, stored.GCj))
        matrix[i, j] = np.array(stored.Real) + (1j * np.array(stored.Complex) if stored.is_complex else 0.0)
        if stored.matrix_form == 6:
            matrix[j, i] = matrix[i, j]
    return matrices, row, place


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
    with foreign_refusals("ASCII OP4"):
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
