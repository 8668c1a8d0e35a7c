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

from femgear.contact.assembly import (
    Bodies,
    MeshWindows,
    assemble_contact,
    contact_half_width,
    local_compliance,
    mesh_pairs,
)
from femgear.contact.candidates import windows
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
        Of the semi-elliptic pressure that fits best [m].
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


def half_width_of(position, pressure) -> float:
    """Half width of the semi-ellipse through pressures: ``p^2`` is a parabola in the position."""
    strong = pressure > 0.3 * pressure.max()
    unit = np.ptp(position[strong])
    square = np.polyfit(position[strong] / unit, (pressure[strong] / pressure.max()) ** 2, 2)
    roots = np.roots(square).real
    return float(0.5 * unit * abs(roots[0] - roots[1]))


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


def femgear_contact(bodies: Bodies, zeta: float, *, cells: int = 36) -> PairContact:
    """The pair at a path coordinate [m], assembled and solved as in the walk through the mesh cycle."""
    pair = mesh_pairs(reference_set())[0]
    width = 3.2 * contact_half_width(pair, LINE_LOAD, STEEL)
    w = windows(
        pair, np.full((1, 1, 1), zeta), width=width, cells=cells, nearest=math.inf, line_of_action=False
    )
    setup = MeshWindows(
        n_planets=1,
        positions=1,
        pairs=1,
        near=w.near,
        smallest_gap=w.gap.min(axis=-1),
        gap=w.gap,
        roll=(w.roll_1, w.roll_2),
        edge=(w.at_low_edge, w.at_high_edge),
        tooth=(np.zeros((1, 1), int), np.zeros((1, 1), int)),
        local=local_compliance(w.cell, cells, bodies)[None],
        cell_area=np.array([w.cell * bodies.face_width]),
    )
    problem = assemble_contact(setup, bodies, 0, np.zeros(1))
    force = LINE_LOAD * bodies.face_width
    # the planet is held, the sun turns: the other motion would be without restraint
    state = solve_contact(problem.H, problem.gap, problem.G[:, 1:], [force])
    pressure = state.loads / setup.cell_area[0]
    return PairContact(
        approach=float(state.motions[0]),
        peak_pressure=float(pressure.max()),
        half_width=half_width_of(problem.cell * w.cell, pressure),
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
        load = forces.toarray()[self.free]
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
