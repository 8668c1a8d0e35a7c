"""A gear under tooth loads twice: from one sector by cyclic symmetry, and with all its teeth in one grid.

The whole gear has its own grid, cubic elements and its own assembly, so that it shares with the sector
only the outline and the loads. Each tooth load is a pressure spread over a short stretch of flank: under a
concentrated force neither solution would converge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.flank_pairs import LEFT, RIGHT, mesh_pairs
from femgear.fe.compliance import cyclic_displacement, symmetric_factor
from femgear.fe.grid import copy_nodes, rotated_copies
from validation.reference.plane_elasticity import edge_load, to_skfem

if TYPE_CHECKING:
    from femgear.contact.bodies import Sector
    from femgear.contact.mesh_cycle import MeshCycle
    from femgear.fe.elasticity import Material
    from femgear.fe.grid import Grid
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet

SPREAD = 0.25
"""Half length of the loaded stretch of flank, in modules."""


@dataclass(frozen=True)
class ToothLoads:
    """Normal forces on the flanks of one gear.

    Parameters
    ----------
    tooth : (n,) int array
    side : (n,) int array
        `LEFT` or `RIGHT`.
    roll : (n,) array
        Roll lengths of the points [m].
    force : (n,) array
        [N]
    """

    tooth: np.ndarray
    side: np.ndarray
    roll: np.ndarray
    force: np.ndarray

    def only(self, chosen) -> ToothLoads:
        """Some of the loads."""
        return ToothLoads(self.tooth[chosen], self.side[chosen], self.roll[chosen], self.force[chosen])


@dataclass(frozen=True)
class Held:
    """How a gear is held: at its rim, or there on a foundation of these moduli [N/m^3]."""

    radial: float | None = None
    tangential: float | None = None

    @property
    def boundary(self) -> str | None:
        """Boundary that cannot move, None on a foundation."""
        return "rim" if self.radial is None else None


def loads_of(planetary_set: PlanetarySet, cycle: MeshCycle, position: int, acting) -> ToothLoads:
    """Tooth loads of one body from a contact solution.

    Parameters
    ----------
    planetary_set : PlanetarySet
    cycle : MeshCycle
    position : int
        Index into ``cycle.position``, in the first mesh period.
    acting : sequence of (mesh, gear, side)
        Meshes of the body, whether it is gear 0 or 1 of them, and the flank that they load.
    """
    columns = []
    for mesh, gear, side in acting:
        pair = mesh_pairs(planetary_set)[int(mesh >= planetary_set.n_planets)]
        for t in np.flatnonzero(cycle.tooth_load[mesh, :, position]):
            zeta = cycle.path[mesh, t, position]
            roll = pair.pitch_roll_1 + zeta if gear == 0 else pair.pitch_roll_2 - pair.sign * zeta
            columns.append((cycle.tooth[gear, mesh, t], side, roll, cycle.tooth_load[mesh, t, position]))
    tooth, side, roll, force = (np.array(column) for column in zip(*columns, strict=True))
    return ToothLoads(tooth, side, roll, force)


def traction(gear: Gear, loads: ToothLoads, x, y) -> np.ndarray:
    """Traction [Pa] of all loads at points of the flanks, tooth 0 on the x axis, shape (2, ...).

    Around its point each load has the pressure ``(1 - t^2)^2`` over the arc of the flank; a stretch that
    ends with the flank carries the whole load on what is left of it.
    """
    sign, base = (-1.0 if gear.internal else 1.0), gear.base_radius
    radius, polar = np.hypot(x, y), np.arctan2(y, x)
    pressure_angle = np.arccos(np.minimum(base / radius, 1.0))
    arc = 0.5 * base * np.tan(pressure_angle) ** 2
    ends = 0.5 * np.sort([gear.form_roll, gear.tip_roll]) ** 2 / base
    result = np.zeros((2, *np.shape(x)))
    for tooth, side, roll, force in zip(loads.tooth, loads.side, loads.roll, loads.force, strict=True):
        from_centre = (polar - tooth * gear.pitch_angle + np.pi) % (2 * np.pi) - np.pi
        way = 1.0 if side == LEFT else -1.0
        on_flank = (way * from_centre > 0.0) & (way * from_centre < 0.5 * gear.pitch_angle)
        middle, half = 0.5 * roll**2 / base, SPREAD * gear.module
        t = (arc - middle) / half
        whole = _bump_integral((ends - middle) / half) * half * gear.face_width
        pressure = np.where(on_flank, force / whole * np.maximum(1.0 - t**2, 0.0) ** 2, 0.0)
        outward = polar + way * (0.5 * np.pi - sign * pressure_angle)
        result -= pressure * np.array([np.cos(outward), np.sin(outward)])
    return result


def _bump_integral(ends) -> float:
    """Integral of ``(1 - t^2)^2`` between two places."""
    low, high = np.clip(ends, -1.0, 1.0)
    return float((high - low) - 2 * (high**3 - low**3) / 3 + (high**5 - low**5) / 5)


def bump_shares(gear: Gear, roll: float, *, cells: int = 40) -> tuple[np.ndarray, np.ndarray, float]:
    """The pressure of one load of `traction` as cells: arcs of their middles [m], shares, half width [m]."""
    middle, half = 0.5 * roll**2 / gear.base_radius, SPREAD * gear.module
    ends = 0.5 * np.sort([gear.form_roll, gear.tip_roll]) ** 2 / gear.base_radius
    edges = np.linspace(*np.clip((ends - middle) / half, -1.0, 1.0), cells + 1)
    shares = np.array([_bump_integral(pair) for pair in pairwise(edges)])
    arcs = middle + 0.5 * half * (edges[1:] + edges[:-1])
    return arcs, shares / shares.sum(), 0.5 * half * (edges[1] - edges[0])


def sector_loads(sector: Sector, loads: ToothLoads) -> np.ndarray:
    """Nodal forces of every sector in its own frame, shape (teeth, 2n) [N]."""
    gear, grid = sector.gear, sector.grid
    result = np.zeros((gear.teeth, 2 * grid.n_nodes))
    for i, tooth in enumerate(loads.tooth):
        single = replace(loads.only([i]), tooth=np.zeros(1, int))
        name = "flank_left" if loads.side[i] == LEFT else "flank_right"

        def spread(x, normal, single=single):
            return np.moveaxis(traction(gear, single, x[..., 0], x[..., 1]), 0, -1)

        result[tooth % gear.teeth] += edge_load(grid, name, spread, thickness=gear.face_width)
    return result


def by_sector(sector: Sector, loads: ToothLoads, held: Held) -> np.ndarray:
    """Displacement of every node of every sector by cyclic symmetry, gear frame, (teeth, n, 2)."""
    from femgear.fe.elasticity import foundation

    gear, matrix = sector.gear, sector.stiffness
    if held.boundary is None:
        moduli = held.radial, held.tangential
        matrix = matrix + foundation(sector.grid, "rim", *moduli, thickness=gear.face_width)
    field = cyclic_displacement(sector.grid, matrix, sector_loads(sector, loads), held=held.boundary)
    return np.einsum("kij,knj->kni", _turns(gear), field)


def _turns(gear) -> np.ndarray:
    angle = np.arange(gear.teeth) * gear.pitch_angle
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]).transpose(2, 0, 1)


def by_same_grid(sector: Sector, loads: ToothLoads, held: Held, material: Material, state) -> np.ndarray:
    """As `by_sector`, from one sparse solution of all sectors merged at their cuts."""
    from femgear.fe.elasticity import foundation, stiffness

    gear, grid = sector.gear, sector.grid
    whole, nodes = rotated_copies(grid, gear.teeth), copy_nodes(grid, gear.teeth)
    matrix = stiffness(whole, material, state=state, thickness=gear.face_width)
    free = np.ones(2 * whole.n_nodes, bool)
    if held.boundary is None:
        matrix = matrix + foundation(whole, "rim", held.radial, held.tangential, thickness=gear.face_width)
    else:
        rim = np.unique(whole.boundaries["rim"])
        free[np.concatenate([2 * rim, 2 * rim + 1])] = False
    forces = sector_loads(sector, loads).reshape(gear.teeth, -1, 2)
    total = np.zeros((whole.n_nodes, 2))
    np.add.at(total, nodes, np.einsum("kij,knj->kni", _turns(gear), forces))
    u = np.zeros(2 * whole.n_nodes)
    u[free] = symmetric_factor(matrix.tocsc()[free][:, free]).solve(total.ravel()[free])
    return u.reshape(-1, 2)[nodes]


def by_cubic_elements(
    grid: Grid, gear: Gear, loads: ToothLoads, held: Held, material: Material, state: dict
) -> np.ndarray:
    """Displacement of the corner nodes of another sector grid, all sectors merged, (teeth, n, 2).

    Cubic triangles on the quadratic outline; mid-side nodes of `grid`, which carry no unknown, are NaN.

    Parameters
    ----------
    grid : Grid
        Of one sector.
    gear : Gear
    loads : ToothLoads
    held : Held
    material : Material
    state : dict of region to str
        ``"plane strain"`` or ``"plane stress"``.
    """
    from scipy.sparse import block_array
    from skfem import Basis, ElementTriP3, FacetBasis

    whole = _ascending(rotated_copies(grid, gear.teeth))
    mesh, element = to_skfem(whole), ElementTriP3()
    parts = [
        _elastic(Basis(mesh, element, intorder=6, elements=name), material, plane) for name, plane in state.items()
    ]
    blocks = [sum(part[i] for part in parts) for i in range(3)]
    if held.boundary is None:
        spring = _springs(FacetBasis(mesh, element, facets="rim", intorder=8), held)
        blocks = [block + more for block, more in zip(blocks, spring, strict=True)]
    xx, yy, xy = blocks
    matrix = gear.face_width * block_array([[xx, xy], [xy.T, yy]], format="csc")
    scalar = Basis(mesh, element, intorder=2)
    rim = scalar.get_dofs("rim").all() if held.boundary is not None else np.zeros(0, int)
    # the factor of a ring whose unknowns are numbered around it takes a tenth of the time
    around = np.argsort(np.arctan2(*scalar.doflocs[::-1]))
    free = np.setdiff1d(around, rim, assume_unique=True)
    free = np.column_stack([free, scalar.N + free]).ravel()
    u = np.zeros(matrix.shape[0])
    force = gear.face_width * _flank_forces(mesh, element, gear, loads)
    u[free] = symmetric_factor(matrix[free][:, free]).solve(force[free])
    values = np.full((whole.n_nodes, 2), np.nan)
    corners = whole.triangles[:, :3].ravel()
    vertex = scalar.nodal_dofs[0, mesh.t.T.ravel()]
    values[corners] = np.column_stack([u[vertex], u[scalar.N + vertex]])
    return values[copy_nodes(grid, gear.teeth)]


def _ascending(grid: Grid) -> Grid:
    """The grid with the corners of every triangle in ascending order, which cubic elements need."""
    from femgear.fe.grid import Grid

    order = np.argsort(grid.triangles[:, :3], axis=1)
    edge = {frozenset((0, 1)): 3, frozenset((1, 2)): 4, frozenset((2, 0)): 5}
    middle = np.array([[edge.get(frozenset((i, j)), -1) for j in range(3)] for i in range(3)])
    middles = [middle[order[:, i], order[:, (i + 1) % 3]] for i in range(3)]
    triangles = np.take_along_axis(grid.triangles, np.column_stack([order, *middles]), axis=1)
    return Grid(grid.points, triangles, grid.boundaries, grid.regions)


def _elastic(basis, material, plane):
    """Blocks xx, yy and xy of the stiffness per unit thickness."""
    from skfem import BilinearForm

    lam, mu = material.lame(plane)
    slopes = {
        (i, j): BilinearForm(lambda u, v, w, i=i, j=j: u.grad[j] * v.grad[i]).assemble(basis)
        for i, j in ((0, 0), (1, 1), (0, 1))
    }
    both = lam + 2 * mu
    return (
        both * slopes[0, 0] + mu * slopes[1, 1],
        both * slopes[1, 1] + mu * slopes[0, 0],
        lam * slopes[0, 1] + mu * slopes[0, 1].T,
    )


def _springs(basis, held):
    """Blocks xx, yy and xy of the foundation per unit thickness."""
    from skfem import BilinearForm

    def form(weight):
        return BilinearForm(lambda u, v, w: weight(*(w.x / np.hypot(*w.x))) * u * v).assemble(basis)

    k, t = held.radial, held.tangential
    return (
        form(lambda c, s: k * c**2 + t * s**2),
        form(lambda c, s: k * s**2 + t * c**2),
        form(lambda c, s: (k - t) * c * s),
    )


def _flank_forces(mesh, element, gear, loads):
    """Load vector of all tractions per unit thickness, x then y."""
    from skfem import FacetBasis, LinearForm

    result = []
    for name, side in (("flank_left", LEFT), ("flank_right", RIGHT)):
        chosen = loads.only(loads.side == side)
        basis = FacetBasis(mesh, element, facets=name, intorder=12)
        result.append(
            [LinearForm(lambda v, w, i=i, c=chosen: traction(gear, c, *w.x)[i] * v).assemble(basis) for i in (0, 1)]
        )
    return np.sum(result, axis=0).ravel()
