"""Datasets in NetCDF-4 files: written with checksums, read with suspicion."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from femgear import __version__
from femgear.errors import StorageError
from femgear.files import replace_file, storage_errors

if TYPE_CHECKING:
    import xarray as xr

FORMAT = 1
_MARGIN = 1_000_000


def write_dataset(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a dataset as NetCDF-4 with a checksum (Fletcher-32) on every chunk.

    Parameters
    ----------
    dataset : xarray.Dataset
        Real, text or boolean variables, each with attributes ``units`` and ``long_name``; so the numeric
        coordinates. Real numbers are stored as float64.
    path : path-like

    Raises
    ------
    StorageError
        ``E-SCHEMA``: complex variable, missing attribute. ``E-DISK-FULL``, ``E-STORAGE``.
    """
    encoding = {}
    for name, variable in dataset.variables.items():
        kind = variable.dtype.kind
        _check_variable(str(name), variable, coordinate=name in dataset.coords, path=path)
        encoding[name] = {"_FillValue": None} if kind in "OUS" or variable.ndim == 0 else {"fletcher32": True}
        if kind == "f":
            encoding[name] |= {"dtype": "float64", "_FillValue": None}
    stamped = dataset.assign_attrs(femgear_format=FORMAT, femgear_version=__version__)
    replace_file(
        path,
        lambda temporary: stamped.to_netcdf(temporary, engine="h5netcdf", encoding=encoding),
        size=int(dataset.nbytes),
    )


def _check_variable(name: str, variable: xr.Variable, *, coordinate: bool, path: str | os.PathLike) -> None:
    if variable.dtype.kind not in "fiubOUS":
        raise StorageError(
            f"{name} has the type {variable.dtype}",
            code="E-SCHEMA",
            file=os.fspath(path),
            remedy="store complex numbers as real and imaginary part",
        )
    labels = coordinate and variable.dtype.kind in "OUS"
    missing = [key for key in ("units", "long_name") if key not in variable.attrs]
    if missing and not labels:
        raise StorageError(f"{name} lacks {' and '.join(missing)}", code="E-SCHEMA", file=os.fspath(path))


def read_dataset(path: str | os.PathLike) -> xr.Dataset:
    """Dataset of a file that `write_dataset` wrote, loaded into memory.

    The file is walked first: links, data kept in other files, unusual types and declared sizes that the
    file cannot hold are refused before anything is read.

    Raises
    ------
    StorageError
        ``E-STORAGE`` (missing, truncated, checksum), ``E-HOSTILE`` (see above), ``E-FORMAT``.
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
    if version is None or int(version) > FORMAT:
        raise StorageError(
            "not written by this version of femgear",
            code="E-FORMAT",
            file=name,
            value=version,
            limit=f"femgear_format up to {FORMAT}",
        )
    return dataset


def _refuse_hostile(path: str | os.PathLike) -> None:
    """Walk an HDF5 file and refuse what points out of it or cannot be in it."""
    import h5py

    size = os.path.getsize(path)
    declared, pending = 0, []
    with h5py.File(path, "r") as file:
        pending.append(file)
        while pending:
            group = pending.pop()
            for name in group:
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    raise _hostile(path, name, "is a link")
                item = group.get(name)
                if isinstance(item, h5py.Group):
                    # results have no groups, so a group that holds itself cannot be walked for ever
                    raise _hostile(path, name, "is a group")
                if not isinstance(item, h5py.Dataset):
                    raise _hostile(path, name, "is a named type")
                if item.external or item.is_virtual:
                    raise _hostile(path, name, "keeps its data in other files")
                if item.dtype.kind not in "fiubOS" or (
                    item.dtype.kind == "O" and not h5py.check_string_dtype(item.dtype)
                ):
                    raise _hostile(path, name, f"has the type {item.dtype}")
                declared += item.size * item.dtype.itemsize
    if declared > 4 * size + _MARGIN:
        raise _hostile(path, None, f"declares {declared:.3g} bytes in a file of {size}")


def _is_plain(dtype: np.dtype) -> bool:
    """Whether a type is a number, a truth value or a text."""
    import h5py

    return dtype.kind in "fiubS" or (dtype.kind == "O" and h5py.check_string_dtype(dtype) is not None)


def _hostile(path: str | os.PathLike, name: str | None, what: str) -> StorageError:
    message = f"{name!a} {what}" if name else f"the file {what}"
    return StorageError(message, code="E-HOSTILE", file=os.fspath(path), remedy="do not use this file")
