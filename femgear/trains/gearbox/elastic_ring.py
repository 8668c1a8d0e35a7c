"""Elastic rings of planetary stages in the modes of a gearbox.

The ring is that of the train of its teeth: cyclic modes on the foundation, with the springs of its meshes and the
compliance of the bodies between them at the loaded state. Its coordinates join those of the gearbox.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.system.assembly import with_modal_body
from femgear.system.system import MechanicalSystem
from femgear.trains.gearbox.case_file import BoxPlanetarySection, stage_case_of
from femgear.trains.gearbox.contact import loaded_tables
from femgear.trains.gearbox.model import GearboxModel, StageModel
from femgear.trains.registry import train_of


@dataclass(frozen=True)
class ElasticRing:
    """The ring of a stage as modal coordinates.

    Parameters
    ----------
    name : str
        Of the ring.
    stage : StageModel
        Whose ring it is.
    stiffness : (m,) array
        Squares of the natural circular frequencies of its modes [1/s^2].
    approach : (m, 2N) array
        Approach of the flanks of every mesh per unit of a mode [kg^-1/2].
    springs : (2N,) array
        Mean stiffness of the meshes without what ring and bodies give way [N/m].
    flexibility : (2N, 2N) array
        Compliance of the bodies between the meshes [m/N].
    """

    name: str
    stage: StageModel
    stiffness: np.ndarray
    approach: np.ndarray
    springs: np.ndarray
    flexibility: np.ndarray


def elastic_rings(model: GearboxModel, *, steps: Steps | None = None) -> tuple[ElasticRing, ...]:
    """Compute the elastic rings of all stages that have one, at the torque of the load case.

    FemgearError: what the modes of the set of their teeth are refused for.
    """
    found, steps = [], steps or Steps()
    for stage in model.stages:
        section = stage.section
        if not isinstance(section, BoxPlanetarySection) or not section.elastic_ring:
            continue
        torque = -model.flow.first_torque(section)
        case = stage_case_of(case_text.write(loaded_tables(section, torque, 0)))
        train = train_of(case)
        static, modes = train.stage("static"), train.stage("modes")
        assert static is not None and modes is not None
        solved = modes.solve(case, static.solve(case, steps=steps), steps=steps)
        system, ring = solved.model.system, solved.model.ring_slice
        none = np.zeros((len(stage.meshes), len(stage.meshes)))
        found.append(
            ElasticRing(
                f"ring of {stage.name}",
                stage,
                np.diag(system.K)[ring],
                system.W[ring],
                solved.excitation.stiffness.mean(axis=1),
                none if system.flexibility is None else system.flexibility,
            )
        )
    return tuple(found)


def with_rings(
    system: MechanicalSystem, stiffness: np.ndarray, model: GearboxModel, rings: tuple[ElasticRing, ...]
) -> tuple[MechanicalSystem, np.ndarray]:
    """Join the coordinates of elastic rings to a system, and their springs to the stiffness (g,) of all slices [N/m].

    The slices of a mesh share what its ring and the bodies give way.
    """
    if not rings:
        return system, stiffness
    slices, stiffness = model.assembly.slices, stiffness.copy()
    flexibility = np.zeros((len(stiffness), len(stiffness)))
    rows = []
    for ring in rings:
        approach = np.zeros((len(ring.stiffness), len(stiffness)))
        for place, mesh in enumerate(ring.stage.meshes):
            part = slices[mesh]
            approach[:, part] = ring.approach[:, [place]]
            share = stiffness[part] / stiffness[part].sum()
            stiffness[part] = ring.springs[place] * share
            for other, mate in enumerate(ring.stage.meshes):
                flexibility[part, slices[mate]] = ring.flexibility[place, other]
        rows.append(approach)
    names = [f"{ring.name}: mode {i + 1}" for ring in rings for i in range(len(ring.stiffness))]
    squares = np.concatenate([ring.stiffness for ring in rings])
    joined = with_modal_body(system, squares, np.vstack(rows), names)
    return replace(joined, flexibility=flexibility if flexibility.any() else None), stiffness
