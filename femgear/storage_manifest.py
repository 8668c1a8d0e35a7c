"""The manifest of a results folder: what a run wrote, with checksums, and whether it came to its end."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from femgear import __version__
from femgear.errors import StorageError
from femgear.files import checksum, is_safe_path, storage_errors, write_text

FORMAT = 1
MANIFEST = "manifest.json"


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
