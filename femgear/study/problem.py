"""A problem of optimisation, and the numbers of its designs, each computed once and kept in a journal.

`Problem` says what to minimise within which limits, `Designs` computes quantities of points of the design
space, `Evaluations` turns them into the costs that a search sees.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from femgear.case.sections import Case
from femgear.errors import CaseError, ContactError, FemgearError, StorageError
from femgear.study.objectives import STAGES, Quantity
from femgear.study.variables import Variable, check_variables
from femgear.study.variants import Journal, Shared, Variant, open_journal
from femgear.trains.protocol import Progress
from femgear.trains.reading import with_values

Point = tuple[object, ...]
"""Values of the design variables as the case file holds them; empty for the case as it is."""
OUTSIDE, _REFUSED = 1e6, 1e9
"""Costs from which designs lie outside the limits, and of those that cannot be computed."""


@dataclass(frozen=True)
class Limit:
    """What a quantity may be, in SI units.

    Parameters
    ----------
    quantity : Quantity
    low, high : float, optional
        At least one of them.
    """

    quantity: Quantity
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self):
        finite = math.isfinite(self.low) or math.isfinite(self.high)
        if not (finite and self.low <= self.high):
            raise CaseError(
                "a limit needs a lower or an upper bound",
                code="E-LIMIT",
                key=self.quantity.name,
                value=f"{self.low} to {self.high}",
                limit=f"numbers in {self.quantity.dimension.si}, low <= high",
            )

    def violation(self, value: float) -> float:
        """How far a value lies outside, over the size of the bound; 0 inside."""
        out = max(self.low - value, value - self.high, 0.0)
        bound = self.low if value < self.low else self.high
        return out / (abs(bound) or 1.0) if out > 0 else 0.0

    @property
    def text(self) -> str:
        """As ``contact ratio, sun-planet >= 1.3``."""
        show = self.quantity.show
        parts = [f">= {show(self.low)}"] * math.isfinite(self.low)
        parts += [f"<= {show(self.high)}"] * math.isfinite(self.high)
        return f"{self.quantity.name} {' and '.join(parts)}"


@dataclass(frozen=True)
class Problem:
    """What to minimise, by changing what, within which limits.

    Parameters
    ----------
    case : Case
        Its positions, flank elements and harmonics are those of the search; a coarse one is fast.
    variables : sequence of Variable
    objective : Quantity
    also : sequence of Quantity
        Reported of the case and of the optimum as well.
    limits : sequence of Limit

    Raises
    ------
    CaseError
        Keys that the case file does not know, bounds that it refuses, a quantity twice.
    """

    case: Case
    variables: Sequence[Variable]
    objective: Quantity
    also: Sequence[Quantity] = ()
    limits: Sequence[Limit] = ()

    def __post_init__(self):
        for name in ("variables", "also", "limits"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        check_variables(self.case, self.variables)

    @property
    def reported(self) -> tuple[Quantity, ...]:
        """Objective, further quantities and those of the limits, each once."""
        every = (self.objective, *self.also, *(limit.quantity for limit in self.limits))
        return tuple({quantity.name: quantity for quantity in every}.values())

    @property
    def bounds(self) -> np.ndarray:
        """Bounds in the units of the variables, (n, 2)."""
        return np.array([variable.bounds for variable in self.variables])

    def point(self, x: Sequence[float]) -> tuple[str | float | int, ...]:
        """Values of the variables as the case file holds them."""
        return tuple(variable.text(float(value)) for variable, value in zip(self.variables, x, strict=True))


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
        """Record of a point with the missing quantities, or with the reason why it has none."""
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
    """The value, refused where it is no number."""
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
        See `variants.open_journal`.
    """
    with open_journal(journal, case, tuple(" = ".join(names) for names in keys)) as records:
        yield Designs(case, tuple(keys), records, cache=cache, progress=progress)


class Enough(Exception):
    """The search has asked for as many designs as it may."""


class Evaluations:
    """Costs of designs as a search sees them; use `evaluations`.

    Attributes
    ----------
    problem : Problem
    designs : Designs
    best : (x, cost) or None
        The best point of the objective so far.
    course : list of float
        Objective [SI] of every different point of `cost`; NaN outside the limits.
    """

    def __init__(self, problem: Problem, designs: Designs, *, max_designs: int | None = None):
        self.problem, self.designs = problem, designs
        self.best: tuple[np.ndarray, float] | None = None
        self.course: list[float] = []
        # a dict keeps their order
        self._asked: dict[tuple, None] = {}
        self._most = max_designs

    def towards(self, objective: Quantity) -> Evaluations:
        """The same designs, counted together, under another objective."""
        found = Evaluations(replace(self.problem, objective=objective), self.designs, max_designs=self._most)
        found._asked = self._asked
        return found

    @property
    def asked(self) -> int:
        """Different points that were asked for, whether the journal held them or not."""
        return len(self._asked)

    @property
    def asked_points(self) -> list[tuple]:
        """These points but for the case as it is, in their order."""
        return [point for point in self._asked if point]

    def values(self, x: Sequence[float] | None, quantities: Sequence[Quantity]) -> dict[str, float]:
        """Quantities at a point in the units of the variables, or of the case as it is; see `Designs`."""
        point = () if x is None else self.problem.point(x)
        self._asked[point] = None
        return self.designs.values(point, quantities)

    def cost(self, x: Sequence[float]) -> float:
        """The objective over that of the case; designs outside the limits cost a million and more.

        Limits are looked at first, those from the fewest stages before the others: the objective of a design
        outside them is not computed (feasible designs before others, by violation: K. Deb, Comput. Methods
        Appl. Mech. Engrg. 186, 2000, 311-338). What cannot be computed costs a thousand times more.

        Raises
        ------
        Enough
            All designs that the search was given have been asked for.
        """
        new = self.count(x)
        objective, scale = self.problem.objective, self.scale(self.problem.objective)
        found = self.penalised(x, lambda: self.values(x, [objective])[objective.name] / scale)
        if new:
            self.course.append(found * scale if found < OUTSIDE else math.nan)
        if self.best is None or found < self.best[1]:
            self.best = np.array(x, float), found
        return found

    def count(self, x: Sequence[float]) -> bool:
        """Note that a point is asked for, and say whether it is new; may raise `Enough`."""
        point = self.problem.point(x)
        new = point not in self._asked
        if self._most is not None and new and self.asked >= self._most:
            raise Enough
        self._asked[point] = None
        return new

    def penalised(self, x: Sequence[float], value) -> float:
        """``value()`` of a design within the limits, and the costs that `cost` names elsewhere."""
        try:
            outside = self.violation(x)
            return min(OUTSIDE + outside, 0.5 * _REFUSED) if outside else value()
        except Failure:
            return _REFUSED

    def violation(self, x: Sequence[float]) -> float:
        """Sum of the violations of the limits, of the first stage that breaks any. May raise `Failure`."""
        for stage in STAGES:
            here = [limit for limit in self.problem.limits if limit.quantity.stage == stage]
            values = self.values(x, [limit.quantity for limit in here]) if here else {}
            total = sum(limit.violation(values[limit.quantity.name]) for limit in here)
            if total:
                return total
        return 0.0

    def scale(self, quantity: Quantity) -> float:
        """Value of the case as it is, by which costs are divided; 1 where it is zero."""
        return abs(self.values(None, [quantity])[quantity.name]) or 1.0


@contextmanager
def evaluations(
    problem: Problem,
    *,
    journal: str | Path | None = None,
    cache: Path | None = None,
    max_designs: int | None = None,
    progress: Progress | None = None,
) -> Iterator[Evaluations]:
    """Evaluations of a problem; parameters as for `open_designs`."""
    keys = [variable.key for variable in problem.variables]
    with open_designs(problem.case, keys, journal=journal, cache=cache, progress=progress) as designs:
        yield Evaluations(problem, designs, max_designs=max_designs)
