"""A helical pair of finite width, its gears whole and solid in three dimensions.

Every tooth pair that touches has a contact line, which ends where path or face width end. Bodies are solid
elements that turn with the teeth (`validation.reference.twisted`), all teeth by cyclic symmetry; half spaces
under the lines are taken out at depth and put back at the surface as for endless gears
(`validation.helical_teeth`), all contacts of one line as wide as Hertz's under its mean load. Approach and
tangent stiffness are along the transverse line of action, contacts on the theoretical path alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np

from femgear.contact.bodies import (
    Sector,
    Sectors,
    helical_stiffness,
    make_bodies,
    make_sectors,
    observed_flanks,
    station_weights,
)
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.flank_pairs import FlankPair, mesh_pairs
from femgear.contact.local_compliance import hertz_half_width
from femgear.contact.slices import width_waves
from femgear.gears.pair import GearPair
from femgear.gears.profile import base_helix_angle, overlap_ratio
from validation.helical_teeth import KNOTS, ContactLine, point_load, surface
from validation.pairs import LINE_LOAD, MODULE, POSITIONS, STEEL, TEETH, pair_of
from validation.reference.twisted import (
    axial_matrices,
    axial_shapes,
    flank_columns,
    section_matrices,
    solid_compliance,
)
from validation.rows import Row, within

HELIX = math.radians(20.0)
BASE, WIDE = base_helix_angle(math.radians(20.0), HELIX), math.pi * MODULE / math.sin(HELIX)
"""Base helix angle, and the face width [m] of an overlap ratio of 1."""
SLICES, HEIGHTS = 25, (1, 8)
"""Slices of femgear; elements over the width and their order, in three dimensions."""
SETTLED, STEPS = 1e-10, 50
SOLID = "twisted three-dimensional elements"
ENDS = (
    "mirror planes stand for the ends: free ones yield more, of helical teeth more than of straight ones, "
    "because thrust bends bodies of finite width, where endless ones carry it by shear between sections"
)


@cache
def helical_pair() -> GearPair:
    """The pair."""
    return pair_of(*TEETH[1], helix=HELIX, width=WIDE)


@cache
def coarse_sectors() -> Sectors:
    """Its sectors, half as fine as in plane contact, for both."""
    return make_sectors(helical_pair(), STEEL, flank_elements=6, refine=0.5)


@dataclass(frozen=True)
class SolidGear:
    """Compliance (teeth, stations p, stations p) [m/N] of a gear to normal forces at p heights.

    ``angle`` is its base helix angle [rad], zero of straight teeth.
    """

    roll: np.ndarray
    base_radius: float
    depth: np.ndarray
    compliance: np.ndarray
    width: float
    angle: float

    def at_stations(self, roll: np.ndarray) -> np.ndarray:
        """Shares (points, stations) of the stations in what acts at roll lengths (points,) [m]."""
        index, weight = station_weights(roll, self.roll)
        at = np.zeros((len(roll), len(self.roll)))
        np.put_along_axis(at, index, weight, axis=1)
        return at

    def loads(self, line: ContactLine, roll: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Loads (stations p, knots) of the functions of a line at roll lengths and heights (points,) [m]."""
        shapes = axial_shapes(self.width, *HEIGHTS, z)
        found = np.einsum("za,zp,zk->apk", self.at_stations(roll), shapes, line.loads)
        return found.reshape(-1, line.loads.shape[1])

    def at_depth(self, line: ContactLine, roll: np.ndarray, z: np.ndarray) -> np.ndarray:
        """What a half space yields at depth between the loads, at the stations on which they stand.

        From one point to another by a generator, ``dz / cos beta_b``, and across by what the roll length
        changes beyond that along it.
        """
        at, along, total, dz = (
            self.at_stations(roll),
            math.cos(self.angle),
            np.zeros(()),
            np.subtract.outer(z, z),
        )
        for a, b in np.ndindex(at.shape[1], at.shape[1]):
            mean = 0.5 * (self.roll[a] + self.roll[b]) / self.base_radius
            across = mean * (self.roll[a] - self.roll[b] - math.tan(self.angle) * dz)
            apart, depth = np.hypot(dz / along, across), along * self.depth[a]
            local = 2 * point_load(apart, depth, STEEL) - point_load(apart, 2 * depth, STEEL)
            total = total + (at[:, a, None] * line.loads).T @ local @ (at[:, b, None] * line.loads) / along**2
        return total


def solid_gear(sector: Sector, angle: float, *, mirrors: bool = False) -> SolidGear:
    """Compute a gear with a base helix angle [rad]; its ends are free, or mirror planes."""
    gear, slope = sector.gear, math.tan(angle)
    stations, depths, loads, seen = observed_flanks(sector.grid, gear)
    loads, seen = (flank_columns(one, stations.normals, slope) for one in (loads, seen))
    axial = axial_matrices(gear.face_width, *HEIGHTS)
    section = section_matrices(sector.grid, STEEL, slope / gear.base_radius)
    found = solid_compliance(sector.grid, section, axial, gear.teeth, loads, seen, mirrors=mirrors)
    return SolidGear(stations.roll, gear.base_radius, depths[:, 0], found, gear.face_width, angle)


def contact_lines(pair: FlankPair, reach: float, pitch: float, position: float) -> dict[int, ContactLine]:
    """Lines of all tooth pairs that touch at a position [mesh periods], by the number of the pair.

    Over half the width lines reach `reach` [m] along the path.
    """
    (start, end), slope, found = pair.path, 2.0 * reach / WIDE, {}
    for number in range(-4, 5):
        middle = pitch * (position + number)
        path = max(start, middle - reach), min(end, middle + reach)
        if path[1] > path[0]:
            knots = max(3, round(KNOTS * (path[1] - path[0]) / (2.0 * reach)))
            found[number] = ContactLine(path, slope, middle, knots)
    return found


def body_part(pair: FlankPair, gears, lines: dict[int, ContactLine]) -> np.ndarray:
    """What both bodies of an external pair yield between all functions of all lines [m/N]."""
    bodies = dict.fromkeys(product(lines, lines), 0.0)
    for gear, start, way in zip(gears, (pair.pitch_roll_1, pair.pitch_roll_2), (1, -1), strict=True):
        places = {n: (start + way * one.path, way * one.height) for n, one in lines.items()}
        loads = {n: gear.loads(one, *places[n]) for n, one in lines.items()}
        for i, j in bodies:
            part = loads[i].T @ gear.compliance[way * (i - j)] @ loads[j]
            bodies[i, j] = bodies[i, j] + part - (gear.at_depth(lines[i], *places[i]) if i == j else 0.0)
    H = np.block([[bodies[i, j] for j in lines] for i in lines])
    return 0.5 * (H + H.T)


def solid_pair(pair: FlankPair, gears, reach: float, pitch: float, load: float, position: float):
    """Approach [m] and tangent stiffness [N/m] of an external pair under a force [N]; see `contact_lines`."""
    along, lines = math.cos(gears[0].angle), contact_lines(pair, reach, pitch, position)
    H, lines = body_part(pair, gears, lines), list(lines.values())
    whole = np.concatenate([one.loads.sum(axis=0) for one in lines])
    every = np.split(np.arange(len(whole)), np.cumsum([one.loads.shape[1] for one in lines])[:-1])
    modulus = STEEL.youngs_modulus / (2 * (1 - STEEL.poisson_ratio**2))

    def yields(forces, factor):
        """Bodies and half spaces under the forces, of cores a factor times half of Hertz's half width."""
        total = H.copy()
        for at, line in zip(every, lines, strict=True):
            one, two = pair.pitch_roll_1 + line.path, pair.pitch_roll_2 - line.path
            carried = whole[at] @ forces[at] / line.weight.sum()
            half = [hertz_half_width(carried, radius, modulus) for radius in one * two / (one + two)]
            total[np.ix_(at, at)] += surface(
                line, 0.5 * factor * np.array(half) / math.sqrt(along), STEEL, along
            )
        return total

    forces, before = np.full(len(whole), load / whole.sum()), 0.0
    for _ in range(STEPS):
        # Hertz's pressure moves the middle by ln(2 / a) + 1/2, which changes with the load by ln(2 / a)
        found = np.linalg.solve(yields(forces, math.exp(-0.5)), whole)
        approach = load / (whole @ found)
        forces = approach * found
        if abs(approach - before) < SETTLED * approach:
            assert forces.min() > 0.0, "flanks pull"
            return float(approach), float(whole @ np.linalg.solve(yields(forces, 1.0), whole))
        before = approach
    raise AssertionError("the widths of the contacts do not settle")


@cache
def solid_means(kind: str) -> np.ndarray:
    """Mean approach [m] and stiffness over width [N/m^2] of a `PAIR` in three dimensions."""
    pair, angle = helical_pair(), 0.0 if kind.startswith("straight") else BASE
    gears = [solid_gear(one, angle, mirrors=kind.endswith("mirrors")) for one in coarse_sectors().gears]
    (flanks,), reach = mesh_pairs(pair), 0.5 * math.tan(BASE) * WIDE
    found = [solid_pair(flanks, gears, reach, pair.base_pitch, LINE_LOAD * WIDE, at) for at in POSITIONS]
    return np.array(found).mean(axis=0) / (1.0, WIDE)


@cache
def femgear_means(helical: float) -> np.ndarray:
    """The same of femgear, with a stiffness of the teeth over that of straight ones."""
    pair, factor = helical_pair(), (helical,)
    bodies = replace(make_bodies(coarse_sectors(), STEEL), helical=factor)
    waves = width_waves(coarse_sectors(), STEEL, SLICES, None, factor)
    ahead = overlap_ratio(WIDE, MODULE, HELIX) * ((np.arange(SLICES) + 0.5) / SLICES - 0.5)
    cycle = walk_mesh_cycle(
        pair, bodies, sun_torque=LINE_LOAD * WIDE * pair.gear_1.base_radius, positions=32,
        contact="line_of_action", options=CycleOptions(waves=waves, slices=SLICES, ahead=ahead),
    )  # fmt: skip
    return np.array([cycle.deflection.mean(), cycle.stiffness.mean() / WIDE])


def finite_width() -> tuple[Row, ...]:
    """Straight teeth under oblique contact lines, and helical ones with free ends, over one face width."""
    straight, ours = femgear_means(1.0), femgear_means(helical_stiffness(BASE, internal=False))
    rows, name = [], "24/36, x 0.3, 0.23, 20 degrees, overlap ratio 1, 300 N/mm: "
    of = (1e6, "mean approach [um]"), (1e-9, "mean tangent stiffness over width [N/(mm um)]")
    for i, (unit, text) in enumerate(of):
        one, free, helical = (
            unit * solid_means(kind)[i] for kind in ("straight, mirrors", "straight", "helical")
        )
        words = f"{name}straight teeth under oblique lines, "
        rows += [
            within("finite", SOLID, f"{words}mirror planes: {text}", one, unit * straight[i], 0.01),
            within("finite", SOLID, f"{words}free ends: {text}", free, unit * straight[i], 0.03),
            within("finite", SOLID, f"{name}helical teeth, free ends: {text}", helical, unit * ours[i], 0.03,
                   explanation=ENDS),
        ]  # fmt: skip
    return tuple(rows)
