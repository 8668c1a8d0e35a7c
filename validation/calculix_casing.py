"""The casing of scripts/casing.py by CalculiX, from its geometry on a grid of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from validation import calculix
from validation.calculix import MILLIMETRE
from validation.calculix_rows import SOURCE, where_installed
from validation.rows import Row, within

SIZE = 0.008
"""Length of the elements [m], tetrahedra of ten nodes on the true surfaces; the casing has straight ones."""
MODES = 12
ANGLES = 40.0, 200.0
"""Places on the ring that are loaded [deg]."""
LINE_OF_ACTION = 20.0
"""Angle of the force against the tangent of the ring [deg]."""
DIAMETERS = 14
FREQUENCY_GATE, COMPLIANCE_GATE = 0.005, 0.01


def grid_of(casing, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mesh the geometry of a casing: see `meshed_solid`."""
    from casing import GEOMETRY, HOUSED

    names = {"bottom": -casing.width / 2, **vars(casing), "size": size}
    return meshed_solid(GEOMETRY.format(parts=HOUSED.format(**names), **names) + "Mesh.ElementOrder = 2;\n")


def meshed_solid(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mesh a geometry of Gmsh, elements of second order: points (n, 3) [m], tetrahedra (e, 10), triangles (t, 6)."""
    with TemporaryDirectory() as folder:
        source, grid = Path(folder) / "solid.geo", Path(folder) / "solid.msh"
        source.write_text(text, encoding="utf-8")
        run = "import sys, gmsh; gmsh.initialize(sys.argv, run=True)"
        words = [sys.executable, "-c", run, "-3", "-v", "1", "-format", "msh22", source, "-o", grid]
        subprocess.run(words, check=True, capture_output=True, timeout=300)
        lines = grid.read_text().split("\n")
    first, count = lines.index("$Nodes") + 2, int(lines[lines.index("$Nodes") + 1])
    nodes = np.array([line.split() for line in lines[first : first + count]], float)
    row = np.zeros(int(nodes[:, 0].max()) + 1, int)
    row[nodes[:, 0].astype(int)] = np.arange(count)
    elements: dict[str, list] = {"9": [], "11": []}
    for line in lines[lines.index("$Elements") + 2 : lines.index("$EndElements")]:
        _, kind, tags, *rest = line.split()
        if kind in elements:
            elements[kind].append(rest[int(tags) :])
    triangles, solids = (row[np.array(elements[kind], int)] for kind in ("9", "11"))
    # Gmsh and CalculiX number the last two edges of a tetrahedron the other way round
    return nodes[:, 1:], solids[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]], triangles


def solid_input(points: np.ndarray, solids: np.ndarray, *, young: float, poisson: float, density: float) -> list[str]:
    """Write the nodes that elements use, tetrahedra of ten nodes, and their material [Pa], [1], [kg/m^3]."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i + 1}," + ",".join(f"{x:.14g}" for x in MILLIMETRE * points[i]) for i in np.unique(solids)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=SOLID")
    lines += [f"{i + 1}," + ",".join(map(str, nodes + 1)) for i, nodes in enumerate(solids)]
    return [
        *lines,
        f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{1e-6 * young:.12g},{poisson:.12g}\n*DENSITY\n{1e-12 * density:.9g}",
        "*SOLID SECTION, ELSET=SOLID, MATERIAL=STEEL",
    ]


def hats(angle: np.ndarray, points: int) -> np.ndarray:
    """Weights (points, ...) around the points of the ring, one there and zero at the neighbours."""
    step, places = 2 * np.pi / points, 2 * np.pi * np.arange(points) / points
    away = np.abs(np.angle(np.exp(1j * (angle - places.reshape(-1, *(1,) * angle.ndim)))))
    return np.clip(1.0 - away / step, 0.0, None)


def bore_load(points: np.ndarray, triangles: np.ndarray, place: float, ring_points: int, radius: float) -> np.ndarray:
    """Nodal forces (n, 3) of one newton along the line of action at an angle of the ring [rad].

    The force has the nodal diameters up to `DIAMETERS` alone and stands on the points of the ring, each a hat
    over the angle and constant over the width: what femgear keeps of the casing's files.
    """
    inner = triangles[(np.hypot(*points[triangles][..., :2].transpose(2, 0, 1)) < radius + 1e-6).all(axis=1)]
    n = 12
    i, j = (part.ravel() for part in np.meshgrid(np.arange(2 * n), np.arange(n)))
    # middles of the n^2 equal parts of a triangle
    up = i % 2 == 0
    s, t = ((i // 2 + np.where(up, 1, 2) / 3) / n, (j + np.where(up, 1, 2) / 3) / n)
    s, t = s[s + t < 1 - 1e-9], t[s + t < 1 - 1e-9]
    r = 1.0 - s - t
    shapes = np.array([r * (2 * r - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * r * s, 4 * s * t, 4 * t * r])
    by_s = np.array([1 - 4 * r, 4 * s - 1, 0 * s, 4 * (r - s), 4 * t, -4 * t])
    by_t = np.array([1 - 4 * r, 0 * s, 4 * t - 1, -4 * s, 4 * s, 4 * (r - t)])
    x, along, across = (np.einsum("kq,ekd->eqd", weights, points[inner]) for weights in (shapes, by_s, by_t))
    area = np.linalg.norm(np.cross(along, across), axis=2) * 0.5 / len(s)
    weight = hats(np.arctan2(x[..., 1], x[..., 0]), ring_points) * area
    weight /= weight.sum(axis=(1, 2), keepdims=True)
    angle, slope = 2 * np.pi * np.arange(ring_points) / ring_points, np.radians(LINE_OF_ACTION)
    diameters = np.arange(-DIAMETERS, DIAMETERS + 1)
    kept = np.cos(np.outer(place - angle, diameters)).sum(axis=1) / ring_points
    outward, around = (np.column_stack([np.cos(a), np.sin(a)]) for a in (angle, angle + np.pi / 2))
    force = kept[:, None] * (np.sin(slope) * outward - np.cos(slope) * around)
    traction = np.einsum("peq,pd->eqd", weight, force)
    load = np.zeros((len(points), 3))
    np.add.at(load[:, :2], inner.T, np.einsum("kq,eqd->ked", shapes, traction))
    return load


def clamped_casing(casing, size: float = SIZE) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] and compliance at `ANGLES` [m/N] of a casing on clamped feet, by CalculiX."""
    from casing import NU, RHO, E

    points, solids, triangles = grid_of(casing, size)
    used = np.unique(solids)
    feet = used[points[used, 1] < 1e-6 - casing.base] + 1
    bore = used[np.hypot(*points[used, :2].T) < casing.bore + 1e-6] + 1
    loads = [bore_load(points, triangles, np.radians(place), casing.points, casing.bore) for place in ANGLES]
    lines = solid_input(points, solids, young=E, poisson=NU, density=RHO)
    lines += [
        *("*NSET, NSET=FEET", *map(str, feet), "*NSET, NSET=BORE", *map(str, bore)),
        "*BOUNDARY\nFEET,1,3",
    ]
    for load in loads:
        lines.append("*STEP\n*STATIC\n*CLOAD, OP=NEW")
        lines += [f"{i + 1},{way + 1},{1e6 * load[i, way]:.12g}" for i, way in np.argwhere(load) if load[i, way]]
        lines.append("*NODE PRINT, NSET=BORE\nU\n*END STEP")
    lines.append(f"*STEP\n*FREQUENCY\n{MODES}\n*END STEP")
    text = calculix.run("\n".join(lines) + "\n").tables
    compliance = []
    for load, rows in zip(loads, calculix.tables(text, "displacements"), strict=False):
        moved = np.zeros((len(points), 3))
        moved[rows[:, 0].astype(int) - 1] = 1e-6 / MILLIMETRE * rows[:, 1:]
        compliance.append((load * moved).sum())
    return calculix.frequencies(text), np.array(compliance)


@where_installed
def casing_example() -> tuple[Row, ...]:
    """The casing as femgear reads it from Nastran's matrices, feet clamped: modes, compliance of the ring."""
    from casing import Casing, write_casing

    from femgear.exchange.casing_files import read_casing

    casing, slope = Casing(), np.radians(LINE_OF_ACTION)
    with TemporaryDirectory() as folder:
        write_casing(casing, Path(folder))
        structure = read_casing(
            Path(folder) / "casing.pch",
            nodes=Path(folder) / "nodes.csv",
            damping_ratio=0.02,
            direction=(np.sin(slope), -np.cos(slope)),
            pitch_radius=casing.bore,
            max_diameter=DIAMETERS,
        )
    waves = np.exp(1j * np.outer(np.radians(ANGLES), np.arange(-DIAMETERS, DIAMETERS + 1)))
    moved = np.real(waves @ structure.ring_shape.T) / structure.natural_frequency
    ours = np.real(np.einsum("an,nm,am->a", waves, structure.residual, waves.conj())) + (moved**2).sum(axis=1)
    frequency = structure.natural_frequency / (2 * np.pi)
    expected, compliance = clamped_casing(casing)
    name = "casing of scripts/casing.py, feet clamped: "
    rows = [
        within(
            "casing",
            SOURCE,
            f"{name}natural frequency {i + 1} [Hz]",
            expected[i],
            frequency[i],
            FREQUENCY_GATE,
        )
        for i in range(MODES)
    ]
    for place, theirs, value in zip(ANGLES, compliance, ours, strict=True):
        words = f"{name}compliance along the line of action at {place:g} degrees [um/kN]"
        rows.append(within("casing", SOURCE, words, 1e9 * theirs, 1e9 * value, COMPLIANCE_GATE))
    return tuple(rows)
