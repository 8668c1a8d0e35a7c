"""The vibration of a gearbox whose structure stands still as a model for other programs.

It is the gearbox about its loaded state with the meshes of all stages, each with its own mesh frequency: shafts that
bend, bearings by their tangents, casing, sensors. The teeth of every mesh are one spring along its normal, in the
middle of the face width, with k, force and deflection of their contact; slopes along the width are held by a constant
spring (`femgear.trains.gearbox.nonlinear`).

Planets that run around turn the directions of their meshes against shafts, bearings and casing, so that such a gearbox
has no modes in a frame of its own. With rotations alone, ``motions = "rotation"``, no direction matters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from femgear.errors import CaseError
from femgear.exchange.dynamic_model import DynamicModel
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.state_space import Port, modal_model
from femgear.system.fourier import harmonics_of, sample
from femgear.system.system import MechanicalSystem, MeshExcitation
from femgear.trains.gearbox.case_file import CASING, GearboxCase, PairSection
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.friction import friction_excites
from femgear.trains.gearbox.model import reference_shaft
from femgear.trains.gearbox.modes import count_modes
from femgear.trains.gearbox.nonlinear import NonlinearGearbox, nonlinear_gearbox
from femgear.trains.gearbox.planet_shafts import pair_phases
from femgear.trains.gearbox.sensors import gearbox_sensors, sensor_rows
from femgear.trains.gearbox.transient import all_excitations

_RECORD = 2**13
"""Positions of the mesh period at which all stages are taken."""
_REACH = 3.0
"""Reach of the modes over the highest mesh frequency, where the case says none."""


def check_dynamic_model(case: GearboxCase) -> None:
    """Refuse a gearbox without a linear model in a frame of its own, with the reason (E-MODEL)."""
    reason = next(_against(case), None)
    if reason is not None:
        raise _no_model(*reason)


def gearbox_dynamic_model(case: GearboxCase, results: Mapping[str, Any]) -> DynamicModel:
    """Make the model of a gearbox, with torques at its loads, rotations of its shafts and its sensors.

    CaseError: bearings with play, several free motions (E-MODEL), errors of teeth that span several mesh periods
    (E-PERIODS).
    """
    state: Deflection = results["deflection"].of(case).state
    model, excitations = state.model, all_excitations(state)
    options: dict[str, Any] = {"separates": False, "back_flanks": False, "gyroscopic": False, "turning": False}
    box = nonlinear_gearbox(state, excitations, harmonics=1, **options)
    if box.bearings:
        names = ", ".join(box.bearings)
        raise _no_model("bearing", f"the stiffness of {names} changes with the play", "leave the play out")
    excitation = _together(box)
    system, mean = _linear(box), excitation.stiffness.mean(axis=1)
    frequencies = np.array([model.flow.mesh_frequency[stage.name] for stage in box.stages for _ in stage.meshes])
    top = case.modes.up_to or _REACH * float(frequencies.max())
    count = count_modes(replace(system, load=0.0 * system.load), mean, top)
    modes = undamped_modes(system, mean, damping_ratio=case.modes.damping_ratio, count=count)
    if np.count_nonzero(modes.frequency == 0.0) != 1:
        raise _no_model("shaft", "it has no single motion without strain", "tie all shafts by their stages")
    shaft = reference_shaft(model)
    speed, phases = model.flow.speed[shaft], pair_phases(case, model.flow)
    outputs = list(_outputs(state, box))
    meshes = [mesh for stage in box.stages for mesh in stage.meshes]
    inputs = [
        Port(f"torque on {name}", "N m", box.motion[6 * model.ports[name].station + 5], torque)
        for name, torque in model.flow.port_torque.items()
        if box.motion[6 * model.ports[name].station + 5].any()
    ]
    ahead = np.array([phases.get(stage.name, 0.0) for stage in box.stages for _ in stage.meshes])
    ratio = frequencies / frequencies[0]
    return DynamicModel(
        title=case.title,
        modal=modal_model(system, modes, meshes=meshes, inputs=inputs, outputs=outputs),
        excitation=excitation,
        speed=float(speed),
        mesh_rate=float(frequencies[0] / speed),
        driver=next(i for i, port in enumerate(outputs) if port.name == f"{shaft}: rotation"),
        mesh_ratio=ratio,
        mesh_ahead=ahead - ratio * ahead[0],
    )


def _against(case: GearboxCase) -> Iterator[tuple[str, str, str]]:
    """Say what keeps a gearbox from having a linear model: key, reason, remedy."""
    if not (case.pair or case.planetary):
        yield "pair", "it has no meshes", "export a gearbox with stages"
    of_shafts = [stage.name for stage in case.pair if stage.carrier is not None]
    if of_shafts:
        reason = f"the planets of {', '.join(of_shafts)} are shafts on a carrier, which no such model has"
        yield "pair.carrier", reason, "take lines and histories of femgear run, with [transient] over the time"
    turning = [stage.name for stage in case.planetary if stage.carrier != CASING and case.motions != "rotation"]
    if turning:
        reason = f"the planets of {', '.join(turning)} run around, and with them the directions of their meshes"
        yield "planetary", reason, 'motions = "rotation" gives the model of rotations alone, or hold the carrier'
    if any(stage.elastic_ring for stage in case.planetary):
        yield "planetary.elastic_ring", "planets pass along a ring that bends", "elastic_ring = false"
    if friction_excites(case):
        yield "losses.excites", "friction of the teeth is no part of this model", "losses.excites = false"


def _no_model(key: str, reason: str, remedy: str) -> CaseError:
    """Refuse a gearbox that has no model."""
    limit = "a gearbox that stands still but for its vibration and its rotation"
    return CaseError(
        f"no linear model for other programs: {reason}", code="E-MODEL", key=key, limit=limit, remedy=remedy
    )


def _together(box: NonlinearGearbox) -> MeshExcitation:
    """Excitation of all meshes, each over its own mesh period, at equal positions; without back flanks."""
    long = [stage.name for stage in box.stages if stage.excitation.periods > 1]
    if long:
        raise CaseError(
            f"errors of the teeth of {', '.join(long)} repeat after several mesh periods",
            code="E-PERIODS",
            key="pair.teeth",
            limit="one mesh period in a model for other programs",
            remedy="leave single errors of pitch and runout out",
        )
    arrays = {}
    for name in ("stiffness", "deflection", "force"):
        records = [getattr(stage.excitation, name) for stage in box.stages]
        kept = [harmonics_of(record, (min(record.shape[1], _RECORD) - 1) // 2) for record in records]
        arrays[name] = np.concatenate([sample(lines, _RECORD) for lines in kept])
    return MeshExcitation(**arrays, backlash=np.zeros(len(arrays["force"])))


def _linear(box: NonlinearGearbox) -> MechanicalSystem:
    """System with the springs against slopes, whose columns are the meshes."""
    system, stiffness, load = box.problem.system, box.problem.system.K.copy(), box.problem.system.load.copy()
    for stage in box.stages:
        slope = stage.slope.at(0.0)
        stiffness += (slope.T * stage.slope_stiffness) @ slope
        load -= slope.T @ (stage.slope_moment - stage.slope_stiffness * stage.slope_start)
    columns = np.vstack([stage.drive.at(0.0) for stage in box.stages]).T
    return replace(system, C=np.zeros_like(stiffness), K=stiffness, W=columns, load=load)


def _outputs(state: Deflection, box: NonlinearGearbox) -> Iterator[Port]:
    """List rotations of all shafts, transmission errors of pairs, and sensors with their accelerations."""
    model, T = state.model, box.motion
    for shaft in model.case.shaft:
        yield Port(f"{shaft.name}: rotation", "rad", T[6 * model.first[shaft.name] + 5])
    for stage in model.stages:
        if isinstance(stage.section, PairSection):
            contact = model.assembly.contacts[stage.meshes[0]]
            k = contact.stiffness / contact.stiffness.sum()
            row = sum(
                float(k @ contact.approach[gear, :, 5]) * T[6 * station + 5]
                for gear, station in enumerate(contact.stations)
            )
            yield Port(f"transmission error of {contact.name}", "m", np.asarray(row))
    for sensor, row in zip(gearbox_sensors(model.case), sensor_rows(model) @ T, strict=True):
        yield Port(sensor.name, "m", row, accelerates=True)
