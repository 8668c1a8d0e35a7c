"""A helical pair of finite width, its gears whole and solid in three dimensions, their ends free.

Every tooth pair that touches has a contact line, which ends where path or face width end. Bodies are solid
elements that turn with the teeth (`validation.reference.twisted`), all teeth by cyclic symmetry; half spaces
under the lines are taken out at depth and put back at the surface as for endless gears
(`validation.helical_teeth`). Approach and tangent stiffness are along the transverse line of action.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from femgear.contact.bodies import Sector, observed_flanks, station_weights
from femgear.contact.local_compliance import hertz_half_width
from femgear.gears.pair import GearPair
from validation.helical_teeth import KNOTS, ContactLine, point_load, surface
from validation.reference.twisted import (
    axial_matrices,
    axial_shapes,
    flank_columns,
    section_matrices,
    solid_compliance,
)

SETTLED, STEPS = 1e-10, 50


@dataclass(frozen=True)
class SolidGear:
    """Compliance (teeth, stations p, stations p) [m/N] of a helical gear to normal forces at p heights."""

    roll: np.ndarray
    base_radius: float
    depth: np.ndarray
    compliance: np.ndarray
    width: float
    heights: tuple[int, int]

    def at_stations(self, roll: np.ndarray) -> np.ndarray:
        """Shares (points, stations) of the stations in what acts at roll lengths (points,) [m]."""
        index, weight = station_weights(roll, self.roll)
        at = np.zeros((len(roll), len(self.roll)))
        np.put_along_axis(at, index, weight, axis=1)
        return at

    def loads(self, line: ContactLine, roll: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Loads (stations p, knots) of the functions of a line at roll lengths and heights (points,) [m]."""
        shapes = axial_shapes(self.width, *self.heights, z)
        found = np.einsum("za,zp,zk->apk", self.at_stations(roll), shapes, line.loads)
        return found.reshape(-1, line.loads.shape[1])

    def at_depth(self, line: ContactLine, roll: np.ndarray, z: np.ndarray, material, angle: float):
        """What a half space yields at depth between the loads, at the stations on which they stand.

        From one point to another by a generator, ``dz / cos beta_b``, and across by what the roll length
        changes beyond that along it.
        """
        at, along, total, dz = self.at_stations(roll), math.cos(angle), 0.0, np.subtract.outer(z, z)
        for a, b in np.ndindex(at.shape[1], at.shape[1]):
            mean = 0.5 * (self.roll[a] + self.roll[b]) / self.base_radius
            across = mean * (self.roll[a] - self.roll[b] - math.tan(angle) * dz)
            apart, depth = np.hypot(dz / along, across), along * self.depth[a]
            local = 2 * point_load(apart, depth, material) - point_load(apart, 2 * depth, material)
            total += (at[:, a, None] * line.loads).T @ local @ (at[:, b, None] * line.loads) / along**2
        return total


def solid_gear(
    sector: Sector, material, angle: float, heights: tuple[int, int], *, mirrors: bool = False
) -> SolidGear:
    """Compute a gear with a base helix angle [rad], of elements and orders over the width; free ends or not."""
    gear, slope = sector.gear, math.tan(angle)
    stations, depths, loads, seen = observed_flanks(sector.grid, gear)
    loads, seen = (flank_columns(one, stations.normals, slope) for one in (loads, seen))
    axial = axial_matrices(gear.face_width, *heights)
    section = section_matrices(sector.grid, material, slope / gear.base_radius)
    found = solid_compliance(sector.grid, section, axial, gear.teeth, loads, seen, mirrors=mirrors)
    return SolidGear(stations.roll, gear.base_radius, depths[:, 0], found, gear.face_width, heights)


def contact_lines(pair: GearPair, slope: float, position: float) -> dict[int, ContactLine]:
    """Lines of all tooth pairs that touch at a position [mesh periods], by the number of the pair."""
    reach, (start, end), found = 0.5 * slope * pair.gear_1.face_width, pair.path, {}
    for number in range(-4, 5):
        middle = pair.base_pitch * (position + number)
        path = max(start, middle - reach), min(end, middle + reach)
        if path[1] > path[0]:
            knots = max(3, round(KNOTS * (path[1] - path[0]) / (2.0 * reach)))
            found[number] = ContactLine(path, slope, middle, knots)
    return found


def solid_pair(pair: GearPair, gears, material, angle: float, load: float, position: float):
    """Approach [m], tangent stiffness [N/m] and load per width (points,) of an external pair under a force [N]."""
    along, lines = math.cos(angle), contact_lines(pair, math.tan(angle), position)
    bodies: dict[tuple[int, int], np.ndarray] = {}
    rolls = (lambda at: pair.pitch_roll_1 + at, lambda at: pair.pitch_roll_2 - at)
    for gear, roll, way in zip(gears, rolls, (1, -1), strict=True):
        loads = {n: gear.loads(one, roll(one.path), way * one.height) for n, one in lines.items()}
        for i, j in ((i, j) for i in lines for j in lines):
            part = loads[i].T @ gear.compliance[way * (i - j)] @ loads[j]
            if i == j:
                one = lines[i]
                part -= gear.at_depth(one, roll(one.path), way * one.height, material, angle)
            bodies[i, j] = bodies.get((i, j), 0.0) + part
    H = np.block([[bodies[i, j] for j in lines] for i in lines])
    H, whole = 0.5 * (H + H.T), np.concatenate([one.loads.sum(axis=0) for one in lines.values()])
    ends = np.cumsum([one.loads.shape[1] for one in lines.values()])
    every = np.split(np.arange(len(whole)), ends[:-1])
    modulus = material.youngs_modulus / (2 * (1 - material.poisson_ratio**2))

    def yields(forces, secant):
        """Bodies and half spaces under the forces, whose contacts have Hertz's width."""
        total = H.copy()
        for at, line in zip(every, lines.values(), strict=True):
            one, two = (roll(line.path) for roll in rolls)
            carried = max(line.loads.sum(axis=0) @ forces[at], 0.0) / line.weight.sum()
            half = [hertz_half_width(carried, radius, modulus) for radius in one * two / (one + two)]
            core = 0.5 * np.array(half) * (math.exp(-0.5) if secant else 1.0)
            total[np.ix_(at, at)] += surface(line, core / math.sqrt(along), material, along)
        return total

    forces, approach = np.full(len(whole), load / whole.sum()), 0.0
    for _ in range(STEPS):
        found = np.linalg.solve(yields(forces, True), whole)
        before, approach = approach, load / (whole @ found)
        forces = approach * found
        if abs(approach - before) < SETTLED * approach:
            break
    else:
        raise AssertionError("the widths of the contacts do not settle")
    stiffness = whole @ np.linalg.solve(yields(forces, False), whole)
    return approach, float(stiffness), forces
