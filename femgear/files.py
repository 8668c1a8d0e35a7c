"""Files written so that they are either the old or the new one, whole; every failure a `StorageError`."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from femgear.errors import StorageError

_NAME = re.compile(r"[A-Za-z0-9._-]{1,100}")
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")
_RESERVE = 1_000_000


@contextlib.contextmanager
def storage_errors(path: str | os.PathLike) -> Iterator[None]:
    """Turn an `OSError` of the block into a `StorageError` that names ``path``."""
    try:
        yield
    except OSError as error:
        raise storage_error(error, path) from error


def storage_error(error: OSError, path: str | os.PathLike | None) -> StorageError:
    """The `StorageError` that says what an `OSError` says, ``E-DISK-FULL`` or ``E-STORAGE``."""
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    return StorageError(
        error.strerror or str(error),
        code="E-DISK-FULL" if full else "E-STORAGE",
        file=None if path is None else os.fsdecode(path),
        remedy="free some space or name another folder" if full else None,
    )


@contextlib.contextmanager
def exclusive_lock(path: str | os.PathLike) -> Iterator[None]:
    """Hold a lock file for the block; the system releases it when the process ends, however it ends.

    Advisory (``flock``): it keeps those out that ask for it. Where the system has no ``flock`` (Windows)
    nothing is locked.

    Raises
    ------
    StorageError
        ``E-LOCKED``: another process, or another block of this one, holds it.
    """
    path = Path(path)
    with storage_errors(path):
        descriptor = _locked(path)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        if descriptor is not None:
            os.close(descriptor)


def _locked(path: Path) -> int | None:
    try:
        import fcntl
    except ImportError:
        return None
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # whoever held it before may have removed the file that is open here
            if path.exists() and os.path.samestat(os.stat(path), os.fstat(descriptor)):
                return descriptor
        except BlockingIOError:
            os.close(descriptor)
            raise StorageError(
                "another run is writing into this folder",
                code="E-LOCKED",
                file=str(path.parent),
                remedy="wait until it has ended, or name another folder",
            ) from None
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def is_safe_path(name: str) -> bool:
    """Whether a relative path stays in its folder and has plain names only."""
    path = Path(name)
    return (
        bool(path.parts)
        and not path.is_absolute()
        and all(_NAME.fullmatch(p) and p != ".." for p in path.parts)
    )


def checked_name(name: str) -> str:
    """``name`` if every file system takes it as one plain file name, else refused.

    Raises
    ------
    StorageError
        ``E-NAME``.
    """
    if not _NAME.fullmatch(name) or _RESERVED.fullmatch(name) or name.startswith(".") or name.endswith("."):
        raise StorageError(
            "not a safe file name",
            code="E-NAME",
            value=name,
            limit="1 to 100 of A-Z a-z 0-9 . _ -, no dot at the ends, no reserved name",
        )
    return name


def checksum(path: str | os.PathLike) -> str:
    """SHA-256 of a file."""
    with storage_errors(path), open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def write_text(text: str, path: str | os.PathLike) -> None:
    """Write UTF-8 text so that the file is either the old or the new one, whole."""
    data = text.encode()
    replace_file(path, lambda temporary: temporary.write_bytes(data), size=len(data))


def replace_file(path: str | os.PathLike, write: Callable[[Path], object], *, size: int = 0) -> None:
    """Write a file under a temporary name, force it to the disk, then give it its name.

    Parameters
    ----------
    path : path-like
    write : callable
        Is given the temporary path, in the same folder and with the same suffix.
    size : int
        Bytes to come; refused beforehand where the disk has not that much left.

    Raises
    ------
    StorageError
        ``E-DISK-FULL``, ``E-STORAGE``; the old file is untouched and no temporary one stays behind.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    with storage_errors(path):
        free = shutil.disk_usage(path.parent).free
        if free < size + _RESERVE:
            raise StorageError(
                f"{size / 1e6:.1f} MB to write, {free / 1e6:.1f} MB left on the disk, of which "
                f"{_RESERVE / 1e6:.0f} MB are kept in reserve",
                code="E-DISK-FULL",
                file=str(path),
                limit=f"{(size + _RESERVE) / 1e6:.1f} MB free",
                remedy="free some space or name another folder",
            )
        try:
            write(temporary)
            with open(temporary, "rb+") as stream:
                os.fsync(stream.fileno())
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
