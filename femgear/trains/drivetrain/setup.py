"""From the entries of a drivetrain case to its model, checked, and its torques over time.

The loaded flanks of the model are those that the mean torques press together. Runs are refused, by stage,
whose steps, records or spectra cannot represent the motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from femgear.case.units import FREQUENCY, SPEED
from femgear.errors import CaseError
from femgear.storage.dataset import RPM
from femgear.system.fourier import FourierSeries
from femgear.system.shaft import ShaftSection
from femgear.trains.drivetrain import section as drivetrain_section
from femgear.trains.drivetrain.checks import check_spread, loose_motions, speed_ratios, with_drivers
from femgear.trains.drivetrain.data import (
    ChainBearing,
    ChainBody,
    ChainShaft,
    Drivetrain,
    MeshWave,
    ParallelStage,
    PlanetaryStage,
    TorqueHistory,
)
from femgear.trains.drivetrain.model import DrivetrainModel, drivetrain_model, torsional_model
from femgear.trains.drivetrain.section import DrivetrainCase, record_problems, settle_time, spectrum_problems
from femgear.trains.drivetrain.time import (
    GOOD_STEPS,
    LEAST_STEPS,
    SpeedRange,
    default_record_rate,
    highest_mesh,
    speed_range,
)

BENDING, TORSIONAL = "with bending", "torsional"
# Slower instants, over the mean speed, would need records of endless length over a turn.
SLOWEST = 0.05


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


def _shaft(one: drivetrain_section.ShaftSection) -> ChainShaft:
    section = None
    if one.outer_diameter is not None:
        section = ShaftSection(
            one.outer_diameter, one.inner_diameter, one.youngs_modulus, one.poisson_ratio, one.density
        )
    return ChainShaft(
        *one.between, one.length, one.bending, one.torsion, one.shear, one.shear_ratio, section, one.elements
    )


def _wave(one: drivetrain_section.MeshSection) -> MeshWave:
    backlash = math.inf if one.backlash is None else one.backlash
    return MeshWave(one.stiffness, one.contact_ratio, one.low_share, one.phase, backlash)


def _bearing(one: drivetrain_section.BearingSection) -> ChainBearing:
    place = one.shaft or (one.body, None)
    return ChainBearing(place[0], one.radial, one.tilt, one.offset, other=place[1], station=one.station or 0)


def _parallel(one: drivetrain_section.ParallelSection) -> ParallelStage:
    cosine = math.cos(one.pressure_angle)
    if one.module is not None:
        radii = tuple(0.5 * one.module * teeth for teeth in one.teeth)
    else:
        radii = one.radii or tuple(radius / cosine for radius in one.base_radii)
    return ParallelStage(
        *one.between, *radii, one.teeth[0], _wave(one.mesh), one.pressure_angle, one.helix_angle,
        one.direction, *one.offsets, one.driver,
    )  # fmt: skip


def _planetary(one: drivetrain_section.PlanetarySection) -> PlanetaryStage:
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
        one.pressure_angle, one.planet_bearing, one.driver,
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
    """Model of a case, its loaded flanks those that the mean torques press together.

    Raises
    ------
    CaseError
        Stages that leave no single spin (E-KINEMATICS), mesh directions that cannot turn (E-TURNING).
    """
    build = drivetrain_model if variant == BENDING else torsional_model
    options = {"harmonics": case.simulation.harmonics, "turning": case.simulation.turning}
    try:
        train = drivetrain_of(case)
        torques = torque_histories(case, speed_ratios(train))
        return build(with_drivers(train, torques, duration=case.simulation.duration), **options)
    except CaseError as error:
        raise _located(error, case) from None


def _located(error: CaseError, case: DrivetrainCase) -> CaseError:
    """The error of a model in terms of the case file."""
    if error.code == "E-TURNING":
        error.key, error.remedy = "simulation.turning", "write turning = false, which freezes the carrier"
    error.file = case.location(error.key or "")
    return error


def case_speeds(case: DrivetrainCase, model: DrivetrainModel) -> SpeedRange:
    """Speeds of the first body over the run, without its deviation."""
    torques = torque_histories(case, model.ratio)
    return speed_range(model, torques, duration=case.simulation.duration, speed=case.operation.speed)


def record_every(case: DrivetrainCase, model: DrivetrainModel) -> int:
    """Steps a record: as given, or what the highest mesh frequency of the run asks for."""
    s = case.simulation
    record = s.record
    if record is None:
        record = default_record_rate(s.rate, highest_mesh(model, case_speeds(case, model).fastest)[1])
    return max(1, round(s.rate / record))


def record_rate(case: DrivetrainCase, model: DrivetrainModel) -> float:
    """Records a second [Hz]; see `record_every`."""
    return case.simulation.rate / record_every(case, model)


def check_drivetrain(case: DrivetrainCase) -> DrivetrainModel:
    """Refuse what the stages cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        As `case_model`; bodies that nothing holds across their axis or against tilting (E-MECHANISM);
        natural frequencies too far apart for double precision (E-SPREAD); steps that cannot follow the
        meshes (E-RATE); records that are too many (E-RANGE).
    """
    try:
        count, names = loose_motions(drivetrain_of(case), turning=case.simulation.turning)
    except CaseError as error:
        raise _located(error, case) from None
    if count:
        raise CaseError(
            f"nothing holds {count} motion{'s' if count > 1 else ''}, such as {', '.join(names[:3])}",
            code="E-MECHANISM", key="bearing", file=case.location("bearing"),
            limit="bearings and shafts that leave the common rotation alone free",
            remedy="add a [[bearing]] or its stiffness, or tilts = false",
        )  # fmt: skip
    check_spread(case, drivetrain_of(case))
    model = case_model(case)
    _check_stiffness(case, model)
    _check_rate(case, model)
    if case.simulation.record is None:
        for problem in record_problems(case, record_rate(case, model)):
            problem.file = case.location(problem.key)
            raise problem
    return model


def check_spectrum(case: DrivetrainCase, model: DrivetrainModel) -> None:
    """Refuse what has no spectra: the stage is not asked for by every run.

    Raises
    ------
    CaseError
        Records that are too few, a resolution that they do not have (E-RANGE); no meshes, or a first body
        that nearly stops or turns back in the part that the spectra take (E-SPECTRUM).
    """
    if not len(model.meshes):
        raise CaseError(
            "the chain has no gears, and therefore no mesh forces",
            code="E-SPECTRUM",
            limit="one mesh or more",
        )
    for problem in spectrum_problems(case, record_rate(case, model)):
        problem.file = case.location(problem.key)
        raise problem
    s = case.simulation
    late = speed_range(
        model, torque_histories(case, model.ratio), duration=s.duration, speed=case.operation.speed,
        start=settle_time(case),
    )  # fmt: skip
    try:
        check_turning(late.lowest, late.mean)
    except CaseError as error:
        error.file = case.location(error.key)
        raise


def check_turning(lowest: float, mean: float) -> None:
    """Refuse speeds of the first body [rad/s] at which a turn takes endless records (E-SPECTRUM)."""
    if not lowest > SLOWEST * mean or not mean > 0.0:
        raise CaseError(
            f"the first body nearly stops or turns back: {lowest / RPM:.6g} rpm at the slowest, "
            f"{mean / RPM:.6g} rpm in the mean; there are no orders",
            code="E-SPECTRUM", key="operation.torque",
            limit=f"never slower than {SLOWEST:.0%} of its mean speed where spectra are taken",
            remedy="give torques that keep it turning, or write --only transient",
        )  # fmt: skip


def _check_stiffness(case: DrivetrainCase, model: DrivetrainModel) -> None:
    """Refuse meshes whose cut series turns negative: no real mesh pushes the other way."""
    if not len(model.meshes):
        return
    phase = 2.0 * math.pi * np.arange(4096)[:, None] / 4096
    least = np.array(FourierSeries(model.stiffness).at(phase)).min(axis=0)
    wrong = np.flatnonzero(least <= 0.0)
    if not len(wrong):
        return
    keys = []
    for i, one in enumerate(model.train.planetary):
        for which in ("sun_mesh", "ring_mesh"):
            keys += [f"planetary[{i}].{which}.low_share"] * len(one.planet_angles)
    keys += [f"parallel[{i}].mesh.low_share" for i in range(len(model.train.parallel))]
    key = keys[wrong[0]]
    raise CaseError(
        f"the series of the stiffness of {model.meshes[wrong[0]]} falls to {least[wrong[0]]:.3g} N/m: with "
        f"{case.simulation.harmonics} terms it overshoots the jump by about 9 %",
        code="E-STIFFNESS", key=key, file=case.location(key), limit="above 0 N/m at any time",
        remedy="give a larger low_share",
    )  # fmt: skip


def _check_rate(case: DrivetrainCase, model: DrivetrainModel) -> None:
    speeds, rate = case_speeds(case, model), case.simulation.rate
    name, hertz = highest_mesh(model, speeds.fastest)
    if rate >= LEAST_STEPS * hertz:
        return
    first = case.body[0].name
    good = FREQUENCY.show(GOOD_STEPS * hertz)
    key, value, remedy = "simulation.rate", FREQUENCY.show(rate), f"take {good} or more"
    if LEAST_STEPS * hertz > drivetrain_section.FASTEST_RATE:
        remedy = "take a lower speed, or fewer teeth: no simulation.rate is fast enough"
    if speeds.fastest > 1.01 * speeds.first:
        key, value = "operation.torque", None
        remedy = f"give torques that balance (share = 1.0), a shorter duration, or a rate of {good}"
    raise CaseError(
        f"{rate / hertz:.3g} steps a period ({FREQUENCY.show(rate)}) cannot follow the {name}, "
        f"{FREQUENCY.show(hertz)} at {SPEED.show(speeds.fastest)} of {first}",
        code="E-RATE", key=key, value=value, file=case.location(key),
        limit=f"{LEAST_STEPS} steps a period at any time: {FREQUENCY.show(LEAST_STEPS * hertz)} or more",
        remedy=remedy,
    )  # fmt: skip
