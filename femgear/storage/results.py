"""Results as contents with units, and on disk: one folder a run, one NetCDF file a stage, a manifest.

The manifest holds the checksum of every file and whether the run came to its end.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from html import escape
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear import __version__
from femgear.errors import StorageError
from femgear.findings import Finding, as_data, from_data, remark, tell
from femgear.storage.contents import Contents
from femgear.storage.disk_errors import is_interrupt
from femgear.storage.files import (
    WRITTEN,
    checked_name,
    checksum,
    csv_cell,
    exclusive_lock,
    foreign,
    is_temporary,
    list_own,
    read_dataset,
    remove_own,
    remove_temporaries,
    storage_errors,
    write_text,
)

if TYPE_CHECKING:
    import xarray as xr

FOURIER = "x(t) = Re sum_h X_h exp(i h omega t)"
_FORMAT, _READ = 5, (4, 5)
"""Format of manifests that are written, and those that are read: of format 4 the findings are unknown."""
MANIFEST = "manifest.json"
_UNKNOWN = remark(
    "the former version of femgear that wrote this folder stored no warnings: run the case again to see them"
)
KEPT = ".stages"
"""Folder of results that a run goes on from when it was interrupted."""
_CASE, _LOCK = "case.toml", ".lock"
_RUNNING, _ADDED, EXPORTED = ".running", ".added", "exported"
_NAME = re.compile(r"(?!\.\.?$)[A-Za-z0-9._-]{1,100}")
_LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "xarray", "h5netcdf", "h5py")
_COORDINATES = {
    "axis": ("1", "axis of the frame of the carrier"),
    "circumferential": ("1", "signed nodal diameter n"),
    "direction": ("1", "direction at the planet"),
    "dof": ("1", "degree of freedom"),
    "harmonic": ("1", "harmonic of the mesh frequency"),
    "member": ("1", "member"),
    "mesh": ("1", "gear mesh"),
    "mode": ("1", "mode, from 1"),
    "planet": ("1", "planet"),
    "position": ("1", "position in mesh periods"),
    "speed": ("rpm", "speed of the input"),
}
"""Unit and description of what the variables of planetary sets stand over."""
_MEASURES = "tooth_thickness", "span", "over_balls"
_ATTRIBUTES = {
    name: unit
    for unit, names in (
        ("Hz", "bandwidth compared_to excitation_reach natural_frequency resolution"),
        ("degC", "oil_temperature"),
        ("kg/m^3", "air_density"),
        ("m", "centre_distance face_width half_backlash microphone_distance module outer_radius"),
        ("m", "ball_diameter tip_diameter normal_play_gear_1_gear_2 normal_play_planet_ring normal_play_sun_planet"),
        ("m", " ".join(f"{name}{limit}" for name in _MEASURES for limit in ("", "_least", "_largest"))),
        ("m/s", "sound_speed"),
        ("m/s^2", "reference_acceleration"),
        ("N", "unit_force"),
        ("N m", "sun_torque"),
        ("rad", "base_helix_angle microphone_angle planet_angles sensor_angle"),
        ("rad", "working_pressure_angle_planet_ring working_pressure_angle_sun_planet"),
        ("rad/s", "speed"),
        ("rpm", "operating_speeds"),
        ("s", "settle step"),
    )
    for name in names.split()
}
"""Units of the attributes of the files; the others are pure numbers or words."""


def dataset(variables: dict, coords: dict, attrs: dict) -> xr.Dataset:
    """Make a dataset of entries ``(dims, values, units, long_name)``; dims as names or one text.

    ``variables`` and ``coords`` map names to entries, ``attrs`` are those of the dataset.
    """
    return Contents(variables, coords, attrs).to_xarray()


def coordinates(**values: object) -> dict[str, tuple]:
    """Make entries of `dataset` for coordinates by name: axis, harmonic, mesh, speed [rpm] and others."""
    if "speed" in values:
        values["speed"] = as_written(values["speed"])
    return {name: (name, values[name], *_COORDINATES[name]) for name in values}


def as_written(values) -> np.ndarray:
    """Round values (n,) to 13 digits: 3100 rpm, which rad/s make 3099.9999999999995, are 3100 again."""
    return np.array([float(f"{value:.13g}") for value in np.asarray(values, float)])


def declared(texts: Mapping[str, tuple[str, str, str]], values: Mapping[str, object]) -> dict[str, tuple]:
    """Join declarations ``(dims, units, long_name)`` with values by name; what has no value is left out."""
    return {name: (dims, values[name], units, words) for name, (dims, units, words) in texts.items() if name in values}


def tables_of(data: xr.Dataset, stage: str) -> Iterator[tuple[str, Any]]:
    """Make a pandas table of every set of dimensions of a stage, with its name; headers carry the units.

    ``modes_dof_mode`` holds the variables over degrees of freedom and modes, a line for each pair; ``modes``
    holds single numbers and the attributes of the file, a line for each. Tables without a line are left out.
    """
    import pandas as pd

    flat = data.reset_coords()
    single = [
        *((str(name), value.item(), _unit(value)) for name, value in flat.items() if not value.dims),
        *(_attribute(str(name), value) for name, value in data.attrs.items()),
    ]
    for dims in dict.fromkeys([(), *(array.dims for array in flat.values())]):
        if dims:
            chosen = [name for name, value in flat.items() if value.dims == dims]
            frame = flat[chosen].to_dataframe(dim_order=list(dims)).reset_index()
            frame = frame.rename(columns={name: _header(flat, str(name)) for name in frame})
        else:
            frame = pd.DataFrame(single, columns=["name", "value", "unit"])
        if not frame.empty:
            yield "_".join((stage, *map(str, dims))), frame


def write_csv_tables(data: xr.Dataset, folder: Path, stage: str) -> list[str]:
    """Write the tables of a stage, see `tables_of`, as CSV files; returns the names of the files."""
    names = []
    for name, frame in tables_of(data, stage):
        names.append(checked_name(f"{name}.csv"))
        text = frame.select_dtypes(["object", "str"]).map(csv_cell)
        frame[text.columns] = text
        write_text(frame.to_csv(index=False, lineterminator="\n"), folder / names[-1])
    return names


def _attribute(name: str, value: object) -> tuple[str, Any, str]:
    """Name, value and unit of an attribute of a file."""
    number = np.asarray(value).dtype.kind in "iuf"
    return name, value if np.isscalar(value) else str(value), _ATTRIBUTES.get(name, "1") if number else ""


def _unit(array: xr.DataArray) -> str:
    """Tell the unit of a number, nothing for text."""
    return "" if array.dtype.kind in "OUSb" else str(array.attrs.get("units", "1"))


def _header(data: xr.Dataset, name: str) -> str:
    """Write a name with its unit; dimensions without values of their own are numbers."""
    unit = _unit(data[name]) if name in data.variables else "1"
    return f"{name} [{unit}]" if unit else name


def complex_entries(entries, *, single: bool = False) -> dict[str, tuple]:
    """Split entries into real and imaginary parts, from ``(name, dims, values, units, long_name)``.

    In single precision where that is finer than the tolerance of what they come from.
    """
    parts = {}
    for name, dims, values, units, words in entries:
        values = values.astype(np.complex64) if single else values
        parts[f"{name}_real"] = (dims, values.real, units, f"{words}, real part")
        parts[f"{name}_imag"] = (dims, values.imag, units, f"{words}, imaginary part")
    return parts


def mode_entries(modes: Any) -> dict[str, tuple]:
    """List what is known of every mode of any system: frequency, damping and kind."""
    return {
        "frequency": ("mode", modes.frequency, "Hz", "undamped natural frequency"),
        "damping_ratio": ("mode", modes.damping_ratio, "1", "fraction of critical damping"),
        "kind": ("mode", list(modes.kind), "1", "kind of mode"),
    }


def shape_entries(shape, mesh_stiffness, mesh_deflection, along: str = "") -> dict[str, tuple]:
    """List shapes (dof, mode), and stiffness (mesh,) [N/m] and deflection (mesh, mode) of meshes in modes.

    ``along`` is what the descriptions of the meshes end with.
    """
    return {
        "shape": ("dof mode", shape, "kg^-1/2", "mode shape of unit mass; rotations in kg^-1/2 m^-1"),
        "mesh_stiffness": ("mesh", mesh_stiffness, "N/m", f"mean mesh stiffness{along}"),
        "mesh_deflection": ("mesh mode", mesh_deflection, "kg^-1/2", f"mesh deflection of the mode{along}"),
    }


def response_variables(result: Any) -> dict[str, tuple]:
    """List what is known of a periodic response, (speed,) each: frequency [Hz], convergence, stability.

    Of any result with a response, its stability and, where there is a carrier, the speeds of the members.
    """
    response, stability, speed = result.response, result.stability, ("speed",)
    carrier = [at_speed.carrier for at_speed in getattr(result, "speeds", ())]
    return {
        "mesh_frequency": (speed, response.mesh_frequency, "Hz", "mesh frequency"),
        **({"carrier_speed": (speed, carrier, "rad/s", "speed of the carrier")} if carrier else {}),
        "converged": (speed, response.converged, "1", "whether the solution satisfies its tolerance"),
        "iterations": (speed, response.iterations, "1", "iterations of the fixed point"),
        "residual": (speed, response.residual, "1", "relative residual of the harmonic equations"),
        "spectral_radius": (speed, response.spectral_radius, "1", "spectral radius of the fixed point"),
        "tail": (speed, response.tail, "1", "share of the amplitude in the upper half of the harmonics"),
        "method": (speed, list(response.method), "1", "method of solution"),
        "floquet_multiplier": (speed, np.abs(stability.multiplier), "1", "largest Floquet multiplier"),
        "stable": (speed, stability.stable, "1", "whether no perturbation grows"),
    }


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
    findings : tuple of Finding
        Of the case, and of the stages that were computed.
    """

    complete: bool
    files: Mapping[str, str] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    convergence: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    def __post_init__(self):
        for name in ("files", "timings", "convergence", "versions"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))


@dataclass(frozen=True)
class Results:
    """A results ``folder`` with its ``manifest``; ``read_case`` turns the path of the case file into the case.

    Every file is read, and its checksum tested, when it is first asked for.
    """

    folder: Path
    manifest: Manifest
    read_case: Callable[[Path], Any]

    @cached_property
    def case(self) -> Any:
        """The case as run."""
        return self.read_case(self._checked(_CASE))

    def __getattr__(self, name: str) -> xr.Dataset:
        """Contents of the file of a stage: ``results.modes``, as ``results["modes"]``."""
        if name.startswith("_"):
            raise AttributeError(name)
        opened = self.__dict__[name] = read_dataset(self._checked(f"{name}.nc"))
        return opened

    def __getitem__(self, name: str) -> xr.Dataset:
        return getattr(self, name)

    def with_known(self, data: Mapping[str, Contents | xr.Dataset]) -> Results:
        """Take the contents of some files, by stage, from memory instead of reading them."""
        vars(self).update(data)
        return self

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What deserves a look in the case and in the results of its stages, each once."""
        return self.manifest.findings

    def __iter__(self) -> Iterator[str]:
        return iter(self.stages)

    def __len__(self) -> int:
        return len(self.stages)

    def __repr__(self) -> str:
        state = "complete" if self.manifest.complete else "not complete"
        return f"<Results in {self.folder}: {', '.join(self.stages) or 'no stage'}; {state}>"

    def _repr_html_(self) -> str:
        """Stages with their variables, for notebooks."""
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(', '.join(map(str, self[name].data_vars)))}</td>"
            f"<td>{self.manifest.timings.get(name, 0.0):.2f} s</td></tr>"
            for name in self.stages
        )
        return f"<p>{escape(repr(self))}</p><table><tr><th>stage<th>variables<th>time</tr>{rows}</table>"

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages that the folder holds, in the order of the run."""
        return tuple(name.removesuffix(".nc") for name in self.manifest.files if name.endswith(".nc"))

    def _checked(self, name: str) -> Path:
        """Path of a file of the run that is there and unchanged."""
        path = self.folder / name
        if name not in self.manifest.files:
            _refuse_incomplete(self)
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


def results_of(folder: str | os.PathLike, read_case: Callable[[Path], object], *, partial: bool = True) -> Results:
    """Open the results of a run, whose case ``read_case(path)`` reads; see `femgear.open_results`."""
    folder = Path(folder)
    _refuse_missing(folder)
    results = Results(folder, read_manifest(folder), read_case)
    if not partial:
        _refuse_incomplete(results)
    elif not results.manifest.complete:
        tell(remark(f"{folder}: {_interrupted(results)}"))
    return results


@contextmanager
def run_folder(folder: str | os.PathLike, *, case: str | None = None, force: bool = False) -> Iterator[Path]:
    """Lock a folder for a run to write into; old results stay until the new ones are complete.

    A run that replaces results is given a folder inside, whose files take their place at the end; should it
    fail or be interrupted, the old ones are as they were.

    StorageError: E-OUTPUT: the folder holds other people's files (no manifest), complete results, files of an
    interrupted run of another case, or files that were changed. E-LOCKED: another run writes there.

    Parameters
    ----------
    folder : path-like
        Created where it does not exist (its last name must be safe, see `checked_name`).
    case : str, optional
        Text of the case: what an interrupted run of it left stays, for this one to go on from.
    force : bool
        Replace the results of an earlier run, or what an interrupted one of another case left.
    """
    folder = Path(folder)
    _make(folder)
    with folder_lock(folder):
        running = folder / _RUNNING
        if not (force and _is_complete(folder)):
            remove_own(running)
            yield prepare_output(folder, case=case, force=force)
            _remove_kept(folder)
            return
        _refuse_changed(folder, read_manifest(folder))
        try:
            if case is None or not (running / MANIFEST).is_file():
                remove_own(running)
            list_own(running)
            yield prepare_output(running, case=case, force=True)
        except BaseException as error:
            # what a user interrupts goes on with the next run
            resumed = case is not None and is_interrupt(error)
            if not (resumed and (running / MANIFEST).is_file() and read_manifest(running).files):
                remove_own(running)
            raise
        _publish(folder)


def completed_since_now(folder: str | os.PathLike) -> Callable[[], bool]:
    """Make a function that tells whether a run into a folder was completed after this call."""

    def written() -> tuple[int, int] | None:
        with suppress(OSError):
            status = os.stat(Path(folder) / MANIFEST)
            return status.st_ino, status.st_mtime_ns
        return None

    before = written()
    return lambda: written() != before and read_manifest(folder).complete


@contextmanager
def folder_lock(folder: str | os.PathLike) -> Iterator[None]:
    """Lock a results folder: in this context no other process writes into it (readers need no lock).

    What a killed run left in it is brought to its end or removed. Refuses a folder that another run holds
    (E-LOCKED), or that is not there (E-RESULTS-MISSING).
    """
    folder = Path(folder)
    _refuse_missing(folder)
    with exclusive_lock(folder / _LOCK):
        remove_temporaries(folder)
        _publish(folder)
        remove_own(folder / _ADDED)
        _remove_kept(folder)
        yield


def _is_complete(folder: Path) -> bool:
    """Tell whether a folder holds the results of a run that came to its end."""
    return (folder / MANIFEST).is_file() and read_manifest(folder).complete


def _remove_kept(folder: Path) -> None:
    """Remove what only an interrupted run goes on from, where the run has come to its end."""
    if _is_complete(folder):
        remove_own(folder / KEPT)


@contextmanager
def additions(folder: Path) -> Iterator[Path]:
    """Add files to results, whose folder is locked; the manifest lists them.

    At the end the files of the folder that is given take the places that they have in it. Refused (E-OUTPUT)
    where a file of the manifest was changed, or one that it does not list is in the way.
    """
    manifest = read_manifest(folder)
    _refuse_changed(folder, manifest)
    added = folder / _ADDED
    try:
        list_own(added)
        yield added
        paths = sorted(path for path in added.rglob("*") if path.is_file() and path.name != WRITTEN)
        files = {path.relative_to(added).as_posix(): checksum(path) for path in paths}
        _movable(added, folder, files, manifest.files)  # refused before it counts as finished
        _write_manifest(added, replace(manifest, files={**manifest.files, **files}))
    except BaseException:
        remove_own(added)
        raise
    _publish(folder)


def prepare_output(folder: str | os.PathLike, *, case: str | None = None, force: bool = False) -> Path:
    """Make a folder ready for a run as `run_folder`; its manifest says that the run is not complete.

    Only unchanged files of an interrupted run are ever removed, those of another case with ``force`` alone.
    """
    folder = Path(folder)
    _make(folder)
    if (folder / MANIFEST).is_file():
        manifest = read_manifest(folder)
        if manifest.complete:
            raise StorageError(
                "the folder holds results already",
                code="E-OUTPUT",
                file=str(folder),
                remedy="name a new folder, or replace them with --force",
            )
        _refuse_changed(folder, manifest)
        if case is not None and manifest.files.get(_CASE) == hashlib.sha256(case.encode()).hexdigest():
            return folder
        if case is not None and _CASE in manifest.files and not force:
            raise StorageError(
                "the folder holds an interrupted run of another case",
                code="E-OUTPUT",
                file=str(folder),
                remedy="name a new folder, or replace it with --force",
            )
        discard(folder, manifest.files)
    _write_manifest(folder, Manifest(complete=False))
    return folder


def discard(folder: Path, files: Mapping[str, str]) -> None:
    """Remove files of a run that are unchanged, names with checksums, and folders that are empty then."""
    with storage_errors(folder):
        for path in [folder / name for name, digest in files.items() if _is_unchanged(folder, name, digest)]:
            path.unlink()
            if path.parent != folder:
                with suppress(OSError):
                    path.parent.rmdir()


def record(
    folder: str | os.PathLike,
    names: list[str],
    *,
    timings: Mapping[str, float],
    convergence: Mapping[str, object],
    findings: Iterable[Finding] = (),
    checksums: Mapping[str, str] = MappingProxyType({}),
    complete: bool = False,
) -> Manifest:
    """Write the manifest of what a run has written so far; see `Manifest`.

    Parameters
    ----------
    names : list of str
        Files that the run wrote, as paths inside the folder.
    checksums : mapping of str to str
        Those of the files that are as they were, which saves reading them.
    convergence : mapping
        Numbers, texts, arrays and tables of these; numbers that are not finite are stored as null.
    """
    files = {name: checksums.get(name) or checksum(Path(folder) / name) for name in names}
    manifest = Manifest(complete, files, timings, convergence, versions(), tuple(findings))
    _write_manifest(folder, manifest)
    return manifest


_version = cache(version)


def versions() -> dict[str, str]:
    """List the versions of femgear and of the libraries that compute."""
    versions_of = {"femgear": __version__, "python": platform.python_version()}
    return versions_of | {name: _version(name) for name in _LIBRARIES}


def read_manifest(folder: str | os.PathLike) -> Manifest:
    """Read the manifest of a results folder: its files with checksums, seconds and verdicts of the stages.

    StorageError: missing, not a femgear manifest, of a newer format, or naming files outside the folder
    (E-FORMAT).
    """
    path = Path(folder) / MANIFEST
    with storage_errors(path):
        text = path.read_bytes() if path.is_file() and path.stat().st_size <= 10_000_000 else b""
    try:
        data = json.loads(text)
        seal, right = data.pop("checksum", None), _seal(data)
        written = data.pop("femgear_format")
        if type(written) is not int or written not in _READ:
            raise StorageError(
                "written by another version of femgear",
                code="E-FORMAT",
                file=str(path),
                value=written,
                limit=" and ".join(map(str, _READ)),
                remedy="run the case again",
            )
        if seal != right:
            raise StorageError(
                "changed since femgear wrote it (its checksum does not fit)",
                code="E-FORMAT",
                file=str(path),
                remedy="run the case again in a new folder",
            )
        data["findings"] = (_UNKNOWN,) if written < _FORMAT else from_data(data["findings"])
        manifest = Manifest(**data)
    except (ValueError, RecursionError, KeyError, AttributeError, TypeError):
        raise StorageError(
            "no femgear manifest of reasonable size",
            code="E-FORMAT",
            file=str(path),
            remedy="name a folder that femgear run wrote",
        ) from None
    for name in manifest.files:
        if not all(_NAME.fullmatch(part) for part in name.split("/")):
            raise StorageError(
                "names a file outside the folder",
                code="E-FORMAT",
                file=str(path),
                value=name,
                remedy="run the case again in a new folder",
            )
    return manifest


def _write_manifest(folder: str | os.PathLike, manifest: Manifest) -> None:
    """Write ``manifest.json``; the last file of a run."""
    data = _plain({"femgear_format": _FORMAT, **vars(manifest), "findings": as_data(manifest.findings)})
    sealed = {**data, "checksum": _seal(data)}
    write_text(json.dumps(sealed, indent=1, allow_nan=False) + "\n", Path(folder) / MANIFEST)


def _seal(data: dict) -> str:
    """Compute the SHA-256 of what a manifest says."""
    return hashlib.sha256(json.dumps(data, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Turn nested tables, lists, arrays and numbers into a JSON value."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _refuse_missing(folder: Path) -> None:
    """Refuse a folder that is not there."""
    if not folder.is_dir():
        raise StorageError(
            "no such results folder",
            code="E-RESULTS-MISSING",
            file=str(folder),
            remedy="name a folder that femgear run wrote",
        )


def _refuse_incomplete(results: Results) -> None:
    """Refuse the results of an interrupted run."""
    if results.manifest.complete:
        return
    folder = results.folder
    case = folder / _CASE if _CASE in results.manifest.files else "CASE"
    raise StorageError(
        _interrupted(results),
        code="E-RESULTS-INCOMPLETE",
        file=str(folder),
        remedy=f"run it again: femgear run {shlex.quote(str(case))} -o {shlex.quote(str(folder))}",
    )


def _refuse_changed(folder: Path, manifest: Manifest) -> None:
    """Refuse to replace results in which somebody has changed a file."""
    present = [name for name in manifest.files if os.path.lexists(folder / name)]
    changed = [name for name in present if not _is_unchanged(folder, name, manifest.files[name])]
    if changed:
        raise StorageError(
            f"{', '.join(changed)} changed since the run wrote {'it' if len(changed) == 1 else 'them'}",
            code="E-OUTPUT",
            file=str(folder),
            remedy="move the changed files away, or name a new folder",
        )


def _interrupted(results: Results) -> str:
    """Tell how far an interrupted run came."""
    stages = f"after: {', '.join(results.stages)}" if results.stages else "before a stage was complete"
    return f"the run was interrupted {stages}"


def _make(folder: Path) -> None:
    """Create a folder, or refuse one that is not for results."""
    if not folder.exists():
        checked_name(os.path.basename(os.path.abspath(folder)))
    with storage_errors(folder):
        if folder.exists() and not folder.is_dir():
            message, remedy = "exists and is not a folder", "name another folder"
            raise StorageError(message, code="E-OUTPUT", file=str(folder), remedy=remedy)
        folder.mkdir(parents=True, exist_ok=True)
        others = [path for path in folder.iterdir() if path.name != _LOCK and not is_temporary(path)]
    if others and not (folder / MANIFEST).is_file():
        raise StorageError(
            "the folder holds files but no femgear results",
            code="E-OUTPUT",
            file=str(folder),
            remedy="name a new folder",
        )


def _publish(folder: Path) -> None:
    """Give new files their places, the manifest last, if it is there; repeated after an interruption."""
    for source in (folder / _RUNNING, folder / _ADDED):
        if source.is_symlink() or not (source / MANIFEST).is_file():
            continue
        new, old = read_manifest(source), read_manifest(folder)
        if old.complete and not new.complete:
            continue
        with storage_errors(folder):
            for name in _movable(source, folder, new.files, old.files):
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                os.replace(source / name, folder / name)
            discard(folder, {name: digest for name, digest in old.files.items() if name not in new.files})
            os.replace(source / MANIFEST, folder / MANIFEST)
        remove_own(source)


def _movable(source: Path, folder: Path, files: Mapping[str, str], owned: Mapping[str, str]) -> list[str]:
    """List which of some files are there; refuses to replace what is not owned, or was changed."""
    moved = [name for name in files if os.path.lexists(source / name)]
    for name in moved:
        if not _is_unchanged(source, name, files[name]):
            raise foreign(source / name)
        place, expected = folder / name, owned.get(name, files[name])
        led_away = place.parent.resolve() != folder.resolve() / Path(name).parent
        if led_away or (os.path.lexists(place) and not _is_unchanged(folder, name, expected)):
            raise foreign(place)
    return moved


def _is_unchanged(folder: Path, name: str, digest: str) -> bool:
    """Tell whether a file is there, no link on the way from the folder, and has its checksum."""
    path = folder / name
    return path.resolve() == folder.resolve() / name and path.is_file() and checksum(path) == digest
