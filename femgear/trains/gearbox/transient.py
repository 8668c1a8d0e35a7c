"""Motion of a gearbox in time: all stages excite it together, the speed changes with the torques.

The gearbox is that of `femgear.trains.gearbox.nonlinear`, about its loaded state, with the meshes of all stages as
contacts; it goes on with its rigid-body rotation (`femgear.solvers.time.flank_motion`). Phases of the meshes and
angles of the carriers are those of the teeth, gyroscopic terms those of the speed of the load case. Where radii do not
have the ratios of the teeth, torques balance by the radii.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.case.dependencies import Steps
from femgear.errors import CaseError, ConvergenceError
from femgear.moved import former_keywords
from femgear.solvers.time.flank_motion import MarchedRun, Records, march_flanks
from femgear.solvers.time.free_turn import TorqueHistory
from femgear.solvers.time.spun_system import BACK, DRIVE, SPRING, ContactGroup, SpunSystem, free_rotation, spun_system
from femgear.system.force_laws import GearMeshes
from femgear.system.system import MeshExcitation
from femgear.system.turning_meshes import TurningMeshes
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import constant_excitation, excitation_of, varies
from femgear.trains.gearbox.model import reference_shaft
from femgear.trains.gearbox.nonlinear import NonlinearGearbox, NonlinearStage, nonlinear_gearbox
from femgear.trains.gearbox.transient_case import TorqueOverTimeSection, TransientSection, torque_histories

ALL_MOTIONS, TORSIONAL = "all motions", "torsional"
"""Variants of the gearbox that are integrated."""
_GROWN, _WILD = 1e3, 100.0
"""Growth of the free motion from which motions are asked whether they mean anything, and the vibration of a shaft over
its own speed that means nothing."""


@dataclass(frozen=True)
class GearboxInTime:
    """A gearbox ready for integration in time.

    Parameters
    ----------
    box : NonlinearGearbox
        With the meshes of all stages as elements.
    spun : SpunSystem
        The same on its rigid-body rotation; its load is the weight, without torques.
    shaft : str
        That gives the speed.
    """

    box: NonlinearGearbox
    spun: SpunSystem
    shaft: str

    @property
    def stages(self) -> tuple[NonlinearStage, ...]:
        """Stages in the order of their meshes."""
        return self.box.stages

    @property
    def speed(self) -> float:
        """Speed of the shaft that gives it, of the load case [rad/s]."""
        return self.box.deflection.model.flow.speed[self.shaft]

    @property
    def base_ratio(self) -> np.ndarray:
        """Base frequencies (b,) over this speed [1]."""
        return self.box.frequency / self.speed

    @property
    def ratio(self) -> dict[str, float]:
        """Speeds of all shafts over this one, by the teeth."""
        model = self.box.deflection.model
        return {shaft.name: model.flow.speed[shaft.name] / self.speed for shaft in model.case.shaft}

    def rotation(self, name: str) -> np.ndarray:
        """Rotation (n,) of a load or of the left end of a shaft per unit of the coordinates."""
        model = self.box.deflection.model
        station = model.ports[name].station if name in model.ports else model.first[name]
        return self.box.motion[6 * station + 5]

    @property
    def port_ratio(self) -> dict[str, float]:
        """Speeds at all loads over that of the shaft, by which torques balance."""
        model = self.box.deflection.model
        if not self.spun.spin.any():
            shaft = {load.name: load.shaft for load in model.case.load}
            return {port: self.ratio[shaft.get(port, port)] for port in model.ports}
        return {port: self.spun.share(self.rotation(port)) for port in model.ports}

    @property
    def torques(self) -> tuple[TorqueHistory, ...]:
        """Torques over time: those of the load case, and in their place those of `TransientSection.torque`."""
        model = self.box.deflection.model
        transient = model.case.transient
        given: dict[str, TorqueOverTimeSection] = {
            port: TorqueOverTimeSection.model_construct(torque=torque)
            for port, torque in model.flow.port_torque.items()
        }
        given |= {torque.load: torque for torque in (transient.torque if transient else ())}
        return torque_histories(list(given.items()), self.port_ratio)


@former_keywords(found="state")
def gearbox_in_time(
    state: Deflection, transient: TransientSection, *, steps: Steps | None = None, mean_damping: bool = True
) -> GearboxInTime:
    """Make a gearbox ready for integration in time about its loaded state.

    ``mean_damping`` is that of `femgear.trains.gearbox.nonlinear.nonlinear_gearbox`.

    CaseError: planets that are not equally spaced on a carrier that turns (E-TURNING), several motions that nothing
    holds (E-MECHANISM), a stiffness that is not positive (E-STIFFNESS).
    """
    model = state.model
    excitations = all_excitations(state, steps=steps)
    options: dict[str, Any] = {"harmonics": transient.harmonics, "separates": transient.contact_loss}
    options["mean_damping"] = mean_damping
    box = nonlinear_gearbox(state, excitations, **options, back_flanks=transient.back_flanks, turning=transient.turning)
    shaft = reference_shaft(model)
    system = box.problem.system
    made = GearboxInTime(box, _without_contacts(box), shaft)
    load = system.load.copy()
    for port, torque in model.flow.port_torque.items():
        load -= torque * made.rotation(port)
    meshes = [mesh for stage in box.stages for mesh in stage.meshes]
    system, turn = replace(system, load=load), box.motion[6 * model.first[shaft] + 5]
    if not meshes:
        plain = replace(made.spun, system=system)
        return replace(made, spun=replace(plain, spin=free_rotation(plain, turn)))
    laws = tuple(box.bearings.values())
    spun = spun_system(system, _groups(box), meshes, base_ratio=made.base_ratio, shaft=turn, laws=laws)
    return replace(made, spun=spun)


def all_excitations(state: Deflection, *, steps: Steps | None = None) -> Mapping[str, MeshExcitation]:
    """Compute what the meshes of all stages excite with; those of a constant stiffness are springs of it."""
    return {
        stage.name: excitation_of(state, stage, steps=steps)
        if varies(state, stage) or stage.section.counts_pairs
        else constant_excitation(state, stage, steps=steps)
        for stage in state.model.stages
    }


def _groups(box: NonlinearGearbox) -> list[ContactGroup]:
    """Contacts of all elements, with the numbers of their meshes."""
    groups, first, flanks = list[ContactGroup](), 0, {}
    for stage, (drive, back) in zip(box.stages, box.flanks, strict=True):
        flanks[id(drive)] = DRIVE, first + np.arange(len(stage.meshes))
        flanks[id(back)] = BACK, first + stage.back_flanks
        first += len(stage.meshes)
    for element in box.problem.elements[: len(box.problem.elements) - len(box.bearings)]:
        assert isinstance(element, GearMeshes | TurningMeshes)
        side, mesh = flanks.get(id(element), (SPRING, np.zeros(len(element.columns), int)))
        groups.append(ContactGroup(element, side, mesh))
    return groups


def _without_contacts(box: NonlinearGearbox) -> SpunSystem:
    """System without meshes, which does not turn freely."""
    system = box.problem.system
    m = system.W.shape[1]
    turns, tables, none = np.zeros((0, m, 0)), np.zeros((1, 0)), np.zeros(0)
    ways, numbers = (system.W, np.zeros((m, 0)), turns, turns, none), (none, none.astype(int), none.astype(int))
    laws = tuple(box.bearings.values())
    return SpunSystem(system, np.zeros(len(system.M)), *ways, tables, tables, *numbers, (), laws)


@dataclass(frozen=True)
class GearboxMotion:
    """Motion of a gearbox: its ``model``, the ``run``, and the ``shafts`` whose rotations were recorded."""

    model: GearboxInTime
    run: MarchedRun
    shafts: tuple[str, ...]


@former_keywords(told="progress")
def integrate(
    model: GearboxInTime, *, every: int = 1, lowpass: bool = True, progress=lambda share: None
) -> GearboxMotion:
    """Integrate the motion of a gearbox as its case asks for it; one record of ``every`` so many steps.

    ConvergenceError: the motion outgrows the numbers, or all sense (E-DIVERGED).
    """
    case = model.box.deflection.model.case
    transient = case.transient
    assert transient is not None
    shafts = tuple(shaft.name for shaft in case.shaft)
    torques = [(torque, model.rotation(torque.body)) for torque in model.torques]
    try:
        run = march_flanks(
            model.spun,
            torques,
            duration=transient.duration,
            step=1.0 / transient.rate,
            speed=model.speed,
            start=transient.start,
            outputs=np.array([model.box.motion[6 * model.box.deflection.model.first[name] + 5] for name in shafts]),
            records=Records(every, lowpass=lowpass, progress=progress, settle=transient.settled),
            contact_loss=transient.contact_loss,
        )
    except (CaseError, ConvergenceError) as error:
        if error.code in ("E-DIVERGED", "E-START"):
            error.key = "modes.damping_ratio" if error.code == "E-DIVERGED" else "operation.load_case"
            error.file = case.location(error.key)
        raise
    _check_sense(model, run, shafts)
    return GearboxMotion(model, run, shafts)


def _check_sense(model: GearboxInTime, run: MarchedRun, shafts: tuple[str, ...]) -> None:
    """Refuse motions that have grown beyond sense, however exact their balances are."""
    if not run.gain > _GROWN:
        return
    ratio = np.array([model.ratio[name] for name in shafts])
    fastest, vibration = np.abs(run.speed).max() * np.abs(ratio), np.abs(run.velocity).max(axis=0)
    worst = int(np.argmax(vibration - _WILD * fastest))
    if vibration[worst] <= _WILD * fastest[worst]:
        return
    cause, remedy = ", a parametric resonance", "another speed, or transient.contact_loss = true: real meshes separate"
    if run.contact_loss:
        # impacts feed energy into a step rule that is too coarse for them
        cause, remedy = ": an unstable motion, or steps too long for its impacts", "a higher transient.rate"
    raise ConvergenceError(
        f"{shafts[worst]} vibrates with {vibration[worst]:.3g} rad/s beside {fastest[worst]:.3g} rad/s of its own "
        f"speed: the free motion grows {run.gain:.2g} times within the run{cause}",
        code="E-DIVERGED",
        key="modes.damping_ratio",
        limit=f"vibration below {_WILD:g} times the speed of the shaft, where motions grow",
        remedy=f"give more damping, or {remedy}",
    )


def torsional_state(state: Deflection, *, steps: Steps | None = None) -> Deflection:
    """Solve for the loaded state of a gearbox that has rotations alone."""
    return solve_deflection(state.model.case.model_copy(update={"motions": "rotation"}), steps=steps)
