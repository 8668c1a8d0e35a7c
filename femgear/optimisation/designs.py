"""Numbers of the designs of a case, each computed once and kept in a journal."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from femgear.case import Case, with_values
from femgear.errors import ContactError, FemgearError, StorageError
from femgear.optimisation.journal import Journal, open_journal
from femgear.optimisation.objectives import STAGES, Quantity
from femgear.optimisation.variants import Shared, Variant

Progress = Callable[[str, float, float], None]
Point = tuple[object, ...]
"""Values of the design variables as the case file holds them; empty for the case as it is."""


class Failure(Exception):
    """A design that cannot be computed; ``error`` holds code, key and message of the refusal."""

    def __init__(self, error: dict):
        super().__init__(error["message"])
        self.error = error


class Designs:
    """Quantities of designs; use `open_designs`.

    Attributes
    ----------
    case : Case
    journal : Journal
    seconds : float
        What the designs computed now took, all together.
    """

    def __init__(self, case: Case, keys, journal: Journal, *, cache: Path | None, progress: Progress | None):
        self.case, self.journal = case, journal
        self.seconds = 0.0
        self._computed: set[str] = set()
        self._keys = keys
        self._shared = Shared(case, cache=cache)
        self._progress = progress
        self._last: tuple[str, Variant] | None = None

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
        """The case at a point."""
        if not point:
            return self.case
        pairs = zip(self._keys, point, strict=True)
        return with_values(self.case, {key: value for keys, value in pairs for key in keys})

    def variant(self, point: Point) -> Variant:
        """The stages of a point; those of the last one are kept for further questions."""
        key = json.dumps(point)
        if self._last is None or self._last[0] != key:
            self._last = key, Variant(self.at(point), self._shared)
        return self._last[1]

    def values(self, point: Point, quantities: Sequence[Quantity]) -> dict[str, float]:
        """Quantities at a point, by name, in SI units.

        Raises
        ------
        Failure
            The design cannot be computed, now or when it was tried before.
        FemgearError
            The case as it is cannot be computed.
        """
        key = json.dumps(point)
        record = self.journal.get(key) or {"values": {}}
        missing = [q for q in quantities if q.name not in record["values"]]
        # what was known before it failed still holds
        if missing and "error" not in record:
            record = self._compute(key, point, missing, record["values"])
            missing = [q for q in missing if q.name not in record["values"]]
        if missing:
            raise Failure(record["error"])
        return {q.name: record["values"][q.name] for q in quantities}

    def _compute(self, key: str, point: Point, missing: Sequence[Quantity], known: dict) -> dict:
        start, found = time.perf_counter(), dict(known)
        record: dict = {"values": found}
        try:
            variant = self.variant(point)
            for quantity in sorted(missing, key=lambda q: STAGES.index(q.stage)):
                found[quantity.name] = _finite(quantity, quantity.compute(variant))
        except StorageError:
            raise
        except FemgearError as error:
            if not point:
                raise
            record["error"] = {"code": error.code, "key": error.key, "message": error.message}
        seconds = time.perf_counter() - start
        self.seconds += seconds
        self._computed.add(key)
        self.journal.add(key, record | {"seconds": round(seconds, 3)})
        if self._progress is not None:
            self._progress("designs", self.computed, self.computed + 1)
        return record


def _finite(quantity: Quantity, value: float) -> float:
    if not math.isfinite(value):
        raise ContactError(f"{quantity.name} is not finite", code="E-FINITE", value=value)
    return value


@contextmanager
def open_designs(
    case: Case,
    keys: Sequence[tuple[str, ...]],
    *,
    journal: str | Path | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> Iterator[Designs]:
    """Designs of a case, with a journal on disk where one is named.

    Parameters
    ----------
    case : Case
    keys : sequence of tuple of str
        Entries of the case file that every value of a point sets.
    journal : path-like, optional
        File of the records; an interrupted search goes on from them.
    cache : path, optional
        Folder of generated grids; only those of the case itself are kept.
    progress : callable, optional
        Called with (stage, done, total).

    Raises
    ------
    StorageError
        See `journal.open_journal`.
    """
    with open_journal(journal, case, tuple(" = ".join(names) for names in keys)) as records:
        yield Designs(case, tuple(keys), records, cache=cache, progress=progress)
