"""The response of a gearbox once more with a longer excitation: what its forces and levels rest on.

No share of the upper half of an excitation tells that. Far below the resonance of the teeth both halves are small, and
what lies beyond makes most of the force. So the longer excitation has twice the frequency, and at least 1.4 times that
of the modes in which the teeth are strained most, as the excitation of elastic sets does
(`femgear.trains.elastic.excitation_limit`). Where the case limits the mesh harmonics it has twice as many.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.case.dependencies import Steps
from femgear.errors import ConvergenceError
from femgear.solvers.linear.modal import undamped_modes
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.excitation import exciting_stages
from femgear.trains.gearbox.modes import linear_system, spring_forces
from femgear.trains.gearbox.response import GearboxResponse, accelerations, level, solve_gearbox_response
from femgear.trains.gearbox.response_results import SENSORS_JUDGED
from femgear.trains.gearbox.sensors import gearbox_sensors

_BEYOND_TEETH = 1.4
"""End of the longer excitation over the highest frequency of the teeth, at least."""
_HIGHEST = 200e3
"""End of any excitation at most [Hz]: that of ``dynamics.up_to``."""
_TOLERANCE = 1e-6
"""Of the longer solution: changes are told from some per cent on."""


def longer_excitation(response: GearboxResponse, *, steps: Steps | None = None) -> GearboxResponse | None:
    """Solve for the response with a longer excitation at the speeds of the largest forces and levels.

    Parameters
    ----------
    response : GearboxResponse
        With the excitation of the case.
    steps : Steps, optional
        What other computations have left: excitations are kept in it.

    Returns
    -------
    GearboxResponse or None
        At the speed with the largest force of every stage, and at the loudest one of the `SENSORS_JUDGED` loudest
        sensors; None where nothing excites, or where the longer one alone is not solved.
    """
    state, case = response.deflection, response.deflection.model.case
    if not response.stages:
        return None
    end = min(_HIGHEST, max(2.0 * response.up_to, _BEYOND_TEETH * teeth_frequency(state)))
    most = case.dynamics.mesh_harmonics and 2 * case.dynamics.mesh_harmonics
    dynamics = case.dynamics.model_copy(
        update={"up_to": end, "mesh_harmonics": most, "tolerance": max(_TOLERANCE, case.dynamics.tolerance)}
    )
    model = replace(state.model, case=case.model_copy(update={"dynamics": dynamics}))
    longer = replace(state, model=model)
    try:
        return solve_gearbox_response(longer, response.speed[_speeds_judged(response)], steps=steps)
    except ConvergenceError:
        return None


def _speeds_judged(response: GearboxResponse) -> np.ndarray:
    """Places of the speeds with the largest force of every stage, and the loudest ones, ascending."""
    places = {int((stage.force[..., 1] / stage.force[..., 0]).max(axis=1).argmax()) for stage in response.stages}
    if count := len(gearbox_sensors(response.deflection.model.case)):
        levels = level(response, accelerations(response, count))
        loudest = np.argsort(-levels.max(axis=0), kind="stable")[:SENSORS_JUDGED]
        places |= {int(at) for at in levels[:, loudest].argmax(axis=0)}
    return np.array(sorted(places))


def teeth_frequency(state: Deflection) -> float:
    """Highest frequency of the modes in which the meshes of an exciting stage have most of their strain energy [Hz].

    Of the gearbox about its loaded state; elastic rings and carriers are rigid here. Modes have unit mass, so that the
    strain energy of a mode is half of its angular frequency squared, of which the meshes of a stage have a share.

    Parameters
    ----------
    state : Deflection
        Loaded state, whose stages with teeth or contact ratios excite.

    Returns
    -------
    float
        Zero where nothing excites.
    """
    assembly, system, stiffness = linear_system(state)
    still = replace(system, gyroscopic=None, load=np.zeros(len(system.dofs)))
    modes = undamped_modes(still, stiffness, damping_ratio=0.0)
    strain = spring_forces(system, stiffness, modes.shape) * (system.W.T @ modes.shape)
    whole = np.maximum((2.0 * math.pi * modes.frequency) ** 2, np.finfo(float).tiny)
    highest = 0.0
    for stage in exciting_stages(state):
        energy = np.sum([strain[assembly.slices[mesh]].sum(axis=0) for mesh in stage.meshes], axis=0)
        share = np.where(modes.frequency > 0.0, energy / whole, 0.0)
        highest = max(highest, float(modes.frequency[share.argmax()]))
    return highest
