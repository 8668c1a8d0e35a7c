"""A drivetrain of bodies, bending shafts, gear stages and bearings as a mechanical system.

The coordinates are small deviations, in the fixed frame, from a large common rotation: body b turns by
``ratio_b phi(t)`` with the spin phi of the first body. The spin itself is a rigid motion without stiffness,
see `DrivetrainModel.rigid`; time integration keeps it apart (`femgear.trains.drivetrain.simulation`).

Meshes have a rectangular stiffness by the number of tooth pairs in contact; their directions are those of
`femgear.trains.drivetrain.kinematics`.

The purely torsional counterpart, `torsional_model`, has one rotation a body and a planet: A. Kahraman,
J. Sound Vib. 173, 1994, 125-130, for the planetary stage; W. Shi, C.-W. Chung and others, Int. J. Precis.
Eng. Manuf. 14, 2013, model wind turbine drivetrains so.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from femgear.case.gear_set import line_play
from femgear.case.text import write
from femgear.errors import CaseError, FemgearError
from femgear.fe.beam import beam_element, body_matrices
from femgear.solvers.linear.modal import modal_damping
from femgear.stages.static import solve_static
from femgear.system.force_laws import turning_wave
from femgear.system.fourier import FourierSeries, constant, orders_of
from femgear.system.stiffness_waves import pair_count_wave
from femgear.system.system import MechanicalSystem, NonlinearSystem
from femgear.system.turning_meshes import TurningMeshes
from femgear.trains.drivetrain.case_file import DrivetrainCase, drivetrain_of, pair_case_of, torque_histories
from femgear.trains.drivetrain.kinematics import (
    ENDS,
    MOTIONS,
    Coordinates,
    FlankContacts,
    MeshGeometry,
    coordinates_of,
    flank_contacts,
    free_coordinates,
    lumped_map,
    mesh_geometry,
    rigid_rotation,
    speed_ratios,
    springs_of,
)
from femgear.trains.drivetrain.parts import (
    BearingSection,
    ComputedMesh,
    Drivetrain,
    MeshSection,
    TorqueHistory,
    numbered,
)

BENDING, TORSIONAL = "with bending", "torsional"
# Terms of the mesh stiffness: as many as the paper takes.
HARMONICS = 15
# Force of a mesh, over the sum of what the single torques would give, that is rounding.
_NO_FORCE = 1e-6


@dataclass(frozen=True)
class DrivetrainModel:
    """A drivetrain ready for the solvers.

    Parameters
    ----------
    train : Drivetrain
        The bodies, shafts, stages and bearings that it was made of.
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
        Speeds of the base phases over that of the first body [1].
    mesh_base : (n_meshes,) int array
        Base of the stiffness of every mesh.
    turning : bool
        Whether mesh directions turn with the carriers.
    rigid : (n,) array
        Free spin, a rotation of one of the first body [rad].
    ratio : dict
        Speed of every body over that of the first one.
    contacts : FlankContacts
        Drive and back flanks of the meshes, for those that separate.
    place : Coordinates
        Of all n_all coordinates.
    free : (n_all, n) array
        All coordinates per unit of the free ones.
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
    place: Coordinates
    free: np.ndarray

    @property
    def meshes(self) -> tuple[str, ...]:
        """Names of the meshes (n_meshes,)."""
        return self.geometry.names

    @property
    def mean_stiffness(self) -> np.ndarray:
        """Mean stiffness (n_meshes,) of the meshes [N/m]."""
        return np.real(self.stiffness[:, 0])

    @property
    def total_stiffness(self) -> np.ndarray:
        """Stiffness matrix (n, n) with mean mesh stiffnesses [N/m]."""
        return self.system.K + (self.system.W * self.mean_stiffness) @ self.system.W.T

    @property
    def still(self) -> MechanicalSystem:
        """System without load, damping and gyroscopic terms, for modes."""
        nothing = {"C": np.zeros_like(self.system.C), "load": np.zeros(len(self.rigid))}
        return replace(self.system, gyroscopic=None, **nothing)

    @property
    def inertia(self) -> float:
        """Inertia of the whole chain about the axis of the first body [kg m^2]."""
        return float(self.rigid @ self.system.M @ self.rigid)

    def index(self, name: str) -> int:
        """Find the place of a degree of freedom such as ``"rotor: rotation"``."""
        if name not in self.system.dofs:
            raise CaseError(f"no coordinate {name!r}", code="E-DRIVETRAIN", limit=", ".join(self.system.dofs))
        return self.system.dofs.index(name)

    def frequencies(self, speed: float) -> np.ndarray:
        """Compute the base frequencies (n_bases,) [rad/s] at a speed of the first body [rad/s]."""
        return self.base_ratio * speed


def drivetrain_model(train: Drivetrain, *, harmonics: int = HARMONICS, turning: bool = True) -> DrivetrainModel:
    """Assemble matrices, mesh directions and mesh stiffness of a drivetrain.

    The series of the mesh stiffness has so many ``harmonics``. Mesh directions of planetary stages turn with
    the carrier, or are those at angle zero.

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
        T.T @ M @ T,
        np.zeros((len(names), len(names))),
        T.T @ K @ T,
        geometry.frozen,
        np.zeros(len(names)),
        names,
        T.T @ G @ T,
    )
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
        train,
        system,
        geometry,
        stiffness,
        backlash,
        tuple(bases),
        np.array(base_ratio),
        mesh_base,
        turning,
        rigid,
        ratio,
        flank_contacts(train, place, spin, T, geometry, backlash),
        place,
        T,
    )


def drivetrain_problem(
    model: DrivetrainModel,
    *,
    torques: dict[str, float] | None = None,
    separates: bool = False,
    speed: float = 0.0,
) -> NonlinearSystem:
    """Assemble a drivetrain for harmonic balance and time integration, on its simple motions.

    Parameters
    ----------
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
            contacts_of_stage = np.flatnonzero((geometry.stage == stage) & ((number >= count) == back))
            if len(contacts_of_stage):
                elements.append(_flanks(model, geometry, contacts_of_stage, int(stage), separates))
    load = model.system.load.copy()
    for name, torque in (torques or {}).items():
        load[model.index(f"{name}: rotation")] += torque
    system = replace(model.system, W=geometry.basic, load=load)
    return NonlinearSystem(system, tuple(elements), speed=speed)


def _flanks(model: DrivetrainModel, geometry: MeshGeometry, chosen, stage: int, separates: bool) -> TurningMeshes:
    """Element of like flanks of a stage."""
    contacts, planetary = model.contacts, stage < len(geometry.even)
    meshes, n_bases = contacts.mesh[chosen], len(model.bases)
    empty, fixed = np.zeros_like(geometry.fixed), geometry.fixed
    even, odd = (geometry.even[stage], geometry.odd[stage]) if planetary else (empty, empty)
    if not model.turning:
        fixed, even, odd = fixed + even, empty, empty
    used = [contacts.columns[j] for j in chosen]
    order = orders_of(int(model.mesh_base[meshes[0]]), n_bases)
    turn = orders_of(2 * stage, n_bases, int(planetary))
    fixed, even, odd = (np.array([s[u, j] for u, j in zip(used, chosen)]) for s in (fixed, even, odd))
    stiffness = FourierSeries(model.stiffness[meshes], order)
    gap = constant(contacts.gap[chosen])
    wave = turning_wave(turn)
    return TurningMeshes(np.array(used), fixed, even, odd, wave, stiffness, gap, separates=separates)


def balanced_torque(model: DrivetrainModel, driver: str, torque: float, output: str) -> dict[str, float]:
    """Pair a torque on one body with the one on another that holds the spin at its speed.

    Parameters
    ----------
    model : DrivetrainModel
        Whose speed ratios count.
    driver, output : str
        Names of the two bodies.
    torque : float
        On the driver [N m].

    Returns
    -------
    dict of str to float
        Torques on both bodies by name [N m].
    """
    return {driver: torque, output: -torque * model.ratio[driver] / model.ratio[output]}


def _check_turning(train: Drivetrain) -> None:
    for stage in train.planetary:
        angles = np.array(stage.angles)
        # unequal planets would make mass and stiffness of the carrier depend on its angle
        unequal = [abs(np.exp(1j * order * angles).sum()) for order in (1, 2)]
        if max(unequal) > 1e-6 * len(angles) or math.isfinite(stage.planet_bearing):
            raise CaseError(
                f"planets of {stage.name} do not allow turning mesh directions",
                code="E-TURNING",
                limit="three planets or more, equally spaced, fixed to their pins (planet_bearing infinite)",
                remedy="take turning=False, which freezes the carrier angle",
            )


def _matrices(train: Drivetrain, place: Coordinates, spin: np.ndarray):
    """Mass and stiffness (n, n) without meshes, and gyroscopic matrix per unit speed of the first body."""
    M, K, G = np.zeros((3, place.count, place.count))
    without_axial = np.ix_(MOTIONS, MOTIONS)
    for body in train.bodies:
        first = place.body[body.name]
        mass, gyroscopic = body_matrices(body.mass, body.inertia, body.transverse_inertia)
        M[first : first + 5, first : first + 5] += mass[without_axial]
        G[first : first + 5, first : first + 5] += gyroscopic[without_axial] * spin[first + 4]
    for shaft, stations in zip(train.shafts, place.stations):
        if shaft.elements:
            mass, _, gyroscopic = beam_element(shaft.section, shaft.length / shaft.elements)
            for start, end in itertools.pairwise(stations):
                at = np.r_[start : start + 5, end : end + 5]
                M[np.ix_(at, at)] += mass[np.ix_(ENDS, ENDS)]
                G[np.ix_(at, at)] += gyroscopic[np.ix_(ENDS, ENDS)] * spin[stations[0] + 4]
    for group in springs_of(train, place):
        finite = np.where(np.isinf(group.stiffness), 0.0, group.stiffness)
        K[np.ix_(group.places, group.places)] += (group.rows.T * finite) @ group.rows
    for number, stage in enumerate(train.planetary):
        carrier = place.body[stage.carrier]
        B = lumped_map(stage, place, number)
        n, a = len(stage.angles), stage.axis_distance
        reduced = stage.planet_inertia / stage.base_radii[1] ** 2
        M += (B[9:].T * np.tile([stage.planet_mass, stage.planet_mass, reduced], n)) @ B[9:]
        tilt = n * (stage.planet_transverse_inertia + 0.5 * stage.planet_mass * a**2)
        M[carrier + 2, carrier + 2] += tilt
        M[carrier + 3, carrier + 3] += tilt
        momentum = n * stage.planet_mass * a**2 * spin[carrier + 4]
        momentum += n * stage.planet_inertia * spin[place.planets[number][0, 2]]
        G[carrier : carrier + 5, carrier : carrier + 5] += body_matrices(0.0, momentum, 0.0)[1][without_axial]
    return M, K, G


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
        if isinstance(wave, ComputedMesh):
            # the path of contact is passed the other way where the second gear drives
            series = wave.series(harmonics)
            waves.append(series if train.stages[mesh.stage].flank > 0 else series.conj())
            continue
        waves.append(rectangular_series(wave, harmonics))
    return np.array(waves).reshape(len(waves), harmonics + 1)


def rectangular_series(wave: MeshSection, harmonics: int) -> np.ndarray:
    """Compute the complex harmonics 0 to H (H + 1,) of the rectangular mesh stiffness [N/m].

    With as many pairs as the contact ratio has whole ones always in contact, and one more for the rest of it,
    centred at phase zero: `femgear.system.stiffness_waves.pair_count_wave`, its height that of the two levels.
    """
    low, high, _ = wave.levels
    ratio, h = wave.contact_ratio, np.arange(1, harmonics + 1)
    # the middle of a path is half a period from the time of most pairs where the whole number is odd
    ahead = np.exp(2j * np.pi * h * (wave.phase + 0.5 * math.floor(ratio)))
    pairs = pair_count_wave(-0.5 * ratio, 0.5 * ratio, harmonics)
    return np.append(wave.stiffness, (high - low) * ratio * pairs * ahead).astype(complex)


def contact_model(model: DrivetrainModel) -> DrivetrainModel:
    """Put every contact in the place of a mesh, for integration in time."""
    contacts = model.contacts
    return replace(
        model,
        geometry=contacts.geometry,
        stiffness=model.stiffness[contacts.mesh],
        backlash=model.backlash[contacts.mesh],
        mesh_base=model.mesh_base[contacts.mesh],
    )


def torsional_model(train: Drivetrain, **options) -> DrivetrainModel:
    """Make a model as `drivetrain_model` with all axes held: rotations and twist alone, no weight."""
    held = replace(
        train,
        bodies=tuple(body.changed(tilts=False) for body in train.bodies),
        bearings=tuple(BearingSection.in_si(body=body.name, radial=math.inf) for body in train.bodies),
        planetary=tuple(stage.changed(planet_bearing=math.inf) for stage in train.planetary),
        gravity=0.0,
    )
    return drivetrain_model(held, **options)


def static_flexibility(model: DrivetrainModel, W, k) -> np.ndarray:
    """Compute the deviations (n, n) per unit of loads that do not drive the spin [m/N].

    At one instant: directions W (n, n_meshes) of the drive flanks, all in touch, and stiffnesses k
    (n_meshes,) [N/m].
    """
    carried, total = model.system.M @ model.rigid, model.system.K + (W * k) @ W.T
    size = (np.abs(total).max() or 1.0) / np.abs(carried).max() ** 2
    return np.linalg.inv(total + size * np.outer(carried, carried))


def case_model(case: DrivetrainCase, variant: str = BENDING) -> DrivetrainModel:
    """Make the model of a case, its loaded flanks those that the mean torques press together.

    Raises
    ------
    CaseError
        Stages that leave no single spin (E-DRIVETRAIN), mesh directions that cannot turn (E-TURNING).
    """
    build = drivetrain_model if variant == BENDING else torsional_model
    options = {"harmonics": case.simulation.harmonics, "turning": case.simulation.turning}
    with refusals_located(case):
        train = computed_drivetrain(case)
        torques = torque_histories(case, speed_ratios(train))
        return build(with_drivers(train, torques, duration=case.simulation.duration), **options)


def computed_drivetrain(case: DrivetrainCase) -> Drivetrain:
    """Make the chain of a case, the stiffness of its pairs computed from their teeth.

    FemgearError: the contact of a pair has no solution; it names the entry of the stage.
    """
    train, stages = drivetrain_of(case), []
    for i, stage in enumerate(train.parallel):
        if stage.stiffness is not None:
            try:
                stage = stage.changed(mesh=_computed_mesh(write(stage.stiffness)))
            except FemgearError as error:
                error.key = ".".join(filter(None, (f"parallel[{i}].stiffness", error.key)))
                error.file = case.location(error.key)
                raise
        stages.append(stage)
    return replace(train, parallel=tuple(stages))


@lru_cache(maxsize=8)
def _computed_mesh(text: str) -> ComputedMesh:
    """Solve the static contact of the pair of a case file for its mesh stiffness."""
    pair = pair_case_of(text)
    static = solve_static(pair)
    values = static.cycle.stiffness[0]
    # a negative torque is the drive of gear 2: positions run backwards
    samples = values if pair.operation.torque > 0.0 else values[-np.arange(len(values)) % len(values)]
    ratio = static.planetary_set.contact_ratio + abs(static.overlap_ratio)
    values_of_mesh = {"stiffness": float(values.mean()), "contact_ratio": ratio, "backlash": line_play(pair) or None}
    return ComputedMesh.in_si(samples=tuple(samples.tolist()), **values_of_mesh)


@contextmanager
def refusals_located(case: DrivetrainCase) -> Iterator[None]:
    """Let the refusals of a model name the entries of the case file and their lines."""
    try:
        yield
    except CaseError as error:
        if error.code == "E-TURNING":
            error.key, error.remedy = "simulation.turning", "write turning = false, which freezes the carrier"
        error.file = case.location(error.key or "")
        raise


def with_drivers(train: Drivetrain, torques: Sequence[TorqueHistory], *, duration: float) -> Drivetrain:
    """Choose the driver of every stage by the torques; stages whose driver is given keep it.

    The torques, as means over the run [s], and the inertia forces of the acceleration of the free spin that
    they give (d'Alembert's principle) act on the chain with held axes and mean mesh stiffnesses: statics, so
    that the load of parallel paths follows their stiffness. Weight does not count. A stage without load on
    its flanks, and one that its first body (the carrier) drives, stay as they are.

    CaseError: a torque on no body, stages that leave no single spin (E-DRIVETRAIN).
    """
    stages = train.stages
    if not torques or all(stage.driver is not None for stage in stages):
        return train
    force = _stage_forces(train, torques, duration)
    driven: list = [
        stage.changed(driver=stage.ends[1]) if stage.driver is None and value < 0.0 else stage
        for stage, value in zip(stages, force)
    ]
    planets = len(train.planetary)
    return replace(train, planetary=tuple(driven[:planets]), parallel=tuple(driven[planets:]))


def _stage_forces(train: Drivetrain, torques: Sequence[TorqueHistory], duration: float) -> np.ndarray:
    """Sum of the mean mesh forces of every stage [N]; zero where they are rounding."""
    model = torsional_model(replace(train, damping_ratio=0.0), harmonics=0, turning=False)
    W, k, carried = model.system.W, model.mean_stiffness, model.system.M @ model.rigid
    flexibility, force = static_flexibility(model, W, k), np.zeros((len(k), len(torques)))
    for column, torque_there in enumerate(torques):
        load = np.zeros(len(carried))
        load[model.index(f"{torque_there.body}: rotation")] = torque_there.mean(duration)
        load -= carried * (model.rigid @ load) / model.inertia
        force[:, column] = k * (W.T @ flexibility @ load)
    sums = np.zeros((len(train.stages), len(torques)))
    np.add.at(sums, model.geometry.stage, force)
    total = sums.sum(axis=1)
    # the model's flanks are those of the drivers that are given
    default = [stage.flank for stage in train.stages]
    return np.where(np.abs(total) > _NO_FORCE * np.abs(sums).sum(axis=1), total * default, 0.0)
