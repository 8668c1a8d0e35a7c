"""TOML text of a case: read with care, written back, and remembered with the lines of its keys."""

from __future__ import annotations

import json
import math
import os
import pickle
import re
import stat
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, time
from functools import lru_cache
from html import escape
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, PrivateAttr

from femgear.errors import MOST_SHOWN, CaseError, printable
from femgear.findings import Finding

_MAX_BYTES = 1_000_000
_MAX_DEPTH = 32
"""Levels of tables and lists."""
_MOST_TABLES, _MOST_ENTRIES = 1000, 120_000
"""Entries of a table or list of tables, and of all together: pydantic reads them before it counts them."""
_MOST_KEYS, _MOST_LONG_KEYS = 30_000, 100
"""Keys of a text, and those of seven parts or more."""
_LONGEST_KEY = 200
"""Characters of a key that messages show."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_HEADER = re.compile(r"\s*(\[\[?)([^\[\]#]+)\]")
_ENTRY = re.compile(r"\s*+([A-Za-z0-9_.\"' -]++)\s*+=")
_KEY = re.compile(r"=+|^[ \t]*\[", re.MULTILINE)
_QUOTED = json.JSONEncoder(ensure_ascii=False).encode
_TEXT = re.compile(r""""[^"]*"|'[^']*'|#.*""")
# tomllib needs a time that grows with the square of the parts of a dotted key.
_LONG = 7
_LONG_KEY = re.compile(
    r"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*|\"[^\"\n]*\"[ \t]*\.[ \t]*|'[^'\n]*'[ \t]*\.[ \t]*)" f"{{{_LONG}}}"
)


def read_text(path: str | os.PathLike) -> str:
    """Read the text of a small regular UTF-8 file, without its byte-order mark.

    CaseError: missing, unreadable, not a regular file, empty or over 1 MB (E-FILE); not UTF-8, with the
    offset of the first wrong byte (E-FILE-ENC).
    """
    return decoded(read_bytes(path, _MAX_BYTES, "name a TOML file"), os.fsdecode(path))


def read_bytes(path: str | os.PathLike, most: int, remedy: str) -> bytes:
    """Read a regular file of at most so many bytes; others are refused (E-FILE), with what to do."""
    name = os.fsdecode(path)
    try:
        # O_NONBLOCK: opening a FIFO must not wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CaseError(
            f"cannot open the file: {reason}",
            code="E-FILE",
            file=name,
            remedy="check its name and permissions",
        ) from error
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise CaseError("not a regular file", code="E-FILE", file=name, remedy=remedy)
        with open(descriptor, "rb", closefd=False) as stream:
            data = stream.read(most + 1)
    except OSError as error:
        raise CaseError(f"cannot read the file: {error.strerror}", code="E-FILE", file=name, remedy=remedy) from error
    finally:
        os.close(descriptor)
    if len(data) > most:
        raise CaseError("the file is too long", code="E-FILE", file=name, limit=f"{most} bytes")
    if not data.strip():
        remedy = "write into it what is needed, or name another file"
        raise CaseError("the file is empty", code="E-FILE", file=name, remedy=remedy)
    return data


def decoded(data: bytes, name: str) -> str:
    """Decode UTF-8, without its byte-order mark; other bytes are refused (E-FILE-ENC)."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(
            f"not UTF-8: byte 0x{data[error.start]:02x} at offset {error.start}",
            code="E-FILE-ENC",
            file=name,
            remedy="save the file as UTF-8",
        ) from error


def parse(text: str, name: str) -> dict:
    """Read the tables of a TOML text, of limited depth and with finite numbers only.

    ``name`` is that of the file, for messages. CaseError: syntax, with line and column, a key given twice,
    with both lines, or nested too deeply (E-TOML); E-FINITE, with keys and lines.
    """
    return pickle.loads(_pickled_tables(text, name))


@lru_cache(maxsize=4)
def _pickled_tables(text: str, name: str) -> bytes:
    """Tables of the latest texts: variants of a case all begin with its text, and change tables of their own."""
    return pickle.dumps(_tables(text, name))


def _tables(text: str, name: str) -> dict:
    """Read tables, see `parse`."""
    # such a key stands on one line, and most texts have no line with so many dots
    suspects = (line for line in text.split("\n") if line.count(".") >= _LONG)
    if sum(len(_LONG_KEY.findall(line)) for line in suspects) > _MOST_LONG_KEYS:
        raise _too_deep(name)
    if (count := len(_KEY.findall(text))) > _MOST_KEYS:
        limit = f"{_MOST_KEYS} keys and tables"
        raise CaseError(f"{count} keys are too many", code="E-RANGE", file=name, limit=limit)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(text, str(error), name) from error
    except ValueError as error:
        raise CaseError(
            "an integer has thousands of digits",
            code="E-TOML",
            file=name,
            limit="4300 digits",
            remedy="write it as a decimal number such as 1e9",
        ) from error
    except RecursionError:
        raise _too_deep(name) from None
    infinite = check_tree(data, name)
    if infinite:
        (key, value), *others = ((dotted(path), value) for path, value in infinite[:MOST_SHOWN])
        line = line_of(text, key)
        also = "".join(f", nor is {other} (line {line_of(text, other)})" for other, _ in others)
        also += f", nor are {len(infinite) - MOST_SHOWN} others" if len(infinite) > MOST_SHOWN else ""
        raise CaseError(
            f"not a finite number{also}",
            code="E-FINITE",
            key=key,
            value=value,
            file=f"{name}:{line}" if name and line else name,
            limit="finite numbers (no nan, no inf, nothing beyond 1.8e308)",
        )
    return data


def check_tree(data: dict, name: str) -> list[tuple[tuple[str | int, ...], float]]:
    """Find paths and values of the numbers that are not finite; refuse what is too deep or too long."""
    infinite, pending, count = [], [((), data)], 0
    while pending:
        path, value = pending.pop()
        if isinstance(value, float):
            infinite.append((path, value))
            continue
        if len(path) + bool(value) >= _MAX_DEPTH:
            raise _too_deep(name)
        count += len(value)
        tables = isinstance(value, dict) or any(isinstance(entry, dict) for entry in value)
        if count > _MOST_ENTRIES or (tables and len(value) > _MOST_TABLES):
            raise CaseError(
                f"{len(value)} entries are too many",
                code="E-RANGE",
                key=dotted(path),
                file=name,
                limit=f"at most {_MOST_TABLES} of a table or list of tables, {_MOST_ENTRIES} of all together",
            )
        items = list(value.items() if isinstance(value, dict) else enumerate(value))
        pending += [
            ((*path, k), v)
            for k, v in reversed(items)
            if isinstance(v, (dict, list)) or (isinstance(v, float) and not math.isfinite(v))
        ]
    return infinite


def dotted(location: tuple, prefix: str = "") -> str:
    """Make a key such as ``sun.modifications[0].amount``."""
    key = prefix
    for part in location:
        if isinstance(part, int):
            key += f"[{part}]"
        else:
            key += ("." if key else "") + (printable(part[:_LONGEST_KEY]) or '""')
    return key


def _too_deep(name: str) -> CaseError:
    return CaseError("tables or lists are nested too deeply", code="E-TOML", file=name, limit=f"{_MAX_DEPTH} levels")


def _syntax_error(text: str, message: str, name: str) -> CaseError:
    """Refusal of a text that is no TOML: of a key given twice with both lines."""
    position = re.search(r"\(at line (\d+), column \d+\)", message)
    lines_of_text = text.split("\n")
    line = int(position[1]) if position else len(lines_of_text)
    if "Cannot overwrite a value" in message or "Cannot declare" in message:
        key, lines = _duplicate(text, line)
        if len(lines) > 1:
            places = " and ".join(str(number) for number in lines[:MOST_SHOWN])
            return CaseError(
                f"given twice, in lines {places}",
                code="E-TOML",
                key=key,
                file=name,
                remedy="keep one of them"
                if "Cannot overwrite" in message
                else f"keep one of them; tables of a list have double brackets, [[{key}]]",
            )
    remedy = 'lines are [section] or key = value; texts and quantities stand in quotation marks, as in "2 mm"'
    bare = _TEXT.sub("", lines_of_text[min(line, len(lines_of_text)) - 1])
    if re.search(r"=\s*[+-]?\d+,\d", bare):
        remedy = "use a decimal point"
    elif re.search("[‘-‟«»′″]", bare):
        remedy = 'use straight quotation marks, as in "2 mm"'
    elif r"Illegal character '\n'" in message:
        remedy = "close the quotation mark"
    elif "octal" in message or re.search(r"=\s*0\d", bare):
        remedy = "a number has no leading zeros"
    elif "(at end of document)" in message:
        started = max((number for _, number in keys_with_lines(text)), default=1)
        remedy = f"close the brackets and quotation marks of the entry in line {started}, or complete it"
    return CaseError(f"not TOML: {message}", code="E-TOML", file=name, remedy=remedy)


def _duplicate(text: str, line: int) -> tuple[str | None, list[int]]:
    """Key that is given a second time at or before ``line``, and the lines that give it."""
    seen: dict[str, list[int]] = {}
    for key, number in keys_with_lines(text):
        if number <= line:
            seen.setdefault(key, []).append(number)
    repeated = [(numbers[-1], key) for key, numbers in seen.items() if len(numbers) > 1]
    if not repeated:
        return None, []
    key = max(repeated)[1]
    return key, seen[key]


def line_of(text: str, key: str) -> int | None:
    """Find the line (from 1) that gives the dotted ``key``; None where no line starts with it.

    Of an entry of a list it is the line of the entry, of its table, or of the list.
    """
    lines = _lines(text)
    table = key.rpartition("]")
    wanted = (key, re.sub(r"(\[\d+\])+$", "", key), table[0] + table[1], key.split("[")[0], f"{key}[0]")
    line = next((lines[name] for name in wanted if name in lines), None)
    if line is None and "." in key:  # an entry of a table in braces stands in the line of the table
        above = line_of(text, key.rpartition(".")[0])
        line = above if above and "=" in text.splitlines()[above - 1] else None
    return line


@lru_cache(maxsize=2)
def _lines(text: str) -> dict[str, int]:
    """First line of every key."""
    return {key: number for key, number in reversed(list(keys_with_lines(text)))}


def keys_with_lines(text: str) -> Iterator[tuple[str, int]]:
    """Give dotted key and line number of every table header and every key that starts a line.

    Tables of a list are numbered, and with them the tables inside: ``sun.modifications[0].amount``,
    ``stage[1].gears.module``.
    """
    table, quoted, counts = "", None, {}
    for number, line in enumerate(text.splitlines(), start=1):
        if not ("=" in line or "[" in line or '"""' in line or "'''" in line):
            continue  # a text may have a million lines
        starts_quoted = quoted
        for mark in re.findall(r'"""|\'\'\'', line):
            quoted = mark if quoted is None else (None if mark == quoted else quoted)
        if starts_quoted:
            continue
        header = _HEADER.match(line)
        entry = _ENTRY.match(line)
        if header:
            table = _clean(header[2])
            *above, last = table[:_LONGEST_KEY].split(".", _MAX_DEPTH)
            table = ""
            for part in above:
                table += part
                table += f"[{counts[table]}]." if table in counts else "."
            table += last
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = f"{table}[{counts[table]}]"
            yield table, number
        elif entry:
            yield ".".join(part for part in (table, _clean(entry[1])[:_LONGEST_KEY]) if part), number


def _clean(key: str) -> str:
    """Dotted key without blanks and quotation marks."""
    return ".".join(part.strip().strip("\"'") for part in key.split("."))


def write(data: dict, remarks: Mapping[str, str] | None = None) -> str:
    """Write nested tables of strings, booleans, integers, floats, lists and arrays of these as TOML text.

    ``parse(write(data), "")`` equals ``data``. `remarks` by dotted key stand behind their entries; with them
    lists of tables stand under headers of their own.
    """
    lines: list[str] = []
    try:
        _write_table(data, "", lines, remarks)
    except RecursionError:
        raise _too_deep("") from None
    return "\n".join(lines).lstrip("\n") + "\n"


def text_with_points(data: dict, name: str) -> str:
    """Write tables of a file that the points of other files were put into as TOML text; see `write`.

    CaseError: it is too long for a case file (E-FILE).
    """
    text = write(data)
    if len(text.encode()) > _MAX_BYTES:
        raise CaseError(
            "the case is too long with the points of the files that it names",
            code="E-FILE",
            value=f"{len(text.encode())} bytes",
            limit=f"{_MAX_BYTES} bytes",
            remedy="give them at fewer points",
            file=name or None,
        )
    return text


def _write_table(table: dict, header: str, lines: list[str], remarks: Mapping[str, str] | None, path: str = "") -> None:
    listed = {} if remarks is None else {k: v for k, v in table.items() if v and _is_tables(v)}
    values = {k: v for k, v in table.items() if not isinstance(v, dict) and k not in listed}
    if header and (values or not table or header.startswith("[[")):
        lines += ["", header]
    for key, value in values.items():
        remark = (remarks or {}).get(f"{path}{key}")
        try:
            written = _value(value)
        except CaseError as error:
            error.key = printable(f"{path}{key}")
            raise
        lines.append(f"{_key(key)} = {written}" + (f"  # {printable(remark)}" if remark else ""))
    for key, value in table.items():
        name = f"{header.strip('[]')}.{_key(key)}".lstrip(".")
        for i, subtable in enumerate(listed.get(key, ())):
            _write_table(subtable, f"[[{name}]]", lines, remarks, f"{path}{key}[{i}].")
        if isinstance(value, dict):
            _write_table(value, f"[{name}]", lines, remarks, f"{path}{key}.")


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(entry, dict) for entry in value)


def _key(key: str) -> str:
    if not isinstance(key, str):
        raise CaseError(f"a key is a text, not {described(key)}", code="E-TYPE", value=key, limit="texts")
    return key if _BARE.fullmatch(key) else _value(key)


def _value(value: object) -> str:
    if isinstance(value, int) and abs(value).bit_length() > 4096:
        raise CaseError("the integer is too long", code="E-RANGE", value=shown(value), limit="4096 bits")
    if isinstance(value, float):
        return float.__repr__(value)  # NumPy's numbers are floats as well
    if isinstance(value, str | int):
        # as in JSON, but that TOML escapes DEL as well
        return _QUOTED(value).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, np.ndarray | np.generic) and not isinstance(plain := value.tolist(), np.generic):
        return _value(plain)
    raise CaseError(
        f"no TOML form for a {type(value).__name__}",
        code="E-TYPE",
        value=value,
        limit="texts, numbers, true or false, lists and tables",
    )


class ReadCase(BaseModel):
    """Values of a case file that know where they were read, and in ``train`` what they are."""

    train: ClassVar[str]
    _source: str = PrivateAttr(default="")
    _lines: str = PrivateAttr(default="")
    _name: str = PrivateAttr(default="")
    _notices: tuple[Finding, ...] = PrivateAttr(default=())
    _profile_files: dict[str, str] = PrivateAttr(default_factory=dict)

    def read_from(self, text: str, lines: str, name: str, *, notices=(), profile_files=None) -> None:
        """Remember the text that gives this case, that of the user (or none), and the name of the file."""
        self._source, self._lines, self._name = text, lines, name
        self._notices, self._profile_files = tuple(notices), dict(profile_files or {})

    def __eq__(self, other: object) -> bool:
        """Whether the values agree, from whatever text they came."""
        return isinstance(other, type(self)) and self.model_dump() == other.model_dump()

    def __repr__(self) -> str:
        """Kind, title and file: the entries are in `source`."""
        where = f" of {self._name}" if self._name else ""
        return printable(f"<{type(self).__name__} {getattr(self, 'title', '')!r}{where}>")

    def _repr_html_(self) -> str:
        """The text of the case, for notebooks."""
        return f"<details><summary>{escape(repr(self))}</summary><pre>{escape(self._source)}</pre></details>"

    @property
    def source(self) -> str:
        """TOML text that gives this case."""
        return self._source

    @property
    def name(self) -> str:
        """Name of the file, for messages."""
        return self._name

    def location(self, key: str) -> str | None:
        """Find file, and line where the file gives it, of a dotted key; of ``rack.x`` for ``sun.rack.x``."""
        numbers = (line_of(self._lines, name) for name in (key, key.partition(".")[2]) if name)
        line = next((number for number in numbers if number), None)
        return f"{self._name}:{line}" if self._name and line else self._name or None

    @property
    def profile_files(self) -> dict[str, str]:
        """Files of measured profiles or torque series, by the key of their entry."""
        return self._profile_files

    @property
    def notices(self) -> tuple[Finding, ...]:
        """Remarks on how the file was read."""
        return self._notices


@dataclass(frozen=True)
class CaseFile:
    """How the cases of a train are read; it stands beside their model, away from what solves them.

    Parameters
    ----------
    model : type
        Of the cases, whose ``train`` is the name of the train.
    cross_check : callable
        ``(case) -> problems``: what no entry shows alone.
    notices : callable
        ``(tables, case) -> findings``: what was read in a way that deserves to be said.
    claims : callable
        ``(tables) -> str``: what only files of this kind have, such as "bodies"; empty where they have not.
    embed : callable
        ``(tables, name of the file) -> files by key``: puts the points of other files into the tables.
    beside_refused : callable
        ``(case, tables) -> problems``: what can be judged of a case without its refused entries, and without what is
        missing with them in the tables of these keys.
    """

    model: type
    cross_check: Callable[[Any], Iterable[CaseError]] = lambda case: ()
    notices: Callable[[dict, Any], Iterable[Finding]] = lambda tables, case: ()
    claims: Callable[[dict], str] = lambda tables: ""
    embed: Callable[[dict, str], dict[str, str]] = lambda tables, name: {}
    beside_refused: Callable[[Any, Sequence[str]], Iterable[CaseError]] = lambda case, tables: ()


def shown(number: int) -> str:
    """Write an integer of any size (``str`` refuses those of thousands of digits)."""
    if abs(number) < 10**15:
        return str(number)
    return f"{'-' if number < 0 else ''}about 2^{abs(number).bit_length()}"


def found(number: int) -> int | str:
    """Show an integer in a message: itself, or the size of one of thousands of digits."""
    return number if abs(number) < 10**15 else shown(number)


def described(value: object) -> str:
    """Tell in words what a TOML value, or another one in its place, is."""
    names = {bool: "true or false", int: "an integer", float: "a number", str: "a text", list: "a list"}
    if isinstance(value, date | time):
        return "a date or time"
    return names.get(type(value)) or ("a table" if isinstance(value, dict) else f"a {type(value).__name__}")
