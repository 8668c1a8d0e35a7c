"""Speeds of the run-up of a gearbox: steps, and resonances whose peaks are narrower than these.

At low speed the meshes of a stage act on the modes of the whole gearbox about its loaded state with the part of their
force that the mean stiffness leaves (`femgear.solvers.linear.resonances`). A mode is met where one of the mesh
harmonics that excite it has its frequency. Planets stand where they are in the loaded state: lines beside a mesh
harmonic, by turns of the carrier, meet modes at speeds that differ by one part in the teeth of the ring at most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from femgear.case.dependencies import Steps
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.resonances import crossings, modal_forces, refined_speeds, unresolved
from femgear.system.system import Modes
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.elastic_ring import elastic_rings, with_rings
from femgear.trains.gearbox.excitation import excitation_of, exciting_stages
from femgear.trains.gearbox.model import StageModel, reference_shaft
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.planet_branches import joint_names
from femgear.trains.gearbox.sensors import gearbox_sensors, sensor_rows

_MOST = 1000
"""Mesh harmonics at most."""
_MATTERS = 0.05
"""Expected level of a resonance over that of the loudest from which on it gets speeds of its own."""


@dataclass(frozen=True)
class GearboxResonances:
    """Meetings of a mode of a gearbox with a mesh harmonic.

    Parameters
    ----------
    speed : (c,) array
        Of the reference shaft [rad/s].
    output_level : (c,) array
        What is heard far above the mode, r.m.s. over all sensors [m/s^2]: `femgear.solvers.linear.resonances`.
        Without sensors that of the approach of the flanks.
    damping : (c,) array
        Damping ratio of the mode [1].
    stage : tuple of str
        Stage whose harmonic meets the mode.
    harmonic : (c,) int array
        Mesh harmonic.
    frequency : (c,) array
        Of the mode [Hz].
    """

    speed: np.ndarray
    output_level: np.ndarray
    damping: np.ndarray
    stage: tuple[str, ...]
    harmonic: np.ndarray
    frequency: np.ndarray

    @property
    def expected(self) -> np.ndarray:
        """Level (resonances,) that is expected, but for a factor that is the same of all."""
        return self.output_level / np.where(self.damping > 0.0, self.damping, np.inf)


def gearbox_resonances(
    state: Deflection, slowest: float, fastest: float, *, steps: Steps | None = None
) -> GearboxResonances:
    """Find the resonances of a gearbox between two speeds of its reference shaft.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    slowest, fastest : float
        Ends of the run-up [rad/s].
    steps : Steps, optional
        What other computations have left: excitations of the stages.
    """
    model, case = state.model, state.model.case
    assembly, system, stiffness = linear_system(state)
    rings, count = elastic_rings(model, steps=steps), len(system.dofs)
    system, stiffness = with_rings(system, stiffness, assembly, dict(enumerate(assembly.slices)), rings)
    still = replace(system, gyroscopic=None, load=np.zeros(len(system.dofs)))
    modes = undamped_modes(still, stiffness, damping_ratio=case.modes.damping_ratio)
    at_sensors = (sensor_rows(model) @ assembly.motions @ modes.shape[:count]).T
    for ring in rings:
        part = modes.shape[count : count + len(ring.stiffness)]
        at_sensors += (ring.sensor_rows(gearbox_sensors(case)) @ part).T
        count += len(ring.stiffness)
    up_to, nominal = case.dynamics.up_to, abs(model.flow.speed[reference_shaft(model)])
    parts, names, joint = [np.zeros((6, 0))], list[str](), joint_names(case)
    for stage in exciting_stages(state):
        excitation = excitation_of(state, stage, rings, steps=steps)
        mesh_turns = model.flow.mesh_frequency[stage.name] / nominal
        if not mesh_turns > 0.0:
            continue
        own_modes = _with_meshes(modes, state, stage, stiffness, excitation.stiffness.mean(axis=1))
        most = excitation.stiffness.shape[1] // (2 * excitation.periods) - 1
        most = min(case.dynamics.mesh_harmonics or _MOST, most)
        harmonics = int(np.clip(up_to / (mesh_turns * slowest), 1, most))
        output = at_sensors if at_sensors.shape[1] else own_modes.mesh_deflection.T
        forces = modal_forces(own_modes, excitation, harmonics, output=output)
        crossed = crossings(forces, mesh_turns * slowest, mesh_turns * fastest, up_to)
        strength = forces.output_level[crossed.row, crossed.harmonic - 1]
        modal = forces.damping_ratio[crossed.row], crossed.harmonic, forces.frequency[crossed.row]
        parts.append(np.array([crossed.mesh_frequency / mesh_turns, strength, *modal, crossed.row]))
        names += [joint.get(stage.name, stage.name)] * len(crossed.row)
    every = np.concatenate(parts, axis=1)
    kept = strongest_of_each(names, every[[3, 5]], every[1])
    speed, strength, damping, harmonic, frequency, _ = every[:, kept]
    return GearboxResonances(speed, strength, damping, tuple(names[at] for at in kept), harmonic.astype(int), frequency)


def strongest_of_each(names: list[str], place: np.ndarray, strength: np.ndarray) -> list[int]:
    """Find the resonances that stand for all: equal branches excite a mode together, the strongest one is kept.

    Parameters
    ----------
    names : list of str, (n,)
        Of what excites.
    place : (2, n) array
        Harmonics and numbers of the modes.
    strength : (n,) array
        How strong they are.
    """
    strongest = dict[tuple[str, float, float], int]()
    for at in np.argsort(-strength, kind="stable").tolist():
        strongest.setdefault((names[at], float(place[0, at]), float(place[1, at])), at)
    return sorted(strongest.values())


def _with_meshes(modes: Modes, state: Deflection, stage: StageModel, stiffness: np.ndarray, mean: np.ndarray) -> Modes:
    """Modes with the meshes of one stage alone: mean stiffness (M,) [N/m], approach that of all slices by theirs."""
    approach = np.zeros((len(stage.meshes), len(modes.frequency)))
    for row, mesh in zip(approach, stage.meshes, strict=True):
        part = state.model.assembly.slices[mesh]
        row[:] = stiffness[part] @ modes.mesh_deflection[part] / max(stiffness[part].sum(), math.ulp(0.0))
    return replace(modes, mesh_stiffness=mean, mesh_deflection=approach)


def run_up_speeds(steps_of_speed: np.ndarray, resonances: GearboxResonances) -> tuple[np.ndarray, int]:
    """Add speeds at narrow resonances to those of a run-up; with the number of peaks that still are missed.

    Those of a twentieth of the highest expected level count, see `femgear.solvers.linear.resonances`.

    Parameters
    ----------
    steps_of_speed : (v,) array
        Speeds at equal steps [rad/s], ascending.
    resonances : GearboxResonances
        Between them.
    """
    if len(steps_of_speed) < 2:
        return steps_of_speed, 0
    expected = resonances.expected
    matters = expected > _MATTERS * expected.max(initial=0.0)
    places = resonances.speed[matters], resonances.output_level[matters], resonances.damping[matters]
    speeds = refined_speeds(steps_of_speed, *places)
    return speeds, unresolved(speeds, *places) if matters.any() else 0
