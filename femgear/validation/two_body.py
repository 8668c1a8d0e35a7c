"""One tooth pair: the contact of femgear against a finite-element contact of two bodies.

Both solve the same problem: the sun's and the planet's tooth of the reference set, each one sector in
plane strain held at its bore and at both cuts, pressed together by turning the planet about its centre.

The two-body solution knows no half plane and no compliance at a depth. Each body has a grid of its own
that resolves the contact, the surfaces meet in a mortar contact of the finite-element surfaces as they
are (pressure piecewise linear on the nodes of the sun's flank, mean separations weighted with its hat
functions: M. A. Puso, T. A. Laursen, Comput. Methods Appl. Mech. Eng. 193, 2004, with the piecewise
linear multipliers for quadratic elements of A. Popp et al., Int. J. Numer. Meth. Eng. 83, 2010), and an
active set finds where they touch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from femgear.contact.assembly import Bodies, assemble_contact, mesh_pairs, mesh_windows
from femgear.contact.flanks import held_sector_compliance
from femgear.contact.halfplane import HertzLine, contact_modulus, hertz_line, relative_radius
from femgear.contact.solve import solve_contact
from femgear.errors import ContactError
from femgear.fe.checks import check_solution
from femgear.fe.compliance import symmetric_factor
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.meshing import Grid, Outline, mesh_outlines, mirror
from femgear.gears import Gear
from femgear.gears.gear import flank_points, half_thickness_angle
from femgear.gears.tooth import half_sector
from femgear.validation.planetary import reference_set
from femgear.validation.rows import Row, information, within

STEEL = Material(206e9, 0.3, 7850.0)
LINE_LOAD = 70e3  # N/m, about 100 N m on the sun, three planets, 25 mm
SPREAD = 1.35  # half of the finely divided stretch of flank, in half widths of the contact
GROWTH = 0.2  # of the element size along the flank beyond it


@dataclass(frozen=True)
class PairContact:
    """Contact of one tooth pair.

    Parameters
    ----------
    approach : float
        Along the line of action [m].
    peak_pressure : float
        [Pa]
    half_width : float
        See `equal_half_width` [m].
    unknowns : int
        Degrees of freedom of both grids.
    """

    approach: float
    peak_pressure: float
    half_width: float
    unknowns: int


def hertz_of(zeta: float) -> HertzLine:
    """Hertz's contact of sun and planet at a path coordinate [m]."""
    pair = mesh_pairs(reference_set())[0]
    radius = relative_radius(pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - zeta)
    nu, youngs = STEEL.poisson_ratio, STEEL.youngs_modulus
    return hertz_line(LINE_LOAD, radius, contact_modulus(youngs, nu, youngs, nu))


def equal_half_width(position, pressure) -> float:
    """Half width [m] of the semi-elliptic pressure with the same integrals of ``p`` and ``p^2``.

    ``16 (int p)^2 / (3 pi^2 int p^2)``, from ``pi a p_0 / 2`` and ``4 a p_0^2 / 3``.
    """
    force, square = np.trapezoid(pressure, position), np.trapezoid(pressure**2, position)
    return float(16.0 * force**2 / (3.0 * math.pi**2 * square))


# --- the contact of femgear ---


def flank_bodies(*, flank_elements: int = 24, refine: float = 1.0) -> Bodies:
    """Flank compliances of one held sector of the sun and of the planet."""
    s = reference_set()
    gears = (s.sun, s.planet)
    grids = mesh_outlines([half_sector(g, flank_elements=flank_elements, refine=refine) for g in gears])
    sun, planet = (
        held_sector_compliance(
            grid, gear, STEEL, stiffness(grid, STEEL, thickness=gear.face_width), held="rim"
        )
        for gear, grid in zip(gears, map(mirror, grids), strict=True)
    )
    # no ring mesh takes part
    return Bodies(sun=sun, planet=planet, ring=planet, material=STEEL, face_width=s.sun.face_width)


def femgear_contact(bodies: Bodies, fraction: float, *, cells: int = 36) -> PairContact:
    """The pair at a path coordinate, assembled and solved as in the walk through the mesh cycle.

    Parameters
    ----------
    bodies : Bodies
    fraction : float
        Path coordinate in base pitches, a multiple of 1/64.
    cells : int
        Pressure cells in the contact window.
    """
    s, force = reference_set(), LINE_LOAD * bodies.face_width
    setup = mesh_windows(
        s, bodies, share=force, positions=64, cells=cells, nearest=math.inf, contact="profile"
    )
    only = np.zeros_like(setup.near)
    only[0] = np.abs(setup.zeta[0] - fraction * s.sun.base_pitch) < 1e-9 * s.sun.base_pitch
    position = int(np.flatnonzero(only[0].any(axis=1))[0])
    problem = assemble_contact(replace(setup, near=only), bodies, position, np.zeros(s.n_planets))
    # the planets are held, the sun turns: the other motions would be without restraint
    state = solve_contact(problem.H, problem.gap, problem.G[:, -1:], [force])
    pressure = state.loads / setup.cell_area[0]
    cell = setup.cell_area[0] / bodies.face_width
    return PairContact(
        approach=float(state.motions[0]),
        peak_pressure=float(pressure.max()),
        half_width=equal_half_width(problem.cell * cell, pressure),
        unknowns=bodies.sun.unknowns + bodies.planet.unknowns,
    )


# --- the two bodies ---


def graded_sector(gear: Gear, roll: float, half_width: float, *, level: float, edges: int) -> Outline:
    """Whole sector whose left flank is divided finely around one point.

    Parameters
    ----------
    gear : Gear
    roll : float
        Roll length of the middle of the contact [m].
    half_width : float
        Of the contact [m].
    level : float
        Divides every element size.
    edges : int
        Element edges on one half width at level 1.
    """
    half = half_sector(gear, refine=level)
    arc = half.flank_roll**2 / (2 * gear.base_radius)
    largest = abs(arc[0] - arc[-1]) / (len(arc) // 2)
    s = np.linspace(arc[0], arc[-1], 20001)
    beyond = np.maximum(np.abs(s - roll**2 / (2 * gear.base_radius)) - SPREAD * half_width, 0.0)
    density = 1.0 / np.minimum((half_width / edges + GROWTH * beyond) / level, largest)
    steps = 0.5 * (density[1:] + density[:-1]) * abs(s[1] - s[0])
    integral = np.concatenate([[0.0], np.cumsum(steps)])
    corners = np.interp(np.linspace(0.0, integral[-1], math.ceil(integral[-1]) + 1), integral, s)
    stations = np.interp(np.arange(2 * len(corners) - 1) / 2, np.arange(len(corners)), corners)
    flank = flank_points(gear, np.sqrt(2 * gear.base_radius * stations))
    flank[0], flank[-1] = half.curve("flank")[0], half.curve("flank")[-1]
    left = [(name, points) for name, points in half.curves if name != "symmetry"]
    right = [(name, points[::-1] * [1.0, -1.0]) for name, points in left[::-1]]
    left = [("contact", flank) if name == "flank" else (name, points) for name, points in left]
    held = ("cut", "rim")
    return Outline(tuple(("held" if name in held else name, points) for name, points in left + right))


@dataclass(frozen=True)
class Surface:
    """A body with a contact surface, in its place.

    ``corner``, ``mid`` (k + 1, 2), (k, 2): nodes of the surface in order [m]; ``nodes`` (2 k + 1,) their
    numbers; ``turn`` (2, 2) rotation from the frame of the grid; ``solve`` columns of nodal forces to
    displacements, both in the frame of the grid.
    """

    points: np.ndarray
    nodes: np.ndarray
    turn: np.ndarray
    stiffness: object
    free: np.ndarray
    factor: object

    def at(self, edge, t):
        """Points, unnormalised tangents (m, 2) and shape values (3, m) on edges (m,) at t (m,) in 0 .. 1."""
        node = self.points[2 * edge[:, None] + [0, 1, 2]]
        shape = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
        slope = np.stack([4 * t - 3, 4 - 8 * t, 4 * t - 1])
        return np.einsum("im,mic->mc", shape, node), np.einsum("im,mic->mc", slope, node), shape

    def columns(self, edge, shape, vector, weight):
        """Nodal forces (2n, m) of tractions `vector` (q, 2) spread by `weight` (q, m), as sparse columns."""
        from scipy.sparse import csr_array

        local = vector @ self.turn  # back into the frame of the grid
        dof = 2 * self.nodes[2 * edge[:, None] + [0, 1, 2]][..., None] + [0, 1]
        value = np.einsum("iq,qc->qic", shape, local)
        point = np.broadcast_to(np.arange(len(edge))[:, None, None], dof.shape)
        size = (self.stiffness.shape[0], len(edge))
        return csr_array((value.ravel(), (dof.ravel(), point.ravel())), shape=size) @ weight

    def compliance(self, forces):
        """``F^T K^-1 F`` of the columns of nodal forces."""
        load = forces[self.free]
        u = np.zeros((self.stiffness.shape[0], load.shape[1]))
        u[self.free] = self.factor.solve(load)
        check_solution(self.stiffness[self.free][:, self.free], u[self.free], load)
        return forces.T @ u


def place(grid: Grid, angle: float, centre: float) -> Surface:
    """Body with the tooth at an angle about the centre (centre, 0), held at its bore and cuts."""
    K = stiffness(grid, STEEL, thickness=1.0)
    held = np.unique(grid.boundaries["held"])
    free = np.ones(grid.n_nodes, bool)
    free[held] = False
    free = np.flatnonzero(np.repeat(free, 2))
    edges = grid.boundaries["contact"]
    nodes = np.append(edges[:, [0, 2]].ravel(), edges[-1, 1])
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    points = grid.points[nodes] @ turn.T + [centre, 0.0]
    return Surface(points, nodes, turn, K, free, symmetric_factor(K[free][:, free]))


def _gauss(edges):
    """Six points on each half of some edges: edge, place 0 .. 1 on it and weight, all (q,)."""
    x, weight = np.polynomial.legendre.leggauss(6)
    t = np.concatenate([0.25 * (1 + x), 0.75 + 0.25 * x])
    return np.repeat(edges, 12), np.tile(t, len(edges)), np.tile(0.25 * weight, 2 * len(edges))


def _hats(edge, t):
    """Piecewise linear functions of the corners of consecutive edges at points of them, (q, k + 1)."""
    place = edge - edge[0] + t
    return np.maximum(1.0 - np.abs(place[:, None] - np.arange(edge[-1] - edge[0] + 2)), 0.0)


def _project(master: Surface, x, along):
    """Where lines through `x` (q, 2) across the unit tangents `along` meet the master: edge and place."""
    corner = np.einsum("qkc,qc->qk", master.points[None, 0::2] - x[:, None], along)
    crosses = corner[:, :-1] * corner[:, 1:] <= 0
    if not crosses.any(axis=1).all():
        raise ContactError("a point of the contact surface has no counterpart", code="E-CONTACT-INPUT")
    edge, row = crosses.argmax(axis=1), np.arange(len(x))
    start, end = corner[row, edge], corner[row, edge + 1]
    t = start / (start - end)
    for _ in range(8):
        y, slope, _ = master.at(edge, t)
        t = t - ((y - x) * along).sum(axis=1) / (slope * along).sum(axis=1)
    return edge, t


def mortar_contact(slave: Surface, master: Surface, near, *, centre: float, base_radius: float):
    """Solve the contact of two surfaces; the master turns about (centre, 0) towards the slave.

    Parameters
    ----------
    slave, master : Surface
    near : (2,) integer sequence
        First and last slave edge that may touch.
    centre, base_radius : float
        Of the master [m].

    Returns
    -------
    approach : float
        Turn of the master times its base radius [m].
    place, pressure : (m,) arrays
        Positions along the slave [m] and pressures [Pa] of its corners.
    """
    edge, t, weight = _gauss(np.arange(near[0], near[1] + 1))
    x, tangent, shape = slave.at(edge, t)
    length = np.hypot(*tangent.T)
    along = tangent / length[:, None]
    normal = np.column_stack([along[:, 1], -along[:, 0]])  # the body lies on the left of its boundary
    on_edge, on_t = _project(master, x, along)
    y, _, on_shape = master.at(on_edge, on_t)
    weighted = _hats(edge, t) * (weight * length)[:, None]
    arm = (y[:, 1] * normal[:, 0] - (y[:, 0] - centre) * normal[:, 1]) / base_radius
    gap = weighted.T @ ((y - x) * normal).sum(axis=1)
    compliance = slave.compliance(slave.columns(edge, shape, -normal, weighted))
    compliance += master.compliance(master.columns(on_edge, on_shape, normal, weighted))
    approach, pressure = _active_set(compliance, gap, weighted.T @ arm, LINE_LOAD)
    node = slave.points[2 * near[0] : 2 * near[1] + 3 : 2]
    place = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(node, axis=0).T))])
    return approach, place, pressure


def _active_set(compliance, gap, arm, load):
    """``gap + H p - arm q >= 0, p >= 0``, complementary, ``arm^T p = load``, from all nodes touching."""
    active = np.ones(len(gap), bool)
    for _ in range(100):
        n = np.count_nonzero(active)
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = compliance[np.ix_(active, active)]
        matrix[:n, n] = matrix[n, :n] = -arm[active]
        scale = 1.0 / np.sqrt(np.append(np.diag(matrix)[:n], arm.max() ** 2 / compliance.max()))
        solved = scale * np.linalg.solve(
            scale[:, None] * matrix * scale, scale * np.append(-gap[active], -load)
        )
        pressure = np.zeros(len(gap))
        pressure[active] = solved[:n]
        rest = gap + compliance @ pressure - arm * solved[n]
        following = np.where(active, pressure > 0, rest < 0)
        if np.array_equal(following, active):
            return float(solved[n]), pressure
        active = following
    raise ContactError("the active set of the two bodies does not settle", code="E-CONTACT-CONVERGENCE")


def two_body_contact(zeta: float, *, level: float = 1.0, edges: int = 10) -> PairContact:
    """The pair at a path coordinate [m] as two bodies in contact; see `graded_sector` for the sizes."""
    s = reference_set()
    pair, a = mesh_pairs(s)[0], hertz_of(zeta).half_width
    rolls = (pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - zeta)
    gears, sign = (s.sun, s.planet), (1.0, -1.0)
    grids = mesh_outlines(
        [graded_sector(g, r, a, level=level, edges=edges) for g, r in zip(gears, rolls, strict=True)]
    )
    # at the pitch point both left flanks lie on the line of centres
    surfaces = []
    for gear, grid, start, turn in zip(gears, grids, (0.0, math.pi), sign, strict=True):
        thickness = float(half_thickness_angle(gear, gear.base_radius / math.cos(pair.pressure_angle)))
        centre = 0.0 if turn > 0 else pair.centre_distance
        surfaces.append(place(grid, start - thickness + turn * zeta / gear.base_radius, centre))
    sun, planet = surfaces
    middle = flank_points(s.sun, [rolls[0]])
    distance = np.hypot(*(grids[0].points[sun.nodes[1::2]] - middle).T)
    near = np.flatnonzero(distance < SPREAD * a)[[0, -1]]
    approach, position, pressure = mortar_contact(
        sun, planet, near, centre=pair.centre_distance, base_radius=s.planet.base_radius
    )
    if pressure[0] > 0 and near[0] > 0 or pressure[-1] > 0:
        raise ContactError("the contact runs out of its finely divided stretch", code="E-CONTACT-WINDOW")
    return PairContact(
        approach=approach,
        peak_pressure=float(pressure.max()),
        half_width=equal_half_width(position, pressure),
        unknowns=sun.stiffness.shape[0] + planet.stiffness.shape[0],
    )
