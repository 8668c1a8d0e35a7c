"""Numbers of many samples in a file: memory holds a block of samples, or one number of all of them."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from femgear.errors import StorageError
from femgear.storage.files import storage_errors

_ROWS = 2**16
"""Samples that are read at once."""


class Columns:
    """A file with a row of numbers for every sample; use `open_columns`.

    Parameters
    ----------
    widths : dict
        How many values a sample has of each number, by name: 0 of one that is a single value.
    """

    def __init__(self, path: Path, stream, widths: Mapping[str, int]):
        self._path, self._stream, self._widths = path, stream, dict(widths)
        self._ends = np.cumsum([max(width, 1) for width in self._widths.values()])
        self._bytes = 8 * int(self._ends[-1])

    def write(self, first: int, numbers: Mapping[str, np.ndarray]) -> str:
        """Write the numbers of samples from ``first`` on, and force them out; give their checksum."""
        parts = [np.asarray(numbers[name], float) for name in self._widths]
        data = np.column_stack(parts).tobytes()
        with storage_errors(self._path):
            self._stream.seek(first * self._bytes)
            rest = memoryview(data)
            while rest:
                rest = rest[self._stream.write(rest) or 0 :]
            os.fsync(self._stream.fileno())
        return _checksum(data)

    def holds(self, first: int, end: int, checksum: str) -> bool:
        """Tell whether the file has samples ``first`` to ``end - 1`` as they were written."""
        return _checksum(self._read(first, end)) == checksum

    def rows(self, first: int, end: int) -> dict[str, np.ndarray]:
        """Numbers of samples ``first`` to ``end - 1``."""
        table = np.frombuffer(self._read(first, end)).reshape(end - first, -1)
        parts = np.split(table, self._ends[:-1], axis=1)
        named = zip(self._widths.items(), parts, strict=True)
        return {name: part if width else part[:, 0] for (name, width), part in named}

    def blocks(self, count: int) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
        """Give number and numbers of the first of some samples at a time, of ``count`` in all."""
        for first in range(0, count, _ROWS):
            yield first, self.rows(first, min(first + _ROWS, count))

    def column(self, name: str, count: int) -> np.ndarray:
        """One number of the first ``count`` samples."""
        width = self._widths[name]
        found = np.empty((count, width) if width else count)
        for first, rows in self.blocks(count):
            found[first : first + _ROWS] = rows[name]
        return found

    def _read(self, first: int, end: int) -> bytes:
        with storage_errors(self._path):
            self._stream.seek(first * self._bytes)
            data = bytearray()
            # a read may give less than is asked for
            while part := self._stream.read((end - first) * self._bytes - len(data)):
                data += part
        return bytes(data)


@contextmanager
def open_columns(path: Path, widths: Mapping[str, int]) -> Iterator[Columns]:
    """Open the numbers of samples, those that a file of an interrupted command has among them."""
    with storage_errors(path):
        if os.path.lexists(path) and not stat.S_ISREG(path.lstat().st_mode):
            raise StorageError("no regular file", file=str(path), remedy="move it away")
        # unbuffered, so that what could not be written is not written later
        path.touch()
        stream = open(path, "r+b", buffering=0)
    with stream:
        yield Columns(path, stream, widths)


def _checksum(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]
