"""Building blocks of the sections of a case file: quantities, numbers and counts within plausible windows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import core_schema

from femgear.case.text import described, found, shown
from femgear.case.units import Dimension, to_si
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


def Quantity(dimension: Dimension, low: float, high: float, *, open_low: bool = False) -> _Reader:
    """_Reader of a quantity given with its unit, an SI float in the model.

    Parameters
    ----------
    dimension : Dimension
    low, high : float
        Plausible window, in SI units.
    open_low : bool
        The low end itself is refused too.
    """
    read = partial(to_si, dimension=dimension, low=low, high=high, open_low=open_low)
    limit = dimension.window(low, high, open_low=open_low)
    return _Reader(read, {"type": "string", "description": f"{dimension.name} with its unit, {limit}"})


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
            raise CaseError(
                f"a number is needed, not {described(value)}", code="E-TYPE", value=value, remedy=remedy
            )
        above = low < value if open_low else low <= value
        below = value < high if open_high else value <= high
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
            raise CaseError(
                f"a whole number is needed, not {described(value)}", code="E-TYPE", value=value, remedy=remedy
            )
        number = abs(value) if signed else value
        if not low <= number <= high:
            why = note if number > high else ""
            raise CaseError(
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
        raise CaseError(f"a text is needed, not {described(value)}", code="E-TYPE", value=value)
    if len(value) > 200 or not value.isprintable():
        raise CaseError(
            "the title must be one printable line",
            code="E-RANGE",
            value=value,
            limit="200 printable characters",
        )
    return value


Title = Annotated[str, BeforeValidator(_one_line)]
