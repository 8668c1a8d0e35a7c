"""Shafts as solids by CalculiX: hexahedra of 20 nodes, on bearings that hold the means of their sections.

A bearing of a beam holds the motion of a whole section. Here that is the mean over the section: displacements, and
rotations as means weighted by the lever, which is what Cowper's shear coefficient stands for. Loads are spread alike.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from femgear.fe.beam import AXES, ShaftPart, beam_shaft
from femgear.system.assembly import Assembly, Beam, Inertia, StationSprings, joint
from validation import calculix
from validation.calculix import MILLIMETRE
from validation.calculix_rows import SOURCE, where_installed
from validation.rows import Row, information, within
from validation.timoshenko import natural_frequencies

SECTORS = 16
LAYER, LENGTH = 0.012, 0.016
"""Thickest layer and longest element [m]."""
FINE, SHARP = 0.004, 0.0015
"""Elements beside a step [m], and where the step alone is looked at."""
SAME = 1e-9
MODES = 14
LOAD, TORQUE, PULL = 1000.0, 100.0, 1e4
"""On a shaft across [N], about [N m] and along its axis [N]."""
HELD = dict(zip(AXES, (1e9, 1e9, 1e9, 1e7, 1e7, 1e7), strict=True))
"""Springs at the end of a shaft on which one step is looked at."""
STEP_AXES = ("tilt y", "rotation", "z")
# Corners of a hexahedron in shares of layer, sector and length, in CalculiX's order; middles of their edges.
_HEX = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
_HEX_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_WEDGE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1)]
_WEDGE_EDGES = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]


@dataclass(frozen=True)
class Bearing:
    """Springs against the mean motions of a section.

    Parameters
    ----------
    place : float
        [m]
    stiffness : mapping of str to float
        By motions of `AXES` [N/m, N m/rad].
    """

    place: float
    stiffness: Mapping[str, float]


@dataclass(frozen=True)
class Shaft:
    """A shaft as beam and as solid, its bearings, and where it is looked at.

    Parameters
    ----------
    parts : tuple of ShaftPart
    bearings : tuple of Bearing
    places : tuple of float
        Sections whose motions are compared, the load at the first one [m].
    fine : float
        Elements of the solid beside steps [m].
    """

    parts: tuple[ShaftPart, ...]
    bearings: tuple[Bearing, ...]
    places: tuple[float, ...]
    fine: float = FINE

    @property
    def stations(self) -> list[float]:
        """All sections that are held, loaded or looked at [m]."""
        return sorted({*self.places, *(bearing.place for bearing in self.bearings)})


@dataclass(frozen=True)
class RoundSolid:
    """Elements of 20 and 15 nodes, and what makes the mean motions of sections.

    Parameters
    ----------
    points : (n, 3) array
        [m]
    hexahedra, wedges : (h, 20), (w, 15) int arrays
    means : mapping of float to mapping of str to (n, 3) arrays
        By place [m] and motion of `AXES`: weights of the nodes' displacements [1, 1/m].
    """

    points: np.ndarray
    hexahedra: np.ndarray
    wedges: np.ndarray
    means: Mapping[float, Mapping[str, np.ndarray]]


def layers(parts: Sequence[ShaftPart], thickest: float, fine: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Radii [m] of the layers of every part at its left and its right end, alike where parts touch, thin at corners."""
    planes: list[set[float]] = [set() for _ in range(len(parts) + 1)]
    ends = [[(0.5 * inner, 0.5 * outer) for outer, inner in part.diameters] for part in parts]

    def reach(k: int, i: int) -> np.ndarray:
        low, high = ends[k][i]
        return np.array(sorted(r for r in planes[k + i] if low - SAME < r < high + SAME))

    def spread() -> None:
        for _ in range(2 * len(parts)):
            for k, (left, right) in enumerate(ends):
                for i, here, there in ((0, left, right), (1, right, left)):
                    shares = (reach(k, i) - here[0]) / (here[1] - here[0])
                    for radius in there[0] + shares * (there[1] - there[0]):
                        if all(abs(radius - r) > 1e-7 for r in planes[k + 1 - i]):
                            planes[k + 1 - i].add(float(radius))

    for k, both in enumerate(ends):
        for i in (0, 1):
            planes[k + i] |= set(both[i])
    spread()
    corners = {max(a[0], b[0]) for (_, a), (b, _) in pairwise(ends) if a[0] != b[0]}
    corners |= {min(a[1], b[1]) for (_, a), (b, _) in pairwise(ends) if a[1] != b[1]}
    for plane in planes:
        for a, b in pairwise(sorted(plane)):
            short = [fine if any(abs(r - corner) < SAME for corner in corners) else None for r in (a, b)]
            plane |= set(_graded(a, b, thickest, short[0], short[1])[:-1])
        spread()
    return [(reach(k, 0), reach(k, 1)) for k in range(len(parts))]


def cuts(parts: Sequence[ShaftPart], places: Sequence[float], longest: float, fine: float) -> list[np.ndarray]:
    """Ends of the elements of every part along the shaft [m]: short beside steps, with a cut at every place."""
    result, start = [], 0.0
    for k, part in enumerate(parts):
        end = start + part.length
        stops = [start, *(p for p in sorted(places) if start + SAME < p < end - SAME), end]
        steps = (
            k > 0 and parts[k - 1].diameters[1] != part.diameters[0],
            k + 1 < len(parts) and parts[k + 1].diameters[0] != part.diameters[1],
        )
        line = [start]
        for a, b in pairwise(stops):
            line += _graded(
                a, b, longest, fine if a == start and steps[0] else None, fine if b == end and steps[1] else None
            )
        result.append(np.array(line))
        start = end
    return result


def _graded(a: float, b: float, longest: float, left: float | None, right: float | None) -> list[float]:
    """Ends of elements after a, up to b, that grow by 1.6 from short ones at either end."""
    heads: list[list[float]] = []
    for size in (left, right):
        widths = []
        while size is not None and size < longest and sum(widths) + size < 0.4 * (b - a):
            widths.append(size)
            size *= 1.6
        heads.append(widths)
    rest = b - a - sum(heads[0]) - sum(heads[1])
    count = max(1, math.ceil(rest / longest))
    ends = a + np.cumsum([*heads[0], *[rest / count] * count, *heads[1][::-1]])
    ends[-1] = b
    return ends.tolist()


def round_solid(shaft: Shaft) -> RoundSolid:
    """Mesh a shaft by rings of elements, around the axis wedges."""
    points: dict[tuple[int, int, int], int] = {}
    places: list[np.ndarray] = []
    elements: dict[int, list[list[int]]] = {20: [], 15: []}

    def node(radius: float, angle: float, z: float) -> int:
        place = np.array([radius * math.cos(angle), radius * math.sin(angle), z])
        key = tuple(np.rint(place / 1e-7).astype(int).tolist())
        if key not in points:
            points[key] = len(places)
            places.append(place)
        return points[key]

    divided = cuts(shaft.parts, shaft.stations, LENGTH, shaft.fine)
    radii = layers(shaft.parts, LAYER, shaft.fine)
    for line, (left, right) in zip(divided, radii, strict=True):
        tracks = [left + (right - left) * (z - line[0]) / (line[-1] - line[0]) for z in line]
        for (a, inner), (b, outer) in pairwise(zip(line, tracks, strict=True)):
            for layer in range(len(left) - 1):
                axis = inner[layer] < SAME and outer[layer] < SAME
                corners, edges = (_WEDGE, _WEDGE_EDGES) if axis else (_HEX, _HEX_EDGES)
                shares = np.array(corners, float)
                shares = np.vstack([shares, [0.5 * (shares[i] + shares[j]) for i, j in edges]])
                if axis:
                    # a corner on the axis has any angle: the sides that end there are radii
                    shares[[8, 11], 1] = 1.0
                for sector in range(SECTORS):
                    row = []
                    for u, v, w in shares:
                        near = inner[layer] + u * (inner[layer + 1] - inner[layer])
                        far = outer[layer] + u * (outer[layer + 1] - outer[layer])
                        angle = 2.0 * math.pi * (sector + v) / SECTORS
                        row.append(node(near + w * (far - near), angle, a + w * (b - a)))
                    elements[len(row)].append(row)
    coordinates = np.array(places)
    hexahedra = np.array(elements[20], int).reshape(-1, 20)
    wedges = np.array(elements[15], int).reshape(-1, 15)
    means = {place: section_means(coordinates, hexahedra, wedges, place) for place in shaft.stations}
    return RoundSolid(coordinates, hexahedra, wedges, means)


def _shapes(corners: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shape functions (q, n) of a face of 8 or 6 nodes at Gauss's points, derivatives (q, n, 2), weights (q,)."""
    if corners == 4:
        x, w = np.polynomial.legendre.leggauss(4)
        s, t, weights = np.repeat(x, 4), np.tile(x, 4), np.outer(w, w).ravel()
    else:
        # the square folded onto the triangle
        x, w = np.polynomial.legendre.leggauss(4)
        u, v = 0.5 * (1 + np.repeat(x, 4)), 0.5 * (1 + np.tile(x, 4))
        s, t, weights = u, v * (1 - u), np.outer(w, w).ravel() / 4 * (1 - u)

    def values(s, t):
        if corners == 3:
            r = 1 - s - t
            return np.array([r * (2 * r - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * r * s, 4 * s * t, 4 * t * r])
        ends = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        corner = [0.25 * (1 + a * s) * (1 + b * t) * (a * s + b * t - 1) for a, b in ends]
        middle = [(0, -1), (1, 0), (0, 1), (-1, 0)]
        return np.array(
            corner + [0.5 * (1 - s**2) * (1 + b * t) if a == 0 else 0.5 * (1 + a * s) * (1 - t**2) for a, b in middle]
        )

    h = 1e-6
    by_s = (values(s + h, t) - values(s - h, t)) / (2 * h)
    by_t = (values(s, t + h) - values(s, t - h)) / (2 * h)
    return values(s, t).T, np.stack([by_s.T, by_t.T], axis=2), weights


def section_means(points, hexahedra, wedges, place: float) -> dict[str, np.ndarray]:
    """Weights (n, 3) of the nodes in the mean motions of a section, by the names of `AXES`."""
    size = len(points)
    area, first, second = np.zeros(size), np.zeros((size, 2)), 0.0
    for elements, sides, corners in (
        (hexahedra, ([0, 1, 2, 3, 8, 9, 10, 11], [4, 5, 6, 7, 12, 13, 14, 15]), 4),
        (wedges, ([0, 1, 2, 6, 7, 8], [3, 4, 5, 9, 10, 11]), 3),
    ):
        if not len(elements):
            continue
        # of the elements to the left, at the left end of the shaft to the right
        side = sides[1] if place > points[:, 2].min() + SAME else sides[0]
        faces = elements[(np.abs(points[elements[:, side], 2] - place) < 1e-8).all(axis=1)][:, side]
        shape, slope, weights = _shapes(corners)
        for face in faces:
            plane = points[face, :2]
            jacobian = np.einsum("qnk,nd->qkd", slope, plane)
            at, here = shape @ plane, weights * np.abs(np.linalg.det(jacobian))
            np.add.at(area, face, here @ shape)
            np.add.at(first, face, (shape.T * here) @ at)
            second += 0.5 * here @ (at**2).sum(axis=1)
    total, zero = area.sum(), np.zeros(size)
    mean, lever = area / total, first / second
    return {
        "x": np.column_stack([mean, zero, zero]),
        "y": np.column_stack([zero, mean, zero]),
        "z": np.column_stack([zero, zero, mean]),
        "tilt x": np.column_stack([zero, zero, lever[:, 1]]),
        "tilt y": np.column_stack([zero, zero, -lever[:, 0]]),
        "rotation": np.column_stack([-lever[:, 1], lever[:, 0], zero]) / 2.0,
    }


def solid_input(shaft: Shaft, solid: RoundSolid) -> list[str]:
    """Write nodes, elements, material and bearings, lengths in mm."""
    part, count = shaft.parts[0], len(solid.points)
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i + 1}," + ",".join(f"{x:.14g}" for x in MILLIMETRE * point) for i, point in enumerate(solid.points)]
    number = 0
    for kind, elements in (("C3D20", solid.hexahedra), ("C3D15", solid.wedges)):
        lines += [f"*ELEMENT, TYPE={kind}, ELSET=SOLID"] if len(elements) else []
        for nodes in elements:
            number += 1
            row = [number, *(nodes + 1)]
            lines += [",".join(map(str, row[:12])) + ",", ",".join(map(str, row[12:]))]
    lines += [
        f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{1e-6 * part.young:.12g},{part.poisson:.12g}",
        f"*DENSITY\n{1e-12 * part.density:.9g}",
        "*SOLID SECTION, ELSET=SOLID, MATERIAL=STEEL",
    ]
    fixed = []
    for bearing in shaft.bearings:
        for motion, stiffness in bearing.stiffness.items():
            count, number = count + 1, number + 1
            weights = solid.means[bearing.place][motion]
            # displacements in mm, rotations in rad
            turning = AXES.index(motion) > 2
            at = [(i, way) for i, way in np.argwhere(np.abs(weights) > 1e-12 * np.abs(weights).max())]
            terms = [f"{i + 1},{way + 1},{-weights[i, way] / (MILLIMETRE if turning else 1.0):.14g}" for i, way in at]
            lines += [f"*NODE\n{count},0.,0.,0.", f"*EQUATION\n{len(terms) + 1}", f"{count},1,1.", *terms]
            fixed.append(f"{count},2,3")
            value = stiffness * (MILLIMETRE if turning else 1.0 / MILLIMETRE)
            lines += [
                f"*ELEMENT, TYPE=SPRING1, ELSET=S{number}\n{number},{count}",
                f"*SPRING, ELSET=S{number}\n1\n{value:.12e}",
            ]
    used = np.unique(np.concatenate([np.flatnonzero(np.abs(m["z"]).any(axis=1)) for m in solid.means.values()]))
    return [*lines, *(["*BOUNDARY", *fixed] if fixed else []), "*NSET, NSET=SHOWN", *(str(i + 1) for i in used)]


def mean_motions(solid: RoundSolid, rows: np.ndarray) -> dict[float, np.ndarray]:
    """Mean motions (6,) of all sections [m, rad] from a table of node and displacements [mm]."""
    moved = np.zeros_like(solid.points)
    moved[rows[:, 0].astype(int) - 1] = rows[:, 1:] / MILLIMETRE
    return {place: np.array([(m[axis] * moved).sum() for axis in AXES]) for place, m in solid.means.items()}


def solid_statics(shaft: Shaft, loads: Sequence[Mapping[tuple[float, str], float]]) -> list[dict]:
    """Mean motions of all sections under several loads, each of forces [N] and moments [N m] by place and motion."""
    solid = round_solid(shaft)
    lines = solid_input(shaft, solid)
    for load in loads:
        force = np.zeros_like(solid.points)
        for (place, motion), value in load.items():
            force += value * solid.means[place][motion]
        lines.append("*STEP\n*STATIC\n*CLOAD, OP=NEW")
        lines += [f"{i + 1},{way + 1},{force[i, way]:.14g}" for i, way in np.argwhere(force)]
        lines.append("*NODE PRINT, NSET=SHOWN\nU\n*END STEP")
    text = calculix.run("\n".join(lines) + "\n").tables
    return [mean_motions(solid, rows) for rows in calculix.tables(text, "displacements")]


def solid_frequencies(shaft: Shaft) -> dict[str, list[float]]:
    """Natural frequencies [Hz] of the solid by their kind: bending once of every two, torsion, stretch."""
    solid = round_solid(shaft)
    lines = solid_input(shaft, solid)
    lines.append(f"*STEP\n*FREQUENCY\n{MODES}\n*NODE PRINT, NSET=SHOWN\nU\n*END STEP")
    text = calculix.run("\n".join(lines) + "\n").tables
    hertz = calculix.frequencies(text)
    shapes = [mean_motions(solid, rows) for rows in calculix.tables(text, "displacements")]
    radius = 0.5 * max(part.outer_diameter for part in shaft.parts)
    kinds: dict[str, list[float]] = {"bending": [], "torsion": [], "stretch": []}
    for value, shape in zip(hertz, shapes, strict=True):
        size = np.square(list(shape.values())).sum(axis=0)
        sizes = {"bending": size[0] + size[1], "torsion": radius**2 * size[5], "stretch": size[2]}
        kinds[max(sizes, key=lambda kind: sizes[kind])].append(float(value))
    kinds["bending"] = kinds["bending"][::2]
    return kinds


def assembled(shaft: Shaft, steps: Mapping[int, Sequence[float]] | None = None) -> tuple[Assembly, dict[float, int]]:
    """Assemble a shaft as beams in bearings, and number the stations of its sections.

    ``steps`` are the flexibilities of steps by the number of the part to their right: lengths of the thinner
    neighbour that bend, twist and stretch as much [m]; a joint of springs stands there.
    """
    edges = np.concatenate([[0.0], np.cumsum([part.length for part in shaft.parts])])
    steps, first = steps or {}, [0, *sorted(steps or {}), len(shaft.parts)]
    names: list[str] = []
    beams, inertias, springs, places = [], [], [], {}
    for a, b in pairwise(first):
        inside = [p - edges[a] for p in shaft.stations if edges[a] - SAME <= p <= edges[b] + SAME]
        beam = beam_shaft(shaft.parts[a:b], inside, longest_element=0.01)
        stations = tuple(range(len(names), len(names) + len(beam.stations)))
        names += [f"station {i + 1}" for i in stations]
        beams.append(Beam(stations, beam.stiffness))
        inertias.append(Inertia(stations, beam.mass, beam.gyroscopic))
        places |= {
            p: stations[beam.index_of(p - edges[a])]
            for p in shaft.stations
            if any(abs(p - edges[a] - i) < SAME for i in inside)
        }
        if a:
            stiffness = _step_springs(min(shaft.parts[a - 1 : a + 1], key=lambda part: part.outer_diameter), steps[a])
            springs.append(joint(f"step {a}", (stations[0] - 1, stations[0]), (np.zeros(3), np.zeros(3)), stiffness))
    for bearing in shaft.bearings:
        rows = np.eye(6)[[AXES.index(motion) for motion in bearing.stiffness]]
        values = np.array(list(bearing.stiffness.values()))
        springs.append(StationSprings(f"bearing at {bearing.place:g} m", (places[bearing.place],), rows, values))
    held = np.zeros(6 * len(names), bool)
    return Assembly(
        tuple(names), np.zeros((len(names), 3)), held, tuple(inertias), tuple(beams), tuple(springs)
    ), places


def _step_springs(thin: ShaftPart, lengths: Sequence[float]) -> np.ndarray:
    """Stiffnesses (6,) of a joint that gives way as lengths (3,) of a part do in bending, torsion and tension."""
    bend, twist, stretch = (value / length for value, length in zip(_section_stiffness(thin), lengths, strict=True))
    return np.array([math.inf, math.inf, stretch, bend, bend, twist])


def _section_stiffness(part: ShaftPart) -> tuple[float, float, float]:
    """``E I``, ``G J`` [N m^2] and ``E A`` [N] of the left end of a part."""
    section = part.section(0.0)
    return section.bending_stiffness, 2.0 * section.shear_modulus * section.second_moment, section.young * section.area


def beam_statics(assembly: Assembly, places: Mapping[float, int], load: Mapping[tuple[float, str], float]) -> dict:
    """Motions (6,) of all sections [m, rad] as beams."""
    force = np.zeros(assembly.count)
    for (place, motion), value in load.items():
        force[6 * places[place] + AXES.index(motion)] += value
    system = assembly.system(force)
    moved = assembly.motions @ np.linalg.solve(system.K, system.load)
    return {place: moved[6 * station : 6 * station + 6] for place, station in places.items()}


def step_flexibility(thin: ShaftPart, thick: ShaftPart, *, fine: float = SHARP) -> np.ndarray:
    """Lengths (3,) of the thinner part that bend, twist and stretch as much as a step beyond its beams, over d.

    A shaft of 2 d and 1.5 D, held on springs at the end of the thinner part, a moment, a torque and a force at the
    other: what it yields more than the beam of both parts.
    """
    d = thin.outer_diameter
    parts = tuple(
        ShaftPart(factor * part.outer_diameter, part.outer_diameter, part.inner_diameter)
        for part, factor in ((thin, 2.0), (thick, 1.5))
    )
    end = sum(part.length for part in parts)
    shaft = Shaft(parts, (Bearing(0.0, HELD),), (end,), fine)
    loads = [{(end, axis): 1.0} for axis in STEP_AXES]
    beam = assembled(shaft)
    more = [
        (solid[end] - beam_statics(*beam, load)[end])[AXES.index(axis)]
        for solid, load, axis in zip(solid_statics(shaft, loads), loads, STEP_AXES, strict=True)
    ]
    return np.array(more) * _section_stiffness(thin) / d


def on_two(parts: Sequence[ShaftPart], first: float, second: float, load: float) -> Shaft:
    """Put a shaft on two bearings, the first one also along and about the axis; look at a load and at both ends."""
    lateral = {"x": 1e8, "y": 1e8}
    bearings = Bearing(first, lateral | {"z": 1e8, "rotation": 1e5}), Bearing(second, lateral)
    return Shaft(tuple(parts), bearings, (load, 0.0, float(np.cumsum([part.length for part in parts])[-1])))


UNIFORM = on_two([ShaftPart(1.0, 0.05)], 0.1, 0.9, 0.4)
SLENDER = on_two([ShaftPart(0.25, 0.06), ShaftPart(0.2, 0.066), ShaftPart(0.25, 0.06, 0.02)], 0.06, 0.6, 0.35)
CONICAL = on_two(
    [ShaftPart(0.25, 0.08, 0.04), ShaftPart(0.3, 0.08, 0.04, 0.05, 0.025), ShaftPart(0.25, 0.05, 0.025)], 0.06, 0.7, 0.4
)
ALL = on_two(
    [
        ShaftPart(0.2, 0.06),
        ShaftPart(0.2, 0.066, 0.02),
        ShaftPart(0.25, 0.066, 0.02, 0.05, 0.02),
        ShaftPart(0.2, 0.05, 0.02),
    ],
    0.06,
    0.75,
    0.3,
)
HIGH = on_two([ShaftPart(0.2, 0.06), ShaftPart(0.15, 0.08), ShaftPart(0.25, 0.05, 0.02)], 0.06, 0.5, 0.275)
SHAFTS = (
    ("uniform shaft of 50 mm by 1 m", UNIFORM, 1e-3, 2e-3),
    ("hollow shaft of 80/40, a cone, 50/25 mm", CONICAL, 5e-3, 5e-3),
    ("shaft of 60, 66 and 60/20 mm", SLENDER, 1e-2, 1e-2),
    ("shaft of 60, 66/20, a cone, 50/20 mm", ALL, 1e-2, 1e-2),
)
STEPS = (
    (ShaftPart(1.0, 0.06), ShaftPart(1.0, 0.066)),
    (ShaftPart(1.0, 0.06), ShaftPart(1.0, 0.08)),
    (ShaftPart(1.0, 0.05, 0.02), ShaftPart(1.0, 0.08)),
    (ShaftPart(1.0, 0.05), ShaftPart(1.0, 0.10)),
)
NO_BEAM = "corners of shoulders carry nothing, and the solid yields there, which no beam knows: see the rows of steps"
STATICS = (
    ("deflection under the load [m]", 0, "x"),
    ("slope at the left end [rad]", 1, "tilt y"),
    ("slope at the right end [rad]", 2, "tilt y"),
    ("twist of the right end [rad]", 2, "rotation"),
    ("shift of the right end [m]", 2, "z"),
)


@cache
def _flexibility(number: int) -> np.ndarray:
    """Flexibility (3,) of a step of `STEPS` over the thinner diameter."""
    return step_flexibility(*STEPS[number])


def _beside_solid(
    name: str, shaft: Shaft, gates: tuple[float, float], steps=(None,), explanation: str = ""
) -> list[Row]:
    """Statics and frequencies of a shaft as beams beside a solid; with ``steps`` once more with these joints."""
    across = {(shaft.places[0], "x"): LOAD}
    along = {(shaft.places[2], "rotation"): TORQUE, (shaft.places[2], "z"): PULL}
    solid = solid_statics(shaft, (across, along))
    hertz = solid_frequencies(shaft)
    rows = []
    for joints in steps:
        assembly, places = assembled(shaft, joints)
        moved = [beam_statics(assembly, places, load) for load in (across, along)]
        words, why = (", with joints at its steps" if joints else ""), "" if joints else explanation
        for text, at, axis in STATICS:
            load, number = int(axis in ("rotation", "z")), AXES.index(axis)
            ours, theirs = (motions[load][shaft.places[at]][number] for motions in (moved, solid))
            rows.append(within("statics", SOURCE, f"{name}{words}: {text}", theirs, ours, gates[0], explanation=why))
        for kind, axes, count in (
            ("bending", ("x", "tilt y"), 3),
            ("torsion", ("rotation",), 2),
            ("stretch", ("z",), 1),
        ):
            ours = natural_frequencies(assembly.system(), axes=axes)
            for i in range(count):
                text = f"{name}{words}: {kind} {i + 1} [Hz]"
                rows.append(within("solid", SOURCE, text, hertz[kind][i], ours[i], gates[1], explanation=why))
    return rows


@where_installed
def shafts_beside_solids() -> tuple[Row, ...]:
    """Uniform, conical and stepped shafts in two bearings: deflection, slopes, first frequencies."""
    rows = []
    for name, shaft, *gates in SHAFTS:
        rows += _beside_solid(name, shaft, (gates[0], gates[1]))
    # of the same elements as the shaft
    joints = {1: 0.06 * step_flexibility(*STEPS[1], fine=FINE), 2: 0.05 * step_flexibility(*STEPS[2], fine=FINE)}
    rows += _beside_solid("shaft of 60, 80 and 50/20 mm", HIGH, (1e-2, 5e-3), (None, joints), NO_BEAM)
    return tuple(rows)


@where_installed
def steps_of_solids() -> tuple[Row, ...]:
    """What a step yields beyond its beams, as a length of the thinner part over its diameter."""
    rows = []
    for number, (thin, thick) in enumerate(STEPS):
        (d, bore), (D, _) = thin.diameters[0], thick.diameters[0]
        text = (
            f"step of {1e3 * d:g}{f'/{1e3 * bore:g}' if bore else ''} to {1e3 * D:g} mm yields like a length of d in "
        )
        note = "no beam has it: it belongs to the table of docs/gearbox.md"
        for words, value in zip(("bending", "torsion", "tension"), _flexibility(number), strict=True):
            rows.append(information("step", SOURCE, f"{text}{words} [d]", None, value, note=note))
    finer = step_flexibility(*STEPS[1], fine=0.5 * SHARP)
    text = "the same of 60 to 80 mm with elements half as long at the step, in bending [d]"
    return (*rows, within("step", SOURCE, text, finer[0], _flexibility(1)[0], 0.02))
