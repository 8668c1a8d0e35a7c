"""A drivetrain of bodies, bending shafts, gear stages and bearings as a mechanical system.

The coordinates are small deviations, in the fixed frame, from a large common rotation: body b turns by
``ratio_b phi(t)`` with the spin phi of the first body. The spin itself is a rigid motion without stiffness,
see `rigid` of the model; time integration keeps it apart (`femgear.trains.drivetrain.time`).

Meshes have a rectangular stiffness by the number of tooth pairs in contact. Mesh directions of planetary
stages turn with their carrier; those of planets alone come from `femgear.system.assembler`. Where meshes
separate, drive and back flanks are one-sided contacts, each with its own normal: on the back flank the
tangential and the axial part of the normal are reversed, the radial one is not. Gears that come closer close
both flanks, and teeth wedge (Y. Guo and R. G. Parker, Eur. J. Mech. A 29, 2010, 1022-1033; for parallel axes
the left and the right line of action of ISO 21771).

The purely torsional counterpart, `torsional_model`, has one rotation a body and a planet: A. Kahraman,
J. Sound Vib. 173, 1994, 125-130, for the planetary stage; W. Shi, C.-W. Chung and others, Int. J. Precis.
Eng. Manuf. 14, 2013, model wind turbine drivetrains so.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.modal import modal_damping
from femgear.system.assembler import mesh_directions, pin_directions
from femgear.system.elements import positive_part
from femgear.system.fourier import FourierSeries, phase_of
from femgear.system.rigid_bodies import PlanarBody, PlanarSet
from femgear.system.shaft import AXES, beam_element, disc_matrices, joint_deflections
from femgear.system.system import MechanicalSystem, NonlinearSystem
from femgear.trains.drivetrain.data import (
    BearingSection,
    Drivetrain,
    MeshSection,
    ParallelSection,
    PlanetarySection,
    ShaftSection,
    numbered,
)

# Row of a kinematic condition, relative to the largest, that counts as none.
_RANK = 1e-12

# Radial part of a normal, over the whole, that the held coordinates leave nothing of.
_NOTHING = 1e-12

# Terms of the mesh stiffness: as many as the paper takes.
HARMONICS = 15


@dataclass(frozen=True)
class DrivetrainModel:
    """A drivetrain ready for the solvers.

    Parameters
    ----------
    train : Drivetrain
    system : MechanicalSystem
        ``W`` holds the mesh directions with the carriers at angle zero, ``load`` the weight, ``C`` the modal
        damping; ``gyroscopic`` multiplies the speed of the first body.
    geometry : MeshGeometry
        Among the free coordinates.
    stiffness : (n_meshes, H + 1) complex array
        Harmonics of the mesh stiffnesses [N/m].
    backlash : (n_meshes,) array
        [m]
    bases : tuple of str
        Base frequencies: per planetary stage the carrier's turn and the mesh, per parallel stage the mesh.
    base_ratio : (n_bases,) array
        Speeds of the base phases over that of the first body.
    mesh_base : (n_meshes,) int array
        Base of the stiffness of every mesh.
    turning : bool
        Whether mesh directions turn with the carriers.
    rigid : (n,) array
        Rotations of the free spin, one for the first body.
    ratio : dict
        Speed of every body over that of the first one.
    contacts : FlankContacts
        Drive and back flanks of the meshes, for those that separate.
    """

    train: Drivetrain
    system: MechanicalSystem
    geometry: MeshGeometry
    stiffness: np.ndarray
    backlash: np.ndarray
    bases: tuple[str, ...]
    base_ratio: np.ndarray
    mesh_base: np.ndarray
    turning: bool
    rigid: np.ndarray
    ratio: dict[str, float]
    contacts: FlankContacts

    @property
    def meshes(self) -> tuple[str, ...]:
        return self.geometry.names

    @property
    def mean_stiffness(self) -> np.ndarray:
        """(n_meshes,) [N/m]"""
        return np.real(self.stiffness[:, 0])

    @property
    def total_stiffness(self) -> np.ndarray:
        """(n, n) with mean mesh stiffnesses."""
        return self.system.K + (self.system.W * self.mean_stiffness) @ self.system.W.T

    @property
    def still(self) -> MechanicalSystem:
        """Without load, damping and gyroscopic terms, for modes."""
        nothing = {"C": np.zeros_like(self.system.C), "load": np.zeros(len(self.rigid))}
        return replace(self.system, gyroscopic=None, **nothing)

    @property
    def inertia(self) -> float:
        """Of the whole chain about the axis of the first body [kg m^2]."""
        return float(self.rigid @ self.system.M @ self.rigid)

    def index(self, name: str) -> int:
        """Place of a degree of freedom such as ``"rotor: rotation"``."""
        if name not in self.system.dofs:
            raise CaseError(f"no coordinate {name!r}", code="E-DRIVETRAIN", limit=", ".join(self.system.dofs))
        return self.system.dofs.index(name)

    def frequencies(self, speed: float) -> np.ndarray:
        """Base frequencies (n_bases,) [rad/s] at a speed of the first body [rad/s]."""
        return self.base_ratio * speed


def drivetrain_model(
    train: Drivetrain, *, harmonics: int = HARMONICS, turning: bool = True
) -> DrivetrainModel:
    """Matrices, mesh directions and mesh stiffness of a drivetrain.

    Parameters
    ----------
    train : Drivetrain
    harmonics : int
        Terms of the mesh stiffness series.
    turning : bool
        Mesh directions of planetary stages turn with the carrier; False freezes them at angle zero.

    Raises
    ------
    CaseError
        Planets whose directions turn but that are unequally spaced or sit in bearings of finite stiffness
        (E-TURNING); see also `rigid_rotation`.
    """
    place = coordinates_of(train)
    spin = rigid_rotation(train, place)
    if turning:
        _check_turning(train)
    M, K, G = _matrices(train, place, spin)
    T, names = free_coordinates(train, place)
    geometry = mesh_geometry(train, place, spin)
    weight = np.zeros(place.count)
    for name in [n for n in place.names if n.endswith(": y")]:
        weight[place.names.index(name)] = -train.gravity
    geometry = replace(geometry, basic=T.T @ geometry.basic)
    reduced = MechanicalSystem(
        T.T @ M @ T, np.zeros((len(names), len(names))), T.T @ K @ T, geometry.frozen, np.zeros(len(names)),
        names, T.T @ G @ T,
    )  # fmt: skip
    stiffness = _stiffness(train, place, spin, harmonics)
    backlash = np.array([np.inf if m.section.backlash is None else m.section.backlash for m in train.meshes])
    bases, base_ratio, of_stage = _bases(train, place, spin)
    mesh_base = np.array([of_stage[mesh.stage] for mesh in train.meshes], int)
    C = np.zeros_like(reduced.C)
    if train.damping_ratio:
        still = replace(reduced, gyroscopic=None)
        C = modal_damping(still, np.real(stiffness[:, 0]), train.damping_ratio)
    rigid = np.linalg.lstsq(T, spin, rcond=None)[0]
    load, carried = T.T @ M @ weight, reduced.M @ rigid
    # over a turn the weight of planets that do not balance one another has no moment about the carrier
    load = load - carried * (rigid @ load) / (rigid @ carried)
    system = replace(reduced, C=C, load=load)
    ratio = {name: float(spin[first + 4]) for name, first in place.body.items()}
    return DrivetrainModel(
        train, system, geometry, stiffness, backlash, tuple(bases), np.array(base_ratio), mesh_base, turning,
        rigid, ratio, flank_contacts(train, place, spin, T, geometry, backlash),
    )  # fmt: skip


def drivetrain_problem(
    model: DrivetrainModel,
    *,
    torques: dict[str, float] | None = None,
    separates: bool = False,
    speed: float = 0.0,
) -> NonlinearSystem:
    """The drivetrain for harmonic balance and time integration, on its simple motions.

    Parameters
    ----------
    model : DrivetrainModel
    torques : dict
        Constant torque on bodies [N m], by their names; they must balance over the spin.
    separates : bool
        Meshes lose contact, and touch their back flanks, whose elements follow those of the drive flanks,
        after the backlash.
    speed : float
        Of the first body for the gyroscopic terms [rad/s].

    Returns
    -------
    NonlinearSystem
        Its base frequencies are ``model.bases``.
    """
    count, contacts = len(model.meshes), model.contacts
    geometry = contacts.geometry if separates else model.geometry
    number, elements = np.arange(len(geometry.names)), []
    for back in (False, True):
        for stage in np.unique(geometry.stage):
            own = np.flatnonzero((geometry.stage == stage) & ((number >= count) == back))
            if len(own):
                elements.append(_flanks(model, geometry, own, int(stage), separates))
    load = model.system.load.copy()
    for name, torque in (torques or {}).items():
        load[model.index(f"{name}: rotation")] += torque
    system = replace(model.system, W=geometry.basic, load=load)
    return NonlinearSystem(system, tuple(elements), speed=speed)


def _flanks(
    model: DrivetrainModel, geometry: MeshGeometry, own, stage: int, separates: bool
) -> TurningMeshes:
    """Element of like flanks of a stage."""
    contacts, planetary = model.contacts, stage < len(geometry.even)
    meshes, n_bases = contacts.mesh[own], len(model.bases)
    empty, fixed = np.zeros_like(geometry.fixed), geometry.fixed
    even, odd = (geometry.even[stage], geometry.odd[stage]) if planetary else (empty, empty)
    if not model.turning:
        fixed, even, odd = fixed + even, empty, empty
    used = [contacts.columns[j] for j in own]
    order = tuple(int(b == model.mesh_base[meshes[0]]) for b in range(n_bases))
    turn = tuple(int(planetary and b == 2 * stage) for b in range(n_bases))
    fixed, even, odd = (np.array([s[u, j] for u, j in zip(used, own)]) for s in (fixed, even, odd))
    stiffness = FourierSeries(model.stiffness[meshes], order)
    return TurningMeshes(np.array(used), fixed, even, odd, stiffness, turn, contacts.gap[own], separates)


def balanced_torque(model: DrivetrainModel, driver: str, torque: float, output: str) -> dict[str, float]:
    """A torque on one body and the one on another that holds the spin at its speed [N m]."""
    return {driver: torque, output: -torque * model.ratio[driver] / model.ratio[output]}


def _check_turning(train: Drivetrain) -> None:
    for stage in train.planetary:
        angles = np.array(stage.angles)
        # unequal planets would make mass and stiffness of the carrier depend on its angle
        unequal = [abs(np.exp(1j * order * angles).sum()) for order in (1, 2)]
        if max(unequal) > 1e-6 * len(angles) or math.isfinite(stage.planet_bearing):
            raise CaseError(
                f"planets of {stage.name} do not allow turning mesh directions", code="E-TURNING",
                limit="three planets or more, equally spaced, fixed to their pins (planet_bearing infinite)",
                remedy="take turning=False, which freezes the carrier angle",
            )  # fmt: skip


def _matrices(train: Drivetrain, place: Coordinates, spin: np.ndarray):
    """Mass and stiffness (n, n) without meshes, and gyroscopic matrix per unit speed of the first body."""
    M, K, G = np.zeros((3, place.count, place.count))
    for body in train.bodies:
        first = place.body[body.name]
        own, _ = disc_matrices(body.mass, body.inertia, body.transverse_inertia)
        M[first : first + 5, first : first + 5] += own
        _add_gyroscopic(G, first, body.inertia * spin[first + 4])
    for shaft, inner in zip(train.shafts, place.inner):
        if not shaft.elements:
            s = shaft.springs
            K += _springs(joint_rows(place, shaft), [s.shear, s.shear, s.bending, s.bending, s.torsion])
            continue
        ends = (place.body[shaft.between[0]], *inner, place.body[shaft.between[1]])
        mass, stiffness, gyroscopic = beam_element(shaft.section, shaft.length / shaft.elements)
        for one, two in itertools.pairwise(ends):
            at = np.r_[one : one + 5, two : two + 5]
            M[np.ix_(at, at)] += mass
            K[np.ix_(at, at)] += stiffness
            G[np.ix_(at, at)] += gyroscopic * spin[ends[0] + 4]
    for bearing in train.bearings:
        rows = np.zeros((5, place.count))
        first = _bearing_place(train, place, bearing)
        rows[np.arange(5), first + np.arange(5)] = 1.0
        rows[0, first + 3], rows[1, first + 2] = bearing.offset, -bearing.offset
        K += _springs(rows, [bearing.radial] * 2 + [bearing.tilt] * 2 + [0.0])
    for number, stage in enumerate(train.planetary):
        carrier = place.body[stage.carrier]
        B = lumped_map(stage, place, number)
        n, a = len(stage.angles), stage.centre_distance
        reduced = stage.planet_inertia / (stage.pitch_radii[1] * math.cos(stage.pressure_angle)) ** 2
        M += (B[9:].T * np.tile([stage.planet_mass, stage.planet_mass, reduced], n)) @ B[9:]
        tilt = n * (stage.planet_transverse_inertia + 0.5 * stage.planet_mass * a**2)
        M[carrier + 2, carrier + 2] += tilt
        M[carrier + 3, carrier + 3] += tilt
        polar = n * stage.planet_mass * a**2 * spin[carrier + 4]
        _add_gyroscopic(G, carrier, polar + n * stage.planet_inertia * spin[place.planets[number][0, 2]])
        if math.isfinite(stage.planet_bearing):
            rows = planet_bearing_rows(train, stage, place, number)
            K += _springs(rows, [stage.planet_bearing] * len(rows))
    return M, K, G


def _add_gyroscopic(G, first: int, momentum: float) -> None:
    G[first + 2, first + 3] += momentum
    G[first + 3, first + 2] -= momentum


def _springs(rows, stiffness) -> np.ndarray:
    """Infinite ones are conditions on the coordinates and not here."""
    stiffness = np.array(stiffness, float)
    return (rows.T * np.where(np.isinf(stiffness), 0.0, stiffness)) @ rows


def _bases(train: Drivetrain, place: Coordinates, spin: np.ndarray):
    """Names of the base frequencies, their ratios to the first body's speed, and the base of every stage."""
    names, ratio, of_stage = [], [], []
    for stage in train.planetary:
        turn = float(spin[place.body[stage.carrier] + 4])
        names += [f"{stage.carrier} turn", f"{stage.name} mesh"]
        ratio += [turn, stage.ring_teeth * abs(turn)]
        of_stage.append(len(names) - 1)
    for stage in train.parallel:
        names.append(f"{stage.name} mesh")
        ratio.append(stage.teeth[0] * abs(float(spin[place.body[stage.between[0]] + 4])))
        of_stage.append(len(names) - 1)
    return numbered(names), ratio, of_stage


def _stiffness(train: Drivetrain, place: Coordinates, spin: np.ndarray, harmonics: int) -> np.ndarray:
    """Harmonics (n_meshes, H + 1) of the mesh stiffnesses [N/m], those of the planets out of phase."""
    waves = []
    for mesh in train.meshes:
        wave = mesh.section
        if mesh.stage < len(train.planetary):
            stage = train.planetary[mesh.stage]
            # planet n is z_r psi_n ahead of planet 1 in its mesh with the ring, z_s psi_n behind with the sun
            teeth = stage.ring_teeth if mesh.key.endswith("ring_mesh") else -stage.sun_teeth
            sense = math.copysign(1.0, float(spin[place.body[stage.carrier] + 4])) / (2.0 * math.pi)
            ahead, first = (teeth * sense * stage.angles[p] for p in (mesh.planet, 0))
            wave = wave.changed(phase=wave.phase + (ahead - first))
        waves.append(rectangular_series(wave, harmonics))
    return np.array(waves).reshape(len(waves), harmonics + 1)


@dataclass(frozen=True)
class Coordinates:
    """Places of everything among all coordinates, before constraints.

    ``names`` (n,); ``body`` name -> first of five places; ``planets`` per planetary stage (N, 3), radial,
    tangential and rotation; ``inner`` per shaft, first places of the stations inside it.
    """

    names: tuple[str, ...]
    body: dict[str, int]
    planets: tuple[np.ndarray, ...]
    inner: tuple[tuple[int, ...], ...]

    @property
    def count(self) -> int:
        return len(self.names)


def coordinates_of(train: Drivetrain) -> Coordinates:
    """Five coordinates a body and a station of a shaft, three a planet; planets follow their carrier."""
    names, body, planets, inner = [], {}, {}, {}
    for one in train.bodies:
        body[one.name] = len(names)
        names += [f"{one.name}: {axis}" for axis in AXES]
        for number, stage in enumerate(train.planetary):
            if stage.carrier == one.name:
                prefix = "planet" if len(train.planetary) == 1 else f"planet of {one.name}"
                n = len(stage.angles)
                planets[number] = len(names) + np.arange(3 * n).reshape(n, 3)
                names += [
                    f"{prefix} {p + 1}: {axis}"
                    for p in range(n)
                    for axis in ("radial", "tangential", "rotation")
                ]
    for number, shaft in enumerate(train.shafts):
        inner[number] = tuple(len(names) + 5 * i for i in range(max(shaft.elements - 1, 0)))
        for i in range(len(inner[number])):
            names += [f"shaft {'-'.join(shaft.between)} {i + 1}: {axis}" for axis in AXES]
    return Coordinates(
        tuple(names), body, tuple(planets[n] for n in range(len(planets))),
        tuple(inner[n] for n in range(len(inner))),
    )  # fmt: skip


def _bearing_place(train: Drivetrain, place: Coordinates, bearing: BearingSection) -> int:
    """First of the five places that a bearing holds."""
    if bearing.station is None:
        return place.body[bearing.body or ""]
    stations = {shaft.between: inner for shaft, inner in zip(train.shafts, place.inner)}
    return stations[bearing.shaft or ()][bearing.station - 1]


def free_coordinates(train: Drivetrain, place: Coordinates) -> tuple[np.ndarray, tuple[str, ...]]:
    """All coordinates per unit of the free ones (n, n_free), and the names of those.

    Infinitely stiff bearings and joints, bodies that do not tilt and planets fixed to their pins leave
    fewer.
    """
    held = np.zeros(place.count, bool)
    for one in train.bodies:
        if not one.tilts:
            held[place.body[one.name] + np.array([2, 3])] = True
    for bearing in train.bearings:
        first = _bearing_place(train, place, bearing)
        held[first : first + 2] |= math.isinf(bearing.radial)
        held[first + 2 : first + 4] |= math.isinf(bearing.tilt)
    for stage, own in zip(train.planetary, place.planets):
        held[own[:, :2]] |= math.isinf(stage.planet_bearing)
    free = np.flatnonzero(~held)
    rows = [np.zeros((0, place.count))]
    for shaft in train.shafts:
        if not shaft.elements:
            s = shaft.springs
            stiff = np.isinf([s.shear, s.shear, s.bending, s.bending, s.torsion])
            rows.append(joint_rows(place, shaft)[stiff])
    return _eliminated(np.vstack(rows), free, place)


def _eliminated(rows, free, place):
    """Solve the conditions ``rows q = 0`` for as many of the free coordinates, the last ones first."""
    from scipy import linalg

    backwards = free[::-1]
    size = np.abs(rows).max(initial=0.0)
    table = rows[:, backwards]
    table = table[np.abs(table).max(axis=1, initial=0.0) > _RANK * size]
    if not len(table):
        return np.eye(place.count)[:, free], tuple(place.names[i] for i in free)
    _, triangle, order = linalg.qr(table, mode="economic", pivoting=True)  # type: ignore[misc]
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.count_nonzero(diagonal > _RANK * diagonal[0]))
    bound, rest = backwards[order[:rank]], np.sort(backwards[order[rank:]])
    column = {int(c): i for i, c in enumerate(backwards[order])}
    tied = -linalg.solve_triangular(triangle[:rank, :rank], triangle[:rank, [column[int(c)] for c in rest]])
    T = np.zeros((place.count, len(rest)))
    T[rest, np.arange(len(rest))] = 1.0
    T[bound] = tied
    return T, tuple(place.names[i] for i in rest)


def joint_rows(place: Coordinates, shaft: ShaftSection) -> np.ndarray:
    """Deflections (5, n) of the joint of a shaft."""
    rows = np.zeros((5, place.count))
    local = joint_deflections(shaft.length)
    for name, part in zip(shaft.between, (local[:, :5], local[:, 5:])):
        rows[:, place.body[name] : place.body[name] + 5] += part
    return rows


def rigid_rotation(train: Drivetrain, place: Coordinates) -> np.ndarray:
    """Rotations (n,) of the free spin of the chain, that of the first body being one.

    Willis' equation for planetary stages: ``r_s (s - c) + r_p (p - c) = 0``, ``r_r c + r_p (p - c) = 0``.

    Raises
    ------
    CaseError
        The stages do not leave exactly one spin (E-DRIVETRAIN).
    """
    turn = {name: first + 4 for name, first in place.body.items()}
    rows = []

    def condition(*terms):
        row = np.zeros(place.count)
        for at, factor in terms:
            row[at] += factor
        rows.append(row / np.abs(row).max())

    for shaft, inner in zip(train.shafts, place.inner):
        for at in (turn[shaft.between[1]], *(first + 4 for first in inner)):
            condition((turn[shaft.between[0]], 1.0), (at, -1.0))
    for stage in train.parallel:
        condition(*((turn[name], radius) for name, radius in zip(stage.between, stage.pitch_radii)))
    for stage, planets in zip(train.planetary, place.planets):
        c, s = turn[stage.carrier], turn[stage.sun]
        sun, planet = stage.pitch_radii
        for p in planets[:, 2]:
            condition((s, sun), (p, planet), (c, -stage.centre_distance))
            condition((c, stage.ring_radius - planet), (p, planet))
    rotations = sorted({*turn.values(), *(int(p) for own in place.planets for p in own[:, 2])})
    rotations += [first + 4 for inner in place.inner for first in inner]
    table = np.array(rows).reshape(-1, place.count)[:, rotations]
    _, values, vectors = np.linalg.svd(table)
    spins = len(rotations) - int(np.count_nonzero(values > 1e-10 * values.max(initial=1.0)))
    if spins != 1 or abs(vectors[-1, 0]) < 1e-12:
        raise CaseError(
            f"the stages leave {spins} independent rotations", code="E-DRIVETRAIN", limit="one",
            remedy="check the radii of stages that lie side by side, and what joins the bodies",
        )  # fmt: skip
    spin = np.zeros(place.count)
    spin[rotations] = vectors[-1] / vectors[-1, rotations.index(turn[train.bodies[0].name])]
    for stage, planets in zip(train.planetary, place.planets):
        if math.isfinite(stage.planet_bearing):
            # planets that are not fixed to their pins have tangential coordinates of their own
            spin[planets[:, 1]] = stage.centre_distance * spin[turn[stage.carrier]]
    return spin


def rectangular_series(wave: MeshSection, harmonics: int) -> np.ndarray:
    """Complex harmonics 0 to H (H + 1,) of the rectangular mesh stiffness [N/m].

    With ``low`` pairs always in contact and one more for the share ``e = ratio - low`` of the period, centred
    at phase zero, ``k = k_low + (k_high - k_low) (e + sum_h 2 / (pi h) sin(pi h e) cos(h omega t))``
    (Parker and Lin, J. Mech. Des. 126, 2004, 68-76, take the same wave).
    """
    if harmonics < 0 or int(harmonics) != harmonics:
        raise CaseError(f"{harmonics} harmonics", code="E-HARMONICS", limit="a whole number, 0 or more")
    low, high, share = wave.levels
    h = np.arange(1, harmonics + 1)
    waves = 2.0 * (high - low) / (math.pi * h) * np.sin(math.pi * h * share)
    return np.append(wave.stiffness, waves * np.exp(2j * np.pi * h * wave.phase)).astype(complex)


@dataclass(frozen=True)
class MeshGeometry:
    """Approach of the flanks of all meshes.

    The approach of mesh j is ``S_j(phase)^T U^T q``: ``U`` holds simple motions, ``S = fixed + sum_p
    (cos phi_p even_p + sin phi_p odd_p)`` with ``phi_p`` the angle of carrier p.

    Parameters
    ----------
    names : tuple of str
    basic : (n, m) array
        ``U``, among all coordinates or the free ones.
    fixed : (m, n_meshes) array
    even, odd : (P, m, n_meshes) arrays
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
        """``S`` (..., m, n_meshes) at carrier angles (..., P) [rad]."""
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
    """Directions of the drive flanks of all meshes among all coordinates; the planetary stages come first."""
    names, stages = [mesh.name for mesh in train.meshes], [mesh.stage for mesh in train.meshes]
    total = flank_directions(train, place, spin)
    return _split(numbered(names), total, np.array(stages, int), planar_places(train, place))


def flank_directions(train: Drivetrain, place: Coordinates, spin, *, back: bool = False) -> np.ndarray:
    """Approaches (n, n_meshes) of the drive or the back flanks, with the carriers at angle zero."""
    columns, side = [np.zeros((place.count, 0))], -1 if back else 1
    for number, stage in enumerate(train.planetary):
        flank = side * stage.flank
        # the flank of a sun that drives turns with it, that of one that is driven against it
        driven = -flank if spin[place.body[stage.carrier] + 4] > 0.0 else flank
        columns.append(lumped_map(stage, place, number).T @ mesh_directions(planar_of(train, stage), driven))
    for stage in train.parallel:
        columns.append(parallel_direction(stage, place, spin, flank=side * stage.flank)[:, None])
    return np.hstack(columns)


def planar_places(train: Drivetrain, place: Coordinates) -> list[list[int]]:
    """Per planetary stage the places of x and y of the carrier and the sun."""
    firsts = [(place.body[stage.carrier], place.body[stage.sun]) for stage in train.planetary]
    return [[one, one + 1, two, two + 1] for one, two in firsts]


def turned_directions(direction) -> tuple[np.ndarray, np.ndarray]:
    """Even and odd part (4, ...) of directions along x, y of carrier and sun that turn with the carrier."""
    # a direction (a, b) turned by phi is cos phi (a, b) + sin phi (-b, a)
    return direction, (direction[[1, 0, 3, 2]].T * np.array([-1.0, 1.0, -1.0, 1.0])).T


def _split(names, total, stages, planar) -> MeshGeometry:
    """Simple motions: the part of every mesh that does not turn, then x and y of carriers and suns."""
    count = total.shape[1]
    extra = 4 * len(planar)
    basic = np.hstack([total, np.zeros((len(total), extra))])
    even, odd = np.zeros((2, len(planar), count + extra, count))
    for number, places in enumerate(planar):
        at = count + 4 * number + np.arange(4)
        basic[places, at] = 1.0
        own = np.flatnonzero(stages == number)
        basic[np.ix_(places, own)] = 0.0
        even[number][np.ix_(at, own)], odd[number][np.ix_(at, own)] = turned_directions(
            total[np.ix_(places, own)]
        )
    fixed = np.vstack([np.eye(count), np.zeros((extra, count))])
    return MeshGeometry(tuple(names), basic, fixed, even, odd, stages)


def planar_of(train: Drivetrain, stage: PlanetarySection) -> PlanarSet:
    """The stage as a lumped set with a held ring; supports are those of the chain, hence none here."""
    cosine = math.cos(stage.pressure_angle)
    bodies = {
        key: PlanarBody(train.body(name).mass, train.body(name).inertia)
        for key, name in (("carrier", stage.carrier), ("sun", stage.sun))
    }
    return PlanarSet(
        ring=PlanarBody(1.0, 1.0, math.inf, math.inf),
        planet=PlanarBody(stage.planet_mass, stage.planet_inertia),
        sun_radius=stage.pitch_radii[0] * cosine, ring_radius=stage.ring_radius * cosine,
        planet_radius=stage.pitch_radii[1] * cosine, centre_distance=stage.centre_distance,
        planet_angles=stage.angles, pressure_angle_sun_planet=stage.pressure_angle,
        pressure_angle_planet_ring=stage.pressure_angle, stiffness_sun_planet=stage.sun_mesh.stiffness,
        stiffness_planet_ring=stage.ring_mesh.stiffness, planet_bearing=stage.planet_bearing, **bodies,
    )  # fmt: skip


def lumped_map(stage: PlanetarySection, place: Coordinates, number: int) -> np.ndarray:
    """Coordinates of the lumped set (3 (N + 3), n) per unit of those of the chain, carrier at angle zero."""
    own, cosine = place.planets[number], math.cos(stage.pressure_angle)
    B = np.zeros((9 + 3 * len(own), place.count))
    for row, name, radius in (
        (0, stage.carrier, stage.centre_distance),
        (6, stage.sun, stage.pitch_radii[0] * cosine),
    ):
        first = place.body[name]
        B[row, first] = B[row + 1, first + 1] = 1.0
        B[row + 2, first + 4] = radius
    for p, planet in enumerate(own):
        B[11 + 3 * p, planet[2]] = stage.pitch_radii[1] * cosine
        if math.isfinite(stage.planet_bearing):
            B[9 + 3 * p, planet[0]] = B[10 + 3 * p, planet[1]] = 1.0
    if math.isinf(stage.planet_bearing):
        cosines, sines = np.cos(stage.angles), np.sin(stage.angles)
        x, y, u = B[:3]
        B[9::3] = np.outer(cosines, x) + np.outer(sines, y)
        B[10::3] = np.outer(cosines, y) - np.outer(sines, x) + u
    return B


def planet_bearing_rows(train: Drivetrain, stage: PlanetarySection, place, number: int) -> np.ndarray:
    """Deflections (2N, n) of planet bearings of finite stiffness."""
    pins = pin_directions(planar_of(train, stage)).reshape(-1, 2 * len(stage.angles))
    return pins.T @ lumped_map(stage, place, number)


def parallel_direction(stage: ParallelSection, place: Coordinates, spin, *, flank: int) -> np.ndarray:
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
        moment = np.cross(arm, normal)
        first = place.body[name]
        w[first : first + 5] += sign * np.array([normal[0], normal[1], *moment])
    return w


@dataclass(frozen=True)
class TurningMeshes:
    """Meshes of one stage, or one of their flanks, as elements on simple motions.

    Parameters
    ----------
    columns : (g, d) int array
        Columns that every mesh takes part in.
    fixed, even, odd : (g, d) arrays
        ``S = fixed + cos phi even + sin phi odd``.
    stiffness : FourierSeries
        [N/m]
    turn : tuple of int
        Orders of the carrier's angle ``phi`` in the base frequencies.
    gap : (g,) array
        Of flanks that separate: ``k max(x - gap, 0)`` [m].
    separates : bool
        False: ``k x``.
    """

    columns: np.ndarray
    fixed: np.ndarray
    even: np.ndarray
    odd: np.ndarray
    stiffness: FourierSeries
    turn: tuple[int, ...]
    gap: np.ndarray
    separates: bool = False

    @property
    def reference(self) -> np.ndarray:
        """Mean stiffness of the columns by themselves (g, d) [N/m]."""
        square = self.fixed**2 + 0.5 * (self.even**2 + self.odd**2)
        return self.stiffness.mean[:, None] * square

    def evaluate(self, x, theta):
        """Forces (..., g, d) and tangents (..., g, d, d)."""
        phi = phase_of(theta, self.turn)[..., None, None]
        S = self.fixed + np.cos(phi) * self.even + np.sin(phi) * self.odd
        k, approach = self.stiffness.at(theta), (S * x).sum(axis=-1)
        if self.separates:
            overlap, closed = positive_part(approach - self.gap)
            force, slope = k * overlap, k * closed
        else:
            force, slope = k * approach, np.broadcast_to(k, approach.shape)
        return force[..., None] * S, slope[..., None, None] * S[..., :, None] * S[..., None, :]


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
        """Forces (..., n_meshes), drive less back flank, and whether any flank touches, from approaches.

        Parameters
        ----------
        approach, stiffness : (..., n_contacts) arrays
            [m], [N/m]
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


def flank_contacts(
    train: Drivetrain, place: Coordinates, spin, T, geometry: MeshGeometry, backlash
) -> FlankContacts:
    """Contacts of all meshes; an infinite backlash has no back flank.

    Parameters
    ----------
    train : Drivetrain
    place : Coordinates
    spin : (n_all,) array
    T : (n_all, n) array
        All coordinates by the free ones.
    geometry : MeshGeometry
        Of the drive flanks, among the free coordinates.
    backlash : (n_meshes,) array
        [m]
    """
    count, behind = len(geometry.names), np.flatnonzero(np.isfinite(backlash))
    total, planar = flank_directions(train, place, spin, back=True), planar_places(train, place)
    apart = _apart(geometry, T, total, planar)
    wedges = np.flatnonzero(np.any(apart != 0.0, axis=0)[behind])
    extra = dict(zip(behind[wedges], len(geometry.fixed) + np.arange(len(wedges))))
    size = len(geometry.fixed) + len(wedges), count + len(behind)
    fixed, (even, odd) = np.zeros(size), np.zeros((2, len(planar), *size))
    for whole, part in ((fixed, geometry.fixed), (even, geometry.even), (odd, geometry.odd)):
        whole[..., : len(geometry.fixed), :count] = part
    columns = [np.append(j, _shared(geometry, j)) for j in range(count)]
    for column, j in enumerate(behind.tolist(), start=count):
        stage, own, radial = geometry.stage[j], _shared(geometry, j), [extra[j]] if j in extra else []
        fixed[j, column], fixed[radial, column] = -1.0, 1.0
        if stage < len(planar):
            even[stage, own, column], odd[stage, own, column] = turned_directions(total[planar[stage], j])
        columns.append(np.r_[j, radial, own].astype(int))
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


def contact_model(model):
    """The model with every contact in the place of a mesh, for integration in time."""
    contacts = model.contacts
    return replace(
        model, geometry=contacts.geometry, stiffness=model.stiffness[contacts.mesh],
        backlash=model.backlash[contacts.mesh], mesh_base=model.mesh_base[contacts.mesh],
    )  # fmt: skip


def held_train(train: Drivetrain) -> Drivetrain:
    """The same data with every axis held: no translation, no tilt, shafts that only twist, no weight."""
    bodies = tuple(one.changed(tilts=False) for one in train.bodies)
    bearings = tuple(BearingSection.in_si(body=one.name, radial=math.inf) for one in train.bodies)
    planetary = tuple(one.changed(planet_bearing=math.inf) for one in train.planetary)
    return replace(train, bodies=bodies, bearings=bearings, planetary=planetary, gravity=0.0)


def torsional_model(train: Drivetrain, **options) -> DrivetrainModel:
    """Model of `held_train`, for the same solvers; options as for `drivetrain_model`."""
    return drivetrain_model(held_train(train), **options)
