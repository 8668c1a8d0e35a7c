"""Quantities of a case file: text with units to SI numbers, and fields with plausible windows for sections.

No other module talks to pint.
"""

from __future__ import annotations

import difflib
import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import core_schema

from femgear.case.text import described, found, shown
from femgear.errors import CaseError

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)
# Without these a text has none of the mistakes of `_check_number`.
_NO_NUMBER = re.compile(r"\d,\d|[−–]|\d\s\d")
# A product of named units with one- or two-digit exponents: pint would also evaluate "mm**9**9**9".
_FACTOR = r"[A-Za-zµμ°]+(?:(?:\^|\*\*)[ ]?-?\d{1,2}|[²³])?"
_UNIT = re.compile(rf"(?:1[ ]?/[ ]?)?{_FACTOR}(?:(?:[ ]?[*/·⋅.][ ]?|[ ]){_FACTOR}){{0,7}}")


# What most cases are written in, with its SI value: loading all units of pint takes longer than a case.
_FACTORS = {
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    "rad": {"rad": 1.0, "deg": math.pi / 180},
    "rad/s": {"rad/s": 1.0, "rpm": math.pi / 30},
    "N m": {"N m": 1.0, "kN m": 1e3},
    "kg": {"kg": 1.0, "g": 1e-3},
    "kg m^2": {"kg m^2": 1.0, "kg mm^2": 1e-6},
    "kg/m^3": {"kg/m^3": 1.0},
    "Pa": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9, "N/mm^2": 1e6},
    "N/m": {"N/m": 1.0, "N/mm": 1e3, "kN/mm": 1e6, "N/um": 1e6, "N/µm": 1e6},
    "N m/rad": {"N m/rad": 1.0, "kN m/rad": 1e3},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "s": {"s": 1.0, "ms": 1e-3},
    "h": {"h": 1.0},
    "dB": {"dB": 1.0},
    "m/s^2": {"m/s^2": 1.0},
    "N/m^3": {"N/m^3": 1.0},
    "m^2/s": {"m^2/s": 1.0, "mm^2/s": 1e-6},
    "m/s": {"m/s": 1.0},
}
# Words of drawings and other programs that pint does not know, or takes for something else.
_WORDS = {
    "rad": {"°": "deg"},
    "rad/s": dict.fromkeys(("rev/min", "r/min", "U/min", "1/min", "min^-1"), "rpm"),
    "N m": {"Nm": "N m", "Nmm": "N mm", "kNm": "kN m", "MNm": "MN m"},
    "kg m^2": {"kgm^2": "kg m^2"},
    "N m/rad": {"Nm/rad": "N m/rad", "Nmm/rad": "N mm/rad", "kNm/rad": "kN m/rad"},
}
_LONGEST_UNIT = 60
"""Characters of a unit."""
_SPELLING = str.maketrans({"*": " ", "·": " ", "⋅": " ", "²": "^2", "³": "^3", "μ": "µ"})


@dataclass(frozen=True)
class Dimension:
    """A physical dimension as the case file knows it.

    Parameters
    ----------
    name : str
        With its article, as messages use it: ``"a length"``.
    si : str
        SI unit, with radians counted: a torsional stiffness is not a torque.
    shown : str
        Unit of messages and tables.
    scale : float
        SI value of one ``shown`` unit.
    """

    name: str
    si: str
    shown: str
    scale: float

    def show(self, value: float) -> str:
        """Write an SI value in the unit ``shown``."""
        return f"{value / self.scale:.6g} {self.shown}"

    def window(self, low: float, high: float) -> str:
        """Write a range of SI values in the unit ``shown``."""
        return f"{self.show(low)} to {self.show(high)}"


LENGTH = Dimension("a length", "m", "mm", 1e-3)
ANGLE = Dimension("an angle", "rad", "deg", math.pi / 180)
SPEED = Dimension("a speed of rotation", "rad/s", "rpm", math.pi / 30)
SMALLEST = 1e-100
"""Least size of a number that is not zero, in SI units: products of three are numbers as well."""
RPM = SPEED.scale
"""One revolution a minute [rad/s]."""
TORQUE = Dimension("a torque", "N m", "N m", 1.0)
FORCE = Dimension("a force", "N", "N", 1.0)
MASS = Dimension("a mass", "kg", "kg", 1.0)
INERTIA = Dimension("a moment of inertia", "kg m^2", "kg m^2", 1.0)
DENSITY = Dimension("a density", "kg/m^3", "kg/m^3", 1.0)
MODULUS = Dimension("a modulus of elasticity", "Pa", "GPa", 1e9)
STRESS = Dimension("a stress", "Pa", "MPa", 1e6)
STIFFNESS = Dimension("a stiffness", "N/m", "N/m", 1.0)
TORSION = Dimension("a torsional stiffness", "N m/rad", "N m/rad", 1.0)
FREQUENCY = Dimension("a frequency", "Hz", "Hz", 1.0)
TIME = Dimension("a time", "s", "s", 1.0)
ACCELERATION = Dimension("an acceleration", "m/s^2", "m/s^2", 1.0)
VISCOSITY = Dimension("a kinematic viscosity", "m^2/s", "mm^2/s", 1e-6)
VELOCITY = Dimension("a velocity", "m/s", "m/s", 1.0)
LINE_LOAD = Dimension("a load over width", "N/m", "N/mm", 1e3)
CELSIUS = 273.15
"""Zero degrees Celsius [K]."""
FOUNDATION = Dimension("a foundation stiffness per area", "N/m^3", "N/m^3", 1.0)


def to_si(
    value: object,
    dimension: Dimension,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    remedy: str | None = None,
) -> float:
    """Convert to SI a quantity such as ``"1.5 mm"``, ``"20 deg"`` or ``"1e-4 kg m^2"``.

    Parameters
    ----------
    value : str
        A number and a product of units; radians and degrees count as a dimension, so that neither
        ``"5 Hz"`` passes as a speed of rotation nor ``"20 %"`` as an angle.
    low, high : float
        Plausible window, in ``dimension.si``.
    remedy : str, optional
        What to do about a value outside that no mistaken unit explains.

    Returns
    -------
    float
        Value in ``dimension.si``.

    Raises
    ------
    CaseError
        ``E-TYPE``: no text. ``E-UNIT``: no number, no unit, an unknown unit or another dimension.
        ``E-FINITE``: overflow. ``E-RANGE``: outside the window.
    """
    if not isinstance(value, str):
        raise _no_text(value, dimension, low, high)
    match = _NUMBER.fullmatch(value)
    _check_number(value, dimension.name)
    if not match:
        message = f"{dimension.name} must start with a number"
        raise CaseError(message, code="E-UNIT", value=value, remedy=f'write it as in "{_one(dimension)}"')
    number, unit = float(match[1]), " ".join(match[2].split())
    if not unit:
        message = f"{dimension.name} needs its unit"
        raise CaseError(message, code="E-UNIT", value=value, remedy=f'write it as in "{_one(dimension)}"')
    if (factor := _factor(unit, dimension)) is None:
        raise _wrong_unit(unit, dimension, value)
    inverse = round(1 / factor)
    # 51/1000 is 0.051 to the last digit, 51*0.001 is not.
    number = number / inverse if abs(inverse * factor - 1) < 1e-12 else number * factor
    if not math.isfinite(number):
        raise CaseError("the number is not finite", code="E-FINITE", value=value, limit="finite numbers")
    if 0.0 < abs(number) < SMALLEST:
        raise _too_small(value)
    # an end of the window in another unit misses it by rounding
    end = min(max(number, low), high)
    if abs(end - number) <= 1e-12 * abs(number):
        number = end
    if not low <= number <= high:
        raise CaseError(
            f"{dimension.name} of {dimension.show(number)} is not plausible",
            code="E-RANGE",
            value=value,
            limit=dimension.window(low, high),
            remedy=_factor_hint(number, low, high, dimension, value) or remedy,
        )
    return number


def _check_number(text: str, name: str) -> None:
    """Refuse what stands in no number: a decimal comma, a typographic minus, blanks between digits."""
    if not _NO_NUMBER.search(text):
        return
    if re.match(r"\s*[+-]?\d+,\d", text):
        message = f"{name} has a comma in its number"
        raise CaseError(message, code="E-UNIT", value=text, remedy="use a decimal point")
    if (usual := re.sub(r"[−–](?=[\d.])", "-", text)) != text:
        message = f"{name} has a typographic minus"
        raise CaseError(message, code="E-UNIT", value=text, remedy=f'write it with a hyphen, "{usual}"')
    if (usual := re.sub(r"(?<=\d)\s(?=\d{3}(?!\d))", "", text)) != text:
        message = f"{name} has a blank in its number"
        raise CaseError(message, code="E-UNIT", value=text, remedy=f'leave it out, "{usual}"')


def _too_small(value: object) -> CaseError:
    """Make the refusal of a number that is next to none."""
    return CaseError(
        "the number is next to none",
        code="E-RANGE",
        value=value,
        limit=f"0, or {SMALLEST:g} or more of either sign in SI units",
        remedy="write 0 where it has no effect",
    )


def _no_text(value: object, dimension: Dimension, low: float, high: float) -> CaseError:
    """Refusal of a bare number, or of what is no quantity at all."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        remedy = _as_text(value, low, high, dimension)
        return CaseError(f"{dimension.name} needs its unit", code="E-UNIT", value=value, remedy=remedy)
    message = f"{dimension.name} is needed, not {described(value)}"
    return CaseError(message, code="E-TYPE", value=value, remedy=f'write it as in "{_one(dimension)}"')


def _as_text(value: float, low: float, high: float, dimension: Dimension) -> str:
    """How to write a bare number: in the unit of messages, or that of an SI value, where it is plausible."""
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    readings = []
    if low <= number * dimension.scale <= high:
        readings.append(f'"{value} {dimension.shown}"')
    if dimension.scale != 1.0 and low <= number <= high:
        readings.append(f'"{dimension.show(number)}" if it is in {dimension.si}')
    shown = ", or ".join(readings) or f'such as "{dimension.show(dimension.scale)}"'
    return f"write it as text with the unit, {shown}"


def _factor_hint(number: float, low: float, high: float, dimension: Dimension, text: str) -> str | None:
    """Guess of the mistaken unit where a usual factor brings the number into its window."""
    if dimension is ANGLE:
        for factor, read, written in ((math.pi / 180, "deg", "rad"), (180 / math.pi, "rad", "deg")):
            if written in text and low <= number * factor <= high:
                return f"degrees and radians seem to be mixed up: {read} would be plausible"
        return None
    usual = (1e3, 1e-3) if dimension is FREQUENCY else (1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9)
    for factor in usual:
        if low <= number * factor <= high:
            shown = dimension.show(number * factor)
            return f"a factor of {factor:g} would make it plausible ({shown}): check the unit"
    return None


@functools.lru_cache(maxsize=256)
def _factor(unit: str, dimension: Dimension) -> float | None:
    """SI value of one ``unit``, remembered for lists of many speeds; None unless it has the dimension."""
    if len(unit) > _LONGEST_UNIT or not _UNIT.fullmatch(unit):
        return None
    usual = _usual(unit, dimension)
    if (factor := _FACTORS.get(dimension.si, {}).get(usual)) is not None:
        return factor
    root, expected = _root(usual), _root(dimension.si)
    if root is None or expected is None or root[1] != expected[1]:
        return None
    return root[0] / expected[0]


def _usual(unit: str, dimension: Dimension) -> str:
    """Unit as the table of factors spells it."""
    usual = re.sub(r" ?/ ?", "/", " ".join(unit.replace("**", "^").translate(_SPELLING).split()))
    return _WORDS.get(dimension.si, {}).get(usual, usual)


def _wrong_unit(unit: str, dimension: Dimension, text: str) -> CaseError:
    """Make the refusal of a unit that is none, or one of another dimension."""
    if len(unit) > _LONGEST_UNIT or not _UNIT.fullmatch(unit):
        return CaseError(
            f"{unit[:_LONGEST_UNIT]!a} is not a product of units",
            code="E-UNIT",
            value=text,
            limit="unit names with * / ^ or blanks, without brackets",
            remedy=_near(unit[:_LONGEST_UNIT], dimension),
        )
    usual = _usual(unit, dimension)
    what = f"{unit!a} is not a unit of {dimension.name.split(' ', 1)[1]}"
    return CaseError(
        what if _root(usual) else f"unknown unit {unit!a}",
        code="E-UNIT",
        value=text,
        limit=f"units convertible to {dimension.si}",
        remedy=_near(usual, dimension),
    )


def _one(dimension: Dimension) -> str:
    """How one unit of a dimension is written."""
    return dimension.show(dimension.scale)


def _near(unit: str, dimension: Dimension) -> str:
    """How a unit is written that none is read from: units with similar names, an example."""
    spelt = {unit_name.lower(): unit_name for names in (_WORDS, _FACTORS) for unit_name in names.get(dimension.si, ())}
    near = [spelt[spelling] for spelling in difflib.get_close_matches(unit.lower(), spelt, n=2)]
    example = f'write it as in "{_one(dimension)}"'
    return f"did you mean {' or '.join(near)}? {example}" if near else example


@functools.lru_cache(maxsize=256)
def _root(unit: str) -> tuple[float, dict[str, float]] | None:
    """Factor to and exponents of root units (radian among them); None if pint does not know the unit."""
    import pint

    try:
        quantity = _registry().Quantity(1.0, _registry().parse_units(unit)).to_root_units()
    except (pint.errors.PintError, ValueError):
        return None
    exponents: Any = quantity._units
    return float(quantity.magnitude), {str(name): float(power) for name, power in exponents.items()}


@functools.cache
def _registry():
    """All units of pint, loaded when the first unusual one needs them."""
    import pint

    return pint.UnitRegistry()


class Section(BaseModel):
    """A table of a case file: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def given(self, *names: str) -> list[str]:
        """List those of some entries that are given."""
        return [name for name in names if getattr(self, name) is not None]


@dataclass(frozen=True, eq=False)
class _Reader:
    """How an entry is read and checked, and what is said of it elsewhere; stands in `Annotated`.

    ``read`` turns what the file holds into the value in SI units, ``schema`` is what the JSON schema says of it.
    """

    read: Callable[[object], object]
    schema: dict[str, Any]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return dict(self.schema)


def Quantity(dimension: Dimension, low: float, high: float, *, remedy: str | None = None) -> _Reader:
    """Make the reader of a quantity given with its unit, an SI float in the model.

    ``low`` and ``high`` are the ends of the plausible window in SI units; ``remedy`` as in `to_si`.
    """
    read = partial(to_si, dimension=dimension, low=low, high=high, remedy=remedy)
    schema = {
        "type": "string",
        "description": f"{dimension.name} with its unit, {dimension.window(low, high)}",
        "x-unit": dimension.shown,
        "x-scale": dimension.scale,
        "x-window": [low / dimension.scale, high / dimension.scale],
    }
    return _Reader(read, schema)


def Number(low: float, high: float, *, open_low: bool = False, open_high: bool = False, note: str = "") -> _Reader:
    """Make the reader of a plain number (integer or float, no text, no boolean) within a window.

    Its ends themselves are refused where they are open; the note says why, for the message of a refusal.
    """
    limit = f"{'above' if open_low else 'from'} {low:g} {'to below' if open_high else 'to'} {high:g}"

    def convert(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            match = _NUMBER.fullmatch(value) if isinstance(value, str) else None
            remedy = None
            if match and match[2].strip() == "%":
                remedy = f"write {float(match[1]) / 100:g}"
            elif match:
                remedy = "write the number alone, without unit" if match[2].strip() else "write it without quotes"
            message = f"a number is needed, not {described(value)}"
            raise CaseError(message, code="E-TYPE", value=value, limit=limit, remedy=remedy)
        above = low < value if open_low else low <= value
        below = value < high if open_high else value <= high
        if 0.0 < abs(value) < SMALLEST:
            raise _too_small(value)
        if not (above and below):
            raise CaseError(
                f"the number is out of range{': ' + note if note else ''}",
                code="E-RANGE",
                value=found(value) if isinstance(value, int) else value,
                limit=limit,
            )
        return float(value)

    schema = {"type": "number", "description": f"{limit}{'; ' + note if note else ''}"}
    return _Reader(convert, schema)


Values = partial(Field, fail_fast=True)
"""Make the limits of a list of numbers, of which the first that is wrong is refused, in `Annotated`."""


def at_most(count: int) -> BeforeValidator:
    """Make the reader of a list that is refused before its entries are read, where it has more."""

    def few(value: object) -> object:
        if isinstance(value, list) and len(value) > count:
            raise wrong_length(len(value), f"at most {count}", many=True)
        return value

    return BeforeValidator(few)


def wrong_length(length: int, limit: str, *, many: bool) -> CaseError:
    """Make the refusal of a list with too many entries, or too few."""
    message = f"{length} entries are too {'many' if many else 'few'}"
    return CaseError(message, code="E-RANGE", limit=limit, remedy="leave some out" if many else "add what is missing")


PAIR, TRIPLE = (Values(min_length=count, max_length=count) for count in (2, 3))
"""Of lists with so many entries, in `Annotated`."""
RIGID = "rigid"


def StiffnessOrRigid(dimension: Dimension, low: float, high: float) -> _Reader:
    """Make the reader of a stiffness that may be ``"rigid"``, infinite in the model; see `Quantity`."""
    stiffness = Quantity(dimension, low, high)

    def rigid_too(value: object) -> object:
        return math.inf if value == RIGID else _read_or_word(stiffness, value, RIGID)

    return _Reader(rigid_too, {"type": "string", "description": f'{dimension.name}, or "{RIGID}"'})


_DEGREES = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+))\s*(degC|°C|C|K)\s*")


def Temperature(low: float, high: float) -> _Reader:
    """Make the reader of a temperature such as ``"90 degC"`` or ``"363 K"``, kelvins in the model.

    ``low`` and ``high`` are the ends of the plausible window in degrees Celsius.
    """
    window = f"{low:g} to {high:g} degC"

    def convert(value: object) -> float:
        match = _DEGREES.fullmatch(value) if isinstance(value, str) else None
        if match is None:
            message = "a temperature is a number with degC or K"
            raise CaseError(message, code="E-UNIT", value=value, limit=window, remedy='write it as in "90 degC"')
        kelvin = float(match[1]) + (0.0 if match[2] == "K" else CELSIUS)
        if not low <= kelvin - CELSIUS <= high:
            what = f"a temperature of {kelvin - CELSIUS:g} degC is not plausible"
            raise CaseError(what, code="E-RANGE", value=value, limit=window)
        return kelvin

    return _Reader(convert, {"type": "string", "description": f"a temperature with its unit, {window}"})


FREE = "free"


def _read_or_word(quantity: _Reader, value: object, word: str) -> object:
    """Read a quantity in whose place a word may stand; refusals say that it may."""
    try:
        return quantity.read(value)
    except CaseError as error:
        error.limit = f'{error.limit}, or "{word}"' if error.limit else f'a quantity with its unit, or "{word}"'
        raise


def LengthOrFree(low: float, high: float) -> _Reader:
    """Make the reader of a length [m] that may be ``"free"``, which is found; see `Quantity`."""
    length = Quantity(LENGTH, low, high)

    def free_too(value: object) -> object:
        return FREE if value == FREE else _read_or_word(length, value, FREE)

    return _Reader(free_too, {"type": "string", "description": f'{length.schema["description"]}, or "{FREE}"'})


def Count(low: int, high: int, *, note: str = "", signed: bool = False, remedy: str | None = None) -> _Reader:
    """Make the reader of a whole number within a window; 27.0, "27" and true are refused.

    Parameters
    ----------
    note : str
        Why more is refused, for the message.
    signed : bool
        Accept the negative of the number too, as ISO 21771 writes the teeth of internal gears.
    remedy : str, optional
        What to do about a number outside.
    """

    limit = f"{low} to {high}" if low < high else f"{low}"

    def convert(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise _no_whole_number(value, limit)
        number = abs(value) if signed else value
        if not low <= number <= high:
            why, sign = (
                note if number > high else "",
                f"did you mean {-value}?" if low <= -value <= high else None,
            )
            raise CaseError(
                f"{shown(value)} is out of range{': ' + why if why else ''}",
                code="E-RANGE",
                value=found(value),
                limit=limit,
                remedy=sign or remedy,
            )
        return number

    schema = {"type": "integer", "minimum": -high if signed else low, "maximum": high}
    return _Reader(convert, schema)


def _no_whole_number(value: object, limit: str) -> CaseError:
    """Make the refusal of what is no whole number, with the number that it holds, in quotes or not."""
    match = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    written = match[1] if match and not match[2].strip() else ""
    number = float(written) if written else value if isinstance(value, float) else None
    what, remedy = described(value), None
    if number is not None and math.isfinite(number):
        what, remedy = (written or str(number)), f"write {int(number)}" if number.is_integer() else None
        if remedy and written.lstrip("+-").isdigit():
            what, remedy = described(value), "write it without quotes"
    message = f"a whole number is needed, not {what}"
    return CaseError(message, code="E-TYPE", value=value, limit=limit, remedy=remedy)


def printable_line(value: object, *, name: str = "title", least: int = 0, most: int = 200) -> str:
    """Check that a text is printable and has so many characters."""
    if not isinstance(value, str):
        message = f"a text is needed, not {described(value)}"
        raise CaseError(message, code="E-TYPE", value=value, remedy="write it in quotation marks")
    if len(value) > most or not value.isprintable() or len(value.strip()) < least:
        limit = f"{f'{least} to ' * bool(least)}{most} printable characters"
        raise CaseError(f"the {name} must be one printable line", code="E-RANGE", value=value, limit=limit)
    return value


Title = Annotated[str, BeforeValidator(printable_line)]
