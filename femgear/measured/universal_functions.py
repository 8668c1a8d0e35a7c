"""Functions of universal files: dataset 58, as text and binary (58b), of all eight types.

The format is that of the Structural Dynamics Research Corporation, Universal Dataset Number 58, as the University of
Cincinnati keeps it (https://www.ceas3.uc.edu/sdrluff). Records have fixed columns, numbers may touch one another.
Programs differ in what they say of the length of binary data and in the precision of an uneven abscissa: that length
is taken at whose end the dataset ends.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from femgear.case.text import read_bytes
from femgear.errors import printable
from femgear.measured.channels import MOST_BYTES, Channel, agreed_rate, file_problem, rate_of_times

_DELIMITER = re.compile(rb"(?m)^ {4}-1[ ]*\r?$")
_BINARY_END = re.compile(rb"\r?\n? {4}-1[ ]*(\r?\n|$)")
_HEADER_LINES = 11
_LONGEST_LINE = 400
_SINGLE, _DOUBLE = {2: False, 5: True}, {4: False, 6: True}
"""Ordinate data types, and whether they are complex."""
_IEEE = 2
_KINDS = {0: "general", 1: "time response", 2: "auto spectrum", 3: "cross spectrum", 4: "frequency response"}
_KINDS |= {6: "coherence", 9: "power spectral density", 12: "spectrum", 27: "order function"}
_UNITS = {8: "m", 11: "m/s", 12: "m/s^2", 13: "N", 15: "Pa", 17: "s", 18: "Hz"}
"""Unit of a specific data type where the file names none and is in SI units."""
TIME, FREQUENCY, ORDER = 17, 18, 20
"""Specific data types of an abscissa."""
_TIME_RESPONSE = 1
_REMEDY = "export it again as dataset 58 (text) or 58b (IEEE), and copy binary files unchanged"


@dataclass(frozen=True)
class UniversalFunction:
    """One function of a universal file.

    Parameters
    ----------
    number : int
        Of the dataset in its file, from 1.
    name, run : str
        ID lines 1 and 2.
    response : str
        Node and direction of the response, as "12:+3".
    kind, abscissa_kind : int
        Function type, and specific data type of the abscissa.
    abscissa : (n,) array
        In its unit.
    step : float
        Of an even abscissa, 0 of any other.
    values : (n,) array
        Real or complex, in the unit of the ordinate.
    abscissa_unit, unit : str
        As the file names them; empty where it does not.
    """

    number: int
    name: str
    run: str
    response: str
    kind: int
    abscissa_kind: int
    abscissa: np.ndarray
    step: float
    values: np.ndarray
    abscissa_unit: str
    unit: str

    @property
    def kind_name(self) -> str:
        """Name of the function type."""
        return _KINDS.get(self.kind, f"function type {self.kind}")


def read_universal_functions(path: str | os.PathLike) -> tuple[UniversalFunction, ...]:
    """Read all functions of a universal file; other datasets are skipped.

    CaseError: E-FILE: no universal file, one without dataset 58, one that is broken off, floats that are not IEEE.
    """
    name = printable(Path(path).name)
    data = read_bytes(path, MOST_BYTES, "name a universal file (.uff, .unv)")
    functions, si = list[UniversalFunction](), False
    for number, dataset in enumerate(_datasets(data, name), 1):
        if dataset.kind == "164":
            si = dataset.block.split()[:1] == [b"1"]
        elif dataset.kind in ("58", "58b"):
            functions.append(_function(dataset, f"{name}, dataset {number}", number, si=si))
    if not functions:
        raise file_problem(name, "no dataset 58", limit="functions: signals or spectra", remedy=_REMEDY)
    return tuple(functions)


def read_universal_signals(path: str | os.PathLike, *, rate: float | None = None) -> tuple[Channel, ...]:
    """Read the time responses of a universal file as channels; names that come twice have node and direction.

    CaseError: E-FILE: what `read_universal_functions` refuses, no time response, an uneven abscissa.
    """
    functions = [function for function in read_universal_functions(path) if function.abscissa_kind != FREQUENCY]
    functions = [function for function in functions if function.kind in (_TIME_RESPONSE, 0)]
    file = printable(Path(path).name)
    if not functions or any(np.iscomplexobj(function.values) for function in functions):
        message, remedy = "no time signals", "export the time histories (dataset 58, function type 1)"
        raise file_problem(file, message, remedy=remedy)
    names = [function.name or function.response for function in functions]
    channels = []
    for function, name in zip(functions, names, strict=True):
        name = f"{name} {function.response}" if names.count(name) > 1 else name
        in_file, start = 1.0 / function.step if function.step else None, float(function.abscissa[0])
        if in_file is None:
            in_file, start = rate_of_times(function.abscissa, function.abscissa_unit, f"{file}, channel {name}", rate)
        stated = re.search(r"samples a second \[Hz\]: ([0-9.]+)", function.run)  # a file of femgear, in full
        in_file = float(stated[1]) if stated else in_file
        # six digits of the step in the file
        channels.append(Channel(file, name, function.unit, agreed_rate(in_file, rate, file), function.values, start))
    return tuple(channels)


@dataclass(frozen=True)
class _Dataset:
    """One dataset: its ``kind``, the ``head`` line that names it, and the ``block`` of its records."""

    kind: str
    head: str
    block: bytes


def _datasets(data: bytes, name: str) -> Iterator[_Dataset]:
    """Datasets of a file in their order; binary data are passed by their length."""
    opening = _DELIMITER.search(data)
    if opening is None:
        raise file_problem(name, "no universal file: no dataset begins by -1", remedy=_REMEDY)
    while opening is not None:
        first = opening.end() + 1
        line = data[first : first + _LONGEST_LINE].split(b"\n")[0]
        head, start = line.decode("ascii", "replace"), first + len(line) + 1
        kind = head.strip().split(" ")[0].lower()
        if not re.fullmatch(r"\d+b?", kind):
            raise file_problem(name, "a dataset without a number", value=head[:40], remedy=_REMEDY)
        end = _binary_end(data, start, name) if kind == "58b" else start
        closing = _BINARY_END.match(data, end) if kind == "58b" else _DELIMITER.search(data, start)
        if closing is None:
            message, value = f"dataset {kind} is broken off: it does not end by -1", f"{len(data)} bytes"
            raise file_problem(name, message, value=value, remedy=_REMEDY)
        yield _Dataset(kind, head, data[start : end if kind == "58b" else closing.start()])
        opening = _DELIMITER.search(data, closing.end() - 1)


def _header(data: bytes, start: int, name: str) -> tuple[list[str], int]:
    """The eleven records before the values, and where the values begin."""
    lines, place = list[str](), start
    for _ in range(_HEADER_LINES):
        end = data.find(b"\n", place, place + _LONGEST_LINE)
        if end < 0:
            message, limit = "records of a function are missing or too long", f"{_HEADER_LINES} lines of 80 characters"
            raise file_problem(name, message, limit=limit, remedy=_REMEDY)
        lines.append(data[place:end].decode("utf-8", "replace").rstrip("\r"))
        place = end + 1
    return lines, place


def _integers(line: str, widths: tuple[int, ...]) -> list[int]:
    """Whole numbers in fixed columns; empty ones are 0."""
    numbers, place = list[int](), 0
    for width in widths:
        cell = line[place : place + width].strip()
        numbers.append(int(cell) if cell else 0)
        place += width
    return numbers


def _form_of(lines: list[str], name: str) -> tuple[int, int, bool, float, float]:
    """Ordinate type, number of values, whether the abscissa is even, its first value and its step."""
    try:
        kind, count, even = _integers(lines[6], (10, 10, 10))
        first, step = (float(lines[6][at : at + 13].replace("D", "E") or 0.0) for at in (30, 43))
    except ValueError as error:
        message = "record 7 of a function is none"
        raise file_problem(name, message, value=lines[6][:60], remedy=_REMEDY) from error
    if kind not in _SINGLE | _DOUBLE or count < 1 or not (np.isfinite(first) and np.isfinite(step)):
        limit, value = "ordinate type 2, 4, 5 or 6, one value or more", lines[6][:60]
        raise file_problem(name, "a function of no known type", value=value, limit=limit, remedy=_REMEDY)
    if even == 1 and step == 0.0:
        raise file_problem(name, "an even abscissa without a step", value=lines[6][:60], remedy=_REMEDY)
    return kind, count, even == 1, first, step


def _layouts(kind: int, even: bool) -> list[list[str]]:
    """Kinds of the binary numbers of one value: abscissa where it is uneven, real part, imaginary part."""
    number = "f4" if kind in _SINGLE else "f8"
    ordinate = [number] * (2 if (_SINGLE | _DOUBLE)[kind] else 1)
    return [ordinate] if even else [[number, *ordinate]] + [["f4", *ordinate]] * (number == "f8")


def _binary_end(data: bytes, start: int, name: str) -> int:
    """Where the binary values of a dataset end: at the length of its type after which the dataset ends."""
    lines, place = _header(data, start, name)
    kind, count, even, *_ = _form_of(lines, name)
    sizes = [count * sum(int(part[1]) for part in layout) for layout in _layouts(kind, even)]
    for size in sizes:
        if _BINARY_END.match(data, place + size):
            return place + size
    left = len(data) - place
    message = "binary data are broken off" if left < min(sizes) else "binary data of another length than is said"
    value, limit = f"{left} bytes to the end of the file", " or ".join(f"{size} bytes" for size in sizes)
    raise file_problem(name, message, value=value, limit=limit, remedy=_REMEDY)


def _function(dataset: _Dataset, file: str, number: int, *, si: bool) -> UniversalFunction:
    """One function from its records."""
    lines, place = _header(dataset.block, 0, file)
    ordinate, count, even, first, step = _form_of(lines, file)
    data, is_complex = dataset.block[place:], (_SINGLE | _DOUBLE)[ordinate]
    if dataset.kind == "58b":
        values = _binary_values(data, dataset.head, ordinate, count, file, even=even)
    else:
        values = _text_values(data, ordinate, count, file, even=even)
    try:
        kind = _integers(lines[5], (5,))[0]
        node, direction = _integers(lines[5][41:], (10, 4))
        kinds = [int(line[:10].strip() or 0) for line in lines[7:9]]
    except ValueError as error:
        message = "records 6 to 9 of a function are none"
        raise file_problem(file, message, value=lines[5][:80], remedy=_REMEDY) from error
    labels = [line[47:67].strip().replace("NONE", "") for line in lines[7:9]]
    units = [label or (_UNITS.get(spec, "") if si else "") for label, spec in zip(labels, kinds)]
    names = ["" if line.strip() == "NONE" else line.strip() for line in lines[:2]]
    return UniversalFunction(
        number=number,
        name=names[0],
        run=names[1],
        response=f"{node}:{direction:+d}",
        kind=kind,
        abscissa_kind=kinds[0],
        abscissa=first + step * np.arange(count) if even else values[:, 0],
        step=step if even else 0.0,
        values=values[:, -2] + 1j * values[:, -1] if is_complex else values[:, -1],
        abscissa_unit=units[0],
        unit=units[1],
    )


def _binary_values(data: bytes, head: str, ordinate: int, count: int, file: str, *, even: bool) -> np.ndarray:
    """Values (n, columns) of a binary function."""
    try:
        order, floats = _integers(head[7:], (6, 6))
    except ValueError:
        order, floats = 0, 0
    if order not in (1, 2) or floats != _IEEE:
        value, limit = head[:40], "byte order 1 or 2, floating point format 2 (IEEE 754)"
        raise file_problem(file, "binary numbers of another kind", value=value, limit=limit, remedy=_REMEDY)
    for layout in _layouts(ordinate, even):
        if count * sum(int(part[1]) for part in layout) == len(data):
            kinds = [(str(k), ("<" if order == 1 else ">") + part) for k, part in enumerate(layout)]
            table = np.frombuffer(data, np.dtype(kinds))
            return np.stack([table[str(k)].astype(float) for k in range(len(layout))], axis=1)
    raise file_problem(file, "binary data of another length than is said", value=f"{len(data)} bytes", remedy=_REMEDY)


def _text_values(data: bytes, ordinate: int, count: int, file: str, *, even: bool) -> np.ndarray:
    """Values (n, columns) of a function as text, in fixed columns where they touch one another."""
    columns = len(_layouts(ordinate, even)[0])
    text = data.decode("ascii", "replace").replace("D", "E").replace("d", "e")
    words = text.split()
    if len(words) != count * columns:
        words = [cell for line in text.splitlines() for cell in _fixed_cells(line, ordinate, columns, even=even)]
    if len(words) != count * columns:
        message, value = "values of a function are missing", f"{len(words)} numbers"
        limit = f"{count * columns} numbers, as its record 7 says"
        raise file_problem(file, message, value=value, limit=limit, remedy=_REMEDY)
    try:
        return np.array(words, float).reshape(count, columns)
    except ValueError as error:
        raise file_problem(file, f"values that are no numbers: {str(error)[:60]}", remedy=_REMEDY) from error


def _fixed_cells(line: str, ordinate: int, columns: int, *, even: bool) -> Iterator[str]:
    """Numbers of a line of values: 6E13.5, 4E20.12, or of double precision and uneven E13.5 before E20.12."""
    line, place, column = line.rstrip(), 0, 0
    while place < len(line):
        single = ordinate in _SINGLE or (not even and column % columns == 0)
        width = 13 if single else 20
        yield line[place : place + width]
        place, column = place + width, column + 1
