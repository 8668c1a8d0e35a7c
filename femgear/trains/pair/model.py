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
from femgear.contact.cycle import CycleOptions
from femgear.contact.loaded_period import loaded_period
from femgear.gears.kinematics import body_approach
from femgear.gears.pair import GearPair
from femgear.solvers.linear.modal import modal_damping
from femgear.stages.static import over_width, record_positions
from femgear.stages.static_results import StaticResult
from femgear.system.assembly import assemble, stiffness_matrix
from femgear.system.system import MechanicalSystem, MeshExcitation, Modes, NonlinearSystem, gear_meshes
from femgear.trains.pair.case_file import PairCase

_RECORD = 2**13
"""Positions of the excitation in the mesh period."""
_ONE_KIND = 0.9
"""Share of the kinetic energy from which on a mode is torsional, or lateral."""
_NAMES = ("x", "y", "rotation")


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
    normal : (2,) array
        Direction of the force of gear 1 on gear 2.
    """

    system: MechanicalSystem
    rotation: np.ndarray
    supported: np.ndarray
    bearing_stiffness: np.ndarray
    normal: np.ndarray

    def measured(self, motion: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Give transmission error [m] and forces of gears on bearings [N] of lines of all rows.

        Of lines (..., 5, L) of ``rotation`` and ``supported`` [m], and of the mesh force (..., L) [N], the
        lines (..., 1, L) and (..., 2, 2, L); a held axis carries what the mesh exerts on its gear.
        """
        held = np.isinf(self.bearing_stiffness)
        stiffness = np.where(held, 0.0, self.bearing_stiffness)[:, None]
        reaction = held[:, None] * np.concatenate([-self.normal, self.normal])[:, None]
        bearing = stiffness * motion[..., 1:, :] + reaction * force[..., None, :]
        return motion[..., :1, :], bearing.reshape(*bearing.shape[:-2], 2, 2, -1)

    @property
    def rows(self) -> np.ndarray:
        """``rotation`` and ``supported`` (5, n)."""
        return np.vstack([self.rotation, self.supported])


def pair_model(case: PairCase, gears: GearPair) -> PairModel:
    """Assemble bodies, bearings, couplings and mesh of a case; the torque loads motor, mesh and brake."""
    machines = [(name, getattr(case, name)) for name in ("motor", "brake")]
    machines = [(2 + 3 * i, name, one) for i, (name, one) in enumerate(machines) if one is not None]
    sections, size = (case.gear_1, case.gear_2), 6 + len(machines)
    radii, effect = [gear.base_radius for gear in gears.gears], body_approach(gears, back=case.operation.torque < 0)[0]
    mesh, normal = np.concatenate([effect.ravel(), np.zeros(len(machines))]), effect[0, :2]
    mass = np.array(
        [
            *(value for one in sections for value in (one.mass, one.mass, one.inertia)),
            *(one.inertia for *_, one in machines),
        ]
    )
    bearing = np.repeat([one.bearing_stiffness or np.inf for one in sections], 2)
    lateral, columns, load = [0, 1, 3, 4], np.eye(size)[:, [0, 1, 3, 4]], np.zeros(size)
    springs, torque = list(bearing), case.operation.torque
    ends = [2, 5]
    for place, (rotation, _, one) in enumerate(machines, 6):
        coupling = np.zeros(size)
        coupling[[rotation, place]] = 1.0, -1.0
        columns, springs = np.column_stack([columns, coupling]), [*springs, one.coupling_stiffness]
        ends[rotation // 3] = place
    load[ends] = torque, -gears.senses[1] * torque * radii[1] / radii[0]
    free = np.setdiff1d(np.arange(size), np.array(lateral)[np.isinf(bearing)])
    names = [f"gear {i}: {axis}" for i in (1, 2) for axis in _NAMES]
    names += [f"{name}: rotation" for _, name, _ in machines]
    system = assemble(
        mass,
        stiffness_matrix(columns, np.array(springs)),
        mesh[:, None],
        load,
        motions=np.eye(size)[:, free],
        dofs=[names[i] for i in free],
    )
    rotation = np.where(np.isin(np.arange(size), (2, 5)), mesh, 0.0)
    return PairModel(system, rotation[free], np.eye(size)[lateral][:, free], bearing, normal)


def pair_excitation(case: PairCase, static: StaticResult) -> MeshExcitation:
    """Compute mesh stiffness, transmission error and force of the loaded pair over one mesh period."""
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
        options=CycleOptions(**slices),
    )
    record = (state.resampled(name, _RECORD) for name in ("stiffness", "deflection", "force"))
    return MeshExcitation(*record, backlash=np.array([line_play(case)]))


def separating_pair(model: PairModel, modes: Modes, excitation: MeshExcitation, harmonics: int) -> NonlinearSystem:
    """Make the pair whose flanks part and meet their back sides, with so many harmonics of the excitation.

    The modes give the viscous damping, which flanks that are apart have too, as in A. Kahraman and R. Singh,
    J. Sound Vib. 142, 1990, 49-75.
    """
    damping = modal_damping(model.system, modes.mesh_stiffness, modes.damping_ratio)
    meshes = gear_meshes(excitation, harmonics=harmonics)
    return NonlinearSystem(replace(model.system, C=damping), (meshes,))


def pair_kinds(modes: Modes, mass: np.ndarray) -> tuple[str, ...]:
    """Name the modes by the share of the rotations in their kinetic energy; mass matrix (n, n) diagonal."""
    turning = np.array([name.endswith("rotation") for name in modes.dofs])
    shares = np.diag(mass)[turning] @ modes.shape[turning] ** 2
    found = np.where(shares <= 1.0 - _ONE_KIND, "lateral", "coupled")
    found = np.where(shares >= _ONE_KIND, "torsional", found)
    return tuple(np.where(modes.frequency == 0.0, "rigid", found).tolist())
