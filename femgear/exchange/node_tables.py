"""Tables of nodes (CSV): what the nodes of a casing, a carrier or another body of finite elements stand for.

Columns ``node`` and ``role``, with ``x``, ``y``, ``z`` where the file of the body has no coordinates, ``direction``
(of a sensor: x, y, z, radial, tangential, or one of these after a minus sign; radial when empty) and ``dofs`` (OP4: 123
when empty). Roles of a casing: ``ring``, a point of the pitch circle; ``sensor NAME``; ``foot NAME``, a node that is
held, and whose force on the ground is an output; ``centre``, that of the ring, else the origin.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from femgear.errors import CaseError, FemgearError
from femgear.storage.files import plain_cell

CASING_ROLES = {"ring": False, "sensor": True, "foot": True, "centre": False}
"""What the nodes of a casing stand for, and whether a name follows."""


@dataclass(frozen=True)
class Node:
    """A row of the table of nodes.

    Parameters
    ----------
    number : int
        Of the node in the file.
    role, name : str
        What it stands for, such as a point of the ring or a sensor, and what it is called.
    direction : str
        Direction in which it moves or is loaded, as the table has it.
    dofs : str
        Its degrees of freedom in the file, as the table has them.
    position : (3,) array or None
        In the units of the file.
    """

    number: int
    role: str
    name: str
    direction: str
    dofs: str
    position: np.ndarray | None


def require(message: str, ok: bool, **words: Any) -> None:
    """Refuse (`CaseError`, whose entries the other words are) what is not as it must be."""
    if not ok:
        raise CaseError(message, **words)


def refuse_output2(path: Path) -> None:
    """Refuse (`CaseError`, E-FILE) results of Nastran in OUTPUT2, whose records differ by program and version."""
    require(
        "a file in OUTPUT2 is binary in a form of the program that wrote it, and is not read",
        path.suffix.lower() != ".op2",
        code="E-FILE",
        limit="matrices in .pch or .op4, modes in .uff or .unv",
        remedy="write the matrices to the punch file, EXTSEOUT(STIFFNESS,MASS,DMIGPCH), or by OUTPUT4 as text",
    )


@contextmanager
def file_in_refusals(path: Path) -> Iterator[None]:
    """Name the file in the refusals of the block; what a library says of a damaged one is E-FILE."""
    try:
        yield
    except CaseError as error:
        error.file = error.file or str(path)
        raise


@contextmanager
def foreign_refusals(words: str, key: str = "file") -> Iterator[None]:
    """Turn what a library says of a damaged file into E-FILE, under the key of the file."""
    try:
        yield
    except FemgearError:
        raise
    except Exception as error:
        text, remedy = " ".join(str(error).split())[:200], "export the file again, and name that one"
        if isinstance(error, UnicodeDecodeError):
            text, remedy = "it is not text in UTF-8", "save the file as text in UTF-8"
        elif isinstance(error, BadZipFile):
            text, remedy = "it is no archive, or is damaged", "write it with numpy.savez, and name that one"
        message = f"no {words} that can be read: {text}"
        raise CaseError(message, code="E-FILE", key=key, limit=words, remedy=remedy) from error


def read_nodes(path: Path, roles: Mapping[str, bool] = CASING_ROLES) -> tuple[Node, ...]:
    """Read the table of nodes of a casing, or of a body of other roles, each with whether a name follows it.

    CaseError: E-FILE, E-KEY-MISSING (columns), E-CHOICE (roles, directions), E-DUPLICATE (nodes).
    """
    with file_in_refusals(path):
        with foreign_refusals("table of nodes (CSV)", "nodes"), open(path, newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream)
            rows, columns = list(reader), list(reader.fieldnames or ())
        require(
            "the table of nodes lacks columns",
            {"node", "role"} <= set(columns),
            code="E-KEY-MISSING",
            key="nodes",
            value=", ".join(columns),
            limit="node, role; x, y, z, direction, dofs where needed",
        )
        table = tuple(_node({key: plain_cell((row[key] or "").strip()) for key in columns}, roles) for row in rows)
        ring = "ring" not in roles or any(node.role == "ring" for node in table)
        require("no points of the ring", ring, code="E-COUNT", key="nodes", limit="nodes of the role ring")
        keys = [(node.number, node.role, node.direction * (node.role == "sensor")) for node in table]
        twice = [key for key in keys if keys.count(key) > 1]
        require(
            "a node stands twice",
            not twice,
            code="E-DUPLICATE",
            key="nodes",
            value=twice[:1],
            limit="each node once, as a sensor once a direction",
        )
    return table


def _node(row: Mapping[str, str], roles: Mapping[str, bool]) -> Node:
    """A row of the table of nodes."""
    (role, _, name), place = row["role"].partition(" "), [row.get(axis, "") for axis in "xyz"]
    direction, dofs = row.get("direction") or "radial", row.get("dofs") or "123"
    allowed = role in roles and bool(name) == roles[role]
    allowed &= direction.removeprefix("-") in ("x", "y", "z", "radial", "tangential")
    try:
        position = np.array([float(coordinate) for coordinate in place]) if any(place) else None
        number = int(row["node"] or 0)
        allowed &= role != "centre" if position is None else bool(np.isfinite(position).all())
    except (TypeError, ValueError):
        allowed = False
    require(
        "a row of the table of nodes that cannot be read",
        allowed and set(dofs) <= set("123456"),
        code="E-CHOICE",
        key="nodes",
        value=", ".join(row.values()),
        limit=f"a whole number, finite coordinates, role {_listed(roles)}, direction x, y, z, radial or tangential, "
        "dofs of 123456",
    )
    return Node(number, role, name, direction, dofs, position)


def _listed(roles: Mapping[str, bool]) -> str:
    """Name all roles."""
    names = [f"{role} NAME" if named else role for role, named in roles.items()]
    return " or ".join([*([", ".join(names[:-1])] if names[1:] else []), names[-1]])


def feet_of(table: Sequence[Node]) -> list[str]:
    """Find the names of the feet, each once."""
    return list(dict.fromkeys(node.name for node in table if node.role == "foot"))
