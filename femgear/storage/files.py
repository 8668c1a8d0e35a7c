"""Files written so that they are either the old or the new one, whole; every failure a `StorageError`.

Datasets are NetCDF-4 files, written with checksums and read with suspicion.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import hashlib
import io
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear import __version__
from femgear.errors import StorageError

if TYPE_CHECKING:
    import xarray as xr

if sys.platform != "win32":
    import fcntl

_NAME = re.compile(r"[A-Za-z0-9._-]{1,100}")
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d+)?")
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")
# bytes of the disk that stay free
_RESERVE = 1_000_000
_FORMAT = 1
# what was written into a folder, as sha256sum lists it
_WRITTEN = ".written"
# bytes that a file may declare beyond four times its size
_MARGIN = 1_000_000


def write_dataset(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a dataset as NetCDF-4 with a checksum (Fletcher-32) on every chunk.

    Parameters
    ----------
    dataset : xarray.Dataset
        Real, text or boolean variables, each with attributes ``units`` and ``long_name``; so the numeric
        coordinates. Real numbers are stored as float64.

    Raises
    ------
    StorageError
        ``E-FORMAT``: complex variable, missing attribute. ``E-DISK-FULL``, ``E-STORAGE``.
    """
    encoding = {}
    for name, variable in dataset.variables.items():
        kind = variable.dtype.kind
        _check_variable(str(name), variable, coordinate=name in dataset.coords, path=path)
        encoding[name] = {"_FillValue": None} if kind in "OUS" or variable.ndim == 0 else {"fletcher32": True}
        if kind == "f":
            encoding[name] |= {"dtype": "float64", "_FillValue": None}
    stamped = dataset.assign_attrs(femgear_format=_FORMAT, femgear_version=__version__)
    replace_file(
        path,
        lambda temporary: stamped.to_netcdf(temporary, engine="h5netcdf", encoding=encoding),
        size=int(dataset.nbytes),
    )


def read_dataset(path: str | os.PathLike) -> xr.Dataset:
    """Read a dataset that `write_dataset` wrote: numbers in memory, dimensions, and units as attributes.

    The file is walked first: links, data kept in other files, unusual types and declared sizes that the
    file cannot hold are refused before anything is read.

    Raises
    ------
    StorageError
        ``E-STORAGE`` (missing, truncated, checksum), ``E-FORMAT`` (see above; of another femgear).
    """
    import xarray as xr

    name = os.fspath(path)
    with storage_errors(path):
        if not os.path.isfile(path):
            raise StorageError("no such file", code="E-STORAGE", file=name)
        _refuse_hostile(path)
    try:
        dataset = xr.load_dataset(path, engine="h5netcdf", decode_times=False, decode_timedelta=False)
    except (OSError, RuntimeError, ValueError, KeyError, TypeError) as error:
        raise StorageError(f"damaged: {error}", file=name, remedy="run the case again") from error
    version = dataset.attrs.get("femgear_format")
    if not isinstance(version, int | np.integer) or version > _FORMAT:
        raise StorageError(
            "not written by this version of femgear",
            code="E-FORMAT",
            file=name,
            value=version,
            limit=f"femgear_format up to {_FORMAT}",
        )
    return dataset


def replace_file(path: str | os.PathLike, write: Callable[[Path], object], *, size: int = 0) -> None:
    """Write a file under a temporary name, force it to the disk, then give it its name.

    Parameters
    ----------
    write : callable
        ``(path)`` writes the file under a temporary path, in the same folder and with the same suffix.
    size : int
        What the disk must have room for [bytes].

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
            if _is_regular(path.with_name(_WRITTEN)):
                _list_own(path, checksum(temporary))
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


def write_bytes(data: bytes, path: str | os.PathLike) -> None:
    """Write bytes so that the file is either the old or the new one, whole."""
    replace_file(path, lambda temporary: temporary.write_bytes(data), size=len(data))


def write_text(text: str, path: str | os.PathLike) -> None:
    """Write UTF-8 text so that the file is either the old or the new one, whole."""
    write_bytes(text.encode(), path)


def write_csv(path: str | os.PathLike, header: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a table as CSV, units in the header, numbers with nine digits; the file is whole."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(map(csv_cell, header))
    for row in rows:
        writer.writerow(f"{value:.9g}" if isinstance(value, float) else csv_cell(value) for value in row)
    write_text(stream.getvalue(), path)


def csv_cell(value: object) -> object:
    """Mark a text that a spreadsheet would run as a formula with an apostrophe; give back anything else."""
    if not isinstance(value, str) or _NUMBER.fullmatch(value):
        return value
    return f"'{value}" if value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


def checksum(path: str | os.PathLike) -> str:
    """Compute the SHA-256 of a file."""
    with storage_errors(path), open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def own_files(folder: Path, names: Iterable[str]) -> None:
    """Make a folder ready for files of these names or patterns, and replace none that was not written so.

    From now on the folder keeps a list, ``.written``, of the SHA-256 of all that `replace_file` writes there.

    Raises
    ------
    StorageError
        ``E-OUTPUT``: a file of such a name is not on the list, or was changed since; results of a run.
    """
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(folder / "manifest.json"):
            raise StorageError(
                "the folder holds the results of a run",
                code="E-OUTPUT",
                file=str(folder),
                remedy="name another folder",
            )
        for name in names:
            for path in folder.glob(name) if "*" in name else [folder / name]:
                _refuse_foreign(path)
        with contextlib.suppress(FileExistsError):
            open(folder / _WRITTEN, "x").close()
        if not _is_regular(folder / _WRITTEN):
            _refuse_foreign(folder / _WRITTEN)


def _list_own(path: Path, digest: str) -> None:
    """Put the checksum of a file on the list of its folder before the file has its name."""
    entry = _entry(path, digest)
    listed = _refuse_foreign(path)
    if entry not in listed.splitlines():
        with open(path.with_name(_WRITTEN), "ab") as stream:
            # half a line of a killed process spoils no other
            stream.write((b"" if listed[-1:] in (b"", b"\n") else b"\n") + entry + b"\n")
            stream.flush()
            os.fsync(stream.fileno())


def _refuse_foreign(path: Path) -> bytes:
    """Refuse to replace what the list of the folder has not; the list otherwise."""
    there = os.path.lexists(path)
    found = _entry(path, checksum(path)) if _is_regular(path) else b"a link or folder"
    # read after the file: another process that replaces it lists it first
    written = path.with_name(_WRITTEN)
    listed = written.read_bytes() if _is_regular(written) else b""
    if there and found not in listed.splitlines():
        raise StorageError(
            "would be replaced, but was not written here by femgear, or was changed since",
            code="E-OUTPUT",
            file=str(path),
            limit=f"files whose SHA-256 {_WRITTEN} lists",
            remedy="move it away, or name another folder",
        )
    return listed


def _entry(path: Path, digest: str) -> bytes:
    """Write a line of the list, without its end."""
    return f"{digest}  ".encode() + os.fsencode(path.name)


def _is_regular(path: Path) -> bool:
    """Tell whether a path is a regular file, and no link to one."""
    return path.is_file() and not path.is_symlink()


def checked_name(name: str) -> str:
    """Refuse (E-CHOICE) a name that some file system does not take as one plain file name."""
    if not _NAME.fullmatch(name) or _RESERVED.fullmatch(name) or name.startswith(".") or name.endswith("."):
        raise StorageError(
            "not a safe file name",
            code="E-CHOICE",
            value=name,
            limit="1 to 100 of A-Z a-z 0-9 . _ -, no dot at the ends, no reserved name",
        )
    return name


def is_safe_path(name: str) -> bool:
    """Tell whether a relative path stays in its folder and has plain names only."""
    path = Path(name)
    return (
        bool(path.parts)
        and not path.is_absolute()
        and all(_NAME.fullmatch(p) and p != ".." for p in path.parts)
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
    if sys.platform == "win32":
        yield
        return
    path = Path(path)
    with storage_errors(path):
        # whoever held it before may have removed the file that was opened
        while (descriptor := _locked(path)) is None:
            pass
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(descriptor)


def _locked(path: Path) -> int | None:
    """Open and lock a file; nothing where the path names another file by now."""
    descriptor, held = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644), False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        held = path.exists() and os.path.samestat(os.stat(path), os.fstat(descriptor))
    except BlockingIOError:
        raise StorageError(
            "another run is writing into this folder",
            code="E-LOCKED",
            file=str(path.parent),
            remedy="wait until it has ended, or name another folder",
        ) from None
    finally:
        if not held:
            os.close(descriptor)
    return descriptor if held else None


@contextlib.contextmanager
def storage_errors(path: str | os.PathLike) -> Iterator[None]:
    """Turn an `OSError` of the block into a `StorageError` that names ``path``."""
    try:
        yield
    except OSError as error:
        raise storage_error(error, path) from error


def storage_error(error: OSError, path: str | os.PathLike | None) -> StorageError:
    """Say what an `OSError` says in a `StorageError`, ``E-DISK-FULL`` or ``E-STORAGE``."""
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    return StorageError(
        error.strerror or str(error),
        code="E-DISK-FULL" if full else "E-STORAGE",
        file=None if path is None else os.fsdecode(path),
        remedy="free some space or name another folder" if full else None,
    )


def _check_variable(name: str, variable: xr.Variable, *, coordinate: bool, path: str | os.PathLike) -> None:
    """Refuse a variable of a type that no file holds, or without unit or text."""
    if variable.dtype.kind not in "fiubOUS":
        raise StorageError(
            f"{name} has the type {variable.dtype}",
            code="E-FORMAT",
            file=os.fspath(path),
            remedy="store complex numbers as real and imaginary part",
        )
    labels = coordinate and variable.dtype.kind in "OUS"
    missing = [key for key in ("units", "long_name") if key not in variable.attrs]
    if missing and not labels:
        raise StorageError(f"{name} lacks {' and '.join(missing)}", code="E-FORMAT", file=os.fspath(path))


def _refuse_hostile(path: str | os.PathLike) -> None:
    """Refuse an HDF5 file that points out of itself or holds what no result has (groups among it)."""
    import h5py

    size, declared = os.path.getsize(path), 0
    with h5py.File(path, "r") as file:
        for name in file:
            plain = isinstance(file.get(name, getlink=True), h5py.HardLink)
            item = file.get(name) if plain else None
            if not isinstance(item, h5py.Dataset):
                raise _hostile(path, name, "is a link, a group or a named type")
            if item.external or item.is_virtual:
                raise _hostile(path, name, "keeps its data in other files")
            if not _is_plain(item.dtype):
                raise _hostile(path, name, f"has the type {item.dtype}")
            declared += item.size * item.dtype.itemsize
    if declared > 4 * size + _MARGIN:
        raise _hostile(path, None, f"declares {declared:.3g} bytes in a file of {size}")


def _is_plain(dtype: np.dtype) -> bool:
    """Tell whether a type is a number, a truth value or a text."""
    import h5py

    return dtype.kind in "fiubS" or (dtype.kind == "O" and h5py.check_string_dtype(dtype) is not None)


def _hostile(path: str | os.PathLike, name: str | None, what: str) -> StorageError:
    """Make the refusal of a file, or of a name in it."""
    message = f"{name!a} {what}" if name else f"the file {what}"
    return StorageError(message, code="E-FORMAT", file=os.fspath(path), remedy="do not use this file")
