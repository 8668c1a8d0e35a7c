"""Variants of one case: their stages, and a journal of what was computed.

Grids, compliances and the ring are computed once and used again by every variant that shares them. The
journal keeps numbers line by line on disk, so that an interrupted search goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear import __version__
from femgear.case.case import planetary_set, set_deviations
from femgear.case.dependencies import static_entries
from femgear.case.sections import Case
from femgear.case.units import SPEED
from femgear.errors import CaseError, StorageError
from femgear.storage.files import exclusive_lock, storage_errors
from femgear.study.linearised import static_supports
from femgear.study.variables import FLANK_ENTRIES
from femgear.threads import one_blas_thread
from femgear.trains.elastic import stages as elastic_stages
from femgear.trains.elastic.checks import check_dynamic_case, check_rim_speed
from femgear.trains.reading import to_toml, with_value
from femgear.trains.static import stages as static_stages
from femgear.trains.static.checks import check_motions

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet
    from femgear.system.system import Response
    from femgear.trains.elastic.results import HousingResult, ModesResult
    from femgear.trains.static.results import StaticResult, StressResult

FORMAT = 1
"""Of journals."""
Range = tuple[float, float, int]
"""First and last input speed [rad/s] and number of speeds."""
_SOLUTION = {"positions", "contact", "back_flanks", "stresses", "longest_record"}
_RIGID = {"mass", "inertia", "support_stiffness", "bearing_stiffness", "bearing_clearance"}
_WITHOUT_GRID = {"title", "operation", "dynamics", "housing", "carrier", "motor", "brake", "planar"}


class Variant:
    """The stages of one case, each computed when it is first asked for.

    Parameters
    ----------
    case : Case
    shared : Shared
        Of all variants.
    """

    def __init__(self, case: Case, shared: Shared):
        self.case, self._shared = case, shared
        self._found: dict[tuple, Any] = {}

    def _once(self, *key, compute: Callable[[], Any]):
        """What was found under a key, else computed now."""
        if key not in self._found:
            self._found[key] = compute()
        return self._found[key]

    @cached_property
    def gears(self) -> PlanetarySet:
        """Gears, closed and checked."""
        return planetary_set(self.case)

    def static(self, torque: float | None = None) -> StaticResult:
        """Static solution under a torque on the input [N m], by default that of the case."""
        case = self.case
        if torque is not None and torque != case.operation.torque:
            case = with_value(case, "operation.torque", f"{torque!r} N m")
        return self._once("static", case.operation.torque, compute=lambda: _static(case, self._shared))

    def stress(self) -> StressResult:
        """Root stresses under the torque of the case."""
        return self._once("stress", compute=lambda: static_stages.solve_stress(self.case, self.static()))

    def response(self, speeds: Range) -> Response:
        """Periodic response at a range of speeds, without the verdict on its stability."""
        return self._once("response", speeds, compute=lambda: _response(*self._modes(speeds)))

    def housing(self, speeds: Range) -> HousingResult:
        """What the sensor on the ring hears at a range of speeds."""

        def compute():
            case, modes = self._modes(speeds)
            return elastic_stages.solve_housing(
                case, elastic_stages.solve_dynamics(case, self.static(), modes)
            )

        return self._once("housing", speeds, compute=compute)

    def _modes(self, speeds: Range) -> tuple[Case, ModesResult]:
        """The case at a range of speeds, and its modal basis."""
        case = self._once("speeds", speeds, compute=lambda: at_speeds(self.case, speeds))
        return case, self._once(
            "modes", speeds, compute=lambda: _modal_basis(case, self.static(), self._shared)
        )


def at_speeds(case: Case, speeds: Range) -> Case:
    """The case at equidistant speeds of the input, its published lines left out.

    Raises
    ------
    CaseError
        E-STAGE: a planar or helical case, which has no elastic ring.
    """
    need_elastic_ring(case, "mesh forces over speed and housing levels need")
    first, last, count = speeds
    low, high = (f"{value / SPEED.scale:.12g} rpm" for value in (first, last))
    case = with_value(case, "housing.published", None)
    return with_value(case, "operation.speeds", {"from": low, "to": high, "count": count})


def need_elastic_ring(case: Case, subject: str) -> None:
    """Refuse a planar or helical case (E-STAGE); the subject with its verb begins the message."""
    other = [name for name in ("planar", "helical") if getattr(case, name, None) is not None]
    if other:
        raise CaseError(
            f"{subject} a case with an elastic ring",
            code="E-STAGE",
            key=other[0],
            limit="transmission error, contact ratio, tip thickness, contact pressure, root stress",
        )


@one_blas_thread()
def _static(case: Case, shared: Shared) -> StaticResult:
    """As `solve_static`, with the compliances of an earlier variant where they are the same."""
    from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
    from femgear.gears.deviations import common_period
    from femgear.gears.kinematics import torques

    key = grid_key(case)
    first, new = shared.take(key, lambda: static_stages.solve_static(case, cache=shared.grid_folder(key)))
    if new:
        return first
    gears, deviations = planetary_set(case), set_deviations(case)
    sun_torque = torques(gears, member=case.operation.input, torque=case.operation.torque).sun
    periods, message = common_period(deviations, gears, limit=case.static.longest_record)
    cycle = walk_mesh_cycle(
        gears,
        first.bodies,
        sun_torque=sun_torque,
        positions=gears.equal_positions(case.static.positions),
        contact=case.static.contact,
        deviations=None if deviations.ideal and not case.static.back_flanks else deviations,
        supports=static_supports(case),
        periods=periods,
        options=CycleOptions(both_flanks=case.static.back_flanks),
    )
    check_motions(cycle, gears.sun.module)
    return replace(
        first,
        planetary_set=gears,
        cycle=cycle,
        sun_torque=sun_torque,
        entries=static_entries(case),
        period_message=message,
    )


@one_blas_thread()
def _modal_basis(case: Case, static: StaticResult, shared: Shared) -> ModesResult:
    """As `solve_modes`, with ring and bodies of an earlier variant."""
    first, new = shared.take(model_key(case), lambda: elastic_stages.solve_modes(case, static))
    if new:
        return first
    check_dynamic_case(case, planetary_set(case))
    state = elastic_stages.state_on_supports(case, first.bodies, static.sun_torque)
    if elastic_stages.excitation_reach(case, state, static.sun_torque) != first.reach:
        return elastic_stages.solve_modes(case, static)
    return elastic_stages.modal_basis(
        case, first.ring, first.bodies, state, sun_torque=static.sun_torque, reach=first.reach
    )


@one_blas_thread()
def _response(case: Case, modes: ModesResult) -> Response:
    """As `solve_dynamics` without stability, fields and another look beyond the frequency limit."""
    found = elastic_stages.turning_speeds(case, planetary_set(case))
    check_rim_speed(modes.ring.modes, [s.carrier for s in found])
    frequency = np.array([s.mesh_frequency for s in found])
    return elastic_stages.periodic_response(
        case, modes, frequency, modes.reach, given=case.dynamics.mesh_harmonics
    )[1]


class Shared:
    """What variants share, the latest few of each: flank compliances, and the dynamic model.

    Parameters
    ----------
    cache : path, optional
        Folder of generated grids.
    case : Case
        Only its grids are kept on disk: those of variants of its geometry would fill the folder.
    """

    def __init__(self, case: Case, *, cache: Path | None = None, keep: int = 4):
        self._cache, self._keep = cache, keep
        self._own = grid_key(case)
        self._found: OrderedDict[str, Any] = OrderedDict()

    def take(self, key: str, compute: Callable[[], Any]) -> tuple[Any, bool]:
        """What is kept under a key, else computed now; and whether it is new."""
        new = key not in self._found
        if new:
            self._found[key] = compute()
            if len(self._found) > self._keep:
                self._found.popitem(last=False)
        self._found.move_to_end(key)
        return self._found[key], new

    def grid_folder(self, key: str) -> Path | None:
        """Where grids of a key are kept on disk, if they are."""
        return self._cache if key == self._own else None


def grid_key(case: Case) -> str:
    """Text that two cases share when their flanks have the same compliance."""
    return _key(case, _WITHOUT_GRID, FLANK_ENTRIES | _SOLUTION | _RIGID)


def model_key(case: Case) -> str:
    """Text that two cases share when only deviations of the flanks set their dynamic models apart."""
    return "model " + _key(
        case, {"title", "housing"}, FLANK_ENTRIES | _SOLUTION | {"damping_ratio", "tolerance"}
    )


def _key(case: Case, sections: set[str], entries: frozenset[str]) -> str:
    """Text of a case without some of its sections and entries."""
    data = case.model_dump()
    kept = {
        name: {k: v for k, v in section.items() if k not in entries} if isinstance(section, dict) else section
        for name, section in data.items()
        if name not in sections
    }
    return json.dumps(kept, sort_keys=True, default=str)


class Journal:
    """Records by key, in memory and, with a file, on disk: one JSON line each, appended and forced out.

    A line that a killed process left half written is cut off. Use `open_journal`.

    Parameters
    ----------
    path : path, optional
        Without one nothing is kept on disk.
    """

    def __init__(self, path: Path | None = None):
        self._path = path
        self._stream = None
        self._records: dict[str, dict] = {}

    def __len__(self) -> int:
        return len(self._records)

    def __contains__(self, key: str) -> bool:
        return key in self._records

    def get(self, key: str) -> dict | None:
        """Record of a key, or None."""
        return self._records.get(key)

    def items(self) -> Iterator[tuple[str, dict]]:
        """Keys and records in the order in which they were first written."""
        return iter(self._records.items())

    def add(self, key: str, record: Mapping[str, object]) -> None:
        """Keep a record; one of the same key is replaced."""
        self._records[key] = dict(record)
        self._write({"key": key, "record": self._records[key]})

    def _write(self, line: dict) -> None:
        """Append a line and force it out."""
        if self._stream is None:
            return
        with storage_errors(self._path):
            # a number that is not finite is no JSON, and no result either
            self._stream.write(json.dumps(line, allow_nan=False).encode() + b"\n")
            self._stream.flush()
            os.fsync(self._stream.fileno())

    def _open(self, header: dict) -> None:
        """Read what the file holds, and keep it open for more."""
        with storage_errors(self._path):
            self._stream = open(self._path, "a+b")
            self._stream.seek(0)
            text = self._stream.read()
        whole = text.rfind(b"\n") + 1
        lines = text[:whole].splitlines()
        # a file without a whole line is either the beginning of this header or none of ours
        if not lines and not json.dumps(header).encode().startswith(text):
            raise _broken(self._path, 1)
        if lines:
            _check(_line(lines[0], self._path, 1), header, self._path)
        for number, line in enumerate(lines[1:], 2):
            entry = _line(line, self._path, number)
            if not (isinstance(entry.get("key"), str) and isinstance(entry.get("record"), dict)):
                raise _broken(self._path, number)
            self._records[entry["key"]] = entry["record"]
        if whole < len(text):
            with storage_errors(self._path):
                self._stream.truncate(whole)
        if not lines:
            self._write(header)

    def _close(self) -> None:
        if self._stream is not None:
            self._stream.close()
            self._stream = None


@contextmanager
def open_journal(path: str | os.PathLike | None, case: Case, keys: tuple[str, ...]) -> Iterator[Journal]:
    """A journal for a case and its design variables; while it is open no other process writes into it.

    Parameters
    ----------
    path : path-like, optional
        Created where it does not exist; None keeps records in memory only.
    case : Case
    keys : tuple of str
        Names of the design variables, in the order of the points.

    Raises
    ------
    StorageError
        E-JOURNAL: written for another case, other variables or by another version, or not a journal;
        E-LOCKED: in use.
    """
    if path is None:
        yield Journal()
        return
    path = Path(path)
    header = {"format": FORMAT, "femgear": __version__, "case": fingerprint(case), "keys": list(keys)}
    with storage_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    with exclusive_lock(path.with_name(f".{path.name}.lock")):
        journal = Journal(path)
        try:
            journal._open(header)
            yield journal
        finally:
            journal._close()


def fingerprint(case: Case) -> str:
    """SHA-256 of the text of a case."""
    return hashlib.sha256(to_toml(case).encode()).hexdigest()


def _line(text: bytes, path: Path, number: int) -> dict:
    """One JSON line."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise _broken(path, number) from None
    if not isinstance(found, dict):
        raise _broken(path, number)
    return found


def _broken(path: Path, number: int) -> StorageError:
    return StorageError(
        f"line {number} is no entry of a journal",
        code="E-JOURNAL",
        file=str(path),
        remedy="name a new file; this one is not changed",
    )


def _check(found: dict, header: dict, path: Path) -> None:
    """Refuse a journal whose header is not the expected one."""
    words = {
        "format": "by another version of femgear",
        "femgear": "by another version of femgear",
        "case": "for another case",
        "keys": "for other design variables",
    }
    for name, expected in header.items():
        if found.get(name) != expected:
            raise StorageError(
                f"the journal was written {words[name]}",
                code="E-JOURNAL",
                file=str(path),
                value=found.get(name),
                limit=str(expected),
                remedy="name a new file, or remove this one",
            )
