"""One stage of a gearbox and the structure of all the rest, as the response takes them.

The structure is the gearbox about its loaded state without the meshes of the stage and, of a planetary one, without
planets and pins: shafts, bearings, casing, the meshes of the other stages with their mean stiffness, the planets of
these where they are. Planets of the stage run around in it (`femgear.housing.two_way.running_planets`).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.contact.cycle import CycleOptions
from femgear.contact.loaded_period import loaded_period
from femgear.fe.beam import rigid_link
from femgear.gears.deviations import rotational_symmetry
from femgear.gears.profile import base_helix_angle
from femgear.housing.two_way.carrier_orders import MeshPaths, mean_excitation
from femgear.housing.two_way.running_planets import RING, RubbingPoints, RunningStage
from femgear.solvers.linear.modal import undamped_modes
from femgear.stages.friction_source import friction_on_meshes
from femgear.stages.static import over_width, record_positions, static_supports
from femgear.system.assembly import GROUND, Assembly, Contact, Inertia
from femgear.system.system import MechanicalSystem, MeshExcitation, Modes
from femgear.trains.gearbox.carrier import pin_axes, pin_compliance
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection, teeth_of
from femgear.trains.gearbox.contact import StageContact
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.elastic_carrier import pin_flexibility
from femgear.trains.gearbox.elastic_ring import ElasticRing, stage_centre, with_rings
from femgear.trains.gearbox.geometry import set_sizes
from femgear.trains.gearbox.model import GearboxModel, StageModel, planet_bearing
from femgear.trains.gearbox.modes import linear_system, spring_forces
from femgear.trains.gearbox.sensors import BoxSensor

_RECORD = 2**13
"""Positions of the excitation in the mesh period; of sets the next multiple of their planets."""
Row = list[tuple[int, np.ndarray]]
"""Stations of the structure, each with the approach (6,) of a contact point per unit of its motions [1, m]."""
_TURNING = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def stage_excitation(
    contact: StageContact, friction: tuple[float, ...] | None = None, *, steps: Steps | None = None
) -> MeshExcitation:
    """Compute mesh stiffness, deflection and force of the teeth of a stage along their normals over a mesh period.

    As time goes on where gear 1, or the sun against its carrier, turns counter-clockwise.

    Parameters
    ----------
    contact : StageContact
        Of the loaded state.
    friction : tuple of float, optional
        Coefficients of friction, see `femgear.trains.gearbox.friction.stage_friction`; its forces are the sources.
    steps : Steps, optional
        What other computations of the stage have left.
    """
    case, static, steps = contact.case, contact.result, steps or Steps()
    moved = contact.deviations.planet_misalignment, contact.deviations.pin_errors
    cache_key = {"teeth": case.source, "moved": tuple(np.concatenate([part.ravel() for part in moved]).tolist())}
    cache_key |= {"friction": friction}
    if (kept := steps.kept("excitation of a stage", cache_key)) is not None:
        return kept
    gears = static.planetary_set
    slices = over_width(case, gears, waves=static.waves, steps=steps)
    if slices:
        slices |= {"held_waves": slices["waves"]}
    state = loaded_period(
        gears,
        static.bodies,
        static.bodies,
        sun_torque=static.sun_torque,
        positions=record_positions(case, gears),
        contact=case.static.contact,
        deviations=None if contact.deviations.ideal else contact.deviations,
        supports=static_supports(case),
        options=CycleOptions(friction=friction, **slices),
    )
    count = gears.n_planets * -(-_RECORD // gears.n_planets) * state.periods
    cosine = math.cos(base_helix_angle(case.pressure_angle, case.helix_angle or 0.0))
    stiffness, deflection, force = (state.resampled(name, count) for name in ("stiffness", "deflection", "force"))
    play = np.zeros(len(force))
    transverse = MeshExcitation(stiffness, deflection, force, play, state.periods, friction_on_meshes(state, count))
    return steps.keep("excitation of a stage", cache_key, transverse.along_normal(cosine))


@dataclass(frozen=True)
class Orbit:
    """The circle that planets run on: ``angle`` of the first one [rad], ``centre`` (3,) of the carrier [m]."""

    angle: float
    centre: np.ndarray


@dataclass(frozen=True)
class RingInStructure:
    """An elastic ring in the structure of a stage.

    Parameters
    ----------
    ring : ElasticRing
        With the coordinates that are in the structure.
    coordinates : (r, m) array
        By the modes of the structure [1].
    force : (6n, m) array
        What its meshes do to all motions by these modes [N kg^-1/2]; zero of the stage that is taken out.
    """

    ring: ElasticRing
    coordinates: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class StructuredStage:
    """A stage, and the structure that it runs in.

    Parameters
    ----------
    running : RunningStage
        Planets and meshes, and the modes of the structure.
    motion : (6n, m) array
        Motions of all stations by these modes [kg^-1/2].
    rows : tuple of Row
        Of every contact point of the first planet, then of those of its friction: what it does to the structure.
    of_meshes : (C + F,) bool array
        Whether these belong to meshes; the others are those of its pin.
    rings : tuple of RingInStructure
        Elastic rings in the structure: of other stages, and of its own ring what moves with the casing.
    orbit : Orbit or None
        Of the planets; None of a pair.
    """

    running: RunningStage
    motion: np.ndarray
    rows: tuple[Row, ...]
    of_meshes: np.ndarray
    rings: tuple[RingInStructure, ...] = ()
    orbit: Orbit | None = None

    def at_sensors(self, rows: np.ndarray, sensors: Sequence[BoxSensor]) -> np.ndarray:
        """Displacements (s, m) of sensors by the modes, of which all motions make those by the rows (s, 6n)."""
        return rows @ self.motion + sum(part.ring.sensor_rows(sensors) @ part.coordinates for part in self.rings)


def running_stage(
    state: Deflection, stage: StageModel, excitation: MeshExcitation, rings: Sequence[ElasticRing] = ()
) -> StructuredStage:
    """Take a stage out of a gearbox: its planets and meshes, and the modes of the structure without it.

    Parameters
    ----------
    state : Deflection
        Loaded state of the gearbox.
    stage : StageModel
        With teeth.
    excitation : MeshExcitation
        See `stage_excitation`; with an elastic ring that of `ElasticRing`.
    rings : sequence of ElasticRing
        Of all stages that have one.
    """
    ring = next((ring for ring in rings if ring.stage.name == stage.name), None)
    joined = tuple(other.with_structure if other is ring else other for other in rings)
    modes, motion, inner = structure_modes(state, structure_without(state, stage, joined), joined)
    damping = state.model.case.modes.damping_ratio
    section = stage.section
    planetary = isinstance(section, BoxPlanetarySection)
    rows, stiffness, points = _mesh_rows(state, stage)
    excitation, paths, sense = in_time(state.model, stage, excitation)
    mean = excitation.stiffness.mean(axis=1)
    kinds = len(mean) // max(len(stage.planets), 1)
    stiffness[:kinds] = mean.reshape(kinds, -1).mean(axis=1)
    mass, gyroscopic, turning = np.zeros((3, 6, 6))
    flexibility, free, of_meshes = None, np.zeros(0, int), [True] * len(rows)
    if planetary:
        first = 6 * stage.planets[0]
        free = np.flatnonzero(~state.model.assembly.held[first : first + 6])
        used = free[planet_bearing(section)[free] > 0.0]
        pins, springs, flexibility = _pin_rows(state.model, stage, used, len(rows))
        rows, stiffness, of_meshes = [*rows, *pins], np.append(stiffness, springs), of_meshes + [False] * len(pins)
        points = np.vstack([points, np.eye(6)[used]])
        mass, gyroscopic, turning = _planet(state.model, stage)
    orbit = _orbit(stage, state.model.assembly.places)
    shape = np.array([shape_waves(row, orbit, motion, state.model.assembly.places) for row in rows])
    waves, rubbing = None, None
    if excitation.source is not None:
        rubbed, sliding = rubbing_rows(state, stage)
        of_friction = np.array([shape_waves(row, orbit, motion, state.model.assembly.places) for row in rubbed])
        rows, of_meshes = [*rows, *rubbed], of_meshes + [True] * len(rubbed)
        rubbing = RubbingPoints(of_friction, sliding.T[free])
    if ring is not None:
        flexibility = _with_bodies(flexibility, ring.flexibility, len(stage.planets), len(stiffness))
        waves = ring.running(2.0 * damping)
        of_stage = next(part for part in inner if part.ring.stage is stage)
        shape[RING] += _ring_waves(of_stage.ring, of_stage.ring.wave, of_stage.coordinates)
        if rubbing is not None:
            for at, sliding in zip((RING, kinds + RING), of_stage.ring.sliding.T, strict=True):
                of_friction[at] += _ring_waves(of_stage.ring, sliding, of_stage.coordinates)
            rubbing = RubbingPoints(of_friction, rubbing.approach)
    running = RunningStage(
        2.0 * math.pi * modes.frequency,
        np.zeros(len(modes.frequency)),
        shape,
        mass[np.ix_(free, free)],
        gyroscopic[np.ix_(free, free)],
        turning[np.ix_(free, free)],
        points.T[free],
        stiffness,
        np.full(len(stiffness), 2.0 * damping),
        excitation,
        paths,
        sense,
        structure_loss=2.0 * damping,
        flexibility=flexibility,
        ring=waves,
        rubbing=rubbing,
    )
    return StructuredStage(running, motion, tuple(rows), np.array(of_meshes), inner, orbit)


def _orbit(stage: StageModel, places: np.ndarray) -> Orbit | None:
    """Circle of the planets of a stage; None of a pair."""
    return Orbit(stage.angles[0], stage_centre(stage, places)) if stage.planets else None


def structure_modes(
    state: Deflection, structure: tuple[Assembly, MechanicalSystem, np.ndarray], joined: Sequence[ElasticRing]
) -> tuple[Modes, np.ndarray, tuple[RingInStructure, ...]]:
    """Modes of a structure, the motions (6n, m) of all stations by them [kg^-1/2], and elastic rings in it.

    The structure is that of `structure_apart`, with the coordinates of the rings.
    """
    assembly, system, slices = structure
    modes = undamped_modes(system, slices, damping_ratio=0.0)
    count = assembly.motions.shape[1]
    motion, inner = assembly.motions @ modes.shape[:count], list[RingInStructure]()
    pressed = spring_forces(system, slices, modes.shape)
    for other in joined:
        names = {state.model.assembly.contacts[mesh].name for mesh in other.stage.meshes}
        ours = [part for part, contact in zip(assembly.slices, assembly.contacts, strict=True) if contact.name in names]
        pushed = -sum((assembly.columns[:, part] @ pressed[part] for part in ours), np.zeros_like(motion))
        inner.append(RingInStructure(other, modes.shape[count : count + len(other.stiffness)], pushed))
        count += len(other.stiffness)
    return modes, motion, tuple(inner)


def _ring_waves(ring: ElasticRing, wave: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Approach or sliding (3, m), ``wave`` (r,) by the coordinates of the ring, by modes that have these (r, m).

    Wave by wave from -1 to 1.
    """
    waves = np.zeros((3, inner.shape[1]), complex)
    for n in (0, 1):
        wave_of_body = wave[ring.diameter == n] @ inner[ring.diameter == n]
        waves[1 + n] += wave_of_body if n == 0 else 0.5 * wave_of_body
        if n:
            # the coordinates are real
            waves[1 - n] += 0.5 * wave[ring.diameter == n].conj() @ inner[ring.diameter == n]
    return waves


def _with_bodies(flexibility: np.ndarray | None, between: np.ndarray, planets: int, springs: int) -> np.ndarray | None:
    """Add the compliance (2N, 2N) of the bodies between the meshes to that (N, C, N, C) of the springs [m/N]."""
    if not between.any():
        return flexibility
    whole = np.zeros((planets, springs, planets, springs)) if flexibility is None else flexibility.copy()
    whole[:, :2, :, :2] += between.reshape(2, planets, 2, planets).transpose(1, 0, 3, 2)
    return whole


def structure_without(
    state: Deflection, stage: StageModel, rings: Sequence[ElasticRing] = ()
) -> tuple[Assembly, MechanicalSystem, np.ndarray]:
    """Take planets, pins and meshes of a stage out of the linear gearbox; stiffness (g,) of the slices left [N/m].

    Coordinates of elastic ``rings`` follow those of the assembly.
    """
    carrier = stage.elastic_carrier
    gone = {*stage.planets, *(carrier.stations[1:] if carrier else ())}
    rigid = [_rigid_carrier(state.model, stage)] if carrier is not None and carrier.stations[0] != GROUND else []
    return structure_apart(state, gone, stage.meshes, rings, rigid)


def structure_apart(
    state: Deflection,
    gone: Set[int],
    meshes: Collection[int],
    rings: Sequence[ElasticRing] = (),
    added: Sequence[Inertia] = (),
) -> tuple[Assembly, MechanicalSystem, np.ndarray]:
    """Take stations, all that acts on them, and meshes out of the linear gearbox; stiffness (g,) of what is left [N/m].

    Parameters
    ----------
    state : Deflection
        Loaded state.
    gone, meshes : set and collection of int
        Numbers of stations and of contacts.
    rings : sequence of ElasticRing
        Whose coordinates follow those of the assembly.
    added : sequence of Inertia
        In the place of what is gone.
    """
    assembly, _, stiffness = linear_system(state)
    held = assembly.held.copy()
    for station in gone:
        held[6 * station : 6 * station + 6] = True
    kept = np.concatenate([np.full(part.stop - part.start, i not in meshes) for i, part in enumerate(assembly.slices)])
    rest = replace(
        assembly,
        held=held,
        inertias=(*(inertia for inertia in assembly.inertias if gone.isdisjoint(inertia.stations)), *added),
        beams=tuple(beam for beam in assembly.beams if gone.isdisjoint(beam.stations)),
        springs=tuple(spring for spring in assembly.springs if gone.isdisjoint(spring.stations)),
        contacts=tuple(contact for i, contact in enumerate(assembly.contacts) if i not in meshes),
    )
    system, first, slices = rest.system(), 0, dict[int, slice]()
    for number, part in enumerate(assembly.slices):
        if number not in meshes:
            slices[number] = slice(first, first + part.stop - part.start)
            first = slices[number].stop
    return rest, *with_rings(replace(system, gyroscopic=None), stiffness[kept], rest, slices, rings)


def _rigid_carrier(model: GearboxModel, stage: StageModel) -> Inertia:
    """Carrier of a file as a rigid body on its shaft: its pins run around."""
    carrier = stage.elastic_carrier
    assert carrier is not None
    hub = model.assembly.places[carrier.stations[0]]
    rigid = np.vstack([np.eye(6), *(rigid_link(model.assembly.places[pin] - hub) for pin in carrier.stations[1:])])
    polar = carrier.gyroscopic[:6, :6]
    return Inertia(carrier.stations[:1], rigid.T @ carrier.mass @ rigid, polar)


def _mesh_rows(state: Deflection, stage: StageModel) -> tuple[list[Row], np.ndarray, np.ndarray]:
    """Springs of the leading meshes: what they do to the structure, stiffness, and approach (.., 6) of the planet.

    First the approach of the flanks along the normal, then the slope of the approach along the width, of each mesh
    that has slices. The former is that of all slices by their stiffness. Axes of the planet are radial, tangential, z.
    """
    assembly, _, tangents = linear_system(state)
    stiffness = equal_planets(assembly, stage.meshes, max(len(stage.planets), 1), tangents)
    count = max(len(stage.planets), 1)
    approach, slope = [], []
    axes = np.kron(np.eye(2), pin_axes(stage.angles[0])) if stage.planets else np.eye(6)
    for mesh in stage.meshes[::count]:
        contact = assembly.contacts[mesh]
        springs = springs_of_mesh(contact, stiffness[assembly.slices[mesh]])
        for kept, (rows, value) in zip((approach, slope), springs, strict=True):
            if value > 0.0:
                kept.append((contact.stations, rows, value))
    rows, points, springs = list[Row](), [], []
    for stations, effect, value in (*approach, *slope):
        parts = [(station, row) for station, row in zip(stations, effect, strict=True) if station != GROUND]
        planet = [row for station, row in parts if station in stage.planets]
        rows.append([(station, row) for station, row in parts if station not in stage.planets])
        points.append(axes @ planet[0] if planet else np.zeros(6))
        springs.append(value)
    return rows, np.array(springs), np.array(points)


def springs_of_mesh(
    contact: Contact, stiffness: np.ndarray
) -> tuple[tuple[np.ndarray, float], tuple[np.ndarray, float]]:
    """Springs of a mesh by the stiffness (S,) of its slices: of their approach, and of its slope along the width.

    Rows (2, 6) by the motions of both stations, and stiffness [N/m, N m/rad].
    """
    weight = stiffness / stiffness.sum()
    mean = np.einsum("s,gsm->gm", weight, contact.approach)
    height = contact.heights - weight @ contact.heights
    tilt = np.zeros_like(mean)
    if len(stiffness) > 1:
        tilt = (contact.approach[:, -1] - contact.approach[:, 0]) / (contact.heights[-1] - contact.heights[0])
    return (mean, float(stiffness.sum())), (tilt, float(stiffness @ height**2))


def rubbing_rows(state: Deflection, stage: StageModel) -> tuple[list[Row], np.ndarray]:
    """Find the points at which friction of the leading meshes acts, along their tangents, then as couples.

    What they do to the structure, and sliding (F, 6) of the planet along its radial, tangential and z axes: that of all
    slices by their stiffness.
    """
    assembly, _, tangents = linear_system(state)
    stiffness = equal_planets(assembly, stage.meshes, max(len(stage.planets), 1), tangents)
    axes = np.kron(np.eye(2), pin_axes(stage.angles[0])) if stage.planets else np.eye(6)
    rows, of_planet = list[Row](), list[np.ndarray]()
    for kind in (0, 1):
        for mesh in stage.meshes[:: max(len(stage.planets), 1)]:
            contact, k = assembly.contacts[mesh], stiffness[assembly.slices[mesh]]
            sliding = np.einsum("s,gsm->gm", k / k.sum(), contact.sliding[kind])
            parts = [(station, row) for station, row in zip(contact.stations, sliding, strict=True)]
            rows.append([(at, row) for at, row in parts if at != GROUND and at not in stage.planets])
            of_planet += [sum((axes @ row for at, row in parts if at in stage.planets), np.zeros(6))]
    return rows, np.array(of_planet)


def equal_planets(assembly: Assembly, meshes: Sequence[int], planets: int, stiffness: np.ndarray) -> np.ndarray:
    """Give every slice of meshes, kind by kind, the mean of the planets, one after the other stands there.

    ``stiffness`` (g,) [N/m] is that of all slices; its means (g,) are returned. Where planets stand, some slices may
    carry nothing, as weight and bending shafts have it.
    """
    averaged = stiffness.copy()
    for alike in np.reshape(meshes, (-1, planets)):
        slices = [assembly.slices[mesh] for mesh in alike]
        mean = np.mean([stiffness[part] for part in slices], axis=0)
        for part in slices:
            averaged[part] = mean
    return averaged


def _pin_rows(
    model: GearboxModel, stage: StageModel, used: np.ndarray, meshes: int
) -> tuple[list[Row], np.ndarray, np.ndarray | None]:
    """Springs of the pin of the first planet on the carrier: rows, stiffness, and compliance of all pins.

    Of the motions ``used`` that the pin holds, behind so many springs of the meshes.
    """
    section: Any = stage.section
    bearing = planet_bearing(section)
    seat = model.seat(section.carrier, section.seat_position) if section.carrier != CASING else None
    holder = GROUND if seat is None else seat.station
    if stage.elastic_carrier is not None:
        holder = stage.elastic_carrier.stations[0]
    along = np.kron(np.eye(2), pin_axes(stage.angles[0]))
    rows: list[Row] = [[] for _ in used]
    if holder != GROUND:
        offset = model.assembly.places[stage.planets[0]] - model.assembly.places[holder]
        effect = -along @ rigid_link(offset)
        rows = [[(holder, effect[way])] for way in used]
    compliance = None
    if stage.elastic_carrier is not None:
        compliance = pin_flexibility(section, stage.angles)
    elif section.pins is not None:
        compliance = pin_compliance(model.case, section, stage.angles)
    if compliance is None:
        return rows, bearing[used], None
    count, size = len(stage.planets), meshes + len(used)
    turned = np.asarray(block_diag(*(np.kron(np.eye(2), pin_axes(psi)) for psi in stage.angles)))
    whole = (turned @ compliance @ turned.T).reshape(count, 6, count, 6)
    flexibility = np.zeros((count, size, count, size))
    flexibility[:, meshes:, :, meshes:] = whole[:, used][:, :, :, used]
    return rows, bearing[used], flexibility


def row_waves(row: Row, orbit: Orbit | None, station: int, places: np.ndarray) -> np.ndarray:
    """Approach (W, 6) of a contact point by the motions of a station, as the planet runs around.

    Waves -1, 0, 1; of a pair 0 alone. ``places`` (n, 3) are those of all stations [m]. A station beside the axis of the
    stage, such as the centre of a casing, counts with the motions of the point on the axis: only these turn with the
    planet.
    """
    waves, effect = np.zeros((1 if orbit is None else 3, 6), complex), np.zeros(6)
    for place, part in row:
        effect = effect + part if place == station else effect
    if orbit is None:
        waves[0] = effect
        return waves
    beside = np.append((orbit.centre - places[station])[:2], 0.0)
    there, turn = effect @ rigid_link(-beside), np.exp(-1j * orbit.angle)
    waves[1, [2, 5]] = there[[2, 5]]
    for first in (0, 3):
        x, y = there[first : first + 2]
        # the row turns with the planet
        forward = 0.5 * turn * np.array([x + 1j * y, y - 1j * x])
        waves[2, first : first + 2] = forward
        waves[0, first : first + 2] = forward.conj()
    return waves @ rigid_link(beside)


def shape_waves(row: Row, orbit: Orbit | None, motion: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Compute waves (W, m) of the approach of a contact point by modes with motions (6n, m), as the planet runs around.

    ``places`` (n, 3) are those of all stations [m], waves as of `row_waves`.
    """
    shape = np.zeros((1 if orbit is None else 3, motion.shape[1]), complex)
    for station in {station for station, _ in row}:
        shape += row_waves(row, orbit, station, places) @ motion[6 * station : 6 * station + 6]
    return shape


def _planet(model: GearboxModel, stage: StageModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, gyroscopic and turning matrices (6, 6) of a planet along its own axes, see `RunningStage`."""
    station = stage.planets[0]
    parts = [inertia for inertia in model.assembly.inertias if inertia.stations == (station,)]
    mass, gyroscopic = sum(part.mass for part in parts), sum(part.gyroscopic for part in parts)
    frequency = 2.0 * math.pi * model.flow.mesh_frequency[stage.name]
    turning = np.asarray(block_diag(_TURNING, _TURNING))
    return np.asarray(mass), np.asarray(gyroscopic) / frequency, turning


def in_time(
    model: GearboxModel, stage: StageModel, excitation: MeshExcitation
) -> tuple[MeshExcitation, MeshPaths, int]:
    """Give an excitation as time goes on, the paths of its meshes, and the sense of the carrier.

    Planets that only the gearbox loads unequally are taken as equal, with the mean of all of them.
    """
    section, flow = stage.section, model.flow
    if not isinstance(section, BoxPlanetarySection):
        turns = flow.speed[section.shafts[0]] - flow.speed[section.carrier or CASING]
        return reversed_in_time(excitation, back=turns < 0.0), MeshPaths(1, (0.0,)), 1
    carrier = flow.speed[section.carrier] if section.carrier != CASING else 0.0
    sun = flow.speed[section.sun] if section.sun != CASING else 0.0
    ring = flow.speed[section.ring] if section.ring != CASING else 0.0
    excitation = reversed_in_time(excitation, back=sun < carrier)
    sense = -1 if carrier < 0.0 else 1
    teeth = stage.sizes.teeth[2] * sense * (1 if carrier > ring else -1)
    count = _alike(section, stage.angles)
    paths = MeshPaths(teeth, tuple(stage.angles), 0.0, count)
    if excitation.periods == 1 and count > 1:
        excitation = mean_excitation(excitation, paths, sense)
    return excitation, paths, sense


def _alike(section: BoxPlanetarySection, angles: Sequence[float]) -> int:
    """Largest number of turns that take every planet to the place of one like it."""
    case = teeth_of(section)
    if case is not None:
        return rotational_symmetry(set_deviations(case), planetary_set(case))
    places, sizes = np.exp(1j * np.asarray(angles)), set_sizes(section)
    # planets that do not assemble have phases of their own
    turned = {
        count: places[:, None] * np.exp(2j * np.pi / count)
        for count in range(1, len(places) + 1)
        if (sizes.teeth[0] + sizes.teeth[2]) % count == 0
    }
    return max(
        count for count, turned_places in turned.items() if np.abs(turned_places - places).min(axis=1).max() < 1e-6
    )


def reversed_in_time(excitation: MeshExcitation, *, back: bool) -> MeshExcitation:
    """Excitation of gears that turn the other way round."""
    if not back:
        return excitation
    arrays = {name: getattr(excitation, name) for name in ("stiffness", "deflection", "force", "source")}
    turned = {name: np.roll(record[:, ::-1], 1, axis=1) for name, record in arrays.items() if record is not None}
    return replace(excitation, **turned)
