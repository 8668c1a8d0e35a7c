"""Errors of planets that are shafts: pins off their places, gears turned on their planet, and who carries more for it.

A planet whose axis stands off by d, or whose gear is turned ahead by theta, approaches its mates by ``W (d, theta)``,
with the rows W of its meshes. The system is solved with springs that begin to press so much earlier, all slices of a
mesh alike. The contact of the teeth sees nothing of it: rotation takes it up. To first order in errors over radii.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from femgear.errors import CaseError
from femgear.trains.gearbox.case_file import GearboxCase, PairSection
from femgear.trains.gearbox.geometry import carriers
from femgear.trains.gearbox.model import GearboxModel


def planet_error_problems(case: GearboxCase) -> Iterator[CaseError]:
    """Refuse errors of planets on what is none: shafts and pairs without a carrier."""
    planets = carriers(case)
    for number, shaft in enumerate(case.shaft):
        if shaft.pin_error is not None and shaft.name not in planets:
            yield CaseError(
                f"{shaft.name} is no planet: it stands on no pin",
                code="E-CHOICE",
                key=f"shaft[{number}].pin_error",
                limit="shafts of pairs with a carrier, beside the axis of the carrier",
                remedy="leave the error out, or move the axis",
            )
    for number, stage in enumerate(case.pair):
        if stage.timing_error and stage.carrier is None:
            yield CaseError(
                f"{stage.name} has no planet",
                code="E-CHOICE",
                key=f"pair[{number}].timing_error",
                value=f"{math.degrees(stage.timing_error):.6g} deg",
                limit="pairs with a carrier",
                remedy="leave the error out, or name the carrier",
            )


def error_gaps(model: GearboxModel) -> np.ndarray:
    """Compute the gaps (g,) that errors of planets leave between the flanks of all slices [m]."""
    assembly, case, planets = model.assembly, model.case, carriers(model.case)
    gap = np.zeros(len(assembly.slice_stiffness))
    for stage in model.stages:
        section = stage.section
        if not isinstance(section, PairSection) or section.carrier is None:
            continue
        contact, part = assembly.contacts[stage.meshes[0]], assembly.slices[stage.meshes[0]]
        turned = next((side for side, shaft in enumerate(section.shafts) if shaft in planets), None)
        for side, shaft in enumerate(section.shafts):
            moved = np.zeros(6)
            if shaft in planets:
                moved[:2] = _off_its_place(case, shaft, planets[shaft])
            if side == turned:
                moved[5] = section.timing_error
            gap[part] -= contact.approach[side] @ moved
    return gap


def _off_its_place(case: GearboxCase, planet: str, carrier: str) -> np.ndarray:
    """Displacement (2,) of the axis of a planet along x and y [m]."""
    shaft = case.shaft_named(planet)
    if shaft.pin_error is None:
        return np.zeros(2)
    out = np.subtract(shaft.axis, case.shaft_named(carrier).axis)
    out /= np.linalg.norm(out)
    return shaft.pin_error.radial * out + shaft.pin_error.tangential * np.array([-out[1], out[0]])
