"""Data sets of faulty gears in a folder: a file for every machine, and a table of labels.

A machine has its file when all its records are computed: a command that was interrupted goes on with the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case.quantities import SPEED
from femgear.errors import CaseError, FemgearError, StorageError
from femgear.exchange.formats import Signal, write_wav
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, silent
from femgear.storage.contents import Contents
from femgear.storage.files import own_files, read_dataset, resumable, write_csv, write_dataset, write_text
from femgear.study.fault_limits import fault_limits_into
from femgear.study.fault_records import (
    KEPT_LINES,
    FaultPlan,
    MachineRecords,
    fault_plan,
    longest_first,
    machine_times,
    record_case,
    solve_machine,
)
from femgear.study.fault_request import FaultRequest, FurtherRecords
from femgear.study.fault_sizes import KINDS
from femgear.study.runner import Runner
from femgear.study.samples import checked

_LABELS, _MOST_SIZES = "labels.csv", 100
_PATTERNS = (_LABELS, "machine_*.nc", "record_*")
_HEADER = ("record", "file", "machine", "kind", "gear", "planet", "tooth", "flank", "size [m]", "torque [N m]")
_HEADER += ("speed [rpm]", "level [m/s^2]", "error")


def fault_records_into(
    case: Any,
    folder: Path,
    request: FaultRequest,
    tolerances: Path | None = None,
    further: FurtherRecords | None = None,
    *,
    cache: Path | None = None,
    progress: Progress = silent,
    runner: Runner | None = None,
) -> tuple[list[Block], list[str]]:
    """Compute the records of a request, or what is left of them; give what there is to say, and names of files.

    CaseError: as `fault_plan`. StorageError: the folder holds other records (E-OUTPUT).
    """
    further = further or FurtherRecords()
    progress("what machines share", 0.0, 1.0)
    plan = fault_plan(case, request, tolerances, cache=cache)
    progress("what machines share", 1.0, 1.0)
    if further.limits is not None:
        checked(further.limits, "--limits", 1, _MOST_SIZES)
        return fault_limits_into(plan, folder, further.limits, progress=progress, runner=runner)
    own_files(folder, _PATTERNS)
    if further.index is not None:
        return [], _write_alone(plan, folder, further.index, further)
    machines = range(-(-request.count // plan.each))
    with resumable(folder):
        times = machine_times(plan, machines)
        left = [machine for machine in longest_first(times) if not _is_there(plan, folder / _name(machine))]
        what = f"{len(machines)} machines, share of the work [%]"
        done = sum(times.values()) - sum(times[machine] for machine in left)
        outcomes = (runner or Runner()).map(partial(solve_machine, plan), left)
        progress(what, round(100.0 * done / sum(times.values())), 100.0)
        for index, outcome in outcomes:
            if isinstance(outcome, FemgearError):
                raise outcome
            write_dataset(machine_contents(plan, outcome), folder / _name(left[index]))
            done += times[left[index]]
            progress(what, round(100.0 * done / sum(times.values())), 100.0)
        rows = [row for row in _labels(plan, folder, machines) if row[0] < request.count]
        write_csv(folder / _LABELS, _HEADER, rows)
        names = [_LABELS, *map(_name, machines)]
        if further.wav or further.csv:
            names += [name for machine in machines for name in _write_signals(plan, folder, machine, request, further)]
    shown = names if len(names) < 4 else [names[0], names[1], "...", names[-1]]
    return list(describe_records(rows, len(machines))), shown


def _name(machine: int) -> str:
    return f"machine_{machine:05d}.nc"


def _is_there(plan: FaultPlan, path: Path) -> bool:
    """Whether a machine has its file; refuse (StorageError, E-OUTPUT) that of another plan."""
    if not path.exists():
        return False
    if read_dataset(path).attrs.get("plan") != plan.fingerprint:
        message, remedy = "the folder holds records of another case, seed or request", "name another folder"
        raise StorageError(message, code="E-OUTPUT", file=str(path), remedy=remedy)
    return True


def machine_contents(plan: FaultPlan, records: MachineRecords, rows: slice = slice(None)) -> Contents:
    """Collect records of a machine, some ``rows`` of them, as they go to disk.

    Lines of a record follow those of the one before (contiguous ragged array of the CF conventions); the weak ones
    are left out.
    """
    numbers = np.arange(records.machine * plan.each, (records.machine + 1) * plan.each)[rows]
    speeds = np.array(records.case.operation.speeds)[rows]
    signal, fault = records.signal[rows], records.fault
    order, values, counts, carrier = (
        np.zeros(0),
        np.zeros(0, complex),
        np.zeros(len(numbers), int),
        np.zeros(len(speeds)),
    )
    if records.lines is not None:
        acceleration, carrier = records.lines.acceleration[rows], records.lines.base_speed[rows]
        strong = np.abs(acceleration) >= KEPT_LINES * np.abs(acceleration).max(axis=1, keepdims=True)
        counts, values = strong.sum(axis=1), acceleration[strong]
        order = np.broadcast_to(records.lines.order, strong.shape)[strong]
    variables = {
        "signal": ("record time", signal, "m/s^2", "acceleration of the sensor, outwards, with noise"),
        "input_speed": ("record", speeds, "rad/s", "speed of the input"),
        "carrier_speed": ("record", carrier, "rad/s", "speed of the carrier"),
        "carrier_angle": ("record", records.angle[rows], "rad", "angle of the carrier at the beginning"),
        "line_count": ("record", counts, "1", "lines of the record"),
        "line_order": ("line", order, "1", "carrier order"),
        "line_real": ("line", np.real(values), "m/s^2", "real part of the amplitude, carrier at angle zero, no noise"),
        "line_imag": ("line", np.imag(values), "m/s^2", "imaginary part of the amplitude"),
        "drawn_error": ("error", records.errors, "m", "errors that were drawn, in the order of the tolerances"),
    }
    coords = {
        "record": ("record", numbers, "1", "number of the record"),
        "time": ("time", np.arange(plan.samples) / plan.rate, "s", "time"),
    }
    labels = {
        "kind": fault.kind,
        "gear": fault.gear,
        "planet": fault.planet,
        "tooth": fault.tooth,
        "flank": fault.flank,
    }
    attrs = {**labels, "size": fault.size, "torque": records.case.operation.torque, "machine": records.machine}
    attrs |= {"plan": plan.fingerprint, "seed": plan.seed, "noise": plan.noise, "case": records.case.source}
    return Contents(variables, coords, attrs | {"error": " ".join(records.error.split())})


def _labels(plan: FaultPlan, folder: Path, machines: range) -> Iterator[tuple[Any, ...]]:
    """Rows of the table of labels."""
    for machine in machines:
        data = read_dataset(folder / _name(machine))
        names = ("kind", "gear", "planet", "tooth", "flank", "size", "torque")
        label = [data.attrs[name] for name in names]
        label[3] = "" if label[3] < 0 else label[3]
        label[2] = label[2] or ""
        for record, speed, signal in zip(data["record"].values, data["input_speed"].values, data["signal"].values):
            level = float(np.sqrt(np.mean(signal.astype(float) ** 2)))
            ends = float(speed) / SPEED.scale, level, data.attrs["error"]
            yield int(record), _name(machine), machine, *label, *ends


def _write_signals(
    plan: FaultPlan, folder: Path, machine: int, request: FaultRequest, further: FurtherRecords
) -> Iterator[str]:
    """Write the records of a machine as WAV files and tables, and name them."""
    data = read_dataset(folder / _name(machine))
    for record, signal in zip(data["record"].values.tolist(), data["signal"].values):
        if record < request.count and not data.attrs["error"]:
            yield from _write_signal(plan, folder, record, signal, further)


def _write_signal(
    plan: FaultPlan, folder: Path, record: int, signal: np.ndarray, further: FurtherRecords
) -> Iterator[str]:
    """Write a record as WAV file and table, where these are wanted."""
    stem = f"record_{record:06d}"
    if further.wav:
        write_wav(Signal(stem, "m/s^2", plan.rate, signal), folder / f"{stem}.wav")
        yield f"{stem}.wav"
    if further.csv:
        time = np.arange(plan.samples) / plan.rate
        write_csv(folder / f"{stem}.csv", ("time [s]", "sensor [m/s^2]"), zip(time.tolist(), signal.tolist()))
        yield f"{stem}.csv"


def _write_alone(plan: FaultPlan, folder: Path, record: int, further: FurtherRecords) -> list[str]:
    """Compute and write one record and its case."""
    if record < 0:
        message = "records are numbered from 0"
        raise CaseError(message, code="E-RANGE", key="--index", value=record, limit="0 or more")
    records = solve_machine(plan, record // plan.each)
    row, stem = record % plan.each, f"record_{record:06d}"
    write_text(record_case(plan, record), folder / f"{stem}.toml")
    write_dataset(machine_contents(plan, records, slice(row, row + 1)), folder / f"{stem}.nc")
    signals = [] if records.error else [*_write_signal(plan, folder, record, records.signal[row], further)]
    return [f"{stem}.nc", f"{stem}.toml", *signals]


def describe_records(rows: list[tuple[Any, ...]], machines: int) -> Iterator[Block]:
    """Tabulate how many records there are of every kind, and how loud they are."""
    table, failed = [], dict.fromkeys(row[-1] for row in rows if row[-1])
    for kind in KINDS:
        of_kind = [row for row in rows if row[3] == kind]
        levels = [row[-2] for row in of_kind if not row[-1]]
        if of_kind:
            text = f"{np.median(levels):.4g}" if levels else "-"
            table.append((kind, str(len({row[2] for row in of_kind})), str(len(levels)), text))
    notes = [f"{len(rows)} records of {machines} machines"]
    notes += [f"{sum(row[-1] == error for row in rows)} records cannot be computed: {error}" for error in failed]
    yield Block("Records", ("kind", "machines", "records", "median level [m/s^2]"), tuple(table), tuple(notes))
