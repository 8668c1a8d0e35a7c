"""Case file of the oscillator: ``model = "oscillator"``."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from femgear.case.fields import Number, Quantity, Title
from femgear.case.problems import combine, translate
from femgear.case.text import ReadCase
from femgear.case.units import MASS, STIFFNESS


class OscillatorSection(BaseModel):
    """A mass on a spring."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    mass: Annotated[float, Quantity(MASS, 1e-3, 1e3)]
    stiffness: Annotated[float, Quantity(STIFFNESS, 1.0, 1e12)]
    damping_ratio: Annotated[float, Number(0.0, 1.0)] = 0.02


class OscillatorCase(ReadCase):
    """A simple oscillator."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    model: Literal["oscillator"]
    title: Title
    oscillator: OscillatorSection


def build(data, text, name, *, numbered=True):
    """Case of the tables of a TOML text."""
    lines = text if numbered else ""
    try:
        case = OscillatorCase.model_validate(data)
    except ValidationError as error:
        raise combine(translate(error, OscillatorCase), lines, name) from None
    case.read_from(text, lines, name)
    return case
