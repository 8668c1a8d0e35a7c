"""A case file as text that is changed entry by entry; comments, order and spelling of the rest stay."""

from __future__ import annotations

import copy
import re
import tomllib
from dataclasses import dataclass
from typing import Any

import tomlkit
from tomlkit import inline_table
from tomlkit.exceptions import TOMLKitError

from femgear.case.text import keys_with_lines
from femgear.errors import CaseError

_PART = re.compile(r"\[\d{1,6}\]|[^.\[\]]+")
_HEADER = re.compile(r"\s*\[")
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def tables_of_text(text: str) -> dict[str, Any]:
    """Read the tables of a case file.

    Raises
    ------
    CaseError
        E-TOML: the text is no TOML.
    """
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise CaseError(f"the text is no TOML: {error}", code="E-TOML") from error


def entry_of(tables: Any, key: str) -> Any:
    """Give the value of an entry by its key, as in ``"sun.modifications[0].amount"``; None where there is none."""
    for part in _PART.findall(key):
        if part.startswith("["):
            number = int(part[1:-1])
            tables = tables[number] if isinstance(tables, list) and number < len(tables) else None
        else:
            tables = tables.get(part) if isinstance(tables, dict) else None
    return tables


def with_entry(text: str, key: str, value: Any) -> str:
    """Change one entry of a case file, or take it out where the value is None.

    Parameters
    ----------
    text : str
        TOML.
    key : str
        As in ``"operation.torque"`` and ``"sun.modifications[0].amount"``; tables that are missing are made, and of a
        list of tables the one that follows the last. A table or one of a list is taken out as a whole.
    value : str, int, float, bool, list, dict or None
        As the file holds it.

    Raises
    ------
    CaseError
        E-TOML: the text is no TOML. E-TYPE: the key leads through something that is no table.
    """
    tables = tables_of_text(text)
    if entry_of(tables, key) == value and type(entry_of(tables, key)) is type(value):
        return text
    wanted = _changed_tables(tables, key, value)
    try:
        changed = _Lines(text).changed(key, value)
        if tomllib.loads(changed) == wanted:
            return changed
    except (TOMLKitError, tomllib.TOMLDecodeError, LookupError, TypeError, AttributeError, ValueError):
        pass
    # what the lines do not show is written anew: tables within braces, dotted keys
    return tomlkit.dumps(_filled(tomlkit.parse(text), key, value))


def _changed_tables(tables: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Tables with a changed entry, which the changed text has to give."""
    return _filled(copy.deepcopy(tables), key, value)


def _filled(tables: Any, key: str, value: Any) -> Any:
    """Change an entry of tables, of whatever library."""
    parts = _PART.findall(key)
    *above, last = parts
    inside: Any = tables
    try:
        for number, (part, following) in enumerate(zip(above, parts[1:], strict=True)):
            name = int(part[1:-1]) if part.startswith("[") else part
            if isinstance(inside, list) and name == len(inside):
                inside.append({})
            elif isinstance(inside, dict) and name not in inside:
                if value is None:
                    return tables
                inside[name] = [] if following.startswith("[") else {}
            inside = inside[name]
            if not isinstance(inside, (dict, list)) or isinstance(inside, list) != parts[number + 1].startswith("["):
                raise TypeError
        _put(inside, int(last[1:-1]) if last.startswith("[") else last, value)
    except (TOMLKitError, LookupError, TypeError, AttributeError, ValueError) as error:
        raise CaseError("there is no place for such an entry", code="E-TYPE", key=key) from error
    if value is None and last.startswith("[") and not inside:
        return _filled(tables, key.removesuffix(last), None)
    return tables


def _put(table: Any, name: Any, value: Any) -> None:
    """Change, add or take out an entry of a table or a list."""
    if isinstance(name, str) != isinstance(table, dict):
        raise TypeError
    if value is None:
        if isinstance(name, int) or name in table:
            del table[name]
    elif isinstance(name, int) and name == len(table):
        table.append(value)
    else:
        table[name] = value


@dataclass(frozen=True)
class _Block:
    """A table of the file.

    Parameters
    ----------
    key : str
    start, end : int
        Lines from its header to before what belongs to the next one.
    """

    key: str
    start: int
    end: int


class _Lines:
    """The lines of a case file, and where its entries and tables stand."""

    def __init__(self, text: str) -> None:
        self._lines = text.splitlines()
        keys_at = [(key, number - 1) for key, number in keys_with_lines(text)]
        headers = [(key, at) for key, at in keys_at if _HEADER.match(self._lines[at])]
        starts = [*(at for _, at in headers), len(self._lines)]
        self._blocks = [_Block("", 0, self._end(0, starts[0]))] if not headers or starts[0] else []
        self._blocks += [_Block(key, at, self._end(at + 1, starts[i + 1])) for i, (key, at) in enumerate(headers)]
        self._entries = {key: at for key, at in reversed(keys_at) if not _HEADER.match(self._lines[at])}

    def changed(self, key: str, value: Any) -> str:
        """Text with one entry changed, added or taken out."""
        if (holder := self._holder(key)) is not None:
            self._change_line(holder, key, value)
        elif value is None:
            self._take_out(key)
        else:
            self._add(key, value)
        return "\n".join(self._lines) + "\n"

    def _end(self, start: int, following: int) -> int:
        """Line after the last one of a table; comments right before the next header belong to that."""
        end = following
        while end > start and (
            not (line := self._lines[end - 1].strip()) or (line.startswith("#") and following < len(self._lines))
        ):
            end -= 1
        return end

    def _holder(self, key: str) -> str | None:
        """Entry with a line of its own that holds an entry: itself, or a list or a table in braces around it."""
        around = [name for name in self._entries if key == name or key.startswith((f"{name}.", f"{name}["))]
        return max(around, key=len, default=None)

    def _extent(self, name: str) -> tuple[int, int]:
        """Lines of an entry, of which some have several."""
        start = self._entries[name]
        for end in range(start + 1, len(self._lines) + 1):
            try:
                tomllib.loads("\n".join(self._lines[start:end]))
            except tomllib.TOMLDecodeError:
                continue
            return start, end
        raise ValueError(name)

    def _change_line(self, name: str, key: str, value: Any) -> None:
        """Change an entry within its lines, which keep their comment."""
        start, end = self._extent(name)
        if value is None and name == key:
            del self._lines[start:end]
            return
        block = max((b for b in self._blocks if b.start <= start), key=lambda b: b.start)
        inside = key.removeprefix(block.key).lstrip(".")
        fragment = tomlkit.dumps(_filled(tomlkit.parse("\n".join(self._lines[start:end])), inside, value))
        self._lines[start:end] = fragment.splitlines()

    def _take_out(self, key: str) -> None:
        """Take out a table, with the tables in it."""
        for block in reversed(self._within(key)):
            end = block.end
            while end < len(self._lines) and not self._lines[end].strip():
                end += 1
            del self._lines[block.start : end]

    def _within(self, key: str) -> list[_Block]:
        """Tables of a key and in it."""
        return [b for b in self._blocks if b.key and (b.key == key or b.key.startswith((f"{key}.", f"{key}[")))]

    def _add(self, key: str, value: Any) -> None:
        """Add an entry at the end of its table, which is made where there is none."""
        *above, last = _PART.findall(key)
        table = "".join(f".{part}" if not part.startswith("[") else part for part in above).lstrip(".")
        line = f"{last if _BARE.fullmatch(last) else tomlkit.item(last).as_string()} = {_written(value)}"
        block = next((block for block in self._blocks if block.key == table), None)
        if block is not None:
            self._lines.insert(block.end, line)
            return
        listed = table.endswith("]")
        parent = table.rpartition("[")[0] if listed else table
        header = f"[[{_plain(parent)}]]" if listed else f"[{_plain(table)}]"
        place = self._place_of_table(parent)
        self._lines[place:place] = ["", header, line] if place else [header, line, ""]

    def _place_of_table(self, key: str) -> int:
        """Line at which a new table stands: after those of its list, after the table above it, or at the end."""
        while key:
            if within := self._within(key):
                return max(block.end for block in within)
            key = key.rpartition(".")[0]
        return max((block.end for block in self._blocks), default=0)


def _plain(key: str) -> str:
    """Key of a table as its header has it, without the numbers of lists."""
    return re.sub(r"\[\d+\]", "", key)


def _written(value: Any) -> str:
    """Write a value on one line."""
    if isinstance(value, dict):
        table = inline_table()
        table.update(value)
        return table.as_string()
    return tomlkit.item(value).as_string()
