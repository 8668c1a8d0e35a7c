"""What a run of a drivetrain case can represent: speeds, steps and records, loose motions; its warnings.

Refusals come by stage, before anything is computed; what is allowed but deserves a look is a warning.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from femgear.case.quantities import FREQUENCY, RPM, SPEED, TIME
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.solvers.linear.modal import undamped_modes
from femgear.system.fourier import FourierSeries
from femgear.trains.drivetrain.case_file import (
    FASTEST_RATE,
    DrivetrainCase,
    record_problems,
    settle_time,
    torque_histories,
)
from femgear.trains.drivetrain.kinematics import springs_of
from femgear.trains.drivetrain.model import (
    DrivetrainModel,
    case_model,
    computed_drivetrain,
    drivetrain_model,
    refusals_located,
)
from femgear.trains.drivetrain.parts import Drivetrain, TorqueHistory
from femgear.trains.drivetrain.simulation import PASS_BAND

# Slower instants, over the mean speed, would need records of endless length over a turn.
_SLOWEST = 0.05

# Steps a period that can follow a mesh at all, and well: average acceleration lowers its frequency by
# (2 pi / steps)^2 / 12, 21 % for four, 0.4 % for thirty.
# Not enough where modes lie far above the mesh lines: see `mesh_mode`.
_LEAST_STEPS, _GOOD_STEPS = 4, 30
# Records that nobody chose keep this multiple of the highest mesh frequency, and come this often [Hz].
_KEPT_HARMONIC, _LEAST_RECORD_RATE = 3, 1000.0
# Share of its strain energy that a mode has in the meshes where they drive it noticeably.
_MESH_SHARE = 0.1

# A speed that changes by more is worth a remark.
_CHANGE = 2.0
# Share by which steps may lower the frequency of a mode that the meshes drive, and a small one.
_SHIFT, _SMALL_SHIFT = 1e-2, 1e-3

# Stiffness of a motion over that of its coordinates alone; a chain of 1500 coordinates keeps 1e-10.
_NOT_RESISTED = 1e-12
# Share of the largest motion that counts as moved, and coordinates that are named.
_MOVED, _NAMED = 1e-3, 6

# Records that spectra take at least.
_LEAST_RECORDS = 64


@dataclass(frozen=True)
class SpeedRange:
    """Speeds of the free spin over a run [rad/s].

    ``first`` and ``last`` are those at its ends; ``lowest``, ``highest`` and ``mean`` those over time.
    """

    first: float
    last: float
    lowest: float
    highest: float
    mean: float

    @property
    def fastest(self) -> float:
        """Largest speed in either sense [rad/s]."""
        return max(abs(self.lowest), abs(self.highest))


def reached_speeds(
    model: DrivetrainModel,
    torques: Sequence[TorqueHistory],
    *,
    duration: float,
    speed: float,
    start: float = 0.0,
) -> SpeedRange:
    """Compute the speeds of the first body as the rigid chain turns under its torques, from start to end [s].

    Newton's law of the rigid chain, d omega / dt = sum(ratio_b T_b(t)) / I with its inertia I about the axis
    of the first body, whose ``speed`` is that at time zero [rad/s]. Torques are linear between their
    instants, so that the speed there is a sum of trapezoids, and a parabola in between with its vertex where
    the sum is zero.
    """
    instants = np.concatenate([[0.0, start, duration], *(torque.times for torque in torques)])
    times = np.unique(np.clip(instants, 0.0, duration))
    power = sum((model.ratio[torque.body] * torque.at(times) for torque in torques), np.zeros(len(times)))
    rate, step = power / model.inertia, np.diff(times)
    speeds = speed + np.append(0.0, np.cumsum(0.5 * step * (rate[1:] + rate[:-1])))
    begin = int(np.searchsorted(times, start))
    rate, step, speeds = rate[begin:], step[begin:], speeds[begin:]
    middle = speeds[:-1] + step * (3.0 * rate[:-1] + rate[1:]) / 8.0
    # simpson's rule, exact for parabolas
    mean = step @ (speeds[:-1] + 4.0 * middle + speeds[1:]) / (6.0 * step.sum())
    turning = np.flatnonzero(rate[1:] * rate[:-1] < 0.0)
    vertex = rate[turning] ** 2 / (rate[turning] - rate[turning + 1]) * step[turning]
    every = np.append(speeds, speeds[turning] + 0.5 * vertex)
    return SpeedRange(*map(float, (speeds[0], speeds[-1], every.min(), every.max(), mean)))


def case_speeds(case: DrivetrainCase, model: DrivetrainModel, *, start: float = 0.0) -> SpeedRange:
    """Compute the speeds of the first body from `start` [s] to the end of a run, without its deviation."""
    torques, duration = torque_histories(case, model.ratio), case.simulation.duration
    return reached_speeds(model, torques, duration=duration, speed=case.operation.speed, start=start)


def record_every(case: DrivetrainCase, model: DrivetrainModel) -> int:
    """Count the steps a record: as given, or what the highest mesh frequency of the run asks for."""
    s = case.simulation
    if s.record is not None:
        return max(1, round(s.rate / s.record))
    return default_record_every(s.rate, highest_mesh(model, case_speeds(case, model).fastest)[1])


def record_rate(case: DrivetrainCase, model: DrivetrainModel) -> float:
    """Compute the rate of the records [Hz]; see `record_every`."""
    return case.simulation.rate / record_every(case, model)


def highest_mesh(model: DrivetrainModel, speed: float) -> tuple[str, float]:
    """Find the fastest mesh and its frequency [Hz] at a speed of the first body [rad/s], if there is one."""
    bases = np.unique(model.mesh_base)
    if not len(bases):
        return "none", 0.0
    hertz = model.frequencies(abs(speed))[bases] / (2.0 * math.pi)
    return model.bases[bases[np.argmax(hertz)]], float(hertz.max())


def mesh_mode(model: DrivetrainModel, limit: float) -> float:
    """Find the frequency of the highest mode that the meshes drive noticeably [Hz]; 0 without any.

    Modes at standstill with mean mesh stiffnesses; the share of the meshes in the strain energy of a mode
    ``phi`` is ``sum(k (w^T phi)^2) / omega^2`` (R. G. Parker and J. Lin, J. Vib. Acoust. 126, 2004, 68-76).
    Modes above the limit, the highest line of the mesh stiffness [Hz], answer it as springs do, not by
    resonance.
    """
    modes, stiffness = undamped_modes(model.still, model.mean_stiffness), model.mean_stiffness
    driven = stiffness @ modes.mesh_deflection**2 > _MESH_SHARE * (2.0 * math.pi * modes.frequency) ** 2
    return float(modes.frequency[driven & (modes.frequency <= limit)].max(initial=0.0))


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


def check_drivetrain(case: DrivetrainCase) -> DrivetrainModel:
    """Refuse what the stages cannot represent, before anything is computed; return the model with bending.

    CaseError: as `case_model`; bodies that nothing holds across their axis or against tilting (E-MECHANISM);
    natural frequencies too far apart for double precision (E-STIFFNESS); steps that cannot follow the meshes
    (E-RATE); records that are too many (E-RANGE).
    """
    with refusals_located(case):
        train = computed_drivetrain(case)
        count, names = loose_motions(train, turning=case.simulation.turning)
        if count:
            raise CaseError(
                f"nothing holds {count} motion{'s' if count > 1 else ''}, such as {', '.join(names[:3])}",
                code="E-MECHANISM",
                key="bearing",
                limit="bearings and shafts that leave the common rotation alone free",
                remedy="add a [[bearing]] or its stiffness, or tilts = false",
            )
        _check_spread(train, turning=case.simulation.turning)
        model = case_model(case)
        _check_stiffness(case, model)
        _check_rate(case, model)
        if case.simulation.record is None:
            for problem in record_problems(case, record_rate(case, model)):
                raise problem
    return model


def check_spectrum(case: DrivetrainCase, model: DrivetrainModel) -> None:
    """Refuse what has no spectra: the stage is not asked for by every run.

    CaseError: records that are too few, a resolution that they do not have (E-RANGE); a first body that
    nearly stops or turns back in the part that the spectra take (E-SPECTRUM).
    """
    with refusals_located(case):
        _check_records(case, record_rate(case, model))
        late = case_speeds(case, model, start=settle_time(case))
        check_turning(late.lowest, late.mean)


def _check_records(case: DrivetrainCase, record: float) -> None:
    """Refuse records, so many a second [Hz], that have no spectra."""
    s = case.simulation
    late, key = s.duration - settle_time(case), "settle" if s.settle is not None else "duration"
    if late * record < _LEAST_RECORDS:
        raise CaseError(
            f"{late * record:.3g} records are too few for the spectra",
            code="E-RANGE",
            key=f"simulation.{key}",
            value=TIME.show(getattr(s, key)),
            limit=f"{_LEAST_RECORDS} records or more after simulation.settle",
            remedy="take a longer duration, a shorter settle or more records, or write --only transient",
        )
    if s.resolution is not None and not 1.0 / late <= s.resolution <= record / 16.0:
        raise CaseError(
            "the record has no such resolution",
            code="E-RANGE",
            key="simulation.resolution",
            value=FREQUENCY.show(s.resolution),
            limit=f"{FREQUENCY.show(1.0 / late)} to {FREQUENCY.show(record / 16.0)}",
        )


def check_turning(lowest: float, mean: float) -> None:
    """Refuse a first body whose lowest speed, beside its mean [rad/s], leaves no orders (E-SPECTRUM)."""
    if not lowest > _SLOWEST * mean or not mean > 0.0:
        raise CaseError(
            f"the first body nearly stops or turns back: {lowest / RPM:.6g} rpm at the slowest, "
            f"{mean / RPM:.6g} rpm in the mean; there are no orders",
            code="E-SPECTRUM",
            key="operation.torque",
            limit=f"never slower than {_SLOWEST:.0%} of its mean speed where spectra are taken",
            remedy="give torques that keep it turning, or write --only transient",
        )


def _check_stiffness(case: DrivetrainCase, model: DrivetrainModel) -> None:
    """Refuse meshes whose cut series turns negative: no real mesh pushes the other way."""
    if not len(model.meshes):
        return
    phase = 2.0 * math.pi * np.arange(4096)[:, None] / 4096
    least = np.array(FourierSeries(model.stiffness).at(phase)).min(axis=0)
    wrong = np.flatnonzero(least <= 0.0)
    if not len(wrong):
        return
    key = f"{model.train.meshes[wrong[0]].key}.low_share"
    raise CaseError(
        f"the series of the stiffness of {model.meshes[wrong[0]]} falls to {least[wrong[0]]:.3g} N/m: with "
        f"{case.simulation.harmonics} terms it overshoots the jump by about 9 %",
        code="E-STIFFNESS",
        key=key,
        limit="above 0 N/m at any time",
        remedy="give a larger low_share",
    )


def _check_rate(case: DrivetrainCase, model: DrivetrainModel) -> None:
    speeds, rate = case_speeds(case, model), case.simulation.rate
    name, hertz = highest_mesh(model, speeds.fastest)
    if rate >= _LEAST_STEPS * hertz:
        return
    first = case.body[0].name
    good = FREQUENCY.show(_GOOD_STEPS * hertz)
    key, value, remedy = "simulation.rate", FREQUENCY.show(rate), f"take {good} or more"
    if _LEAST_STEPS * hertz > FASTEST_RATE:
        remedy = "take a lower speed, or fewer teeth: no simulation.rate is fast enough"
    if speeds.fastest > 1.01 * speeds.first:
        key, value = "operation.torque", None
        remedy = f"give torques that balance (share = 1.0), a shorter duration, or a rate of {good}"
    raise CaseError(
        f"{rate / hertz:.3g} steps a period ({FREQUENCY.show(rate)}) cannot follow the {name}, "
        f"{FREQUENCY.show(hertz)} at {SPEED.show(speeds.fastest)} of {first}",
        code="E-RATE",
        key=key,
        value=value,
        limit=f"{_LEAST_STEPS} steps a period at any time: {FREQUENCY.show(_LEAST_STEPS * hertz)} or more",
        remedy=remedy,
    )


def drivetrain_warnings(case: DrivetrainCase) -> tuple[Finding, ...]:
    """List what is allowed but deserves a look; refuses what `check_drivetrain` does."""
    model = check_drivetrain(case)
    speeds = case_speeds(case, model)
    return (
        *case.notices,
        *_runaway(case, speeds),
        *_rates(case, model, speeds),
        *_spectra(case, model),
        *_undamped(case),
    )


def _undamped(case: DrivetrainCase) -> Iterator[Finding]:
    """Runs in which nothing takes energy out of vibration."""
    if case.simulation.damping_ratio == 0.0:
        yield Finding(
            "W-DAMPING",
            "simulation.damping_ratio",
            "0, no damping at all: vibration of the start never dies "
            "away, resonances grow until something else stops them, and teeth seem to part that would not",
            remedy="gear trains are commonly computed with 0.02 to 0.05",
        )


def _runaway(case: DrivetrainCase, speeds: SpeedRange) -> Iterator[Finding]:
    """Torques that change the speed more than a run is meant for."""
    first = speeds.first
    if speeds.highest <= _CHANGE * first and speeds.lowest >= first / _CHANGE:
        return
    rpm = [f"{value / RPM:.6g}" for value in (first, speeds.last, speeds.lowest, speeds.highest)]
    between = "" if speeds.last in (speeds.lowest, speeds.highest) else f" ({rpm[2]} to {rpm[3]} rpm on the way)"
    turns = " and turn it back" if speeds.lowest < 0.0 else ""
    yield Finding(
        "W-SPEED",
        "operation.torque",
        f"the torques take {case.body[0].name} from {rpm[0]} to {rpm[1]} rpm in "
        f"{case.simulation.duration:g} s{between}{turns}",
        remedy="share = 1.0 on another body balances them",
    )


def _rates(case: DrivetrainCase, model: DrivetrainModel, speeds: SpeedRange) -> Iterator[Finding]:
    """Steps and records that are too slow for the highest mesh frequency, at the fastest speed."""
    name, top = highest_mesh(model, speeds.fastest)
    rate, record = case.simulation.rate, record_rate(case, model)
    where = f"{top:.4g} Hz"
    if speeds.fastest > 1.01 * speeds.first:
        where += f" at {speeds.fastest / RPM:.6g} rpm, the fastest"
    if rate < _GOOD_STEPS * top:
        yield Finding(
            "W-RATE",
            "simulation.rate",
            f"{rate / top:.3g} steps a period of the {name} ({where}) shift and damp it",
            remedy=f"take {_GOOD_STEPS} or more, {_GOOD_STEPS * top:.4g} Hz",
        )
    # modes above the last line of the mesh stiffness answer as springs
    mode = mesh_mode(model, top * case.simulation.harmonics)
    if (shift := frequency_shift(mode, rate)) > _SHIFT:
        yield Finding(
            "W-RATE",
            "simulation.rate",
            f"steps of {rate:g} Hz lower the mode of {mode:.4g} Hz, which the meshes drive, by {shift:.2%}",
            remedy=f"{_up(shift_rate(mode, _SHIFT))} Hz lowers it by {_SHIFT:.0%}, "
            f"{_up(shift_rate(mode, _SMALL_SHIFT))} Hz by {_SMALL_SHIFT:.1%}",
        )
    if 0.5 * PASS_BAND * record < top:
        yield Finding(
            "W-RECORD",
            "simulation.record",
            f"records of {record:g} Hz end at {0.5 * PASS_BAND * record:g} Hz, below the {name} ({where})",
        )


def _up(value: float) -> str:
    """Three digits, rounded up."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{math.ceil(value / unit) * unit:.12g}"


def _spectra(case: DrivetrainCase, model: DrivetrainModel) -> Iterator[Finding]:
    """Runs that stop before the spectra, which would be refused."""
    if not len(model.meshes):
        return
    try:
        check_spectrum(case, model)
    except CaseError as error:
        text = f"{error.message}: the stage spectrum refuses this ({error.code})"
        yield Finding("W-SPECTRUM", f"{error.key}", text)


def loose_motions(train: Drivetrain, *, turning: bool = True) -> tuple[int, tuple[str, ...]]:
    """Count the motions besides the free spin that no spring resists, and name what moves most in them.

    Whether a motion is resisted does not depend on how stiff the springs are. Therefore all of them get like
    stiffnesses, 1 N/m across and 1 N/m times a length squared against rotation; the coordinates are scaled by
    their own stiffness, ``D K D`` with ones on the diagonal, and what is left is a matter of rank (null space
    of the stiffness: M. Geradin and D. J. Rixen, Mechanical Vibrations, 3rd ed., section 2.9). Refuses what
    `drivetrain_model` does. At most six coordinates are named, rotations last.
    """
    model = drivetrain_model(replace(train, damping_ratio=0.0), harmonics=0, turning=turning)
    lengths = [shaft.length for shaft in train.shafts]
    lengths += [stage.pitch_radii[0] for stage in (*train.parallel, *train.planetary)]
    arm = math.exp(np.mean(np.log(lengths))) if lengths else 1.0
    stiffness = model.system.W @ model.system.W.T
    for spring in springs_of(train, model.place):
        there = (spring.stiffness > 0.0) & np.isfinite(spring.stiffness)
        rows = (spring.rows * np.where(spring.turns, arm, 1.0)[:, None])[there] @ model.free[spring.places]
        stiffness += rows.T @ rows
    diagonal = np.diag(stiffness)
    size = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    # the spin is known, and held
    spin = model.rigid * size
    scaled = stiffness / np.outer(size, size) + np.outer(spin, spin) / (spin @ spin)
    count = int(np.count_nonzero(linalg.eigvalsh(scaled) < _NOT_RESISTED))
    if not count:
        return 0, ()
    moved = np.abs(linalg.eigh(scaled, subset_by_index=(0, count - 1))[1]).max(axis=1)
    order = [i for i in np.argsort(-moved, kind="stable") if moved[i] > _MOVED * moved.max()]
    bodies, names = {body.name for body in train.bodies}, [model.system.dofs[i] for i in order]
    # coordinates of bodies before those of planets and shaft stations, rotations last
    names.sort(key=lambda name: (name.endswith("rotation"), name.split(":")[0] not in bodies))
    return count, tuple(names[:_NAMED])


def _check_spread(train: Drivetrain, *, turning: bool) -> None:
    """Refuse slow motions that rounding hides beside the free spin (E-STIFFNESS).

    The softest support is named where that is the cause, else the fastest and the slowest coordinate.
    """
    model = drivetrain_model(replace(train, damping_ratio=0.0), turning=turning)
    n, mass, stiffness = len(model.rigid), model.system.M, model.total_stiffness
    values = linalg.eigvalsh(stiffness, mass)
    # what the modes take for rigid: a share of a norm, which is up to sqrt(n) above the largest
    share = math.sqrt(n) * max(1e-12, 10.0 * n * np.finfo(float).eps)
    if n == 1 or values[1] > share * values[-1]:
        return
    hertz = np.sqrt(np.diag(stiffness) / np.diag(mass)) / (2.0 * math.pi)
    fast = model.system.dofs[int(np.argmax(hertz))]
    factor = f"a factor of {1.0 / math.sqrt(share):.1g}"
    soft, key, body, value = _softest(train)
    # a support is the cause where it lies further from the middle than the fastest coordinate does
    if soft * hertz.max() < np.median(hertz) ** 2:
        slow = f"{body} on its bearings alone has {soft:.3g} Hz, slower"
        remedy = f"stiffen the bearings of {body}: theirs are the softest"
    else:
        second = _slowest(model, stiffness)
        names, member = [body.name for body in train.bodies], fast.split(":")[0]
        key, value = f"body[{names.index(member)}]" if member in names else "shaft", None
        slow = f"{second} moves slower"
        remedy = f"give {member} more mass or inertia or rigid springs, or stiffen what holds "
        remedy += second.split(":")[0]
    raise CaseError(
        "natural frequencies are too far apart for double precision: "
        f"{fast} by itself has {hertz.max():.3g} Hz, and {slow} by more than {factor}",
        code="E-STIFFNESS",
        key=key,
        value=value,
        limit=f"frequencies within {factor}",
        remedy=remedy,
    )


def _slowest(model: DrivetrainModel, stiffness) -> str:
    """Coordinate with most of the kinetic energy of the slowest motion besides the free spin."""
    mass = model.system.M
    slow = linalg.eigh(stiffness, mass, subset_by_index=(0, 1))[1]
    slow = slow - np.outer(model.rigid, model.rigid @ mass @ slow) / model.inertia
    energy = np.abs(slow * (mass @ slow)).max(axis=1)
    return model.system.dofs[int(np.argmax(energy))]


def _softest(train: Drivetrain) -> tuple[float, str, str, str]:
    """Slowest body on its own bearings: frequency [Hz], key, body and stiffness; infinite without any."""
    estimates = [(math.inf, "", "", "")]
    for body in train.bodies:
        places = [i for i, bearing in enumerate(train.bearings) if bearing.body == body.name]
        inertias = ("radial", body.mass, "N/m"), ("tilt", body.transverse_inertia, "N m/rad")
        for kind, inertia, unit in inertias if body.tilts else inertias[:1]:
            springs = [getattr(train.bearings[i], kind) for i in places]
            if sum(springs) > 0.0:
                key = f"bearing[{places[int(np.argmax(springs))]}].{kind}"
                hertz = math.sqrt(sum(springs) / inertia) / (2.0 * math.pi)
                estimates.append((hertz, key, body.name, f"{max(springs):g} {unit}"))
    return min(estimates)
