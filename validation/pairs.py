"""Gear pairs: mean stiffness against ISO 6336-1, and one pair against a contact of two whole bodies.

The two bodies are whole gears in plane strain, all teeth in one grid, held at their bores. The mortar contact
of `validation.mortar` resolves all tooth pairs that touch with elements of a fraction of the contact's width
and knows no half plane, no compliance at a depth and no cyclic symmetry.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from femgear.contact.bodies import helical_stiffness, make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.width_waves import width_waves
from femgear.fe.compliance import node_dofs, symmetric_factor
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import Grid, mirror, ordered_nodes
from femgear.fe.meshing import mesh_outlines
from femgear.gears.gear import Gear
from femgear.gears.iso6336_stiffness import pair_mesh_stiffness
from femgear.gears.kinematics import orientations
from femgear.gears.pair import GearPair, close_pair
from femgear.gears.profile import (
    BasicRack,
    base_helix_angle,
    overlap_ratio,
    transverse_rack,
    transverse_tool,
)
from femgear.gears.tooth import half_sector
from validation.mortar import Surface, covered, mortar_contacts
from validation.rows import Row, at_most, information, within

STEEL = Material(206e9, 0.3, 7850.0)
MODULE, WIDTH = 3e-3, 20e-3
LINE_LOAD = 300e3  # N/m: within the range of the standard's formula, 100 to 1600 N/mm
TEETH = (
    (20, 20, 0.0, 0.0),
    (24, 36, 0.3, 0.23),
    (18, 54, 0.4, 0.0),
    (30, 30, 0.0, 0.0),
    (25, 100, 0.2, 0.0),
    (40, 60, 0.0, 0.0),
    (22, 33, 0.5, 0.3),
    (24, -72, 0.0, 0.0),
    (30, -108, 0.3, 0.3),
    (25, -90, 0.4, 0.4),
)
HELICAL = (
    (10.0, 24, 36, 0.3, 0.23),
    (20.0, 24, 36, 0.3, 0.23),
    (30.0, 24, 36, 0.3, 0.23),
    (20.0, 24, -72, 0.0, 0.0),
    (30.0, 24, -72, 0.0, 0.0),
)
SLICES = 17
UNCOUPLED = (
    "the standard takes cos(beta) times the stiffness of spur teeth of the normal section, whose slices are "
    "independent. Without coupling femgear's slices are 12 % above it. With coupling, parts of a contact line "
    "high on a tooth are supported by those low on it. Free ends of gears have more compliance than mirror "
    "planes"
)
LEVELS = (120, 240)
RIM = 8.0  # modules
POSITIONS = np.arange(8) / 8
STEP = 0.05  # of the load, to either side, for the tangent of the two bodies


def pair_of(z_1: int, z_2: int, x_1: float, x_2: float, *, helix=0.0, width=WIDTH) -> GearPair:
    """Pair without play; an internal gear has a negative number of teeth, and one module is the normal one.

    All bodies are held `RIM` modules beyond their roots, small ones at 0.4 of the reference radius. The
    standard's solid disc has no twist between teeth and hub, which would grow with the ratio of the radii.
    """

    module, pressure_angle = transverse_tool(MODULE, np.radians(20.0), helix)

    def gear(z, x, name):
        radius, inner = 0.5 * module * abs(z), z < 0
        away = (RIM + 1.25 + (x if inner else -x)) * MODULE
        rim = radius + away if inner else max(radius - away, 0.4 * radius)
        tip = 2.0 * (radius - 0.8 * MODULE + x * MODULE) if inner else None
        return Gear(
            abs(z),
            module,
            pressure_angle,
            x * np.cos(helix),
            width,
            rim,
            internal=inner,
            tip_diameter=tip,
            rack=transverse_rack(BasicRack(), helix),
            name=name,
        )

    return close_pair(gear(z_1, x_1, "gear_1"), gear(z_2, x_2, "gear_2"))


@cache
def walked(*teeth, load=LINE_LOAD, positions=16):
    """Mesh cycle of a pair under a line load [N/m]."""
    pair = pair_of(*teeth)
    bodies = make_bodies(make_sectors(pair, STEEL), STEEL)
    at = POSITIONS if positions == len(POSITIONS) else positions
    return walk_mesh_cycle(pair, bodies, sun_torque=load * WIDTH * pair.gear_1.base_radius, positions=at)


def in_slices(pair: GearPair, overlap: float, helical: float, *, fine=True, base=0.0, **given):
    """Mesh cycle in slices, of teeth with a stiffness over that of straight ones, under `LINE_LOAD`."""
    coarse, factor = make_sectors(pair, STEEL, flank_elements=6, refine=0.5), (helical,)
    bodies = make_bodies(make_sectors(pair, STEEL) if fine else coarse, STEEL)
    waves = width_waves(coarse, STEEL, SLICES, None, factor)
    ahead = overlap * ((np.arange(SLICES) + 0.5) / SLICES - 0.5)
    return walk_mesh_cycle(
        pair,
        replace(bodies, helical=factor, base_helix_angle=base),
        **given,
        sun_torque=LINE_LOAD * pair.gear_1.face_width * pair.gear_1.base_radius,
        options=CycleOptions(waves=waves, slices=SLICES, ahead=ahead),
    )


def iso_stiffness() -> tuple[Row, ...]:
    """Mean tangent stiffness of spur and helical pairs against ISO 6336-1, pressures of the latter."""
    rows, pressed = [], []
    for teeth in TEETH:
        standard, k = pair_mesh_stiffness(pair_of(*teeth))[1], walked(*teeth).stiffness.mean() / WIDTH
        name = f"{teeth[0]}/{teeth[1]}, x {teeth[2]:g}, {teeth[3]:g}, 300 N/mm: c_gamma [N/(mm um)]"
        rows.append(within("pairs", "ISO 6336-1 method B", name, 1e-9 * standard, 1e-9 * k, 0.15))
    for helix, z_1, z_2, x_1, x_2 in HELICAL:
        beta, base = np.radians(helix), base_helix_angle(np.radians(20.0), np.radians(helix))
        pair, factor = pair_of(z_1, z_2, x_1, x_2, helix=beta), helical_stiffness(base, internal=z_2 < 0)
        standard = 1e-9 * pair_mesh_stiffness(pair, beta)[1]
        overlap = overlap_ratio(WIDTH, MODULE, beta)
        cycle = in_slices(pair, overlap, factor, positions=16, base=base)
        pressed.append(
            within(
                "pairs",
                "Hertz, normal section (ISO 6336-2, Z_H)",
                f"{z_1}/{z_2}, {helix:g} degrees, 300 N/mm: pressure over Hertz's, median over slices",
                1.0,
                float(np.median(over_hertz(pair, cycle, overlap, base))),
                0.01,
                note="pairs with a fifth of the largest load, at the curvatures of their places",
            )
        )
        name = f"{z_1}/{z_2}, x {x_1:g}, {x_2:g}, {helix:g} degrees, 300 N/mm: c_gamma [N/(mm um)]"
        k = 1e-9 * cycle.stiffness.mean() / WIDTH
        rows.append(
            within(
                "pairs",
                "ISO 6336-1 method B",
                name,
                standard,
                k,
                0.15,
                explanation=UNCOUPLED if (helix, z_2) == (30.0, -72) else "",
            )
        )
    return *rows, *pressed


def over_hertz(pair: GearPair, cycle, overlap: float, base: float) -> np.ndarray:
    """Pressures of slices over those of Hertz between cylinders in the normal section."""
    pinion, two = pair.gear_1, pair.gear_2
    ahead = overlap * ((np.arange(SLICES) + 0.5) / SLICES - 0.5) * pinion.pitch_angle * pinion.base_radius
    path, tangent = cycle.path[:, :, None] + ahead[:, None], np.tan(pair.working_pressure_angle)
    sign = -1.0 if two.internal else 1.0
    curved = 1 / (pinion.base_radius * tangent + path) + sign / (two.base_radius * tangent - sign * path)
    carries = (cycle.slice_pressure > 0) & (cycle.slice_load > 0.2 * cycle.slice_load.max())
    modulus = STEEL.youngs_modulus / (2.0 * (1.0 - STEEL.poisson_ratio**2))
    hertz = np.sqrt(cycle.slice_load * modulus * curved * np.cos(base) / (np.pi * pinion.face_width))
    return cycle.slice_pressure[carries] / hertz[carries]


def whole_gear(gear: Gear, fine: tuple[int, ...], flank_elements: int):
    """Grid of all teeth, left flanks of the fine ones by tooth, and what `Surface` takes of the body."""
    coarse, resolved = (
        mirror(grid)
        for grid in mesh_outlines([half_sector(gear, flank_elements=n, refine=0.5) for n in (8, flank_elements)])
    )
    points, triangles, rim, flanks, first = [], [], [], {}, 0
    for tooth in range(gear.teeth):
        number = tooth if tooth in fine else tooth - gear.teeth
        grid, angle = resolved if number in fine else coarse, tooth * gear.pitch_angle
        c, s = np.cos(angle), np.sin(angle)
        points.append(grid.points @ np.array([[c, s], [-s, c]]))
        triangles.append(grid.triangles + first)
        rim.append(grid.boundaries["rim"] + first)
        if number in fine:
            flanks[number] = grid.boundaries["flank_left"] + first
        first += grid.n_nodes
    whole = np.concatenate(points)
    _, kept, merged = np.unique(np.round(whole / 1e-8), axis=0, return_index=True, return_inverse=True)
    cut = len(np.unique(coarse.boundaries["cut_left"]))
    assert len(kept) == first - gear.teeth * cut, "the cuts of the sectors do not match"
    merged = merged.ravel()
    edges = {"rim": merged[np.concatenate(rim)], **{str(n): merged[nodes] for n, nodes in flanks.items()}}
    grid = Grid(whole[kept], merged[np.concatenate(triangles)], edges, {})
    free = np.setdiff1d(np.arange(2 * grid.n_nodes), node_dofs(np.unique(edges["rim"])))
    K = stiffness(grid, STEEL, thickness=1.0)[free][:, free]
    return grid, {n: ordered_nodes(grid, str(n)) for n in flanks}, free, K


def near_edges(slave: Surface, master: Surface, reach: float) -> tuple[int, int] | None:
    """First and last edge of the slave with a counterpart within a reach [m]; None without."""
    away = master.points[None] - slave.points[0::2, None]
    touching = covered(slave, master) & (np.hypot(*away.transpose(2, 0, 1)).min(axis=1) < reach)
    near = np.flatnonzero(touching[1:] & touching[:-1])
    return (int(near[0]), int(near[-1])) if len(near) else None


def two_bodies(flank_elements: int) -> np.ndarray:
    """Approach [m] of whole gears 24/36 at all positions under three loads, (P, 3)."""
    pair, pairs = pair_of(*TEETH[1]), (-1, 0)
    bodies = [whole_gear(g, (-1, 0, 1), flank_elements) for g in pair.gears]
    factors = [symmetric_factor(body[3]) for body in bodies]
    values = np.zeros((len(POSITIONS), 3))
    for p, tau in enumerate(POSITIONS):
        angles = [gear_angle[0] for gear_angle in orientations(pair, tau).gears]

        def surface(body, tooth, angle, centre):
            grid, flanks, free, K = body
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            place = grid.points[flanks[tooth]] @ turn.T + (centre, 0.0)
            return Surface(place, flanks[tooth], turn, free, K, 2 * grid.n_nodes)

        places = []
        for i in pairs:
            slave = surface(bodies[0], i, angles[0], 0.0)
            master = surface(bodies[1], -i, angles[1], pair.centre_distance)
            if near := near_edges(slave, master, 0.03 * MODULE):
                places.append((slave, master, near))
        loads = LINE_LOAD * np.array([1.0 - STEP, 1.0, 1.0 + STEP])
        solved = mortar_contacts(
            places, loads, centre=pair.centre_distance, base_radius=pair.gear_2.base_radius, factors=factors
        )
        values[p] = [approach for approach, _ in solved]
    return values


def whole_bodies() -> tuple[Row, ...]:
    """Transmission error and stiffness of one pair over the mesh period against two whole bodies."""
    ours = walked(*TEETH[1], positions=len(POSITIONS))
    coarse, fine = (two_bodies(n) for n in LEVELS)
    k = 2.0 * STEP * LINE_LOAD / (fine[:, 2] - fine[:, 0])
    name, source = "24/36, 300 N/mm, 8 positions: ", "two whole bodies, mortar contact"
    error = np.abs(ours.deflection[0] / fine[:, 1] - 1.0).max()
    values = 1e6 * fine[:, 1].mean(), 1e6 * ours.deflection[0].mean()
    peaks = 1e6 * np.ptp(fine[:, 1]), 1e6 * np.ptp(ours.deflection[0])
    return (
        within("pairs", source, name + "mean transmission error [um]", *values, 0.01),
        within("pairs", source, name + "transmission error, peak to peak [um]", *peaks, 0.01),
        at_most("pairs", source, name + "transmission error at any position, relative", 0.01, error),
        within(
            "pairs",
            source,
            name + "mean tangent stiffness over width [N/(mm um)]",
            1e-9 * k.mean(),
            1e-9 * ours.stiffness.mean() / WIDTH,
            0.01,
        ),
        information(
            "pairs",
            "half the elements",
            name + "mean transmission error, two bodies [um]",
            values[0],
            1e6 * coarse[:, 1].mean(),
        ),
    )
