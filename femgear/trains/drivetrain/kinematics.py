"""Coordinates of a drivetrain, what ties them, the free spin, and the directions of its flanks.

Mesh directions of planetary stages turn with their carrier; those of planets alone come from
`femgear.system.mesh_directions`. Where meshes separate, drive and back flanks are one-sided contacts, each
with its own normal: on the back flank the tangential and the axial part of the normal are reversed, the
radial one is not. Gears that come closer close both flanks, and teeth wedge (Y. Guo and R. G. Parker, Eur. J.
Mech. A 29, 2010, 1022-1033; for parallel axes the left and the right line of action of ISO 21771).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from femgear.errors import CaseError
from femgear.fe.beam import AXES, joint_deflections, joint_springs
from femgear.gears.kinematics import willis_weights
from femgear.system.assembly import point_approach, solved_conditions
from femgear.system.mesh_directions import mesh_directions, pin_directions
from femgear.system.rigid_bodies import PlanarBody, PlanarSet
from femgear.trains.drivetrain.parts import Drivetrain, ParallelSection, PlanetarySection, numbered

# Motions of a station that the chain has, among those of `femgear.fe.beam`: all but the axial one; of two stations.
MOTIONS = np.array([0, 1, 3, 4, 5])
ENDS = np.append(MOTIONS, MOTIONS + len(AXES))
_NAMES = tuple(AXES[i] for i in MOTIONS)
# Radial part of a normal, over the whole, that the held coordinates leave nothing of.
_NOTHING = 1e-12


@dataclass(frozen=True)
class Coordinates:
    """Places of everything among all n coordinates, before constraints.

    ``names`` (n,); ``body`` name -> first of five places; ``planets`` per planetary stage (N, 3), radial,
    tangential and rotation; ``stations`` per shaft, first places of its ends and the stations between them.
    """

    names: tuple[str, ...]
    body: dict[str, int]
    planets: tuple[np.ndarray, ...]
    stations: tuple[tuple[int, ...], ...]

    @property
    def count(self) -> int:
        """Number n of all coordinates."""
        return len(self.names)


def coordinates_of(train: Drivetrain) -> Coordinates:
    """List coordinates: five a body and a station of a shaft, three a planet, which follows its carrier."""
    names, body, planets, stations = [], {}, {}, []
    for member in train.bodies:
        body[member.name] = len(names)
        names += [f"{member.name}: {axis}" for axis in _NAMES]
        for number, stage in enumerate(train.planetary):
            if stage.carrier == member.name:
                planets[number] = len(names) + np.arange(3 * len(stage.angles)).reshape(-1, 3)
                axes = ("radial", "tangential", "rotation")
                names += [f"{name}: {axis}" for name in train.planet_names(stage) for axis in axes]
    for shaft in train.shafts:
        first, last = (body[name] for name in shaft.between)
        inner = range(1, max(shaft.elements, 1))
        stations.append((first, *(len(names) + 5 * (i - 1) for i in inner), last))
        names += [f"shaft {'-'.join(shaft.between)} {i}: {axis}" for i in inner for axis in _NAMES]
    return Coordinates(tuple(names), body, tuple(planets[n] for n in range(len(planets))), tuple(stations))


@dataclass(frozen=True)
class Springs:
    """Springs of a part: ``places`` (m,) of the coordinates that they join, their deflections and stiffnesses.

    ``rows`` (k, m): deflection of every spring per unit of these coordinates. ``stiffness`` (k,): of springs that
    act against a rotation, told by ``turns`` (k,), [N m/rad], else [N/m].
    """

    places: np.ndarray
    rows: np.ndarray
    stiffness: np.ndarray
    turns: np.ndarray


def springs_of(train: Drivetrain, place: Coordinates) -> list[Springs]:
    """Collect the springs of shafts (a group an element), bearings and planet bearings.

    Stiffnesses [N/m] along and [N m/rad] about the coordinates ``place`` of the chain, `coordinates_of`;
    infinite ones are conditions.
    """
    springs, turns = [], np.array([False, False, True, True, True])
    stations = {shaft.between: places_there for shaft, places_there in zip(train.shafts, place.stations)}
    for shaft in train.shafts:
        length = shaft.length / max(shaft.elements, 1)
        s = joint_springs(shaft.section, length) if shaft.elements else shaft.springs
        stiffness = np.array([s.shear, s.shear, s.bending, s.bending, s.torsion])
        for start, end in pairwise(stations[shaft.between]):
            places = np.r_[start : start + 5, end : end + 5]
            springs.append(Springs(places, joint_deflections(length)[np.ix_(MOTIONS, ENDS)], stiffness, turns))
    for bearing in train.bearings:
        rows = np.eye(4)
        rows[0, 3], rows[1, 2] = bearing.offset, -bearing.offset
        stiffness = np.array([bearing.radial, bearing.radial, bearing.tilt, bearing.tilt])
        if bearing.station is None:
            first = place.body[bearing.body or ""]
        else:
            first = stations[bearing.shaft or ()][bearing.station]
        springs.append(Springs(first + np.arange(4), rows, stiffness, turns[:4]))
    for number, stage in enumerate(train.planetary):
        if math.isfinite(stage.planet_bearing):
            pins = pin_directions(planar_of(train, stage)).reshape(-1, 2 * len(stage.angles))
            rows = pins.T @ lumped_map(stage, place, number)
            stiffness = np.full(len(rows), stage.planet_bearing)
            springs.append(Springs(np.arange(place.count), rows, stiffness, np.zeros(len(rows), bool)))
    return springs


def free_coordinates(train: Drivetrain, place: Coordinates) -> tuple[np.ndarray, tuple[str, ...]]:
    """Compute all coordinates per unit of the free ones (n, n_free), and list the names of those.

    Infinitely stiff bearings and joints, bodies that do not tilt and planets fixed to their pins leave
    fewer.
    """
    held = np.zeros(place.count, bool)
    for body in train.bodies:
        if not body.tilts:
            held[place.body[body.name] + np.array([2, 3])] = True
    for stage, planet in zip(train.planetary, place.planets):
        held[planet[:, :2]] |= math.isinf(stage.planet_bearing)
    groups = [np.zeros((0, place.count))]
    for group in springs_of(train, place):
        stiff = group.rows[np.isinf(group.stiffness)]
        groups.append(np.zeros((len(stiff), place.count)))
        groups[-1][:, group.places] = stiff
    rows = np.vstack(groups)
    single = np.count_nonzero(rows, axis=1) == 1
    held |= np.any(rows[single] != 0.0, axis=0)
    motions, free = solved_conditions(rows[~single], held)
    return motions, tuple(place.names[i] for i in free)


def rigid_rotation(train: Drivetrain, place: Coordinates) -> np.ndarray:
    """Solve for the free spin (n,) of the chain among its coordinates, one radian of the first body [rad].

    Willis' equation for planetary stages: ``r_bs (s - c) + r_bp (p - c) = 0``, ``r_br c + r_bp (p - c) = 0``.
    Base radii have the ratios of the teeth, whatever the profile shifts.

    CaseError: the stages do not leave exactly one spin (E-DRIVETRAIN).
    """
    turn = {name: first + 4 for name, first in place.body.items()}
    rows = []

    def condition(*terms):
        row = np.zeros(place.count)
        for at, factor in terms:
            row[at] += factor
        rows.append(row / np.abs(row).max())

    for first, *inner, last in place.stations:
        for at in (last, *inner):
            condition((first + 4, 1.0), (at + 4, -1.0))
    for stage in train.parallel:
        condition(*((turn[name], radius) for name, radius in zip(stage.between, stage.pitch_radii)))
    for stage, planets in zip(train.planetary, place.planets):
        c, s = turn[stage.carrier], turn[stage.sun]
        sun, planet, ring = stage.base_radii
        for p in planets[:, 2]:
            condition(*zip((s, p, c), willis_weights(sun, planet), strict=True))
            # the ring stands still
            on_planet, _, on_carrier = willis_weights(planet, -ring)
            condition((p, on_planet), (c, on_carrier))
    rotations = sorted({*turn.values(), *(int(p) for planet_dofs in place.planets for p in planet_dofs[:, 2])})
    rotations += [first + 4 for _, *inner, _ in place.stations for first in inner]
    table = np.array(rows).reshape(-1, place.count)[:, rotations]
    _, values, vectors = np.linalg.svd(table)
    spins = len(rotations) - int(np.count_nonzero(values > 1e-10 * values.max(initial=1.0)))
    if spins != 1 or abs(vectors[-1, 0]) < 1e-12:
        raise CaseError(
            f"the stages leave {spins} independent rotations",
            code="E-DRIVETRAIN",
            limit="one",
            remedy="check the radii of stages that lie side by side, and what joins the bodies",
        )
    spin = np.zeros(place.count)
    spin[rotations] = vectors[-1] / vectors[-1, rotations.index(turn[train.bodies[0].name])]
    for stage, planets in zip(train.planetary, place.planets):
        if math.isfinite(stage.planet_bearing):
            # planets that are not fixed to their pins have tangential coordinates of their own
            spin[planets[:, 1]] = stage.axis_distance * spin[turn[stage.carrier]]
    return spin


def speed_ratios(train: Drivetrain) -> dict[str, float]:
    """Compute the speed of every body over that of the first one.

    CaseError: stages that leave no single spin (E-DRIVETRAIN).
    """
    place = coordinates_of(train)
    spin = rigid_rotation(train, place)
    return {name: float(spin[first + 4]) for name, first in place.body.items()}


@dataclass(frozen=True)
class MeshGeometry:
    """Approach of the flanks of all meshes.

    The approach of mesh j is ``S_j(phase)^T U^T q``: ``U`` holds simple motions, ``S = fixed + sum_p
    (cos phi_p even_p + sin phi_p odd_p)`` with ``phi_p`` the angle of carrier p.

    Parameters
    ----------
    names : tuple of str
        Of the n_meshes meshes.
    basic : (n, m) array
        ``U``, among all coordinates or the free ones.
    fixed : (m, n_meshes) array
        Approach per unit simple motion that does not turn with a carrier [1].
    even, odd : (P, m, n_meshes) arrays
        The parts that turn with each of P carriers: factors of the cosine and the sine of its angle [1].
    stage : (n_meshes,) int array
        Number of the stage, planetary ones first.
    """

    names: tuple[str, ...]
    basic: np.ndarray
    fixed: np.ndarray
    even: np.ndarray
    odd: np.ndarray
    stage: np.ndarray

    def selection(self, angles) -> np.ndarray:
        """Compute ``S`` (..., m, n_meshes) at carrier angles (..., P) [rad]."""
        angles = np.asarray(angles, float)
        whole = np.empty((*angles.shape[:-1], *self.fixed.shape))
        whole[...] = self.fixed
        # few entries turn
        turns = np.any((self.even != 0.0) | (self.odd != 0.0), axis=0)
        whole[..., turns] += np.cos(angles) @ self.even[:, turns] + np.sin(angles) @ self.odd[:, turns]
        return whole

    @property
    def frozen(self) -> np.ndarray:
        """Directions (n, n_meshes) with all carriers at angle zero."""
        return self.basic @ self.selection(np.zeros(len(self.even)))


def mesh_geometry(train: Drivetrain, place: Coordinates, spin: np.ndarray) -> MeshGeometry:
    """Find the directions of the drive flanks of all meshes; spin (n,) of `rigid_rotation`."""
    stages = np.array([mesh.stage for mesh in train.meshes], int)
    total, planar = _flank_directions(train, place, spin), _planar_places(train, place)
    # simple motions: the part of every mesh that does not turn, then x and y of carriers and suns
    count, extra = len(stages), 4 * len(planar)
    basic = np.hstack([total, np.zeros((len(total), extra))])
    even, odd = np.zeros((2, len(planar), count + extra, count))
    for number, places in enumerate(planar):
        at = count + 4 * number + np.arange(4)
        basic[places, at] = 1.0
        of_stage = np.flatnonzero(stages == number)
        basic[np.ix_(places, of_stage)] = 0.0
        turned = _turned_directions(total[np.ix_(places, of_stage)])
        even[number][np.ix_(at, of_stage)], odd[number][np.ix_(at, of_stage)] = turned
    fixed = np.vstack([np.eye(count), np.zeros((extra, count))])
    names = tuple(numbered([mesh.name for mesh in train.meshes]))
    return MeshGeometry(names, basic, fixed, even, odd, stages)


def _flank_directions(train: Drivetrain, place: Coordinates, spin, *, back: bool = False) -> np.ndarray:
    """Approaches (n, n_meshes) of the drive or the back flanks, with the carriers at angle zero."""
    columns, side = [np.zeros((place.count, 0))], -1 if back else 1
    for number, stage in enumerate(train.planetary):
        flank = side * stage.flank
        # the flank of a sun that drives turns with it, that of one that is driven against it
        driven = -flank if spin[place.body[stage.carrier] + 4] > 0.0 else flank
        columns.append(lumped_map(stage, place, number).T @ mesh_directions(planar_of(train, stage), driven))
    for stage in train.parallel:
        columns.append(_parallel_direction(stage, place, spin, flank=side * stage.flank)[:, None])
    return np.hstack(columns)


def _planar_places(train: Drivetrain, place: Coordinates) -> list[np.ndarray]:
    """Per planetary stage the places (4,) of x and y of the carrier and the sun."""
    firsts = [(place.body[stage.carrier], place.body[stage.sun]) for stage in train.planetary]
    return [np.array([first, first + 1, two, two + 1]) for first, two in firsts]


def _turned_directions(direction) -> tuple[np.ndarray, np.ndarray]:
    """Even and odd part (4, ...) of directions along x, y of carrier and sun that turn with the carrier."""
    # a direction (a, b) turned by phi is cos phi (a, b) + sin phi (-b, a)
    return direction, (direction[[1, 0, 3, 2]].T * np.array([-1.0, 1.0, -1.0, 1.0])).T


def planar_of(train: Drivetrain, stage: PlanetarySection) -> PlanarSet:
    """Make the lumped set of a stage with a held ring; supports are those of the chain, hence none here."""
    (sun, planet, ring), (sun_angle, ring_angle) = stage.base_radii, stage.working_angles
    bodies = {
        key: PlanarBody(train.body(name).mass, train.body(name).inertia)
        for key, name in (("carrier", stage.carrier), ("sun", stage.sun))
    }
    return PlanarSet(
        ring=PlanarBody(1.0, 1.0, math.inf, math.inf),
        planet=PlanarBody(stage.planet_mass, stage.planet_inertia),
        sun_radius=sun,
        ring_radius=ring,
        planet_radius=planet,
        centre_distance=stage.axis_distance,
        planet_angles=stage.angles,
        pressure_angle_sun_planet=sun_angle,
        pressure_angle_planet_ring=ring_angle,
        stiffness_sun_planet=stage.sun_mesh.stiffness,
        stiffness_planet_ring=stage.ring_mesh.stiffness,
        planet_bearing=stage.planet_bearing,
        **bodies,
    )


def lumped_map(stage: PlanetarySection, place: Coordinates, number: int) -> np.ndarray:
    """Compute coordinates (3 (N + 3), n) of the stage `number` per unit of the chain's, at angle zero."""
    planet_dofs, (sun_radius, planet_radius, _) = place.planets[number], stage.base_radii
    B = np.zeros((9 + 3 * len(planet_dofs), place.count))
    for row, name, radius in (
        (0, stage.carrier, stage.axis_distance),
        (6, stage.sun, sun_radius),
    ):
        first = place.body[name]
        B[row, first] = B[row + 1, first + 1] = 1.0
        B[row + 2, first + 4] = radius
    for p, planet in enumerate(planet_dofs):
        B[11 + 3 * p, planet[2]] = planet_radius
        if math.isfinite(stage.planet_bearing):
            B[9 + 3 * p, planet[0]] = B[10 + 3 * p, planet[1]] = 1.0
    if math.isinf(stage.planet_bearing):
        cosines, sines = np.cos(stage.angles), np.sin(stage.angles)
        x, y, u = B[:3]
        B[9::3] = np.outer(cosines, x) + np.outer(sines, y)
        B[10::3] = np.outer(cosines, y) - np.outer(sines, x) + u
    return B


def _parallel_direction(stage: ParallelSection, place: Coordinates, spin, *, flank: int) -> np.ndarray:
    """Approach (n,) of the flanks of two gears at the pitch point, tilts and helix included.

    A point P of a body moves by ``t + tilt x (P - C)``; with n the normal into the second gear the
    coordinates get ``n`` and ``(P - C) x n``, the second gear the opposite. On the other flank (-1), that of
    a second gear that drives, the tangential and the axial part of n are reversed; the radial part pushes the
    gears apart on both (ISO 21771, left and right lines of action).
    """
    sense = 1.0 if spin[place.body[stage.between[0]] + 4] > 0.0 else -1.0
    along = np.array([math.cos(stage.direction), math.sin(stage.direction)])
    across = flank * sense * np.array([-along[1], along[0]])
    plane = math.cos(stage.pressure_angle) * across + math.sin(stage.pressure_angle) * along
    # the normal leans along z by the base helix angle: tan(beta_b) = tan(beta) cos(alpha_t)
    lean = flank * math.tan(stage.helix_angle) * math.cos(stage.pressure_angle)
    normal = np.append(plane, lean) / math.hypot(1.0, lean)
    w = np.zeros(place.count)
    for name, radius, offset, sign in zip(stage.between, stage.pitch_radii, stage.offsets, (1.0, -1.0)):
        arm = np.append(sign * radius * along, offset)
        first = place.body[name]
        # bodies do not move along z
        w[first : first + 5] += sign * point_approach(normal, arm)[MOTIONS]
    return w


@dataclass(frozen=True)
class FlankContacts:
    """Contacts with the forces ``k max(x - gap, 0)`` along their own normals.

    Parameters
    ----------
    geometry : MeshGeometry
        Of the drive flanks of all meshes, then of the back flanks that the backlash lets touch; among the
        free coordinates. The first simple motions are those of the drive flanks alone.
    mesh : (n_contacts,) int array
        Mesh of every contact.
    gap : (n_contacts,) array
        Zero at the drive flanks, the backlash at the back flanks [m].
    columns : tuple of (n_contacts,) int arrays
        Simple motions that every contact takes part in; those of a stage and flank are alike in number.
    """

    geometry: MeshGeometry
    mesh: np.ndarray
    gap: np.ndarray
    columns: tuple[np.ndarray, ...]

    def mesh_forces(self, approach, stiffness):
        """Compute forces (..., n_meshes) [N], drive less back flank, and whether any flank touches.

        From approach [m] and stiffness [N/m] of the contacts (..., n_contacts).
        """
        n = int(self.mesh.max(initial=-1)) + 1
        overlap = approach - self.gap
        force = stiffness * np.maximum(overlap, 0.0)
        touching = overlap >= 0.0
        total, touched = force[..., :n].copy(), touching[..., :n].copy()
        # no mesh has two back flanks
        total[..., self.mesh[n:]] -= force[..., n:]
        touched[..., self.mesh[n:]] |= touching[..., n:]
        return total, touched


def flank_contacts(train: Drivetrain, place: Coordinates, spin, T, geometry: MeshGeometry, backlash) -> FlankContacts:
    """Make the contacts of the drive and back flanks of all meshes.

    Parameters
    ----------
    spin : (n_all,) array
        Of `rigid_rotation`.
    T : (n_all, n) array
        All coordinates per unit of the free ones.
    geometry : MeshGeometry
        Of the drive flanks, among the free coordinates.
    backlash : (n_meshes,) array
        [m]; where it is infinite there is no back flank.
    """
    count, behind = len(geometry.names), np.flatnonzero(np.isfinite(backlash))
    total, planar = _flank_directions(train, place, spin, back=True), _planar_places(train, place)
    apart = _apart(geometry, T, total, planar)
    wedges = np.flatnonzero(np.any(apart != 0.0, axis=0)[behind])
    extra = dict(zip(behind[wedges], len(geometry.fixed) + np.arange(len(wedges))))
    size = len(geometry.fixed) + len(wedges), count + len(behind)
    fixed, (even, odd) = np.zeros(size), np.zeros((2, len(planar), *size))
    for whole, part in ((fixed, geometry.fixed), (even, geometry.even), (odd, geometry.odd)):
        whole[..., : len(geometry.fixed), :count] = part
    columns = [np.append(j, _shared(geometry, j)) for j in range(count)]
    for column, j in enumerate(behind.tolist(), start=count):
        stage, coordinates, radial = geometry.stage[j], _shared(geometry, j), [extra[j]] if j in extra else []
        fixed[j, column], fixed[radial, column] = -1.0, 1.0
        if stage < len(planar):
            even[stage, coordinates, column], odd[stage, coordinates, column] = _turned_directions(
                total[planar[stage], j]
            )
        columns.append(np.r_[j, radial, coordinates].astype(int))
    names = (*geometry.names, *(f"{geometry.names[j]}, back flank" for j in behind))
    mesh = np.r_[np.arange(count), behind].astype(int)
    basic = np.hstack([geometry.basic, apart[:, behind[wedges]]])
    both = MeshGeometry(names, basic, fixed, even, odd, geometry.stage[mesh])
    gap = np.append(np.zeros(count), np.asarray(backlash, float)[behind])
    return FlankContacts(both, mesh, gap, tuple(columns))


def _apart(geometry: MeshGeometry, T, total, planar) -> np.ndarray:
    """What the back flanks have beside the reversed drive flanks (n, n_meshes), but for what turns.

    That is the radial part twice; zero for all meshes of a stage whose held coordinates leave nothing of it.
    """
    rest = total.copy()
    for number, places in enumerate(planar):
        rest[np.ix_(places, np.flatnonzero(geometry.stage == number))] = 0.0
    apart = T.T @ rest + geometry.basic[:, : len(geometry.names)]
    whole = np.abs(T.T @ total).max(axis=0, initial=0.0)
    radial = np.abs(apart).max(axis=0, initial=0.0) > _NOTHING * whole
    return np.where(np.isin(geometry.stage, geometry.stage[radial]), apart, 0.0)


def _shared(geometry: MeshGeometry, mesh: int) -> np.ndarray:
    """Simple motions of the carrier and the sun of a mesh; none of a parallel stage."""
    stage = int(geometry.stage[mesh])
    return len(geometry.names) + 4 * stage + np.arange(4 if stage < len(geometry.even) else 0)
