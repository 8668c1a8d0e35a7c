"""The vibration of a planetary set of rigid bodies as a model for other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.case.planetary import RigidCase, output_member
from femgear.exchange.dynamic_model import DynamicModel
from femgear.gears.planetary import mesh_names
from femgear.solvers.linear.state_space import Port, modal_model
from femgear.stages.lumped_set import member_speeds
from femgear.system.mesh_directions import free_motions
from femgear.system.rigid_bodies import CENTRAL, RigidSet, torque_load

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet
    from femgear.system.rigid_bodies import PlanarTorque
    from femgear.system.system import MechanicalSystem, MeshExcitation, Modes

_ALONG = {0: "x", 1: "y", 2: "z"}
"""Motions along axes by their numbers; planets have radial and tangential ones in place of x and y."""
_ALONG_OF_PLANET = {0: "radial", 1: "tangential", 2: "z"}


def lumped_dynamic_model(
    case: RigidCase,
    gears: PlanetarySet,
    data: RigidSet,
    system: MechanicalSystem,
    modes: Modes,
    excitation: MeshExcitation,
    torque: PlanarTorque,
) -> DynamicModel:
    """Make the model of a set with torques on input and output, as far as these turn.

    Parameters
    ----------
    case : RigidCase
    gears : PlanetarySet
    data : RigidSet
        Its bodies.
    system, modes : MechanicalSystem, Modes
        Its equations of motion, and all of their modes.
    excitation : MeshExcitation
        As time goes on, a row for every column of ``W``.
    torque : PlanarTorque
        On the input, and what reacts.
    """
    motions, axes, outputs = free_motions(data), len(data.axes), list[Port]()
    names = [*CENTRAL, *(f"planet {number}" for number in range(1, data.n_planets + 1))]
    for body, (name, radius) in enumerate(zip(names, data.radii, strict=True)):
        along = _ALONG if body < len(CENTRAL) else _ALONG_OF_PLANET
        for place, axis in enumerate(data.axes):
            row = motions[axes * body + place]
            if axis in along:
                outputs.append(Port(f"{name}: {along[axis]}", "m", row))
        outputs.append(Port(f"{name}: rotation", "rad", motions[axes * body + axes - 1] / radius))
    loads, inputs = torque_load(data, torque, np.ones(len(motions), bool)), list[Port]()
    for name in dict.fromkeys((case.operation.input, output_member(case))):
        turn = axes * (CENTRAL.index(name) + 1) - 1
        radius = data.radii[CENTRAL.index(name)]
        if motions[turn].any():
            inputs.append(Port(f"torque on {name}", "N m", motions[turn] / radius, float(loads[turn] * radius)))
    turning, whole = member_speeds(case, gears), mesh_names(data.n_planets)
    slices = system.W.shape[1] // len(whole)
    meshes = [f"{mesh}, slice {number}" for mesh in whole for number in range(1, slices + 1)] if slices > 1 else whole
    named = [port.name for port in outputs]
    return DynamicModel(
        title=case.title,
        modal=modal_model(system, modes, meshes=meshes, inputs=inputs, outputs=outputs),
        excitation=excitation,
        speed=float(max(case.operation.speeds)),
        mesh_rate=turning.mesh_frequency,
        driver=named.index(f"{case.operation.input}: rotation"),
    )
