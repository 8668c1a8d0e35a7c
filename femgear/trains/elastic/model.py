"""Planetary set with an elastic toothed ring: rigid sun, planets and carrier, FE ring on a foundation.

All bodies move in the plane; coordinates are those of the carrier frame, in which the mean motion is removed.
The gyroscopic and convective terms of that frame are left out; `scripts/gyroscopic.py` shows what they do to
the natural frequencies.

In the carrier frame the teeth of the ring pass under a load that stands still. `ring_model` therefore
represents the ring by its cyclic modes on the foundation, with a load spread over the active flank of one
tooth; what the passing teeth add is part of the mesh stiffness, not of the ring.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import support_stiffness
from femgear.contact.bodies import (
    active_flank_friction,
    active_flank_load,
    active_flank_weights,
    flank_stations,
)
from femgear.errors import ContactError
from femgear.fe.beam import body_matrices
from femgear.fe.compliance import rim_compliance, sector_harmonics, static_cut_shapes
from femgear.fe.reduction import CyclicModes, cyclic_modes, sector_basis, smooth_cut_shapes
from femgear.gears.gear import half_thickness_angle
from femgear.gears.kinematics import torques, unit_vectors
from femgear.housing.two_way.structure import circumferential
from femgear.stages.friction_source import friction_source
from femgear.stages.static import mesh_backlash
from femgear.system.assembly import (
    GROUND,
    IN_PLANE,
    ROTATION,
    Assembly,
    Inertia,
    StationSprings,
    held_motions,
    joint,
    planetary_contacts,
    with_modal_body,
)
from femgear.system.system import MechanicalSystem, MeshExcitation

if TYPE_CHECKING:
    from femgear.case.planetary import Case
    from femgear.contact.bodies import FlankCompliance, Sector
    from femgear.contact.loaded_period import LoadedPeriod
    from femgear.fe.grid import Grid
    from femgear.gears.planetary import PlanetarySet

RADIAL, TANGENTIAL = 0, 1
# nodal diameters of the ring model: their amplitudes fall fast, and 54 points of the housing resolve them
MAX_DIAMETER = 26
# positions of the excitation in one mesh period at least
RECORD = 2**13


@dataclass(frozen=True)
class ElasticSet:
    """The system and the places of its parts.

    Parameters
    ----------
    system : MechanicalSystem
        Equations of motion of gears, carrier and ring.
    rigid_directions : (n, 2N) array
        Mesh directions without the ring's own displacement: ``rigid_directions^T q`` is the dynamic
        transmission error of the gears, ring deflection included.
    ring_slice : slice
        Place of the ring's coordinates.
    ring_diameter, ring_phase : (n_ring,) int arrays
        Nodal diameter and kind (0 cosine, 1 sine) of every ring coordinate.
    ring_mode : (n_ring,) int array
        Index into the ring's CyclicModes of every ring coordinate.
    planet_angles : (N,) array
        [rad]
    """

    system: MechanicalSystem
    rigid_directions: np.ndarray
    ring_slice: slice
    ring_diameter: np.ndarray
    ring_phase: np.ndarray
    ring_mode: np.ndarray
    planet_angles: np.ndarray


def elastic_set(
    case: Case, planetary_set: PlanetarySet, ring: RingModel, *, sun_torque: float, flexibility=None
) -> ElasticSet:
    """Assemble the mechanical system of the rigid gears with their elastic ring.

    Parameters
    ----------
    case : Case
        Bodies with their supports and bearings; the input, at which the motor turns, and the brake at the
        output. Without one of these its torque acts on the member itself.
    planetary_set : PlanetarySet
    ring : RingModel
    sun_torque : float
        Torque on the sun [N m]; its sign tells which flanks carry.
    flexibility : (2N, 2N) array, optional
        Compliance of the bodies between the meshes, see `body_flexibility` [m/N].
    """
    modes, paired = ring.modes, ring.modes.paired
    ring_mode = np.repeat(np.arange(len(paired)), np.where(paired, 2, 1))
    ring_phase = np.concatenate([np.arange(2 if p else 1) for p in paired]).astype(int)
    machines = _machines(case)
    gears = rigid_gears(case, planetary_set, machines, sun_torque=sun_torque)
    load = np.zeros((len(gears.names), 6))
    acting, end = torques(planetary_set, member="sun", torque=sun_torque), {}
    for member in ("sun", "carrier"):
        ends = [name for name, joined, _ in machines if joined == member]
        end[member] = gears.names.index(ends[0] if ends else member)
        load[end[member], ROTATION] += getattr(acting, member)
    rigid = gears.system(load.ravel())
    angles = np.asarray(planetary_set.planet_angles) + ring.load_angle
    columns = np.zeros((len(ring_mode), 2 * planetary_set.n_planets))
    columns[:, planetary_set.n_planets :] = -ring_displacement(modes, ring_mode, ring_phase, angles)
    ring_names = tuple(
        f"ring: n={modes.nodal_diameter[m]} mode {m} {'sine' if p else 'cosine'}" for m, p in zip(ring_mode, ring_phase)
    )
    system = with_modal_body(rigid, (2 * np.pi * modes.frequency[ring_mode]) ** 2, columns, ring_names)
    system, n_rigid, n = replace(system, flexibility=flexibility), len(rigid.dofs), len(system.dofs)
    if modes.load.shape[1] > 1:
        # friction along the flanks, and its turning, on the ring as on the gears; the carrier takes what is lost
        rubbed = np.zeros((2, len(ring_mode), 2 * planetary_set.n_planets))
        for kind, on_ring in enumerate(rubbed):
            shown = ring_displacement(modes, ring_mode, ring_phase, angles, load=kind + 1)
            on_ring[:, planetary_set.n_planets :] = -shown
        taken = gears.motions[6 * end["carrier"] + ROTATION]
        directions = np.vstack([gears.motions.T @ gears.sliding_columns, np.hstack([*rubbed])])
        system = replace(system, sources=np.column_stack([directions, np.append(taken, np.zeros(len(ring_mode)))]))
    return ElasticSet(
        system=system,
        rigid_directions=np.vstack([rigid.W, np.zeros_like(columns)]),
        ring_slice=slice(n_rigid, n),
        ring_diameter=modes.nodal_diameter[ring_mode],
        ring_phase=ring_phase,
        ring_mode=ring_mode,
        planet_angles=np.asarray(planetary_set.planet_angles),
    )


def gears_alone(model: ElasticSet, flexibility) -> MechanicalSystem:
    """Take gears and carrier out of a set, against a ring that is rigid.

    ``flexibility`` (2N, 2N) as for `elastic_set`, without what another model of the ring holds [m/N].
    """
    system, rigid = model.system, slice(model.ring_slice.start)
    return replace(
        system,
        sources=None,
        M=system.M[rigid, rigid],
        C=system.C[rigid, rigid],
        K=system.K[rigid, rigid],
        dofs=system.dofs[rigid],
        W=model.rigid_directions[rigid],
        load=system.load[rigid],
        flexibility=flexibility,
    )


def ring_displacement(ring: CyclicModes, ring_mode, ring_phase, angles, *, load: int = 0) -> np.ndarray:
    """Compute the displacement (n_ring, N) into the ring at its loaded flanks per unit ring coordinate.

    Mode and kind (0 cosine, 1 sine) of every coordinate (n_ring,), angles (N,) of the loaded teeth [rad]; of another
    ``load`` of the ring where that is not 0.
    """
    factor = ring.load[ring_mode, load : load + 1] * np.exp(1j * ring.nodal_diameter[ring_mode, None] * angles)
    sine = ring_phase[:, None] == 1
    return ring.norm[ring_mode, None] * np.where(sine, factor.imag, factor.real)


def _machines(case: Case) -> list[tuple[str, str, Any]]:
    """List motor at the input and brake at the output: name, member that it is coupled to, and entries."""
    output = "carrier" if case.operation.input == "sun" else "sun"
    both = ("motor", case.operation.input, case.motor), ("brake", output, case.brake)
    return [machine for machine in both if machine[2] is not None]


def rigid_gears(case: Case, planetary_set: PlanetarySet, machines, *, sun_torque: float) -> Assembly:
    """Make sun, carrier and planets in the plane, machines behind couplings, and meshes against a ring at rest.

    ``machines`` are names, members that they are coupled to, and entries; the sign of the torque [N m] tells which
    flanks carry.
    """
    N, s = planetary_set.n_planets, planetary_set
    sections = [("sun", case.sun), ("carrier", case.carrier), *((f"planet {n + 1}", case.planet) for n in range(N))]
    names = (*(name for name, _ in sections), *(name for name, *_ in machines))
    inertias, places = list[Inertia](), np.zeros((len(names), 3))
    for station, (_, body) in enumerate(sections):
        inertias.append(Inertia((station,), *body_matrices(body.mass, body.inertia, 0.5 * body.inertia)))
    directions, nowhere = unit_vectors(np.asarray(s.planet_angles)), np.zeros(3)
    places[2 : 2 + N, :2] = s.centre_distance * directions
    springs = list[StationSprings]()
    for station, name in enumerate(("sun", "carrier")):
        radial = support_stiffness(case, name)
        springs.append(
            joint(f"support of {name}", (GROUND, station), (nowhere, nowhere), [radial, radial, *np.zeros(4)])
        )
    bearing = [case.planet.bearing_stiffness] * 2 + [0.0] * 4
    for station in range(2, 2 + N):
        springs.append(joint(f"pin {station - 1}", (1, station), (places[station], nowhere), bearing))
    for station, (name, member, machine) in enumerate(machines, 2 + N):
        inertias.append(Inertia((station,), *body_matrices(0.0, machine.inertia, 0.0)))
        coupling = [*np.zeros(5), machine.coupling_stiffness]
        springs.append(joint(f"coupling of {name}", (names.index(member), station), (nowhere, nowhere), coupling))
    contacts = planetary_contacts(
        (0, range(2, 2 + N), GROUND),
        np.stack([directions, directions], axis=1),
        (s.sun.base_radius, s.planet.base_radius, s.ring.base_radius),
        (s.working_pressure_angle_sun_planet, s.working_pressure_angle_planet_ring),
        flank=-1 if sun_torque < 0.0 else 1,
    )
    held = held_motions(len(names), IN_PLANE)
    held.reshape(-1, 6)[2 + N :, :ROTATION] = True
    return Assembly(names, places, held, tuple(inertias), (), tuple(springs), tuple(contacts))


def highest_mesh_mode(case: Case, planetary_set: PlanetarySet, stiffness, *, sun_torque: float) -> float:
    """Find the highest natural frequency of rigid gears in a rigid ring with the strain in the meshes [Hz].

    Modes with less than a tenth of it there are left out: those of stiff bearings and supports. So are motor
    and brake.

    Parameters
    ----------
    case, planetary_set, sun_torque
        As for `elastic_set`.
    stiffness : (2N,) array
        Mean mesh stiffness [N/m].
    """
    _refuse_open(stiffness <= 0)
    system = rigid_gears(case, planetary_set, (), sun_torque=sun_torque).system()
    M, W = np.diag(system.M), system.W
    values, shapes = np.linalg.eigh((system.K + (W * stiffness) @ W.T) / np.sqrt(np.outer(M, M)))
    strain = stiffness @ (W.T @ (shapes / np.sqrt(M)[:, None])) ** 2
    return float(np.sqrt(values[strain > 0.1 * np.abs(values)].max()) / (2 * np.pi))


def _refuse_open(opened: np.ndarray) -> None:
    """Refuse meshes (2N,) that carry nothing at some positions (E-CONTACT-OPEN)."""
    if opened.any():
        planets = sorted(set(np.flatnonzero(opened) % (len(opened) // 2) + 1))
        raise ContactError(
            f"planet {', '.join(map(str, planets))} carries nothing at some positions: the linear dynamic "
            "model cannot represent loss of contact",
            code="E-CONTACT-OPEN",
            key="operation.torque",
            remedy=(
                "raise operation.torque, reduce the errors, or leave out teeth that are missing or broken",
                "femgear run --only static computes what comes before",
            ),
        )


def ring_mesh_compliance(harmonic_compliance, count: int, angles) -> np.ndarray:
    """Compute the static compliance (N, N) of the dynamic ring between its mesh points [m/N].

    From ``H_n`` (m,) [m/N] of the load functional of a ring with so many teeth, for the nodal diameters from
    zero that the dynamic ring keeps, at planet angles (N,) [rad].
    """
    n = np.arange(len(harmonic_compliance))
    weight = np.where((n == 0) | (2 * n == count), 1.0, 2.0) / count
    offset = np.asarray(angles)[:, None] - np.asarray(angles)[None, :]
    wave = np.exp(1j * n[:, None, None] * offset)
    return np.einsum("n,n,nij->ij", weight, np.asarray(harmonic_compliance), wave.conj()).real


def body_flexibility(compliance, held_compliance) -> np.ndarray:
    """Compute the compliance (2N, 2N) between the meshes that neither springs nor ring modes hold [m/N].

    From that between the static meshes, the ring held (2N, 2N) [m/N], whose diagonal belongs to the mesh
    springs, and that of the dynamic ring (N, N), see `ring_mesh_compliance`.
    """
    N = len(held_compliance)
    flexibility = 0.5 * (compliance + compliance.T)
    flexibility[N:, N:] -= held_compliance
    np.fill_diagonal(flexibility, 0.0)
    return flexibility


def mesh_excitation(
    stiffness,
    deflection,
    force,
    held_compliance,
    *,
    ring_compliance=None,
    flexibility=None,
    backlash,
    periods: int = 1,
) -> MeshExcitation:
    """Make the mesh springs of the dynamic model: static meshes less what other parts keep elastic.

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
    periods : int
        Mesh periods in the record.

    Raises
    ------
    ContactError
        When a mesh opens at some position, or the bodies are softer than their meshes.
    """
    force, stiffness = np.asarray(force), np.asarray(stiffness)
    N = len(force) // 2
    flexibility = np.zeros((2 * N, 2 * N)) if flexibility is None else flexibility
    ring_compliance = held_compliance if ring_compliance is None else ring_compliance
    _refuse_open((stiffness <= 0).max(axis=1))
    held_ring = np.zeros((2 * N, 1))
    held_ring[N:, 0] = np.diag(held_compliance)
    remaining = 1.0 / stiffness - held_ring
    between = np.diag(remaining.min(axis=1)) + flexibility
    if remaining.min() <= 0 or np.linalg.eigvalsh(between)[0] <= 0:
        raise ContactError(
            "the compliance of the ring model exceeds that of the loaded mesh",
            code="E-CONTACT-COMPLIANCE",
            remedy="refine the grid: more static.flank_elements",
        )
    spring = deflection - flexibility @ force
    spring[N:] -= ring_compliance @ force[N:]
    return MeshExcitation(
        stiffness=1.0 / remaining,
        deflection=spring,
        force=force,
        backlash=np.broadcast_to(np.asarray(backlash, float), (2 * N,)),
        periods=periods,
    )


def ring_field(ring: CyclicModes, coordinates, output: int, max_diameter: int) -> np.ndarray:
    """Compute circumferential components of a ring output from harmonics of the ring's coordinates.

    ``u(phi, t) = Re sum_h sum_n U[h, n] e^{i n phi} e^{i h omega t}``.

    Parameters
    ----------
    coordinates : (..., n_ring) complex array
        Harmonics of the ring's coordinates.
    output : int
        Index of the output in ``ring.output``.
    max_diameter : int
        Largest nodal diameter of the result.

    Returns
    -------
    (..., 2 max_diameter + 1) complex array
        Components n = -max_diameter .. max_diameter, in the unit of the output [m].
    """
    return np.asarray(coordinates) @ circumferential(ring, ring.output[:, output], max_diameter)


@dataclass(frozen=True)
class RingModel:
    """Modes of the ring and its static compliance at the meshes.

    Parameters
    ----------
    modes : CyclicModes
        One load (displacement into the ring at the loaded flank), with friction those of
        `femgear.contact.bodies.active_flank_friction` too; outputs radial and tangential displacement of the outer
        surface above a tooth.
    load_angle : float
        Angle from a planet to the centre of the ring tooth that it loads [rad].
    compliance : (n_max + 1,) array
        Static compliance of each nodal diameter at the load, on the foundation [m/N].
    held_compliance : (n_max + 1,) array
        The same with the outer surface held [m/N].
    sector : (Grid, sparse matrix), optional
        Grid of one sector, and its stiffness on the foundation [N/m].
    participation : (m,) complex array, optional
        Mass times displacement of every mode along rigid motions of the whole, of one sector: n = 1 along the
        translation of local components (1, i) [kg^1/2], n = 0 along the rotation [m kg^1/2]; zero of other modes.
    """

    modes: CyclicModes
    load_angle: float
    compliance: np.ndarray
    held_compliance: np.ndarray
    sector: tuple[Grid, Any] | None = None
    participation: np.ndarray | None = None

    @cached_property
    def rim_compliance(self) -> np.ndarray | None:
        """Static compliance (m, 2, 2) of the outer surface, see `rim_compliance`."""
        if self.sector is None:
            return None
        orders = np.arange(2 * self.modes.count + 1)
        return rim_compliance(*self.sector, count=self.modes.count, orders=orders)


def ring_model(
    planetary_set: PlanetarySet,
    sector: Sector,
    mass,
    foundation,
    flanks: tuple[FlankCompliance, FlankCompliance],
    *,
    max_diameter: int,
    max_frequency: float,
    side: float = 1.0,
    friction: bool = False,
) -> RingModel:
    """Compute ring modes for nodal diameters 0..max_diameter under a unit load on the active flank.

    Parameters
    ----------
    planetary_set : PlanetarySet
    sector : Sector
        Of the ring.
    mass, foundation : (2n, 2n) sparse matrices
        Of the sector [kg], [N/m].
    flanks : (FlankCompliance, FlankCompliance)
        Of the ring on its foundation, and with its outer surface held.
    max_diameter : int
        Largest nodal diameter.
    max_frequency : float
        Modes beyond are represented by their static part [Hz].
    side : float
        Sign of the sun's torque: which flanks carry.
    friction : bool
        Whether flanks rub.
    """
    ring, grid = planetary_set.ring, sector.grid
    diameters = np.arange(max_diameter + 1)
    weights = active_flank_weights(flank_stations(grid, ring), planetary_set)
    schurs = [body.surface.at_distribution(weights, side) for body in flanks]  # type: ignore[union-attr]
    load = active_flank_load(grid, planetary_set, side)
    if friction:
        load = np.hstack([load, active_flank_friction(grid, planetary_set, side)])
    basis = sector_basis(
        grid,
        sector.stiffness + foundation,
        mass,
        count=ring.teeth,
        loads=load,
        cut_shapes=smooth_cut_shapes(grid, static_cut_shapes(schurs[0], diameters)),
    )
    modes = cyclic_modes(
        basis,
        nodal_diameters=diameters,
        loads=load,
        outputs=_outer_surface_outputs(grid),
        max_frequency=max_frequency,
    )
    compliance = [np.real(sector_harmonics(schur, diameters)[:, 0, 0]) for schur in schurs]
    pitch_radius = ring.base_radius / np.cos(planetary_set.working_pressure_angle_planet_ring)
    return RingModel(
        modes=modes,
        load_angle=-side * float(half_thickness_angle(ring, pitch_radius)),
        compliance=compliance[0],
        held_compliance=compliance[1],
        sector=(grid, sector.stiffness + foundation),
        participation=_participation(modes, grid, mass),
    )


def _participation(modes: CyclicModes, grid: Grid, mass) -> np.ndarray:
    """Mass times displacement of every mode along rigid motions, see `RingModel`."""
    turn = np.column_stack([-grid.points[:, 1], grid.points[:, 0]]).ravel()
    moved = np.zeros(len(modes.nodal_diameter), complex)
    for diameter, rigid in ((0, turn), (1, np.tile([1.0, 1j], len(grid.points)))):
        chosen = modes.nodal_diameter == diameter
        moved[chosen] = (mass @ rigid) @ (modes.recovery @ modes.reduced[:, chosen]).conj()
    return moved


def _outer_surface_outputs(grid: Grid) -> np.ndarray:
    """Radial and tangential displacement of the outer surface at the tooth centreline, shape (2n, 2)."""
    rim = np.unique(grid.boundaries["rim"])
    node = rim[np.argmin(np.abs(grid.points[rim, 1]))]
    outputs = np.zeros((2 * len(grid.points), 2))
    outputs[2 * node, RADIAL] = outputs[2 * node + 1, TANGENTIAL] = 1.0
    return outputs


def record_count(gears: PlanetarySet, periods: int) -> int:
    """Count the positions of the excitation over some mesh periods.

    Equal planets are equal to rounding when their phases are among them.
    """
    return gears.n_planets * -(-RECORD // gears.n_planets) * periods


def mesh_springs(gears: PlanetarySet, ring: RingModel, state: LoadedPeriod) -> tuple[MeshExcitation, np.ndarray]:
    """Mesh springs of the loaded state, and the compliance (2N, 2N) of the bodies between them [m/N]."""
    held, compliance = (
        ring_mesh_compliance(values, gears.ring.teeth, gears.planet_angles)
        for values in (ring.held_compliance, ring.compliance)
    )
    flexibility = body_flexibility(state.held_compliance, held)
    record = record_count(gears, state.periods)
    excitation = mesh_excitation(
        state.resampled("held_stiffness", record),
        state.resampled("deflection", record),
        state.resampled("force", record),
        held,
        ring_compliance=compliance,
        flexibility=flexibility,
        backlash=mesh_backlash(gears),
        periods=state.periods,
    )
    return replace(excitation, source=friction_source(state, record)), flexibility
