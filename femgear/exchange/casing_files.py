"""Casings that somebody else has meshed, as structures fixed in space (`femgear.housing.two_way.structure`).

`read_casing` reads, by the ending of the file name,

* ``.npz``, ``.nc``: the arrays of `femgear.housing.two_way.structure.from_arrays`;
* ``.pch``, ``.bdf``, ``.dat``: reduced stiffness and mass as DMIG, with GRID cards or without; ``.op4``: the
  same in ASCII, rows for the degrees of freedom of the nodes in their order, other coordinates after them;
* ``.uff``, ``.unv``: normal modes (universal file, datasets 55 or 2414, 15 or 2411, 164); binary datasets of
  other data are passed over.

Matrices and modes need a table of nodes (CSV): columns ``node`` and ``role``, with ``x``, ``y``, ``z`` where
the file has no coordinates, ``direction`` (of a sensor: x, y, z, radial, tangential, or one of these after a
minus sign; radial when empty) and ``dofs`` (OP4: 123 when empty). Roles: ``ring``, a point of the pitch
circle; ``sensor NAME``; ``foot NAME``, a node that is held, and whose force on the ground is an output;
``centre``, that of the ring, else the origin. The axis of the ring is z.

A foot feels ``f = -(K_fi u + M_fi u'')``. In the modes of the held structure that is, without damping,
``-sum_m (K_fi - omega_m^2 M_fi) phi_m q_m`` and ``-M_fi M_ii^-1 F`` of the load F itself, which does not
depend on the frequency and stands with the static residual: the equation of motion of the held rows with the
accelerations of the free ones (R. R. Craig and A. J. Kurdila, Fundamentals of Structural Dynamics, ch. 17).
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any
from zipfile import ZipFile

import numpy as np
from scipy.linalg import eigh

from femgear.errors import CaseError, FemgearError, nvh_library
from femgear.findings import Finding
from femgear.housing.two_way.structure import ARRAY_NAMES, FixedStructure, from_arrays
from femgear.storage.files import plain_cell

UNITS = {"SI": (1.0, 1.0), "mm-t-s": (1e-3, 1e3)}
"""Systems of units: metres and kilograms of the units of length and mass; time is in seconds."""
CASING_ROLES = {"ring": False, "sensor": True, "foot": True, "centre": False}
"""What the nodes of a casing stand for, and whether a name follows."""
_ARRAYS, _PUNCH, _UNIVERSAL = (".npz", ".nc"), (".pch", ".bdf", ".dat"), (".uff", ".unv")
_KINDS = (*_ARRAYS, *_PUNCH, ".op4", *_UNIVERSAL)
_STIFFNESS = {0: "SI", 3: "mm-t-s", 6: "mm-kg-ms"}  # powers of ten of the unit of stiffness [N/m]
# powers of the units of mass and length in arrays, whose outputs are displacements
_POWERS = {
    "ring_shape": (-0.5, 0),
    "sensor_shape": (-0.5, 0),
    "ring_compliance": (-1, 0),
    "sensor_compliance": (-1, 0),
    "sensor_area": (0, 2),
}
_OFF_CIRCLE = 0.01  # distance of a point from the pitch circle over its radius, at most
_ASYMMETRY = 1e-6  # of a matrix over its largest entry: files hold 7 to 16 digits
_FREE = 1e-10  # square of a natural frequency over the largest one: what may be rounding of the file
_DISPLACEMENT, _REAL = 8, (2, 4)  # codes of dataset 2414: type of result, types of real data
_MASSLESS = 1e-14  # of the largest entry of the mass matrix: a coordinate without mass
_MOST_BYTES = 1_000_000_000  # of all arrays of a structure: 1000 modes at 1000 points take 16 MB
_MISSING = 0.05  # part of the static compliance that may be missing without a word


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


@dataclass(frozen=True)
class _Modes:
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


def read_casing(
    path: Path,
    *,
    direction: Sequence[float],
    pitch_radius: float,
    max_diameter: int,
    units: str = "SI",
    damping_ratio: float | None = None,
    nodes: Path | None = None,
    max_frequency: float = np.inf,
    expected_stiffness: float | None = None,
) -> FixedStructure:
    """Read a casing from arrays, matrices or modes, the kind told by the ending of the file name.

    Parameters
    ----------
    path : path
        See the head of this module.
    direction : (radial, tangential)
        Of the force on the ring along the line of action, a unit vector.
    pitch_radius : float
        Of the ring in mesh with the planets [m]. Its points lie on this circle, within 1 % of the radius.
    max_diameter : int
        Largest nodal diameter kept; it takes four points of the ring or more for each.
    units : str
        Of the file: "SI" or "mm-t-s" (N, MPa).
    damping_ratio : float, optional
        Of all modes, in place of those of the file. Matrices have none.
    nodes : path, optional
        The table of nodes that matrices and modes need.
    max_frequency : float, optional
        Modes beyond are represented by their static part [Hz].
    expected_stiffness : float, optional
        Static stiffness of the ring along the line of action, one over `mean_compliance` [N/m], roughly: a
        file that is off by a factor of 32 or more has other units.

    Returns
    -------
    FixedStructure
        Its sensors are the outputs of `output_names`: displacements, and forces on the feet [N].

    Raises
    ------
    CaseError
        As `from_arrays`, and E-FILE, E-UNITS, E-RANGE (points off the circle), E-DUPLICATE, E-KEY-MISSING,
        E-CHOICE, E-SHAPE, E-SYMMETRY, E-TYPE (complex), E-MASS, E-MECHANISM (eigenvalues of zero or less),
        E-SUPPORT.
    """
    kind = path.suffix.lower()
    with file_in_refusals(path):
        names = ", ".join(UNITS)
        _check("no such units", units in UNITS, code="E-CHOICE", key="units", value=units, limit=names)
        _check(
            "no such file, or no kind of file that holds a casing",
            path.is_file() and kind in _KINDS,
            code="E-FILE",
            limit=f"a file {', '.join(_KINDS)}",
        )
        if kind in _ARRAYS:
            arrays = _stored(path, *UNITS[units])
        else:
            _check(
                "matrices and modes do not say where ring and sensors are",
                nodes is not None,
                code="E-KEY-MISSING",
                key="nodes",
                limit="a table of nodes (CSV)",
            )
            table = read_nodes(Path(nodes or ""))
            if kind in _UNIVERSAL:
                modes = _universal(path, table, *UNITS[units])
            else:
                matrices = dmig_matrices(path) if kind in _PUNCH else op4_matrices(path, table)
                modes = _modes(*matrices, table, *UNITS[units])
            arrays = _arrays(modes, table, direction, pitch_radius, max_diameter, units)
        given = {} if damping_ratio is None else {"damping_ratio": damping_ratio}
        structure = from_arrays(arrays | given, direction=direction, max_diameter=max_diameter)
        structure = structure.below(max_frequency)
        if expected_stiffness is not None:
            _check_units(structure, expected_stiffness, units)
    return structure


def output_names(nodes: Path) -> tuple[str, ...]:
    """Names of the outputs of a casing: its sensors, then "foot NAME x", "y" and "z", forces [N].

    Sensors of one name have their direction after it.
    """
    return sum(_output_names(read_nodes(nodes)), ())


def _output_names(table: Sequence[Node]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of sensors, and of the forces on feet."""
    names = [node.name for node in table if node.role == "sensor"]
    ways = [node.direction for node in table if node.role == "sensor"]
    sensors = (f"{name} {way}" if names.count(name) > 1 else name for name, way in zip(names, ways))
    return tuple(sensors), tuple(f"foot {name} {axis}" for name in _feet(table) for axis in "xyz")


def named_outputs(structure: FixedStructure, nodes: Path | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the sensors of a casing that was read, and of the forces on its feet; it has a sensor.

    Of arrays without a table of nodes "sensor 1" and so on. CaseError: E-COUNT, E-SHAPE.
    """
    count = structure.sensor_shape.shape[1]
    plain = tuple(f"sensor {i}" for i in range(1, count + 1))
    sensors, forces = (plain, ()) if nodes is None else _output_names(read_nodes(nodes))
    _check(
        "the casing has no sensor",
        len(sensors) > 0,
        code="E-COUNT",
        key="nodes",
        limit="one or more",
        remedy="give a node the role sensor NAME, or the arrays a sensor_shape",
    )
    _check(
        f"the table names {len(sensors)} sensors and {len(forces)} forces, the file has {count}",
        len(sensors) + len(forces) == count,
        code="E-SHAPE",
        key="nodes",
        limit=f"{count} outputs",
    )
    return sensors, forces


def mean_compliance(structure: FixedStructure) -> float:
    """Compute the static compliance along the line of action, mean around the path [m/N].

    ``sum_n C[n, n]`` of the circumferential coefficients C: the mean over phi of
    ``sum_n,n' exp(i n phi) C[n, n'] exp(-i n' phi)``.
    """
    shape = structure.ring_shape / structure.natural_frequency[:, None]
    return float((np.abs(shape) ** 2).sum() + np.trace(structure.residual).real)


def may_lack_compliance(path: Path) -> bool:
    """Tell whether a file holds modes alone, without the compliance of others: matrices have them all."""
    kind = path.suffix.lower()
    return kind in _UNIVERSAL or (kind in _ARRAYS and not np.any(_stored(path, 1.0, 1.0).get("ring_compliance", 0.0)))


def missing_compliance(structure: FixedStructure, expected_stiffness: float) -> tuple[Finding, ...]:
    """Say how much of the static compliance of the path is missing, against that of `read_casing`."""
    part = 1.0 - mean_compliance(structure) * expected_stiffness
    if part <= _MISSING:
        return ()
    also = "" if structure.residual.any() else ", and its modes come without residual"
    words = f"{100 * part:.0f} % of the static compliance that is expected of the ring is missing{also}"
    remedy = "export more modes, or residual vectors, or the reduced matrices"
    return (Finding("W-RESIDUAL", "housing.structure.file", words, remedy=remedy),)


def _check(message: str, ok: bool, **words: Any) -> None:
    """Refuse what is not as it must be."""
    if not ok:
        raise CaseError(message, **words)


@contextmanager
def file_in_refusals(path: Path) -> Iterator[None]:
    """Name the file in the refusals of the block; what a library says of a damaged one is E-FILE."""
    try:
        yield
    except CaseError as error:
        error.file = error.file or str(path)
        raise


@contextmanager
def foreign_refusals(words: str) -> Iterator[None]:
    """Turn what a library says of a damaged file into E-FILE."""
    try:
        yield
    except FemgearError:
        raise
    except Exception as error:
        text = " ".join(str(error).split())[:200]
        raise CaseError(f"no {words} that can be read: {text}", code="E-FILE", limit=words) from error


def read_nodes(path: Path, roles: Mapping[str, bool] = CASING_ROLES) -> tuple[Node, ...]:
    """Read the table of nodes of a casing, or of a body of other roles, each with whether a name follows it.

    CaseError: E-FILE, E-KEY-MISSING (columns), E-CHOICE (roles, directions), E-DUPLICATE (nodes).
    """
    with file_in_refusals(path):
        with foreign_refusals("table of nodes (CSV)"), open(path, newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream)
            rows, columns = list(reader), list(reader.fieldnames or ())
        _check(
            "the table of nodes lacks columns",
            {"node", "role"} <= set(columns),
            code="E-KEY-MISSING",
            key="nodes",
            value=", ".join(columns),
            limit="node, role; x, y, z, direction, dofs where needed",
        )
        table = tuple(_node({key: plain_cell((row[key] or "").strip()) for key in columns}, roles) for row in rows)
        ring = "ring" not in roles or any(node.role == "ring" for node in table)
        _check("no points of the ring", ring, code="E-COUNT", key="nodes", limit="nodes of the role ring")
        keys = [(node.number, node.role, node.direction * (node.role == "sensor")) for node in table]
        twice = [key for key in keys if keys.count(key) > 1]
        _check(
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
    _check(
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


def _feet(table: Sequence[Node]) -> list[str]:
    """Names of the feet, each once."""
    return list(dict.fromkeys(node.name for node in table if node.role == "foot"))


def _arrays(modes: _Modes, table, direction, pitch_radius, max_diameter, units) -> dict:
    """The arrays of `from_arrays` of modes in all coordinates of a file."""
    centre = next((UNITS[units][0] * node.position for node in table if node.role == "centre"), np.zeros(3))
    place = {number: position - centre for number, position in modes.position.items()}
    ring, sensors = ([node for node in table if node.role == role] for role in ("ring", "sensor"))
    lost = [node.number for node in (*ring, *sensors) if node.number not in place]
    _check(
        "nodes without coordinates",
        not lost,
        code="E-KEY-MISSING",
        key="nodes",
        value=lost[:9],
        limit="x, y, z in the file or in the table",
    )
    points = np.array([place[node.number] for node in ring]).reshape(-1, 3)
    angle = _ring_angles(points, [node.number for node in ring], pitch_radius, max_diameter, units)

    def motion(number: int, along: np.ndarray) -> np.ndarray:
        """Displacement of a node along a vector (3,), of unit coordinates (r,)."""
        row = np.zeros(modes.shape.shape[1])
        for component in np.flatnonzero(along):
            where = modes.row.get((number, int(component) + 1), -1)
            _check(
                "a node does not move in a direction that is needed",
                where >= 0,
                code="E-SHAPE",
                key="nodes",
                value=f"node {number}, component {component + 1}",
                limit="coordinates of matrices or modes",
                remedy="keep it in the reduction, name another node, or choose another direction",
            )
            row[where] = along[component]
        return row

    ways = [_directions(a) for a in angle]
    shape = [[motion(o.number, w[word]) for word in ("radial", "tangential")] for o, w in zip(ring, ways)]
    shape, across = np.array(shape), [np.arctan2(*place[sensor.number][1::-1]) for sensor in sensors]
    heard = [motion(sensor.number, _directions(a)[sensor.direction]) for sensor, a in zip(sensors, across)]
    heard = np.array(heard).reshape(len(sensors), modes.shape.shape[1])
    path = np.asarray(direction, float) @ shape
    outputs = np.hstack([modes.shape @ heard.T, modes.foot_force])
    direct = np.vstack([np.zeros_like(heard), modes.foot_direct])
    others = {} if modes.damping is None else {"damping_ratio": modes.damping}
    if modes.compliance is not None:
        others["ring_compliance"] = path @ modes.compliance @ path.T
        direct[: len(heard)] += heard @ modes.compliance
    return others | {
        "natural_frequency": modes.frequency,
        "ring_angle": angle,
        "ring_shape": np.moveaxis(shape @ modes.shape.T, -1, 0),
        "sensor_shape": outputs,
        "sensor_compliance": direct @ path.T,
    }


def _directions(angle: float) -> dict[str, np.ndarray]:
    """Unit vectors (3,) at an angle around the ring by the words for them, of either sign."""
    out, around = [np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0]
    words_and_vectors = zip(("radial", "tangential", "x", "y", "z"), np.array([out, around, *np.eye(3)]))
    return {sign + word: (-v if sign else v) for word, v in words_and_vectors for sign in ("", "-")}


def _ring_angles(place, number: list[int], pitch_radius: float, max_diameter: int, units: str) -> np.ndarray:
    """Angles (p,) of points (p, 3) [m] on the pitch circle around the origin, in a plane across z."""
    radius = np.hypot(place[:, 0], place[:, 1])
    times = np.median(radius) / pitch_radius
    _check(
        f"the points of the ring lie at {times:.4g} times the pitch radius: lengths of the file look like "
        f"{'mm' if times > 1 else 'm'}",
        not 300 < max(times, 1 / (times + 1e-9)) < 3000,
        code="E-UNITS",
        key="units",
        value=units,
        limit=", ".join(UNITS),
        remedy="give the units of the file",
    )
    off = np.hypot(radius - pitch_radius, place[:, 2] - np.median(place[:, 2])) / pitch_radius
    worst, millimetres = int(off.argmax()), 1e3 * pitch_radius
    _check(
        f"{(off > _OFF_CIRCLE).sum()} of {len(off)} points miss the ring",
        off[worst] <= _OFF_CIRCLE,
        code="E-RANGE",
        key="nodes",
        value=f"node {number[worst]}, {off[worst] * millimetres:.4g} mm off",
        limit=f"{_OFF_CIRCLE * millimetres:.4g} mm off the pitch circle of {millimetres:.6g} mm in one plane",
        remedy="give the centre of the ring, or nodes on the pitch circle",
    )
    angle = np.arctan2(place[:, 1], place[:, 0]) % (2 * np.pi)
    order = np.argsort(angle)
    gap = np.diff(angle[order], append=angle[order[0]] + 2 * np.pi)
    low, high = ([number[order[(at + i) % len(order)]] for i in (0, 1)] for at in (gap.argmin(), gap.argmax()))
    _check(
        "two nodes of the ring stand at the same angle",
        gap.min() > 1e-3 * 2 * np.pi / len(angle),
        code="E-DUPLICATE",
        key="nodes",
        value=f"nodes {low}",
        limit="one node at an angle",
        remedy="keep one of them",
    )
    _check(
        "the points leave a gap in the ring",
        gap.max() * max_diameter <= np.pi,
        code="E-RANGE",
        key="nodes",
        value=f"{np.degrees(gap.max()):.4g} deg between nodes {high}",
        limit=f"half a wave of {max_diameter} nodal diameters",
        remedy="give points all around, or lower housing.nodal_diameters",
    )
    return angle


def _check_units(structure: FixedStructure, expected: float, units: str) -> None:
    """Refuse a structure whose stiffness is that of another system of units (E-UNITS)."""
    _check(
        "the ring gives way nowhere: no modes, or shapes of zero",
        (soft := mean_compliance(structure)) > 0,
        code="E-COUNT",
        key="ring_shape",
        limit="modes that move the ring",
    )
    stiffness = 1.0 / soft
    power = 3 * round(np.log10(expected / stiffness) / 3)
    true = _STIFFNESS.get(power + round(np.log10(UNITS[units][1])), "others")
    _check(
        f"the ring has the mean stiffness {stiffness:.3g} N/m where {expected:.3g} N/m is expected: units of "
        f"the file look like {true}, not {units}",
        power == 0,
        code="E-UNITS",
        key="units",
        value=units,
        limit=", ".join(UNITS),
        remedy="give the units of the file, or export it in one of these",
    )


def _stored(path: Path, length: float, mass: float) -> dict[str, np.ndarray]:
    """Arrays of a file .npz or NetCDF by name in SI units, of units of length [m] and mass [kg]."""
    with foreign_refusals("arrays of a structure (.npz, NetCDF)"):
        if path.suffix.lower() == ".npz":
            with ZipFile(path) as archive:
                size = sum(archive.getinfo(f"{name}.npy").file_size for name in _named(archive.namelist()))
            check_array_size(size)
            with np.load(path, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in ARRAY_NAMES if name in stored}
        else:
            import xarray as xr

            with xr.open_dataset(path) as data:
                named = {name: data[name] for name in ARRAY_NAMES if name in data}
                check_array_size(sum(variable.nbytes for variable in named.values()))
                arrays = {name: value.values for name, value in named.items()}
    words = [name for name, value in arrays.items() if value.dtype.kind not in "buifc"]
    _check(
        "arrays that hold no numbers",
        not words,
        code="E-TYPE",
        key="arrays",
        value=", ".join(words),
        limit="numbers",
        remedy="export the array again",
    )
    # complex numbers are some if they have an imaginary part
    turned = [name for name, value in arrays.items() if np.iscomplexobj(value) and np.imag(value).any()]
    _check(
        "complex arrays",
        not turned,
        code="E-TYPE",
        key="arrays",
        value=", ".join(turned),
        limit="real numbers",
        remedy="give modes without damping, and damping ratios",
    )
    powers = {name: _POWERS.get(name, (0, 0)) for name in arrays}
    return {
        name: np.asarray(np.real(value), float) * mass ** powers[name][0] * length ** powers[name][1]
        for name, value in arrays.items()
    }


def _named(entries: Sequence[str]) -> list[str]:
    """Names of the arrays of a structure among the entries of an archive; others are never unpacked."""
    return [name for name in ARRAY_NAMES if f"{name}.npy" in entries]


def check_array_size(size: int) -> None:
    """Refuse arrays that fill more memory than any casing needs (E-MEMORY)."""
    _check(
        f"the arrays of the structure fill {size / 1e6:.0f} MB",
        size <= _MOST_BYTES,
        code="E-MEMORY",
        key="arrays",
        limit=f"{_MOST_BYTES / 1e6:.0f} MB",
        remedy="export fewer modes, points or sensors",
    )


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
    _check(
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
    _check(
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
    """Matrices of an ASCII OUTPUT4 file, as `dmig_matrices`."""
    with nvh_library("matrices of Nastran"):
        from pyNastran.op4.op4 import OP4
    with foreign_refusals("ASCII OP4"):
        matrices = OP4(debug=False).read_op4(str(path))
    entries = [getattr(entry, "data", entry) for entry in _pair(matrices)]
    entries = [matrix[1].toarray() if hasattr(matrix[1], "toarray") else np.asarray(matrix[1]) for matrix in entries]
    pairs = ((node.number, int(dof)) for node in table if node.role != "centre" for dof in node.dofs)
    labels = list(dict.fromkeys(pairs))
    sizes = {n for matrix in entries for n in matrix.shape}
    _check(
        f"matrices of {entries[0].shape} and {entries[1].shape} do not fit the {len(labels)} degrees of freedom "
        "of the table",
        len(sizes) == 1 and max(sizes) >= len(labels),
        code="E-SHAPE",
        key="nodes",
        limit=f"square, of one size, {len(labels)} rows or more",
        remedy="give all nodes of the matrices in their order, with their dofs",
    )
    return entries, {label: i for i, label in enumerate(labels)}, {}


def _modes(matrices, row, place, table: Sequence[Node], length: float, mass: float) -> _Modes:
    """Modes of a reduced stiffness and mass (r, r) in the units of the file, the feet held."""
    _check_matrices(matrices)
    # with time in seconds a stiffness scales as a mass; generalised coordinates take their units with them
    K, M = (0.5 * mass * np.real(matrix + matrix.T) for matrix in matrices)
    standing = [node for node in table if node.role == "foot"]
    feet = [[row.get((node.number, c), -1) for c in (1, 2, 3)] for node in standing]
    held = {node.number for node in standing}
    free = np.setdiff1d(np.arange(len(K)), [i for (number, _), i in row.items() if number in held])
    _check(
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
    _check(
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
    names = _feet(table)
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
    return _Modes(np.sqrt(square), phi, row, places, None, force, direct, compliance if len(light) else None)


def _check_matrices(matrices: Sequence[np.ndarray]) -> None:
    """Refuse stiffness and mass that are complex, not symmetric or not finite."""
    for matrix, name in zip(matrices, ("stiffness", "mass")):
        _check(
            "a complex matrix",
            not np.imag(matrix).any(),
            code="E-TYPE",
            key=name,
            limit="real numbers",
            remedy="leave structural damping out; give a damping ratio",
        )
        with np.errstate(invalid="ignore"):
            apart, largest = np.abs(matrix - matrix.T).max(), np.abs(matrix).max()
        _check(
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
    _check(
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


_BINARY = re.compile(rb"^ {4}-1[ ]*\r?\n +\d+b +\d+ +\d+ +(\d+) +(\d+)[^\n]*\n", re.MULTILINE)
"""Head of a binary dataset: byte order, format of numbers, lines of text and bytes that follow."""


def _without_binary(content: bytes) -> bytes:
    """Leave out the binary datasets (58b) of a universal file, whose bytes may look like anything."""
    while head := _BINARY.search(content):
        end = head.end()
        for _ in range(int(head[1])):
            end = content.index(b"\n", end) + 1
        end = content.index(b"    -1", end + int(head[2])) + len(b"    -1")
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
        _check(
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


def _universal(path: Path, table: Sequence[Node], length: float, mass: float) -> _Modes:
    """Modes of a universal file, datasets 55 or 2414, at the nodes of datasets 15 or 2411."""
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
    return _Modes(
        2 * np.pi * np.array([mode["freq"] for mode in modes], float),
        shape / np.sqrt(mass * weights)[:, None],
        row,
        {number: length * x for number, x in places.items()},
        damping if damping.any() else None,
        np.zeros((len(modes), 0)),
        np.zeros((0, len(shape.T))),
    )


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
    _check(
        "the file is in other units than told",
        not system or np.isclose(system[0] * length, 1.0, rtol=1e-3),
        code="E-UNITS",
        key="units",
        value=f"units of length a metre: {system[:1]}",
        limit=f"{1 / length:g}",
        remedy="give the units of the file",
    )
    real = all(mode["analysis_type"] == 2 and not np.iscomplexobj(mode["r1"]) for mode in modes)
    _check("complex modes", real, code="E-TYPE", key="modes", limit="real normal modes (analysis type 2)")
    kinds = sorted({int(dataset["type"]) for dataset in sets})
    _check(
        "the file holds no modes",
        len(modes) > 0,
        code="E-COUNT",
        key="modes",
        value=f"datasets {', '.join(map(str, kinds))}",
        limit="datasets 55, or 2414 of normal modes at nodes",
        remedy="export normal modes, displacements at nodes, in ASCII",
    )
    weights = np.array([mode["modal_m"] for mode in modes], float)
    _check(
        "modes without modal mass",
        bool((weights > 0).all()),
        code="E-MASS",
        key="modal mass",
        value=weights.tolist(),
        limit="above 0 in every dataset 55 or 2414",
        remedy="export modes with the modal mass that they are normalised to",
    )
    _check(
        "modes do not tell the forces on the feet",
        not _feet(table),
        code="E-SUPPORT",
        key="nodes",
        value=_feet(table),
        limit="feet with matrices",
        remedy="leave the feet out of the table, or export reduced matrices",
    )
    return weights
