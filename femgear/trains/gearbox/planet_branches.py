"""Branches of planets that are shafts: where equal ones fit around their carrier, and the marks that put them in.

A branch is a planet, or planets in mesh with one another, with all their meshes. Branches alike in gears, places and
the timing of gears on one planet fit at multiples of one angle (`femgear.gears.planet_assembly`). Gears of one shaft
and one number of teeth are one gear. Gears that are timed for the place of their planet fit as planets of their own do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.errors import CaseError
from femgear.gears.deviations import common_period
from femgear.gears.planet_assembly import assembly_step, nearest_places, timing_marks, tooth_relations
from femgear.gears.shaft_graph import EXTERNAL, INTERNAL, StageGears, connected_sets
from femgear.report.tables import Block, merged_names
from femgear.trains.gearbox.case_file import GearboxCase, PairSection, teeth_of
from femgear.trains.gearbox.geometry import DISTANCE_TOLERANCE, carriers, pair_sizes

ASSEMBLY_TOLERANCE = 5e-3
"""Part of a tooth pitch by which teeth may miss their gaps: what axes to a micrometre leave open."""
_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class PlanetBranch:
    """One branch of planets.

    Parameters
    ----------
    carrier : str
        The shaft that takes it around.
    planets : tuple of str
        Its shafts, in the same order in branches that are alike.
    gears : StageGears
        Gears as "SHAFT TEETH" of central ones, "NUMBER TEETH" of planets by their places in ``planets``.
    axes : (n, 2) array
        Of the planets, from the axis of the carrier [m].
    pairs : tuple of str
        Names of its pairs, in the order of the meshes of ``gears``.
    """

    carrier: str
    planets: tuple[str, ...]
    gears: StageGears
    axes: np.ndarray
    pairs: tuple[str, ...]

    @property
    def angle(self) -> float:
        """Direction of the first planet from the axis of the carrier [rad]."""
        return math.atan2(self.axes[0, 1], self.axes[0, 0])

    def is_alike(self, other: PlanetBranch) -> bool:
        """Whether another branch is this one, turned about the axis of the carrier."""
        if (self.carrier, self.gears.meshes, self.gears.bodies) != (
            other.carrier,
            other.gears.meshes,
            other.gears.bodies,
        ):
            return False
        axes, others = (branch.axes @ _turning(branch.angle) for branch in (self, other))
        return bool(np.abs(axes - others).max() < DISTANCE_TOLERANCE)

    @property
    def is_free(self) -> bool:
        """Whether it fits anywhere: no relation ties the central gears, or all of them turn alike."""
        return not any(sum(relation.values()) for relation in tooth_relations(self.gears))


def planet_branches(case: GearboxCase) -> list[PlanetBranch]:
    """List the branches of all carriers, in the order of their first planets in the pairs."""
    of_carrier, branches = carriers(case), list[PlanetBranch]()
    for carrier in dict.fromkeys(of_carrier.values()):
        pairs = [stage for stage in case.pair if stage.carrier == carrier]
        planets = dict.fromkeys(shaft for stage in pairs for shaft in stage.shafts if of_carrier.get(shaft) == carrier)
        meshing = [[shaft for shaft in stage.shafts if shaft in planets] for stage in pairs]
        for together in connected_sets([*((planet,) for planet in planets), *meshing]):
            branches.append(_branch(case, carrier, [planet for planet in planets if planet in together], pairs))
    return branches


def _branch(case: GearboxCase, carrier: str, planets: list[str], pairs: list[PairSection]) -> PlanetBranch:
    stages = [stage for stage in pairs if not {*stage.shafts}.isdisjoint(planets)]

    def words(planet: str) -> list[tuple]:
        """What tells planets of a branch from one another: their meshes, with the names of central mates."""
        return sorted(
            (pair_sizes(stage).teeth[side], pair_sizes(stage).teeth[1 - side], "" if mate in planets else mate)
            for stage in stages
            for side, mate in enumerate(reversed(stage.shafts))
            if stage.shafts[side] == planet
        )

    planets = sorted(planets, key=words)
    teeth, shafts, meshes = dict[str, int](), dict[str, str | None](), list[tuple[tuple[str, str, int], str]]()
    for stage in stages:
        names = []
        for shaft, count in zip(stage.shafts, pair_sizes(stage).teeth, strict=True):
            name = f"{planets.index(shaft) + 1 if shaft in planets else shaft} {count}"
            teeth[name] = count
            names.append(name)
            if shaft not in planets:
                shafts[name] = shaft
        sense = INTERNAL if pair_sizes(stage).internal else EXTERNAL
        meshes.append(((names[0], names[1], sense), stage.name))
    bodies = []
    for number, planet in enumerate(planets, start=1):
        gears = sorted(name for name in teeth if name not in shafts and name.startswith(f"{number} "))
        if not case.shaft_named(planet).gears_timed:
            bodies += [(gears[0], other) for other in gears[1:]]
    axes = np.subtract([case.shaft_named(planet).axis for planet in planets], case.shaft_named(carrier).axis)
    meshing, names = zip(*sorted(meshes), strict=True)
    gears = StageGears(teeth, shafts | {"carrier": carrier}, meshing, tuple(bodies))
    return PlanetBranch(carrier, tuple(planets), gears, axes, names)


def _turning(angle: float) -> np.ndarray:
    """Matrix (2, 2) that, from the right, turns rows of x and y back by an angle [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def alike_branches(case: GearboxCase) -> list[list[PlanetBranch]]:
    """Collect the branches that are alike, each set in the order of their angles from its first one on."""
    sets = list[list[PlanetBranch]]()
    for branch in planet_branches(case):
        alike = next((group for group in sets if group[0].is_alike(branch)), None)
        if alike is None:
            sets.append([branch])
        else:
            alike.append(branch)
    return [sorted(group, key=lambda branch: _beyond(branch, group[0])) for group in sets]


def _beyond(branch: PlanetBranch, first: PlanetBranch) -> float:
    """Angle of a branch beyond the first one, from 0 to a turn [rad]."""
    angle = (branch.angle - first.angle) % _TURN
    return 0.0 if _TURN - angle < 1e-9 else angle


@dataclass(frozen=True)
class RunningSet:
    """Branches that are alike and run around with a carrier, all its planets.

    Parameters
    ----------
    branches : tuple of PlanetBranch
        In the order of their angles.
    pins : tuple of tuple of int
        Numbers of the bearings of every branch on the carrier, in the same order in all of them.
    """

    branches: tuple[PlanetBranch, ...]
    pins: tuple[tuple[int, ...], ...]

    @property
    def angles(self) -> tuple[float, ...]:
        """Directions of the branches from the axis of the carrier, ascending from the first one [rad]."""
        first = self.branches[0]
        return tuple(first.angle + _beyond(branch, first) for branch in self.branches)

    @property
    def kinds(self) -> tuple[tuple[str, ...], ...]:
        """Names of the pairs of every mesh of a branch, branch by branch."""
        return tuple(zip(*(branch.pairs for branch in self.branches), strict=True))


def running_sets(case: GearboxCase) -> list[RunningSet]:
    """List the sets of branches that the response lets run around their carriers.

    All branches of a carrier are alike, nothing but bearings on the carrier and gears holds their planets, and no gear
    has errors that turn.
    """
    planets, running = carriers(case), list[RunningSet]()
    sets = alike_branches(case)
    for carrier in dict.fromkeys(planets.values()):
        on_carrier = [alike for alike in sets if alike[0].carrier == carrier]
        planets_in_sets = {planet for alike in on_carrier for branch in alike for planet in branch.planets}
        held = any(not planets_in_sets.isdisjoint(coupling.between) for coupling in case.coupling)
        held |= any(stage.carrier != carrier and not planets_in_sets.isdisjoint(stage.shafts) for stage in case.pair)
        members = {name for stage in case.planetary for name in (stage.sun, stage.carrier, stage.ring)}
        held |= not planets_in_sets.isdisjoint({*planets.values(), *members, *case.operation.fixed})
        held |= any(stage.carrier == carrier and _deviates(stage) for stage in case.pair)
        held |= any(bearing.outer_shaft in planets_in_sets for bearing in case.bearing)
        held |= any(bearing.shaft in planets_in_sets and bearing.outer_shaft != carrier for bearing in case.bearing)
        if held or len(on_carrier) != 1:
            continue
        pins = [_pins(case, branch) for branch in on_carrier[0]]
        if all([where for _, where in branch] == [where for _, where in pins[0]] for branch in pins):
            numbers = tuple(tuple(number for number, _ in branch) for branch in pins)
            running.append(RunningSet(tuple(on_carrier[0]), numbers))
    return running


def _deviates(stage: PairSection) -> bool:
    """Whether the teeth of a pair have errors that take more than a mesh period to repeat."""
    teeth = teeth_of(stage)
    return teeth is not None and common_period(set_deviations(teeth), planetary_set(teeth))[0] > 1


def are_unequal(case: GearboxCase, running: RunningSet) -> bool:
    """Tell whether errors of planets make them unequal."""
    names = {name for kind in running.kinds for name in kind}
    planets = {planet for branch in running.branches for planet in branch.planets}
    return any(shaft.pin_error is not None for shaft in case.shaft if shaft.name in planets) or any(
        stage.timing_error for stage in case.pair if stage.name in names
    )


def joint_names(case: GearboxCase) -> dict[str, str]:
    """Name what excites a gearbox together, such as all planets with the sun, by the names of its pairs."""
    kinds = [names for running in running_sets(case) for names in running.kinds]
    return {name: merged_names(names) for names in kinds for name in names}


def _pins(case: GearboxCase, branch: PlanetBranch) -> list[tuple[int, tuple]]:
    """Bearings of a branch with the planet that each is of and its places, in the order of these."""
    listed = [
        (number, (branch.planets.index(bearing.shaft), bearing.position or 0.0, bearing.outer_position or 0.0))
        for number, bearing in enumerate(case.bearing)
        if bearing.shaft in branch.planets
    ]
    return sorted(listed, key=lambda listed: listed[1])


def misplaced_branches(case: GearboxCase) -> Iterator[CaseError]:
    """Refuse branches that are alike and stand where their teeth do not fit (E-ASSEMBLY)."""
    for first, *others in alike_branches(case):
        if first.is_free or not others:
            continue
        step, angles = assembly_step(first.gears), [_beyond(other, first) for other in others]
        for branch, angle, place in zip(others, angles, nearest_places(step, [0.0, *angles])[1:], strict=True):
            nearest = _TURN * float(place * step)
            missed = abs(angle - nearest) * max(first.gears.teeth.values()) / _TURN
            if missed > ASSEMBLY_TOLERANCE:
                yield _misplaced(case, first, branch, step, nearest, missed)


def _misplaced(
    case: GearboxCase, first: PlanetBranch, branch: PlanetBranch, step: Fraction, nearest: float, missed: float
) -> CaseError:
    centre = np.asarray(case.shaft_named(branch.carrier).axis)
    moved = (branch.axes @ _turning(_beyond(branch, first) - nearest) + centre) * 1e3
    places = "; ".join(
        f'{name}: axis = ["{x:.9g} mm", "{y:.9g} mm"]' for name, (x, y) in zip(branch.planets, moved, strict=True)
    )
    remedies = [f"the nearest place, {math.degrees(nearest):.6f} deg: {places}"]
    if branch.gears.bodies:
        remedies.append("gears_timed = true on planets whose gears are put on their shafts for their places")
    return CaseError(
        f"{' and '.join(branch.planets)}, equal to {' and '.join(first.planets)}, do not assemble: one gear or another "
        f"misses its gaps, by {missed:.3g} pitches of the largest one",
        code="E-ASSEMBLY",
        key=f"shaft[{[shaft.name for shaft in case.shaft].index(branch.planets[0])}].axis",
        value=f"{math.degrees(_beyond(branch, first)):.6f} deg from {first.planets[0]}",
        limit=f"multiples of {float(360 * step):.6f} deg, 1/{1 / step} of a turn",
        remedy=remedies,
    )


def describe_branches(case: GearboxCase) -> Iterator[Block]:
    """Tabulate where planets stand and the marks by which they are put in, for all branches that are alike."""
    for alike in alike_branches(case):
        first, rows = alike[0], list[tuple[str, ...]]()
        step = Fraction(1) if first.is_free else assembly_step(first.gears)
        for branch in alike:
            angle = _beyond(branch, first)
            (place,) = nearest_places(step, [0.0, angle])[1:]
            marks = {} if first.is_free else timing_marks(first.gears, place * step)
            bodies = {second: gear for gear, second in first.gears.bodies}
            for number, planet in enumerate(branch.planets, start=1):
                gears = [gear for gear in first.gears.teeth if gear.startswith(f"{number} ") and gear not in bodies]
                for gear in gears:
                    of = f"{planet}, {first.gears.teeth[gear]} teeth" if len(gears) > 1 else planet
                    turned = f"{float(360 * marks[gear]):.4f}" if gear in marks else "-"
                    at = "-" if first.is_free else f"{place} of {1 / step}"
                    rows.append((of, f"{math.degrees(angle):.4f}", at, turned))
        header = ("planet", "branch at [deg]", "place", "mark turned by [deg]")
        note = (
            "a mark on every planet that points outwards in the first branch points so much further in the others, "
            "counter-clockwise"
        )
        yield Block(f"Planets on {first.carrier}", header, tuple(rows), (note,))
