"""One tooth pair: the contact of femgear against a finite-element contact of two bodies.

Both solve the same problem: a tooth of the sun and one of a planet of the reference set, each a sector in
plane strain held at its bore and at both cuts, pressed together by turning one about its centre. The
two-body solution (`validation.mortar`) resolves the contact with elements and knows no half plane
and no compliance at a depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from femgear.contact.assembly import assemble_contact
from femgear.contact.bodies import Bodies
from femgear.contact.flank_pairs import mesh_pairs
from femgear.contact.solve import solve_contact
from femgear.contact.windows import mesh_windows
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import mirror
from femgear.fe.meshing import Outline, mesh_outlines
from femgear.gears.gear import Gear, flank_points, half_thickness_angle
from femgear.gears.tooth import half_sector
from validation.mortar import boundary_dofs, make_surface, mortar_contact
from validation.planetary import reference_set
from validation.reference.held_sector import held_sector_compliance
from validation.reference.hertz import HertzLine, contact_modulus, hertz_line, relative_radius
from validation.rows import Row, at_most, information, within

STEEL = Material(206e9, 0.3, 7850.0)
LINE_LOAD = 70e3  # N/m: 100 N m on the sun, three planets, 25 mm
SPREAD = 1.35  # half of the finely divided stretch of flank, in half widths of the contact
GROWTH = 0.2  # of the element size along the flank beyond it
EDGES = 10  # element edges on one half width at level 1
LEVELS = (0.5, 1.0, 2.0)
PLACES = ((0, "pitch point"), (-16, "approach, -16/64 base pitch"), (24, "recess, 24/64 base pitch"))
TIP_PLACES = (61, 62)  # 1.0 and 0.3 half widths from the sun's tip corner


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


def hertz_of(fraction: float) -> HertzLine:
    """Hertz's contact of sun and planet at a path coordinate in base pitches."""
    s = reference_set()
    pair, zeta = mesh_pairs(s)[0], fraction * s.sun.base_pitch
    radius = relative_radius(pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - zeta)
    nu, youngs = STEEL.poisson_ratio, STEEL.youngs_modulus
    return hertz_line(LINE_LOAD, radius, contact_modulus(youngs, nu, youngs, nu))


def equal_half_width(force: float, square: float) -> float:
    """Half width [m] of the semi-elliptic pressure with given integrals of ``p`` and ``p^2``.

    ``16 (int p)^2 / (3 pi^2 int p^2)``, from ``pi a p_0 / 2`` and ``4 a p_0^2 / 3``.
    """
    return float(16.0 * force**2 / (3.0 * math.pi**2 * square))


def flank_bodies(*, flank_elements: int = 24, refine: float = 1.0) -> Bodies:
    """Flank compliances of one held sector of the sun and of the planet."""
    s = reference_set()
    gears = (s.sun, s.planet)
    grids = mesh_outlines([half_sector(g, flank_elements=flank_elements, refine=refine) for g in gears])
    sun, planet = (
        held_sector_compliance(grid, gear, STEEL, stiffness(grid, STEEL, thickness=gear.face_width), held="rim")
        for gear, grid in zip(gears, map(mirror, grids), strict=True)
    )
    # no ring mesh takes part
    return Bodies((sun, planet, planet), s.mesh_widths)


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
    s, force = reference_set(), LINE_LOAD * bodies.widths[0]
    setup = mesh_windows(s, bodies, share=force, positions=64, cells=cells, nearest=math.inf, contact="profile")
    only = np.zeros_like(setup.near)
    only[0] = np.abs(setup.zeta[0] - fraction * s.sun.base_pitch) < 1e-9 * s.sun.base_pitch
    position = int(np.flatnonzero(only[0].any(axis=1))[0])
    problem = assemble_contact(replace(setup, near=only), bodies, position)
    # the planets are held, the sun turns: the other motions would be without restraint
    state = solve_contact(problem.H, problem.gap, problem.G[:, -1:], [force])
    pressure, cell = state.loads / problem.area, problem.area / bodies.widths[0]
    return PairContact(
        approach=float(state.motions[0]),
        peak_pressure=float(pressure.max()),
        half_width=equal_half_width(cell @ pressure, cell @ pressure**2),
        unknowns=bodies.sun.unknowns + bodies.planet.unknowns,
    )


def graded_sector(gear: Gear, roll: float, half_width: float, *, level: float) -> Outline:
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
    """
    half = half_sector(gear, refine=level)
    arc = half.flank_roll**2 / (2 * gear.base_radius)
    largest = abs(arc[0] - arc[-1]) / (len(arc) // 2)
    s = np.linspace(arc[0], arc[-1], 20001)
    beyond = np.maximum(np.abs(s - roll**2 / (2 * gear.base_radius)) - SPREAD * half_width, 0.0)
    density = 1.0 / np.minimum((half_width / EDGES + GROWTH * beyond) / level, largest)
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


def two_body_contact(fraction: float, *, level: float = 1.0) -> PairContact:
    """The pair as two bodies in contact.

    Parameters
    ----------
    fraction : float
        Path coordinate in base pitches.
    level : float
        Divides every element size; at 1 a half width of the contact holds 10 element edges.
    """
    s, a = reference_set(), hertz_of(fraction).half_width
    pair, zeta = mesh_pairs(s)[0], fraction * s.sun.base_pitch
    rolls = (pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - zeta)
    grids = mesh_outlines([graded_sector(gear, roll, a, level=level) for gear, roll in zip((s.sun, s.planet), rolls)])

    def surface(gear, grid, start, turned, centre):
        # at the pitch point both left flanks lie on the line of centres
        half = float(half_thickness_angle(gear, gear.base_radius / math.cos(pair.pressure_angle)))
        angle = start - half + turned / gear.base_radius
        held = boundary_dofs(grid, "held")
        return make_surface(grid, STEEL, "contact", held=held, angle=angle, centre=(centre, 0.0))

    sun = surface(s.sun, grids[0], 0.0, zeta, 0.0)
    planet = surface(s.planet, grids[1], math.pi, -zeta, pair.centre_distance)
    middle = flank_points(s.sun, [rolls[0]])
    distance = np.hypot(*(grids[0].points[sun.nodes[1::2]] - middle).T)
    near = np.flatnonzero(distance < SPREAD * a)[[0, -1]]
    approach, position, pressure = mortar_contact(
        sun, planet, near, LINE_LOAD, centre=pair.centre_distance, base_radius=s.planet.base_radius
    )
    # the pressure is linear between the corners
    at_start, two, length = pressure[:-1], pressure[1:], np.diff(position)
    force, square = 0.5 * length @ (at_start + two), length @ (at_start**2 + at_start * two + two**2) / 3.0
    return PairContact(
        approach=approach,
        peak_pressure=float(pressure.max()),
        half_width=equal_half_width(force, square),
        unknowns=sun.unknowns + planet.unknowns,
    )


def tooth_pairs() -> tuple[Row, ...]:
    """One tooth pair inside the flanks, at three positions."""
    bodies = flank_bodies()
    return tuple(row for steps, place in PLACES for row in _one_place(bodies, steps / 64, place))


def _one_place(bodies, fraction, place):
    ours = femgear_contact(bodies, fraction)
    exact = hertz_of(fraction)
    coarse, middle, fine = (two_body_contact(fraction, level=level) for level in LEVELS)
    change = fine.approach - middle.approach
    # Richardson's extrapolation for second order
    limit = fine.approach + change / 3.0
    values = ", ".join(f"{1e6 * c.approach:.5f}" for c in (coarse, middle, fine))
    sizes = ", ".join(f"a/{EDGES * level:g}" for level in LEVELS)
    note = f"element edges {sizes} give {values} um; {fine.unknowns} against {ours.unknowns} unknowns"
    source, name = "two-body FE contact, mortar", f"27/40, 70 N/mm, {place}: "
    pressure, width = name + "peak pressure [MPa]", name + "half width [um]"
    p, p_two = 1e-6 * ours.peak_pressure, 1e-6 * fine.peak_pressure
    a, a_two = 1e6 * ours.half_width, 1e6 * fine.half_width
    return (
        within("pair", source, name + "approach [um]", 1e6 * limit, 1e6 * ours.approach, 1e-2, note=note),
        at_most("pair", "last halving", name + "two bodies, change", 2e-3, change / fine.approach),
        within("pair", source, pressure, p_two, p, 1e-2),
        within("pair", source, width, a_two, a, 1e-2),
        information("pair", "Hertz", pressure + ", two bodies", 1e-6 * exact.peak_pressure, p_two),
        information("pair", "Hertz", width + ", two bodies", 1e6 * exact.half_width, a_two),
    )


def tip_contact() -> tuple[Row, ...]:
    """The same pair where the contact comes to the tip corner of the sun."""
    s, bodies = reference_set(), flank_bodies()
    pair, rows = mesh_pairs(s)[0], []
    for steps in TIP_PLACES:
        fraction = steps / 64
        ours, two = femgear_contact(bodies, fraction), two_body_contact(fraction, level=1.5)
        roll = pair.pitch_roll_1 + fraction * s.sun.base_pitch
        arc = (pair.limits_1[1] ** 2 - roll**2) / (2 * s.sun.base_radius)
        share = arc / hertz_of(fraction).half_width
        name = f"27/40, 70 N/mm, {share:.2f} half widths from the tip corner of the sun: approach [um]"
        source = "two-body FE contact, mortar"
        rows.append(within("pair", source, name, 1e6 * two.approach, 1e6 * ours.approach, 5e-3))
    return tuple(rows)
