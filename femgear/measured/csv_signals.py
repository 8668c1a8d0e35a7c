"""Time signals from text files: columns with any separator and decimal mark, with or without a heading.

Programs of measurement write lines of their own above the columns, names, units or both, blanks or tabs between the
columns, decimal commas, Latin-1 or UTF-16. What could be read in two ways is refused.
"""

from __future__ import annotations

import csv
import os
import re
from collections import Counter
from itertools import product
from pathlib import Path

import numpy as np

from femgear.case.text import read_bytes
from femgear.errors import CaseError, printable
from femgear.measured.channels import (
    LEAST_SAMPLES,
    MOST_BYTES,
    Channel,
    agreed_rate,
    file_problem,
    is_time,
    rate_of_times,
    split_unit,
)

_HEAD = 1_000_000
"""Bytes within which the first number must stand."""
_MOSTLY = 0.9
"""Share of high bytes that are zero in UTF-16 of numbers."""
_LOOKED_AT = 50
"""Lines by which separator and decimal mark are found."""
_NEARLY_ALL = 0.9
"""Share of these lines that have one form where the others are broken."""
_SEPARATORS = (";", "\t", ",", None)
_NUMBER = {".": r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", ",": r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"}
_DIGITS, _COMMAS_ALONE = re.compile(r"[+-]?\d+"), re.compile(r"[\d+\-eE]+(,[\d+\-eE]+){2,}")
"""Whole numbers; lines of nothing else between commas."""
_LOST = ("nan", "inf", "-inf", "+inf", "")
"""Cells of a sample that is missing, which is refused with its place."""
_UNITS = {"", "s", "ms", "us", "µs", "g", "v", "mv", "pa", "n", "m/s", "mm/s", "um", "µm", "mm", "rpm", "1/min", "hz"}
_UNITS |= {"m/s^2", "m/s²", "m/s2", "mm/s^2", "mm/s²", "n m", "nm", "deg", "°", "-", "1"}


def read_csv_signals(path: str | os.PathLike, *, rate: float | None = None) -> tuple[Channel, ...]:
    """Read the columns of a text file as channels; a column of times tells their rate.

    CaseError: E-FILE, with the line: no numbers, separators or decimal marks that can be read in two ways, lines of
    another length, no rate.

    Parameters
    ----------
    path : path
        Of the file.
    rate : float, optional
        Samples a second [Hz], where no column has the times.
    """
    name = printable(Path(path).name)
    lines = _decoded(read_bytes(path, MOST_BYTES, "name a text file of numbers in columns"), name).splitlines()
    first = _first_of_numbers(lines, name)
    separator, mark = _form(lines, first, name)
    if separator == ",":
        _check_decimal_points(lines, first, name)
    values = _numbers(lines, first, separator, mark, name)
    titles = _titles(lines[:first], separator, values.shape[1])
    time = [k for k, (title, _) in enumerate(titles) if is_time(title)]
    in_file, start = None, 0.0
    if time:
        in_file, start = rate_of_times(values[:, time[0]], titles[time[0]][1], name, rate)
    elif rate is None and values.shape[1] > 1 and not any(title for title, _ in titles):
        in_file, start = _unnamed_times(values[:, 0], name)
        time = [0] if in_file else []
    rate = agreed_rate(in_file, rate, name)
    columns = [k for k in range(values.shape[1]) if k not in time]
    named = [(titles[k][0] or f"column {k + 1}", titles[k][1], values[:, k]) for k in columns]
    return tuple(Channel(name, title, unit, rate, column, start) for title, unit, column in named)


def _decoded(data: bytes, name: str) -> str:
    """Text of a file in UTF-8, UTF-16 with its mark or without, or Latin-1, in which programs of measurement write."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", "replace")
    for high, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        # of numbers and names in columns nearly all high bytes are zero, and no low ones
        zeros = data[high:_HEAD:2].count(0)
        if zeros > _MOSTLY * len(data[high:_HEAD:2]) and b"\0" not in data[1 - high : _HEAD : 2]:
            return data.decode(encoding, "replace")
    if b"\0" in data[:_HEAD]:
        remedy = "name a text file, or keep the end of the name: .wav, .mat, .uff, .unv"
        raise file_problem(name, "bytes that no text has", remedy=remedy)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _first_of_numbers(lines: list[str], name: str) -> int:
    """Find the line of the first sample: the first of some in succession that hold nothing but numbers."""
    length, of_numbers = 0, re.compile(r"[\d+\-.,;eE\s]*\d[\d+\-.,;eE\s]*|.*\b(nan|inf)\b.*", re.IGNORECASE)
    for number, line in enumerate(lines):
        length += len(line) + 1
        if length > _HEAD:
            break
        block = [text for text in lines[number : number + 4] if text.strip()]
        if len(block) > 2 and all(len(text) < 100_000 and of_numbers.fullmatch(text) for text in block):
            return number
    limit = f"lines of nothing but numbers within the first {_HEAD:g} bytes"
    remedy = "export the samples as columns of numbers, with their names in one line above"
    raise file_problem(name, "no samples", limit=limit, remedy=remedy)


def _cells(line: str, separator: str | None) -> list[str]:
    """Cells of a line without a separator at its end."""
    if separator is None:
        return line.split()
    line = line.rstrip().removesuffix(separator) if separator != "\t" else line.rstrip("\r\n ")
    (cells,) = csv.reader([line[:100_000]], delimiter=separator, skipinitialspace=True)
    return [cell.strip() for cell in cells]


def _form(lines: list[str], first: int, name: str) -> tuple[str | None, str]:
    """Find separator and decimal mark of the samples: the only ones by which all lines are as many numbers."""
    sample = [line for line in lines[first : first + _LOOKED_AT] if line.strip()]
    counts = dict[tuple[str | None, str], int]()
    for separator, mark in product(_SEPARATORS, ".,"):
        if separator == mark:
            continue
        number = re.compile(_NUMBER[mark])
        rows = [_cells(line, separator) for line in sample]
        whole = all(number.fullmatch(cell) or cell.lower() in _LOST for row in rows for cell in row)
        if whole and len({len(row) for row in rows}) == 1 and (len(rows[0]) > 1 or separator is None):
            counts[separator, mark] = len(rows[0])
    if not counts and all(_COMMAS_ALONE.fullmatch(line.strip()) for line in sample):
        raise _commas_within_commas(sample[0], first, name)
    if not counts:
        _refuse_single_lines(lines, first, name)
        remedy = "one separator in all lines, and decimal points or decimal commas throughout"
        raise file_problem(
            f"{name}:{first + 1}", "the columns cannot be told apart", value=sample[0][:80], remedy=remedy
        )
    most = max(counts.values())
    best = next(form for form, count in counts.items() if count == most)
    if best == (",", ".") and any(separator is None for separator, _ in counts):
        return _comma_between_or_within(lines, first, most, name)
    return best


def _refuse_single_lines(lines: list[str], first: int, name: str) -> None:
    """Refuse the first line of samples that does not have the form of nearly all others, if there is such a form."""
    sample = enumerate(lines[first : first + _LOOKED_AT], first + 1)
    numbered = [(place, line) for place, line in sample if line.strip()]
    for separator, mark in product(_SEPARATORS, ".,"):
        number = re.compile(_NUMBER[mark])
        rows = [_cells(line, separator) for _, line in numbered]
        columns = Counter(map(len, rows)).most_common(1)[0][0]
        fits = [len(row) == columns and all(map(number.fullmatch, row)) for row in rows]
        if separator != mark and columns > 1 and _NEARLY_ALL * len(fits) <= sum(fits) < len(fits):
            place, line = numbered[fits.index(False)]
            raise _broken_line(f"{name}:{place}", line, columns)


def _broken_line(place: str, line: str, columns: int) -> CaseError:
    """Make the refusal of a line that is not made of so many numbers."""
    return file_problem(
        place,
        "a line that is not made of finite numbers, one for every column",
        value=line[:80],
        limit=f"{columns} numbers",
        remedy="cut the file there if it was broken off; lost samples are not replaced",
    )


def _check_decimal_points(lines: list[str], first: int, name: str) -> None:
    """Refuse columns between commas whose numbers have decimal commas: twice as many cells as names, or as "0,015"."""
    heading = next((line for line in reversed(lines[:first]) if line.strip()), "")
    rows = [_cells(line, ",") for line in lines[first : first + _LOOKED_AT] if line.strip()]
    names, whole = len(_cells(heading, ",")), all(_DIGITS.fullmatch(cell) for row in rows for cell in row)
    halved = bool(heading) and len(rows[0]) == 2 * names
    padded = any(cell.startswith("0") and len(cell) > 1 for row in rows for cell in row[1:])
    if whole and (halved or padded):
        raise _commas_within_commas(lines[first], first, name)


def _commas_within_commas(line: str, first: int, name: str) -> CaseError:
    remedy = "export with semicolons or tabs between the columns, or with decimal points"
    words = "decimal commas, and commas between the columns too: no one can tell them apart"
    return file_problem(f"{name}:{first + 1}", words, value=line[:80], remedy=remedy)


def _comma_between_or_within(lines: list[str], first: int, columns: int, name: str) -> tuple[str | None, str]:
    """Tell "1,5" as two whole numbers from one with a decimal comma, by the heading above."""
    heading = next((line for line in reversed(lines[:first]) if line.strip()), "")
    if heading and len(_cells(heading, ",")) == columns:
        return ",", "."
    if heading and "," not in heading:
        return None, ","
    remedy = "head the columns, write decimal points, or divide the columns by semicolons"
    value = lines[first][:80]
    raise file_problem(f"{name}:{first + 1}", "commas may be separators or decimal marks", value=value, remedy=remedy)


def _numbers(lines: list[str], first: int, separator: str | None, mark: str, name: str) -> np.ndarray:
    """Samples (n, columns) of all lines from the first on."""
    rows = [line.rstrip() for line in lines[first:] if line.strip()]
    if separator not in (None, "\t"):
        rows = [line.removesuffix(separator) for line in rows]
    if len(rows) < LEAST_SAMPLES:
        limit, remedy = f"{LEAST_SAMPLES} or more", "record some turns of the carrier at least"
        raise file_problem(name, f"{len(rows)} samples", limit=limit, remedy=remedy)
    texts = [line.replace(",", ".") for line in rows] if mark == "," else rows
    try:
        return np.loadtxt(texts, delimiter=separator, ndmin=2, comments=None)
    except ValueError:
        pass
    number, columns = re.compile(_NUMBER[mark]), len(_cells(rows[0], separator))
    for place, line in enumerate(lines[first:], first + 1):
        cells = _cells(line, separator)
        if line.strip() and (len(cells) != columns or not all(map(number.fullmatch, cells))):
            raise _broken_line(f"{name}:{place}", line, columns)
    raise file_problem(name, "numbers that cannot be read", remedy="write them as 1.5 or 2.4e3")


def _titles(head: list[str], separator: str | None, columns: int) -> list[tuple[str, str]]:
    """Names and units of the columns from the lines above them; empty where there are none."""
    above = [line.strip("\r\n") for line in head if line.strip()][-2:]
    # names with blanks stand between tabs, semicolons or commas
    forms = [separator] if separator else ["\t", ";", ",", None]
    fitting = [form for form in forms if above and len(_cells(above[-1], form)) == columns]
    rows = [_cells(line, fitting[0]) for line in above] if fitting else []
    rows = [[line.strip()] for line in above] if columns == 1 else [row for row in rows if len(row) == columns]
    if not rows:
        return [("", "")] * columns
    if len(rows) == 2 and all(cell.strip("[]() ").lower() in _UNITS for cell in rows[1]):
        return [(split_unit(name)[0], unit.strip("[]() ")) for name, unit in zip(*rows)]
    return [split_unit(cell.lstrip("#%").strip()) for cell in rows[-1]]


def _unnamed_times(values: np.ndarray, name: str) -> tuple[float | None, float]:
    """Rate [Hz] and first time [s] of a column without a name that ascends evenly; None of any other."""
    steps = np.diff(values)
    even = np.all(steps > 0) and np.ptp(steps) < 0.5 * steps.mean() and not np.all(values == np.rint(values))
    return rate_of_times(values, "", name) if even else (None, 0.0)
