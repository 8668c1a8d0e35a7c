"""A problem of optimisation: design variables, the objective, and limits.

A `Variable` is an entry of the case file with bounds in its unit, a `Limit` bounds a quantity, and `Problem`
says what to minimise by changing what. `parse_variable` and `parse_limit` read them from the words of a
command line; `tip_reliefs` makes variables of the reliefs of all loaded flanks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.case.planetary import Case
from femgear.case.quantities import Dimension, to_si
from femgear.errors import CaseError
from femgear.gears.kinematics import torques
from femgear.study.objectives import NUMBER, Speeds, StudyQuantity, named_quantity
from femgear.trains.reading import with_values

Vector = Sequence[float] | np.ndarray
"""Values of the design variables in their units, (n,)."""
Point = tuple[object, ...]
"""Values of the design variables as the case file holds them; empty for the case as it is."""
Shape = Literal["linear", "parabolic"]
"""Of a relief."""
_DEFAULT_TOLERANCE = 0.1
"""Over the range of the variable."""
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_DIGITS = 9
_LATEST_START = 0.93
"""Of a relief, over the height from the pitch circle to the tip: later ones are chamfers."""


@dataclass(frozen=True)
class Variable:
    """One design variable: entries of the case file, bounds and tolerance.

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
                "the bounds of a design variable are equal"
                if low == high
                else "the bounds of a design variable are in the wrong order",
                code="E-VARIABLE",
                key=self.name,
                value=f"{self.low}..{self.high}",
                limit="low < high",
                remedy=f'write "{self.high}..{self.low}"' if low > high else "give two different bounds",
            )
        if self.integer and (self.unit or low != round(low) or high != round(high)):
            raise CaseError(
                "bounds of whole numbers are whole numbers",
                code="E-VARIABLE",
                key=self.name,
                value=f"{self.low} to {self.high}",
                limit="two whole numbers without unit",
            )
        if not self.tolerance_at(high) > 0:
            raise CaseError(
                "a tolerance is over 0", code="E-VARIABLE", key=self.name, value=self.tolerance, limit="> 0"
            )

    def _check_units(self) -> None:
        """Refuse bounds of which one has a unit."""
        (_, first), (_, second) = (split(bound, self.name) for bound in (self.low, self.high))
        if bool(first) != bool(second):
            unit = first or second
            low, high = (bound if has else f"{bound} {unit}" for bound, has in ((self.low, first), (self.high, second)))
            raise CaseError(
                "one bound has a unit and the other has none",
                code="E-UNIT",
                key=self.name,
                value=f"{self.low}..{self.high}",
                limit="the same kind of unit at both bounds",
                remedy=f'write "{low}..{high}"',
            )

    @property
    def keys(self) -> tuple[str, ...]:
        """Dotted keys that get the value."""
        return tuple(self.key)

    @property
    def name(self) -> str:
        """Its keys as one text."""
        return " = ".join(self.keys)

    @property
    def unit(self) -> str:
        """Unit of the lower bound; empty for a number."""
        return split(self.low, self.name)[1]

    @property
    def bounds(self) -> tuple[float, float]:
        """Both bounds in `unit`."""
        return split(self.low, self.name)[0], self.number(self.high)

    def number(self, value: object) -> float:
        """Convert a value of the case file to a number in `unit`; E-UNIT for another dimension, or none."""
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
        """Write a number in `unit` as the case file holds it, with nine digits."""
        if self.integer:
            return round(number)
        rounded = float(f"{number:.{_DIGITS}g}") + 0.0
        return f"{rounded:.{_DIGITS}g} {self.unit}" if self.unit else rounded

    def tolerance_at(self, number: float) -> float:
        """Find the tolerance at a value, both in `unit`; 1 of whole numbers."""
        given, (low, high) = self.tolerance, self.bounds
        if self.integer:
            return 1.0
        if given is None:
            return _DEFAULT_TOLERANCE * (high - low)
        if isinstance(given, str) and given.strip().endswith("%"):
            share = split(given.strip()[:-1], self.name)[0] / 100.0
            # a share of nothing would be no tolerance
            return share * (abs(number) or high - low)
        return self.number(given)


def split(value: object, key: str) -> tuple[float, str]:
    """Split a value of the case file into number and unit; E-VARIABLE (CaseError) where it is no number."""
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


def current_value(case: Any, key: str) -> Any:
    """Read an entry of the file of a case as it stands there; None where the file leaves it out."""
    table: Any = case_text.parse(case.source, case.name)
    for part in re.findall(r"\[(\d+)\]|([^.\[\]]+)", key):
        try:
            table = table[int(part[0])] if part[0] else table[part[1]]
        except (KeyError, IndexError, TypeError):
            return None
    return table


def _current(case: Any, variable: Variable) -> float | None:
    """Value that the case has now, in the unit of the variable; None where its file leaves the entry out."""
    value = current_value(case, variable.keys[0])
    return None if value is None else variable.number(value)


def start_point(case: Case, variables: Sequence[Variable]) -> np.ndarray:
    """Find the values (n,) of the case, within the bounds; the middle for entries that it leaves out."""
    start = []
    for variable in variables:
        low, high = variable.bounds
        value = _current(case, variable)
        start.append(0.5 * (low + high) if value is None else min(max(value, low), high))
    return np.array(start)


def _check_variables(case: Case, variables: Sequence[Variable]) -> None:
    """Refuse variables that the case file does not know, keys given twice, and bounds that it refuses."""
    keys = [key for variable in variables for key in variable.keys]
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
            with_values(case, dict.fromkeys(variable.keys, variable.text(bound)))


@dataclass(frozen=True)
class Limit:
    """What a ``quantity`` may be, in SI units: at least ``low``, at most ``high``; one of them is enough."""

    quantity: StudyQuantity
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self):
        finite = math.isfinite(self.low) or math.isfinite(self.high)
        if not (finite and self.low <= self.high):
            raise CaseError(
                "a limit needs a lower or an upper bound",
                code="E-OBJECTIVE",
                key=self.quantity.name,
                value=f"{self.low} to {self.high}",
                limit=f"numbers in {self.quantity.dimension.si}, low <= high",
            )

    def violation(self, value: float) -> float:
        """Compute how far a value [SI] lies outside, over the size of the bound; 0 inside."""
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
        What is changed, within its bounds.
    objective : StudyQuantity
        What is minimised.
    also : sequence of StudyQuantity
        Reported of the case and of the optimum as well.
    limits : sequence of Limit
        What a design must keep to.

    Raises
    ------
    CaseError
        Keys that the case file does not know, bounds that it refuses, a quantity twice.
    """

    case: Case
    variables: Sequence[Variable]
    objective: StudyQuantity
    also: Sequence[StudyQuantity] = ()
    limits: Sequence[Limit] = ()

    def __post_init__(self):
        for name in ("variables", "also", "limits"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        _check_variables(self.case, self.variables)

    @property
    def reported(self) -> tuple[StudyQuantity, ...]:
        """Objective, further quantities and those of the limits, each once."""
        every = (self.objective, *self.also, *(limit.quantity for limit in self.limits))
        return tuple({quantity.name: quantity for quantity in every}.values())

    @property
    def bounds(self) -> np.ndarray:
        """Bounds in the units of the variables, (n, 2)."""
        return np.array([variable.bounds for variable in self.variables])

    def point(self, x: Vector) -> tuple[str | float | int, ...]:
        """Write values (n,) of the variables as the case file holds them."""
        return tuple(variable.text(float(value)) for variable, value in zip(self.variables, x, strict=True))


def parse_limit(text: str, *, speeds: Speeds | None = None, case: Any = None) -> Limit:
    """Read a limit in words such as ``"root stress sun <= 300 MPa"``; speeds and case as for `named_quantity`.

    CaseError: no limit, no such quantity, or no number (E-OBJECTIVE); E-UNIT.
    """
    match = re.fullmatch(r"\s*(.+?)\s*(<=|>=)\s*(.+?)\s*", text, re.DOTALL)
    if not match:
        example = '"contact ratio sun-planet >= 1.3" or "root stress sun <= 300 MPa"'
        raise CaseError("not a limit", code="E-OBJECTIVE", key="--limit", value=text, remedy=f"write it as {example}")
    quantity = named_quantity(match[1], speeds=speeds, case=case)
    if quantity.dimension is NUMBER:
        bound = _number(match[3])
        if not isinstance(bound, float):
            remedy = f"write a plain number behind {match[2]}: {quantity.name} has no unit"
            raise CaseError("not a number", code="E-OBJECTIVE", key="--limit", value=text, remedy=remedy)
    else:
        bound = to_si(match[3], quantity.dimension)
    return Limit(quantity, low=bound) if match[2] == ">=" else Limit(quantity, high=bound)


def parse_variable(text: str) -> Variable:
    """Read the variable ``KEY=LOW..HIGH`` or ``KEY=LOW..HIGH +- TOLERANCE``; others: E-VARIABLE, E-UNIT.

    Entries that get one value are ``KEY1,KEY2=LOW..HIGH``.
    """
    match = re.fullmatch(r"\s*([^=]+?)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*(?:\+-\s*(.+?)\s*)?", text, re.DOTALL)
    if not match:
        raise CaseError(
            "not a design variable",
            code="E-VARIABLE",
            key="--vary",
            value=text,
            limit="KEY=LOW..HIGH, KEY=LOW..HIGH +- TOLERANCE or KEY1,KEY2=LOW..HIGH",
            remedy='--vary "sun.modifications[0].amount=0 um..15 um +- 1 um"',
        )
    key, low, high, tolerance = match.groups()
    low, high, keys = _number(low), _number(high), tuple(part.strip() for part in key.split(","))
    return Variable(keys, low, high, tolerance=_number(tolerance) if tolerance else None)


def _number(text: str) -> str | float:
    """A number without unit as a number."""
    try:
        return float(text)
    except ValueError:
        return text


def tip_reliefs(case: Case, *, shape: Shape = "parabolic") -> tuple[Case, tuple[Variable, ...]]:
    """Add a tip relief to every loaded flank of a case; amounts and starts are the variables.

    Sun and ring have one relief more, the planets two, for the flanks that touch sun and ring. Their amounts
    are zero, so that the case computes as before. The variables are amounts [um], to a hundredth of the
    module, with a tolerance of 1 um, and start diameters [mm], from the pitch circle to near the tip, with
    one of 0.1 mm. A linear ``shape`` begins with a kink, under which contact pressure has no limit.
    """
    gears, most = planetary_set(case), 0.01 * case.sun.module
    back = torques(gears, member=case.operation.input, torque=case.operation.torque).sun < 0
    sides = ("ring side", "sun side") if back else ("sun side", "ring side")
    sun, planet, ring = gears.sun, gears.planet, gears.ring
    ratio = gears.centre_distance / (sun.teeth + planet.teeth)
    inner = gears.centre_distance / (ring.teeth - planet.teeth)
    # pitch radii of both meshes
    flanks = (
        (sun, "", ratio * sun.teeth),
        (planet, sides[0], ratio * planet.teeth),
        (planet, sides[1], inner * planet.teeth),
        (ring, "", inner * ring.teeth),
    )
    variables: list[Variable] = []
    for gear, side, pitch in flanks:
        given = case_text.parse(case.source, case.name)[gear.name].get("modifications", [])
        first, last = pitch, pitch + _LATEST_START * (gear.tip_radius - pitch)
        low, high = (f"{2e3 * radius:.6g} mm" for radius in sorted((first, last)))
        start = f"{1e3 * (first + last):.6g} mm"
        table = {"kind": "tip relief", "amount": "0 um", "start_diameter": start, "shape": shape}
        table |= {"flank": side} if side else {}
        case = with_values(case, {f"{gear.name}.modifications": [*given, table]})
        key = f"{gear.name}.modifications[{len(given)}]"
        variables += [
            Variable(f"{key}.amount", "0 um", f"{1e6 * most:.6g} um", tolerance="1 um"),
            Variable(f"{key}.start_diameter", low, high, tolerance="0.1 mm"),
        ]
    return case, tuple(variables)
