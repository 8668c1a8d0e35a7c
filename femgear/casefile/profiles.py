"""Measured profiles: the CSV files that a case names, read once and kept inside the case."""

from __future__ import annotations

import math
import os
import re
from itertools import pairwise
from pathlib import PurePath

from femgear.casefile import tomlfile
from femgear.casefile.deviations import MOST_POINTS
from femgear.casefile.units import ANGLE, LENGTH, to_si
from femgear.errors import CaseError

_HEADING = re.compile(r"\s*(?P<name>[A-Za-z_ ]+?)[\s_]*[\[(](?P<unit>[^\])]+)[\])]\s*")
_COLUMNS = {"roll angle": "roll_angles", "diameter": "diameters", "deviation": "deviations"}
_REMEDY = "the first line names two columns: roll angle [deg] or diameter [mm], and deviation [um]"


def embed_profiles(data: dict, name: str) -> dict[str, str]:
    """Put the points of every ``file`` of a measured profile in its place.

    Parameters
    ----------
    data : dict
        Tables of a case file; modified.
    name : str
        Name of the case file: files are looked for in its folder and below.

    Returns
    -------
    dict of str to str
        The files by the key of their modification, such as ``"sun.modifications[0]"``.

    Raises
    ------
    CaseError
        As `read_profile`, or a path that leads out of the folder (E-FILE).
    """
    found = {}
    for gear in ("sun", "planet", "ring"):
        section = data.get(gear)
        tables = section.get("modifications") if isinstance(section, dict) else None
        for i, table in enumerate(tables if isinstance(tables, list) else ()):
            if not (isinstance(table, dict) and isinstance(table.get("file"), str)):
                continue
            if table.get("kind") != "measured profile" or "deviations" in table:
                continue
            key = f"{gear}.modifications[{i}]"
            file = table.pop("file")
            table.update(_points(file, name, f"{key}.file"))
            found[key] = tomlfile.printable(file)
    return found


def _points(file: str, name: str, key: str) -> dict[str, list[str]]:
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
        columns = read_profile(os.path.join(os.path.dirname(name), file))
    except CaseError as error:
        error.key = key
        raise
    unit = {"roll_angles": "rad", "diameters": "m", "deviations": "m"}
    return {
        column: [f"{value:.13g} {unit[column]}" for value in values] for column, values in columns.items()
    }


def read_profile(path: str | os.PathLike) -> dict[str, list[float]]:
    """Columns of a measured profile in SI units.

    Parameters
    ----------
    path : path-like
        Text in two columns, divided by comma, semicolon or tab (with semicolon or tab the numbers may have
        decimal commas); the first line names them with their units, such as ``roll angle [deg]`` or
        ``diameter [mm]`` and ``deviation [um]``. Empty lines and those that begin with ``#`` are skipped.
        Deviations are positive where there is more material.

    Returns
    -------
    dict
        ``"roll_angles"`` [rad] or ``"diameters"`` [m], ascending or descending, and ``"deviations"`` [m].

    Raises
    ------
    CaseError
        ``E-FILE``, ``E-FILE-ENC`` (see `tomlfile.read_text`); ``E-CSV`` with the number of the line.
    """
    name = tomlfile.printable(os.fsdecode(path))
    text = tomlfile.read_text(path)
    lines = [(i, line) for i, line in enumerate(text.splitlines(), start=1) if line.strip()]
    lines = [(i, line) for i, line in lines if not line.lstrip().startswith("#")]
    if len(lines) < 3:
        raise _problem(f"{max(len(lines) - 1, 0)} points", name, None, limit="two or more under the heading")
    if len(lines) - 1 > MOST_POINTS:
        raise _problem(f"{len(lines) - 1} points are too many", name, None, limit=f"{MOST_POINTS} points")
    divider = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    columns, factors = _heading(lines[0][1].split(divider), name, lines[0][0])
    rows = [_row(line.split(divider), divider, name, i) for i, line in lines[1:]]
    _check_order([row[columns[0] == "deviations"] for row in rows], [i for i, _ in lines[1:]], name)
    return {
        column: [row[k] * factor for row in rows] for k, (column, factor) in enumerate(zip(columns, factors))
    }


def _heading(cells: list[str], name: str, line: int) -> tuple[list[str], list[float]]:
    """Keys of the columns and the SI values of their units."""
    columns, factors = [], []
    for cell in cells:
        match = _HEADING.fullmatch(cell)
        title = " ".join(match["name"].lower().replace("_", " ").split()) if match else ""
        if title not in _COLUMNS:
            raise _problem("a column has no known name with its unit", name, line, value=cell)
        try:
            factors.append(to_si(f"1 {match['unit']}", ANGLE if title == "roll angle" else LENGTH))
        except CaseError as error:
            raise _problem(error.message, name, line, value=cell) from None
        columns.append(_COLUMNS[title])
    if len(columns) != 2 or columns.count("deviations") != 1:
        raise _problem(f"the columns are {', '.join(columns)}", name, line)
    return columns, factors


def _row(cells: list[str], divider: str, name: str, line: int) -> tuple[float, float]:
    if len(cells) != 2:
        raise _problem(f"{len(cells)} numbers in a line", name, line, limit="2")
    values = []
    for cell in cells:
        text = cell.strip()
        try:
            # underscores and words such as nan are numbers to Python, not to a measuring machine
            value = float(text if divider == "," else text.replace(",", ".")) if text.isascii() else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or "_" in text:
            raise _problem("not a finite number", name, line, value=text)
        values.append(value)
    return values[0], values[1]


def _check_order(places: list[float], numbers: list[int], name: str) -> None:
    rising = places[1] > places[0]
    for (before, after), line in zip(pairwise(places), numbers[1:], strict=True):
        if before == after or (after > before) is not rising:
            raise _problem("the points are neither ascending nor descending", name, line, value=after)


def _problem(message: str, name: str, line: int | None, *, value=None, limit=None) -> CaseError:
    return CaseError(
        message,
        code="E-CSV",
        file=f"{name}:{line}" if line else name,
        value=value,
        limit=limit,
        remedy=_REMEDY,
    )
