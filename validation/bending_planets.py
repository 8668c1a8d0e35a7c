"""Stepped planets that bend between their gears as they run around, in time and in axes at rest."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from planet_gearboxes import bending_set
from scipy.integrate import solve_ivp

from femgear.housing.two_way.running_planets import RunningStage
from femgear.solvers.time.transient import solve_transient
from femgear.system.assembly import GROUND, Assembly
from femgear.system.system import MechanicalSystem
from femgear.trains.gearbox.carrier import pin_axes
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import pair_count_excitation
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.nonlinear import NonlinearGearbox, nonlinear_gearbox
from femgear.trains.gearbox.planet_branches import RunningSet, running_sets
from femgear.trains.gearbox.planet_shafts import pair_phases
from femgear.trains.gearbox.running_branches import branch_stage
from femgear.trains.gearbox.stage_structure import structure_apart
from femgear.trains.gearbox.turning_planets import centrifugal_pull, turning_planets, wave_generator
from femgear.trains.reading import read_case
from validation.gearbox_in_time import ANGLE, BY_MASS, BY_STIFFNESS, IN_TIME, apart_in_time
from validation.reference.running_in_time import TurningSystem
from validation.rows import Row, at_most

TIME_CONSTANT = 1e-6
"""Viscous damping of the bearings of planets over their stiffness [s]."""


@dataclass(frozen=True)
class _AtRest:
    """The set in axes at rest: coordinates of the structure, then the motions of all planets.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    running : RunningSet
        Its planets.
    structure : MechanicalSystem
        Without planets and their meshes.
    motions : (6n, k) array
        Of all stations by all coordinates.
    coordinates : int
        Number of coordinates of the structure.
    """

    state: Deflection
    running: RunningSet
    structure: MechanicalSystem
    motions: np.ndarray
    coordinates: int

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, damping and stiffness (k, k) of structure and planets without their meshes and bearings."""
        assembly, planets = self.state.model.assembly, planet_stations(self.state, self.running)
        mass, damping, stiffness = np.zeros((3, assembly.count, assembly.count))
        for inertia in assembly.inertias:
            if planets.issuperset(inertia.stations):
                at = _motions_of(inertia.stations)
                mass[np.ix_(at, at)] += inertia.mass
                damping[np.ix_(at, at)] += inertia.gyroscopic
        for beam in assembly.beams:
            if planets.issuperset(beam.stations):
                at = _motions_of(beam.stations)
                stiffness[np.ix_(at, at)] += beam.stiffness
        mass, damping, stiffness = (self.motions.T @ matrix @ self.motions for matrix in (mass, damping, stiffness))
        inner = np.s_[: self.coordinates, : self.coordinates]
        mass[inner] += self.structure.M
        damping[inner] += BY_MASS * self.structure.M + BY_STIFFNESS * self.structure.K
        stiffness[inner] += self.structure.K
        return mass, damping, stiffness


def planet_stations(state: Deflection, running: RunningSet) -> set[int]:
    """Stations of all planets, two of each."""
    first = (state.model.first[planet] for branch in running.branches for planet in branch.planets)
    return {start + end for start in first for end in (0, 1)}


def _motions_of(stations: tuple[int, ...]) -> np.ndarray:
    return np.concatenate([6 * station + np.arange(6) for station in stations])


def set_at_rest(*, back: bool) -> _AtRest:
    """Solve the set for its loaded state and take its planets out of the structure."""
    state = solve_deflection(read_case(bending_set(ANGLE, back=back)))
    (running,) = running_sets(state.model.case)
    planets, assembly = planet_stations(state, running), state.model.assembly
    rest, structure, _ = structure_apart(
        state, planets, {mesh for stage in state.model.stages for mesh in stage.meshes}
    )
    moving = _motions_of(tuple(sorted(planets)))
    motions = np.zeros((assembly.count, rest.motions.shape[1] + len(moving)))
    motions[:, : -len(moving)] = rest.motions
    motions[moving, -len(moving) + np.arange(len(moving))] = 1.0
    return _AtRest(state, running, structure, motions, rest.motions.shape[1])


def _turning_rows(
    state: Deflection, running: RunningSet, first: str, sense: int, *, back: bool
) -> Callable[[float], np.ndarray]:
    """Approaches of the meshes with a member, then of all others, then of bearings, where the carrier has turned.

    Per unit of all motions.
    """
    model = state.model
    meshes = [
        stage.meshes[0] for stage in sorted(model.stages, key=lambda stage: (first not in stage.name, stage.name))
    ]

    def rows(turn: float) -> np.ndarray:
        there = solve_deflection(read_case(bending_set(ANGLE + sense * turn, back=back))).model
        assembly: Assembly = there.assembly
        listed = [assembly.columns[:, assembly.slices[mesh]].T for mesh in meshes]
        for psi, numbers in zip(running.angles, running.pins, strict=True):
            # dampers turn with the carrier, so springs do: outwards, around, along the axis
            turned = np.kron(np.eye(2), pin_axes(psi + sense * turn))
            for number in numbers:
                springs, moved = there.bearings[number], np.zeros((6, assembly.count))
                for place, station in enumerate(springs.stations):
                    assert station != GROUND
                    moved[:, 6 * station : 6 * station + 6] += springs.rows[:, 6 * place : 6 * place + 6]
                listed.append(turned @ moved)
        return np.vstack(listed)

    return rows


def turning_set(member: str, *, back: bool) -> tuple[TurningSystem, RunningStage, np.ndarray]:
    """Planets whose meshes with a member excite, in axes at rest and as the response takes them.

    And the modes (m, k) of the structure by its coordinates.
    """
    at_rest = set_at_rest(back=back)
    state, running, model = at_rest.state, at_rest.running, at_rest.state.model
    kind = next(number for number, names in enumerate(running.kinds) if member in names[0])
    excitations = {stage.name: pair_count_excitation(model, stage) for stage in model.stages}
    structured, _ = branch_stage(state, running, kind, excitations, pair_phases(model.case, model.flow))
    stage, frequency = structured.running, structured.running.natural_frequency
    # the excited meshes, the others, then bearings
    viscous = np.where(np.arange(len(stage.stiffness)) < 2, 0.0, TIME_CONSTANT * stage.stiffness)
    ratio = 0.5 * (BY_MASS / frequency + BY_STIFFNESS * frequency)
    undamped = {"loss": 0.0 * stage.loss, "structure_loss": 0.0}
    stage = replace(stage, damping_ratio=ratio, viscous=viscous, **undamped)
    bearings = np.concatenate([np.diag(state.bearing_stiffness[n]) for numbers in running.pins for n in numbers])
    springs = np.append(np.full(3, stage.stiffness[1]), bearings)
    dampers = TIME_CONSTANT * np.append(np.zeros(3), bearings)
    speed = abs(model.flow.speed["carrier"])
    teeth = round(2.0 * math.pi * model.flow.mesh_frequency[f"{member} 0"] / speed)
    rows, drive = _turning_rows(state, running, member, stage.sense, back=back), stage.excitation
    turning = TurningSystem(
        lambda turn: rows(turn) @ at_rest.motions, *at_rest.matrices(), springs, dampers, drive, teeth, speed, 2
    )
    shape = np.linalg.lstsq(at_rest.motions[:, : at_rest.coordinates], structured.motion, rcond=None)[0]
    return turning, stage, shape.T


def bending_planets() -> list[Row]:
    """Lines of stepped planets of two gears and two bearings, with tilts, gyroscopic moments and side bands."""
    rows = list[Row]()
    for member, back in (("sun", False), ("ring", True)):
        apart = apart_in_time(*turning_set(member, back=back))
        name = f"stepped 11/16/8/35 that bends, meshes of the {member} excite{', backwards' if back else ''}"
        text = "lines of six motions of sun, carrier, ring and casing, largest difference over the largest line"
        rows.append(at_most(name, IN_TIME, text, 1e-6, apart))
    return rows


@dataclass(frozen=True)
class _MeshesInTime:
    """Meshes of a set in axes at rest, whose flanks part.

    Parameters
    ----------
    waves : (3, R, n) array
        Approaches of M meshes, then of springs, per unit of the coordinates: mean, cosine and sine of the carrier.
    speed : float
        Of the carrier, positive [rad/s].
    frequency : (M,) array
        Of the meshes [rad/s].
    lines : list of (M, 3) arrays
        Harmonics of stiffness, deflection and force, over the number of positions.
    """

    waves: np.ndarray
    speed: float
    frequency: np.ndarray
    lines: list[np.ndarray]

    def rows(self, time: float) -> np.ndarray:
        """Approaches (R, n) at an instant."""
        turn = self.speed * time
        return self.waves[0] + math.cos(turn) * self.waves[1] + math.sin(turn) * self.waves[2]

    def forces(self, time: float, rows: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Forces (M,) of the meshes at coordinates q [N]."""
        phase = np.exp(1j * np.outer(self.frequency, [1.0, 2.0]) * time)
        k, gap, force = (np.real(line[:, 0] + 2.0 * (line[:, 1:] * phase).sum(axis=1)) for line in self.lines)
        return np.maximum(force + k * (rows[: len(k)] @ q - gap), 0.0)


def parting_set(*, back: bool) -> tuple[Deflection, RunningSet, NonlinearGearbox]:
    """Loaded state of the set, its planets, and the set with flanks that wave so much that they part."""
    state = solve_deflection(read_case(bending_set(ANGLE, back=back)))
    excitations = {stage.name: pair_count_excitation(state.model, stage) for stage in state.model.stages}
    for name, record in excitations.items():
        theta = 2.0 * math.pi * np.arange(record.stiffness.shape[1]) / record.stiffness.shape[1]
        excitations[name] = replace(record, deflection=record.deflection + 1.4e-5 * np.cos(theta))
    (running,) = running_sets(state.model.case)
    return state, running, nonlinear_gearbox(state, excitations, harmonics=2, damping_ratio=0.0)


def apart_at_rest(*, back: bool) -> tuple[float, float]:
    """Difference of the motion in axes at rest over the motion, and share of time in which flanks are apart."""
    deflected, running, box = parting_set(back=back)
    model, planets, (assembly, _, _) = deflected.model, planet_stations(deflected, running), linear_system(deflected)
    T, speed, system = box.motion, model.flow.speed["carrier"], box.problem.system
    around = turning_planets(model, model.stages)["sun 0"]
    of_planets = replace(
        assembly, inertias=tuple(inertia for inertia in assembly.inertias if planets.issuperset(inertia.stations))
    )
    pull = T.T @ centrifugal_pull(assembly, around, of_planets.mass) @ T
    still = np.array([not name.startswith("p") for name in system.dofs])
    damping = BY_MASS * np.where(still[:, None] & still, system.M, 0.0)
    problem = replace(box.problem, system=replace(system, K=system.K - pull, C=system.C + damping))
    start = np.linalg.lstsq(T, deflected.motion, rcond=None)[0]
    times = np.linspace(0.0, 0.05 * 2.0 * math.pi / abs(speed), 200)
    options = {"start": (start, 0.0 * start), "method": "DOP853", "tolerance": 1e-10}
    motion = solve_transient(problem, box.frequency, times, **options).displacement.T
    springs = tuple(spring for spring in assembly.springs if planets.isdisjoint(spring.stations))
    C, K = damping + T.T @ assembly.gyroscopic @ T, T.T @ replace(assembly, springs=springs).stiffness @ T
    inverse, load = np.linalg.inv(T.T @ assembly.mass @ T), T.T @ model.load
    bearings = np.concatenate([np.diag(deflected.bearing_stiffness[n]) for numbers in running.pins for n in numbers])
    meshes = _meshes_in_time(deflected, running, box, back=back)

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        q, v = np.split(state, 2)
        rows = meshes.rows(time)
        force = np.append(meshes.forces(time, rows, q), bearings * (rows[len(meshes.frequency) :] @ q))
        return np.concatenate([v, inverse @ (load - K @ q - C @ v - rows.T @ force)])

    turned = np.linalg.lstsq(T, speed * wave_generator(around, len(T)) @ T @ start, rcond=None)[0]
    begin = np.concatenate([start, turned])
    twin = solve_ivp(rate, times[[0, -1]], begin, method="DOP853", t_eval=times, rtol=1e-10, atol=1e-16).y[: len(start)]
    forces = [meshes.forces(time, meshes.rows(time), q) for time, q in zip(times, twin.T, strict=True)]
    apart = np.abs(motion - twin)[still].max() / np.abs(twin - twin[:, :1])[still].max()
    return float(apart), float(np.mean(np.equal(forces, 0.0)))


def _meshes_in_time(state: Deflection, running: RunningSet, box: NonlinearGearbox, *, back: bool) -> _MeshesInTime:
    """Meshes of the set, those of the sun first, by the coordinates of the nonlinear gearbox."""
    speed = state.model.flow.speed["carrier"]
    rows = _turning_rows(state, running, "sun", 1 if speed > 0.0 else -1, back=back)
    a, b, c = (rows(angle) @ box.motion for angle in (0.0, 0.5 * math.pi, math.pi))
    mean, records = 0.5 * (a + c), [stage.excitation for stage in box.stages]
    lines = [
        np.array([np.fft.rfft(getattr(record, name)[0])[:3] / record.stiffness.shape[1] for record in records])
        for name in ("stiffness", "deflection", "force")
    ]
    frequency = box.frequency[[stage.mesh_base for stage in box.stages]]
    return _MeshesInTime(np.stack([mean, 0.5 * (a - c), b - mean]), abs(speed), frequency, lines)


def bending_in_time() -> list[Row]:
    """Stepped planets that bend, all meshes at once, in time: coordinates that go round, and axes at rest."""
    rows = list[Row]()
    for back in (False, True):
        apart, parted = apart_at_rest(back=back)
        assert parted > 0.0
        name = f"stepped 11/16/8/35 that bends, teeth part{', backwards' if back else ''}"
        text = "motions of sun, carrier, ring and casing, largest difference over the largest motion"
        rows.append(at_most(name, "time integration, SciPy's DOP853, in axes at rest", text, 1e-6, apart))
    return rows
