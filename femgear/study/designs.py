"""Designs of a case, each computed once and kept in a journal, and what they cost in a search.

`Designs` computes quantities of points of the design space, `Evaluations` turns them into the costs that a
search sees, and `tolerances` tells what an optimum loses when its variables are off by their tolerances.

A search that was interrupted goes on from what its `Journal` holds: records by key, one JSON line each with
its number and a checksum, appended and forced out. The first line, the header, says what they belong to.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import pickle
import stat
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from io import FileIO
from pathlib import Path

import numpy as np

from femgear import __version__
from femgear.case.dependencies import Steps
from femgear.case.planetary import Case
from femgear.errors import ContactError, FemgearError, StorageError
from femgear.findings import NOTE, Finding, once, tell
from femgear.stages.key_figures import HOURS
from femgear.stages.protocol import Progress
from femgear.storage.disk_errors import storage_errors
from femgear.storage.files import exclusive_lock
from femgear.study.objectives import STAGES, StudyQuantity, has_figures
from femgear.study.problem import Limit, Point, Problem, Variable, Vector
from femgear.study.runner import Runner, check_complete
from femgear.trains.live import Answer
from femgear.trains.reading import to_toml, with_values

_FORMAT = 2
"""Of journals."""
# what a journal with another entry of the header was written for
_WRITTEN = {
    "format": "by another version of femgear",
    "femgear": "by another version of femgear",
    "case": "for another case",
    "keys": "for other design variables",
    "tolerances": "for other tolerances",
    "seed": "for another seed",
    "method": "for another method",
    "positions": "for other positions",
}
_Fits = Callable[[str, dict], bool]  # tells whether a record belongs to a key
_Values = Callable[[Sequence[StudyQuantity]], Mapping[str, float]]
"""Gives quantities by name [SI], and maybe others."""
OUTSIDE, _REFUSED = 1e6, 1e9
"""Costs from which designs lie outside the limits, and of those that cannot be computed."""


class Journal(dict[str, dict]):
    """Records by key in their order, in memory and, where `open_designs` made it, on disk."""

    def __init__(self, path: Path | None = None, stream: FileIO | None = None, header: dict | None = None):
        super().__init__()
        self._path, self._stream, self._number = path, stream, 0
        self._header = _sealed(header or {})

    def add(self, key: str, record: Mapping[str, object]) -> None:
        """Keep a record; one of the same key is replaced."""
        self[key] = dict(record)
        self._number += 1
        if self._path is not None and self._stream is not None:
            line = {"number": self._number, "key": key, "record": self[key]}
            _append(self._path, self._stream, _sealed(line, self._header))

    def _read(self, path: Path, stream: FileIO, header: dict, fits: _Fits) -> None:
        """Take what the file holds; a line that a killed process left half written is cut off."""
        with storage_errors(path):
            stream.seek(0)
            text = stream.read()
        whole, bad = text.rfind(b"\n") + 1, []
        lines = text[:whole].split(b"\n")[:-1]
        # a file without a whole line is either the beginning of this header or none of ours
        if lines or not self._header.startswith(text):
            _check_header(path, lines[0] if lines else text, header)
        for place, line in enumerate(lines[1:], 2):
            entry = _unsealed(line, self._header)
            # numbers rise, but where lines were copied or moved
            if _is_entry(entry, fits) and entry["number"] > self._number:
                self._number, self[entry["key"]] = entry["number"], entry["record"]
            else:
                bad.append(str(place))
        missing = self._number - len(lines[1:])
        if bad or missing > 0:
            shown = f"line{'s' * (len(bad) > 1)} {', '.join(bad[:9])}" if bad else f"{missing} missing"
            shown += f" and {len(bad) - 9} more" if len(bad) > 9 else ""
            finding = Finding(
                "W-JOURNAL",
                "",
                f"{path}: changed or damaged since it was written: {shown}",
                remedy="what stood there is left out, and computed again where no later line holds it",
            )
            tell(finding)
        if whole < len(text):
            with storage_errors(path):
                stream.truncate(whole)
        if not lines:
            _append(path, stream, self._header)


def _append(path: Path, stream: FileIO, line: bytes) -> None:
    """Append a line and force it out; where that fails, no half of it stays."""
    with storage_errors(path):
        size = os.fstat(stream.fileno()).st_size
        try:
            while line:
                line = line[stream.write(line) or 0 :]
            os.fsync(stream.fileno())
        except OSError:
            with suppress(OSError):
                stream.truncate(size)
            raise


def text_checksum(text: str) -> str:
    """Compute the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


@contextmanager
def open_journal(path: str | Path | None, case: Case, more: dict, fits: _Fits) -> Iterator[Journal]:
    """Open the journal of a case, with further entries of its header; no other process writes into it."""
    if path is None:
        yield Journal()
        return
    header = {"format": _FORMAT, "femgear": __version__, "case": text_checksum(to_toml(case)), **more}
    path = Path(path)
    with storage_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    with exclusive_lock(path.with_name(f".{path.name}.lock")):
        with storage_errors(path):
            if os.path.lexists(path) and not stat.S_ISREG(path.lstat().st_mode):
                raise _broken(path, "it is no regular file")
            # unbuffered, so that what could not be written is not written later
            stream = open(path, "a+b", buffering=0)
        with stream:
            journal = Journal(path, stream, header)
            journal._read(path, stream, header, fits)
            yield journal


def _sealed(line: dict, header: bytes = b"") -> bytes:
    """Write a table as a line of JSON that ends with a checksum of the header and what stands before it."""
    # a number that is not finite is no JSON, and no result either
    text = json.dumps(line, allow_nan=False)[:-1].encode()
    return text + b', "checksum": "' + _check(header + text) + b'"}\n'


def _unsealed(line: bytes, header: bytes = b"") -> dict:
    """Read a line that `_sealed` wrote under the same header; an empty table from any other."""
    text, _, check = line.rpartition(b', "checksum": "')
    if check != _check(header + text) + b'"}':
        return {}
    try:
        entry = json.loads(text + b"}")
    except (ValueError, RecursionError):
        return {}
    return entry if isinstance(entry, dict) else {}


def _check(text: bytes) -> bytes:
    """Compute a checksum of sixteen digits."""
    return hashlib.sha256(text).hexdigest()[:16].encode()


def _check_header(path: Path, line: bytes, header: dict) -> None:
    """Refuse the journal whose first line is another one."""
    if line + b"\n" == _sealed(header):
        return
    entry = _unsealed(line)
    for name, expected in header.items():
        if entry and entry.get(name) != expected:
            raise StorageError(
                f"the journal was written {_WRITTEN[name]}",
                code="E-JOURNAL",
                file=str(path),
                value=entry.get(name),
                limit=str(expected),
                remedy="name a new place, or move this file away",
            )
    raise _broken(path, "its first line is not what this version of femgear writes there")


def _broken(path: Path, why: str) -> StorageError:
    """Make the refusal of a file that is no journal."""
    return StorageError(
        f"not usable as a journal: {why}",
        code="E-JOURNAL",
        file=str(path),
        remedy="name a new place, or move this file away; it is not changed",
    )


def _is_entry(line: dict, fits: _Fits) -> bool:
    """Tell whether a line has a number, a key and a record that belongs to it."""
    key, record = line.get("key"), line.get("record")
    if not (type(line.get("number")) is int and isinstance(key, str) and isinstance(record, dict)):
        return False
    try:
        return fits(key, record)
    except (ValueError, RecursionError, KeyError, AttributeError, TypeError):
        return False


def _is_design(count: int, key: str, record: dict) -> bool:
    """Tell whether a record is what `Designs` or `search.signals` keep of so many variables."""
    if not key.startswith("["):
        value, slopes = (np.array(record[name]) for name in ("value", "slopes"))
        fits = value.ndim == 2 and slopes.shape == (count, *value.shape)
        return bool(fits and np.isfinite(value).all() and np.isfinite(slopes).all())
    point, values = json.loads(key), record["values"].values()
    error = record.get("error", {"code": "", "key": None, "message": ""})
    texts = (error["code"], error["message"], "" if error["key"] is None else error["key"])
    texts += tuple(code for codes in record.get("doubts", {}).values() for code in codes)
    return (
        len(point) in (0, count)
        and all(value is None or (type(value) is float and math.isfinite(value)) for value in values)
        and all(isinstance(text, str) for text in texts)
    )


class Failure(Exception):
    """A design that cannot be computed; ``error`` holds code, key and message of the refusal."""

    def __init__(self, error: dict):
        super().__init__(error["message"])
        self.error = error


class Designs:
    """Quantities of designs; use `open_designs`.

    Attributes
    ----------
    seconds : float
        What the designs computed now took, all together.
    telling : bool
        Whether findings that concern the quantities are looked for and kept: `doubts`.
    """

    def __init__(
        self,
        case: Case,
        keys,
        journal: Journal,
        *,
        cache: Path | None = None,
        progress: Progress | None = None,
        runner: Runner | None = None,
        telling: bool = False,
    ):
        self.telling = telling
        self.case, self.journal, self.runner = case, journal, runner or Runner()
        self.seconds = 0.0
        self._computed: set[str] = set()
        self._keys, self._progress = keys, progress
        # grids of other geometries are not left in the folder
        self._first = Answer(case, Steps(), cache=cache)
        self._last = json.dumps(()), self._first
        self._packed = pickle.dumps((case, keys, cache, telling))

    def __reduce__(self):
        return _designs, (self._packed,)

    @property
    def computed(self) -> int:
        """Designs computed now, without those that the journal held."""
        return len(self._computed)

    @property
    def failures(self) -> list[tuple[Point, dict]]:
        """Points that could not be computed, and why."""
        return [
            (tuple(json.loads(key)), record["error"])
            for key, record in self.journal.items()
            if key.startswith("[") and "error" in record
        ]

    def at(self, point: Point) -> Case:
        """Set the values of a point in the case."""
        if not point:
            return self.case
        pairs = zip(self._keys, point, strict=True)
        return with_values(self.case, {key: value for keys, value in pairs for key in keys})

    def answer(self, point: Point) -> Answer:
        """Give the stages of a point; those of the last one are kept for further questions."""
        key = json.dumps(point)
        if self._last[0] != key:
            self._last = key, self._first.of(self.at(point))
        return self._last[1]

    def values(self, point: Point, quantities: Sequence[StudyQuantity]) -> dict[str, float]:
        """Compute quantities at a point, by name [SI].

        Failure: the design cannot be computed, now or when it was tried before; FemgearError: nor can the
        case as it is.
        """
        key, ask = json.dumps(point), partial(_ask, tuple(quantities), ())
        if self._lacks(key, ask):
            self._store(key, self.record(ask, (point, self._known(key))), 1)
        # what was known before it failed still holds
        values = self._known(key)
        if any(quantity.name not in values for quantity in quantities):
            raise Failure(self.journal[key]["error"])
        return {q.name: values[q.name] for q in quantities}

    def doubts(self, point: Point, quantities: Sequence[StudyQuantity]) -> dict[str, list[str]]:
        """Codes of the doubts and faults that concern quantities at a point that was computed, by name."""
        doubts = self.journal.get(json.dumps(point), {}).get("doubts", {})
        return {quantity.name: doubts.get(quantity.name, []) for quantity in quantities}

    def findings(self, quantities: Sequence[StudyQuantity], point: Point) -> tuple[Finding, ...]:
        """List the doubts and faults of a design that can be computed, each once.

        Those that concern the quantities, and those of the contact and of the stresses that they come from.
        """
        answer, stages = self.answer(point), {quantity.stage for quantity in quantities}
        findings = [finding for quantity in quantities for finding in quantity.findings(answer)]
        if stages - {"gears"} and not has_figures(self.case):
            findings += answer.static.findings
        if "stress" in stages:
            findings += answer.stress.findings
        return once(finding for finding in findings if finding.severity != NOTE)

    def ahead(
        self, points: Iterable[Point], quantities: Sequence[StudyQuantity], limits: Sequence[Limit] = ()
    ) -> Iterator[int]:
        """Compute quantities of many points, of those within limits, and count after each those known.

        FemgearError: a point has neither values nor an error at the end (E-INCOMPLETE).
        """
        tasks, ask = {json.dumps(point): point for point in points}, partial(_ask, quantities, limits)
        left = [key for key in tasks if self._lacks(key, ask)]
        yield len(tasks) - len(left)
        items = ((tasks[key], self._known(key)) for key in left)
        for done, (index, outcome) in enumerate(self.runner.map(partial(self.record, ask), items), 1):
            if isinstance(outcome, FemgearError):
                outcome = {"values": self._known(left[index]), "error": _told(outcome), "seconds": 0.0}
            self._store(left[index], outcome, len(left) - done)
            yield len(tasks) - len(left) + done
        check_complete(tasks, {key for key in tasks if not self._lacks(key, ask)})

    def record(self, ask: Callable[[_Values], None], task: tuple[Point, Mapping[str, float]]) -> dict:
        """Record of a point of which some values are known, with what is asked or the reason why not."""
        (point, known_values), start = task, time.perf_counter()
        numbers, doubts = dict(known_values), dict[str, list[str]]()

        def values(quantities: Sequence[StudyQuantity]) -> dict[str, float]:
            missing = [quantity for quantity in quantities if quantity.name not in numbers]
            for quantity in sorted(missing, key=lambda q: STAGES.index(q.stage)):
                numbers[quantity.name] = float(_finite(quantity, quantity.compute(self.answer(point))))
            for quantity in quantities if self.telling else ():
                doubts[quantity.name] = quantity.doubts(self.answer(point))
            return numbers

        record: dict = {"values": numbers}
        try:
            ask(values)
        except StorageError:
            raise
        except FemgearError as error:
            if not point:
                raise
            record["error"] = _told(error)
        record |= {"doubts": doubts} if self.telling else {}
        # a life without end is null: JSON has no infinity
        record["values"] = {name: None if math.isinf(value) else value for name, value in numbers.items()}
        return record | {"seconds": round(time.perf_counter() - start, 3)}

    def _known(self, key: str) -> dict[str, float]:
        values = self.journal.get(key, {}).get("values", {})
        return {name: math.inf if value is None else value for name, value in values.items()}

    def _lacks(self, key: str, ask: Callable[[_Values], None]) -> bool:
        """Tell whether a point that has not failed lacks what is asked."""
        numbers, record = self._known(key), self.journal.get(key, {})
        doubts = record.get("doubts", {})

        def values(quantities: Sequence[StudyQuantity]) -> dict[str, float]:
            if self.telling and not all(quantity.name in doubts for quantity in quantities):
                raise KeyError
            return {quantity.name: numbers[quantity.name] for quantity in quantities}

        try:
            ask(values)
        except KeyError:
            return "error" not in record
        return False

    def _store(self, key: str, record: dict, left: int) -> None:
        self.seconds += record["seconds"]
        self._computed.add(key)
        if self.telling:
            before = self.journal.get(key, {}).get("doubts", {})
            record = record | {"doubts": before | record.get("doubts", {})}
        self.journal.add(key, record)
        if self._progress is not None:
            self._progress("designs", self.computed, self.computed + left)


@lru_cache(maxsize=1)
def _designs(packed: bytes) -> Designs:
    """The designs of a worker, which keeps from task to task what they share."""
    case, keys, grids, telling = pickle.loads(packed)
    return Designs(case, keys, Journal(), cache=grids, telling=telling)


def _told(error: FemgearError) -> dict:
    return {"code": error.code, "key": error.key, "message": error.message}


def _ask(quantities: Sequence[StudyQuantity], limits: Sequence[Limit], values: _Values) -> None:
    """Ask for quantities of a design within limits, elsewhere for those of the limits alone."""
    if not _violation(limits, values):
        values(quantities)


def _violation(limits: Sequence[Limit], values: _Values) -> float:
    """Sum the relative violations of limits of the first stage that breaks any."""
    for stage in STAGES:
        here = [limit for limit in limits if limit.quantity.stage == stage]
        values_of = values([limit.quantity for limit in here]) if here else {}
        if total := sum(limit.violation(values_of[limit.quantity.name]) for limit in here):
            return total
    return 0.0


def _finite(quantity: StudyQuantity, value: float) -> float:
    """The value, refused where it is no number; a life has no end where nothing does damage."""
    if math.isnan(value) or (math.isinf(value) and quantity.dimension is not HOURS):
        message = f"{quantity.name} is not finite"
        raise ContactError(message, code="E-FINITE", value=value, limit="finite numbers")
    return value


@contextmanager
def open_designs(
    case: Case,
    keys: Sequence[tuple[str, ...]],
    *,
    journal: str | Path | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
    runner: Runner | None = None,
    telling: bool = False,
) -> Iterator[Designs]:
    """Open the designs of a case, with a journal on disk where one is named.

    Parameters
    ----------
    keys : sequence of tuple of str
        Entries of the case file that every value of a point sets.
    journal, cache, progress, runner
        As for `search.minimise`; only grids of the case itself are kept.
    telling : bool
        Look for findings that concern the quantities, see `Designs.doubts`.

    Raises
    ------
    StorageError
        E-JOURNAL: written for another case, other variables or by another version, or no journal;
        E-LOCKED: in use.
    """
    more = {"keys": [" = ".join(entries) for entries in keys]}
    with open_journal(journal, case, more, partial(_is_design, len(keys))) as records:
        yield Designs(case, tuple(keys), records, cache=cache, progress=progress, runner=runner, telling=telling)


class Enough(Exception):
    """The search has asked for as many designs as it may."""


class Evaluations:
    """Costs of designs as a search sees them; points x are (n,) in the units of the variables.

    Use `evaluations`.

    Attributes
    ----------
    best : (x, cost)
        The best point of the objective so far; infinite cost before any.
    course : list of float
        Objective [SI] of every different point of `cost`; NaN outside the limits.
    """

    def __init__(self, problem: Problem, designs: Designs, *, max_designs: int | None = None):
        self.problem, self.designs = problem, designs
        self.best = np.full(len(problem.variables), np.nan), np.inf
        self.course: list[float] = []
        # a dict keeps their order
        self._requested: dict[tuple, None] = {}
        self._most = max_designs

    def towards(self, objective: StudyQuantity) -> Evaluations:
        """Give the same designs, counted together, another objective."""
        alike = Evaluations(replace(self.problem, objective=objective), self.designs, max_designs=self._most)
        alike._requested = self._requested
        return alike

    @property
    def requested(self) -> int:
        """Different points that were asked for, whether the journal held them or not."""
        return len(self._requested)

    @property
    def requested_points(self) -> list[tuple]:
        """These points but for the case as it is, in their order."""
        return [point for point in self._requested if point]

    def values(self, x: Vector | None, quantities: Sequence[StudyQuantity]) -> dict[str, float]:
        """Compute quantities [SI] at a point x (n,), or of the case as it is; see `Designs`."""
        point = () if x is None else self.problem.point(x)
        self._requested[point] = None
        return self.designs.values(point, quantities)

    def cost(self, x: Vector) -> float:
        """Compute the objective over that of the case; designs outside the limits cost a million and more.

        Limits are looked at first, those from the fewest stages before the others: the objective of a design
        outside them is not computed (feasible designs before others, by violation: K. Deb, Comput. Methods
        Appl. Mech. Engrg. 186, 2000, 311-338). What cannot be computed costs a thousand times more. `Enough`:
        all designs that the search was given have been asked for.
        """
        new = self.count(x)
        objective, scale = self.problem.objective, self.scale(self.problem.objective)
        cost = self.penalised(x, lambda: self.values(x, [objective])[objective.name] / scale)
        if new:
            self.course.append(cost * scale if cost < OUTSIDE else math.nan)
        if cost < self.best[1]:
            self.best = np.array(x, float), cost
        return cost

    def ahead(self, places: Iterable[Vector], also: Sequence[StudyQuantity] = ()) -> None:
        """Compute at once what `cost` will ask of many points, and further quantities."""
        points = dict.fromkeys(self.problem.point(x) for x in places)
        new = [point for point in points if point not in self._requested]
        room = None if self._most is None else max(self._most - self.requested, 0)
        quantities = (self.problem.objective, *also)
        deque(self.designs.ahead(new[:room], quantities, self.problem.limits), 0)

    def count(self, x: Vector) -> bool:
        """Note that a point x (n,) is asked for, and say whether it is new; may raise `Enough`."""
        point = self.problem.point(x)
        new = point not in self._requested
        if self._most is not None and new and self.requested >= self._most:
            raise Enough
        self._requested[point] = None
        return new

    def penalised(self, x: Vector, value) -> float:
        """Compute ``value()`` of a design x (n,) within the limits; elsewhere it has the costs that `cost` names."""
        try:
            outside = self.violation(x)
            return min(OUTSIDE + outside, 0.5 * _REFUSED) if outside else value()
        except Failure:
            return _REFUSED

    def violation(self, x: Vector) -> float:
        """Sum the relative violations of limits of the first stage that breaks any, at a point x (n,).

        May raise `Failure`.
        """
        return _violation(self.problem.limits, lambda quantities: self.values(x, quantities))

    def scale(self, quantity: StudyQuantity) -> float:
        """Find the value [SI] of the case as it is, by which costs are divided; 1 where it is zero."""
        return abs(self.values(None, [quantity])[quantity.name]) or 1.0


@contextmanager
def evaluations(problem: Problem, *, max_designs: int | None = None, **options) -> Iterator[Evaluations]:
    """Open the evaluations of a problem, of so many designs at most; options as for `open_designs`."""
    with open_designs(problem.case, [variable.keys for variable in problem.variables], **options) as designs:
        yield Evaluations(problem, designs, max_designs=max_designs)


@dataclass(frozen=True)
class Tolerance:
    """Quantities with one variable off by its tolerance.

    Parameters
    ----------
    variable : Variable
        Which one.
    tolerance : float
        In the unit of the variable.
    less, more : dict
        Value of every quantity by name [SI] with the variable lower and higher; NaN where that cannot be
        computed.
    """

    variable: Variable
    tolerance: float
    less: dict[str, float]
    more: dict[str, float]

    def slope(self, name: str, value: float) -> tuple[float, float]:
        """Compute how a quantity rises from its value [SI] per unit of the variable, towards less and more.

        Both are positive at a corner, where a derivative does not exist.
        """
        return (self.less[name] - value) / self.tolerance, (self.more[name] - value) / self.tolerance


def tolerances(
    evaluations: Evaluations, x: Vector, quantities: Sequence[StudyQuantity]
) -> tuple[tuple[Tolerance, ...], dict[str, float]]:
    """Compute quantities with every variable off by its tolerance, alone and all at once.

    The optimum x (n,) is in the units of the variables; points beside it may lie outside the bounds. The
    first quantity says which side of a variable is the worse one; the last result holds the quantities [SI]
    by name with all variables off to their worse sides, NaN where they have none.
    """
    x, spread, problem = np.array(x, float), [], evaluations.problem
    worse = x.copy()
    widths = [variable.tolerance_at(float(value)) for variable, value in zip(problem.variables, x)]
    places = x + np.array([sign * row for row in np.diag(widths) for sign in (-1.0, 1.0)])
    deque(evaluations.designs.ahead(map(problem.point, places), quantities), 0)
    for i, (variable, tolerance) in enumerate(zip(problem.variables, widths)):
        sides = [_values(evaluations, off, quantities) for off in places[2 * i : 2 * i + 2]]
        spread.append(Tolerance(variable, tolerance, *sides))
        objective = [side[quantities[0].name] for side in sides]
        # a side that cannot be computed is no place to go
        if np.isfinite(objective).any():
            worse[i] += (-tolerance, tolerance)[int(np.nanargmax(objective))]
    return tuple(spread), _values(evaluations, worse, quantities)


def _values(evaluations: Evaluations, x, quantities) -> dict[str, float]:
    """Quantities by name at a point; NaN where it cannot be computed."""
    try:
        return evaluations.values(x, quantities)
    except Failure:
        return {quantity.name: np.nan for quantity in quantities}
