"""Measured profiles: the CSV files that a case names, read once and kept inside the case."""

from __future__ import annotations

import os
from itertools import pairwise

from femgear.casefile import tomlfile
from femgear.casefile.columns import embedded, read_columns
from femgear.casefile.deviations import MOST_POINTS
from femgear.casefile.units import ANGLE, LENGTH

_COLUMNS = {"roll angle": "roll_angles", "diameter": "diameters", "deviation": "deviations"}
_DIMENSIONS = {"roll angle": ANGLE, "diameter": LENGTH, "deviation": LENGTH}
_UNITS = {"roll_angles": "rad", "diameters": "m", "deviations": "m"}
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
            columns = embedded(file, name, f"{key}.file", read_profile)
            for column, values in columns.items():
                table[column] = [f"{value:.13g} {_UNITS[column]}" for value in values]
            found[key] = tomlfile.printable(file)
    return found


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
    found = read_columns(path, _DIMENSIONS, least=2, most=MOST_POINTS, remedy=_REMEDY)
    if "deviation" not in found.values:
        words = f"the columns are {' and '.join(found.values)}"
        raise found.problem(words, found.heading, limit="one of them deviations", remedy=_REMEDY)
    (places,) = (values for title, values in found.values.items() if title != "deviation")
    rising = places[1] > places[0]
    for (before, after), line in zip(pairwise(places), found.lines[1:], strict=True):
        if before == after or (after > before) is not rising:
            raise found.problem(
                "the points are neither ascending nor descending", line, value=after,
                remedy="sort the lines, and keep one line of every point",
            )  # fmt: skip
    return {_COLUMNS[title]: values for title, values in found.values.items()}
