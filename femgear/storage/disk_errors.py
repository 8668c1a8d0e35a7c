"""Interrupts of a command, and what the system says of a file, as errors of femgear."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Callable, Iterator

from femgear.errors import StorageError

_signals: list[int] = []


@contextlib.contextmanager
def noted_interrupts() -> Iterator[Callable[[int, object], None]]:
    """Give a handler of signals that raises `KeyboardInterrupt`, which stays one in this block.

    Compiled code may make another error of it: that of h5py and of Matplotlib does.
    """

    def interrupt(number: int, _: object) -> None:
        _signals.append(number)
        raise KeyboardInterrupt

    try:
        yield interrupt
    except Exception as error:
        if not is_interrupt(error):
            raise
        stopped = KeyboardInterrupt()
        for note in getattr(error, "__notes__", []):
            stopped.add_note(note)
        raise stopped from error
    finally:
        _signals.clear()


def is_interrupt(error: BaseException) -> bool:
    """Tell whether an error is an interrupt, or comes after one."""
    return bool(_signals) or not isinstance(error, Exception)


@contextlib.contextmanager
def storage_errors(path: str | os.PathLike) -> Iterator[None]:
    """Turn an `OSError` of the block into a `StorageError` that names ``path``; refuse what is no name."""
    try:
        possible = b"\0" not in os.fsencode(path)
    except UnicodeEncodeError:
        possible = False
    if not possible:
        raise StorageError(
            "no file can have this name",
            value=os.fsdecode(path),
            limit="no NUL, no lone surrogate",
            remedy="name another folder",
        )
    try:
        yield
    except OSError as error:
        raise storage_error(error, path) from error


def storage_error(error: OSError, path: str | os.PathLike | None) -> StorageError:
    """Say what an `OSError` says in a `StorageError`, ``E-DISK-FULL`` or ``E-STORAGE``."""
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    remedies = {
        errno.EFBIG: "raise the limit of the size of files (ulimit -f), or name another folder",
        errno.ELOOP: "move the link away",
        errno.EMFILE: "raise the limit of open files (ulimit -n)",
        errno.ENAMETOOLONG: "take a shorter name",
    }
    return StorageError(
        error.strerror or str(error),
        code="E-DISK-FULL" if full else "E-STORAGE",
        file=None if path is None else os.fsdecode(path),
        remedy="free some space or name another folder"
        if full
        else remedies.get(error.errno or 0, "check name and permissions"),
    )
