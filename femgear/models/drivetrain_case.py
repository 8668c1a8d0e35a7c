"""From the entries of a drivetrain case to its model, checked, and its torques over time."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from femgear.casefile import drivetrain as sections
from femgear.casefile.drivetrain import DrivetrainCase
from femgear.errors import CaseError
from femgear.models.drivetrain import DrivetrainModel, drivetrain_model
from femgear.models.drivetrain_data import (
    ChainBearing,
    ChainBody,
    ChainShaft,
    Drivetrain,
    MeshWave,
    ParallelStage,
    PlanetaryStage,
)
from femgear.models.drivetrain_torque import TorqueHistory
from femgear.models.drivetrain_torsional import torsional_model
from femgear.models.shaft import ShaftSection

BENDING, TORSIONAL = "with bending", "torsional"
# Natural frequencies below this share of the largest belong to motions that nothing holds.
_FREE = 1e-7


def drivetrain_of(case: DrivetrainCase) -> Drivetrain:
    """The chain of a case.

    Parameters
    ----------
    case : DrivetrainCase

    Returns
    -------
    Drivetrain
    """
    return Drivetrain(
        tuple(ChainBody(b.name, b.mass, b.inertia, b.transverse_inertia, b.tilts) for b in case.body),
        tuple(_shaft(one) for one in case.shaft),
        tuple(_parallel(one) for one in case.parallel),
        tuple(_planetary(one) for one in case.planetary),
        tuple(_bearing(one) for one in case.bearing),
        0.0 if case.gravity is None else case.gravity.acceleration,
        case.simulation.damping_ratio,
    )


def _shaft(one: sections.ShaftSection) -> ChainShaft:
    section = None
    if one.outer_diameter is not None:
        section = ShaftSection(
            one.outer_diameter, one.inner_diameter, one.youngs_modulus, one.poisson_ratio, one.density
        )
    return ChainShaft(
        *one.between, one.length, one.bending, one.torsion, one.shear, one.shear_ratio, section, one.elements
    )


def _wave(one: sections.MeshSection) -> MeshWave:
    backlash = math.inf if one.backlash is None else one.backlash
    return MeshWave(one.stiffness, one.contact_ratio, one.low_share, one.phase, backlash)


def _bearing(one: sections.BearingSection) -> ChainBearing:
    place = one.shaft or (one.body, None)
    return ChainBearing(
        place[0], one.radial, one.tilt, one.offset, one.torsion, other=place[1], station=one.station or 0
    )


def _parallel(one: sections.ParallelSection) -> ParallelStage:
    cosine = math.cos(one.pressure_angle)
    if one.module is not None:
        radii = tuple(0.5 * one.module * teeth for teeth in one.teeth)
    else:
        radii = one.radii or tuple(radius / cosine for radius in one.base_radii)
    return ParallelStage(
        *one.between, *radii, one.teeth[0], _wave(one.mesh), one.pressure_angle, one.helix_angle,
        one.direction, *one.offsets,
    )  # fmt: skip


def _planetary(one: sections.PlanetarySection) -> PlanetaryStage:
    cosine = math.cos(one.pressure_angle)
    if one.module is not None:
        # half teeth of the planet are a matter of its profile shift
        teeth = one.sun_teeth, 0.5 * (one.ring_teeth - one.sun_teeth)
        sun, planet = (0.5 * one.module * number for number in teeth)
    elif one.sun_radius is not None:
        sun, planet = one.sun_radius, one.planet_radius
    else:
        sun, planet = one.sun_base_radius / cosine, one.planet_base_radius / cosine
    angles = one.planet_angles or tuple(2.0 * math.pi * p / one.planets for p in range(one.planets))
    return PlanetaryStage(
        one.carrier, one.sun, sun, planet, one.ring_teeth, one.sun_teeth, one.planet_mass, one.planet_inertia,
        one.planet_transverse_inertia, _wave(one.sun_mesh), _wave(one.ring_mesh), angles,
        one.pressure_angle, one.planet_bearing,
    )  # fmt: skip


def torque_histories(case: DrivetrainCase, ratio: Mapping[str, float]) -> tuple[TorqueHistory, ...]:
    """Torques of a case; a share balances the others over the speed ratios.

    Parameters
    ----------
    case : DrivetrainCase
    ratio : mapping of str to float
        Speeds of the bodies over that of the first one.

    Returns
    -------
    tuple of TorqueHistory
    """
    entries = case.operation.torque
    found = [
        TorqueHistory(one.body, *(([0.0], [one.torque]) if one.times is None else (one.times, one.torques)))
        for one in entries
        if one.share is None
    ]
    for one in entries:
        if one.share is not None:
            times = np.unique(np.concatenate([history.times for history in found]))
            power = sum(ratio[history.body] * history.at(times) for history in found)
            found.append(TorqueHistory(one.body, times, -one.share * power / ratio[one.body]))
    return tuple(found)


def case_model(case: DrivetrainCase, variant: str = BENDING) -> DrivetrainModel:
    """Model of a case.

    Raises
    ------
    CaseError
        Stages that leave no single spin (E-KINEMATICS), mesh directions that cannot turn (E-TURNING).
    """
    build = drivetrain_model if variant == BENDING else torsional_model
    options = {"harmonics": case.simulation.harmonics, "turning": case.simulation.turning}
    try:
        return build(drivetrain_of(case), **options)
    except CaseError as error:
        if error.code == "E-TURNING":
            error.key, error.remedy = "simulation.turning", "write turning = false, which freezes the carrier"
        error.file = case.location(error.key or "")
        raise


def check_drivetrain(case: DrivetrainCase) -> DrivetrainModel:
    """Refuse what the stages cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        As `case_model`; bodies that nothing holds across their axis or against tilting (E-MECHANISM).
    """
    from femgear.solvers.modal import solve_modes

    model = case_model(case)
    modes = solve_modes(model.still, model.mean_stiffness)
    free = np.flatnonzero(modes.frequency < _FREE * modes.frequency.max())
    # the free spin is one of them
    if len(modes.frequency) > 1 and len(free) > 1:
        size = np.abs(modes.shape[:, free]).max(axis=1) * np.sqrt(np.diag(model.system.M))
        names = [name for name in model.system.dofs if not name.endswith("rotation")]
        names.sort(key=lambda name: -size[model.index(name)])
        raise CaseError(
            f"nothing holds {len(free) - 1} motions, such as {', '.join(names[:3])}",
            code="E-MECHANISM",
            key="bearing",
            limit="bearings and shafts that leave the common rotation alone free",
            remedy="add a [[bearing]] or its stiffness, or tilts = false",
            file=case.location("bearing"),
        )
    return model
