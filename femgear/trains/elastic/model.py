"""Planetary set with an elastic toothed ring: rigid sun, planets and carrier, FE ring on a foundation.

All bodies move in the plane; coordinates are those of the carrier frame, in which the mean motion is removed.
`elastic_set`, and with it the dynamics, leaves the gyroscopic and convective terms of that frame out;
`turning_system` adds them, to see what they do to the natural frequencies.

In the carrier frame the teeth of the ring pass under a load that stands still. `ring_model` therefore
represents the ring by its cyclic modes on the foundation, with a load spread over the active flank of one
tooth; what the passing teeth add is part of the mesh stiffness, not of the ring.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError, ContactError
from femgear.system.system import MechanicalSystem, MeshExcitation

if TYPE_CHECKING:
    from femgear.fe.grid import Grid
    from femgear.fe.reduction import CyclicModes
    from femgear.gears.planetary import PlanetarySet

RADIAL, TANGENTIAL = 0, 1
# nodal diameters of the ring model: their amplitudes fall fast, and 54 points of the housing resolve them
MAX_DIAMETER = 26


@dataclass(frozen=True)
class BodyData:
    """A rigid body: mass [kg], polar inertia [kg m^2], isotropic radial support or bearing [N/m]."""

    mass: float
    inertia: float
    stiffness: float


@dataclass(frozen=True)
class ShaftData:
    """A rotating inertia [kg m^2] behind a torsional spring [N m/rad]."""

    inertia: float
    stiffness: float


@dataclass(frozen=True)
class RigidBodies:
    """What turns beside the ring.

    Parameters
    ----------
    sun, carrier, planet : BodyData
        Stiffness is the support of sun and carrier, and the bearing between a planet and the carrier.
    motor, brake : ShaftData, optional
        Inertias behind springs at the driven member and at the output; without one, its torque acts on the
        member itself.
    """

    sun: BodyData
    carrier: BodyData
    planet: BodyData
    motor: ShaftData | None = None
    brake: ShaftData | None = None


@dataclass(frozen=True)
class ElasticSet:
    """The system and the places of its parts.

    Parameters
    ----------
    system : MechanicalSystem
    rigid_directions : (n, 2N) array
        Mesh directions without the ring's own displacement: ``rigid_directions^T q`` is the dynamic
        transmission error of the gears, ring deflection included.
    ring_slice : slice
        Place of the ring's coordinates.
    ring_diameter, ring_phase : int arrays
        Nodal diameter and kind (0 cosine, 1 sine) of every ring coordinate.
    ring_mode : int array
        Index into the ring's CyclicModes of every ring coordinate.
    planet_angles : (N,) array
    """

    system: MechanicalSystem
    rigid_directions: np.ndarray
    ring_slice: slice
    ring_diameter: np.ndarray
    ring_phase: np.ndarray
    ring_mode: np.ndarray
    planet_angles: np.ndarray


def rigid_dofs(n_planets: int, motor: bool, brake: bool) -> tuple[str, ...]:
    """Names of the rigid-body degrees of freedom."""
    bodies = ["sun", "carrier", *(f"planet {n + 1}" for n in range(n_planets))]
    names = [f"{body}: {axis}" for body in bodies for axis in ("x", "y", "rotation")]
    return tuple(names + ["motor: rotation"] * motor + ["brake: rotation"] * brake)


def elastic_set(
    planetary_set: PlanetarySet,
    ring: RingModel,
    bodies: RigidBodies,
    *,
    sun_torque: float,
    driven: str = "sun",
    flexibility=None,
) -> ElasticSet:
    """Assemble the mechanical system.

    Parameters
    ----------
    planetary_set : PlanetarySet
    ring : RingModel
    bodies : RigidBodies
    sun_torque : float
        Torque on the sun [N m]; its sign tells which flanks carry.
    driven : {"sun", "carrier"}
        Input member.
    flexibility : (2N, 2N) array, optional
        Compliance of the bodies between the meshes, see `body_flexibility` [m/N].
    """
    motor, brake = ("motor", bodies.motor), ("brake", bodies.brake)
    names = rigid_dofs(planetary_set.n_planets, bodies.motor is not None, bodies.brake is not None)
    place = {name: i for i, name in enumerate(names)}
    n_rigid = len(names)
    modes = ring.modes
    paired = modes.paired
    ring_mode = np.repeat(np.arange(len(paired)), np.where(paired, 2, 1))
    ring_phase = np.concatenate([np.arange(2 if p else 1) for p in paired]).astype(int)
    n = n_rigid + len(ring_mode)
    M, K, W, load = np.zeros(n), np.zeros((n, n)), np.zeros((n, 2 * planetary_set.n_planets)), np.zeros(n)
    M[n_rigid:] = 1.0
    K[range(n_rigid, n), range(n_rigid, n)] = (2 * np.pi * modes.frequency[ring_mode]) ** 2
    _place_bodies(M, K, place, planetary_set, bodies)
    shafts = (motor, brake) if driven == "sun" else (brake, motor)
    _place_shafts(M, K, load, place, planetary_set, shafts, sun_torque)
    side = 1.0 if sun_torque >= 0 else -1.0
    rigid = np.zeros_like(W)
    _mesh_directions(rigid, place, planetary_set, side)
    W[:] = rigid
    angles = np.asarray(planetary_set.planet_angles) + ring.load_angle
    n_p = planetary_set.n_planets
    W[n_rigid:, n_p:] -= ring_displacement(modes, ring_mode, ring_phase, angles)
    ring_names = tuple(
        f"ring: n={modes.nodal_diameter[m]} mode {m} {'sine' if p else 'cosine'}"
        for m, p in zip(ring_mode, ring_phase)
    )
    system = MechanicalSystem(M=np.diag(M), C=np.zeros((n, n)), K=K, W=W, load=load, dofs=names + ring_names)
    system = replace(system, flexibility=flexibility)
    return ElasticSet(
        system=system,
        rigid_directions=rigid,
        ring_slice=slice(n_rigid, n),
        ring_diameter=modes.nodal_diameter[ring_mode],
        ring_phase=ring_phase,
        ring_mode=ring_mode,
        planet_angles=np.asarray(planetary_set.planet_angles),
    )


def ring_displacement(ring: CyclicModes, ring_mode, ring_phase, angles) -> np.ndarray:
    """Displacement into the ring at its loaded flanks per unit ring coordinate, shape (coordinates, N).

    Parameters
    ----------
    ring : CyclicModes
    ring_mode, ring_phase : int arrays
        Mode and kind (0 cosine, 1 sine) of every coordinate.
    angles : (N,) array
        Angles of the loaded teeth [rad].
    """
    factor = ring.load[ring_mode, :1] * np.exp(1j * ring.nodal_diameter[ring_mode, None] * angles)
    sine = ring_phase[:, None] == 1
    return ring.norm[ring_mode, None] * np.where(sine, factor.imag, factor.real)


def _place_bodies(M, K, place, planetary_set, bodies: RigidBodies) -> None:
    planet = bodies.planet
    for name, body in (("sun", bodies.sun), ("carrier", bodies.carrier)):
        for axis in ("x", "y"):
            i = place[f"{name}: {axis}"]
            M[i] = body.mass
            K[i, i] += body.stiffness
        M[place[f"{name}: rotation"]] = body.inertia
    a = planetary_set.centre_distance
    c = [place[f"carrier: {axis}"] for axis in ("x", "y", "rotation")]
    for n, psi in enumerate(planetary_set.planet_angles):
        p = [place[f"planet {n + 1}: {axis}"] for axis in ("x", "y", "rotation")]
        M[p] = planet.mass, planet.mass, planet.inertia
        # the pin moves with the carrier: translation plus rotation about its centre
        for planet_dof, carrier_dof, arm in ((p[0], c[0], -a * np.sin(psi)), (p[1], c[1], a * np.cos(psi))):
            column = np.zeros(len(K))
            column[planet_dof], column[carrier_dof], column[c[2]] = 1.0, -1.0, -arm
            K += planet.stiffness * np.outer(column, column)


def _place_shafts(M, K, load, place, planetary_set, shafts, sun_torque):
    ratio = 1.0 + planetary_set.ring.teeth / planetary_set.sun.teeth
    torques = {"sun": sun_torque, "carrier": -ratio * sun_torque}
    for (name, shaft), (member, torque) in zip(shafts, torques.items(), strict=True):
        end = place[f"{member}: rotation"]
        if shaft is not None:
            i = place[f"{name}: rotation"]
            M[i] = shaft.inertia
            K[np.ix_([i, end], [i, end])] += shaft.stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
            end = i
        load[end] += torque


def _mesh_directions(W, place, planetary_set, side):
    """Columns whose product with the motions is the approach of the flanks, ring displacement excluded."""
    s = planetary_set
    N = s.n_planets
    for n, psi in enumerate(s.planet_angles):
        on_planet = psi + side * (np.pi / 2 - s.working_pressure_angle_sun_planet)
        on_ring = psi - side * (np.pi / 2 - s.working_pressure_angle_planet_ring)
        for j, angle, body, sign in (
            (n, on_planet, "sun", 1.0),
            (n, on_planet, f"planet {n + 1}", -1.0),
            (N + n, on_ring, f"planet {n + 1}", 1.0),
        ):
            W[place[f"{body}: x"], j] = sign * np.cos(angle)
            W[place[f"{body}: y"], j] = sign * np.sin(angle)
        W[place["sun: rotation"], n] = side * s.sun.base_radius
        W[place[f"planet {n + 1}: rotation"], n] = side * s.planet.base_radius
        W[place[f"planet {n + 1}: rotation"], N + n] = -side * s.planet.base_radius


def highest_mesh_mode(
    planetary_set: PlanetarySet, stiffness, bodies: RigidBodies, *, sun_torque: float
) -> float:
    """Highest natural frequency of the rigid gears in a rigid ring whose strain is in the meshes [Hz].

    Modes with less than a tenth of it there are left out: those of stiff bearings and supports.

    Parameters
    ----------
    planetary_set : PlanetarySet
    stiffness : (2N,) array
        Mean mesh stiffness [N/m].
    bodies, sun_torque
        As for `elastic_set`; motor and brake are left out.
    """
    names = rigid_dofs(planetary_set.n_planets, False, False)
    place = {name: i for i, name in enumerate(names)}
    M, K, W = np.zeros(len(names)), np.zeros((len(names),) * 2), np.zeros((len(names), len(stiffness)))
    _place_bodies(M, K, place, planetary_set, bodies)
    _mesh_directions(W, place, planetary_set, 1.0 if sun_torque >= 0 else -1.0)
    K += (W * stiffness) @ W.T
    values, shapes = np.linalg.eigh(K / np.sqrt(np.outer(M, M)))
    strain = stiffness @ (W.T @ (shapes / np.sqrt(M)[:, None])) ** 2
    return float(np.sqrt(values[strain > 0.1 * np.abs(values)].max()) / (2 * np.pi))


def ring_mesh_compliance(harmonic_compliance, nodal_diameters, count, angles) -> np.ndarray:
    """Static compliance of the dynamic ring between its mesh points, shape (N, N) [m/N].

    Parameters
    ----------
    harmonic_compliance : (m,) array
        ``H_n`` of the ring's load functional for each nodal diameter.
    nodal_diameters : (m,) int array
        The nodal diameters that the dynamic ring keeps, from zero.
    count : int
        Number of teeth.
    angles : (N,) array
        Planet angles [rad].
    """
    n = np.asarray(nodal_diameters)
    weight = np.where((n == 0) | (2 * n == count), 1.0, 2.0) / count
    offset = np.asarray(angles)[:, None] - np.asarray(angles)[None, :]
    wave = np.exp(1j * n[:, None, None] * offset)
    return np.einsum("n,n,nij->ij", weight, np.asarray(harmonic_compliance), wave.conj()).real


def body_flexibility(compliance, held_compliance) -> np.ndarray:
    """Compliance between the meshes through their bodies that neither springs nor ring modes hold, (2N, 2N).

    Parameters
    ----------
    compliance : (2N, 2N) array
        Between the static meshes, the ring held [m/N]; its diagonal belongs to the mesh springs.
    held_compliance : (N, N) array
        That of the dynamic ring, see `ring_mesh_compliance` [m/N].
    """
    N = len(held_compliance)
    flexibility = 0.5 * (compliance + compliance.T)
    flexibility[N:, N:] -= held_compliance
    np.fill_diagonal(flexibility, 0.0)
    return flexibility


def mesh_excitation(
    stiffness, deflection, force, held_compliance, *, ring_compliance=None, flexibility=None, backlash
) -> MeshExcitation:
    """Mesh springs of the dynamic model: the static meshes less what the other parts keep elastic.

    ``1/k_dyn = 1/k - c_jj`` for the tangent stiffness, both with the ring held, so that what the foundation
    gives way, which may be by far the most, cancels nowhere; and ``delta - C F`` for the deflection, with
    ``C`` the compliance of the dynamic ring between its mesh points and of the bodies between theirs.

    Parameters
    ----------
    stiffness, deflection, force : (2N, P) arrays
        Tangent stiffness with the ring held [N/m], deflection [m] and force [N] of the static meshes.
    held_compliance : (N, N) array
        See `ring_mesh_compliance`, the outer surface held [m/N].
    ring_compliance : (N, N) array, optional
        The same with the ring as it is in `deflection`; held when left out.
    flexibility : (2N, 2N) array, optional
        See `body_flexibility` [m/N].
    backlash : float or (2N,) array
        [m].

    Raises
    ------
    CaseError
        Without torque there is no mesh stiffness to linearise.
    ContactError
        When a mesh opens at some position, or the bodies are softer than their meshes.
    """
    force, stiffness = np.asarray(force), np.asarray(stiffness)
    N = len(force) // 2
    flexibility = np.zeros((2 * N, 2 * N)) if flexibility is None else flexibility
    ring_compliance = held_compliance if ring_compliance is None else ring_compliance
    if not force.any():
        raise CaseError(
            "without torque no tooth carries load, so there is no mesh stiffness for the dynamic model",
            code="E-NO-LOAD",
            key="operation.torque",
            limit="not zero for modes, dynamics and housing",
            remedy="give a torque, or run with --only static",
        )
    opened = np.flatnonzero((stiffness <= 0).any(axis=1))
    if len(opened):
        planets = sorted(set(opened % N + 1))
        raise ContactError(
            f"planet {', '.join(map(str, planets))} carries nothing at some positions: the linear dynamic "
            "model cannot represent loss of contact",
            code="E-CONTACT-OPEN",
            remedy="raise operation.torque or reduce the errors",
        )
    own = np.zeros((2 * N, 1))
    own[N:, 0] = np.diag(held_compliance)
    remaining = 1.0 / stiffness - own
    between = np.diag(remaining.min(axis=1)) + flexibility
    if remaining.min() <= 0 or np.linalg.eigvalsh(between)[0] <= 0:
        raise ContactError(
            "the compliance of the ring model exceeds that of the loaded mesh", code="E-CONTACT-COMPLIANCE"
        )
    spring = deflection - flexibility @ force
    spring[N:] -= ring_compliance @ force[N:]
    return MeshExcitation(
        stiffness=1.0 / remaining,
        deflection=spring,
        force=force,
        backlash=np.broadcast_to(np.asarray(backlash, float), (2 * N,)),
    )


def ring_field(
    model: ElasticSet, ring: CyclicModes, coordinates, output: int, max_diameter: int
) -> np.ndarray:
    """Circumferential components of a ring output from complex harmonics of the ring's coordinates.

    ``u(phi, t) = Re sum_h sum_n U[h, n] e^{i n phi} e^{i h omega t}``.

    Parameters
    ----------
    coordinates : (..., ring coordinates) complex array
        Harmonics of the ring's coordinates.
    output : int
        Index of the output in ``ring.output``.
    max_diameter : int
        Largest nodal diameter of the result.

    Returns
    -------
    (..., 2 max_diameter + 1) complex array
        Components n = -max_diameter .. max_diameter.
    """
    mode, n = model.ring_mode, model.ring_diameter
    value = (ring.norm * ring.output[:, output])[mode]
    single = ~ring.paired[mode]
    turn = np.where(model.ring_phase == 1, -1j, 1.0)
    half = np.where(single, 1.0, 0.5)
    columns = np.zeros((len(mode), 2 * max_diameter + 1), complex)
    row = np.arange(len(mode))
    inside = n <= max_diameter
    np.add.at(columns, (row[inside], max_diameter + n[inside]), (half * turn * value)[inside])
    mirrored = inside & ~single
    np.add.at(columns, (row[mirrored], max_diameter - n[mirrored]), (half * np.conj(turn * value))[mirrored])
    return np.asarray(coordinates) @ columns


def turning_system(model: ElasticSet, *, centre_distance: float, carrier_speed: float) -> MechanicalSystem:
    """Add the inertia terms of the turning carrier frame to the matrices of the set.

    A body of mass m at rest in that frame has ``m (x'' - 2 Omega y' - Omega^2 x)`` and
    ``m (y'' + 2 Omega x' - Omega^2 y)`` (J. Lin and R. G. Parker, J. Vib. Acoust. 121, 1999, 316-321). The
    ring does not turn: its points run backwards through the frame, ``d/dt - Omega d/dphi`` (S. C. Huang and
    W. Soedel, J. Sound Vib. 115, 1987, 253-274). The pair ``q = c - i s`` of n nodal diameters, displacement
    ``Re(q U e^{i n phi})``, has the velocity ``q' - i n Omega q``: the terms of a body of mass 1 at the speed
    ``n Omega``. Alone it has ``f +- n Omega / 2 pi`` in the frame and f on the ring.

    The centrifugal force ``m Omega^2 a`` of a planet pulls its pin outwards; when the carrier turns by theta
    the pin comes inwards by ``a theta^2 / 2``, which stiffens that rotation by ``m (Omega a)^2`` a planet. It
    balances the centripetal term of the planets, so that the rotation of the mechanism stays free.

    Parameters
    ----------
    model : ElasticSet
    centre_distance : float
        Of sun and planets, a [m].
    carrier_speed : float
        Mean speed Omega of the carrier [rad/s].

    Returns
    -------
    MechanicalSystem
        ``gyroscopic`` multiplies the carrier speed; K holds the centripetal terms, the load the centrifugal
        forces of the planets.
    """
    system = model.system
    place, mass = {name: i for i, name in enumerate(system.dofs)}, np.diag(system.M)
    x = np.array([i for name, i in place.items() if name.endswith(": x")])
    sine = model.ring_slice.start + np.flatnonzero(model.ring_phase == 1)
    diameter = model.ring_diameter[sine - model.ring_slice.start]
    first, second = np.concatenate([x, sine - 1]), np.concatenate([x + 1, sine])
    waves = np.concatenate([np.ones(len(x)), diameter])
    gyroscopic, centripetal, load = np.zeros_like(system.K), np.zeros(len(mass)), system.load.copy()
    gyroscopic[first, second] = -2.0 * waves * mass[first]
    gyroscopic[second, first] = 2.0 * waves * mass[first]
    centripetal[first] = centripetal[second] = waves**2 * mass[first]
    for number, psi in enumerate(model.planet_angles):
        i = place[f"planet {number + 1}: x"]
        centripetal[place["carrier: rotation"]] -= mass[i] * centre_distance**2
        outwards = carrier_speed**2 * mass[i] * centre_distance
        load[i : i + 2] += outwards * np.array([np.cos(psi), np.sin(psi)])
    K = system.K - carrier_speed**2 * np.diag(centripetal)
    return replace(system, K=K, load=load, gyroscopic=gyroscopic)


def ring_wave_shares(model: ElasticSet, shape) -> np.ndarray:
    """Share the kinetic energy of complex modes out among the travelling waves of the ring.

    Parameters
    ----------
    model : ElasticSet
    shape : (n, m) complex array
        Mode shapes, motion ``Re(shape e^{i omega t})``.

    Returns
    -------
    (2 n_max + 1, m) array
        Row ``n_max + n``: the part of the whole that the waves ``e^{i n phi} e^{i omega t}`` hold, phi in the
        carrier frame; a point of the ring hears them at ``omega - n Omega``. Standing waves have equal parts
        of n and -n; the other bodies hold what the sum over n misses.
    """
    shape = np.asarray(shape, complex)
    total = np.einsum("im,ij,jm->m", shape.conj(), model.system.M, shape).real
    ring, n = shape[model.ring_slice], model.ring_diameter
    largest = int(n.max(initial=0))
    shares = np.zeros((2 * largest + 1, shape.shape[1]))
    single = np.ones(len(n), bool)
    sine = np.flatnonzero(model.ring_phase == 1)
    single[sine] = single[sine - 1] = False
    for sign in (1, -1):
        wave = np.abs(ring[sine - 1] - sign * 1j * ring[sine]) ** 2 / 2.0
        np.add.at(shares, largest + sign * n[sine], wave)
    alone = np.flatnonzero(single)
    for row in (largest + n[alone], largest - n[alone]):
        np.add.at(shares, row, 0.5 * np.abs(ring[alone]) ** 2)
    return shares / total


@dataclass(frozen=True)
class RingModel:
    """Modes of the ring and its static compliance at the meshes.

    Parameters
    ----------
    modes : CyclicModes
        One load (displacement into the ring at the loaded flank), outputs radial and tangential
        displacement of the outer surface above a tooth.
    load_angle : float
        Angle from a planet to the centre of the ring tooth that it loads [rad].
    compliance : (n_max + 1,) array
        Static compliance of each nodal diameter at the load, on the foundation [m/N].
    held_compliance : (n_max + 1,) array
        The same with the outer surface held [m/N].
    """

    modes: CyclicModes
    load_angle: float
    compliance: np.ndarray
    held_compliance: np.ndarray


def outer_surface_outputs(grid: Grid) -> np.ndarray:
    """Radial and tangential displacement of the outer surface at the tooth centreline, shape (2n, 2)."""
    rim = np.unique(grid.boundaries["rim"])
    node = rim[np.argmin(np.abs(grid.points[rim, 1]))]
    outputs = np.zeros((2 * len(grid.points), 2))
    outputs[2 * node, RADIAL] = outputs[2 * node + 1, TANGENTIAL] = 1.0
    return outputs


def ring_model(
    planetary_set: PlanetarySet,
    grid: Grid,
    stiffness,
    mass,
    foundation,
    load,
    *,
    max_diameter: int,
    max_frequency: float,
    side: float = 1.0,
) -> RingModel:
    """Ring modes for nodal diameters 0..max_diameter.

    Parameters
    ----------
    planetary_set : PlanetarySet
    grid : Grid
        Sector of the ring.
    stiffness, mass, foundation : (2n, 2n) sparse matrices
        Of the sector.
    load : (2n, 1) array
        Unit force into the ring at the flank that carries.
    max_diameter : int
    max_frequency : float
        Modes beyond are represented by their static part [Hz].
    side : float
        Sign of the sun's torque: which flanks carry.
    """
    from femgear.fe.compliance import condense_sector, cyclic_harmonics
    from femgear.fe.reduction import cyclic_modes, sector_basis
    from femgear.gears.gear import half_thickness_angle

    ring = planetary_set.ring
    diameters = np.arange(max_diameter + 1)
    basis = sector_basis(grid, stiffness + foundation, mass, count=ring.teeth, loads=load)
    modes = cyclic_modes(
        basis,
        nodal_diameters=diameters,
        loads=load,
        outputs=outer_surface_outputs(grid),
        max_frequency=max_frequency,
    )
    compliance = [
        np.real(
            cyclic_harmonics(
                condense_sector(grid, matrix, count=ring.teeth, held=held, loads=load, observations=load),
                diameters,
            )[:, 0, 0]
        )
        for matrix, held in ((stiffness + foundation, None), (stiffness, "rim"))
    ]
    pitch_radius = ring.base_radius / np.cos(planetary_set.working_pressure_angle_planet_ring)
    return RingModel(
        modes=modes,
        load_angle=-side * float(half_thickness_angle(ring, pitch_radius)),
        compliance=compliance[0],
        held_compliance=compliance[1],
    )
