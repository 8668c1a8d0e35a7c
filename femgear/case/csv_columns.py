"""Files that a case names; of CSV files two columns, numbers with their units in the heading.

`read_columns` reads any such file. `embed_points` puts the points of one in its place in the case, and
`embed_profiles` those of all measured profiles and leads: they are read once and kept inside the case.
Casings are too large for that: `embed_checksum` keeps the SHA-256 of their files.
"""

from __future__ import annotations

import csv
import hashlib
import math
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise, product
from pathlib import PurePath
from typing import Any

from femgear.case import text
from femgear.case.flank_sections import MOST_POINTS
from femgear.case.quantities import ANGLE, LENGTH, Dimension, to_si
from femgear.errors import CaseError

_HEADING = re.compile(r"\s*(?P<name>[A-Za-z_ ]+?)[\s_]*[\[(](?P<unit>[^\])]+)[\])]\s*")
_LONGEST_TITLE = 200
_COMMAS = "decimal commas need semicolons or tabs between the columns, or write decimal points"

MEASURED_HEADER = ["order", "amplitude [m/s^2]"]
"""First columns of measured lines."""
_PROFILE_ENTRIES = {
    "roll angle": "roll_angles",
    "diameter": "diameters",
    "place": "places",
    "deviation": "deviations",
}
_PROFILE_DIMENSIONS = {"roll angle": ANGLE, "diameter": LENGTH, "deviation": LENGTH}
_PROFILE_UNITS = {"roll_angles": "rad", "diameters": "m", "places": "m", "deviations": "m"}
_PROFILE_HEADING = "the first line names two columns: roll angle [deg] or diameter [mm], and deviation [um]"
_LEAD_DIMENSIONS = {"place": LENGTH, "deviation": LENGTH}
_LEAD_HEADING = "the first line names two columns: place [mm], from the middle of the width, and deviation [um]"


@dataclass(frozen=True)
class CsvColumns:
    """Two columns of a file.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    values : dict of str to list of float
        SI values by the title of the column, in the order of the file.
    lines : list of int
        Number of the line of every point.
    heading : int
        Number of the line that names the columns.
    """

    name: str
    values: dict[str, list[float]]
    lines: list[int]
    heading: int

    def problem(self, message: str, line: int, *, value=None, limit=None, remedy: str) -> CaseError:
        """Make a refusal (E-FILE) that names the file and its line."""
        return _problem(self.name, line, message, value=value, limit=limit, remedy=remedy)


def read_columns(
    path: str | os.PathLike, dimensions: Mapping[str, Dimension], *, least: int, most: int, remedy: str
) -> CsvColumns:
    """Read two columns, divided by comma, semicolon or tab, under a heading with names and units.

    With semicolon or tab the numbers may have decimal commas. Empty lines and those that begin with ``#`` are
    skipped.

    Parameters
    ----------
    dimensions : mapping of str to Dimension
        By the titles that are known, in small letters.
    least, most : int
        Points.
    remedy : str
        What the heading should be.

    Raises
    ------
    CaseError
        ``E-FILE``, ``E-FILE-ENC`` (see `text.read_text`); ``E-FILE`` with the number of the line: unknown
        columns or units, numbers that are none or not finite, decimal commas beside decimal points.
    """
    name = text.printable(os.fsdecode(path))
    lines = [(i, line) for i, line in enumerate(_text(path).splitlines(), start=1) if line.strip()]
    lines = [(i, line) for i, line in lines if not line.lstrip().startswith("#")]
    count = max(len(lines) - 1, 0)
    if count < least:
        limit = f"a heading, and {least} or more under it"
        raise _problem(name, None, f"{count or 'no'} points", limit=limit, remedy=remedy)
    if count > most:
        words = f"{count} points are too many"
        raise _problem(name, None, words, limit=f"{most} points", remedy="give it at fewer points")
    divider = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    (first, heading), *table = ((i, _cells(line, divider)) for i, line in lines)
    factors = _heading(heading, dimensions, partial(_problem, name, first), remedy)
    comma = divider != "," and any("," in cell for _, cells in table for cell in cells)
    rows = [_row(cells, list(factors), divider, comma, partial(_problem, name, i)) for i, cells in table]
    values = {title: [row[k] * factor for row in rows] for k, (title, factor) in enumerate(factors.items())}
    return CsvColumns(name, values, [i for i, _ in table], first)


def _text(path) -> str:
    """Text of the file; a refusal says what is expected."""
    try:
        return text.read_text(path)
    except CaseError as error:
        if error.code == "E-FILE":
            error.remedy = "name a text file of two columns, beside the case file or below"
        raise


def _cells(line: str, divider: str) -> list[str]:
    """Entries of a line, without blanks and quotation marks around them."""
    try:
        (cells,) = csv.reader([line], delimiter=divider, skipinitialspace=True)
    except csv.Error:  # an entry of more than 131 072 characters
        cells = [line[:80]]
    return [cell.strip() for cell in cells]


def _heading(cells, dimensions, problem: Callable[..., CaseError], remedy: str) -> dict[str, float]:
    """Titles of the columns and the SI values of their units."""
    units = {}
    for cell in cells[:3]:
        match = _HEADING.fullmatch(cell) if len(cell) < _LONGEST_TITLE else None
        title = " ".join(match["name"].lower().replace("_", " ").split()) if match else ""
        if match is None or title not in dimensions:
            raise problem("a column has no known name with its unit", value=cell, remedy=remedy)
        try:
            units[title] = to_si(f"1 {match['unit']}", dimensions[title])
        except CaseError as error:
            swapped = any(_has(match["unit"], d) for d in dimensions.values() if d is not dimensions[title])
            words = "the units of the two columns seem to be swapped" if swapped else remedy
            raise problem(error.message, value=cell, remedy=words) from None
    if len(cells) != 2 or len(units) != 2:
        raise problem(f"the columns are {', '.join(cells[:3])}", limit="two", remedy=remedy)
    return units


def _has(unit: str, dimension: Dimension) -> bool:
    """Whether a unit has a dimension."""
    try:
        to_si(f"1 {unit}", dimension)
    except CaseError:
        return False
    return True


def _row(cells, titles: list[str], divider: str, comma: bool, problem: Callable[..., CaseError]):
    """Two numbers of a line; with decimal commas anywhere in the file a point would be of thousands."""
    if len(cells) != 2:
        remedy = f"every line needs a {titles[0]} and a {titles[1]}, divided as the heading is"
        if divider == "," and len(cells) > 2:
            semicolon = any(";" in cell for cell in cells)
            remedy = "divide the heading by a semicolon as well" if semicolon else _COMMAS
        count = f"{len(cells)} {'entry' if len(cells) == 1 else 'entries'}"
        raise problem(f"{count} in a line", limit="2", remedy=remedy)
    return [_number(cell, divider, comma, problem) for cell in cells]


def _number(cell: str, divider: str, comma: bool, problem: Callable[..., CaseError]) -> float:
    """A finite number, with a decimal comma where the file has them."""
    if comma and "." in cell:
        remedy = "write decimal commas throughout or decimal points throughout, and none for thousands"
        raise problem("decimal commas and points in one file", value=cell, limit="one of them", remedy=remedy)
    try:
        value = float(cell.replace(",", ".") if comma else cell) if cell.isascii() else math.nan
    except ValueError:
        value = math.nan
    # underscores and words such as nan are numbers to Python alone
    if not math.isfinite(value) or "_" in cell:
        remedy = _COMMAS if divider == "," and "," in cell else "write numbers such as 120, 1.5 or 2.4e3"
        raise problem("not a finite number", value=cell, remedy=remedy)
    return value


def _problem(name: str, line: int | None, message: str, *, value=None, limit=None, remedy: str) -> CaseError:
    file = f"{name}:{line}" if line else name
    return CaseError(message, code="E-FILE", file=file, value=value, limit=limit, remedy=remedy)


def embed_points(
    data: dict,
    entry: str,
    name: str,
    *,
    read: Callable[[str], Mapping[str, list[float]]],
    units: Mapping[str, str],
    plain: Callable[[dict], bool],
) -> dict[str, str]:
    """Put the points of every ``file`` of a list of tables in its place.

    Parameters
    ----------
    data, name : dict, str
        Tables of a case file, modified, and its name: files lie in its folder or below.
    entry : str
        Dotted key of the list, such as ``"sun.modifications"``.
    read : callable
        ``(path) -> SI values by entry``.
    units : mapping of str to str
        SI unit of each entry.
    plain : callable
        ``(table) -> bool``: others contradict themselves, stay as they are, and are refused with the others.

    Returns
    -------
    dict of str to str
        The files by the key of their table, such as ``"sun.modifications[0]"``.

    Raises
    ------
    CaseError
        A path that leads out of the folder (E-FILE), and what `read` raises, with the key.
    """
    section, _, last = entry.partition(".")
    tables, points_of_files, points_of_path = data.get(section), {}, {}
    tables = tables.get(last) if isinstance(tables, dict) else None
    for i, table in enumerate(tables if isinstance(tables, list) else ()):
        if isinstance(table, dict) and isinstance(table.get("file"), str) and plain(table):
            key, file = f"{entry}[{i}]", table.pop("file")
            if (path := PurePath(file)) not in points_of_path:
                points = embedded(file, name, f"{key}.file", read)
                points_of_path[path] = {
                    column: [f"{value:.13g} {units[column]}" for value in values] for column, values in points.items()
                }
            table |= points_of_path[path]
            points_of_files[key] = text.printable(file)
    return points_of_files


def embedded(file: str, name: str, key: str, read: Callable[[str], object]) -> Any:
    """Read a file that the entry ``key`` names, beside the case file or below, no link leading out of there.

    CaseError: a path that leads out of the folder (E-FILE), and what ``read`` raises, with the key.
    """
    folder, path = os.path.dirname(name), PurePath(file)
    try:
        home = os.path.realpath(folder)
        inside = os.path.commonpath([home, os.path.realpath(os.path.join(folder, file))]) == home
    except ValueError:  # another drive; a character that no name has
        inside = False
    if path.anchor or ".." in path.parts or not path.parts or not inside:
        message = "the file must lie in the folder of the case or below"
        shown, remedy = text.printable(file), "copy it there and name it relative to the case file"
        raise CaseError(message, code="E-FILE", key=key, value=shown, file=name or None, remedy=remedy)
    try:
        return read(os.path.join(folder, file))
    except CaseError as error:
        error.key = key
        raise


def embed_profiles(data: dict, name: str) -> dict[str, str]:
    """Put the points of every ``file`` of a measured profile or lead in its place; see `embed_points`."""

    def plain(table: dict, kind: str) -> bool:
        return table.get("kind") == kind and "deviations" not in table

    files, kinds = {}, (("measured profile", read_profile), ("measured lead", read_lead))
    for gear, (kind, read) in product(("sun", "planet", "ring", "gear_1", "gear_2"), kinds):
        options = {"read": read, "units": _PROFILE_UNITS, "plain": partial(plain, kind=kind)}
        files |= embed_points(data, f"{gear}.modifications", name, **options)
    return files


def embed_measured_lines(data: dict, name: str) -> dict[str, str]:
    """Put the lines of every ``file`` of measured lines, as ``femgear measured`` writes them, in its place."""
    housing: Any = data.get("housing")
    tables, files = housing.get("measured") if isinstance(housing, dict) else None, {}
    if not isinstance(tables, list):
        return files
    del housing["measured"]  # a file that cannot be read is refused for that alone
    for i, table in enumerate(tables):
        if isinstance(table, dict) and isinstance(table.get("file"), str) and "orders" not in table:
            key, file = f"housing.measured[{i}]", table.pop("file")
            orders, accelerations = embedded(file, name, f"{key}.file", read_measured_lines)
            table |= {"orders": orders, "accelerations": [f"{value:.9g} m/s^2" for value in accelerations]}
            files[key] = text.printable(file)[:200]
            table.setdefault("source", files[key])
    housing["measured"] = tables
    return files


def read_measured_lines(path: str | os.PathLike) -> tuple[list[float], list[float]]:
    """Read orders and peak accelerations [m/s^2] from the first two columns of a lines.csv of ``femgear measured``.

    CaseError: another file, or amplitudes in a unit that is no acceleration (E-FILE).
    """
    name = text.printable(os.fsdecode(path))
    rows = [_cells(line, ",") for line in _text(path).splitlines() if line.strip()]
    if rows[0][:2] != MEASURED_HEADER:
        value, limit = ", ".join(rows[0][:2]), ", ".join(MEASURED_HEADER)
        remedy = "name the lines.csv of femgear measured; --unit tells it the acceleration of a one in the recording"
        raise _problem(name, 1, "no measured lines in m/s^2", value=value, limit=limit, remedy=remedy)
    numbers = [
        [_number(cell, ",", False, partial(_problem, name, i)) for cell in row[:2]] for i, row in enumerate(rows[1:], 2)
    ]
    if not numbers or min(map(len, numbers)) < 2:
        remedy = "lower --threshold of femgear measured"
        raise _problem(name, None, "no measured lines", limit="one or more", remedy=remedy)
    return [row[0] for row in numbers], [row[1] for row in numbers]


def embed_checksum(data: dict, name: str) -> dict[str, str]:
    """Put the SHA-256 of the files of a casing beside their names, where a case does not have it already."""
    housing: Any = data.get("housing")
    return add_checksum(housing, "structure", name, "housing.structure") if isinstance(housing, dict) else {}


def add_checksum(holder: dict, entry: str, name: str, key: str) -> dict[str, str]:
    """Put the SHA-256 of ``file`` and ``nodes`` of a table beside them, as `embed_checksum`.

    The table is an entry of a holder, and stands at the key of the case file of that name.
    """
    table = holder.get(entry)
    if not isinstance(table, dict) or "sha256" in table or not isinstance(table.get("file"), str):
        return {}
    names = {part: table[part] for part in ("file", "nodes") if isinstance(table.get(part), str)}
    del holder[entry]  # a file that cannot be read is refused for that alone
    checksums = [embedded(file, name, f"{key}.{part}", input_checksum) for part, file in names.items()]
    holder[entry] = table | {"sha256": checksum_of_all(checksums)}
    return {key: text.printable(names["file"])}


def checksum_of_all(checksums: Iterable[str]) -> str:
    """Compute the SHA-256 of those of several files, in their order."""
    return hashlib.sha256("".join(checksums).encode()).hexdigest()


def refuse_other_files(files: Iterable[str | os.PathLike], name: str, sha256: str | None) -> None:
    """Refuse (E-OTHER-CASE) files, under the ``name`` of the first, that are not those of a checksum."""
    if checksum_of_all(input_checksum(file) for file in files) != sha256:
        raise CaseError(
            "these are not the files that the case was read with",
            code="E-OTHER-CASE",
            key="file",
            value=name,
            limit=f"SHA-256 {sha256}",
            remedy="put them beside the case file, or leave out sha256 for those that are there",
        )


def input_checksum(path: str | os.PathLike) -> str:
    """Compute the SHA-256 of a file, as hexadecimal text. CaseError: it cannot be read (E-FILE)."""
    name = os.fsdecode(path)
    if os.path.isdir(path):
        raise CaseError("this is a folder", code="E-FILE", file=name, remedy="name a file in it")
    try:
        if not os.path.isfile(path):
            raise FileNotFoundError(0, "no such file")
        with open(path, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except (OSError, ValueError) as error:
        reason, remedy = getattr(error, "strerror", None) or str(error), "check its name and permissions"
        message = f"cannot read the file: {reason}"
        raise CaseError(message, code="E-FILE", file=name, remedy=remedy) from error


def read_profile(path: str | os.PathLike) -> dict[str, list[float]]:
    """Read the columns of a measured profile in SI units; for the file and refusals see `read_columns`.

    Its heading is ``roll angle [deg]`` or ``diameter [mm]``, and ``deviation [um]``, or in other units. The
    values are ``"roll_angles"`` [rad] or ``"diameters"`` [m], ascending or descending, and ``"deviations"``
    [m], positive where there is more material.
    """
    return _read_deviations(path, _PROFILE_DIMENSIONS, _PROFILE_HEADING)


def read_lead(path: str | os.PathLike) -> dict[str, list[float]]:
    """Read the columns of a measured lead, ``place [mm]`` and ``deviation [um]``, as `read_profile`."""
    return _read_deviations(path, _LEAD_DIMENSIONS, _LEAD_HEADING)


def _read_deviations(path, dimensions: Mapping[str, Dimension], heading: str) -> dict[str, list[float]]:
    """Read deviations over places of one kind, and refuse places that neither ascend nor descend."""
    columns = read_columns(path, dimensions, least=2, most=MOST_POINTS, remedy=heading)
    if "deviation" not in columns.values:
        words = f"the columns are {' and '.join(columns.values)}"
        raise columns.problem(words, columns.heading, limit="one of them deviations", remedy=heading)
    (places,) = (values for title, values in columns.values.items() if title != "deviation")
    rising = places[1] > places[0]
    for (before, after), line in zip(pairwise(places), columns.lines[1:], strict=True):
        if before == after or (after > before) is not rising:
            raise columns.problem(
                "the points are neither ascending nor descending",
                line,
                value=after,
                remedy="sort the lines, and keep one line of every point",
            )
    return {_PROFILE_ENTRIES[title]: values for title, values in columns.values.items()}
