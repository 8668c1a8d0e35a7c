"""Stiffness of helical teeth in three dimensions beside that of the teeth of their transverse section.

Both gears of a mesh are endless. Height z runs ahead of mid-face, so that a contact line crosses its flank as
``s = s_0 + z tan beta_b``, and tooth j carries at z what tooth 0 carries one pitch of the axis later: a field
``e^(i q tau z)`` goes with the cyclic harmonic q. Per transverse force ``w dz`` of a piece of the face width
the force along the tooth normal n is ``w dz / cos beta_b``, on ``dz / cos beta_b`` of contact line: w per
length of line. A normal approach closes the transverse line of action by ``1 / cos beta_b`` of it, so that
half spaces under the line yield ``1 / cos beta_b`` times what they yield under spur teeth, and Hertz's half
width is that of the radius ``rho / cos beta_b``. They are taken out at depth and put back at the surface as
`femgear.contact.bodies` does it, along lines that end (Boussinesq's point loads).
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from femgear.case.gear_set import material_of, planetary_set
from femgear.contact.bodies import (
    flank_load_columns,
    flank_stations,
    helical_stiffness,
    make_sectors,
    observed_flanks,
    regular_compliance,
    station_weights,
)
from femgear.contact.flank_pairs import mesh_pairs
from femgear.contact.local_compliance import depth_displacement, hertz_half_width
from femgear.contact.root_stress import root_stress_influence
from femgear.fe.compliance import condense_sector, tooth_compliance
from femgear.fe.elasticity import stiffness
from femgear.fe.grid import boundary_edges
from femgear.gears.profile import base_helix_angle
from femgear.trains.helical.model import _line_load, section_stiffness
from femgear.trains.reading import read_case, with_values
from validation.__main__ import ROOT
from validation.reference.twisted import flank_columns, wave_compliances
from validation.rows import Row, within

POINTS, KNOTS = 400, 17
"""Points of a contact line, and knots of the load between them."""
PITCHES, DEPTHS, WAVES = 3.0, 5.0, 24
"""Waves shorter than the pitch over the first do not see the next tooth: some are computed, up to a depth."""


EXPLAINED = (
    "in virtual gears parts of a contact line high on a tooth are not supported by those low on it. "
    "Slices without coupling have too much compliance, the more the shorter the lines"
)


def point_load(distance, depth, material):
    """Displacement into the half space under a unit point load [m/N] (Johnson, section 3.2)."""
    r, nu = np.hypot(distance, depth), material.poisson_ratio
    return (2 * (1 - nu) / r + depth**2 / r**3) * (1 + nu) / (2 * np.pi * material.youngs_modulus)


LOW_LOADS = (
    "the factor is that of the stiffness, hence of bending. Loads low on the flank also shear the teeth, and "
    "the helix raises shear less. The largest stresses come from loads higher up"
)


class ContactLine:
    """A contact line over (part of) its path: places, weights along the axis, and functions of the load.

    Height zero is where it crosses the path coordinate ``middle`` [m].
    """

    def __init__(self, path: tuple[float, float], slope: float, middle: float = 0.0, knots: int = KNOTS):
        x, w = np.polynomial.legendre.leggauss(4)
        cells = np.linspace(*path, POINTS // 4 + 1)
        half = 0.5 * np.diff(cells)[:, None]
        self.path = (cells[:-1, None] + half * (x + 1)).ravel()
        self.weight = (half * w).ravel() / slope
        places = np.linspace(*path, knots)
        self.height = (self.path - middle) / slope
        self.path_ends, self.ends = path, (np.array(path) - middle) / slope
        self.basis = np.array([np.interp(self.path, places, hat) for hat in np.eye(knots)]).T
        self.loads = self.weight[:, None] * self.basis


def at_stations(roll: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Shares (points, n) of stations (n,) in what acts at roll lengths (points,) [m]."""
    index, weight = station_weights(roll, stations)
    at = np.zeros((len(roll), len(stations)))
    np.put_along_axis(at, index, weight, axis=1)
    return at


def endless_flank(sector, material, line: ContactLine, roll, angle: float, *, twisted: bool) -> np.ndarray:
    """Regular compliance between the loads of a line, per transverse force, of helical or straight teeth."""
    gear, slope = sector.gear, math.tan(angle)
    twist, along = slope / gear.base_radius, math.cos(angle) if twisted else 1.0
    stations, depths, loads, seen = observed_flanks(sector.grid, gear)
    loads, seen = (flank_columns(columns, stations.normals, twisted * slope) for columns in (loads, seen))
    every = math.ceil(PITCHES / (gear.pitch_angle * gear.reference_radius * twist))
    last = math.ceil(DEPTHS / (depths.min() * math.cos(angle) * twist))
    chosen = np.unique(np.append(np.arange(every + 1), np.geomspace(every, last, WAVES).round().astype(int)))
    waves = [(q * twist, 2 * np.pi * q / gear.teeth) for q in chosen]
    computed = np.array(list(wave_compliances(sector.grid, material, twisted * twist, loads, seen, waves)))
    short = CubicSpline(np.log(chosen[every - 3 :]), computed[every - 3 :])
    z = (-1.0 if gear.internal else 1.0) * (roll - roll.mean()) / slope
    at = at_stations(roll, stations.roll)
    total = np.zeros((KNOTS, KNOTS))
    for q in range(last + 1):
        F = at.T @ (np.exp(-1j * q * twist * z)[:, None] * line.loads)
        part = (F.conj().T @ (computed[q] if q <= every else short(math.log(q))) @ F).real
        total += part * (1.0 if q == 0 else 2.0) * twist / (2 * np.pi)
    # straight flanks carry the line across, in their own arcs; helical ones along themselves
    across = 0.0 if twisted else roll**2 / (2 * gear.base_radius)
    apart = np.hypot(np.subtract.outer(z, z) / along, np.subtract.outer(across, across))
    depth = along * np.interp(roll, stations.roll, depths[:, 0])[:, None]
    local = (2 * point_load(apart, depth, material) - point_load(apart, 2 * depth, material)) / along**2
    total -= line.loads.T @ local @ line.loads
    return 0.5 * (total + total.T)


def surface(line: ContactLine, core: np.ndarray, material, along: float) -> np.ndarray:
    """What the half spaces of both flanks yield at the surface, where a strip of pressure counts as its core.

    The load of a point itself is that of the line as a whole, of which the others are taken away.
    """
    y, weight = line.height / along, line.weight / along
    apart = np.abs(np.subtract.outer(y, y)) + np.eye(len(y))
    others = weight / apart * (1 - np.eye(len(y)))
    own_part = np.arcsinh((line.ends[1] / along - y) / core) + np.arcsinh((y - line.ends[0] / along) / core)
    kernel = others + np.diag(own_part - others.sum(axis=1))
    factor = 2 * (1 - material.poisson_ratio**2) / (np.pi * material.youngs_modulus)
    yields = factor / along * line.loads.T @ kernel @ line.basis
    return 0.5 * (yields + yields.T)


def spur_stiffness(sectors, material, line: ContactLine, rolls, pitch: float, hertz) -> list[float]:
    """c' of spur teeth [N/m^2] where all pairs carry one load, and where they share one approach."""
    flanks = []
    for sector in sectors:
        gear = sector.gear
        stations, depths, loads, seen = observed_flanks(sector.grid, gear)
        whole = condense_sector(
            sector.grid, stiffness(sector.grid, material), count=gear.teeth, rim="rim", loads=loads, observations=seen
        )
        arc = stations.roll**2 / (2 * gear.base_radius)
        elastic = np.subtract.outer(arc, arc), material.shear_modulus, material.poisson_ratio
        once, twice = (depth_displacement(elastic[0], f * depths, *elastic[1:]) for f in (1, 2))
        compliance = regular_compliance(tooth_compliance(whole.supported()), 2 * once - twice)
        flanks.append((stations.roll, compliance[:, : len(arc), : len(arc)]))

    def between(seen, loaded, teeth):
        total = 0.0
        for (stations, regular), roll, way in zip(flanks, rolls, (-1, 1), strict=True):
            (i, a), (j, b) = (station_weights(roll(points), stations) for points in (seen, loaded))
            total = total + np.einsum("na,nab,nb->n", a, regular[way * teeth][i[:, :, None], j[:, None]], b)
        return total

    start, end = line.path_ends
    sums, alone = hertz.copy(), []
    for k in (-2, -1, 0, 1, 2):
        there = (line.path + k * pitch > start) & (line.path + k * pitch < end)
        sums[there] += between(line.path[there], line.path[there] + k * pitch, k)
    # the number of pairs changes once in a pitch
    change = end - pitch * math.floor((end - start) / pitch)
    x, w = np.polynomial.legendre.leggauss(8)
    parts = [(low, high - low) for low, high in ((start, change), (change, start + pitch))]
    places = [
        (low + 0.5 * size * (1 + node), 0.5 * size * part / pitch)
        for low, size in parts
        for node, part in zip(x, w, strict=True)
    ]
    for first, part in places:
        at = np.arange(first, end, pitch)
        i, j = (index.ravel() for index in np.indices((len(at),) * 2))
        H = [between(at[[m]], at[[n]], n - m)[0] for m, n in zip(i, j, strict=True)]
        H = np.reshape(H, (len(at),) * 2) + np.diag(np.interp(at, line.path, hertz))
        alone.append(part * np.linalg.solve(H, np.ones(len(at))).sum())
    ratio = (end - start) / pitch
    return [line.weight.sum() / (line.weight @ sums), sum(alone) / ratio]


@cache
def tooth_stiffness(helix: float, mesh: int, flank_elements: int = 8) -> dict[str, list[float]]:
    """c' [N/m^2] of a tooth pair along the transverse line of action, under one load and of one approach.

    Of spur teeth, of straight ones under oblique contact lines, and of helical ones of the train of
    docs/helical.md.
    """
    case = _case(helix)
    gears, material = planetary_set(case), material_of(case, "sun")
    sectors = make_sectors(gears, material, flank_elements=flank_elements, refine=flank_elements / 12)
    two = (sectors.sun, sectors.planet) if mesh == 0 else (sectors.planet, sectors.ring)
    pair, angle = mesh_pairs(gears)[mesh], base_helix_angle(case.sun.pressure_angle, case.helical.helix_angle)
    pitch = two[0].gear.base_radius * two[0].gear.pitch_angle
    line = ContactLine(pair.path, math.tan(angle))
    rolls = (lambda at: pair.pitch_roll_1 + at, lambda at: pair.pitch_roll_2 - pair.sign * at)
    roll_of_first, two_rolls = (roll(line.path) for roll in rolls)
    radius = roll_of_first * two_rolls / (two_rolls + pair.sign * roll_of_first)
    load = _line_load(case, gears) * pitch / (pair.path[1] - pair.path[0])
    modulus = material.youngs_modulus / (2 * (1 - material.poisson_ratio**2))
    core = np.array([0.5 * hertz_half_width(load, curvature, modulus) for curvature in radius])
    hertz = -4 * (1 - material.poisson_ratio**2) / (np.pi * material.youngs_modulus) * np.log(core)
    stiffness = {"spur": spur_stiffness(two, material, line, rolls, pitch, hertz)}
    for name, along in (("straight", 1.0), ("helical", math.cos(angle))):
        H = surface(line, core / math.sqrt(along), material, along) + sum(
            endless_flank(sector, material, line, roll(line.path), angle, twisted=name == "helical")
            for sector, roll in zip(two, rolls, strict=True)
        )
        whole, length = line.loads.sum(axis=0), line.weight.sum()
        stiffness[name] = [length / H.sum(), float(whole @ np.linalg.solve(H, whole)) / length]
    return stiffness


def _case(helix: float):
    changes = {"helical.helix_angle": f"{helix} deg", "rack.root_radius": 0.15}
    return with_values(read_case(ROOT / "cases" / "helical_30_20_70.toml"), changes)


def factors() -> tuple[Row, ...]:
    """Factors on straight teeth: of solids, by the formula, and those of femgear's virtual gears."""
    rows = []
    for helix in (10.0, 20.0, 30.0):
        case = _case(helix)
        angle = base_helix_angle(case.sun.pressure_angle, case.helical.helix_angle)
        virtual = section_stiffness(case, planetary_set(case)).factor
        for mesh, (kind, power) in enumerate((("sun-planet", 2.2), ("planet-ring", 2.3))):
            stiffness = tooth_stiffness(helix, mesh)
            loaded, shared = np.array(stiffness["helical"]) / stiffness["straight"]
            source, name = "helical teeth in three dimensions", f"{helix:g} degrees, {kind}: "
            formula = name + f"cos(beta_b)^{power} on straight teeth under oblique lines"
            rows += [
                within("helix", source, formula, shared, math.cos(angle) ** power, 0.01),
                within("helix", source, name + "the same under one load", shared, loaded, 0.01),
                within(
                    "helix",
                    source,
                    name + "helical stiffness of femgear",
                    shared,
                    helical_stiffness(angle, internal=mesh == 1),
                    0.01,
                ),
                within(
                    "helix",
                    source,
                    name + "factor of virtual gears on slices of the transverse section",
                    stiffness["helical"][1] / stiffness["spur"][1],
                    virtual[mesh],
                    0.05,
                    explanation=EXPLAINED,
                ),
            ]
    return tuple(rows)


def helical_root_stress(sector, material, station: int, angle: float) -> float:
    """Largest stress across the root line of an endless tooth under a unit force per width at a station.

    The field is the same at all heights. Its strains in the surface are those along the section t and along
    the helix h, where ``d/dh`` of the displacement is the turn of the section; across h the surface is free.
    """
    gear, grid, slope = sector.gear, sector.grid, math.tan(angle)
    twist, stations = slope / gear.base_radius, flank_stations(grid, gear)
    loads = flank_columns(flank_load_columns(grid, stations), stations.normals, slope)[:, [station]]
    names = [name for name in ("fillet_left", "root_left") if name in grid.boundaries]
    edges = np.vstack([boundary_edges(grid, curve) for curve in names[:: -1 if gear.internal else 1]])
    nodes = np.append(edges[:, [0, 2]].ravel(), edges[-1, 1])
    seen = np.zeros((3 * grid.n_nodes, 3 * len(nodes)))
    seen[(3 * nodes[:, None] + np.arange(3)).ravel(), np.arange(3 * len(nodes))] = 1.0
    waves = [(0.0, 2 * np.pi * n / gear.teeth) for n in range(gear.teeth // 2 + 1)]
    share = np.array([1 if n == 0 or 2 * n == gear.teeth else 2 for n in range(len(waves))]) / gear.teeth
    compliances = list(wave_compliances(grid, material, twist, loads, seen, waves))
    v, x = np.tensordot(share, compliances, 1)[:, 0].real.reshape(-1, 3), np.asarray(grid.points)[nodes]
    arc = np.append(0.0, np.cumsum(np.hypot(*np.diff(x, axis=0).T)))
    along = CubicSpline(arc, np.insert(x, 2, 0.0, axis=1))(arc, 1)
    size = np.linalg.norm(along, axis=1)[:, None]
    axis, length = np.array([0.0, 0.0, 1.0]), np.sqrt(1 + twist**2 * (x**2).sum(axis=1))[:, None]
    t, h = along / size, (axis + twist * np.cross(axis, np.insert(x, 2, 0.0, axis=1))) / length
    by_t, by_h = CubicSpline(arc, v)(arc, 1) / size, twist * np.cross(axis, v) / length
    tt, hh, th, c = ((a * b).sum(axis=1) for a, b in ((t, by_t), (h, by_h), (h, by_t), (t, h)))
    th = 0.5 * (th + (t * by_h).sum(axis=1))
    across = (tt - 2 * c * th + c**2 * hh) / (1 - c**2)
    modulus = material.youngs_modulus / (1 - material.poisson_ratio**2)
    return float((modulus * (across + material.poisson_ratio * hh))[2:-2].max())


def root_stresses() -> tuple[Row, ...]:
    """Largest root stress under a uniform load high and amid the flank, of solids and of femgear."""
    rows, source = [], "helical teeth in three dimensions"
    for helix in (20.0, 30.0):
        case = _case(helix)
        gears, material = planetary_set(case), material_of(case, "sun")
        angle = base_helix_angle(case.sun.pressure_angle, case.helical.helix_angle)
        for sector in make_sectors(gears, material, flank_elements=8).gears:
            gear = sector.gear
            plane = root_stress_influence(sector.grid, gear, material)
            m, last = len(plane.arc), len(plane.roll) - 1
            for text, place, why in (("high on", 0.9, ""), ("amid", 0.5, LOW_LOADS)):
                station = round((1 - place if gear.internal else place) * last)
                straight = gear.face_width * plane.influence[0, 1:m, station].max()
                solid = helical_root_stress(sector, material, station, angle)
                ours = straight / helical_stiffness(angle, internal=gear.internal)
                name = f"{helix:g} degrees, {gear.name}, uniform load {text} the flank: largest root stress"
                row = within("helix", source, f"{name} per load [1/m]", solid, ours, 0.05, explanation=why)
                rows.append(row)
    return tuple(rows)


def refined() -> tuple[Row, ...]:
    """The factor at 20 degrees with twice the elements."""
    ratios = [
        np.divide(stiffness["helical"], stiffness[other])[1]
        for stiffness in (tooth_stiffness(20.0, 0, 16), tooth_stiffness(20.0, 0))
        for other in ("straight", "spur")
    ]
    name, source = "20 degrees, sun-planet: helical over ", "twice the elements"
    return (
        within("helix", source, name + "straight teeth under oblique lines", ratios[0], ratios[2], 0.005),
        within("helix", source, name + "slices of the transverse section", ratios[1], ratios[3], 0.02),
    )
