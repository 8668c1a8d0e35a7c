"""Files written so that they are either the old or the new one, whole; every failure a `StorageError`.

Datasets are NetCDF-4 files, written with checksums and read with suspicion.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import hashlib
import importlib
import io
import json
import mmap
import os
import re
import secrets
import shutil
import stat
import struct
import sys
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import MappingProxyType, MethodType
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np

from femgear import __version__
from femgear.errors import StorageError

if TYPE_CHECKING:
    import xarray as xr

_NAME = re.compile(r"[A-Za-z0-9._-]{1,100}")
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d+)?")
_RESERVED = re.compile(r'(?i)(con|prn|aux|nul|(com|lpt)[\d¹²³])\s*(\..*)?|.*[/\\:*?"<>|].*|[. ].*|.*[. ]|')
"""Names that some file system gives a meaning of its own, or takes for others."""
# what `replace_file` writes under; older versions had the number of the process
_TEMPORARY = re.compile(r"\..+\.([0-9a-f]{16}|\d{1,10})\.tmp(\..{1,8})?")
# bytes of the disk that stay free
_RESERVE = 1_000_000
_FORMAT = 1
_SEQUENCES: dict[str, Callable] = {one.__name__: one for one in (tuple, list, set, frozenset)}
_OWN = "femgear."
# what was written into a folder, as sha256sum lists it
_WRITTEN = ".written"
# bytes that a file may declare beyond four times its size
_MARGIN = 1_000_000
# bytes of a file from which its numbers are read when they are asked for
_LARGE = 200_000_000


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
    replace_file(path, lambda temporary: _to_netcdf(dataset, temporary), size=int(dataset.nbytes))


def _to_netcdf(dataset: xr.Dataset, path: Path, **options: Any) -> None:
    """Write a dataset as `write_dataset` does, under the name itself."""
    encoding = {}
    for name, variable in dataset.variables.items():
        kind = variable.dtype.kind
        _check_variable(str(name), variable, coordinate=name in dataset.coords, path=path)
        encoding[name] = {"_FillValue": None} if kind in "OUS" or variable.ndim == 0 else {"fletcher32": True}
        if kind == "f":
            encoding[name] |= {"dtype": "float64", "_FillValue": None}
    stamped = dataset.assign_attrs(femgear_format=_FORMAT, femgear_version=__version__)
    options |= {"engine": "h5netcdf", "encoding": encoding}
    write_hdf5(path, lambda stream: stamped.to_netcdf(stream, **options))


def append_dataset(dataset: xr.Dataset, path: Path, along: str) -> None:
    """Append a dataset to a file of its kind along one dimension; the file has the texts of the latest.

    Parameters
    ----------
    dataset : xarray.Dataset
        As for `write_dataset`; what does not extend over the dimension is that of the first one.
    path : path
        From `replaced_file`: the first dataset is written into an empty file.
    along : str
        Name of the dimension.
    """
    if path.stat().st_size:
        write_hdf5(path, lambda stream: _append(dataset, stream, along))
    else:
        _to_netcdf(dataset, path, unlimited_dims=[along])


def _append(dataset: xr.Dataset, stream: io.RawIOBase, along: str) -> None:
    """Append as `append_dataset` to an open file."""
    import h5py

    with h5py.File(stream, "r+") as file:
        for name, variable in dataset.variables.items():
            if along in variable.dims:
                axis, stored = variable.dims.index(along), file[str(name)]
                assert isinstance(stored, h5py.Dataset)
                end = stored.shape[axis] + variable.shape[axis]
                place = [slice(None)] * variable.ndim
                place[axis] = slice(stored.shape[axis], end)
                stored.resize(end, axis=axis)
                stored[tuple(place)] = variable.values
        file.attrs.update({str(name): text for name, text in dataset.attrs.items() if isinstance(text, str)})


def write_hdf5(path: str | os.PathLike, write: Callable[[io.RawIOBase], object]) -> None:
    """Write an HDF5 file by ``write(stream)``; raises the `OSError` of a disk that fails meanwhile."""
    with _Disk(path, "r+b") as disk, ThreadPoolExecutor(1) as pool:
        try:
            # signals interrupt the main thread alone: raised within HDF5 they would be lost
            pool.submit(write, disk).result()
        except RuntimeError as error:  # of HDF5 itself
            raise StorageError(
                str(error), file=os.fspath(path), remedy="see that disk and memory suffice"
            ) from error
        finally:
            if disk.failure is not None:
                raise disk.failure


class _Disk(io.FileIO):
    """A file that keeps its first failure for later: HDF5 ends the process where a disk fails under it."""

    failure: OSError | None = None

    def write(self, data) -> int:
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while len(rest) and self.failure is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.failure = error
        return size

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size) if self.failure is None else 0
        except OSError as error:
            self.failure = error
            return 0


def read_dataset(path: str | os.PathLike) -> xr.Dataset:
    """Read a dataset that `write_dataset` wrote: numbers in memory, dimensions, and units as attributes.

    Numbers of a large file stay there until they are asked for, and are read again whenever they are: choose
    some by ``isel`` first. The file is walked before: links, data kept in other files, unusual types and
    declared sizes that the file cannot hold are refused.

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
    options = {"engine": "h5netcdf", "decode_times": False, "decode_timedelta": False}
    try:
        with storage_errors(path):
            _refuse_hostile(path)
        large = os.path.getsize(path) > _LARGE
        dataset = xr.open_dataset(path, cache=False, **options) if large else xr.load_dataset(path, **options)
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


def write_result(result: object, path: str | os.PathLike, *, fingerprint: str) -> None:
    """Write the result of a stage, so that a run that was interrupted goes on from it; see `read_result`.

    Parameters
    ----------
    result : object
        Made of dataclasses, sections of cases, arrays, sparse matrices, tables, sequences and numbers.
    fingerprint : str
        Of all that the result depends on.

    Raises
    ------
    TypeError
        Anything else, such as a function.
    StorageError
    """
    arrays: list[np.ndarray] = []
    tree = {"fingerprint": fingerprint, "result": _encoded(result, arrays, {})}
    text = np.frombuffer(json.dumps(tree).encode(), np.uint8)
    size = sum(array.nbytes for array in arrays)
    replace_file(path, lambda new: np.savez(new, text, *arrays), size=size)  # type: ignore[arg-type]


def read_result(path: str | os.PathLike, *, fingerprint: str) -> Any:
    """Read the result that `write_result` wrote with a fingerprint: numbers and dataclasses alone.

    Raises
    ------
    StorageError
        ``E-FORMAT``: damaged, or written with another fingerprint.
    """
    try:
        with storage_errors(path), np.load(path, allow_pickle=False) as file:
            arrays = [file[f"arr_{i}"] for i in range(len(file.files))]
        tree = json.loads(arrays[0].tobytes())
        if tree["fingerprint"] == fingerprint:
            return _decoded(tree["result"], arrays[1:], {})
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, ImportError, BadZipFile):
        pass
    raise StorageError("no result of this case", code="E-FORMAT", file=os.fspath(path))


def _encoded(value: Any, arrays: list[np.ndarray], known: dict[int, tuple[int, Any]]) -> Any:
    """Turn a value into JSON that numbers its arrays; what was met before is named by its number."""

    def inner(value: Any) -> Any:
        return _encoded(value, arrays, known)

    def pairs(table: Mapping) -> list:
        return [[inner(key), inner(item)] for key, item in table.items()]

    kind = type(value)
    if value is None or kind in (bool, int, float, str):
        return value
    if id(value) in known:
        return {"kind": "known", "number": known[id(value)][0]}
    number = len(known)
    # the value itself is kept, so that no other one gets its id
    known[id(value)] = number, value
    found: dict[str, Any] = {"number": number, "kind": kind.__name__}
    if kind is np.ndarray and value.dtype != object:
        arrays.append(value)
        return found | {"array": len(arrays) - 1, "fixed": not value.flags.writeable}
    if isinstance(value, np.generic | complex):
        arrays.append(np.asarray(value))
        return found | {"kind": "complex" if kind is complex else "generic", "array": len(arrays) - 1}
    if kind in (tuple, list, set, frozenset):
        return found | {"items": [inner(item) for item in value]}
    if kind in (dict, MappingProxyType):
        return found | {"items": pairs(value)}
    if kind is slice:
        return found | {"items": [inner(item) for item in (value.start, value.stop, value.step)]}
    if kind is MethodType:
        return found | {"name": value.__name__, "of": inner(value.__self__)}
    if kind.__module__.startswith("scipy.sparse") and value.format in ("csc", "csr"):
        parts = value.data, value.indices, value.indptr, value.shape
        return found | {"items": [inner(item) for item in parts]}
    if not (is_dataclass(value) or kind.__module__.startswith(_OWN)):
        raise TypeError(f"a {kind.__qualname__} cannot be written")
    # a dataclass keeps its fields alone, without what it has computed from them
    names = [one.name for one in fields(value)] if is_dataclass(value) else None
    own: Any = value
    state = own.__getstate__() if names is None else {name: getattr(own, name) for name in names}
    return found | {"kind": "own", "class": [kind.__module__, kind.__qualname__], "items": pairs(state)}


def _decoded(node: Any, arrays: list[np.ndarray], known: dict[int, Any]) -> Any:
    """Turn JSON of `_encoded` into the value again."""
    if not isinstance(node, dict):
        return node
    if node["kind"] == "known":
        return known[node["number"]]
    value = known[node["number"]] = _made(node, arrays, known)
    return value


def _made(node: dict, arrays: list[np.ndarray], known: dict[int, Any]) -> Any:
    """Make the value of a node that was not met before."""

    def items() -> list:
        return [_decoded(item, arrays, known) for item in node["items"]]

    def table() -> dict:
        return {_decoded(key, arrays, known): _decoded(item, arrays, known) for key, item in node["items"]}

    match node["kind"]:
        case "ndarray":
            array = arrays[node["array"]]
            array.setflags(write=not node["fixed"])
            return array
        case "generic" | "complex" as kind:
            number = arrays[node["array"]][()]
            return number if kind == "generic" else complex(number)
        case "dict":
            return table()
        case "mappingproxy":
            return MappingProxyType(table())
        case "slice":
            return slice(*items())
        case "method":
            return getattr(_decoded(node["of"], arrays, known), node["name"])
        case "csc_array" | "csr_array" | "csc_matrix" | "csr_matrix" as kind:
            *parts, shape = items()
            return getattr(importlib.import_module("scipy.sparse"), kind)(tuple(parts), shape=shape)
        case "own":
            module, name = node["class"]
            return _own_object(module, name, table())
        case kind:
            return _SEQUENCES[kind](items())


def _own_object(module: str, name: str, state: dict) -> Any:
    """Make an object of a dataclass or of femgear as it was; its checks have been passed before."""
    place = importlib.import_module(module) if module.startswith(_OWN) else sys.modules[module]
    found = getattr(place, name)
    if not isinstance(found, type) or not (is_dataclass(found) or module.startswith(_OWN)):
        raise TypeError(f"{module} has no such class {name}")
    made = object.__new__(found)
    if is_dataclass(found):
        vars(made).update(state)
    else:
        made.__setstate__(state)  # type: ignore[attr-defined]
    return made


def replace_file(path: str | os.PathLike, write: Callable[[Path], object], *, size: int = 0) -> None:
    """Write a file by ``write(path)`` into an empty one of another name; see `replaced_file`."""
    with replaced_file(path, size=size) as temporary:
        write(temporary)


@contextlib.contextmanager
def replaced_file(path: str | os.PathLike, *, size: float = 0.0) -> Iterator[Path]:
    """Have an empty file of another name filled in the block, force it to the disk, then give it its name.

    It is in the same folder and has the same suffix; no link is followed.

    Parameters
    ----------
    size : int
        What the disk must have room for [bytes].

    Raises
    ------
    StorageError
        ``E-DISK-FULL``, ``E-STORAGE``; the old file is untouched and no temporary one stays behind.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(8)}.tmp{path.suffix}")
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
            open(temporary, "xb").close()
            yield temporary
            with open(temporary, "rb+") as stream:
                os.fsync(stream.fileno())
            if _is_regular(path.with_name(_WRITTEN)):
                _list_own(path, checksum(temporary))
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


def remove_temporaries(folder: str | os.PathLike) -> None:
    """Remove what dead processes left half written in a folder; nobody else may write into it meanwhile."""
    with storage_errors(folder):
        for path in Path(folder).iterdir():
            if is_temporary(path):
                path.unlink()


def is_temporary(path: Path) -> bool:
    """Tell whether a regular file has a name that `replace_file` writes under."""
    return bool(_TEMPORARY.fullmatch(path.name)) and _is_regular(path)


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
    if os.path.exists(path) and not os.path.isfile(path):
        # a pipe would wait, a device never end
        raise StorageError("not a regular file", file=os.fspath(path), remedy="move it away")
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
    plain = name.isprintable() and unicodedata.is_normalized("NFC", name) and not _RESERVED.fullmatch(name)
    if not plain or len(name) > 100 or len(name.encode()) > 240:
        raise StorageError(
            "not a safe file name",
            code="E-CHOICE",
            value=name,
            limit='1 to 100 characters (240 bytes), composed (NFC), without / \\ : * ? " < > | and control '
            "characters, no dot or blank at the ends, none that Windows reserves (con, nul, com1, ...)",
            remedy="name another folder",
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

    It keeps those out that ask for it, other threads of this process too; at the end the file is removed.

    Raises
    ------
    StorageError
        ``E-LOCKED``: another process, or another block of this one, holds it.
    """
    from filelock import FileLock, Timeout

    path = Path(path)
    # not at once: whoever held it before removes the file and may be about to
    lock = FileLock(path, timeout=0.1, poll_interval=0.02, thread_local=False, fallback_to_soft=False)
    with storage_errors(path):
        try:
            lock.acquire()
        except Timeout:
            raise StorageError(
                "another run is writing into this folder",
                code="E-LOCKED",
                file=str(path.parent),
                remedy="wait until it has ended, or name another folder",
            ) from None
    try:
        yield
    finally:
        # on Windows the library removes it, after the release
        with contextlib.suppress(OSError):
            found = path.lstat()
            if stat.S_ISREG(found.st_mode) and not found.st_size:
                path.unlink()
        lock.release()


@contextlib.contextmanager
def resumable(folder: Path, complete: Callable[[], bool] = lambda: False) -> Iterator[None]:
    """Say with an interruption of the block how the command goes on, or that its results are complete."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        goes_on = f"the same command goes on from what {folder} holds"
        interrupt.add_note(f"the results in {folder} are complete" if complete() else goes_on)
        raise


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
    remedies = {
        errno.ENOSPC: "free some space or name another folder",
        errno.EDQUOT: "free some space or name another folder",
        errno.EFBIG: "raise the limit of the size of files (ulimit -f), or name another folder",
        errno.ELOOP: "move the link away",
    }
    return StorageError(
        error.strerror or str(error),
        code="E-DISK-FULL" if full else "E-STORAGE",
        file=None if path is None else os.fsdecode(path),
        remedy=remedies.get(error.errno or 0, "check name and permissions"),
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

    if _heap_without_end(path):
        raise _hostile(path, None, "holds a heap without end")
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


def _heap_without_end(path: str | os.PathLike) -> bool:
    """Tell whether a global heap of an HDF5 file has empty space of no size: HDF5 would never leave it.

    Source: HDF5 File Format Specification 3.0, III.E: a header, then objects of 16 bytes and their data.
    """
    if not os.path.getsize(path):
        return False
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        start = data.find(b"GCOL\x01")
        while 0 <= start <= len(data) - 16:
            place, end = start + 16, min(start + struct.unpack_from("<8xQ", data, start)[0], len(data))
            while place + 16 <= end:
                number, size = struct.unpack_from("<H6xQ", data, place)
                step = -(-size // 8) * 8 + 16 if number else size
                if not step:
                    return True
                place += step
            start = data.find(b"GCOL\x01", start + 1)
    return False


def _is_plain(dtype: np.dtype) -> bool:
    """Tell whether a type is a number, a truth value or a text."""
    import h5py

    return dtype.kind in "fiubS" or (dtype.kind == "O" and h5py.check_string_dtype(dtype) is not None)


def _hostile(path: str | os.PathLike, name: str | None, what: str) -> StorageError:
    """Make the refusal of a file, or of a name in it."""
    message = f"{name!a} {what}" if name else f"the file {what}"
    return StorageError(message, code="E-FORMAT", file=os.fspath(path), remedy="do not use this file")
