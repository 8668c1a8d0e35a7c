"""Torques over time: constant, or a series from a CSV file."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError


@dataclass(frozen=True)
class TorqueHistory:
    """Torque on one body, linear between the instants and constant outside them.

    Parameters
    ----------
    body : str
    times : (m,) array
        Ascending [s].
    values : (m,) array
        [N m], positive about z.
    """

    body: str
    times: np.ndarray
    values: np.ndarray

    def __post_init__(self):
        times, values = (
            np.atleast_1d(np.array(self.times, float)),
            np.atleast_1d(np.array(self.values, float)),
        )
        fits = times.ndim == 1 and times.shape == values.shape and len(times) > 0
        if not fits or not np.all(np.isfinite([times, values])) or np.any(np.diff(times) <= 0.0):
            raise CaseError(
                f"the torque history of {self.body} has {times.size} instants and {values.size} values",
                code="E-TORQUE", limit="as many finite values as ascending instants, one or more",
            )  # fmt: skip
        for name, array in (("times", times), ("values", values)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def at(self, times) -> np.ndarray:
        """Torque [N m] at any instants [s]."""
        return np.interp(times, self.times, self.values)


def constant_torques(torques: dict[str, float]) -> tuple[TorqueHistory, ...]:
    """Histories of constant torques on bodies [N m]."""
    return tuple(TorqueHistory(body, [0.0], [value]) for body, value in torques.items())


def read_torque_csv(path: str | os.PathLike, body: str, *, factor: float = 1.0) -> TorqueHistory:
    """Torque history from two columns, time [s] and torque [N m], after one line of heads.

    Parameters
    ----------
    path : path-like
    body : str
    factor : float
        Multiplies the second column, such as 1000 for kN m or -1 for a braking torque written positive.

    Raises
    ------
    CaseError
        A file that cannot be read, a line that is not two numbers (E-TORQUE).
    """
    name = os.fspath(path)
    try:
        with open(path, newline="", encoding="utf-8-sig") as stream:
            lines = list(csv.reader(stream))
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"the torque file cannot be read: {error}", code="E-TORQUE", file=name) from error
    rows = []
    for number, line in enumerate(lines[1:], 2):
        if not line:
            continue
        try:
            time, torque = (float(cell) for cell in line)
        except ValueError as error:
            raise CaseError(
                f"line {number} is {','.join(line)!r}", code="E-TORQUE", file=name,
                limit="time [s] and torque [N m], separated by a comma",
            ) from error  # fmt: skip
        rows.append((time, torque))
    table = np.array(rows, float).reshape(-1, 2)
    return TorqueHistory(body, table[:, 0], factor * table[:, 1])
