"""Stepped support shafts as bodies of revolution.

`shaft_support_stiffness` is K = F/X of a stepped shaft as a body of revolution, one end face held, the other
rigid. Under a lateral force on the centre node the displacements are ``U cos t``, ``V sin t``, ``W cos t``
around the axis, so that the three-dimensional body is solved on its half section (O. C. Zienkiewicz, R. L.
Taylor, The Finite Element Method, vol. 2, "Semi-analytical finite element processes").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from femgear.errors import GeometryError
from femgear.fe.beam import RoundSection, check_touching
from femgear.fe.elasticity import basis, node_of_dof
from femgear.fe.meshing import Outline, mesh_outline

ACROSS = 4  # element edges across the thinnest wall
MAX_EDGES = 5000  # around the half section


@dataclass(frozen=True)
class ShaftStep:
    """One part of a stepped shaft, of a ``length`` [m].

    Its ``outer_diameter`` and ``inner_diameter`` [m]; without a bore the latter is zero.

    GeometryError: numbers that no shaft has (E-SHAFT).
    """

    length: float
    outer_diameter: float
    inner_diameter: float = 0.0

    def __post_init__(self):
        numbers = (self.length, self.outer_diameter, self.inner_diameter)
        if not (self.length > 0 and 0 <= self.inner_diameter < self.outer_diameter < math.inf):
            limit = "length > 0, 0 <= inner < outer diameter"
            raise GeometryError(f"a part of a shaft {numbers}", code="E-SHAFT", limit=limit)


def timoshenko_flexibility(steps: Sequence[ShaftStep], material) -> np.ndarray:
    """Deflection [m] and tilt [rad] of the end of a stepped cantilever per force [N] and moment [N m].

    Unit-load integrals of ``M^2/(E I) + Q^2/(kappa G A)`` (S. Timoshenko, Strength of Materials, part I),
    from the held end to the free one; a (2, 2) array.
    """
    far = sum(step.length for step in steps)
    result = np.zeros((2, 2))
    for step in steps:
        near = far - step.length
        section = RoundSection(
            step.outer_diameter, step.inner_diameter, material.youngs_modulus, material.poisson_ratio
        )
        bending = section.young * section.second_moment
        shear = section.shear_coefficient * section.shear_modulus * section.area
        cross = (far**2 - near**2) / (2 * bending)
        result += [
            [(far**3 - near**3) / (3 * bending) + step.length / shear, cross],
            [cross, step.length / bending],
        ]
        far = near
    return result


def shaft_flexibility(steps: Sequence[ShaftStep], material, *, refine: float = 1.0) -> np.ndarray:
    """Compute what `timoshenko_flexibility` does, of the solid body with its end face rigidly coupled.

    Steps come from the held end to the coupled one; ``refine`` divides the element size. The (2, 2) array is
    displacement [m] and tilt [rad] of the centre node per unit force [N] and moment [N m].

    GeometryError: no parts, neighbours that do not touch, or walls too thin for their length (E-SHAFT).
    """
    grid = mesh_outline(_half_section(steps, refine))
    K, size = _stiffness(grid, material), 3 * grid.n_nodes
    face, held = (np.unique(grid.boundaries[name]) for name in ("coupled", "held"))
    shapes = _free_shapes(grid, face, held)
    prescribed = np.zeros((size, 2))
    prescribed[3 * face, 0], prescribed[3 * face + 1, 0] = 1.0, -1.0
    # a tilt that goes with a positive deflection lowers the side towards which the shaft bends
    prescribed[3 * face + 2, 1] = -grid.points[face, 0]
    matrix = (shapes.T @ K @ shapes).tocsc()
    solved = scipy.sparse.linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(
        shapes.T @ (K @ prescribed)
    )
    u = prescribed - shapes @ solved
    return np.linalg.inv(u.T @ (K @ u))


def shaft_support_stiffness(steps: Sequence[ShaftStep], material, *, refine: float = 1.0) -> float:
    """Radial stiffness K = F/X [N/m] of the coupled end face, which may tilt; see `shaft_flexibility`."""
    return float(1.0 / shaft_flexibility(steps, material, refine=refine)[0, 0])


def check_shaft(steps: Sequence[ShaftStep]) -> None:
    """Refuse parts that make no shaft: see `shaft_flexibility` (GeometryError E-SHAFT)."""
    _half_section(steps, 1.0)


def _half_section(steps, refine):
    """Outline in the half plane (r, z) [m] with the end faces ``held`` (z = 0) and ``coupled``."""
    ends = [(step.outer_diameter, step.inner_diameter) for step in steps]
    check_touching(list(zip(ends, ends)))
    wall = min(0.5 * (step.outer_diameter - step.inner_diameter) for step in steps)
    size = wall / (ACROSS * refine)
    z = np.concatenate([[0.0], np.cumsum([step.length for step in steps])])
    around = 2.0 * z[-1] + sum(step.outer_diameter - step.inner_diameter for step in steps)
    if around / size > MAX_EDGES:
        raise GeometryError(
            f"the thinnest wall of the shaft is {1e3 * wall:.4g} mm on a length of {1e3 * z[-1]:.4g} mm",
            code="E-SHAFT",
            limit=f"walls of {1e3 * ACROSS * refine * around / MAX_EDGES:.3g} mm or more on this length",
            remedy="give a smaller inner diameter: a shell this thin is not resolved by elements across it",
        )
    outer, inner = [], []
    for k, step in enumerate(steps):
        outer += [(0.5 * step.outer_diameter, z[k]), (0.5 * step.outer_diameter, z[k + 1])]
        inner += [(0.5 * step.inner_diameter, z[k]), (0.5 * step.inner_diameter, z[k + 1])]
    chains = (
        ("held", [inner[0], outer[0]]),
        ("outside", outer),
        ("coupled", [outer[-1], inner[-1]]),
        ("inside", inner[::-1]),
    )
    return Outline(tuple((name, _divided(corners, size)) for name, corners in chains))


def _divided(corners, size):
    """Points (2k + 1, 2) along a polygon line, edges of about a size; corners that coincide count once."""
    points = [np.array(corners[0])]
    for corner in map(np.array, corners[1:]):
        length = float(np.hypot(*(corner - points[-1])))
        if length > 1e-12:
            start, count = points[-1], 2 * max(1, math.ceil(length / size))
            points += [start + (corner - start) * i / count for i in range(1, count)] + [corner]
    return np.array(points)


def _stiffness(grid, material):
    """Stiffness (3n, 3n) of the first harmonic around the axis, coordinates (U, V, W) node by node."""
    from skfem import BilinearForm

    scalar = basis(grid, order=5)
    nodes = node_of_dof(grid, scalar)
    lam, mu = material.lame("plane strain")
    d = np.array([[lam + 2 * mu if i == j else lam for j in range(3)] for i in range(3)])
    elastic = np.block([[d, np.zeros((3, 3))], [np.zeros((3, 3)), mu * np.eye(3)]])

    def strains(component, u, r):
        """Strains rr, tt, zz, rt, rz, tz of one component without their cosines and sines."""
        zero = 0.0 * u
        return (
            (u.grad[0], u / r, zero, -u / r, u.grad[1], zero),
            (zero, u / r, zero, u.grad[0] - u / r, zero, u.grad[1]),
            (zero, zero, u.grad[1], zero, u.grad[0], -u / r),
        )[component]

    def block(i, j):
        def form(u, v, w):
            r = w.x[0]
            left, right = strains(i, v, r), strains(j, u, r)
            terms = [elastic[a, b] * left[a] * right[b] for a, b in zip(*np.nonzero(elastic), strict=True)]
            return np.pi * r * sum(terms)

        return BilinearForm(form).assemble(scalar)

    blocks = scipy.sparse.block_array([[block(i, j) for j in range(3)] for i in range(3)]).tocoo()
    n = grid.n_nodes
    row, column = (3 * nodes[index % n] + index // n for index in (blocks.row, blocks.col))
    K = scipy.sparse.csc_array((blocks.data, (row, column)), shape=(3 * n, 3 * n))
    return 0.5 * (K + K.T)


def _free_shapes(grid, face, held):
    """Displacements (3n, m) of the coordinates that are not prescribed; on the axis V = -U and W = 0."""
    n, r = grid.n_nodes, grid.points[:, 0]
    taken = np.zeros(n, bool)
    taken[face] = taken[held] = True
    axis = np.flatnonzero((r <= 1e-9 * r.max()) & ~taken)
    off = np.flatnonzero((r > 1e-9 * r.max()) & ~taken)
    dofs = (3 * off[:, None] + np.arange(3)).ravel()
    rows = np.concatenate([dofs, 3 * axis, 3 * axis + 1])
    bubbles = len(dofs) + np.arange(len(axis))
    columns = np.concatenate([np.arange(len(dofs)), bubbles, bubbles])
    values = np.concatenate([np.ones(len(dofs) + len(axis)), -np.ones(len(axis))])
    return scipy.sparse.csc_array((values, (rows, columns)), shape=(3 * n, len(dofs) + len(axis)))
