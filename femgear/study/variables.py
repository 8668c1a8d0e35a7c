"""Design variables: entries of the case file that an optimiser may change, with bounds in their unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.case import text
from femgear.case.sections import Case
from femgear.case.units import Dimension, to_si
from femgear.errors import CaseError
from femgear.trains.reading import with_values

DEFAULT_TOLERANCE = 0.1
"""Over the range of the variable."""
FLANK_ENTRIES = frozenset({"modifications", "errors", "individual", "pin_errors"})
"""Entries that do nothing but separate flanks: no grid knows them, and derivatives reach them."""
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_DIGITS = 9


@dataclass(frozen=True)
class Variable:
    """One design variable.

    Parameters
    ----------
    key : str or sequence of str
        Dotted key of the case file, as `femgear.with_value` takes it; of several all get the same value.
    low, high : str, float or int
        Bounds, as the case file would hold them: ``"0 um"`` and ``"40 um"``, or numbers without dimension.
    tolerance : str or float, optional
        What the value may be off by when the part is made, with its unit or as ``"10 %"`` of the value; the
        sensitivity of an optimum is what it costs. A tenth of the range when left out.
    integer : bool
        Whole numbers only, as numbers of teeth.

    Raises
    ------
    CaseError
        E-VARIABLE: bounds that are no numbers or in the wrong order; E-UNIT: units that do not match.
    """

    key: str | Sequence[str]
    low: str | float
    high: str | float
    tolerance: str | float | None = None
    integer: bool = False

    def __post_init__(self):
        keys = (self.key,) if isinstance(self.key, str) else tuple(self.key)
        object.__setattr__(self, "key", keys)
        if not keys:
            raise CaseError("a design variable needs a key", code="E-VARIABLE", remedy='"sun.profile_shift"')
        self._check_units()
        low, high = self.bounds
        if not low < high:
            raise CaseError(
                "the bounds of a design variable are in the wrong order",
                code="E-VARIABLE",
                key=self.name,
                value=f"{self.low} to {self.high}",
                limit="low < high",
            )
        if self.integer and (self.unit or low != round(low) or high != round(high)):
            raise CaseError(
                "bounds of whole numbers are whole numbers",
                code="E-VARIABLE",
                key=self.name,
                value=f"{self.low} to {self.high}",
            )
        if not self.tolerance_at(high) > 0:
            raise CaseError("a tolerance is over 0", code="E-VARIABLE", key=self.name, value=self.tolerance)

    def _check_units(self) -> None:
        """Refuse bounds of which one has a unit."""
        (_, first), (_, second) = (split(bound, self.name) for bound in (self.low, self.high))
        if bool(first) != bool(second):
            unit = first or second
            low, high = (
                bound if has else f"{bound} {unit}" for bound, has in ((self.low, first), (self.high, second))
            )
            raise CaseError(
                "one bound has a unit and the other has none", code="E-UNIT", key=self.name,
                value=f"{self.low}..{self.high}", limit="the same kind of unit at both bounds",
                remedy=f'write "{low}..{high}"',
            )  # fmt: skip

    @property
    def name(self) -> str:
        """Its keys as one text."""
        return " = ".join(self.key)

    @property
    def unit(self) -> str:
        """Unit of the lower bound; empty for a number."""
        return split(self.low, self.name)[1]

    @property
    def bounds(self) -> tuple[float, float]:
        """Both bounds in `unit`."""
        return split(self.low, self.name)[0], self.number(self.high)

    def number(self, value: str | float) -> float:
        """A value as the case file holds it, as a number in `unit`.

        Raises
        ------
        CaseError
            E-UNIT: a unit of another dimension, or none.
        """
        number, unit = split(value, self.name)
        if unit == self.unit:
            return number
        if not (unit and self.unit):
            raise CaseError(
                "values of a design variable have one unit",
                code="E-UNIT",
                key=self.name,
                value=value,
                limit=f"a number with {self.unit}" if self.unit else "a number without unit",
            )
        try:
            return to_si(str(value), Dimension("a value", self.unit, self.unit, 1.0))
        except CaseError as error:
            error.key = self.name
            raise

    def text(self, number: float) -> str | float | int:
        """A number in `unit` as the case file holds it, with nine digits."""
        if self.integer:
            return round(number)
        rounded = float(f"{number:.{_DIGITS}g}") + 0.0
        return f"{rounded:.{_DIGITS}g} {self.unit}" if self.unit else rounded

    def tolerance_at(self, number: float) -> float:
        """Tolerance in `unit` at a value; 1 of whole numbers."""
        given, (low, high) = self.tolerance, self.bounds
        if self.integer:
            return 1.0
        if given is None:
            return DEFAULT_TOLERANCE * (high - low)
        if isinstance(given, str) and given.strip().endswith("%"):
            share = split(given.strip()[:-1], self.name)[0] / 100.0
            # a share of nothing would be no tolerance
            return share * (abs(number) or high - low)
        return self.number(given)


def split(value: object, key: str) -> tuple[float, str]:
    """Number and unit of a value as the case file holds it; CaseError (E-VARIABLE) where it is no number."""
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        number, unit = float(value), ""
    else:
        match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
        number, unit = (float(match[1]), match[2]) if match else (np.nan, "")
    if not np.isfinite(number):
        raise CaseError(
            "not a number with a unit",
            code="E-VARIABLE",
            key=key,
            value=value,
            limit='as in "40 um", or 0.5 for an entry without dimension',
        )
    return number, unit


def current(case: Case, variable: Variable) -> float | None:
    """Value that the case has now, in the unit of the variable; None where its file leaves the entry out."""
    table: object = text.parse(case.source, case.name)
    for part in re.findall(r"\[(\d+)\]|([^.\[\]]+)", variable.key[0]):
        try:
            table = table[int(part[0])] if part[0] else table[part[1]]
        except (KeyError, IndexError, TypeError):
            return None
    return variable.number(table)


def start_point(case: Case, variables: Sequence[Variable]) -> np.ndarray:
    """Values that the case has now, within the bounds; the middle for entries that it leaves out."""
    found = []
    for variable in variables:
        low, high = variable.bounds
        value = current(case, variable)
        found.append(0.5 * (low + high) if value is None else min(max(value, low), high))
    return np.array(found)


def check_variables(case: Case, variables: Sequence[Variable]) -> None:
    """Refuse variables that the case file does not know, or whose bounds it refuses.

    Raises
    ------
    CaseError
        E-VARIABLE: none, or one key twice; what `femgear.with_value` refuses.
    """
    keys = [key for variable in variables for key in variable.key]
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if not keys or twice:
        raise CaseError(
            f"{', '.join(twice)} is given twice" if twice else "an optimisation needs a design variable",
            code="E-VARIABLE",
            key=twice[0] if twice else None,
            limit="each entry of the case file once",
        )
    for variable in variables:
        for bound in variable.bounds:
            try:
                with_values(case, dict.fromkeys(variable.key, variable.text(bound)))
            except CaseError as error:
                if error.code == "E-KEY" and error.message.endswith("is not a list"):
                    # entries of a list can only be varied where the file has them
                    entry = variable.name.split("[")[0]
                    error.remedy = f"give the case a table [[{entry}]] for every entry that is varied"
                raise
