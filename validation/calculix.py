"""CalculiX as a reference: plane bodies written as its input, ``ccx`` run on it, its tables read.

CalculiX (G. Dhondt and K. Wittig, calculix.de; Debian: calculix-ccx) is a finite-element program that shares
nothing with femgear. Lengths are in mm, forces in N, masses in t, so that stresses are in MPa.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial import KDTree

from femgear.fe.cracks import split_grid
from femgear.fe.elasticity import Material
from femgear.fe.grid import Grid
from femgear.fe.meshing import mesh_outline, mesh_outlines
from femgear.gears.cracked_tooth import BESIDE, SECTION, cracked_outline
from femgear.gears.gear import Gear, flank_points
from femgear.gears.tooth import HalfSector, half_sector

PROGRAM = shutil.which("ccx")
TIME_LIMIT = 3600.0
"""Seconds after which CalculiX is stopped."""
MILLIMETRE = 1e3
LAST = 1000
"""Increments from one table to the next: only that of the end of a step, where it was cut into several."""


def installed() -> bool:
    """Tell whether CalculiX can be run."""
    return PROGRAM is not None


@dataclass(frozen=True)
class Output:
    """Tables (``.dat``) and fields at nodes (``.frd``) of CalculiX, both as text."""

    tables: str
    fields: str


def run(text: str) -> Output:
    """Run an input.

    Raises
    ------
    RuntimeError
        CalculiX is not installed, ended with an error, did not converge, wrote no table or took too long.
    """
    if PROGRAM is None:
        raise RuntimeError("CalculiX (ccx) is not installed")
    with TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "job.inp").write_text(text)
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        try:
            done = subprocess.run(
                [PROGRAM, "-i", "job"],
                cwd=place,
                env=environment,
                capture_output=True,
                text=True,
                timeout=TIME_LIMIT,
            )
        except subprocess.TimeoutExpired as error:
            raise RuntimeError(f"CalculiX: stopped after {TIME_LIMIT:g} s") from error
        table, fields = place / "job.dat", place / "job.frd"
        if done.returncode or not table.is_file() or "Job finished" not in done.stdout:
            raise RuntimeError(f"CalculiX: {done.stdout[-2000:]}{done.stderr[-500:]}")
        return Output(table.read_text(), fields.read_text() if fields.is_file() else "")


def tables(text: str, title: str) -> list[np.ndarray]:
    """Read all tables whose title begins so, one a step, rows of numbers each."""
    tables, rows = [], None
    for line in text.splitlines():
        if re.match(r" *[a-zA-Z]", line):
            rows = None
            if line.strip().startswith(title):
                rows = []
                tables.append(rows)
        elif rows is not None and line.strip():
            # exponents of three digits stand without their letter
            rows.append([float(cell) for cell in re.sub(r"(\d)([+-]\d{3})\b", r"\1E\2", line).split()])
    return [np.array(rows) for rows in tables]


def fields(text: str, name: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Read all fields of a name, such as ``"STRESS"``, one a step: numbers of nodes and components."""
    blocks, nodes, values = [], None, None
    for line in text.splitlines():
        if line.startswith(" -4"):
            nodes = values = None
            if line.split()[1] == name:
                nodes, values = [], []
                blocks.append((nodes, values))
        elif line.startswith(" -1") and nodes is not None:
            nodes.append(int(line[3:13]))
            values.append([float(line[i : i + 12]) for i in range(13, len(line.rstrip()), 12)])
        elif line.startswith(" -3"):
            nodes = None
    return [(np.array(numbers), np.array(rows)) for numbers, rows in blocks]


@dataclass(frozen=True)
class PlaneBody:
    """Six-node triangles of a whole plane body.

    Parameters
    ----------
    points : (n, 2) array
        [m]
    triangles : (e, 6) int array
        Corners, then the middles of the sides 12, 23, 31.
    edges : mapping of str to (k, 3) int array
        Boundary edges by name: ends and middle.
    tooth : (e,) bool array
        Elements of teeth, the others are of the body.
    """

    points: np.ndarray
    triangles: np.ndarray
    edges: Mapping[str, np.ndarray]
    tooth: np.ndarray

    def turned(self, angle: float, centre: Sequence[float] = (0.0, 0.0)) -> PlaneBody:
        """Turn the body about the origin [rad], then move it there [m]."""
        return replace(self, points=_turned(self.points, angle) + np.asarray(centre))


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


SIZES = 1.0, 3.0, 6.0
"""Elements of loaded flanks, of the teeth beside them and of all others, in those that femgear takes."""
CONTACT_REACH = 0.25e-3
"""Length [m] to either side of a contact over which elements have the finest size and may touch.

Flanks that are turned into each other overlap over three times the width of the contact: with more
elements that may touch CalculiX takes more iterations until those that pull are out.
"""
CRACK_ANGLE = np.radians(70.0)
"""Of cracks to the centre line of their tooth."""
GROWTH = 0.3
"""Growth of the elements with the distance from there."""


def whole_gear(
    gear: Gear,
    side: str,
    contacts: Mapping[int, float],
    *,
    size: float,
    sizes: tuple[float, float, float] = SIZES,
    span: int | None = None,
    crack: tuple[int, float] | None = None,
) -> PlaneBody:
    """Mesh all teeth of a gear, one side of loaded ones as finely as femgear does and finer at the contact.

    Parameters
    ----------
    gear : Gear
    side : {"left", "right"}
        Of the loaded teeth that is meshed finely.
    contacts : mapping of int to float
        Roll lengths [m] of the contacts by number of the loaded teeth; edges of these have the number in
        their name: "flank 0", "fillet -1", and of the flank those that may touch, "contact 0". "rim" is that
        of all.
    size : float
        Length of the elements at the contact [m].
    sizes : (float, float, float)
        See `SIZES`.
    span : int, optional
        Teeth to either side of loaded ones; others are left out.
    crack : (int, float), optional
        Number of a loaded tooth that is cracked at the root of its left flank, and the depth of the crack [m].
    """
    far, near = (half_sector(gear, flank_elements=12, refine=1.0 / ratio) for ratio in sizes[:0:-1])
    cuts = {name: far.curve(name) for name in ("cut", "rim")}
    near = _with_curves(near, cuts)
    half = _with_curves(half_sector(gear, refine=1.0 / sizes[0]), cuts | {"symmetry": near.curve("symmetry")})
    loaded = [_with_curves(half, _fine_at(half, gear, roll, size)) for roll in contacts.values()]
    grids, numbers = mesh_outlines([far, near, *loaded]), list(contacts)
    parts = []
    for tooth in range(gear.teeth):
        away = [(tooth - number + gear.teeth // 2) % gear.teeth - gear.teeth // 2 for number in numbers]
        if span is not None and min(map(abs, away)) > span:
            continue
        index = away.index(0) if 0 in away else None
        if crack is not None and index is not None and numbers[index] == crack[0]:
            parts.append(_cracked(gear, loaded[index], *crack, place=flank_points(gear, [contacts[crack[0]]])[0]))
            continue
        for half in ("left", "right"):
            chosen = index is not None and half == side
            level = 2 + index if chosen else int(min(map(abs, away)) <= 1)
            grid = grids[level] if half == "left" else _mirrored(grids[level])
            edges = {}
            if chosen:
                place = flank_points(gear, [contacts[numbers[index]]])[0]
                place *= [1.0, 1.0 if half == "left" else -1.0]
                edges = _loaded_edges(grid, numbers[index], place)
            is_tooth = np.isin(np.arange(len(grid.triangles)), grid.regions["tooth"])
            points = _turned(grid.points, tooth * gear.pitch_angle)
            parts.append(PlaneBody(points, grid.triangles, edges | {"rim": grid.boundaries["rim"]}, is_tooth))
    return _joined(parts)


def _cracked(gear: Gear, half: HalfSector, number: int, depth: float, *, place: np.ndarray) -> PlaneBody:
    """Sector of a loaded tooth with an open crack, its faces a tenth of a micrometre apart so that they stay two."""
    outline = cracked_outline(half, gear, angle=CRACK_ANGLE, depth=depth)
    split = split_grid(mesh_outline(outline), SECTION, len(outline.crack), BESIDE[0])
    grid, points = split.grid, split.grid.points.copy()
    points[split.faces[0]] += 1e-7 * split.normals
    middle = np.hypot(*grid.points[grid.triangles[:, :3]].mean(axis=1).T)
    base = np.hypot(*half.interfaces[0][1][0])
    left = replace(grid, boundaries={name: grid.boundaries[f"{name}_left"] for name in ("flank", "fillet")})
    rim = np.vstack([grid.boundaries["rim_left"], grid.boundaries["rim_right"]])
    edges = _loaded_edges(left, number, place) | {"rim": rim}
    return PlaneBody(_turned(points, number * gear.pitch_angle), grid.triangles, edges, middle > base)


def _loaded_edges(grid: Grid, number: int, place: np.ndarray) -> dict[str, np.ndarray]:
    """Flank and fillet of a loaded tooth, and the part of the flank about a place that may touch."""
    flank = grid.boundaries["flank"]
    near = np.hypot(*(grid.points[flank[:, 2]] - place).T) < CONTACT_REACH
    return {
        f"flank {number}": flank,
        f"fillet {number}": grid.boundaries["fillet"],
        f"contact {number}": flank[near],
    }


def _fine_at(half: HalfSector, gear: Gear, roll: float, size: float) -> dict[str, np.ndarray]:
    """Flank and tip of a half sector with finer elements about a roll length [m] of the flank."""
    tip_roll, rolls = gear.tip_roll, half.flank_roll[:: -1 if gear.internal else 1]
    arc = 0.5 * np.abs(tip_roll**2 - np.array([roll, rolls[-1]]) ** 2) / gear.base_radius
    corner = flank_points(gear, [tip_roll])[0]
    angle = np.arctan2(*corner[::-1])
    lengths = arc[1], gear.tip_radius * angle
    coarse = arc[1] / (len(rolls) // 2)
    flank, tip = (
        _graded(length, place, size, coarse) for length, place in zip(lengths, (arc[0], -arc[0]), strict=True)
    )
    inwards = np.sqrt(tip_roll**2 + np.sign(rolls[-1] - tip_roll) * 2 * gear.base_radius * flank)
    angles = angle - tip / gear.tip_radius
    towards = gear.tip_radius * np.column_stack([np.cos(angles), np.sin(angles)])[::-1]
    flip = -1 if gear.internal else 1
    return {"flank": flank_points(gear, inwards)[::flip], "tip": towards[::flip]}


def _graded(length: float, place: float, size: float, coarse: float) -> np.ndarray:
    """Ends and middles of edges along a length, of a size about a place and growing to a coarse one [m]."""
    s = np.linspace(0.0, length, 20001)
    edge = np.clip(size + GROWTH * (np.abs(s - place) - CONTACT_REACH), size, coarse)
    number = np.append(0.0, np.cumsum(0.5 * (1 / edge[1:] + 1 / edge[:-1]) * np.diff(s)))
    count = 2 * max(1, round(number[-1]))
    return np.interp(np.linspace(0.0, number[-1], count + 1), number, s)


def _with_curves(half: HalfSector, curves: Mapping[str, np.ndarray]) -> HalfSector:
    """Half sector with some of its curves replaced by others between the same points."""
    chain = [(name, np.array(curves.get(name, points))) for name, points in half.curves]
    for (_, before), (_, points) in zip([chain[-1], *chain], chain):
        points[0] = before[-1]
    base = [(name, np.array(points)) for name, points in half.interfaces]
    line = curves.get("symmetry", half.curve("symmetry"))
    for _, points in base:
        points[0] = line[np.abs(line[:, 0] - points[0, 0]).argmin()]
    return replace(half, curves=tuple(chain), interfaces=tuple(base))


def _mirrored(grid: Grid) -> Grid:
    return Grid(
        grid.points * [1.0, -1.0],
        grid.triangles[:, [0, 2, 1, 5, 4, 3]],
        {name: edges[:, [1, 0, 2]] for name, edges in grid.boundaries.items()},
        grid.regions,
    )


def _joined(parts: Sequence[PlaneBody]) -> PlaneBody:
    """Bodies as one, nodes at the same place merged."""
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    points = np.vstack([part.points for part in parts])
    pairs = KDTree(points).query_pairs(1e-7 * np.ptp(points), output_type="ndarray")
    target = np.arange(len(points))
    for a, b in np.sort(pairs, axis=1)[np.argsort(pairs.min(axis=1))]:
        target[b] = min(target[a], target[b])
    kept, number = np.unique(target, return_inverse=True)
    edges: dict[str, list] = {}
    for start, part in zip(first, parts):
        for name, chain in part.edges.items():
            edges.setdefault(name, []).append(chain + start)
    triangles = np.vstack([part.triangles + start for start, part in zip(first, parts)])
    return PlaneBody(
        points[kept],
        number[triangles],
        {name: number[np.vstack(chains)] for name, chains in edges.items()},
        np.concatenate([part.tooth for part in parts]),
    )


def moduli(material: Material, state: str) -> tuple[float, float]:
    """Modulus [MPa] and ratio with which elements in plane strain have a plane state.

    Plane stress of E and nu is plane strain of E (1 + 2 nu)/(1 + nu)^2 and nu/(1 + nu): S. P. Timoshenko
    and J. N. Goodier, Theory of Elasticity, 3rd ed., section 20.
    """
    E, nu = 1e-6 * material.youngs_modulus, material.poisson_ratio
    if state == "plane strain":
        return E, nu
    return E * (1.0 + 2.0 * nu) / (1.0 + nu) ** 2, nu / (1.0 + nu)


def body_input(
    body: PlaneBody,
    name: str,
    material: Material,
    state: Mapping[str, str],
    *,
    node: int = 0,
    element: int = 0,
) -> list[str]:
    """Write nodes, elements of 1 mm thickness and materials of a plane body, numbered after those given.

    ``state`` has "plane strain" or "plane stress" for "tooth" and "body".
    """
    lines = [f"*NODE, NSET=N{name}"]
    lines += [f"{node + i + 1},{x:.14g},{y:.14g},0" for i, (x, y) in enumerate(MILLIMETRE * body.points)]
    for part, chosen in (("tooth", body.tooth), ("body", ~body.tooth)):
        group = f"{part.upper()}{name}"
        lines.append(f"*ELEMENT, TYPE=CPE6, ELSET={group}")
        lines += [
            f"{element + i + 1}," + ",".join(str(node + n + 1) for n in body.triangles[i])
            for i in np.flatnonzero(chosen)
        ]
        E, nu = moduli(material, state[part])
        lines += [
            f"*MATERIAL, NAME=M{group}\n*ELASTIC\n{E:.12g},{nu:.12g}",
            f"*DENSITY\n{1e-12 * material.density:.9g}",
            f"*SOLID SECTION, ELSET={group}, MATERIAL=M{group}\n1.",
        ]
    return lines


def surface_input(body: PlaneBody, name: str, edges: np.ndarray, *, element: int = 0) -> list[str]:
    """Write a surface of element sides."""
    sides = {}
    for i, nodes in enumerate(body.triangles):
        for side, (a, b) in enumerate(((0, 1), (1, 2), (2, 0)), 1):
            sides[frozenset((int(nodes[a]), int(nodes[b])))] = f"{element + i + 1},S{side}"
    return [f"*SURFACE, NAME={name}, TYPE=ELEMENT", *(sides[frozenset(edge[:2])] for edge in edges.tolist())]


END = 50e-6
"""Roll length [m] from an end of a flank within which a contact is at that end."""


@dataclass(frozen=True)
class Mates:
    """Two teeth that may touch.

    Parameters
    ----------
    teeth : (int, int)
        Their numbers on the first and the second gear.
    rolls : (float, float)
        Roll lengths where they are nearest [m].
    ends : (bool, bool)
        Whether either flank ends there.
    """

    teeth: tuple[int, int]
    rolls: tuple[float, float]
    ends: tuple[bool, bool] = (False, False)


def near_teeth(gears: Sequence[Gear], angles: Sequence[float], centre: float, *, within: float) -> list[Mates]:
    """Find the teeth of two gears, turned so [rad], the second about (centre, 0), whose flanks are near.

    ``within`` is a distance [m]; the flanks are left ones, of an internal gear right ones.
    """
    mates, curves, rolls = [], [], []
    for gear in gears:
        rolls.append(np.linspace(gear.form_roll, gear.tip_roll, 4001))
        flank = flank_points(gear, rolls[-1])
        curves.append(flank * [1.0, -1.0] if gear.internal else flank)
    for tooth in (-2, -1, 0, 1, 2):
        numbers = tooth, tooth if gears[1].internal else -tooth
        first, second = (
            _turned(flank, angle + number * gear.pitch_angle) + np.array([place, 0.0])
            for flank, angle, number, gear, place in zip(curves, angles, numbers, gears, (0.0, centre))
        )
        nearest = KDTree(second).query(first)[1]
        tangent = np.gradient(second, axis=0)[nearest]
        tangent /= np.hypot(*tangent.T)[:, None]
        apart, step = first - second[nearest], np.hypot(*np.diff(second, axis=0).T).max()
        along = np.abs((apart * tangent).sum(axis=1))
        gap = np.abs(apart[:, 0] * tangent[:, 1] - apart[:, 1] * tangent[:, 0])
        gap = np.hypot(gap, np.maximum(along - step, 0.0))
        i = int(gap.argmin())
        if gap[i] < within:
            at = float(rolls[0][i]), float(rolls[1][nearest[i]])
            ends = (np.abs(roll - of_gear[[0, -1]]).min() < END for roll, of_gear in zip(at, rolls))
            mates.append(Mates(numbers, at, tuple(ends)))
    return mates


def over_arc(body: PlaneBody, name: str, angle: float = 0.0, width: float = 2.0 * np.pi) -> dict[int, float]:
    """Spread one over an arc of a round boundary about an angle [rad]: shares of its nodes.

    Shares are integrals of the shape functions of the edges over the arc, by Gauss points.
    """
    points, weights = np.polynomial.legendre.leggauss(40)
    shapes = np.array([0.5 * points * (points - 1), 0.5 * points * (points + 1), 1 - points**2])
    shares: dict[int, float] = {}
    for edge in body.edges[name]:
        x, y = body.points[edge].T
        middle = np.arctan2(y[2], x[2])
        ends = np.angle(np.exp(1j * (np.arctan2(y[:2], x[:2]) - middle)))
        place = 0.5 * (ends[1] - ends[0]) * points
        away = np.abs(np.angle(np.exp(1j * (middle + place - angle))))
        inside = (away < 0.5 * width) | (width >= 2.0 * np.pi)
        if inside.any():
            for node, share in zip(edge, shapes @ (weights * inside) * abs(place[-1] / points[-1])):
                shares[int(node)] = shares.get(int(node), 0.0) + float(share)
    total = sum(shares.values())
    return {node: share / total for node, share in shares.items()}


def natural_frequencies(
    body: PlaneBody,
    material: Material,
    state: Mapping[str, str],
    *,
    springs: Mapping[int, float],
    masses: Mapping[int, float],
    count: int,
) -> np.ndarray:
    """Compute the lowest natural frequencies [Hz] of a plane body on springs to the ground.

    Parameters
    ----------
    body : PlaneBody
    material : Material
    state : mapping
        See `body_input`.
    springs : mapping of int to float
        Stiffness of nodes in x and y over the width of the body [N/m^2].
    masses : mapping of int to float
        Masses that move along with nodes, over the width [kg/m].
    count : int
    """
    lines, element = body_input(body, "1", material, state), len(body.triangles)
    for kind, given, factor in (("SPRING", springs, 1e-6), ("MASS", masses, 1e-6)):
        groups: dict[str, list[int]] = {}
        for node, value in given.items():
            groups.setdefault(f"{factor * value:.9e}", []).append(node + 1)
        for group, (value, nodes) in enumerate(groups.items()):
            for way in (1, 2) if kind == "SPRING" else (0,):
                name = f"{kind}{way}G{group}"
                lines.append(f"*ELEMENT, TYPE={'SPRING1' if way else 'MASS'}, ELSET={name}")
                lines += [f"{element + i + 1},{node}" for i, node in enumerate(nodes)]
                lines += [f"*SPRING, ELSET={name}\n{way}" if way else f"*MASS, ELSET={name}", value]
                element += len(nodes)
    lines.append(f"*STEP\n*FREQUENCY\n{count}\n*END STEP")
    return frequencies(run("\n".join(lines) + "\n").tables)


def frequencies(text: str) -> np.ndarray:
    """Read the natural frequencies [Hz]."""
    numbers = re.findall(r"^ +\d+((?: +[-+.E0-9]+){4}) *$", text, flags=re.MULTILINE)
    return np.array([float(row.split()[2]) for row in numbers])


@dataclass(frozen=True)
class PairContact:
    """Contact of two gears under given rotations of the first, every array over these.

    Parameters
    ----------
    approach : (s,) array
        Along the line of action [m].
    torque : (s,) array
        On the first gear [N m].
    pressure : (2, t, s) array
        Largest contact pressure [Pa] of each pair of teeth, from the stress normal to either gear's flank at
        its nodes, which is the mean of the elements beside them.
    root : (2, s) array
        Largest principal stress in the fillets of the loaded side of each gear [Pa].
    """

    approach: np.ndarray
    torque: np.ndarray
    pressure: np.ndarray
    root: np.ndarray

    def at(self, torque: float, values: np.ndarray) -> float:
        """Interpolate one of the arrays (s,) at a torque [N m], which may lie a little outside."""
        return float(np.polyval(np.polyfit(self.torque - torque, values, len(self.torque) - 1), 0.0))


def pair_contact(
    bodies: Sequence[PlaneBody],
    mates: Sequence[Mates],
    approach: Sequence[float],
    *,
    base_radius: float,
    width: float,
    material: Material,
    states: Sequence[Mapping[str, str]],
    penalty: float,
) -> PairContact:
    """Solve the contact of two whole plane gears: rim of the first turned, that of the second held.

    Parameters
    ----------
    bodies : two PlaneBody
        In place, touching; the first about the origin.
    mates : sequence of Mates
        Teeth of the first and the second gear whose edges "contact ..." may touch: CalculiX takes a flank
        for penetrated that lies behind another, however far. Forces are normal to the flank that is master:
        where a flank ends, the other one.
    approach : sequence of float
        Rotations of the first gear as paths along the line of action [m]. CalculiX looks for the parts of
        the flanks that face each other where the step before left the bodies: the mean rotation is solved
        first, for the torque of the first step stands 1e-4 beside those of the others.
    base_radius, width : float
        Base radius of the first gear and face width [m].
    material : Material
    states : two mappings
        See `body_input`.
    penalty : float
        Contact pressure over overclosure [Pa/m].
    """
    lines, node, element, roots, flanks = [], 0, 0, [], []
    for number, (body, state) in enumerate(zip(bodies, states), 1):
        lines += body_input(body, str(number), material, state, node=node, element=element)
        for i, pair in enumerate(mates):
            touching = body.edges[f"contact {pair.teeth[number - 1]}"]
            lines += surface_input(body, f"S{number}T{i}", touching, element=element)
        fillets = np.vstack([edges for name, edges in body.edges.items() if name.startswith("fillet")])
        roots.append(node + 1 + np.unique(fillets))
        chains = [np.unique(body.edges[f"flank {pair.teeth[number - 1]}"]) for pair in mates]
        flanks.append([(node + 1 + chain, body.points[chain]) for chain in chains])
        shown = np.concatenate([roots[-1], *(flank_nodes for flank_nodes, _ in flanks[-1])])
        lines += ["*NSET, NSET=SHOWN", *map(str, shown)]
        rim = node + 1 + np.unique(body.edges["rim"])
        lines += [f"*NSET, NSET=RIM{number}", *map(str, rim)]
        node, element = node + len(body.points), element + len(body.triangles)
    lines += contact_input(
        [f"S2T{i},S1T{i}" if pair.ends[1] else f"S1T{i},S2T{i}" for i, pair in enumerate(mates)],
        penalty,
    )
    lines.append("*BOUNDARY\nRIM2,1,2")
    rim = np.unique(bodies[0].edges["rim"])
    x, y = MILLIMETRE * bodies[0].points[rim].T
    for path in (np.mean(approach), *approach):
        lines += [
            *turned_input(rim + 1, bodies[0].points[rim], path / base_radius),
            f"*NODE PRINT, NSET=RIM1, FREQUENCY={LAST}\nRF",
            f"*EL FILE, OUTPUT=2D, NSET=SHOWN, FREQUENCY={LAST}\nS",
            "*END STEP",
        ]
    output = run("\n".join(lines) + "\n")
    torque = []
    for rows in tables(output.tables, "forces"):
        order = np.searchsorted(rim + 1, rows[:, 0].astype(int))
        torque.append(np.sum(x[order] * rows[:, 2] - y[order] * rows[:, 1]) * width)
    roots_found, pressure = [], []
    for numbers, values in fields(output.fields, "STRESS"):
        stress = np.full((node + 1, 2), np.nan)
        stress[numbers] = 1e6 * _principal(values)
        roots_found.append([stress[nodes_of_root, 1].max() for nodes_of_root in roots])
        pressure.append([[_peak(points, -stress[nodes, 0]) for nodes, points in chains] for chains in flanks])
    return PairContact(
        np.array(approach),
        np.array(torque[1:]),
        np.moveaxis(pressure[1:], 0, -1),
        np.array(roots_found[1:]).T,
    )


def contact_input(pairs: Sequence[str], penalty: float) -> list[str]:
    """Write pairs of surfaces, slave and master, that touch with a pressure over overclosure [Pa/m]."""
    behaviour = "*SURFACE INTERACTION, NAME=SI\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
    kind = "*CONTACT PAIR, INTERACTION=SI, TYPE=SURFACE TO SURFACE"
    return [behaviour, f"{penalty * 1e-9:.6g}", *(f"{kind}\n{pair}" for pair in pairs)]


def turned_input(numbers: np.ndarray, points: np.ndarray, angle: float) -> list[str]:
    """Begin a static step in which nodes at points (n, 2) [m] are turned about the origin [rad]."""
    x, y = MILLIMETRE * points.T
    rows = (f"{n},1,1,{-angle * b:.14g}\n{n},2,2,{angle * a:.14g}" for n, a, b in zip(numbers, x, y))
    return ["*STEP, INC=200\n*STATIC\n1.,1.\n*BOUNDARY", *rows]


def _peak(points: np.ndarray, pressure: np.ndarray) -> float:
    """Largest pressure at the nodes (n,) of a flank, by a parabola through those above 0.8 of the largest.

    Values at nodes scatter by some per cent, as the sides of elements do not end where the contact does.
    Hertz's half ellipse is such a parabola within 0.3 % there.
    """
    largest = int(pressure.argmax())
    middle = points[largest]
    tangent = points[np.argsort(((points - middle) ** 2).sum(axis=1))[1]] - middle
    along = (points - middle) @ tangent / np.hypot(*tangent)
    near = pressure > 0.8 * pressure[largest]
    if np.count_nonzero(near) < 4 or pressure[largest] <= 0.0:
        return max(float(pressure[largest]), 0.0)
    parabola = np.polyfit(along[near], pressure[near], 2)
    place = np.linspace(along[near].min(), along[near].max(), 501)
    return float(np.polyval(parabola, place).max())


def _principal(stress: np.ndarray) -> np.ndarray:
    """Principal stresses in the plane, the lower one first, of rows xx, yy, zz, xy, ..."""
    xx, yy, xy = stress[:, 0], stress[:, 1], stress[:, 3]
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    return np.column_stack([middle - radius, middle + radius])
