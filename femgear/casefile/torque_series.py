"""Torque series: the CSV files that a drivetrain case names, read once and kept inside the case."""

from __future__ import annotations

import math
import os
import re
from itertools import pairwise
from pathlib import PurePath

from femgear.casefile import tomlfile
from femgear.casefile.drivetrain import MOST_POINTS
from femgear.casefile.units import TIME, TORQUE, to_si
from femgear.errors import CaseError

_HEADING = re.compile(r"\s*(?P<name>[A-Za-z]+)\s*[\[(](?P<unit>[^\])]+)[\])]\s*")
_DIMENSIONS = {"time": TIME, "torque": TORQUE}
_REMEDY = "the first line names two columns: time [s] and torque [N m] (or other units)"


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
        times, torques = _points(file, name, f"{key}.file")
        table["times"] = [f"{value:.13g} s" for value in times]
        table["torques"] = [f"{value:.13g} N m" for value in torques]
        found[key] = tomlfile.printable(file)
    return found


def _points(file: str, name: str, key: str) -> tuple[list[float], list[float]]:
    path = PurePath(file)
    if path.is_absolute() or ".." in path.parts or not path.parts:
        raise CaseError(
            "the file must lie in the folder of the case or below",
            code="E-FILE",
            key=key,
            value=tomlfile.printable(file),
            file=name or None,
            remedy="copy it there and name it relative to the case file",
        )
    try:
        return read_torques(os.path.join(os.path.dirname(name), file))
    except CaseError as error:
        error.key = key
        raise


def read_torques(path: str | os.PathLike) -> tuple[list[float], list[float]]:
    """Instants [s] and torques [N m] of a CSV file.

    Parameters
    ----------
    path : path-like
        Text in two columns, divided by comma, semicolon or tab (with semicolon or tab the numbers may have
        decimal commas); the first line names them with their units, such as ``time [s]`` and
        ``torque [kN m]``. Empty lines and those that begin with ``#`` are skipped.

    Raises
    ------
    CaseError
        ``E-FILE``, ``E-FILE-ENC`` (see `tomlfile.read_text`); ``E-CSV`` with the number of the line: unknown
        columns or units, numbers that are none or not finite, times that do not ascend.
    """
    name = tomlfile.printable(os.fsdecode(path))
    text = tomlfile.read_text(path)
    lines = [(i, line) for i, line in enumerate(text.splitlines(), start=1) if line.strip()]
    lines = [(i, line) for i, line in lines if not line.lstrip().startswith("#")]
    if len(lines) < 2:
        raise _problem("no points", name, None, limit="one or more under the heading")
    if len(lines) - 1 > MOST_POINTS:
        raise _problem(f"{len(lines) - 1} points are too many", name, None, limit=f"{MOST_POINTS} points")
    divider = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    columns = _heading(lines[0][1].split(divider), name, lines[0][0])
    rows = [_row(line.split(divider), divider, name, i) for i, line in lines[1:]]
    at, factor = columns["time"]
    times = [row[at] * factor for row in rows]
    for (before, after), (line, _) in zip(pairwise(times), lines[2:], strict=True):
        if not after > before:
            raise _problem("the times do not ascend", name, line, value=f"{after:g} s")
    at, factor = columns["torque"]
    return times, [row[at] * factor for row in rows]


def _heading(cells: list[str], name: str, line: int) -> dict[str, tuple[int, float]]:
    """Place of every column, and the SI value of its unit."""
    found = {}
    for place, cell in enumerate(cells):
        match = _HEADING.fullmatch(cell)
        title = match["name"].lower() if match else ""
        if title not in _DIMENSIONS:
            raise _problem("a column has no known name with its unit", name, line, value=cell)
        try:
            found[title] = place, to_si(f"1 {match['unit']}", _DIMENSIONS[title])
        except CaseError as error:
            raise _problem(error.message, name, line, value=cell) from None
    if len(cells) != 2 or len(found) != 2:
        raise _problem(f"the columns are {', '.join(found)}", name, line)
    return found


def _row(cells: list[str], divider: str, name: str, line: int) -> tuple[float, float]:
    if len(cells) != 2:
        raise _problem(f"{len(cells)} numbers in a line", name, line, limit="2")
    values = []
    for cell in cells:
        text = cell.strip()
        try:
            value = float(text if divider == "," else text.replace(",", ".")) if text.isascii() else math.nan
        except ValueError:
            value = math.nan
        # underscores and words such as nan are numbers to Python alone
        if not math.isfinite(value) or "_" in text:
            raise _problem("not a finite number", name, line, value=text)
        values.append(value)
    return values[0], values[1]


def _problem(message: str, name: str, line: int | None, *, value=None, limit=None) -> CaseError:
    return CaseError(
        message,
        code="E-CSV",
        file=f"{name}:{line}" if line else name,
        value=value,
        limit=limit,
        remedy=_REMEDY,
    )
