"""What an integration of a gearbox in time can represent: speeds, steps and records; its warnings.

Refusals come before anything is computed; what is allowed but deserves a look is a warning. Speeds are those of the
rigid gearbox under its torques.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from femgear.case.quantities import FREQUENCY, RPM, SPEED, TIME
from femgear.errors import CaseError
from femgear.findings import Finding, percent
from femgear.solvers.time.free_turn import SpeedRange, reached_speeds
from femgear.solvers.time.low_pass import PASS_BAND
from femgear.system.turning_meshes import planet_wave_generator
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection, GearboxCase
from femgear.trains.gearbox.geometry import set_sizes
from femgear.trains.gearbox.model import GearboxModel, gearbox_model
from femgear.trains.gearbox.planet_branches import running_sets
from femgear.trains.gearbox.planet_shafts import unlike_planets
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.transient_case import (
    FASTEST_RATE,
    TorqueOverTimeSection,
    TransientSection,
    record_problems,
    torque_histories,
)

# Slower instants, over the mean speed, would need records of endless length over a turn.
_SLOWEST = 0.05

# Steps a period that can follow a mesh at all, and well: average acceleration lowers its frequency by
# (2 pi / steps)^2 / 12, 21 % for four, 0.4 % for thirty.
# Not enough where modes lie far above the mesh lines: see `mesh_mode`.
_LEAST_STEPS, _GOOD_STEPS = 4, 30
# Records that nobody chose keep this multiple of the highest mesh frequency, and come this often [Hz].
_KEPT_HARMONIC, _LEAST_RECORD_RATE = 3, 1000.0
# A speed that changes by more is worth a remark.
_CHANGE = 2.0
# Share by which steps may lower the frequency of a mode that the meshes drive, and a small one.
_SHIFT, _SMALL_SHIFT = 1e-2, 1e-3

# Records that spectra take at least.
_LEAST_RECORDS = 64


@dataclass(frozen=True)
class RunOutline:
    """What is known of an integration before it: of the ``model``, the turn of the rigid gearbox, its mesh lines.

    Parameters
    ----------
    model : GearboxModel
    transient : TransientSection
        What is asked for.
    shaft : str
        That gives the speed.
    speeds, late : SpeedRange
        Of this shaft over the run, and after the start that spectra leave out [rad/s].
    mesh : str
        Stage with the highest mesh frequency; empty without stages.
    mesh_order : float
        Its frequency over the speed of the shaft [1].
    """

    model: GearboxModel
    transient: TransientSection
    shaft: str
    speeds: SpeedRange
    late: SpeedRange
    mesh: str
    mesh_order: float

    @property
    def highest_mesh(self) -> float:
        """Highest mesh frequency at the fastest speed [Hz]."""
        return self.mesh_order * self.speeds.fastest / (2.0 * math.pi)

    @property
    def every(self) -> int:
        """Steps a record: as given, or what the highest mesh frequency asks for."""
        rate, record = self.transient.rate, self.transient.record
        if record is not None:
            return max(1, round(rate / record))
        return default_record_every(rate, self.highest_mesh)

    @property
    def record_rate(self) -> float:
        """Rate of the records [Hz]."""
        return self.transient.rate / self.every

    @property
    def columns(self) -> int:
        """Numbers of a record."""
        case = self.model.case
        meshes = sum(len(stage.meshes) for stage in self.model.stages)
        return 2 * len(case.shaft) + 2 * meshes + 2


def run_outline(case: GearboxCase) -> RunOutline:
    """Find out what is known of the integration of a case before it."""
    transient, model = case.transient, gearbox_model(case)
    assert transient is not None
    flow = model.flow
    shaft = flow.independent[0] if flow.independent else case.shaft[0].name
    speed = flow.speed[shaft]
    ports = {port: flow.speed[_shaft_of(case, port)] / speed for port in model.ports} if speed else {}
    given: dict[str, TorqueOverTimeSection] = {
        port: TorqueOverTimeSection.model_construct(torque=torque) for port, torque in flow.port_torque.items()
    }
    given |= {torque.load: torque for torque in transient.torque}
    torques = torque_histories(list(given.items()), ports) if speed else ()
    ratios, inertia = [ports[torque.body] for torque in torques], turning_inertia(model, shaft)
    outline = {"duration": transient.duration, "speed": speed}
    speeds, late = (
        reached_speeds(torques, ratios, inertia, **outline, start=start) for start in (0.0, transient.settled)
    )
    orders = {name: 2.0 * math.pi * hertz / abs(speed) for name, hertz in flow.mesh_frequency.items()} if speed else {}
    mesh = max(orders, key=lambda name: orders[name], default="")
    return RunOutline(model, transient, shaft, speeds, late, mesh, orders.get(mesh, 0.0))


def _shaft_of(case: GearboxCase, port: str) -> str:
    return next((load.shaft for load in case.load if load.name == port), port)


def turning_inertia(model: GearboxModel, shaft: str) -> float:
    """Compute the inertia of a gearbox that turns as a rigid chain [kg m^2]; infinite where it is held."""
    case, flow = model.case, model.flow
    held = any(bearing.torsional for bearing in case.bearing if bearing.outer_shaft is None)
    braked = (
        coupling
        for coupling in case.coupling
        if not coupling.transmits and coupling.torsion and math.isfinite(coupling.torsion)
    )
    if held or any(CASING in brake.between for brake in braked) or not flow.speed[shaft]:
        return math.inf
    motion = np.zeros((len(model.assembly.names), 6))
    for section in case.shaft:
        count = len(model.beams[section.name].stations) if section.name in model.beams else 1
        first = model.first[section.name]
        motion[first : first + count, 5] = flow.speed[section.name]
    for stage in model.stages:
        carrier = flow.speed[stage.section.carrier] if isinstance(stage.section, BoxPlanetarySection) else 0.0
        pins = stage.elastic_carrier.stations[1:] if stage.elastic_carrier else ()
        for stations, speed in ((stage.planets, flow.planet_speed.get(stage.name, 0.0)), (pins, carrier)):
            for station, psi in zip(stations, stage.angles, strict=False):
                around = carrier * stage.sizes.centre_distance
                motion[station, :2] = -around * math.sin(psi), around * math.cos(psi)
                motion[station, 5] = speed
    turned = motion.ravel() / flow.speed[shaft]
    return float(turned @ model.assembly.mass @ turned)


def frequency_shift(hertz: float, rate: float) -> float:
    """Compute by what share average acceleration lowers a natural frequency [Hz] at a rate of steps [Hz].

    ``tan(Omega h / 2) = omega h / 2`` for the frequency Omega that the steps have, so that the share is
    ``(omega h)^2 / 12`` for short steps (T. J. R. Hughes, The Finite Element Method, 1987, section 9.3).
    """
    half = math.pi * hertz / rate
    return 1.0 - math.atan(half) / half if half > 0.0 else 0.0


def shift_rate(hertz: float, share: float) -> float:
    """Compute the rate of steps [Hz] that lowers a natural frequency [Hz] by this small share or less."""
    return math.pi * hertz / math.sqrt(3.0 * share)


def default_record_every(rate: float, highest: float) -> int:
    """Choose the steps a record by the rate of the steps [Hz] and the highest mesh line [Hz].

    The largest number for which the pass band of the records holds the third harmonic of that line and there
    are 1000 records a second.
    """
    # a hair more, so that rounding of the speed does not push the harmonic out
    needed = max(_LEAST_RECORD_RATE, 2.0 * _KEPT_HARMONIC * highest * (1.0 + 1e-6) / PASS_BAND)
    return max(1, math.floor(rate / needed * (1.0 + 1e-12)))


def check_transient(case: GearboxCase) -> None:
    """Refuse steps that cannot follow the meshes (E-RATE), records that are too many (E-RANGE), unequal planets.

    CaseError: also planets on a carrier that turns that are not equally spaced, or two (E-TURNING).
    """
    if case.transient is None or why_no_motion(case):
        return
    with refusals_located(case):
        _check_turning_planets(case)
        outline = run_outline(case)
        _check_rate(outline)
        for problem in record_problems(case.transient, outline.record_rate, outline.columns):
            raise problem


def why_no_motion(case: GearboxCase) -> str:
    """Tell why a case has no motion in time, empty where it has one."""
    if case.transient is None:
        return "there is no [transient]"
    flow = gearbox_flow(case)
    shaft = flow.independent[0] if flow.independent else case.shaft[0].name
    return "" if flow.speed[shaft] else "nothing turns at the start"


@contextmanager
def refusals_located(case: GearboxCase) -> Iterator[None]:
    """Let refusals name the lines of the case file."""
    try:
        yield
    except CaseError as error:
        error.file = error.file or case.location(error.key or "")
        raise


def _check_turning_planets(case: GearboxCase) -> None:
    assert case.transient is not None
    flow = gearbox_flow(case)
    if not case.transient.turning:
        return
    remedy = "make them equal, or write transient.turning = false, which freezes the carrier"
    for problem in unlike_planets(case, flow, "transient", remedy):
        raise problem
    around = [
        (f"planetary[{number}]", set_sizes(stage).planet_angles)
        for number, stage in enumerate(case.planetary)
        if stage.carrier != CASING and flow.speed[stage.carrier]
    ]
    for running in running_sets(case):
        carrier = running.branches[0].carrier
        if flow.speed[carrier]:
            around.append(("transient", running.angles))
    for key, angles in around:
        try:
            planet_wave_generator(angles)
        except CaseError as error:
            error.key = key
            error.remedy = f"{error.remedy}, or write transient.turning = false, which freezes the carrier"
            raise


def check_spectrum(case: GearboxCase) -> None:
    """Refuse what has no spectra: the stage is not asked for by every run.

    CaseError: records that are too few, a resolution that they do not have (E-RANGE); a shaft that nearly stops or
    turns back in the part that the spectra take (E-SPECTRUM).
    """
    if why_no_motion(case):
        return
    with refusals_located(case):
        outline = run_outline(case)
        _check_records(outline)
        check_turning(outline.shaft, outline.late)


def _check_records(outline: RunOutline) -> None:
    """Refuse records that have no spectra."""
    s, record = outline.transient, outline.record_rate
    late, key = s.duration - s.settled, "settle" if s.settle is not None else "duration"
    if late * record < _LEAST_RECORDS:
        raise CaseError(
            f"{late * record:.3g} records are too few for the spectra",
            code="E-RANGE",
            key=f"transient.{key}",
            value=TIME.show(getattr(s, key)),
            limit=f"{_LEAST_RECORDS} records or more after transient.settle",
            remedy="take a longer duration, a shorter settle or more records, or write --only transient",
        )
    if s.resolution is not None and not 1.0 / late <= s.resolution <= record / 16.0:
        raise CaseError(
            "the record has no such resolution",
            code="E-RANGE",
            key="transient.resolution",
            value=FREQUENCY.show(s.resolution),
            limit=f"{FREQUENCY.show(1.0 / late)} to {FREQUENCY.show(record / 16.0)}",
        )


def check_turning(shaft: str, late: SpeedRange) -> None:
    """Refuse a shaft whose lowest speed, beside its mean, leaves no orders (E-SPECTRUM)."""
    sense = math.copysign(1.0, late.mean)
    lowest = min(sense * late.lowest, sense * late.highest)
    if not lowest > _SLOWEST * abs(late.mean):
        raise CaseError(
            f"{shaft} nearly stops or turns back: {lowest / RPM:.6g} rpm at the slowest, "
            f"{abs(late.mean) / RPM:.6g} rpm in the mean; there are no orders",
            code="E-SPECTRUM",
            key="transient.torque",
            limit=f"never slower than {percent(_SLOWEST)} of its mean speed where spectra are taken",
            remedy="give torques that keep it turning, or write --only transient",
        )


def _check_rate(outline: RunOutline) -> None:
    speeds, rate, hertz = outline.speeds, outline.transient.rate, outline.highest_mesh
    if rate >= _LEAST_STEPS * hertz:
        return
    good = FREQUENCY.show(_GOOD_STEPS * hertz)
    key, value, remedy = "transient.rate", FREQUENCY.show(rate), f"take {good} or more"
    if _LEAST_STEPS * hertz > FASTEST_RATE:
        remedy = "take a lower speed, or fewer teeth: no transient.rate is fast enough"
    if speeds.fastest > 1.01 * abs(speeds.first):
        key, value = "transient.torque", None
        remedy = f"give torques that balance (share = 1.0), a shorter duration, or a rate of {good}"
    raise CaseError(
        f"{rate / hertz:.3g} steps a period ({FREQUENCY.show(rate)}) cannot follow the mesh of {outline.mesh}, "
        f"{FREQUENCY.show(hertz)} at {SPEED.show(speeds.fastest)} of {outline.shaft}",
        code="E-RATE",
        key=key,
        value=value,
        limit=f"{_LEAST_STEPS} steps a period at any time: {FREQUENCY.show(_LEAST_STEPS * hertz)} or more",
        remedy=remedy,
    )


def transient_notices(case: GearboxCase) -> Iterator[Finding]:
    """List what of an integration is allowed but deserves a look, before it is computed."""
    if case.transient is None:
        return
    if why := why_no_motion(case):
        yield Finding("W-UNUSED", "transient", f"the gearbox does not move in time: {why}", remedy="give a speed")
        return
    outline = run_outline(case)
    yield from _undamped(case)
    yield from _runaway(outline)
    yield from _rates(outline)
    if case.transient.contact_loss and (bare := [*_without_back(case)]):
        text = "without backlash given there is no back side: these teeth part and meet no back flank"
        yield Finding("W-BACKLASH", ", ".join(bare), text)
    if not outline.mesh:
        return
    try:
        check_spectrum(case)
    except CaseError as error:
        text = f"{error.message}: the stage spectrum refuses this ({error.code})"
        yield Finding("W-SPECTRUM", f"{error.key}", text)


def _without_back(case: GearboxCase) -> Iterator[str]:
    """Keys of meshes that are given without backlash."""
    meshes = [(f"pair[{i}].mesh", stage.mesh) for i, stage in enumerate(case.pair)]
    for i, stage in enumerate(case.planetary):
        meshes += [(f"planetary[{i}].{name}", getattr(stage, name)) for name in ("sun_mesh", "ring_mesh")]
    yield from (key for key, mesh in meshes if mesh is not None and mesh.backlash is None)


def _undamped(case: GearboxCase) -> Iterator[Finding]:
    """Runs in which nothing takes energy out of vibration."""
    if case.modes.damping_ratio == 0.0:
        yield Finding(
            "W-DAMPING",
            "modes.damping_ratio",
            "0, no damping at all: vibration of the start never dies "
            "away, resonances grow until something else stops them, and teeth seem to part that would not",
            remedy="gear trains are commonly computed with 0.02 to 0.05",
        )


def _runaway(outline: RunOutline) -> Iterator[Finding]:
    """Torques that change the speed more than a run is meant for."""
    speeds = outline.speeds
    sense = math.copysign(1.0, speeds.first)
    first, last, low, high = (sense * value for value in (speeds.first, speeds.last, speeds.lowest, speeds.highest))
    low, high = min(low, high), max(low, high)
    if high <= _CHANGE * first and low >= first / _CHANGE:
        return
    rpm = [f"{value / RPM:.6g}" for value in (first, last, low, high)]
    between = "" if last in (low, high) else f" ({rpm[2]} to {rpm[3]} rpm on the way)"
    turns = " and turn it back" if low < 0.0 else ""
    yield Finding(
        "W-SPEED",
        "transient.torque",
        f"the torques take {outline.shaft} from {rpm[0]} to {rpm[1]} rpm in "
        f"{outline.transient.duration:g} s{between}{turns}",
        remedy="share = 1.0 at another load balances them",
    )


def _rates(outline: RunOutline) -> Iterator[Finding]:
    """Steps and records that are too slow for the highest mesh frequency, at the fastest speed."""
    top, rate, record, speeds = outline.highest_mesh, outline.transient.rate, outline.record_rate, outline.speeds
    where = f"{top:.4g} Hz"
    if speeds.fastest > 1.01 * abs(speeds.first):
        where += f" at {speeds.fastest / RPM:.6g} rpm, the fastest"
    if rate < _GOOD_STEPS * top:
        yield Finding(
            "W-RATE",
            "transient.rate",
            f"{rate / top:.3g} steps a period of the mesh of {outline.mesh} ({where}) shift and damp it",
            remedy=f"take {_GOOD_STEPS} or more, {_GOOD_STEPS * top:.4g} Hz",
        )
    if 0.5 * PASS_BAND * record < top:
        yield Finding(
            "W-RECORD",
            "transient.record",
            f"records of {record:g} Hz end at {0.5 * PASS_BAND * record:g} Hz, below the mesh of {outline.mesh} "
            f"({where})",
        )


def slow_steps(mode: float, rate: float) -> Iterator[Finding]:
    """Tell steps of a rate [Hz] that lower the highest mode [Hz] that the meshes drive noticeably."""
    # modes above the last line of the mesh stiffness answer as springs
    if (shift := frequency_shift(mode, rate)) > _SHIFT:
        yield Finding(
            "W-RATE",
            "transient.rate",
            f"steps of {rate:g} Hz lower the mode of {mode:.4g} Hz, which the meshes drive, by {percent(shift, 2)}",
            remedy=f"{_up(shift_rate(mode, _SHIFT))} Hz lowers it by {percent(_SHIFT)}, "
            f"{_up(shift_rate(mode, _SMALL_SHIFT))} Hz by {percent(_SMALL_SHIFT, 1)}",
        )


def _up(value: float) -> str:
    """Three digits, rounded up."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{math.ceil(value / unit) * unit:.12g}"
