#!/usr/bin/env python3
"""The casing of cases/e_axle.toml as another program would export it: a box of aluminium, reduced to its seats."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
from carrier import mean_motions
from cyclopts import Parameter
from scipy.linalg import block_diag, eigh
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, eigsh, splu
from script_tools import Progress, meshed, print_table, ready_folder, run_script, say_files

from femgear.errors import CaseError
from femgear.exchange.superelement import Superelement, read_superelement
from femgear.storage.files import replaced_file, write_csv
from femgear.trains.gearbox.casing import casing_seats
from femgear.trains.reading import read_case

CASE = Path(__file__).resolve().parents[1] / "cases" / "e_axle.toml"
FILES = ("e_axle.npz", "e_axle.csv", "casing.png")
RING = "ring of second stage"
ALUMINIUM, STEEL = (72e9, 0.33, 2700.0), (206e9, 0.3, 7850.0)
"""Young's modulus [Pa], Poisson's ratio [1] and density [kg/m^3] of the box, and of the ring gear pressed into it."""
SEATS = {
    "A": (0.031, 0.038, 0.011),
    "B": (0.031, 0.038, 0.010),
    "C": (0.036, 0.043, 0.009),
    "D": (0.036, 0.043, 0.008),
    "E": (0.045, 0.053, 0.010),
    "F": (0.0425, 0.050, 0.010),
    RING: (0.058, 0.066, 0.009),
}
"""Radius of every seat, radius of the boss around it (of the ring: its outer radius), half its width [m]."""
FEET = {
    "left front": (-0.06, -0.09, 0.02),
    "right front": (0.06, -0.09, 0.02),
    "left rear": (-0.06, -0.09, 0.12),
    "right rear": (0.06, -0.09, 0.12),
}
"""Middle of the lower face of every foot [m]."""
SENSORS = {"top": (0.0, 0.08, 0.098), "side": (0.12341893, 0.0, 0.045), "front": (0.0, 0.057, -0.001)}
"""Middle of the pad of every sensor [m], 12 mm wide: on the walls over the planets, beside the rotor and in front."""
OUTWARDS = {"top": np.array([0.0, 1.0, 0.0]), "side": np.array([1.0, 0.0, 0.0]), "front": np.array([0.0, 0.0, -1.0])}
"""Directions out of the casing at the sensors. They feel along that axis."""
FIRST_MODES = 90
"""Modes that are computed at first, rigid ones among them; twice as many where they end too low."""
SHIFT = 500.0
"""Frequency [Hz] around which free modes are sought, below the first elastic one."""
GROUND = 1e9
"""Stiffness of springs that hold the casing on its feet while it is solved [N/m]; no result depends on it."""
PIXELS, COLOURS = 900, {"seat": "#0072B2", "foot": "#E69F00", "sensor": "#009E73"}
"""Sides of the picture, and colours of what is tied to a node."""
# The outer wall around both stages, its cavities, bosses and ribs, bores; and the ring. All in the system of the case.
BOX = """SetFactory("OpenCASCADE");
Cylinder(1) = {{0, 0, 0.003, 0, 0, 0.143, {outer}}};
Cylinder(2) = {{{apart}, 0, 0.003, 0, 0, 0.083, {small} + {wall}}};
Box(3) = {{0, -{small} - {wall}, 0.003, {apart}, 2*({small} + {wall}), 0.083}};
{feet}BooleanUnion(10) = {{ Volume{{1}}; Delete; }}{{ Volume{{2:7}}; Delete; }};
Cylinder(11) = {{0, 0, 0.003 + {wall}, 0, 0, 0.077 - {wall}, {outer} - {wall}}};
Cylinder(12) = {{{apart}, 0, 0.003 + {wall}, 0, 0, 0.077 - {wall}, {small}}};
Box(13) = {{0, -{small}, 0.003 + {wall}, {apart}, 2*{small}, 0.077 - {wall}}};
Cylinder(14) = {{0, 0, 0.086, 0, 0, 0.06 - {wall}, {outer} - {wall}}};
BooleanDifference(20) = {{ Volume{{10}}; Delete; }}{{ Volume{{11:14}}; Delete; }};
{bosses}Cylinder(37) = {{0, 0, 0.14, 0, 0, 0.078, {neck}}};
{pads}For n In {{0:3}}
  Wedge(41 + n) = {{{neck} - 0.004, -{rib}/2, 0.143, 0.028, {rib}, 0.042, 0.006}};
  Rotate {{ {{0, 0, 1}}, {{0, 0, 0}}, (n + 0.5)*Pi/2 }} {{ Volume{{41 + n}}; }}
EndFor
BooleanUnion(50) = {{ Volume{{20}}; Delete; }}{{ Volume{{30:40}}; Volume{{41:44}}; Delete; }};
{bores}Cylinder(67) = {{0, 0, 0.13, 0, 0, 0.09, {neck} - {wall}}};
BooleanDifference(70) = {{ Volume{{50}}; Delete; }}{{ Volume{{60:67}}; Delete; }};
"""
RING_GEAR = """Cylinder(80) = {{0, 0, {ring_z} - {half}, 0, 0, 2*{half}, {edge}}};
Cylinder(81) = {{0, 0, {ring_z} - {half}, 0, 0, 2*{half}, {bore}}};
BooleanDifference(82) = {{ Volume{{80}}; Delete; }}{{ Volume{{81}}; Delete; }};
BooleanFragments{{ Volume{{70}}; Delete; }}{{ Volume{{82}}; Delete; }}
Mesh.MeshSizeMax = {size}; Mesh.MeshSizeFromCurvature = {around}; Mesh.ElementOrder = 2; Mesh.RandomSeed = 1;
General.NumThreads = 1;
"""


@dataclass(frozen=True)
class Box:
    """Sizes of the casing [m], around the shafts and bearings of the case.

    ``size`` of the elements, tetrahedra of ten nodes on the round surfaces, and ``around`` of them on every circle at
    least; ``highest`` [Hz] of the free modes that are kept beside the static shapes. The outer radius
    around the wheel and the planets is ``outer``, the radius within around the pinion ``small``; walls are ``wall``
    thick, ribs ``rib``; the output shaft runs in a ``neck`` of this outer radius.
    """

    size: float = 0.008
    around: int = 18
    highest: float = 12000.0
    outer: float = 0.076
    small: float = 0.036
    wall: float = 0.006
    neck: float = 0.045
    rib: float = 0.006


@dataclass(frozen=True)
class Node:
    """A node of the file: its ``role``, components (``dofs``), ``place`` (3,) [m], and the ``facets`` tied to it."""

    role: str
    dofs: str
    place: np.ndarray
    facets: np.ndarray


def seat_places() -> dict[str, np.ndarray]:
    """Places (3,) of all that sits in the casing of the case [m], by name."""
    return casing_seats(read_case(str(CASE)))


def geometry(box: Box) -> str:
    """Text of the geometry for Gmsh, in the coordinates of the case."""
    places = seat_places()
    names = vars(box) | {"apart": places["A"][0], "ring_z": places[RING][2]}
    bores, bosses = [], []
    for n, (name, (bore, boss, half)) in enumerate(SEATS.items()):
        x, y, z = places[name]
        # the boss of the ring reaches into the wall; past bearings at an end of the box the bores go through
        radii = (boss, box.outer - 0.5 * box.wall) if name == RING else (bore, boss)
        for texts, number, radius in ((bores, 60, radii[0]), (bosses, 30, radii[1])):
            texts.append(f"Cylinder({number + n}) = {{{x}, {y}, {z - half}, 0, 0, {2 * half}, {radius}}};\n")
    feet = "".join(
        f"Box({n}) = {{{x - 0.015}, {y}, {z - 0.015}, 0.03, 0.06, 0.03}};\n"
        for n, (x, y, z) in enumerate(FEET.values(), 4)
    )
    pads = ""
    for n, (name, way) in enumerate(OUTWARDS.items(), 38):
        corner, widths = SENSORS[name] - 0.003 * (2 + way - np.abs(way)), 0.012 - 0.006 * np.abs(way)
        pads += f"Box({n}) = {{{', '.join(f'{x:.9g}' for x in (*corner, *widths))}}};\n"
    bore, edge, half = SEATS[RING]
    box_text = BOX.format(**names, feet=feet, bosses="".join(bosses), bores="".join(bores), pads=pads)
    return box_text + RING_GEAR.format(**names, bore=bore, edge=edge, half=half)


def assembled(box: Box):
    """Basis, stiffness [N/m] and mass [kg] of the free casing with its ring gear."""
    from skfem import Basis, BilinearForm, ElementTetP2, ElementVector
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh, element = meshed(geometry(box)), ElementVector(ElementTetP2())
    ring = in_ring(mesh.p[:, mesh.t].mean(axis=1))
    # values of every element, at all its points
    young, poisson, density = (np.where(ring, of_steel, of_box)[:, None] for of_steel, of_box in zip(STEEL, ALUMINIUM))
    K = linear_elasticity(*lame_parameters(young, poisson)).assemble(Basis(mesh, element, intorder=4))
    basis = Basis(mesh, element, intorder=5)
    if (inverted := int((mesh.mapping().detDF(basis.X) <= 0.0).any(axis=1).sum())) > 0:
        raise CaseError(
            f"{inverted} elements are turned inside out", code="E-GRID-GMSH", remedy="take smaller elements"
        )
    return basis, K.tocsc(), BilinearForm(lambda u, v, w: density * dot(u, v)).assemble(basis).tocsc()


def in_ring(points: np.ndarray) -> np.ndarray:
    """Say which points (3, n) lie in the ring gear."""
    _, edge, half = SEATS[RING]
    away = points - seat_places()[RING][:, None]
    return (np.hypot(away[0], away[1]) < edge) & (np.abs(away[2]) < half)


def interface_of(basis) -> tuple[list[Node], np.ndarray]:
    """Nodes of the file, and columns (n, r): the mean motions of their surfaces, in the order of their components.

    A surface is tied to its node as a distributing coupling (RBE3) ties it: the node has the mean displacement and, of
    seats, the mean rotation over the area.
    """
    mesh, places = basis.mesh, seat_places()
    outside, nodes, columns = basis.mesh.boundary_facets(), [], []
    corners = mesh.p[:, mesh.facets[:, outside]]

    def add(role: str, dofs: str, place, on_surface) -> None:
        place = np.asarray(place, float)
        facets = outside[on_surface(corners - place[:, None, None])]
        triangles = np.vstack([mesh.facets[:, facets], basis.nodal_dofs.shape[1] + mesh.f2e[:, facets]]).T
        moved = np.zeros((basis.N, len(dofs)))
        weights = mean_motions(mesh.doflocs.T, triangles, place)
        moved[np.hstack([basis.nodal_dofs, basis.edge_dofs]).T] = weights[..., : len(dofs)]
        nodes.append(Node(role, dofs, place, facets))
        columns.append(moved)

    for name, (radius, _, half) in SEATS.items():
        add(f"seat {name}", "123456", places[name], partial(on_bore, radius=radius, half=half))
    for name, place in FEET.items():
        add(f"foot {name}", "123", place, partial(_on_face, across=(0.0, 1.0, 0.0), reach=0.022))
    for name, place in SENSORS.items():
        add(f"sensor {name}", "123", place, partial(_on_face, across=OUTWARDS[name], reach=0.009))
    return nodes, np.hstack(columns)


def on_bore(x: np.ndarray, *, radius: float, half: float) -> np.ndarray:
    """Say which triangles, by places of their corners (3, 3, n) from the middle of a seat, are of its bore."""
    return (np.abs(np.hypot(x[0], x[1]) - radius) < 1e-7).all(axis=0) & (np.abs(x[2].mean(axis=0)) < half - 1e-6)


def _on_face(x: np.ndarray, *, across, reach: float) -> np.ndarray:
    """Say which triangles lie in a flat face around its middle."""
    flat = np.abs(np.tensordot(across, x, axes=1)) < 1e-7
    return flat.all(axis=0) & (np.linalg.norm(x, axis=0) < reach).all(axis=0)


def reduced(K, M, columns: np.ndarray, held: np.ndarray, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass on the motions of the nodes, and on what else the free modes below a frequency [Hz] have.

    ``columns`` (n, r) are the mean motions of the surfaces; those of ``held`` (r,) hold the casing in static loads.

    S. Rubin, AIAA J. 13 (1975) 995-1006, with mean motions in place of motions: statics of the nodes, these modes, and
    what the inertia of the six rigid accelerations bends. Without these six, modes on springs of 1e8 N/m at all nodes
    were up to 1 % too high, as were free ones by modes of the held casing to 12 kHz in place of those of the free one.
    """
    static, relieved = static_shapes(K, M, columns, held)
    modes = free_modes(K, M, highest)
    inner = np.hstack([modes - static @ (columns.T @ modes), relieved])
    square, turn = eigh(inner.T @ (K @ inner), inner.T @ (M @ inner))
    T = np.hstack([static, inner @ turn])
    # forces that hold the nodes do no work in shapes in which these do not move
    stiffness, mass = block_diag(static.T @ (K @ static), np.diag(square)), T.T @ (M @ T)
    return 0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T)


def factor(matrix):
    """Factors of a sparse symmetric matrix."""
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def static_shapes(K, M, columns: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (n, r) of least energy in which every mean moves by one and the others do not, and six of accelerations.

    The latter (n, 6) are those of a casing whose means are held, under the inertia of its rigid motions.
    """
    feet = csc_matrix(columns[:, held])
    # springs at means that do not move, or by one, change no shape
    factors = factor(K + GROUND * feet @ feet.T)
    yielding = factors.solve(columns)
    static = np.linalg.solve((columns.T @ yielding).T, yielding.T).T
    # rigid motions carry no forces
    motions = np.linalg.svd(static.T @ (K @ static))[2][-6:].T
    bent = factors.solve(M @ (static @ motions))
    bent -= static @ (columns.T @ bent)
    return static, bent / np.sqrt(np.einsum("nr,nr->r", bent, M @ bent))


def free_modes(K, M, highest: float) -> np.ndarray:
    """Elastic modes (n, m) of the free casing below a frequency [Hz]."""
    limit, shift = (2.0 * np.pi * highest) ** 2, (2.0 * np.pi * SHIFT) ** 2
    inverse = LinearOperator(K.shape, factor(K + shift * M).solve, dtype=float)
    start = np.cos(np.arange(K.shape[0]))  # no rigid motion
    count, square = FIRST_MODES, np.zeros(1)
    while square.max() < limit:
        square, shape = eigsh(K, count, M, sigma=-shift, OPinv=inverse, v0=start)
        count *= 2
    return shape[:, (square > 0.1 * shift) & (square <= limit)]


def write_casing(box: Box, folder: Path) -> None:
    """Write stiffness and mass, the table of nodes, and the picture."""
    basis, K, M = assembled(box)
    nodes, columns = interface_of(basis)
    feet = np.concatenate([[node.role.startswith("foot")] * len(node.dofs) for node in nodes])
    stiffness, mass = reduced(K, M, columns, feet, box.highest)
    draw_casing(basis.mesh, nodes, folder / FILES[2])
    with replaced_file(folder / FILES[0]) as part, open(part, "wb") as stream:
        np.savez_compressed(stream, stiffness=stiffness, mass=mass, sizes=astuple(box))
    ways = {f"sensor {name}": "xyz"[np.abs(way).argmax()] for name, way in OUTWARDS.items()}
    rows = [(n, node.role, *node.place.tolist(), ways.get(node.role, ""), node.dofs) for n, node in enumerate(nodes, 1)]
    write_csv(folder / FILES[1], ("node", "role", "x", "y", "z", "direction", "dofs"), rows)


def draw_casing(mesh, nodes: Sequence[Node], path: Path) -> None:
    """Draw the casing, seen through, with the surfaces that are tied to its nodes."""
    from femgear.report.scene import add_text, load_pyvista, new_plotter, write_png

    faces = load_pyvista().PolyData.from_regular_faces
    plotter = new_plotter(PIXELS, PIXELS)
    plotter.set_background("white")
    plotter.enable_depth_peeling(20)
    walls = np.setdiff1d(mesh.boundary_facets(), np.concatenate([node.facets for node in nodes]))
    outside = faces(mesh.p.T, mesh.facets[:, walls].T)
    outside = outside.compute_normals(auto_orient_normals=True, point_normals=False)
    plotter.add_mesh(outside, color="#B0B8C0", opacity=0.2)
    plotter.add_mesh(outside.extract_feature_edges(45.0), color="#505860", line_width=1.5, lighting=False)
    for node in nodes:
        kind, _, name = node.role.partition(" ")
        plotter.add_mesh(faces(mesh.p.T, mesh.facets[:, node.facets].T), color=COLOURS[kind], lighting=False)
        # names of bores stand on their upper edge
        over = mesh.p[:, mesh.facets[:, node.facets]][1].max() if kind == "seat" else node.place[1]
        label = name.replace(" of second stage", "")
        plotter.add_point_labels(
            [[node.place[0], over, node.place[2]]], [label], font_size=22, shape_color="white", shape_opacity=0.8,
            text_color="black", show_points=False, always_visible=True, bold=False,
        )  # fmt: skip
    add_text(plotter, "seats blue, feet orange, sensors green", PIXELS)
    plotter.view_vector((0.75, 0.6, -0.7), viewup=(0, 1, 0))
    plotter.camera.zoom(1.12)
    write_png(plotter, path)


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/e_axle_casing"),
    size: float = Box.size,
    highest: float = Box.highest,
) -> None:
    """Mesh the casing of the electric axle, reduce it to its seats, feet and sensors, and write it as arrays.

    Parameters
    ----------
    output
        Folder of the files; what is there of the same sizes is not computed again.
    size
        Of the elements [m].
    highest
        Frequency up to which the reduction keeps the modes of the free casing [Hz].
    """
    box, folder = Box(size=size, highest=highest), ready_folder(output, FILES)
    if not (0.004 <= size <= 0.02 and 1000.0 <= highest <= 30000.0):
        limit = "0.004 to 0.02 m, 1 to 30 kHz"
        raise CaseError("sizes of the casing", code="E-RANGE", value=(size, highest), limit=limit)
    path = folder / FILES[0]
    there = all((folder / name).is_file() for name in FILES)
    if not there or tuple(np.load(path)["sizes"]) != astuple(box):
        with Progress() as progress:
            progress("casing")
            write_casing(box, folder)
            progress("casing", 1)
    body = read_superelement(path, folder / FILES[1])
    rows = [("mass [kg]", f"{rigid_mass(body):.3f}"), ("coordinates", str(len(body.stiffness)))]
    rows += [(f"natural frequency {i + 1}, free [Hz]", f"{f:.0f}") for i, f in enumerate(free_frequencies(body)[:6])]
    print_table("Casing of the electric axle", ("quantity", "value"), rows)
    say_files(folder, FILES)


def rigid_mass(body: Superelement) -> float:
    """Mass of a superelement [kg]."""
    along = body.rigid_motions(np.zeros(3))[:, 0]
    return float(along @ body.mass @ along)


def free_frequencies(body: Superelement) -> np.ndarray:
    """Elastic natural frequencies of a superelement that nothing holds [Hz]."""
    square = eigh(body.stiffness, body.mass, eigvals_only=True)
    return np.sqrt(square[6:]) / (2.0 * math.pi)


if __name__ == "__main__":
    sys.exit(run_script(main))
