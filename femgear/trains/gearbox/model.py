"""A gearbox as stations, beams, springs and meshes: shafts, bearings, stages, loads.

Planets stand at one angle of their carrier. Every planet is a station of its own, joined by its bearing to its
pin, a point of the carrier; a ring in the casing moves with it. Meshes are springs along the tooth normals, of
slices over the common width, which take up tilts as teeth do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from femgear.case.estimates import gear_cylinder
from femgear.case.gear_set import planetary_set
from femgear.case.sections import gear_material
from femgear.errors import CaseError
from femgear.fe.beam import BeamShaft, ShaftPart, beam_shaft, body_matrices, growth_load, rigid_link
from femgear.gears.iso6336_stiffness import pair_mesh_stiffness
from femgear.report.tables import merged_names
from femgear.system.assembly import GROUND, Assembly, Beam, Contact, Inertia, StationSprings, joint, mesh_normal
from femgear.trains.gearbox.carrier import pin_axes, pin_compliance, planet_springs
from femgear.trains.gearbox.case_file import (
    CASING,
    BoxBearingSection,
    BoxCasingSection,
    BoxPlanetarySection,
    GearboxCase,
    LoadCaseSection,
    PairSection,
    teeth_of,
)
from femgear.trains.gearbox.casing import CasingModel, bearing_name, casing_mass, casing_model
from femgear.trains.gearbox.casing_file import ElasticParts, elastic_casing_model
from femgear.trains.gearbox.elastic_carrier import ElasticCarrier, elastic_carrier
from femgear.trains.gearbox.geometry import StageSizes, carriers, pair_sizes, set_sizes
from femgear.trains.gearbox.power import BoxFlow, gearbox_flow

HELD = {"space": (), "plane": (2, 3, 4), "rotation": (0, 1, 2, 3, 4)}
"""Motions that do not take place, by ``motions`` of the case; planets move in their plane at any rate."""


@dataclass(frozen=True)
class Seat:
    """A place on a shaft: number of its ``station``, and the ``offset`` (3,) from there to the place [m]."""

    station: int
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class StageModel:
    """A stage in the model.

    Parameters
    ----------
    section : PairSection or BoxPlanetarySection
        Its entries.
    sizes : StageSizes
        Of its gears.
    meshes : tuple of int
        Numbers of its contacts: of a pair one; of a set those of the sun, then of the ring, planet by planet.
    flank : int
        1 where gear 1, or the sun, pushes counter-clockwise on its mate, else -1.
    members : tuple of int
        Stations of both gears, or of sun, carrier and ring (`GROUND` in the casing).
    planets : tuple of int
        Stations of the planets.
    angles : tuple of float
        Of the planets at the standing carrier [rad].
    width : float
        Common face width of the (narrowest) mesh [m]; zero where not given.
    elastic_carrier : ElasticCarrier or None
        Of a set whose carrier was read from a file.
    """

    section: PairSection | BoxPlanetarySection
    sizes: StageSizes
    meshes: tuple[int, ...]
    flank: int
    members: tuple[int, ...]
    planets: tuple[int, ...] = ()
    angles: tuple[float, ...] = ()
    width: float = 0.0
    elastic_carrier: ElasticCarrier | None = None

    @property
    def name(self) -> str:
        """Name of the stage."""
        return self.section.name


@dataclass(frozen=True)
class GearboxModel:
    """A gearbox ready for statics and modes.

    Parameters
    ----------
    case : GearboxCase
        What it was made of.
    flow : BoxFlow
        Speeds and torques of the load case.
    assembly : Assembly
        Stations, inertias, beams, springs and meshes; bearings of a kind are not among the springs.
    beams : mapping of str to BeamShaft
        By shaft; none of shafts that are one rigid body.
    first : mapping of str to int
        First station of every shaft.
    stages : tuple of StageModel
        Pairs, then planetary sets.
    bearings : tuple of StationSprings
        Of all bearings in their order: six rows of the inner ring's motion less that of the outer one.
    ports : mapping of str to Seat
        Where torques act.
    load : (6n,) array
        Torques, forces and weight on all motions [N, N m].
    turns : (k,) int array
        Motions whose speed is given, one for every way in which the gearbox turns.
    estimate : float
        Factor on the stiffness of bearings that are estimated.
    joints : tuple of StationSprings
        Springs of the assembly that are neither bearings nor feet: couplings, then pins, carriers and held shafts.
    casing : CasingModel or None
        Stations and feet of the casing; None where it stands still.
    """

    case: GearboxCase
    flow: BoxFlow
    assembly: Assembly
    beams: Mapping[str, BeamShaft]
    first: Mapping[str, int]
    stages: tuple[StageModel, ...]
    bearings: tuple[StationSprings, ...]
    ports: Mapping[str, Seat]
    load: np.ndarray
    turns: np.ndarray
    estimate: float = 1.0
    joints: tuple[StationSprings, ...] = ()
    casing: CasingModel | None = None

    def linear_stiffness(self, section: BoxBearingSection) -> tuple[float, ...]:
        """Stiffnesses (6,) of a bearing that is given by them, with the factor of estimates [N/m, N m/rad]."""
        return scaled_stiffness(section, self.estimate)

    @cached_property
    def bearing_names(self) -> tuple[str, ...]:
        """Names of the bearings: as given, or by their shafts."""
        return tuple(bearing.name for bearing in self.bearings)

    @cached_property
    def places(self) -> np.ndarray:
        """Numbers (n,) of the stations that are places, unlike elastic motions of the casing."""
        elastic = () if self.casing is None else self.casing.elastic
        return np.setdiff1d(np.arange(len(self.assembly.names)), elastic)

    def seat(self, shaft: str, position: float | None) -> Seat:
        """Find the place of a shaft at a position from its left end [m]; that of a rigid body where None."""
        return _seat(self.case, self.beams, self.first, shaft, position)


def _seat(case: GearboxCase, beams, first, shaft: str, position: float | None) -> Seat:
    if shaft not in beams:
        return Seat(first[shaft], (0.0, 0.0, position or 0.0))
    return Seat(first[shaft] + beams[shaft].index_of(position or 0.0))


def gearbox_model(
    case: GearboxCase,
    load_case: LoadCaseSection | None = None,
    *,
    mesh_stiffness: Mapping[str, Any] | None = None,
    estimate: float = 1.0,
    flow: BoxFlow | None = None,
) -> GearboxModel:
    """Assemble shafts, bearings, stages and loads of a gearbox.

    Parameters
    ----------
    case : GearboxCase
        From `femgear.read_case`.
    load_case : LoadCaseSection, optional
        Its torques and speeds; by default that which the case names first.
    mesh_stiffness : mapping of str to sequence, optional
        Mean stiffnesses of all meshes of stages by their names [N/m]. Without it teeth have those of ISO 6336-1,
        method B.
    estimate : float
        Factor on the stiffness of bearings that are estimated.
    flow : BoxFlow, optional
        Of the load case, with the shares of stages side by side; by default these are equal.

    Raises
    ------
    CaseError
        Shafts whose speed or torque nothing determines, loops that lock: see `gearbox_flow`.
    """
    load_case = load_case or case.load_case
    flow = flow or gearbox_flow(case, load_case)
    build = _Builder(case, flow, dict(mesh_stiffness or {}), estimate)
    return build.model(load_case)


class _Builder:
    """Collects stations and parts of a gearbox, one kind after the other."""

    def __init__(self, case: GearboxCase, flow: BoxFlow, stiffness: Mapping[str, Any], estimate: float):
        self.case, self.flow, self.stiffness, self.estimate = case, flow, stiffness, estimate
        self.names: list[str] = []
        self.places: list[Sequence[float]] = []
        self.inertias: list[Inertia] = []
        self.stiff_beams: list[Beam] = []
        self.springs: list[StationSprings] = []
        self.contacts: list[Contact] = []
        self.beams: dict[str, BeamShaft] = {}
        self.first: dict[str, int] = {}
        self.gears: set[tuple[str, float, int]] = set()
        self.casing: CasingModel | None = None
        self.elastic: ElasticParts | None = None

    def model(self, load_case: LoadCaseSection) -> GearboxModel:
        case = self.case
        for shaft in case.shaft:
            self._shaft(shaft)
        if case.casing is not None:
            self._casing(case.casing)
        for mass in case.mass:
            at, speed = self.seat(mass.shaft, mass.position), self.flow.speed[mass.shaft]
            self._body(at, mass.mass, mass.inertia, mass.about_diameter, speed)
        for number, coupling in enumerate(case.coupling):
            self._coupling(coupling, number)
        bearings = tuple(self._bearing(bearing, i) for i, bearing in enumerate(case.bearing))
        joints = list(self.springs)
        self.springs += [
            replace_stiffness(springs, scaled_stiffness(section, self.estimate))
            for springs, section in zip(bearings, case.bearing)
            if section.kind is None
        ]
        others = len(self.springs)
        stages = [self._pair(stage) for stage in case.pair] + [self._planetary(stage) for stage in case.planetary]
        held = self._held(stages)
        if self.casing is not None and self.elastic is not None:
            # elastic motions have no directions
            held[list(self.casing.elastic)] = self.elastic.held[1 : 1 + len(self.casing.elastic)]
        for name in case.operation.fixed:
            seat = self.casing_seat(f"{name} held")
            held[self.first[name], 5] = seat.station == GROUND
            if seat.station != GROUND:
                stations, turn = (seat.station, self.first[name]), [0.0, 0.0, 0.0, 0.0, 0.0, math.inf]
                self.springs.append(joint(f"{name} held", stations, (np.zeros(3), np.zeros(3)), turn))
        joints += self.springs[others:]
        if self.casing is not None:
            self.springs += [replace_stiffness(*foot) for foot in zip(self.casing.feet, self.casing.foot_stiffness)]
        assembly = Assembly(
            tuple(self.names),
            np.array(self.places),
            held.ravel(),
            tuple(self.inertias),
            tuple(self.stiff_beams),
            tuple(self.springs),
            tuple(self.contacts),
            () if self.elastic is None else self.elastic.followers,
        )
        ports = {load.name: self.seat(load.shaft, load.position) for load in case.load}
        ports |= {shaft.name: Seat(self.first[shaft.name]) for shaft in case.shaft if not shaft.part}
        turns = [6 * self.first[name] + 5 for name in self.flow.independent]
        load = self._loads(assembly, ports, load_case)
        return GearboxModel(
            case,
            self.flow,
            assembly,
            self.beams,
            self.first,
            tuple(stages),
            bearings,
            ports,
            load,
            np.array(turns, int),
            self.estimate,
            tuple(joints),
            self.casing,
        )

    def _held(self, stages: Sequence[StageModel]) -> np.ndarray:
        """Motions (n, 6) that do not take place by ``motions`` of the case; planets go round with their carrier."""
        held = np.zeros((len(self.names), 6), bool)
        held[:, list(HELD[self.case.motions])] = True
        if self.case.motions == "rotation":
            for stage in stages:
                around = stage.elastic_carrier.stations[1:] if stage.elastic_carrier else ()
                held[[*stage.planets, *around], :2] = False
            for planet in carriers(self.case):
                count = len(self.beams[planet].stations) if planet in self.beams else 1
                held[self.first[planet] : self.first[planet] + count, :2] = False
        return held

    def _casing(self, section: BoxCasingSection) -> None:
        """Add the stations of the casing with its mass, and its feet."""
        station = len(self.names)
        if section.file is None:
            self._station(CASING, section.centre or (0.0, 0.0, 0.0))
            self.inertias.append(Inertia((station,), casing_mass(section), np.zeros((6, 6))))
            self.casing = casing_model(self.case, station)
            return
        self.casing, self.elastic = elastic_casing_model(self.case, station)
        for name, (x, y, z) in zip(self.elastic.names, self.elastic.places.tolist(), strict=True):
            self._station(name, (x, y, z))
        self.inertias += self.elastic.inertias
        self.stiff_beams += [self.elastic.beam] if self.casing.elastic else []

    def casing_seat(self, name: str) -> Seat:
        """Place in the casing of a seat; one of what stands still."""
        if self.casing is None or name in self.casing.standing:
            return Seat(GROUND)
        if name in self.casing.seat_stations:
            return Seat(self.casing.seat_stations[name])
        offset = self.casing.seats[name] - np.asarray(self.casing.centre)
        return Seat(self.casing.station, (float(offset[0]), float(offset[1]), float(offset[2])))

    def seat(self, shaft: str, position: float | None) -> Seat:
        return _seat(self.case, self.beams, self.first, shaft, position)

    def _station(self, name: str, place: Sequence[float]) -> int:
        self.names.append(name)
        self.places.append(place)
        return len(self.names) - 1

    def _shaft(self, shaft) -> None:
        x, y = shaft.axis
        self.first[shaft.name] = len(self.names)
        if not shaft.part:
            self._station(shaft.name, (x, y, shaft.start))
            return
        material = self.case.material_of(shaft)
        parts = [
            ShaftPart(
                part.length,
                part.outer_diameter,
                part.inner_diameter,
                part.end_outer_diameter,
                part.end_inner_diameter,
                material.youngs_modulus,
                material.poisson_ratio,
                material.density,
            )
            for part in shaft.part
        ]
        beam = self.beams[shaft.name] = beam_shaft(
            parts, sorted(seats_on(self.case, shaft.name)), longest_element=shaft.longest_element
        )
        stations = tuple(
            self._station(f"{shaft.name} {i + 1}", (x, y, shaft.start + float(z))) for i, z in enumerate(beam.stations)
        )
        self.stiff_beams.append(Beam(stations, beam.stiffness))
        self.inertias.append(Inertia(stations, beam.mass, beam.gyroscopic * self.flow.speed[shaft.name]))

    def _body(self, seat: Seat, mass: float, polar: float, transverse: float, speed: float) -> None:
        if seat.station == GROUND:
            return
        at = body_matrices(mass, polar, transverse, offset=seat.offset[2])
        self.inertias.append(Inertia((seat.station,), at[0], at[1] * speed))

    def _coupling(self, coupling, number: int) -> None:
        positions = coupling.positions or (None, None)
        named = f"coupling {coupling.name or number + 1}"
        seats = [
            self.casing_seat(named) if shaft == CASING else self.seat(shaft, place)
            for shaft, place in zip(coupling.between, positions, strict=True)
        ]
        ends = [self._place(shaft, place) for shaft, place in zip(coupling.between, positions, strict=True)]
        seated = [end for end in ends if end is not None]
        way = seated[-1] - seated[0]
        offsets = [
            np.asarray(seat.offset) + share * way
            for seat, share in zip(seats, (coupling.joint, coupling.joint - 1.0), strict=True)
        ]
        radial, axial, bend, turn = coupling.radial, coupling.axial, coupling.bending, coupling.torsion
        stiffness = np.array([radial, radial, axial, bend, bend, turn])
        name = coupling.name or f"{'-'.join(coupling.between)}"
        self.springs.append(joint(name, (seats[0].station, seats[1].station), (offsets[0], offsets[1]), stiffness))

    def _place(self, shaft: str, position: float | None) -> np.ndarray | None:
        """Point (3,) of the axis of a shaft; None of the casing."""
        if shaft == CASING:
            return None
        section = self.case.shaft_named(shaft)
        return np.array([*section.axis, section.start + (position or 0.0)])

    def _bearing(self, bearing: BoxBearingSection, number: int) -> StationSprings:
        name = bearing_name(bearing, number)
        inner = self.seat(bearing.shaft, bearing.position)
        if bearing.outer_shaft is not None:
            outer = self.seat(bearing.outer_shaft, bearing.outer_position)
            # a planet turns on a pin beside the axis of its carrier
            beside = np.subtract(
                self.case.shaft_named(bearing.shaft).axis, self.case.shaft_named(bearing.outer_shaft).axis
            )
            offset = np.add(outer.offset, [*beside, 0.0])
            outer = Seat(outer.station, (float(offset[0]), float(offset[1]), float(offset[2])))
        else:
            outer = self.casing_seat(name)
        return joint(name, (outer.station, inner.station), (outer.offset, inner.offset), np.ones(6))

    def _pair(self, stage: PairSection) -> StageModel:
        sizes, positions = pair_sizes(stage), stage.positions or (None, None)
        seats = [self.seat(shaft, place) for shaft, place in zip(stage.shafts, positions, strict=True)]
        middles = [self._place(shaft, place) for shaft, place in zip(stage.shafts, positions, strict=True)]
        flank = -1 if self.flow.first_torque(stage) > 0.0 else 1
        teeth = teeth_of(stage)
        if teeth is not None:
            for number, (key, seat, shaft) in enumerate(zip(teeth.gear_names, seats, stage.shafts, strict=True)):
                gear = shaft, round(float(np.asarray(middles[number])[2]), 6), sizes.teeth[number]
                if gear not in self.gears:  # one gear in mesh with several
                    self.gears.add(gear)
                    self._body(seat, *self._gear_body(teeth, key), self.flow.speed[shaft])
        centres, width, middle = _common([np.asarray(m) for m in middles], sizes.face_widths)
        r1, r2 = sizes.base_radii
        towards = (centres[1] - centres[0])[:2]
        towards = towards / np.linalg.norm(towards)
        if sizes.internal:
            # the pinion touches the ring on its far side from the ring's axis
            towards, reach = -towards, sizes.centre_distance / (r2 - r1)
            radii = reach * r1, reach * r2
        else:
            reach = sizes.centre_distance / (r1 + r2)
            radii = reach * r1, -reach * r2
        # each gear is touched on its own pitch circle: axes may miss their distance by rounding
        pitch = np.array([np.append(c[:2] + radius * towards, middle) for c, radius in zip(centres, radii)])
        stiffness = self._mesh_stiffness(stage, 0, 0)
        number = self._contact(
            stage.name,
            (seats[0], seats[1]),
            pitch,
            mesh_normal(towards, sizes.pressure_angles[0], sizes.base_helix, flank),
            width,
            stiffness,
        )
        return StageModel(stage, sizes, (number,), flank, (seats[0].station, seats[1].station), width=width)

    def _planetary(self, stage: BoxPlanetarySection) -> StageModel:
        sizes, flow = set_sizes(stage), self.flow
        members = {name: getattr(stage, name) for name in ("sun", "carrier", "ring")}
        seats = {
            name: self.casing_seat(f"{name} of {stage.name}")
            if shaft == CASING
            else self.seat(shaft, stage.member_position(name))
            for name, shaft in members.items()
        }
        places = {name: self._place(shaft, getattr(stage, f"{name}_position")) for name, shaft in members.items()}
        # a member that stands in the casing lies where the others are
        given = [place for place in places.values() if place is not None]
        sun, ring = (given[at] if places[name] is None else places[name] for name, at in (("sun", 0), ("ring", -1)))
        flank = -1 if flow.first_torque(stage) > 0.0 else 1
        centres, width, middle = _common([sun, ring], (sizes.face_widths[0], sizes.face_widths[-1]))
        width = min([w for w in sizes.face_widths if w] or [0.0])
        axis, angles = centres[0][:2], tuple(stage.angle + psi for psi in _from_first(sizes.planet_angles))
        teeth = teeth_of(stage)
        if teeth is not None:
            for name in ("sun", "carrier", "ring"):
                if members[name] != CASING and not (name == "carrier" and stage.superelement):
                    body = self._gear_body(teeth, name)
                    self._body(seats[name], *body, flow.speed[members[name]])
        carrier = sun if places["carrier"] is None else self._place(stage.carrier, stage.seat_position)
        place = np.append(axis, middle)
        planets = [self._planet(stage, sizes, teeth, n, psi, place) for n, psi in enumerate(angles)]
        elastic = self._pins(stage, teeth, angles, planets, seats["carrier"], carrier)
        contacts = []
        for ring_mesh in (False, True):
            for n, (psi, planet) in enumerate(zip(angles, planets, strict=True)):
                pair = (Seat(planet), seats["ring"]) if ring_mesh else (seats["sun"], Seat(planet))
                name = f"{stage.name} planet {n + 1}-ring" if ring_mesh else f"{stage.name} sun-planet {n + 1}"
                normal, pitch = _set_mesh(sizes, psi, place, flank, ring_mesh=ring_mesh)
                number = len(angles) * int(ring_mesh) + n
                stiffness = self._mesh_stiffness(stage, int(ring_mesh), number)
                contacts.append(self._contact(name, pair, pitch, normal, width, stiffness))
        stations = tuple(seats[name].station for name in ("sun", "carrier", "ring"))
        return StageModel(stage, sizes, tuple(contacts), flank, stations, tuple(planets), angles, width, elastic)

    def _planet(self, stage, sizes, teeth, n: int, psi: float, place) -> int:
        """Add a planet around the centre of its set; the number of its station."""
        centre = place + sizes.centre_distance * np.array([math.cos(psi), math.sin(psi), 0.0])
        station = self._station(f"{stage.name} planet {n + 1}", tuple(centre))
        mass, polar, transverse = self._planet_body(stage, teeth)
        self._body(Seat(station), mass, polar, transverse, self.flow.planet_speed[stage.name])
        return station

    def _pins(self, stage, teeth, angles, planets, carrier: Seat, place) -> ElasticCarrier | None:
        """Hold planets on the carrier: rigid, giving way at its pins by closed forms, or elastic as in its file."""
        held, elastic = planet_bearing(stage), None
        offsets = [np.asarray(carrier.offset) + np.asarray(self.places[planet]) - place for planet in planets]
        holders = (carrier.station,) * len(planets)
        if stage.superelement is not None:
            pins = [
                self._station(f"{stage.name} pin {n + 1}", self.places[planet_name])
                for n, planet_name in enumerate(planets)
            ]
            speed = 0.0 if stage.carrier == CASING else self.flow.speed[stage.carrier]
            elastic = elastic_carrier(stage, (carrier.station, *pins), offsets, angles, speed)
            self.springs += elastic.springs
            self.inertias.append(Inertia(elastic.stations, elastic.mass, elastic.gyroscopic))
            holders, offsets = tuple(pins), [np.zeros(3)] * len(pins)
        axes = [pin_axes(psi) for psi in angles]
        if stage.pins is not None:
            compliance = pin_compliance(self.case, stage, angles)
            self.springs.append(planet_springs(stage, holders, planets, offsets, axes, held, compliance))
            return elastic
        for n, (holder, planet, offset) in enumerate(zip(holders, planets, offsets, strict=True)):
            ends = offset, np.zeros(3)
            self.springs.append(joint(f"pins of {stage.name}", (holder, planet), ends, held, axes=axes[n]))
        return elastic

    def _contact(self, name: str, seats: tuple[Seat, Seat], pitch, normal, width: float, stiffness: float) -> int:
        slices = self.case.deflection.slices if width and self.case.motions == "space" else 1
        heights = (np.arange(slices) + 0.5) * width / slices - 0.5 * width if slices > 1 else np.zeros(1)
        rows = []
        for seat, point in zip(seats, np.broadcast_to(pitch, (2, 3)), strict=True):
            points = np.tile(point, (slices, 1))
            points[:, 2] += heights
            rows.append(points - np.asarray(self.places[seat.station] if seat.station != GROUND else (0.0, 0.0, 0.0)))
        stations = (seats[0].station, seats[1].station)
        spread = np.full(slices, stiffness / slices)
        self.contacts.append(Contact(name, stations, np.tile(normal, (2, 1)), np.stack(rows), heights, spread))
        return len(self.contacts) - 1

    def _mesh_stiffness(self, stage: PairSection | BoxPlanetarySection, kind: int, mesh: int) -> float:
        """Stiffness of a mesh [N/m]: as computed, as given, or of ISO 6336-1."""
        if stage.name in self.stiffness:
            return float(self.stiffness[stage.name][mesh])
        section = stage.mesh if isinstance(stage, PairSection) else (stage.sun_mesh, stage.ring_mesh)[kind]
        if section is not None:
            return section.stiffness
        gears: Any = planetary_set(teeth_of(stage))
        pair = gears if isinstance(stage, PairSection) else gears.kinds[kind]
        width = min(gear.face_width for gear in pair.gears)
        return width * pair_mesh_stiffness(pair)[1]

    def _gear_body(self, teeth, key: str) -> tuple[float, float, float]:
        """Mass, polar and transverse inertia of a gear or the carrier: as the tables of the teeth say."""
        section = getattr(teeth, key)
        mass, inertia = getattr(section, "mass", math.nan), getattr(section, "inertia", math.nan)
        gears = {gear.name: gear for gear in planetary_set(teeth).gears}
        diametral = math.nan
        rigid = getattr(teeth, "helical", None) or getattr(teeth, "planar", None)
        if rigid is not None and key == "ring":
            mass, inertia = rigid.ring.mass, rigid.ring.inertia
        if hasattr(teeth, "helical"):
            diametral = getattr(teeth.helical, key).diametral_inertia
        if key in gears:
            body = gear_cylinder(gears[key], gear_material(teeth, key).density)
            properties = [
                value if math.isfinite(value) else guess for value, guess in zip((mass, inertia, diametral), body)
            ]
            if math.isfinite(inertia) and not math.isfinite(diametral):
                properties[2] = 0.5 * inertia + properties[0] * gears[key].face_width ** 2 / 12.0
            return properties[0], properties[1], properties[2]
        return mass, inertia, diametral if math.isfinite(diametral) else 0.5 * inertia

    def _planet_body(self, stage: BoxPlanetarySection, teeth) -> tuple[float, float, float]:
        given = stage.planet
        mass, polar, transverse = given.mass, given.inertia, given.transverse_inertia
        if teeth is not None:
            body = self._gear_body(teeth, "planet")
            mass, polar = (value if value is not None else guess for value, guess in zip((mass, polar), body))
            transverse = body[2] if transverse is None else transverse
        if mass is None or polar is None:
            raise CaseError(
                f"the planets of {stage.name} have no {'mass' if mass is None else 'inertia'}",
                code="E-KEY-MISSING",
                key=f"planetary[{self.case.planetary.index(stage)}].planet.{'mass' if mass is None else 'inertia'}",
                remedy="give mass and inertia of one planet",
            )
        return mass, polar, 0.5 * polar if transverse is None else transverse

    def _loads(self, assembly: Assembly, ports: Mapping[str, Seat], load_case: LoadCaseSection) -> np.ndarray:
        load = np.zeros(assembly.count)

        def add(seat: Seat, wrench) -> None:
            load[6 * seat.station : 6 * seat.station + 6] += rigid_link(seat.offset).T @ np.asarray(wrench, float)

        for name, torque in self.flow.port_torque.items():
            add(ports[name], [0.0, 0.0, 0.0, 0.0, 0.0, torque])
        for section in self.case.load:
            force = np.add(section.force, load_case.force.get(section.name, 0.0))
            moment = np.add(section.tilting_moment, load_case.tilting_moment.get(section.name, 0.0))
            add(ports[section.name], [*force, *moment, 0.0])
        if self.case.gravity is not None:
            along = np.asarray(self.case.gravity.direction)
            field = np.zeros((len(assembly.names), 6))
            field[:, :3] = self.case.gravity.acceleration * along / np.linalg.norm(along)
            if self.casing is not None:
                field[list(self.casing.elastic)] = 0.0
            load += assembly.mass @ field.ravel()
        for name, beam in self.beams.items():
            # motions are those against the grown casing: beams carry what they grow beyond it
            start = 6 * self.first[name]
            load[start : start + len(beam.stiffness)] += growth_load(beam, self.case.growth_of(name))
        return load


def planet_bearing(stage: BoxPlanetarySection) -> np.ndarray:
    """Find the stiffness (6,) between a planet and its pin along three axes and about them; none about the last one.

    Radially, tangentially, along z [N/m, N m/rad]; what is given nowhere is rigid.
    """
    given, teeth = stage.planet.bearing, teeth_of(stage)
    of_teeth = (getattr(teeth and teeth.planet, f"{name}_stiffness", None) for name in ("bearing", "tilt"))
    radial, tilt = (math.inf if value is None else value for value in of_teeth)
    radial, axial, tilt = (given.radial, given.axial, given.tilt) if given else (radial, math.inf, tilt)
    return np.array([radial, radial, axial, tilt, tilt, 0.0])


def _set_mesh(sizes: StageSizes, psi: float, centre, flank: int, *, ring_mesh: bool) -> tuple[np.ndarray, np.ndarray]:
    """Normal and pitch point (3,) of a mesh of a set with the planet at an angle; centre (3,) of the set [m]."""
    out = np.array([math.cos(psi), math.sin(psi), 0.0])
    sun, planet, ring = sizes.base_radii
    reach = sizes.centre_distance * (ring / (ring - planet) if ring_mesh else sun / (sun + planet))
    # planets turn against the sun, and have the other hand
    sense = -1 if ring_mesh else 1
    angle = sizes.pressure_angles[1 if ring_mesh else 0]
    normal = mesh_normal(out[:2], angle, sense * sizes.base_helix, sense * flank)
    return normal, centre + reach * out


def _common(places, widths) -> tuple[list[np.ndarray], float, float]:
    """Places of both gears, and width [m] and middle [m along z] of their common face width."""
    low = max(place[2] - 0.5 * width for place, width in zip(places, widths, strict=True))
    high = min(place[2] + 0.5 * width for place, width in zip(places, widths, strict=True))
    if not all(widths):
        return list(places), 0.0, float(np.mean([place[2] for place in places]))
    return list(places), float(high - low), float(0.5 * (low + high))


def _from_first(angles: Sequence[float]) -> list[float]:
    return [psi - angles[0] for psi in angles]


def seats_on(case: GearboxCase, shaft: str) -> set[float]:
    """Collect the positions on a shaft at which something sits [m]."""
    places: set[float] = set()
    for part in (*case.mass, *case.bearing, *case.load):
        if part.shaft == shaft and part.position is not None:
            places.add(part.position)
    for bearing in case.bearing:
        if bearing.outer_shaft == shaft and bearing.outer_position is not None:
            places.add(bearing.outer_position)
    for names, positions in [(coupling.between, coupling.positions) for coupling in case.coupling] + [
        (pair.shafts, pair.positions) for pair in case.pair
    ]:
        places |= {p for name, p in zip(names, positions or (), strict=False) if name == shaft and p is not None}
    for stage in case.planetary:
        for member in ("sun", "carrier", "ring"):
            place = stage.member_position(member)
            if getattr(stage, member) == shaft and place is not None:
                places.add(place)
    return places


def scaled_stiffness(section: BoxBearingSection, factor: float) -> tuple[float, ...]:
    """Multiply the given stiffnesses (6,) of a bearing by a factor where they are estimated."""
    return tuple(value * factor for value in section.stiffness) if section.estimated else section.stiffness


def replace_stiffness(springs: StationSprings, stiffness: Sequence[float]) -> StationSprings:
    """Copy six springs with these stiffnesses (6,), those of zero left out."""
    values = np.asarray(stiffness, float)
    return replace(springs, rows=springs.rows[values > 0.0], stiffness=values[values > 0.0])


def reference_shaft(model: GearboxModel) -> str:
    """Name the shaft whose speed counts: the first one that is given."""
    return model.flow.independent[0] if model.flow.independent else model.case.shaft[0].name


def member_of_stations(model: GearboxModel) -> list[str]:
    """Name the shaft, the planets, the elastic carrier or the casing that every station belongs to."""
    owner = [CASING] * len(model.assembly.names)
    for shaft in model.case.shaft:
        count = len(model.beams[shaft.name].stations) if shaft.name in model.beams else 1
        first = model.first[shaft.name]
        owner[first : first + count] = [shaft.name] * count
    for stage in model.stages:
        for planet in stage.planets:
            owner[planet] = f"planets of {stage.name}"
        for pin in stage.elastic_carrier.stations[1:] if stage.elastic_carrier else ():
            owner[pin] = f"carrier of {stage.name}"
    return owner


def seats_of_stations(model: GearboxModel) -> list[str]:
    """Name the meshes and bearings at every station; empty where there are none."""
    seats = [list[str]() for _ in model.assembly.names]
    listed = [*((contact.name, contact.stations) for contact in model.assembly.contacts)]
    listed += [(springs.name, springs.stations) for springs in model.bearings]
    for name, stations in listed:
        for station in stations:
            if station != GROUND:
                seats[station].append(name)
    return [merged_names(names) if names else "" for names in seats]


def bearing_places(model: GearboxModel) -> np.ndarray:
    """Find the places (b, 3) of all bearings [m]."""
    places = np.zeros((len(model.case.bearing), 3))
    for number, bearing in enumerate(model.case.bearing):
        shaft = model.case.shaft_named(bearing.shaft)
        places[number] = *shaft.axis, shaft.start + (bearing.position or 0.0)
    return places


def bearing_motions(model: GearboxModel, motion: np.ndarray) -> np.ndarray:
    """Compute the displacements (b, 3) of the shafts at all bearings [m] from the motions (6n,)."""
    motions = np.zeros((len(model.case.bearing), 3))
    for number, bearing in enumerate(model.case.bearing):
        seat = model.seat(bearing.shaft, bearing.position)
        motions[number] = (rigid_link(seat.offset) @ motion[6 * seat.station : 6 * seat.station + 6])[:3]
    return motions
