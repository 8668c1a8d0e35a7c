"""Tolerances of entries of a case file: any number of it, drawn from a law of its own and added to what stands there.

They serve cases without a planetary set of their own, such as gearboxes: clearances and stiffnesses of bearings, axes
of shafts, modifications and errors of teeth. `femgear.study.samples` draws errors tooth by tooth.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, ValidationError, model_validator

from femgear.case import text as case_text
from femgear.case.messages import combine, translate
from femgear.case.quantities import Count, Section
from femgear.errors import CaseError
from femgear.gears.tolerances import CLASSES
from femgear.study.problem import Variable, current_value, split
from femgear.study.quality import limit_of_entry
from femgear.study.samples import share_quantiles
from femgear.trains.reading import with_values

_REACH = 5.0
"""Standard deviations at which a normal law is tried in the case."""
_EXAMPLE = 'key = "bearing[0].clearance"'


def _keys(value: object) -> object:
    return (value,) if isinstance(value, str) else value


def _amount(value: object) -> object:
    """A number with or without unit, or a share in per cent, as text."""
    number, _ = split(value.strip()[:-1] if isinstance(value, str) and value.strip().endswith("%") else value, "")
    if number < 0.0:
        raise CaseError("a spread is no less than 0", code="E-RANGE", value=value, limit=">= 0")
    return value


Amount = Annotated[str | float, BeforeValidator(_amount)]


class EntryTolerance(Section):
    """Law of an entry, or of several that share one draw.

    ``mean``, ``sigma`` and ``limit`` are in a unit of the entry, or shares of its value as ``"10 %"``. A ``quality``,
    the flank tolerance class of ISO 1328-1, stands for sigma and limit of a normal law.
    """

    key: Annotated[tuple[str, ...], BeforeValidator(_keys)]
    distribution: Literal["normal", "uniform"] | None = None
    mean: str | float = 0.0
    sigma: Amount | None = None
    limit: Amount | None = None
    quality: Annotated[int, Count(*CLASSES)] | None = None

    @model_validator(mode="after")
    def _possible(self):
        if self.quality is not None:
            if given := self.given("distribution", "sigma", "limit"):
                message = f"quality stands for {' and '.join(given)}"
                raise CaseError(message, code="E-CHOICE", remedy=f"leave {' and '.join(given)} out, or quality")
            return self
        if self.distribution is None:
            message, remedy = "a tolerance needs its distribution", 'add distribution = "normal", or quality = 6'
            raise CaseError(message, code="E-KEY-MISSING", limit="'normal' or 'uniform'", remedy=remedy)
        needed, other = ("sigma", None) if self.distribution == "normal" else ("limit", "sigma")
        if getattr(self, needed) is None:
            message = f"a {self.distribution} distribution needs its {needed}"
            raise CaseError(message, code="E-KEY-MISSING", remedy=f'add {needed} = "3 um"')
        if other is not None and getattr(self, other) is not None:
            message = "a uniform distribution has no sigma"
            raise CaseError(message, code="E-CHOICE", limit="mean and limit", remedy="leave sigma out")
        return self


class EntryTolerances(Section):
    """File of the tolerances of entries."""

    tolerance: tuple[EntryTolerance, ...] = ()

    @model_validator(mode="after")
    def _some(self):
        if not self.tolerance:
            message, remedy = "no entry has a tolerance", f"give a table [[tolerance]] with {_EXAMPLE}"
            raise CaseError(message, code="E-KEY-MISSING", remedy=remedy)
        return self


@dataclass(frozen=True)
class DrawnEntry:
    """Entries of a case that share one draw.

    Parameters
    ----------
    variable : Variable
        The entries, with the unit of the first.
    value : tuple of float
        What the case has of each, in that unit.
    law : EntryTolerance
        What is added.
    """

    variable: Variable
    value: tuple[float, ...]
    law: EntryTolerance

    def errors(self, share: np.ndarray) -> np.ndarray:
        """Find the errors (n, keys), in the unit of the variable, below which shares (n,) of all lie."""
        law = self.law
        each = [
            share_quantiles(
                share,
                distribution=law.distribution or "normal",
                mean=self._number(law.mean, value),
                sigma=None if law.sigma is None else self._number(law.sigma, value),
                limit=None if law.limit is None else self._number(law.limit, value),
            )
            for value in self.value
        ]
        return np.stack(each, axis=1)

    def _number(self, amount: str | float, value: float) -> float:
        """An amount in the unit of the variable; a share of a value of the case."""
        if isinstance(amount, str) and amount.strip().endswith("%"):
            return split(amount.strip()[:-1], self.variable.name)[0] / 100.0 * abs(value)
        return 0.0 if amount == 0.0 else self.variable.number(amount)

    def texts(self, share: np.ndarray) -> list[tuple[str | float, ...]]:
        """Write the values of all keys at shares (n,), as the case file holds them."""
        values = np.array(self.value) + self.errors(share)
        return [tuple(self.variable.text(float(value)) for value in row) for row in values]


def read_entry_tolerances(path: str | os.PathLike, case: Any) -> tuple[tuple[DrawnEntry, ...], str]:
    """Read the tolerances of a TOML file for a case; the text comes with them.

    CaseError: everything that is wrong with the file; entries that the case leaves out, or that hold no number; values
    within the tolerances that the case refuses.
    """
    text, name = case_text.read_text(path), os.fsdecode(path)
    try:
        tables = EntryTolerances.model_validate(case_text.parse(text, name))
    except ValidationError as error:
        raise combine(translate(error, EntryTolerances), text, name) from None
    problems, entries = list[CaseError](), list[DrawnEntry]()
    for number, law in enumerate(tables.tolerance):
        try:
            entries.append(_drawn_entry(case, law))
        except CaseError as error:
            error.key, error.file = f"tolerance[{number}]", name
            problems.append(error)
    keys = [key for entry in entries for key in entry.variable.keys]
    for key in sorted({key for key in keys if keys.count(key) > 1}):
        message, remedy = "an entry has two tolerances", "keep one of them"
        problems.append(CaseError(message, code="E-DUPLICATE", value=key, remedy=remedy, file=name))
    if not problems:
        problems += _refused_ends(case, entries, name)
    if problems:
        raise combine(problems, text, name)
    return tuple(entries), text


def _drawn_entry(case: Any, law: EntryTolerance) -> DrawnEntry:
    """The entries of a law with their values."""
    variable, values = None, list[float]()
    if law.quality is not None:
        limit = min(limit_of_entry(case, key, law.quality) for key in law.key)
        amounts = {"sigma": f"{1e6 * limit / 3.0!r} um", "limit": f"{1e6 * limit!r} um"}
        law = law.model_copy(update={"distribution": "normal", **amounts})
    for key in law.key:
        raw = current_value(case, key)
        if raw is None:
            raise CaseError(
                "the case leaves this entry out",
                code="E-KEY-MISSING",
                value=key,
                limit="entries that its file gives",
                remedy="write the entry into the case with the value about which it is spread",
            )
        number, unit = split(raw, key)
        higher = f"{number + 1.0!r} {unit}".strip()
        variable = variable or Variable(law.key, f"{number!r} {unit}".strip(), higher)
        values.append(variable.number(raw))
    assert variable is not None
    entry = DrawnEntry(variable, tuple(values), law)
    entry.errors(np.array([0.5]))  # refuses amounts of other units
    return entry


def _refused_ends(case: Any, entries: Sequence[DrawnEntry], name: str) -> Iterator[CaseError]:
    """What the case refuses at the ends of each law, alone."""
    far = 0.5 * math.erfc(_REACH / math.sqrt(2.0))
    for number, entry in enumerate(entries):
        for share in (far, 1.0 - far):
            (texts,) = entry.texts(np.array([share]))
            try:
                with_values(case, dict(zip(entry.variable.keys, texts, strict=True)))
            except CaseError as error:
                for problem in error.problems:
                    if isinstance(problem, CaseError):
                        what = f"within the tolerance: {problem.message}"
                        yield CaseError(
                            what,
                            code=problem.code,
                            key=f"tolerance[{number}]",
                            value=", ".join(map(str, texts)),
                            limit=problem.limit,
                            remedy="give a limit, or a smaller spread",
                            file=name,
                        )
                break


def entry_shares(entries: Sequence[DrawnEntry], seed: int, first: int, count: int) -> np.ndarray:
    """Draw the places (count, entries) of samples ``first`` and on in their laws, from 0 to 1.

    Sample i of a seed is drawn by NumPy's default generator of ``[seed, i]``, whatever other samples are drawn.
    """
    return np.array([np.random.default_rng([seed, first + i]).random(len(entries)) for i in range(count)])


def draw_entries(entries: Sequence[DrawnEntry], seed: int, first: int, count: int) -> list[tuple[str | float, ...]]:
    """Draw samples ``first`` and on: the values of all keys, entry after entry, by `entry_shares`."""
    shares = entry_shares(entries, seed, first, count)
    columns = [entry.texts(shares[:, number]) for number, entry in enumerate(entries)]
    return [tuple(value for part in row for value in part) for row in zip(*columns, strict=True)]
