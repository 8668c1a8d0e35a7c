#!/usr/bin/env python3
"""A planet carrier as another program would export it: two cheek plates with webs and pins, reduced to its seats."""

from __future__ import annotations

import math
import sys
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from casing import condensed
from cyclopts import Parameter
from script_tools import Progress, meshed, print_table, ready_folder, run_script, say_files

from femgear.errors import CaseError
from femgear.exchange.carrier_files import read_carrier
from femgear.storage.files import replaced_file

FILES = ("carrier.npz",)
E, NU, RHO = 206e9, 0.3, 7850.0
# a sector that ends in the middle of a pin and in the middle of a web, or the whole carrier
DRUM = """SetFactory("OpenCASCADE"); Geometry.OCCUnionUnify = 0;
Cylinder(1) = {{0, 0, -{end}, 0, 0, 2*{end}, {outer}, {sector}}};
Cylinder(2) = {{0, 0, {end}, 0, 0, {stub}, {shaft}, {sector}}};
BooleanUnion(3) = {{ Volume{{1}}; Delete; }}{{ Volume{{2}}; Delete; }};
Cylinder(4) = {{0, 0, -1, 0, 0, 1 + {half_span}, {bore}}};
Cylinder(5) = {{0, 0, 0, 0, 0, 1, {shaft_bore}}};
"""
POCKET = "Cylinder({number}) = {{{x}, {y}, -{half_span}, 0, 0, 2*{half_span}, {pocket}}};\n"
PIN = """Cylinder({number}) = {{{x}, {y}, -{half_span}, 0, 0, {half_span} - {half_bearing}, {pin}, {turn}}};
Cylinder({number} + 1) = {{{x}, {y}, -{half_bearing}, 0, 0, 2*{half_bearing}, {pin}, {turn}}};
Cylinder({number} + 2) = {{{x}, {y}, {half_bearing}, 0, 0, {half_span} - {half_bearing}, {pin}, {turn}}};
"""
JOINED = """BooleanDifference(6) = {{ Volume{{3}}; Delete; }}{{ Volume{{4, 5, 10:{pockets}}}; Delete; }};
{pins_text}BooleanUnion(7) = {{ Volume{{6}}; Delete; }}{{ Volume{{100:{last}}}; Delete; }};
Mesh.MeshSizeMax = {size}; Mesh.MeshSizeFromCurvature = {around}; Mesh.RandomSeed = 1; General.NumThreads = 1;
"""
# points and weights of a triangle, exact to degree five (A. H. Stroud, Approximate Calculation of Multiple Integrals)
FAR, NEAR = (6.0 + math.sqrt(15.0)) / 21.0, (6.0 - math.sqrt(15.0)) / 21.0
TRIANGLE_POINTS = [(1 / 3, 1 / 3), *(pair for q in (FAR, NEAR) for pair in ((q, q), (1 - 2 * q, q), (q, 1 - 2 * q)))]
TRIANGLE_WEIGHTS = [9 / 80, *[(155 + math.sqrt(15.0)) / 2400] * 3, *[(155 - math.sqrt(15.0)) / 2400] * 3]


@dataclass(frozen=True)
class Carrier:
    """Sizes of the carrier [m], for the planetary stage of cases/e_axle.toml; its planets stand at z = 0.

    ``size`` of the elements, tetrahedra of ten nodes, ``around`` of them on every circle at least; ``modes``, the
    lowest ones with the seat held, kept beside the static shapes. A drum of the radius ``outer`` has pockets for
    ``planets`` on the circle of the ``radius`` of their pins, and a ``bore`` for the sun. Its cheeks are ``half_span``
    from the middle and ``cheek`` thick; pins are solid, and under a bearing of the width ``bearing``. A ``stub`` of
    the shaft, between the radii ``shaft_bore`` and ``shaft``, ends in the seat.
    """

    size: float = 0.008
    around: int = 10
    modes: int = 12
    planets: int = 3
    outer: float = 0.05
    radius: float = 0.036775941598708325
    pocket: float = 0.022
    pin: float = 0.008
    bore: float = 0.0215
    shaft: float = 0.0225
    shaft_bore: float = 0.0075
    half_span: float = 0.014
    cheek: float = 0.008
    stub: float = 0.003
    bearing: float = 0.018


def geometry(carrier: Carrier, *, whole: bool = False) -> str:
    """Text of the geometry for Gmsh: half a sector, or the whole carrier."""
    sector = 2.0 * math.pi if whole else math.pi / carrier.planets
    names = vars(carrier) | {"end": carrier.half_span + carrier.cheek, "half_bearing": 0.5 * carrier.bearing}
    names |= {"sector": sector, "turn": 2.0 * math.pi if whole else math.pi}
    angles = [2.0 * math.pi * n / carrier.planets for n in range(carrier.planets if whole else 1)]
    places = [{"x": carrier.radius * math.cos(a), "y": carrier.radius * math.sin(a)} for a in angles]
    pockets, pins = (
        "".join(text.format(number=first + step * n, **names, **place) for n, place in enumerate(places))
        for text, first, step in ((POCKET, 10, 1), (PIN, 100, 3))
    )
    last = {"pockets": 9 + len(places), "last": 99 + 3 * len(places), "pins_text": pins}
    return DRUM.format(**names) + pockets + JOINED.format(**names, **last)


def grid_of(carrier: Carrier):
    """Grid of the whole carrier: half a sector by Gmsh in a process of its own, mirrored and turned.

    Planes of symmetry of the grid are those of the carrier, so that all its pins are alike. Its edges follow the
    circles.
    """
    from skfem import MeshTet, MeshTet2

    half = meshed(geometry(carrier))
    points, cells = [], []
    for number in range(carrier.planets):
        turn = 2.0 * math.pi * number / carrier.planets
        turned = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
        for side in (1.0, -1.0):
            cells.append(half.t + len(points) * half.p.shape[1])
            points.append(turned @ (half.p * [[1.0], [side], [1.0]]))
    joined = np.hstack(points)
    # nodes on the planes of symmetry stand twice
    _, first, place = np.unique(np.rint(1e8 * joined), axis=1, return_index=True, return_inverse=True)
    cells = place.ravel()[np.hstack(cells)]
    mesh = MeshTet(np.ascontiguousarray(joined[:, first]), np.ascontiguousarray(cells))
    curved = MeshTet2.from_mesh(mesh)
    return MeshTet2(on_circles(carrier, mesh, curved.doflocs.copy()), mesh.t)


def on_circles(carrier: Carrier, mesh, points: np.ndarray) -> np.ndarray:
    """Nodes (3, n), those in the middles of edges of round faces put onto their cylinders."""
    edges = np.unique(mesh.f2e[:, mesh.boundary_facets()])
    ends, middle = mesh.p[:, mesh.edges[:, edges]], mesh.p.shape[1] + edges
    angles = 2.0 * np.pi / carrier.planets * np.arange(carrier.planets)
    axes = [(carrier.radius * math.cos(a), carrier.radius * math.sin(a)) for a in angles]
    round_faces = [(axis, radius) for axis in axes for radius in (carrier.pin, carrier.pocket)]
    round_faces += [((0.0, 0.0), r) for r in (carrier.outer, carrier.bore, carrier.shaft, carrier.shaft_bore)]
    for axis, radius in round_faces:
        arms = ends[:2] - np.reshape(axis, (2, 1, 1))
        chosen = middle[(np.abs(np.hypot(*arms) - radius) < 1e-8).all(axis=0)]
        arm = points[:2, chosen] - np.reshape(axis, (2, 1))
        points[:2, chosen] = np.reshape(axis, (2, 1)) + arm * radius / np.hypot(*arm)
    return points


def assembled(carrier: Carrier):
    """Basis, stiffness [N/m] and mass [kg] of the free carrier."""
    from skfem import Basis, BilinearForm, ElementTetP2, ElementVector
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh, element = grid_of(carrier), ElementVector(ElementTetP2())
    K = linear_elasticity(*lame_parameters(E, NU)).assemble(Basis(mesh, element, intorder=4))
    basis = Basis(mesh, element, intorder=5)
    return basis, K.tocsc(), BilinearForm(lambda u, v, w: RHO * dot(u, v)).assemble(basis).tocsc()


def mean_motions(points: np.ndarray, triangles: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Weights (n, 3, 6) of nodes (n, 3) for mean displacement and rotation of a surface, by least squares over it.

    Triangles have six nodes; rotations are about a place (3,).
    """
    s, t = np.array(TRIANGLE_POINTS).T
    r = 1.0 - s - t
    shapes = np.array([r * (2 * r - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * r * s, 4 * s * t, 4 * t * r])
    by_s = np.array([1 - 4 * r, 4 * s - 1, 0 * s, 4 * (r - s), 4 * t, -4 * t])
    by_t = np.array([1 - 4 * r, 0 * s, 4 * t - 1, -4 * s, 4 * s, 4 * (r - t)])
    x, along, across = (np.einsum("kq,ekd->eqd", values, points[triangles]) for values in (shapes, by_s, by_t))
    area = np.linalg.norm(np.cross(along, across), axis=2) * np.array(TRIANGLE_WEIGHTS)
    directions = np.broadcast_to(np.eye(3)[:, None, None], (3, *x.shape))
    fields = np.concatenate([directions, np.cross(directions, x - place)])
    weights = np.zeros((len(points), 3, 6))
    np.add.at(weights, triangles.T, np.einsum("kq,eq,aeqd->keda", shapes, area, fields))
    return weights @ np.linalg.inv(np.einsum("eq,aeqd,beqd->ab", area, fields, fields))


def motions_of_pin(carrier: Carrier, basis, place: np.ndarray) -> np.ndarray:
    """Columns (n, 6): mean displacement and rotation of a pin under its bearing."""
    mesh = basis.mesh

    def on_pin(x):
        return (np.hypot(x[0] - place[0], x[1] - place[1]) < 1.2 * carrier.pin) & (np.abs(x[2]) < 0.5 * carrier.bearing)

    facets = mesh.facets_satisfying(on_pin, boundaries_only=True)
    count = basis.nodal_dofs.shape[1]
    triangles = np.vstack([mesh.facets[:, facets], count + mesh.f2e[:, facets]]).T
    weights = mean_motions(mesh.doflocs.T, triangles, place)
    columns = np.zeros((basis.N, 6))
    columns[basis.nodal_dofs.T], columns[basis.edge_dofs.T] = weights[:count], weights[count:]
    return columns


def motions_of_seat(carrier: Carrier, basis) -> tuple[np.ndarray, np.ndarray]:
    """Columns (n, 6) of the face that moves rigidly with the shaft, and its place (3,)."""
    place = np.array([0.0, 0.0, carrier.half_span + carrier.cheek + carrier.stub])

    def on_face(x):
        return np.abs(x[2] - place[2]) < 1e-6

    held = basis.get_dofs(basis.mesh.facets_satisfying(on_face, boundaries_only=True))
    columns = np.zeros((basis.N, 6))
    for way in range(3):
        dofs = held.all(f"u^{way + 1}")
        arm = basis.doflocs[:, dofs] - place[:, None]
        columns[dofs, way] = 1.0
        for about in range(3):
            # rotation times arm, along this way
            columns[dofs, 3 + about] = np.cross(np.eye(3)[about], arm.T)[:, way]
    return columns, place


def reduced(carrier: Carrier) -> dict[str, np.ndarray]:
    """Arrays of the file: stiffness and mass on pins, shaft and inner coordinates, and where the seats are."""
    basis, K, M = assembled(carrier)
    angles = 2.0 * np.pi / carrier.planets * np.arange(carrier.planets)
    pins = [np.array([carrier.radius * math.cos(a), carrier.radius * math.sin(a), 0.0]) for a in angles]
    watched = np.hstack([motions_of_pin(carrier, basis, place) for place in pins])
    carried, seat = motions_of_seat(carrier, basis)
    K, M, _ = condensed(K, M, watched, carried, carrier.modes)
    return {
        "stiffness": 0.5 * (K + K.T),
        "mass": 0.5 * (M + M.T),
        "role": np.array([*(f"pin {n + 1}" for n in range(len(pins))), "shaft"]),
        "position": np.array([*pins, seat]),
        "dofs": np.full(len(pins) + 1, "123456"),
    }


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/carrier"),
    size: float = Carrier.size,
    modes: int = Carrier.modes,
) -> None:
    """Mesh a carrier of two cheeks with webs and pins, reduce it to the shaft's seat and its pins, and write it.

    Parameters
    ----------
    output
        Folder of the file; what is there of the same sizes is not computed again.
    size
        Of the elements [m].
    modes
        Lowest modes that the reduction keeps, the seat on the shaft held.
    """
    carrier, folder = Carrier(size=size, modes=modes), ready_folder(output, FILES)
    if not (0.002 <= size <= 0.02 and 1 <= modes <= 60):
        raise CaseError(
            "sizes of the carrier", code="E-RANGE", value=(size, modes), limit="0.002 to 0.02 m, 1 to 60 modes"
        )
    path = folder / FILES[0]
    if not path.is_file() or tuple(np.load(path)["sizes"]) != astuple(carrier):
        with Progress() as progress:
            progress("carrier")
            arrays = reduced(carrier)
            with replaced_file(path) as part, open(part, "wb") as stream:
                np.savez(stream, **arrays, sizes=astuple(carrier))
            progress("carrier", 1)
    body = read_carrier(path)
    count = carrier.planets
    compliance = body.compliance.reshape(count, 6, count, 6)
    around = sum(compliance[0, 1, n, :2] @ [-math.sin(a), math.cos(a)] for n, a in enumerate(_angles(body.pins)))
    rows = [
        ("a pin radially, alone [um/kN]", f"{1e9 * compliance[0, 0, 0, 0]:.3f}"),
        ("a pin around the axis, alone [um/kN]", f"{1e9 * compliance[0, 1, 0, 1]:.3f}"),
        ("all pins around the axis [um/kN each]", f"{1e9 * around:.3f}"),
        ("lowest inner mode [Hz]", f"{body.frequency[0] / (2.0 * math.pi):.0f}"),
    ]
    print_table("Carrier with the seat on the shaft held", ("motion", "value"), rows)
    say_files(folder, FILES)


def _angles(pins: np.ndarray) -> np.ndarray:
    return np.arctan2(pins[:, 1], pins[:, 0])


if __name__ == "__main__":
    sys.exit(run_script(main))
