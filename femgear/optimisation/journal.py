"""What was computed, kept line by line on disk, so that an interrupted search goes on where it was."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from femgear import __version__
from femgear.case import Case, to_toml
from femgear.errors import StorageError
from femgear.files import exclusive_lock, storage_errors

FORMAT = 1


def fingerprint(case: Case) -> str:
    """SHA-256 of the text of a case."""
    return hashlib.sha256(to_toml(case).encode()).hexdigest()


class Journal:
    """Records by key, in memory and, with a file, on disk: one JSON line each, appended and forced out.

    A line that a killed process left half written is cut off. Use `open_journal`.

    Parameters
    ----------
    path : path, optional
        Without one nothing is kept on disk.
    """

    def __init__(self, path: Path | None = None):
        self._path = path
        self._stream = None
        self._records: dict[str, dict] = {}

    def __len__(self) -> int:
        return len(self._records)

    def __contains__(self, key: str) -> bool:
        return key in self._records

    def get(self, key: str) -> dict | None:
        """Record of a key, or None."""
        return self._records.get(key)

    def items(self) -> Iterator[tuple[str, dict]]:
        """Keys and records in the order in which they were first written."""
        return iter(self._records.items())

    def add(self, key: str, record: Mapping[str, object]) -> None:
        """Keep a record; one of the same key is replaced."""
        self._records[key] = dict(record)
        self._write({"key": key, "record": self._records[key]})

    def _write(self, line: dict) -> None:
        if self._stream is None:
            return
        with storage_errors(self._path):
            # a number that is not finite is no JSON, and no result either
            self._stream.write(json.dumps(line, allow_nan=False).encode() + b"\n")
            self._stream.flush()
            os.fsync(self._stream.fileno())

    def _open(self, header: dict) -> None:
        with storage_errors(self._path):
            self._stream = open(self._path, "a+b")
            self._stream.seek(0)
            text = self._stream.read()
        whole = text.rfind(b"\n") + 1
        lines = text[:whole].splitlines()
        # a file without a whole line is either the beginning of this header or none of ours
        if not lines and not json.dumps(header).encode().startswith(text):
            raise _broken(self._path, 1)
        if lines:
            _check(_line(lines[0], self._path, 1), header, self._path)
        for number, line in enumerate(lines[1:], 2):
            entry = _line(line, self._path, number)
            if not (isinstance(entry.get("key"), str) and isinstance(entry.get("record"), dict)):
                raise _broken(self._path, number)
            self._records[entry["key"]] = entry["record"]
        if whole < len(text):
            with storage_errors(self._path):
                self._stream.truncate(whole)
        if not lines:
            self._write(header)

    def _close(self) -> None:
        if self._stream is not None:
            self._stream.close()
            self._stream = None


@contextmanager
def open_journal(path: str | os.PathLike | None, case: Case, keys: tuple[str, ...]) -> Iterator[Journal]:
    """A journal for a case and its design variables; while it is open no other process writes into it.

    Parameters
    ----------
    path : path-like, optional
        Created where it does not exist; None keeps records in memory only.
    case : Case
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
    header = {"format": FORMAT, "femgear": __version__, "case": fingerprint(case), "keys": list(keys)}
    with storage_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    with exclusive_lock(path.with_name(f".{path.name}.lock")):
        journal = Journal(path)
        try:
            journal._open(header)
            yield journal
        finally:
            journal._close()


def _line(text: bytes, path: Path, number: int) -> dict:
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
