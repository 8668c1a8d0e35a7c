"""Integration of a gearbox in time, as its case file asks for it, with torques over time, and what is refused of it.

A torque series in a CSV file that the case names is read once and kept inside the case.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, StrictBool

from femgear.case.csv_columns import CsvColumns, embed_points, read_columns
from femgear.case.messages import no_such
from femgear.case.quantities import FREQUENCY, TIME, TORQUE, Count, Number, Quantity, Section, Title, Values
from femgear.errors import CaseError
from femgear.solvers.time.free_turn import TorqueHistory

FASTEST_RATE = 1e7
"""Of steps [Hz]."""
_MOST_POINTS, _MOST_STEPS, _MOST_VALUES = 20_000, 1e8, 2.5e8
_LARGEST_TORQUE, _LATEST = 1e9, 1e6
_POINTS = Values(min_length=1, max_length=_MOST_POINTS)
_DIMENSIONS = {"time": TIME, "torque": TORQUE}
_LIMITS = {"time": (0.0, _LATEST), "torque": (-_LARGEST_TORQUE, _LARGEST_TORQUE)}
_COLUMNS = "the first line names two columns: time [s] and torque [N m] (or other units)"
_DIGITS = ".13g"
"""Times and torques are written into the case with so many digits."""

SeriesTorque = Annotated[float, Quantity(TORQUE, -_LARGEST_TORQUE, _LARGEST_TORQUE)]
Instant = Annotated[float, Quantity(TIME, 0.0, _LATEST)]


class TorqueOverTimeSection(Section):
    """Torque over time: constant, a series in a ``file`` or in lists, or a ``share`` of what balances the others.

    A series is linear between its instants and constant outside them. A share of 1 holds the speed.
    """

    torque: SeriesTorque | None = None
    file: Title | None = None
    times: Annotated[tuple[Instant, ...], _POINTS] | None = None
    torques: Annotated[tuple[SeriesTorque, ...], _POINTS] | None = None
    share: Annotated[float, Number(0.0, 10.0)] | None = None


class LoadTorqueSection(TorqueOverTimeSection):
    """Torque over time at a ``load``, or on a shaft that is one rigid body, in place of that of the load case."""

    load: Title


class TransientSection(Section):
    """Integration in time from the speed of the load case on, what is kept of it, and its spectra.

    Steps come at the ``rate``, records at ``record``, behind a low pass. The run starts ``"static"``, deflected by its
    first loads, or from ``"zero"``, with loads that set in suddenly. The excitation has so many ``harmonics``. With
    ``contact_loss`` teeth part, and touch their ``back_flanks`` beyond their backlash; else meshes are linear. Meshes
    of a set go round with their carrier unless ``turning`` is false. ``torsional`` integrates the gearbox with
    rotations alone beside. Spectra leave out the start up to ``settle``, and have a ``resolution``.
    """

    duration: Annotated[float, Quantity(TIME, 1e-3, 1e5)]
    rate: Annotated[float, Quantity(FREQUENCY, 10.0, FASTEST_RATE)] = 20_000.0
    record: Annotated[float, Quantity(FREQUENCY, 1.0, FASTEST_RATE)] | None = None
    start: Literal["static", "zero"] = "static"
    harmonics: Annotated[int, Count(1, 200)] = 15
    contact_loss: StrictBool = False
    back_flanks: StrictBool = True
    turning: StrictBool = True
    torsional: StrictBool = False
    settle: Instant | None = None
    resolution: Annotated[float, Quantity(FREQUENCY, 1e-3, 1e7)] | None = None
    torque: Annotated[tuple[LoadTorqueSection, ...], Field(max_length=200)] = ()

    @property
    def settled(self) -> float:
        """Start that the spectra leave out [s]: as given, or three tenths of the run."""
        return 0.3 * self.duration if self.settle is None else self.settle


def torque_histories(
    torques: Sequence[tuple[str, TorqueOverTimeSection]], ratio: Mapping[str, float]
) -> tuple[TorqueHistory, ...]:
    """Make torques over time [N m] of named sections; a share balances the others over the speed ratios.

    ``ratio`` holds the speeds where they act over that of one shaft.
    """
    histories = [
        TorqueHistory(name, np.array(given.times or [0.0]), np.array(given.torques or [given.torque]))
        for name, given in torques
        if given.share is None
    ]
    for name, given in torques:
        if given.share is not None:
            times = np.unique(np.concatenate([history.times for history in histories] or [np.zeros(1)]))
            power = np.sum([ratio[history.body] * history.at(times) for history in histories], axis=0)
            histories.append(TorqueHistory(name, times, -given.share * power / ratio[name] * np.ones(len(times))))
    return tuple(histories)


def torque_problems(torques: Sequence[TorqueOverTimeSection], key: str) -> Iterator[CaseError]:
    """Refuse torques given in no way or in several, series that do not ascend, a second share."""
    shares = []
    for i, torque in enumerate(torques):
        series = len(torque.given("times", "torques"))
        given = torque.given("torque", "file", "share") + ["times"] * bool(series)
        if len(given) != 1 or series == 1:
            yield CaseError(
                "the torque is given in one way",
                code="E-CHOICE",
                key=f"{key}[{i}].{given[0] if given else 'torque'}",
                limit="torque, file, times with torques, or share",
            )
        elif torque.times is not None and torque.torques is not None:
            if len(torque.times) != len(torque.torques) or any(b <= a for a, b in pairwise(torque.times)):
                yield CaseError(
                    "the series needs ascending times, and as many torques",
                    code="E-TORQUE",
                    key=f"{key}[{i}].times",
                    value=f"{len(torque.times)} times, {len(torque.torques)} torques",
                    remedy="sort the points by time, and keep one of every instant",
                )
        shares += [f"{key}[{i}]"] if torque.share is not None else []
    if len(shares) > 1:
        yield CaseError(
            "a share needs other torques that it balances, none of them a share",
            code="E-TORQUE",
            key=f"{shares[-1]}.share",
            limit="one share, beside torques that are given",
        )


def transient_problems(transient: TransientSection | None, ports: Sequence[str]) -> Iterator[CaseError]:
    """Refuse what no entry of the integration shows alone, where torques may act on ``ports``."""
    if transient is None:
        return
    names = [torque.load for torque in transient.torque]
    for i, name in enumerate(names):
        key = f"transient.torque[{i}].load"
        if name not in ports:
            limit = ", ".join(ports[:20])
            yield no_such(
                "part", key, name, list(ports), "name a [[load]], or a shaft that is one rigid body", limit=limit
            )
        elif name in names[:i]:
            remedy = "add the torques up in one table"
            yield CaseError("a second torque at one place", code="E-DUPLICATE", key=key, value=name, remedy=remedy)
    yield from torque_problems(transient.torque, "transient.torque")
    if (steps := transient.duration * transient.rate) > _MOST_STEPS:
        yield CaseError(
            f"{steps:.3g} steps are too many",
            code="E-RANGE",
            key="transient.duration",
            value=TIME.show(transient.duration),
            limit=f"{_MOST_STEPS:g} steps: {TIME.show(_MOST_STEPS / transient.rate)}",
            remedy="take a shorter duration or a lower transient.rate",
        )
    if transient.settle is not None and not transient.settle < transient.duration:
        yield CaseError(
            "the spectra would leave out the whole run",
            code="E-RANGE",
            key="transient.settle",
            value=TIME.show(transient.settle),
            limit=f"below {TIME.show(transient.duration)} (transient.duration)",
        )
    elif transient.record is not None:
        yield from record_problems(transient, transient.record)


def record_problems(transient: TransientSection, record: float, columns: int = 2) -> Iterator[CaseError]:
    """Refuse what so many records a second [Hz], as given or chosen for the run, cannot hold in so many columns."""
    ratio = transient.rate / record
    if ratio < 1.0 - 1e-9 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        yield CaseError(
            "a record is kept after a whole number of steps",
            code="E-RANGE",
            key="transient.record",
            value=FREQUENCY.show(record),
            limit=f"{FREQUENCY.show(transient.rate)} (transient.rate) over a whole number",
            remedy=f"take {FREQUENCY.show(transient.rate / max(1, round(ratio)))}",
        )
    if (size := transient.duration * record * columns) > _MOST_VALUES:
        yield CaseError(
            f"{size:.3g} kept numbers are too many",
            code="E-RANGE",
            key="transient.record",
            value=FREQUENCY.show(record),
            limit=f"{_MOST_VALUES:g} numbers",
            remedy=f"take {FREQUENCY.show(record * _MOST_VALUES / size)} or less, or a shorter duration",
        )


def embed_torques(data: dict, name: str, entry: str = "transient.torque") -> dict[str, str]:
    """Put the points of every ``file`` of a torque in its place; see `embed_points`."""

    def plain(table: dict) -> bool:
        return not table.keys() & {"torque", "times", "torques", "share"}

    units = {"times": "s", "torques": "N m"}
    return embed_points(data, entry, name, read=read_torques, units=units, plain=plain)


def read_torques(path: str | os.PathLike) -> dict[str, list[float]]:
    """Read ``"times"`` [s] and ``"torques"`` [N m] of a CSV file.

    CaseError: E-FILE, E-FILE-ENC (see `femgear.case.text.read_text`), with the number of the line: unknown
    columns or units, numbers that are none, not finite or beyond the limits of a case file, decimal commas
    beside decimal points, times that do not ascend.

    Parameters
    ----------
    path : path-like
        Text in two columns, divided by comma, semicolon or tab (with semicolon or tab the numbers may have
        decimal commas); the first line names them with their units, such as ``time [s]`` and
        ``torque [kN m]``, in either order. Empty lines and those that begin with ``#`` are skipped.
    """
    columns = read_columns(path, _DIMENSIONS, least=1, most=_MOST_POINTS, remedy=_COLUMNS)
    times, torques = (_column(columns, key) for key in ("time", "torque"))
    for (before, after), line in zip(pairwise(times), columns.lines[1:], strict=True):
        if not after > before:
            raise columns.problem(
                "the times do not ascend",
                line,
                value=f"{after:g} s",
                limit=f"above {before:g} s",
                remedy="sort the lines by time, and keep one line of every instant",
            )
    return {"times": times, "torques": torques}


def _column(columns: CsvColumns, key: str) -> list[float]:
    """One column as the case will hold it, within the limits of a case file."""
    (low, high), dimension = _LIMITS[key], _DIMENSIONS[key]
    values = [float(f"{value:{_DIGITS}}") for value in columns.values[key]]
    for value, line in zip(values, columns.lines, strict=True):
        if not low <= value <= high:
            raise columns.problem(
                f"{dimension.name} of {dimension.show(value)} is not plausible",
                line,
                value=dimension.show(value),
                limit=f"{dimension.show(low)} to {dimension.show(high)}",
                remedy=f"check the number, and the unit of the column {key} in the heading",
            )
    return values
