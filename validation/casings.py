"""Casings of whole gearboxes: on rigid feet, closed forms, matrices written out, files, and a meshed one as a whole."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from casing import Casing, assembled
from casings import (
    CENTRE,
    FEET,
    MASS,
    STIFFNESS,
    TENSOR,
    body_matrices_of,
    casing_paths,
    casing_tables,
    rigid_matrices,
    rigid_tables,
    write_casing_file,
)
from casings import Path as CasingPath
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, eigsh, splu
from small_gearbox import pair_tables

from femgear.case import text
from femgear.fe.beam import rigid_link
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.reading import read_case
from validation.rows import Row, at_most, information, within

CLOSED = "closed form"
NONE = "no casing"
WRITTEN = "matrices written out, scipy.linalg"
LARGEST = 1e-9
SEAT, FOOT = (3e8, 3e8, 5e8, 7e4, 7e4, 9e4), (4e8, 6e8, 2e8)
TIE, INNER, COMPARED = 5e9, 60, 12
"""Stiffness between a meshed surface and its node [N/m], inner modes of the reduction, elastic modes compared."""


def _apart(computed, expected) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(np.subtract(computed, expected)).max() / np.abs(expected).max())


def _solved(tables: dict[str, Any], folder: str | None = None) -> Deflection:
    """Loaded state of tables, beside the files of a folder."""
    if folder is None:
        return solve_deflection(read_case(tables))
    path = Path(folder) / "box.toml"
    path.write_text(text.write(tables), encoding="utf-8")
    return solve_deflection(read_case(str(path)))


def _frequencies(state: Deflection) -> np.ndarray:
    """Elastic natural frequencies [Hz]."""
    frequency = solve_gearbox_modes(state).modes.frequency
    return frequency[frequency > 0.0]


def on_feet() -> tuple[Row, ...]:
    """A rigid casing: nothing moves on rigid feet, feet balance, two feet carry the torques, all written out."""
    tables = pair_tables(helix="15 deg") | {"gravity": {}}
    still = _solved(tables)
    held = _solved(tables | {"casing": casing_tables("rigid")})
    stiff = _solved(tables | {"casing": casing_tables((1e15, 1e15, 1e15))})
    loose = _solved(tables | {"casing": casing_tables()})
    count = len(still.motion)
    name = "pair, 15 deg"
    rows = [
        at_most(name, NONE, "motion on rigid feet, relative", LARGEST, _apart(held.motion[:count], still.motion)),
        at_most(name, NONE, "modes on rigid feet", LARGEST, _apart(_frequencies(held), _frequencies(still))),
        at_most(
            name,
            NONE,
            "motion on feet of 1e15 N/m, relative",
            1e-6,
            _apart(stiff.motion[:count], still.motion),
            note="as the stiffness of the bearings over that of the feet",
        ),
    ]
    load, places = loose.model.load.reshape(-1, 6), np.asarray(loose.model.assembly.places)
    feet, force = np.array(list(FEET.values())) / 1e3, loose.foot_force
    total = np.append(
        load[:, :3].sum(axis=0) + force.sum(axis=0),
        (load[:, 3:] + np.cross(places, load[:, :3])).sum(axis=0) + np.cross(feet, force).sum(axis=0),
    )
    largest = np.abs(loose.bearing_force).max()
    what = "feet, weight and torques out of balance, over the largest bearing force"
    rows.append(at_most(name, "equilibrium", what, LARGEST, np.abs(total).max() / largest))
    plane = pair_tables() | {"motions": "plane", "casing": casing_tables()}
    plane["casing"]["foot"] = [
        {"position": [x, "-100 mm", "40 mm"], "stiffness": ["1e8 N/m", "1e8 N/m", "0 N/m"]}
        for x in ("-80 mm", "180 mm")
    ]
    force = _solved(plane).foot_force[0, 1]
    rows.append(
        within("pair on two feet", CLOSED, "force of a foot [N]: torques over distance", 250 / 0.26, force, LARGEST)
    )
    return (*rows, *_written_out())


def _written_out() -> list[Row]:
    """Two rigid gears in a rigid casing against their matrices."""
    mass, stiffness, load = rigid_matrices()
    state, name = _solved(rigid_tables()), "two rigid gears, casing"
    free = np.setdiff1d(np.arange(18), [5])
    motion = np.zeros(18)
    motion[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load[free])
    square = eigh(stiffness, mass, eigvals_only=True)[1:]
    expected = np.sqrt(square) / (2.0 * np.pi)
    rows = [
        at_most(name, WRITTEN, "motion at the load, relative", LARGEST, _apart(state.motion, motion)),
        at_most(name, WRITTEN, "natural frequencies, relative", LARGEST, _apart(_frequencies(state), expected)),
    ]
    tables = rigid_tables()
    for bearing in tables["bearing"]:
        bearing |= {"radial": "1 N/m", "axial": "1 N/m", "tilt": "1e-3 N m/rad"}
    tables["casing"] |= {"products": ["0 kg m^2"] * 3}
    for foot, way in zip(tables["casing"]["foot"], ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)), strict=True):
        foot["position"] = [f"{value!r} m" for value in (CENTRE + 0.1 * np.array(way)).tolist()]
    tables["operation"]["load_case"][0]["torque"]["input"] = "1e-6 N m"
    k, inertia = 4.0 * np.array(STIFFNESS), np.diag(TENSOR)
    alone = np.append(k / MASS, 0.1**2 * (k.sum() - k) / inertia)
    modes = solve_gearbox_modes(_solved(tables)).modes
    casing_modes = [hertz for hertz, kind in zip(modes.frequency, modes.kind, strict=True) if kind == "casing"]
    worst = _apart(casing_modes, np.sort(np.sqrt(alone)) / (2.0 * np.pi)) if len(casing_modes) == 6 else math.inf
    rows.append(at_most("casing on its feet", "sqrt(k/m)", "six natural frequencies, relative", 1e-7, worst))
    return rows


def of_files() -> tuple[Row, ...]:
    """Casings of files: a rigid body, elastic paths as springs of the case, all written out."""
    rows = []
    with TemporaryDirectory() as folder:
        paths = casing_paths([1e18] * 6, [1e18] * 3)
        rigid = _solved(_whole_body(paths))
        state = _solved(_of_file(folder, paths), folder)
        name, source = "file of a rigid body", "the rigid casing"
        rows.append(
            at_most(name, source, "forces of feet, relative", LARGEST, _apart(state.foot_force, rigid.foot_force))
        )
        worst = _apart(_frequencies(state), _frequencies(rigid))
        rows.append(at_most(name, source, "natural frequencies, relative", LARGEST, worst))
    with TemporaryDirectory() as folder:
        paths = casing_paths(SEAT, FOOT)
        state = _solved(_of_file(folder, paths), folder)
        springs = _solved(_springs_in_series())
        name, source = "file of elastic paths", "springs in series"
        rows.append(
            at_most(name, source, "forces of feet, relative", LARGEST, _apart(state.foot_force, springs.foot_force))
        )
        worst = _apart(state.motion[:12], springs.motion[:12])
        rows.append(at_most(name, source, "motions of the gears, relative", LARGEST, worst))
        stiffness, mass = _system(*body_matrices_of(paths), 6)
        expected = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[1:]) / (2.0 * np.pi)
        frequencies = _frequencies(state)
        rows.append(
            at_most(
                name,
                WRITTEN,
                "natural frequencies, relative",
                LARGEST,
                _apart(frequencies, expected[: len(frequencies)]),
            )
        )
    return tuple(rows)


def _of_file(folder: str, paths: Sequence[CasingPath], matrices=None) -> dict[str, Any]:
    """Tables of two rigid gears in the casing of a file."""
    feet = [
        {"name": foot["name"], "stiffness": foot["stiffness"]}
        for foot in rigid_tables()["casing"]["foot"]
        if foot["name"] in {path.name for path in paths}
    ]
    return rigid_tables() | {"casing": write_casing_file(Path(folder), paths, matrices) | {"foot": feet}}


def _whole_body(paths: Sequence[CasingPath]) -> dict[str, Any]:
    """Tables with the rigid casing that has the masses of a file."""
    masses, places = np.array([MASS, *(p.mass for p in paths)]), np.array([CENTRE, *(p.place for p in paths)])
    centre, tensor = masses @ places / masses.sum(), TENSOR.copy()
    for path in paths:
        tensor = tensor + np.eye(3) * path.mass * 1e-4 * (len(path.stiffness) == 6)
    for mass, away in zip(masses, places - centre, strict=True):
        tensor = tensor + mass * (away @ away * np.eye(3) - np.outer(away, away))
    tables = rigid_tables()
    tables["casing"] |= {
        "mass": f"{float(masses.sum())!r} kg",
        "centre": [f"{value!r} m" for value in centre.tolist()],
        "inertia": [f"{value!r} kg m^2" for value in np.diag(tensor).tolist()],
        "products": [f"{-float(tensor[i, j])!r} kg m^2" for i, j in ((0, 1), (0, 2), (1, 2))],
    }
    return tables


def _springs_in_series() -> dict[str, Any]:
    """Tables of a rigid casing whose bearings and feet have the paths of a file in series."""

    def series(*stiffness: float) -> float:
        return 1.0 / sum(1.0 / value for value in stiffness)

    tables = rigid_tables()
    for bearing in tables["bearing"]:
        bearing |= {"radial": f"{series(2e8, 3e8)!r} N/m", "axial": f"{series(1e8, 5e8)!r} N/m"}
        bearing["tilt"] = f"{series(3e4, 7e4)!r} N m/rad"
    for foot in tables["casing"]["foot"]:
        foot["stiffness"] = [f"{series(a, b)!r} N/m" for a, b in zip(FOOT, STIFFNESS, strict=True)]
    return tables


def _system(K, M, first: int):
    """Stiffness and mass of two rigid gears, bearings, mesh and feet on those of a casing, as its arrays are.

    Its rows from ``first`` on are four seats of six coordinates and four feet of three; sparse if it is.
    """
    size = 12 + K.shape[0]
    lil = sparse.lil_matrix((size, size))
    for number in range(4):
        body, z = number // 2, (-0.04, 0.04)[number % 2]
        rows = np.zeros((6, 12))
        rows[:, :6], rows[:, 6:] = rigid_link((0.0, 0.0, z)), -np.eye(6)
        at = [*range(6 * body, 6 * body + 6), *range(12 + first + 6 * number, 18 + first + 6 * number)]
        lil[np.ix_(at, at)] += rows.T @ np.diag([2e8, 2e8, 1e8, 3e4, 3e4, 0.0]) @ rows
    for number in range(4):
        for way, value in enumerate(STIFFNESS):
            at = 12 + first + 24 + 3 * number + way
            lil[at, at] += value
    normal, approach = np.array([np.sin(np.radians(20.0)), np.cos(np.radians(20.0)), 0.0]), np.zeros(12)
    for body, x in ((0, 0.036), (1, -0.054)):
        approach[6 * body : 6 * body + 6] = (1 - 2 * body) * normal @ rigid_link((x, 0.0, 0.0))[:3]
    lil[:12, :12] += 4e8 * np.outer(approach, approach)
    gears = np.diag([3.0, 3.0, 3.0, 5e-3, 5e-3, 4e-3, 6.0, 6.0, 6.0, 8e-3, 8e-3, 9e-3])
    stiffness = sparse.csc_matrix(lil) + sparse.block_diag([np.zeros((12, 12)), K], format="csc")
    mass = sparse.block_diag([gears, M], format="csc")
    return (stiffness, mass) if sparse.issparse(K) else (stiffness.toarray(), mass.toarray())


def meshed() -> tuple[Row, ...]:
    """A casing of finite elements: the gearbox with its superelement against all elements with the gearbox."""
    K, M, paths = _meshed_casing()
    size, count = K.shape[0], 36
    inner = size - count
    stiffness, mass = _system(K, M, inner)
    load = np.zeros(stiffness.shape[0])
    load[5], load[11] = 100.0, 150.0
    free = np.setdiff1d(np.arange(len(load)), [5])
    motion = np.zeros(len(load))
    motion[free] = splu(stiffness[free][:, free]).solve(load[free])
    shift = (2.0 * np.pi * 50.0) ** 2
    lu = splu((stiffness + shift * mass).tocsc())
    inverse = LinearOperator(mass.shape, lu.solve, dtype=float)
    square = eigsh(stiffness, COMPARED + 1, mass, sigma=-shift, OPinv=inverse, v0=np.ones(len(load)))[0]
    expected = np.sqrt(np.sort(square)[1:]) / (2.0 * np.pi)
    with TemporaryDirectory() as folder:
        tables = _of_file(folder, paths, _reduced(K, M, inner))
        lines = (Path(folder) / "nodes.csv").read_text(encoding="utf-8").splitlines()
        # the inner modes are of no node
        (Path(folder) / "nodes.csv").write_text("\n".join([lines[0], *lines[2:]]), encoding="utf-8")
        state = _solved(tables, folder)
        frequencies = _frequencies(state)[:COMPARED]
    feet = -motion[-12:].reshape(4, 3) * np.array(STIFFNESS)
    name, source = "meshed casing with ring", f"all {size} coordinates of the finite elements"
    return (
        information(
            name, "a casing that stands still", "lowest natural frequency [Hz]", _lowest_without(), frequencies[0]
        ),
        at_most(name, source, "motions of the gears, relative", 1e-7, _apart(state.motion[:12], motion[:12])),
        at_most(name, source, "forces of feet, relative", 1e-7, _apart(state.foot_force, feet)),
        at_most(
            name,
            source,
            f"first {COMPARED} natural frequencies with {INNER} inner modes, relative",
            1e-3,
            float(np.abs(frequencies / expected - 1.0).max()),
        ),
    )


def _lowest_without() -> float:
    """Lowest natural frequency of the gears in a casing that stands still [Hz]."""
    tables = rigid_tables()
    del tables["casing"]
    return float(_frequencies(_solved(tables))[0])


def _meshed_casing():
    """Stiffness and mass of a meshed ring with flange and feet, with seats and feet tied to its surface, and these.

    Coordinates of the elements come first, then four seats of six and four feet of three coordinates.
    """
    casing = Casing(size=0.02)
    basis, K, M = assembled(casing)
    points = basis.mesh.p.T
    angle = np.arctan2(points[:, 1], points[:, 0])
    bore = np.abs(np.hypot(points[:, 0], points[:, 1]) - casing.bore) < 1e-6
    paths, columns = [], []
    quarters = np.floor((angle + math.pi) / (0.5 * math.pi)).clip(0, 3)
    for number, path in enumerate(casing_paths(SEAT, FOOT)[:4]):
        columns.append(_mean_motion(basis, bore & (quarters == number), path.place))
        paths.append(path)
    below = points[:, 1] < 1e-6 - casing.base
    for name, side, half in (("left front", -1, -1), ("left rear", -1, 1), ("right front", 1, -1), ("right", 1, 1)):
        chosen = below & (side * points[:, 0] > 0) & (half * points[:, 2] >= -1e-9)
        place = points[chosen].mean(axis=0)
        columns.append(_mean_motion(basis, chosen, place)[:, :3])
        paths.append(CasingPath("foot", name, tuple(place.tolist()), FOOT))
    W = sparse.csc_matrix(np.hstack(columns))
    ways = np.concatenate([np.tile([TIE] * 3 + [1e-2 * TIE] * 3, 4), np.full(12, TIE)])
    k = sparse.diags(ways)
    light = np.concatenate([np.tile([0.05] * 3 + [5e-6] * 3, 4), np.full(12, 0.05)])
    stiffness = sparse.bmat([[K + W @ k @ W.T, -W @ k], [-k @ W.T, k]], format="csc")
    return stiffness, sparse.block_diag([M, sparse.diags(light)], format="csc"), paths


def _mean_motion(basis, chosen: np.ndarray, place) -> np.ndarray:
    """Columns (n, 6): motion at a place of the rigid body nearest to that of chosen vertices, by least squares."""
    vertices = np.flatnonzero(chosen)
    rows = np.vstack([rigid_link(basis.mesh.p[:, v] - place)[:3] for v in vertices])
    columns = np.zeros((basis.N, 6))
    columns[basis.nodal_dofs[:, vertices].T.ravel()] = np.linalg.pinv(rows).T
    return columns


def _reduced(K, M, inner: int) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass on the coordinates from ``inner`` on and `INNER` modes with these held, which come last."""
    lu = splu(K[:inner, :inner].tocsc())
    inverse = LinearOperator((inner, inner), lu.solve, dtype=float)
    shapes = eigsh(K[:inner, :inner], INNER, M[:inner, :inner], sigma=0.0, OPinv=inverse, v0=np.ones(inner))[1]
    count = K.shape[0] - inner
    T = np.zeros((K.shape[0], count + INNER))
    T[:inner, :count] = -lu.solve(K[:inner, inner:].toarray())
    T[inner:, :count] = np.eye(count)
    T[:inner, count:] = shapes
    return tuple(0.5 * (m + m.T) for m in (T.T @ (K @ T), T.T @ (M @ T)))  # type: ignore[return-value]
