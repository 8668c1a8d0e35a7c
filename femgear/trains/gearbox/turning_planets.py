"""Planets that go round with their carrier, in coordinates in which all but the directions of meshes stands still.

Planets of a `[[planetary]]` stage, or branches of planets that are shafts: one or several stations each. Stations that
follow one another around the carrier have the waves of `femgear.system.turning_meshes` together. Of a turning planet
the Coriolis terms count, and the centrifugal ones with the pull of its pin, which turns with the carrier.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femgear.fe.beam import rigid_link
from femgear.system.assembly import GROUND, Assembly
from femgear.system.turning_meshes import TurningDirections, planet_wave_generator, planet_waves, turned_row
from femgear.trains.gearbox.carrier import pin_axes
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.model import GearboxModel, StageModel
from femgear.trains.gearbox.planet_branches import RunningSet, running_sets
from femgear.trains.gearbox.running_branches import branch_stations

_TURNING = np.kron(np.eye(2), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
"""Time derivative of the axes of a planet at unit speed of its carrier, ``e_r' = e_t``."""
_WAVED = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""Motions of planets that are waves around the carrier: pins do not hold rotations, which stay those of the planets."""


@dataclass(frozen=True)
class TurningPlanets:
    """Planets that go round with a carrier, branch by branch.

    Parameters
    ----------
    name : str
        Of the motion of their carrier.
    speed : float
        Of the carrier [rad/s].
    axis : (2,) array
        Of the carrier [m].
    angles : tuple of float
        Of the N branches where the carrier stood [rad].
    stations : (N, S) int array
        Of the planets of every branch, in one order.
    holders : tuple of int
        Station of the carrier that holds every branch.
    pins : tuple of int
        Stations of the pins of an elastic carrier, else empty.
    kinds : tuple of tuple of int
        Numbers of the meshes of every kind, branch by branch.
    bearings : (N, B) int array
        Numbers of the bearings of planets that are shafts.
    branches : RunningSet or None
        Of planets that are shafts.
    """

    name: str
    speed: float
    axis: np.ndarray
    angles: tuple[float, ...]
    stations: np.ndarray
    holders: tuple[int, ...]
    pins: tuple[int, ...]
    kinds: tuple[tuple[int, ...], ...]
    bearings: np.ndarray
    branches: RunningSet | None = None

    @property
    def axes(self) -> list[np.ndarray]:
        """Radial, tangential and z axes (6, 6) of displacements and rotations, branch by branch."""
        return [np.kron(np.eye(2), pin_axes(psi)) for psi in self.angles]

    def kind_of(self, mesh: int) -> tuple[int, ...]:
        """Numbers of all meshes of the kind of a mesh."""
        return next(kind for kind in self.kinds if mesh in kind)


def turning_planets(model: GearboxModel, stages: Sequence[StageModel]) -> dict[str, TurningPlanets]:
    """Find the planets that go round of stages, by the names of these; a pair has those of its carrier."""
    of_stages = {stage.name: planets for stage in stages if (planets := planets_of_stage(model, stage)) is not None}
    meshes = {stage.name: stage.meshes[0] for stage in model.stages}
    for running in running_sets(model.case):
        first = running.branches[0]
        speed = model.flow.speed[first.carrier]
        if not speed:
            continue
        springs = [model.bearings[numbers[0]] for numbers in running.pins]
        stations = np.array([branch_stations(model, branch.planets) for branch in running.branches])
        holders = [next(at for at in pin.stations if at not in stations) for pin in springs]
        axis = np.asarray(model.case.shaft_named(first.carrier).axis)
        kinds = tuple(tuple(meshes[name] for name in names) for names in running.kinds)
        around = TurningPlanets(
            f"{first.carrier} turn",
            speed,
            axis,
            running.angles,
            stations,
            tuple(holders),
            (),
            kinds,
            np.array(running.pins),
            running,
        )
        names = {name for kind in running.kinds for name in kind}
        of_stages |= {stage.name: around for stage in stages if stage.name in names}
    return of_stages


def planets_of_stage(model: GearboxModel, stage: StageModel) -> TurningPlanets | None:
    """Planets of a planetary stage whose carrier turns."""
    section = stage.section
    if not isinstance(section, BoxPlanetarySection) or section.carrier == CASING:
        return None
    speed = model.flow.speed[section.carrier]
    if not speed:
        return None
    first = np.array([math.cos(stage.angles[0]), math.sin(stage.angles[0])])
    axis = model.assembly.places[stage.planets[0]][:2] - stage.sizes.centre_distance * first
    elastic, count = stage.elastic_carrier, len(stage.planets)
    pins = elastic.stations[1:] if elastic else ()
    return TurningPlanets(
        f"{stage.name} carrier",
        speed,
        axis,
        tuple(stage.angles),
        np.array(stage.planets)[:, None],
        pins or (stage.members[1],) * count,
        pins,
        tuple(tuple(kind) for kind in np.reshape(stage.meshes, (-1, count)).tolist()),
        np.zeros((count, 0), int),
    )


def turning_rows(
    assembly: Assembly, planets: TurningPlanets, meshes: Sequence[int], rows: Sequence[np.ndarray]
) -> TurningDirections:
    """Spread approaches (2, 6) of both gears of meshes over all motions (6s,), as they turn with the carrier.

    CaseError: planets that are not equally spaced, or two (E-TURNING).
    """
    parts, waves = np.zeros((3, len(rows), assembly.count)), planet_waves(planets.angles)
    for i, (mesh, row) in enumerate(zip(meshes, rows, strict=True)):
        for station, effect in zip(assembly.contacts[mesh].stations, row, strict=True):
            if station == GROUND:
                continue
            at = 6 * station + np.arange(6)
            if station in planets.stations:
                parts[:, i] += _of_planet(planets, station, effect, waves, assembly.count)
                continue
            beside = np.append(planets.axis - assembly.places[station][:2], 0.0)
            # the row turns about the axis of the carrier
            there = effect @ rigid_link(-beside)
            turned = turned_row(there)
            lateral = -turned_row(turned)
            for part, value in zip(parts, (there - lateral, lateral, turned), strict=True):
                part[i, at] += value @ rigid_link(beside)
    return TurningDirections(*parts)


def _of_planet(
    planets: TurningPlanets, station: int, effect: np.ndarray, waves: TurningDirections, count: int
) -> np.ndarray:
    """Approach (3, 6s) by the motions of all planets of a row (6,) of one of them: fixed, even and odd part."""
    parts, axes = np.zeros((3, count)), planets.axes
    ((branch, place),) = np.argwhere(planets.stations == station)
    along = axes[branch] @ effect
    for other, there in enumerate(planets.stations[:, place]):
        for part, wave in zip(parts, (waves.fixed, waves.even, waves.odd), strict=True):
            part[6 * there : 6 * there + 6] += wave[branch, other] * (_WAVED @ along) @ axes[other]
    parts[0, 6 * station + 5] += along[5]
    return parts


def turning_terms(
    assembly: Assembly, turning: Iterable[TurningPlanets], *, gyroscopic: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Gyroscopic and Coriolis terms (6s, 6s) beside the damping, and centrifugal ones beside the stiffness."""
    velocity = assembly.gyroscopic if gyroscopic else np.zeros((assembly.count, assembly.count))
    displacement = np.zeros_like(velocity)
    for planets in turning:
        Z, speed = wave_generator(planets, assembly.count), planets.speed
        planets_alone = replace(
            assembly,
            inertias=tuple(inertia for inertia in assembly.inertias if inertia.stations[0] in planets.stations),
        )
        mass = assembly.mass
        displacement += speed**2 * Z @ planets_alone.mass @ Z + centrifugal_pull(assembly, planets, planets_alone.mass)
        if gyroscopic:
            turned = speed * planets_alone.gyroscopic @ Z
            displacement += 0.5 * (turned + turned.T)
        velocity = velocity + speed * (mass @ Z + Z @ mass)
    return velocity, displacement


def wave_generator(planets: TurningPlanets, count: int) -> np.ndarray:
    """Compute the rate of change (6s, 6s) of motions of planets and pins by the turn of their carrier at unit speed."""
    gamma, axes = planet_wave_generator(planets.angles), planets.axes
    Z = np.zeros((count, count))
    columns = [(stations, _WAVED) for stations in planets.stations.T.tolist()]
    for stations, waved in (*columns, (planets.pins, np.eye(6))):
        for j, first in enumerate(stations):
            for k, second in enumerate(stations):
                rate = gamma[j, k] * waved + (_TURNING if j == k else 0.0)
                Z[6 * first : 6 * first + 6, 6 * second : 6 * second + 6] = axes[j].T @ rate @ axes[k]
    return Z


def centrifugal_pull(assembly: Assembly, planets: TurningPlanets, mass: np.ndarray) -> np.ndarray:
    """Compute the stiffness (6s, 6s) of the pull of the pins on turning planets, which turns with the carrier.

    ``mass`` (6s, 6s) [kg], [kg m], [kg m^2] is that of all stations.

    Of the pull ``F = m r speed^2`` at a station ``r`` from the axis, displaced by x, the turn phi of the carrier that
    holds it has the energy ``(phi x F) . x - (phi x F) . (phi x r)/2``: along the radius a ``F (phi_z x_t - phi_t x_z)
    - F a (phi_z^2 + phi_t^2)/2``. Moments that the mass of a shaft takes at its stations turn with it about z.
    """
    stiffness = np.zeros_like(mass)
    for stations, holder in zip(planets.stations.tolist(), planets.holders, strict=True):
        turn = 6 * holder + np.arange(3, 6)
        outwards = np.zeros(len(mass))
        for station in stations:
            outwards[6 * station : 6 * station + 2] = assembly.places[station][:2] - planets.axis
        pull = planets.speed**2 * mass @ outwards
        for station in stations:
            shift, tilt = 6 * station + np.arange(3), 6 * station + np.arange(3, 6)
            pulled, moved = _cross(pull[shift]), _cross(outwards[shift])
            stiffness[np.ix_(shift, turn)] -= pulled
            stiffness[np.ix_(turn, shift)] -= pulled.T
            stiffness[np.ix_(turn, turn)] -= pulled.T @ moved
            about_z = _cross(pull[tilt])[:, 2]
            stiffness[tilt, turn[2]] -= about_z
            stiffness[turn[2], tilt] -= about_z
    return stiffness


def _cross(vector: np.ndarray) -> np.ndarray:
    """Matrix (3, 3) of ``vector x``."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def pin_changes(state: Deflection, planets: TurningPlanets) -> dict[int, np.ndarray]:
    """What has to be added to the stiffness (6, 6) of bearings, by number, for the mean of all branches [N/m, N m/rad].

    Where planets stand, weight and bending shafts may press their bearings unequally.
    """
    changes, axes = dict[int, np.ndarray](), planets.axes
    for numbers in planets.bearings.T.tolist():
        tangents = [np.where(np.isinf(state.bearing_stiffness[n]), 0.0, state.bearing_stiffness[n]) for n in numbers]
        along = [turned @ tangent @ turned.T for turned, tangent in zip(axes, tangents, strict=True)]
        mean = np.mean(along, axis=0)
        for number, turned, tangent in zip(numbers, axes, tangents, strict=True):
            changes[number] = turned.T @ mean @ turned - tangent
    return changes
