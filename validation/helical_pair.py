"""A helical pair of finite width, its gears whole and solid in three dimensions.

Every tooth pair that touches has a contact line, which ends where path or face width end. Bodies are solid
elements that turn with the teeth (`validation.reference.twisted`), all teeth by cyclic symmetry; half spaces
under the lines are taken out at depth and put back at the surface as for endless gears
(`validation.helical_teeth`), all contacts of one line as wide as Hertz's under its mean load. Approach and
tangent stiffness are along the transverse line of action, contacts on the theoretical path alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from femgear.contact.bodies import helical_stiffness, make_sectors, observed_flanks
from femgear.contact.flank_pairs import mesh_pairs
from femgear.contact.local_compliance import hertz_half_width
from femgear.gears.profile import base_helix_angle
from validation.helical_teeth import KNOTS, ContactLine, at_stations, point_load, surface
from validation.pairs import LINE_LOAD, MODULE, POSITIONS, STEEL, TEETH, in_slices, pair_of
from validation.reference.twisted import (
    axial_matrices,
    axial_shapes,
    flank_columns,
    section_matrices,
    solid_compliance,
)
from validation.rows import Row, within

HELIX = {degrees: math.radians(degrees) for degrees in (20, 10)}
BASE = {degrees: base_helix_angle(math.radians(20.0), helix) for degrees, helix in HELIX.items()}
WIDE = {degrees: math.pi * MODULE / math.sin(helix) for degrees, helix in HELIX.items()}
"""Helix angles and base helix angles, and the face widths [m] of an overlap ratio of 1."""
HEIGHTS = (1, 8)
"""Elements over the width and their order, in three dimensions."""
SETTLED, STEPS = 1e-10, 50
SOLID = "twisted three-dimensional elements"
ENDS = (
    "femgear's ends are mirror planes. Free ends have more compliance, those of helical teeth more than those "
    "of straight ones: thrust bends bodies of finite width, while endless bodies carry it by shear between "
    "sections"
)


@cache
def helical_pair(degrees: int):
    """The pair of a helix angle, and its sectors for both, half as fine as in plane contact."""
    pair = pair_of(*TEETH[1], helix=HELIX[degrees], width=WIDE[degrees])
    return pair, make_sectors(pair, STEEL, flank_elements=6, refine=0.5)


@dataclass(frozen=True)
class SolidGear:
    """Compliance (teeth, stations p, stations p) [m/N] of a gear to normal forces at p heights.

    ``angle`` is its base helix angle [rad], zero of straight teeth, ``width`` its face width [m].
    """

    roll: np.ndarray
    base_radius: float
    depth: np.ndarray
    compliance: np.ndarray
    angle: float
    width: float

    def loads(self, line: ContactLine, roll: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Loads (stations p, knots) of the functions of a line at roll lengths and heights (points,) [m]."""
        at, shapes = at_stations(roll, self.roll), axial_shapes(self.width, *HEIGHTS, z)
        return np.einsum("za,zp,zk->apk", at, shapes, line.loads).reshape(-1, line.loads.shape[1])

    def at_depth(self, line: ContactLine, roll: np.ndarray, z: np.ndarray) -> np.ndarray:
        """What a half space yields at depth between the loads, at the stations on which they stand.

        From one point to another by a generator, ``dz / cos beta_b``, and across by what the roll length
        changes beyond that along it.
        """
        at, along, total = at_stations(roll, self.roll), math.cos(self.angle), np.zeros(())
        dz = np.subtract.outer(z, z)
        for a, b in np.ndindex(at.shape[1], at.shape[1]):
            mean = 0.5 * (self.roll[a] + self.roll[b]) / self.base_radius
            across = mean * (self.roll[a] - self.roll[b] - math.tan(self.angle) * dz)
            apart, depth = np.hypot(dz / along, across), along * self.depth[a]
            local = 2 * point_load(apart, depth, STEEL) - point_load(apart, 2 * depth, STEEL)
            total = total + (at[:, a, None] * line.loads).T @ local @ (at[:, b, None] * line.loads) / along**2
        return total


def solid_gear(sector, angle: float, width: float, *, mirrors: bool = False) -> SolidGear:
    """Compute a gear with a base helix angle [rad] and a width [m]; its ends are free, or mirror planes."""
    gear, slope = sector.gear, math.tan(angle)
    stations, depths, loads, seen = observed_flanks(sector.grid, gear)
    loads, seen = (flank_columns(columns, stations.normals, slope) for columns in (loads, seen))
    section = section_matrices(sector.grid, STEEL, slope / gear.base_radius)
    axial = axial_matrices(width, *HEIGHTS)
    compliance = solid_compliance(sector.grid, section, axial, gear.teeth, loads, seen, mirrors=mirrors)
    return SolidGear(stations.roll, gear.base_radius, depths[:, 0], compliance, angle, width)


def contact_lines(degrees: int, position: float) -> dict[int, ContactLine]:
    """Lines of all tooth pairs that touch at a position [mesh periods], by the number of the pair."""
    pair, slope, compliances = helical_pair(degrees)[0], math.tan(BASE[degrees]), {}
    reach = 0.5 * slope * WIDE[degrees]
    for number in range(-4, 5):
        middle = pair.base_pitch * (position + number)
        path = max(pair.path[0], middle - reach), min(pair.path[1], middle + reach)
        if path[1] > path[0]:
            knots = max(3, round(KNOTS * (path[1] - path[0]) / (2.0 * reach)))
            compliances[number] = ContactLine(path, slope, middle, knots)
    return compliances


def body_part(starts, gears, lines: dict[int, ContactLine]) -> np.ndarray:
    """What both bodies yield between all functions of all lines [m/N], by roll lengths at the pitch point."""
    bodies = dict.fromkeys(product(lines, lines), 0.0)
    for gear, start, way in zip(gears, starts, (1, -1), strict=True):
        places = {n: (start + way * line.path, way * line.height) for n, line in lines.items()}
        loads = {n: gear.loads(line, *places[n]) for n, line in lines.items()}
        for i, j in bodies:
            part = loads[i].T @ gear.compliance[way * (i - j)] @ loads[j]
            bodies[i, j] = bodies[i, j] + part - (gear.at_depth(lines[i], *places[i]) if i == j else 0.0)
    H = np.block([[bodies[i, j] for j in lines] for i in lines])
    return 0.5 * (H + H.T)


def solid_pair(gears, degrees: int, position: float) -> tuple[float, float]:
    """Compute approach [m] and tangent stiffness over width [N/m^2] at a position."""
    along, numbered, width = math.cos(gears[0].angle), contact_lines(degrees, position), WIDE[degrees]
    (flanks,) = mesh_pairs(helical_pair(degrees)[0])
    starts, load = (flanks.pitch_roll_1, flanks.pitch_roll_2), LINE_LOAD * width
    H, lines = body_part(starts, gears, numbered), list(numbered.values())
    whole = np.concatenate([contact_line.loads.sum(axis=0) for contact_line in lines])
    every = np.split(np.arange(len(whole)), np.cumsum([contact_line.loads.shape[1] for contact_line in lines])[:-1])
    modulus = STEEL.youngs_modulus / (2 * (1 - STEEL.poisson_ratio**2))

    def yields(forces, factor):
        """Bodies and half spaces under the forces, of cores a factor times half of Hertz's half width."""
        total = H.copy()
        for at, line in zip(every, lines, strict=True):
            roll, two = starts[0] + line.path, starts[1] - line.path
            carried = whole[at] @ forces[at] / line.weight.sum()
            half = [hertz_half_width(carried, radius, modulus) for radius in roll * two / (roll + two)]
            core = 0.5 * factor * np.array(half) / math.sqrt(along)
            total[np.ix_(at, at)] += surface(line, core, STEEL, along)
        return total

    forces, before = np.full(len(whole), load / whole.sum()), 0.0
    for _ in range(STEPS):
        # Hertz's pressure moves the middle by ln(2 / a) + 1/2, which changes with the load by ln(2 / a)
        motions = np.linalg.solve(yields(forces, math.exp(-0.5)), whole)
        approach = load / (whole @ motions)
        forces = approach * motions
        if abs(approach - before) < SETTLED * approach:
            assert forces.min() > 0.0, "flanks pull"
            return float(approach), float(whole @ np.linalg.solve(yields(forces, 1.0), whole)) / width
        before = approach
    raise AssertionError("the widths of the contacts do not settle")


def solid_means(degrees: int, *, straight: bool = False, mirrors: bool = False) -> np.ndarray:
    """Mean approach [m] and stiffness over width [N/m^2] of solid gears, of straight or helical teeth."""
    angle, sectors = 0.0 if straight else BASE[degrees], helical_pair(degrees)[1].gears
    gears = [solid_gear(sector, angle, WIDE[degrees], mirrors=mirrors) for sector in sectors]
    return np.mean([solid_pair(gears, degrees, at) for at in POSITIONS], axis=0)


def femgear_means(degrees: int, *, straight: bool = False) -> np.ndarray:
    """The same of femgear."""
    line = {"positions": 32, "contact": "line_of_action"}
    helical = 1.0 if straight else helical_stiffness(BASE[degrees], internal=False)
    cycle = in_slices(helical_pair(degrees)[0], 1.0, helical, fine=False, **line)
    return np.array([cycle.deflection.mean(), cycle.stiffness.mean() / WIDE[degrees]])


def finite_width() -> tuple[Row, ...]:
    """Helical teeth with free ends, and straight ones under the same oblique contact lines."""
    of = (1e6, "mean approach [um]"), (1e-9, "mean tangent stiffness over width [N/(mm um)]")
    oblique, free = {"straight": True}, "helical teeth, free ends"
    variants = (
        (20, "straight teeth under oblique lines, mirror planes", oblique, {"mirrors": True}, 0.01, ""),
        (20, "straight teeth under oblique lines, free ends", oblique, {}, 0.03, ""),
        (10, free, {}, {}, 0.03, ""),
        (20, free, {}, {}, 0.03, ENDS),
    )
    rows = []
    for degrees, words, teeth, ends, gate, why in variants:
        solid, ours = solid_means(degrees, **teeth, **ends), femgear_means(degrees, **teeth)
        name = f"24/36, {degrees} degrees, overlap ratio 1, 300 N/mm, {words}: "
        rows += [
            within("finite", SOLID, name + text, c * solid[i], c * ours[i], gate, explanation=why)
            for i, (c, text) in enumerate(of)
        ]
    return tuple(rows)
