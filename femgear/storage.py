"""Results on disk: one folder a run, one NetCDF file a stage, a manifest with checksums."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from femgear import __version__
from femgear.case import Case, read_case
from femgear.errors import StorageError
from femgear.files import checked_name, checksum, is_safe_path, storage_errors, write_text
from femgear.netcdf import read_dataset, write_dataset

if TYPE_CHECKING:
    import xarray as xr

FORMAT = 1
__all__ = [
    "Manifest",
    "Results",
    "finish",
    "open_results",
    "prepare_output",
    "read_dataset",
    "read_manifest",
    "verify",
    "versions",
    "write_dataset",
    "write_manifest",
    "write_text",
]
STAGES = ("static", "modes", "dynamics", "housing")
MANIFEST = "manifest.json"
CASE = "case.toml"


@dataclass(frozen=True)
class Manifest:
    """What a run wrote.

    Parameters
    ----------
    complete : bool
        Whether the run came to its end.
    files : mapping of str to str
        SHA-256 of every file, by its path inside the folder.
    timings : mapping of str to float
        Seconds a stage took.
    convergence : mapping
        What each stage says about its convergence.
    versions : mapping of str to str
        femgear and the libraries that computed.
    format : int
    """

    complete: bool
    files: Mapping[str, str] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    convergence: Mapping[str, object] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    format: int = FORMAT

    def __post_init__(self):
        for name in ("files", "timings", "convergence", "versions"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))


@dataclass(frozen=True)
class Results:
    """A results folder; every file is read, and its checksum tested, when it is first asked for."""

    folder: Path
    manifest: Manifest

    @cached_property
    def case(self) -> Case:
        """The case as run."""
        return read_case(self._checked(CASE))

    @cached_property
    def static(self) -> xr.Dataset:
        """Static transmission error, mesh stiffness, load sharing."""
        return read_dataset(self._checked("static.nc"))

    @cached_property
    def modes(self) -> xr.Dataset:
        """Natural frequencies and mode shapes."""
        return read_dataset(self._checked("modes.nc"))

    @cached_property
    def dynamics(self) -> xr.Dataset:
        """Periodic response at every speed."""
        return read_dataset(self._checked("dynamics.nc"))

    @cached_property
    def housing(self) -> xr.Dataset:
        """Signal and orders of the fixed sensor."""
        return read_dataset(self._checked("housing.nc"))

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages that the folder holds."""
        return tuple(stage for stage in STAGES if f"{stage}.nc" in self.manifest.files)

    def _checked(self, name: str) -> Path:
        path = self.folder / name
        if name not in self.manifest.files:
            raise StorageError(
                "the run did not write this file",
                code="E-RESULTS-MISSING",
                file=str(path),
                limit=", ".join(self.manifest.files) or "nothing was written",
            )
        if checksum(path) != self.manifest.files[name]:
            raise StorageError(
                "the file is not the one that the run wrote (SHA-256 differs from the manifest)",
                code="E-RESULTS-CHANGED",
                file=str(path),
                remedy="run the case again",
            )
        return path


def open_results(folder: str | os.PathLike) -> Results:
    """Results of a run.

    Parameters
    ----------
    folder : path-like

    Returns
    -------
    Results

    Raises
    ------
    StorageError
        No folder, no manifest, a broken one or one of a newer femgear.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise StorageError("no such results folder", code="E-RESULTS-MISSING", file=str(folder))
    return Results(folder, read_manifest(folder))


def prepare_output(folder: str | os.PathLike, *, force: bool = False) -> Path:
    """Make a folder ready for a run; nothing but unchanged files of an earlier run is ever removed.

    Parameters
    ----------
    folder : path-like
        Created where it does not exist (its last name must be safe, see `checked_name`).
    force : bool
        Replace the results of a complete earlier run.

    Returns
    -------
    Path
        The folder, with a manifest that says that the run is not complete.

    Raises
    ------
    StorageError
        The folder holds other people's files (no manifest), or complete results and no ``force``.
    """
    folder = Path(folder)
    if not folder.exists():
        checked_name(folder.resolve().name)
    with storage_errors(folder):
        if folder.exists() and not folder.is_dir():
            raise StorageError("exists and is not a folder", code="E-OUTPUT", file=str(folder))
        if folder.is_dir() and any(folder.iterdir()):
            _clear(folder, force)
        folder.mkdir(parents=True, exist_ok=True)
    write_manifest(folder, Manifest(complete=False))
    return folder


def _clear(folder: Path, force: bool) -> None:
    if not (folder / MANIFEST).is_file():
        raise StorageError(
            "the folder holds files but no femgear results",
            code="E-OUTPUT",
            file=str(folder),
            remedy="name a new folder",
        )
    manifest = read_manifest(folder)
    if manifest.complete and not force:
        raise StorageError(
            "the folder holds results already",
            code="E-OUTPUT",
            file=str(folder),
            remedy="name a new folder, or replace them with --force",
        )
    for name, digest in manifest.files.items():
        path = folder / name
        # a link inside the folder must not lead the removal out of it
        inside = path.resolve() == folder.resolve() / name
        if inside and path.is_file() and checksum(path) == digest:
            path.unlink()


def read_manifest(folder: str | os.PathLike) -> Manifest:
    """Manifest of a results folder.

    Raises
    ------
    StorageError
        Missing, not a femgear manifest, of a newer format, or naming files outside the folder.
    """
    path = Path(folder) / MANIFEST
    remedy = "name a folder that femgear run wrote"
    with storage_errors(path):
        if not path.is_file() or path.stat().st_size > 10_000_000:
            raise StorageError(
                "no manifest of reasonable size", code="E-MANIFEST", file=str(path), remedy=remedy
            )
        text = path.read_bytes()
    try:
        data = json.loads(text)
        version = data.pop("femgear_format")
    except (ValueError, RecursionError, KeyError, AttributeError, TypeError):
        raise StorageError(
            "not a femgear manifest", code="E-MANIFEST", file=str(path), remedy=remedy
        ) from None
    if type(version) is not int or not 1 <= version <= FORMAT:
        raise StorageError(
            "written by another version of femgear",
            code="E-FORMAT",
            file=str(path),
            value=version,
            limit=f"1 to {FORMAT}",
        )
    try:
        manifest = Manifest(format=version, **data)
    except (TypeError, ValueError):
        raise StorageError(
            "not a femgear manifest", code="E-MANIFEST", file=str(path), remedy=remedy
        ) from None
    for name in manifest.files:
        if not is_safe_path(name):
            raise StorageError(
                "names a file outside the folder", code="E-MANIFEST", file=str(path), value=name
            )
    return manifest


def write_manifest(folder: str | os.PathLike, manifest: Manifest) -> None:
    """Write ``manifest.json``; the last file of a run."""
    data = {
        "femgear_format": manifest.format,
        "complete": manifest.complete,
        "files": dict(manifest.files),
        "timings": dict(manifest.timings),
        "convergence": _plain(dict(manifest.convergence)),
        "versions": dict(manifest.versions),
    }
    write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", Path(folder) / MANIFEST)


def _plain(value: object) -> object:
    """JSON value of nested tables, lists, arrays and numbers."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def finish(
    folder: str | os.PathLike,
    names: list[str],
    *,
    timings: Mapping[str, float],
    convergence: Mapping[str, object],
) -> Manifest:
    """Write the manifest of a run that came to its end.

    Parameters
    ----------
    folder : path-like
    names : list of str
        Files that the run wrote, as paths inside the folder.
    timings : mapping of str to float
        Seconds a stage.
    convergence : mapping
        Numbers, texts, arrays and tables of these; numbers that are not finite are stored as null.
    """
    files = {name: checksum(Path(folder) / name) for name in names}
    manifest = Manifest(
        complete=True, files=files, timings=timings, convergence=convergence, versions=versions()
    )
    write_manifest(folder, manifest)
    return manifest


def verify(folder: str | os.PathLike) -> tuple[str, ...]:
    """Files of the manifest that are missing or changed."""
    folder = Path(folder)
    files = read_manifest(folder).files
    return tuple(
        n for n, digest in files.items() if not (folder / n).is_file() or checksum(folder / n) != digest
    )


def versions() -> dict[str, str]:
    """Versions of femgear, Python and the libraries that compute."""
    import platform
    from importlib.metadata import version

    libraries = ("numpy", "scipy", "scikit-fem", "gmsh", "xarray", "h5netcdf", "h5py")
    return {"femgear": __version__, "python": platform.python_version(), **{n: version(n) for n in libraries}}
