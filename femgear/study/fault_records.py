"""Labelled signals of sets with faulty teeth: drawn cases, each recorded at several speeds by a fixed sensor.

A machine is a set with its drawn errors, one fault or none, and a torque. Machine ``i // each`` of a seed makes record
i: what it is follows from the seed and its number alone, and so do speed, angle of the carrier and noise of the record
from the seed and the number i. Teeth are solved once for all speeds of a machine.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case.dependencies import Steps, fingerprint
from femgear.case.fault_sections import keyed_faults, no_faults
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import FREQUENCY, SPEED, TIME, TORQUE, Dimension, to_si
from femgear.errors import CaseError, FemgearError
from femgear.housing.sensor import SensorLines
from femgear.housing.sound import sampled_signal
from femgear.stages.fault_orders import need_fixed_ring
from femgear.stages.protocol import one_blas_thread
from femgear.stages.static import LARGEST_APPROACH, static_without_load
from femgear.study.fault_request import FaultRequest
from femgear.study.fault_sizes import (
    GEARS,
    KINDS,
    SIZED,
    FaultPlace,
    chosen_words,
    drawn_fault,
    fault_entries,
    size_ranges,
)
from femgear.study.objectives import need_elastic_ring
from femgear.study.samples import SampleModel, checked, drawn_alone, sample_case
from femgear.trains.elastic import stages as elastic_stages
from femgear.trains.reading import to_toml, with_values

KEPT_LINES = 1e-4
"""Part of the strongest line of a record under which lines are left out of its table."""
MOST_RECORDS = 1_000_000
_MACHINE, _RECORD = 1, 2
"""Numbers behind the seed of what is drawn for a machine, and for a record."""
_QUIET = "none"
_WORK = {"crack": 0.8, "missing": 25.0, "broken corner": 20.0, "spall": 12.0}
"""Time of a machine of a kind [s], of a crack by tooth of its gear; of others 1. Reference set, 20 speeds."""


@dataclass(frozen=True)
class FaultPlan:
    """A request in numbers, for a case, and what machines share.

    Parameters
    ----------
    case : Case
        Without faults.
    model : SampleModel, optional
        Errors that are drawn.
    kinds, gears : tuple of str
        Of the faults.
    sizes : mapping
        Smallest and largest size [m] by kind.
    speeds, torques : (float, float)
        Ranges [rad/s], [N m].
    each, seed : int
        As of `FaultRequest`.
    noise : float
        Root mean square of the noise over that of the signal.
    samples, rate : int
        Of a record.
    cache : path, optional
        Folder of generated grids.
    steps : Steps
        What machines have in common, as far as it is computed.
    """

    case: Any
    model: SampleModel | None
    kinds: tuple[str, ...]
    gears: tuple[str, ...]
    sizes: Mapping[str, tuple[float, float]]
    speeds: tuple[float, float]
    torques: tuple[float, float]
    each: int
    seed: int
    noise: float
    samples: int
    rate: int
    cache: Path | None = None
    steps: Steps = field(default_factory=Steps)

    @property
    def fingerprint(self) -> str:
        """Tell the plan from others: SHA-256 of all that decides its records."""
        names = ("kinds", "gears", "sizes", "speeds", "torques", "each", "seed", "noise", "samples", "rate")
        laws = () if self.model is None else self.model.errors
        return fingerprint({name: getattr(self, name) for name in names} | {"case": self.case.source, "laws": laws})


@dataclass(frozen=True)
class MachineRecords:
    """Records of a machine, or why there are none.

    Parameters
    ----------
    machine : int
        Its number.
    case : Case
        As `femgear.run` takes it, with all speeds.
    fault : FaultPlace
        What is wrong with it.
    errors : (K,) array
        Errors that were drawn [m].
    angle : (each,) array
        Of the carrier at the beginning of the records [rad].
    signal : (each, samples) float32 array
        Acceleration of the sensor with noise [m/s^2]; NaN where there is an error.
    lines : SensorLines, optional
        Of the sensor at the speeds, without noise.
    error : str
        Why it cannot be computed; empty where it can.
    """

    machine: int
    case: Any
    fault: FaultPlace
    errors: np.ndarray
    angle: np.ndarray
    signal: np.ndarray
    lines: SensorLines | None
    error: str = ""


def fault_plan(
    case: Any, request: FaultRequest, tolerances: Path | None = None, *, cache: Path | None = None
) -> FaultPlan:
    """Read a request for a case, and compute what its machines share.

    CaseError: a set without fixed or elastic ring, with faults, bolts or a casing; everything in the request that
    cannot be used.
    """
    gears = need_fixed_ring(case)
    need_elastic_ring(case, "a data set needs")
    no_faults(case, "a data set draws the faults itself")
    if case.housing.stands_still:
        key = "housing.structure" if case.housing.structure else "housing.support"
        message, remedy = "records of a data set are those of a ring on its foundation", "femgear run of single cases"
        raise CaseError(message, code="E-CHOICE", key=key, remedy=remedy)
    checked(request.count, "--count", 1, MOST_RECORDS)
    checked(request.each, "--each", 1, 10_000)
    checked(request.seed, "--seed", 0, 2**32)
    checked(request.rate, "--rate", 1000, 10_000_000)
    torque, fastest = case.operation.torque, max(case.operation.speeds, key=abs)
    if not torque:
        message, remedy = "without torque no tooth carries load", 'give a torque, as in operation.torque = "100 N m"'
        raise CaseError(message, code="E-NO-LOAD", key="operation.torque", value=torque, remedy=remedy)
    kinds, places = chosen_words(request.kinds, KINDS, "--kinds"), chosen_words(request.gears, GEARS, "--gears")
    common = {"static.stresses": False, "housing.published": None, "housing.measured": None}
    if request.up_to is not None:
        to_si(request.up_to, FREQUENCY, low=10.0)
        common |= dict.fromkeys(("dynamics.mesh_harmonics", "dynamics.response_harmonics"))
        common["dynamics.up_to"] = request.up_to
    elif case.dynamics.up_to is None and case.dynamics.mesh_harmonics is None:
        common["dynamics.up_to"] = "5 kHz"
    case = with_values(case, common)
    sizes = size_ranges(request.sizes, gears.sun.module)
    _check_largest(case, kinds, places, sizes)
    steps = Steps()
    plan = FaultPlan(
        case,
        None if tolerances is None else drawn_alone(case, tolerances, cache=cache, steps=steps),
        kinds,
        places,
        sizes,
        _range(request.speeds, SPEED, (0.5 * fastest, fastest), "--speeds"),
        _range(request.torques, TORQUE, (0.5 * torque, torque), "--torques"),
        request.each,
        request.seed,
        _noise(request.noise),
        round(to_si(request.duration, TIME, low=0.01, high=600.0) * request.rate),
        request.rate,
        cache,
        steps,
    )
    solved_lines(case, cache=cache, steps=steps)  # what all machines share stays in the steps
    return plan


def _check_largest(
    case: Any, kinds: Sequence[str], places: Sequence[str], sizes: Mapping[str, tuple[float, float]]
) -> None:
    """Refuse sizes (CaseError, E-RANGE) of which the largest cannot be on a flank of a gear that may have it."""
    gears, back = planetary_set(case), case.torque_on_first_gear() < 0.0
    for kind, gear, flank in product((kind for kind in kinds if kind in SIZED), places, (0.0, 0.5)):
        fault = drawn_fault(kind, gears, (gear,), sizes, np.array([0.0, 0.0, 0.0, flank, 1.0]), back=back)
        try:
            list(keyed_faults(with_values(case, fault_entries(fault, gears)), gears))
        except FemgearError as error:
            value, limit = f"{kind} of {1e3 * fault.size:.5g} mm", f"of {gear}: {error.limit}"
            message = f"the largest size cannot be: {error.message}"
            raise CaseError(message, code="E-RANGE", key="--sizes", value=value, limit=limit) from error


def _range(
    ends: tuple[str, str] | None, dimension: Dimension, default: tuple[float, float], key: str
) -> tuple[float, float]:
    """Ends of a range in SI units, both of one sign; CaseError: E-RANGE and those of `to_si`."""
    if ends is None:
        return default
    try:
        low, high = (to_si(end, dimension) for end in ends)
    except CaseError as error:
        error.key = key
        raise
    if not low * high > 0.0 or abs(low) > abs(high):
        limit = "two numbers above zero, ascending"
        raise CaseError("no range", code="E-RANGE", key=key, value=" ".join(ends), limit=limit)
    return low, high


def _noise(text: str) -> float:
    """Read a level of noise, root mean square over that of the signal."""
    if text.strip() == _QUIET:
        return 0.0
    number, _, unit = text.strip().partition(" ")
    try:
        level = float(number)
    except ValueError:
        level = np.nan
    if unit.strip() != "dB" or not -200.0 <= level <= 60.0:
        limit = f'-200 dB to 60 dB as in "-30 dB", or "{_QUIET}"'
        raise CaseError("no level of noise", code="E-RANGE", key="--noise", value=text, limit=limit)
    return 10.0 ** (level / 20.0)


def _drawn_machine(plan: FaultPlan, machine: int) -> tuple[FaultPlace, float]:
    """Draw the fault of a machine, and its torque [N m]."""
    shares = np.random.default_rng([plan.seed, machine, _MACHINE]).random(6)
    torque = plan.torques[0] + (plan.torques[1] - plan.torques[0]) * shares[5]
    kind, back = plan.kinds[machine % len(plan.kinds)], plan.case.torque_on_first_gear() < 0.0
    return drawn_fault(kind, planetary_set(plan.case), plan.gears, plan.sizes, shares, back=back), float(torque)


def machine_times(plan: FaultPlan, machines: Iterable[int]) -> dict[int, float]:
    """Estimate how long machines take, roughly, in seconds of the reference set."""
    gears, times = planetary_set(plan.case), dict[int, float]()
    for machine in machines:
        fault, _ = _drawn_machine(plan, machine)
        # all mesh periods of a cracked gear are solved
        teeth = getattr(gears, fault.gear).teeth if fault.kind == "crack" else 1.0
        times[machine] = _WORK.get(fault.kind, 1.0) * teeth
    return times


def longest_first(times: Mapping[int, float]) -> list[int]:
    """Sort machines by their times [s]: a long one that is begun last would leave other workers idle."""
    return sorted(times, key=times.__getitem__, reverse=True)


def machine_case(plan: FaultPlan, machine: int) -> tuple[Any, FaultPlace, np.ndarray]:
    """Draw a machine: the case with all its speeds, its fault, and its errors (K,) [m]."""
    gears = planetary_set(plan.case)
    fault, torque = _drawn_machine(plan, machine)
    case, errors = plan.case, np.zeros(0)
    if plan.model is not None:
        errors = plan.model.draw(plan.seed, machine, 1)[0]
        case = sample_case(case, plan.model, plan.seed, machine)
        case = with_values(case, {"static.longest_record": plan.case.static.longest_record})
    low, high = plan.speeds
    numbers = range(machine * plan.each, (machine + 1) * plan.each)
    drawn = [low + (high - low) * _record_shares(plan, number)[0] for number in numbers]
    values = {
        "title": f"{plan.case.title[:140]}: machine {machine} of seed {plan.seed}",
        "operation.torque": f"{torque:.6g} N m",
        "operation.speeds": [f"{speed / SPEED.scale:.12g} rpm" for speed in drawn],
        **fault_entries(fault, gears),
    }
    return with_values(case, values), fault, errors


def _record_shares(plan: FaultPlan, record: int) -> np.ndarray:
    """Shares (2,) between 0 and 1 that place speed and angle of a record in their ranges."""
    return np.random.default_rng([plan.seed, record, _RECORD]).random(2)


def solved_lines(case: Any, *, cache: Path | None, steps: Steps) -> SensorLines:
    """Solve for the lines of the sensor at all speeds of a case; FemgearError where they cannot be computed."""
    static = static_without_load(case, cache=cache, steps=steps)
    modes = elastic_stages.solve_modes(case, static, steps=steps, over_bearings=False)
    most, module = float(np.abs(modes.state.deflection).max()), static.planetary_set.sun.module
    if most > LARGEST_APPROACH * module:
        message = f"the flanks approach by {most * 1e3:.4g} mm: the model is one of small displacements"
        limit = f"{LARGEST_APPROACH * module * 1e3:.4g} mm"
        raise CaseError(message, code="E-MOTION", key="operation.torque", limit=limit, remedy="less torque")
    return elastic_stages.solve_lines(case, modes)


@one_blas_thread()
def solve_machine(plan: FaultPlan, machine: int) -> MachineRecords:
    """Compute the records of a machine."""
    case, fault, errors = machine_case(plan, machine)
    numbers = range(machine * plan.each, (machine + 1) * plan.each)
    shares = np.array([_record_shares(plan, number)[1] for number in numbers])
    signal = np.full((plan.each, plan.samples), np.nan, np.float32)
    try:
        lines = solved_lines(case, cache=plan.cache, steps=plan.steps)
    except FemgearError as error:
        return MachineRecords(machine, case, fault, errors, 2.0 * np.pi * shares, signal, None, str(error))
    angle = 2.0 * np.pi * lines.turns * shares
    for row, number in enumerate(numbers):
        values = lines.acceleration[row] * np.exp(1j * lines.order * angle[row])
        # whole numbers of periods until all repeats make a grid of few samples
        speed = float(lines.base_speed[row]) / lines.turns
        recorded = sampled_signal(lines.number, values, speed, samples=plan.samples, rate=plan.rate)
        noise = np.random.default_rng([plan.seed, number, _RECORD, 1]).standard_normal(plan.samples)
        signal[row] = recorded + plan.noise * np.sqrt(np.mean(recorded**2)) * noise
    return MachineRecords(machine, case, fault, errors, angle, signal, lines)


def record_case(plan: FaultPlan, record: int) -> str:
    """Write the case of a record, which `femgear run` solves at its speed."""
    case, *_ = machine_case(plan, record // plan.each)
    speed = case.operation.speeds[record % plan.each]
    title = f"{case.title[:140]}, record {record}"
    return to_toml(with_values(case, {"title": title, "operation.speeds": [f"{speed / SPEED.scale:.12g} rpm"]}))
