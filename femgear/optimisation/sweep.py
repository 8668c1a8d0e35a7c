"""Many cases: quantities over all combinations of values of some entries of the case file, resumable."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from femgear.case import Case, with_value
from femgear.errors import CaseError
from femgear.optimisation.designs import Failure, Progress, open_designs
from femgear.optimisation.objectives import Quantity
from femgear.optimisation.variables import Variable
from femgear.threads import one_blas_thread

LARGEST = 100_000
"""Combinations at most."""
_RANGE = re.compile(r"(.+?)\.\.(.+?)/\s*(\d{1,6})\s*", re.DOTALL)


@dataclass(frozen=True)
class Sweep:
    """Quantities of all combinations.

    Parameters
    ----------
    keys : tuple of str
    points : tuple of tuple
        Values as the case file holds them; the last key runs fastest.
    quantities : tuple of Quantity
    values : (points, quantities) array
        [SI]; NaN where a case cannot be computed.
    errors : tuple of str
        Why, one a point; empty where it can.
    computed : int
        Cases computed now; a journal held the others.
    seconds : float
        What a case computed now took on average.
    """

    keys: tuple[str, ...]
    points: tuple[tuple[object, ...], ...]
    quantities: tuple[Quantity, ...]
    values: np.ndarray
    errors: tuple[str, ...]
    computed: int
    seconds: float

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns of `records`, units of quantities in brackets."""
        return (*self.keys, *(f"{q.name} [{q.dimension.si}]" for q in self.quantities), "error")

    def records(self) -> Iterator[tuple[object, ...]]:
        """Rows of a table."""
        for point, values, error in zip(self.points, self.values, self.errors, strict=True):
            yield (*point, *(float(value) for value in values), error)


@one_blas_thread()
def sweep(
    case: Case,
    over: Mapping[str, Sequence[object]],
    quantities: Sequence[Quantity],
    *,
    journal: str | Path | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Quantities of a case over values of entries of its file.

    Parameters
    ----------
    case : Case
    over : mapping of str to sequence
        Values of dotted keys, as the case file would hold them; all combinations are computed.
    quantities : sequence of Quantity
    journal : path-like, optional
        File that keeps every case; an interrupted sweep goes on from it.
    cache, progress
        As for `search.minimise`.

    Returns
    -------
    Sweep

    Raises
    ------
    CaseError
        E-SWEEP: nothing to compute, or too much; values that the case file refuses.
    """
    keys, quantities = tuple(over), tuple(quantities)
    count = check_sweep(case, over, quantities)
    points = tuple(itertools.product(*over.values()))
    table, errors = np.full((count, len(quantities)), np.nan), []
    keyed = [(key,) for key in keys]
    with open_designs(case, keyed, journal=journal, cache=cache) as designs:
        for i, point in enumerate(points):
            try:
                found = designs.values(point, quantities)
                table[i] = [found[quantity.name] for quantity in quantities]
                errors.append("")
            except Failure as failure:
                errors.append(f"[{failure.error['code']}] {failure}")
            if progress is not None:
                progress("cases", i + 1, count)
        seconds = designs.seconds / max(designs.computed, 1)
        return Sweep(keys, points, quantities, table, tuple(errors), designs.computed, seconds)


def check_sweep(case: Case, over: Mapping[str, Sequence[object]], quantities: Sequence[Quantity]) -> int:
    """Number of cases; what `sweep` refuses is refused."""
    count = math.prod(len(values) for values in over.values()) if over else 0
    if not (0 < count <= LARGEST and quantities):
        raise CaseError(
            f"{count} cases with {len(quantities)} quantities",
            code="E-SWEEP",
            limit=f"1 to {LARGEST} cases, at least one quantity",
        )
    for key, values in over.items():
        for value in values:
            with_value(case, key, value)
    return count


def parse_over(text: str) -> tuple[str, list[object]]:
    """Key and values of ``KEY=V1, V2, V3`` or ``KEY=LOW..HIGH/COUNT``.

    Raises
    ------
    CaseError
        E-SWEEP: no key, no values, or a range of less than two.
    """
    key, equals, values = (part.strip() for part in text.partition("="))
    if not (key and equals and values):
        raise _not_over(text)
    if match := _RANGE.fullmatch(values):
        low, high = (_value(part) for part in match.groups()[:2])
        if int(match[3]) < 2:
            raise _not_over(text)
        variable = Variable(key, low, high)
        found = [variable.text(float(x)) for x in np.linspace(*variable.bounds, int(match[3]))]
        return key, found
    found = [_value(part) for part in values.split(",")]
    if any(value == "" for value in found):
        raise _not_over(text)
    return key, found


def _value(text: str) -> object:
    """A value of the command line as the case file holds it: whole number, number, truth value or text."""
    text = text.strip()
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text.strip("\"'")


def _not_over(text: str) -> CaseError:
    return CaseError(
        "not a key with values",
        code="E-SWEEP",
        key="--over",
        value=text,
        limit="KEY=V1,V2,V3 or KEY=LOW..HIGH/COUNT with a count of 2 or more",
        remedy='--over "operation.torque=50 N m, 100 N m" --over "sun.modifications[0].amount=0 um..12 um/7"',
    )
