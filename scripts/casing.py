#!/usr/bin/env python3
"""A casing as another program would export it: ring gear body with flange and feet, in four formats."""

from __future__ import annotations

import sys
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from scipy.linalg import eigh
from scipy.sparse import coo_array
from scipy.sparse.linalg import LinearOperator, eigsh, splu
from script_tools import Progress, meshed, print_table, ready_folder, run_script, say_files

from femgear.errors import CaseError
from femgear.exchange.formats import Shapes, write_modes
from femgear.storage.files import replaced_file, write_csv, write_text

FILES = (
    "casing.npz",
    "casing.pch",
    "casing.op4",
    "casing.uff",
    "nodes.csv",
    "nodes_held.csv",
    "surface.npz",
)
E, NU, RHO, DAMPING = 206e9, 0.3, 7850.0, 0.02
PART = 0.03  # of the surface that moves as one, edge of the grid [m]
GEOMETRY = """SetFactory("OpenCASCADE");
Cylinder(1) = {{0, 0, {bottom}, 0, 0, {width}, {outer}}};
{parts}
Cylinder(90) = {{0, 0, -1, 0, 0, 2, {bore}}};
BooleanDifference(91) = {{ Volume{{:}}; Delete; }}{{ Volume{{90}}; Delete; }};
Mesh.MeshSizeMax = {size}; Mesh.RandomSeed = 1; General.NumThreads = 1;
"""
HOUSED = """Cylinder(2) = {{0, 0, {bottom}, 0, 0, {flange_width}, {flange}}};
Box(3) = {{-{foot_end}, -{base}, {bottom}, {foot}, {foot_height}, {width}}};
Box(4) = {{{foot_end} - {foot}, -{base}, {bottom}, {foot}, {foot_height}, {width}}};
BooleanUnion(5) = {{ Volume{{1}}; Delete; }}{{ Volume{{2:4}}; Delete; }};
"""


@dataclass(frozen=True)
class Casing:
    """Sizes of the casing [m]; its bore is the pitch circle of the reference case's ring, without teeth.

    ``size`` of the elements, tetrahedra of ten nodes with straight edges; ``points`` of the ring in the
    files; ``modes``, the lowest of the clamped casing, kept beside the static shapes; ``housed``, with flange
    and feet, else the free annulus.
    """

    size: float = 0.009
    points: int = 56
    modes: int = 20
    housed: bool = True
    bore: float = 0.081
    outer: float = 0.1
    width: float = 0.025
    flange: float = 0.118
    flange_width: float = 0.008
    base: float = 0.13
    foot: float = 0.035
    foot_end: float = 0.09
    foot_height: float = 0.08


def assembled(casing: Casing):
    """Basis, stiffness [N/m] and mass [kg] of the casing, nothing held; Gmsh runs in a process of its own."""
    from skfem import Basis, BilinearForm, ElementTetP2, ElementVector
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    names = {"bottom": -casing.width / 2, **vars(casing)}
    parts = HOUSED.format(**names) if casing.housed else ""
    mesh, element = meshed(GEOMETRY.format(parts=parts, **names)), ElementVector(ElementTetP2())
    K = linear_elasticity(*lame_parameters(E, NU)).assemble(Basis(mesh, element, intorder=2))
    basis = Basis(mesh, element, intorder=4)
    return basis, K.tocsc(), BilinearForm(lambda u, v, w: RHO * dot(u, v)).assemble(basis).tocsc()


def means_of_bore(casing: Casing, basis) -> np.ndarray:
    """Columns (n, 2 points): mean displacement of the bore around every point, x and y in turn.

    The weight falls linearly over the angle from one at the point to zero at its neighbours, and is constant
    over the width: a force at a point is spread like that.
    """
    from skfem import FacetBasis, LinearForm

    step, columns = 2 * np.pi / casing.points, np.zeros((basis.N, 2 * casing.points))
    bore = basis.mesh.facets_satisfying(
        lambda x: (np.hypot(x[0], x[1]) < casing.bore + 1e-6) & (np.abs(x[2]) < 0.499 * casing.width),
        boundaries_only=True,
    )
    surface = FacetBasis(basis.mesh, basis.elem, facets=bore, intorder=6)
    for i in range(casing.points):

        def weight(w, i=i):
            away = np.angle(np.exp(1j * (np.arctan2(w.x[1], w.x[0]) - i * step)))
            return np.clip(1 - np.abs(away) / step, 0, None)

        for c in range(2):
            column = LinearForm(lambda v, w, c=c: weight(w) * v[c]).assemble(surface)
            columns[:, 2 * i + c] = column / column.sum()
    return columns


def reduced(casing: Casing):
    """Stiffness and mass (r, r) on the nodes of the files and internal coordinates, those nodes, the surface.

    Nodes are (role, dofs, position): ring, sensors, feet. A foot is the lower face of a block and moves
    without turning. Of the surface the motion of its parts (parts, r) in these coordinates, and their areas.
    """
    basis, K, M = assembled(casing)
    mesh, angle = basis.mesh, 2 * np.pi * np.arange(casing.points) / casing.points

    def unit(dofs) -> np.ndarray:
        columns = np.zeros((basis.N, len(dofs)))
        columns[dofs, np.arange(len(dofs))] = 1.0
        return columns

    nodes = [("ring", "12", casing.bore * np.array([np.cos(a), np.sin(a), 0.0])) for a in angle]
    watched, carried = [means_of_bore(casing, basis)], []
    half = casing.width / 2
    for name, place in (("top", (0.0, casing.outer, half)), ("flange", (casing.flange, 0.0, -half))):
        vertex = int(np.linalg.norm(mesh.p.T - place, axis=1).argmin())
        nodes.append((f"sensor {name}", "123", mesh.p[:, vertex]))
        watched.append(unit(basis.nodal_dofs[:, vertex]))
    below = mesh.facets_satisfying(lambda x: x[1] < 1e-6 - casing.base, boundaries_only=True)
    for name, side in (("left", -1), ("right", 1)):
        chosen = below[side * mesh.p[0][mesh.facets[:, below]].mean(axis=0) > 0]
        dofs = basis.get_dofs(chosen)
        carried += [unit(dofs.all(f"u^{c}")).sum(axis=1) for c in (1, 2, 3)]
        middle = np.array([side * (casing.foot_end - casing.foot / 2), -casing.base, 0.0])
        nodes.append((f"foot {name}", "123", middle))
    K, M, T = condensed(K, M, np.hstack(watched), np.array(carried).T, casing.modes)
    across, area = parts_of_surface(casing, basis)
    return K, M, nodes, (across.T @ T, area)


def parts_of_surface(casing: Casing, basis) -> tuple[np.ndarray, np.ndarray]:
    """Columns (n, parts): mean displacement outwards of parts of the outer surface; areas (parts,) [m^2].

    A part has one side and lies in one cube of a grid: short against the waves of the casing. The bore and
    the lower faces of the feet belong to no part.
    """
    from skfem import FacetBasis, LinearForm
    from skfem.helpers import dot

    mesh, outside = basis.mesh, basis.mesh.boundary_facets()
    x = mesh.p[:, mesh.facets[:, outside]]
    bore = (np.hypot(x[0], x[1]) < casing.bore + 1e-6).all(axis=0)
    outside = outside[~bore & ~(x[1] < 1e-6 - casing.base).all(axis=0)]
    normal = np.asarray(FacetBasis(mesh, basis.elem, facets=outside, intorder=1).normals)[:, :, 0]
    middle = mesh.p[:, mesh.facets[:, outside]].mean(axis=1)
    keys = np.vstack([np.rint(2 * normal), np.floor(middle / PART)]).astype(int)
    part = np.unique(keys, axis=1, return_inverse=True)[1].ravel()
    surface = FacetBasis(mesh, basis.elem, facets=outside, intorder=2)
    area = np.bincount(part, surface.dx.sum(axis=1))
    flow = LinearForm(lambda v, w: dot(v, w.n)).elemental(surface)
    # of every shape function of an element the facets follow one another
    parts = np.tile(part, len(flow.data) // len(part))
    columns = coo_array((flow.data, (flow.indices[0], parts)), shape=(basis.N, len(area)))
    return columns.toarray() / area, area


def condensed(K, M, watched, carried, modes: int):
    """Stiffness and mass on watched means (columns), bodies that are carried (columns) and internal modes.

    And the displacements (n, r) of these coordinates.

    R. R. Craig and M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319, the internal shapes from the lowest modes
    with the bodies held: statics and those modes are exact.
    """
    free = np.flatnonzero(~carried.any(axis=1))
    inner, B = K[free][:, free].tocsc(), watched[free]
    lu = splu(inner, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    inverse = LinearOperator(inner.shape, lu.solve, dtype=float)
    shapes = eigsh(inner, modes, M[free][:, free], sigma=0.0, OPinv=inverse, v0=np.ones(len(free)))[1]
    moved = -lu.solve(K[free] @ carried)
    static = lu.solve(B)
    static = np.linalg.solve((B.T @ static).T, static.T).T  # each mean moved by one, the others held
    T = np.zeros((len(watched), watched.shape[1] + carried.shape[1] + modes))
    T[free] = np.hstack([static, *(motions - static @ (B.T @ motions) for motions in (moved, shapes))])
    T[:, watched.shape[1] : -modes] += carried
    internal = T[:, -modes:]
    T[:, -modes:] = internal @ np.linalg.inv(np.linalg.cholesky(internal.T @ (M @ internal))).T
    return T.T @ (K @ T), T.T @ (M @ T), T


def six_digits(values) -> np.ndarray:
    """Numbers as a universal file holds them."""
    return np.array([float(f"{value:.5e}") for value in np.ravel(values)]).reshape(np.shape(values))


def in_six_digits(K, M, nodes):
    """Modes with the feet held, in the six digits of a universal file, and the matrices that have them.

    Frequency [Hz], shape (m, r) of all free coordinates, stiffness, mass.
    """
    row = np.cumsum([0, *(len(dofs) for _, dofs, _ in nodes)])
    first = next(i for i, node in enumerate(nodes) if node[0].startswith("foot"))
    free = np.setdiff1d(np.arange(len(K)), np.arange(row[first], row[-1]))
    square, shape = eigh(K[np.ix_(free, free)], M[np.ix_(free, free)])
    frequency, shape = six_digits(np.sqrt(square) / (2 * np.pi)), six_digits(shape)
    back, K, M = np.linalg.inv(shape), K.copy(), M.copy()
    K[np.ix_(free, free)] = back.T @ ((2 * np.pi * frequency) ** 2 * back.T).T
    M[np.ix_(free, free)] = back.T @ back
    return frequency, shape, K, M


def card(value: float) -> str:
    """A number in the sixteen columns of a large field of Nastran."""
    for digits in (11, 10, 9):
        mantissa, power = f"{value:.{digits}E}".split("E")
        if len(text := f"{mantissa}{int(power):+d}") <= 16:
            return f"{text:>16}"
    raise ValueError(value)


def punch(K, M, nodes) -> str:
    """GRID, SPOINT and DMIG cards of Nastran: KAAX and MAAX, the lower triangle."""
    labels = [(n, int(c)) for n, (_, dofs, _) in enumerate(nodes, 1) for c in dofs]
    labels += [(100000 + i, 0) for i in range(len(K) - len(labels))]
    lines = [f"SPOINT  {number:8d}" for number, c in labels if c == 0]
    for number, (_, _, x) in enumerate(nodes, 1):
        lines += [f"GRID*   {number:16d}{'':16}{card(x[0])}{card(x[1])}", f"*       {card(x[2])}"]
    for name, matrix in (("KAAX", K), ("MAAX", M)):
        lines.append(f"DMIG    {name:8}{0:8d}{6:8d}{2:8d}{0:8d}")
        for j, (g, c) in enumerate(labels):
            lines.append(f"DMIG*   {name:16}{g:16d}{c:16d}")
            below = zip(labels[j:], matrix[j:, j])
            lines += [f"*       {g:16d}{c:16d}{card(value)}" for (g, c), value in below if value]
    return "\n".join(lines) + "\n"


def write_casing(casing: Casing, folder: Path) -> None:
    """Write all files of a casing."""
    from pyNastran.op4.op4 import OP4

    K, M, nodes, (across, area) = reduced(casing)
    nodes = [(role, dofs, six_digits(x)) for role, dofs, x in nodes]
    frequency, shape, K, M = in_six_digits(K, M, nodes)
    p, omega = casing.points, 2 * np.pi * frequency
    angle = np.arctan2(*np.array([x[1::-1] for _, _, x in nodes[:p]]).T)
    x, y = shape[0 : 2 * p : 2].T, shape[1 : 2 * p : 2].T
    polar = np.stack([x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)], axis=-1)
    sensors = shape[2 * p : 2 * p + 6].T.reshape(-1, 2, 3)
    arrays = {
        "natural_frequency": omega,
        "damping_ratio": DAMPING,
        "ring_angle": angle,
        "ring_shape": polar,
        # the top in z, the flange in x
        "sensor_shape": sensors[:, [0, 1], [2, 0]],
    }
    with replaced_file(folder / FILES[0]) as path, open(path, "wb") as stream:
        np.savez(stream, **arrays, sizes=astuple(casing))
    moved = shape @ np.delete(across, np.arange(2 * p + 6, 2 * p + 12), axis=1).T  # the feet are held
    arrays["sensor_shape"] = np.hstack([arrays["sensor_shape"], moved])
    with replaced_file(folder / FILES[6]) as path, open(path, "wb") as stream:
        np.savez(stream, **arrays, sensor_area=np.append(np.zeros(2), area))
    write_text(punch(K, M, nodes), folder / FILES[1])
    with replaced_file(folder / FILES[2]) as path:
        OP4(debug=False).write_op4(str(path), {"KAAX": (6, K), "MAAX": (6, M)}, is_binary=False)
    held = len(nodes) - 2
    moved = np.zeros((len(omega), held, 3))
    moved[:, :p, 0], moved[:, :p, 1], moved[:, p:] = x, y, sensors
    points = np.array([x for _, _, x in nodes[:held]])
    shapes = Shapes(points, frequency, np.full(len(omega), DAMPING), moved, words="casing")
    write_modes(shapes, folder / FILES[3])
    way = {"sensor top": "z", "sensor flange": "x"}
    rows = [(n, role, *map(float, x), way.get(role, ""), d) for n, (role, d, x) in enumerate(nodes, 1)]
    for name, listed in ((FILES[4], rows), (FILES[5], rows[:held])):
        write_csv(folder / name, ("node", "role", "x", "y", "z", "direction", "dofs"), listed)


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/casing"),
    size: float = Casing.size,
    points: int = Casing.points,
    modes: int = Casing.modes,
) -> None:
    """Mesh a ring gear body with flange and two feet, reduce it and write it as arrays, DMIG, OP4 and modes.

    Parameters
    ----------
    output
        Folder of the files; what is there of the same sizes is not computed again.
    size
        Of the elements [m].
    points
        Of the ring, four a nodal diameter.
    modes
        Lowest modes that the reduction keeps.
    """
    casing, folder = Casing(size=size, points=points, modes=modes), ready_folder(output, FILES)
    if not (0.003 <= size <= 0.03 and 8 <= points <= 200 and 1 <= modes <= 100):
        limit = "0.003 to 0.03 m, 8 to 200 points, 1 to 100 modes"
        raise CaseError("sizes of the casing", code="E-RANGE", value=(size, points, modes), limit=limit)
    there = all((folder / name).is_file() for name in FILES)
    if not there or tuple(np.load(folder / FILES[0])["sizes"]) != astuple(casing):
        with Progress() as progress:
            progress("casing")
            write_casing(casing, folder)
            progress("casing", 1)
    frequency = np.load(folder / FILES[0])["natural_frequency"] / (2 * np.pi)
    rows = [(str(i), f"{hertz:.1f}") for i, hertz in enumerate(frequency[:12], 1)]
    print_table("Lowest natural frequencies, feet clamped", ("mode", "Hz"), rows)
    say_files(folder, FILES)


if __name__ == "__main__":
    sys.exit(run_script(main))
