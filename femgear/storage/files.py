"""Files written so that they are either the old or the new one, whole; every failure a `StorageError`.

Datasets are NetCDF-4 files, written with checksums and read with suspicion.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import importlib
import io
import json
import math
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

import femgear
from femgear.errors import StorageError
from femgear.storage.disk_errors import is_interrupt, storage_errors

try:
    import fcntl
except ImportError:  # Windows, where no open file can be removed
    fcntl = None

if TYPE_CHECKING:
    import xarray as xr

    from femgear.storage.contents import Contents, Labelled

_FORMULA = re.compile(r"'*[=+\-@\t\r]")
"""Beginning of a text that a spreadsheet runs, or that `csv_cell` has marked."""
_PLAIN = re.compile(
    r"[+-]((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?( ?[A-Za-zµ°%][A-Za-z0-9µ°%/^* ]{0,20})?|inf|nan|[xyz]|radial|tangential)|-"
)
"""Numbers, also with a unit, axes after a sign, and the dash of nothing: no formulas."""
_RESERVED = re.compile(r'(?i)(con|prn|aux|nul|(com|lpt)[\d¹²³])\s*(\..*)?|.*[/\\:*?"<>|].*|[. ].*|.*[. ]|')
"""Names that some file system gives a meaning of its own, or takes for others."""
# what `replaced_file` writes under; nobody else has such names
_TEMPORARY = re.compile(r"\.femgear-[0-9a-f]{16}\..+")
# bytes of the disk that stay free
_RESERVE = 1_000_000
_FORMAT = 1
_CONTAINERS: dict[str, Callable[[list], Any]] = {
    **{"tuple": tuple, "list": list, "set": set, "frozenset": frozenset, "dict": dict},
    "mappingproxy": lambda items: MappingProxyType(dict(items)),
    "slice": lambda parts: slice(*parts),
    "complex": lambda parts: complex(*parts),
}
_PACKAGE = "femgear."
# what was written into a folder, as sha256sum lists it; half a line of a killed process is one too
WRITTEN, _LINE = ".written", re.compile(rb"[0-9a-f]{64}  .+|[0-9a-f]{0,64} ?")
# folders whose lists this process keeps
_LISTED: set[Path] = set()
# bytes that a file may declare for each of its own, compressed and with pieces that are not there, and beyond
_SPARSE, _MARGIN = 100, 1_000_000
# numbers in a piece of a variable that grows, and in one step along the first dimension of it
_CHUNK, _INNER = 2**14, 512
# bytes of a variable from which it is compressed
_COMPRESSED = 4_000_000
# bytes of numbers of a file from which they are read when they are asked for
_LARGE = 200_000_000
# attributes that make a file of HDF5 one of NetCDF-4, and those by which others say how numbers are stored
_OF_NETCDF = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates"}
_ENCODING = {"_FillValue", "missing_value", "scale_factor", "add_offset", "_Unsigned", "coordinates"}
# how the name of a dimension begins that is no variable
_NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"


def write_dataset(dataset: Contents | xr.Dataset, path: str | os.PathLike) -> None:
    """Write contents, or a dataset, as NetCDF-4 with a checksum (Fletcher-32) on every chunk.

    Its variables are real, text or boolean; they and the numeric coordinates have the attributes ``units``
    and ``long_name``.

    StorageError: a complex variable, a missing attribute (E-FORMAT); E-DISK-FULL, E-STORAGE.
    """
    with replaced_file(path, size=dataset.nbytes) as temporary:
        _to_netcdf(dataset, temporary)


def _to_netcdf(dataset: Contents | xr.Dataset, path: Path, *, growing: bool = False) -> None:
    """Write a dataset as `write_dataset` does, under the name itself; its numbers may have to grow."""
    free = [name for name, coord in dataset.coords.items() if growing and coord.dtype.kind not in "OUS"]
    for name, variable in dataset.variables.items():
        _check_variable(str(name), variable, coordinate=name in dataset.coords, path=path)
    write_hdf5(path, lambda stream: _create(dataset, stream, free))


def _create(dataset: Contents | xr.Dataset, stream: io.RawIOBase, free: Sequence[object]) -> None:
    """Write a dataset into an open file in the form of NetCDF-4, whose dimensions are scales of HDF5."""
    import h5py

    sizes = dataset.sizes
    # NetCDF knows no empty dimension of fixed size
    longest = {dim: None if dim in free or not size else size for dim, size in sizes.items()}
    stored = {"O": h5py.string_dtype(), "U": h5py.string_dtype(), "b": np.dtype("i1")}
    with h5py.File(stream, "w", track_order=True) as file:
        file.attrs.update(dataset.attrs, femgear_format=_FORMAT, femgear_version=femgear.__version__)
        if beside := [str(name) for name in dataset.coords if name not in sizes]:
            file.attrs["coordinates"] = " ".join(beside)
        made: dict[Any, h5py.Dataset] = {}
        for name, variable in dataset.variables.items():
            kind = stored.get(variable.dtype.kind, variable.dtype)
            options = {"maxshape": [longest[dim] for dim in variable.dims], "fletcher32": kind.kind != "O"}
            if variable.dims and (free or variable.nbytes > _COMPRESSED) and variable.dtype.kind not in "OUS":
                pieces = _chunk(variable, free) if free else True
                options |= {"chunks": pieces, "compression": 1, "shuffle": True}
            values = variable.values.astype(kind, copy=False)
            made[name] = file.create_dataset(str(name), data=values, **(options if variable.dims else {}))
            made[name].attrs.update(variable.attrs, **({"dtype": "bool"} if variable.dtype.kind == "b" else {}))
        for number, (dim, size) in enumerate(sizes.items()):
            text = str(dim)
            if dim not in made:
                made[dim] = file.create_dataset(text, (size,), ">f4", maxshape=(longest[dim],))
                text = f"This is a netCDF dimension but not a netCDF variable.{size:10d}"
            made[dim].make_scale(text)
            made[dim].attrs["_Netcdf4Dimid"] = np.int32(number)
        for name, variable in dataset.variables.items():
            for axis, dim in enumerate(() if name in sizes else variable.dims):
                made[name].dims[axis].attach_scale(made[dim])


def _chunk(variable: Labelled | xr.Variable, free: Sequence[object]) -> tuple[int, ...]:
    """Shape of the pieces in which a variable is stored that grows along some dimensions: 16 000 numbers."""
    sizes = dict(list(variable.sizes.items())[1:])
    fixed = math.prod(size for name, size in sizes.items() if name not in free)
    inner = [max(_INNER // fixed, 64) if name in free else size for name, size in sizes.items()]
    first = max(_CHUNK // math.prod(inner), 16)
    return (first if variable.dims[0] in free else variable.shape[0], *inner)


def append_dataset(dataset: Contents | xr.Dataset, path: Path, along: str) -> None:
    """Append a dataset to a file of its kind along one dimension; the other numbers are those of the latest.

    Dimensions that are longer than before grow, and what is missing of a shorter one is zero; coordinates
    begin with the same numbers. The path is that of `replaced_file`: the first dataset is written into an
    empty file.
    """
    if path.stat().st_size:
        write_hdf5(path, lambda stream: _append(dataset, stream, along))
    else:
        _to_netcdf(dataset, path, growing=True)


def _append(dataset: Contents | xr.Dataset, stream: io.RawIOBase, along: str) -> None:
    """Append as `append_dataset` to an open file."""
    import h5py

    with h5py.File(stream, "r+") as file:
        for name, variable in dataset.variables.items():
            stored = file[str(name)]
            assert isinstance(stored, h5py.Dataset)
            if along not in variable.dims:
                if name in dataset.coords and variable.shape <= stored.shape:
                    continue
                stored[...] = np.zeros(stored.shape, stored.dtype)
            start = [size if dim_there == along else 0 for dim_there, size in zip(variable.dims, stored.shape)]
            end = [first + size for first, size in zip(start, variable.shape)]
            if end != list(stored.shape):
                stored.resize(np.maximum(stored.shape, end))
            stored[tuple(map(slice, start, end))] = variable.values
        file.attrs.update({str(name): text for name, text in dataset.attrs.items() if isinstance(text, str)})


def write_attribute(path: Path, name: str, text: str) -> None:
    """Give a file of `append_dataset` an attribute that is known when all of it is written."""

    def write(stream: io.RawIOBase) -> None:
        import h5py

        with h5py.File(stream, "r+") as file:
            file.attrs[name] = text

    write_hdf5(path, write)


def write_hdf5(path: str | os.PathLike, write: Callable[[io.RawIOBase], object]) -> None:
    """Write an HDF5 file by ``write(stream)``; raises the `OSError` of a disk that fails meanwhile."""
    with _Disk(path, "r+b") as disk, _other_thread() as pool:
        try:
            pool.submit(write, disk).result()
        except RuntimeError as error:  # of HDF5 itself
            remedy = "see that disk and memory suffice"
            raise StorageError(str(error), file=os.fspath(path), remedy=remedy) from error
        finally:
            if disk.failure is not None:
                raise disk.failure


@contextlib.contextmanager
def _other_thread() -> Iterator[ThreadPoolExecutor]:
    """Make a thread for HDF5: signals interrupt the main one alone, and would be lost if raised within it."""
    with ThreadPoolExecutor(1) as pool:
        pool.submit(int).result()  # it runs, and is waited for whenever an interrupt comes
        yield pool


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
    declared sizes that the file cannot hold are refused (E-FORMAT), as is a file of another femgear.
    StorageError: missing, truncated, checksum (E-STORAGE).
    """
    name = os.fspath(path)
    with storage_errors(path):
        if not os.path.isfile(path):
            raise StorageError("no such file", code="E-STORAGE", file=name, remedy="run the case again")
    with _other_thread() as pool:
        reading = pool.submit(_loaded, path)
        try:
            dataset = reading.result()
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
            remedy="run the case again",
        )
    return dataset


def _loaded(path: str | os.PathLike) -> xr.Dataset:
    """The dataset in an unsuspicious file, its numbers in memory unless it is large."""
    import xarray as xr

    with storage_errors(path):
        if hostile := _hostility(path):
            raise StorageError(hostile, code="E-FORMAT", file=os.fspath(path), remedy="do not use this file")
    if (whole := _read_whole(path)) is not None:
        return whole
    options = {"engine": "h5netcdf", "decode_times": False, "decode_timedelta": False}
    with contextlib.ExitStack() as opened:
        dataset = opened.enter_context(xr.open_dataset(path, cache=False, **options))
        if dataset.nbytes <= _LARGE:
            return dataset.load()
        opened.pop_all()
    return dataset


def _read_whole(path: str | os.PathLike) -> xr.Dataset | None:
    """Read what `_create` writes into memory; None where the file is large, or somebody else has written it.

    The same as xarray reads, in a tenth of its time: it looks for the dimensions of every variable and of every
    attribute one by one.
    """
    import h5py
    import xarray as xr

    with h5py.File(path, "r") as file:
        attributes = _attributes(file)
        items = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset)}
        if "femgear_version" not in attributes or sum(item.nbytes for item in items.values()) > _LARGE:
            return None
        beside, parts = str(attributes.pop("coordinates", "")).split(), ({}, {})
        for name, item in items.items():
            attrs = _attributes(item)
            scale = item.attrs.get("NAME", b"") if "CLASS" in item.attrs else None
            if not attrs.keys().isdisjoint(_ENCODING) or item.dtype.kind == "S":
                return None
            if scale is not None and scale.startswith(_NO_VARIABLE):
                continue
            values = np.asarray(item.asstr()[()]).astype(str) if item.dtype.kind == "O" else item[()]
            if attrs.get("dtype") == "bool":
                del attrs["dtype"]
                values = values.astype(bool)
            dims = (name,) if scale is not None else _dimensions(item)
            parts[name in beside or scale is not None][name] = (dims, values, attrs)
    return xr.Dataset(parts[0], coords=parts[1], attrs=attributes)


def _attributes(item: Any) -> dict[str, Any]:
    """Attributes of a file or of a variable without those that make it NetCDF-4; texts in a list, one alone."""
    attributes = {}
    for name in (name for name in item.attrs if name not in _OF_NETCDF):
        value = item.attrs[name]
        if isinstance(value, np.ndarray) and value.dtype.kind == "O":
            value = value.tolist()
        attributes[name] = value[0] if not np.isscalar(value) and len(value) == 1 else value
    return attributes


def _dimensions(item: Any) -> tuple[str, ...]:
    """Names of the dimensions of a variable, each that of the scale it points at."""
    import h5py

    if "DIMENSION_LIST" not in item.attrs:
        return ()
    scales = (references[0] for references in item.attrs["DIMENSION_LIST"])
    return tuple(h5py.h5r.get_name(scale, item.file.id).decode().lstrip("/") for scale in scales)


def write_result(result: object, path: str | os.PathLike, *, fingerprint: str) -> None:
    """Write the result of a stage, so that a run that was interrupted goes on from it; see `read_result`.

    It is made of dataclasses, sections of cases, arrays, sparse matrices, tables, sequences and numbers;
    TypeError: anything else, such as a function. The fingerprint is that of all that it depends on.
    StorageError.
    """
    arrays: list[np.ndarray] = []
    tree = {"fingerprint": fingerprint, "result": _encoded(result, arrays, {})}
    text = np.frombuffer(json.dumps(tree).encode(), np.uint8)
    with replaced_file(path, size=sum(array.nbytes for array in arrays)) as temporary:
        np.savez(temporary, text, *arrays)  # type: ignore[arg-type]


def read_result(path: str | os.PathLike, *, fingerprint: str) -> Any:
    """Read the result that `write_result` wrote with a fingerprint: numbers and dataclasses alone.

    StorageError: damaged, or written with another fingerprint (E-FORMAT).
    """
    try:
        with storage_errors(path), np.load(path, allow_pickle=False) as file:
            arrays = [file[f"arr_{i}"] for i in range(len(file.files))]
        tree = json.loads(arrays[0].tobytes())
        if tree["fingerprint"] == fingerprint:
            return _decoded(tree["result"], arrays[1:], {})
    except (ValueError, LookupError, TypeError, RecursionError, AttributeError, ImportError, BadZipFile):
        pass
    raise StorageError("no result of this case", code="E-FORMAT", file=os.fspath(path), remedy="run the case again")


def _encoded(value: object, arrays: list[np.ndarray], numbers: dict[int, tuple[int, object]]) -> Any:
    """Turn a value into JSON that numbers its arrays; what was met before is named by its number."""
    if value is None or type(value) in (bool, int, float, str):
        return value
    if id(value) in numbers:
        return ["known", numbers[id(value)][0]]
    number = len(numbers)
    # the value itself is kept, so that no other one gets its id
    numbers[id(value)] = number, value
    if type(value) is np.ndarray and value.dtype != object:
        # axes as they lie in memory: products of arrays in another order round differently
        axes = np.argsort([-abs(stride) for stride in value.strides], kind="stable").tolist()
        arrays.append(value.transpose(axes))
        return ["array", number, len(arrays) - 1, not value.flags.writeable, "".join(map(str, axes))]
    if isinstance(value, np.generic):
        arrays.append(np.asarray(value))
        return ["generic", number, len(arrays) - 1]
    kind, parts = _parts(value)
    return [kind, number, *(_encoded(part, arrays, numbers) for part in parts)]


def _parts(value: Any) -> tuple[str, Sequence]:
    """Kind of a value that is no array, and the values that it is made of; `_made` joins them."""
    kind = type(value)
    if kind is slice:
        return kind.__name__, (value.start, value.stop, value.step)
    if kind is complex:
        return kind.__name__, (value.real, value.imag)
    if kind is MethodType:
        return "method", (value.__self__, value.__name__)
    if kind.__module__ == "builtins" and kind.__name__ in _CONTAINERS:
        return kind.__name__, tuple(value.items() if isinstance(value, Mapping) else value)
    if kind.__module__.startswith("scipy.sparse") and value.format in ("csc", "csr"):
        return kind.__name__, (value.data, value.indices, value.indptr, value.shape)
    if is_dataclass(value):  # its fields alone, without what it has computed from them
        state = {field.name: getattr(value, field.name) for field in fields(value)}
    elif kind.__module__.startswith(_PACKAGE):
        state = value.__getstate__()
    else:
        raise TypeError(f"a {kind.__qualname__} cannot be written")
    return "own", (kind.__module__, kind.__qualname__, state)


def _decoded(node: object, arrays: list[np.ndarray], objects: dict[int, object]) -> Any:
    """Turn JSON of `_encoded` into the value again."""
    if not isinstance(node, list | dict):
        return node
    kind, number, *parts = node
    if kind != "known":
        objects[number] = _made(kind, [_decoded(part, arrays, objects) for part in parts], arrays)
    return objects[number]


def _made(kind: str, parts: list, arrays: list[np.ndarray]) -> Any:
    """Make a value of its parts."""
    match kind:
        case "array":
            array = arrays[parts[0]].transpose(np.argsort([int(axis) for axis in parts[2]]))
            array.setflags(write=not parts[1])
            return array
        case "generic":
            return arrays[parts[0]][()]
        case "method":
            return getattr(*parts)
        case "csc_array" | "csr_array" | "csc_matrix" | "csr_matrix":
            *stored, shape = parts
            return getattr(importlib.import_module("scipy.sparse"), kind)(tuple(stored), shape=shape)
        case "own":
            return _own_object(*parts)
    return _CONTAINERS[kind](parts)


def _own_object(module: str, name: str, state: dict) -> Any:
    """Make an object of a dataclass or of femgear as it was; its checks have been passed before."""
    place = importlib.import_module(module) if module.startswith(_PACKAGE) else sys.modules[module]
    kind_ = getattr(place, name)
    if not isinstance(kind_, type) or not (is_dataclass(kind_) or module.startswith(_PACKAGE)):
        raise TypeError(f"{module} has no such class {name}")
    made = object.__new__(kind_)
    if is_dataclass(kind_):
        vars(made).update(state)
    else:
        made.__setstate__(state)  # type: ignore[attr-defined]
    return made


@contextlib.contextmanager
def replaced_file(path: str | os.PathLike, *, size: float = 0.0) -> Iterator[Path]:
    """Have an empty file of another name filled in the block, force it to the disk, then give it its name.

    It is in the same folder and has the same suffix; no link is followed; the disk must have room for
    ``size`` [bytes].

    StorageError: E-DISK-FULL, E-STORAGE; the old file is untouched and no temporary one stays behind.
    """
    path = Path(path)
    temporary = path.with_name(f".femgear-{secrets.token_hex(8)}.{path.name}")
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
            with open(temporary, "xb") as held:
                _lock(held, alone=False)
                yield temporary
                os.fsync(held.fileno())
                if path.parent.absolute() in _LISTED or _is_regular(path.with_name(WRITTEN)):
                    _list_own(path, checksum(temporary))
                if os.name == "nt":  # no open file gets another name there
                    held.close()
                os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


def remove_temporaries(folder: str | os.PathLike) -> None:
    """Remove what dead processes left half written in a folder; that of a living one stays."""
    with storage_errors(folder):
        for path in filter(is_temporary, Path(folder).iterdir()):
            # it may have its name meanwhile, or belong to somebody else
            with contextlib.suppress(OSError):
                with open(path, "rb") as stream:
                    dead = _lock(stream, alone=True)
                if dead:
                    path.unlink()


def _lock(stream: io.BufferedIOBase, *, alone: bool) -> bool:
    """Lock a file as long as it is open, shared or alone; tell whether nobody else's lock is in the way."""
    try:
        if fcntl is not None:
            fcntl.flock(stream, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def is_temporary(path: Path) -> bool:
    """Tell whether a regular file has a name that `replaced_file` writes under."""
    return bool(_TEMPORARY.fullmatch(path.name)) and _is_regular(path)


def write_bytes(data: bytes, path: str | os.PathLike) -> None:
    """Write bytes so that the file is either the old or the new one, whole."""
    with replaced_file(path, size=len(data)) as temporary:
        temporary.write_bytes(data)


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
    """Mark a text that a spreadsheet would run as a formula with an apostrophe; give back anything else.

    Numbers, also with their unit, and names of axes such as ``-z`` are none. `plain_cell` takes the mark off.
    """
    if not isinstance(value, str) or _PLAIN.fullmatch(value) or not _FORMULA.match(value):
        return value
    return f"'{value}"


def plain_cell(text: str) -> str:
    """Read a cell that `csv_cell` wrote: without its apostrophe, where it has one before a formula."""
    return text[1:] if text.startswith("'") and _FORMULA.match(text) else text


def checksum(path: str | os.PathLike) -> str:
    """Compute the SHA-256 of a file."""
    if os.path.exists(path) and not os.path.isfile(path):
        # a pipe would wait, a device never end
        raise StorageError("not a regular file", file=os.fspath(path), remedy="move it away")
    with storage_errors(path), open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def own_files(folder: Path, names: Iterable[str]) -> None:
    """Make a folder ready for files of these names or patterns, and replace none that was not written so.

    StorageError: a file of such a name is not on the list of the folder, see `list_own`, or was changed
    since; results of a run (E-OUTPUT).
    """
    with storage_errors(folder):
        if os.path.lexists(folder / "manifest.json"):
            message, remedy = "the folder holds the results of a run", "name another folder"
            raise StorageError(message, code="E-OUTPUT", file=str(folder), remedy=remedy)
        for name in names:
            for path in folder.glob(name) if "*" in name else [folder / name]:
                _refuse_foreign(path)
    list_own(folder)


def list_own(folder: Path) -> None:
    """Make a folder whose list, ``.written``, has the SHA-256 of all that `replaced_file` writes there.

    What dead processes left half written there is removed.
    """
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        _refuse_foreign(folder / WRITTEN)
    remove_temporaries(folder)
    _LISTED.add(folder.absolute())


def remove_own(folder: Path) -> None:
    """Remove a folder that was made by `list_own`, with all that was written there.

    StorageError: it holds anything else, or a file was changed (E-OUTPUT); nothing is removed then.
    """
    with storage_errors(folder):
        paths = [folder, *sorted(folder.rglob("*"))] if os.path.lexists(folder) else []
        folders = [path for path in paths if path.is_dir() and not path.is_symlink()]
        files = [path for path in paths if path not in folders]
        for path in files:
            _refuse_foreign(path)
        # the lists last, so that what a killed process leaves of it can be told
        for path in sorted(files, key=lambda path: path.name == WRITTEN):
            path.unlink()
        for path in reversed(folders):
            path.rmdir()


def _list_own(path: Path, digest: str) -> None:
    """Put the checksum of a file on the list of its folder before the file has its name."""
    written, entry = path.with_name(WRITTEN), _entry(path, digest)
    for place in (path, written):
        _refuse_foreign(place)
    listed = written.read_bytes() if written.exists() else b""
    if entry not in listed.splitlines():
        with open(written, "ab") as stream:
            # half a line of a killed process spoils no other
            stream.write((b"" if listed[-1:] in (b"", b"\n") else b"\n") + entry + b"\n")
            stream.flush()
            os.fsync(stream.fileno())


def _refuse_foreign(path: Path) -> None:
    """Refuse to replace or remove a file that the list of its folder has not, or a list that is none."""
    if os.path.lexists(path) and not _is_own(path):
        raise foreign(path)


def _is_own(path: Path) -> bool:
    """Tell whether a file is on the list of its folder, and as it was written; or is such a list."""
    if is_temporary(path) or not _is_regular(path):
        return is_temporary(path)
    if path.name == WRITTEN:
        return all(map(_LINE.fullmatch, path.read_bytes().splitlines()))
    entry, written = _entry(path, checksum(path)), path.with_name(WRITTEN)
    # read after the file: another process that replaces it lists it first
    return _is_regular(written) and entry in written.read_bytes().splitlines()


def foreign(path: Path) -> StorageError:
    """Make the refusal to replace or remove what femgear has not written, or somebody has changed."""
    return StorageError(
        "femgear has not written this here, or it was changed since",
        code="E-OUTPUT",
        file=str(path),
        limit=f"files whose SHA-256 {WRITTEN} or the manifest lists",
        remedy="move it away and repeat the command, or name another folder",
    )


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
            remedy="name another one",
            limit='1 to 100 characters (240 bytes), composed (NFC), without / \\ : * ? " < > | and control '
            "characters, no dot or blank at the ends, none that Windows reserves (con, nul, com1, ...)",
        )
    return name


@contextlib.contextmanager
def exclusive_lock(path: str | os.PathLike) -> Iterator[None]:
    """Hold a lock file for the block; the system releases it when the process ends, however it ends.

    It keeps those out that ask for it, other threads of this process too; at the end the file is removed.

    StorageError: another process, or another block of this one, holds it (E-LOCKED).
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
            status = path.lstat()
            if stat.S_ISREG(status.st_mode) and not status.st_size:
                path.unlink()
        lock.release()


@contextlib.contextmanager
def resumable(folder: Path, complete: Callable[[], bool] = lambda: False) -> Iterator[None]:
    """Say with an interruption of the block how the command goes on, or that its results are complete."""
    try:
        yield
    except BaseException as error:
        if is_interrupt(error):
            goes_on = f"the same command goes on from what {folder} holds"
            error.add_note(f"the results in {folder} are complete" if complete() else goes_on)
        raise


def _check_variable(name: str, variable: Labelled | xr.Variable, *, coordinate: bool, path: str | os.PathLike) -> None:
    """Refuse a variable of a type that no file holds, or without unit or text."""
    if variable.dtype.kind not in "fiubOU":
        raise StorageError(
            f"{name} has the type {variable.dtype}",
            code="E-FORMAT",
            file=os.fspath(path),
            remedy="store complex numbers as real and imaginary part",
        )
    labels = coordinate and variable.dtype.kind in "OU"
    missing = [key for key in ("units", "long_name") if key not in variable.attrs]
    if missing and not labels:
        raise StorageError(
            f"{name} lacks {' and '.join(missing)}",
            code="E-FORMAT",
            file=os.fspath(path),
            remedy="give every variable attributes units and long_name",
        )


def _hostility(path: str | os.PathLike) -> str:
    """Tell why an HDF5 file is no result: it points out of itself, or holds what none has, as groups."""
    import h5py

    if _heap_without_end(path):
        return "holds a heap without end"
    size, declared = os.path.getsize(path), 0
    with h5py.File(path, "r") as file:
        for name in file:
            plain = isinstance(file.get(name, getlink=True), h5py.HardLink)
            item = file.get(name) if plain else None
            if not isinstance(item, h5py.Dataset):
                return f"{name!a} is a link, a group or a named type"
            if item.external or item.is_virtual:
                return f"{name!a} keeps its data in other files"
            kind = "S" if h5py.check_string_dtype(item.dtype) is not None else item.dtype.kind
            if kind not in "fiubS":
                return f"{name!a} has the type {item.dtype}"
            declared += item.size * item.dtype.itemsize
    return f"declares {declared:.3g} bytes in a file of {size}" if declared > _SPARSE * size + _MARGIN else ""


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
