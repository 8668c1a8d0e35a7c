"""A journal on disk: records by key, one JSON line each, appended and forced out.

A search that was interrupted goes on from what its journal holds. The first line, the header, says what the
records belong to.
"""

from __future__ import annotations

import json
import os
from collections.abc import ItemsView, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from femgear.errors import StorageError
from femgear.storage.files import exclusive_lock, storage_errors

FORMAT = 1
"""Of journals."""
# what a journal with another entry of the header was written for
_WRITTEN = {
    "format": "by another version of femgear",
    "femgear": "by another version of femgear",
    "case": "for another case",
    "keys": "for other design variables",
}


class Journal:
    """Records by key, in memory and, where `open_journal` made it, on disk."""

    def __init__(self, path: Path | None = None, stream: BinaryIO | None = None):
        self._records: dict[str, dict] = {}
        self._path, self._stream = path, stream

    def get(self, key: str) -> dict | None:
        """Record of a key, or None."""
        return self._records.get(key)

    def items(self) -> ItemsView[str, dict]:
        """Keys and records in the order in which they were first written."""
        return self._records.items()

    def add(self, key: str, record: Mapping[str, object]) -> None:
        """Keep a record; one of the same key is replaced."""
        self._records[key] = dict(record)
        self._write({"key": key, "record": self._records[key]})

    def _write(self, line: dict) -> None:
        """Append a line and force it out."""
        if self._path is None or self._stream is None:
            return
        with storage_errors(self._path):
            # a number that is not finite is no JSON, and no result either
            self._stream.write(json.dumps(line, allow_nan=False).encode() + b"\n")
            self._stream.flush()
            os.fsync(self._stream.fileno())

    def _read(self, path: Path, stream: BinaryIO, header: dict) -> None:
        """Take what the file holds; a line that a killed process left half written is cut off."""
        with storage_errors(path):
            stream.seek(0)
            text = stream.read()
        whole = text.rfind(b"\n") + 1
        lines = [_line(line, path, number) for number, line in enumerate(text[:whole].splitlines(), 1)]
        # a file without a whole line is either the beginning of this header or none of ours
        if not lines and not json.dumps(header).encode().startswith(text):
            raise _broken(path, 1)
        for name, expected in header.items():
            if lines and lines[0].get(name) != expected:
                raise StorageError(
                    f"the journal was written {_WRITTEN[name]}",
                    code="E-JOURNAL",
                    file=str(path),
                    value=lines[0].get(name),
                    limit=str(expected),
                    remedy="name a new file, or remove this one",
                )
        for number, line in enumerate(lines[1:], 2):
            if not (isinstance(line.get("key"), str) and isinstance(line.get("record"), dict)):
                raise _broken(path, number)
            self._records[line["key"]] = line["record"]
        if whole < len(text):
            with storage_errors(path):
                stream.truncate(whole)
        if not lines:
            self._write(header)


@contextmanager
def open_journal(
    path: str | os.PathLike | None, *, version: str, case: str, keys: tuple[str, ...]
) -> Iterator[Journal]:
    """Open the journal of a case and its design variables; meanwhile no other process writes into it.

    Parameters
    ----------
    path : path-like, optional
        Created where it does not exist; None keeps records in memory only.
    version : str
        Of femgear.
    case : str
        Fingerprint of the case.
    keys : tuple of str
        Names of the design variables, in the order of the points.

    Raises
    ------
    StorageError
        E-JOURNAL: written for another case, other variables or by another version, or not a journal;
        E-LOCKED: in use.
    """
    if path is None:
        yield Journal()
        return
    path = Path(path)
    header = {"format": FORMAT, "femgear": version, "case": case, "keys": list(keys)}
    with storage_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    with exclusive_lock(path.with_name(f".{path.name}.lock")):
        with storage_errors(path):
            stream = open(path, "a+b")
        with stream:
            journal = Journal(path, stream)
            journal._read(path, stream, header)
            yield journal


def _line(text: bytes, path: Path, number: int) -> dict:
    """Read one line, a table in JSON."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise _broken(path, number) from None
    if not isinstance(found, dict):
        raise _broken(path, number)
    return found


def _broken(path: Path, number: int) -> StorageError:
    """Make the refusal of a line."""
    return StorageError(
        f"line {number} is no entry of a journal",
        code="E-JOURNAL",
        file=str(path),
        remedy="name a new file; this one is not changed",
    )
