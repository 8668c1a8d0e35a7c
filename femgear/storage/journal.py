"""A journal on disk: records by key, one JSON line each, appended and forced out.

A search that was interrupted goes on from what its journal holds. The first line, the header, says what the
records belong to.
"""

from __future__ import annotations

import json
import os
from collections.abc import ItemsView, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import BinaryIO

from femgear.errors import StorageError
from femgear.storage.files import exclusive_lock, storage_errors

FORMAT = 1
"""Of journals."""


class Journal:
    """Records by key, in memory and, with a file, on disk. Use `open_journal`.

    Parameters
    ----------
    path : path, optional
        Without one nothing is kept on disk.
    header : dict
        First line of the file.

    Raises
    ------
    StorageError
        E-JOURNAL: the file has another header, or is no journal.
    """

    def __init__(self, path: Path | None = None, header: Mapping[str, object] | None = None):
        self._records: dict[str, dict] = {}
        self._file: tuple[Path, BinaryIO] | None = None
        if path is not None:
            with storage_errors(path):
                self._file = path, open(path, "a+b")
            try:
                self._read(path, self._file[1], dict(header or {}))
            except BaseException:
                self.close()
                raise

    def __len__(self) -> int:
        return len(self._records)

    def __contains__(self, key: str) -> bool:
        return key in self._records

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

    def close(self) -> None:
        """Close the file, if there is one."""
        if self._file is not None:
            self._file[1].close()
            self._file = None

    def _write(self, line: dict) -> None:
        """Append a line and force it out."""
        if self._file is None:
            return
        path, stream = self._file
        with storage_errors(path):
            # a number that is not finite is no JSON, and no result either
            stream.write(json.dumps(line, allow_nan=False).encode() + b"\n")
            stream.flush()
            os.fsync(stream.fileno())

    def _read(self, path: Path, stream: BinaryIO, header: dict) -> None:
        """Take what the file holds; a line that a killed process left half written is cut off."""
        with storage_errors(path):
            stream.seek(0)
            text = stream.read()
        whole = text.rfind(b"\n") + 1
        lines = text[:whole].splitlines()
        # a file without a whole line is either the beginning of this header or none of ours
        if not lines and not json.dumps(header).encode().startswith(text):
            raise _broken(path, 1)
        if lines:
            _check(_line(lines[0], path, 1), header, path)
        for number, line in enumerate(lines[1:], 2):
            entry = _line(line, path, number)
            if not (isinstance(entry.get("key"), str) and isinstance(entry.get("record"), dict)):
                raise _broken(path, number)
            self._records[entry["key"]] = entry["record"]
        if whole < len(text):
            with storage_errors(path):
                stream.truncate(whole)
        if not lines:
            self._write(header)


@contextmanager
def open_journal(
    path: str | os.PathLike | None, *, version: str, case: str, keys: tuple[str, ...]
) -> Iterator[Journal]:
    """A journal for a case and its design variables; while it is open no other process writes into it.

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
    with exclusive_lock(path.with_name(f".{path.name}.lock")), closing(Journal(path, header)) as journal:
        yield journal


def _line(text: bytes, path: Path, number: int) -> dict:
    """One JSON line."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise _broken(path, number) from None
    if not isinstance(found, dict):
        raise _broken(path, number)
    return found


def _broken(path: Path, number: int) -> StorageError:
    return StorageError(
        f"line {number} is no entry of a journal",
        code="E-JOURNAL",
        file=str(path),
        remedy="name a new file; this one is not changed",
    )


def _check(found: dict, header: dict, path: Path) -> None:
    """Refuse a journal whose header is not the expected one."""
    words = {
        "format": "by another version of femgear",
        "femgear": "by another version of femgear",
        "case": "for another case",
        "keys": "for other design variables",
    }
    for name, expected in header.items():
        if found.get(name) != expected:
            raise StorageError(
                f"the journal was written {words[name]}",
                code="E-JOURNAL",
                file=str(path),
                value=found.get(name),
                limit=str(expected),
                remedy="name a new file, or remove this one",
            )
