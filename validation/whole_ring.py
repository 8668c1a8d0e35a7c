"""Free vibration of a toothed ring with all its teeth in one grid, without cyclic or mirror symmetry.

Shares with the sector only the exact outline. The grid is triangulated by Gmsh as a whole, the displacement
is cubic where the sector's is quadratic, assembly and eigenproblem are plain scikit-fem and scipy.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from femgear.fe.elasticity import Material
    from femgear.fe.grid import Grid
    from femgear.gears.gear import Gear

# element edges along half a tip, a flank, the fillet above and below the tooth base, half a root, a tooth
# base and a pitch of the outer surface
EDGES = {"tip": 1, "flank": 2, "upper": 1, "lower": 2, "root": 1, "base": 2, "rim": 1}
CUT_EDGES = 2
# the outline is taken from one this much finer, so that every node lies on the true curves
FINE = 4.0
# below the spectrum of a free body, about as far as its lowest elastic frequency lies above [Hz]
SHIFT = 500.0


def whole_grid(gear: Gear, *, refine: int = 1) -> Grid:
    """Grid of a whole internal gear with regions ``"tooth 0"``, ... and ``"body 0"``, ``"body 1"``.

    Parameters
    ----------
    gear : Gear
        An internal one; its outer surface is the boundary ``"rim"``.
    refine : int
        Multiplies the edges along every curve.
    """
    from femgear.fe.meshing import Plan, _mesh_plan

    points, segments, mids, names, loops = [], [], [], [], []

    def corner(point):
        points.append(point)
        return len(points) - 1

    def chain(name, curve, start, end):
        """Segments of a curve between two corners, numbered from 1."""
        numbers = [start, *(corner(point) for point in curve[2:-1:2]), end]
        first = len(segments) + 1
        for k, pair in enumerate(pairwise(numbers)):
            segments.append(pair)
            mids.append(curve[2 * k + 1])
            names.append(name)
        return np.arange(first, len(segments) + 1)

    below, tooth, base, rim = _pitch(gear, refine)
    mirrored = (below * [1.0, -1.0])[::-1]
    turns = [_turn(k * gear.pitch_angle) for k in range(gear.teeth)]
    spaces = [corner(below[0] @ turn.T) for turn in turns]
    outside = [corner(rim[0] @ turn.T) for turn in turns]
    inner, outer = [], []
    for k, turn in enumerate(turns):
        after = (k + 1) % gear.teeth
        left, right = corner(below[-1] @ turn.T), corner(mirrored[0] @ turn.T)
        lower = chain("root", below @ turn.T, spaces[k], left)
        contour = chain("tooth", tooth @ turn.T, left, right)
        arc = chain("tooth_base", base @ turn.T, left, right)
        upper = chain("root", mirrored @ turn.T, right, spaces[after])
        inner.append(np.concatenate([lower, arc, upper]))
        outer.append(chain("rim", rim @ turn.T, outside[k], outside[after]))
        loops.append(np.concatenate([arc, -contour[::-1]]))
    # two radial lines make parts without holes
    half = gear.teeth // 2
    along = np.linspace(0.0, 1.0, 2 * CUT_EDGES * refine + 1)[:, None]
    cuts = [
        chain("cut", ((1.0 - along) * below[0] + along * rim[0]) @ turns[k].T, spaces[k], outside[k]) for k in (0, half)
    ]
    for part, (start, end) in ((slice(0, half), cuts), (slice(half, None), cuts[::-1])):
        back = -np.concatenate(inner[part])[::-1]
        loops.append(np.concatenate([*outer[part], -end[::-1], back, start]))
    plan = Plan(
        points=np.array(points),
        segments=np.array(segments),
        mids=np.array(mids),
        names=tuple(names),
        n_boundary=0,
        loops=tuple(loops),
        faces=(*(f"tooth {k}" for k in range(gear.teeth)), "body 0", "body 1"),
    )
    return _mesh_plan(plan)


def _turn(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _pitch(gear: Gear, refine: int) -> tuple[np.ndarray, ...]:
    """Curves of tooth 0 in the sense of rising angle: root and fillet up to its base, contour, base, rim."""
    from femgear.gears.tooth import half_sector

    half = half_sector(gear, refine=FINE)
    tip, flank, fillet, root = (half.curve(name) for name in ("tip", "flank", "fillet", "root"))
    base = dict(half.interfaces)["tooth_base"]
    end = int(np.argmin(np.hypot(*(fillet - base[-1]).T)))

    def picked(curve, name):
        rows = np.linspace(0, len(curve) - 1, 2 * EDGES[name] * refine + 1)
        return curve[np.round(rows).astype(int)]

    lower = [picked(root, "root"), picked(fillet[: end + 1], "lower")]
    upper = [picked(fillet[end:], "upper"), picked(flank, "flank"), picked(tip, "tip")]
    below, above = (np.vstack([parts[0], *(part[1:] for part in parts[1:])]) for parts in (lower, upper))
    down = [1.0, -1.0]
    arc = picked(base, "base")
    whole_base = np.vstack([(arc * down)[::-1], arc[1:]])
    contour = np.vstack([above * down, above[-2::-1]])
    step = math.pi / gear.teeth
    angle = np.linspace(-step, step, 2 * EDGES["rim"] * refine + 1)
    rim = gear.rim_radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return below * down, contour, whole_base, rim


def free_modes(grid: Grid, material: Material, state: dict[str, str], *, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] of the free ring and their nodal diameters, the three rigid motions left out.

    Parameters
    ----------
    grid : Grid
        Of `whole_grid`.
    material : Material
    state : dict
        ``"plane strain"`` or ``"plane stress"`` of ``"tooth"`` and ``"body"``.
    count : int
        Eigenvalues to find, the rigid ones included.
    """
    from scipy.sparse import block_array
    from scipy.sparse.linalg import LinearOperator, eigsh
    from skfem import Basis, BilinearForm, ElementTriP3

    from femgear.fe.compliance import symmetric_factor
    from validation.reference.plane_elasticity import to_skfem
    from validation.whole_gear import _ascending, _elastic

    grid = _ascending(grid)
    mesh, element = to_skfem(grid), ElementTriP3()
    blocks = [0.0, 0.0, 0.0]
    for part, plane in state.items():
        elements = np.concatenate([of_region for name, of_region in grid.regions.items() if name.startswith(part)])
        matrices = _elastic(Basis(mesh, element, intorder=4, elements=elements), material, plane)
        blocks = [block + more for block, more in zip(blocks, matrices, strict=True)]
    basis = Basis(mesh, element, intorder=6)
    inertia = material.density * BilinearForm(lambda u, v, w: u * v).assemble(basis)
    xx, yy, xy = blocks
    around = np.argsort(np.arctan2(*basis.doflocs[::-1]))
    order = np.column_stack([around, basis.N + around]).ravel()
    K = block_array([[xx, xy], [xy.T, yy]], format="csc")[order][:, order]
    M = block_array([[inertia, None], [None, inertia]], format="csc")[order][:, order]
    shift = -((2.0 * math.pi * SHIFT) ** 2)
    inverse = LinearOperator(K.shape, matvec=symmetric_factor(K - shift * M).solve, dtype=float)
    start = np.cos(np.arange(K.shape[0]) + 1.0)
    values, vectors = eigsh(K, k=count, M=M, sigma=shift, OPinv=inverse, v0=start)
    back = np.empty_like(vectors)
    back[order] = vectors
    rim = mesh.facets[:, mesh.boundaries["rim"]]
    vertex = np.unique(rim)
    vertex = vertex[np.argsort(np.arctan2(*mesh.p[::-1, vertex]))]
    dof = basis.nodal_dofs[0, vertex]
    x, y = mesh.p[:, vertex] / np.hypot(*mesh.p[:, vertex])
    outward = x[:, None] * back[dof] + y[:, None] * back[basis.N + dof]
    diameter = np.abs(np.fft.rfft(outward, axis=0)).argmax(axis=0)
    elastic = np.argsort(values)[3:]
    return np.sqrt(values[elastic]) / (2.0 * math.pi), diameter[elastic]
