"""Rigid gears of a pair on their bearings and shafts: matrices, excitation, kinds of modes, what is measured.

Every gear moves along x and y where it has a bearing, and turns; motor and brake turn behind couplings. With
the unit vector n of the force of gear 1 on gear 2 the flanks approach by

``delta = flank (r_b1 theta_1 - s r_b2 theta_2) + n . (u_1 - u_2)``

with s = 1 of an internal, -1 of an external gear 2, and the flank that the sign of the torque loads (H. N.
Ozguven, D. R. Houser, J. Sound Vib. 121, 1988, 383-411, review models of this kind). The transmission error
is its part by the rotations. Mesh stiffness and static transmission error are those of the loaded contact,
resolved where tooth pairs begin and cease to carry (`femgear.contact.loaded_period`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.case.gear_set import line_play, set_deviations
from femgear.case.tooth_friction import friction_acts
from femgear.contact.cycle import CycleOptions
from femgear.contact.loaded_period import loaded_period
from femgear.exchange.dynamic_model import DynamicModel
from femgear.fe.beam import body_matrices
from femgear.gears.kinematics import unit_vectors
from femgear.gears.pair import GearPair
from femgear.solvers.linear.modal import modal_damping
from femgear.solvers.linear.state_space import Port, modal_model
from femgear.stages.friction_source import friction_source
from femgear.stages.static import over_width, record_positions
from femgear.stages.static_results import StaticResult
from femgear.system.assembly import GROUND, IN_PLANE, ROTATION, Assembly, Inertia, gear_contact, held_motions, joint
from femgear.system.system import (
    HarmonicForce,
    MechanicalSystem,
    MeshExcitation,
    Modes,
    NonlinearSystem,
    gear_meshes,
    source_harmonics,
)
from femgear.trains.pair.case_file import PairCase

_RECORD = 2**13
"""Positions of the excitation in the mesh period."""
_ONE_KIND = 0.9
"""Share of the kinetic energy from which on a mode is torsional, or lateral."""


@dataclass(frozen=True)
class PairModel:
    """A pair as a mechanical system.

    Parameters
    ----------
    system : MechanicalSystem
        The mesh is its only column; ``C`` is zero.
    rotation : (n,) array
        Approach of the flanks per unit of each coordinate, by the rotations alone.
    supported : (4, n) array
        Rows of x and y of gear 1 and gear 2; zero of held axes.
    bearing_stiffness : (4,) array
        Of these rows [N/m], infinite of held axes.
    normal, tangent : (2,) arrays
        Directions of the force and of the friction force of gear 1 on gear 2.
    """

    system: MechanicalSystem
    rotation: np.ndarray
    supported: np.ndarray
    bearing_stiffness: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray

    def measured(
        self, motion: np.ndarray, force: np.ndarray, source: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Give transmission error [m] and forces of gears on bearings [N] of lines of all rows.

        Of lines (..., 5, L) of ``rotation`` and ``supported`` [m], of the mesh force (..., L) [N] and of the sources
        (..., 3, L) of friction, the lines (..., 1, L) and (..., 2, 2, L); a held axis carries what the mesh exerts on
        its gear.
        """
        held = np.isinf(self.bearing_stiffness)
        stiffness = np.where(held, 0.0, self.bearing_stiffness)[:, None]
        reaction = held[:, None] * np.concatenate([-self.normal, self.normal])[:, None]
        bearing = stiffness * motion[..., 1:, :] + reaction * force[..., None, :]
        if source is not None:
            # the friction force of gear 1 on gear 2 is the first source, reversed
            along = held[:, None] * np.concatenate([self.tangent, -self.tangent])[:, None]
            bearing = bearing + along * source[..., :1, :]
        return motion[..., :1, :], bearing.reshape(*bearing.shape[:-2], 2, 2, -1)

    @property
    def rows(self) -> np.ndarray:
        """``rotation`` and ``supported`` (5, n)."""
        return np.vstack([self.rotation, self.supported])


def pair_model(case: PairCase, gears: GearPair) -> PairModel:
    """Assemble bodies, bearings, couplings and mesh of a case; the torque loads motor, mesh and brake."""
    machines = [(gear, name, getattr(case, name)) for gear, name in enumerate(("motor", "brake"))]
    machines = [machine for machine in machines if machine[2] is not None]
    sections, torque = (case.gear_1, case.gear_2), case.operation.torque
    radii = [gear.base_radius for gear in gears.gears]
    names = ("gear 1", "gear 2", *(name for _, name, _ in machines))
    bodies = (body_matrices(section.mass, section.inertia, 0.5 * section.inertia) for section in sections)
    inertias = [Inertia((i,), *matrices) for i, matrices in enumerate(bodies)]
    bearing = np.repeat([section.bearing_stiffness or np.inf for section in sections], 2)
    nowhere = np.zeros(3), np.zeros(3)
    springs = [
        joint(f"bearing of {names[i]}", (GROUND, i), nowhere, [*bearing[2 * i : 2 * i + 2], 0.0, 0.0, 0.0, 0.0])
        for i in (0, 1)
    ]
    ends = [0, 1]
    for station, (gear, name, motor) in enumerate(machines, 2):
        inertias.append(Inertia((station,), *body_matrices(0.0, motor.inertia, 0.0)))
        springs.append(joint(f"coupling of {name}", (gear, station), nowhere, [*np.zeros(5), motor.coupling_stiffness]))
        ends[gear] = station
    (kind,), (angle,) = gears.kinds, gears.mesh_angles.tolist()
    contact = gear_contact(
        "mesh",
        (0, 1),
        unit_vectors(angle),
        (radii[0], radii[1]),
        kind.working_pressure_angle,
        flank=-1 if torque < 0 else 1,
        internal=gears.gears[1].internal,
    )
    held = held_motions(len(names), IN_PLANE)
    held.reshape(-1, 6)[2:, :ROTATION] = True
    load = np.zeros((len(names), 6))
    load[ends, ROTATION] = torque, -gears.senses[1] * torque * radii[1] / radii[0]
    places = np.zeros((len(names), 3))
    centre = gears.centres[1][0]
    places[1, :2] = centre.real, centre.imag
    assembly = Assembly(names, places, held, tuple(inertias), (), tuple(springs), (contact,))
    system, motions = assembly.system(load.ravel()), assembly.motions.reshape(len(names), 6, -1)
    rotation = np.einsum("s,sm->m", assembly.columns[[ROTATION, 6 + ROTATION], 0], motions[:2, ROTATION])
    if friction_acts(case):
        directions = assembly.motions.T @ assembly.sliding_columns
        system = replace(system, sources=np.column_stack([directions, motions[ends[1], ROTATION]]))
    tangent = contact.sliding[0, 0, 0, :2]
    return PairModel(system, rotation, motions[:2, :2].reshape(4, -1), bearing, contact.normals[0, :2], tangent)


def pair_excitation(case: PairCase, static: StaticResult, friction: tuple[float, ...] | None) -> MeshExcitation:
    """Compute mesh stiffness, transmission error and force of the loaded pair over one mesh period.

    With a coefficient of friction, see `femgear.case.tooth_friction.acting_friction`, its forces too.
    """
    gears: GearPair = static.planetary_set
    deviations, slices = set_deviations(case), over_width(case, gears, waves=static.waves)
    if slices:
        slices |= {"held_waves": slices["waves"]}
    state = loaded_period(
        gears,
        static.bodies,
        static.bodies,
        sun_torque=static.sun_torque,
        positions=record_positions(case, gears),
        contact=case.static.contact,
        deviations=None if deviations.ideal else deviations,
        options=CycleOptions(friction=friction, **slices),
    )
    record = (state.resampled(name, _RECORD) for name in ("stiffness", "deflection", "force"))
    return MeshExcitation(*record, backlash=np.array([line_play(case)]), source=friction_source(state, _RECORD))


def separating_pair(model: PairModel, modes: Modes, excitation: MeshExcitation, harmonics: int) -> NonlinearSystem:
    """Make the pair whose flanks part and meet their back sides, with so many harmonics of the excitation.

    Friction that acts does so as with flanks in contact.

    The modes give the viscous damping, which flanks that are apart have too, as in A. Kahraman and R. Singh,
    J. Sound Vib. 142, 1990, 49-75.
    """
    damping = modal_damping(model.system, modes.mesh_stiffness, modes.damping_ratio)
    meshes, system, forces = gear_meshes(excitation, harmonics=harmonics), replace(model.system, C=damping), ()
    lines = source_harmonics(excitation, harmonics)
    if lines is not None and system.sources is not None:
        acting = system.sources @ lines
        system = replace(system, load=system.load + np.real(acting[:, 0]))
        forces = tuple(HarmonicForce(acting[:, h], (h,)) for h in range(1, harmonics + 1))
    return NonlinearSystem(system, (meshes,), forces)


def pair_kinds(modes: Modes, mass: np.ndarray) -> tuple[str, ...]:
    """Name the modes by the share of the rotations in their kinetic energy; mass matrix (n, n) diagonal."""
    turning = np.array([name.endswith("rotation") for name in modes.dofs])
    shares = np.diag(mass)[turning] @ modes.shape[turning] ** 2
    kinds = np.where(shares <= 1.0 - _ONE_KIND, "lateral", "coupled")
    kinds = np.where(shares >= _ONE_KIND, "torsional", kinds)
    return tuple(np.where(modes.frequency == 0.0, "rigid", kinds).tolist())


def pair_dynamic_model(
    case: PairCase, gears: GearPair, model: PairModel, modes: Modes, excitation: MeshExcitation
) -> DynamicModel:
    """Make the model of a pair whose flanks may part, with torques at its ends."""
    system, unit = model.system, np.eye(len(model.system.dofs))
    outputs = [
        Port(name, "rad" if name.endswith("rotation") else "m", row)
        for name, row in zip(system.dofs, unit, strict=True)
    ]
    outputs.append(Port("transmission error", "m", model.rotation))
    ends = ["gear 1" if case.motor is None else "motor", "gear 2" if case.brake is None else "brake"]
    places = [system.dofs.index(f"{end}: rotation") for end in ends]
    inputs = [
        Port(f"torque on {end}", "N m", unit[place], float(system.load[place]))
        for end, place in zip(ends, places, strict=True)
    ]
    return DynamicModel(
        title=case.title,
        modal=modal_model(system, modes, meshes=gears.mesh_names, inputs=inputs, outputs=outputs),
        excitation=excitation,
        speed=float(max(case.operation.speeds)),
        mesh_rate=case.gear_1.teeth / (2.0 * np.pi),
        driver=places[0],
        separates=True,
    )
