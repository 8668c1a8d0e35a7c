"""Building blocks of the sections of a case file: quantities, numbers and counts within plausible windows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError, core_schema

from femgear.case.text import found, shown
from femgear.case.units import ANGLE, Dimension, to_si
from femgear.errors import CaseError


class Section(BaseModel):
    """A table of a case file: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


@dataclass(frozen=True, eq=False)
class _Reader:
    """How an entry is read and checked, and what the JSON schema says of it; stands in `Annotated`."""

    read: Callable[[object], object]
    schema: dict[str, Any]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return dict(self.schema)


def Quantity(dimension: Dimension, low: float, high: float) -> _Reader:
    """_Reader of a quantity given with its unit, an SI float in the model.

    ``low`` and ``high`` are the ends of the plausible window in SI units.
    """
    limit = f"{dimension.show(low)} to {dimension.show(high)}"

    def convert(value: object) -> float:
        if isinstance(value, int | float) and not isinstance(value, bool):
            raise refuse(
                f"{dimension.name} needs its unit",
                code="E-UNIT",
                value=value,
                remedy=_as_text(value, low, high, dimension),
            )
        if not isinstance(value, str):
            raise refuse(f"{dimension.name} is needed, not {described(value)}", code="E-TYPE", value=value)
        try:
            number = to_si(value, dimension)
        except CaseError as error:
            raise refuse(
                error.message, code=error.code, value=value, limit=error.limit, remedy=error.remedy
            ) from None
        if not low <= number <= high:
            message = f"{dimension.name} of {dimension.show(number)} is not plausible"
            hint = _factor_hint(number, low, high, dimension, value)
            raise refuse(message, code="E-RANGE", value=value, limit=limit, remedy=hint)
        return number

    schema = {"type": "string", "description": f"{dimension.name} with its unit, {limit}"}
    return _Reader(convert, schema)


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
    for factor in (1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9):
        if low <= number * factor <= high:
            shown = dimension.show(number * factor)
            return f"a factor of {factor:g} would make it plausible ({shown}): check the unit"
    return None


def Number(
    low: float, high: float, *, open_low: bool = False, open_high: bool = False, note: str = ""
) -> _Reader:
    """_Reader of a plain number (integer or float, no text, no boolean) within a window.

    Parameters
    ----------
    low, high : float
    open_low, open_high : bool
        Whether the ends themselves are refused.
    note : str
        Why, for the message of a refusal.
    """
    limit = f"{'above' if open_low else 'from'} {low:g} {'to below' if open_high else 'to'} {high:g}"

    def convert(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            remedy = "write it without quotes" if isinstance(value, str) else None
            raise refuse(
                f"a number is needed, not {described(value)}", code="E-TYPE", value=value, remedy=remedy
            )
        above = low < value if open_low else low <= value
        below = value < high if open_high else value <= high
        if not (above and below):
            raise refuse(
                f"the number is out of range{': ' + note if note else ''}",
                code="E-RANGE",
                value=found(value) if isinstance(value, int) else value,
                limit=limit,
            )
        return float(value)

    schema = {"type": "number", "description": f"{limit}{'; ' + note if note else ''}"}
    return _Reader(convert, schema)


PAIR, TRIPLE = (Field(min_length=count, max_length=count) for count in (2, 3))
"""Of lists with so many entries, in `Annotated`."""
RIGID = "rigid"


def StiffnessOrRigid(dimension: Dimension, low: float, high: float) -> _Reader:
    """_Reader of a stiffness that may be the text ``"rigid"``, infinite in the model."""
    stiffness = Quantity(dimension, low, high)

    def rigid_too(value: object) -> object:
        return math.inf if value == RIGID else stiffness.read(value)

    return _Reader(rigid_too, {"type": "string", "description": f'{dimension.name}, or "{RIGID}"'})


def Count(low: int, high: int, *, note: str = "", signed: bool = False) -> _Reader:
    """_Reader of a whole number within a window; 27.0, "27" and true are refused.

    Parameters
    ----------
    low, high : int
    note : str
        Why more is refused, for the message.
    signed : bool
        Accept the negative of the number too, as ISO 21771 writes the teeth of internal gears.
    """

    def convert(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            remedy = "write it without quotes" if isinstance(value, str) else None
            raise refuse(
                f"a whole number is needed, not {described(value)}", code="E-TYPE", value=value, remedy=remedy
            )
        number = abs(value) if signed else value
        if not low <= number <= high:
            why = note if number > high else ""
            raise refuse(
                f"{shown(value)} is out of range{': ' + why if why else ''}",
                code="E-RANGE",
                value=found(value),
                limit=f"{low} to {high}",
            )
        return number

    schema = {"type": "integer", "minimum": -high if signed else low, "maximum": high}
    return _Reader(convert, schema)


def _one_line(value: object) -> str:
    """A printable text of at most 200 characters."""
    if not isinstance(value, str):
        raise refuse(f"a text is needed, not {described(value)}", code="E-TYPE", value=value)
    if len(value) > 200 or not value.isprintable():
        raise refuse(
            "the title must be one printable line",
            code="E-RANGE",
            value=value,
            limit="200 printable characters",
        )
    return value


Title = Annotated[str, BeforeValidator(_one_line)]


def refuse(
    message: str,
    *,
    code: str,
    value: object = None,
    limit: str | None = None,
    remedy: str | None = None,
) -> PydanticCustomError:
    """Validation error that `femgear.case.problems` turns into a `CaseError` with these fields."""
    kind: Any = code
    told = {"message": message, "found": value, "limit": limit, "remedy": remedy}
    return PydanticCustomError(kind, "{message}", told)


def described(value: object) -> str:
    """What a TOML value is, in words."""
    names = {bool: "true or false", int: "an integer", float: "a number", str: "a text", list: "a list"}
    return names.get(type(value), "a table" if isinstance(value, dict) else "a date or time")
