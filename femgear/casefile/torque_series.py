"""Torque series: the CSV files that a drivetrain case names, read once and kept inside the case."""

from __future__ import annotations

import os
from itertools import pairwise

from femgear.casefile import tomlfile
from femgear.casefile.columns import Columns, embedded, read_columns
from femgear.casefile.drivetrain import LARGEST_TORQUE, LATEST, MOST_POINTS
from femgear.casefile.units import TIME, TORQUE

_DIMENSIONS = {"time": TIME, "torque": TORQUE}
_LIMITS = {"time": (0.0, LATEST), "torque": (-LARGEST_TORQUE, LARGEST_TORQUE)}
_COLUMNS = "the first line names two columns: time [s] and torque [N m] (or other units)"
# Times and torques are written into the case with so many digits.
_DIGITS = ".13g"


def embed_torques(data: dict, name: str) -> dict[str, str]:
    """Put the points of every ``file`` of a torque in its place.

    Parameters
    ----------
    data : dict
        Tables of a case file; modified.
    name : str
        Name of the case file: files are looked for in its folder and below.

    Returns
    -------
    dict of str to str
        The files by the key of their entry, such as ``"operation.torque[0]"``.

    Raises
    ------
    CaseError
        As `read_torques`, or a path that leads out of the folder (E-FILE).
    """
    operation, found = data.get("operation"), {}
    tables = operation.get("torque") if isinstance(operation, dict) else None
    for i, table in enumerate(tables if isinstance(tables, list) else ()):
        # contradicting entries stay as they are, and are refused with the others
        if not (isinstance(table, dict) and isinstance(table.get("file"), str)):
            continue
        if table.keys() & {"torque", "times", "torques", "share"}:
            continue
        key = f"operation.torque[{i}]"
        file = table.pop("file")
        times, torques = embedded(file, name, f"{key}.file", read_torques)
        table["times"] = [f"{value:{_DIGITS}} s" for value in times]
        table["torques"] = [f"{value:{_DIGITS}} N m" for value in torques]
        found[key] = tomlfile.printable(file)
    return found


def read_torques(path: str | os.PathLike) -> tuple[list[float], list[float]]:
    """Instants [s] and torques [N m] of a CSV file.

    Parameters
    ----------
    path : path-like
        Text in two columns, divided by comma, semicolon or tab (with semicolon or tab the numbers may have
        decimal commas); the first line names them with their units, such as ``time [s]`` and
        ``torque [kN m]``, in either order. Empty lines and those that begin with ``#`` are skipped.

    Raises
    ------
    CaseError
        ``E-FILE``, ``E-FILE-ENC`` (see `tomlfile.read_text`); ``E-CSV`` with the number of the line: unknown
        columns or units, numbers that are none, not finite or beyond the limits of a case file, decimal
        commas beside decimal points, times that do not ascend.
    """
    found = read_columns(path, _DIMENSIONS, least=1, most=MOST_POINTS, remedy=_COLUMNS)
    times, torques = (_column(found, key) for key in ("time", "torque"))
    for (before, after), line in zip(pairwise(times), found.lines[1:], strict=True):
        if not after > before:
            raise found.problem(
                "the times do not ascend", line, value=f"{after:g} s", limit=f"above {before:g} s",
                remedy="sort the lines by time, and keep one line of every instant",
            )  # fmt: skip
    return times, torques


def _column(found: Columns, key: str) -> list[float]:
    """One column as the case will hold it, within the limits of a case file."""
    (low, high), dimension = _LIMITS[key], _DIMENSIONS[key]
    values = [float(f"{value:{_DIGITS}}") for value in found.values[key]]
    for value, line in zip(values, found.lines, strict=True):
        if not low <= value <= high:
            raise found.problem(
                f"{dimension.name} of {dimension.show(value)} is not plausible", line,
                value=dimension.show(value), limit=f"{dimension.show(low)} to {dimension.show(high)}",
                remedy=f"check the number, and the unit of the column {key} in the heading",
            )  # fmt: skip
    return values
