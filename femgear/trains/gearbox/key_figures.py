"""Key figures of a gearbox: load distribution, transmission error, bearings, modes, levels at sensors, by name.

Each stands for the whole gearbox, as "K_Hbeta", and for its parts, as "K_Hbeta second stage". Figures of load cases are
the worst of all of them; those of the response are at the speed of the chosen one, those of the run-up over its speeds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from femgear.case.load_spectrum import required_life, without_line
from femgear.case.lubrication import heat_missing
from femgear.case.quantities import ACCELERATION, RPM, SPEED, Dimension
from femgear.gears.planetary import mesh_names
from femgear.stages.heat_results import HEAT_KEY_FIGURES
from femgear.stages.key_figures import DECIBEL, HOURS, MICROMETRES, NUMBER, STRESS, KeyFigure, Stored
from femgear.stages.life_results import LIFE_FIGURES, SPECTRUM_FIGURES
from femgear.stages.losses_results import LOSS_FIGURES
from femgear.stages.tooth_figures import FRICTION_FIGURE
from femgear.trains.gearbox.case_file import FORCE, BoxPlanetarySection, GearboxCase, PairSection, teeth_of
from femgear.trains.gearbox.casing import bearing_name
from femgear.trains.gearbox.friction import friction_excites
from femgear.trains.gearbox.geometry import set_sizes
from femgear.trains.gearbox.mode_words import mode_distance
from femgear.trains.gearbox.planet_branches import joint_names
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.resonance_table import loudest_resonance
from femgear.trains.gearbox.sensors import gearbox_sensors
from femgear.trains.gearbox.silence import exciting_sections
from femgear.trains.gearbox.stress import stresses_wanted, why_no_stress

_RESPONSES = (("", "dynamics"), ("run-up ", "runup"))
"""Words before the figures of a response, and its stage."""
_OF_FORCES = "W-PULL", "W-TAIL", "W-EXCITATION", "W-CROSS", "W-STEPS"
"""Codes of the findings that concern mesh forces of a response."""


def has_planets(stage: PairSection | BoxPlanetarySection) -> bool:
    """Whether planets run around in a stage."""
    return not isinstance(stage, PairSection) or stage.carrier is not None


def stage_meshes(stage: PairSection | BoxPlanetarySection) -> tuple[str, ...]:
    """Name the meshes of a stage, as the files do."""
    if isinstance(stage, PairSection):
        return (stage.name,)
    count = len(set_sizes(stage).planet_angles)
    return tuple(f"{stage.name} {mesh}" for mesh in mesh_names(count))


def gearbox_key_figures(case: GearboxCase) -> tuple[KeyFigure, ...]:
    """List the key figures of a case by name, those of the whole gearbox before those of its parts."""
    return (*_of_deflection(case), *_of_stresses(case), *_of_losses(case), *_of_modes(), *_of_responses(case))


def _family(
    name: str,
    unit: Dimension,
    stage: str,
    stored: Stored,
    parts: Sequence[tuple[str, tuple[str, ...]]],
    dim: str,
    codes: tuple[str, ...] = (),
) -> Iterator[KeyFigure]:
    """A figure of the whole, and the same of every part: its name with the labels along a dimension."""
    yield KeyFigure(name, unit, stage, stored, codes, whole=True)
    for part, labels in parts:
        of_part = Stored(stored.variable, dim, labels, stored.pick, stored.factor, stored.decibel)
        yield KeyFigure(f"{name} {part}", unit, stage, of_part, codes)


def _of_deflection(case: GearboxCase) -> Iterator[KeyFigure]:
    stages = (*case.pair, *case.planetary)
    meshes = {stage.name: stage_meshes(stage) for stage in stages}
    with_teeth = [stage.name for stage in stages if stage.teeth and case.deflection.contact]
    each = [(mesh, (mesh,)) for names in meshes.values() for mesh in names if len(names) > 1]
    every = [*meshes.items(), *each]
    solved = [(part, labels) for part, labels in every if any(labels[0] in meshes[name] for name in with_teeth)]
    of_mesh = partial(_family, stage="deflection", dim="mesh")
    if with_teeth:
        yield from of_mesh("K_Hbeta", NUMBER, stored=Stored("face_load_factor"), parts=solved)
        yield from of_mesh("STE", MICROMETRES, stored=Stored("transmission_error"), parts=solved)
    if stages:
        misaligned = Stored("mesh_misalignment", pick="size")
        yield from of_mesh("misalignment", MICROMETRES, stored=misaligned, parts=every)
        yield from of_mesh("mesh force", FORCE, stored=Stored("mesh_force"), parts=every)
    if sets := [(stage.name, (stage.name,)) for stage in stages if has_planets(stage)]:
        sharing = Stored("planet_load_factor")
        yield from _family("K_gamma", NUMBER, "deflection", sharing, sets, "stage")
    yield from _of_lives(case)
    names = [bearing_name(section, number) for number, section in enumerate(case.bearing)]
    bearings = [(name, (name,)) for name in names]
    if bearings:
        force = partial(_bearing_force, ())
        yield KeyFigure("bearing force", FORCE, "deflection", force, whole=True)
        for name, labels in bearings:
            yield KeyFigure(f"bearing force {name}", FORCE, "deflection", partial(_bearing_force, labels))
        lives = Stored("spectrum_reference_life", pick="smallest")
        rated = [
            (name, labels)
            for (name, labels), section in zip(bearings, case.bearing, strict=True)
            if section.kind is not None and section.dynamic_rating is not None
        ]
        if rated:
            yield from _family("bearing life", HOURS, "deflection", lives, rated, "bearing")


def _of_stresses(case: GearboxCase) -> Iterator[KeyFigure]:
    """Largest root stresses and contact pressures of the stages that have them."""
    if why_no_stress(case):
        return
    stages = [stage for stage in (*case.pair, *case.planetary) if stresses_wanted(stage)]
    parts = [(stage.name, stage_meshes(stage)) for stage in stages]
    for name, variable in (("root stress", "root_worst"), ("contact pressure", "largest_pressure")):
        yield from _family(name, STRESS, "stress", Stored(variable), parts, "mesh")


def _of_lives(case: GearboxCase) -> Iterator[KeyFigure]:
    """Lives and safeties over the load cases of roots and flanks that have a line of life."""
    stages = [stage for stage in (*case.pair, *case.planetary) if stage.teeth and case.deflection.contact]
    teeth = [teeth_of(stage) for stage in stages]
    if all(len(without_line(gears)) == len(gears.gear_names) for gears in teeth):
        return
    required = required_life(case.operation) is not None
    for figure in (*LIFE_FIGURES, *(SPECTRUM_FIGURES if required else ())):
        yield replace(figure, stage="deflection")


def _bearing_force(labels: tuple[str, ...], data: Any) -> float:
    """Largest force of bearings over all load cases [N]."""
    force = np.hypot(data["radial_force"].values, data["axial_force"].values)
    names = [str(name) for name in data["bearing"].values]
    places = [place for place, name in enumerate(names) if not labels or name in labels]
    return float(force[:, places].max())


def _of_losses(case: GearboxCase) -> Iterator[KeyFigure]:
    if case.losses is None:
        return
    yield from LOSS_FIGURES
    if not heat_missing(case):
        yield from HEAT_KEY_FIGURES
    stages = [stage for stage in (*case.pair, *case.planetary) if stage.teeth and case.deflection.contact]
    for stage in stages:
        of_stage = Stored("stage_efficiency", "stage", (stage.name,), "smallest")
        yield KeyFigure(f"efficiency {stage.name}", NUMBER, "losses", of_stage)


def _of_modes() -> Iterator[KeyFigure]:
    yield KeyFigure("mode distance", NUMBER, "modes", mode_distance, whole=True)


def _of_responses(case: GearboxCase) -> Iterator[KeyFigure]:
    sensors = [(sensor.name, (sensor.name,)) for sensor in gearbox_sensors(case)]
    flow = gearbox_flow(case)
    joint = joint_names(case)
    exciting = [joint.get(stage.name, stage.name) for stage in exciting_sections(case) if flow.carries(stage)]
    excited = [(name, (name,)) for name in dict.fromkeys(exciting)]
    if excited and friction_excites(case):
        yield FRICTION_FIGURE
    for words, stage in _RESPONSES:
        if excited:
            of_forces = partial(_family, stage=stage, parts=excited, dim="stage", codes=_OF_FORCES)
            yield from of_forces(f"{words}force factor", NUMBER, stored=Stored("dynamic_factor"))
            yield from of_forces(f"{words}dynamic mesh force", FORCE, stored=Stored("mesh_force_rms"))
        if not (excited and sensors):
            continue
        level = Stored("level")
        yield from _family(f"{words}level", ACCELERATION, stage, level, sensors, "sensor")
        decibel = Stored("level", decibel=True)
        yield from _family(f"{words}level dB", DECIBEL, stage, decibel, sensors, "sensor")
        if stage == "runup":
            for figure, reads, parts in (
                ("loudest speed", _loudest_speed, sensors),
                ("resonance speed", loudest_resonance, excited),
            ):
                for name, labels in (("", ()), *parts):
                    yield KeyFigure(f"{figure} {name}".rstrip(), SPEED, stage, partial(reads, labels), whole=not name)


def _loudest_speed(labels: tuple[str, ...], data: Any) -> float:
    """Speed of the reference shaft with the largest level at sensors [rad/s]."""
    names = [str(name) for name in data["sensor"].values]
    places = [place for place, name in enumerate(names) if not labels or name in labels]
    at = int(data["level"].values[:, places].max(axis=1).argmax())
    return float(data["speed"].values[at]) * RPM
