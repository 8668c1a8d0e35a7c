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
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from zipfile import ZipFile

import numpy as np

from femgear.exchange.casing_modes import CasingModes, modes_of_matrices, modes_of_universal_file
from femgear.exchange.nastran_matrices import dmig_matrices, op4_matrices
from femgear.exchange.node_tables import (
    Node,
    feet_of,
    file_in_refusals,
    foreign_refusals,
    read_nodes,
    refuse_output2,
    require,
)
from femgear.findings import Finding
from femgear.housing.two_way.structure import ARRAY_NAMES, FixedStructure, from_arrays

UNITS = {"SI": (1.0, 1.0), "mm-t-s": (1e-3, 1e3)}
"""Systems of units: metres and kilograms of the units of length and mass; time is in seconds."""
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
_MOST_BYTES = 1_000_000_000  # of all arrays of a structure: 1000 modes at 1000 points take 16 MB
_MISSING = 0.05  # part of the static compliance that may be missing without a word


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
        refuse_output2(path)
        require("no such units", units in UNITS, code="E-CHOICE", key="units", value=units, limit=names)
        require(
            "no such file, or no kind of file that holds a casing",
            path.is_file() and kind in _KINDS,
            code="E-FILE",
            limit=f"a file {', '.join(_KINDS)}",
        )
        if kind in _ARRAYS:
            arrays = _stored(path, *UNITS[units])
        else:
            require(
                "matrices and modes do not say where ring and sensors are",
                nodes is not None,
                code="E-KEY-MISSING",
                key="nodes",
                limit="a table of nodes (CSV)",
            )
            table = read_nodes(Path(nodes or ""))
            if kind in _UNIVERSAL:
                modes = modes_of_universal_file(path, table, *UNITS[units])
            else:
                matrices = dmig_matrices(path) if kind in _PUNCH else op4_matrices(path, table)
                modes = modes_of_matrices(*matrices, table, *UNITS[units])
            arrays = _arrays(modes, table, direction, pitch_radius, max_diameter, units)
        given = {} if damping_ratio is None else {"damping_ratio": damping_ratio}
        structure = from_arrays(arrays | given, direction=direction, max_diameter=max_diameter)
        structure = structure.below(max_frequency)
        if expected_stiffness is not None:
            _check_units(structure, expected_stiffness, units)
    return structure


def output_names(nodes: Path) -> tuple[str, ...]:
    """List the outputs of a casing by name: its sensors, then "foot NAME x", "y" and "z", forces [N].

    Sensors of one name have their direction after it.
    """
    return sum(_output_names(read_nodes(nodes)), ())


def _output_names(table: Sequence[Node]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of sensors, and of the forces on feet."""
    names = [node.name for node in table if node.role == "sensor"]
    ways = [node.direction for node in table if node.role == "sensor"]
    sensors = (f"{name} {way}" if names.count(name) > 1 else name for name, way in zip(names, ways))
    return tuple(sensors), tuple(f"foot {name} {axis}" for name in feet_of(table) for axis in "xyz")


def named_outputs(structure: FixedStructure, nodes: Path | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the sensors of a casing that was read, and of the forces on its feet; it has a sensor.

    Of arrays without a table of nodes "sensor 1" and so on. CaseError: E-COUNT, E-SHAPE.
    """
    count = structure.sensor_shape.shape[1]
    plain = tuple(f"sensor {i}" for i in range(1, count + 1))
    sensors, forces = (plain, ()) if nodes is None else _output_names(read_nodes(nodes))
    require(
        "the casing has no sensor",
        len(sensors) > 0,
        code="E-COUNT",
        key="nodes",
        limit="one or more",
        remedy="give a node the role sensor NAME, or the arrays a sensor_shape",
    )
    require(
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


def _arrays(modes: CasingModes, table, direction, pitch_radius, max_diameter, units) -> dict:
    """The arrays of `from_arrays` of modes in all coordinates of a file."""
    centre = next((UNITS[units][0] * node.position for node in table if node.role == "centre"), np.zeros(3))
    place = {number: position - centre for number, position in modes.position.items()}
    ring, sensors = ([node for node in table if node.role == role] for role in ("ring", "sensor"))
    lost = [node.number for node in (*ring, *sensors) if node.number not in place]
    require(
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
            require(
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
    sensor_rows = [motion(sensor.number, _directions(a)[sensor.direction]) for sensor, a in zip(sensors, across)]
    sensor_rows = np.array(sensor_rows).reshape(len(sensors), modes.shape.shape[1])
    path = np.asarray(direction, float) @ shape
    outputs = np.hstack([modes.shape @ sensor_rows.T, modes.foot_force])
    direct = np.vstack([np.zeros_like(sensor_rows), modes.foot_direct])
    others = {} if modes.damping is None else {"damping_ratio": modes.damping}
    if modes.compliance is not None:
        others["ring_compliance"] = path @ modes.compliance @ path.T
        direct[: len(sensor_rows)] += sensor_rows @ modes.compliance
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
    require(
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
    require(
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
    require(
        "two nodes of the ring stand at the same angle",
        gap.min() > 1e-3 * 2 * np.pi / len(angle),
        code="E-DUPLICATE",
        key="nodes",
        value=f"nodes {low}",
        limit="one node at an angle",
        remedy="keep one of them",
    )
    require(
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
    require(
        "the ring gives way nowhere: no modes, or shapes of zero",
        (soft := mean_compliance(structure)) > 0,
        code="E-COUNT",
        key="ring_shape",
        limit="modes that move the ring",
    )
    stiffness = 1.0 / soft
    power = 3 * round(np.log10(expected / stiffness) / 3)
    true = _STIFFNESS.get(power + round(np.log10(UNITS[units][1])), "others")
    require(
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
    require(
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
    require(
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
    require(
        f"the arrays of the structure fill {size / 1e6:.0f} MB",
        size <= _MOST_BYTES,
        code="E-MEMORY",
        key="arrays",
        limit=f"{_MOST_BYTES / 1e6:.0f} MB",
        remedy="export fewer modes, points or sensors",
    )
