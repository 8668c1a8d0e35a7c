"""A drivetrain of bodies, bending shafts, gear stages and bearings as a mechanical system.

The coordinates are small deviations, in the fixed frame, from a large common rotation: body b turns by
``ratio_b phi(t)`` with the spin phi of the first body. The spin itself is a rigid motion without stiffness,
see
`rigid` of the model; time integration keeps it apart (`femgear.models.drivetrain_march`). Mesh directions of
planetary stages turn with their carrier; those of planets alone come from `femgear.models.planar`.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain_contacts import FlankContacts, flank_contacts
from femgear.models.drivetrain_coordinates import (
    Coordinates,
    bearing_place,
    coordinates_of,
    free_coordinates,
    joint_rows,
    rigid_rotation,
)
from femgear.models.drivetrain_data import Drivetrain
from femgear.models.drivetrain_meshes import (
    MeshGeometry,
    TurningMeshes,
    lumped_map,
    mesh_geometry,
    planet_bearing_rows,
    rectangular_series,
)
from femgear.models.drivetrain_names import numbered
from femgear.models.shaft import beam_element, disc_matrices
from femgear.solvers.nonlinear import NonlinearSystem, modal_damping
from femgear.solvers.series import FourierSeries
from femgear.system import MechanicalSystem

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
        return self.stiffness[:, 0].real

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
    M, G = _inertia(train, place, spin)
    K = _stiffness(train, place)
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
    stiffness, backlash, mesh_base, bases, base_ratio = _meshes(train, place, spin, geometry, harmonics)
    C = np.zeros_like(reduced.C)
    if train.damping_ratio:
        still = replace(reduced, gyroscopic=None)
        C = modal_damping(still, stiffness[:, 0].real, train.damping_ratio)
    rigid = np.linalg.lstsq(T, spin, rcond=None)[0]
    load, carried = T.T @ M @ weight, reduced.M @ rigid
    # over a turn the weight of planets that do not balance one another has no moment about the carrier
    load = load - carried * (rigid @ load) / (rigid @ carried)
    system = replace(reduced, C=C, load=load)
    ratio = {name: float(spin[first + 4]) for name, first in place.body.items()}
    return DrivetrainModel(
        train, system, geometry, stiffness, backlash, bases, base_ratio, mesh_base, turning, rigid, ratio,
        flank_contacts(train, place, spin, T, geometry, backlash),
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
    load = model.system.load + torque_vector(model, torques or {})
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
    return TurningMeshes(
        np.array(used), *(np.array([s[u, j] for u, j in zip(used, own)]) for s in (fixed, even, odd)),
        FourierSeries(model.stiffness[meshes], order), turn, contacts.gap[own], separates,
    )  # fmt: skip


def torque_vector(model: DrivetrainModel, torques: dict[str, float]) -> np.ndarray:
    """Load (n,) of torques on bodies [N m]."""
    load = np.zeros(len(model.rigid))
    for name, torque in torques.items():
        load[model.index(f"{name}: rotation")] += torque
    return load


def balanced_torque(model: DrivetrainModel, driver: str, torque: float, output: str) -> dict[str, float]:
    """A torque on one body and the one on another that holds the spin at its speed [N m]."""
    return {driver: torque, output: -torque * model.ratio[driver] / model.ratio[output]}


def _check_turning(train: Drivetrain) -> None:
    for stage in train.planetary:
        angles = np.array(stage.planet_angles)
        # unequal planets would make mass and stiffness of the carrier depend on its angle
        unequal = [abs(np.exp(1j * order * angles).sum()) for order in (1, 2)]
        if max(unequal) > 1e-6 * len(angles) or math.isfinite(stage.planet_bearing):
            raise CaseError(
                f"planets of {stage.name} do not allow turning mesh directions", code="E-TURNING",
                limit="three planets or more, equally spaced, fixed to their pins (planet_bearing infinite)",
                remedy="take turning=False, which freezes the carrier angle",
            )  # fmt: skip


def _inertia(train: Drivetrain, place: Coordinates, spin: np.ndarray):
    """Mass (n, n), and gyroscopic matrix per unit speed of the first body."""
    M, G = np.zeros((2, place.count, place.count))
    for body in train.bodies:
        first = place.body[body.name]
        own, _ = disc_matrices(body.mass, body.inertia, body.transverse_inertia)
        M[first : first + 5, first : first + 5] += own
        _add_gyroscopic(G, first, body.inertia * spin[first + 4])
    for shaft, inner in zip(train.shafts, place.inner):
        ends = (place.body[shaft.first], *inner, place.body[shaft.second])
        for one, two in itertools.pairwise(ends) if shaft.elements else ():
            at = np.r_[one : one + 5, two : two + 5]
            mass, _, gyroscopic = beam_element(shaft.section, shaft.length / shaft.elements)
            M[np.ix_(at, at)] += mass
            G[np.ix_(at, at)] += gyroscopic * spin[ends[0] + 4]
    for number, stage in enumerate(train.planetary):
        carrier = place.body[stage.carrier]
        B = lumped_map(stage, place, number)
        n, a = len(stage.planet_angles), stage.centre_distance
        reduced = stage.planet_inertia / (stage.planet_radius * math.cos(stage.pressure_angle)) ** 2
        M += (B[9:].T * np.tile([stage.planet_mass, stage.planet_mass, reduced], n)) @ B[9:]
        tilt = n * (stage.planet_transverse_inertia + 0.5 * stage.planet_mass * a**2)
        M[carrier + 2, carrier + 2] += tilt
        M[carrier + 3, carrier + 3] += tilt
        polar = n * stage.planet_mass * a**2 * spin[carrier + 4]
        _add_gyroscopic(G, carrier, polar + n * stage.planet_inertia * spin[place.planets[number][0, 2]])
    return M, G


def _add_gyroscopic(G, first: int, momentum: float) -> None:
    G[first + 2, first + 3] += momentum
    G[first + 3, first + 2] -= momentum


def _stiffness(train: Drivetrain, place: Coordinates) -> np.ndarray:
    """Shafts, bearings and planet bearings of finite stiffness."""
    K = np.zeros((place.count, place.count))
    for shaft, inner in zip(train.shafts, place.inner):
        ends = (place.body[shaft.first], *inner, place.body[shaft.second])
        if shaft.elements:
            for one, two in itertools.pairwise(ends):
                at = np.r_[one : one + 5, two : two + 5]
                K[np.ix_(at, at)] += beam_element(shaft.section, shaft.length / shaft.elements)[1]
            continue
        s = shaft.springs
        K += _springs(joint_rows(place, shaft), [s.shear, s.shear, s.bending, s.bending, s.torsion])
    for bearing in train.bearings:
        rows = np.zeros((5, place.count))
        first = bearing_place(train, place, bearing)
        rows[np.arange(5), first + np.arange(5)] = 1.0
        rows[0, first + 3], rows[1, first + 2] = bearing.offset, -bearing.offset
        K += _springs(rows, [bearing.radial] * 2 + [bearing.tilt] * 2 + [bearing.torsion])
    for number, stage in enumerate(train.planetary):
        if math.isfinite(stage.planet_bearing):
            rows = planet_bearing_rows(train, stage, place, number)
            K += _springs(rows, [stage.planet_bearing] * len(rows))
    return K


def _springs(rows, stiffness) -> np.ndarray:
    """Infinite ones are conditions on the coordinates and not here."""
    stiffness = np.array(stiffness, float)
    return (rows.T * np.where(np.isinf(stiffness), 0.0, stiffness)) @ rows


def _meshes(train, place, spin, geometry: MeshGeometry, harmonics: int):
    """Stiffness harmonics, backlashes and base of every mesh; names and ratios of the bases."""
    waves, backlash, mesh_base, bases, ratio = [], [], [], [], []
    for stage in train.planetary:
        turn = float(spin[place.body[stage.carrier] + 4])
        bases += [f"{stage.carrier} turn", f"{stage.name} mesh"]
        ratio += [turn, stage.ring_teeth * abs(turn)]
        # planet n is z_r psi_n ahead of planet 1 in its mesh with the ring, z_s psi_n behind with the sun
        sense, angles = math.copysign(1.0, turn) / (2.0 * math.pi), np.array(stage.planet_angles)
        for wave, ahead in (
            (stage.sun_mesh, -stage.sun_teeth * sense * angles),
            (stage.ring_mesh, stage.ring_teeth * sense * angles),
        ):
            for shift in ahead - ahead[0]:
                waves.append(rectangular_series(replace(wave, phase=wave.phase + shift), harmonics))
                backlash.append(wave.backlash)
                mesh_base.append(len(bases) - 1)
    for stage in train.parallel:
        bases.append(f"{stage.name} mesh")
        ratio.append(stage.first_teeth * abs(float(spin[place.body[stage.first] + 4])))
        waves.append(rectangular_series(stage.mesh, harmonics))
        backlash.append(stage.mesh.backlash)
        mesh_base.append(len(bases) - 1)
    table = np.array(waves).reshape(len(geometry.names), harmonics + 1)
    return table, np.array(backlash), np.array(mesh_base, int), tuple(numbered(bases)), np.array(ratio)
