"""Planets that are shafts, as they run around with their carrier in the structure of all the rest.

One kind of mesh of all branches, such as all planets with the sun, excites. What turns with the carrier are branches of
planets with their bearings on it: shafts that bend, meshes among planets. They meet the structure at all meshes with
central gears and at their pins (`femgear.housing.two_way.running_planets`). Kinds of one mesh frequency vary together:
k(t) of all of them acts on the motion, and motions by the kinds add up to that of all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femgear.housing.two_way.carrier_orders import MeshPaths, mean_excitation
from femgear.housing.two_way.running_planets import RubbingPoints, RunningStage
from femgear.system.assembly import GROUND
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.carrier import pin_axes
from femgear.trains.gearbox.case_file import PairSection
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.elastic_ring import ElasticRing
from femgear.trains.gearbox.model import GearboxModel, StageModel
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.planet_branches import RunningSet, are_unequal
from femgear.trains.gearbox.stage_structure import (
    Orbit,
    Row,
    StructuredStage,
    reversed_in_time,
    shape_waves,
    springs_of_mesh,
    structure_apart,
    structure_modes,
)

_ALIKE = 1e-6
"""Difference of places and phases of equal planets, in turns and mesh periods."""
_HELD = 1e-12
"""Stiffness of a bearing over its largest one that is none."""
_SENSE = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


@dataclass(frozen=True)
class BranchForces:
    """Where the forces of contact points act.

    Parameters
    ----------
    meshes : mapping of int to (int, int)
        Branch and contact point of the approach of every mesh on the carrier, by its number.
    pins : mapping of int to (int, (n,) int array, (n, 3) array)
        Branch of every bearing on a pin, by its number, its contact points, and what unit forces of these do to the
        planet radially, tangentially and along z [1].
    exciting_kinds : slice
        Kinds of the running stage that excite: one.
    """

    meshes: Mapping[int, tuple[int, int]]
    pins: Mapping[int, tuple[int, np.ndarray, np.ndarray]]
    exciting_kinds: slice


@dataclass(frozen=True)
class _Point:
    """A contact point of the first branch: springs of a ``stiffness`` [N/m, N m/rad] between planets and structure.

    ``row`` is what the structure does to it, ``approach`` (p,) what the planets do along their own axes.
    """

    row: Row
    approach: np.ndarray
    stiffness: float


def branch_stage(
    state: Deflection,
    running: RunningSet,
    kind: int,
    excitations: Mapping[str, MeshExcitation],
    phases: Mapping[str, float],
    rings: Sequence[ElasticRing] = (),
) -> tuple[StructuredStage, BranchForces]:
    """Take the branches of a carrier out of a gearbox, one kind of whose meshes excites it.

    Parameters
    ----------
    state : Deflection
        Loaded state of the gearbox.
    running : RunningSet
        The branches.
    kind : int
        Number of the kind that excites.
    excitations : mapping of str to MeshExcitation
        Of all stages that excite, by name.
    phases : mapping of str to float
        Of all pairs [mesh periods].
    rings : sequence of ElasticRing
        Of other stages.
    """
    model = state.model
    stages = {stage.name: stage for stage in model.stages}
    kinds = [[stages[name] for name in names] for names in running.kinds]
    stations = [branch_stations(model, branch.planets) for branch in running.branches]
    gone, meshes = {at for of_branch in stations for at in of_branch}, {s.meshes[0] for names in kinds for s in names}
    modes, motion, inner = structure_modes(state, structure_apart(state, gone, meshes, rings), rings)
    frequencies = [model.flow.mesh_frequency[names[0].name] for names in kinds]
    together = kinds_together(model, running, kind)
    order = [*together, *(n for n in range(len(kinds)) if n not in together)]
    first = _Branch(state, running, stations[0])
    points, of_mesh = first.meshes([kinds[n] for n in order])
    pins, of_pin = first.pins()
    excitation, paths, sense = kinds_in_time(state, running, [kinds[n] for n in together], kind, excitations, phases)
    mean = excitation.stiffness.mean(axis=1).reshape(len(together), -1).mean(axis=1)
    stiffness = np.array([point.stiffness for point in (*points, *pins)])
    stiffness[: len(together)] = mean
    free, damping = first.free, model.case.modes.damping_ratio
    rows = [point.row for point in (*points, *pins)]
    carrier = model.case.shaft_named(running.branches[0].carrier)
    orbit = Orbit(running.angles[0], np.array([*carrier.axis, 0.0]))
    shape = np.array([shape_waves(row, orbit, motion, model.assembly.places) for row in rows])
    rubbing = None
    if excitation.source is not None:
        rubbed = first.rubbing([kinds[n] for n in together])
        rows += [rubbing_row.row for rubbing_row in rubbed]
        sliding = np.array(
            [shape_waves(rubbing_row.row, orbit, motion, model.assembly.places) for rubbing_row in rubbed]
        )
        rubbing = RubbingPoints(sliding, np.array([rubbing_row.approach for rubbing_row in rubbed]).T[free])
    mass, gyroscopic, elastic = first.matrices(2.0 * math.pi * frequencies[kind])
    turning = np.kron(np.eye(2 * len(stations[0])), _SENSE)
    both = np.ix_(free, free)
    stage = RunningStage(
        2.0 * math.pi * modes.frequency,
        np.zeros(len(modes.frequency)),
        shape,
        mass[both],
        gyroscopic[both],
        turning[both],
        np.array([point.approach for point in (*points, *pins)]).T[free],
        stiffness,
        np.full(len(stiffness), 2.0 * damping),
        excitation,
        paths,
        sense,
        structure_loss=2.0 * damping,
        rubbing=rubbing,
        elastic=elastic[both],
    )
    of_branch = together.index(kind)
    forces = BranchForces(
        {s.meshes[0]: (n, of_mesh[order.index(k)]) for k, names in enumerate(kinds) for n, s in enumerate(names)},
        {
            bearing: (n, len(points) + of_pin[at][0], of_pin[at][1])
            for n, numbers in enumerate(running.pins)
            for at, bearing in enumerate(numbers)
        },
        slice(of_branch, of_branch + 1),
    )
    of_meshes = np.array([True] * len(points) + [False] * len(pins) + [True] * (len(rows) - len(points) - len(pins)))
    return StructuredStage(stage, motion, tuple(rows), of_meshes, inner, orbit), forces


def kinds_together(model: GearboxModel, running: RunningSet, kind: int) -> list[int]:
    """Numbers of the kinds that have the mesh frequency of one of them."""
    frequencies = [model.flow.mesh_frequency[names[0]] for names in running.kinds]
    return [n for n, hertz in enumerate(frequencies) if math.isclose(hertz, frequencies[kind], rel_tol=1e-9)]


def branch_kinds(
    state: Deflection,
    running: RunningSet,
    kinds: Sequence[int],
    excitations: Mapping[str, MeshExcitation],
    phases: Mapping[str, float],
    rings: Sequence[ElasticRing] = (),
) -> list[list[tuple[StructuredStage, BranchForces]]]:
    """Take the branches of a carrier out of a gearbox for kinds of one mesh frequency, each of which excites it.

    Parameters are those of `branch_stage`, ``kinds`` the numbers of the kinds. Those that differ in their excitation
    alone stand together, see `femgear.housing.two_way.running_planets.solve_excitations`.
    """
    structured, forces = branch_stage(state, running, kinds[0], excitations, phases, rings)
    together, stages = kinds_together(state.model, running, kinds[0]), {s.name: s for s in state.model.stages}
    meshes = [[stages[name] for name in running.kinds[n]] for n in together]
    first, made = structured.running, [[(structured, forces)]]
    for kind in kinds[1:]:
        excitation, paths, sense = kinds_in_time(state, running, meshes, kind, excitations, phases)
        mean, of_kind = excitation.stiffness.mean(axis=1).reshape(len(together), -1).mean(axis=1), together.index(kind)
        alike = np.array_equal(mean, first.stiffness[: len(together)]) and paths == first.paths
        if alike and (excitation.source is None) == (first.rubbing is None):
            stage = replace(first, excitation=excitation, sense=sense)
            of_forces = replace(forces, exciting_kinds=slice(of_kind, of_kind + 1))
            made[0].append((replace(structured, running=stage), of_forces))
        else:
            made.append([branch_stage(state, running, kind, excitations, phases, rings)])
    return made


def branch_stations(model: GearboxModel, planets: Sequence[str]) -> list[int]:
    """Stations of all planets of a branch."""
    counts = {name: len(model.beams[name].stations) if name in model.beams else 1 for name in planets}
    return [model.first[name] + n for name in planets for n in range(counts[name])]


class _Branch:
    """The first branch of a set: its contact points and matrices, along axes that are radial at its first planet."""

    def __init__(self, state: Deflection, running: RunningSet, stations: Sequence[int]):
        self.state, self.running, self.model = state, running, state.model
        self.place = {station: n for n, station in enumerate(stations)}
        self.size = 6 * len(stations)
        assembly, _, self.tangents = linear_system(state)
        self.assembly = assembly
        self.free = np.flatnonzero(~assembly.held.reshape(-1, 6)[list(stations)].ravel())
        self.axes = np.kron(np.eye(2), pin_axes(running.angles[0]))

    def _point(self, stations: Sequence[int], effects: np.ndarray, stiffness: float) -> _Point:
        """Point by what both stations do to it, (2, 6) along x, y, z."""
        row, approach = Row(), np.zeros(self.size)
        for station, effect in zip(stations, effects, strict=True):
            if station in self.place:
                at = 6 * self.place[station]
                approach[at : at + 6] += self.axes @ effect
            elif station != GROUND:
                row.append((station, effect))
        return _Point(row, approach, stiffness)

    def meshes(self, kinds: Sequence[Sequence[StageModel]]) -> tuple[list[_Point], list[int]]:
        """Points of the approach of all kinds of meshes, then of their slopes; numbers of the former.

        The stiffness is the mean of all branches.
        """
        approach, slopes = list[_Point](), list[_Point]()
        for stages in kinds:
            numbers = [stage.meshes[0] for stage in stages]
            stiffness = np.mean([self.tangents[self.assembly.slices[number]] for number in numbers], axis=0)
            contact = self.assembly.contacts[numbers[0]]
            (rows, value), (tilt, against) = springs_of_mesh(contact, stiffness)
            approach.append(self._point(contact.stations, rows, value))
            if against > 0.0:
                slopes.append(self._point(contact.stations, tilt, against))
        return [*approach, *slopes], list(range(len(approach)))

    def rubbing(self, kinds: Sequence[Sequence[StageModel]]) -> list[_Point]:
        """Points of the friction of meshes: sliding along the tangent of all kinds, then the couples."""
        listed = list[_Point]()
        for way in (0, 1):
            for stages in kinds:
                number = stages[0].meshes[0]
                contact, k = self.assembly.contacts[number], self.tangents[self.assembly.slices[number]]
                sliding = np.einsum("s,gsm->gm", k / k.sum(), contact.sliding[way])
                listed.append(self._point(contact.stations, sliding, 0.0))
        return listed

    def pins(self) -> tuple[list[_Point], list[tuple[np.ndarray, np.ndarray]]]:
        """Points of the bearings on the carrier, and of every bearing their numbers and forces on the planet.

        The stiffness is the mean of all branches, each along its own axes.
        """
        points, listed = list[_Point](), list[tuple[np.ndarray, np.ndarray]]()
        for at, bearing in enumerate(self.running.pins[0]):
            springs, start = self.model.bearings[bearing], len(points)
            along = np.zeros((6, 6))
            for psi, numbers in zip(self.running.angles, self.running.pins, strict=True):
                axes = np.kron(np.eye(2), pin_axes(psi))
                tangent = self.state.bearing_stiffness[numbers[at]]
                along += axes @ np.where(np.isinf(tangent), 0.0, tangent) @ axes.T / len(self.running.pins)
            rigid = np.isinf(np.diag(self.state.bearing_stiffness[bearing]))
            values, vectors = np.linalg.eigh(along)
            held = values > _HELD * max(values.max(), np.finfo(float).tiny)
            ways = np.vstack([vectors[:, held].T, np.eye(6)[rigid]])
            stiffness = np.append(values[held], np.full(int(rigid.sum()), math.inf))
            rows = (self.axes @ springs.rows).reshape(6, 2, 6)
            for way, value in zip(ways, stiffness, strict=True):
                points.append(self._point(springs.stations, np.einsum("w,wgm->gm", way, rows), float(value)))
            listed.append((np.arange(start, len(points)), -ways[:, :3]))
        return points, listed

    def matrices(self, mesh_frequency: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, gyroscopic matrix over the mesh frequency [rad/s] and stiffness (p, p) of the planets."""
        mass, gyroscopic, elastic = np.zeros((3, self.size, self.size))
        for inertia in self.assembly.inertias:
            if (at := self._at(inertia.stations)) is not None:
                mass[at] += inertia.mass
                gyroscopic[at] += inertia.gyroscopic / mesh_frequency
        for beam in self.assembly.beams:
            if (at := self._at(beam.stations)) is not None:
                elastic[at] += beam.stiffness
        turned = np.kron(np.eye(len(self.place)), self.axes)
        return tuple(turned @ matrix @ turned.T for matrix in (mass, gyroscopic, elastic))  # type: ignore[return-value]

    def _at(self, stations: Sequence[int]) -> tuple[np.ndarray, ...] | None:
        """Places of the motions of stations in matrices; None of stations that are not of this branch."""
        if not self.place.keys() >= {*stations}:
            return None
        numbers = np.concatenate([6 * self.place[station] + np.arange(6) for station in stations])
        return np.ix_(numbers, numbers)


def kinds_in_time(
    state: Deflection,
    running: RunningSet,
    kinds: Sequence[Sequence[StageModel]],
    kind: int,
    excitations: Mapping[str, MeshExcitation],
    phases: Mapping[str, float],
) -> tuple[MeshExcitation, MeshPaths, int]:
    """Find the excitation of all kinds of one mesh frequency as time goes on, paths of branches, sense of the carrier.

    Kinds beside that of the number vary in stiffness alone. Planets that nothing but the gearbox loads unequally are
    taken as equal, with the mean of all of them.
    """
    stages_of_kind = {*running.kinds[kind]}
    count = max(excitations[name].stiffness.shape[1] for name in stages_of_kind if name in excitations)
    records = [
        [_record(state, stage, excitations, phases, count, stage.name in stages_of_kind) for stage in row]
        for row in kinds
    ]
    every = [record for row in records for record in row]
    stiffness, deflection, force = (
        np.concatenate([getattr(record, name) for record in every]) for name in ("stiffness", "deflection", "force")
    )
    source = None
    if all(record.source is not None for record in every):
        # both points of every mesh, point by point, kind by kind and branch by branch
        source = np.concatenate([record.source[way : way + 1] for way in (0, 1) for record in every])  # type: ignore[index]
    excitation = MeshExcitation(stiffness, deflection, force, np.zeros(len(every)), source=source)
    speed = state.model.flow.speed[running.branches[0].carrier]
    sense = -1 if speed < 0.0 else 1
    paths = MeshPaths(1, running.angles)
    if are_unequal(state.model.case, running):
        return excitation, paths, sense
    steps = [phases[row[n].name] - phases[row[0].name] for row in kinds for n in range(len(row))]
    teeth = _teeth(running.angles, np.array(steps), sense)
    if teeth is None or any(name not in excitations for name in stages_of_kind):
        return excitation, paths, sense
    paths = MeshPaths(teeth, running.angles, 0.0, len(running.angles))
    return mean_excitation(excitation, paths, sense), paths, sense


def _teeth(angles: Sequence[float], steps: np.ndarray, sense: int) -> int | None:
    """Teeth that a ring would have for phases (kinds N,) [mesh periods] of equally spaced branches; None of others."""
    N = len(angles)
    apart = (np.asarray(angles) - angles[0]) * N / (2.0 * math.pi)
    if np.abs(apart - np.arange(N)).max() > _ALIKE * N:
        return None
    for teeth in range(1, N + 1):
        missed = steps.reshape(-1, N) - sense * teeth * np.arange(N) / N
        if np.abs(missed - np.rint(missed)).max() < 1e-3:
            return teeth
    return None


def _record(
    state: Deflection,
    stage: StageModel,
    excitations: Mapping[str, MeshExcitation],
    phases: Mapping[str, float],
    count: int,
    excites: bool,
) -> MeshExcitation:
    """Excitation of a pair over a mesh period, with its phase; of one that varies alone without its static part."""
    flow, section = state.model.flow, stage.section
    assert isinstance(section, PairSection) and section.carrier is not None
    k = state.model.assembly.contacts[stage.meshes[0]].stiffness.sum()
    nothing = np.zeros((1, count))
    record = excitations.get(stage.name)
    if record is None or record.periods != 1 or record.stiffness.shape[1] != count:
        return MeshExcitation(np.full((1, count), k), nothing, nothing, np.zeros(1))
    turns = flow.speed[section.shafts[0]] - flow.speed[section.carrier]
    record = ahead(reversed_in_time(record, back=turns < 0.0), phases[stage.name])
    if excites:
        return record
    still = {
        name: np.repeat(getattr(record, name).mean(axis=1)[:, None], count, axis=1) for name in ("deflection", "force")
    }
    silent = None if record.source is None else np.zeros_like(record.source)
    return replace(record, **still, source=silent)


def ahead(record: MeshExcitation, phase: float) -> MeshExcitation:
    """Move an excitation ahead by a phase [mesh periods]."""
    if not phase:
        return record
    arrays = {}
    for name in ("stiffness", "deflection", "force", "source"):
        if (values := getattr(record, name)) is not None:
            lines = np.fft.rfft(values, axis=1)
            turned = lines * np.exp(2j * math.pi * phase / record.periods * np.arange(lines.shape[1]))
            arrays[name] = np.fft.irfft(turned, values.shape[1], axis=1)
    return replace(record, **arrays)
